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
//!   (3)  d = τ_λ sign(det J) / |y|,   J y = r,   J = [F_u; τ],  τ the unit tangent
//! ```
//!
//! and r a fixed vector with entries for the conditions alone, so that y solves the variational equation. d has the
//! sign of det F_u and passes through zero at folds (with τ_λ) and at simple branch points (with 1/|y|). It says nothing
//! about stability, which a boundary-value problem does not have.
//!
//! The mesh resolves y / |y| as well as the solution: next to a singular point that is the null vector, on which the
//! place of the point depends, and which may vary faster than the solution.
//!
//! **Source.** ascher1995, §5; the bordered test function (3): govaerts2000, §4.

use super::CycleProblem;
use crate::contract::{Batch, Examination, Parameters, VectorField, ZeroProblem};
use crate::diagram::{Point, Solution, Symmetry};
use crate::linalg::ends::Ends;
use crate::linalg::lane::Lane;
use crate::linalg::system::{System, either};
use crate::linalg::{axpy, dot};
use crate::problem::defect::Defect;
use crate::problem::gauss::Scheme;
use crate::problem::piecewise::OneBranch;
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

    /// Places of the residuals of (1) and (2).
    pub(super) fn places_of_conditions(&self) -> impl Iterator<Item = usize> {
        let (size, first) = (self.profile_size(), (self.intervals() - 1) * self.block());
        (first..first + self.n).chain(size + 1..size + 1 + self.surplus())
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

    /// f at the left ends of all intervals and at the right end of the last, `[N + 1][n]`, in the branch that is in force
    /// there.
    pub(in crate::problem) fn rates_at_nodes(&self, u: &[f64]) -> Vec<f64> {
        let (n, count, block) = (self.n, self.intervals(), self.block());
        let [_, end] = self.both_ends(u);
        let parameters = self.setting.at(&u[self.profile_size() + 1..]);
        let node = |j: usize| if j < count { &u[j * block..j * block + n] } else { &end[..] };
        let rates = |j: usize, signs: &[f64]| {
            let (time, mut f) = ([f64::from(self.forcing_periods) * self.mesh[j]], vec![0.0; n]);
            let times = if self.is_forced() { &time[..] } else { &[] };
            let parameters = Parameters::Shared(&parameters);
            self.setting.field.evaluate(Batch { lanes: 1, states: node(j), parameters, times, signs }, &mut f);
            f
        };
        let mut all: Vec<Vec<f64>> = (0..=count).map(|j| rates(j, &[])).collect();
        let switched = self.switched(u);
        for found in switched.iter() {
            all[found.interval] = rates(found.interval, found.signs_at_left());
        }
        // A slide that reaches a node goes on there.
        for found in switched.iter().filter(|found| found.interval + 1 == count || found.slides_at_right()) {
            all[found.interval + 1] = rates(found.interval + 1, found.signs_at_right());
        }
        all.concat()
    }

    /// True if the orbit of the last factorisation slides along a surface, and so loses a direction.
    pub(in crate::problem) fn slides(&self) -> bool {
        self.trace == f64::NEG_INFINITY
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

    /// Lets the conditions refer to the solution `u`.
    pub(super) fn refer(&mut self, u: &[f64]) {
        let size = self.profile_size();
        let mut parameters = self.setting.at(&u[size + 1..]);
        let [left, right] = self.both_ends(u);
        self.setting.field.refer([&left, &right], &mut parameters);
        self.setting.parameters = parameters;
    }

    /// Estimated error of `u` from terms that the conditions at the ends neglect, relative; the last factorisation must
    /// be one near `u`.
    pub fn truncation(&self, u: &[f64]) -> f64 {
        let (size, first, n) = (self.profile_size(), (self.intervals() - 1) * self.block(), self.n);
        let [left, right] = self.both_ends(u);
        let left_out = match self.is_open() {
            true => self.setting.field.remainders([&left, &right], &self.setting.at(&u[size + 1..])),
            false => Vec::new(),
        };
        if left_out.is_empty() {
            return 0.0;
        }
        let (mut rhs, mut shift) = (vec![0.0; u.len()], vec![0.0; u.len()]);
        rhs[first..first + n].copy_from_slice(&left_out[..n]);
        rhs[size + 1..size + 1 + left_out.len() - n].copy_from_slice(&left_out[n..]);
        self.solve_open(&rhs, &mut shift);
        self.relative_size(&shift, u)
    }

    /// The number 1 - d of (3) in place of a spectrum, from the last factorisation.
    pub(super) fn degeneracy(&self, u: &[f64]) -> Examination {
        if let Some([spectrum, _]) = self.setting.field.saddles(&self.setting.at(&u[self.profile_size() + 1..])) {
            let unstable = spectrum.iter().filter(|z| z.re > 0.0).count();
            return Examination { spectrum, unstable, ..Examination::default() };
        }
        let orientation = self.system.ends().map_or(1.0, Ends::orientation);
        let tangent = self.tangent();
        let d = tangent[tangent.len() - 1] * orientation / self.response(&tangent).1;
        let spectrum = vec![Complex64::new(1.0 - d, 0.0)];
        // The number of negative d tells folds from branch points.
        Examination { spectrum, unstable: usize::from(d < 0.0), ..Examination::default() }
    }

    /// The unit tangent, from the last factorisation.
    fn tangent(&self) -> Vec<f64> {
        let count = self.unknowns();
        let (mut right, mut tangent) = (vec![0.0; count], vec![0.0; count]);
        right[count - 1] = 1.0;
        self.solve_open(&right, &mut tangent);
        self.unit(&mut tangent);
        tangent
    }

    /// Divides a vector by its length, which it returns.
    fn unit(&self, x: &mut [f64]) -> f64 {
        let length = self.dot(x, x).sqrt();
        x.iter_mut().for_each(|x| *x /= length);
        length
    }

    /// y / |y| and |y| of (3), from the last factorisation, whose last row may have been another than the tangent.
    fn response(&self, tangent: &[f64]) -> (Vec<f64>, f64) {
        let count = self.unknowns();
        let (mut right, mut y) = (vec![0.0; count], vec![0.0; count]);
        for (k, (place, weight)) in self.places_of_conditions().zip(self.sizes_of_conditions()).enumerate() {
            right[place] = weight * (0.3 + 0.7 * (k * k) as f64).sin();
        }
        self.solve_open(&right, &mut y);
        axpy(-self.dot(&y, tangent), tangent, &mut y);
        let length = self.unit(&mut y);
        (y, length)
    }

    /// Size of every condition: its change if the states change by their scales.
    fn sizes_of_conditions(&self) -> Vec<f64> {
        let (n, block, length) = (self.n, self.block(), self.length);
        let mut sizes = self.system.ends().map_or_else(Vec::new, |ends| ends.sizes(&self.scale));
        for r in 0..self.integrals() {
            let mut sum = 0.0;
            either!(&self.system, s => {
                let rows = &s.border[(1 + r) * length * block..(2 + r) * length * block];
                for row in rows.chunks_exact(block) {
                    let own = (0..n).flat_map(|c| (0..self.scheme.degree).map(move |k| (c, k)));
                    own.for_each(|(c, k)| {
                        let entry = row[n + s.slot(k, c)];
                        sum += entry.lanes().iter().map(|x| x.abs()).sum::<f64>() * self.scale[c];
                    });
                }
            });
            sizes.push(sum);
        }
        sizes
    }

    /// Errors of y / |y| on every interval, the relative error of |y|, both estimated like those of the solution, and the factor by
    /// which defects on single intervals grow.
    pub(super) fn errors_of_response(&self, u: &[f64], scale: &[f64]) -> (Vec<f64>, f64, f64) {
        let tangent = self.tangent();
        let (y, length) = self.response(&tangent);
        let (n, size, count) = (self.n, self.profile_size(), self.intervals());
        let parameters = self.setting.at(&u[size + 1..]);
        let change = self.setting.spread(&y[size + 1..]);
        let own = Varied { field: self.setting.field, change, remaining: None };
        let remaining = self.remaining(u, &y, &own);
        let field =
            Varied { remaining: Some(Remaining { mesh: &self.mesh, scheme: &self.scheme, values: remaining }), ..own };
        let both = u[..size].chunks_exact(n).zip(y.chunks_exact(n));
        let profile: Vec<f64> = both.flat_map(|(x, y)| x.iter().chain(y)).copied().collect();
        let sizes = [scale, scale].concat();
        let found = self.defect(&field, &parameters, &profile, &self.mesh, u[size], &sizes);
        let mut local = vec![0.0f64; count];
        let within = |found: &Defect, local: &mut [f64]| {
            let (half, count) = (found.within.len() / 2, local.len());
            for (k, w) in found.within[half..].iter().enumerate() {
                let component = k / count / (self.scheme.degree + 1);
                local[k % count] = local[k % count].max((w / scale[component]).abs());
            }
        };
        within(&found, &mut local);
        let second =
            |all: &[f64]| -> Vec<f64> { all.chunks_exact(2 * n).flat_map(|both| &both[n..]).copied().collect() };
        let [mut misses, mut ends, mut sources] = [&found.misses, &found.ends, &found.sources].map(|all| second(all));
        // Where the orbit switches, the parts have the variational equations of their branches.
        let (block, inner) = (self.block(), self.scheme.degree * n);
        for own in self.switched(u).iter() {
            let j = own.interval;
            let direction = [&y[j * block..j * block + n], &y[size..]].concat();
            sources[j * inner..(j + 1) * inner].fill(0.0);
            local[j] = 0.0;
            let mut missed = vec![0.0; n];
            for part in &own.parts {
                let branch = OneBranch { field: self.setting.field, signs: &part.signs };
                let field = Varied { field: &branch, change: field.change.clone(), remaining: None };
                let along = part.by.chunks_exact(direction.len()).map(|row| dot(row, &direction)).collect::<Vec<f64>>();
                let both = part.nodes.chunks_exact(n).zip(along.chunks_exact(n));
                let nodes: Vec<f64> = both.flat_map(|(x, y)| x.iter().chain(y)).copied().collect();
                let found = self.defect(&field, &parameters, &nodes, &part.ends, u[size], &sizes);
                let mut error = [0.0];
                within(&found, &mut error);
                local[j] = local[j].max(error[0]);
                missed.iter_mut().zip(second(&found.misses)).for_each(|(all, own)| *all += own);
            }
            ends[j * n..(j + 1) * n].copy_from_slice(&missed);
            misses[j * n..(j + 1) * n].copy_from_slice(&missed);
        }
        let rhs = self.defects_of(&ends, &sources, u.len());
        let mut shift = vec![0.0; u.len()];
        self.solve_defects(&rhs, &mut shift);
        axpy(-self.dot(&shift, &tangent), &tangent, &mut shift);
        let along = self.dot(&shift, &y);
        axpy(-along, &y, &mut shift);
        let off = (along / length).abs();
        let sizes: Vec<f64> = misses
            .chunks_exact(n)
            .map(|e| e.iter().zip(scale).map(|(v, s)| (v / s).abs()).fold(0.0, f64::max))
            .collect();
        let largest = sizes.iter().fold(f64::MIN_POSITIVE, |m: f64, s| m.max(*s));
        let aside = self.dot(&shift, &shift).sqrt();
        let gain = aside.max(off) / largest;
        (local.iter().zip(&sizes).map(|(l, s)| l + gain * s).collect(), along.abs(), gain)
    }

    /// `[N][m][n]`: what remains of y' - f_x y - f_λ y_λ at the collocation points. y belongs to the last factorisation, and the
    /// matrix may have changed since by a Newton step. No mesh reduces this part of the defect, which is no error of discretisation.
    fn remaining(&self, u: &[f64], y: &[f64], field: &Varied) -> Vec<f64> {
        let (n, m, block, count) = (self.n, self.scheme.degree, self.block(), self.intervals());
        let lanes = count * m;
        let (mut states, mut times) = (vec![0.0; 2 * n * lanes], vec![0.0; lanes]);
        for (lane, (j, i)) in (0..lanes).map(|lane| (lane, (lane / m, lane % m))) {
            times[lane] = f64::from(self.forcing_periods) * (self.mesh[j] + self.h(j) * self.scheme.nodes[i + 1]);
            for c in 0..n {
                let at = j * block + (i + 1) * n + c;
                states[c * lanes + lane] = u[at];
                states[(n + c) * lanes + lane] = y[at];
            }
        }
        let parameters = self.setting.at(&u[self.profile_size() + 1..]);
        let at =
            Batch { lanes, states: &states, parameters: Parameters::Shared(&parameters), times: &times, signs: &[] };
        let mut rates = vec![0.0; 2 * n * lanes];
        field.evaluate(at, &mut rates);
        let mut left = vec![0.0; lanes * n];
        for (lane, (j, i)) in (0..lanes).map(|lane| (lane, (lane / m, lane % m))) {
            let slopes = &self.scheme.derivative[i * (m + 1)..(i + 1) * (m + 1)];
            for c in 0..n {
                let rise: f64 = slopes.iter().enumerate().map(|(k, d)| d * y[j * block + k * n + c]).sum();
                let rate = rise / (self.h(j) * u[self.profile_size()]);
                left[lane * n + c] = rate - rates[(n + c) * lanes + lane];
            }
        }
        left
    }

    /// Copies of a point under a symmetry; see [`ZeroProblem::images`].
    pub(super) fn mirrored(
        &self,
        beside: &[f64],
        point: &Point,
        symmetry: &Symmetry,
        within: f64,
    ) -> Vec<[Vec<f64>; 2]> {
        let Solution::Cycle(cycle) = &point.solution else { return Vec::new() };
        let (whole, scalars) = (cycle.profile.len(), beside.len() - self.profile_size());
        if cycle.degree != self.scheme.degree || point.tangent.len() != whole + scalars {
            return Vec::new();
        }
        let moved = |profile: &[f64]| {
            let mut own = self.passed(profile, &cycle.mesh, &self.mesh);
            symmetry.apply(&mut own);
            own
        };
        let u = [&moved(&cycle.profile)[..], &[1.0], &self.setting.unknowns_of(point)].concat();
        let tangent = [&moved(&point.tangent[..whole])[..], &point.tangent[whole..]].concat();
        let off: Vec<f64> = u.iter().zip(beside).map(|(a, b)| a - b).collect();
        if self.dot(&off, &off) <= within * within { vec![[u, tangent]] } else { Vec::new() }
    }
}

/// A field with its variational equation: x' = f(x, p), y' = f_x y + f_p `change` + g(t), in the states (x, y).
struct Varied<'a> {
    field: &'a dyn VectorField,
    /// `[k]`: the change of all parameters that belongs to y.
    change: Vec<f64>,
    /// g, with which y satisfies the equation at the collocation points.
    remaining: Option<Remaining<'a>>,
}

