//! A first torus from a quasi-periodic motion.
//!
//! **Idea.** Samples are integrated until one of them neither rests nor repeats itself and is recognised as quasi-periodic
//! (`recognition`). Trajectories from equally spaced points of its section are the first torus, from which Newton's method
//! starts.
//!
//! **Fails when** the torus does not attract.

use super::driven::{Driven, with_clock, with_unit_scales};
use super::recognition::{Nature, Quasi, recognise};
use super::settling::{First, Trial, settle_together};
use super::{Limits, Sampling};
use crate::contract::{VectorField, Verdict};
use crate::diagram::{Motion, Recognition, Torus};
use crate::problem::torus::start;
use crate::simulation::{Clocked, Ensemble, Tolerance};

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
/// What the samples led to instead.
pub fn first_torus(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    degree: usize,
) -> Result<(Torus, Recognition), String> {
    let unit = field.time_unit(parameters);
    let driven = Driven(field);
    let (own, sampling): (&dyn VectorField, Sampling) = match field.forced() {
        true => (&driven, with_clock(sampling, unit)),
        false => (field, sampling.clone()),
    };
    let scales = if field.forced() { with_unit_scales(&sampling.scales[..field.dim()]) } else { sampling.scales.clone() };
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
                Motion::Escaped => escaped += 1,
                _ => {
                    let found = recognise(&watched, parameters, &motion.state);
                    match found.nature {
                        Nature::Torus(quasi) => {
                            return first(field, parameters, &scales, &quasi, degree)
                                .map(|torus| (torus, found.evidence))
                                .ok_or("the trajectories of its section could not be integrated".into());
                        }
                        Nature::Chaos => chaotic += 1,
                        Nature::Cycle(_) => settled += 1,
                        Nature::Lost => escaped += 1,
                        Nature::Undecided => reasons.push(found.evidence.reason),
                    }
                }
            }
        }
    }
    let why = reasons.first().map(|why| format!(", the first because {why}")).unwrap_or_default();
    Err(format!(
        "no quasi-periodic motion was reached: of {tried} samples {settled} came to rest or to a cycle, {chaotic} to chaos, \
         {escaped} escaped, and {} could not be told{why}",
        reasons.len()
    ))
}

/// The torus of trajectories from equally spaced points of a section.
fn first(
    field: &dyn VectorField,
    parameters: &[f64],
    scales: &[f64],
    quasi: &Quasi,
    degree: usize,
) -> Option<Torus> {
    let n = field.dim();
    let harmonics = quasi.curve.coefficients.chunks_exact(n).rposition(|own| own.iter().any(|c| c.norm() > SMALL));
    let count = 2 * harmonics.unwrap_or(0).clamp(10, 100) + 1;
    let point = |k: usize| -> Vec<f64> {
        let scaled = quasi.curve.point(n, k as f64 / count as f64);
        scaled.iter().zip(&quasi.extent).map(|(x, extent)| x * extent).collect()
    };
    let clocked = Clocked(field);
    let (mut lines, mut most) = (Vec::new(), 0);
    for k in 0..count {
        let start = [point(k), vec![0.0]].concat();
        let absolute = scales[..n].iter().chain([&1.0]).map(|scale| ACCURACY * scale).collect();
        let tolerance = Tolerance { relative: ACCURACY, absolute };
        let mut line: Vec<(f64, Vec<f64>)> = Vec::new();
        let run = Ensemble::new(&clocked, parameters, tolerance, &start, [0.0, quasi.interval]);
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
    let unit = field.time_unit(parameters);
    let like = Torus {
        period: quasi.interval * unit,
        rotation: quasi.curve.turn,
        forcing_periods: if field.forced() { quasi.turns as u32 } else { 0 },
        mesh: Default::default(),
        degree,
        profile: Vec::new(),
    };
    Some(start::of_trajectories(like, n, count, intervals, |k, t, x| {
        // Linear between samples that are much denser than the nodes.
        let line = &lines[k];
        let time = t * quasi.interval;
        let at = line.partition_point(|(own, _)| *own <= time).clamp(1, line.len() - 1);
        let ((a, p), (b, q)) = (&line[at - 1], &line[at]);
        let share = ((time - a) / (b - a).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        x.iter_mut().zip(p.iter().zip(q)).for_each(|(x, (p, q))| *x = p + share * (q - p));
    }))
}
