//! Acceptance of steps and their lengths: the first step, and the factor to the next one.
//!
//! **Source.** hairer1993, §II.4 (step control and first step); hairer1996, §IV.2 (the second factor of (1) of the
//! ensemble).
//!
//! **Departures.** The powers of (1) are computed to five digits, more than a step length needs, which takes only a few
//! vector instructions.

use super::{Ensemble, Outcome, shared_or_own};
use crate::contract::{Batch, Parameters};
use std::hint::select_unpredictable;

const SAFETY: f64 = 0.9;
const BETA: f64 = 0.04;
const ALPHA: f64 = 0.2 - 0.75 * BETA;
/// Limits of the factor.
pub(super) const LEAST: f64 = 0.2;
pub(super) const MOST: f64 = 10.0;
/// Smallest value used for the previous error, also before the first step.
const SMALLEST_BEFORE: f64 = 1e-4;

/// Limits on steps and trajectories, common to all lanes.
pub(in crate::simulation) struct Limits {
    /// End of the time span, and the sign of its direction.
    pub(in crate::simulation) end: f64,
    pub(in crate::simulation) sign: f64,
    /// Longest step.
    pub(in crate::simulation) longest: f64,
    /// Maximum number of steps, accepted and rejected.
    pub(in crate::simulation) steps: f64,
}

impl Limits {
    /// End of a step of length `h` from `time`.
    #[inline(always)]
    pub(super) fn end_of(&self, time: f64, h: f64) -> f64 {
        if (self.end - time - h) * self.sign <= 0.0 { self.end } else { time + h }
    }
}

/// Binary logarithm of the first power in (1) of the ensemble.
#[inline(always)]
fn first(error: f64) -> f64 {
    // Between these bounds the factor passes from one limit to the other.
    let error = if error > 1e-10 { error } else { 1e-10 };
    let error = if error < 1e10 { error } else { 1e10 };
    -ALPHA * log2(error)
}

/// Binary logarithm of the second power, after a step with that error.
#[inline(always)]
pub(super) fn second(error: f64) -> f64 {
    BETA * log2(if error > SMALLEST_BEFORE { error } else { SMALLEST_BEFORE })
}

/// Accepts or rejects the steps tried, and sets their ends and the lengths of the next ones. (Outputs are passed as
/// arguments here and below, so that the compiler knows that they do not alias.)
#[inline(always)]
pub(super) fn judge(
    limits: &Limits,
    [error, bound, time, h]: [&[f64]; 4],
    accepted: &mut [f64],
    end: &mut [f64],
    planned: &mut [f64],
    most: &mut [f64],
    before: &mut [f64],
) {
    let count = error.len();
    let (bound, time, h) = (&bound[..count], &time[..count], &h[..count]);
    let (accepted, end, planned) = (&mut accepted[..count], &mut end[..count], &mut planned[..count]);
    let (most, before) = (&mut most[..count], &mut before[..count]);
    for l in 0..count {
        let holds = (error[l] <= 1.0) & (bound[l] > 0.0);
        let factor = SAFETY * exp2(first(error[l]) + if holds { before[l] } else { 0.0 });
        let limit = if holds { most[l] } else { 1.0 };
        let factor = if factor < limit { factor } else { limit };
        // A NaN makes the step as short as permitted.
        let factor = if (factor > LEAST) & !error[l].is_nan() { factor } else { LEAST };
        let next = h[l] * factor;
        let next = if next < limits.longest { next } else { limits.longest };
        planned[l] = if next > -limits.longest { next } else { -limits.longest };
        accepted[l] = if holds { 1.0 } else { 0.0 };
        end[l] = limits.end_of(time[l], h[l]);
        // A sum, since keeping a value would be a masked store, as with the largest state in `add_errors`.
        let (fresh, kept) = (second(error[l]), before[l]);
        before[l] = select_unpredictable(holds, fresh, 0.0) + select_unpredictable(holds, 0.0, kept);
        most[l] = if holds { MOST } else { 1.0 };
    }
}

