//! Which columns the tables have.

use super::{Cell, Column, Style, Table};
use foldline::diagram::{Branch, Diagram, Origin, Point};
use foldline::model::Model;

/// branch, kind, every parameter, period, NAME_max of every output, unstable_before, unstable_after, error.
pub fn special(diagram: &Diagram, model: &Model) -> Table {
    let mut columns = vec![column("branch", Style::Word), column("kind", Style::Word)];
    columns.extend(parameter_columns(model));
    columns.push(column("period", Style::Number));
    columns.extend(output_columns(model));
    columns.extend([column("unstable_before", Style::Number), column("unstable_after", Style::Number)]);
    columns.push(column("error", Style::Size));
    let row = |branch: &Branch, index: usize| {
        let special = &branch.special[index];
        let mut row = vec![Cell::Word(branch.name.clone()), Cell::Word(special.kind.name().into())];
        row.extend(place_cells(&special.point, model));
        row.extend([count(special.unstable_before), count(special.unstable_after), Cell::Number(special.error)]);
        row
    };
    let rows = diagram.branches.iter().flat_map(|b| (0..b.special.len()).map(move |k| row(b, k))).collect();
    Table { columns, rows }
}

/// As above for every accepted point, and position, the extremes of the states, multipliers (eigenvalues), accuracy, work.
pub fn points(diagram: &Diagram, model: &Model) -> Table {
    let mut columns = vec![column("branch", Style::Word), column("position", Style::Number)];
    columns.extend(parameter_columns(model));
    columns.push(column("period", Style::Number));
    columns.extend(output_columns(model));
    columns.extend(model.outputs.iter().map(|o| column(&format!("{}_min", o.name), Style::Number)));
    let extremes = |name: &str| [format!("{name}_max"), format!("{name}_min")];
    columns.extend(model.states.iter().flat_map(|s| extremes(&s.name)).map(|name| column(&name, Style::Number)));
    columns.push(column("unstable", Style::Number));
    let sizes = ["discretisation", "residual", "trivial_defect", "liouville_defect"];
    columns.extend(sizes.map(|name| column(name, Style::Size)));
    columns.extend(["newton", "factorisations", "rejected"].map(|name| column(name, Style::Number)));
    columns.push(column("multipliers", Style::Word));
    let row = |branch: &Branch, point: &Point| {
        let mut row = vec![Cell::Word(branch.name.clone()), Cell::Count(point.position)];
        row.extend(place_cells(point, model));
        let n = model.states.len();
        row.extend((n..n + model.outputs.len()).map(|k| extreme(point, k, 0)));
        row.extend((0..n).flat_map(|k| [extreme(point, k, 1), extreme(point, k, 0)]));
        row.push(count(point.unstable));
        let trust = point.trust;
        let sizes = [trust.discretisation, trust.residual, trust.trivial_defect, trust.liouville_defect];
        row.extend(sizes.map(Cell::Number));
        row.extend([point.cost.newton, point.cost.factorisations, point.cost.rejected].map(count));
        row.push(Cell::Spectrum(point.spectrum.clone()));
        row
    };
    let rows = diagram.branches.iter().flat_map(|b| b.points.iter().map(move |p| row(b, p))).collect();
    Table { columns, rows }
}

/// One row for each branch: where it comes from, how far it reaches, how its two sides ended, what it cost.
pub fn branches(diagram: &Diagram, model: &Model) -> Table {
    let words = ["branch", "family", "free", "origin"].map(|name| column(name, Style::Word));
    let numbers = ["from", "to", "points", "special", "newton", "factorisations", "rejected"];
    let ends = ["backward_end", "forward_end"].map(|name| column(name, Style::Word));
    let columns = words.into_iter().chain(numbers.map(|name| column(name, Style::Number))).chain(ends).collect();
    let row = |branch: &Branch| {
        let values = || branch.points.iter().filter_map(|p| p.parameters.get(branch.free).copied());
        let bound = |value: f64| if branch.points.is_empty() { Cell::Empty } else { Cell::Number(value) };
        let cost = branch.cost();
        let mut row = vec![
            Cell::Word(branch.name.clone()),
            Cell::Word(branch.family.name().into()),
            Cell::Word(model.parameters.get(branch.free).map_or_else(String::new, |p| p.name.clone())),
            Cell::Word(origin(&branch.origin)),
            bound(values().fold(f64::INFINITY, f64::min)),
            bound(values().fold(f64::NEG_INFINITY, f64::max)),
        ];
        let counts = [branch.points.len(), branch.special.len(), cost.newton, cost.factorisations, cost.rejected];
        row.extend(counts.map(count));
        row.extend(branch.ends.iter().map(|end| end.as_ref().map_or(Cell::Empty, |e| Cell::Word(e.to_string()))));
        row
    };
    Table { columns, rows: diagram.branches.iter().map(row).collect() }
}

fn origin(origin: &Origin) -> String {
    match origin {
        Origin::Seed(name) => format!("seed {name}"),
        Origin::EndOf(name) => format!("end of {name}"),
        Origin::Switch { parent, kind, parameter } => format!("{kind} of {parent} at {parameter:.6}"),
    }
}

fn parameter_columns(model: &Model) -> impl Iterator<Item = Column> {
    model.parameters.iter().map(|p| column(&p.name, Style::Varying))
}

fn output_columns(model: &Model) -> impl Iterator<Item = Column> {
    model.outputs.iter().map(|o| column(&format!("{}_max", o.name), Style::Number))
}

/// Every parameter, the period, the largest value of every output.
fn place_cells(point: &Point, model: &Model) -> Vec<Cell> {
    let parameters =
        (0..model.parameters.len()).map(|k| point.parameters.get(k).map_or(Cell::Empty, |v| Cell::Number(*v)));
    let period = point.solution.period().map_or(Cell::Empty, Cell::Number);
    let n = model.states.len();
    parameters.chain([period]).chain((n..n + model.outputs.len()).map(|k| extreme(point, k, 1))).collect()
}

fn extreme(point: &Point, variable: usize, end: usize) -> Cell {
    point.ranges.get(variable).map_or(Cell::Empty, |range| Cell::Number(range[end]))
}

fn column(name: &str, style: Style) -> Column {
    Column { name: name.to_string(), style }
}

fn count(value: usize) -> Cell {
    Cell::Count(i64::try_from(value).unwrap_or(i64::MAX))
}
