//! Derivatives of the smallest and largest values of states and outputs.
//!
//! **Idea.** At an extremum in time, a shift of its time does not matter to first order: its derivative is that of the
//! channel at a fixed time.
//!
//! **Equations.** y a channel along a cycle, x_p the derivative of the profile in normalised time:
//!
//! ```text
//!   (1)  d max y / dp = y_x x_p(t*) + y_p,    ∂y/∂t (t*) = 0
//! ```
//!
//! t* is a zero of the derivative of the Chebyshev interpolant of y on a mesh interval, which is exact for a state.
//!
//! **Fails when** y has a corner at its extremum, or several extrema of the same height that move differently: then only
//! one-sided derivatives exist.

use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::{Cycle, Point, Solution};
use std::f64::consts::PI;

/// Degree of the interpolant on a mesh interval.
const DEGREE: usize = 12;
/// Peaks of a channel that are located.
const PEAKS: usize = 6;
/// Variation along the cycle, relative to the size of a channel, below which it is constant; difference in height,
/// relative to the variation, below which two extrema are equally high. Above the discretisation error of any tolerance
/// in use.
const SAME: f64 = 1e-6;
/// Share of the variation in the last coefficients of the interpolant above which a channel is not smooth.
const SMOOTH: f64 = 1e-5;
/// Slope at a mesh point, in variations per interval, above which it is a corner of the channel.
const CORNER: f64 = 1e-3;

/// Place at which a channel has its extremum.
#[derive(Clone, Debug, PartialEq)]
enum Place {
    /// At the only state, or at an iterate of a map.
    Iterate(usize),
    /// At these times, in normalised time.
    Times(Vec<f64>),
    /// Everywhere: the channel is constant.
    Everywhere,
    /// Nowhere that has a derivative, for this reason.
    Nowhere(&'static str),
}

/// The smallest or largest value of a state or output.
#[derive(Clone, Debug, PartialEq)]
pub struct Extreme {
    /// State, or number of states plus output.
    pub channel: usize,
    /// True for the largest value.
    pub largest: bool,
    /// The value.
    pub value: f64,
    place: Place,
}

/// Returns the extremes of all states, then of all outputs: smallest and largest value each. An equilibrium has one value
/// each, the largest.
pub fn extremes(field: &dyn VectorField, point: &Point) -> Vec<Extreme> {
    let channels = field.dim() + field.output_count();
    match &point.solution {
        Solution::Equilibrium(x) => {
            let values = values(field, &point.parameters, x, &[]);
            let of =
                |channel: usize| Extreme { channel, largest: true, value: values[channel], place: Place::Iterate(0) };
            (0..channels).map(of).collect()
        }
        Solution::Cycle(cycle) if cycle.degree == 0 => of_iterates(field, &point.parameters, cycle),
        Solution::Cycle(cycle) => of_cycle(field, &point.parameters, cycle),
        Solution::Torus(_) => Vec::new(),
    }
}

/// Returns the derivative of an extreme along a change of the solution, `along` (the state, or a profile), and of the
/// parameters.
///
/// # Errors
/// The reason why there is none.
pub fn slope(
    field: &dyn VectorField,
    point: &Point,
    extreme: &Extreme,
    along: &[f64],
    change: &[f64],
) -> Result<f64, &'static str> {
    let n = field.dim();
    let at = |x: &[f64], dx: &[f64], time: Option<f64>| -> f64 {
        if let Some(own) = dx.get(extreme.channel) {
            return *own;
        }
        let direction = [dx, change].concat();
        let batch = Batch {
            lanes: 1,
            states: x,
            parameters: Parameters::Shared(&point.parameters),
            times: time.as_slice(),
            signs: &[],
        };
        let mut out = vec![0.0; field.output_count()];
        field.outputs_along(batch, &direction, &mut out);
        out[extreme.channel - n]
    };
    let found = match (&extreme.place, &point.solution) {
        (Place::Nowhere(reason), _) => return Err(reason),
        (_, Solution::Equilibrium(x)) => at(x, along, None),
        (_, Solution::Torus(_)) => return Err("sensitivities of tori are not supported"),
        (Place::Iterate(k), Solution::Cycle(cycle)) => {
            at(&cycle.profile[k * n..(k + 1) * n], &along[k * n..(k + 1) * n], None)
        }
        (place, Solution::Cycle(cycle)) => {
            let moved = Cycle { profile: along.to_vec(), gain: Vec::new(), ..cycle.clone() };
            let forced = f64::from(cycle.forcing_periods);
            let one = |t: f64| at(&cycle.state(t), &moved.state(t), (forced > 0.0).then_some(forced * t));
            let times: Vec<f64> = match place {
                Place::Times(times) => times.clone(),
                _ => (0..16).map(|k| (k as f64 + 0.37) / 16.0).collect(),
            };
            let all: Vec<f64> = times.iter().map(|t| one(*t)).collect();
            let (low, high) = all.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (v.min(a), v.max(b)));
            let size = along.iter().chain(change).fold(low.abs().max(high.abs()), |most, v| most.max(v.abs()));
            if high - low > 100.0 * SAME * size {
                return Err(match place {
                    Place::Everywhere => "constant along the cycle, but no longer if the parameter changes",
                    _ => "several extrema of the same height move differently",
                });
            }
            all[0]
        }
    };
    if found.is_finite() { Ok(found) } else { Err("the model gives no derivative of it") }
}

