//! Equilibria, cycles and cycles of maps as zero problems.
//!
//! | curve | unknowns u | file |
//! |---|---|---|
//! | equilibria | x, λ | [`equilibrium`] |
//! | cycles | profile at mesh nodes and Gauss points, T, λ | [`cycle`] |
//! | orbits that connect equilibria | profile, T, the equilibria, two parameters | [`connecting`] |
//! | cycles with events | profiles and durations of all flights between events, λ | [`impact`] |
//! | cycles of maps | all iterates, λ | [`map`] |
//! | tori | profiles from equally spaced phases, T, ρ, λ | [`torus`] |
//! | bifurcation points | those of either problem with two parameters, and extra ones of the condition | [`held`] |

pub mod averages;
pub mod connecting;
pub mod cycle;
pub mod defect;
pub mod equilibrium;
pub mod extremes;
pub mod gauss;
pub mod held;
pub mod impact;
pub mod map;
pub mod mesh;
pub(crate) mod piecewise;
pub mod setting;
pub(crate) mod stiffness;
pub mod torus;
mod unfolding;

pub use setting::{Axis, Setting, Tie};

use crate::contract::ZeroProblem;

/// Distance along the unit tangent t that undoes the change of the continuation parameter, the last component of
/// `shift`, by a displacement to the nearest solution of a branch. Next to a fold, where the solutions at that value of
/// the parameter coalesce within the displacement or do not exist, 0.
///
/// At the distance σ from a fold where the branch turns in a length of order 1, |t_λ| is of order σ. The linear formula
/// holds if the distance δ/|t_λ| is small compared with σ, thus δ ≪ t_λ².
fn back_along(problem: &dyn ZeroProblem, shift: &[f64], tangent: &[f64]) -> f64 {
    const SMALL: f64 = 0.1;
    let last = tangent.len() - 1;
    let alone = |value: f64| -> f64 {
        let mut vector = vec![0.0; last + 1];
        vector[last] = value;
        problem.dot(&vector, &vector).sqrt()
    };
    let share = alone(tangent[last]) / problem.dot(tangent, tangent).sqrt();
    if alone(shift[last]) < SMALL * share * share { shift[last] / tangent[last] } else { 0.0 }
}
