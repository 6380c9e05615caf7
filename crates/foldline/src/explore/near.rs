//! Points inside a branch, given by values that they have.
//!
//! **Idea.** The values select the closest point that was computed. If one of them is that of the continuation parameter,
//! Newton's method then brings the point to exactly this value, so that the start does not depend on the steps of the
//! branch.
//!
//! **Fails when** the branch does not have the parameter value there, as beyond a fold.

use super::System;
use super::growth::{is_doubled, polished, problem_of, settings};
use super::plan::{Near, Plan};
use crate::contract::Observer;
use crate::diagram::{Branch, Kind, Origin, Point, Shown};
use crate::special::quantity::Quantity;

/// Factor on the distance to the neighbouring points within which the solution at the exact value must lie.
const STAYS: f64 = 1.5;

/// Returns the origin of what starts at such a point of `branch`.
pub fn origin(near: &Near, branch: Option<&Branch>, point: &Result<Point, String>) -> Origin {
    let value = branch.zip(point.as_ref().ok()).and_then(|(branch, point)| point.parameters.get(branch.free).copied());
    Origin::Switch { parent: near.name.clone(), kind: Kind::Mark, parameter: value.unwrap_or(f64::NAN) }
}

/// Returns the point of `branch` with the given values.
///
/// # Errors
/// A sentence that says what the branch has instead.
pub fn point_of(
    system: &System,
    plan: &Plan,
    near: &Near,
    branch: &Branch,
    observer: &dyn Observer,
) -> Result<Point, String> {
    let points = || branch.points.iter().chain(branch.special.iter().map(|special| &special.point));
    let reach: Vec<[f64; 2]> = near.levels.iter().map(|level| reach(system, points(), level.quantity)).collect();
    if let Some((level, _)) = near.levels.iter().zip(&reach).find(|(_, [low, high])| low > high) {
        return Err(format!("no point of the branch {} has a value of {}", branch.name, level.name));
    }
    let off = |point: &Point| {
        let own = near.levels.iter().zip(&reach).map(|(level, [low, high])| {
            let size = if high > low { high - low } else { system.size_of(level.quantity).max(f64::MIN_POSITIVE) };
            level.quantity.on(point, system.field).map_or(f64::INFINITY, |value| (level.off(value) / size).abs())
        });
        own.fold(0.0, f64::max)
    };
    let closest = points()
        .min_by(|a, b| off(a).total_cmp(&off(b)))
        .ok_or_else(|| format!("the branch {} has no points", branch.name))?;
    let whole = match closest.is_light() {
        true => observer.recall(branch, closest.position).filter(|point| !point.is_light()),
        false => Some(closest.clone()),
    };
    let point = whole.ok_or_else(|| {
        let value = closest.parameters.get(branch.free).copied().unwrap_or(f64::NAN);
        format!("the profile of the point at {:.6} of the branch {} was not kept", Shown(value), branch.name)
    })?;
    let asked = near.levels.iter().find(|level| level.quantity == Quantity::Parameter(branch.free));
    match asked.filter(|level| point.parameters.get(branch.free) != Some(&level.value)) {
        Some(level) => exactly(system, plan, branch, point, level.value),
        None => Ok(point),
    }
}

/// Smallest and largest value of a quantity; the smallest is infinite if no point has one.
fn reach<'p>(system: &System, points: impl Iterator<Item = &'p Point>, quantity: Quantity) -> [f64; 2] {
    let values = points.filter_map(|point| quantity.on(point, system.field)).filter(|value| value.is_finite());
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
}

/// Returns the solution next to a point of the branch at exactly this value of its parameter.
fn exactly(system: &System, plan: &Plan, branch: &Branch, point: Point, value: f64) -> Result<Point, String> {
    let around = [f64::NEG_INFINITY, f64::INFINITY];
    let settings = settings(system, plan.tolerance, around, 0);
    let mut guess = point.clone();
    guess.parameters[branch.free] = value;
    let mut problem = problem_of(system, branch.free, plan.degree, &guess, is_doubled(branch));
    let apart = |a: &Point, b: &Point| a.distance(b, system.measure());
    let neighbours = branch.points.iter().filter(|own| (own.position - point.position).abs() <= 1);
    let room = neighbours.map(|own| apart(own, &point)).filter(|room| room.is_finite()).fold(0.0, f64::max);
    let found = polished(&mut *problem, &settings, &guess).map_err(|why| why.to_string());
    let found = found.and_then(|found| match apart(&found.point, &point) <= STAYS * room + settings.tolerance {
        true => Ok(found.point),
        false => Err("Newton's method led to another solution".to_string()),
    });
    found.map_err(|why| {
        let closest = point.parameters.get(branch.free).copied().unwrap_or(f64::NAN);
        format!(
            "no solution at {:.6} was found next to the closest point of the branch {}, at {:.6}: {why}\nlikely cause: \
             the branch turns back before it reaches this value\nwhat to do: give the values of a point that it has",
            Shown(value),
            branch.name,
            Shown(closest)
        )
    })
}