/// A solution with its change: the profile of the change, and that of the parameters.
pub struct Moved {
    /// The solution.
    pub at: Point,
    /// Change of the state, or of the profile on the same mesh.
    pub along: Vec<f64>,
    /// Change of all parameters.
    pub change: Vec<f64>,
}

/// Returns the largest difference of the change of a channel between two computations on different meshes, next to the
/// extremum of the first: within a mesh interval of the second to either side. The difference at the extremum alone depends
/// on where it lies between the nodes of both meshes, and may vanish there. 0 without a mesh.
pub fn difference(field: &dyn VectorField, extreme: &Extreme, own: &Moved, other: &Moved) -> f64 {
    /// Times within the interval.
    const TIMES: usize = 16;
    let (Solution::Cycle(cycle), Solution::Cycle(second)) = (&own.at.solution, &other.at.solution) else { return 0.0 };
    let times: Vec<f64> = match &extreme.place {
        Place::Times(times) => times
            .iter()
            .flat_map(|t| {
                let t = t.rem_euclid(1.0);
                let j = second.mesh.partition_point(|node| *node <= t).clamp(1, second.mesh.len() - 1);
                let h = second.mesh[j] - second.mesh[j - 1];
                (0..TIMES).map(move |k| t + h * ((2 * k + 1) as f64 / TIMES as f64 - 1.0))
            })
            .collect(),
        Place::Everywhere => (0..4 * TIMES).map(|k| (k as f64 + 0.37) / (4 * TIMES) as f64).collect(),
        _ => return 0.0,
    };
    let part = |cycle: &Cycle, along: &[f64]| Cycle { profile: along.to_vec(), gain: Vec::new(), ..cycle.clone() };
    let (first, second) = (part(cycle, &own.along), part(second, &other.along));
    let change: Vec<f64> = own.change.iter().zip(&other.change).map(|(a, b)| a - b).collect();
    let forced = f64::from(cycle.forcing_periods);
    let apart = |t: f64| {
        let moved: Vec<f64> = first.state(t).iter().zip(second.state(t)).map(|(a, b)| a - b).collect();
        if let Some(own) = moved.get(extreme.channel) {
            return own.abs();
        }
        let (x, time) = (cycle.state(t), (forced > 0.0).then_some(forced * t.rem_euclid(1.0)));
        let parameters = Parameters::Shared(&own.at.parameters);
        let batch = Batch { lanes: 1, states: &x, parameters, times: time.as_slice(), signs: &[] };
        let mut out = vec![0.0; field.output_count()];
        field.outputs_along(batch, &[&moved[..], &change].concat(), &mut out);
        out[extreme.channel - field.dim()].abs()
    };
    times.into_iter().map(apart).filter(|off| off.is_finite()).fold(0.0, f64::max)
}

/// All channels `[channels × lanes]` at states `[n × lanes]`.
fn values(field: &dyn VectorField, parameters: &[f64], states: &[f64], times: &[f64]) -> Vec<f64> {
    let lanes = states.len() / field.dim().max(1);
    let mut outputs = vec![0.0; field.output_count() * lanes];
    field.outputs(Batch { lanes, states, parameters: Parameters::Shared(parameters), times, signs: &[] }, &mut outputs);
    [states, &outputs].concat()
}

