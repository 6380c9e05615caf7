//! Units of measurement: converts numbers with units, as written by users, to SI.
//!
//! **Idea.** A unit is a product of powers of known symbols; it has a size in SI and a dimension. A value is accepted
//! if its dimension is the requested one. Angle counts as a dimension of its own, because a speed in rad/s and one in
//! Hz differ by 2π and "1/s" does not say which of the two is meant.
//!
//! **Fails when** the unit is unknown or ambiguous, or has another dimension; the answer is a [`Mistake`].

use std::f64::consts::{PI, TAU};
use std::fmt;

/// Mistake in a value: place, cause, cure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// Name of the constant, and the value given for it.
    pub place: String,
    /// Description of the mistake.
    pub cause: String,
    /// Suggested correction.
    pub cure: String,
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}; {}", self.place, self.cause, self.cure)
    }
}

impl std::error::Error for Mistake {}

/// Exponents of mass, length, time and angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Dimension {
    /// Exponent of kg.
    pub mass: i32,
    /// Exponent of m.
    pub length: i32,
    /// Exponent of s.
    pub time: i32,
    /// Exponent of rad.
    pub angle: i32,
}

/// Size in SI (with rad for angles) and dimension of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Size in SI units.
    pub size: f64,
    /// Dimension of the unit.
    pub dimension: Dimension,
}

const PREFIXES: [(&str, f64); 9] =
    [("n", 1e-9), ("u", 1e-6), ("µ", 1e-6), ("μ", 1e-6), ("m", 1e-3), ("c", 1e-2), ("k", 1e3), ("M", 1e6), ("G", 1e9)];

/// Symbol, size, exponents of kg, m, s, rad, and true if it takes prefixes.
const SYMBOLS: [(&str, f64, [i32; 4], bool); 12] = [
    ("m", 1.0, [0, 1, 0, 0], true),
    ("g", 1e-3, [1, 0, 0, 0], true),
    ("t", 1e3, [1, 0, 0, 0], false),
    ("s", 1.0, [0, 0, 1, 0], true),
    ("min", 60.0, [0, 0, 1, 0], false),
    ("N", 1.0, [1, 1, -2, 0], true),
    ("Hz", TAU, [0, 0, -1, 1], true),
    ("rpm", TAU / 60.0, [0, 0, -1, 1], false),
    ("rad", 1.0, [0, 0, 0, 1], false),
    ("deg", PI / 180.0, [0, 0, 0, 1], false),
    ("rev", TAU, [0, 0, 0, 1], false),
    ("1", 1.0, [0, 0, 0, 0], false),
];

impl Unit {
    /// Parses a unit such as `N s/m`, `kg·mm²`, `rpm`; an empty text is the unit 1. Every `/` divides by the one
    /// factor that follows it.
    ///
    /// # Errors
    /// A [`Mistake`] whose place is the unit itself.
    pub fn parse(text: &str) -> Result<Unit, Mistake> {
        let mistake = |cause: String, cure: &str| Mistake { place: format!("unit `{text}`"), cause, cure: cure.into() };
        let mut unit = Unit { size: 1.0, dimension: Dimension::default() };
        let mut divided = false;
        for (index, part) in text.split('/').enumerate() {
            let factors: Vec<&str> =
                part.split(|c: char| c.is_whitespace() || c == '*' || c == '·').filter(|f| !f.is_empty()).collect();
            if factors.is_empty() && !text.trim().is_empty() {
                return Err(mistake("a factor is missing".into(), "write it as in `N/m`"));
            }
            if index > 0 && factors.len() > 1 {
                let cause = format!("`/{}` is ambiguous", part.trim());
                return Err(mistake(cause, "put all products before the first `/`, as in `N s/m`"));
            }
            for factor in factors {
                let (symbol, power) = split_power(factor).ok_or_else(|| {
                    mistake(format!("`{factor}` has no whole-number power"), "write powers as in `m^2` or `m²`")
                })?;
                let one = of_symbol(symbol).ok_or_else(|| {
                    let known =
                        "the known units are m, g, t, s, min, N, Hz, rpm, rad, deg and rev, with the prefixes n, µ, \
                         m, c, k, M and G";
                    mistake(format!("`{symbol}` is not a known unit"), known)
                })?;
                unit = unit.times(one, if divided { -power } else { power });
            }
            divided = true;
        }
        Ok(unit)
    }

    fn times(self, other: Unit, power: i32) -> Unit {
        let (a, b) = (self.dimension, other.dimension);
        Unit {
            size: self.size * other.size.powi(power),
            dimension: Dimension {
                mass: a.mass + power * b.mass,
                length: a.length + power * b.length,
                time: a.time + power * b.time,
                angle: a.angle + power * b.angle,
            },
        }
    }
}

/// Splits a factor such as `m^2`, `m²` or `m` into symbol and power.
fn split_power(factor: &str) -> Option<(&str, i32)> {
    if let Some((symbol, power)) = factor.split_once('^') {
        return power.parse().ok().filter(|p: &i32| p.abs() <= 9).map(|p| (symbol, p));
    }
    let raised = [('²', 2), ('³', 3), ('⁴', 4)];
    match raised.iter().find_map(|&(mark, power)| factor.strip_suffix(mark).map(|symbol| (symbol, power))) {
        Some(found) => Some(found),
        None => Some((factor, 1)),
    }
}

