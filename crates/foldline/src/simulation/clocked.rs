//! Forced fields with time as an additional state.
//!
//! **Idea.** The integrators take autonomous fields. A forced field gets its time from one additional state, which
//! grows by one per forcing period and which every method integrates exactly: x' = f(x, p, τ), τ' = 1.

use crate::contract::{Batch, VectorField};

/// Autonomous form of a field, for simulation; derivatives with respect to time are set to 0. An autonomous field gets
/// a clock that it ignores.
#[derive(Clone, Copy)]
pub struct Clocked<'a>(pub &'a dyn VectorField);

impl Clocked<'_> {
    /// Batch as seen by the field itself.
    fn inner<'b>(&self, at: Batch<'b>) -> Batch<'b> {
        let (states, times) = at.states.split_at(self.0.dim() * at.lanes);
        Batch { states, times: if self.0.forced() { times } else { &[] }, ..at }
    }

    fn with_clock(&self, at: Batch, f: &mut [f64], evaluate: impl FnOnce(Batch, &mut [f64])) {
        let (own, clock) = f.split_at_mut(self.0.dim() * at.lanes);
        evaluate(self.inner(at), own);
        clock.fill(1.0);
    }
}

/// Copies a matrix `[n·n × lanes]` and adds `more` rows and columns of zeros, `[(n + more)² × lanes]`.
pub(crate) fn bordered(matrix: &[f64], n: usize, more: usize, lanes: usize, to: &mut [f64]) {
    to.fill(0.0);
    for i in 0..n {
        let row = &matrix[i * n * lanes..][..n * lanes];
        to[i * (n + more) * lanes..][..n * lanes].copy_from_slice(row);
    }
}

impl VectorField for Clocked<'_> {
    fn dim(&self) -> usize {
        self.0.dim() + 1
    }

    fn parameter_count(&self) -> usize {
        self.0.parameter_count()
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        self.with_clock(at, f, |inner, own| self.0.evaluate(inner, own));
    }

    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        let n = self.0.dim();
        let mut inner_fx = vec![0.0; n * n * at.lanes];
        let mut inner_fp = vec![0.0; n * free.len() * at.lanes];
        self.with_clock(at, f, |inner, own| self.0.linearise(inner, free, own, &mut inner_fx, &mut inner_fp));
        bordered(&inner_fx, n, 1, at.lanes, fx);
        fp.fill(0.0);
        fp[..inner_fp.len()].copy_from_slice(&inner_fp);
    }

    fn directional(&self, _at: Batch, _directions: &[&[f64]], out: &mut [f64]) {
        out.fill(f64::NAN);
    }

    fn output_count(&self) -> usize {
        self.0.output_count()
    }

    fn outputs(&self, at: Batch, out: &mut [f64]) {
        self.0.outputs(self.inner(at), out);
    }

    fn switch_count(&self) -> usize {
        self.0.switch_count()
    }

    fn event_count(&self) -> usize {
        self.0.event_count()
    }

    fn event_direction(&self, event: usize) -> f64 {
        self.0.event_direction(event)
    }

    fn reset(&self, event: usize, at: Batch, free: &[usize], to: [&mut [f64]; 4]) {
        let n = self.0.dim();
        let [r, ..] = to;
        r[n..].copy_from_slice(&at.states[n..]);
        let [mut rx, mut rp, mut rt] = [n * n, n * free.len(), n].map(|size| vec![0.0; size]);
        self.0.reset(event, self.inner(at), free, [&mut r[..n], &mut rx, &mut rp, &mut rt]);
    }

    fn forbidden(&self, at: Batch) -> Option<usize> {
        self.0.forbidden(self.inner(at))
    }

    fn switches(&self, at: Batch, out: &mut [f64]) {
        self.0.switches(self.inner(at), out);
    }

    fn normal_speeds(&self, at: Batch, switch: usize) -> [Vec<f64>; 2] {
        self.0.normal_speeds(self.inner(at), switch)
    }
}
