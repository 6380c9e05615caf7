//! Response of solutions to a small further forcing, to first order.
//!
//! **Idea.** A small forcing of another frequency turns a cycle into a torus and an equilibrium into a cycle. To first
//! order in the amplitude of the forcing the perturbation is a linear problem along the unperturbed solution: it says
//! where gravity, a second unbalance or a ripple matters before any torus is computed. The response is large where the
//! frequency comes near the imaginary part of a weakly damped exponent, so the distance to the nearest one is given too.
//!
//! **Equations.** With A = ∂f/∂x along a solution of period T, the forcing ε Re(b e^{iνt}) on the right-hand side, and
//! multipliers μ_k (for an equilibrium, eigenvalues λ_k):
//!
//! ```text
//!   (1)  p' = (A(t) - iν) p + b,  p(T) = p(0);   x(t) + ε Re(p(t) e^{iνt})
//!   (2)  χ_i = max_t |p_i(t)|
//!   (3)  distance = min_k,m |(ln μ_k + 2πim)/T - iν|,   or min_k |λ_k - iν|
//! ```
//!
//! (1) is solved by collocation at the points and on the mesh of the cycle, and again with every interval halved. The
//! stated error is the difference of both, plus the error of the multipliers over the distance of e^{iνT} from them.
//! Without forcing a shift in time costs nothing: χ then includes the drift of the phase, and is unbounded where ν is a
//! multiple of 2π/T, at which the forcing locks the cycle.
//!
//! **Source.** wereley1990 (frequency response of linear time-periodic systems).
//!
//! **Fails when** f or the state jumps along the solution, and for tori: no response is given.

use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::{Cycle, Point, Solution};
use crate::special::sliding;
use foldline_general::{Mat, complex_solution};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// A small harmonic forcing b e^{iνt} of the right-hand sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Forcing {
    /// `[n]` b: the real part is the amplitude of cos νt in the equation of each state, the imaginary part that of
    /// -sin νt.
    pub amplitudes: Vec<Complex64>,
    /// ν, in radians per unit of time of the model.
    pub frequency: f64,
}

/// Response to a forcing of unit size.
#[derive(Clone, Debug, PartialEq)]
pub struct Susceptibility {
    /// `[n]` χ of (2): largest amplitude of each state per amplitude of the forcing.
    pub response: Vec<f64>,
    /// Error of every χ, relative to the largest in units of the scales.
    pub error: f64,
    /// (3): distance from the nearest exponent, in radians per unit of time.
    pub distance: f64,
}

/// Largest number of unknowns of the cyclic system; intervals are combined until there are no more.
const UNKNOWNS: usize = 800;

/// Returns the response of a point.
///
/// # Errors
/// Reason for which there is none.
pub fn susceptibility(
    field: &dyn VectorField,
    scales: &[f64],
    point: &Point,
    forcing: &Forcing,
) -> Result<Susceptibility, String> {
    if field.iterated() || field.conditions() != [0, 0] {
        return Err("only equilibria and cycles of differential equations respond".into());
    }
    if field.event_count() > 0 {
        return Err("the state jumps at events".into());
    }
    if let Solution::Cycle(cycle) = &point.solution
        && sliding::meets_jump(field, &point.parameters, cycle)
    {
        return Err("the right-hand side jumps along the cycle".into());
    }
    let frequency = Complex64::new(0.0, forcing.frequency);
    let nearest = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::INFINITY, f64::min);
    match &point.solution {
        Solution::Torus(_) => Err("responses of tori are not computed".into()),
        Solution::Equilibrium(x) => {
            let n = x.len();
            let a = jacobian(field, &point.parameters, x, 0.0);
            let left = Mat::from_fn(n, n, |i, j| frequency * f64::from(u8::from(i == j)) - a[i * n + j]);
            let right = Mat::from_fn(n, 1, |i, _| forcing.amplitudes[i]);
            let found = complex_solution(left.as_ref(), &right);
            let distance = nearest(&mut point.spectrum.iter().map(|z| (z - frequency).norm()));
            let response: Vec<f64> = (0..n).map(|i| found[(i, 0)].norm()).collect();
            finite(Susceptibility { response, error: stated(point) / distance, distance })
        }
        Solution::Cycle(cycle) => {
            let of = |parts: usize| response(field, &point.parameters, cycle, forcing, parts);
            let [coarse, fine] = [of(1), of(2)];
            let relative = |a: &[f64]| a.iter().zip(scales).map(|(a, s)| a / s).fold(0.0, f64::max);
            let apart: Vec<f64> = coarse.iter().zip(&fine).map(|(a, b)| (a - b).abs()).collect();
            let turn = Complex64::cis(forcing.frequency * cycle.period);
            let off = nearest(&mut point.spectrum.iter().map(|z| (z - turn).norm() / z.norm().max(1.0)));
            let rate = |z: &Complex64| {
                let angle = (z.arg() - turn.arg() + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
                Complex64::new(z.norm().ln(), angle).norm() / cycle.period
            };
            let distance = nearest(&mut point.spectrum.iter().filter(|z| z.norm() > 0.0).map(rate));
            let error = relative(&apart) / relative(&fine) + stated(point) / off;
            finite(Susceptibility { response: fine, error, distance })
        }
    }
}

