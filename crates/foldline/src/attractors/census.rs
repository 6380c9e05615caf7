//! From samples to attractors.
//!
//! **Idea.** Samples are integrated in blocks. Solutions found in the first block are passed to the next ones, which
//! recognise them instead of finding them again; solutions found in a round of blocks are passed to the next round.

use super::candidate::Context;
use super::orbit::Orbit;
use super::settling::{First, Settled, Trial, settle_together};
use super::watch::{ARRIVED, RADII, WINDOW, Watch};
use super::{Attractor, Candidate, Census, Early, Enough, Exit, Fate, Limits, Polish, Sampling};
use crate::contract::{VectorField, Verdict};
use crate::diagram::{Motion, Point, Response, Share};
use crate::simulation::{Ensemble, Outcome};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Sampling settings, fixed for each type of survey so that the result does not depend on the number of threads.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    /// Number of trajectories that are integrated together and share the solutions they find.
    pub(super) block: usize,
    /// Relative accuracy of their integration.
    pub(super) accuracy: f64,
    /// Blocks per round after the first, which is one block, and after the second.
    rounds: [usize; 2],
    /// True if trajectories are decided early once enough is known; see [`super::survey_map`].
    map: bool,
}

impl Pace {
    /// For a survey of all samples, with the number of hits of each attractor.
    pub(super) const THOROUGH: Pace = Pace { block: 32, accuracy: 1e-6, rounds: [4, 4], map: false };
    /// For a search for certain attractors. Near a basin boundary a trajectory may end on the wrong side.
    pub(super) const BRIEF: Pace = Pace { block: 16, accuracy: 1e-5, rounds: [4, 4], map: false };
    /// For a map of basins: rounds long enough that threads rarely wait for each other.
    pub(super) const MAP: Pace = Pace { block: 256, accuracy: 1e-6, rounds: [4, 16], map: true };
}

/// In a map, one in this many trajectories is followed until it has settled although it could be decided early.
const CHECKED: usize = 64;
/// Number of decisions, all of them right, from which a distance is used: wrong ones are then fewer than 3 %, at a
/// confidence of 95 %.
const ENOUGH: usize = 100;
/// Default limit on the number of steps of a trajectory, beyond which it counts as unsettled: a few thousand periods.
pub(super) const STEP_LIMIT: usize = 60_000;
/// Least limit on the number of steps of a single trajectory: some ten bursts of a few hundred stiff spikes, a few
/// seconds of a processor.
pub(crate) const PERSISTENT: usize = 1_000_000;

/// A solution and its hits.
struct Reached {
    orbit: Orbit,
    hits: usize,
    /// Number of uniformly distributed samples among them.
    uniform: usize,
    /// Index of the first of them.
    first: usize,
    /// Number in the order of discovery.
    number: usize,
    /// Early decisions for it, about trajectories that were followed until they had settled.
    forecasts: Forecasts,
}

/// Decisions at each distance of [`RADII`].
#[derive(Clone, Copy, Debug, Default)]
struct Forecasts {
    made: [usize; RADII.len()],
    wrong: [usize; RADII.len()],
}

impl Forecasts {
    /// Index of the largest distance at which enough decisions were made and all were right.
    fn radius(&self) -> Option<usize> {
        (0..RADII.len()).find(|&k| self.made[k] >= ENOUGH && self.wrong[k] == 0)
    }
}

/// Observation of the trajectories of a round.
#[derive(Clone, Copy, Debug, Default)]
struct Manner {
    /// Number of steps during which a trajectory is only compared with known solutions.
    patience: usize,
    /// True if most are decided early.
    early: bool,
}

