//! Trajectories of piecewise-smooth fields: signs of the switches, and their changes.

use super::super::Outcome;
use super::super::kink::{self, Kink, PLACES};
use super::super::shortened::Shortened;
use super::super::tableau::STAGES;
use super::Ensemble;
use crate::contract::Batch;

/// Number of sign changes without progress after which a trajectory ends: it slides along several surfaces, or the
/// switches change sign ever faster.
pub(super) const STUCK: usize = 50;

/// Times between the last events of a trajectory.
#[derive(Clone, Debug, Default)]
pub(super) struct Flights {
    last: Option<f64>,
    /// The longest of those that have become ever shorter, the shortest, and their number.
    longest: f64,
    shortest: f64,
    shorter: usize,
}

impl Flights {
    /// Notes an event; true if events accumulate.
    fn accumulate(&mut self, time: f64) -> bool {
        /// Successive flights, each shorter than the one before, and the share of the first that the last has left.
        const SHORTER: usize = 8;
        const SHARE: f64 = 1e-5;
        let Some(last) = self.last.replace(time) else { return false };
        let flight = (time - last).abs();
        if self.shorter > 0 && flight < self.shortest {
            self.shorter += 1;
        } else {
            (self.longest, self.shorter) = (flight, 1);
        }
        self.shortest = flight;
        self.shorter > SHORTER && flight < SHARE * self.longest
    }
}

