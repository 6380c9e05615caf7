//! LU factorisation of small dense matrices, one in each lane.
//!
//! **Idea.** Gaussian elimination, component by component, with a diagonal pivot while it is at least a tenth of the
//! entries below it, on the blocks that can be nonzero ([`Shape`]). Where the diagonal is too small, the lanes
//! concerned exchange rows individually, and every entry is processed from there on; the matrices of collocation in
//! Runge–Kutta form rarely need that. A large matrix with few zero blocks fills the vectors by itself and is eliminated
//! in panels.
//!
//! **Source.** Threshold pivoting: duff2017, §5.2.

use super::lane::{Eight, Lane, dot, subtract};
use super::shape::{Shape, Step};
use super::tile::{self, subtract_product};
use crate::contract::Singular;

/// Smallest diagonal accepted as pivot, as a share of the largest candidate.
const THRESHOLD: f64 = 0.1;
/// Number of rows up to which a matrix is treated as a whole.
const SMALL: usize = 32;
/// Share of the operations of a full matrix up to which blocks are faster than panels.
const SPARSE: f64 = 0.3;
/// Number of columns of a panel.
const PANEL: usize = 16;

/// True if a matrix fills the vectors by itself and is eliminated in panels.
#[inline(always)]
fn in_panels<T: Lane>(n: usize) -> bool {
    T::COUNT == 1 && n > SMALL
}

/// Elimination shape, without steps if so many blocks are nonzero that panels are faster. Arguments as for
/// [`Shape::new`].
pub fn shape<T: Lane>(pattern: &[bool], ends: &[bool], nodes: usize, columns: usize) -> Shape {
    let shape = Shape::new(pattern, ends, nodes, columns);
    let dense = in_panels::<T>(pattern.len().isqrt() * nodes) && shape.share(columns) > SPARSE;
    if dense { Shape::plain(pattern, nodes) } else { shape }
}

/// Factorises the row-major n×n matrices `a` in place (the diagonal holds the inverse pivots) and solves a x = b for
/// the `columns` right-hand sides in `b`, row-major `[n × columns]`. `pivots` is `[n × lanes]`. Entries outside `shape`
/// must be zero. `nodes` repeats its number of nodes, so that a caller can make it a constant. `room` is workspace.
///
/// Returns true if any rows were exchanged.
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
    shape: &Shape,
    nodes: usize,
    room: &mut Vec<T>,
) -> Result<bool, Singular> {
    // Never the case for several lanes.
    if T::COUNT == 1 && shape.is_plain() {
        return panels(a, n, pivots, b, columns, 0, room);
    }
    // The usual degree as a constant.
    let reached = match nodes {
        4 => blocks(a, n, b, columns, shape, 4, room),
        m => blocks(a, n, b, columns, shape, m, room),
    };
    let exchanged = reached < n;
    if exchanged {
        (0..reached).for_each(|k| pivots[k * T::COUNT..(k + 1) * T::COUNT].fill(k as u32));
        if in_panels::<T>(n) {
            panels(a, n, pivots, b, columns, reached, room)?;
        } else {
            whole(a, n, pivots, b, columns, reached)?;
        }
    } else {
        match nodes {
            4 => back_in_blocks(a, n, b, columns, shape, 4),
            m => back_in_blocks(a, n, b, columns, shape, m),
        }
    }
    Ok(exchanged)
}

