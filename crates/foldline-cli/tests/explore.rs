//! Whole diagrams found from a model and a box of parameters: every known branch and special point must be there, once.

use foldline::contract::{Event, Observer, Unobserved, Verdict};
use foldline::diagram::{Branch, Diagram, Ending, Family, Kind, Point, Solution};
use foldline::explore::{self, SeedPlan, SeedSource, System, first_solution};
use foldline_store::study_file::{Study, parse_study};
use std::sync::atomic::{AtomicUsize, Ordering};

const ROTOR: &str = include_str!("../../../models/overhung-rotor.toml");
const LORENZ: &str = include_str!("../../../models/lorenz.toml");
const LURE: &str = include_str!("../../../models/lure.toml");
const PREDATOR: &str = include_str!("../../../models/predator-prey.toml");
const DUFFING: &str = include_str!("../../../models/duffing-forced.toml");

/// Level set m(λ) = α + (x - λ/3)² of the function m = -(λ² - 1)(λ² - 4). At α = 0 it is two closed curves around
/// λ = ±3/2, whose folds at λ = ±1, ±2 all lie on the curve α = m(λ), which has maxima 9/4 at λ² = 5/2 and a minimum
/// -4 at 0.
const ISOLAS: &str = "name = \"isolas\"\n[parameters]\nlambda = 1.5\nalpha = 0\n\
    [states.x]\nequation = \"-(lambda^2 - 1)*(lambda^2 - 4) - alpha - (x - lambda/3)^2\"\nrange = [-4, 4]\n";

fn study(model: &str, lines: &str) -> Study {
    let text = format!("model = \"m\"\n[[explore]]\nname = \"all\"\n{lines}\n");
    parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"))
}

fn run(study: &Study, jobs: usize, earlier: Diagram, observer: &dyn Observer) -> Diagram {
    explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, jobs, earlier, observer)
}

fn explored(model: &str, lines: &str) -> Diagram {
    run(&study(model, lines), 2, Diagram::default(), &Unobserved)
}

fn names(diagram: &Diagram) -> Vec<&str> {
    diagram.branches.iter().map(|b| b.name.as_str()).collect()
}

/// Every special point of all branches in one parameter, by kind and value, sorted.
fn special(diagram: &Diagram) -> Vec<(Kind, f64)> {
    let branches = diagram.branches.iter().filter(|b| b.held.is_none());
    let all = branches.flat_map(|b| b.special.iter().map(|s| (s.kind, s.point.parameters[b.free])));
    let mut found: Vec<(Kind, f64)> = all.collect();
    found.sort_by(|a, b| a.0.name().cmp(b.0.name()).then(a.1.total_cmp(&b.1)));
    found
}

#[track_caller]
fn agree(diagram: &Diagram, expected: &[(Kind, f64)], error: f64) {
    let found = special(diagram);
    let same = |((k, v), (l, w)): (&(Kind, f64), &(Kind, f64))| k == l && (v - w).abs() <= error * (1.0 + w.abs());
    assert!(
        found.len() == expected.len() && found.iter().zip(expected).all(same),
        "{found:?} in {:?}, expected {expected:?}",
        names(diagram)
    );
}

#[track_caller]
fn branch<'d>(diagram: &'d Diagram, name: &str) -> &'d Branch {
    diagram.branch(name).unwrap_or_else(|| panic!("no {name} among {:?}", names(diagram)))
}

fn has(branch: &Branch, kind: Kind, value: f64) -> bool {
    branch.special.iter().any(|s| s.kind == kind && (s.point.parameters[branch.free] - value).abs() < 2e-6)
}

#[test]
fn the_diagram_of_the_rotor_with_a_cubic_spring_is_complete() {
    let diagram = explored(ROTOR, "parameters = { kappa = 0 }\nfree = \"Omega\"\nrange = [0.5, 12]");
    // Lower and upper synchronous motion, SL and DL. Independent codes: shooting and collocation at fine settings.
    assert_eq!(names(&diagram), ["all/equilibrium-1", "all/equilibrium-2", "all/2:1-1", "all/3:1-1"]);
    assert!(has(branch(&diagram, "all/2:1-1"), Kind::Fold, 3.466078));
    let lower = branch(&diagram, "all/3:1-1");
    assert!(has(lower, Kind::Fold, 2.773908) && has(lower, Kind::Fold, 6.276979));
    assert!(lower.ends.iter().all(|end| *end == Some(Ending::Closed)));
}

