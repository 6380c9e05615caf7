//! Linear relations between neighbours on a closed chain, with a border.
//!
//! **Idea.** The nodes of the chain are eliminated one after the other by orthogonal transformations of two
//! neighbouring relations. That is stable for growing and decaying solutions alike, so that the product of the matrices
//! is never formed.
//!
//! **Equations.** Nodes x_0 … x_{N-1} of n components and scalars σ (q):
//!
//! ```text
//!   (1)  A_k x_k - x_{k+1} + g_k σ = h_k        k = 0 … N-2
//!   (2)  A_k x_k - K x_0   + g_k σ = h_k        k = N-1
//!   (3)  Σ_k p_k x_k + D σ = s                  q rows
//! ```
//!
//! Elimination of x_j, j = 1 … N-1, with the relation left by the previous step (E, F, g) and relation j:
//!
//! ```text
//!        x_j    x_{j+1}   x_0   σ                 x_j  x_{j+1}  x_0   σ
//!      [  E        0       F    g  ]      Qᵀ    [  R      S      F'   g' ]
//!      [  A_j     -1       0    g_j]    ---->   [  0      E      F    g  ]
//! ```
//!
//! leaves n relations for x_0 and σ, and (3) in terms of these.
//!
//! **Source.** ascher1995, §7.2 (structured QR).
//!
//! **Fails when** R or the last matrix is singular to working precision.

use super::lu;
use crate::contract::Singular;

/// Parts of a system.
#[derive(Clone, Copy, Debug)]
pub struct Parts<'a> {
    /// n and q.
    pub shape: [usize; 2],
    /// `[N][n × n]` A_k.
    pub blocks: &'a [f64],
    /// `[n × n]` K.
    pub closure: &'a [f64],
    /// `[N][n × q]` g_k.
    pub columns: &'a [f64],
    /// `[q][N·n + q]` rows of (3).
    pub border: &'a [f64],
}

/// One elimination.
#[derive(Clone, Debug)]
struct Step {
    /// `[2n × 2n]` Qᵀ.
    turn: Vec<f64>,
    /// `[n × (3n + q)]` R, S, F', g'.
    upper: Vec<f64>,
    /// `[q × n]` multiples of the upper rows that were subtracted from the border.
    multipliers: Vec<f64>,
}

/// A factorised system.
#[derive(Clone, Debug, Default)]
pub struct Cyclic {
    n: usize,
    q: usize,
    steps: Vec<Step>,
    /// `[(n + q)²]` factors of the matrix for x_0 and σ.
    last: Vec<f64>,
    pivots: Vec<usize>,
}

impl Cyclic {
    /// Factorises a system.
    ///
    /// # Errors
    /// [`Singular`] if it is singular to working precision.
    pub fn new(parts: Parts) -> Result<Cyclic, Singular> {
        let [n, q] = parts.shape;
        let count = parts.blocks.len() / (n * n).max(1);
        let (width, full) = (count * n + q, 3 * n + q);
        if n == 0 || count == 0 {
            return Err(Singular);
        }
        // Border rows, in x_1 … x_{N-1}, and in x_0 and σ.
        let mut border = parts.border.to_vec();
        let mut steps = Vec::with_capacity(count - 1);
        let mut rest = vec![0.0; n * full];
        for i in 0..n {
            let row = &mut rest[i * full..(i + 1) * full];
            row[2 * n..3 * n].copy_from_slice(&parts.blocks[i * n..(i + 1) * n]);
            row[3 * n..].copy_from_slice(&parts.columns[i * q..(i + 1) * q]);
            if count == 1 {
                (0..n).for_each(|c| row[2 * n + c] -= parts.closure[i * n + c]);
            } else {
                row[i] = -1.0;
            }
        }
        for j in 1..count {
            let mut stack = vec![0.0; 2 * n * full];
            stack[..n * full].copy_from_slice(&rest);
            for i in 0..n {
                let row = &mut stack[(n + i) * full..(n + i + 1) * full];
                row[..n].copy_from_slice(&parts.blocks[(j * n + i) * n..(j * n + i + 1) * n]);
                row[3 * n..].copy_from_slice(&parts.columns[(j * n + i) * q..(j * n + i + 1) * q]);
                if j + 1 < count {
                    row[n + i] = -1.0;
                } else {
                    (0..n).for_each(|c| row[2 * n + c] = -parts.closure[i * n + c]);
                }
            }
            let turn = triangularised(&mut stack, 2 * n, full, n);
            let upper = stack[..n * full].to_vec();
            let usable = |i: usize| upper[i * full + i].abs() > 1e-300;
            if !(0..n).all(usable) {
                return Err(Singular);
            }
            let multipliers = eliminated(&mut border, &upper, [n, q, j, count, width]);
            for i in 0..n {
                let (from, to) = (&stack[(n + i) * full..(n + i + 1) * full], &mut rest[i * full..(i + 1) * full]);
                to[..n].copy_from_slice(&from[n..2 * n]);
                to[n..2 * n].fill(0.0);
                to[2 * n..].copy_from_slice(&from[2 * n..]);
            }
            steps.push(Step { turn, upper, multipliers });
        }
        let size = n + q;
        let mut last = vec![0.0; size * size];
        for i in 0..n {
            last[i * size..(i + 1) * size].copy_from_slice(&rest[i * full + 2 * n..(i + 1) * full]);
        }
        for i in 0..q {
            let own = &border[i * width..(i + 1) * width];
            last[(n + i) * size..(n + i) * size + n].copy_from_slice(&own[..n]);
            last[(n + i) * size + n..(n + i + 1) * size].copy_from_slice(&own[count * n..]);
        }
        let mut pivots = vec![0; size];
        lu::factorise(&mut last, size, &mut pivots)?;
        Ok(Cyclic { n, q, steps, last, pivots })
    }

