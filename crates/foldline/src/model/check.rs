//! Checks of all names and numbers of a model; mistakes inside expressions are found in `words`.

use super::callable::{Callables, SUM};
use super::error::{Complaint, Field, Item, ModelError};
use super::family::{Kind, Layout, count};
use super::function::{CONSTANTS, function};
use super::nearest::suggest;
use super::scope::{Symbol, Symbols};
use super::source::{ModelSource, Repeat, State};
use std::collections::{HashMap, HashSet};

/// Maximum number of states: cycle matrices are dense in the states, with one Jacobian for each collocation point.
const MOST_STATES: usize = 1000;
/// Maximum number each of parameters, definitions and outputs. Surplus equations are reported one by one.
const MOST: usize = 100_000;
/// Name of the time variable.
pub(super) const TIME: &str = "t";
/// Maximum number of errors reported.
pub(super) const MOST_ERRORS: usize = 100;

/// Check in progress: names found so far, and errors.
pub(super) struct Check<'a> {
    pub source: &'a ModelSource,
    pub symbols: Symbols<'a>,
    pub callables: &'a Callables,
    pub errors: Vec<ModelError>,
}

impl<'a> Check<'a> {
    /// Reports an error.
    pub fn report(&mut self, item: Item, field: Field, message: impl Into<String>, hint: impl Into<String>) {
        if self.errors.len() == MOST_ERRORS {
            return;
        }
        let name = name_of(self.source, item).to_string();
        self.errors.push(ModelError { item, field, name, span: None, message: message.into(), hint: hint.into() });
    }

    /// Reports an error inside an expression.
    pub fn complain(&mut self, item: Item, field: Field, complaint: Complaint) {
        if self.errors.len() == MOST_ERRORS {
            return;
        }
        let Complaint { span, message, mut hint, function } = complaint;
        if let Some((name, symbol)) = function.and_then(|f| Some((f.clone(), *self.symbols.get(f.as_str())?))) {
            hint = match symbol {
                Symbol::Family(_) => format!("write the index in square brackets: `{name}[…]`"),
                _ => format!("`{name}` is {}; write a product with a star: `{name}*(…)`", symbol.article()),
            };
            if matches!(symbol, Symbol::State(_)) {
                hint += ". A value at another time, `x(t - tau)`, makes a delay equation, which is not supported";
            }
        }
        let name = name_of(self.source, item).to_string();
        self.errors.push(ModelError { item, field, name, span: Some(span), message, hint });
    }

    /// Rejects models that are too large to compute.
    pub fn sizes(&mut self) {
        let source = self.source;
        let total = |counts: &mut dyn Iterator<Item = usize>| counts.fold(0, usize::saturating_add);
        let counts = [
            ("states", total(&mut source.states.iter().map(|s| count(&s.repeat))), MOST_STATES),
            ("parameters", total(&mut source.parameters.iter().map(|p| count(&p.repeat))), MOST),
            ("definitions", total(&mut source.definitions.iter().map(|d| count(&d.repeat))), MOST),
            ("outputs", total(&mut source.outputs.iter().map(|o| count(&o.repeat))), MOST),
            ("functions", source.functions.len(), MOST),
        ];
        for (what, count, most) in counts.into_iter().filter(|(_, count, most)| count > most) {
            let message = format!("the model has {count} {what}; the limit is {most}");
            let hint = match what {
                "states" => "use a coarser discretisation or fewer modes: foldline uses dense matrices",
                _ => "remove those that are not needed",
            };
            // Point to the one count that is too large on its own, if there is one.
            let large = self.repeats().find(|(_, repeat)| repeat.count > most).map(|(item, _)| item);
            let (item, field) = large.map_or((Item::Model, Field::Name), |item| (item, Field::Count));
            self.report(item, field, message, hint);
        }
        let empty: Vec<Item> = self.repeats().filter(|(_, r)| r.count == 0).map(|(item, _)| item).collect();
        for item in empty {
            self.report(item, Field::Count, "a count of 0", "a count is at least 1");
        }
    }