/// The polynomials on the intervals through [`CycleProblem::remaining`].
struct Remaining<'a> {
    mesh: &'a [f64],
    scheme: &'a Scheme,
    values: Vec<f64>,
}

impl Remaining<'_> {
    /// Adds the polynomials to `f` `[n × lanes]` at given times, from 0 to 1.
    fn add(&self, times: &[f64], f: &mut [f64]) {
        let (m, lanes) = (self.scheme.degree, times.len());
        let (n, nodes) = (f.len() / lanes.max(1), &self.scheme.nodes[1..]);
        for (lane, t) in times.iter().enumerate() {
            let j = self.mesh.partition_point(|end| end <= t).clamp(1, self.mesh.len() - 1) - 1;
            let s = (t - self.mesh[j]) / (self.mesh[j + 1] - self.mesh[j]);
            for (i, own) in nodes.iter().enumerate() {
                let others = nodes.iter().enumerate().filter(|(k, _)| *k != i);
                let weight: f64 = others.map(|(_, other)| (s - other) / (own - other)).product();
                let values = &self.values[(j * m + i) * n..(j * m + i + 1) * n];
                (0..n).for_each(|c| f[c * lanes + lane] += weight * values[c]);
            }
        }
    }
}

impl VectorField for Varied<'_> {
    fn dim(&self) -> usize {
        2 * self.field.dim()
    }

    fn parameter_count(&self) -> usize {
        self.field.parameter_count()
    }

    fn forced(&self) -> bool {
        self.field.forced()
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        let half = self.field.dim() * at.lanes;
        let (x, y) = at.states.split_at(half);
        let (own, varied) = f.split_at_mut(half);
        let batch = Batch { states: x, ..at };
        self.field.evaluate(batch, own);
        let along: Vec<f64> = y.iter().copied().chain(self.change.iter().flat_map(|p| vec![*p; at.lanes])).collect();
        self.field.directional(batch, &[&along], varied);
        if let Some(remaining) = &self.remaining {
            remaining.add(at.times, varied);
        }
    }

    // Only values are asked for.
    fn linearise(&self, _at: Batch, _free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        [f, fx, fp].into_iter().for_each(|values| values.fill(f64::NAN));
    }

    fn directional(&self, _at: Batch, _directions: &[&[f64]], out: &mut [f64]) {
        out.fill(f64::NAN);
    }
}
