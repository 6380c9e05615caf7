//! `[[seed]]`: first solutions.

use super::profiles::{arc, cycle};
use super::{override_parameters, unique_name};
use crate::nearest::suggest;
use crate::toml_walk::{Value, Walk};
use foldline::contract::VectorField;
use foldline::diagram::Shown;
use foldline::explore::{AttractorKey, Drawn, SeedPlan, SeedSource, iterates};
use foldline::model::{Model, unsupported};
use foldline::problem::map::cycle_of;
use std::collections::HashMap;
use std::ops::Range;
use toml::de::DeTable;

pub(super) const KEYS: [&str; 12] = [
    "name",
    "description",
    "attractor",
    "periods",
    "state",
    "cycle",
    "profile",
    "besides",
    "torus",
    "parameters",
    "samples",
    "random",
];
const SAMPLES: usize = 128;
const RANDOM: u64 = 1;
/// Default number of initial states in a cell of a map.
pub(super) const SAMPLES_OF_MAP: usize = 64;

/// Reads every seed, with its position in the text. A seed with mistakes is kept, so that branches that start from it
/// are not reported too.
pub(super) fn read(
    walk: &mut Walk,
    root: &DeTable,
    model: &Model,
    defaults: &[f64],
    degree: usize,
) -> Vec<(Range<usize>, SeedPlan)> {
    let mut seeds: Vec<(Range<usize>, SeedPlan)> = Vec::new();
    for (span, table) in walk.tables(root, "seed") {
        walk.only(table, &KEYS, "a seed");
        let taken: Vec<&str> = seeds.iter().map(|(_, seed)| seed.name.as_str()).collect();
        let Some(name) = unique_name(walk, table, &span, "seed", &taken) else { continue };
        let mut parameters = defaults.to_vec();
        if let Some(value) = table.get("parameters") {
            override_parameters(walk, value, model, &mut parameters, false);
        }
        let meant = source(walk, table, &span, model, degree, &parameters);
        if let (SeedSource::State(state), Some(value)) = (&meant, table.get("state")) {
            totals_of(walk, value, table.get("parameters"), model, state, &mut parameters);
        }
        let meant = match table.get("besides") {
            Some(value) => besides(walk, value, meant, model, &taken),
            None => meant,
        };
        let source = match table.get("torus").map(|value| (value, walk.boolean(value, "`torus`"))) {
            Some((value, Some(true))) => of_torus(walk, value, meant, model),
            _ => lasting(walk, table, meant, model, &parameters),
        };
        let samples = table.get("samples").and_then(|v| walk.integer(v, "`samples`", 1..=1_000_000));
        if model.second_phase().is_some() && source != SeedSource::QuasiPeriodic {
            let message = "under two forcing frequencies the response is a torus";
            walk.report(span.clone(), message, "write `attractor = \"torus\"` in this seed");
        }
        let random = table.get("random").and_then(|v| walk.integer(v, "`random`", 0..=u64::MAX));
        let samples = samples.map_or(SAMPLES, |n| n as usize);
        seeds.push((span, SeedPlan { name, source, parameters, samples, random: random.unwrap_or(RANDOM) }));
    }
    seeds
}

/// Reads the earlier seeds whose solutions the one from this profile must not be.
fn besides(walk: &mut Walk, value: &Value, meant: SeedSource, model: &Model, earlier: &[&str]) -> SeedSource {
    const HINT: &str = "list the seeds whose solutions are known: `besides = [\"cold\"]`";
    if model.conditions() == [0, 0] {
        let message = "only seeds of boundary-value problems have `besides`";
        walk.report(value.span(), message, "other equilibria and cycles are found from samples: `foldline explore`");
        return meant;
    }
    let SeedSource::Cycle(guess) = meant else { return meant };
    let Some(all) = value.get_ref().as_array() else {
        walk.report(value.span(), "`besides` must be a list of seeds", HINT);
        return SeedSource::Cycle(guess);
    };
    let mut others = Vec::new();
    for one in all {
        let name = one.get_ref().as_str().unwrap_or_default();
        match earlier.iter().position(|other| *other == name) {
            Some(index) => others.push(index),
            None => walk.report(one.span(), format!("no earlier seed is called {name:?}"), suggest(name, earlier)),
        }
    }
    SeedSource::Besides(guess, others)
}

