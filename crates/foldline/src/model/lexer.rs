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
        } else if rest.starts_with("**") {
            return Err(Complaint::new(at..at + 2, "`**` is not an operator", "write `^` for a power"));
        } else if let Some(symbol) = SYMBOLS.into_iter().find(|symbol| rest.starts_with(symbol)) {
            words.push((Token::Symbol(symbol), at..at + symbol.len()));
            at += symbol.len();
        } else {
            return Err(stray(first, at));
        }
    }
    Ok(words)
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
    Complaint::new(
        span,
        format!("the number `{number}` runs into `{name}`"),
        format!("write a product with a star: `{number}*{name}`"),
    )
}

fn stray(found: char, at: usize) -> Complaint {
    let hint = match found {
        '=' => "compare with `==`; an equation has only its right-hand side here",
        '{' | '}' => "write round brackets ( ), or square ones for an index, as in `x[i+1]`",
        '&' | '|' => "combine conditions with `*` for and, `max(a, b)` for or",
        '\'' => "a rate is written `x'`, and `x'[i]` where x has an index",
        '@' => "under [boundary], a state `x` is written `x@0` at the beginning of the interval and `x@1` at its end",
        '×' | '·' => "write `*` for a product",
        '−' | '–' => "write a plain minus sign `-`",
        _ => "an expression consists of numbers, names, + - * / ^ ( ) , and comparisons",
    };
    Complaint::new(at..at + found.len_utf8(), format!("unexpected character `{found}`"), hint)
}
