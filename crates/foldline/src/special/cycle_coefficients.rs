//! Normal-form coefficients of cycles with their errors.
//!
//! **Idea.** A coefficient is computed twice: at the point as it was located, on a mesh that resolves the second
//! derivatives of f; and on a mesh with half as many intervals again, after solving for cycle and special point
//! together. The two differ by the errors of the location, of the profile and of the integrals. The second value is
//! returned, with an error derived from the difference.
//!
//! **Equations.** With x_j and x_{j+1} the states at the ends of interval j, d = x_{j+1} - x_j, and w a direction:
//!
//! ```text
//!   (1)  f_x(x_{j+1}) w - f_x(x_j) w - Σ_i b_i f_xx(x_j + c_i d)[d, w]         b_i, c_i of the Gauss points
//!
//!   (2)  F(u) = 0, g(u, σ) = 0:   F_u δ = F, F_u τ = 0;   g_u τ α + g_σ Δσ = g_u δ - g,   Δu = α τ - δ
//! ```
//!
//! (1) vanishes up to the error of the quadrature. If f_x changes within less than an interval, as at contact with
//! little smoothing, all Gauss points may miss the change on both meshes; (1) detects it, and the interval is bisected
//! until (1) is small.
//!
//! If the error of a coefficient is of order q in the length of the intervals, that of the second value is the
//! difference divided by 1.5^q - 1: twice the difference for q = 1, the lowest order expected; smooth fields have q = 8.
//!
//! **Source.** govaerts2000, §3 (bordered systems); the test (1) is ours.

use super::coefficients::Coefficients;
use super::cycle_form::{NOTHING, Value, on_mesh, switches_passed, valued};
use super::on_cycles::OnCycles;
use crate::contract::{Batch, Condition, Examination, Parameters, ZeroProblem};
use crate::diagram::{Cycle, Kind, Mesh, Point, Solution};
use crate::linalg::{axpy, lu};
use crate::problem::cycle::CycleProblem;
use crate::problem::gauss::Scheme;
use crate::problem::{Setting, mesh};
use num_complex::Complex64;

/// Error of the second value divided by the difference of the two: 1 / (1.5 - 1) for q = 1.
const SAFE: f64 = 2.0;

/// Error of a coefficient that is zero within it, as a share of its terms, above which the coefficient is undetermined
/// rather than degenerate. Empirical: terms that cancel to less than a hundredth are taken for a true zero.
const UNKNOWN: f64 = 1e-2;

/// Largest sum of two values, relative to their difference, that differ in the direction of the null vector alone.
const MIRRORED: f64 = 1e-3;

/// Returns the coefficients of a cycle at a bifurcation point of the given kind. The setting has one free parameter.
pub fn coefficients(kind: Kind, setting: &Setting, at: &Point) -> Coefficients {
    if !matches!(kind, Kind::Fold | Kind::PeriodDoubling | Kind::Torus) {
        return Coefficients::default();
    }
    found(kind, setting, at).unwrap_or_else(Coefficients::none)
}

fn found(kind: Kind, setting: &Setting, at: &Point) -> Result<Coefficients, String> {
    let Solution::Cycle(cycle) = &at.solution else { return Ok(Coefficients::default()) };
    if cycle.intervals() == 0 {
        return Err("the profile of the cycle is missing".into());
    }
    match switches_passed(setting, at) {
        0 => {}
        1 => return Err("the orbit crosses a switching point of the right-hand side".into()),
        count => return Err(format!("the orbit crosses {count} switching points of the right-hand side")),
    }
    let resolved =
        resolved(setting, at, cycle).ok_or("the derivatives of the right-hand side vary too sharply to be resolved")?;
    let value = |at: &Point| valued(kind, setting.clone(), at).ok_or("its equations could not be solved");
    let first = on_mesh(at, &resolved).ok_or("its mesh could not be refined")?;
    let second = solved(kind, setting, &first, at, &mesh::denser(&resolved));
    let second = second.ok_or("the point was not found again on a finer mesh")?;
    let (mut one, two) = (value(&first)?, value(&second)?);
    if kind == Kind::Fold && (one.value + two.value).abs() < MIRRORED * (one.value - two.value).abs() {
        // Along the null vector of a symmetric fold no amplitude grows: rounding decides on its direction.
        one.value = -one.value;
    }
    let noise = f64::EPSILON * resolved.len() as f64;
    if two.divisor.abs() <= NOTHING + SAFE * (two.divisor.abs() - one.divisor.abs()).abs() {
        return Err("the change of the period at the fold is zero within its error".into());
    }
    Ok(compared(one, two, noise))
}

