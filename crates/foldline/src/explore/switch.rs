//! Branch switching at a special point.
//!
//! **Idea.** At the special point the direction of the other branch is known: the period-doubling vector, the null
//! vector orthogonal to the tangent, the Hopf eigenvector. A first point is found by Newton's method in the hyperplane
//! a small step along that direction, which the original branch does not reach to first order.

use super::growth::{Beginning, problem_of, setting};
use super::{System, known, tori};
use crate::continuation::corrector::{Plane, Station, correct, doubted, settle, station};
use crate::continuation::{Failure, Settings};
use crate::contract::{Examination, ZeroProblem};
use crate::diagram::{Cost, Cycle, Ending, Family, Kind, Mesh, Point, Solution, SpecialPoint, Symmetry, Trust};
use crate::problem::cycle::CycleProblem;
use crate::problem::impact::{Flights, ImpactProblem};
use crate::problem::map::MapProblem;
use crate::problem::{gauss::Scheme, mesh, stiffness};
use crate::special::{branch_point, hopf, map_form, period_doubling};
use std::f64::consts::TAU;

/// Distances along the direction in the order of trial, in scaled variables. The shorter ones are for branches that
/// change soon after their start, as with contact, where a branch keeps its initial shape only until it grazes.
pub const DISTANCES: [f64; 7] = [2e-3, 5e-4, 1e-4, 2e-5, 5e-3, 1e-2, 5e-2];

/// Distance of the first point of a branch, in distances of its plane, beyond which it belongs to another branch: it lies
/// at an angle of more than 84° to the direction in which it was sought.
const FAR: f64 = 10.0;

/// [`DISTANCES`], beginning with those at which the branches differ by more than the tolerance.
fn distances(tolerance: f64) -> Vec<f64> {
    let least = 2.0 * known::WITHIN * tolerance;
    let mut all = DISTANCES.to_vec();
    if DISTANCES[0] < least {
        all.sort_by_key(|distance| *distance < least);
    }
    all
}

/// Returns the start of the branch that bifurcates at `at`, and its type; `None` for kinds of special points at which
/// no branch of equilibria or cycles bifurcates. If several pairs of eigenvalues cross the imaginary axis at once,
/// `pair` selects one.
///
/// # Errors
/// A sentence that says why no point of the other branch was found.
pub fn beginning(
    system: &System,
    settings: &Settings,
    free: usize,
    degree: usize,
    at: &SpecialPoint,
    pair: usize,
) -> Option<Result<(Family, Beginning), String>> {
    let found = match (at.kind, &at.point.solution) {
        (Kind::PeriodDoubling, Solution::Cycle(cycle)) => {
            doubled(system, settings, free, at, cycle).map(|b| (Family::Cycle, b))
        }
        (Kind::Hopf, Solution::Equilibrium(_)) => {
            born(system, settings, free, degree, at, pair).map(|b| (Family::Cycle, b))
        }
        (Kind::Torus, Solution::Cycle(cycle)) if !system.field.iterated() => {
            tori::born(system, settings, free, at, cycle).map(|b| (Family::Torus, b))
        }
        (Kind::BranchPoint, Solution::Torus(_)) => return None,
        (Kind::BranchPoint, solution) => {
            let family = system.family_of(solution);
            crossing(system, settings, free, degree, at).map(|b| (family, b))
        }
        _ => return None,
    };
    Some(found)
}

pub(super) fn joined(at: &SpecialPoint, free: usize) -> Ending {
    Ending::Joined { at: at.kind, parameter: at.point.parameters[free] }
}

/// Returns the first point at one of the `distances` along `direction` (not normalised) from `base`.
pub(super) fn step_off(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    base: &[f64],
    direction: &[f64],
    sign: f64,
    distances: &[f64],
    expected: &dyn Fn(&dyn ZeroProblem, &Station) -> bool,
) -> Result<Station, Failure> {
    step_off_from(problem, settings, base, direction, sign, distances, expected, &|_, _| {})
}

