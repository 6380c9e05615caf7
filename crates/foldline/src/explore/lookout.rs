//! Parameter scan: attractors and equilibria at values of a parameter, sought on several threads.

use super::System;
use super::choice::summary;
use super::growth::{polished, setting, settings};
use super::maps;
use super::plan::ExplorePlan;
use super::seeds::{attractors, bare, sampling};
use crate::diagram::{Point, Shown, Solution};
use crate::problem::equilibrium::EquilibriumProblem;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};

/// Solutions found at a value of the parameter.
pub(super) struct Sight {
    pub(super) value: f64,
    /// True if some samples did not settle.
    pub(super) unsettled: bool,
    /// Solutions, distinct up to symmetry, with a summary; or the reason why nothing can be followed from there.
    pub(super) found: Result<(Vec<Point>, String), String>,
}

/// A parameter scan shared among threads.
pub(super) struct Lookout<'l> {
    system: &'l System<'l>,
    plan: &'l ExplorePlan,
    tolerance: f64,
    seen: Slots<Sight>,
}

impl<'l> Lookout<'l> {
    pub(super) fn new(system: &'l System<'l>, plan: &'l ExplorePlan, tolerance: f64) -> Lookout<'l> {
        Lookout { system, plan, tolerance, seen: Slots::new(plan.values) }
    }

    /// Ends the scan: no more values are started.
    pub(super) fn close(&self) {
        self.seen.close();
    }

    /// Scans the next value that no thread has taken. Returns false if there is none.
    pub(super) fn look(&self) -> bool {
        let Some(index) = self.seen.take() else { return false };
        // A thread that waits for the result must get one even after a panic.
        let mut promise = Promise { slots: &self.seen, index, kept: None };
        promise.kept = Some(self.sight(index));
        true
    }

    /// Returns the result at that value; scans other values until it is known.
    pub(super) fn at(&self, index: usize) -> Sight {
        loop {
            if let Some(sight) = self.seen.ready(index) {
                return sight;
            }
            if !self.look() {
                return self.seen.wait(index);
            }
        }
    }

    /// Carries out step 2 without following anything.
    fn sight(&self, index: usize) -> Sight {
        let (system, plan) = (self.system, self.plan);
        let [low, high] = plan.range;
        let value = low + share(index) * (high - low);
        let mut parameters = plan.parameters.clone();
        parameters[plan.free] = value;
        if let Err(why) = system.repeats(&parameters, &[(plan.free, plan.range)]) {
            return Sight { value, unsettled: false, found: Err(why) };
        }
        // Different samples at different values give more information together.
        let random = plan.random.wrapping_add(index as u64);
        let census = attractors(system, &parameters, plan.samples, random, 1, self.tolerance);
        let mut found: Vec<Point> = Vec::new();
        for point in census.attractors.iter().map(|a| a.point.clone()).chain(self.rests(&parameters, random)) {
            if !found.iter().any(|other| same(system, self.tolerance, other, &point)) {
                found.push(point);
            }
        }
        let size = |point: &Point| match &point.solution {
            Solution::Equilibrium(x) => system.norm(x),
            Solution::Cycle(_) | Solution::Torus(_) => f64::INFINITY,
        };
        found.sort_by(|a, b| size(a).total_cmp(&size(b)));
        let rests = found.iter().filter(|p| matches!(p.solution, Solution::Equilibrium(_))).count();
        let said = match system.field.iterated() {
            true => format!(
                "at {}: {}; cycles of up to {} iterates, stable or not: {}",
                Shown(value),
                summary(system, &census),
                maps::SOUGHT,
                found.len()
            ),
            false => format!("at {}: {}; equilibria up to symmetry: {rests}", Shown(value), summary(system, &census)),
        };
        Sight { value, unsettled: census.unsettled + census.stuck + census.chattered > 0, found: Ok((found, said)) }
    }

    /// Returns the equilibria in the ranges of the states, stable or not.
    fn rests(&self, parameters: &[f64], random: u64) -> Vec<Point> {
        let system = self.system;
        if system.field.iterated() {
            let samples = (self.plan.samples, random);
            let of = |count| maps::cycles_of(system, parameters, samples, self.tolerance, count);
            return (1..=maps::SOUGHT).flat_map(of).collect();
        }
        if system.field.forced() {
            return Vec::new();
        }
        let settings = settings(system, self.tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
        let starts = sampling(system, self.plan.samples, random, 1, self.tolerance).starts();
        let mut found: Vec<Point> = Vec::new();
        for start in starts.chunks_exact(system.field.dim().max(1)).take_while(|_| !system.field.ended()) {
            let mut problem = EquilibriumProblem::new(setting(system, self.plan.free, parameters));
            let guess = bare(parameters, Solution::Equilibrium(start.to_vec()));
            if let Ok(station) = polished(&mut problem, &settings, &guess)
                && self.inside(&station.point)
                && !found.iter().any(|other| same(system, self.tolerance, other, &station.point))
            {
                found.push(station.point);
            }
        }
        found
    }

    /// True if an equilibrium lies in the ranges of the states, or less than half their widths outside.
    fn inside(&self, point: &Point) -> bool {
        let Solution::Equilibrium(x) = &point.solution else { return false };
        x.iter().zip(&self.system.ranges).all(|(x, [low, high])| {
            let room = 0.5 * (high - low);
            (low - room..=high + room).contains(x)
        })
    }
}

/// A result that is put into its slot when dropped, whatever happens.
struct Promise<'s> {
    slots: &'s Slots<Sight>,
    index: usize,
    kept: Option<Sight>,
}

impl Drop for Promise<'_> {
    fn drop(&mut self) {
        let lost = || Sight { value: f64::NAN, unsettled: false, found: Err("the search at this value failed".into()) };
        self.slots.put(self.index, self.kept.take().unwrap_or_else(lost));
    }
}

