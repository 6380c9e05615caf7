//! Natural frequencies, modes and Campbell diagrams.
//!
//! **Idea.** The eigenvalue problem is solved for ω₀/λ: the lowest modes then have the largest eigenvalues and are as
//! accurate as the stiffness matrix, instead of being lost in the rounding errors of the highest ones. For an isotropic
//! rotor each pair of coordinates is one complex number z = x + iy, which halves the problem and separates forward (Im
//! λ > 0) from backward whirl.
//!
//! **Equations.** With D = C + Cᵢ + ΩG, S = K - ΩCᵢJ, and y = (q, q̇/ω₀):
//!
//! 1. (λ² M + λ D + S) q = 0
//! 2. [[-ω₀ S⁻¹D, -ω₀² S⁻¹M], [1, 0]] y = (ω₀/λ) y
//! 3. resonance n:m in the rotating frame: n (ω_f - Ω) = m (ω_b - Ω), backward frequencies negative
//! 4. real: |Im μ| ≤ √(N ε) ‖A‖ and |Im μ| < |Re μ|, for the N eigenvalues μ of the matrix A of equation 2 in coordinates in
//!    which the diagonal of M is 1
//!
//! Real eigenvalues belong to overdamped motions, which do not oscillate and are not modes. Rounding splits a double one
//! into a pair: the perturbation of a double eigenvalue is the square root of that of the matrix, N ε relative to its size
//! for an algorithm that is backward stable, which gives the bound of equation 4. A mode with less than 0.7 of the critical damping is
//! never taken for real, however high its frequency. The lowest modes are those with the smallest |λ|, whose eigenvalues are
//! the most accurate.
//!
//! **Source.** golub2013, §7.2 (perturbation of multiple eigenvalues).
//!
//! **Fails when** modes lie far above the lowest one: an eigenvalue r times the lowest loses a factor r² of accuracy. If
//! S is singular (a rotor without supports), the eigenvalue problem is solved for λ/ω₀, and the lowest modes are less
//! accurate.

use crate::machine::Linear;
use foldline_general::{Mat, complex_eigenvalues, complex_eigenvectors, complex_solution, eigenvectors};
use num_complex::Complex64;

/// Relative rounding error of the lowest squared frequency, ε ‖S‖ ‖S⁻¹M‖/‖M‖, above which S counts as singular.
const SINGULAR: f64 = 1e-4;

/// Area of an orbit over the square of its size below which the motion is planar: far above rounding errors of shapes.
const PLANAR: f64 = 1e-9;

/// Direction of whirl relative to the rotation of the shaft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Whirl {
    /// With the shaft at every station.
    Forward,
    /// Against the shaft at every station.
    Backward,
    /// With the shaft at some stations and against it at others, or in a plane.
    Mixed,
}

impl Whirl {
    /// Name.
    pub fn name(self) -> &'static str {
        match self {
            Whirl::Forward => "forward",
            Whirl::Backward => "backward",
            Whirl::Mixed => "mixed",
        }
    }
}

/// Lowest modes at one speed.
#[derive(Clone, Debug, Default)]
pub struct Modes {
    /// By natural frequency |λ|.
    pub modes: Vec<Mode>,
    /// Real eigenvalues in rad/s, of overdamped motions that do not oscillate, the slowest first.
    pub overdamped: Vec<f64>,
}

/// Mode of the linear rotor in the fixed frame.
#[derive(Clone, Debug)]
pub struct Mode {
    /// Eigenvalue with Im λ ≥ 0, in rad/s.
    pub value: Complex64,
    /// Direction of whirl.
    pub whirl: Whirl,
    /// Displacements and rotations in the order of the degrees of freedom, x = Re(shape e^{λt}); the largest
    /// displacement is 1. Empty unless requested.
    pub shape: Vec<Complex64>,
}

impl Mode {
    /// |λ|, in rad/s.
    pub fn natural(&self) -> f64 {
        self.value.norm()
    }

    /// Damped angular frequency in the fixed frame, negative for backward whirl.
    pub fn signed(&self) -> f64 {
        if self.whirl == Whirl::Backward { -self.value.im } else { self.value.im }
    }

    /// Damping ratio.
    pub fn ratio(&self) -> f64 {
        -self.value.re / self.value.norm()
    }

    /// Logarithmic decrement.
    pub fn decrement(&self) -> f64 {
        -std::f64::consts::TAU * self.value.re / self.value.im
    }
}

