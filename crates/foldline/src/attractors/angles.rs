//! Trajectories on a cylinder: angles as points on a circle.
//!
//! **Idea.** A rotating motion returns to where it was although its angle does not. Each angle is replaced by its
//! cosine and sine, so that sections, returns and distances need no special treatment of angles. The circles exist only
//! in this module: solutions are returned in the states of the model, and rotating ones carry the gain of their angles
//! over a period.
//!
//! **Equations.** With an angle θ of period P, ω = 2π θ' / P and z = c + i s:
//!
//! ```text
//!   (1)  z' = i ω z + ½ |ω| (1 - |z|²) z,   θ = P arg z / 2π
//! ```
//!
//! The second term keeps |z| at 1 against integration errors at the rate at which the angle turns, so it adds no time
//! scale. f does not depend on |z|.

use super::census::Pace;
use super::{Attractor, Candidate, Census, Enough, Exit, Lost, Polish, Report, Sampling, Trial};
use crate::contract::{Batch, VectorField};
use crate::diagram::{Cycle, Point, Response, Solution};
use std::f64::consts::TAU;

/// The field (1). The cosine takes the place of the angle, and the sines follow the other states. The outputs are
/// followed by each angle, once in -P/2 … P/2 and once in 0 … P.
pub(super) struct Rolled<'a> {
    field: &'a dyn VectorField,
    /// Index and period of each angle.
    angles: Vec<(usize, f64)>,
}

