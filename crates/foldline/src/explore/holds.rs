//! Starts of branches on which quantities are held.
//!
//! **Idea.** A branch in several parameters along which quantities keep their values starts at a point of another branch
//! that has these values, or has one of them; the rest are changed gradually from their values there, with the
//! continuation parameter fixed.

use super::System;
use super::growth::{self, Line};
use super::plan::{BranchPlan, Holds};
use crate::continuation::{Settings, Station};
use crate::diagram::{Branch, Kind, Point, Shown};
use crate::special::on_levels::Level;
use crate::special::quantity::Quantity;

/// Shortest part of the way of the quantities to their values that is tried at once.
const SHORTEST: f64 = 1.0 / 256.0;
/// Deviation from a level, relative, of a located mark.
const MARKED: f64 = 1e-5;

/// Point of a branch with the value of a held quantity: a mark there, next to `near` if that is given. `None` if all
/// quantities keep the values of the start.
pub fn on_branch(
    system: &System,
    plan: &BranchPlan,
    branch: &Branch,
    ended: &Result<Point, String>,
) -> Option<Result<Point, String>> {
    let levels: Vec<&Level> = plan.holds.levels.iter().filter(|level| level.value.is_finite()).collect();
    if levels.is_empty() {
        return None;
    }
    let has = |point: &Point, level: &Level| {
        let found = level.quantity.on(point, system.field);
        found.is_some_and(|value| {
            level.off(value).abs() <= MARKED * (level.value.abs() + system.size_of(level.quantity))
        })
    };
    let marks: Vec<&Point> = branch.special.iter().filter(|s| s.kind == Kind::Mark).map(|s| &s.point).collect();
    let fitting: Vec<(usize, &Point)> = marks
        .into_iter()
        .chain(ended.iter())
        .map(|point| (levels.iter().filter(|level| has(point, level)).count(), point))
        .filter(|(count, _)| *count > 0)
        .collect();
    let most = fitting.iter().map(|(count, _)| *count).max();
    let value = |point: &Point| point.parameters.get(branch.free).copied().unwrap_or(f64::NAN);
    let best = fitting.into_iter().filter(|(count, _)| Some(*count) == most).map(|(_, point)| point);
    let found = match plan.holds.near {
        Some(near) => best.min_by(|a, b| (value(a) - near).abs().total_cmp(&(value(b) - near).abs())),
        None => best.min_by_key(|point| point.position),
    };
    Some(found.cloned().ok_or_else(|| {
        let reach = |level: &&Level| {
            let values = branch.points.iter().filter_map(|point| level.quantity.on(point, system.field));
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (v.min(a), v.max(b)));
            let seen = match low <= high {
                true => format!(" (its points have values from {:.6} to {:.6})", Shown(low), Shown(high)),
                false => String::new(),
            };
            format!("{} = {}{seen}", level.name, Shown(level.value))
        };
        let wanted: Vec<String> = levels.iter().map(reach).collect();
        format!("no point of the branch {} has {}", branch.name, wanted.join(" or "))
    }))
}

/// The holds with values that are not given taken from `start`.
///
/// # Errors
/// A sentence that names a quantity that the start does not have.
pub fn resolved(system: &System, holds: &Holds, start: &Point) -> Result<Holds, String> {
    let level = |own: &Level| {
        let here = own.quantity.on(start, system.field).filter(|value| value.is_finite()).ok_or_else(|| {
            if own.quantity == Quantity::Rotation {
                return "only tori have a rotation number that can be held; start from a branch of tori".to_string();
            }
            format!(
                "{} is not defined at the start\nlikely cause: equilibria have neither a period nor a phase, and without \
                 forcing the phase of a cycle is arbitrary\nwhat to do: hold another quantity",
                own.name
            )
        })?;
        Ok(Level { value: if own.value.is_finite() { own.value } else { here }, ..own.clone() })
    };
    let levels = holds.levels.iter().map(level).collect::<Result<_, String>>()?;
    Ok(Holds { levels, ..holds.clone() })
}

/// First point of a branch with held quantities, from a solution with other values of them.
///
/// # Errors
/// A sentence that says how far the quantities came.
pub fn first(
    system: &System,
    plan: &BranchPlan,
    holds: &Holds,
    degree: usize,
    settings: &Settings,
    start: &Point,
) -> Result<Station, String> {
    let from: Vec<f64> = holds
        .levels
        .iter()
        .map(|level| level.quantity.on(start, system.field).map_or(0.0, |value| level.off(value)))
        .collect();
    let (mut done, mut step, mut point) = (0.0, 1.0, start.clone());
    loop {
        let goal = 1.0f64.min(done + step);
        let shifted = |(level, off): (&Level, &f64)| match goal < 1.0 {
            true => Level { value: level.value + (1.0 - goal) * off, ..level.clone() },
            false => level.clone(),
        };
        let levels = holds.levels.iter().zip(&from).map(shifted).collect();
        let there = Holds { levels, ..holds.clone() };
        let system = System { holds: Some(&there), ..system.clone() };
        let mut problem = Line::new(plan.free).problem(&system, degree, &point);
        match growth::polished(&mut *problem, settings, &point) {
            Ok(found) if goal >= 1.0 => return Ok(found),
            Ok(found) => {
                (done, point) = (goal, found.point);
                step *= 2.0;
            }
            Err(_) if step > SHORTEST => step *= 0.5,
            Err(why) => {
                let level = |(level, off): (&Level, &f64)| {
                    let value = level.value + (1.0 - done) * off;
                    format!("{} = {:.6} instead of {}", level.name, Shown(value), Shown(level.value))
                };
                let reached: Vec<String> = holds.levels.iter().zip(&from).map(level).collect();
                return Err(format!(
                    "the held quantities could not be brought to their values; reached {}: {why}\nlikely cause: with the \
                     continuation parameter fixed the other free parameters do not change them, or not as far\nwhat to \
                     do: start from a branch that reaches these values, or hold without values what the start has",
                    reached.join(", ")
                ));
            }
        }
    }
}
