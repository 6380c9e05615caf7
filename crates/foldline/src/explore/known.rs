//! Recognition of solutions that lie on a known branch.
//!
//! **Idea.** Two solutions at the same parameter values are the same if their periods and the ranges of all states
//! agree, up to a symmetry of the model. A cycle of a forced model and its copies shifted by
//! forcing periods have the same ranges, and several turns of a shorter cycle count as that cycle (`minimal`). The
//! solution of a known branch at the parameter value in question is interpolated first and, if that is close, computed
//! by Newton's method.

use super::System;
use super::growth::{Line, polished, problem_of, revived};
use super::minimal::reduced;
use crate::continuation::Settings;
use crate::continuation::locate::{Stretch, passing};
use crate::contract::{Observer, ZeroProblem};
use crate::diagram::{Branch, Cost, Kind, Point, Solution};

/// Returns every solution on a branch at a value of its parameter, by increasing position: one for each time that the
/// branch passes it. Light points (see [`Point::is_light`]) are skipped.
pub fn solutions_at(system: &System, settings: &Settings, branch: &Branch, value: f64) -> Vec<Point> {
    let track = track(branch);
    let passes = track.windows(2).filter(|pair| {
        let [a, b] = [0, 1].map(|k| pair[k].parameters[branch.free] - value);
        a * b < 0.0 || a == 0.0
    });
    passes.filter_map(|pair| between(system, settings, branch, [pair[0], pair[1]], value)).collect()
}

/// Solution between two neighbouring points of a branch at a value of its parameter; `None` if one of them is light.
fn between(system: &System, settings: &Settings, branch: &Branch, pair: [&Point; 2], value: f64) -> Option<Point> {
    if pair.iter().any(|point| point.is_light() || point.tangent.is_empty()) {
        return None;
    }
    let mut problem = problem_of(system, branch.free, 4, pair[0], false);
    let left = revived(&mut *problem, settings, pair[0], 1.0).ok()?;
    let right = revived(&mut *problem, settings, pair[1], 1.0).ok()?;
    let found = passing(&mut *problem, settings, [&left, &right], value, 1.0, &mut Cost::default());
    found.ok().map(|station| station.point)
}

/// Returns the points of a branch, its folds, and the branch points at which it turns back, as at a pitchfork. Between
/// two of them the parameter is monotonic.
fn track(branch: &Branch) -> Vec<&Point> {
    let mut track: Vec<&Point> = branch.points.iter().collect();
    let value = |point: &Point| point.parameters.get(branch.free).copied().unwrap_or(f64::NAN);
    for special in branch.special.iter().filter(|s| matches!(s.kind, Kind::Fold | Kind::BranchPoint)) {
        let after = track.partition_point(|p| p.position <= special.point.position);
        let (Some(left), Some(right)) = (after.checked_sub(1).and_then(|k| track.get(k)), track.get(after)) else {
            continue;
        };
        let [here, left, right] = [&special.point, left, right].map(value);
        if special.kind == Kind::Fold || (left - here) * (right - here) > 0.0 {
            track.insert(after, &special.point);
        }
    }
    track
}

/// Returns the solution on a branch at which a quantity is least, usually between accepted points, and a bound on the
/// error of the quantity there: the discretisation error plus the last difference of the search. `None` for a branch
/// without points.
pub fn least(
    system: &System,
    settings: &Settings,
    branch: &Branch,
    quantity: &dyn Fn(&Point) -> f64,
) -> Option<(Point, f64)> {
    let lowest = (0..branch.points.len())
        .min_by(|&a, &b| quantity(&branch.points[a]).total_cmp(&quantity(&branch.points[b])))?;
    let mut best = branch.points[lowest].clone();
    let mut left_over = 0.0;
    for first in [lowest.checked_sub(1), Some(lowest)].into_iter().flatten() {
        let Some(pair) = branch.points.get(first..first + 2) else { continue };
        if let Some((point, rest)) = least_between(system, settings, branch, pair, quantity)
            && quantity(&point) <= quantity(&best)
        {
            (best, left_over) = (point, rest);
        }
    }
    let size = 1.0 + quantity(&best).abs();
    let error = best.trust.discretisation.max(settings.newton_tolerance()) * size + left_over;
    Some((best, error))
}

