//! Quantities of solutions with their derivatives.
//!
//! **Idea.** Means, mean squares and harmonics are sums over the Gauss points of the mesh; a largest value is the value at
//! one instant. All are sums Σ W_i g(x(t_i), λ, t_i) over samples of the profile, whose derivatives follow from those of
//! g.
//!
//! **Equations.** With weights W_i, ℓ_l the Lagrange polynomials of the nodes X_{j,l} of the interval of t_i:
//!
//! ```text
//!   (1)  c = Σ W_i g_i,   ∂c/∂X_{j,l} = Σ_{i in j} W_i ℓ_l(t_i) ∂g_i/∂x,   ∂c/∂λ = Σ W_i ∂g_i/∂λ
//!   (2)  mean: W_i = b_i h_j;   harmonic k: W_i = b_i h_j e^(-2πi k t_i);   mean square: g² in place of g
//!   (3)  max g = g(x(τ), λ, τ) with dg/dτ = 0:   d max g = ∂g/∂x δx(τ) + ∂g/∂λ δλ        (envelope theorem)
//!   (4)  a = 2|c|:  da = 2 Re(c̄ dc)/|c|;    φ = -arg c:  dφ = -Im(c̄ dc)/|c|²
//! ```
//!
//! Where an interval is long compared with the period of a harmonic, it is divided, and the profile is interpolated. The
//! error of a sum is of order 2m in the interval length, as that of a mean.
//!
//! **Fails when** two maxima have equal values: the largest value has a corner there, and (3) belongs to one of them.

use super::harmonics::{Measured, Order, Signal, Term};
use super::quantity::{Quantity, decibels, wrapped};
use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::{Cycle, Point, Solution};
use crate::problem::gauss::Scheme;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Number of sections of an interval that are searched for a maximum.
const SECTIONS: usize = 8;
/// Largest phase of a harmonic over the part of an interval on which Gauss quadrature is used.
const TURN: f64 = 1.5;
/// Maxima that are refined.
const PEAKS: usize = 4;

/// Value of a quantity and its derivatives.
#[derive(Clone, Debug, Default)]
pub struct Gradient {
    /// The value.
    pub value: f64,
    /// Derivatives with respect to the numbers of the profile, or the state of an equilibrium.
    pub profile: Vec<f64>,
    /// Derivative with respect to the period of an autonomous cycle.
    pub period: f64,
    /// Derivatives with respect to all parameters `[k]`.
    pub parameters: Vec<f64>,
}

impl Gradient {
    fn scaled(mut self, by: f64) -> Gradient {
        self.value *= by;
        self.period *= by;
        self.profile.iter_mut().chain(&mut self.parameters).for_each(|d| *d *= by);
        self
    }

    /// self · a + other · b, for the derivatives.
    fn combined(mut self, a: f64, other: &Gradient, b: f64) -> Gradient {
        let mix = |own: &mut f64, other: &f64| *own = a * *own + b * other;
        mix(&mut self.period, &other.period);
        self.profile.iter_mut().zip(&other.profile).for_each(|(own, other)| mix(own, other));
        self.parameters.iter_mut().zip(&other.parameters).for_each(|(own, other)| mix(own, other));
        self
    }
}

/// A solution along which quantities are evaluated.
#[derive(Clone, Copy)]
pub struct Along<'a> {
    /// The field.
    pub field: &'a dyn VectorField,
    /// The solution.
    pub solution: &'a Solution,
    /// All parameters `[k]`.
    pub parameters: &'a [f64],
}

/// Samples of a solution: where they are, and how they follow from the nodes of an interval.
struct Samples {
    /// Normalised times; 0 for an equilibrium.
    times: Vec<f64>,
    /// First number of the profile of the interval of each sample.
    starts: Vec<usize>,
    /// `[sample][node]`.
    basis: Vec<f64>,
    nodes: usize,
    /// Weight of a mean.
    weights: Vec<f64>,
}

