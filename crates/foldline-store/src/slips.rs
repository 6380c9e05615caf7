//! Slips in TOML: what a line that cannot be parsed most likely means.
//!
//! **Idea.** The parser says which symbol it expected. Whoever writes a first model needs the line as it should be, which
//! follows from the line as it is: a value without quotes, a decimal comma, a comment of another language.

use foldline::model::constant_value;
use std::ops::Range;

/// Message in place of that of the parser, if that one says little, and the correction.
pub(crate) struct Slip {
    pub(crate) message: Option<String>,
    pub(crate) cure: String,
}

/// Files of other programs, by extension, and what they are.
const LANGUAGES: [(&[&str], &str); 8] = [
    (&["py", "ipynb"], "Python"),
    (&["m", "mlx"], "MATLAB"),
    (&["f", "f90", "for"], "Fortran"),
    (&["c", "cpp", "h"], "C"),
    (&["jl"], "Julia"),
    (&["json"], "JSON"),
    (&["yml", "yaml"], "YAML"),
    (&["md", "markdown", "rst"], "Markdown"),
];

const GENERAL: &str = "the file must be TOML: `key = value`, `[table]`, `[[list]]`; strings are in quotes";

/// Recognises the slip at `span` of the text of a file; `message` is that of the parser.
pub(crate) fn slip(text: &str, file: &str, span: &Range<usize>, message: &str) -> Slip {
    let start = (0..=span.start.min(text.len())).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0);
    let begin = text[..start].rfind('\n').map_or(0, |end| end + 1);
    let line = text[begin..].lines().next().unwrap_or("");
    let found = foreign(file)
        .or_else(|| twice(text, span, message))
        .or_else(|| marks(line))
        .or_else(|| comment(line))
        .or_else(|| assignment(line));
    found.unwrap_or_else(|| Slip { message: None, cure: GENERAL.to_string() })
}

fn cured(cure: impl Into<String>) -> Option<Slip> {
    Some(Slip { message: None, cure: cure.into() })
}

fn told(message: impl Into<String>, cure: impl Into<String>) -> Option<Slip> {
    Some(Slip { message: Some(message.into()), cure: cure.into() })
}

/// A file in another language.
fn foreign(file: &str) -> Option<Slip> {
    let end = std::path::Path::new(file).extension()?.to_str()?.to_lowercase();
    let (_, language) = LANGUAGES.iter().find(|(ends, _)| ends.contains(&end.as_str()))?;
    let cure = match *language {
        "Python" => {
            "`foldline new oscillator` writes an example; a model written as a Python function is used from Python, with `@foldline.model`"
        }
        "Fortran" | "C" => {
            "`foldline new oscillator` writes an example; `foldline import-auto` reads an equations file of AUTO-07p"
        }
        _ => "`foldline new oscillator` writes an example",
    };
    told(format!("this is a {language} file; models and studies are written in TOML"), cure)
}

/// A key or table that stands twice.
fn twice(text: &str, span: &Range<usize>, message: &str) -> Option<Slip> {
    let key = text.get(span.clone()).filter(|_| message.contains("duplicate key"))?;
    told(format!("`{key}` is given twice"), "keep one of the two")
}

/// Typographic quotation marks, and text or a header that is not closed.
fn marks(line: &str) -> Option<Slip> {
    let head = line.trim();
    if head.starts_with('[') && !head.contains(']') && !head.contains('=') {
        return told(
            "the square bracket is not closed",
            format!("write `{head}{}`", if head.starts_with("[[") { "]]" } else { "]" }),
        );
    }
    if let Some(mark) = line.chars().find(|c| matches!(c, '“' | '”' | '„' | '‘' | '’' | '«' | '»')) {
        return told(
            format!("the quotation mark `{mark}` is not a straight one"),
            "write straight quotation marks: `\"…\"`",
        );
    }
    let text = line.split_once('=')?.1.trim_start();
    if text.starts_with('"') && text.contains('\\') {
        return cured(
            "a backslash begins an escape: write a path with `/`, or in single quotes, as in `'sub\\model.toml'`",
        );
    }
    let open = text.starts_with('"') && !text.starts_with("\"\"\"") && text.matches('"').count() == 1;
    if open { told("the quotation mark is not closed", "add the missing `\"` after the text") } else { None }
}

