//! `[[branch]]`: curves to follow.

use super::{unique_name, unknown_parameter};
use crate::nearest::suggest;
use crate::toml_walk::{Value, Walk};
use foldline::diagram::Kind;
use foldline::explore::{BranchPlan, SeedPlan, Start, Switching};
use foldline::model::Model;
use std::ops::Range;
use toml::de::DeTable;

pub(super) const KEYS: [&str; 8] = ["name", "description", "from", "free", "range", "until", "switch", "max-points"];
const MAX_POINTS: usize = 5000;
const SWITCHABLE: [Kind; 3] = [Kind::PeriodDoubling, Kind::BranchPoint, Kind::Hopf];

/// A branch, and what is known about the parameters where it starts: `None` for a parameter that an earlier branch
/// leaves at a value not known beforehand.
struct Known {
    plan: BranchPlan,
    end: Vec<Option<f64>>,
}

pub(super) fn read(
    walk: &mut Walk,
    root: &DeTable,
    model: &Model,
    seeds: &[(Range<usize>, SeedPlan)],
) -> Vec<BranchPlan> {
    let mut known: Vec<Known> = Vec::new();
    let tables = walk.tables(root, "branch");
    let others = ["survey", "sweep"].iter().any(|key| root.contains_key(*key));
    if tables.is_empty() && root.get("branch").is_none() && !others {
        walk.report(0..0, "the study has no branch", "add `[[branch]]` with name, from, free and range");
    }
    for (span, table) in &tables {
        walk.only(table, &KEYS, "a branch");
        let seed_names = seeds.iter().map(|(_, seed)| seed.name.as_str());
        let taken: Vec<&str> = seed_names.chain(known.iter().map(|k| k.plan.name.as_str())).collect();
        let name = unique_name(walk, table, span, "branch", &taken);
        let origin = origin(walk, table, span, seeds, &known, &tables);
        let free = free(walk, table, span, model, "branch");
        let switching = table.get("switch").map(|value| switching(walk, value)).unwrap_or_default();
        let max_points = table.get("max-points").and_then(|v| walk.integer(v, "`max-points`", 1..=100_000_000));
        let max_points = max_points.map_or(MAX_POINTS, |n| n as usize);
        let start_value = origin.as_ref().zip(free).and_then(|((_, at), free)| at[free]);
        let bounds = bounds(walk, table, span, start_value, free.map(|f| model.parameters[f].name.as_str()));
        let (Some(name), Some((start, mut end)), Some(free), Some((range, until))) = (name, origin, free, bounds)
        else {
            continue;
        };
        end[free] = until;
        known.push(Known { plan: BranchPlan { name, start, free, range, until, switching, max_points }, end });
    }
    known.into_iter().map(|k| k.plan).collect()
}

/// Where the branch starts, and the parameters there as far as they are known.
fn origin(
    walk: &mut Walk,
    table: &DeTable,
    span: &Range<usize>,
    seeds: &[(Range<usize>, SeedPlan)],
    earlier: &[Known],
    all: &[(Range<usize>, &DeTable)],
) -> Option<(Start, Vec<Option<f64>>)> {
    let Some(value) = table.get("from") else {
        walk.report(
            span.clone(),
            "this branch does not say where it starts",
            "add `from = \"name of a seed or branch\"`",
        );
        return None;
    };
    let from = walk.string(value, "`from`")?;
    if let Some(index) = seeds.iter().position(|(_, seed)| seed.name == from) {
        return Some((Start::Seed(index), seeds[index].1.parameters.iter().map(|v| Some(*v)).collect()));
    }
    if let Some(index) = earlier.iter().position(|k| k.plan.name == from) {
        return Some((Start::EndOf(index), earlier[index].end.clone()));
    }
    let written = |table: &DeTable| table.get("name").and_then(|n| n.get_ref().as_str()) == Some(from.as_str());
    if all.iter().any(|(_, other)| written(other)) {
        // Either it stands further down, or something is wrong with it and has been said already.
        if all.iter().position(|(_, other)| written(other))
            >= all.iter().position(|(_, other)| std::ptr::eq(*other, table))
        {
            let message = format!("the branch \"{from}\" is not known yet at this place");
            walk.report(value.span(), message, "a branch starts from a seed, or from a branch written above it");
        }
        return None;
    }
    let names: Vec<&str> =
        seeds.iter().map(|(_, s)| s.name.as_str()).chain(earlier.iter().map(|k| k.plan.name.as_str())).collect();
    walk.report(value.span(), format!("there is no seed or branch \"{from}\""), suggest(&from, &names));
    None
}

