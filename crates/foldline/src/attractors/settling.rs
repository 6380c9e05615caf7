//! From a start to a settled motion, by simulation alone.
//!
//! **Idea.** A trajectory runs in rounds. In each it is watched until it is observed to contract: its returns to a
//! plane, or its speed, decrease steadily. Their limit is then predicted, and the next round starts close to it, at a
//! small fraction of the distance in the direction from which the trajectory came, so that a limit that does not
//! attract is exposed in that round. The trajectory has settled when it repeats itself; no equation is solved for the
//! motion.
//!
//! **Equations.** With the limit y* of the returns y_j, (2) of `returns`, and d its doubt relative to the last
//! difference:
//!
//!   (1)  next start = y* + s (y_j - y*),   s = clamp(5 d, 1/1000, 1/10)
//!
//! An equilibrium is predicted in the same way, as the limit of states at equal time intervals.
//!
//! **Source.** sidi2017, §1 (reduced rank extrapolation).
//!
//! **Fails when** a motion is neither at rest nor periodic, or contracts by less than 1/30 over a few thousand periods.

use super::Limits;
use super::recognition::{Found, Nature, recognise};
use super::runner::{JUMPS, Runner};
use crate::contract::VectorField;
use crate::diagram::Motion;
use crate::simulation::{Ensemble, Outcome, Tolerance};

/// Relative accuracy of the integration: in a rough first round, and in all others.
pub(super) const INTEGRATION: [f64; 2] = [1e-6, 1e-9];

/// Accuracy of the first round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum First {
    /// Rough: a distant start has a long way to go, and this round decides nothing.
    Rough,
    /// Accurate: the start lies close to a motion whose basin may be narrow.
    Accurate,
}

/// A vector field, with scales and limits for its simulation.
#[derive(Clone, Copy)]
pub struct Trial<'a> {
    /// The vector field.
    pub field: &'a dyn VectorField,
    /// `[n]` characteristic size of each state.
    pub scales: &'a [f64],
    /// The two states that make up the whirl plane, by which cycles are named.
    pub whirl: Option<[usize; 2]>,
    /// Number of threads; no result depends on it.
    pub jobs: usize,
    /// Limits on each trajectory of a survey or sweep.
    pub limits: Limits,
}

impl Trial<'_> {
    /// Returns the limits in the time unit of the field at these parameters.
    pub(super) fn limits_at(&self, parameters: &[f64]) -> Limits {
        Limits { time: self.limits.time / self.field.time_unit(parameters), ..self.limits }
    }
}

/// Type of motion of a trajectory that could not be continued; `None` if it could.
pub(super) fn lost(outcome: Outcome) -> Option<Motion> {
    match outcome {
        Outcome::Chatter => Some(Motion::Chatter),
        _ => outcome.is_lost().then_some(Motion::Escaped),
    }
}

/// Final state of a trajectory.
#[derive(Clone, Debug)]
pub(super) struct Settled {
    pub(super) motion: Motion,
    pub(super) state: Vec<f64>,
    /// Period of a cycle; otherwise 0.
    pub(super) period: f64,
    /// `[n]` extent of the motion, with a floor.
    pub(super) extent: Vec<f64>,
    pub(super) time: f64,
    pub(super) error: f64,
    /// Result of recognition, if it has decided.
    pub(super) found: Option<Box<Found>>,
}

