//! A first torus from a quasi-periodic motion.
//!
//! **Idea.** Samples are integrated until one of them neither rests nor repeats itself and is recognised as
//! quasi-periodic (`recognition`). Trajectories from equally spaced points of its section are the first torus, from
//! which Newton's method starts.
//!
//! **Fails when** the torus is not attracting.

use super::driven::{Driven, with_clock, with_unit_scales};
use super::recognition::{Nature, Quasi, recognise};
use super::settling::{First, Trial, settle_together};
use super::{Limits, Sampling};
use crate::contract::{VectorField, Verdict};
use crate::diagram::{Motion, Recognition, Torus};
use crate::problem::torus::start;
use crate::simulation::{Clocked, Ensemble, Outcome, Tolerance};

/// Steps for which each sample settles before it is observed.
const SETTLING: usize = 100_000;
/// Number of samples integrated together.
const BLOCK: usize = 8;
/// Largest number of samples that are tried.
const TRIED: usize = 32;
/// Size of the harmonics that a first torus leaves out, relative to its extent.
const SMALL: f64 = 1e-7;
/// Relative accuracy of its trajectories.
const ACCURACY: f64 = 1e-10;

/// Returns a torus near the quasi-periodic motion to which one of the first initial states leads, with polynomials of that
/// degree, and what is known of it.
///
/// # Errors
/// Outcome of the samples instead.
pub fn first_torus(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    degree: usize,
) -> Result<(Torus, Recognition), String> {
    if field.second_phase().is_some() {
        return pulled_back(field, parameters, sampling, degree).map(|torus| (torus, Recognition::default()));
    }
    let unit = field.time_unit(parameters);
    let driven = Driven(field);
    let (own, sampling): (&dyn VectorField, Sampling) = match field.forced() {
        true => (&driven, with_clock(sampling, unit)),
        false => (field, sampling.clone()),
    };
    let scales =
        if field.forced() { with_unit_scales(&sampling.scales[..field.dim()]) } else { sampling.scales.clone() };
    let limits = Limits { steps: SETTLING, ..Limits::patient() };
    let trial = Trial { field: own, scales: &scales, whirl: None, jobs: 1, limits };
    let watched = Trial { limits: Limits::patient(), ..trial };
    let starts = sampling.starts();
    let n = own.dim();
    let tried = (starts.len() / n).min(TRIED);
    let (mut settled, mut escaped, mut chaotic, mut reasons) = (0, 0, 0, Vec::new());
    for block in starts[..tried * n].chunks(BLOCK * n) {
        for motion in settle_together(&trial, &parameters.repeat(block.len() / n), block, First::Rough, limits) {
            if field.ended() {
                return Err("the run is to end".into());
            }
            match motion.motion {
                Motion::Equilibrium | Motion::Cycle => settled += 1,
                Motion::Escaped | Motion::Chatter => escaped += 1,
                _ => {
                    let found = recognise(&watched, parameters, &motion.state, false);
                    match found.nature {
                        Nature::Torus(quasi) => {
                            return first(field, parameters, &scales, &quasi, degree)
                                .map(|torus| (torus, found.evidence))
                                .ok_or("the trajectories of its section could not be integrated".into());
                        }
                        Nature::Chaos => chaotic += 1,
                        Nature::Cycle(_) => settled += 1,
                        Nature::Lost(_) => escaped += 1,
                        Nature::Undecided => reasons.push(found.evidence.reason),
                    }
                }
            }
        }
    }
    let why = reasons.first().map(|why| format!(", the first because {why}")).unwrap_or_default();
    Err(format!(
        "no quasi-periodic motion was reached: of {tried} samples {settled} came to rest or to a cycle, {chaotic} to chaos, \
         {escaped} escaped, and {} were undecided{why}",
        reasons.len()
    ))
}

/// The torus of trajectories from equally spaced points of a section.
fn first(field: &dyn VectorField, parameters: &[f64], scales: &[f64], quasi: &Quasi, degree: usize) -> Option<Torus> {
    let n = field.dim();
    let harmonics = quasi.curve.coefficients.chunks_exact(n).rposition(|own| own.iter().any(|c| c.norm() > SMALL));
    let count = 2 * harmonics.unwrap_or(0).clamp(10, 100) + 1;
    let point = |k: usize| -> Vec<f64> {
        let scaled = quasi.curve.point(n, k as f64 / count as f64);
        scaled.iter().zip(&quasi.extent).map(|(x, extent)| x * extent).collect()
    };
    let like = Torus {
        period: quasi.interval * field.time_unit(parameters),
        rotation: quasi.curve.turn,
        forcing_periods: if field.forced() { quasi.turns as u32 } else { 0 },
        mesh: Default::default(),
        degree,
        profile: Vec::new(),
    };
    let all: Vec<f64> = (0..count).flat_map(point).collect();
    integrated(field, &parameters.repeat(count), scales, quasi.interval, (&all, like))
}

