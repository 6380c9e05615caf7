//! Trajectories of a forced field as trajectories of an autonomous one.
//!
//! **Idea.** Two additional states, which go round the unit circle once per forcing period, represent time, so that
//! sections, returns and distances need no special treatment of forcing. They exist only in this module: solutions are
//! returned in the states of the model, starting at the beginning of a forcing period.
//!
//! **Equations.** With z = c + i s and the time τ in forcing periods:
//!
//! ```text
//!   (1)  x' = f(x, p, τ),   z' = 2π i z + (1 - |z|²) z,   τ = arg z / 2π
//! ```

use super::census::Pace;
use super::measure::tolerance;
use super::{Attractor, Candidate, Census, Enough, Exit, Limits, Lost, Polish, Report, Sampling, Trial};
use crate::contract::{Batch, VectorField};
use crate::diagram::{Cycle, Point, Response, Solution};
use crate::simulation::{Integrator, bordered};
use std::f64::consts::TAU;

/// Largest distance of a period from a whole number of forcing periods for a motion locked to the forcing.
const WHOLE: f64 = 0.02;

/// The field (1), for simulation only: derivatives with respect to τ are set to 0.
pub(super) struct Driven<'a>(pub(super) &'a dyn VectorField);

impl Driven<'_> {
    fn n(&self) -> usize {
        self.0.dim()
    }

    /// Returns τ for every lane.
    fn times(&self, at: Batch) -> Vec<f64> {
        let (n, lanes) = (self.n(), at.lanes);
        let (c, s) = at.states[n * lanes..].split_at(lanes);
        c.iter().zip(s).map(|(c, s)| s.atan2(*c) / TAU).collect()
    }

    /// Calls with the batch as seen by the forced field.
    fn inner(&self, at: Batch, call: impl FnOnce(Batch)) {
        let times = self.times(at);
        call(Batch { states: &at.states[..self.n() * at.lanes], times: &times, ..at });
    }

    fn circle(&self, at: Batch, f: &mut [f64]) {
        let (n, lanes) = (self.n(), at.lanes);
        let (c, s) = at.states[n * lanes..].split_at(lanes);
        let (fc, fs) = f[n * lanes..].split_at_mut(lanes);
        for l in 0..lanes {
            let back = 1.0 - c[l] * c[l] - s[l] * s[l];
            fc[l] = back * c[l] - TAU * s[l];
            fs[l] = back * s[l] + TAU * c[l];
        }
    }
}

impl VectorField for Driven<'_> {
    fn unclocked(&self) -> Option<&dyn VectorField> {
        Some(self.0)
    }

    fn dim(&self) -> usize {
        self.n() + 2
    }

    fn parameter_count(&self) -> usize {
        self.0.parameter_count()
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        self.inner(at, |inner| self.0.evaluate(inner, &mut f[..self.n() * at.lanes]));
        self.circle(at, f);
    }

    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        let (n, lanes) = (self.n(), at.lanes);
        let mut inner_fx = vec![0.0; n * n * lanes];
        let mut inner_fp = vec![0.0; n * free.len() * lanes];
        self.inner(at, |inner| {
            self.0.linearise(inner, free, &mut f[..n * lanes], &mut inner_fx, &mut inner_fp);
        });
        self.circle(at, f);
        bordered(&inner_fx, n, 2, lanes, fx);
        fp.fill(0.0);
        fp[..inner_fp.len()].copy_from_slice(&inner_fp);
        let (c, s) = at.states[n * lanes..].split_at(lanes);
        for l in 0..lanes {
            let back = 1.0 - c[l] * c[l] - s[l] * s[l];
            let block = [
                [back - 2.0 * c[l] * c[l], -2.0 * c[l] * s[l] - TAU],
                [-2.0 * c[l] * s[l] + TAU, back - 2.0 * s[l] * s[l]],
            ];
            for (i, row) in block.iter().enumerate() {
                for (j, entry) in row.iter().enumerate() {
                    fx[((n + i) * (n + 2) + n + j) * lanes + l] = *entry;
                }
            }
        }
    }

    fn directional(&self, _at: Batch, _directions: &[&[f64]], out: &mut [f64]) {
        out.fill(f64::NAN);
    }

    fn time_unit(&self, parameters: &[f64]) -> f64 {
        self.0.time_unit(parameters)
    }

    fn ended(&self) -> bool {
        self.0.ended()
    }

    fn output_count(&self) -> usize {
        self.0.output_count()
    }

    fn outputs(&self, at: Batch, out: &mut [f64]) {
        self.inner(at, |inner| self.0.outputs(inner, out));
    }

    fn switch_count(&self) -> usize {
        self.0.switch_count()
    }

    fn event_count(&self) -> usize {
        self.0.event_count()
    }

    fn event_direction(&self, event: usize) -> f64 {
        self.0.event_direction(event)
    }

    fn reset(&self, event: usize, at: Batch, free: &[usize], to: [&mut [f64]; 4]) {
        let n = self.0.dim();
        let [r, ..] = to;
        r[n..].copy_from_slice(&at.states[n..]);
        let [mut rx, mut rp, mut rt] = [n * n, n * free.len(), n].map(|size| vec![0.0; size]);
        self.inner(at, |inner| self.0.reset(event, inner, free, [&mut r[..n], &mut rx, &mut rp, &mut rt]));
    }

    fn forbidden(&self, at: Batch) -> Option<usize> {
        let mut found = None;
        self.inner(at, |inner| found = self.0.forbidden(inner));
        found
    }

    fn switches(&self, at: Batch, out: &mut [f64]) {
        self.inner(at, |inner| self.0.switches(inner, out));
    }

    fn normal_speeds(&self, at: Batch, switch: usize) -> [Vec<f64>; 2] {
        let mut speeds = [Vec::new(), Vec::new()];
        self.inner(at, |inner| speeds = self.0.normal_speeds(inner, switch));
        speeds
    }
}

