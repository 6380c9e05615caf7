//! Adaptive sections, kicks, and basin fractions over a parameter, against basins known in closed form.

use foldline::attractors::Fate;
use foldline::diagram::Solution;
use foldline::explore::System;
use foldline::explore::along::{AtValue, branch_of, shares_along};
use foldline::explore::basins::{Basins, Plane, basins};
use foldline::explore::kicks::{Kick, Kicking, kicks};
use foldline::explore::section::adaptive;
use foldline::model::Model;
use foldline_store::model_file::parse_model;
use foldline_store::run_file::{Part, load_part};
use std::process::Command;

/// The boundary is the line x = 0, between rest at x = ±1.
const SEPARATE: &str = "name = \"separate\"\n[states]\nx = { equation = \"x - x^3\", range = [-2, 2] }\n\
    y = { equation = \"-y\", range = [-2, 2] }\n";
/// In polar coordinates r' = r (r - 1) (2 - r): the boundary is the circle of radius 1, between rest and a cycle of radius 2.
const DISC: &str = "name = \"disc\"\n[states]\n\
    x = { equation = \"x*(sqrt(x^2 + y^2) - 1)*(2 - sqrt(x^2 + y^2)) - y\", range = [-3, 3] }\n\
    y = { equation = \"y*(sqrt(x^2 + y^2) - 1)*(2 - sqrt(x^2 + y^2)) + x\", range = [-3, 3] }\n";
/// Two wells with damping: each basin winds around the other.
const WELLS: &str = "name = \"wells\"\n[states]\nx = { equation = \"v\", range = [-3, 3] }\n\
    v = { equation = \"x - x^3 - 0.3*v\", range = [-3, 3] }\n";
const TOLERANCE: f64 = 1e-6;

fn model(text: &str) -> Model {
    parse_model(text, "m").unwrap_or_else(|found| panic!("{found:?}"))
}

fn plane(system: &System, cells: usize) -> Plane {
    Plane {
        axes: [0, 1],
        ranges: [system.ranges[0], system.ranges[1]],
        cells: [cells; 2],
        through: vec![0.0; system.ranges.len()],
    }
}

/// True if two sections with the same attractors in any order have the same fate in a cell.
fn same(a: &Basins, b: &Basins, cell: usize) -> bool {
    let start = |own: &Basins| match own.plane_fates[cell] {
        Fate::Settled(k) => match &own.attractors[k].point.solution {
            Solution::Equilibrium(state) => state.iter().map(|x| (x * 1e3).round()).collect(),
            Solution::Cycle(cycle) => vec![(cycle.period * 1e3).round()],
            Solution::Torus(_) => Vec::new(),
        },
        _ => vec![f64::INFINITY],
    };
    start(a) == start(b)
}

#[test]
fn an_adaptive_section_of_a_disc_is_exact_in_every_cell() {
    let model = model(DISC);
    let system = System::of(&model, &[]);
    let plane = plane(&system, 96);
    let found = adaptive(&system, &[], &plane, (0, 1), (2, TOLERANCE), 8);
    let filled = found.filled.as_ref().expect("it is adaptive");
    assert!(filled.computed < 96 * 96 / 2 && filled.wrong == 0 && filled.checked == 381, "{}", filled.computed);
    for (k, fate) in found.plane_fates.iter().enumerate() {
        let radius = plane.centre(0, k % 96).hypot(plane.centre(1, k / 96));
        let Fate::Settled(own) = fate else { panic!("{fate:?}") };
        let rest = matches!(found.attractors[*own].point.solution, Solution::Equilibrium(_));
        // No centre is so near to the circle that the integration error of 1e-6 per step could decide.
        assert_eq!(rest, radius < 1.0, "{radius}");
    }
}

#[test]
fn an_adaptive_section_of_winding_basins_agrees_with_the_full_one() {
    let model = model(WELLS);
    let system = System::of(&model, &[]);
    let plane = plane(&system, 128);
    let full = basins(&system, &[], Some(&plane), (0, 1), 2, TOLERANCE);
    let found = adaptive(&system, &[], &plane, (0, 1), (2, TOLERANCE), 8);
    let filled = found.filled.as_ref().expect("it is adaptive");
    assert_eq!(found.attractors.len(), 2);
    assert!(filled.computed < 128 * 128 * 2 / 3, "{}", filled.computed);
    let wrong = (0..128 * 128).filter(|k| !filled.known[*k] && !same(&full, &found, *k)).count();
    let count = filled.known.iter().filter(|known| !**known).count();
    let [_, most] = filled.error().interval();
    assert!(wrong as f64 <= most * count as f64, "{wrong} of {count}, at most {most}");
}

fn kicked(model: &Model, states: &[usize], directions: usize) -> Vec<Kick> {
    let parameters: Vec<f64> = model.parameters.iter().map(|own| own.value).collect();
    let system = System::of(model, &parameters);
    let found = basins(&system, &parameters, None, (64, 1), 2, TOLERANCE);
    let kicking = Kicking { states, directions, seed: 1 };
    let all = kicks(&system, &parameters, &found.attractors, &kicking, (2, TOLERANCE));
    all.into_iter().map(|own| own.unwrap_or_else(|why| panic!("{why}"))).collect()
}

