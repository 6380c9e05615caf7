//! Tables and pictures of a synthetic run with curves in two parameters and a homotopy.

use foldline::contract::{Event, Observer};
use foldline::diagram::{Branch, Cost, Ending, Family, Kind, Origin, Point, Solution, SpecialPoint, Trust};
use foldline_store::run_file::Recorder;
use foldline_store::study_file::parse_study;
use std::path::Path;
use std::process::{Command, Output};

const MODEL: &str = "name = \"made up\"\n[parameters]\nOmega = 1\nkappa = 0\nzeta = 0.1\n[states]\nx = \"-x\"\n[outputs]\nr = \"abs(x)\"\n";
const STUDY: &str = r#"model = "made-up.toml"
[[seed]]
name = "start"
state = { x = 0 }
[[branch]]
name = "main"
from = "start"
free = "Omega"
range = [0, 4]
[[curve]]
name = "folds"
hold = "fold"
of = "main"
free = "kappa"
range = [0, 1]
[[homotopy]]
name = "way"
from = "start"
to = { kappa = 1 }
via = "Omega"
range = [0, 4]
"#;

fn point(position: i64, [omega, kappa]: [f64; 2], r: f64) -> Point {
    Point {
        position,
        parameters: vec![omega, kappa, 0.1],
        solution: Solution::Equilibrium(vec![r]),
        tangent: vec![0.0, 1.0],
        step: 0.1,
        spectrum: Vec::new(),
        unstable: 0,
        ranges: vec![[r, r], [r, r]],
        averages: vec![[r, r * r], [r, r * r]],
        trust: Trust::default(),
        cost: Cost::default(),
    }
}

/// A branch with points at these parameter values.
fn branch(name: &str, free: usize, held: Option<(Kind, usize)>, origin: Origin, at: &[[f64; 2]]) -> Branch {
    let mut branch = Branch { held, ..Branch::new(name, Family::Equilibrium, free, origin) };
    for (position, at) in at.iter().enumerate() {
        branch.insert(point(position as i64, *at, 1.0 + at[0]));
    }
    branch.ends = [Some(Ending::Bound(0.0)), Some(Ending::Bound(1.0))];
    branch
}

/// Returns the folder of a run in which the fold of `main` at Omega = 2 is continued while kappa goes to 1.
fn run() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let study = parse_study(STUDY, "study.toml", MODEL, "made-up.toml").unwrap();
    let recorder = Recorder::create(&folder.path().join("run"), &study).unwrap();
    let fold = |position, at: [f64; 2]| SpecialPoint {
        kind: Kind::Fold,
        point: point(position, at, 3.0),
        unstable_before: 0,
        unstable_after: 1,
        error: 1e-9,
        coefficients: Vec::new(),
        coefficient_errors: Vec::new(),
        remark: String::new(),
    };
    let mut main = branch("main", 0, None, Origin::Seed("start".into()), &[[0.0, 0.0], [2.0, 0.0], [0.5, 0.0]]);
    main.insert_special(fold(1, [2.0, 0.0]));
    let origin = Origin::Switch { parent: "main".into(), kind: Kind::Fold, parameter: 2.0 };
    let mut folds = branch("folds", 1, Some((Kind::Fold, 0)), origin, &[[2.0, 0.0], [2.5, 0.5], [2.25, 1.0]]);
    folds.insert_special(fold(1, [2.5, 0.5]));
    let first = branch("way/1", 1, None, Origin::Seed("start".into()), &[[1.0, 0.0], [1.0, 0.75], [1.0, 0.25]]);
    let second = branch("way/2", 1, None, Origin::EndOf("way/1".into()), &[[3.0, 0.0], [3.0, 1.0]]);
    // In an order in which they may have finished.
    for branch in [&first, &folds, &second, &main] {
        let bare = Branch { points: Vec::new(), special: Vec::new(), ends: [None, None], ..branch.clone() };
        recorder.observe(Event::Begin(&bare));
        for point in &branch.points {
            recorder.observe(Event::Point(branch, point));
        }
        for special in &branch.special {
            recorder.observe(Event::Special(branch, special));
        }
        for (side, end) in branch.ends.iter().enumerate().filter_map(|(side, end)| Some((side, end.as_ref()?))) {
            recorder.observe(Event::SideEnded(branch, side, end));
        }
    }
    recorder.observe(Event::Note("way", "at Omega = 1 the run in kappa turns back at 0.75"));
    recorder.observe(Event::Note("start", "1 equilibrium"));
    recorder.observe(Event::Note("way", "at Omega = 3 it gets through"));
    recorder.finish().unwrap();
    folder
}

fn foldline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap()
}

