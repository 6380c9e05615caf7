//! Models: source text, compilation, evaluation and differentiation.
//!
//! **Idea.** A model is a set of expressions. They become a graph in which equal subexpressions are one node (`graph`),
//! are differentiated on that graph to any order (`derive`), and become tapes (`tape`) that run over all lanes of a
//! batch (`run`) about as fast as hand-written code, without a compiler.
//!
//! Text passes through `lexer` → `parser` → `compile`: names are laid out (`family`) and checked (`check`, `words`),
//! definitions ordered (`order`), expressions read for a given index (`scope`) and turned into nodes (`lower`). Units
//! are checked separately (`dimensions`). All errors come back as a list of [`ModelError`] with positions.

mod angles;
mod callable;
mod check;
mod compile;
mod constant;
mod derive;
mod dimensions;
mod error;
mod exprel;
mod family;
pub mod forcing;
mod function;
mod graph;
mod identities;
pub mod kernels;
mod laws;
mod lexer;
mod lower;
mod mass;
mod nearest;
mod order;
mod parser;
mod precise;
mod rates;
mod run;
mod scope;
mod source;
mod switches;
mod table;
mod tape;
mod totals;
mod unsupported;
mod words;

pub use constant::constant_value;
pub use dimensions::{TAKEN_AS, UnitReport, check_units};
pub use error::{Field, Item, ModelError};
pub(crate) use laws::null_space;
pub use laws::{conserved, conserved_at, in_words, shifts};
pub use nearest::{nearest, suggest};
pub use source::{
    Constant, Definition, Ends, Forcing, Function, Mass, ModelSource, Output, Parameter, Repeat, State, Total,
};
pub use table::{Interpolation, Outside, Table};
pub use totals::Kept;
pub use unsupported::{Unsupported, unsupported};

pub(crate) use source::element_of;

use crate::contract::{Batch, Parameters, VectorField};
use compile::{Compiled, Named, compile};
use graph::Leaf;
use std::collections::HashMap;
use std::ops::Deref;
use std::sync::{Arc, PoisonError, RwLock};
use switches::Switches;
use tape::Tape;

/// Model: a vector field with names, units and outputs. Clones share everything.
///
/// ```
/// use foldline::model::{Definition, Model, ModelSource, Parameter, State};
/// let source = ModelSource {
///     name: "van der Pol".into(),
///     parameters: vec![Parameter::new("mu", 1.5)],
///     states: vec![State::new("x"), State::new("y")],
///     equations: vec![Definition::new("x", "y"), Definition::new("y", "mu*(1 - x^2)*y - x")],
///     ..ModelSource::default()
/// };
/// let model = Model::compile(source)?;
/// assert_eq!(model.parameters[0].value, 1.5);
/// # Ok::<(), Vec<foldline::model::ModelError>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Model {
    about: Arc<About>,
    inner: Arc<Inner>,
}

/// Description of a model: names, units and texts; accessed through [`Model`].
#[derive(Clone, Debug)]
pub struct About {
    /// Name.
    pub name: String,
    /// Description.
    pub description: String,
    /// Origin, such as a publication.
    pub source: String,
    /// States, numbered as in the vector field.
    pub states: Vec<State>,
    /// Parameters, numbered as in the vector field.
    pub parameters: Vec<Parameter>,
    /// Conserved totals, which are parameters.
    pub totals: Vec<Kept>,
    /// Outputs, numbered as in the vector field.
    pub outputs: Vec<Output>,
    /// The two states u, v that form the complex signal u + j v.
    pub whirl: Option<[usize; 2]>,
    /// Unit of time, and hence of periods; empty if not known.
    pub time: String,
    /// Remarks on doubtful units.
    pub remarks: Vec<String>,
}

#[derive(Debug)]
struct Inner {
    compiled: Compiled,
    field: Tape,
    period: Option<Tape>,
    /// `[n]`, or empty if no state is an angle; see [`VectorField::periods`].
    periods: Vec<f64>,
    outputs: Tape,
    switches: Switches,
    linear: RwLock<HashMap<Vec<usize>, Arc<Tape>>>,
    directional: RwLock<HashMap<(usize, bool), Arc<Tape>>>,
}

impl Deref for Model {
    type Target = About;

    fn deref(&self) -> &About {
        &self.about
    }
}