/// Stated error of the spectrum.
fn stated(point: &Point) -> f64 {
    if point.trust.spectrum.is_nan() { 0.0 } else { point.trust.spectrum }
}

fn finite(found: Susceptibility) -> Result<Susceptibility, String> {
    let known = found.response.iter().all(|x| x.is_finite());
    if known { Ok(found) } else { Err("the forcing is in resonance: the response is unbounded".into()) }
}

/// A `[n × n]` per unit of time at a state, at a time in forcing periods.
fn jacobian(field: &dyn VectorField, parameters: &[f64], x: &[f64], time: f64) -> Vec<f64> {
    let (n, time) = (x.len(), [time]);
    let times = if field.forced() { &time[..] } else { &[] };
    let (mut f, mut fx) = (vec![0.0; n], vec![0.0; n * n]);
    let at = Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times, signs: &[] };
    field.linearise(at, &[], &mut f, &mut fx, &mut []);
    let unit = field.time_unit(parameters);
    fx.iter_mut().for_each(|a| *a /= unit);
    fx
}

/// An interval: p at its collocation points and at its end, as linear functions of p at its beginning, `[n + 1]` columns
/// of which the last is the value for 0.
struct Step {
    /// `[m n × (n + 1)]`.
    inside: Mat<Complex64>,
    /// `[n × (n + 1)]`.
    end: Mat<Complex64>,
}

/// χ of (2) with every interval of the mesh divided into `parts`.
fn response(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle, forcing: &Forcing, parts: usize) -> Vec<f64> {
    let n = cycle.dim();
    let ends: Vec<f64> = cycle
        .mesh
        .windows(2)
        .flat_map(|pair| (0..parts).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / parts as f64))
        .chain([1.0])
        .collect();
    let steps: Vec<Step> =
        ends.windows(2).map(|pair| step(field, parameters, cycle, forcing, [pair[0], pair[1]])).collect();
    // p at the beginning of each group of intervals, from the cyclic system of the groups.
    let groups = (UNKNOWNS / n.max(1)).clamp(1, steps.len());
    let length = steps.len().div_ceil(groups);
    let joined: Vec<Mat<Complex64>> = steps
        .chunks(length)
        .map(|group| group[1..].iter().fold(group[0].end.clone(), |whole, next| through(&next.end, &whole)))
        .collect();
    let size = joined.len() * n;
    let (mut left, mut right) = (Mat::<Complex64>::zeros(size, size), Mat::<Complex64>::zeros(size, 1));
    for (g, whole) in joined.iter().enumerate() {
        let next = (g + 1) % joined.len() * n;
        for i in 0..n {
            left[(g * n + i, next + i)] += 1.0;
            (0..n).for_each(|j| left[(g * n + i, g * n + j)] -= whole[(i, j)]);
            right[(g * n + i, 0)] = whole[(i, n)];
        }
    }
    let starts = complex_solution(left.as_ref(), &right);
    let mut largest = vec![0.0_f64; n];
    for (g, group) in steps.chunks(length).enumerate() {
        let mut p: Vec<Complex64> = (0..n).map(|i| starts[(g * n + i, 0)]).collect();
        for own in group {
            let value = |map: &Mat<Complex64>, row: usize| {
                map[(row, n)] + p.iter().enumerate().map(|(j, p)| map[(row, j)] * p).sum::<Complex64>()
            };
            let inside: Vec<Complex64> = (0..own.inside.nrows()).map(|row| value(&own.inside, row)).collect();
            for (i, largest) in largest.iter_mut().enumerate() {
                let nodes = std::iter::once(p[i]).chain(inside.iter().skip(i).step_by(n).copied());
                let size = highest(cycle, &nodes.collect::<Vec<_>>());
                // NaN must not be lost.
                *largest = if size > *largest || size.is_nan() { size } else { *largest };
            }
            p = (0..n).map(|row| value(&own.end, row)).collect();
        }
    }
    largest
}

/// Largest modulus of a polynomial on an interval, from its values at the nodes: of its samples, and of the parabola through the
/// largest one and its neighbours.
fn highest(cycle: &Cycle, nodes: &[Complex64]) -> f64 {
    /// With eight sections the parabola is accurate to 1e-5 of the rise of |p| over the interval.
    const SECTIONS: usize = 8;
    let at = |k: usize| {
        let weights = cycle.scheme().interpolation(k as f64 / SECTIONS as f64);
        weights.iter().zip(nodes).map(|(w, p)| p * *w).sum::<Complex64>().norm()
    };
    let sizes: Vec<f64> = (0..=SECTIONS).map(at).collect();
    if sizes.iter().any(|size| size.is_nan()) {
        return f64::NAN;
    }
    let most = (0..=SECTIONS).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b])).unwrap_or(0);
    let middle = most.clamp(1, SECTIONS - 1);
    let [a, b, c] = [sizes[middle - 1], sizes[middle], sizes[middle + 1]];
    let (slope, bend) = (0.5 * (c - a), 0.5 * (a + c) - b);
    let place = -0.5 * slope / bend;
    if bend < 0.0 && place.abs() < 1.0 { sizes[most].max(b + 0.5 * slope * place) } else { sizes[most] }
}

