//! Tori: against independent computations in `reference/tori.csv` (Newton's method on the invariant curve with high-order
//! integration, weighted averages over long trajectories, closed forms).

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Family, Kind, Point, Solution, SpecialPoint, Torus};
use foldline::explore::{self, System};
use foldline_store::study_file::{Study, parse_study};
use std::f64::consts::TAU;
use std::path::Path;

#[track_caller]
pub(crate) fn of(model: &str, study: &str) -> (Study, Diagram) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models").join(format!("{model}.toml"));
    let text = format!("model = \"m\"\n{study}");
    let model = std::fs::read_to_string(path).unwrap();
    let study = parse_study(&text, "study", &model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    drop(system);
    (study, diagram)
}

/// The values of a row, and the first of its tolerances.
#[track_caller]
fn known(id: &str) -> (Vec<f64>, f64) {
    let text = include_str!("reference/tori.csv");
    let row = text.lines().find(|line| line.starts_with(&format!("{id},"))).unwrap_or_else(|| panic!("{id}"));
    let mut cells = vec![String::new()];
    let mut quoted = false;
    for letter in row.chars() {
        match letter {
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            other => cells.last_mut().unwrap().push(other),
        }
    }
    let numbers = |cell: &str| -> Vec<f64> {
        cell.split([';', ',', ' ']).filter_map(|word| word.rsplit('=').next()?.parse().ok()).collect()
    };
    (numbers(&cells[5]), numbers(&cells[6])[0])
}

fn torus(point: &Point) -> &Torus {
    let Solution::Torus(torus) = &point.solution else { panic!("no torus") };
    torus
}

/// The second frequency equals the known one up to its sign and multiples of the first.
#[track_caller]
fn turns_at(point: &Point, id: &str) {
    let (values, within) = known(id);
    let [first, second] = torus(point).frequencies();
    let off = |sign: f64| {
        let gap = (sign * second - values[0]) / first;
        (gap - gap.round()).abs() * first
    };
    assert!(off(1.0).min(off(-1.0)) <= within, "{id}: {second} and {first} are not {values:?}");
}

/// Largest exponent besides those along the torus.
fn exponent(point: &Point) -> f64 {
    let most = point.free_spectrum().iter().map(|z| z.norm().ln()).fold(f64::NEG_INFINITY, f64::max);
    most / torus(point).period
}

#[track_caller]
fn near(value: f64, known: f64, within: f64) {
    assert!((value - known).abs() <= within, "{value} is not {known}");
}

#[track_caller]
fn mark(branch: &Branch, index: usize, value: f64) -> &SpecialPoint {
    let there = |s: &&SpecialPoint| s.kind == Kind::Mark && (s.point.parameters[index] - value).abs() < 1e-9;
    branch
        .special
        .iter()
        .find(there)
        .unwrap_or_else(|| panic!("no mark at {value} on {}: {:?}", branch.name, branch.ends))
}

#[test]
fn a_torus_leaves_the_entrained_motion_of_a_van_der_pol_oscillator() {
    let (study, diagram) = of(
        "van-der-pol-forced",
        "tolerance = 1e-7\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nparameters = { s = 1, Omega = 1.2 }\nsamples = 16\n\
         [[branch]]\nname = \"c\"\nfrom = \"s\"\nfree = \"s\"\nrange = [0.25, 1.2]\nswitch = { torus = 1 }\n\
         mark = { s = [0.3, 0.7, 0.74] }",
    );
    let s = study.model.parameter_index("s").unwrap();
    let parent = diagram.branch("c").unwrap();
    let born = parent.special.iter().find(|special| special.kind == Kind::Torus).unwrap();
    near(born.point.parameters[s], known("A1-NS").0[0], 1e-7);
    let branch = diagram.branch("c/torus-1").unwrap();
    assert_eq!(branch.family, Family::Torus);
    assert!(matches!(branch.ends[0], Some(Ending::Joined { at: Kind::Torus, .. })));
    near(torus(&branch.points[0]).rotation * TAU, known("A1-NS").0[1], 1e-6);
    for (value, name) in [(0.3, "A1-1.2-0.3"), (0.7, "A1-1.2-0.7")] {
        let there = &mark(branch, s, value).point;
        turns_at(there, &format!("{name}-freq"));
        let [low, high] = there.ranges[0];
        near(high.max(-low), known(&format!("{name}-max")).0[0], 2e-6);
        near(exponent(there), known(&format!("{name}-exp")).0[0], 1e-6);
        assert_eq!(there.unstable, 0);
    }
    turns_at(&mark(branch, s, 0.74).point, "A1-1.2-0.74");
}

