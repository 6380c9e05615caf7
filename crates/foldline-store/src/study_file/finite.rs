//! A model that is not finite where a study starts is a mistake of the input, said before any computation.

use crate::toml_walk::{Walk, diagnose};
use foldline::contract::{Batch, Parameters, VectorField};
use foldline::explore::{SeedPlan, SeedSource};
use foldline::model::Model;
use std::ops::Range;
use toml::de::DeTable;

/// Reports every seed at which f is not finite: at its state, or, for one that is searched for, at all of a number of
/// places of the sampling range.
pub(super) fn check(
    walk: &mut Walk,
    seeds: &[(Range<usize>, SeedPlan)],
    model: &Model,
    model_text: &str,
    model_file: &str,
) {
    for (span, seed) in seeds {
        let (state, hint) = match &seed.source {
            SeedSource::State(state) => (state.clone(), "start from a state at which the model is defined"),
            SeedSource::Attractor(_) => {
                let hint = "change the parameters, or the sampling `range` of the states in the model file";
                (probes(model).pop().unwrap_or_default(), hint)
            }
        };
        let component = match &seed.source {
            SeedSource::State(state) => not_finite(model, state, &seed.parameters),
            SeedSource::Attractor(_) => never_finite(model, &seed.parameters),
        };
        let Some(component) = component else { continue };
        let message = complaint(model, component, &state, &seed.parameters);
        walk.report(span.clone(), format!("the seed \"{}\" cannot start: {message}", seed.name), hint);
        if let Some(place) = equation_span(model_text, &model.states[component].name) {
            let message = format!("this equation is not finite at the seed \"{}\"", seed.name);
            let hint = "look for a division by zero, or a log or sqrt of something negative";
            walk.found.push(diagnose(model_file, model_text, place, message, hint.to_string()));
        }
        // One such seed says it all: the others mostly fail for the same reason.
        return;
    }
}

/// The first component of f that is not finite at a state.
pub(crate) fn not_finite(model: &Model, state: &[f64], parameters: &[f64]) -> Option<usize> {
    let mut f = vec![0.0; model.dim()];
    model.evaluate(Batch { lanes: 1, states: state, parameters: Parameters::Shared(parameters) }, &mut f);
    f.iter().position(|v| !v.is_finite())
}

/// The component of f that is not finite at the last of the probes, if f is finite at none of them.
pub(crate) fn never_finite(model: &Model, parameters: &[f64]) -> Option<usize> {
    let mut last = None;
    for state in probes(model) {
        last = Some(not_finite(model, &state, parameters)?);
    }
    last
}

/// Places spread over the sampling range: its middle last, before it a lattice that avoids round numbers.
pub(crate) fn probes(model: &Model) -> Vec<Vec<f64>> {
    const COUNT: usize = 16;
    let golden = 0.618_033_988_749_895;
    let place = |sample: usize| {
        let share = |i: usize| if sample == COUNT { 0.5 } else { (golden * (1 + sample * (i + 1)) as f64).fract() };
        model.states.iter().enumerate().map(|(i, s)| s.range[0] + share(i) * (s.range[1] - s.range[0])).collect()
    };
    (0..=COUNT).map(place).collect()
}

pub(crate) fn complaint(model: &Model, component: usize, state: &[f64], parameters: &[f64]) -> String {
    let list = |names: Vec<&str>, values: &[f64]| {
        let pairs: Vec<String> = names.iter().zip(values).map(|(name, value)| format!("{name} = {value}")).collect();
        pairs.join(", ")
    };
    format!(
        "the equation of `{}` is not finite at {} with {}",
        model.states[component].name,
        list(model.states.iter().map(|s| s.name.as_str()).collect(), state),
        list(model.parameters.iter().map(|p| p.name.as_str()).collect(), parameters),
    )
}

/// Where the equation of a state stands in a model text.
pub(crate) fn equation_span(model_text: &str, state: &str) -> Option<Range<usize>> {
    let root = DeTable::parse(model_text).ok()?.into_inner();
    let entry = root.get("states")?.get_ref().as_table()?.get(state)?;
    let equation = entry.get_ref().as_table().and_then(|table| table.get("equation"));
    Some(equation.map_or(entry.span(), |e| e.span()))
}
