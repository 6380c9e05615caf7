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
mod boundary;
mod callable;
mod check;
mod compile;
mod constant;
mod derive;
mod dimensions;
mod emit;
mod error;
mod events;
mod exprel;
mod family;
pub mod forcing;
mod function;
mod graph;
mod identities;
mod iterated;
pub mod kernels;
mod laws;
mod lexer;
mod limit;
mod lower;
mod mass;
mod nearest;
mod order;
mod parser;
mod precise;
mod rates;
mod run;
mod scope;
mod show;
mod sliding;
mod source;
mod switches;
mod table;
mod tape;
mod tones;
mod totals;
mod unsupported;
mod words;

pub use constant::constant_value;
pub use dimensions::{TAKEN_AS, UnitReport, check_units};
pub use error::{Field, Item, ModelError};
pub(crate) use laws::null_space;
pub use laws::{conserved, conserved_at, in_words, shifts};
pub use lexer::first_order_form;
pub use nearest::{nearest, suggest};
pub use source::{
    Boundary, Constant, Contact, Definition, Ends, Event, Forcing, Function, Mass, ModelSource, Output, Parameter,
    Passing, Repeat, Smoothing, Spread, State, Total,
};
pub use table::{Interpolation, Outside, Table};
pub use totals::Kept;
pub use unsupported::{Unsupported, unsupported};

pub(crate) use emit::{Functions, functions};
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
    /// Names of the events.
    pub events: Vec<String>,
    /// Unit of time, and hence of periods; empty if not known.
    pub time: String,
    /// Name of the time, or of the independent variable of a boundary-value problem.
    pub variable: String,
    /// Remarks on doubtful units.
    pub remarks: Vec<String>,
    /// Parameter whose limit turns a smoothed law into the exact one, and true if that limit is 0 instead of infinity.
    pub sharpness: Option<(usize, bool)>,
}

/// Tapes that are built at their first use.
type Tapes<K> = RwLock<HashMap<K, Arc<Tape>>>;

#[derive(Debug)]
struct Inner {
    compiled: Compiled,
    field: Tape,
    period: Option<Tape>,
    /// Phase of a second forcing, and a field with its period.
    second: Option<(usize, Model)>,
    /// `[n]`, or empty if no state is an angle; see [`VectorField::periods`].
    periods: Vec<f64>,
    /// True for a map.
    map: bool,
    outputs: Tape,
    switches: Switches,
    /// f with given signs of the switches.
    given: Tape,
    sliding: Tapes<u32>,
    linear: Tapes<(Vec<usize>, Branch)>,
    directional: Tapes<(usize, bool, Branch)>,
    switch_derivatives: Tapes<Vec<usize>>,
    condition_tapes: boundary::ConditionTapes,
    event_tapes: events::EventTapes,
    output_derivatives: Tapes<Vec<usize>>,
    period_derivatives: Tapes<()>,
    /// Derivatives of the outputs and of the forcing period along a direction.
    moving: Tapes<Moving>,
}

/// Functions besides f of which derivatives along a direction are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Moving {
    Outputs,
    Period,
}

