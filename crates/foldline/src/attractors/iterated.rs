//! Attractors and simulation of maps.
//!
//! **Idea.** Initial states are iterated together. After each of a few ever longer stretches their last iterates are
//! examined: an orbit has settled when it repeats itself within [`REPEATS`]. A search for attractors then computes the
//! cycle by Newton's method; an orbit that contracts so slowly that it does not repeat itself within the limit is taken
//! to the cycle near it. A survey or sweep records the iterates as they are.
//!
//! **Fails when** an attractor is not a cycle of at most [`LONGEST`] iterates: its orbits count as unsettled.

use super::brute_force::{Compare, Report, SAME};
use super::census::Lost;
use super::recognition::{Nature, recognise};
use super::settling::Trial;
use super::{Attractor, Candidate, Census, Enough, Exit, Fate, Limits, Polish, Sampling};
use crate::contract::{Batch, Parameters, VectorField, Verdict};
use crate::diagram::{Motion, Point, Response, Share, Solution};
use crate::problem::map::transposed;

/// Largest period of a cycle that is recognised.
const LONGEST: usize = 128;
/// Number of iterates that are examined: every cycle is seen at least twice.
const WINDOW: usize = 2 * LONGEST;
/// Iterations after which the last iterates are examined. The last one is the default limit: an orbit that contracts by
/// a thousandth per iteration has then settled.
const STAGES: [usize; 5] = [500, 1_500, 4_000, 10_000, 30_000];
/// Difference of iterates one period apart, relative to scale and size, at which an orbit repeats itself …
const REPEATS: f64 = 1e-8;
/// … and at which a slowly contracting one is close to a cycle.
const NEARLY: f64 = 1e-2;
/// Distance, relative to scale and size, from the end of a slowly contracting orbit to the cycle that it approaches.
const NEAR: f64 = 5e-2;
/// Magnitude in scales from which on an orbit that becomes infinite has escaped; below, f was undefined.
const LARGE: f64 = 1e6;
/// Number of orbits that are iterated together in a search that may end early.
const BLOCK: usize = 16;
/// Iterates recorded of a motion that is not periodic.
const RECORDED: usize = WINDOW;

/// End of an orbit.
struct Ended {
    motion: Motion,
    /// Period of a cycle; otherwise 0.
    period: usize,
    /// Number of iterations.
    time: usize,
    /// `[WINDOW + 1][n]` last iterates; the last finite state alone if it escaped.
    states: Vec<f64>,
    /// Largest difference of iterates one period apart, relative.
    error: f64,
}

impl Ended {
    fn last(&self, n: usize) -> &[f64] {
        &self.states[self.states.len() - n..]
    }
}

/// A map at given parameters.
struct Iteration<'a> {
    field: &'a dyn VectorField,
    scales: &'a [f64],
    parameters: &'a [f64],
    limit: usize,
}

