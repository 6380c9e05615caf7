//! The residual of a cycle: equations (1) to (3) of [`super`], eight intervals at a time.

use super::CycleProblem;
use crate::linalg::lane::{Eight, Lane, intact};
use crate::problem::gauss::Scheme;
use std::marker::PhantomData;

impl CycleProblem<'_> {
    /// Computes the reference of (3) from the last anchor, unless this has been done.
    pub(super) fn lay_phase(&mut self) {
        if !std::mem::take(&mut self.unphased) {
            return;
        }
        if self.is_forced() {
            self.phase.fill(0.0);
            return;
        }
        let anchored = std::mem::take(&mut self.anchored);
        self.gather(&anchored);
        self.anchored = anchored;
        let [square, offset] = match self.width {
            1 => self.laid_phase::<f64>(),
            _ => self.laid_phase::<Eight>(),
        };
        let norm = square.sqrt().max(f64::MIN_POSITIVE);
        self.phase.iter_mut().for_each(|p| *p /= norm);
        self.phase_offset = offset / norm;
    }

    /// Computes X̃' for (3) from the gathered states. Returns its square norm and its product with those states.
    fn laid_phase<T: Lane>(&mut self) -> [f64; 2] {
        let (n, length, lanes) = (self.n, self.length, self.lanes());
        let CycleProblem { scheme, lengths, scale, ends, states, phase, .. } = self;
        T::dispatch(Phase::<T> { n, length, lanes, scheme, lengths, scale, ends, states, phase, lane: PhantomData })
    }

    /// Writes the residuals of (1) and (2) at `u` to `r`, from the gathered states and f at them. Returns the sum of
    /// (3) without the term that depends on the reference alone.
    pub(super) fn defects<T: Lane>(&self, u: &[f64], r: &mut [f64]) -> f64 {
        T::dispatch(Defects::<T> { problem: self, u, r, lane: PhantomData })
    }
}

struct Phase<'a, 'b, T> {
    n: usize,
    length: usize,
    lanes: usize,
    scheme: &'a Scheme,
    lengths: &'a [f64],
    scale: &'a [f64],
    ends: &'a [f64],
    states: &'a [f64],
    phase: &'b mut [f64],
    lane: PhantomData<T>,
}

impl<T: Lane> pulp::NullaryFnOnce for Phase<'_, '_, T> {
    type Output = [f64; 2];

    #[inline(always)]
    fn call(self) -> [f64; 2] {
        let Phase { n, length, lanes, scheme, lengths, scale, ends, states, phase, .. } = self;
        let (m, w) = (scheme.degree, T::COUNT);
        let (mut square, mut offset) = (T::default(), T::default());
        for t in 0..length {
            // Beyond the last interval the length is zero.
            let h = T::load(&lengths[t * w..]);
            let there = h.map(|h| if h > 0.0 { 1.0 } else { 0.0 });
            let inverse = h.map(|h| if h > 0.0 { 1.0 / h } else { 0.0 });
            for c in 0..n {
                let share = T::splat(1.0 / (scale[c] * scale[c]));
                let x = T::load(&ends[(c * length + t) * w..]);
                let own = &states[c * lanes + t * m * w..][..m * w];
                for (i, row) in scheme.derivative.chunks_exact(m + 1).enumerate() {
                    let mut rise = T::splat(row[0]) * x;
                    for k in 0..m {
                        rise = rise + T::splat(row[k + 1]) * T::load(&own[k * w..]);
                    }
                    // X̃' = rise / h.
                    let rise = there * rise;
                    let slope = share * rise * inverse;
                    let weight = T::splat(scheme.weights[i]);
                    square = square + weight * rise * slope;
                    offset = offset + weight * share * rise * T::load(&own[i * w..]);
                    phase[((t * m + i) * n + c) * w..][..w].copy_from_slice(slope.lanes());
                }
            }
        }
        [square, offset].map(|sum| sum.lanes().iter().sum())
    }
}

struct Defects<'a, 'b, T> {
    problem: &'a CycleProblem<'a>,
    u: &'a [f64],
    r: &'b mut [f64],
    lane: PhantomData<T>,
}

impl<T: Lane> pulp::NullaryFnOnce for Defects<'_, '_, T> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        // Common sizes as constants.
        match (self.problem.n, self.problem.scheme.degree) {
            (4, 4) if T::COUNT > 1 => self.taken(4, 4),
            (n, m) => self.taken(n, m),
        }
    }
}

impl<T: Lane> Defects<'_, '_, T> {
    #[inline(always)]
    fn taken(self, n: usize, m: usize) -> f64 {
        let Defects { problem, u, r, .. } = self;
        let length = problem.length;
        let (block, count) = ((m + 1) * n, problem.intervals());
        let period = T::splat(u[problem.profile_size()]);
        let mut rows = vec![T::default(); block];
        let mut phase = T::default();
        for t in 0..length {
            let h = T::load(&problem.lengths[t * T::COUNT..]);
            for c in 0..n {
                phase = phase + h * of_component(problem, [t, c], h * period, &mut rows, [n, m]);
            }
            for lane in 0..T::COUNT {
                let j = lane * length + t;
                if j >= count {
                    continue;
                }
                let own = &mut r[j * block..(j + 1) * block];
                for (to, row) in own.iter_mut().zip(&rows) {
                    intact::<T>();
                    *to = row.lanes()[lane];
                }
                let next = if j + 1 == count { 0 } else { (j + 1) * block };
                own[..n].iter_mut().zip(&u[next..next + n]).for_each(|(to, x)| *to += x);
                if j + 1 == count {
                    own.iter_mut().zip(&problem.gain).for_each(|(to, gain)| *to += gain);
                }
            }
        }
        phase.lanes().iter().sum()
    }
}

/// One component at one place of every lane: writes its rows of (1) and that of (2) without x_{j+1}; returns its part
/// of (3) over h.
#[inline(always)]
fn of_component<T: Lane>(problem: &CycleProblem, [t, c]: [usize; 2], ht: T, rows: &mut [T], [n, m]: [usize; 2]) -> T {
    let (scheme, lanes) = (&problem.scheme, problem.lanes());
    let at = |k: usize| (t * m + k) * T::COUNT;
    let x = T::load(&problem.ends[(c * problem.length + t) * T::COUNT..]);
    let mut end = T::default() - T::splat(scheme.end[0]) * x;
    let mut phase = T::default();
    for i in 0..m {
        let own = T::load(&problem.states[c * lanes + at(i)..]);
        rows[(i + 1) * n + c] = own - x;
        end = end - T::splat(scheme.end[i + 1]) * own;
        phase = phase + T::splat(scheme.weights[i]) * T::load(&problem.phase[at(i) * n + c * T::COUNT..]) * own;
    }
    rows[c] = end;
    for k in 0..m {
        let rate = ht * T::load(&problem.f[c * lanes + at(k)..]);
        for i in 0..m {
            let row = &mut rows[(i + 1) * n + c];
            *row = *row - T::splat(scheme.integration[i * m + k]) * rate;
        }
    }
    phase
}
