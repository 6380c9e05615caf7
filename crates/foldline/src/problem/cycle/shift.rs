//! Changes of a cycle, split into a shift in time and a change of shape.
//!
//! **Idea.** On a relaxation oscillation or a burst, a small change of the parameter moves the jumps along time by more
//! than they last. At fixed times a linear prediction then fails beyond a fraction of a jump. Seen from points that move
//! with the jumps, the change is small.
//!
//! **Equations.** x, t ∈ [0, 1], is the profile and δ its change. The shift w, linear on each mesh interval, minimises
//!
//! ```text
//!   (1)  ∫ |δ + w x'|² + |x - x̄|² (w')² dt            x̄ the mean of x, |x - x̄|² its variance
//!   (2)  ρ = δ + w x'
//! ```
//!
//! so that the changed profile at t + w(t) is x(t) + ρ(t) to first order. Where x hardly moves, w interpolates between
//! the jumps. A forced cycle has w(0) = 0; of a cycle with free phase w(0) is subtracted afterwards.

use super::CycleProblem;
use crate::contract::Shift;

impl CycleProblem<'_> {
    /// Splits `change` `[unknowns]` of the solution `u` on the current mesh; see [`crate::contract::ZeroProblem::shift`].
    pub(super) fn split(&self, u: &[f64], change: &[f64]) -> Option<Shift> {
        if self.is_open() || self.halves || self.setting.field.switch_count() > 0 {
            return None;
        }
        let (n, m, count, block) = (self.n, self.scheme.degree, self.intervals(), self.block());
        let weight: Vec<f64> = self.scale.iter().map(|s| 1.0 / (s * s)).collect();
        let rate = self.rates(u);
        let mut mean = vec![0.0; n];
        let mut square = 0.0;
        let gauss = |each: &mut dyn FnMut(usize, usize, f64)| {
            for j in 0..count {
                (0..m).for_each(|i| each(j, i, self.h(j) * self.scheme.weights[i]));
            }
        };
        gauss(&mut |j, i, share| (0..n).for_each(|c| mean[c] += share * u[j * block + (i + 1) * n + c]));
        gauss(&mut |j, i, share| {
            let off = |c: usize| u[j * block + (i + 1) * n + c] - mean[c];
            square += share * (0..n).map(|c| off(c).powi(2) * weight[c]).sum::<f64>();
        });
        let mut matrix = vec![[0.0; 2]; count];
        let mut rhs = vec![0.0; count];
        for j in 0..count {
            let stiff = square / self.h(j);
            let next = (j + 1) % count;
            matrix[j][0] += stiff;
            matrix[next][0] += stiff;
            matrix[j][1] -= stiff;
        }
        gauss(&mut |j, i, share| {
            let (next, at) = ((j + 1) % count, self.scheme.nodes[i + 1]);
            let slopes = &rate[(j * m + i) * n..(j * m + i + 1) * n];
            let own = &change[j * block + (i + 1) * n..j * block + (i + 2) * n];
            let sum = |other: &[f64]| (0..n).map(|c| slopes[c] * other[c] * weight[c]).sum::<f64>() * share;
            let (own, there) = (sum(own), sum(slopes));
            matrix[j][0] += there * (1.0 - at).powi(2);
            matrix[next][0] += there * at * at;
            matrix[j][1] += there * at * (1.0 - at);
            rhs[j] -= own * (1.0 - at);
            rhs[next] -= own * at;
        });
        let mut times = periodic_tridiagonal(&matrix, rhs, self.is_forced())?;
        times.push(times[0]);
        let mut shape = change.to_vec();
        for j in 0..count {
            for i in 0..m {
                let at = self.scheme.nodes[i + 1];
                let shift = (1.0 - at) * times[j] + at * times[j + 1];
                for c in 0..n {
                    shape[j * block + (i + 1) * n + c] += shift * rate[(j * m + i) * n + c];
                }
            }
        }
        let slopes = slopes_at_start(&self.scheme.nodes);
        for j in 0..count {
            for c in 0..n {
                let rate: f64 = slopes.iter().enumerate().map(|(k, d)| d * u[j * block + k * n + c]).sum();
                shape[j * block + c] += times[j] * rate / self.h(j);
            }
        }
        let first = times[0];
        times.iter_mut().for_each(|w| *w -= first);
        Some(Shift { times, shape })
    }

    /// `[N][m][n]`: x' at the Gauss points, in normalised time, from the polynomials.
    fn rates(&self, u: &[f64]) -> Vec<f64> {
        let (n, m, block) = (self.n, self.scheme.degree, self.block());
        let mut rates = Vec::with_capacity(self.intervals() * m * n);
        for j in 0..self.intervals() {
            let nodes = &u[j * block..(j + 1) * block];
            for row in self.scheme.derivative.chunks_exact(m + 1).take(m) {
                rates.extend(
                    (0..n).map(|c| row.iter().enumerate().map(|(k, d)| d * nodes[k * n + c]).sum::<f64>() / self.h(j)),
                );
            }
        }
        rates
    }
}

