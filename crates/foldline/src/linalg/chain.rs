//! A chain of linear relations between neighbours, reduced to one relation between its ends.
//!
//! **Idea.** Inner nodes are eliminated from left to right by orthogonal transformations, which is stable for growing
//! and decaying solutions. Several chains of equal length run side by side, one in each lane.
//!
//! **Equations.** Nodes x_0 … x_L of n components, scalars σ (q):
//!
//! ```text
//!   (1)  F_j x_j + E_j x_{j+1} + g_j σ = h_j            j = 0 … L-1, n rows each
//!   (2)  Σ_j p_j x_j                                    q border rows, j = 0 … L-1
//! ```
//!
//! Eliminating x_1 … x_{L-1} by QR of the stacked 2n×n blocks
//!
//! ```text
//!        x_j    x_{j+1}   x_0   σ                 x_j  x_{j+1}  x_0   σ
//!      [  E        0       F    g  ]      Qᵀ    [  R      S      F'   g' ]
//!      [  F_j     E_j      0    g_j]    ---->   [  0      E      F    g  ]
//! ```
//!
//! leaves E x_L + F x_0 + g σ = h, and (2) in terms of x_0, x_L and σ.
//!
//! **Source.** The structured QR of ascher1995, §7.2.
//!
//! **Fails when** R is singular to working precision.

use super::lane::{Lane, add, dot, subtract};
use super::reflect;
use crate::contract::Singular;

/// Chains side by side, and the result of their elimination.
#[derive(Clone, Debug, Default)]
pub struct Chain<T> {
    n: usize,
    q: usize,
    length: usize,
    /// `[L][n × 2n]`; j = 0 is not used.
    reflectors: Vec<T>,
    /// `[L][n × (3n + q)]`: R, S, F', g'; j = 0 is not used. The diagonal of R is stored inverted.
    upper: Vec<T>,
    /// `[L][q × n]`.
    multipliers: Vec<T>,
    /// `[n × (3n + q)]`: the remaining relation, with columns x_{L-1} (zero), x_L, x_0, σ.
    pub relation: Vec<T>,
    /// `[q × n]`: coefficients of x_0 in (2).
    pub first: Vec<T>,
    /// `[q × n]`: coefficients of x_L in (2).
    pub last: Vec<T>,
    /// `[q × q]`: coefficients of σ that elimination adds to (2).
    pub corner: Vec<T>,
    stack: Vec<T>,
}

/// Source of the relations (1).
pub trait Links<T> {
    /// Writes F_j, E_j, g_j to columns 0, n and 3n of `rows`, `[n × (3n + q)]`, which must be zero.
    fn write(&self, j: usize, rows: &mut [T]);
}

impl<T: Lane> Chain<T> {
    /// Resizes the result for chains of `length` relations; its contents are then undefined.
    pub fn resize(&mut self, n: usize, q: usize, length: usize) {
        (self.n, self.q, self.length) = (n, q, length);
        let full = 3 * n + q;
        self.relation.resize(n * full, T::default());
        self.first.resize(q * n, T::default());
        self.last.resize(q * n, T::default());
        self.corner.resize(q * q, T::default());
        self.stack.resize(2 * n * full, T::default());
    }

    /// Eliminates the inner nodes; `border` `[L][q × n]` holds the p_j.
    ///
    /// # Errors
    /// [`Singular`] if R is.
    #[inline(always)]
    pub fn eliminate(&mut self, links: impl Links<T>, border: &[T]) -> Result<(), Singular> {
        let (n, q, length) = (self.n, self.q, self.length);
        self.reflectors.resize(length * n * 2 * n, T::default());
        self.upper.resize(length * n * (3 * n + q), T::default());
        self.multipliers.resize(length * q * n, T::default());
        // Common sizes as constants.
        match (self.n, self.q) {
            (4, 2) => self.eliminated(links, border, 4, 2),
            (n, q) => self.eliminated(links, border, n, q),
        }
    }

