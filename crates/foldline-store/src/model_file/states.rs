//! States with their equations, of first and second order, and the masses that couple them.

use super::Reader;
use crate::nearest::suggest;
use crate::toml_walk::Value;
use foldline::model::{Definition, Ends, Field, Item, Mass, ModelSource, State};
use std::ops::Range;
use toml::de::{DeTable, DeValue};

const KEYS: [&str; 10] =
    ["equation", "unit", "description", "scale", "range", "count", "index", "before", "after", "periodic"];

impl Reader<'_> {
    /// A state and its equation; `x''` stands for two: x, and its velocity `x'`.
    pub(super) fn state(&mut self, name: String, place: Range<usize>, value: &Value, source: &mut ModelSource) {
        let base = name.strip_suffix("''").unwrap_or(&name);
        if base.ends_with('\'') {
            let own = base.trim_end_matches('\'');
            self.incomplete = true;
            let hint = format!("give the acceleration: `\"{own}''\" = \"…\"` declares `{own}` and `{own}'`");
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
            velocity.unit = "1".into();
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

    /// Unit, description, scale and range.
    fn sizes(&mut self, item: Item, state: &mut State, table: &DeTable) {
        (state.unit, state.description) = self.labels(table);
        if let Some(value) = table.get("scale") {
            self.places.insert((item, Field::Scale), value.span());
            state.scale = self.walk.number(value, &format!("the scale of `{}`", state.name));
        }
        if let Some(value) = table.get("range") {
            self.places.insert((item, Field::Range), value.span());
            state.range = self.pair(value, &format!("the range of `{}`", state.name));
        }
    }

    /// `[low, high]`.
    fn pair(&mut self, value: &Value, what: &str) -> Option<[f64; 2]> {
        match value.get_ref().as_array().map(|list| (list.first(), list.get(1), list.len())) {
            Some((Some(low), Some(high), 2)) => Some([self.walk.number(low, what)?, self.walk.number(high, what)?]),
            _ => {
                self.walk.report(value.span(), format!("{what} is not a pair of numbers"), "write `[-1.0, 1.0]`");
                None
            }
        }
    }

    /// The rows of the mass matrix, each a number or a table with an entry for each state that takes part.
    pub(super) fn mass(&mut self, root: &DeTable, source: &mut ModelSource) {
        let rows = self.entries(root, "mass");
        // A row of a state with a velocity is that of its acceleration.
        let rate = |states: &[State], name: &str| {
            let velocity = format!("{name}'");
            let second = states.iter().any(|state| state.name == velocity);
            if second { velocity } else { name.to_string() }
        };
        let known: Vec<String> = source.states.iter().map(|state| state.name.clone()).collect();
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        let mut given: Vec<(String, String, Range<usize>)> = Vec::new();
        let mut unknown = false;
        for (name, place, value) in &rows {
            let entries: Vec<(String, Range<usize>, &Value)> = match value.get_ref() {
                DeValue::Table(table) => {
                    let mut own: Vec<_> = table.iter().map(|(k, v)| (k.get_ref().to_string(), k.span(), v)).collect();
                    own.sort_by_key(|(_, place, _)| place.start);
                    own
                }
                _ => vec![(name.clone(), place.clone(), *value)],
            };
            for (own, place) in entries.iter().map(|(own, place, _)| (own, place)).chain([(name, place)]) {
                if !known.contains(&own.as_str()) {
                    unknown = true;
                    self.walk.report(place.clone(), format!("`{own}` is not a state"), suggest(own, &known));
                }
            }
            if unknown {
                continue;
            }
            for (column, place, value) in entries {
                let item = Item::Mass(source.mass.len());
                let what = format!("the mass of `{name}` and `{column}`");
                let expression = self.expression(item, place.clone(), value, &what);
                let (row, across) = (rate(&source.states, name), rate(&source.states, &column));
                source.mass.push(Mass { row, column: across, expression });
                given.push((name.clone(), column, place));
            }
            if !given.iter().any(|(row, column, _)| row == name && column == name) {
                let hint = format!("write `{name} = \"…\"` in its row, the mass that belongs to `{name}` itself");
                self.walk.report(place.clone(), format!("the row of `{name}` has no mass of its own"), hint);
            }
        }
        for (row, column, place) in given.iter().filter(|_| !unknown) {
            if row != column && !given.iter().any(|(r, c, _)| r == column && c == row) {
                let message =
                    format!("the mass of `{row}` and `{column}` is given, that of `{column}` and `{row}` is not");
                let hint = "write both, the other one as 0 if the matrix is not symmetric";
                self.walk.report(place.clone(), message, hint);
            }
        }
    }
}
