//! Names of a model and the positions of their elements.
//!
//! **Idea.** A repeated state, parameter, definition or output stands for elements named x[1], x[2], … Consecutive
//! families of states with equal counts are interleaved: x[1], v[1], x[2], v[2], …, which keeps the entries of the
//! Jacobian near its diagonal. Each element of a definition is one *piece*; so is each value beyond an end.

use super::error::{Field, Item};
use super::source::{Ends, ModelSource, Output, Parameter, Repeat, State, element_name};
use std::collections::HashMap;

/// Positions of the elements of a name.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    pub first: usize,
    pub stride: usize,
    pub count: usize,
}

impl Spread {
    /// Position of element k, counted from 1.
    pub fn at(&self, k: usize) -> usize {
        self.first + (k - 1) * self.stride
    }
}

/// Kind of the elements of a family.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    State,
    Parameter,
    Definition,
}

/// Repeated name.
#[derive(Debug)]
pub(super) struct Family<'a> {
    pub name: &'a str,
    pub kind: Kind,
    pub item: Item,
    pub spread: Spread,
    pub repeat: &'a Repeat,
    /// First piece of the values before the first element, and their number.
    pub before: (usize, usize),
    /// First piece of the values after the last element, and their number.
    pub after: (usize, usize),
}

/// Node created once: an element of a definition, or a value beyond an end.
#[derive(Debug)]
pub(super) struct Piece {
    pub item: Item,
    pub field: Field,
    /// Index, for an element of a repeated definition.
    pub element: Option<usize>,
    /// Piece of which this one is the time derivative.
    pub rate_of: Option<usize>,
}

/// Layout of the names of a model.
#[derive(Debug, Default)]
pub(super) struct Layout<'a> {
    pub families: Vec<Family<'a>>,
    pub pieces: Vec<Piece>,
    /// Spreads of states, parameters, definitions and outputs, in source order.
    pub states: Vec<Spread>,
    pub parameters: Vec<Spread>,
    pub definitions: Vec<Spread>,
    pub outputs: Vec<Spread>,
}

/// Number of elements; 1 without repetition.
pub(super) fn count(repeat: &Option<Repeat>) -> usize {
    repeat.as_ref().map_or(1, |repeat| repeat.count)
}

