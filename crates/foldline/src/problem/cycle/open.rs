//! Boundary-value problems: conditions on both ends of an interval, and on integrals over it, instead of periodicity.
//!
//! **Equations.** With b conditions B and i integral conditions, b + i = n + s, the closure x_N = x_0 + g of
//! [`super`] (2) is replaced by
//!
//! ```text
//!   (1)  B(x_0, x_N, λ) = 0                        x_N the right end of the last polynomial
//!   (2)  Σ_j h_j Σ_i b_i g(X_{j,i}, λ) = 0
//! ```
//!
//! and T = 1, the length of the interval being the unit of time. The first n of these residuals stand where those of the
//! closure would, the others behind (4) of [`super`]; s of the unknowns λ are determined by them.
//!
//! A solution has no multipliers. In their place stands one number 1 - d, with
//!
//! ```text
//!   (3)  d = τ_λ sign(det J) / |J⁻¹ r|,   J = [F_u; τ],  τ the unit tangent, r a fixed vector
//! ```
//!
//! which has the sign of det F_u and passes through zero at folds (with τ_λ) and at simple branch points (with the
//! second factor). It says nothing about stability, which a boundary-value problem does not have.
//!
//! **Source.** ascher1995, §5; the bordered test function (3): govaerts2000, §4.

use super::CycleProblem;
use crate::contract::{Batch, Examination, Parameters, ZeroProblem};
use crate::diagram::{Point, Solution};
use crate::linalg::ends::Ends;
use crate::linalg::lane::Lane;
use crate::linalg::system::{System, either};
use num_complex::Complex64;

