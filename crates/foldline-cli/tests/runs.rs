//! Whole runs of the command, for models whose bifurcations are known in closed form, and the examples of the book.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn foldline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap()
}

/// Returns the standard output of a command that must end with that code.
#[track_caller]
fn printed(folder: &Path, arguments: &[&str], code: i32) -> String {
    let output = foldline(folder, arguments);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The code blocks of one language in a document.
fn blocks(document: &str, kind: &str) -> Vec<String> {
    let text = std::fs::read_to_string(root().join(document)).unwrap();
    let fence = format!("```{kind}\n");
    text.split(&fence).skip(1).filter_map(|rest| Some(rest.split_once("```")?.0.to_string())).collect()
}

const MODEL: &str = r#"name = "Brusselator"
parameters = { A = 1.0, B = 1.5 }

[states]
x = { equation = "A - (B + 1)*x + x^2*y", range = [0, 5] }
y = { equation = "B*x - x^2*y", range = [0, 5] }
"#;

const STUDY: &str = r#"model = "brusselator.toml"
seed = [{ name = "rest", attractor = "equilibrium" }]
branch = [{ name = "steady", from = "rest", free = "B", range = [0.5, 4], switch = { hopf = 1 } }]
"#;

/// Returns a folder with the Brusselator and a study of it.
fn desk() -> tempfile::TempDir {
    written(MODEL, STUDY)
}

fn written(model: &str, study: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("brusselator.toml"), model).unwrap();
    std::fs::write(folder.path().join("study.toml"), study).unwrap();
    folder
}

/// Returns a folder with the model and the study of a document.
fn desk_of(document: &str) -> tempfile::TempDir {
    let found = blocks(document, "toml");
    let model = found.iter().find(|block| block.contains("name = \"Brusselator\"")).expect("a model");
    let study = found.iter().find(|block| block.contains("model = \"brusselator.toml\"")).expect("a study");
    written(model, study)
}

/// The rows of a CSV table as (column, cell) lookups.
fn rows(csv: &str) -> Vec<impl Fn(&str) -> String + use<>> {
    let mut lines = csv.lines().map(|line| line.split(',').map(str::to_string).collect::<Vec<_>>());
    let heads = lines.next().unwrap();
    lines
        .map(|cells| {
            let heads = heads.clone();
            move |name: &str| {
                cells[heads.iter().position(|h| h == name).unwrap_or_else(|| panic!("no column {name}"))].clone()
            }
        })
        .collect()
}

#[test]
fn the_first_model_has_its_hopf_point_in_one_notation_and_in_the_other() {
    for (written, desk) in [("inline", desk()), ("as in the book", desk_of("docs/book/first-model.md"))] {
        printed(desk.path(), &["check", "brusselator.toml"], 0);
        let text = printed(desk.path(), &["run", "study.toml", "--jobs", "1"], 0);
        assert!(text.contains("hopf"), "{text}");
        let csv = printed(desk.path(), &["table", "runs/study", "--format", "csv"], 0);
        let heads = "branch,kind,A,B,period,unstable_before,unstable_after,error,normal_form,coefficient_1,coefficient_1_error,";
        assert!(csv.starts_with(heads), "{written}: {csv}");
        let hopf = rows(&csv).into_iter().find(|row| row("kind") == "hopf").unwrap();
        // B = 1 + A² = 2; tolerance 1e-6 relative to 1 + |B|.
        assert!((hopf("B").parse::<f64>().unwrap() - 2.0).abs() < 3e-6, "{}", hopf("B"));
        assert!(hopf("error").parse::<f64>().unwrap() <= 1e-6);
        let branches = printed(desk.path(), &["table", "runs/study", "--branches", "--format", "json"], 0);
        let branches: serde_json::Value = serde_json::from_str(&branches).unwrap();
        let families: Vec<&str> = branches.as_array().unwrap().iter().filter_map(|b| b["family"].as_str()).collect();
        assert_eq!(families, ["equilibrium", "cycle"], "{written}");
        for ending in ["svg", "png", "pdf"] {
            let file = format!("picture.{ending}");
            printed(desk.path(), &["plot", "runs/study", "-o", &file], 0);
            assert!(std::fs::metadata(desk.path().join(file)).unwrap().len() > 1000);
        }
    }
}

