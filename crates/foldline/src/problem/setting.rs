//! A vector field with everything fixed but the free parameters.

use crate::contract::{Batch, VectorField};
use crate::diagram::Point;

/// A free parameter p of a curve. Its unknown is λ = p / scale, so that nothing depends on the unit of p.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Index of the parameter; beyond the last one, p is a number on which nothing depends.
    pub index: usize,
    /// Characteristic size.
    pub scale: f64,
    /// Parameters that change with this one.
    pub ties: Vec<Tie>,
}

impl Axis {
    /// One parameter by itself.
    pub fn new(index: usize, scale: f64) -> Axis {
        Axis { index, scale, ties: Vec::new() }
    }
}

/// A parameter q that follows a free one p: q = offset + slope p.
#[derive(Clone, Debug, PartialEq)]
pub struct Tie {
    /// Index of the parameter that follows.
    pub index: usize,
    /// Its value at p = 0.
    pub offset: f64,
    /// dq/dp.
    pub slope: f64,
}

/// A vector field with everything fixed but the free parameters λ₁ … λ_k.
#[derive(Clone)]
pub struct Setting<'a> {
    /// The vector field.
    pub field: &'a dyn VectorField,
    /// `[n]` characteristic size of each state component, for relative errors.
    pub scales: &'a [f64],
    /// Values of all parameters. Free ones have these values to the last bit at the unknowns that belong to them; elsewhere they are ignored.
    pub parameters: Vec<f64>,
    /// The free parameters, in the order of the unknowns.
    pub axes: Vec<Axis>,
}

impl Setting<'_> {
    /// The period of a state that is an angle.
    pub fn period(&self, state: usize) -> Option<f64> {
        self.field.periods().get(state).copied().filter(|period| period.is_finite())
    }

    /// Moves states `[count][n]` together by whole periods of the angles, so that the first is next to `beside` `[n]`.
    pub fn nearest_copy(&self, states: &mut [f64], beside: &[f64]) {
        let n = beside.len();
        for (c, period) in self.field.periods().iter().enumerate().filter(|(_, period)| period.is_finite()) {
            let copies = period * ((beside[c] - states[c]) / period).round();
            states[c..].iter_mut().step_by(n).for_each(|x| *x += copies);
        }
    }

    /// How many parameters are free.
    pub fn freedom(&self) -> usize {
        self.axes.len()
    }

    /// Value of the last free parameter for which its unknown is 1; that of the continuation.
    pub fn unit(&self) -> f64 {
        self.axes.last().map_or(1.0, |axis| axis.scale)
    }

    /// All parameter values with the free ones at `unknowns` `[k]`.
    pub fn at(&self, unknowns: &[f64]) -> Vec<f64> {
        let mut all = self.parameters.clone();
        for (axis, unknown) in self.axes.iter().zip(unknowns) {
            let mut value = axis.scale * unknown;
            if let Some(own) = all.get_mut(axis.index) {
                if *own / axis.scale == *unknown {
                    value = *own;
                }
                *own = value;
            }
            for tie in &axis.ties {
                if let Some(own) = all.get_mut(tie.index) {
                    *own = tie.offset + tie.slope * value;
                }
            }
        }
        all
    }

    /// The unknowns `[k]` at a point.
    pub fn unknowns_of(&self, point: &Point) -> Vec<f64> {
        let each = self.axes.iter().map(|axis| point.parameters.get(axis.index).copied().unwrap_or(0.0) / axis.scale);
        each.collect()
    }

    /// A change `[k]` of the unknowns as one of all parameters.
    pub fn spread(&self, change: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.parameters.len()];
        for (axis, unknown) in self.axes.iter().zip(change) {
            let value = axis.scale * unknown;
            if let Some(own) = all.get_mut(axis.index) {
                *own += value;
            }
            for tie in &axis.ties {
                if let Some(own) = all.get_mut(tie.index) {
                    *own += tie.slope * value;
                }
            }
        }
        all
    }

    /// f, f_x and the derivatives with respect to the unknowns: `fp` is `[n·k × lanes]`, entry (i, axis) at i·k + axis.
    pub fn linearise(&self, batch: Batch, f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        let known = self.parameters.len();
        let plain = self.axes.iter().all(|axis| axis.ties.is_empty() && axis.index < known);
        let mut columns: Vec<(usize, usize, f64)> = Vec::new();
        for (a, axis) in self.axes.iter().enumerate() {
            let own = [(a, axis.index, axis.scale)].into_iter();
            let tied = axis.ties.iter().map(|tie| (a, tie.index, tie.slope * axis.scale));
            columns.extend(own.chain(tied).filter(|(_, index, _)| *index < known));
        }
        let free: Vec<usize> = columns.iter().map(|(_, index, _)| *index).collect();
        if plain {
            self.field.linearise(batch, &free, f, fx, fp);
            let (k, scaled) = (self.axes.len(), self.axes.iter().any(|axis| axis.scale != 1.0));
            for (c, entry) in fp.chunks_exact_mut(batch.lanes).enumerate().filter(|_| scaled) {
                entry.iter_mut().for_each(|d| *d *= self.axes[c % k].scale);
            }
            return;
        }
        let (n, k, q, lanes) = (self.field.dim(), self.axes.len(), columns.len(), batch.lanes);
        let mut each = vec![0.0; n * q * lanes];
        self.field.linearise(batch, &free, f, fx, &mut each);
        fp.fill(0.0);
        for (c, (axis, _, slope)) in columns.iter().enumerate() {
            for i in 0..n {
                let from = &each[(i * q + c) * lanes..(i * q + c + 1) * lanes];
                let to = &mut fp[(i * k + axis) * lanes..(i * k + axis + 1) * lanes];
                to.iter_mut().zip(from).for_each(|(t, v)| *t += slope * v);
            }
        }
    }

    /// Largest change of an unknown against its size, with 1 as the least size.
    pub(super) fn relative_size(change: &[f64], unknowns: &[f64]) -> f64 {
        let each = change.iter().zip(unknowns).map(|(d, v)| (d / (1.0 + v.abs())).abs());
        each.fold(0.0, |m: f64, x| if x > m || x.is_nan() { x } else { m })
    }
}
