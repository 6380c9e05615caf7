//! Overhung rotor with a cubic spring and a snubber ring: what is special to it, beside its text models.
//!
//! **Idea.** The rotor of models/overhung-rotor.toml once more as Rust: faster where only this model matters, and an
//! independent yardstick for models that are written as text. Around it, what an engineer asks of a rotor and no general program
//! knows: units, natural frequencies in both frames, the names of bouncing motions, and where they come from.
//!
//! | question | answer |
//! |---|---|
//! | which numbers without dimensions belong to my rotor, and back? | [`Si::given`], [`Nondimensional`], [`Nondimensional::to_si`] |
//! | where are the natural frequencies, and where in the ratio n:m? | [`campbell()`], [`Ratio::speed`], [`resonances`] |
//! | what does a cycle consist of, and is it balanced? | [`Spectrum`] |
//! | how does the ring take up force? | [`ContactLaw`] |
//! | where do bouncing cycles come from as damping and unbalance vanish? | [`backbone()`] |
//!
//! ```
//! use foldline_rotor::{Nondimensional, Ratio, quantity};
//!
//! let polar = Nondimensional::REFERENCE.polar;
//! let speed = Ratio::SINGLE_LOOP.speed(polar, 1.0).unwrap();
//! assert!((speed - 3.320848274).abs() < 1e-9);
//! assert_eq!(quantity("c", "0.5 mm", "m"), Ok(0.5e-3));
//! assert!(quantity("c", "0.5 kg", "m").is_err());
//! ```
//!
//! **Equations.** With U = (u, v) in the frame that rotates with the shaft, r = |U|, J = [[0, -1], [1, 0]]:
//!
//! 1. U″ + (-Ω J (J_p - 2) + 2ζ) U′ + (Ω²(J_p - 1) + 1 + 2ζΩ J) U + f = mεΩ² (1, 0)ᵀ
//! 2. f = ((1 - κ) γ r² + κ h(r)) U, where h is the stiffness of a [`ContactLaw`]
//!
//! **Source.** akay2024, section 2.
//!
//! **Departures.** Length is measured in the clearance *at the disc*, U = V/(c a/b), and γ = k₃c²/k_r; the print has c and b².

mod backbone;
mod campbell;
mod contact;
mod field;
mod given;
mod jet;
mod lanes;
mod quantities;
mod sharpness;
mod spectrum;
mod units;

pub use backbone::{Backbone, BackbonePoint, BackboneProblem, Reach, backbone};
pub use campbell::{Modes, Ratio, campbell, modes, resonances, undamped_modes};
pub use contact::{ContactLaw, Stiffness};
pub use field::OverhungRotor;
pub use lanes::Constants;
pub use quantities::{Nondimensional, Scale, Si};
pub use sharpness::{SmoothingError, exact_motion, fitted_power, smallest_sharpness, smoothing_errors};
pub use spectrum::{Frame, Line, Spectrum, Whirl, mean_square};
pub use units::{Dimension, Mistake, Unit, quantity};
