//! The page of the explorer, and the solutions that it asks for.

use crate::failure;
use foldline_view::{Failure, Place, Shown, Watch, html, solution};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::PathBuf;

fn failed(py: Python, error: &Failure) -> PyErr {
    match error {
        Failure::Run(error) => failure::of_run_file(py, error),
        Failure::Study(found) => failure::of_text(py, found),
        Failure::Output(..) => failure::internal(py, error.to_string()),
    }
}

/// Returns the run in a folder as one HTML page. `axes` are harmonics that it has in addition to the stored quantities,
/// `view` is the view with which it opens, as in its address, and `space` the number of bytes for orbits; with `special`
/// those of all special points are included in any case.
#[pyfunction]
pub fn page(
    py: Python,
    folder: PathBuf,
    axes: Vec<String>,
    view: String,
    space: usize,
    special: bool,
) -> PyResult<String> {
    let made = py.detach(|| html(&folder, &Shown { axes, view, space, special }));
    made.map(|(page, _)| page).map_err(|error| failed(py, &error))
}

/// A run of which a page asks for solutions.
#[pyclass(frozen, module = "foldline._native")]
pub struct Explored {
    watch: Watch,
}

#[pymethods]
impl Explored {
    #[new]
    fn new(py: Python, folder: PathBuf) -> PyResult<Explored> {
        let watch = py.detach(|| Watch::open(&folder)).map_err(|error| failed(py, &error))?;
        Ok(Explored { watch })
    }

    /// Bytes of the solution at a position of a branch, or of a special point if `special` is its index rather than -1;
    /// `None` if there is no such point.
    fn solution<'py>(
        &self,
        py: Python<'py>,
        branch: i64,
        position: i64,
        special: i64,
    ) -> PyResult<Option<Bound<'py, PyBytes>>> {
        let place = if special >= 0 { Place::Special(special) } else { Place::Position(position) };
        let found = solution(&self.watch, branch, place).map_err(|error| failure::of_run_file(py, &error))?;
        Ok(found.map(|bytes| PyBytes::new(py, &bytes)))
    }
}
