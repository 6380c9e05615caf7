//! NetCDF-4 file with one group per branch.
//!
//! **Idea.** The number and size of the points of every branch are known beforehand, so the whole file is laid out
//! first. Then each point is appended to every variable. Profiles have different meshes; they are padded with NaN to
//! the length of the longest one of the branch.
//!
//! **Source.** unidata2024; eaton2023 for the names of attributes (`units`, `long_name`, `coordinates`).

use super::cells::{Cell, branch_cells, point_cells, response_cells, special_cells};
use super::columns::{Class, Column, Variables, of_branch};
use super::groups::{Group, Growth, Planned, describe, element, text_of};
use super::hdf5::{Id, Plan, ROOT};
use super::{Export, ExportError, Growing};
use crate::run_file::{Extent, free_name};
use foldline::diagram::{Branch, Responses};
use std::path::{Path, PathBuf};

/// Numbers written after the layout is fixed: tables held in memory, and the groups of points.
struct Numbers {
    tables: Vec<(Vec<Growth>, Vec<Vec<Cell>>)>,
    branches: Vec<[Group; 2]>,
    /// Variables of maps, with their elements.
    arrays: Vec<(Growth, Vec<Cell>)>,
}

/// Writes the file.
pub(super) fn write(export: &Export, path: &Path) -> Result<Vec<PathBuf>, ExportError> {
    let (growing, file) = Growing::create(path)?;
    let variables = Variables::new(export.model(), &export.study.plan.record);
    let (plan, mut numbers) = planned(export, &variables)?;
    let mut laid = plan.lay(file).map_err(|error| growing.failed(error))?;
    let failed = |error| growing.failed(error);
    for (columns, rows) in &mut numbers.tables {
        for row in rows.iter() {
            columns.iter_mut().zip(row).try_for_each(|(c, cell)| c.add(cell, &mut laid)).map_err(failed)?;
        }
        columns.iter_mut().try_for_each(|c| c.flush(&mut laid)).map_err(failed)?;
    }
    for (variable, cells) in &mut numbers.arrays {
        cells.iter().try_for_each(|cell| variable.add(cell, &mut laid)).map_err(failed)?;
        variable.flush(&mut laid).map_err(failed)?;
    }
    let model = export.model();
    for (branch, [points, special]) in export.diagram.branches.iter().zip(&mut numbers.branches) {
        let cycles = points.nodes > 0;
        export.reading.each_point(&branch.name, |point| {
            let point = export.shown(point);
            points.add(&point, point_cells(&point, model, cycles), &mut laid).map_err(failed)
        })?;
        let cycles = special.nodes > 0;
        export.reading.each_special(&branch.name, |mut found| {
            found.point = export.shown(found.point);
            let cells = [point_cells(&found.point, model, cycles), special_cells(&found)].concat();
            special.add(&found.point, cells, &mut laid).map_err(failed)
        })?;
        points.flush(&mut laid).and_then(|()| special.flush(&mut laid)).map_err(failed)?;
    }
    drop(laid);
    Ok(vec![growing.finish()?])
}

fn planned(export: &Export, variables: &Variables) -> Result<(Plan, Numbers), ExportError> {
    let mut plan = Plan::default();
    let mut numbers = Numbers { tables: Vec::new(), branches: Vec::new(), arrays: Vec::new() };
    about(export, &mut plan);
    let branches = &export.diagram.branches;
    let mut extents = Vec::with_capacity(branches.len());
    for branch in branches {
        extents.push(export.reading.extents(&branch.name)?);
    }
    let own = of_branch();
    let mut taken: Vec<String> = own.iter().map(|column| column.name.clone()).chain(["group".into()]).collect();
    let sets = &export.diagram.responses;
    let names = branches.iter().map(|b| &b.name).chain(sets.iter().map(|set| &set.name));
    let groups: Vec<String> = names.map(|name| free_name(group_name(name), &mut taken)).collect();
    for map in super::maps::of_run(export) {
        let name = free_name(group_name(&map.0), &mut taken);
        numbers.arrays.extend(super::maps::group(&mut plan, &name, &map));
    }
    if !branches.is_empty() {
        let model = export.model();
        let rows = branches.iter().zip(&extents).zip(&groups).map(|((branch, [points, _]), group)| {
            let mut row = branch_cells(branch, model, points.points);
            row.push(Cell::Text(group.clone()));
            row
        });
        let group = Column {
            name: "group".into(),
            class: Class::Text,
            unit: String::new(),
            description: "name of its group in this file".into(),
        };
        // The first column would have the name of the dimension.
        let mut columns = own;
        columns[0].name = "name".into();
        columns.push(group);
        numbers.tables.push(table(&mut plan, ROOT, "branch", &columns, rows.collect()));
    }
    for ((branch, extents), group) in branches.iter().zip(&extents).zip(&groups) {
        numbers.branches.push(branch_groups(export, variables, &mut plan, branch, extents, group));
    }
    for (set, group) in sets.iter().zip(&groups[branches.len()..]) {
        numbers.tables.extend(responses(export, variables, &mut plan, set, group));
    }
    Ok((plan, numbers))
}

