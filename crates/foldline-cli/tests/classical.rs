//! Classical problems whose special points are known: in closed form, or from another continuation code at fine settings.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind, SpecialPoint};
use foldline::explore::{self, System};
use foldline_store::study_file::parse_study;

const LORENZ: &str = include_str!("../../../models/lorenz.toml");
const LURE: &str = include_str!("../../../models/lure.toml");
const BRUSSELATOR: &str = include_str!("../../../models/brusselator.toml");
const VAN_DER_POL: &str = include_str!("../../../models/van-der-pol.toml");
const STUART_LANDAU: &str = include_str!("../../../models/stuart-landau.toml");

/// Tolerance of every run here unless said otherwise; errors are relative to 1 + |value|.
const TOLERANCE: f64 = 1e-6;

/// A study of one branch "b", run to its diagram. `seed` and `branch` are the lines of its two tables.
#[track_caller]
fn explored(model: &str, seed: &str, branch: &str) -> Diagram {
    let text = format!(
        "model = \"m\"\ntolerance = {TOLERANCE}\n[[seed]]\nname = \"s\"\n{seed}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n{branch}\n"
    );
    let study = parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let states = &study.model.states;
    let mut system = System {
        scales: states.iter().map(|s| s.scale).collect(),
        parameter_scales: study
            .model
            .parameters
            .iter()
            .map(|p| if p.value == 0.0 { 1.0 } else { p.value.abs() })
            .collect(),
        ranges: states.iter().map(|s| s.range).collect(),
        ..System::new(&study.model)
    };
    system.find_reflections(&study.plan.seeds[0].parameters);
    explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved)
}

#[track_caller]
fn branch<'d>(diagram: &'d Diagram, name: &str) -> &'d Branch {
    let names: Vec<&str> = diagram.branches.iter().map(|b| b.name.as_str()).collect();
    diagram.branch(name).unwrap_or_else(|| panic!("no branch {name} among {names:?}"))
}

fn parameter(branch: &Branch, special: &SpecialPoint) -> f64 {
    special.point.parameters[branch.free]
}

/// The special points of a branch are exactly these, by increasing parameter; parameters to `error`, relative to 1 + |value|.
#[track_caller]
fn has(branch: &Branch, expected: &[(Kind, f64)], error: f64) -> Vec<SpecialPoint> {
    let mut found = branch.special.clone();
    found.sort_by(|a, b| parameter(branch, a).total_cmp(&parameter(branch, b)));
    let told: Vec<_> =
        found.iter().map(|s| (s.kind, parameter(branch, s), s.unstable_before, s.unstable_after)).collect();
    let agree = |(s, (kind, value)): (&SpecialPoint, &(Kind, f64))| {
        s.kind == *kind && near(parameter(branch, s), *value, error) && s.error <= TOLERANCE
    };
    assert!(
        found.len() == expected.len() && found.iter().zip(expected).all(agree),
        "{}: {told:?}, expected {expected:?}",
        branch.name
    );
    found
}

fn near(value: f64, expected: f64, error: f64) -> bool {
    (value - expected).abs() <= error * (1.0 + expected.abs())
}

#[track_caller]
fn period_is(value: Option<f64>, expected: f64, error: f64) {
    assert!(value.is_some_and(|v| near(v, expected, error)), "period {value:?}, expected {expected}");
}

#[track_caller]
fn joined(branch: &Branch, side: usize, kind: Kind, value: f64, error: f64) {
    match &branch.ends[side] {
        Some(Ending::Joined { at, parameter }) if *at == kind && near(*parameter, value, error) => {}
        other => panic!("{}: side {side} {other:?}, expected to join at {kind} {value}", branch.name),
    }
}

#[track_caller]
fn ends(branch: &Branch, codes: [&str; 2]) {
    let found: Vec<&str> = branch.ends.iter().map(|e| e.as_ref().map_or("none", |e| e.code())).collect();
    assert_eq!(found, codes, "{}: {:?}", branch.name, branch.ends);
}

