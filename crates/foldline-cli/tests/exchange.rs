//! Import and export: exports as a user requests them, and branches that start from files of AUTO-07p.

use std::path::Path;
use std::process::{Command, Output};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/ab-reaction.toml");

fn foldline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn auto(name: &str) -> String {
    format!("{ROOT}/crates/foldline-store/tests/auto/{name}")
}

/// Branch, kind, p1, period and error of every special point.
fn special(folder: &Path, run: &str) -> Vec<(String, f64, f64, f64)> {
    let output = foldline(folder, &["table", run, "--special", "--format", "csv"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = lines.next().unwrap();
    let at = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let number = |cell: &str| cell.parse::<f64>().unwrap_or(f64::NAN);
    let row = |line: Vec<&str>| {
        (line[at("kind")].to_string(), number(line[at("p1")]), number(line[at("period")]), number(line[at("error")]))
    };
    let mut rows: Vec<_> = lines.map(row).collect();
    rows.sort_by(|a, b| (&a.0, a.1.to_bits()).cmp(&(&b.0, b.1.to_bits())));
    rows
}

fn same(a: &[(String, f64, f64, f64)], b: &[(String, f64, f64, f64)]) {
    assert_eq!(a.len(), b.len(), "{a:?} {b:?}");
    for (a, b) in a.iter().zip(b) {
        let error = a.3 + b.3;
        assert_eq!(a.0, b.0);
        assert!((a.1 - b.1).abs() <= error * (1.0 + a.1.abs()), "{a:?} {b:?}");
        assert!(a.2.is_nan() && b.2.is_nan() || (a.2 - b.2).abs() <= error * (1.0 + a.2.abs()), "{a:?} {b:?}");
    }
}

#[test]
fn branches_started_from_auto_match_those_found_without_it() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let own = format!(
        "model = {MODEL:?}\nseed = [{{ name = \"rest\", attractor = \"equilibrium\", parameters = {{ p1 = 0.05 }} }}]\n\
         [[branch]]\nname = \"equilibria\"\nfrom = \"rest\"\nfree = \"p1\"\nrange = [0, 0.4]\nswitch = {{ hopf = 1 }}\nmark = {{ period = [3, 10] }}\n"
    );
    std::fs::write(here.join("own.toml"), own).unwrap();
    foldline(here, &["run", "own.toml", "--out", "own"]);
    let own = special(here, "own");
    let (cycles, equilibria): (Vec<_>, Vec<_>) = own.into_iter().partition(|row| row.0 == "mark");
    assert_eq!((equilibria.len(), cycles.len()), (3, 2));

    for (file, label, output, expected) in [("s.ab", "4", "eq", &equilibria), ("s.ab-cycles", "7", "cy", &cycles)] {
        let study = format!("{output}.toml");
        let made = foldline(here, &["import-auto", &auto(file), "--label", label, "--model", MODEL, "-o", &study]);
        assert_eq!(made.status.code(), Some(0), "{}", said(&made));
        let text = std::fs::read_to_string(here.join(&study)).unwrap() + "mark = { period = [3, 10] }\n";
        std::fs::write(here.join(&study), text).unwrap();
        let run = foldline(here, &["run", &study, "--out", output]);
        assert!(run.status.code().is_some_and(|code| [0, 3].contains(&code)), "{}", said(&run));
        same(&special(here, output), expected);
    }
}

#[test]
fn an_equations_file_of_auto_gives_the_special_points_of_the_own_model() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let own = format!(
        "model = {MODEL:?}\nseed = [{{ name = \"rest\", state = {{ u1 = 0, u2 = 0 }}, parameters = {{ p1 = 0 }} }}]\n\
         [[branch]]\nname = \"branch\"\nfrom = \"rest\"\nfree = \"p1\"\nrange = [0, 0.4]\n"
    );
    std::fs::write(here.join("own.toml"), own).unwrap();
    foldline(here, &["run", "own.toml", "--out", "own"]);
    // The constants are found beside the equations.
    let made = foldline(here, &["import-auto", &auto("ab.f90"), "-o", "ab.toml"]);
    assert_eq!(made.status.code(), Some(0), "{}", said(&made));
    assert!(said(&made).contains("wrote ab-model.toml and ab.toml"), "{}", said(&made));
    let run = foldline(here, &["run", "ab.toml", "--out", "run"]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let expected = special(here, "own");
    assert_eq!(expected.len(), 3);
    same(&special(here, "run"), &expected);
    // Nothing is overwritten unless it is named.
    let again = foldline(here, &["import-auto", &auto("ab.f90")]);
    assert!(again.status.code() == Some(2) && said(&again).contains("already exists"), "{}", said(&again));
    let alone = foldline(here, &["import-auto", &auto("ab.f90"), &auto("c.none")]);
    assert!(alone.status.code() == Some(2) && said(&alone).contains("cannot read"), "{}", said(&alone));
}

#[test]
fn solutions_in_auto_files_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let listed = foldline(folder.path(), &["import-auto", &auto("s.ab"), &auto("s.ab-cycles")]);
    let text = String::from_utf8_lossy(&listed.stdout).into_owned();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(
        rows[0],
        ["file", "branch", "label", "type", "kind", "solution", "p1", "period", "states", "NTST", "NCOL"]
    );
    assert_eq!(rows[5][1..], ["1", "5", "HB", "hopf", "equilibrium", "0.130900045", "·", "2", "·", "·"], "{text}");
    assert_eq!(rows[7][1..], ["5", "7", "UZ", "mark", "cycle", "0.119340466", "2.999998142", "2", "20", "4"], "{text}");
    let cases: [(&[&str], &str); 5] = [
        (&["import-auto", "s.none"], "the solution file cannot be read"),
        (&["import-auto", &auto("b.ab")], "no solution file was given"),
        (&["import-auto", &auto("s.ab"), "--label", "9"], "one of 1, 2, 3, 4, 5, 6"),
        (
            &["import-auto", &auto("s.ab"), "--model", MODEL, "--parameters", "p1"],
            "--parameters p1: not a pair NUMBER=NAME",
        ),
        (&["import-auto", &auto("s.ab"), "--model", MODEL, "--states", "1=x"], "--states: the model has no \"x\""),
    ];
    for (arguments, message) in cases {
        let output = foldline(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2));
        assert!(said(&output).contains(message), "{message}: {}", said(&output));
    }
}

