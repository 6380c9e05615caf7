//! The studies in `studies/auto`, which solve the problems of AUTO-07p's demos: special points against those that AUTO finds.
//!
//! `reference/auto.csv` contains values of AUTO-07p 0.9.2 with tolerances of 1e-9 or less for the solutions, 1e-7 or less for
//! the location of special points, and two to three times the mesh intervals of its demos.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

const REFERENCE: &str = include_str!("reference/auto.csv");

/// Largest relative difference: ten times AUTO's tolerance for the location of special points, because a quantity may change
/// that much faster than the arclength in which it locates them.
const WITHIN: f64 = 1e-6;

fn foldline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap()
}

/// The cells of a line; quoted ones may contain commas.
fn cells(line: &str) -> Vec<String> {
    let (mut all, mut quoted) = (vec![String::new()], false);
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => all.push(String::new()),
            c => all.last_mut().unwrap().push(c),
        }
    }
    all
}

/// Special points of a run, by column.
fn special_points(folder: &Path) -> Vec<BTreeMap<String, String>> {
    let table = String::from_utf8(foldline(folder, &["table", "run", "--format", "csv"]).stdout).unwrap();
    let mut lines = table.lines().map(cells);
    let names = lines.next().unwrap_or_default();
    lines.map(|line| names.iter().cloned().zip(line).collect()).collect()
}

/// Largest relative difference of the values `name=value;…` in a special point; values near 0 count as 1e-3.
fn difference(point: &BTreeMap<String, String>, values: &str) -> f64 {
    let each = values.split(';').map(|pair| {
        let (name, known) = pair.rsplit_once('=').unwrap();
        let known: f64 = known.parse().unwrap();
        let own: f64 = point.get(name).and_then(|own| own.parse().ok()).unwrap_or(f64::INFINITY);
        (own - known).abs() / known.abs().max(1e-3)
    });
    each.fold(0.0, f64::max)
}

/// Runs the study of a demo and looks for its special points.
#[track_caller]
fn agrees(demo: &str) {
    let study = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../studies/auto/{demo}.toml"));
    let folder = tempfile::tempdir().unwrap();
    let output = foldline(folder.path(), &["run", study.to_str().unwrap(), "--out", "run", "--quiet"]);
    let said = String::from_utf8_lossy(&output.stderr);
    // A study may state how many points are enough. Two pairs of eigenvalues of the libration point cross together, which is
    // no bifurcation of a kind that is known.
    let expected = |line: &str| {
        line.contains("stopped at the limit of") || demo == "r3b" && line.contains("a change of stability at drag =")
    };
    let complete = said.lines().filter(|line| line.starts_with("incomplete")).all(expected);
    assert!(complete && matches!(output.status.code(), Some(0 | 3)), "{demo}: {said}");
    let found = special_points(folder.path());
    for line in REFERENCE.lines().filter(|line| !line.starts_with('#')) {
        let [name, kind, values] = line.split(',').collect::<Vec<&str>>()[..] else { panic!("{line}") };
        if name != demo {
            continue;
        }
        let own = found.iter().filter(|point| point["kind"] == kind);
        let best = own.map(|point| difference(point, values)).fold(f64::INFINITY, f64::min);
        assert!(best < WITHIN, "{demo}: no {kind} at {values}; the nearest one differs by {best:e}");
    }
}

