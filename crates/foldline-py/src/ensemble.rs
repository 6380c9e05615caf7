//! Many trajectories: on the processor, and the source of a kernel for a graphics card.

use crate::bytes::{counted, integers, numbers, read};
use crate::failure;
use crate::model::Model;
use crate::patience::patiently;
use foldline::contract::VectorField;
use foldline::emitted::{LAYOUT, LAYOUT_SECTION, LAYOUT_SETTLE, Parts};
use foldline::explore::course::Way;
use foldline::explore::together::{Starts, together};
use foldline::simulation::Outcome;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Final states `[count][n]`, times, outcomes, accepted and rejected steps.
type Ends<'py> =
    (Bound<'py, PyBytes>, Bound<'py, PyBytes>, Bound<'py, PyBytes>, Bound<'py, PyBytes>, Bound<'py, PyBytes>);

/// Integrates from `starts` `[count][n]` over a time span, at `parameters` `[k]` or, with `own`, `[count][k]`.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one for each argument of the Python function")]
pub fn ensemble<'py>(
    py: Python<'py>,
    model: &Model,
    starts: &[u8],
    parameters: &[u8],
    own: bool,
    span: (f64, f64),
    scales: &[u8],
    tolerance: f64,
    steps: usize,
    jobs: usize,
) -> PyResult<(Ends<'py>, Option<PyErr>)> {
    let (starts, parameters, scales) = (read(starts), read(parameters), read(scales));
    let (field, stop) = (model.model.clone(), Arc::new(AtomicBool::new(false)));
    let n = field.dim();
    let asked = Arc::clone(&stop);
    let work = move || {
        let way = Way { tolerance, steps, stop: &|| asked.load(Ordering::Relaxed) };
        let starts = Starts { states: &starts, parameters: &parameters, own };
        together(&field, starts, [span.0, span.1], &scales, &way, jobs)
    };
    let (found, interrupt) = patiently(py, Some(&stop), &mut |_| Ok(()), work)?;
    let states = counted(py, found.len() * n, found.iter().flat_map(|arrival| arrival.state.iter().copied()))?;
    let times = numbers(py, found.iter().map(|arrival| arrival.time))?;
    let outcomes = integers(py, found.iter().map(|arrival| number(arrival.outcome)))?;
    let steps = integers(py, found.iter().map(|arrival| arrival.steps as i64))?;
    let rejected = integers(py, found.iter().map(|arrival| arrival.rejected as i64))?;
    Ok(((states, times, outcomes, steps, rejected), interrupt))
}

/// Number of an outcome, that of the emitted source.
fn number(outcome: Outcome) -> i64 {
    match outcome {
        Outcome::Reached => 0,
        Outcome::Stopped => 1,
        Outcome::Escaped => 2,
        Outcome::Undefined => 3,
        Outcome::StepTooSmall => 4,
        Outcome::StepLimit => 5,
        Outcome::Chatter => 7,
    }
}

/// Source of the ensemble of a model.
#[pyclass(frozen, module = "foldline._native")]
pub struct Emitted {
    emitted: foldline::emitted::Emitted,
    parts: Parts,
}

#[pymethods]
impl Emitted {
    #[new]
    fn new(py: Python, model: &Model, own: bool, settle: bool, section: bool) -> PyResult<Emitted> {
        let parts = Parts { own_parameters: own, settle, section };
        let emitted = foldline::emitted::Emitted::new(&model.model, parts);
        let refused = |refused: foldline::emitted::Refused| {
            failure::of_argument(py, format!("the model `{}`: {refused}", model.model.name), "a differential equation")
        };
        Ok(Emitted { emitted: emitted.map_err(refused)?, parts })
    }

    #[getter]
    fn source(&self) -> &str {
        &self.emitted.source
    }

    #[getter]
    fn states(&self) -> usize {
        self.emitted.states
    }

    #[getter]
    fn scalars(&self) -> usize {
        self.emitted.scalars
    }

    /// Names and types of the members of the structure `fl_job`.
    #[getter]
    fn layout(&self) -> Vec<(&'static str, char)> {
        let settle = if self.parts.settle { LAYOUT_SETTLE } else { &[] };
        let section = if self.parts.section { LAYOUT_SECTION } else { &[] };
        [LAYOUT, settle, section].concat()
    }

    /// Values that depend on the parameters `[k]` alone.
    fn values<'py>(&self, py: Python<'py>, parameters: &[u8]) -> PyResult<Bound<'py, PyBytes>> {
        numbers(py, self.emitted.scalars(&read(parameters)).into_iter())
    }
}