#[test]
fn the_kick_out_of_a_half_plane_is_its_distance() {
    // The distance is 1, a quarter of the range, along x.
    for kick in kicked(&model(SEPARATE), &[0, 1], 64) {
        assert!((kick.size - 0.25).abs() <= kick.error && kick.error < 0.002, "{kick:?}");
        let size = kick.change[0].abs();
        // The angle at the end leaves a change of y of the same order: error = ½ d δ².
        assert!((size - 1.0).abs() < 0.01 && kick.change[1].abs() < 0.1, "{kick:?}");
        assert!(kick.size >= 0.25 - 1e-5, "a state that was seen to go elsewhere lies beyond the boundary");
    }
    for kick in kicked(&model(SEPARATE), &[0], 2) {
        assert!((kick.size - 0.25).abs() <= kick.error && kick.change[1] == 0.0, "{kick:?}");
    }
}

#[test]
fn the_kick_out_of_a_disc_is_its_radius_and_that_of_the_cycle_the_way_back() {
    let all = kicked(&model(DISC), &[0, 1], 64);
    assert_eq!(all.len(), 2);
    // 1 from rest to the circle, and 1 from the cycle inwards, in widths of 6.
    for kick in all {
        assert!((kick.size - 1.0 / 6.0).abs() <= kick.error && kick.error < 0.002, "{kick:?}");
    }
}

#[test]
fn kicks_in_three_directions_find_the_nearest_boundary() {
    let text = format!("{SEPARATE}z = {{ equation = \"-2*z\", range = [-2, 2] }}\n");
    for kick in kicked(&model(&text), &[0, 1, 2], 64) {
        assert!((kick.size - 0.25).abs() <= kick.error && kick.error < 0.005, "{kick:?}");
    }
}

#[test]
fn a_basin_that_nothing_leaves_has_no_kick() {
    let model = model("name = \"rest\"\n[states]\nx = { equation = \"-x\", range = [-1, 1] }\n");
    let system = System::of(&model, &[]);
    let found = basins(&system, &[], None, (16, 1), 1, TOLERANCE);
    let kicking = Kicking { states: &[0], directions: 2, seed: 1 };
    let why =
        kicks(&system, &[], &found.attractors, &kicking, (1, TOLERANCE))[0].clone().expect_err("nothing leaves it");
    assert!(why.contains("within the ranges"), "{why}");
}

fn along(model: &Model, values: &[f64]) -> Vec<AtValue> {
    let parameters: Vec<f64> = model.parameters.iter().map(|own| own.value).collect();
    shares_along(model, &parameters, (0, values), (400, 1), (2, TOLERANCE), &|_| ())
}

#[test]
fn the_branches_of_a_pitchfork_have_half_of_the_line_each_and_keep_their_numbers() {
    let model = model(
        "name = \"pitchfork\"\n[parameters]\na = 1\n[states]\nx = { equation = \"a*x - x^3\", range = [-2, 2] }\n",
    );
    let found = along(&model, &[-1.0, -0.6, -0.2, 0.2, 0.6, 1.0]);
    let numbers: Vec<Vec<usize>> = found.iter().map(|own| own.numbers.clone()).collect();
    assert_eq!(numbers[..3], [[0], [0], [0]]);
    for own in &found[..3] {
        assert_eq!(own.found.share(Fate::Settled(0)).value(), 1.0);
    }
    let mut sides = [None; 2];
    for own in &found[3..] {
        assert_eq!(own.numbers.len(), 2);
        for (k, number) in own.numbers.iter().enumerate() {
            let [low, high] = own.found.share(Fate::Settled(k)).interval();
            assert!(low <= 0.5 && 0.5 <= high, "{low} {high}");
            let Solution::Equilibrium(state) = &own.found.attractors[k].point.solution else { panic!("it rests") };
            let side = &mut sides[usize::from(state[0] > 0.0)];
            assert_eq!(*side.get_or_insert(*number), *number, "a side keeps its number");
        }
    }
    assert_ne!(sides[0], sides[1]);
}

#[test]
fn attractors_have_the_names_of_the_branches_on_which_they_lie() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let cusp =
        "name = \"cusp\"\n[parameters]\nmu = 0\n[states]\nx = { equation = \"mu + 3*x - x^3\", range = [-3, 3] }\n";
    std::fs::write(folder.path().join("m.toml"), cusp).expect("it can be written");
    let study = "model = \"m.toml\"\n[[seed]]\nname = \"low\"\nstate = { x = -1.7 }\n\
        [[branch]]\nname = \"lower\"\nfrom = \"low\"\nfree = \"mu\"\nrange = [-1, 1]\n";
    std::fs::write(folder.path().join("s.toml"), study).expect("it can be written");
    let run = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder.path()).output();
        let output = output.expect("it starts");
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    run(&["run", "s.toml"]);
    let text = run(&[
        "basins",
        "m.toml",
        "--along",
        "mu=-0.5:0.5",
        "--values",
        "3",
        "--branches",
        "runs/s",
        "--samples",
        "64",
    ]);
    let lower = text.lines().filter(|line| line.contains("lower")).count();
    let numbered = |line: &&str| line.contains("attractor 1") || line.contains("attractor 2");
    assert_eq!((lower, text.lines().filter(numbered).count()), (3, 3), "{text}");
    // The library says so, too: of the two equilibria at mu = 0, one lies on the branch.
    let diagram = load_part(&folder.path().join("runs/s"), Part::Numbers).expect("it can be read").diagram;
    let model = model(cusp);
    let system = System::of(&model, &[0.0]);
    for own in &along(&model, &[0.0])[0].found.attractors {
        let Solution::Equilibrium(state) = &own.point.solution else { panic!("it rests") };
        let name = branch_of(&diagram, 0, &own.point, &system.scales);
        assert_eq!(name, (state[0] < 0.0).then_some("lower"));
    }
}