/// Samples the attractors of a forced field; see [`super::survey_until`].
pub(super) fn survey(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    polish: Polish,
    until: (Pace, Enough),
) -> Census {
    let n = field.dim();
    let polish = |candidate: &Candidate| polish(&without_circle(candidate, n)?).and_then(|found| with_circle(found, n));
    let sampling = with_clock(sampling, field.time_unit(parameters));
    let mut census = super::census::survey(&Driven(field), parameters, &sampling, &polish, until);
    for Attractor { point, example, .. } in &mut census.attractors {
        bare(point, n, field.time_unit(parameters));
        example.truncate(n);
    }
    census.exits.iter_mut().for_each(|exit| bare_exit(exit, n, field.time_unit(parameters)));
    census
}

/// Returns the attractor of the trajectory from `start` at the beginning of a forcing period; see [`super::settle`].
pub(super) fn settle(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    start: &[f64],
    polish: Polish,
) -> Result<Point, Lost> {
    let n = field.dim();
    let polish = |candidate: &Candidate| polish(&without_circle(candidate, n)?).and_then(|found| with_circle(found, n));
    let start = [start, &[1.0, 0.0]].concat();
    let unit = field.time_unit(parameters);
    match super::census::settle(&Driven(field), parameters, &with_clock(sampling, unit), &start, &polish) {
        Ok(mut point) => {
            bare(&mut point, n, unit);
            Ok(point)
        }
        Err(Lost::Undefined(mut exit)) => {
            bare_exit(&mut exit, n, unit);
            Err(Lost::Undefined(exit))
        }
        Err(Lost::Unsettled { time, mut extent, mut state }) => {
            extent.truncate(n);
            state.truncate(n);
            Err(Lost::Unsettled { time: time * unit, extent, state })
        }
        Err(Lost::Unconfirmed { period, mut state }) => {
            state.truncate(n);
            Err(Lost::Unconfirmed { period: period * unit, state })
        }
        Err(lost) => Err(lost),
    }
}

fn bare_exit(exit: &mut Exit, n: usize, unit: f64) {
    exit.time *= unit;
    exit.state.truncate(n);
}

/// Returns the scales followed by those of the circle.
pub(super) fn with_unit_scales(scales: &[f64]) -> Vec<f64> {
    [scales, &[1.0, 1.0]].concat()
}

/// Returns a sampling in which each trajectory starts at the beginning of a forcing period, which is the unit of time.
pub(super) fn with_clock(sampling: &Sampling, unit: f64) -> Sampling {
    let ranges = [&sampling.ranges[..], &[[1.0, 1.0], [0.0, 0.0]]].concat();
    let limits = Limits { time: sampling.limits.time / unit, ..sampling.limits };
    let n = sampling.scales.len();
    let begin = |starts: &Vec<f64>| starts.chunks_exact(n).flat_map(|x| [x, &[1.0, 0.0]].concat()).collect();
    let given = sampling.given.as_ref().map(begin);
    Sampling { ranges, scales: with_unit_scales(&sampling.scales), limits, given, ..sampling.clone() }
}

/// Calls with the trial for (1) and returns the responses without the circle.
pub(super) fn simulate(
    trial: &Trial,
    report: Report,
    run: impl FnOnce(&Trial, Report) -> Vec<Response>,
) -> Vec<Response> {
    let (driven, scales) = (Driven(trial.field), with_unit_scales(trial.scales));
    let own = Trial { field: &driven, scales: &scales, whirl: trial.whirl, jobs: trial.jobs, limits: trial.limits };
    let plain = |found: &[Response]| -> Vec<Response> { found.iter().map(|r| without(r, &own)).collect() };
    let found = run(&own, &|found| report(&plain(found)));
    plain(&found)
}

