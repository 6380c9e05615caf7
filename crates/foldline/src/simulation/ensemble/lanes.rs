//! Operations on all lanes of a batch at once.
//!
//! **Idea.** Every quantity is an array over the lanes, one for each component. The stages, the error, the acceptance
//! of a step and the length of the next one are loops over such arrays, compiled for the widest vector instructions of
//! the machine.

use super::super::Tolerance;
use super::super::aligned::Aligned;
use super::super::kink::PLACES;
use super::super::tableau::{A, ERROR, STAGES};
use super::pace::{self, Limits};
use super::shared_or_own;
use super::stiff;
use crate::contract::{Batch, Parameters, VectorField};

/// Arrays over the lanes.
#[derive(Clone, Debug, Default)]
pub(super) struct Lanes {
    pub(super) count: usize,
    pub(super) n: usize,
    /// `[n × lanes]`.
    pub(super) x: Aligned,
    pub(super) next: Aligned,
    /// State at the stage being evaluated; after a sweep, that of the last stage but one.
    pub(super) stage: Aligned,
    /// States at which switches are sampled; empty without switches.
    pub(super) sampled: Aligned,
    pub(super) slopes: [Aligned; STAGES],
    /// `[k × lanes]` if every trajectory has its own parameters, else empty.
    own: Aligned,
    /// `[switches × lanes]` sign of each, and its value at the start of the step, 0 if it has just changed sign.
    pub(super) signs: Aligned,
    pub(super) switches: Aligned,
    /// `[switches × lanes]` values at each of [`PLACES`].
    pub(super) ahead: [Aligned; PLACES.len()],
    /// `[lanes]` time reached, and time at the end of the step tried.
    pub(super) time: Aligned,
    pub(super) end: Aligned,
    /// `[lanes]` signed length of the step to try, and of the one after it.
    pub(super) h: Aligned,
    pub(super) planned: Aligned,
    /// `[lanes]` largest factor by which the next step may be longer.
    pub(super) most: Aligned,
    /// `[lanes]` error of the step tried, in units of the tolerance; NaN if anything is not finite.
    pub(super) error: Aligned,
    /// `[lanes]` 1 if that error is small enough, else 0.
    pub(super) accepted: Aligned,
    /// `[lanes]` binary logarithm of the second power in (1) of the ensemble.
    pub(super) second: Aligned,
    /// `[lanes]` largest component at the ends of the step, and the magnitude beyond which a trajectory is unbounded: 0
    /// in an idle lane.
    pub(super) largest: Aligned,
    pub(super) bound: Aligned,
    /// `[lanes]` length of the last step tried.
    pub(super) taken: Aligned,
    /// `[lanes]` number of steps tried after which stiffness is next checked.
    pub(super) look: Aligned,
    /// `[lanes]` steps tried, and steps accepted.
    pub(super) tried: Aligned,
    pub(super) steps: Aligned,
    /// `[lanes]` 1 if a trajectory may have ended, else 0.
    pub(super) remarkable: Aligned,
}

impl Lanes {
    /// Arrays for `count` trajectories with `own` parameters each.
    pub(super) fn new(field: &dyn VectorField, count: usize, own: usize) -> Lanes {
        let n = field.dim();
        let of = |components: usize| Aligned::zeros(components * count);
        let switches = field.switch_count();
        Lanes {
            count,
            n,
            x: of(n),
            next: of(n),
            stage: of(n),
            sampled: of(if switches > 0 { n } else { 0 }),
            slopes: std::array::from_fn(|_| of(n)),
            own: of(own),
            signs: of(switches),
            switches: of(switches),
            ahead: std::array::from_fn(|_| of(switches)),
            time: of(1),
            end: of(1),
            h: of(1),
            planned: of(1),
            most: of(1),
            error: of(1),
            accepted: of(1),
            second: of(1),
            largest: of(1),
            bound: of(1),
            taken: of(1),
            look: of(1),
            tried: of(1),
            steps: of(1),
            remarkable: of(1),
        }
    }

    /// Parameters of all lanes, given the shared ones.
    pub(super) fn parameters<'p>(&'p self, shared: &'p [f64]) -> Parameters<'p> {
        shared_or_own(shared, &self.own)
    }

