//! One trajectory, with its crossings.

use super::section::{Crossing, Section, crossings};
use super::shortened::Shortened;
use super::{Arrival, Ensemble, Outcome, Step, Tolerance};
use crate::contract::{VectorField, Verdict};

/// Integrator of single trajectories of one vector field at fixed parameters.
#[derive(Clone)]
pub struct Integrator<'a> {
    field: &'a dyn VectorField,
    parameters: &'a [f64],
    tolerance: Tolerance,
    step_limit: usize,
    longest: f64,
}

/// Event shown to the observer of a trajectory, in order of time.
#[derive(Clone, Copy, Debug)]
pub enum Passage<'a> {
    /// A section was crossed.
    Crossing(&'a Crossing),
    /// A step was accepted; its crossings have been reported.
    Step(&'a Step<'a>),
}

impl<'a> Integrator<'a> {
    /// Integrator without a limit on the number of steps.
    pub fn new(field: &'a dyn VectorField, parameters: &'a [f64], tolerance: Tolerance) -> Integrator<'a> {
        Integrator { field, parameters, tolerance, step_limit: usize::MAX, longest: f64::INFINITY }
    }

    /// Ends a trajectory after this many accepted and rejected steps.
    pub fn with_step_limit(mut self, limit: usize) -> Integrator<'a> {
        self.step_limit = limit;
        self
    }

    /// Limits the length of a step to `longest`, a positive time.
    pub fn with_longest_step(mut self, longest: f64) -> Integrator<'a> {
        self.longest = longest;
        self
    }

    /// Integrates from `start` `[n]` over the time span, which may run backwards. `observe` may stop at a crossing or
    /// at the end of a step. A start on a section is not a crossing.
    pub fn trajectory(
        &self,
        start: &[f64],
        span: [f64; 2],
        sections: &[Section],
        observe: &mut dyn FnMut(Passage) -> Verdict,
    ) -> Arrival {
        let mut stopped_at = None;
        let mut again = Shortened::new(self.field);
        let ensemble = Ensemble::new(self.field, self.parameters, self.tolerance.clone(), start, span)
            .with_step_limit(self.step_limit)
            .with_longest_step(self.longest);
        let arrivals = ensemble.run(&mut |step| {
            if !sections.is_empty() {
                again.of(step);
                for crossing in crossings(step, sections, |theta, x| again.state_into(theta * step.length, x)) {
                    if observe(Passage::Crossing(&crossing)) == Verdict::Stop {
                        stopped_at = Some(crossing);
                        return Verdict::Stop;
                    }
                }
            }
            observe(Passage::Step(step))
        });
        let mut arrival = arrivals.into_iter().next().unwrap_or(Arrival {
            time: span[0],
            state: start.to_vec(),
            outcome: Outcome::Undefined,
            steps: 0,
            rejected: 0,
        });
        if let Some(crossing) = stopped_at {
            (arrival.time, arrival.state) = (crossing.time, crossing.state);
        }
        arrival
    }

    /// State at the end of the time span, or `None` if the trajectory does not get there.
    pub fn state_after(&self, start: &[f64], span: [f64; 2]) -> Option<Vec<f64>> {
        let arrival = self.trajectory(start, span, &[], &mut |_| Verdict::Continue);
        (arrival.outcome == Outcome::Reached).then_some(arrival.state)
    }
}
