//! The half of the Python package `foldline` that is written in Rust: `foldline._native`.
//!
//! **Idea.** A door as thin as the command line. Text goes in and is read by `foldline-store`, so that mistakes are answered with the
//! same sentences; what comes out is handed over as bytes, from which NumPy makes arrays without a further copy. The half in
//! `python/foldline` gives all this names, defaults and pictures. Neither holds mathematics.
//!
//! | question | file |
//! |---|---|
//! | how is a model read, how does a trajectory run? | `model`, `simulation` |
//! | what is to be computed? | `study` |
//! | how is it computed, without the interpreter's lock, and stopped? | `work`, `patience` |
//! | what came out? | `diagram`, `solution` |
//! | how is it drawn? | `pictures` |
//! | as which exceptions do mistakes arrive? | `failure` |

mod bytes;
mod diagram;
mod failure;
mod model;
mod patience;
mod pictures;
mod saving;
mod seeds;
mod simulation;
mod solution;
mod study;
mod work;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::diagram::Diagram;
    #[pymodule_export]
    use crate::model::{Model, suggested};
    #[pymodule_export]
    use crate::pictures::{label, marker, pieces, svg};
    #[pymodule_export]
    use crate::seeds::{attractors, settle};
    #[pymodule_export]
    use crate::simulation::simulate;
    #[pymodule_export]
    use crate::solution::Solution;
    #[pymodule_export]
    use crate::study::Study;
    #[pymodule_export]
    use crate::work::run;
}
