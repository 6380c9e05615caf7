//! Cycles of lightly damped forced models, by Newton's method instead of simulation.
//!
//! **Idea.** A cycle that lasts one forcing period solves a boundary-value problem on a known interval. Newton's method
//! starts from the given state held constant, for which its first step is the linear response, or from the trajectory
//! over one period. The multipliers of the cycle determine the length of transients. The cycle replaces the limit of
//! the trajectory only if transients last longer than trajectories are integrated; otherwise the trajectory decides,
//! once all transients have decayed.
//!
//! **Equations.** With μ the multiplier of largest modulus and s integration steps per forcing period, a transient
//! decays by the factor [`FALL`] in
//!
//!   (1)  N = ln FALL / -ln |μ|   periods, or s N steps.
//!
//! **Fails when** Newton's method diverges from both starting points, as it may close to a resonance, where the linear
//! response is far from the cycle.

use super::System;
use super::profile::PARTS;
use super::seeds::polish;
use crate::attractors::Candidate;
use crate::contract::Verdict;
use crate::diagram::{Point, Solution};
use crate::simulation::{Clocked, Integrator, Passage, Tolerance};

/// Decay of a transient after which its limit can be recognised. Empirical: the limit is then known to a thousandth of
/// the initial deviation, enough for Newton's method to start from.
const FALL: f64 = 1e3;
/// Relative accuracy of the trajectory over one period. It is a starting point for Newton's method; the value is the
/// default tolerance.
const INTEGRATION: f64 = 1e-6;
/// Number of periods beyond which slow decay cannot be distinguished from none: multipliers are accurate to about 1e-9.
pub(super) const NEVER: f64 = 1e9;
/// Distance from the cycle, relative to scale and size, within which the given state lies on it: the default tolerance.
const ON: f64 = 1e-6;

/// A cycle that lasts one forcing period.
pub(super) struct Direct {
    pub(super) point: Point,
    /// N of (1).
    pub(super) periods: f64,
    /// True if the cycle passes through the given state.
    pub(super) through: bool,
    /// True if the cycle is stable and transients outlast every trajectory.
    pub(super) slow: bool,
}

/// The cycle of one forcing period that Newton's method finds from `state`, if it is stable or passes through the
/// state.
pub(super) fn direct(system: &System, parameters: &[f64], tolerance: f64, state: &[f64]) -> Option<Direct> {
    if !system.field.forced() {
        return None;
    }
    let (turn, steps) = turn(system, parameters, state)?;
    let candidates = [at_rest(state), turn].into_iter();
    let mut found = candidates.filter_map(|candidate| polish(system, parameters, tolerance, &candidate));
    found.find_map(|point| classified(system, state, point, steps))
}

impl Direct {
    /// True if a trajectory that ended in `state` after `time`, in time units of the model, has settled on the cycle:
    /// transients have decayed, and the state lies close to the cycle, relative to the extent of each component.
    pub(super) fn ends(&self, time: f64, state: &[f64], unit: f64) -> bool {
        /// Points of the cycle that are compared. Of a sinusoidal motion they are π/2048 of the extent apart, well
        /// below `NEXT`.
        const PLACES: usize = 2048;
        /// Largest distance, as a share of the extent: a factor of safety of ten over the remaining transient, 1 /
        /// [`FALL`].
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

/// The cycle with the length of its transients; `None` if it is unstable and does not pass through the given state.
fn classified(system: &System, state: &[f64], point: Point, steps: usize) -> Option<Direct> {
    let Solution::Cycle(cycle) = &point.solution else { return None };
    let start = cycle.state(0.0);
    let mut sizes = start.iter().zip(state).zip(&system.scales);
    let through = sizes.all(|((a, b), scale)| (a - b).abs() <= ON * (scale + b.abs()));
    let periods = transient(point.free_spectrum().iter().fold(0.0, |m: f64, z| m.max(z.norm())).ln());
    let slow = point.unstable == 0 && periods * steps as f64 > system.limits.steps as f64;
    (through || point.unstable == 0).then_some(Direct { point, periods, through, slow })
}

/// N of (1) for the logarithm of |μ|; infinite without decay.
pub(super) fn transient(logarithm: f64) -> f64 {
    if logarithm < 0.0 { FALL.ln() / -logarithm } else { f64::INFINITY }
}

/// The constant state over one period.
pub(super) fn at_rest(state: &[f64]) -> Candidate {
    /// Sample times. Cubic interpolation needs four, and the state is constant.
    const TIMES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
    Candidate::Cycle { period: 1.0, times: TIMES.to_vec(), states: state.repeat(TIMES.len()) }
}

/// The trajectory from the state over one forcing period, and its number of steps; `None` if it ends early.
pub(super) fn turn(system: &System, parameters: &[f64], state: &[f64]) -> Option<(Candidate, usize)> {
    let n = state.len();
    let field = Clocked(system.field);
    let absolute = system.scales.iter().chain(&[1.0]).map(|scale| INTEGRATION * scale).collect();
    let tolerance = Tolerance { relative: INTEGRATION, absolute };
    let (mut times, mut states) = (vec![0.0], state.to_vec());
    let mut x = vec![0.0; n + 1];
    let start = [state, &[0.0]].concat();
    let integrator = Integrator::new(&field, parameters, tolerance).with_step_limit(system.limits.steps);
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
