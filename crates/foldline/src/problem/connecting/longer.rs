//! Longer pieces of a connecting orbit.
//!
//! **Idea.** Close to the equilibria an orbit nearly follows the flow projected onto their invariant subspaces, in which the other
//! directions cannot grow. What it adds is a first approximation for Newton's method.

use super::ConnectingField;
use crate::contract::VectorField;
use crate::diagram::Cycle;
use crate::problem::gauss::Scheme;

/// States at the nodes of a mesh, from a function of time.
pub fn sampled(mesh: &[f64], scheme: &Scheme, state: &dyn Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let nodes = mesh.windows(2).flat_map(|pair| scheme.nodes.iter().map(move |c| pair[0] + c * (pair[1] - pair[0])));
    nodes.flat_map(state).collect()
}

/// A path next to an equilibrium: times from its start, states in units of their sizes, and slopes.
struct Path {
    times: Vec<f64>,
    states: Vec<Vec<f64>>,
    slopes: Vec<Vec<f64>>,
}

impl Path {
    /// State at a time, by cubic interpolation.
    fn at(&self, t: f64) -> Vec<f64> {
        let last = self.times.len() - 2;
        let k = self.times.partition_point(|own| *own <= t).saturating_sub(1).min(last);
        let h = self.times[k + 1] - self.times[k];
        let s = (t - self.times[k]) / h;
        let (s2, s3) = (s * s, s * s * s);
        let weights = [2.0 * s3 - 3.0 * s2 + 1.0, h * (s3 - 2.0 * s2 + s), 3.0 * s2 - 2.0 * s3, h * (s3 - s2)];
        let [x0, v0, x1, v1] = [&self.states[k], &self.slopes[k], &self.states[k + 1], &self.slopes[k + 1]];
        (0..x0.len())
            .map(|c| weights[0] * x0[c] + weights[1] * v0[c] + weights[2] * x1[c] + weights[3] * v1[c])
            .collect()
    }
}

/// The path of the flow projected onto the unstable (`side` 1) or the stable subspace from `y` towards the equilibrium of an
/// end, until it is closer by the factor `share`.
fn approach(field: &ConnectingField, parameters: &[f64], end: usize, y: &[f64], share: f64) -> Option<Path> {
    const STEPS: usize = 20_000;
    /// Step in units of the fastest time constant, at which the Runge–Kutta method of fourth order is accurate enough.
    const STEP: f64 = 0.2;
    let side = if end == 0 { 1.0 } else { -1.0 };
    let split = field.split(end, parameters)?;
    let place = &parameters[field.place(end)];
    let slope = |y: &[f64]| -> Vec<f64> {
        let x: Vec<f64> = place.iter().enumerate().map(|(c, x)| x + field.scale(c) * y[c]).collect();
        split.part(&field.saddle(&x, parameters, &[]).f, side).iter().map(|f| -side * f).collect()
    };
    let fastest = split.a.chunks_exact(y.len()).map(|row| row.iter().map(|a| a.abs()).sum::<f64>());
    let h = STEP / fastest.fold(f64::MIN_POSITIVE, f64::max);
    let moved = |y: &[f64], k: &[f64], h: f64| -> Vec<f64> { y.iter().zip(k).map(|(y, k)| y + h * k).collect() };
    let start = split.part(y, side);
    let goal = share * split.size(&start);
    let mut path = Path { times: vec![0.0], slopes: vec![slope(&start)], states: vec![start] };
    for step in 1..STEPS {
        let (own, k1) = (path.states.last()?.clone(), path.slopes.last()?.clone());
        let k2 = slope(&moved(&own, &k1, 0.5 * h));
        let k3 = slope(&moved(&own, &k2, 0.5 * h));
        let k4 = slope(&moved(&own, &k3, h));
        let next: Vec<f64> =
            (0..own.len()).map(|c| own[c] + h / 6.0 * (k1[c] + 2.0 * k2[c] + 2.0 * k3[c] + k4[c])).collect();
        path.times.push(step as f64 * h);
        path.slopes.push(slope(&next));
        path.states.push(next);
        if split.size(path.states.last()?) <= goal {
            return Some(path);
        }
    }
    None
}

/// The orbit continued until its ends are closer to the equilibria by the factor `share`, or a little more.
pub(super) fn longer(
    field: &ConnectingField,
    cycle: &Cycle,
    parameters: &[f64],
    share: f64,
) -> Option<(Cycle, Vec<f64>)> {
    const PIECES: usize = 8;
    let n = field.dim();
    let ends = [cycle.state(0.0), cycle.end()];
    let ys = field.deviations([&ends[0], &ends[1]], parameters);
    let paths = [approach(field, parameters, 0, &ys[0], share)?, approach(field, parameters, 1, &ys[1], share)?];
    let times = [*paths[0].times.last()?, *paths[1].times.last()?];
    let length = cycle.period;
    let outer = |end: usize, t: f64| -> Vec<f64> {
        let y = paths[end].at(t.abs());
        let first = &paths[end].states[0];
        (0..n).map(|c| ends[end][c] + field.scale(c) * (y[c] - first[c])).collect()
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
