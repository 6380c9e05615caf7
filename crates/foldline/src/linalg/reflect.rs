//! Householder triangularisation of a tall block, with right-hand columns carried along, in every lane.

use super::lane::{Lane, subtract};

/// Triangularises the first `columns` columns of the row-major `rows × width` matrix `a` in place by Householder
/// reflections applied to every column; entries below the diagonal of those columns become zero. The reflectors are stored
/// in `v` (`[columns × rows]`, one unit-scaled vector per column, H = 1 - v vᵀ).
#[inline(always)]
pub fn triangularise<T: Lane>(a: &mut [T], rows: usize, width: usize, columns: usize, v: &mut [T]) {
    for k in 0..columns.min(rows) {
        let reflector = &mut v[k * rows..(k + 1) * rows];
        reflector[..k].fill(T::default());
        let mut norm2 = T::default();
        for i in k..rows {
            let x = a[i * width + k];
            reflector[i] = x;
            norm2 = norm2 + x * x;
        }
        // A column that vanishes, or is not finite, is left alone.
        let alpha = norm2.zip(reflector[k], |s, x| if x > 0.0 { -s.sqrt() } else { s.sqrt() });
        let beta = norm2 - alpha * reflector[k];
        reflector[k] = reflector[k] - alpha;
        let scale = beta.map(|b| if b > 0.0 && b < f64::INFINITY { 1.0 / b.sqrt() } else { 0.0 });
        reflector[k..].iter_mut().for_each(|x| *x = *x * scale);
        // Columns in groups whose sums stay in registers.
        let (v, block) = (&reflector[k..], &mut a[k * width..rows * width]);
        let mut c = k;
        while c < width {
            c += match width - c {
                8.. => apply_group::<T, 8>(v, block, width, c),
                4.. => apply_group::<T, 4>(v, block, width, c),
                2.. => apply_group::<T, 2>(v, block, width, c),
                _ => apply_group::<T, 1>(v, block, width, c),
            };
        }
        for row in block[width..].chunks_exact_mut(width) {
            row[k] = T::default();
        }
    }
}

/// Applies 1 - v vᵀ to C columns from `c` on; returns C.
#[inline(always)]
fn apply_group<T: Lane, const C: usize>(v: &[T], a: &mut [T], width: usize, c: usize) -> usize {
    let mut sums = [T::default(); C];
    for (v, row) in v.iter().zip(a.chunks_exact(width)) {
        let row = &row[c..c + C];
        for k in 0..C {
            sums[k] = sums[k] + *v * row[k];
        }
    }
    for (v, row) in v.iter().zip(a.chunks_exact_mut(width)) {
        let row = &mut row[c..c + C];
        for k in 0..C {
            row[k] = row[k] - *v * sums[k];
        }
    }
    C
}

/// Applies the stored reflections, `columns` of them, in order to the vector `b`.
#[inline(always)]
pub fn apply<T: Lane>(v: &[T], columns: usize, b: &mut [T]) {
    for (k, reflector) in v.chunks_exact(b.len()).take(columns).enumerate() {
        apply_one(&reflector[k..], &mut b[k..]);
    }
}

/// Applies the stored reflections in the opposite order: the inverse, and the transpose, of [`apply`].
#[inline(always)]
pub fn apply_reversed<T: Lane>(v: &[T], columns: usize, b: &mut [T]) {
    for (k, reflector) in v.chunks_exact(b.len()).take(columns).enumerate().rev() {
        apply_one(&reflector[k..], &mut b[k..]);
    }
}

#[inline(always)]
fn apply_one<T: Lane>(v: &[T], b: &mut [T]) {
    let sum = super::lane::dot(v, b);
    subtract(sum, v, b);
}

#[cfg(test)]
mod tests {
    use super::super::lane::Eight;
    use super::*;

    #[test]
    fn the_product_of_reflections_is_orthogonal_and_makes_the_block_triangular() {
        let (rows, width, columns) = (6, 8, 3);
        let entry = |l: usize, k: usize| if l == 3 && k % width == 1 { 0.0 } else { ((k * k + l + 1) as f64).sin() };
        let original: Vec<Eight> = (0..rows * width).map(|k| Eight(std::array::from_fn(|l| entry(l, k)))).collect();
        let mut a = original.clone();
        let mut v = vec![Eight::default(); columns * rows];
        triangularise(&mut a, rows, width, columns, &mut v);
        for c in 0..width {
            let mut column: Vec<Eight> = (0..rows).map(|i| original[i * width + c]).collect();
            apply(&v, columns, &mut column);
            for l in 0..8 {
                for i in 0..rows {
                    assert!((column[i].0[l] - a[i * width + c].0[l]).abs() < 1e-14);
                    assert!(i <= c || c >= columns || a[i * width + c].0[l] == 0.0);
                }
                let size = |m: &[Eight]| (0..rows).map(|i| m[i * width + c].0[l].powi(2)).sum::<f64>();
                assert!((size(&original) - size(&a)).abs() < 1e-13);
            }
            apply_reversed(&v, columns, &mut column);
            for i in 0..rows {
                assert!((0..8).all(|l| (column[i].0[l] - original[i * width + c].0[l]).abs() < 1e-14));
            }
        }
    }
}