impl Iteration<'_> {
    fn n(&self) -> usize {
        self.scales.len()
    }

    /// Next states, `[n][lanes]`.
    fn next(&self, states: &[f64], to: &mut [f64]) {
        let lanes = states.len() / self.n().max(1);
        let parameters = Parameters::Shared(self.parameters);
        self.field.evaluate(Batch { lanes, states, parameters, times: &[], signs: &[] }, to);
    }

    /// Takes angles back to their first turn.
    fn rolled(&self, states: &mut [f64], lanes: usize) {
        for (i, period) in self.field.periods().iter().enumerate().filter(|(_, period)| period.is_finite()) {
            states[i * lanes..(i + 1) * lanes].iter_mut().for_each(|x| *x -= period * (*x / period).floor());
        }
    }

    /// Difference of two states relative to scale and size, angles by the shorter way.
    fn apart(&self, a: &[f64], b: &[f64]) -> f64 {
        let of = |i: usize| {
            let off = a[i] - b[i];
            match self.field.periods().get(i).filter(|period| period.is_finite()) {
                Some(period) => (off - period * (off / period).round()).abs() / self.scales[i],
                None => off.abs() / (self.scales[i] + a[i].abs()),
            }
        };
        (0..self.n()).map(of).fold(0.0, |most: f64, x| if x > most || x.is_nan() { x } else { most })
    }

    /// Iterates from starts `[count][n]` until each orbit repeats itself, escapes, or the limit is reached.
    fn run(&self, starts: &[f64]) -> Vec<Ended> {
        let n = self.n();
        let count = starts.len() / n.max(1);
        let mut found: Vec<Option<Ended>> = (0..count).map(|_| None).collect();
        let mut open: Vec<usize> = (0..count).collect();
        let (mut states, mut time) = (transposed(starts, n), 0);
        let stages = STAGES.iter().copied().filter(|stage| *stage < self.limit).chain([self.limit.min(STAGES[4])]);
        for stage in stages {
            if open.is_empty() || self.field.ended() {
                break;
            }
            let length = stage.saturating_sub(time).max(1);
            for _ in 0..length {
                time += 1;
                states = self.stepped(states, &mut open, &mut found, time, true);
            }
            // The window, in which angles are not reduced.
            let mut record: Vec<Vec<f64>> = open.iter().enumerate().map(|(l, _)| lane(&states, n, l)).collect();
            let mut names = open.clone();
            for _ in 0..WINDOW {
                time += 1;
                let before = open.len();
                states = self.stepped(states, &mut open, &mut found, time, false);
                if open.len() < before {
                    let kept: Vec<bool> = names.iter().map(|name| open.contains(name)).collect();
                    let mut keep = kept.iter();
                    record.retain(|_| *keep.next().unwrap_or(&true));
                    let mut keep = kept.iter();
                    names.retain(|_| *keep.next().unwrap_or(&true));
                }
                record.iter_mut().enumerate().for_each(|(l, own)| own.extend(lane(&states, n, l)));
            }
            let last = stage >= self.limit.min(STAGES[4]);
            let mut going = Vec::new();
            for (l, (name, own)) in names.iter().zip(record).enumerate() {
                match self.period_of(&own) {
                    Some((period, error)) => {
                        found[*name] = Some(Ended { motion: Motion::Cycle, period, time, states: own, error });
                    }
                    None if last => {
                        let (motion, error) = (Motion::Other, f64::NAN);
                        found[*name] = Some(Ended { motion, period: 0, time, states: own, error });
                    }
                    None => going.push((l, *name)),
                }
            }
            let lanes = open.len();
            states = (0..n * going.len()).map(|c| states[c / going.len() * lanes + going[c % going.len()].0]).collect();
            open = going.into_iter().map(|(_, name)| name).collect();
            self.rolled(&mut states, open.len());
        }
        let unknown = |start: usize| Ended {
            motion: Motion::Other,
            period: 0,
            time,
            states: starts[start * n..(start + 1) * n].to_vec(),
            error: f64::NAN,
        };
        found.into_iter().enumerate().map(|(k, own)| own.unwrap_or_else(|| unknown(k))).collect()
    }

    /// One iteration of all open orbits; those that escape are closed.
    fn stepped(
        &self,
        states: Vec<f64>,
        open: &mut Vec<usize>,
        found: &mut [Option<Ended>],
        time: usize,
        rolled: bool,
    ) -> Vec<f64> {
        let (n, lanes) = (self.n(), open.len());
        let mut next = vec![0.0; states.len()];
        self.next(&states, &mut next);
        if next.iter().all(|x| x.abs() < Response::UNBOUNDED) {
            if rolled {
                self.rolled(&mut next, lanes);
            }
            return next;
        }
        let bounded = |l: &usize| (0..n).all(|i| next[i * lanes + l].abs() < Response::UNBOUNDED);
        for l in (0..lanes).filter(|l| !bounded(l)) {
            let states =
                if lane(&next, n, l).iter().all(|x| x.is_finite()) { lane(&next, n, l) } else { lane(&states, n, l) };
            found[open[l]] = Some(Ended { motion: Motion::Escaped, period: 0, time, states, error: f64::NAN });
        }
        let kept: Vec<usize> = (0..lanes).filter(bounded).collect();
        *open = kept.iter().map(|l| open[*l]).collect();
        let mut rest: Vec<f64> =
            (0..n).flat_map(|i| kept.iter().map(move |l| (i, *l))).map(|(i, l)| next[i * lanes + l]).collect();
        if rolled {
            self.rolled(&mut rest, kept.len());
        }
        rest
    }

    /// Recognises a motion that did not repeat itself.
    fn recognised(&self, response: &mut Response) {
        if self.field.periods().iter().any(|period| period.is_finite()) {
            response.recognition.reason =
                "quasi-periodic motion and chaos of maps with angles are not distinguished".into();
            return;
        }
        let limits = Limits { steps: self.limit, ..Limits::patient() };
        let trial = Trial { field: self.field, scales: self.scales, whirl: None, jobs: 1, limits };
        let found = recognise(&trial, self.parameters, &response.state, false);
        (response.recognition, response.state) = (found.evidence, found.state);
        response.motion = match &found.nature {
            Nature::Cycle(_) => Motion::Cycle,
            Nature::Torus(_) => Motion::Torus,
            Nature::Chaos => Motion::Chaos,
            Nature::Undecided => Motion::Other,
            Nature::Lost(motion) => *motion,
        };
        match found.nature {
            Nature::Cycle(period) => response.period = Some(period),
            Nature::Torus(quasi) => (response.period, response.error) = (Some(quasi.interval), quasi.curve.residual),
            _ => {}
        }
    }

    /// Period of iterates `[WINDOW + 1][n]` that repeat themselves, and the largest difference.
    fn period_of(&self, states: &[f64]) -> Option<(usize, f64)> {
        (1..=LONGEST).find_map(|period| {
            let error = self.misses(states, period, REPEATS)?;
            Some((period, error))
        })
    }

    /// Largest difference of iterates `period` apart in the last two periods or more; `None` if it exceeds `most`.
    fn misses(&self, states: &[f64], period: usize, most: f64) -> Option<f64> {
        let n = self.n();
        let count = states.len() / n;
        let mut error = 0.0f64;
        for k in (period..count).rev().take(LONGEST.max(period)) {
            let own = self.apart(&states[(k - period) * n..(k - period + 1) * n], &states[k * n..(k + 1) * n]);
            if own.is_nan() || own > most {
                return None;
            }
            error = error.max(own);
        }
        Some(error)
    }

    /// The last `period` iterates, beginning with that whose first state is smallest, and the one that follows them.
    fn candidate(&self, states: &[f64], period: usize) -> Candidate {
        let n = self.n();
        let count = states.len() / n;
        let first = (count - 1 - period..count - 1).min_by(|a, b| states[a * n].total_cmp(&states[b * n])).unwrap_or(0);
        let mut own = states[first * n..(first + 1) * n].to_vec();
        self.rolled(&mut own, 1);
        let mut x = own.clone();
        for _ in 0..period {
            let mut next = vec![0.0; n];
            self.next(&x, &mut next);
            own.extend_from_slice(&next);
            x = next;
        }
        let times = (0..=period).map(|k| k as f64).collect();
        Candidate::Cycle { period: period as f64, times, states: own }
    }

    /// The stable cycle at which an orbit ended or, if it contracts slowly, that it approaches.
    fn attractor(&self, ended: &Ended, polish: Polish) -> Option<Point> {
        let n = self.n();
        let periods: Vec<usize> = match ended.motion {
            Motion::Cycle => vec![ended.period],
            Motion::Other if ended.states.len() > n => {
                (1..=LONGEST).filter(|period| self.misses(&ended.states, *period, NEARLY).is_some()).take(4).collect()
            }
            _ => Vec::new(),
        };
        periods.into_iter().find_map(|period| {
            let point = polish(&self.candidate(&ended.states, period)).filter(|point| point.unstable == 0)?;
            let Solution::Cycle(cycle) = &point.solution else { return None };
            let near = |x: &[f64]| self.apart(x, ended.last(n)) < NEAR;
            cycle.profile.chunks_exact(n).any(near).then_some(point)
        })
    }
}

