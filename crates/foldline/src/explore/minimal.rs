//! Reduction of a cycle to its minimal period.
//!
//! **Idea.** k turns of a cycle solve the equations of a cycle of period kT, and any search for cycles may find them as
//! such. Collocation on a mesh that repeats itself k times has the symmetry of the continuous problem, a shift by one
//! turn: k turns of one cycle stay equal on it, to the accuracy of Newton's method, while the turns of a cycle that has
//! bifurcated from it stay different, however close it is. A cycle whose turns look alike is therefore computed once
//! more on such a mesh.
//!
//! **Equations.** With the scale sᵢ of component i, the accuracy ε of Newton's method and the non-trivial multipliers μ
//! of the cycle:
//!
//!   (1)  d = max over t and i of |xᵢ(t + T/k) - xᵢ(t)| / (sᵢ + max |xᵢ|)
//!   (2)  k turns look alike if d ≤ e^(1/3), e being the error of the cycle: next to a pitchfork, at which one turn
//!        becomes several, an error e moves the solutions of a³ - λ a = e by e^(1/3) at most, up to a factor near 1
//!   (3)  on the mesh of equal turns they are equal if d ≤ 10 ε / min |1 - μ|, and ε^(1/3) at most for the same reason;
//!        where they are not, λ = |1 - μ|/2 and d² is of the size of λ, which is more unless d³ < ε
//!
//! **Fails when** the number of turns has a prime factor above 61.

use super::System;
use super::growth::{polished, problem_of};
use crate::continuation::Settings;
use crate::continuation::corrector::{Plane, correct, parameter_row};
use crate::contract::Examination;
use crate::diagram::{Cost, Cycle, Mesh, Point, Solution};
use crate::problem::impact::stored::impacts;
use crate::problem::map;

/// Numbers of turns that are tried; every other number up to 66 is a product of them. Empirical: sampling finds no
/// cycle with more than 40 crossings of its section per period.
const PRIMES: [usize; 18] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61];
/// Fewest mesh intervals that can resolve a turn. Empirical: quartics on four intervals resolve little more than a
/// sinusoid.
const FEWEST: usize = 4;

/// Returns the cycle over its minimal period (in a forced model, the smallest number of forcing periods). `None` if its
/// period is minimal already, or for an equilibrium.
pub(super) fn reduced(system: &System, settings: &Settings, point: &Point) -> Option<Point> {
    let mut found: Option<Point> = None;
    while let Some(shorter) = reduced_once(system, settings, found.as_ref().unwrap_or(point)) {
        found = Some(shorter);
    }
    found
}

/// Returns one turn of a cycle that consists of a prime number of equal turns.
fn reduced_once(system: &System, settings: &Settings, point: &Point) -> Option<Point> {
    let Solution::Cycle(cycle) = &point.solution else { return None };
    if system.field.event_count() > 0 && !impacts(system.field, &point.parameters, cycle).is_empty() {
        return None;
    }
    if cycle.degree == 0 {
        return of_map(system, settings, point, cycle);
    }
    let of_angles = |turns: usize| turned_whole(system.field.periods(), &cycle.gain, turns);
    let whole = |turns: usize| {
        of_angles(turns) && (cycle.forcing_periods == 0 || (cycle.forcing_periods as usize).is_multiple_of(turns))
    };
    let fits = |turns: &usize| whole(*turns) && cycle.intervals() >= FEWEST * turns;
    PRIMES.into_iter().filter(fits).find_map(|turns| one_turn(system, settings, point, cycle, turns))
}

/// Returns one of `turns` equal turns of a cycle; `None` if the turns differ.
fn one_turn(system: &System, settings: &Settings, point: &Point, cycle: &Cycle, turns: usize) -> Option<Point> {
    let error = point.trust.discretisation.max(settings.tolerance);
    if !turns_agree(cycle, &system.scales, turns, error.cbrt()) {
        return None;
    }
    let Cycle { period, forcing_periods, degree, .. } = *cycle;
    let equal = on_equal_turns(system, settings, point, cycle, turns)?;
    let accuracy = settings.newton_tolerance();
    let nearest = point.free_spectrum().iter().fold(1.0, |m: f64, z| m.min((z - 1.0).norm()));
    let allowed = (10.0 * accuracy / nearest).min(accuracy.cbrt());
    if !turns_agree(&equal, &system.scales, turns, allowed) {
        return None;
    }
    // Intervals that are cut at switchings need not be as many in every turn.
    let end = 1.0 / turns as f64;
    let intervals = equal.mesh.iter().position(|t| (t - end).abs() <= 4.0 * f64::EPSILON)?;
    let turn = Cycle {
        points: cycle.points,
        period: equal.period / turns as f64,
        forcing_periods: forcing_periods / turns as u32,
        mesh: equal.mesh[..=intervals].iter().map(|t| t * turns as f64).collect(),
        degree,
        profile: equal.profile[..intervals * (degree + 1) * equal.dim()].to_vec(),
        gain: equal.gain.iter().map(|gain| gain / turns as f64).collect(),
    };
    let guess = Point { solution: Solution::Cycle(with_exact_end(turn)), ..point.clone() };
    let found = polished(&mut *problem_of(system, 0, degree, &guess, false), settings, &guess).ok()?.point;
    // Newton's method may have converged to another cycle.
    let same_period = (found.solution.period()? * turns as f64 - period).abs() <= 30.0 * settings.tolerance * period;
    let expected = Point { solution: found.solution.clone(), ..point.clone() };
    let same = same_period && found.distance(&expected, system.measure()) < 30.0 * settings.tolerance.max(allowed);
    same.then_some(Point { position: point.position, ..found })
}

