//! What AUTO-07p has computed, as a starting point.
//!
//! **Idea.** A file `s.NAME` holds labelled solutions ([`solutions`]): equilibria, or cycles as values at the mesh points of a
//! collocation like ours and between them, evenly spaced. `c.NAME` and `b.NAME` tell how states and parameters are called and how
//! far the branch was to go ([`Names`]). [`study`] makes of a solution a study of our own, in which it is a seed.
//!
//! **Source.** doedel2019, chapter 6 for the kinds; the layout of the numbers is that of files which AUTO-07p 0.9.2 has written
//! (tests/auto).
//!
//! **Departures.** The direction of a branch, which stands behind each solution, is not used: it follows from the model.

mod mapping;
mod names;
mod reader;
mod solutions;
mod study;

pub use mapping::{Complaint, Mapping};
pub use names::Names;
pub use solutions::{Labelled, read_solutions, solutions};
pub use study::{Chosen, study};
