//! First solutions of boundary-value problems, from a profile that may be far from one, and further solutions.
//!
//! **Equations.** Solutions u_k that are known are deflated: M F = 0 has the solutions of F = 0 except for them, with
//!
//! ```text
//!   (1)  M(u) = ∏_k (1/|u - u_k|² + 1)
//!   (2)  (M F)' y = M F(v),  y = (M(v)/M(u)) (x - d ⟨m, x⟩/(1 + ⟨m, d⟩)),  F' x = F(v), F' d = F(u), m = ∇M/M
//! ```
//!
//! by the formula of Sherman and Morrison, so that the matrices are those of F.
//!
//! **Source.** deuflhard2011, §3.1 (damped Newton steps); farrell2015 (deflation).

use super::System;
use super::growth::{first, problem_of, settings};
use super::plan::{Plan, SeedSource};
use super::seeds::bare;
use crate::continuation::corrector::parameter_row;
use crate::contract::{Examination, ZeroProblem};
use crate::diagram::{Cycle, Mesh, Point, Solution};

/// Distance in scaled states below which two solutions are one: well above the errors of both and of the mesh of the first profile.
const SAME: f64 = 1e-2;
/// Relative correction at which undamped steps converge.
const CLOSE: f64 = 0.1;

/// Unknowns near a solution, by damped Newton steps at fixed parameters from a guess that may be far away; `None` if
/// none of them helps. The steps end with the first relative correction below `close`. A step is halved until the correction that would follow it, with the same matrix, is shorter: the
/// natural monotonicity test (deuflhard2011, §3.1), which does not depend on the units of the equations.
pub(super) fn damped(problem: &mut dyn ZeroProblem, guess: &Point, close: f64) -> Option<Vec<f64>> {
    deflated(problem, guess, close, &Deflation::default())
}

/// Solutions `[K][n]` that are known, as unknowns of the problem on its mesh.
#[derive(Default)]
struct Deflation(Vec<Vec<f64>>);

impl Deflation {
    /// M of (1) and ⟨m, x⟩ of (2) at `u`.
    fn at(&self, problem: &dyn ZeroProblem, u: &[f64], x: &[f64]) -> (f64, f64) {
        let (mut factor, mut along) = (1.0, 0.0);
        for known in &self.0 {
            let off: Vec<f64> = u.iter().zip(known).map(|(a, b)| a - b).collect();
            let square = problem.dot(&off, &off);
            factor *= 1.0 / square + 1.0;
            along -= 2.0 * problem.dot(&off, x) / (square * (1.0 + square));
        }
        (factor, along)
    }

    /// y of (2) in place of `x`, for the step `d` at `u` and the unknowns `v`.
    fn turn(&self, problem: &dyn ZeroProblem, [u, v]: [&[f64]; 2], d: &[f64], x: &mut [f64]) {
        if self.0.is_empty() {
            return;
        }
        let ((own, along), (_, of_step)) = (self.at(problem, u, x), self.at(problem, u, d));
        let (there, _) = self.at(problem, v, x);
        let share = along / (1.0 + of_step);
        x.iter_mut().zip(d).for_each(|(x, d)| *x = there / own * (*x - share * d));
    }
}

/// As [`damped`], without the solutions that are deflated.
fn deflated(problem: &mut dyn ZeroProblem, guess: &Point, close: f64, known: &Deflation) -> Option<Vec<f64>> {
    /// A bound on the work; each step costs one matrix.
    const STEPS: usize = 40;
    /// Smallest damping factor: below it, the test fails because of a singular matrix on the way.
    const LEAST: f64 = 1e-4;
    let mut u = problem.unknowns_of(guess);
    let (size, row) = (u.len(), parameter_row(u.len()));
    let (mut r, mut step, mut next) = (vec![0.0; size], vec![0.0; size], vec![0.0; size]);
    for _ in 0..STEPS {
        problem.anchor(&u);
        if !problem.residual(&u, &mut r) {
            return None;
        }
        r[size - 1] = 0.0;
        problem.factorise(&u, &row).ok()?;
        problem.solve(&r, &mut step);
        if problem.relative_size(&step, &u) < close {
            return Some(u);
        }
        let plain = step.clone();
        known.turn(problem, [&u, &u], &plain, &mut step);
        let length = problem.dot(&step, &step);
        let mut share = 1.0;
        u = loop {
            let moved: Vec<f64> = u.iter().zip(&step).map(|(u, d)| u - share * d).collect();
            if problem.residual(&moved, &mut r) {
                r[size - 1] = 0.0;
                problem.solve(&r, &mut next);
                known.turn(problem, [&u, &moved], &plain, &mut next);
                if problem.dot(&next, &next) < length {
                    break moved;
                }
            }
            share *= 0.5;
            if share < LEAST {
                return None;
            }
        };
    }
    None
}

