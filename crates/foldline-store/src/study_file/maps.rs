//! `[[map]]`: maps over parameters.

use super::items::{Ground, Item};
use super::responses::values;
use super::seeds::{SAMPLES_OF_MAP, start_of_map};
use super::{override_parameters, unique_name, unknown_parameter};
use crate::nearest::suggest;
use crate::toml_walk::{Value, Walk};
use foldline::attractors::stratified;
use foldline::contract::VectorField;
use foldline::explore::cells::answers::Reading;
use foldline::explore::cells::{LARGEST, MOST};
use foldline::explore::{Drawn, ExplorePlan, MapPlan, Over, Question};
use foldline::model::Model;
use std::ops::Range;
use toml::de::{DeTable, DeValue};

pub(super) const KEYS: [&str; 14] = [
    "name",
    "description",
    "what",
    "over",
    "hypercube",
    "count",
    "refine",
    "parameters",
    "samples",
    "random",
    "attractor",
    "state",
    "periods",
    "max-evaluations",
];
/// Largest number of times that steps are halved.
const DEEPEST: u64 = 20;

/// Reads the maps over parameters; `taken` are the names in use.
pub(super) fn read(
    walk: &mut Walk,
    root: &DeTable,
    ground: &Ground,
    explorations: &[ExplorePlan],
    defaults: &[f64],
    taken: &[&str],
) -> Vec<MapPlan> {
    let model = ground.model;
    let mut found: Vec<MapPlan> = Vec::new();
    for (span, table) in walk.tables(root, "map") {
        walk.only(table, &KEYS, "a map");
        let own = found.iter().map(|other| other.name.as_str());
        let name = unique_name(walk, table, &span, "map", &taken.iter().copied().chain(own).collect::<Vec<_>>());
        let item = Item { what: "map", span: span.clone(), table };
        let mut base = defaults.to_vec();
        if let Some(value) = table.get("parameters") {
            override_parameters(walk, value, model, &mut base, false);
        }
        let random = table.get("random").and_then(|v| walk.integer(v, "`random`", 0..=u64::MAX)).unwrap_or(1);
        let cells = cells(walk, &item, model, random);
        let refine = table.get("refine").and_then(|v| walk.integer(v, "`refine`", 0..=DEEPEST)).unwrap_or(0) as usize;
        let question = question(walk, &item, model, &base, random);
        let most = table.get("max-evaluations").and_then(|v| walk.integer(v, "`max-evaluations`", 1..=u64::MAX / 2));
        let (Some(name), Some((indices, over)), Some(question)) = (name, cells, question) else { continue };
        if let (Some(value), Over::Grid(axes)) = (table.get("refine"), &over) {
            check_refined(walk, value, axes, refine);
        } else if let (Some(value), Over::Cases(_)) = (table.get("refine"), &over) {
            walk.report(value.span(), "a list of cases cannot be refined", "give a grid, `over = { a = [0, 1, 2] }`");
        }
        let names: Vec<String> = indices.iter().map(|index| model.parameters[*index].name.clone()).collect();
        if question == Question::Points {
            check_points(walk, root, &item, ground, explorations, &names);
        }
        let most = most.map_or(MOST, |most| most as usize);
        found.push(MapPlan { name, names, indices, base, over, refine, question, most });
    }
    found
}

/// Reads the parameters of a map, by index, and its cells.
fn cells(walk: &mut Walk, item: &Item, model: &Model, random: u64) -> Option<(Vec<usize>, Over)> {
    let table = item.table;
    match (table.get("over"), table.get("hypercube")) {
        (Some(value), None) => {
            if let Some(count) = table.get("count") {
                let hint =
                    "give the number of values with their range: `over = { a = { range = [0, 1], count = 11 } }`";
                walk.report(count.span(), "`count` of a map goes with `hypercube`", hint);
            }
            match value.get_ref() {
                DeValue::Array(list) => listed(walk, value, list.iter().collect(), model),
                _ => grid(walk, value, model),
            }
        }
        (None, Some(value)) => hypercube(walk, item, value, model, random),
        (Some(_), Some(value)) => {
            walk.report(value.span(), "a map has either `over` or a `hypercube`", "remove one");
            None
        }
        (None, None) => {
            let example = model.parameters.first().map_or("a", |own| own.name.as_str());
            let message = "this map has no `over`, the values of its parameters";
            let hint = format!("add a line such as `over = {{ {example} = [0.1, 0.2, 0.3] }}`");
            walk.report(item.span.clone(), message, hint);
            None
        }
    }
}