#[test]
fn lorenz_cycles_double_their_period_as_rho_falls() {
    let diagram = explored(
        LORENZ,
        "attractor = \"cycle\"\nparameters = { rho = 280 }",
        "free = \"rho\"\nrange = [212, 300]\nswitch = { period-doubling = 2 }",
    );
    // Other continuation code, good to the digits given.
    let cascade = [
        ("b", 229.40670856, 0.48086682, 1e-7),
        ("b/period-doubling-1", 218.21012777, 0.98794894, 1e-7),
        ("b/period-doubling-1/period-doubling-1", 215.96643, 1.98675, 4e-6),
    ];
    for (name, value, period, error) in cascade {
        let branch = branch(&diagram, name);
        let found = has(branch, &[(Kind::PeriodDoubling, value)], error);
        period_is(found[0].point.solution.period(), period, error.max(TOLERANCE));
    }
    joined(branch(&diagram, "b/period-doubling-1"), 0, Kind::PeriodDoubling, 229.40670856, 1e-7);
}

#[test]
fn lure_cycles_are_born_at_a_hopf_point_and_double() {
    let diagram = explored(
        LURE,
        "state = { x = 0, y = 0, z = 0 }\nparameters = { alpha = 1.5 }",
        "free = \"alpha\"\nrange = [0.57, 1.6]\nswitch = { hopf = 1, period-doubling = 1 }",
    );
    // Closed form: alpha = 1, where the period is 2π.
    has(branch(&diagram, "b"), &[(Kind::Hopf, 1.0)], 1e-8);
    let cycle = branch(&diagram, "b/hopf-1");
    joined(cycle, 0, Kind::Hopf, 1.0, 1e-8);
    period_is(cycle.points[0].solution.period(), std::f64::consts::TAU, 1e-4);
    // Other continuation code.
    let found = has(cycle, &[(Kind::PeriodDoubling, 0.6303020062)], 1e-7);
    period_is(found[0].point.solution.period(), 6.3640713394, TOLERANCE);
    let found = has(branch(&diagram, "b/hopf-1/period-doubling-1"), &[(Kind::PeriodDoubling, 0.57962984090)], 1e-7);
    period_is(found[0].point.solution.period(), 12.7343655, TOLERANCE);
}

#[test]
fn brusselator_oscillates_beyond_b_equal_one_plus_a_squared_in_both_directions() {
    // Closed form: B = 1 + A², period 2π/A.
    for (a, b, free, hopf, range) in [(1.0, 1.0, "B", 2.0, "[0.5, 4]"), (2.0, 3.0, "A", 2f64.sqrt(), "[1.1, 3]")] {
        let diagram = explored(
            BRUSSELATOR,
            &format!("state = {{ x = {a}, y = {} }}\nparameters = {{ A = {a}, B = {b} }}", b / a),
            &format!("free = \"{free}\"\nrange = {range}\nswitch = {{ hopf = 1 }}"),
        );
        let rest = branch(&diagram, "b");
        let found = has(rest, &[(Kind::Hopf, hopf)], 1e-8);
        // Oscillation is beyond the point in B and before it in A.
        let stable_first = free == "B";
        assert_eq!((found[0].unstable_before, found[0].unstable_after), if stable_first { (0, 2) } else { (2, 0) });
        let cycle = branch(&diagram, "b/hopf-1");
        joined(cycle, 0, Kind::Hopf, hopf, 1e-8);
        ends(cycle, ["joined", "bound"]);
        assert!(cycle.special.is_empty() && cycle.points.iter().all(|p| p.unstable == 0));
        let omega = if stable_first { 1.0 } else { hopf };
        period_is(cycle.points[0].solution.period(), std::f64::consts::TAU / omega, 1e-4);
    }
}

#[test]
fn van_der_pol_cycle_relaxes() {
    let diagram = explored(VAN_DER_POL, "attractor = \"cycle\"", "free = \"mu\"\nrange = [1, 10]");
    let cycle = branch(&diagram, "b");
    ends(cycle, ["bound", "bound"]);
    // Other continuation code and high-order integration: period and amplitude.
    for (point, period, amplitude) in
        [(&cycle.points[0], 6.66328686, 2.00861986), (&cycle.points[cycle.points.len() - 1], 19.07836957, 2.01428536)]
    {
        period_is(point.solution.period(), period, TOLERANCE);
        assert!(near(point.ranges[0][1], amplitude, TOLERANCE), "{:?}", point.ranges[0]);
    }
}

