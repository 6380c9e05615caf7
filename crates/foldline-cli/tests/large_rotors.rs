//! Bouncing motions of a rotor of 28 degrees of freedom, and its responses under gravity, against an independent harmonic balance.

use foldline::contract::Unobserved;
use foldline::diagram::{Cycle, Diagram, Kind, Point};
use foldline::explore::{self, System};
use foldline_store::study_file::parse_study;
use std::collections::HashMap;
use std::f64::consts::TAU;

const MODEL: &str = include_str!("../../../models/overhung-shaft.toml");
const CLEARANCE: f64 = 0.3e-3;
/// Index of the output r_6 among the ranges of a point: outputs follow 56 states.
const RADIUS: usize = 56;

/// The first solution of the only branch of a study about this model.
#[track_caller]
fn start(model: &str, seed: &str) -> Point {
    let text = format!(
        "model = \"m\"\ntolerance = 1e-6\n[[seed]]\nname = \"s\"\n{seed}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\n\
         range = [\"100 rpm\", \"9000 rpm\"]\nmax-points = 1\n"
    );
    let study = parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let diagram =
        explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved);
    let branch = diagram.branch("b").unwrap();
    branch.points.iter().find(|point| point.position == 0).cloned().unwrap_or_else(|| panic!("no start: {seed}"))
}

fn cycle(point: &Point) -> &Cycle {
    match &point.solution {
        foldline::diagram::Solution::Cycle(cycle) => cycle,
        _ => panic!("no cycle"),
    }
}

/// Values of a reference table, by their name.
fn reference(table: &'static str) -> HashMap<&'static str, f64> {
    let rows = table.lines().filter(|line| !line.starts_with('#')).skip(1);
    let value = |row: &'static str| {
        // Commas occur inside quotation marks.
        let parts: Vec<&str> =
            row.split('"').enumerate().filter(|(k, _)| k % 2 == 0).flat_map(|(_, part)| part.split(',')).collect();
        let number = parts.iter().skip(1).find_map(|cell| cell.parse::<f64>().ok());
        (row.split(',').next().unwrap(), number.unwrap())
    };
    rows.map(value).collect()
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() < tolerance, "{found} instead of {expected}");
}

#[test]
fn bouncing_cycles_are_found_from_the_ratio_alone() {
    let known = reference(include_str!("reference/fe_bouncing.csv"));
    let point = start(MODEL, "attractor = \"2:1\"\nparameters = { Omega = \"4400 rpm\" }");
    let of = |what: &str| known[format!("SL4400s-{what}").as_str()];
    near(point.solution.period().unwrap() / of("T"), 1.0, 1e-8);
    near(point.ranges[RADIUS][1] / CLEARANCE / of("rmax"), 1.0, 1e-4);
    near(point.ranges[RADIUS][0] / CLEARANCE, of("rmin"), 2e-4);
    let leading = point.free_spectrum().iter().map(|z| z.norm()).fold(0.0, f64::max);
    near(leading / of("|mu| of leading pair"), 1.0, 3e-3);
    assert_eq!(point.unstable, 0);
}

#[test]
fn responses_under_gravity_have_the_harmonics_of_the_reference() {
    let known = reference(include_str!("reference/fe_gravity.csv"));
    let anisotropic = MODEL
        .replace("speed = \"Omega\"", "speed = \"Omega\"\ngravity = \"on\"")
        .replace("k = \"1e7 N/m\"", "kxx = \"1e7 N/m\"\nkyy = \"4e6 N/m\"");
    let ring = anisotropic.replace("value = \"0.3 mm\"", "value = \"1.3 mm\"");
    let point = start(&ring, "state = \"zero\"\nparameters = { Omega = \"440 rpm\" }");
    // Displacements of node 6 are the states 4·6·2 and the next but one.
    let states = cycle(&point).uniform(4096);
    let harmonic = |at: usize, k: f64| {
        let samples = states.chunks_exact(56).enumerate();
        let parts = samples.map(|(t, x)| (TAU * k * t as f64 / 4096.0, x[at]));
        let (re, im) = parts.fold((0.0, 0.0), |(re, im), (a, x)| (re + x * a.cos(), im + x * a.sin()));
        if k == 0.0 { re / 4096.0 } else { re.hypot(im) / 2048.0 }
    };
    for (what, at, k) in [("mean y", 50, 0.0), ("|x| at 1x", 48, 1.0), ("|y| at 1x", 50, 1.0), ("|x| at 2x", 48, 2.0)] {
        let expected = 1e-3 * known[format!("GR-contact-440-{what}").as_str()];
        let found = harmonic(at, k);
        assert!((found / expected - 1.0).abs() < 1e-5, "{what}: {found} instead of {expected}");
    }
}

