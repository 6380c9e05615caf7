//! Solutions that were computed elsewhere.
//!
//! **Idea.** A profile that another program has computed is close to a solution if the models are the same. By how much the
//! equations are off where it is given tells whether they are, before anything is solved; Newton's method does the rest.

use super::System;
use super::growth::{polished, problem_of, settings};
use super::plan::SeedPlan;
use super::seeds::{bare, near};
use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::{Cycle, Point, Solution};
use crate::problem::gauss::Scheme;

/// By how much a solution fails to satisfy the model: the component where it is worst, and there the largest |f - ẋ| over the
/// largest |f| of that component on the cycle; for an equilibrium |f| over the sum of what every state and parameter
/// contributes to it, Σ |∂f/∂x x| + Σ |∂f/∂p p|. `None` where f is not finite.
///
/// `parameters` `[k]`. The numbers of states must agree.
pub fn mismatch(field: &dyn VectorField, parameters: &[f64], solution: &Solution) -> Option<(usize, f64)> {
    let sizes = match solution {
        Solution::Equilibrium(state) => at_rest(field, parameters, state),
        Solution::Cycle(cycle) => along(field, parameters, cycle),
    };
    let share = |[off, size]: [f64; 2]| if off == 0.0 { 0.0 } else { off / size.max(f64::MIN_POSITIVE) };
    let shares = sizes.into_iter().map(share).enumerate();
    shares.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, share)| share.is_finite())
}

fn at_rest(field: &dyn VectorField, parameters: &[f64], state: &[f64]) -> Vec<[f64; 2]> {
    let (n, k) = (state.len(), parameters.len());
    let free: Vec<usize> = (0..k).collect();
    let (mut f, mut fx, mut fp) = (vec![0.0; n], vec![0.0; n * n], vec![0.0; n * k]);
    let at = Batch { lanes: 1, states: state, parameters: Parameters::Shared(parameters), times: &[] };
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
    for (ends, nodes) in cycle.mesh.windows(2).zip(cycle.profile.chunks_exact((m + 1) * n)) {
        let duration = (ends[1] - ends[0]) * cycle.period;
        for (state, row) in nodes.chunks_exact(n).skip(1).zip(scheme.derivative.chunks_exact(m + 1)) {
            let at = Batch { lanes: 1, states: state, parameters: Parameters::Shared(parameters), times: &[] };
            field.evaluate(at, &mut f);
            for (i, [off, size]) in sizes.iter_mut().enumerate() {
                let slope: f64 = row.iter().zip(nodes.iter().skip(i).step_by(n)).map(|(d, x)| d * x).sum();
                let now = (f[i] - slope / duration).abs();
                // `max` would pass over what is not a number.
                *off = if now.is_nan() { now } else { off.max(now) };
                *size = size.max(f[i].abs());
            }
        }
    }
    sizes
}

/// The cycle next to a given one.
///
/// # Errors
/// What Newton's method met, and by how much the given one fails to satisfy the model.
pub(super) fn from_cycle(system: &System, seed: &SeedPlan, tolerance: f64, cycle: &Cycle) -> Result<Point, String> {
    const NEAR: f64 = 0.1;
    let given = bare(&seed.parameters, Solution::Cycle(cycle.clone()));
    let settings = settings(system, tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
    let found = near(system, cycle.degree, &settings, given.clone()).and_then(|guess| {
        let mut problem = problem_of(system, 0, cycle.degree, &guess, false);
        polished(&mut *problem, &settings, &guess).map(|found| found.point)
    });
    let why = match found {
        Ok(point) => {
            let period = point.solution.period().unwrap_or(0.0);
            if (period - cycle.period).abs() <= NEAR * cycle.period {
                return Ok(point);
            }
            format!("Newton's method leads from it to a cycle of the period {period:.6} instead of {:.6}", cycle.period)
        }
        Err(failure) => failure.to_string(),
    };
    let off = match mismatch(system.field, &seed.parameters, &given.solution) {
        Some((component, share)) => {
            let name = system.state_names.get(component).map_or("", String::as_str);
            format!("on it the equation of {name} is off by {share:.2} of its size")
        }
        None => "the equations are not finite on it".to_string(),
    };
    Err(format!(
        "no cycle was found next to the given one: {why}\nlikely cause: it is too far from any, or belongs to other equations or \
         parameters: {off}\nwhat to do: compare the equations, and which state and parameter is which; or give more states of it"
    ))
}
