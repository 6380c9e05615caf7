//! A vector field with some parameters free and all others fixed.

use crate::contract::{Batch, VectorField};
use crate::diagram::Point;

/// A free parameter p of a curve. Its unknown is λ = p / scale, so that results do not depend on the unit of p.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Index of the parameter; beyond the last one, p is a dummy that affects nothing.
    pub index: usize,
    /// Characteristic size.
    pub scale: f64,
    /// Parameters that change with this one.
    pub ties: Vec<Tie>,
}

impl Axis {
    /// A single parameter without ties.
    pub fn new(index: usize, scale: f64) -> Axis {
        Axis { index, scale, ties: Vec::new() }
    }
}

/// A parameter q tied to a free one p: q = offset + slope p.
#[derive(Clone, Debug, PartialEq)]
pub struct Tie {
    /// Index of the tied parameter.
    pub index: usize,
    /// Its value at p = 0.
    pub offset: f64,
    /// dq/dp.
    pub slope: f64,
}

/// A vector field with free parameters λ₁ … λ_k and all others fixed.
#[derive(Clone)]
pub struct Setting<'a> {
    /// The vector field.
    pub field: &'a dyn VectorField,
    /// `[n]` characteristic size of each state component, for relative errors.
    pub scales: &'a [f64],
    /// Values of all parameters. At the corresponding unknowns, free ones take exactly these values; otherwise they are
    /// ignored.
    pub parameters: Vec<f64>,
    /// The free parameters, in the order of the unknowns.
    pub axes: Vec<Axis>,
}

