//! `[[branch]]`: branches to continue.

use super::holds;
use super::items::{Ground, Item, Known, max_points, origin};
use super::unknown_parameter;
use crate::nearest::suggest;
use crate::toml_walk::{Value, Walk};
use foldline::contract::VectorField;
use foldline::diagram::{Kind, Shown};
use foldline::explore::plan::Holds;
use foldline::explore::{BranchPlan, Start, Switching};
use foldline::model::{Model, Parameter, unsupported};
use foldline::special::mark::Mark;
use foldline::special::quantity::Quantity;
use std::ops::Range;
use toml::de::DeTable;

pub(super) const KEYS: [&str; 13] = [
    "name",
    "description",
    "from",
    "free",
    "hold",
    "near",
    "range",
    "until",
    "switch",
    "mark",
    "stop",
    "peaks",
    "max-points",
];
const SWITCHABLE: [Kind; 4] = [Kind::PeriodDoubling, Kind::BranchPoint, Kind::Hopf, Kind::Torus];

/// Reads a branch and adds its plan to the items read so far.
pub(super) fn read(
    walk: &mut Walk,
    item: &Item,
    name: Option<String>,
    ground: &mut Ground,
    all: &[Item],
) -> Option<Known> {
    let table = item.table;
    walk.only(table, &KEYS, "a branch");
    let origin = origin(walk, item, ground, all);
    let several = table.get("free").is_some_and(|value| value.get_ref().is_array());
    let mut held = (several || table.contains_key("hold")).then(|| holds::read(walk, item, ground.model));
    if let Some(Some(held)) = &mut held {
        holds::others(walk, item, held, ground.model);
    }
    let free = match &held {
        Some(held) => held.as_ref().map(|held| held.free),
        None => free(walk, item, ground.model),
    };
    if held.is_none()
        && let Some(value) = table.get("near")
    {
        walk.report(value.span(), "`near` selects the start of a branch with `hold`", "remove it, or add `hold`");
    }
    let switching = table.get("switch").map(|value| switching(walk, value)).unwrap_or_default();
    let marks = marks(walk, table, ground.model);
    let max_points = max_points(walk, item);
    let start_value = origin.as_ref().zip(free).and_then(|((_, at, _), free)| at[free]);
    let own = free.map(|f| &ground.model.parameters[f]);
    let bounds = match &held {
        Some(held) => holds::bounds(walk, item, held.as_ref(), start_value, own),
        None => bounds(walk, item, start_value, own),
    };
    if let (Some(Some(held)), Some((start, _, family))) = (&held, &origin) {
        holds::fits(walk, item, held, start, *family, ground);
    }
    if let (None, Some(index), Some(value)) = (&held, free, table.get("peaks"))
        && marks.iter().any(|mark| mark.peak && matches!(mark.quantity, Quantity::Parameter(_)))
    {
        let name = &ground.model.parameters[index].name;
        let message = format!("{name} turns at folds, which are found anyway, and the other parameters are constant");
        walk.report(value.span(), message, "quantities of the solution, such as `peaks = [\"x_max\"]`");
    }
    if let (None, Some(free), Some((range, _))) = (&held, free, &bounds) {
        within(walk, table, ground.model, free, *range, &marks);
    }
    if (ground.model.forced() || ground.model.iterated())
        && let Some(value) = table.get("switch")
        && (switching.at(Kind::Hopf) > 0 || switching.only.iter().any(|(kind, ..)| *kind == Kind::Hopf))
    {
        let what = if ground.model.iterated() { "of a map" } else { "of a forced model" };
        let message = format!("`switch` at hopf: the solutions {what} are cycles, which have no Hopf points");
        walk.report(
            value.span(),
            message,
            "`period-doubling` or `branch-point`; the pairs of cycles pass in `torus` points",
        );
    }
    let (name, (start, beginning, family), free, (range, until)) = (name?, origin?, free?, bounds?);
    let mut end = beginning.clone();
    end[free] = until;
    let holds = match held {
        Some(held) => held?.holds,
        None => Holds::default(),
    };
    holds.others.iter().for_each(|(other, _)| end[*other] = None);
    // The start is a mark on the branch from which this one starts.
    if let Start::EndOf(parent) | Start::EndOfSwitched(parent, _) = &start {
        let sought = holds.levels.iter().filter(|level| level.value.is_finite());
        let sought: Vec<Mark> = sought.map(|level| Mark::at(level.quantity, level.value, false)).collect();
        let BranchPlan { marks, holds: kept, .. } = &mut ground.items.branches[*parent];
        for mark in sought {
            // What the parent holds too does not change along it.
            let constant = kept.levels.iter().any(|level| level.quantity == mark.quantity);
            if !constant && !marks.iter().any(|own| own.quantity == mark.quantity && own.value == mark.value) {
                marks.push(mark);
            }
        }
    }
    let index = ground.items.branches.len();
    ground.items.branches.push(BranchPlan {
        name: name.clone(),
        start,
        free,
        range,
        until,
        switching,
        marks,
        max_points,
        holds,
    });
    Some(Known { name, start: Start::EndOf(index), beginning, end: Some(end), family })
}

