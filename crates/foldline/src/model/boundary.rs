//! Conditions of a boundary-value problem: at both ends of an interval, and on integrals over it.
//!
//! **Idea.** A state x at the beginning of the interval is the name `x@0`, at its end `x@1`. In the graph these are
//! components of two directions, so that conditions are differentiated and evaluated like any other expression.

use super::check::Check;
use super::error::{Complaint, Field, Item, ModelError};
use super::graph::{Graph, Id, Leaf};
use super::lower::Lowering;
use super::nearest::suggest;
use super::parser::Expression;
use super::scope::Local;
use super::source::{Boundary, ModelSource, State};
use super::tape::Tape;
use super::{Model, Tapes, cached, column, rows};
use crate::contract::{Batch, VectorField};
use std::sync::Arc;

/// Conditions as graph nodes.
#[derive(Clone, Debug, Default)]
pub(super) struct Conditions {
    /// Expressions that vanish; the ends are the directions 0 and 1.
    pub ends: Vec<Id>,
    /// Integrands.
    pub integrals: Vec<Id>,
    /// Parameters determined along with the solution.
    pub solve: Vec<usize>,
}

/// Parsed conditions.
pub(super) struct Parsed {
    /// Names of the states at either end, with their positions.
    names: Vec<(String, Leaf)>,
    ends: Vec<Option<Expression>>,
    integrals: Vec<Option<Expression>>,
    solve: Vec<usize>,
}

/// Tapes of the conditions, by the parameters in which they are differentiated.
#[derive(Debug, Default)]
pub(super) struct ConditionTapes {
    ends: Tapes<Vec<usize>>,
    integrals: Tapes<Vec<usize>>,
}

/// Parses the conditions, and checks that they determine a curve.
pub(super) fn parse(check: &mut Check) -> Parsed {
    let mut parsed = Parsed { names: Vec::new(), ends: Vec::new(), integrals: Vec::new(), solve: Vec::new() };
    let source = check.source;
    let Some(own) = &source.boundary else { return parsed };
    for (at, state) in source.states.iter().enumerate().filter(|(_, state)| state.repeat.is_none()) {
        let place = source.states[..at].iter().map(|s| super::family::count(&s.repeat)).sum::<usize>() as u32;
        parsed.names.extend([0, 1].map(|end| (format!("{}@{end}", state.name), Leaf::Direction(end, place))));
    }
    let names: Vec<&str> = parsed.names.iter().map(|(name, _)| name.as_str()).collect();
    let conditions = own.conditions.iter().enumerate();
    parsed.ends =
        conditions.map(|(i, c)| check.parse(Item::Condition(i), Field::Expression, &c.expression, &names)).collect();
    let integrals = own.integrals.iter().enumerate();
    parsed.integrals =
        integrals.map(|(i, c)| check.parse(Item::Integral(i), Field::Expression, &c.expression, &[])).collect();
    let known: Vec<&str> = source.parameters.iter().map(|p| p.name.as_str()).collect();
    for name in &own.solve {
        match source.parameters.iter().position(|p| p.name == *name && p.repeat.is_none()) {
            Some(index) if !parsed.solve.contains(&index) => parsed.solve.push(index),
            Some(_) => check.report(Item::Solve, Field::Name, format!("`{name}` is listed twice"), "remove one"),
            None => {
                check.report(Item::Solve, Field::Name, format!("`{name}` is not a parameter"), suggest(name, &known));
            }
        }
    }
    counted(check, own);
    parsed
}

/// Reports conditions that are too few or too many.
fn counted(check: &mut Check, own: &Boundary) {
    let states: usize = check.source.states.iter().map(|s| super::family::count(&s.repeat)).sum();
    let (conditions, unknowns) = (own.conditions.len() + own.integrals.len(), states + own.solve.len());
    if conditions == unknowns {
        return;
    }
    let message = format!(
        "{} and {} for {}{}",
        plural(own.conditions.len(), "boundary condition"),
        plural(own.integrals.len(), "integral condition"),
        plural(states, "state"),
        if own.solve.is_empty() { String::new() } else { format!(" and {}", plural(own.solve.len(), "unknown")) }
    );
    let hint = match conditions < unknowns {
        true => format!("give {} more under [boundary] or [integrals]", unknowns - conditions),
        false => format!(
            "remove {}, or name as many parameters that the conditions determine: `solve = [\"…\"]` under [interval]",
            conditions - unknowns
        ),
    };
    check.report(Item::Solve, Field::Expression, message, hint);
}

