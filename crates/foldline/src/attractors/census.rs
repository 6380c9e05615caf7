//! From samples to attractors.

use super::candidate::Context;
use super::orbit::Orbit;
use super::watch::Watch;
use super::{Attractor, Census, Polish, Sampling, spectral_ratio};
use crate::contract::VectorField;
use crate::diagram::{Point, Solution};
use crate::simulation::{Ensemble, Outcome};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Trajectories that are integrated together and share what they find. Fixed, so that the result does not depend on the
/// number of threads.
const BLOCK: usize = 128;
/// Steps after which a trajectory counts as unsettled: some thousand periods.
const STEP_LIMIT: usize = 60_000;

/// What became of one trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    /// It went to the solution of that index.
    Settled(usize),
    Unsettled,
    Escaped,
}

/// The attractors reached from `sampling.samples` initial states.
///
/// `polish` computes a candidate by Newton's method; it is called from several threads.
pub fn survey(field: &dyn VectorField, parameters: &[f64], sampling: &Sampling, polish: Polish) -> Census {
    let n = field.dim();
    let context = Context { field, parameters, sampling, polish };
    let starts = sampling.starts();
    let blocks: Vec<&[f64]> = starts.chunks((BLOCK * n).max(1)).collect();
    let mut known: Vec<Orbit> = Vec::new();
    let mut hits: Vec<(usize, usize)> = Vec::new();
    let mut census = Census::default();
    for (block, (found, fates)) in watch_blocks(&context, &blocks).into_iter().enumerate() {
        // The same solution found in several blocks is one.
        let place: Vec<usize> = found
            .into_iter()
            .map(|orbit| {
                known.iter().position(|k| k.same(&orbit, sampling.tolerance)).unwrap_or_else(|| {
                    known.push(orbit);
                    hits.push((0, 0));
                    known.len() - 1
                })
            })
            .collect();
        for (lane, fate) in fates.into_iter().enumerate() {
            match fate {
                Fate::Settled(index) => {
                    let (count, first) = &mut hits[place[index]];
                    if *count == 0 {
                        *first = block * BLOCK + lane;
                    }
                    *count += 1;
                }
                Fate::Unsettled => census.unsettled += 1,
                Fate::Escaped => census.escaped += 1,
            }
        }
    }
    let mut reached: Vec<(Orbit, (usize, usize))> =
        known.into_iter().zip(hits).filter(|(_, (hits, _))| *hits > 0).collect();
    reached.sort_by(|(a, (a_hits, _)), (b, (b_hits, _))| {
        let key = |orbit: &Orbit| orbit.point.solution.period().unwrap_or_else(|| orbit.norm());
        let cycle = |orbit: &Orbit| orbit.point.solution.period().is_some();
        cycle(a).cmp(&cycle(b)).then(b_hits.cmp(a_hits)).then(key(a).total_cmp(&key(b)))
    });
    census.attractors = reached
        .into_iter()
        .map(|(orbit, (hits, first))| Attractor {
            ratio: ratio(&orbit.point, sampling.whirl),
            point: orbit.point,
            hits,
            example: starts[first * n..(first + 1) * n].to_vec(),
        })
        .collect();
    census
}

/// The attractor to which the trajectory from `start` `[n]` goes; `None` where it escapes or does not settle.
pub fn settle(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    start: &[f64],
    polish: Polish,
) -> Option<Point> {
    let (mut known, fates) = watch_block(&Context { field, parameters, sampling, polish }, start);
    match fates.first() {
        Some(Fate::Settled(index)) if *index < known.len() => Some(known.swap_remove(*index).point),
        _ => None,
    }
}

fn ratio(point: &Point, whirl: Option<[usize; 2]>) -> Option<(u32, u32)> {
    match &point.solution {
        Solution::Cycle(cycle) => spectral_ratio(cycle, whirl?),
        Solution::Equilibrium(_) => None,
    }
}

/// All blocks, in their order, over the threads asked for.
fn watch_blocks(context: &Context, blocks: &[&[f64]]) -> Vec<(Vec<Orbit>, Vec<Fate>)> {
    let jobs = context.sampling.jobs.min(blocks.len());
    if jobs <= 1 {
        return blocks.iter().map(|starts| watch_block(context, starts)).collect();
    }
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let block = next.fetch_add(1, Ordering::Relaxed);
            let Some(starts) = blocks.get(block) else { return done };
            done.push((block, watch_block(context, starts)));
        }
    };
    let mut done: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..jobs).map(|_| scope.spawn(work)).collect();
        threads
            .into_iter()
            .flat_map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect()
    });
    done.sort_by_key(|(block, _)| *block);
    done.into_iter().map(|(_, result)| result).collect()
}

/// Integrates trajectories together until each has settled, escaped or used up its steps.
fn watch_block(context: &Context, starts: &[f64]) -> (Vec<Orbit>, Vec<Fate>) {
    let n = context.field.dim();
    let mut known = Vec::new();
    let mut watches = vec![Watch::new(n); starts.len().checked_div(n).unwrap_or(0)];
    let ensemble = Ensemble::new(context.field, context.parameters, context.tolerance(), starts, [0.0, f64::INFINITY])
        .with_step_limit(STEP_LIMIT);
    let arrivals = ensemble.run(&mut |step| watches[step.trajectory()].observe(step, &mut known, context));
    let fates = arrivals.iter().zip(&watches).map(|(arrival, watch)| match (watch.settled, arrival.outcome) {
        (Some(index), _) => Fate::Settled(index),
        (None, Outcome::Escaped | Outcome::StepTooSmall) => Fate::Escaped,
        (None, _) => Fate::Unsettled,
    });
    let fates = fates.collect();
    (known, fates)
}
