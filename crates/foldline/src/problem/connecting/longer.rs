//! Longer pieces of a connecting orbit.
//!
//! **Idea.** Close to the equilibria an orbit nearly follows the flow projected onto their invariant subspaces, in which the other
//! directions cannot grow. What it adds is a first approximation for Newton's method.

use super::ConnectingField;
use crate::contract::VectorField;
use crate::diagram::Cycle;
use crate::linalg::dot;
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
    /// Step in units of the fastest time constant, at which the Runge–Kutta method of fourth order is accurate enough, also for the
    /// relative change of the distance where no eigenvalue sets the pace.
    const STEP: f64 = 0.2;
    let side = if end == 0 { 1.0 } else { -1.0 };
    let split = field.parts(end, parameters)?;
    let place = &parameters[field.place(end)];
    let slope = |y: &[f64]| -> Vec<f64> {
        let x: Vec<f64> = place.iter().enumerate().map(|(c, x)| x + field.scale(c) * y[c]).collect();
        split.part(&field.saddle(&x, parameters, &[]).f, side).iter().map(|f| -side * f).collect()
    };
    let within = super::splitting::product(&split.a, &split.projector(side), y.len());
    let fastest = within.chunks_exact(y.len()).map(|row| row.iter().map(|a| a.abs()).sum::<f64>());
    let fastest = fastest.fold(f64::MIN_POSITIVE, f64::max);
    let moved = |y: &[f64], k: &[f64], h: f64| -> Vec<f64> { y.iter().zip(k).map(|(y, k)| y + h * k).collect() };
    let start = split.part(y, side);
    let goal = share * split.size(&start);
    let mut path = Path { times: vec![0.0], slopes: vec![slope(&start)], states: vec![start] };
    for _ in 1..STEPS {
        let (own, k1) = (path.states.last()?.clone(), path.slopes.last()?.clone());
        let h = STEP / fastest.max(split.size(&k1) / split.size(&own));
        let k2 = slope(&moved(&own, &k1, 0.5 * h));
        let k3 = slope(&moved(&own, &k2, 0.5 * h));
        let k4 = slope(&moved(&own, &k3, h));
        let next: Vec<f64> =
            (0..own.len()).map(|c| own[c] + h / 6.0 * (k1[c] + 2.0 * k2[c] + 2.0 * k3[c] + k4[c])).collect();
        path.times.push(path.times.last()? + h);
        path.slopes.push(slope(&next));
        path.states.push(next);
        if split.size(path.states.last()?) <= goal {
            return Some(path);
        }
    }
    None
}

impl ConnectingField<'_> {
    /// Time in which the projected flow brings a deviation `y` `[n]` at an end closer to the equilibrium by the factor
    /// `share`, and the deviation there.
    pub fn approached(&self, end: usize, y: &[f64], parameters: &[f64], share: f64) -> Option<(f64, Vec<f64>)> {
        let path = approach(self, parameters, end, y, share)?;
        Some((*path.times.last()?, path.states.last()?.clone()))
    }

    /// Time, to first order, until a trajectory at `x` with the deviation `y` meets the plane at an end.
    pub fn time_to_plane(&self, end: usize, y: &[f64], x: &[f64], parameters: &[f64]) -> Option<f64> {
        let plane = &parameters[self.plane(end)];
        let f = self.saddle(x, parameters, &[]).f;
        let time = (self.sizes(parameters)[end] - dot(plane, y)) / dot(plane, &f);
        time.is_finite().then_some(time)
    }
}

