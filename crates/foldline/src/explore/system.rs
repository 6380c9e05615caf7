//! A vector field with the data needed to explore it.

use super::plan::{BranchPlan, ExplorePlan, Holds, Plan};
use super::sizes;
use crate::attractors::Limits;
use crate::contract::VectorField;
use crate::diagram::{Diagram, Family, Measure, Shown, Solution, Symmetry};
use crate::model::Model;
use crate::model::Parameter;
use crate::model::forcing::unrepeated;
use crate::special::harmonics::Signal;
use crate::special::quantity::Quantity;
use crate::special::unfolded::Unfolded;

/// A vector field with its scales, and the box that is searched for attractors.
#[derive(Clone)]
pub struct System<'a> {
    /// The vector field.
    pub field: &'a dyn VectorField,
    /// `[n]` name of each state, for messages.
    pub state_names: Vec<String>,
    /// `[n]` characteristic size of each state.
    pub scales: Vec<f64>,
    /// `[k]` characteristic size of each parameter, relative to which arclength counts changes of the parameter.
    pub parameter_scales: Vec<f64>,
    /// `[n]` box from which initial states are sampled.
    pub ranges: Vec<[f64; 2]>,
    /// Limits on trajectories in the search for first solutions.
    pub limits: Limits,
    /// The two states that form the complex whirl signal, if the model has one.
    pub whirl: Option<[usize; 2]>,
    /// Symmetries of the field that change signs only, the identity first; for a forced field also those under which it
    /// is equivariant half a forcing period later. Solutions that they map onto each other are one.
    pub symmetries: Vec<Symmetry>,
    /// Symmetries that permute states.
    pub exchanges: Vec<Symmetry>,
    /// Quantities held along the branch that is followed, with the further free parameters.
    pub(super) holds: Option<&'a Holds>,
    /// Names of states and outputs, for messages.
    pub(super) channel_names: Vec<String>,
    /// The field with its unfolding amplitude, for curves of branch points of cycles.
    pub(super) unfolded: Option<&'a Unfolded<'a>>,
    /// For a forced field and each of these: true if it is equivariant at the same time, and half a period later.
    pub(super) mirrors: Vec<[bool; 2]>,
}

