//! A single trajectory of a model, for output.
//!
//! **Idea.** The integrator chooses its steps; the trajectory is recorded at the ends of the steps, or at requested
//! times from their interpolants. The sizes of the states come from a rough preliminary trajectory.

use super::scales_from;
use crate::contract::{Batch, Parameters, VectorField, Verdict};
use crate::diagram::Response;
use crate::model::Model;
use crate::simulation::{Clocked, Integrator, Outcome, Passage, Step, Tolerance};

/// A trajectory at discrete times.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// Times, in the unit of the model.
    pub times: Vec<f64>,
    /// `[time][n]` states.
    pub states: Vec<f64>,
    /// `[time][outputs]` outputs.
    pub outputs: Vec<f64>,
    /// Reason why the trajectory ended.
    pub outcome: Outcome,
}

/// Limits and accuracy of a trajectory.
#[derive(Clone, Copy)]
pub struct Way<'w> {
    /// Relative tolerance of the integrator; the absolute tolerance of a state is this times its size.
    pub tolerance: f64,
    /// Largest number of accepted and rejected steps.
    pub steps: usize,
    /// Called after every step; true ends the trajectory.
    pub stop: &'w dyn Fn() -> bool,
}

/// Integrates from `start` `[n]` over a time span, which may run backwards, at these parameters. The trajectory is
/// recorded at the `wanted` times, given in the direction of the span, or at the ends of the steps if there are none.
pub fn course(
    model: &Model,
    start: &[f64],
    span: [f64; 2],
    wanted: Option<&[f64]>,
    parameters: &[f64],
    way: &Way,
) -> Course {
    if model.iterated() {
        return orbit(model, start, span, wanted, parameters, way);
    }
    let unit = model.time_unit(parameters);
    let span = span.map(|t| t / unit);
    let scales = scales_from(model, start, parameters);
    let absolute = scales.iter().chain([&1.0]).map(|scale| way.tolerance * scale).collect();
    let field = Clocked(model);
    let tolerance = Tolerance { relative: way.tolerance, absolute };
    let integrator = Integrator::new(&field, parameters, tolerance).with_step_limit(way.steps);
    let start = &[start, &span[..1]].concat();
    let wanted = wanted.map(|times| times.iter().map(|t| t / unit).collect());
    let mut record =
        Record { n: model.dim(), wanted, next: 0, forwards: span[1] >= span[0], times: Vec::new(), states: Vec::new() };
    record.begin(span[0], start);
    let arrival = integrator.trajectory(start, span, &[], &mut |passage| {
        if let Passage::Step(step) = passage {
            record.step(step);
        }
        if (way.stop)() { Verdict::Stop } else { Verdict::Continue }
    });
    let outputs = outputs(model, &record.states, parameters, if model.forced() { &record.times } else { &[] });
    let times = record.times.iter().map(|t| t * unit).collect();
    Course { times, states: record.states, outputs, outcome: arrival.outcome }
}

/// Iterates of a map from `start`, as [`course`] records a trajectory: at every step, or at the wanted ones.
fn orbit(
    model: &Model,
    start: &[f64],
    span: [f64; 2],
    wanted: Option<&[f64]>,
    parameters: &[f64],
    way: &Way,
) -> Course {
    let (mut times, mut states, mut outcome) = (Vec::new(), Vec::new(), Outcome::Reached);
    let mut x = start.to_vec();
    let last = span[1].max(0.0) as usize;
    let mut wanted = wanted.map(|times| times.iter().map(|time| time.round() as usize).peekable());
    for k in 0..=last {
        let due = wanted.as_mut().is_none_or(|wanted| {
            let mut due = false;
            while wanted.next_if(|at| *at <= k).is_some() {
                due = true;
            }
            due
        });
        if due {
            times.push(k as f64);
            states.extend_from_slice(&x);
        }
        let mut next = vec![0.0; x.len()];
        let parameters = Parameters::Shared(parameters);
        model.evaluate(Batch { lanes: 1, states: &x, parameters, times: &[], signs: &[] }, &mut next);
        if k == last {
            break;
        }
        outcome = match () {
            () if (way.stop)() => Outcome::Stopped,
            () if k >= way.steps => Outcome::StepLimit,
            () if next.iter().any(|x| x.is_nan()) => Outcome::Undefined,
            () if next.iter().any(|x| x.abs() > Response::UNBOUNDED) => Outcome::Escaped,
            () => outcome,
        };
        if outcome != Outcome::Reached {
            break;
        }
        x = next;
    }
    let outputs = outputs(model, &states, parameters, &[]);
    Course { times, states, outputs, outcome }
}

/// Recorded part of a trajectory.
struct Record {
    n: usize,
    wanted: Option<Vec<f64>>,
    next: usize,
    forwards: bool,
    times: Vec<f64>,
    states: Vec<f64>,
}

impl Record {
    fn keep(&mut self, time: f64, state: &[f64]) {
        self.times.push(time);
        self.states.extend_from_slice(&state[..self.n]);
    }

    /// Returns the next requested time, if it lies at or before `end`.
    fn due(&self, end: f64) -> Option<f64> {
        let at = self.wanted.as_ref().and_then(|wanted| wanted.get(self.next)).copied();
        at.filter(|at| if self.forwards { *at <= end } else { *at >= end })
    }

    fn begin(&mut self, time: f64, start: &[f64]) {
        if self.wanted.is_none() {
            return self.keep(time, start);
        }
        while let Some(at) = self.due(time) {
            self.keep(at, start);
            self.next += 1;
        }
    }

    fn step(&mut self, step: &Step) {
        let mut x = vec![0.0; self.n + 1];
        if self.wanted.is_none() {
            step.end_into(&mut x);
            return self.keep(step.end_time(), &x);
        }
        let length = step.end_time() - step.start_time();
        while let Some(at) = self.due(step.end_time()) {
            step.state_into(if length == 0.0 { 1.0 } else { (at - step.start_time()) / length }, &mut x);
            self.keep(at, &x);
            self.next += 1;
        }
    }
}

/// Returns the outputs `[lanes][outputs]` of a model at states `[lanes][n]`, with times in forcing periods.
pub fn outputs(model: &Model, states: &[f64], parameters: &[f64], times: &[f64]) -> Vec<f64> {
    let (n, m) = (model.dim(), model.output_count());
    let lanes = states.len() / n.max(1);
    let by_component: Vec<f64> = (0..n * lanes).map(|k| states[(k % lanes) * n + k / lanes]).collect();
    let mut out = vec![0.0; m * lanes];
    model.outputs(
        Batch { lanes, states: &by_component, parameters: Parameters::Shared(parameters), times, signs: &[] },
        &mut out,
    );
    (0..m * lanes).map(|k| out[(k % m) * lanes + k / m]).collect()
}