/// The map `next` after the map `first`, both affine.
fn through(next: &Mat<Complex64>, first: &Mat<Complex64>) -> Mat<Complex64> {
    let n = next.nrows();
    Mat::from_fn(n, n + 1, |i, j| {
        let sum: Complex64 = (0..n).map(|k| next[(i, k)] * first[(k, j)]).sum();
        if j == n { sum + next[(i, n)] } else { sum }
    })
}

/// Collocation of (1) on one interval of normalised time.
fn step(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle, forcing: &Forcing, [from, to]: [f64; 2]) -> Step {
    let (n, scheme, frequency) = (cycle.dim(), cycle.scheme(), Complex64::new(0.0, forcing.frequency));
    let m = scheme.degree;
    let h = (to - from) * cycle.period;
    let periods = f64::from(cycle.forcing_periods);
    let rates: Vec<Vec<f64>> = scheme.nodes[1..]
        .iter()
        .map(|c| {
            let time = from + c * (to - from);
            jacobian(field, parameters, &cycle.state(time), time * periods)
        })
        .collect();
    let rate =
        |l: usize, i: usize, j: usize| rates[l][i * n + j] - if i == j { frequency } else { Complex64::new(0.0, 0.0) };
    // The slopes k_l = (A_l - iν) (p + h Σ a_lq k_q) + b.
    let size = m * n;
    let left = Mat::from_fn(size, size, |row, column| {
        let ([l, i], [q, j]) = ([row / n, row % n], [column / n, column % n]);
        let one = f64::from(u8::from(row == column));
        one - h * scheme.integration[l * m + q] * rate(l, i, j)
    });
    let right = Mat::from_fn(size, n + 1, |row, column| {
        if column == n { forcing.amplitudes[row % n] } else { rate(row / n, row % n, column) }
    });
    let slopes = complex_solution(left.as_ref(), &right);
    let value = |row: usize, column: usize, weights: &[f64]| {
        let sum: Complex64 = weights.iter().enumerate().map(|(q, w)| slopes[(q * n + row, column)] * *w).sum();
        let one = f64::from(u8::from(row == column));
        h * sum + one
    };
    Step {
        inside: Mat::from_fn(size, n + 1, |row, column| {
            let l = row / n;
            value(row % n, column, &scheme.integration[l * m..(l + 1) * m])
        }),
        end: Mat::from_fn(n, n + 1, |row, column| value(row, column, &scheme.weights)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Definition, Model, ModelSource, Parameter, State};

    fn model(equations: &[(&str, &str)]) -> Model {
        Model::compile(ModelSource {
            parameters: vec![Parameter::new("c", 0.0)],
            states: equations.iter().map(|(name, _)| State::new(name)).collect(),
            equations: equations.iter().map(|(name, text)| Definition::new(name, text)).collect(),
            ..ModelSource::default()
        })
        .unwrap()
    }

    /// x' = x - y - x (x² + y²), y' = x + y - y (x² + y²): the unit circle, and the forcing (1, -i) e^{iνt}, which is
    /// e^{iνt} in x + iy. Along e^{it} (1 + u) with u = a e^{iδt} + c̄ e^{-iδt}, δ = ν - 1, it gives
    /// (1 + iδ) a + c = 1 and (1 + iδ) c + a = 0.
    #[test]
    fn a_forced_circle_responds_as_its_equations_say() {
        let model = model(&[("x", "x - y - x*(x^2 + y^2)"), ("y", "x + y - y*(x^2 + y^2)")]);
        let count = 160;
        let times: Vec<f64> = (0..=count).map(|k| k as f64 / f64::from(count)).collect();
        let states: Vec<f64> = times.iter().flat_map(|t| [(TAU * t).cos(), (TAU * t).sin()]).collect();
        let cycle = Cycle::given(TAU, &times, &states, 4, 4).unwrap();
        let (one, i) = (Complex64::new(1.0, 0.0), Complex64::i());
        for frequency in [0.3, 2.6, -1.7] {
            let forcing = Forcing { amplitudes: vec![one, -i], frequency };
            let found = response(&model, &[0.0], &cycle, &forcing, 1);
            let delta = one + i * (frequency - 1.0);
            let c = one / (one - delta * delta);
            // In x the factor of e^{iνt} is a + c e^{-2it}.
            let expected = (delta * c).norm() + c.norm();
            assert!(found.iter().all(|x| (x - expected).abs() < 1e-3 * expected), "{frequency}: {found:?} {expected}");
        }
    }
}
