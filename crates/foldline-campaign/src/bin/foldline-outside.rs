//! `foldline-outside --binary PATH [OPTIONS]`, the program behind `cargo xtask outside`.

use foldline_campaign::outside::command::Command;
use foldline_campaign::outside::expectations::{Problem, Run};
use foldline_campaign::outside::reporting::{Line, Verdict, counts, placed, renewed, table, text};
use foldline_campaign::outside::running::Program;
use foldline_campaign::outside::{folder, judged};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const USAGE: &str = "foldline-outside --binary PATH [--quick] [--only TEXT] [--write | --before]
  --binary  the command `foldline` that runs the studies
  --quick   only the studies that are right today and take about a second each
  --only    only problems whose name contains TEXT
  --folder  problems of another folder than outside; nothing is written then
  --write   write outside/results.txt, and the table in docs/book/trust.md; with --only, what concerns those problems
  --before  write outside/before.txt, with which the table compares";

fn main() -> ExitCode {
    match answer() {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}

#[derive(Default)]
struct Asked {
    binary: PathBuf,
    quick: bool,
    only: String,
    folder: Option<PathBuf>,
    write: bool,
    before: bool,
}

fn asked() -> Result<Asked, String> {
    let mut asked = Asked::default();
    let mut rest = std::env::args().skip(1);
    while let Some(argument) = rest.next() {
        let mut next = || rest.next().ok_or(format!("{argument} needs a value\n{USAGE}"));
        match argument.as_str() {
            "--binary" => asked.binary = next()?.into(),
            "--only" => asked.only = next()?,
            "--folder" => asked.folder = Some(next()?.into()),
            "--quick" => asked.quick = true,
            "--write" => asked.write = true,
            "--before" => asked.before = true,
            other => return Err(format!("{other}: no such option\n{USAGE}")),
        }
    }
    if asked.binary.as_os_str().is_empty() { Err(USAGE.to_string()) } else { Ok(asked) }
}

fn answer() -> Result<(), String> {
    let asked = asked()?;
    let all = Problem::all(asked.folder.as_deref().unwrap_or(&folder()))?;
    let mut problems = all.clone();
    problems.retain(|problem| problem.name.contains(&asked.only));
    let out = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/outside");
    let program = Program::Command(Command { binary: asked.binary, out });
    let chosen = |run: &&Run| !asked.quick || run.quick;
    let mut lines: Vec<Line> = Vec::new();
    for problem in &problems {
        for run in problem.runs.iter().filter(chosen) {
            let start = std::time::Instant::now();
            let own = judged(problem, run, &program);
            let wrong: Vec<&Line> = own.iter().filter(|line| line.verdict != Verdict::Right).collect();
            let [right, all] = [own.len() - wrong.len(), own.len()];
            eprintln!(
                "{right:3} of {all:3} right  {:6.1} s  {}/{}",
                start.elapsed().as_secs_f64(),
                problem.name,
                run.name()
            );
            wrong.iter().for_each(|line| eprint!("           {}", text(std::slice::from_ref(*line))));
            lines.extend(own);
        }
    }
    let now = text(&lines);
    let before_file = folder().join("before.txt");
    let before = std::fs::read_to_string(&before_file).unwrap_or_default();
    let shown = table(&problems, &before, &now);
    println!("{shown}");
    let whole = !asked.quick && asked.folder.is_none();
    let known = std::fs::read_to_string(folder().join("results.txt")).unwrap_or_default();
    match (asked.write, asked.before) {
        (false, false) => {}
        _ if !whole => {
            return Err("--write and --before need all studies: without --quick and --folder".to_string());
        }
        (_, true) => saved(&before_file, &renewed(&all, &before, &now))?,
        (true, false) => {
            let results = renewed(&all, &known, &now);
            let shown = table(&all, &before, &results);
            saved(&folder().join("results.txt"), &results)?;
            let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/book/trust.md");
            let old = std::fs::read_to_string(&page).map_err(|error| format!("{}: {error}", page.display()))?;
            saved(&page, &placed(&old, &shown).ok_or("docs/book/trust.md has no markers for the table")?)?;
        }
    }
    changed(&problems, &now)
}

/// Fails if a check that passes in the committed results no longer passes.
fn changed(problems: &[Problem], now: &str) -> Result<(), String> {
    let known = std::fs::read_to_string(folder().join("results.txt")).unwrap_or_default();
    let right = |line: &&str| line.starts_with("right");
    let lost: Vec<&str> = known
        .lines()
        .filter(right)
        .filter(|line| problems.iter().any(|p| counts(line, &p.name)[1] > 0))
        .filter(|line| {
            now.lines().any(|other| other.get(7..).is_some_and(|rest| rest.starts_with(&line[7..])) && !right(&other))
        })
        .collect();
    if lost.is_empty() { Ok(()) } else { Err(format!("no longer right:\n{}", lost.join("\n"))) }
}

fn saved(file: &Path, text: &str) -> Result<(), String> {
    std::fs::write(file, text).map_err(|error| format!("{}: {error}", file.display()))
}
