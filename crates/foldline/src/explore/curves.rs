//! Bifurcation curves: continuation of a special point in two parameters.
//!
//! **Idea.** The special point of a finished branch, corrected with the defining system of its bifurcation, is the
//! first point of a curve in the branch's parameter and a second one. It is followed like any other branch.

use super::System;
use super::growth::{self, Beginning, Growth, Line};
use super::plan::{CurvePlan, Plan};
use crate::continuation::{Settings, UNCROSSED};
use crate::contract::Observer;
use crate::diagram::{Branch, Ending, Family, Kind, Origin, Point, Shown, SpecialPoint};
use crate::special::mark::Mark;
use crate::special::unfolded::{Unfolded, sizes};

/// Factor on the plan's tolerance: the error of a special point along the branch exceeds that of the solutions.
const SHARPER: f64 = 0.2;

/// Returns the special point of `branch` from which a curve of the plan starts.
///
/// # Errors
/// A sentence that lists the special points of the branch, if none fits.
pub fn start<'b>(plan: &CurvePlan, branch: &'b Branch) -> Result<&'b SpecialPoint, String> {
    if branch.family == Family::Torus && plan.hold != Kind::Fold {
        return Err(format!(
            "of tori only folds can be continued in two parameters ({} is a branch of tori, and `hold` is {})",
            branch.name, plan.hold
        ));
    }
    let value = |special: &SpecialPoint| special.point.parameters.get(branch.free).copied().unwrap_or(0.0);
    // From a curve: at an extremum of its second parameter, or of the one that is solved for along it.
    let kind = match (branch.held, branch.also.is_empty()) {
        (Some(_), _) => Kind::Fold,
        (None, false) if branch.levels.is_empty() => Kind::Peak,
        _ => plan.hold,
    };
    let fitting = branch.special.iter().filter(|special| special.kind == kind);
    let found = match plan.near {
        Some(near) => fitting.min_by(|a, b| (value(a) - near).abs().total_cmp(&(value(b) - near).abs())),
        None => fitting.min_by_key(|special| special.point.position),
    };
    found.ok_or_else(|| {
        let others: Vec<String> = branch.special.iter().map(|s| format!("{} {:.6}", s.kind, Shown(value(s)))).collect();
        let there = if others.is_empty() { "none".into() } else { others.join(", ") };
        let what = if kind == plan.hold { format!("no {kind} point") } else { "no extremum".to_string() };
        format!("the branch {} has {what} (its special points: {there})", branch.name)
    })
}

/// Settings of a curve, and the sides to follow.
fn settings(system: &System, plan: &Plan, curve: &CurvePlan, first: usize, value: f64) -> (Settings, [bool; 2]) {
    let [own, second] = curve.ranges;
    let (range, sides) = match curve.until {
        Some(target) if target >= value => ([second[0].min(value), target], [false, true]),
        Some(target) => ([target, second[1].max(value)], [true, false]),
        None => (second, [true, true]),
    };
    let usual = growth::settings(system, SHARPER * plan.tolerance, range, curve.max_points);
    (Settings { bounds: vec![(first, own)], stability: false, ..usual }, sides)
}

/// Follows a curve of the plan, or the part of it that is missing; `parent` is the branch on which it starts. Returns
/// the curve, and false if the observer wants to stop.
pub fn follow(
    system: &System,
    plan: &Plan,
    curve: &CurvePlan,
    parent: &Branch,
    earlier: Option<&Branch>,
    observer: &dyn Observer,
) -> (Branch, bool) {
    follow_from(system, plan, curve, parent, start(curve, parent), &curve.marks, earlier, observer)
}

