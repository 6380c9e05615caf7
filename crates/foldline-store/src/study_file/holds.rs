//! `hold` and several parameters in `free`: branches along which quantities keep their values.

use super::branches::{quantity, range, reading_unit};
use super::items::{Ground, Item};
use super::unknown_parameter;
use crate::toml_walk::Walk;
use foldline::contract::VectorField;
use foldline::diagram::{Family, Shown};
use foldline::explore::Start;
use foldline::explore::plan::Holds;
use foldline::model::{Model, Parameter};
use foldline::special::on_levels::Level;
use foldline::special::quantity::Quantity;

/// Parameters and held quantities of a branch.
pub(super) struct Held {
    /// The continuation parameter, the first of `free`.
    pub(super) free: usize,
    pub(super) holds: Holds,
}

/// Reads `free`, `hold` and `near`; `None` after a mistake.
pub(super) fn read(walk: &mut Walk, item: &Item, model: &Model) -> Option<Held> {
    let table = item.table;
    let frees = frees(walk, item, model);
    let levels = levels(walk, item, model);
    if let Some(value) = table.get("switch") {
        let message = "branches are not switched where quantities are held";
        let right =
            "remove `switch`; start an ordinary branch from this one, with one free parameter and without `hold`";
        walk.report(value.span(), message, right);
    }
    let (frees, levels) = (frees?, levels?);
    if levels.len() + 1 != frees.len() {
        let count = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
        let message = format!(
            "{} with {}: a curve needs one free parameter more than held quantities",
            count(frees.len(), "free parameter"),
            count(levels.len(), "held quantity").replace("quantitys", "quantities")
        );
        let at = table.get("free").map_or(item.span.clone(), |value| value.span());
        let right = match levels.len() + 1 > frees.len() {
            true => format!(
                "{} in `free`, such as `free = [{}]`",
                count(levels.len() + 1, "parameter"),
                example(model, &frees, levels.len() + 1)
            ),
            false => format!(
                "{} in `hold`, or fewer parameters",
                count(frees.len() - 1, "quantity").replace("quantitys", "quantities")
            ),
        };
        walk.report(at, message, right);
        return None;
    }
    for level in &levels {
        if let Quantity::Parameter(index) = level.quantity
            && !model.determined().contains(&index)
        {
            let at = table.get("hold").map_or(item.span.clone(), |value| value.span());
            let name = &model.parameters[index].name;
            walk.report(
                at,
                format!("{name} is a parameter, and a parameter that is not free is held anyway"),
                format!("remove {name} from `hold` and from `free`"),
            );
            return None;
        }
    }
    let near = table.get("near").and_then(|value| walk.quantity(value, "`near`", ""));
    let others = frees[1..].iter().map(|index| (*index, None)).collect();
    Some(Held { free: frees[0], holds: Holds { others, levels, near, ..Holds::default() } })
}

/// Names of parameters for an example: those given, and more.
fn example(model: &Model, frees: &[usize], count: usize) -> String {
    let more = (0..model.parameters.len()).filter(|index| !frees.contains(index));
    let all = frees.iter().copied().chain(more).take(count);
    all.map(|index| format!("\"{}\"", model.parameters[index].name)).collect::<Vec<_>>().join(", ")
}

fn frees(walk: &mut Walk, item: &Item, model: &Model) -> Option<Vec<usize>> {
    let Some(value) = item.table.get("free") else {
        let right = format!("add a line such as `free = [{}]`", example(model, &[], 2));
        walk.report(item.span.clone(), "this branch has no free parameters", right);
        return None;
    };
    let list = match value.get_ref().as_array() {
        Some(list) => list.iter().collect(),
        None => vec![value],
    };
    let (mut found, mut wrong) = (Vec::new(), false);
    for one in list {
        let Some(name) = walk.string(one, "an entry of `free`") else {
            wrong = true;
            continue;
        };
        match model.parameter_index(&name) {
            Some(index) if model.determined().contains(&index) => {
                let message = format!("{name} follows from the conditions of the model, which lists it under `solve`");
                walk.report(one.span(), message, "a parameter that is not listed there");
                wrong = true;
            }
            Some(index) if found.contains(&index) => {
                walk.report(one.span(), format!("{name} is given twice"), "parameters that differ");
                wrong = true;
            }
            Some(index) => found.push(index),
            None => {
                unknown_parameter(walk, one.span(), &name, model);
                wrong = true;
            }
        }
    }
    (!wrong).then_some(found)
}

