//! Unreached parts of a study are reported with exit code 3, both now and when a finished run is resumed or read.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

fn foldline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap()
}

fn said(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!text.contains("panicked"), "{text}");
    text
}

/// The lines that report what was not reached, with their continuation lines.
fn short(output: &Output) -> Vec<String> {
    let text = said(output);
    let first = text.lines().skip_while(|line| !line.starts_with("incomplete: "));
    first.take_while(|line| line.starts_with("incomplete: ") || line.starts_with("  ")).map(str::to_string).collect()
}

fn with_files(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    files.iter().for_each(|(name, text)| std::fs::write(folder.path().join(name), text).unwrap());
    folder
}

/// A Hopf point at mu = 0, next to which the right-hand side is not finite, so that no cycle can be found.
const SWALLOWED: &str = "name = \"swallowed\"\n[parameters]\nmu = -1\n[definitions]\n\
    gap = \"if(x^2 + y^2 < 1e-20, 0, log(-x^2 - y^2))\"\n[states]\n\
    x = { equation = \"mu*x - y + gap\", scale = 1 }\ny = { equation = \"x + mu*y\", scale = 1 }\n";
const SWITCHED: &str = "model = \"m.toml\"\n[[seed]]\nname = \"rest\"\nstate = { x = 0, y = 0 }\n\
    [[branch]]\nname = \"steady\"\nfrom = \"rest\"\nfree = \"mu\"\nrange = [-1, 1]\nswitch = { hopf = 1 }\n";
/// Chaotic at these parameters (Lorenz 1963).
const LORENZ: &str = include_str!("../../../models/lorenz.toml");

#[test]
fn a_requested_switch_that_failed_is_reported_again_by_resume_and_table() {
    let folder = with_files(&[("m.toml", SWALLOWED), ("s.toml", SWITCHED)]);
    let first = foldline(folder.path(), &["run", "s.toml", "--jobs", "1", "--out", "run"]);
    let lines = short(&first);
    assert_eq!(first.status.code(), Some(3), "{}", said(&first));
    assert!(
        lines[0].starts_with("incomplete: steady: hopf 0.000000 of steady: no bifurcating branch found"),
        "{lines:?}"
    );
    let again = foldline(folder.path(), &["run", "s.toml", "--jobs", "1", "--resume", "--out", "run"]);
    assert_eq!((again.status.code(), short(&again)), (Some(3), lines.clone()));
    let branches = foldline(folder.path(), &["table", "run", "--branches"]);
    assert_eq!(short(&branches), lines);
    let notes = foldline(folder.path(), &["table", "run", "--notes"]);
    assert!(String::from_utf8_lossy(&notes.stdout).contains("incomplete: hopf 0.000000 of steady"));
}

#[test]
fn samples_that_do_not_settle_are_reported_now_and_when_resumed() {
    let folder = with_files(&[("lorenz.toml", LORENZ)]);
    let typed = ["explore", "lorenz.toml", "--free", "rho=27.9:28.1", "--values", "1", "--samples", "4", "--jobs", "1"];
    let first = foldline(folder.path(), &[&typed[..], &["--doublings", "0", "--out", "run"]].concat());
    let lines = short(&first);
    assert_eq!(first.status.code(), Some(3), "{}", said(&first));
    assert!(
        lines.iter().any(|line| line.contains("at 1 of 1 parameter values, some of the 4 samples did not settle")),
        "{lines:?}"
    );
    let again = foldline(folder.path(), &[&typed[..], &["--doublings", "0", "--out", "run", "--resume"]].concat());
    assert_eq!((again.status.code(), short(&again)), (Some(3), lines));
}

#[test]
fn a_switch_to_a_known_branch_is_only_a_remark() {
    // The pitchfork at mu = 0: both of its branch points lead to known branches.
    let model = "name = \"m\"\n[parameters]\nmu = -1\n[states]\nx = \"mu*x - x^3\"\n";
    let study = "model = \"m.toml\"\n[[seed]]\nname = \"s\"\nstate = { x = 0 }\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"mu\"\nrange = [-1, 1]\nswitch = { branch-point = 2 }\n";
    let folder = with_files(&[("m.toml", model), ("s.toml", study)]);
    let output = foldline(folder.path(), &["run", "s.toml", "--out", "run"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
}

/// An exploration that would sample for hours.
fn endless(folder: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_foldline"));
    command.args([
        "explore",
        "lorenz.toml",
        "--free",
        "rho=27.9:28.1",
        "--samples",
        "1000000",
        "--jobs",
        "1",
        "--out",
        "run",
    ]);
    command.args(more).current_dir(folder).stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_a_run_during_sampling() {
    let folder = with_files(&[("lorenz.toml", LORENZ)]);
    let child = endless(folder.path(), &[]).spawn().unwrap();
    let file = folder.path().join("run/run.sqlite");
    let begun = Instant::now();
    while !file.exists() {
        assert!(begun.elapsed() < Duration::from_secs(60), "it did not begin");
        std::thread::sleep(Duration::from_millis(10));
    }
    std::thread::sleep(Duration::from_millis(500));
    let asked = Instant::now();
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let output = child.wait_with_output().unwrap();
    let text = said(&output);
    assert_eq!(output.status.code(), Some(3), "{text}");
    assert!(text.contains("stopped; continue with --resume"), "{text}");
    // A few milliseconds on a quiet machine; the sampling itself would take hours.
    assert!(asked.elapsed() < Duration::from_secs(30), "{:?}", asked.elapsed());
    assert!(!text.contains("outcome of the samples: "), "what was under way is not told: {text}");
}

#[test]
fn a_run_at_its_time_limit_reports_its_progress_and_how_to_continue() {
    let folder = with_files(&[("lorenz.toml", LORENZ)]);
    let output = endless(folder.path(), &["--budget", "11s"]).output().unwrap();
    let text = said(&output);
    assert_eq!(output.status.code(), Some(3), "{text}");
    assert!(text.contains("searching for starting solutions"), "{text}");
    assert!(text.contains("stopped at the time limit of 11s; continue with --resume --out run"), "{text}");
}

#[test]
fn time_limits_need_a_unit() {
    let folder = with_files(&[("lorenz.toml", LORENZ)]);
    for wrong in ["60", "-1s", "1 day", "0s", "s"] {
        let typed = ["explore", "lorenz.toml", "--free", "rho=1:2", "--print"];
        let limit = format!("--time-limit={wrong}");
        let output = foldline(folder.path(), &[&typed[..], &[limit.as_str()]].concat());
        assert_eq!(output.status.code(), Some(2), "{wrong}");
        assert!(said(&output).contains("such as 90s, 10min or 2h"), "{}", said(&output));
    }
}
