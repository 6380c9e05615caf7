//! Sensitivities of special points against finite differences of complete runs at changed parameters, and what the command
//! prints about them.

use foldline::diagram::{Diagram, Kind, SpecialPoint};
use foldline::explore::System;
use foldline::sensitivity::{Measured, Sensitivities, of_special};
use foldline_store::run_file::{Part, load_part};
use foldline_store::study_file::parse_study_of_run;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn foldline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap()
}

fn text(output: &Output) -> String {
    let text = [&output.stdout[..], &output.stderr[..]].concat();
    let text = String::from_utf8_lossy(&text).into_owned();
    assert!(!text.contains("panicked"), "{text}");
    text
}

/// A model of the repository with the branches of a study.
struct Case {
    model: &'static str,
    /// Parameters and their values.
    parameters: &'static [(&'static str, f64)],
    /// Seeds and branches.
    study: &'static str,
    /// The special points: branch, kind and about where.
    points: &'static [(&'static str, Kind, f64)],
    /// Parameters that are changed, and by which share of their value.
    changed: &'static [&'static str],
    share: f64,
    tolerance: f64,
}

impl Case {
    /// Runs the study with one parameter at another value.
    fn ran(&self, changed: Option<(&str, f64)>) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let value = |name: &str, value: f64| changed.filter(|own| own.0 == name).map_or(value, |own| own.1);
        let values: Vec<String> =
            self.parameters.iter().map(|(name, own)| format!("{name} = {:?}", value(name, *own))).collect();
        let model = root().join("models").join(self.model);
        let study = format!(
            "model = {:?}\ntolerance = {:e}\nparameters = {{ {} }}\n{}",
            model.to_str().unwrap(),
            self.tolerance,
            values.join(", "),
            self.study
        );
        std::fs::write(folder.path().join("s.toml"), study).unwrap();
        let output = foldline(folder.path(), &["run", "s.toml", "--out", "run"]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output));
        folder
    }

    fn points<'d>(&self, diagram: &'d Diagram) -> Vec<(usize, &'d SpecialPoint)> {
        let found = self.points.iter().map(|(name, kind, near)| {
            let (k, branch) =
                diagram.branches.iter().enumerate().find(|(_, own)| own.name == *name).expect("the branch");
            let off = |own: &SpecialPoint| (own.point.parameters[branch.free] - near).abs();
            let fitting = branch.special.iter().filter(|own| own.kind == *kind);
            let nearest = fitting.min_by(|a, b| off(a).total_cmp(&off(b)));
            (
                k,
                nearest.unwrap_or_else(|| {
                    panic!(
                        "{name} has no {kind}: {:?}",
                        branch.special.iter().map(|s| (s.kind, s.point.parameters[branch.free])).collect::<Vec<_>>()
                    )
                }),
            )
        });
        found.collect()
    }

    /// Compares the derivatives of the parameter of the branch, the period and the extremes with differences of fourth
    /// order.
    fn check(&self) {
        let base = self.ran(None);
        let run = load_part(&base.path().join("run"), Part::Everything).unwrap();
        let study = parse_study_of_run(&run.study_text, &run.study_file, &run.model_text, &run.model_file).unwrap();
        let system = System::of_plan(&study.model, &study.plan).in_units_of(&run.diagram);
        let found: Vec<Sensitivities> = self
            .points(&run.diagram)
            .into_iter()
            .map(|(k, special)| of_special(&system, &run.diagram.branches[k], special, &study.plan).unwrap())
            .collect();
        for name in self.changed {
            let parameter = study.model.parameter_index(name).unwrap();
            let value = self.parameters.iter().find(|own| own.0 == *name).unwrap().1;
            let step = self.share * value.abs();
            let runs: Vec<Diagram> = [-2.0, -1.0, 1.0, 2.0]
                .iter()
                .map(|k| {
                    let folder = self.ran(Some((name, value + k * step)));
                    load_part(&folder.path().join("run"), Part::Everything).unwrap().diagram
                })
                .collect();
            for (p, own) in found.iter().enumerate() {
                let free = run.diagram.branches[self.points(&run.diagram)[p].0].free;
                let of = |measured: Measured, diagram: &Diagram| -> f64 {
                    let special = self.points(diagram)[p].1;
                    match measured {
                        Measured::Parameter => special.point.parameters[free],
                        Measured::Period => special.point.solution.period().unwrap_or(f64::NAN),
                        Measured::Smallest(k) => special.point.ranges[k][0],
                        Measured::Largest(k) => special.point.ranges[k][1],
                        Measured::Angle => f64::NAN,
                    }
                };
                for row in &own.rows {
                    let v: Vec<f64> = runs.iter().map(|diagram| of(row.of, diagram)).collect();
                    let difference = (v[0] - 8.0 * v[1] + 8.0 * v[2] - v[3]) / (12.0 * step);
                    if !difference.is_finite() {
                        continue;
                    }
                    let exact = own.of(row.of, parameter).unwrap_or_else(|| panic!("{:?}: {:?}", row.of, row.by));
                    // The scale of a derivative: the number over the parameter.
                    let size = exact.value.abs().max(row.value.abs() / value.abs());
                    let off = (exact.value - difference).abs();
                    println!(
                        "{} {:?} {:?} by {name}: {:.9} ± {:.1e}, difference {:.9}: {:.1e}",
                        self.model,
                        self.points[p].1,
                        row.of,
                        exact.value,
                        exact.error,
                        difference,
                        off / size
                    );
                    // Extremes are known to the stated errors of the runs, which the difference amplifies.
                    let stated = match row.of {
                        Measured::Smallest(k) | Measured::Largest(k) => {
                            let scale = system.scales.get(k).copied().unwrap_or(1.0);
                            let error = |diagram: &Diagram| self.points(diagram)[p].1.error;
                            let worst = runs.iter().map(error).fold(0.0, f64::max);
                            1.5 * worst * (scale + row.value.abs()) / step
                        }
                        _ => 0.0,
                    };
                    assert!(
                        off <= 1e-6 * size + stated,
                        "{:?} {:?} by {name}: {exact:?}, {difference} ± {stated:.1e}",
                        self.points[p],
                        row.of
                    );
                }
            }
        }
    }
}