    /// Repetitions of all repeated items.
    pub fn repeats(&self) -> impl Iterator<Item = (Item, &'a Repeat)> + use<'a> {
        let source = self.source;
        let states = source.states.iter().enumerate().map(|(i, s)| (Item::State(i), &s.repeat));
        let parameters = source.parameters.iter().enumerate().map(|(i, p)| (Item::Parameter(i), &p.repeat));
        let definitions = source.definitions.iter().enumerate().map(|(i, d)| (Item::Definition(i), &d.repeat));
        let outputs = source.outputs.iter().enumerate().map(|(i, o)| (Item::Output(i), &o.repeat));
        let all = states.chain(parameters).chain(definitions).chain(outputs);
        all.filter_map(|(item, repeat)| Some((item, repeat.as_ref()?)))
    }

    /// Fills the symbol table, with positions as in `layout`.
    pub fn names(&mut self, layout: &Layout) {
        let source = self.source;
        let families: HashMap<Item, usize> = layout.families.iter().enumerate().map(|(f, own)| (own.item, f)).collect();
        let family = |item: Item, single: Symbol| families.get(&item).map_or(single, |f| Symbol::Family(*f));
        for (name, value) in CONSTANTS {
            self.symbols.insert(name, Symbol::Number(value));
        }
        if source.forcing.is_some() {
            self.symbols.insert(source.boundary.as_ref().map_or(TIME, |own| own.variable.as_str()), Symbol::Time);
        }
        let parameters = source.parameters.iter().enumerate();
        let states = source.states.iter().enumerate();
        let definitions = source.definitions.iter().enumerate();
        let constants = source.constants.iter().enumerate();
        let declared = constants
            .map(|(i, c)| (c.name.as_str(), Item::Constant(i), Symbol::Number(c.value)))
            .chain(
                parameters
                    .map(|(i, p)| (p.name.as_str(), Item::Parameter(i), Symbol::Parameter(layout.parameters[i].first))),
            )
            .chain(states.map(|(i, s)| (s.name.as_str(), Item::State(i), Symbol::State(layout.states[i].first))))
            .chain(
                definitions.map(|(i, d)| {
                    (d.name.as_str(), Item::Definition(i), Symbol::Definition(layout.definitions[i].first))
                }),
            )
            .map(|(name, item, symbol)| (name, item, family(item, symbol)));
        for (name, item, symbol) in declared {
            self.identifier(name, item);
            if self.callables.get(name).is_some() {
                let message = format!("the name `{name}` is already taken by a function");
                self.report(item, Field::Name, message, "choose another name");
            }
            match self.symbols.get(name) {
                Some(Symbol::Number(_)) => {
                    self.report(item, Field::Name, format!("`{name}` is a constant"), "choose another name")
                }
                Some(Symbol::Time) => {
                    let message = format!("`{name}` is the time, since the model has a forcing");
                    self.report(item, Field::Name, message, "choose another name")
                }
                Some(earlier) => {
                    let earlier = match earlier {
                        Symbol::Family(f) => match layout.families[*f].kind {
                            Kind::State => "a state",
                            Kind::Parameter => "a parameter",
                            Kind::Definition => "a definition",
                        },
                        other => other.article(),
                    };
                    let message = format!("the name `{name}` is used twice: it is already {earlier}");
                    self.report(item, Field::Name, message, "parameters, states and definitions need different names");
                }
                None => {
                    self.symbols.insert(name, symbol);
                }
            }
        }
        let mut seen = HashSet::new();
        for (i, output) in source.outputs.iter().enumerate() {
            let (item, name) = (Item::Output(i), output.name.as_str());
            self.identifier(name, item);
            match self.symbols.get(name) {
                Some(symbol @ (Symbol::State(_) | Symbol::Parameter(_))) => {
                    let message = format!("the output `{name}` has the name of {}", symbol.article());
                    self.report(item, Field::Name, message, "choose another name; states are stored anyway");
                }
                _ if !seen.insert(name) => self.report(
                    item,
                    Field::Name,
                    format!("the output `{name}` is defined twice"),
                    "remove one of the two",
                ),
                _ => {}
            }
        }
        self.functions();
        self.indices();
        if source.states.is_empty() {
            self.report(Item::Model, Field::Name, "the model has no states", "declare at least one, such as `[states.x]` with `equation = \"mu - x\"`; `foldline new oscillator` writes an example");
        }
    }

    /// Name of the index of a repeated item.
    pub fn index(&self, item: Item) -> Option<&'a str> {
        let source = self.source;
        let repeat = match item {
            Item::State(i) => &source.states[i].repeat,
            Item::Parameter(i) => &source.parameters[i].repeat,
            Item::Definition(i) => &source.definitions[i].repeat,
            Item::Output(i) => &source.outputs[i].repeat,
            _ => return None,
        };
        repeat.as_ref().map(|repeat| repeat.index.as_str())
    }