/// Golden-section search along the curve between two accepted points.
fn least_between(
    system: &System,
    settings: &Settings,
    branch: &Branch,
    pair: &[Point],
    quantity: &dyn Fn(&Point) -> f64,
) -> Option<(Point, f64)> {
    const SHARE: f64 = 0.618_033_988_749_894_9;
    if pair.iter().any(Point::is_light) {
        return None;
    }
    let line = Line { held: branch.held, ..Line::new(branch.free) };
    let mut problem = line.problem(system, 4, &pair[0]);
    let left = revived(&mut *problem, settings, &pair[0], 1.0).ok()?;
    let right = revived(&mut *problem, settings, &pair[1], 1.0).ok()?;
    let stretch = Stretch::new(&mut *problem, &left, &right, 1.0);
    let mut at = |s: f64| {
        let found = stretch.at(&mut *problem, settings, s, &mut Cost::default()).ok()?;
        Some((s, quantity(&found.point), found.point))
    };
    let (mut low, mut high) = (0.0, stretch.length);
    let (mut a, mut b) = (at(high - SHARE * (high - low))?, at(low + SHARE * (high - low))?);
    while (high - low).abs() > 1e-4 * stretch.length.abs() {
        if a.1 < b.1 {
            (high, b) = (b.0, a);
            a = at(high - SHARE * (high - low))?;
        } else {
            (low, a) = (a.0, b);
            b = at(low + SHARE * (high - low))?;
        }
    }
    let rest = (a.1 - b.1).abs();
    Some(if a.1 < b.1 { (a.2, rest) } else { (b.2, rest) })
}

/// Ratio of the periods of two cycles if it is nearly a whole number, otherwise 1.
fn turns(long: &Point, short: &Point) -> f64 {
    /// Largest distance from a whole number. Empirical: it allows for the change of the period along a step of the
    /// branch.
    const NEARLY: f64 = 0.05;
    let ratio = long.solution.period().zip(short.solution.period()).map_or(1.0, |(long, short)| long / short);
    if ratio > 1.5 && (ratio - ratio.round()).abs() < NEARLY { ratio.round() } else { 1.0 }
}

/// Returns a copy of a point without profile, with its period multiplied by `times`.
pub(super) fn lasting(point: &Point, times: f64) -> Point {
    let mut other = Point { tangent: Vec::new(), ..point.clone() };
    if let Solution::Cycle(cycle) = &mut other.solution {
        (cycle.mesh, cycle.profile) = (Vec::new().into(), Vec::new());
        cycle.period *= times;
    }
    other
}

/// Factor by which the tangent between two points of a branch may turn beyond the angle of the tangents at these points …
const TURN: f64 = 2.0;
/// … and slack on top, in radians: what the tangent of a straight branch turns by errors, with a wide margin.
const SLACK: f64 = 0.05;

/// True if the parameter changes as fast along the branch of a solution as at another one that may be the same, in any
/// phase and under any symmetry. Next to a pitchfork solutions of both branches differ little in their ranges.
fn slopes_agree(slope: f64, found: &Point) -> bool {
    found.tangent.is_empty() || (slope.abs() - found.parameter_slope().abs()).abs() <= APART
}

/// Difference of the slopes of the parameter beyond which two solutions lie on different branches: that of directions
/// which differ by a twentieth of a right angle.
const APART: f64 = 0.08;

