//! Smallest and largest values of states and outputs.
//!
//! **Idea.** Sample densely, then refine by parabolas through three points of the polynomial profile. Between samples a
//! peak may rise above a higher sample, so the best few peaks are refined, not only the best one, and all of them where
//! the state jumps. At the ends of an interval that is not periodic, the polynomials are continued a little, and only places
//! inside count.

use super::gauss::Scheme;
use crate::contract::{Batch, Parameters, VectorField};
use crate::linalg::lane::{Eight, Lane};
use crate::linalg::panel;

/// Number of peaks of one channel that are refined, unless the state jumps.
const PEAKS: usize = 3;
/// Distance between a peak and its neighbours, in samples, at which refinement stops.
const CLOSE: f64 = 0.005;
/// Largest relative change of the second derivative at a round peak, as the neighbours come five times closer. At a
/// corner it grows five times.
const ROUND: f64 = 0.5;
/// Maximum number of refinements: four, plus one for every shift of the peak by up to a sample.
const ROUNDS: usize = 12;

/// Ranges at an equilibrium: every range is a single value.
pub fn of_state(field: &dyn VectorField, parameters: &[f64], x: &[f64]) -> Vec<[f64; 2]> {
    let mut outputs = vec![0.0; field.output_count()];
    field.outputs(
        Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times: &[], signs: &[] },
        &mut outputs,
    );
    x.iter().chain(&outputs).map(|&v| [v, v]).collect()
}

/// Ranges over a periodic profile `[interval][node][component]` on a mesh, which lasts `forcing_periods` (0 for an
/// autonomous field).
pub fn of_profile(
    field: &dyn VectorField,
    parameters: &[f64],
    [profile, mesh]: [&[f64]; 2],
    forcing_periods: u32,
    scheme: &Scheme,
) -> Vec<[f64; 2]> {
    let open = field.conditions() != [0, 0];
    let orbit = Orbit { field, parameters, profile, mesh, forcing_periods, scheme, count: mesh.len() - 1, open };
    let channels = field.dim() + field.output_count();
    let lanes = orbit.lanes();
    let values = orbit.samples();
    // For every channel and sign, the largest value times the sign, and the best few peaks.
    let mut best = Vec::with_capacity(2 * channels);
    let mut peaks: Vec<Peak> = Vec::with_capacity(2 * PEAKS * channels);
    // Parabolas across a jump of the state rise far above the samples.
    let kept = if field.event_count() > 0 { usize::MAX } else { PEAKS };
    for line in values.chunks_exact(lanes) {
        for (sign, (top, places)) in [-1.0, 1.0].into_iter().zip(outermost(line, open, kept)) {
            peaks.extend(places.iter().map(|&place| Peak {
                of: best.len(),
                sign,
                place: place as f64,
                spacing: 1.0,
                reach: f64::INFINITY,
                curvature: f64::NAN,
            }));
            best.push(top);
        }
    }
    if open {
        let mut end = vec![0.0; field.dim()];
        orbit.state_into(lanes as f64, &mut end);
        let values = orbit.with_outputs(end, &orbit.times([lanes as f64].into_iter()));
        best.iter_mut().enumerate().for_each(|(k, best)| *best = best.max(values[k / 2] * [-1.0, 1.0][k % 2]));
    }
    for _ in 0..ROUNDS {
        orbit.refine(&mut peaks, &mut best);
        peaks.retain(|peak| peak.spacing > CLOSE && peak.reach >= best[peak.of]);
    }
    best.chunks_exact(2).map(|pair| [-pair[0], pair[1]]).collect()
}

/// A position, in samples, near which a channel times a sign has a peak.
struct Peak {
    /// Index of channel and sign.
    of: usize,
    sign: f64,
    place: f64,
    /// Distance of the neighbours that are evaluated.
    spacing: f64,
    /// Upper bound of the peak: the maximum of its parabola plus twice the mean drop to its neighbours.
    reach: f64,
    /// Second derivative per sample from the last three values; NaN if there is none.
    curvature: f64,
}

struct Orbit<'a> {
    field: &'a dyn VectorField,
    parameters: &'a [f64],
    profile: &'a [f64],
    mesh: &'a [f64],
    forcing_periods: u32,
    scheme: &'a Scheme,
    /// N, the number of intervals.
    count: usize,
    /// True for the solution of a boundary-value problem, whose end is not its beginning.
    open: bool,
}

