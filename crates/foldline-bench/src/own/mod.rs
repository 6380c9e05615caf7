//! Benchmarks that need no other program.
//!
//! | part | file |
//! |---|---|
//! | figure 7 as a whole, and the single loop | [`figure7`] |
//! | parts of an iteration | [`parts`] |
//! | cost of an iteration as a function of the size of the problem | [`cost`], [`chain`] |
//! | two threads, ensembles, memory of a long branch, start-up | [`threads`], [`ensemble`], [`stream`], [`startup`] |

pub mod chain;
pub mod cost;
pub mod ensemble;
pub mod figure7;
mod parts;
mod startup;
mod stream;
mod threads;

use crate::workplace::Part;

/// Parts in the order of the report.
pub const PARTS: [(&str, Part); 9] = [
    ("Figure 7", figure7::whole),
    ("Cubic single loop from 5 to 10", figure7::single_loop),
    ("Where an iteration goes", parts::timed),
    ("Cost against intervals", cost::intervals),
    ("Cost against states", cost::states),
    ("Two threads", threads::two),
    ("Ensemble", ensemble::alone),
    ("A branch of 100,000 points", stream::long_branch),
    ("Start-up", startup::table),
];
