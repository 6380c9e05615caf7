//! One solution for the page: its numbers, its orbit and the harmonics of the orbit.
//!
//! **Equations.** Harmonic k of x with period T, from S samples x_s at times sT/S:
//! c_k = (1/S) Σ_s x_s exp(-2πi ks/S). For a complex signal u + iv harmonic ±k is c_k(u) + i c_k(v), with
//! c_{-k} the conjugate of c_k.
//!
//! **Fails when** an orbit has structure finer than T/S: its harmonics are aliased.

use crate::axes::Axis;
use foldline::contract::{Batch, Parameters, VectorField};
use foldline::diagram::{Cycle, Point, Solution};
use foldline::model::Model;
use serde_json::{Value, json};

/// Place of a point on its branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Position of an accepted point.
    Position(i64),
    /// Index of a special point.
    Special(i64),
}

/// Periods of a torus over which a trajectory is shown.
const ROUNDS: usize = 40;
/// Approximate number of positions at which an orbit is evaluated, enough for a smooth picture at full screen.
const PLACES: usize = 600;
/// Number of samples for harmonics.
const SAMPLES: usize = 512;
/// Highest harmonic; well below the 256 that the samples resolve.
const HIGHEST: usize = 40;

/// Returns header and columns of a solution. For a cycle these are the time, every state and output along the orbit,
/// then real and imaginary parts of the harmonics of each, and the switching functions along the orbit, which are
/// positive on one side of a contact. For an equilibrium there is one row.
pub(crate) fn solution(model: &Model, axes: &[Axis], point: &Point) -> (Value, Vec<Vec<f64>>) {
    let values: Vec<Option<f64>> = axes.iter().map(|axis| axis.quantity.of(point)).collect();
    let trust = point.trust;
    // A boundary-value problem has no multipliers.
    let known = if model.conditions() == [0, 0] { &point.spectrum[..] } else { &[] };
    let mut header = json!({
        "position": point.position, "values": values, "unstable": point.unstable,
        "spectrum": known.iter().map(|z| [z.re, z.im]).collect::<Vec<_>>(),
        "trivial": known.len().saturating_sub(point.free_spectrum().len()),
        "trust": {
            "discretisation": trust.discretisation, "residual": trust.residual, "trivial": trust.trivial_defect,
            "liouville": trust.liouville_defect, "spectrum": trust.spectrum,
        },
        "newton": point.cost.newton,
    });
    let mut switches = Vec::new();
    let (times, harmonics, columns) = match &point.solution {
        Solution::Equilibrium(state) => (vec![0.0], 0, channels(model, &point.parameters, state.clone(), &[0.0])),
        Solution::Cycle(cycle) if point.solution.is_stored() && cycle.intervals() > 0 => {
            header["period"] = cycle.period.into();
            header["mesh"] = cycle.mesh.to_vec().into();
            header["degree"] = cycle.degree.into();
            let times = places(cycle);
            let states: Vec<f64> = times.iter().flat_map(|time| cycle.state(*time)).collect();
            let forcing = f64::from(cycle.forcing_periods);
            let clock: Vec<f64> = times.iter().map(|time| time * forcing).collect();
            switches = switched(model, &point.parameters, &states, &clock);
            let mut columns = channels(model, &point.parameters, states, &clock);
            close(&mut columns, model, cycle);
            let clock: Vec<f64> = (0..SAMPLES).map(|s| s as f64 / SAMPLES as f64 * forcing).collect();
            let samples = channels(model, &point.parameters, cycle.uniform(SAMPLES), &clock);
            columns.extend(samples.iter().flat_map(|column| transform(column)));
            (times, HIGHEST + 1, columns)
        }
        Solution::Torus(torus) if point.solution.is_stored() => {
            // One trajectory on the torus, which does not close.
            header["period"] = (ROUNDS as f64 * torus.period).into();
            let count = ROUNDS * 48;
            let times: Vec<f64> = (0..count).map(|k| k as f64 / count as f64).collect();
            let place = |time: &f64| (ROUNDS as f64 * time).floor();
            let states = times
                .iter()
                .flat_map(|time| torus.state(torus.rotation * place(time), ROUNDS as f64 * time - place(time)));
            let forcing = f64::from(torus.forcing_periods) * ROUNDS as f64;
            let clock: Vec<f64> = times.iter().map(|time| time * forcing).collect();
            let columns = channels(model, &point.parameters, states.collect(), &clock);
            (times, 0, columns)
        }
        Solution::Torus(torus) => {
            header["period"] = torus.period.into();
            header["removed"] = true.into();
            (Vec::new(), 0, Vec::new())
        }
        Solution::Cycle(cycle) => {
            header["period"] = cycle.period.into();
            header["removed"] = true.into();
            (Vec::new(), 0, Vec::new())
        }
    };
    header["switches"] = (0..switches.len()).map(|k| model.switch_name(k)).collect::<Vec<_>>().into();
    header["rows"] = times.len().into();
    header["harmonics"] = harmonics.into();
    header["channels"] = (model.states.len() + model.outputs.len()).into();
    let out = if times.is_empty() { Vec::new() } else { [vec![times], columns, switches].concat() };
    (header, out)
}

