//! Answers in the cells of maps over parameters, as dictionaries.

use crate::model::Model;
use crate::patience::patiently;
use crate::seeds::{checked, limited};
use foldline::diagram::{CellAnswer, CellValue, CellValues};
use foldline::explore::cells::answers;
use foldline::explore::{Drawn, System};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Values of the cell; label and values of each motion or special point; what fell short; values of an absent motion.
pub type Answered<'py> = (Bound<'py, PyDict>, Vec<(String, Bound<'py, PyDict>)>, String, Bound<'py, PyDict>);

/// Finds the attractors at given parameters by kind or, if `shares`, their basin fractions.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one for each setting of the question")]
pub fn motions<'py>(
    py: Python<'py>,
    model: &Model,
    parameters: &[u8],
    shares: bool,
    samples: usize,
    seed: u64,
    tolerance: f64,
    limits: (Option<usize>, Option<f64>),
) -> PyResult<Answered<'py>> {
    let parameters = checked(py, model, parameters)?;
    let own = model.model.clone();
    let (found, _) = patiently(py, None, &mut |_| Ok(()), move || {
        let system = limited(System::of(&own, &parameters), limits);
        let drawn = Drawn { samples, random: seed };
        match shares {
            true => answers::shares(&system, &parameters, drawn, tolerance, 1),
            false => answers::motions(&system, &own, &parameters, drawn, tolerance, 1),
        }
    })?;
    answered(py, found)
}

/// Returns an answer as dictionaries.
pub fn answered(py: Python<'_>, found: CellAnswer) -> PyResult<Answered<'_>> {
    let items = found.items.iter().map(|(label, values)| Ok((label.clone(), dictionary(py, values)?)));
    let items = items.collect::<PyResult<_>>()?;
    Ok((dictionary(py, &found.values)?, items, found.remark, dictionary(py, &found.absent)?))
}

/// Returns values as a dictionary.
pub fn dictionary<'py>(py: Python<'py>, values: &CellValues) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    for (name, value) in values {
        match value {
            CellValue::Number(own) => out.set_item(name, own)?,
            CellValue::Count(own) => out.set_item(name, own)?,
            CellValue::Text(own) => out.set_item(name, own)?,
        }
    }
    Ok(out)
}