#[test]
fn points_are_listed_with_multipliers_and_accuracy() {
    let desk = desk();
    printed(desk.path(), &["run", "study.toml"], 0);
    let arguments = ["table", "runs/study", "--points", "--branch", "steady", "--format", "json"];
    let points: serde_json::Value = serde_json::from_str(&printed(desk.path(), &arguments, 0)).unwrap();
    let points = points.as_array().unwrap();
    assert!(points.len() > 5);
    for point in points {
        let b = point["B"].as_f64().unwrap();
        // The Jacobian at the equilibrium (1, B) has the trace B - 2.
        let eigenvalues = point["multipliers"].as_array().unwrap();
        let trace: f64 = eigenvalues.iter().map(|pair| pair[0].as_f64().unwrap()).sum();
        assert!((trace - (b - 2.0)).abs() < 1e-6 * (1.0 + b), "{trace} at B = {b}");
        assert_eq!(point["unstable"] == 0, b < 2.0, "at B = {b}");
        assert_eq!(point["trivial_defect"], 0.0);
    }
    let csv = printed(desk.path(), &["table", "runs/study", "--points", "--format", "csv"], 0);
    let cycles: Vec<_> = rows(&csv).into_iter().filter(|row| row("branch") != "steady").collect();
    assert!(cycles.len() > 5);
    for row in cycles {
        // The first multiplier is the trivial one; its defect is the error of the computation.
        let first = row("multipliers").split(' ').next().unwrap().trim_end_matches("+0.0j").parse::<f64>().unwrap();
        assert!((first - 1.0).abs() < 1e-4, "{first}");
        assert!(row("discretisation").parse::<f64>().unwrap() < 1e-5);
        assert!(row("liouville_defect").parse::<f64>().unwrap() < 1e-4);
    }
}

