//! Measurement of a settled motion over a further stretch of its trajectory.
//!
//! **Idea.** From a state of the motion the trajectory is integrated more accurately than before: a cycle over one
//! period, until it returns to the plane across its start, and any other motion over a number of steps. Every step is
//! sampled in equal parts, both ends included; extrema are those of quartics through five samples of one step. Steps end
//! where f or the state jumps, so that no quartic passes through a jump, and the states on both sides of it are among
//! the samples.

use super::Candidate;
use super::recognition::{Found, Nature, recognise};
use super::same::Track;
use super::settling::{Settled, Trial, lost};
use super::spectrum::lines;
use crate::contract::{Batch, Parameters, Verdict};
use crate::diagram::{Motion, Recognition, Response};
use crate::simulation::{Ensemble, Step, Tolerance};
use num_complex::Complex64;

/// Relative accuracy of the integration.
const INTEGRATION: f64 = 1e-10;
/// Samples per period, at equal times: a parabola through three of them misses the maximum of the k-th harmonic by
/// (2πk/SAMPLES)⁴/128.
const SAMPLES: usize = 2048;
/// Least number of parts into which a step is divided: its continuous solution is a quartic.
const PARTS: usize = 4;
/// Number of steps over which a motion that is neither at rest nor periodic is observed.
const WATCHED: usize = 20_000;

/// Motion to which a trajectory settled.
pub(super) struct Measured {
    /// With one hit.
    pub(super) response: Response,
    /// A starting point for Newton's method if the motion is at rest or periodic.
    pub(super) candidate: Option<Candidate>,
    /// States along a cycle.
    pub(super) track: Option<Track>,
}

/// Samples along successive steps of a trajectory.
#[derive(Default)]
struct Sampled {
    /// `[sample][n]`.
    states: Vec<f64>,
    /// Number of samples of each step, both ends included.
    pieces: Vec<usize>,
}

impl Sampled {
    /// A single state.
    fn state(x: &[f64]) -> Sampled {
        Sampled { states: x.to_vec(), pieces: vec![1] }
    }

    /// Adds the step up to a fraction `end` of it, in parts no longer than `longest`.
    fn add(&mut self, step: &Step, end: f64, longest: f64, x: &mut [f64]) {
        let length = end * (step.end_time() - step.start_time()).abs();
        let parts = ((length / longest).ceil() as usize).clamp(PARTS, SAMPLES);
        for part in 0..=parts {
            step.state_into(end * part as f64 / parts as f64, x);
            self.states.extend_from_slice(x);
        }
        self.pieces.push(parts + 1);
    }
}

/// Measures the motion to which a trajectory settled at the parameter values `parameters`.
pub(super) fn response(trial: &Trial, parameters: &[f64], free: usize, settled: &Settled) -> Measured {
    let mut response = Response {
        value: parameters.get(free).copied().unwrap_or(0.0),
        parameters: parameters.to_vec(),
        motion: settled.motion,
        period: None,
        ratio: None,
        multiplicity: 1,
        ranges: Vec::new(),
        hits: 1,
        share: None,
        jumped: None,
        state: settled.state.clone(),
        settled_after: settled.time,
        error: settled.error,
        iterates: Vec::new(),
        recognition: Recognition::default(),
    };
    let cycle = match settled.motion {
        Motion::Escaped | Motion::Chatter => None,
        Motion::Equilibrium => {
            response.ranges = ranges(trial, parameters, &Sampled::state(&settled.state));
            let candidate = Some(Candidate::Equilibrium(settled.state.clone()));
            return Measured { response, candidate, track: None };
        }
        Motion::Cycle => cycle(trial, parameters, settled, &mut response),
        // Only recognition finds the other types, and it comes last.
        Motion::Other | Motion::Torus | Motion::Chaos => unsettled(trial, parameters, settled, &mut response),
    };
    let (candidate, track) = cycle.unzip();
    Measured { response, candidate, track }
}

/// Recognises a motion that neither rests nor repeated itself.
fn unsettled(
    trial: &Trial,
    parameters: &[f64],
    settled: &Settled,
    response: &mut Response,
) -> Option<(Candidate, Track)> {
    let found = match &settled.found {
        Some(found) => Found::clone(found),
        None => recognise(trial, parameters, &settled.state, false),
    };
    (response.recognition, response.state) = (found.evidence, found.state);
    match found.nature {
        Nature::Cycle(period) => {
            response.motion = Motion::Cycle;
            let settled =
                Settled { motion: Motion::Cycle, state: response.state.clone(), period, error: 0.0, ..settled.clone() };
            return cycle(trial, parameters, &settled, response);
        }
        Nature::Torus(quasi) => {
            (response.motion, response.period) = (Motion::Torus, Some(quasi.interval));
            response.error = quasi.curve.residual;
        }
        Nature::Chaos => response.motion = Motion::Chaos,
        Nature::Undecided => {}
        Nature::Lost(motion) => {
            response.motion = motion;
            return None;
        }
    }
    other(trial, parameters, response);
    None
}