    /// Solves for (x_0 … x_{N-1}, σ), given (h_0 … h_{N-1}, s).
    pub fn solve(&self, rhs: &[f64]) -> Vec<f64> {
        let (n, q, full) = (self.n, self.q, 3 * self.n + self.q);
        let count = self.steps.len() + 1;
        let mut tops = Vec::with_capacity(count * n);
        let mut rest = rhs[..n].to_vec();
        let mut scalars = rhs[count * n..].to_vec();
        for (j, step) in (1..).zip(&self.steps) {
            let stack = [&rest, &rhs[j * n..(j + 1) * n]].concat();
            let turned: Vec<f64> = step.turn.chunks_exact(2 * n).map(|row| product(row, &stack)).collect();
            (0..q).for_each(|i| scalars[i] -= product(&step.multipliers[i * n..(i + 1) * n], &turned[..n]));
            tops.extend_from_slice(&turned[..n]);
            rest.copy_from_slice(&turned[n..]);
        }
        let mut end = [rest, scalars].concat();
        lu::solve(&self.last, n + q, &self.pivots, &mut end, 1);
        let mut x = vec![0.0; count * n + q];
        x[..n].copy_from_slice(&end[..n]);
        x[count * n..].copy_from_slice(&end[n..]);
        for (j, step) in (1..count).zip(&self.steps).rev() {
            for i in (0..n).rev() {
                let row = &step.upper[i * full..(i + 1) * full];
                let mut value = tops[(j - 1) * n + i] - product(&row[2 * n..], &end);
                if j + 1 < count {
                    value -= product(&row[n..2 * n], &x[(j + 1) * n..(j + 2) * n]);
                }
                value -= product(&row[i + 1..n], &x[j * n + i + 1..(j + 1) * n]);
                x[j * n + i] = value / row[i];
            }
        }
        x
    }

