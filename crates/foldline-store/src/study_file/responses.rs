//! `[[survey]]` and `[[sweep]]`: simulations.

use super::branches::free;
use super::items::{Ground, Item};
use super::{near, override_parameters, unique_name};
use crate::nearest::suggest;
use crate::toml_walk::{Value, Walk};
use foldline::explore::{SeedPlan, Start, SurveyPlan, SweepPlan};
use foldline::model::Model;
use std::ops::Range;
use toml::de::DeTable;

pub(super) const SURVEY_KEYS: [&str; 9] =
    ["name", "description", "parameters", "free", "range", "count", "values", "starts", "random"];
pub(super) const SWEEP_KEYS: [&str; 7] = ["name", "description", "from", "free", "range", "count", "values"];
const STARTS: usize = 64;
const RANDOM: u64 = 1;
/// Largest accepted number of values or starts.
const MOST: u64 = 1_000_000;

pub(super) fn surveys(
    walk: &mut Walk,
    root: &DeTable,
    model: &Model,
    defaults: &[f64],
    taken: &[&str],
) -> Vec<SurveyPlan> {
    let mut surveys: Vec<SurveyPlan> = Vec::new();
    for (span, table) in walk.tables(root, "survey") {
        walk.only(table, &SURVEY_KEYS, "a survey");
        let own = surveys.iter().map(|s| s.name.as_str());
        let name = unique_name(walk, table, &span, "survey", &taken.iter().copied().chain(own).collect::<Vec<_>>());
        let mut parameters = defaults.to_vec();
        if let Some(value) = table.get("parameters") {
            override_parameters(walk, value, model, &mut parameters, false);
        }
        let free = free(walk, &Item { what: "survey", span: span.clone(), table }, model);
        let values = values(walk, table, &span, ("survey", unit_of(free, model)), true);
        let starts = table.get("starts").and_then(|v| walk.integer(v, "`starts`", 1..=MOST));
        let random = table.get("random").and_then(|v| walk.integer(v, "`random`", 0..=u64::MAX)).unwrap_or(RANDOM);
        let (Some(name), Some(free), Some(values)) = (name, free, values) else { continue };
        let starts = starts.map_or(STARTS, |n| n as usize);
        surveys.push(SurveyPlan { name, parameters, free, values, starts, random });
    }
    surveys
}

pub(super) fn sweeps(
    walk: &mut Walk,
    root: &DeTable,
    ground: &Ground,
    seeds: &[(Range<usize>, SeedPlan)],
    taken: &[&str],
) -> Vec<SweepPlan> {
    let model = ground.model;
    let mut sweeps: Vec<SweepPlan> = Vec::new();
    for (span, table) in walk.tables(root, "sweep") {
        walk.only(table, &SWEEP_KEYS, "a sweep");
        let own = sweeps.iter().map(|s| s.name.as_str());
        let name = unique_name(walk, table, &span, "sweep", &taken.iter().copied().chain(own).collect::<Vec<_>>());
        let start = start(walk, table, &span, ground, seeds);
        let free = free(walk, &Item { what: "sweep", span: span.clone(), table }, model);
        let values = values(walk, table, &span, ("sweep", unit_of(free, model)), false);
        let (Some(name), Some(start), Some(free), Some(values)) = (name, start, free, values) else { continue };
        sweeps.push(SweepPlan { name, start, free, values });
    }
    sweeps
}

/// Reads the start of a sweep: a seed, or a point of a branch.
fn start(
    walk: &mut Walk,
    table: &DeTable,
    span: &Range<usize>,
    ground: &Ground,
    seeds: &[(Range<usize>, SeedPlan)],
) -> Option<Start> {
    let Some(value) = table.get("from") else {
        let message = "this sweep has no `from`, its starting seed";
        walk.report(span.clone(), message, "add `from = \"name of a seed\"`");
        return None;
    };
    if value.get_ref().is_table() {
        let item = Item { what: "sweep", span: span.clone(), table };
        return near::read(walk, &item, value, ground, &[]).map(|(near, ..)| Start::Near(near));
    }
    let from = walk.string(value, "`from`")?;
    let found = seeds.iter().position(|(_, seed)| seed.name == from);
    if found.is_none() {
        let names: Vec<&str> = seeds.iter().map(|(_, seed)| seed.name.as_str()).collect();
        let message = format!("there is no seed \"{from}\"; a sweep starts from a seed, or from a point of a branch");
        walk.report(value.span(), message, suggest(&from, &names));
    }
    found.map(Start::Seed)
}

/// Returns the unit of the free parameter.
fn unit_of(free: Option<usize>, model: &Model) -> &str {
    free.map_or("", |k| &model.parameters[k].unit)
}

/// Reads the values of the free parameter: a list, or equally spaced values in a range, which must be increasing if
/// `rising` is true.
pub(super) fn values(
    walk: &mut Walk,
    table: &DeTable,
    span: &Range<usize>,
    (what, unit): (&str, &str),
    rising: bool,
) -> Option<Vec<f64>> {
    match (table.get("values"), table.get("range"), table.get("count")) {
        (Some(value), None, None) => list(walk, value, unit),
        (None, Some(range), Some(count)) => {
            let ends = pair(walk, range, unit, rising);
            let count = walk.integer(count, "`count`", 2..=MOST);
            let ([from, to], count) = (ends?, count?);
            let last = count - 1;
            let between = |k: u64| (from * (last - k) as f64 + to * k as f64) / last as f64;
            // Both ends are exactly the given numbers.
            let value = |k: u64| {
                if k == 0 {
                    from
                } else if k == last {
                    to
                } else {
                    between(k)
                }
            };
            Some((0..count).map(value).collect())
        }
        (None, Some(range), None) => {
            let message = format!("this {what} has no `count`, the number of values in its range");
            walk.report(range.span(), message, "add a line such as `count = 101`");
            None
        }
        (Some(value), ..) => {
            let message = format!("this {what} has both `values` and a `range` or `count`");
            walk.report(value.span(), message, "keep either `values`, or `range` and `count`");
            None
        }
        (None, None, _) => {
            let message = format!("this {what} has no values of its free parameter");
            walk.report(span.clone(), message, "add `range = [3, 7]` and `count = 41`, or `values = [3, 3.5, 4]`");
            None
        }
    }
}

fn list(walk: &mut Walk, value: &Value, unit: &str) -> Option<Vec<f64>> {
    let Some(list) = value.get_ref().as_array().filter(|list| !list.is_empty()) else {
        walk.report(value.span(), "`values` is not a list of numbers", "write `values = [3, 3.5, 4]`");
        return None;
    };
    let numbers: Vec<Option<f64>> = list.iter().map(|v| walk.quantity(v, "a value", unit)).collect();
    numbers.into_iter().collect()
}

fn pair(walk: &mut Walk, value: &Value, unit: &str, rising: bool) -> Option<[f64; 2]> {
    let Some(list) = value.get_ref().as_array().filter(|list| list.len() == 2) else {
        let hint = if rising { "write `range = [smallest, largest]`" } else { "write `range = [first, last]`" };
        walk.report(value.span(), "the range is not a pair of numbers", hint);
        return None;
    };
    let ends: Vec<f64> = list.iter().filter_map(|end| walk.quantity(end, "an end of the range", unit)).collect();
    let [from, to] = ends[..] else { return None };
    if from == to {
        walk.report(value.span(), "the range is empty", "two different numbers");
        return None;
    }
    if rising && from > to {
        let message = format!("the range from {from} to {to} is the wrong way round");
        walk.report(value.span(), message, format!("write [{to}, {from}]"));
        return None;
    }
    Some([from, to])
}
