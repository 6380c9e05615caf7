//! Error estimates of a cycle at Radau points, where modes may decay within an interval.
//!
//! **Idea.** The defect of a component that follows the others at the rate μ is h T μ times its error, so its integral,
//! which serves as the local error at Gauss points, is too large by that factor. Here the linearised equation of the error
//! itself is solved on every interval, by collocation with one point more, and likewise the variational equation.
//!
//! **Equations.** d is the defect of [`crate::problem::defect`], w its integral, J = f_x(U), and A the integration matrix
//! of the m + 1 Radau points s_g:
//!
//!   (1)  e' = h T J e + d,   e(0) = 0     e_g - h T Σ_k A_gk J_k e_k = w(s_g)
//!   (2)  V' = h T J V,       V(0) = 1     V_g - h T Σ_k A_gk J_k V_k = 1
//!
//! The errors e(1) accumulate along the cycle through its own transitions.
//!
//! **Source.** hairer1996, §IV.8 (errors of stiff components); ascher1995, §9.
//!
//! **Fails when** a mode grows so fast that it is not resolved: both numbers of points then show decay. Growth by more
//! than [`GROWTH`] within an interval leaves the errors of multipliers unknown.

use super::CycleProblem;
use crate::contract::{Batch, Parameters};
use crate::linalg::{lu, panel};
use crate::problem::defect::{Defect, TOGETHER};
use crate::problem::gauss::Points;
use crate::stability::eigenvalues;

/// Largest h T Re λ of a growing mode. R(4) is within 0.2 % of e⁴ for m = 4.
pub(in crate::problem) const GROWTH: f64 = 4.0;

impl CycleProblem<'_> {
    /// True if modes may decay within an interval.
    pub(super) fn is_damped(&self) -> bool {
        self.scheme.points == Points::Radau
    }

    /// Replaces integrals of the defect at `u` by the solution of (1).
    ///
    /// The estimate of an interval on which (1) has no solution is NaN.
    pub(super) fn damp(&self, u: &[f64], scale: &[f64], defect: &mut Defect) {
        let (n, points, count) = (self.n, self.scheme.degree + 1, self.intervals());
        let Defect { local, within, ends, sources, misses } = defect;
        sources.fill(0.0);
        let w = within.clone();
        let place = |i: usize, g: usize, j: usize| (i * points + g) * count + j;
        let known = |j: usize, right: &mut [f64]| {
            (0..points * n).for_each(|at| right[at] = w[place(at % n, at / n, j)]);
        };
        self.staged(u, None, 1, known, |j, e| {
            (0..points * n).for_each(|at| within[place(at % n, at / n, j)] = e[at]);
            ends[j * n..(j + 1) * n].copy_from_slice(&e[(points - 1) * n..]);
            let sizes = e.iter().enumerate().map(|(at, e)| (e / scale[at % n]).abs());
            local[j] = sizes.fold(0.0, crate::linalg::larger);
        });
        misses.copy_from_slice(ends);
    }

    /// `[N][n × n]`: V(1) of (2) along a profile, with errors subtracted within intervals as in [`super::errors`];
    /// `None` if a mode grows too fast.
    pub(super) fn finer_transitions(&self, u: &[f64], without: Option<&[f64]>) -> Option<Vec<f64>> {
        let (n, points) = (self.n, self.scheme.degree + 1);
        let mut out = vec![0.0; self.intervals() * n * n];
        let identity = |_, right: &mut [f64]| {
            right.fill(0.0);
            (0..points * n).for_each(|at| right[at * n + at % n] = 1.0);
        };
        let resolved = self.staged(u, without, n, identity, |j, v| {
            out[j * n * n..(j + 1) * n * n].copy_from_slice(&v[(points - 1) * n * n..]);
        });
        resolved.then_some(out)
    }

    /// Solves (1) or (2) on every interval, with right-hand sides and solutions `[m + 1][n][columns]`. False if a mode
    /// grows too fast.
    fn staged(
        &self,
        u: &[f64],
        without: Option<&[f64]>,
        columns: usize,
        right: impl Fn(usize, &mut [f64]),
        mut take: impl FnMut(usize, &[f64]),
    ) -> bool {
        let (n, m, block, size) = (self.n, self.scheme.degree, self.block(), self.profile_size());
        let (points, order) = (m + 1, (m + 1) * n);
        let parameters = self.setting.at(&u[size + 1..]);
        let (mut matrix, mut pivots) = (vec![0.0; order * order], vec![0; order]);
        let mut x = vec![0.0; order * columns];
        let mut resolved = true;
        for first in (0..self.intervals()).step_by(TOGETHER) {
            let count = TOGETHER.min(self.intervals() - first);
            let lanes = count * points;
            let [mut own, mut states, mut f] = [(); 3].map(|()| vec![0.0; n * lanes]);
            let mut fx = vec![0.0; n * n * lanes];
            panel::by_component(&u[first * block..(first + count) * block], points, n, &mut own);
            for (c, (states, own)) in states.chunks_exact_mut(lanes).zip(own.chunks_exact(lanes)).enumerate() {
                self.sampling.sampled(own, count, states);
                for (g, states) in states.chunks_exact_mut(count).enumerate().take(without.map_or(0, |_| points)) {
                    let within = &without.unwrap_or(&[])[(c * points + g) * self.intervals() + first..][..count];
                    states.iter_mut().zip(within).for_each(|(x, w)| *x -= w);
                }
            }
            let times = self.sampling.times(&self.mesh[first..=first + count], self.forcing_periods);
            let parameters = Parameters::Shared(&parameters);
            let batch = Batch { lanes, states: &states, parameters, times: &times, signs: &[] };
            self.setting.field.linearise(batch, &[], &mut f, &mut fx, &mut []);
            for j in 0..count {
                let ht = self.h(first + j) * u[size];
                let slope = |g: usize, i: usize, l: usize| ht * fx[(i * n + l) * lanes + g * count + j];
                resolved &= !self.grows(|i, l| slope(m / 2, i, l));
                for (row, entries) in matrix.chunks_exact_mut(order).enumerate() {
                    let (g, i) = (row / n, row % n);
                    for (k, share) in self.sampling.shares(g).iter().enumerate() {
                        (0..n).for_each(|l| entries[k * n + l] = -share * slope(k, i, l));
                    }
                    entries[row] += 1.0;
                }
                right(first + j, &mut x);
                match lu::factorise(&mut matrix, order, &mut pivots) {
                    Ok(()) => lu::solve(&matrix, order, &pivots, &mut x, columns),
                    Err(_) => x.fill(f64::NAN),
                }
                take(first + j, &x);
            }
        }
        resolved
    }

    /// True if a mode of h T J grows too fast.
    fn grows(&self, slope: impl Fn(usize, usize) -> f64) -> bool {
        let n = self.n;
        let jacobian: Vec<f64> = (0..n * n).map(|at| slope(at / n, at % n)).collect();
        // The sum of absolute values in a row bounds all eigenvalues.
        let bound = |row: &[f64]| row.iter().map(|x| x.abs()).sum::<f64>();
        jacobian.chunks_exact(n).map(bound).fold(0.0, f64::max) > GROWTH
            && eigenvalues(&jacobian, n, &self.scale).iter().any(|z| z.re > GROWTH || z.re.is_nan())
    }
}
