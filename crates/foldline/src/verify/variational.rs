//! Variational equations as a vector field.
//!
//! **Equations.** In the time of one segment of a cycle, which lasts S:
//!
//! ```text
//!   (1)  x' = S f(x, p),   X' = S f_x X,   Y' = S (f_x Y + f_λ)          X(0) = I,  Y(0) = 0
//! ```
//!
//! If the field is forced, its time is the last state, with τ' = S.
//!
//! X and Y are the derivatives of the end with respect to the start and the free parameters λ.

use crate::contract::{Batch, Parameters, VectorField};
use crate::problem::Setting;

/// Field (1): states x `[n]`, X `[n × n]`, Y `[n × k]`, row-major, and τ if forced; the parameters are those of the
/// model and S.
pub(super) struct Variational<'a> {
    /// Vector field with its k free parameters.
    pub(super) setting: &'a Setting<'a>,
}

impl Variational<'_> {
    fn sizes(&self) -> [usize; 2] {
        [self.setting.field.dim(), self.setting.freedom()]
    }

    /// Errors accepted in the states, their derivatives and the clock.
    pub(super) fn absolute(&self, accuracy: f64) -> Vec<f64> {
        let ([n, k], scales) = (self.sizes(), self.setting.scales);
        let matrix = (0..n * n).map(|at| scales[at / n] / scales[at % n]);
        let by_free = (0..n * k).map(|at| scales[at / k.max(1)]);
        let clock = self.setting.field.forced().then_some(1.0);
        let absolute = scales.iter().copied().chain(matrix).chain(by_free).chain(clock);
        absolute.map(|s| s * accuracy).collect()
    }
}

impl VectorField for Variational<'_> {
    fn dim(&self) -> usize {
        let [n, k] = self.sizes();
        n * (1 + n + k) + usize::from(self.setting.field.forced())
    }

    fn parameter_count(&self) -> usize {
        self.setting.field.parameter_count() + 1
    }

    fn evaluate(&self, at: Batch, out: &mut [f64]) {
        let ([n, k], lanes) = (self.sizes(), at.lanes);
        let count = self.setting.field.parameter_count();
        let shared;
        let (parameters, lengths): (Parameters, &[f64]) = match at.parameters {
            Parameters::PerLane(all) => {
                (Parameters::PerLane(&all[..count * lanes]), &all[count * lanes..(count + 1) * lanes])
            }
            Parameters::Shared(all) => {
                shared = vec![all[count]; lanes];
                (Parameters::Shared(&all[..count]), &shared)
            }
        };
        let inner = Batch {
            lanes,
            states: &at.states[..n * lanes],
            parameters,
            times: &at.states[n * (1 + n + k) * lanes..],
            signs: at.signs,
        };
        let (mut fx, mut fp) = (vec![0.0; n * n * lanes], vec![0.0; n * k * lanes]);
        let (f, rest) = out.split_at_mut(n * lanes);
        self.setting.linearise(inner, f, &mut fx, &mut fp);
        for row in f.chunks_exact_mut(lanes) {
            row.iter_mut().zip(lengths).for_each(|(f, s)| *f *= s);
        }
        let (along, rest) = rest.split_at_mut(n * n * lanes);
        let (by, clock) = rest.split_at_mut(n * k * lanes);
        clock.iter_mut().zip(lengths).for_each(|(f, s)| *f = *s);
        by.copy_from_slice(&fp);
        along.fill(0.0);
        // X and Y are two blocks of columns, each row-major.
        for (block, width, first) in [(along, n, n), (by, k, n + n * n)] {
            for i in 0..n {
                for j in 0..n {
                    let slope = &fx[(i * n + j) * lanes..(i * n + j + 1) * lanes];
                    for c in 0..width {
                        let from = &at.states[(first + j * width + c) * lanes..(first + j * width + c + 1) * lanes];
                        let to = &mut block[(i * width + c) * lanes..(i * width + c + 1) * lanes];
                        (0..lanes).for_each(|l| to[l] += slope[l] * from[l]);
                    }
                }
            }
            for row in block.chunks_exact_mut(lanes) {
                row.iter_mut().zip(lengths).for_each(|(x, s)| *x *= s);
            }
        }
    }

    /// Not implemented: integration does not need it.
    fn linearise(&self, _at: Batch, _free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        [f, fx, fp].into_iter().for_each(|all| all.fill(f64::NAN));
    }

    /// Not implemented: integration does not need it.
    fn directional(&self, _at: Batch, _directions: &[&[f64]], out: &mut [f64]) {
        out.fill(f64::NAN);
    }
}
