//! Location of the first sign change of a switch of a piecewise-smooth field within a step.
//!
//! **Idea.** A step is computed with the signs that the switches have at its start, so f is smooth along all of it. The
//! switches are sampled on the continuous solution. If a sample, or an extremum between two samples, has left the sign,
//! the zero is located on the trajectory itself and the step is repeated to end there. A trajectory that slides along a
//! surface leaves it where the branch of f on one side stops pushing towards it.
//!
//! **Source.** hairer1993, §II.6 (discontinuities located on the dense output).
//!
//! **Fails when** a switch changes sign and back several times within a quarter of a step.

use super::Step;
use super::root::{lowest, root};
use super::section::insert_extrema;
use super::shortened::Shortened;

/// Fractions of a step at which the switches are sampled, besides its start.
pub(super) const PLACES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// First zero: index of the switch, and fraction of the step.
#[derive(Clone, Copy)]
pub(super) struct Kink {
    pub(super) switch: usize,
    pub(super) theta: f64,
    /// Side on which a trajectory that slides along the surface of the switch leaves it; 0 for any other.
    pub(super) leaves: f64,
}

/// First zero of a switch along `step`. `samples(switch)` returns its values at the start, 0 if it has just changed
/// sign, and at [`PLACES`], each times its sign in this step.
pub(super) fn first(step: &Step, again: &mut Shortened, samples: impl Fn(usize) -> [f64; 5]) -> Option<Kink> {
    let count = step.signs.len() / step.lanes;
    let mut found: Option<Kink> = None;
    let mut earliest = |switch: usize, theta: Option<f64>, leaves: f64| {
        if let Some(theta) = theta.filter(|theta| found.as_ref().is_none_or(|known| *theta < known.theta)) {
            found = Some(Kink { switch, theta, leaves });
        }
    };
    for switch in 0..count {
        let sign = step.signs[switch * step.lanes + step.column];
        if sign == 0.0 {
            for side in [-1.0, 1.0] {
                earliest(switch, leaving(step, again, switch, side), side);
            }
            continue;
        }
        let values = samples(switch);
        if clear(&values) {
            continue;
        }
        let mut all = vec![0.0; count];
        let theta = zero(step, again, values, |again, x| {
            again.switches_into(x, &mut all);
            sign * all[switch]
        });
        earliest(switch, theta, 0.0);
    }
    found
}

/// Fraction of the step at which a trajectory stops being pushed to the surface along which it slides by the branch of
/// f on one side.
fn leaving(step: &Step, again: &mut Shortened, switch: usize, side: f64) -> Option<f64> {
    let forwards = step.length.signum();
    let push = |again: &mut Shortened, x: &[f64]| -side * forwards * again.normal_speed(x, switch, side);
    let mut x = vec![0.0; step.dim()];
    again.of(step);
    let mut values = [0.0; PLACES.len() + 1];
    for (value, theta) in values.iter_mut().zip(std::iter::once(0.0).chain(PLACES)) {
        step.state_into(theta, &mut x);
        *value = push(again, &x);
    }
    values[0] = values[0].max(0.0);
    if clear(&values) { None } else { zero(step, again, values, push) }
}

/// Samples for [`first`], from the sign of a switch in this step and its values at the start and at [`PLACES`].
pub(super) fn samples(sign: f64, value: impl Fn(usize) -> f64) -> [f64; PLACES.len() + 1] {
    let values: [f64; PLACES.len() + 1] = std::array::from_fn(|k| sign * value(k));
    // Rounding may leave a switch that has just changed sign on the wrong side of zero.
    std::array::from_fn(|k| if k == 0 { values[0].max(0.0) } else { values[k] })
}

/// True if a parabola through values like these stays away from zero.
fn clear(values: &[f64; 5]) -> bool {
    let [low, high] = values.iter().fold([f64::MAX, 0.0], |[low, high]: [f64; 2], v| [low.min(*v), high.max(*v)]);
    low > 0.5 * high
}

/// First zero along the step of a function that is given at the start and at [`PLACES`], and at any state.
fn zero(
    step: &Step,
    again: &mut Shortened,
    values: [f64; 5],
    mut at: impl FnMut(&mut Shortened, &[f64]) -> f64,
) -> Option<f64> {
    let mut x = vec![0.0; step.dim()];
    again.of(step);
    let mut value = |theta: f64, exactly: bool| {
        if exactly && theta < 1.0 {
            again.state_into(theta * step.length, &mut x);
        } else {
            step.state_into(theta, &mut x);
        }
        at(again, &x)
    };
    let mut samples: Vec<[f64; 2]> =
        std::iter::once(0.0).chain(PLACES).zip(values).map(|(theta, value)| [theta, value]).collect();
    insert_extrema(&mut samples, |theta| value(theta, false));
    for pair in samples.windows(2) {
        let ([mut a, ga], [b, gb]) = (pair[0], pair[1]);
        if gb >= 0.0 {
            continue;
        }
        if ga <= 0.0 {
            // The switch has just acquired its sign: the zero sought is the next one, behind the maximum in between, if
            // any.
            let (summit, depth) = lowest(|theta| -value(theta, false), [a, b]);
            if depth >= 0.0 {
                return Some(a);
            }
            a = summit;
        }
        let ends = [if a == 0.0 { ga } else { value(a, true) }, value(b, true)];
        // Ignore a sign change of the interpolant that the trajectory does not share: it is below the tolerance.
        if ends[1] >= 0.0 {
            continue;
        }
        return Some(if ends[0] <= 0.0 { a } else { root(|theta| value(theta, true), [a, b], ends, 1e-15) });
    }
    None
}
