//! Products of small dense matrices, in tiles whose sums stay in registers.

use super::lane::Lane;

/// Y -= A B for row-major Y `[rows × stride]` (columns `from..to` of it), A `[rows × depth]` and B `[depth × stride]` (the same
/// columns).
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

/// Y -= A B for blocks of row-major matrices with strides of their own: rows, depth and columns in `size`, first columns of the
/// blocks of Y, A and B in `at`.
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

/// One tile; returns its columns.
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
    let lines: [&[T]; R] = std::array::from_fn(|r| &a[r * a_stride..r * a_stride + depth]);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_in_tiles_is_the_plain_one() {
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
