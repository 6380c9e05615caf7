//! An overhung shaft in a ring: its synchronous response against the closed form, and the commands for rotors.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind};
use foldline::explore::{self, System};
use foldline_store::study_file::parse_study;
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::process::Command;

const MODEL: &str = include_str!("../../../models/overhung-shaft.toml");
const STUDY: &str = include_str!("../../../studies/rotors/overhung.toml");

fn reference() -> HashMap<&'static str, f64> {
    let lines = include_str!("reference/fe_contact_sync.csv").lines().filter(|line| !line.starts_with('#')).skip(1);
    let value = |line: &'static str| {
        let number = line.split(',').find_map(|cell| cell.parse::<f64>().ok());
        (line.split(',').next().unwrap(), number.unwrap())
    };
    lines.map(value).collect()
}

#[track_caller]
fn run(study: &str) -> Diagram {
    let study = parse_study(study, "study", MODEL, "model").unwrap_or_else(|found| panic!("{found:?}"));
    explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved)
}

#[track_caller]
fn branch<'d>(diagram: &'d Diagram, name: &str) -> &'d Branch {
    let found = diagram.branch(name).unwrap_or_else(|| panic!("{name}"));
    assert!(found.ends.iter().all(|end| end.as_ref().is_some_and(Ending::complete)), "{name}: {:?}", found.ends);
    assert!(found.special.iter().all(|special| special.kind != Kind::Unexplained), "{name}");
    found
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64) {
    let error = (found / expected - 1.0).abs();
    assert!(error < tolerance, "{found} instead of {expected}: {error:.1e}");
}

/// Index of the output r_6 among the ranges of a point: outputs follow 56 states.
const RADIUS: usize = 56;
const CLEARANCE: f64 = 0.3e-3;

#[test]
fn the_synchronous_response_in_contact_is_the_closed_form() {
    let known = reference();
    let diagram = run(STUDY);
    let response = branch(&diagram, "response");
    let of = |kind: Kind| -> Vec<f64> {
        response.special.iter().filter(|s| s.kind == kind).map(|s| s.point.parameters[response.free]).collect()
    };
    let grazings = of(Kind::BoundaryEquilibrium);
    assert_eq!(grazings.len(), 2, "{grazings:?}");
    let (low, high) = (grazings[0].min(grazings[1]), grazings[0].max(grazings[1]));
    near(low, known["G1"], 1e-8);
    near(high, known["G2"], 1e-8);
    let folds = of(Kind::Fold);
    assert_eq!(folds.len(), 1, "{folds:?}");
    near(folds[0], known["F1"], 1e-7);
    // Radii at the marks: stable contact and saddle, besides the calm whirl.
    let radii = |speed: f64, unstable: bool| -> Vec<f64> {
        let marks = response.special.iter().filter(|s| s.kind == Kind::Mark);
        let own = marks.filter(|s| (s.point.parameters[response.free] - speed).abs() < 1e-6 * speed);
        let own = own.filter(|s| (s.unstable_before > 0) == unstable).map(|s| s.point.ranges[RADIUS][1] / CLEARANCE);
        own.filter(|r| *r > 1.0).collect()
    };
    for (speed, saddle, stable) in [(1200.0, "S1200u", "S1200s"), (2000.0, "S2000u", "S2000s")] {
        let [found] = radii(speed, true)[..] else { panic!("{:?}", radii(speed, true)) };
        near(found, known[saddle], 1e-7);
        let [found] = radii(speed, false)[..] else { panic!("{:?}", radii(speed, false)) };
        near(found, known[stable], 1e-7);
    }
    let saddle = response.special.iter().find(|s| {
        s.kind == Kind::Mark && (s.point.parameters[response.free] - 2000.0).abs() < 1e-3 && s.unstable_before > 0
    });
    let largest = saddle.unwrap().point.spectrum.iter().map(|z| z.re).fold(f64::NEG_INFINITY, f64::max);
    near(largest, known["E2000u"], 1e-5);
}

