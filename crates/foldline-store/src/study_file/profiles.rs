//! `cycle` of a seed, a cycle computed or measured elsewhere, and `state` or `profile` of a boundary-value problem, a first profile.

use crate::nearest::suggest;
use crate::toml_walk::{Value, Walk, with_article};
use foldline::contract::{Batch, Parameters, VectorField};
use foldline::diagram::Cycle;
use foldline::model::{Definition, Item, Model, ModelError, ModelSource, Output, Parameter, State};
use std::collections::HashMap;
use std::ops::Range;
use toml::de::DeTable;

pub(super) const KEYS: [&str; 4] = ["period", "through", "times", "states"];

/// Reads the cycle and represents it by polynomials of degree `degree`.
pub(super) fn cycle(walk: &mut Walk, value: &Value, model: &Model, degree: usize) -> Option<Cycle> {
    if model.iterated() {
        let hint = "give one iterate and their number, as in `state = { x = 0.5 }` with `periods = 3`";
        walk.report(value.span(), "the model is a map, whose seeds cannot be cycles in time", hint);
        return None;
    }
    if model.forced() {
        let hint = "use `attractor = \"cycle\"` or `state = { … }`: a given cycle has no phase relative to the forcing";
        walk.report(value.span(), "the model is forced, and a seed cannot be a given `cycle`", hint);
        return None;
    }
    let table = walk.table(value, "`cycle`")?;
    walk.only(table, &KEYS, "a cycle");
    let missing: Vec<&str> =
        ["period", "times", "states"].into_iter().filter(|key| table.get(*key).is_none()).collect();
    if !missing.is_empty() {
        let hint = "`cycle = { period = 6.3, times = [0, …, 1], states = { x = […], … } }`";
        walk.report(value.span(), format!("the cycle lacks {}", missing.join(", ")), hint);
        return None;
    }
    let place = table.get("period")?;
    let period = walk.quantity(place, "`period`", &model.time)?;
    if period <= 0.0 {
        walk.report(
            place.span(),
            "the period is not positive",
            "write the duration of the cycle in the time of the model",
        );
        return None;
    }
    let (through, times) = places(walk, table, ["times", "period"])?;
    let states = states(walk, table.get("states")?, model, times.len())?;
    let found = Cycle::given(period, &times, &states, through, degree);
    if found.is_none() {
        walk.report(value.span(), "these times and states do not form a cycle", "a state for each time, from 0 to 1");
    }
    found
}

/// Reads `through` and the normalised times or places under the key `key`, relative to `whole`.
fn places(walk: &mut Walk, table: &DeTable, [key, whole]: [&str; 2]) -> Option<(usize, Vec<f64>)> {
    let through = table.get("through").and_then(|v| walk.integer(v, "`through`", 1..=12)).unwrap_or(1) as usize;
    let place = table.get(key)?;
    let found = list(walk, place, &format!("`{key}`"), "")?;
    if let Some(k) = found.windows(2).position(|pair| pair[0] >= pair[1]) {
        let hint = format!("normalised {key} increase from 0 at the start to 1 at the end of the {whole}");
        let message = format!("the {key} do not increase: {} is followed by {}", found[k], found[k + 1]);
        walk.report(place.span(), message, hint);
        return None;
    }
    if found.first() != Some(&0.0) || found.last() != Some(&1.0) {
        let hint = format!("divide the {key} by the {whole}: the first is 0, the last 1");
        walk.report(place.span(), format!("the {key} do not run from 0 to 1"), hint);
        return None;
    }
    if !(found.len() - 1).is_multiple_of(through) {
        let what = if key == "times" { "time steps" } else { "steps" };
        let message = format!("the number of {what}, {}, is not a multiple of `through`, {through}", found.len() - 1);
        walk.report(place.span(), message, "remove `through`, or give the nodes of every mesh interval");
        return None;
    }
    Some((through, found))
}

