//! The first ten minutes: `foldline new`, `foldline simulate`, confused file types, and messages for unsupported
//! features.

use std::path::Path;
use std::process::{Command, Output};

fn foldline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap()
}

fn words(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Returns the output of a command that must succeed.
#[track_caller]
fn printed(folder: &Path, arguments: &[&str]) -> String {
    let output = foldline(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", words(&output.stderr));
    words(&output.stdout)
}

/// Returns the message of a command that must fail with exit code 2.
#[track_caller]
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = foldline(folder, arguments);
    let message = words(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    message
}

#[track_caller]
fn says(message: &str, pieces: &[&str]) {
    for piece in pieces {
        assert!(message.contains(piece), "\"{piece}\" is missing in:\n{message}");
    }
}

const LINEAR: &str = r#"
time = "s"

[parameters]
k = { value = 4, unit = "1/s^2" }

[states.x]
equation = "v"
unit = "mm"
range = [-1, 1]

[states.v]
equation = "-k*x"
unit = "mm/s"
range = [-1, 1]

[outputs]
energy = { expression = "v^2 + k*x^2", unit = "mm^2/s^2" }
"#;

fn with(name: &str, text: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(name), text).unwrap();
    folder
}

#[test]
fn every_template_runs_completely_and_finds_what_its_study_announces() {
    let folder = tempfile::tempdir().unwrap();
    let list = printed(folder.path(), &["new"]);
    let expected: [(&str, &[&str]); 4] = [
        ("oscillator", &["resonance  fold", "jumps      cusp", "up    sweep", "down  sweep"]),
        ("rotor", &["unbalance response  fold", "run-up    sweep", "run-down  sweep"]),
        // Rinzel and Ermentrout (1998): the rest state loses its stability at 93.86 and regains it at 212.02, both
        // subcritically.
        ("neuron", &["hopf   93.85", "hopf  212.01", "subcritical", "rest/hopf-1  fold"]),
        ("chain", &["response  fold", "up   sweep"]),
    ];
    for (name, pieces) in expected {
        says(&list, &[name]);
        says(&printed(folder.path(), &["new", name]), &["model.toml", "study.toml", "foldline run study.toml"]);
        let own = folder.path().join(name);
        printed(&own, &["check", "model.toml"]);
        let table = printed(&own, &["run", "study.toml"]);
        says(&table, pieces);
        // Existing files are not overwritten.
        says(&refused(folder.path(), &["new", name]), &["model.toml already exists", "--out"]);
    }
    says(&refused(folder.path(), &["new", "rotr"]), &["no template `rotr`", "did you mean `rotor`?"]);
}

#[test]
fn a_study_is_written_for_a_model() {
    let folder = with("mine.toml", "[parameters]\nmu = 0.5\n[states.x]\nequation = \"mu - x\"\nrange = [-2, 2]\n");
    says(&printed(folder.path(), &["new", "--study", "mine.toml"]), &["study.toml"]);
    printed(folder.path(), &["run", "study.toml"]);
}

#[test]
fn a_trajectory_solves_the_equations() {
    let folder = with("spring.toml", LINEAR);
    let arguments =
        ["simulate", "spring.toml", "--start", "x=1,v=0", "--time", "3 s", "--every", "500 ms", "--format", "csv"];
    let table = printed(folder.path(), &arguments);
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("t,x,v,energy"));
    let rows: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    assert_eq!(rows.iter().map(|row| row[0]).collect::<Vec<_>>(), [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]);
    for row in rows {
        // x = cos 2t, to the tolerance 1e-8 per unit of time.
        assert!((row[1] - (2.0 * row[0]).cos()).abs() < 1e-6, "{row:?}");
        assert!((row[3] - 4.0).abs() < 1e-5, "{row:?}");
    }
    printed(
        folder.path(),
        &["simulate", "spring.toml", "--start", "x=1", "--time", "3", "-o", "phase.svg", "--x", "x"],
    );
    let picture = std::fs::read_to_string(folder.path().join("phase.svg")).unwrap();
    says(&picture, &["x [mm]", "v [mm/s]"]);
}

#[test]
fn a_trajectory_that_ends_early_says_where_and_why() {
    let folder = with("blow-up.toml", "[states.x]\nequation = \"x^2\"\nrange = [0, 1]\n");
    let output = foldline(folder.path(), &["simulate", "blow-up.toml", "--start", "x=1", "--time", "2"]);
    assert_eq!(output.status.code(), Some(3));
    says(&words(&output.stderr), &["incomplete: ", "grew without bound", "of 2.0"]);
}

#[test]
fn arguments_of_simulate_are_checked() {
    let folder = with("spring.toml", LINEAR);
    let told = |more: &[&str]| refused(folder.path(), &[&["simulate", "spring.toml"], more].concat());
    says(&told(&[]), &["length", "--time 100"]);
    says(&told(&["--periods", "3"]), &["no forcing", "--time"]);
    says(&told(&["--time", "3 kg"]), &["--time 3 kg", "not a positive time"]);
    says(&told(&["--time", "3", "--start", "y=1"]), &["no state `y`", "one of"]);
    says(&told(&["--time", "3", "--start", "x=one"]), &["`one` is neither a finite number"]);
    says(&told(&["--time", "3", "--show", "enrgy"]), &["enrgy", "did you mean `energy`?"]);
    says(&told(&["--time", "3", "--every", "1e-12"]), &["rows", "a larger interval"]);
    says(&told(&["--time", "3", "--every", "period"]), &["not a time interval"]);
}

