//! First solutions of boundary-value problems, from a profile that may be far from one.
//!
//! **Source.** deuflhard2011, §3.1 (damped Newton steps).

use super::System;
use super::growth::{first, problem_of, settings};
use super::plan::SeedPlan;
use super::seeds::bare;
use crate::continuation::corrector::parameter_row;
use crate::contract::{Examination, ZeroProblem};
use crate::diagram::{Cycle, Point, Solution};

/// Relative correction at which undamped steps converge.
const CLOSE: f64 = 0.1;

/// Unknowns near a solution, by damped Newton steps at fixed parameters from a guess that may be far away; `None` if
/// none of them helps. The steps end with the first relative correction below `close`. A step is halved until the correction that would follow it, with the same matrix, is shorter: the
/// natural monotonicity test (deuflhard2011, §3.1), which does not depend on the units of the equations.
pub(super) fn damped(problem: &mut dyn ZeroProblem, guess: &Point, close: f64) -> Option<Vec<f64>> {
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
        let length = problem.dot(&step, &step);
        let mut share = 1.0;
        u = loop {
            let moved: Vec<f64> = u.iter().zip(&step).map(|(u, d)| u - share * d).collect();
            if problem.residual(&moved, &mut r) {
                r[size - 1] = 0.0;
                problem.solve(&r, &mut next);
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

/// The solution of a boundary-value problem to which Newton's method leads from a given profile, at the parameters of
/// the seed.
///
/// # Errors
/// The failure of Newton's method.
pub(super) fn from_arc(system: &System, seed: &SeedPlan, tolerance: f64, guess: &Cycle) -> Result<Point, String> {
    let settings = settings(system, tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
    // Any parameter serves that the conditions do not determine; beyond the last one, a dummy.
    let free = (0..).find(|k| !system.field.determined().contains(k)).unwrap_or(0);
    let mut given = bare(&seed.parameters, Solution::Cycle(guess.clone()));
    let mut problem = problem_of(system, free, guess.degree, &given, false);
    if let Some(u) = damped(&mut *problem, &given, CLOSE) {
        given = problem.point(&u, &[], Examination::default());
    }
    first(&mut *problem, &settings, &given).map(|found| found.point).map_err(|failure| {
        format!(
            "Newton's method does not lead from the given profile to a solution: {failure}; give a profile closer to \
             one, or start at parameters at which a solution is known"
        )
    })
}