impl Model {
    /// Compiles `source`, or returns all its errors.
    pub fn compile(source: ModelSource) -> Result<Model, Vec<ModelError>> {
        let (source, totals) = if source.totals.is_empty() { (source, Vec::new()) } else { totals::reduced(source)? };
        let (compiled, Named { states, parameters, outputs: output_list }) = compile(&source)?;
        let item_of = |(i, state): (usize, &State)| vec![i; family::count(&state.repeat)];
        let items: Vec<usize> = source.states.iter().enumerate().flat_map(item_of).collect();
        let field = Tape::new(&compiled.graph, &[&compiled.field]);
        let outputs = Tape::new(&compiled.graph, &[&compiled.outputs]);
        let switches = Switches::new(&compiled.graph, &compiled.field);
        let period = compiled.period.map(|period| Tape::new(&compiled.graph, &[&[period]]));
        let ModelSource { name, description, source, time, .. } = source;
        let (whirl, remarks) = (compiled.whirl, Vec::new());
        let outputs_of = output_list;
        let about =
            About { name, description, source, states, parameters, totals, outputs: outputs_of, whirl, time, remarks };
        let (linear, directional) = (RwLock::default(), RwLock::default());
        let periods = match about.states.iter().any(|state| state.period.is_some()) {
            true => about.states.iter().map(|state| state.period.unwrap_or(f64::INFINITY)).collect(),
            false => Vec::new(),
        };
        let inner = Inner { compiled, field, period, periods, outputs, switches, linear, directional };
        let model = Model { about: Arc::new(about), inner: Arc::new(inner) };
        match model.wrong_period().or_else(|| angles::no_angle(&model, &items)) {
            Some(error) => Err(vec![error]),
            None => Ok(model),
        }
    }

    /// Error if the forcing is not periodic with its stated period.
    fn wrong_period(&self) -> Option<ModelError> {
        let names: Vec<String> =
            self.states.iter().map(|s| &s.name).chain(self.outputs.iter().map(|o| &o.name)).cloned().collect();
        let [message, hint] = forcing::unrepeated(self, &names, &self.ranges(), &self.defaults())?;
        let (item, field) = (Item::Forcing, Field::Expression);
        Some(ModelError { item, field, name: String::new(), span: None, message, hint })
    }

    /// Sets the unit of time and the remarks.
    pub fn with_time(mut self, time: &str, remarks: Vec<String>) -> Model {
        let about = Arc::make_mut(&mut self.about);
        (about.time, about.remarks) = (time.to_string(), remarks);
        self
    }

    /// Copy with other unit labels, by name; the name `period` sets the unit of time. Values are unchanged.
    pub(crate) fn labelled(&self, units: &[(String, String)]) -> Model {
        let mut model = self.clone();
        let about = Arc::make_mut(&mut model.about);
        for (name, unit) in units {
            about.parameters.iter_mut().filter(|own| own.name == *name).for_each(|own| own.unit = unit.clone());
            about.states.iter_mut().filter(|own| own.name == *name).for_each(|own| own.unit = unit.clone());
            about.outputs.iter_mut().filter(|own| own.name == *name).for_each(|own| own.unit = unit.clone());
            if name == "period" {
                about.time = unit.clone();
            }
        }
        model
    }