/// Samples the attractors of an autonomous field; see [`super::survey_until`].
pub(super) fn survey(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    polish: Polish,
    (pace, enough): (Pace, Enough),
) -> Census {
    let n = field.dim();
    let Pace { block, accuracy, rounds, map } = pace;
    let context = Context { field, parameters, sampling, polish, accuracy };
    let starts = sampling.starts();
    let blocks: Vec<&[f64]> = starts.chunks((block * n).max(1)).collect();
    let mut reached: Vec<Reached> = Vec::new();
    let mut census = Census::default();
    let (mut taken, mut ended) = (0, false);
    let (mut manner, mut rounds_done) = (Manner::default(), 0);
    while taken < blocks.len() && !ended && !field.ended() {
        let round = [1, rounds[0], rounds[1]][rounds_done.min(2)].min(blocks.len() - taken);
        for watched in watch_blocks(&context, &blocks[taken..taken + round], &reached, enough, manner) {
            ended = watched.ended;
            // Decisions of the first round were made when few solutions were known.
            let counts = rounds_done > 0;
            add(watched, taken * block, (&mut reached, &mut census, counts), sampling.tolerance);
            taken += 1;
        }
        rounds_done += 1;
        if map && rounds_done == 2 {
            manner = Manner { patience: patience(sampling.limits.steps), early: true };
            reached.iter_mut().for_each(|known| known.orbit.early = known.forecasts.radius());
        }
    }
    census.left += sampling.samples.saturating_sub(taken * block);
    // A lower limit was asked for.
    let limited = sampling.limits.steps < STEP_LIMIT;
    if block == Pace::BRIEF.block && !limited && !ended && !field.ended() {
        follow_one(&context, &starts, &mut reached, &mut census);
    }
    // Solutions that no sample reached count only if the survey ended early and none of their type was reached.
    let kinds =
        [false, true].map(|cycle| reached.iter().any(|known| known.orbit.is_cycle() == cycle && known.hits > 0));
    reached.retain(|known| {
        known.hits > 0 || ended && known.orbit.attracts() && !kinds[usize::from(known.orbit.is_cycle())]
    });
    reached.sort_by(|a, b| {
        let key = |known: &Reached| known.orbit.point.solution.period().unwrap_or_else(|| known.orbit.norm());
        let cycle = |known: &Reached| known.orbit.point.solution.period().is_some();
        cycle(a).cmp(&cycle(b)).then(b.hits.cmp(&a.hits)).then(key(a).total_cmp(&key(b)))
    });
    let mut place = vec![usize::MAX; reached.iter().map(|known| known.number + 1).max().unwrap_or(0)];
    reached.iter().enumerate().for_each(|(k, known)| place[known.number] = k);
    for fate in &mut census.fates {
        if let Fate::Settled(number) = fate {
            *number = place[*number];
        }
    }
    census.early = manner.early.then(|| {
        let decided = || reached.iter().filter_map(|known| Some((known.orbit.early?, known.forecasts)));
        Early {
            radii: reached.iter().map(|known| known.orbit.early.map(|k| RADII[k])).collect(),
            checked: decided().map(|(k, forecasts)| forecasts.made[k]).sum(),
            wrong: decided().map(|(k, forecasts)| forecasts.wrong[k]).sum(),
        }
    });
    let of = sampling.uniform();
    let whole = census.left == 0 && of > 0;
    census.attractors = reached
        .into_iter()
        .map(|known| Attractor {
            share: whole.then_some(Share { hits: known.uniform, of }),
            example: match known.hits {
                0 => known.orbit.start().to_vec(),
                _ => starts[known.first * n..(known.first + 1) * n].to_vec(),
            },
            ratio: known.orbit.ratio,
            point: known.orbit.point,
            hits: known.hits,
        })
        .collect();
    census
}

/// Number of steps during which trajectories of a map are only compared with known solutions: whole windows.
fn patience(limit: usize) -> usize {
    limit / 2 / WINDOW * WINDOW
}

/// Adds the outcome of a block whose samples are numbered from `first`.
fn add(
    watched: Watched,
    first: usize,
    (reached, census, counts): (&mut Vec<Reached>, &mut Census, bool),
    tolerance: f64,
) {
    census.exits.extend(watched.exits);
    // A solution found in several blocks counts once.
    let place: Vec<usize> = watched
        .orbits
        .into_iter()
        .map(|orbit| {
            reached.iter().position(|known| known.orbit.same(&orbit, tolerance)).unwrap_or_else(|| {
                reached.push(Reached {
                    orbit,
                    hits: 0,
                    uniform: 0,
                    first: 0,
                    number: reached.len(),
                    forecasts: Forecasts::default(),
                });
                reached.len() - 1
            })
        })
        .collect();
    if counts {
        for (forecast, fate) in watched.forecasts.iter().zip(&watched.fates) {
            for (k, solution) in forecast.iter().enumerate() {
                let Some(solution) = solution else { continue };
                let right = matches!(fate, Fate::Settled(index) if place[*index] == place[*solution]);
                let own = &mut reached[place[*solution]].forecasts;
                own.made[k] += 1;
                own.wrong[k] += usize::from(!right);
            }
        }
    }
    for (lane, fate) in watched.fates.into_iter().enumerate() {
        census.fates.push(match fate {
            Fate::Settled(index) => Fate::Settled(place[index]),
            other => other,
        });
        match fate {
            Fate::Settled(index) => {
                let known = &mut reached[place[index]];
                if known.hits == 0 {
                    known.first = first + lane;
                }
                known.hits += 1;
                known.uniform += usize::from(Sampling::is_uniform(first + lane));
            }
            Fate::Unsettled => census.unsettled += 1,
            Fate::Escaped => census.escaped += 1,
            // Already counted in `exits`.
            Fate::Undefined => {}
            Fate::Stuck => census.stuck += 1,
            Fate::Chatter => census.chattered += 1,
            Fate::Left => census.left += 1,
        }
    }
}