/// The orbit cut where it is farther from the equilibria by the factors `shares`, but not so far that the flow there is another one.
fn shorter(field: &ConnectingField, cycle: &Cycle, parameters: &[f64], shares: [f64; 2]) -> Option<(Cycle, Vec<f64>)> {
    /// Largest distance of an end relative to that of the orbit.
    const FAR: f64 = 0.05;
    let n = field.dim();
    let splits = [field.parts(0, parameters)?, field.parts(1, parameters)?];
    let size = |end: usize, x: &[f64]| {
        let side = if end == 0 { 1.0 } else { -1.0 };
        splits[end].length(&field.deviations([x, x], parameters)[end], side)
    };
    let states: Vec<Vec<f64>> =
        cycle.mesh.iter().map(|t| if *t < 1.0 { cycle.state(*t) } else { cycle.end() }).collect();
    let goal = |end: usize| {
        let far = states.iter().map(|x| size(end, x)).fold(0.0, f64::max);
        if shares[end] > 1.0 { (shares[end] * field.sizes(parameters)[end]).min(FAR * far) } else { 0.0 }
    };
    let (goals, last) = ([goal(0), goal(1)], states.len() - 1);
    let from = (0..last).find(|k| size(0, &states[*k]) >= goals[0])?;
    let to = (from..=last).rev().find(|k| size(1, &states[*k]) >= goals[1])?;
    if to < from + 2 || (from, to) == (0, last) {
        return None;
    }
    let block = (cycle.degree + 1) * n;
    let (begin, end) = (cycle.mesh[from], cycle.mesh[to]);
    let length = (end - begin) * cycle.period;
    let mut mesh: Vec<f64> = cycle.mesh[from..=to].iter().map(|t| (t - begin) / (end - begin)).collect();
    (mesh[0], mesh[to - from]) = (0.0, 1.0);
    let place = &parameters[field.place(0).start..field.place(1).end];
    let sizes = [size(0, &states[from]), size(1, &states[to])];
    let moved = field.parameters(parameters, length, place, sizes, &field.gain(parameters));
    let profile = cycle.profile[from * block..to * block].to_vec();
    Some((Cycle { period: length, mesh: mesh.into(), profile, ..cycle.clone() }, moved))
}

/// The orbit with its ends moved by the factor `share` where the error is of second order; see [`VectorField::lengthened`].
pub(super) fn resized(
    field: &ConnectingField,
    cycle: &Cycle,
    parameters: &[f64],
    share: f64,
) -> Option<(Cycle, Vec<f64>)> {
    // Without conditions at an end, its distance causes no error. Elsewhere it is of second order, or of fifth where (7) holds.
    let rows = field.row_ranges();
    let shares = [0, 1].map(|end| match field.will_be_slow(end, parameters) {
        _ if rows[end].is_empty() => 1.0,
        true => share.powf(0.4),
        false => share.min(1.0),
    });
    if share > 1.0 {
        return shorter(field, cycle, parameters, shares);
    }
    longer(field, cycle, parameters, shares)
}

/// The orbit continued until its ends are closer to the equilibria by the factors `shares`, or a little more.
pub fn longer(
    field: &ConnectingField,
    cycle: &Cycle,
    parameters: &[f64],
    shares: [f64; 2],
) -> Option<(Cycle, Vec<f64>)> {
    const PIECES: usize = 8;
    let n = field.dim();
    let ends = [cycle.state(0.0), cycle.end()];
    let ys = field.deviations([&ends[0], &ends[1]], parameters);
    let path = |end: usize| match shares[end] < 1.0 {
        true => approach(field, parameters, end, &ys[end], shares[end]),
        false => Some(Path { times: vec![0.0], states: vec![ys[end].clone()], slopes: vec![vec![0.0; n]] }),
    };
    let paths = [path(0)?, path(1)?];
    let times = [*paths[0].times.last()?, *paths[1].times.last()?];
    let length = cycle.period;
    let outer = |end: usize, t: f64| -> Vec<f64> {
        let y = paths[end].at(t.abs());
        let first = &paths[end].states[0];
        (0..n).map(|c| ends[end][c] + field.scale(c) * (y[c] - first[c])).collect()
    };
    let scheme = Scheme::of(cycle.degree);
    let piece = |end: usize| -> Vec<f64> {
        let pieces = if times[end] > 0.0 { PIECES } else { 0 };
        let from = if end == 0 { 1.0 } else { 0.0 };
        (0..=pieces).map(|k| times[end] * (k as f64 / PIECES as f64 - from)).collect()
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
    let own = field.sizes(parameters);
    let sizes = [shares[0] * own[0], shares[1] * own[1]];
    let place = &parameters[field.place(0).start..field.place(1).end];
    let moved = field.parameters(parameters, total, place, sizes, &field.gain(parameters));
    let solution = Cycle { period: total, mesh: mesh.into(), profile, ..cycle.clone() };
    Some((solution, moved))
}
