//! The linear system of collocation: condensed per interval, then eliminated block by block with the border outside.
//!
//! **Idea.** On every interval the m·n interior unknowns depend only on the left end x_j and on a few scalars σ that are
//! common to all intervals (period, parameters). Condensing them leaves a recurrence between interval ends, which is
//! eliminated from left to right by orthogonal transformations, so that growing and decaying solutions are both safe.
//!
//! **Equations.** N intervals; unknowns x_j (n), X_j (m·n), σ (q):
//!
//! ```text
//!   (1)  A_j X_j + B_j x_j + C_j σ = r_j                     interior,   m·n rows per interval
//!   (2)  x_{j+1} - e_0 x_j - Σ_k e_k X_{j,k} = c_j           continuity, n rows per interval
//!   (3)  x_N = κ x_0                                         closure: κ = 1 periodic, κ = -1 antiperiodic
//!   (4)  Σ_j ⟨p_j, (x_j, X_j)⟩ + D σ = s                     border,     q rows
//! ```
//!
//! Condensed: x_{j+1} = G_j x_j + g_j σ + h_j. Eliminating x_1 … x_{N-1} by QR of the stacked 2n×n blocks
//!
//! ```text
//!        x_j    x_{j+1}   x_0   σ                 x_j  x_{j+1}  x_0   σ
//!      [  E        0       F    g  ]      Qᵀ    [  R      S      F'   g' ]
//!      [ -G_j      1       0   -g_j ]    ---->  [  0      E      F    g  ]
//! ```
//!
//! leaves n + q equations in (x_0, σ).
//!
//! **Source.** Condensation of parameters as in ascher1995, §7; the orthogonal elimination is the structured QR of
//! ascher1995, §7.2.
//!
//! **Fails when** an interior block or the final matrix is singular to working precision.

use super::{axpy, dot, lu, reflect};
use crate::contract::Singular;

/// The system, its factorisation and room for both.
#[derive(Clone, Debug, Default)]
pub struct Condensed {
    n: usize,
    m: usize,
    q: usize,
    intervals: usize,
    closure: f64,
    end: Vec<f64>,
    /// `[N][m·n × m·n]`: A_j, factorised in place.
    pub interior: Vec<f64>,
    /// `[N][m·n × (n + q)]`: (B_j, C_j), overwritten by A_j⁻¹(B_j, C_j).
    pub coupling: Vec<f64>,
    /// `[q][N · (m + 1) · n]`: border rows in the layout of the unknowns.
    pub border: Vec<f64>,
    /// `[q × q]`: D.
    pub corner: Vec<f64>,
    pivots: Vec<usize>,
    step: Vec<f64>,
    condensed_border: Vec<f64>,
    reflectors: Vec<f64>,
    upper: Vec<f64>,
    multipliers: Vec<f64>,
    last: Vec<f64>,
    last_pivots: Vec<usize>,
    stack: Vec<f64>,
}

impl Condensed {
    /// A system for dimension n, interval weights `end` (m + 1 of them), q scalars.
    pub fn new(n: usize, end: &[f64], q: usize) -> Condensed {
        Condensed { n, m: end.len() - 1, q, closure: 1.0, end: end.to_vec(), ..Condensed::default() }
    }

    /// Makes room for that many intervals; the contents are then undefined.
    pub fn resize(&mut self, intervals: usize) {
        let (n, q, inner) = (self.n, self.q, self.m * self.n);
        self.intervals = intervals;
        self.interior.resize(intervals * inner * inner, 0.0);
        self.coupling.resize(intervals * inner * (n + q), 0.0);
        self.border.resize(q * intervals * (inner + n), 0.0);
        self.corner.resize(q * q, 0.0);
        self.pivots.resize(intervals * inner, 0);
        self.step.resize(intervals * n * (n + q), 0.0);
        self.condensed_border.resize(intervals * q * n, 0.0);
        self.reflectors.resize(intervals * n * 2 * n, 0.0);
        self.upper.resize(intervals * n * (3 * n + q), 0.0);
        self.multipliers.resize(intervals * q * n, 0.0);
        self.last.resize((n + q) * (n + q), 0.0);
        self.last_pivots.resize(n + q, 0);
        self.stack.resize(2 * n * (3 * n + q), 0.0);
    }

