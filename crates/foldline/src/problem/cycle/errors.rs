//! How accurate a cycle is, from its defect and the last factorisation.

use super::CycleProblem;
use crate::contract::{Batch, Parameters, ZeroProblem};
use crate::linalg::panel;
use crate::problem::defect::{self, Defect};
use num_complex::Complex64;

/// Stated error of multipliers over the estimated one.
const SPECTRUM_SAFE: f64 = 4.0;
/// What rounding adds.
const SPECTRUM_ROUNDING: f64 = 1e-9;

/// Each multiplier against the nearest of the other list that is left, the largest first: the largest difference, relative to
/// the larger of 1 and the modulus.
fn spectrum_difference(spectrum: &[Complex64], other: &[Complex64]) -> f64 {
    let mut own: Vec<Complex64> = spectrum.to_vec();
    own.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    let mut left = other.to_vec();
    let mut most = 0.0f64;
    for z in own {
        let distance = |w: &Complex64| (w - z).norm();
        let nearest = (0..left.len()).min_by(|a, b| distance(&left[*a]).total_cmp(&distance(&left[*b])));
        let Some(nearest) = nearest else { return f64::NAN };
        most = most.max(distance(&left.remove(nearest)) / z.norm().max(1.0));
    }
    most
}

/// Error of an interval that rounding alone may leave, relative.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Fills a line up with the last of its `count` values.
fn repeat_last(line: &mut [f64], count: usize) {
    let last = line[count - 1];
    line[count..].fill(last);
}

/// Errors and the unknowns they belong to.
pub(super) struct Measured {
    at: Vec<f64>,
    errors: Vec<f64>,
    /// What rounding alone may make of them.
    rounding: f64,
    /// The part of the error that goes on from interval to interval, in the layout of the unknowns.
    shift: Vec<f64>,
    /// The part within intervals, `[n][m + 1][N]` at the sample points.
    within: Vec<f64>,
}