impl<'a> Rolled<'a> {
    /// `None` if no state is an angle.
    pub(super) fn new(field: &'a dyn VectorField) -> Option<Rolled<'a>> {
        let angles = field.periods().iter().copied().enumerate().filter(|(_, period)| period.is_finite());
        let angles: Vec<(usize, f64)> = angles.collect();
        (!angles.is_empty()).then_some(Rolled { field, angles })
    }

    fn n(&self) -> usize {
        self.field.dim()
    }

    /// Returns the states `[n × lanes]` of the field.
    fn states(&self, at: Batch) -> Vec<f64> {
        let (n, lanes) = (self.n(), at.lanes);
        let mut states = at.states[..n * lanes].to_vec();
        for (k, (c, period)) in self.angles.iter().enumerate() {
            for l in 0..lanes {
                states[c * lanes + l] = angle(at.states[c * lanes + l], at.states[(n + k) * lanes + l], *period);
            }
        }
        states
    }

    /// Replaces θ' by z'.
    fn circles(&self, at: Batch, f: &mut [f64]) {
        let (n, lanes) = (self.n(), at.lanes);
        for (k, (place, period)) in self.angles.iter().enumerate() {
            for l in 0..lanes {
                let (c, s) = (at.states[place * lanes + l], at.states[(n + k) * lanes + l]);
                let turning = TAU / period * f[place * lanes + l];
                let back = 0.5 * turning.abs() * (1.0 - c * c - s * s);
                f[place * lanes + l] = back * c - turning * s;
                f[(n + k) * lanes + l] = back * s + turning * c;
            }
        }
    }

    /// Returns the state `[n + k]` of (1) for a state of the field.
    fn rolled(&self, x: &[f64]) -> Vec<f64> {
        let mut z = x.to_vec();
        for (c, period) in &self.angles {
            let (sin, cos) = (TAU / period * x[*c]).sin_cos();
            z[*c] = cos;
            z.push(sin);
        }
        z
    }

    /// Returns the state `[n]` for one of (1), each angle in the turn closest to that of `beside` `[n]`, or to 0.
    fn unrolled(&self, z: &[f64], beside: Option<&[f64]>) -> Vec<f64> {
        let n = self.n();
        let mut x = z[..n].to_vec();
        for (k, (c, period)) in self.angles.iter().enumerate() {
            let own = angle(z[*c], z[n + k], *period);
            x[*c] = own + beside.map_or(0.0, |beside| period * ((beside[*c] - own) / period).round());
        }
        x
    }

    /// Returns states `[count][n + k]` in order of time as a line `[count][n]` with continuous angles.
    fn line(&self, states: &[f64]) -> Vec<f64> {
        let n = self.n();
        let mut line: Vec<f64> = Vec::with_capacity(states.len());
        for z in states.chunks_exact(n + self.angles.len()) {
            let next = self.unrolled(z, line.rchunks_exact(n).next());
            line.extend(next);
        }
        line
    }

    fn plain(&self, candidate: &Candidate) -> Candidate {
        match candidate {
            Candidate::Equilibrium(z) => Candidate::Equilibrium(self.unrolled(z, None)),
            Candidate::Cycle { period, times, states } => {
                Candidate::Cycle { period: *period, times: times.clone(), states: self.line(states) }
            }
        }
    }

    /// Returns the point with circles in place of angles. The ranges of the angles are left unchanged.
    fn around(&self, mut point: Point) -> Point {
        let n = self.n();
        match &mut point.solution {
            Solution::Equilibrium(x) => *x = self.rolled(x),
            Solution::Cycle(cycle) => {
                cycle.profile = cycle.profile.chunks_exact(n).flat_map(|x| self.rolled(x)).collect();
                cycle.gain.clear();
            }
            Solution::Torus(_) => {}
        }
        point.ranges.splice(n..n, vec![[-1.0, 1.0]; self.angles.len()]);
        point
    }

    /// Replaces the circles of a point by angles.
    fn flat(&self, point: &mut Point) {
        let n = self.n();
        match &mut point.solution {
            Solution::Equilibrium(z) => *z = self.unrolled(z, None),
            Solution::Cycle(cycle) => {
                cycle.profile = self.line(&cycle.profile);
                cycle.gain = self.gain(cycle);
            }
            Solution::Torus(_) => {}
        }
        if point.ranges.len() >= n + self.angles.len() {
            point.ranges.drain(n..n + self.angles.len());
        }
    }

    /// Returns the gain of the angles over a cycle given as a continuous line without its end; empty if none turns.
    fn gain(&self, cycle: &Cycle) -> Vec<f64> {
        let (first, last) = (&cycle.profile[..self.n()], cycle.profile.rchunks_exact(self.n()).next());
        gained(self.field.periods(), first, last.unwrap_or(first))
    }

    fn around_sampling(&self, sampling: &Sampling) -> Sampling {
        let scales = self.around_scales(&sampling.scales);
        Sampling { scales, ..sampling.clone() }
    }

    /// Returns the scales with 1 for each component of a circle.
    fn around_scales(&self, scales: &[f64]) -> Vec<f64> {
        let mut scales = scales.to_vec();
        self.angles.iter().for_each(|(c, _)| scales[*c] = 1.0);
        scales.resize(scales.len() + self.angles.len(), 1.0);
        scales
    }

    fn flat_exit(&self, exit: &mut Exit) {
        exit.state = self.unrolled(&exit.state, None);
    }

    /// Returns extents `[n]` from those of (1): for an angle the arc over the chord, at most half a turn.
    fn extents(&self, extent: &[f64]) -> Vec<f64> {
        let n = self.n();
        let mut plain = extent[..n].to_vec();
        for (k, (c, period)) in self.angles.iter().enumerate() {
            let chord = extent[*c].hypot(extent[n + k]).min(2.0);
            plain[*c] = period / TAU * 2.0 * (0.5 * chord).asin();
        }
        plain
    }

    fn response(&self, found: &Response) -> Response {
        let (n, k) = (self.n(), self.angles.len());
        let mut plain = found.clone();
        plain.state = self.unrolled(&found.state, None);
        let outputs = n + k + self.field.output_count();
        if found.ranges.len() < outputs + 2 * k {
            return plain;
        }
        plain.ranges.truncate(outputs);
        plain.ranges.drain(n..n + k);
        for (number, (c, period)) in self.angles.iter().enumerate() {
            // A motion around θ = P/2 is cut by one of the two intervals.
            let [own, other] = [0, 1].map(|way| found.ranges[outputs + 2 * number + way]);
            let narrow = if other[1] - other[0] < own[1] - own[0] { other } else { own };
            let turns =
                found.ranges[*c][0] < -0.99 && found.ranges[*c][1] > 0.99 && narrow[1] - narrow[0] > 0.9 * period;
            plain.ranges[*c] = if turns { [-0.5 * period, 0.5 * period] } else { narrow };
        }
        plain
    }
}

/// Returns θ in -P/2 … P/2.
fn angle(c: f64, s: f64, period: f64) -> f64 {
    period / TAU * s.atan2(c)
}

/// Returns the whole periods `[n]` that each angle gains from the start of a line to its end; empty if none does.
pub(crate) fn gained(periods: &[f64], start: &[f64], end: &[f64]) -> Vec<f64> {
    let whole = |((period, a), b): ((&f64, &f64), &f64)| match period.is_finite() {
        true => period * ((b - a) / period).round(),
        false => 0.0,
    };
    let gain: Vec<f64> = periods.iter().zip(start).zip(end).map(whole).collect();
    if gain.iter().any(|gain| *gain != 0.0) { gain } else { Vec::new() }
}

impl VectorField for Rolled<'_> {
    fn dim(&self) -> usize {
        self.n() + self.angles.len()
    }

