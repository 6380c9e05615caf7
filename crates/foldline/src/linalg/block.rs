//! LU factorisation of small dense matrices, one in each lane.
//!
//! **Idea.** Gaussian elimination with a diagonal pivot while it is at least a tenth of what stands below it. Otherwise the lane
//! that needs it exchanges rows by itself; the matrices of collocation in Runge–Kutta form rarely do.
//!
//! **Source.** Threshold pivoting: duff2017, §5.2.

use super::lane::{Lane, subtract};
use crate::contract::Singular;

/// Share of the largest candidate that the diagonal must have to serve as pivot.
const THRESHOLD: f64 = 0.1;

/// Factorises the row-major n×n matrices `a` in place (the diagonal holds the inverse pivots) and solves a x = b for the
/// `columns` right-hand sides in `b`, row-major `[n × columns]`. `pivots` is `[n × lanes]`.
///
/// Returns whether any rows were exchanged.
///
/// # Errors
/// [`Singular`] if a pivot is zero, not finite, or below 1e-300.
#[inline(always)]
pub fn factorise<T: Lane>(
    a: &mut [T],
    n: usize,
    pivots: &mut [u32],
    b: &mut [T],
    columns: usize,
) -> Result<bool, Singular> {
    let mut exchanged = false;
    for k in 0..n {
        let diagonal = a[k * n + k].map(f64::abs);
        let mut largest = diagonal;
        for i in k + 1..n {
            largest = largest.zip(a[i * n + k], |m, x| if x.abs() > m { x.abs() } else { m });
        }
        let serves = diagonal.zip(largest, |d, m| {
            if d >= THRESHOLD * m && d > 1e-300 && d < f64::INFINITY { 0.0 } else { 1.0 }
        });
        let own = &mut pivots[k * T::COUNT..(k + 1) * T::COUNT];
        own.fill(k as u32);
        if serves.lanes().iter().any(|x| *x > 0.0) {
            for l in 0..T::COUNT {
                if serves.lanes()[l] > 0.0 {
                    own[l] = exchange(a, n, b, columns, k, l)?;
                    exchanged = true;
                }
            }
        }
        let inverse = a[k * n + k].map(|x| 1.0 / x);
        a[k * n + k] = inverse;
        let (upper, lower) = a.split_at_mut((k + 1) * n);
        let pivot = &upper[k * n + k + 1..];
        let (done, rest) = b.split_at_mut((k + 1) * columns);
        let pivot_right = &done[k * columns..];
        for (i, row) in lower.chunks_exact_mut(n).enumerate() {
            // Many entries vanish in every lane: components that do not depend on each other.
            if row[k].lanes().iter().all(|x| *x == 0.0) {
                continue;
            }
            let factor = row[k] * inverse;
            row[k] = factor;
            subtract(factor, pivot, &mut row[k + 1..]);
            subtract(factor, pivot_right, &mut rest[i * columns..(i + 1) * columns]);
        }
    }
    back(a, n, b, columns);
    Ok(exchanged)
}

/// Exchanges row k of lane l for the one with the largest entry in column k.
#[cold]
fn exchange<T: Lane>(a: &mut [T], n: usize, b: &mut [T], columns: usize, k: usize, l: usize) -> Result<u32, Singular> {
    let size = |i: usize| a[i * n + k].lanes()[l].abs();
    let p = (k..n).fold(k, |p, i| if size(i) > size(p) { i } else { p });
    if !(size(p) > 1e-300 && size(p) < f64::INFINITY) {
        return Err(Singular);
    }
    for (rows, width) in [(a, n), (b, columns)] {
        for c in 0..width {
            let (x, y) = (rows[k * width + c].lanes()[l], rows[p * width + c].lanes()[l]);
            rows[k * width + c].lanes_mut()[l] = y;
            rows[p * width + c].lanes_mut()[l] = x;
        }
    }
    Ok(p as u32)
}

/// The upper triangle, for all columns of `b`.
#[inline(always)]
fn back<T: Lane>(a: &[T], n: usize, b: &mut [T], columns: usize) {
    for k in (0..n).rev() {
        let (head, tail) = b.split_at_mut((k + 1) * columns);
        let own = &mut head[k * columns..];
        for (i, row) in tail.chunks_exact(columns.max(1)).enumerate() {
            subtract(a[k * n + k + 1 + i], row, own);
        }
        let inverse = a[k * n + k];
        own.iter_mut().for_each(|x| *x = *x * inverse);
    }
}