/// Outcome of a trajectory that led to no attractor.
#[derive(Clone, Debug, PartialEq)]
pub enum Lost {
    /// It did not settle within the limit on the number of steps.
    Unsettled {
        /// Integration time, in the time units of the model.
        time: f64,
        /// `[n]` extent of its motion at the end.
        extent: Vec<f64>,
        /// `[n]` its last state.
        state: Vec<f64>,
    },
    /// It settled to a motion that Newton's method does not confirm as an isolated, stable solution.
    Unconfirmed {
        /// Period in the time units of the model; 0 for a state of rest.
        period: f64,
        /// `[n]` a state of the motion.
        state: Vec<f64>,
    },
    /// A state grew without bound.
    Escaped,
    /// It left the region in which f is defined.
    Undefined(Exit),
    /// The step size became too small: f jumps, or is too stiff.
    Stuck,
    /// Events accumulate.
    Chatter,
}

impl Lost {
    /// Outcome of a trajectory that was not integrated.
    fn nothing(start: &[f64]) -> Lost {
        Lost::Unsettled { time: 0.0, extent: vec![0.0; start.len()], state: start.to_vec() }
    }
}

/// Returns the attractor of an autonomous field for one initial state; see [`super::settle`].
pub(super) fn settle(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    start: &[f64],
    polish: Polish,
) -> Result<Point, Lost> {
    let context = Context { field, parameters, sampling, polish, accuracy: Pace::THOROUGH.accuracy };
    let mut watched = watch_block(&context, start, (0, &[]), &|_| false, Manner::default());
    match watched.fates.first() {
        Some(Fate::Settled(index)) if *index < watched.orbits.len() => Ok(watched.orbits.swap_remove(*index).point),
        Some(Fate::Unsettled) => patiently(&context, start, watched.orbits),
        Some(Fate::Escaped) => Err(Lost::Escaped),
        Some(Fate::Undefined) => Err(watched.exits.pop().map_or(Lost::Escaped, Lost::Undefined)),
        Some(Fate::Stuck) => Err(Lost::Stuck),
        Some(Fate::Chatter) => Err(Lost::Chatter),
        _ => Err(Lost::nothing(start)),
    }
}

/// Follows the first trajectory that did not settle much further, for a search that has not found what it needs: to a
/// burst of many spikes, which takes more steps than the limit on all samples.
fn follow_one(context: &Context, starts: &[f64], reached: &mut Vec<Reached>, census: &mut Census) {
    let Some(sample) = census.fates.iter().position(|fate| *fate == Fate::Unsettled) else { return };
    let Sampling { scales, whirl, tolerance, .. } = context.sampling;
    let n = scales.len();
    let known = reached.iter().map(|known| known.orbit.clone()).collect();
    let Ok(point) = patiently(context, &starts[sample * n..(sample + 1) * n], known) else { return };
    let orbit = Orbit::new(point, scales, *whirl);
    let watched = Watched {
        fates: vec![Fate::Settled(0)],
        orbits: vec![orbit],
        exits: Vec::new(),
        forecasts: Vec::new(),
        ended: false,
    };
    census.unsettled -= 1;
    add(watched, sample, (reached, census, false), *tolerance);
    // The sample keeps its place among the fates.
    census.fates.swap_remove(sample);
}

