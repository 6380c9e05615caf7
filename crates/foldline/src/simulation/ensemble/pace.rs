//! How long steps are: the first one, and by which factor the next one may differ.
//!
//! **Source.** hairer1993, §II.4 (step control and first step); hairer1996, §IV.2 (the second factor of (1) of the ensemble).
//!
//! **Departures.** The powers of (1) are computed to five digits, which a length needs less than: in that way they are a few
//! vector instructions.

use super::{Ensemble, Outcome, shared_or_own};
use crate::contract::{Batch, Parameters};

const SAFETY: f64 = 0.9;
const BETA: f64 = 0.04;
const ALPHA: f64 = 0.2 - 0.75 * BETA;
/// Limits of the factor.
pub(super) const LEAST: f64 = 0.2;
pub(super) const MOST: f64 = 10.0;
/// What counts as the previous error at the first step, and at least.
pub(super) const SMALLEST_BEFORE: f64 = 1e-4;

/// (1) of the ensemble before it is clamped, without and with the second power.
#[inline(always)]
fn factors(error: f64, before: f64) -> [f64; 2] {
    // Between these the factor goes from beyond the one limit to beyond the other.
    let error = if error > 1e-10 { error } else { 1e-10 };
    let error = if error < 1e10 { error } else { 1e10 };
    let power = -ALPHA * log2(error);
    [SAFETY * exp2(power), SAFETY * exp2(power + BETA * log2(before))]
}

/// The same for all lanes.
#[inline(always)]
pub(super) fn all_factors(error: &[f64], before: &[f64], shrink: &mut [f64], growth: &mut [f64]) {
    let count = error.len();
    let (before, shrink, growth) = (&before[..count], &mut shrink[..count], &mut growth[..count]);
    for l in 0..count {
        [shrink[l], growth[l]] = factors(error[l], before[l]);
    }
}

/// Binary logarithm of a positive normal number to 2e-5: that of a mantissa m is 2/ln 2 · artanh((m - 1)/(m + 1)).
#[inline(always)]
fn log2(x: f64) -> f64 {
    const MANTISSA: u64 = (1 << 52) - 1;
    // An integer below 2⁵² as the last bits of 2⁵², which is then taken away.
    let exponent = f64::from_bits((x.to_bits() >> 52) | 0x4330_0000_0000_0000) - (4_503_599_627_370_496.0 + 1023.0);
    let mantissa = f64::from_bits((x.to_bits() & MANTISSA) | 0x3ff0_0000_0000_0000);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let square = s * s;
    let artanh = s * (1.0 + square * (1.0 / 3.0 + square * (1.0 / 5.0 + square * (1.0 / 7.0))));
    exponent + 2.0 * std::f64::consts::LOG2_E * artanh
}

/// 2ˣ for |x| < 1000 to 3e-6, relative.
#[inline(always)]
fn exp2(x: f64) -> f64 {
    const ROUND: f64 = 6_755_399_441_055_744.0;
    // The nearest integer as the last bits of 1.5 · 2⁵² + x.
    let shifted = x + ROUND;
    let y = (x - (shifted - ROUND)) * std::f64::consts::LN_2;
    let power = 1.0 + y * (1.0 + y * (0.5 + y * (1.0 / 6.0 + y * (1.0 / 24.0 + y * (1.0 / 120.0)))));
    f64::from_bits(power.to_bits().wrapping_add(shifted.to_bits() << 52))
}

impl Ensemble<'_> {
    /// First slopes and first step lengths of some lanes.
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
        let (signs, switches) = self.first_signs(Batch { lanes: m, states: &x, parameters, times: &[] });
        let evaluate = |states: &[f64]| {
            let mut f = vec![0.0; n * m];
            let at = Batch { lanes: m, states, parameters, times: &[] };
            match signs.is_empty() {
                true => self.field.evaluate(at, &mut f),
                false => self.field.evaluate_switched(at, &signs, &mut f),
            }
            f
        };
        let f = evaluate(&x);
        let weight =
            |i: usize, c: usize| 1.0 / (self.tolerance.absolute[i] + self.tolerance.relative * x[i * m + c].abs());
        let size = |c: usize, of: &dyn Fn(usize) -> f64| (0..n).map(|i| (of(i * m + c) * weight(i, c)).powi(2)).sum();
        let span = (self.end - self.begin).abs();
        let trial = |c: usize| {
            let [x, f]: [f64; 2] = [size(c, &|at| x[at]), size(c, &|at| f[at])];
            if x > 1e-10 && f > 1e-10 { (0.01 * (x / f).sqrt()).min(span) } else { span.min(1e-6) }
        };
        let h: Vec<f64> = (0..m).map(trial).collect();
        let moved: Vec<f64> = (0..n * m).map(|at| x[at] + self.sign * h[at % m] * f[at]).collect();
        let there = evaluate(&moved);
        let first = |c: usize| {
            let curvature: f64 = size(c, &|at| there[at] - f[at]);
            let slope: f64 = size(c, &|at| f[at]);
            let largest = (curvature.sqrt() / h[c].max(1e-300)).max(slope.sqrt()) / (n as f64).sqrt();
            let second = if largest > 1e-15 { (0.01 / largest).powf(0.2) } else { (h[c] * 1e-3).max(1e-6) };
            // f may be undefined at the trial point although it is not at the start.
            let step = if second.is_finite() { second.min(100.0 * h[c]) } else { 1e-3 * h[c] };
            self.sign * step.min(span).min(self.longest)
        };
        let steps: Vec<f64> = (0..m).map(first).collect();
        for (c, &l) in columns.iter().enumerate() {
            let finite = (0..n).all(|i| x[i * m + c].is_finite() && f[i * m + c].is_finite());
            self.runs[l].done = match finite {
                false => Some(Outcome::Escaped),
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
        let mut error = 1e-10;
        while error < 1e10 {
            for before in [1e-4, 0.3, 1.0] {
                let [shrink, growth] = factors(error, before);
                let exact = SAFETY * error.powf(-ALPHA);
                assert!((shrink / exact - 1.0).abs() < 1e-5, "{error}: {shrink} against {exact}");
                assert!((growth / (exact * before.powf(BETA)) - 1.0).abs() < 1e-5, "{error}, {before}");
            }
            error *= 1.37;
        }
        assert!(factors(0.0, 1.0)[0] > MOST && factors(f64::INFINITY, 1.0)[0] < LEAST);
    }
}
