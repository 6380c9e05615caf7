//! Problems from other fields whose stability changes are easily missed: canards, nearby bifurcations, symmetries,
//! families at one parameter value. Reference values are closed forms or come from the source that each test names.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind};
use foldline::explore::{self, System};
use foldline::verify;
use foldline_store::study_file::parse_study;

const TOLERANCE: f64 = 1e-6;

/// Runs a study of one branch "b" and returns its diagram.
#[track_caller]
fn followed(tolerance: f64, model: &str, seed: &str, branch: &str) -> Diagram {
    let text = format!(
        "model = \"m\"\ntolerance = {tolerance}\n[[seed]]\nname = \"s\"\n{seed}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n{branch}\n"
    );
    let study = parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let system = System::of_plan(&study.model, &study.plan);
    explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved)
}

/// Runs a study of one branch "b" and asserts that every change of stability is explained.
#[track_caller]
fn run_at(tolerance: f64, model: &str, seed: &str, branch: &str) -> Diagram {
    let diagram = followed(tolerance, model, seed, branch);
    diagram.branches.iter().for_each(is_explained);
    diagram
}

#[track_caller]
fn run(model: &str, seed: &str, branch: &str) -> Diagram {
    run_at(TOLERANCE, model, seed, branch)
}

/// Asserts that between neighbouring points the number of unstable multipliers changes as the special points between
/// them say.
#[track_caller]
fn is_explained(branch: &Branch) {
    assert!(branch.special.iter().all(|s| s.kind != Kind::Unexplained), "{}: {:?}", branch.name, told(branch));
    for pair in branch.points.windows(2) {
        let mut count = pair[0].unstable;
        for special in branch.special.iter().filter(|s| s.point.position == pair[0].position) {
            assert_eq!(count, special.unstable_before, "{}: before {:?}", branch.name, told(branch));
            count = special.unstable_after;
        }
        let family = pair[0].is_one_of_family() != pair[1].is_one_of_family();
        let silent = count.abs_diff(pair[1].unstable);
        assert!(silent <= usize::from(family), "{}: silently at {:?}", branch.name, pair[1].parameters);
    }
}

fn told(branch: &Branch) -> Vec<(Kind, f64, usize, usize)> {
    let value = |p: &foldline::diagram::Point| p.parameters[branch.free];
    branch.special.iter().map(|s| (s.kind, value(&s.point), s.unstable_before, s.unstable_after)).collect()
}

/// Asserts the special points of a branch by increasing parameter, each within `error` and within its stated error.
#[track_caller]
fn has(diagram: &Diagram, name: &str, expected: &[(Kind, f64, [usize; 2])], error: f64) {
    let names: Vec<&str> = diagram.branches.iter().map(|b| b.name.as_str()).collect();
    let branch = diagram.branch(name).unwrap_or_else(|| panic!("no branch {name} among {names:?}"));
    let mut found = told(branch);
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    let same = found.len() == expected.len()
        && found.iter().zip(expected).all(|((kind, value, before, after), (own, right, counts))| {
            let order = [*before, *after] == *counts || [*after, *before] == *counts;
            kind == own && (value - right).abs() <= error * (1.0 + right.abs()) && order
        });
    assert!(same, "{name}: {found:?}, expected {expected:?}");
}

fn ends(diagram: &Diagram, name: &str) -> Vec<String> {
    let ends = &diagram.branch(name).expect(name).ends;
    let mut codes: Vec<String> = ends.iter().flatten().map(|end| end.code().to_string()).collect();
    codes.sort();
    codes
}

const REST: &str = "attractor = \"equilibrium\"";

fn fitzhugh_nagumo(epsilon: f64) -> String {
    format!(
        "name = \"FitzHugh-Nagumo\"\n[parameters]\nI = 0.0\n[states]\nv = \"v - v^3/3 - w + I\"\nw = \"{epsilon}*(v + 0.7 - 0.8*w)\"\n"
    )
}