/// Tolerance of trajectories along a motion that has settled.
pub(super) fn tolerance(trial: &Trial) -> Tolerance {
    Tolerance { relative: INTEGRATION, absolute: trial.scales.iter().map(|s| INTEGRATION * s).collect() }
}

/// Integrates over one period, from the start to the return through the plane across its velocity there.
fn cycle(trial: &Trial, parameters: &[f64], settled: &Settled, response: &mut Response) -> Option<(Candidate, Track)> {
    let n = trial.field.dim();
    let start = &settled.state;
    let mut normal = vec![0.0; n];
    let at = Batch { lanes: 1, states: start, parameters: Parameters::Shared(parameters), times: &[], signs: &[] };
    trial.field.evaluate(at, &mut normal);
    normal.iter_mut().zip(&settled.extent).for_each(|(f, e)| *f /= e * e);
    let side = |x: &[f64]| -> f64 { (0..n).map(|i| normal[i] * (x[i] - start[i])).sum() };
    let (mut states, mut back) = (Vec::with_capacity(SAMPLES * n), None);
    let (mut along, mut x) = (Sampled::default(), vec![0.0; n]);
    let spacing = settled.period / SAMPLES as f64;
    if spacing.is_nan() || spacing <= 0.0 {
        response.motion = Motion::Other;
        return None;
    }
    // Slightly longer than the expected period.
    let span = [0.0, 1.02 * settled.period];
    let run = Ensemble::new(trial.field, parameters, tolerance(trial), start, span);
    let arrivals = run.run(&mut |step| {
        sample(step, spacing, &mut states, n);
        // An event may have taken the state across the plane since the end of the last step; that is no return.
        step.start_into(&mut x);
        let before = side(&x);
        step.end_into(&mut x);
        let here = side(&x);
        if before < 0.0 && here >= 0.0 && step.end_time() > 0.98 * settled.period {
            let theta = crossing(step, &side, &mut x);
            along.add(step, theta, spacing, &mut x);
            back = Some((step.time_at(theta), x.clone()));
            return Verdict::Stop;
        }
        along.add(step, 1.0, spacing, &mut x);
        Verdict::Continue
    });
    if let Some(motion) = arrivals.iter().find_map(|arrival| lost(arrival.outcome)) {
        response.motion = motion;
        return None;
    }
    states.truncate(SAMPLES * n);
    response.ranges = ranges(trial, parameters, &along);
    let Some((period, state)) = back else {
        // The trajectory does not return, so it had not settled.
        response.motion = Motion::Other;
        return None;
    };
    let gap = |i: usize| (state[i] - start[i]).abs() / settled.extent[i];
    response.error = (0..n).map(gap).fold(response.error, f64::max);
    response.period = Some(period);
    response.state = state;
    if let Some([u, v]) = trial.whirl {
        let z: Vec<Complex64> = states.chunks_exact(n).map(|x| Complex64::new(x[u], x[v])).collect();
        if let Some((ratio, multiplicity)) = lines(z) {
            (response.ratio, response.multiplicity) = (ratio, multiplicity);
        }
    }
    let mut times: Vec<f64> = (0..states.len() / n).map(|k| k as f64 * spacing).take_while(|t| *t < period).collect();
    states.truncate(times.len() * n);
    times.push(period);
    states.extend_from_slice(&response.state);
    let track = Track::new(along.states, along.pieces, trial.scales);
    Some((Candidate::Cycle { period, times, states }, track))
}

/// Returns the fraction of the step at which `side` changes sign.
fn crossing(step: &Step, side: &dyn Fn(&[f64]) -> f64, x: &mut [f64]) -> f64 {
    let (mut a, mut b) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (a + b);
        step.state_into(middle, x);
        if side(x) < 0.0 { a = middle } else { b = middle }
    }
    0.5 * (a + b)
}

/// Appends the states at the multiples of `spacing` within the step.
fn sample(step: &Step, spacing: f64, states: &mut Vec<f64>, n: usize) {
    let mut x = vec![0.0; n];
    loop {
        let time = (states.len() / n) as f64 * spacing;
        if time > step.end_time() {
            return;
        }
        step.state_into((time - step.start_time()) / (step.end_time() - step.start_time()), &mut x);
        states.extend_from_slice(&x);
    }
}

