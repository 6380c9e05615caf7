//! Checks that apply to every run.

use super::expectations::Run;
use super::reporting::Verdict;
use super::running::{End, Outcome, Stored};
use crate::explained::{misfits, unexplained};
use foldline::diagram::{Branch, Diagram, Kind};
use foldline_store::order::leg;

/// Exit code of a panic.
const PANIC: i32 = 101;

/// Returns name and verdict of each check. All studies have the same checks, so that their numbers can be compared.
pub fn verdicts(run: &Run, outcome: &Outcome) -> Vec<(&'static str, Verdict)> {
    let code = match outcome.end {
        End::Code(code) if code != PANIC => Ok(code),
        End::OutOfTime => Err("did not end"),
        _ => Err("it crashed"),
    };
    let by_itself = |judged: &dyn Fn(i32) -> Verdict| code.map_or_else(|why| Verdict::Wrong(why.to_string()), judged);
    let mut list = vec![
        ("does not crash", Verdict::of(code != Err("it crashed"), || "it crashed".to_string())),
        ("ends in time", Verdict::of(code != Err("did not end"), || "did not end".to_string())),
        ("exit code", by_itself(&|code| Verdict::of(run.exit.contains(&code), || format!("{code}")))),
    ];
    if run.is_a_study() {
        // A rejected study has no changes of stability.
        let nothing = || by_itself(&|_| Verdict::Right);
        list.push(("stability is explained", outcome.stored.as_ref().map_or_else(nothing, |s| explained(&s.diagram))));
        let silent = |code| outcome.stored.as_ref().map_or(Verdict::Right, |stored| told(code, stored));
        list.push(("exit code tells what is short", by_itself(&silent)));
    }
    list
}

/// Checks that every change of stability along one-parameter branches is explained.
fn explained(diagram: &Diagram) -> Verdict {
    let branches = diagram.branches.iter().filter(|branch| branch.held.is_none());
    let lines: Vec<String> = branches
        .flat_map(|branch| {
            let lines = unexplained(branch).into_iter().chain(misfits(branch));
            lines.map(|line| format!("{}: {line}", branch.name)).collect::<Vec<_>>()
        })
        .collect();
    Verdict::of(lines.is_empty(), || format!("{} changes; {}", lines.len(), lines[0]))
}

/// Checks that the exit code is 0 only if every requested branch and curve exists, is complete, and has no unexplained
/// change of stability.
fn told(code: i32, stored: &Stored) -> Verdict {
    let on_the_way = |branch: &&Branch| !stored.homotopies.iter().any(|name| leg(&branch.name, name).is_some());
    let short = stored.diagram.branches.iter().filter(on_the_way).find(|branch| {
        branch.ends.iter().any(|end| !end.as_ref().is_some_and(|end| end.complete()))
            || branch.special.iter().any(|special| special.kind == Kind::Unexplained)
    });
    let missing = stored.asked.iter().find(|name| stored.diagram.branch(name).is_none());
    let name = short.map(|branch| &branch.name).or(missing);
    let silent = code == 0 && name.is_some();
    Verdict::of(!silent, || format!("0, though {} is short", name.map_or("", String::as_str)))
}
