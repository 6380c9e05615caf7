//! Detection of stiff trajectories, limited by stability rather than accuracy, and their transfer to the implicit
//! method.
//!
//! **Idea.** If the steps of the explicit pair stay at the edge of its stability region, the implicit method tries some
//! steps of the trajectory. If they are much longer it keeps the trajectory to its end; otherwise the pair continues
//! where they ended. No step is lost.
//!
//! **Equations.** With the last two stages g₆ and x₁ of a step, which belong to the same time,
//!
//! ```text
//!   (1)  |hλ| ≈ h |f(x₁) - f(g₆)| / |x₁ - g₆|
//! ```
//!
//! for the dominant eigenvalue λ of f_x; the stability region ends at 3.3 on the negative real axis.
//!
//! **Source.** hairer1996, §IV.2 ((1), [`AT_EDGE`], [`OFF_EDGE`] and [`FIRST_LOOK`]).

use super::super::implicit::{Advance, From, Implicit};
use super::super::tableau::STAGES;
use super::super::{Outcome, Step};
use super::switching::STUCK;
use super::{Ensemble, pace};
use crate::contract::{Parameters, Verdict};

/// Value of (1) from which a step counts as one at the edge: 0.9 times the stability limit, 0.9 being the safety factor
/// of the step control. (The control is smooth: for the reaction in the tests it keeps (1) at 3.24.)
const EDGE: f64 = 3.0;
/// Number of steps at the edge after which a trajectory counts as stiff, and of steps off it after which the count
/// restarts.
const AT_EDGE: u32 = 15;
const OFF_EDGE: u32 = 6;
/// Number of steps after which a trajectory is first checked.
pub(super) const FIRST_LOOK: f64 = 1000.0;
/// Number of steps between two checks without evidence of stiffness.
const BETWEEN: f64 = 16.0;
/// Number of steps that the implicit method tries. They grow by up to a factor of five each, so the second half shows
/// their length.
const TRIED: usize = 24;

/// Evidence of stiffness along one trajectory.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Evidence {
    at_edge: u32,
    off_edge: u32,
    /// Number of unsuccessful trials.
    trials: i32,
}

impl Evidence {
    /// Records a step; true once the trajectory counts as stiff.
    fn adds_up(&mut self, h_lambda: f64) -> bool {
        if h_lambda > EDGE {
            (self.at_edge, self.off_edge) = (self.at_edge + 1, 0);
        } else {
            self.off_edge += 1;
            if self.off_edge >= OFF_EDGE {
                self.at_edge = 0;
            }
        }
        self.at_edge >= AT_EDGE
    }
}

/// Ratio of step lengths from which the implicit method takes less time than the explicit pair, for `n` states.
/// Measured on chains of Duffing oscillators: a step takes 39, 60, 102 and 160 times as long as one of the pair in a
/// full batch for 2, 10, 40 and 80 states.
fn worth(n: usize) -> f64 {
    37.0 + 1.6 * n as f64
}