/// Finds the attractor by simulation alone, except for the last Newton steps. `known` are solutions found on the way,
/// none of which was observed to attract this trajectory.
fn patiently(context: &Context, start: &[f64], known: Vec<Orbit>) -> Result<Point, Lost> {
    let Sampling { scales, whirl, limits, .. } = context.sampling;
    let limits = Limits { steps: limits.steps.max(PERSISTENT), ..*limits };
    let trial = Trial { field: context.field, scales, whirl: *whirl, jobs: 1, limits };
    let settled = settle_together(&trial, context.parameters, start, First::Accurate, limits).pop();
    let settled = settled.ok_or(Lost::nothing(start))?;
    let here = |orbit: &Orbit| {
        let period = orbit.point.solution.period().unwrap_or(0.0);
        (period - settled.period).abs() <= ARRIVED * settled.period && orbit.distance(&settled.state) <= ARRIVED
    };
    if settled.motion == Motion::Cycle
        && let Some(orbit) = known.into_iter().find(here)
    {
        return Ok(orbit.point);
    }
    let candidate = match settled.motion {
        Motion::Equilibrium => Candidate::Equilibrium(settled.state.clone()),
        Motion::Cycle => context.turn(&settled.state, settled.period),
        Motion::Chatter => return Err(Lost::Chatter),
        Motion::Escaped if settled.state.iter().all(|x| x.abs() < Response::UNBOUNDED) => return Err(Lost::Stuck),
        Motion::Escaped => return Err(Lost::Escaped),
        // Settling names no other types.
        Motion::Other | Motion::Torus | Motion::Chaos => {
            let Settled { time, extent, state, .. } = settled;
            return Err(Lost::Unsettled { time, extent, state });
        }
    };
    let found = context.polished(&candidate).map(|orbit| orbit.point);
    found.ok_or(Lost::Unconfirmed { period: settled.period, state: settled.state })
}

/// Returns the results of the blocks of a round in order, up to the first that ended the survey; uses several threads.
fn watch_blocks(
    context: &Context,
    blocks: &[&[f64]],
    reached: &[Reached],
    enough: Enough,
    manner: Manner,
) -> Vec<Watched> {
    let (next, last) = (AtomicUsize::new(0), AtomicUsize::new(usize::MAX));
    let work = || {
        let mut done = Vec::new();
        loop {
            let block = next.fetch_add(1, Ordering::Relaxed);
            let going = block <= last.load(Ordering::Relaxed) && !context.field.ended();
            let Some(starts) = blocks.get(block).filter(|_| going) else { return done };
            let watched = watch_block(context, starts, (block, reached), enough, manner);
            if watched.ended {
                last.fetch_min(block, Ordering::Relaxed);
            }
            done.push((block, watched));
        }
    };
    let jobs = context.sampling.jobs.min(blocks.len());
    let mut done = match jobs {
        0 | 1 => work(),
        _ => std::thread::scope(|scope| {
            let threads: Vec<_> = (0..jobs).map(|_| scope.spawn(work)).collect();
            threads
                .into_iter()
                .flat_map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
                .collect()
        }),
    };
    done.sort_by_key(|(block, _)| *block);
    let last = last.into_inner();
    done.into_iter().filter(|(block, _)| *block <= last).map(|(_, watched)| watched).collect()
}

/// Results of a block.
struct Watched {
    /// Solutions known before, then those found in this block.
    orbits: Vec<Orbit>,
    fates: Vec<Fate>,
    /// Exits of the trajectories that left the region in which f is defined.
    exits: Vec<Exit>,
    /// Early decisions about those that were followed further.
    forecasts: Vec<[Option<usize>; RADII.len()]>,
    /// True if everything requested has been found.
    ended: bool,
}

