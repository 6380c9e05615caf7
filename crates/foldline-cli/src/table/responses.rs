//! Tables of surveys and sweeps.

use super::{Cell, Column, Style, Table};
use foldline::diagram::{Diagram, Motion, Response, Responses, Search, Shown};
use foldline::model::{Model, Output, State};

/// Maximum number of states whose extremes are shown beside those of outputs.
const SHOWN: usize = 4;

/// Table with one row per response: set, search, every parameter, motion, ratio, multiplicity, period, the extremes of
/// outputs and states, hits, the share of the uniform starts of a survey with its 95 % confidence interval, time until
/// settled, error, whether a sweep jumped there, rotation number and largest exponent with their errors, and why the
/// type of the motion was not decided.
pub fn responses(diagram: &Diagram, model: &Model) -> Table {
    let mut columns = words(&["set", "search"]);
    columns.extend(model.parameters.iter().map(|p| Column::in_unit(&p.name, Style::Varying, &p.unit)));
    columns.extend(words(&["motion", "ratio"]));
    columns.extend([column("multiplicity", Style::Number), Column::in_unit("period", Style::Number, &model.time)]);
    let extremes = |own: &Output| {
        ["min", "max"].map(|end| Column::in_unit(&format!("{}_{end}", own.name), Style::Number, &own.unit))
    };
    columns.extend(model.outputs.iter().flat_map(extremes));
    // For large models with outputs, the outputs are of interest.
    let style = if model.outputs.is_empty() || model.states.len() <= SHOWN { Style::Number } else { Style::Exact };
    let of_state =
        |own: &State| ["min", "max"].map(|end| Column::in_unit(&format!("{}_{end}", own.name), style, &own.unit));
    columns.extend(model.states.iter().flat_map(of_state));
    columns.extend(["hits", "share", "share_low", "share_high"].map(|name| column(name, Style::Number)));
    columns.push(Column::in_unit("settled_after", Style::Size, &model.time));
    columns.extend([column("error", Style::Size), column("jump", Style::Word)]);
    columns
        .extend(["rotation", "rotation_error", "exponent", "exponent_error"].map(|name| column(name, Style::Varying)));
    columns.push(column("undecided", Style::Word));
    let row = |set: &Responses, response: &Response, jump: &str| {
        let mut row = vec![Cell::Word(set.name.clone()), Cell::Word(set.search.name().into())];
        let parameter = |k: usize| response.parameters.get(k).map_or(Cell::Empty, |v| Cell::Number(*v));
        row.extend((0..model.parameters.len()).map(parameter));
        row.push(Cell::Word(response.motion.name().into()));
        row.push(Cell::Word(response.ratio.map_or_else(String::new, |(a, b)| format!("{a}:{b}"))));
        row.push(Cell::Count(response.multiplicity.into()));
        row.push(response.period.map_or(Cell::Empty, Cell::Number));
        let n = model.states.len();
        let range = |k: usize| response.ranges.get(k).map_or([Cell::Empty, Cell::Empty], |r| r.map(Cell::Number));
        row.extend((n..n + model.outputs.len()).chain(0..n).flat_map(range));
        row.push(count(response.hits));
        let share = response.share.filter(|share| share.of > 0).map(|share| (share.value(), share.interval()));
        row.extend(share.map_or([Cell::Empty, Cell::Empty, Cell::Empty], |(value, [low, high])| {
            [value, low, high].map(Cell::Number)
        }));
        row.push(Cell::Number(response.settled_after));
        row.push(if response.error.is_nan() { Cell::Empty } else { Cell::Number(response.error) });
        row.push(Cell::Word(jump.into()));
        let known = &response.recognition;
        row.extend([known.rotation, known.exponent].into_iter().flat_map(|pair| match pair {
            Some(pair) => pair.map(Cell::Number),
            None => [Cell::Empty, Cell::Empty],
        }));
        row.push(Cell::Word(known.reason.clone()));
        row
    };
    let rows = diagram.responses.iter().flat_map(|set| {
        let jumps = jumps(set);
        let word = move |k: usize, r: &Response| match (jumps.contains(&k), r.jumped) {
            (true, _) => "jump",
            (false, None) if k > 0 && set.search == Search::Sweep => "unknown",
            _ => "",
        };
        set.responses.iter().enumerate().map(move |(k, r)| row(set, r, word(k, r))).collect::<Vec<_>>()
    });
    Table { columns, rows: rows.collect() }
}

/// Table with one row per set: what it varied, how many values it visited, which motions it met, where it jumped.
pub fn summary(diagram: &Diagram, model: &Model) -> Table {
    let mut columns = words(&["set", "search", "free"]);
    columns.extend(["from", "to", "values"].map(|name| column(name, Style::Number)));
    columns.extend(Motion::ALL.map(|motion| column(motion.name(), Style::Number)));
    columns.push(column("jumps_at", Style::Word));
    let row = |set: &Responses| {
        let mut values: Vec<f64> = set.responses.iter().map(|r| r.value).collect();
        values.dedup();
        let bound = |value: Option<&f64>| value.map_or(Cell::Empty, |v| Cell::Number(*v));
        let free = model.parameters.get(set.free).map_or_else(String::new, |p| p.name.clone());
        let mut row = vec![Cell::Word(set.name.clone()), Cell::Word(set.search.name().into()), Cell::Word(free)];
        row.extend([bound(values.first()), bound(values.last()), count(values.len())]);
        row.extend(Motion::ALL.map(|motion| count(set.responses.iter().filter(|r| r.motion == motion).count())));
        let places: Vec<String> = jumps(set).iter().map(|k| format!("{:.6}", Shown(set.responses[*k].value))).collect();
        row.push(Cell::Word(places.join(" ")));
        row
    };
    Table { columns, rows: diagram.responses.iter().map(row).collect() }
}

/// Positions of the jumps of a sweep. A survey takes new starts at every value and does not jump.
fn jumps(set: &Responses) -> Vec<usize> {
    if set.search == Search::Sweep { set.jumps() } else { Vec::new() }
}

fn words(names: &[&str]) -> Vec<Column> {
    names.iter().map(|name| column(name, Style::Word)).collect()
}

fn column(name: &str, style: Style) -> Column {
    Column::new(name, style)
}

fn count(value: usize) -> Cell {
    Cell::Count(i64::try_from(value).unwrap_or(i64::MAX))
}
