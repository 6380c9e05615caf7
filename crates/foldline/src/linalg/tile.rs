//! Products of small dense matrices, in tiles whose sums stay in registers.

use super::lane::Lane;

/// Repeats a call for C columns from `c` on.
macro_rules! in_columns {
    ($columns:expr, $c:ident, $C:ident, $call:expr) => {{
        let mut $c = 0;
        while $c < $columns {
            $c += match $columns - $c {
                4.. => {
                    const $C: usize = 4;
                    $call;
                    $C
                }
                3 => {
                    const $C: usize = 3;
                    $call;
                    $C
                }
                2 => {
                    const $C: usize = 2;
                    $call;
                    $C
                }
                _ => {
                    const $C: usize = 1;
                    $call;
                    $C
                }
            };
        }
    }};
}

/// Y -= A B for row-major Y `[rows × stride]` (its columns `from..to`), A `[rows × depth]` and B `[depth × stride]`
/// (the same columns).
#[inline(always)]
pub fn subtract_product<T: Lane>(y: &mut [T], a: &[T], b: &[T], stride: usize, depth: usize, [from, to]: [usize; 2]) {
    const R: usize = 4;
    const C: usize = 8;
    let rows = a.len() / depth.max(1);
    let mut i = 0;
    while i < rows {
        let whole = i + R <= rows;
        let (own, left) = (&mut y[i * stride..], &a[i * depth..]);
        let mut c = from;
        while c < to {
            let wide = c + C <= to;
            match (whole, wide) {
                (true, true) => tile::<T, R, C>(own, left, b, stride, depth, c),
                (true, false) => tile::<T, R, 1>(own, left, b, stride, depth, c),
                (false, true) => tile::<T, 1, C>(own, left, b, stride, depth, c),
                (false, false) => tile::<T, 1, 1>(own, left, b, stride, depth, c),
            }
            c += if wide { C } else { 1 };
        }
        i += if whole { R } else { 1 };
    }
}

#[inline(always)]
fn tile<T: Lane, const R: usize, const C: usize>(y: &mut [T], a: &[T], b: &[T], stride: usize, depth: usize, c: usize) {
    let mut sums = [[T::default(); C]; R];
    for r in 0..R {
        sums[r].copy_from_slice(&y[r * stride + c..r * stride + c + C]);
    }
    for (k, row) in b.chunks_exact(stride).take(depth).enumerate() {
        let row = &row[c..c + C];
        for r in 0..R {
            let factor = a[r * depth + k];
            for j in 0..C {
                sums[r][j] = sums[r][j] - factor * row[j];
            }
        }
    }
    for r in 0..R {
        y[r * stride + c..r * stride + c + C].copy_from_slice(&sums[r]);
    }
}

/// Y -= A B for blocks of row-major matrices with individual strides: rows, depth and columns in `size`, first columns
/// of the blocks of Y, A and B in `at`.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "three matrices with a stride each")]
pub fn subtract<T: Lane>(
    y: &mut [T],
    y_stride: usize,
    a: &[T],
    a_stride: usize,
    b: &[T],
    b_stride: usize,
    [rows, depth, columns]: [usize; 3],
    [y_at, a_at, b_at]: [usize; 3],
) {
    const C: usize = 4;
    if T::COUNT > 1 && depth == 4 {
        in_columns!(columns, c, C, {
            in_rows::<T, 4, C>(y, y_stride, y_at + c, a, a_stride, a_at, b, b_stride, b_at + c, rows)
        });
        return;
    }
    let mut i = 0;
    while i < rows {
        let whole = i + 4 <= rows;
        let (own, left) = (&mut y[i * y_stride + y_at..], &a[i * a_stride + a_at..]);
        let mut c = 0;
        while c < columns {
            let (own, right) = (&mut own[c..], &b[b_at + c..]);
            c += match (whole, columns - c) {
                (true, C..) => strided::<T, 4, C>(own, y_stride, left, a_stride, right, b_stride, depth),
                (true, 2..) => strided::<T, 4, 2>(own, y_stride, left, a_stride, right, b_stride, depth),
                (true, _) => strided::<T, 4, 1>(own, y_stride, left, a_stride, right, b_stride, depth),
                (false, C..) => strided::<T, 1, C>(own, y_stride, left, a_stride, right, b_stride, depth),
                (false, _) => strided::<T, 1, 1>(own, y_stride, left, a_stride, right, b_stride, depth),
            };
        }
        i += if whole { 4 } else { 1 };
    }
}

