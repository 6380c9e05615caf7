//! Compilation of a model source to a graph: resolves names, expands repetition, orders definitions and reports every
//! error.

use super::boundary::{self, Conditions};
use super::callable::Callables;
use super::check::Check;
use super::error::{Complaint, Field, Item, ModelError};
use super::events;
use super::family::Layout;
use super::graph::{Graph, Id};
use super::lower::Lowering;
use super::mass::{self, Entry};
use super::parser::Expression;
use super::scope::{Local, Scope};
use super::source::{ModelSource, Output, Parameter, State};
use std::cell::Cell;
use std::collections::HashMap;

/// Maximum number of states coupled by a mass matrix: elimination causes fill-in.
const MOST_COUPLED: usize = 100;

/// Expressions of a model as graph nodes.
#[derive(Clone, Debug)]
pub(super) struct Compiled {
    pub graph: Graph,
    /// f, one node per state; per forcing period if the model is forced.
    pub field: Vec<Id>,
    /// Period of the forcing.
    pub period: Option<Id>,
    /// One node per output.
    pub outputs: Vec<Id>,
    /// Conditions at both ends of the interval, if there are any.
    pub conditions: Conditions,
    /// Events.
    pub events: Vec<events::Lowered>,
    /// States that form the complex signal.
    pub whirl: Option<[usize; 2]>,
}

/// Named items of a compiled model, with repetition expanded.
pub(super) struct Named {
    pub states: Vec<State>,
    pub parameters: Vec<Parameter>,
    pub outputs: Vec<Output>,
}

/// Parsed expressions of a source, in source order.
struct Parsed {
    ends: boundary::Parsed,
    events: events::Parsed,
    functions: Vec<Option<Expression>>,
    definitions: Vec<Option<Expression>>,
    beyond: Vec<Option<Expression>>,
    equations: Vec<Option<Expression>>,
    outputs: Vec<Option<Expression>>,
    forcing: Option<Expression>,
    mass: Vec<Option<Expression>>,
}

/// Compiles `source`, or returns all errors, up to a hundred.
pub(super) fn compile(source: &ModelSource) -> Result<(Compiled, Named), Vec<ModelError>> {
    let callables = Callables::new(source);
    let mut check = Check { source, symbols: HashMap::new(), callables: &callables, errors: Vec::new() };
    check.sizes();
    if !check.errors.is_empty() {
        return Err(check.errors);
    }
    let layout = Layout::new(source);
    check.names(&layout);
    check.numbers();
    let equation_of = check.equations();
    let states = layout.expanded_states(&source.states);
    let whirl = check.whirl(&states);
    let parsed = parse(&mut check, &layout);
    check.calls(&parsed.functions);
    if !check.errors.is_empty() {
        return Err(check.errors);
    }

    let symbols = std::mem::take(&mut check.symbols);
    let arguments: Vec<Vec<String>> = source.functions.iter().map(|f| f.arguments.clone()).collect();
    let scope = Scope {
        symbols: &symbols,
        layout: &layout,
        functions: &parsed.functions,
        arguments: &arguments,
        spent: Cell::new(0),
    };
    let bodies: Vec<Option<&Expression>> = layout
        .pieces
        .iter()
        .zip(&parsed.beyond)
        .map(|(piece, beyond)| match (piece.field, piece.item) {
            (Field::Expression, Item::Definition(i)) => parsed.definitions[i].as_ref(),
            _ => beyond.as_ref(),
        })
        .collect();
    let order = check.order(&scope, &layout, &bodies);
    let index = |item: Item| check.index(item);
    let mut lowering = Lowering::new(&scope, &source.tables, Layout::velocities(&states));
    if let (Some(own), true) = (&source.forcing, check.errors.is_empty()) {
        // Definitions needed for the period must precede those that use the time, whatever their order in the source.
        lowering.define(&order, &bodies, index);
        let given = lowering.expression(Item::Forcing, Field::Expression, parsed.forcing.as_ref(), &[]);
        lowering.period = Some(match own.is_frequency {
            true => {
                let turn = lowering.graph.constant(std::f64::consts::TAU);
                lowering.graph.divide(turn, given)
            }
            false => given,
        });
        lowering.found.clear();
    }
    if check.errors.is_empty() {
        lowering.define(&order, &bodies, index);
    }
    let zero = lowering.graph.constant(0.0);
    let mut field = vec![zero; states.len()];
    for (i, spread) in layout.states.iter().enumerate() {
        let Some(e) = equation_of[i].filter(|_| check.errors.is_empty()) else { continue };
        for k in 1..=spread.count {
            let own = index(Item::State(i)).map(|name| Local::index(name, k as f64));
            let (item, expression) = (Item::Equation(e), parsed.equations[e].as_ref());
            field[spread.at(k)] = lowering.expression(item, Field::Expression, expression, own.as_slice());
        }
    }
    let masses = parsed.mass.iter().enumerate();
    let masses: Vec<Id> =
        masses.map(|(i, m)| lowering.expression(Item::Mass(i), Field::Expression, m.as_ref(), &[])).collect();
    let mut outputs = Vec::new();
    for (i, spread) in layout.outputs.iter().enumerate().filter(|_| check.errors.is_empty()) {
        for k in 1..=spread.count {
            let own = index(Item::Output(i)).map(|name| Local::index(name, k as f64));
            let (item, expression) = (Item::Output(i), parsed.outputs[i].as_ref());
            outputs.push(lowering.expression(item, Field::Expression, expression, own.as_slice()));
        }
    }
    let conditions = parsed.ends.lowered(&mut lowering, &states);
    let events = match check.errors.is_empty() {
        true => parsed.events.lowered(&mut lowering, source, states.len()),
        false => Vec::new(),
    };
    let Lowering { mut graph, period, found, .. } = lowering;
    for (item, field, complaint) in found {
        check.complain(item, field, complaint);
    }
    if scope.exhausted() {
        let message = "repeated equations, sums and functions expand to more than four million terms";
        let hint = "reduce a count, or name repeated subexpressions in the definitions";
        check.report(Item::Model, Field::Name, message, hint);
    }
    if check.errors.is_empty() {
        couple(&mut check, &mut graph, &layout, &masses, &mut field);
    }
    if !check.errors.is_empty() {
        return Err(check.errors);
    }
    if let Some(period) = period {
        field.iter_mut().for_each(|f| *f = graph.multiply(period, *f));
    }
    let named = Named {
        states,
        parameters: layout.expanded_parameters(&source.parameters),
        outputs: layout.expanded_outputs(&source.outputs),
    };
    Ok((Compiled { period, graph, field, outputs, conditions, events, whirl }, named))
}

