//! What the curve is: equilibria and cycles as zero problems.
//!
//! | curve | unknowns u | file |
//! |---|---|---|
//! | equilibria | x, λ | [`equilibrium`] |
//! | cycles | profile at mesh nodes and Gauss points, T, λ | [`cycle`] |
//! | special points in two parameters | either of these with both parameters, and what the condition adds | [`held`] |

pub mod averages;
pub mod cycle;
pub mod defect;
pub mod equilibrium;
pub mod extremes;
pub mod gauss;
pub mod held;
pub mod mesh;
pub mod setting;
mod unfolding;

pub use setting::{Axis, Setting, Tie};