fn of_iterates(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle) -> Vec<Extreme> {
    let (n, count) = (field.dim(), cycle.intervals());
    let states: Vec<f64> = (0..n * count).map(|c| cycle.profile[c % count * n + c / count]).collect();
    let all = values(field, parameters, &states, &[]);
    let mut out = Vec::new();
    for (channel, line) in all.chunks_exact(count).enumerate() {
        for largest in [false, true] {
            let sign = if largest { 1.0 } else { -1.0 };
            let best = (0..count).max_by(|a, b| (sign * line[*a]).total_cmp(&(sign * line[*b]))).unwrap_or(0);
            out.push(Extreme { channel, largest, value: line[best], place: Place::Iterate(best) });
        }
    }
    out
}

fn of_cycle(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle) -> Vec<Extreme> {
    let (n, count, scheme) = (field.dim(), cycle.intervals(), cycle.scheme());
    let (block, lanes) = ((cycle.degree + 1) * n, count * (DEGREE + 1));
    let places: Vec<f64> = (0..=DEGREE).map(|k| 0.5 - 0.5 * (PI * k as f64 / DEGREE as f64).cos()).collect();
    let (mut states, mut times, mut x) = (vec![0.0; n * lanes], Vec::new(), vec![0.0; n]);
    for lane in 0..lanes {
        let (j, s) = (lane / (DEGREE + 1), places[lane % (DEGREE + 1)]);
        scheme.value_into(s, &cycle.profile[j * block..(j + 1) * block], &mut x);
        (0..n).for_each(|c| states[c * lanes + lane] = x[c]);
        if cycle.forcing_periods > 0 {
            let t = cycle.mesh[j] + s * (cycle.mesh[j + 1] - cycle.mesh[j]);
            times.push(f64::from(cycle.forcing_periods) * t);
        }
    }
    let all = values(field, parameters, &states, &times);
    let turns = |channel: usize| cycle.gain.get(channel).is_some_and(|gain| *gain != 0.0);
    let mut out = Vec::new();
    for (channel, line) in all.chunks_exact(lanes).enumerate() {
        for largest in [false, true] {
            let sign = if largest { 1.0 } else { -1.0 };
            let signed: Vec<f64> = line.iter().map(|v| sign * v).collect();
            let (value, place) = match turns(channel) {
                true => (f64::NAN, Place::Nowhere("an angle that turns has no extreme values")),
                false => Channel { line: &signed, mesh: &cycle.mesh, count }.highest(),
            };
            out.push(Extreme { channel, largest, value: sign * value, place });
        }
    }
    out
}

/// A channel at the Chebyshev points of all mesh intervals.
struct Channel<'a> {
    line: &'a [f64],
    mesh: &'a [f64],
    count: usize,
}

/// A peak: time and height, or the reason why it has no derivative.
struct Peak {
    time: f64,
    height: f64,
    flaw: Option<&'static str>,
}