/// Steps off like [`step_off`], with the initial guess `improved`.
#[expect(clippy::too_many_arguments, reason = "those of `step_off` and one more")]
pub(super) fn step_off_from(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    base: &[f64],
    direction: &[f64],
    sign: f64,
    distances: &[f64],
    expected: &dyn Fn(&dyn ZeroProblem, &Station) -> bool,
    improved: &dyn Fn(&mut dyn ZeroProblem, &mut [f64]),
) -> Result<Station, Failure> {
    let mesh = problem.mesh();
    let (mut failure, mut second_best) = (Failure::Singular, None);
    for &distance in distances {
        if !mesh.is_empty() {
            problem.set_mesh(&mesh);
        }
        let along = |s: f64| -> Vec<f64> { base.iter().zip(direction).map(|(b, d)| b + s * d).collect() };
        // The phase reference lies on the new branch: the base may have no phase at all (a Hopf point).
        problem.anchor(&along(1.0));
        let norm = problem.dot(direction, direction).sqrt();
        problem.anchor(&along(sign * distance / norm));
        let row: Vec<f64> = direction.iter().map(|d| sign * d / norm).collect();
        let scale = problem.dot(&row, &row).sqrt();
        let row: Vec<f64> = row.iter().map(|r| r / scale).collect();
        let mut guess: Vec<f64> = base.iter().zip(&row).map(|(b, r)| b + distance * r).collect();
        improved(problem, &mut guess);
        let plane = Plane { row: row.clone(), base: base.to_vec(), distance };
        let tried = first_point(problem, settings, plane, guess).and_then(|found| {
            let here = problem.mesh();
            let mut chord = problem.carry(&found.u, &found.mesh, &here);
            chord.iter_mut().zip(problem.carry(base, &mesh, &here)).for_each(|(a, b)| *a -= b);
            let miss = problem.dot(&chord, &chord).sqrt() / distance;
            // Newton's method has gone far away.
            if miss > FAR { Err(Failure::Elsewhere { angle: 0.0, miss }) } else { Ok(found) }
        });
        let tried = tried.map(|mut found| {
            // The branch has turned by this angle so far, and is expected to keep turning at this rate.
            let begun = problem.transfer(&row, &mesh, &found.mesh);
            let length = problem.dot(&begun, &begun).sqrt() * problem.dot(&found.tangent, &found.tangent).sqrt();
            let angle = (problem.dot(&begun, &found.tangent) / length).clamp(-1.0, 1.0).acos();
            found.point.step = settings.first_step.min(distance * settings.target_angle / angle.max(1e-12));
            found
        });
        match tried {
            Ok(found) if expected(&*problem, &found) => return Ok(found),
            Ok(found) => second_best = second_best.or(Some(found)),
            Err(why) => failure = why,
        }
    }
    second_best.ok_or(failure)
}

/// Solves in the plane, on the mesh of the special point if that suffices: so close to it, a change of mesh would cause
/// a larger change than the distance.
fn first_point(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    plane: Plane,
    guess: Vec<f64>,
) -> Result<Station, Failure> {
    let (mut u, mut cost) = (guess.clone(), Cost::default());
    correct(problem, settings, &plane, &mut u, &mut cost)?;
    let close = settings.closeness(&problem.mesh(), plane.distance);
    let mut found = station(problem, u, &plane.row, close, 1.0, &mut cost)?;
    doubted(problem, &mut found);
    let trust = found.point.trust;
    let defect = found.point.multiplier_defect();
    if trust.discretisation <= 4.0 * settings.tolerance && defect <= 5.0 * settings.tolerance {
        return Ok(found);
    }
    problem.anchor(&guess);
    settle(problem, settings, plane, guess, 1.0, &mut cost)
}

/// True if `found` obeys the exchange of stability: a branch born on the side where its parent has more unstable
/// multipliers has the smaller number of them, and one born on the other side has one more than that.
fn exchanges_stability(at: &SpecialPoint, free: usize, found: &Station) -> bool {
    let rising = at.point.parameter_slope() > 0.0;
    let (below, above) =
        if rising { (at.unstable_before, at.unstable_after) } else { (at.unstable_after, at.unstable_before) };
    let own = if found.point.parameters[free] > at.point.parameters[free] { above } else { below };
    let fewer = below.min(above);
    found.point.unstable == if own > fewer { fewer } else { fewer + 1 }
}

