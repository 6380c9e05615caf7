//! From a prediction to a solution.
//!
//! **Idea.** A predicted limit of the returns is followed for one period; where it comes back to itself much better than the
//! trajectory does, the loop is handed to Newton's method, and so is a single turn of what that yields if it repeats itself.

use super::orbit::Orbit;
use super::returns::{MOST_CROSSINGS, Prediction, Returns};
use super::{Candidate, Polish, Sampling};
use crate::contract::{Batch, Parameters, VectorField, Verdict};
use crate::diagram::{Cycle, Solution};
use crate::simulation::{Integrator, Passage, Step, Tolerance};

/// Steps after which a predicted limit is given up.
const FOLLOWED: usize = 20_000;
/// How well a predicted limit must return to itself to be tried, relative to the extent of its motion …
const RECURRENT: f64 = 0.001;
/// … and relative to the last returns of the trajectory.
const BETTER: f64 = 0.1;

/// Samples per step of a trajectory that is to be polished.
const PARTS: usize = 4;

/// What all trajectories of a survey share.
#[derive(Clone, Copy)]
pub(super) struct Context<'a> {
    pub(super) field: &'a dyn VectorField,
    pub(super) parameters: &'a [f64],
    pub(super) sampling: &'a Sampling,
    pub(super) polish: Polish<'a>,
    /// Accuracy of the integration, relative. It only decides where a trajectory goes; solutions are polished. Where samples next to
    /// the edge of a basin go depends on it.
    pub(super) accuracy: f64,
}

impl Context<'_> {
    pub(super) fn tolerance(&self) -> Tolerance {
        let absolute = self.sampling.scales.iter().map(|s| self.accuracy * s).collect();
        Tolerance { relative: self.accuracy, absolute }
    }

    /// f at a state, `[n]`.
    pub(super) fn slope(&self, state: &[f64]) -> Vec<f64> {
        let mut f = vec![0.0; state.len()];
        let at = Batch { lanes: 1, states: state, parameters: Parameters::Shared(self.parameters), times: &[] };
        self.field.evaluate(at, &mut f);
        f
    }

    /// A stable solution near the candidate, as an orbit.
    pub(super) fn polished(&self, candidate: &Candidate) -> Option<Orbit> {
        let polished = |candidate: &Candidate| (self.polish)(candidate).filter(|point| point.unstable == 0);
        let point = polished(candidate)?;
        let once = match &point.solution {
            Solution::Cycle(cycle) => {
                primitive(cycle, &self.sampling.scales).and_then(|candidate| polished(&candidate))
            }
            Solution::Equilibrium(_) => None,
        };
        Some(Orbit::new(once.unwrap_or(point), &self.sampling.scales, self.sampling.whirl))
    }

    /// The trajectory from a state over that time: times and states `[time][n]` of its samples. `each` sees every step and
    /// the state at its end.
    fn sampled(&self, state: &[f64], time: f64, each: &mut dyn FnMut(&Step, &[f64])) -> (Vec<f64>, Vec<f64>) {
        let integrator = Integrator::new(self.field, self.parameters, self.tolerance()).with_step_limit(FOLLOWED);
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

    /// The trajectory from a state on a cycle over its period.
    pub(super) fn turn(&self, state: &[f64], period: f64) -> Candidate {
        let (times, states) = self.sampled(state, period, &mut |_, _| {});
        Candidate::Cycle { period, times, states }
    }

    /// The trajectory from a predicted limit over one period, if it comes back.
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
        let (mut times, mut states) = self.sampled(&prediction.state, 1.3 * prediction.period, &mut look);
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

/// Largest minus smallest value of every component of `states` `[state][n]`.
fn extents(states: &[f64], n: usize) -> Vec<f64> {
    let extent = |i: usize| {
        let component = states.iter().skip(i).step_by(n);
        let [low, high] = component.fold([f64::MAX, f64::MIN], |[low, high], x| [x.min(low), x.max(high)]);
        high - low
    };
    (0..n).map(extent).collect()
}

/// One turn of a cycle that runs several times around nearly the same loop, as a candidate: the cycle may be another one
/// several times over, or have just doubled its period.
fn primitive(cycle: &Cycle, scales: &[f64]) -> Option<Candidate> {
    const COUNT: usize = 240;
    const PROBES: usize = 24;
    let n = cycle.dim();
    let states = cycle.uniform(COUNT);
    // A component that hardly moves is compared to a part of its size: what it does move is the error of the solution.
    let size = |i: usize| states.iter().skip(i).step_by(n).fold(0.0, |m: f64, x| m.max(x.abs()));
    let extent: Vec<f64> =
        extents(&states, n).iter().enumerate().map(|(i, e)| e.max(0.01 * size(i)).max(1e-6 * scales[i])).collect();
    let repeats = |turns: usize| {
        (0..PROBES).map(|k| k as f64 / PROBES as f64).all(|t| {
            let (here, there) = (cycle.state(t), cycle.state(t + 1.0 / turns as f64));
            (0..n).all(|i| (here[i] - there[i]).abs() <= 0.01 * extent[i])
        })
    };
    let turns = (2..=MOST_CROSSINGS).rev().find(|&turns| repeats(turns))?;
    let period = cycle.period / turns as f64;
    let times = (0..=COUNT).map(|k| period * k as f64 / COUNT as f64).collect();
    let states = (0..=COUNT).flat_map(|k| cycle.state(k as f64 / (COUNT * turns) as f64)).collect();
    Some(Candidate::Cycle { period, times, states })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::gauss::Scheme;

    /// The ellipse (cos τ, 2 sin τ), run through `turns` times in time 6, the turns differing by `difference`.
    fn ellipse(turns: usize, difference: f64) -> Cycle {
        let intervals = 20 * turns;
        let mut profile = Vec::new();
        for j in 0..intervals {
            for c in &Scheme::new(4).nodes {
                let t = (j as f64 + c) / intervals as f64;
                let (slow, fast) = (std::f64::consts::TAU * t, std::f64::consts::TAU * t * turns as f64);
                profile.extend([fast.cos() + difference * slow.cos(), 2.0 * fast.sin()]);
            }
        }
        let mesh: Vec<f64> = (0..=intervals).map(|j| j as f64 / intervals as f64).collect();
        Cycle { period: 6.0, forcing_periods: 0, mesh: mesh.into(), degree: 4, profile }
    }

    #[test]
    fn a_cycle_run_through_several_times_is_reduced_to_one_turn() {
        for turns in [2, 3, 7] {
            let Some(Candidate::Cycle { period, times, states }) = primitive(&ellipse(turns, 0.0), &[1.0; 2]) else {
                panic!("{turns} turns not seen")
            };
            assert_eq!((period, times.last()), (6.0 / turns as f64, Some(&period)));
            // Degree 4 on 20 intervals: 1e-6.
            for (t, x) in times.iter().zip(states.chunks(2)) {
                let angle = std::f64::consts::TAU * t / period;
                assert!((x[0] - angle.cos()).abs() < 1e-5 && (x[1] - 2.0 * angle.sin()).abs() < 1e-5);
            }
        }
        assert!(primitive(&ellipse(1, 0.0), &[1.0; 2]).is_none());
        assert!(primitive(&ellipse(2, 0.1), &[1.0; 2]).is_none(), "a cycle of twice the period is not its half");
    }
}
