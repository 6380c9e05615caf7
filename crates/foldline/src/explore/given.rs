//! Solutions computed elsewhere.
//!
//! **Idea.** A profile computed by another program is close to a solution if the models agree. The residual of the
//! equations shows whether they do before anything is solved; Newton's method then corrects the profile.

use super::System;
use super::growth::{first, polished, problem_of, settings};
use super::minimal::reduced;
use super::plan::SeedPlan;
use super::seeds::{bare, near};
use crate::attractors::gained;
use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::{Cycle, Point, Solution};
use crate::problem::gauss::Scheme;

/// Relative residual of a solution in the model: the component where it is worst, and there the largest |f - ẋ| over
/// the largest |f| of that component on the cycle; for an equilibrium |f| over the sum of the contributions of all
/// states and parameters to it, Σ |∂f/∂x x| + Σ |∂f/∂p p|. `None` if f is not finite.
///
/// `parameters` `[k]`. The numbers of states must agree.
pub fn mismatch(field: &dyn VectorField, parameters: &[f64], solution: &Solution) -> Option<(usize, f64)> {
    if field.iterated() {
        return of_map(field, parameters, solution);
    }
    let sizes = match solution {
        Solution::Equilibrium(state) => at_rest(field, parameters, state),
        Solution::Cycle(cycle) => along(field, parameters, cycle),
        Solution::Torus(_) => return None,
    };
    let share = |[off, size]: [f64; 2]| if off == 0.0 { 0.0 } else { off / size.max(f64::MIN_POSITIVE) };
    let shares = sizes.into_iter().map(share).enumerate();
    shares.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, share)| share.is_finite())
}

/// For a cycle of a map, the largest |f(x_k) - x_{k+1}| over the largest |x_k| of the component.
fn of_map(field: &dyn VectorField, parameters: &[f64], solution: &Solution) -> Option<(usize, f64)> {
    let Solution::Cycle(cycle) = solution else { return None };
    let n = cycle.dim();
    let mut worst = None;
    for (k, state) in cycle.profile.chunks_exact(n.max(1)).enumerate() {
        let mut f = vec![0.0; n];
        let parameters = Parameters::Shared(parameters);
        field.evaluate(Batch { lanes: 1, states: state, parameters, times: &[], signs: &[] }, &mut f);
        for i in 0..n {
            let next = (k + 1) * n + i;
            let closed = cycle.profile[i] + cycle.gain.get(i).copied().unwrap_or(0.0);
            let off = (f[i] - cycle.profile.get(next).copied().unwrap_or(closed)).abs();
            let size = cycle.profile.iter().skip(i).step_by(n).fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
            let share = off / size;
            if !share.is_finite() {
                return None;
            }
            if worst.is_none_or(|(_, most)| share > most) {
                worst = Some((i, share));
            }
        }
    }
    worst
}

fn at_rest(field: &dyn VectorField, parameters: &[f64], state: &[f64]) -> Vec<[f64; 2]> {
    let (n, k) = (state.len(), parameters.len());
    let free: Vec<usize> = (0..k).collect();
    let (mut f, mut fx, mut fp) = (vec![0.0; n], vec![0.0; n * n], vec![0.0; n * k]);
    let at = Batch { lanes: 1, states: state, parameters: Parameters::Shared(parameters), times: &[], signs: &[] };
    field.linearise(at, &free, &mut f, &mut fx, &mut fp);
    let size = |i: usize| {
        let of_states: f64 = (0..n).map(|j| (fx[i * n + j] * state[j]).abs()).sum();
        of_states + (0..k).map(|j| (fp[i * k + j] * parameters[j]).abs()).sum::<f64>()
    };
    (0..n).map(|i| [f[i].abs(), size(i)]).collect()
}