impl CycleProblem<'_> {
    /// True for a boundary-value problem.
    pub(super) fn is_open(&self) -> bool {
        self.conditions != [0, 0]
    }

    /// Number of border rows behind that of the period, before the rows of [`ZeroProblem::factorise`].
    pub(super) fn integrals(&self) -> usize {
        self.conditions[1]
    }

    /// s, the number of conditions beyond the number of states.
    pub(super) fn surplus(&self) -> usize {
        (self.conditions[0] + self.conditions[1]).saturating_sub(self.n)
    }

    /// x_0 and x_N.
    pub(super) fn both_ends(&self, profile: &[f64]) -> [Vec<f64>; 2] {
        let (n, block) = (self.n, self.block());
        let last = &profile[(self.intervals() - 1) * block..self.intervals() * block];
        let mut end = vec![0.0; n];
        for (node, weight) in last.chunks_exact(n).zip(&self.scheme.end) {
            end.iter_mut().zip(node).for_each(|(x, v)| *x += weight * v);
        }
        [profile[..n].to_vec(), end]
    }

    /// Left-hand sides of (1) and (2) for gathered states.
    fn misfits(&self, u: &[f64], parameters: &[f64]) -> Vec<f64> {
        let [left, right] = self.both_ends(u);
        let [mut all, ..] = self.setting.boundary([&left, &right], parameters);
        let [g, ..] = self.setting.integrands(self.batch(parameters));
        let lanes = self.lanes();
        all.extend(g.chunks_exact(lanes).map(|line| (0..lanes).map(|at| self.weight(at) * line[at]).sum::<f64>()));
        all
    }

    fn batch<'b>(&'b self, parameters: &'b [f64]) -> Batch<'b> {
        let (lanes, parameters) = (self.lanes(), Parameters::Shared(parameters));
        Batch { lanes, states: &self.states, parameters, times: &self.times, signs: &[] }
    }

    /// h_j b_i of a point of the batch; zero beyond the last interval.
    fn weight(&self, at: usize) -> f64 {
        let (m, w) = (self.scheme.degree, self.width);
        self.lengths[at / (w * m) * w + at % w] * self.scheme.weights[at / w % m]
    }

    /// Writes the residuals of (1) and (2) to `r`, for gathered states.
    pub(super) fn close(&self, u: &[f64], parameters: &[f64], r: &mut [f64]) {
        let (size, first) = (self.profile_size(), (self.intervals() - 1) * self.block());
        let all = self.misfits(u, parameters);
        let (own, more) = all.split_at(self.n.min(all.len()));
        r[first..first + own.len()].copy_from_slice(own);
        r[size + 1..size + 1 + more.len()].copy_from_slice(more);
    }

    /// Linearises (1) and (2) at gathered states, for the system that [`CycleProblem::fill`] has written.
    pub(super) fn open_ends(&mut self, u: &[f64], parameters: &[f64]) {
        let ([b, integrals], n, m) = (self.conditions, self.n, self.scheme.degree);
        let (axes, (_, q)) = (self.setting.axes.len(), self.system.shape());
        let [left, right] = self.both_ends(u);
        let [_, by_left, by_right, by_axis] = self.setting.boundary([&left, &right], parameters);
        let mut rows = vec![0.0; b * (2 * n + q)];
        for (r, row) in rows.chunks_exact_mut(2 * n + q).enumerate() {
            row[..n].copy_from_slice(&by_left[r * n..(r + 1) * n]);
            row[n..2 * n].copy_from_slice(&by_right[r * n..(r + 1) * n]);
            row[2 * n + 1..2 * n + 1 + axes].copy_from_slice(&by_axis[r * axes..(r + 1) * axes]);
        }
        let used = 1 + integrals + self.freedom();
        let [_, gx, gp] = self.setting.integrands(self.batch(parameters));
        let (lanes, width, length) = (self.lanes(), self.width, self.length);
        let weights: Vec<f64> = (0..lanes).map(|at| self.weight(at)).collect();
        let block = self.block();
        either!(&mut self.system, s => {
            for r in 0..integrals {
                let border = &mut s.border[(1 + r) * length * block..(2 + r) * length * block];
                border.fill(Default::default());
            }
            for (r, c, at) in (0..integrals * n * lanes).map(|k| (k / (n * lanes), k / lanes % n, k % lanes)) {
                let (lane, k, t) = (at % width, at / width % m, at / (width * m));
                let slot = ((1 + r) * length + t) * block + n + s.slot(k, c);
                s.border[slot].lanes_mut()[lane] = weights[at] * gx[(r * n + c) * lanes + at];
            }
            for (r, axis) in (0..integrals * axes).map(|k| (k / axes, k % axes)) {
                let own = &gp[(r * axes + axis) * lanes..][..lanes];
                s.corner[(1 + r) * q + 1 + axis] = own.iter().zip(&weights).map(|(g, w)| g * w).sum();
            }
        });
        self.system.open(Some(Ends::new(rows, used, 1 + axes)));
    }

    /// Solves with the last factorisation; the layouts are those of [`ZeroProblem::solve`].
    pub(super) fn solve_open(&self, rhs: &[f64], x: &mut [f64]) {
        let (size, first, n) = (self.profile_size(), (self.intervals() - 1) * self.block(), self.n);
        let ([b, _], (_, q)) = (self.conditions, self.system.shape());
        let surplus = self.surplus();
        let conditions = [&rhs[first..first + n], &rhs[size + 1..size + 1 + surplus]].concat();
        let mut all = rhs[..=size].to_vec();
        all[first..first + n].fill(0.0);
        all.extend(conditions[b..].iter().chain(&rhs[size + 1 + surplus..]));
        self.solve_behind(all, &conditions[..b], q, x);
    }

    /// Solves for defects of the profile alone, which satisfies the conditions.
    pub(super) fn solve_defects(&self, rhs: &[f64], x: &mut [f64]) {
        let ([b, _], (_, q)) = (self.conditions, self.system.shape());
        self.solve_behind(rhs[..self.profile_size()].to_vec(), &vec![0.0; b], q, x);
    }

    fn solve_behind(&self, mut rhs: Vec<f64>, conditions: &[f64], q: usize, x: &mut [f64]) {
        let size = self.profile_size();
        rhs.resize(size + q, 0.0);
        rhs.extend_from_slice(conditions);
        let mut found = vec![0.0; size + q];
        self.system.solve(&rhs, &mut found);
        let known = x.len();
        x.copy_from_slice(&found[..known]);
    }

    /// The number 1 - d of (3) in place of a spectrum, from the last factorisation.
    pub(super) fn degeneracy(&self, u: &[f64]) -> Examination {
        let (count, size) = (u.len(), self.profile_size());
        let orientation = self.system.ends().map_or(1.0, Ends::orientation);
        let length = |v: &[f64]| self.dot(v, v).sqrt();
        let (mut right, mut x) = (vec![0.0; count], vec![0.0; count]);
        right[count - 1] = 1.0;
        self.solve_open(&right, &mut x);
        let slope = x[count - 1] / length(&x);
        let wave = |k: usize| (0.3 + 0.7 * (k * k) as f64).sin();
        right.iter_mut().enumerate().for_each(|(k, r)| {
            *r = wave(k % self.block()) * if k < size { self.scale[k % self.n] } else { 0.0 };
        });
        self.solve_open(&right, &mut x);
        let d = slope * orientation / length(&x);
        Examination {
            spectrum: vec![Complex64::new(1.0 - d, 0.0)],
            unstable: usize::from(d < 0.0),
            ..Default::default()
        }
    }

    /// Copies of a point under a reflection; see [`ZeroProblem::images`].
    pub(super) fn mirrored(
        &self,
        beside: &[f64],
        point: &Point,
        reflection: &[bool],
        within: f64,
    ) -> Vec<[Vec<f64>; 2]> {
        let Solution::Cycle(cycle) = &point.solution else { return Vec::new() };
        let (whole, scalars) = (cycle.profile.len(), beside.len() - self.profile_size());
        if cycle.degree != self.scheme.degree || point.tangent.len() != whole + scalars {
            return Vec::new();
        }
        let moved = |profile: &[f64]| {
            let mut own = self.passed(profile, &cycle.mesh, &self.mesh);
            for c in (0..self.n).filter(|c| reflection.get(*c).copied().unwrap_or(false)) {
                own[c..].iter_mut().step_by(self.n).for_each(|x| *x = -*x);
            }
            own
        };
        let u = [&moved(&cycle.profile)[..], &[1.0], &self.setting.unknowns_of(point)].concat();
        let tangent = [&moved(&point.tangent[..whole])[..], &point.tangent[whole..]].concat();
        let off: Vec<f64> = u.iter().zip(beside).map(|(a, b)| a - b).collect();
        if self.dot(&off, &off) <= within * within { vec![[u, tangent]] } else { Vec::new() }
    }
}