/// Eliminates component by component. Returns the first column of a component whose diagonal is too small as a pivot, n
/// if there is none.
#[inline(always)]
fn blocks<T: Lane>(
    a: &mut [T],
    n: usize,
    b: &mut [T],
    columns: usize,
    shape: &Shape,
    m: usize,
    room: &mut Vec<T>,
) -> usize {
    room.resize(n * m, T::default());
    for (p, step) in shape.steps.iter().enumerate() {
        let first = p * m;
        let serves = if step.own { own_block(a, n, first, m, step, room) } else { identity(a, n, first, m, step) };
        if !serves {
            return first;
        }
        let (upper, lower) = a.split_at_mut((first + m) * n);
        let (done, rest) = b.split_at_mut((first + m) * columns);
        let (upper, done) = (&mut upper[first * n..], &mut done[first * columns..]);
        if step.own {
            // Rows of the block to the right of it.
            for q in &step.right {
                tile::forward(upper, n, q * m, room, m, m);
            }
            for range in &step.carried {
                tile::forward(done, columns, range.start, room, m, range.len());
            }
        }
        for q in &step.below {
            let rows = &mut lower[(q * m - first - m) * n..(q * m - first) * n];
            copy_block(&rows[first..], n, room, m, m);
            for r in &step.right {
                tile::subtract(rows, n, room, m, upper, n, [m, m, m], [r * m, 0, r * m]);
            }
            let right = &mut rest[(q * m - first - m) * columns..(q * m - first) * columns];
            for range in &step.carried {
                let (c, wide) = (range.start, range.len());
                tile::subtract(right, columns, room, m, done, columns, [m, m, wide], [c, 0, c]);
            }
        }
    }
    n
}

/// True if a component with an identity block can use it as pivots; the entries below are then the factors.
#[inline(always)]
fn identity<T: Lane>(a: &[T], n: usize, first: usize, m: usize, step: &Step) -> bool {
    let mut largest = T::default();
    for q in &step.below {
        for row in a[q * m * n..(q + 1) * m * n].chunks_exact(n) {
            for x in &row[first..first + m] {
                largest = larger(largest, *x);
            }
        }
    }
    T::splat(1.0).all(largest, serves)
}

/// Larger of a number and the modulus of another.
#[inline(always)]
fn larger<T: Lane>(most: T, x: T) -> T {
    most.zip(x.map(f64::abs), |most, x| if x > most { x } else { most })
}

/// True if a diagonal is accepted as pivot, given the largest entry of its column.
#[inline(always)]
fn serves(diagonal: f64, largest: f64) -> bool {
    (diagonal >= THRESHOLD * largest) & (diagonal > 1e-300) & (diagonal < f64::INFINITY)
}

/// Copies an m×m block between matrices of different strides.
#[inline(always)]
fn copy_block<T: Lane>(from: &[T], from_stride: usize, to: &mut [T], to_stride: usize, m: usize) {
    for k in 0..m {
        to[k * to_stride..k * to_stride + m].copy_from_slice(&from[k * from_stride..k * from_stride + m]);
    }
}

/// Eliminates the columns of a component from its own rows and those below, within these columns. Returns false and
/// changes nothing if a diagonal is too small.
#[inline(always)]
fn own_block<T: Lane>(a: &mut [T], n: usize, first: usize, m: usize, step: &Step, room: &mut [T]) -> bool {
    let size = m * m;
    let panel = &mut room[..(1 + step.below.len()) * size];
    copy_block(&a[first * n + first..], n, &mut panel[..size], m, m);
    for (to, q) in panel[size..].chunks_exact_mut(size).zip(&step.below) {
        copy_block(&a[q * m * n + first..], n, to, m, m);
    }
    for k in 0..m {
        let (upper, lower) = panel.split_at_mut((k + 1) * m);
        let pivot = &mut upper[k * m..];
        let mut largest = T::default();
        for row in lower.chunks_exact(m) {
            largest = larger(largest, row[k]);
        }
        if !pivot[k].map(f64::abs).all(largest, serves) {
            return false;
        }
        pivot[k] = pivot[k].map(|x| 1.0 / x);
        for row in lower.chunks_exact_mut(m) {
            let factor = row[k] * pivot[k];
            row[k] = factor;
            subtract(factor, &pivot[k + 1..m], &mut row[k + 1..]);
        }
    }
    copy_block(&panel[..size], m, &mut a[first * n + first..], n, m);
    for (from, q) in panel[size..].chunks_exact(size).zip(&step.below) {
        copy_block(from, m, &mut a[q * m * n + first..], n, m);
    }
    true
}

