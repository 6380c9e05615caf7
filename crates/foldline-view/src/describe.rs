//! Description of a run for the page, as JSON.

use crate::axes::Axis;
use foldline::contract::VectorField;
use foldline::diagram::{Kind, Origin};
use foldline::model::Model;
use foldline::special::quantity::Quantity;
use foldline_store::order::{names, ordered};
use foldline_store::run_file::{Recorded, Span};
use foldline_store::study_file::Study;
use serde_json::{Value, json};
use std::collections::HashMap;
use std::path::Path;

/// Version of the messages.
const SCHEMA: u32 = 1;

/// Model, study and quantities.
pub(crate) fn described(study: &Study, axes: &[Axis], folder: &Path) -> Value {
    let model = &study.model;
    let named = axes.iter().map(|Axis { name, quantity }| {
        let (base, unit, class, text) = parts(*quantity, model);
        let determined = matches!(*quantity, Quantity::Parameter(k) if model.determined().contains(&k));
        let (base, profile) = (if base.is_empty() { name } else { base }, quantity.needs_profile());
        json!({ "name": name, "base": base, "unit": unit, "class": class, "description": text, "determined": determined,
            "profile": profile })
    });
    let channels = model.states.iter().map(|s| (&s.name, &s.unit, &s.description, "state"));
    let outputs = model.outputs.iter().map(|o| (&o.name, &o.unit, &o.description, "output"));
    let channels = channels.chain(outputs);
    let channels = channels
        .map(|(name, unit, text, class)| json!({ "name": name, "unit": unit, "description": text, "class": class }));
    json!({
        "schema": SCHEMA,
        "foldline": env!("CARGO_PKG_VERSION"),
        "folder": folder.display().to_string(),
        "study": { "file": study.file, "text": study.text },
        "model": { "file": study.model_file, "name": model.name, "description": model.description, "text": study.model_text },
        "quantities": named.collect::<Vec<Value>>(),
        "channels": channels.collect::<Vec<Value>>(),
        "states": model.states.len(),
        "time": model.time,
        "whirl": model.whirl,
        "switches": model.switch_count(),
        "kinds": Kind::ALL.map(|kind| json!({ "name": kind.name(), "title": kind.title(), "two": kind.has_codimension_two() })).to_vec(),
    })
}

/// Variable that a quantity is about, its unit, the class of the quantity, and a description.
fn parts(quantity: Quantity, model: &Model) -> (&str, &str, &'static str, &str) {
    let variable = |k: usize| match k.checked_sub(model.states.len()) {
        None => model.states.get(k).map(|s| (s.name.as_str(), s.unit.as_str(), s.description.as_str())),
        Some(k) => model.outputs.get(k).map(|o| (o.name.as_str(), o.unit.as_str(), o.description.as_str())),
    };
    let (class, found) = match quantity {
        Quantity::Parameter(k) => {
            let own = model.parameters.get(k).map(|p| (p.name.as_str(), p.unit.as_str(), p.description.as_str()));
            ("parameter", own)
        }
        Quantity::Period => ("period", Some(("period", model.time.as_str(), ""))),
        Quantity::Norm(_) => ("norm", Some(("norm", "", "root mean square of the state"))),
        Quantity::Smallest(k) => ("min", variable(k)),
        Quantity::Largest(k) => ("max", variable(k)),
        Quantity::Mean(k) => ("mean", variable(k)),
        Quantity::Rms(k) => ("rms", variable(k)),
        Quantity::Integral(k) => ("integral", variable(k).map(|(name, _, text)| (name, "", text))),
        Quantity::Iterate(k, _) => ("iterate", variable(k)),
        Quantity::At(k, place) => (if f64::from_bits(place) == 0.0 { "start" } else { "end" }, variable(k)),
        Quantity::Frequency => ("frequency", Some(("frequency", "", "1/period"))),
        Quantity::Rotation => ("rotation", Some(("rotation", "", "rotation number of a torus"))),
        Quantity::Decibels(_) | Quantity::RatioDecibels(..) => ("decibel", Some(("", "dB", "20 log₁₀ of the value"))),
        Quantity::Ratio(..) => ("ratio", None),
        Quantity::Difference(..) => ("phase", Some(("", "deg", "difference of two phases"))),
        Quantity::Of(_) if quantity.is_phase() => ("phase", Some(("", "deg", "phase lag of a harmonic"))),
        Quantity::Of(_) => ("amplitude", Some(("", quantity.unit(model), "amplitude of a harmonic"))),
    };
    let (name, unit, text) = found.unwrap_or_default();
    (name, unit, class, text)
}