/// The cycles born at two subcritical Hopf points become stable in a canard explosion, along which the current is
/// constant to twelve digits. Values: integration with DOP853 from both sides of the explosion.
#[test]
fn folds_in_canard_explosions_are_found() {
    let branch = "free = \"I\"\nrange = [-0.5, 2]\nswitch = { hopf = 1 }";
    let diagram = run(&fitzhugh_nagumo(0.09), REST, branch);
    has(&diagram, "b/hopf-1", &[(Kind::Fold, 0.3282489, [1, 0]), (Kind::Fold, 1.4217511, [0, 1])], 1e-6);
    for epsilon in [0.085, 0.08] {
        let diagram = run(&fitzhugh_nagumo(epsilon), REST, branch);
        let kinds: Vec<Kind> = told(diagram.branch("b/hopf-1").unwrap()).iter().map(|s| s.0).collect();
        assert_eq!((kinds, ends(&diagram, "b/hopf-1")), (vec![Kind::Fold; 2], vec!["joined".into(); 2]), "{epsilon}");
    }
}

/// x' = y - x³/3 + x, y' = eps (a - x): one equilibrium, no saddle, so no homoclinic orbit. The cycles lead from a = -1
/// to a = 1 through two explosions at ±(1 - eps/8 - 3 eps²/32 - 173 eps³/1024), with periods above 460 on the way.
#[test]
fn canards_lead_from_hopf_point_to_hopf_point() {
    for epsilon in [0.1, 0.05, 0.01f64] {
        let model = format!(
            "name = \"canard\"\n[parameters]\na = 1.2\n[states]\nx = \"y - x^3/3 + x\"\ny = \"{epsilon}*(a - x)\"\n"
        );
        let diagram = run(&model, REST, "free = \"a\"\nrange = [-1.1, 1.5]\nswitch = { hopf = 1 }");
        assert_eq!(ends(&diagram, "b/hopf-1"), ["joined", "joined"], "{epsilon}");
        let cycles = diagram.branch("b/hopf-1").unwrap();
        assert!(cycles.special.is_empty(), "{epsilon}: {:?}", told(cycles));
        let longest = |p: &&foldline::diagram::Point| p.solution.period().unwrap();
        let at = cycles.points.iter().max_by(|a, b| longest(a).total_cmp(&longest(b))).unwrap();
        let canard = 1.0 - epsilon / 8.0 - 3.0 * epsilon.powi(2) / 32.0 - 173.0 * epsilon.powi(3) / 1024.0;
        // The next term of the series.
        let error = 2.0 * epsilon.powi(4) + 1e-7;
        assert!((at.parameters[0].abs() - canard).abs() < error, "{epsilon}: {:?} {canard}", at.parameters);
    }
}

const CIRCUIT: &str = "name = \"circuit\"\n[parameters]\nnu = -0.9\n[definitions]\nd = \"y - x\"\n[states]\n\
    x = \"(-(0.5 + nu)*x + 0.5*y - 0.328578*x^3 + 0.933578*d^3)/0.6\"\ny = \"0.5*x + 0.1*y - z - 0.933578*d^3\"\nz = \"y\"\n";

/// A fold and a pitchfork of cycles on one step: AUTO-07p, demo tor, at fine settings. Further turns towards a
/// heteroclinic cycle have such pairs, closer each time, with stable cycles between them; their periods are from a run
/// at a tolerance of 1e-8.
#[test]
fn a_fold_and_a_branch_point_of_symmetric_cycles_on_one_step_are_told_apart() {
    let branch = "free = \"nu\"\nrange = [-0.9, -0.4]\nswitch = { hopf = 1 }\nstop = { period = 45 }";
    for tolerance in [1e-6, 1e-8] {
        let diagram = run_at(tolerance, CIRCUIT, "state = { x = 0, y = 0, z = 0 }", branch);
        let cycles = diagram.branch("b/hopf-1").unwrap();
        let at = |kind: Kind, value: f64| {
            let near = |s: &&foldline::diagram::SpecialPoint| (s.point.parameters[0] - value).abs() < 3e-7;
            let found = cycles.special.iter().filter(|s| s.kind == kind).find(near);
            found.unwrap_or_else(|| panic!("{kind} {value}: {:?}", told(cycles))).point.solution.period().unwrap()
        };
        assert!((at(Kind::Fold, -0.83251414538) - 19.415681454).abs() < 3e-6);
        assert!((at(Kind::BranchPoint, -0.832437931) - 19.63664549).abs() < 3e-6);
        assert!((at(Kind::BranchPoint, -0.787592846) - 29.310535).abs() < 3e-5);
        assert!((at(Kind::Fold, -0.787590311) - 29.372974).abs() < 3e-5);
        assert!((at(Kind::Fold, -0.799899174) - 39.366380).abs() < 3e-5);
        assert!((at(Kind::BranchPoint, -0.799899143) - 39.381419).abs() < 3e-5);
    }
}

