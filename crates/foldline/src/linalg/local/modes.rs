//! Modal coordinates of a constant matrix.

use foldline_general::{Factored, Mat, eigenvectors, product};
use num_complex::Complex64;

/// Largest product of the norms of V and V⁻¹, for columns of unit length: beyond it eigenvectors are nearly parallel, and
/// rounding in modal coordinates costs more than half of the digits.
const PARALLEL: f64 = 1e7;

/// One real eigenvalue or one pair.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    /// First of its coordinates.
    pub at: usize,
    /// Number of coordinates: 1, or 2 for a pair, z = y₁ + i y₂.
    pub size: usize,
    /// μ with z' = μ z.
    pub rate: Complex64,
}

/// x = V y such that x' = J x becomes z' = μ z for every mode.
#[derive(Clone, Debug)]
pub struct Modes {
    /// Every mode.
    pub list: Vec<Mode>,
    /// V, row-major `[n × n]`.
    pub from: Vec<f64>,
    /// V⁻¹, row-major `[n × n]`.
    pub to: Vec<f64>,
}

impl Modes {
    /// Modes of J, row-major `[n × n]`, for components of the given sizes `[n]`; `None` if the eigenvectors are nearly
    /// dependent.
    pub fn of(j: &[f64], sizes: &[f64]) -> Option<Modes> {
        let n = sizes.len();
        let scaled = Mat::from_fn(n, n, |i, k| j[i * n + k] * sizes[k] / sizes[i]);
        if !crate::linalg::all_finite(j) {
            return None;
        }
        let (values, vectors) = eigenvectors(scaled.as_ref())?;
        let mut list = Vec::new();
        let mut v = Mat::<f64>::zeros(n, n);
        let mut at = 0;
        for (k, value) in values.iter().enumerate().filter(|(_, value)| value.im >= 0.0) {
            let own: Vec<Complex64> = (0..n).map(|i| vectors[(i, k)]).collect();
            let size = if value.im > 0.0 { 2 } else { 1 };
            if at + size > n {
                return None;
            }
            // The phase at which real and imaginary parts are orthogonal.
            let square: Complex64 = own.iter().map(|z| z * z).sum();
            let turn = Complex64::from_polar(1.0, -0.5 * square.arg());
            let length = own.iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt();
            for (i, z) in own.iter().enumerate() {
                let z = z * turn / length;
                v[(i, at)] = z.re;
                if size == 2 {
                    v[(i, at + 1)] = z.im;
                }
            }
            list.push(Mode { at, size, rate: value.conj() });
            at += size;
        }
        if at != n {
            return None;
        }
        balance(&mut v, &list);
        let inverse = Factored::new(v.as_ref()).solve(&Mat::identity(n, n));
        let spread = foldline_general::norm(&v) * foldline_general::norm(&inverse);
        if spread.is_nan() || spread > PARALLEL * n as f64 {
            return None;
        }
        debug_assert!(foldline_general::norm(&(product(&v, &inverse) - Mat::<f64>::identity(n, n))) < 1e-6);
        let from = (0..n * n).map(|k| sizes[k / n] * v[(k / n, k % n)]).collect();
        let to = (0..n * n).map(|k| inverse[(k / n, k % n)] / sizes[k % n]).collect();
        Some(Modes { list, from, to })
    }
}

/// Scales every mode to unit length.
fn balance(v: &mut Mat<f64>, list: &[Mode]) {
    for mode in list {
        let columns = mode.at..mode.at + mode.size;
        let square: f64 = columns.clone().map(|c| (0..v.nrows()).map(|i| v[(i, c)] * v[(i, c)]).sum::<f64>()).sum();
        let length = square.sqrt();
        columns.for_each(|c| (0..v.nrows()).for_each(|i| v[(i, c)] /= length));
    }
}
