//! True errors of points.
//!
//! **Idea.** A point is recomputed with a thousandth of the tolerance in the hyperplane through it that is normal to
//! the branch, so that it does not move along the branch.

use crate::DEGREE;
use foldline::continuation::Settings;
use foldline::continuation::corrector::{Plane, settle};
use foldline::diagram::{Branch, Cost, Point, Solution};
use foldline::explore::System;
use foldline::explore::growth::problem_of;

/// Tolerance of the second computation, relative to the first.
const FINER: f64 = 1e-3;
/// Number of times in a period at which two cycles are compared.
const PLACES: usize = 400;

/// Number of mesh intervals from which on a point is not recomputed.
const MOST: usize = 800;

/// Stated and true error of a point.
#[derive(Clone, Debug)]
pub struct Honesty {
    /// Description of the point for the report.
    pub place: String,
    /// Stated relative error of the solution: discretisation error plus residual.
    pub stated: f64,
    /// Largest relative difference of profile, period and extrema.
    pub found: f64,
    /// Largest difference of a multiplier, relative to the larger of 1 and its modulus.
    pub multipliers: f64,
    /// Stated error of the multipliers.
    pub stated_multipliers: f64,
}

/// Recomputes up to `count` cycles of a branch. Returns their errors, and the number of cycles that did not converge.
pub fn sampled(system: &System, settings: &Settings, branch: &Branch, count: usize) -> (Vec<Honesty>, usize) {
    let fine = Settings { tolerance: FINER * settings.tolerance, ..settings.clone() };
    let all = branch.points.len();
    let chosen = (0..count.min(all)).map(|k| &branch.points[(2 * k + 1) * all / (2 * count.min(all))]);
    let mut failed = 0;
    let mut out = Vec::new();
    // Near an orbit of infinite period, a mesh for a thousandth of the tolerance would be too large.
    let reachable = |point: &&Point| match &point.solution {
        Solution::Cycle(cycle) => !point.tangent.is_empty() && cycle.intervals() < MOST,
        Solution::Equilibrium(_) | Solution::Torus(_) => false,
    };
    for point in chosen.filter(reachable) {
        let mut problem = problem_of(system, branch.free, DEGREE, point, false);
        let u = problem.unknowns_of(point);
        problem.anchor(&u);
        let plane = Plane { row: point.tangent.clone(), base: u.clone(), distance: 0.0 };
        match settle(&mut *problem, &fine, plane, u, 1.0, &mut Cost::default()) {
            Ok(better) => out.extend(compared(system, branch, point, &better.point)),
            Err(_) => failed += 1,
        }
    }
    (out, failed)
}

fn compared(system: &System, branch: &Branch, point: &Point, better: &Point) -> Option<Honesty> {
    let (Solution::Cycle(a), Solution::Cycle(b)) = (&point.solution, &better.solution) else { return None };
    let n = a.dim();
    let (x, y) = (a.uniform(PLACES), b.uniform(PLACES));
    let size = |i: usize| y.iter().skip(i).step_by(n).fold(system.scales[i], |most: f64, v| most.max(v.abs()));
    let sizes: Vec<f64> = (0..n).map(|i| size(i) + system.scales[i]).collect();
    let profile = x.iter().zip(&y).enumerate().fold(0.0f64, |most, (k, (a, b))| most.max((a - b).abs() / sizes[k % n]));
    let period = (a.period / b.period).ln().abs();
    // The stated error covers states and period only; outputs follow from them.
    let ranges = point
        .ranges
        .iter()
        .zip(&better.ranges)
        .take(n)
        .zip(&sizes)
        .fold(0.0f64, |most, ((a, b), size)| most.max((a[0] - b[0]).abs() / size).max((a[1] - b[1]).abs() / size));
    let found = profile.max(period).max(ranges);
    let value = point.parameters.get(branch.free).copied().unwrap_or(f64::NAN);
    Some(Honesty {
        place: format!(
            "{value:.6} (position {}, profile {profile:.1e}, period {period:.1e}, {} intervals, then {})",
            point.position,
            a.intervals(),
            b.intervals()
        ),
        stated: point.trust.discretisation + point.trust.residual,
        found,
        multipliers: spectrum_difference(point, better),
        stated_multipliers: point.trust.spectrum,
    })
}

/// Largest difference of a multiplier, each paired with the nearest one still unpaired, starting with the largest.
fn spectrum_difference(point: &Point, better: &Point) -> f64 {
    let mut left: Vec<_> = better.spectrum.clone();
    let mut most = 0.0f64;
    let mut own: Vec<_> = point.spectrum.clone();
    own.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    for z in own {
        let Some(nearest) = (0..left.len()).min_by(|a, b| (left[*a] - z).norm().total_cmp(&(left[*b] - z).norm()))
        else {
            continue;
        };
        let other = left.remove(nearest);
        most = most.max((z - other).norm() / z.norm().max(1.0));
    }
    most
}
