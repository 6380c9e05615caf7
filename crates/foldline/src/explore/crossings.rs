//! Switching at a special point with a null space of several dimensions.
//!
//! **Idea.** If several eigenvalues are 0 (multipliers 1, or multipliers -1) at once, because of a symmetry or in
//! uncoupled parts of a model, many branches cross. Newton's method in the hyperplane orthogonal to a direction in the
//! null space finds one of them, and directions that cover the sphere evenly find all, each being reached from some
//! part of it. Over two turns, a multiplier -1 is a multiplier 1 whose null vector changes sign after one turn.
//!
//! **Equations.** On the null space the branches are, to leading order, the solutions of d equations that are quadratic
//! or cubic in the d amplitudes. By Bézout's theorem
//!
//! ```text
//!   (1)  at most (3^d - 1)/2 lines cross, if they are isolated
//!   (2)  v = 2 c - t + O(s²)      line of a branch, from chord c and tangent t at the distance s, all of unit length
//! ```
//!
//! The search goes on until no branch has been reached only once: by the estimate of Good and Turing, the probability
//! that a further direction leads to another branch is the share of directions that led to branches reached once.
//!
//! **Source.** good1953 (probability of what has not been seen).
//!
//! **Fails when** two branches cross at an angle below [`ALIKE`], or one is reached from so few directions that none
//! is tried.

use super::System;
use super::growth::{Beginning, problem_of};
use super::switch::{DISTANCES, across, edge_along, joined, step_off_from, twice};
use crate::continuation::{Settings, Station};
use crate::contract::ZeroProblem;
use crate::diagram::{Kind, Point, SpecialPoint};
use crate::linalg::{axpy, dot};
use crate::special::branch_point;
use std::f64::consts::TAU;

/// Branches that cross at a branch point with a null space of several dimensions.
pub struct Crossings {
    /// Their first points.
    pub beginnings: Vec<Beginning>,
    /// Number of directions tried.
    pub directions: usize,
    /// Relation of the branches to each other.
    pub sets: Sets,
}

/// Relation of the branches that leave a null space.
pub enum Sets {
    /// All that were found are isolated.
    Discrete,
    /// More were found than terms up to the cubic allow, and they form a family, as under a continuous symmetry. One is
    /// kept.
    Continuous,
    /// More were found than terms up to the cubic allow, but they form no family: higher terms decide which of them
    /// exist. One is kept.
    Undecided,
}

/// Directions tried for each possible branch.
const TRIES: usize = 8;
/// Factor on the number of directions if some branch has been reached only once: a bound on the work.
const LONGER: usize = 4;
/// Smallest angle between the lines of two branches, in radians: the order of s² and of the error of a point over s in
/// (2), at distances s of some 1e-3, with a factor of safety.
const ALIKE: f64 = 5e-3;
/// Angle between the lines of two branches below which they are the same, relative to the angle between chord and
/// tangent, which is of the order of s. A factor of safety.
const TURNED: f64 = 3.0;

/// Line of a branch in the null space.
struct Line {
    /// Unit vector.
    along: Vec<f64>,
    /// Error of its direction, in radians.
    error: f64,
    /// Number of directions that led to it.
    hits: usize,
}

impl Line {
    /// Returns the line of the branch of `found`, which lies beside `u`; `None` if it has no component in the null space.
    fn of(
        problem: &dyn ZeroProblem,
        u: &[f64],
        kernel: &[Vec<f64>],
        found: &Station,
        mesh: &crate::diagram::Mesh,
        tolerance: f64,
    ) -> Option<Line> {
        let (tangent, there) = match mesh.is_empty() {
            true => (found.tangent.clone(), found.u.clone()),
            false => (problem.transfer(&found.tangent, &found.mesh, mesh), problem.carry(&found.u, &found.mesh, mesh)),
        };
        let chord: Vec<f64> = there.iter().zip(u).map(|(a, b)| a - b).collect();
        let distance = problem.dot(&chord, &chord).sqrt();
        let unit = |x: &[f64]| {
            let mut own: Vec<f64> = kernel.iter().map(|k| problem.dot(x, k)).collect();
            normalise(&mut own);
            own
        };
        let (chord, mut tangent) = (unit(&chord), unit(&tangent));
        if dot(&chord, &tangent) < 0.0 {
            tangent.iter_mut().for_each(|t| *t = -*t);
        }
        let gap = chord.iter().zip(&tangent).map(|(c, t)| (c - t) * (c - t)).sum::<f64>().sqrt();
        let mut along: Vec<f64> = chord.iter().zip(&tangent).map(|(c, t)| 2.0 * c - t).collect();
        normalise(&mut along);
        let error = ALIKE.max(TURNED * gap) + tolerance / distance;
        error.is_finite().then_some(Line { along, error, hits: 1 })
    }

    fn is(&self, other: &Line) -> bool {
        let sine = (1.0 - dot(&self.along, &other.along).powi(2)).max(0.0).sqrt();
        sine < self.error.max(other.error)
    }
}

