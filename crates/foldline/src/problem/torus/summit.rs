//! Largest values of functions on a torus.
//!
//! **Idea.** Local maxima of values on a grid in phase and time are improved by quadratic models of the function on ever
//! smaller neighbourhoods.

use crate::linalg::{larger, max_abs};

/// Reduction of the spacing from round to round.
const FINER: f64 = 4.0;
/// Largest number of steps, and the longest of them in spacings.
const STEPS: usize = 200;
const FARTHEST: f64 = 2.0;
/// Difference between neighbouring values, relative to the size of the function, at which a value counts as the largest: that of the
/// stated error of a torus by rounding.
const ROUNDING: f64 = 5e-11;

/// Number of local maxima of the grid that are improved: the highest of the grid may not be the highest hill.
const HILLS: usize = 6;

/// Local maximum of a grid: its place, its value, and the largest difference from a neighbour.
type Hill = (usize, f64, f64);

/// The highest local maxima of a sign times values `[time][fine]`, the highest first: `fine` phases over the whole
/// circle, and times from one end of the period to the other.
fn hills(line: &[f64], sign: f64, fine: usize) -> Vec<Hill> {
    let hill = |at: usize| {
        let (node, k) = (at / fine, at % fine);
        let beside = [node * fine + (k + 1) % fine, node * fine + (k + fine - 1) % fine];
        let in_time = [at.checked_sub(fine), Some(at + fine).filter(|next| *next < line.len())];
        let own = sign * line[at];
        let mut depth = 0.0;
        for other in beside.into_iter().chain(in_time.into_iter().flatten()) {
            if sign * line[other] > own {
                return None;
            }
            depth = larger(depth, own - sign * line[other]);
        }
        Some((at, own, depth))
    };
    let mut found: Vec<Hill> = (0..line.len()).filter_map(hill).collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    found.truncate(HILLS);
    found
}

/// Largest value of a sign times a function with the values `line` `[time][fine]` on a grid of phases, in turns, and of `times`
/// `[time · fine]`; `value` is the function with its sign.
///
/// A parabola through a local maximum of the grid and its neighbours rises above it by a quarter of the largest difference from them at most,
/// and a cone by half of it, in each of both directions. Hills that cannot become the highest are left out.
pub fn largest(
    line: &[f64],
    times: &[f64],
    sign: f64,
    [fine, spacing]: [f64; 2],
    value: &dyn Fn([f64; 2]) -> f64,
) -> f64 {
    let (count, size) = (fine as usize, max_abs(line));
    let mut best = f64::NAN;
    for (at, own, depth) in hills(line, sign, count) {
        if own + depth < best {
            continue;
        }
        let place = [(at % count) as f64 / fine, times[at]];
        best = best.max(climb(value, place, [1.0 / fine, spacing], size));
    }
    best
}

/// Largest value next to a place, phase in turns and time. `spacing` is that of the grid on which the place was found, `size` the largest
/// modulus of the function.
fn climb(value: &dyn Fn([f64; 2]) -> f64, mut place: [f64; 2], mut spacing: [f64; 2], size: f64) -> f64 {
    let mut best = value(place);
    for _ in 0..STEPS {
        let [h, k] = spacing;
        let at = |a: f64, b: f64| [place[0] + a * h, place[1] + b * k];
        let around = AROUND.map(|[a, b]| (value(at(a, b)), at(a, b)));
        let [right, left, up, down, both, neither, one, other] = around.map(|(found, _)| found);
        let mixed = 0.25 * (both + neither - one - other);
        let (gx, gy) = (0.5 * (right - left), 0.5 * (up - down));
        let (xx, yy) = (right - 2.0 * best + left, up - 2.0 * best + down);
        let det = xx * yy - mixed * mixed;
        let step = match det > 0.0 && xx < 0.0 {
            true => [(mixed * gy - yy * gx) / det, (mixed * gx - xx * gy) / det],
            false => [gx, gy].map(|g| if g == 0.0 { 0.0 } else { g.signum() }),
        };
        // A quantity that hardly depends on one of the frequencies has a ridge across the grid: the way along it is long.
        let longest = step[0].abs().max(step[1].abs());
        let [a, b] = step.map(|s| s * (FARTHEST / longest).min(1.0));
        let next = (value(at(a, b)), at(a, b));
        let level = around.iter().fold(0.0, |most: f64, (found, _)| most.max((found - best).abs()));
        // At a corner, such as the centre of a radius, a parabola misleads; the neighbours do not.
        let beside = around.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or(next);
        let (highest, far) = if beside.0 > next.0 { (beside, true) } else { (next, longest > FARTHEST) };
        let higher = highest.0 > best;
        if higher {
            (best, place) = highest;
        }
        if higher && far {
            continue;
        }
        if level <= ROUNDING * size {
            break;
        }
        spacing = spacing.map(|s| s / FINER);
    }
    best
}

/// Neighbours of a place, in spacings.
const AROUND: [[f64; 2]; 8] =
    [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]];

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Largest value of a function from a grid of 41 phases and 40 instants.
    fn found(value: &dyn Fn([f64; 2]) -> f64) -> f64 {
        let times: Vec<f64> = (0..41 * 41).map(|at| (at / 41) as f64 / 40.0).collect();
        let line: Vec<f64> = times.iter().enumerate().map(|(at, t)| value([(at % 41) as f64 / 41.0, *t])).collect();
        largest(&line, &times, 1.0, [41.0, 1.0 / 40.0], value)
    }

    #[test]
    fn smooth_maxima_ridges_and_corners_are_found_to_rounding() {
        let wave = |[x, t]: [f64; 2]| (TAU * (x - 0.3)).cos() + 0.5 * (TAU * (2.0 * t + x - 0.1)).cos();
        assert!((found(&wave) - 1.5).abs() < 1e-10);
        // A ridge across the grid whose height varies little along it.
        let ridge = |[x, t]: [f64; 2]| (TAU * (x - 3.0 * t)).cos() + 1e-3 * (TAU * (x - 0.2)).cos();
        assert!((found(&ridge) - 1.001).abs() < 1e-9, "{}", found(&ridge));
        // Minus a radius: a cone whose tip lies between the places of the grid.
        let cone = |[x, t]: [f64; 2]| -(TAU * (x - 0.234)).sin().hypot((TAU * (t - 0.567 + 0.3 * x)).sin());
        assert!(found(&cone).abs() < 1e-10, "{}", found(&cone));
    }
}
