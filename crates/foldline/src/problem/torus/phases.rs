//! Trigonometric interpolation through equally spaced phases, and meshes in time and phase.
//!
//! **Equations.** Through K = 2N + 1 values at the phases l / K, with x in turns:
//!
//! ```text
//!   (1)  X(x) = Σ_l d(x - l / K) X_l,     d(x) = (1 + 2 Σ_{j=1}^N cos 2π j x) / K
//! ```
//!
//! **Source.** trefethen2000, §3.

use crate::diagram::Mesh;
use std::f64::consts::{PI, TAU};

/// d and its derivative at x turns, for K phases.
fn kernel(count: usize, x: f64) -> [f64; 2] {
    let (mut value, mut slope) = (1.0, 0.0);
    // Multiples by recurrence lose digits, and the number of terms is small.
    for j in 1..=count / 2 {
        let (sin, cos) = (TAU * (j as f64 * x).fract()).sin_cos();
        value += 2.0 * cos;
        slope -= 2.0 * TAU * j as f64 * sin;
    }
    [value / count as f64, slope / count as f64]
}

/// d and its derivative at k / K + x for k = 0 … K - 1: the matrices of a shift by x and of its rate have the entries
/// (k - l) mod K.
pub fn shift(count: usize, x: f64) -> [Vec<f64>; 2] {
    let all: Vec<[f64; 2]> = (0..count).map(|k| kernel(count, k as f64 / count as f64 + x)).collect();
    [0, 1].map(|part| all.iter().map(|pair| pair[part]).collect())
}

/// Product of the matrix of [`shift`] with values `[K][n]`.
pub fn shifted(table: &[f64], values: &[f64], n: usize, out: &mut [f64]) {
    let count = table.len();
    out.fill(0.0);
    for (k, own) in out.chunks_exact_mut(n).enumerate() {
        for (l, x) in values.chunks_exact(n).enumerate() {
            let weight = table[(k + count - l) % count];
            own.iter_mut().zip(x).for_each(|(to, x)| *to += weight * x);
        }
    }
}

/// Interpolates values `[K][n]` at phase x turns.
pub fn between(values: &[f64], n: usize, x: f64) -> Vec<f64> {
    let count = values.len() / n.max(1);
    let mut out = vec![0.0; n];
    for (l, own) in values.chunks_exact(n.max(1)).enumerate() {
        // d(x) = sin(K π x) / (K sin π x).
        let off = (x - l as f64 / count as f64).fract();
        let sin = (PI * off).sin();
        let weight = if sin.abs() < 1e-9 { 1.0 } else { (PI * (count as f64 * off)).sin() / (count as f64 * sin) };
        out.iter_mut().zip(own).for_each(|(to, v)| *to += weight * v);
    }
    out
}

/// Matrix `[to × from]` of the interpolation from one number of phases to another.
pub fn passage(from: usize, to: usize) -> Vec<f64> {
    let place = |k: usize| k as f64 / to as f64;
    // Frequencies that the smaller number cannot represent are left out, not folded onto others.
    let weight = |k: usize, l: usize| {
        let x = place(k) - l as f64 / from as f64;
        let terms = (1..=from.min(to) / 2).map(|j| 2.0 * (TAU * (j as f64 * x).fract()).cos()).sum::<f64>();
        (1.0 + terms) / from as f64
    };
    (0..to * from).map(|at| weight(at / from, at % from)).collect()
}

/// A mesh in time, from 0 to 1, followed by K phases as places from 1 to 2.
pub fn joined(time: &Mesh, count: usize) -> Mesh {
    time.iter().copied().chain((1..=count).map(|k| 1.0 + k as f64 / count as f64)).collect()
}

/// K of a mesh in time and phase; 0 for one in time alone.
pub fn count(mesh: &[f64]) -> usize {
    mesh.len() - mesh.partition_point(|t| *t <= 1.0)
}

/// The part in time of a mesh in time and phase.
pub fn in_time(mesh: &Mesh) -> Mesh {
    mesh[..mesh.len() - count(mesh)].into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(x: f64) -> f64 {
        0.3 + (TAU * x).cos() - 0.2 * (TAU * 3.0 * x).sin()
    }

    #[test]
    fn shifts_and_rates_are_exact_for_trigonometric_polynomials() {
        let values: Vec<f64> = (0..9).map(|k| wave(k as f64 / 9.0)).collect();
        let [table, rate] = shift(9, 0.137);
        let (mut moved, mut slope) = (vec![0.0; 9], vec![0.0; 9]);
        shifted(&table, &values, 1, &mut moved);
        shifted(&rate, &values, 1, &mut slope);
        for k in 0..9 {
            let x = k as f64 / 9.0 + 0.137;
            let exact = -TAU * (TAU * x).sin() - 0.6 * TAU * (TAU * 3.0 * x).cos();
            assert!((moved[k] - wave(x)).abs() < 1e-14 && (slope[k] - exact).abs() < 1e-12);
        }
        assert!((between(&values, 1, 0.71)[0] - wave(0.71)).abs() < 1e-14);
    }

    #[test]
    fn passages_keep_what_both_numbers_of_phases_represent() {
        let values: Vec<f64> = (0..11).map(|k| wave(k as f64 / 11.0)).collect();
        for to in [7, 23] {
            for (k, row) in passage(11, to).chunks_exact(11).enumerate() {
                let value: f64 = row.iter().zip(&values).map(|(w, v)| w * v).sum();
                assert!((value - wave(k as f64 / to as f64)).abs() < 1e-14);
            }
        }
        let mesh = joined(&vec![0.0, 0.4, 1.0].into(), 5);
        assert_eq!((mesh.len(), count(&mesh), &in_time(&mesh)[..]), (8, 5, &[0.0, 0.4, 1.0][..]));
    }
}
