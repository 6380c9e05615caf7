//! What is computed for all lanes of a batch at once.
//!
//! **Idea.** Every quantity is an array over the lanes, one for each component. The stages, the error and the factors by which
//! steps may change are loops over such arrays, compiled for the widest vector instructions that the machine has.

use super::super::Tolerance;
use super::super::kink::PLACES;
use super::super::tableau::{A, ERROR, STAGES};
use super::{pace, shared_or_own};
use crate::contract::{Batch, Parameters, VectorField};

/// The arrays.
#[derive(Clone, Debug, Default)]
pub(super) struct Lanes {
    pub(super) count: usize,
    pub(super) n: usize,
    /// `[n × lanes]`.
    pub(super) x: Vec<f64>,
    pub(super) next: Vec<f64>,
    pub(super) stage: Vec<f64>,
    pub(super) slopes: [Vec<f64>; STAGES],
    /// `[k × lanes]` where every trajectory has parameters of its own, else empty.
    own: Vec<f64>,
    /// `[switches × lanes]`: the sign of each, and its value at the start of the step, 0 where it has just changed sign.
    pub(super) signs: Vec<f64>,
    pub(super) switches: Vec<f64>,
    /// `[switches × lanes]` values at each of [`PLACES`].
    pub(super) ahead: [Vec<f64>; PLACES.len()],
    /// `[lanes]` signed length of the step to try.
    pub(super) h: Vec<f64>,
    /// `[lanes]` error of the step that was tried, in units of the tolerance; NaN if anything is not finite.
    pub(super) error: Vec<f64>,
    /// `[lanes]` largest component at its end.
    pub(super) largest: Vec<f64>,
    /// `[lanes]` factor (1) of the ensemble without and with its second power.
    pub(super) shrink: Vec<f64>,
    pub(super) growth: Vec<f64>,
    /// `[lanes]` err_prev.
    before: Vec<f64>,
}

impl Lanes {
    /// Room for `count` trajectories with `own` parameters each.
    pub(super) fn new(field: &dyn VectorField, count: usize, own: usize) -> Lanes {
        let n = field.dim();
        let of = |components: usize| vec![0.0; components * count];
        let switches = field.switch_count();
        Lanes {
            count,
            n,
            x: of(n),
            next: of(n),
            stage: of(n),
            slopes: std::array::from_fn(|_| of(n)),
            own: of(own),
            signs: of(switches),
            switches: of(switches),
            ahead: std::array::from_fn(|_| of(switches)),
            h: of(1),
            error: of(1),
            largest: of(1),
            shrink: of(1),
            growth: of(1),
            before: of(1),
        }
    }

    /// The parameters of all lanes, given those that are shared.
    pub(super) fn parameters<'p>(&'p self, shared: &'p [f64]) -> Parameters<'p> {
        shared_or_own(shared, &self.own)
    }

    /// The state of lane `l`.
    pub(super) fn state(&self, l: usize) -> Vec<f64> {
        self.x.iter().skip(l).step_by(self.count).copied().collect()
    }

    /// Lane `l` takes over a trajectory.
    pub(super) fn set(&mut self, l: usize, start: &[f64], own: &[f64]) {
        start.iter().enumerate().for_each(|(i, x)| self.x[i * self.count + l] = *x);
        own.iter().enumerate().for_each(|(k, p)| self.own[k * self.count + l] = *p);
        self.before[l] = pace::SMALLEST_BEFORE;
    }

    /// The error of the step of lane `l` influences the next one.
    pub(super) fn remember_error(&mut self, l: usize) {
        self.before[l] = self.error[l].max(pace::SMALLEST_BEFORE);
    }

    /// Tries a step in every lane: stages 2 to 7, error, and by how much the next step may be longer.
    pub(super) fn advance(&mut self, field: &dyn VectorField, parameters: &[f64], tolerance: &Tolerance) {
        pulp::Arch::new().dispatch(Advance { lanes: self, field, parameters, tolerance });
    }

    #[inline(always)]
    fn stages(&mut self, field: &dyn VectorField, shared: &[f64]) {
        self.stage::<1>(0);
        self.evaluate(field, shared, 1);
        self.stage::<2>(1);
        self.evaluate(field, shared, 2);
        self.stage::<3>(2);
        self.evaluate(field, shared, 3);
        self.stage::<4>(3);
        self.evaluate(field, shared, 4);
        self.stage::<5>(4);
        self.evaluate(field, shared, 5);
        self.stage::<6>(5);
        self.evaluate(field, shared, 6);
    }

    /// The states of a stage from N slopes, with row `row` of the tableau.
    #[inline(always)]
    fn stage<const N: usize>(&mut self, row: usize) {
        let count = self.count;
        let a: [f64; N] = std::array::from_fn(|j| A[row][j]);
        let target = if N + 1 == STAGES { &mut self.next } else { &mut self.stage };
        for (i, (to, x)) in target.chunks_exact_mut(count).zip(self.x.chunks_exact(count)).enumerate() {
            combine(to, x, &self.h, a, std::array::from_fn(|j| &self.slopes[j][i * count..][..count]));
        }
    }

