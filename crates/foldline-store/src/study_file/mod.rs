//! Reader of study files.
//!
//! **Idea.** A study specifies in TOML what to compute with a model: parameter overrides, first solutions (`[[seed]]`),
//! branches (`[[branch]]`), two-parameter curves (`[[curve]]`), homotopies (`[[homotopy]]`), whole diagrams
//! (`[[explore]]`), simulations (`[[survey]]`, `[[sweep]]`), maps over parameters (`[[map]]`) and pictures (`[[figure]]`). The whole text is read before it is rejected, so that
//! all mistakes are reported at once, each with position, cause and cure. The format is described in
//! docs/book/study-files.md.

mod append;
mod branches;
mod curves;
mod designs;
mod explorations;
mod figures;
mod grown;
mod holds;
mod homotopies;
mod items;
mod maps;
mod near;
mod profiles;
mod responses;
mod seeds;
mod sharpened;

pub use append::{Action, Appended, Place, Refusal, append};
pub use figures::{FigurePlan, PanelPlan, Show, THEMES};
pub use grown::{Added, added};
pub use sharpened::Unsharpened;

use crate::diagnostic::Diagnostic;
use crate::finite::{check_explorations, check_seeds};
use crate::model_file::items::spread;
use crate::model_file::{parse_model, parse_model_of_run, read_model};
use crate::nearest::suggest;
use crate::text_file::{beside, read_text, unreadable};
use crate::toml_walk::{Value, Walk};
use foldline::attractors::Limits;
use foldline::contract::VectorField;
use foldline::explore::Plan;
use foldline::model::{Contact, Model, Spread, conserved, in_words};
use foldline::special::quantity::Quantity;
use items::Items;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// Study: the computations requested, and the texts it was read from.
#[derive(Clone, Debug)]
pub struct Study {
    /// Name of the study file, as given.
    pub file: String,
    /// Verbatim text of the study.
    pub text: String,
    /// Name of the model file, resolved relative to the study.
    pub model_file: String,
    /// Verbatim text of the model.
    pub model_text: String,
    /// Model, with the parameter values of the model file.
    pub model: Model,
    /// Values of all parameters, unless an item of the study states others.
    pub parameters: Vec<f64>,
    /// Computations requested.
    pub plan: Plan,
    /// Profiles kept in the run file.
    pub store: Store,
    /// Uncertain parameters, by index: those of the model unless the study states others.
    pub spreads: Vec<(usize, Spread)>,
    /// True if plots show the uncertainty of special points.
    pub uncertainty: bool,
    /// Figures of the run.
    pub figures: Vec<FigurePlan>,
}

/// Points of cycles whose profiles stay in the run file when the run is complete. Special points and the ends of
/// branches always keep their profiles, and every point keeps its numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Store {
    /// Every point.
    #[default]
    All,
    /// Special points and ends of branches only.
    Special,
    /// Special points, ends of branches, and every k-th point.
    Every(u64),
}

const ROOT_KEYS: [&str; 23] = [
    "model",
    "title",
    "description",
    "source",
    "tolerance",
    "degree",
    "max-steps",
    "max-time",
    "store",
    "record",
    "contact",
    "parameters",
    "uncertainty",
    "seed",
    "branch",
    "curve",
    "homotopy",
    "explore",
    "survey",
    "sweep",
    "design",
    "map",
    "figure",
];

/// Reads a study file and the model that it names. On failure, returns every mistake found.
pub fn read_study(path: &Path) -> Result<Study, Vec<Diagnostic>> {
    let file = path.display().to_string();
    let text = read_text(path).map_err(|error| vec![unreadable(&file, "the study file", &error)])?;
    parse_study_in(&text, &file, path.parent().unwrap_or(Path::new("")))
}

/// Reads a study text and the model that it names by a path relative to `folder`. On failure, returns every mistake
/// found.
pub fn parse_study_in(text: &str, file: &str, folder: &Path) -> Result<Study, Vec<Diagnostic>> {
    parse(text, file, |walk, root| {
        let value = model_key(walk, root)?;
        let named = walk.string(value, "`model`")?;
        let model_path = simplified(&folder.join(named));
        if let Err(error) = std::fs::metadata(&model_path) {
            walk.report(
                value.span(),
                format!("the model file {} cannot be read: {error}", model_path.display()),
                format!("give the path of a model file, relative to the folder of the study{}", beside(&model_path)),
            );
            return None;
        }
        match read_model(&model_path) {
            Ok((model, model_text)) => Some((model_path.display().to_string(), model_text, model)),
            Err(mut found) => {
                walk.found.append(&mut found);
                None
            }
        }
    })
}