#[test]
fn the_diagram_of_the_rotor_with_contact_is_complete() {
    let diagram = explored(ROTOR, "parameters = { kappa = 1 }\nfree = \"Omega\"\nrange = [0.5, 12]");
    let (sl, dl) = (branch(&diagram, "all/2:1-1"), branch(&diagram, "all/3:1-1"));
    for branch in [sl, dl] {
        assert!(branch.ends.iter().all(|end| *end == Some(Ending::Closed)), "{}: {:?}", branch.name, branch.ends);
        assert_eq!(branch.special.len(), 4, "{}", branch.name);
    }
    assert!(has(sl, Kind::Fold, 3.352613) && has(sl, Kind::Fold, 10.340617));
    assert!(has(sl, Kind::PeriodDoubling, 3.417414) && has(sl, Kind::PeriodDoubling, 4.862412));
    assert!(has(dl, Kind::PeriodDoubling, 2.745442) && has(dl, Kind::PeriodDoubling, 4.269067));
    assert!(has(branch(&diagram, "all/equilibrium-1"), Kind::Fold, 3.556166));
    for (name, doublings) in [("all/2:1-1", [3.441752, 4.628842]), ("all/3:1-1", [2.745766, 4.199325])] {
        let doubled = branch(&diagram, &format!("{name}/period-doubling-1"));
        assert!(doublings.iter().all(|value| has(doubled, Kind::PeriodDoubling, *value)), "{}", doubled.name);
        assert!(diagram.branch(&format!("{name}/period-doubling-1/period-doubling-1")).is_some());
    }
}

#[test]
fn equilibria_that_cross_are_each_followed_once() {
    let diagram = explored(PREDATOR, "free = \"p1\"\nrange = [0.1, 1]");
    let crossing = (2.0 / 3.0) / (1.0 - (-5f64 / 3.0).exp());
    let expected = [
        // A branch point is listed on both branches that cross there.
        (Kind::BranchPoint, 0.6),
        (Kind::BranchPoint, 0.6),
        (Kind::BranchPoint, crossing),
        (Kind::BranchPoint, crossing),
        (Kind::Fold, 0.832929322234),
        (Kind::Hopf, 0.671593847479),
    ];
    agree(&diagram, &expected, 3e-8);
    assert_eq!(diagram.branches.iter().filter(|b| b.family == Family::Cycle).count(), 1, "{:?}", names(&diagram));
}

#[test]
fn lorenz_is_followed_from_rest_to_its_homoclinic_orbit() {
    let diagram = explored(LORENZ, "free = \"rho\"\nrange = [0.5, 30]");
    let hopf = 10.0 * (10.0 + 8.0 / 3.0 + 3.0) / (10.0 - 8.0 / 3.0 - 1.0);
    agree(&diagram, &[(Kind::BranchPoint, 1.0), (Kind::Hopf, hopf)], 1e-8);
    assert_eq!(diagram.branches.len(), 3);
    let cycles = &diagram.branches[2];
    assert!(cycles.ends.iter().flatten().any(|end| end.code() == "homoclinic"), "{:?}", cycles.ends);
}

#[test]
fn period_doublings_and_symmetry_breaking_of_lorenz_cycles_are_found() {
    let diagram = explored(LORENZ, "free = \"rho\"\nrange = [180, 350]\nvalues = 7");
    let found = special(&diagram);
    let there = |kind: Kind, value: f64| found.iter().any(|(k, v)| *k == kind && (v - value).abs() < 1e-6 * value);
    assert!(there(Kind::PeriodDoubling, 229.40670856) && there(Kind::PeriodDoubling, 218.21012777), "{found:?}");
    assert!(found.iter().any(|(k, v)| *k == Kind::BranchPoint && (v - 312.9735).abs() < 1e-3), "{found:?}");
}

#[test]
fn a_period_doubling_cascade_is_found_from_rest() {
    let diagram = explored(LURE, "free = \"alpha\"\nrange = [0.5, 1.5]\nvalues = 3");
    let expected = [
        (Kind::Hopf, 1.0),
        (Kind::PeriodDoubling, 0.569222719),
        (Kind::PeriodDoubling, 0.57962984090),
        (Kind::PeriodDoubling, 0.6303020062),
    ];
    agree(&diagram, &expected, 2e-8);
}

#[test]
fn the_diagram_of_a_forced_oscillator_is_complete() {
    let diagram = explored(DUFFING, "parameters = { A = 0.06 }\nfree = \"omega\"\nrange = [0.8, 1.6]\nvalues = 3");
    agree(&diagram, &[(Kind::Fold, 1.1214097673), (Kind::Fold, 1.3786856804)], 1e-8);
    assert_eq!(names(&diagram), ["all/cycle-1"]);
}

