//! Columns of the tables.

use super::{Cell, Column, Style, Table};
use foldline::contract::VectorField;
use foldline::diagram::{Branch, Cost, Diagram, Family, Origin, Point, Shown, Solution};
use foldline::model::Model;
use foldline::special::quantity::{Quantity, appended};
use foldline::special::{impact, on_connections, phases};
use std::collections::HashMap;

/// Largest number of coefficients of a normal form: that of a double Hopf point.
const COEFFICIENTS: usize = 6;

/// Table of special points: branch, kind, every parameter, period, NAME_max of every output, unstable_before,
/// unstable_after, error, normal_form, and every coefficient with its error.
pub fn special(
    diagram: &Diagram,
    model: &Model,
    record: &[(String, Quantity)],
    kept: &dyn Fn(&Branch) -> bool,
) -> Table {
    let mut columns = vec![column("branch", Style::Word), column("kind", Style::Word)];
    columns.extend(parameter_columns(diagram, model, kept));
    columns.push(Column::in_unit(duration(model), Style::Number, &model.time));
    columns.extend(turn_columns(model));
    columns.extend(end_columns(model));
    columns.extend(output_columns(model));
    columns.extend(recorded_columns(record, model));
    columns.extend(torus_columns(diagram, kept));
    columns.extend([column("unstable_before", Style::Number), column("unstable_after", Style::Number)]);
    columns.push(column("error", Style::Size));
    columns.push(column("normal_form", Style::Word));
    let names = (1..=COEFFICIENTS).flat_map(|k| [format!("coefficient_{k}"), format!("coefficient_{k}_error")]);
    columns.extend(names.map(|name| column(&name, Style::Exact)));
    let row = |branch: &Branch, index: usize| {
        let special = &branch.special[index];
        let mut row = vec![Cell::Word(branch.name.clone()), Cell::Word(special.kind.name().into())];
        row.extend(place_cells(&special.point, model));
        row.extend(recorded_cells(&special.point, record, model));
        row.extend(torus_cells(&special.point, diagram, kept));
        let unstable = [special.unstable_before, special.unstable_after].map(|number| match branch.family {
            Family::Arc => Cell::Empty,
            _ => count(number),
        });
        row.extend(unstable.into_iter().chain([Cell::Number(special.error)]));
        let form = special.normal_form();
        row.push(if form.is_empty() { Cell::Empty } else { Cell::Word(form) });
        let number = |list: &[f64], k: usize| list.get(k).map_or(Cell::Empty, |value| Cell::Number(*value));
        row.extend(
            (0..COEFFICIENTS).flat_map(|k| [number(&special.coefficients, k), number(&special.coefficient_errors, k)]),
        );
        row
    };
    let shown = diagram.branches.iter().filter(|b| kept(b));
    let rows = shown.flat_map(|b| (0..b.special.len()).map(move |k| row(b, k))).collect();
    Table { columns, rows }
}