/// Reads a study text together with the given model text; the model file named in the study is not read.
pub fn parse_study(text: &str, file: &str, model_text: &str, model_file: &str) -> Result<Study, Vec<Diagnostic>> {
    parse(text, file, |walk, root| {
        model_key(walk, root)?;
        match parse_model(model_text, model_file) {
            Ok(model) => Some((model_file.to_string(), model_text.to_string(), model)),
            Err(mut found) => {
                walk.found.append(&mut found);
                None
            }
        }
    })
}

/// Reads the texts of a run. Unlike [`parse_study`], it accepts inconsistent units, because earlier versions did not
/// check them.
pub fn parse_study_of_run(
    text: &str,
    file: &str,
    model_text: &str,
    model_file: &str,
) -> Result<Study, Vec<Diagnostic>> {
    parse(text, file, |walk, root| {
        model_key(walk, root)?;
        let found = parse_model_of_run(model_text, model_file);
        found
            .map_err(|mut found| walk.found.append(&mut found))
            .ok()
            .map(|model| (model_file.into(), model_text.into(), model))
    })
}

impl Study {
    /// Returns the study with other limits on trajectories. The limits become part of its text, so that the run records
    /// them. `time` is a number, or a number with a unit.
    ///
    /// # Errors
    /// The mistakes in the limits.
    pub fn limited(self, steps: Option<u64>, time: Option<&str>) -> Result<Study, Vec<Diagnostic>> {
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        let time = time.map(|text| number(text).map_or_else(|| format!("{text:?}"), |value| format!("{value:?}")));
        let steps = steps.map(|steps| ("max-steps", steps.to_string()));
        let settings: Vec<_> = steps.into_iter().chain(time.map(|time| ("max-time", time))).collect();
        if settings.is_empty() {
            return Ok(self);
        }
        let text = with_settings(&self.text, &settings);
        parse_study(&text, &self.file, &self.model_text, &self.model_file)
    }

    /// Returns the study of the exact law of a smoothed one. This becomes part of its text.
    ///
    /// # Errors
    /// A message if the model names no parameter that smooths its law, or if the limit is not known.
    pub fn of_exact_law(&self) -> Result<Study, Vec<Diagnostic>> {
        let text = with_settings(&self.text, &[("contact", "\"limit\"".to_string())]);
        parse_study(&text, &self.file, &self.model_text, &self.model_file)
    }
}

/// Returns a study text with the settings `(key, value)`. Existing values are replaced; new ones are added at the top.
fn with_settings(text: &str, settings: &[(&str, String)]) -> String {
    let (root, _) = DeTable::parse_recoverable(text);
    let mut edits: Vec<(std::ops::Range<usize>, String)> = Vec::new();
    let mut lines = String::new();
    for (key, value) in settings {
        match root.get_ref().get(*key) {
            Some(own) => edits.push((own.span(), value.clone())),
            None => lines.push_str(&format!("{key} = {value}\n")),
        }
    }
    edits.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
    let mut text = text.to_string();
    edits.into_iter().for_each(|(span, value)| text.replace_range(span, &value));
    format!("{lines}{text}")
}

/// True if a text is a study rather than a model: it has no equations and names a model or something to compute.
pub fn is_study(text: &str) -> bool {
    let (root, _) = DeTable::parse_recoverable(text);
    if root.get_ref().contains_key("equations") {
        return false;
    }
    let keys = ["model", "seed", "branch", "curve", "homotopy", "explore", "survey", "sweep", "design"];
    // `[map]` is that of a model, `[[map]]` a map over parameters.
    let maps = || root.get_ref().get("map").is_some_and(|map| map.get_ref().is_array());
    keys.iter().any(|key| root.get_ref().contains_key(*key)) || maps()
}

