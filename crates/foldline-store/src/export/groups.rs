//! Points of a branch as variables of a NetCDF group.

use super::cells::{Cell, profile};
use super::columns::{Class, Column, Variables};
use super::hdf5::{Element, Id, Laid, Plan};
use crate::run_file::Extent;
use foldline::diagram::Point;

/// Number of bytes of a variable that are buffered before they are written.
const PIECE: usize = 1 << 16;

/// Variable whose elements are appended one after the other.
pub(super) struct Growth {
    id: Id,
    class: Class,
    next: u64,
    bytes: Vec<u8>,
}

impl Growth {
    pub(super) fn new(id: Id, class: Class) -> Growth {
        Growth { id, class, next: 0, bytes: Vec::new() }
    }

    pub(super) fn add(&mut self, cell: &Cell, laid: &mut Laid) -> std::io::Result<()> {
        match (self.class, cell) {
            (Class::Text, _) => return Ok(()),
            (Class::Integer, Cell::Integer(value)) => self.bytes.extend(value.to_le_bytes()),
            (Class::Integer, _) => self.bytes.extend([0; 8]),
            (Class::Real, Cell::Real(value)) => self.bytes.extend(value.to_le_bytes()),
            (Class::Real, _) => self.bytes.extend(f64::NAN.to_le_bytes()),
        }
        if self.bytes.len() >= PIECE { self.flush(laid) } else { Ok(()) }
    }

    pub(super) fn flush(&mut self, laid: &mut Laid) -> std::io::Result<()> {
        if !self.bytes.is_empty() {
            laid.put(self.id, self.next, &self.bytes)?;
        }
        self.next += self.bytes.len() as u64 / 8;
        self.bytes.clear();
        Ok(())
    }
}

/// Variables of the points, or of the special points, of a branch.
#[derive(Default)]
pub(super) struct Group {
    scalars: Vec<Growth>,
    spectrum: Vec<Growth>,
    modes: usize,
    profile: Vec<Growth>,
    /// Number of nodes of a profile; 0 without profiles.
    pub(super) nodes: usize,
}

pub(super) fn element(class: Class) -> Element {
    match class {
        Class::Text => Element::Text,
        Class::Integer => Element::Integer,
        Class::Real => Element::Real,
    }
}

pub(super) fn describe(plan: &mut Plan, id: Id, column: &Column) {
    plan.text(id, "long_name", &column.description);
    if !column.unit.is_empty() {
        plan.text(id, "units", &column.unit);
    }
}

pub(super) fn text_of(cell: &Cell) -> String {
    if let Cell::Text(text) = cell { text.clone() } else { String::new() }
}

/// Settings shared by the groups of a branch.
pub(super) struct Planned<'v> {
    pub(super) variables: &'v Variables,
    /// Names of the parameters that vary along the branch.
    pub(super) along: Vec<String>,
    pub(super) profiles: bool,
}

impl Planned<'_> {
    /// Plans the variables of a group: the columns of every point, then `more`, whose text cells are taken from `rows`.
    pub(super) fn group(
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
        // The position on the branch is the coordinate of the point dimension.
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
                let id = plan.texts(group, &column.name, &[points], rows.iter().map(|row| text_of(&row[k])));
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
            // The first state is repeated at the end of the period.
            out.nodes = extent.nodes as usize + 1;
            let nodes = plan.dimension(group, dimensions[1], out.nodes as u64, None);
            let time = Column {
                name: "normalised_time".into(),
                class: Class::Real,
                unit: String::new(),
                description: "time divided by the period, from 0 to 1".into(),
            };
            out.profile.push(self.variable(plan, group, &time, &[points, nodes], &[]));
            let beside = [self.along.clone(), vec![time.name]].concat();
            for state in self.variables.states() {
                out.profile.push(self.variable(plan, group, state, &[points, nodes], &beside));
            }
        }
        out
    }

    /// Plans a numeric variable; `beside` names the variables against which it is plotted by default.
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
    /// Appends the numbers of a point to every variable.
    pub(super) fn add(&mut self, point: &Point, cells: Vec<Cell>, laid: &mut Laid) -> std::io::Result<()> {
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

    pub(super) fn flush(&mut self, laid: &mut Laid) -> std::io::Result<()> {
        let mut all = self.scalars.iter_mut().chain(&mut self.spectrum).chain(&mut self.profile);
        all.try_for_each(|growth| growth.flush(laid))
    }
}
