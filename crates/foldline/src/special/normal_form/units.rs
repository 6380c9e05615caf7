//! Units of the states in which null vectors are compared.
//!
//! **Idea.** Whether two null vectors are nearly orthogonal, and how fast they turn along a curve, depends on the units
//! of the states. Units that suit a system balance the rows and columns of its Jacobian. Its entries vanish at
//! bifurcations, so that their largest values in a neighbourhood of the size of the states are balanced.
//!
//! **Equations.** With M_ij = max |∂f_i/∂x_j| over the neighbourhood, the units d satisfy, among states that act on each
//! other,
//!
//! ```text
//!   (1)  Σ_{j≠i} M_ij d_j / d_i = Σ_{j≠i} M_ji d_i / d_j
//! ```
//!
//! **Source.** james2014 (balancing).

use crate::contract::{Batch, Parameters, VectorField};
use crate::stability::blocks;

/// Largest number of states for which the neighbourhood is evaluated, at two points for each of them.
const MOST: usize = 64;
/// Distance of these points, in sizes of a state.
const REACH: f64 = 0.5;
/// Ratio of two units below which the states are left as they are: null vectors then lose two digits at most.
const COMPARABLE: f64 = 100.0;
/// Number of sweeps of (1), which converges by a factor in each; the units need not be exact.
const SWEEPS: usize = 40;

/// Units of the states `[n]` at an equilibrium, and the largest rate at which one of them changes with another in these
/// units; `sizes` `[n]` are those that the states have as far as is known, and are kept for states that act on no other
/// that acts on them.
pub fn units(field: &dyn VectorField, state: &[f64], parameters: &[f64], sizes: &[f64]) -> (Vec<f64>, f64) {
    let n = state.len();
    let mut units = sizes.to_vec();
    if n > MOST {
        return (units, 0.0);
    }
    let lanes = 2 * n + 1;
    let mut states = vec![0.0; n * lanes];
    for (i, own) in states.chunks_exact_mut(lanes).enumerate() {
        own.fill(state[i]);
        own[2 * i + 1] += REACH * sizes[i];
        own[2 * i + 2] -= REACH * sizes[i];
    }
    let (mut f, mut fx) = (vec![0.0; n * lanes], vec![0.0; n * n * lanes]);
    let batch = Batch { lanes, states: &states, parameters: Parameters::Shared(parameters), times: &[], signs: &[] };
    field.linearise(batch, &[], &mut f, &mut fx, &mut []);
    let largest = |own: &[f64]| own.iter().fold(0.0f64, |most, a| if a.is_finite() { most.max(a.abs()) } else { most });
    let m: Vec<f64> = fx.chunks_exact(lanes).map(largest).collect();
    for block in blocks(&m, n) {
        for _ in 0..SWEEPS {
            for &i in &block {
                let others = || block.iter().filter(|j| **j != i);
                let row: f64 = others().map(|j| m[i * n + j] * units[*j]).sum::<f64>() / units[i];
                let column: f64 = others().map(|j| m[j * n + i] / units[*j]).sum::<f64>() * units[i];
                let factor = (row / column).sqrt();
                if factor.is_normal() {
                    units[i] *= factor;
                }
            }
        }
    }
    let most = units.iter().fold(0.0f64, |most, unit| most.max(*unit));
    if units.iter().all(|unit| most < COMPARABLE * unit) {
        units.fill(1.0);
    }
    let rate = (0..n * n).map(|k| m[k] * units[k % n] / units[k / n]).fold(0.0, f64::max);
    (units, rate)
}
