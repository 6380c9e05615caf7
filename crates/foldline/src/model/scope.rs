//! Reading of an expression for a given index: known values, needed terms, selected elements.
//!
//! **Idea.** For a given index some terms are plain numbers: indices, bounds of sums, conditions on the index. A branch
//! of `if` that such a condition excludes is not read, so `if(i > 1, x[i-1], 0)` needs no x[0].

use super::error::Complaint;
use super::family::{Family, Kind, Layout};
use super::function::{Function, Meaning};
use super::graph::{Graph, Id};
use super::parser::{Expression, Sum, Term};
use super::source::{Ends, element_name};
use std::cell::Cell;
use std::collections::HashMap;
use std::ops::Range;

/// Meaning of a name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Symbol {
    State(usize),
    Parameter(usize),
    /// Piece.
    Definition(usize),
    /// Repeated name.
    Family(usize),
    Number(f64),
    Time,
}

impl Symbol {
    /// Description with its article, for messages.
    pub fn article(self) -> &'static str {
        match self {
            Symbol::State(_) => "a state",
            Symbol::Parameter(_) => "a parameter",
            Symbol::Definition(_) => "a definition",
            Symbol::Family(_) => "repeated over an index",
            Symbol::Number(_) => "a constant",
            Symbol::Time => "the time",
        }
    }
}

/// Symbols of a model by name.
pub(super) type Symbols<'a> = HashMap<&'a str, Symbol>;

/// Name local to one expression: an index or an argument.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local<'a> {
    pub name: &'a str,
    /// Value, if it is known before the model runs.
    pub value: Option<f64>,
    /// Node otherwise.
    pub id: Id,
}

impl<'a> Local<'a> {
    /// Local for an index.
    pub fn index(name: &'a str, k: f64) -> Local<'a> {
        Local { name, value: Some(k), id: Id(0) }
    }
}

/// Single quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    State(usize),
    Parameter(usize),
    Piece(usize),
}

/// Maximum number of terms produced by repetition, sums and functions.
const MOST_TERMS: usize = 4_000_000;

/// Everything that expressions can refer to.
#[derive(Debug)]
pub(super) struct Scope<'a> {
    pub symbols: &'a Symbols<'a>,
    pub layout: &'a Layout<'a>,
    pub functions: &'a [Option<Expression>],
    pub arguments: &'a [Vec<String>],
    pub spent: Cell<usize>,
}

/// Innermost local with the given name.
pub(super) fn local<'l, 'a>(locals: &'l [Local<'a>], name: &str) -> Option<&'l Local<'a>> {
    locals.iter().rev().find(|local| local.name == name)
}

impl<'a> Scope<'a> {
    /// Counts terms that have been read; false once there are too many.
    pub fn spend(&self, terms: usize) -> bool {
        self.spent.set(self.spent.get().saturating_add(terms));
        !self.exhausted()
    }

    /// True if more terms were read than allowed.
    pub fn exhausted(&self) -> bool {
        self.spent.get() > MOST_TERMS
    }

    /// Value of each term, if it is known before the model runs.
    pub fn values(&self, expression: &Expression, locals: &[Local]) -> Vec<Option<f64>> {
        let mut values: Vec<Option<f64>> = Vec::with_capacity(expression.terms.len());
        for term in &expression.terms {
            let of = |place: usize| values[place];
            let value = match term {
                Term::Number(value) => Some(*value),
                Term::Name(name) => match (local(locals, name), self.symbols.get(name.as_str())) {
                    (Some(local), _) => local.value,
                    (None, Some(Symbol::Number(value))) => Some(*value),
                    _ => None,
                },
                Term::Unary(op, a) => of(*a).map(|a| op.of(a)),
                Term::Binary(op, a, b) => of(*a).zip(of(*b)).map(|(a, b)| op.of(a, b)),
                Term::Call(Function { meaning: Meaning::If, .. }, [c, a, b]) => {
                    of(*c).and_then(|c| of(if c != 0.0 { *a } else { *b }))
                }
                Term::Call(function, arguments) => {
                    let known: Option<Vec<f64>> = arguments.iter().map(|a| of(*a)).collect();
                    known.map(|known| value_of(function, &known))
                }
                Term::Apply(function, arguments) => {
                    let known: Option<Vec<f64>> = arguments.iter().map(|a| of(*a)).collect();
                    known.and_then(|known| self.value_of_own(*function, &known))
                }
                Term::Element(..) | Term::Lookup(..) | Term::Sum(_) => None,
            };
            values.push(value);
        }
        values
    }