/// Table of all accepted points: branch, position, every parameter, period, extremes and averages of states and
/// outputs, accuracy, work, multipliers (eigenvalues), and the columns of [`contacts`].
pub fn points(
    diagram: &Diagram,
    model: &Model,
    record: &[(String, Quantity)],
    contacts: &Contacts,
    kept: &dyn Fn(&Branch) -> bool,
) -> Table {
    let mut columns = vec![column("branch", Style::Word), column("position", Style::Number)];
    columns.extend(parameter_columns(diagram, model, kept));
    columns.push(Column::in_unit(duration(model), Style::Number, &model.time));
    columns.extend(turn_columns(model));
    columns.extend(end_columns(model));
    columns.extend(output_columns(model));
    columns.extend(model.outputs.iter().map(|o| Column::in_unit(&format!("{}_min", o.name), Style::Number, &o.unit)));
    let ended = |name: &str, unit: &str, endings: [&str; 2]| {
        endings.map(|ending| Column::in_unit(&format!("{name}_{ending}"), Style::Number, unit))
    };
    columns.extend(model.states.iter().flat_map(|s| ended(&s.name, &s.unit, ["max", "min"])));
    let outputs = model.outputs.iter().map(|o| (&o.name, &o.unit));
    let channels = outputs.chain(model.states.iter().map(|s| (&s.name, &s.unit)));
    columns.extend(channels.flat_map(|(name, unit)| ended(name, unit, ["mean", "rms"])));
    columns.extend(recorded_columns(record, model));
    columns.extend(torus_columns(diagram, kept));
    columns.push(column("unstable", Style::Number));
    let sizes = ["discretisation", "residual", "trivial_defect", "liouville_defect", "spectrum_error"];
    columns.extend(sizes.map(|name| column(name, Style::Size)));
    columns.extend(WORK.map(|name| column(name, Style::Number)));
    columns.push(column("multipliers", Style::Word));
    let connecting = diagram.branches.iter().any(|b| kept(b) && b.is_connecting());
    columns.extend(connecting.then(|| column("saddle_quantity", Style::Number)));
    let others = contacts.columns.len();
    columns.extend(contacts.columns.iter().map(|(name, style)| column(name, *style)));
    let row = |branch: &Branch, point: &Point| {
        let mut row = vec![Cell::Word(branch.name.clone()), Cell::Count(point.position)];
        row.extend(place_cells(point, model));
        let n = model.states.len();
        row.extend((n..n + model.outputs.len()).map(|k| extreme(point, k, 0)));
        row.extend((0..n).flat_map(|k| [extreme(point, k, 1), extreme(point, k, 0)]));
        let of = |quantity: Quantity| quantity.of(point).map_or(Cell::Empty, Cell::Number);
        row.extend(
            (n..n + model.outputs.len()).chain(0..n).flat_map(|k| [of(Quantity::Mean(k)), of(Quantity::Rms(k))]),
        );
        row.extend(recorded_cells(point, record, model));
        row.extend(torus_cells(point, diagram, kept));
        row.push(if branch.family == Family::Arc { Cell::Empty } else { count(point.unstable) });
        let trust = point.trust;
        let sizes =
            [trust.discretisation, trust.residual, trust.trivial_defect, trust.liouville_defect, trust.spectrum];
        row.extend(sizes.map(Cell::Number));
        row.extend(work(point.cost).map(count));
        // A boundary-value problem has no multipliers.
        let hidden = branch.family == Family::Arc && !branch.is_connecting();
        row.push(Cell::Spectrum(if hidden { Vec::new() } else { point.spectrum.clone() }));
        if connecting {
            // A saddle-node has none.
            let saddle = branch.is_connecting()
                && !matches!(branch.held, Some((foldline::diagram::Kind::SaddleNodeHomoclinic, _)));
            let sigma = if saddle { on_connections::quantity_of(&point.spectrum) } else { None };
            row.push(sigma.map_or(Cell::Empty, Cell::Number));
        }
        match contacts.cells.get(&(branch.name.clone(), point.position)) {
            Some(found) => row.extend(found.iter().map(Known::cell)),
            None => row.extend((0..others).map(|_| Cell::Empty)),
        }
        row
    };
    let shown = diagram.branches.iter().filter(|b| kept(b));
    let rows = shown.flat_map(|b| b.points.iter().map(move |p| row(b, p))).collect();
    Table { columns, rows }
}

/// Columns of the quantities that the study records.
fn recorded_columns<'r>(record: &'r [(String, Quantity)], model: &'r Model) -> impl Iterator<Item = Column> + 'r {
    record.iter().map(|(name, quantity)| Column::in_unit(name, Style::Number, quantity.unit(model)))
}

fn recorded_cells<'r>(
    point: &'r Point,
    record: &'r [(String, Quantity)],
    model: &'r Model,
) -> impl Iterator<Item = Cell> + 'r {
    let value = |index: usize| appended(index, model).of(point).filter(|value| value.is_finite());
    (0..record.len()).map(move |index| value(index).map_or(Cell::Empty, Cell::Number))
}