fn of_symbol(symbol: &str) -> Option<Unit> {
    let unit = |size: f64, [mass, length, time, angle]: [i32; 4]| Unit {
        size,
        dimension: Dimension { mass, length, time, angle },
    };
    if let Some(&(_, size, powers, _)) = SYMBOLS.iter().find(|(name, ..)| *name == symbol) {
        return Some(unit(size, powers));
    }
    PREFIXES.iter().find_map(|(prefix, factor)| {
        let rest = symbol.strip_prefix(prefix)?;
        let &(_, size, powers, _) = SYMBOLS.iter().find(|(name, _, _, prefixed)| *prefixed && *name == rest)?;
        Some(unit(factor * size, powers))
    })
}

/// Value of `text`, a number followed by its unit, in `unit` (which is in SI). `name` is for the place of a mistake.
///
/// # Errors
/// A [`Mistake`] if there is no finite number, or if its unit differs in dimension from `unit`.
pub fn quantity(name: &str, text: &str, unit: &str) -> Result<f64, Mistake> {
    let place = format!("{name} = `{text}`");
    let wanted = Unit::parse(unit)?;
    let example = match unit {
        "" | "1" => "give a plain number, as in `0.25`".to_string(),
        "rad/s" => "give a speed as in `500 rad/s`, `80 Hz` or `4800 rpm`".to_string(),
        _ => format!("give a number with a unit compatible with {unit}, as in `2.5 {unit}`"),
    };
    let trimmed = text.trim();
    let Some((value, rest)) = leading_number(trimmed) else {
        return Err(Mistake { place, cause: "it does not begin with a finite number".into(), cure: example });
    };
    let given = Unit::parse(rest).map_err(|m| Mistake { place: format!("{place}, {}", m.place), ..m })?;
    if given.dimension != wanted.dimension {
        let cause = match rest.trim() {
            "" => format!("it has no unit, but is measured in {unit}"),
            rest if unit.is_empty() || unit == "1" => format!("it has the unit {rest}, but is a plain number"),
            rest => format!("{rest} does not have the dimension of {unit}"),
        };
        return Err(Mistake { place, cause, cure: example });
    }
    // One division: exact if the two units are equal.
    Ok(value * (given.size / wanted.size))
}

/// Longest prefix that is a finite number, and the rest.
fn leading_number(text: &str) -> Option<(f64, &str)> {
    if !text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) {
        return None;
    }
    let ends = text.char_indices().map(|(at, c)| at + c.len_utf8()).rev();
    let number = |end: usize| text[..end].parse::<f64>().ok().map(|value| (value, &text[end..]));
    ends.into_iter().find_map(number).filter(|(value, _)| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(text: &str, unit: &str, expected: f64) {
        let found = quantity("x", text, unit).unwrap();
        // Two roundings of the size of the unit, one of the product.
        assert!((found - expected).abs() <= 4.0 * f64::EPSILON * expected.abs(), "{text}: {found}");
    }

    #[test]
    fn units_of_one_dimension_are_converted() {
        close("0.5 mm", "m", 0.5e-3);
        close("-3.5e+2µm", "m", -3.5e-4);
        close("250 g", "kg", 0.25);
        close("143000 kg mm^2", "kg m^2", 0.143);
        close("143 g·m²", "kg m^2", 0.143);
        close("160 N/mm", "N/m", 1.6e5);
        close("160 kN/m", "N/m", 1.6e5);
        close("160 N/mm^3", "N/m^3", 1.6e11);
        close("32 N*s/m", "N s/m", 32.0);
        close("32 kg/s", "N s/m", 32.0);
        close("3000 rpm", "rad/s", 100.0 * PI);
        close("50 Hz", "rad/s", 100.0 * PI);
        close("0.05 kHz", "rad/s", 100.0 * PI);
        close("3000 rev/min", "rad/s", 100.0 * PI);
        close("90 deg/s", "rad/s", 0.5 * PI);
        close("0.25", "1", 0.25);
        assert_eq!(quantity("x", "0.353e-3 m", "m"), Ok(0.353e-3));
    }

    #[test]
    fn invalid_values_are_refused_with_a_cure() {
        for (text, unit, cause) in [
            ("0.5 kg", "m", "does not have the dimension"),
            ("0.5", "m", "no unit"),
            ("50 1/s", "rad/s", "does not have the dimension"),
            ("3 mm", "1", "plain number"),
            ("3 furlong", "m", "not a known unit"),
            ("2 N/m s", "N s/m", "is ambiguous"),
            ("2 N//m", "N/m", "missing"),
            ("2 m^x", "m", "whole-number power"),
            ("inf m", "m", "finite number"),
            ("1e999 m", "m", "finite number"),
            ("", "m", "finite number"),
            ("ø", "m", "finite number"),
            ("2 µ", "m", "not a known unit"),
        ] {
            let Err(mistake) = quantity("c", text, unit) else { panic!("{text} was accepted") };
            assert!(mistake.cause.contains(cause), "{text}: {mistake}");
            assert!(mistake.place.contains("c = `") && !mistake.cure.is_empty(), "{mistake}");
        }
    }
}
