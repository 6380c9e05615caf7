//! `foldline table --susceptibility`: responses of a linear oscillator and of its rest are closed forms.

use std::path::Path;
use std::process::{Command, Output};

fn foldline(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap()
}

/// Writes a model and its study, and runs them.
fn run(model: &str, seed: &str, branch: &str, folder: &Path) {
    std::fs::write(folder.join("model.toml"), format!("name = \"m\"\n{model}")).unwrap();
    let study = format!(
        "model = \"model.toml\"\n[[seed]]\nname = \"s\"\n{seed}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n{branch}\n"
    );
    std::fs::write(folder.join("study.toml"), study).unwrap();
    let output = foldline(&["run", "study.toml", "--out", "run"], folder);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Rows of the table as numbers by column.
fn rows(output: &Output) -> Vec<std::collections::HashMap<String, f64>> {
    let text = String::from_utf8_lossy(&output.stdout);
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let cells = names.iter().zip(line.split(','));
        cells.filter_map(|(name, cell)| Some((name.to_string(), cell.parse().ok()?))).collect()
    };
    lines.map(row).collect()
}

/// |1 / (1 - ν² + 2iζν)|: the response of x'' + 2ζx' + x to cos νt.
fn gain(nu: f64, zeta: f64) -> f64 {
    1.0 / (1.0 - nu * nu).hypot(2.0 * zeta * nu)
}

#[test]
fn a_linear_oscillator_adds_the_response_to_a_second_forcing() {
    let (folder, zeta, nu) = (tempfile::tempdir().unwrap(), 0.05, 0.73);
    let model = "[parameters]\nw = 0.6\nnu = 0.73\n[forcing]\nfrequency = \"w\"\n[states]\nx = \"v\"\nv = \"-0.1*v - x + cos(w*t)\"\n";
    run(model, "attractor = \"cycle\"", "free = \"w\"\nrange = [0.5, 1.4]", folder.path());
    // sin νt in the equation of v, by two expressions that mean the same.
    for force in ["v=-i", "v=-nu/0.73*i"] {
        let asked = ["table", "run", "--susceptibility", "--force", force, "--frequency", "nu", "--format", "csv"];
        let output = foldline(&asked, folder.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let rows = rows(&output);
        assert!(rows.len() > 5);
        for row in &rows {
            let [x, v] = [gain(nu, zeta), nu * gain(nu, zeta)];
            let off = (row["x_response"] - x).abs().max((row["v_response"] - v).abs()) / x;
            assert!(off <= row["response_error"] && row["response_error"] < 1e-4, "{row:?} {x} {v}");
            // The exponents are -ζ ± i sqrt(1 - ζ²), up to multiples of the frequency of the cycle.
            let natural = (1.0_f64 - zeta * zeta).sqrt();
            let copies = (-9..=9).flat_map(|m| [natural, -natural].map(|own| own + f64::from(m) * row["w"] - nu));
            let distance = copies.map(|off| off.hypot(zeta)).fold(f64::INFINITY, f64::min);
            assert!((row["distance"] - distance).abs() < 1e-6, "{row:?} {distance}");
        }
    }
}

#[test]
fn an_equilibrium_responds_with_the_resolvent_and_jumps_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let model = "[parameters]\nk = 1\n[states]\nx = \"v\"\nv = \"-0.2*v - k*x\"\n";
    run(model, "state = \"zero\"", "free = \"k\"\nrange = [0.5, 4]", folder.path());
    let asked = ["table", "run", "--susceptibility", "--force", "v=2", "--frequency", "1.5", "--format", "csv"];
    for row in rows(&foldline(&asked, folder.path())) {
        let expected = 2.0 / (row["k"] - 2.25).hypot(0.2 * 1.5);
        assert!((row["x_response"] - expected).abs() < 1e-12 * expected, "{row:?}");
    }
    let told = |asked: &[&str]| {
        let output = foldline(&[&["table", "run", "--susceptibility"], asked].concat(), folder.path());
        (String::from_utf8_lossy(&output.stderr).into_owned(), output.status.code().unwrap())
    };
    assert!(told(&["--force", "v=1"]).0.contains("--frequency"));
    assert!(told(&["--frequency", "1"]).0.contains("--force v=1"));
    assert!(told(&["--force", "w=1", "--frequency", "1"]).0.contains("no state w"));
    assert_eq!(told(&["--force", "v=1", "--frequency", "omega"]).1, 2);
    let bouncing = include_str!("../../../models/impact-oscillator.toml");
    std::fs::write(folder.path().join("impact.toml"), bouncing).unwrap();
    let study = "model = \"impact.toml\"\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \
                 \"omega\"\nrange = [0.95, 1.05]\n";
    std::fs::write(folder.path().join("impacts.toml"), study).unwrap();
    foldline(&["run", "impacts.toml", "--out", "impacts"], folder.path());
    let name = ["table", "impacts", "--susceptibility", "--force", "x'=1", "--frequency", "1"];
    let output = foldline(&name, folder.path());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(3) && said.contains("the state jumps at events"), "{said}");
}

#[test]
fn responses_are_drawn_and_points_without_one_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let model =
        "[parameters]\nw = 0.6\n[forcing]\nfrequency = \"w\"\n[states]\nx = \"v\"\nv = \"-0.1*v - x + cos(w*t)\"\n";
    run(model, "attractor = \"cycle\"", "free = \"w\"\nrange = [0.5, 1.4]", folder.path());
    let asked = ["plot", "run", "--susceptibility", "--force", "v=1", "--frequency", "2*w", "-o", "response.svg"];
    let output = foldline(&asked, folder.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let picture = std::fs::read_to_string(folder.path().join("response.svg")).unwrap();
    // The largest response, at 2w = 1, is 10.
    assert!(picture.contains("x_response") && picture.contains(">10<"), "{picture}");
    let without = foldline(&["plot", "run", "--susceptibility", "--force", "v=1", "-o", "response.svg"], folder.path());
    assert!(String::from_utf8_lossy(&without.stderr).contains("the frequency of the forcing is missing"));
}
