//! How sharp must the smoothed contact be?
//!
//! **Idea.** The motion to which the rotor settles is simulated with the piecewise law, every step ending where contact begins
//! or ends, and with the tanh law for several K. The difference between the two is the error that smoothing makes. It falls
//! with K, and the smallest K whose error is acceptable is found by bisection, each K tried by simulation.
//!
//! **Equations.** With r̂ the largest radius and T the period, of the piecewise law without and of the smoothed law with an
//! index K:
//!
//! 1. e(K) = max( |r̂_K - r̂|/r̂, |T_K - T|/T )
//!
//! Smoothing changes the force in a layer of width 1/K by an amount of order β/K, so e falls like (K₀/K)² where contact is
//! met at speed.
//!
//! **Source.** akay2024, where K = 150 for β = 10 and K = 90 for β = 6 are chosen by such a comparison.
//!
//! **Fails when** the motion settles by less than the accuracy asked for, or is no attractor of the smoothed rotor; the latter is
//! an error without bound.

use crate::{ContactLaw, Nondimensional, OverhungRotor};
use foldline::attractors::{Trial, stepped_sweep};
use foldline::contract::Verdict;
use foldline::diagram::Response;

/// Place of K and of the radius among parameters and ranges.
const SHARPNESS: usize = 6;
const RADIUS: usize = 4;
const SCALES: [f64; 4] = [1.0; 4];

/// The error of the tanh law at one K.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothingError {
    /// K.
    pub sharpness: f64,
    /// |r̂_K - r̂|/r̂; infinite where the rotor settles to something else.
    pub radius: f64,
    /// |T_K - T|/T, 0 for an equilibrium; infinite where the rotor settles to something else.
    pub period: f64,
}

impl SmoothingError {
    /// e of 1.
    pub fn largest(&self) -> f64 {
        self.radius.max(self.period)
    }
}

/// What the rotor with the piecewise law settles to from `start`, at constants whose K does not count.
pub fn exact_motion(constants: &Nondimensional, start: [f64; 4]) -> Option<Response> {
    settled(ContactLaw::Piecewise, constants, constants.sharpness, &start)
}

/// The error at every one of `sharpness`, for the motion `exact` of the piecewise law.
pub fn smoothing_errors(constants: &Nondimensional, exact: &Response, sharpness: &[f64]) -> Vec<SmoothingError> {
    sharpness.iter().map(|k| smoothing_error(constants, exact, *k)).collect()
}

fn smoothing_error(constants: &Nondimensional, exact: &Response, sharpness: f64) -> SmoothingError {
    let other = SmoothingError { sharpness, radius: f64::INFINITY, period: f64::INFINITY };
    let Some(found) = settled(ContactLaw::Tanh, constants, sharpness, &exact.state) else { return other };
    let named = |r: &Response| (r.motion, r.ratio, r.multiplicity);
    let (Some(a), Some(b)) = (exact.ranges.get(RADIUS), found.ranges.get(RADIUS)) else { return other };
    if named(&found) != named(exact) {
        return other;
    }
    let relative = |a: f64, b: f64| ((a - b) / a).abs();
    let period = exact.period.zip(found.period).map_or(0.0, |(a, b)| relative(a, b));
    SmoothingError { sharpness, radius: relative(a[1], b[1]), period }
}

/// The smallest K, to a hundredth, whose error is at most `acceptable` for all of `motions` of the piecewise law, and the
/// errors of the motion that needs it there; `None` where no K up to 10⁴ β serves.
pub fn smallest_sharpness(constants: &Nondimensional, motions: &[Response], acceptable: f64) -> Option<(f64, f64)> {
    let worst = |k: f64| motions.iter().map(|m| smoothing_error(constants, m, k).largest()).fold(0.0, f64::max);
    let most = 1e4 * constants.beta;
    let (mut low, mut high) = (0.0, constants.beta);
    let mut error = worst(high);
    while error > acceptable {
        if high > most {
            return None;
        }
        (low, high) = (high, 2.0 * high);
        error = worst(high);
    }
    while high - low > 0.01 * high {
        let middle = if low > 0.0 { (low * high).sqrt() } else { 0.5 * high };
        let there = worst(middle);
        if there <= acceptable { (high, error) = (middle, there) } else { low = middle }
    }
    Some((high, error))
}

fn settled(law: ContactLaw, constants: &Nondimensional, sharpness: f64, start: &[f64]) -> Option<Response> {
    let field = OverhungRotor { law };
    let trial = Trial { field: &field, scales: &SCALES, whirl: Some([0, 1]), jobs: 1 };
    let parameters = constants.parameters();
    stepped_sweep(&trial, &parameters, SHARPNESS, &[sharpness], start, &|_| Verdict::Continue).pop()
}
