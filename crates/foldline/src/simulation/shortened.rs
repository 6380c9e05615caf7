//! Part of an accepted step, at the full order.

use super::Step;
use super::kink::Kink;
use super::step::Course;
use super::tableau::{A, STAGES};
use crate::contract::{Batch, Parameters, VectorField};

/// Recomputes a step of one trajectory from its start, up to a fraction of its length.
pub(super) struct Shortened<'a> {
    field: &'a dyn VectorField,
    /// `[STAGES][n]` of the last step computed.
    pub(super) slopes: [Vec<f64>; STAGES],
    start: Vec<f64>,
    pub(super) parameters: Vec<f64>,
    signs: Vec<f64>,
    /// Length of the step.
    length: f64,
    /// Solution of a step taken by an implicit method; it is as accurate as the end of the step.
    courses: Vec<Course>,
}

impl<'a> Shortened<'a> {
    pub(super) fn new(field: &'a dyn VectorField) -> Shortened<'a> {
        let n = field.dim();
        let slopes = std::array::from_fn(|_| vec![0.0; n]);
        Shortened {
            field,
            slopes,
            start: vec![0.0; n],
            parameters: Vec::new(),
            signs: Vec::new(),
            length: 0.0,
            courses: Vec::new(),
        }
    }

    /// Takes the start, parameters and signs of switches from a step.
    pub(super) fn of(&mut self, step: &Step) {
        step.start_into(&mut self.start);
        self.length = step.length;
        self.courses.clear();
        self.courses.extend_from_slice(step.courses);
        (0..self.start.len()).for_each(|i| self.slopes[0][i] = step.slopes[0][i * step.lanes + step.column]);
        let own = |values: &[f64], to: &mut Vec<f64>| {
            to.clear();
            to.extend(values.iter().skip(step.column).step_by(step.lanes));
        };
        own(step.signs, &mut self.signs);
        match step.parameters {
            Parameters::Shared(values) => {
                self.parameters.clear();
                self.parameters.extend_from_slice(values);
            }
            Parameters::PerLane(values) => own(values, &mut self.parameters),
        }
    }

    /// Writes the state a time `h` after the start, by a step of that length; all its slopes but the last stay in
    /// `slopes`.
    pub(super) fn state_into(&mut self, h: f64, x: &mut [f64]) {
        if !self.courses.is_empty() {
            for (i, x) in x.iter_mut().enumerate() {
                *x = self.start[i] + self.courses[i].change(h / self.length);
            }
            return;
        }
        for (s, row) in A.iter().enumerate() {
            for i in 0..x.len() {
                let change: f64 = row.iter().zip(&self.slopes).map(|(a, k)| a * k[i]).sum();
                x[i] = self.start[i] + h * change;
            }
            if s + 2 < STAGES {
                self.slope_at(x, s + 1);
            }
        }
    }

    /// Evaluates f at `x` into slope number `k`.
    pub(super) fn slope_at(&mut self, x: &[f64], k: usize) {
        let at =
            Batch { lanes: 1, states: x, parameters: Parameters::Shared(&self.parameters), times: &[], signs: &[] };
        match self.signs.is_empty() {
            true => self.field.evaluate(at, &mut self.slopes[k]),
            false => self.field.evaluate(Batch { signs: &self.signs, ..at }, &mut self.slopes[k]),
        }
    }

    /// Writes the values of all switches at `x`.
    pub(super) fn switches_into(&self, x: &[f64], values: &mut [f64]) {
        let at =
            Batch { lanes: 1, states: x, parameters: Parameters::Shared(&self.parameters), times: &[], signs: &[] };
        self.field.switches(at, values);
    }

    /// Rate of change of a switch at `x` under the branch of f on one side of its surface.
    pub(super) fn normal_speed(&self, x: &[f64], switch: usize, side: f64) -> f64 {
        let [below, above] = self.field.normal_speeds(self.at(x), switch);
        if side < 0.0 { below[0] } else { above[0] }
    }

    /// True if both branches of f push towards the surface of a switch at `x` on it, in the direction of integration
    /// `forwards` = ±1, and the trajectory does not slide along another one.
    fn slides(&self, x: &[f64], switch: usize, forwards: f64) -> bool {
        if self.signs.contains(&0.0) {
            return false;
        }
        let [below, above] = self.field.normal_speeds(self.at(x), switch);
        forwards * below[0] > 0.0 && forwards * above[0] < 0.0
    }

    /// Moves `x` to the surface along which it slides, along the difference of both branches of f.
    pub(super) fn project(&self, x: &mut [f64]) {
        for switch in (0..self.signs.len()).filter(|s| self.signs[*s] == 0.0) {
            let mut values = vec![0.0; self.signs.len()];
            self.switches_into(x, &mut values);
            let [below, above] = self.field.normal_speeds(self.at(x), switch);
            let mut signs = self.signs.clone();
            let [f, g] = [-1.0, 1.0].map(|side| {
                signs[switch] = side;
                let mut f = vec![0.0; x.len()];
                self.field.evaluate(Batch { signs: &signs, ..self.at(x) }, &mut f);
                f
            });
            let share = values[switch] / (above[0] - below[0]);
            if share.is_finite() {
                x.iter_mut().zip(f.iter().zip(&g)).for_each(|(x, (f, g))| *x -= share * (g - f));
            }
        }
    }

    fn at<'b>(&'b self, x: &'b [f64]) -> Batch<'b> {
        Batch { lanes: 1, states: x, parameters: Parameters::Shared(&self.parameters), times: &[], signs: &self.signs }
    }

    /// State after an event at `x`.
    pub(super) fn after(&self, event: usize, x: &[f64]) -> Vec<f64> {
        let n = x.len();
        let [mut r, mut rx, mut rt] = [n, n * n, n].map(|size| vec![0.0; size]);
        self.field.reset(event, Batch { signs: &[], ..self.at(x) }, &[], [&mut r, &mut rx, &mut [], &mut rt]);
        r
    }

    /// Sets the sign of a switch from now on.
    pub(super) fn set(&mut self, switch: usize, sign: f64) {
        self.signs[switch] = sign;
    }

    /// Sign of a switch beyond a kink at `x`, which follows `stuck` others without progress: 0 if the trajectory slides
    /// from there on.
    pub(super) fn sign_beyond(&self, x: &[f64], kink: &Kink, stuck: usize, forwards: f64) -> f64 {
        if kink.leaves != 0.0 {
            kink.leaves
        } else if stuck > 0 && self.slides(x, kink.switch, forwards) {
            0.0
        } else {
            -self.signs[kink.switch]
        }
    }
}
