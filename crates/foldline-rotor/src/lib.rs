//! Overhung rotor with a cubic spring and a snubber ring, written by hand.
//!
//! **Idea.** The rotor of models/overhung-rotor.toml once more as Rust: faster where only this model matters, and an
//! independent yardstick for models that are written as text.
//!
//! **Equations.** With U = (u, v) in the frame that rotates with the shaft, r = |U|, J = [[0, -1], [1, 0]]:
//!
//! 1. U″ + (-Ω J (J_p - 2) + 2ζ) U′ + (Ω²(J_p - 1) + 1 + 2ζΩ J) U + f = mεΩ² (1, 0)ᵀ
//! 2. f = ((1 - κ) γ r² + κ h(r)) U, where h is the stiffness of a [`ContactLaw`]
//!
//! **Source.** akay2024, section 2.
//!
//! **Departures.** Length is measured in the clearance *at the disc*, U = V/(c a/b), and γ = k₃c²/k_r; the print has c and b².

mod contact;
mod field;
mod jet;
mod quantities;
mod sharpness;

pub use contact::{ContactLaw, Stiffness};
pub use field::OverhungRotor;
pub use quantities::{Nondimensional, Si};
pub use sharpness::{SmoothingError, exact_motion, smallest_sharpness, smoothing_errors};