    /// Solves with the transposed matrix: `z` has the layout of the unknowns, and the result that of the rows.
    pub fn solve_transposed(&self, z: &[f64]) -> Vec<f64> {
        let (n, q, full) = (self.n, self.q, 3 * self.n + self.q);
        let count = self.steps.len() + 1;
        let mut tops = vec![0.0; self.steps.len() * n];
        let mut end = [&z[..n], &z[count * n..]].concat();
        for (j, step) in (1..).zip(&self.steps) {
            for i in 0..n {
                let mut value = z[j * n + i];
                if j > 1 {
                    let before = &self.steps[j - 2].upper;
                    value -= (0..n).map(|k| before[k * full + n + i] * tops[(j - 2) * n + k]).sum::<f64>();
                }
                value -= (0..i).map(|k| step.upper[k * full + i] * tops[(j - 1) * n + k]).sum::<f64>();
                tops[(j - 1) * n + i] = value / step.upper[i * full + i];
            }
            for k in 0..n {
                let top = tops[(j - 1) * n + k];
                let row = &step.upper[k * full + 2 * n..(k + 1) * full];
                end.iter_mut().zip(row).for_each(|(end, u)| *end -= u * top);
            }
        }
        lu::solve_transposed(&self.last, n + q, &self.pivots, &mut end);
        let mut y = vec![0.0; count * n + q];
        y[count * n..].copy_from_slice(&end[n..]);
        let mut rest = end[..n].to_vec();
        for (j, step) in (1..count).zip(&self.steps).rev() {
            let mut both = tops[(j - 1) * n..j * n].to_vec();
            for i in 0..q {
                (0..n).for_each(|k| both[k] -= step.multipliers[i * n + k] * end[n + i]);
            }
            both.extend_from_slice(&rest);
            let back: Vec<f64> =
                (0..2 * n).map(|c| (0..2 * n).map(|r| step.turn[r * 2 * n + c] * both[r]).sum()).collect();
            y[j * n..(j + 1) * n].copy_from_slice(&back[n..]);
            rest.copy_from_slice(&back[..n]);
        }
        y[..n].copy_from_slice(&rest);
        y
    }
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Subtracts multiples of the upper rows of step j from the border rows, so that x_j disappears from these.
fn eliminated(border: &mut [f64], upper: &[f64], [n, q, j, count, width]: [usize; 5]) -> Vec<f64> {
    let full = 3 * n + q;
    let mut multipliers = vec![0.0; q * n];
    for (own, multiples) in border.chunks_exact_mut(width.max(1)).zip(multipliers.chunks_exact_mut(n)) {
        for i in 0..n {
            let sum: f64 = (0..i).map(|k| multiples[k] * upper[k * full + i]).sum();
            multiples[i] = (own[j * n + i] - sum) / upper[i * full + i];
        }
        for (k, multiple) in multiples.iter().enumerate() {
            let row = &upper[k * full..(k + 1) * full];
            for c in 0..n {
                own[c] -= multiple * row[2 * n + c];
                if j + 1 < count {
                    own[(j + 1) * n + c] -= multiple * row[n + c];
                }
            }
            (0..q).for_each(|c| own[count * n + c] -= multiple * row[3 * n + c]);
        }
    }
    multipliers
}

/// Makes the first `columns` columns of a matrix `[rows × width]` upper triangular by reflections; returns their
/// product Qᵀ `[rows × rows]`.
fn triangularised(matrix: &mut [f64], rows: usize, width: usize, columns: usize) -> Vec<f64> {
    let mut turn = vec![0.0; rows * rows];
    (0..rows).for_each(|i| turn[i * rows + i] = 1.0);
    for c in 0..columns {
        let mut v: Vec<f64> = (c..rows).map(|i| matrix[i * width + c]).collect();
        let norm = product(&v, &v).sqrt();
        if norm == 0.0 {
            continue;
        }
        v[0] += norm.copysign(v[0]);
        let scale = 2.0 / product(&v, &v);
        for (target, stride) in [(&mut *matrix, width), (&mut turn[..], rows)] {
            for column in 0..stride {
                let along: f64 = scale * (c..rows).map(|i| v[i - c] * target[i * stride + column]).sum::<f64>();
                (c..rows).for_each(|i| target[i * stride + column] -= along * v[i - c]);
            }
        }
        (c + 1..rows).for_each(|i| matrix[i * width + c] = 0.0);
    }
    turn
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with the dense matrix for chains of several lengths.
    #[test]
    fn both_solutions_agree_with_the_dense_matrix() {
        let number = |k: usize| ((k * k) as f64 * 0.37 + 0.3).sin();
        for (n, q, count) in [(1, 1, 1), (2, 2, 1), (1, 2, 2), (2, 1, 5), (3, 2, 9), (2, 0, 4)] {
            let size = count * n + q;
            let blocks: Vec<f64> = (0..count * n * n).map(|k| 3.0 * number(k)).collect();
            let closure: Vec<f64> = (0..n * n).map(|k| number(k + 77)).collect();
            let columns: Vec<f64> = (0..count * n * q).map(|k| number(k + 5)).collect();
            let border: Vec<f64> = (0..q * size).map(|k| number(k + 11)).collect();
            let mut dense = vec![0.0; size * size];
            for k in 0..count {
                for i in 0..n {
                    for c in 0..n {
                        dense[(k * n + i) * size + k * n + c] += blocks[(k * n + i) * n + c];
                        let next = if i == c { 1.0 } else { 0.0 };
                        match k + 1 < count {
                            true => dense[(k * n + i) * size + (k + 1) * n + c] -= next,
                            false => dense[(k * n + i) * size + c] -= closure[i * n + c],
                        }
                    }
                    (0..q).for_each(|c| dense[(k * n + i) * size + count * n + c] = columns[(k * n + i) * q + c]);
                }
            }
            dense[count * n * size..].copy_from_slice(&border);
            let system = Cyclic::new(Parts {
                shape: [n, q],
                blocks: &blocks,
                closure: &closure,
                columns: &columns,
                border: &border,
            })
            .unwrap();
            let x: Vec<f64> = (0..size).map(|k| number(k + 3)).collect();
            let rhs: Vec<f64> = dense.chunks_exact(size).map(|row| product(row, &x)).collect();
            let back: Vec<f64> = (0..size).map(|c| (0..size).map(|r| dense[r * size + c] * x[r]).sum()).collect();
            for (name, found) in [("direct", system.solve(&rhs)), ("transposed", system.solve_transposed(&back))] {
                let off = found.iter().zip(&x).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
                assert!(off < 1e-10, "{name} {n} {q} {count}: {off:e}");
            }
        }
    }

    #[test]
    fn growth_along_a_long_chain_does_no_harm() {
        // x_{k+1} = ±4 x_k around a cycle of 2000: the product of the factors is beyond the range of f64.
        let count = 2000;
        let blocks: Vec<f64> = (0..count).map(|k| if k % 3 == 0 { -4.0 } else { 4.0 }).collect();
        let columns = vec![0.0; 0];
        let system =
            Cyclic::new(Parts { shape: [1, 0], blocks: &blocks, closure: &[1.0], columns: &columns, border: &[] })
                .unwrap();
        let x: Vec<f64> = (0..count).map(|k| (k as f64 * 1.7).sin()).collect();
        let rhs: Vec<f64> = (0..count).map(|k| blocks[k] * x[k] - x[(k + 1) % count]).collect();
        let off = system.solve(&rhs).iter().zip(&x).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(off < 1e-13, "{off:e}");
    }
}
