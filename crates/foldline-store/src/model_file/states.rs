//! States with their first-order or second-order equations.

use super::Reader;
use crate::toml_walk::Value;
use foldline::model::{Definition, Ends, Field, Item, ModelSource, State, constant_value, first_order_form};
use std::ops::Range;
use toml::de::{DeTable, DeValue};

const KEYS: [&str; 11] =
    ["equation", "unit", "description", "scale", "range", "period", "count", "index", "before", "after", "periodic"];

impl Reader<'_> {
    /// Reads a state and its equation; `x''` declares two states, x and its velocity `x'`.
    pub(super) fn state(&mut self, name: String, place: Range<usize>, value: &Value, source: &mut ModelSource) {
        let base = name.strip_suffix("''").unwrap_or(&name);
        if base.ends_with('\'') {
            let own = base.trim_end_matches('\'');
            self.incomplete = true;
            let hint = match name.len() - own.len() {
                order if order > 2 => first_order_form(own, order),
                _ => format!("give the acceleration: `\"{own}''\" = \"…\"` declares `{own}` and `{own}'`"),
            };
            return self.walk.report(place, format!("`{name}` is not the name of a state"), hint);
        }
        let second = base.len() < name.len() || self.accelerated.contains(base);
        let item = Item::State(source.states.len());
        self.places.insert((item, Field::Name), place.clone());
        let mut state = State::new(base);
        let (mut velocity, mut misspelt) = (State::new(&format!("{base}'")), false);
        let table = value.get_ref().as_table();
        if let Some(table) = table {
            let before = self.walk.found.len();
            let known = [&KEYS[..], if second { &["velocity"] } else { &[] }].concat();
            self.walk.only(table, &known, &format!("the state `{name}`"));
            misspelt = self.walk.found.len() > before;
            self.sizes(item, &mut state, table);
            state.period = table.get("period").and_then(|value| self.period(item, &state.name, value, source));
            state.repeat = self.repeat(item, table, &format!("the state `{base}`"), &source.constants, None);
        }
        let text = table.map_or(Some(value), |table| table.get("equation"));
        let own = if second { velocity.name.clone() } else { base.to_string() };
        if second {
            let rate = state.repeat.as_ref().map_or_else(|| own.clone(), |repeat| format!("{own}[{}]", repeat.index));
            let item = Item::Equation(source.equations.len());
            self.places.insert((item, Field::Name), place.clone());
            source.equations.push(Definition::new(base, &rate));
        }
        let equation = Item::Equation(source.equations.len());
        if let Some(text) = text {
            let expression = self.expression(equation, place.clone(), text, &format!("the equation of `{name}`"));
            source.equations.push(Definition::new(&own, &expression));
        } else if misspelt {
            source.equations.push(Definition::new(&own, "0"));
        }
        if second {
            velocity.repeat = state.repeat.clone();
            let item = Item::State(source.states.len() + 1);
            self.places.insert((item, Field::Name), place);
            let table = table.and_then(|table| table.get("velocity")).and_then(|v| self.walk.table(v, "`velocity`"));
            if let Some(table) = table {
                let known = ["unit", "description", "scale", "range", "before", "after"];
                self.walk.only(table, &known, &format!("the velocity of `{base}`"));
                self.sizes(item, &mut velocity, table);
            }
            let given = table.filter(|table| table.get("before").is_some() || table.get("after").is_some());
            let ends = given.map(|table| self.ends(item, table, &format!("the velocity of `{base}`")));
            if let Some(repeat) = &mut velocity.repeat {
                repeat.ends = ends.unwrap_or_else(|| Ends::RateOf(base.to_string()));
            }
        }
        source.states.push(state);
        source.states.extend(second.then_some(velocity));
    }

    /// Reads unit, description, scale and range.
    fn sizes(&mut self, item: Item, state: &mut State, table: &DeTable) {
        (state.unit, state.description) = self.labels(item, table);
        if let Some(value) = table.get("scale") {
            self.places.insert((item, Field::Scale), value.span());
            state.scale = self.measure(item, value, &format!("the scale of `{}`", state.name), &mut state.unit);
        }
        if let Some(value) = table.get("range") {
            self.places.insert((item, Field::Range), value.span());
            state.range = self.pair(item, value, &format!("the range of `{}`", state.name), &mut state.unit);
        }
    }

    /// Reads the period of an angle: a number, or an expression in constants.
    fn period(&mut self, item: Item, name: &str, value: &Value, source: &ModelSource) -> Option<f64> {
        self.places.insert((item, Field::Period), value.span());
        match value.get_ref() {
            DeValue::String(text) => match constant_value(text, &source.constants) {
                Ok(number) => Some(number),
                Err(error) => {
                    self.misread(value, &error);
                    None
                }
            },
            _ => self.walk.number(value, &format!("the period of `{name}`")),
        }
    }

    /// Reads `[low, high]`.
    fn pair(&mut self, item: Item, value: &Value, what: &str, unit: &mut String) -> Option<[f64; 2]> {
        match value.get_ref().as_array().map(|list| (list.first(), list.get(1), list.len())) {
            Some((Some(low), Some(high), 2)) => {
                Some([self.measure(item, low, what, unit)?, self.measure(item, high, what, unit)?])
            }
            _ => {
                self.walk.report(value.span(), format!("{what} is not a pair of numbers"), "write `[-1.0, 1.0]`");
                None
            }
        }
    }
}
