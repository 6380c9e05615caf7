//! `foldline explore`: the whole bifurcation diagram of a model over a box of parameters.
//!
//! The arguments become a study with one `[[explore]]` table, which is run, recorded and resumed like any other.

use crate::arguments::Explore as Typed;
use crate::failure::{Failure, Outcome};
use crate::run::{Way, carried_out, limited, processors};
use crate::values::{measured, parameter, valued, with_one_forcing};
use foldline::diagram::Shown;
use foldline::model::Model;
use foldline_store::model_file::read_model;
use foldline_store::study_file::parse_study;
use std::fmt::Write as _;
use std::io::{Write as _, stdout};
use std::path::PathBuf;

/// Runs the exploration, or prints it as a study.
pub fn diagram(typed: &Typed) -> Result<Outcome, Failure> {
    let (model, model_text) = read_model(&typed.model)?;
    with_one_forcing(&model)?;
    let text = study(typed, &model)?;
    let study = parse_study(&text, "explore.toml", &model_text, &typed.model.display().to_string())?;
    let study = limited(study, &typed.limits)?;
    if typed.print {
        write!(stdout().lock(), "# The path of `model` is relative to the folder of this study.\n{}", study.text)?;
        return Ok(Outcome::Done);
    }
    let stem = typed.model.file_stem().unwrap_or("model".as_ref());
    let folder = typed.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(format!("explore-{}", stem.display())));
    let jobs = typed.jobs.map_or_else(processors, usize::from);
    let limit = typed.time_limit.into_iter().chain(typed.budget.time).min();
    carried_out(&study, &Way { jobs, resume: typed.resume, limit, units: &typed.unit, folder: &folder })
}

/// Study equivalent to the arguments.
fn study(typed: &Typed, model: &Model) -> Result<String, Failure> {
    let free = ranged("--free", &typed.free, model)?;
    let connect = typed.connect.as_ref().map(|text| ranged("--connect", text, model)).transpose()?;
    if !(1e-10..=1e-4).contains(&typed.tolerance) {
        return Err(Failure::typed(
            format!("--tolerance {}: out of range", typed.tolerance),
            "give a number from 1e-10 to 1e-4",
        ));
    }
    let mut set: Vec<(String, f64)> = Vec::new();
    for text in &typed.set {
        let (name, value) = valued(text, model)?;
        if name == free.0 {
            let message = format!("--set {text}: this is the free parameter, whose range is given by --free");
            return Err(Failure::typed(message, "remove this --set"));
        }
        // The last value given counts.
        set.retain(|(other, _)| *other != name);
        set.push((name, value));
    }
    if let Some((name, _)) = connect.as_ref().filter(|(name, _)| *name == free.0) {
        let message = format!("--connect {name}: this is already the parameter of --free");
        return Err(Failure::typed(message, "name a second parameter, in which folds are continued"));
    }
    if let Some((name, [low, high])) = &connect {
        let given = set.iter().find(|(other, _)| other == name).map(|(_, value)| *value);
        let own = model.parameter_index(name).map(|index| model.parameters[index].value);
        let own = given.or(own).unwrap_or(*low);
        if !(*low..=*high).contains(&own) {
            let own = Shown(own);
            let message = format!(
                "--connect {name}={}:{}: the diagram is at {name} = {own}, outside this range",
                Shown(*low),
                Shown(*high)
            );
            return Err(Failure::typed(
                message,
                format!("give a range that contains {own}, or another --set {name}=VALUE"),
            ));
        }
    }
    let quoted = |text: &str| serde_json::Value::from(text).to_string();
    let key = |name: &str| quoted(name);
    let mut text = String::new();
    let mut line = |words: std::fmt::Arguments| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{words}");
    };
    line(format_args!("model = {}", quoted(&typed.model.display().to_string())));
    line(format_args!("tolerance = {:e}", typed.tolerance));
    line(format_args!("\n[[explore]]\nname = {}", quoted(&model.name)));
    if !set.is_empty() {
        let values: Vec<String> = set.iter().map(|(name, value)| format!("{} = {value:?}", key(name))).collect();
        line(format_args!("parameters = {{ {} }}", values.join(", ")));
    }
    line(format_args!("free = {}\nrange = [{:?}, {:?}]", quoted(&free.0), free.1[0], free.1[1]));
    line(format_args!("values = {}\nsamples = {}\nrandom = {}", typed.values, typed.samples, typed.seed));
    if let Some((name, [low, high])) = connect {
        line(format_args!("connect = {{ {} = [{low:?}, {high:?}] }}", key(&name)));
    }
    line(format_args!("budget = {}", typed.budget.points));
    if let Some(depth) = typed.doublings {
        line(format_args!("switch = {{ hopf = 4, branch-point = 4, period-doubling = {depth} }}"));
    }
    Ok(text)
}

/// Parses `NAME=LOW:HIGH`.
fn ranged(option: &str, typed: &str, model: &Model) -> Result<(String, [f64; 2]), Failure> {
    let said = |message: &str, cure: &str| Failure::typed(format!("{option} {typed}: {message}"), cure);
    let example = format!("write {option} NAME=LOW:HIGH, for example {option} Omega=0.5:12");
    let (name, ends) = typed.split_once('=').ok_or_else(|| said("`=` is missing", &example))?;
    let (low, high) = ends.split_once(':').ok_or_else(|| said("`:` is missing between two values", &example))?;
    let index = parameter(name.trim(), model).map_err(|(message, cure)| said(&message, &cure))?;
    let own = &model.parameters[index];
    let [low, high] = [low, high].map(|end| measured(end, &own.unit));
    match (low, high) {
        (Some(low), Some(high)) if low < high => Ok((own.name.clone(), [low, high])),
        (Some(_), Some(_)) => Err(said("the first value is not smaller than the second", &example)),
        _ => Err(said("an end is neither a finite number nor a quantity in a unit of the parameter", &example)),
    }
}
