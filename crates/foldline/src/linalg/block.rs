//! LU factorisation of small dense matrices, one in each lane.
//!
//! **Idea.** Gaussian elimination with a diagonal pivot while it is at least a tenth of what stands below it. Otherwise the lane
//! that needs it exchanges rows by itself; the matrices of collocation in Runge–Kutta form rarely do.
//!
//! **Source.** Threshold pivoting: duff2017, §5.2.

use super::lane::{Lane, subtract};
use super::tile::subtract_product;
use crate::contract::Singular;

/// Share of the largest candidate that the diagonal must have to serve as pivot.
const THRESHOLD: f64 = 0.1;
/// Rows up to which a matrix is treated as a whole.
const SMALL: usize = 32;
/// Columns of a panel of a larger one.
const PANEL: usize = 16;

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
    // Small matrices are one panel; in larger ones the bulk of the work is products of panels.
    let depth = if n <= SMALL { n } else { PANEL };
    let mut left = Vec::new();
    for first in (0..n).step_by(depth.max(1)) {
        let end = (first + depth).min(n);
        for k in first..end {
            exchanged |= pivot(a, n, pivots, b, columns, k)?;
            let inverse = a[k * n + k];
            let (upper, lower) = a.split_at_mut((k + 1) * n);
            let row_k = &upper[k * n + k + 1..k * n + end];
            let (done, rest) = b.split_at_mut((k + 1) * columns);
            let right_k = &done[k * columns..];
            for (i, row) in lower.chunks_exact_mut(n).enumerate() {
                // Many entries vanish in every lane: components that do not depend on each other.
                if row[k].lanes().iter().all(|x| *x == 0.0) {
                    continue;
                }
                let factor = row[k] * inverse;
                row[k] = factor;
                subtract(factor, row_k, &mut row[k + 1..end]);
                if end == n && first == 0 {
                    subtract(factor, right_k, &mut rest[i * columns..(i + 1) * columns]);
                }
            }
        }
        if depth < n {
            update(a, n, b, columns, [first, end], &mut left);
        }
    }
    back(a, n, b, columns, &mut left);
    Ok(exchanged)
}

/// Chooses the pivot of column k in every lane and holds its inverse; returns whether rows were exchanged.
#[inline(always)]
fn pivot<T: Lane>(
    a: &mut [T],
    n: usize,
    pivots: &mut [u32],
    b: &mut [T],
    columns: usize,
    k: usize,
) -> Result<bool, Singular> {
    let diagonal = a[k * n + k].map(f64::abs);
    let mut largest = diagonal;
    for i in k + 1..n {
        largest = largest.zip(a[i * n + k], |m, x| if x.abs() > m { x.abs() } else { m });
    }
    let serves =
        diagonal.zip(largest, |d, m| if d >= THRESHOLD * m && d > 1e-300 && d < f64::INFINITY { 0.0 } else { 1.0 });
    let own = &mut pivots[k * T::COUNT..(k + 1) * T::COUNT];
    own.fill(k as u32);
    let wanting = serves.lanes().iter().any(|x| *x > 0.0);
    if wanting {
        for l in 0..T::COUNT {
            if serves.lanes()[l] > 0.0 {
                own[l] = exchange(a, n, b, columns, k, l)?;
            }
        }
    }
    a[k * n + k] = a[k * n + k].map(|x| 1.0 / x);
    Ok(wanting)
}

/// After a panel: its rows to the right of it, then everything below.
#[inline(always)]
fn update<T: Lane>(a: &mut [T], n: usize, b: &mut [T], columns: usize, [first, end]: [usize; 2], left: &mut Vec<T>) {
    let depth = end - first;
    let (upper, lower) = a.split_at_mut(end * n);
    let (done, rest) = b.split_at_mut(end * columns);
    let (upper, done) = (&mut upper[first * n..], &mut done[first * columns..]);
    for i in 1..depth {
        let (before, own) = upper.split_at_mut(i * n);
        let (right_before, right) = done.split_at_mut(i * columns);
        for k in 0..i {
            let factor = own[first + k];
            subtract(factor, &before[k * n + end..(k + 1) * n], &mut own[end..n]);
            subtract(factor, &right_before[k * columns..(k + 1) * columns], &mut right[..columns]);
        }
    }
    left.clear();
    left.extend(lower.chunks_exact(n).flat_map(|row| &row[first..end]));
    subtract_product(lower, left, upper, n, depth, [end, n]);
    subtract_product(rest, left, done, columns, depth, [0, columns]);
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
fn back<T: Lane>(a: &[T], n: usize, b: &mut [T], columns: usize, left: &mut Vec<T>) {
    let depth = if n <= SMALL { n } else { PANEL };
    for first in (0..n).step_by(depth.max(1)).rev() {
        let end = (first + depth).min(n);
        let (own, solved) = b.split_at_mut(end * columns);
        let own = &mut own[first * columns..];
        if end < n {
            left.clear();
            left.extend(a[first * n..end * n].chunks_exact(n).flat_map(|row| &row[end..]));
            subtract_product(own, left, solved, columns, n - end, [0, columns]);
        }
        for k in (0..end - first).rev() {
            let (head, tail) = own.split_at_mut((k + 1) * columns);
            let row = &mut head[k * columns..];
            let line = &a[(first + k) * n..(first + k + 1) * n];
            for (i, below) in tail.chunks_exact(columns.max(1)).enumerate() {
                subtract(line[first + k + 1 + i], below, row);
            }
            row.iter_mut().for_each(|x| *x = *x * line[first + k]);
        }
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

    /// Eight matrices, every second of which has its large entries beside the diagonal, against the scalar factorisation.
    #[test]
    fn every_lane_agrees_with_the_scalar_factorisation() {
        for (n, columns) in [(7, 3), (45, 11)] {
            agrees(n, columns);
        }
    }

    fn agrees(n: usize, columns: usize) {
        let entry = |l: usize, i: usize, j: usize| {
            let strong = if (i + l % 2) % n == j { 3.0 } else { 0.0 };
            ((i * 7 + j * 13 + l * 5 + 3) as f64 * 0.7312).sin() + strong
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
                assert!((one[k].0[l] - x[k * columns]).abs() < 1e-10);
                assert!((turned[k].0[l] - y[k]).abs() < 1e-10);
                assert!((0..columns).all(|c| (b[k * columns + c].0[l] - x[k * columns + c]).abs() < 1e-10));
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
