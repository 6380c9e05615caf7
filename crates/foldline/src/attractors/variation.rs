//! A field with the growth of a perturbation, by which the largest Lyapunov exponent is measured.
//!
//! **Idea.** A vector of unit length is carried by the linearised flow and kept at that length; one further state collects
//! the logarithm of its growth. Without forcing the perturbation is kept perpendicular to the flow, along which nothing
//! grows, so that the exponent is 0 on a torus, negative on a cycle and positive in chaos, with and without forcing.
//!
//! **Equations.** In states divided by their scales, with A = ∂f/∂x and the direction e = f / |f| of the flow:
//!
//! ```text
//!   (1)  v' = g - (v·g) v + |A v| (1 - |v|²) v,   s' = v·g / |v|²
//!   (2)  g = A v   or, autonomous,   g = A v - (e·A v + v·A e) e
//! ```
//!
//! (2) keeps the component e·v as it is. What integration makes of it would turn into a perturbation as the flow turns,
//! and so it decays: the states hold v + δ e with δ' = -|A v| δ.
//!
//! **Source.** benettin1980; christiansen1997 (continuous normalisation).
//!
//! **Fails when** f or the state jumps: the perturbation would have to jump too.

use crate::contract::{Batch, VectorField};

/// The states of a field, v, s and, under forcing, the time in forcing periods.
pub(super) struct Varied<'a> {
    pub(super) field: &'a dyn VectorField,
    pub(super) scales: &'a [f64],
}

impl Varied<'_> {
    /// Start `[2n + 1]`, or one more under forcing, at a state.
    pub(super) fn start(&self, x: &[f64], clock: f64) -> Vec<f64> {
        let n = x.len();
        // Any direction will do that is not special.
        let v: Vec<f64> = (0..n).map(|i| (1.0 + 0.37 * i as f64).cos()).collect();
        let norm = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let mut start: Vec<f64> = x.iter().copied().chain(v.iter().map(|v| v / norm)).collect();
        start.push(0.0);
        if self.field.forced() {
            start.push(clock);
        }
        start
    }

    fn inner<'b>(&self, at: Batch<'b>) -> Batch<'b> {
        let (n, lanes) = (self.field.dim(), at.lanes);
        let times = if self.field.forced() { &at.states[(2 * n + 1) * lanes..] } else { &[] };
        Batch { states: &at.states[..n * lanes], times, ..at }
    }

    /// A of a lane, in scaled states.
    fn scaled(&self, fx: &[f64], lanes: usize, l: usize) -> Vec<f64> {
        let n = self.field.dim();
        let entry = |k: usize| fx[k * lanes + l] * self.scales[k % n] / self.scales[k / n];
        (0..n * n).map(entry).collect()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn times(a: &[f64], v: &[f64]) -> Vec<f64> {
    a.chunks_exact(v.len()).map(|row| dot(row, v)).collect()
}

impl VectorField for Varied<'_> {
    fn dim(&self) -> usize {
        2 * self.field.dim() + 1 + usize::from(self.field.forced())
    }

    fn parameter_count(&self) -> usize {
        self.field.parameter_count()
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        let (n, lanes) = (self.field.dim(), at.lanes);
        let mut fx = vec![0.0; n * n * lanes];
        self.field.linearise(self.inner(at), &[], &mut f[..n * lanes], &mut fx, &mut []);
        for l in 0..lanes {
            let a = self.scaled(&fx, lanes, l);
            let mut v: Vec<f64> = (0..n).map(|i| at.states[(n + i) * lanes + l]).collect();
            let mut along: Vec<f64> = (0..n).map(|i| f[i * lanes + l] / self.scales[i]).collect();
            let speed = dot(&along, &along).sqrt();
            let free = !self.field.forced() && speed > 0.0;
            let mut part = 0.0;
            if free {
                along.iter_mut().for_each(|e| *e /= speed);
                part = dot(&along, &v);
                v.iter_mut().zip(&along).for_each(|(v, e)| *v -= part * e);
            }
            let mut g = times(&a, &v);
            let pace = dot(&g, &g).sqrt();
            if free {
                let turn = dot(&along, &g) + dot(&v, &times(&a, &along));
                g.iter_mut().zip(&along).for_each(|(g, e)| *g -= turn * e);
            }
            let length = dot(&v, &v).max(f64::MIN_POSITIVE);
            let rate = dot(&v, &g) / length;
            for i in 0..n {
                f[(n + i) * lanes + l] =
                    g[i] - rate * v[i] + pace * ((1.0 - length) * v[i] - if free { part * along[i] } else { 0.0 });
            }
            f[2 * n * lanes + l] = rate;
        }
        f[(2 * n + 1) * lanes..].fill(1.0);
    }

    /// Derivatives for implicit steps: those of the states, and approximately those of v.
    fn linearise(&self, at: Batch, _free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        let (n, lanes, all) = (self.field.dim(), at.lanes, self.dim());
        let (mut own, mut unused) = (vec![0.0; n * n * lanes], vec![0.0; n * lanes]);
        self.field.linearise(self.inner(at), &[], &mut unused, &mut own, &mut []);
        self.evaluate(at, f);
        fp.fill(0.0);
        fx.fill(0.0);
        for l in 0..lanes {
            let scaled = self.scaled(&own, lanes, l);
            let rate = f[2 * n * lanes + l];
            for k in 0..n * n {
                let (i, j) = (k / n, k % n);
                fx[(i * all + j) * lanes + l] = own[k * lanes + l];
                fx[((n + i) * all + n + j) * lanes + l] = scaled[k] - if i == j { rate } else { 0.0 };
            }
        }
    }

    fn directional(&self, _at: Batch, _directions: &[&[f64]], out: &mut [f64]) {
        out.fill(f64::NAN);
    }

    fn time_unit(&self, parameters: &[f64]) -> f64 {
        self.field.time_unit(parameters)
    }

    fn ended(&self) -> bool {
        self.field.ended()
    }
}
