//! Folds (limit points, saddle-nodes): the branch turns back in its parameter.

use crate::contract::Monitor;
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

    fn reads_spectrum(&self) -> bool {
        false
    }

    fn jump(&self) -> usize {
        1
    }

    fn others_unstable(&self, at: &Point) -> Option<usize> {
        let centre = if matches!(at.solution, Solution::Cycle(_)) { 1.0 } else { 0.0 };
        super::others_unstable(at, 1, |z| (z - centre).norm())
    }
}