    /// Checks names of functions, tables and arguments.
    fn functions(&mut self) {
        let source = self.source;
        let mut seen = HashSet::new();
        let functions = source.functions.iter().enumerate().map(|(i, f)| (&f.name, Item::Function(i)));
        let tables = source.tables.iter().enumerate().map(|(i, t)| (&t.name, Item::Table(i)));
        for (name, item) in functions.chain(tables) {
            self.identifier(name, item);
            if !seen.insert(name) {
                self.report(
                    item,
                    Field::Name,
                    format!("the function `{name}` is defined twice"),
                    "remove one of the two",
                );
            }
        }
        for (i, function) in source.functions.iter().enumerate() {
            let mut seen = HashSet::new();
            for argument in &function.arguments {
                self.identifier(argument, Item::Function(i));
                if !seen.insert(argument) {
                    let message = format!("two arguments have the name `{argument}`");
                    self.report(Item::Function(i), Field::Name, message, "give each argument its own name");
                }
            }
        }
        for (i, table) in source.tables.iter().enumerate() {
            if let Some([message, hint]) = table.mistake() {
                self.report(Item::Table(i), Field::Value, message, hint);
            }
        }
    }

    /// Checks names of indices.
    fn indices(&mut self) {
        for (item, repeat) in self.repeats().collect::<Vec<_>>() {
            let index = repeat.index.as_str();
            self.identifier(index, item);
            if let Some(symbol) = self.symbols.get(index) {
                let message =
                    format!("the index `{index}` has a name that is already in use: it is {}", symbol.article());
                self.report(item, Field::Index, message, "choose another index, for example `index = \"j\"`");
            }
        }
    }

    fn identifier(&mut self, name: &str, item: Item) {
        // A velocity is named after its state, with a prime.
        let word = match item {
            Item::State(_) => name.strip_suffix('\'').unwrap_or(name),
            _ => name,
        };
        // The bracket distinguishes the function `sum` from a quantity of that name.
        let called = matches!(item, Item::Function(_) | Item::Table(_));
        let well_formed = word.starts_with(|c: char| c.is_alphabetic() || c == '_')
            && word.chars().all(|c| c.is_alphanumeric() || c == '_');
        if !well_formed {
            let hint = "a name starts with a letter, followed by letters, digits and underscores";
            self.report(item, Field::Name, format!("`{name}` is not a name"), hint);
        } else if function(name).is_some() || called && name == SUM {
            self.report(item, Field::Name, format!("`{name}` is the name of a function"), "choose another name");
        }
    }

    /// Checks values, scales and ranges.
    pub fn numbers(&mut self) {
        for (i, parameter) in self.source.parameters.iter().enumerate() {
            let count = count(&parameter.repeat);
            if !parameter.values.is_empty() && parameter.values.len() != count {
                let message = format!("{} values for a count of {count}", parameter.values.len());
                self.report(Item::Parameter(i), Field::Value, message, "give one value for each element");
            }
            if !parameter.values.iter().chain([&parameter.value]).all(|value| value.is_finite()) {
                self.report(Item::Parameter(i), Field::Value, "the value is not a finite number", "write a number");
            }
            if let Some(scale) = parameter.scale.filter(|scale| !(*scale > 0.0 && scale.is_finite())) {
                let hint = "give the typical size of this parameter, a positive number";
                self.report(Item::Parameter(i), Field::Scale, format!("the scale {scale} is not positive"), hint);
            }
        }
        for (i, state) in self.source.states.iter().enumerate() {
            if let Some(scale) = state.scale.filter(|scale| !(*scale > 0.0 && scale.is_finite())) {
                let hint = "give the typical size of this state, a positive number";
                self.report(Item::State(i), Field::Scale, format!("the scale {scale} is not positive"), hint);
            }
            if let Some(period) = state.period.filter(|period| !(*period > 0.0 && period.is_finite())) {
                let hint = "give the period of the angle, a positive number such as \"2*pi\" or 360";
                self.report(Item::State(i), Field::Period, format!("the period {period} is not positive"), hint);
            }
            let Some([low, high]) = state.range else { continue };
            if !(low.is_finite() && high.is_finite()) {
                self.report(Item::State(i), Field::Range, "the range is not finite", "write two numbers");
            } else if low >= high {
                let message = format!("the range [{low}, {high}] is the wrong way round");
                self.report(
                    Item::State(i),
                    Field::Range,
                    message,
                    format!("write [{high}, {low}], smaller value first"),
                );
            }
        }
    }

