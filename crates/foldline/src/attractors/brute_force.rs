//! Brute force: simulation from many initial states at many parameter values, and stepped sweeps.
//!
//! **Idea.** A survey lets many initial states settle at every parameter value and counts motions that agree as one. A
//! stepped sweep lets one trajectory settle at the first value and restarts at each following value from its last
//! state. Neither uses branches: a motion is recorded as the trajectory shows it (`settling`, `measure`).

use super::angles::{self, Rolled};
use super::measure::{Measured, response};
use super::recognition::{Found, Nature};
use super::same::Track;
use super::settling::{First, Settled, Trial, settle_or_recognise};
use super::{Candidate, Sampling, driven, iterated};
use crate::contract::Verdict;
use crate::diagram::{Motion, Recognition, Response, Share};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Number of trajectories integrated together.
const BLOCK: usize = 64;
/// Tolerance within which motions are the same: in their period, and in the ranges of states relative to scale and
/// size. Cycles that agree in both must also pass through the same states (`same`): two coupled oscillators in phase
/// and in antiphase agree in all ranges.
pub(super) const SAME: f64 = 1e-4;

/// Receives the responses at one value as soon as they are known.
pub type Report<'a> = &'a (dyn Fn(&[Response]) -> Verdict + Sync);

/// Compares a motion of a sweep, at the parameter values `[k]`, with the one before: `Some(true)` if it is a different
/// solution, `None` if that is not known, for example because the motion is neither at rest nor periodic and so has no
/// candidate.
pub type Compare<'a> = &'a mut dyn FnMut(&[f64], Option<&Candidate>) -> Option<bool>;

/// Returns the motions at every one of `values` of the parameter `free`, with the other parameters from `parameters`
/// `[k]` and initial states from `sampling`. Values are reported in the order in which they finish and returned in
/// their own order. At each value the motion reached most often comes first. If `report` asks to stop, the values in
/// progress are the last.
pub fn survey_by_simulation(
    trial: &Trial,
    sampling: &Sampling,
    parameters: &[f64],
    free: usize,
    values: &[f64],
    report: Report,
) -> Vec<Response> {
    if let Some(rolled) = Rolled::new(trial.field).filter(|_| !trial.field.iterated()) {
        return angles::survey_by_simulation(&rolled, trial, sampling, (parameters, free, values), report);
    }
    if trial.field.forced() && !trial.field.iterated() {
        let sampling = driven::with_clock(sampling, 1.0);
        return driven::simulate(trial, report, |trial, report| {
            survey_by_simulation(trial, &sampling, parameters, free, values, report)
        });
    }
    let starts = sampling.starts();
    let n = trial.field.dim();
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let done: Mutex<Vec<(usize, Vec<Response>)>> = Mutex::new(Vec::new());
    let work = || {
        while !stop.load(Ordering::Relaxed) {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(&value) = values.get(index) else { return };
            let mut own = parameters.to_vec();
            own[free] = value;
            let of = sampling.uniform();
            let share = |number: usize| (of > 0).then_some(Share { hits: Sampling::is_uniform(number).into(), of });
            if trial.field.iterated() {
                let found = iterated::settled(trial, &own, &starts, free).into_iter().enumerate();
                let found = grouped(trial, &own, found.map(|(k, own)| (Response { share: share(k), ..own }, None)));
                if report(&found) == Verdict::Stop {
                    stop.store(true, Ordering::Relaxed);
                }
                if let Ok(mut done) = done.lock() {
                    done.push((index, found));
                }
                continue;
            }
            let settled: Vec<Settled> = starts
                .chunks((BLOCK * n).max(1))
                .take_while(|_| !trial.field.ended())
                .flat_map(|block| settle_or_recognise(trial, &own, block, First::Rough))
                .collect();
            let mut seen = Vec::new();
            let counted = |(number, settled): (usize, Settled)| {
                let settled = like_another(settled, &seen);
                let Measured { response: found, track, .. } = response(trial, &own, free, &settled);
                if matches!(found.motion, Motion::Chaos | Motion::Other) {
                    seen.push((settled.extent, found.motion, found.recognition.clone()));
                }
                (Response { share: share(number), ..found }, track)
            };
            let found = grouped(trial, &own, settled.into_iter().enumerate().map(counted));
            if report(&found) == Verdict::Stop {
                stop.store(true, Ordering::Relaxed);
            }
            if let Ok(mut done) = done.lock() {
                done.push((index, found));
            }
        }
    };
    std::thread::scope(|scope| (0..trial.jobs.clamp(1, values.len().max(1))).for_each(|_| drop(scope.spawn(work))));
    let mut done = done.into_inner().unwrap_or_default();
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().flat_map(|(_, found)| found).collect()
}

