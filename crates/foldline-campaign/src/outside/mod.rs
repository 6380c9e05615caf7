//! External problems with independently known results, run by `cargo xtask outside`.
//!
//! **Idea.** Every folder of `outside` holds a problem from elsewhere (a question in the repository of another program,
//! a demo, a paper, the first attempt of a new user) and its expected results, from closed forms, publications or
//! independent computations. Each study is run by the command in a separate process with a time limit, and the stored
//! results are compared.
//!
//! | question | file |
//! |---|---|
//! | what is expected? | [`expectations`] |
//! | how is a study run? | [`running`], [`command`] |
//! | what is the value of a quantity at a point? | [`quantities`] |
//! | do the results agree? | [`checking`] |
//! | what is checked for every run? | [`always`] |
//! | what is reported? | [`reporting`] |

pub mod always;
pub mod checking;
pub mod command;
pub mod expectations;
pub mod quantities;
pub mod reporting;
pub mod running;

use expectations::{Problem, Run};
use reporting::{Line, Verdict};
use running::Program;
use std::path::{Path, PathBuf};

/// Folder with the problems.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("outside")
}

/// Runs one study of a problem and evaluates its checks.
pub fn judged(problem: &Problem, run: &Run, program: &Program) -> Vec<Line> {
    let outcome = program.run(problem, run);
    let line =
        |check: String, verdict: Verdict| Line { problem: problem.name.clone(), run: run.name(), check, verdict };
    let mut lines: Vec<Line> =
        always::verdicts(run, &outcome).into_iter().map(|(check, verdict)| line(check.to_string(), verdict)).collect();
    lines
        .extend(run.right.iter().map(|right| line(right.check.to_string(), checking::verdict(&right.check, &outcome))));
    lines
}
