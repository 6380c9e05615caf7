//! The system of [`super::condensed`] for fields that are linear except for a few local forces.
//!
//! **Idea.** The Jacobian of a large structure is constant along an orbit except for forces that act on few coordinates
//! and depend on few coordinates. In the modal coordinates of the constant part an interval without such forces
//! separates into one small system for each mode, and the forces enter with low rank. Matrices of the size of an
//! interval are never formed.
//!
//! **Equations.** f_x = J + P c(t) E, J = V Λ V⁻¹, x = V y; r forces and s local coordinates, P `[n × r]`, c `[r × s]`,
//! E `[s × n]`; the equations of an interval are (1)–(4) of [`super::condensed`] with
//!
//! ```text
//!   (1)  A = A_0 - h T (a ⊗ V⁻¹P) φ,   φ = c E V Y,   A_0 = 1 - h T (a ⊗ Λ)        one m×m system per mode
//!   (2)  (1 - c W) φ = c E V A_0⁻¹ r,  W = h T E V A_0⁻¹ (a ⊗ V⁻¹P)                 m r forces
//!   (3)  G = G_0 + U W,                G_0 diagonal in the modes, rank m r
//!   (4)  β_j = p_j + G_jᵀ β_{j+1}      border in terms of x_0
//! ```
//!
//! The product of all G_j relates the ends. Errors are not damped by orthogonal elimination, so their growth is measured
//! as for [`super::compound`].
//!
//! **Source.** Woodbury's identity, higham2002, §13; compactification, ascher1995, §7.2.
//!
//! **Fails when** the eigenvectors of J are nearly dependent, errors grow from one end to the other, or the last matrix is
//! nearly singular; the caller then uses the general system.

pub mod interval;
pub mod modes;

use super::dense::{VECTORS, multiply, signs};
use super::{axpy, dot, lu};
use crate::contract::Singular;
use interval::{Common, Interval, Weights, put, take};
use num_complex::Complex64;

#[cfg(test)]
mod tests;

/// Mean square growth of errors up to which transitions are multiplied, as in [`super::compound`].
const GROWTH: f64 = 1e3;

/// Ratio of the largest to the smallest pivot of the last matrix up to which the solution counts.
const REGULAR: f64 = 1e8;

/// An interval.
#[derive(Clone, Debug)]
pub enum Link {
    /// With low rank.
    Low(Box<Interval>),
    /// Given explicitly: `[m][n × (n + scalars)]` inner nodes and `[n × n]` transition, in modal coordinates.
    Given {
        /// Inner nodes by the left end and the first scalars.
        inner: Vec<f64>,
        /// Transition.
        transition: Vec<f64>,
    },
}

/// The system and its factorisation.
#[derive(Clone, Debug)]
pub struct LocalSystem {
    common: Common,
    integration: Vec<f64>,
    end: Vec<f64>,
    n: usize,
    m: usize,
    q: usize,
    links: Vec<Link>,
    /// `[q][N][m n]`: A⁻¹ C, and `[q][N][n]` its part g of the link.
    solved: Vec<f64>,
    g: Vec<f64>,
    /// `[q][N][(m + 1) n]`: border in modal coordinates; `[N + 1][q][n]`: β.
    border: Vec<f64>,
    beta: Vec<f64>,
    /// Product of all transitions.
    product: Vec<f64>,
    closure: f64,
    last: Vec<f64>,
    pivots: Vec<usize>,
    /// `[n × n]`: Vᵀ and V⁻ᵀ.
    turned: [Vec<f64>; 2],
}

/// Parts of a system to be condensed. All vectors are in the components of the model.
pub struct Parts<'a> {
    /// Modes and local forces.
    pub common: Common,
    /// Weights of collocation.
    pub scheme: Weights<'a>,
    /// Every interval.
    pub links: Vec<Link>,
    /// `[q][N][m][n]`: columns C of the scalars.
    pub columns: Vec<f64>,
    /// `[q][N][(m + 1) n]`: border.
    pub border: Vec<f64>,
    /// `[q × q]`: D.
    pub corner: Vec<f64>,
    /// κ.
    pub closure: f64,
}

