//! Classical problems whose special points are known in closed form, or from another continuation code at fine
//! settings.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind, Solution, SpecialPoint};
use foldline::explore::{self, System};
use foldline_store::study_file::parse_study;

const LORENZ: &str = include_str!("../../../models/lorenz.toml");
const LURE: &str = include_str!("../../../models/lure.toml");
const BRUSSELATOR: &str = include_str!("../../../models/brusselator.toml");
const VAN_DER_POL: &str = include_str!("../../../models/van-der-pol.toml");
const STUART_LANDAU: &str = include_str!("../../../models/stuart-landau.toml");

/// Tolerance of every run here unless said otherwise; errors are relative to 1 + |value|.
const TOLERANCE: f64 = 1e-6;

/// Runs a study of one branch "b" and returns its diagram. `seed` and `branch` are the lines of its two tables.
#[track_caller]
fn explored(model: &str, seed: &str, branch: &str) -> Diagram {
    let text = format!(
        "model = \"m\"\ntolerance = {TOLERANCE}\n[[seed]]\nname = \"s\"\n{seed}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n{branch}\n"
    );
    let study = parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let system = System::of_plan(&study.model, &study.plan);
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

/// Asserts that the special points of a branch are exactly these, by increasing parameter; parameters to `error`,
/// relative to 1 + |value|.
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
    // Another continuation code, to the digits given.
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
    // Another continuation code.
    let found = has(cycle, &[(Kind::PeriodDoubling, 0.6303020062)], 1e-7);
    period_is(found[0].point.solution.period(), 6.3640713394, TOLERANCE);
    let found = has(branch(&diagram, "b/hopf-1/period-doubling-1"), &[(Kind::PeriodDoubling, 0.57962984090)], 1e-7);
    period_is(found[0].point.solution.period(), 12.7343655, TOLERANCE);
}