/// A local maximum or minimum of a signal.
#[derive(Clone, Copy, Debug)]
pub struct Summit {
    /// Normalised time.
    pub time: f64,
    /// Value.
    pub value: f64,
}

impl<'a> Along<'a> {
    /// A point of a branch.
    pub fn point(field: &'a dyn VectorField, point: &'a Point) -> Along<'a> {
        Along { field, solution: &point.solution, parameters: &point.parameters }
    }

    fn n(&self) -> usize {
        self.field.dim()
    }

    fn profile(&self) -> &'a [f64] {
        match self.solution {
            Solution::Equilibrium(x) => x,
            Solution::Cycle(cycle) => &cycle.profile,
            Solution::Torus(torus) => &torus.profile,
        }
    }

    /// The Gauss points, or the iterates of a map, or an equilibrium; refined for the harmonic of order `k`.
    fn gauss(&self, k: f64) -> Samples {
        let mut samples = Samples { times: vec![], starts: vec![], basis: vec![], nodes: 1, weights: vec![] };
        let cycle = match self.solution {
            // Quantities of tori are read from their ranges and averages, and not held.
            Solution::Equilibrium(_) | Solution::Torus(_) => {
                samples.push(0.0, 0, &[1.0], 1.0);
                return samples;
            }
            Solution::Cycle(cycle) => cycle,
        };
        let count = cycle.intervals();
        if cycle.degree == 0 {
            (0..count).for_each(|j| samples.push(j as f64 / count as f64, j * self.n(), &[1.0], 1.0 / count as f64));
            return samples;
        }
        let scheme = cycle.scheme();
        let block = (cycle.degree + 1) * self.n();
        samples.nodes = cycle.degree + 1;
        for (j, ends) in cycle.mesh.windows(2).enumerate() {
            let length = ends[1] - ends[0];
            let parts = ((TAU * k.abs() * length / TURN).ceil()).clamp(1.0, 1e4);
            for part in 0..parts as usize {
                for (node, weight) in scheme.nodes[1..].iter().zip(&scheme.weights) {
                    let s = (part as f64 + node) / parts;
                    let basis = scheme.interpolation(s);
                    samples.push(ends[0] + length * s, j * block, &basis, length * weight / parts);
                }
            }
        }
        samples
    }

    fn at(&self, cycle: &Cycle, time: f64) -> Samples {
        let (j, s) = place(cycle, time);
        let mut samples = Samples { times: vec![], starts: vec![], basis: vec![], nodes: 1, weights: vec![] };
        let scheme = cycle.scheme();
        samples.nodes = cycle.degree + 1;
        samples.push(time, j * (cycle.degree + 1) * self.n(), &scheme.interpolation(s), 1.0);
        samples
    }

    /// States at samples, `[n × lanes]`, and times in forcing periods.
    fn states(&self, samples: &Samples) -> (Vec<f64>, Vec<f64>) {
        let (n, lanes, profile) = (self.n(), samples.times.len(), self.profile());
        let mut states = vec![0.0; n * lanes];
        for (i, start) in samples.starts.iter().enumerate() {
            for (l, weight) in samples.basis[i * samples.nodes..(i + 1) * samples.nodes].iter().enumerate() {
                for c in 0..n {
                    states[c * lanes + i] += weight * profile[start + l * n + c];
                }
            }
        }
        let forced = self.solution.forcing_periods();
        let timed = self.field.forced() && !self.field.iterated();
        let times = if timed { samples.times.iter().map(|t| f64::from(forced) * t).collect() } else { Vec::new() };
        (states, times)
    }

    /// Values of a channel at samples.
    fn values(&self, channel: usize, samples: &Samples) -> Vec<f64> {
        let (states, times) = self.states(samples);
        let (n, lanes) = (self.n(), samples.times.len());
        if channel < n {
            return states[channel * lanes..(channel + 1) * lanes].to_vec();
        }
        let mut out = vec![0.0; self.field.output_count() * lanes];
        let parameters = Parameters::Shared(self.parameters);
        self.field.outputs(Batch { lanes, states: &states, parameters, times: &times, signs: &[] }, &mut out);
        let own = channel - n;
        out.get(own * lanes..(own + 1) * lanes).map_or(vec![f64::NAN; lanes], <[f64]>::to_vec)
    }

    /// Values of a channel at samples with derivatives in the states `[n × lanes]`, all parameters `[k × lanes]` and time;
    /// `None` if the field does not provide those of outputs.
    fn linear(&self, channel: usize, samples: &Samples) -> Option<[Vec<f64>; 4]> {
        let (states, times) = self.states(samples);
        let (n, k, lanes) = (self.n(), self.parameters.len(), samples.times.len());
        if channel < n {
            let mut by_state = vec![0.0; n * lanes];
            by_state[channel * lanes..(channel + 1) * lanes].fill(1.0);
            let values = states[channel * lanes..(channel + 1) * lanes].to_vec();
            return Some([values, by_state, vec![0.0; k * lanes], vec![0.0; lanes]]);
        }
        let (own, count) = (channel - n, self.field.output_count());
        let free: Vec<usize> = (0..k).collect();
        let [mut g, mut gx, mut gp, mut gt] = [1, n, k, 1].map(|size| vec![0.0; count * size * lanes]);
        let batch = Batch {
            lanes,
            states: &states,
            parameters: Parameters::Shared(self.parameters),
            times: &times,
            signs: &[],
        };
        if own >= count || !self.field.linearise_outputs(batch, &free, [&mut g, &mut gx, &mut gp, &mut gt]) {
            return None;
        }
        let part = |all: Vec<f64>, size: usize| all[own * size * lanes..(own + 1) * size * lanes].to_vec();
        Some([part(g, 1), part(gx, n), part(gp, k), part(gt, 1)])
    }

    /// Σ W_i g_i with its derivatives; `of` turns a value of g into a summand and its derivative.
    fn sum(
        &self,
        channel: usize,
        samples: &Samples,
        weights: &[f64],
        of: impl Fn(f64) -> [f64; 2],
    ) -> Option<Gradient> {
        let [g, gx, gp, _] = self.linear(channel, samples)?;
        let (n, k, lanes) = (self.n(), self.parameters.len(), samples.times.len());
        let mut found =
            Gradient { value: 0.0, profile: vec![0.0; self.profile().len()], period: 0.0, parameters: vec![0.0; k] };
        for i in 0..lanes {
            let [value, slope] = of(g[i]);
            found.value += weights[i] * value;
            let weight = weights[i] * slope;
            (0..k).for_each(|p| found.parameters[p] += weight * gp[p * lanes + i]);
            for (l, basis) in samples.basis[i * samples.nodes..(i + 1) * samples.nodes].iter().enumerate() {
                let to = &mut found.profile[samples.starts[i] + l * n..][..n];
                to.iter_mut().enumerate().for_each(|(c, d)| *d += weight * basis * gx[c * lanes + i]);
            }
        }
        Some(found)
    }

    /// Real and imaginary part of c_k with their derivatives.
    fn coefficient(&self, signal: Signal, k: i64) -> Option<[Gradient; 2]> {
        let samples = self.gauss(k as f64);
        let turned = |part: fn(f64) -> f64, sign: f64| -> Vec<f64> {
            samples
                .times
                .iter()
                .zip(&samples.weights)
                .map(|(t, w)| sign * w * part(TAU * (k as f64 * t).fract()))
                .collect()
        };
        let (cosines, sines) = (turned(f64::cos, 1.0), turned(f64::sin, -1.0));
        let plain = |value: f64| [value, 1.0];
        let part = |channel: usize, weights: &[f64]| self.sum(channel, &samples, weights, plain);
        match signal {
            Signal::Channel(channel) => Some([part(channel, &cosines)?, part(channel, &sines)?]),
            Signal::Pair(u, v) => {
                // (cos - i sin)(u + i v)
                let [uc, us, vc, vs] = [part(u, &cosines)?, part(u, &sines)?, part(v, &cosines)?, part(v, &sines)?];
                let (re, im) = (uc.value - vs.value, us.value + vc.value);
                let (mut first, mut second) = (uc.combined(1.0, &vs, -1.0), us.combined(1.0, &vc, 1.0));
                (first.value, second.value) = (re, im);
                Some([first, second])
            }
        }
    }

    /// Local maxima of sign · channel, the highest first.
    pub fn summits(&self, channel: usize, sign: f64) -> Vec<Summit> {
        let Solution::Cycle(cycle) = self.solution else { return Vec::new() };
        let (n, count) = (self.n(), cycle.intervals());
        if count == 0 || cycle.profile.is_empty() {
            return Vec::new();
        }
        let mut samples =
            Samples { times: vec![], starts: vec![], basis: vec![], nodes: cycle.degree + 1, weights: vec![] };
        if cycle.degree == 0 {
            samples = self.gauss(0.0);
            let values = self.values(channel, &samples);
            let mut found: Vec<Summit> =
                values.iter().zip(&samples.times).map(|(value, time)| Summit { time: *time, value: *value }).collect();
            found.sort_by(|a, b| (sign * b.value).total_cmp(&(sign * a.value)));
            return found;
        }
        let scheme = cycle.scheme();
        for (j, ends) in cycle.mesh.windows(2).enumerate() {
            for part in 0..SECTIONS {
                let s = part as f64 / SECTIONS as f64;
                let time = ends[0] + (ends[1] - ends[0]) * s;
                samples.push(time, j * (cycle.degree + 1) * n, &scheme.interpolation(s), 0.0);
            }
        }
        let values = self.values(channel, &samples);
        let lanes = values.len();
        let value = |i: usize| sign * values[i % lanes];
        let mut tops: Vec<usize> =
            (0..lanes).filter(|i| value(*i) >= value(i + lanes - 1) && value(*i) > value(i + 1)).collect();
        if tops.is_empty() {
            tops.push(0);
        }
        tops.sort_by(|a, b| value(*b).total_cmp(&value(*a)));
        tops.truncate(PEAKS);
        let time = |i: usize| samples.times[i % lanes] + (i / lanes) as f64;
        let mut found: Vec<Summit> = tops
            .into_iter()
            .map(|i| {
                let ends = [time(i + lanes - 1) - 1.0, if i + 1 == lanes { 1.0 } else { time(i + 1) }];
                let at = self.turning(cycle, channel, sign, ends).unwrap_or(time(i));
                let there = self.values(channel, &self.at(cycle, at))[0];
                match sign * there >= value(i) {
                    true => Summit { time: at, value: there },
                    false => Summit { time: time(i), value: values[i] },
                }
            })
            .collect();
        found.sort_by(|a, b| (sign * b.value).total_cmp(&(sign * a.value)));
        found
    }

    /// Zero of d(sign · channel)/dt from positive to negative between two times.
    fn turning(&self, cycle: &Cycle, channel: usize, sign: f64, ends: [f64; 2]) -> Option<f64> {
        let [mut a, mut b] = ends;
        let [mut fa, mut fb] = [sign * self.rate(cycle, channel, a)?, sign * self.rate(cycle, channel, b)?];
        if !(fa > 0.0 && fb < 0.0) {
            return None;
        }
        // Regula falsi with halved values, and bisection where it is slow.
        for round in 0..80 {
            let middle = if round % 4 == 3 { 0.5 * (a + b) } else { (a * fb - b * fa) / (fb - fa) };
            let rate = sign * self.rate(cycle, channel, middle)?;
            if rate == 0.0 || b - a < 1e-15 {
                return Some(middle);
            }
            if rate > 0.0 {
                (a, fa, fb) = (middle, rate, 0.5 * fb);
            } else {
                (b, fb, fa) = (middle, rate, 0.5 * fa);
            }
        }
        Some(0.5 * (a + b))
    }

    /// Derivative of a channel in normalised time.
    fn rate(&self, cycle: &Cycle, channel: usize, time: f64) -> Option<f64> {
        let (j, s) = place(cycle, time);
        let n = self.n();
        let samples = self.at(cycle, time);
        let [_, gx, _, gt] = self.linear(channel, &samples)?;
        let nodes = &cycle.profile[j * (cycle.degree + 1) * n..][..(cycle.degree + 1) * n];
        let slopes = slopes(cycle.scheme(), s);
        let length = cycle.mesh[j + 1] - cycle.mesh[j];
        let moved = |c: usize| slopes.iter().enumerate().map(|(l, d)| d * nodes[l * n + c]).sum::<f64>() / length;
        Some((0..n).map(|c| gx[c] * moved(c)).sum::<f64>() + f64::from(cycle.forcing_periods) * gt[0])
    }

    /// The largest (sign 1) or smallest (-1) value with its derivative. With `near`, the local one closest to that time.
    fn extreme(&self, channel: usize, sign: f64, near: Option<f64>) -> Option<(Gradient, Option<f64>)> {
        let Solution::Cycle(cycle) = self.solution else {
            return Some((self.sum(channel, &self.gauss(0.0), &[1.0], |value| [value, 1.0])?, None));
        };
        let all = self.summits(channel, sign);
        let apart = |summit: &Summit, time: f64| {
            let off = summit.time - time;
            (off - off.round()).abs()
        };
        let found = match near {
            None => all.first()?,
            Some(time) => all.iter().min_by(|a, b| apart(a, time).total_cmp(&apart(b, time)))?,
        };
        let samples = match cycle.degree {
            0 => self.gauss(0.0),
            _ => self.at(cycle, found.time),
        };
        let weights: Vec<f64> = samples.times.iter().map(|t| f64::from(u8::from(*t == found.time))).collect();
        Some((self.sum(channel, &samples, &weights, |value| [value, 1.0])?, Some(found.time)))
    }

    fn term(&self, term: Term, near: Option<f64>) -> Option<(Gradient, Option<f64>)> {
        let mean = |of: &dyn Fn(f64) -> [f64; 2]| {
            let samples = self.gauss(0.0);
            self.sum(term.signal.single()?, &samples, &samples.weights, of)
        };
        match term.measured {
            Measured::Largest => self.extreme(term.signal.single()?, 1.0, near),
            Measured::Smallest => self.extreme(term.signal.single()?, -1.0, near),
            Measured::Mean => Some((mean(&|value| [value, 1.0])?, None)),
            Measured::Rms => {
                let square = mean(&|value| [value * value, 2.0 * value])?;
                let root = square.value.max(0.0).sqrt();
                let mut found = square.scaled(0.5 / root);
                found.value = root;
                Some((found, None))
            }
            Measured::Amplitude(order) => {
                let [re, im] = self.coefficient(term.signal, order.in_cycle(self.solution.forcing_periods())?)?;
                let c = Complex64::new(re.value, im.value);
                let both = if term.signal.single().is_some() { 2.0 } else { 1.0 };
                let size = c.norm();
                let mut found = re.combined(both * c.re / size, &im, both * c.im / size);
                found.value = both * size;
                Some((found, None))
            }
            Measured::Phase(order) => {
                let [re, im] = self.coefficient(term.signal, order.in_cycle(self.solution.forcing_periods())?)?;
                let c = Complex64::new(re.value, im.value);
                let square = c.norm_sqr();
                let degrees = lagging(order) * 360.0 / TAU;
                // -Im(c̄ dc) = c.im d re - c.re d im
                let mut found = re.combined(degrees * c.im / square, &im, -degrees * c.re / square);
                found.value = -degrees * c.arg();
                Some((found, None))
            }
        }
    }

    fn none(&self) -> Gradient {
        let (profile, parameters) = (vec![0.0; self.profile().len()], vec![0.0; self.parameters.len()]);
        Gradient { value: 0.0, profile, period: 0.0, parameters }
    }

    /// The period with its derivatives.
    fn period(&self) -> Option<Gradient> {
        let Solution::Cycle(cycle) = self.solution else { return None };
        let mut found = Gradient { value: cycle.period, ..self.none() };
        if cycle.forcing_periods > 0 && cycle.degree > 0 {
            let slopes = self.field.time_unit_slopes(self.parameters);
            found.parameters = slopes.iter().map(|slope| f64::from(cycle.forcing_periods) * slope).collect();
        } else if cycle.degree > 0 {
            found.period = 1.0;
        }
        Some(found)
    }

    /// A quantity with its derivatives, and the time of the extremum that decides it. With `near`, extrema are the local
    /// ones closest to that time. `None` if the quantity is not defined, or the field lacks derivatives of its outputs.
    pub fn gradient(&self, quantity: Quantity, near: Option<f64>) -> Option<(Gradient, Option<f64>)> {
        let whole = |found: Option<Gradient>| Some((found?, None));
        let term = |signal: usize, measured: Measured| Term { signal: Signal::Channel(signal), measured };
        match quantity {
            Quantity::Parameter(index) => {
                let mut found = self.none();
                found.value = *self.parameters.get(index)?;
                found.parameters[index] = 1.0;
                Some((found, None))
            }
            Quantity::Period => whole(self.period()),
            Quantity::Frequency => {
                let period = self.period()?;
                let value = 1.0 / period.value;
                let mut found = period.scaled(-value * value);
                found.value = value;
                Some((found, None))
            }
            // Held by the problem of tori itself.
            Quantity::Rotation => None,
            Quantity::Smallest(k) => self.term(term(k, Measured::Smallest), near),
            Quantity::Largest(k) => self.term(term(k, Measured::Largest), near),
            Quantity::Mean(k) => self.term(term(k, Measured::Mean), None),
            Quantity::Rms(k) => self.term(term(k, Measured::Rms), None),
            Quantity::Integral(k) => {
                let (mean, period) = (self.term(term(k, Measured::Mean), None)?.0, self.period()?);
                let (a, b) = (mean.value, period.value);
                let mut found = mean.combined(b, &period, a);
                found.value = a * b;
                Some((found, None))
            }
            Quantity::Norm(n) => {
                let samples = self.gauss(0.0);
                let square = |value: f64| [value * value, 2.0 * value];
                let mut total = self.none();
                for k in 0..n {
                    let own = self.sum(k, &samples, &samples.weights, square)?;
                    let value = total.value + own.value;
                    total = total.combined(1.0, &own, 1.0);
                    total.value = value;
                }
                let root = total.value.max(0.0).sqrt();
                let mut found = total.scaled(0.5 / root);
                found.value = root;
                Some((found, None))
            }
            Quantity::At(k, place) => {
                let Solution::Cycle(cycle) = self.solution else { return None };
                let samples = self.at(cycle, f64::from_bits(place));
                whole(self.sum(k, &samples, &[1.0], |value| [value, 1.0]))
            }
            Quantity::Iterate(..) => None,
            Quantity::Of(own) => self.term(own, near),
            Quantity::Decibels(own) => {
                let (found, time) = self.term(own, near)?;
                let value = found.value;
                let mut found = found.scaled(20.0 / std::f64::consts::LN_10 / value);
                found.value = decibels(value);
                Some((found, time))
            }
            Quantity::Ratio(a, b) | Quantity::RatioDecibels(a, b) => {
                let ((a, time), (b, _)) = (self.term(a, near)?, self.term(b, None)?);
                let ratio = a.value / b.value;
                let (top, bottom) = (1.0 / b.value, -ratio / b.value);
                let mut found = a.combined(top, &b, bottom);
                found.value = ratio;
                if matches!(quantity, Quantity::RatioDecibels(..)) {
                    found = found.scaled(20.0 / std::f64::consts::LN_10 / ratio);
                    found.value = decibels(ratio);
                }
                Some((found, time))
            }
            Quantity::Difference(a, b) => {
                let ((a, _), (b, _)) = (self.term(a, None)?, self.term(b, None)?);
                let value = wrapped(a.value - b.value);
                let mut found = a.combined(1.0, &b, -1.0);
                found.value = value;
                Some((found, None))
            }
        }
    }
}

