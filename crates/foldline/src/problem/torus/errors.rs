//! Error estimates of a torus, and meshes in time and phase that meet a tolerance.
//!
//! **Idea.** In time the defect of every segment is measured as for a cycle, and its effect on the torus follows from the
//! joined system. In the phase the truncated Fourier series shows its error by its last terms, as long as they decay. They act on the torus
//! like a defect of the closure, so that their effect too follows from the joined system: it is large where ρ is close to a ratio of small
//! numbers.
//!
//! **Source.** enright2000 (defect); trefethen2000, §4 (decay of the coefficients).

use super::TorusProblem;
use super::phases;
use crate::contract::ZeroProblem;
use crate::diagram::Mesh;
use crate::linalg::{larger, same};
use crate::problem::cycle::SAFE;
use crate::problem::mesh;
use num_complex::Complex64;

/// Largest number of harmonics in the phase: 201 trajectories.
pub const LARGEST: usize = 100;
/// Smallest number of harmonics.
const SMALLEST: usize = 5;
/// Error of a new mesh, in tolerances: so small that the mesh serves for the next points too.
const TARGET: f64 = 0.1;
/// Smallest density of the next mesh in time, as a share of that of the current one.
const KEPT: f64 = 0.6;
/// Allowance for rounding.
const ROUNDING: f64 = 5e-11;

/// Error estimates and the unknowns to which they belong.
pub(super) struct Measured {
    at: Vec<f64>,
    /// `[N]`: errors on the intervals, over all segments.
    time: Vec<f64>,
    /// First-order change of the unknowns by the errors in time and in the phase.
    shift: Vec<f64>,
    /// `[harmonics + 1]`: largest modulus of this or a higher harmonic, relative to the scales.
    envelope: Vec<f64>,
    /// Effect of the last harmonics on the torus, relative to their size; at least 1.
    gain: f64,
}

/// A larger odd number of phases, within the limit.
pub(super) fn more_phases(count: usize) -> usize {
    2 * (3 * (count / 2)).div_ceil(2).min(LARGEST) + 1
}

impl Measured {
    /// Error by truncation: the effect of the last two harmonics.
    fn tail(&self) -> f64 {
        let last = self.envelope.len() - 1;
        self.gain * self.envelope[last.saturating_sub(1)]
    }

    /// Number of harmonics at which the error by truncation would be `target`.
    fn needed(&self, target: f64) -> usize {
        let (last, target) = (self.envelope.len() - 1, target / self.gain);
        if let Some(enough) = self.envelope.iter().position(|e| *e <= target) {
            return enough + 2;
        }
        // The decay over the second half goes on.
        let (from, to) = (self.envelope[last / 2], self.envelope[last]);
        let rate = (from / to).ln() / (last - last / 2).max(1) as f64;
        let more = (to / target).ln() / rate;
        if more.is_finite() && more > 0.0 { last + 3 + more.ceil() as usize } else { 2 * last }
    }
}

/// Moduli of the harmonics 0 … (K - 1) / 2 of values `[K]`.
pub(crate) fn harmonics(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<Complex64> = values.map(Complex64::from).collect();
    let count = all.len();
    foldline_general::fourier(&mut all);
    all[..count / 2 + 1].iter().map(|z| 2.0 * z.norm() / count as f64).collect()
}

