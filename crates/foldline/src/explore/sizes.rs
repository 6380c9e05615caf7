//! Characteristic sizes of the states.
//!
//! **Idea.** If a model does not state the size of a state, its solutions show it: the largest magnitude, rounded, of
//! the state along trajectories from the given states, at parameter values between those that the plan reaches. The
//! trajectories need only show orders of magnitude; their errors are relative to the largest magnitude so far, so that
//! nothing depends on units.
//!
//! **Equations.** With Xᵢ the largest |xᵢ| so far and e the difference of the two solutions of an embedded pair, a step
//! is accepted if
//!
//!   (1)  maxᵢ |eᵢ| / Xᵢ ≤ [`ACCURACY`]
//!
//! A boundary-value problem has no motions, and trajectories from one end may grow without bound where its solutions do
//! not. There the profiles of the seeds show the sizes.
//!
//! **Source.** bogacki1989 (the pair of orders 3 and 2).
//!
//! **Fails when** a state is 0 along every trajectory, or grows to the end of each; its size is then taken as 1.

use super::plan::{Plan, SeedSource};
use crate::contract::{Batch, Parameters, VectorField};
use crate::linalg::max_abs;
use crate::model::Model;
use crate::simulation::Clocked;

/// A state `[n]` and parameters `[k]`.
pub(super) type Place = (Vec<f64>, Vec<f64>);

/// Allowed error of a step, (1).
const ACCURACY: f64 = 1e-2;
/// Number of steps of a trajectory. Growth from [`ASIDE`] to 1 takes some 200, and settling as many; an oscillation
/// that grows by a third in each period has 100 periods.
const STEPS: usize = 2000;
/// Smallest and largest number of starts, each used once as it is and once perturbed.
const PLACES: [usize; 2] = [3, 12];
/// Number of states of all starts together, within these limits: five equations take 30 ms, a hundred 0.2 s.
const STATES: usize = 240;
/// Magnitude beyond which a trajectory runs to infinity.
const INFINITE: f64 = 1e100;
/// Largest change of the extent from the third to the last quarter of a trajectory that has settled.
const STEADY: f64 = 2.0;
/// Log of the growth, extrapolated from these quarters to the whole time, that irregular extents may seem to have.
const SLOW: f64 = 3.0;
/// Initial value of a state that is 0, so that it can leave a saddle.
const ASIDE: f64 = 1e-30;
/// Initial value of such a state of a map, whose orbits may escape from far away states at once.
const BESIDE: f64 = 1e-3;
/// Magnitude below which a state counts as 0: ten decades above [`ASIDE`], for growth that decays again.
const NOTHING: f64 = 1e-20;
/// Magnitude below which a state counts as 0 in the profile of a boundary-value problem, an expression whose value may be rounding, such as cos(π/2).
const ROUNDED: f64 = 1e-12;
/// Relative change of the state over a step at which a trajectory is at rest.
const REST: f64 = 1e-6;

/// Characteristic size of every state `[n]`: as stated in the model, else the largest magnitude along the trajectory
/// from `state` `[n]` at these parameters `[k]` if bounded, else the magnitude in `state`, and 1 for a state that is
/// always 0.
pub fn scales_from(model: &Model, state: &[f64], parameters: &[f64]) -> Vec<f64> {
    of_states(model, &[(state.to_vec(), parameters.to_vec())])
}

/// Characteristic size of every state `[n]` in a plan: the size stated in the model, else the largest magnitude met
/// from the starts of the plan, else 1.
pub fn state_scales(model: &Model, plan: &Plan) -> Vec<f64> {
    if model.conditions() == [0, 0] {
        return of_states(model, &places(model, plan));
    }
    let profiles = plan.seeds.iter().flat_map(|seed| match &seed.source {
        SeedSource::State(state) => state.chunks_exact(model.dim().max(1)),
        SeedSource::Cycle(cycle) | SeedSource::Besides(cycle, _) => cycle.profile.chunks_exact(model.dim().max(1)),
        SeedSource::Attractor(_) | SeedSource::Torus(_) | SeedSource::QuasiPeriodic => [].chunks_exact(1),
    });
    of_states(model, &profiles.map(|state| (state.to_vec(), Vec::new())).collect::<Vec<Place>>())
}