/// Reads `hold`: a table of values, or a list of names that keep their values at the start.
fn levels(walk: &mut Walk, item: &Item, model: &Model) -> Option<Vec<Level>> {
    let Some(value) = item.table.get("hold") else {
        if item.table.get("free").and_then(|v| v.get_ref().as_array()).is_some_and(|list| list.len() == 1) {
            return Some(Vec::new());
        }
        let right = "add a line such as `hold = { x_max = 2 }`, or one parameter only";
        let at = item.table.get("free").map_or(item.span.clone(), |value| value.span());
        walk.report(at, "several parameters are free, but no quantity is held", right);
        return None;
    };
    let mut found = Vec::new();
    let level = |quantity: Quantity, value: f64, name: &str| Level { quantity, value, name: name.to_string() };
    let before = walk.found.len();
    if let Some(table) = value.get_ref().as_table() {
        for (key, value) in table.iter() {
            let name: &str = key.get_ref();
            let Some(quantity) = held_quantity(walk, name, key.span(), model) else { continue };
            if let Some(value) = walk.quantity(value, &format!("the value of `{name}`"), reading_unit(quantity, model))
            {
                found.push(level(quantity, value, name));
            }
        }
    } else if value.get_ref().is_array() || value.get_ref().as_str().is_some() {
        let list = match value.get_ref().as_array() {
            Some(list) => list.iter().collect(),
            None => vec![value],
        };
        for one in list {
            let Some(name) = walk.string(one, "an entry of `hold`") else { continue };
            let quantity = held_quantity(walk, &name, one.span(), model);
            found.extend(quantity.map(|quantity| level(quantity, f64::NAN, &name)));
        }
    } else {
        let right = "`hold = { x_max = 2 }`, or `hold = [\"x_max\"]` for the value at the start";
        walk.report(value.span(), "`hold` is neither a table of values nor a list of names", right);
    }
    (walk.found.len() == before).then_some(found)
}

/// The quantity of that name; a bare state or output means its value at an equilibrium.
fn held_quantity(walk: &mut Walk, name: &str, span: std::ops::Range<usize>, model: &Model) -> Option<Quantity> {
    let output = || model.output_index(name).map(|index| model.states.len() + index);
    if model.conditions() != [0, 0] {
        return along_interval(walk, name, span, model);
    }
    if let Some(channel) = model.state_index(name).or_else(output) {
        return Some(Quantity::Mean(channel));
    }
    quantity(walk, name, span, model)
}

/// The quantity of that name of a boundary-value problem. Extrema may lie at an end, where they do not vary smoothly.
fn along_interval(walk: &mut Walk, name: &str, span: std::ops::Range<usize>, model: &Model) -> Option<Quantity> {
    let varies = model.state_index(name).is_some() || model.output_index(name).is_some();
    let found = if varies { None } else { Some(quantity(walk, name, span.clone(), model)?) };
    let smooth = |own: &Quantity| {
        matches!(
            own,
            Quantity::At(..) | Quantity::Mean(_) | Quantity::Rms(_) | Quantity::Integral(_) | Quantity::Parameter(_)
        )
    };
    if found.as_ref().is_some_and(smooth) {
        return found;
    }
    let message = match varies {
        true => format!("{name} varies along the interval"),
        false => format!("`{name}` cannot be held in boundary-value problems"),
    };
    let x = model.states.first().map_or("x", |own| own.name.as_str());
    walk.report(
        span,
        message,
        format!(
            "a value at a place such as `{x}@0.5`, `{x}_mean`, `{x}_rms`, `{x}_integral`, or a parameter of `solve`"
        ),
    );
    None
}