const CHAIN: &str = "name = \"food chain\"\n[parameters]\nd1 = 1.1083\nd2 = 0.01\n[states]\n\
    x = \"1 - exp(x) - 5*exp(y)/(1 + 3*exp(x))\"\ny = \"5*exp(x)/(1 + 3*exp(x)) - d1 - 0.1*z/(1 + 2*exp(y))\"\n\
    z = \"z*(0.1*exp(y)/(1 + 2*exp(y)) - d2)\"\n";

/// Cycles of three species shrink to a Hopf point next to a fold of equilibria; AUTO-07p, demo tfc.
#[test]
fn cycles_that_shrink_to_an_equilibrium_next_to_its_fold_end_there() {
    let seed = "state = { x = -1.0, y = -1.2, z = 0 }\nparameters = { d1 = 0.75, d2 = 0.05 }";
    let diagram = run(CHAIN, seed, "free = \"d2\"\nrange = [0.005, 0.1]\nswitch = { branch-point = 1 }");
    has(&diagram, "b", &[(Kind::BranchPoint, 0.0155004, [1, 0])], 2e-6);
    let ends = &diagram.branch("b/branch-point-1").unwrap().ends;
    let at = |value: f64| {
        ends.iter()
            .flatten()
            .any(|end| matches!(end, Ending::Joined { at: Kind::Hopf, parameter } if (parameter - value).abs() < 1e-6))
    };
    assert!(at(0.017340743), "{ends:?}");
}

/// Two states that can be exchanged: a pitchfork at 1/2 at which no state changes sign.
#[test]
fn a_pitchfork_under_a_permutation_is_one_branch_point_on_both_branches() {
    let model = "name = \"swap\"\n[parameters]\nmu = 0\n[states]\na = \"1 - a + mu*(a - b) - (a - b)^3\"\n\
        b = \"1 - b - mu*(a - b) + (a - b)^3\"\n";
    let branch = "free = \"mu\"\nrange = [0, 2]\nswitch = { branch-point = 1 }";
    let diagram = run(model, "state = { a = 1, b = 1 }", branch);
    has(&diagram, "b", &[(Kind::BranchPoint, 0.5, [0, 1])], 1e-8);
    has(&diagram, "b/branch-point-1", &[(Kind::BranchPoint, 0.5, [0, 0])], 1e-8);
}

/// Three uncoupled double wells: a three-dimensional kernel.
#[test]
fn eigenvalues_that_vanish_together_are_one_branch_point() {
    let model =
        "name = \"wells\"\n[parameters]\np = -1\n[states]\nx = \"p*x - x^3\"\ny = \"p*y - y^3\"\nz = \"p*z - z^3\"\n";
    let diagram = run(model, "state = { x = 0, y = 0, z = 0 }", "free = \"p\"\nrange = [-1, 2]");
    has(&diagram, "b", &[(Kind::BranchPoint, 0.0, [0, 3])], 1e-8);
}

/// Two oscillators with different frequencies and the same threshold, mu = 0.
#[test]
fn simultaneous_hopf_points_of_two_pairs_are_both_named() {
    let pair = |u: &str, v: &str, w: f64| {
        format!("{u} = \"mu*{u} - {w}*{v} - {u}*({u}^2 + {v}^2)\"\n{v} = \"{w}*{u} + mu*{v} - {v}*({u}^2 + {v}^2)\"\n")
    };
    let model =
        format!("name = \"two\"\n[parameters]\nmu = -0.5\n[states]\n{}{}", pair("a", "b", 1.0), pair("c", "d", 1.7));
    let diagram = run(&model, "state = { a = 0, b = 0, c = 0, d = 0 }", "free = \"mu\"\nrange = [-0.5, 1]");
    has(&diagram, "b", &[(Kind::Hopf, 0.0, [0, 2]), (Kind::Hopf, 0.0, [2, 4])], 1e-8);
}

