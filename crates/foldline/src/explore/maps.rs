//! First solutions of maps.
//!
//! **Idea.** A cycle with a given number of iterates is found by Newton's method from the iterates of some state. The
//! equations are those of all iterates together, so that the method converges from iterates of an expanding map as well
//! as from others. Stable cycles are found by iteration (`attractors`); unstable ones, by Newton's method from many
//! initial states.
//!
//! **Fails when** Newton's method converges from none of the states to a cycle of that period.

use super::System;
use super::growth::{polished, problem_of, settings};
use super::minimal::reduced;
use super::plan::SeedPlan;
use super::seeds::{bare, sampling};
use crate::attractors::{Candidate, gained};
use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::{Point, Solution};
use crate::problem::map;

/// Longest cycles that an exploration seeks by Newton's method.
pub(super) const SOUGHT: usize = 4;

/// The cycle to which Newton's method leads from a candidate, over its minimal period.
pub(super) fn polish(system: &System, parameters: &[f64], tolerance: f64, candidate: &Candidate) -> Option<Point> {
    let n = system.field.dim();
    let (states, gain) = match candidate {
        Candidate::Equilibrium(x) => (x.clone(), Vec::new()),
        Candidate::Cycle { states, .. } => {
            let end = states.len() - n;
            (states[..end].to_vec(), gained(system.field.periods(), &states[..n], &states[end..]))
        }
    };
    solved(system, parameters, tolerance, &states, &gain)
}

/// The cycle to which Newton's method leads from iterates `[N][n]`, over its minimal period.
fn solved(system: &System, parameters: &[f64], tolerance: f64, iterates: &[f64], gain: &[f64]) -> Option<Point> {
    let settings = settings(system, tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
    let guess = bare(parameters, Solution::Cycle(map::cycle_of(iterates, system.field.dim(), gain)));
    let found = polished(&mut *problem_of(system, 0, 0, &guess, false), &settings, &guess).ok()?.point;
    Some(reduced(system, &settings, &found).unwrap_or(found))
}

/// The first `count` iterates of a state, the state included, and the gain of angles until the next one; `None` if one
/// of them is not finite.
pub fn iterates(
    field: &dyn VectorField,
    parameters: &[f64],
    state: &[f64],
    count: usize,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let mut all = state.to_vec();
    let mut x = state.to_vec();
    for k in 1..=count {
        let mut next = vec![0.0; x.len()];
        let parameters = Parameters::Shared(parameters);
        field.evaluate(Batch { lanes: 1, states: &x, parameters, times: &[], signs: &[] }, &mut next);
        if next.iter().any(|x| !x.is_finite()) {
            return None;
        }
        if k < count {
            all.extend_from_slice(&next);
        }
        x = next;
    }
    Some((all, gained(field.periods(), state, &x)))
}

/// The cycle of `count` iterates to which Newton's method leads from the iterates of a state.
pub(super) fn cycle_from(
    system: &System,
    parameters: &[f64],
    tolerance: f64,
    state: &[f64],
    count: usize,
) -> Option<Point> {
    let (all, gain) = iterates(system.field, parameters, state, count)?;
    solved(system, parameters, tolerance, &all, &gain)
}

/// Cycles of exactly `count` iterates, stable or not, that Newton's method finds from sampled states within the ranges of
/// the states or not far outside, each once.
pub(super) fn cycles_of(
    system: &System,
    parameters: &[f64],
    (samples, random): (usize, u64),
    tolerance: f64,
    count: usize,
) -> Vec<Point> {
    let n = system.field.dim().max(1);
    let starts = sampling(system, samples, random, 1, tolerance).starts();
    let mut found: Vec<Point> = Vec::new();
    for start in starts.chunks_exact(n).take_while(|_| !system.field.ended()) {
        let Some(point) = cycle_from(system, parameters, tolerance, start, count) else { continue };
        let Solution::Cycle(cycle) = &point.solution else { continue };
        if cycle.intervals() == count && inside(system, &cycle.profile) {
            let point = with_smallest_first(&point);
            if !found.iter().any(|other| same(system, other, &point, tolerance)) {
                found.push(point);
            }
        }
    }
    found.sort_by(|a, b| a.unstable.cmp(&b.unstable).then(a.ranges[0][0].total_cmp(&b.ranges[0][0])));
    found
}

/// True if two cycles that begin with their smallest iterates are the same.
fn same(system: &System, a: &Point, b: &Point, tolerance: f64) -> bool {
    let (Solution::Cycle(a), Solution::Cycle(b)) = (&a.solution, &b.solution) else { return false };
    let n = system.field.dim().max(1);
    a.profile.len() == b.profile.len()
        && a.profile.iter().zip(&b.profile).enumerate().all(|(c, (x, y))| {
            let off = system
                .field
                .periods()
                .get(c % n)
                .filter(|period| period.is_finite())
                .map_or(x - y, |period| (x - y) - period * ((x - y) / period).round());
            off.abs() <= 30.0 * tolerance * (system.scales[c % n] + x.abs())
        })
}

/// The cycle beginning with the iterate whose first state is smallest.
fn with_smallest_first(point: &Point) -> Point {
    let mut point = point.clone();
    if let Solution::Cycle(cycle) = &mut point.solution
        && cycle.gain.is_empty()
    {
        let n = cycle.dim().max(1);
        let count = cycle.intervals();
        let first = (0..count).min_by(|a, b| cycle.profile[a * n].total_cmp(&cycle.profile[b * n])).unwrap_or(0);
        cycle.profile.rotate_left(first * n);
        let states = (count * n).min(point.tangent.len());
        point.tangent[..states].rotate_left((first * n).min(states));
    }
    point
}

/// True if all iterates lie in the ranges of the states, or less than half their widths outside; angles anywhere.
fn inside(system: &System, iterates: &[f64]) -> bool {
    let n = system.ranges.len().max(1);
    iterates.iter().enumerate().all(|(c, x)| {
        let [low, high] = system.ranges[c % n];
        let room = 0.5 * (high - low);
        let angle = system.field.periods().get(c % n).is_some_and(|period| period.is_finite());
        angle || (low - room..=high + room).contains(x)
    })
}

/// The solution for a given state: a fixed point that Newton's method finds close by, else the cycle at which the orbit
/// of the state ends.
///
/// # Errors
/// The way in which the orbit ended, if it reaches no solution.
pub(super) fn from_state(
    system: &System,
    seed: &SeedPlan,
    tolerance: f64,
    state: &[f64],
) -> Result<Point, crate::attractors::Lost> {
    const NEXT: f64 = 1e-2;
    const NEAR: f64 = 0.3;
    let fixed = cycle_from(system, &seed.parameters, tolerance, state, 1).map(|point| {
        let off = match &point.solution {
            Solution::Cycle(cycle) => cycle
                .profile
                .iter()
                .zip(state)
                .zip(&system.scales)
                .map(|((a, b), s)| (a - b).abs() / (s + b.abs()))
                .fold(0.0, f64::max),
            Solution::Equilibrium(_) | Solution::Torus(_) => f64::INFINITY,
        };
        (off, point)
    });
    if let Some((off, point)) = &fixed
        && *off < NEXT
    {
        return Ok(point.clone());
    }
    let own = sampling(system, 1, seed.random, 1, tolerance);
    let polish = |candidate: &Candidate| polish(system, &seed.parameters, tolerance, candidate);
    let settled = crate::attractors::settle(system.field, &seed.parameters, &own, state, &polish);
    settled.or_else(|lost| match fixed {
        Some((off, point)) if off < NEAR => Ok(point),
        _ => Err(lost),
    })
}