impl Setting<'_> {
    /// Period of a state that is an angle, else `None`.
    pub fn period(&self, state: usize) -> Option<f64> {
        self.field.periods().get(state).copied().filter(|period| period.is_finite())
    }

    /// Shifts all states `[count][n]` by the same whole periods of the angles, so that the first is closest to `beside`
    /// `[n]`.
    pub fn nearest_copy(&self, states: &mut [f64], beside: &[f64]) {
        let n = beside.len();
        for (c, period) in self.field.periods().iter().enumerate().filter(|(_, period)| period.is_finite()) {
            let copies = period * ((beside[c] - states[c]) / period).round();
            states[c..].iter_mut().step_by(n).for_each(|x| *x += copies);
        }
    }

    /// k, the number of free parameters.
    pub fn freedom(&self) -> usize {
        self.axes.len()
    }

    /// Value of the last free parameter, the continuation parameter, at which its unknown is 1.
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

    /// Unknowns `[k]` of the free parameters at a point.
    pub fn unknowns_of(&self, point: &Point) -> Vec<f64> {
        let each = self.axes.iter().map(|axis| point.parameters.get(axis.index).copied().unwrap_or(0.0) / axis.scale);
        each.collect()
    }

    /// Change of all parameters that corresponds to a change `[k]` of the unknowns.
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

    /// True if every unknown is one parameter of the field, and the columns of all derivatives: axis, index of the
    /// parameter, factor.
    fn columns(&self) -> (bool, Vec<(usize, usize, f64)>) {
        let known = self.parameters.len();
        let plain = self.axes.iter().all(|axis| axis.ties.is_empty() && axis.index < known);
        let mut columns: Vec<(usize, usize, f64)> = Vec::new();
        for (a, axis) in self.axes.iter().enumerate() {
            let own = [(a, axis.index, axis.scale)].into_iter();
            let tied = axis.ties.iter().map(|tie| (a, tie.index, tie.slope * axis.scale));
            columns.extend(own.chain(tied).filter(|(_, index, _)| *index < known));
        }
        (plain, columns)
    }

    /// The switches at one point and their derivatives with respect to the states, the unknowns λ and time: `h` and
    /// `ht` are `[switches]`, `hx` is `[switches × n]`, `hp` is `[switches × k]`.
    pub fn linearise_switches(&self, batch: Batch) -> [Vec<f64>; 4] {
        let (count, n) = (self.field.switch_count(), self.field.dim());
        let (_, columns) = self.columns();
        let free: Vec<usize> = columns.iter().map(|(_, index, _)| *index).collect();
        let [mut h, mut hx, mut each, mut ht] = [1, n, free.len(), 1].map(|size| vec![0.0; count * size]);
        self.field.linearise_switches(batch, &free, [&mut h, &mut hx, &mut each, &mut ht]);
        [h, hx, self.gathered(&each, count, 1), ht]
    }

    /// The state after an event at one point and its derivatives with respect to the states, the unknowns λ and time; see
    /// [`VectorField::reset`].
    pub fn reset(&self, event: usize, batch: Batch) -> [Vec<f64>; 4] {
        let n = self.field.dim();
        let (_, columns) = self.columns();
        let free: Vec<usize> = columns.iter().map(|(_, index, _)| *index).collect();
        let [mut r, mut rx, mut each, mut rt] = [1, n, free.len(), 1].map(|size| vec![0.0; n * size]);
        self.field.reset(event, batch, &free, [&mut r, &mut rx, &mut each, &mut rt]);
        [r, rx, self.gathered(&each, n, 1), rt]
    }

    /// The conditions at both ends of a boundary-value problem and their derivatives with respect to the states and the
    /// unknowns λ; see [`VectorField::boundary`].
    pub fn boundary(&self, ends: [&[f64]; 2], parameters: &[f64]) -> [Vec<f64>; 4] {
        let ([count, _], n) = (self.field.conditions(), self.field.dim());
        let (_, columns) = self.columns();
        let free: Vec<usize> = columns.iter().map(|(_, index, _)| *index).collect();
        let [mut b, mut left, mut right, mut each] = [1, n, n, free.len()].map(|size| vec![0.0; count * size]);
        self.field.boundary(ends, parameters, &free, [&mut b, &mut left, &mut right, &mut each]);
        [b, left, right, self.gathered(&each, count, 1)]
    }

    /// The integrands of a boundary-value problem and their derivatives with respect to the states and the unknowns λ;
    /// see [`VectorField::integrands`].
    pub fn integrands(&self, batch: Batch) -> [Vec<f64>; 3] {
        let ([_, count], n, lanes) = (self.field.conditions(), self.field.dim(), batch.lanes);
        let (_, columns) = self.columns();
        let free: Vec<usize> = columns.iter().map(|(_, index, _)| *index).collect();
        let [mut g, mut gx, mut each] = [1, n, free.len()].map(|size| vec![0.0; count * size * lanes]);
        self.field.integrands(batch, &free, [&mut g, &mut gx, &mut each]);
        [g, gx, self.gathered(&each, count, lanes)]
    }

    /// Derivatives with respect to the unknowns λ, `[rows × k × lanes]`, from those with respect to the parameters that
    /// move with them, `[rows × columns × lanes]`.
    fn gathered(&self, each: &[f64], rows: usize, lanes: usize) -> Vec<f64> {
        let (k, (_, columns)) = (self.axes.len(), self.columns());
        let mut out = vec![0.0; rows * k * lanes];
        for row in 0..rows {
            for (c, (axis, _, slope)) in columns.iter().enumerate() {
                let from = &each[(row * columns.len() + c) * lanes..][..lanes];
                let to = &mut out[(row * k + axis) * lanes..][..lanes];
                to.iter_mut().zip(from).for_each(|(t, v)| *t += slope * v);
            }
        }
        out
    }

    /// f, f_x and the derivatives with respect to the unknowns: `fp` is `[n·k × lanes]`, entry (i, axis) at i·k + axis.
    pub fn linearise(&self, batch: Batch, f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        let (plain, columns) = self.columns();
        let free: Vec<usize> = columns.iter().map(|(_, index, _)| *index).collect();
        if plain {
            self.field.linearise(batch, &free, f, fx, fp);
            let (k, scaled) = (self.axes.len(), self.axes.iter().any(|axis| axis.scale != 1.0));
            for (c, entry) in fp.chunks_exact_mut(batch.lanes).enumerate().filter(|_| scaled) {
                entry.iter_mut().for_each(|d| *d *= self.axes[c % k].scale);
            }
            return;
        }
        let (n, q, lanes) = (self.field.dim(), columns.len(), batch.lanes);
        let mut each = vec![0.0; n * q * lanes];
        self.field.linearise(batch, &free, f, fx, &mut each);
        fp.copy_from_slice(&self.gathered(&each, n, lanes));
    }

    /// Largest relative change of an unknown, with sizes below 1 taken as 1.
    pub(super) fn relative_size(change: &[f64], unknowns: &[f64]) -> f64 {
        let each = change.iter().zip(unknowns).map(|(d, v)| (d / (1.0 + v.abs())).abs());
        each.fold(0.0, |m: f64, x| if x > m || x.is_nan() { x } else { m })
    }
}
