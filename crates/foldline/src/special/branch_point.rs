//! Branch points: intersections with another branch of the same type.
//!
//! **Equations.** With τ the parameter component of the tangent and z the eigenvalues (z = λ) or multipliers (z = μ -
//! 1):
//!
//!   (1)  ∏ z / τ = 0, the determinant of F_u bordered by the tangent, up to a nonzero factor
//!   (2)  p(1) / (τ |p|) = 0, the same with the characteristic polynomial p and the norm of its coefficients, which is
//!        smooth also where multipliers meet
//!   (3)  F_u φ = 0, φ ⊥ tangent:  direction in the plane spanned by the tangents of both branches

use crate::contract::{Monitor, ZeroProblem};
use crate::diagram::{FLAT, Kind, Point};
use num_complex::Complex64;

/// Zero eigenvalue (multiplier 1) without a fold.
pub struct BranchPoint {
    /// True if a continuous symmetry fixes a multiplier at 1, which therefore does not indicate branch points.
    pub symmetric: bool,
}

impl BranchPoint {
    /// Spectrum without a multiplier that a continuous symmetry fixes at 1.
    fn spectrum_without_symmetry(&self, at: &Point) -> Vec<Complex64> {
        let neutral = at.neutral_multiplier().filter(|_| self.symmetric);
        let mut spectrum = at.free_spectrum().to_vec();
        if let Some(index) = neutral.and_then(|neutral| spectrum.iter().position(|z| *z == neutral)) {
            spectrum.remove(index);
        }
        spectrum
    }
}

impl Monitor for BranchPoint {
    fn kind(&self) -> Kind {
        Kind::BranchPoint
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        let centre = if at.solution.period().is_some() { 1.0 } else { 0.0 };
        // At a fold both factors vanish, at slightly different points numerically, and their product would change sign
        // twice.
        let slope = at.parameter_slope();
        super::distance_product(&self.spectrum_without_symmetry(at), centre)
            / slope.abs().max(f64::MIN_POSITIVE).copysign(slope)
    }

    fn confirms(&self, at: &Point) -> bool {
        // The product also vanishes at a fold; there the tangent has no parameter component.
        let centre = if at.solution.period().is_some() { 1.0 } else { 0.0 };
        let largest = at.spectrum.iter().map(|z| z.norm()).fold(1e-300, f64::max).min(1.0);
        let closest =
            self.spectrum_without_symmetry(at).iter().map(|z| (z - centre).norm()).fold(f64::INFINITY, f64::min);
        // A single eigenvalue cannot be compared with others.
        (closest < 1e-2 * largest || at.spectrum.len() == 1) && at.parameter_slope().abs() > FLAT
    }

    fn smooth(&self, at: &Point) -> Option<f64> {
        at.solution.period()?;
        // Coefficients of the characteristic polynomial, the highest power first.
        let mut polynomial = vec![Complex64::new(1.0, 0.0)];
        for z in self.spectrum_without_symmetry(at) {
            polynomial.push(Complex64::default());
            for k in (1..polynomial.len()).rev() {
                let before = polynomial[k - 1];
                polynomial[k] -= z * before;
            }
        }
        let size = polynomial.iter().map(|c| c.re * c.re).sum::<f64>().sqrt();
        let slope = at.parameter_slope();
        let value = polynomial.iter().map(|c| c.re).sum::<f64>() / size;
        Some(value / slope.abs().max(f64::MIN_POSITIVE).copysign(slope)).filter(|value| value.is_finite())
    }

    fn jump(&self) -> usize {
        1
    }

    fn passed(&self, at: &Point) -> Option<usize> {
        let centre = if at.solution.period().is_some() { 1.0 } else { 0.0 } + super::rounding(at);
        Some(self.spectrum_without_symmetry(at).iter().filter(|z| z.im == 0.0 && z.re > centre).count())
    }

    fn by_spectrum(&self) -> Option<Box<dyn Monitor>> {
        Some(Box::new(OfFamily))
    }

    fn others_unstable(&self, at: &Point) -> Option<usize> {
        let centre = if at.solution.period().is_some() { 1.0 } else { 0.0 };
        super::others_unstable(at, 1, |z| (z - centre).norm())
    }
}

