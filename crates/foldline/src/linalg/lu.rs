//! LU factorisation of a small dense matrix.
//!
//! **Idea.** Gaussian elimination with row pivoting in place. Which entry of a column is the largest depends on the
//! units of the rows, which depend on those of the columns. Therefore the entries of R A C are compared, with R and C
//! diagonal such that the largest entry of every row and of every column has size 1. The matrix itself is not scaled,
//! so nothing is rounded.
//!
//! **Equations.** Starting from R = C = 1, with A' = R A C, repeatedly
//!
//! ```text
//!   (1)  R_i ← R_i / √(max_j |A'_ij|),   C_j ← C_j / √(max_i |A'_ij|)
//! ```
//!
//! **Source.** ruiz2001 (the iteration (1)); higham2002, §9.8 (scaling and the choice of pivots).

use crate::contract::Singular;

/// Factorises the row-major n×n matrix `a` in place; `pivots` is `[n]`. Rows and columns may have any units.
///
/// # Errors
/// [`Singular`] if a pivot is zero, not finite, or below 1e-300.
pub fn factorise(a: &mut [f64], n: usize, pivots: &mut [usize]) -> Result<(), Singular> {
    let mut rows = row_weights(a, n);
    pivoted(a, n, pivots, &mut rows)
}

/// Factorises a matrix like [`factorise`], if all rows and all columns have one unit.
///
/// # Errors
/// [`Singular`] if a pivot is zero, not finite, or below 1e-300.
pub fn factorise_even(a: &mut [f64], n: usize, pivots: &mut [usize]) -> Result<(), Singular> {
    pivoted(a, n, pivots, &mut vec![1.0; n])
}

/// Factorises a matrix like [`factorise`], if its rows have the units of `scales`, which repeat.
///
/// # Errors
/// [`Singular`] if a pivot is zero, not finite, or below 1e-300.
pub fn factorise_scaled(a: &mut [f64], n: usize, pivots: &mut [usize], scales: &[f64]) -> Result<(), Singular> {
    let mut rows: Vec<f64> = scales.iter().cycle().take(n).map(|scale| 1.0 / scale).collect();
    pivoted(a, n, pivots, &mut rows)
}

/// R of (1), `[n]`.
fn row_weights(a: &[f64], n: usize) -> Vec<f64> {
    /// Each round halves the remaining logarithms.
    const ROUNDS: usize = 6;
    let (mut rows, mut columns) = (vec![1.0; n], vec![1.0; n]);
    for _ in 0..ROUNDS {
        let (mut largest_in_row, mut largest_in_column) = (vec![0.0f64; n], vec![0.0f64; n]);
        for (i, row) in a.chunks_exact(n.max(1)).enumerate() {
            for (j, x) in row.iter().enumerate() {
                let x = (rows[i] * x * columns[j]).abs();
                largest_in_row[i] = largest_in_row[i].max(x);
                largest_in_column[j] = largest_in_column[j].max(x);
            }
        }
        let divide = |weights: &mut [f64], largest: &[f64]| {
            let proper = weights.iter_mut().zip(largest).filter(|(_, largest)| **largest > 0.0 && largest.is_finite());
            proper.for_each(|(weight, largest)| *weight /= largest.sqrt());
        };
        divide(&mut rows, &largest_in_row);
        divide(&mut columns, &largest_in_column);
    }
    rows
}

/// Elimination with a weight `[n]` for every row in the choice of the pivot.
fn pivoted(a: &mut [f64], n: usize, pivots: &mut [usize], weights: &mut [f64]) -> Result<(), Singular> {
    for k in 0..n {
        let mut p = k;
        let mut best = weights[k] * a[k * n + k].abs();
        for i in k + 1..n {
            let candidate = weights[i] * a[i * n + k].abs();
            if candidate > best {
                (p, best) = (i, candidate);
            }
        }
        let best = a[p * n + k].abs();
        if !(best > 1e-300 && best.is_finite()) {
            return Err(Singular);
        }
        pivots[k] = p;
        if p != k {
            weights.swap(k, p);
            for c in 0..n {
                a.swap(k * n + c, p * n + c);
            }
        }
        let inverse = 1.0 / a[k * n + k];
        let (upper, lower) = a.split_at_mut((k + 1) * n);
        let pivot_row = &upper[k * n + k + 1..k * n + n];
        for row in lower.chunks_exact_mut(n) {
            let factor = row[k] * inverse;
            row[k] = factor;
            if factor != 0.0 {
                for (x, y) in row[k + 1..].iter_mut().zip(pivot_row) {
                    *x -= factor * y;
                }
            }
        }
    }
    Ok(())
}

