//! Random formulas of the model language as trees, and their text.

use arbitrary::{Result, Unstructured};

/// Infix operators with their precedence.
pub const OPERATORS: [(&str, u8); 11] =
    [("<", 1), ("<=", 1), (">", 1), (">=", 1), ("==", 1), ("!=", 1), ("+", 2), ("-", 2), ("*", 3), ("/", 3), ("^", 5)];
/// Precedence of a sign.
const SIGN: u8 = 4;
/// Highest precedence: numbers, names and function calls.
const ATOM: u8 = 6;
/// Functions of one argument.
pub const ONE: [&str; 19] = [
    "sqrt",
    "exp",
    "log",
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "sinh",
    "cosh",
    "tanh",
    "abs",
    "sign",
    "heaviside",
    "log10",
    "expm1",
    "asinh",
    "+",
];
/// Functions of two arguments.
pub const TWO: [&str; 4] = ["atan2", "min", "max", "hypot"];
/// Constants that are tried in addition to random ones.
const NUMBERS: [f64; 14] = [0.0, 1.0, 2.0, 3.0, 0.5, 1.5, 7.0, 0.25, 10.0, 1e-8, 1e8, 0.1, 1e300, 1e-300];

/// Formula.
#[derive(Clone, Debug)]
pub enum Formula {
    /// Non-negative number.
    Number(f64),
    /// Name, by its index in the list of states, parameters and definitions.
    Name(usize),
    /// -a.
    Negative(Box<Formula>),
    /// a operator b, with the index of the operator in [`OPERATORS`].
    Infix(usize, Box<[Formula; 2]>),
    /// Function of one argument, by its index in [`ONE`]; the last is the sign +.
    One(usize, Box<Formula>),
    /// Function of two arguments, by its index in [`TWO`].
    Two(usize, Box<[Formula; 2]>),
    /// `if(condition, a, b)`.
    If(Box<[Formula; 3]>),
}

impl Formula {
    /// Returns a random formula in `names` names, of depth at most `depth`.
    pub fn random(u: &mut Unstructured, names: usize, depth: usize) -> Result<Formula> {
        if depth == 0 || u.is_empty() {
            return Ok(match u.ratio(1u8, 3u8)? {
                true => Formula::Number(number(u)?),
                false => Formula::Name(u.choose_index(names)?),
            });
        }
        let inner = |u: &mut Unstructured| Formula::random(u, names, depth - 1);
        Ok(match u.int_in_range(0..=9u8)? {
            0 => Formula::Negative(Box::new(inner(u)?)),
            // Comparisons are rarer than arithmetic.
            n @ 1..=5 => {
                let operators = if n == 1 { 0..OPERATORS.len() } else { 6..OPERATORS.len() };
                Formula::Infix(u.int_in_range(operators.start..=operators.end - 1)?, Box::new([inner(u)?, inner(u)?]))
            }
            6 | 7 => Formula::One(u.choose_index(ONE.len())?, Box::new(inner(u)?)),
            8 => Formula::Two(u.choose_index(TWO.len())?, Box::new([inner(u)?, inner(u)?])),
            _ => Formula::If(Box::new([inner(u)?, inner(u)?, inner(u)?])),
        })
    }

    /// Appends the formula as text to `out`, with the necessary parentheses and a few more; `name` formats a name.
    pub fn write(&self, u: &mut Unstructured, name: &dyn Fn(usize) -> String, out: &mut String) -> Result<()> {
        self.write_within(u, name, 0, out)
    }

    /// Appends the formula in parentheses if its precedence is lower than `least`.
    fn write_within(
        &self,
        u: &mut Unstructured,
        name: &dyn Fn(usize) -> String,
        least: u8,
        out: &mut String,
    ) -> Result<()> {
        let bracket = self.strength() < least || u.ratio(1u8, 10u8)?;
        if bracket {
            out.push('(');
        }
        let arguments = |u: &mut Unstructured, function: &str, list: &[Formula], out: &mut String| -> Result<()> {
            out.push_str(function);
            for (i, argument) in list.iter().enumerate() {
                out.push_str(if i == 0 { "(" } else { ", " });
                argument.write_within(u, name, 0, out)?;
            }
            out.push(')');
            Ok(())
        };
        match self {
            Formula::Number(value) => out.push_str(&match u.int_in_range(0..=2u8)? {
                0 => format!("{value}"),
                1 => format!("{value:?}"),
                _ => format!("{value:e}"),
            }),
            Formula::Name(i) => out.push_str(&name(*i)),
            Formula::Negative(a) => {
                out.push('-');
                a.write_within(u, name, SIGN, out)?;
            }
            Formula::One(i, a) if ONE[*i] == "+" => {
                out.push('+');
                a.write_within(u, name, SIGN, out)?;
            }
            Formula::Infix(operator, operands) => {
                let (symbol, strength) = OPERATORS[*operator];
                // Sums and products are left-associative, powers right-associative, comparisons neither.
                let (left, right) = match strength {
                    1 => (2, 2),
                    5 => (ATOM, SIGN),
                    _ => (strength, strength + 1),
                };
                operands[0].write_within(u, name, left, out)?;
                out.push_str(if u.arbitrary()? { " " } else { "" });
                out.push_str(symbol);
                out.push_str(if u.arbitrary()? { " " } else { "" });
                operands[1].write_within(u, name, right, out)?;
            }
            Formula::One(i, a) => arguments(u, ONE[*i], std::slice::from_ref(a), out)?,
            Formula::Two(i, list) => arguments(u, TWO[*i], &list[..], out)?,
            Formula::If(list) => arguments(u, "if", &list[..], out)?,
        }
        if bracket {
            out.push(')');
        }
        Ok(())
    }

    fn strength(&self) -> u8 {
        match self {
            Formula::Negative(_) => SIGN,
            Formula::One(i, _) if ONE[*i] == "+" => SIGN,
            Formula::Infix(operator, _) => OPERATORS[*operator].1,
            _ => ATOM,
        }
    }
}

/// Returns a finite, non-negative number.
fn number(u: &mut Unstructured) -> Result<f64> {
    Ok(match u.ratio(7u8, 8u8)? {
        true => *u.choose(&NUMBERS)?,
        false => Some(f64::from_bits(u.arbitrary()?).abs()).filter(|x| x.is_finite()).unwrap_or(4.25),
    })
}
