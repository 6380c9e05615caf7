//! Stability: eigenvalues of equilibria, Floquet multipliers of cycles.

mod explicit;
pub mod floquet;
mod reduction;

use crate::linalg::periodic_schur;
use num_complex::Complex64;

/// Eigenvalues of the row-major n×n Jacobian `fx`, by decreasing modulus. `scales` `[n]` balances components of
/// different units; what they leave is balanced by the sizes of rows and columns. Returns NaN for every eigenvalue if
/// the matrix is not finite.
pub fn eigenvalues(fx: &[f64], n: usize, scales: &[f64]) -> Vec<Complex64> {
    let scaled: Vec<f64> = (0..n * n).map(|k| fx[k] * scales[k % n] / scales[k / n]).collect();
    let mut found = Vec::with_capacity(n);
    for own in blocks(&scaled, n) {
        let size = own.len();
        let mut block: Vec<f64> = (0..size * size).map(|k| scaled[own[k / size] * n + own[k % size]]).collect();
        balance(&mut block, size);
        let Some(values) = periodic_schur::eigenvalues(&block, size) else {
            return vec![Complex64::new(f64::NAN, f64::NAN); n];
        };
        found.extend(values.into_iter().map(|e| e.value()));
    }
    found.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    found
}

/// Sets of states that act on each other, directly or through others. In an order of these sets the matrix `[n × n]` is
/// block triangular, so that its eigenvalues are those of the blocks, and those of slow states keep their digits beside
/// fast states that follow them.
pub fn blocks(a: &[f64], n: usize) -> Vec<Vec<usize>> {
    let mut reaches: Vec<bool> = (0..n * n).map(|k| a[k] != 0.0 || k % n == k / n).collect();
    for via in 0..n {
        for i in (0..n).filter(|i| *i != via) {
            if reaches[i * n + via] {
                (0..n).for_each(|j| reaches[i * n + j] |= reaches[via * n + j]);
            }
        }
    }
    let mutual = |i: usize, j: usize| reaches[i * n + j] && reaches[j * n + i];
    let first = |i: &usize| (0..*i).all(|j| !mutual(*i, j));
    (0..n).filter(first).map(|i| (i..n).filter(|j| mutual(i, *j)).collect()).collect()
}

/// Replaces a matrix `[n × n]` by D⁻¹ A D, with a diagonal D of powers of two such that each row and the column with its
/// number have nearly the same norm (james2014, algorithm 3). Rounding errors of eigenvalues are relative to the norm,
/// which is far above the eigenvalues in second-order systems of high frequencies: -ω² beside 1.
fn balance(a: &mut [f64], n: usize) {
    /// Decrease of the sum of the two norms for which a scaling is worth it.
    const WORTH: f64 = 0.95;
    /// Number of sweeps, of which a few suffice; a bound for matrices with rows that are nearly zero.
    const SWEEPS: usize = 50;
    if a.iter().any(|x| !x.is_finite()) {
        return;
    }
    let norm = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |sum: f64, x| sum.hypot(x));
    for _ in 0..SWEEPS {
        let mut done = true;
        for i in 0..n {
            let column = norm(&mut (0..n).map(|j| a[j * n + i]));
            let row = norm(&mut (0..n).map(|j| a[i * n + j]));
            if column == 0.0 || row == 0.0 {
                continue;
            }
            let factor = (0.5 * (row / column).log2()).round().exp2();
            if !factor.is_normal() || column * factor + row / factor >= WORTH * (column + row) {
                continue;
            }
            (0..n).for_each(|j| a[j * n + i] *= factor);
            (0..n).for_each(|j| a[i * n + j] /= factor);
            done = false;
        }
        if done {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_that_follow_others_do_not_disturb_their_eigenvalues() {
        // x' = mu x - y, y' = x + mu y, z' = -(z - x)/eps, w' = z - w: three blocks.
        let (mu, rate) = (1e-12, 1e12);
        let fx = [mu, -1.0, 0.0, 0.0, 1.0, mu, 0.0, 0.0, rate, 0.0, -rate, 0.0, 0.0, 0.0, 1.0, -1.0];
        assert_eq!(blocks(&fx, 4), [vec![0, 1], vec![2], vec![3]]);
        let found = eigenvalues(&fx, 4, &[1.0; 4]);
        assert!((found[0] + rate).norm() < 1e-14 * rate, "{found:?}");
        let slow: Vec<_> = found.iter().filter(|z| z.im != 0.0).collect();
        assert!(slow.len() == 2 && slow.iter().all(|z| (z.re - mu).abs() < 1e-15), "{found:?}");
    }

    #[test]
    fn a_slow_growth_rate_survives_beside_a_fast_mode() {
        // x'' = 2 mu x' - x and y'' = -w² (y - 0.3 x) - c y' have the growth rate mu exactly.
        let (mu, w, c) = (1e-6, 1e8, 0.01);
        let fx = [0.0, 1.0, 0.0, 0.0, -1.0, 2.0 * mu, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.3 * w * w, 0.0, -w * w, -c];
        let found = eigenvalues(&fx, 4, &[1.0; 4]);
        let slow: Vec<_> = found.iter().filter(|z| z.norm() < 2.0).collect();
        assert_eq!(slow.len(), 2);
        assert!(slow.iter().all(|z| (z.re - mu).abs() < 1e-12), "{found:?}");
    }
}
