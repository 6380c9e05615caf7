//! Table of the answers to design questions.

use super::{Cell, Column, Style, Table};
use foldline::diagram::{Design, Diagram};
use foldline::model::Model;

/// Table with one row per question: name, branch, condition, what is sought, its value and error, the branch's
/// parameter where it is attained, position in the range, kind of boundary, curve, and whether the question is answered.
pub fn designs(diagram: &Diagram, model: &Model) -> Table {
    let word = |name: &str| Column::new(name, Style::Word);
    let number = |name: &str| Column::new(name, Style::Number);
    let columns = vec![
        word("design"),
        word("of"),
        word("wanted"),
        word("sought"),
        number("value"),
        Column::new("error", Style::Size),
        word("free"),
        number("at"),
        word("binds"),
        word("boundary"),
        word("curve"),
        word("answered"),
    ];
    let name = |index: usize| model.parameters.get(index).map_or("?", |own| own.name.as_str()).to_string();
    let row = |design: &Design| {
        let answer = design.answer.as_ref();
        let cell = |value: Option<f64>| value.filter(|v| !v.is_nan()).map_or(Cell::Empty, Cell::Number);
        let text = |value: Option<String>| Cell::Word(value.unwrap_or_default());
        vec![
            Cell::Word(design.name.clone()),
            Cell::Word(design.of.clone()),
            Cell::Word(design.wanted.clone()),
            Cell::Word(format!("{} {}", if design.greatest { "greatest" } else { "least" }, name(design.vary))),
            cell(answer.map(|own| own.value)),
            cell(answer.map(|own| own.error)),
            Cell::Word(name(design.free)),
            cell(answer.map(|own| own.at)),
            text(answer.map(|own| own.binds.name().to_string())),
            text(answer.map(|own| own.kind.name().to_string())),
            text(answer.map(|own| own.curve.clone())),
            Cell::Word(if design.answered() { "yes" } else { "no" }.into()),
        ]
    };
    Table { columns, rows: diagram.designs.iter().map(row).collect() }
}
