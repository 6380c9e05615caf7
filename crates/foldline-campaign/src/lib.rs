//! Campaign: many problems, whose branches are continued in several ways with results that must agree.
//!
//! **Idea.** A branch is a set of solutions, so its special points and ends must depend neither on the starting point
//! nor on the first step size. Each branch is therefore continued from its start with first steps over three decades,
//! and again from points on it. The special points are compared within their stated errors. Some points are recomputed
//! with a thousandth of the tolerance to measure their true errors.
//!
//! | question | file |
//! |---|---|
//! | which problems? | [`cases`], [`rotor`], [`drawn`] |
//! | how is a branch continued, and from where? | [`routes`] |
//! | do two runs have the same special points? | [`same`] |
//! | how large are the true errors? | [`errors`] |
//! | is every change of stability explained? | [`explained`] |
//! | do results depend on units? | [`rescaled`] |
//! | do tori move as simulations do? | [`tori`] |
//! | what is reported? | [`report`] |
//! | how long may it take? | [`watch`] |
//! | are published and independent results reproduced? | [`outside`] |

pub mod cases;
pub mod drawn;
pub mod errors;
pub mod explained;
pub mod outside;
pub mod random;
pub mod report;
pub mod rescaled;
pub mod rotor;
pub mod routes;
pub mod same;
pub mod tori;
pub mod watch;

use cases::Case;
use report::Report;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Relative tolerance of every case.
pub const TOLERANCE: f64 = 1e-6;
/// Degree of the collocation polynomials.
pub const DEGREE: usize = 4;

/// Default time limit of a case, a generous safety margin: 200 rotors together take about 4 minutes of processor time.
pub const LIMIT: Duration = Duration::from_secs(900);

/// Examines every case on `jobs` threads, each within `limit`. `tell` is called with the index and report of each case
/// as it finishes.
pub fn campaign(cases: &[Case], jobs: usize, limit: Duration, tell: &(dyn Fn(usize, &Report) + Sync)) -> Report {
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, Report)>> = Mutex::new(Vec::new());
    let work = || {
        while let Some((index, case)) = {
            let index = next.fetch_add(1, Ordering::Relaxed);
            cases.get(index).map(|case| (index, case))
        } {
            let report = routes::examine(case, limit);
            tell(index, &report);
            done.lock().unwrap_or_else(PoisonError::into_inner).push((index, report));
        }
    };
    std::thread::scope(|scope| {
        (1..jobs.min(cases.len())).for_each(|_| drop(scope.spawn(work)));
        work();
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(index, _)| *index);
    let mut whole = Report::default();
    done.into_iter().for_each(|(_, report)| whole.add(report));
    whole
}