/// State of one lane.
fn lane(states: &[f64], n: usize, l: usize) -> Vec<f64> {
    let lanes = states.len() / n.max(1);
    (0..n).map(|i| states[i * lanes + l]).collect()
}

/// True if two cycles are the same, whatever iterate they begin with.
fn same(iteration: &Iteration, a: &Point, b: &Point, tolerance: f64) -> bool {
    let (Solution::Cycle(a), Solution::Cycle(b)) = (&a.solution, &b.solution) else { return false };
    let n = iteration.n();
    let count = a.intervals();
    count == b.intervals()
        && (0..count).any(|shift| {
            (0..count).all(|k| {
                let other = (k + shift) % count;
                iteration.apart(&a.profile[k * n..(k + 1) * n], &b.profile[other * n..(other + 1) * n])
                    < 30.0 * tolerance
            })
        })
}

fn iteration<'a>(field: &'a dyn VectorField, parameters: &'a [f64], sampling: &'a Sampling) -> Iteration<'a> {
    let limit = sampling.limits.steps.min(sampling.limits.time.min(1e9) as usize);
    Iteration { field, scales: &sampling.scales, parameters, limit }
}

/// Samples the attractors of a map; see [`super::survey_until`].
pub(super) fn survey(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    polish: Polish,
    brief: bool,
    enough: Enough,
) -> Census {
    let n = field.dim();
    let (own, starts) = (iteration(field, parameters, sampling), sampling.starts());
    let mut census = Census::default();
    let mut uniform: Vec<u32> = Vec::new();
    let block = if brief { BLOCK } else { sampling.samples.max(1) };
    let mut taken = 0;
    for starts_of in starts.chunks((block * n).max(1)) {
        let ended = own.run(starts_of);
        if field.ended() {
            break;
        }
        let mut settled = 0;
        for (l, (ended, start)) in ended.iter().zip(starts_of.chunks_exact(n)).enumerate() {
            if ended.motion == Motion::Escaped {
                let before = census.escaped;
                lost(&own, ended, &mut census);
                census.fates.push(if census.escaped > before { Fate::Escaped } else { Fate::Undefined });
                continue;
            }
            let known = |points: &[Attractor]| {
                let near = |x: &[f64]| own.apart(x, ended.last(n)) < 10.0 * REPEATS.max(sampling.tolerance);
                points.iter().position(|known| match &known.point.solution {
                    Solution::Cycle(cycle) => {
                        ended.period == cycle.intervals() && cycle.profile.chunks_exact(n).any(near)
                    }
                    Solution::Equilibrium(_) | Solution::Torus(_) => false,
                })
            };
            let place = known(&census.attractors).or_else(|| {
                let point = own.attractor(ended, polish)?;
                let place = census.attractors.iter().position(|a| same(&own, &a.point, &point, sampling.tolerance));
                Some(place.unwrap_or_else(|| {
                    let example = start.to_vec();
                    census.attractors.push(Attractor { point, ratio: None, hits: 0, share: None, example });
                    uniform.push(0);
                    census.attractors.len() - 1
                }))
            });
            census.fates.push(place.map_or(Fate::Unsettled, Fate::Settled));
            match place {
                Some(place) => {
                    census.attractors[place].hits += 1;
                    uniform[place] += u32::from(Sampling::is_uniform(taken + l));
                    settled += 1;
                }
                None => census.unsettled += 1,
            }
        }
        taken += ended.len();
        let reached: Vec<_> = census.attractors.iter().map(|a| (&a.point, None)).collect();
        if brief && 2 * settled >= ended.len() && enough(&reached) {
            break;
        }
    }
    census.left = sampling.samples.saturating_sub(taken);
    let of = sampling.uniform();
    if census.left == 0 && of > 0 {
        for (attractor, hits) in census.attractors.iter_mut().zip(uniform) {
            attractor.share = Some(Share { hits: hits as usize, of });
        }
    }
    let period = |a: &Attractor| a.point.solution.period().unwrap_or(0.0);
    let before = |a: &Attractor, b: &Attractor| b.hits.cmp(&a.hits).then(period(a).total_cmp(&period(b)));
    let mut order: Vec<usize> = (0..census.attractors.len()).collect();
    order.sort_by(|a, b| before(&census.attractors[*a], &census.attractors[*b]));
    for fate in &mut census.fates {
        if let Fate::Settled(index) = fate {
            *index = order.iter().position(|own| own == index).unwrap_or(*index);
        }
    }
    census.attractors.sort_by(before);
    census
}

