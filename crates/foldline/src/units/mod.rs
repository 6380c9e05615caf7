//! Units of measurement: names, dimensions, conversion.
//!
//! **Idea.** A unit is a factor times a product of powers of base units: the seven of the SI, and every unknown name,
//! which becomes a base unit. A *turn* is distinct from the radian, so that Hz and rpm (turns per time) are
//! distinguished from rad/s.
//!
//! **Equations.**
//!
//! 1. value in b = value in a · (factor of a)/(factor of b), for equal dimensions
//! 2. 1 turn = 2π rad; the radian has the dimension of a number
//!
//! **Source.** bipm2019.
//!
//! **Departures.** Factors are kept as fractions, such as 1 mm = (1/1000) m, so decimal values convert without rounding
//! if the result is a decimal of 15 digits. Degrees Celsius are kelvins in differences; values are not converted
//! between the two.

mod names;
mod quantity;
mod read;

pub use quantity::{Written, quantity};

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

/// Radian, a base unit without dimension.
pub(crate) const RADIAN: &str = "rad";
/// Turn, 2π radians.
pub(crate) const TURN: &str = "turn";
/// Exponents closer than this are equal: they are fractions of small integers.
pub(crate) const SAME_POWER: f64 = 1e-9;

/// Unit of measurement.
///
/// ```
/// use foldline::units::Unit;
/// let (rpm, radians) = (Unit::read("rpm"), Unit::read("rad/s"));
/// let speed = rpm.convert(3000.0, &radians)?;
/// assert!((speed - 100.0 * std::f64::consts::PI).abs() < 1e-12);
/// assert!(Unit::read("kg").convert(1.0, &radians).is_err());
/// # Ok::<(), foldline::units::Mismatch>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// Exponents of base units, all nonzero.
    pub(crate) powers: BTreeMap<String, f64>,
    /// Factor to the coherent unit: `above/below`.
    above: f64,
    below: f64,
    /// True for scales whose zero is not that of the quantity.
    shifted: bool,
    /// Names of units of time that occur in it, such as `ms` in `mV/ms`.
    pub(crate) times: BTreeSet<String>,
    /// Unknown names.
    foreign: BTreeSet<String>,
}

/// Reason why a value cannot be converted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mismatch {
    /// The dimensions differ.
    Dimension,
    /// Turns per time on one side and plain 1/time on the other: a factor of 2π or none.
    Turns,
    /// The zeros of the scales differ, as for °C and K.
    Zero,
}

impl std::fmt::Display for Mismatch {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Mismatch::Dimension => "the dimensions differ",
            Mismatch::Turns => "a turn may count as 1 or as 2π there",
            Mismatch::Zero => "the zeros of the two scales differ",
        })
    }
}

impl std::error::Error for Mismatch {}

impl Unit {
    /// Unit of a dimensionless number.
    pub fn one() -> Unit {
        let (powers, times, foreign) = Default::default();
        Unit { powers, above: 1.0, below: 1.0, shifted: false, times, foreign }
    }

    /// Parses a unit such as `kg m/s^2`; text that is not a unit becomes a base unit.
    pub fn read(text: &str) -> Unit {
        read::unit(text).unwrap_or_else(|| Unit::base(text.trim(), true))
    }

    /// Parses a unit, or returns `None` if the text does not have the form of a unit.
    pub fn well_formed(text: &str) -> Option<Unit> {
        read::unit(text)
    }

    fn base(name: &str, foreign: bool) -> Unit {
        let foreign = if foreign { BTreeSet::from([name.to_string()]) } else { BTreeSet::new() };
        Unit { powers: BTreeMap::from([(name.to_string(), 1.0)]), foreign, ..Unit::one() }
    }

    /// Unknown names in the unit.
    pub fn foreign(&self) -> impl Iterator<Item = &str> {
        self.foreign.iter().map(String::as_str)
    }

    /// Logarithm of the factor to the coherent unit.
    pub(crate) fn scale(&self) -> f64 {
        (self.above / self.below).ln()
    }

    /// True if there are no base units other than angles.
    pub fn is_number(&self) -> bool {
        self.powers.keys().all(|name| is_angle(name))
    }

    fn power(&self, base: &str) -> f64 {
        self.powers.get(base).copied().unwrap_or(0.0)
    }

    /// Converts `value` from this unit to `to`.
    ///
    /// # Errors
    /// The reason why the conversion is impossible.
    pub fn convert(&self, value: f64, to: &Unit) -> Result<f64, Mismatch> {
        let [above, below] = self.fraction_to(to)?;
        let converted = value * above / below;
        Ok(if converted.is_finite() { converted } else { value * (above / below) })
    }

    /// One of this unit in `to`, as a fraction.
    pub fn fraction_to(&self, to: &Unit) -> Result<[f64; 2], Mismatch> {
        let names: BTreeSet<&String> = self.powers.keys().chain(to.powers.keys()).collect();
        let differs = |name: &str| (self.power(name) - to.power(name)).abs() > SAME_POWER;
        if names.iter().any(|name| !is_angle(name) && differs(name)) {
            return Err(Mismatch::Dimension);
        }
        if self.shifted != to.shifted {
            return Err(Mismatch::Zero);
        }
        let [mut above, mut below] = match (self.above * to.below, self.below * to.above) {
            (above, below) if above == below => [1.0, 1.0],
            (above, below) => [above, below],
        };
        let turns = self.power(TURN) - to.power(TURN);
        let radians = to.power(RADIAN) - self.power(RADIAN);
        if turns.abs() > SAME_POWER {
            if (turns - radians).abs() > SAME_POWER {
                return Err(Mismatch::Turns);
            }
            if turns > 0.0 {
                above *= TAU.powf(turns);
            } else {
                below *= TAU.powf(-turns);
            }
        }
        Ok([above, below])
    }

    /// Product with `other` raised to `exponent`.
    pub(crate) fn times(mut self, other: &Unit, exponent: f64) -> Unit {
        for (name, power) in &other.powers {
            *self.powers.entry(name.clone()).or_insert(0.0) += exponent * power;
        }
        self.powers.retain(|_, power| power.abs() > SAME_POWER);
        let (above, below) = match exponent < 0.0 {
            true => (other.below.powf(-exponent), other.above.powf(-exponent)),
            false => (other.above.powf(exponent), other.below.powf(exponent)),
        };
        self.above *= above;
        self.below *= below;
        self.times.extend(other.times.iter().cloned());
        self.foreign.extend(other.foreign.iter().cloned());
        self.shifted = false;
        self
    }
}

/// True for base units without dimension.
pub(crate) fn is_angle(name: &str) -> bool {
    name == RADIAN || name == TURN
}

#[cfg(test)]
mod tests;