#[test]
fn a_model_and_a_study_are_told_apart() {
    let folder = with("spring.toml", LINEAR);
    std::fs::write(folder.path().join("study.toml"), "model = \"spring.toml\"\n").unwrap();
    says(
        &refused(folder.path(), &["run", "spring.toml"]),
        &[
            "is a model, not a study",
            "spring.toml:5:1",
            "foldline explore spring.toml --free k=LOW:HIGH",
            "foldline new --study spring.toml",
        ],
    );
    for command in
        [&["attractors", "study.toml"][..], &["simulate", "study.toml"], &["explore", "study.toml", "--free", "k=1:2"]]
    {
        says(&refused(folder.path(), command), &["is a study, not a model", "foldline run study.toml", "spring.toml"]);
    }
}

#[test]
fn unsupported_features_are_explained() {
    let folder = with("spring.toml", LINEAR);
    let study = |line: &str| {
        let text = format!(
            "model = \"spring.toml\"\n{line}\n[[seed]]\nname = \"a\"\nstate = {{ x = 0, v = 0 }}\n\
             [[branch]]\nname = \"b\"\nfrom = \"a\"\nfree = \"k\"\nrange = [1, 5]\n"
        );
        std::fs::write(folder.path().join("study.toml"), text).unwrap();
        refused(folder.path(), &["check", "study.toml"])
    };
    let expected: [(&str, &[&str]); 9] = [
        ("map = true", &["study.toml:2:7", "`map` is not a list of tables", "[[map]]"]),
        ("boundary-conditions = []", &["boundary-value problem", "[boundary]"]),
        ("delays = [1]", &["delay differential equations", "DDE-BIFTOOL"]),
        ("torus = 1", &["invariant tori", "switch = { torus = 1 }"]),
        ("homoclinic = 1", &["connecting orbits", "saddle-node-homoclinic"]),
        ("noise = 0.1", &["random forcing"]),
        ("ntst = 40", &["meshes cannot be set", "`degree`"]),
        ("ds = 0.01", &["step sizes", "`tolerance`"]),
        ("resets = 1", &["states that jump", "[events.NAME]", "[contact.NAME]"]),
    ];
    for (line, pieces) in expected {
        says(&study(line), pieces);
    }
    let model = |text: &str| {
        std::fs::write(folder.path().join("other.toml"), text).unwrap();
        refused(folder.path(), &["check", "other.toml"])
    };
    says(&model("[states.x]\nequation = \"-delay(x, 1)\"\n"), &["no function `delay`", "delay differential equations"]);
    let forcing = "[forcing]\nfrequency = [\"1\", \"sqrt(2)\"]\n[states.x]\nequation = \"-x + cos(t)\"\n";
    says(&model(forcing), &["two forcing frequencies", "common period"]);
}

#[test]
fn help_is_printed_without_a_reference_study() {
    let folder = tempfile::tempdir().unwrap();
    says(&printed(folder.path(), &[]), &["Usage", "simulate", "explore"]);
    assert!(!folder.path().join("runs").exists());
}

#[test]
fn unwanted_profiles_are_removed_from_the_run_file() {
    let folder = tempfile::tempdir().unwrap();
    printed(folder.path(), &["new", "neuron"]);
    let own = folder.path().join("neuron");
    let study = std::fs::read_to_string(own.join("study.toml")).unwrap();
    let run = |name: &str, store: &str| {
        std::fs::write(own.join("study.toml"), format!("store = {store}\n{study}")).unwrap();
        printed(&own, &["run", "study.toml", "--out", name]);
        let special = printed(&own, &["table", name, "--format", "csv"]);
        let points = printed(&own, &["table", name, "--points", "--format", "csv"]);
        (std::fs::metadata(own.join(name).join("run.sqlite")).unwrap().len(), special, points)
    };
    let (all, few, third) = (run("all", "\"all\""), run("few", "\"special\""), run("third", "3"));
    assert!(few.0 < all.0 / 2 && few.0 < third.0 && third.0 < all.0, "{} {} {}", all.0, few.0, third.0);
    assert_eq!((&all.1, &all.2), (&few.1, &few.2), "every point keeps its numbers");
    says(&printed(&own, &["verify", "few"]), &["profiles were not stored", "special points recomputed"]);
    printed(&own, &["plot", "few", "-o", "picture.svg"]);
    printed(&own, &["export", "few", "--format", "csv"]);
    let output = foldline(&own, &["run", "study.toml", "--out", "third", "--resume"]);
    says(&words(&output.stderr), &["keeps only part of its profiles", "--out DIR"]);
}