#[test]
fn a_branch_that_ends_short_is_reported_with_exit_code_3() {
    let desk = desk();
    let study = std::fs::read_to_string(desk.path().join("study.toml")).unwrap();
    std::fs::write(desk.path().join("short.toml"), study.replace("range", "max-points = 2, range")).unwrap();
    let output = foldline(desk.path(), &["run", "short.toml"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("incomplete: steady: stopped at the limit of 2 points"), "{said}");
}

#[test]
fn a_branch_that_turns_before_its_target_is_short_and_nothing_starts_at_its_end() {
    let folder = tempfile::tempdir().unwrap();
    // x = ±sqrt(mu): towards mu = -1 the branch passes the fold at 0 and returns to mu = 2.
    let model = "name = \"fold\"\n[parameters]\nmu = 1\nh = 0\n[states.x]\nequation = \"mu - x^2 + h\"\n";
    let study = "model = \"model.toml\"\n[[seed]]\nname = \"start\"\nstate = { x = 1 }\n\
                 [[branch]]\nname = \"down\"\nfrom = \"start\"\nfree = \"mu\"\nrange = [-1, 2]\nuntil = -1\n\
                 [[branch]]\nname = \"on\"\nfrom = \"down\"\nfree = \"h\"\nrange = [0, 1]\n";
    std::fs::write(folder.path().join("model.toml"), model).unwrap();
    std::fs::write(folder.path().join("study.toml"), study).unwrap();
    let output = foldline(folder.path(), &["run", "study.toml"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("incomplete: down: it did not reach mu = -1; reached 2"), "{said}");
    assert!(said.contains("incomplete: on: no starting solution: the branch down did not reach its end"), "{said}");
}

#[test]
fn a_seed_that_is_not_found_is_reported_with_exit_code_3() {
    let desk = desk();
    let study = std::fs::read_to_string(desk.path().join("study.toml")).unwrap();
    // At B = 1.5 the equilibrium attracts every state.
    std::fs::write(desk.path().join("none.toml"), study.replace("\"equilibrium\"", "\"cycle\"")).unwrap();
    let output = foldline(desk.path(), &["run", "none.toml"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("incomplete: steady"), "{said}");
}

#[test]
fn the_same_study_gives_the_same_table_for_any_number_of_threads() {
    let desk = desk();
    for jobs in ["1", "3"] {
        printed(desk.path(), &["run", "study.toml", "--jobs", jobs, "--out", jobs], 0);
    }
    let table = |out: &str| printed(desk.path(), &["table", out, "--points", "--format", "csv"], 0);
    assert_eq!(table("1"), table("3"));
}

/// Leaves of a finished run what a kill after `kept` accepted points leaves of it.
pub fn cut_off(file: &Path, kept: i64) {
    // Rows are stored in the order of acceptance. A special point lies between its position and the next; of these two points,
    // the one further from the start was accepted after it.
    let run = rusqlite::Connection::open(file).unwrap();
    let held = "SELECT count(*) FROM sqlite_master WHERE name = 'held_quantities'";
    let of_branches = match run.query_row(held, [], |row| row.get::<_, i64>(0)).unwrap() {
        0 => "",
        _ => "DELETE FROM held_quantities WHERE branch NOT IN (SELECT branch FROM points);",
    };
    run.execute_batch(&format!(
        "CREATE TEMP TABLE lost AS SELECT rowid AS r, branch, position FROM points ORDER BY rowid LIMIT -1 OFFSET {kept};
         DELETE FROM special_points WHERE EXISTS (SELECT 1 FROM lost WHERE lost.branch = special_points.branch
             AND lost.position = special_points.position + (special_points.position >= 0));
         DELETE FROM points WHERE rowid IN (SELECT r FROM lost);
         DELETE FROM ends WHERE branch IN (SELECT branch FROM lost);
         {of_branches}
         DELETE FROM branches WHERE branch NOT IN (SELECT branch FROM points);"
    ))
    .unwrap();
}

#[test]
fn a_run_cut_off_between_transactions_resumes_without_losing_a_point() {
    let desk = desk();
    printed(desk.path(), &["run", "study.toml", "--jobs", "1", "--out", "whole"], 0);
    let table = |out: &str, what: &str| printed(desk.path(), &["table", out, what, "--format", "csv"], 0);
    let special = |out: &str| -> Vec<(String, String, f64)> {
        let rows = rows(&table(out, "--special"));
        rows.iter().map(|row| (row("branch"), row("kind"), row("B").parse().unwrap())).collect()
    };
    let whole = rusqlite::Connection::open(desk.path().join("whole/run.sqlite")).unwrap();
    let count: i64 = whole.query_row("SELECT count(*) FROM points", [], |row| row.get(0)).unwrap();
    for kept in [0, 1, 2, count / 4, count / 2, count - 3] {
        let out = format!("cut{kept}");
        std::fs::create_dir(desk.path().join(&out)).unwrap();
        let file = desk.path().join(&out).join("run.sqlite");
        std::fs::copy(desk.path().join("whole/run.sqlite"), &file).unwrap();
        cut_off(&file, kept);
        let before = table(&out, "--points");
        printed(desk.path(), &["run", "study.toml", "--jobs", "1", "--out", &out, "--resume"], 0);
        let after = table(&out, "--points");
        let lost: Vec<&str> = before.lines().filter(|line| !after.lines().any(|other| other == *line)).collect();
        assert!(lost.is_empty(), "accepted points lost after {kept} of {count}: {lost:?}");
        // The first step after resuming may differ from the original one, so results agree to the tolerance, 1e-6
        // relative.
        let (found, expected) = (special(&out), special("whole"));
        assert_eq!(found.len(), expected.len(), "{found:?} after {kept} of {count}");
        for (a, b) in found.iter().zip(&expected) {
            assert!((&a.0, &a.1) == (&b.0, &b.1) && (a.2 - b.2).abs() < 1e-6 * (1.0 + b.2), "{a:?} {b:?} after {kept}");
        }
    }
}

#[test]
fn a_closed_branch_killed_between_its_two_ends_is_not_followed_again() {
    let desk = tempfile::tempdir().unwrap();
    // Equilibria on the unit circle.
    let model = "name = \"m\"\n[parameters]\nmu = 0\n[states]\nx = \"1 - mu^2 - x^2\"\n";
    let study = "model = \"m.toml\"\n[[seed]]\nname = \"s\"\nstate = { x = 1 }\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"mu\"\nrange = [-2, 2]\n";
    std::fs::write(desk.path().join("m.toml"), model).unwrap();
    std::fs::write(desk.path().join("study.toml"), study).unwrap();
    printed(desk.path(), &["run", "study.toml"], 0);
    let table = |what: &str| printed(desk.path(), &["table", "runs/study", what, "--format", "csv"], 0);
    let tables = || ["--points", "--special", "--branches"].map(table);
    let whole = tables();
    assert_eq!(rows(&whole[1]).len(), 2, "{}", whole[1]);
    let file = rusqlite::Connection::open(desk.path().join("runs/study/run.sqlite")).unwrap();
    assert_eq!(file.execute("DELETE FROM ends WHERE side = 0 AND code = 'closed'", []).unwrap(), 1);
    drop(file);
    printed(desk.path(), &["run", "study.toml", "--resume"], 0);
    assert_eq!(tables(), whole);
}

#[test]
fn a_finished_run_resumes_without_doing_anything() {
    let desk = desk();
    let first = printed(desk.path(), &["run", "study.toml"], 0);
    assert_eq!(printed(desk.path(), &["run", "study.toml", "--resume"], 0), first);
}

#[test]
fn a_finished_homotopy_and_curve_resume_without_doing_anything() {
    let desk = desk();
    let study = "model = \"brusselator.toml\"\n[[seed]]\nname = \"rest\"\nattractor = \"equilibrium\"\n\
                 [[branch]]\nname = \"steady\"\nfrom = \"rest\"\nfree = \"B\"\nrange = [0.5, 4]\n\
                 [[curve]]\nname = \"onset\"\nhold = \"hopf\"\nof = \"steady\"\nfree = \"A\"\nuntil = 1.25\n\
                 [[homotopy]]\nname = \"way\"\nfrom = \"rest\"\nto = { A = 2 }\nvia = \"B\"\nrange = [1, 6]\n\
                 [[branch]]\nname = \"at two\"\nfrom = \"way\"\nfree = \"B\"\nrange = [1, 6]\n";
    std::fs::write(desk.path().join("study.toml"), study).unwrap();
    let first = printed(desk.path(), &["run", "study.toml"], 0);
    let table = |what: &str| printed(desk.path(), &["table", "runs/study", what, "--format", "csv"], 0);
    let before = ["--points", "--branches", "--notes"].map(table);
    assert!(before[2].contains("way,reached the goal"), "{}", before[2]);
    // B = 1 + A² on the curve and on the branch at the goal; tolerance 1e-6 relative to 1 + B.
    for point in rows(&table("--points")).iter().filter(|row| row("branch") == "onset") {
        let [a, b] = ["A", "B"].map(|name| point(name).parse::<f64>().unwrap());
        assert!((b - 1.0 - a * a).abs() < 1e-6 * (1.0 + b), "{a} {b}");
    }
    let hopf = rows(&table("--special")).into_iter().find(|row| row("branch") == "at two").unwrap();
    assert!((hopf("B").parse::<f64>().unwrap() - 5.0).abs() < 6e-6, "{}", hopf("B"));
    assert_eq!(printed(desk.path(), &["run", "study.toml", "--resume"], 0), first);
    assert_eq!(["--points", "--branches", "--notes"].map(table), before);
}

#[test]
fn attractors_are_listed_with_their_hits() {
    let desk = desk();
    let rest = printed(desk.path(), &["attractors", "brusselator.toml", "--samples", "16"], 0);
    assert!(rest.contains("equilibrium") && rest.contains("16 samples"), "{rest}");
    let cycle = printed(desk.path(), &["attractors", "brusselator.toml", "--samples", "16", "--set", "B=3"], 0);
    // The period at A = 1, B = 3 is 7.1569199 by the classical Runge–Kutta method with step 5e-4.
    assert!(cycle.lines().any(|line| line.starts_with("cycle") && line.contains(" 7.156919")), "{cycle}");
    // All twelve uniform starts: Wilson's interval begins at 12 / (12 + 1.96²).
    assert!(cycle.contains("1.000 [0.758, 1.000]"), "{cycle}");
    assert!(cycle.contains("share: fraction of the 12 samples drawn uniformly"), "{cycle}");
    let again = printed(desk.path(), &["attractors", "brusselator.toml", "--samples", "16", "--set", "B=3"], 0);
    assert_eq!(cycle, again);
}

#[test]
fn a_reader_that_closes_early_is_no_error() {
    let desk = desk();
    printed(desk.path(), &["run", "study.toml"], 0);
    let mut child = Command::new(env!("CARGO_BIN_EXE_foldline"))
        .args(["table", "runs/study", "--points", "--format", "json"])
        .current_dir(desk.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"));
    assert_eq!(output.status.code(), Some(0));
}

#[test]
fn unknown_names_in_a_run_are_refused() {
    let desk = desk();
    printed(desk.path(), &["run", "study.toml"], 0);
    let refused = |arguments: &[&str], pieces: &[&str]| {
        let output = foldline(desk.path(), arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        pieces.iter().for_each(|piece| assert!(said.contains(piece), "\"{piece}\" is missing in:\n{said}"));
    };
    refused(&["table", "runs/study", "--branch", "stedy"], &["no branch \"stedy\"", "did you mean `steady`"]);
    refused(&["plot", "runs/study", "--y", "z", "-o", "a.svg"], &["--y: there is no quantity \"z\"", "_max", "period"]);
    refused(&["plot", "runs/study", "-o", "a.jpg"], &["a.jpg", ".svg, .png or .pdf"]);
    refused(&["plot", "runs/study", "-o", "no/such/a.svg"], &["cannot write no/such/a.svg"]);
    refused(&["plot", "runs/study", "--window", "2,1,0,1", "-o", "a.svg"], &["--window 2,1,0,1", "wrong way round"]);
    refused(&["plot", "runs/study", "--window", "1,2", "-o", "a.svg"], &["not four numbers", "four numbers"]);
    refused(&["run", "study.toml"], &["already exists", "--resume"]);
    let study = std::fs::read_to_string(desk.path().join("study.toml")).unwrap();
    std::fs::write(desk.path().join("study.toml"), study.replace("4]", "5]")).unwrap();
    refused(&["run", "study.toml", "--resume"], &["the study has changed", "--out DIR"]);
}

#[test]
fn tables_are_byte_identical_for_any_number_of_threads_and_every_time() {
    let folder = tempfile::tempdir().unwrap();
    let study = root().join("studies/overhung-rotor/bouncing.toml");
    let tables = |name: &str, jobs: &str| {
        printed(folder.path(), &["run", &study.to_string_lossy(), "--jobs", jobs, "--out", name], 0);
        ["--special", "--points", "--branches", "--notes"]
            .map(|what| printed(folder.path(), &["table", name, what, "--format", "csv"], 0))
    };
    let first = tables("one", "1");
    assert!(first[1].lines().count() > 400);
    for (name, jobs) in [("again", "1"), ("two", "2"), ("five", "5")] {
        for (a, b) in first.iter().zip(tables(name, jobs)) {
            assert_eq!(*a, b, "{jobs} threads");
        }
    }
}