/// Returns one turn of a cycle of a map that consists of equal turns.
fn of_map(system: &System, settings: &Settings, point: &Point, cycle: &Cycle) -> Option<Point> {
    let (n, count) = (cycle.dim().max(1), cycle.intervals());
    let nearest = point.free_spectrum().iter().fold(1.0, |m: f64, z| m.min((z - 1.0).norm()));
    let accuracy = settings.newton_tolerance();
    let allowed = (10.0 * accuracy / nearest).min(accuracy.cbrt());
    let size = |i: usize| cycle.profile.iter().skip(i).step_by(n).fold(0.0, |m: f64, x| m.max(x.abs()));
    let sizes: Vec<f64> = (0..n).map(|i| system.scales[i] + size(i)).collect();
    let part = (1..count).filter(|part| count.is_multiple_of(*part)).find(|part| {
        let turns = count / part;
        turned_whole(system.field.periods(), &cycle.gain, turns)
            && (0..(count - part) * n).all(|c| {
                let gained = cycle.gain.get(c % n).map_or(0.0, |gain| gain / turns as f64);
                (cycle.profile[c] + gained - cycle.profile[c + part * n]).abs() <= allowed * sizes[c % n]
            })
    })?;
    let gain: Vec<f64> = cycle.gain.iter().map(|gain| gain * part as f64 / count as f64).collect();
    let once = Solution::Cycle(map::cycle_of(&cycle.profile[..part * n], n, &gain));
    let guess = Point { solution: once, ..point.clone() };
    let found = polished(&mut *problem_of(system, 0, 0, &guess, false), settings, &guess).ok()?.point;
    Some(Point { position: point.position, ..found })
}

/// True if a share of the cycle is a whole number of turns of every angle.
fn turned_whole(periods: &[f64], gain: &[f64], share: usize) -> bool {
    periods.iter().zip(gain).all(|(period, gain)| {
        let turns = gain / (period * share as f64);
        (turns - turns.round()).abs() < 1e-9
    })
}

/// Solves for the cycle by collocation on a mesh that is the same for every turn.
fn on_equal_turns(system: &System, settings: &Settings, point: &Point, cycle: &Cycle, turns: usize) -> Option<Cycle> {
    let wide = turns as f64;
    // Boundaries of the first turn, without one that nearly coincides with its end.
    let close = 0.1 * wide / cycle.intervals() as f64;
    let mut turn: Vec<f64> = cycle.mesh.iter().map(|t| t * wide).take_while(|t| *t < 1.0 - close).collect();
    turn.push(1.0);
    let whole: Vec<f64> = (0..turns).flat_map(|k| turn[1..].iter().map(move |t| (k as f64 + t) / wide)).collect();
    let equal: Mesh = std::iter::once(0.0).chain(whole).collect();
    let mut problem = problem_of(system, 0, cycle.degree, point, false);
    let u = problem.unknowns_of(point);
    problem.anchor(&u);
    let mut u = problem.carry(&u, &cycle.mesh, &equal);
    problem.set_mesh(&equal);
    problem.anchor(&u);
    let plane = Plane { row: parameter_row(u.len()), base: u.clone(), distance: 0.0 };
    correct(&mut *problem, settings, &plane, &mut u, &mut Cost::default()).ok()?;
    match problem.point(&u, &[], Examination::default()).solution {
        Solution::Cycle(equal) => Some(equal),
        Solution::Equilibrium(_) | Solution::Torus(_) => None,
    }
}

/// True if the turns of a cycle differ by at most `share`, in the measure (1).
fn turns_agree(cycle: &Cycle, scales: &[f64], turns: usize, share: f64) -> bool {
    let n = cycle.dim();
    let size =
        |i: usize| cycle.profile.iter().skip(i).step_by(n).fold(scales[i], |m: f64, x| m.max(scales[i] + x.abs()));
    let sizes: Vec<f64> = (0..n).map(size).collect();
    // Mesh boundaries are dense where the motion is fast.
    cycle.mesh[1..].iter().all(|t| {
        let (here, there) = (cycle.state(*t), cycle.state(t + 1.0 / turns as f64));
        (0..n).all(|i| {
            let gained = cycle.gain.get(i).map_or(0.0, |gain| gain / turns as f64);
            (here[i] + gained - there[i]).abs() <= share * sizes[i]
        })
    })
}

/// Sets the last mesh boundary to exactly 1, which rounding may have missed.
fn with_exact_end(mut cycle: Cycle) -> Cycle {
    let mut boundaries = cycle.mesh.to_vec();
    if let Some(last) = boundaries.last_mut() {
        *last = 1.0;
    }
    cycle.mesh = boundaries.into();
    cycle
}