/// Second of two values, with its error; `noise` is the relative rounding error of the terms.
fn compared(one: Value, two: Value, noise: f64) -> Coefficients {
    let error = SAFE * (two.value - one.value).abs() + noise * two.terms;
    let unknown = two.value.abs() <= error && error > UNKNOWN * two.terms;
    let remark = if unknown { "the results on two meshes agree in no digit" } else { "" };
    Coefficients { values: vec![two.value], errors: vec![error], remark: remark.into() }
}

/// Part of the period, with the states at its ends.
struct Part {
    ends: [f64; 2],
    states: [Vec<f64>; 2],
}

/// Refinement of the mesh of the cycle on which (1) is small everywhere; `None` if that needs more than the permitted
/// number of intervals.
fn resolved(setting: &Setting, at: &Point, cycle: &Cycle) -> Option<Mesh> {
    /// Largest (1), as a share of the change of f_x over the period. One further bisection reduces it to almost
    /// nothing, by the order of the quadrature.
    const SHARE: f64 = 1e-6;
    /// Shortest interval, in periods: four digits above the rounding of a mesh boundary.
    const SHORTEST: f64 = 1e-12;
    let scheme = cycle.scheme();
    let most = mesh::largest(cycle.dim(), cycle.degree);
    let state = |t: f64| {
        let mut x = vec![0.0; cycle.dim()];
        cycle.state_into(scheme, t, &mut x);
        x
    };
    let part = |ends: [f64; 2]| Part { ends, states: ends.map(&state) };
    let mut open: Vec<Part> = cycle.mesh.windows(2).map(|pair| part([pair[0], pair[1]])).collect();
    let (mut done, mut allowed) = (vec![1.0], f64::NAN);
    while !open.is_empty() {
        if open.len() + done.len() > most || open.iter().any(|part| part.ends[1] - part.ends[0] < SHORTEST) {
            return None;
        }
        let Missed { missed, changes, largest } = missed(setting, at, cycle, scheme, &open);
        if allowed.is_nan() {
            allowed = (SHARE * changes.iter().sum::<f64>()).max(16.0 * f64::EPSILON * largest);
        }
        let mut next = Vec::new();
        for (part, missed) in open.into_iter().zip(missed) {
            if missed.is_nan() {
                return None;
            }
            if missed <= allowed {
                done.push(part.ends[0]);
                continue;
            }
            let middle = 0.5 * (part.ends[0] + part.ends[1]);
            let ([begin, end], [a, b], between) = (part.ends, part.states, state(middle));
            next.push(Part { ends: [begin, middle], states: [a, between.clone()] });
            next.push(Part { ends: [middle, end], states: [between, b] });
        }
        open = next;
    }
    done.sort_by(f64::total_cmp);
    Some(done.into())
}

/// (1) for every part, the change of f_x over it, and the largest f_x encountered, in scaled states.
struct Missed {
    missed: Vec<f64>,
    changes: Vec<f64>,
    largest: f64,
}

fn missed(setting: &Setting, at: &Point, cycle: &Cycle, scheme: &Scheme, parts: &[Part]) -> Missed {
    let (field, n, lanes, known) = (setting.field, cycle.dim(), parts.len(), at.parameters.len());
    // Time is fixed at the middle of the interval: only the change with the state counts.
    let middle = |part: &Part| f64::from(cycle.forcing_periods) * 0.5 * (part.ends[0] + part.ends[1]);
    let times: Vec<f64> = parts.iter().filter(|_| cycle.forcing_periods > 0).map(middle).collect();
    let spread = |of: &dyn Fn(&Part, usize) -> f64, size: usize| -> Vec<f64> {
        (0..size).flat_map(|c| parts.iter().map(move |part| if c < n { of(part, c) } else { 0.0 })).collect()
    };
    let difference = spread(&|part, c| part.states[1][c] - part.states[0][c], n + known);
    let mut out = Missed { missed: vec![0.0; lanes], changes: vec![0.0; lanes], largest: 0.0 };
    // Two directions in which no component is zero.
    for way in [1.0, -1.0] {
        let w = spread(&|_, c| setting.scales[c] * if c % 2 == 0 { 1.0 } else { way }, n + known);
        let derivative = |share: f64, along: &[&[f64]]| {
            let states = spread(&|part, c| part.states[0][c] + share * (part.states[1][c] - part.states[0][c]), n);
            let batch = Batch {
                lanes,
                states: &states,
                parameters: Parameters::Shared(&at.parameters),
                times: &times,
                signs: &[],
            };
            let mut value = vec![0.0; n * lanes];
            field.directional(batch, along, &mut value);
            value
        };
        let [from, to] = [0.0, 1.0].map(|end| derivative(end, &[&w[..]]));
        let mut sum = vec![0.0; n * lanes];
        for (share, weight) in scheme.nodes[1..].iter().zip(&scheme.weights) {
            axpy(*weight, &derivative(*share, &[&difference[..], &w[..]]), &mut sum);
        }
        for k in 0..n * lanes {
            let (scale, lane) = (setting.scales[k / lanes], k % lanes);
            let change = (to[k] - from[k]) / scale;
            let off = (change - sum[k] / scale).abs();
            out.missed[lane] = if off.is_nan() { f64::NAN } else { out.missed[lane].max(off) };
            out.changes[lane] = out.changes[lane].max(change.abs());
            out.largest = out.largest.max((from[k] / scale).abs()).max((to[k] / scale).abs());
        }
    }
    out
}

