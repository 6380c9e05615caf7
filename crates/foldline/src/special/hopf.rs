//! Hopf points: a pair of eigenvalues crosses the imaginary axis and a branch of cycles begins.
//!
//! **Equations.**
//!
//!   (1)  ∏_{i<j} (λ_i + λ_j) = 0
//!   (2)  (J - iω) q = 0;   cycle x = x₀ + s Re(q e^{2πit}), T = 2π/ω,  for small s
//!
//! **Source.** kuznetsov2004, §10.2 and §10.3.

use super::normal_form;
use crate::contract::{Batch, Parameters};
use crate::contract::{Monitor, VectorField};
use crate::diagram::{Kind, Mesh, Point, Solution};
use crate::linalg::{lu, max_abs, neutral};
use crate::problem::gauss::Scheme;
use crate::stability::eigenvalues;
use num_complex::Complex64;

/// Sum of two eigenvalues.
pub struct Hopf;

impl Monitor for Hopf {
    fn kind(&self) -> Kind {
        Kind::Hopf
    }

    fn value(&self, reference: &Point, at: &Point) -> f64 {
        // Pairs that are neutral all along have sums of arbitrary sign.
        let mut neutral = neutral::marked(&at.spectrum);
        if !neutral.is_empty() {
            let z = &at.spectrum;
            neutral.sort_by(|a, b| balance((z[a[0]], z[a[1]])).norm().total_cmp(&balance((z[b[0]], z[b[1]])).norm()));
            neutral.truncate(neutral::marked(&reference.spectrum).len());
        }
        let z = &at.spectrum;
        let counts = |[i, j]: &[usize; 2]| !neutral.contains(&[*i, *j]) && !neutral.contains(&[*j, *i]);
        super::product(|| indices(z.len()).filter(counts).map(|[i, j]| balance((z[i], z[j]))))
    }

    fn factor(&self, near: &Point, at: &Point) -> Option<f64> {
        // Sums of other pairs may be real as well, to rounding, if symmetry makes frequencies equal.
        let real = |spectrum| pairs(spectrum).filter(|(a, b)| *a == b.conj() || a.im == 0.0 && b.im == 0.0);
        let (first, second) = real(&near.spectrum).min_by(|a, b| balance(*a).norm().total_cmp(&balance(*b).norm()))?;
        let apart = |(a, b): &(Complex64, Complex64)| {
            ((a - first).norm() + (b - second).norm()).min((a - second).norm() + (b - first).norm())
        };
        real(&at.spectrum).min_by(|a, b| apart(a).total_cmp(&apart(b))).map(|pair| balance(pair).re)
    }

    fn confirms(&self, at: &Point) -> bool {
        !frequencies(at).is_empty()
    }

    // A neutral saddle, where the product vanishes as well, may be so close to a Hopf point that a pair is nearly on the axis.
    fn confirms_between(&self, ends: [&Point; 2], at: &Point) -> bool {
        let off = |z: &Complex64| (z.re / z.im).abs();
        let nearest = at.spectrum.iter().filter(|z| z.im > 0.0).map(off).fold(f64::INFINITY, f64::min);
        let saddle = opposite(&at.spectrum);
        // Real eigenvalues that are opposite all along say nothing.
        let everywhere = ends.iter().all(|end| opposite(&end.spectrum) < OPPOSITE);
        self.confirms(at) && (everywhere || nearest < OPPOSITE || saddle > CLEAR * nearest)
    }

    fn jump(&self) -> usize {
        2
    }

    fn passed(&self, at: &Point) -> Option<usize> {
        let neutral = neutral::marked(&at.spectrum);
        let unstable = |k: &usize| {
            let z = at.spectrum[*k];
            z.im > 0.0 && z.re > 0.0 && !neutral.iter().any(|pair| pair.contains(k))
        };
        Some((0..at.spectrum.len()).filter(unstable).count())
    }

    fn others_unstable(&self, at: &Point) -> Option<usize> {
        super::others_unstable(at, 2, |z| if z.im == 0.0 { f64::INFINITY } else { (z.re / z.im).abs() })
    }
}

/// Balance of two real eigenvalues up to which they are opposite to rounding.
const OPPOSITE: f64 = 1e-9;
/// Share of the distance of a pair from the axis below which the balance of two real eigenvalues vanishes in its stead.
const CLEAR: f64 = 1e-3;