/// Adds the attributes that describe the file.
fn about(export: &Export, plan: &mut Plan) {
    let study = &export.study;
    plan.text(ROOT, "Conventions", "CF-1.11");
    plan.text(ROOT, "title", &format!("bifurcation diagram: {}", study.model.name));
    plan.text(ROOT, "source", concat!("foldline ", env!("CARGO_PKG_VERSION")));
    plan.text(ROOT, "model", &study.model.name);
    plan.text(ROOT, "model_source", &study.model.source);
    plan.real(ROOT, "tolerance", study.plan.tolerance);
    plan.text(ROOT, "study_text", &study.text);
    plan.text(ROOT, "model_text", &study.model_text);
}

/// Returns a valid NetCDF name: without `/`, which would denote a nested group, without control characters, and
/// beginning with a letter, a digit or `_`.
fn group_name(name: &str) -> String {
    let allowed = |c: char| {
        if c == '/' {
            '|'
        } else if c.is_control() {
            '_'
        } else {
            c
        }
    };
    let name: String = name.trim().chars().map(allowed).collect();
    let plain = name.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_' || !c.is_ascii());
    if plain { name } else { format!("_{name}") }
}

/// Plans a table held in memory, over a dimension of its own.
fn table(
    plan: &mut Plan,
    group: Id,
    dimension: &str,
    columns: &[Column],
    rows: Vec<Vec<Cell>>,
) -> (Vec<Growth>, Vec<Vec<Cell>>) {
    let dimension = plan.dimension(group, dimension, rows.len() as u64, None);
    let column = |(k, column): (usize, &Column)| {
        let id = match column.class {
            Class::Text => plan.texts(group, &column.name, &[dimension], rows.iter().map(|row| text_of(&row[k]))),
            class => plan.variable(group, &column.name, element(class), &[dimension]),
        };
        describe(plan, id, column);
        Growth::new(id, column.class)
    };
    let growths = columns.iter().enumerate().map(column).collect();
    (growths, rows)
}

fn responses(
    export: &Export,
    variables: &Variables,
    plan: &mut Plan,
    set: &Responses,
    name: &str,
) -> Option<(Vec<Growth>, Vec<Vec<Cell>>)> {
    let group = plan.group(ROOT, name);
    let model = export.model();
    plan.text(group, "set", &set.name);
    plan.text(group, "search", set.search.name());
    plan.text(group, "free", model.parameters.get(set.free).map_or("", |p| p.name.as_str()));
    let rows: Vec<Vec<Cell>> = set.responses.iter().map(|response| response_cells(response, model)).collect();
    (!rows.is_empty()).then(|| table(plan, group, "response", &variables.of_response(), rows))
}

/// Plans the group of a branch and, inside it, the group of its special points.
fn branch_groups(
    export: &Export,
    variables: &Variables,
    plan: &mut Plan,
    branch: &Branch,
    [points, special]: &[Extent; 2],
    name: &str,
) -> [Group; 2] {
    let group = plan.group(ROOT, name);
    for (column, cell) in of_branch().iter().zip(branch_cells(branch, export.model(), points.points)) {
        match cell {
            Cell::Text(text) => plan.text(group, &column.name, &text),
            Cell::Integer(value) => plan.integer(group, &column.name, value),
            Cell::Real(value) => plan.real(group, &column.name, value),
            Cell::Empty => {}
        }
    }
    let mut along = vec![branch.free];
    along.extend(branch.held.map(|(_, follows)| follows));
    let planned = Planned { variables, along: variables.names_of(&along), profiles: export.profiles };
    let own = planned.group(plan, group, points, ["point", "node"], Vec::new(), Vec::new());
    if special.points == 0 {
        return [own, Group::default()];
    }
    let group = plan.group(group, "special");
    let columns = Variables::of_special();
    let rows: Vec<Vec<Cell>> = branch.special.iter().map(special_cells).collect();
    [own, planned.group(plan, group, special, ["special", "special_node"], columns, rows)]
}