impl TorusProblem<'_> {
    fn measured_at<R>(&self, u: &[f64], read: impl Fn(&Measured) -> R) -> R {
        if let Some(known) = self.measured.borrow().as_ref().filter(|known| same(&known.at, u)) {
            return read(known);
        }
        let found = self.measure(u);
        let value = read(&found);
        self.measured.replace(Some(found));
        value
    }

    fn measure(&self, u: &[f64]) -> Measured {
        let (n, size, count) = (self.n, self.profile_size(), self.intervals());
        let scale = self.relative_scale(u);
        let (mut local, mut sizes) = (vec![0.0f64; count], vec![0.0f64; count]);
        let mut rhs = vec![0.0; u.len()];
        for (k, segment) in self.segments.iter().enumerate() {
            let (found, sources) = segment.segment_defect(&self.of_segment(u, k), &scale);
            self.put(&sources, k, &mut rhs);
            local.iter_mut().zip(&found.local).for_each(|(most, e)| *most = larger(*most, *e));
            for (most, miss) in sizes.iter_mut().zip(found.misses.chunks_exact(n)) {
                *most = miss.iter().zip(&scale).map(|(e, s)| (e / s).abs()).fold(*most, larger);
            }
        }
        let mut shift = vec![0.0; u.len()];
        self.solve_joined(&rhs, &mut shift);
        let response = self.relative_size(&shift, u);
        let largest = sizes.iter().fold(f64::MIN_POSITIVE, |m: f64, s| m.max(*s));
        let gain = if response.is_finite() { response / largest } else { 1.0 };
        let time = local.iter().zip(&sizes).map(|(l, s)| l + gain * s).collect();
        let mut envelope = vec![0.0f64; self.phases / 2 + 1];
        let width = self.phases * n;
        for section in u[..size].chunks_exact(width).step_by(self.scheme.degree + 1) {
            for (c, scale) in scale.iter().enumerate() {
                let own = harmonics(section[c..].iter().step_by(n).copied());
                envelope.iter_mut().zip(own).for_each(|(most, e)| *most = larger(*most, e / scale));
            }
        }
        for j in (1..envelope.len()).rev() {
            envelope[j - 1] = larger(envelope[j - 1], envelope[j]);
        }
        let (gain, by_tail) = self.effect_of_tail(u, &scale);
        shift.iter_mut().zip(&by_tail).for_each(|(all, own)| *all += own);
        Measured { at: u.to_vec(), time, shift, envelope, gain }
    }

    /// Change of the torus by a defect of the closure that consists of the last two harmonics of the curve, and before it its
    /// largest value relative to that defect, at least 1.
    fn effect_of_tail(&self, u: &[f64], scale: &[f64]) -> (f64, Vec<f64>) {
        let (n, size, count) = (self.n, self.profile_size(), self.phases);
        let block = (self.scheme.degree + 1) * n;
        let last = (self.intervals() - 1) * block;
        let low = phases::passage(count, (count - 4).max(1));
        let back = phases::passage((count - 4).max(1), count);
        let apply = |matrix: &[f64], from: usize, values: &[f64]| -> Vec<f64> {
            matrix.chunks_exact(from).map(|row| row.iter().zip(values).map(|(w, x)| w * x).sum()).collect()
        };
        let (mut rhs, mut own) = (vec![0.0; u.len()], vec![vec![0.0; size / count]; count]);
        let mut most = 0.0;
        for c in 0..n {
            let values: Vec<f64> = u[c..count * n].iter().step_by(n).copied().collect();
            let smooth = apply(&back, (count - 4).max(1), &apply(&low, count, &values));
            for (own, (x, smooth)) in own.iter_mut().zip(values.iter().zip(&smooth)) {
                own[last + c] = x - smooth;
                most = larger(most, ((x - smooth) / scale[c]).abs());
            }
        }
        own.iter().enumerate().for_each(|(k, chain)| self.put(chain, k, &mut rhs));
        let mut shift = vec![0.0; u.len()];
        self.solve_joined(&rhs, &mut shift);
        let response = self.relative_size(&shift, u) / most;
        if response.is_finite() { (response.max(1.0), shift) } else { (1.0, vec![0.0; u.len()]) }
    }

    /// The stated error at `u`: four times the larger of the estimates in time and in the phase.
    pub(super) fn stated_error(&self, u: &[f64]) -> f64 {
        let most = |known: &Measured| known.time.iter().fold(known.tail(), |most, e| larger(most, *e));
        SAFE * self.measured_at(u, most) + ROUNDING
    }

    /// `u` without its estimated error, to first order.
    pub(super) fn corrected(&self, u: &[f64]) -> Vec<f64> {
        self.measured_at(u, |known| u.iter().zip(&known.shift).map(|(u, d)| u - d).collect())
    }

    /// See [`ZeroProblem::better_mesh`].
    pub(super) fn finer_for(&self, u: &[f64], tolerance: f64) -> Option<Mesh> {
        self.measured_at(u, |known| {
            let late = known.time.iter().any(|e| *e > tolerance);
            let rough = known.tail() > tolerance;
            let time = match late {
                true => mesh::equidistributed(
                    &known.time,
                    &self.time,
                    (self.scheme.degree, mesh::LARGEST),
                    TARGET * tolerance,
                    KEPT,
                )?,
                false => self.time.clone(),
            };
            let wanted = if rough { known.needed(TARGET * tolerance) } else { 0 };
            let harmonics = wanted.clamp(self.phases / 2, (self.phases).max(12)).min(LARGEST);
            let count = 2 * harmonics + 1;
            (late || count > self.phases).then(|| phases::joined(&time, count))
        })
    }

    /// See [`ZeroProblem::coarser_mesh`].
    pub(super) fn coarser_for(&self, u: &[f64], tolerance: f64) -> Option<Mesh> {
        self.measured_at(u, |known| {
            let (degree, target) = (self.scheme.degree, TARGET * tolerance);
            let fits = known.time.iter().all(|e| *e <= tolerance) && known.tail() <= tolerance;
            let enough = mesh::equidistributed(&known.time, &self.time, (degree, mesh::LARGEST), target, 0.0)
                .filter(|_| fits)?;
            let own = self.phases / 2;
            let needed = known.needed(target).max(SMALLEST).max(3 * own / 4);
            let [shorter, smoother] = [2 * enough.len() < self.time.len(), 5 * needed < 4 * own];
            let time = match shorter {
                true => mesh::equidistributed(&known.time, &self.time, (degree, mesh::LARGEST), target, KEPT)?,
                false => self.time.clone(),
            };
            let count = if smoother { 2 * needed + 1 } else { self.phases };
            (shorter || smoother).then(|| phases::joined(&time, count))
        })
    }
}
