//! Import from AUTO-07p: solutions as starting points, and programs as models and studies.
//!
//! **Idea.** A file `s.NAME` holds labelled solutions ([`solutions`]): equilibria, and cycles as values at the mesh
//! points and at evenly spaced points between them. `c.NAME` and `b.NAME` give the names of states and parameters and
//! the range of the branch ([`Names`]). [`study`] writes a study in which each chosen solution is a seed. [`program()`] translates
//! equations and constants to a model and a study.
//!
//! **Source.** doedel2019, chapter 6 for the solution types; the layout of the numbers is that of files written by
//! AUTO-07p 0.9.2 (tests/auto).
//!
//! **Departures.** The branch direction stored with each solution is not used: it follows from the model.

mod mapping;
mod names;
mod program;
mod reader;
mod solutions;
mod study;

pub use mapping::{Complaint, Mapping};
pub use names::Names;
pub use program::{Program, Text, data_of, program};
pub use solutions::{Labelled, read_solutions, solutions};
pub use study::{Chosen, study};