/// The smallest balance of two real eigenvalues of opposite sign; infinite if there are none.
fn opposite(spectrum: &[Complex64]) -> f64 {
    let real = |(a, b): &(Complex64, Complex64)| a.im == 0.0 && b.im == 0.0 && a.re * b.re < 0.0;
    pairs(spectrum).filter(real).map(|pair| balance(pair).norm()).fold(f64::INFINITY, f64::min)
}

/// Indices of all pairs of eigenvalues.
fn indices(n: usize) -> impl Iterator<Item = [usize; 2]> {
    (0..n).flat_map(move |i| (i + 1..n).map(move |j| [i, j]))
}

/// All pairs of eigenvalues.
fn pairs(z: &[Complex64]) -> impl Iterator<Item = (Complex64, Complex64)> + '_ {
    indices(z.len()).map(|[i, j]| (z[i], z[j]))
}

/// Sum of two eigenvalues divided by the sum of their moduli.
fn balance((a, b): (Complex64, Complex64)) -> Complex64 {
    (a + b) / (f64::MIN_POSITIVE + a.norm() + b.norm())
}

/// Frequencies ω of the pairs on the imaginary axis, closest pair first.
pub fn frequencies(at: &Point) -> Vec<f64> {
    let off = |z: &Complex64| (z.re / z.im).abs();
    let mut there: Vec<Complex64> = at.spectrum.iter().copied().filter(|z| z.im > 0.0 && off(z) < 1e-4).collect();
    there.sort_by(|a, b| off(a).total_cmp(&off(b)));
    there.iter().map(|z| z.im).collect()
}

/// Relative difference of two frequencies below which their eigenvectors cannot be distinguished.
pub(crate) const SAME: f64 = 1e-6;

/// True if two pairs are on the imaginary axis with the same frequency.
pub fn share_a_frequency(at: &Point) -> bool {
    let all = frequencies(at);
    (1..all.len()).any(|k| all[..k].iter().any(|other| (other / all[k] - 1.0).abs() < SAME))
}

/// Relative Newton update after which an equilibrium is converged: its square, the error left by quadratic convergence,
/// is rounding.
const CONVERGED: f64 = 1e-8;

/// First step of the search for a Hopf point, relative to its reach. With [`REACH`] it is 1e-8, the square root of the
/// machine precision, below which the difference of two growth rates is noise.
const NEXT: f64 = 1e-6;
/// Maximum number of halvings of one step of the search. Empirical: a step is halved if there is no equilibrium, beyond
/// a fold; 2⁻⁸ of it ends well before the fold.
const SHORTER: i32 = 8;

/// Largest distance of a Hopf point from a small cycle, relative to the scale of the parameter + |parameter|.
const REACH: f64 = 1e-2;

/// Parameter value of the Hopf point of the equilibrium next to `state`: the value of parameter `free` at which the
/// growth rate of the pair with frequency close to `omega` vanishes. `None` if there is none near these parameter
/// values.
pub fn lies_near(
    field: &dyn VectorField,
    parameters: &[f64],
    free: usize,
    unit: f64,
    scales: &[f64],
    state: &[f64],
    omega: f64,
) -> Option<f64> {
    let value = *parameters.get(free)?;
    let mut x = state.to_vec();
    let mut growth = |at: f64| {
        let mut there = parameters.to_vec();
        there[free] = at;
        let mut beside = x.clone();
        let rate = growth_rate(field, &there, scales, &mut beside, omega)?;
        x = beside;
        Some(rate)
    };
    // Secant steps in the parameter: the rate is smooth, and it only matters whether its zero is close.
    let reach = REACH * (unit + value.abs());
    let (mut a, mut b) = (value, value + NEXT * reach);
    let (mut at_a, mut at_b) = (growth(a)?, growth(b)?);
    for _ in 0..20 {
        if at_b == 0.0 || (b - a).abs() < 1e-9 * reach {
            break;
        }
        let next = b - at_b * (b - a) / (at_b - at_a);
        if !next.is_finite() || (next - value).abs() > 10.0 * reach {
            return None;
        }
        // There is no equilibrium beyond a fold: shorten the step.
        let shorter = (0..SHORTER).map(|k| b + (next - b) * 0.5f64.powi(k));
        let (next, rate) = shorter.into_iter().find_map(|at| Some((at, growth(at)?)))?;
        (a, at_a, b, at_b) = (b, at_b, next, rate);
    }
    ((b - value).abs() < reach && (b - a).abs() < 1e-3 * reach).then_some(b)
}

