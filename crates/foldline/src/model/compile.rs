//! From a written model to a graph: names resolved, definitions put in order, every mistake reported.

use super::error::{Complaint, Field, Item, ModelError};
use super::function::{CONSTANTS, function};
use super::graph::{Graph, Id, Leaf};
use super::nearest::suggest;
use super::parser::{Expression, Term};
use super::source::ModelSource;
use std::collections::{HashMap, HashSet};

/// The expressions of a model as nodes.
#[derive(Debug)]
pub(super) struct Compiled {
    pub graph: Graph,
    /// f, one node per state; per period of the forcing where there is one.
    pub field: Vec<Id>,
    /// The period of the forcing.
    pub period: Option<Id>,
    /// One node per output.
    pub outputs: Vec<Id>,
    /// The states that form the complex signal.
    pub whirl: Option<[usize; 2]>,
}

/// What a name stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Symbol {
    State(usize),
    Parameter(usize),
    Definition(usize),
    Number(f64),
    Time,
}

impl Symbol {
    fn article(self) -> &'static str {
        match self {
            Symbol::State(_) => "a state",
            Symbol::Parameter(_) => "a parameter",
            Symbol::Definition(_) => "a definition",
            Symbol::Number(_) => "a constant",
            Symbol::Time => "the time",
        }
    }
}

/// Most states: the matrices of a cycle are dense in them, a Jacobian for each collocation point.
const MOST_STATES: usize = 1000;
/// Most parameters, definitions and outputs, each. Equations beyond those of the states are reported one by one.
const MOST: usize = 100_000;
/// Names of a circle of definitions that are listed.
const LONGEST_CIRCLE: usize = 12;
/// The name of the time.
const TIME: &str = "t";
/// Further mistakes than these are not looked for.
const MOST_ERRORS: usize = 100;

/// Compiles `source`, or returns what is wrong with it: everything, up to a hundred mistakes.
pub(super) fn compile(source: &ModelSource) -> Result<Compiled, Vec<ModelError>> {
    let mut check = Check { source, symbols: HashMap::new(), errors: Vec::new() };
    check.sizes();
    if !check.errors.is_empty() {
        return Err(check.errors);
    }
    check.names();
    check.numbers();
    let equation_of = check.equations();
    let whirl = check.whirl();

    let definitions: Vec<Option<Expression>> =
        source.definitions.iter().enumerate().map(|(i, d)| check.parse(Item::Definition(i), &d.expression)).collect();
    let equations: Vec<Option<Expression>> =
        source.equations.iter().enumerate().map(|(i, d)| check.parse(Item::Equation(i), &d.expression)).collect();
    let outputs: Vec<Option<Expression>> =
        source.outputs.iter().enumerate().map(|(i, o)| check.parse(Item::Output(i), &o.expression)).collect();
    let forcing = source.forcing.as_ref().and_then(|forcing| check.parse(Item::Forcing, &forcing.expression));
    let order = check.order(&definitions);
    if let Some(forcing) = &forcing {
        check.forcing(forcing, &definitions);
    }
    if !check.errors.is_empty() {
        return Err(check.errors);
    }

    let mut lowering =
        Lowering { graph: Graph::default(), symbols: &check.symbols, definitions: HashMap::new(), period: None };
    if let Some(own) = &source.forcing {
        // Definitions that the period needs come before those that need the time, in whatever order they are.
        order.iter().for_each(|&i| lowering.define(i, definitions[i].as_ref()));
        let given = lowering.lower(forcing.as_ref());
        lowering.period = Some(match own.is_frequency {
            true => {
                let turn = lowering.graph.constant(std::f64::consts::TAU);
                lowering.graph.divide(turn, given)
            }
            false => given,
        });
    }
    order.iter().for_each(|&i| lowering.define(i, definitions[i].as_ref()));
    let mut field: Vec<Id> =
        equation_of.iter().map(|e| lowering.lower(e.and_then(|e| equations[e].as_ref()))).collect();
    if let Some(period) = lowering.period {
        field.iter_mut().for_each(|f| *f = lowering.graph.multiply(period, *f));
    }
    let outputs = outputs.iter().map(|o| lowering.lower(o.as_ref())).collect();
    Ok(Compiled { period: lowering.period, graph: lowering.graph, field, outputs, whirl })
}

struct Check<'a> {
    source: &'a ModelSource,
    symbols: HashMap<&'a str, Symbol>,
    errors: Vec<ModelError>,
}