pub(super) fn free(walk: &mut Walk, table: &DeTable, span: &Range<usize>, model: &Model, what: &str) -> Option<usize> {
    let Some(value) = table.get("free") else {
        let example = model.parameters.first().map_or("mu", |p| p.name.as_str());
        walk.report(
            span.clone(),
            format!("this {what} has no free parameter"),
            format!("add a line such as `free = \"{example}\"`"),
        );
        return None;
    };
    let name = walk.string(value, "`free`")?;
    let index = model.parameter_index(&name);
    if index.is_none() {
        unknown_parameter(walk, value.span(), &name, model);
    }
    index
}

/// The range, and the target of a homotopy run. With a target alone the range is the way from the start to it.
fn bounds(
    walk: &mut Walk,
    table: &DeTable,
    span: &Range<usize>,
    start: Option<f64>,
    free: Option<&str>,
) -> Option<([f64; 2], Option<f64>)> {
    let free = free.unwrap_or("the free parameter");
    let until = table.get("until").map(|value| (value.span(), walk.number(value, "`until`")));
    let range = match (table.get("range"), &until) {
        (Some(value), _) => {
            let range = range(walk, value)?;
            if let Some(start) = start.filter(|s| *s < range[0] || *s > range[1]) {
                let message = format!("the branch starts at {free} = {start}, outside its range");
                walk.report(value.span(), message, format!("a range that contains {start}, or another start"));
            }
            range
        }
        (None, Some((_, Some(target)))) => {
            let start = start.unwrap_or(*target);
            [start.min(*target), start.max(*target)]
        }
        (None, Some((_, None))) => return None,
        (None, None) => {
            let message = "this branch has neither a `range` nor a value to run `until`";
            walk.report(span.clone(), message, "add a line such as `range = [0.5, 12]`");
            return None;
        }
    };
    let Some((at, target)) = until else { return Some((range, None)) };
    let target = target?;
    if target < range[0] || target > range[1] {
        let message = format!("the target {target} is outside the range from {} to {}", range[0], range[1]);
        walk.report(at, message, "a value within the range");
    } else if start == Some(target) {
        let message = format!("the branch already starts at {free} = {target}");
        walk.report(at, message, "a target other than the start");
    }
    Some((range, Some(target)))
}

fn range(walk: &mut Walk, value: &Value) -> Option<[f64; 2]> {
    let Some(list) = value.get_ref().as_array().filter(|list| list.len() == 2) else {
        walk.report(value.span(), "the range is not a pair of numbers", "write `range = [smallest, largest]`");
        return None;
    };
    let ends: Vec<f64> = list.iter().filter_map(|end| walk.number(end, "an end of the range")).collect();
    let [low, high] = ends[..] else { return None };
    if low > high {
        walk.report(
            value.span(),
            format!("the range from {low} to {high} is the wrong way round"),
            format!("write [{high}, {low}]"),
        );
        return None;
    }
    if low == high {
        walk.report(value.span(), "the range is empty", "two different numbers, the smaller first");
        return None;
    }
    Some([low, high])
}

fn switching(walk: &mut Walk, value: &Value) -> Switching {
    let mut switching = Switching::default();
    let Some(table) = walk.table(value, "`switch`") else { return switching };
    let names = SWITCHABLE.map(Kind::name);
    for (key, value) in table.iter() {
        let name: &str = key.get_ref();
        match Kind::from_name(name).filter(|kind| SWITCHABLE.contains(kind)) {
            Some(kind) => {
                if let Some(depth) = walk.integer(value, "the depth", 0..=16) {
                    switching.depth.push((kind, depth as usize));
                }
            }
            None => {
                let message = match Kind::from_name(name) {
                    Some(_) => format!("no branch of equilibria or cycles begins at a {name} point"),
                    None => format!("\"{name}\" is no kind of special point to branch off at"),
                };
                walk.report(key.span(), message, suggest(name, &names));
            }
        }
    }
    switching
}
