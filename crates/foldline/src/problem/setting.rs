//! A vector field with everything fixed but the free parameters.

use crate::contract::{Batch, VectorField};
use crate::diagram::Point;

/// A free parameter of a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Index of the parameter; beyond the last one, λ is a number on which nothing depends.
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

/// A parameter that follows a free one: p = offset + slope λ.
#[derive(Clone, Debug, PartialEq)]
pub struct Tie {
    /// Index of the parameter that follows.
    pub index: usize,
    /// Its value at λ = 0.
    pub offset: f64,
    /// dp/dλ.
    pub slope: f64,
}

/// A vector field with everything fixed but the free parameters λ₁ … λ_k.
#[derive(Clone)]
pub struct Setting<'a> {
    /// The vector field.
    pub field: &'a dyn VectorField,
    /// `[n]` characteristic size of each state component, for relative errors.
    pub scales: &'a [f64],
    /// Values of all parameters; those of free ones are ignored.
    pub parameters: Vec<f64>,
    /// The free parameters, in the order of the unknowns.
    pub axes: Vec<Axis>,
}

impl Setting<'_> {
    /// How many parameters are free.
    pub fn freedom(&self) -> usize {
        self.axes.len()
    }

    /// All parameter values with the free ones at `values` `[k]`.
    pub fn at(&self, values: &[f64]) -> Vec<f64> {
        let mut all = self.parameters.clone();
        for (axis, value) in self.axes.iter().zip(values) {
            if let Some(own) = all.get_mut(axis.index) {
                *own = *value;
            }
            for tie in &axis.ties {
                if let Some(own) = all.get_mut(tie.index) {
                    *own = tie.offset + tie.slope * value;
                }
            }
        }
        all
    }

    /// The free parameters `[k]` of a point.
    pub fn values_of(&self, point: &Point) -> Vec<f64> {
        self.axes.iter().map(|axis| point.parameters.get(axis.index).copied().unwrap_or(0.0)).collect()
    }

    /// A change `[k]` of the free parameters as one of all parameters.
    pub fn spread(&self, change: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.parameters.len()];
        for (axis, value) in self.axes.iter().zip(change) {
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

    /// f, f_x and the derivatives along the free parameters: `fp` is `[n·k × lanes]`, entry (i, axis) at i·k + axis.
    pub fn linearise(&self, batch: Batch, f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        let known = self.parameters.len();
        let plain = self.axes.iter().all(|axis| axis.ties.is_empty() && axis.index < known);
        let mut columns: Vec<(usize, usize, f64)> = Vec::new();
        for (a, axis) in self.axes.iter().enumerate() {
            let own = [(a, axis.index, 1.0)].into_iter();
            let tied = axis.ties.iter().map(|tie| (a, tie.index, tie.slope));
            columns.extend(own.chain(tied).filter(|(_, index, _)| *index < known));
        }
        let free: Vec<usize> = columns.iter().map(|(_, index, _)| *index).collect();
        if plain {
            self.field.linearise(batch, &free, f, fx, fp);
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

    /// Σ aᵢ bᵢ / scaleᵢ² over the free parameters.
    pub(super) fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        self.axes.iter().zip(a.iter().zip(b)).map(|(axis, (x, y))| x * y / (axis.scale * axis.scale)).sum()
    }

    /// Largest change of a free parameter against its size, with the scale as the least size.
    pub(super) fn relative_size(&self, change: &[f64], values: &[f64]) -> f64 {
        let each = self.axes.iter().zip(change.iter().zip(values));
        each.map(|(axis, (d, v))| (d / (axis.scale + v.abs())).abs())
            .fold(0.0, |m: f64, x| if x > m || x.is_nan() { x } else { m })
    }
}