/// Angle between the tangents of two points of a branch; `None` if one of them has no tangent, or unknowns of another kind.
fn turn(problem: &mut dyn ZeroProblem, from: &Point, to: &Point) -> Option<f64> {
    let (mesh, there) = (from.solution.mesh(), to.solution.mesh());
    if from.tangent.is_empty() || to.tangent.is_empty() || mesh.is_empty() != there.is_empty() {
        return None;
    }
    // Two cycles may have different numbers of events, or of unknowns determined by conditions.
    problem.set_mesh(&mesh);
    if problem.unknowns() != from.tangent.len() {
        return None;
    }
    problem.set_mesh(&there);
    let u = problem.unknowns_of(to);
    let along = if mesh.is_empty() { from.tangent.clone() } else { problem.transfer(&from.tangent, &mesh, &there) };
    if along.len() != to.tangent.len() || along.len() != u.len() {
        return None;
    }
    problem.anchor(&u);
    let lengths = (problem.dot(&along, &along) * problem.dot(&to.tangent, &to.tangent)).sqrt();
    Some((problem.dot(&along, &to.tangent) / lengths).abs().min(1.0).acos())
}

/// Difference of two solutions, in tolerances, within which they are the same: each has an error of a few on its own mesh.
pub(super) const WITHIN: f64 = 30.0;

/// Returns the name of the branch on which `point` lies; light points are recalled from the observer.
pub fn branch_of<'b>(
    system: &System,
    settings: &Settings,
    free: usize,
    degree: usize,
    point: &Point,
    branches: &'b [Branch],
    observer: &dyn Observer,
) -> Option<&'b str> {
    let value = *point.parameters.get(free)?;
    // The size of an angle, and with it the slope, depends on its copy.
    let angles = system.field.periods().iter().any(|period| period.is_finite());
    // The tangent of the point need not be that along the parameter in question.
    let measured = || {
        let mut problem = problem_of(system, free, degree, point, false);
        let own = polished(&mut *problem, settings, point).ok()?;
        Some(own.point.parameter_slope())
    };
    let slope: std::cell::OnceCell<Option<f64>> = std::cell::OnceCell::new();
    let found = branches.iter().filter(|b| b.free == free && b.held.is_none()).find(|branch| {
        track(branch).windows(2).any(|pair| {
            let (a, b) = (pair[0].parameters[free], pair[1].parameters[free]);
            if (a - value) * (b - value) > 0.0 {
                return false;
            }
            // From a fold Newton's method may converge to either side.
            let fold = |point: &Point| branch.special.iter().any(|s| std::ptr::eq(&s.point, point));
            let first = fold(pair[1]) || !fold(pair[0]) && (a - value).abs() < (b - value).abs();
            let nearest = if first { pair[0] } else { pair[1] };
            let apart = pair[0].distance(pair[1], system.measure());
            let close = |other: &Point, tolerance: f64| {
                system.symmetries.iter().any(|r| point.difference(other, system.measure(), r) < tolerance)
            };
            let turns = turns(nearest, point);
            if !close(&lasting(nearest, 1.0 / turns), 1e-3 + 1.5 * apart) {
                return false;
            }
            let whole = |point: &Point| match point.is_light() {
                true => observer.recall(branch, point.position),
                false => Some(point.clone()),
            };
            let [Some(left), Some(right)] = [whole(pair[0]), whole(pair[1])] else { return false };
            let mut guess = if first { left.clone() } else { right.clone() };
            if guess.is_light() {
                return false;
            }
            let mut problem = problem_of(system, free, degree, &guess, false);
            let most = TURN * turn(&mut *problem, &left, &right).unwrap_or(0.0) + SLACK;
            guess.parameters[free] = value;
            if !guess.solution.mesh().is_empty() {
                problem.set_mesh(&guess.solution.mesh());
            }
            // Next to a crossing, Newton's method may go to the other branch.
            let same = |problem: &mut dyn ZeroProblem, found: &Point| {
                let once = if turns > 1.0 { reduced(system, settings, found) } else { None };
                close(once.as_ref().unwrap_or(found), WITHIN * settings.tolerance)
                    && turn(problem, &guess, found).is_none_or(|own| own <= most)
                    && (turns > 1.0 || angles || slope.get_or_init(measured).is_none_or(|own| slopes_agree(own, found)))
            };
            let near = polished(&mut *problem, settings, &guess);
            if near.is_ok_and(|found| same(&mut *problem, &found.point)) {
                return true;
            }
            let found = between(system, settings, branch, [&left, &right], value);
            found.is_some_and(|found| same(&mut *problem, &found))
        })
    });
    found.map(|branch| branch.name.as_str())
}
