//! Units in files and arguments: which are refused and which pass, values with units, results in other units, limits on
//! trajectories.

use std::path::Path;
use std::process::{Command, Output};

fn foldline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap()
}

fn printed(folder: &Path, arguments: &[&str]) -> String {
    let run = foldline(folder, arguments);
    assert_eq!(run.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&run.stderr));
    String::from_utf8(run.stdout).unwrap()
}

/// Returns the exit code of `foldline check` on a model, and both streams.
fn checked(model: &str) -> (Option<i32>, String) {
    let desk = tempfile::tempdir().unwrap();
    std::fs::write(desk.path().join("m.toml"), model).unwrap();
    let run = foldline(desk.path(), &["check", "m.toml"]);
    (run.status.code(), [run.stdout, run.stderr].map(|bytes| String::from_utf8(bytes).unwrap()).concat())
}

const SPRING: &str =
    "[parameters]\nk = { value = 100.0, unit = \"N/m\" }\nm = { value = 1.0, unit = \"kg\" }\n[states]\n";

/// Each is refused with its place and the two units in the message.
#[test]
fn contradictory_units_are_refused_with_place_and_both_units() {
    let spring = |x: &str, v: &str| format!("{SPRING}x = {x}\nv = {v}\n");
    let plain = r#"{ equation = "v", unit = "m" }"#;
    let right = r#"{ equation = "-k*x/m", unit = "m/s" }"#;
    let cases = [
        (spring(plain, r#"{ equation = "0", unit = "kg" }"#), "m.toml:5:19", ["m/s", "kg"]),
        (spring(r#"{ equation = "v", unit = "mm" }"#, r#"{ equation = "0", unit = "m/s" }"#), "m.toml:5:19", ["mm/s", "m/s"]),
        (spring(plain, r#"{ equation = "-k*x", unit = "m/s" }"#), "m.toml:6:19", ["m/s^2", "N"]),
        (spring(plain, right) + "[outputs]\nF = { expression = \"k*x\", unit = \"J\" }\n", "m.toml:8:21", ["J", "N"]),
        (spring(plain, right) + "[outputs]\nF = \"k*x + m*v\"\n", "m.toml:8:12", ["N", "kg m/s"]),
        (spring(plain, right) + "[outputs]\nF = \"sin(x)\"\n", "m.toml:8:10", ["sin", "rad"]),
        (spring(plain, right) + "[outputs]\nF = \"if(x > m, 1, 0)\"\n", "m.toml:8:9", ["m", "kg"]),
        (spring(r#"{ equation = "v", unit = "m", range = ["-5 mm", "5 s"] }"#, right), "m.toml:5:53", ["in s", "to m"]),
        (
            "[parameters]\nf = { value = 5, unit = \"Hz\" }\na = { value = 1, unit = \"m/s\" }\n[forcing]\nfrequency = \"f\"\n\
             [states]\nx = { equation = \"-f*x + a\", unit = \"m\" }\n"
                .into(),
            "m.toml:5:14",
            ["rad/s", "Hz"],
        ),
        (
            "[parameters]\nR = { value = 1e3, unit = \"Ohm\" }\nC = { value = 1e-6, unit = \"F\" }\nE = { value = 5, unit = \"V\" }\n\
             [states]\nu = { equation = \"(E - u)/(R*C)\", unit = \"mV\" }\n"
                .into(),
            "m.toml:6:24",
            ["V", "mV"],
        ),
    ];
    for (model, place, units) in cases {
        let (code, said) = checked(&model);
        assert_eq!(code, Some(2), "{model}\n{said}");
        assert!(said.contains(place) && said.contains("= help: "), "{model}\n{said}");
        let first = said.lines().next().unwrap();
        assert!(units.iter().all(|unit| first.contains(unit)), "{first}");
        // With units as mere labels nothing is checked, but converted values still have to fit.
        let (code, said) = checked(&format!("units = \"labels\"\n{model}"));
        assert_eq!(code, Some(if model.contains("5 s\"") { 2 } else { 0 }), "{said}");
    }
}

#[test]
fn correct_models_of_several_fields_pass() {
    let cases = [
        // Mechanics: a cart with a pendulum, coupled masses.
        r#"
[parameters]
M = { value = 2.0, unit = "kg" }
m = { value = 1.0, unit = "kg" }
l = { value = 0.5, unit = "m" }
g = { value = 9.81, unit = "m/s^2" }
k = { value = 100.0, unit = "N/m" }
c = 1.0
[states]
"x''" = { equation = "m*l*sin(phi)*phi'^2 - k*x - c*x'", unit = "m" }
"phi''" = { equation = "-m*g*l*sin(phi)", unit = "rad" }
[mass]
x = { x = "M + m", phi = "m*l*cos(phi)" }
phi = { x = "m*l*cos(phi)", phi = "m*l^2" }
"#,
        // A chain of springs, each with its own stiffness.
        r#"
[constants]
n = 3
[parameters]
m = { value = 1.0, unit = "kg" }
k = { values = ["1 kN/m", "1.1 kN/m", "0.9 kN/m"], unit = "N/m" }
[states.x]
count = "n"
equation = "v[i]"
before = 0
after = "x[n]"
unit = "m"
[states.v]
count = "n"
equation = "k[i]*(x[i+1] - 2*x[i] + x[i-1])/m"
unit = "m/s"
[outputs]
mean = { expression = "sum(j, 1, n, x[j])/n", unit = "m" }
"#,
        // Unbalance, speed in rpm, eccentricity in micrometres.
        r#"
[parameters]
n = { value = 500, unit = "rpm" }
m = { value = 20, unit = "kg" }
k = { value = 2, unit = "kN/mm" }
c = { value = 150, unit = "N s/m" }
e = { value = 10, unit = "um" }
[forcing]
frequency = "2*pi*n/60"
[definitions]
Om = "2*pi*n/60"
[states]
x = { equation = "v", unit = "m" }
v = { equation = "1e-6*e*Om^2*cos(Om*t) - c/m*v - 1e6*k/m*x", unit = "m/s" }
"#,
        // Electronics.
        r#"
[parameters]
Is = { value = "10 nA", unit = "A" }
VT = "25.85 mV"
R = { value = "1 kOhm", unit = "Ohm" }
C = { value = "100 nF", unit = "F" }
E = { value = 5, unit = "V" }
[functions]
"diode(v)" = "Is*expm1(1000*v/(1.8*VT))"
[states]
v = { equation = "((E - v)/R - diode(v))/C", unit = "V", range = [0, 1] }
"#,
        // Neurons: Morris and Lecar 1981, in mV, ms, µA/cm² and mS/cm².
        r#"
[parameters]
C = { value = 20, unit = "uF/cm^2" }
gCa = { value = 4.4, unit = "mS/cm^2" }
VCa = { value = 120, unit = "mV" }
VL = { value = -60, unit = "mV" }
V1 = { value = -1.2, unit = "mV" }
V2 = { value = 18, unit = "mV" }
phi = { value = 0.04, unit = "1/ms" }
I = { value = 90, unit = "uA/cm^2" }
[definitions]
minf = "(1 + tanh((v - V1)/V2))/2"
[states]
v = { equation = "(I - gCa*minf*(v - VCa) - gCa*w*(v - VL))/C", unit = "mV", range = [-70, 50] }
w = { equation = "phi*cosh((v - V1)/(2*V2))*(minf - w)", unit = "1", range = [0, 1] }
"#,
        // Chemistry: a stirred tank, energies per kJ/mol.
        r#"
[parameters]
q = { value = 100, unit = "l/min" }
V = { value = 100, unit = "l" }
cf = { value = 1, unit = "mol/l" }
k0 = { value = 7.2e10, unit = "1/min" }
E = { value = 72.75, unit = "kJ/mol" }
R = { value = 8.314, unit = "J/(mol K)" }
T = { value = 350, unit = "K" }
[states]
c = { equation = "q/V*(cf - c) - k0*exp(-1000*E/(R*T))*c", unit = "mol/l", range = [0, 1] }
"#,
        // Biology: unknown unit names, and a Hill function whose exponent is a parameter.
        r#"
[functions]
"hill(x, K, n)" = "x^n/(K^n + x^n)"
[parameters]
n = 2.5
K = { value = 3, unit = "cells/ml" }
k = { value = 1, unit = "cells/(ml h)" }
d = { value = 0.1, unit = "1/h" }
[states]
c = { equation = "k*(1 - hill(c, K, n)) - d*c", unit = "cells/ml", range = [0, 10] }
"#,
    ];
    for model in cases {
        let (code, said) = checked(model);
        assert_eq!(code, Some(0), "{model}\n{said}");
        assert!(!said.contains("stand for"), "{said}");
        assert_eq!(said.contains("unknown units"), model.contains("cells"), "{said}");
    }
    // Units for some quantities only, and an unwritten mass of 1: reported, not refused.
    let (code, said) = checked(&format!("{SPRING}x = \"v\"\nv = \"-k*x/m\"\ny = \"w\"\nw = \"-k*y\"\n"));
    assert!(code == Some(0) && said.contains("note: ") && said.contains("m.toml:8:6"), "{said}");
}

const MOUNT: &str = r#"
[parameters]
m = { value = 2.0, unit = "kg" }
c = { value = 8.0, unit = "N s/m" }
k = { value = "0.8 N/mm", unit = "N/m" }
F = { value = 4.0, unit = "N" }
Omega = { value = "150 rpm", unit = "rad/s" }
w0 = { value = 20.0, unit = "rad/s" }
[forcing]
frequency = "Omega"
[states."x''"]
equation = "(-c*x' - k*x + F*cos(Omega*t))/m"
unit = "m"
range = ["-50 mm", "50 mm"]
velocity = { unit = "m/s", range = [-1, 1] }
[outputs]
X = { expression = "x", unit = "m" }
order = { expression = "w0", unit = "rad/s" }
"#;
const SPEED: &str = r#"model = "mount.toml"
[[seed]]
name = "slow"
attractor = "cycle"
[[branch]]
name = "speed"
from = "slow"
free = "Omega"
range = ["100 rpm", "200 rpm"]
mark = { Omega = ["180 rpm"] }
"#;

/// |X| = F/|k - mΩ² + icΩ|.
fn amplitude(omega: f64) -> f64 {
    4.0 / (800.0 - 2.0 * omega * omega).hypot(8.0 * omega)
}

#[test]
fn a_run_is_shown_in_any_unit() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    std::fs::write(folder.join("mount.toml"), MOUNT).unwrap();
    std::fs::write(folder.join("speed.toml"), SPEED).unwrap();
    let text = printed(folder, &["run", "speed.toml", "--out", "run", "--jobs", "1", "--unit", "X=mm"]);
    assert!(text.contains("Omega [rad/s]") && text.contains("X_max [mm]") && text.contains("period [s]"), "{text}");

    let row = |units: &[&str]| -> Vec<(String, String)> {
        let csv = printed(folder, &[&["table", "run", "--format", "csv"], units].concat());
        let mut lines = csv.lines().map(|line| line.split(',').map(str::to_string).collect::<Vec<_>>());
        lines.next().unwrap().into_iter().zip(lines.next().unwrap()).collect()
    };
    let number = |row: &[(String, String)], name: &str| -> f64 {
        row.iter().find(|(own, _)| own == name).unwrap().1.parse().unwrap()
    };
    let own = row(&[]);
    let omega = 6.0 * std::f64::consts::PI;
    assert!((number(&own, "Omega") / omega - 1.0).abs() < 1e-9);
    assert!((number(&own, "X_max") / amplitude(omega) - 1.0).abs() < 1e-6);
    let shown = row(&["--unit", "Omega=rpm", "--unit", "X=mm", "--unit", "period=ms", "--unit", "order=orders:Omega"]);
    assert!((number(&shown, "Omega") - 180.0).abs() < 1e-9);
    assert!((number(&shown, "X_max") / (1e3 * amplitude(omega)) - 1.0).abs() < 1e-6);
    assert!((number(&shown, "period") - 1e3 / 3.0).abs() < 1e-9);
    assert!((number(&shown, "order_max") / (20.0 / omega) - 1.0).abs() < 1e-9);
    // The error is relative and therefore unchanged.
    assert_eq!(number(&own, "error"), number(&shown, "error"));
    let branches = printed(folder, &["table", "run", "--branches", "--format", "csv", "--unit", "Omega=rpm"]);
    assert!(branches.contains("100") && branches.contains("200"), "{branches}");

    printed(folder, &["plot", "run", "--unit", "Omega=rpm", "--unit", "X=mm", "-o", "p.svg"]);
    let svg = std::fs::read_to_string(folder.join("p.svg")).unwrap();
    assert!(svg.contains("Ω [rpm]") && svg.contains("max X [mm]"), "{svg}");
    printed(folder, &["export", "run", "--format", "csv", "--out", "csv", "--unit", "Omega=rpm"]);
    let special = std::fs::read_to_string(folder.join("csv/special_points.csv")).unwrap();
    let column = special.lines().next().unwrap().split(',').position(|name| name == "Omega").unwrap();
    let value: f64 = special.lines().nth(1).unwrap().split(',').nth(column).unwrap().parse().unwrap();
    assert!((value - 180.0).abs() < 1e-9, "{special}");

    for (wish, said) in [
        ("Omega=kg", "the dimensions differ"),
        ("Omega", "`=` and a unit are missing"),
        ("Omeg=rpm", "did you mean `Omega`"),
        ("X=orders:Omega", "the dimensions differ"),
        ("Omega=orders:speed", "not a parameter"),
    ] {
        let run = foldline(folder, &["table", "run", "--unit", wish]);
        let message = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(2), "{message}");
        assert!(message.contains(said), "{wish}: {message}");
    }
    // A unit that does not fit is refused before anything is computed.
    let run = foldline(folder, &["run", "speed.toml", "--out", "other", "--unit", "Omega=kg"]);
    assert_eq!(run.status.code(), Some(2));
    assert!(!folder.join("other").exists());
}

#[test]
fn values_in_a_study_must_fit_the_units_of_the_model() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    std::fs::write(folder.join("mount.toml"), MOUNT).unwrap();
    for (from, to, place, said) in [
        ("\"100 rpm\"", "\"100 mm\"", "s.toml:9:10", "mm, which cannot be converted to rad/s"),
        ("\"180 rpm\"", "\"180 Hz/s\"", "s.toml:10:19", "cannot be converted to rad/s"),
        (
            "name = \"slow\"",
            "name = \"slow\"\nparameters = { F = \"3 kg\" }",
            "s.toml:4:20",
            "kg, which cannot be converted to N",
        ),
        ("attractor = \"cycle\"", "state = { x = \"1 mm\", \"x'\" = \"fast\" }", "s.toml:4:30", "neither a number"),
    ] {
        std::fs::write(folder.join("s.toml"), SPEED.replace(from, to)).unwrap();
        let run = foldline(folder, &["check", "s.toml"]);
        let message = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(2), "{message}");
        assert!(message.contains(place) && message.contains(said), "{to}: {message}");
    }
}

const SETTLING: &str = "[parameters]\np = 1.0\n[states]\nx = { equation = \"p - x\", range = [-2, 2] }\n";
const SWEEPS: &str = "model = \"m.toml\"\n[[seed]]\nname = \"s\"\nattractor = \"equilibrium\"\n\
    [[sweep]]\nname = \"up\"\nfrom = \"s\"\nfree = \"p\"\nvalues = [1, 2, 3]\n\
    [[survey]]\nname = \"all\"\nfree = \"p\"\nvalues = [1, 2]\nstarts = 4\n";

#[test]
fn surveys_and_sweeps_obey_the_limits_on_trajectories() {
    let desk = tempfile::tempdir().unwrap();
    let folder = desk.path();
    std::fs::write(folder.join("m.toml"), SETTLING).unwrap();
    std::fs::write(folder.join("s.toml"), SWEEPS).unwrap();
    std::fs::write(folder.join("limited.toml"), format!("max-time = 0.3\n{SWEEPS}")).unwrap();
    let motions = |study: &str, out: &str, more: &[&str]| -> Vec<String> {
        foldline(folder, &[&["run", study, "--out", out, "--jobs", "1"], more].concat());
        let csv = printed(folder, &["table", out, "--responses", "--format", "csv"]);
        let column = csv.lines().next().unwrap().split(',').position(|name| name == "motion").unwrap();
        csv.lines().skip(1).map(|line| line.split(',').nth(column).unwrap().to_string()).collect()
    };
    let free = motions("s.toml", "free", &[]);
    assert!(free.iter().all(|motion| motion == "equilibrium"), "{free:?}");
    for (study, out, more) in [
        ("s.toml", "time", &["--max-time", "0.3"][..]),
        ("s.toml", "steps", &["--max-steps", "3"]),
        ("limited.toml", "stated", &[]),
    ] {
        let found = motions(study, out, more);
        assert!(!found.is_empty() && found.iter().any(|motion| motion == "other"), "{out}: {found:?}");
    }
    // The limits given on the command line belong to the run.
    let run = foldline(folder, &["run", "s.toml", "--out", "time", "--resume"]);
    assert_eq!(run.status.code(), Some(2));
    let run = foldline(folder, &["run", "s.toml", "--out", "time", "--resume", "--max-time", "0.3"]);
    assert_ne!(run.status.code(), Some(2), "{}", String::from_utf8_lossy(&run.stderr));
    let run = foldline(folder, &["run", "s.toml", "--out", "wrong", "--max-time", "3 kg"]);
    assert_eq!(run.status.code(), Some(2));
}
