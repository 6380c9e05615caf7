//! A vector field together with what exploring it needs to know.

use super::plan::Plan;
use crate::contract::{Batch, Parameters, VectorField};
use crate::model::Model;

/// A vector field, its scales, and where to look for attractors.
#[derive(Clone)]
pub struct System<'a> {
    /// The vector field.
    pub field: &'a dyn VectorField,
    /// `[n]` name of each state, for messages.
    pub state_names: Vec<String>,
    /// `[n]` characteristic size of each state.
    pub scales: Vec<f64>,
    /// `[k]` characteristic size of each parameter: a length along a branch counts changes of a parameter relative to it.
    pub parameter_scales: Vec<f64>,
    /// `[n]` box from which initial states are sampled.
    pub ranges: Vec<[f64; 2]>,
    /// The two states that form the complex whirl signal, if the model has one.
    pub whirl: Option<[usize; 2]>,
    /// Coordinate reflections under which the field is equivariant, the identity first.
    pub reflections: Vec<Vec<bool>>,
}

impl<'a> System<'a> {
    /// A system whose scales are all 1 and whose initial states come from [-2, 2]ⁿ.
    pub fn new(field: &'a dyn VectorField) -> System<'a> {
        let n = field.dim();
        System {
            field,
            state_names: (1..=n).map(|i| format!("state {i}")).collect(),
            scales: vec![1.0; n],
            parameter_scales: vec![1.0; field.parameter_count()],
            ranges: vec![[-2.0, 2.0]; n],
            whirl: None,
            reflections: vec![vec![false; n]],
        }
    }

    /// The system of a model at given parameters, with the scales and ranges of its states and the symmetries that it has
    /// there.
    pub fn of(model: &'a Model, parameters: &[f64]) -> System<'a> {
        let mut system = System {
            state_names: model.states.iter().map(|s| s.name.clone()).collect(),
            scales: model.states.iter().map(|s| s.scale).collect(),
            // A parameter that is zero says nothing about its size.
            parameter_scales: model
                .parameters
                .iter()
                .map(|p| if p.value == 0.0 { 1.0 } else { p.value.abs() })
                .collect(),
            ranges: model.states.iter().map(|s| s.range).collect(),
            whirl: model.whirl,
            ..System::new(model)
        };
        system.find_reflections(parameters);
        system
    }

    /// The system of a plan. Only a symmetry that holds wherever the plan goes counts: at every seed, and with the
    /// parameters that branches, curves and homotopies change away from values, such as zero, at which a model may be more
    /// symmetric than elsewhere.
    pub fn of_plan(model: &'a Model, plan: &Plan) -> System<'a> {
        let mut places: Vec<Vec<f64>> = plan.seeds.iter().map(|seed| seed.parameters.clone()).collect();
        places.extend(plan.seeds.iter().map(|seed| away(plan, &seed.parameters)));
        places.extend(plan.surveys.iter().map(|survey| survey.parameters.clone()));
        let mut systems = places.iter().map(|place| System::of(model, place));
        let Some(mut common) = systems.next() else { return System::new(model) };
        for other in systems {
            common.reflections.retain(|reflection| other.reflections.contains(reflection));
        }
        common
    }

    /// Finds the reflections R = diag(±1), n ≤ 10, with f(R x) = R f(x), by trial at a few points and the parameter values
    /// `parameters`.
    pub fn find_reflections(&mut self, parameters: &[f64]) {
        let n = self.field.dim();
        self.reflections = vec![vec![false; n]];
        if n > 10 {
            return;
        }
        let points: Vec<Vec<f64>> = (0..5)
            .map(|k| {
                (0..n).map(|i| self.scales[i] * ((3 * k + 1) as f64 * 0.71 + (i * i + 1) as f64 * 1.37).sin()).collect()
            })
            .collect();
        let value = |x: &[f64]| {
            let mut f = vec![0.0; n];
            self.field.evaluate(Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters) }, &mut f);
            f
        };
        for bits in 1..1usize << n {
            let reflection: Vec<bool> = (0..n).map(|i| bits >> i & 1 == 1).collect();
            let reflect =
                |x: &[f64]| -> Vec<f64> { x.iter().zip(&reflection).map(|(v, r)| if *r { -v } else { *v }).collect() };
            let equivariant = points.iter().all(|x| {
                let (a, b) = (value(&reflect(x)), reflect(&value(x)));
                a.iter().zip(&b).all(|(p, q)| p.is_finite() && (p - q).abs() <= 1e-10 * (p.abs() + q.abs()))
            });
            if equivariant {
                self.reflections.push(reflection);
            }
        }
    }
}

/// The parameters of a seed, those that the plan changes replaced by values between those that they reach.
fn away(plan: &Plan, seed: &[f64]) -> Vec<f64> {
    const SHARE: f64 = 0.617;
    let between = |[low, high]: [f64; 2]| low + SHARE * (high - low);
    let mut place = seed.to_vec();
    for homotopy in &plan.homotopies {
        place[homotopy.via] = between(homotopy.range);
        // A later one that leads back to the value of the seed takes nothing back.
        let changed = homotopy.targets.iter().filter(|(target, goal)| seed[*target] != *goal);
        changed.for_each(|(target, goal)| place[*target] = between([seed[*target], *goal]));
    }
    plan.curves.iter().for_each(|curve| place[curve.free] = between(curve.ranges[1]));
    plan.branches.iter().for_each(|branch| place[branch.free] = between(branch.range));
    place
}