#[test]
fn exports_are_written_to_the_requested_place() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let study = format!(
        "model = {MODEL:?}\nseed = [{{ name = \"rest\", attractor = \"equilibrium\", parameters = {{ p1 = 0.05 }} }}]\n\
         [[branch]]\nname = \"a\"\nfrom = \"rest\"\nfree = \"p1\"\nrange = [0.04, 0.06]\n\
         [[branch]]\nname = \"b\"\nfrom = \"a\"\nfree = \"p1\"\nrange = [0.06, 0.07]\n"
    );
    std::fs::write(here.join("study.toml"), study).unwrap();
    foldline(here, &["run", "study.toml", "--out", "run"]);
    for (format, written) in
        [("csv", "run/csv/points.csv"), ("parquet", "run/parquet/points.parquet"), ("netcdf", "run/run.nc")]
    {
        let output = foldline(here, &["export", "run", "--format", format]);
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        assert!(said(&output).contains(&format!("wrote {written}")) && here.join(written).is_file());
    }
    let only = foldline(here, &["export", "run", "--format", "csv", "--branch", "b", "--out", "only"]);
    assert_eq!(only.status.code(), Some(0), "{}", said(&only));
    let text = std::fs::read_to_string(here.join("only/points.csv")).unwrap();
    assert!(text.lines().count() > 2 && text.lines().skip(1).all(|line| line.starts_with("b,")), "{text}");
    let cases: [(&[&str], &str); 4] = [
        (&["export", "none", "--format", "csv"], "there is no run file"),
        (&["export", "run", "--format", "csv", "--branch", "c"], "the run has no branch \"c\""),
        (&["export", "run", "--format", "netcdf", "--out", "run"], "this is a folder"),
        (&["export", "run", "--format", "csv", "--out", "study.toml"], "this is a file"),
    ];
    for (arguments, message) in cases {
        let output = foldline(here, arguments);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains(message), "{message}: {}", said(&output));
    }
}
