//! Tables of maps over parameters.

use super::{Cell, Column, Style, Table};
use foldline::diagram::{CellValue, Diagram};
use foldline::explore::Plan;
use foldline::explore::cells::assembled;
use foldline::model::Model;
use foldline_store::maps::{Array, Class, arrays, words_of};

/// Table with one row for each map: its question and parameters, the numbers of cells, of those computed, of those without
/// values and of those that fell short, and whether it is complete.
pub fn summary(diagram: &Diagram, plan: &Plan) -> Table {
    let columns = [("map", Style::Word), ("what", Style::Word), ("over", Style::Word)];
    let counts = ["cells", "computed", "no values", "fell short"].map(|name| Column::new(name, Style::Number));
    let mut columns: Vec<Column> = columns.map(|(name, style)| Column::new(name, style)).into();
    columns.extend(counts);
    columns.push(Column::new("complete", Style::Word));
    let row = |map: &foldline::explore::MapPlan| {
        let found = assembled(map, &diagram.cells);
        let sums = found.complaints().map(|all| all.iter().map(|(_, count)| *count as i64).sum::<i64>());
        vec![
            Cell::Word(map.name.clone()),
            Cell::Word(words_of(&map.question)),
            Cell::Word(map.names.join(", ")),
            Cell::Count(found.cells.len() as i64),
            Cell::Count(found.computed() as i64),
            Cell::Count(sums[0]),
            Cell::Count(sums[1]),
            Cell::Word(if found.complete { "yes" } else { "no" }.into()),
        ]
    };
    Table { columns, rows: plan.maps.iter().map(row).collect() }
}

/// Table of the cells of a map, with a row for each motion or special point in them.
pub fn cells(map: &foldline::explore::MapPlan, diagram: &Diagram, model: &Model) -> Table {
    let listed = arrays(map, &diagram.cells, model).listed();
    let style = |own: &Array| match (own.class, own.name.as_str()) {
        (Class::Text, _) => Style::Word,
        (_, "error") => Style::Size,
        (_, "share" | "share_low" | "share_high" | "unsettled" | "escaped") if own.class == Class::Number => {
            Style::Share
        }
        _ => Style::Number,
    };
    let columns = listed.columns.iter().map(|own| Column::in_unit(&own.name, style(own), &own.unit)).collect();
    let cell = |value: Option<CellValue>| match value {
        Some(CellValue::Text(text)) => Cell::Word(text),
        Some(CellValue::Count(count)) => Cell::Count(count),
        Some(CellValue::Number(value)) if !value.is_nan() => Cell::Number(value),
        Some(CellValue::Number(_)) | None => Cell::Empty,
    };
    Table { columns, rows: listed.rows.into_iter().map(|row| row.into_iter().map(cell).collect()).collect() }
}
