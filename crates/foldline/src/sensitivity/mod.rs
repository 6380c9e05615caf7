//! Derivatives of special points and of single solutions with respect to every parameter.
//!
//! **Idea.** With all parameters free, the bifurcations of one kind form a manifold whose tangent space is known at a
//! point from one factorisation: that of the solutions, bordered, and of the few equations of the bifurcation. A
//! direction in it along which one parameter changes by 1 and the others stay contains all derivatives at once.
//!
//! **Equations.** F(w, λ, p) = 0 the solutions and g(w, σ, λ, p) = 0 the defining system of the bifurcation, as for curves
//! in two parameters ([`crate::problem::held`]); λ the parameter of the branch and p the others:
//!
//! ```text
//!   (1)  F_w w' + F_λ λ' + F_{p_i} = 0,   g_w w' + g_σ σ' + g_λ λ' + g_{p_i} = 0       w', σ', λ': derivatives in p_i
//!   (2)  period:   T',  for forced cycles q ∂(forcing period)/∂p_i and its part along λ',  at a Hopf point (2π/ω)'
//!   (3)  extremes: see `extremes`
//! ```
//!
//! The derivatives of a single solution follow from the first equation with λ among the p_i.
//!
//! A generic change of a model destroys a branch point. With the unfolding F + b d = 0, (1) gives b' as well. To first
//! order the point persists only if b' = 0, as where p_i preserves a symmetry or an invariant solution; otherwise λ'
//! has no meaning. Parameters with b' = 0 are checked by a solution at a changed value, at which b must still vanish.
//!
//! **Errors.** Every derivative is computed twice: on the mesh of the solution and on one with 1.5 times as many
//! intervals. The second is returned. Its error is that of the first divided by 1.5^order, so that the difference of
//! both bounds it where the order is at least two. For extremes, whose error depends on where they lie between the
//! nodes, it is the largest difference of the changing profiles over the mesh intervals about the extremum. Without a
//! mesh the second computation begins elsewhere and has other rounding errors.
//!
//! **Source.** govaerts2000, §4 (bordered extended systems); the elimination for many parameters is ours.
//!
//! **Fails when** the defining system is singular: at points of codimension two, and where the solution is not isolated.

mod extremes;
pub mod listed;
mod routes;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_random;
pub mod uncertainty;

pub use crate::model::Spread;
pub use extremes::Extreme;
pub use uncertainty::{Band, Uncertainty, uncertainty};

use crate::diagram::{Branch, Family, Kind, Point, SpecialPoint};
use crate::explore::plan::Plan;
use crate::explore::{SLIDING, System, axis_of};
use crate::special::unfolded::{Unfolded, sizes};
use routes::{Base, Posed};

/// A derivative and its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Derivative {
    /// dq/dp, in the units of the model.
    pub value: f64,
    /// Bound on its error.
    pub error: f64,
}

/// A number whose derivatives are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Measured {
    /// The parameter of the branch, at a special point.
    Parameter,
    /// The period of a cycle; at a Hopf point that of the cycles born there.
    Period,
    /// The angle θ of the multipliers e^{±iθ} at a torus point.
    Angle,
    /// The smallest value of a state or output (states first).
    Smallest(usize),
    /// The largest value of a state or output; at an equilibrium, its value.
    Largest(usize),
}

/// A number with its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The number.
    pub of: Measured,
    /// Its value.
    pub value: f64,
    /// `[parameters]` the derivatives, or the reason why there is none.
    pub by: Vec<Result<Derivative, String>>,
}

/// Derivatives of all numbers at a special point or solution with respect to all parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensitivities {
    /// Indices of the parameters with respect to which derivatives are taken.
    pub parameters: Vec<usize>,
    /// The numbers.
    pub rows: Vec<Row>,
}

impl Sensitivities {
    /// Returns the derivative of a number with respect to a parameter; `None` if there is none.
    pub fn of(&self, measured: Measured, parameter: usize) -> Option<Derivative> {
        let column = self.parameters.iter().position(|own| *own == parameter)?;
        self.rows.iter().find(|row| row.of == measured)?.by[column].as_ref().ok().copied()
    }
}

/// Returns the derivatives of a special point of `branch`.
///
/// # Errors
/// The reason why there are none.
pub fn of_special(
    system: &System,
    branch: &Branch,
    special: &SpecialPoint,
    plan: &Plan,
) -> Result<Sensitivities, String> {
    with_base(system, branch, special, plan, |posed, base| posed.sensitivities(base))
}

/// Calls `call` with the special point solved to rounding.
fn with_base<T>(
    system: &System,
    branch: &Branch,
    special: &SpecialPoint,
    plan: &Plan,
    call: impl FnOnce(&Posed, &Base) -> Result<T, String>,
) -> Result<T, String> {
    if let Some(reason) = unavailable(system, branch, special) {
        return Err(reason.into());
    }
    let sizes = sizes(&special.point, &system.scales);
    let unfolded = Unfolded::new(system.field, &sizes);
    let own = system.with_unfolding(&unfolded);
    let posed = Posed::new(&own, branch, Some(special.kind), &special.point, plan);
    let base = posed.base()?;
    call(&posed, &base)
}

/// Returns the derivatives of a solution on `branch` with respect to all parameters, that of the branch included, each
/// with the others fixed.
///
/// # Errors
/// The reason why there are none.
pub fn of_point(system: &System, branch: &Branch, point: &Point, plan: &Plan) -> Result<Sensitivities, String> {
    if !point.solution.is_stored() {
        return Err("the profile of this point was not stored".into());
    }
    if let Some(reason) = not_posed(system, branch) {
        return Err(reason.into());
    }
    let posed = Posed::new(system, branch, None, point, plan);
    posed.sensitivities(&posed.base()?)
}

/// Reason why no point of a branch has derivatives.
fn not_posed(system: &System, branch: &Branch) -> Option<&'static str> {
    match branch {
        _ if system.is_open() => Some("sensitivities of boundary-value problems are not computed"),
        branch if branch.family == Family::Torus => Some("sensitivities of tori are not computed"),
        _ if system.field.event_count() > 0 => Some("sensitivities of models with events are not computed"),
        branch if !branch.also.is_empty() => Some("sensitivities along a branch with held quantities are not computed"),
        _ => None,
    }
}

/// Reason why a special point has no derivatives.
fn unavailable(system: &System, branch: &Branch, special: &SpecialPoint) -> Option<&'static str> {
    if let Some(reason) = not_posed(system, branch) {
        return Some(reason);
    }
    match special.kind {
        _ if branch.held.is_some() => Some("a point of a curve in two parameters moves with both of them"),
        Kind::Mark => Some("a mark is at a value chosen in the study"),
        Kind::Unexplained => Some("it is not known which bifurcation this is"),
        Kind::Grazing if special.remark.starts_with(SLIDING) => {
            Some("grazing-sliding bifurcations have no defining system yet")
        }
        Kind::Sliding => Some("sliding bifurcations have no defining system yet"),
        kind if kind.has_codimension_two() => Some("a point of codimension two moves with two parameters"),
        Kind::BranchPoint if special.kernel() > 1 => Some("the null space has more than one dimension"),
        Kind::BranchPoint if system.field.iterated() => Some("branch points of maps have no defining system yet"),
        _ if !special.point.solution.is_stored() => Some("the profile of this point was not stored"),
        _ if axis_of(system, branch).index >= system.field.parameter_count() => Some("the branch has no parameter"),
        _ => None,
    }
}