/// Returns the origin at these parameters.
pub(super) fn origin(model: &Model, parameters: &[f64]) -> Place {
    (vec![0.0; model.dim()], parameters.to_vec())
}

/// Returns the starts of a plan, and the same states at other values of each parameter that the plan changes.
pub(super) fn places(model: &Model, plan: &Plan) -> Vec<Place> {
    const SHARES: [f64; 4] = [0.5, 1.0, 0.0, 0.25];
    let mut starts: Vec<Place> = Vec::new();
    for seed in &plan.seeds {
        match &seed.source {
            SeedSource::State(state) => starts.push((state.clone(), seed.parameters.clone())),
            SeedSource::Cycle(cycle) | SeedSource::Besides(cycle, _) => {
                let n = model.dim().max(1);
                let states = cycle.profile.chunks_exact(n).step_by(1 + cycle.profile.len() / (4 * n));
                starts.extend(states.map(|state| (state.to_vec(), seed.parameters.clone())));
            }
            SeedSource::Attractor(_) | SeedSource::Torus(_) | SeedSource::QuasiPeriodic => {
                starts.push(origin(model, &seed.parameters))
            }
        }
    }
    starts.extend(plan.explorations.iter().map(|own| origin(model, &own.parameters)));
    starts.extend(plan.surveys.iter().map(|own| origin(model, &own.parameters)));
    let branches = plan.branches.iter().map(|own| (own.free, own.range));
    let curves = plan.curves.iter().map(|own| (own.free, own.ranges[1]));
    let homotopies = plan.homotopies.iter().map(|own| (own.via, own.range));
    let explorations = plan.explorations.iter().map(|own| (own.free, own.range));
    let mut axes: Vec<(usize, [f64; 2])> = branches.chain(curves).chain(homotopies).chain(explorations).collect();
    axes.dedup();
    let moved = |share: f64| {
        let (starts, axes) = (&starts, &axes);
        starts.iter().flat_map(move |(state, parameters)| {
            axes.iter().filter(|(_, range)| range.iter().all(|end| end.is_finite())).map(move |(index, [low, high])| {
                let mut there = parameters.clone();
                there.iter_mut().skip(*index).take(1).for_each(|value| *value = low + share * (high - low));
                (state.clone(), there)
            })
        })
    };
    let all: Vec<Place> = starts.iter().cloned().chain(SHARES.into_iter().flat_map(moved)).collect();
    all.into_iter().take((STATES / model.dim().max(1)).clamp(PLACES[0], PLACES[1])).collect()
}

/// Size of every state `[n]`: as stated in the model, else the largest magnitude met from `places`, else 1.
pub(super) fn of_states(model: &Model, places: &[Place]) -> Vec<f64> {
    let mut sizes: Vec<Option<f64>> = model.states.iter().map(|state| state.stated_scale()).collect();
    if sizes.iter().any(Option::is_none) {
        let mut met = vec![0.0f64; model.dim()];
        let mut reaches = |state: &[f64]| met.iter_mut().zip(state).for_each(|(size, x)| *size = size.max(x.abs()));
        for (state, parameters) in places {
            reaches(state);
            for aside in [false, true].into_iter().filter(|_| model.conditions() == [0, 0]) {
                reaches(&largest(model, state, parameters, aside).unwrap_or_default());
            }
        }
        let least = if model.conditions() == [0, 0] { NOTHING } else { ROUNDED };
        let known = |size: &f64| *size > least && size.is_finite();
        sizes.iter_mut().zip(met).for_each(|(size, met)| *size = size.or(Some(met).filter(known).map(rounded)));
    }
    sizes.into_iter().map(|size| size.unwrap_or(1.0)).collect()
}

/// Rounds down to a number with the first digit 1, 2 or 5, so that states exchanged by a symmetry have the same size.
fn rounded(size: f64) -> f64 {
    let power = 10f64.powi(size.log10().floor() as i32);
    let digits = [5.0, 2.0, 1.0].into_iter().find(|digit| digit * power <= size);
    digits.unwrap_or(1.0) * power
}