/// Branches, special points, ends, notes and responses, in the order of the tables of `foldline table`.
pub(crate) fn state(run: Recorded, spans: &[Span], study: &Study, axes: &[Axis]) -> Value {
    let numbers: HashMap<&str, i64> = spans.iter().map(|span| (span.name.as_str(), span.number)).collect();
    let reach: HashMap<i64, [i64; 2]> = spans.iter().filter_map(|span| Some((span.number, span.reach?))).collect();
    let planned = names(&study.plan);
    let diagram = ordered(run.diagram, &study.plan);
    let plan = &study.plan;
    // The branches of homotopies and explorations are not known beforehand.
    let single = |name: &&String| {
        !plan.homotopies.iter().any(|own| own.name == **name) && !plan.explorations.iter().any(|own| own.name == **name)
    };
    let simulated = || plan.surveys.iter().map(|own| &own.name).chain(plan.sweeps.iter().map(|own| &own.name));
    let ended = |name: &&String| diagram.branch(name).is_some_and(|own| own.ends.iter().all(Option::is_some));
    let done = planned.iter().filter(single).filter(ended).count()
        + simulated().filter(|name| diagram.response_set(name).is_some()).count();
    let of = planned.iter().filter(single).count() + simulated().count();
    let (mut branches, mut special) = (Vec::new(), Vec::new());
    for branch in &diagram.branches {
        let Some(number) = numbers.get(branch.name.as_str()).copied() else { continue };
        let (origin, parent) = match &branch.origin {
            Origin::Seed(name) => (format!("seed {name}"), None),
            Origin::EndOf(name) => (format!("end of {name}"), Some(name)),
            Origin::Switch { parent, kind, parameter } => {
                (format!("{} of {parent} at {parameter}", kind.title()), Some(parent))
            }
        };
        let end = |k: usize| {
            branch.ends[k].as_ref().map(|end| json!({ "text": end.to_string(), "complete": end.complete() }))
        };
        branches.push(json!({
            "id": number, "name": branch.name, "family": branch.family.name(), "free": branch.free,
            "follows": branch.held.map(|(_, follows)| follows), "held": branch.held.map(|(kind, _)| kind.name()),
            "origin": origin, "parent": parent, "reach": reach.get(&number), "ends": [end(0), end(1)],
        }));
        for (index, own) in branch.special.iter().enumerate() {
            let values: Vec<Option<f64>> = axes.iter().map(|axis| axis.quantity.of(&own.point)).collect();
            special.push(json!({
                "branch": number, "index": index, "kind": own.kind.name(), "position": own.point.position,
                "values": values, "before": own.unstable_before, "after": own.unstable_after, "error": own.error,
                "form": own.normal_form(),
            }));
        }
    }
    let responses = diagram.responses.iter().map(|set| {
        let rows = set.responses.iter().map(|own| {
            let values = axes.iter().map(|axis| match axis.quantity {
                Quantity::Parameter(k) => own.parameters.get(k).copied(),
                Quantity::Smallest(k) => own.ranges.get(k).map(|range| range[0]),
                Quantity::Largest(k) => own.ranges.get(k).map(|range| range[1]),
                Quantity::Period => own.period,
                _ => None,
            });
            json!({ "motion": own.motion.name(), "values": values.collect::<Vec<_>>() })
        });
        json!({ "name": set.name, "search": set.search.name(), "free": set.free, "rows": rows.collect::<Vec<_>>() })
    });
    let shortfalls = diagram.shortfalls.iter().map(|own| json!([own.about, own.what]));
    json!({
        "branches": branches, "special": special, "notes": run.notes, "requests": [done, of],
        "responses": responses.collect::<Vec<_>>(), "shortfalls": shortfalls.collect::<Vec<_>>(),
    })
}