fn without(response: &Response, driven: &Trial) -> Response {
    let (n, unit) = (driven.field.dim() - 2, driven.field.time_unit(&response.parameters));
    let mut plain = response.clone();
    if !response.motion.is_lost()
        && let Some(state) = at_start_of_period(response, driven)
    {
        plain.state = state;
    }
    plain.state.truncate(n);
    without_ranges_of_circle(&mut plain.ranges, n);
    // A motion that repeats with the forcing does so after a whole number of forcing periods.
    let whole = |period: f64| if (period - period.round()).abs() < WHOLE { period.round() } else { period };
    plain.period = response.period.map(|period| whole(period) * unit);
    plain.settled_after *= unit;
    plain
}

/// State of a motion at the start of the next forcing period, without which it would not determine the motion; `None` if it
/// cannot be integrated so far.
fn at_start_of_period(response: &Response, driven: &Trial) -> Option<Vec<f64>> {
    let n = driven.field.dim() - 2;
    let [c, s] = *response.state.get(n..)? else { return None };
    let left = 1.0 - (s.atan2(c) / TAU).rem_euclid(1.0);
    // The field is its own clock: times are in forcing periods.
    let integrator = Integrator::new(driven.field, &response.parameters, tolerance(driven));
    integrator.state_after(&response.state, [0.0, left])
}

/// Removes the two states of the circle from a cycle, which then starts at the beginning of a forcing period.
pub(super) fn without_circle(candidate: &Candidate, n: usize) -> Option<Candidate> {
    let Candidate::Cycle { period, times, states } = candidate else { return None };
    let whole = period.round();
    if whole < 1.0 || (period - whole).abs() > WHOLE || times.len() < 3 {
        return None;
    }
    let count = times.len() - 1;
    // Time until the next forcing period begins.
    let first = &states[n..n + 2];
    let wait = (-first[1].atan2(first[0]) / TAU).rem_euclid(1.0);
    let state = |k: usize| &states[k % count * (n + 2)..][..n];
    let k = times.partition_point(|t| *t <= wait).clamp(1, count);
    let share = (wait - times[k - 1]) / (times[k] - times[k - 1]);
    let start: Vec<f64> = state(k - 1).iter().zip(state(k)).map(|(a, b)| a + share * (b - a)).collect();
    let (mut turned, mut profile) = (vec![0.0], start.clone());
    for step in 0..count {
        let at = k + step;
        let time = times[at % count] + if at >= count { *period } else { 0.0 } - wait;
        // Samples that nearly coincide are useless.
        if time > turned[turned.len() - 1] + 1e-9 && time < period - 1e-9 {
            turned.push(time);
            profile.extend_from_slice(state(at));
        }
    }
    turned.push(*period);
    profile.extend(start);
    let times = turned.iter().map(|t| t * whole / period).collect();
    Some(Candidate::Cycle { period: whole, times, states: profile })
}

/// Returns a cycle with the states of the circle added and its period counted in forcing periods.
fn with_circle(mut point: Point, n: usize) -> Option<Point> {
    let Solution::Cycle(cycle) = &mut point.solution else { return None };
    let scheme = cycle.scheme();
    let turns = f64::from(cycle.forcing_periods);
    let mut profile = Vec::with_capacity(cycle.profile.len() / n * (n + 2));
    let mut nodes = cycle.profile.chunks_exact(n);
    for pair in cycle.mesh.windows(2) {
        for c in &scheme.nodes {
            let (sin, cos) = (TAU * turns * (pair[0] + c * (pair[1] - pair[0]))).sin_cos();
            profile.extend_from_slice(nodes.next()?);
            profile.extend([cos, sin]);
        }
    }
    (cycle.profile, cycle.period) = (profile, turns);
    point.ranges.splice(n..n, [[-1.0, 1.0]; 2]);
    Some(point)
}

/// Removes the circle from a point; `unit` is the forcing period.
fn bare(point: &mut Point, n: usize, unit: f64) {
    if let Solution::Cycle(Cycle { profile, period, forcing_periods, .. }) = &mut point.solution {
        *profile = profile.chunks_exact(n + 2).flat_map(|x| &x[..n]).copied().collect();
        *period = f64::from(*forcing_periods) * unit;
    }
    without_ranges_of_circle(&mut point.ranges, n);
}

/// Removes the ranges of the two states of the circle; a motion that escaped has no ranges.
fn without_ranges_of_circle(ranges: &mut Vec<[f64; 2]>, n: usize) {
    if ranges.len() >= n + 2 {
        ranges.drain(n..n + 2);
    }
}
