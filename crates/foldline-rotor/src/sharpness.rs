//! Sharpness required of the smoothed contact.
//!
//! **Idea.** The settled motion of the rotor is simulated with the piecewise law, where every step ends at the
//! beginning or end of contact, and with the tanh law for several K. The difference between the two is the smoothing
//! error. It falls with K, and the smallest K with an acceptable error is found by bisection, simulating each K.
//!
//! **Equations.** With r̂ the largest radius, T the period and c_k the lines of u + jv, without an index for the
//! piecewise law and with the index K for the smoothed law:
//!
//! 1. e(K) = max( |r̂_K - r̂|/r̂, |T_K - T|/T, max_k ||c_k|_K - |c_k|| / max_k |c_k| )
//! 2. log e ≈ log e₁ - p log K, by least squares
//!
//! Smoothing changes the force in a layer of width 1/K by an amount of order β/K, so p is 2 where contact is met at
//! nonzero speed. Amplitudes are compared because a motion settles with an arbitrary phase, on which the phases of its
//! lines depend.
//!
//! **Source.** akay2024, where K = 150 for β = 10 and K = 90 for β = 6 are chosen by such a comparison.
//!
//! **Fails when** the motion settles less accurately than requested, or is not an attractor of the smoothed rotor; the
//! error is then infinite.

use crate::{ContactLaw, Nondimensional, OverhungRotor};
use foldline::attractors::{Trial, stepped_sweep};
use foldline::contract::Verdict;
use foldline::diagram::Response;
use foldline::simulation::{Integrator, Passage, Tolerance};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Position of K and of the radius among parameters and ranges.
const SHARPNESS: usize = 6;
const RADIUS: usize = 4;
const SCALES: [f64; 4] = [1.0; 4];
/// Lines k = -ORDERS … ORDERS are compared; those of the motions considered fall below 1e-3 of the strongest within
/// this range.
const ORDERS: i64 = 12;
/// Samples per period. A kink in the acceleration leaves lines that fall like k⁻⁴, so the line aliased onto order k
/// by sampling has an order near 512 and is weaker than 1e-10.
const SAMPLES: usize = 512;

/// The error of the tanh law at one K.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothingError {
    /// K.
    pub sharpness: f64,
    /// |r̂_K - r̂|/r̂; infinite where the rotor settles to something else.
    pub radius: f64,
    /// |T_K - T|/T, 0 for an equilibrium; infinite where the rotor settles to something else.
    pub period: f64,
    /// max_k ||c_k|_K - |c_k|| / max_k |c_k|; infinite where the rotor settles to something else.
    pub lines: f64,
}

impl SmoothingError {
    /// e of equation 1.
    pub fn largest(&self) -> f64 {
        self.radius.max(self.period).max(self.lines)
    }
}

/// Settled motion of the rotor with the piecewise law from `start`, at constants whose K is ignored.
pub fn exact_motion(constants: &Nondimensional, start: [f64; 4]) -> Option<Response> {
    settled(ContactLaw::Piecewise, constants, constants.sharpness, &start)
}

/// Errors at each of `sharpness`, for the motion `exact` of the piecewise law.
pub fn smoothing_errors(constants: &Nondimensional, exact: &Response, sharpness: &[f64]) -> Vec<SmoothingError> {
    let exact = Exact::of(constants, exact);
    sharpness.iter().map(|k| exact.error(constants, *k)).collect()
}

/// A motion of the piecewise law, with the amplitudes of its lines.
struct Exact<'m> {
    motion: &'m Response,
    lines: Vec<f64>,
}