    /// G_j and g_j side by side, `[n × (n + q)]`: how the right end of interval j follows from its left end and σ.
    pub fn transition(&self, j: usize) -> &[f64] {
        let size = self.n * (self.n + self.q);
        &self.step[j * size..(j + 1) * size]
    }

    /// Condenses every interval: `interior`, `coupling` and `border` must be filled.
    ///
    /// # Errors
    /// [`Singular`] if an interior block is.
    pub fn condense(&mut self) -> Result<(), Singular> {
        let (n, m, q, inner) = (self.n, self.m, self.q, self.m * self.n);
        let width = n + q;
        for j in 0..self.intervals {
            let a = &mut self.interior[j * inner * inner..(j + 1) * inner * inner];
            let pivots = &mut self.pivots[j * inner..(j + 1) * inner];
            lu::factorise(a, inner, pivots)?;
            let w = &mut self.coupling[j * inner * width..(j + 1) * inner * width];
            lu::solve(a, inner, pivots, w, width);
            let step = &mut self.step[j * n * width..(j + 1) * n * width];
            step.fill(0.0);
            for i in 0..n {
                step[i * width + i] = self.end[0];
                for k in 0..m {
                    axpy(
                        -self.end[k + 1],
                        &w[(k * n + i) * width..(k * n + i + 1) * width],
                        &mut step[i * width..(i + 1) * width],
                    );
                }
            }
        }
        Ok(())
    }

    /// Eliminates the interval ends after [`Condensed::condense`]; `closure` is κ of (3).
    ///
    /// # Errors
    /// [`Singular`] if the remaining matrix is.
    pub fn eliminate(&mut self, closure: f64) -> Result<(), Singular> {
        let (n, q, inner) = (self.n, self.q, self.m * self.n);
        let (width, full, count) = (n + q, 3 * n + q, self.intervals);
        self.closure = closure;
        let mut corner = self.corner.clone();
        for j in 0..count {
            let w = &self.coupling[j * inner * width..(j + 1) * inner * width];
            for c in 0..q {
                let row = &self.border[(c * count + j) * (inner + n)..(c * count + j + 1) * (inner + n)];
                let p = &mut self.condensed_border[(j * q + c) * n..(j * q + c + 1) * n];
                p.copy_from_slice(&row[..n]);
                for (weight, line) in row[n..].iter().zip(w.chunks_exact(width)) {
                    if *weight != 0.0 {
                        axpy(-weight, &line[..n], p);
                        axpy(-weight, &line[n..], &mut corner[c * q..(c + 1) * q]);
                    }
                }
            }
        }
        // Relation E x_j + F x_0 + g σ = h, begun with x_1 - G_0 x_0 - g_0 σ = h_0.
        let mut relation = vec![0.0; n * (2 * n + q)];
        for i in 0..n {
            let line = &mut relation[i * (2 * n + q)..(i + 1) * (2 * n + q)];
            line[i] = 1.0;
            for c in 0..width {
                line[n + c] = -self.step[i * width + c];
            }
        }
        let mut first: Vec<f64> = self.condensed_border[..q * n].to_vec();
        let mut current = vec![0.0; q * n];
        for j in 1..count {
            for c in 0..q * n {
                current[c] += self.condensed_border[j * q * n + c];
            }
            let stack = &mut self.stack;
            stack.fill(0.0);
            for i in 0..n {
                let top = &mut stack[i * full..(i + 1) * full];
                let line = &relation[i * (2 * n + q)..(i + 1) * (2 * n + q)];
                top[..n].copy_from_slice(&line[..n]);
                top[2 * n..].copy_from_slice(&line[n..]);
                let bottom = &mut stack[(n + i) * full..(n + i + 1) * full];
                let g = &self.step[(j * n + i) * width..(j * n + i + 1) * width];
                for c in 0..n {
                    bottom[c] = -g[c];
                }
                bottom[n + i] = 1.0;
                for c in 0..q {
                    bottom[3 * n + c] = -g[n + c];
                }
            }
            let v = &mut self.reflectors[j * n * 2 * n..(j + 1) * n * 2 * n];
            reflect::triangularise(stack, 2 * n, full, n, v);
            let upper = &mut self.upper[j * n * full..(j + 1) * n * full];
            upper.copy_from_slice(&stack[..n * full]);
            for i in 0..n {
                if upper[i * full + i].abs().partial_cmp(&1e-300) != Some(std::cmp::Ordering::Greater) {
                    return Err(Singular);
                }
                let line = &mut relation[i * (2 * n + q)..(i + 1) * (2 * n + q)];
                let bottom = &stack[(n + i) * full..(n + i + 1) * full];
                line.copy_from_slice(&bottom[n..]);
            }
            for c in 0..q {
                let y = &mut self.multipliers[(j * q + c) * n..(j * q + c + 1) * n];
                y.copy_from_slice(&current[c * n..(c + 1) * n]);
                let next = &mut current[c * n..(c + 1) * n];
                next.fill(0.0);
                for i in 0..n {
                    let line = &upper[i * full..(i + 1) * full];
                    y[i] /= line[i];
                    let yi = y[i];
                    axpy(-yi, &line[i + 1..n], &mut y[i + 1..]);
                    axpy(-yi, &line[n..2 * n], next);
                    axpy(-yi, &line[2 * n..3 * n], &mut first[c * n..(c + 1) * n]);
                    axpy(-yi, &line[3 * n..], &mut corner[c * q..(c + 1) * q]);
                }
            }
        }
        for i in 0..n {
            for c in 0..n {
                self.last[i * width + c] = closure * relation[i * (2 * n + q) + c] + relation[i * (2 * n + q) + n + c];
            }
            for c in 0..q {
                self.last[i * width + n + c] = relation[i * (2 * n + q) + 2 * n + c];
            }
        }
        for r in 0..q {
            for c in 0..n {
                self.last[(n + r) * width + c] = first[r * n + c] + closure * current[r * n + c];
            }
            for c in 0..q {
                self.last[(n + r) * width + n + c] = corner[r * q + c];
            }
        }
        lu::factorise(&mut self.last, width, &mut self.last_pivots)
    }

