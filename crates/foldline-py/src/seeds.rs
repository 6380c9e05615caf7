//! First solutions, found where states settle.

use crate::bytes::{numbers, read};
use crate::failure;
use crate::model::Model;
use crate::patience::patiently;
use crate::solution::Solution;
use foldline::explore::{self, AttractorKey, SeedPlan, SeedSource, System};
use foldline_store::finite::never_finite;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// Finds the solution for an attractor's name (`equilibrium`, `cycle`, `2:1`) or from a state `[n]`.
#[pyfunction]
#[pyo3(signature = (model, attractor, state, parameters, samples, random, tolerance, jobs, limits))]
pub fn settle(
    py: Python,
    model: &Model,
    attractor: Option<&str>,
    state: &[u8],
    parameters: &[u8],
    samples: usize,
    random: u64,
    tolerance: f64,
    jobs: usize,
    limits: (Option<usize>, Option<f64>),
) -> PyResult<Solution> {
    let parameters = checked(py, model, parameters)?;
    let source = match attractor {
        Some("torus") => SeedSource::QuasiPeriodic,
        Some(name) => SeedSource::Attractor(key(py, model, name)?),
        None => SeedSource::State(read(state)),
    };
    let seed = SeedPlan { name: "start".into(), source, parameters, samples, random };
    let own = model.model.clone();
    let (found, _) = patiently(py, None, &mut |_| Ok(()), move || {
        explore::first_solution(&limited(System::of(&own, &seed.parameters), limits), &seed, tolerance, jobs)
    })?;
    found.map(|point| Solution::new(point, &model.model)).map_err(|why| failure::no_solution(py, why))
}

/// A solution, its ratio, the number of hits, the basin fraction with its confidence interval, and the first sample.
type Found<'py> = (Solution, Option<(u32, u32)>, usize, Option<(f64, f64, f64)>, Bound<'py, PyBytes>);

/// Finds the attractors that sampled states reach, each with its ratio, number of hits, basin fraction and first
/// sample; then the numbers of samples that escaped (to infinity or out of the domain of f), got stuck, and did not
/// settle.
#[pyfunction]
pub fn attractors<'py>(
    py: Python<'py>,
    model: &Model,
    parameters: &[u8],
    samples: usize,
    seed: u64,
    tolerance: f64,
    jobs: usize,
    limits: (Option<usize>, Option<f64>),
) -> PyResult<(Vec<Found<'py>>, (usize, usize, usize))> {
    let parameters = checked(py, model, parameters)?;
    let own = model.model.clone();
    let (census, _) = patiently(py, None, &mut |_| Ok(()), move || {
        explore::attractors(
            &limited(System::of(&own, &parameters), limits),
            &parameters,
            samples,
            seed,
            jobs,
            tolerance,
        )
    })?;
    let found = census.attractors.into_iter().map(|attractor| {
        let example = numbers(py, attractor.example.iter().copied())?;
        let share = attractor.share.map(|share| (share.value(), share.interval()[0], share.interval()[1]));
        Ok((Solution::new(attractor.point, &model.model), attractor.ratio, attractor.hits, share, example))
    });
    let escaped = census.escaped + census.exits.len();
    Ok((found.collect::<PyResult<_>>()?, (escaped, census.stuck, census.unsettled)))
}

/// Returns the system with other limits on trajectories if they are given: steps and time.
pub(crate) fn limited<'a>(mut system: System<'a>, (steps, time): (Option<usize>, Option<f64>)) -> System<'a> {
    system.limits.steps = steps.unwrap_or(system.limits.steps);
    system.limits.time = time.unwrap_or(system.limits.time);
    system
}

/// Returns the parameters after checking that the model is finite there for some state.
pub(crate) fn checked(py: Python, model: &Model, parameters: &[u8]) -> PyResult<Vec<f64>> {
    let parameters = read(parameters);
    match never_finite(&model.model, &parameters, &model.text, &model.file) {
        Some(found) => Err(failure::of_text(py, &[found])),
        None => Ok(parameters),
    }
}

fn key(py: Python, model: &Model, name: &str) -> PyResult<AttractorKey> {
    use foldline::contract::VectorField;
    let said = |message: String, cure: &str| Err(failure::of_argument(py, message, cure));
    let ratio = name.split_once(':').and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
    match (name, ratio) {
        ("fixed-point", _) if model.model.iterated() => Ok(AttractorKey::Lasting(1)),
        ("equilibrium", _) if model.model.iterated() => said(
            "the model is a map and has fixed points and cycles, but no equilibria".into(),
            "use \"fixed-point\", or \"cycle\" for a cycle of any number of iterates",
        ),
        ("equilibrium", _) if model.model.forced() => said(
            "the model is forced and has no equilibria".into(),
            "use \"cycle\": the response to forcing is a cycle",
        ),
        ("equilibrium", _) => Ok(AttractorKey::Equilibrium),
        ("cycle", _) => Ok(AttractorKey::Cycle),
        (_, Some((a, b))) if a > 0 && b > 0 => match model.model.whirl {
            Some(_) => Ok(AttractorKey::Ratio(a, b)),
            None => said(
                format!(
                    "the ratio \"{name}\" needs the two states of a whirling motion, which this model does not \
                         name"
                ),
                "name its two states, as in whirl=\"u v\", or ask for a \"cycle\"",
            ),
        },
        _ => said(
            format!("\"{name}\" is not an attractor"),
            "\"equilibrium\", \"cycle\", \"torus\", or a ratio of whole numbers such as \"2:1\"",
        ),
    }
}