impl<'m> Exact<'m> {
    fn of(constants: &Nondimensional, motion: &'m Response) -> Exact<'m> {
        Exact { motion, lines: lines(ContactLaw::Piecewise, constants, motion) }
    }

    fn error(&self, constants: &Nondimensional, sharpness: f64) -> SmoothingError {
        let infinite = f64::INFINITY;
        let other = SmoothingError { sharpness, radius: infinite, period: infinite, lines: infinite };
        let exact = self.motion;
        let constants = Nondimensional { sharpness, ..*constants };
        let Some(found) = settled(ContactLaw::Tanh, &constants, sharpness, &exact.state) else { return other };
        let named = |r: &Response| (r.motion, r.ratio, r.multiplicity);
        let (Some(a), Some(b)) = (exact.ranges.get(RADIUS), found.ranges.get(RADIUS)) else { return other };
        if named(&found) != named(exact) {
            return other;
        }
        let relative = |a: f64, b: f64| ((a - b) / a).abs();
        let period = exact.period.zip(found.period).map_or(0.0, |(a, b)| relative(a, b));
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let smoothed = lines(ContactLaw::Tanh, &constants, &found);
        let apart = largest(&mut self.lines.iter().zip(&smoothed).map(|(a, b)| (a - b).abs()));
        let lines = apart / largest(&mut self.lines.iter().copied()).max(f64::MIN_POSITIVE);
        SmoothingError { sharpness, radius: relative(a[1], b[1]), period, lines }
    }
}

/// |c_k|, k = -ORDERS … ORDERS, of a settled motion: one more period from its last state, sampled uniformly.
fn lines(law: ContactLaw, constants: &Nondimensional, motion: &Response) -> Vec<f64> {
    let Some(period) = motion.period else { return vec![motion.state[0].hypot(motion.state[1])] };
    let (field, parameters) = (OverhungRotor { law }, constants.parameters());
    let time = |k: usize| k as f64 / SAMPLES as f64;
    let (mut z, mut x) = (Vec::with_capacity(SAMPLES), [0.0; 4]);
    let integrator =
        Integrator::new(&field, &parameters, Tolerance::uniform(1e-10, 4)).with_longest_step(period / 64.0);
    integrator.trajectory(&motion.state, [0.0, period], &[], &mut |passage| {
        let Passage::Step(step) = passage else { return Verdict::Continue };
        let [from, to] = [step.start_time(), step.end_time()];
        while z.len() < SAMPLES && time(z.len()) * period <= to {
            step.state_into((time(z.len()) * period - from) / (to - from), &mut x);
            z.push(Complex64::new(x[0], x[1]));
        }
        Verdict::Continue
    });
    let line = |k: i64| {
        let turned = |(s, z): (usize, &Complex64)| z * Complex64::from_polar(1.0, -TAU * k as f64 * time(s));
        z.iter().enumerate().map(turned).sum::<Complex64>().norm() / SAMPLES as f64
    };
    (-ORDERS..=ORDERS).map(line).collect()
}

/// Fits equation 2: the power p, and e₁, the error at K = 1, from the errors that are finite and above `floor`, the
/// accuracy of the motions; `None` for fewer than two.
pub fn fitted_power(errors: &[SmoothingError], floor: f64) -> Option<(f64, f64)> {
    let known = errors.iter().map(|e| [e.sharpness, e.largest()]);
    let logs: Vec<[f64; 2]> =
        known.filter(|[_, e]| e.is_finite() && *e > floor).map(|pair| pair.map(f64::ln)).collect();
    let count = logs.len() as f64;
    let [x, y] = [0, 1].map(|i| logs.iter().map(|pair| pair[i]).sum::<f64>() / count);
    let spread: f64 = logs.iter().map(|pair| (pair[0] - x).powi(2)).sum();
    let slope = logs.iter().map(|pair| (pair[0] - x) * (pair[1] - y)).sum::<f64>() / spread;
    (logs.len() >= 2 && spread > 0.0).then(|| (-slope, (y - slope * x).exp()))
}

/// Smallest K, to a hundredth, whose error is at most `acceptable` for all of `motions` of the piecewise law, and the
/// errors of the motion that requires it; `None` if no K up to 10⁴ β is sufficient.
pub fn smallest_sharpness(constants: &Nondimensional, motions: &[Response], acceptable: f64) -> Option<(f64, f64)> {
    let motions: Vec<Exact> = motions.iter().map(|motion| Exact::of(constants, motion)).collect();
    let worst = |k: f64| motions.iter().map(|m| m.error(constants, k).largest()).fold(0.0, f64::max);
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
    let trial = Trial {
        field: &field,
        scales: &SCALES,
        whirl: Some([0, 1]),
        jobs: 1,
        limits: foldline::attractors::Limits::patient(),
    };
    let parameters = constants.parameters();
    stepped_sweep(&trial, &parameters, SHARPNESS, &[sharpness], start, &mut |_, _| None, &|_| Verdict::Continue).pop()
}
