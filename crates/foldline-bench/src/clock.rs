//! Processor time of this process, and statistics of several measurements.

use nix::time::{ClockId, clock_gettime};

/// Returns the processor time in seconds of all threads of this process so far.
pub fn seconds() -> f64 {
    match clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID) {
        Ok(time) => time.tv_sec() as f64 + 1e-9 * time.tv_nsec() as f64,
        Err(_) => f64::NAN,
    }
}

/// Returns the processor time in seconds that a call takes, and its result.
pub fn timed<T>(call: impl FnOnce() -> T) -> (f64, T) {
    let start = seconds();
    let value = call();
    (seconds() - start, value)
}

/// Returns the processor time in seconds of one call: the best of five rounds, each long enough for the clock.
pub fn best(mut call: impl FnMut()) -> f64 {
    const ROUND: f64 = 0.02;
    let (first, ()) = timed(&mut call);
    let count = (ROUND / first.max(1e-7)).clamp(1.0, 1e6) as usize;
    (0..5).map(|_| timed(|| (0..count).for_each(|_| call())).0 / count as f64).fold(f64::INFINITY, f64::min)
}

/// Returns the median; for an even number of values, the mean of the middle two.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n => 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]),
    }
}

/// Returns the smallest value.
pub fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Returns the exponent b of the least-squares fit of y = a xᵇ in logarithms.
pub fn exponent(x: &[f64], y: &[f64]) -> f64 {
    let logs: Vec<(f64, f64)> = x.iter().zip(y).map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let mean = logs.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let products = logs.iter().map(|p| (p.0 - mean.0) * (p.1 - mean.1)).sum::<f64>();
    products / logs.iter().map(|p| (p.0 - mean.0).powi(2)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponent_of_a_power_law_is_recovered() {
        let x = [50.0, 100.0, 200.0, 800.0];
        let y = x.map(|v: f64| 3e-6 * v.powf(1.2));
        assert!((exponent(&x, &y) - 1.2).abs() < 1e-12);
    }

    #[test]
    fn the_median_is_the_middle_value() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
    }
}