impl Orbit<'_> {
    /// Samples per interval.
    fn density(&self) -> usize {
        2 * self.scheme.degree
    }

    fn lanes(&self) -> usize {
        self.count * self.density()
    }

    /// All channels at all samples in order of time, `[channel][sample]`.
    fn samples(&self) -> Vec<f64> {
        let (n, nodes, density, count) = (self.field.dim(), self.scheme.degree + 1, self.density(), self.count);
        let weights: Vec<f64> =
            (0..density).flat_map(|s| self.scheme.interpolation(s as f64 / density as f64)).collect();
        let mut by_component = vec![0.0; self.profile.len()];
        panel::by_component(self.profile, nodes, n, &mut by_component);
        let mut states = Vec::with_capacity((n + self.field.output_count()) * self.lanes());
        states.resize(n * self.lanes(), 0.0);
        let mut sampled = vec![0.0; self.lanes()];
        for (own, line) in by_component.chunks_exact(nodes * count).zip(states.chunks_exact_mut(self.lanes())) {
            panel::multiply(&weights, own, count, &mut sampled);
            for (s, values) in sampled.chunks_exact(count).enumerate() {
                line[s..].iter_mut().step_by(density).zip(values).for_each(|(x, value)| *x = *value);
            }
        }
        let places = (0..self.lanes()).map(|k| k as f64);
        self.with_outputs(states, &self.times(places))
    }

    /// Times at positions, in forcing periods; empty without forcing.
    fn times(&self, places: impl Iterator<Item = f64>) -> Vec<f64> {
        if self.forcing_periods == 0 {
            return Vec::new();
        }
        let time = |place: f64| {
            let (j, s) = self.interval(place);
            f64::from(self.forcing_periods) * (self.mesh[j] + s * (self.mesh[j + 1] - self.mesh[j]))
        };
        places.map(time).collect()
    }

    /// Interval that contains a position in samples, and the position within it.
    fn interval(&self, place: f64) -> (usize, f64) {
        if self.open {
            // The first and the last polynomial extend beyond the ends.
            let position = place / self.density() as f64;
            let j = (position.max(0.0).floor() as usize).min(self.count - 1);
            return (j, position - j as f64);
        }
        let position = place.rem_euclid(self.lanes() as f64) / self.density() as f64;
        let j = (position.floor() as usize).min(self.count - 1);
        (j, position - j as f64)
    }

    /// States `[n × lanes]` at these times, followed by the outputs.
    fn with_outputs(&self, states: Vec<f64>, times: &[f64]) -> Vec<f64> {
        let n = self.field.dim();
        let lanes = states.len() / n;
        let mut outputs = vec![0.0; self.field.output_count() * lanes];
        let batch =
            Batch { lanes, states: &states, parameters: Parameters::Shared(self.parameters), times, signs: &[] };
        self.field.outputs(batch, &mut outputs);
        let mut values = states;
        values.append(&mut outputs);
        values
    }

    /// Moves each peak to the maximum of the parabola through itself and its neighbours, and moves these closer if it
    /// lies between them. Next to the end of an interval, where samples are not equidistant in time, it may not.
    fn refine(&self, peaks: &mut [Peak], best: &mut [f64]) {
        let (n, probes) = (self.field.dim(), 3 * peaks.len());
        if probes == 0 {
            return;
        }
        let mut states = vec![0.0; n * probes];
        let mut x = vec![0.0; n];
        for (p, peak) in peaks.iter().enumerate() {
            for (k, offset) in [-peak.spacing, 0.0, peak.spacing].into_iter().enumerate() {
                self.state_into(peak.place + offset, &mut x);
                (0..n).for_each(|i| states[i * probes + 3 * p + k] = x[i]);
            }
        }
        let near = peaks.iter().flat_map(|peak| [-1.0, 0.0, 1.0].map(|k| peak.place + k * peak.spacing));
        let times = self.times(near);
        let values = self.with_outputs(states, &times);
        for (p, peak) in peaks.iter_mut().enumerate() {
            let at = (peak.of / 2) * probes + 3 * p;
            let [a, b, c] = [0, 1, 2].map(|k| peak.sign * values[at + k]);
            let best = &mut best[peak.of];
            let inside = |place: f64| !self.open || (0.0..=self.lanes() as f64).contains(&place);
            for (value, k) in [(a, -1.0), (b, 0.0), (c, 1.0)] {
                if inside(peak.place + k * peak.spacing) {
                    *best = best.max(value);
                }
            }
            let bend = a - 2.0 * b + c;
            let between = b >= a && b >= c;
            // At a corner, where a derivative jumps, it grows as the neighbours come closer, and the parabola overshoots.
            let before = std::mem::replace(&mut peak.curvature, bend / (peak.spacing * peak.spacing));
            let round = (peak.curvature - before).abs() <= ROUND * before.abs();
            peak.reach = f64::INFINITY;
            if bend < 0.0 {
                let shift = 0.5 * (a - c) / bend;
                if between {
                    peak.reach = b - 0.125 * (c - a) * (c - a) / bend - bend;
                }
                peak.place += peak.spacing * shift.clamp(-1.0, 1.0);
                if between && round && peak.spacing < 0.1 && inside(peak.place) {
                    *best = best.max(b - 0.125 * (c - a) * (c - a) / bend);
                }
            } else if a > b || c > b {
                peak.place += if a > c { -peak.spacing } else { peak.spacing };
            }
            // A constant has its maximum everywhere.
            if between {
                peak.spacing *= 0.2;
            }
        }
    }

    /// Evaluates the state at a position in samples.
    fn state_into(&self, place: f64, x: &mut [f64]) {
        let (j, s) = self.interval(place);
        let block = (self.scheme.degree + 1) * x.len();
        self.scheme.value_into(s, &self.profile[j * block..(j + 1) * block], x);
    }
}