#[test]
fn friction_makes_the_full_annular_rub_whirl_backward() {
    let known = reference();
    for (speed, hopf) in [(880, "HM880"), (1500, "HM1500")] {
        let study = format!(
            "model = \"m\"\ntolerance = 1e-8\n\
             [[seed]]\nname = \"slow\"\nstate = \"zero\"\nparameters = {{ Omega = \"100 rpm\" }}\n\
             [[branch]]\nname = \"up\"\nfrom = \"slow\"\nfree = \"Omega\"\nuntil = \"{speed} rpm\"\n\
             [[branch]]\nname = \"friction\"\nfrom = \"up\"\n\
             free = \"mu\"\nrange = [0, 0.05]\n"
        );
        let diagram = run(&study);
        let own = branch(&diagram, "friction");
        let found = own.special.iter().find(|s| s.kind == Kind::Hopf).expect("a Hopf point");
        let mu = found.point.parameters[own.free];
        assert!((mu - known[hopf]).abs() < 1e-6, "{mu} {}", known[hopf]);
        if speed == 880 {
            // The whirl turns backward: in the fixed frame at Ω minus its frequency in the rotating frame.
            let oscillating = found.point.spectrum.iter().filter(|z| z.im > 1.0);
            let critical = oscillating.min_by(|a, b| a.re.abs().total_cmp(&b.re.abs())).unwrap();
            near(880.0 * TAU / 60.0 - critical.im, known["HMw880"], 1e-5);
        }
    }
}

#[test]
fn friction_moves_the_fold_of_the_rub() {
    let study = STUDY.replace("tolerance = 1e-8", "tolerance = 1e-8\nparameters = { mu = 0.1 }");
    let diagram = run(&study);
    let response = branch(&diagram, "response");
    let folds: Vec<f64> =
        response.special.iter().filter(|s| s.kind == Kind::Fold).map(|s| s.point.parameters[response.free]).collect();
    assert_eq!(folds.len(), 1, "{folds:?}");
    near(folds[0], reference()["FM0.1"], 1e-6);
}

fn foldline(arguments: &[&str]) -> (String, String, i32) {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let out = Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(root).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (text(out.stdout), text(out.stderr), out.status.code().unwrap())
}

#[test]
fn check_says_what_an_engineer_asks_of_a_rotor() {
    let (out, _, code) = foldline(&["check", "models/overhung-shaft.toml"]);
    assert_eq!(code, 0, "{out}");
    for expected in ["28 degrees of freedom", "isotropic", "natural frequencies at rest", "3.8"] {
        assert!(out.contains(expected), "{expected}\n{out}");
    }
}

/// Rows of a CSV table by column name.
fn table(arguments: &[&str]) -> Vec<HashMap<String, String>> {
    let (out, err, code) = foldline(&[arguments, &["--format", "csv"]].concat());
    assert_eq!(code, 0, "{err}");
    let mut lines = out.lines();
    let head: Vec<String> = lines.next().unwrap().split(',').map(str::to_string).collect();
    lines.map(|line| head.iter().cloned().zip(line.split(',').map(str::to_string)).collect()).collect()
}