#[test]
fn stuart_landau_is_what_its_closed_form_says() {
    let diagram = explored(
        STUART_LANDAU,
        "state = { x = 0, y = 0 }\nparameters = { growth = -1 }",
        "free = \"growth\"\nrange = [-1, 2]\nswitch = { hopf = 1 }",
    );
    has(branch(&diagram, "b"), &[(Kind::Hopf, 0.0)], 1e-8);
    let cycle = branch(&diagram, "b/hopf-1");
    ends(cycle, ["joined", "bound"]);
    joined(cycle, 0, Kind::Hopf, 0.0, 1e-8);
    // Closed form: radius √growth, period 2π, multiplier exp(-4π growth).
    for point in &cycle.points {
        let growth = point.parameters[cycle.free];
        period_is(point.solution.period(), std::f64::consts::TAU, TOLERANCE);
        assert!(near(point.ranges[2][1], growth.sqrt(), TOLERANCE), "{growth}: {:?}", point.ranges);
        assert!((point.spectrum[1].re - (-2.0 * std::f64::consts::TAU * growth).exp()).abs() < 1e-5);
    }
}

#[test]
fn a_cycle_followed_down_to_its_hopf_point_ends_there() {
    let diagram = explored(
        STUART_LANDAU,
        "attractor = \"cycle\"\nparameters = { growth = 1 }",
        "free = \"growth\"\nrange = [-1, 2]",
    );
    let cycle = branch(&diagram, "b");
    ends(cycle, ["joined", "bound"]);
    // Without a parent the parameter is extrapolated from the last point, not solved for.
    joined(cycle, 0, Kind::Hopf, 0.0, 1e-4);
    assert!(cycle.special.is_empty());
}

#[test]
fn a_cubic_has_two_folds() {
    let model = "name = \"Cusp\"\n[parameters]\nmu = -1\nlambda = 1\n[states]\nx = \"mu + lambda*x - x^3\"\n";
    let diagram = explored(model, "state = { x = -1.32 }", "free = \"mu\"\nrange = [-2, 2]");
    // Closed form: mu = ±2/(3√3) at lambda = 1.
    let mu = 2.0 / 27f64.sqrt();
    has(branch(&diagram, "b"), &[(Kind::Fold, -mu), (Kind::Fold, mu)], 1e-8);
}

#[test]
fn fitzhugh_nagumo_cycles_span_from_one_hopf_point_to_the_other() {
    let model = "name = \"FitzHugh-Nagumo\"\n[parameters]\na = 0\nb = 0.8\nc = 3\n[states]\nx = \"c*(x - x^3/3 + y)\"\ny = \"-(x - a + b*y)/c\"\n";
    let diagram = explored(
        model,
        "state = { x = 1.2, y = -0.62 }\nparameters = { a = 0.7 }",
        "free = \"a\"\nrange = [-1, 1]\nswitch = { hopf = 1 }",
    );
    // Closed form, and its mirror image.
    let hopf = 0.422817629424;
    let rest = branch(&diagram, "b");
    let found = has(rest, &[(Kind::Hopf, -hopf), (Kind::Hopf, hopf)], 1e-8);
    let foldline::diagram::Solution::Equilibrium(x) = &found[1].point.solution else { panic!("an equilibrium") };
    assert!(near(x[0], 0.954521404218, 1e-8) && near(x[1], -0.664629718493, 1e-8), "{x:?}");
    let cycle = branch(&diagram, "b/hopf-1");
    // Born and lost subcritically; two runs of the same branch from either end would meet the same fold mirrored.
    assert_eq!(cycle.special.len(), 2);
    assert!(near(parameter(cycle, &cycle.special[0]), -parameter(cycle, &cycle.special[1]), 1e-6));
    joined(cycle, 0, Kind::Hopf, -hopf, 1e-8);
    joined(cycle, 1, Kind::Hopf, hopf, 1e-8);
    assert_eq!(diagram.branches.len(), 2, "the second Hopf point leads to the branch that is known already");
}