/// Back substitution after [`blocks`], for all columns of `b`.
#[inline(always)]
fn back_in_blocks<T: Lane>(a: &[T], n: usize, b: &mut [T], columns: usize, shape: &Shape, m: usize) {
    for (p, step) in shape.steps.iter().enumerate().rev() {
        let first = p * m;
        let (head, tail) = b.split_at_mut((first + m) * columns);
        let rows = &mut head[first * columns..];
        let lines = &a[first * n..(first + m) * n];
        for q in &step.right {
            let below = &tail[(q * m - first - m) * columns..(q * m - first) * columns];
            for range in &shape.steps[*q].solved {
                let (c, wide) = (range.start, range.len());
                tile::subtract(rows, columns, lines, n, below, columns, [m, m, wide], [c, q * m, c]);
            }
        }
        if step.own {
            for range in &step.solved {
                tile::backward(rows, columns, range.start, lines, n, first, m, range.len());
            }
        }
    }
}

/// Eliminates from column `from` on, with row exchanges where needed, and substitutes back.
#[inline(never)]
fn whole<T: Lane>(
    a: &mut [T],
    n: usize,
    pivots: &mut [u32],
    b: &mut [T],
    columns: usize,
    from: usize,
) -> Result<(), Singular> {
    for k in from..n {
        pivot(a, n, pivots, b, columns, k)?;
        let inverse = a[k * n + k];
        let (upper, lower) = a.split_at_mut((k + 1) * n);
        let (row_k, right_k) = (&upper[k * n + k + 1..], &b[k * columns..(k + 1) * columns].to_vec());
        for (i, row) in lower.chunks_exact_mut(n).enumerate() {
            let factor = row[k] * inverse;
            row[k] = factor;
            subtract(factor, row_k, &mut row[k + 1..]);
            let right = (k + 1 + i) * columns;
            subtract(factor, right_k, &mut b[right..right + columns]);
        }
    }
    for k in (0..n).rev() {
        let (head, tail) = b.split_at_mut((k + 1) * columns);
        let row = &mut head[k * columns..];
        for (i, below) in tail.chunks_exact(columns.max(1)).enumerate() {
            subtract(a[k * n + k + 1 + i], below, row);
        }
        row.iter_mut().for_each(|x| *x = *x * a[k * n + k]);
    }
    Ok(())
}

/// Eliminates a large matrix like [`whole`], mostly by products of panels; returns true if rows were exchanged.
#[inline(always)]
fn panels<T: Lane>(
    a: &mut [T],
    n: usize,
    pivots: &mut [u32],
    b: &mut [T],
    columns: usize,
    from: usize,
    left: &mut Vec<T>,
) -> Result<bool, Singular> {
    let mut exchanged = false;
    for first in (from..n).step_by(PANEL) {
        let end = (first + PANEL).min(n);
        for k in first..end {
            exchanged |= pivot(a, n, pivots, b, columns, k)?;
            let inverse = a[k * n + k];
            let (upper, lower) = a.split_at_mut((k + 1) * n);
            let row_k = &upper[k * n + k + 1..k * n + end];
            for row in lower.chunks_exact_mut(n) {
                // Many entries vanish, because components do not depend on each other.
                if row[k].lanes().iter().all(|x| *x == 0.0) {
                    continue;
                }
                let factor = row[k] * inverse;
                row[k] = factor;
                subtract(factor, row_k, &mut row[k + 1..end]);
            }
        }
        update(a, n, b, columns, [first, end], left);
    }
    back(a, n, b, columns, left);
    Ok(exchanged)
}

/// Chooses the pivot of column k in every lane and stores its inverse; returns true if rows were exchanged.
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
    let own = &mut pivots[k * T::COUNT..(k + 1) * T::COUNT];
    own.fill(k as u32);
    let wanting = !diagonal.all(largest, serves);
    if wanting {
        for l in 0..T::COUNT {
            if !serves(diagonal.lanes()[l], largest.lanes()[l]) {
                own[l] = exchange(a, n, b, columns, k, l)?;
            }
        }
    }
    a[k * n + k] = a[k * n + k].map(|x| 1.0 / x);
    Ok(wanting)
}

