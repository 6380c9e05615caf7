//! Stable and unstable subspaces of a saddle, with their derivatives.
//!
//! **Idea.** The sign function of a matrix A without eigenvalues on the imaginary axis is -1 on the stable and 1 on the
//! unstable subspace. It is smooth in A where eigenvectors are not, such as at double eigenvalues, and its derivative
//! follows from the differentiated iteration.
//!
//! **Equations.** With scalars c that speed up convergence and are constants in (2):
//!
//! ```text
//!   (1)  S ← ½ (c S + (c S)⁻¹),                    S = A at first
//!   (2)  S' ← ½ (c S' - S⁻¹ S' S⁻¹ / c),           S' = A' at first
//!   (3)  P_s = ½ (1 - S),   P_u = ½ (1 + S)
//!   (4)  (S A)ᵀ H + H S A = 2
//! ```
//!
//! S A has eigenvalues with positive real parts, so H is positive definite, and |y|² = yᵀ H y grows along the unstable
//! and decreases along the stable subspace.
//!
//! Next to a bifurcation the eigenvalues are divided by their number instead. The sign function of A + σ is that of A if no eigenvalue lies between -σ
//! and 0, and so are the projectors; with σ in the middle of a gap they are smooth where an eigenvalue crosses the axis.
//!
//! **Source.** higham2008, §5.3 (Newton's iteration, scaling by determinants), §3.2 (derivatives).
//!
//! **Fails when** an eigenvalue is too close to the imaginary axis.

use crate::linalg::{dot, lu, max_abs};
use num_complex::Complex64;

/// Largest number of iterations (1). With the scaling, a dozen suffice for eigenvalues whose sizes span ten decades.
const ITERATIONS: usize = 60;
/// Relative change of S at which (1) has converged: the next one is of the order of its square.
const CONVERGED: f64 = 1e-9;

/// Half the distance between the real parts of the `below` leftmost eigenvalues and of the others, relative to which an eigenvalue is
/// close to the axis: the sign function is then taken of a shifted matrix.
const CLOSE: f64 = 0.05;

/// Shift of a matrix that moves the imaginary axis between the `below` leftmost of its eigenvalues, ordered by their real parts, and
/// the others; 0 if it lies there. `None` if both have the same real part.
pub(super) fn gap(values: &[Complex64], below: usize) -> Option<f64> {
    const APART: f64 = 1e-12;
    let size = values.iter().fold(f64::MIN_POSITIVE, |m, z| m.max(z.norm()));
    let left = below.checked_sub(1).map_or(-2.0 * size, |k| values[k].re);
    let right = values.get(below).map_or(2.0 * size, |z| z.re);
    if right - left < APART * size {
        return None;
    }
    let near = CLOSE * (right - left);
    Some(if left < -near && right > near { 0.0 } else { -0.5 * (left + right) })
}

/// A matrix `[n × n]` plus a multiple of the identity.
pub(super) fn shifted(a: &[f64], shift: f64, n: usize) -> Vec<f64> {
    (0..n * n).map(|k| if k / n == k % n { a[k] + shift } else { a[k] }).collect()
}

/// The sign function of a matrix `[n × n]` and its derivatives; `None` if (1) does not converge.
pub(super) fn sign(a: &[f64], directions: &[Vec<f64>], n: usize) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
    let (mut s, mut along) = (a.to_vec(), directions.to_vec());
    let mut settled = false;
    for _ in 0..ITERATIONS {
        let mut factors = s.clone();
        let mut pivots = vec![0; n];
        lu::factorise(&mut factors, n, &mut pivots).ok()?;
        let c = if settled { 1.0 } else { (-lu::determinant(&factors, n, &pivots).1 / n as f64).exp() };
        let mut inverse = identity(n);
        lu::solve(&factors, n, &pivots, &mut inverse, n);
        for own in &mut along {
            let turned = product(&product(&inverse, own, n), &inverse, n);
            own.iter_mut().zip(&turned).for_each(|(d, t)| *d = 0.5 * (c * *d - t / c));
        }
        let next: Vec<f64> = s.iter().zip(&inverse).map(|(s, i)| 0.5 * (c * s + i / c)).collect();
        let change: Vec<f64> = next.iter().zip(&s).map(|(a, b)| a - b).collect();
        let done = settled && max_abs(&change) <= CONVERGED * max_abs(&next);
        settled = settled || max_abs(&change) <= 1e-2 * max_abs(&next);
        s = next;
        if !max_abs(&s).is_finite() {
            return None;
        }
        if done {
            return Some((s, along));
        }
    }
    None
}

/// H of (4), `[n × n]`, for A and its sign function.
pub(super) fn metric(a: &[f64], s: &[f64], n: usize) -> Option<Vec<f64>> {
    let m = product(s, a, n);
    let size = n * n;
    let mut matrix = vec![0.0; size * size];
    let mut right = vec![0.0; size];
    for (i, j) in (0..size).map(|k| (k / n, k % n)) {
        // Row (i, j) of mᵀ H + H m.
        let row = &mut matrix[(i * n + j) * size..][..size];
        for k in 0..n {
            row[k * n + j] += m[k * n + i];
            row[i * n + k] += m[k * n + j];
        }
        right[i * n + j] = if i == j { 2.0 } else { 0.0 };
    }
    let mut pivots = vec![0; size];
    lu::factorise(&mut matrix, size, &mut pivots).ok()?;
    lu::solve(&matrix, size, &pivots, &mut right, 1);
    // A unit trace per state makes its lengths those of the states.
    let trace = (0..n).map(|i| right[i * n + i]).sum::<f64>() / n as f64;
    right.iter_mut().for_each(|h| *h /= trace);
    max_abs(&right).is_finite().then_some(right)
}