/// Array of C elements from `at` on.
#[inline(always)]
pub fn piece<T, const C: usize>(x: &[T], at: usize) -> &[T; C] {
    &x[at..at + C].as_chunks().0[0]
}

/// Mutable array of C elements from `at` on.
#[inline(always)]
pub fn piece_mut<T, const C: usize>(x: &mut [T], at: usize) -> &mut [T; C] {
    &mut x[at..at + C].as_chunks_mut().0[0]
}

/// Subtracts the product for C columns, row by row.
#[inline(always)]
fn in_rows<T: Lane, const M: usize, const C: usize>(
    y: &mut [T],
    y_stride: usize,
    y_at: usize,
    a: &[T],
    a_stride: usize,
    a_at: usize,
    b: &[T],
    b_stride: usize,
    b_at: usize,
    rows: usize,
) {
    // Without `from_fn`, which can become a separate function, compiled without the vector instructions.
    let mut lines: [&[T; C]; M] = [piece(b, b_at); M];
    for k in 1..M {
        lines[k] = piece(b, k * b_stride + b_at);
    }
    for r in 0..rows {
        let factors: &[T; M] = piece(a, r * a_stride + a_at);
        let own: &mut [T; C] = piece_mut(y, r * y_stride + y_at);
        let mut sums = *own;
        for k in 0..M {
            for j in 0..C {
                sums[j] = sums[j] - factors[k] * lines[k][j];
            }
        }
        *own = sums;
    }
}

/// y -= A b for the rows of A, given m of its columns from `at` on.
#[inline(always)]
pub fn subtract_image<T: Lane>(y: &mut [T], a: &[T], stride: usize, at: usize, b: &[T], m: usize) {
    for (k, y) in y.iter_mut().enumerate() {
        let line = &a[k * stride + at..k * stride + at + m];
        let mut sum = *y;
        for k in 0..m {
            sum = sum - line[k] * b[k];
        }
        *y = sum;
    }
}

/// y -= Σ_k f_k b_k for the rows b_k of B, their columns from `at` on.
#[inline(always)]
pub fn subtract_combination<T: Lane>(y: &mut [T], factors: &[T], b: &[T], stride: usize, at: usize) {
    let columns = y.len();
    in_columns!(columns, c, C, {
        let own: &mut [T; C] = piece_mut(y, c);
        let mut sums = *own;
        for (k, f) in factors.iter().enumerate() {
            let row: &[T; C] = piece(b, k * stride + at + c);
            for j in 0..C {
                sums[j] = sums[j] - *f * row[j];
            }
        }
        *own = sums;
    });
}

/// Subtracts the product for one tile; returns C, its number of columns.
#[inline(always)]
fn strided<T: Lane, const R: usize, const C: usize>(
    y: &mut [T],
    y_stride: usize,
    a: &[T],
    a_stride: usize,
    b: &[T],
    b_stride: usize,
    depth: usize,
) -> usize {
    let mut sums = [[T::default(); C]; R];
    for r in 0..R {
        sums[r].copy_from_slice(&y[r * y_stride..r * y_stride + C]);
    }
    let mut lines = [&a[..depth]; R];
    for r in 1..R {
        lines[r] = &a[r * a_stride..r * a_stride + depth];
    }
    for k in 0..depth {
        let row = &b[k * b_stride..k * b_stride + C];
        for r in 0..R {
            let factor = lines[r][k];
            for j in 0..C {
                sums[r][j] = sums[r][j] - factor * row[j];
            }
        }
    }
    for r in 0..R {
        y[r * y_stride..r * y_stride + C].copy_from_slice(&sums[r]);
    }
    C
}