    fn value_of_own(&self, function: usize, known: &[f64]) -> Option<f64> {
        let body = self.functions[function].as_ref()?;
        if !self.spend(body.terms.len()) {
            return None;
        }
        let names = self.arguments[function].iter();
        let locals: Vec<Local> = names.zip(known).map(|(name, value)| Local::index(name, *value)).collect();
        self.values(body, &locals).last().copied().flatten()
    }

    /// Marks the terms needed for the last one; terms with known values need nothing.
    pub fn needed(expression: &Expression, values: &[Option<f64>]) -> Vec<bool> {
        let mut needed = vec![false; values.len()];
        needed.iter_mut().last().into_iter().for_each(|last| *last = true);
        for (t, term) in expression.terms.iter().enumerate().rev() {
            if !needed[t] || values[t].is_some() {
                continue;
            }
            match term {
                Term::Number(_) | Term::Name(_) => {}
                Term::Unary(_, a) | Term::Element(_, a) | Term::Lookup(_, a) => needed[*a] = true,
                Term::Binary(_, a, b) => [a, b].into_iter().for_each(|a| needed[*a] = true),
                Term::Call(Function { meaning: Meaning::If, .. }, [c, a, b]) => match values[*c] {
                    Some(c) => needed[if c != 0.0 { *a } else { *b }] = true,
                    None => [c, a, b].into_iter().for_each(|a| needed[*a] = true),
                },
                Term::Call(_, arguments) => arguments.iter().for_each(|a| needed[*a] = true),
                Term::Apply(_, arguments) => arguments.iter().for_each(|a| needed[*a] = true),
                Term::Sum(sum) => [sum.first, sum.last].into_iter().for_each(|a| needed[a] = true),
            }
        }
        needed
    }

    /// Range of the index of a sum.
    pub fn steps(&self, sum: &Sum, values: &[Option<f64>]) -> Result<std::ops::RangeInclusive<i64>, Complaint> {
        let bound = |place: usize| values[place].filter(|v| v.fract() == 0.0 && v.abs() < 1e9);
        match bound(sum.first).zip(bound(sum.last)) {
            Some((first, last)) => Ok(first as i64..=last as i64),
            None => {
                let hint = "the limits of a sum may contain only numbers, constants and indices";
                Err(Complaint::new(sum.index_span.clone(), "the limits of this sum are not two integers", hint))
            }
        }
    }

    /// Element of `name` with the given index.
    pub fn element(
        &self,
        name: &str,
        index: Option<f64>,
        span: &Range<usize>,
        locals: &[Local],
    ) -> Result<Target, Complaint> {
        let Some(Symbol::Family(family)) = self.symbols.get(name) else {
            // Already reported by the check of names.
            return Err(Complaint::new(span.clone(), format!("`{name}` has no index"), "write the name alone"));
        };
        let family = &self.layout.families[*family];
        let Some(index) = index else {
            let message = format!("the index of `{name}` depends on a quantity that varies");
            let hint = "an index may contain only numbers, constants and the index of the equation, as in `x[i+1]`";
            return Err(Complaint::new(span.clone(), message, hint));
        };
        if index.fract() != 0.0 || index.abs() > 1e9 {
            let message = format!("the index of `{name}` is {index}, not an integer");
            let hint = "make it an integer, for example with `floor(…)`";
            return Err(Complaint::new(span.clone(), message, hint));
        }
        self.place(family, index as i64).ok_or_else(|| outside(family, index as i64, span, locals))
    }

    /// Element of a family with the given index, if it exists.
    fn place(&self, family: &Family, index: i64) -> Option<Target> {
        let count = family.spread.count as i64;
        let inner = |k: i64| {
            let place = family.spread.at(k as usize);
            match family.kind {
                Kind::State => Target::State(place),
                Kind::Parameter => Target::Parameter(place),
                Kind::Definition => Target::Piece(place),
            }
        };
        let beyond = |(first, given): (usize, usize), step: i64| {
            (step < given as i64).then(|| Target::Piece(first + step as usize))
        };
        match &family.repeat.ends {
            _ if (1..=count).contains(&index) => Some(inner(index)),
            Ends::Periodic => Some(inner((index - 1).rem_euclid(count) + 1)),
            Ends::RateOf(position) if self.periodic(position) => Some(inner((index - 1).rem_euclid(count) + 1)),
            _ if index < 1 => beyond(family.before, -index),
            _ => beyond(family.after, index - count - 1),
        }
    }