/// Follows a curve of the plan like [`follow`], from a given special point and with values to mark.
pub fn follow_from(
    system: &System,
    plan: &Plan,
    curve: &CurvePlan,
    parent: &Branch,
    special: Result<&SpecialPoint, String>,
    marks: &[Mark],
    earlier: Option<&Branch>,
    observer: &dyn Observer,
) -> (Branch, bool) {
    let sizes = special.as_ref().map_or(system.scales.clone(), |special| sizes(&special.point, &system.scales));
    let unfolded = match &special {
        Ok(special) => Unfolded::at(system.field, &sizes, &special.point),
        Err(_) => Unfolded::new(system.field, &sizes),
    };
    let system = &System { unfolded: Some(&unfolded), ..system.clone() };
    let growth = |settings: &Settings, sides: [bool; 2], branch: &mut Branch, beginning: Option<Beginning>| {
        let growth = Growth {
            system,
            settings,
            degree: plan.degree,
            ties: Vec::new(),
            sides,
            parents: &[],
            marks,
            observer,
            whole: false,
            sparse: false,
        };
        match beginning {
            Some(beginning) => growth.begin(branch, beginning),
            None => growth.resume(branch),
        }
    };
    if let Some(known) = earlier.filter(|branch| !branch.points.is_empty()) {
        let mut branch = known.clone();
        let at = branch.points.iter().find(|p| p.position == 0).map_or(f64::NAN, |p| p.parameters[curve.free]);
        let (settings, sides) = settings(system, plan, curve, parent.free, at);
        let going = growth(&settings, sides, &mut branch, None);
        return (branch, going);
    }
    let parameter = special.as_ref().map_or(f64::NAN, |s| s.point.parameters[parent.free]);
    let origin = Origin::Switch { parent: parent.name.clone(), kind: curve.hold, parameter };
    let mut branch = Branch::new(&curve.name, parent.family, curve.free, origin);
    branch.held = Some((curve.hold, parent.free));
    let begun = special.and_then(|special| {
        let at = special.point.parameters[curve.free];
        system.repeats(&special.point.parameters, &[(parent.free, curve.ranges[0]), (curve.free, curve.ranges[1])])?;
        let (settings, sides) = settings(system, plan, curve, parent.free, at);
        let line = Line { held: branch.held, ..Line::new(curve.free) };
        let mut problem = line.problem(system, plan.degree, &special.point);
        let station = growth::polished(&mut *problem, &settings, &special.point).map_err(|why| why.to_string())?;
        // (The tangent shows how fast the unfolding residual would grow.)
        if problem.departure(&station.u) > settings.newton_tolerance()
            || problem.departure(&station.tangent) > settings.tolerance
        {
            let value = special.point.parameters[parent.free];
            return Err(format!(
                "the branches cross at {:.6} only for this value of the second parameter\nlikely cause: {}\nwhat to \
                 do: {}",
                Shown(value),
                UNCROSSED.0,
                UNCROSSED.1
            ));
        }
        Ok((settings, sides, station))
    });
    let going = match begun {
        Ok((settings, sides, station)) => growth(&settings, sides, &mut branch, Some(Beginning::Inside(station))),
        Err(why) => super::family::without_start(observer, &mut branch, why),
    };
    (branch, going)
}

/// Returns the solution at the end of a curve, as a start for a branch in the parent's parameter.
///
/// # Errors
/// A sentence that says why there is none.
pub fn end_of(system: &System, plan: &Plan, curve: &CurvePlan, branch: &Branch) -> Result<Point, String> {
    let start = branch.points.iter().find(|p| p.position == 0).map(|p| p.parameters[curve.free]);
    let backward = matches!((curve.until, start), (Some(target), Some(value)) if target < value);
    let (ending, point) =
        if backward { (&branch.ends[0], branch.points.first()) } else { (&branch.ends[1], branch.points.last()) };
    let arrived = |value: f64| curve.until.is_none_or(|target| (value - target).abs() <= 1e-9 * branch.size(target));
    if !curve.further.is_empty() {
        return Err(format!(
            "no branch starts from a curve in more than two parameters\nlikely cause: {} is one\nwhat to do: start from the branch on which \
             it lies",
            curve.name
        ));
    }
    if matches!(curve.hold, Kind::Homoclinic | Kind::Heteroclinic | Kind::SaddleNodeHomoclinic) {
        return Err(format!(
            "no branch starts from connecting orbits\nlikely cause: {} is a curve of them, and an orbit exists for isolated \
             values of the branch's parameter only\nwhat to do: start from cycles or equilibria",
            curve.name
        ));
    }
    match (ending, point) {
        (Some(Ending::Bound(_)), Some(point)) if arrived(point.parameters[curve.free]) => {
            let first = branch.held.map_or(curve.free, |(_, first)| first);
            leaving(system, plan, first, point)
        }
        (Some(other), _) => Err(format!("the curve {} did not reach its end: {other}", curve.name)),
        _ => Err(format!("the curve {} is unfinished", curve.name)),
    }
}

/// Returns a solution near a point of a curve, as a start for a branch in the parent's parameter, of index `first`.
///
/// # Errors
/// A sentence that says why there is none.
pub fn leaving(system: &System, plan: &Plan, first: usize, point: &Point) -> Result<Point, String> {
    let settings = growth::settings(system, plan.tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
    let mut problem = growth::problem_of(system, first, plan.degree, point, false);
    growth::beside(&mut *problem, &settings, point).map_err(|why| why.to_string())
}