/// Reads the start from which a motion settles in the cells of a map: by default a cycle of a forced model, a fixed point of
/// a map, otherwise an equilibrium.
pub(super) fn start_of_map(
    walk: &mut Walk,
    table: &DeTable,
    span: &Range<usize>,
    model: &Model,
    parameters: &[f64],
    drawn: Drawn,
) -> Option<SeedPlan> {
    const DEGREE: usize = 4;
    let before = walk.found.len();
    let given = ["attractor", "state"].iter().any(|key| table.contains_key(*key));
    let meant = match given {
        true => source(walk, table, span, model, DEGREE, parameters),
        false if model.iterated() => SeedSource::Attractor(AttractorKey::Lasting(1)),
        false if model.forced() => SeedSource::Attractor(AttractorKey::Cycle),
        false => SeedSource::Attractor(AttractorKey::Equilibrium),
    };
    let source = lasting(walk, table, meant, model, parameters);
    let Drawn { samples, random } = drawn;
    let seed = SeedPlan { name: "start".into(), source, parameters: parameters.to_vec(), samples, random };
    (walk.found.len() == before).then_some(seed)
}

fn source(
    walk: &mut Walk,
    table: &DeTable,
    span: &Range<usize>,
    model: &Model,
    degree: usize,
    parameters: &[f64],
) -> SeedSource {
    if model.conditions() != [0, 0] {
        let found = arc(walk, table, span, model, degree, parameters).map(SeedSource::Cycle);
        return found.unwrap_or(SeedSource::Attractor(AttractorKey::Equilibrium));
    }
    let fallback = SeedSource::Attractor(AttractorKey::Equilibrium);
    if let Some(value) = table.get("profile") {
        let message = "only boundary-value problems start from a `profile`";
        walk.report(value.span(), message, "give a `state`, or a whole `cycle`");
        return fallback;
    }
    let found = match (table.get("attractor"), table.get("state"), table.get("cycle")) {
        (Some(value), None, None) if value.get_ref().as_str() == Some("torus") => quasi_periodic(walk, value, model),
        (Some(value), None, None) => attractor(walk, value, model).map(SeedSource::Attractor),
        (None, Some(value), None) => state(walk, value, model).map(SeedSource::State),
        (None, None, Some(value)) => cycle(walk, value, model, degree).map(SeedSource::Cycle),
        (None, None, None) => {
            let hint =
                "add `attractor = \"equilibrium\"`, `\"cycle\"` or a ratio such as `\"2:1\"`, or `state = { … }`";
            walk.report(span.clone(), "this seed names no solution", hint);
            None
        }
        (Some(value), Some(_), _) => {
            let message = "this seed has both an `attractor` and a `state`";
            walk.report(
                value.span(),
                message,
                "keep one: `attractor` searches by sampling, `state` starts from the \
                                                given state",
            );
            None
        }
        (_, _, Some(value)) => {
            let message = "this seed has a `cycle` and another start";
            walk.report(value.span(), message, "keep one of `cycle`, `attractor` and `state`");
            None
        }
    };
    found.unwrap_or(fallback)
}

/// A torus met by simulation.
fn quasi_periodic(walk: &mut Walk, value: &Value, model: &Model) -> Option<SeedSource> {
    let angles = model.states.iter().any(|state| state.period.is_some());
    let message = match () {
        _ if model.iterated() => "tori of maps, which are closed curves, are not supported",
        _ if model.switch_count() > 0 => "tori of models whose right-hand side switches are not supported",
        _ if angles => "tori of models with angles are not supported",
        () => return Some(SeedSource::QuasiPeriodic),
    };
    walk.report(value.span(), message, "use `attractor = \"cycle\"`; surveys and sweeps show such motions");
    None
}

/// The torus that the cycle of a source is, while the forcing does not act.
fn of_torus(walk: &mut Walk, value: &Value, source: SeedSource, model: &Model) -> SeedSource {
    let message = match (&source, model) {
        (SeedSource::QuasiPeriodic, _) => "`attractor = \"torus\"` is a torus already",
        _ if model.iterated() => "tori of maps are not supported",
        _ if model.conditions() != [0, 0] => "a boundary-value problem has no tori",
        _ if !model.forced() => "`torus` belongs to models with a forcing, which begins to act on a cycle",
        (SeedSource::Attractor(AttractorKey::Equilibrium), _) => {
            "an equilibrium becomes a cycle under forcing, not a torus"
        }
        _ => return SeedSource::Torus(Box::new(source)),
    };
    walk.report(value.span(), message, "remove `torus`");
    source
}