/// Reads the values of a first profile at given places, and represents it by polynomials of degree `degree`.
fn given_profile(walk: &mut Walk, value: &Value, model: &Model, degree: usize, parameters: &[f64]) -> Option<Cycle> {
    const HINT: &str = "`profile = { places = [0, …, 1], states = { u = […], … } }`";
    let table = walk.table(value, "`profile`")?;
    walk.only(table, &["through", "places", "states"], "a profile");
    let missing: Vec<&str> = ["places", "states"].into_iter().filter(|key| table.get(*key).is_none()).collect();
    if !missing.is_empty() {
        walk.report(value.span(), format!("the profile lacks {}", missing.join(", ")), HINT);
        return None;
    }
    let (through, places) = places(walk, table, ["places", "length"])?;
    let states = states(walk, table.get("states")?, model, places.len())?;
    let mut found = Cycle::given(model.time_unit(parameters), &places, &states, through, degree)?;
    found.forcing_periods = 1;
    Some(found)
}

/// Reads the states, `[count][n]`.
fn states(walk: &mut Walk, value: &Value, model: &Model, count: usize) -> Option<Vec<f64>> {
    let table = walk.table(value, "`states`")?;
    let known: Vec<&str> = model.states.iter().map(|s| s.name.as_str()).collect();
    for key in table.keys() {
        let name: &str = key.get_ref();
        if !known.contains(&name) {
            let message = format!("the model `{}` has no state `{name}`", model.name);
            walk.report(key.span(), message, suggest(name, &known));
        }
    }
    let missing: Vec<&str> = known.iter().copied().filter(|name| table.get(*name).is_none()).collect();
    if !missing.is_empty() {
        let message = format!("the states lack {}", missing.join(", "));
        walk.report(value.span(), message, format!("give a list of numbers for each of {}", known.join(", ")));
        return None;
    }
    let mut out = vec![0.0; count * known.len()];
    for (i, name) in known.iter().enumerate() {
        let place = table.get(*name)?;
        let values = list(walk, place, &format!("the state `{name}`"), &model.states[i].unit)?;
        if values.len() != count {
            let message = format!("the state `{name}` has {} values where there are {count} times", values.len());
            walk.report(place.span(), message, "give a value for each time, including the last");
            return None;
        }
        values.iter().enumerate().for_each(|(k, v)| out[k * known.len() + i] = *v);
    }
    Some(out)
}

fn list(walk: &mut Walk, value: &Value, what: &str, unit: &str) -> Option<Vec<f64>> {
    match value.get_ref().as_array() {
        Some(values) if values.len() > 1 => values.iter().map(|v| walk.quantity(v, what, unit)).collect(),
        Some(_) => {
            walk.report(
                value.span(),
                format!("{what} has fewer than two numbers"),
                "a list of numbers such as [0, 0.5, 1]",
            );
            None
        }
        None => {
            let found = value.get_ref().type_str();
            walk.report(
                value.span(),
                format!("{what} is {}, not a list", with_article(found)),
                "a list of numbers such as [0, 0.5, 1]",
            );
            None
        }
    }
}

/// Intervals of a first profile. Newton's method does not resolve much more before it converges on a better mesh.
const INTERVALS: usize = 20;