impl<'a> Check<'a> {
    fn report(&mut self, item: Item, field: Field, message: impl Into<String>, hint: impl Into<String>) {
        if self.errors.len() == MOST_ERRORS {
            return;
        }
        let name = name_of(self.source, item).to_string();
        self.errors.push(ModelError { item, field, name, span: None, message: message.into(), hint: hint.into() });
    }

    fn complain(&mut self, item: Item, complaint: Complaint) {
        if self.errors.len() == MOST_ERRORS {
            return;
        }
        let Complaint { span, message, mut hint, function } = complaint;
        if let Some((name, symbol)) = function.and_then(|f| Some((f.clone(), *self.symbols.get(f.as_str())?))) {
            hint = format!("`{name}` is {}; write a product with a star: `{name}*(…)`", symbol.article());
        }
        let name = name_of(self.source, item).to_string();
        self.errors.push(ModelError { item, field: Field::Expression, name, span: Some(span), message, hint });
    }

    /// Refuses what no computer would get through.
    fn sizes(&mut self) {
        let source = self.source;
        let counts = [
            ("states", source.states.len(), MOST_STATES),
            ("parameters", source.parameters.len(), MOST),
            ("definitions", source.definitions.len(), MOST),
            ("outputs", source.outputs.len(), MOST),
        ];
        for (what, count, most) in counts.into_iter().filter(|(_, count, most)| count > most) {
            let message = format!("the model has {count} {what}, more than {most}");
            let hint = match what {
                "states" => "use a coarser discretisation or fewer modes: the matrices here are dense in the states",
                _ => "leave out what is not needed",
            };
            self.report(Item::Model, Field::Name, message, hint);
        }
    }

    /// Fills the table of names.
    fn names(&mut self) {
        let source = self.source;
        for (name, value) in CONSTANTS {
            self.symbols.insert(name, Symbol::Number(value));
        }
        if source.forcing.is_some() {
            self.symbols.insert(TIME, Symbol::Time);
        }
        let parameters = source.parameters.iter().enumerate();
        let states = source.states.iter().enumerate();
        let definitions = source.definitions.iter().enumerate();
        let declared = parameters
            .map(|(i, p)| (p.name.as_str(), Item::Parameter(i), Symbol::Parameter(i)))
            .chain(states.map(|(i, s)| (s.name.as_str(), Item::State(i), Symbol::State(i))))
            .chain(definitions.map(|(i, d)| (d.name.as_str(), Item::Definition(i), Symbol::Definition(i))));
        for (name, item, symbol) in declared {
            self.identifier(name, item);
            match self.symbols.get(name) {
                Some(Symbol::Number(_)) => {
                    self.report(item, Field::Name, format!("`{name}` is a constant"), "choose another name")
                }
                Some(Symbol::Time) => {
                    let message = format!("`{name}` is the time, since the model has a forcing");
                    self.report(item, Field::Name, message, "choose another name")
                }
                Some(earlier) => {
                    let message = format!("the name `{name}` is used twice: it is {} already", earlier.article());
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
                    self.report(item, Field::Name, message, "choose another name; states are recorded anyway");
                }
                _ if !seen.insert(name) => {
                    self.report(item, Field::Name, format!("the output `{name}` exists twice"), "remove one of the two")
                }
                _ => {}
            }
        }
        if source.states.is_empty() {
            self.report(Item::Model, Field::Name, "the model has no state", "declare at least one state");
        }
    }

    fn identifier(&mut self, name: &str, item: Item) {
        let well_formed = name.starts_with(|c: char| c.is_alphabetic() || c == '_')
            && name.chars().all(|c| c.is_alphanumeric() || c == '_');
        if !well_formed {
            let hint = "a name begins with a letter and goes on with letters, digits and underscores";
            self.report(item, Field::Name, format!("`{name}` is not a name"), hint);
        } else if function(name).is_some() {
            self.report(item, Field::Name, format!("`{name}` is the name of a function"), "choose another name");
        }
    }