impl Ensemble<'_> {
    /// Checks the trajectories that are due after a sweep; stiff ones are handed to the implicit method.
    pub(super) fn look_for_stiffness(&mut self, observe: &mut Option<&mut dyn FnMut(&Step) -> Verdict>) {
        for l in 0..self.lanes.count {
            let due = self.lanes.tried[l] >= self.lanes.look[l] && self.lanes.accepted[l] != 0.0;
            if !due || self.runs[l].over || self.runs[l].done.is_some() {
                continue;
            }
            let h_lambda = self.h_lambda(l);
            if self.runs[l].stiff.adds_up(h_lambda) {
                self.hand_over(l, observe);
            } else {
                let rest = if self.runs[l].stiff.at_edge > 0 { 1.0 } else { BETWEEN };
                self.lanes.look[l] = self.lanes.tried[l] + rest;
            }
        }
    }

    /// (1) for the last step of lane `l`, whose end is already the current state.
    fn h_lambda(&self, l: usize) -> f64 {
        let lanes = &self.lanes;
        let (mut slopes, mut states) = (0.0, 0.0);
        for i in 0..lanes.n {
            let at = i * lanes.count + l;
            let weight = 1.0 / (self.tolerance.absolute[i] + self.tolerance.relative * lanes.x[at].abs());
            slopes += (weight * (lanes.slopes[0][at] - lanes.slopes[STAGES - 2][at])).powi(2);
            states += (weight * (lanes.x[at] - lanes.stage[at])).powi(2);
        }
        if states > 0.0 { lanes.taken[l].abs() * (slopes / states).sqrt() } else { 0.0 }
    }

    /// Hands lane `l` to the implicit method, for some steps or to the end of the trajectory.
    fn hand_over(&mut self, l: usize, observe: &mut Option<&mut dyn FnMut(&Step) -> Verdict>) {
        let (n, count) = (self.lanes.n, self.lanes.count);
        let of_lane = |values: &[f64]| -> Vec<f64> { values.iter().skip(l).step_by(count).copied().collect() };
        let own: Vec<f64> = match self.lanes.parameters(self.parameters) {
            Parameters::Shared(values) => values.to_vec(),
            Parameters::PerLane(values) => of_lane(values),
        };
        let explicit = self.lanes.h[l];
        let from = From {
            trajectory: self.runs[l].trajectory,
            time: self.lanes.time[l],
            h: explicit,
            state: &self.lanes.state(l),
            signs: of_lane(&self.lanes.signs),
            switches: of_lane(&self.lanes.switches),
        };
        let mut implicit = Implicit::new(self.field, &own, &self.tolerance, &self.limits, from);
        let (mut taken, mut half) = (0, implicit.time);
        let done = loop {
            if self.lanes.tried[l] >= self.limits.steps {
                break Some(Outcome::StepLimit);
            }
            self.lanes.tried[l] += 1.0;
            match implicit.advance(observe) {
                Advance::Rejected(outcome) if pace::too_small(implicit.h, implicit.time) => break Some(outcome),
                Advance::Rejected(_) if taken < TRIED && implicit.h.abs() < 1e-3 * explicit.abs() => break None,
                Advance::Rejected(_) => continue,
                Advance::Accepted { largest, .. } if pace::escaped(largest, self.lanes.bound[l]) => {
                    break Some(Outcome::Escaped);
                }
                Advance::Accepted { stops: true, .. } => break Some(Outcome::Stopped),
                Advance::Accepted { .. } => {}
            }
            self.lanes.steps[l] += 1.0;
            taken += 1;
            if implicit.time == self.limits.end {
                break Some(Outcome::Reached);
            } else if implicit.stuck > STUCK || pace::too_small(implicit.h, implicit.time) {
                break Some(Outcome::StepTooSmall);
            }
            if taken == TRIED / 2 {
                half = implicit.time;
            }
            let longer = (implicit.time - half).abs() / (explicit.abs() * (TRIED / 2) as f64);
            if taken == TRIED && longer < worth(n) {
                break None;
            }
        };
        let (x, slope, signs) = implicit.here();
        let (time, switches) = (implicit.time, std::mem::take(&mut implicit.switches));
        drop(implicit);
        for i in 0..n {
            self.lanes.x[i * count + l] = x[i];
            self.lanes.slopes[0][i * count + l] = slope[i];
        }
        for s in 0..signs.len() {
            self.lanes.signs[s * count + l] = signs[s];
            self.lanes.switches[s * count + l] = switches[s];
        }
        self.lanes.time[l] = time;
        self.runs[l].done = done;
        if done.is_none() {
            let remaining = self.limits.end - time;
            self.lanes.h[l] = if explicit.abs() < remaining.abs() { explicit } else { remaining };
            let trials = self.runs[l].stiff.trials + 1;
            self.runs[l].stiff = Evidence { trials, ..Evidence::default() };
            self.lanes.look[l] = self.lanes.tried[l] + FIRST_LOOK * 2f64.powi(trials);
        }
    }
}