impl CycleProblem<'_> {
    /// Estimated error on every interval, relative. A point that was just measured is not measured again: the last
    /// factorisation, which must belong to the current mesh, was close enough to it then.
    pub(super) fn errors(&self, u: &[f64]) -> Vec<f64> {
        if let Some(known) = self.measured.borrow().as_ref().filter(|known| known.at == u) {
            return known.errors.clone();
        }
        let measured = self.measured_errors(u);
        let errors = measured.errors.clone();
        self.measured.replace(Some(measured));
        errors
    }

    /// Error at `u` that finer meshes do not make smaller: next to a singular matrix the rounding of single intervals many times over.
    pub(super) fn rounding(&self, u: &[f64]) -> f64 {
        self.errors(u);
        self.measured.borrow().as_ref().map_or(0.0, |known| known.rounding)
    }

    /// Estimated error of the multipliers `spectrum` at `u`: they change by it where the transitions of all intervals are made more
    /// accurate, and again where the Jacobian is taken not along the profile but along the profile without its estimated error.
    /// The two can cancel; their sizes are added. Identities between multipliers see little of this error, which is large where the
    /// Jacobian changes sharply.
    pub(super) fn multiplier_error(&self, u: &[f64], spectrum: &[Complex64]) -> f64 {
        self.errors(u);
        let Some([own, better]) = self.corrected_multipliers(u) else { return f64::NAN };
        let apart = spectrum_difference(spectrum, &own) + spectrum_difference(&own, &better);
        SPECTRUM_SAFE * apart + SPECTRUM_ROUNDING
    }

    /// The multipliers from more accurate transitions, with the Jacobian along the profile, and along the profile without its error.
    fn corrected_multipliers(&self, u: &[f64]) -> Option<[Vec<Complex64>; 2]> {
        let (n, m, count, size) = (self.n, self.scheme.degree, self.intervals(), self.profile_size());
        let (square, lanes, padded) = (n * n, count * (m + 1), defect::padded(count));
        let known = self.measured.borrow();
        let known = known.as_ref()?;
        let times = self.sampling.times(&self.mesh, self.forcing_periods);
        let better: Vec<f64> = u.iter().zip(&known.shift).map(|(u, e)| u - e).collect();
        let courses = [(u, 0.0), (&better[..], 1.0)];
        let mut jacobians = vec![0.0; square * 2 * (m + 1) * padded];
        let (mut states, mut f, mut fx) = (known.within.clone(), vec![0.0; n * lanes], vec![0.0; square * lanes]);
        let mut values = vec![0.0; lanes];
        for (course, (u, share)) in courses.iter().enumerate() {
            let nodes = panel::by_component(&u[..size], m + 1, n);
            let without = states.chunks_exact_mut(lanes).zip(known.within.chunks_exact(lanes));
            for ((own, within), nodes) in without.zip(nodes.chunks_exact(lanes)) {
                self.sampling.sampled(nodes, count, &mut values);
                own.iter_mut().zip(&values).zip(within).for_each(|((own, x), w)| *own = x - share * w);
            }
            let parameters = self.setting.at(&u[size + 1..]);
            let batch = Batch { lanes, states: &states, parameters: Parameters::Shared(&parameters), times: &times };
            self.setting.field.linearise(batch, &[], &mut f, &mut fx, &mut []);
            let lengths: Vec<f64> = self.mesh.windows(2).map(|pair| (pair[1] - pair[0]) * u[size]).collect();
            for (k, from) in fx.chunks_exact(count).enumerate() {
                let (entry, g) = (k / (m + 1), k % (m + 1));
                let to = &mut jacobians[((entry * 2 + course) * (m + 1) + g) * padded..][..padded];
                to.iter_mut().zip(&lengths).zip(from).for_each(|((x, h), from)| *x = h * from);
                repeat_last(to, count);
            }
        }
        let (mut nodes, mut transitions) = (vec![0.0; (m + 1) * square * padded], vec![0.0; square * 2 * padded]);
        (0..n).for_each(|c| nodes[c * (n + 1) * padded..][..padded].fill(1.0));
        self.system.inner(padded, &mut nodes[square * padded..]);
        nodes[square * padded..].chunks_exact_mut(padded).for_each(|line| repeat_last(line, count));
        let mut own = vec![0.0; square];
        for j in 0..count {
            self.system.transition(j, &mut own);
            own.iter().enumerate().for_each(|(k, x)| (0..2).for_each(|c| transitions[(2 * k + c) * padded + j] = *x));
        }
        transitions.chunks_exact_mut(padded).for_each(|line| repeat_last(line, count));
        defect::correct(&self.sampling, &nodes, &jacobians, &mut transitions, n);
        let corrected = |course: usize, u: &[f64]| {
            let transition = |j: usize, to: &mut [f64]| {
                to.iter_mut().enumerate().for_each(|(k, x)| *x = transitions[(2 * k + course) * padded + j]);
            };
            self.floquet_with(u, transition).multipliers
        };
        let found = [corrected(0, u), corrected(1, &better)];
        found.iter().flatten().all(|z| z.re.is_finite() && z.im.is_finite()).then_some(found)
    }

    fn measured_errors(&self, u: &[f64]) -> Measured {
        let size = self.profile_size();
        let scale = self.relative_scale(u);
        let parameters = self.setting.at(&u[size + 1..]);
        let Defect { local, within, ends, sources, misses } = defect::measure(
            self.setting.field,
            &parameters,
            &u[..size],
            u[size],
            self.forcing_periods,
            &self.mesh,
            &self.scheme,
            &self.sampling,
            &scale,
        );
        let block = (self.scheme.degree + 1) * self.n;
        let mut rhs = vec![0.0; u.len()];
        let inner = self.scheme.degree * self.n;
        for (own, (end, source)) in
            rhs.chunks_exact_mut(block).zip(ends.chunks_exact(self.n).zip(sources.chunks_exact(inner)))
        {
            own[..self.n].copy_from_slice(end);
            own[self.n..].copy_from_slice(source);
        }
        let mut shift = vec![0.0; u.len()];
        self.system.solve(&rhs, &mut shift);
        let response = self.relative_size(&shift, u);
        let sizes: Vec<f64> = misses
            .chunks_exact(self.n)
            .map(|e| e.iter().zip(&scale).map(|(v, s)| (v / s).abs()).fold(0.0, f64::max))
            .collect();
        let largest = sizes.iter().fold(f64::MIN_POSITIVE, |m: f64, s| m.max(*s));
        let gain = if response.is_finite() { response / largest } else { 1.0 };
        let errors = local.iter().zip(&sizes).map(|(l, s)| l + gain * s).collect();
        Measured { at: u.to_vec(), errors, rounding: ROUNDING * gain, shift, within }
    }

    pub(super) fn flow_at_nodes(&self, u: &[f64]) -> Vec<f64> {
        let (n, count, block) = (self.n, self.intervals(), (self.scheme.degree + 1) * self.n);
        let mut states = vec![0.0; n * count];
        for j in 0..count {
            for i in 0..n {
                states[i * count + j] = u[j * block + i];
            }
        }
        let mut f = vec![0.0; n * count];
        let parameters = self.setting.at(&u[self.profile_size() + 1..]);
        let batch = Batch { lanes: count, states: &states, parameters: Parameters::Shared(&parameters), times: &[] };
        self.setting.field.evaluate(batch, &mut f);
        let mut flow = vec![0.0; n * count];
        for j in 0..count {
            for i in 0..n {
                flow[j * n + i] = f[i * count + j] / self.scale[i];
            }
        }
        flow
    }
}