    #[inline(always)]
    fn eliminated(&mut self, links: impl Links<T>, border: &[T], n: usize, q: usize) -> Result<(), Singular> {
        let full = 3 * n + q;
        self.corner.fill(T::default());
        self.first.copy_from_slice(&border[..q * n]);
        self.last.fill(T::default());
        self.stack.fill(T::default());
        links.write(0, &mut self.stack[n * full..]);
        for row in self.stack[n * full..].chunks_exact_mut(full) {
            for c in 0..n {
                row[2 * n + c] = row[c];
                row[c] = T::default();
            }
        }
        for j in 1..self.length {
            add(T::splat(1.0), &border[j * q * n..(j + 1) * q * n], &mut self.last);
            let (top, bottom) = self.stack.split_at_mut(n * full);
            for (row, relation) in top.chunks_exact_mut(full).zip(bottom.chunks_exact(full)) {
                row[..n].copy_from_slice(&relation[n..2 * n]);
                row[n..2 * n].fill(T::default());
                row[2 * n..].copy_from_slice(&relation[2 * n..]);
            }
            bottom.fill(T::default());
            links.write(j, bottom);
            let v = &mut self.reflectors[j * n * 2 * n..(j + 1) * n * 2 * n];
            reflect::triangularise(&mut self.stack, 2 * n, full, n, v);
            let upper = &mut self.upper[j * n * full..(j + 1) * n * full];
            upper.copy_from_slice(&self.stack[..n * full]);
            for i in 0..n {
                let pivot = upper[i * full + i];
                if pivot.lanes().iter().any(|x| x.abs().partial_cmp(&1e-300) != Some(std::cmp::Ordering::Greater)) {
                    return Err(Singular);
                }
                upper[i * full + i] = pivot.map(|x| 1.0 / x);
            }
            self.carry_border(j, n, q);
        }
        self.relation.copy_from_slice(&self.stack[n * full..]);
        Ok(())
    }

    /// Sign of det E of the remaining relation in every lane, if the E_j have positive determinants. Each step contributes
    /// those of Q and R, since det E det E_j = det Q det R det E' there, and every reflection has the determinant -1. The
    /// sign of E itself is lost in rounding where solutions grow by more than 1e16.
    pub fn orientation(&self) -> T {
        let (n, full) = (self.n, 3 * self.n + self.q);
        let pivots = (1..self.length).flat_map(|j| (0..n).map(move |i| self.upper[(j * n + i) * full + i]));
        pivots.fold(T::splat(1.0), |sign, pivot| sign * pivot.map(|x| -x.signum()))
    }

    /// Eliminates x_j from (2) with the rows just made triangular.
    #[inline(always)]
    fn carry_border(&mut self, j: usize, n: usize, q: usize) {
        let full = 3 * n + q;
        let upper = &self.upper[j * n * full..(j + 1) * n * full];
        for c in 0..q {
            let y = &mut self.multipliers[(j * q + c) * n..(j * q + c + 1) * n];
            let current = &mut self.last[c * n..(c + 1) * n];
            y.copy_from_slice(current);
            current.fill(T::default());
            for i in 0..n {
                let line = &upper[i * full..(i + 1) * full];
                y[i] = y[i] * line[i];
                let yi = y[i];
                subtract(yi, &line[i + 1..n], &mut y[i + 1..]);
                subtract(yi, &line[n..2 * n], current);
                subtract(yi, &line[2 * n..3 * n], &mut self.first[c * n..(c + 1) * n]);
                subtract(yi, &line[3 * n..], &mut self.corner[c * q..(c + 1) * q]);
            }
        }
    }

