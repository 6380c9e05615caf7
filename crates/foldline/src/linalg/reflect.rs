//! Householder triangularisation of a tall block, with right-hand columns carried along.

/// Triangularises the first `columns` columns of the row-major `rows × width` matrix `a` in place by Householder
/// reflections applied to every column; entries below the diagonal of those columns become zero. The reflectors are stored
/// in `v` (`[columns × rows]`, one unit-scaled vector per column, H = 1 - v vᵀ).
pub fn triangularise(a: &mut [f64], rows: usize, width: usize, columns: usize, v: &mut [f64]) {
    for k in 0..columns.min(rows) {
        let reflector = &mut v[k * rows..(k + 1) * rows];
        reflector.fill(0.0);
        let mut norm2 = 0.0;
        for i in k..rows {
            let x = a[i * width + k];
            reflector[i] = x;
            norm2 += x * x;
        }
        let norm = norm2.sqrt();
        if norm == 0.0 || !norm.is_finite() {
            reflector.fill(0.0);
            continue;
        }
        let alpha = if reflector[k] > 0.0 { -norm } else { norm };
        reflector[k] -= alpha;
        let beta = norm2 - alpha * a[k * width + k];
        let scale = 1.0 / beta.sqrt();
        reflector[k..].iter_mut().for_each(|x| *x *= scale);
        apply_one(reflector, k, a, width, k);
        a[k * width + k] = alpha;
        for i in k + 1..rows {
            a[i * width + k] = 0.0;
        }
    }
}

/// Applies the stored reflections in order to the row-major `rows × width` matrix `b`.
pub fn apply(v: &[f64], rows: usize, columns: usize, b: &mut [f64], width: usize) {
    for k in 0..columns.min(rows) {
        apply_one(&v[k * rows..(k + 1) * rows], k, b, width, 0);
    }
}

/// Applies the stored reflections in the opposite order: the inverse, and the transpose, of [`apply`].
pub fn apply_reversed(v: &[f64], rows: usize, columns: usize, b: &mut [f64], width: usize) {
    for k in (0..columns.min(rows)).rev() {
        apply_one(&v[k * rows..(k + 1) * rows], k, b, width, 0);
    }
}

/// Applies 1 - v vᵀ to the columns `from..width`, sixteen at a time so that the sums stay in registers.
fn apply_one(reflector: &[f64], first: usize, a: &mut [f64], width: usize, from: usize) {
    let rows = reflector.len();
    let mut c = from;
    while c < width {
        let count = (width - c).min(16);
        let mut sums = [0.0; 16];
        for i in first..rows {
            let v = reflector[i];
            for (s, x) in sums.iter_mut().zip(&a[i * width + c..i * width + c + count]) {
                *s += v * x;
            }
        }
        for i in first..rows {
            let v = reflector[i];
            for (s, x) in sums.iter().zip(&mut a[i * width + c..i * width + c + count]) {
                *x -= v * s;
            }
        }
        c += count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_product_of_reflections_is_orthogonal_and_makes_the_block_triangular() {
        let (rows, width, columns) = (6, 5, 3);
        let original: Vec<f64> = (0..rows * width).map(|k| ((k * k + 1) as f64).sin()).collect();
        let mut a = original.clone();
        let mut v = vec![0.0; columns * rows];
        triangularise(&mut a, rows, width, columns, &mut v);
        for i in 0..rows {
            for j in 0..columns.min(i) {
                assert_eq!(a[i * width + j], 0.0);
            }
        }
        for c in 0..width {
            let before: f64 = (0..rows).map(|i| original[i * width + c].powi(2)).sum();
            let after: f64 = (0..rows).map(|i| a[i * width + c].powi(2)).sum();
            assert!((before - after).abs() < 1e-13);
        }
        let mut again = original.clone();
        apply(&v, rows, columns, &mut again, width);
        for (x, y) in again.iter().zip(&a) {
            assert!((x - y).abs() < 1e-14);
        }
        apply_reversed(&v, rows, columns, &mut again, width);
        for (x, y) in again.iter().zip(&original) {
            assert!((x - y).abs() < 1e-14);
        }
    }
}