    fn parameter_count(&self) -> usize {
        self.field.parameter_count()
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        let states = self.states(at);
        self.field.evaluate(Batch { states: &states, ..at }, &mut f[..self.n() * at.lanes]);
        self.circles(at, f);
    }

    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        let (n, more, lanes, q) = (self.n(), self.angles.len(), at.lanes, free.len());
        let all = n + more;
        let states = self.states(at);
        let (mut own, mut of_free) = (vec![0.0; n * n * lanes], vec![0.0; n * q * lanes]);
        self.field.linearise(Batch { states: &states, ..at }, free, &mut f[..n * lanes], &mut own, &mut of_free);
        let rates: Vec<f64> = f[..n * lanes].to_vec();
        self.circles(at, f);
        fx.fill(0.0);
        fp.fill(0.0);
        for l in 0..lanes {
            // Derivatives of each f_i with respect to c and s instead of θ, then those of z' instead of θ'.
            let mut row = vec![0.0; all];
            for i in 0..n {
                (0..n).for_each(|j| row[j] = own[(i * n + j) * lanes + l]);
                for (k, (place, period)) in self.angles.iter().enumerate() {
                    let (c, s) = (at.states[place * lanes + l], at.states[(n + k) * lanes + l]);
                    let by_angle = row[*place] * period / TAU / (c * c + s * s);
                    (row[*place], row[n + k]) = (-s * by_angle, c * by_angle);
                }
                match self.angles.iter().position(|(place, _)| *place == i) {
                    None => {
                        (0..all).for_each(|j| fx[(i * all + j) * lanes + l] = row[j]);
                        (0..q).for_each(|j| fp[(i * q + j) * lanes + l] = of_free[(i * q + j) * lanes + l]);
                    }
                    Some(k) => {
                        let (c, s) = (at.states[i * lanes + l], at.states[(n + k) * lanes + l]);
                        let unit = TAU / self.angles[k].1;
                        let turning = unit * rates[i * lanes + l];
                        for (line, across) in [(i, -s), (n + k, c)] {
                            (0..all).for_each(|j| fx[(line * all + j) * lanes + l] = across * unit * row[j]);
                            for j in 0..q {
                                fp[(line * q + j) * lanes + l] = across * unit * of_free[(i * q + j) * lanes + l];
                            }
                        }
                        // Evaluated on the circle, |z| = 1.
                        let size = turning.abs();
                        let block = [[-size * c * c, -turning - size * c * s], [turning - size * c * s, -size * s * s]];
                        for (line, entries) in [i, n + k].into_iter().zip(block) {
                            fx[(line * all + i) * lanes + l] += entries[0];
                            fx[(line * all + n + k) * lanes + l] += entries[1];
                        }
                    }
                }
            }
        }
    }

    fn directional(&self, _at: Batch, _directions: &[&[f64]], out: &mut [f64]) {
        out.fill(f64::NAN);
    }

    fn ended(&self) -> bool {
        self.field.ended()
    }

    fn forced(&self) -> bool {
        self.field.forced()
    }

    fn time_unit(&self, parameters: &[f64]) -> f64 {
        self.field.time_unit(parameters)
    }

    fn output_count(&self) -> usize {
        self.field.output_count() + 2 * self.angles.len()
    }

    fn outputs(&self, at: Batch, out: &mut [f64]) {
        let lanes = at.lanes;
        let states = self.states(at);
        let (own, angles) = out.split_at_mut(self.field.output_count() * lanes);
        self.field.outputs(Batch { states: &states, ..at }, own);
        for ((c, period), two) in self.angles.iter().zip(angles.chunks_exact_mut(2 * lanes)) {
            for l in 0..lanes {
                let own = states[c * lanes + l];
                (two[l], two[lanes + l]) = (own, own.rem_euclid(*period));
            }
        }
    }

    fn switch_count(&self) -> usize {
        self.field.switch_count()
    }

    fn switches(&self, at: Batch, out: &mut [f64]) {
        let states = self.states(at);
        self.field.switches(Batch { states: &states, ..at }, out);
    }

    fn normal_speeds(&self, at: Batch, switch: usize) -> [Vec<f64>; 2] {
        let states = self.states(at);
        self.field.normal_speeds(Batch { states: &states, ..at }, switch)
    }
}