/// Returns the largest magnitude of every state `[n]` along the trajectory or, if started `aside`, at its end; `None`
/// if it does not stay bounded. A state that grows from almost nothing and decays again says nothing about sizes.
fn largest(model: &Model, start: &[f64], parameters: &[f64], aside: bool) -> Option<Vec<f64>> {
    if model.iterated() {
        return of_orbit(model, start, parameters, aside);
    }
    let (field, n) = (Clocked(model), model.dim());
    let slope = |x: &[f64]| {
        let mut f = vec![0.0; n + 1];
        let parameters = Parameters::Shared(parameters);
        field.evaluate(Batch { lanes: 1, states: x, parameters, times: &[], signs: &[] }, &mut f);
        f
    };
    let beside = |(i, x): (usize, &f64)| if aside && *x == 0.0 { ASIDE * (1.0 + 0.1 * i as f64) } else { *x };
    let mut x: Vec<f64> = start.iter().enumerate().map(beside).chain([0.0]).collect();
    let mut k1 = slope(&x);
    let mut sizes: Vec<f64> = x[..n].iter().map(|x| x.abs()).chain([1.0]).collect();
    let relative = |change: &[f64], sizes: &[f64]| {
        let each = change.iter().zip(sizes).filter(|(d, _)| **d != 0.0);
        max_abs(&each.map(|(d, size)| d / size.max(f64::MIN_POSITIVE)).collect::<Vec<f64>>())
    };
    let mut h = (ACCURACY / relative(&k1, &sizes)).clamp(f64::MIN_POSITIVE, 1e300);
    let mut quarters = [vec![0.0f64; n], vec![0.0f64; n]];
    let (mut rests, mut halfway) = (false, 0.0);
    for step in 0..STEPS {
        let at = |parts: &[(f64, &[f64])]| -> Vec<f64> {
            (0..=n).map(|i| x[i] + h * parts.iter().map(|(a, k)| a * k[i]).sum::<f64>()).collect()
        };
        let k2 = slope(&at(&[(0.5, &k1)]));
        let k3 = slope(&at(&[(0.75, &k2)]));
        let next = at(&[(2.0 / 9.0, &k1), (1.0 / 3.0, &k2), (4.0 / 9.0, &k3)]);
        let k4 = slope(&next);
        let error: Vec<f64> =
            (0..=n).map(|i| h * (-5.0 / 72.0 * k1[i] + k2[i] / 12.0 + k3[i] / 9.0 - k4[i] / 8.0)).collect();
        let reached: Vec<f64> = sizes.iter().zip(&next).map(|(size, x)| size.max(x.abs())).collect();
        let error = relative(&error, &reached) / ACCURACY;
        if error <= 1.0 {
            let moved: Vec<f64> = next[..n].iter().zip(&x).map(|(a, b)| a - b).collect();
            rests = relative(&moved, &reached) < REST && error < REST.cbrt();
            (x, k1, sizes) = (next, k4, reached);
            sizes[n] = 1.0;
            if rests || max_abs(&x[..n]) > INFINITE {
                break;
            }
        }
        if 2 * step == STEPS {
            halfway = x[n];
        }
        if let Some(quarter) = (4 * step / STEPS).checked_sub(2) {
            quarters[quarter].iter_mut().zip(&x).for_each(|(size, x)| *size = size.max(x.abs()));
        }
        h *= if error.is_finite() { (0.9 * error.powf(-1.0 / 3.0)).clamp(0.2, 5.0) } else { 0.2 };
    }
    let [before, last] = &quarters;
    // Growth may need ever shorter steps, so its rate counts too, over the whole time.
    let share = 0.5 * (x[n] - halfway) / x[n];
    let grows = |(a, b): (&f64, &f64)| *b > NOTHING && (*b > STEADY * a || (b / a).ln() > SLOW * share);
    if max_abs(&x[..n]) > INFINITE || !rests && before.iter().zip(last).any(grows) {
        return None;
    }
    sizes.truncate(n);
    if !aside {
        return Some(sizes);
    }
    let steady = |i: usize| rests || before[i] <= STEADY * last[i];
    let here = |i: usize| if rests { x[i].abs() } else { last[i] };
    // Anything smaller is below the accuracy.
    let lasts = |i: usize| here(i) > 10.0 * ACCURACY * sizes[i];
    Some((0..n).map(|i| if steady(i) && lasts(i) { here(i) } else { 0.0 }).collect())
}

