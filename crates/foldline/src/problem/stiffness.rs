//! Choice of the collocation points of a cycle.
//!
//! **Idea.** Gauss points are more accurate, but they do not damp modes that decay within an interval. On N intervals
//! such a mode decays to the fraction R(-z)^N over the period, with z = T μ / N, the rate of decay μ, and R as in
//! [`super::gauss`]; the exact fraction is e^{-T μ}. If z exceeds [`FAST`], Radau points are chosen, which damp every
//! mode that decays; unless a mode grows within an interval, which they would damp too. A cycle that needs a fine mesh
//! in any case, as spikes do, has a small z.
//!
//! **Equations.** With |R(-z)| ≈ e^{-2 m (m + 1) / z} for z ≫ m², the share left at Gauss points is
//!
//!   (1)  e^{-2 m (m + 1) N / z}
//!
//! **Source.** hairer1996, §§IV.3, IV.5.

use super::cycle::GROWTH;
use super::gauss::Points;
use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::Cycle;
use crate::linalg::dense::MANY;
use crate::stability::eigenvalues;

/// z beyond which modes are fast. Empirical: the longest intervals of adapted meshes decay a few times as much as the
/// average, so that at most 1e-11 of a mode is left there. The error estimate of multipliers at Gauss points inverts that.
const FAST: f64 = 10.0;

/// Collocation points that suit a cycle, at most approximately known, with the given parameters of the model.
pub fn suited(field: &dyn VectorField, scales: &[f64], parameters: &[f64], cycle: &Cycle) -> Points {
    let (n, intervals) = (field.dim(), cycle.intervals());
    let smooth = field.switch_count() == 0 && field.event_count() == 0 && !field.iterated();
    let closed = field.conditions() == [0, 0] && field.saddles(parameters).is_none();
    if !smooth || !closed || n >= MANY || intervals == 0 || cycle.degree < 2 || cycle.dim() != n {
        return cycle.points;
    }
    let block = (cycle.degree + 1) * n;
    let mut states = vec![0.0; n * intervals];
    for (j, x) in cycle.profile.chunks_exact(block).enumerate() {
        (0..n).for_each(|i| states[i * intervals + j] = x[i]);
    }
    let periods = f64::from(cycle.forcing_periods);
    let times: Vec<f64> =
        cycle.mesh[..intervals].iter().take(if periods > 0.0 { intervals } else { 0 }).map(|t| t * periods).collect();
    let batch = Batch {
        lanes: intervals,
        states: &states,
        parameters: Parameters::Shared(parameters),
        times: &times,
        signs: &[],
    };
    let (mut f, mut fx) = (vec![0.0; n * intervals], vec![0.0; n * n * intervals]);
    field.linearise(batch, &[], &mut f, &mut fx, &mut []);
    let period = if periods > 0.0 { periods } else { cycle.period };
    // Sums of absolute values in rows bound all eigenvalues.
    let row =
        |j: usize, i: usize| (0..n).map(|l| fx[(i * n + l) * intervals + j].abs() * scales[l] / scales[i]).sum::<f64>();
    let bound = |j: usize| (cycle.mesh[j + 1] - cycle.mesh[j]) * period * (0..n).map(|i| row(j, i)).fold(0.0, f64::max);
    if cycle.points == Points::Gauss && (0..intervals).map(bound).sum::<f64>() < FAST * intervals as f64 {
        return Points::Gauss;
    }
    let (mut decay, mut unresolved) = (0.0, false);
    for j in 0..intervals {
        let h = cycle.mesh[j + 1] - cycle.mesh[j];
        let jacobian: Vec<f64> = (0..n * n).map(|at| period * fx[at * intervals + j]).collect();
        let modes = eigenvalues(&jacobian, n, scales);
        decay += h * modes.iter().fold(0.0, |most: f64, z| most.max(-z.re));
        unresolved |= modes.iter().any(|z| z.re.is_nan() || h * z.re > GROWTH);
    }
    let z = decay / intervals as f64;
    match cycle.points {
        Points::Gauss if z > FAST && !unresolved => Points::Radau,
        Points::Radau if z < FAST || unresolved => Points::Gauss,
        points => points,
    }
}