/// Largest value of sign · line for both signs, -1 first, and the samples of its best few peaks, best first.
fn outermost(line: &[f64], open: bool, kept: usize) -> [(f64, Vec<usize>); 2] {
    let lanes = line.len();
    let mut found = [Summit::default(), Summit::default()];
    let mut look = |l: usize| {
        let [first, last] = if open { [0, lanes - 1] } else { [lanes - 1, 0] };
        let triple = [line[if l > 0 { l - 1 } else { first }], line[l], line[if l + 1 < lanes { l + 1 } else { last }]];
        // A sample between its neighbours is no peak, and one of them is more extreme for either sign.
        let [before, here, after] = triple;
        if (before < here && here < after) || (before > here && here > after) {
            return;
        }
        let [low, high] = &mut found;
        low.look(l, triple.map(|v| -v), kept);
        high.look(l, triple, kept);
    };
    // If the line is monotonic over a block and one sample on either side, no sample in it is a peak.
    const BLOCK: usize = Eight::COUNT;
    let mut l = 0;
    while l < lanes {
        let next = (l + BLOCK).min(lanes);
        let inside = l > 0 && next < lanes && next == l + BLOCK;
        if !(inside && is_monotone(&line[l - 1..=next])) {
            (l..next).for_each(&mut look);
        }
        l = next;
    }
    found.map(|summit| (summit.top, summit.peaks.into_iter().map(|peak| peak.1).collect()))
}

/// True if ten numbers are strictly monotonic.
fn is_monotone(line: &[f64]) -> bool {
    let (before, here) = (Eight::load(line), Eight::load(&line[1..]));
    let [next, last] = [8, 9].map(|k| line[k]);
    match next < last {
        true => before.all(here, |x, y| x < y),
        false => next > last && before.all(here, |x, y| x > y),
    }
}

/// The largest sample and the best few peaks.
struct Summit {
    top: f64,
    /// (Maximum of the parabola through a peak and its neighbours, sample); the first of equal ones stays first.
    peaks: Vec<(f64, usize)>,
}

impl Default for Summit {
    fn default() -> Summit {
        Summit { top: f64::NEG_INFINITY, peaks: Vec::with_capacity(PEAKS + 1) }
    }
}

impl Summit {
    /// Considers sample l, given with its neighbours, as one of the best `kept` peaks.
    #[inline(always)]
    fn look(&mut self, l: usize, [before, here, after]: [f64; 3], kept: usize) {
        if here > self.top {
            self.top = here;
        }
        if here >= before && here >= after {
            let bend = 2.0 * here - before - after;
            let rise = if bend > 0.0 { (after - before) * (after - before) / (8.0 * bend) } else { 0.0 };
            let at = self.peaks.partition_point(|peak| peak.0.total_cmp(&(here + rise)).is_ge());
            self.peaks.insert(at, (here + rise, l));
            self.peaks.truncate(kept);
        }
    }
}