impl Linear {
    /// The `count` lowest oscillating modes at this speed, by natural frequency; with shapes if `shapes` is true. `None`
    /// if the eigenvalues could not be computed.
    pub fn modes(&self, count: usize, shapes: bool) -> Option<Vec<Mode>> {
        self.spectrum(count, shapes).map(|found| found.modes)
    }

    /// The modes of [`Linear::modes`] with the real eigenvalues, which are not modes.
    pub fn spectrum(&self, count: usize, shapes: bool) -> Option<Modes> {
        Some(lowest(if self.isotropic { self.circular(shapes)? } else { self.elliptic()? }, count))
    }

    /// The `count` lowest modes at each of several speeds, for matrices that do not depend on the speed. Products with
    /// the inverse of K are computed once. `None` where eigenvalues could not be computed.
    pub(crate) fn modes_over(&self, speeds: &[f64], count: usize) -> Vec<Option<Modes>> {
        let n = self.mass.nrows();
        let each = |speed: &f64| Linear { speed: *speed, ..self.clone() };
        let rotates = (0..n).any(|i| (0..n).any(|j| self.internal[(i, j)] != 0.0));
        if rotates || !self.isotropic {
            return speeds.iter().map(|speed| each(speed).spectrum(count, false)).collect();
        }
        let [m, c, g, k] = [&self.mass, &self.damping, &self.gyroscopic, &self.stiffness].map(folded);
        let ([flexible, damped], [_, turned]) = (flexibility(&m, &c, &k), flexibility(&m, &g, &k));
        let Some(unit) = unit(&flexible, &m, &k) else {
            return speeds.iter().map(|speed| each(speed).spectrum(count, false)).collect();
        };
        let half = n / 2;
        let mut own = self.clone();
        let modes = |speed: &f64| {
            own.speed = *speed;
            let solved = Mat::from_fn(half, half, |i, j| damped[(i, j)] + *speed * turned[(i, j)]);
            Some(lowest(own.circular_of((inverse_companion(&flexible, &solved, unit), unit, true), false)?, count))
        };
        speeds.iter().map(modes).collect()
    }

    /// Modes of an isotropic rotor, and its real eigenvalues as modes with Im λ = 0.
    fn circular(&self, shapes: bool) -> Option<Vec<Mode>> {
        let n = self.mass.nrows() / 2;
        let i = Complex64::I;
        let [mass, damping, gyroscopic, stiffness, internal] =
            [&self.mass, &self.damping, &self.gyroscopic, &self.stiffness, &self.internal].map(folded);
        let d = Mat::from_fn(n, n, |r, c| damping[(r, c)] + self.speed * gyroscopic[(r, c)]);
        let s = Mat::from_fn(n, n, |r, c| stiffness[(r, c)] - i * self.speed * internal[(r, c)]);
        self.circular_of(companion(&mass, &d, &s), shapes)
    }

    /// Modes from the matrix of equation 2.
    fn circular_of(&self, (a, unit, inverted): (Mat<Complex64>, f64, bool), shapes: bool) -> Option<Vec<Mode>> {
        let (n, i) = (self.mass.nrows() / 2, Complex64::I);
        if !finite(&a) {
            return None;
        }
        let (values, vectors) = match shapes {
            true => complex_eigenvectors(a.as_ref()).map(|(values, vectors)| (values, Some(vectors)))?,
            false => (complex_eigenvalues(a.as_ref())?, None),
        };
        let values = without_rounding(values, self.scaled_size(2 * n, |i, j| a[(i, j)].norm()));
        let back = |mu: Complex64| if inverted { unit / mu } else { unit * mu };
        let forward = if self.speed < 0.0 { -1.0 } else { 1.0 };
        let mode = |(k, mu): (usize, &Complex64)| {
            let value = back(*mu);
            let shape = vectors.as_ref().map(|vectors| {
                // x + iy = a e^{λt}; for backward whirl the real motion is that of the conjugate.
                let pair = |j: usize| match (vectors[(j, k)], value.im >= 0.0) {
                    (a, true) => [a, -i * a],
                    (a, false) => [a.conj(), i * a.conj()],
                };
                let whole: Vec<Complex64> = (0..n).flat_map(pair).collect();
                self.normalised(whole)
            });
            let whirl = if value.im * forward >= 0.0 { Whirl::Forward } else { Whirl::Backward };
            let value = Complex64::new(value.re, value.im.abs());
            Mode { value, whirl, shape: shape.unwrap_or_default() }
        };
        Some(values.iter().enumerate().map(mode).collect())
    }

