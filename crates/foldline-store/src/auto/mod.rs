//! What AUTO-07p has computed, as a starting point.
//!
//! **Idea.** A file `s.NAME` holds labelled solutions ([`solutions`]): equilibria, or cycles as values at the mesh points of a
//! collocation like ours and between them, evenly spaced. `c.NAME` and `b.NAME` tell how states and parameters are called and how
//! far the branch was to go ([`names`]). [`study`] makes of a solution a study of our own, in which it is a seed.
//!
//! **Source.** doedel2012, sections 5.9 and 10; the layout of the numbers is checked against files written by AUTO-07p 0.9.3.
//!
//! **Departures.** The last three files that AUTO may write (directions, diagnostics) are not looked at.

mod names;
mod solutions;
mod study;

pub use names::Names;
pub use solutions::{Labelled, read_solutions, solutions};
pub use study::{Chosen, Complaint, Mapping, study};