fn plural(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

impl Parsed {
    /// Lowers the conditions; everything that they may refer to is known.
    pub fn lowered(&self, lowering: &mut Lowering, states: &[State]) -> Conditions {
        // With repeated states the positions are those of the expanded ones.
        let place = |name: &str| states.iter().position(|s| Some(s.name.as_str()) == name.get(..name.len() - 2));
        let locals: Vec<Local> = self
            .names
            .iter()
            .map(|(name, leaf)| {
                let leaf = match *leaf {
                    Leaf::Direction(end, at) => Leaf::Direction(end, place(name).map_or(at, |at| at as u32)),
                    other => other,
                };
                Local { name, value: None, id: lowering.graph.leaf(leaf) }
            })
            .collect();
        let mut lower = |k: usize, expression: &Option<Expression>, item: Item, locals: &[Local]| {
            let id = lowering.expression(item, Field::Expression, expression.as_ref(), locals);
            if matches!(item, Item::Condition(_)) && depends_on_place(&mut lowering.graph, id, states.len()) {
                let message =
                    "the condition contains a state, or the independent variable, without saying at which end";
                let hint = "write `x@0` for the state `x` at the beginning of the interval, `x@1` at its end; \
                            definitions that contain states must be written out";
                lowering.found.push((Item::Condition(k), Field::Expression, Complaint::new(0..0, message, hint)));
            }
            id
        };
        let ends = self.ends.iter().enumerate().map(|(k, own)| lower(k, own, Item::Condition(k), &locals)).collect();
        let integrals = self.integrals.iter().enumerate();
        let integrals = integrals.map(|(k, own)| lower(k, own, Item::Integral(k), &[])).collect();
        Conditions { ends, integrals, solve: self.solve.clone() }
    }
}

/// True if an expression depends on a state as such or on time.
fn depends_on_place(graph: &mut Graph, id: Id, states: usize) -> bool {
    let zero = graph.constant(0.0);
    let leaves = (0..states as u32).map(Leaf::State).chain([Leaf::Time]);
    leaves.into_iter().any(|leaf| column(graph, &[id], leaf) != [zero])
}

/// Errors of a boundary-value problem with parts that it cannot have.
pub(super) fn refused(source: &ModelSource) -> Vec<ModelError> {
    let Some(own) = &source.boundary else { return Vec::new() };
    let error = |item: Item, name: &str, message: &str, hint: &str| ModelError {
        item,
        field: Field::Name,
        name: name.to_string(),
        span: None,
        message: message.to_string(),
        hint: hint.to_string(),
    };
    let mut found = Vec::new();
    if source.map {
        found.push(error(Item::Model, "", "a map has no interval", "keep [map] or [boundary], not both"));
    }
    if source.forcing.is_none() {
        let hint = "give it: `[interval]` with `length = 1`, or an expression of parameters";
        found.push(error(Item::Forcing, "", "the interval has no length", hint));
    }
    if let Some(total) = source.totals.first() {
        let hint = "write it as a condition under [boundary] or [integrals]";
        found.push(error(Item::Total(0), &total.name, "a boundary-value problem has no conserved totals", hint));
    }
    for (i, state) in source.states.iter().enumerate().filter(|(_, state)| state.period.is_some()) {
        let hint = "remove its `period`: the conditions say how the ends are related";
        found.push(error(Item::State(i), &state.name, "a state of a boundary-value problem is not an angle", hint));
    }
    if own.conditions.is_empty() && own.integrals.is_empty() {
        let hint = "give as many under [boundary] as there are states, such as `left = \"u@0\"`";
        found.push(error(Item::Solve, "", "there are no boundary conditions", hint));
    }
    found
}

/// Error of a boundary-value problem that is not smooth.
pub(super) fn switched(model: &Model) -> Option<ModelError> {
    if model.conditions() == [0, 0] || model.switch_count() == 0 {
        return None;
    }
    let message = format!(
        "the equations are not smooth where {} = 0: boundary-value problems with switching points (abs, max, min, sign, \
         if, comparisons) are not supported",
        model.switch_name(0)
    );
    let hint = "replace the corner by a smooth function, such as sqrt(x^2 + eps^2) for abs(x)".to_string();
    Some(ModelError { item: Item::Equation(0), field: Field::Name, name: String::new(), span: None, message, hint })
}

impl Model {
    /// The conditions at the ends and their derivatives, as [`VectorField::boundary`] orders them.
    fn end_tape(&self, free: &[usize]) -> Arc<Tape> {
        cached(&self.inner.condition_tapes.ends, free.to_vec(), || {
            let (mut graph, n) = (self.inner.compiled.graph.clone(), self.dim() as u32);
            let roots = &self.inner.compiled.conditions.ends;
            let mut along = |leaves: Vec<Leaf>| {
                let columns: Vec<Vec<Id>> = leaves.into_iter().map(|leaf| column(&mut graph, roots, leaf)).collect();
                rows(&columns, roots.len())
            };
            let [left, right] = [0, 1].map(|end| along((0..n).map(|k| Leaf::Direction(end, k)).collect()));
            let by = along(free.iter().map(|k| Leaf::Parameter(*k as u32)).collect());
            Tape::new(&graph, &[roots, &left, &right, &by])
        })
    }

    /// The integrands and their derivatives, as [`VectorField::integrands`] orders them.
    fn integral_tape(&self, free: &[usize]) -> Arc<Tape> {
        cached(&self.inner.condition_tapes.integrals, free.to_vec(), || {
            let mut graph = self.inner.compiled.graph.clone();
            let roots = &self.inner.compiled.conditions.integrals;
            let columns: Vec<Vec<Id>> = self.leaves(free).map(|leaf| column(&mut graph, roots, leaf)).collect();
            let (by_state, by_parameter) = columns.split_at(self.dim());
            Tape::new(&graph, &[roots, &rows(by_state, roots.len()), &rows(by_parameter, roots.len())])
        })
    }

    /// See [`VectorField::boundary`].
    pub(super) fn at_ends(&self, ends: [&[f64]; 2], at: Batch, free: &[usize], to: [&mut [f64]; 4]) {
        let mut to = to;
        self.end_tape(free).run(Batch { lanes: 1, states: ends[0], times: &[0.0], ..at }, &ends, &mut to);
    }

    /// See [`VectorField::integrands`].
    pub(super) fn integrated(&self, at: Batch, free: &[usize], to: [&mut [f64]; 3]) {
        let mut to = to;
        self.integral_tape(free).run(at, &[], &mut to);
    }
}
