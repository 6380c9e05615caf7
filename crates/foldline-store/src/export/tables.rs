//! Tables of an export: `branches`, `points`, `special_points`, `profiles`, `special_profiles`, `responses`,
//! `sensitivities`.

use super::cells::{Cell, branch_cells, point_cells, profile, response_cells, special_cells};
use super::columns::{Class, Column, Variables, of_branch};
use super::{Export, ExportError};
use foldline::diagram::Point;
use foldline::model::Model;
use foldline::sensitivity::listed::Entry;
use std::path::{Path, PathBuf};

/// Table that is written row by row.
pub(super) trait Rows {
    fn row(&mut self, cells: &[Cell]) -> Result<(), ExportError>;
    fn finish(self: Box<Self>) -> Result<PathBuf, ExportError>;
}

/// Function that begins a named table in a folder.
pub(super) type Begin = dyn Fn(&Path, &str, &[Column]) -> Result<Box<dyn Rows>, ExportError>;

/// Writes `branches`, `points` and `special_points`, and the other tables if they have rows.
pub(super) fn write(export: &Export, folder: &Path, begin: &Begin) -> Result<Vec<PathBuf>, ExportError> {
    let variables = Variables::new(export.model(), &export.study.plan.record);
    let mut done = vec![branches(export, folder, begin)?];
    done.extend(points(export, folder, begin, &variables)?);
    if !export.diagram.responses.is_empty() {
        done.push(responses(export, folder, begin, &variables)?);
    }
    done.extend(super::maps::write(export, folder, begin)?);
    if let Some(entries) = &export.sensitivities {
        done.push(sensitivities(entries, folder, begin)?);
    }
    Ok(done)
}

fn branches(export: &Export, folder: &Path, begin: &Begin) -> Result<PathBuf, ExportError> {
    let mut table = begin(folder, "branches", &of_branch())?;
    for branch in &export.diagram.branches {
        let [extent, _] = export.reading.extents(&branch.name)?;
        table.row(&branch_cells(branch, export.model(), extent.points))?;
    }
    table.finish()
}

/// Writes the tables of points and special points, and of their profiles if there are any.
fn points(export: &Export, folder: &Path, begin: &Begin, variables: &Variables) -> Result<Vec<PathBuf>, ExportError> {
    let (model, branches) = (export.model(), &export.diagram.branches);
    let (mut width, mut cycles) = (0, [false; 2]);
    for branch in branches {
        for (k, extent) in export.reading.extents(&branch.name)?.into_iter().enumerate() {
            width = width.max(extent.spectrum as usize);
            cycles[k] |= export.profiles && extent.nodes > 0;
        }
    }
    let name = Column {
        name: "branch".into(),
        class: Class::Text,
        unit: String::new(),
        description: "name of the branch".into(),
    };
    let own = [vec![name.clone()], variables.of_point(false), spectrum_columns(width)].concat();
    let mut table = begin(folder, "points", &own)?;
    let mut profiles = match cycles[0] {
        true => Some(begin(folder, "profiles", &profile_columns(&name, variables, "position"))?),
        false => None,
    };
    for branch in branches {
        export.reading.each_point(&branch.name, |point| {
            let point = export.shown(point);
            table.row(&cells(&branch.name, &point, model, width))?;
            profile_rows(&mut profiles, &branch.name, point.position, &point)
        })?;
    }
    let mut done = vec![table.finish()?];
    done.extend(profiles.map(|table| table.finish()).transpose()?);

    let mut own = own;
    own.extend(Variables::of_special());
    let mut table = begin(folder, "special_points", &own)?;
    let mut profiles = match cycles[1] {
        true => Some(begin(folder, "special_profiles", &profile_columns(&name, variables, "special"))?),
        false => None,
    };
    for branch in branches {
        let mut number = 0;
        export.reading.each_special(&branch.name, |mut special| {
            special.point = export.shown(special.point);
            let mut row = cells(&branch.name, &special.point, model, width);
            row.extend(special_cells(&special));
            table.row(&row)?;
            number += 1;
            profile_rows(&mut profiles, &branch.name, number - 1, &special.point)
        })?;
    }
    done.push(table.finish()?);
    done.extend(profiles.map(|table| table.finish()).transpose()?);
    Ok(done)
}

fn cells(branch: &str, point: &Point, model: &Model, width: usize) -> Vec<Cell> {
    let mut row = vec![Cell::Text(branch.to_string())];
    row.extend(point_cells(point, model, false));
    let parts = |k: usize| point.spectrum.get(k).map_or([Cell::Empty, Cell::Empty], |z| [z.re, z.im].map(Cell::Real));
    row.extend((0..width).flat_map(parts));
    row
}

