//! Folds (limit points, saddle-nodes): the branch turns back in its parameter. Curves in two parameters turn back in
//! one of them, or in both at a cusp.

use crate::contract::{Monitor, Sight};
use crate::diagram::{Kind, Point};
use num_complex::Complex64;

/// Parameter component of the tangent.
pub struct Fold;

impl Monitor for Fold {
    fn kind(&self) -> Kind {
        Kind::Fold
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        at.parameter_slope()
    }

    fn confirms(&self, _at: &Point) -> bool {
        true
    }

    fn reads(&self) -> Sight {
        Sight::Tangent
    }

    fn jump(&self) -> usize {
        1
    }

    fn by_spectrum(&self) -> Option<Box<dyn Monitor>> {
        Some(Box::new(Passage { symmetric: false }))
    }

    fn others_unstable(&self, at: &Point) -> Option<usize> {
        super::others_unstable(at, 1, |z| (z - critical(at)).norm())
    }
}

/// Multiplier passing 1 (eigenvalue passing 0): the fold of a branch whose parameter slope is lost in rounding, as in a
/// canard explosion.
pub(super) struct Passage {
    /// True if a continuous symmetry fixes a multiplier at 1, which then does not count.
    pub symmetric: bool,
}

impl Passage {
    fn spectrum(&self, at: &Point) -> Vec<Complex64> {
        let mut all = at.free_spectrum().to_vec();
        let neutral = at.neutral_multiplier().filter(|_| self.symmetric);
        if let Some(own) = neutral.and_then(|neutral| all.iter().position(|z| *z == neutral)) {
            all.remove(own);
        }
        all
    }
}

impl Monitor for Passage {
    fn kind(&self) -> Kind {
        Kind::Fold
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        super::distance_product(&self.spectrum(at), critical(at))
    }

    fn confirms(&self, at: &Point) -> bool {
        /// Largest distance of the critical multiplier from 1 (eigenvalue from 0). Empirical, as at branch points.
        const NEAR: f64 = 1e-2;
        self.spectrum(at).iter().any(|z| (z - critical(at)).norm() < NEAR)
    }

    fn jump(&self) -> usize {
        1
    }

    fn others_unstable(&self, at: &Point) -> Option<usize> {
        Fold.others_unstable(at)
    }
}

/// Critical value at a fold: eigenvalue 0, multiplier 1.
fn critical(at: &Point) -> f64 {
    if at.solution.period().is_some() { 1.0 } else { 0.0 }
}

/// Turning point of a bifurcation curve in two parameters with respect to one of them only.
pub struct Turn {
    /// Index of the parameter that turns.
    pub free: usize,
}

impl Turn {
    /// True if the parameter is equal at all three points within its error. The equations of the curve may be
    /// degenerate: transcritical points are not folds but solve the equations of folds. The square of the error is then
    /// of the order of rounding, so the error is the square root of the relative machine precision, times a factor of
    /// safety.
    fn stands(&self, ends: [&Point; 2], at: &Point) -> bool {
        const SAFE: f64 = 10.0;
        let value = |point: &Point| point.parameters.get(self.free).copied().unwrap_or(f64::NAN);
        let noise = SAFE * f64::EPSILON.sqrt() * value(ends[0]).abs().max(value(ends[1]).abs());
        ends.iter().all(|end| (value(end) - value(at)).abs() <= noise)
    }
}

impl Monitor for Turn {
    fn kind(&self) -> Kind {
        Kind::Fold
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        at.parameter_slope()
    }

    fn confirms(&self, _at: &Point) -> bool {
        true
    }

    fn confirms_between(&self, ends: [&Point; 2], at: &Point) -> bool {
        !parameters_rest(ends, at) && !self.stands(ends, at)
    }

    fn reads(&self) -> Sight {
        Sight::Tangent
    }

    fn jump(&self) -> usize {
        1
    }
}

/// True if both parameter components of the tangent nearly vanish compared with their values at `ends`: the curve has a
/// cusp in the parameter plane.
pub(super) fn parameters_rest(ends: [&Point; 2], at: &Point) -> bool {
    const LEFT: f64 = 0.02;
    [1, 2].into_iter().all(|back| {
        let slope = |point: &Point| at_end(&point.tangent, back).abs();
        slope(at) < LEFT * slope(ends[0]).max(slope(ends[1]))
    })
}

/// Tangent component along the first of the two parameters of a curve.
pub(super) fn first_slope(at: &Point) -> f64 {
    at_end(&at.tangent, 2)
}

fn at_end(v: &[f64], back: usize) -> f64 {
    v.len().checked_sub(back).map_or(f64::NAN, |i| v[i])
}