#[test]
fn isolated_branches_are_reached_through_a_second_parameter() {
    let lines = "free = \"lambda\"\nrange = [-3, 6]\nvalues = 1";
    let alone = explored(ISOLAS, lines);
    agree(&alone, &[(Kind::Fold, 1.0), (Kind::Fold, 2.0)], 1e-8);
    let connected = explored(ISOLAS, &format!("{lines}\nconnect = {{ alpha = [-6, 3] }}"));
    agree(&connected, &[-2.0, -1.0, 1.0, 2.0].map(|value| (Kind::Fold, value)), 1e-8);
    assert_eq!(names(&connected), ["all/equilibrium-1", "all/equilibrium-1/fold-1", "all/equilibrium-2"]);
    let curve = &connected.branches[1];
    let turns: Vec<f64> =
        curve.special.iter().filter(|s| s.kind == Kind::Fold).map(|s| s.point.parameters[1]).collect();
    let expected = [2.25, -4.0, 2.25];
    assert!(turns.len() == 3 && turns.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-8), "{turns:?}");
    for name in ["all/equilibrium-1", "all/equilibrium-2"] {
        assert!(branch(&connected, name).ends.iter().all(|end| *end == Some(Ending::Closed)));
    }
}

/// A lightly damped rotor just above contact, where no sample settles. A second route to the same isola, from a state
/// on it by shooting and integration at 1e-12, gives 2.2588 to 3.0204, stable from 2.8467 on.
#[test]
fn an_isola_that_no_sample_reaches_is_found() {
    let light =
        "parameters = { kappa = 1, zeta = 0.0012634, epsilon = 0.4449, beta = 31.956, K = 479.34, J_p = 0.1876 }";
    let rest = "free = \"Omega\"\nrange = [2.1, 3.2]\nvalues = 1\nsamples = 4\nswitch = { period-doubling = 0 }";
    let diagram = explored(ROTOR, &format!("{light}\n{rest}"));
    let isola = branch(&diagram, "all/3:1-1");
    assert!(isola.ends.iter().all(|end| *end == Some(Ending::Closed)), "{:?}", isola.ends);
    let near = |kind: Kind, value: f64| {
        isola.special.iter().any(|s| s.kind == kind && (s.point.parameters[0] - value).abs() < 5e-5)
    };
    assert!(near(Kind::Fold, 2.2588) && near(Kind::Fold, 3.0204) && near(Kind::PeriodDoubling, 2.8467));
    assert_eq!(names(&diagram).iter().filter(|name| name.starts_with("all/3:1")).count(), 1, "{:?}", names(&diagram));
}

/// Asserts that a trajectory started slightly off a stable cycle of a branch settles on it, for at least one cycle, as
/// basins are narrow.
#[track_caller]
fn attracts(study: &Study, branch: &Branch) {
    let system = System::of_plan(&study.model, &study.plan);
    let returns = |point: &&Point| {
        let Solution::Cycle(cycle) = &point.solution else { return false };
        let state: Vec<f64> = cycle.state(0.0).iter().map(|x| x * 1.001).collect();
        let (source, parameters) = (SeedSource::State(state), point.parameters.clone());
        let seed = SeedPlan { name: "off".into(), source, parameters, samples: 1, random: 1 };
        let settled = first_solution(&system, &seed, 1e-6, 1);
        settled.is_ok_and(|settled| settled.distance(point, system.measure()) < 1e-5)
    };
    let mut stable = branch.points.iter().filter(|point| point.unstable == 0);
    assert!(stable.any(|point| returns(&point)), "no trajectory settles on {}", branch.name);
}

/// An isola of another light rotor.
#[test]
fn trajectories_settle_on_an_isola_near_a_resonance() {
    let light = "parameters = { kappa = 1, zeta = 0.004, epsilon = 0.5, beta = 20, K = 300, J_p = 0.1 }";
    let rest = "free = \"Omega\"\nrange = [2, 3]\nvalues = 1\nsamples = 1\nswitch = { period-doubling = 0 }";
    let study = study(ROTOR, &format!("{light}\n{rest}"));
    let diagram = run(&study, 2, Diagram::default(), &Unobserved);
    let isola = branch(&diagram, "all/3:1-1");
    assert!(isola.ends.iter().all(|end| *end == Some(Ending::Closed)), "{:?}", isola.ends);
    attracts(&study, isola);
}