impl<'a> System<'a> {
    /// Returns the measure by which solutions of this system are compared.
    pub fn measure(&self) -> Measure<'_> {
        Measure { scales: &self.scales, periods: self.field.periods() }
    }

    /// Returns a system whose scales are all 1 and whose initial states come from [-2, 2]ⁿ.
    pub fn new(field: &'a dyn VectorField) -> System<'a> {
        let n = field.dim();
        System {
            field,
            state_names: (1..=n).map(|i| format!("state {i}")).collect(),
            scales: vec![1.0; n],
            parameter_scales: vec![1.0; field.parameter_count()],
            ranges: vec![[-2.0, 2.0]; n],
            limits: Limits::default(),
            whirl: None,
            symmetries: vec![Symmetry::identity()],
            exchanges: Vec::new(),
            holds: None,
            channel_names: Vec::new(),
            unfolded: None,
            mirrors: Vec::new(),
        }
    }

    /// Returns the system of a model at given parameters, with the scales and ranges of its states and the symmetries
    /// that it has there.
    pub fn of(model: &'a Model, parameters: &[f64]) -> System<'a> {
        let mut system = System::measured(model, &Plan::empty(1.0, 1), &[sizes::origin(model, parameters)]);
        system.find_symmetries(parameters);
        system
    }

    /// Returns the system without symmetries; states are scaled by the magnitudes met from these places.
    fn measured(model: &'a Model, plan: &Plan, places: &[sizes::Place]) -> System<'a> {
        let scales = sizes::of_states(model, places);
        let channels = model.states.iter().map(|s| &s.name).chain(model.outputs.iter().map(|o| &o.name));
        System {
            state_names: model.states.iter().map(|s| s.name.clone()).collect(),
            parameter_scales: System::sized(model, plan),
            ranges: model.states.iter().zip(&scales).map(|(state, scale)| state.range_at(*scale)).collect(),
            scales,
            limits: plan.limits,
            whirl: model.whirl,
            channel_names: channels.cloned().collect(),
            ..System::new(model)
        }
    }

    /// Returns the system of a plan. A symmetry counts only if it holds wherever the plan goes: at every seed, and with
    /// the parameters of branches, curves and homotopies moved away from values, such as zero, at which a model may be
    /// more symmetric than elsewhere.
    pub fn of_plan(model: &'a Model, plan: &Plan) -> System<'a> {
        let mut places: Vec<Vec<f64>> = plan.seeds.iter().map(|seed| seed.parameters.clone()).collect();
        places.extend(plan.seeds.iter().map(|seed| away(plan, &seed.parameters)));
        places.extend(plan.surveys.iter().map(|survey| survey.parameters.clone()));
        places.extend(plan.explorations.iter().map(inside));
        let measured = System::measured(model, plan, &sizes::places(model, plan));
        let mut systems = places.iter().map(|place| {
            let mut there = measured.clone();
            there.find_symmetries(place);
            there
        });
        let Some(mut common) = systems.next() else { return measured };
        for other in systems {
            common.exchanges.retain(|own| other.exchanges.contains(own));
            let kept: Vec<bool> = common.symmetries.iter().map(|own| other.symmetries.contains(own)).collect();
            common.symmetries.retain(|own| other.symmetries.contains(own));
            let mut kept = kept.into_iter();
            common.mirrors.retain(|_| kept.next().unwrap_or(true));
        }
        common
    }

    /// Returns the system of a model with these scales of its states `[n]`: those with which a run began that goes on
    /// with a longer plan.
    pub fn scaled(self, model: &Model, scales: &[f64]) -> System<'a> {
        let ranges = model.states.iter().zip(scales).map(|(state, scale)| state.range_at(*scale)).collect();
        System { scales: scales.to_vec(), ranges, ..self }
    }

    /// True for a boundary-value problem.
    pub fn is_open(&self) -> bool {
        self.field.conditions() != [0, 0]
    }

    /// Type of the branches on which such solutions lie.
    pub(super) fn family_of(&self, solution: &Solution) -> Family {
        match solution {
            Solution::Equilibrium(_) => Family::Equilibrium,
            Solution::Cycle(_) if self.is_open() => Family::Arc,
            Solution::Cycle(_) => Family::Cycle,
            Solution::Torus(_) => Family::Torus,
        }
    }

    /// Returns the system with an unfolding of its field, for branch points of cycles.
    pub fn with_unfolding(&self, unfolded: &'a Unfolded<'a>) -> System<'a> {
        System { unfolded: Some(unfolded), ..self.clone() }
    }

    /// Characteristic size of a parameter.
    pub fn unit(&self, index: usize) -> f64 {
        self.parameter_scales.get(index).copied().unwrap_or(1.0)
    }

    /// Euclidean norm of a state `[n]` in units of the scales.
    pub(super) fn norm(&self, x: &[f64]) -> f64 {
        x.iter().zip(&self.scales).map(|(x, scale)| (x / scale).powi(2)).sum::<f64>().sqrt()
    }

    /// Characteristic size of a quantity: that of its parameter or state, 1 for outputs and integrals, and 0 for the
    /// period, which is its own scale.
    pub(super) fn size_of(&self, quantity: Quantity) -> f64 {
        let state = |k: usize| self.scales.get(k).copied().unwrap_or(1.0);
        match quantity {
            Quantity::Parameter(index) => self.unit(index),
            Quantity::Iterate(k, _)
            | Quantity::At(k, _)
            | Quantity::Smallest(k)
            | Quantity::Largest(k)
            | Quantity::Mean(k)
            | Quantity::Rms(k) => state(k),
            Quantity::Norm(_) => self.scales.iter().fold(0.0, |most, scale| scale.max(most)),
            Quantity::Integral(_) | Quantity::Rotation => 1.0,
            Quantity::Period | Quantity::Frequency => 0.0,
            Quantity::Of(term) if !quantity.is_phase() => match term.signal {
                Signal::Channel(k) => state(k),
                Signal::Pair(u, v) => state(u).max(state(v)),
            },
            Quantity::Of(_) | Quantity::Difference(..) => 360.0 / std::f64::consts::TAU,
            Quantity::Decibels(_) | Quantity::Ratio(..) | Quantity::RatioDecibels(..) => 1.0,
        }
    }

    /// Adopts the scales in which the tangents of a diagram are stored, so that its branches can be continued.
    pub fn in_units_of(mut self, diagram: &Diagram) -> System<'a> {
        for branch in diagram.branches.iter().filter(|branch| !branch.points.is_empty()) {
            for (index, unit) in &branch.also {
                self.parameter_scales.iter_mut().skip(*index).take(1).for_each(|own| *own = *unit);
            }
            let held = branch.held.map(|(_, first)| first);
            for (index, unit) in held.into_iter().chain([branch.free]).zip(&branch.units[usize::from(held.is_none())..])
            {
                self.parameter_scales.iter_mut().skip(index).take(1).for_each(|own| *own = *unit);
            }
        }
        self
    }

    /// Size of every parameter `[k]` in a plan: as declared, else |value|, but at least a quarter of the range in which
    /// the plan varies it, so that a branch takes no more steps than the solution requires, and at most that range,
    /// which a step would leave.
    fn sized(model: &Model, plan: &Plan) -> Vec<f64> {
        const LEAST: f64 = 0.25;
        let widths = widths(model, plan);
        let size = |(own, width): (&Parameter, &f64)| match own.scale {
            Some(scale) => scale,
            None if *width > 0.0 => own.value.abs().clamp(LEAST * width, *width),
            None if own.value == 0.0 => 1.0,
            None => own.value.abs(),
        };
        model.parameters.iter().zip(&widths).map(size).collect()
    }

    /// Checks that a forced field is periodic at these parameters `[k]` and with others moved within their ranges.
    ///
    /// # Errors
    /// A sentence that says what is not periodic.
    pub fn repeats(&self, parameters: &[f64], moving: &[(usize, [f64; 2])]) -> Result<(), String> {
        const SHARES: [f64; 3] = [0.0, 0.371, 0.829];
        for share in SHARES {
            let mut there = parameters.to_vec();
            for (index, [low, high]) in moving.iter().filter(|_| share > 0.0) {
                there[*index] = low + share * (high - low);
            }
            // A range may extend beyond meaningful periods; a branch ends on its way there.
            let senseless = share > 0.0 && self.field.time_unit(&there) <= 0.0;
            let wrong = unrepeated(self.field, &self.state_names, &self.ranges, &there).filter(|_| !senseless);
            if let Some([message, hint]) = wrong {
                let moved: Vec<String> = moving.iter().map(|(k, _)| Shown(there[*k]).to_string()).collect();
                let place = if moved.is_empty() {
                    String::new()
                } else {
                    format!(
                        ", with the free parameter{} at {}",
                        if moved.len() == 1 { "" } else { "s" },
                        moved.join(" and ")
                    )
                };
                return Err(format!("{message}{place}: {hint}"));
            }
        }
        Ok(())
    }
}

