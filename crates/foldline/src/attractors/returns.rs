//! Returns to a section, and their predicted limit.
//!
//! **Idea.** A trajectory that approaches a cycle returns to a plane across it at points y₁, y₂, … that converge like a linear
//! map. A cycle that crosses the plane q times per period is seen by comparing every q-th return. The limit of a linear
//! map is computed from a few of its iterates, long before they get there.
//!
//! **Equations.** With differences uⱼ = yⱼ₊₁ - yⱼ of every q-th return, j = 0 … m, scaled by the extent of the motion:
//!
//!   (1)  γ = arg min |Σ γⱼ uⱼ| subject to Σ γⱼ = 1
//!   (2)  y* = Σ γⱼ yⱼ₊₁
//!
//! exact for an affine map whose minimal polynomial has degree m at most, which n - 1 is.
//!
//! **Source.** sidi2017, §1 (reduced rank extrapolation).
//!
//! **Fails when** the map is far from linear over the returns used. In few dimensions (1) has no remainder that would show it:
//! a prediction is a guess, to be checked by following it for a period.

use crate::linalg::lu;
use crate::simulation::Step;

/// Largest number of crossings per period that is looked for.
pub(super) const MOST_CROSSINGS: usize = 16;
/// Largest m of (1).
const MOST_TERMS: usize = 8;
/// Returns that are kept.
const KEPT: usize = MOST_CROSSINGS * 6;
/// Largest last difference, relative to the extent, from which a limit is predicted.
const NEAR: f64 = 0.5;

/// A plane, and where and when a trajectory came through it.
#[derive(Clone, Debug, Default)]
pub(super) struct Returns {
    /// `[n]` the plane passes through here …
    anchor: Vec<f64>,
    /// … with this normal `[n]`.
    normal: Vec<f64>,
    /// Last value of the plane's equation.
    side: f64,
    total: usize,
    times: Vec<f64>,
    /// `[return][n]`.
    states: Vec<f64>,
}

/// A predicted limit of the returns.
#[derive(Clone, Debug)]
pub(super) struct Prediction {
    /// `[n]`.
    pub(super) state: Vec<f64>,
    /// Time between the last returns that were compared.
    pub(super) period: f64,
}

impl Returns {
    /// A plane through `anchor`, across the velocity there as measured in `scale`.
    pub(super) fn across(anchor: Vec<f64>, velocity: &[f64], scale: &[f64]) -> Returns {
        let normal: Vec<f64> = velocity.iter().zip(scale).map(|(v, s)| v / (s * s)).collect();
        let length = normal.iter().map(|v| v * v).sum::<f64>().sqrt();
        let normal = normal.iter().map(|v| v / length).collect();
        Returns { anchor, normal, side: 0.0, total: 0, times: Vec::new(), states: Vec::new() }
    }

    /// The equation of the plane.
    pub(super) fn value(&self, x: &[f64]) -> f64 {
        self.normal.iter().zip(x).zip(&self.anchor).map(|((c, x), a)| c * (x - a)).sum()
    }

    /// How many returns there have been.
    pub(super) fn total(&self) -> usize {
        self.total
    }

    /// The last return `[n]`.
    pub(super) fn last(&self) -> Option<&[f64]> {
        self.states.rchunks_exact(self.anchor.len().max(1)).next()
    }

    /// Records a crossing in the direction of the normal within the step; says whether there was one.
    pub(super) fn follow(&mut self, step: &Step, end: &[f64]) -> bool {
        let value = self.value(end);
        let before = std::mem::replace(&mut self.side, value);
        if !(before < 0.0 && self.side >= 0.0) {
            return false;
        }
        let mut x = vec![0.0; end.len()];
        // Secants on the continuous solution, kept within the bracket (Illinois).
        let ([mut a, mut b], [mut ga, mut gb]) = ([0.0, 1.0], [before, self.side]);
        let mut theta = 1.0;
        for _ in 0..20 {
            theta = (gb * a - ga * b) / (gb - ga);
            step.state_into(theta, &mut x);
            let g = self.value(&x);
            if g.abs() <= 1e-12 * (self.side - before) {
                break;
            }
            if g < 0.0 {
                (a, ga, gb) = (theta, g, 0.5 * gb);
            } else {
                (b, gb, ga) = (theta, g, 0.5 * ga);
            }
        }
        if self.times.len() >= KEPT {
            self.times.remove(0);
            self.states.drain(..end.len());
        }
        self.total += 1;
        self.times.push(step.time_at(theta));
        self.states.extend(x);
        true
    }

    /// The limit of every q-th return, 1 ≤ q ≤ [`MOST_CROSSINGS`], if there are enough of them and they are close together.
    pub(super) fn predict(&self, q: usize, extent: &[f64]) -> Option<Prediction> {
        let n = self.anchor.len();
        let available = self.times.len().checked_sub(1)? / q;
        let terms = MOST_TERMS.min(n.saturating_sub(1)).min(available.checked_sub(1)?);
        let wanted = MOST_TERMS.min(n.saturating_sub(1)).min(KEPT / q - 2);
        if terms < wanted {
            return None;
        }
        let newest = self.times.len() - 1;
        // y(0) is the newest return.
        let y = |back: usize| &self.states[(newest - back * q) * n..][..n];
        let difference = |back: usize| -> Vec<f64> {
            (0..n).map(|i| (y(back)[i] - y(back + 1)[i]) / extent[i]).collect()
        };
        let u: Vec<Vec<f64>> = (0..=terms).map(difference).collect();
        let size = crate::linalg::max_abs(&u[0]);
        if !(size <= NEAR) {
            return None;
        }
        let period = self.times[newest] - self.times[newest - q];
        // Differences that small are dominated by the error of the integration.
        if size < 1e-6 {
            return Some(Prediction { state: y(0).to_vec(), period });
        }
        let gamma = weights(&u)?;
        let remainder = (0..n).fold(0.0, |m: f64, i| {
            m.max(gamma.iter().zip(&u).map(|(g, u)| g * u[i]).sum::<f64>().abs())
        });
        let state: Vec<f64> = (0..n).map(|i| gamma.iter().enumerate().map(|(j, g)| g * y(j)[i]).sum()).collect();
        let jump = (0..n).fold(0.0, |m: f64, i| m.max((state[i] - y(0)[i]).abs() / extent[i]));
        (remainder <= 0.2 * size && jump <= 0.5).then_some(Prediction { state, period })
    }
}

/// γ of (1), from the normal equations G c = 1, γ = c / Σ c, slightly regularised.
fn weights(u: &[Vec<f64>]) -> Option<Vec<f64>> {
    let m = u.len();
    let mut gram = vec![0.0; m * m];
    for i in 0..m {
        for j in 0..m {
            gram[i * m + j] = crate::linalg::dot(&u[i], &u[j]);
        }
    }
    let trace: f64 = (0..m).map(|i| gram[i * m + i]).sum();
    (0..m).for_each(|i| gram[i * m + i] += 1e-14 * trace);
    let mut pivots = vec![0; m];
    lu::factorise(&mut gram, m, &mut pivots).ok()?;
    let mut c = vec![1.0; m];
    lu::solve(&gram, m, &pivots, &mut c, 1);
    let sum: f64 = c.iter().sum();
    (sum.is_finite() && sum != 0.0).then(|| c.iter().map(|c| c / sum).collect())
}