/// Reads `range` and `until`: a pair of numbers for the first parameter, or a table with one for each; ranges of the
/// others are put into `held`.
pub(super) fn bounds(
    walk: &mut Walk,
    item: &Item,
    held: Option<&Held>,
    start: Option<f64>,
    free: Option<&Parameter>,
) -> Option<([f64; 2], Option<f64>)> {
    let ranged = item.table.get("range").and_then(|value| value.get_ref().as_table().map(|table| (value, table)));
    let (Some((value, table)), Some(held), Some(free)) = (ranged, held, free) else {
        return super::branches::bounds(walk, item, start, free);
    };
    let Some(own) = table.get(free.name.as_str()) else {
        let right = format!("`range = {{ {} = [smallest, largest], … }}`", free.name);
        walk.report(value.span(), format!("`range` lacks that of {}, the first free parameter", free.name), right);
        return None;
    };
    let _ = held;
    let limits = range(walk, own, &free.unit)?;
    let until = item.table.get("until").map(|value| (value.span(), walk.quantity(value, "`until`", &free.unit)));
    let Some((at, target)) = until else { return Some((limits, None)) };
    let target = target?;
    if target < limits[0] || target > limits[1] {
        let [low, high] = limits.map(Shown);
        walk.report(
            at,
            format!("the target {} is outside the range from {low} to {high}", Shown(target)),
            "a value within the range",
        );
    }
    Some((limits, Some(target)))
}

/// Ranges of the further parameters, from a table in `range`.
pub(super) fn others(walk: &mut Walk, item: &Item, held: &mut Held, model: &Model) {
    let Some(table) = item.table.get("range").and_then(|value| value.get_ref().as_table()) else { return };
    for (key, value) in table.iter() {
        let name: &str = key.get_ref();
        match model.parameter_index(name) {
            Some(index) if index == held.free => {}
            Some(index) => match held.holds.others.iter_mut().find(|(other, _)| *other == index) {
                Some((_, limits)) => *limits = range(walk, value, &model.parameters[index].unit),
                None => walk.report(
                    key.span(),
                    format!("{name} has a range, but is not free"),
                    format!("add {name} to `free`, or remove its range"),
                ),
            },
            None => unknown_parameter(walk, key.span(), name, model),
        }
    }
}

/// Reports quantities that the solutions of the branch do not have.
pub(super) fn fits(walk: &mut Walk, item: &Item, held: &Held, start: &Start, family: Option<Family>, ground: &Ground) {
    let at = || item.table.get("hold").map_or(item.span.clone(), |value| value.span());
    let plain = |name: &str| ground.model.state_index(name).is_some() || ground.model.output_index(name).is_some();
    for level in &held.holds.levels {
        let name = &level.name;
        if family == Some(Family::Cycle) && plain(name) {
            let right =
                format!("`{name}_max`, `{name}_min`, `{name}_mean`, `{name}_rms` or a harmonic such as `{name}_h1`");
            walk.report(at(), format!("{name} varies along a cycle"), right);
        }
        let periodic = matches!(level.quantity, Quantity::Period | Quantity::Frequency | Quantity::Integral(_))
            || level.quantity.terms().any(|term| term.order().is_some());
        let turns = level.quantity == Quantity::Rotation;
        if turns && family.is_some_and(|family| family != Family::Torus) {
            let right = "a branch of tori as the start, or another quantity";
            walk.report(at(), "only tori have a rotation number", right);
        }
        if !turns && family == Some(Family::Torus) {
            let right = "`hold = \"rotation\"`";
            walk.report(at(), format!("`{name}` cannot be held along tori"), right);
        }
        if family == Some(Family::Equilibrium) && periodic {
            walk.report(at(), format!("equilibria have no `{name}`"), "a state or output, or a branch of cycles");
        }
    }
    if let Start::Seed(_) | Start::EndOfCurve(_) | Start::EndOfHomotopy(_) = start
        && let Some(value) = item.table.get("near")
    {
        walk.report(value.span(), "`near` selects a point of a branch, and this one starts elsewhere", "remove `near`");
    }
}
