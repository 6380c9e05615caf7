//! The half of the Python package `foldline` that is written in Rust: `foldline._native`.
//!
//! **Idea.** An interface as thin as the command line. Text is read by `foldline-store`, so that mistakes are reported
//! in the same words; results are returned as bytes, from which NumPy makes arrays without a further copy. The half in
//! `python/foldline` adds names, defaults and pictures. Neither half contains mathematics.
//!
//! | question | file |
//! |---|---|
//! | how is a model read, how is a trajectory integrated? | `model`, `simulation`, `ensemble` |
//! | what is computed? | `study`, `basins` |
//! | how is it computed without the interpreter's lock, and interrupted? | `work`, `patience` |
//! | what are the results? | `diagram`, `solution` |
//! | how is it drawn, and shown in a notebook? | `pictures`, `explorer` |
//! | which exceptions report mistakes? | `failure` |

mod basins;
mod bytes;
mod cells;
mod diagram;
mod ensemble;
mod explorer;
mod failure;
mod model;
mod patience;
mod pictures;
mod saving;
mod seeds;
mod sensitivity;
mod simulation;
mod solution;
mod study;
mod work;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::basins::basins;
    #[pymodule_export]
    use crate::cells::motions;
    #[pymodule_export]
    use crate::diagram::Diagram;
    #[pymodule_export]
    use crate::ensemble::{Emitted, ensemble};
    #[pymodule_export]
    use crate::explorer::{Explored, page};
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
