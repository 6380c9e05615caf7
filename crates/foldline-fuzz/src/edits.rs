//! Random edits of valid texts.

use arbitrary::{Result, Unstructured};

/// Pieces of text that have a meaning in some format, or must be rejected.
const PIECES: [&str; 74] = [
    "nan",
    "inf",
    "-inf",
    "1e999",
    "-1e308",
    "1e-400",
    "99999999999999999999",
    "0x10",
    "1_000",
    "-0.0",
    "0",
    "true",
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "\"",
    "'''",
    "\"\"\"",
    "\\",
    "\\u0000",
    "=",
    "==",
    ",",
    ".",
    "\n",
    "\r",
    "\t",
    "#",
    "(",
    ")",
    "((((((((",
    "^",
    "**",
    "^-",
    "<",
    "!=",
    "if(",
    "heaviside(",
    "hypot(",
    "pi",
    "t",
    "0^0",
    "/0",
    "µ",
    "Ω",
    "\u{202e}",
    "\u{feff}",
    "é",
    "𝛀",
    "[seed]",
    "[[branch]]",
    "range = [1, -1]",
    "from = \"x\"",
    "[states]",
    "until = 0",
    "x[i-1]",
    "[i+1]",
    "'",
    "x''",
    "sum(j, 1, n, ",
    "floor(",
    "mod(",
    "exprel(",
    "count = 3\n",
    "count = 1000000000\n",
    "before = \"0\"\n",
    "periodic = true\n",
    "[constants]\n",
    "[functions]\n\"f(x)\" = \"x\"\n",
    "[mass]\nx = 2\n",
    "[tables.k]\nx = [0, 1]\ny = [1, 2]\n",
];

/// Applies a few edits to a text: insertion, deletion, duplication and replacement of pieces.
pub fn edited(u: &mut Unstructured, text: &str) -> Result<String> {
    let mut text = text.to_string();
    for _ in 0..u.int_in_range(1..=6u8)? {
        let (from, to) = range(u, &text)?;
        match u.int_in_range(0..=5u8)? {
            0 => text.replace_range(from..to, ""),
            1 => text.insert_str(from, u.choose(&PIECES)?),
            2 => text.replace_range(from..to, u.choose(&PIECES)?),
            3 => {
                let piece = text[from..to].to_string();
                let (at, _) = range(u, &text)?;
                text.insert_str(at, &piece);
            }
            4 => {
                let (first, last) = line(&text, from);
                let piece = text[first..last].to_string();
                let times = u.int_in_range(0..=3usize)?;
                text.replace_range(first..last, &piece.repeat(times));
            }
            _ => {
                let letter: char = u.arbitrary()?;
                text.insert(from, letter);
            }
        }
    }
    Ok(text)
}

/// Returns a short random range that begins and ends at character boundaries.
fn range(u: &mut Unstructured, text: &str) -> Result<(usize, usize)> {
    let boundary = |at: usize| (0..=at.min(text.len())).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0);
    let from = boundary(u.int_in_range(0..=text.len())?);
    let to = boundary(from + u.int_in_range(0..=40usize)?).max(from);
    Ok((from, to))
}

/// Returns the range of the line around `at`, including its line end.
fn line(text: &str, at: usize) -> (usize, usize) {
    let first = text[..at].rfind('\n').map_or(0, |end| end + 1);
    (first, text[at..].find('\n').map_or(text.len(), |end| at + end + 1))
}
