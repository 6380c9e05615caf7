//! How a curve is walked.
//!
//! **Idea.** Predict along the tangent, correct in the hyperplane across it, accept, look back at the step for special
//! points, choose the next step. Nothing here knows what an equilibrium or a cycle is.
//!
//! | step | file |
//! |---|---|
//! | Newton's method in a hyperplane; tangent | [`corrector`] |
//! | from one accepted point to the next | [`mod@follow`] |
//! | one step: predicted, corrected, compared with what it comes from | `step` |
//! | whether a step may be accepted | `judge` |
//! | why a side ends | `ends` |
//! | limit on the work of a side | `allowance` |
//! | what lies between two accepted points | [`inspect`] |
//! | requested values along the way | `marks` |
//! | on which side of it a point is | `side` |
//! | zero of a monitor along the curve | [`locate`] |
//! | the same where branches cross | [`straddle`] |
//!
//! **Source.** keller1977 (pseudo-arclength); allgower1990 (step length by angle and contraction).

mod allowance;
pub mod corrector;
mod diagnosis;
mod ends;
pub mod follow;
pub mod inspect;
mod judge;
pub mod locate;
mod marks;
mod side;
mod step;
pub mod straddle;

use crate::diagram::Measure;
pub use corrector::{Failure, Station};
pub(crate) use diagnosis::UNCROSSED;
pub use ends::Homecoming;
pub use follow::{Follow, Item, follow};

/// Newton updates on a mesh, relative, that rounding may leave.
const ROUNDING: f64 = 1e-12;

/// Everything that governs a continuation run. The user states `tolerance`, the range and the limit on points; the rest
/// follows from them and never needs touching.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Relative accuracy of the points.
    pub tolerance: f64,
    /// Smallest and largest value of the continuation parameter.
    pub range: [f64; 2],
    /// Bounds of further parameters, by their index; the side ends where one is reached.
    pub bounds: Vec<(usize, [f64; 2])>,
    /// Whether changes of stability along the curve are accounted for. Not so where a special point is held: there some
    /// multiplier lies on the unit circle all the way.
    pub stability: bool,
    /// Limit on the points of one side.
    pub max_points: usize,
    /// Largest angle between the tangents of neighbouring points; a larger one rejects the step.
    pub max_angle: f64,
    /// Angle for which the step length aims.
    pub target_angle: f64,
    /// Largest step, in scaled arclength.
    pub max_step: f64,
    /// First step.
    pub first_step: f64,
    /// Step below which the side ends.
    pub min_step: f64,
    /// Growth of the period, against that at the start, at which the side ends as unbounded.
    pub period_growth: f64,
    /// Newton iterations before a step counts as failed.
    pub max_newton: usize,
    /// Coordinate reflections under which the model is equivariant, the identity first; see [`crate::diagram::Point::difference`].
    pub reflections: Vec<Vec<bool>>,
    /// `[n]` characteristic sizes of the states.
    pub scales: Vec<f64>,
    /// `[n]` periods of the states that are angles; see [`crate::contract::VectorField::periods`].
    pub periods: Vec<f64>,
    /// In how many places the right-hand side is not smooth; for the diagnosis of ends.
    pub kinks: usize,
}

impl Settings {
    /// How solutions are compared.
    pub(crate) fn measure(&self) -> Measure<'_> {
        Measure { scales: &self.scales, periods: &self.periods }
    }

    /// Settings for a tolerance and a parameter range.
    pub fn new(tolerance: f64, range: [f64; 2], scales: &[f64]) -> Settings {
        Settings {
            tolerance,
            range,
            bounds: Vec::new(),
            stability: true,
            max_points: 10_000,
            max_angle: 0.45,
            target_angle: 0.25,
            max_step: 0.2,
            first_step: 0.02,
            min_step: 1e-9,
            period_growth: 1e3,
            max_newton: 8,
            reflections: vec![vec![false; scales.len()]],
            scales: scales.to_vec(),
            periods: Vec::new(),
            kinks: 0,
        }
    }

    /// How far from a point the matrix may be taken that gives its tangent and its multipliers, relative. Next to errors of
    /// discretisation a tenth of the tolerance does not show, nor does a thousandth of the step of that `length` in what
    /// changes along it; where there is no mesh the iteration goes all the way.
    pub fn closeness(&self, mesh: &crate::diagram::Mesh, length: f64) -> f64 {
        if mesh.is_empty() {
            return self.newton_tolerance();
        }
        let far = (0.1 * self.tolerance).min(1e-3 * length.abs());
        // In a step so short that more would show, closer than elsewhere.
        let near = if length == 0.0 { f64::INFINITY } else { 1e-5 * length.abs() };
        far.max(self.newton_tolerance().min(near)).max(ROUNDING)
    }

    /// Size of the last Newton update, relative: far enough below the tolerance that iteration errors do not show.
    pub fn newton_tolerance(&self) -> f64 {
        (1e-3 * self.tolerance).max(1e-11)
    }
}
