//! Maps over parameters in exports.
//!
//! **Idea.** CSV and Parquet have one table for each map. NetCDF has one group for each, with the parameters as dimensions
//! (or `case` for a list), and `point` or `motion` as a further one, whose labels are the variable `label`.

use super::cells::Cell;
use super::columns::{Class, Column};
use super::groups::{Growth, describe, element, text_of};
use super::hdf5::{Element, Id, Plan, ROOT};
use super::tables::Begin;
use super::{Export, ExportError};
use crate::maps::{Array, Arrays, arrays, words_of};
use crate::run_file::free_name;
use foldline::diagram::CellValue;
use std::path::{Path, PathBuf};

/// Maps of a run with the quantities of each, in the units of the model.
pub(super) fn of_run(export: &Export) -> Vec<(String, String, Arrays)> {
    let own = |map: &foldline::explore::MapPlan| {
        let found = arrays(map, &export.diagram.cells, &export.study.model);
        (map.name.clone(), words_of(&map.question), found)
    };
    export.study.plan.maps.iter().map(own).collect()
}

fn column(array: &Array) -> Column {
    let class = match array.class {
        crate::maps::Class::Text => Class::Text,
        crate::maps::Class::Count => Class::Integer,
        crate::maps::Class::Number => Class::Real,
    };
    let Array { name, unit, description, .. } = array;
    Column { name: name.clone(), class, unit: unit.clone(), description: description.clone() }
}

fn cell(value: &Option<CellValue>, class: Class) -> Cell {
    match (value, class) {
        (Some(CellValue::Text(text)), _) => Cell::Text(text.clone()),
        (Some(CellValue::Count(count)), Class::Real) => Cell::Real(*count as f64),
        (Some(CellValue::Count(count)), _) => Cell::Integer(*count),
        (Some(CellValue::Number(value)), _) if !value.is_nan() => Cell::Real(*value),
        (Some(CellValue::Number(_)) | None, _) => Cell::Empty,
    }
}

/// Name of the file of a map, without characters that file systems do not allow.
fn file_name(name: &str) -> String {
    let allowed = |c: char| if c.is_alphanumeric() || matches!(c, ' ' | '-' | '_' | '.') { c } else { '_' };
    format!("map-{}", name.chars().map(allowed).collect::<String>())
}

/// Writes one table for each map.
pub(super) fn write(export: &Export, folder: &Path, begin: &Begin) -> Result<Vec<PathBuf>, ExportError> {
    let mut done = Vec::new();
    let mut taken = Vec::new();
    for (name, _, found) in of_run(export) {
        let listed = found.listed();
        let columns: Vec<Column> = listed.columns.iter().map(column).collect();
        let mut table = begin(folder, &free_name(file_name(&name), &mut taken), &columns)?;
        for row in &listed.rows {
            let cells: Vec<Cell> = row.iter().zip(&columns).map(|(value, own)| cell(value, own.class)).collect();
            table.row(&cells)?;
        }
        done.push(table.finish()?);
    }
    Ok(done)
}

/// Plans the group of a map. Returns its variables with their elements.
pub(super) fn group(
    plan: &mut Plan,
    group_name: &str,
    (name, words, found): &(String, String, Arrays),
) -> Vec<(Growth, Vec<Cell>)> {
    let group = plan.group(ROOT, group_name);
    plan.text(group, "map", name);
    plan.text(group, "what", words);
    // Quantities may have the name of a parameter.
    let mut taken: Vec<String> = vec!["label".into(), "case".into(), found.item.into()];
    let mut out = Vec::new();
    let dimensions: Vec<Id> = match &found.map.axes {
        Some(axes) => {
            let mut ids = Vec::new();
            for (own, axis) in found.parameters.iter().zip(axes) {
                let id = plan.dimension(
                    group,
                    &free_name(own.name.clone(), &mut taken),
                    axis.len() as u64,
                    Some(Element::Real),
                );
                describe(plan, id, &column(own));
                out.push((Growth::new(id, Class::Real), axis.iter().map(|value| Cell::Real(*value)).collect()));
                ids.push(id);
            }
            ids
        }
        None => {
            let id = plan.dimension(group, "case", found.map.cells.len() as u64, None);
            for own in &found.parameters {
                out.extend(variable(plan, group, own, &[id], &mut taken));
            }
            vec![id]
        }
    };
    for own in &found.cells {
        out.extend(variable(plan, group, own, &dimensions, &mut taken));
    }
    if !found.labels.is_empty() {
        let id = plan.dimension(group, found.item, found.labels.len() as u64, None);
        let labels = plan.texts(group, "label", &[id], found.labels.iter().cloned());
        plan.text(labels, "long_name", "motion or special point");
        for own in &found.about {
            out.extend(variable(plan, group, own, &[id], &mut taken));
        }
        let over: Vec<Id> = dimensions.iter().copied().chain([id]).collect();
        for own in &found.items {
            out.extend(variable(plan, group, own, &over, &mut taken));
        }
    }
    out
}

/// Plans a variable; returns it with its elements unless it is of texts, which are part of the plan.
fn variable(
    plan: &mut Plan,
    group: Id,
    array: &Array,
    over: &[Id],
    taken: &mut Vec<String>,
) -> Option<(Growth, Vec<Cell>)> {
    let column = Column { name: free_name(array.name.clone(), taken), ..column(array) };
    let cells: Vec<Cell> = array.values.iter().map(|value| cell(value, column.class)).collect();
    if column.class == Class::Text {
        let id = plan.texts(group, &column.name, over, cells.iter().map(text_of));
        describe(plan, id, &column);
        return None;
    }
    let id = plan.variable(group, &column.name, element(column.class), over);
    describe(plan, id, &column);
    Some((Growth::new(id, column.class), cells))
}