fn lost(own: &Iteration, ended: &Ended, census: &mut Census) {
    let large = ended.states.iter().zip(own.scales).any(|(x, scale)| x.abs() > LARGE * scale);
    if large {
        census.escaped += 1;
    } else {
        census.exits.push(Exit { time: ended.time as f64, state: ended.states.clone() });
    }
}

/// Returns the attractor of a map for one initial state; see [`super::settle`].
pub(super) fn settle(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    start: &[f64],
    polish: Polish,
) -> Result<Point, Lost> {
    let (n, own) = (field.dim(), iteration(field, parameters, sampling));
    let Some(ended) = own.run(start).pop() else { return Err(Lost::Escaped) };
    if ended.motion == Motion::Escaped {
        let large = ended.states.iter().zip(own.scales).any(|(x, scale)| x.abs() > LARGE * scale);
        let exit = Exit { time: ended.time as f64, state: ended.states.clone() };
        return Err(if large { Lost::Escaped } else { Lost::Undefined(exit) });
    }
    own.attractor(&ended, polish).ok_or_else(|| {
        let extent = |i: usize| {
            let own = ended.states.iter().skip(i).step_by(n);
            let [low, high] = own.fold([f64::MAX, f64::MIN], |[low, high], x| [x.min(low), x.max(high)]);
            high - low
        };
        match ended.motion {
            Motion::Cycle => Lost::Unconfirmed { period: ended.period as f64, state: ended.last(n).to_vec() },
            _ => Lost::Unsettled {
                time: ended.time as f64,
                extent: (0..n).map(extent).collect(),
                state: ended.last(n).to_vec(),
            },
        }
    })
}