/// Applies `periods`, the number of forcing periods per cycle, if it is given.
fn lasting(walk: &mut Walk, table: &DeTable, source: SeedSource, model: &Model, parameters: &[f64]) -> SeedSource {
    let Some(value) = table.get("periods") else { return source };
    if model.conditions() != [0, 0] {
        walk.report(value.span(), "a boundary-value problem has no periods", "remove `periods`");
        return source;
    }
    let periods = walk.integer(value, "`periods`", 1..=10_000);
    if let (true, Some(periods), SeedSource::State(state)) = (model.iterated(), periods, &source) {
        // The cycle to which Newton's method leads from the iterates of the state.
        return match iterates(model, parameters, state, periods as usize) {
            Some((all, gain)) => SeedSource::Cycle(cycle_of(&all, model.states.len(), &gain)),
            None => {
                let message = format!("the orbit of this state is not finite after {periods} iterations");
                walk.report(value.span(), message, "give a state near the cycle, or fewer `periods`");
                source
            }
        };
    }
    if !model.forced() {
        let hint = "remove `periods`: the period of a cycle follows from the equations";
        walk.report(value.span(), "the model has no forcing, so no forcing periods", hint);
    } else if source != SeedSource::Attractor(AttractorKey::Cycle) {
        let message = "`periods` goes with `attractor = \"cycle\"`";
        walk.report(value.span(), message, "remove `periods`, or write `attractor = \"cycle\"`");
    }
    periods.map_or(source, |periods| SeedSource::Attractor(AttractorKey::Lasting(periods as u32)))
}

/// Computes each total whose dependent state is given in the initial state; other totals keep their values.
fn totals_of(
    walk: &mut Walk,
    value: &Value,
    given: Option<&Value>,
    model: &Model,
    state: &[f64],
    parameters: &mut [f64],
) {
    let Some(table) = value.get_ref().as_table() else { return };
    let mut followers: HashMap<&str, f64> = HashMap::new();
    for total in &model.totals {
        if let Some(own) = table.get(total.instead_of.as_str()) {
            let number = walk.number(own, &format!("the state `{}`", total.instead_of));
            followers.extend(number.map(|number| (total.instead_of.as_str(), number)));
        }
    }
    for total in model.totals.iter().filter(|total| followers.contains_key(total.instead_of.as_str())) {
        let of = |name: &str| followers.get(name).copied().or_else(|| Some(state[model.state_index(name)?]));
        let terms: Option<Vec<f64>> = total.terms.iter().map(|(name, c)| Some(c * of(name)?)).collect();
        let name = &model.parameters[total.parameter].name;
        let Some(terms) = terms else {
            let missing: Vec<&str> =
                total.terms.iter().map(|(name, _)| name.as_str()).filter(|name| of(name).is_none()).collect();
            let hint = format!("give {} too, or remove `{}`", missing.join(", "), total.instead_of);
            walk.report(value.span(), format!("the total `{name}` cannot be computed from this state"), hint);
            continue;
        };
        let (sum, size) = (terms.iter().sum::<f64>(), terms.iter().map(|t| t.abs()).sum::<f64>());
        let stated =
            given.and_then(|given| given.get_ref().as_table()).is_some_and(|given| given.contains_key(name.as_str()));
        let own = &mut parameters[total.parameter];
        if stated && (*own - sum).abs() > 1e-9 * size {
            let message = format!(
                "the total `{name}` is {sum} at this state, and {own} under `parameters`",
                sum = Shown(sum),
                own = Shown(*own)
            );
            walk.report(value.span(), message, format!("remove `{name}` or `{}`", total.instead_of));
        }
        *own = sum;
    }
}

fn attractor(walk: &mut Walk, value: &Value, model: &Model) -> Option<AttractorKey> {
    let text = walk.string(value, "`attractor`")?;
    let ratio = text.split_once(':').and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
    match (text.as_str(), ratio) {
        ("fixed-point", _) if model.iterated() => Some(AttractorKey::Lasting(1)),
        ("equilibrium", _) => {
            if model.iterated() {
                let hint = "use `attractor = \"fixed-point\"`, or `\"cycle\"` for a cycle of any number of iterates";
                walk.report(
                    value.span(),
                    "the model is a map and has fixed points and cycles, but no equilibria",
                    hint,
                );
            } else if model.forced() {
                let hint = "use `attractor = \"cycle\"`: the response to forcing is a cycle";
                walk.report(value.span(), "the model is forced and has no equilibria", hint);
            }
            Some(AttractorKey::Equilibrium)
        }
        ("cycle", _) => Some(AttractorKey::Cycle),
        (_, Some((a, b))) if a > 0 && b > 0 => {
            if model.whirl.is_none() {
                let message = format!(
                    "the ratio \"{text}\" needs the two states of a whirling motion, which this \
                                       model does not name"
                );
                let hint = "add `whirl = [\"u\", \"v\"]` to the model file, or use `attractor = \"cycle\"`";
                walk.report(value.span(), message, hint);
            }
            Some(AttractorKey::Ratio(a, b))
        }
        _ => {
            let hint = "\"equilibrium\", \"cycle\", \"torus\", or a ratio of whole numbers such as \"2:1\"";
            let (message, hint) = match unsupported(&text) {
                Some(kind) => (format!("the attractor \"{text}\": {}", kind.message), kind.instead),
                None => (
                    format!("\"{text}\" is not an attractor"),
                    named_otherwise(&text, model.iterated()).unwrap_or(hint),
                ),
            };
            walk.report(value.span(), message, hint);
            None
        }
    }
}

