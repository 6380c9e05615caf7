//! Events: instants at which the state jumps, such as impacts.
//!
//! **Idea.** An event is a switch h of the field with a reset map R. f does not depend on the sign of h; where h passes
//! zero in the direction of the event, the state x becomes R(x, p, t). States that a reset does not name keep their
//! values. R, like f, is differentiated exactly on the graph.
//!
//! **Fails when** a model is a map or a boundary-value problem, or has conserved totals: events are refused there.

use super::check::Check;
use super::error::{Complaint, Field, Item, ModelError};
use super::graph::{Binary, Graph, Id, Leaf, Node};
use super::lower::Lowering;
use super::nearest::suggest;
use super::parser::Expression;
use super::source::{ModelSource, State};
use super::tape::Tape;
use super::{Branch, Model, Tapes, cached, column, rows, sliding};
use crate::contract::Batch;
use std::sync::Arc;

/// An event as graph nodes.
#[derive(Clone, Debug)]
pub(super) struct Lowered {
    /// The switch.
    pub when: Id,
    /// Sign of the change at which the state jumps; 0 for both.
    pub direction: f64,
    /// `[n]`: R.
    pub set: Vec<Id>,
    /// Condition that every state satisfies.
    pub allowed: Option<Id>,
}

/// Parsed events.
pub(super) struct Parsed {
    when: Vec<Option<Expression>>,
    /// Position of the state, and its expression.
    set: Vec<Vec<(usize, Option<Expression>)>>,
    allowed: Vec<Option<Expression>>,
}

/// Tapes of the resets, and of the derivative of f in time.
#[derive(Debug, Default)]
pub(super) struct EventTapes {
    resets: Tapes<(usize, Vec<usize>)>,
    allowed: Tapes<()>,
    in_time: Tapes<Branch>,
}

/// Parses the events; `states` are all states, with repetition expanded.
pub(super) fn parse(check: &mut Check, states: &[State]) -> Parsed {
    let source = check.source;
    let mut parsed = Parsed { when: Vec::new(), set: Vec::new(), allowed: Vec::new() };
    let names: Vec<&str> = states.iter().map(|own| own.name.as_str()).collect();
    for (i, event) in source.events.iter().enumerate() {
        let item = Item::Event(i);
        parsed.when.push(check.parse(item, Field::Expression, &event.when, &[]));
        let mut set = Vec::new();
        for (k, own) in event.set.iter().enumerate() {
            let Some(place) = names.iter().position(|name| *name == own.name) else {
                let message = format!("`{}` is not a state", own.name);
                check.report(item, Field::Set(k), message, suggest(&own.name, &names));
                continue;
            };
            set.push((place, check.parse(item, Field::Set(k), &own.expression, &[])));
        }
        if event.set.is_empty() {
            let hint = "say which states jump and to what: `set = { v = \"-e*v\" }`; a kink or a jump of the equations \
                        alone needs no event, `if`, `max`, `abs` and `sign` are followed exactly";
            check.report(item, Field::Name, "the event changes no state", hint);
        }
        parsed.set.push(set);
        parsed.allowed.push(event.allowed.as_ref().and_then(|text| check.parse(item, Field::Allowed, text, &[])));
    }
    parsed
}

impl Parsed {
    /// Lowers the events; everything that they may refer to is known.
    pub fn lowered(&self, lowering: &mut Lowering, source: &ModelSource, states: usize) -> Vec<Lowered> {
        let mut all = Vec::new();
        for (i, event) in source.events.iter().enumerate() {
            let item = Item::Event(i);
            let when = lowering.expression(item, Field::Expression, self.when[i].as_ref(), &[]);
            let complain = |lowering: &mut Lowering, field: Field, message: &str, hint: &str| {
                lowering.found.push((item, field, Complaint::new(0..0, message, hint)));
            };
            if is_comparison(&lowering.graph, when) {
                let hint = "write the difference of its sides, as in `when = \"x - d\"` with `direction = \"up\"` for \
                            x > d";
                complain(lowering, Field::Expression, "`when` is a comparison, which has no zero to pass", hint);
            } else if !varies(&mut lowering.graph, when, states) {
                let hint = "it must depend on a state or on the time";
                complain(lowering, Field::Expression, "`when` does not change along a motion", hint);
            }
            let mut set: Vec<Id> = (0..states as u32).map(|k| lowering.graph.leaf(Leaf::State(k))).collect();
            for (k, (place, expression)) in self.set[i].iter().enumerate() {
                set[*place] = lowering.expression(item, Field::Set(k), expression.as_ref(), &[]);
            }
            let allowed = self.allowed[i].as_ref().map(|own| {
                let id = lowering.expression(item, Field::Allowed, Some(own), &[]);
                if !is_comparison(&lowering.graph, id) {
                    let hint = "write an inequality, as in `allowed = \"x <= d\"`";
                    complain(lowering, Field::Allowed, "`allowed` is not a comparison", hint);
                }
                id
            });
            all.push(Lowered { when, direction: event.direction.sign(), set, allowed });
        }
        all
    }
}

