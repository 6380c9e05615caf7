//! Smallest and largest values of states and outputs.
//!
//! **Idea.** Sample densely, then refine by parabolas through three points of the polynomial profile. Between samples a peak may
//! rise above a higher sample, so the best few peaks are refined, not only the best one.

use super::gauss::Scheme;
use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::Mesh;

/// Peaks of one channel that are refined.
const PEAKS: usize = 3;

/// At one state: every range is a single value.
pub fn of_state(field: &dyn VectorField, parameters: &[f64], x: &[f64]) -> Vec<[f64; 2]> {
    let mut outputs = vec![0.0; field.output_count()];
    field.outputs(Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters) }, &mut outputs);
    x.iter().chain(&outputs).map(|&v| [v, v]).collect()
}

/// Over a periodic profile `[interval][node][component]`.
pub fn of_profile(
    field: &dyn VectorField,
    parameters: &[f64],
    profile: &[f64],
    mesh: &Mesh,
    scheme: &Scheme,
) -> Vec<[f64; 2]> {
    let (n, outputs, m, count) = (field.dim(), field.output_count(), scheme.degree, mesh.len() - 1);
    let channels = n + outputs;
    let per_interval = 2 * m;
    let lanes = count * per_interval;
    let inner: Vec<Vec<f64>> =
        (0..per_interval).map(|s| scheme.interpolation(s as f64 / per_interval as f64)).collect();
    let mut states = vec![0.0; n * lanes];
    for j in 0..count {
        for (s, weights) in inner.iter().enumerate() {
            let lane = j * per_interval + s;
            for (k, w) in weights.iter().enumerate() {
                for i in 0..n {
                    states[i * lanes + lane] += w * profile[(j * (m + 1) + k) * n + i];
                }
            }
        }
    }
    let mut values = states.clone();
    values.resize(channels * lanes, 0.0);
    let batch = Batch { lanes, states: &states, parameters: Parameters::Shared(parameters) };
    field.outputs(batch, &mut values[n * lanes..]);

    // For every channel and both signs the best few peaks: (channel and sign, place in units of samples).
    let mut places: Vec<(usize, f64)> = Vec::with_capacity(2 * PEAKS * channels);
    let mut best = vec![f64::NEG_INFINITY; 2 * channels];
    for c in 0..channels {
        let line = &values[c * lanes..(c + 1) * lanes];
        for (q, sign) in [(2 * c, -1.0), (2 * c + 1, 1.0)] {
            let (mut peaks, mut top) = (Vec::new(), 0);
            for l in 0..lanes {
                let [a, b, d] = [(l + lanes - 1) % lanes, l, (l + 1) % lanes].map(|k| sign * line[k]);
                if b >= a && b >= d {
                    // How far the parabola rises above the sample.
                    let rise = if a + d < 2.0 * b { (d - a) * (d - a) / (8.0 * (2.0 * b - a - d)) } else { 0.0 };
                    peaks.push((b + rise, l));
                }
                top = if b > sign * line[top] { l } else { top };
            }
            best[q] = sign * line[top];
            peaks.sort_by(|x, y| y.0.total_cmp(&x.0));
            places.extend(peaks.iter().take(PEAKS).map(|(_, l)| (q, *l as f64)));
        }
    }
    let mut spacing = 1.0;
    for _ in 0..4 {
        let probes = 3 * places.len();
        let mut states = vec![0.0; n * probes];
        for (probe, (_, place)) in places.iter().enumerate() {
            for (k, offset) in [-spacing, 0.0, spacing].iter().enumerate() {
                let position = (place + offset).rem_euclid(lanes as f64) / per_interval as f64;
                let j = (position.floor() as usize).min(count - 1);
                let weights = scheme.interpolation(position - j as f64);
                for (node, w) in weights.iter().enumerate() {
                    for i in 0..n {
                        states[i * probes + 3 * probe + k] += w * profile[(j * (m + 1) + node) * n + i];
                    }
                }
            }
        }
        let mut values = states.clone();
        values.resize(channels * probes, 0.0);
        let batch = Batch { lanes: probes, states: &states, parameters: Parameters::Shared(parameters) };
        field.outputs(batch, &mut values[n * probes..]);
        for (probe, (q, place)) in places.iter_mut().enumerate() {
            let q = *q;
            let sign = if q % 2 == 0 { -1.0 } else { 1.0 };
            let at = (q / 2) * probes + 3 * probe;
            let (a, b, c) = (sign * values[at], sign * values[at + 1], sign * values[at + 2]);
            best[q] = best[q].max(a).max(b).max(c);
            let bend = a - 2.0 * b + c;
            if bend < 0.0 {
                let shift = 0.5 * (a - c) / bend;
                *place += spacing * shift.clamp(-1.0, 1.0);
                let top = b - 0.125 * (c - a) * (c - a) / bend;
                if shift.abs() <= 1.0 && spacing < 0.1 {
                    best[q] = best[q].max(top);
                }
            } else if a > b || c > b {
                *place += if a > c { -spacing } else { spacing };
            }
        }
        spacing *= 0.2;
    }
    (0..channels).map(|c| [-best[2 * c], best[2 * c + 1]]).collect()
}