macro_rules! demos {
    ($($(#[$attribute:meta])* $name:ident,)*) => {
        $($(#[$attribute])* #[test] fn $name() { agrees(stringify!($name)); })*
    };
}

// The ignored ones take four to twenty seconds each: `cargo test --release -p foldline-cli --test auto -- --ignored`.
demos! {
    ab,
    abc,
    abcb,
    apbp,
    brc,
    brf,
    bru,
    bvp,
    chu,
    #[ignore = "takes seconds"]
    cir,
    cusp,
    dd2,
    enz,
    exp,
    ext,
    ezp,
    ffn,
    fhh,
    fhn,
    fnb,
    frc,
    fsh,
    hen,
    #[ignore = "takes seconds"]
    int,
    ivp,
    #[ignore = "takes seconds"]
    kar,
    kpr,
    lcbp,
    lin,
    log,
    lor,
    lrz,
    man,
    mtn,
    nag,
    nep,
    non,
    obv,
    ops,
    opt,
    #[ignore = "takes seconds"]
    p2c,
    #[ignore = "takes seconds"]
    pcl,
    pd1,
    pd2,
    #[ignore = "takes seconds"]
    pen,
    ph1,
    phs,
    #[ignore = "takes seconds"]
    pla,
    plp,
    pp2,
    pp3,
    ppp,
    pvl,
    #[ignore = "takes seconds"]
    r3b,
    #[ignore = "takes seconds"]
    r3b2,
    rev,
    #[ignore = "takes seconds"]
    san,
    #[ignore = "takes seconds"]
    she,
    spb,
    sspg,
    stw,
    tfc,
    tfc2,
    tim,
    tor,
    um2,
    um3,
    vhb,
    wav,
}

/// A repeated state: its name, its values over the interval from 0 to 1, and the number of its elements.
type Profile<'f> = (&'f str, &'f dyn Fn(f64) -> f64, usize);

/// Value of an output at a time, from values of the elements of states at time 0.
fn in_time(model: &str, start: &[Profile], time: f64, output: &str) -> f64 {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../studies/auto/models/{model}.toml"));
    let folder = tempfile::tempdir().unwrap();
    let state = |(name, value, n): &Profile| {
        let all = (1..=*n).map(|i| format!("{name}[{i}]={}", value(i as f64 / (*n + 1) as f64)));
        all.collect::<Vec<String>>().join(",")
    };
    let start = start.iter().map(state).collect::<Vec<String>>().join(",");
    let [file, time] = [file.to_str().unwrap().to_string(), time.to_string()];
    let options = ["--start", &start, "--time", &time, "--every", &time, "--show", output, "--format", "csv"];
    let said = foldline(folder.path(), &[&["simulate", &file][..], &options].concat());
    let table = String::from_utf8(said.stdout).unwrap();
    table.lines().last().unwrap().rsplit(',').next().unwrap().parse().unwrap()
}

/// AUTO integrates parabolic equations by a method of order 1. Its values here belong to fixed steps of 0.01, 0.005 and 0.0025
/// (IADS = 0) with NTST = 30 (`bru`) or 40. 2 a(h/2) - a(h) is of order 2, and the difference between two such values a bound
/// on the error of the better one.
#[track_caller]
fn tends_to(own: f64, auto: [f64; 3]) {
    let [worse, better] = [0, 1].map(|k| 2.0 * auto[k + 1] - auto[k]);
    assert!((own - better).abs() < (better - worse).abs(), "{own}, while AUTO tends to {better} ± {}", better - worse);
    assert!((own - better).abs() < 0.2 * (own - auto[2]).abs(), "{own} {better} {}", auto[2]);
}

#[test]
fn motions_in_time_are_those_to_which_auto_tends_with_its_step() {
    use std::f64::consts::PI;
    let wave = |x: f64| (PI * x).sin();
    // Largest u, or root mean square of u where the largest value hardly moves.
    let brusselator: [Profile; 2] = [("x", &|x| 2.0 - 0.5 * wave(x), 49), ("y", &|x| 2.725 + 0.7 * wave(x), 49)];
    tends_to(in_time("bru", &brusselator, 24.0, "middle"), [3.0856168131, 3.1543718113, 3.1878046450]);
    tends_to(in_time("pd1-time", &[("u", &wave, 199)], 2.0, "size"), [0.86647929875, 0.86657250300, 0.86661834210]);
    let two: [Profile; 2] = [("u", &wave, 49), ("w", &|_| 1.0, 49)];
    tends_to(in_time("pd2-time", &two, 1.0, "middle"), [0.16179847999, 0.16133435730, 0.16111011896]);
}

#[test]
fn every_study_is_tested_and_every_value_belongs_to_one() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../studies/auto");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let studies: Vec<String> = files.filter_map(|name| Some(name.strip_suffix(".toml")?.to_string())).collect();
    let source = include_str!("auto.rs");
    let page = include_str!("../../../docs/book/auto-demos.md");
    for study in &studies {
        assert!(source.contains(&format!("    {study},\n")), "{study} is not tested");
        assert!(page.contains(&format!("[`{study}`]")), "{study} is not on the page");
    }
    for line in REFERENCE.lines().filter(|line| !line.starts_with('#')) {
        let name = line.split(',').next().unwrap();
        assert!(studies.iter().any(|study| study == name), "{line}");
    }
}