/// Returns the initial states of a survey, with circles in place of angles.
fn starts(rolled: &Rolled, sampling: &Sampling) -> Vec<f64> {
    sampling.starts().chunks_exact(rolled.n()).flat_map(|x| rolled.rolled(x)).collect()
}

/// Samples the attractors of a field with angles; see [`super::survey_until`].
pub(super) fn survey(
    rolled: &Rolled,
    parameters: &[f64],
    sampling: &Sampling,
    polish: Polish,
    until: (Pace, Enough),
) -> Census {
    let polish = |candidate: &Candidate| polish(&rolled.plain(candidate)).map(|found| rolled.around(found));
    let given = Sampling { given: Some(starts(rolled, sampling)), ..rolled.around_sampling(sampling) };
    let mut census = super::survey_at(rolled, parameters, &given, &polish, until);
    for Attractor { point, example, .. } in &mut census.attractors {
        rolled.flat(point);
        *example = rolled.unrolled(example, None);
    }
    census.exits.iter_mut().for_each(|exit| rolled.flat_exit(exit));
    census
}

/// Returns the attractor of the trajectory from `start`; see [`super::settle`].
pub(super) fn settle(
    rolled: &Rolled,
    parameters: &[f64],
    sampling: &Sampling,
    start: &[f64],
    polish: Polish,
) -> Result<Point, Lost> {
    let polish = |candidate: &Candidate| polish(&rolled.plain(candidate)).map(|found| rolled.around(found));
    let sampling = rolled.around_sampling(sampling);
    match super::settle(rolled, parameters, &sampling, &rolled.rolled(start), &polish) {
        Ok(mut point) => {
            rolled.flat(&mut point);
            Ok(point)
        }
        Err(Lost::Undefined(mut exit)) => {
            rolled.flat_exit(&mut exit);
            Err(Lost::Undefined(exit))
        }
        Err(Lost::Unsettled { time, extent, state }) => {
            Err(Lost::Unsettled { time, extent: rolled.extents(&extent), state: rolled.unrolled(&state, None) })
        }
        Err(Lost::Unconfirmed { period, state }) => {
            Err(Lost::Unconfirmed { period, state: rolled.unrolled(&state, None) })
        }
        Err(lost) => Err(lost),
    }
}

/// Brute-force survey with circles; see [`super::survey_by_simulation`].
pub(super) fn survey_by_simulation(
    rolled: &Rolled,
    trial: &Trial,
    sampling: &Sampling,
    (parameters, free, values): (&[f64], usize, &[f64]),
    report: Report,
) -> Vec<Response> {
    let given = Sampling { given: Some(starts(rolled, sampling)), ..rolled.around_sampling(sampling) };
    simulate(rolled, trial, report, |trial, report| {
        super::survey_by_simulation(trial, &given, parameters, free, values, report)
    })
}

/// Stepped sweep with circles; see [`super::stepped_sweep`].
pub(super) fn stepped_sweep(
    rolled: &Rolled,
    trial: &Trial,
    (parameters, free, values): (&[f64], usize, &[f64]),
    start: &[f64],
    compare: super::Compare,
    report: Report,
) -> Vec<Response> {
    let mut compare =
        |own: &[f64], candidate: Option<&Candidate>| compare(own, candidate.map(|c| rolled.plain(c)).as_ref());
    simulate(rolled, trial, report, |trial, report| {
        super::stepped_sweep(trial, parameters, free, values, &rolled.rolled(start), &mut compare, report)
    })
}

/// Calls with the trial for (1) and returns the responses without the circles.
fn simulate(
    rolled: &Rolled,
    trial: &Trial,
    report: Report,
    run: impl FnOnce(&Trial, Report) -> Vec<Response>,
) -> Vec<Response> {
    let scales = rolled.around_scales(trial.scales);
    let own = Trial { field: rolled, scales: &scales, ..*trial };
    let plain = |found: &[Response]| -> Vec<Response> { found.iter().map(|r| rolled.response(r)).collect() };
    let found = run(&own, &|found| report(&plain(found)));
    plain(&found)
}