/// The torus of trajectories over a time from the points `[K][n]` of a section, each with its parameters `[K][k]`.
fn integrated(
    field: &dyn VectorField,
    parameters: &[f64],
    scales: &[f64],
    interval: f64,
    (points, like): (&[f64], Torus),
) -> Option<Torus> {
    let n = field.dim();
    let (count, width) = (points.len() / n, field.parameter_count());
    let clocked = Clocked(field);
    let (mut lines, mut most) = (Vec::new(), 0);
    for k in 0..count {
        let parameters = &parameters[k * width..(k + 1) * width];
        let start = [&points[k * n..(k + 1) * n], &[0.0]].concat();
        let absolute = scales[..n].iter().chain([&1.0]).map(|scale| ACCURACY * scale).collect();
        let tolerance = Tolerance { relative: ACCURACY, absolute };
        let mut line: Vec<(f64, Vec<f64>)> = Vec::new();
        let run = Ensemble::new(&clocked, parameters, tolerance, &start, [0.0, interval]);
        let arrival = run
            .run(&mut |step| {
                for part in 0..4 {
                    let theta = f64::from(part) / 4.0;
                    let mut x = vec![0.0; n + 1];
                    step.state_into(theta, &mut x);
                    x.truncate(n);
                    line.push((step.time_at(theta), x));
                }
                Verdict::Continue
            })
            .pop()?;
        if arrival.outcome.is_lost() {
            return None;
        }
        line.push((arrival.time, arrival.state[..n].to_vec()));
        most = most.max(line.len());
        lines.push(line);
    }
    let intervals = (most / 12).clamp(10, 200);
    Some(start::of_trajectories(like, n, count, intervals, |k, t, x| {
        // Linear between samples that are much denser than the nodes.
        let line = &lines[k];
        let time = t * interval;
        let at = line.partition_point(|(own, _)| *own <= time).clamp(1, line.len() - 1);
        let ((a, p), (b, q)) = (&line[at - 1], &line[at]);
        let share = ((time - a) / (b - a).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        x.iter_mut().zip(p.iter().zip(q)).for_each(|(x, (p, q))| *x = p + share * (q - p));
    }))
}

/// The response to two forcings: trajectories that began long before with the same state reach the section at t = 0 with
/// equally spaced phases of the second forcing.
fn pulled_back(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    degree: usize,
) -> Result<Torus, String> {
    /// Number of phases; continuation changes it.
    const PHASES: usize = 41;
    /// Numbers of forcing periods for which the trajectories run.
    const PERIODS: [f64; 4] = [50.0, 200.0, 800.0, 3200.0];
    /// Difference, relative to scale and size, at which two numbers of periods lead to the same section.
    const SAME: f64 = 1e-3;
    let Some(phase) = field.second_phase() else { return Err("there is no second forcing".into()) };
    let n = field.dim();
    let own = |k: usize| {
        let mut own = parameters.to_vec();
        own[phase] += k as f64 / PHASES as f64;
        own
    };
    let all: Vec<f64> = (0..PHASES).flat_map(own).collect();
    let clocked = Clocked(field);
    let starts = sampling.starts();
    let mut why = String::from("no sample was taken");
    for start in starts.chunks_exact(n).take(BLOCK) {
        let mut before: Option<Vec<f64>> = None;
        for periods in PERIODS {
            let begin: Vec<f64> = [start, &[-periods]].concat().repeat(PHASES);
            let absolute = sampling.scales.iter().chain([&1.0]).map(|scale| 1e-8 * scale).collect();
            let tolerance = Tolerance { relative: 1e-8, absolute };
            let run = Ensemble::with_own_parameters(&clocked, &all, tolerance, &begin, [0.0, periods]);
            let arrivals = run.with_step_limit(1_000_000).run(&mut |_| Verdict::Continue);
            if field.ended() {
                return Err("the run is to end".into());
            }
            if arrivals.iter().any(|own| own.outcome != Outcome::Reached) {
                why = "a trajectory escaped or took more than a million steps".into();
                break;
            }
            let section: Vec<f64> = arrivals.iter().flat_map(|own| own.state[..n].to_vec()).collect();
            let apart = |old: &Vec<f64>| {
                let each = old.iter().zip(&section).enumerate();
                each.map(|(k, (a, b))| (a - b).abs() / (sampling.scales[k % n] + b.abs())).fold(0.0, f64::max)
            };
            if before.as_ref().is_some_and(|old| apart(old) <= SAME) {
                let like = Torus {
                    period: field.time_unit(parameters),
                    rotation: field.second_turns(parameters).0,
                    forcing_periods: 1,
                    mesh: Default::default(),
                    degree,
                    profile: Vec::new(),
                };
                return integrated(field, &all, &sampling.scales, 1.0, (&section, like))
                    .ok_or("the trajectories of its section could not be integrated".into());
            }
            before = Some(section);
        }
        if before.is_some() {
            why = "the trajectories had not settled after 3200 periods of the first forcing".into();
        }
    }
    Err(format!("no torus was reached: {why}"))
}
