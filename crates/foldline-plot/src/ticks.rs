//! Round numbers along an axis.

/// About `wanted` ticks from `low` to `high`, spaced by 1, 2 or 5 times a power of ten.
pub fn ticks(low: f64, high: f64, wanted: usize) -> Vec<f64> {
    let raw = (high - low) / wanted.max(1) as f64;
    if !raw.is_normal() || raw < 0.0 || raw < 1e-13 * low.abs().max(high.abs()) {
        return vec![low];
    }
    let power = 10.0_f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|k| k * power).into_iter().find(|s| *s >= 0.999 * raw).unwrap_or(10.0 * power);
    let first = (low / step - 1e-9).ceil();
    let last = (high / step + 1e-9).floor();
    (0..=(last - first).max(0.0) as usize).map(|k| (first + k as f64) * step).collect()
}

/// Labels of ticks with as many decimals as needed, or powers of ten where numbers would be long.
pub fn labels(ticks: &[f64]) -> Vec<String> {
    let largest = ticks.iter().fold(0.0_f64, |m, t| m.max(t.abs()));
    let step = ticks.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    let step = if step.is_finite() { step } else { largest };
    let digits = |x: f64| if x > 0.0 { x.log10().floor() as i32 } else { 0 };
    let text = |number: String| number.replace('-', "−");
    if largest != 0.0 && (digits(largest) >= 5 || digits(largest) <= -4) {
        let exponent = digits(largest);
        let decimals = (exponent - digits(step)).clamp(0, 15) as usize;
        let scale = 10.0_f64.powi(exponent);
        return ticks
            .iter()
            .map(|t| if *t == 0.0 { "0".into() } else { text(format!("{:.decimals$}e{exponent}", t / scale)) })
            .collect();
    }
    let decimals = (-digits(step * 1.0001)).clamp(0, 15) as usize;
    // Adding 0 turns -0 into 0.
    ticks.iter().map(|t| text(format!("{:.decimals$}", t + 0.0))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks(0.5, 12.0, 6), vec![2.0, 4.0, 6.0, 8.0, 10.0, 12.0]);
        assert_eq!(labels(&ticks(-0.2, 0.2, 4)), ["−0.2", "−0.1", "0.0", "0.1", "0.2"]);
        assert_eq!(labels(&ticks(0.0, 4e6, 4)), ["0", "1e6", "2e6", "3e6", "4e6"]);
    }

    #[test]
    fn an_interval_without_width_has_one_tick_and_does_not_hang() {
        assert_eq!(ticks(1.0, 1.0, 6), vec![1.0]);
        assert_eq!(ticks(1e9, 1e9 * (1.0 + 1e-16), 6).len(), 1);
        assert_eq!(ticks(f64::NAN, 1.0, 6).len(), 1);
    }
}
