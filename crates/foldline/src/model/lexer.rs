//! Tokens of an expression.

use super::error::Complaint;
use std::ops::Range;

/// Token.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    Number(f64),
    Name(String),
    /// An operator, bracket or comma.
    Symbol(&'static str),
}

/// Longer symbols first.
const SYMBOLS: [&str; 16] = ["<=", ">=", "==", "!=", "+", "-", "*", "/", "^", "(", ")", "[", "]", ",", "<", ">"];

/// Operators of other languages, and what to write instead.
const FOREIGN: [(&str, &str); 9] = [
    ("**", "write `^` for a power"),
    (".^", "write `^` for a power; a name stands for one number, so operators need no dot"),
    (".*", "write `*` for a product; a name stands for one number, so operators need no dot"),
    ("./", "write `/` for a quotient; a name stands for one number, so operators need no dot"),
    ("<>", "write `!=` for unequal"),
    ("~=", "write `!=` for unequal"),
    ("&&", "combine conditions with `*` for and, `max(a, b)` for or"),
    ("||", "combine conditions with `*` for and, `max(a, b)` for or"),
    ("//", "write `floor(a/b)` for a quotient without remainder"),
];

/// Splits `text` into tokens with their byte ranges.
pub(super) fn words(text: &str) -> Result<Vec<(Token, Range<usize>)>, Complaint> {
    let mut words: Vec<(Token, Range<usize>)> = Vec::new();
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        if first.is_whitespace() {
            at += first.len_utf8();
        } else if first.is_ascii_digit() || (first == '.' && rest[1..].starts_with(|c: char| c.is_ascii_digit())) {
            let (value, length) = number(rest, at)?;
            let end = at + length;
            if let Some(next) = text[end..].chars().next().filter(|&c| c.is_alphabetic() || c == '_' || c == '.') {
                return Err(glued(&text[at..end], next, &text[end..], at..end + next.len_utf8()));
            }
            words.push((Token::Number(value), at..end));
            at = end;
        } else if first.is_alphabetic() || first == '_' {
            let letters = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
            // A rate, such as x'.
            let primed = letters + rest[letters..].bytes().take_while(|b| *b == b'\'').count();
            // A value at one end of the interval, such as x@1.
            let at_end = ["@0", "@1"].into_iter().any(|end| rest[primed..].starts_with(end));
            let length = if at_end { primed + 2 } else { primed };
            words.push((Token::Name(rest[..length].to_string()), at..at + length));
            at += length;
        } else if let Some((_, hint)) = FOREIGN.iter().find(|(sign, _)| rest.starts_with(sign)) {
            let sign: String = rest.chars().take(2).collect();
            return Err(Complaint::new(at..at + sign.len(), format!("`{sign}` is not an operator"), *hint));
        } else if let Some(symbol) = SYMBOLS.into_iter().find(|symbol| rest.starts_with(symbol)) {
            words.push((Token::Symbol(symbol), at..at + symbol.len()));
            at += symbol.len();
        } else {
            return Err(match (first, words.last()) {
                ('.', Some((Token::Name(of), span))) => part(of, &rest[1..], span.start),
                ('=', _) if left_side(&text[..at]).is_some() => equation(&text[..at]),
                _ => stray(first, at),
            });
        }
    }
    Ok(words)
}

/// The name whose rate stands on the left of an equation: the `x` of `x'`, `x''` or `dx/dt`, or of `x` alone, with the
/// order of the derivative.
fn left_side(text: &str) -> Option<(&str, usize)> {
    let text = text.trim();
    let rate = text.strip_suffix("/dt").and_then(|text| text.strip_prefix('d'));
    let base = rate.unwrap_or(text).trim_end_matches('\'');
    let order = if rate.is_some() { 1 } else { text.len() - base.len() };
    let named = base.starts_with(|c: char| c.is_alphabetic() || c == '_');
    (named && base.chars().all(|c| c.is_alphanumeric() || c == '_')).then_some((base, order))
}

/// Complaint about an equation with its left-hand side, `left`, where only the right-hand side belongs.
fn equation(left: &str) -> Complaint {
    let hint = match left_side(left) {
        Some((base, 2)) => format!("give the acceleration as a state: `\"{base}''\" = \"…\"` under [states]"),
        Some((base, order)) if order > 2 => first_order_form(base, order),
        _ => format!("remove `{} =`", left.trim()),
    };
    Complaint::new(
        left.len() - left.trim_start().len()..left.len() + 1,
        "an equation has only its right-hand side here",
        hint,
    )
}

