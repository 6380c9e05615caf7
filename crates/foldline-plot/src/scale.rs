//! One axis: positions of values, ticks and their labels.

use crate::figure::Axis;
use crate::font::width;
use crate::ticks::{labels, ticks};

/// Font size of everything but titles.
pub(crate) const SIZE: f64 = 13.0;

/// Axis with a known range, in *axis units*: the values themselves, or their decimal logarithms.
#[derive(Clone, Debug)]
pub(crate) struct Scale {
    pub low: f64,
    pub high: f64,
    pub log: bool,
    /// Positions in axis units, and labels (empty at minor ticks).
    pub ticks: Vec<(f64, String)>,
}

impl Scale {
    /// Returns the stated range, or one with room around `extent` (axis units), which may be empty.
    pub fn new(axis: &Axis, extent: Option<[f64; 2]>) -> Scale {
        let units = |v: f64| if axis.log { v.log10() } else { v };
        let stated = axis.range.map(|range| range.map(units)).filter(|[a, b]| a < b && (b - a).is_finite());
        let [low, high] = stated.unwrap_or_else(|| roomy(extent, axis.log));
        Scale { low, high, log: axis.log, ticks: Vec::new() }
    }

    /// Position of a value in axis units; NaN if it has none.
    pub fn units(&self, value: f64) -> f64 {
        match self.log {
            true if value > 0.0 => value.log10(),
            true => f64::NAN,
            false => value,
        }
    }

    /// Fraction of the axis that lies before a position in axis units.
    pub fn share(&self, units: f64) -> f64 {
        (units - self.low) / (self.high - self.low)
    }

    /// Chooses about `wanted` ticks.
    pub fn divide(&mut self, wanted: usize) {
        self.ticks = if self.log { self.powers(wanted) } else { self.round(wanted) };
    }

    fn round(&self, wanted: usize) -> Vec<(f64, String)> {
        let places = ticks(self.low, self.high, wanted);
        places.iter().copied().zip(labels(&places)).collect()
    }

    /// Powers of ten, or every second or third of them if there are many, with the multiples in between as minor ticks.
    fn powers(&self, wanted: usize) -> Vec<(f64, String)> {
        let (first, last) = ((self.low - 1e-9).ceil() as i32, (self.high + 1e-9).floor() as i32);
        if last <= first {
            let places = ticks(10f64.powf(self.low), 10f64.powf(self.high), wanted);
            let texts = labels(&places);
            return places.iter().map(|v| v.log10()).zip(texts).filter(|(u, _)| u.is_finite()).collect();
        }
        let every = (last - first + 1).div_euclid(wanted.max(1) as i32).max(1);
        let powers = (first..=last).filter(|k| (k - first) % every == 0);
        let mut all: Vec<(f64, String)> = powers.map(|k| (f64::from(k), power_of_ten(k))).collect();
        if every == 1 && last - first < 6 {
            let multiples = (first - 1..=last).flat_map(|k| (2..10).map(move |m| f64::from(k) + f64::from(m).log10()));
            let inside = multiples.filter(|u| (self.low..=self.high).contains(u));
            all.extend(inside.map(|u| (u, String::new())));
        }
        all
    }

    /// Width of the widest label.
    pub fn widest(&self) -> f64 {
        self.ticks.iter().map(|(_, text)| width(text, SIZE)).fold(0.0, f64::max)
    }
}

/// Writes a power of ten, such as `10³`.
fn power_of_ten(k: i32) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        other => other.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(other),
    };
    match k {
        0 => "1".into(),
        1 => "10".into(),
        _ => format!("10{}", k.to_string().chars().map(raised).collect::<String>()),
    }
}

fn roomy(extent: Option<[f64; 2]>, log: bool) -> [f64; 2] {
    let Some([low, high]) = extent else { return [0.0, 1.0] };
    if high - low > 1e-12 * high.abs().max(low.abs()) {
        return [low - 0.03 * (high - low), high + 0.03 * (high - low)];
    }
    let half = if log { 0.3 } else { 0.5 * low.abs().max(1e-300) };
    [low - half, low + half]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_logarithmic_axis_has_powers_of_ten_and_no_position_for_zero() {
        let mut scale = Scale::new(&Axis::new("").from(1e-4, 1e2).log(), None);
        scale.divide(8);
        let texts: Vec<&str> = scale.ticks.iter().map(|(_, t)| t.as_str()).filter(|t| !t.is_empty()).collect();
        assert_eq!(texts, ["10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "1", "10", "10²"]);
        assert!(scale.units(0.0).is_nan());
        assert!((scale.share(scale.units(0.1)) - 0.5).abs() < 1e-12);
    }
}