/// Reads the kind and the number in a name such as `period-doubling-2`, the name of a branch that starts at that point.
pub(super) fn switch_step(step: &str) -> Option<(Kind, usize)> {
    let (kind, number) = step.rsplit_once('-')?;
    let kind = Kind::from_name(kind).filter(|kind| SWITCHABLE.contains(kind))?;
    Some((kind, number.parse().ok().filter(|n| *n > 0)?))
}

/// Reads the free parameter.
pub(super) fn free(walk: &mut Walk, item: &Item, model: &Model) -> Option<usize> {
    let Some(value) = item.table.get("free") else {
        let example = model.parameters.first().map_or("mu", |p| p.name.as_str());
        walk.report(
            item.span.clone(),
            format!("this {} has no free parameter", item.what),
            format!("add a line such as `free = \"{example}\"`"),
        );
        return None;
    };
    let name = walk.string(value, "`free`")?;
    let index = model.parameter_index(&name);
    if index.is_none() {
        unknown_parameter(walk, value.span(), &name, model);
    }
    if index.is_some_and(|index| model.determined().contains(&index)) {
        let message = format!("`{name}` is determined by the conditions of the model");
        walk.report(value.span(), message, "choose a parameter that is not listed under `solve` in the model");
    }
    index
}

/// Reads `range` and the target `until`. With a target alone, the range extends from the start to the target.
pub(super) fn bounds(
    walk: &mut Walk,
    item: &Item,
    start: Option<f64>,
    free: Option<&Parameter>,
) -> Option<([f64; 2], Option<f64>)> {
    let (what, table) = (item.what, item.table);
    let unit = free.map_or("", |own| &own.unit);
    let free = free.map_or("the free parameter", |own| &own.name);
    let until = table.get("until").map(|value| (value.span(), walk.quantity(value, "`until`", unit)));
    let range = match (table.get("range"), &until) {
        (Some(value), _) => {
            let range = range(walk, value, unit)?;
            contains_start(walk, what, value.span(), range, start, free);
            range
        }
        (None, Some((_, Some(target)))) => {
            let start = start.unwrap_or(*target);
            [start.min(*target), start.max(*target)]
        }
        (None, Some((_, None))) => return None,
        (None, None) => {
            let message = format!("this {what} has neither `range` nor `until`");
            walk.report(item.span.clone(), message, "add a line such as `range = [0.5, 12]`");
            return None;
        }
    };
    let Some((at, target)) = until else { return Some((range, None)) };
    let target = target?;
    if target < range[0] || target > range[1] {
        let message = format!(
            "the target {} is outside the range from {} to {}",
            Shown(target),
            Shown(range[0]),
            Shown(range[1])
        );
        walk.report(at, message, "a value within the range");
    } else if start == Some(target) {
        let message = format!("the {what} already starts at {free} = {target}", target = Shown(target));
        walk.report(at, message, "a target other than the start");
    }
    Some((range, Some(target)))
}

/// Reports a start outside the range.
pub(super) fn contains_start(
    walk: &mut Walk,
    what: &str,
    at: Range<usize>,
    range: [f64; 2],
    start: Option<f64>,
    parameter: &str,
) {
    if let Some(start) = start.filter(|s| *s < range[0] || *s > range[1]) {
        let message = format!("the {what} starts at {parameter} = {start}, outside its range", start = Shown(start));
        walk.report(at, message, format!("a range that contains {start}, or another start", start = Shown(start)));
    }
}

