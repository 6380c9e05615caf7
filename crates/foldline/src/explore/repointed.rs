//! Change of the collocation points in the course of a branch.
//!
//! **Idea.** A mode may become fast along a branch, or a fast one may begin to grow. Where the multipliers are
//! doubtful, or the mesh is large, the collocation points are chosen again; see [`crate::problem::stiffness`]. The
//! branch then continues from the same solution at the other points. On either side of its start a branch changes to
//! Radau points at most once, and to Gauss points at most once.
//!
//! **Fails when** Newton's method does not converge at the other points; the branch then keeps its points.

use super::System;
use crate::continuation::corrector::{Plane, Station, settle};
use crate::continuation::{Failure, Settings};
use crate::contract::ZeroProblem;
use crate::diagram::{Cost, Cycle, Point, Solution};
use crate::problem::gauss::Points;
use crate::problem::stiffness;

/// Error of the multipliers, and number of intervals, beyond which the points are put in question. Both only save the
/// test where there is little to gain: smooth cycles have errors below 1e-6 on fewer than 60 intervals.
const DOUBTFUL: f64 = 1e-3;
const LARGE: usize = 60;

/// Collocation points other than those of a cycle that suit it better.
pub(super) fn better(system: &System, at: &Point) -> Option<Points> {
    let Solution::Cycle(cycle) = &at.solution else { return None };
    let doubtful = at.trust.spectrum.is_nan() || at.trust.spectrum > DOUBTFUL || cycle.intervals() > LARGE;
    let suited = || stiffness::suited(system.field, &system.scales, &at.parameters, cycle);
    if doubtful { Some(suited()).filter(|points| *points != cycle.points) } else { None }
}

/// A point without conditions, with its tangent, at other collocation points.
pub(super) fn repointed(point: &Point, points: Points) -> Point {
    let Solution::Cycle(cycle) = &point.solution else { return point.clone() };
    let size = cycle.profile.len();
    let mut tangent = point.tangent.clone();
    if tangent.len() > size {
        let along = Cycle { profile: tangent[..size].to_vec(), gain: Vec::new(), ..cycle.clone() };
        tangent[..size].copy_from_slice(&along.with_points(points).profile);
    }
    Point { solution: Solution::Cycle(cycle.clone().with_points(points)), tangent, ..point.clone() }
}

/// Solves again next to `point`, across its tangent.
///
/// # Errors
/// See [`Failure`].
pub(super) fn again(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    point: &Point,
    direction: f64,
) -> Result<Station, Failure> {
    let u = problem.unknowns_of(point);
    problem.anchor(&u);
    let row = point.tangent.iter().map(|t| direction * t).collect();
    let plane = Plane { row, base: u.clone(), distance: 0.0 };
    let mut found = settle(problem, settings, plane, u, direction, &mut Cost::default())?;
    (found.point.position, found.point.step) = (point.position, point.step);
    Ok(found)
}