fn spectrum_columns(width: usize) -> Vec<Column> {
    let part = |k: usize, part: &str| Column {
        name: format!("spectrum_{k}_{part}"),
        class: Class::Real,
        unit: String::new(),
        description: format!("eigenvalue or multiplier {k}, {part}"),
    };
    (1..=width).flat_map(|k| [part(k, "re"), part(k, "im")]).collect()
}

/// Columns of a table of profiles; `index` is the name of the column that identifies the point on its branch.
fn profile_columns(name: &Column, variables: &Variables, index: &str) -> Vec<Column> {
    let own = |name: &str, class: Class, description: &str| Column {
        name: name.into(),
        class,
        unit: String::new(),
        description: description.into(),
    };
    let mut columns = vec![
        name.clone(),
        own(index, Class::Integer, "position of the point on the branch"),
        own("node", Class::Integer, "index within the profile, from 0"),
        own("normalised_time", Class::Real, "time divided by the period, from 0 to 1"),
    ];
    columns.extend_from_slice(variables.states());
    columns
}

fn profile_rows(table: &mut Option<Box<dyn Rows>>, branch: &str, index: i64, point: &Point) -> Result<(), ExportError> {
    let (Some(table), Some((times, states))) = (table, profile(point)) else { return Ok(()) };
    let n = states.len() / times.len().max(1);
    let mut row = vec![Cell::Text(branch.to_string()), Cell::Integer(index)];
    for (node, (time, state)) in times.iter().zip(states.chunks_exact(n.max(1))).enumerate() {
        row.truncate(2);
        row.extend([Cell::Integer(node as i64), Cell::Real(*time)]);
        row.extend(state.iter().map(|v| Cell::Real(*v)));
        table.row(&row)?;
    }
    Ok(())
}

fn responses(export: &Export, folder: &Path, begin: &Begin, variables: &Variables) -> Result<PathBuf, ExportError> {
    let word = |name: &str, description: &str| Column {
        name: name.into(),
        class: Class::Text,
        unit: String::new(),
        description: description.into(),
    };
    let model = export.model();
    let first =
        [word("set", "name of the survey or sweep"), word("search", "survey or sweep"), word("free", "free parameter")];
    let mut table = begin(folder, "responses", &[&first[..], &variables.of_response()].concat())?;
    for set in &export.diagram.responses {
        let free = model.parameters.get(set.free).map_or("", |p| p.name.as_str());
        for response in &set.responses {
            let mut row: Vec<Cell> = [&set.name, set.search.name(), free].map(|text| Cell::Text(text.into())).into();
            row.extend(response_cells(response, model));
            table.row(&row)?;
        }
    }
    table.finish()
}

fn sensitivities(entries: &[Entry], folder: &Path, begin: &Begin) -> Result<PathBuf, ExportError> {
    let column = |name: &str, class: Class, description: &str| Column {
        name: name.into(),
        class,
        unit: String::new(),
        description: description.into(),
    };
    let columns = [
        column("branch", Class::Text, "name of the branch"),
        column("special", Class::Integer, "index of the special point on the branch, from 0"),
        column("kind", Class::Text, "kind of the special point"),
        column("free", Class::Text, "parameter of the branch"),
        column("at", Class::Real, "its value"),
        column("quantity", Class::Text, "number that changes"),
        column("value", Class::Real, "its value"),
        column("parameter", Class::Text, "parameter with respect to which the derivative is taken"),
        column("derivative", Class::Real, "derivative of the quantity, in the units of the model"),
        column("error", Class::Real, "bound on its error"),
        column("elasticity", Class::Real, "relative change of the quantity over that of the parameter"),
        column("unit", Class::Text, "unit of the quantity"),
        column("per", Class::Text, "unit of the parameter"),
        column("remark", Class::Text, "reason why there is no derivative"),
    ];
    let mut table = begin(folder, "sensitivities", &columns)?;
    let real = |value: Option<f64>| value.filter(|v| v.is_finite()).map_or(Cell::Empty, Cell::Real);
    let text = |text: &str| if text.is_empty() { Cell::Empty } else { Cell::Text(text.into()) };
    for entry in entries {
        let found = entry.found.as_ref().ok();
        table.row(&[
            Cell::Text(entry.branch.clone()),
            Cell::Integer(entry.number as i64),
            text(entry.kind.map_or("", |kind| kind.name())),
            Cell::Text(entry.free.clone()),
            real(Some(entry.at)),
            text(&entry.quantity),
            real(Some(entry.value)),
            text(&entry.parameter),
            real(found.map(|own| own.value)),
            real(found.map(|own| own.error)),
            real(entry.elasticity),
            text(&entry.unit),
            text(&entry.per),
            text(entry.found.as_ref().err().map_or("", |reason| reason)),
        ])?;
    }
    table.finish()
}