fn parse(
    text: &str,
    file: &str,
    load: impl FnOnce(&mut Walk, &DeTable) -> Option<(String, String, Model)>,
) -> Result<Study, Vec<Diagnostic>> {
    let (mut walk, root) = Walk::parse(text, file)?;
    if !is_study(text) && (root.contains_key("states") || root.contains_key("equations")) {
        a_model(&mut walk, &root, file);
        return Err(walk.found);
    }
    walk.only(&root, &ROOT_KEYS, "the study");
    let Some((model_file, model_text, model)) = load(&mut walk, &root) else { return Err(walk.found) };

    let model = root.get("contact").and_then(|value| with_contact(&mut walk, value, &model)).unwrap_or(model);
    let tolerance = tolerance(&mut walk, &root);
    let degree = root.get("degree").and_then(|v| walk.integer(v, "`degree`", 2..=7)).unwrap_or(4) as usize;
    let store = root.get("store").map_or(Store::All, |value| store(&mut walk, value));
    let [limits, simulation] = limits(&mut walk, &root, &model.time);
    let mut defaults: Vec<f64> = model.parameters.iter().map(|p| p.value).collect();
    if let Some(value) = root.get("parameters") {
        override_parameters(&mut walk, value, &model, &mut defaults, true);
    }
    no_motions(&mut walk, &root, &model);
    with_events(&mut walk, &root, &model);
    let record: Vec<(String, Quantity)> = root
        .get("record")
        .map(|value| branches::quantities(&mut walk, value, "`record`", &model))
        .into_iter()
        .flatten()
        .map(|(quantity, span)| (text[span].trim_matches(['"', '\'']).to_string(), quantity))
        .collect();
    let spreads = spreads(&mut walk, &root, &model);
    let uncertainty = root.get("uncertainty").is_some_and(|value| uncertainty(&mut walk, value, &spreads));
    let seeds = seeds::read(&mut walk, &root, &model, &defaults, degree);
    let ground = items::read(&mut walk, &root, &model, &seeds);
    let Items { branches, curves, homotopies } = &ground.items;
    let items = branches.iter().map(|b| &b.name).chain(curves.iter().map(|c| &c.name));
    let items = items.chain(homotopies.iter().map(|h| &h.name)).map(String::as_str);
    let taken: Vec<&str> = seeds.iter().map(|(_, s)| s.name.as_str()).chain(items).collect();
    let surveys = responses::surveys(&mut walk, &root, &model, &defaults, &taken);
    let taken: Vec<&str> = taken.into_iter().chain(surveys.iter().map(|s| s.name.as_str())).collect();
    let sweeps = responses::sweeps(&mut walk, &root, &ground, &seeds, &taken);
    let taken: Vec<&str> = taken.into_iter().chain(sweeps.iter().map(|s| s.name.as_str())).collect();
    let explorations = explorations::read(&mut walk, &root, &model, &defaults, &taken);
    let taken: Vec<&str> = taken.iter().copied().chain(sweeps.iter().map(|s| s.name.as_str())).collect();
    let taken: Vec<&str> = taken.into_iter().chain(explorations.iter().map(|e| e.name.as_str())).collect();
    let designs = designs::read(&mut walk, &root, &ground, &explorations, &taken);
    let taken: Vec<&str> = taken.into_iter().chain(designs.iter().map(|own| own.name.as_str())).collect();
    let maps = maps::read(&mut walk, &root, &ground, &explorations, &defaults, &taken);
    let figures = figures::read(&mut walk, &root, &model);
    if walk.found.is_empty() && !(branches.is_empty() && homotopies.is_empty() && explorations.is_empty()) {
        check_totals(&mut walk, &root, &model);
    }
    if walk.found.is_empty() {
        check_seeds(&mut walk, &seeds, &model, &model_text, &model_file);
        check_explorations(&mut walk, &explorations, &model, &model_text, &model_file);
    }
    if !walk.found.is_empty() {
        return Err(walk.found);
    }
    let Items { branches, curves, homotopies } = ground.items;
    let seeds = seeds.into_iter().map(|(_, seed)| seed).collect();
    let plan = Plan {
        tolerance,
        degree,
        limits,
        simulation,
        seeds,
        branches,
        curves,
        homotopies,
        explorations,
        surveys,
        sweeps,
        designs,
        maps,
        record,
    };
    Ok(Study {
        file: file.to_string(),
        text: text.to_string(),
        model_file,
        model_text,
        model,
        parameters: defaults,
        plan,
        store,
        spreads,
        uncertainty,
        figures,
    })
}

