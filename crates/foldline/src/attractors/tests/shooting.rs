//! Newton's method by shooting with finite differences: slow and simple, independent of collocation.

use super::*;
use foldline_general::{Factored, Mat, eigenvalues};

/// The solution near a candidate, with its stability.
pub fn polish(field: &Field, parameters: &[f64], candidate: &Candidate) -> Option<Point> {
    match candidate {
        Candidate::Equilibrium(x) => equilibrium(field, parameters, x),
        Candidate::Cycle { period, states, .. } => {
            let found = cycle(field, parameters, *period, &states[..field.dim])?;
            (2..=8).rev().find_map(|turns| once(field, parameters, &found, turns)).or(Some(found))
        }
    }
}

/// Returns one turn of a cycle if it consists of that many equal turns.
fn once(field: &Field, parameters: &[f64], found: &Point, turns: u32) -> Option<Point> {
    let Solution::Cycle(whole) = &found.solution else { return None };
    let (start, period) = (whole.state(0.0), whole.period / f64::from(turns));
    let single = cycle(field, parameters, period, &start)?;
    let Solution::Cycle(own) = &single.solution else { return None };
    let moved = own.state(0.0).iter().zip(&start).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    ((own.period - period).abs() < 1e-6 && moved < 1e-6).then_some(single)
}

fn slope(field: &Field, parameters: &[f64], x: &[f64]) -> Vec<f64> {
    let mut f = vec![0.0; x.len()];
    field.evaluate(
        Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times: &[], signs: &[] },
        &mut f,
    );
    f
}

/// Returns the matrix of central differences of `g`.
fn jacobian(x: &[f64], g: impl Fn(&[f64]) -> Option<Vec<f64>>) -> Option<Mat<f64>> {
    let n = x.len();
    let mut columns = Vec::new();
    for j in 0..n {
        let h = 1e-5 * (1.0 + x[j].abs());
        let shifted = |sign: f64| {
            let mut y = x.to_vec();
            y[j] += sign * h;
            g(&y)
        };
        let (plus, minus) = (shifted(1.0)?, shifted(-1.0)?);
        columns.push((0..n).map(|i| (plus[i] - minus[i]) / (2.0 * h)).collect::<Vec<_>>());
    }
    Some(Mat::from_fn(n, n, |i, j| columns[j][i]))
}

/// Solves a x = b.
fn solved(a: &Mat<f64>, b: &[f64]) -> Vec<f64> {
    let x = Factored::new(a.as_ref()).solve(&Mat::from_fn(b.len(), 1, |i, _| b[i]));
    (0..b.len()).map(|i| x[(i, 0)]).collect()
}

fn equilibrium(field: &Field, parameters: &[f64], start: &[f64]) -> Option<Point> {
    let mut x = start.to_vec();
    for _ in 0..20 {
        let a = jacobian(&x, |x| Some(slope(field, parameters, x)))?;
        let dx = solved(&a, &slope(field, parameters, &x));
        x.iter_mut().zip(&dx).for_each(|(x, d)| *x -= d);
        if dx.iter().all(|d| d.abs() < 1e-10) {
            let spectrum = eigenvalues(a.as_ref())?;
            let unstable = spectrum.iter().filter(|z| z.re > 0.0).count();
            let ranges = x.iter().map(|x| [*x, *x]).collect();
            return Some(point(Solution::Equilibrium(x), spectrum, unstable, ranges));
        }
    }
    None
}

fn cycle(field: &Field, parameters: &[f64], period: f64, start: &[f64]) -> Option<Point> {
    let n = start.len();
    let integrator = Integrator::new(field, parameters, Tolerance::uniform(1e-11, n)).with_step_limit(20_000);
    let (mut x, mut period) = (start.to_vec(), period);
    for _ in 0..12 {
        let end = integrator.state_after(&x, [0.0, period])?;
        let monodromy = jacobian(&x, |x| integrator.state_after(x, [0.0, period]))?;
        let (here, there) = (slope(field, parameters, &x), slope(field, parameters, &end));
        let bordered = Mat::from_fn(n + 1, n + 1, |i, j| match (i < n, j < n) {
            (true, true) => monodromy[(i, j)] - if i == j { 1.0 } else { 0.0 },
            (true, false) => there[i],
            (false, true) => here[j],
            (false, false) => 0.0,
        });
        let mut residual: Vec<f64> = (0..n).map(|i| end[i] - x[i]).collect();
        residual.push(0.0);
        let d = solved(&bordered, &residual);
        x.iter_mut().zip(&d).for_each(|(x, d)| *x -= d);
        period -= d[n];
        if period.is_nan() || period <= 1e-3 || d.iter().any(|d| !d.is_finite() || d.abs() > 1e3) {
            return None;
        }
        if d.iter().all(|d| d.abs() < 1e-8) {
            let mut spectrum = eigenvalues(monodromy.as_ref())?;
            spectrum.sort_by(|a, b| (a - 1.0).norm().total_cmp(&(b - 1.0).norm()));
            let unstable = spectrum[1..].iter().filter(|z| z.norm() > 1.0 + 1e-7).count();
            let cycle = profile(&integrator, &x, period)?;
            let states = cycle.uniform(400);
            let ranges = (0..n).map(|i| {
                let component = states.iter().skip(i).step_by(n);
                component.fold([f64::MAX, f64::MIN], |[low, high], x| [x.min(low), x.max(high)])
            });
            let ranges = ranges.collect();
            return Some(point(Solution::Cycle(cycle), spectrum, unstable, ranges));
        }
    }
    None
}

/// The trajectory over one period as piecewise polynomials.
fn profile(integrator: &Integrator, start: &[f64], period: f64) -> Option<Cycle> {
    const INTERVALS: usize = 60;
    let scheme = Scheme::new(4);
    let mesh: Vec<f64> = (0..=INTERVALS).map(|j| j as f64 / INTERVALS as f64).collect();
    let mut profile = Vec::new();
    let (mut t, mut x) = (0.0, start.to_vec());
    for j in 0..INTERVALS {
        for c in &scheme.nodes {
            let to = period * (j as f64 + c) / INTERVALS as f64;
            x = integrator.state_after(&x, [t, to])?;
            t = to;
            profile.extend_from_slice(&x);
        }
    }
    Some(Cycle {
        points: crate::problem::gauss::Points::Gauss,
        period,
        forcing_periods: 0,
        mesh: mesh.into(),
        degree: 4,
        profile,
        gain: Vec::new(),
    })
}

fn point(solution: Solution, spectrum: Vec<Complex64>, unstable: usize, ranges: Vec<[f64; 2]>) -> Point {
    Point {
        position: 0,
        parameters: Vec::new(),
        solution,
        tangent: Vec::new(),
        step: 0.0,
        spectrum,
        unstable,
        ranges,
        averages: Vec::new(),
        trust: Trust::default(),
        cost: Cost::default(),
    }
}
