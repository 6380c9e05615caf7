//! From a prediction to a solution.
//!
//! **Idea.** A predicted limit of the returns is integrated over one period. If that orbit closes much better than the
//! trajectory does, Newton's method starts from it.

use super::census::PERSISTENT;
use super::orbit::Orbit;
use super::returns::{Prediction, Returns};
use super::settling::INTEGRATION;
use super::{Candidate, Polish, Sampling};
use crate::contract::{Batch, Parameters, VectorField, Verdict};
use crate::simulation::{Integrator, Passage, Step, Tolerance};

/// Number of steps after which a predicted limit is abandoned.
const FOLLOWED: usize = 20_000;
/// Largest closing error of a predicted limit worth trying, relative to the extent of its motion …
const RECURRENT: f64 = 0.001;
/// … and relative to the last difference of the returns of the trajectory.
const BETTER: f64 = 0.1;

/// Samples per step of a trajectory that becomes a candidate.
const PARTS: usize = 4;

/// Data shared by all trajectories of a survey.
#[derive(Clone, Copy)]
pub(super) struct Context<'a> {
    pub(super) field: &'a dyn VectorField,
    pub(super) parameters: &'a [f64],
    pub(super) sampling: &'a Sampling,
    pub(super) polish: Polish<'a>,
    /// Relative accuracy of the integration. It only decides where a trajectory goes, which matters near basin
    /// boundaries; solutions are computed by Newton's method.
    pub(super) accuracy: f64,
}

impl Context<'_> {
    pub(super) fn tolerance(&self) -> Tolerance {
        let absolute = self.sampling.scales.iter().map(|s| self.accuracy * s).collect();
        Tolerance { relative: self.accuracy, absolute }
    }

    /// Returns f `[n]` at a state.
    pub(super) fn slope(&self, state: &[f64]) -> Vec<f64> {
        let mut f = vec![0.0; state.len()];
        let at =
            Batch { lanes: 1, states: state, parameters: Parameters::Shared(self.parameters), times: &[], signs: &[] };
        self.field.evaluate(at, &mut f);
        f
    }

    /// Returns a stable solution near the candidate, as an orbit.
    pub(super) fn polished(&self, candidate: &Candidate) -> Option<Orbit> {
        let point = (self.polish)(candidate).filter(|point| point.unstable == 0)?;
        Some(Orbit::new(point, &self.sampling.scales, self.sampling.whirl))
    }

    /// Integrates from a state over the given time and returns times and states `[time][n]` of samples. `each` is
    /// called with every step and the state at its end.
    fn sampled(
        &self,
        state: &[f64],
        time: f64,
        (accuracy, limit): (f64, usize),
        each: &mut dyn FnMut(&Step, &[f64]),
    ) -> (Vec<f64>, Vec<f64>) {
        let tolerance = Context { accuracy, ..*self }.tolerance();
        let integrator = Integrator::new(self.field, self.parameters, tolerance).with_step_limit(limit);
        let (mut times, mut states) = (vec![0.0], state.to_vec());
        let mut x = vec![0.0; state.len()];
        integrator.trajectory(state, [0.0, time], &[], &mut |passage| {
            let Passage::Step(step) = passage else { return Verdict::Continue };
            for part in 1..=PARTS {
                let theta = part as f64 / PARTS as f64;
                step.state_into(theta, &mut x);
                times.push(step.time_at(theta));
                states.extend_from_slice(&x);
            }
            each(step, &x);
            Verdict::Continue
        });
        (times, states)
    }

    /// Returns the trajectory from a state on a cycle over its period, as accurate as the one that settled there. (A
    /// state that is tiny along the slow manifold and large elsewhere times a relaxation oscillation.)
    pub(super) fn turn(&self, state: &[f64], period: f64) -> Candidate {
        let limit = self.sampling.limits.steps.max(PERSISTENT);
        let (times, states) = self.sampled(state, period, (INTEGRATION[1], limit), &mut |_, _| {});
        Candidate::Cycle { period, times, states }
    }

    /// Returns the trajectory from a predicted limit over one period, if it closes.
    pub(super) fn follow(&self, returns: &Returns, prediction: &Prediction, extent: &[f64]) -> Option<Candidate> {
        let n = extent.len();
        let mut plane = returns.again_from(&prediction.state);
        // The return that comes closest to the start, around the expected time.
        let mut back: Option<(f64, f64, Vec<f64>)> = None;
        let mut look = |step: &Step, x: &[f64]| {
            if plane.follow(step, x)
                && let Some((time, state)) = plane.last()
                && time > 0.7 * prediction.period
            {
                let distance = (0..n).fold(0.0, |m: f64, i| m.max((state[i] - prediction.state[i]).abs() / extent[i]));
                if back.as_ref().is_none_or(|(best, ..)| distance < *best) {
                    back = Some((distance, time, state.to_vec()));
                }
            }
        };
        let (mut times, mut states) =
            self.sampled(&prediction.state, 1.3 * prediction.period, (self.accuracy, FOLLOWED), &mut look);
        let (distance, period, end) = back?;
        let kept = times.partition_point(|t| *t < period);
        times.truncate(kept);
        states.truncate(kept * n);
        times.push(period);
        states.extend(end);
        let moved = extents(&states, n).iter().zip(extent).fold(0.0, |m: f64, (own, whole)| m.max(own / whole));
        let closes = distance <= RECURRENT * moved && distance <= BETTER * prediction.size + 10.0 * self.accuracy;
        closes.then_some(Candidate::Cycle { period, times, states })
    }
}

/// Returns the largest minus the smallest value of every component of `states` `[state][n]`.
fn extents(states: &[f64], n: usize) -> Vec<f64> {
    let extent = |i: usize| {
        let component = states.iter().skip(i).step_by(n);
        let [low, high] = component.fold([f64::MAX, f64::MIN], |[low, high], x| [x.min(low), x.max(high)]);
        high - low
    };
    (0..n).map(extent).collect()
}