/// The model with the treatment of contact that a study asks for.
fn with_contact(walk: &mut Walk, value: &Value, model: &Model) -> Option<Model> {
    let text = walk.string(value, "`contact`")?;
    let contact = match text.as_str() {
        "exact" => Contact::Exact,
        "smoothed over" => Contact::SmoothedOver,
        "limit" => Contact::Limit,
        _ => {
            let hint =
                "write \"exact\" (the default), \"smoothed over\", or \"limit\" for the exact law of a smoothed one";
            walk.report(value.span(), format!("`contact` cannot be `{text}`"), hint);
            return None;
        }
    };
    let found = model.with_contact(contact);
    found.map_err(|[message, hint]| walk.report(value.span(), message, hint)).ok()
}

/// Reports what is not supported with two forcing frequencies.
fn one_forcing(walk: &mut Walk, root: &DeTable) {
    designs::refuse(walk, root, "models with two forcing frequencies");
    for key in ["explore", "survey", "sweep", "homotopy", "map"] {
        let Some((span, _)) = walk.tables(root, key).into_iter().next() else { continue };
        let message = format!("`{key}` is not supported for models with two forcing frequencies");
        walk.report(span, message, "follow the tori with `[[seed]]`, `attractor = \"torus\"`, and `[[branch]]`");
    }
}

/// Reports what does not exist for a boundary-value problem: whatever needs motions from initial states.
fn no_motions(walk: &mut Walk, root: &DeTable, model: &Model) {
    if model.second_phase().is_some() {
        return one_forcing(walk, root);
    }
    if model.conditions() == [0, 0] {
        return;
    }
    designs::refuse(walk, root, "boundary-value problems");
    for key in ["explore", "survey", "sweep"] {
        let Some((span, _)) = walk.tables(root, key).into_iter().next() else { continue };
        let message = "the model is a boundary-value problem: no motion starts from an initial state";
        walk.report(span, message, "give a first profile with `[[seed]]` and follow it with `[[branch]]`");
    }
    for (_, table) in walk.tables(root, "branch") {
        if let Some(value) = table.get("peaks") {
            let message = "`peaks` is not supported for boundary-value problems";
            walk.report(value.span(), message, "mark values of the quantity along the branch, with `mark`");
        }
    }
}

/// Reports requests that are not supported for a model with events.
fn with_events(walk: &mut Walk, root: &DeTable, model: &Model) {
    if model.event_count() == 0 {
        return;
    }
    designs::refuse(walk, root, "models with events");
    for (span, _) in walk.tables(root, "explore") {
        let hint = "start a `[[branch]]` at a `[[seed]]`, and switch at its period doublings";
        walk.report(span, "models with events are not explored", hint);
    }
    for (_, table) in walk.tables(root, "curve") {
        let Some(value) = table.get("hold") else { continue };
        if matches!(
            value.as_ref().as_str(),
            Some("branch-point" | "boundary-equilibrium" | "homoclinic" | "heteroclinic" | "saddle-node-homoclinic")
        ) {
            let message = "curves of this kind are not followed for models with events";
            walk.report(value.span(), message, "fold, period-doubling, torus, hopf or impact-grazing");
        }
    }
    for (_, table) in walk.tables(root, "branch") {
        for key in ["hold", "peaks"] {
            if let Some(value) = table.get(key) {
                let message = format!("`{key}` is not supported for models with events");
                walk.report(value.span(), message, format!("remove `{key}`"));
            }
        }
    }
}

/// Reports a model file where a study was expected, with the commands that accept it.
fn a_model(walk: &mut Walk, root: &DeTable, file: &str) {
    let parameters = root.get("parameters").and_then(|value| value.get_ref().as_table());
    let first = parameters.and_then(|table| table.keys().min_by_key(|key| key.span().start));
    let (place, name) = first.map_or((0..0, "mu"), |key| (key.span(), key.get_ref()));
    let message = "this file is a model, not a study";
    let hint = format!(
        "compute its bifurcation diagram with `foldline explore {file} --free {name}=LOW:HIGH`, integrate it with \
         `foldline simulate {file}`, or write a study for it with `foldline new --study {file}`"
    );
    walk.report(place, message, hint);
}