/// A comment of another language: a whole line, or after a value that is a number or ends in a quotation mark.
fn comment(line: &str) -> Option<Slip> {
    let whole = ["//", "%", "--", "/*", "!", ";"].into_iter().find(|sign| line.trim_start().starts_with(sign));
    let after = || {
        let value = line.split_once('=')?.1;
        ["//", "%"].into_iter().find(|sign| {
            let value = value.split_once(sign).map_or("", |(before, _)| before.trim());
            value.parse::<f64>().is_ok() || value.ends_with(['"', ']'])
        })
    };
    let sign = whole.or_else(after)?;
    told(format!("`{sign}` does not begin a comment"), "write comments with `#`")
}

/// Largest number of words of a name.
const LABEL: usize = 4;

/// A line `key = value` with a slip in the key or the value.
fn assignment(line: &str) -> Option<Slip> {
    // A key of more words than a label has is a sentence.
    if line.split(['=', ':']).next().is_some_and(|key| key.split_whitespace().count() > LABEL) {
        return None;
    }
    let Some((key, value)) = line.split_once('=') else {
        let (key, value) = line.split_once(':')?;
        return cured(format!("write `{} = {}`", key.trim(), quoted_if_text(uncommented(value).unwrap_or("…"))));
    };
    let key = key.trim();
    if let Some((key, _)) = key.split_once(':') {
        return cured(format!("write `{} = …`", key.trim()));
    }
    let bare = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.' | ' ' | '"' | '\'');
    let marked = !key.is_empty() && !key.starts_with(['"', '\'', '[', '{']);
    if marked && (!key.chars().all(bare) || key.ends_with(['\'', ']', ')'])) {
        return cured(format!("write the name in quotes: `\"{key}\" = …`"));
    }
    let Some(value) = uncommented(value) else {
        return told(format!("`{key}` has no value"), format!("write one after the sign: `{key} = …`"));
    };
    if let Some(value) = value.strip_suffix(';').or_else(|| value.strip_suffix(',')) {
        return cured(format!("remove the sign at the end: `{key} = {}`", value.trim_end()));
    }
    if let Some(list) = value.strip_prefix('(').and_then(|list| list.strip_suffix(')')) {
        return cured(format!("write a list in square brackets: `{key} = [{list}]`"));
    }
    if let Some(number) = number(value) {
        return cured(format!("write `{key} = {number}`"));
    }
    if let Some(number) = computed(value) {
        return told(format!("the value of `{key}` is a formula"), format!("write its value: `{key} = {number}`"));
    }
    if let Some(list) = value.strip_prefix('[').and_then(|list| list.strip_suffix(']')) {
        let entries: Option<Vec<String>> = list.split(',').map(computed).collect();
        if let Some(entries) = entries {
            let cure = format!("write their values: `{key} = [{}]`", entries.join(", "));
            return told(format!("an entry of `{key}` is not written as a number of TOML"), cure);
        }
    }
    // Other lists, tables and text in quotes have mistakes of other kinds.
    let plain = !value.starts_with(['[', '{', '"', '\'']) && !value.contains('"');
    plain.then(|| Slip {
        message: Some(format!("the value of `{key}` is text without quotes")),
        cure: format!("write `{key} = \"{value}\"`"),
    })
}

/// The value of a line, without a comment; `None` if nothing is left.
fn uncommented(value: &str) -> Option<&str> {
    let value = value.split('#').next().unwrap_or("").trim();
    (!value.is_empty()).then_some(value)
}