/// Weights of the values at `nodes`, the first of which is 0, for the derivative there, by the barycentric formula.
fn slopes_at_start(nodes: &[f64]) -> Vec<f64> {
    let weight = |k: usize| -> f64 {
        nodes.iter().enumerate().filter(|(l, _)| *l != k).map(|(_, node)| 1.0 / (nodes[k] - node)).product()
    };
    let first = weight(0);
    let mut slopes: Vec<f64> =
        (0..nodes.len()).map(|k| if k == 0 { 0.0 } else { -weight(k) / (first * nodes[k]) }).collect();
    slopes[0] = -slopes.iter().sum::<f64>();
    slopes
}

/// Solves with a symmetric, positive definite tridiagonal matrix with corners: `matrix[j]` holds the diagonal entry and
/// the one to its right, the last of which is the corner. With `pinned` the first unknown is 0. `None` if a pivot
/// vanishes.
fn periodic_tridiagonal(matrix: &[[f64; 2]], mut rhs: Vec<f64>, pinned: bool) -> Option<Vec<f64>> {
    let count = rhs.len();
    // The first unknown is eliminated last: the others depend on it linearly.
    let mut along = vec![0.0; count];
    if count < 3 {
        return None;
    }
    along[1] = -matrix[0][1];
    along[count - 1] -= matrix[count - 1][1];
    let mut pivot = vec![0.0; count];
    pivot[1] = matrix[1][0];
    for j in 2..count {
        let factor = matrix[j - 1][1] / pivot[j - 1];
        pivot[j] = matrix[j][0] - factor * matrix[j - 1][1];
        rhs[j] -= factor * rhs[j - 1];
        along[j] -= factor * along[j - 1];
    }
    if pivot[1..].iter().any(|own| own.is_nan() || *own <= 0.0) {
        return None;
    }
    for column in [&mut rhs, &mut along] {
        column[count - 1] /= pivot[count - 1];
        (1..count - 1).rev().for_each(|j| column[j] = (column[j] - matrix[j][1] * column[j + 1]) / pivot[j]);
    }
    let first = if pinned {
        0.0
    } else {
        let row = |v: &[f64]| matrix[0][1] * v[1] + matrix[count - 1][1] * v[count - 1];
        let pivot = matrix[0][0] + row(&along);
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
        (rhs[0] - row(&rhs)) / pivot
    };
    rhs.iter_mut().zip(&along).for_each(|(own, along)| *own += first * along);
    rhs[0] = first;
    Some(rhs)
}

#[cfg(test)]
mod tests {
    use super::{periodic_tridiagonal, slopes_at_start};

    /// The derivative of a cubic at the first of four nodes.
    #[test]
    fn differentiates_at_the_first_node() {
        let nodes = [0.0, 0.2, 0.55, 0.9];
        let slope: f64 = slopes_at_start(&nodes).iter().zip(nodes).map(|(d, t)| d * (1.0 + 3.0 * t - t * t * t)).sum();
        assert!((slope - 3.0).abs() < 1e-13, "{slope}");
    }

    /// The product of the matrix with the solution is the right-hand side.
    #[test]
    fn solves_with_the_corners() {
        let count = 7;
        let matrix: Vec<[f64; 2]> = (0..count).map(|j| [3.0 + 0.1 * j as f64, -0.7 - 0.05 * j as f64]).collect();
        let rhs: Vec<f64> = (0..count).map(|j| (j as f64).sin() + 0.4).collect();
        let x = periodic_tridiagonal(&matrix, rhs.clone(), false).unwrap();
        for j in 0..count {
            let (before, next) = ((j + count - 1) % count, (j + 1) % count);
            let product = matrix[j][0] * x[j] + matrix[j][1] * x[next] + matrix[before][1] * x[before];
            assert!((product - rhs[j]).abs() < 1e-13, "{j}: {product}");
        }
        let pinned = periodic_tridiagonal(&matrix, rhs.clone(), true).unwrap();
        assert_eq!(pinned[0], 0.0);
        for j in 1..count {
            let (before, next) = (j - 1, (j + 1) % count);
            let product = matrix[j][0] * pinned[j] + matrix[j][1] * pinned[next] + matrix[before][1] * pinned[before];
            assert!((product - rhs[j]).abs() < 1e-13, "{j}: {product}");
        }
    }
}
