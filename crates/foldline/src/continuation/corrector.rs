//! Newton's method in a hyperplane, and the tangent.
//!
//! **Equations.** For a row c, a base point u₀ and a distance s:
//!
//!   (1)  F(u) = 0,   ⟨c, u - u₀⟩ = s
//!   (2)  F_u τ = 0,  ⟨c, τ⟩ = 1,   then τ / |τ|

use super::Settings;
use crate::contract::ZeroProblem;
use crate::diagram::{Cost, Mesh, Point};

/// Why a correction failed.
#[derive(Clone, Debug, PartialEq)]
pub enum Failure {
    /// The matrix could not be factorised.
    Singular,
    /// Something was not a number.
    NotFinite,
    /// The iteration did not contract; sizes of the updates.
    NoConvergence(Vec<f64>),
    /// The point that was found does not continue the branch: the tangent turns by `angle`, the prediction was off by the
    /// share `miss` of the step.
    Elsewhere {
        /// In radians.
        angle: f64,
        /// Relative to the step.
        miss: f64,
    },
    /// Stability changes on the way in a manner that nothing located explains: the step has probably ended on another branch.
    Unexplained,
    /// The point needs this mesh, and the step is too short to end on another mesh than it began on.
    Remeshed(Mesh),
    /// No mesh of the permitted size meets the tolerance.
    Mesh(f64),
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Failure::Singular => write!(f, "the Newton matrix is singular"),
            Failure::NotFinite => write!(f, "the vector field is not finite there"),
            Failure::NoConvergence(sizes) => {
                write!(f, "Newton's method did not converge (relative updates")?;
                sizes.iter().try_for_each(|s| write!(f, " {s:.1e}"))?;
                write!(f, ")")
            }
            Failure::Elsewhere { angle, miss } => {
                write!(f, "the branch turns too sharply (by {angle:.2} rad, {miss:.2} of a step off the prediction)")
            }
            Failure::Unexplained => write!(f, "stability changes without a special point that explains it"),
            Failure::Remeshed(mesh) => write!(f, "the mesh keeps changing ({} intervals)", mesh.len().max(1) - 1),
            Failure::Mesh(error) => write!(f, "the error estimate stays at {error:.1e} on the largest mesh"),
        }
    }
}

/// A converged point together with its vectors on its mesh.
#[derive(Clone, Debug)]
pub struct Station {
    /// The point as it will be stored; its tangent points towards larger positions.
    pub point: Point,
    /// Unknowns.
    pub u: Vec<f64>,
    /// Unit tangent in the direction of travel.
    pub tangent: Vec<f64>,
    /// The mesh of all three.
    pub mesh: Mesh,
    /// A mesh with room for the next step, where `mesh` has none left.
    pub roomier: Option<Mesh>,
}

impl Station {
    /// The continuation parameter.
    pub fn parameter(&self) -> f64 {
        self.u[self.u.len() - 1]
    }

    /// Component of the tangent (in the direction of travel) along the parameter.
    pub fn slope(&self) -> f64 {
        self.tangent[self.tangent.len() - 1]
    }
}

/// The hyperplane ⟨row, u - base⟩ = distance.
#[derive(Clone, Debug)]
pub struct Plane {
    /// c.
    pub row: Vec<f64>,
    /// u₀.
    pub base: Vec<f64>,
    /// s.
    pub distance: f64,
}

/// Solves (1) from `u`; returns the size of the last update.
///
/// # Errors
/// See [`Failure`].
pub fn correct(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    plane: &Plane,
    u: &mut [f64],
    cost: &mut Cost,
) -> Result<f64, Failure> {
    let size = problem.unknowns();
    let (mut r, mut du, mut gap) = (vec![0.0; size], vec![0.0; size], vec![0.0; size]);
    let mut sizes: Vec<f64> = Vec::new();
    let mut fresh = true;
    for iteration in 0..settings.max_newton {
        if !problem.residual(u, &mut r) {
            return Err(Failure::NotFinite);
        }
        gap.iter_mut().zip(u.iter().zip(&plane.base)).for_each(|(g, (a, b))| *g = a - b);
        r[size - 1] = problem.dot(&plane.row, &gap) - plane.distance;
        if fresh {
            problem.factorise(u, &plane.row).map_err(|_| Failure::Singular)?;
            cost.factorisations += 1;
        }
        cost.newton += 1;
        problem.solve(&r, &mut du);
        let length = problem.relative_size(&du, u);
        if !length.is_finite() {
            return Err(Failure::NotFinite);
        }
        sizes.push(length);
        u.iter_mut().zip(&du).for_each(|(a, b)| *a -= b);
        if length < settings.newton_tolerance() {
            return Ok(length);
        }
        let ratio = if iteration > 0 { length / sizes[iteration - 1] } else { 1.0 };
        // Next to a branch point the matrix is nearly singular, and rounding ends the descent a little earlier.
        if fresh && iteration > 1 && ratio > 0.3 && length < 0.1 * settings.tolerance {
            return Ok(length);
        }
        // A matrix that was kept may be at fault; with a new one there is no excuse.
        let worse = (iteration > 1 && ratio > 0.9) || (iteration > 0 && ratio > 4.0);
        if fresh && worse && length > settings.tolerance || length > 10.0 {
            return Err(Failure::NoConvergence(sizes));
        }
        // The matrix is kept while it still gains well over a digit per iteration.
        fresh = if iteration == 0 { length > 1e-3 } else { ratio > 0.1 };
    }
    Err(Failure::NoConvergence(sizes))
}

