//! Repetition over an index: `count`, `index`, `before`, `after`, `periodic`.

use super::{Reader, inside};
use crate::toml_walk::Value;
use foldline::model::{Constant, Ends, Field, Item, ModelError, Repeat, constant_value};
use toml::de::{DeTable, DeValue};

/// Largest count accepted here; the model has stricter limits.
const MOST: f64 = 1e9;

impl Reader<'_> {
    /// Reads the repetition of an item; `listed` is the number of values if they are listed.
    pub(super) fn repeat(
        &mut self,
        item: Item,
        table: &DeTable,
        what: &str,
        constants: &[Constant],
        listed: Option<usize>,
    ) -> Option<Repeat> {
        let count = match table.get("count") {
            Some(value) => Some(self.count(item, value, what, constants)?),
            None => listed,
        };
        let Some(count) = count else {
            for key in ["index", "before", "after", "periodic"] {
                if let Some(value) = table.get(key) {
                    let message = format!("{what} has `{key}`, but no `count`");
                    self.walk.report(value.span(), message, "give the number of elements: `count = 40`");
                }
            }
            return None;
        };
        let mut repeat = Repeat::new(count);
        if let Some(value) = table.get("index") {
            self.places.insert((item, Field::Index), value.span());
            repeat.index = self.walk.string(value, "`index`").unwrap_or(repeat.index);
        }
        repeat.ends = self.ends(item, table, what);
        Some(repeat)
    }

    /// Reads a positive integer, or an expression in constants with such a value.
    fn count(&mut self, item: Item, value: &Value, what: &str, constants: &[Constant]) -> Option<usize> {
        self.places.insert((item, Field::Count), value.span());
        let number = match value.get_ref() {
            DeValue::String(text) => match constant_value(text, constants) {
                Ok(number) => Some(number),
                Err(error) => {
                    self.misread(value, &error);
                    None
                }
            },
            _ => self.walk.number(value, "`count`"),
        };
        let whole = number.filter(|n| n.fract() == 0.0 && (1.0..=MOST).contains(n));
        if let (Some(number), None) = (number, whole) {
            let message = format!("the count of {what} is {number}");
            let hint = match number > MOST {
                true => {
                    "reduce it: a model can have up to 1000 states, and up to 100000 each of parameters, definitions \
                     and outputs"
                }
                false => "a count is a positive integer",
            };
            self.walk.report(value.span(), message, hint);
        }
        self.incomplete |= whole.is_none();
        whole.map(|number| number as usize)
    }

    /// Reads `periodic`, or `before` and `after`.
    pub(super) fn ends(&mut self, item: Item, table: &DeTable, what: &str) -> Ends {
        let periodic = table.get("periodic").map(|value| (value.span(), value.get_ref().as_bool()));
        match periodic {
            Some((span, None)) => {
                self.walk.report(span, "`periodic` is neither true nor false", "write `periodic = true`")
            }
            Some((span, Some(true))) => {
                if table.get("before").is_some() || table.get("after").is_some() {
                    let message = format!("{what} is periodic, but also has values beyond its ends");
                    self.walk.report(span, message, "keep either `periodic = true`, or `before` and `after`");
                }
                return Ends::Periodic;
            }
            _ => {}
        }
        let mut side = |key: &str, field: fn(usize) -> Field| {
            table.get(key).map_or_else(Vec::new, |value| self.beyond(item, value, key, field))
        };
        Ends::Given { before: side("before", Field::Before), after: side("after", Field::After) }
    }

    /// Reads one expression, or a list of them, nearest to the end first.
    fn beyond(&mut self, item: Item, value: &Value, key: &str, field: fn(usize) -> Field) -> Vec<String> {
        let list: Vec<&Value> = match value.get_ref() {
            DeValue::Array(list) => list.iter().collect(),
            _ => vec![value],
        };
        let mut texts = Vec::with_capacity(list.len());
        for (k, own) in list.into_iter().enumerate() {
            self.places.insert((item, field(k)), own.span());
            let text = match own.get_ref() {
                DeValue::Integer(_) | DeValue::Float(_) => {
                    self.walk.number(own, &format!("`{key}`")).map(|number| format!("{number:?}"))
                }
                _ => self.walk.string(own, &format!("`{key}`")),
            };
            texts.push(text.unwrap_or_else(|| "0".into()));
        }
        texts
    }

    /// Reports a mistake in an expression in constants at its position in the file.
    pub(super) fn misread(&mut self, value: &Value, error: &ModelError) {
        let place = error.span.clone().and_then(|span| inside(self.text, &value.span(), &span)).unwrap_or(value.span());
        self.walk.report(place, error.message.clone(), error.hint.clone());
    }
}