/// Reads the first profile of a boundary-value problem: a number, or an expression of the independent variable and the
/// parameters, for each state.
pub(super) fn arc(
    walk: &mut Walk,
    table: &DeTable,
    span: &Range<usize>,
    model: &Model,
    degree: usize,
    parameters: &[f64],
) -> Option<Cycle> {
    const HINT: &str = "give a number, or an expression of the independent variable, for each state: `state = { u = 0, \
                        \"u'\" = \"sin(pi*t)\" }`";
    for key in ["attractor", "cycle"] {
        if let Some(value) = table.get(key) {
            let message = format!("a boundary-value problem has no {key}; a seed gives a first profile");
            walk.report(value.span(), message, HINT);
            return None;
        }
    }
    let value = match (table.get("state"), table.get("profile")) {
        (Some(value), None) => value,
        (None, Some(value)) => return given_profile(walk, value, model, degree, parameters),
        (Some(_), Some(value)) => {
            walk.report(value.span(), "this seed has both a `state` and a `profile`", "keep one of them");
            return None;
        }
        (None, None) => {
            walk.report(span.clone(), "this seed gives no profile", HINT);
            return None;
        }
    };
    let names: Vec<&str> = model.states.iter().map(|s| s.name.as_str()).collect();
    let mut texts = vec!["0".to_string(); names.len()];
    if value.get_ref().as_str() != Some("zero") {
        let given = walk.table(value, "`state`")?;
        let before = walk.found.len();
        let mut missing: HashMap<&str, usize> = names.iter().enumerate().map(|(i, name)| (*name, i)).collect();
        for (key, own) in given {
            let name: &str = key.get_ref();
            let Some(i) = missing.remove(name) else {
                let message = format!("the model `{}` has no state `{name}`", model.name);
                walk.report(key.span(), message, suggest(name, &names));
                continue;
            };
            let what = format!("the state `{name}`");
            texts[i] = match own.get_ref().as_str() {
                Some(text) => text.to_string(),
                None => walk.number(own, &what).map_or_else(|| "0".into(), |number| format!("{number:?}")),
            };
        }
        let mut missing: Vec<&str> = missing.into_keys().collect();
        missing.sort();
        if !missing.is_empty() {
            walk.report(value.span(), format!("the profile lacks {}", missing.join(", ")), HINT);
        }
        if walk.found.len() > before {
            return None;
        }
    }
    let length = model.time_unit(parameters);
    let count = INTERVALS * degree + 1;
    let times: Vec<f64> = (0..count).map(|k| k as f64 / (count - 1) as f64).collect();
    let places: Vec<f64> = times.iter().map(|t| t * length).collect();
    let states = match evaluated(model, &texts, parameters, &places) {
        Ok(states) => states,
        Err(errors) => {
            errors.into_iter().for_each(|[message, hint]| walk.report(value.span(), message, hint));
            return None;
        }
    };
    if let Some(k) = states.iter().position(|x| !x.is_finite()) {
        let message = format!("the state `{}` is not finite at {}", names[k % names.len()], places[k / names.len()]);
        walk.report(value.span(), message, HINT);
        return None;
    }
    let mut found = Cycle::given(length, &times, &states, degree, degree)?;
    found.forcing_periods = 1;
    Some(found)
}

/// Values `[count][n]` of expressions of the parameters and of the independent variable, at its values `places`.
fn evaluated(
    model: &Model,
    texts: &[String],
    parameters: &[f64],
    places: &[f64],
) -> Result<Vec<f64>, Vec<[String; 2]>> {
    let variable = model.variable.as_str();
    let named = model.parameters.iter().zip(parameters).map(|(own, value)| Parameter::new(&own.name, *value));
    let outputs = texts.iter().enumerate().map(|(i, text)| Output::new(&format!("profile{}", i + 1), text));
    let source = ModelSource {
        name: "first profile".into(),
        parameters: named.chain([Parameter::new(variable, 0.0)]).collect(),
        states: vec![State::new("profile")],
        equations: vec![Definition::new("profile", "0")],
        outputs: outputs.collect(),
        ..ModelSource::default()
    };
    let mistake = |error: ModelError| {
        let state = match error.item {
            Item::Output(i) => model.states.get(i).map_or("", |state| &state.name),
            _ => "",
        };
        [format!("the profile of `{state}`: {}", error.message), error.hint]
    };
    let profile = Model::compile(source).map_err(|errors| errors.into_iter().map(mistake).collect::<Vec<_>>())?;
    let (lanes, count) = (places.len(), parameters.len());
    let mut values = vec![0.0; (count + 1) * lanes];
    for (line, value) in values.chunks_exact_mut(lanes).zip(parameters) {
        line.fill(*value);
    }
    values[count * lanes..].copy_from_slice(places);
    let states = vec![0.0; lanes];
    let batch = Batch { lanes, states: &states, parameters: Parameters::PerLane(&values), times: &[], signs: &[] };
    let mut out = vec![0.0; texts.len() * lanes];
    profile.outputs(batch, &mut out);
    Ok((0..lanes * texts.len()).map(|k| out[k % texts.len() * lanes + k / texts.len()]).collect())
}
