//! `[[design]]`: design questions.

use super::branches::{quantity, range, reading_unit};
use super::curves::{of_branch, switched};
use super::items::{Ground, Item, max_points};
use super::{unique_name, unknown_parameter};
use crate::nearest::suggest;
use crate::toml_walk::{Value, Walk};
use foldline::diagram::Shown;
use foldline::explore::{DesignPlan, ExplorePlan, Start, Wanted};
use foldline::model::Model;
use foldline::special::on_levels::Level;
use foldline::special::quantity::Quantity;
use toml::de::DeTable;

pub(super) const KEYS: [&str; 10] =
    ["name", "description", "of", "range", "least", "greatest", "without", "below", "along", "max-points"];

/// Reads the design questions; `taken` are the names in use.
pub(super) fn read(
    walk: &mut Walk,
    root: &DeTable,
    ground: &Ground,
    explorations: &[ExplorePlan],
    taken: &[&str],
) -> Vec<DesignPlan> {
    let model = ground.model;
    let mut found: Vec<DesignPlan> = Vec::new();
    for (span, table) in walk.tables(root, "design") {
        walk.only(table, &KEYS, "a design question");
        let own = found.iter().map(|other| other.name.as_str());
        let names: Vec<&str> = taken.iter().copied().chain(own).collect();
        let name = unique_name(walk, table, &span, "design question", &names);
        refuse_name_of_part(walk, table, name.as_deref(), &names);
        let item = Item { what: "design question", span: span.clone(), table };
        let base = base(walk, &item, ground, explorations);
        let range = base.as_ref().and_then(|base| own_range(walk, table, base, model));
        let varied = varied(walk, &item, model, base.as_ref().map(|base| base.free));
        let wanted = wanted(walk, &item, model);
        let along = table.get("along").map(|value| {
            let taken = [base.as_ref().map(|base| base.free), varied.map(|(_, vary, _)| vary)];
            along(walk, value, model, taken)
        });
        let max_points = max_points(walk, &item);
        let along = match along {
            Some(None) => continue,
            Some(found) => found,
            None => None,
        };
        let (Some(name), Some(base), Some(range), Some((greatest, vary, within)), Some(wanted)) =
            (name, base, range, varied, wanted)
        else {
            continue;
        };
        if let Some(value) = base.parameters.get(vary).copied().flatten().filter(|v| *v < within[0] || *v > within[1]) {
            let p = &model.parameters[vary].name;
            let message = format!("the branch \"{}\" has {p} = {}, outside this range", base.name, Shown(value));
            let at = table.get(if greatest { "greatest" } else { "least" }).map_or(span.clone(), |v| v.span());
            walk.report(at, message, format!("a range that contains {}", Shown(value)));
        }
        found.push(DesignPlan {
            name,
            of: base.name,
            names: [base.free, vary].map(|index| model.parameters[index].name.clone()),
            free: base.free,
            range,
            vary,
            within,
            greatest,
            wanted,
            along,
            max_points,
        });
    }
    found
}

/// The branch in question.
struct Base {
    name: String,
    free: usize,
    range: [f64; 2],
    /// Values of the parameters along the branch, as far as they are known.
    parameters: Vec<Option<f64>>,
}

