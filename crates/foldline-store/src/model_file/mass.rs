//! Mass matrix.

use super::Reader;
use crate::nearest::suggest;
use crate::toml_walk::Value;
use foldline::model::{Item, Mass, ModelSource};
use std::collections::HashSet;
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// Entry: row, column, position in the text, value.
type Entry<'v, 't> = (String, String, Range<usize>, &'v Value<'t>);

impl Reader<'_> {
    /// Reads the rows of the mass matrix, each an expression (the diagonal entry) or a table with one entry per coupled
    /// state.
    pub(super) fn mass(&mut self, root: &DeTable, source: &mut ModelSource) {
        let entries = self.mass_entries(root, source);
        let given: HashSet<(&str, &str)> =
            entries.iter().map(|(row, column, ..)| (row.as_str(), column.as_str())).collect();
        for (row, column, place, _) in &entries {
            if !given.contains(&(row, row)) {
                let hint = format!("add `{row} = \"…\"` to the row, the diagonal entry of the mass matrix");
                self.walk.report(place.clone(), format!("the row of `{row}` has no diagonal entry"), hint);
            } else if !given.contains(&(column, row)) {
                let message =
                    format!("the mass of `{row}` and `{column}` is given, but that of `{column}` and `{row}` is not");
                let hint = "give both; one of them may be 0 if the matrix is not symmetric";
                self.walk.report(place.clone(), message, hint);
            }
        }
        // For a state with a velocity, rows and columns refer to its acceleration.
        let names: HashSet<String> = source.states.iter().map(|state| state.name.clone()).collect();
        let rate = |name: String| {
            let velocity = format!("{name}'");
            if names.contains(&velocity) { velocity } else { name }
        };
        for (row, column, place, value) in entries {
            let item = Item::Mass(source.mass.len());
            let expression = self.expression(item, place, value, &format!("the mass of `{row}` and `{column}`"));
            source.mass.push(Mass { row: rate(row), column: rate(column), expression });
        }
    }

    /// Returns the entries in the order of the file; none if any of their names is not a state.
    fn mass_entries<'v, 't>(&mut self, root: &'v DeTable<'t>, source: &ModelSource) -> Vec<Entry<'v, 't>> {
        let mut entries: Vec<Entry> = Vec::new();
        let known: HashSet<&str> = source.states.iter().map(|state| state.name.as_str()).collect();
        let mut unknown = Vec::new();
        for (row, place, value) in self.entries(root, "mass") {
            if !known.contains(row.as_str()) {
                unknown.push((row.clone(), place.clone()));
            }
            match value.get_ref() {
                DeValue::Table(table) => entries
                    .extend(table.iter().map(|(key, own)| (row.clone(), key.get_ref().to_string(), key.span(), own))),
                _ => entries.push((row.clone(), row, place, value)),
            }
        }
        entries.sort_by_key(|(_, _, place, _)| place.start);
        let columns = entries.iter().filter(|(_, column, ..)| !known.contains(column.as_str()));
        unknown.extend(columns.map(|(_, column, place, _)| (column.clone(), place.clone())));
        unknown.sort_by_key(|(_, place)| place.start);
        unknown.dedup();
        if unknown.is_empty() {
            return entries;
        }
        let names: Vec<&str> = source.states.iter().map(|state| state.name.as_str()).collect();
        for (name, place) in unknown {
            self.walk.report(place, format!("`{name}` is not a state"), suggest(&name, &names));
        }
        Vec::new()
    }
}
