//! First tori: from a cycle at a torus point, from a cycle on which a forcing begins to act, and from a closed curve.
//!
//! **Equations.** With a cycle c of period T and a multiplier exp(iθ) whose direction is q, q(T) = exp(iθ) q(0):
//!
//! ```text
//!   (1)  x_k(t) = c(t) + ε Re(exp(2πi φ_k) q(t)),    ρ = θ / 2π
//! ```
//!
//! With an autonomous cycle c of period P, of which a forcing of period T is to act:
//!
//! ```text
//!   (2)  x_k(t) = c(φ_k P + t T),    ρ = T / P
//! ```
//!
//! **Source.** schilder2005, §4.

use super::phases;
use crate::contract::ZeroProblem;
use crate::diagram::{Cycle, Mesh, Torus};
use crate::problem::Setting;
use crate::problem::cycle::CycleProblem;
use crate::problem::gauss::Scheme;
use crate::problem::mesh;
use foldline_general::Mat;
use num_complex::Complex64;

/// Phases of a first torus.
const PHASES: usize = 21;

/// Transfers a profile `[N][m + 1][K][n]` to another mesh in time and phase.
pub fn transferred(profile: &[f64], n: usize, scheme: &Scheme, from: &Mesh, to: &Mesh) -> Vec<f64> {
    let (old, new) = (phases::count(from), phases::count(to));
    let moved = mesh::transferred(profile, old * n, scheme, &phases::in_time(from), &phases::in_time(to));
    if old == new {
        return moved;
    }
    let matrix = phases::passage(old, new);
    let nodes = moved.chunks_exact(old * n);
    let at = |node: &[f64], row: &[f64], c: usize| -> f64 {
        row.iter().zip(node[c..].iter().step_by(n)).map(|(w, x)| w * x).sum()
    };
    nodes
        .flat_map(|node| {
            let rows = matrix.chunks_exact(old);
            rows.flat_map(|row| (0..n).map(|c| at(node, row, c)).collect::<Vec<_>>()).collect::<Vec<_>>()
        })
        .collect()
}

/// A torus whose trajectories are those of `at(k / K, t)`.
fn laid(like: Torus, n: usize, count: usize, time: &Mesh, at: impl Fn(usize, usize, &mut [f64])) -> Torus {
    let nodes = (time.len() - 1) * (like.degree + 1);
    let mut profile = vec![0.0; nodes * count * n];
    for (place, x) in profile.chunks_exact_mut(n).enumerate() {
        at(place % count, place / count, x);
    }
    Torus { mesh: phases::joined(time, count), profile, ..like }
}

/// The torus whose trajectories have the states `at(k, t)` at the normalised time t, on a uniform mesh.
pub fn of_trajectories(
    like: Torus,
    n: usize,
    count: usize,
    intervals: usize,
    at: impl Fn(usize, f64, &mut [f64]),
) -> Torus {
    let (scheme, time, m) = (Scheme::of(like.degree), mesh::uniform(intervals), like.degree);
    laid(like, n, count, &time, |k, node, x| {
        let (j, i) = (node / (m + 1), node % (m + 1));
        at(k, time[j] + (time[j + 1] - time[j]) * scheme.nodes[i], x);
    })
}

/// The torus (1) of amplitude zero at a torus point of a cycle, and the profile of its direction; `None` if no such
/// multiplier is found.
pub fn at_torus_point(setting: Setting, cycle: &Cycle, multiplier: Complex64) -> Option<(Torus, Vec<f64>)> {
    let (n, m) = (cycle.dim(), cycle.degree);
    let (direction, angle) = rotating_direction(setting, cycle, multiplier)?;
    let turns = angle / std::f64::consts::TAU;
    let like = Torus {
        period: cycle.period,
        rotation: turns,
        forcing_periods: cycle.forcing_periods,
        mesh: Mesh::default(),
        degree: m,
        profile: Vec::new(),
    };
    let base =
        laid(like, n, PHASES, &cycle.mesh, |_, node, x| x.copy_from_slice(&cycle.profile[node * n..(node + 1) * n]));
    let around = laid(base.clone(), n, PHASES, &cycle.mesh, |k, node, x| {
        let turn = Complex64::cis(std::f64::consts::TAU * k as f64 / PHASES as f64);
        for (x, q) in x.iter_mut().zip(&direction[node * n..(node + 1) * n]) {
            *x = (turn * q).re;
        }
    });
    Some((base, around.profile))
}

/// The torus (2) of a cycle of period `cycle.period` for a forcing of period `period`, which does not act yet.
pub fn lifted(cycle: &Cycle, period: f64) -> Torus {
    let (n, m) = (cycle.dim(), cycle.degree);
    let scheme = Scheme::of(m);
    let rotation = period / cycle.period;
    let time = mesh::uniform(((cycle.intervals() as f64 * rotation.max(0.5)).ceil() as usize).clamp(10, 400));
    // As many phases as resolve the cycle, which are reduced later.
    let count = 2 * (2 * cycle.intervals()).clamp(PHASES / 2, 40) + 1;
    let like = Torus { period, rotation, forcing_periods: 1, mesh: Mesh::default(), degree: m, profile: Vec::new() };
    laid(like, n, count, &time, |k, node, x| {
        let (j, i) = (node / (m + 1), node % (m + 1));
        let t = time[j] + (time[j + 1] - time[j]) * scheme.nodes[i];
        x.copy_from_slice(&cycle.state(k as f64 / count as f64 + t * rotation));
    })
}

/// Direction q of (1), `[N][m + 1][n]`, for the multiplier nearest to the given one, and the angle θ of that multiplier.
fn rotating_direction(setting: Setting, cycle: &Cycle, multiplier: Complex64) -> Option<(Vec<Complex64>, f64)> {
    let (n, m, count) = (cycle.dim(), cycle.degree, cycle.intervals());
    let unknowns = setting.axes.iter().map(|axis| setting.parameters[axis.index] / axis.scale).collect::<Vec<_>>();
    let time = if cycle.forcing_periods > 0 { f64::from(cycle.forcing_periods) } else { cycle.period };
    let u = [&cycle.profile[..], &[time], &unknowns].concat();
    let mut problem = CycleProblem::like(setting, cycle);
    problem.anchor(&u);
    let (transitions, inner) = problem.transports_at(&u)?;
    let mut monodromy: Mat<f64> = Mat::from_fn(n, n, |i, c| f64::from(u8::from(i == c)));
    for own in transitions.chunks_exact(n * n) {
        let step = Mat::from_fn(n, n, |i, c| own[i * n + c]);
        monodromy = foldline_general::product(&step, &monodromy);
    }
    let (values, vectors) = foldline_general::eigenvectors(monodromy.as_ref())?;
    let off = |z: &Complex64| (z - multiplier).norm();
    let at = (0..n).min_by(|a, b| off(&values[*a]).total_cmp(&off(&values[*b])))?;
    let mut x: Vec<Complex64> = (0..n).map(|i| vectors[(i, at)]).collect();
    let carried = |matrix: &dyn Fn(usize, usize) -> f64, x: &[Complex64]| -> Vec<Complex64> {
        (0..n).map(|i| (0..n).map(|c| matrix(i, c) * x[c]).sum()).collect()
    };
    let mut all = Vec::with_capacity(count * (m + 1) * n);
    for j in 0..count {
        all.extend_from_slice(&x);
        for k in 0..m {
            all.extend(carried(&|i, c| inner[((k * n + i) * n + c) * count + j], &x));
        }
        x = carried(&|i, c| transitions[(j * n + i) * n + c], &x);
    }
    Some((all, values[at].arg()))
}
