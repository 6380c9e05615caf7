//! The two parameters of a curve.

use foldline::diagram::{Branch, Diagram, Origin};

/// The numbers of both parameters of a curve in two parameters: first that of the branch on which it begins, where that is
/// in the diagram. `None` for a branch in one parameter.
pub fn of(diagram: &Diagram, branch: &Branch) -> Option<[usize; 2]> {
    let (_, second) = branch.held?;
    let base = match &branch.origin {
        Origin::Switch { parent, .. } | Origin::EndOf(parent) => diagram.branch(parent),
        Origin::Seed(_) => None,
    };
    match base {
        Some(base) if base.free == second => Some([second, branch.free]),
        _ => Some([branch.free, second]),
    }
}
