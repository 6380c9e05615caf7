//! Numerical continuation and bifurcation analysis of ordinary differential equations.
//!
//! **Idea.** A bifurcation diagram is a set of curves of equilibria and of cycles (periodic orbits). Each point has a
//! known stability and an estimated accuracy, and the bifurcations between points are located. This crate computes such
//! diagrams. It contains only the mathematics: no files, no clock, no printing.
//!
//! Read it in this order:
//!
//! | question | module |
//! |---|---|
//! | what must a model, a curve, a monitor provide? | [`contract`] |
//! | what is the result? | [`diagram`] |
//! | how is a model written, evaluated, differentiated? | [`model`] |
//! | which units are known, and how are they converted? | [`units`] |
//! | how is a trajectory computed? | [`simulation`] |
//! | … and many on a graphics card? | [`emitted`] |
//! | which equations define the curve? | [`problem`] |
//! | how is it followed? | [`continuation`] |
//! | is it stable? | [`stability`] |
//! | what happened there? | [`special`] |
//! | where do first solutions come from? | [`attractors`] |
//! | how is a whole diagram assembled? | [`explore`] |
//! | is it right? | [`verify`] |
//! | how does it depend on every parameter? | [`sensitivity`] |
//! | what are the results in other units? | [`converted`] |
//! | what does a smoothed law of contact change? | [`smoothing`] |

pub mod attractors;
pub mod continuation;
pub mod contract;
pub mod converted;
pub mod diagram;
pub mod emitted;
pub mod explore;
pub mod linalg;
pub mod model;
pub mod problem;
pub mod sensitivity;
pub mod simulation;
pub mod smoothing;
pub mod special;
pub mod stability;
pub mod susceptibility;
pub mod units;
pub mod verify;