/// A station at the converged point `u`: tangent (2), stability, error estimates. `along` is a vector with which the
/// tangent shall make an acute angle; `direction` is +1 where travel is towards larger positions, else -1.
///
/// # Errors
/// See [`Failure`].
pub fn station(
    problem: &mut dyn ZeroProblem,
    u: Vec<f64>,
    along: &[f64],
    direction: f64,
    cost: &mut Cost,
) -> Result<Station, Failure> {
    let size = problem.unknowns();
    problem.anchor(&u);
    problem.factorise(&u, along).map_err(|_| Failure::Singular)?;
    cost.factorisations += 1;
    let mut last = vec![0.0; size];
    last[size - 1] = 1.0;
    let mut tangent = vec![0.0; size];
    problem.solve(&last, &mut tangent);
    let norm = problem.dot(&tangent, &tangent).sqrt();
    if !(norm.is_finite() && norm > 0.0) {
        return Err(Failure::Singular);
    }
    tangent.iter_mut().for_each(|t| *t /= norm);
    let examination = problem.examine(&u);
    let stored: Vec<f64> = tangent.iter().map(|t| direction * t).collect();
    let point = problem.point(&u, &stored, examination);
    Ok(Station { point, u, tangent, mesh: problem.mesh(), roomier: None })
}

/// A multiplier closer to the unit circle than this many defects might lie on its other side …
const CERTAIN: f64 = 20.0;
/// … and is computed once more with the tolerance multiplied by this.
const TIGHTER: f64 = 0.05;

/// Corrects `u` in `plane` and adapts the mesh until the error estimate meets the tolerance, and both defects of the
/// multipliers five times that. The problem is left on the mesh of the result and anchored there.
///
/// # Errors
/// See [`Failure`].
pub fn settle(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    mut plane: Plane,
    mut u: Vec<f64>,
    direction: f64,
    cost: &mut Cost,
) -> Result<Station, Failure> {
    correct(problem, settings, &plane, &mut u, cost)?;
    let (mut tolerance, mut tightened) = (settings.tolerance, false);
    for round in 0..4 {
        for attempt in 0..10 {
            // A layer that lies differently between the nodes of every new mesh needs some more of them than one expects.
            let wanted = tolerance * 0.7f64.powi((attempt - 2).max(0));
            let Some(better) = problem.better_mesh(&u, wanted) else { break };
            let from = problem.mesh();
            // The hyperplane through the point itself, so that remeshing does not move it along the curve.
            u = problem.transfer(&u, &from, &better);
            plane.row = problem.transfer(&plane.row, &from, &better);
            problem.set_mesh(&better);
            problem.anchor(&u);
            plane.base = u.clone();
            plane.distance = 0.0;
            correct(problem, settings, &plane, &mut u, cost)?;
        }
        let mut found = station(problem, u, &plane.row, direction, cost)?;
        let trust = found.point.trust;
        let defect = trust.trivial_defect.max(trust.liouville_defect);
        // Multipliers can need a finer mesh than the profile. Where they do not get better with it, the defects say so.
        let accurate = defect <= 5.0 * settings.tolerance || round == 3;
        // Whether a multiplier lies inside or outside the unit circle must not be a matter of its error.
        let close = |z: &num_complex::Complex64| z.norm().ln().abs() < CERTAIN * defect;
        let certain = !settings.stability || tightened || round == 3 || !found.point.free_spectrum().iter().any(close);
        if accurate && certain {
            if trust.discretisation > 1.5 * settings.tolerance {
                return Err(Failure::Mesh(trust.discretisation));
            }
            let usual = if tightened { tolerance / TIGHTER } else { tolerance };
            found.roomier = problem.better_mesh(&found.u, 0.5 * usual);
            return Ok(found);
        }
        u = found.u;
        tightened |= accurate;
        tolerance *= if accurate { TIGHTER } else { 0.25 };
    }
    Err(Failure::NotFinite)
}

/// The row that fixes the continuation parameter.
pub fn parameter_row(size: usize) -> Vec<f64> {
    let mut row = vec![0.0; size];
    row[size - 1] = 1.0;
    row
}
