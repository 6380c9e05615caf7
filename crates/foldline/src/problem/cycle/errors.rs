//! How accurate a cycle is, from its defect and the last factorisation.

use super::CycleProblem;
use crate::contract::{Batch, Parameters, ZeroProblem};
use crate::problem::defect::{self, Defect};

/// Errors and the unknowns they belong to.
pub(super) struct Measured {
    at: Vec<f64>,
    errors: Vec<f64>,
}

impl CycleProblem<'_> {
    /// Estimated error on every interval, relative. A point that was just measured is not measured again: the last
    /// factorisation, which must belong to the current mesh, was close enough to it then.
    pub(super) fn errors(&self, u: &[f64]) -> Vec<f64> {
        if let Some(known) = self.measured.borrow().as_ref().filter(|known| known.at == u) {
            return known.errors.clone();
        }
        let errors = self.measured_errors(u);
        self.measured.replace(Some(Measured { at: u.to_vec(), errors: errors.clone() }));
        errors
    }

    fn measured_errors(&self, u: &[f64]) -> Vec<f64> {
        let size = self.profile_size();
        let scale = self.relative_scale(u);
        let parameters = self.setting.at(&u[size + 1..]);
        let Defect { local, ends, sources, misses } = defect::measure(
            self.setting.field,
            &parameters,
            &u[..size],
            u[size],
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
        local.iter().zip(&sizes).map(|(l, s)| l + gain * s).collect()
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
        let batch = Batch { lanes: count, states: &states, parameters: Parameters::Shared(&parameters) };
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
