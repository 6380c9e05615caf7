//! Units of a model: declarations, values with a unit, and the results of the unit check.

use super::Reader;
use crate::diagnostic::Diagnostic;
use crate::toml_walk::{Value, diagnose};
use foldline::model::{Field, Item, Model, ModelError, ModelSource, TAKEN_AS, UnitReport, check_units};
use foldline::units::{self, Unit};
use toml::de::DeTable;

/// Number of doubtful units that are reported individually.
const DOUBTS: usize = 3;
/// Number of quantities with implied units that are listed.
const TOLD: usize = 12;

impl Reader<'_> {
    /// Reads the unit of time and the key `units`.
    pub(super) fn time(&mut self, root: &DeTable) -> String {
        if let Some(value) = root.get("units") {
            self.labels_only = value.get_ref().as_str() == Some("labels");
            if !matches!(value.get_ref().as_str(), Some("labels" | "checked")) {
                let hint = "write `units = \"labels\"` to leave units unchecked, or remove the key";
                self.walk.report(value.span(), "`units` is neither \"checked\" nor \"labels\"", hint);
            }
        }
        let Some(value) = root.get("time") else { return String::new() };
        let Some(text) = self.walk.string(value, "`time`") else { return String::new() };
        let unit = Unit::read(&text);
        if !unit.is_number() && unit.convert(1.0, &Unit::read("s")).is_err() {
            let hint = "write a unit of time such as `time = \"ms\"`, or `time = \"1\"` if time is a pure number";
            self.walk.report(value.span(), format!("`time` is in {text}, which is not a unit of time"), hint);
        }
        text
    }

    /// Reads the unit and the description of an item.
    pub(super) fn labels(&mut self, item: Item, table: &DeTable) -> (String, String) {
        let unit = table.get("unit").and_then(|value| {
            self.places.insert((item, Field::Unit), value.span());
            self.walk.string(value, "`unit`")
        });
        if unit.is_some() {
            self.measured.insert(item);
        }
        (unit.unwrap_or_else(|| "1".into()), self.prose(table, "description"))
    }

    /// Reads a number, or a number with a unit. It is converted to the unit of the item; if the item has none, its unit
    /// becomes that of the number.
    pub(super) fn measure(&mut self, item: Item, value: &Value, what: &str, unit: &mut String) -> Option<f64> {
        let Some(written) = value.get_ref().as_str().and_then(units::quantity) else {
            return self.walk.number(value, what);
        };
        if self.measured.contains(&item) {
            return self.walk.quantity(value, what, unit);
        }
        let foreign: Vec<String> = Unit::read(&written.unit).foreign().map(str::to_string).collect();
        if let Some(name) = foreign.first() {
            let message =
                format!("{what} is a number with the unit `{}`, but `{name}` is not a known unit", written.unit);
            let hint = format!(
                "write a product with a star, `{}*{name}`, or give the unit with `unit = \"…\"`",
                written.value
            );
            self.walk.report(value.span(), message, hint);
            return None;
        }
        self.measured.insert(item);
        self.places.insert((item, Field::Unit), value.span());
        *unit = written.unit;
        Some(written.value)
    }

    /// Returns the model with its unit of time, or the mistakes in its units.
    pub(super) fn with_units(
        mut self,
        model: Model,
        source: &ModelSource,
        file: &str,
        refuse: bool,
    ) -> Result<Model, Vec<Diagnostic>> {
        if self.labels_only {
            return Ok(model);
        }
        let report = check_units(source, &|item| self.measured.contains(&item));
        let time = report.time.clone().unwrap_or_default();
        if refuse && !report.errors.is_empty() {
            report.errors.into_iter().for_each(|error| self.report(error));
            self.walk.found.sort_by_key(|diagnostic| (diagnostic.line, diagnostic.column));
            return Err(self.walk.found);
        }
        let remarks = if refuse { self.remarks(&report, file) } else { Vec::new() };
        Ok(model.with_time(&time, remarks))
    }

    /// Returns notes on doubtful units.
    fn remarks(&self, report: &UnitReport, file: &str) -> Vec<String> {
        let placed = |error: &ModelError, message: String, hint: String| {
            diagnose(file, self.text, self.place_of(error), message, hint).as_note()
        };
        let doubts = report.doubts.iter().take(DOUBTS);
        let mut remarks: Vec<String> = doubts.map(|own| placed(own, own.message.clone(), own.hint.clone())).collect();
        if let Some(more @ 1..) = report.doubts.len().checked_sub(DOUBTS) {
            remarks.push(format!("note: {more} more places where units do not match"));
        }
        if let Some(first) = report.numbers.first() {
            let mut told: Vec<&str> = Vec::new();
            for own in &report.numbers {
                let quantity = own.message.split_once(TAKEN_AS).map_or(own.message.as_str(), |(_, quantity)| quantity);
                if !told.contains(&quantity) {
                    told.push(quantity);
                }
            }
            let more = match told.len().saturating_sub(TOLD) {
                0 => String::new(),
                more => format!(", and {more} more"),
            };
            told.truncate(TOLD);
            let message = format!("numbers in formulas stand for quantities with a unit: {}{more}", told.join(", "));
            let hint = "if this is intended, nothing needs to be done; a number with its unit can be written under \
                        [constants], as in `V0 = \"40 mV\"`";
            remarks.push(placed(first, message, hint.into()));
        }
        remarks
    }
}
