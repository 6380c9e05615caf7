//! Test functions of orbit flips and inclination flips.
//!
//! **Idea.** A connecting orbit usually arrives along the leading stable eigenvector; at an orbit flip it does not. The adjoint
//! solution ψ, which is orthogonal to the tangent spaces of both invariant manifolds, usually decays backwards along the
//! leading stable direction; where it does not, the stable manifold is tangent to an exceptional direction: an inclination
//! flip. Both likewise for the unstable side.
//!
//! **Equations.** With right and left eigenvectors q, p of the leading eigenvalues, if they are real and there are others on
//! their side, y_i the deviations of the ends from the equilibria, and Φ_j transition matrices between M + 1 uniform
//! times:
//!
//! ```text
//!   (1)  ⟨p_s, y_1⟩ / |y_1|,      ⟨p_u, y_0⟩ / |y_0|          orbit flips
//!   (2)  ⟨q_s, ψ(0)⟩ exp(|λ_s| T/2),   ⟨q_u, ψ(1)⟩ exp(λ_u T/2)    inclination flips
//!   (3)  ψ_j = Φ_jᵀ ψ_{j+1},   P_uᵀ(x_0) ψ_0 = 0,   P_sᵀ(x_1) ψ_M = 0
//! ```
//!
//! An orbit homoclinic to a saddle-node usually arrives along the null vector v of A; where it arrives along the strong stable
//! manifold, it is non-central. On that manifold ⟨w, y⟩ of the left null vector w, ⟨w, D²f[v, v]⟩ > 0, has terms exp(-k λ t), k ≥ 2, of which
//! three are annihilated as in (7) of [`super`]:
//!
//! ```text
//!   (4)  -⟨w, y_1 + 26/24 x' / λ + 9/24 x'' / λ² + 1/24 x''' / λ³⟩ / |y_1|        x' = f(x(1))
//!   (5)   ⟨w, y_0 + …⟩ / |y_0|       with -λ, for the strong unstable manifold
//! ```
//!
//! (3) is singular by one. A random border makes it regular; its solution is the null vector.
//!
//! **Source.** champneys1996, §2; Φ_j by the Magnus expansion of fourth order, blanes2009, §5.

use super::ConnectingField;
use super::splitting::{identity, product, row_basis, times, transposed};
use crate::contract::{Turning, VectorField};
use crate::diagram::Cycle;
use crate::linalg::{dot, lu, max_abs};
use crate::stability::eigenvalues;
use num_complex::Complex64;

/// The number of segments is a multiple of this, so that ψ can be compared between orbits.
const SAMPLES: usize = 12;
/// Largest growth exponent of a segment.
const GROWTH: f64 = 3.0;
/// Largest number of unknowns of (3).
const UNKNOWNS: usize = 900;
/// Pieces of a mesh interval for Φ.
const PIECES: usize = 4;

/// Leading eigenvalue of one side, if it is real and there are more.
fn leading(values: &[Complex64], side: f64) -> Option<f64> {
    let mut own: Vec<&Complex64> = values.iter().filter(|z| side * z.re > 0.0).collect();
    own.sort_by(|a, b| a.re.abs().total_cmp(&b.re.abs()));
    let first = own.first()?;
    (own.len() > 1 && first.im == 0.0).then_some(first.re)
}

/// Unit eigenvector of a simple real eigenvalue, by inverse iteration.
fn eigenvector(a: &[f64], value: f64, n: usize) -> Option<Vec<f64>> {
    const ROUNDS: usize = 3;
    let shift = value + 1e-10 * max_abs(a);
    let mut matrix: Vec<f64> = a.iter().zip(identity(n)).map(|(a, i)| a - shift * i).collect();
    let mut pivots = vec![0; n];
    lu::factorise(&mut matrix, n, &mut pivots).ok()?;
    let mut x: Vec<f64> = (0..n).map(|k| 1.0 + 0.3 * (1.7 * k as f64).sin()).collect();
    for _ in 0..ROUNDS {
        lu::solve(&matrix, n, &pivots, &mut x, 1);
        let length = dot(&x, &x).sqrt();
        x.iter_mut().for_each(|x| *x /= length);
    }
    max_abs(&x).is_finite().then_some(x)
}

/// exp(A) of a matrix `[n × n]`, by a Taylor series of a small multiple.
fn exponential(a: &[f64], n: usize) -> Vec<f64> {
    const TERMS: usize = 12;
    let size = a.chunks_exact(n).map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max);
    let halvings = (2.0 * size).log2().ceil().max(0.0) as i32;
    let small: Vec<f64> = a.iter().map(|x| x * 0.5f64.powi(halvings)).collect();
    let (mut sum, mut term) = (identity(n), identity(n));
    for k in 1..=TERMS {
        term = product(&term, &small, n).iter().map(|x| x / k as f64).collect();
        sum.iter_mut().zip(&term).for_each(|(s, t)| *s += t);
    }
    (0..halvings).for_each(|_| sum = product(&sum, &sum, n));
    sum
}

