//! Comparisons with other programs: AUTO-07p and SciPy.
//!
//! | question | file |
//! |---|---|
//! | how is AUTO run, and what are its files? | [`auto`], [`auto_files`] |
//! | one Newton iteration at equal mesh, for the rotor and for chains | [`iteration`] |
//! | one branch at equal accuracy | [`single_loop`] |
//! | all of figure 7 | [`diagrams`] |
//! | ensembles, compared with SciPy | [`scipy`] |

mod auto;
mod auto_files;
mod diagrams;
mod iteration;
mod scipy;
mod single_loop;

use crate::workplace::Part;

/// Parts in the order of the report.
pub const PARTS: [(&str, Part); 5] = [
    ("AUTO-07p: one Newton iteration at equal mesh", iteration::rotor),
    ("AUTO-07p: chains", iteration::chains),
    ("AUTO-07p: cubic single loop from 5 to 10 at equal accuracy", single_loop::compared),
    ("AUTO-07p: the branches of figure 7", diagrams::compared),
    ("SciPy: an ensemble", scipy::compared),
];