fn doubled(
    system: &System,
    settings: &Settings,
    free: usize,
    at: &SpecialPoint,
    cycle: &Cycle,
) -> Result<Beginning, String> {
    let leave = |cycle: &Cycle, distances: &[f64]| {
        let (mut problem, base, mut direction) =
            double(system, free, at, cycle).ok_or("no eigenvector of the multiplier -1 was found")?;
        // Of unit length in the sizes of the states.
        problem.anchor(&base);
        let length = problem.dot(&direction, &direction).sqrt();
        direction.iter_mut().for_each(|d| *d /= length);
        let expected = |_: &dyn ZeroProblem, found: &Station| exchanges_stability(at, free, found);
        step_off(&mut *problem, settings, &base, &direction, 1.0, distances, &expected).map_err(|why| why.to_string())
    };
    if cycle.degree == 0 {
        let first = leave(cycle, &DISTANCES)?;
        let before = doubled_edge(system, free, at, &first.point).into_iter().collect();
        return Ok(Beginning::Edge { before, first, joined: joined(at, free) });
    }
    // The special point was located on a mesh twice as fine as that of other points. Every second node is enough for
    // the first point of the branch, unless none is found there or it has the wrong stability.
    let whole = Flights::of(system.field, &at.point.parameters, cycle).is_some();
    let coarse = if whole { None } else { leave(&coarsened(cycle), &DISTANCES[..4]).ok() };
    let coarse = coarse.filter(|found| exchanges_stability(at, free, found));
    let first = coarse.map_or_else(|| leave(cycle, &DISTANCES), Ok)?;
    let before = doubled_edge(system, free, at, &first.point).into_iter().collect();
    Ok(Beginning::Edge { before, first, joined: joined(at, free) })
}

/// Returns the cycle on a mesh of every second node, if that is possible.
fn coarsened(cycle: &Cycle) -> Cycle {
    if !cycle.intervals().is_multiple_of(2) {
        return cycle.clone();
    }
    let mesh: Mesh = cycle.mesh.iter().copied().step_by(2).collect();
    let profile = mesh::transferred(&cycle.profile, cycle.dim(), cycle.scheme(), &cycle.mesh, &mesh);
    Cycle { mesh, profile, ..cycle.clone() }
}

/// Problem, unknowns, and direction in which to leave.
type Doubled<'a> = (Box<dyn ZeroProblem + 'a>, Vec<f64>, Vec<f64>);

/// Returns the problem of doubled cycles at a period doubling, the cycle over two turns, and the direction to leave.
fn double<'a>(system: &'a System, free: usize, at: &SpecialPoint, cycle: &Cycle) -> Option<Doubled<'a>> {
    let with = |solution: Cycle| Point { solution: Solution::Cycle(solution), ..at.point.clone() };
    if system.field.iterated() {
        let own = setting(system, free, &at.point.parameters);
        let vector = map_form::antiperiodic(&own, &at.point)?;
        let (twice, mut direction) = period_doubling::doubled(cycle, &vector);
        direction.push(0.0);
        let twice = Solution::Cycle(twice);
        let mut problem = MapProblem::like(own, &twice);
        let base = problem.unknowns_of(&Point { solution: twice, ..at.point.clone() });
        return Some((Box::new(problem), base, direction));
    }
    if let Some(flights) = Flights::of(system.field, &at.point.parameters, cycle) {
        return double_flights(system, free, at, cycle, &flights);
    }
    let mut single = CycleProblem::like(setting(system, free, &at.point.parameters), cycle);
    let u = single.unknowns_of(&with(cycle.clone()));
    single.anchor(&u);
    let vector = single.antiperiodic_direction(&u)?;
    let (twice, mut direction) = period_doubling::doubled(cycle, &vector);
    direction.extend([0.0, 0.0]);
    let mut problem = CycleProblem::like(setting(system, free, &at.point.parameters), &twice).with_equal_halves();
    let base = problem.unknowns_of(&with(twice));
    Some((Box::new(problem), base, direction))
}

