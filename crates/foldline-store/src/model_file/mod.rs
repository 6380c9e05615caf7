//! Reader of model files.
//!
//! **Idea.** The file is TOML; its expressions are compiled by [`foldline::model`]. A mistake inside an expression is
//! reported with its line and column in the file. The format is described in docs/book/model-files.md.

mod boundary;
mod events;
mod functions;
pub(crate) mod items;
mod mass;
mod repeat;
mod rotor;
mod states;
mod totals;
mod units;

use crate::diagnostic::Diagnostic;
use crate::text_file::{read_text, unreadable};
use crate::toml_walk::{Value, Walk, diagnose};
use foldline::model::{
    Definition, Field, Forcing, Item, Model, ModelError, ModelSource, Parameter, Smoothing, unsupported,
};
use foldline_shaft::Machine;
use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::Path;
use toml::de::{DeTable, DeValue};

const ROOT_KEYS: [&str; 33] = [
    "name",
    "description",
    "source",
    "time",
    "units",
    "constants",
    "functions",
    "tables",
    "parameters",
    "forcing",
    "interval",
    "boundary",
    "integrals",
    "definitions",
    "states",
    "equations",
    "map",
    "events",
    "mass",
    "totals",
    "outputs",
    "whirl",
    "smoothing",
    "rotor",
    "material",
    "shaft",
    "disc",
    "bearing",
    "point-mass",
    "unbalance",
    "film",
    "contact",
    "force",
];

/// Reads a model file. Returns the model and the verbatim text, or every mistake found.
pub fn read_model(path: &Path) -> Result<(Model, String), Vec<Diagnostic>> {
    let file = path.display().to_string();
    let text = read_text(path).map_err(|error| vec![unreadable(&file, "the model file", &error)])?;
    Ok((parse_model(&text, &file)?, text))
}

/// Reads a model text; `file` is its name in messages. On failure, returns every mistake found.
pub fn parse_model(text: &str, file: &str) -> Result<Model, Vec<Diagnostic>> {
    parse(text, file, true).map(|(model, _)| model)
}

/// Reads a model file and, if the model is described as a rotor, the rotor.
///
/// # Errors
/// Every mistake found.
pub fn read_rotor(path: &Path) -> Result<(Model, Option<Machine>), Vec<Diagnostic>> {
    let file = path.display().to_string();
    let text = read_text(path).map_err(|error| vec![unreadable(&file, "the model file", &error)])?;
    parse_rotor(&text, &file)
}

/// Reads a model text as [`read_rotor`]; `file` is its name in messages.
pub fn parse_rotor(text: &str, file: &str) -> Result<(Model, Option<Machine>), Vec<Diagnostic>> {
    let (model, read) = parse(text, file, true)?;
    let Some(read) = read else { return Ok((model, None)) };
    match rotor::machine(read) {
        Ok(machine) => Ok((model, Some(machine))),
        Err(errors) => {
            let told = |error: ModelError| {
                let message = format!("a linear analysis needs coefficients without states: {}", error.message);
                diagnose(file, text, 0..0, message, error.hint)
            };
            Err(errors.into_iter().map(told).collect())
        }
    }
}

/// Reads the model text of a run. Inconsistent units are accepted, because earlier versions did not check them.
pub(crate) fn parse_model_of_run(text: &str, file: &str) -> Result<Model, Vec<Diagnostic>> {
    parse(text, file, false).map(|(model, _)| model)
}

fn parse(text: &str, file: &str, refuse_units: bool) -> Result<(Model, Option<rotor::Read>), Vec<Diagnostic>> {
    let (mut walk, root) = Walk::parse(text, file)?;
    if let Some(named) = root.get("model").filter(|_| !root.contains_key("equations")) {
        let message = "this file is a study, not a model";
        let model = named.get_ref().as_str().map_or(String::new(), |model| format!("; its model is `{model}`"));
        walk.report(named.span(), message, format!("run it with `foldline run {file}`{model}"));
        return Err(walk.found);
    }
    let mut reader = Reader::new(walk, text);
    let mut source = reader.source(&root, file);
    let rotor = reader.rotor(&root, &mut source);
    if reader.incomplete {
        return Err(reader.walk.found);
    }
    match Model::compile(source.clone()) {
        Ok(model) if reader.walk.found.is_empty() => {
            let checked = rotor.as_ref().map_or(&source, |own| &own.checked);
            reader.with_units(model, checked, file, refuse_units).map(|model| (model, rotor))
        }
        Ok(_) => Err(reader.walk.found),
        Err(errors) => {
            let told = |error: &ModelError| !(reader.forcing_misspelt && error.item == Item::Forcing);
            let errors: Vec<ModelError> = errors.into_iter().filter(told).collect();
            errors.into_iter().for_each(|error| reader.report(error));
            let mut found = reader.walk.found;
            found.sort_by_key(|diagnostic| (diagnostic.line, diagnostic.column));
            Err(found)
        }
    }
}