impl Channel<'_> {
    fn highest(&self) -> (f64, Place) {
        let (low, high) = self.line.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (v.min(a), v.max(b)));
        let (spread, size) = (high - low, high.abs().max(low.abs()));
        if !spread.is_finite() {
            return (f64::NAN, Place::Nowhere("it is not finite along the cycle"));
        }
        if spread <= SAME * size {
            return (high, Place::Everywhere);
        }
        let width = DEGREE + 1;
        // The last point of an interval is the first of the next.
        let own = |i: usize| self.line[i / DEGREE % self.count * width + i % DEGREE];
        let samples = self.count * DEGREE;
        let mut tops: Vec<usize> = (0..samples)
            .filter(|&i| own(i) >= own((i + samples - 1) % samples) && own(i) >= own((i + 1) % samples))
            .collect();
        tops.sort_by(|a, b| own(*b).total_cmp(&own(*a)));
        let mut peaks: Vec<Peak> =
            tops.iter().take(PEAKS).map(|&i| self.peak(i / DEGREE, i % DEGREE, spread)).collect();
        peaks.sort_by(|a, b| b.height.total_cmp(&a.height));
        let top = peaks[0].height;
        peaks.retain(|peak| top - peak.height <= SAME * spread);
        match peaks.iter().find_map(|peak| peak.flaw) {
            Some(flaw) => (top, Place::Nowhere(flaw)),
            None => (top, Place::Times(peaks.iter().map(|peak| peak.time).collect())),
        }
    }

    /// The peak next to sample k < [`DEGREE`] of interval j.
    fn peak(&self, j: usize, k: usize, spread: f64) -> Peak {
        let own = self.interpolant(j);
        if k > 0 {
            return self.within(j, &own, [k - 1, k + 1], spread);
        }
        let before = (j + self.count - 1) % self.count;
        let previous = self.interpolant(before);
        // In variations per interval, on both sides of the mesh point.
        let (left, right) = (previous.slope(-1.0) / spread, own.slope(1.0) / spread);
        if right > 0.0 {
            return self.within(j, &own, [0, 1], spread);
        }
        if left < 0.0 {
            return self.within(before, &previous, [DEGREE - 1, DEGREE], spread);
        }
        let corner = left > CORNER || -right > CORNER;
        let flaw = corner.then_some("it has a corner at its extremum");
        Peak { time: self.mesh[j], height: self.line[j * (DEGREE + 1)], flaw }
    }

    fn interpolant(&self, j: usize) -> Interpolant {
        Interpolant::through(&self.line[j * (DEGREE + 1)..(j + 1) * (DEGREE + 1)])
    }

    /// The zero of the slope between two samples of an interval.
    fn within(&self, j: usize, own: &Interpolant, samples: [usize; 2], spread: f64) -> Peak {
        let [mut a, mut b] = samples.map(|k| (PI * k as f64 / DEGREE as f64).cos());
        for _ in 0..60 {
            let middle = 0.5 * (a + b);
            *if own.slope(middle) > 0.0 { &mut a } else { &mut b } = middle;
        }
        let (x, [start, end]) = (0.5 * (a + b), [self.mesh[j], self.mesh[j + 1]]);
        let rough = own.tail() > SMOOTH * spread;
        let flaw = rough.then_some("it is not smooth at its extremum");
        Peak { time: start + 0.5 * (1.0 - x) * (end - start), height: own.value(x), flaw }
    }
}

/// Polynomial in Chebyshev form; x = 1 is the left end of the interval and x = -1 the right.
struct Interpolant {
    coefficients: Vec<f64>,
    slopes: Vec<f64>,
}

impl Interpolant {
    /// The polynomial through values at the points x_k = cos(π k / D).
    fn through(values: &[f64]) -> Interpolant {
        let halved = |k: usize| if k == 0 || k == DEGREE { 0.5 } else { 1.0 };
        let term = |r: usize, k: usize| halved(k) * values[k] * (PI * (r * k) as f64 / DEGREE as f64).cos();
        let coefficient = |r: usize| 2.0 / DEGREE as f64 * halved(r) * (0..=DEGREE).map(|k| term(r, k)).sum::<f64>();
        let coefficients: Vec<f64> = (0..=DEGREE).map(coefficient).collect();
        let mut slopes = vec![0.0; DEGREE + 2];
        for r in (1..=DEGREE).rev() {
            slopes[r - 1] = slopes[r + 1] + 2.0 * r as f64 * coefficients[r];
        }
        slopes[0] *= 0.5;
        slopes.truncate(DEGREE);
        Interpolant { coefficients, slopes }
    }

    fn sum(coefficients: &[f64], x: f64) -> f64 {
        let (mut next, mut after) = (0.0, 0.0);
        for c in coefficients.iter().skip(1).rev() {
            (next, after) = (2.0 * x * next - after + c, next);
        }
        x * next - after + coefficients[0]
    }

    fn value(&self, x: f64) -> f64 {
        Interpolant::sum(&self.coefficients, x)
    }

    /// Derivative per interval, towards later times.
    fn slope(&self, x: f64) -> f64 {
        -2.0 * Interpolant::sum(&self.slopes, x)
    }

    /// Size of the last coefficients.
    fn tail(&self) -> f64 {
        self.coefficients[DEGREE - 1].abs() + self.coefficients[DEGREE].abs()
    }
}