    /// State of lane `l`.
    pub(super) fn state(&self, l: usize) -> Vec<f64> {
        self.x.iter().skip(l).step_by(self.count).copied().collect()
    }

    /// Assigns a trajectory to lane `l`, which begins at `time` and counts as unbounded beyond `bound`.
    pub(super) fn set(&mut self, l: usize, start: &[f64], own: &[f64], time: f64, bound: f64) {
        start.iter().enumerate().for_each(|(i, x)| self.x[i * self.count + l] = *x);
        own.iter().enumerate().for_each(|(k, p)| self.own[k * self.count + l] = *p);
        (self.time[l], self.bound[l]) = (time, bound);
        (self.tried[l], self.steps[l], self.look[l]) = (0.0, 0.0, stiff::FIRST_LOOK);
        (self.most[l], self.second[l]) = (pace::MOST, pace::second(0.0));
    }

    /// Leaves lane `l` without a trajectory; its state is kept.
    pub(super) fn clear(&mut self, l: usize) {
        (self.h[l], self.bound[l]) = (0.0, 0.0);
    }

    /// Tries a step in every lane: stages 2 to 7, error, acceptance, and length of the next step.
    pub(super) fn advance(
        &mut self,
        field: &dyn VectorField,
        parameters: &[f64],
        tolerance: &Tolerance,
        limits: &Limits,
    ) {
        pulp::Arch::new().dispatch(Advance { lanes: self, field, parameters, tolerance, limits });
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

    /// Computes the states of a stage from N slopes, with row `row` of the tableau.
    #[inline(always)]
    fn stage<const N: usize>(&mut self, row: usize) {
        let count = self.count;
        let mut a = [0.0; N];
        a.copy_from_slice(A[row]);
        let target = if N + 1 == STAGES { &mut self.next } else { &mut self.stage };
        for (i, (to, x)) in target.chunks_exact_mut(count).zip(self.x.chunks_exact(count)).enumerate() {
            let mut k: [&[f64]; N] = [&[]; N];
            for j in 0..N {
                k[j] = &self.slopes[j][i * count..][..count];
            }
            combine(to, x, &self.h, a, k);
        }
    }

    /// Evaluates f at stage k + 1 into slope k.
    #[inline(always)]
    fn evaluate(&mut self, field: &dyn VectorField, shared: &[f64], k: usize) {
        let states = if k + 1 == STAGES { &self.next } else { &self.stage };
        let at =
            Batch { lanes: self.count, states, parameters: shared_or_own(shared, &self.own), times: &[], signs: &[] };
        match self.signs.is_empty() {
            true => field.evaluate(at, &mut self.slopes[k]),
            false => field.evaluate(Batch { signs: &self.signs, ..at }, &mut self.slopes[k]),
        }
    }

    /// (2) of the tableau in units of the tolerance, and the largest component.
    #[inline(always)]
    fn errors(&mut self, tolerance: &Tolerance) {
        let count = self.count;
        self.error.fill(0.0);
        self.largest.fill(0.0);
        for i in 0..self.n {
            let ends = [&self.x[i * count..], &self.next[i * count..]];
            let mut k: [&[f64]; STAGES] = [&[]; STAGES];
            for j in 0..STAGES {
                k[j] = &self.slopes[j][i * count..];
            }
            let tolerance = [tolerance.absolute[i], tolerance.relative];
            add_errors(&mut self.error, &mut self.largest, &self.h, ends, k, tolerance);
        }
        let mean = 1.0 / self.n as f64;
        self.error.iter_mut().for_each(|error| *error = (*error * mean).sqrt());
    }

    /// Moves the lanes with accepted steps to the ends of these; the others stay. Returns true if any trajectory may
    /// have ended.
    pub(super) fn take_over(&mut self, limits: &Limits) -> bool {
        std::mem::swap(&mut self.x, &mut self.next);
        let [first, .., last] = &mut self.slopes;
        std::mem::swap(first, last);
        std::mem::swap(&mut self.switches, &mut self.ahead[PLACES.len() - 1]);
        for first in (0..self.count).step_by(8) {
            // Usually all eight continue.
            if self.accepted[first..].first_chunk().is_some_and(|eight| *eight == [1.0; 8]) {
                continue;
            }
            for l in (first..self.count.min(first + 8)).filter(|&l| self.accepted[l] == 0.0) {
                for at in (l..self.x.len()).step_by(self.count) {
                    self.x[at] = self.next[at];
                    self.slopes[0][at] = self.slopes[STAGES - 1][at];
                }
                let back = &self.ahead[PLACES.len() - 1];
                (l..back.len()).step_by(self.count).for_each(|at| self.switches[at] = back[at]);
            }
        }
        pulp::Arch::new().dispatch(GoOn { lanes: self, limits });
        // 1 or 0: combined as bits, which, unlike a floating-point sum, may be reordered.
        self.remarkable.iter().fold(0, |any, remarkable| any | remarkable.to_bits()) != 0
    }

    /// Removes all lanes but `kept`.
    pub(super) fn keep(&mut self, kept: &[usize]) {
        let scalars = [&mut self.time, &mut self.h, &mut self.most, &mut self.second, &mut self.bound];
        let scalars = scalars.into_iter().chain([&mut self.look, &mut self.tried, &mut self.steps]);
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
        [&mut self.next, &mut self.stage, &mut self.sampled].into_iter().for_each(|v| v.truncate(self.n * self.count));
        let scalars = [&mut self.end, &mut self.planned, &mut self.error, &mut self.accepted, &mut self.largest];
        scalars.into_iter().chain([&mut self.taken, &mut self.remarkable]).for_each(|v| v.truncate(self.count));
    }
}

/// x + h Σ a k. (A separate function, so that the compiler knows that `to` does not alias.)
#[inline(always)]
fn combine<const N: usize>(to: &mut [f64], x: &[f64], h: &[f64], a: [f64; N], mut k: [&[f64]; N]) {
    let count = to.len();
    let (x, h) = (&x[..count], &h[..count]);
    k.iter_mut().for_each(|k| *k = &k[..count]);
    for l in 0..count {
        let mut change = a[0] * k[0][l];
        for j in 1..N {
            change += a[j] * k[j][l];
        }
        to[l] = x[l] + h[l] * change;
    }
}

/// Adds the square of the error of one component between its values at both ends, in units of its tolerance (absolute,
/// relative).
#[inline(always)]
fn add_errors(
    error: &mut [f64],
    largest: &mut [f64],
    h: &[f64],
    ends: [&[f64]; 2],
    mut k: [&[f64]; STAGES],
    tolerance: [f64; 2],
) {
    let count = error.len();
    let (h, largest, ends) = (&h[..count], &mut largest[..count], [&ends[0][..count], &ends[1][..count]]);
    k.iter_mut().for_each(|k| *k = &k[..count]);
    for l in 0..count {
        let mut e = ERROR[0] * k[0][l];
        for j in 2..STAGES {
            e += ERROR[j] * k[j][l];
        }
        let size = ends[0][l].abs().max(ends[1][l].abs());
        let scaled = h[l] * e / (tolerance[0] + tolerance[1] * size);
        error[l] += scaled * scaled;
        // No `if`: conditionally keeping a number becomes a masked store, which is very slow on some processors.
        largest[l] = largest[l].max(size);
    }
}

/// One sweep, passed to the dispatcher of instruction sets.
struct Advance<'a, 'b> {
    lanes: &'a mut Lanes,
    field: &'b dyn VectorField,
    parameters: &'b [f64],
    tolerance: &'b Tolerance,
    limits: &'b Limits,
}

impl pulp::NullaryFnOnce for Advance<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Advance { lanes, field, parameters, tolerance, limits } = self;
        lanes.stages(field, parameters);
        lanes.errors(tolerance);
        let Lanes { error, bound, time, h, accepted, end, planned, most, second, .. } = lanes;
        pace::judge(limits, [error, bound, time, h], accepted, end, planned, most, second);
    }
}

/// End of a sweep, passed to the dispatcher of instruction sets.
struct GoOn<'a, 'b> {
    lanes: &'a mut Lanes,
    limits: &'b Limits,
}

impl pulp::NullaryFnOnce for GoOn<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Lanes { accepted, end, planned, largest, bound, look, time, h, taken, tried, steps, remarkable, .. } =
            self.lanes;
        taken.copy_from_slice(h);
        pace::go_on(self.limits, [accepted, end, planned, largest, bound, look], time, h, tried, steps, remarkable);
    }
}