/// Reads a model text without compiling it; `file` is its name in messages. Mistakes in expressions are not found.
pub fn parse_source(text: &str, file: &str) -> Result<ModelSource, Vec<Diagnostic>> {
    let (walk, root) = Walk::parse(text, file)?;
    let mut reader = Reader::new(walk, text);
    let mut source = reader.source(&root, file);
    reader.rotor(&root, &mut source);
    if reader.walk.found.is_empty() { Ok(source) } else { Err(reader.walk.found) }
}

/// Reader of the tables of a model, which records the position of every item.
struct Reader<'t> {
    walk: Walk<'t>,
    text: &'t str,
    places: HashMap<(Item, Field), Range<usize>>,
    forcing_misspelt: bool,
    /// True if a count or a state could not be read; compiling would then report many consequential errors.
    incomplete: bool,
    /// States whose accelerations are given under `[equations]`.
    accelerated: HashSet<String>,
    /// Items with an explicit unit.
    measured: HashSet<Item>,
    /// True if units are labels that are not checked.
    labels_only: bool,
}

/// Entries of a table in the order of the file.
type Entries<'v, 't> = Vec<(String, Range<usize>, &'v Value<'t>)>;

impl<'t> Reader<'t> {
    fn new(walk: Walk<'t>, text: &'t str) -> Reader<'t> {
        let (places, accelerated, measured) = (HashMap::new(), HashSet::new(), HashSet::new());
        let (forcing_misspelt, incomplete, labels_only) = (false, false, false);
        Reader { walk, text, places, forcing_misspelt, incomplete, accelerated, measured, labels_only }
    }
}