/// Entries of a table in the order of the text, with the index of each parameter.
fn entries<'v, 't>(
    walk: &mut Walk,
    table: &'v DeTable<'t>,
    model: &Model,
) -> Option<Vec<(usize, &'v Value<'t>, Range<usize>)>> {
    let mut found = Vec::new();
    let mut whole = true;
    for (key, value) in table.iter() {
        match model.parameter_index(key.get_ref()) {
            Some(index) => found.push((index, value, key.span())),
            None => {
                unknown_parameter(walk, key.span(), key.get_ref(), model);
                whole = false;
            }
        }
    }
    found.sort_by_key(|(_, _, span)| span.start);
    whole.then_some(found)
}

/// Reads `over = { a = [0, 1], b = { range = [0, 1], count = 5 } }`.
fn grid(walk: &mut Walk, value: &Value, model: &Model) -> Option<(Vec<usize>, Over)> {
    let table = walk.table(value, "`over`")?;
    let found = entries(walk, table, model)?;
    if found.is_empty() {
        walk.report(value.span(), "`over` names no parameter", "write `over = { a = [0, 1, 2] }`");
        return None;
    }
    let mut axes = Vec::new();
    for (index, value, _) in &found {
        let own = &model.parameters[*index];
        let axis = match value.get_ref() {
            DeValue::Table(inner) => {
                walk.only(inner, &["range", "count", "values"], &format!("the values of `{}`", own.name));
                values(walk, inner, &value.span(), ("map", own.unit.as_str()), false)?
            }
            _ => numbers(walk, value, &own.name, &own.unit)?,
        };
        let mut sorted = axis.clone();
        sorted.sort_by(f64::total_cmp);
        if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            let message = format!("`{}` has the value {} more than once", own.name, pair[0]);
            walk.report(value.span(), message, "give different values");
            return None;
        }
        axes.push(axis);
    }
    let size = axes.iter().map(|axis| axis.len() as f64).product::<f64>();
    if size > LARGEST as f64 {
        walk.report(value.span(), format!("the map would have {size} cells"), format!("at most {LARGEST} cells"));
        return None;
    }
    Some((found.into_iter().map(|(index, ..)| index).collect(), Over::Grid(axes)))
}

fn numbers(walk: &mut Walk, value: &Value, name: &str, unit: &str) -> Option<Vec<f64>> {
    let Some(list) = value.get_ref().as_array().filter(|list| !list.is_empty()) else {
        let hint = format!("write `{name} = [0.1, 0.2]` or `{name} = {{ range = [0.1, 0.2], count = 11 }}`");
        walk.report(value.span(), format!("the values of `{name}` are not a list of numbers"), hint);
        return None;
    };
    let what = format!("a value of `{name}`");
    let numbers: Vec<Option<f64>> = list.iter().map(|v| walk.quantity(v, &what, unit)).collect();
    numbers.into_iter().collect()
}

/// Reads `over = [ { a = 0, b = 1 }, … ]`.
fn listed(walk: &mut Walk, value: &Value, list: Vec<&Value>, model: &Model) -> Option<(Vec<usize>, Over)> {
    if list.is_empty() {
        walk.report(value.span(), "the list of cases is empty", "write `over = [{ a = 0 }, { a = 1 }]`");
        return None;
    }
    let mut names: Option<Vec<usize>> = None;
    let mut cases = Vec::new();
    for value in list {
        let table = walk.table(value, "a case")?;
        let found = entries(walk, table, model)?;
        let own = names.get_or_insert_with(|| found.iter().map(|(index, ..)| *index).collect());
        let mut indices: Vec<usize> = found.iter().map(|(index, ..)| *index).collect();
        let mut expected = own.clone();
        indices.sort_unstable();
        expected.sort_unstable();
        if indices != expected || indices.is_empty() {
            let message = "this case and the first one have different parameters";
            walk.report(value.span(), message, "give the same parameters in every case");
            return None;
        }
        let order = own.clone();
        let mut case = Vec::new();
        for index in order {
            let (_, value, _) = found.iter().find(|(other, ..)| *other == index)?;
            let parameter = &model.parameters[index];
            case.push(walk.quantity(value, &format!("the parameter `{}`", parameter.name), &parameter.unit)?);
        }
        cases.push(case);
    }
    Some((names?, Over::Cases(cases)))
}