    fn numbers(&mut self) {
        for (i, parameter) in self.source.parameters.iter().enumerate() {
            if !parameter.value.is_finite() {
                self.report(Item::Parameter(i), Field::Value, "the value is not a finite number", "write a number");
            }
            if let Some(scale) = parameter.scale.filter(|scale| !(*scale > 0.0 && scale.is_finite())) {
                let hint = "write the characteristic size of this parameter, a positive number";
                self.report(Item::Parameter(i), Field::Scale, format!("the scale {scale} is not positive"), hint);
            }
        }
        for (i, state) in self.source.states.iter().enumerate() {
            if let Some(scale) = state.scale.filter(|scale| !(*scale > 0.0 && scale.is_finite())) {
                let hint = "write the characteristic size of this state, a positive number";
                self.report(Item::State(i), Field::Scale, format!("the scale {scale} is not positive"), hint);
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

    /// Which equation belongs to each state.
    fn equations(&mut self) -> Vec<Option<usize>> {
        let source = self.source;
        let mut equation_of = vec![None; source.states.len()];
        let states: Vec<&str> = source.states.iter().map(|s| s.name.as_str()).collect();
        let place: HashMap<&str, usize> = states.iter().enumerate().rev().map(|(i, &name)| (name, i)).collect();
        for (i, equation) in source.equations.iter().enumerate() {
            match place.get(equation.name.as_str()).copied() {
                None => {
                    let message = format!("an equation for `{}`, which is not a declared state", equation.name);
                    self.report(Item::Equation(i), Field::Name, message, suggest(&equation.name, &states));
                }
                Some(state) if equation_of[state].is_some() => {
                    let message = format!("a second equation for the state `{}`", equation.name);
                    self.report(Item::Equation(i), Field::Name, message, "keep one of the two");
                }
                Some(state) => equation_of[state] = Some(i),
            }
        }
        for (i, name) in states.iter().enumerate().filter(|(i, _)| equation_of[*i].is_none()) {
            let hint = format!("say how it changes in time: the right-hand side of d{name}/dt");
            self.report(Item::State(i), Field::Expression, format!("the state `{name}` has no equation"), hint);
        }
        equation_of
    }

    fn whirl(&mut self) -> Option<[usize; 2]> {
        let [u, v] = self.source.whirl.as_ref()?;
        let states: Vec<&str> = self.source.states.iter().map(|s| s.name.as_str()).collect();
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

    /// Parses an expression and checks its names.
    fn parse(&mut self, item: Item, text: &str) -> Option<Expression> {
        let expression = match Expression::parse(text) {
            Ok(expression) => expression,
            Err(complaint) => {
                self.complain(item, complaint);
                return None;
            }
        };
        let unknown = expression.names().filter(|(name, _)| !self.symbols.contains_key(name));
        for (name, span) in unknown.take(MOST_ERRORS).collect::<Vec<_>>() {
            let hint = match function(name) {
                Some(function) => format!("`{name}` is a function: write `{}`", function.signature),
                None if name == "time" && self.symbols.contains_key(TIME) => "time is called `t`".into(),
                None if name == TIME || name == "time" => {
                    "time is `t` where the model says how long a period of its forcing is: [forcing] with \
                     `frequency = \"…\"` (angular) or `period = \"…\"`"
                        .into()
                }
                None => {
                    let mut known: Vec<&str> = self.symbols.keys().copied().collect();
                    known.sort();
                    suggest(name, &known)
                }
            };
            let outputs = self.source.outputs.iter().any(|output| output.name == name);
            let message = match outputs {
                true => format!("`{name}` is an output, which cannot be used in an expression"),
                false => format!("unknown name `{name}`"),
            };
            let hint = if outputs { "give the expression a name in the definitions and use that".into() } else { hint };
            self.complain(item, Complaint::new(span, message, hint));
        }
        Some(expression)
    }

    /// The period of the forcing may depend on parameters only.
    fn forcing(&mut self, expression: &Expression, definitions: &[Option<Expression>]) {
        let mut seen = vec![false; definitions.len()];
        let mut wait: Vec<(&Expression, Option<std::ops::Range<usize>>)> = vec![(expression, None)];
        while let Some((next, place)) = wait.pop() {
            for (name, span) in next.names().collect::<Vec<_>>() {
                let span = place.clone().unwrap_or(span);
                match self.symbols.get(name).copied() {
                    Some(symbol @ (Symbol::State(_) | Symbol::Time)) => {
                        let message = format!("the forcing depends on `{name}`, which is {}", symbol.article());
                        let hint = "its frequency or period is made of numbers and parameters";
                        return self.complain(Item::Forcing, Complaint::new(span, message, hint));
                    }
                    Some(Symbol::Definition(j)) if !std::mem::replace(&mut seen[j], true) => {
                        wait.extend(definitions[j].as_ref().map(|own| (own, Some(span))));
                    }
                    _ => {}
                }
            }
        }
    }

    /// The definitions in an order in which each uses only earlier ones.
    fn order(&mut self, definitions: &[Option<Expression>]) -> Vec<usize> {
        let uses: Vec<Vec<(usize, std::ops::Range<usize>)>> = definitions
            .iter()
            .map(|expression| {
                let names = expression.iter().flat_map(|e| e.names());
                names
                    .filter_map(|(name, span)| match self.symbols.get(name) {
                        Some(Symbol::Definition(j)) => Some((*j, span)),
                        _ => None,
                    })
                    .collect()
            })
            .collect();
        let mut users: Vec<Vec<usize>> = vec![Vec::new(); definitions.len()];
        uses.iter().enumerate().for_each(|(i, list)| list.iter().for_each(|(j, _)| users[*j].push(i)));
        let mut waits_for: Vec<usize> = uses.iter().map(Vec::len).collect();
        let mut settled: Vec<bool> = waits_for.iter().map(|&count| count == 0).collect();
        let mut order: Vec<usize> = (0..definitions.len()).filter(|&i| settled[i]).collect();
        let mut next = 0;
        while let Some(&done) = order.get(next) {
            next += 1;
            for &user in &users[done] {
                waits_for[user] -= 1;
                if waits_for[user] == 0 {
                    settled[user] = true;
                    order.push(user);
                }
            }
        }
        if let Some(start) = settled.iter().position(|settled| !settled) {
            self.cycle(start, &uses, &settled);
        }
        order
    }

    /// Reports the cycle that is reached from `start` along definitions that are not settled.
    fn cycle(&mut self, start: usize, uses: &[Vec<(usize, std::ops::Range<usize>)>], settled: &[bool]) {
        let mut path = vec![start];
        let mut place: HashMap<usize, usize> = HashMap::from([(start, 0)]);
        while let Some((next, span)) = uses[path[path.len() - 1]].iter().find(|(j, _)| !settled[*j]) {
            if let Some(&at) = place.get(next) {
                let mut names: Vec<&str> =
                    path[at..].iter().map(|&i| self.source.definitions[i].name.as_str()).collect();
                names.push(names[0]);
                if names.len() > LONGEST_CIRCLE {
                    names.splice(LONGEST_CIRCLE / 2..names.len() - LONGEST_CIRCLE / 2, ["…"]);
                }
                let chain = names.join(" → ");
                let last = Item::Definition(path[path.len() - 1]);
                let message = format!("definitions that need each other: {chain}");
                self.complain(
                    last,
                    Complaint::new(span.clone(), message, "break the circle; only a state may depend on itself"),
                );
                return;
            }
            place.insert(*next, path.len());
            path.push(*next);
        }
    }
}

fn name_of(source: &ModelSource, item: Item) -> &str {
    match item {
        Item::Model => &source.name,
        Item::Parameter(i) => &source.parameters[i].name,
        Item::Definition(i) => &source.definitions[i].name,
        Item::State(i) => &source.states[i].name,
        Item::Equation(i) => &source.equations[i].name,
        Item::Output(i) => &source.outputs[i].name,
        Item::Whirl | Item::Forcing => "",
    }
}

/// Turns terms into nodes.
struct Lowering<'a> {
    graph: Graph,
    symbols: &'a HashMap<&'a str, Symbol>,
    definitions: HashMap<usize, Id>,
    /// Of the forcing, once it is known.
    period: Option<Id>,
}

impl Lowering<'_> {
    /// Gives a definition its node.
    fn define(&mut self, number: usize, expression: Option<&Expression>) {
        let id = self.lower(expression);
        self.definitions.insert(number, id);
    }

    /// The node of an expression that was checked; 0 for one that is missing, which the checks exclude.
    fn lower(&mut self, expression: Option<&Expression>) -> Id {
        let zero = self.graph.constant(0.0);
        let mut ids: Vec<Id> = Vec::new();
        for term in expression.iter().flat_map(|e| &e.terms) {
            let id = match term {
                Term::Number(value) => self.graph.constant(*value),
                Term::Name(name) => match self.symbols.get(name.as_str()) {
                    Some(Symbol::Number(value)) => self.graph.constant(*value),
                    Some(Symbol::State(i)) => self.graph.leaf(Leaf::State(*i as u32)),
                    Some(Symbol::Parameter(k)) => self.graph.leaf(Leaf::Parameter(*k as u32)),
                    Some(Symbol::Definition(j)) => self.definitions.get(j).copied().unwrap_or(zero),
                    Some(Symbol::Time) => {
                        let time = self.graph.leaf(Leaf::Time);
                        self.period.map_or(time, |period| self.graph.multiply(time, period))
                    }
                    None => zero,
                },
                Term::Unary(op, a) => self.graph.unary(*op, ids[*a]),
                Term::Binary(op, a, b) => self.graph.binary(*op, ids[*a], ids[*b]),
                Term::Call(function, [a, b, c]) => function.apply(&mut self.graph, [ids[*a], ids[*b], ids[*c]]),
            };
            ids.push(id);
        }
        ids.last().copied().unwrap_or(zero)
    }
}
