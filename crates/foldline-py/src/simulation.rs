//! Trajectories.

use crate::bytes::{numbers, read};
use crate::model::Model;
use crate::patience::patiently;
use foldline::explore::course::{Way, course};
use foldline::simulation::Outcome;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

type Course<'py> = (Bound<'py, PyBytes>, Bound<'py, PyBytes>, Bound<'py, PyBytes>, &'static str);

/// Integrates from `start` `[n]` over a time span: returns times, states `[time][n]`, outputs `[time][outputs]`, and
/// the reason for its end. Output is at `times`, in the direction of the span, or at the ends of the steps if there are
/// none.
#[pyfunction]
pub fn simulate<'py>(
    py: Python<'py>,
    model: &Model,
    start: &[u8],
    span: (f64, f64),
    times: Option<&[u8]>,
    parameters: &[u8],
    tolerance: f64,
) -> PyResult<(Course<'py>, Option<PyErr>)> {
    let (start, parameters, wanted) = (read(start), read(parameters), times.map(read));
    let (own, stop) = (model.model.clone(), Arc::new(AtomicBool::new(false)));
    let asked = Arc::clone(&stop);
    let work = move || {
        let way = Way { tolerance, steps: usize::MAX, stop: &|| asked.load(Ordering::Relaxed) };
        course(&own, &start, [span.0, span.1], wanted.as_deref(), &parameters, &way)
    };
    let (found, interrupt) = patiently(py, Some(&stop), &mut |_| Ok(()), work)?;
    let bytes = |values: Vec<f64>| numbers(py, values.into_iter());
    let course = (bytes(found.times)?, bytes(found.states)?, bytes(found.outputs)?, code(found.outcome));
    Ok((course, interrupt))
}

fn code(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Reached => "reached",
        Outcome::Stopped => "stopped",
        Outcome::Escaped => "escaped",
        Outcome::Undefined => "undefined",
        Outcome::StepTooSmall => "step-too-small",
        Outcome::StepLimit => "step-limit",
        Outcome::Chatter => "chatter",
    }
}