/// Gives a motion that has not settled the type of one that was followed further at the same parameters, if their extents
/// agree: recognition takes a hundred times as long as settling, and many starts lead to one chaotic attractor.
fn like_another(settled: Settled, seen: &[(Vec<f64>, Motion, Recognition)]) -> Settled {
    /// Largest difference of the extents, which fluctuate from record to record.
    const ALIKE: f64 = 0.2;
    if settled.motion != Motion::Other || settled.found.is_some() {
        return settled;
    }
    let alike = |extent: &[f64]| extent.iter().zip(&settled.extent).all(|(a, b)| (a - b).abs() <= ALIKE * a.max(*b));
    let Some((_, motion, evidence)) = seen.iter().find(|(extent, ..)| alike(extent)) else { return settled };
    let nature = if *motion == Motion::Chaos { Nature::Chaos } else { Nature::Undecided };
    let found = Found { nature, evidence: evidence.clone(), state: settled.state.clone() };
    Settled { found: Some(Box::new(found)), ..settled }
}

/// Merges responses that agree into one, sorted by decreasing number of hits. Cycles of a vector field come with their
/// tracks.
fn grouped(trial: &Trial, parameters: &[f64], all: impl Iterator<Item = (Response, Option<Track>)>) -> Vec<Response> {
    let mut found: Vec<(Response, Option<Track>)> = Vec::new();
    for (response, track) in all {
        let along = |known: &(Response, Option<Track>)| match (&known.1, &track) {
            (Some(known), Some(track)) => track.follows(known),
            _ => iterated::alike(trial, parameters, &known.0, &response),
        };
        match found.iter_mut().find(|known| agree(trial, &known.0, &response) && along(known)) {
            Some((known, _)) => {
                known.hits += 1;
                if let (Some(known), Some(own)) = (&mut known.share, response.share) {
                    known.hits += own.hits;
                }
                known.settled_after = known.settled_after.max(response.settled_after);
                // For a motion without a period, each record covers only part of it.
                if matches!(known.motion, Motion::Torus | Motion::Chaos | Motion::Other) {
                    for (a, b) in known.ranges.iter_mut().zip(&response.ranges) {
                        *a = [a[0].min(b[0]), a[1].max(b[1])];
                    }
                }
            }
            None => found.push((response, track)),
        }
    }
    let mut found: Vec<Response> = found.into_iter().map(|(response, _)| response).collect();
    found.sort_by_key(|response| std::cmp::Reverse(response.hits));
    found
}

fn agree(trial: &Trial, a: &Response, b: &Response) -> bool {
    if a.motion != b.motion {
        return false;
    }
    // Outputs follow from the states, and their scale is unknown.
    let close = |tolerance: f64| {
        a.ranges.iter().zip(&b.ranges).zip(trial.scales).all(|((p, q), scale)| {
            let size = scale.max(p[0].abs()).max(p[1].abs());
            (p[0] - q[0]).abs() <= tolerance * size && (p[1] - q[1]).abs() <= tolerance * size
        })
    };
    let turn = |own: &Response| own.recognition.rotation;
    match (a.period, b.period) {
        // Each record covers a torus only partly.
        (Some(p), Some(q)) if a.motion == Motion::Torus => {
            let same =
                turn(a).zip(turn(b)).is_some_and(|([x, e], [y, f])| (x - y).abs() <= SAME * SAME + 3.0 * (e + f));
            (p - q).abs() <= SAME * p && same && close(0.2)
        }
        (Some(p), Some(q)) => (p - q).abs() <= SAME * p && close(SAME),
        // Records of chaotic motion agree only roughly.
        (None, None) if a.motion != Motion::Equilibrium => close(0.2),
        (None, None) => close(SAME),
        _ => false,
    }
}

/// Returns the responses of a stepped sweep: at the first of `values`, the motion to which the trajectory from `start`
/// `[n]` settles; at each following value, the motion to which it settles from its last state. The sweep ends early at
/// a motion that escapes or ends in chatter, or when `report` asks to stop. `compare` distinguishes jumps from steep slopes.
pub fn stepped_sweep(
    trial: &Trial,
    parameters: &[f64],
    free: usize,
    values: &[f64],
    start: &[f64],
    compare: Compare,
    report: Report,
) -> Vec<Response> {
    if trial.field.iterated() {
        return iterated::stepped_sweep(trial, parameters, free, values, start, compare, report);
    }
    if let Some(rolled) = Rolled::new(trial.field) {
        return angles::stepped_sweep(&rolled, trial, (parameters, free, values), start, compare, report);
    }
    if trial.field.forced() {
        let (start, n) = ([start, &[1.0, 0.0]].concat(), trial.field.dim());
        let mut compare = |own: &[f64], candidate: Option<&Candidate>| {
            compare(own, candidate.and_then(|candidate| driven::without_circle(candidate, n)).as_ref())
        };
        return driven::simulate(trial, report, |trial, report| {
            stepped_sweep(trial, parameters, free, values, &start, &mut compare, report)
        });
    }
    let mut found: Vec<Response> = Vec::new();
    let (mut own, mut state) = (parameters.to_vec(), start.to_vec());
    for &value in values {
        own[free] = value;
        let Some(settled) = settle_or_recognise(trial, &own, &state, First::Accurate).pop() else { break };
        let Measured { mut response, candidate, .. } = response(trial, &own, free, &settled);
        response.jumped = compare(&own, candidate.as_ref());
        state.clone_from(&response.state);
        let stopped = report(std::slice::from_ref(&response)) == Verdict::Stop;
        let over = stopped || response.motion.is_lost();
        found.push(response);
        if over {
            break;
        }
    }
    found
}