fn parse(check: &mut Check, layout: &Layout) -> Parsed {
    let source = check.source;
    let expression = Field::Expression;
    let functions: Vec<Option<Expression>> = source
        .functions
        .iter()
        .enumerate()
        .map(|(i, f)| {
            let arguments: Vec<&str> = f.arguments.iter().map(String::as_str).collect();
            check.parse(Item::Function(i), expression, &f.expression, &arguments)
        })
        .collect();
    let definitions: Vec<Option<Expression>> = source
        .definitions
        .iter()
        .enumerate()
        .map(|(i, d)| {
            let index = check.index(Item::Definition(i));
            check.parse(Item::Definition(i), expression, &d.expression, index.as_slice())
        })
        .collect();
    let beyond = check.beyond(layout);
    let place: HashMap<&str, usize> = source.states.iter().enumerate().map(|(i, s)| (s.name.as_str(), i)).collect();
    let equations = source
        .equations
        .iter()
        .enumerate()
        .map(|(i, d)| {
            let index = place.get(d.name.as_str()).and_then(|state| check.index(Item::State(*state)));
            check.parse(Item::Equation(i), expression, &d.expression, index.as_slice())
        })
        .collect();
    let outputs = source
        .outputs
        .iter()
        .enumerate()
        .map(|(i, o)| {
            let index = check.index(Item::Output(i));
            check.parse(Item::Output(i), expression, &o.expression, index.as_slice())
        })
        .collect();
    let mass = source
        .mass
        .iter()
        .enumerate()
        .map(|(i, m)| check.parse(Item::Mass(i), expression, &m.expression, &[]))
        .collect();
    let forcing = source.forcing.as_ref().and_then(|f| check.parse(Item::Forcing, expression, &f.expression, &[]));
    if let Some(forcing) = &forcing {
        check.forcing(forcing, &definitions, &functions);
    }
    let ends = boundary::parse(check);
    let events = events::parse(check, &layout.expanded_states(&source.states));
    Parsed { ends, events, functions, definitions, beyond, equations, outputs, forcing, mass }
}

/// Solves the equations coupled by a mass matrix for the rates.
fn couple(check: &mut Check, graph: &mut Graph, layout: &Layout, masses: &[Id], field: &mut [Id]) {
    let source = check.source;
    let single = source.states.iter().zip(&layout.states).filter(|(state, _)| state.repeat.is_none());
    let places: HashMap<&str, usize> = single.map(|(state, spread)| (state.name.as_str(), spread.first)).collect();
    let place = |name: &str| places.get(name).copied();
    let mut entries: Vec<Entry> = Vec::new();
    for (i, (mass, id)) in source.mass.iter().zip(masses).enumerate() {
        let item = Item::Mass(i);
        match (place(&mass.row), place(&mass.column)) {
            (Some(row), Some(column)) => entries.push((row, column, *id)),
            _ => {
                let message =
                    format!("a mass couples `{}` and `{}`, which are not two single states", mass.row, mass.column);
                let hint = "masses couple single states only; divide the equations of repeated states by their mass";
                check.report(item, Field::Name, message, hint);
            }
        }
    }
    let rows: std::collections::HashSet<usize> = entries.iter().map(|(row, ..)| *row).collect();
    if rows.len() > MOST_COUPLED {
        let message = format!("{} equations are coupled by masses; the limit is {MOST_COUPLED}", rows.len());
        return check.report(Item::Mass(0), Field::Name, message, "use modal coordinates as states");
    }
    if let (true, Err(row)) = (check.errors.is_empty(), mass::solve(graph, &entries, field)) {
        let own = source.mass.iter().position(|m| place(&m.row) == Some(row)).unwrap_or(0);
        let name = &source.mass[own].row;
        let message = format!("the mass matrix is singular: elimination leaves no diagonal entry for `{name}`");
        let hint = "give every state a mass; if only its diagonal entry is zero, reorder the equations";
        check.complain(Item::Mass(own), Field::Expression, Complaint::new(0..0, message, hint));
    }
}
