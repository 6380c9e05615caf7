//! One trajectory integrated by the implicit method, with its kinks.

use super::aligned::Aligned;
use super::ensemble::Limits;
use super::kink::{self, Kink, PLACES};
use super::radau::{Attempt, Radau};
use super::shortened::Shortened;
use super::step::Course;
use super::tableau::STAGES;
use super::{Outcome, Step, Tolerance};
use crate::contract::{Batch, Parameters, VectorField, Verdict};

/// Trajectory in progress.
pub(super) struct Implicit<'a> {
    field: &'a dyn VectorField,
    parameters: &'a [f64],
    limits: &'a Limits,
    trajectory: usize,
    radau: Radau<'a>,
    again: Shortened<'a>,
    /// `[switches]` values at the start of a step, 0 if the switch has just changed sign, and at each of [`PLACES`].
    pub(super) switches: Vec<f64>,
    ahead: [Vec<f64>; PLACES.len()],
    /// Slopes at both ends of a step; the others are not known.
    slopes: [Aligned; STAGES],
    pub(super) time: f64,
    /// Length of the next step to try.
    pub(super) h: f64,
    /// Successive sign changes of a switch without progress.
    pub(super) stuck: usize,
}

/// State in which a trajectory is taken over.
pub(super) struct From<'a> {
    pub(super) trajectory: usize,
    pub(super) time: f64,
    pub(super) h: f64,
    pub(super) state: &'a [f64],
    pub(super) signs: Vec<f64>,
    pub(super) switches: Vec<f64>,
}

/// Result of a step.
pub(super) enum Advance {
    /// The step was accepted. `stops` is the observer's answer, `largest` the largest component at its end.
    Accepted { stops: bool, largest: f64 },
    /// The step was rejected and a shorter one is tried next; the outcome applies if that is too short to progress.
    Rejected(Outcome),
}

