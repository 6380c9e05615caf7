//! Traversal of a TOML text that collects every mistake with its position.

use crate::diagnostic::Diagnostic;
use crate::elsewhere::{belongs, meant};
use crate::nearest::{nearest, suggest};
use crate::slips::{Slip, slip};
use foldline::model::unsupported;
use foldline::units::{self, Unit};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Largest number of mistakes reported for one file.
const MOST: usize = 100;
/// Length in characters to which messages are cut. Hints may be twice as long; the parts of a line are cut to fractions
/// of it.
const LONGEST: usize = 400;

/// Value with its position in the text.
pub(crate) type Value<'t> = Spanned<DeValue<'t>>;

/// Text being read, and the mistakes found so far.
pub(crate) struct Walk<'t> {
    file: &'t str,
    text: &'t str,
    pub(crate) found: Vec<Diagnostic>,
}

impl<'t> Walk<'t> {
    /// Parses a text and returns its root table. If it is not TOML, returns the parser's message and position.
    pub(crate) fn parse(text: &'t str, file: &'t str) -> Result<(Walk<'t>, DeTable<'t>), Vec<Diagnostic>> {
        let mut walk = Walk { file, text, found: Vec::new() };
        match DeTable::parse(text) {
            Ok(table) => Ok((walk, table.into_inner())),
            Err(error) => {
                let span = error.span().unwrap_or(0..0);
                let Slip { message, cure } = slip(text, file, &span, error.message());
                walk.report(span, message.unwrap_or_else(|| error.message().to_string()), cure);
                Err(walk.found)
            }
        }
    }

    /// Records a mistake; those after the first [`MOST`] are dropped.
    pub(crate) fn report(&mut self, span: Range<usize>, message: impl Into<String>, hint: impl Into<String>) {
        if self.found.len() == MOST {
            return;
        }
        self.found.push(diagnose(self.file, self.text, span, message.into(), hint.into()));
    }

    /// Reports every key of `table` that is not among `known`. Returns those of `known` that are meant instead.
    pub(crate) fn only<'k>(&mut self, table: &DeTable, known: &[&'k str], whose: &str) -> Vec<&'k str> {
        let mut missing = Vec::new();
        for key in table.keys() {
            let name: &str = key.get_ref();
            if known.contains(&name) {
                continue;
            }
            let absent = |own: &&str| !table.contains_key(*own);
            let (spelt, other) = (nearest(name, known.iter().copied()), meant(name, known).filter(absent));
            let instead = spelt.filter(absent).or(other);
            let (message, hint) = match (belongs(name, whose), unsupported(name), other) {
                (Some(place), ..) => (format!("unknown key `{name}` in {whose}"), place.to_string()),
                (.., Some(key)) if spelt.is_none() => {
                    (format!("unknown key `{name}` in {whose}"), format!("the key for this is `{key}`"))
                }
                (_, Some(kind), _) => (format!("`{name}` in {whose}: {}", kind.message), kind.instead.to_string()),
                _ => (format!("unknown key `{name}` in {whose}"), suggest(name, known)),
            };
            self.report(key.span(), message, hint);
            missing.extend(instead);
        }
        missing
    }

    /// Reads a finite number, integer or decimal.
    pub(crate) fn number(&mut self, value: &Value, what: &str) -> Option<f64> {
        let text = match value.get_ref() {
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str(),
            DeValue::Float(float) => float.as_str(),
            other => {
                self.wrong_type(value, other.type_str(), what, "a number");
                return None;
            }
        };
        match text.replace('_', "").parse::<f64>() {
            Ok(number) if number.is_finite() => Some(number),
            _ => {
                self.report(
                    value.span(),
                    format!("{what} is not a finite number"),
                    "write a number such as 1.5 or 1e-6",
                );
                None
            }
        }
    }

    /// Reads a number, or a number with a unit such as `"0.3 mm"`, which is converted to `unit`.
    pub(crate) fn quantity(&mut self, value: &Value, what: &str, unit: &str) -> Option<f64> {
        let Some(written) = value.get_ref().as_str().and_then(units::quantity) else {
            if value.get_ref().as_str().is_some() {
                let message = format!("{what} is neither a number nor a number with a unit");
                self.report(
                    value.span(),
                    message,
                    "write a number, or one with its unit in quotes, such as \"0.3 mm\"",
                );
                return None;
            }
            return self.number(value, what);
        };
        let (from, to) = (Unit::read(&written.unit), Unit::read(unit));
        let found = from.convert(written.value, &to);
        if let Err(why) = found {
            let declared = !matches!(unit, "" | "1" | "-");
            let (message, hint) = match declared {
                true => {
                    let message = format!("{what} is in {}, which cannot be converted to {unit}: {why}", written.unit);
                    (message, format!("give it in {unit}, or in a unit of the same dimension"))
                }
                false => {
                    let message = format!("{what} is in {}, but the model gives no unit for it", written.unit);
                    (
                        message,
                        format!(
                            "add the unit to the model, as in `unit = \"{}\"`, or give a plain number",
                            written.unit
                        ),
                    )
                }
            };
            self.report(value.span(), message, hint);
        }
        found.ok()
    }

    /// Reads an integer within `allowed`.
    pub(crate) fn integer(&mut self, value: &Value, what: &str, allowed: std::ops::RangeInclusive<u64>) -> Option<u64> {
        let DeValue::Integer(integer) = value.get_ref() else {
            self.wrong_type(value, value.get_ref().type_str(), what, "an integer");
            return None;
        };
        match u64::from_str_radix(&integer.as_str().replace('_', ""), integer.radix()) {
            Ok(number) if allowed.contains(&number) => Some(number),
            _ => {
                let message = format!("{what} is {}, out of range", integer.as_str());
                let hint = match *allowed.end() {
                    u64::MAX => format!("an integer from {} upwards", allowed.start()),
                    end => format!("an integer from {} to {end}", allowed.start()),
                };
                self.report(value.span(), message, hint);
                None
            }
        }
    }

    /// Reads `true` or `false`.
    pub(crate) fn boolean(&mut self, value: &Value, what: &str) -> Option<bool> {
        let found = value.get_ref().as_bool();
        if found.is_none() {
            self.wrong_type(value, value.get_ref().type_str(), what, "`true` or `false`");
        }
        found
    }

    /// Reads a non-empty string.
    pub(crate) fn string(&mut self, value: &Value, what: &str) -> Option<String> {
        match value.get_ref().as_str() {
            Some("") => {
                self.report(value.span(), format!("{what} is empty"), "write text between the quotes");
                None
            }
            Some(text) => Some(text.to_string()),
            None => {
                self.wrong_type(value, value.get_ref().type_str(), what, "text in quotes");
                None
            }
        }
    }

    /// Reads a table; reports any other type and returns `None`.
    pub(crate) fn table<'v, 'x>(&mut self, value: &'v Value<'x>, what: &str) -> Option<&'v DeTable<'x>> {
        let table = value.get_ref().as_table();
        if table.is_none() {
            self.wrong_type(value, value.get_ref().type_str(), what, "a table of `name = value`");
        }
        table
    }

    /// Reads the tables of a list `[[what]]`; an absent list is empty.
    pub(crate) fn tables<'v, 'x>(&mut self, root: &'v DeTable<'x>, what: &str) -> Vec<(Range<usize>, &'v DeTable<'x>)> {
        let Some(value) = root.get(what) else { return Vec::new() };
        let tables = value.get_ref().as_array().map(|list| {
            list.iter()
                .map(|item| item.get_ref().as_table().map(|table| (item.span(), table)))
                .collect::<Option<Vec<_>>>()
        });
        match tables {
            Some(Some(tables)) => tables,
            _ => {
                self.report(
                    value.span(),
                    format!("`{what}` is not a list of tables"),
                    format!("begin each with `[[{what}]]`"),
                );
                Vec::new()
            }
        }
    }

    fn wrong_type(&mut self, value: &Value, found: &str, what: &str, wanted: &str) {
        self.report(
            value.span(),
            format!("{what} is {}, not {wanted}", with_article(found)),
            format!("write {wanted}"),
        );
    }
}

