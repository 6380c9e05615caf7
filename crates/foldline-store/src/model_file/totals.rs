//! Conserved totals.

use super::Reader;
use crate::toml_walk::Value;
use foldline::model::{Field, Item, ModelSource, Total};
use std::ops::Range;

const KEYS: [&str; 5] = ["sum", "value", "instead-of", "unit", "description"];

impl Reader<'_> {
    /// Reads a conserved sum of states.
    pub(super) fn total(&mut self, name: String, place: Range<usize>, value: &Value, source: &mut ModelSource) {
        let (item, what) = (Item::Total(source.totals.len()), format!("the total `{name}`"));
        self.places.insert((item, Field::Name), place.clone());
        let Some(table) = self.walk.table(value, &what) else {
            self.incomplete = true;
            return;
        };
        self.walk.only(table, &KEYS, &what);
        let (Some(sum), Some(number)) = (table.get("sum"), table.get("value")) else {
            self.incomplete = true;
            let hint = "write `{ sum = \"x + y\", value = 1.0 }`, with the value of the sum";
            return self.walk.report(place, format!("{what} lacks its sum or its value"), hint);
        };
        let (unit, description) = self.labels(item, table);
        let sum = self.expression(item, place, sum, &format!("the sum of {what}"));
        let number = self.walk.number(number, &format!("the value of {what}"));
        self.incomplete |= number.is_none();
        let instead_of = table.get("instead-of").and_then(|value| self.walk.string(value, "`instead-of`"));
        source.totals.push(Total { unit, description, instead_of, ..Total::new(&name, &sum, number.unwrap_or(1.0)) });
    }
}