    /// Solves (1)–(4). `rhs` is, per interval, c_j (n) then r_j (m·n), and at the end s (q); the solution has the layout
    /// x_j, X_j per interval, then σ.
    pub fn solve(&self, rhs: &[f64], x: &mut [f64]) {
        let (n, m, q, inner) = (self.n, self.m, self.q, self.m * self.n);
        let (width, full, count, block) = (n + q, 3 * n + q, self.intervals, self.m * self.n + self.n);
        let mut s = rhs[count * block..count * block + q].to_vec();
        x.copy_from_slice(rhs);
        let mut h = vec![0.0; count * n];
        for j in 0..count {
            let z = &mut x[j * block + n..(j + 1) * block];
            let a = &self.interior[j * inner * inner..(j + 1) * inner * inner];
            lu::solve(a, inner, &self.pivots[j * inner..(j + 1) * inner], z, 1);
            let hj = &mut h[j * n..(j + 1) * n];
            hj.copy_from_slice(&rhs[j * block..j * block + n]);
            for k in 0..m {
                axpy(self.end[k + 1], &z[k * n..(k + 1) * n], hj);
            }
            for c in 0..q {
                s[c] -= dot(&self.border[(c * count + j) * block + n..(c * count + j + 1) * block], z);
            }
        }
        let mut pair = vec![0.0; 2 * n];
        pair[..n].copy_from_slice(&h[..n]);
        for j in 1..count {
            pair[n..].copy_from_slice(&h[j * n..(j + 1) * n]);
            reflect::apply(&self.reflectors[j * n * 2 * n..(j + 1) * n * 2 * n], 2 * n, n, &mut pair, 1);
            h[j * n..(j + 1) * n].copy_from_slice(&pair[..n]);
            for c in 0..q {
                s[c] -= dot(&self.multipliers[(j * q + c) * n..(j * q + c + 1) * n], &pair[..n]);
            }
            pair.copy_within(n.., 0);
        }
        let mut tail = vec![0.0; width];
        tail[..n].copy_from_slice(&pair[..n]);
        tail[n..].copy_from_slice(&s);
        lu::solve(&self.last, width, &self.last_pivots, &mut tail, 1);
        let mut right: Vec<f64> = tail[..n].iter().map(|v| self.closure * v).collect();
        for j in (0..count).rev() {
            let left = &mut x[j * block..j * block + n];
            if j == 0 {
                left.copy_from_slice(&tail[..n]);
            } else {
                let upper = &self.upper[j * n * full..(j + 1) * n * full];
                for i in (0..n).rev() {
                    let line = &upper[i * full..(i + 1) * full];
                    let known = dot(&line[n..2 * n], &right)
                        + dot(&line[2 * n..], &tail)
                        + dot(&line[i + 1..n], &left[i + 1..]);
                    left[i] = (h[j * n + i] - known) / line[i];
                }
            }
            right.copy_from_slice(left);
            let (left, z) = x[j * block..(j + 1) * block].split_at_mut(n);
            let w = &self.coupling[j * inner * width..(j + 1) * inner * width];
            for (zi, line) in z.iter_mut().zip(w.chunks_exact(width)) {
                *zi -= dot(&line[..n], left) + dot(&line[n..], &tail[n..]);
            }
        }
        x[count * block..].copy_from_slice(&tail[n..]);
    }