/// Reads `hypercube = { a = [0, 1], b = [2, 3] }` and `count`.
fn hypercube(walk: &mut Walk, item: &Item, value: &Value, model: &Model, random: u64) -> Option<(Vec<usize>, Over)> {
    let table = walk.table(value, "`hypercube`")?;
    let found = entries(walk, table, model)?;
    let count = match item.table.get("count") {
        Some(count) => walk.integer(count, "`count`", 1..=1_000_000)? as usize,
        None => {
            walk.report(value.span(), "this hypercube has no `count`, the number of its cases", "add `count = 100`");
            return None;
        }
    };
    if found.is_empty() {
        walk.report(value.span(), "the hypercube has no parameters", "write `hypercube = { a = [0, 1], b = [2, 3] }`");
        return None;
    }
    let mut ranges = Vec::new();
    for (index, value, _) in &found {
        let own = &model.parameters[*index];
        match numbers(walk, value, &own.name, &own.unit)?[..] {
            [low, high] if low < high => ranges.push([low, high]),
            _ => {
                let message = format!("the range of `{}` is not a pair of rising numbers", own.name);
                walk.report(value.span(), message, format!("write `{} = [smallest, largest]`", own.name));
                return None;
            }
        }
    }
    let drawn = stratified(&ranges, count, random);
    let cases = drawn.chunks_exact(ranges.len()).map(<[f64]>::to_vec).collect();
    Some((found.into_iter().map(|(index, ..)| index).collect(), Over::Cases(cases)))
}

fn check_refined(walk: &mut Walk, value: &Value, axes: &[Vec<f64>], refine: usize) {
    if refine == 0 {
        return;
    }
    if axes.len() > 2 {
        let hint = "leave out `refine`, or make two maps over two parameters each";
        walk.report(value.span(), "only a grid over one or two parameters can be refined", hint);
        return;
    }
    let monotonic = |axis: &Vec<f64>| {
        axis.len() > 1 && (axis.windows(2).all(|p| p[0] < p[1]) || axis.windows(2).all(|p| p[0] > p[1]))
    };
    if !axes.iter().all(monotonic) {
        let message = "the values of a refined map do not rise or fall throughout";
        walk.report(value.span(), message, "give at least two values of each parameter, in order");
        return;
    }
    let factor = (refine as f64).exp2();
    let size = axes.iter().map(|axis| (axis.len() - 1) as f64 * factor + 1.0).product::<f64>();
    if size > LARGEST as f64 {
        let hint = format!("a smaller `refine`; at most {LARGEST} cells");
        walk.report(value.span(), format!("the fine grid would have {size} cells"), hint);
    }
}

/// Reads the question.
fn question(walk: &mut Walk, item: &Item, model: &Model, base: &[f64], random: u64) -> Option<Question> {
    const WHAT: &str = "\"points\", \"motions\", \"shares\", or a list of quantities such as [\"x_max\", \"period\"]";
    let table = item.table;
    let Some(value) = table.get("what") else {
        let message = "this map has no `what`, the question in its cells";
        walk.report(item.span.clone(), message, format!("add `what = …`: {WHAT}"));
        return None;
    };
    let samples = table.get("samples").and_then(|v| walk.integer(v, "`samples`", 1..=1_000_000));
    let drawn = Drawn { samples: samples.map_or(SAMPLES_OF_MAP, |n| n as usize), random };
    let unused = |walk: &mut Walk, keys: &[&str], what: &str| {
        for key in keys {
            if let Some(value) = table.get(*key) {
                let message = format!("`{key}` has no effect on a map of {what}");
                walk.report(value.span(), message, format!("remove `{key}`"));
            }
        }
    };
    let start = ["attractor", "state", "periods"];
    match value.get_ref() {
        DeValue::Array(list) => {
            let all = Reading::all(model);
            let mut readings = Vec::new();
            for value in list.iter() {
                let name = walk.string(value, "a quantity")?;
                match all.iter().find(|(known, _)| *known == name) {
                    Some(own) => readings.push(own.clone()),
                    None => {
                        let known: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).collect();
                        let message = format!("a map cannot show `{name}`: it is no quantity of a settled motion");
                        walk.report(value.span(), message, suggest(&name, &known));
                        return None;
                    }
                }
            }
            if readings.is_empty() {
                walk.report(value.span(), "`what` is an empty list", WHAT);
                return None;
            }
            let seed = start_of_map(walk, table, &item.span, model, base, drawn)?;
            Some(Question::Settled(readings, seed))
        }
        _ => {
            let name = walk.string(value, "`what`")?;
            if model.conditions() != [0, 0] && name != "points" {
                let message = "the model is a boundary-value problem: no motion starts from an initial state";
                walk.report(value.span(), message, "ask for `what = \"points\"`");
            }
            match name.as_str() {
                "points" => {
                    unused(walk, &[&start[..], &["samples", "parameters"]].concat(), "special points");
                    Some(Question::Points)
                }
                "motions" | "shares" => {
                    unused(walk, &start, &name);
                    Some(if name == "motions" { Question::Motions(drawn) } else { Question::Shares(drawn) })
                }
                _ => {
                    walk.report(value.span(), format!("a map cannot show \"{name}\""), WHAT);
                    None
                }
            }
        }
    }
}