    fn periodic(&self, name: &str) -> bool {
        let family = self.layout.families.iter().find(|family| family.name == name);
        family.is_some_and(|family| family.repeat.ends == Ends::Periodic)
    }

    /// Pieces that an expression needs, with the positions of their uses. Inside a function, `at` is the call.
    pub fn uses(
        &self,
        expression: &Expression,
        locals: &[Local],
        at: Option<&Range<usize>>,
        out: &mut Vec<(usize, Range<usize>)>,
    ) -> Result<(), Complaint> {
        let composite = expression.composite || !locals.is_empty();
        if composite && !self.spend(expression.terms.len()) {
            return Ok(());
        }
        let values = if composite { self.values(expression, locals) } else { Vec::new() };
        let needed = if composite { Scope::needed(expression, &values) } else { Vec::new() };
        let read = expression.terms.iter().zip(&expression.spans).enumerate();
        for (_, (term, own)) in read.filter(|(t, _)| !composite || (needed[*t] && values[*t].is_none())) {
            let span = at.unwrap_or(own);
            match term {
                Term::Name(name) if local(locals, name).is_none() => {
                    if let Some(Symbol::Definition(piece)) = self.symbols.get(name.as_str()) {
                        out.push((*piece, span.clone()));
                    }
                }
                Term::Element(name, index) => {
                    if let Target::Piece(piece) = self.element(name, values[*index], span, locals)? {
                        out.push((piece, span.clone()));
                    }
                }
                Term::Sum(sum) => {
                    let mut inner = [locals, &[Local::index(&sum.index, 0.0)]].concat();
                    for k in self.steps(sum, &values)? {
                        inner[locals.len()].value = Some(k as f64);
                        self.uses(&sum.term, &inner, at, out)?;
                        if self.exhausted() {
                            break;
                        }
                    }
                }
                Term::Apply(function, arguments) => {
                    let Some(body) = &self.functions[*function] else { continue };
                    let names = self.arguments[*function].iter().zip(arguments);
                    let inner: Vec<Local> =
                        names.map(|(name, a)| Local { name, value: values[*a], id: Id(0) }).collect();
                    self.uses(body, &inner, Some(span), out)?;
                }
                _ => {}
            }
        }
        Ok(())
    }
}

fn value_of(function: &Function, known: &[f64]) -> f64 {
    let mut graph = Graph::default();
    let ids = [0, 1, 2].map(|k| graph.constant(known[k]));
    let id = function.apply(&mut graph, ids);
    graph.value(id).unwrap_or(f64::NAN)
}

/// Error for an element that does not exist.
fn outside(family: &Family, index: i64, span: &Range<usize>, locals: &[Local]) -> Complaint {
    let (name, count) = (family.name, family.spread.count);
    let wanted = element_name(name, index);
    let here: Vec<String> = locals.iter().filter_map(|l| Some(format!("{} = {}", l.name, l.value?))).collect();
    let here = if here.is_empty() { String::new() } else { format!(", at {}", here.join(", ")) };
    let message = format!("there is no `{wanted}`: `{name}` has elements 1 to {count}{here}");
    let (key, given, next) = match index < 1 {
        true => ("before", family.before.1, 1),
        false => ("after", family.after.1, count),
    };
    let hint = match (family.kind, given) {
        (Kind::State, 0) => format!(
            "give its value: `{key} = \"0\"` if it is fixed, `{key} = \"{}\"` at a free end, `periodic = true` in a \
             ring; or leave it out with `if(i …, …, …)`",
            element_name(name, next as i64)
        ),
        (_, 0) => format!("give its value with `{key} = \"…\"`, or `periodic = true` in a ring"),
        (_, given) => format!("`{key}` gives {given}; list one more, nearest first: `{key} = [\"…\", \"…\"]`"),
    };
    Complaint::new(span.clone(), message, hint)
}
