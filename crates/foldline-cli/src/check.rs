//! `foldline check`: checks a model or study file.

use crate::arguments::Check as Typed;
use crate::failure::{Failure, Outcome};
use foldline::model::Model;
use foldline::units::Unit;
use foldline_store::finite::never_finite;
use foldline_store::model_file::{read_model, read_rotor};
use foldline_store::study_file::{is_study, read_study};
use std::collections::BTreeSet;
use std::io::{Write, stdout};

/// Confirms that a file is correct, or fails with every mistake found in it.
pub fn print(typed: &Typed) -> Result<Outcome, Failure> {
    let file = &typed.file;
    // If the file cannot be read, the model reader reports why.
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let mut rotor = Vec::new();
    let verdict = if is_study(&text) {
        let study = read_study(file)?;
        remarks(&study.model)?;
        let plan = &study.plan;
        let mut parts = vec![many(plan.seeds.len(), "seed"), many(plan.branches.len(), "branch")];
        let others = [
            (plan.curves.len(), "curve"),
            (plan.homotopies.len(), "homotopy"),
            (plan.surveys.len(), "survey"),
            (plan.sweeps.len(), "sweep"),
            (plan.designs.len(), "design question"),
            (plan.maps.len(), "map"),
        ];
        parts.extend(others.into_iter().filter(|(count, _)| *count > 0).map(|(count, noun)| many(count, noun)));
        format!("a study of {} with {}", study.model.name, parts.join(", "))
    } else {
        let (model, text) = read_model(file)?;
        let parameters: Vec<f64> = model.parameters.iter().map(|p| p.value).collect();
        if let Some(found) = never_finite(&model, &parameters, &text, &file.display().to_string()) {
            return Err(vec![found].into());
        }
        remarks(&model)?;
        let (_, machine) = read_rotor(file)?;
        rotor = machine.map(|machine| crate::rotor::check::lines(&machine, &parameters)).unwrap_or_default();
        described(&model)
    };
    let mut out = stdout();
    writeln!(out, "{} is valid: {verdict}", file.display())?;
    rotor.iter().try_for_each(|line| writeln!(out, "  {line}"))?;
    Ok(Outcome::Done)
}

/// Reports doubtful and unknown units.
fn remarks(model: &Model) -> std::io::Result<()> {
    let mut out = stdout();
    model.remarks.iter().try_for_each(|remark| writeln!(out, "{remark}"))?;
    let parameters = model.parameters.iter().map(|p| &p.unit);
    let units = parameters.chain(model.states.iter().map(|s| &s.unit)).chain(model.outputs.iter().map(|o| &o.unit));
    let units: BTreeSet<&String> = units.collect();
    let foreign: BTreeSet<String> =
        units.into_iter().flat_map(|unit| Unit::read(unit).foreign().map(str::to_string).collect::<Vec<_>>()).collect();
    if foreign.is_empty() {
        return Ok(());
    }
    let names: Vec<String> = foreign.into_iter().map(|name| format!("`{name}`")).collect();
    writeln!(out, "note: unknown units, each treated as a unit of its own: {}", names.join(", "))
}

fn described(model: &Model) -> String {
    let (states, parameters) = (many(model.states.len(), "state"), many(model.parameters.len(), "parameter"));
    format!("the model {} with {states}, {parameters}, {}", model.name, many(model.outputs.len(), "output"))
}

fn many(count: usize, noun: &str) -> String {
    match (count, noun.strip_suffix('y')) {
        (1, _) => format!("1 {noun}"),
        (_, Some(stem)) => format!("{count} {stem}ies"),
        _ if noun.ends_with('h') => format!("{count} {noun}es"),
        _ => format!("{count} {noun}s"),
    }
}