#[test]
fn the_commands_for_rotors_print_numbers_and_draw_pictures() {
    let model = "models/overhung-shaft.toml";
    // Undamped critical speeds do not depend on the dampers: those of the rotor without them.
    let critical = table(&["critical-speeds", model, "--ratio", "2:1"]);
    let forward: Vec<f64> =
        critical.iter().filter(|row| row["whirl"] == "forward").map(|row| row["undamped"].parse().unwrap()).collect();
    near(forward[0], 890.77130165, 1e-7);
    near(forward[1], 6063.31298425, 1e-7);
    assert!(critical.iter().any(|row| row["kind"] == "2:1"), "{critical:?}");
    let campbell = table(&["campbell", model, "--speeds", "0:4000 rpm", "--count", "5", "--modes", "4"]);
    assert_eq!(campbell.len(), 20);
    let rotating =
        table(&["campbell", model, "--speeds", "0:4000 rpm", "--count", "5", "--modes", "4", "--frame", "rotating"]);
    for (fixed, rotating) in campbell.iter().zip(&rotating) {
        let number = |row: &HashMap<String, String>, name: &str| row[name].parse::<f64>().unwrap();
        let sign = if fixed["whirl"] == "backward" { -1.0 } else { 1.0 };
        let expected = sign * number(fixed, "frequency") - number(fixed, "Omega") / 60.0;
        assert!((number(rotating, "frequency") - expected).abs() < 1e-9, "{fixed:?} {rotating:?}");
    }
    // The response at one speed is the equilibrium of the model below contact.
    let response = table(&[
        "unbalance-response",
        model,
        "--speeds",
        "500:700",
        "--count",
        "2",
        "--probe",
        "6:90deg",
        "--amplitude",
        "m",
    ]);
    assert_eq!(response[0]["probe"], response[0]["y"]);
    let shapes = table(&["campbell", model, "--shapes", "--modes", "2"]);
    assert_eq!(shapes.len(), 14);
    let folder = tempfile::tempdir().unwrap();
    for command in ["campbell", "unbalance-response"] {
        let file = folder.path().join(format!("{command}.svg"));
        let (_, err, code) = foldline(&[command, model, "-o", file.to_str().unwrap()]);
        assert_eq!(code, 0, "{err}");
        assert!(std::fs::read_to_string(file).unwrap().contains("<svg"));
    }
}

#[test]
fn commands_for_rotors_refuse_what_is_no_rotor() {
    let (_, err, code) = foldline(&["campbell", "models/duffing.toml"]);
    assert_eq!(code, 2);
    assert!(err.contains("[rotor]"), "{err}");
    let (_, err, code) = foldline(&["campbell", "models/overhung-shaft.toml", "--speeds", "0:5 kg"]);
    assert_eq!(code, 2);
    assert!(err.contains("not a range of speeds"), "{err}");
}

#[test]
fn overdamped_motions_are_not_among_the_lowest_modes() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("m.toml");
    // Internal damping makes motions of the short elements overdamped: real at rest, and turning with the shaft otherwise.
    let text = r#"
[parameters]
Om = 100.0
[rotor]
speed = "Om"
frame = "fixed"
[[material]]
name = "m"
E = 2.046e11
nu = 0.313
density = 3266.0
internal-damping = 1.93e-5
[[shaft]]
length = 0.692
elements = 2
diameter = 0.0529
material = "m"
[[shaft]]
length = 0.207
elements = 3
diameter = 0.0387
material = "m"
[[disc]]
node = 3
mass = 27.883
Id = 0.40647
Ip = 0.33215
[[bearing]]
node = 0
k = 2.5e7
c = 536.3
[[bearing]]
node = 1
k = 1.1e6
c = 100.4
"#;
    std::fs::write(&model, text).unwrap();
    let typed = |modes| {
        let speeds = ["--speeds", "0:400", "--count", "2", "--modes", modes, "--format", "csv"];
        foldline(&[&["campbell", model.to_str().unwrap()][..], &speeds].concat())
    };
    let (out, err, code) = typed("4");
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("real eigenvalues at Om = 0 rad/s"), "{err}");
    let rows: Vec<Vec<&str>> = out.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 8, "{out}");
    let number = |row: &[&str], column: usize| row[column].parse::<f64>().unwrap();
    for row in &rows {
        assert!(number(row, 5) < 0.5, "a mode that oscillates: {row:?}");
    }
    // At rest both directions of whirl have one frequency.
    for pair in rows[..4].chunks(2) {
        assert!((number(&pair[0], 3) / number(&pair[1], 3) - 1.0).abs() < 1e-9, "{pair:?}");
    }
    // All modes are listed in the end, the overdamped ones of the turning shaft among them.
    let (out, ..) = typed("100");
    let turning = out.lines().skip(1).filter(|line| line.starts_with("400")).count();
    assert_eq!(turning, 22, "{out}");
}
