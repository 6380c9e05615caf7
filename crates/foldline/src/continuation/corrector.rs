//! Newton's method in a hyperplane, and the tangent vector.
//!
//! **Equations.** For a row c, a base point u₀ and a distance s:
//!
//!   (1)  F(u) = 0,   ⟨c, u - u₀⟩ = s
//!   (2)  F_u τ = 0,  ⟨c, τ⟩ = 1,   then τ / |τ|

use super::Settings;
use crate::contract::ZeroProblem;
use crate::diagram::{Cost, Mesh, Point};

/// Reason for which a correction failed.
#[derive(Clone, Debug, PartialEq)]
pub enum Failure {
    /// The matrix could not be factorised.
    Singular,
    /// A value was not finite.
    NotFinite,
    /// The equations have no value there, for another reason.
    Blocked(&'static str),
    /// The iteration did not converge; sizes of the updates.
    NoConvergence(Vec<f64>),
    /// The point does not continue the branch: the tangent turns by `angle`, or the prediction missed by the fraction
    /// `miss` of the step.
    Elsewhere {
        /// Angle in radians.
        angle: f64,
        /// Distance from the prediction, relative to the step.
        miss: f64,
    },
    /// The midpoint of the curve lies too far from the cubic between both ends: at `miss` times the permitted distance,
    /// which is the fraction `allowed` of the step.
    Bent {
        /// In units of the permitted distance.
        miss: f64,
        /// Relative to the step.
        allowed: f64,
    },
    /// The reverse step misses the start by the fraction `miss` of the step: another branch, or the other side of a
    /// cusp, is close.
    NotBack {
        /// Relative to the step.
        miss: f64,
    },
    /// Stability changes on the step without a located special point to explain it. The step has probably ended on
    /// another branch.
    Unexplained,
    /// The eigenvalues or multipliers could not be computed.
    Spectrum,
    /// The point needs this mesh, but the step is too short to end on a mesh other than the one on which it began.
    Remeshed(Mesh),
    /// No mesh of the permitted size meets the tolerance.
    Mesh(f64),
    /// The point solves the unfolded equations but not the original ones: the branches do not cross there.
    Departed,
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Failure::Singular => write!(f, "the Newton matrix is singular"),
            Failure::NotFinite => write!(f, "the vector field is not finite there"),
            Failure::Blocked(why) => f.write_str(why),
            Failure::NoConvergence(sizes) => {
                write!(f, "Newton's method did not converge (relative updates")?;
                sizes.iter().try_for_each(|s| write!(f, " {s:.1e}"))?;
                write!(f, ")")
            }
            Failure::Elsewhere { angle, miss } => {
                write!(
                    f,
                    "the branch turns too sharply within a step (by {angle:.2} rad; the point lies {miss:.2} \
                           of a step from the prediction)"
                )
            }
            Failure::Bent { miss, allowed } => {
                let miss = miss * allowed;
                write!(
                    f,
                    "the branch bends too much within a step (its midpoint lies {miss:.1e} of a step from the cubic \
                     through both ends; the limit is {allowed:.1e})"
                )
            }
            Failure::NotBack { .. } => {
                write!(
                    f,
                    "the same step taken backwards does not return: another branch, or the other side of a cusp, is \
                     very close"
                )
            }
            Failure::Unexplained => write!(f, "stability changes with no special point to explain it"),
            Failure::Spectrum => write!(f, "the eigenvalues or multipliers could not be computed"),
            Failure::Remeshed(mesh) => write!(f, "the mesh does not settle ({} intervals)", mesh.len().max(1) - 1),
            Failure::Departed => write!(f, "the branches no longer cross"),
            Failure::Mesh(error) => write!(f, "the estimated error is still {error:.1e} on the finest mesh"),
        }
    }
}