/// Finds all branches that cross at a branch point, or leave at a period doubling, with a null space of that dimension.
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
    // Component along the parent above which a branch is the parent.
    const PARENT: f64 = 0.98;
    let doubling = at.kind == Kind::PeriodDoubling;
    let most = (3usize.pow(dimension as u32) - 1) / 2;
    let (mut problem, u, parent) = if doubling {
        twice(system, free, at).ok_or("cycles with events are not followed from such a point")?
    } else {
        let mut problem = problem_of(system, free, degree, &at.point, false);
        let u = problem.unknowns_of(&at.point);
        (problem, u, at.point.tangent.clone())
    };
    let problem = &mut *problem;
    problem.anchor(&u);
    let mesh = problem.mesh();
    let kernel = branch_point::kernel(problem, &u, &parent, dimension)
        .ok_or_else(|| format!("no null space of dimension {dimension} was found"))?;
    let (mut beginnings, mut lines): (Vec<Beginning>, Vec<Line>) = (Vec::new(), Vec::new());
    let mut why = "no step off the branch led to another branch".to_string();
    let least = TRIES * most;
    let mut directions = 0;
    for weights in directions_of(dimension, LONGER * least) {
        if directions >= least && lines.iter().all(|line| line.hits > 1) {
            break;
        }
        directions += 1;
        if !mesh.is_empty() {
            problem.set_mesh(&mesh);
        }
        problem.anchor(&u);
        let mut vector = vec![0.0; u.len()];
        kernel.iter().zip(&weights).for_each(|(own, weight)| axpy(*weight, own, &mut vector));
        let improved = |problem: &mut dyn ZeroProblem, guess: &mut [f64]| {
            if let Some(shift) = shift_along(problem, &u, &parent, &kernel, guess) {
                axpy(shift, &parent, guess);
            }
        };
        let found = if doubling {
            let first = step_off_from(problem, settings, &u, &vector, 1.0, &DISTANCES, &|_, _| true, &improved);
            // The other half of the branch is this one, one turn later.
            let edge = |first| Beginning::Edge { before: Vec::new(), first, joined: joined(at, free) };
            first.map(edge).map_err(|why| why.to_string())
        } else {
            across(system, settings, free, at, problem, &u, &vector, &improved)
        };
        let found = match found {
            Ok(found) => found,
            Err(own) => {
                why = own;
                continue;
            }
        };
        let (Beginning::Inside(first) | Beginning::Edge { first, .. }) = &found;
        if !mesh.is_empty() {
            problem.set_mesh(&mesh);
        }
        problem.anchor(&u);
        let tangent =
            if mesh.is_empty() { first.tangent.clone() } else { problem.transfer(&first.tangent, &first.mesh, &mesh) };
        // The component along the parent depends on the distance at which the branch was reached, and identifies none.
        if problem.dot(&tangent, &parent).abs() >= PARENT {
            continue;
        }
        let Some(line) = Line::of(problem, &u, &kernel, first, &mesh, settings.tolerance) else { continue };
        if let Some(known) = lines.iter_mut().find(|known| known.is(&line)) {
            known.hits += 1;
            continue;
        }
        beginnings.push(with_edge(problem, &u, &kernel, &line, at, found));
        lines.push(line);
        if beginnings.len() > most {
            let (Beginning::Inside(first) | Beginning::Edge { first, .. }) = &beginnings[0];
            let continuous = is_neutral(&first.point);
            beginnings.truncate(1);
            let sets = if continuous { Sets::Continuous } else { Sets::Undecided };
            return Ok(Crossings { beginnings, directions, sets });
        }
    }
    if beginnings.is_empty() { Err(why) } else { Ok(Crossings { beginnings, directions, sets: Sets::Discrete }) }
}

/// True if an eigenvalue is 0 (a multiplier 1) within its error besides those that always are: the solution is one of a
/// family at the same parameter.
fn is_neutral(point: &Point) -> bool {
    /// Relative rounding error of an eigenvalue.
    const ROUNDING: f64 = 1e-10;
    if point.solution.period().is_some() {
        return point.neutral_multiplier().is_some();
    }
    let sizes = || point.spectrum.iter().map(|z| z.norm());
    sizes().fold(f64::INFINITY, f64::min) <= ROUNDING * sizes().fold(0.0, f64::max)
}

/// Adds the special point over two turns to the start of a doubled branch.
fn with_edge(
    problem: &mut dyn ZeroProblem,
    u: &[f64],
    kernel: &[Vec<f64>],
    line: &Line,
    at: &SpecialPoint,
    found: Beginning,
) -> Beginning {
    match found {
        Beginning::Edge { first, joined, .. } if at.kind == Kind::PeriodDoubling => {
            let mut direction = vec![0.0; u.len()];
            kernel.iter().zip(&line.along).for_each(|(own, weight)| axpy(*weight, own, &mut direction));
            let before = vec![edge_along(problem, u, &direction, at, &first.point)];
            Beginning::Edge { before, first, joined }
        }
        other => other,
    }
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