/// Reports conserved sums of states: with them no solution is isolated, and none can be continued.
fn check_totals(walk: &mut Walk, root: &DeTable, model: &Model) {
    let names: Vec<String> = model.states.iter().map(|state| state.name.clone()).collect();
    let kept: Vec<String> =
        conserved(model, &model.defaults(), &model.ranges()).iter().map(|c| in_words(c, &names)).collect();
    if kept.is_empty() {
        return;
    }
    let (verb, each) =
        if kept.len() == 1 { ("is conserved", "its value") } else { ("are conserved", "the value of each") };
    let message = format!(
        "{} {verb}: solutions are not isolated but form families, so none of them can be continued",
        kept.join(" and ")
    );
    let entry = |(i, sum): (usize, &String)| format!("T{} = {{ sum = \"{sum}\", value = … }}", i + 1);
    let entries: Vec<String> = kept.iter().enumerate().map(entry).collect();
    let hint = format!("prescribe {each} in the model: add a table `[totals]` with {}", entries.join(", "));
    walk.report(root.get("model").map_or(0..0, |value| value.span()), message, hint);
}

/// Reads `store`: `"all"`, `"special"`, or a number k for every k-th point.
fn store(walk: &mut Walk, value: &Value) -> Store {
    const HINT: &str = "\"all\", \"special\" for special points and ends only, or a number k for every k-th point";
    match value.get_ref().as_str() {
        Some("all") => Store::All,
        Some("special") => Store::Special,
        Some(other) => {
            walk.report(value.span(), format!("`store` cannot be \"{other}\""), HINT);
            Store::All
        }
        None => walk.integer(value, "`store`", 1..=1_000_000).map_or(Store::All, Store::Every),
    }
}

/// Reads the limits on trajectories: in the search for first solutions, and in surveys and sweeps.
fn limits(walk: &mut Walk, root: &DeTable, unit: &str) -> [Limits; 2] {
    let steps = root.get("max-steps").and_then(|v| walk.integer(v, "`max-steps`", 1..=10_000_000_000));
    let time = root.get("max-time").and_then(|v| {
        let time = walk.quantity(v, "`max-time`", unit)?;
        if time > 0.0 {
            return Some(time);
        }
        walk.report(v.span(), "`max-time` is not positive", "give a time in the units of the model");
        None
    });
    [Limits::default(), Limits::patient()]
        .map(|usual| Limits { steps: steps.map_or(usual.steps, |n| n as usize), time: time.unwrap_or(usual.time) })
}

fn model_key<'v, 't>(walk: &mut Walk, root: &'v DeTable<'t>) -> Option<&'v Value<'t>> {
    let value = root.get("model");
    if value.is_none() {
        walk.report(0..0, "the study has no `model`", "add a line such as `model = \"../models/lorenz.toml\"`");
    }
    value
}

/// Reads the relative tolerance, from 1e-10 to 1e-4, by default 1e-6.
fn tolerance(walk: &mut Walk, root: &DeTable) -> f64 {
    const DEFAULT: f64 = 1e-6;
    let Some(value) = root.get("tolerance") else { return DEFAULT };
    let Some(tolerance) = walk.number(value, "`tolerance`") else { return DEFAULT };
    if !(1e-10..=1e-4).contains(&tolerance) {
        let message = format!("the tolerance {tolerance:e} is out of range");
        walk.report(value.span(), message, "a number from 1e-10 to 1e-4; 1e-6 is the default");
    }
    tolerance
}

/// Reads the distributions of uncertain parameters: those of the model, replaced by those of the study.
fn spreads(walk: &mut Walk, root: &DeTable, model: &Model) -> Vec<(usize, Spread)> {
    let mut all: Vec<Option<Spread>> = model.parameters.iter().map(|own| own.spread).collect();
    let table = root.get("parameters").and_then(|value| value.get_ref().as_table());
    for (key, value) in table.into_iter().flat_map(|table| table.iter()) {
        let name: &str = key.get_ref();
        let (Some(index), DeValue::Table(inner)) = (model.parameter_index(name), value.get_ref()) else { continue };
        let unit = &model.parameters[index].unit;
        let numbers = ["sigma", "low", "high"].map(|key| {
            let value = inner.get(key)?;
            Some((value.span(), walk.quantity(value, &format!("`{key}` of `{name}`"), unit)?))
        });
        all[index] = spread(walk, name, numbers).or(all[index]);
    }
    all.into_iter().enumerate().filter_map(|(index, spread)| Some((index, spread?))).collect()
}

/// Reads `uncertainty`: true to show it in plots.
fn uncertainty(walk: &mut Walk, value: &Value, spreads: &[(usize, Spread)]) -> bool {
    let wanted = walk.boolean(value, "`uncertainty`").unwrap_or(false);
    if wanted && spreads.is_empty() && walk.found.is_empty() {
        walk.report(
            value.span(),
            "no parameter is uncertain",
            "state an uncertainty, such as `zeta = { value = 0.01, sigma = 0.002 }` in `[parameters]`",
        );
    }
    wanted
}

