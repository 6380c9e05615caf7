//! Values of parameters and states given on the command line.

use crate::failure::Failure;
use foldline::contract::VectorField;
use foldline::model::Model;
use foldline::units::{Unit, quantity};
use foldline_store::nearest::suggest;

/// Name and unit of something that can be given a value.
type Named<'m> = (&'m str, &'m str);

/// Parses `NAME=VALUE` for a parameter.
pub fn valued(typed: &str, model: &Model) -> Result<(String, f64), Failure> {
    assignment("--set", typed, "parameter", &named_parameters(model), model)
}

/// Parameter values of a model, with those given as `NAME=VALUE` replaced.
pub fn parameters(typed: &[String], model: &Model) -> Result<Vec<f64>, Failure> {
    let mut values: Vec<f64> = model.parameters.iter().map(|p| p.value).collect();
    for assignment in typed {
        let (name, value) = valued(assignment, model)?;
        if let Some(index) = model.parameter_index(&name) {
            values[index] = value;
        }
    }
    Ok(values)
}

/// States given as `NAME=VALUE`, separated by commas or one by one; `None` for the others.
pub fn states(typed: &[String], model: &Model) -> Result<Vec<Option<f64>>, Failure> {
    let named: Vec<Named> = model.states.iter().map(|s| (s.name.as_str(), s.unit.as_str())).collect();
    let mut values = vec![None; model.states.len()];
    for one in typed.iter().flat_map(|text| text.split(',')) {
        let (name, value) = assignment("--start", one, "state", &named, model)?;
        if let Some(index) = model.states.iter().position(|s| s.name == name) {
            values[index] = Some(value);
        }
    }
    Ok(values)
}

fn named_parameters(model: &Model) -> Vec<Named<'_>> {
    model.parameters.iter().map(|p| (p.name.as_str(), p.unit.as_str())).collect()
}

fn assignment(option: &str, typed: &str, noun: &str, named: &[Named], model: &Model) -> Result<(String, f64), Failure> {
    let said = |message: &str, cure: &str| Failure::typed(format!("{option} {typed}: {message}"), cure);
    let example = named.first().map_or("x", |(name, _)| name);
    let example = format!("write {option} NAME=VALUE, for example {option} {example}=5");
    let (name, value) = typed.split_once('=').ok_or_else(|| said("`=` is missing", &example))?;
    let (name, value) = (name.trim(), value.trim());
    let Some((_, unit)) = named.iter().find(|(own, _)| *own == name) else {
        let known: Vec<&str> = named.iter().map(|(name, _)| *name).collect();
        return Err(said(&format!("the model `{}` has no {noun} `{name}`", model.name), &suggest(name, &known)));
    };
    let unreadable = || {
        let message = format!("`{value}` is neither a finite number nor a quantity in a unit of the {noun}");
        said(&message, "give a number such as 5, 0.25 or 1e-6, or one with a unit such as \"0.3 mm\"")
    };
    Ok((name.to_string(), measured(value, unit).ok_or_else(unreadable)?))
}

/// Value in the unit `unit` of a number that may have its own unit, such as `500 rpm`.
pub fn measured(text: &str, unit: &str) -> Option<f64> {
    let number = match quantity(text) {
        Some(written) => Unit::read(&written.unit).convert(written.value, &Unit::read(unit)).ok(),
        None => text.trim().parse().ok(),
    };
    number.filter(|value: &f64| value.is_finite())
}

/// Index of a parameter of the model.
///
/// # Errors
/// The mistake in the name, and its correction.
pub fn parameter(name: &str, model: &Model) -> Result<usize, (String, String)> {
    let known = || model.parameters.iter().map(|p| p.name.as_str()).collect::<Vec<_>>();
    let unknown = || (format!("the model `{}` has no parameter `{name}`", model.name), suggest(name, &known()));
    model.parameter_index(name).ok_or_else(unknown)
}

/// Refuses a boundary-value problem, and a model with two forcing frequencies.
///
/// # Errors
/// The message for such a model.
pub fn with_one_forcing(model: &Model) -> Result<(), Failure> {
    with_motions(model)?;
    if model.second_phase().is_none() {
        return Ok(());
    }
    let message =
        format!("the model `{}` has two forcing frequencies, for which this command is not supported", model.name);
    let cure = "follow its tori with `foldline run` and a study: `attractor = \"torus\"` under [[seed]], and [[branch]]; \
                or integrate it with `foldline simulate`";
    Err(Failure::typed(message, cure))
}

/// Refuses a boundary-value problem where motions from initial states are asked for.
///
/// # Errors
/// The message for such a model.
pub fn with_motions(model: &Model) -> Result<(), Failure> {
    if model.conditions() == [0, 0] {
        return Ok(());
    }
    let message =
        format!("the model `{}` is a boundary-value problem: no motion starts from an initial state", model.name);
    let cure = "follow its solutions with `foldline run` and a study: a first profile under [[seed]], and [[branch]]";
    Err(Failure::typed(message, cure))
}
