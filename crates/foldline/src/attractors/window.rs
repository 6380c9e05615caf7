//! A number of consecutive steps of a trajectory.

use super::returns::limit_of;
use crate::simulation::Step;

/// Extent of the state over some steps, and those steps for interpolation in time.
pub(super) struct Window {
    pub(super) low: Vec<f64>,
    pub(super) high: Vec<f64>,
    /// Time, state and f at the end of every step.
    steps: Vec<(f64, Vec<f64>, Vec<f64>)>,
}

impl Window {
    pub(super) fn new(n: usize) -> Window {
        Window { low: vec![f64::MAX; n], high: vec![f64::MIN; n], steps: Vec::new() }
    }

    pub(super) fn add(&mut self, x: &[f64], step: &Step) {
        for i in 0..x.len() {
            self.low[i] = self.low[i].min(x[i]);
            self.high[i] = self.high[i].max(x[i]);
        }
        self.steps.push((step.end_time(), x.to_vec(), (0..x.len()).map(|i| step.end_slope(i)).collect()));
    }

    /// Returns the predicted limit of states at equal time intervals.
    pub(super) fn limit(&self, scales: &[f64]) -> Option<Vec<f64>> {
        let n = scales.len();
        let (start, end) = (self.steps.first()?.0, self.steps.last()?.0);
        let terms = n.min(8);
        // An odd fraction of the window, which is not the period of any motion.
        let spacing = 0.619 * (end - start) / (terms + 1) as f64;
        let states: Vec<Vec<f64>> = (0..terms + 2).map(|k| self.at(end - k as f64 * spacing)).collect();
        let states: Vec<&[f64]> = states.iter().map(Vec::as_slice).collect();
        limit_of(&states, scales)
    }

    /// Returns the state at a time, from the cubic through two steps and their slopes.
    fn at(&self, time: f64) -> Vec<f64> {
        let k = self.steps.partition_point(|(t, ..)| *t < time).clamp(1, self.steps.len() - 1);
        let ((t0, a, f), (t1, b, g)) = (&self.steps[k - 1], &self.steps[k]);
        let (h, s) = (t1 - t0, (time - t0) / (t1 - t0));
        let cubic = |i: usize| {
            let change = b[i] - a[i];
            a[i] + s * (change + (1.0 - s) * ((1.0 - s) * (h * f[i] - change) + s * (change - h * g[i])))
        };
        (0..a.len()).map(cubic).collect()
    }

    /// Returns the mean scaled speed.
    pub(super) fn speed(&self, scales: &[f64]) -> f64 {
        let way = |pair: &[(f64, Vec<f64>, Vec<f64>)]| {
            pair[0].1.iter().zip(&pair[1].1).zip(scales).fold(0.0, |m: f64, ((a, b), s)| m.max(((a - b) / s).abs()))
        };
        let (start, end) = (self.steps[0].0, self.steps[self.steps.len() - 1].0);
        self.steps.windows(2).map(way).sum::<f64>() / (end - start)
    }
}