/// Results by number, computed by several threads and taken in order by one.
struct Slots<T> {
    slots: Mutex<Vec<Option<T>>>,
    next: AtomicUsize,
    arrived: Condvar,
}

impl<T> Slots<T> {
    fn new(count: usize) -> Slots<T> {
        let slots = Mutex::new((0..count).map(|_| None).collect());
        Slots { slots, next: AtomicUsize::new(0), arrived: Condvar::new() }
    }

    /// Returns the next number that no thread has taken.
    fn take(&self) -> Option<usize> {
        let count = self.slots.lock().unwrap_or_else(PoisonError::into_inner).len();
        Some(self.next.fetch_add(1, Ordering::Relaxed)).filter(|index| *index < count)
    }

    /// Ends the numbering: nothing more is taken.
    fn close(&self) {
        self.next.store(usize::MAX / 2, Ordering::Relaxed);
    }

    fn put(&self, index: usize, result: T) {
        if let Some(slot) = self.slots.lock().unwrap_or_else(PoisonError::into_inner).get_mut(index) {
            *slot = Some(result);
        }
        self.arrived.notify_all();
    }

    fn ready(&self, index: usize) -> Option<T> {
        self.slots.lock().unwrap_or_else(PoisonError::into_inner).get_mut(index)?.take()
    }

    /// Waits for the result of that number, which some thread has taken.
    fn wait(&self, index: usize) -> T {
        let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if let Some(result) = slots.get_mut(index).and_then(Option::take) {
                return result;
            }
            slots = self.arrived.wait(slots).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// True if two solutions at the same parameter values are the same, or images of each other under a symmetry.
fn same(system: &System, tolerance: f64, a: &Point, b: &Point) -> bool {
    let close = 30.0 * tolerance;
    system.symmetries.iter().any(|symmetry| a.difference(b, system.measure(), symmetry) < close)
}

/// Position of a value in the range, as a share: 1/2, 1/4, 3/4, 1/8, 5/8, 3/8, 7/8 and so on.
fn share(index: usize) -> f64 {
    let (mut left, mut share, mut weight) = (index + 1, 0.0, 0.5);
    while left > 0 {
        share += weight * (left & 1) as f64;
        (left, weight) = (left >> 1, 0.5 * weight);
    }
    share
}

#[cfg(test)]
mod tests {
    use super::share;

    #[test]
    fn values_halve_the_largest_gap() {
        assert_eq!([0, 1, 2, 3, 4, 5, 6].map(share), [0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875]);
    }
}