const ROTOR: Case = Case {
    model: "overhung-rotor.toml",
    parameters: &[("kappa", 1.0), ("zeta", 0.01), ("beta", 10.0), ("epsilon", 0.353)],
    study: "[[seed]]\nname = \"at 5\"\nattractor = \"2:1\"\nparameters = { Omega = 5 }\nsamples = 48\n\
            [[branch]]\nname = \"SL\"\nfrom = \"at 5\"\nfree = \"Omega\"\nrange = [3, 5.3]\n",
    points: &[("SL", Kind::Fold, 3.35), ("SL", Kind::PeriodDoubling, 4.86)],
    changed: &["zeta", "beta"],
    share: 2e-3,
    tolerance: 1e-9,
};

#[test]
fn folds_and_period_doublings_of_the_contact_rotor_agree_with_differences() {
    ROTOR.check();
}

#[test]
fn folds_and_torus_points_of_the_forced_oscillator_agree_with_differences() {
    Case {
        model: "van-der-pol-forced.toml",
        parameters: &[("mu", 0.5), ("Omega", 1.2)],
        study: "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 16\nparameters = { s = 1.0 }\n\
                [[branch]]\nname = \"far\"\nfrom = \"s\"\nfree = \"s\"\nrange = [0.5, 1.2]\n",
        points: &[("far", Kind::Torus, 0.7)],
        changed: &["mu", "Omega"],
        share: 4e-3,
        tolerance: 1e-9,
    }
    .check();
    Case {
        model: "duffing-forced.toml",
        parameters: &[("A", 0.06), ("zeta", 0.02)],
        study: "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 16\nparameters = { omega = 0.8 }\n\
                [[branch]]\nname = \"strong\"\nfrom = \"s\"\nfree = \"omega\"\nrange = [0.6, 2]\n",
        points: &[("strong", Kind::Fold, 1.2), ("strong", Kind::Fold, 1.6)],
        changed: &["A", "zeta"],
        share: 4e-3,
        tolerance: 1e-9,
    }
    .check();
}

#[test]
fn folds_and_hopf_points_of_equilibria_agree_with_differences() {
    Case {
        model: "co-oxidation.toml",
        parameters: &[("k", 0.4), ("q1", 2.5), ("q4", 0.0675)],
        study: "[[seed]]\nname = \"s\"\nattractor = \"equilibrium\"\nsamples = 16\nparameters = { q2 = 0.9 }\n\
                [[branch]]\nname = \"rest\"\nfrom = \"s\"\nfree = \"q2\"\nrange = [0.5, 2]\n",
        points: &[
            ("rest", Kind::Fold, 1.0522),
            ("rest", Kind::Fold, 1.042),
            ("rest", Kind::Hopf, 1.041),
            ("rest", Kind::Hopf, 1.0516),
        ],
        changed: &["k", "q1", "q4"],
        share: 2e-3,
        tolerance: 1e-10,
    }
    .check();
}