/// Returns the problem of doubled cycles at a period doubling, the cycle over two turns, and the tangent of its branch.
/// `None` for cycles with events.
pub(super) fn twice<'a>(system: &'a System, free: usize, at: &SpecialPoint) -> Option<Doubled<'a>> {
    let Solution::Cycle(cycle) = &at.point.solution else { return None };
    let own = setting(system, free, &at.point.parameters);
    if Flights::of(system.field, &at.point.parameters, cycle).is_some() {
        return None;
    }
    let size = cycle.profile.len();
    let (along, rest) = at.point.tangent.split_at_checked(size)?;
    let (twice, _) = period_doubling::doubled(cycle, &[]);
    let solution = Solution::Cycle(twice.clone());
    let mut tangent = [along, along, rest].concat();
    let mut problem: Box<dyn ZeroProblem> = match system.field.iterated() {
        true => Box::new(MapProblem::like(own, &solution)),
        // The period of two turns changes twice as fast.
        false => {
            tangent[2 * size] *= 2.0;
            Box::new(CycleProblem::like(own, &twice).with_equal_halves())
        }
    };
    let base = problem.unknowns_of(&Point { solution, ..at.point.clone() });
    if tangent.len() != base.len() {
        return None;
    }
    problem.anchor(&base);
    let norm = problem.dot(&tangent, &tangent).sqrt();
    tangent.iter_mut().for_each(|t| *t /= norm);
    Some((problem, base, tangent))
}

/// Problem, unknowns and direction of [`double`] for cycles with events. Over two turns, a period doubling is a branch point.
fn double_flights<'a>(
    system: &'a System,
    free: usize,
    at: &SpecialPoint,
    cycle: &Cycle,
    flights: &Flights,
) -> Option<Doubled<'a>> {
    let own = setting(system, free, &at.point.parameters);
    let twice = flights.turns(2);
    let mut problem = ImpactProblem::of(own, cycle.degree, 2 * cycle.forcing_periods, &twice);
    let base = problem.unknowns_with(&twice, &at.point.parameters);
    problem.anchor(&base);
    let scalars = 2 + usize::from(cycle.forcing_periods > 0);
    let (size, row) = (at.point.tangent.len().checked_sub(scalars)?, flights.events.len() * (system.field.dim() + 1));
    let (profile, rest) = at.point.tangent.split_at(size);
    let mut tangent: Vec<f64> = profile.chunks_exact(row).flat_map(|own| own.iter().chain(own)).copied().collect();
    tangent.extend_from_slice(rest);
    if tangent.len() != base.len() {
        return None;
    }
    let direction = branch_point::direction(&mut problem, &base, &tangent)?;
    Some((Box::new(problem), base, direction))
}

/// Returns a period doubling as a point of the doubled branch that starts or ends there. Its stability is that of
/// `next`, the adjacent point of the branch; everything else is that of the special point over two turns.
pub fn doubled_edge(system: &System, free: usize, at: &SpecialPoint, next: &Point) -> Option<Point> {
    let Solution::Cycle(cycle) = &at.point.solution else { return None };
    let (mut problem, base, direction) = double(system, free, at, cycle)?;
    Some(edge_along(&mut *problem, &base, &direction, at, next))
}

/// Returns the edge of a doubled branch that leaves along `direction`; see [`doubled_edge`].
pub(super) fn edge_along(
    problem: &mut dyn ZeroProblem,
    base: &[f64],
    direction: &[f64],
    at: &SpecialPoint,
    next: &Point,
) -> Point {
    problem.anchor(base);
    let norm = problem.dot(direction, direction).sqrt();
    let tangent: Vec<f64> = direction.iter().map(|d| d / norm).collect();
    let once = &at.point;
    let examination = Examination {
        spectrum: once.spectrum.iter().map(|z| z * z).collect(),
        trivial: once.spectrum.len() - once.free_spectrum().len(),
        unstable: next.unstable,
        ranges: once.ranges.clone(),
        averages: once.averages.clone(),
        trust: Trust {
            trivial_defect: 2.0 * once.trust.trivial_defect,
            liouville_defect: 2.0 * once.trust.liouville_defect,
            // An interpolated special point is no more accurate than this.
            discretisation: once.trust.discretisation.max(at.error),
            residual: once.trust.residual,
            spectrum: 2.0 * once.trust.spectrum,
            slope: once.trust.slope,
        },
    };
    problem.point(base, &tangent, examination)
}