/// Solves for one right-hand side `[n]` in place.
#[inline(always)]
pub fn solve<T: Lane>(a: &[T], n: usize, pivots: &[u32], exchanged: bool, b: &mut [T]) {
    if exchanged {
        for k in 0..n {
            swap_lanes(b, k, &pivots[k * T::COUNT..(k + 1) * T::COUNT]);
        }
    }
    for k in 1..n {
        let mut sum = b[k];
        for i in 0..k {
            sum = sum - a[k * n + i] * b[i];
        }
        b[k] = sum;
    }
    for k in (0..n).rev() {
        let mut sum = b[k];
        for i in k + 1..n {
            sum = sum - a[k * n + i] * b[i];
        }
        b[k] = sum * a[k * n + k];
    }
}

/// Solves aᵀ x = b for one right-hand side `[n]` in place.
#[inline(always)]
pub fn solve_transposed<T: Lane>(a: &[T], n: usize, pivots: &[u32], exchanged: bool, b: &mut [T]) {
    for k in 0..n {
        b[k] = b[k] * a[k * n + k];
        let (head, tail) = b.split_at_mut(k + 1);
        subtract(head[k], &a[k * n + k + 1..(k + 1) * n], tail);
    }
    for k in (1..n).rev() {
        let (head, tail) = b.split_at_mut(k);
        subtract(tail[0], &a[k * n..k * n + k], head);
    }
    if exchanged {
        for k in (0..n).rev() {
            swap_lanes(b, k, &pivots[k * T::COUNT..(k + 1) * T::COUNT]);
        }
    }
}

#[inline(always)]
fn swap_lanes<T: Lane>(b: &mut [T], k: usize, pivots: &[u32]) {
    for (l, p) in pivots.iter().enumerate() {
        let p = *p as usize;
        if p != k {
            let (x, y) = (b[k].lanes()[l], b[p].lanes()[l]);
            b[k].lanes_mut()[l] = y;
            b[p].lanes_mut()[l] = x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::lane::Eight;
    use super::*;

    /// Eight matrices, every second of which needs exchanges, against the scalar factorisation.
    #[test]
    fn every_lane_agrees_with_the_scalar_factorisation() {
        let (n, columns) = (7, 3);
        let entry = |l: usize, i: usize, j: usize| {
            let diagonal = if i == j { [3.0, 0.0][l % 2] } else { 0.0 };
            ((i * 7 + j * 13 + l * 5 + 3) as f64 * 0.7312).sin() + diagonal
        };
        let right = |l: usize, k: usize| ((k * 3 + l) as f64).cos();
        let fill = |size: usize, f: &dyn Fn(usize, usize) -> f64| -> Vec<Eight> {
            (0..size).map(|k| Eight(std::array::from_fn(|l| f(l, k)))).collect()
        };
        let mut a = fill(n * n, &|l, k| entry(l, k / n, k % n));
        let mut b = fill(n * columns, &right);
        let mut one = fill(n, &|l, k| right(l, k * columns));
        let mut turned = one.clone();
        let mut pivots = vec![0; 8 * n];
        assert!(factorise(&mut a, n, &mut pivots, &mut b, columns).unwrap());
        solve(&a, n, &pivots, true, &mut one);
        solve_transposed(&a, n, &pivots, true, &mut turned);
        for l in 0..8 {
            let mut plain: Vec<f64> = (0..n * n).map(|k| entry(l, k / n, k % n)).collect();
            let mut p = vec![0; n];
            super::super::lu::factorise(&mut plain, n, &mut p).unwrap();
            let mut x: Vec<f64> = (0..n * columns).map(|k| right(l, k)).collect();
            let mut y: Vec<f64> = (0..n).map(|k| right(l, k * columns)).collect();
            super::super::lu::solve(&plain, n, &p, &mut x, columns);
            super::super::lu::solve_transposed(&plain, n, &p, &mut y);
            for k in 0..n {
                assert!((one[k].0[l] - x[k * columns]).abs() < 1e-11);
                assert!((turned[k].0[l] - y[k]).abs() < 1e-11);
                assert!((0..columns).all(|c| (b[k * columns + c].0[l] - x[k * columns + c]).abs() < 1e-11));
            }
        }
    }

    #[test]
    fn one_singular_lane_is_reported() {
        let mut a = vec![Eight([1.0; 8]); 4];
        a[3] = Eight([2.0, 2.0, 2.0, 1.0, 2.0, 2.0, 2.0, 2.0]);
        let mut none: [Eight; 0] = [];
        assert_eq!(factorise(&mut a, 2, &mut [0; 16], &mut none, 0), Err(Singular));
    }
}
