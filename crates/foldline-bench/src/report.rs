//! Report in Markdown: parts with tables.

use crate::workplace::Workplace;
use crate::{Outcome, machine};
use std::path::PathBuf;

/// Report; every part is printed when it is added.
pub struct Report {
    text: String,
}

impl Report {
    /// Begins a report with the description of the machine.
    pub fn new(machine: String) -> Report {
        let text = format!("# Benchmarks\n\nHow they are made: docs/book/benchmarks.md.\n\n{machine}");
        println!("{text}");
        Report { text }
    }

    /// Adds a part.
    pub fn add(&mut self, name: &str, text: &str) {
        let part = format!("\n## {name}\n\n{text}");
        println!("{part}");
        self.text.push_str(&part);
    }

    /// Writes benches/results/DATE.md.
    pub fn write(&self, place: &Workplace) -> Outcome<PathBuf> {
        let date = machine::date().ok_or("the command `date` gives no date")?;
        let folder = place.root.join("benches/results");
        std::fs::create_dir_all(&folder)?;
        let file = folder.join(format!("{date}.md"));
        std::fs::write(&file, &self.text)?;
        Ok(file)
    }
}

/// Table in Markdown.
pub struct Table {
    columns: usize,
    text: String,
}

impl Table {
    /// Begins a table with the given column headings; the first column is a name, the others are numbers.
    pub fn new(heads: &[&str]) -> Table {
        let rule: Vec<&str> = heads.iter().enumerate().map(|(k, _)| if k == 0 { "---" } else { "---:" }).collect();
        Table { columns: heads.len(), text: format!("| {} |\n| {} |\n", heads.join(" | "), rule.join(" | ")) }
    }

    /// Adds a row; missing cells stay empty.
    pub fn row<S: AsRef<str>>(&mut self, cells: &[S]) {
        let cells = (0..self.columns).map(|k| cells.get(k).map_or("", |cell| cell.as_ref()));
        self.text.push_str(&format!("| {} |\n", cells.collect::<Vec<_>>().join(" | ")));
    }

    /// Returns the table as text.
    pub fn text(&self) -> &str {
        &self.text
    }
}

/// Formats a time in seconds with a suitable unit and three digits.
pub fn time(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s < 1e-3 => (s * 1e6, "µs"),
        s if s < 1.0 => (s * 1e3, "ms"),
        s => (s, "s"),
    };
    format!("{} {unit}", digits(value))
}

/// Formats a number with three significant digits and no exponent.
pub fn digits(value: f64) -> String {
    let places = if !value.is_finite() || value == 0.0 { 0 } else { 2 - value.abs().log10().floor() as i32 };
    format!("{value:.*}", places.clamp(0, 9) as usize)
}
