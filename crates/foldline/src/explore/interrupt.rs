//! Immediate interruption of a run.
//!
//! **Idea.** An observer can stop a branch after each point. A point, a sampling or a homotopy can take long, so there
//! is a second way: once the observer is [stopping](Observer::stopping), the vector field returns NaN. Every Newton
//! iteration, trajectory and test function fails at its next evaluation, and the run unwinds within milliseconds.
//! Results computed meanwhile are wrong, so events are dropped from then on, and the run file holds what was accepted
//! before.

use crate::contract::{Batch, Event, Observer, Turning, VectorField, Verdict};
use crate::diagram::{Branch, Cycle, Point, Shortfall};
use num_complex::Complex64;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// An observer, its request to stop, and the shortfalls reported to it.
pub(super) struct Heeded<'o> {
    observer: &'o dyn Observer,
    stopped: AtomicBool,
    shortfalls: Mutex<Vec<Shortfall>>,
}

impl<'o> Heeded<'o> {
    pub(super) fn new(observer: &'o dyn Observer) -> Heeded<'o> {
        Heeded { observer, stopped: AtomicBool::new(false), shortfalls: Mutex::default() }
    }

    /// True once the observer has asked to stop, by a verdict or by [`Observer::stopping`].
    pub(super) fn stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed) || self.stopping()
    }

    /// All shortfalls, sorted so that their order does not depend on the threads.
    pub(super) fn shortfalls(&self) -> Vec<Shortfall> {
        let mut all = self.shortfalls.lock().unwrap_or_else(PoisonError::into_inner).clone();
        all.sort();
        all.dedup();
        all
    }
}

impl Observer for Heeded<'_> {
    fn observe(&self, event: Event) -> Verdict {
        if self.stopping() {
            return Verdict::Stop;
        }
        if let Event::Short(about, what) = event {
            let own = Shortfall { about: about.to_string(), what: what.to_string() };
            self.shortfalls.lock().unwrap_or_else(PoisonError::into_inner).push(own);
        }
        let verdict = self.observer.observe(event);
        if verdict == Verdict::Stop {
            self.stopped.store(true, Ordering::Relaxed);
        }
        verdict
    }

    fn stopping(&self) -> bool {
        self.observer.stopping()
    }

    fn stores(&self) -> bool {
        self.observer.stores()
    }

    fn recall(&self, branch: &Branch, position: i64) -> Option<Point> {
        self.observer.recall(branch, position)
    }
}

/// A vector field that returns NaN once an observer is stopping.
pub(super) struct Interruptible<'f> {
    field: &'f dyn VectorField,
    observer: &'f dyn Observer,
}

impl<'f> Interruptible<'f> {
    pub(super) fn new(field: &'f dyn VectorField, observer: &'f dyn Observer) -> Interruptible<'f> {
        Interruptible { field, observer }
    }

    /// Fills `out` with NaN and returns true if the run is to end.
    fn interrupted(&self, out: [&mut [f64]; 3]) -> bool {
        let ended = self.observer.stopping();
        if ended {
            out.into_iter().for_each(|values| values.fill(f64::NAN));
        }
        ended
    }
}