/// Real part of the eigenvalue with frequency closest to `omega` at the equilibrium next to `x`; moves `x` there.
fn growth_rate(field: &dyn VectorField, parameters: &[f64], scales: &[f64], x: &mut [f64], omega: f64) -> Option<f64> {
    let n = x.len();
    let (mut f, mut fx, mut pivots) = (vec![0.0; n], vec![0.0; n * n], vec![0; n]);
    let mut converged = false;
    for _ in 0..20 {
        let batch = Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times: &[], signs: &[] };
        field.linearise(batch, &[], &mut f, &mut fx, &mut []);
        if converged {
            let spectrum = eigenvalues(&fx, n, scales);
            let closest = spectrum.iter().min_by(|a, b| (a.im - omega).abs().total_cmp(&(b.im - omega).abs()))?;
            return Some(closest.re);
        }
        lu::factorise(&mut fx, n, &mut pivots).ok()?;
        lu::solve(&fx, n, &pivots, &mut f, 1);
        let size = (0..n).map(|i| (f[i] / (scales[i] + x[i].abs())).abs()).fold(0.0, f64::max);
        if !size.is_finite() {
            return None;
        }
        x.iter_mut().zip(&f).for_each(|(x, d)| *x -= d);
        // Newton's method converges quadratically: the remaining error is the square of the update, or rounding.
        converged = size < CONVERGED;
    }
    None
}

/// Null vector `[2n]` of the real form of A - iω, of largest component 1, by inverse iteration; `matrix` is `[2n × 2n]`.
/// `None` if the iteration does not converge.
fn null_vector(matrix: &[f64], size: usize) -> Option<Vec<f64>> {
    let size_of = max_abs(matrix);
    normal_form::SHIFTS.into_iter().find_map(|shift| {
        let mut shifted = matrix.to_vec();
        (0..size).for_each(|i| shifted[i * size + i] += shift * size_of);
        let mut pivots = vec![0; size];
        lu::factorise(&mut shifted, size, &mut pivots).ok()?;
        let mut q: Vec<f64> = (0..size).map(|k| (1.0 + k as f64).sin()).collect();
        let mut overlap = 0.0;
        for _ in 0..4 {
            let before = q.clone();
            lu::solve(&shifted, size, &pivots, &mut q, 1);
            overlap = normal_form::overlap(&before, &q);
            let norm = max_abs(&q);
            q.iter_mut().for_each(|v| *v /= norm);
        }
        (overlap > normal_form::ALIGNED).then_some(q)
    })
}

/// Direction of the cycles that bifurcate at a Hopf point with frequency ω: the profile `[N(m+1)n]` of Re(q e^{2πit})
/// with max |q_i|/s_i = 1, and the period 2π/ω. `None` if there is no such eigenvector.
pub fn direction(
    field: &dyn VectorField,
    at: &Point,
    omega: f64,
    scales: &[f64],
    scheme: &Scheme,
    mesh: &Mesh,
) -> Option<(Vec<f64>, f64)> {
    let Solution::Equilibrium(x) = &at.solution else { return None };
    let n = x.len();
    let (mut f, mut fx) = (vec![0.0; n], vec![0.0; n * n]);
    field.linearise(
        Batch { lanes: 1, states: x, parameters: Parameters::Shared(&at.parameters), times: &[], signs: &[] },
        &[],
        &mut f,
        &mut fx,
        &mut [],
    );
    // (J - iω)(a + ib) = 0 as a real system, by inverse iteration.
    let size = 2 * n;
    let mut matrix = vec![0.0; size * size];
    for i in 0..n {
        for j in 0..n {
            let balanced = fx[i * n + j] * scales[j] / scales[i];
            matrix[i * size + j] = balanced;
            matrix[(n + i) * size + n + j] = balanced;
        }
        matrix[i * size + n + i] = omega;
        matrix[(n + i) * size + i] = -omega;
    }
    let q = null_vector(&matrix, size)?;
    let mut profile = Vec::with_capacity((mesh.len() - 1) * (scheme.degree + 1) * n);
    for pair in mesh.windows(2) {
        for c in &scheme.nodes {
            let (sin, cos) = (std::f64::consts::TAU * (pair[0] + (pair[1] - pair[0]) * c)).sin_cos();
            profile.extend((0..n).map(|i| scales[i] * (q[i] * cos - q[n + i] * sin)));
        }
    }
    Some((profile, std::f64::consts::TAU / omega))
}
