//! Stability: eigenvalues of equilibria, Floquet multipliers of cycles.

mod explicit;
pub mod floquet;
pub mod neutral;
mod reduction;

use crate::linalg::periodic_schur;
use num_complex::Complex64;

/// Eigenvalues of the row-major n×n Jacobian `fx`, by decreasing modulus. `scales` `[n]` balances components of
/// different units. Returns NaN for every eigenvalue if the matrix is not finite.
pub fn eigenvalues(fx: &[f64], n: usize, scales: &[f64]) -> Vec<Complex64> {
    let balanced: Vec<f64> = (0..n * n).map(|k| fx[k] * scales[k % n] / scales[k / n]).collect();
    match periodic_schur::eigenvalues(&balanced, n) {
        Some(found) => found.into_iter().map(|e| e.value()).collect(),
        None => vec![Complex64::new(f64::NAN, f64::NAN); n],
    }
}
