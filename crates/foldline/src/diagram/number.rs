//! Numbers in messages.

use std::fmt;

/// A value printed with its significant digits, in any unit. With a precision, that number of decimals, or scientific
/// notation if these would show too little; without one, all digits but those affected by rounding.
#[derive(Clone, Copy, Debug)]
pub struct Shown(pub f64);

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        /// Significant digits of a value without a precision: two fewer than a number has.
        const DIGITS: usize = 14;
        let size = self.0.abs();
        match f.precision() {
            Some(digits) if size == 0.0 || (1e-3..1e7).contains(&size) => write!(f, "{:.digits$}", self.0 + 0.0),
            Some(digits) => write!(f, "{:.digits$e}", self.0),
            None => {
                let rounded: f64 = format!("{:.DIGITS$e}", self.0).parse().unwrap_or(self.0);
                match size {
                    _ if size == 0.0 || (1e-4..1e15).contains(&size) => write!(f, "{}", rounded + 0.0),
                    _ => write!(f, "{rounded:e}"),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Shown;

    #[test]
    fn digits_do_not_depend_on_the_unit() {
        let all = |value: f64| (Shown(value).to_string(), format!("{:.6}", Shown(value)));
        assert_eq!(all(0.15999999999999998), ("0.16".into(), "0.160000".into()));
        assert_eq!(all(-3.0000000000000004e-9), ("-3e-9".into(), "-3.000000e-9".into()));
        assert_eq!(all(-0.0), ("0".into(), "0.000000".into()));
        assert_eq!(all(5000.0), ("5000".into(), "5000.000000".into()));
        assert_eq!(all(2.5e20), ("2.5e20".into(), "2.500000e20".into()));
    }
}