#[track_caller]
fn printed(folder: &Path, arguments: &[&str]) -> String {
    let output = foldline(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn special_points_of_a_curve_have_both_parameters() {
    let folder = run();
    let text = printed(folder.path(), &["table", "run"]);
    let expected = "branch  kind        Omega        kappa        r_max  unstable_before  unstable_after   error\n\
                    main    fold  2.000000000  0.000000000  3.000000000                0               1  1.0e-9\n\
                    folds   fold  2.500000000  0.500000000  3.000000000                0               1  1.0e-9\n";
    assert_eq!(text, expected);
    // Both also appear if the curve is shown alone, but a branch in Omega shows Omega only.
    let only = |name: &str| printed(folder.path(), &["table", "run", "--branch", name]);
    assert_eq!(
        words(&only("folds"))[..7],
        ["branch", "kind", "Omega", "kappa", "r_max", "unstable_before", "unstable_after"]
    );
    assert_eq!(words(&only("main"))[..4], ["branch", "kind", "Omega", "r_max"]);
    let points = printed(folder.path(), &["table", "run", "--points", "--branch", "folds", "--format", "csv"]);
    let lines: Vec<&str> = points.lines().collect();
    assert!(lines[0].starts_with("branch,position,Omega,kappa,zeta,"), "{points}");
    assert!(lines[2].starts_with("folds,1,2.5,0.5,0.1,"), "{points}");
}

fn words(text: &str) -> Vec<&str> {
    text.split_whitespace().collect()
}

#[test]
fn branches_are_listed_after_their_origin_and_curves_with_both_parameters() {
    let folder = run();
    let rows: serde_json::Value =
        serde_json::from_str(&printed(folder.path(), &["table", "run", "--branches", "--format", "json"])).unwrap();
    let names: Vec<&str> = rows.as_array().unwrap().iter().filter_map(|row| row["branch"].as_str()).collect();
    assert_eq!(names, ["main", "folds", "way/1", "way/2"]);
    let keys = ["held", "free", "from", "to", "follows", "follows_from", "follows_to"];
    let cells = |row: usize| serde_json::Value::from(keys.map(|key| rows[row][key].clone()).to_vec());
    assert_eq!(cells(0), serde_json::json!([null, "Omega", 0.0, 2.0, null, null, null]));
    assert_eq!(cells(1), serde_json::json!(["fold", "kappa", 0.0, 1.0, "Omega", 2.0, 2.5]));
    assert_eq!(rows[1]["origin"], "fold of main at 2.000000");
    let legs = printed(folder.path(), &["table", "run", "--branches", "--branch", "way"]);
    assert!(legs.contains("way/1") && legs.contains("way/2") && !legs.contains("main"), "{legs}");
    // Without a curve there is no second parameter to show.
    assert!(!legs.contains("held") && !legs.contains("follows"), "{legs}");
}

#[test]
fn the_path_of_a_homotopy_is_reported_in_order() {
    let folder = run();
    let notes = printed(folder.path(), &["table", "run", "--notes", "--format", "csv"]);
    let expected = "about,note\nstart,1 equilibrium\nway,at Omega = 1 the run in kappa turns back at 0.75\n\
                    way,at Omega = 3 it gets through\n";
    assert_eq!(notes, expected);
    let of_way = printed(folder.path(), &["table", "run", "--notes", "--branch", "way"]);
    assert_eq!(of_way.lines().count(), 3, "{of_way}");
}

/// Titles of the groups in a picture: the names of what is drawn.
fn drawn(folder: &Path, arguments: &[&str]) -> (Vec<String>, String) {
    printed(folder, &[&["plot", "run", "-o", "a.svg"], arguments].concat());
    let svg = std::fs::read_to_string(folder.join("a.svg")).unwrap();
    let names = ["main", "folds", "way/1", "way/2"].into_iter().map(String::from);
    (names.filter(|name| svg.contains(&format!("<title>{name}</title>"))).collect(), svg)
}

#[test]
fn pictures_show_branches_or_two_parameter_curves() {
    let folder = run();
    let (names, svg) = drawn(folder.path(), &[]);
    assert_eq!(names, ["main", "way/1", "way/2"]);
    assert!(svg.contains("max r"));
    let (names, svg) = drawn(folder.path(), &["--curves"]);
    assert_eq!(names, ["folds"]);
    let (across, up) = (svg.find(">Ω<").unwrap(), svg.find(">κ<").unwrap());
    assert!(across < up && !svg.contains("max r"), "{svg}");
    let (names, _) = drawn(folder.path(), &["--x", "Omega", "--y", "kappa"]);
    assert_eq!(names, ["main", "folds", "way/1", "way/2"]);
    let (names, svg) = drawn(folder.path(), &["--curves", "--y", "r"]);
    assert_eq!(names, ["folds"]);
    assert!(svg.contains("max r"));
}

#[test]
fn curves_that_a_run_does_not_have_cannot_be_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let study = parse_study(STUDY, "study.toml", MODEL, "made-up.toml").unwrap();
    Recorder::create(&folder.path().join("run"), &study).unwrap().finish().unwrap();
    let output = foldline(folder.path(), &["plot", "run", "--curves", "-o", "a.svg"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("no two-parameter curves") && said.contains("remove --curves"), "{said}");
}
