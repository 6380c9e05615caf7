//! Conversion of trajectories to profiles of cycles, and of profiles to another polynomial degree.

use crate::diagram::{Cycle, Point, Solution};
use crate::problem::gauss::Scheme;
use crate::problem::mesh::largest;

/// Samples per integration step of a trajectory that becomes a profile.
pub(super) const PARTS: usize = 4;

/// Quantity that a first mesh distributes equally over its intervals.
#[derive(Clone, Copy, Debug)]
pub(super) enum Spread {
    /// The arclength. Layers get intervals in proportion to their extent; the end of a transient on a slow manifold
    /// gets few.
    Arclength,
    /// The steps of the integration, whose error control has resolved the ends of transients too.
    Steps,
}

/// Returns a trajectory over one period as a profile.
///
/// `gain` `[n]` is the gain of the angles over the period; empty if none turns.
pub(super) fn first_profile(
    scales: &[f64],
    gain: Vec<f64>,
    period: f64,
    times: &[f64],
    states: &[f64],
    spread: Spread,
) -> Cycle {
    /// Smallest motion of a state, as a share of its scale, that contributes to the arclength: below the accuracy of
    /// sampling, 1e-6, by a factor of safety of a hundred.
    const LEAST: f64 = 1e-8;
    let n = scales.len();
    let scheme = Scheme::new(4);
    // A cycle of many turns needs more intervals.
    let intervals = match spread {
        Spread::Arclength => (times.len() / 12).clamp(60, 1200),
        Spread::Steps => (times.len() / PARTS).clamp(60, largest(n, scheme.degree)),
    };
    let size: Vec<f64> =
        (0..n).map(|i| states.iter().skip(i).step_by(n).fold(LEAST * scales[i], |m: f64, v| m.max(v.abs()))).collect();
    // Arclength in scaled states, plus time, so that no interval becomes empty.
    let mut length = vec![0.0];
    for k in 1..times.len() {
        let moved: f64 = (0..n).map(|i| ((states[k * n + i] - states[(k - 1) * n + i]) / size[i]).powi(2)).sum();
        length.push(match spread {
            Spread::Arclength => length[k - 1] + moved.sqrt() + (times[k] - times[k - 1]) / period,
            Spread::Steps => k as f64,
        });
    }
    let total = length.last().copied().unwrap_or(1.0);
    let place = |grid: &[f64], values: &[f64], at: f64| -> f64 {
        let k = grid.partition_point(|g| *g <= at).clamp(1, grid.len().max(2) - 1);
        let share = (at - grid[k - 1]) / (grid[k] - grid[k - 1]).max(f64::MIN_POSITIVE);
        values[k - 1] + share * (values[k] - values[k - 1])
    };
    let mesh: Vec<f64> = (0..=intervals)
        .map(|j| match j {
            0 => 0.0,
            _ if j == intervals => 1.0,
            _ => (place(&length, times, total * j as f64 / intervals as f64) / period).clamp(0.0, 1.0),
        })
        .collect();
    // The ends of a trajectory over one period do not quite agree; the gap is distributed over the period.
    let count = times.len();
    let gained = |i: usize| gain.get(i).copied().unwrap_or(0.0);
    let gap: Vec<f64> = (0..n).map(|i| states[(count - 1) * n + i] - states[i] - gained(i)).collect();
    let mut profile = Vec::with_capacity(intervals * 5 * n);
    for pair in mesh.windows(2) {
        for c in &scheme.nodes {
            let t = pair[0] + (pair[1] - pair[0]) * c;
            for i in 0..n {
                let component: f64 = {
                    let k = times.partition_point(|g| *g <= t * period).clamp(1, count.max(2) - 1);
                    cubic(times, states, n, i, k, t * period)
                };
                let value = component - t * gap[i];
                // Rounding of a state that has decayed.
                profile.push(if value.abs() < f64::EPSILON * scales[i] { 0.0 } else { value });
            }
        }
    }
    Cycle {
        points: crate::problem::gauss::Points::Gauss,
        period,
        forcing_periods: 0,
        mesh: mesh.into(),
        degree: 4,
        profile,
        gain,
    }
}

/// Interpolates component i by the cubic through the four samples around interval k-1…k.
fn cubic(times: &[f64], states: &[f64], n: usize, i: usize, k: usize, t: f64) -> f64 {
    let first = (k.max(2) - 2).min(times.len().saturating_sub(4));
    let nodes: Vec<usize> = (first..times.len().min(first + 4)).collect();
    nodes
        .iter()
        .map(|&a| {
            let weight: f64 = nodes
                .iter()
                .filter(|&&b| b != a)
                .map(|&b| {
                    (t - times[b]) / (times[a] - times[b]).abs().max(f64::MIN_POSITIVE).copysign(times[a] - times[b])
                })
                .product();
            weight * states[a * n + i]
        })
        .sum()
}

/// Component i at time t of samples that begin at time 0.
pub(super) fn sampled(times: &[f64], states: &[f64], n: usize, i: usize, t: f64) -> f64 {
    let count = times.len();
    let k = times.partition_point(|g| *g <= t).clamp(1, count.max(2) - 1);
    cubic(times, states, n, i, k, t)
}

/// Returns the solution in polynomials of another degree, as a start for Newton's method.
pub(super) fn with_degree(mut point: Point, degree: usize) -> Point {
    if let Solution::Cycle(cycle) = &mut point.solution
        && cycle.degree != degree
        && cycle.degree > 0
    {
        let (old, new) = (cycle.scheme(), Scheme::at(degree, cycle.points));
        let n = cycle.dim();
        let mut profile = Vec::with_capacity(cycle.intervals() * (degree + 1) * n);
        for interval in cycle.profile.chunks_exact((cycle.degree + 1) * n) {
            for &c in &new.nodes {
                let weights = old.interpolation(c);
                profile.extend(
                    (0..n).map(|i| weights.iter().enumerate().map(|(k, w)| w * interval[k * n + i]).sum::<f64>()),
                );
            }
        }
        (cycle.degree, cycle.profile) = (degree, profile);
    }
    point
}