/// Width of the range over which a plan varies each parameter `[k]`; 0 if it does not.
fn widths(model: &Model, plan: &Plan) -> Vec<f64> {
    let mut ends: Vec<[f64; 2]> = vec![[f64::INFINITY, f64::NEG_INFINITY]; model.parameters.len()];
    let mut reaches = |index: usize, values: [f64; 2]| {
        for value in values.into_iter().filter(|value| value.is_finite()) {
            if let Some([low, high]) = ends.get_mut(index) {
                (*low, *high) = (low.min(value), high.max(value));
            }
        }
    };
    for branch in &plan.branches {
        reaches(branch.free, branch.range);
        branch.holds.others.iter().for_each(|(other, range)| range.iter().for_each(|range| reaches(*other, *range)));
    }
    for curve in &plan.curves {
        reaches(curve.free, curve.ranges[1]);
    }
    for homotopy in &plan.homotopies {
        reaches(homotopy.via, homotopy.range);
    }
    for exploration in &plan.explorations {
        reaches(exploration.free, exploration.range);
        exploration.connect.into_iter().for_each(|(second, range)| reaches(second, range));
    }
    ends.iter().map(|[low, high]| (high - low).max(0.0)).collect()
}

/// Returns the parameters of an exploration, with those that it changes at values inside their ranges.
fn inside(exploration: &ExplorePlan) -> Vec<f64> {
    let mut place = exploration.parameters.clone();
    place[exploration.free] = between(exploration.range);
    if let Some((second, range)) = exploration.connect {
        place[second] = between(range);
    }
    place
}

fn between([low, high]: [f64; 2]) -> f64 {
    const SHARE: f64 = 0.617;
    low + SHARE * (high - low)
}

/// Returns the parameters of a seed, with those that the plan changes at values between those that they reach.
fn away(plan: &Plan, seed: &[f64]) -> Vec<f64> {
    let mut place = seed.to_vec();
    for homotopy in &plan.homotopies {
        place[homotopy.via] = between(homotopy.range);
        // A later homotopy that returns to the value of the seed does not undo this.
        let changed = homotopy.targets.iter().filter(|(target, goal)| seed[*target] != *goal);
        changed.for_each(|(target, goal)| place[*target] = between([seed[*target], *goal]));
    }
    plan.curves.iter().for_each(|curve| place[curve.free] = between(curve.ranges[1]));
    let others = |branch: &BranchPlan| branch.holds.others.clone();
    for (other, range) in plan.branches.iter().flat_map(others) {
        // A parameter that is zero at the seed may be zero for symmetry.
        place[other] = range.map_or_else(|| 1.1 * place[other] + 0.01, between);
    }
    plan.branches.iter().for_each(|branch| place[branch.free] = between(branch.range));
    place
}