#[test]
fn a_horizontal_rotor_whirls_beyond_its_torus_point() {
    let (study, diagram) = of(
        "laval-rotor",
        "tolerance = 1e-7\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nparameters = { eta = 1.6 }\nsamples = 8\n\
         [[branch]]\nname = \"c\"\nfrom = \"s\"\nfree = \"eta\"\nrange = [1.55, 1.92]\nswitch = { torus = 1 }\n\
         mark = { eta = [1.75, 1.9] }",
    );
    let eta = study.model.parameter_index("eta").unwrap();
    let born = diagram.branch("c").unwrap().special.iter().find(|special| special.kind == Kind::Torus).unwrap();
    near(born.point.parameters[eta], 1.71476711, 1e-7);
    let branch = diagram.branch("c/torus-1").unwrap();
    for (value, name) in [(1.75, "A2-1.75"), (1.9, "A2-1.9")] {
        let there = &mark(branch, eta, value).point;
        turns_at(there, &format!("{name}-freq"));
        near(there.ranges[4][1], known(&format!("{name}-maxr")).0[0], 3e-6);
        near(exponent(there), known(&format!("{name}-exp")).0[0], 1e-6);
    }
}

#[test]
fn an_autonomous_torus_has_two_free_frequencies() {
    let (study, diagram) = of(
        "langford",
        "tolerance = 1e-7\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nparameters = { rho = 0.7 }\nsamples = 8\n\
         [[branch]]\nname = \"c\"\nfrom = \"s\"\nfree = \"rho\"\nrange = [0.48, 0.8]\nswitch = { torus = 1 }\n\
         mark = { rho = [0.5, 0.6] }",
    );
    let rho = study.model.parameter_index("rho").unwrap();
    let born = diagram.branch("c").unwrap().special.iter().find(|special| special.kind == Kind::Torus).unwrap();
    near(born.point.parameters[rho], known("A4-TR").0[0], 1e-8);
    let branch = diagram.branch("c/torus-1").unwrap();
    for (value, name) in [(0.6, "A4-0.6-0"), (0.5, "A4-0.5-0")] {
        let there = &mark(branch, rho, value).point;
        near(TAU / torus(there).period, 3.5, 1e-8);
        turns_at(there, name);
        let values = known(name).0;
        near(there.ranges[3][1], values[1], 2e-5);
        near(there.ranges[3][0], values[2], 2e-5);
        near(exponent(there), values[3], 1e-6);
    }
}

#[test]
fn gravity_makes_a_torus_of_a_bouncing_cycle() {
    let (study, diagram) = of(
        "overhung-rotor-gravity",
        "tolerance = 1e-7\n[[seed]]\nname = \"s\"\nattractor = \"2:1\"\ntorus = true\nparameters = { Omega = 5, G = 0 }\n\
         [[branch]]\nname = \"t\"\nfrom = \"s\"\nfree = \"G\"\nuntil = 0.05",
    );
    let branch = diagram.branch("t").unwrap();
    assert_eq!(branch.ends[1], Some(Ending::Bound(0.05)));
    let there = branch.points.last().unwrap();
    turns_at(there, "A3-SL-0.05-freq");
    let values = known("A3-SL-0.05-r").0;
    let r = study.model.states.len();
    near(there.ranges[r][1], values[0], 5e-6);
    near(there.ranges[r][0], values[1], 5e-6);
    near(exponent(there), known("A3-SL-0.05-exp").0[0], 1e-5);
    assert!(there.trust.liouville_defect < 1e-5 && there.trust.trivial_defect < 1e-6, "{:?}", there.trust);
}

#[test]
fn a_seed_on_which_the_forcing_acts_is_refused() {
    let (_, diagram) = of(
        "overhung-rotor-gravity",
        "[[seed]]\nname = \"s\"\nattractor = \"2:1\"\ntorus = true\nparameters = { Omega = 5, G = 0.05 }\n\
         [[branch]]\nname = \"t\"\nfrom = \"s\"\nfree = \"G\"\nuntil = 0.1",
    );
    let Some(Ending::NoStart(why)) = &diagram.branch("t").unwrap().ends[1] else { panic!() };
    assert!(why.contains("the forcing acts at the parameters of this seed"), "{why}");
}

#[test]
fn a_branch_of_tori_met_by_simulation_ends_at_the_torus_point_of_a_cycle() {
    let (study, diagram) = of(
        "van-der-pol-forced",
        "tolerance = 1e-7\n[[seed]]\nname = \"s\"\nattractor = \"torus\"\nparameters = { s = 0.6, Omega = 1.2 }\n\
         [[branch]]\nname = \"t\"\nfrom = \"s\"\nfree = \"s\"\nrange = [0.5, 1.2]",
    );
    let s = study.model.parameter_index("s").unwrap();
    let branch = diagram.branch("t").unwrap();
    let Some(Ending::Joined { at: Kind::Torus, parameter }) = branch.ends[1] else { panic!("{:?}", branch.ends) };
    // The parameter is extrapolated from the amplitude.
    near(parameter, known("A1-NS").0[0], 1e-5);
    assert!(branch.points.iter().all(|point| point.unstable == 0 && point.parameters[s] < parameter + 1e-5));
    assert!(branch.special.is_empty());
}