/// Reads a pair of numbers with a unit, the smaller first.
pub(super) fn range(walk: &mut Walk, value: &Value, unit: &str) -> Option<[f64; 2]> {
    let Some(list) = value.get_ref().as_array().filter(|list| list.len() == 2) else {
        walk.report(value.span(), "the range is not a pair of numbers", "write `range = [smallest, largest]`");
        return None;
    };
    let ends: Vec<f64> = list.iter().filter_map(|end| walk.quantity(end, "an end of the range", unit)).collect();
    let [low, high] = ends[..] else { return None };
    if low > high {
        walk.report(
            value.span(),
            format!("the range from {low} to {high} is the wrong way round", low = Shown(low), high = Shown(high)),
            format!("write [{high}, {low}]", low = Shown(low), high = Shown(high)),
        );
        return None;
    }
    if low == high {
        walk.report(value.span(), "the range is empty", "two different numbers, the smaller first");
        return None;
    }
    // The step is a distance, the root of a sum of squares.
    if !((high - low) * (high - low)).is_finite() {
        let message =
            format!("the range from {} to {} is too wide: its square is not a finite number", Shown(low), Shown(high));
        walk.report(value.span(), message, "give the values between which the parameter can lie");
        return None;
    }
    Some([low, high])
}

/// Reports values of the free parameter to mark, or to stop at, that the branch cannot reach.
fn within(walk: &mut Walk, table: &DeTable, model: &Model, free: usize, [low, high]: [f64; 2], marks: &[Mark]) {
    let name = &model.parameters[free].name;
    for mark in marks.iter().filter(|mark| !mark.peak && mark.quantity == Quantity::Parameter(free)) {
        let key = if mark.stop { "stop" } else { "mark" };
        if let Some(value) = table.get(key)
            && !(low..=high).contains(&mark.value)
        {
            let message = format!("`{key}`: {name} = {} lies outside the range of the branch", Shown(mark.value));
            walk.report(value.span(), message, format!("a value from {} to {}", Shown(low), Shown(high)));
        }
    }
}

/// Reads `mark` and `stop` of a table.
pub(super) fn marks(walk: &mut Walk, table: &DeTable, model: &Model) -> Vec<Mark> {
    let mut marks = values(walk, table.get("mark"), "`mark`", false, model);
    marks.extend(values(walk, table.get("stop"), "`stop`", true, model));
    let peaks = table.get("peaks").map(|value| quantities(walk, value, "`peaks`", model));
    marks.extend(peaks.into_iter().flatten().map(|(quantity, _)| Mark::peak(quantity)));
    marks
}

/// Reads a list of names of quantities; a single name may stand alone.
pub(super) fn quantities(walk: &mut Walk, value: &Value, what: &str, model: &Model) -> Vec<(Quantity, Range<usize>)> {
    let list: Vec<&Value> = match value.get_ref().as_array() {
        Some(list) => list.iter().collect(),
        None => vec![value],
    };
    let mut found = Vec::new();
    for one in list {
        let Some(name) = walk.string(one, &format!("an entry of {what}")) else { continue };
        found.extend(quantity(walk, &name, one.span(), model).map(|quantity| (quantity, one.span())));
    }
    found
}

/// Reads values of quantities: one number or a list for each.
fn values(walk: &mut Walk, value: Option<&Value>, what: &str, stop: bool, model: &Model) -> Vec<Mark> {
    let Some(table) = value.and_then(|value| walk.table(value, what)) else { return Vec::new() };
    let mut marks = Vec::new();
    for (key, value) in table.iter() {
        let Some(quantity) = quantity(walk, key.get_ref(), key.span(), model) else { continue };
        let unit = reading_unit(quantity, model);
        let values: Vec<f64> = match value.get_ref().as_array() {
            Some(list) => list.iter().filter_map(|one| walk.quantity(one, "a value", unit)).collect(),
            None => walk.quantity(value, "the value", unit).into_iter().collect(),
        };
        marks.extend(values.into_iter().map(|value| Mark::at(quantity, value, stop)));
    }
    marks
}

/// Suggestion for an unknown quantity; the ways to write harmonics if the name looks like one.
fn cure(name: &str, known: &[&str], model: &Model) -> String {
    if !(name.contains("_h") || name.contains(['/', '-', '+']) || name.ends_with("_dB") || name.ends_with("_phase")) {
        return suggest(name, known);
    }
    if model.iterated() {
        return format!("cycles of maps have no harmonics; {}", suggest(name, known));
    }
    let x = model.outputs.first().map(|own| &own.name).or(model.states.first().map(|own| &own.name));
    let x = x.map_or("x", String::as_str);
    format!(
        "a state or output followed by `_h` and an order: `{x}_h1`, `{x}_h3_phase`, `{x}_h1_2` for the order 1/2, \
         `{x}_h1_dB`; a ratio such as `{x}_h1/{x}_h3`; a difference of phases of one order such as \
         `{x}_h1_phase-{x}_h1_phase`; a pair such as `u+iv_h-1`"
    )
}