#[test]
fn brusselator_oscillates_beyond_b_equal_one_plus_a_squared_whichever_parameter_varies() {
    // Closed form: B = 1 + A², period 2π/A.
    for (a, b, free, hopf, range) in [(1.0, 1.0, "B", 2.0, "[0.5, 4]"), (2.0, 3.0, "A", 2f64.sqrt(), "[1.1, 3]")] {
        let diagram = explored(
            BRUSSELATOR,
            &format!("state = {{ x = {a}, y = {} }}\nparameters = {{ A = {a}, B = {b} }}", b / a),
            &format!("free = \"{free}\"\nrange = {range}\nswitch = {{ hopf = 1 }}"),
        );
        let rest = branch(&diagram, "b");
        let found = has(rest, &[(Kind::Hopf, hopf)], 1e-8);
        // Cycles exist beyond the point in B and before it in A.
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
    let line = "free = \"mu\"\nrange = [1, 100]\nmark = { mu = [10, 30] }";
    let diagram = explored(VAN_DER_POL, "attractor = \"cycle\"", line);
    let cycle = branch(&diagram, "b");
    ends(cycle, ["bound", "bound"]);
    // Another continuation code, and integration by Radau's method at 1e-12: period and amplitude.
    let last = &cycle.points[cycle.points.len() - 1];
    for (point, period, amplitude) in [
        (&cycle.points[0], 6.66328686, 2.00861986),
        (&cycle.special[0].point, 19.07836957, 2.01428536),
        (&cycle.special[1].point, 50.543686482741, 2.005164254841),
        (last, 162.837071092370, 2.001318681177),
    ] {
        period_is(point.solution.period(), period, TOLERANCE);
        assert!(near(point.ranges[0][1], amplitude, TOLERANCE), "{:?}", point.ranges[0]);
    }
}

#[test]
fn stuart_landau_cycles_match_their_closed_form() {
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
    let model = include_str!("../../../models/cusp.toml");
    let diagram = explored(model, "state = { x = -1.32 }\nparameters = { mu = -1 }", "free = \"mu\"\nrange = [-2, 2]");
    // Closed form: mu = ±2/(3√3) at lambda = 1.
    let mu = 2.0 / 27f64.sqrt();
    has(branch(&diagram, "b"), &[(Kind::Fold, -mu), (Kind::Fold, mu)], 1e-8);
}

#[test]
fn fitzhugh_nagumo_cycles_lead_from_one_hopf_point_to_the_other() {
    let model = include_str!("../../../models/fitzhugh-nagumo.toml");
    let diagram = explored(
        model,
        "state = { x = 1.2, y = -0.62 }\nparameters = { a = 0.7 }",
        "free = \"a\"\nrange = [-1, 1]\nswitch = { hopf = 1 }",
    );
    // Closed form, and its mirror image.
    let hopf = 0.422817629424;
    let rest = branch(&diagram, "b");
    let found = has(rest, &[(Kind::Hopf, -hopf), (Kind::Hopf, hopf)], 1e-8);
    let Solution::Equilibrium(x) = &found[1].point.solution else { panic!("an equilibrium") };
    assert!(near(x[0], 0.954521404218, 1e-8) && near(x[1], -0.664629718493, 1e-8), "{x:?}");
    let cycle = branch(&diagram, "b/hopf-1");
    // Born and lost subcritically; starting the branch from either end would give the mirror images of the same folds.
    assert_eq!(cycle.special.len(), 2);
    assert!(near(parameter(cycle, &cycle.special[0]), -parameter(cycle, &cycle.special[1]), 1e-6));
    joined(cycle, 0, Kind::Hopf, -hopf, 1e-8);
    joined(cycle, 1, Kind::Hopf, hopf, 1e-8);
    assert_eq!(diagram.branches.len(), 2, "the second Hopf point leads to the branch that is known already");
}

#[test]
fn lorenz_rolls_appear_at_a_pitchfork_and_their_cycles_end_at_a_homoclinic_orbit() {
    let diagram = explored(
        LORENZ,
        "state = { x = 0, y = 0, z = 0 }\nparameters = { rho = 0.5 }",
        "free = \"rho\"\nrange = [0.2, 40]\nswitch = { branch-point = 1, hopf = 1 }",
    );
    // Closed form: pitchfork at 1, Hopf point at σ(σ + b + 3)/(σ - b - 1).
    let (sigma, b) = (10.0, 8.0 / 3.0);
    let hopf = sigma * (sigma + b + 3.0) / (sigma - b - 1.0);
    let found = has(branch(&diagram, "b"), &[(Kind::BranchPoint, 1.0)], 1e-8);
    assert_eq!((found[0].unstable_before, found[0].unstable_after), (0, 1));
    // Only one half of the pitchfork branch; the other is its mirror image.
    assert_eq!(diagram.branches.len(), 3);
    let arm = branch(&diagram, "b/branch-point-1");
    joined(arm, 0, Kind::BranchPoint, 1.0, 1e-8);
    for point in &arm.points {
        let rho = point.parameters[arm.free];
        assert!(near(point.ranges[0][0].abs(), (b * (rho - 1.0)).sqrt(), 1e-8));
    }
    let found = has(arm, &[(Kind::Hopf, hopf)], 1e-8);
    let Solution::Equilibrium(x) = &found[0].point.solution else { panic!("an equilibrium") };
    assert!(near(x[0].abs(), 7.9560197, 1e-7) && near(x[2], 23.7368437, 1e-6), "{x:?}");
    // Subcritical: unstable cycles below. Period at the Hopf point in closed form; homoclinic orbit from another
    // continuation code, to the digits given.
    let cycle = branch(&diagram, "b/branch-point-1/hopf-1");
    period_is(cycle.points[0].solution.period(), 0.65283033, 1e-4);
    assert!(cycle.points.iter().all(|p| p.parameters[cycle.free] < hopf && p.unstable == 1));
    ends(cycle, ["joined", "homoclinic"]);
    assert!(cycle.special.is_empty());
    assert!(near(cycle.points[cycle.points.len() - 1].parameters[cycle.free], 13.926, 5e-5));
}

#[test]
fn a_symmetric_lorenz_cycle_loses_its_symmetry_at_a_branch_point() {
    let along = |seed: &str, range: &str| {
        let seed = format!("attractor = \"cycle\"\nparameters = {{ rho = {seed} }}");
        explored(LORENZ, &seed, &format!("free = \"rho\"\nrange = {range}\nswitch = {{ branch-point = 1 }}"))
    };
    // From the symmetric side, where it is stable. No independent digits are known; the check is that both sides
    // give the same value.
    let diagram = along("330", "[300, 340]");
    let found = has(branch(&diagram, "b"), &[(Kind::BranchPoint, 312.97353)], 1e-7);
    assert_eq!((found[0].unstable_before, found[0].unstable_after), (1, 0));
    assert_eq!(diagram.branches.len(), 2);
    let arm = branch(&diagram, "b/branch-point-1");
    ends(arm, ["joined", "bound"]);
    assert!(arm.special.is_empty() && arm.points.iter().all(|p| p.unstable == 0));
    // From the other side: the asymmetric branch continues as its mirror image, and the symmetric cycle is found at the
    // same value.
    let other = along("305", "[300, 340]");
    let place = |branch: &Branch| branch.special[0].point.parameters[branch.free];
    assert!(near(place(branch(&other, "b")), place(branch(&diagram, "b")), 3e-5));
    let [only] = &branch(&other, "b").special[..] else { panic!("{:?}", branch(&other, "b").special.len()) };
    assert_eq!((only.kind, only.unstable_before, only.unstable_after), (Kind::BranchPoint, 0, 0));
    let symmetric = branch(&other, "b/branch-point-1");
    has(symmetric, &[(Kind::BranchPoint, 312.97353)], 1e-7);
    ends(symmetric, ["bound", "bound"]);
}

#[test]
fn predator_and_prey_have_two_branch_points_a_fold_and_cycles() {
    let model = "name = \"Predator and prey\"\n[parameters]\np = 0.1\n[states]\nu = \"3*u*(1 - u) - u*v - p*(1 - exp(-5*u))\"\nv = \"-v + 3*u*v\"\n";
    let diagram = explored(
        model,
        "state = { u = 0, v = 0 }",
        "free = \"p\"\nrange = [0.1, 1]\nswitch = { branch-point = 2, hopf = 1 }",
    );
    // Closed form, and Newton's method on the defining equations.
    let second = 2.0 / 3.0 / (1.0 - (-5f64 / 3.0).exp());
    has(branch(&diagram, "b"), &[(Kind::BranchPoint, 0.6)], 1e-8);
    let prey = branch(&diagram, "b/branch-point-1");
    let found = has(prey, &[(Kind::BranchPoint, 0.6), (Kind::BranchPoint, second), (Kind::Fold, 0.832929322234)], 1e-8);
    assert!(near(found[2].point.ranges[0][0], 0.411161560751, 1e-6));
    let both = diagram.branches.iter().find(|b| b.special.iter().any(|s| s.kind == Kind::Hopf)).unwrap();
    let found = has(both, &[(Kind::Hopf, 0.671593847479), (Kind::BranchPoint, second)], 1e-8);
    let Solution::Equilibrium(x) = &found[0].point.solution else { panic!("an equilibrium") };
    assert!(near(x[0], 1.0 / 3.0, 1e-8) && near(x[1], 0.36576154, 1e-8), "{x:?}");
    let omega = found[0].point.spectrum.iter().map(|z| z.im).fold(0.0, f64::max);
    assert!(near(omega, 0.60478222, 1e-7), "{omega}");
    // Cycles up to a heteroclinic orbit, with no special points on the way.
    let cycle = branch(&diagram, &format!("{}/hopf-1", both.name));
    ends(cycle, ["joined", "heteroclinic"]);
    assert!(cycle.special.is_empty());
    assert_eq!(diagram.branches.len(), 4, "the branch points are met again from the other side, and lead nowhere new");
}

#[test]
fn the_ab_reaction_has_two_folds_and_its_cycles_end_at_a_homoclinic_orbit() {
    let model = "name = \"AB\"\n[parameters]\np = 0.05\n[states]\nu = \"-u + p*(1 - u)*exp(v)\"\nv = \"-v + 14*p*(1 - u)*exp(v) - 2*v\"\n";
    let diagram =
        explored(model, "state = { u = 0.05, v = 0.3 }", "free = \"p\"\nrange = [0.01, 0.2]\nswitch = { hopf = 1 }");
    // Another continuation code, 6 to 7 digits, also for the end of the cycles.
    has(branch(&diagram, "b"), &[(Kind::Fold, 0.08893185), (Kind::Fold, 0.1057390), (Kind::Hopf, 0.1308998)], 3e-7);
    let cycle = branch(&diagram, "b/hopf-1");
    ends(cycle, ["joined", "homoclinic"]);
    assert!(cycle.special.is_empty());
    assert!(near(cycle.points[cycle.points.len() - 1].parameters[cycle.free], 0.1055071, 1e-7));
}

#[test]
fn a_cycle_of_the_langford_system_becomes_a_torus() {
    let model = "name = \"Langford\"\n[parameters]\nlambda = 0.5\n[states]\nx = \"(z - 0.7)*x - 3.5*y\"\ny = \"3.5*x + (z - 0.7)*y\"\nz = \"0.6 + lambda*z - z^3/3 - (x^2 + y^2)*(1 + 0.25*z)\"\n";
    let diagram = explored(model, "attractor = \"cycle\"", "free = \"lambda\"\nrange = [0.1, 1.5]");
    let cycle = branch(&diagram, "b");
    // Closed form. With r² = x² + y² the cycle is the equilibrium z = 0.7 of r' = (z - 0.7) r, z' = g(r, z); the torus
    // bifurcation is its Hopf point, where ∂g/∂z = lambda - z² - r²/4 = 0 and ω² = 2.35 r².
    let z: f64 = 0.7;
    let share = 1.0 + 0.25 * z;
    let lambda = (z * z + 0.25 * (0.6 - z.powi(3) / 3.0) / share) / (1.0 - 0.25 * z / share);
    let omega = (2.0 * share * 4.0 * (lambda - z * z)).sqrt();
    let found = has(cycle, &[(Kind::Torus, lambda)], TOLERANCE);
    assert_eq!((found[0].unstable_before, found[0].unstable_after), (0, 2));
    let period = std::f64::consts::TAU / 3.5;
    period_is(found[0].point.solution.period(), period, TOLERANCE);
    // The multiplier pair: exp(±iωT).
    let pair = &found[0].point.spectrum[1..];
    for multiplier in pair {
        assert!((multiplier.norm() - 1.0).abs() < 1e-5, "{pair:?}");
        assert!((multiplier.re - (omega * period).cos()).abs() < 1e-5, "{pair:?}");
    }
    // Second route: the modulus crosses 1 between the accepted points on either side.
    for point in &cycle.points {
        let inside = point.parameters[cycle.free] < lambda;
        assert_eq!(point.spectrum[1].norm() < 1.0, inside, "{:?}", point.spectrum);
    }
}

#[test]
fn van_der_pol_cycle_crosses_the_circles_of_the_harmonic_oscillator() {
    let diagram = explored(VAN_DER_POL, "attractor = \"cycle\"", "free = \"mu\"\nrange = [-1, 1]");
    // At mu = 0 every circle is a cycle; that of amplitude 2 continues to both sides, and mu -> -mu reverses time.
    let cycle = branch(&diagram, "b");
    let found = has(cycle, &[(Kind::BranchPoint, 0.0)], TOLERANCE);
    assert!(near(found[0].point.ranges[0][1], 2.0, TOLERANCE));
    let (first, last) = (&cycle.points[0], &cycle.points[cycle.points.len() - 1]);
    period_is(first.solution.period(), 6.66328686, TOLERANCE);
    period_is(last.solution.period(), 6.66328686, TOLERANCE);
    assert!((first.spectrum[1] * last.spectrum[1] - 1.0).norm() < 1e-4);
}

#[test]
fn one_branch_connects_two_pitchforks() {
    // Closed form: z² = mu (1 - mu) between the pitchforks at 0 and 1; once for equilibria, once beside an oscillation.
    let rest = "name = \"Arc\"\n[parameters]\nmu = -0.5\n[states]\nz = \"mu*(1 - mu)*z - z^3\"\n";
    let cycle = "name = \"Arc\"\n[parameters]\nmu = -0.5\n[states]\nz = \"mu*(1 - mu)*z - z^3\"\nx = \"x - y - x*(x^2 + y^2)\"\ny = \"x + y - y*(x^2 + y^2)\"\n";
    for (model, seed) in [(rest, "state = { z = 0 }"), (cycle, "attractor = \"cycle\"")] {
        let diagram = explored(model, seed, "free = \"mu\"\nrange = [-0.5, 1.5]\nswitch = { branch-point = 1 }");
        has(branch(&diagram, "b"), &[(Kind::BranchPoint, 0.0), (Kind::BranchPoint, 1.0)], 1e-6);
        let arm = branch(&diagram, "b/branch-point-1");
        joined(arm, 0, Kind::BranchPoint, 0.0, 1e-6);
        joined(arm, 1, Kind::BranchPoint, 1.0, 1e-6);
        // The branch is a graph over mu, without folds, and it is stable.
        assert!(arm.special.is_empty(), "{:?}", arm.special.iter().map(|s| s.kind).collect::<Vec<_>>());
        for point in &arm.points {
            let mu = point.parameters[arm.free];
            let z = point.ranges[0].iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            assert!(near(z, (mu * (1.0 - mu)).sqrt(), TOLERANCE), "{mu}: {z}");
            assert_eq!(point.unstable, 0);
        }
        assert_eq!(diagram.branches.len(), 2, "the second pitchfork is the other end of the same arm");
    }
}

#[test]
fn a_branch_continues_past_a_crossing_next_to_which_newtons_method_ends_on_either_branch() {
    // mu x - x³ + e = 0 is two separate curves for e ≠ 0, and rounding always makes e ≠ 0: within e^⅔ of 0 the branch
    // from the left turns into the one that crosses it. Points there belong clearly to neither.
    for offset in ["0", "1e-15", "1e-14", "-1e-13", "1e-12"] {
        let model = format!("[parameters]\nmu = -1\n[states]\nx = \"y\"\ny = \"-y + mu*x - x^3 + {offset}\"\n");
        let diagram = explored(
            &model,
            "attractor = \"equilibrium\"",
            "free = \"mu\"\nrange = [-1, 1]\nswitch = { branch-point = 1 }",
        );
        let found = has(branch(&diagram, "b"), &[(Kind::BranchPoint, 0.0)], 1e-8);
        let slope = found[0].point.tangent[2] / found[0].point.tangent[0];
        assert!(slope.abs() > 10.0, "{offset}: the branch goes straight through: {:?}", found[0].point.tangent);
        let arm = branch(&diagram, "b/branch-point-1");
        joined(arm, 0, Kind::BranchPoint, 0.0, 1e-8);
        for point in &arm.points {
            let mu = point.parameters[arm.free];
            let x = point.ranges[0].iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            assert!(near(x, mu.abs().sqrt(), TOLERANCE), "{offset}, {mu}: {x}");
        }
    }
}

/// On the line x = p, and on the cycles of the van der Pol oscillator.
#[test]
fn marks_lie_at_the_requested_values_and_a_stop_ends_the_branch() {
    let model = "[parameters]\np = 0.5\n[states.x]\nequation = \"p - x\"\n[outputs]\nsquare = \"x^2\"\n";
    let diagram = explored(
        model,
        "attractor = \"equilibrium\"",
        "free = \"p\"\nrange = [-3, 3]\nmark = { p = [0.25, 1], square_max = 0.01 }\nstop = { x_max = [2, -1.5] }",
    );
    let line = branch(&diagram, "b");
    let places: Vec<f64> = line.special.iter().map(|s| parameter(line, s)).collect();
    let mut sorted = places.clone();
    sorted.sort_by(f64::total_cmp);
    let expected = [-1.5, -0.1, 0.1, 0.25, 1.0, 2.0];
    assert!(
        sorted.len() == expected.len() && sorted.iter().zip(expected).all(|(a, b)| near(*a, b, 1e-8)),
        "{sorted:?}"
    );
    // Marks of the parameter itself are exact to the last bit.
    assert!(places.contains(&0.25) && places.contains(&1.0), "{places:?}");
    ends(line, ["asked", "asked"]);
    let reach = [line.points.first(), line.points.last()].map(|p| p.unwrap().parameters[0]);
    assert!(near(reach[0], -1.5, 1e-8) && near(reach[1], 2.0, 1e-8), "{reach:?}");

    let diagram = explored(
        VAN_DER_POL,
        "attractor = \"cycle\"\nparameters = { mu = 1 }",
        "free = \"mu\"\nrange = [0.2, 12]\nmark = { mu = 10, period = 10 }",
    );
    let cycles = branch(&diagram, "b");
    let [at_ten, long] = [true, false].map(|at| {
        let found = cycles.special.iter().find(|s| (parameter(cycles, s) == 10.0) == at);
        found.unwrap_or_else(|| panic!("{:?}", cycles.special.len()))
    });
    // A separate code, to the digits given.
    period_is(at_ten.point.solution.period(), 19.07836957, TOLERANCE);
    period_is(long.point.solution.period(), 10.0, 2.0 * TOLERANCE);
    assert!(near(at_ten.point.ranges[0][1], 2.01428536, TOLERANCE));
}

/// Closed form of the defining equations; both Hopf points are subcritical, one between the folds and one outside them.
#[test]
fn co_oxidation_has_two_folds_and_two_subcritical_hopf_points() {
    let diagram = explored(
        include_str!("../../../models/co-oxidation.toml"),
        "attractor = \"equilibrium\"\nparameters = { q2 = 0.9 }",
        "free = \"q2\"\nrange = [0.5, 2]",
    );
    let expected = [
        (Kind::Hopf, 1.04099156953),
        (Kind::Fold, 1.04204850),
        (Kind::Hopf, 1.05155746246),
        (Kind::Fold, 1.0522002878699546),
    ];
    let found = has(branch(&diagram, "b"), &expected, 2e-8);
    for hopf in [&found[0], &found[2]] {
        assert_eq!(hopf.criticality(), Some("subcritical"), "{}", hopf.normal_form());
    }
}

/// A conservative oscillator has a cycle of every amplitude, all at the same value of a damping parameter: elliptic
/// integrals for x'' + x + x³ = 0.
#[test]
fn a_conservative_oscillator_has_the_periods_of_its_elliptic_integrals() {
    let diagram = explored(
        include_str!("../../../models/duffing.toml"),
        "attractor = \"equilibrium\"\nsamples = 16",
        "free = \"p\"\nrange = [-1, 1]\nswitch = { hopf = 1 }\nmark = { x_max = [1, 2] }\nstop = { x_max = 2.5 }",
    );
    let family = branch(&diagram, "b/hopf-1");
    let marks: Vec<&SpecialPoint> = family.special.iter().filter(|s| s.kind == Kind::Mark).collect();
    for (amplitude, period) in [(1.0, 4.76802203), (2.0, 3.17972332)] {
        let found = marks.iter().find(|s| near(s.point.ranges[0][1], amplitude, TOLERANCE)).unwrap();
        assert!(parameter(family, found).abs() < TOLERANCE);
        // The period changes by 2 when the amplitude changes by 1.
        period_is(found.point.solution.period(), period, 3.0 * TOLERANCE);
    }
}

#[test]
fn averages_over_a_cycle_match_closed_forms() {
    use foldline::special::quantity::Quantity;
    // A circle of radius r: means 0, root mean squares r/√2, norm r, and the output r itself; its integral over a
    // period is 2πr.
    let line = "attractor = \"cycle\"\nparameters = { growth = 1 }";
    let diagram =
        explored(STUART_LANDAU, line, "free = \"growth\"\nrange = [0.25, 4]\nmark = { x_rms = 0.5, norm = 1.5 }");
    let circle = branch(&diagram, "b");
    let marked: Vec<f64> = circle.special.iter().map(|s| parameter(circle, s)).collect();
    assert!(marked.len() == 2 && near(marked[0], 0.5, 1e-8) && near(marked[1], 2.25, 1e-8), "{marked:?}");
    for point in &circle.points {
        let r = parameter_of(circle, point).sqrt();
        let of = |quantity: Quantity| quantity.of(point).unwrap();
        assert!(of(Quantity::Mean(0)).abs() < 1e-9 && near(of(Quantity::Rms(1)), r / 2f64.sqrt(), 1e-8));
        assert!(near(of(Quantity::Norm(2)), r, 1e-8) && near(of(Quantity::Mean(2)), r, 1e-8));
        assert!(near(of(Quantity::Integral(2)), std::f64::consts::TAU * r, TOLERANCE));
    }
    // Integration by parts: along a cycle of x'' = μ (1 - x²) x' - x the means of (x x')' and x x' (1 - x²) vanish, so
    // those of x'² and x² agree.
    let diagram = explored(VAN_DER_POL, "attractor = \"cycle\"", "free = \"mu\"\nrange = [0.5, 4]");
    for point in &branch(&diagram, "b").points {
        let [x, v] = [0, 1].map(|k| Quantity::Rms(k).of(point).unwrap());
        assert!(x > 1.0 && near(v, x, TOLERANCE), "{x} {v}");
    }
    // For an equilibrium all of them are the value itself, and there is no period to integrate over.
    let diagram = explored(
        STUART_LANDAU,
        "state = { x = 0, y = 0 }\nparameters = { growth = -1 }",
        "free = \"growth\"\nrange = [-2, -0.5]",
    );
    let rest = &branch(&diagram, "b").points[0];
    assert_eq!(Quantity::Mean(2).of(rest), Some(0.0));
    assert_eq!(Quantity::Integral(2).of(rest), None);
}

fn parameter_of(branch: &Branch, point: &foldline::diagram::Point) -> f64 {
    point.parameters[branch.free]
}