/// The solution of a boundary-value problem to which Newton's method leads from the profile of seed number `index`, at the given
/// parameters. If it must not be one of some known solutions, further profiles are tried: multiples of those.
///
/// # Errors
/// The failure of Newton's method.
pub(super) fn from_arc(system: &System, plan: &Plan, index: usize, parameters: &[f64]) -> Result<Point, String> {
    /// Multiples of a known solution from which others are sought. Deflation leads away from it on the side of the profile:
    /// larger, smaller and opposite solutions.
    const MULTIPLES: [f64; 6] = [1.5, 3.0, 10.0, 0.5, -1.0, -3.0];
    let (guess, seeds) = match &plan.seeds[index].source {
        SeedSource::Cycle(guess) => (guess, &[][..]),
        SeedSource::Besides(guess, seeds) => (guess, &seeds[..]),
        _ => return Err("a boundary-value problem starts from a profile".into()),
    };
    let mut known = Vec::new();
    for seed in seeds {
        let other = from_arc(system, plan, *seed, parameters);
        known.push(other.map_err(|why| format!("the solution of {} is not known: {why}", plan.seeds[*seed].name))?);
    }
    let own = bare(parameters, Solution::Cycle(guess.clone()));
    let multiples = known.iter().flat_map(|point| MULTIPLES.iter().filter_map(move |factor| multiple(point, *factor)));
    let mut already = None;
    for guess in std::iter::once(own).chain(multiples) {
        match reached(system, plan.tolerance, &guess, &known) {
            Ok(found) => match known.iter().position(|other| are_same(system, &found, other)) {
                None => return Ok(found),
                Some(k) => already = Some(k),
            },
            Err(why) if known.is_empty() => return Err(why),
            Err(_) => {}
        }
    }
    let names: Vec<&str> = seeds.iter().map(|seed| plan.seeds[*seed].name.as_str()).collect();
    let led = already.map_or("Newton's method did not converge".to_string(), |k| {
        format!("Newton's method led to that of {}", names[k])
    });
    Err(format!(
        "no solution besides {} was found from the given profile and multiples of the known ones: {led}\nlikely cause: there is \
         none at these parameters, or it is far from all of them\nwhat to do: give another profile",
        names.join(", ")
    ))
}

/// The solution times a factor, as a first profile.
fn multiple(point: &Point, factor: f64) -> Option<Point> {
    let Solution::Cycle(cycle) = &point.solution else { return None };
    let profile = cycle.profile.iter().map(|x| factor * x).collect();
    Some(bare(&point.parameters, Solution::Cycle(Cycle { profile, ..cycle.clone() })))
}

/// The problem at a solution, and its unknowns there.
fn around<'s>(system: &'s System, point: &Point) -> Option<(Box<dyn ZeroProblem + 's>, Vec<f64>, Mesh)> {
    // Any parameter serves that the conditions do not determine; beyond the last one, a dummy.
    let free = (0..).find(|k| !system.field.determined().contains(k)).unwrap_or(0);
    let Solution::Cycle(cycle) = &point.solution else { return None };
    let mut problem = problem_of(system, free, cycle.degree, point, false);
    let u = problem.unknowns_of(point);
    Some((problem, u, cycle.mesh.clone()))
}

/// Newton's method from a profile, with known solutions deflated.
fn reached(system: &System, tolerance: f64, guess: &Point, known: &[Point]) -> Result<Point, String> {
    let (mut problem, _, mesh) = around(system, guess).ok_or("no profile")?;
    let settings = settings(system, tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
    let others = known.iter().filter_map(|point| around(system, point));
    let others = Deflation(others.map(|(_, u, own)| problem.carry(&u, &own, &mesh)).collect());
    let close = deflated(&mut *problem, guess, CLOSE, &others);
    let given = close.map(|u| problem.point(&u, &[], Examination::default()));
    first(&mut *problem, &settings, given.as_ref().unwrap_or(guess)).map(|found| found.point).map_err(|failure| {
        format!(
            "Newton's method does not lead from the given profile to a solution: {failure}; give a profile closer to \
             one, or start at parameters at which a solution is known"
        )
    })
}

/// True if two solutions are one.
fn are_same(system: &System, one: &Point, other: &Point) -> bool {
    let (Some((problem, u, mesh)), Some((_, v, own))) = (around(system, one), around(system, other)) else {
        return false;
    };
    let off: Vec<f64> = problem.carry(&v, &own, &mesh).iter().zip(&u).map(|(a, b)| a - b).collect();
    problem.dot(&off, &off).sqrt() < SAME
}
