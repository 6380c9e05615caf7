//! Longer pieces of a connecting orbit.
//!
//! **Idea.** Close to the equilibria an orbit nearly follows the linear flow in their invariant subspaces, which is known in closed
//! form. What it adds is a first approximation for Newton's method.

use super::ConnectingField;
use crate::contract::VectorField;
use crate::diagram::Cycle;
use crate::problem::gauss::Scheme;

/// States at the nodes of a mesh, from a function of time.
pub fn sampled(mesh: &[f64], scheme: &Scheme, state: &dyn Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let nodes = mesh.windows(2).flat_map(|pair| scheme.nodes.iter().map(move |c| pair[0] + c * (pair[1] - pair[0])));
    nodes.flat_map(state).collect()
}

/// The orbit continued by the linear flow until its ends are closer to the equilibria by the factor `share`.
pub(super) fn longer(
    field: &ConnectingField,
    cycle: &Cycle,
    parameters: &[f64],
    share: f64,
) -> Option<(Cycle, Vec<f64>)> {
    const PIECES: usize = 6;
    let n = field.dim();
    let ends = [cycle.state(0.0), cycle.end()];
    let ys = field.deviations([&ends[0], &ends[1]], parameters);
    let splits = [field.split(0, parameters)?, field.split(1, parameters)?];
    let times = [splits[0].time_to(&ys[0], 1.0, share)?, splits[1].time_to(&ys[1], -1.0, share)?];
    let length = cycle.period;
    let outer = |end: usize, t: f64| -> Vec<f64> {
        let side = if end == 0 { 1.0 } else { -1.0 };
        let y = splits[end].flow(&ys[end], side, t);
        let moved = ends[end].iter().zip(&ys[end]).zip(&y).enumerate();
        moved.map(|(c, ((x, y0), y))| x + field.scale(c) * (y - y0)).collect()
    };
    let scheme = Scheme::of(cycle.degree);
    let piece = |end: usize| -> Vec<f64> {
        (0..=PIECES).map(|k| times[end] * (k as f64 / PIECES as f64 - if end == 0 { 1.0 } else { 0.0 })).collect()
    };
    let [before, after] = [piece(0), piece(1)];
    let mut profile = sampled(&before, scheme, &|t| outer(0, t));
    profile.extend_from_slice(&cycle.profile);
    profile.extend(sampled(&after, scheme, &|t| outer(1, t)));
    let total = times[0] + length + times[1];
    let all = before
        .iter()
        .map(|t| t + times[0])
        .chain(cycle.mesh[1..].iter().map(|t| times[0] + t * length))
        .chain(after[1..].iter().map(|t| times[0] + length + t));
    let mut mesh: Vec<f64> = all.map(|t| t / total).collect();
    (mesh[0], mesh[profile.len() / (n * (cycle.degree + 1))]) = (0.0, 1.0);
    let sizes = field.sizes(parameters).map(|size| share * size);
    let place = &parameters[field.place(0).start..field.place(1).end];
    let moved = field.parameters(parameters, total, place, sizes, &field.gain(parameters));
    let solution = Cycle { period: total, mesh: mesh.into(), profile, ..cycle.clone() };
    Some((solution, moved))
}