    /// Solves the transposed system: `z` has the layout of the unknowns (x_j, X_j per interval, then σ), `y` that of the
    /// equations (c_j, r_j per interval, then s).
    pub fn solve_transposed(&self, z: &[f64], y: &mut [f64]) {
        let (n, m, q, inner) = (self.n, self.m, self.q, self.m * self.n);
        let (width, full, count, block) = (n + q, 3 * n + q, self.intervals, self.m * self.n + self.n);
        // Interior columns first: what they leave for the interval ends and the scalars.
        let mut ends = vec![0.0; count * n];
        let mut tail = vec![0.0; width];
        tail[n..].copy_from_slice(&z[count * block..]);
        for j in 0..count {
            let own = &z[j * block..(j + 1) * block];
            let end = &mut ends[j * n..(j + 1) * n];
            end.copy_from_slice(&own[..n]);
            let w = &self.coupling[j * inner * width..(j + 1) * inner * width];
            for (v, line) in own[n..].iter().zip(w.chunks_exact(width)) {
                axpy(-v, &line[..n], end);
                axpy(-v, &line[n..], &mut tail[n..]);
            }
        }
        tail[..n].copy_from_slice(&ends[..n]);
        // The triangular factor, from the left.
        for j in 1..count {
            let (before, own) = ends.split_at_mut(j * n);
            let own = &mut own[..n];
            if j > 1 {
                let last = &self.upper[(j - 1) * n * full..j * n * full];
                for (i, v) in before[(j - 1) * n..].iter().enumerate() {
                    axpy(-v, &last[i * full + n..i * full + 2 * n], own);
                }
            }
            let upper = &self.upper[j * n * full..(j + 1) * n * full];
            for i in 0..n {
                own[i] /= upper[i * full + i];
                let v = own[i];
                axpy(-v, &upper[i * full + i + 1..i * full + n], &mut own[i + 1..]);
                axpy(-v, &upper[i * full + 2 * n..(i + 1) * full], &mut tail);
                if j + 1 == count {
                    axpy(-v * self.closure, &upper[i * full + n..i * full + 2 * n], &mut tail[..n]);
                }
            }
        }
        lu::solve_transposed(&self.last, width, &self.last_pivots, &mut tail);
        let (mut carry, border) = (tail[..n].to_vec(), &tail[n..]);
        // The orthogonal factor, from the right.
        let mut pair = vec![0.0; 2 * n];
        for j in (1..count).rev() {
            pair[..n].copy_from_slice(&ends[j * n..(j + 1) * n]);
            for c in 0..q {
                axpy(-border[c], &self.multipliers[(j * q + c) * n..(j * q + c + 1) * n], &mut pair[..n]);
            }
            pair[n..].copy_from_slice(&carry);
            reflect::apply_reversed(&self.reflectors[j * n * 2 * n..(j + 1) * n * 2 * n], 2 * n, n, &mut pair, 1);
            carry.copy_from_slice(&pair[..n]);
            ends[j * n..(j + 1) * n].copy_from_slice(&pair[n..]);
        }
        ends[..n].copy_from_slice(&carry);
        for j in 0..count {
            let own = &mut y[j * block..(j + 1) * block];
            own[..n].copy_from_slice(&ends[j * n..(j + 1) * n]);
            own[n..].copy_from_slice(&z[j * block + n..(j + 1) * block]);
            for k in 0..m {
                axpy(self.end[k + 1], &ends[j * n..(j + 1) * n], &mut own[(k + 1) * n..(k + 2) * n]);
            }
            for c in 0..q {
                let row = &self.border[(c * count + j) * block + n..(c * count + j + 1) * block];
                axpy(-border[c], row, &mut own[n..]);
            }
            let a = &self.interior[j * inner * inner..(j + 1) * inner * inner];
            lu::solve_transposed(a, inner, &self.pivots[j * inner..(j + 1) * inner], &mut own[n..]);
        }
        y[count * block..].copy_from_slice(border);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::prelude::*;

    /// The same equations as one dense matrix.
    fn dense(c: &Condensed, closure: f64) -> faer::Mat<f64> {
        let (n, inner, q, count) = (c.n, c.m * c.n, c.q, c.intervals);
        let block = n + inner;
        let size = count * block + q;
        let mut a = faer::Mat::zeros(size, size);
        for j in 0..count {
            let (row, width) = (j * block, n + q);
            let (next, factor) = if j + 1 == count { (0, closure) } else { ((j + 1) * block, 1.0) };
            for i in 0..n {
                a[(row + i, next + i)] += factor;
                a[(row + i, row + i)] -= c.end[0];
                for k in 0..c.m {
                    a[(row + i, row + n + k * n + i)] -= c.end[k + 1];
                }
            }
            for i in 0..inner {
                for k in 0..inner {
                    a[(row + n + i, row + n + k)] = c.interior[j * inner * inner + i * inner + k];
                }
                for k in 0..n {
                    a[(row + n + i, row + k)] = c.coupling[(j * inner + i) * width + k];
                }
                for k in 0..q {
                    a[(row + n + i, count * block + k)] = c.coupling[(j * inner + i) * width + n + k];
                }
            }
        }
        for r in 0..q {
            for k in 0..count * block {
                a[(count * block + r, k)] = c.border[r * count * block + k];
            }
            for k in 0..q {
                a[(count * block + r, count * block + k)] = c.corner[r * q + k];
            }
        }
        a
    }

    #[test]
    fn agrees_with_a_dense_solution_of_the_same_equations() {
        for (intervals, q, closure) in [(1, 2, 1.0), (2, 1, -1.0), (7, 2, 1.0), (5, 0, -1.0), (6, 3, 1.0)] {
            let mut c = Condensed::new(3, &[0.4, -0.7, 1.3], q);
            c.resize(intervals);
            let mut seed = 0.3f64;
            let mut next = || {
                seed = (seed * 97.13 + 0.711).fract();
                seed - 0.5
            };
            for v in [&mut c.interior, &mut c.coupling, &mut c.border, &mut c.corner] {
                v.iter_mut().for_each(|x| *x = next());
            }
            for j in 0..intervals {
                for i in 0..6 {
                    c.interior[j * 36 + i * 7] += 3.0;
                }
            }
            let matrix = dense(&c, closure);
            let size = intervals * 9 + q;
            let rhs: Vec<f64> = (0..size).map(|_| next()).collect();
            let reference = matrix.partial_piv_lu().solve(&faer::Mat::from_fn(size, 1, |i, _| rhs[i]));
            c.condense().unwrap();
            c.eliminate(closure).unwrap();
            let mut x = vec![0.0; size];
            c.solve(&rhs, &mut x);
            let transposed = matrix.transpose().to_owned();
            let second = transposed.partial_piv_lu().solve(&faer::Mat::from_fn(size, 1, |i, _| rhs[i]));
            let mut y = vec![0.0; size];
            c.solve_transposed(&rhs, &mut y);
            for i in 0..size {
                assert!((y[i] - second[(i, 0)]).abs() < 1e-10, "{intervals} intervals, transposed, {i}");
            }
            for i in 0..size {
                assert!(
                    (x[i] - reference[(i, 0)]).abs() < 1e-10,
                    "{intervals} intervals: {} against {}",
                    x[i],
                    reference[(i, 0)]
                );
            }
        }
    }
}
