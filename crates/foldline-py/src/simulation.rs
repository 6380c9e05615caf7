//! Trajectories.

use crate::bytes::{numbers, read};
use crate::model::{Model, outputs_at};
use crate::patience::patiently;
use foldline::contract::{VectorField, Verdict};
use foldline::simulation::{Clocked, Integrator, Outcome, Passage, Tolerance};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

type Course<'py> = (Bound<'py, PyBytes>, Bound<'py, PyBytes>, Bound<'py, PyBytes>, &'static str);

/// The trajectory from `start` `[n]` over a time span: times, states `[time][n]`, outputs `[time][outputs]`, and why it ended. It
/// is given at `times` if there are any, which grow in the direction of the span, else at the ends of its steps.
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
    let unit = model.model.time_unit(&parameters);
    let span = [span.0 / unit, span.1 / unit];
    let wanted = wanted.map(|times| times.iter().map(|t| t / unit).collect::<Vec<f64>>());
    let (own, given) = (model.model.clone(), parameters.clone());
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    let work = move || course(&own, &start, span, wanted.as_deref(), &given, tolerance, &asked);
    let ((times, states, outcome), interrupt) = patiently(py, Some(&stop), &mut |_| Ok(()), work)?;
    let forced = model.model.forced();
    let outputs = outputs_at(&model.model, &states, &parameters, if forced { &times } else { &[] });
    let times = numbers(py, times.into_iter().map(|t| t * unit).collect::<Vec<_>>().into_iter())?;
    let course = (times, numbers(py, states.into_iter())?, numbers(py, outputs.into_iter())?, code(outcome));
    Ok((course, interrupt))
}

fn course(
    model: &foldline::model::Model,
    start: &[f64],
    span: [f64; 2],
    wanted: Option<&[f64]>,
    parameters: &[f64],
    tolerance: f64,
    stop: &AtomicBool,
) -> (Vec<f64>, Vec<f64>, Outcome) {
    let scales = foldline::explore::scales_from(model, start, parameters);
    let absolute = scales.iter().chain([&1.0]).map(|scale| tolerance * scale).collect();
    let field = Clocked(model);
    let integrator = Integrator::new(&field, parameters, Tolerance { relative: tolerance, absolute });
    let n = model.dim();
    let start = &[start, &span[..1]].concat();
    let forwards = span[1] >= span[0];
    let (mut times, mut states) = (Vec::new(), Vec::new());
    let mut keep = |time: f64, state: &[f64]| {
        times.push(time);
        states.extend_from_slice(&state[..n]);
    };
    let mut next = 0;
    let ahead = |next: usize, end: f64| {
        let at = wanted.and_then(|wanted| wanted.get(next)).copied();
        at.filter(|at| if forwards { *at <= end } else { *at >= end })
    };
    match wanted {
        None => keep(span[0], start),
        Some(_) => {
            while let Some(at) = ahead(next, span[0]) {
                keep(at, start);
                next += 1;
            }
        }
    }
    let mut x = start.clone();
    let arrival = integrator.trajectory(start, span, &[], &mut |passage| {
        if let Passage::Step(step) = passage {
            if wanted.is_none() {
                step.end_into(&mut x);
                keep(step.end_time(), &x);
            }
            while let Some(at) = ahead(next, step.end_time()) {
                let length = step.end_time() - step.start_time();
                step.state_into(if length == 0.0 { 1.0 } else { (at - step.start_time()) / length }, &mut x);
                keep(at, &x);
                next += 1;
            }
        }
        if stop.load(Ordering::Relaxed) { Verdict::Stop } else { Verdict::Continue }
    });
    (times, states, arrival.outcome)
}

fn code(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Reached => "reached",
        Outcome::Stopped => "stopped",
        Outcome::Escaped => "escaped",
        Outcome::Undefined => "undefined",
        Outcome::StepTooSmall => "step-too-small",
        Outcome::StepLimit => "step-limit",
    }
}