impl VectorField for Interruptible<'_> {
    fn dim(&self) -> usize {
        self.field.dim()
    }

    fn parameter_count(&self) -> usize {
        self.field.parameter_count()
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        if !self.interrupted([&mut *f, &mut [], &mut []]) {
            self.field.evaluate(at, f);
        }
    }

    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        if !self.interrupted([&mut *f, &mut *fx, &mut *fp]) {
            self.field.linearise(at, free, f, fx, fp);
        }
    }

    fn directional(&self, at: Batch, directions: &[&[f64]], out: &mut [f64]) {
        if !self.interrupted([&mut *out, &mut [], &mut []]) {
            self.field.directional(at, directions, out);
        }
    }

    fn ended(&self) -> bool {
        self.observer.stopping()
    }

    fn iterated(&self) -> bool {
        self.field.iterated()
    }

    fn forced(&self) -> bool {
        self.field.forced()
    }

    fn time_unit(&self, parameters: &[f64]) -> f64 {
        self.field.time_unit(parameters)
    }

    fn periods(&self) -> &[f64] {
        self.field.periods()
    }

    fn output_count(&self) -> usize {
        self.field.output_count()
    }

    fn outputs(&self, at: Batch, out: &mut [f64]) {
        self.field.outputs(at, out);
    }

    fn outputs_along(&self, at: Batch, direction: &[f64], out: &mut [f64]) {
        self.field.outputs_along(at, direction, out);
    }

    fn time_unit_along(&self, parameters: &[f64], change: &[f64]) -> f64 {
        self.field.time_unit_along(parameters, change)
    }

    fn switch_count(&self) -> usize {
        self.field.switch_count()
    }

    fn evaluate_precisely(&self, states: &[[f64; 2]], parameters: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
        if self.observer.stopping() { None } else { self.field.evaluate_precisely(states, parameters) }
    }

    fn event_count(&self) -> usize {
        self.field.event_count()
    }

    fn event_direction(&self, event: usize) -> f64 {
        self.field.event_direction(event)
    }

    fn reset(&self, event: usize, at: Batch, free: &[usize], to: [&mut [f64]; 4]) {
        self.field.reset(event, at, free, to);
    }

    fn forbidden(&self, at: Batch) -> Option<usize> {
        self.field.forbidden(at)
    }

    fn slopes_in_time(&self, at: Batch, out: &mut [f64]) {
        self.field.slopes_in_time(at, out);
    }

    fn switches(&self, at: Batch, out: &mut [f64]) {
        self.field.switches(at, out);
    }

    fn switch_name(&self, switch: usize) -> String {
        self.field.switch_name(switch)
    }

    fn conditions(&self) -> [usize; 2] {
        self.field.conditions()
    }

    fn determined(&self) -> &[usize] {
        self.field.determined()
    }

    fn boundary(&self, ends: [&[f64]; 2], parameters: &[f64], free: &[usize], to: [&mut [f64]; 4]) {
        self.field.boundary(ends, parameters, free, to);
    }

    fn integrands(&self, at: Batch, free: &[usize], to: [&mut [f64]; 3]) {
        self.field.integrands(at, free, to);
    }

    fn refer(&self, ends: [&[f64]; 2], parameters: &mut [f64]) {
        self.field.refer(ends, parameters);
    }

    fn remainders(&self, ends: [&[f64]; 2], parameters: &[f64]) -> Vec<f64> {
        self.field.remainders(ends, parameters)
    }

    fn saddles(&self, parameters: &[f64]) -> Option<[Vec<Complex64>; 2]> {
        self.field.saddles(parameters)
    }

    fn flips(&self, orbit: &Cycle, parameters: &[f64]) -> [Option<Turning>; 4] {
        self.field.flips(orbit, parameters)
    }

    fn lengthened(&self, orbit: &Cycle, parameters: &[f64], share: f64) -> Option<(Cycle, Vec<f64>)> {
        self.field.lengthened(orbit, parameters, share)
    }

    fn linearise_outputs(&self, at: Batch, free: &[usize], to: [&mut [f64]; 4]) -> bool {
        self.field.linearise_outputs(at, free, to)
    }

    fn second_phase(&self) -> Option<usize> {
        self.field.second_phase()
    }

    fn second_turns(&self, parameters: &[f64]) -> (f64, Vec<f64>) {
        self.field.second_turns(parameters)
    }

    fn time_unit_slopes(&self, parameters: &[f64]) -> Vec<f64> {
        self.field.time_unit_slopes(parameters)
    }

    fn linearise_switches(&self, at: Batch, free: &[usize], to: [&mut [f64]; 4]) {
        self.field.linearise_switches(at, free, to);
    }
}
