//! Householder triangularisation of a tall block, with right-hand columns carried along, in every lane.

use super::lane::{Lane, dot, intact, subtract};
use super::tile::{piece, piece_mut};

/// Triangularises the first `columns` columns of the row-major `rows × width` matrix `a` in place by Householder
/// reflections applied to every column; entries below the diagonal of those columns become zero. The reflectors are
/// stored in `v` (`[columns × rows]`, one unit-scaled vector per column, H = 1 - v vᵀ).
#[inline(always)]
pub fn triangularise<T: Lane>(a: &mut [T], rows: usize, width: usize, columns: usize, v: &mut [T]) {
    // Groups of columns whose sums stay in registers; a group stays in the cache until all reflections are applied to
    // it.
    let mut c = 0;
    while c < width {
        c += match width - c {
            16.. if T::COUNT == 1 => group::<T, 16>(a, [rows, width, columns], c, v),
            8.. if T::COUNT == 1 => group::<T, 8>(a, [rows, width, columns], c, v),
            4.. => group::<T, 4>(a, [rows, width, columns], c, v),
            2.. => group::<T, 2>(a, [rows, width, columns], c, v),
            _ => group::<T, 1>(a, [rows, width, columns], c, v),
        };
    }
}

/// Applies the reflections of the preceding columns to C columns from `c` on, then computes and applies their own;
/// returns C.
#[inline(always)]
fn group<T: Lane, const C: usize>(a: &mut [T], [rows, width, columns]: [usize; 3], c: usize, v: &mut [T]) -> usize {
    let columns = columns.min(rows);
    // Two at a time if the sums fit into registers.
    let pairs = if T::COUNT == 1 { c.min(columns) / 2 } else { 0 };
    for (k, two) in v.chunks_exact(2 * rows).take(pairs).enumerate() {
        let (first, second) = two.split_at(rows);
        apply_two::<T, C>(&first[2 * k..], &second[2 * k..], &mut a[2 * k * width..], width, c);
    }
    for k in 2 * pairs..(c + C).min(columns) {
        let reflector = &mut v[k * rows..(k + 1) * rows];
        let block = &mut a[k * width..];
        if k >= c {
            reflector[..k].fill(T::default());
            reflection(&mut reflector[k..], block, width, k);
        }
        apply_group::<T, C>(&reflector[k..], block, width, c);
        if k >= c {
            (1..rows - k).for_each(|i| block[i * width + k] = T::default());
        }
    }
    C
}

/// Computes the reflection that annihilates column k below its first entry.
#[inline(always)]
fn reflection<T: Lane>(v: &mut [T], block: &[T], width: usize, k: usize) {
    let mut norm2 = T::default();
    for (i, v) in v.iter_mut().enumerate() {
        let x = block[i * width + k];
        *v = x;
        norm2 = norm2 + x * x;
    }
    // A zero or non-finite column is left alone.
    let alpha = norm2.zip(v[0], |s, x| if x > 0.0 { -s.sqrt() } else { s.sqrt() });
    let beta = norm2 - alpha * v[0];
    v[0] = v[0] - alpha;
    let scale = beta.map(|b| if b > 0.0 && b < f64::INFINITY { 1.0 / b.sqrt() } else { 0.0 });
    for x in v {
        intact::<T>();
        *x = *x * scale;
    }
}

/// Applies 1 - v vᵀ to C columns from `c` on.
#[inline(always)]
fn apply_group<T: Lane, const C: usize>(v: &[T], a: &mut [T], width: usize, c: usize) {
    let mut sums = [T::default(); C];
    for (i, v) in v.iter().enumerate() {
        let row: &[T; C] = piece(a, i * width + c);
        for k in 0..C {
            sums[k] = sums[k] + *v * row[k];
        }
    }
    for (i, v) in v.iter().enumerate() {
        let row: &mut [T; C] = piece_mut(a, i * width + c);
        // Completely computed before the store, so that several scalars become a vector.
        let mut left = [T::default(); C];
        for k in 0..C {
            left[k] = row[k] - *v * sums[k];
        }
        *row = left;
    }
}

