//! Report: one line per check, and a table with one row per problem.

use super::expectations::Problem;
use std::fmt::Write;

/// Verdict on a check.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The check passes.
    Right,
    /// The check fails; the text says what was found instead.
    Wrong(String),
}

impl Verdict {
    /// Returns `Right`, or `Wrong` with the text of `why`.
    pub fn of(right: bool, why: impl FnOnce() -> String) -> Verdict {
        if right { Verdict::Right } else { Verdict::Wrong(why()) }
    }
}

/// Check of a run with its verdict.
#[derive(Clone, Debug)]
pub struct Line {
    /// Name of the problem.
    pub problem: String,
    /// Name of the run.
    pub run: String,
    /// Text of the check.
    pub check: String,
    /// Verdict.
    pub verdict: Verdict,
}

/// Formats all lines; failed checks include what was found instead.
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

/// Returns the lines of a problem in the output of [`text`].
fn of<'t>(text: &'t str, problem: &str) -> impl Iterator<Item = &'t str> {
    let own = format!("{problem}/");
    text.lines().filter(move |line| line.get(7..).is_some_and(|rest| rest.starts_with(&own)))
}

/// Returns the lines of all problems, from `now` for problems that were run and from `known` for the others.
pub fn renewed(problems: &[Problem], known: &str, now: &str) -> String {
    let lines = problems.iter().flat_map(|problem| {
        let ran = of(now, &problem.name).next().is_some();
        of(if ran { now } else { known }, &problem.name)
    });
    lines.map(|line| format!("{line}\n")).collect()
}

/// Returns the number of passed checks and of all checks of a problem in the output of [`text`].
pub fn counts(text: &str, problem: &str) -> [usize; 2] {
    of(text, problem).fold([0, 0], |[right, all], line| [right + usize::from(line.starts_with("right")), all + 1])
}

/// Returns a Markdown table with one row per problem: checks passed before (in the output of an earlier version) and
/// now.
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

/// Replaces the text between the markers of a page; `None` if the page has no markers.
pub fn placed(page: &str, table: &str) -> Option<String> {
    const BEGIN: &str = "<!-- outside: begin -->";
    const END: &str = "<!-- outside: end -->";
    let begin = page.find(BEGIN)? + BEGIN.len();
    let end = page.find(END)?;
    Some(format!("{}\n\n{}\n{}", page.get(..begin)?, table.trim_end(), page.get(end..)?))
}