/// Replaces the parameter values given in a table `{ name = number, … }`; if `uncertain`, they may be tables with an
/// uncertainty.
fn override_parameters(walk: &mut Walk, value: &Value, model: &Model, values: &mut [f64], uncertain: bool) {
    let Some(table) = walk.table(value, "`parameters`") else { return };
    for (key, value) in table.iter() {
        let name: &str = key.get_ref();
        let what = format!("the parameter `{name}`");
        let value = match value.get_ref() {
            // With an uncertainty, and perhaps a value.
            DeValue::Table(inner) if uncertain => {
                walk.only(inner, &["value", "sigma", "low", "high"], &what);
                match inner.get("value") {
                    Some(value) => value,
                    None => continue,
                }
            }
            _ => value,
        };
        match model.parameter_index(name) {
            Some(index) => {
                if let Some(number) = walk.quantity(value, &what, &model.parameters[index].unit) {
                    values[index] = number;
                }
            }
            None => unknown_parameter(walk, key.span(), name, model),
        }
    }
}

fn unknown_parameter(walk: &mut Walk, span: std::ops::Range<usize>, name: &str, model: &Model) {
    let known: Vec<&str> = model.parameters.iter().map(|p| p.name.as_str()).collect();
    let hint = match model.state_index(name) {
        Some(_) => format!("`{name}` is a state; the parameters are: {}", known.join(", ")),
        None => suggest(name, &known),
    };
    walk.report(span, format!("the model `{}` has no parameter `{name}`", model.name), hint);
}

/// Reads the name of an item, which is required and must be unique.
fn unique_name(
    walk: &mut Walk,
    item: &DeTable,
    span: &std::ops::Range<usize>,
    what: &str,
    taken: &[&str],
) -> Option<String> {
    let Some(value) = item.get("name") else {
        walk.report(span.clone(), format!("this {what} has no name"), "add a line such as `name = \"upper\"`");
        return None;
    };
    let name = walk.string(value, "`name`")?;
    if taken.contains(&name.as_str()) {
        walk.report(
            value.span(),
            format!("the name \"{name}\" is used twice"),
            "give every seed, branch, curve, homotopy, exploration, survey, sweep, design question and map a name of its own",
        );
    }
    Some(name)
}

/// Removes `x/..` from a path, for messages.
fn simplified(path: &Path) -> PathBuf {
    use std::path::Component::{Normal, ParentDir};
    let mut parts: Vec<std::path::Component> = Vec::new();
    for part in path.components() {
        match (part, parts.last()) {
            // If x is a symbolic link, `x/..` is not the folder that contains x.
            (ParentDir, Some(Normal(_))) if !parts.iter().collect::<PathBuf>().is_symlink() => {
                parts.pop();
            }
            _ => parts.push(part),
        }
    }
    parts.iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_schema_has_the_keys_that_are_read() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/schema/study.schema.json");
        let schema: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        let keys = |place: &str| {
            let properties = schema.pointer(place).and_then(|p| p.as_object()).unwrap();
            properties.keys().cloned().collect::<Vec<String>>()
        };
        let sorted = |known: &[&str]| {
            let mut known: Vec<String> = known.iter().map(|key| key.to_string()).collect();
            known.sort();
            known
        };
        assert_eq!(keys("/properties"), sorted(&ROOT_KEYS));
        assert_eq!(keys("/$defs/seed/properties"), sorted(&seeds::KEYS));
        assert_eq!(keys("/$defs/seed/properties/cycle/properties"), sorted(&profiles::KEYS));
        assert_eq!(keys("/$defs/branch/properties"), sorted(&branches::KEYS));
        assert_eq!(keys("/$defs/curve/properties"), sorted(&curves::KEYS));
        assert_eq!(keys("/$defs/homotopy/properties"), sorted(&homotopies::KEYS));
        assert_eq!(keys("/$defs/explore/properties"), sorted(&explorations::KEYS));
        assert_eq!(keys("/$defs/survey/properties"), sorted(&responses::SURVEY_KEYS));
        assert_eq!(keys("/$defs/sweep/properties"), sorted(&responses::SWEEP_KEYS));
        assert_eq!(keys("/$defs/design/properties"), sorted(&designs::KEYS));
        assert_eq!(keys("/$defs/map/properties"), sorted(&maps::KEYS));
    }
}
