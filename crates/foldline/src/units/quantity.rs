//! Numbers with a unit as text: `0.3 mm`, `2670 rpm`.

use super::Unit;

/// Number with a unit, as written.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// Number.
    pub value: f64,
    /// Unit, as text.
    pub unit: String,
}

/// Splits a text such as `0.3 mm` into number and unit; `None` if it is something else, such as a plain number or an
/// expression.
///
/// A unit follows its number without an operator, which no expression allows: `15*beta` and `2 *x` are expressions.
pub fn quantity(text: &str) -> Option<Written> {
    let text = text.trim();
    let end = number_length(text);
    let value: f64 = text[..end].parse().ok().filter(|v: &f64| v.is_finite())?;
    let unit = text[end..].trim_start();
    let begins = unit.starts_with(|c: char| c.is_alphabetic() || matches!(c, '%' | '‰' | '°'))
        || unit.strip_prefix("1/").is_some() && unit.len() < text.len() - end;
    let plain = !unit.contains(['+', ',', '<', '>', '=', '!', '[', ']']);
    (begins && plain && Unit::well_formed(unit).is_some()).then(|| Written { value, unit: unit.to_string() })
}

/// Length in bytes of the number at the beginning: sign, digits, decimals, and an exponent if it has digits.
fn number_length(text: &str) -> usize {
    let digits = |from: usize| text[from..].bytes().take_while(|b| b.is_ascii_digit() || *b == b'_').count();
    let sign = usize::from(text.starts_with(['-', '+']));
    let mut end = sign + digits(sign);
    if text[end..].starts_with('.') {
        end += 1 + digits(end + 1);
    }
    if text[end..].starts_with(['e', 'E']) {
        let sign = usize::from(text[end + 1..].starts_with(['-', '+']));
        let count = digits(end + 1 + sign);
        if count > 0 {
            end += 1 + sign + count;
        }
    }
    end
}
