//! One NetCDF-4 file with a group for each branch.
//!
//! **Idea.** Of every branch it is known beforehand how many points it has and how large they are, so the whole file is laid out
//! first. Then the points pass, and each adds its numbers to the end of every variable. Profiles have different meshes; they
//! are filled up with NaN to the length of the longest one of the branch.
//!
//! **Source.** unidata2024; eaton2023 for the names of attributes (`units`, `long_name`, `coordinates`).

use super::columns::{
    Cell, Class, Column, Variables, branch_cells, of_branch, point_cells, profile, response_cells, special_cells,
};
use super::hdf5::{Element, Id, Laid, Plan, ROOT};
use super::{Export, ExportError, Growing};
use crate::run_file::{Extent, free_name};
use foldline::diagram::{Branch, Point, Responses};
use std::path::{Path, PathBuf};

/// Bytes of a variable that are written at a time.
const PIECE: usize = 1 << 16;

/// A variable whose elements come one after the other.
struct Growth {
    id: Id,
    class: Class,
    next: u64,
    bytes: Vec<u8>,
}

impl Growth {
    fn new(id: Id, class: Class) -> Growth {
        Growth { id, class, next: 0, bytes: Vec::new() }
    }

    fn add(&mut self, cell: &Cell, laid: &mut Laid) -> std::io::Result<()> {
        match (self.class, cell) {
            (Class::Text, _) => return Ok(()),
            (Class::Integer, Cell::Integer(value)) => self.bytes.extend(value.to_le_bytes()),
            (Class::Integer, _) => self.bytes.extend([0; 8]),
            (Class::Real, Cell::Real(value)) => self.bytes.extend(value.to_le_bytes()),
            (Class::Real, _) => self.bytes.extend(f64::NAN.to_le_bytes()),
        }
        if self.bytes.len() >= PIECE { self.flush(laid) } else { Ok(()) }
    }

    fn flush(&mut self, laid: &mut Laid) -> std::io::Result<()> {
        if !self.bytes.is_empty() {
            laid.put(self.id, self.next, &self.bytes)?;
        }
        self.next += self.bytes.len() as u64 / 8;
        self.bytes.clear();
        Ok(())
    }
}

/// The variables of the points, or of the special points, of a branch.
#[derive(Default)]
struct Group {
    scalars: Vec<Growth>,
    spectrum: Vec<Growth>,
    modes: usize,
    profile: Vec<Growth>,
    nodes: usize,
}

/// What comes after the plan: the numbers of tables that are in memory, and the groups of points.
struct Numbers {
    tables: Vec<(Vec<Growth>, Vec<Vec<Cell>>)>,
    branches: Vec<[Group; 2]>,
}