const FILM: &str = r#"
name = "disc on a squeeze-film damper"
description = "Disc of 25 kg on a flexible shaft, whose journal of 2 kg is centred in a film by a retainer spring."
source = "short bearing"

[parameters]
Omega = { value = "3000 rpm", description = "speed of the shaft" }
U = { value = 0.5, description = "eccentricity of the disc over the clearance" }

[rotor]
speed = "Omega"

[rotor.matrices]
positions = [0.0, 0.5]
M = [[25, 0, 0, 0, 0, 0, 0, 0], [0, 25, 0, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0, 0, 0], [0, 0, 0, 1, 0, 0, 0, 0],
     [0, 0, 0, 0, 2, 0, 0, 0], [0, 0, 0, 0, 0, 2, 0, 0], [0, 0, 0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 0, 0, 0, 1]]
K = [[1e7, 0, 0, 0, -1e7, 0, 0, 0], [0, 1e7, 0, 0, 0, -1e7, 0, 0], [0, 0, 1e4, 0, 0, 0, 0, 0], [0, 0, 0, 1e4, 0, 0, 0, 0],
     [-1e7, 0, 0, 0, 1.2e7, 0, 0, 0], [0, -1e7, 0, 0, 0, 1.2e7, 0, 0], [0, 0, 0, 0, 0, 0, 1e4, 0], [0, 0, 0, 0, 0, 0, 0, 1e4]]
C = [[100, 0, 0, 0, 0, 0, 0, 0], [0, 100, 0, 0, 0, 0, 0, 0], [0, 0, 10, 0, 0, 0, 0, 0], [0, 0, 0, 10, 0, 0, 0, 0],
     [0, 0, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0, 10, 0], [0, 0, 0, 0, 0, 0, 0, 10]]

[[unbalance]]
node = 0
amount = "25*0.1e-3*U"

[[film]]
node = 1
clearance = "0.1 mm"
radius = "50 mm"
length = "20 mm"
viscosity = "0.02 Pa s"
"#;

#[test]
fn a_squeeze_film_makes_the_response_jump() {
    let known = reference(include_str!("reference/fe_squeeze_film.csv"));
    let text = "model = \"m\"\ntolerance = 1e-8\n[[seed]]\nname = \"slow\"\nstate = \"zero\"\nparameters = { Omega = \"500 rpm\" }\n\
                [[branch]]\nname = \"response\"\nfrom = \"slow\"\nfree = \"Omega\"\nrange = [\"500 rpm\", \"9000 rpm\"]\n\
                mark = { Omega = [\"3000 rpm\", \"5800 rpm\", \"8000 rpm\"] }\n";
    let study = parse_study(text, "study", FILM, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let diagram =
        explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved);
    let branch = diagram.branch("response").unwrap();
    let output = study.model.outputs.iter().position(|own| own.name == "eccentricity_film").unwrap();
    let seen = |kind: Kind| -> Vec<(f64, f64, usize)> {
        let own = branch.special.iter().filter(|s| s.kind == kind);
        let mut list: Vec<(f64, f64, usize)> = own
            .map(|s| {
                (
                    s.point.parameters[branch.free],
                    s.point.ranges[study.model.states.len() + output][1],
                    s.unstable_before,
                )
            })
            .collect();
        list.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        list
    };
    let folds = seen(Kind::Fold);
    assert_eq!(folds.len(), 2, "{folds:?}");
    for (found, name) in folds.iter().zip(["lower", "upper"]) {
        near(found.0 / known[format!("SFD U=.5-{name}").as_str()], 1.0, 1e-6);
        near(found.1 / known[format!("SFD U=.5-{name}e").as_str()], 1.0, 1e-4);
    }
    let marks = seen(Kind::Mark);
    let names = ["3000-1", "5800-1", "5800-2", "5800-3", "8000-1"];
    assert_eq!(marks.len(), names.len(), "{marks:?}");
    for (found, name) in marks.iter().zip(names) {
        near(found.1 / known[format!("SFD U=.5-{name}").as_str()], 1.0, 1e-7);
        assert_eq!(found.2 > 0, name == "5800-2", "{found:?}");
    }
}
