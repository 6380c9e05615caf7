//! Parsing of units: `N s/m`, `kg*m^2`, `1/(mol s)`, `m s-1`, `µA/cm²`.

use super::Unit;
use super::names::named;

/// Maximum nesting of brackets.
const DEEPEST: usize = 8;
/// Maximum length of the text, in bytes.
const LONGEST: usize = 200;
/// Largest exponent: the sixth power is the highest in practical use; beyond this limit a factor overflows.
const LARGEST: f64 = 12.0;

/// Unit given by a text; `None` if it does not have that form. A second factor after a slash is ambiguous and rejected.
pub(super) fn unit(text: &str) -> Option<Unit> {
    let text = text.trim();
    if matches!(text, "" | "1" | "-") {
        return Some(Unit::one());
    }
    if text.len() > LONGEST {
        return None;
    }
    let mut reader = Reader { rest: text, depth: 0 };
    let unit = reader.product()?;
    let sound = unit.above.is_finite() && unit.below.is_finite() && unit.above > 0.0 && unit.below > 0.0;
    (reader.rest.is_empty() && sound).then_some(unit)
}

struct Reader<'t> {
    rest: &'t str,
    depth: usize,
}

impl<'t> Reader<'t> {
    fn skip(&mut self) {
        self.rest = self.rest.trim_start();
    }

    fn take(&mut self, symbols: &[&str]) -> bool {
        let found = symbols.iter().find_map(|symbol| self.rest.strip_prefix(symbol));
        self.rest = found.unwrap_or(self.rest);
        found.is_some()
    }

    /// product = factor { [ * ] factor } { / factor }
    fn product(&mut self) -> Option<Unit> {
        let mut unit = self.factor()?;
        let mut below = false;
        loop {
            self.skip();
            if self.rest.is_empty() || self.rest.starts_with(')') {
                return Some(unit);
            }
            if self.take(&["/"]) {
                below = true;
                self.skip();
                unit = unit.times(&self.factor()?, -1.0);
                continue;
            }
            if below {
                // N/m s may be (N/m) s or N/(m s).
                return None;
            }
            // `**` is a power and was consumed with its factor.
            self.take(&["*", "·", "⋅", "×"]);
            self.skip();
            let factor = self.factor()?;
            unit = unit.times(&factor, 1.0);
        }
    }

    /// factor = ( name | number | ( product ) ) [ power ]
    fn factor(&mut self) -> Option<Unit> {
        let (unit, stuck) = if self.take(&["("]) {
            self.depth += 1;
            if self.depth > DEEPEST {
                return None;
            }
            self.skip();
            let inner = self.product()?;
            self.depth -= 1;
            self.take(&[")"]).then_some((inner, 1.0))?
        } else if self.rest.starts_with(|c: char| c.is_ascii_digit()) {
            (self.number()?, 1.0)
        } else {
            self.name()?
        };
        let power = self.power()?.unwrap_or(stuck);
        let lone = power == 1.0;
        // A scale on its own keeps its zero; in a product it counts differences.
        Some(if lone { unit } else { Unit::one().times(&unit, power) })
    }

    /// A positive number as a factor.
    fn number(&mut self) -> Option<Unit> {
        let end = self.rest.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(self.rest.len());
        let (digits, rest) = self.rest.split_at(end);
        let value: f64 = digits.parse().ok().filter(|v: &f64| *v > 0.0)?;
        self.rest = rest;
        Some(Unit { above: value, ..Unit::one() })
    }

    /// A name with an attached exponent, as in `m2` and `s-1`.
    fn name(&mut self) -> Option<(Unit, f64)> {
        let letter = |c: char| c.is_alphabetic() || matches!(c, '_' | '%' | '‰' | '°' | '$' | '€' | '\'' | '"' | '#');
        let end = self.rest.find(|c: char| !(letter(c) || c.is_ascii_digit() || c == '.')).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        if !word.starts_with(letter) {
            return None;
        }
        self.rest = rest;
        if let Some(unit) = named(word) {
            // The minus of `s-1`; without digits it is not part of a unit.
            let digits = rest.strip_prefix('-').map_or(0, |r| r.bytes().take_while(u8::is_ascii_digit).count());
            if digits == 0 {
                return Some((unit, 1.0));
            }
            self.rest = &rest[1 + digits..];
            return Some((unit, -exponent(&rest[1..1 + digits])?));
        }
        let head = word.trim_end_matches(|c: char| c.is_ascii_digit());
        if let (Some(unit), true) = (named(head), head.len() < word.len()) {
            return Some((unit, exponent(&word[head.len()..])?));
        }
        // `N.m`
        let parts: Option<Vec<Unit>> = word.split('.').map(named).collect();
        match parts {
            Some(parts) => Some((parts.iter().fold(Unit::one(), |all, part| all.times(part, 1.0)), 1.0)),
            None => Some((Unit::base(word, true), 1.0)),
        }
    }

    /// `^2`, `^-1`, `^(1/2)`, `**2`, `²`, `⁻¹`; `None` if malformed.
    fn power(&mut self) -> Option<Option<f64>> {
        if self.take(&["^", "**"]) {
            self.skip();
            let text = if self.take(&["("]) {
                let (inner, rest) = self.rest.split_once(')')?;
                self.rest = rest;
                inner
            } else {
                let sign = usize::from(self.rest.starts_with(['-', '+']));
                let digits = self.rest[sign..].find(|c: char| !(c.is_ascii_digit() || c == '.'));
                let (text, rest) = self.rest.split_at(digits.map_or(self.rest.len(), |d| d + sign));
                self.rest = rest;
                text
            };
            return exponent(text).map(Some);
        }
        const RAISED: [char; 11] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹', '⁻'];
        let end = self.rest.find(|c: char| !RAISED.contains(&c)).unwrap_or(self.rest.len());
        if end == 0 {
            return Some(None);
        }
        let (raised, rest) = self.rest.split_at(end);
        self.rest = rest;
        let plain = |c: char| match RAISED.iter().position(|r| *r == c) {
            Some(digit @ 0..=9) => char::from_digit(digit as u32, 10).unwrap_or('0'),
            _ => '-',
        };
        exponent(&raised.chars().map(plain).collect::<String>()).map(Some)
    }
}

fn exponent(text: &str) -> Option<f64> {
    let value = match text.split_once('/') {
        Some((a, b)) => a.trim().parse::<f64>().ok()? / b.trim().parse::<f64>().ok()?,
        None => text.trim().parse().ok()?,
    };
    (value.abs() <= LARGEST).then_some(value)
}
