//! Basin fractions over a parameter.
//!
//! **Idea.** At each value the fractions are estimated from the same initial states. An attractor is the one of the value before
//! if a trajectory from the old one's state settles on it, and one from its own state at the value before settles on the old
//! one: a small change of the parameter leads from one to the other and back.
//!
//! **Fails when** steps are so large that an attractor moves out of its basin within one: it then has another number on the
//! other side, but no two attractors are taken for one another unless the trajectories say so in both directions.

use super::System;
use super::basins::Basins;
use super::rounds::{Rounds, state_of};
use super::seeds::sampling;
use crate::attractors::{Attractor, Fate};
use crate::diagram::{Diagram, Point, Solution};
use crate::model::Model;

/// Basin fractions at a value of the parameter.
#[derive(Clone, Debug)]
pub struct AtValue {
    /// The value.
    pub value: f64,
    /// Attractors, and fates of the states drawn from the box.
    pub found: Basins,
    /// Number of each attractor, the same from value to value.
    pub numbers: Vec<usize>,
}

/// Returns basin fractions at values of the parameter of index `free`, in their order. `limited` sets ranges and limits of
/// a system.
pub fn shares_along(
    model: &Model,
    parameters: &[f64],
    (free, values): (usize, &[f64]),
    (samples, seed): (usize, u64),
    (jobs, tolerance): (usize, f64),
    limited: &dyn Fn(&mut System),
) -> Vec<AtValue> {
    let mut all: Vec<AtValue> = Vec::new();
    let mut count = 0;
    let at = |value: f64| {
        let mut own = parameters.to_vec();
        own[free] = value;
        own
    };
    for value in values {
        let here = at(*value);
        let mut system = System::of(model, &here);
        limited(&mut system);
        let n = system.field.dim();
        let drawn = sampling(&system, samples, seed, jobs, tolerance).uniform_starts();
        let before: &[Attractor] = all.last().map_or(&[][..], |own| &own.found.attractors[..]);
        let states: Vec<f64> = before.iter().flat_map(|own| state_of(&own.point, n)).collect();
        let mut rounds = Rounds::new(&system, &here, jobs, tolerance);
        let mut forward = rounds.fates(&[&states[..], &drawn[..]].concat());
        // A state that lies on a solution which has lost its stability rests there.
        let (attractors, place) = stable(std::mem::take(&mut rounds.attractors));
        let moved = |fate: &Fate| match fate {
            Fate::Settled(k) => place[*k].map_or(Fate::Unsettled, Fate::Settled),
            other => *other,
        };
        forward = forward.iter().map(moved).collect();
        let fates = forward.split_off(before.len());
        let back = match all.last() {
            Some(last) => {
                let there = at(last.value);
                let mut system = System::of(model, &there);
                limited(&mut system);
                let mut rounds = Rounds::new(&system, &there, jobs, tolerance);
                rounds.attractors = last.found.attractors.clone();
                let states: Vec<f64> = attractors.iter().flat_map(|own| state_of(&own.point, n)).collect();
                rounds.fates(&states)
            }
            None => Vec::new(),
        };
        let number = |j: usize| {
            let last = all.last()?;
            let same = |k: &usize| forward[*k] == Fate::Settled(j) && back.get(j) == Some(&Fate::Settled(*k));
            let k = (0..before.len()).find(same)?;
            Some(last.numbers[k])
        };
        let known: Vec<Option<usize>> = (0..attractors.len()).map(number).collect();
        let numbers = known.into_iter().map(|own| {
            own.unwrap_or_else(|| {
                count += 1;
                count - 1
            })
        });
        let numbers: Vec<usize> = numbers.collect();
        let found =
            Basins { attractors, box_fates: fates, plane_fates: Vec::new(), early: None, samples: drawn, filled: None };
        all.push(AtValue { value: *value, found, numbers });
        if system.field.ended() {
            break;
        }
    }
    all
}

/// Returns the stable ones of solutions, and the new index of each.
fn stable(all: Vec<Attractor>) -> (Vec<Attractor>, Vec<Option<usize>>) {
    let (mut kept, mut place) = (Vec::new(), Vec::new());
    for own in all {
        place.push((own.point.unstable == 0).then_some(kept.len()));
        kept.extend((own.point.unstable == 0).then_some(own));
    }
    (kept, place)
}

/// Name of the branch of a diagram over the parameter `free` on which a stable solution lies, if there is one.
pub fn branch_of<'d>(diagram: &'d Diagram, free: usize, point: &Point, scales: &[f64]) -> Option<&'d str> {
    let value = point.parameters[free];
    let branches = diagram.branches.iter().filter(|own| own.held.is_none() && own.also.is_empty() && own.free == free);
    let mut nearest: Option<(f64, &str)> = None;
    for branch in branches {
        let others = |own: &Point| {
            let pairs = own.parameters.iter().zip(&point.parameters).enumerate();
            pairs.filter(|(k, _)| *k != free).all(|(_, (a, b))| (a - b).abs() <= 1e-9 * a.abs().max(b.abs()))
        };
        for pair in branch.points.windows(2).filter(|pair| others(&pair[0])) {
            let [a, b] = [&pair[0], &pair[1]];
            let (from, to) = (a.parameters[free], b.parameters[free]);
            let share = (value - from) / (to - from);
            // Stable solutions only; between a stable and an unstable point lies a special point.
            if !(0.0..=1.0).contains(&share) || a.unstable.min(b.unstable) > 0 {
                continue;
            }
            if let Some(off) = distance([a, b, point], share, scales).filter(|off| *off <= 1.0)
                && nearest.is_none_or(|(least, _)| off < least)
            {
                nearest = Some((off, branch.name.as_str()));
            }
        }
    }
    nearest.map(|(_, name)| name)
}

/// Largest deviation of a solution from the interpolation between two points of a branch, in units of how much the number
/// changes between the two, or of 1e-4 of its scale if that is larger. Over such a step a branch bends by less.
fn distance([a, b, point]: [&Point; 3], share: f64, scales: &[f64]) -> Option<f64> {
    let kind = |own: &Point| (matches!(own.solution, Solution::Cycle(_)), own.solution.forcing_periods());
    if kind(a) != kind(point) {
        return None;
    }
    let mut most: f64 = 0.0;
    let mut compare = |[a, b, own]: [f64; 3], scale: f64| {
        let size = (b - a).abs().max(1e-4 * scale);
        most = most.max((own - a - share * (b - a)).abs() / size);
    };
    for (k, scale) in scales.iter().enumerate() {
        let [Some(a), Some(b), Some(own)] = [a, b, point].map(|from| from.ranges.get(k)) else { return None };
        (0..2).for_each(|side| compare([a[side], b[side], own[side]], *scale));
    }
    if let [Some(a), Some(b), Some(own)] = [a, b, point].map(|from| from.solution.period()) {
        compare([a, b, own], own);
    }
    Some(most)
}
