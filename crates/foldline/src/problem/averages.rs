//! Means of states and outputs over a cycle.
//!
//! **Equations.** With the Gauss points t_i of all intervals and their weights b_i (`gauss`, eq. 3), scaled to one
//! period:
//!
//! ```text
//!   (1)  mean of g        = Σ b_i g(x(t_i))
//!   (2)  mean square of g = Σ b_i g(x(t_i))²
//! ```
//!
//! The error is of order 2m in the interval length, as that of the profile at the mesh points.

use super::gauss::Scheme;
use crate::contract::{Batch, Parameters, VectorField};

/// Averages at an equilibrium: value and square of every state and output.
pub fn of_state(field: &dyn VectorField, parameters: &[f64], x: &[f64]) -> Vec<[f64; 2]> {
    let mut outputs = vec![0.0; field.output_count()];
    field.outputs(
        Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times: &[], signs: &[] },
        &mut outputs,
    );
    x.iter().chain(&outputs).map(|&v| [v, v * v]).collect()
}

/// Averages over a periodic profile `[interval][node][component]` on a mesh, which lasts `forcing_periods` (0 for an
/// autonomous field).
pub fn of_profile(
    field: &dyn VectorField,
    parameters: &[f64],
    [profile, mesh]: [&[f64]; 2],
    forcing_periods: u32,
    scheme: &Scheme,
) -> Vec<[f64; 2]> {
    let (n, m) = (field.dim(), scheme.degree);
    let lanes = m * (mesh.len() - 1);
    let mut values = vec![0.0; (n + field.output_count()) * lanes];
    let (states, outputs) = values.split_at_mut(n * lanes);
    let (mut weights, mut times) = (Vec::with_capacity(lanes), Vec::new());
    for (j, (interval, ends)) in profile.chunks_exact((m + 1) * n).zip(mesh.windows(2)).enumerate() {
        let length = ends[1] - ends[0];
        for i in 0..m {
            // The first node of an interval is its left end.
            let state = &interval[(i + 1) * n..(i + 2) * n];
            (0..n).for_each(|c| states[c * lanes + j * m + i] = state[c]);
            weights.push(length * scheme.weights[i]);
            if forcing_periods > 0 {
                times.push(f64::from(forcing_periods) * (ends[0] + length * scheme.nodes[i + 1]));
            }
        }
    }
    let batch = Batch { lanes, states, parameters: Parameters::Shared(parameters), times: &times, signs: &[] };
    field.outputs(batch, outputs);
    let means = |line: &[f64]| {
        line.iter().zip(&weights).fold([0.0; 2], |[once, squared], (v, b)| [once + b * v, squared + b * (v * v)])
    };
    values.chunks_exact(lanes).map(means).collect()
}
