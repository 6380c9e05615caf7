//! Stability of a torus.
//!
//! **Idea.** Perturbations of the closed curve are carried over a period by the transition matrices and turned back by ρ:
//! a linear operator. With an eigenvector v(φ) and eigenvalue μ, v(φ) exp(2πi j φ) is one too, with μ exp(-2πi j ρ), so that
//! the spectrum lies on n circles. The radius of each is the factor of growth per period; one eigenvector of each family
//! represents it.
//!
//! **Equations.** With G_k the transition matrix of segment k:
//!
//! ```text
//!   (1)  L = R(-ρ) diag(G_k),    L v = μ v
//!   (2)  frequency of v:  Σ_j j |v_j|² / Σ_j |v_j|²,  v_j its Fourier coefficients
//!   (3)  Σ log |μ| over the n families = mean of ∫ tr f_x dt
//! ```
//!
//! A family is represented by the eigenvector whose mean frequency (2) lies between -1/2 and 1/2. Eigenvectors with high
//! harmonics are not resolved, and are told by their mean square. One family
//! (two without forcing) is trivial, with μ = 1. The defects of the trivial ones and of (3) are stated with the point.
//!
//! **Source.** jorba2001.
//!
//! **Fails when** the perturbations are not reducible to constant coefficients, as near the break-up of a torus: (3) then
//! has a large defect.

use super::TorusProblem;
use super::phases;
use crate::contract::Examination;
use crate::diagram::Trust;
use crate::linalg::larger;
use foldline_general::Mat;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Ratio of the stated to the estimated error of multipliers.
const SAFE: f64 = 4.0;
/// Rounding of a mean frequency of one half.
const HALF: f64 = 1e-6;
/// Error of a multiplier by rounding.
const ROUNDING: f64 = 1e-11;

