//! Branch points: another branch of the same type crosses.
//!
//! **Equations.** With τ the parameter component of the tangent and z the eigenvalues (z = λ) or multipliers (z = μ - 1):
//!
//!   (1)  ∏ z / τ = 0, the determinant of F_u with the tangent for a last row but for a factor that is not 0
//!   (2)  F_u φ = 0, φ ⊥ tangent:  direction into the plane that both branches span

use crate::contract::{Monitor, ZeroProblem};
use crate::diagram::{FLAT, Kind, Point, Solution};
use num_complex::Complex64;

/// An eigenvalue 0 (a multiplier 1) without a fold.
pub struct BranchPoint {
    /// True if a multiplier is 1 because of a continuous symmetry and therefore does not indicate branch points.
    pub symmetric: bool,
}

impl BranchPoint {
    /// The spectrum without a multiplier that is 1 because of a continuous symmetry.
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
        let centre = if matches!(at.solution, Solution::Cycle(_)) { 1.0 } else { 0.0 };
        // At a fold both vanish, not quite at the same place, and the product would change sign twice.
        let slope = at.parameter_slope();
        super::distance_product(&self.spectrum_without_symmetry(at), centre)
            / slope.abs().max(f64::MIN_POSITIVE).copysign(slope)
    }

    fn confirms(&self, at: &Point) -> bool {
        // At a fold, too, the product vanishes; there the tangent has no parameter component.
        let centre = if matches!(at.solution, Solution::Cycle(_)) { 1.0 } else { 0.0 };
        let largest = at.spectrum.iter().map(|z| z.norm()).fold(1e-300, f64::max).min(1.0);
        let closest =
            self.spectrum_without_symmetry(at).iter().map(|z| (z - centre).norm()).fold(f64::INFINITY, f64::min);
        // A single eigenvalue cannot be compared with others.
        (closest < 1e-2 * largest || at.spectrum.len() == 1) && at.parameter_slope().abs() > FLAT
    }

    fn jump(&self) -> usize {
        1
    }

    fn passed(&self, at: &Point) -> Option<usize> {
        let centre = if matches!(at.solution, Solution::Cycle(_)) { 1.0 } else { 0.0 };
        Some(self.spectrum_without_symmetry(at).iter().filter(|z| z.im == 0.0 && z.re > centre).count())
    }

    fn by_spectrum(&self) -> Option<Box<dyn Monitor>> {
        Some(Box::new(OfFamily))
    }

    fn others_unstable(&self, at: &Point) -> Option<usize> {
        let centre = if matches!(at.solution, Solution::Cycle(_)) { 1.0 } else { 0.0 };
        super::others_unstable(at, 1, |z| (z - centre).norm())
    }
}

/// A pair of multipliers of a conservative system that meets at 1 and leaves the unit circle: another family leaves that one. A further multiplier
/// is 1 all along the family, and the parameter stands still.
struct OfFamily;

impl Monitor for OfFamily {
    fn kind(&self) -> Kind {
        Kind::BranchPoint
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        super::distance_product(&BranchPoint { symmetric: true }.spectrum_without_symmetry(at), 1.0)
    }

    fn confirms(&self, at: &Point) -> bool {
        /// Largest distance of the pair from 1: the root of that of a single multiplier at other branch points, since a pair that meets is as
        /// sensitive as that.
        const NEAR: f64 = 0.1;
        BranchPoint { symmetric: true }.spectrum_without_symmetry(at).iter().any(|z| (z - 1.0).norm() < NEAR)
    }

    fn jump(&self) -> usize {
        1
    }
}

/// The null vector of F_u orthogonal to the tangent at a branch point, of unit length; the problem must be on the mesh of
/// `u` and anchored there. `None` if there is none.
pub fn direction(problem: &mut dyn ZeroProblem, u: &[f64], tangent: &[f64]) -> Option<Vec<f64>> {
    kernel(problem, u, tangent, 1)?.pop()
}

/// Orthonormal null vectors of F_u orthogonal to the tangent, as many as `dimension` says, by inverse iteration of a subspace.
/// Conditions as for [`direction`].
pub fn kernel(problem: &mut dyn ZeroProblem, u: &[f64], tangent: &[f64], dimension: usize) -> Option<Vec<Vec<f64>>> {
    let size = problem.unknowns();
    // Exactly at the point there may be nothing to factorise; a little beside it the null vectors are nearly the same.
    if problem.factorise(u, tangent).is_err() {
        let beside: Vec<f64> = u.iter().zip(tangent).map(|(x, t)| x + 1e-8 * t).collect();
        problem.factorise(&beside, tangent).ok()?;
    }
    let start = |j: usize| (0..size).map(|k| ((k * k) as f64 * (0.37 + 0.11 * j as f64) + 0.2).sin()).collect();
    let mut vectors: Vec<Vec<f64>> = (0..dimension).map(start).collect();
    let mut next = vec![0.0; size];
    for _ in 0..4 {
        for j in 0..dimension {
            let (done, rest) = vectors.split_at_mut(j);
            let v = &mut rest[0];
            v[size - 1] = 0.0;
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

/// Makes a vector orthogonal to some that are orthonormal, and of unit length. False if it was not longer than `least` then.
fn orthonormalised(problem: &dyn ZeroProblem, vector: &mut [f64], others: &[Vec<f64>], least: f64) -> bool {
    for other in others {
        let along = problem.dot(vector, other);
        vector.iter_mut().zip(other).for_each(|(a, b)| *a -= along * b);
    }
    let norm = problem.dot(vector, vector).sqrt();
    vector.iter_mut().for_each(|a| *a /= norm);
    norm.is_finite() && norm > least
}