impl Reader<'_> {
    fn source(&mut self, root: &DeTable, file: &str) -> ModelSource {
        // Without a table, everything that refers to it would be reported as well.
        self.incomplete |= !self.walk.only(root, &ROOT_KEYS, "the model").is_empty();
        let stem = Path::new(file).file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let mut source = ModelSource {
            name: root.get("name").and_then(|v| self.walk.string(v, "`name`")).unwrap_or(stem),
            description: self.prose(root, "description"),
            source: self.prose(root, "source"),
            time: self.time(root),
            ..ModelSource::default()
        };
        for (name, place, value) in self.entries(root, "constants") {
            self.constant(name, place, value, &mut source);
        }
        for (head, place, value) in self.entries(root, "functions") {
            self.function(&head, place, value, &mut source);
        }
        for (name, place, value) in self.entries(root, "tables") {
            self.table(name, place, value, &mut source);
        }
        for (name, place, value) in self.entries(root, "parameters") {
            self.parameter(name, place, value, &mut source);
        }
        source.forcing = root.get("forcing").and_then(|value| self.forcing(value, &mut source));
        if let Some((boundary, length)) = self.boundary(root) {
            (source.boundary, source.forcing) = (Some(boundary), length);
        }
        for (name, place, value) in self.entries(root, "definitions") {
            self.definition(name, place, value, &mut source);
        }
        source.map = root.contains_key("map");
        let equations = self.entries(root, if source.map { "map" } else { "equations" });
        if source.map {
            self.next_states(root, &equations);
        }
        self.accelerated = equations.iter().filter_map(|(name, ..)| Some(name.strip_suffix("''")?.into())).collect();
        for (name, place, value) in self.entries(root, "states") {
            self.state(name, place, value, &mut source);
        }
        for (name, place, value) in equations {
            let item = Item::Equation(source.equations.len());
            let expression = self.expression(item, place, value, &format!("the equation of `{name}`"));
            // The equation of a velocity is that of the acceleration.
            let name = name.strip_suffix("''").map_or_else(|| name.clone(), |base| format!("{base}'"));
            source.equations.push(Definition::new(&name, &expression));
        }
        self.mass(root, &mut source);
        self.events(root, &mut source);
        for (name, place, value) in self.entries(root, "totals") {
            self.total(name, place, value, &mut source);
        }
        for (i, (name, place, value)) in self.entries(root, "outputs").into_iter().enumerate() {
            let output = self.output(i, name, place, value, &source.constants);
            source.outputs.push(output);
        }
        source.whirl = root.get("whirl").and_then(|value| self.whirl(value));
        source.smoothing = root.get("smoothing").and_then(|value| self.smoothing(value));
        source
    }

    /// Reads the parameter that makes a smoothed law sharp: its name, or a table with the name and the limit.
    fn smoothing(&mut self, value: &Value) -> Option<Smoothing> {
        self.places.insert((Item::Smoothing, Field::Name), value.span());
        let Some(table) = value.get_ref().as_table() else {
            return Some(Smoothing { parameter: self.walk.string(value, "`smoothing`")?, to_zero: false });
        };
        self.walk.only(table, &["parameter", "limit"], "`smoothing`");
        let parameter = table.get("parameter").and_then(|own| self.walk.string(own, "`parameter` of `smoothing`"));
        let limit = match table.get("limit").map(Value::get_ref) {
            None => Some(false),
            Some(DeValue::Float(own)) if matches!(own.as_str(), "inf" | "+inf") => Some(false),
            Some(DeValue::Float(own)) if own.as_str().parse() == Ok(0.0) => Some(true),
            Some(DeValue::Integer(own)) if own.as_str() == "0" => Some(true),
            Some(_) => None,
        };
        let (Some(parameter), Some(to_zero)) = (parameter, limit) else {
            let message = "`smoothing` does not name a parameter and a limit";
            let hint =
                "write `smoothing = \"K\"`, or `smoothing = { parameter = \"eps\", limit = 0 }`; the limit is 0 or inf";
            self.walk.report(value.span(), message, hint);
            return None;
        };
        Some(Smoothing { parameter, to_zero })
    }

    /// Reports mistakes in the table of a map.
    fn next_states(&mut self, root: &DeTable, entries: &Entries) {
        if let Some(value) = root.get("equations") {
            let message = "the model has both [equations] and [map]";
            self.walk.report(value.span(), message, "keep one: [equations] gives rates of change, [map] next values");
        }
        for (name, place, _) in entries.iter().filter(|(name, ..)| name.contains('\'')) {
            let base = name.trim_end_matches('\'');
            let hint = format!("write `{base} = \"…\"`, the next value of `{base}`");
            self.walk.report(place.clone(), format!("`{name}` is not the name of a state"), hint);
            // Otherwise the state would be reported as well, as one without an equation.
            self.incomplete = true;
        }
    }

    fn entries<'v, 't>(&mut self, root: &'v DeTable<'t>, key: &str) -> Entries<'v, 't> {
        let table = root.get(key).and_then(|value| match value.get_ref() {
            DeValue::Array(_) if key == "states" => {
                let hint = "write a table with the equation of each state: `[states]`, then lines such as `x = \"-y\"`";
                self.walk.report(value.span(), "`states` is a list, not a table", hint);
                None
            }
            _ => self.walk.table(value, &format!("`{key}`")),
        });
        // Without a table, everything that refers to it would be reported as well.
        self.incomplete |= root.contains_key(key) && table.is_none();
        let mut entries: Entries =
            table.into_iter().flat_map(|t| t.iter()).map(|(k, v)| (k.get_ref().to_string(), k.span(), v)).collect();
        entries.sort_by_key(|(_, place, _)| place.start);
        entries
    }

    /// Reads a text that may be empty or absent.
    fn prose(&mut self, table: &DeTable, key: &str) -> String {
        match table.get(key).map(|value| (value, value.get_ref().as_str())) {
            None => String::new(),
            Some((_, Some(text))) => text.trim().to_string(),
            Some((value, None)) => self.walk.string(value, &format!("`{key}`")).unwrap_or_default(),
        }
    }

    /// Reads the forcing: exactly one of `frequency` and `period`.
    fn forcing(&mut self, value: &Value, source: &mut ModelSource) -> Option<Forcing> {
        let several = |value: &Value| value.get_ref().as_array().is_some();
        let two = value.get_ref().as_table().and_then(|t| t.get("frequencies")).filter(|own| several(own));
        if let Some(own) = two {
            return self.two_forcings(value, own, source);
        }
        let listed = several(value) || value.get_ref().as_table().is_some_and(|t| t.values().any(several));
        if let Some(kind) = unsupported("frequencies").filter(|_| listed) {
            self.forcing_misspelt = true;
            self.walk.report(value.span(), kind.message, kind.instead);
            return Some(Forcing { is_frequency: false, expression: "1".into() });
        }
        let table = self.walk.table(value, "`forcing`")?;
        let before = self.walk.found.len();
        self.walk.only(table, &["frequency", "period"], "`forcing`");
        // After a misspelt key, neither a missing period nor the use of time is reported.
        self.forcing_misspelt = self.walk.found.len() > before;
        let (is_frequency, own) = match (table.get("frequency"), table.get("period")) {
            (Some(own), None) => (true, own),
            (None, Some(own)) => (false, own),
            _ if self.forcing_misspelt => return Some(Forcing { is_frequency: false, expression: "1".into() }),
            (both, _) => {
                let message =
                    if both.is_some() { "both a frequency and a period" } else { "no frequency and no period" };
                let hint = "give either `frequency = \"…\"` (angular) or `period = \"…\"`";
                self.walk.report(value.span(), format!("the forcing has {message}"), hint);
                return None;
            }
        };
        self.places.insert((Item::Forcing, Field::Name), value.span());
        let what = if is_frequency { "the frequency of the forcing" } else { "the period of the forcing" };
        let expression = self.expression(Item::Forcing, own.span(), own, what);
        Some(Forcing { is_frequency, expression })
    }

    /// Reads two frequencies. The times `t1` and `t2` of their terms become definitions, and the phase of the second a
    /// parameter.
    fn two_forcings(&mut self, value: &Value, own: &Value, source: &mut ModelSource) -> Option<Forcing> {
        const PHASE: &str = "phase_2";
        let before = self.walk.found.len();
        if let Some(table) = self.walk.table(value, "`forcing`") {
            self.walk.only(table, &["frequencies"], "a forcing with two frequencies");
        }
        self.places.insert((Item::Forcing, Field::Name), value.span());
        let list: Vec<&Value> = own.get_ref().as_array().map(|list| list.iter().collect()).unwrap_or_default();
        let [first, second] = list[..] else {
            let message = format!("`frequencies` lists {} of them", list.len());
            self.walk.report(own.span(), message, "give two, as in `frequencies = [\"Omega\", \"nu\"]`");
            self.forcing_misspelt = true;
            return Some(Forcing { is_frequency: false, expression: "1".into() });
        };
        let what = "a frequency of the forcing";
        let second = self.expression(Item::Forcing, second.span(), second, what);
        let expression = self.expression(Item::Forcing, first.span(), first, what);
        self.forcing_misspelt = self.walk.found.len() > before;
        let mut phase = Parameter::new(PHASE, 0.0);
        phase.description = "phase of the second forcing at t = 0, in turns".into();
        self.places.insert((Item::Parameter(source.parameters.len()), Field::Name), own.span());
        source.parameters.push(phase);
        for (name, text) in [("t1", "t".to_string()), ("t2", format!("t + {PHASE}*2*pi/({second})"))] {
            let item = Item::Definition(source.definitions.len());
            self.places.insert((item, Field::Name), own.span());
            self.places.insert((item, Field::Expression), own.span());
            source.definitions.push(Definition::new(name, &text));
        }
        source.second = Some((Forcing { is_frequency: true, expression: second }, PHASE.into()));
        Some(Forcing { is_frequency: true, expression })
    }

    /// Reads the text of an expression. Any other type is reported and replaced by `0`, so that it is reported only
    /// once.
    fn expression(&mut self, item: Item, name: Range<usize>, value: &Value, what: &str) -> String {
        self.places.insert((item, Field::Name), name);
        self.places.insert((item, Field::Expression), value.span());
        match value.get_ref() {
            // A plain number is an expression too.
            DeValue::Integer(_) | DeValue::Float(_) => {
                self.walk.number(value, what).map_or_else(|| "0".into(), |number| format!("{number:?}"))
            }
            _ => self.walk.string(value, what).unwrap_or_else(|| "0".into()),
        }
    }

    fn whirl(&mut self, value: &Value) -> Option<[String; 2]> {
        self.places.insert((Item::Whirl, Field::Name), value.span());
        match value.get_ref().as_array().map(|list| (list.first(), list.get(1), list.len())) {
            Some((Some(u), Some(v), 2)) => {
                Some([self.walk.string(u, "the first of `whirl`")?, self.walk.string(v, "the second of `whirl`")?])
            }
            _ => {
                let hint = "name the two states of the complex signal, as in `whirl = [\"u\", \"v\"]`";
                self.walk.report(value.span(), "`whirl` is not a pair of states", hint);
                None
            }
        }
    }

    fn place(&self, item: Item, field: Field) -> Range<usize> {
        let known = |field| self.places.get(&(item, field)).cloned();
        known(field).or_else(|| known(Field::Name)).unwrap_or(0..0)
    }

    fn place_of(&self, error: &ModelError) -> Range<usize> {
        let place = self.place(error.item, error.field);
        error.span.as_ref().and_then(|span| inside(self.text, &place, span)).unwrap_or(place)
    }

    fn report(&mut self, error: ModelError) {
        self.walk.report(self.place_of(&error), error.message, error.hint);
    }
}

/// Position in the file of a part of the string literal at `string`; `None` if escapes shift the text.
fn inside(text: &str, string: &Range<usize>, part: &Range<usize>) -> Option<Range<usize>> {
    let raw = text.get(string.clone())?;
    let quote = ["\"\"\"", "'''", "\"", "'"].into_iter().find(|quote| raw.starts_with(quote))?;
    let content = &raw[quote.len()..];
    if quote.starts_with('"') && content.contains('\\') {
        return None;
    }
    let skipped = match quote.len() {
        3 => ["\r\n", "\n"].into_iter().find(|end| content.starts_with(end)).map_or(0, str::len),
        _ => 0,
    };
    let start = string.start + quote.len() + skipped;
    Some(start + part.start..start + part.end)
}
