//! Products of large dense matrices.
//!
//! The kernels of this module serve small blocks. From [`MANY`] components on, a general library multiplies faster.

use super::lane::{Eight, Lane};
use foldline_general::{Mat, MatMut, MatRef};

/// Number of components of a model from which on these products are used. Measured on chains of oscillators: with 20
/// components kernels for small blocks are faster by a quarter, with 40 slower by a tenth.
pub const MANY: usize = 32;

/// Number of random vectors.
pub const VECTORS: usize = Eight::COUNT;

/// C = A B for row-major matrices with individual strides, `[rows × columns]`, `[rows × depth]` and `[depth ×
/// columns]`.
pub fn multiply(c: (&mut [f64], usize), a: (&[f64], usize), b: (&[f64], usize), [rows, depth, columns]: [usize; 3]) {
    // Row-major storage is the column-major storage of the transpose: Cᵀ = Bᵀ Aᵀ.
    let to = MatMut::from_column_major_slice_with_stride_mut(c.0, columns, rows, c.1);
    let a = MatRef::from_column_major_slice_with_stride(a.0, depth, rows, a.1);
    let b = MatRef::from_column_major_slice_with_stride(b.0, columns, depth, b.1);
    foldline_general::multiply(to, b, a);
}

/// Reproducible random signs, by xorshift. Their covariance is the identity.
pub fn signs() -> impl FnMut() -> f64 {
    let mut state = 0x9e37_79b9_7f4a_7c15u64;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        if state >> 63 == 0 { 1.0 } else { -1.0 }
    }
}

/// Matrix with [`VECTORS`] columns of random signs.
pub fn random(rows: usize) -> Mat<f64> {
    let mut sign = signs();
    Mat::from_fn(rows, VECTORS, |_, _| sign())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_of_strided_blocks_agree_with_plain_loops() {
        let [rows, depth, columns] = [5, 7, 9];
        let number = |k: usize| ((k * k) as f64 * 0.37).sin();
        let (a, b): (Vec<f64>, Vec<f64>) = ((0..5 * 8).map(number).collect(), (0..7 * 12).map(number).collect());
        let mut plain = vec![9.0; rows * 11];
        let [mut lanes, left, right] = [&plain, &a, &b].map(|x| x.iter().map(|x| Eight([*x; 8])).collect::<Vec<_>>());
        Eight::multiply((&mut lanes, 11), (&left, 8), (&right, 12), [rows, depth, columns]);
        multiply((&mut plain, 11), (&a, 8), (&b, 12), [rows, depth, columns]);
        for (k, found) in plain.iter().enumerate() {
            let (i, c) = (k / 11, k % 11);
            let product: f64 = (0..depth).map(|l| a[i * 8 + l] * b[(l * 12 + c) % b.len()]).sum();
            let expected = if c < columns { product } else { 9.0 };
            assert!((found - expected).abs() < 1e-14, "row {i}, column {c}");
            assert!((lanes[k].0[3] - expected).abs() < 1e-14, "row {i}, column {c}, in lanes");
        }
    }
}
