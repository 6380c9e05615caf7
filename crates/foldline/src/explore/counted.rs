//! A vector field that counts its evaluations.

use crate::contract::{Batch, Turning, VectorField};
use crate::diagram::Cycle;
use num_complex::Complex64;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A field and its counters. Each side of a branch has its own, so they do not depend on what runs concurrently.
pub(super) struct Counted<'f> {
    field: &'f dyn VectorField,
    evaluations: AtomicUsize,
    linearisations: AtomicUsize,
}

impl<'f> Counted<'f> {
    /// Starts with both counters at zero.
    pub(super) fn new(field: &'f dyn VectorField) -> Counted<'f> {
        Counted { field, evaluations: AtomicUsize::new(0), linearisations: AtomicUsize::new(0) }
    }

    /// Returns the number of points at which f or derivatives were evaluated so far.
    pub(super) fn total(&self) -> usize {
        self.evaluations.load(Ordering::Relaxed).saturating_add(self.linearisations.load(Ordering::Relaxed))
    }

    /// Returns the numbers of points at which f, and at which derivatives were evaluated since the last call.
    pub(super) fn take(&self) -> [usize; 2] {
        [&self.evaluations, &self.linearisations].map(|counter| counter.swap(0, Ordering::Relaxed))
    }
}

impl VectorField for Counted<'_> {
    fn dim(&self) -> usize {
        self.field.dim()
    }

    fn parameter_count(&self) -> usize {
        self.field.parameter_count()
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        self.evaluations.fetch_add(at.lanes, Ordering::Relaxed);
        self.field.evaluate(at, f);
    }

    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        self.linearisations.fetch_add(at.lanes, Ordering::Relaxed);
        self.field.linearise(at, free, f, fx, fp);
    }

    fn directional(&self, at: Batch, directions: &[&[f64]], out: &mut [f64]) {
        self.linearisations.fetch_add(at.lanes, Ordering::Relaxed);
        self.field.directional(at, directions, out);
    }

    fn ended(&self) -> bool {
        self.field.ended()
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