    /// Index of the parameter with the given name.
    pub fn parameter_index(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|p| p.name == name)
    }

    /// Index of the state with the given name.
    pub fn state_index(&self, name: &str) -> Option<usize> {
        self.states.iter().position(|s| s.name == name)
    }

    /// Index and period of each state that is an angle.
    pub fn angles(&self) -> impl Iterator<Item = (usize, f64)> {
        self.states.iter().enumerate().filter_map(|(i, state)| Some((i, state.period?)))
    }

    /// Index of the output with the given name.
    pub fn output_index(&self, name: &str) -> Option<usize> {
        self.outputs.iter().position(|o| o.name == name)
    }

    /// Unit of a state or output, states first; empty if the index is out of range.
    pub fn channel_unit(&self, index: usize) -> &str {
        match index.checked_sub(self.states.len()) {
            None => self.states.get(index).map_or("", |own| &own.unit),
            Some(output) => self.outputs.get(output).map_or("", |own| &own.unit),
        }
    }

    /// Default values of all parameters.
    pub fn defaults(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.value).collect()
    }

    /// Characteristic sizes of the states as stated by the model, else 1; [`crate::explore::System`] refines them.
    pub fn scales(&self) -> Vec<f64> {
        self.states.iter().map(|s| s.stated_scale().unwrap_or(1.0)).collect()
    }

    /// Ranges from which initial values of the states are sampled, based on [`Model::scales`].
    pub fn ranges(&self) -> Vec<[f64; 2]> {
        self.states.iter().zip(self.scales()).map(|(state, scale)| state.range_at(scale)).collect()
    }

    /// f, then fx row by row, then fp row by row, as [`VectorField::linearise`] orders them.
    fn linear_tape(&self, free: &[usize]) -> Arc<Tape> {
        let cached = self.inner.linear.read().unwrap_or_else(PoisonError::into_inner).get(free).cloned();
        cached.unwrap_or_else(|| {
            let Compiled { graph, field, .. } = &self.inner.compiled;
            let mut graph = graph.clone();
            let states = (0..self.states.len()).map(|j| Leaf::State(j as u32));
            let parameters = free.iter().map(|&k| Leaf::Parameter(k as u32));
            let mut column =
                |moving: Leaf| graph.derivative(field, |graph, leaf| (leaf == moving).then(|| graph.constant(1.0)));
            let fx: Vec<Vec<graph::Id>> = states.map(&mut column).collect();
            let fp: Vec<Vec<graph::Id>> = parameters.map(&mut column).collect();
            let rows = |columns: &[Vec<graph::Id>]| -> Vec<graph::Id> {
                (0..field.len()).flat_map(|i| columns.iter().map(move |column| column[i])).collect()
            };
            let tape = Arc::new(Tape::new(&graph, &[field, &rows(&fx), &rows(&fp)]));
            let mut cache = self.inner.linear.write().unwrap_or_else(PoisonError::into_inner);
            cache.entry(free.to_vec()).or_insert(tape).clone()
        })
    }

    /// Multilinear derivative of the given order; without parameter parts if those of all directions are zero.
    fn directional_tape(&self, order: usize, with_parameters: bool) -> Arc<Tape> {
        let key = (order, with_parameters);
        let cached = self.inner.directional.read().unwrap_or_else(PoisonError::into_inner).get(&key).cloned();
        cached.unwrap_or_else(|| {
            let Compiled { graph, field, .. } = &self.inner.compiled;
            let mut graph = graph.clone();
            let states = self.states.len() as u32;
            let mut derivative = field.clone();
            for d in 0..order as u32 {
                derivative = graph.derivative(&derivative, |graph, leaf| match leaf {
                    Leaf::State(j) => Some(graph.leaf(Leaf::Direction(d, j))),
                    Leaf::Parameter(k) if with_parameters => Some(graph.leaf(Leaf::Direction(d, states + k))),
                    _ => None,
                });
            }
            let tape = Arc::new(Tape::new(&graph, &[&derivative]));
            let mut cache = self.inner.directional.write().unwrap_or_else(PoisonError::into_inner);
            cache.entry(key).or_insert(tape).clone()
        })
    }
}

impl VectorField for Model {
    fn dim(&self) -> usize {
        self.states.len()
    }

    fn parameter_count(&self) -> usize {
        self.parameters.len()
    }

    fn forced(&self) -> bool {
        self.inner.period.is_some()
    }

    fn time_unit(&self, parameters: &[f64]) -> f64 {
        let mut unit = [1.0];
        if let Some(period) = &self.inner.period {
            let at = Batch { lanes: 1, states: &[], parameters: Parameters::Shared(parameters), times: &[] };
            period.run(at, &[], &mut [&mut unit]);
        }
        unit[0]
    }

    fn periods(&self) -> &[f64] {
        &self.inner.periods
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        self.inner.field.run(at, &[], &mut [f]);
    }

    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        self.linear_tape(free).run(at, &[], &mut [f, fx, fp]);
    }

    fn directional(&self, at: Batch, directions: &[&[f64]], out: &mut [f64]) {
        let states = self.dim() * at.lanes;
        let with_parameters = directions.iter().any(|d| d[states..].iter().any(|&x| x != 0.0));
        self.directional_tape(directions.len(), with_parameters).run(at, directions, &mut [out]);
    }

    fn output_count(&self) -> usize {
        self.outputs.len()
    }

    fn outputs(&self, at: Batch, out: &mut [f64]) {
        self.inner.outputs.run(at, &[], &mut [out]);
    }
    fn switch_count(&self) -> usize {
        self.inner.switches.count
    }

    fn switches(&self, at: Batch, out: &mut [f64]) {
        self.inner.switches.values.run(at, &[], &mut [out]);
    }

    fn evaluate_precisely(&self, states: &[[f64; 2]], parameters: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
        let Compiled { graph, field, .. } = &self.inner.compiled;
        precise::evaluate(graph, field, states, parameters)
    }

    fn evaluate_switched(&self, at: Batch, signs: &[f64], f: &mut [f64]) {
        self.inner.switches.given.run(at, &[signs], &mut [f]);
        // A branch may be undefined beyond its switch, for example (x - d)^1.5 before contact at d.
        if f.iter().any(|value| !value.is_finite()) {
            let mut actual = vec![0.0; f.len()];
            self.evaluate(at, &mut actual);
            f.iter_mut().zip(actual).filter(|(value, _)| !value.is_finite()).for_each(|(value, own)| *value = own);
        }
    }
}
