//! Exponents of a torus by carrying perturbations along it.
//!
//! **Idea.** A perturbation is carried from period to period by the transition matrices, and made orthogonal to the directions along the
//! torus and to those before it. The mean logarithm of its growth is the exponent. No eigenvectors are computed, so that
//! nothing depends on their classification.
//!
//! **Equations.** V_j has the trivial directions as its first columns; G_j is the transition matrix at phase φ_j = jρ:
//!
//! ```text
//!   (1)  [V_{j+1,trivial}, G_j V_{j,rest}] = V_{j+1} R_j
//!   (2)  log |μ_i| = Σ_j w_j log |R_j,ii|
//! ```
//!
//! with the weights of weighted Birkhoff averages.
//!
//! **Source.** benettin1980 (1); das2017 (2).

use super::ring::{Carried, Ring, spread};
use crate::attractors::weighted_average;
use crate::linalg::{axpy, dot, larger};
use crate::problem::torus::phases;

/// Periods over which the directions settle, and over which growth is averaged.
const SETTLING: usize = 400;
const AVERAGED: usize = 2000;

/// Orthonormal directions `[n][n]` and the logarithms of their growth since the last call.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    n: usize,
    /// Directions, one after the other.
    pub(super) columns: Vec<f64>,
    /// `[periods][n]`.
    growth: Vec<f64>,
}

impl Frame {
    /// Directions that begin with the given ones.
    pub(super) fn new(first: &[f64], n: usize) -> Frame {
        let rest = (first.len()..n * n).map(|at| (1.0 + 0.37 * at as f64 + 0.11 * (at * at) as f64).cos());
        let mut frame = Frame { n, columns: first.iter().copied().chain(rest).collect(), growth: Vec::new() };
        frame.orthogonalise();
        frame
    }

    /// Makes the columns orthonormal, in order; returns the logarithms of their lengths.
    fn orthogonalise(&mut self) -> Vec<f64> {
        let n = self.n;
        let mut logs = Vec::with_capacity(n);
        for i in 0..n {
            let (before, rest) = self.columns.split_at_mut(i * n);
            let own = &mut rest[..n];
            // Twice is enough.
            for _ in 0..2 {
                before.chunks_exact(n).for_each(|other| axpy(-dot(other, own), other, own));
            }
            let norm = dot(own, own).sqrt();
            own.iter_mut().for_each(|x| *x /= norm);
            logs.push(norm.ln());
        }
        logs
    }

    /// (1): replaces the directions by carried ones; the first may be given.
    pub(super) fn carried(&mut self, columns: Vec<f64>, given: &[f64]) {
        self.columns = columns;
        self.columns[..given.len()].copy_from_slice(given);
        let logs = self.orthogonalise();
        self.growth.extend(logs);
    }

    /// (2) for all but the first `trivial` directions, the largest first, with the error of the averages.
    pub(super) fn exponents(&self, trivial: usize, settling: usize) -> (Vec<f64>, f64) {
        let line = |i: usize| -> Vec<f64> {
            self.growth.iter().skip(settling * self.n + i).step_by(self.n).copied().collect()
        };
        let mut apart = 0.0;
        let mut all: Vec<f64> = (trivial..self.n)
            .map(|i| {
                let own = line(i);
                let [mean, error] = averaged(&own);
                apart = larger(apart, error);
                mean
            })
            .collect();
        all.sort_by(|a, b| b.total_cmp(a));
        (all, apart)
    }
}

/// Weighted average of a sequence, and its largest difference from those of three halves: at the beginning, in the middle and at the
/// end.
pub(super) fn averaged(values: &[f64]) -> [f64; 2] {
    let (mean, half) = (weighted_average(values), values.len() / 2);
    let off = |from: usize| (weighted_average(&values[from..from + half]) - mean).abs();
    [mean, [0, half / 2, values.len() - half].into_iter().map(off).fold(0.0, larger)]
}

/// Directions along the torus at a phase, in scaled components: along the curve and, without forcing, along the flow.
pub(super) struct Along {
    n: usize,
    directions: Vec<Vec<f64>>,
}

impl Along {
    pub(super) fn of(ring: &Ring, carried: &Carried, second: bool) -> Along {
        let n = ring.dim();
        let scaled =
            |v: Vec<f64>| -> Vec<f64> { v.iter().enumerate().map(|(at, x)| x / ring.scales[at % n]).collect() };
        let around = (!second).then(|| scaled(ring.around()));
        let flow = (!ring.forced).then(|| scaled(carried.begins.clone()));
        Along { n, directions: around.into_iter().chain(flow).collect() }
    }

    pub(super) fn count(&self) -> usize {
        self.directions.len()
    }

    pub(super) fn at(&self, turns: f64) -> Vec<f64> {
        self.directions.iter().flat_map(|own| phases::between(own, self.n, turns)).collect()
    }
}

/// Logarithms of the moduli of the non-trivial multipliers of a ring, the largest first, with their error by averaging and by interpolation
/// between the phases: that of fewer phases, `fewer`.
pub(super) fn of_ring(ring: &Ring, carried: &Carried, second: bool, fewer: usize) -> (Vec<f64>, f64) {
    let (n, along) = (ring.dim(), Along::of(ring, carried, second));
    let all = |transitions: &[f64]| {
        let mut frame = Frame::new(&along.at(0.0), n);
        for j in 0..SETTLING + AVERAGED {
            let matrix = phases::between(transitions, n * n, (j as f64 * ring.rotation).fract());
            let carried = frame.columns.chunks_exact(n).flat_map(|v| matrix.chunks_exact(n).map(|row| dot(row, v)));
            let carried = carried.collect();
            frame.carried(carried, &along.at(((j + 1) as f64 * ring.rotation).fract()));
        }
        frame.exponents(along.count(), SETTLING)
    };
    let (found, apart) = all(&carried.transitions);
    let (rough, _) = all(&spread(&carried.transitions, ring.phases(), fewer, n * n));
    let by_phases = found.iter().zip(&rough).map(|(a, b)| (a - b).abs()).fold(apart, larger);
    (found, by_phases)
}