/// Y = L⁻¹ Y for columns `at..at + columns` of m rows of Y, L being the unit lower triangle of the m×m matrix `l`.
#[inline(always)]
pub fn forward<T: Lane>(y: &mut [T], stride: usize, at: usize, l: &[T], m: usize, columns: usize) {
    in_columns!(columns, c, C, forward_in::<T, C>(y, stride, at + c, l, m));
}

#[inline(always)]
fn forward_in<T: Lane, const C: usize>(y: &mut [T], stride: usize, at: usize, l: &[T], m: usize) {
    for k in 1..m {
        let (before, own) = y.split_at_mut(k * stride);
        let own: &mut [T; C] = piece_mut(own, at);
        let mut sums = *own;
        for (i, l) in l[k * m..k * m + k].iter().enumerate() {
            let row: &[T; C] = piece(before, i * stride + at);
            for j in 0..C {
                sums[j] = sums[j] - *l * row[j];
            }
        }
        *own = sums;
    }
}

/// Y = U⁻¹ Y for columns `at..at + columns` of m rows of Y, U being the upper triangle of `u` from column `first` on,
/// with its diagonal inverted.
#[inline(always)]
pub fn backward<T: Lane>(
    y: &mut [T],
    stride: usize,
    at: usize,
    u: &[T],
    u_stride: usize,
    first: usize,
    m: usize,
    columns: usize,
) {
    in_columns!(columns, c, C, backward_in::<T, C>(y, stride, at + c, u, u_stride, first, m));
}

