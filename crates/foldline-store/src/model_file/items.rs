//! Constants, parameters, definitions and outputs.

use super::Reader;
use crate::toml_walk::{Value, Walk};
use foldline::model::{Constant, Definition, Field, Item, ModelSource, Output, Parameter, Spread, constant_value};
use foldline::units::quantity;
use std::ops::Range;
use toml::de::DeValue;

impl Reader<'_> {
    /// Reads a number, or an expression in the preceding constants.
    pub(super) fn constant(&mut self, name: String, place: Range<usize>, value: &Value, source: &mut ModelSource) {
        let what = format!("the constant `{name}`");
        self.places.insert((Item::Constant(source.constants.len()), Field::Name), place);
        let mut unit = "1".to_string();
        let number = match value.get_ref() {
            DeValue::String(text) if quantity(text).is_some() => {
                let item = Item::Constant(source.constants.len());
                self.measure(item, value, &what, &mut unit)
            }
            DeValue::String(text) => match constant_value(text, &source.constants) {
                Ok(number) => Some(number),
                Err(error) => {
                    self.misread(value, &error);
                    None
                }
            },
            _ => self.walk.number(value, &what),
        };
        // A constant may be a count, so errors that follow from it would be misleading.
        self.incomplete |= number.is_none();
        source.constants.push(Constant { name, unit, value: number.unwrap_or(1.0) });
    }

    /// Reads a number, a list of numbers, or an expression in other parameters, which becomes a definition.
    pub(super) fn parameter(&mut self, name: String, place: Range<usize>, value: &Value, source: &mut ModelSource) {
        let what = format!("the parameter `{name}`");
        let inner = value.get_ref().as_table().and_then(|table| table.get("value")).unwrap_or(value);
        let expression = |text: &str| text.trim().parse::<f64>().is_err() && quantity(text).is_none();
        if inner.get_ref().as_str().is_some_and(expression) {
            if let DeValue::Table(table) = value.get_ref() {
                self.walk.only(table, &["value", "unit", "description"], &what);
            }
            let expression = self.expression(Item::Definition(source.definitions.len()), place, inner, &what);
            source.definitions.push(Definition::new(&name, &expression));
            return;
        }
        let item = Item::Parameter(source.parameters.len());
        self.places.insert((item, Field::Name), place.clone());
        let mut parameter = Parameter::new(&name, 0.0);
        let before = self.walk.found.len();
        let number = match value.get_ref() {
            DeValue::Table(table) => {
                const KEYS: [&str; 13] = [
                    "value",
                    "values",
                    "unit",
                    "description",
                    "scale",
                    "sigma",
                    "low",
                    "high",
                    "count",
                    "index",
                    "before",
                    "after",
                    "periodic",
                ];
                self.walk.only(table, &KEYS, &what);
                (parameter.unit, parameter.description) = self.labels(item, table);
                if let Some(values) = table.get("values") {
                    self.values(item, &mut parameter, values);
                }
                let listed = Some(parameter.values.len()).filter(|count| *count > 0);
                parameter.repeat = self.repeat(item, table, &what, &source.constants, listed);
                table.get("value").or(table.get("values"))
            }
            DeValue::Array(_) => {
                self.values(item, &mut parameter, value);
                let listed = Some(parameter.values.len());
                parameter.repeat = listed.map(foldline::model::Repeat::new);
                Some(value)
            }
            _ => Some(value),
        };
        match number {
            Some(_) if !parameter.values.is_empty() => parameter.value = parameter.values[0],
            Some(number) if number.get_ref().as_array().is_none() => {
                self.places.insert((item, Field::Value), number.span());
                parameter.value = self.measure(item, number, &what, &mut parameter.unit).unwrap_or(0.0);
            }
            Some(_) => {}
            // A misspelt key has been reported, and is probably the missing one.
            None if self.walk.found.len() > before => {}
            None => {
                self.walk.report(place, format!("{what} has no value"), format!("write `{name} = {{ value = 1.0 }}`"));
            }
        }
        if let Some(value) = value.get_ref().as_table().and_then(|table| table.get("scale")) {
            self.places.insert((item, Field::Scale), value.span());
            parameter.scale = self.measure(item, value, &format!("the scale of `{name}`"), &mut parameter.unit);
        }
        if let DeValue::Table(table) = value.get_ref() {
            let name = parameter.name.clone();
            let unit = &mut parameter.unit;
            let numbers = ["sigma", "low", "high"].map(|key| {
                let value = table.get(key)?;
                Some((value.span(), self.measure(item, value, &format!("`{key}` of `{name}`"), unit)?))
            });
            parameter.spread = spread(&mut self.walk, &name, numbers);
        }
        source.parameters.push(parameter);
    }

    /// Reads a value for each element.
    fn values(&mut self, item: Item, parameter: &mut Parameter, value: &Value) {
        let what = format!("the values of `{}`", parameter.name);
        self.places.insert((item, Field::Value), value.span());
        parameter.values = self.measures(item, value, &what, &mut parameter.unit);
        if parameter.values.is_empty() {
            self.incomplete = true;
        }
    }

    /// Reads a list of numbers; returns an empty list after a mistake.
    pub(super) fn numbers(&mut self, value: &Value, what: &str) -> Vec<f64> {
        self.listed(value, what, |reader, own| reader.walk.number(own, what))
    }

    /// Reads a list of numbers that may have units.
    fn measures(&mut self, item: Item, value: &Value, what: &str, unit: &mut String) -> Vec<f64> {
        self.listed(value, what, |reader, own| reader.measure(item, own, what, unit))
    }

    fn listed(
        &mut self,
        value: &Value,
        what: &str,
        mut read: impl FnMut(&mut Self, &Value) -> Option<f64>,
    ) -> Vec<f64> {
        let before = self.walk.found.len();
        let Some(list) = value.get_ref().as_array().filter(|list| !list.is_empty()) else {
            self.walk.report(value.span(), format!("{what} are not a list of numbers"), "write `[1.0, 2.0, 3.0]`");
            return Vec::new();
        };
        let numbers: Vec<f64> = list.iter().map_while(|own| read(self, own)).collect();
        if self.walk.found.len() > before { Vec::new() } else { numbers }
    }

    /// Reads an expression, or a table that contains it.
    pub(super) fn definition(&mut self, name: String, place: Range<usize>, value: &Value, source: &mut ModelSource) {
        let what = format!("the definition `{name}`");
        let item = Item::Definition(source.definitions.len());
        let mut definition = Definition::new(&name, "0");
        match value.get_ref() {
            DeValue::Table(table) => {
                const KEYS: [&str; 7] = ["expression", "description", "count", "index", "before", "after", "periodic"];
                let before = self.walk.found.len();
                self.walk.only(table, &KEYS, &what);
                let misspelt = self.walk.found.len() > before;
                self.places.insert((item, Field::Name), place.clone());
                definition.repeat = self.repeat(item, table, &what, &source.constants, None);
                match table.get("expression") {
                    Some(value) => definition.expression = self.expression(item, place, value, &what),
                    None if misspelt => {}
                    None => self.no_expression(place, &name, &what),
                }
            }
            _ => definition.expression = self.expression(item, place, value, &what),
        }
        source.definitions.push(definition);
    }

    pub(super) fn output(
        &mut self,
        i: usize,
        name: String,
        place: Range<usize>,
        value: &Value,
        constants: &[Constant],
    ) -> Output {
        let what = format!("the output `{name}`");
        let item = Item::Output(i);
        let mut output = Output::new(&name, "0");
        let DeValue::Table(table) = value.get_ref() else {
            output.expression = self.expression(item, place, value, &what);
            return output;
        };
        let before = self.walk.found.len();
        self.walk.only(table, &["expression", "unit", "description", "count", "index"], &what);
        let misspelt = self.walk.found.len() > before;
        (output.unit, output.description) = self.labels(item, table);
        self.places.insert((item, Field::Name), place.clone());
        output.repeat = self.repeat(item, table, &what, constants, None);
        match table.get("expression") {
            Some(value) => output.expression = self.expression(item, place, value, &what),
            None if misspelt => {}
            None => self.no_expression(place, &name, &what),
        }
        output
    }

    fn no_expression(&mut self, place: Range<usize>, name: &str, what: &str) {
        let hint = format!("write `{name} = \"…\"` or give the table a key `expression`");
        self.walk.report(place, format!("{what} has no expression"), hint);
    }
}