/// A converged point with its vectors on its mesh.
#[derive(Clone, Debug)]
pub struct Station {
    /// The point as it will be stored; its tangent points towards larger positions.
    pub point: Point,
    /// Unknowns.
    pub u: Vec<f64>,
    /// Unit tangent in the direction of travel.
    pub tangent: Vec<f64>,
    /// The mesh of `point`, `u` and `tangent`.
    pub mesh: Mesh,
    /// A finer mesh for the next step, if the error on `mesh` is too close to the tolerance.
    pub roomier: Option<Mesh>,
    /// Share of the tolerance to which the mesh of the next point is adapted: less than 1 if the multipliers need a
    /// finer mesh than the profile.
    pub share: f64,
    /// Deviation of the parameter midway from the previous station from the cubic between them; 0 if not computed.
    pub midway: f64,
    /// Intermediate solution between the previous station and this one, on the mesh of the former: distance along its
    /// tangent, and unknowns.
    pub middle: Option<(f64, Vec<f64>)>,
}

impl Station {
    /// A station at `u` with all optional data unset.
    pub fn new(point: Point, u: Vec<f64>, tangent: Vec<f64>, mesh: Mesh) -> Station {
        Station { point, u, tangent, mesh, roomier: None, share: 1.0, midway: 0.0, middle: None }
    }

    /// Reverses the tangent if necessary, so that the parameter changes along it in the direction of `slope`.
    pub fn head(&mut self, slope: f64) {
        if self.slope() * slope < 0.0 {
            self.tangent.iter_mut().chain(&mut self.point.tangent).for_each(|t| *t = -*t);
        }
    }