impl Samples {
    fn push(&mut self, time: f64, start: usize, basis: &[f64], weight: f64) {
        self.times.push(time);
        self.starts.push(start);
        self.basis.extend_from_slice(basis);
        self.weights.push(weight);
    }
}

/// Interval of a normalised time, and the position in it. The end, 1, belongs to the last interval: the two ends of a solution of a
/// boundary-value problem differ.
fn place(cycle: &Cycle, time: f64) -> (usize, f64) {
    let t = if time == 1.0 { 1.0 } else { time - time.floor() };
    let j = cycle.mesh.partition_point(|end| *end <= t).clamp(1, cycle.intervals()) - 1;
    (j, (t - cycle.mesh[j]) / (cycle.mesh[j + 1] - cycle.mesh[j]))
}

/// Derivatives ℓ_l'(s) `[m + 1]`: the polynomial through the derivatives at the Gauss points.
fn slopes(scheme: &Scheme, s: f64) -> Vec<f64> {
    let (m, nodes) = (scheme.degree, &scheme.nodes[1..]);
    let through =
        |i: usize| (0..m).filter(|l| *l != i).map(|l| (s - nodes[l]) / (nodes[i] - nodes[l])).product::<f64>();
    let weights: Vec<f64> = (0..m).map(through).collect();
    (0..=m).map(|l| (0..m).map(|i| weights[i] * scheme.derivative[i * (m + 1) + l]).sum()).collect()
}

