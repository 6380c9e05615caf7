//! Check before any computation that the vector field is finite where a study starts.

use crate::diagnostic::Diagnostic;
use crate::toml_walk::{Walk, diagnose};
use foldline::contract::{Batch, Parameters, VectorField};
use foldline::explore::{ExplorePlan, SeedPlan, SeedSource};
use foldline::model::Model;
use std::ops::Range;
use toml::de::DeTable;

const CURE: &str = "check for a division by zero, or a log or sqrt of a negative number; or change the parameters or \
                    the sampling `range` of the states";

/// Returns a diagnostic at the equation if f is finite at no probe of the sampling range of the states.
pub fn never_finite(model: &Model, parameters: &[f64], model_text: &str, model_file: &str) -> Option<Diagnostic> {
    let (component, state) = failing_everywhere(model, parameters)?;
    let message = complaint(model, component, &state, parameters);
    Some(at_equation(model, component, message, model_text, model_file))
}

/// Reports the first seed at which f is not finite. A given state or cycle is checked at its first point; for an
/// attractor that must be searched for, f must be finite at one probe of the sampling range. Only the first failing
/// seed is reported, because the others usually fail for the same reason.
pub(crate) fn check_seeds(
    walk: &mut Walk,
    seeds: &[(Range<usize>, SeedPlan)],
    model: &Model,
    model_text: &str,
    model_file: &str,
) {
    for (span, seed) in seeds {
        let source = match &seed.source {
            SeedSource::Torus(source) => source,
            source => source,
        };
        let failing = match source {
            SeedSource::State(state) => not_finite(model, state, &seed.parameters).map(|c| (c, state.clone())),
            SeedSource::Cycle(cycle) | SeedSource::Besides(cycle, _) => {
                let state = &cycle.profile[..cycle.dim()];
                not_finite(model, state, &seed.parameters).map(|c| (c, state.to_vec()))
            }
            SeedSource::Attractor(_) | SeedSource::Torus(_) | SeedSource::QuasiPeriodic => {
                failing_everywhere(model, &seed.parameters)
            }
        };
        let Some((component, state)) = failing else { continue };
        let message = complaint(model, component, &state, &seed.parameters);
        walk.report(span.clone(), format!("the seed \"{}\" cannot start: {message}", seed.name), CURE);
        let message = format!("this equation is not finite at the seed \"{}\"", seed.name);
        walk.found.push(at_equation(model, component, message, model_text, model_file));
        return;
    }
}

/// Reports the first exploration in whose range f is finite at none of three parameter values.
pub(crate) fn check_explorations(walk: &mut Walk, explorations: &[ExplorePlan], model: &Model, text: &str, file: &str) {
    const SHARES: [f64; 3] = [0.5, 0.25, 0.75];
    for exploration in explorations {
        let [low, high] = exploration.range;
        let place = |share: f64| {
            let mut parameters = exploration.parameters.clone();
            parameters[exploration.free] = low + share * (high - low);
            parameters
        };
        let failing: Vec<_> = SHARES.iter().map_while(|share| failing_everywhere(model, &place(*share))).collect();
        let Some((component, state)) = failing.first().filter(|_| failing.len() == SHARES.len()) else { continue };
        let message = complaint(model, *component, state, &place(SHARES[0]));
        walk.report(0..0, format!("the exploration \"{}\" cannot start: {message}", exploration.name), CURE);
        let message = format!("this equation is not finite in the exploration \"{}\"", exploration.name);
        walk.found.push(at_equation(model, *component, message, text, file));
        return;
    }
}

fn at_equation(model: &Model, component: usize, message: String, model_text: &str, model_file: &str) -> Diagnostic {
    let place = equation_span(model_text, &model.states[component].name).unwrap_or(0..0);
    diagnose(model_file, model_text, place, message, CURE.to_string())
}

/// Returns the first component of f that is not finite at a state.
fn not_finite(model: &Model, state: &[f64], parameters: &[f64]) -> Option<usize> {
    let mut f = vec![0.0; model.dim()];
    model.evaluate(
        Batch { lanes: 1, states: state, parameters: Parameters::Shared(parameters), times: &[], signs: &[] },
        &mut f,
    );
    f.iter().position(|v| !v.is_finite())
}

/// If f is finite at no probe, returns the last probe and the component of f that is not finite there.
fn failing_everywhere(model: &Model, parameters: &[f64]) -> Option<(usize, Vec<f64>)> {
    let mut last = None;
    for state in probes(model) {
        last = Some((not_finite(model, &state, parameters)?, state));
    }
    last
}

/// States spread over the sampling range: a lattice that avoids round numbers, and the midpoint last.
fn probes(model: &Model) -> Vec<Vec<f64>> {
    const COUNT: usize = 16;
    let golden = 0.618_033_988_749_895;
    let ranges = model.ranges();
    let place = |sample: usize| {
        let share = |i: usize| if sample == COUNT { 0.5 } else { (golden * (1 + sample * (i + 1)) as f64).fract() };
        ranges.iter().enumerate().map(|(i, [low, high])| low + share(i) * (high - low)).collect()
    };
    (0..=COUNT).map(place).collect()
}

fn complaint(model: &Model, component: usize, state: &[f64], parameters: &[f64]) -> String {
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

/// Position of the equation of a state in a model text.
fn equation_span(model_text: &str, state: &str) -> Option<Range<usize>> {
    let root = DeTable::parse(model_text).ok()?.into_inner();
    // An array element shares the equation of its array; a velocity belongs to the equation of its acceleration.
    let name = state.split('[').next().unwrap_or(state);
    let acceleration = format!("{}''", name.trim_end_matches('\''));
    let keys =
        if name.ends_with('\'') { [acceleration.as_str(), name.trim_end_matches('\'')] } else { [name, &acceleration] };
    let entries = ["equations", "states"].into_iter().flat_map(|table| keys.map(|key| (table, key)));
    let mut found = entries.filter_map(|(table, key)| root.get(table)?.get_ref().as_table()?.get(key));
    let entry = found.next()?;
    let equation = entry.get_ref().as_table().and_then(|table| table.get("equation"));
    Some(equation.map_or(entry.span(), |e| e.span()))
}