    /// Applies the elimination to right-hand sides h `[L × n]`; the last n are then those of the remaining relation.
    /// Subtracts the contribution to the right-hand sides of (2) from `s` `[q]`. The dimensions are passed again, so
    /// that a caller can make them constants.
    #[inline(always)]
    pub fn forward(&self, h: &mut [T], s: &mut [T], [n, q]: [usize; 2]) {
        for j in 1..self.length {
            let pair = &mut h[(j - 1) * n..(j + 1) * n];
            reflect::apply(&self.reflectors[j * n * 2 * n..(j + 1) * n * 2 * n], n, pair);
            for c in 0..q {
                s[c] = s[c] - dot(&self.multipliers[(j * q + c) * n..(j * q + c + 1) * n], &pair[..n]);
            }
        }
    }

    /// Computes the inner nodes from x_0, x_L and σ: h as left by [`Chain::forward`], replaced by x_1 … x_{L-1} at 0 …
    /// L-2.
    #[inline(always)]
    pub fn backward(&self, h: &mut [T], first: &[T], last: &[T], sigma: &[T], [n, q]: [usize; 2]) {
        let full = 3 * n + q;
        for j in (1..self.length).rev() {
            let upper = &self.upper[j * n * full..(j + 1) * n * full];
            let (head, tail) = h.split_at_mut(j * n);
            let own = &mut head[(j - 1) * n..];
            let right = if j + 1 == self.length { last } else { &tail[..n] };
            for i in (0..n).rev() {
                let line = &upper[i * full..(i + 1) * full];
                let ends = dot(&line[n..2 * n], &right[..n]) + dot(&line[2 * n..3 * n], &first[..n]);
                let known = ends + dot(&line[3 * n..], &sigma[..q]);
                let known = known + dot(&line[i + 1..n], &own[i + 1..]);
                own[i] = (own[i] - known) * line[i];
            }
        }
    }

    /// Solves with the transposed upper triangle: `z` `[L × n]` holds the right-hand sides of x_1 … x_{L-1} at 1 … L-1,
    /// replaced by the solution. Subtracts the contributions to x_0, x_L and σ from `first`, `last` `[n]` and `sigma`
    /// `[q]`.
    #[inline(always)]
    pub fn forward_transposed(&self, z: &mut [T], first: &mut [T], last: &mut [T], sigma: &mut [T]) {
        let (n, full) = (self.n, 3 * self.n + self.q);
        for j in 1..self.length {
            let upper = &self.upper[j * n * full..(j + 1) * n * full];
            let (head, tail) = z.split_at_mut((j + 1) * n);
            let own = &mut head[j * n..];
            let next = if j + 1 == self.length { &mut *last } else { &mut tail[..n] };
            for i in 0..n {
                let line = &upper[i * full..(i + 1) * full];
                own[i] = own[i] * line[i];
                let v = own[i];
                subtract(v, &line[i + 1..n], &mut own[i + 1..]);
                subtract(v, &line[n..2 * n], next);
                subtract(v, &line[2 * n..3 * n], first);
                subtract(v, &line[3 * n..], sigma);
            }
        }
    }

    /// Computes the multipliers of (1), which replace `z` `[L × n]`, from those of the triangular rows (`z` as left by
    /// [`Chain::forward_transposed`]), of the remaining relation (`carry` `[n]`) and of (2) (`border` `[q]`).
    #[inline(always)]
    pub fn backward_transposed(&self, z: &mut [T], carry: &[T], border: &[T]) {
        let (n, q) = (self.n, self.q);
        // Row j of the triangular rows moves to place j - 1, next to its partner.
        z.copy_within(n.., 0);
        z[(self.length - 1) * n..].copy_from_slice(carry);
        for j in (1..self.length).rev() {
            let pair = &mut z[(j - 1) * n..(j + 1) * n];
            for c in 0..q {
                subtract(border[c], &self.multipliers[(j * q + c) * n..(j * q + c + 1) * n], &mut pair[..n]);
            }
            reflect::apply_reversed(&self.reflectors[j * n * 2 * n..(j + 1) * n * 2 * n], n, pair);
        }
    }
}