impl LocalSystem {
    /// Condenses and eliminates.
    ///
    /// # Errors
    /// [`Singular`] if the last matrix is nearly singular or errors grow.
    pub fn new(parts: Parts) -> Result<LocalSystem, Singular> {
        let Parts { common, scheme, links, mut columns, mut border, corner, closure } = parts;
        let (m, n) = (scheme.end.len() - 1, common.modes.from.len().isqrt());
        let (q, count) = (corner.len().isqrt(), links.len());
        let transposed = |a: &[f64]| -> Vec<f64> { (0..n * n).map(|k| a[k % n * n + k / n]).collect() };
        let turned = [transposed(&common.modes.from), transposed(&common.modes.to)];
        // Rows are vectors: (V⁻¹ x)ᵀ = xᵀ V⁻ᵀ, and (Vᵀ p)ᵀ = pᵀ V.
        columns = changed(&columns, &turned[1], n);
        border = changed(&border, &common.modes.from, n);
        let mut system = LocalSystem {
            integration: scheme.integration.to_vec(),
            end: scheme.end.to_vec(),
            common,
            n,
            m,
            q,
            links,
            solved: columns,
            g: vec![0.0; q * count * n],
            border,
            beta: vec![0.0; (count + 1) * q * n],
            product: vec![0.0; n * n],
            closure,
            last: vec![0.0; (n + q) * (n + q)],
            pivots: vec![0; n + q],
            turned,
        };
        system.condense(&corner)?;
        Ok(system)
    }