fn base(walk: &mut Walk, item: &Item, ground: &Ground, explorations: &[ExplorePlan]) -> Option<Base> {
    let Some(value) = item.table.get("of") else {
        let message = "this design question has no `of`, the branch whose solutions are in question";
        walk.report(item.span.clone(), message, "add a line such as `of = \"name of a branch\"`");
        return None;
    };
    let name = walk.string(value, "`of`")?;
    let ends = || std::iter::once(name.len()).chain(name.rmatch_indices('/').map(|(end, _)| end));
    if let Some((known, rest)) = ends().find_map(|end| Some((ground.known(&name[..end])?, &name[end..]))) {
        let Start::EndOf(index) = known.start else {
            let message = format!("\"{}\" is not a branch", known.name);
            walk.report(value.span(), message, "the name of a branch");
            return None;
        };
        let base = switched(walk, value, of_branch(ground, known, index), known, rest)?;
        if !base.plan.holds.levels.is_empty() {
            let message = format!("quantities are held along the branch \"{}\"", known.name);
            walk.report(value.span(), message, "a branch with one free parameter");
            return None;
        }
        let free = base.plan.free;
        return Some(Base { name, free, range: base.plan.range, parameters: base.beginning });
    }
    let exploration = explorations
        .iter()
        .find(|own| name.strip_prefix(&own.name).is_some_and(|rest| rest.starts_with('/') && rest.len() > 1));
    if let Some(own) = exploration {
        let parameters = own.parameters.iter().map(|value| Some(*value)).collect();
        return Some(Base { name, free: own.free, range: own.range, parameters });
    }
    let branches = ground.known.iter().filter(|known| matches!(known.start, Start::EndOf(_)));
    let names: Vec<&str> = branches.map(|known| known.name.as_str()).collect();
    walk.report(value.span(), format!("there is no branch \"{name}\""), suggest(&name, &names));
    None
}

/// Reads the range of the branch's parameter, by default the range of the branch.
fn own_range(walk: &mut Walk, table: &DeTable, base: &Base, model: &Model) -> Option<[f64; 2]> {
    let Some(value) = table.get("range") else { return Some(base.range) };
    let own = range(walk, value, &model.parameters[base.free].unit)?;
    let [low, high] = base.range;
    if own[0] < low || own[1] > high {
        let free = &model.parameters[base.free].name;
        let message =
            format!("the branch \"{}\" is followed in {free} from {} to {} only", base.name, Shown(low), Shown(high));
        walk.report(value.span(), message, "a range within that, or a wider range of the branch");
        return None;
    }
    Some(own)
}

/// Reads `least` or `greatest`: true for the latter, the design parameter, and its range.
fn varied(walk: &mut Walk, item: &Item, model: &Model, free: Option<usize>) -> Option<(bool, usize, [f64; 2])> {
    let (greatest, value) = match (item.table.get("least"), item.table.get("greatest")) {
        (Some(value), None) => (false, value),
        (None, Some(value)) => (true, value),
        (Some(_), Some(value)) => {
            let message = "a question has either `least` or `greatest`";
            walk.report(value.span(), message, "remove one; two questions may have the same branch");
            return None;
        }
        (None, None) => {
            let other = (0..model.parameters.len()).find(|index| Some(*index) != free).unwrap_or(0);
            let example = model.parameters.get(other).map_or("zeta", |own| own.name.as_str());
            let message = "this design question has no `least` or `greatest` value to seek";
            let hint = format!("add a line such as `least = {{ {example} = [0, 1] }}`, with the range of the search");
            walk.report(item.span.clone(), message, hint);
            return None;
        }
    };
    let key = if greatest { "greatest" } else { "least" };
    let table = walk.table(value, &format!("`{key}`"))?;
    let mut entries = table.iter();
    let (Some((name, ends)), None) = (entries.next(), entries.next()) else {
        let hint = format!("write `{key} = {{ NAME = [smallest, largest] }}`");
        walk.report(value.span(), format!("`{key}` must name exactly one parameter"), hint);
        return None;
    };
    let Some(index) = model.parameter_index(name.get_ref()) else {
        unknown_parameter(walk, name.span(), name.get_ref(), model);
        return None;
    };
    if free == Some(index) {
        let message = format!("`{}` is the free parameter of the branch", name.get_ref());
        walk.report(name.span(), message, "name another parameter");
        return None;
    }
    Some((greatest, index, range(walk, ends, &model.parameters[index].unit)?))
}