    /// Modes of any rotor, and its real eigenvalues. The direction of whirl needs the shapes, so they are always computed.
    fn elliptic(&self) -> Option<Vec<Mode>> {
        let n = self.mass.nrows();
        let turned = crate::assembly::turned(&self.internal);
        let d = Mat::from_fn(n, n, |r, c| self.damping[(r, c)] + self.speed * self.gyroscopic[(r, c)]);
        let s = Mat::from_fn(n, n, |r, c| self.stiffness[(r, c)] - self.speed * turned[(r, c)]);
        let (a, unit, inverted) = real_companion(&self.mass, &d, &s);
        if !crate::assembly::finite(&a) {
            return None;
        }
        let (values, vectors) = eigenvectors(a.as_ref())?;
        let values = without_rounding(values, self.scaled_size(2 * n, |i, j| a[(i, j)].abs()));
        let back = |mu: Complex64| if inverted { unit / mu } else { unit * mu };
        let upper = values.iter().enumerate().map(|(k, mu)| (k, back(*mu))).filter(|(_, value)| value.im >= 0.0);
        let modes = upper.map(|(k, value)| {
            let shape: Vec<Complex64> = (0..n).map(|j| vectors[(j, k)]).collect();
            Mode { value, whirl: self.whirl(&shape), shape: self.normalised(shape) }
        });
        Some(modes.collect())
    }

    /// ‖A‖ of equation 4: the Frobenius norm of the matrix of equation 2, of this order and with entries of these sizes, in
    /// coordinates in which the diagonal of M is 1, so that it does not depend on units.
    fn scaled_size(&self, order: usize, entry: impl Fn(usize, usize) -> f64) -> f64 {
        let (half, n) = (order / 2, self.mass.nrows());
        let weight = |i: usize| {
            let place = i % half * (n / half);
            self.mass[(place, place)].sqrt()
        };
        let weights: Vec<f64> = (0..order).map(weight).collect();
        let squares = |j: usize| (0..order).map(|i| (weights[i] * entry(i, j) / weights[j]).powi(2)).sum::<f64>();
        (0..order).map(squares).sum::<f64>().sqrt()
    }

    /// Direction in which the stations move. Those that move less than 1e-6 of the largest do not count.
    fn whirl(&self, shape: &[Complex64]) -> Whirl {
        let turn = |k: usize| (shape[2 * k].conj() * shape[2 * k + 1]).im;
        // x = cos ωt, y = sin ωt is x = 1, y = -i.
        let areas: Vec<f64> = (0..shape.len() / 2).filter(|k| self.is_displacement(*k)).map(|k| -turn(k)).collect();
        let largest = areas.iter().fold(0.0, |m: f64, a| m.max(a.abs()));
        let sizes = shape.iter().map(|z| z.norm_sqr()).fold(0.0, f64::max);
        if largest <= PLANAR * sizes {
            return Whirl::Mixed;
        }
        let forward = if self.speed < 0.0 { -1.0 } else { 1.0 };
        let counted = || areas.iter().filter(|a| a.abs() > 1e-6 * largest);
        match (counted().all(|a| a * forward > 0.0), counted().all(|a| a * forward < 0.0)) {
            (true, false) => Whirl::Forward,
            (false, true) => Whirl::Backward,
            _ => Whirl::Mixed,
        }
    }

    /// True if a pair of coordinates is a displacement, false if it is a rotation.
    fn is_displacement(&self, pair: usize) -> bool {
        pair >= 2 * self.nodes || pair.is_multiple_of(2)
    }

    fn normalised(&self, mut shape: Vec<Complex64>) -> Vec<Complex64> {
        let moved = (0..shape.len()).filter(|j| self.is_displacement(j / 2)).map(|j| shape[j]);
        let largest = moved.max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or(Complex64::ONE);
        if largest.norm() > 0.0 {
            shape.iter_mut().for_each(|z| *z /= largest);
        }
        shape
    }
}

/// Matrix of complex coordinates: entry a + ib for each block [[a, -b], [b, a]].
pub(crate) fn folded(a: &Mat<f64>) -> Mat<Complex64> {
    Mat::from_fn(a.nrows() / 2, a.ncols() / 2, |i, j| Complex64::new(a[(2 * i, 2 * j)], a[(2 * i + 1, 2 * j)]))
}

/// The lowest oscillating modes, by natural frequency, and the real eigenvalues.
fn lowest(all: Vec<Mode>, count: usize) -> Modes {
    let (real, mut modes): (Vec<Mode>, Vec<Mode>) = all.into_iter().partition(|mode| mode.value.im == 0.0);
    modes.sort_by(|a, b| a.natural().total_cmp(&b.natural()));
    modes.truncate(count);
    let mut overdamped: Vec<f64> = real.into_iter().map(|mode| mode.value.re).collect();
    overdamped.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    Modes { modes, overdamped }
}