/// Hint for an attractor under another name.
fn named_otherwise(text: &str, iterated: bool) -> Option<&'static str> {
    let plain = text.to_lowercase().replace(['-', '_'], " ");
    Some(match plain.as_str() {
        "fixed point" if iterated => "write \"fixed-point\"",
        "fixed point" | "steady state" | "steady" | "stationary" | "rest" | "ep" | "equilibria" => {
            "write \"equilibrium\""
        }
        "limit cycle" | "periodic" | "periodic orbit" | "periodic solution" | "oscillation" | "po" | "lc"
        | "cycles" => "write \"cycle\"",
        _ => return None,
    })
}

/// Reads a number for each state, or `"zero"` for a state of zeros. The name of a repeated state stands for all its
/// elements, with one number or a list.
pub(super) fn state(walk: &mut Walk, value: &Value, model: &Model) -> Option<Vec<f64>> {
    if value.get_ref().as_str() == Some("zero") {
        return Some(vec![0.0; model.states.len()]);
    }
    let known: Vec<&str> = model.states.iter().map(|s| s.name.as_str()).collect();
    if value.get_ref().as_array().is_some() {
        let values: Vec<String> = known.iter().take(3).map(|name| format!("{name} = …")).collect();
        let more = if known.len() > 3 { ", …" } else { "" };
        let hint = format!("name the states: `state = {{ {}{more} }}`", values.join(", "));
        walk.report(value.span(), "`state` is a list of numbers", hint);
        return None;
    }
    let table = walk.table(value, "`state`")?;
    let places: HashMap<&str, usize> = known.iter().enumerate().map(|(i, name)| (*name, i)).collect();
    let mut values: Vec<Option<f64>> = vec![None; known.len()];
    let before = walk.found.len();
    let mut families = Vec::new();
    for (key, own) in table {
        let name: &str = key.get_ref();
        let what = format!("the state `{name}`");
        // States that follow from a total are read together with it.
        if model.totals.iter().any(|total| total.instead_of == name) {
            continue;
        }
        if let Some(&i) = places.get(name) {
            values[i] = walk.quantity(own, &what, &model.states[i].unit);
            continue;
        }
        let elements: Vec<usize> = (1..).map_while(|k| places.get(format!("{name}[{k}]").as_str())).copied().collect();
        let unit = elements.first().map_or("", |i| &model.states[*i].unit);
        match own.get_ref().as_array() {
            _ if elements.is_empty() => {
                let message = format!("the model `{}` has no state `{name}`", model.name);
                walk.report(key.span(), message, suggest(name, &known));
            }
            Some(list) if list.len() != elements.len() => {
                let message = format!("{what} has {} elements, but {} values are given", elements.len(), list.len());
                walk.report(own.span(), message, "give one value for each, or one number for all");
            }
            Some(list) => {
                families.extend(elements.into_iter().zip(list.iter().map(|own| walk.quantity(own, &what, unit))))
            }
            None => {
                let number = walk.quantity(own, &what, unit);
                families.extend(elements.into_iter().map(|i| (i, number)));
            }
        }
    }
    // A value given for a single element takes precedence.
    families.into_iter().for_each(|(i, number)| values[i] = values[i].or(number));
    if walk.found.len() > before {
        return None;
    }
    let missing: Vec<&str> = known.iter().zip(&values).filter(|(_, v)| v.is_none()).map(|(name, _)| *name).collect();
    if !missing.is_empty() {
        let message = format!("the state lacks {}", missing.join(", "));
        walk.report(value.span(), message, format!("give a number for each of {}", known.join(", ")));
        return None;
    }
    values.into_iter().collect()
}
