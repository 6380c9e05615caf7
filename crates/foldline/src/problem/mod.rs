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
