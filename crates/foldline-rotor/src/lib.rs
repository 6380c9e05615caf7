//! Overhung rotor with a cubic spring and a snubber ring: functions specific to it, in addition to its text models.
//!
//! **Idea.** The rotor of models/overhung-rotor.toml written in Rust: faster where only this model matters, and an
//! independent reference for models written as text. Added to it are questions that an engineer asks of a rotor and
//! that a general program cannot answer: units, natural frequencies in both frames, the names of bouncing motions, and
//! their origin.
//!
//! | question | answer |
//! |---|---|
//! | which nondimensional constants belong to my rotor, and back? | [`Si::given`], [`Nondimensional`], [`Nondimensional::to_si`] |
//! | where are the natural frequencies, and where in the ratio n:m? | [`campbell()`], [`Ratio::speed`], [`resonances`] |
//! | which lines does a cycle have, and is it balanced? | [`Spectrum`] |
//! | what is the force of the ring? | [`ContactLaw`] |
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
//! **Departures.** Length is measured in units of the clearance *at the disc*, U = V/(c a/b), and γ = k₃c²/k_r; the
//! publication has c and b².

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