/// A value of [`Contacts`].
pub enum Known {
    Count(usize),
    Number(f64),
    Text(String),
}

impl Known {
    fn cell(&self) -> Cell {
        match self {
            Known::Count(value) => count(*value),
            Known::Number(value) => Cell::Number(*value),
            Known::Text(text) => Cell::Word(text.clone()),
        }
    }
}

/// Columns about the switchings of cycles, and their values by branch and position.
#[derive(Default)]
pub struct Contacts {
    columns: Vec<(String, Style)>,
    cells: HashMap<(String, i64), Vec<Known>>,
}

/// For every switch h of a model the number of phases per period in which h > 0 and their share of the period, and the
/// sequence of all phases; for a model with events their number per period, the sum over them of the largest change of a
/// state, and their order. The points need their profiles.
pub fn contacts(diagram: &Diagram, model: &Model) -> Contacts {
    let switches = 0..model.switch_count() - model.event_count();
    if model.switch_count() == 0 {
        return Contacts::default();
    }
    let named = |switch: usize| model.switch_name(switch);
    let mut columns: Vec<(String, Style)> = switches
        .clone()
        .flat_map(|k| [format!("phases({} > 0)", named(k)), format!("share({} > 0)", named(k))])
        .map(|name| (name, Style::Number))
        .collect();
    if !switches.is_empty() {
        columns.push(("sequence".into(), Style::Word));
    }
    if model.event_count() > 0 {
        columns.extend(["events", "impulse"].map(|name| (name.to_string(), Style::Number)));
        columns.push(("order".into(), Style::Word));
    }
    let of = |point: &Point| -> Option<Vec<Known>> {
        let Solution::Cycle(cycle) = &point.solution else { return None };
        let all = phases::phases(model, &point.parameters, cycle);
        if all.is_empty() {
            return None;
        }
        let numbers = switches.clone().flat_map(|k| {
            [Known::Count(phases::times_positive(&all, k)), Known::Number(phases::share_positive(&all, k))]
        });
        let text = (!switches.is_empty()).then(|| Known::Text(phases::sequence(model, &all)));
        let mut values: Vec<Known> = numbers.chain(text).collect();
        if model.event_count() > 0 {
            let own = impact::sequence(model, &point.parameters, cycle);
            values.extend([Known::Count(own.count), Known::Number(own.change), Known::Text(own.text())]);
        }
        Some(values)
    };
    let points = diagram.branches.iter().flat_map(|branch| branch.points.iter().map(move |point| (branch, point)));
    let cells = points.filter_map(|(branch, point)| Some(((branch.name.clone(), point.position), of(point)?)));
    Contacts { cells: cells.collect(), columns }
}

/// Names of the work counters, in the order of [`work`].
const WORK: [&str; 5] = ["newton", "factorisations", "rejected", "evaluations", "linearisations"];

fn work(cost: Cost) -> [usize; 5] {
    [cost.newton, cost.factorisations, cost.rejected, cost.evaluations, cost.linearisations]
}