/// Branch of f.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Branch {
    /// The one in force at the state.
    Actual,
    /// That of given signs of the switches.
    Given,
    /// Motion along the surface of a switch, with given signs of the others.
    Sliding(u32),
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
        let refused = [iterated::refused(&source), boundary::refused(&source), events::refused(&source)].concat();
        if !refused.is_empty() {
            return Err(refused);
        }
        let map = source.map;
        let (source, totals) = if source.totals.is_empty() { (source, Vec::new()) } else { totals::reduced(source)? };
        let second = tones::second(&source)?;
        let (compiled, Named { states, parameters, outputs: output_list }) = compile(&source)?;
        let item_of = |(i, state): (usize, &State)| vec![i; family::count(&state.repeat)];
        let items: Vec<usize> = source.states.iter().enumerate().flat_map(item_of).collect();
        let sharpness = match &source.smoothing {
            None => None,
            Some(own) => Some((limit::sharpness(own, &parameters, &compiled)?, own.to_zero)),
        };
        let variable = source.boundary.as_ref().map_or(check::TIME.to_string(), |own| own.variable.clone());
        let events = source.events.iter().map(|event| event.name.clone()).collect();
        let ModelSource { name, description, source, time, .. } = source;
        let (whirl, remarks) = (compiled.whirl, Vec::new());
        let outputs = output_list;
        let about = About {
            name,
            description,
            source,
            states,
            parameters,
            totals,
            outputs,
            whirl,
            events,
            time,
            variable,
            remarks,
            sharpness,
        };
        let model = Model::assembled(Arc::new(about), compiled, second, map, Contact::Exact);
        let wrong = model.wrong_period().or_else(|| iterated::switched(&model)).or_else(|| boundary::switched(&model));
        match wrong.or_else(|| angles::no_angle(&model, &items)) {
            Some(error) => Err(vec![error]),
            None => Ok(model),
        }
    }

    /// The model with another treatment of the places at which f or its derivatives jump.
    ///
    /// # Errors
    /// A message and a hint, if the model has no such form.
    pub fn with_contact(&self, contact: Contact) -> Result<Model, [String; 2]> {
        let Inner { compiled, second, map, .. } = &*self.inner;
        let built = |compiled| {
            let second = second.clone();
            Model::assembled(self.about.clone(), compiled, second, *map, contact)
        };
        let what = match contact {
            _ if *map => Some("a map"),
            _ if self.conditions() != [0, 0] => Some("a boundary-value problem"),
            _ if second.is_some() => Some("a model with two forcing frequencies"),
            _ => None,
        };
        if let Some(what) = what.filter(|_| contact != Contact::Exact) {
            return Err([format!("`contact` is not supported for {what}"), "remove `contact`".into()]);
        }
        match contact {
            Contact::Exact => Ok(self.clone()),
            Contact::SmoothedOver if self.event_count() > 0 => Err([
                "the states of the model jump at events, which cannot be smoothed over".into(),
                "remove `contact`, or write the contact as a stiff force".into(),
            ]),
            Contact::SmoothedOver => Ok(built(compiled.clone())),
            Contact::Limit => match self.sharpness {
                None => Err([
                    "the model does not say which parameter smooths its law".into(),
                    "add a line such as `smoothing = \"K\"` to the model: the parameter whose growth makes the law sharp"
                        .into(),
                ]),
                Some((parameter, to_zero)) => {
                    limit::limit(compiled, parameter, to_zero).map(built).map_err(|why| self.no_limit(parameter, why))
                }
            },
        }
    }

    fn no_limit(&self, parameter: usize, why: &str) -> [String; 2] {
        let name = &self.parameters[parameter].name;
        [
            format!("the limit of the model in `{name}` is not known: {why}"),
            format!(
                "write the law with tanh({name}*g), log(1 + exp({name}*g))/{name}, sqrt(g^2 + 1/{name}^2) or atan({name}*g)"
            ),
        ]
    }

    fn assembled(
        about: Arc<About>,
        compiled: Compiled,
        second: Option<(usize, Model)>,
        map: bool,
        contact: Contact,
    ) -> Model {
        let field = Tape::new(&compiled.graph, &[&compiled.field]);
        let outputs = Tape::new(&compiled.graph, &[&compiled.outputs]);
        let events: Vec<graph::Id> = compiled.events.iter().map(|event| event.when).collect();
        let switching: &[graph::Id] = if contact == Contact::SmoothedOver { &[] } else { &compiled.field };
        let switches = Switches::new(&compiled.graph, switching, &events);
        let period = compiled.period.map(|period| Tape::new(&compiled.graph, &[&[period]]));
        let (given_graph, given) = switches.given(0);
        let given = Tape::new(&given_graph, &[&given]);
        let periods = match about.states.iter().any(|state| state.period.is_some()) {
            true => about.states.iter().map(|state| state.period.unwrap_or(f64::INFINITY)).collect(),
            false => Vec::new(),
        };
        let inner = Inner {
            compiled,
            field,
            period,
            second,
            periods,
            map,
            outputs,
            switches,
            given,
            sliding: RwLock::default(),
            linear: RwLock::default(),
            directional: RwLock::default(),
            switch_derivatives: RwLock::default(),
            condition_tapes: Default::default(),
            event_tapes: Default::default(),
            output_derivatives: RwLock::default(),
            period_derivatives: RwLock::default(),
            moving: RwLock::default(),
        };
        Model { about, inner: Arc::new(inner) }
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

    /// Copy that also lists numbers computed elsewhere, by name, behind its outputs. It serves to show them; as a vector field it
    /// has no such outputs.
    pub fn listing(&self, names: impl Iterator<Item = String>) -> Model {
        let mut own = self.clone();
        Arc::make_mut(&mut own.about).outputs.extend(names.map(|name| Output::new(&name, "")));
        own
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

    /// Graph and nodes of a branch of f. Given signs are components of the direction with the given number.
    fn branch(&self, branch: Branch, direction: u32) -> (graph::Graph, Vec<graph::Id>) {
        let Compiled { graph, field, .. } = &self.inner.compiled;
        match branch {
            Branch::Actual => (graph.clone(), field.clone()),
            Branch::Given => self.inner.switches.given(direction),
            Branch::Sliding(switch) => self.inner.switches.sliding(direction, switch as usize),
        }
    }

    /// f along the surface of a switch.
    fn sliding_tape(&self, switch: u32) -> Arc<Tape> {
        cached(&self.inner.sliding, switch, || {
            let (graph, field) = self.branch(Branch::Sliding(switch), 0);
            Tape::new(&graph, &[&field])
        })
    }

    /// f, then fx row by row, then fp row by row, as [`VectorField::linearise`] orders them.
    fn linear_tape(&self, free: &[usize], branch: Branch) -> Arc<Tape> {
        cached(&self.inner.linear, (free.to_vec(), branch), || {
            let (mut graph, field) = self.branch(branch, 0);
            let moving = self.leaves(free);
            let columns: Vec<Vec<graph::Id>> = moving.map(|leaf| column(&mut graph, &field, leaf)).collect();
            let (fx, fp) = columns.split_at(self.states.len());
            Tape::new(&graph, &[&field, &rows(fx, field.len()), &rows(fp, field.len())])
        })
    }

    /// The switches and their derivatives, as [`VectorField::linearise_switches`] orders them.
    fn switch_tape(&self, free: &[usize]) -> Arc<Tape> {
        cached(&self.inner.switch_derivatives, free.to_vec(), || {
            let Switches { graph, switches, count, .. } = &self.inner.switches;
            let mut graph = graph.clone();
            let moving = self.leaves(free);
            let columns: Vec<Vec<graph::Id>> = moving.map(|leaf| column(&mut graph, switches, leaf)).collect();
            let in_time = column(&mut graph, switches, Leaf::Time);
            let (hx, hp) = columns.split_at(self.states.len());
            Tape::new(&graph, &[switches, &rows(hx, *count), &rows(hp, *count), &in_time])
        })
    }

    /// The outputs and their derivatives, as [`VectorField::linearise_outputs`] orders them.
    fn output_tape(&self, free: &[usize]) -> Arc<Tape> {
        cached(&self.inner.output_derivatives, free.to_vec(), || {
            let Compiled { graph, outputs, .. } = &self.inner.compiled;
            let mut graph = graph.clone();
            let moving = self.leaves(free);
            let columns: Vec<Vec<graph::Id>> = moving.map(|leaf| column(&mut graph, outputs, leaf)).collect();
            let in_time = column(&mut graph, outputs, Leaf::Time);
            let (gx, gp) = columns.split_at(self.states.len());
            Tape::new(&graph, &[outputs, &rows(gx, outputs.len()), &rows(gp, outputs.len()), &in_time])
        })
    }

    /// Derivatives of the forcing period in all parameters.
    fn period_tape(&self, period: graph::Id) -> Arc<Tape> {
        cached(&self.inner.period_derivatives, (), || {
            let mut graph = self.inner.compiled.graph.clone();
            let each = (0..self.parameters.len()).map(|k| Leaf::Parameter(k as u32));
            let slopes: Vec<graph::Id> = each.flat_map(|leaf| column(&mut graph, &[period], leaf)).collect();
            Tape::new(&graph, &[&slopes])
        })
    }

    /// Derivative of the outputs or of the forcing period along a direction in states and parameters.
    fn moving_tape(&self, what: Moving) -> Arc<Tape> {
        cached(&self.inner.moving, what, || {
            let Compiled { graph, outputs, period, .. } = &self.inner.compiled;
            let roots: Vec<graph::Id> = match what {
                Moving::Outputs => outputs.clone(),
                Moving::Period => period.iter().copied().collect(),
            };
            let (mut graph, states) = (graph.clone(), self.states.len() as u32);
            let derivative = graph.derivative(&roots, |graph, leaf| match leaf {
                Leaf::State(j) => Some(graph.leaf(Leaf::Direction(0, j))),
                Leaf::Parameter(k) => Some(graph.leaf(Leaf::Direction(0, states + k))),
                _ => None,
            });
            Tape::new(&graph, &[&derivative])
        })
    }

    /// The states, then some parameters.
    fn leaves(&self, free: &[usize]) -> impl Iterator<Item = Leaf> {
        let states = (0..self.states.len()).map(|j| Leaf::State(j as u32));
        states.chain(free.iter().map(|&k| Leaf::Parameter(k as u32)))
    }

    /// Multilinear derivative of the given order; without parameter parts if those of all directions are zero.
    fn directional_tape(&self, order: usize, with_parameters: bool, branch: Branch) -> Arc<Tape> {
        cached(&self.inner.directional, (order, with_parameters, branch), || {
            let (mut graph, mut derivative) = self.branch(branch, order as u32);
            let states = self.states.len() as u32;
            for d in 0..order as u32 {
                derivative = graph.derivative(&derivative, |graph, leaf| match leaf {
                    Leaf::State(j) => Some(graph.leaf(Leaf::Direction(d, j))),
                    Leaf::Parameter(k) if with_parameters => Some(graph.leaf(Leaf::Direction(d, states + k))),
                    _ => None,
                });
            }
            Tape::new(&graph, &[&derivative])
        })
    }
}

/// Derivative of the roots in one leaf.
fn column(graph: &mut graph::Graph, roots: &[graph::Id], moving: Leaf) -> Vec<graph::Id> {
    graph.derivative(roots, |graph, leaf| (leaf == moving).then(|| graph.constant(1.0)))
}

/// Entries of columns, row by row.
fn rows(columns: &[Vec<graph::Id>], count: usize) -> Vec<graph::Id> {
    (0..count).flat_map(|i| columns.iter().map(move |column| column[i])).collect()
}

/// The tape of a key, built at its first use.
fn cached<K: std::hash::Hash + Eq>(known: &Tapes<K>, key: K, build: impl FnOnce() -> Tape) -> Arc<Tape> {
    let found = known.read().unwrap_or_else(PoisonError::into_inner).get(&key).cloned();
    found.unwrap_or_else(|| {
        let tape = Arc::new(build());
        known.write().unwrap_or_else(PoisonError::into_inner).entry(key).or_insert(tape).clone()
    })
}

/// Replaces values that are not finite by those of the branch in force: a branch may be undefined beyond its switch,
/// for example (x - d)^1.5 before contact at d.
fn complete(values: &mut [f64], actual: impl FnOnce(&mut [f64])) {
    if values.iter().all(|value| value.is_finite()) {
        return;
    }
    let mut others = vec![0.0; values.len()];
    actual(&mut others);
    values.iter_mut().zip(others).filter(|(value, _)| !value.is_finite()).for_each(|(value, own)| *value = own);
}

impl VectorField for Model {
    fn dim(&self) -> usize {
        self.states.len()
    }

    fn parameter_count(&self) -> usize {
        self.parameters.len()
    }

    fn forced(&self) -> bool {
        self.inner.period.is_some() || self.inner.map
    }

    fn iterated(&self) -> bool {
        self.inner.map
    }

    fn time_unit(&self, parameters: &[f64]) -> f64 {
        let mut unit = [1.0];
        if let Some(period) = &self.inner.period {
            let at =
                Batch { lanes: 1, states: &[], parameters: Parameters::Shared(parameters), times: &[], signs: &[] };
            period.run(at, &[], &mut [&mut unit]);
        }
        unit[0]
    }

    fn time_unit_slopes(&self, parameters: &[f64]) -> Vec<f64> {
        let mut slopes = vec![0.0; parameters.len()];
        if let Some(period) = self.inner.compiled.period {
            let at =
                Batch { lanes: 1, states: &[], parameters: Parameters::Shared(parameters), times: &[], signs: &[] };
            self.period_tape(period).run(at, &[], &mut [&mut slopes]);
        }
        slopes
    }

    fn second_phase(&self) -> Option<usize> {
        Some(self.inner.second.as_ref()?.0)
    }

    fn second_turns(&self, parameters: &[f64]) -> (f64, Vec<f64>) {
        let Some((_, second)) = &self.inner.second else { return (0.0, vec![0.0; parameters.len()]) };
        let (own, other) = (self.time_unit(parameters), second.time_unit(parameters));
        let slopes = self.time_unit_slopes(parameters).into_iter().zip(second.time_unit_slopes(parameters));
        (own / other, slopes.map(|(a, b)| (a - own / other * b) / other).collect())
    }

    fn periods(&self) -> &[f64] {
        &self.inner.periods
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        if at.signs.is_empty() {
            return self.inner.field.run(at, &[], &mut [f]);
        }
        if sliding::occurs(&at) {
            return sliding::each(at, &[], &mut [f], |at, _, along, to| match along {
                None => self.evaluate(at, to[0]),
                Some(switch) => self.sliding_tape(switch).run(at, &[at.signs], to),
            });
        }
        self.inner.given.run(at, &[at.signs], &mut [f]);
        complete(f, |actual| self.inner.field.run(at, &[], &mut [actual]));
    }

    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        if at.signs.is_empty() {
            return self.linear_tape(free, Branch::Actual).run(at, &[], &mut [f, fx, fp]);
        }
        if sliding::occurs(&at) {
            return sliding::each(at, &[], &mut [f, fx, fp], |at, _, along, to| match (along, to) {
                (None, [f, fx, fp]) => self.linearise(at, free, f, fx, fp),
                (Some(switch), to) => self.linear_tape(free, Branch::Sliding(switch)).run(at, &[at.signs], to),
                _ => {}
            });
        }
        self.linear_tape(free, Branch::Given).run(at, &[at.signs], &mut [&mut *f, &mut *fx, &mut *fp]);
        let sizes = [f.len(), fx.len(), fp.len()];
        let actual = || {
            let [mut f, mut fx, mut fp] = sizes.map(|size| vec![0.0; size]);
            self.linear_tape(free, Branch::Actual).run(at, &[], &mut [&mut f, &mut fx, &mut fp]);
            [f, fx, fp]
        };
        for (k, values) in [f, fx, fp].into_iter().enumerate() {
            complete(values, |to| to.copy_from_slice(&actual()[k]));
        }
    }

    fn directional(&self, at: Batch, directions: &[&[f64]], out: &mut [f64]) {
        let states = self.dim() * at.lanes;
        let with_parameters = directions.iter().any(|d| d[states..].iter().any(|&x| x != 0.0));
        let tape = |branch: Branch| self.directional_tape(directions.len(), with_parameters, branch);
        if at.signs.is_empty() {
            return tape(Branch::Actual).run(at, directions, &mut [out]);
        }
        if sliding::occurs(&at) {
            return sliding::each(at, directions, &mut [out], |at, directions, along, to| match along {
                None => self.directional(at, directions, to[0]),
                Some(switch) => {
                    let with_signs: Vec<&[f64]> = directions.iter().copied().chain([at.signs]).collect();
                    tape(Branch::Sliding(switch)).run(at, &with_signs, to);
                }
            });
        }
        let with_signs: Vec<&[f64]> = directions.iter().copied().chain([at.signs]).collect();
        tape(Branch::Given).run(at, &with_signs, &mut [out]);
        complete(out, |to| tape(Branch::Actual).run(at, directions, &mut [to]));
    }

    fn output_count(&self) -> usize {
        self.outputs.len()
    }

    fn outputs(&self, at: Batch, out: &mut [f64]) {
        self.inner.outputs.run(at, &[], &mut [out]);
    }

    fn linearise_outputs(&self, at: Batch, free: &[usize], mut to: [&mut [f64]; 4]) -> bool {
        self.output_tape(free).run(at, &[], &mut to);
        true
    }

    fn outputs_along(&self, at: Batch, direction: &[f64], out: &mut [f64]) {
        self.moving_tape(Moving::Outputs).run(at, &[direction], &mut [out]);
    }

    fn time_unit_along(&self, parameters: &[f64], change: &[f64]) -> f64 {
        if self.inner.period.is_none() {
            return 0.0;
        }
        // The period does not depend on the states.
        let direction = [&vec![0.0; self.dim()][..], change].concat();
        let states = vec![0.0; self.dim()];
        let at =
            Batch { lanes: 1, states: &states, parameters: Parameters::Shared(parameters), times: &[0.0], signs: &[] };
        let mut slope = [0.0];
        self.moving_tape(Moving::Period).run(at, &[&direction], &mut [&mut slope]);
        slope[0]
    }

    fn switch_count(&self) -> usize {
        self.inner.switches.count
    }

    fn switches(&self, at: Batch, out: &mut [f64]) {
        match &self.inner.switches.given_values {
            Some(given) if !at.signs.is_empty() => given.run(at, &[at.signs], &mut [out]),
            _ => self.inner.switches.values.run(at, &[], &mut [out]),
        }
    }

    fn evaluate_precisely(&self, states: &[[f64; 2]], parameters: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
        let Compiled { graph, field, .. } = &self.inner.compiled;
        precise::evaluate(graph, field, states, parameters)
    }

    fn switch_name(&self, switch: usize) -> String {
        let first = self.inner.switches.count - self.inner.compiled.events.len();
        if let Some(name) = switch.checked_sub(first).and_then(|event| self.events.get(event)) {
            return name.clone();
        }
        let Switches { graph, switches, .. } = &self.inner.switches;
        let states: Vec<&str> = self.states.iter().map(|own| own.name.as_str()).collect();
        let parameters: Vec<&str> = self.parameters.iter().map(|own| own.name.as_str()).collect();
        let text = switches.get(switch).and_then(|id| show::text(graph, *id, &states, &parameters));
        text.unwrap_or_else(|| format!("switch {}", switch + 1))
    }

    fn event_count(&self) -> usize {
        self.inner.compiled.events.len()
    }

    fn event_direction(&self, event: usize) -> f64 {
        self.inner.compiled.events.get(event).map_or(0.0, |own| own.direction)
    }

    fn reset(&self, event: usize, at: Batch, free: &[usize], to: [&mut [f64]; 4]) {
        self.resets(event, at, free, to);
    }

    fn forbidden(&self, at: Batch) -> Option<usize> {
        self.first_forbidden(at)
    }

    fn slopes_in_time(&self, at: Batch, out: &mut [f64]) {
        self.in_time(at, out);
    }

    fn conditions(&self) -> [usize; 2] {
        let own = &self.inner.compiled.conditions;
        [own.ends.len(), own.integrals.len()]
    }

    fn determined(&self) -> &[usize] {
        &self.inner.compiled.conditions.solve
    }

    fn boundary(&self, ends: [&[f64]; 2], parameters: &[f64], free: &[usize], to: [&mut [f64]; 4]) {
        let parameters = Parameters::Shared(parameters);
        self.at_ends(ends, Batch { lanes: 1, states: &[], parameters, times: &[], signs: &[] }, free, to);
    }

    fn integrands(&self, at: Batch, free: &[usize], to: [&mut [f64]; 3]) {
        self.integrated(at, free, to);
    }

    fn linearise_switches(&self, at: Batch, free: &[usize], mut to: [&mut [f64]; 4]) {
        self.switch_tape(free).run(at, &[], &mut to);
    }
}