/// A mass that strikes a stop has an isola of cycles of five forcing periods, near 5/3 of the natural frequency of the
/// mass.
#[test]
fn a_subharmonic_isola_of_an_impact_oscillator_is_found() {
    const IMPACT: &str = "name = \"impact\"\n[parameters]\nomega = 2\nA = 0.6\nzeta = 0.005\nk = 20\n[forcing]\n\
        frequency = \"omega\"\n[states.x]\nequation = \"v\"\nrange = [-3, 3]\n[states.v]\n\
        equation = \"-2*zeta*v - x - if(x > 1, k*(x - 1), 0) + A*cos(omega*t)\"\nrange = [-3, 3]\n";
    let lines = "free = \"omega\"\nrange = [1.55, 2.2]\nvalues = 1\nsamples = 1\nswitch = { period-doubling = 0 }";
    let study = study(IMPACT, lines);
    let diagram = run(&study, 2, Diagram::default(), &Unobserved);
    let five = |branch: &&Branch| matches!(&branch.points[0].solution, Solution::Cycle(c) if c.forcing_periods == 5);
    let isola = diagram.branches.iter().find(five).unwrap_or_else(|| panic!("{:?}", names(&diagram)));
    assert!(isola.ends.iter().all(|end| *end == Some(Ending::Closed)), "{:?}", isola.ends);
    attracts(&study, isola);
}

/// Observer that stops the run after a number of points.
struct Impatient {
    left: AtomicUsize,
}

impl Observer for Impatient {
    fn observe(&self, event: Event) -> Verdict {
        match event {
            Event::Point(..) => {
                let before = self.left.load(Ordering::Relaxed);
                self.left.store(before.saturating_sub(1), Ordering::Relaxed);
                if before > 1 { Verdict::Continue } else { Verdict::Stop }
            }
            _ => Verdict::Continue,
        }
    }
}

#[test]
fn the_diagram_does_not_depend_on_threads_or_interruptions() {
    let study = study(ISOLAS, "free = \"lambda\"\nrange = [-3, 6]\nvalues = 3\nconnect = { alpha = [-6, 3] }");
    let whole = run(&study, 1, Diagram::default(), &Unobserved);
    let told = |diagram: &Diagram| {
        let points = diagram.branches.iter().map(|b| (b.name.clone(), b.points.len(), b.ends.clone()));
        (points.collect::<Vec<_>>(), special(diagram))
    };
    assert_eq!(told(&run(&study, 3, Diagram::default(), &Unobserved)), told(&whole));
    let mut pieces = Diagram::default();
    for _ in 0..9 {
        pieces = run(&study, 1, pieces, &Impatient { left: AtomicUsize::new(40) });
    }
    let (found, expected) = (run(&study, 1, pieces, &Unobserved), whole);
    assert_eq!(names(&found), names(&expected));
    for (a, b) in special(&found).iter().zip(special(&expected)) {
        assert!(a.0 == b.0 && (a.1 - b.1).abs() < 1e-8, "{a:?} {b:?}");
    }
    assert!(found.branches.iter().all(|b| b.ends.iter().all(|end| end.as_ref().is_some_and(Ending::complete))));
}

#[test]
fn a_budget_ends_an_exploration() {
    let few = explored(PREDATOR, "free = \"p1\"\nrange = [0.1, 1]\nbudget = 50");
    let points: usize = few.branches.iter().map(|b| b.points.len()).sum();
    assert!(points >= 50 && few.branches.len() == 2, "{points} on {:?}", names(&few));
}

/// A parameter in metres: two isolas whose folds have the same state and differ by a fraction 1e-4 of the parameter.
#[test]
fn folds_of_a_small_parameter_are_told_apart() {
    let model = "name = \"small\"\n[parameters]\nl = 1e-3\na = 0\n[states.x]\nequation = \
        \"-400*(1000*l - 1)*(1000*l - 1.15)*(1000*l - 1.2)*(1000*l - 1.35) - a - (x - 0.1)^2\"\nrange = [-1, 1]\n";
    let lines = "free = \"l\"\nrange = [0.7e-3, 1.45e-3]\nvalues = 1\nconnect = { a = [-3, 1] }";
    agree(&explored(model, lines), &[1e-3, 1.15e-3, 1.2e-3, 1.35e-3].map(|l| (Kind::Fold, l)), 1e-9);
}

/// A parameter without a value in the model, over a range of thousands.
#[test]
fn steps_fit_the_range_whatever_the_value_in_the_model() {
    let model = "name = \"wide\"\n[parameters]\nmu = 0\n[states.x]\nequation = \"mu + 300*x - x^3\"\nrange = [-50, 50]\nscale = 20\n";
    let diagram = explored(model, "free = \"mu\"\nrange = [-1e4, 1e4]\nvalues = 3");
    agree(&diagram, &[(Kind::Fold, -2000.0), (Kind::Fold, 2000.0)], 1e-8);
    assert!(diagram.branches.len() == 1 && diagram.branches[0].points.len() < 400, "{:?}", names(&diagram));
}