/// Table of branches: origin, range, ends of both sides, work. A curve in two parameters also shows the point continued
/// and the range of its second parameter.
pub fn branches(diagram: &Diagram, model: &Model, kept: &dyn Fn(&Branch) -> bool) -> Table {
    let words = ["branch", "family", "held", "free", "follows", "origin"].map(|name| column(name, Style::Word));
    let numbers = ["from", "to", "follows_from", "follows_to", "points", "special"].into_iter().chain(WORK);
    let ends = ["backward_end", "forward_end"].map(|name| column(name, Style::Word));
    let columns = words.into_iter().chain(numbers.map(|name| column(name, Style::Number))).chain(ends).collect();
    let row = |branch: &Branch| {
        let other = branch.also.first().map(|(index, _)| *index);
        let moving = [Some(branch.free), branch.held.map(|(_, follows)| follows).or(other)];
        let name = |index: Option<usize>| {
            index.and_then(|k| model.parameters.get(k)).map_or(Cell::Empty, |p| Cell::Word(p.name.clone()))
        };
        let mut row = vec![
            Cell::Word(branch.name.clone()),
            Cell::Word(branch.family.name().into()),
            match (branch.held, &branch.levels[..]) {
                (Some((kind, _)), _) => Cell::Word(kind.name().into()),
                (None, []) => Cell::Empty,
                (None, levels) => {
                    let each = levels.iter().map(|(name, value)| format!("{name} = {}", Shown(*value)));
                    Cell::Word(each.collect::<Vec<_>>().join(", "))
                }
            },
            name(moving[0]),
            name(moving[1]),
            Cell::Word(origin(&branch.origin)),
        ];
        row.extend(moving.into_iter().flat_map(|index| reach(branch, index)));
        row.extend([branch.points.len(), branch.special.len()].map(count));
        row.extend(work(branch.cost()).map(count));
        row.extend(branch.ends.iter().map(|end| end.as_ref().map_or(Cell::Empty, |e| Cell::Word(e.to_string()))));
        row
    };
    Table { columns, rows: diagram.branches.iter().filter(|b| kept(b)).map(row).collect() }
}

/// Smallest and largest value of a parameter along a branch.
fn reach(branch: &Branch, parameter: Option<usize>) -> [Cell; 2] {
    let values = || parameter.into_iter().flat_map(|k| branch.points.iter().filter_map(move |p| p.parameters.get(k)));
    let bounds = [values().copied().reduce(f64::min), values().copied().reduce(f64::max)];
    bounds.map(|bound| bound.map_or(Cell::Empty, Cell::Number))
}

/// Table of remarks, each with its subject; only those about `name` if given.
pub fn notes(notes: &[(String, String)], name: Option<&str>) -> Table {
    let columns = ["about", "note"].map(|name| column(name, Style::Word)).into();
    let shown = notes.iter().filter(|(about, _)| name.is_none_or(|name| name == about));
    let rows = shown.map(|(about, note)| vec![Cell::Word(about.clone()), Cell::Word(note.clone())]).collect();
    Table { columns, rows }
}

/// Columns NAME_turns: number of turns over a cycle of each state that is an angle.
/// Names of the columns that appear where branches of tori are shown: the rotation number, both angular frequencies, and
/// the number of trajectories.
const OF_TORI: [&str; 4] = ["rotation", "frequency_1", "frequency_2", "phases"];

fn shows_tori(diagram: &Diagram, kept: &dyn Fn(&Branch) -> bool) -> bool {
    diagram.branches.iter().any(|branch| branch.family == Family::Torus && kept(branch))
}

fn torus_columns(diagram: &Diagram, kept: &dyn Fn(&Branch) -> bool) -> Vec<Column> {
    let names = OF_TORI.iter().filter(|_| shows_tori(diagram, kept));
    names.map(|name| column(name, Style::Number)).collect()
}

fn torus_cells(point: &Point, diagram: &Diagram, kept: &dyn Fn(&Branch) -> bool) -> Vec<Cell> {
    if !shows_tori(diagram, kept) {
        return Vec::new();
    }
    let Solution::Torus(torus) = &point.solution else { return OF_TORI.map(|_| Cell::Empty).into() };
    let [first, second] = torus.frequencies();
    let phases = if point.solution.is_stored() { count(torus.phases()) } else { Cell::Empty };
    vec![Cell::Number(torus.rotation), Cell::Number(first), Cell::Number(second), phases]
}

fn turn_columns(model: &Model) -> impl Iterator<Item = Column> {
    model.angles().map(|(k, _)| column(&format!("{}_turns", model.states[k].name), Style::Number))
}

/// Name of the column of periods, or of the length of the interval of a boundary-value problem.
fn duration(model: &Model) -> &'static str {
    if model.conditions() == [0, 0] { "period" } else { "length" }
}