/// Integrates trajectories together until each has settled, escaped or used up its steps, or until enough is known.
fn watch_block(
    context: &Context,
    starts: &[f64],
    (block, reached): (usize, &[Reached]),
    enough: Enough,
    manner: Manner,
) -> Watched {
    let n = context.field.dim();
    let mut orbits: Vec<Orbit> = reached.iter().map(|known| known.orbit.clone()).collect();
    let mut hit: Vec<bool> = reached.iter().map(|known| known.hits > 0).collect();
    let mut watches = vec![Watch::new(n); starts.len().checked_div(n).unwrap_or(0)];
    // Another one in each block, so that they do not form a pattern.
    let checked = |lane: usize| (lane + 7 * block).is_multiple_of(CHECKED);
    for (lane, watch) in watches.iter_mut().enumerate() {
        watch.patience = manner.patience;
        watch.early = manner.early && !checked(lane);
    }
    let (count, mut settled, mut ended) = (watches.len(), 0, false);
    let suffices = |orbits: &[Orbit], hit: &[bool], half: bool| {
        let sorts: Vec<Sort> =
            orbits.iter().map(|orbit| Sort { cycle: orbit.is_cycle(), attracts: orbit.attracts() }).collect();
        let counts = counted(&sorts, hit, half);
        let found = orbits.iter().zip(counts).filter(|(_, counts)| *counts);
        enough(&found.map(|(orbit, _)| (&orbit.point, orbit.ratio)).collect::<Vec<_>>())
    };
    let Limits { steps, time } = context.sampling.limits;
    let ensemble = Ensemble::new(context.field, context.parameters, context.tolerance(), starts, [0.0, time])
        .with_step_limit(steps);
    let arrivals = ensemble.run(&mut |step| {
        if ended {
            return Verdict::Stop;
        }
        let watch = &mut watches[step.trajectory()];
        let verdict = watch.observe(step, &mut orbits, context);
        if watch.settled.is_some() || orbits.len() > hit.len() {
            hit.resize(orbits.len(), false);
            if let Some(index) = watch.settled {
                hit[index] = true;
                settled += 1;
            }
            ended = 2 * settled >= count && suffices(&orbits, &hit, true);
        }
        verdict
    });
    let fates = arrivals.iter().zip(&watches).map(|(arrival, watch)| match (watch.settled, arrival.outcome) {
        (Some(index), _) => Fate::Settled(index),
        (None, Outcome::Stopped) => Fate::Left,
        (None, Outcome::Escaped) => Fate::Escaped,
        (None, Outcome::Undefined) => Fate::Undefined,
        (None, Outcome::StepTooSmall) => Fate::Stuck,
        (None, Outcome::Chatter) => Fate::Chatter,
        (None, _) => Fate::Unsettled,
    });
    let fates: Vec<Fate> = fates.collect();
    let left = arrivals.iter().zip(&fates).filter(|(_, fate)| **fate == Fate::Undefined);
    let exits = left.map(|(arrival, _)| Exit { time: arrival.time, state: arrival.state.clone() }).collect();
    hit.resize(orbits.len(), false);
    ended |= suffices(&orbits, &hit, 2 * settled >= count);
    let forecasts = watches.iter().map(|watch| if watch.early { Default::default() } else { watch.forecasts() });
    let forecasts = forecasts.collect();
    Watched { orbits, fates, exits, forecasts, ended }
}

/// Properties of a solution on which [`counted`] depends.
#[derive(Clone, Copy, Debug)]
struct Sort {
    cycle: bool,
    /// True if its spectrum clearly shows that it attracts.
    attracts: bool,
}

/// Returns for each known solution whether it counts as reached: if a trajectory was observed to settle on it or, once
/// half of the trajectories have settled, if it clearly attracts and is the only known equilibrium or the only known
/// cycle. With several of one type, the samples decide which of them a seed means.
fn counted(sorts: &[Sort], hit: &[bool], half: bool) -> Vec<bool> {
    let alone = |sort: &Sort| sorts.iter().filter(|other| other.cycle == sort.cycle).count() == 1;
    sorts.iter().zip(hit).map(|(sort, hit)| *hit || half && sort.attracts && alone(sort)).collect()
}

#[cfg(test)]
mod tests {
    use super::{Sort, counted};

    #[test]
    fn an_unreached_solution_counts_only_if_it_is_the_only_one_of_its_type() {
        let [rest, cycle] = [false, true].map(|cycle| Sort { cycle, attracts: true });
        let doubtful = Sort { attracts: false, ..rest };
        assert_eq!(counted(&[rest, cycle], &[false, false], true), [true, true]);
        assert_eq!(counted(&[rest, cycle], &[false, true], false), [false, true], "before half have settled");
        assert_eq!(counted(&[rest, rest, cycle], &[false, true, false], true), [false, true, true]);
        assert_eq!(counted(&[rest, rest], &[false, false], true), [false, false]);
        assert_eq!(counted(&[doubtful], &[false], true), [false]);
        assert_eq!(counted(&[doubtful], &[true], false), [true]);
    }
}
