//! A campaign: many problems, each branch followed several times, and what must not depend on how.
//!
//! **Idea.** A branch is a set of solutions. Where it is entered and how long the first step is must change neither its special
//! points nor its ends. So each branch is followed from its start with first steps over three decades, and again from
//! two of its own points, and the special points are compared within the errors they state. Some of its points are computed
//! anew for a thousandth of the tolerance, which shows what their errors really are.
//!
//! | question | file |
//! |---|---|
//! | which problems? | [`cases`], [`rotor`], [`drawn`] |
//! | how is a branch followed, and from where? | [`routes`] |
//! | are these the same special points? | [`same`] |
//! | how large are the errors really? | [`errors`] |
//! | is every change of stability explained? | [`explained`] |
//! | do units matter? | [`rescaled`] |
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
pub mod watch;

use cases::Case;
use report::Report;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// The one tolerance.
pub const TOLERANCE: f64 = 1e-6;
/// Degree of the collocation polynomials.
pub const DEGREE: usize = 4;

/// Default time limit of a case. A factor of safety: 200 rotors together take some 4 minutes of processor time.
pub const LIMIT: Duration = Duration::from_secs(300);

/// Examines every case, over that many threads and each within `limit`; `tell` is called with the report of each as it comes.
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