/// Reads the third parameter and its range; `None` after a mistake.
fn along(
    walk: &mut Walk,
    value: &Value,
    model: &Model,
    taken: [Option<usize>; 2],
) -> Option<(usize, String, [f64; 2])> {
    let table = walk.table(value, "`along`")?;
    let mut entries = table.iter();
    let (Some((name, ends)), None) = (entries.next(), entries.next()) else {
        let hint = "write `along = { NAME = [smallest, largest] }`";
        walk.report(value.span(), "`along` must name exactly one parameter", hint);
        return None;
    };
    let Some(index) = model.parameter_index(name.get_ref()) else {
        unknown_parameter(walk, name.span(), name.get_ref(), model);
        return None;
    };
    if taken.contains(&Some(index)) {
        let message = format!("`{}` is already free in this question", name.get_ref());
        walk.report(name.span(), message, "name a third parameter");
        return None;
    }
    Some((index, model.parameters[index].name.clone(), range(walk, ends, &model.parameters[index].unit)?))
}

/// Reads `without` or `below`.
fn wanted(walk: &mut Walk, item: &Item, model: &Model) -> Option<Wanted> {
    const WITHOUT: &str = "\"motion\" or \"stable motion\"";
    match (item.table.get("without"), item.table.get("below")) {
        (Some(value), None) => match walk.string(value, "`without`")?.as_str() {
            "motion" => Some(Wanted::NoMotion),
            "stable motion" => Some(Wanted::NotStable),
            other => {
                walk.report(value.span(), format!("`without` cannot be \"{other}\""), WITHOUT);
                None
            }
        },
        (None, Some(value)) => below(walk, value, model),
        (Some(_), Some(value)) => {
            walk.report(value.span(), "a question has either `without` or `below`", "remove one");
            None
        }
        (None, None) => {
            let message = "this design question has no condition";
            let hint = format!("add `without = …`, which is {WITHOUT}, or `below = {{ NAME_max = … }}`");
            walk.report(item.span.clone(), message, hint);
            None
        }
    }
}

/// Reads a quantity and its bound: `{ r_max = 1.2 }`.
fn below(walk: &mut Walk, value: &Value, model: &Model) -> Option<Wanted> {
    let table = walk.table(value, "`below`")?;
    let mut entries = table.iter();
    let (Some((key, bound)), None) = (entries.next(), entries.next()) else {
        walk.report(value.span(), "`below` must name exactly one quantity", "write `below = { NAME_max = 1.2 }`");
        return None;
    };
    let found = quantity(walk, key.get_ref(), key.span(), model)?;
    if let Quantity::Parameter(_) = found {
        let message = format!("`{}` is a parameter", key.get_ref());
        walk.report(key.span(), message, "name a quantity of the motion, such as NAME_max of a state or output");
        return None;
    }
    if found.is_phase() {
        let message = "an angle has no upper bound";
        walk.report(key.span(), message, "name an amplitude, such as NAME_max or NAME_h1");
        return None;
    }
    let bound = walk.quantity(bound, "the bound", reading_unit(found, model))?;
    Some(Wanted::Below(Level { quantity: found, value: bound, name: key.get_ref().to_string() }))
}

/// Reports design questions about a kind of model (`what`) for which they are not supported.
pub(super) fn refuse(walk: &mut Walk, root: &DeTable, what: &str) {
    for (span, _) in walk.tables(root, "design") {
        let message = format!("design questions are not supported for {what}");
        walk.report(span, message, "repeat the branch at several values of the design parameter");
    }
}

/// Rejects names that could clash with those of the branches followed for a question, `NAME/…`.
fn refuse_name_of_part(walk: &mut Walk, table: &DeTable, name: Option<&str>, taken: &[&str]) {
    let Some((name, value)) = name.zip(table.get("name")) else { return };
    let within = |a: &str, b: &str| a.strip_prefix(b).is_some_and(|rest| rest.starts_with('/'));
    if let Some(other) = taken.iter().find(|other| within(other, name) || within(name, other)) {
        let message = format!("a branch followed for \"{name}\" could have the same name as \"{other}\"");
        walk.report(value.span(), message, "give it another name, without a `/` if possible");
    }
}