impl ConnectingField<'_> {
    /// (1) and (2): orbit flips at the end and at the start, inclination flips of the stable and the unstable manifold.
    pub(super) fn turnings(&self, orbit: &Cycle, parameters: &[f64]) -> [Option<Turning>; 4] {
        if self.node {
            let [end, start] = self.sides_of_centre(orbit, parameters);
            return [end, start, None, None];
        }
        let n = self.dim();
        let places = [0, 1].map(|end| self.saddle(&parameters[self.place(end)], parameters, &[]));
        let values = [0, 1].map(|end: usize| eigenvalues(&places[end].a, n, &vec![1.0; n]));
        let ends = [orbit.state(0.0), orbit.end()];
        let ys = self.deviations([&ends[0], &ends[1]], parameters);
        let orbit_flip = |end: usize, side: f64| {
            let p = eigenvector(&transposed(&places[end].a, n), leading(&values[end], side)?, n)?;
            let length = dot(&ys[end], &ys[end]).sqrt();
            Some(Turning { value: dot(&p, &ys[end]) / length, refer: p })
        };
        let at = [(0, -1.0), (1, 1.0)];
        let wanted = at.iter().any(|(end, side)| leading(&values[*end], *side).is_some());
        let adjoint = if wanted { self.adjoint(orbit, parameters) } else { None };
        let inclination_flip = |end: usize, side: f64| {
            let rate = leading(&values[end], side)?;
            let q = eigenvector(&places[end].a, rate, n)?;
            let psi = adjoint.as_ref()?;
            let last = psi.len() / n - 1;
            let own = &psi[end * last * n..][..n];
            let every = last / SAMPLES;
            let samples = (0..=SAMPLES).flat_map(|k| psi[k * every * n..][..n].iter());
            let refer = samples.flat_map(|x| q.iter().map(move |q| x * q)).collect();
            let grown = (0.5 * rate.abs() * self.time_unit(parameters)).exp();
            Some(Turning { value: grown * dot(&q, own), refer })
        };
        [orbit_flip(1, -1.0), orbit_flip(0, 1.0), inclination_flip(0, -1.0), inclination_flip(1, 1.0)]
    }

    /// (4) and (5), positive for a central orbit; at the start only if there are unstable eigenvalues.
    fn sides_of_centre(&self, orbit: &Cycle, parameters: &[f64]) -> [Option<Turning>; 2] {
        let n = self.dim();
        let at = self.saddle(&parameters[self.place(0)], parameters, &[]);
        let values = self.eigenvalues_of(&at.a);
        let below = self.below(0);
        let rates = [below.checked_sub(1).map(|k| -values[k].re), values.get(below + 1).map(|z| z.re)];
        let ends = [orbit.state(0.0), orbit.end()];
        let ys = self.deviations([&ends[0], &ends[1]], parameters);
        let side = |end: usize| {
            let rate = rates[1 - end]?;
            let p = eigenvector(&transposed(&at.a, n), values[below].re, n)?;
            let (y, [d1, d2, d3, _]) = (&ys[end], self.motions(&ends[end], parameters));
            // The flow along the null vector grows with its square, in the direction of positive values.
            let q = eigenvector(&at.a, values[below].re, n)?;
            let mut d = vec![0.0; n + self.known()];
            (0..n).for_each(|c| d[c] = q[c] * self.scales[c]);
            let bent = times(&self.turned(&at, parameters, &d), &q);
            let outwards = dot(&p, &bent).signum();
            let sign = if end == 0 { outwards } else { -outwards };
            let rate = if end == 0 { -rate } else { rate };
            let value = dot(&p, y)
                + 26.0 / 24.0 * dot(&p, &d1) / rate
                + 9.0 / 24.0 * dot(&p, &d2) / rate.powi(2)
                + 1.0 / 24.0 * dot(&p, &d3) / rate.powi(3);
            Some(Turning { value: sign * value / dot(y, y).sqrt(), refer: vec![1.0] })
        };
        [side(1), side(0)]
    }

    /// ψ of (3) at uniform times `[M + 1][n]`; `None` if the growth along the orbit needs too many segments.
    fn adjoint(&self, orbit: &Cycle, parameters: &[f64]) -> Option<Vec<f64>> {
        let n = self.dim();
        let period = self.time_unit(parameters);
        let jacobian = |t: f64| -> Vec<f64> {
            let x = orbit.state(t.clamp(0.0, 1.0 - 1e-15));
            self.saddle(&x, parameters, &[]).a.iter().map(|a| a * period).collect()
        };
        let rate = orbit.mesh.iter().map(|t| jacobian(*t)).fold(0.0, |m: f64, a| {
            m.max(a.chunks_exact(n).map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max))
        });
        let segments = SAMPLES * ((rate / GROWTH / SAMPLES as f64).ceil().max(1.0) as usize);
        if n * (segments + 1) > UNKNOWNS {
            return None;
        }
        let size = n * (segments + 1);
        let whole = size + 1;
        let mut matrix = vec![0.0; whole * whole];
        for j in 0..segments {
            let [a, b] = [j, j + 1].map(|k| k as f64 / segments as f64);
            let phi = self.transition(orbit, &jacobian, [a, b]);
            for (r, c) in (0..n * n).map(|k| (k / n, k % n)) {
                let row = &mut matrix[(j * n + r) * whole..][..whole];
                row[(j + 1) * n + c] = -phi[c * n + r];
                if r == c {
                    row[j * n + c] = 1.0;
                }
            }
        }
        let mut row = segments * n;
        for (end, side, first) in [(0, 1.0, 0), (1, -1.0, segments * n)] {
            let split = self.parts(end, parameters)?;
            let count = if side > 0.0 { split.unstable() } else { n - split.unstable() };
            for own in row_basis(&transposed(&split.projector(side), n), count, n).chunks_exact(n) {
                matrix.get_mut(row * whole + first..row * whole + first + n)?.copy_from_slice(own);
                row += 1;
            }
        }
        if row != size {
            return None;
        }
        let any = |k: usize| 0.5 + (1.3 * k as f64 + 0.2).sin();
        for k in 0..size {
            matrix[k * whole + size] = any(k);
            matrix[size * whole + k] = any(3 * k + 1);
        }
        let mut pivots = vec![0; whole];
        lu::factorise(&mut matrix, whole, &mut pivots).ok()?;
        let mut psi = vec![0.0; whole];
        psi[size] = 1.0;
        lu::solve(&matrix, whole, &pivots, &mut psi, 1);
        psi.truncate(size);
        let length = dot(&psi, &psi).sqrt();
        psi.iter_mut().for_each(|x| *x /= length);
        max_abs(&psi).is_finite().then_some(psi)
    }

    /// Φ between two times, with pieces that end at the mesh.
    fn transition(&self, orbit: &Cycle, jacobian: &dyn Fn(f64) -> Vec<f64>, [a, b]: [f64; 2]) -> Vec<f64> {
        let n = self.dim();
        let mut nodes = vec![a];
        nodes.extend(orbit.mesh.iter().copied().filter(|t| *t > a && *t < b));
        nodes.push(b);
        let mut phi = identity(n);
        for pair in nodes.windows(2) {
            let h = (pair[1] - pair[0]) / PIECES as f64;
            for k in 0..PIECES {
                let middle = pair[0] + (k as f64 + 0.5) * h;
                let [first, second] = [-1.0, 1.0].map(|s| jacobian(middle + s * h / 12f64.sqrt()));
                let [ab, ba] = [product(&second, &first, n), product(&first, &second, n)];
                let omega: Vec<f64> = (0..n * n)
                    .map(|i| 0.5 * h * (first[i] + second[i]) + 3f64.sqrt() / 12.0 * h * h * (ab[i] - ba[i]))
                    .collect();
                phi = product(&exponential(&omega, n), &phi, n);
            }
        }
        phi
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_of_a_rotation_and_of_a_diagonal_matrix_are_known() {
        let turned = exponential(&[0.0, -9.0, 9.0, 0.0], 2);
        let known = [9f64.cos(), -9f64.sin(), 9f64.sin(), 9f64.cos()];
        assert!(turned.iter().zip(known).all(|(a, b)| (a - b).abs() < 1e-13), "{turned:?}");
        let stretched = exponential(&[-20.0, 0.0, 0.0, 3.0], 2);
        assert!((stretched[0] - (-20f64).exp()).abs() < 1e-20 && (stretched[3] / 3f64.exp() - 1.0).abs() < 1e-13);
    }

    #[test]
    fn eigenvectors_belong_to_their_eigenvalue() {
        let a = [2.0, 1.0, 0.0, 0.0, -1.0, 0.5, 0.0, 0.0, -3.0];
        for value in [2.0, -1.0, -3.0] {
            let x = eigenvector(&a, value, 3).unwrap();
            let off = times(&a, &x).iter().zip(&x).map(|(y, x)| (y - value * x).abs()).fold(0.0, f64::max);
            assert!(off < 1e-8, "{value}: {x:?}");
        }
    }
}