#[test]
fn folds_and_period_doublings_of_a_map_agree_with_differences() {
    Case {
        model: "henon.toml",
        parameters: &[("beta", 0.3)],
        study: "[[seed]]\nname = \"s\"\nattractor = \"fixed-point\"\n\
                [[branch]]\nname = \"fixed\"\nfrom = \"s\"\nfree = \"alpha\"\nrange = [-1, 2]\n\
                switch = { period-doubling = 1 }\n",
        points: &[
            ("fixed", Kind::Fold, -0.42),
            ("fixed", Kind::PeriodDoubling, 1.27),
            ("fixed/period-doubling-1", Kind::PeriodDoubling, 1.7),
        ],
        changed: &["beta"],
        share: 4e-3,
        tolerance: 1e-10,
    }
    .check();
}

/// A folder with a run of x' = a + b x - c x³ over a.
fn small(parameters: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let model = format!(
        "name = \"cubic\"\n[parameters]\na = -2.0\n{parameters}\n[states.x]\nequation = \"a + b*x - c*x^3\"\nrange = [-3, 3]\n"
    );
    std::fs::write(folder.path().join("m.toml"), model).unwrap();
    let study = "model = \"m.toml\"\n[[seed]]\nname = \"s\"\nstate = { x = -2.0 }\n\
                 [[branch]]\nname = \"rest\"\nfrom = \"s\"\nfree = \"a\"\nrange = [-2.5, 2.5]\nmark = { a = 1.0 }\n";
    std::fs::write(folder.path().join("s.toml"), study).unwrap();
    let output = foldline(folder.path(), &["run", "s.toml", "--out", "run"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    folder
}

#[test]
fn the_tables_contain_what_was_computed() {
    let folder = small("b = { value = 3.0, sigma = 0.03 }\nc = { value = 1.0, low = 0.9, high = 1.1 }");
    let json = |arguments: &[&str]| -> Vec<serde_json::Value> {
        let output = foldline(folder.path(), &[&["table", "run", "--format", "json"], arguments].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let rows = json(&["--sensitivities", "--of", "a", "--of", "x_max"]);
    let find = |kind: &str, quantity: &str, parameter: &str, sign: f64| {
        let fits = |row: &&serde_json::Value| {
            row["kind"] == kind
                && row["quantity"] == quantity
                && row["parameter"] == parameter
                && row["at"].as_f64().unwrap() * sign > 0.0
        };
        rows.iter().find(fits).unwrap_or_else(|| panic!("{kind} {quantity} {parameter}: {rows:?}"))
    };
    // b x = 3 x³ at folds: x = ∓1, a = ±2; da/db = -x, da/dc = x³; da/db b/a = 3/2.
    let own = find("fold", "a", "b", 1.0);
    assert!((own["derivative"].as_f64().unwrap() - 1.0).abs() < 1e-9);
    assert!((own["elasticity"].as_f64().unwrap() - 1.5).abs() < 1e-6);
    assert!((find("fold", "a", "c", 1.0)["derivative"].as_f64().unwrap() + 1.0).abs() < 1e-9);
    assert!((find("fold", "x_max", "b", -1.0)["derivative"].as_f64().unwrap() - 1.0 / 6.0).abs() < 1e-9);
    // A mark has none, which is said and is no failure.
    let mark = rows.iter().find(|row| row["kind"] == "mark").unwrap();
    assert!(mark["remark"].as_str().unwrap().contains("chosen in the study"), "{mark:?}");

    // At a = -2, x = -2 solves a + 3 x = x³: x_a = 1/(3 x² - 3), x_b = x/9, x_c = -x³/9.
    let rows = json(&["--sensitivities", "--branch", "rest", "--position", "0"]);
    let by = |name: &str| rows.iter().find(|row| row["parameter"] == name).unwrap()["derivative"].as_f64().unwrap();
    for (name, exact) in [("a", 1.0 / 9.0), ("b", -2.0 / 9.0), ("c", 8.0 / 9.0)] {
        assert!((by(name) - exact).abs() < 1e-10, "{name}: {}", by(name));
    }

    let rows = json(&["--uncertainty", "--samples", "400"]);
    let fold = rows.iter().find(|row| row["kind"] == "fold" && row["at"].as_f64().unwrap() > 0.0).unwrap();
    // (1 · 0.03)² + (1 · 0.2/√12)²
    let sigma = (0.03f64.powi(2) + 0.04 / 12.0).sqrt();
    assert!((fold["sigma"].as_f64().unwrap() - sigma).abs() < 1e-8, "{fold:?}");
    // N samples of two parameters are correlated by 1/√N at random, which changes σ by s₁ s₂/(σ √N): three times that.
    let allowed = 3.0 * 0.03 * (0.04f64 / 12.0).sqrt() / (sigma * 20.0);
    assert!((fold["sampled_sigma"].as_f64().unwrap() - sigma).abs() < allowed, "{fold:?}");
    assert_eq!((fold["samples"].as_i64(), fold["failed"].as_i64()), (Some(400), Some(0)));

    let output = foldline(folder.path(), &["export", "run", "--format", "csv", "--sensitivities"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    let csv = std::fs::read_to_string(folder.path().join("run/csv/sensitivities.csv")).unwrap();
    assert!(csv.contains("derivative") && csv.contains("x_max"), "{csv}");

    for (arguments, marks) in [(&["--tornado", "a"][..], "± 0.03"), (&["--uncertainty"][..], "standard deviations")] {
        let output = foldline(folder.path(), &[&["plot", "run", "-o", "p.svg"], arguments].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output));
        let picture = std::fs::read_to_string(folder.path().join("p.svg")).unwrap();
        assert!(picture.contains(marks), "{picture}");
    }
}

#[test]
fn mistakes_are_answered_with_their_cause() {
    let folder = small("b = 3.0\nc = 1.0");
    for (arguments, code, expected) in [
        (&["table", "run", "--uncertainty"][..], 2, "no parameter of the run is uncertain"),
        (&["table", "run", "--sensitivities", "--of", "x_mix"][..], 2, "there is no number \"x_mix\""),
        (&["table", "run", "--sensitivities", "--unit", "a=m"][..], 2, "--unit does not apply"),
        (&["table", "run", "--of", "a"][..], 2, "--of applies to"),
        (&["table", "run", "--sensitivities", "--branch", "rest", "--position", "999"][..], 2, "has no point 999"),
        (&["table", "run", "--branch", "rest", "--position", "1"][..], 2, "--position applies to"),
        (&["plot", "run", "--uncertainty", "-o", "p.svg"][..], 2, "no parameter of the run is uncertain"),
        (&["plot", "run", "--tornado", "y", "-o", "p.svg"][..], 2, "there is no number \"y\""),
        (&["plot", "run", "--tornado", "a", "--at", "rest:7", "-o", "p.svg"][..], 2, "no such special point"),
        (&["plot", "run", "--tornado", "a", "--at", "nothing:1", "-o", "p.svg"][..], 2, "no branch \"nothing\""),
        (&["export", "run", "--format", "netcdf", "--sensitivities"][..], 2, "no table of sensitivities"),
    ] {
        let output = foldline(folder.path(), arguments);
        let said = text(&output);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(said.contains(expected), "{arguments:?}: {said}");
    }
    for (entry, expected) in [
        ("{ value = 3.0, sigma = 0.0 }", "`sigma` of `b` is not positive"),
        ("{ value = 3.0, sigma = 0.1, low = 2.0, high = 4.0 }", "a standard deviation and a range"),
        ("{ value = 3.0, low = 2.0 }", "has `low` but no `high`"),
        ("{ value = 3.0, low = 4.0, high = 2.0 }", "`low` of `b` is not below `high`"),
    ] {
        std::fs::write(
            folder.path().join("wrong.toml"),
            format!("[parameters]\na = 1.0\nb = {entry}\nc = 1.0\n[states.x]\nequation = \"a + b*x - c*x^3\"\n"),
        )
        .unwrap();
        let said = text(&foldline(folder.path(), &["check", "wrong.toml"]));
        assert!(said.contains(expected), "{said}");
        let study = std::fs::read_to_string(folder.path().join("s.toml")).unwrap();
        let study = format!("parameters = {{ b = {entry} }}\n{study}");
        std::fs::write(folder.path().join("wrong.toml"), study).unwrap();
        let said = text(&foldline(folder.path(), &["check", "wrong.toml"]));
        assert!(said.contains(expected), "{said}");
    }
}
