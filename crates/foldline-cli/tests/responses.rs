//! A study that only simulates, run by the command.

use std::path::Path;
use std::process::{Command, Output};

const MODEL: &str = r#"name = "jumping cycle"
description = "Radial: mu R + R^3 - R^5, a subcritical Hopf point at mu = 0 and a fold of cycles at mu = -1/4."
whirl = ["x", "y"]
[parameters]
mu = 0.5
[definitions]
R = "hypot(x, y)"
growth = "mu + R^2 - R^4"
[states.x]
equation = "growth*x - 2*y"
[states.y]
equation = "growth*y + 2*x"
[outputs]
R = { expression = "R" }
"#;

const STUDY: &str = r#"model = "model.toml"
[[seed]]
name = "cycle"
attractor = "cycle"
parameters = { mu = 0.5 }
samples = 8
[[survey]]
name = "what attracts"
free = "mu"
values = [-0.5, -0.1, 0.4]
starts = 12
[[sweep]]
name = "down"
from = "cycle"
free = "mu"
range = [0.5, -0.46]
count = 25
"#;

fn foldline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap()
}

fn printed(folder: &Path, arguments: &[&str]) -> String {
    let output = foldline(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// R of the stable cycle: R² = (1 + √(1 + 4 mu))/2.
fn radius(mu: f64) -> f64 {
    (0.5 * (1.0 + (1.0 + 4.0 * mu).sqrt())).sqrt()
}

#[test]
fn surveys_and_sweeps_are_run_once_and_listed() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("model.toml"), MODEL).unwrap();
    std::fs::write(folder.path().join("study.toml"), STUDY).unwrap();
    assert!(printed(folder.path(), &["check", "study.toml"]).contains("0 branches, 1 survey, 1 sweep"));
    let summary = printed(folder.path(), &["run", "study.toml"]);
    assert!(summary.contains("what attracts") && summary.contains("down"), "{summary}");

    let csv = printed(folder.path(), &["table", "runs/study", "--responses", "--format", "csv"]);
    let mut lines = csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let heads = lines.next().unwrap();
    let cell = |row: &[&str], name: &str| row[heads.iter().position(|h| *h == name).unwrap()].to_string();
    let number = |row: &[&str], name: &str| cell(row, name).parse::<f64>().unwrap();
    let rows: Vec<Vec<&str>> = lines.collect();
    let of = |set: &'static str| rows.iter().filter(move |row| row[0] == set);

    // Only the rest state attracts below the fold, only the cycle above the Hopf point, and both in between.
    let met: Vec<(String, String)> = of("what attracts").map(|row| (cell(row, "mu"), cell(row, "motion"))).collect();
    let mut expected = [("-0.5", "equilibrium"), ("-0.1", "equilibrium"), ("-0.1", "cycle"), ("0.4", "cycle")]
        .map(|(a, b)| (a.to_string(), b.to_string()))
        .to_vec();
    let sorted = |mut list: Vec<(String, String)>| {
        list.sort();
        list
    };
    expected.sort();
    assert_eq!(sorted(met), expected);
    let hits: f64 = of("what attracts").map(|row| number(row, "hits")).sum();
    assert_eq!(hits, 36.0);
    // Nine of the twelve starts at each value are uniform, and each of them settled somewhere.
    for mu in ["-0.5", "-0.1", "0.4"] {
        let own = of("what attracts").filter(|row| cell(row, "mu") == mu);
        let shares: Vec<[f64; 3]> =
            own.map(|row| ["share", "share_low", "share_high"].map(|name| number(row, name))).collect();
        assert!((shares.iter().map(|share| share[0]).sum::<f64>() - 1.0).abs() < 1e-12, "{shares:?}");
        assert!(
            shares.iter().all(|[share, low, high]| low <= share && share <= high && high - low > 0.2),
            "{shares:?}"
        );
        assert!(shares.iter().all(|[share, ..]| (9.0 * share - (9.0 * share).round()).abs() < 1e-9), "{shares:?}");
    }
    assert!(of("down").all(|row| cell(row, "share").is_empty()));
    for row in rows.iter().filter(|row| cell(row, "motion") == "cycle") {
        // A cycle counts as settled when its returns agree to 1e-7, and it attracts at least like e^(-0.1 t).
        assert!((number(row, "R_max") - radius(number(row, "mu"))).abs() < 1e-5, "{row:?}");
        assert!((number(row, "period") - std::f64::consts::PI).abs() < 1e-6, "{row:?}");
    }
    // The sweep stays on the cycle down to its fold and falls to rest there.
    for row in of("down") {
        let on_the_cycle = number(row, "mu") > -0.25;
        assert_eq!(cell(row, "motion") == "cycle", on_the_cycle, "{row:?}");
    }
    let jumps: Vec<f64> = of("down").filter(|row| cell(row, "jump") == "jump").map(|row| number(row, "mu")).collect();
    assert!(jumps.len() == 1 && (jumps[0] + 0.26).abs() < 1e-9, "{jumps:?}");

    let again = foldline(folder.path(), &["run", "study.toml", "--resume"]);
    assert!(again.status.success());
    let said = String::from_utf8(again.stderr).unwrap();
    assert!(!said.contains("responses from the"), "what is done is repeated: {said}");
    assert_eq!(printed(folder.path(), &["table", "runs/study", "--responses", "--format", "csv"]), csv);
}