/// Special point on another mesh by (2), starting from `first`, which is `at` on its refined mesh.
fn solved(kind: Kind, setting: &Setting, first: &Point, at: &Point, mesh: &Mesh) -> Option<Point> {
    /// Maximum number of iterations. Convergence is quadratic from an error of the tolerance, so three suffice; the
    /// rest is a margin.
    const ROUNDS: usize = 6;
    /// Largest relative update. A factor of safety: the starting point is accurate to the tolerance, and a larger
    /// update leads to another point.
    const FAR: f64 = 1e-2;
    /// Relative error after which iteration ends: the smallest tolerance of Newton's method.
    const DONE: f64 = 1e-11;
    /// Error after a Newton step over the square of the error before. A factor of safety: in scaled unknowns the ratio
    /// is of order 1.
    const CURVED: f64 = 10.0;
    let start = on_mesh(first, mesh)?;
    let (Solution::Cycle(cycle), Solution::Cycle(own)) = (&start.solution, &at.solution) else { return None };
    let mut problem = CycleProblem::like(setting.clone(), cycle);
    let mut u = problem.unknowns_of(&start);
    if at.tangent.len() != own.profile.len() + 1 + setting.freedom() || setting.freedom() != 1 {
        return None;
    }
    let row = problem.transfer(&at.tangent, &own.mesh, mesh);
    let mut condition = OnCycles::new(kind, setting.clone(), cycle)?;
    let mut extra = condition.guess(&start);
    let mut g = vec![0.0; condition.equations()];
    if !Condition::evaluate(&mut condition, &u, &extra, &mut g) {
        return None;
    }
    // The borders are now close to the null vectors.
    condition.anchor();
    problem.anchor(&u);
    let (size, mut before) = (u.len(), f64::INFINITY);
    for _ in 0..ROUNDS {
        let mut r = vec![0.0; size];
        if !problem.residual(&u, &mut r) || !Condition::evaluate(&mut condition, &u, &extra, &mut g) {
            return None;
        }
        r[size - 1] = 0.0;
        problem.factorise(&u, &row).ok()?;
        let (mut delta, mut tau) = (vec![0.0; size], vec![0.0; size]);
        problem.solve(&r, &mut delta);
        r.fill(0.0);
        r[size - 1] = 1.0;
        problem.solve(&r, &mut tau);
        let shares = bordered_update(&mut condition, &delta, &tau, &g)?;
        let update: Vec<f64> = tau.iter().zip(&delta).map(|(t, d)| shares[0] * t - d).collect();
        let length = problem.relative_size(&update, &u);
        if length.is_nan() || length > FAR {
            return None;
        }
        axpy(1.0, &update, &mut u);
        extra.iter_mut().zip(&shares[1..]).for_each(|(x, d)| *x += d);
        // The remaining error is about the square of the update; at the latest, rounding ends the convergence.
        if CURVED * length * length < DONE || length > 0.3 * before {
            return (length < 1e-2 * FAR).then(|| as_point(&problem, &u, &row, &condition, &extra, at));
        }
        before = length;
    }
    None
}

/// α and Δσ of (2).
fn bordered_update(condition: &mut OnCycles, delta: &[f64], tau: &[f64], g: &[f64]) -> Option<Vec<f64>> {
    let (count, e) = (g.len(), condition.extra());
    let still = vec![0.0; e];
    let mut column = |along: &[f64], extra: &[f64]| {
        let mut dg = vec![0.0; count];
        condition.derivative(along, extra, &mut dg);
        dg
    };
    let mut right = column(delta, &still);
    axpy(-1.0, g, &mut right);
    let mut matrix = vec![0.0; count * count];
    let mut put = |k: usize, dg: Vec<f64>| (0..count).for_each(|i| matrix[i * count + k] = dg[i]);
    put(0, column(tau, &still));
    for k in 0..e {
        let mut one = still.clone();
        one[k] = 1.0;
        put(1 + k, column(&vec![0.0; tau.len()], &one));
    }
    let mut pivots = vec![0; count];
    lu::factorise(&mut matrix, count, &mut pivots).ok()?;
    lu::solve(&matrix, count, &pivots, &mut right, 1);
    Some(right)
}