fn quoted_if_text(value: &str) -> String {
    let is_value = value.starts_with(['[', '{', '"', '\'']) || value.parse::<f64>().is_ok() || value == "…";
    if is_value { value.to_string() } else { format!("\"{value}\"") }
}

/// The value of a formula without names, such as `1/2` or `2*pi`, as TOML writes it.
fn computed(formula: &str) -> Option<String> {
    constant_value(formula, &[]).ok().filter(|number| number.is_finite()).map(|number| format!("{number:?}"))
}

/// A number in a notation that TOML lacks, as TOML writes it: `0,5`, `.5`, `5.`, `1d-3`.
fn number(value: &str) -> Option<String> {
    let one_comma = value.matches(',').count() == 1 && !value.contains('.');
    let plain = if one_comma { value.replace(',', ".") } else { value.replace(['d', 'D'], "e") };
    if !plain.chars().all(|c| c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E' | '+' | '-')) {
        return None;
    }
    plain.parse::<f64>().ok().filter(|number| number.is_finite())?;
    let (sign, rest) = match plain.strip_prefix(['+', '-']) {
        Some(rest) => (&plain[..1], rest),
        None => ("", &plain[..]),
    };
    let (digits, exponent) = match rest.find(['e', 'E']) {
        Some(at) => rest.split_at(at),
        None => (rest, ""),
    };
    let lead = if digits.starts_with('.') { "0" } else { "" };
    let tail = if digits.ends_with('.') { "0" } else { "" };
    Some(format!("{sign}{lead}{digits}{tail}{exponent}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use toml::de::DeTable;

    /// The correction for a text that is not TOML.
    #[track_caller]
    fn cure(text: &str) -> String {
        let error = DeTable::parse(text).expect_err("the text is not TOML");
        slip(text, "model.toml", &error.span().unwrap_or(0..0), error.message()).cure
    }

    #[test]
    fn a_line_is_corrected_as_it_should_be_written() {
        for (line, right) in [
            ("mu = 0,5", "mu = 0.5"),
            ("mu = -.5", "mu = -0.5"),
            ("mu = 5.", "mu = 5.0"),
            ("mu = 1d-3 # as Fortran", "mu = 1e-3"),
            ("mu = 0.5;", "mu = 0.5"),
            ("mu = 1/2", "mu = 0.5"),
            ("mu = a/2", "mu = \"a/2\""),
            ("range = [-1, 1/2]", "range = [-1.0, 0.5]"),
            ("mu = 0.5 mm", "mu = \"0.5 mm\""),
            ("mu: 0.5", "mu = 0.5"),
            ("mu: x*y", "mu = \"x*y\""),
            ("free = mu", "free = \"mu\""),
            ("range = (-1, 2)", "range = [-1, 2]"),
        ] {
            let cure = cure(line);
            assert!(cure.ends_with(&format!("`{right}`")), "{line}: {cure}");
            assert!(DeTable::parse(right).is_ok(), "{right}");
        }
    }

    #[test]
    fn marks_and_comments_of_other_languages_are_recognised() {
        for (line, piece) in [
            ("x = “y”", "straight quotation marks"),
            ("x = \"y", "the missing `\"`"),
            ("[states.x", "`[states.x]`"),
            ("model = \"sub\\model.toml\"", "single quotes"),
            ("// a comment", "with `#`"),
            ("% a comment", "with `#`"),
            ("mu = 0.5 % a comment", "with `#`"),
            ("μ = 1", "`\"μ\" = …`"),
            ("dx/dt = \"y\"", "`\"dx/dt\" = …`"),
            ("mu =", "write one after the sign"),
            ("a = 1\na = 2", "keep one"),
            ("[a]\nb = 1\n[a]", "keep one"),
        ] {
            let cure = cure(line);
            assert!(cure.contains(piece), "{line}: {cure}");
        }
    }
}
