//! Lowering of terms to graph nodes.

use super::error::{Complaint, Field, Item};
use super::family::{Layout, Piece};
use super::function::{Function, Meaning};
use super::graph::{Binary, Graph, Id, Leaf};
use super::parser::{Expression, Term};
use super::scope::{Local, Scope, Symbol, Target, local};
use super::table::Table;
use std::cell::Cell;
use std::collections::HashSet;
use std::ops::Range;

/// Lowers terms to nodes. Names have been checked; anything that depends on the value of an index is checked here.
pub(super) struct Lowering<'a> {
    pub graph: Graph,
    pub scope: &'a Scope<'a>,
    pub tables: &'a [Table],
    /// Nodes of the pieces, as far as they are known.
    pub pieces: Vec<Option<Id>>,
    /// Period of the forcing, once it is known.
    pub period: Option<Id>,
    /// Velocity of each state that has one.
    pub velocities: Vec<Option<usize>>,
    /// Errors with their positions.
    pub found: Vec<(Item, Field, Complaint)>,
    told: HashSet<(Item, Field, usize)>,
    place: (Item, Field),
}

impl<'a> Lowering<'a> {
    /// Starts with an empty graph.
    pub fn new(scope: &'a Scope<'a>, tables: &'a [Table], velocities: Vec<Option<usize>>) -> Lowering<'a> {
        Lowering {
            graph: Graph::default(),
            scope,
            tables,
            pieces: vec![None; scope.layout.pieces.len()],
            period: None,
            velocities,
            found: Vec::new(),
            told: HashSet::new(),
            place: (Item::Model, Field::Name),
        }
    }

    /// Node of an expression that belongs to `item`; 0 if it is missing.
    pub fn expression(&mut self, item: Item, field: Field, expression: Option<&Expression>, locals: &[Local]) -> Id {
        self.place = (item, field);
        match expression {
            Some(expression) => self.lower(expression, locals, None),
            None => self.graph.constant(0.0),
        }
    }

    /// Assigns nodes to the pieces, in an order in which each uses only earlier ones.
    pub fn define(&mut self, order: &[usize], bodies: &[Option<&Expression>], index: impl Fn(Item) -> Option<&'a str>) {
        let layout: &Layout = self.scope.layout;
        for &i in order {
            let Piece { item, field, element, rate_of } = &layout.pieces[i];
            let id = match rate_of {
                Some(of) => self.rate(*of, *item, *field),
                None => {
                    let own = index(*item).zip(*element).map(|(name, k)| Local::index(name, k as f64));
                    self.expression(*item, *field, bodies[i], own.as_slice())
                }
            };
            self.pieces[i] = Some(id);
        }
    }

    /// Time derivative of a value beyond an end.
    fn rate(&mut self, of: usize, item: Item, field: Field) -> Id {
        let zero = self.graph.constant(0.0);
        let Some(value) = self.pieces[of] else { return zero };
        let per_time = match self.period {
            Some(period) => {
                let one = self.graph.constant(1.0);
                self.graph.divide(one, period)
            }
            None => zero,
        };
        let (velocities, unknown) = (&self.velocities, Cell::new(false));
        let rate = self.graph.derivative(&[value], |graph, leaf| match leaf {
            Leaf::State(j) => match velocities[j as usize] {
                Some(velocity) => Some(graph.leaf(Leaf::State(velocity as u32))),
                None => {
                    unknown.set(true);
                    None
                }
            },
            Leaf::Time => Some(per_time),
            _ => None,
        });
        if unknown.get() {
            let message =
                "the velocity beyond this end is unknown: the value there depends on a state without a velocity";
            let key = if matches!(field, Field::Before(_)) { "before" } else { "after" };
            let hint = format!("give it: `velocity = {{ {key} = \"…\" }}`");
            self.found.push((item, field, Complaint::new(0..0, message, hint)));
        }
        rate.first().copied().unwrap_or(zero)
    }

    fn wrong(&mut self, complaint: Complaint) -> Id {
        let (item, field) = self.place;
        // Report only one element of a repeated item.
        if self.told.insert((item, field, complaint.span.start)) {
            self.found.push((item, field, complaint));
        }
        self.graph.constant(0.0)
    }

    fn lower(&mut self, expression: &Expression, locals: &[Local], at: Option<&Range<usize>>) -> Id {
        let zero = self.graph.constant(0.0);
        let composite = expression.composite || !locals.is_empty();
        if composite && !self.scope.spend(expression.terms.len()) {
            return zero;
        }
        let values = if composite { self.scope.values(expression, locals) } else { Vec::new() };
        let needed = if composite { Scope::needed(expression, &values) } else { Vec::new() };
        let mut ids: Vec<Id> = Vec::with_capacity(expression.terms.len());
        for (t, term) in expression.terms.iter().enumerate() {
            let id = match term {
                _ if composite && !needed[t] => zero,
                _ if composite && values[t].is_some() => self.graph.constant(values[t].unwrap_or(0.0)),
                Term::Number(value) => self.graph.constant(*value),
                Term::Name(name) => match (local(locals, name), self.scope.symbols.get(name.as_str())) {
                    (Some(local), _) => local.id,
                    (None, Some(symbol)) => self.symbol(*symbol),
                    (None, None) => zero,
                },
                Term::Unary(op, a) => self.graph.unary(*op, ids[*a]),
                Term::Binary(Binary::Divide, a, b) => self.graph.quotient_of_rates(ids[*a], ids[*b]),
                Term::Binary(op, a, b) => self.graph.binary(*op, ids[*a], ids[*b]),
                Term::Call(Function { meaning: Meaning::If, .. }, [c, a, b]) if composite && values[*c].is_some() => {
                    ids[if values[*c] != Some(0.0) { *a } else { *b }]
                }
                Term::Call(function, [a, b, c]) => function.apply(&mut self.graph, [ids[*a], ids[*b], ids[*c]]),
                Term::Lookup(table, a) => self.tables[*table].node(&mut self.graph, ids[*a]),
                Term::Element(name, index) => {
                    let span = at.unwrap_or(&expression.spans[t]);
                    match self.scope.element(name, values[*index], span, locals) {
                        Ok(Target::State(i)) => self.graph.leaf(Leaf::State(i as u32)),
                        Ok(Target::Parameter(k)) => self.graph.leaf(Leaf::Parameter(k as u32)),
                        Ok(Target::Piece(piece)) => self.pieces[piece].unwrap_or(zero),
                        Err(complaint) => self.wrong(complaint),
                    }
                }
                Term::Sum(sum) => match self.scope.steps(sum, &values) {
                    Ok(steps) => {
                        let mut total = zero;
                        let mut inner = [locals, &[Local::index(&sum.index, 0.0)]].concat();
                        for k in steps {
                            inner[locals.len()].value = Some(k as f64);
                            let term = self.lower(&sum.term, &inner, at);
                            total = self.graph.add(total, term);
                            if self.scope.exhausted() {
                                break;
                            }
                        }
                        total
                    }
                    Err(complaint) => self.wrong(complaint),
                },
                Term::Apply(function, arguments) => {
                    let scope = self.scope;
                    let names = scope.arguments[*function].iter().zip(arguments);
                    let inner: Vec<Local> =
                        names.map(|(name, a)| Local { name, value: values[*a], id: ids[*a] }).collect();
                    let span = at.unwrap_or(&expression.spans[t]);
                    scope.functions[*function].as_ref().map_or(zero, |body| self.lower(body, &inner, Some(span)))
                }
            };
            ids.push(id);
        }
        ids.last().copied().unwrap_or(zero)
    }

    fn symbol(&mut self, symbol: Symbol) -> Id {
        match symbol {
            Symbol::Number(value) => self.graph.constant(value),
            Symbol::State(i) => self.graph.leaf(Leaf::State(i as u32)),
            Symbol::Parameter(k) => self.graph.leaf(Leaf::Parameter(k as u32)),
            Symbol::Definition(piece) => self.pieces[piece].unwrap_or_else(|| self.graph.constant(0.0)),
            // Already reported by the check of names.
            Symbol::Family(_) => self.graph.constant(0.0),
            Symbol::Time => {
                let time = self.graph.leaf(Leaf::Time);
                self.period.map_or(time, |period| self.graph.multiply(time, period))
            }
        }
    }
}