/// Eigenvalues of equation 2, those that are real by equation 4 without their imaginary part; `size` is ‖A‖.
fn without_rounding(mut values: Vec<Complex64>, size: f64) -> Vec<Complex64> {
    let split = (values.len() as f64 * f64::EPSILON).sqrt() * size;
    for mu in &mut values {
        if mu.im.abs() <= split && mu.im.abs() < mu.re.abs() {
            mu.im = 0.0;
        }
    }
    values
}

/// S⁻¹M and S⁻¹D.
fn flexibility(m: &Mat<Complex64>, d: &Mat<Complex64>, s: &Mat<Complex64>) -> [Mat<Complex64>; 2] {
    let n = m.nrows();
    let scale: Vec<f64> = (0..n).map(|i| 1.0 / s[(i, i)].norm().sqrt().max(f64::MIN_POSITIVE)).collect();
    let scaled = Mat::from_fn(n, n, |i, j| scale[i] * s[(i, j)] * scale[j]);
    let right = Mat::from_fn(n, 2 * n, |i, j| scale[i] * if j < n { m[(i, j)] } else { d[(i, j - n)] });
    let found = complex_solution(scaled.as_ref(), &right);
    [0, n].map(|from| Mat::from_fn(n, n, |i, j| scale[i] * found[(i, from + j)]))
}

/// True if all entries are finite.
fn finite(a: &Mat<Complex64>) -> bool {
    (0..a.ncols()).all(|j| (0..a.nrows()).all(|i| a[(i, j)].is_finite()))
}

/// Frobenius norm.
fn size(a: &Mat<Complex64>) -> f64 {
    let (rows, columns) = (a.nrows(), a.ncols());
    (0..rows).map(|i| (0..columns).map(|j| a[(i, j)].norm_sqr()).sum::<f64>()).sum::<f64>().sqrt()
}

/// ω₀, about the lowest frequency, from S⁻¹M; `None` if S is singular: its lowest frequency would be rounding error.
fn unit(flexible: &Mat<Complex64>, m: &Mat<Complex64>, s: &Mat<Complex64>) -> Option<f64> {
    let trace: f64 = (0..m.nrows()).map(|i| flexible[(i, i)].norm()).sum();
    let usable = trace.is_finite() && trace > 0.0 && f64::EPSILON * size(s) * trace < SINGULAR * size(m);
    usable.then(|| 1.0 / trace.sqrt())
}

/// Matrix of equation 2 from S⁻¹M and S⁻¹D.
fn inverse_companion(flexible: &Mat<Complex64>, damped: &Mat<Complex64>, unit: f64) -> Mat<Complex64> {
    let n = flexible.nrows();
    Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
        (true, true) => -unit * damped[(i, j)],
        (true, false) => -unit * unit * flexible[(i, j - n)],
        (false, _) => Complex64::from(if i - n == j { 1.0 } else { 0.0 }),
    })
}

/// Matrix of equation 2, ω₀, and false if the stiffness matrix is singular and the eigenvalues are λ/ω₀ instead.
fn companion(m: &Mat<Complex64>, d: &Mat<Complex64>, s: &Mat<Complex64>) -> (Mat<Complex64>, f64, bool) {
    let n = m.nrows();
    let [flexible, damped] = flexibility(m, d, s);
    if let Some(unit) = unit(&flexible, m, s) {
        return (inverse_companion(&flexible, &damped, unit), unit, true);
    }
    let stiffest = size(s) / size(m);
    let unit = stiffest.sqrt().max(f64::MIN_POSITIVE);
    let right = Mat::from_fn(n, 2 * n, |i, j| if j < n { s[(i, j)] } else { d[(i, j - n)] });
    let solved = complex_solution(m.as_ref(), &right);
    let a = Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
        (true, _) => Complex64::from(if i + n == j { 1.0 } else { 0.0 }),
        (false, true) => -solved[(i - n, j)] / (unit * unit),
        (false, false) => -solved[(i - n, j)] / unit,
    });
    (a, unit, false)
}

fn real_companion(m: &Mat<f64>, d: &Mat<f64>, s: &Mat<f64>) -> (Mat<f64>, f64, bool) {
    let [m, d, s] = [m, d, s].map(|a| Mat::from_fn(a.nrows(), a.ncols(), |i, j| Complex64::from(a[(i, j)])));
    let (a, unit, inverted) = companion(&m, &d, &s);
    (Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)].re), unit, inverted)
}