impl Ensemble<'_> {
    /// Initial signs of the switches, taken slightly later for a trajectory that starts on a zero, and their values at
    /// the start.
    pub(super) fn first_signs(&self, at: Batch) -> (Vec<f64>, Vec<f64>) {
        let count = self.field.switch_count() * at.lanes;
        let (mut here, mut later) = (vec![0.0; count], vec![0.0; count]);
        if count == 0 {
            return (here, later);
        }
        self.field.switches(at, &mut here);
        let mut f = vec![0.0; at.states.len()];
        self.field.evaluate(at, &mut f);
        let moved: Vec<f64> = at.states.iter().zip(&f).map(|(x, f)| x + self.limits.sign * 1e-9 * f).collect();
        self.field.switches(Batch { states: &moved, ..at }, &mut later);
        // On the surface of an event, where a jump has led, the value is rounding.
        let events = count - self.field.event_count() * at.lanes;
        let sign = |(k, (here, later)): (usize, (&f64, &f64))| {
            let on = *here == 0.0 || k >= events && here.abs() < (later - here).abs();
            if on { *later } else { *here }.signum()
        };
        (here.iter().zip(&later).enumerate().map(sign).collect(), here)
    }

    /// Samples the switches at several points of the step that every lane tries.
    pub(super) fn look_ahead(&mut self) {
        if self.lanes.signs.is_empty() {
            return;
        }
        let (n, lanes) = (self.lanes.n, self.lanes.count);
        let mut x = vec![0.0; n];
        for (place, theta) in PLACES.into_iter().enumerate() {
            for l in 0..lanes {
                self.step_of(l).state_into(theta, &mut x);
                (0..n).for_each(|i| self.lanes.sampled[i * lanes + l] = x[i]);
            }
            let mut ahead = std::mem::take(&mut self.lanes.ahead[place]);
            let parameters = self.lanes.parameters(self.parameters);
            self.field
                .switches(Batch { lanes, states: &self.lanes.sampled, parameters, times: &[], signs: &[] }, &mut ahead);
            self.lanes.ahead[place] = ahead;
        }
    }

    /// Ends the step tried by lane `l` at the first sign change of a switch; returns the kink there, if any. A kink at
    /// the very start leaves no step.
    pub(super) fn shortened(&mut self, l: usize, again: &mut Shortened) -> Option<Kink> {
        let (n, lanes) = (self.lanes.n, self.lanes.count);
        let step = self.step_of(l);
        let kink = kink::first(&step, again, |switch| {
            let at = switch * lanes + l;
            let value = |k: usize| if k == 0 { self.lanes.switches[at] } else { self.lanes.ahead[k - 1][at] };
            kink::samples(self.lanes.signs[at], value)
        })?;
        let mut x = vec![0.0; n];
        again.of(&step);
        let length = kink.theta * step.length;
        again.state_into(length, &mut x);
        again.slope_at(&x, STAGES - 1);
        for i in 0..n {
            self.lanes.next[i * lanes + l] = x[i];
            (1..STAGES).for_each(|k| self.lanes.slopes[k][i * lanes + l] = again.slopes[k][i]);
        }
        self.lanes.h[l] = length;
        self.lanes.end[l] = self.limits.end_of(self.lanes.time[l], length);
        Some(kink)
    }

    /// Continues beyond the kink that lane `l` has reached: with the opposite sign of the switch, or along its surface,
    /// and the corresponding f.
    pub(super) fn pass(&mut self, l: usize, kink: &Kink, again: &mut Shortened) {
        let (n, lanes) = (self.lanes.n, self.lanes.count);
        let x = self.lanes.state(l);
        let mut values = vec![0.0; self.lanes.signs.len() / lanes];
        again.of(&self.step_of(l));
        again.switches_into(&x, &mut values);
        values.iter().enumerate().for_each(|(s, value)| self.lanes.switches[s * lanes + l] = *value);
        let run = &mut self.runs[l];
        run.stuck = if kink.theta < 1e-8 { run.stuck + 1 } else { 0 };
        if run.stuck > STUCK {
            run.done = Some(Outcome::StepTooSmall);
        }
        let first = values.len() - self.field.event_count();
        if let Some(event) = kink.switch.checked_sub(first) {
            return self.jump(l, event, kink.switch, again);
        }
        let sign = again.sign_beyond(&x, kink, run.stuck, self.limits.sign);
        again.set(kink.switch, sign);
        again.slope_at(&x, 0);
        (0..n).for_each(|i| self.lanes.slopes[0][i * lanes + l] = again.slopes[0][i]);
        let at = kink.switch * lanes + l;
        self.lanes.signs[at] = sign;
        self.lanes.switches[at] = 0.0;
    }

    /// Continues beyond an event: in the state to which it leads, if its switch changes sign in its direction.
    fn jump(&mut self, l: usize, event: usize, switch: usize, again: &mut Shortened) {
        let (n, lanes, x) = (self.lanes.n, self.lanes.count, self.lanes.state(l));
        let (change, direction) = (-self.lanes.signs[switch * lanes + l], self.field.event_direction(event));
        if direction * change < 0.0 {
            again.set(switch, change);
            self.lanes.signs[switch * lanes + l] = change;
            self.lanes.switches[switch * lanes + l] = 0.0;
            again.slope_at(&x, 0);
            (0..n).for_each(|i| self.lanes.slopes[0][i * lanes + l] = again.slopes[0][i]);
            return;
        }
        let after = again.after(event, &x);
        (0..n).for_each(|i| self.lanes.x[i * lanes + l] = after[i]);
        let parameters = again.parameters.clone();
        let at = Batch {
            lanes: 1,
            states: &after,
            parameters: crate::contract::Parameters::Shared(&parameters),
            times: &[],
            signs: &[],
        };
        let (signs, values) = self.first_signs(at);
        for (s, (sign, value)) in signs.iter().zip(&values).enumerate() {
            again.set(s, *sign);
            self.lanes.signs[s * lanes + l] = *sign;
            // A value on the other side is rounding.
            self.lanes.switches[s * lanes + l] = if value * sign > 0.0 { *value } else { 0.0 };
        }
        again.slope_at(&after, 0);
        (0..n).for_each(|i| self.lanes.slopes[0][i * lanes + l] = again.slopes[0][i]);
        let time = self.lanes.time[l];
        if self.runs[l].flights.accumulate(time) {
            self.runs[l].done = Some(Outcome::Chatter);
        } else if after.iter().any(|x| !x.is_finite()) {
            self.runs[l].done = Some(Outcome::Undefined);
        }
    }

    /// Moves the end of the step tried by lane `l` to the surface along which it slides, if it does.
    pub(super) fn project(&mut self, l: usize, again: &mut Shortened) {
        let (n, lanes) = (self.lanes.n, self.lanes.count);
        if !self.lanes.signs.iter().skip(l).step_by(lanes).any(|sign| *sign == 0.0) {
            return;
        }
        let step = self.step_of(l);
        again.of(&step);
        let mut x = vec![0.0; n];
        step.end_into(&mut x);
        again.project(&mut x);
        (0..n).for_each(|i| self.lanes.next[i * lanes + l] = x[i]);
    }
}