    /// f at stage k + 1, into slope k.
    #[inline(always)]
    fn evaluate(&mut self, field: &dyn VectorField, shared: &[f64], k: usize) {
        let states = if k + 1 == STAGES { &self.next } else { &self.stage };
        let at = Batch { lanes: self.count, states, parameters: shared_or_own(shared, &self.own), times: &[] };
        match self.signs.is_empty() {
            true => field.evaluate(at, &mut self.slopes[k]),
            false => field.evaluate_switched(at, &self.signs, &mut self.slopes[k]),
        }
    }

    /// (2) of the tableau in units of the tolerance, and the largest component.
    #[inline(always)]
    fn errors(&mut self, tolerance: &Tolerance) {
        let count = self.count;
        self.error.fill(0.0);
        self.largest.fill(0.0);
        for i in 0..self.n {
            let ends = [&self.x, &self.next].map(|x| &x[i * count..][..count]);
            let k = std::array::from_fn(|j| &self.slopes[j][i * count..][..count]);
            let tolerance = [tolerance.absolute[i], tolerance.relative];
            add_errors(&mut self.error, &mut self.largest, &self.h, ends, k, tolerance);
        }
        let mean = 1.0 / self.n as f64;
        self.error.iter_mut().for_each(|error| *error = (*error * mean).sqrt());
    }

    /// The lanes of which `accepted` says so go to the end of their step, the others stay.
    pub(super) fn take_over(&mut self, accepted: impl Iterator<Item = bool>) {
        std::mem::swap(&mut self.x, &mut self.next);
        let [first, .., last] = &mut self.slopes;
        std::mem::swap(first, last);
        std::mem::swap(&mut self.switches, &mut self.ahead[PLACES.len() - 1]);
        for (l, _) in accepted.enumerate().filter(|(_, accepted)| !accepted) {
            for at in (l..self.x.len()).step_by(self.count) {
                self.x[at] = self.next[at];
                self.slopes[0][at] = self.slopes[STAGES - 1][at];
            }
            let back = &self.ahead[PLACES.len() - 1];
            (l..back.len()).step_by(self.count).for_each(|at| self.switches[at] = back[at]);
        }
    }

    /// Only these lanes stay.
    pub(super) fn keep(&mut self, kept: &[usize]) {
        let scalars = [&mut self.h, &mut self.before];
        let of_lanes =
            [&mut self.x, &mut self.slopes[0], &mut self.own, &mut self.signs, &mut self.switches].into_iter();
        for array in of_lanes.chain(scalars) {
            let mut to = 0;
            for from in (0..array.len()).step_by(self.count) {
                for &l in kept {
                    array[to] = array[from + l];
                    to += 1;
                }
            }
            array.truncate(to);
        }
        self.count = kept.len();
        self.ahead.iter_mut().for_each(|values| values.truncate(self.signs.len()));
        self.slopes.iter_mut().for_each(|k| k.truncate(self.n * self.count));
        [&mut self.next, &mut self.stage].into_iter().for_each(|v| v.truncate(self.n * self.count));
        let scalars = [&mut self.error, &mut self.largest, &mut self.shrink, &mut self.growth];
        scalars.into_iter().for_each(|v| v.truncate(self.count));
    }
}

/// x + h Σ a k. (A function of its own, so that the compiler knows that `to` is none of the others.)
#[inline(always)]
fn combine<const N: usize>(to: &mut [f64], x: &[f64], h: &[f64], a: [f64; N], k: [&[f64]; N]) {
    let count = to.len();
    let (x, h, k) = (&x[..count], &h[..count], k.map(|k| &k[..count]));
    for l in 0..count {
        let mut change = a[0] * k[0][l];
        for j in 1..N {
            change += a[j] * k[j][l];
        }
        to[l] = x[l] + h[l] * change;
    }
}

/// Adds the square of the error of one component, between these ends, in units of its tolerance (absolute, relative).
#[inline(always)]
fn add_errors(
    error: &mut [f64],
    largest: &mut [f64],
    h: &[f64],
    ends: [&[f64]; 2],
    k: [&[f64]; STAGES],
    tolerance: [f64; 2],
) {
    let count = error.len();
    let (h, largest, ends, k) = (&h[..count], &mut largest[..count], ends.map(|x| &x[..count]), k.map(|k| &k[..count]));
    for l in 0..count {
        let mut e = ERROR[0] * k[0][l];
        for j in 2..STAGES {
            e += ERROR[j] * k[j][l];
        }
        let size = larger(ends[0][l].abs(), ends[1][l].abs());
        let scaled = h[l] * e / (tolerance[0] + tolerance[1] * size);
        error[l] += scaled * scaled;
        largest[l] = larger(largest[l], size);
    }
}

/// The larger of two magnitudes.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// One sweep, handed to the dispatcher of instruction sets.
struct Advance<'a, 'b> {
    lanes: &'a mut Lanes,
    field: &'b dyn VectorField,
    parameters: &'b [f64],
    tolerance: &'b Tolerance,
}

impl pulp::NullaryFnOnce for Advance<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Advance { lanes, field, parameters, tolerance } = self;
        lanes.stages(field, parameters);
        lanes.errors(tolerance);
        pace::all_factors(&lanes.error, &lanes.before, &mut lanes.shrink, &mut lanes.growth);
    }
}