/// Sign with which an argument becomes a lag: backward whirl turns the other way.
fn lagging(order: Order) -> f64 {
    if order.numerator < 0 { -1.0 } else { 1.0 }
}

/// Amplitude or phase of a harmonic at a point. A harmonic that the cycle does not have is 0; an equilibrium has none but
/// the mean.
pub(super) fn harmonic(field: &dyn VectorField, point: &Point, term: Term) -> Option<f64> {
    let order = term.order()?;
    let amplitude = matches!(term.measured, Measured::Amplitude(_));
    let Solution::Cycle(cycle) = &point.solution else { return amplitude.then_some(0.0) };
    if cycle.profile.is_empty() || cycle.degree == 0 {
        return None;
    }
    let Some(k) = order.in_cycle(cycle.forcing_periods) else { return amplitude.then_some(0.0) };
    let along = Along::point(field, point);
    let samples = along.gauss(k as f64);
    let channel = |channel: usize| -> Complex64 {
        let values = along.values(channel, &samples);
        let all = values.iter().zip(&samples.times).zip(&samples.weights);
        all.map(|((g, t), w)| Complex64::from_polar(w * g, -TAU * (k as f64 * t).fract())).sum()
    };
    let (c, both) = match term.signal {
        Signal::Channel(own) => (channel(own), 2.0),
        Signal::Pair(u, v) => (channel(u) + Complex64::I * channel(v), 1.0),
    };
    let found = if amplitude { both * c.norm() } else { -lagging(order) * c.arg() * 360.0 / TAU };
    // -180° and 180° are one angle.
    Some(if amplitude { found } else { wrapped(found) })
}