/// Counts the steps, moves to the ends of accepted ones, and sets the next lengths; marks trajectories that may have
/// ended or are due for a stiffness check.
#[inline(always)]
pub(super) fn go_on(
    limits: &Limits,
    [accepted, end, planned, largest, bound, look]: [&[f64]; 6],
    time: &mut [f64],
    h: &mut [f64],
    tried: &mut [f64],
    steps: &mut [f64],
    remarkable: &mut [f64],
) {
    let count = accepted.len();
    let (end, planned, largest, bound) = (&end[..count], &planned[..count], &largest[..count], &bound[..count]);
    let look = &look[..count];
    let (time, h, remarkable) = (&mut time[..count], &mut h[..count], &mut remarkable[..count]);
    let (tried, steps) = (&mut tried[..count], &mut steps[..count]);
    for l in 0..count {
        let holds = accepted[l] != 0.0;
        tried[l] += 1.0;
        steps[l] += accepted[l];
        // Both are read unconditionally: otherwise the compiler selects an address and does not vectorise.
        let (there, here) = (end[l], time[l]);
        let now = select_unpredictable(holds, there, here);
        let remaining = limits.end - now;
        // A last step slightly longer than planned avoids a tiny one.
        let last = holds & (planned[l].abs() * 1.01 >= remaining.abs());
        let next = if last { remaining } else { planned[l] };
        let ended = (remaining == 0.0)
            | (tried[l] >= limits.steps)
            | (tried[l] >= look[l])
            | too_small(next, now)
            | escaped(largest[l], bound[l]);
        remarkable[l] = if ended & (bound[l] > 0.0) { 1.0 } else { 0.0 };
        (time[l], h[l]) = (now, next);
    }
}

/// True if a trajectory is unbounded.
#[inline(always)]
pub(super) fn escaped(largest: f64, bound: f64) -> bool {
    (largest > bound) | largest.is_nan()
}

/// True if a step is too short to progress.
#[inline(always)]
pub(super) fn too_small(h: f64, time: f64) -> bool {
    (h.abs() <= 4.0 * f64::EPSILON * time.abs()) | (h.abs() < 1e-300)
}

/// Binary logarithm of a positive normal number to 2e-5; for a mantissa m it is 2/ln 2 · artanh((m - 1)/(m + 1)).
#[inline(always)]
fn log2(x: f64) -> f64 {
    const MANTISSA: u64 = (1 << 52) - 1;
    // An integer below 2⁵² placed in the low bits of 2⁵², which is then subtracted.
    let exponent = f64::from_bits((x.to_bits() >> 52) | 0x4330_0000_0000_0000) - (4_503_599_627_370_496.0 + 1023.0);
    let mantissa = f64::from_bits((x.to_bits() & MANTISSA) | 0x3ff0_0000_0000_0000);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let square = s * s;
    let artanh = s * (1.0 + square * (1.0 / 3.0 + square * (1.0 / 5.0 + square * (1.0 / 7.0))));
    exponent + 2.0 * std::f64::consts::LOG2_E * artanh
}

/// 2ˣ for |x| < 1000 to a relative accuracy of 3e-6.
#[inline(always)]
fn exp2(x: f64) -> f64 {
    const ROUND: f64 = 6_755_399_441_055_744.0;
    // The nearest integer, in the low bits of 1.5 · 2⁵² + x.
    let shifted = x + ROUND;
    let y = (x - (shifted - ROUND)) * std::f64::consts::LN_2;
    let power = 1.0 + y * (1.0 + y * (0.5 + y * (1.0 / 6.0 + y * (1.0 / 24.0 + y * (1.0 / 120.0)))));
    f64::from_bits(power.to_bits().wrapping_add(shifted.to_bits() << 52))
}

