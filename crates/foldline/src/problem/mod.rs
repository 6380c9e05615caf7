//! What the curve is: equilibria and cycles as zero problems.
//!
//! | curve | unknowns u | file |
//! |---|---|---|
//! | equilibria | x, λ | [`equilibrium`] |
//! | cycles | profile at mesh nodes and Gauss points, T, λ | [`cycle`] |

pub mod cycle;
pub mod defect;
pub mod equilibrium;
pub mod extremes;
pub mod gauss;
pub mod mesh;
pub mod setting;

pub use setting::{Axis, Setting, Tie};
