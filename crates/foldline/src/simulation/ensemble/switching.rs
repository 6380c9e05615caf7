//! Trajectories of piecewise-smooth fields: the signs of the switches, and what happens where one changes.

use super::super::Outcome;
use super::super::kink::{self, Kink, PLACES};
use super::super::shortened::Shortened;
use super::super::tableau::STAGES;
use super::{Ensemble, shared_or_own};
use crate::contract::Batch;

/// Changes of sign without getting on after which a trajectory is taken to slide along a switch.
const STUCK: usize = 50;

impl Ensemble<'_> {
    /// The first signs of the switches: those at the start, or a little later where a trajectory starts on a zero.
    pub(super) fn first_signs(&mut self) {
        if self.signs.is_empty() {
            return;
        }
        let lanes = self.lanes.len();
        let parameters = shared_or_own(self.parameters, &self.own);
        self.field.switches(Batch { lanes, states: &self.x, parameters }, &mut self.switches);
        let mut later = vec![0.0; self.switches.len()];
        self.field.evaluate(Batch { lanes, states: &self.x, parameters }, &mut self.slopes[0]);
        for (i, (stage, x)) in self.stage.iter_mut().zip(&self.x).enumerate() {
            *stage = x + self.sign * 1e-9 * self.slopes[0][i];
        }
        self.field.switches(Batch { lanes, states: &self.stage, parameters }, &mut later);
        for ((sign, here), later) in self.signs.iter_mut().zip(&self.switches).zip(later) {
            *sign = if *here == 0.0 { later } else { *here }.signum();
        }
    }

    /// The switches at several places of the step that every lane tries.
    pub(super) fn look_ahead(&mut self) {
        if self.signs.is_empty() {
            return;
        }
        let (n, lanes) = (self.n, self.lanes.len());
        let mut x = vec![0.0; n];
        for (place, theta) in PLACES.into_iter().enumerate() {
            for l in 0..lanes {
                self.step_of(l).state_into(theta, &mut x);
                (0..n).for_each(|i| self.stage[i * lanes + l] = x[i]);
            }
            let batch = Batch { lanes, states: &self.stage, parameters: shared_or_own(self.parameters, &self.own) };
            self.field.switches(batch, &mut self.ahead[place]);
        }
    }

    /// Ends the step that lane `l` tries where the first switch changes sign; the kink there, if there is one. A kink at the
    /// very start leaves no step.
    pub(super) fn shortened(&mut self, l: usize, again: &mut Shortened) -> Option<Kink> {
        if self.signs.is_empty() {
            return None;
        }
        let (n, lanes) = (self.n, self.lanes.len());
        let step = self.step_of(l);
        let kink = kink::first(&step, again, |switch| {
            let at = switch * lanes + l;
            let value = |k: usize| if k == 0 { self.switches[at] } else { self.ahead[k - 1][at] };
            let values: [f64; PLACES.len() + 1] = std::array::from_fn(|k| self.signs[at] * value(k));
            // Rounding may leave a switch that has just changed sign on the wrong side of zero.
            std::array::from_fn(|k| if k == 0 { values[0].max(0.0) } else { values[k] })
        })?;
        let mut x = vec![0.0; n];
        again.of(&step);
        let length = kink.theta * step.length;
        again.state_into(length, &mut x);
        again.slope_at(&x, STAGES - 1);
        for i in 0..n {
            self.next[i * lanes + l] = x[i];
            (1..STAGES).for_each(|k| self.slopes[k][i * lanes + l] = again.slopes[k][i]);
        }
        self.lanes[l].step = length;
        Some(kink)
    }

    /// Goes on beyond a kink: with the other sign of the switch, and f as it is there.
    pub(super) fn pass(&mut self, l: usize, kink: &Kink, again: &mut Shortened) {
        let lanes = self.lanes.len();
        let x: Vec<f64> = (0..self.n).map(|i| self.x[i * lanes + l]).collect();
        again.flip(kink.switch);
        again.slope_at(&x, 0);
        (0..self.n).for_each(|i| self.slopes[0][i * lanes + l] = again.slopes[0][i]);
        let at = kink.switch * lanes + l;
        self.signs[at] = -self.signs[at];
        self.switches[at] = 0.0;
        let lane = &mut self.lanes[l];
        lane.stuck = if kink.theta < 1e-8 { lane.stuck + 1 } else { 0 };
        if lane.stuck > STUCK {
            lane.done = Some(Outcome::StepTooSmall);
        }
    }

    /// The values of the switches where lane `l` is now.
    pub(super) fn renew_switches(&mut self, l: usize, again: &Shortened) {
        let lanes = self.lanes.len();
        let x: Vec<f64> = (0..self.n).map(|i| self.x[i * lanes + l]).collect();
        let mut values = vec![0.0; self.signs.len() / lanes];
        again.switches_into(&x, &mut values);
        values.iter().enumerate().for_each(|(s, value)| self.switches[s * lanes + l] = *value);
    }
}