impl Ensemble<'_> {
    /// Computes the first slopes and step lengths of some lanes.
    pub(super) fn begin(&mut self, columns: &[usize]) {
        let (n, lanes, m) = (self.lanes.n, self.lanes.count, columns.len());
        if m == 0 {
            return;
        }
        let gather = |from: &[f64]| -> Vec<f64> {
            from.chunks_exact(lanes).flat_map(|component| columns.iter().map(|&l| component[l])).collect()
        };
        let x = gather(&self.lanes.x);
        let own = match self.lanes.parameters(&[]) {
            Parameters::PerLane(own) => gather(own),
            Parameters::Shared(_) => Vec::new(),
        };
        let parameters = shared_or_own(self.parameters, &own);
        let (signs, switches) = self.first_signs(Batch { lanes: m, states: &x, parameters, times: &[], signs: &[] });
        let evaluate = |states: &[f64]| {
            let mut f = vec![0.0; n * m];
            let at = Batch { lanes: m, states, parameters, times: &[], signs: &[] };
            match signs.is_empty() {
                true => self.field.evaluate(at, &mut f),
                false => self.field.evaluate(Batch { signs: &signs, ..at }, &mut f),
            }
            f
        };
        let f = evaluate(&x);
        let weight =
            |i: usize, c: usize| 1.0 / (self.tolerance.absolute[i] + self.tolerance.relative * x[i * m + c].abs());
        let size = |c: usize, of: &dyn Fn(usize) -> f64| (0..n).map(|i| (of(i * m + c) * weight(i, c)).powi(2)).sum();
        let span = (self.limits.end - self.begin).abs();
        let trial = |c: usize| {
            let [x, f]: [f64; 2] = [size(c, &|at| x[at]), size(c, &|at| f[at])];
            if x > 1e-10 && f > 1e-10 { (0.01 * (x / f).sqrt()).min(span) } else { span.min(1e-6) }
        };
        let h: Vec<f64> = (0..m).map(trial).collect();
        let moved: Vec<f64> = (0..n * m).map(|at| x[at] + self.limits.sign * h[at % m] * f[at]).collect();
        let there = evaluate(&moved);
        let first = |c: usize| {
            let curvature: f64 = size(c, &|at| there[at] - f[at]);
            let slope: f64 = size(c, &|at| f[at]);
            let largest = (curvature.sqrt() / h[c].max(1e-300)).max(slope.sqrt()) / (n as f64).sqrt();
            let second = if largest > 1e-15 { (0.01 / largest).powf(0.2) } else { (h[c] * 1e-3).max(1e-6) };
            // f may be undefined at the trial point even if it is defined at the start.
            let step = if second.is_finite() { second.min(100.0 * h[c]) } else { 1e-3 * h[c] };
            self.limits.sign * step.min(span).min(self.limits.longest)
        };
        let steps: Vec<f64> = (0..m).map(first).collect();
        for (c, &l) in columns.iter().enumerate() {
            let finite = (0..n).all(|i| x[i * m + c].is_finite() && f[i * m + c].is_finite());
            self.runs[l].done = match finite {
                false => Some(Outcome::Undefined),
                true if span == 0.0 => Some(Outcome::Reached),
                true => None,
            };
            self.lanes.h[l] = steps[c];
            (0..n).for_each(|i| self.lanes.slopes[0][i * lanes + l] = f[i * m + c]);
            for s in 0..signs.len() / m {
                self.lanes.signs[s * lanes + l] = signs[s * m + c];
                self.lanes.switches[s * lanes + l] = switches[s * m + c];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_powers_to_five_digits() {
        let mut error: f64 = 1e-10;
        while error < 1e10 {
            for before in [1e-4f64, 0.3, 1.0] {
                let exact = SAFETY * error.powf(-ALPHA);
                let shrink = SAFETY * exp2(first(error));
                assert!((shrink / exact - 1.0).abs() < 1e-5, "{error}: {shrink} against {exact}");
                let growth = SAFETY * exp2(first(error) + second(before));
                assert!((growth / (exact * before.powf(BETA)) - 1.0).abs() < 1e-5, "{error}, {before}");
            }
            error *= 1.37;
        }
        assert!(SAFETY * exp2(first(0.0)) > MOST && SAFETY * exp2(first(f64::INFINITY)) < LEAST);
    }
}