    /// The unknown λ: the continuation parameter over [`ZeroProblem::unit`].
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

/// Solves (1), starting from `u`, until the remaining error is about a tenth of the tolerance (0.001 of it without a
/// mesh); [`station`] completes the convergence.
///
/// # Errors
/// See [`Failure`].
pub fn correct(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    plane: &Plane,
    u: &mut [f64],
    cost: &mut Cost,
) -> Result<(), Failure> {
    correct_within(problem, settings, plane, f64::INFINITY, u, cost)
}

/// Solves (1) like [`correct`], but gives up if the first update is longer than `reach`.
///
/// # Errors
/// See [`Failure`].
pub fn correct_within(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    plane: &Plane,
    reach: f64,
    u: &mut [f64],
    cost: &mut Cost,
) -> Result<(), Failure> {
    let size = problem.unknowns();
    let goal = settings.closeness(&problem.mesh(), f64::INFINITY);
    let (mut r, mut du) = (vec![0.0; size], vec![0.0; size]);
    let mut sizes: Vec<f64> = Vec::new();
    let mut fresh = true;
    for iteration in 0..settings.max_newton {
        if !problem.residual(u, &mut r) {
            return Err(problem.obstacle(u).map_or(Failure::NotFinite, Failure::Blocked));
        }
        du.iter_mut().zip(u.iter().zip(&plane.base)).for_each(|(gap, (a, b))| *gap = a - b);
        r[size - 1] = problem.dot(&plane.row, &du) - plane.distance;
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
        if iteration == 0 && reach.is_finite() {
            let miss = problem.dot(&du, &du).sqrt();
            if miss > reach {
                return Err(Failure::Elsewhere { angle: 0.0, miss: miss / plane.distance.abs() });
            }
        }
        sizes.push(length);
        u.iter_mut().zip(&du).for_each(|(a, b)| *a -= b);
        let ratio = if iteration > 0 { length / sizes[iteration - 1] } else { 1.0 };
        // Error after this update: quadratic convergence with a new matrix, linear with an old one.
        let left = match iteration {
            0 => CURVED * length * length,
            _ if fresh => length * ratio.min(1.0).powi(2).max(CURVED * length),
            _ => length * ratio.min(1.0),
        };
        if left.min(length) < goal {
            return Ok(());
        }
        // Next to a branch point the matrix is nearly singular, and rounding stops the convergence a little earlier.
        if fresh && iteration > 1 && ratio > 0.3 && length < 0.1 * settings.tolerance {
            return Ok(());
        }
        // Slow convergence may be due to an old matrix, but not if the matrix is new.
        let worse = (iteration > 1 && ratio > 0.9) || (iteration > 0 && ratio > 4.0);
        if fresh && worse && length > settings.tolerance || length > 10.0 {
            return Err(Failure::NoConvergence(sizes));
        }
        // The matrix is kept while it still gains well over a digit per iteration.
        fresh = if iteration == 0 { length > 3e-3 } else { ratio > 0.1 };
    }
    Err(Failure::NoConvergence(sizes))
}

/// Relative Newton update that rounding may leave next to a singular matrix …
const STALLED: f64 = 1e-9;
/// … and relative residual below which larger updates, too, are attributed to rounding.
const ROUNDED: f64 = 1e-11;

/// Assumed ratio of the error after a Newton step to the square of the error before it.
const CURVED: f64 = 10.0;

/// Completes Newton's method at `u` with a matrix evaluated close to the result: the last update is no larger than
/// `close`. Returns the tangent (2), at an acute angle to `along`.
///
/// # Errors
/// See [`Failure`].
pub fn arrive(
    problem: &mut dyn ZeroProblem,
    u: &mut [f64],
    along: &[f64],
    close: f64,
    cost: &mut Cost,
) -> Result<Vec<f64>, Failure> {
    let size = problem.unknowns();
    problem.anchor(u);
    let (mut r, mut du) = (vec![0.0; size], vec![0.0; size]);
    let mut sizes: Vec<f64> = Vec::new();
    loop {
        if !problem.residual(u, &mut r) {
            return Err(problem.obstacle(u).map_or(Failure::NotFinite, Failure::Blocked));
        }
        r[size - 1] = 0.0;
        problem.factorise(u, along).map_err(|_| Failure::Singular)?;
        cost.factorisations += 1;
        cost.newton += 1;
        problem.solve(&r, &mut du);
        let length = problem.relative_size(&du, u);
        if !length.is_finite() {
            return Err(Failure::NotFinite);
        }
        let stalls = sizes.last().is_some_and(|before| length > 0.3 * before);
        let rounding = length < STALLED || length < 100.0 * close && problem.relative_size(&r, u) < ROUNDED;
        sizes.push(length);
        u.iter_mut().zip(&du).for_each(|(a, b)| *a -= b);
        // Next to a singular matrix rounding stops the convergence earlier.
        if length < close || (stalls && rounding) {
            break;
        }
        if stalls || sizes.len() > 5 {
            return Err(Failure::NoConvergence(sizes));
        }
    }
    r.fill(0.0);
    r[size - 1] = 1.0;
    let mut tangent = du;
    problem.solve(&r, &mut tangent);
    let norm = problem.dot(&tangent, &tangent).sqrt();
    if !(norm.is_finite() && norm > 0.0) {
        return Err(Failure::Singular);
    }
    tangent.iter_mut().for_each(|t| *t /= norm);
    Ok(tangent)
}

/// Station next to the nearly converged `u`, in the hyperplane through it across `along`. Tangent (2), stability and
/// error estimates come from a matrix evaluated no farther away than `close`. The tangent makes an acute angle with
/// `along`; `direction` is +1 for travel towards larger positions, else -1.
///
/// # Errors
/// See [`Failure`].
pub fn station(
    problem: &mut dyn ZeroProblem,
    mut u: Vec<f64>,
    along: &[f64],
    close: f64,
    direction: f64,
    cost: &mut Cost,
) -> Result<Station, Failure> {
    let tangent = arrive(problem, &mut u, along, close, cost)?;
    Ok(examined(problem, u, tangent, direction))
}

/// Station at `u`, where the problem was factorised last.
pub fn examined(problem: &mut dyn ZeroProblem, u: Vec<f64>, tangent: Vec<f64>, direction: f64) -> Station {
    let examination = problem.examine(&u);
    let stored: Vec<f64> = tangent.iter().map(|t| direction * t).collect();
    let point = problem.point(&u, &stored, examination);
    Station::new(point, u, tangent, problem.mesh())
}

/// Estimates the error of the spectrum at a station where the problem was factorised last.
pub fn doubted(problem: &mut dyn ZeroProblem, found: &mut Station) {
    found.point.trust.spectrum = problem.spectrum_error(&found.u, &found.tangent, &found.point.spectrum);
}

/// Largest stated error of a point, in tolerances: the stated error is four times the estimate.
pub(super) const RESOLVED: f64 = 6.0;

/// A multiplier within this many defects of the unit circle could be on its other side …
const CERTAIN: f64 = 20.0;
/// … and is recomputed with the tolerance multiplied by this factor.
const TIGHTER: f64 = 0.05;

/// Defect, in tolerances, below which the mesh of the next point may have four times the error.
const RELAXED: f64 = 0.5;

/// Settings for [`refine`].
#[derive(Clone, Copy, Debug)]
pub struct Care {
    /// Initial share of the tolerance; see [`Station::share`].
    pub share: f64,
    /// Largest distance from the point at which its matrix may be evaluated; see [`Settings::closeness`].
    pub close: f64,
    /// True if the mesh will probably suffice. Its errors are then measured only once the point is complete.
    pub trusted: bool,
}

/// Corrects `u` in `plane` and [`refine`]s it.
///
/// # Errors
/// See [`Failure`].
pub fn settle(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    plane: Plane,
    mut u: Vec<f64>,
    direction: f64,
    cost: &mut Cost,
) -> Result<Station, Failure> {
    correct(problem, settings, &plane, &mut u, cost)?;
    let care = Care { share: 1.0, close: settings.closeness(&problem.mesh(), plane.distance), trusted: false };
    refine(problem, settings, care, plane.row, u, direction, cost)
}

/// Adapts the mesh at the corrected point `u` until the error estimate meets the tolerance and both multiplier defects
/// meet five times the tolerance. The problem is left on the resulting mesh, with the result as its reference.
///
/// # Errors
/// See [`Failure`].
pub fn refine(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    care: Care,
    mut row: Vec<f64>,
    mut u: Vec<f64>,
    direction: f64,
    cost: &mut Cost,
) -> Result<Station, Failure> {
    let (mut tolerance, mut tightened) = (care.share * settings.tolerance, care.share <= TIGHTER);
    let mut known = None;
    if care.trusted {
        let found = station(problem, u.clone(), &row, care.close, direction, cost)?;
        u.clone_from(&found.u);
        let fits = problem.better_mesh(&u, tolerance).is_none() && problem.coarser_mesh(&u, tolerance).is_none();
        known = fits.then_some(found);
    }
    let mut coarser = if known.is_some() { None } else { problem.coarser_mesh(&u, tolerance) };
    for round in 0..4 {
        for attempt in 0..if known.is_some() { 0 } else { 10 } {
            // A layer that falls differently between the nodes of every new mesh needs a few more nodes than predicted.
            let wanted = tolerance * 0.7f64.powi((attempt - 2).max(0));
            let Some(better) = coarser.take().or_else(|| problem.better_mesh(&u, wanted)) else { break };
            let from = problem.mesh();
            // The hyperplane passes through the point itself, so that remeshing does not move it along the curve.
            u = problem.carry(&u, &from, &better);
            row = problem.transfer(&row, &from, &better);
            problem.set_mesh(&better);
            problem.anchor(&u);
            let plane = Plane { row: row.clone(), base: u.clone(), distance: 0.0 };
            correct(problem, settings, &plane, &mut u, cost)?;
        }
        let mut found = match known.take() {
            Some(found) => found,
            None => station(problem, u, &row, care.close, direction, cost)?,
        };
        let trust = found.point.trust;
        let defect = found.point.multiplier_defect();
        // Multipliers can need a finer mesh than the profile. If refinement does not improve them, the stated defects
        // show it.
        let accurate = defect <= 5.0 * settings.tolerance || round == 3;
        // The error of a multiplier must not decide on which side of the unit circle it lies.
        let again = settings.stability && !tightened && round < 3;
        if again && accurate {
            doubted(problem, &mut found);
        }
        let within = |distance: f64| found.point.free_spectrum().iter().any(|z| z.norm().ln().abs() < distance);
        let close = |defect: f64| within(CERTAIN * defect);
        let certain = !(again && (close(defect) || within(found.point.trust.spectrum)));
        if accurate && certain {
            if trust.discretisation > RESOLVED * settings.tolerance {
                return Err(Failure::Mesh(trust.discretisation));
            }
            if settings.stability && found.point.spectrum.iter().any(|z| z.re.is_nan()) {
                return Err(Failure::Spectrum);
            }
            // Errors of multipliers shrink at least as fast as those of the profile.
            let ample = round == 0 && defect <= RELAXED * settings.tolerance && !close(defect / TIGHTER);
            found.share = tolerance / settings.tolerance;
            if ample {
                found.share = (4.0 * found.share).min(1.0);
            }
            found.roomier = problem.better_mesh(&found.u, 0.5 * tolerance);
            if found.point.trust.spectrum.is_nan() {
                doubted(problem, &mut found);
            }
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