/// Says how an equation for a derivative of order above two is written, with a state for each lower derivative.
///
/// ```
/// let said = foldline::model::first_order_form("x", 3);
/// assert!(said.contains("`x = \"x1\"`, `x1 = \"x2\"` and `x2 = \"…\"`"));
/// ```
pub fn first_order_form(base: &str, order: usize) -> String {
    let names: Vec<String> =
        std::iter::once(base.to_string()).chain((1..order).map(|k| format!("{base}{k}"))).collect();
    let steps: Vec<String> = names.windows(2).map(|pair| format!("`{} = \"{}\"`", pair[0], pair[1])).collect();
    let last = names.last().map_or(base, String::as_str);
    format!(
        "write it in first-order form, with a state for each derivative: {} and `{last} = \"…\"` under [states]",
        steps.join(", ")
    )
}

/// Value and length of the number at the start of `rest`.
fn number(rest: &str, at: usize) -> Result<(f64, usize), Complaint> {
    let digits = |from: usize| from + rest[from..].bytes().take_while(u8::is_ascii_digit).count();
    let mut end = digits(0);
    if rest[end..].starts_with('.') {
        end = digits(end + 1);
    }
    if rest[end..].starts_with(['e', 'E']) {
        let sign = usize::from(rest[end + 1..].starts_with(['+', '-']));
        let exponent = digits(end + 1 + sign);
        if exponent > end + 1 + sign {
            end = exponent;
        }
    }
    match rest[..end].parse::<f64>() {
        Ok(value) if value.is_finite() => Ok((value, end)),
        _ => Err(Complaint::new(
            at..at + end,
            format!("`{}` is too large for a number", &rest[..end]),
            "the largest number is about 1.8e308",
        )),
    }
}

fn glued(number: &str, next: char, rest: &str, span: Range<usize>) -> Complaint {
    if next == '.' {
        return Complaint::new(span, "a number with two decimal points", "write one decimal point, as in 1.5");
    }
    let name: String = rest.chars().take_while(|&c| c.is_alphanumeric() || c == '_').collect();
    let digits = name.strip_prefix('_').filter(|own| own.starts_with(|c: char| c.is_ascii_digit()));
    let hint = match digits {
        Some(digits) => format!("write numbers without `_`: `{number}{digits}`"),
        None => format!("write a product with a star: `{number}*{name}`"),
    };
    Complaint::new(span, format!("the number `{number}` runs into `{name}`"), hint)
}

/// A name with a part, such as `np.sin` or `p.mu`; `rest` follows the dot.
fn part(of: &str, rest: &str, start: usize) -> Complaint {
    let name: String = rest.chars().take_while(|&c| c.is_alphanumeric() || c == '_').collect();
    let end = start + of.len() + 1 + name.len();
    let hint = match (name.is_empty(), rest[name.len()..].starts_with('(')) {
        (true, _) => "remove the dot".to_string(),
        (false, true) => format!("write the function alone: `{name}(…)`"),
        (false, false) => format!("write the name alone: `{name}`"),
    };
    Complaint::new(start..end, format!("`{of}.{name}`: a name has no parts"), hint)
}

fn stray(found: char, at: usize) -> Complaint {
    let hint = match found {
        '=' => "compare with `==`; an equation has only its right-hand side here",
        '{' | '}' => "write round brackets ( ), or square ones for an index, as in `x[i+1]`",
        '&' => "combine conditions with `*` for and, `max(a, b)` for or",
        '|' => "write `abs(x)` for an absolute value; conditions are combined with `max(a, b)` for or",
        '?' | ':' => "write `if(condition, then, else)`",
        '!' | '~' | '¬' => "the opposite of a condition `c` is `1 - (c)`",
        '%' => "write `mod(a, b)` for a remainder",
        ';' => "an equation is a single expression; remove the semicolon",
        '\\' => "write the function by its name, as in `sin(x)`",
        '÷' => "write `/` for a quotient",
        '\'' => "a rate is written `x'`, and `x'[i]` where x has an index",
        '@' => "under [boundary], a state `x` is written `x@0` at the beginning of the interval and `x@1` at its end",
        '×' | '·' => "write `*` for a product",
        '−' | '–' => "write a plain minus sign `-`",
        _ => "an expression consists of numbers, names, + - * / ^ ( ) , and comparisons",
    };
    Complaint::new(at..at + found.len_utf8(), format!("unexpected character `{found}`"), hint)
}
