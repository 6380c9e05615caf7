//! `[[explore]]`: automatic bifurcation diagrams.

use super::branches::{free, range, switching};
use super::items::{Item, max_points};
use super::{override_parameters, unique_name, unknown_parameter};
use crate::toml_walk::{Value, Walk};
use foldline::diagram::{Kind, Shown};
use foldline::explore::{ExplorePlan, Switching};
use foldline::model::Model;
use std::ops::Range;
use toml::de::DeTable;

pub(super) const KEYS: [&str; 12] = [
    "name",
    "description",
    "parameters",
    "free",
    "range",
    "values",
    "samples",
    "random",
    "switch",
    "connect",
    "budget",
    "max-points",
];
const VALUES: usize = 15;
const SAMPLES: usize = 64;
const RANDOM: u64 = 1;
const BUDGET: usize = 100_000;
const DEPTHS: [(Kind, usize); 3] = [(Kind::Hopf, 4), (Kind::BranchPoint, 4), (Kind::PeriodDoubling, 2)];

pub(super) fn read(
    walk: &mut Walk,
    root: &DeTable,
    model: &Model,
    defaults: &[f64],
    taken: &[&str],
) -> Vec<ExplorePlan> {
    let mut found: Vec<ExplorePlan> = Vec::new();
    for (span, table) in walk.tables(root, "explore") {
        walk.only(table, &KEYS, "an exploration");
        let own = found.iter().map(|other| other.name.as_str());
        let names: Vec<&str> = taken.iter().copied().chain(own).collect();
        let name = unique_name(walk, table, &span, "exploration", &names);
        refuse_name_of_part(walk, table, name.as_deref(), &names);
        let mut parameters = defaults.to_vec();
        if let Some(value) = table.get("parameters") {
            override_parameters(walk, value, model, &mut parameters, false);
        }
        let item = Item { what: "exploration", span: span.clone(), table };
        let free = free(walk, &item, model);
        let range = own_range(walk, table, &span, free.map_or("", |k| &model.parameters[k].unit));
        let whole = |walk: &mut Walk, key: &str, usual: usize| {
            let given = table.get(key).and_then(|v| walk.integer(v, &format!("`{key}`"), 1..=100_000_000));
            given.map_or(usual, |n| n as usize)
        };
        let values =
            table.get("values").and_then(|v| walk.integer(v, "`values`", 1..=10_000)).map_or(VALUES, |n| n as usize);
        let samples = table
            .get("samples")
            .and_then(|v| walk.integer(v, "`samples`", 1..=1_000_000))
            .map_or(SAMPLES, |n| n as usize);
        let budget = whole(walk, "budget", BUDGET);
        let random = table.get("random").and_then(|v| walk.integer(v, "`random`", 0..=u64::MAX)).unwrap_or(RANDOM);
        let switching = match table.get("switch") {
            Some(value) => switching(walk, value),
            None => Switching { depth: DEPTHS.to_vec(), only: Vec::new() },
        };
        let connect = table.get("connect").and_then(|value| connect(walk, value, model, free, &parameters));
        let max_points = max_points(walk, &item);
        let (Some(name), Some(free), Some(range)) = (name, free, range) else { continue };
        found.push(ExplorePlan {
            name,
            parameters,
            free,
            range,
            values,
            samples,
            random,
            switching,
            connect,
            budget,
            max_points,
        });
    }
    found
}

fn own_range(walk: &mut Walk, table: &DeTable, span: &Range<usize>, unit: &str) -> Option<[f64; 2]> {
    let Some(value) = table.get("range") else {
        let hint = "add a line such as `range = [0.5, 12]`";
        walk.report(span.clone(), "this exploration has no `range` of its free parameter", hint);
        return None;
    };
    range(walk, value, unit)
}

/// Rejects names that could clash with those of the branches an exploration finds, `NAME/…`.
fn refuse_name_of_part(walk: &mut Walk, table: &DeTable, name: Option<&str>, taken: &[&str]) {
    let Some((name, value)) = name.zip(table.get("name")) else { return };
    let within = |a: &str, b: &str| a.strip_prefix(b).is_some_and(|rest| rest.starts_with('/'));
    if let Some(other) = taken.iter().find(|other| within(other, name) || within(name, other)) {
        let message = format!("a branch found by the exploration \"{name}\" could have the same name as \"{other}\"");
        walk.report(value.span(), message, "give it another name, without a `/` if possible");
    }
}

/// Reads the second parameter and its range: `{ kappa = [0, 1] }`.
fn connect(
    walk: &mut Walk,
    value: &Value,
    model: &Model,
    free: Option<usize>,
    parameters: &[f64],
) -> Option<(usize, [f64; 2])> {
    let table = walk.table(value, "`connect`")?;
    let mut entries = table.iter();
    let (Some((key, ends)), None) = (entries.next(), entries.next()) else {
        let hint = "write `connect = { kappa = [0, 1] }`";
        walk.report(value.span(), "`connect` must name exactly one parameter", hint);
        return None;
    };
    let name: &str = key.get_ref();
    let Some(index) = model.parameter_index(name) else {
        unknown_parameter(walk, key.span(), name, model);
        return None;
    };
    if free == Some(index) {
        let message = format!("`{name}` is already the free parameter");
        walk.report(key.span(), message, "name a second parameter, in which folds are continued");
    }
    let ends = range(walk, ends, &model.parameters[index].unit)?;
    let own = parameters[index];
    if !(ends[0]..=ends[1]).contains(&own) {
        let message = format!("the exploration runs at {name} = {own}, outside this range", own = Shown(own));
        walk.report(value.span(), message, format!("a range that contains {own}", own = Shown(own)));
    }
    Some((index, ends))
}