impl TorusProblem<'_> {
    /// Multipliers per period, the trivial ones first, from the last factorisation.
    pub(super) fn spectrum(&self) -> Examination {
        let trivial = self.phase_count();
        // The phase of a second forcing is neutral.
        let given = usize::from(self.second.is_some());
        let unknown = || Examination {
            spectrum: vec![Complex64::new(f64::NAN, f64::NAN); self.n + given],
            trivial: trivial + given,
            ..Examination::default()
        };
        let found = self.transitions().and_then(|all| self.representatives(&all, self.turn));
        let Some(mut found) = found else { return unknown() };
        for at in 0..trivial.min(found.len()) {
            let off = |z: &Complex64| (z - 1.0).norm();
            let best = (at..found.len()).min_by(|a, b| off(&found[*a]).total_cmp(&off(&found[*b])));
            let own = found.remove(best.unwrap_or(at));
            found.insert(at, own);
        }
        found[trivial..].sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
        let sum: f64 = found.iter().map(|z| z.norm().ln()).sum();
        let trust = Trust {
            trivial_defect: found[..trivial].iter().fold(0.0, |most, z| most.max((z - 1.0).norm())),
            liouville_defect: (sum - self.trace).abs(),
            spectrum: f64::NAN,
            ..Trust::default()
        };
        let unstable = found[trivial..].iter().filter(|z| z.norm() > 1.0).count();
        let trivial = trivial + given;
        found.splice(0..0, vec![Complex64::new(1.0, 0.0); given]);
        Examination { spectrum: found, trivial, unstable, trust, ..Examination::default() }
    }

    /// Estimated error of the multipliers at `u`: the defects of those that are known, and the change of their moduli if the torus
    /// is corrected. The defects alone do not show the error of the torus itself, to which multipliers react strongly near
    /// folds.
    pub(super) fn spectrum_doubt(&self, u: &[f64]) -> f64 {
        let found = self.spectrum();
        let there = self.corrected(u);
        let moduli = |all: Vec<Complex64>| {
            let mut moduli: Vec<f64> = all.iter().map(|z| z.norm()).collect();
            moduli.sort_by(|a, b| b.total_cmp(a));
            moduli
        };
        let second = usize::from(self.second.is_some());
        let change = match self
            .transitions_at(&there)
            .and_then(|all| self.representatives(&all, there[self.profile_size() + 1]))
        {
            Some(other) => moduli(found.spectrum[second..].to_vec())
                .iter()
                .zip(moduli(other))
                .fold(0.0, |most, (a, b)| larger(most, (a - b).abs() / a.max(1.0))),
            None => f64::NAN,
        };
        SAFE * (found.trust.trivial_defect + found.trust.liouville_defect + change) + ROUNDING
    }

    /// Transition matrices of the segments at the last factorisation.
    fn transitions(&self) -> Option<Vec<Vec<f64>>> {
        self.segments.iter().map(|segment| segment.remainder()?.transition().ok()).collect()
    }

    /// Transition matrices of the segments at `u`; the last factorisation is kept.
    fn transitions_at(&self, u: &[f64]) -> Option<Vec<Vec<f64>>> {
        let mut own = self.segment(0);
        (0..self.phases)
            .map(|k| {
                if self.second.is_some() {
                    own = self.segment(k);
                }
                own.segment_factorise(&self.of_segment(u, k), &[], &self.scale).ok()?;
                own.remainder()?.transition().ok()
            })
            .collect()
    }

    /// One multiplier of each family, for transition matrices and ρ.
    fn representatives(&self, transitions: &[Vec<f64>], turn: f64) -> Option<Vec<Complex64>> {
        let (n, count) = (self.n, self.phases);
        let [table, _] = phases::shift(count, -turn);
        let mut operator: Mat<f64> = Mat::zeros(count * n, count * n);
        for (l, own) in transitions.iter().enumerate() {
            for (i, c) in (0..n * n).map(|at| (at / n, at % n)) {
                let entry = own[i * n + c] * self.scale[c] / self.scale[i];
                for k in 0..count {
                    operator[(k * n + i, l * n + c)] = table[(k + count - l) % count] * entry;
                }
            }
        }
        let (values, vectors) = foldline_general::eigenvectors(operator.as_ref())?;
        let frequencies = self.frequencies(&vectors);
        // Of each family the members about frequency zero; those of high frequency are not resolved, and mix.
        let class = |at: usize| frequencies[at][0].abs() > 0.5 + HALF;
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|a, b| class(*a).cmp(&class(*b)).then(frequencies[*a][1].total_cmp(&frequencies[*b][1])));
        Some(order[..n].iter().map(|at| values[*at]).collect())
    }

    /// (2) of every eigenvector, by the rate of change along the phase, and the mean square.
    fn frequencies(&self, vectors: &Mat<Complex64>) -> Vec<[f64; 2]> {
        let (n, count) = (self.n, self.phases);
        let [_, rate] = phases::shift(count, 0.0);
        let change: Mat<f64> = Mat::from_fn(count, count, |k, l| rate[(k + count - l) % count]);
        let (mut sums, mut norms) = (vec![[0.0; 2]; vectors.ncols()], vec![0.0; vectors.ncols()]);
        for c in 0..n {
            let part =
                |of: fn(&Complex64) -> f64| Mat::from_fn(count, vectors.ncols(), |k, v| of(&vectors[(k * n + c, v)]));
            let (real, imaginary) = (part(|z| z.re), part(|z| z.im));
            let [by_real, by_imaginary] = [&real, &imaginary].map(|own| foldline_general::product(&change, own));
            for v in 0..vectors.ncols() {
                for k in 0..count {
                    let (x, y) = (real[(k, v)], imaginary[(k, v)]);
                    let (dx, dy) = (by_real[(k, v)], by_imaginary[(k, v)]);
                    sums[v][0] += x * dy - y * dx;
                    sums[v][1] += (dx * dx + dy * dy) / TAU;
                    norms[v] += x * x + y * y;
                }
            }
        }
        sums.iter().zip(&norms).map(|(sum, norm)| sum.map(|sum| sum / (TAU * norm))).collect()
    }
}
