//! Numerical continuation and bifurcation analysis of ordinary differential equations.
//!
//! **Idea.** A bifurcation diagram is a set of curves of equilibria and of cycles (periodic orbits), each point with its
//! stability and an estimate of how far it can be trusted, and every bifurcation between two points located. This crate
//! computes such diagrams. It holds the mathematics only: no files, no clock, no printing.
//!
//! Read it in this order:
//!
//! | question | module |
//! |---|---|
//! | what must a model, a curve, a monitor be able to do? | [`contract`] |
//! | what comes out? | [`diagram`] |
//! | how is a model written, evaluated, differentiated? | [`model`] |
//! | which units are there, and how are they converted? | [`units`] |
//! | how does a trajectory run? | [`simulation`] |
//! | what is the curve? | [`problem`] |
//! | how do we walk it? | [`continuation`] |
//! | is it stable? | [`stability`] |
//! | what happened there? | [`special`] |
//! | where do first solutions come from? | [`attractors`] |
//! | how does a whole diagram come about? | [`explore`] |
//! | is it right? | [`verify`] |
//! | what is it in other units? | [`converted`] |

pub mod attractors;
pub mod continuation;
pub mod contract;
pub mod converted;
pub mod diagram;
pub mod explore;
pub mod linalg;
pub mod model;
pub mod problem;
pub mod simulation;
pub mod special;
pub mod stability;
pub mod units;
pub mod verify;