/// Updates after a panel: its rows to the right of it, then everything below.
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

/// Back substitution for all columns of `b`.
#[inline(always)]
fn back<T: Lane>(a: &[T], n: usize, b: &mut [T], columns: usize, left: &mut Vec<T>) {
    for first in (0..n).step_by(PANEL).rev() {
        let end = (first + PANEL).min(n);
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

/// Solves for a single right-hand side `[n]` in place.
#[inline(always)]
pub fn solve<T: Lane>(a: &[T], n: usize, pivots: &[u32], exchanged: bool, b: &mut [T], shape: &Shape) {
    if exchanged {
        for k in 0..n {
            swap_lanes(b, k, &pivots[k * T::COUNT..(k + 1) * T::COUNT]);
        }
    }
    if exchanged || shape.is_plain() {
        for k in 1..n {
            b[k] = b[k] - dot(&a[k * n..k * n + k], &b[..k]);
        }
        for k in (0..n).rev() {
            b[k] = (b[k] - dot(&a[k * n + k + 1..(k + 1) * n], &b[k + 1..n])) * a[k * n + k];
        }
        return;
    }
    match shape.nodes {
        4 => solve_in_blocks(a, n, b, shape, 4),
        m => solve_in_blocks(a, n, b, shape, m),
    }
}

#[inline(always)]
fn solve_in_blocks<T: Lane>(a: &[T], n: usize, b: &mut [T], shape: &Shape, m: usize) {
    for (p, step) in shape.steps.iter().enumerate() {
        let lines = &a[p * m * n..(p + 1) * m * n];
        let (done, rest) = b.split_at_mut(p * m);
        let own = &mut rest[..m];
        for q in &step.left {
            tile::subtract_image(own, lines, n, q * m, &done[q * m..(q + 1) * m], m);
        }
        if step.own {
            for k in 1..m {
                for i in 0..k {
                    own[k] = own[k] - lines[k * n + p * m + i] * own[i];
                }
            }
        }
    }
    for (p, step) in shape.steps.iter().enumerate().rev() {
        let lines = &a[p * m * n..(p + 1) * m * n];
        let (head, done) = b.split_at_mut((p + 1) * m);
        let own = &mut head[p * m..];
        for q in &step.right {
            tile::subtract_image(own, lines, n, q * m, &done[(q - p - 1) * m..(q - p) * m], m);
        }
        if step.own {
            for k in (0..m).rev() {
                let line = &lines[k * n + p * m..k * n + (p + 1) * m];
                for i in k + 1..m {
                    own[k] = own[k] - line[i] * own[i];
                }
                own[k] = own[k] * line[k];
            }
        }
    }
}

/// Solves for eight right-hand sides at once, `[n]`, with the factors of one matrix.
#[inline(always)]
pub fn solve_columns(a: &[f64], n: usize, pivots: &[u32], exchanged: bool, b: &mut [Eight], shape: &Shape) {
    if exchanged {
        (0..n).for_each(|k| b.swap(k, pivots[k] as usize));
    }
    if exchanged || shape.is_plain() {
        for k in 1..n {
            b[k] = image(b[k], &a[k * n..k * n + k], &b[..k]);
        }
        for k in (0..n).rev() {
            b[k] = image(b[k], &a[k * n + k + 1..(k + 1) * n], &b[k + 1..n]) * Eight::splat(a[k * n + k]);
        }
        return;
    }
    let m = shape.nodes;
    for (p, step) in shape.steps.iter().enumerate() {
        for k in p * m..(p + 1) * m {
            let line = &a[k * n..(k + 1) * n];
            for q in step.left.iter().map(|q| q * m) {
                b[k] = image(b[k], &line[q..q + m], &b[q..q + m]);
            }
            if step.own {
                b[k] = image(b[k], &line[p * m..k], &b[p * m..k]);
            }
        }
    }
    for (p, step) in shape.steps.iter().enumerate().rev() {
        for k in (p * m..(p + 1) * m).rev() {
            let line = &a[k * n..(k + 1) * n];
            for q in step.right.iter().map(|q| q * m) {
                b[k] = image(b[k], &line[q..q + m], &b[q..q + m]);
            }
            if step.own {
                b[k] = image(b[k], &line[k + 1..(p + 1) * m], &b[k + 1..(p + 1) * m]) * Eight::splat(line[k]);
            }
        }
    }
}

/// y - a · x.
#[inline(always)]
fn image(y: Eight, a: &[f64], x: &[Eight]) -> Eight {
    a.iter().zip(x).fold(y, |sum, (a, x)| sum - Eight::splat(*a) * *x)
}

/// Solves aᵀ x = b for a single right-hand side `[n]` in place.
#[inline(always)]
pub fn solve_transposed<T: Lane>(a: &[T], n: usize, pivots: &[u32], exchanged: bool, b: &mut [T], shape: &Shape) {
    if exchanged || shape.is_plain() {
        for k in 0..n {
            b[k] = b[k] * a[k * n + k];
            let (head, tail) = b.split_at_mut(k + 1);
            subtract(head[k], &a[k * n + k + 1..(k + 1) * n], tail);
        }
        for k in (1..n).rev() {
            let (head, tail) = b.split_at_mut(k);
            subtract(tail[0], &a[k * n..k * n + k], head);
        }
    } else {
        transposed_in_blocks(a, n, b, shape);
    }
    if exchanged {
        for k in (0..n).rev() {
            swap_lanes(b, k, &pivots[k * T::COUNT..(k + 1) * T::COUNT]);
        }
    }
}

#[inline(always)]
fn transposed_in_blocks<T: Lane>(a: &[T], n: usize, b: &mut [T], shape: &Shape) {
    let m = shape.nodes;
    for (p, step) in shape.steps.iter().enumerate() {
        for k in p * m..(p + 1) * m {
            let line = &a[k * n..(k + 1) * n];
            let (head, tail) = b.split_at_mut(k + 1);
            if step.own {
                head[k] = head[k] * line[k];
                subtract(head[k], &line[k + 1..(p + 1) * m], &mut tail[..(p + 1) * m - k - 1]);
            }
            for q in &step.right {
                subtract(head[k], &line[q * m..(q + 1) * m], &mut tail[q * m - k - 1..(q + 1) * m - k - 1]);
            }
        }
    }
    for (p, step) in shape.steps.iter().enumerate().rev() {
        for k in (p * m..(p + 1) * m).rev() {
            let line = &a[k * n..(k + 1) * n];
            let (head, tail) = b.split_at_mut(k);
            if step.own {
                subtract(tail[0], &line[p * m..k], &mut head[p * m..k]);
            }
            for q in &step.left {
                subtract(tail[0], &line[q * m..(q + 1) * m], &mut head[q * m..(q + 1) * m]);
            }
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
    use super::*;

    /// Compares eight matrices, every second of which has its large entries off the diagonal, with the scalar
    /// factorisation.
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
        let shape = Shape::new(&vec![true; n * n], &vec![true; n * n], 1, columns);
        assert!(factorise(&mut a, n, &mut pivots, &mut b, columns, &shape, shape.nodes, &mut Vec::new()).unwrap());
        solve(&a, n, &pivots, true, &mut one, &shape);
        solve_transposed(&a, n, &pivots, true, &mut turned, &shape);
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
        assert_eq!(
            factorise(
                &mut a,
                2,
                &mut [0; 16],
                &mut none,
                0,
                &Shape::new(&[true; 4], &[true; 4], 1, 0),
                1,
                &mut Vec::new()
            ),
            Err(Singular)
        );
    }
}