/// `count` orthonormal rows that span the rows of a matrix `[n × n]` of that rank.
pub(super) fn row_basis(p: &[f64], count: usize, n: usize) -> Vec<f64> {
    let (mut rest, mut basis) = (p.to_vec(), Vec::with_capacity(count * n));
    for _ in 0..count {
        let longest = rest.chunks_exact(n).max_by(|a, b| dot(a, a).total_cmp(&dot(b, b)));
        let Some(longest) = longest else { break };
        let length = dot(longest, longest).sqrt();
        let own: Vec<f64> = longest.iter().map(|x| x / length).collect();
        for row in rest.chunks_exact_mut(n) {
            let along = dot(row, &own);
            row.iter_mut().zip(&own).for_each(|(x, q)| *x -= along * q);
        }
        basis.extend(own);
    }
    basis
}

/// The identity `[n × n]`.
pub(super) fn identity(n: usize) -> Vec<f64> {
    (0..n * n).map(|k| if k / n == k % n { 1.0 } else { 0.0 }).collect()
}

/// Product of two matrices `[rows × n]` and `[n × n]`.
pub(super) fn product(a: &[f64], b: &[f64], n: usize) -> Vec<f64> {
    let mut out = vec![0.0; a.len()];
    for (row, own) in out.chunks_exact_mut(n).zip(a.chunks_exact(n)) {
        for (x, b) in own.iter().zip(b.chunks_exact(n)) {
            row.iter_mut().zip(b).for_each(|(r, b)| *r += x * b);
        }
    }
    out
}

/// Transpose of a matrix `[n × n]`.
pub(super) fn transposed(a: &[f64], n: usize) -> Vec<f64> {
    (0..n * n).map(|k| a[k % n * n + k / n]).collect()
}

/// A matrix `[rows × n]` times a vector.
pub(super) fn times(a: &[f64], x: &[f64]) -> Vec<f64> {
    a.chunks_exact(x.len()).map(|row| dot(row, x)).collect()
}

/// exp(A t) y, by a Taylor series on short pieces.
pub(super) fn flow(a: &[f64], t: f64, y: &[f64]) -> Vec<f64> {
    const TERMS: usize = 14;
    let size = a.chunks_exact(y.len()).map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max);
    let pieces = (2.0 * size * t.abs()).ceil().max(1.0);
    let (h, mut y) = (t / pieces, y.to_vec());
    for _ in 0..pieces as usize {
        let mut term = y.clone();
        for k in 1..=TERMS {
            term = times(a, &term).iter().map(|x| x * h / k as f64).collect();
            y.iter_mut().zip(&term).for_each(|(y, t)| *y += t);
        }
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 4;

    /// A matrix with eigenvalues of both signs, one direction in which it changes.
    fn matrices() -> (Vec<f64>, Vec<f64>) {
        let entry = |k: usize, shift: f64| (1.3 * k as f64 + shift).sin();
        let a = (0..N * N).map(|k| entry(k, 0.2) + if k % (N + 1) == 0 { [2.0, -1.5, -3.0, 0.4][k / N] } else { 0.0 });
        (a.collect(), (0..N * N).map(|k| entry(k, 1.1)).collect())
    }

    #[test]
    fn the_sign_function_commutes_and_squares_to_one_and_its_derivative_is_that_of_differences() {
        let (a, d) = matrices();
        let (s, along) = sign(&a, std::slice::from_ref(&d), N).unwrap();
        let off = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
        assert!(off(&product(&s, &s, N), &identity(N)) < 1e-12);
        assert!(off(&product(&s, &a, N), &product(&a, &s, N)) < 1e-11);
        let moved = |h: f64| sign(&a.iter().zip(&d).map(|(a, d)| a + h * d).collect::<Vec<_>>(), &[], N).unwrap().0;
        let h = 1e-5;
        let slope: Vec<f64> = moved(h).iter().zip(moved(-h)).map(|(a, b)| (a - b) / (2.0 * h)).collect();
        assert!(off(&slope, &along[0]) < 1e-7 * max_abs(&along[0]).max(1.0), "{slope:?} {along:?}");
    }

    #[test]
    fn lengths_grow_along_the_unstable_subspace_and_decrease_along_the_stable_one() {
        let (a, _) = matrices();
        let (s, _) = sign(&a, &[], N).unwrap();
        let h = metric(&a, &s, N).unwrap();
        for side in [-1.0, 1.0] {
            let p: Vec<f64> = identity(N).iter().zip(&s).map(|(i, s)| 0.5 * (i + side * s)).collect();
            for k in 0..N {
                let y: Vec<f64> = (0..N).map(|i| p[i * N + k]).collect();
                assert!(side * dot(&times(&h, &y), &times(&a, &y)) > 0.0);
            }
        }
    }
}