impl<'a> Layout<'a> {
    /// Lays out a source whose counts have been checked.
    pub fn new(source: &'a ModelSource) -> Layout<'a> {
        let mut layout = Layout {
            states: interleaved(&source.states.iter().map(|s| s.repeat.as_ref().map(|r| r.count)).collect::<Vec<_>>()),
            parameters: consecutive(source.parameters.iter().map(|p| count(&p.repeat))),
            definitions: consecutive(source.definitions.iter().map(|d| count(&d.repeat))),
            outputs: consecutive(source.outputs.iter().map(|o| count(&o.repeat))),
            ..Layout::default()
        };
        for (i, definition) in source.definitions.iter().enumerate() {
            for k in 1..=layout.definitions[i].count {
                let element = definition.repeat.as_ref().map(|_| k);
                let (item, field) = (Item::Definition(i), Field::Expression);
                layout.pieces.push(Piece { item, field, element, rate_of: None });
            }
        }
        let states = source
            .states
            .iter()
            .enumerate()
            .map(|(i, s)| (s.name.as_str(), Kind::State, Item::State(i), layout.states[i], &s.repeat));
        let parameters = source
            .parameters
            .iter()
            .enumerate()
            .map(|(i, p)| (p.name.as_str(), Kind::Parameter, Item::Parameter(i), layout.parameters[i], &p.repeat));
        let definitions =
            source.definitions.iter().enumerate().map(|(i, d)| {
                (d.name.as_str(), Kind::Definition, Item::Definition(i), layout.definitions[i], &d.repeat)
            });
        let all: Vec<_> = states.chain(parameters).chain(definitions).collect();
        for (name, kind, item, spread, repeat) in all {
            let Some(repeat) = repeat else { continue };
            let mut family = Family { name, kind, item, spread, repeat, before: (0, 0), after: (0, 0) };
            if let Ends::Given { before, after } = &repeat.ends {
                family.before = layout.beyond(item, before.len(), Field::Before);
                family.after = layout.beyond(item, after.len(), Field::After);
            }
            layout.families.push(family);
        }
        layout.rates();
        layout
    }

    fn beyond(&mut self, item: Item, count: usize, field: fn(usize) -> Field) -> (usize, usize) {
        let first = self.pieces.len();
        let piece = |k| Piece { item, field: field(k), element: None, rate_of: None };
        self.pieces.extend((0..count).map(piece));
        (first, count)
    }

    /// Adds pieces for the ends of families that are rates of others.
    fn rates(&mut self) {
        for f in 0..self.families.len() {
            let Ends::RateOf(position) = &self.families[f].repeat.ends else { continue };
            let Some(own) = self.families.iter().find(|family| family.name == position) else { continue };
            let (before, after, item) = (own.before, own.after, self.families[f].item);
            let mut rates = |(first, count): (usize, usize), field: fn(usize) -> Field| {
                let start = self.pieces.len();
                let piece = |k| Piece { item, field: field(k), element: None, rate_of: Some(first + k) };
                self.pieces.extend((0..count).map(piece));
                (start, count)
            };
            let (before, after) = (rates(before, Field::Before), rates(after, Field::After));
            (self.families[f].before, self.families[f].after) = (before, after);
        }
    }

    /// Individual states, with repetition expanded.
    pub fn expanded_states(&self, source: &[State]) -> Vec<State> {
        let total = self.states.iter().map(|spread| spread.count).sum();
        let mut all = vec![State::new(""); total];
        for (state, spread) in source.iter().zip(&self.states) {
            for k in 1..=spread.count {
                let name = own_name(&state.name, &state.repeat, k);
                all[spread.at(k)] = State { name, repeat: None, ..state.clone() };
            }
        }
        all
    }

    /// Individual parameters, with repetition expanded.
    pub fn expanded_parameters(&self, source: &[Parameter]) -> Vec<Parameter> {
        let element = |parameter: &Parameter, k: usize| {
            let name = own_name(&parameter.name, &parameter.repeat, k);
            let value = parameter.values.get(k - 1).copied().unwrap_or(parameter.value);
            Parameter { name, value, repeat: None, values: Vec::new(), ..parameter.clone() }
        };
        let spreads = source.iter().zip(&self.parameters);
        spreads.flat_map(|(own, spread)| (1..=spread.count).map(move |k| element(own, k))).collect()
    }

    /// Individual outputs, with repetition expanded.
    pub fn expanded_outputs(&self, source: &[Output]) -> Vec<Output> {
        let element = |output: &Output, k: usize| {
            let name = own_name(&output.name, &output.repeat, k);
            Output { name, repeat: None, ..output.clone() }
        };
        let spreads = source.iter().zip(&self.outputs);
        spreads.flat_map(|(own, spread)| (1..=spread.count).map(move |k| element(own, k))).collect()
    }

    /// Name of a piece, for messages.
    pub fn piece_name(&self, source: &ModelSource, piece: usize) -> String {
        let Piece { item, field, element, .. } = &self.pieces[piece];
        let (name, repeat) = match *item {
            Item::Definition(i) => (&source.definitions[i].name, &source.definitions[i].repeat),
            Item::State(i) => (&source.states[i].name, &source.states[i].repeat),
            Item::Parameter(i) => (&source.parameters[i].name, &source.parameters[i].repeat),
            _ => return String::new(),
        };
        match (field, element) {
            (Field::Before(k), _) => element_name(name, -(*k as i64)),
            (Field::After(k), _) => element_name(name, (count(repeat) + 1 + k) as i64),
            (_, Some(k)) => element_name(name, *k as i64),
            _ => name.clone(),
        }
    }

    /// Position of the velocity of each state, if it has one: the state `x'` for `x`.
    pub fn velocities(states: &[State]) -> Vec<Option<usize>> {
        let place: HashMap<&str, usize> = states.iter().enumerate().map(|(i, s)| (s.name.as_str(), i)).collect();
        let rate = |name: &str| match name.split_once('[') {
            Some((base, index)) => format!("{base}'[{index}"),
            None => format!("{name}'"),
        };
        states.iter().map(|state| place.get(rate(&state.name).as_str()).copied()).collect()
    }
}

fn own_name(name: &str, repeat: &Option<Repeat>, k: usize) -> String {
    repeat.as_ref().map_or_else(|| name.to_string(), |_| element_name(name, k as i64))
}

fn consecutive(counts: impl Iterator<Item = usize>) -> Vec<Spread> {
    let mut first = 0;
    let mut next = |count: usize| {
        let spread = Spread { first, stride: 1, count };
        first += count;
        spread
    };
    counts.map(&mut next).collect()
}

/// Spreads in which runs of equal counts are interleaved.
fn interleaved(counts: &[Option<usize>]) -> Vec<Spread> {
    let mut first = 0;
    let mut spreads = Vec::with_capacity(counts.len());
    for run in counts.chunk_by(|a, b| a.is_some() && a == b) {
        let count = run[0].unwrap_or(1);
        spreads.extend((0..run.len()).map(|own| Spread { first: first + own, stride: run.len(), count }));
        first += run.len() * count;
    }
    spreads
}