fn along(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle) -> Vec<[f64; 2]> {
    let (n, m) = (cycle.dim(), cycle.degree);
    let scheme = Scheme::new(m);
    let mut sizes = vec![[0.0f64; 2]; n];
    let mut f = vec![0.0; n];
    // A forced field is measured in forcing periods, that of a boundary-value problem in lengths of the interval.
    let whole = if field.forced() { f64::from(cycle.forcing_periods) } else { cycle.period };
    for (ends, nodes) in cycle.mesh.windows(2).zip(cycle.profile.chunks_exact((m + 1) * n)) {
        let duration = (ends[1] - ends[0]) * whole;
        let rows = scheme.nodes[1..].iter().zip(scheme.derivative.chunks_exact(m + 1));
        for (state, (node, row)) in nodes.chunks_exact(n).skip(1).zip(rows) {
            let time = [f64::from(cycle.forcing_periods) * (ends[0] + (ends[1] - ends[0]) * node)];
            let times = if field.forced() { &time[..] } else { &[] };
            let at = Batch { lanes: 1, states: state, parameters: Parameters::Shared(parameters), times, signs: &[] };
            field.evaluate(at, &mut f);
            for (i, [off, size]) in sizes.iter_mut().enumerate() {
                let slope: f64 = row.iter().zip(nodes.iter().skip(i).step_by(n)).map(|(d, x)| d * x).sum();
                let now = (f[i] - slope / duration).abs();
                // `max` would ignore NaN.
                *off = if now.is_nan() { now } else { off.max(now) };
                *size = size.max(f[i].abs());
            }
        }
    }
    sizes
}