/// Normalised times from 0 to 1: the same number on each mesh interval, so that they are dense where the orbit is sharp.
fn places(cycle: &Cycle) -> Vec<f64> {
    let each = PLACES.div_ceil(cycle.intervals()).clamp(cycle.degree + 1, 64);
    let inner = cycle.mesh.windows(2).flat_map(|ends| {
        let [from, to] = [ends[0], ends[1]];
        (0..each).map(move |k| from + (to - from) * k as f64 / each as f64)
    });
    inner.chain([1.0]).collect()
}

/// The state at time 1 is that of the next period: `Cycle::state` has added the gain of the angles to it.
/// Outputs there are those at time 0.
fn close(columns: &mut [Vec<f64>], model: &Model, cycle: &Cycle) {
    for (k, column) in columns.iter_mut().enumerate() {
        let gain = if k < model.states.len() { cycle.gain.get(k).copied().unwrap_or(0.0) } else { 0.0 };
        if let (Some(first), Some(last)) = (column.first().copied(), column.last_mut()) {
            *last = first + gain;
        }
    }
}

/// Returns the switching functions as columns; arguments as for [`channels`].
fn switched(model: &Model, parameters: &[f64], states: &[f64], clock: &[f64]) -> Vec<Vec<f64>> {
    let (n, lanes, count) = (model.states.len(), clock.len(), model.switch_count());
    if count == 0 || parameters.len() != model.parameters.len() {
        return Vec::new();
    }
    let transposed: Vec<f64> = (0..n * lanes).map(|k| states[(k % lanes) * n + k / lanes]).collect();
    let times = if model.forced() { clock } else { &[] };
    let at = Batch { lanes, states: &transposed, parameters: Parameters::Shared(parameters), times, signs: &[] };
    let mut out = vec![f64::NAN; count * lanes];
    model.switches(at, &mut out);
    out.chunks(lanes).map(<[f64]>::to_vec).collect()
}

/// Returns states and outputs as columns; `states` is `[place][state]`, `clock` the time in forcing periods.
fn channels(model: &Model, parameters: &[f64], states: Vec<f64>, clock: &[f64]) -> Vec<Vec<f64>> {
    let (n, lanes) = (model.states.len(), clock.len());
    let mut transposed = vec![0.0; n * lanes];
    for (place, state) in states.chunks_exact(n.max(1)).enumerate().take(lanes) {
        state.iter().enumerate().for_each(|(k, value)| transposed[k * lanes + place] = *value);
    }
    let mut outputs = vec![f64::NAN; model.outputs.len() * lanes];
    if parameters.len() == model.parameters.len() {
        let times = if model.forced() { clock } else { &[] };
        let at = Batch { lanes, states: &transposed, parameters: Parameters::Shared(parameters), times, signs: &[] };
        model.outputs(at, &mut outputs);
    }
    transposed.chunks(lanes).chain(outputs.chunks(lanes)).map(<[f64]>::to_vec).collect()
}

/// Real and imaginary parts of the harmonics 0 to [`HIGHEST`].
fn transform(samples: &[f64]) -> [Vec<f64>; 2] {
    let count = samples.len();
    let turn = std::f64::consts::TAU / count as f64;
    let waves: Vec<[f64; 2]> = (0..count).map(|s| [(turn * s as f64).cos(), -(turn * s as f64).sin()]).collect();
    let part = |k: usize, part: usize| {
        samples.iter().enumerate().map(|(s, x)| x * waves[k * s % count][part]).sum::<f64>() / count as f64
    };
    [0, 1].map(|own| (0..=HIGHEST).map(|k| part(k, own)).collect())
}

#[cfg(test)]
mod tests {
    use super::{HIGHEST, SAMPLES, transform};

    #[test]
    fn harmonics_of_a_sum_of_waves_are_its_amplitudes() {
        let wave = |s: usize| {
            let t = std::f64::consts::TAU * s as f64 / SAMPLES as f64;
            0.5 + 3.0 * (2.0 * t).cos() - 0.25 * (5.0 * t).sin()
        };
        let [real, imaginary] = transform(&(0..SAMPLES).map(wave).collect::<Vec<_>>());
        for k in 0..=HIGHEST {
            let expected = match k {
                0 => [0.5, 0.0],
                2 => [1.5, 0.0],
                5 => [0.0, 0.125],
                _ => [0.0, 0.0],
            };
            assert!(
                (real[k] - expected[0]).abs() < 1e-13 && (imaginary[k] - expected[1]).abs() < 1e-13,
                "harmonic {k}"
            );
        }
    }
}
