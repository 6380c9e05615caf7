//! Conditions on both ends of a chain, in place of periodicity.
//!
//! **Idea.** Elimination leaves one relation between the ends x_0 and x_N of a chain and the scalars σ. A cycle closes
//! it with x_N = κ x_0; here x_0 and x_N stay separate unknowns, and any linear conditions on them close the system.
//!
//! **Equations.** With the relation and the border rows of [`super::chain`], and b conditions on the ends:
//!
//! ```text
//!   (1)  F x_0 + E x_N + g σ = h                 n rows
//!   (2)  L x_0 + R x_N + C σ = c                 b rows, the conditions
//!   (3)  P x_0 + Q x_N + D σ = s                 u of q border rows
//!   (4)  σ_k = 0                                 scalars that are not in use
//! ```
//!
//! The system is square if b + u = n + (number of scalars in use). A condition that is an integral over the chain, such
//! as ∫ g dt = 0, is a border row; there are more of these than scalars in use if b < n, and (4) makes room for them.
//!
//! **Fails when** the system (1)–(4) is singular to working precision.

use super::chain::Chain;
use super::lu;
use crate::contract::Singular;

/// Conditions (2) with the factorised system (1)–(4).
#[derive(Clone, Debug, Default)]
pub struct Ends {
    /// `[b × (2n + q)]`: L, R and C.
    rows: Vec<f64>,
    /// u, and the number of scalars in use, which come first.
    used: usize,
    live: usize,
    matrix: Vec<f64>,
    pivots: Vec<usize>,
    orientation: f64,
}

impl Ends {
    /// Conditions `rows` `[b × (2n + q)]`, with the number of border rows and the number of scalars in use.
    pub fn new(rows: Vec<f64>, used: usize, live: usize) -> Ends {
        Ends { rows, used, live, ..Ends::default() }
    }

    /// Number of conditions, b.
    fn conditions(&self, n: usize, q: usize) -> usize {
        self.rows.len() / (2 * n + q)
    }

    /// Sign of the determinant of the whole system with (1) in the form x_N = G x_0 + …, which does not depend on the
    /// mesh.
    pub fn orientation(&self) -> f64 {
        self.orientation
    }

    /// Factorises (1)–(4) for an eliminated chain; `corner` `[q × q]` is D, the states are in `units` `[n]`, and `sign` is
    /// that of det E.
    ///
    /// # Errors
    /// [`Singular`] if the matrix is.
    pub(super) fn factorise(
        &mut self,
        chain: &Chain<f64>,
        corner: &[f64],
        units: &[f64],
        sign: f64,
        [n, q]: [usize; 2],
    ) -> Result<(), Singular> {
        let (size, full, conditions) = (2 * n + q, 3 * n + q, self.conditions(n, q));
        self.matrix.clear();
        self.matrix.resize(size * size, 0.0);
        self.pivots.resize(size, 0);
        let (relation, rest) = self.matrix.split_at_mut(n * size);
        for (row, line) in relation.chunks_exact_mut(size).zip(chain.relation.chunks_exact(full)) {
            row[..n].copy_from_slice(&line[2 * n..3 * n]);
            row[n..2 * n].copy_from_slice(&line[n..2 * n]);
            row[2 * n..].copy_from_slice(&line[3 * n..]);
        }
        let (ends, rest) = rest.split_at_mut(conditions * size);
        for (row, line) in ends.chunks_exact_mut(size).zip(self.rows.chunks_exact(size)) {
            let in_units = |k: usize| if k < 2 * n { units[k % n] } else { 1.0 };
            row.iter_mut().zip(line).enumerate().for_each(|(k, (to, x))| *to = in_units(k) * x);
        }
        let (border, unused) = rest.split_at_mut(self.used * size);
        for (r, row) in border.chunks_exact_mut(size).enumerate() {
            row[..n].copy_from_slice(&chain.first[r * n..(r + 1) * n]);
            row[n..2 * n].copy_from_slice(&chain.last[r * n..(r + 1) * n]);
            row[2 * n..].copy_from_slice(&corner[r * q..(r + 1) * q]);
        }
        for (k, row) in unused.chunks_exact_mut(size).enumerate() {
            row[2 * n + self.live + k] = 1.0;
        }
        lu::factorise(&mut self.matrix, size, &mut self.pivots)?;
        self.orientation = lu::determinant(&self.matrix, size, &self.pivots).0 * sign;
        Ok(())
    }

    /// Solves (1)–(4) for h `[n]`, s `[q]` and c `[b]`; returns x_0, x_N and σ, `[2n + q]`.
    pub(super) fn solve(&self, relation: &[f64], border: &[f64], conditions: &[f64]) -> Vec<f64> {
        let mut x = [relation, conditions, &border[..self.used]].concat();
        x.resize(self.pivots.len(), 0.0);
        lu::solve(&self.matrix, self.pivots.len(), &self.pivots, &mut x, 1);
        x
    }

    /// Solves the transposed system for the right-hand sides of x_0, x_N and σ, `[2n + q]`; returns the multipliers of
    /// (1), of the q border rows and of (2).
    pub(super) fn solve_transposed(&self, mut z: Vec<f64>, [n, q]: [usize; 2]) -> [Vec<f64>; 3] {
        lu::solve_transposed(&self.matrix, self.pivots.len(), &self.pivots, &mut z);
        let b = self.conditions(n, q);
        let mut border = z[n + b..n + b + self.used].to_vec();
        border.resize(q, 0.0);
        [z[..n].to_vec(), border, z[n..n + b].to_vec()]
    }

    /// Sum of the moduli of the terms of each condition at states of the size `scale` `[n]`.
    pub fn sizes(&self, scale: &[f64]) -> Vec<f64> {
        let n = scale.len();
        let size = |row: &[f64]| row[..2 * n].iter().enumerate().map(|(k, x)| (x * scale[k % n]).abs()).sum();
        self.rows.chunks_exact(self.pivots.len().max(1)).map(size).collect()
    }
}