/// An absorber tuned to half the frequency: on the doubled branch some states still repeat exactly after half the
/// period. The result must not depend on the positions of the steps.
#[test]
fn a_doubled_branch_ends_at_both_its_doublings_whatever_the_tolerance() {
    let model = "name = \"absorber\"\n[parameters]\nw = 1.9\n[forcing]\nfrequency = \"w\"\n[states]\n\
        a = { equation = \"va\", scale = 0.2 }\nb = { equation = \"vb\", scale = 0.2 }\n\
        va = { equation = \"-0.02*va - a - 2*a*b\", scale = 0.2 }\n\
        vb = { equation = \"-0.04*vb - 4*b - a^2 + 0.02*cos(w*t)\", scale = 0.2 }\n";
    let seed = "state = { a = 0, b = 0, va = 0, vb = 0 }\nparameters = { w = 1.7 }";
    for tolerance in [1e-5, 3e-6, 1e-6, 3e-7, 1e-7] {
        let branch = "free = \"w\"\nrange = [1.7, 2.3]\nswitch = { period-doubling = 1 }";
        let diagram = run_at(tolerance, model, seed, branch);
        let doublings = [(Kind::PeriodDoubling, 1.931133184, [0, 1]), (Kind::PeriodDoubling, 2.066795275, [1, 0])];
        has(&diagram, "b", &doublings, 1e-6);
        let folds = [(Kind::Fold, 1.844668595, [1, 0]), (Kind::Fold, 2.105049736, [0, 1])];
        has(&diagram, "b/period-doubling-1", &folds, 1e-6);
        assert_eq!(ends(&diagram, "b/period-doubling-1"), ["joined", "joined"], "{tolerance}");
        assert_eq!(diagram.branches.len(), 2, "{tolerance}");
    }
}

/// Linear until the stop is touched: the doubled branches are vertical up to there, so that the grazing lies at the
/// parameter value of the period doubling.
#[test]
fn a_branch_that_is_vertical_up_to_contact_has_no_folds_on_the_way() {
    let model = "name = \"stop\"\n[parameters]\nw = 1.98\n[forcing]\nfrequency = \"w\"\n[states]\n\
        x = { equation = \"v\", range = [-1, 1] }\n\
        v = { equation = \"0.1 - 0.1*v - (1 + 0.23*cos(w*t))*max(x, 0)\", range = [-1, 1] }\n";
    let seed = "state = { x = 0.1, v = 0 }\nparameters = { w = 1.8 }";
    let diagram = run(model, seed, "free = \"w\"\nrange = [1.8, 2.3]\nswitch = { period-doubling = 1 }");
    let doublings: Vec<f64> = told(diagram.branch("b").unwrap()).iter().map(|(_, w, ..)| *w).collect();
    let [first, second] = doublings[..] else { panic!("{doublings:?}") };
    // In contact, the cycles that leave the first doubling are unstable.
    for (name, at, counts) in [("b/period-doubling-1", first, [0, 1]), ("b/period-doubling-2", second, [0, 0])] {
        has(&diagram, name, &[(Kind::Grazing, at, counts)], 1e-5);
        assert_eq!(ends(&diagram, name), ["bound", "joined"]);
    }
}

/// alpha + beta = 2: the Hopf point is degenerate, and a vertical family of cycles leads to a heteroclinic cycle
/// between three saddles.
#[test]
fn a_vertical_family_ends_at_its_heteroclinic_cycle() {
    let model = "name = \"competition\"\n[parameters]\nalpha = 0.5\n[states]\nx = \"x*(1 - x - alpha*y - 1.3*z)\"\n\
        y = \"y*(1 - 1.3*x - y - alpha*z)\"\nz = \"z*(1 - alpha*x - 1.3*y - z)\"\n";
    let seed = "state = { x = 0.35, y = 0.35, z = 0.35 }";
    let diagram = followed(TOLERANCE, model, seed, "free = \"alpha\"\nrange = [0.3, 0.95]\nswitch = { hopf = 1 }");
    assert_eq!(ends(&diagram, "b/hopf-1"), ["heteroclinic", "joined"]);
}

/// A spherical oscillator that swings in a plane: a multiplier is 1 because the plane can be rotated.
#[test]
fn rotational_symmetry_makes_no_branch_points() {
    let force = |own: &str| format!("-0.04*v{own} - (1 + 0.2*cos(w*t) + x^2 + y^2)*{own}");
    let model = format!(
        "name = \"spherical\"\n[parameters]\nw = 2.0\n[forcing]\nfrequency = \"w\"\n[states]\nx = \"vx\"\ny = \"vy\"\nvx = \"{}\"\nvy = \"{}\"\n",
        force("x"),
        force("y")
    );
    let branch = "free = \"w\"\nrange = [1.95, 2.05]\nmax-points = 30";
    for tolerance in [1e-5, 1e-6, 1e-8] {
        let diagram = run_at(tolerance, &model, "state = { x = 0.3, y = 0, vx = 0, vy = 0 }", branch);
        has(&diagram, "b", &[], 0.0);
    }
}

