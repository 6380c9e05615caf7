//! Switching at a branch point with a null space of several dimensions.
//!
//! **Idea.** If several eigenvalues are 0 (multipliers 1) at once, because of a symmetry or in uncoupled parts of a
//! model, many branches cross. Newton's method in the hyperplane orthogonal to a direction in the null space finds one
//! of them, and directions that cover the sphere evenly find all, each being reached from some part of it.
//!
//! **Equations.** On the null space the branches are, to leading order, the solutions of d equations that are quadratic
//! or cubic in the d amplitudes. By Bézout's theorem
//!
//!   (1)  at most (3^d - 1)/2 lines cross, if they are isolated
//!
//! **Fails when** two branches cross at an angle below 11 degrees: they are taken for one.

use super::System;
use super::growth::{Beginning, problem_of};
use super::switch::across;
use crate::continuation::Settings;
use crate::contract::ZeroProblem;
use crate::diagram::SpecialPoint;
use crate::linalg::{axpy, dot};
use crate::special::branch_point;
use std::f64::consts::TAU;

/// Branches that cross at a branch point with a null space of several dimensions.
pub struct Crossings {
    /// Their first points.
    pub beginnings: Vec<Beginning>,
    /// Number of directions tried.
    pub directions: usize,
    /// True if more were found than can be isolated: they form a family, as by a continuous symmetry. One is kept.
    pub continuous: bool,
}

/// Directions tried for each possible branch.
const TRIES: usize = 8;

/// Finds all branches that cross at a branch point with a null space of that dimension.
///
/// # Errors
/// A sentence that says why none was found.
pub fn crossings(
    system: &System,
    settings: &Settings,
    free: usize,
    degree: usize,
    at: &SpecialPoint,
    dimension: usize,
) -> Result<Crossings, String> {
    // Branches whose lines make a smaller angle than arccos 0.98 = 11 degrees are the same.
    const ALIKE: f64 = 0.98;
    let most = (3usize.pow(dimension as u32) - 1) / 2;
    let mut problem = problem_of(system, free, degree, &at.point, false);
    let problem = &mut *problem;
    let u = problem.unknowns_of(&at.point);
    problem.anchor(&u);
    let mesh = problem.mesh();
    let kernel = branch_point::kernel(problem, &u, &at.point.tangent, dimension)
        .ok_or_else(|| format!("no null space of dimension {dimension} was found"))?;
    let (mut beginnings, mut lines): (Vec<Beginning>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
    let mut why = "no step off the branch led to another branch".to_string();
    let directions = TRIES * most;
    for weights in directions_of(dimension, directions) {
        problem.set_mesh(&mesh);
        problem.anchor(&u);
        let mut vector = vec![0.0; u.len()];
        kernel.iter().zip(&weights).for_each(|(own, weight)| axpy(*weight, own, &mut vector));
        let improved = |problem: &mut dyn ZeroProblem, guess: &mut [f64]| {
            if let Some(shift) = shift_along(problem, &u, &at.point.tangent, &kernel, guess) {
                axpy(shift, &at.point.tangent, guess);
            }
        };
        let found = match across(system, settings, free, at, problem, &u, &vector, &improved) {
            Ok(found) => found,
            Err(own) => {
                why = own;
                continue;
            }
        };
        let (Beginning::Inside(first) | Beginning::Edge { first, .. }) = &found;
        let tangent =
            if mesh.is_empty() { first.tangent.clone() } else { problem.transfer(&first.tangent, &first.mesh, &mesh) };
        problem.set_mesh(&mesh);
        problem.anchor(&u);
        // The component along the parent depends on the distance at which the branch was reached, and identifies none.
        let along = problem.dot(&tangent, &at.point.tangent).abs();
        let mut line: Vec<f64> = kernel.iter().map(|own| problem.dot(&tangent, own)).collect();
        normalise(&mut line);
        let known = lines.iter().any(|other| dot(other, &line).abs() > ALIKE);
        if along < ALIKE && !known {
            lines.push(line);
            beginnings.push(found);
        }
        if beginnings.len() > most {
            beginnings.truncate(1);
            return Ok(Crossings { beginnings, directions, continuous: true });
        }
    }
    if beginnings.is_empty() { Err(why) } else { Ok(Crossings { beginnings, directions, continuous: false }) }
}

/// Returns unit vectors in that many dimensions that cover the sphere evenly.
fn directions_of(dimension: usize, count: usize) -> Vec<Vec<f64>> {
    // The additive sequence of the root of x^(d+1) = x + 1 has low discrepancy in d dimensions. Normal numbers made of
    // pairs of it by the method of Box and Muller have isotropic directions.
    let pairs = dimension.div_ceil(2);
    let power = 1.0 / (2.0 * pairs as f64 + 1.0);
    let root = (0..50).fold(1.5f64, |root, _| (1.0 + root).powf(power));
    let uniform = |k: usize, j: usize| (0.5 + k as f64 * root.powi(-(j as i32 + 1))).fract();
    let normal = |k: usize, j: usize| {
        let (radius, (sin, cos)) = ((-2.0 * uniform(k, j).ln()).sqrt(), (TAU * uniform(k, j + 1)).sin_cos());
        [radius * cos, radius * sin]
    };
    (1..=count)
        .map(|k| {
            let mut own: Vec<f64> = (0..pairs).flat_map(|pair| normal(k, 2 * pair)).take(dimension).collect();
            normalise(&mut own);
            own
        })
        .collect()
}

fn normalise(x: &mut [f64]) {
    let norm = dot(x, x).sqrt();
    x.iter_mut().for_each(|x| *x /= norm);
}

/// Returns the distance along the tangent from `guess`, near the branch point `u`, at which the part of the residual in
/// the null space is smallest. From there Newton's method is led to the branch closest in direction, rather than to the
/// one that attracts it most. The almost singular matrix at the branch point magnifies just that part.
fn shift_along(
    problem: &mut dyn ZeroProblem,
    u: &[f64],
    tangent: &[f64],
    kernel: &[Vec<f64>],
    guess: &[f64],
) -> Option<f64> {
    let size = u.len();
    let beside: Vec<f64> = u.iter().zip(tangent).map(|(x, t)| x + 1e-8 * t).collect();
    problem.factorise(&beside, tangent).ok()?;
    let away: Vec<f64> = guess.iter().zip(u).map(|(a, b)| a - b).collect();
    let distance = problem.dot(&away, &away).sqrt();
    let (mut r, mut x) = (vec![0.0; size], vec![0.0; size]);
    let mut part = |at: &[f64]| -> Option<Vec<f64>> {
        if !problem.residual(at, &mut r) {
            return None;
        }
        r[size - 1] = 0.0;
        problem.solve(&r, &mut x);
        Some(kernel.iter().map(|own| problem.dot(&x, own)).collect())
    };
    let at_rest = part(u)?;
    let here = part(guess)?;
    let mut moved = guess.to_vec();
    axpy(distance, tangent, &mut moved);
    let there = part(&moved)?;
    let change: Vec<f64> = there.iter().zip(&here).map(|(a, b)| (a - b) / distance).collect();
    let left: Vec<f64> = here.iter().zip(&at_rest).map(|(a, b)| a - b).collect();
    let shift = -dot(&left, &change) / dot(&change, &change);
    shift.is_finite().then(|| shift.clamp(-distance, distance))
}