/// Returns the largest magnitude of every state `[n]` along the orbit of a map from `start`, or from states `aside`.
fn of_orbit(model: &Model, start: &[f64], parameters: &[f64], aside: bool) -> Option<Vec<f64>> {
    let mut x: Vec<f64> = start.iter().map(|x| if aside && *x == 0.0 { BESIDE } else { *x }).collect();
    let mut sizes = vec![0.0f64; x.len()];
    for _ in 0..STEPS {
        sizes.iter_mut().zip(&x).for_each(|(size, x)| *size = size.max(x.abs()));
        let mut next = vec![0.0; x.len()];
        let parameters = Parameters::Shared(parameters);
        model.evaluate(Batch { lanes: 1, states: &x, parameters, times: &[], signs: &[] }, &mut next);
        if !next.iter().all(|x| x.abs() < INFINITE) {
            return None;
        }
        x = next;
    }
    Some(sizes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Definition, ModelSource, Parameter, State};

    fn sizes(equations: &[(&str, &str)], start: &[f64], p: f64) -> Vec<f64> {
        let model = Model::compile(ModelSource {
            parameters: vec![Parameter::new("p", p)],
            states: equations.iter().map(|(name, _)| State::new(name)).collect(),
            equations: equations.iter().map(|(name, text)| Definition::new(name, text)).collect(),
            ..ModelSource::default()
        });
        scales_from(&model.unwrap(), start, &[p])
    }

    #[test]
    fn a_small_displacement_and_a_transient_velocity_set_the_sizes() {
        // x → 2e-6, with an angular frequency of 1e4 and little damping: |v| reaches nearly 2e-2.
        let spring = [("x", "v"), ("v", "1e8*(p - x) - 1e3*v")];
        let [x, v] = sizes(&spring, &[0.0, 0.0], 2e-6)[..] else { panic!() };
        assert!(x == 2e-6 && v == 1e-2, "{x:e} {v:e}");
    }

    #[test]
    fn a_state_that_leaves_a_saddle_has_the_size_at_which_it_settles() {
        assert_eq!(sizes(&[("x", "p*x - x^3/1e36")], &[0.0], 4.0), [2e18]);
        let oscillator = [("x", "y"), ("y", "(1 - x^2)*y - x")];
        // Amplitudes of 2.01 and 2.67.
        assert_eq!(sizes(&oscillator, &[0.0, 0.0], 0.0), [2.0, 2.0]);
    }

    #[test]
    fn a_state_that_decays_again_or_grows_without_bound_has_size_1() {
        // y grows from almost nothing until x exceeds 0.5 on its way to 3, and then decays.
        assert_eq!(sizes(&[("x", "x - x^3/9"), ("y", "(0.5 - x)*y")], &[0.0, 0.0], 0.0), [2.0, 1.0]);
        assert_eq!(sizes(&[("x", "x")], &[0.0], 0.0), [1.0]);
        assert_eq!(sizes(&[("x", "x^2 + 1")], &[0.0], 0.0), [1.0]);
        // The larger z, the shorter the steps.
        assert_eq!(sizes(&[("y", "y - z - y*(y^2 + z^2)"), ("z", "y + z")], &[0.0; 2], 0.0)[1], 1.0);
    }

    #[test]
    fn a_stated_size_or_range_is_taken() {
        let mut state = State::new("x");
        assert_eq!((state.stated_scale(), state.range_at(3.0)), (None, [-6.0, 6.0]));
        state.range = Some([-1e-6, 7e-6]);
        assert_eq!((state.stated_scale(), state.range_at(3.0)), (Some(2e-6), [-1e-6, 7e-6]));
        state.scale = Some(5.0);
        assert_eq!(state.stated_scale(), Some(5.0));
    }
}