/// Cycles that end on a saddle-node: r' = r (1 - r²), φ' = p - cos φ, at p = 1; the period is 2π/(p² - 1)^½.
#[test]
fn a_saddle_node_on_the_cycle_is_named() {
    let model = "name = \"circle\"\n[parameters]\np = 1.5\n[definitions]\nr = \"sqrt(x^2 + y^2)\"\n[states]\n\
        x = \"x*(1 - r^2) - y*(p - x/r)\"\ny = \"y*(1 - r^2) + x*(p - x/r)\"\n";
    let diagram = run(model, "attractor = \"cycle\"", "free = \"p\"\nrange = [0.5, 2]");
    let end = diagram.branch("b").unwrap().ends.iter().flatten().find(|end| end.code() == "saddle-node-on-cycle");
    let Some(Ending::Connecting { parameter, .. }) = end else { panic!("{:?}", diagram.branch("b").unwrap().ends) };
    assert!((parameter - 1.0).abs() < 1e-8, "{parameter}");
}

/// An oscillator with a stop: f_x jumps where it touches. Every error of profiles, ranges and multipliers is at least
/// that found by shooting, which integrates from event to event. (With other scales the steps are different, and the
/// doubled branch may break up at its start: its meshes have no boundaries at the contacts.)
#[test]
fn stated_errors_of_cycles_with_contact_are_reliable() {
    let model = "name = \"stop\"\n[parameters]\nw = { value = 0.5, scale = 0.5 }\nF = 0.3\nc = 0.06\nk = 8\ngap = 0.5\n[forcing]\nfrequency = \"w\"\n[states]\n\
        x = \"v\"\nv = \"-x - c*v - k*max(x - gap, 0) + F*cos(w*t)\"\n";
    let text = "model = \"m\"\n[[seed]]\nname = \"s\"\nstate = { x = 0, v = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"w\"\n\
        range = [0.4, 2.6]\nswitch = { period-doubling = 1 }\n";
    let study = parse_study(text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    assert!(diagram.branch("b").unwrap().special.len() >= 4 && diagram.branches.len() == 2);
    let found = verify::verify(&system, &diagram, study.plan.tolerance, None, &|_| true);
    let own = |check: &&verify::Check| {
        matches!(check.quantity, verify::Quantity::Profile | verify::Quantity::Range | verify::Quantity::Spectrum)
    };
    assert!(found.points > 100 && found.checks.iter().filter(own).count() > 300);
    let wrong: Vec<String> = found.wrong().filter(own).map(|check| format!("{check:?}")).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// The second normal mode of two masses (Kerschen et al., Mech. Syst. Signal Process. 23 (2009) 170), started at the
/// Hopf point of the linear system: stability is lost once, where a pair of multipliers meets at 1. Half-period
/// shooting gives the period 4.902862 there.
#[test]
fn a_family_of_cycles_parametrised_by_energy_loses_stability_at_one_point() {
    let model = "name = \"masses\"\n[parameters]\ndelta = -0.005\n[states]\nx1 = \"v1\"\nv1 = \"-2*x1 + x2 - 0.5*x1^3 + delta*v1\"\n\
                 x2 = \"v2\"\nv2 = \"-2*x2 + x1 + delta*v2\"\n";
    let branch =
        "free = \"delta\"\nrange = [-0.01, 0.01]\nswitch = { hopf = 1 }\nstop = { period = 4.85 }\nmax-points = 400";
    let diagram = run(model, REST, branch);
    let family = diagram.branch("b/hopf-2").unwrap();
    let special: Vec<_> = family.special.iter().filter(|s| s.kind != Kind::Mark).collect();
    let [point] = &special[..] else { panic!("{:?}", told(family)) };
    let period = point.point.solution.period().unwrap();
    assert_eq!((point.kind, point.unstable_before, point.unstable_after), (Kind::BranchPoint, 0, 1));
    assert!((period - 4.902862).abs() < 1e-5, "{period}");
}