/// Applies (1 - w wᵀ)(1 - v vᵀ) = 1 - v vᵀ - w (w - (w·v) v)ᵀ to C columns from `c` on.
#[inline(always)]
fn apply_two<T: Lane, const C: usize>(v: &[T], w: &[T], a: &mut [T], width: usize, c: usize) {
    let (mut first, mut second) = ([T::default(); C], [T::default(); C]);
    for (i, (v, w)) in v.iter().zip(w).enumerate() {
        let row: &[T; C] = piece(a, i * width + c);
        for k in 0..C {
            first[k] = first[k] + *v * row[k];
            second[k] = second[k] + *w * row[k];
        }
    }
    let common = dot(v, w);
    for k in 0..C {
        second[k] = second[k] - common * first[k];
    }
    for (i, (v, w)) in v.iter().zip(w).enumerate() {
        let (v, w, row): (T, T, &mut [T; C]) = (*v, *w, piece_mut(a, i * width + c));
        let mut left = [T::default(); C];
        for k in 0..C {
            left[k] = row[k] - v * first[k] - w * second[k];
        }
        *row = left;
    }
}

/// Applies the stored reflections, `columns` of them, in order to the vector `b`.
#[inline(always)]
pub fn apply<T: Lane>(v: &[T], columns: usize, b: &mut [T]) {
    for (k, reflector) in v.chunks_exact(b.len()).take(columns).enumerate() {
        apply_one(&reflector[k..], &mut b[k..]);
    }
}

/// Applies the stored reflections in reverse order: the inverse, and the transpose, of [`apply`].
#[inline(always)]
pub fn apply_reversed<T: Lane>(v: &[T], columns: usize, b: &mut [T]) {
    for (k, reflector) in v.chunks_exact(b.len()).take(columns).enumerate().rev() {
        apply_one(&reflector[k..], &mut b[k..]);
    }
}

#[inline(always)]
fn apply_one<T: Lane>(v: &[T], b: &mut [T]) {
    let sum = dot(v, b);
    subtract(sum, v, b);
}

#[cfg(test)]
mod tests {
    use super::super::lane::Eight;
    use super::*;

    #[test]
    fn the_product_of_reflections_is_orthogonal_and_makes_the_block_triangular() {
        for [rows, width, columns] in [[6, 8, 3], [6, 13, 6], [40, 61, 20]] {
            triangular::<Eight>(rows, width, columns);
            triangular::<f64>(rows, width, columns);
        }
    }

    fn triangular<T: Lane>(rows: usize, width: usize, columns: usize) {
        let entry = |l: usize, k: usize| if l == 3 && k % width == 1 { 0.0 } else { ((k * k + l + 1) as f64).sin() };
        let original: Vec<T> = (0..rows * width).map(|k| T::each(|l| entry(l, k))).collect();
        let mut a = original.clone();
        let mut v = vec![T::default(); columns * rows];
        triangularise(&mut a, rows, width, columns, &mut v);
        for c in 0..width {
            let mut column: Vec<T> = (0..rows).map(|i| original[i * width + c]).collect();
            apply(&v, columns, &mut column);
            for l in 0..T::COUNT {
                for i in 0..rows {
                    assert!((column[i].lanes()[l] - a[i * width + c].lanes()[l]).abs() < 1e-13);
                    assert!(i <= c || c >= columns || a[i * width + c].lanes()[l] == 0.0);
                }
                let size = |m: &[T]| (0..rows).map(|i| m[i * width + c].lanes()[l].powi(2)).sum::<f64>();
                assert!((size(&original) - size(&a)).abs() < 1e-13);
            }
            apply_reversed(&v, columns, &mut column);
            for i in 0..rows {
                assert!(
                    (0..T::COUNT).all(|l| (column[i].lanes()[l] - original[i * width + c].lanes()[l]).abs() < 1e-13)
                );
            }
        }
    }
}