/// A number with its place in the text.
type Placed = Option<(Range<usize>, f64)>;

/// Distribution of an uncertain parameter, given `sigma`, `low` and `high`.
pub(crate) fn spread(walk: &mut Walk, name: &str, numbers: [Placed; 3]) -> Option<Spread> {
    const HINT: &str = "write `sigma = 0.1` for a standard deviation, or `low = 0.9, high = 1.1` for a range";
    let mut wrong = |place: &Range<usize>, message: String| {
        walk.report(place.clone(), message, HINT);
        None
    };
    match numbers {
        [None, None, None] => None,
        [Some((_, sigma)), None, None] if sigma > 0.0 => Some(Spread::Normal(sigma)),
        [Some((place, _)), None, None] => wrong(&place, format!("`sigma` of `{name}` is not positive")),
        [None, Some((_, low)), Some((_, high))] if low < high => Some(Spread::Uniform([low, high])),
        [None, Some((place, _)), Some(_)] => wrong(&place, format!("`low` of `{name}` is not below `high`")),
        [Some((place, _)), ..] => wrong(&place, format!("`{name}` has a standard deviation and a range")),
        [None, Some((place, _)), None] => wrong(&place, format!("`{name}` has `low` but no `high`")),
        [None, None, Some((place, _))] => wrong(&place, format!("`{name}` has `high` but no `low`")),
    }
}