/// The escape equation: x = 1 + y gives y'' + 0.1 y' + y + y² = lam sin(0.81 t), with the edge of its well at y = -1.
fn escape(force: &str, forcing: &str) -> String {
    format!(
        "[parameters]\nw = 0.81\nlam = 0.05\n{forcing}[states]\nx = {{ equation = \"v\", range = [-1, 2] }}\n\
         v = {{ equation = \"-0.1*v + x - x^2 + {force}\", range = [-1, 1] }}\n"
    )
}

const FORCED: [&str; 2] = ["lam*sin(w*t)", "[forcing]\nfrequency = \"w\"\n"];
const FREE: [&str; 2] = ["lam", ""];

#[test]
fn every_start_that_escapes_is_counted() {
    for [force, forcing] in [FORCED, FREE] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("m.toml"), escape(force, forcing)).unwrap();
        let study = "model = \"m.toml\"\n[[survey]]\nname = \"basin\"\nfree = \"lam\"\nvalues = [0.02, 0.06, 0.1]\nstarts = 16\n";
        std::fs::write(folder.path().join("s.toml"), study).unwrap();
        let run = foldline(folder.path(), &["run", "s.toml", "--out", "r"]);
        let said = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(0), "{said}");
        let csv = printed(folder.path(), &["table", "r", "--responses", "--format", "csv"]);
        let mut lines = csv.lines().map(|line| line.split(',').map(str::to_string).collect::<Vec<_>>());
        let heads = lines.next().unwrap();
        let place = |name: &str| heads.iter().position(|h| h == name).unwrap();
        let (lam, motion, hits) = (place("lam"), place("motion"), place("hits"));
        let rows: Vec<Vec<String>> = lines.collect();
        for value in ["0.02", "0.06", "0.1"] {
            let own: Vec<_> = rows.iter().filter(|row| row[lam].parse::<f64>() == value.parse()).collect();
            let count = |kind: &str| -> usize {
                own.iter().filter(|row| row[motion] == kind).map(|row| row[hits].parse::<usize>().unwrap()).sum()
            };
            let escaped = count("escaped");
            assert_eq!(escaped + count("cycle") + count("equilibrium") + count("other"), 16, "{csv}");
            assert!(escaped > 0, "{csv}");
            assert!(said.contains(&format!("{escaped} at {value}")), "{said}");
        }
    }
}

/// Under a slowly growing force the motion in the well finally escapes. Thompson (1989, Proc. R. Soc. A 421) gives a
/// force of 0.109 at the frequency 0.85, and lower ones towards the optimum near 0.8, where no motion in the well
/// survives beyond 0.1.
#[test]
fn a_sweep_ends_where_its_motion_escapes_and_keeps_earlier_values() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.toml"), escape(FORCED[0], FORCED[1])).unwrap();
    let study = "model = \"m.toml\"\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\n[[sweep]]\nname = \"up\"\nfrom = \"s\"\nfree = \"lam\"\n\
                 range = [0.05, 0.3]\ncount = 26\n";
    std::fs::write(folder.path().join("s.toml"), study).unwrap();
    let run = foldline(folder.path(), &["run", "s.toml", "--out", "r"]);
    let said = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(3), "{said}");
    let csv = printed(folder.path(), &["table", "r", "--responses", "--format", "csv"]);
    let rows: Vec<Vec<&str>> = csv.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let motions: Vec<&str> = rows.iter().map(|row| row[4]).collect();
    let last: f64 = rows[rows.len() - 1][3].parse().unwrap();
    assert!(motions[..rows.len() - 1].iter().all(|motion| *motion != "escaped"), "{csv}");
    assert!(motions[rows.len() - 1] == "escaped" && last > 0.05 && last < 0.11, "{csv}");
    assert!(
        said.contains(&format!("up: at lam = {last} the motion grows without bound; the sweep ends there")),
        "{said}"
    );
}