/// Solves for `columns` right-hand sides; `b`, row-major `[n × columns]`, is overwritten by the solution.
pub fn solve(a: &[f64], n: usize, pivots: &[usize], b: &mut [f64], columns: usize) {
    // Whole groups of columns stay in registers; most calls have one column, or a few.
    match columns {
        0 => {}
        1 => solve_group::<1>(a, n, pivots, b),
        2 => solve_group::<2>(a, n, pivots, b),
        3 => solve_group::<3>(a, n, pivots, b),
        4 => solve_group::<4>(a, n, pivots, b),
        5 => solve_group::<5>(a, n, pivots, b),
        6 => solve_group::<6>(a, n, pivots, b),
        7 => solve_group::<7>(a, n, pivots, b),
        8 => solve_group::<8>(a, n, pivots, b),
        _ => {
            let mut part = Vec::new();
            for first in (0..columns).step_by(8) {
                let count = (columns - first).min(8);
                part.clear();
                part.extend(b.chunks_exact(columns).flat_map(|row| &row[first..first + count]));
                solve(a, n, pivots, &mut part, count);
                for (row, solved) in b.chunks_exact_mut(columns).zip(part.chunks_exact(count)) {
                    row[first..first + count].copy_from_slice(solved);
                }
            }
        }
    }
}

fn solve_group<const C: usize>(a: &[f64], n: usize, pivots: &[usize], b: &mut [f64]) {
    let (rows, _) = b.as_chunks_mut::<C>();
    let rows = &mut rows[..n];
    for (k, &p) in pivots[..n].iter().enumerate() {
        if p != k {
            rows.swap(k, p);
        }
    }
    for k in 1..n {
        let (done, rest) = rows.split_at_mut(k);
        let mut sum = rest[0];
        for (l, row) in a[k * n..k * n + k].iter().zip(done.iter()) {
            for c in 0..C {
                sum[c] -= l * row[c];
            }
        }
        rest[0] = sum;
    }
    for k in (0..n).rev() {
        let (head, done) = rows.split_at_mut(k + 1);
        let mut sum = head[k];
        for (u, row) in a[k * n + k + 1..(k + 1) * n].iter().zip(done.iter()) {
            for c in 0..C {
                sum[c] -= u * row[c];
            }
        }
        let inverse = 1.0 / a[k * n + k];
        head[k] = sum.map(|x| x * inverse);
    }
}

/// Solves aᵀ x = b for a single right-hand side `[n]` in place.
pub fn solve_transposed(a: &[f64], n: usize, pivots: &[usize], b: &mut [f64]) {
    for k in 0..n {
        b[k] /= a[k * n + k];
        let x = b[k];
        b[k + 1..n].iter_mut().zip(&a[k * n + k + 1..(k + 1) * n]).for_each(|(b, u)| *b -= u * x);
    }
    for k in (0..n).rev() {
        let x = b[k];
        b[..k].iter_mut().zip(&a[k * n..k * n + k]).for_each(|(b, l)| *b -= l * x);
    }
    for k in (0..n).rev() {
        b.swap(k, pivots[k]);
    }
}

/// Sign of the determinant and logarithm of its modulus, from a factorisation.
pub fn determinant(a: &[f64], n: usize, pivots: &[usize]) -> (f64, f64) {
    let mut sign = 1.0;
    let mut log = 0.0;
    for k in 0..n {
        let u = a[k * n + k];
        if pivots[k] != k {
            sign = -sign;
        }
        if u < 0.0 {
            sign = -sign;
        }
        log += u.abs().ln();
    }
    (sign, log)
}

#[cfg(test)]
mod tests {
    use super::*;
    use foldline_general::{Factored, Mat};

    #[test]
    fn agrees_with_an_independent_library() {
        let n = 16;
        let entry = |i: usize, j: usize| ((i * 7 + j * 13 + 3) as f64 * 0.7312).sin() + if i == j { 0.3 } else { 0.0 };
        let mut a: Vec<f64> = (0..n * n).map(|k| entry(k / n, k % n)).collect();
        let mut b: Vec<f64> = (0..n * 2).map(|k| (k as f64).cos()).collect();
        let rhs = Mat::from_fn(n, 2, |i, j| ((i * 2 + j) as f64).cos());
        let reference = Factored::new(Mat::from_fn(n, n, entry).as_ref()).solve(&rhs);
        let mut pivots = vec![0; n];
        factorise(&mut a, n, &mut pivots).unwrap();
        solve(&a, n, &pivots, &mut b, 2);
        for i in 0..n {
            for j in 0..2 {
                assert!((b[i * 2 + j] - reference[(i, j)]).abs() < 1e-11);
            }
        }
        let transposed = Factored::new(Mat::from_fn(n, n, |i, j| entry(j, i)).as_ref()).solve(&rhs);
        let mut x: Vec<f64> = (0..n).map(|i| rhs[(i, 1)]).collect();
        solve_transposed(&a, n, &pivots, &mut x);
        for i in 0..n {
            assert!((x[i] - transposed[(i, 1)]).abs() < 1e-11);
        }
        // Two of eleven columns must have the same solution.
        let mut wide: Vec<f64> =
            (0..n * 11).map(|k| if k % 11 < 2 { ((k / 11 * 2 + k % 11) as f64).cos() } else { k as f64 }).collect();
        solve(&a, n, &pivots, &mut wide, 11);
        for i in 0..n {
            assert_eq!(wide[i * 11..i * 11 + 2], b[i * 2..i * 2 + 2]);
        }
    }

    #[test]
    fn a_singular_matrix_is_reported() {
        let mut a = vec![1.0, 2.0, 2.0, 4.0];
        assert_eq!(factorise(&mut a, 2, &mut [0, 0]), Err(Singular));
    }
}