/// The noun with its indefinite article: `a table`, `an array`.
pub(crate) fn with_article(noun: &str) -> String {
    let article = if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {noun}")
}

/// Returns a diagnostic for a byte range of a text. Of a long line, the part around the range is shown. Terminal
/// control characters are written as their code points.
pub(crate) fn diagnose(file: &str, text: &str, span: Range<usize>, message: String, hint: String) -> Diagnostic {
    let boundary = |at: usize| (0..=at.min(text.len())).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0);
    let start = boundary(span.start);
    let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
    let line_end = text[start..].find('\n').map_or(text.len(), |at| start + at);
    let end = boundary(span.end.clamp(start, line_end)).max(start);
    let (before, within) = (&text[line_start..start], &text[start..end]);
    let after = text[end..line_end].trim_end_matches(['\r', ' ', '\t']);
    let column = before.chars().count() + 1;
    let lead: String = match before.char_indices().rev().nth(LONGEST / 4) {
        Some((at, _)) => format!("…{}", &before[at..]),
        None => before.to_string(),
    };
    let (lead, within, after) =
        (visible(&lead), visible(&shortened(within, LONGEST / 2)), visible(&shortened(after, LONGEST / 4)));
    Diagnostic {
        file: file.to_string(),
        line: text[..start].matches('\n').count() + 1,
        column,
        mark: lead.chars().count(),
        length: within.trim_end().chars().count().max(1),
        snippet: format!("{lead}{within}{after}").trim_end().to_string(),
        message: visible(&shortened(&message, LONGEST)),
        hint: Some(visible(&shortened(&hint, 2 * LONGEST))),
    }
}

/// Cuts a text to at most `most` characters and marks the cut with `…`.
fn shortened(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_string(),
    }
}

/// Replaces control, zero-width and bidirectional formatting characters by their code points.
fn visible(text: &str) -> String {
    let hidden = |c: char| {
        let invisible =
            matches!(c, '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}');
        invisible || (c.is_control() && c != '\t')
    };
    if !text.contains(hidden) {
        return text.to_string();
    }
    text.chars().map(|c| if hidden(c) { c.escape_unicode().to_string() } else { c.to_string() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_around_the_mistake_is_shown_of_a_long_line() {
        let text = format!("a = 1\n{}bad{}\n", "x".repeat(5000), "y".repeat(5000));
        let at = 6 + 5000;
        let d = diagnose("f", &text, at..at + 3, "m".repeat(10_000), "h".into());
        assert_eq!((d.line, d.column, d.length), (2, 5001, 3));
        assert_eq!(d.snippet.chars().skip(d.mark).take(3).collect::<String>(), "bad");
        assert!(d.snippet.chars().count() < 500 && d.message.chars().count() < 500);
    }

    #[test]
    fn terminal_control_characters_are_written_as_code_points() {
        let text = "x = \u{1b}[31m\u{202e}y";
        let d = diagnose("f", text, 4..5, format!("unexpected {}", '\u{1b}'), "h".into());
        assert_eq!(d.snippet, "x = \\u{1b}[31m\\u{202e}y");
        assert_eq!((d.mark, d.length, d.message.as_str()), (4, 6, "unexpected \\u{1b}"));
    }
}