    fn weights(&self) -> Weights<'_> {
        Weights { integration: &self.integration, end: &self.end }
    }

    fn block(&self) -> usize {
        (self.m + 1) * self.n
    }

    /// Modes and local forces.
    pub fn common(&self) -> &Common {
        &self.common
    }

    /// Every interval.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Product of all transitions, `[n × n]`, in modal coordinates.
    pub fn product(&self) -> &[f64] {
        &self.product
    }

    /// log |det| of the product of all transitions; NaN if an interval is given explicitly.
    pub fn log_determinant(&self) -> f64 {
        let own = |link: &Link| match link {
            Link::Low(own) => own.log_determinant(&self.common),
            Link::Given { transition, .. } => {
                let (mut a, mut pivots) = (transition.clone(), vec![0; self.n]);
                match lu::factorise(&mut a, self.n, &mut pivots) {
                    Ok(()) => (0..self.n).map(|i| a[i * (self.n + 1)].abs().ln()).sum(),
                    Err(Singular) => f64::NEG_INFINITY,
                }
            }
        };
        self.links.iter().map(own).sum()
    }

    /// Solves with the matrix of interval j, `[m][n]` in place.
    fn solve_inner(&self, j: usize, x: &mut [f64], transposed: bool) {
        let Link::Low(own) = &self.links[j] else { return };
        let mut z = self.folded(x);
        match transposed {
            true => own.solve_transposed(&self.common, self.weights(), &mut z),
            false => own.solve(&self.common, self.weights(), &mut z),
        }
        self.unfold(&z, x);
    }

    /// `[modes][m]` from `[m][n]`.
    fn folded(&self, x: &[f64]) -> Vec<Complex64> {
        let (n, m) = (self.n, self.m);
        let modes = self.common.modes.list.iter();
        modes.flat_map(|mode| (0..m).map(|i| take(&x[i * n..], mode.at, mode.size))).collect()
    }

    fn unfold(&self, z: &[Complex64], x: &mut [f64]) {
        let (n, m) = (self.n, self.m);
        for (mode, z) in self.common.modes.list.iter().zip(z.chunks_exact(m)) {
            (0..m).for_each(|i| put(&mut x[i * n..], mode.at, mode.size, z[i]));
        }
    }

    /// Adds what the left end contributes to the inner nodes of interval j.
    fn add_inside(&self, j: usize, y: &[f64], to: &mut [f64]) {
        let n = self.n;
        match &self.links[j] {
            Link::Low(own) => {
                let mut z = vec![Complex64::ZERO; self.common.modes.list.len() * self.m];
                own.inside(&self.common, self.weights(), y, &mut z);
                let mut inner = vec![0.0; self.m * n];
                self.unfold(&z, &mut inner);
                axpy(1.0, &inner, to);
            }
            Link::Given { inner, .. } => {
                let width = inner.len() / (self.m * n);
                for (to, row) in to.iter_mut().zip(inner.chunks_exact(width)) {
                    *to += dot(&row[..n], y);
                }
            }
        }
    }

    /// Adds the transpose of [`LocalSystem::add_inside`], where `w` has been solved with the transposed matrix.
    fn add_inside_transposed(&self, j: usize, w: &[f64], to: &mut [f64]) {
        let n = self.n;
        match &self.links[j] {
            Link::Low(_) => w.chunks_exact(n).for_each(|own| axpy(1.0, own, to)),
            Link::Given { inner, .. } => {
                let width = inner.len() / (self.m * n);
                w.iter().zip(inner.chunks_exact(width)).for_each(|(w, row)| axpy(*w, &row[..n], to));
            }
        }
    }

    /// x = G_j x, row-major `[n × columns]`.
    fn carry(&self, j: usize, x: &mut Vec<f64>, columns: usize) {
        carry(&self.common, &self.links[j], x, columns);
    }

    /// x = G_jᵀ x.
    fn carry_back(&self, j: usize, x: &mut Vec<f64>) {
        match &self.links[j] {
            Link::Low(own) => own.carry_back(&self.common, x),
            Link::Given { transition, .. } => {
                let mut to = vec![0.0; self.n];
                x.iter().zip(transition.chunks_exact(self.n)).for_each(|(x, row)| axpy(*x, row, &mut to));
                *x = to;
            }
        }
    }

    /// Adds Σ e_k X_k.
    fn add_end(&self, inner: &[f64], to: &mut [f64], sign: f64) {
        inner.chunks_exact(self.n).zip(&self.end[1..]).for_each(|(x, e)| axpy(sign * e, x, to));
    }

    fn condense(&mut self, corner: &[f64]) -> Result<(), Singular> {
        let (n, m, q, count, block) = (self.n, self.m, self.q, self.links.len(), self.block());
        let mut total = corner.to_vec();
        for c in 0..q {
            for j in 0..count {
                let at = (c * count + j) * m * n;
                let mut own = self.solved[at..at + m * n].to_vec();
                match &self.links[j] {
                    Link::Low(_) => self.solve_inner(j, &mut own, false),
                    Link::Given { inner, .. } => {
                        let width = inner.len() / (m * n);
                        let column = |row: &[f64]| if n + c < width { -row[n + c] } else { 0.0 };
                        own.iter_mut().zip(inner.chunks_exact(width)).for_each(|(x, row)| *x = column(row));
                    }
                }
                self.solved[at..at + m * n].copy_from_slice(&own);
                let mut g = vec![0.0; n];
                self.add_end(&own, &mut g, -1.0);
                self.g[(c * count + j) * n..(c * count + j + 1) * n].copy_from_slice(&g);
            }
        }
        // Border in terms of the left ends, then of x_0.
        for c in 0..q {
            let mut beta = vec![0.0; n];
            for j in (0..count).rev() {
                let row = &self.border[(c * count + j) * block..(c * count + j + 1) * block];
                for d in 0..q {
                    let solved = &self.solved[(d * count + j) * m * n..(d * count + j + 1) * m * n];
                    let g = &self.g[(d * count + j) * n..(d * count + j + 1) * n];
                    total[c * q + d] += dot(&beta, g) - dot(&row[n..], solved);
                }
                let mut w = row[n..].to_vec();
                let mut own = row[..n].to_vec();
                self.solve_inner(j, &mut w, true);
                self.add_inside_transposed(j, &w, &mut own);
                self.carry_back(j, &mut beta);
                axpy(1.0, &own, &mut beta);
                self.beta[(j * q + c) * n..(j * q + c + 1) * n].copy_from_slice(&beta);
            }
        }
        if !self.multiplied() {
            return Err(Singular);
        }
        let width = n + q;
        let mut sums = vec![0.0; n * q];
        for j in 0..count {
            self.carry(j, &mut sums, q);
            (0..n * q).for_each(|k| sums[k] += self.g[(k % q * count + j) * n + k / q]);
        }
        for i in 0..n {
            for k in 0..n {
                let unit = if i == k { self.closure } else { 0.0 };
                self.last[i * width + k] = unit - self.product[i * n + k];
            }
            (0..q).for_each(|c| self.last[i * width + n + c] = -sums[i * q + c]);
        }
        for c in 0..q {
            let row = (n + c) * width;
            self.last[row..row + n].copy_from_slice(&self.beta[c * n..(c + 1) * n]);
            self.last[row + n..row + width].copy_from_slice(&total[c * q..(c + 1) * q]);
        }
        lu::factorise_even(&mut self.last, width, &mut self.pivots)?;
        let pivots = self.last.iter().step_by(width + 1).map(|pivot| pivot.abs());
        let [least, most] = pivots.fold([f64::INFINITY, 0.0], |[least, most], x| [x.min(least), x.max(most)]);
        if most <= REGULAR * least { Ok(()) } else { Err(Singular) }
    }

    /// Multiplies all transitions; false if errors may grow too much.
    fn multiplied(&mut self) -> bool {
        let n = self.n;
        let (mut sign, width) = (signs(), n + VECTORS);
        // The product and errors that accumulate beside it.
        let mut x = vec![0.0; n * width];
        (0..n).for_each(|i| x[i * width + i] = 1.0);
        for j in 0..self.links.len() {
            self.carry(j, &mut x, width);
            let mut most = 0.0f64;
            for row in x.chunks_exact_mut(width) {
                let errors = &mut row[n..];
                errors.iter_mut().for_each(|e| *e += sign());
                most = super::larger(most, errors.iter().map(|e| e * e).sum::<f64>() / VECTORS as f64);
            }
            if most.is_nan() || most > GROWTH * (j + 1) as f64 {
                return false;
            }
        }
        for (to, row) in self.product.chunks_exact_mut(n).zip(x.chunks_exact(width)) {
            to.copy_from_slice(&row[..n]);
        }
        true
    }

    /// See [`super::condensed::Condensed::solve`].
    pub fn solve(&self, rhs: &[f64], x: &mut [f64]) {
        let (n, q, count, block) = (self.n, self.q, self.links.len(), self.block());
        let size = count * block;
        let mut z = changed(&rhs[..size], &self.turned[1], n);
        let mut tail = vec![0.0; n + q];
        tail[n..].copy_from_slice(&rhs[size..size + q]);
        let mut b = vec![0.0; n];
        for (j, own) in z.chunks_exact_mut(block).enumerate() {
            let (end, inside) = own.split_at_mut(n);
            self.solve_inner(j, inside, false);
            self.add_end(inside, end, 1.0);
            self.carry(j, &mut b, 1);
            axpy(1.0, end, &mut b);
            for c in 0..q {
                let row = &self.border[(c * count + j) * block + n..(c * count + j + 1) * block];
                tail[n + c] -= dot(row, inside) + dot(&self.beta[((j + 1) * q + c) * n..][..n], end);
            }
        }
        tail[..n].copy_from_slice(&b);
        lu::solve(&self.last, n + q, &self.pivots, &mut tail, 1);
        let (first, sigma) = tail.split_at(n);
        let mut y = first.to_vec();
        for (j, own) in z.chunks_exact_mut(block).enumerate() {
            let (end, inside) = own.split_at_mut(n);
            self.add_inside(j, &y, inside);
            for (c, sigma) in sigma.iter().enumerate() {
                axpy(-sigma, &self.solved[(c * count + j) * self.m * n..][..self.m * n], inside);
                axpy(*sigma, &self.g[(c * count + j) * n..][..n], end);
            }
            let left = y.clone();
            self.carry(j, &mut y, 1);
            axpy(1.0, end, &mut y);
            end.copy_from_slice(&left);
        }
        x[..size].copy_from_slice(&changed(&z, &self.turned[0], n));
        x[size..size + q].copy_from_slice(sigma);
    }
}

/// x = G x, row-major `[n × columns]`.
pub fn carry(common: &Common, link: &Link, x: &mut Vec<f64>, columns: usize) {
    match link {
        Link::Low(own) => own.carry(common, x, columns),
        Link::Given { transition, .. } => {
            let n = x.len() / columns;
            let mut to = vec![0.0; n * columns];
            multiply((&mut to, columns), (transition, n), (x, columns), [n, n, columns]);
            *x = to;
        }
    }
}

/// Rows of `x` `[rows × n]` times `by` `[n × n]`.
pub fn changed(x: &[f64], by: &[f64], n: usize) -> Vec<f64> {
    let mut to = vec![0.0; x.len()];
    multiply((&mut to, n), (x, n), (by, n), [x.len() / n, n, n]);
    to
}