/// Undamped synchronous critical speeds: directions and Ω in rad/s, increasing.
///
/// K a = Ω² (M ∓ Ĝ) a for forward and backward whirl, with G = -iĜ in complex coordinates.
pub(crate) fn synchronous(at: &Linear) -> Option<Vec<(Whirl, f64)>> {
    let mut found: Vec<(Whirl, f64)> = Vec::new();
    let mut keep = |whirl: Whirl, values: Vec<Complex64>| {
        let real = values.into_iter().filter(|mu| mu.re > 0.0 && mu.im.abs() < 1e-6 * mu.re);
        found.extend(real.map(|mu| (whirl, 1.0 / mu.re.sqrt())));
    };
    if at.isotropic {
        let [m, g, k] = [&at.mass, &at.gyroscopic, &at.stiffness].map(folded);
        let n = m.nrows();
        // The Hermitian part of K: cross-coupled stiffness destabilises, but does not belong to an undamped rotor.
        let k = Mat::from_fn(n, n, |i, j| 0.5 * (k[(i, j)] + k[(j, i)].conj()));
        for (whirl, sign) in [(Whirl::Forward, -1.0), (Whirl::Backward, 1.0)] {
            let right = Mat::from_fn(n, n, |i, j| m[(i, j)] + sign * Complex64::I * g[(i, j)]);
            let solved = complex_solution(k.as_ref(), &right);
            keep(whirl, finite(&solved).then(|| complex_eigenvalues(solved.as_ref())).flatten()?);
        }
    } else {
        let n = at.mass.nrows();
        let complex = |f: &dyn Fn(usize, usize) -> Complex64| Mat::from_fn(n, n, f);
        let k = complex(&|i, j| Complex64::from(0.5 * (at.stiffness[(i, j)] + at.stiffness[(j, i)])));
        let right = complex(&|i, j| Complex64::new(at.mass[(i, j)], -at.gyroscopic[(i, j)]));
        let solved = complex_solution(k.as_ref(), &right);
        let (values, vectors) = finite(&solved).then(|| complex_eigenvectors(solved.as_ref())).flatten()?;
        for (c, mu) in values.into_iter().enumerate() {
            let shape: Vec<Complex64> = (0..n).map(|r| vectors[(r, c)]).collect();
            keep(at.whirl(&shape), vec![mu]);
        }
    }
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two displacements in each direction with the modal matrices diag(1, 4) of stiffness and diag(2, 0.04) of damping, in
    /// coordinates turned by an angle.
    fn rotor(angle: f64, isotropic: bool) -> Linear {
        let (s, c) = angle.sin_cos();
        let block =
            |a: f64, b: f64| [[c * c * a + s * s * b, c * s * (a - b)], [c * s * (a - b), s * s * a + c * c * b]];
        let whole =
            |block: [[f64; 2]; 2]| Mat::from_fn(4, 4, |i, j| if i % 2 == j % 2 { block[i / 2][j / 2] } else { 0.0 });
        let none = || Mat::from_fn(4, 4, |_, _| 0.0);
        Linear {
            speed: 0.0,
            mass: whole(block(1.0, 1.0)),
            damping: whole(block(2.0, 0.04)),
            internal: none(),
            gyroscopic: none(),
            stiffness: whole(block(1.0, 4.0)),
            nodes: 0,
            isotropic,
        }
    }

    #[test]
    fn the_double_eigenvalue_of_critical_damping_is_no_mode() {
        for isotropic in [true, false] {
            for k in 0..40 {
                let found = rotor(0.157 * k as f64, isotropic).spectrum(8, false).unwrap();
                // λ = -1 twice for one mode in each direction, and λ = -0.02 ± i √(4 - 0.02²) for the other.
                assert_eq!(found.modes.len(), 2, "{isotropic} {k}: {:?}", found.modes);
                for mode in &found.modes {
                    let off = mode.value - Complex64::new(-0.02, (4.0f64 - 0.0004).sqrt());
                    assert!(off.norm() < 1e-12, "{isotropic} {k}: {}", mode.value);
                }
                // Rounding moves a double eigenvalue by its square root.
                assert!(found.overdamped.iter().all(|own| (own + 1.0).abs() < 1e-6), "{:?}", found.overdamped);
                assert_eq!(found.overdamped.len(), if isotropic { 2 } else { 4 });
            }
        }
    }
}
