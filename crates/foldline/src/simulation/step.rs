//! An accepted step and the state anywhere on it.

use super::aligned::Aligned;
use super::tableau::{DENSE, STAGES};
use crate::contract::Parameters;

/// Accepted step of one trajectory, with a continuous solution of order 4 between its ends.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    pub(super) trajectory: usize,
    /// Column of the trajectory in the batch, and the number of columns.
    pub(super) column: usize,
    pub(super) lanes: usize,
    pub(super) time: f64,
    pub(super) length: f64,
    pub(super) end_time: f64,
    /// `[n × lanes]` states at the start and at the end.
    pub(super) from: &'a [f64],
    pub(super) to: &'a [f64],
    /// `[STAGES][n × lanes]`.
    pub(super) slopes: &'a [Aligned; STAGES],
    /// `[n]` solution between the ends if an implicit method took the step, in which case `slopes` holds only those at
    /// the ends; else empty.
    pub(super) courses: &'a [Course],
    pub(super) parameters: Parameters<'a>,
    /// `[switches × lanes]` signs of the switches along the step.
    pub(super) signs: &'a [f64],
}

impl Step<'_> {
    /// Index of the trajectory within its ensemble.
    pub fn trajectory(&self) -> usize {
        self.trajectory
    }

    /// Number of states n.
    pub fn dim(&self) -> usize {
        self.from.len() / self.lanes
    }

    /// Time at the start of the step.
    pub fn start_time(&self) -> f64 {
        self.time
    }

    /// Time at the end of the step.
    pub fn end_time(&self) -> f64 {
        self.end_time
    }

    /// Time at a fraction `theta` of the step.
    pub fn time_at(&self, theta: f64) -> f64 {
        if theta == 1.0 { self.end_time } else { self.time + theta * self.length }
    }

    /// Component `i` at the start.
    pub fn start(&self, i: usize) -> f64 {
        self.from[i * self.lanes + self.column]
    }

    /// Component `i` at the end.
    pub fn end(&self, i: usize) -> f64 {
        self.to[i * self.lanes + self.column]
    }

    /// Component `i` of f at the end.
    pub fn end_slope(&self, i: usize) -> f64 {
        self.slopes[STAGES - 1][i * self.lanes + self.column]
    }

    /// Writes the state `[n]` at the start.
    pub fn start_into(&self, x: &mut [f64]) {
        (0..x.len()).for_each(|i| x[i] = self.start(i));
    }

    /// Writes the state `[n]` at the end.
    pub fn end_into(&self, x: &mut [f64]) {
        (0..x.len()).for_each(|i| x[i] = self.end(i));
    }

    /// Writes the state `[n]` at a fraction `theta` ∈ [0, 1] of the step, (3) of the tableau.
    pub fn state_into(&self, theta: f64, x: &mut [f64]) {
        if theta == 1.0 {
            return self.end_into(x);
        }
        for (i, x) in x.iter_mut().enumerate() {
            *x = self.start(i) + self.component(i).change(theta);
        }
    }

    /// Course of Σ wᵢ xᵢ along the step, `weights` `[n]`.
    pub(crate) fn along(&self, weights: &[f64]) -> Course {
        let mut along = Course::default();
        for (i, weight) in weights.iter().enumerate() {
            let own = self.component(i);
            (0..4).for_each(|k| along.0[k] += weight * own.0[k]);
        }
        along
    }

    fn component(&self, i: usize) -> Course {
        if let Some(course) = self.courses.get(i) {
            return *course;
        }
        let (h, at) = (self.length, i * self.lanes + self.column);
        let change = self.to[at] - self.from[at];
        let b = h * self.slopes[0][at] - change;
        let c = change - h * self.slopes[STAGES - 1][at] - b;
        let d = h * DENSE.iter().zip(self.slopes).map(|(d, k)| d * k[at]).sum::<f64>();
        Course([change, b, c, d])
    }
}

/// Δ, B, C and D of (3) of the tableau, for one component or a linear function of the state.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Course([f64; 4]);

impl Course {
    pub(super) fn new(coefficients: [f64; 4]) -> Course {
        Course(coefficients)
    }

    /// Restriction to a fraction `theta` of the step, for a cubic polynomial (D = 0).
    pub(super) fn shortened(self, theta: f64) -> Course {
        let [change, b, c, _] = self.0;
        let end = self.change(theta);
        Course([end, theta * (change + b) - end, theta.powi(3) * c, 0.0])
    }

    /// Change from the start to a fraction `theta` ∈ [0, 1] of the step.
    pub(crate) fn change(&self, theta: f64) -> f64 {
        let [change, b, c, d] = self.0;
        let rest = 1.0 - theta;
        theta * (change + rest * (b + theta * (c + rest * d)))
    }
}