/// Writes the file.
pub(super) fn write(export: &Export, path: &Path) -> Result<Vec<PathBuf>, ExportError> {
    let (growing, file) = Growing::create(path)?;
    let variables = Variables::new(&export.study.model);
    let (plan, mut numbers) = planned(export, &variables)?;
    let mut laid = plan.lay(file).map_err(|error| growing.failed(error))?;
    let failed = |error| growing.failed(error);
    for (columns, rows) in &mut numbers.tables {
        for row in rows.iter() {
            columns.iter_mut().zip(row).try_for_each(|(c, cell)| c.add(cell, &mut laid)).map_err(failed)?;
        }
        columns.iter_mut().try_for_each(|c| c.flush(&mut laid)).map_err(failed)?;
    }
    let model = &export.study.model;
    for (branch, [points, special]) in export.diagram.branches.iter().zip(&mut numbers.branches) {
        let cycles = points.nodes > 0;
        export.reading.each_point(&branch.name, |point| {
            points.add(&point, point_cells(&point, model, cycles), &mut laid).map_err(failed)
        })?;
        let cycles = special.nodes > 0;
        export.reading.each_special(&branch.name, |found| {
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
    let mut numbers = Numbers { tables: Vec::new(), branches: Vec::new() };
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
    if !branches.is_empty() {
        let model = &export.study.model;
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
        // The dimension has the name that the first column would have.
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

/// What the file is about.
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

/// A name that NetCDF allows: no `/`, which would be a group in a group, nothing unprintable, a letter, digit or `_` in front.
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

fn element(class: Class) -> Element {
    match class {
        Class::Text => Element::Text,
        Class::Integer => Element::Integer,
        Class::Real => Element::Real,
    }
}

fn describe(plan: &mut Plan, id: Id, column: &Column) {
    plan.text(id, "long_name", &column.description);
    if !column.unit.is_empty() {
        plan.text(id, "units", &column.unit);
    }
}

/// Rows that are in memory, over a dimension of their own.
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
            Class::Text => plan.texts(group, &column.name, dimension, rows.iter().map(|row| text_of(&row[k]))),
            class => plan.variable(group, &column.name, element(class), &[dimension]),
        };
        describe(plan, id, column);
        Growth::new(id, column.class)
    };
    let growths = columns.iter().enumerate().map(column).collect();
    (growths, rows)
}

fn text_of(cell: &Cell) -> String {
    if let Cell::Text(text) = cell { text.clone() } else { String::new() }
}

fn responses(
    export: &Export,
    variables: &Variables,
    plan: &mut Plan,
    set: &Responses,
    name: &str,
) -> Option<(Vec<Growth>, Vec<Vec<Cell>>)> {
    let group = plan.group(ROOT, name);
    let model = &export.study.model;
    plan.text(group, "set", &set.name);
    plan.text(group, "search", set.search.name());
    plan.text(group, "free", model.parameters.get(set.free).map_or("", |p| p.name.as_str()));
    let rows: Vec<Vec<Cell>> = set.responses.iter().map(|response| response_cells(response, model)).collect();
    (!rows.is_empty()).then(|| table(plan, group, "response", &variables.of_response(), rows))
}

/// The group of a branch, and in it that of its special points.
fn branch_groups(
    export: &Export,
    variables: &Variables,
    plan: &mut Plan,
    branch: &Branch,
    [points, special]: &[Extent; 2],
    name: &str,
) -> [Group; 2] {
    let group = plan.group(ROOT, name);
    for (column, cell) in of_branch().iter().zip(branch_cells(branch, &export.study.model, points.points)) {
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

/// What the groups of a branch have in common.
struct Planned<'v> {
    variables: &'v Variables,
    along: Vec<String>,
    profiles: bool,
}

impl Planned<'_> {
    /// `more` columns behind those that every point has, with `rows` for those of them that are texts.
    fn group(
        &self,
        plan: &mut Plan,
        group: Id,
        extent: &Extent,
        dimensions: [&str; 2],
        more: Vec<Column>,
        rows: Vec<Vec<Cell>>,
    ) -> Group {
        if extent.points == 0 {
            return Group::default();
        }
        let cycles = self.profiles && extent.nodes > 0;
        let mut out = Group::default();
        let mut columns = self.variables.of_point(cycles);
        // The place on the branch is that by which points are found.
        let numbered = dimensions[0] == "point";
        let points = plan.dimension(group, dimensions[0], extent.points, numbered.then_some(Element::Integer));
        if numbered {
            let place = columns.remove(0);
            describe(plan, points, &place);
            out.scalars.push(Growth::new(points, Class::Integer));
        }
        for column in &columns {
            out.scalars.push(self.variable(plan, group, column, &[points], &self.along));
        }
        for (k, column) in more.iter().enumerate() {
            if column.class == Class::Text {
                let id = plan.texts(group, &column.name, points, rows.iter().map(|row| text_of(&row[k])));
                describe(plan, id, column);
                out.scalars.push(Growth::new(id, Class::Text));
            } else {
                out.scalars.push(self.variable(plan, group, column, &[points], &self.along));
            }
        }
        if extent.spectrum > 0 {
            let modes = plan.dimension(group, "mode", extent.spectrum, None);
            out.modes = extent.spectrum as usize;
            for part in ["re", "im"] {
                let column = Column {
                    name: format!("spectrum_{part}"),
                    class: Class::Real,
                    unit: String::new(),
                    description: "eigenvalues of an equilibrium, Floquet multipliers of a cycle".into(),
                };
                out.spectrum.push(self.variable(plan, group, &column, &[points, modes], &self.along));
            }
        }
        if cycles {
            // At the end of the period stands the first state again.
            out.nodes = extent.nodes as usize + 1;
            let nodes = plan.dimension(group, dimensions[1], out.nodes as u64, None);
            let time = Column {
                name: "normalised_time".into(),
                class: Class::Real,
                unit: String::new(),
                description: "time over period, from 0 to 1".into(),
            };
            out.profile.push(self.variable(plan, group, &time, &[points, nodes], &[]));
            let beside = [self.along.clone(), vec![time.name]].concat();
            for state in self.variables.states() {
                out.profile.push(self.variable(plan, group, state, &[points, nodes], &beside));
            }
        }
        out
    }

    /// A variable of numbers, against which others are drawn by default.
    fn variable(&self, plan: &mut Plan, group: Id, column: &Column, over: &[Id], beside: &[String]) -> Growth {
        let id = plan.variable(group, &column.name, element(column.class), over);
        describe(plan, id, column);
        if !beside.is_empty() && !beside.contains(&column.name) {
            plan.text(id, "coordinates", &beside.join(" "));
        }
        Growth::new(id, column.class)
    }
}

impl Group {
    /// Adds the numbers of a point to the end of every variable.
    fn add(&mut self, point: &Point, cells: Vec<Cell>, laid: &mut Laid) -> std::io::Result<()> {
        self.scalars.iter_mut().zip(&cells).try_for_each(|(growth, cell)| growth.add(cell, laid))?;
        let cell = |value: Option<f64>| value.map_or(Cell::Empty, Cell::Real);
        for (k, growth) in self.spectrum.iter_mut().enumerate() {
            let part = |mode| point.spectrum.get(mode).map(|z: &num_complex::Complex64| [z.re, z.im][k]);
            (0..self.modes).try_for_each(|mode| growth.add(&cell(part(mode)), laid))?;
        }
        if let Some((time, states)) = self.profile.split_first_mut() {
            let (times, values) = profile(point).unwrap_or_default();
            let n = states.len();
            for node in 0..self.nodes {
                time.add(&cell(times.get(node).copied()), laid)?;
                for (i, growth) in states.iter_mut().enumerate() {
                    growth.add(&cell(values.get(node * n + i).copied()), laid)?;
                }
            }
        }
        Ok(())
    }

    fn flush(&mut self, laid: &mut Laid) -> std::io::Result<()> {
        let mut all = self.scalars.iter_mut().chain(&mut self.spectrum).chain(&mut self.profile);
        all.try_for_each(|growth| growth.flush(laid))
    }
}