fn is_comparison(graph: &Graph, id: Id) -> bool {
    matches!(graph.node(id), Node::Binary(Binary::Less | Binary::LessOrEqual, ..))
}

/// True if an expression depends on a state or on time.
fn varies(graph: &mut Graph, id: Id, states: usize) -> bool {
    let zero = graph.constant(0.0);
    let leaves = (0..states as u32).map(Leaf::State).chain([Leaf::Time]);
    leaves.into_iter().any(|leaf| column(graph, &[id], leaf) != [zero])
}

/// Errors of models that cannot have events.
pub(super) fn refused(source: &ModelSource) -> Vec<ModelError> {
    let Some(first) = source.events.first() else { return Vec::new() };
    let (what, hint) = if source.map {
        ("a map has no events", "use `if` in its equations")
    } else if source.boundary.is_some() {
        ("a boundary-value problem has no events", "remove [events]")
    } else if source.states.iter().any(|state| state.period.is_some()) {
        ("events in a model with angles are not supported", "remove the `period` of its states")
    } else if !source.totals.is_empty() {
        ("events in a model with conserved totals are not supported", "eliminate a state by hand and remove [totals]")
    } else {
        return Vec::new();
    };
    let (message, hint) = (what.to_string(), hint.to_string());
    vec![ModelError { item: Item::Event(0), field: Field::Name, name: first.name.clone(), span: None, message, hint }]
}

impl Model {
    fn reset_tape(&self, event: usize, free: &[usize]) -> Arc<Tape> {
        cached(&self.inner.event_tapes.resets, (event, free.to_vec()), || {
            let roots = &self.inner.compiled.events[event].set;
            let mut graph = self.inner.compiled.graph.clone();
            let columns: Vec<Vec<Id>> = self.leaves(free).map(|leaf| column(&mut graph, roots, leaf)).collect();
            let in_time = column(&mut graph, roots, Leaf::Time);
            let (rx, rp) = columns.split_at(self.states.len());
            Tape::new(&graph, &[roots, &rows(rx, roots.len()), &rows(rp, roots.len()), &in_time])
        })
    }

    /// See [`crate::contract::VectorField::reset`].
    pub(super) fn resets(&self, event: usize, at: Batch, free: &[usize], mut to: [&mut [f64]; 4]) {
        self.reset_tape(event, free).run(at, &[], &mut to);
    }

    /// See [`crate::contract::VectorField::slopes_in_time`].
    pub(super) fn in_time(&self, at: Batch, out: &mut [f64]) {
        let tape = |branch: Branch| {
            cached(&self.inner.event_tapes.in_time, branch, || {
                let (mut graph, field) = self.branch(branch, 0);
                let slopes = column(&mut graph, &field, Leaf::Time);
                Tape::new(&graph, &[&slopes])
            })
        };
        if at.signs.is_empty() {
            return tape(Branch::Actual).run(at, &[], &mut [out]);
        }
        if sliding::occurs(&at) {
            return sliding::each(at, &[], &mut [out], |at, _, along, to| match along {
                None => self.in_time(at, to[0]),
                Some(switch) => tape(Branch::Sliding(switch)).run(at, &[at.signs], to),
            });
        }
        tape(Branch::Given).run(at, &[at.signs], &mut [out]);
    }

    /// The first event that does not allow a state, by index.
    pub(super) fn first_forbidden(&self, at: Batch) -> Option<usize> {
        let events = &self.inner.compiled.events;
        let places: Vec<usize> = (0..events.len()).filter(|k| events[*k].allowed.is_some()).collect();
        if places.is_empty() {
            return None;
        }
        let tape = cached(&self.inner.event_tapes.allowed, (), || {
            let roots: Vec<Id> = events.iter().filter_map(|own| own.allowed).collect();
            Tape::new(&self.inner.compiled.graph, &[&roots])
        });
        let mut holds = vec![0.0; places.len() * at.lanes];
        tape.run(at, &[], &mut [&mut holds]);
        let wrong = holds.iter().position(|own| *own == 0.0)?;
        Some(places[wrong / at.lanes])
    }
}
