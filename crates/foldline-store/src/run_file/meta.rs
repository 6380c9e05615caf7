//! Metadata of a run file and descriptions of its variables.

use super::bytes::texts_checksum;
use crate::study_file::Study;
use foldline::explore::state_scales;
use std::collections::HashMap;

/// Entries of the table `meta`: versions, settings, study and model.
pub(super) fn description(study: &Study) -> Vec<(&'static str, String)> {
    let seeds: Vec<serde_json::Value> = study
        .plan
        .seeds
        .iter()
        .map(|s| serde_json::json!({ "name": s.name, "samples": s.samples, "random": s.random, "parameters": s.parameters }))
        .collect();
    let names = study.model.states.iter().map(|state| state.name.clone());
    let scales: serde_json::Map<String, serde_json::Value> =
        names.zip(state_scales(&study.model, &study.plan).into_iter().map(Into::into)).collect();
    let settings = serde_json::json!({
        "tolerance": study.plan.tolerance, "degree": study.plan.degree, "state_scales": scales, "seeds": seeds
    });
    vec![
        ("foldline", env!("CARGO_PKG_VERSION").to_string()),
        ("sqlite", rusqlite::version().to_string()),
        ("platform", format!("{} {}", std::env::consts::OS, std::env::consts::ARCH)),
        ("settings", settings.to_string()),
        ("study_file", study.file.clone()),
        ("study", study.text.clone()),
        ("model_file", study.model_file.clone()),
        ("model", study.model_text.clone()),
        ("texts_checksum", texts_checksum(&study.text, &study.model_text)),
    ]
}

type Variable<'a> = (&'static str, i64, &'a str, &'a str, &'a str);

pub(super) fn variables(study: &Study) -> Vec<Variable<'_>> {
    let model = &study.model;
    let parameters = model.parameters.iter().map(|p| ("parameter", &p.name, &p.unit, &p.description));
    let states = model.states.iter().map(|s| ("state", &s.name, &s.unit, &s.description));
    let outputs = model.outputs.iter().map(|o| ("output", &o.name, &o.unit, &o.description));
    let mut count = HashMap::new();
    let mut numbered = |class| {
        let next: &mut i64 = count.entry(class).or_insert(-1);
        *next += 1;
        *next
    };
    parameters
        .chain(states)
        .chain(outputs)
        .map(|(class, name, unit, text)| (class, numbered(class), name.as_str(), unit.as_str(), text.as_str()))
        .collect()
}