fn born(
    system: &System,
    settings: &Settings,
    free: usize,
    degree: usize,
    at: &SpecialPoint,
    pair: usize,
) -> Result<Beginning, String> {
    let all = hopf::frequencies(&at.point);
    let omega = *all.get(pair).ok_or("no eigenvector of an imaginary pair of eigenvalues was found")?;
    if pair > 0 && all[..pair].iter().any(|other| (other / omega - 1.0).abs() < hopf::SAME) {
        return Err(format!(
            "two pairs of eigenvalues have the same frequency {omega:.6}; only one branch of cycles is searched for there"
        ));
    }
    let mesh = mesh::uniform(20);
    let Solution::Equilibrium(x) = &at.point.solution else { return Err("it is not an equilibrium".into()) };
    let cycle = Cycle::at_rest(x, TAU / omega, degree, &mesh);
    let scheme = Scheme::at(degree, stiffness::suited(system.field, &system.scales, &at.point.parameters, &cycle));
    let (mut direction, period) = hopf::direction(system.field, &at.point, omega, &system.scales, scheme, &mesh)
        .ok_or("no eigenvector of an imaginary pair of eigenvalues was found")?;
    direction.extend([0.0, 0.0]);
    let mut problem = CycleProblem::with(setting(system, free, &at.point.parameters), scheme, &mesh);
    let mut base = problem.unknowns_of(&at.point);
    let size = base.len();
    base[size - 2] = period;
    let first = step_off(&mut problem, settings, &base, &direction, 1.0, &DISTANCES, &|_, found| {
        exchanges_stability(at, free, found)
    })
    .map_err(|why| why.to_string())?;
    Ok(Beginning::Edge { before: Vec::new(), first, joined: joined(at, free) })
}

fn crossing(
    system: &System,
    settings: &Settings,
    free: usize,
    degree: usize,
    at: &SpecialPoint,
) -> Result<Beginning, String> {
    let mut problem = problem_of(system, free, degree, &at.point, false);
    let u = problem.unknowns_of(&at.point);
    problem.anchor(&u);
    let vector = branch_point::direction(&mut *problem, &u, &at.point.tangent)
        .ok_or("the tangent of the other branch was not found")?;
    across(system, settings, free, at, &mut *problem, &u, &vector, &|_, _| {})
}

/// Finds the branch in the hyperplane orthogonal to `vector`.
#[expect(clippy::too_many_arguments, reason = "those of a branch point, and of the step off it")]
pub(super) fn across(
    system: &System,
    settings: &Settings,
    free: usize,
    at: &SpecialPoint,
    problem: &mut dyn ZeroProblem,
    u: &[f64],
    vector: &[f64],
    improved: &dyn Fn(&mut dyn ZeroProblem, &mut [f64]),
) -> Result<Beginning, String> {
    let mesh = problem.mesh();
    // A curved parent may meet the hyperplane too. The chord then makes half the angle with the parent's tangent that
    // the tangent at its end makes; on another branch through the point the two angles are equal.
    let own_mesh = mesh.clone();
    let leaves = |problem: &dyn ZeroProblem, found: &Station| {
        // Inner products belong to the current mesh.
        let now = problem.mesh();
        let own = problem.transfer(&at.point.tangent, &own_mesh, &now);
        let tangent = problem.transfer(&found.tangent, &found.mesh, &now);
        let mut chord = problem.carry(&found.u, &found.mesh, &now);
        chord.iter_mut().zip(problem.carry(u, &own_mesh, &now)).for_each(|(a, b)| *a -= b);
        let angle = |a: &[f64]| {
            let lengths = (problem.dot(a, a) * problem.dot(&own, &own)).sqrt();
            (problem.dot(a, &own).abs() / lengths).min(1.0).acos()
        };
        angle(&tangent) < 1.5 * angle(&chord)
    };
    let distances = distances(settings.tolerance);
    let one = step_off_from(problem, settings, u, vector, 1.0, &distances, &leaves, improved)
        .map_err(|why| why.to_string())?;
    problem.set_mesh(&mesh);
    let alike = |other: &Station, r: &Symmetry| {
        let gap = (one.parameter() - other.parameter()).abs();
        let apart = one.point.difference(&other.point, system.measure(), r);
        gap < 1e-6 * (1.0 + one.parameter().abs()) && apart < 30.0 * settings.tolerance
    };
    if let Ok(other) = step_off_from(problem, settings, u, vector, -1.0, &distances, &|_, _| true, improved)
        && system.symmetries.iter().any(|r| !r.is_identity() && alike(&other, r))
    {
        // The other half of the branch is the mirror image of this one.
        return Ok(Beginning::Edge { before: Vec::new(), first: one, joined: joined(at, free) });
    }
    Ok(Beginning::Inside(one))
}