/// Settles like [`settle_together`], all at the parameters `[k]`; a motion that has not settled after part of the steps is
/// recognised if that is possible, and goes on otherwise.
pub(super) fn settle_or_recognise(trial: &Trial, parameters: &[f64], starts: &[f64], first: First) -> Vec<Settled> {
    /// Steps after which recognition is tried: enough for most transients, and a fraction of the default limit.
    const EARLY: usize = 50_000;
    let (n, limits) = (trial.field.dim(), trial.limits_at(parameters));
    let together = |starts: &[f64], first: First, limits: Limits| {
        settle_together(trial, &parameters.repeat(starts.len() / n), starts, first, limits)
    };
    if limits.steps <= 2 * EARLY {
        return together(starts, first, limits);
    }
    /// Trajectories in a row that may be followed without an answer: the others at the same parameters are alike.
    const FRUITLESS: usize = 2;
    let mut all = together(starts, first, Limits { steps: EARLY, ..limits });
    let mut fruitless = 0;
    for own in all.iter_mut().filter(|own| own.motion == Motion::Other && !trial.field.ended()) {
        if fruitless == FRUITLESS {
            break;
        }
        let found = recognise(trial, parameters, &own.state, true);
        // Chaos may be a transient.
        fruitless += 1;
        if matches!(found.nature, Nature::Cycle(_) | Nature::Torus(_)) {
            own.found = Some(Box::new(found));
            fruitless = 0;
        }
    }
    let open: Vec<usize> =
        (0..all.len()).filter(|k| all[*k].motion == Motion::Other && all[*k].found.is_none()).collect();
    let from: Vec<f64> = open.iter().flat_map(|k| all[*k].state.clone()).collect();
    let left = |own: &Settled| limits.time - own.time;
    let time = open.iter().map(|k| left(&all[*k])).fold(0.0, f64::max);
    if open.is_empty() || time <= 0.0 {
        return all;
    }
    let later = together(&from, First::Accurate, Limits { steps: limits.steps - EARLY, time });
    for (k, own) in open.into_iter().zip(later) {
        all[k] = Settled { time: all[k].time + own.time, ..own };
    }
    all
}

/// Integrates trajectories together, each at its own parameters: `parameters` `[count][k]`, `starts` `[count][n]`.
pub(super) fn settle_together(
    trial: &Trial,
    parameters: &[f64],
    starts: &[f64],
    first: First,
    limits: Limits,
) -> Vec<Settled> {
    let (n, k) = (trial.field.dim(), trial.field.parameter_count());
    let mut runners: Vec<Runner> =
        starts.chunks_exact(n).map(|start| Runner::new(trial, start, first, limits.steps)).collect();
    for round in 0..JUMPS + 2 {
        let open: Vec<usize> = (0..runners.len()).filter(|&r| runners[r].found.is_none()).collect();
        if open.is_empty() {
            break;
        }
        let from: Vec<f64> = open.iter().flat_map(|&r| runners[r].start.clone()).collect();
        let own: Vec<f64> = open.iter().flat_map(|&r| parameters[r * k..(r + 1) * k].to_vec()).collect();
        let relative = INTEGRATION[usize::from(round > 0 || first == First::Accurate)];
        let tolerance = Tolerance { relative, absolute: trial.scales.iter().map(|s| relative * s).collect() };
        let left = |r: usize| limits.steps.saturating_sub(runners[r].steps);
        let limit = open.iter().map(|&r| left(r)).max().unwrap_or(0).max(1);
        open.iter().for_each(|&r| runners[r].begin(parameters[r * k..(r + 1) * k].to_vec()));
        // A trajectory that has used up its time does not start another round.
        let time = open.iter().map(|&r| limits.time - runners[r].time).fold(0.0, f64::max);
        if time <= 0.0 {
            break;
        }
        let ensemble = match k {
            0 => Ensemble::new(trial.field, &[], tolerance, &from, [0.0, time]),
            _ => Ensemble::with_own_parameters(trial.field, &own, tolerance, &from, [0.0, time]),
        };
        let arrivals =
            ensemble.with_step_limit(limit).run(&mut |step| runners[open[step.trajectory()]].observe(step, trial));
        for (r, arrival) in open.into_iter().zip(arrivals) {
            runners[r].end(arrival.time, arrival.state, arrival.outcome);
        }
    }
    let unsettled = |runner: Runner| Settled {
        motion: Motion::Other,
        state: runner.start,
        period: 0.0,
        extent: runner.extent,
        time: runner.time,
        error: f64::NAN,
        found: None,
    };
    runners.into_iter().map(|mut runner| runner.found.take().unwrap_or_else(|| unsettled(runner))).collect()
}
