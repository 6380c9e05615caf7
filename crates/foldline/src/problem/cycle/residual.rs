//! The residual of a cycle: equations (1) to (3) of [`super`], eight intervals at a time.

use super::CycleProblem;
use crate::linalg::lane::Lane;
use crate::linalg::panel;
use crate::problem::gauss::Scheme;

impl CycleProblem<'_> {
    /// What (3) takes from the point where the problem was anchored last, unless that is there already.
    pub(super) fn lay_phase(&mut self) {
        if !std::mem::take(&mut self.unphased) {
            return;
        }
        let (n, m) = (self.n, self.scheme.degree);
        self.phase.fill(0.0);
        if self.is_forced() {
            return;
        }
        let (mut length, mut offset) = (0.0, 0.0);
        let count = self.intervals();
        let nodes = panel::by_component(&self.anchored[..self.profile_size()], m + 1, n);
        let mut rises = vec![0.0; m * count];
        for c in 0..n {
            let own = &nodes[c * (m + 1) * count..(c + 1) * (m + 1) * count];
            panel::multiply(&self.scheme.derivative, own, count, &mut rises);
            let scale = 1.0 / (self.scale[c] * self.scale[c]);
            for i in 0..m {
                let weight = self.scheme.weights[i] * scale;
                for lane in 0..self.width {
                    for (t, j) in self.piece(lane).enumerate() {
                        let (rise, h) = (rises[i * count + j], self.h(j));
                        // With X̃' = rise / h.
                        length += weight * rise * rise / h;
                        offset += weight * own[(i + 1) * count + j] * rise;
                        self.phase[((t * m + i) * n + c) * self.width + lane] = scale * rise / h;
                    }
                }
            }
        }
        let norm = length.sqrt().max(f64::MIN_POSITIVE);
        self.phase.iter_mut().for_each(|p| *p /= norm);
        self.phase_offset = offset / norm;
    }

    /// Residuals of (1) and (2) at `u` into `r`, with the states gathered and f evaluated there; returns the sum of (3) without
    /// what belongs to the reference alone.
    pub(super) fn defects<T: Lane>(&self, u: &[f64], r: &mut [f64]) -> f64 {
        T::dispatch(Defects::<T> { problem: self, u, r, lane: std::marker::PhantomData })
    }
}

struct Defects<'a, 'b, T> {
    problem: &'a CycleProblem<'a>,
    u: &'a [f64],
    r: &'b mut [f64],
    lane: std::marker::PhantomData<T>,
}

impl<T: Lane> pulp::NullaryFnOnce for Defects<'_, '_, T> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        let Defects { problem, u, r, .. } = self;
        let CycleProblem { ref scheme, n, length, .. } = *problem;
        let (block, count) = ((scheme.degree + 1) * n, problem.intervals());
        let period = T::splat(u[problem.profile_size()]);
        let mut rows = vec![T::default(); block];
        let mut phase = T::default();
        for t in 0..length {
            let h = T::load(&problem.lengths[t * T::COUNT..]);
            for c in 0..n {
                phase = phase + h * of_component(problem, scheme, [t, c], h * period, &mut rows);
            }
            for lane in 0..T::COUNT {
                let j = lane * length + t;
                if j >= count {
                    continue;
                }
                let own = &mut r[j * block..(j + 1) * block];
                own.iter_mut().zip(&rows).for_each(|(to, row)| *to = row.lanes()[lane]);
                let next = if j + 1 == count { 0 } else { (j + 1) * block };
                own[..n].iter_mut().zip(&u[next..next + n]).for_each(|(to, x)| *to += x);
            }
        }
        phase.lanes().iter().sum()
    }
}

/// One component at one place of every lane: its rows of (1), that of (2) without x_{j+1}, and its part of (3) over h.
#[inline(always)]
fn of_component<T: Lane>(problem: &CycleProblem, scheme: &Scheme, [t, c]: [usize; 2], ht: T, rows: &mut [T]) -> T {
    let (n, m, lanes) = (problem.n, scheme.degree, problem.lanes());
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