/// Unit in which values of a quantity are written; degrees and decibels are plain numbers.
pub(super) fn reading_unit(quantity: Quantity, model: &Model) -> &str {
    match quantity.unit(model) {
        "deg" | "dB" if quantity.needs_profile() => "",
        unit => unit,
    }
}

/// Returns the quantity of a branch with the given name.
pub(super) fn quantity(walk: &mut Walk, name: &str, span: Range<usize>, model: &Model) -> Option<Quantity> {
    let found = Quantity::named(name, model);
    if found.is_none() {
        let all = Quantity::names(model);
        let known: Vec<&str> = all.iter().map(String::as_str).collect();
        walk.report(span.clone(), format!("`{name}` is not a quantity of a branch"), cure(name, &known, model));
    }
    if let Some(found) = found
        && found.is_phase()
        && !model.forced()
        && matches!(found, Quantity::Of(_))
    {
        let message = format!("`{name}`: without forcing the phase of a cycle is arbitrary");
        let other = model.states.last().map_or("y", |own| own.name.as_str());
        walk.report(span, message, format!("a difference of two phases, such as `{name}-{other}_h1_phase`"));
        return None;
    }
    found
}

/// Kind of special point that other programs and texts call by this name.
pub(super) fn other_name(name: &str) -> Option<&'static str> {
    let plain = name.to_lowercase().replace(['_', ' '], "-");
    let kind = match plain.as_str() {
        "lp" | "sn" | "lpc" | "saddle-node" | "limit-point" | "turning-point" | "folds" | "tangent" => Kind::Fold,
        "h" | "hb" | "ah" | "andronov-hopf" | "poincare-andronov-hopf" => Kind::Hopf,
        "pd" | "flip" | "period-doublings" => Kind::PeriodDoubling,
        "ns" | "tr" | "neimark-sacker" | "naimark-sacker" | "secondary-hopf" | "torus-bifurcation" => Kind::Torus,
        "bp" | "pitchfork" | "transcritical" | "symmetry-breaking" | "branch-points" => Kind::BranchPoint,
        _ => return None,
    };
    Some(kind.name())
}

/// Reads the kinds of special points at which branches are switched, each with its depth.
pub(super) fn switching(walk: &mut Walk, value: &Value) -> Switching {
    let mut switching = Switching::default();
    let names = SWITCHABLE.map(Kind::name);
    if value.get_ref().as_table().is_none() {
        let of = value.get_ref().as_array().and_then(|list| list.first()).map_or(value, |first| first);
        let kind = of.get_ref().as_str().map(|name| other_name(name).unwrap_or(name));
        let kind = kind.filter(|name| names.contains(name)).unwrap_or("hopf");
        let hint = format!("write `switch = {{ {kind} = 1 }}`: the number of switches in a row that may follow");
        walk.report(value.span(), "`switch` is not a table of kinds of special points", hint);
        return switching;
    }
    let Some(table) = walk.table(value, "`switch`") else { return switching };
    for (key, value) in table.iter() {
        let name: &str = key.get_ref();
        match Kind::from_name(name).filter(|kind| SWITCHABLE.contains(kind)) {
            Some(kind) => {
                if let Some(depth) = walk.integer(value, "the depth", 0..=16) {
                    switching.depth.push((kind, depth as usize));
                }
            }
            None if switch_step(name).is_some() => {
                if let (Some((kind, number)), Some(depth)) =
                    (switch_step(name), walk.integer(value, "the depth", 0..=16))
                {
                    switching.only.push((kind, number, depth as usize));
                }
            }
            None => {
                let (message, hint) = match (unsupported(name), Kind::from_name(name)) {
                    (Some(kind), _) => (format!("`switch` at {name}: {}", kind.message), kind.instead.to_string()),
                    (None, Some(_)) => {
                        (format!("no branch of equilibria or cycles starts at a {name} point"), suggest(name, &names))
                    }
                    (None, None) => (
                        format!("\"{name}\" is not a kind of special point at which branches can be switched"),
                        other_name(name)
                            .filter(|own| names.contains(own))
                            .map_or_else(|| suggest(name, &names), |own| format!("write `{own}`")),
                    ),
                };
                walk.report(key.span(), message, hint);
            }
        }
    }
    switching
}