/// The states at both ends of the interval of a boundary-value problem: index, place, and name of the column.
fn ends(model: &Model) -> impl Iterator<Item = (usize, f64, String)> {
    let places: &[f64] = if model.conditions() == [0, 0] { &[] } else { &[0.0, 1.0] };
    let states = model.states.iter().enumerate();
    states.flat_map(move |(k, state)| places.iter().map(move |at| (k, *at, format!("{}@{at}", state.name))))
}

fn end_columns(model: &Model) -> impl Iterator<Item = Column> {
    ends(model).map(|(k, _, name)| Column::in_unit(&name, Style::Number, &model.states[k].unit))
}

fn origin(origin: &Origin) -> String {
    match origin {
        Origin::Seed(name) => format!("seed {name}"),
        Origin::EndOf(name) => format!("end of {name}"),
        Origin::Switch { parent, kind, parameter } => format!("{kind} of {parent} at {:.6}", Shown(*parameter)),
    }
}

/// Columns of the parameters. Those that vary along a branch are shown even if there is only one row.
fn parameter_columns(diagram: &Diagram, model: &Model, kept: &dyn Fn(&Branch) -> bool) -> Vec<Column> {
    let shown = || diagram.branches.iter().filter(|b| kept(b));
    let varies = |index: usize| {
        shown().any(|b| {
            b.free == index
                || b.held.is_some_and(|(_, follows)| follows == index)
                || b.also.iter().any(|(other, _)| *other == index)
        })
    };
    let style = |index: usize| if varies(index) { Style::Number } else { Style::Varying };
    model.parameters.iter().enumerate().map(|(index, p)| Column::in_unit(&p.name, style(index), &p.unit)).collect()
}

/// Columns of the parameters and of the period.
pub fn place_names(diagram: &Diagram, model: &Model, kept: &dyn Fn(&Branch) -> bool) -> Vec<Column> {
    let mut columns = parameter_columns(diagram, model, kept);
    columns.push(Column::in_unit(duration(model), Style::Number, &model.time));
    columns
}

/// Cells of these columns.
pub fn places(point: &Point, model: &Model) -> Vec<Cell> {
    let mut cells: Vec<Cell> = (0..model.parameters.len())
        .map(|k| point.parameters.get(k).map_or(Cell::Empty, |v| Cell::Number(*v)))
        .collect();
    cells.push(point.solution.period().map_or(Cell::Empty, Cell::Number));
    cells
}

fn output_columns(model: &Model) -> impl Iterator<Item = Column> {
    model.outputs.iter().map(|o| Column::in_unit(&format!("{}_max", o.name), Style::Number, &o.unit))
}

/// Cells of every parameter, the period and the maximum of every output.
fn place_cells(point: &Point, model: &Model) -> Vec<Cell> {
    let parameters =
        (0..model.parameters.len()).map(|k| point.parameters.get(k).map_or(Cell::Empty, |v| Cell::Number(*v)));
    let period = point.solution.period().map_or(Cell::Empty, Cell::Number);
    let n = model.states.len();
    let turns = model.angles().map(|(k, turn)| match point.solution.period() {
        Some(_) => Cell::Count(point.solution.turns(k, turn)),
        None => Cell::Empty,
    });
    let at_ends =
        ends(model).map(|(k, at, _)| Quantity::At(k, at.to_bits()).of(point).map_or(Cell::Empty, Cell::Number));
    parameters
        .chain([period])
        .chain(turns)
        .chain(at_ends)
        .chain((n..n + model.outputs.len()).map(|k| extreme(point, k, 1)))
        .collect()
}

fn extreme(point: &Point, variable: usize, end: usize) -> Cell {
    point.ranges.get(variable).map_or(Cell::Empty, |range| Cell::Number(range[end]))
}

fn column(name: &str, style: Style) -> Column {
    Column::new(name, style)
}

fn count(value: usize) -> Cell {
    Cell::Count(i64::try_from(value).unwrap_or(i64::MAX))
}