/// The motion at which an orbit ended, with the iterates of a period, or some of a motion that is not periodic.
fn response(own: &Iteration, free: usize, ended: &Ended) -> (Response, Option<Candidate>) {
    let n = own.n();
    let mut response = Response {
        value: own.parameters.get(free).copied().unwrap_or(0.0),
        parameters: own.parameters.to_vec(),
        motion: ended.motion,
        period: (ended.period > 0).then_some(ended.period as f64),
        ratio: None,
        multiplicity: 1,
        ranges: Vec::new(),
        hits: 1,
        share: None,
        jumped: None,
        state: ended.last(n).to_vec(),
        settled_after: ended.time as f64,
        error: ended.error,
        iterates: Vec::new(),
        recognition: Default::default(),
    };
    if ended.motion == Motion::Escaped {
        return (response, None);
    }
    if ended.motion == Motion::Other {
        own.recognised(&mut response);
    }
    let candidate = (ended.period > 0).then(|| own.candidate(&ended.states, ended.period));
    let count = if ended.period > 0 { ended.period } else { RECORDED };
    let states = &ended.states[ended.states.len().saturating_sub(count * n)..];
    let lanes = states.len() / n;
    let mut by_component = transposed(states, n);
    own.rolled(&mut by_component, lanes);
    let mut outputs = vec![0.0; own.field.output_count() * lanes];
    let parameters = Parameters::Shared(own.parameters);
    own.field.outputs(Batch { lanes, states: &by_component, parameters, times: &[], signs: &[] }, &mut outputs);
    let all: Vec<&[f64]> = by_component.chunks_exact(lanes).chain(outputs.chunks_exact(lanes)).collect();
    let range = |own: &&[f64]| own.iter().fold([f64::MAX, f64::MIN], |[low, high], x| [x.min(low), x.max(high)]);
    response.ranges = all.iter().map(range).collect();
    response.iterates = (0..lanes).flat_map(|k| all.iter().map(move |own| own[k])).collect();
    (response, candidate)
}

fn of_trial<'a>(trial: &'a Trial, parameters: &'a [f64]) -> Iteration<'a> {
    let limit = trial.limits.steps.min(trial.limits.time.min(1e9) as usize);
    Iteration { field: trial.field, scales: trial.scales, parameters, limit }
}

/// Motions at one value of a survey, each with one hit.
pub(super) fn settled(trial: &Trial, parameters: &[f64], starts: &[f64], free: usize) -> Vec<Response> {
    let own = of_trial(trial, parameters);
    own.run(starts).iter().map(|ended| response(&own, free, ended).0).collect()
}

/// True if two motions of a map pass through the same states, whatever iterate they begin with; also for motions that are
/// not periodic, whose iterates are only some.
pub(super) fn alike(trial: &Trial, parameters: &[f64], a: &Response, b: &Response) -> bool {
    if a.motion != Motion::Cycle || a.iterates.is_empty() || a.iterates.len() != b.iterates.len() {
        return true;
    }
    let own = of_trial(trial, parameters);
    let width = a.ranges.len().max(1);
    let count = a.iterates.len() / width;
    let state = |of: &Response, k: usize| of.iterates[k % count * width..][..own.n()].to_vec();
    (0..count).any(|shift| (0..count).all(|k| own.apart(&state(a, k), &state(b, k + shift)) <= SAME))
}

/// A stepped sweep of a map; see [`super::stepped_sweep`].
pub(super) fn stepped_sweep(
    trial: &Trial,
    parameters: &[f64],
    free: usize,
    values: &[f64],
    start: &[f64],
    compare: Compare,
    report: Report,
) -> Vec<Response> {
    let mut found: Vec<Response> = Vec::new();
    let (mut own, mut state) = (parameters.to_vec(), start.to_vec());
    for &value in values {
        own[free] = value;
        let map = of_trial(trial, &own);
        let Some(ended) = map.run(&state).pop() else { break };
        let (mut response, candidate) = response(&map, free, &ended);
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
