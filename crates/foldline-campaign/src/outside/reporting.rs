//! What is reported: a line for each check, and a table with a row for each problem.

use super::expectations::Problem;
use std::fmt::Write;

/// Whether a check holds, and if not, what was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It holds.
    Right,
    /// It does not.
    Wrong(String),
}

impl Verdict {
    /// Right, or wrong with what `why` says.
    pub fn of(right: bool, why: impl FnOnce() -> String) -> Verdict {
        if right { Verdict::Right } else { Verdict::Wrong(why()) }
    }
}

/// A check of a run.
#[derive(Clone, Debug)]
pub struct Line {
    /// The problem.
    pub problem: String,
    /// The study.
    pub run: String,
    /// What must hold.
    pub check: String,
    /// If it does.
    pub verdict: Verdict,
}

/// Every line, wrong ones with what was found.
pub fn text(lines: &[Line]) -> String {
    let mut out = String::new();
    for Line { problem, run, check, verdict } in lines {
        let _ = match verdict {
            Verdict::Right => writeln!(out, "right  {problem}/{run}: {check}"),
            Verdict::Wrong(found) => writeln!(out, "WRONG  {problem}/{run}: {check}: {found}"),
        };
    }
    out
}

/// Right and all checks of a problem in a text that [`text`] wrote.
pub fn counts(text: &str, problem: &str) -> [usize; 2] {
    let own = text.lines().filter(|line| line.get(7..).is_some_and(|rest| rest.starts_with(&format!("{problem}/"))));
    own.fold([0, 0], |[right, all], line| [right + usize::from(line.starts_with("right")), all + 1])
}

/// Markdown table: one row a problem, right values before (a text of an earlier version) and now.
pub fn table(problems: &[Problem], before: &str, now: &str) -> String {
    let mut out =
        "| problem | source | checks | right before | right now |\n| --- | --- | ---: | ---: | ---: |\n".to_string();
    let mut total = [0, 0, 0];
    for problem in problems {
        let ([was, _], [is, all]) = (counts(before, &problem.name), counts(now, &problem.name));
        total = [total[0] + all, total[1] + was, total[2] + is];
        let _ = writeln!(out, "| {} | {} | {all} | {was} | {is} |", problem.question, problem.source);
    }
    let [all, was, is] = total;
    let _ = writeln!(out, "| all {} problems | | {all} | {was} | {is} |", problems.len());
    out
}

/// Replaces what stands between the markers in a page; `None` if they are not there.
pub fn placed(page: &str, table: &str) -> Option<String> {
    const BEGIN: &str = "<!-- outside: begin -->";
    const END: &str = "<!-- outside: end -->";
    let begin = page.find(BEGIN)? + BEGIN.len();
    let end = page.find(END)?;
    Some(format!("{}\n\n{}\n{}", page.get(..begin)?, table.trim_end(), page.get(end..)?))
}