/// Point with the unknowns `u`, whose spectrum contains the critical multipliers.
fn as_point(
    problem: &CycleProblem,
    u: &[f64],
    tangent: &[f64],
    condition: &OnCycles,
    extra: &[f64],
    at: &Point,
) -> Point {
    let mut point = problem.point(u, tangent, Examination::default());
    point.spectrum.clone_from(&at.spectrum);
    // Update the angle of the critical pair on the unit circle.
    let angle = extra.first().copied().unwrap_or(0.0);
    let pairs = point.spectrum.iter_mut().filter(|z| z.im != 0.0);
    let nearest: Vec<&mut Complex64> = pairs.filter(|z| condition.distance(**z) < 1e-2).collect();
    if extra.len() == 1 && nearest.len() == 2 {
        nearest.into_iter().for_each(|z| *z = Complex64::from_polar(1.0, angle.copysign(z.im)));
    }
    point
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Definition, Model, ModelSource, Parameter, State};
    use crate::problem::Axis;
    use std::f64::consts::TAU;

    /// Mesh that resolves f along the unit circle, starting from 24 intervals.
    fn along_the_circle(bend: &str) -> Option<Mesh> {
        let equations = [("x", format!("-y + {bend}")), ("y", "x".to_string())];
        let model = Model::compile(ModelSource {
            parameters: vec![Parameter::new("p", 0.0)],
            states: equations.iter().map(|(name, _)| State::new(name)).collect(),
            equations: equations.iter().map(|(name, text)| Definition::new(name, text)).collect(),
            ..ModelSource::default()
        })
        .unwrap_or_else(|errors| panic!("{}", errors[0]));
        let (degree, mesh) = (4, mesh::uniform(24));
        let scheme = Scheme::of(degree);
        let places =
            mesh.windows(2).flat_map(|pair| scheme.nodes.iter().map(move |c| pair[0] + c * (pair[1] - pair[0])));
        let profile = places.flat_map(|t| [(TAU * t).cos(), (TAU * t).sin()]).collect();
        let cycle = Cycle {
            points: crate::problem::gauss::Points::Gauss,
            period: TAU,
            forcing_periods: 0,
            mesh,
            degree,
            profile,
            gain: Vec::new(),
        };
        let point = Point {
            position: 0,
            parameters: model.defaults(),
            solution: Solution::Cycle(cycle.clone()),
            tangent: Vec::new(),
            step: 0.0,
            spectrum: Vec::new(),
            unstable: 0,
            ranges: Vec::new(),
            averages: Vec::new(),
            trust: Default::default(),
            cost: Default::default(),
        };
        let scales = model.scales();
        let setting =
            Setting { field: &model, scales: &scales, parameters: model.defaults(), axes: vec![Axis::new(0, 1.0)] };
        resolved(&setting, &point, &cycle)
    }

    #[test]
    fn intervals_that_do_not_resolve_second_derivatives_are_bisected() {
        let smooth = along_the_circle("x*y^2").unwrap();
        assert_eq!(smooth, mesh::uniform(24), "a cubic is integrated exactly");
        // |x - 0.3| smoothed over 1e-7, which passes between the Gauss points.
        let sharp = along_the_circle("(x - 0.3)*tanh(1e7*(x - 0.3))").unwrap();
        assert!(sharp.len() < 400, "{}", sharp.len());
        for place in [0.3f64.acos() / TAU, 1.0 - 0.3f64.acos() / TAU] {
            let j = sharp.partition_point(|t| *t <= place);
            assert!(sharp[j] - sharp[j - 1] < 1e-6, "{:e}", sharp[j] - sharp[j - 1]);
        }
        assert!(sharp.windows(2).filter(|pair| pair[1] - pair[0] > 0.04).count() >= 20, "elsewhere they stay");
        // At a kink bisection never ends.
        assert!(along_the_circle("abs(x - 0.3)").is_none());
    }

    #[test]
    fn errors_follow_from_two_meshes_and_undetermined_coefficients_are_reported() {
        let value = |value: f64| Value { value, terms: 5.0, divisor: 1.0 };
        let good = compared(value(-0.5), value(-0.4996), 0.0);
        assert!(good.values == [-0.4996] && (good.errors[0] - 8e-4).abs() < 1e-12 && good.remark.is_empty());
        assert!(compared(value(1e-4), value(1.5e-4), 0.0).remark.is_empty(), "the terms cancel: it is degenerate");
        assert!(!compared(value(-146.0), value(3.0), 0.0).remark.is_empty());
    }
}
