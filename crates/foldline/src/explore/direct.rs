//! Cycles of a forced field where transients last too long to wait for.
//!
//! **Idea.** A cycle that lasts one period of the forcing is the solution of a boundary-value problem on a known interval. Newton's method
//! solves it from the given state at rest, where its first step is the linear response, or from the trajectory over one period. The
//! multipliers of the cycle say how long a transient lasts. Only where that is longer than trajectories are followed does the cycle
//! stand for what the trajectory settles to; otherwise the trajectory itself decides, by where it is once all transients have decayed.
//!
//! **Equations.** With μ the largest multiplier, and s steps of the integration per period of the forcing, a transient falls by the factor
//! [`FALL`] in
//!
//!   (1)  N = ln FALL / -ln |μ|   periods, or s N steps.
//!
//! **Fails when** Newton's method diverges from both, as close to a resonance, where the linear response is far from the cycle.

use super::System;
use super::seeds::polish;
use crate::attractors::{Candidate, STEP_LIMIT};
use crate::contract::Verdict;
use crate::diagram::{Point, Solution};
use crate::simulation::{Clocked, Integrator, Passage, Tolerance};

/// Fall of a transient after which its limit can be told.
const FALL: f64 = 1e3;
/// Accuracy of the trajectory over one period, relative.
const INTEGRATION: f64 = 1e-6;
/// Samples per step of that trajectory.
const PARTS: usize = 4;
/// Periods beyond which a decay cannot be told from none: the accuracy of multipliers.
pub(super) const NEVER: f64 = 1e9;
/// How well a cycle passes through the given state, relative to scale and size, for the state to lie on it.
const ON: f64 = 1e-6;

/// A cycle of one period of the forcing.
pub(super) struct Direct {
    pub(super) point: Point,
    /// N of (1).
    pub(super) periods: f64,
    /// True if the cycle passes through the given state.
    pub(super) through: bool,
    /// True if no trajectory is followed until it has settled there.
    pub(super) slow: bool,
}

/// The cycle of one period of the forcing that Newton's method finds from `state`, if it is stable or passes through the state.
pub(super) fn direct(system: &System, parameters: &[f64], tolerance: f64, state: &[f64]) -> Option<Direct> {
    if !system.field.forced() {
        return None;
    }
    let (turn, steps) = turn(system, parameters, state)?;
    let candidates = [at_rest(state), turn].into_iter();
    let mut found = candidates.filter_map(|candidate| polish(system, parameters, tolerance, &candidate));
    found.find_map(|point| judged(system, state, point, steps))
}

impl Direct {
    /// True if a trajectory that was followed for so long, in the time of the model, and ended in `state` is on the cycle: transients have
    /// decayed, and the state lies next to the cycle, measured by the extent of each component.
    pub(super) fn ends(&self, time: f64, state: &[f64], unit: f64) -> bool {
        const PLACES: usize = 2048;
        const NEXT: f64 = 0.01;
        let Solution::Cycle(cycle) = &self.point.solution else { return false };
        let off = |t: usize| {
            let here = cycle.state(t as f64 / PLACES as f64);
            let parts = here.iter().zip(state).zip(&self.point.ranges);
            parts.map(|((a, b), [low, high])| (a - b).abs() / (high - low).max(f64::MIN_POSITIVE)).fold(0.0, f64::max)
        };
        time > self.periods * unit && (0..PLACES).map(off).fold(f64::INFINITY, f64::min) < NEXT
    }
}

/// The cycle, if it is of use.
fn judged(system: &System, state: &[f64], point: Point, steps: usize) -> Option<Direct> {
    let Solution::Cycle(cycle) = &point.solution else { return None };
    let start = cycle.state(0.0);
    let mut sizes = start.iter().zip(state).zip(&system.scales);
    let through = sizes.all(|((a, b), scale)| (a - b).abs() <= ON * (scale + b.abs()));
    let periods = transient(point.free_spectrum().iter().fold(0.0, |m: f64, z| m.max(z.norm())).ln());
    let slow = point.unstable == 0 && periods * steps as f64 > STEP_LIMIT as f64;
    (through || point.unstable == 0).then_some(Direct { point, periods, through, slow })
}

/// N of (1) for the logarithm of |μ|; infinite where nothing decays.
pub(super) fn transient(logarithm: f64) -> f64 {
    if logarithm < 0.0 { FALL.ln() / -logarithm } else { f64::INFINITY }
}

/// The state itself over one period.
pub(super) fn at_rest(state: &[f64]) -> Candidate {
    const TIMES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
    Candidate::Cycle { period: 1.0, times: TIMES.to_vec(), states: state.repeat(TIMES.len()) }
}

/// The trajectory from the state over one period of the forcing, and its steps; `None` if it does not last so long.
pub(super) fn turn(system: &System, parameters: &[f64], state: &[f64]) -> Option<(Candidate, usize)> {
    let n = state.len();
    let field = Clocked(system.field);
    let absolute = system.scales.iter().chain(&[1.0]).map(|scale| INTEGRATION * scale).collect();
    let tolerance = Tolerance { relative: INTEGRATION, absolute };
    let (mut times, mut states) = (vec![0.0], state.to_vec());
    let mut x = vec![0.0; n + 1];
    let start = [state, &[0.0]].concat();
    let integrator = Integrator::new(&field, parameters, tolerance).with_step_limit(STEP_LIMIT);
    let arrival = integrator.trajectory(&start, [0.0, 1.0], &[], &mut |passage| {
        let Passage::Step(step) = passage else { return Verdict::Continue };
        for part in 1..=PARTS {
            let theta = part as f64 / PARTS as f64;
            step.state_into(theta, &mut x);
            times.push(step.time_at(theta));
            states.extend_from_slice(&x[..n]);
        }
        Verdict::Continue
    });
    let whole = arrival.time == 1.0 && times.len() > PARTS;
    whole.then_some((Candidate::Cycle { period: 1.0, times, states }, arrival.steps))
}
