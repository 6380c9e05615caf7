//! Folds (limit points, saddle-nodes): the branch turns back in its parameter. Curves in two parameters turn back in one of them, or
//! at a cusp in both.

use crate::contract::{Monitor, Sight};
use crate::diagram::{Kind, Point, Solution};

/// The parameter component of the tangent.
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
        Some(Box::new(Passage))
    }

    fn others_unstable(&self, at: &Point) -> Option<usize> {
        super::others_unstable(at, 1, |z| (z - critical(at)).norm())
    }
}

/// A multiplier that passes 1 (an eigenvalue that passes 0): the fold of a branch whose parameter slope is lost in rounding, as in a
/// canard explosion.
struct Passage;

impl Monitor for Passage {
    fn kind(&self) -> Kind {
        Kind::Fold
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        super::distance_product(at.free_spectrum(), critical(at))
    }

    fn confirms(&self, at: &Point) -> bool {
        /// Largest distance of the critical multiplier from 1 (eigenvalue from 0). Empirical, and the same as at branch points.
        const NEAR: f64 = 1e-2;
        at.free_spectrum().iter().any(|z| (z - critical(at)).norm() < NEAR)
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
    if matches!(at.solution, Solution::Cycle(_)) { 1.0 } else { 0.0 }
}

/// The same where something is held along a curve in two parameters, and one of them is to turn alone.
pub struct Turn {
    /// Index of the parameter that turns.
    pub free: usize,
}

impl Turn {
    /// True if the parameter is the same at all three points as far as can be told. Where the equations of the curve are degenerate, as at
    /// transcritical points, which are no folds but solve the equations of folds, the square of its error is rounding: the root of that
    /// relative to its size, times a factor of safety.
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

/// Whether neither of the last two components of the tangent, those along the parameters of a curve in two of them, is left of what
/// both are at `ends`: the curve has a cusp in the plane of the parameters.
pub(super) fn parameters_rest(ends: [&Point; 2], at: &Point) -> bool {
    const LEFT: f64 = 0.02;
    [1, 2].into_iter().all(|back| {
        let slope = |point: &Point| at_end(&point.tangent, back).abs();
        slope(at) < LEFT * slope(ends[0]).max(slope(ends[1]))
    })
}

/// The component along the first parameter of a curve in two.
pub(super) fn first_slope(at: &Point) -> f64 {
    at_end(&at.tangent, 2)
}

fn at_end(v: &[f64], back: usize) -> f64 {
    v.len().checked_sub(back).map_or(f64::NAN, |i| v[i])
}