impl<'a> Implicit<'a> {
    pub(super) fn new(
        field: &'a dyn VectorField,
        parameters: &'a [f64],
        tolerance: &'a Tolerance,
        limits: &'a Limits,
        from: From,
    ) -> Implicit<'a> {
        let From { trajectory, time, h, state, signs, switches } = from;
        let ahead = std::array::from_fn(|_| vec![0.0; switches.len()]);
        Implicit {
            field,
            parameters,
            limits,
            trajectory,
            radau: Radau::new(field, parameters, tolerance, state, signs),
            again: Shortened::new(field),
            switches,
            ahead,
            slopes: std::array::from_fn(|_| Aligned::zeros(state.len())),
            time,
            h,
            stuck: 0,
        }
    }

    /// State `[n]`, slope there and signs of the switches.
    pub(super) fn here(&mut self) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let slope = self.radau.slope().to_vec();
        (self.radau.x.clone(), slope, self.radau.signs.clone())
    }

    /// Tries a step, which `observe` sees if it is accepted.
    pub(super) fn advance(&mut self, observe: &mut Option<&mut dyn FnMut(&Step) -> Verdict>) -> Advance {
        let remaining = self.limits.end - self.time;
        let last = self.h.abs() * 1.01 >= remaining.abs();
        let length = if last { remaining } else { self.h };
        let planned = match self.radau.attempt(length) {
            Attempt::Accepted(planned) => planned,
            Attempt::Rejected(shorter) => {
                self.h = shorter;
                return Advance::Rejected(Outcome::StepTooSmall);
            }
            Attempt::Undefined(shorter) => {
                self.h = shorter;
                return Advance::Rejected(Outcome::Undefined);
            }
        };
        let end = if last { self.limits.end } else { self.time + length };
        self.slopes[0].copy_from_slice(self.radau.slope());
        let kink = self.first_kink(length, end);
        let (mut next, mut courses) = (self.radau.next.clone(), self.radau.courses.clone());
        let (mut length, mut end) = (length, end);
        if let Some(Kink { theta, .. }) = kink {
            self.step(length, end).state_into(theta, &mut next);
            courses.iter_mut().for_each(|course| *course = course.shortened(theta));
            end = self.step(length, end).time_at(theta);
            length *= theta;
        }
        if self.radau.signs.contains(&0.0) {
            let mut again = std::mem::replace(&mut self.again, Shortened::new(self.field));
            again.of(&self.step(length, end));
            again.project(&mut next);
            self.again = again;
        }
        let stops = length != 0.0 && self.show(length, end, &next, &courses, observe);
        match kink {
            Some(kink) => {
                // The kink does not reduce the length of the next step.
                self.stuck = if kink.theta < 1e-8 { self.stuck + 1 } else { 0 };
                let sign = self.again.sign_beyond(&next, &kink, self.stuck, self.limits.sign);
                self.radau.pass(&next, kink.switch, sign);
                let at = Batch {
                    lanes: 1,
                    states: &next,
                    parameters: Parameters::Shared(self.parameters),
                    times: &[],
                    signs: &[],
                };
                self.field.switches(at, &mut self.switches);
                self.switches[kink.switch] = 0.0;
            }
            None => {
                self.stuck = 0;
                self.radau.next.copy_from_slice(&next);
                self.radau.go_on();
                self.switches.copy_from_slice(&self.ahead[PLACES.len() - 1]);
                self.h = planned.clamp(-self.limits.longest, self.limits.longest);
            }
        }
        self.time = end;
        Advance::Accepted { stops, largest: crate::linalg::max_abs(&next) }
    }

    /// Batch of one point of the trajectory.
    fn at<'b>(&'b self, states: &'b [f64]) -> Batch<'b> {
        Batch { lanes: 1, states, parameters: Parameters::Shared(self.parameters), times: &[], signs: &[] }
    }

    /// The step that was accepted last.
    fn step(&self, length: f64, end_time: f64) -> Step<'_> {
        Step {
            trajectory: self.trajectory,
            column: 0,
            lanes: 1,
            time: self.time,
            length,
            end_time,
            from: &self.radau.x,
            to: &self.radau.next,
            slopes: &self.slopes,
            courses: &self.radau.courses,
            parameters: Parameters::Shared(self.parameters),
            signs: &self.radau.signs,
        }
    }

    /// First sign change of a switch within the step.
    fn first_kink(&mut self, length: f64, end: f64) -> Option<Kink> {
        if self.switches.is_empty() {
            return None;
        }
        let mut x = vec![0.0; self.radau.x.len()];
        for (place, theta) in PLACES.into_iter().enumerate() {
            self.step(length, end).state_into(theta, &mut x);
            let mut ahead = std::mem::take(&mut self.ahead[place]);
            self.field.switches(self.at(&x), &mut ahead);
            self.ahead[place] = ahead;
        }
        let mut again = std::mem::replace(&mut self.again, Shortened::new(self.field));
        let kink = kink::first(&self.step(length, end), &mut again, |switch| {
            let value = |k: usize| if k == 0 { self.switches[switch] } else { self.ahead[k - 1][switch] };
            kink::samples(self.radau.signs[switch], value)
        });
        self.again = again;
        kink
    }

    /// Shows a step that ends in `next`; true if the observer stops.
    fn show(
        &mut self,
        length: f64,
        end: f64,
        next: &[f64],
        courses: &[Course],
        observe: &mut Option<&mut dyn FnMut(&Step) -> Verdict>,
    ) -> bool {
        let Some(observe) = observe else { return false };
        let mut slope = std::mem::take(&mut self.slopes[STAGES - 1]);
        match self.radau.signs.is_empty() {
            true => self.field.evaluate(self.at(next), &mut slope),
            false => self.field.evaluate(Batch { signs: &self.radau.signs, ..self.at(next) }, &mut slope),
        }
        self.slopes[STAGES - 1] = slope;
        observe(&Step { to: next, courses, ..self.step(length, end) }) == Verdict::Stop
    }
}