/// Collision at 1 of a pair of multipliers of a conservative system that then leaves the unit circle: another family
/// branches off. Along the family a further multiplier stays 1 and the parameter is constant.
struct OfFamily;

impl Monitor for OfFamily {
    fn kind(&self) -> Kind {
        Kind::BranchPoint
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        super::distance_product(&BranchPoint { symmetric: true }.spectrum_without_symmetry(at), 1.0)
    }

    fn confirms(&self, at: &Point) -> bool {
        /// Largest distance of the pair from 1: the square root of the bound for a single multiplier at other branch
        /// points, since a colliding pair depends on the parameter like a square root.
        const NEAR: f64 = 0.1;
        BranchPoint { symmetric: true }.spectrum_without_symmetry(at).iter().any(|z| (z - 1.0).norm() < NEAR)
    }

    fn jump(&self) -> usize {
        1
    }
}

/// Null vector of F_u orthogonal to the tangent at a branch point, of unit length. The problem must be on the mesh of
/// `u`, with its reference there. `None` if there is none.
pub fn direction(problem: &mut dyn ZeroProblem, u: &[f64], tangent: &[f64]) -> Option<Vec<f64>> {
    kernel(problem, u, tangent, 1)?.pop()
}

/// Returns `dimension` orthonormal null vectors of F_u orthogonal to the tangent, by subspace inverse iteration.
/// Preconditions as for [`direction`].
pub fn kernel(problem: &mut dyn ZeroProblem, u: &[f64], tangent: &[f64], dimension: usize) -> Option<Vec<Vec<f64>>> {
    // At the point itself the matrix may be exactly singular; slightly off it the null vectors are nearly the same.
    [0.0, 1e-8].into_iter().find_map(|distance| {
        let beside: Vec<f64> = u.iter().zip(tangent).map(|(x, t)| x + distance * t).collect();
        problem.factorise(&beside, tangent).ok()?;
        null_vectors(&mut *problem, tangent, dimension)
    })
}

/// Share of the square of a vector that must be left without its component along the parameter, for the next iteration to
/// start from it.
const LEFT: f64 = 1e-8;

/// The vectors of [`kernel`], from the last factorisation.
fn null_vectors(problem: &mut dyn ZeroProblem, tangent: &[f64], dimension: usize) -> Option<Vec<Vec<f64>>> {
    let size = problem.unknowns();
    let start =
        |j: usize| -> Vec<f64> { (0..size).map(|k| ((k * k) as f64 * (0.37 + 0.11 * j as f64) + 0.2).sin()).collect() };
    let mut vectors: Vec<Vec<f64>> = (0..dimension).map(start).collect();
    let mut next = vec![0.0; size];
    for _ in 0..4 {
        for j in 0..dimension {
            let (done, rest) = vectors.split_at_mut(j);
            let v = &mut rest[0];
            let whole = problem.dot(v, v);
            v[size - 1] = 0.0;
            // Nothing is left of a null vector in the direction of the parameter alone.
            if problem.dot(v, v) < LEFT * whole {
                *v = start(j);
                v[size - 1] = 0.0;
            }
            problem.solve(v, &mut next);
            if !orthonormalised(problem, &mut next, done, 0.0) {
                return None;
            }
            v.copy_from_slice(&next);
        }
    }
    for j in 0..dimension {
        let (done, rest) = vectors.split_at_mut(j);
        let v = &mut rest[0];
        let along = problem.dot(v, tangent);
        v.iter_mut().zip(tangent).for_each(|(a, t)| *a -= along * t);
        if !orthonormalised(problem, v, done, 0.5) {
            return None;
        }
    }
    Some(vectors)
}

/// Makes a vector orthogonal to some orthonormal ones and normalises it. False if its remaining length is at most
/// `least`.
fn orthonormalised(problem: &dyn ZeroProblem, vector: &mut [f64], others: &[Vec<f64>], least: f64) -> bool {
    for other in others {
        let along = problem.dot(vector, other);
        vector.iter_mut().zip(other).for_each(|(a, b)| *a -= along * b);
    }
    let norm = problem.dot(vector, vector).sqrt();
    vector.iter_mut().for_each(|a| *a /= norm);
    norm.is_finite() && norm > least
}
