//! Pseudo-arclength continuation.
//!
//! **Idea.** Predict along the tangent, correct in the hyperplane across it, accept, search the step for special
//! points, choose the next step size. Nothing here depends on whether the solutions are equilibria or cycles.
//!
//! | step | file |
//! |---|---|
//! | Newton's method in a hyperplane; tangent | [`corrector`] |
//! | from one accepted point to the next | [`mod@follow`] |
//! | one step: prediction, correction, comparison with the previous point | `step` |
//! | acceptance of a step | `judge` |
//! | reasons for which a side ends | `ends` |
//! | limit on the work of a side | `allowance` |
//! | special points between two accepted points | [`inspect`] |
//! | requested values along the way | `marks` |
//! | eigenvalues that cross in opposite directions | `opposite` |
//! | side of nearby special points on which a point lies | `side` |
//! | zero of a monitor along the curve | [`locate`] |
//! | zero of a monitor where branches cross | [`straddle`] |
//!
//! **Source.** keller1977 (pseudo-arclength); allgower1990 (step length by angle and contraction).

mod allowance;
pub mod corrector;
mod diagnosis;
mod ends;
mod even;
pub mod follow;
pub mod inspect;
mod judge;
pub mod locate;
mod marks;
mod moving;
mod opposite;
mod side;
mod step;
pub mod straddle;

use crate::diagram::{Measure, Symmetry};
pub use corrector::{Failure, Station};
pub(crate) use diagnosis::UNCROSSED;
pub use ends::Homecoming;
pub use follow::{Follow, Item, follow};

/// Relative Newton update on a mesh that rounding may leave.
const ROUNDING: f64 = 1e-12;

/// Settings of a continuation run. The user chooses the tolerance, the range and the limit on points; the rest follows
/// from these and need not be changed.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Relative accuracy of the points.
    pub tolerance: f64,
    /// Smallest and largest value of the continuation parameter.
    pub range: [f64; 2],
    /// Bounds of further parameters, with their indices. The side ends where one is reached.
    pub bounds: Vec<(usize, [f64; 2])>,
    /// True if changes of stability along the curve must be explained by special points. False along curves of
    /// bifurcation points, where some multiplier is on the unit circle throughout.
    pub stability: bool,
    /// Maximum number of points on one side.
    pub max_points: usize,
    /// Largest angle between the tangents at neighbouring points; a step with a larger one is rejected.
    pub max_angle: f64,
    /// Angle at which the step size control aims.
    pub target_angle: f64,
    /// Largest step, in scaled arclength.
    pub max_step: f64,
    /// Initial step.
    pub first_step: f64,
    /// Step below which the side is ended.
    pub min_step: f64,
    /// Growth of the period since the start at which the side ends with an unbounded period.
    pub period_growth: f64,
    /// Maximum number of Newton iterations in a step.
    pub max_newton: usize,
    /// Symmetries of the model, the identity first; see
    /// [`crate::diagram::Point::difference`].
    pub symmetries: Vec<Symmetry>,
    /// Symmetries that permute states.
    pub exchanges: Vec<Symmetry>,
    /// `[n]` characteristic sizes of the states.
    pub scales: Vec<f64>,
    /// `[n]` periods of the states that are angles; see [`crate::contract::VectorField::periods`].
    pub periods: Vec<f64>,
    /// Number of non-smooth terms in the right-hand side; for the diagnosis of ends.
    pub kinks: usize,
}

impl Settings {
    /// The measure in which solutions are compared.
    pub(crate) fn measure(&self) -> Measure<'_> {
        Measure { scales: &self.scales, periods: &self.periods }
    }

    /// Every symmetry but the identity.
    pub(crate) fn images(&self) -> impl Iterator<Item = &Symmetry> {
        self.symmetries.iter().filter(|own| !own.is_identity()).chain(&self.exchanges)
    }

    /// True if the model is symmetric under changes of sign. Whether it is under an exchange of states depends on their
    /// units, and the steps must not.
    pub(crate) fn is_symmetric(&self) -> bool {
        self.symmetries.len() > 1
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
            symmetries: vec![Symmetry::identity()],
            exchanges: Vec::new(),
            scales: scales.to_vec(),
            periods: Vec::new(),
            kinks: 0,
        }
    }

    /// Largest relative distance from a point at which the matrix for its tangent and multipliers may be evaluated. On
    /// a mesh a tenth of the tolerance is hidden by discretisation errors, and a thousandth of the step `length` is
    /// negligible for quantities that change along it. Without a mesh the iteration runs to
    /// [`Settings::newton_tolerance`].
    pub fn closeness(&self, mesh: &crate::diagram::Mesh, length: f64) -> f64 {
        if mesh.is_empty() {
            return self.newton_tolerance();
        }
        let far = (0.1 * self.tolerance).min(1e-3 * length.abs());
        // On a very short step even the Newton tolerance may be too far.
        let near = if length == 0.0 { f64::INFINITY } else { 1e-5 * length.abs() };
        far.max(self.newton_tolerance().min(near)).max(ROUNDING)
    }

    /// Size of the last relative Newton update: so far below the tolerance that iteration errors are negligible.
    pub fn newton_tolerance(&self) -> f64 {
        (1e-3 * self.tolerance).max(1e-11)
    }
}