#[inline(always)]
fn backward_in<T: Lane, const C: usize>(
    y: &mut [T],
    stride: usize,
    at: usize,
    u: &[T],
    u_stride: usize,
    first: usize,
    m: usize,
) {
    for k in (0..m).rev() {
        let (head, after) = y.split_at_mut((k + 1) * stride);
        let own: &mut [T; C] = piece_mut(head, k * stride + at);
        let line = &u[k * u_stride + first..k * u_stride + first + m];
        let mut sums = *own;
        for (i, u) in line[k + 1..].iter().enumerate() {
            let row: &[T; C] = piece(after, i * stride + at);
            for j in 0..C {
                sums[j] = sums[j] - *u * row[j];
            }
        }
        for j in 0..C {
            own[j] = sums[j] * line[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::lane::Eight;
    use super::*;

    /// Expected entry, from the other entries of its column, its row, column and lane.
    type Expected<'e> = &'e dyn Fn(&dyn Fn(usize) -> f64, usize, usize, usize) -> f64;

    fn numbers<T: Lane>(count: usize, shift: f64) -> Vec<T> {
        (0..count).map(|k| T::each(|lane| ((k * T::COUNT + lane) as f64 + shift).sin())).collect()
    }

    /// Compares every lane of row-major matrices with plain loops; other columns must not change.
    fn blocks_agree<T: Lane>(m: usize, at: usize, columns: usize, stride: usize) {
        let what = format!("{m} rows, columns {at} to {} of {stride}, {} lanes", at + columns, T::COUNT);
        let (start, a, b) = (numbers::<T>(m * stride, 0.3), numbers::<T>(m * m, 0.7), numbers::<T>(m * stride, 0.9));
        let one = |x: &[T], k: usize, lane: usize| x[k].lanes()[lane];
        let check = |found: &[T], expected: Expected| {
            for (k, lane) in (0..m * stride).flat_map(|k| (0..T::COUNT).map(move |lane| (k, lane))) {
                let (i, c) = (k / stride, k % stride);
                let now = |row: usize| one(found, row * stride + c, lane);
                let wanted = match (at..at + columns).contains(&c) {
                    true => expected(&now, i, c, lane),
                    false => one(&start, k, lane),
                };
                assert!((one(found, k, lane) - wanted).abs() < 1e-13, "{what}: row {i}, column {c}, lane {lane}");
            }
        };
        let before = |i: usize, c: usize, lane: usize| one(&start, i * stride + c, lane);
        let sum = |range: std::ops::Range<usize>, term: &dyn Fn(usize) -> f64| range.map(term).sum::<f64>();

        let mut y = start.clone();
        subtract(&mut y, stride, &a, m, &b, stride, [m, m, columns], [at, 0, at]);
        check(&y, &|_, i, c, lane| {
            before(i, c, lane) - sum(0..m, &|k| one(&a, i * m + k, lane) * one(&b, k * stride + c, lane))
        });
        let mut y = start.clone();
        forward(&mut y, stride, at, &a, m, columns);
        check(&y, &|now, i, c, lane| before(i, c, lane) - sum(0..i, &|k| one(&a, i * m + k, lane) * now(k)));
        let mut y = start.clone();
        backward(&mut y, stride, at, &a, m, 0, m, columns);
        check(&y, &|now, i, c, lane| {
            (before(i, c, lane) - sum(i + 1..m, &|k| one(&a, i * m + k, lane) * now(k))) * one(&a, i * m + i, lane)
        });
        let mut y = start.clone();
        subtract_combination(&mut y[at..at + columns], &a[..m], &b, stride, at);
        check(&y, &|_, i, c, lane| {
            let taken = if i == 0 { sum(0..m, &|k| one(&a, k, lane) * one(&b, k * stride + c, lane)) } else { 0.0 };
            before(i, c, lane) - taken
        });
        let mut y = start[..m].to_vec();
        subtract_image(&mut y, &b, stride, at, &a[..columns], columns);
        for (i, lane) in (0..m).flat_map(|i| (0..T::COUNT).map(move |lane| (i, lane))) {
            let taken = sum(0..columns, &|k| one(&b, i * stride + at + k, lane) * one(&a, k, lane));
            assert!((one(&y, i, lane) - (one(&start, i, lane) - taken)).abs() < 1e-13, "{what}");
        }
    }

    #[test]
    fn blocks_of_every_width_agree_with_plain_loops() {
        for columns in 1..=9 {
            for (m, at) in [(4, 0), (4, 2), (3, 1), (5, 0)] {
                blocks_agree::<Eight>(m, at, columns, at + columns + 1);
                blocks_agree::<f64>(m, at, columns, at + columns + 1);
            }
        }
    }

    #[test]
    fn a_tiled_product_agrees_with_plain_loops() {
        for (rows, depth, stride, from, to) in [(9, 5, 21, 2, 21), (1, 1, 1, 0, 1), (4, 16, 8, 0, 8), (6, 3, 7, 3, 3)] {
            let number = |k: usize, s: f64| ((k as f64 + s) * 1.7).sin();
            let (a, b): (Vec<f64>, Vec<f64>) = (
                (0..rows * depth).map(|k| number(k, 0.1)).collect(),
                (0..depth * stride).map(|k| number(k, 0.4)).collect(),
            );
            let start: Vec<f64> = (0..rows * stride).map(|k| number(k, 0.8)).collect();
            let mut y = start.clone();
            subtract_product(&mut y, &a, &b, stride, depth, [from, to]);
            for (at, (y, start)) in y.iter().zip(&start).enumerate() {
                let (i, c) = (at / stride, at % stride);
                let product: f64 = (0..depth).map(|k| a[i * depth + k] * b[k * stride + c]).sum();
                let plain = if (from..to).contains(&c) { start - product } else { *start };
                assert!((y - plain).abs() < 1e-13);
            }
        }
    }
}