    /// Position of the equation of each state.
    pub fn equations(&mut self) -> Vec<Option<usize>> {
        let source = self.source;
        let mut equation_of = vec![None; source.states.len()];
        let states: Vec<&str> = source.states.iter().map(|s| s.name.as_str()).collect();
        let place: HashMap<&str, usize> = states.iter().enumerate().rev().map(|(i, &name)| (name, i)).collect();
        for (i, equation) in source.equations.iter().enumerate() {
            match place.get(equation.name.as_str()).copied() {
                None => {
                    let message = format!("an equation for `{}`, which is not a declared state", equation.name);
                    let state = derivative_of(&equation.name).filter(|state| place.contains_key(state));
                    let hint = match (state, equation.name.strip_suffix('\'')) {
                        (Some(state), _) => format!("the rate of change of `{state}` is written `{state} = \"…\"`"),
                        (_, Some(state)) => {
                            format!("an acceleration declares its state: write `\"{state}''\" = \"…\"` under [states]")
                        }
                        _ => suggest(&equation.name, &states),
                    };
                    self.report(Item::Equation(i), Field::Name, message, hint);
                }
                Some(state) if equation_of[state].is_some() => {
                    let message = format!("a second equation for the state `{}`", equation.name);
                    let hint =
                        "keep one of the two; under [states] too, `name = …` is an equation, not an initial value";
                    self.report(Item::Equation(i), Field::Name, message, hint);
                }
                Some(state) => equation_of[state] = Some(i),
            }
        }
        for (i, name) in states.iter().enumerate().filter(|(i, _)| equation_of[*i].is_none()) {
            let hint = match source.map {
                true => format!("give its next value, `{name} = \"…\"` under [map]"),
                false => format!("give its rate of change: the right-hand side of d{name}/dt"),
            };
            self.report(Item::State(i), Field::Expression, format!("the state `{name}` has no equation"), hint);
        }
        equation_of
    }

    /// Positions among all `states` of the two states that form the complex signal.
    pub fn whirl(&mut self, states: &[State]) -> Option<[usize; 2]> {
        let [u, v] = self.source.whirl.as_ref()?;
        let states: Vec<&str> = states.iter().map(|s| s.name.as_str()).collect();
        let found = [u, v].map(|name| states.iter().position(|s| s == name));
        for (name, _) in [u, v].into_iter().zip(found).filter(|(_, place)| place.is_none()) {
            let message = format!("`{name}` is not a state");
            self.report(Item::Whirl, Field::Name, message, suggest(name, &states));
        }
        match found {
            [Some(a), Some(b)] if a == b => {
                self.report(Item::Whirl, Field::Name, "both parts of the signal are the same state", "name two states");
                None
            }
            [Some(a), Some(b)] => Some([a, b]),
            _ => None,
        }
    }
}

pub(super) fn name_of(source: &ModelSource, item: Item) -> &str {
    match item {
        Item::Model => &source.name,
        Item::Parameter(i) => &source.parameters[i].name,
        Item::Definition(i) => &source.definitions[i].name,
        Item::State(i) => &source.states[i].name,
        Item::Equation(i) => &source.equations[i].name,
        Item::Output(i) => &source.outputs[i].name,
        Item::Constant(i) => &source.constants[i].name,
        Item::Function(i) => &source.functions[i].name,
        Item::Table(i) => &source.tables[i].name,
        Item::Mass(i) => &source.mass[i].row,
        Item::Total(i) => &source.totals[i].name,
        Item::Condition(i) => source.boundary.as_ref().map_or("", |own| &own.conditions[i].name),
        Item::Integral(i) => source.boundary.as_ref().map_or("", |own| &own.integrals[i].name),
        Item::Event(i) => &source.events[i].name,
        Item::Whirl | Item::Forcing | Item::Solve => "",
        Item::Smoothing => source.smoothing.as_ref().map_or("", |own| &own.parameter),
    }
}

/// Name of the state whose derivative a name denotes in one of the usual notations: `x'`, `dx/dt`, `dxdt`, `xdot`, `dx`.
fn derivative_of(name: &str) -> Option<&str> {
    let endings = ["'", "_dot", "dot"];
    let ended = endings.iter().find_map(|ending| name.strip_suffix(ending));
    let begun = || {
        let rest = name.strip_prefix('d')?;
        Some(["/dt", "_dt", "dt"].iter().find_map(|ending| rest.strip_suffix(ending)).unwrap_or(rest))
    };
    ended.or_else(begun).filter(|state| !state.is_empty())
}