/// Returns the cycle closest to a given one, over its minimal period.
///
/// # Errors
/// The failure of Newton's method, and the residual of the given cycle.
pub(super) fn from_cycle(system: &System, seed: &SeedPlan, tolerance: f64, cycle: &Cycle) -> Result<Point, String> {
    const NEAR: f64 = 0.1;
    let gain = gained(system.field.periods(), &cycle.profile[..cycle.dim()], &cycle.end());
    let cycle = &Cycle { gain, ..cycle.clone() };
    let given = bare(&seed.parameters, Solution::Cycle(cycle.clone()));
    let settings = settings(system, tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
    let found = near(system, cycle.degree, &settings, given.clone()).and_then(|guess| {
        let mut problem = problem_of(system, 0, cycle.degree, &guess, false);
        polished(&mut *problem, &settings, &guess).map(|found| found.point)
    });
    // A cycle of a family: try every parameter as the free one, since any may be the one that destroys the family.
    let found = found.or_else(|why| {
        /// Relative residual of the given cycle below which the search is worth while. Empirical: a cycle further off
        /// is not one of the model, and the search takes a factorisation for each parameter.
        const LIKELY: f64 = 0.5;
        let likely = mismatch(system.field, &seed.parameters, &given.solution).is_some_and(|(_, off)| off < LIKELY);
        let mut free = 0..if likely { system.field.parameter_count() } else { 0 };
        let of_family = free.find_map(|free| {
            let mut problem = problem_of(system, free, cycle.degree, &given, false);
            first(&mut *problem, &settings, &given).ok()
        });
        of_family.map(|found| found.point).ok_or(why)
    });
    let why = match found {
        Ok(point) => {
            let period = point.solution.period().unwrap_or(0.0);
            if (period - cycle.period).abs() <= NEAR * cycle.period {
                return Ok(reduced(system, &settings, &point).unwrap_or(point));
            }
            format!("Newton's method converges to a cycle of period {period:.6} instead of {:.6}", cycle.period)
        }
        Err(failure) => failure.to_string(),
    };
    let off = match mismatch(system.field, &seed.parameters, &given.solution) {
        Some((component, share)) => {
            let name = system.state_names.get(component).map_or("", String::as_str);
            format!("relative residual of the equation of {name}: {share:.2}")
        }
        None => "the equations are not finite on it".to_string(),
    };
    Err(format!(
        "no cycle was found near the given one: {why}\nlikely cause: the given cycle is too inaccurate, or belongs \
         to other equations or parameter values ({off})\nwhat to do: compare the equations, the parameter values and \
         the order of the states; or give the cycle at more times"
    ))
}

#[cfg(test)]
mod tests {
    use super::super::plan::SeedSource;
    use super::*;
    use crate::model::{Definition, Model, ModelSource, Parameter, State};
    use std::f64::consts::TAU;

    /// x' = μx - ωy - x(x² + y²), y' = ωx + μy - y(x² + y²): the cycle is a circle of radius √μ and period 2π/ω.
    fn circle() -> Model {
        let equation = |name: &str, text: &str| Definition::new(name, text);
        Model::compile(ModelSource {
            name: "circle".into(),
            parameters: vec![Parameter::new("mu", 1.0), Parameter::new("omega", 2.0)],
            states: vec![State::new("x"), State::new("y")],
            equations: vec![
                equation("x", "mu*x - omega*y - x*(x^2 + y^2)"),
                equation("y", "omega*x + mu*y - y*(x^2 + y^2)"),
            ],
            ..ModelSource::default()
        })
        .unwrap()
    }

    /// A circle of that radius and period; each interval interpolates `through` + 1 of the `count` states of a turn.
    fn given(radius: f64, period: f64, count: usize, through: usize) -> Cycle {
        let times: Vec<f64> = (0..=count).map(|k| k as f64 / count as f64).collect();
        let states: Vec<f64> =
            times.iter().flat_map(|t| [(TAU * t).cos(), (TAU * t).sin()].map(|v| radius * v)).collect();
        Cycle::given(period, &times, &states, through, 4).unwrap()
    }

    #[test]
    fn polynomials_through_given_states_are_the_same_on_another_mesh() {
        // t⁴ is its own interpolant of degree 4 for any nodes.
        let times = [0.0, 0.1, 0.3, 0.35, 0.5, 0.6, 0.7, 0.9, 1.0];
        let states = times.map(|t: f64| t.powi(4));
        let cycle = Cycle::given(1.0, &times, &states, 4, 5).unwrap();
        assert_eq!((cycle.intervals(), cycle.degree, &cycle.mesh[..]), (2, 5, &[0.0, 0.5, 1.0][..]));
        for t in [0.05, 0.2, 0.42, 0.77, 0.95f64] {
            assert!((cycle.state(t)[0] - t.powi(4)).abs() < 1e-14);
        }
        assert!(Cycle::given(1.0, &times[..8], &states[..8], 4, 5).is_none(), "no time 1");
        assert!(Cycle::given(1.0, &times, &states, 3, 5).is_none(), "eight steps are no multiple of three");
        assert!(Cycle::given(1.0, &times, &states[..8], 4, 5).is_none());
    }

    #[test]
    fn the_mismatch_is_the_relative_residual_of_the_equations() {
        let model = circle();
        let off = |solution: &Solution, parameters: &[f64]| mismatch(&model, parameters, solution).unwrap().1;
        // The error of polynomials of degree 4 on 40 intervals: (2π/40)⁵ divided by some hundreds.
        assert!(off(&Solution::Cycle(given(1.0, TAU / 2.0, 160, 4)), &[1.0, 2.0]) < 1e-6);
        // A period that is a tenth too long makes every slope an eleventh too small.
        let slow = off(&Solution::Cycle(given(1.0, 1.1 * TAU / 2.0, 160, 4)), &[1.0, 2.0]);
        assert!((slow - 0.1 / 1.1).abs() < 1e-6, "{slow}");
        // At (0.3, 0), f is 0.3 - 0.027; its contributions are ∂f/∂x x = (1 - 3 · 0.09) 0.3 and ∂f/∂μ μ = 0.3.
        let (component, share) = mismatch(&model, &[1.0, 2.0], &Solution::Equilibrium(vec![0.3, 0.0])).unwrap();
        assert!(component == 0 && (share - 0.273 / 0.519).abs() < 1e-12, "{component} {share}");
        assert_eq!(off(&Solution::Equilibrium(vec![0.0, 0.0]), &[1.0, 2.0]), 0.0);
        assert_eq!(mismatch(&model, &[f64::NAN, 2.0], &Solution::Equilibrium(vec![0.3, 0.0])), None);
    }

    #[test]
    fn newton_leads_from_a_crude_cycle_to_the_cycle_or_says_why_not() {
        let model = circle();
        let system = System::of(&model, &[1.0, 2.0]);
        let seed = |cycle: &Cycle| SeedPlan {
            name: "given".into(),
            source: SeedSource::Cycle(cycle.clone()),
            parameters: vec![1.0, 2.0],
            samples: 1,
            random: 1,
        };
        // Twelve straight lines, a tenth too wide and a fiftieth too slow.
        let crude = given(1.1, 1.02 * TAU / 2.0, 12, 1);
        let found = from_cycle(&system, &seed(&crude), 1e-8, &crude).unwrap();
        assert!((found.solution.period().unwrap() - TAU / 2.0).abs() < 1e-7);
        assert!(found.ranges[..2].iter().all(|[low, high]| (low + 1.0).abs() < 1e-6 && (high - 1.0).abs() < 1e-6));
        let wrong = given(1.0, TAU, 12, 1);
        let said = from_cycle(&system, &seed(&wrong), 1e-8, &wrong).unwrap_err();
        assert!(said.contains("no cycle was found near the given one") && said.contains("likely cause"), "{said}");
    }
}