/// Refuses a map of special points if the study has no branches, or changes a parameter of the map on its way.
fn check_points(
    walk: &mut Walk,
    root: &DeTable,
    item: &Item,
    ground: &Ground,
    explorations: &[ExplorePlan],
    names: &[String],
) {
    let place = item.table.get("what").map_or(item.span.clone(), |value| value.span());
    let plan = &ground.items;
    if plan.branches.is_empty() && plan.homotopies.is_empty() && explorations.is_empty() {
        let message = "the study has no branches, whose special points a map could show";
        walk.report(place, message, "add a `[[branch]]`, or ask for `what = \"motions\"`");
        return;
    }
    for name in names {
        let Some(index) = ground.model.parameter_index(name) else { continue };
        for (_, table) in walk.tables(root, "homotopy") {
            let changed =
                table.get("to").and_then(|to| to.get_ref().as_table()).is_some_and(|to| to.contains_key(name.as_str()));
            if changed {
                let message = format!("the map is over `{name}`, which a homotopy changes");
                walk.report(item.span.clone(), message, "make a map over other parameters");
            }
        }
        let free = plan.branches.iter().flat_map(|own| {
            let others = own.holds.others.iter().map(|(other, _)| *other);
            others.chain([own.free]).map(move |free| (own.name.as_str(), free))
        });
        let curves = plan.curves.iter().map(|own| (own.name.as_str(), own.free));
        let found = explorations.iter().map(|own| (own.name.as_str(), own.free));
        if let Some((other, _)) = free.chain(curves).chain(found).find(|(_, free)| *free == index) {
            let message = format!("the map is over `{name}`, which varies along \"{other}\"");
            walk.report(item.span.clone(), message, "make a map over other parameters");
        }
        let mut stated: Vec<(String, String)> = Vec::new();
        let mut state = |place: String, own: Option<&Value>| {
            let value = own.and_then(|own| own.get_ref().as_table()).and_then(|own| own.get(name.as_str()));
            let value = value.and_then(|value| match value.get_ref() {
                DeValue::Table(inner) => inner.get("value"),
                _ => Some(value),
            });
            stated.extend(value.map(|value| (place, written(value))));
        };
        state("at the top".into(), root.get("parameters"));
        for part in ["seed", "explore", "survey"] {
            for (_, table) in walk.tables(root, part) {
                let name = table.get("name").and_then(|own| own.get_ref().as_str()).unwrap_or_default();
                state(format!("in the {part} \"{name}\""), table.get("parameters"));
            }
        }
        if stated.iter().any(|(_, value)| *value != stated[0].1) {
            let said: Vec<String> = stated.iter().map(|(place, value)| format!("{value} {place}")).collect();
            let message =
                format!("the study states several values of `{name}`, which the map replaces: {}", said.join(", "));
            walk.report(item.span.clone(), message, format!("state one value of `{name}`"));
        }
    }
}

/// A value as it is written.
fn written(value: &Value) -> String {
    match value.get_ref() {
        DeValue::Integer(own) => own.as_str().to_string(),
        DeValue::Float(own) => own.as_str().to_string(),
        DeValue::String(own) => own.to_string(),
        other => other.type_str().to_string(),
    }
}