/// Records the extrema of a motion that is neither at rest nor periodic by further integration, unless it escapes.
fn other(trial: &Trial, parameters: &[f64], response: &mut Response) {
    let n = trial.field.dim();
    let (mut along, mut x) = (Sampled::default(), vec![0.0; n]);
    let run = Ensemble::new(trial.field, parameters, tolerance(trial), &response.state, [0.0, f64::INFINITY]);
    let arrivals = run.with_step_limit(WATCHED).run(&mut |step| {
        along.add(step, 1.0, f64::INFINITY, &mut x);
        Verdict::Continue
    });
    let Some(arrival) = arrivals.into_iter().next() else { return };
    response.state = arrival.state;
    match lost(arrival.outcome) {
        Some(motion) => response.motion = motion,
        None => response.ranges = ranges(trial, parameters, &along),
    }
}

/// Returns the smallest and largest value of every state, then of every output.
fn ranges(trial: &Trial, parameters: &[f64], along: &Sampled) -> Vec<[f64; 2]> {
    let (n, states) = (trial.field.dim(), &along.states);
    let count = states.len() / n;
    if count == 0 {
        return Vec::new();
    }
    let major: Vec<f64> = (0..n).flat_map(|i| (0..count).map(move |s| states[s * n + i])).collect();
    let mut outputs = vec![0.0; trial.field.output_count() * count];
    let at = Batch { lanes: count, states: &major, parameters: Parameters::Shared(parameters), times: &[], signs: &[] };
    trial.field.outputs(at, &mut outputs);
    let own = |values: &[f64]| extremes(values, &along.pieces);
    major.chunks_exact(count).chain(outputs.chunks_exact(count)).map(own).collect()
}

/// Returns the smallest and largest value, also between the samples of each of the pieces, which are equally spaced.
fn extremes(values: &[f64], pieces: &[usize]) -> [f64; 2] {
    let mut found = values.iter().fold([f64::MAX, f64::MIN], |[low, high], v| [low.min(*v), high.max(*v)]);
    let mut rest = values;
    for count in pieces {
        let (piece, later) = rest.split_at(*count);
        for summit in (0..*count).filter_map(|k| summit(piece, k)) {
            found = [found[0].min(summit), found[1].max(summit)];
        }
        rest = later;
    }
    found
}

/// Returns the extremum beside a sample that is at least as high, or as low, as its neighbours: that of the quartic
/// through it and the nearest four.
fn summit(piece: &[f64], k: usize) -> Option<f64> {
    let last = piece.len().checked_sub(5)? + 4;
    let (own, left, right) = (piece[k], piece[k.saturating_sub(1)], piece[(k + 1).min(last)]);
    if (own - left) * (own - right) < 0.0 {
        return None;
    }
    let first = k.saturating_sub(2).min(last - 4);
    let w = &piece[first..first + 5];
    // Derivatives at the middle sample, in units of the spacing.
    let slope = (w[0] - 8.0 * w[1] + 8.0 * w[3] - w[4]) / 12.0;
    let second = (-w[0] + 16.0 * w[1] - 30.0 * w[2] + 16.0 * w[3] - w[4]) / 12.0;
    let third = (-w[0] + 2.0 * w[1] - 2.0 * w[3] + w[4]) / 2.0;
    let fourth = w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4];
    let start = k as f64 - (first + 2) as f64;
    let mut t = start;
    for _ in 0..4 {
        let slope = slope + t * (second + t * (third / 2.0 + t * fourth / 6.0));
        let bend = second + t * (third + t * fourth / 2.0);
        t -= slope / bend;
    }
    let summit = w[2] + t * (slope + t * (second / 2.0 + t * (third / 6.0 + t * fourth / 24.0)));
    // The extremum must lie between the neighbours, within the piece, and differ from the sample by no more than they do.
    let near = (own - left).abs().max((own - right).abs());
    ((t - start).abs() < 1.0 && t.abs() <= 2.0 && (summit - own).abs() <= near).then_some(summit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_between_samples_are_found_to_the_fifth_order() {
        let off = |count: usize| {
            let at = |k: usize| (std::f64::consts::TAU * (k as f64 + 0.3) / count as f64).sin();
            let values: Vec<f64> = (0..count).map(|k| at(k) + 0.3 * at(2 * k)).collect();
            let fine: Vec<f64> = (0..1_000_000)
                .map(|k| std::f64::consts::TAU * k as f64 / 1e6)
                .map(|a| a.sin() + 0.3 * (2.0 * a - 0.3 * std::f64::consts::TAU / count as f64).sin())
                .collect();
            let [low, high] = extremes(&values, &[count]);
            let exact = fine.iter().fold([f64::MAX, f64::MIN], |[l, h], v| [l.min(*v), h.max(*v)]);
            (low - exact[0]).abs().max((high - exact[1]).abs())
        };
        assert!(off(40) < 3e-5 && off(160) < 1e-7, "{} {}", off(40), off(160));
    }
}
