//! Piecewise-smooth models, continued without smoothing: against closed forms, and against cycles computed by multiple
//! shooting with event location.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind, SpecialPoint};
use foldline::explore::{self, System};
use foldline_store::study_file::parse_study;

const ROTOR: &str = include_str!("../../../models/overhung-rotor-piecewise.toml");
const REFERENCE: &str = include_str!("reference/exact_contact.csv");

/// x'' + c x' + x + k max(x - d, 0) = A cos(w t).
fn oscillator(d: f64, k: f64, a: f64) -> String {
    format!(
        "name = \"spring\"\n[parameters]\nw = 1\nc = 0.05\nA = {a}\nd = {d}\nk = {k}\n[forcing]\nfrequency = \"w\"\n\
         [states.x]\nequation = \"v\"\nrange = [-2, 2]\n[states.v]\n\
         equation = \"A*cos(w*t) - c*v - x - k*max(x - d, 0)\"\nrange = [-2, 2]\n"
    )
}

#[track_caller]
fn run(model: &str, study: &str) -> Diagram {
    let text = format!("model = \"m\"\n{study}");
    let study = parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved)
}

/// Returns a branch that is complete and has no unexplained change of stability.
#[track_caller]
fn branch<'d>(diagram: &'d Diagram, name: &str) -> &'d Branch {
    let found = diagram.branch(name).unwrap_or_else(|| panic!("{name}"));
    assert!(found.ends.iter().all(|end| end.as_ref().is_some_and(Ending::complete)), "{name}: {:?}", found.ends);
    assert!(found.special.iter().all(|special| special.kind != Kind::Unexplained), "{name}");
    found
}

/// Asserts that a branch has these special points and no others, each within `error` and within its stated error.
#[track_caller]
fn has(branch: &Branch, expected: &[(Kind, f64)], error: f64) {
    let value = |special: &SpecialPoint| special.point.parameters[branch.free];
    let mut found: Vec<(Kind, f64, f64)> = branch.special.iter().map(|s| (s.kind, value(s), s.error)).collect();
    found.retain(|(kind, ..)| *kind != Kind::Mark);
    let mut expected = expected.to_vec();
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    expected.sort_by(|a, b| a.1.total_cmp(&b.1));
    assert_eq!(found.len(), expected.len(), "{}: {found:?}", branch.name);
    for ((kind, own, stated), (wanted, known)) in found.iter().zip(&expected) {
        let off = (own - known).abs() / (1.0 + known.abs());
        assert!(kind == wanted && off < error && off < *stated, "{}: {kind} {own}, {wanted} {known}", branch.name);
    }
}

/// Folds and grazings of the response of an oscillator that touches a spring.
#[test]
fn a_response_passes_the_grazings_of_its_stop() {
    let study = "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nparameters = { w = 0.6 }\nsamples = 8\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"w\"\nrange = [0.5, 1.6]\n\
        [[curve]]\nname = \"graze\"\nhold = \"grazing\"\nof = \"b\"\nnear = 1.13\nfree = \"A\"\nrange = [0.1, 1]\n";
    let diagram = run(&oscillator(1.0, 5.0, 0.3), study);
    // The grazings are those of the linear oscillator: A² = (1 - w²)² + (c w)². Folds: multiple shooting.
    let known = [
        (Kind::Grazing, 0.838417181211),
        (Kind::Fold, 1.335112494893),
        (Kind::Fold, 1.137578740375),
        (Kind::Grazing, 1.137785845513),
    ];
    has(branch(&diagram, "b"), &known, 1e-9);
    let contacts: Vec<&str> =
        branch(&diagram, "b").special.iter().filter(|s| s.kind == Kind::Grazing).map(|s| s.remark.as_str()).collect();
    assert_eq!(contacts, ["contacts 0 → 1 at x - d = 0", "contacts 1 → 0 at x - d = 0"]);
    let curve = branch(&diagram, "graze");
    assert!(curve.points.len() > 10);
    for point in &curve.points {
        let [w, c, a] = [0, 1, 2].map(|k| point.parameters[k]);
        let linear = (1.0 - w * w).hypot(c * w);
        assert!((a - linear).abs() < 1e-8, "w = {w}: {a} {linear}");
    }
}

/// The cascade of an oscillator that rests on its spring, down to four contacts in a period.
#[test]
fn a_cascade_of_contacts_is_followed_in_one_run() {
    let study = "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nparameters = { w = 5 }\nsamples = 8\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"w\"\nrange = [0.25, 5]\n";
    let diagram = run(&oscillator(0.0, 3.0, 1.0), study);
    let found = branch(&diagram, "b");
    for known in [0.908106906274, 2.229866860488, 3.465709945235] {
        let near = |s: &&SpecialPoint| s.kind == Kind::PeriodDoubling && (s.point.parameters[0] - known).abs() < 1e-9;
        assert_eq!(found.special.iter().filter(near).count(), 1, "{known}");
    }
    let most = found.special.iter().filter(|s| s.remark.contains(" 4 ")).count();
    assert!(most >= 2, "four contacts begin and end");
}

/// Cycles, folds, doublings and grazings of the rotor, with no starting solution given. Two pairs of points are 2.6e-8 and
/// 1.3e-6 apart.
#[test]
fn the_rotor_agrees_with_multiple_shooting() {
    let marks = |values: &str| format!("mark = {{ Omega = [{values}] }}\n");
    let seed = |name: &str, ratio: &str| {
        format!(
            "[[seed]]\nname = \"{name} seed\"\nattractor = \"{ratio}\"\nsamples = 48\n\
             parameters = {{ Omega = 5, kappa = 1 }}\n[[branch]]\nname = \"{name}\"\nfrom = \"{name} seed\"\n\
             free = \"Omega\"\nrange = [0.5, 12]\n"
        )
    };
    let study = format!(
        "tolerance = 1e-9\n{}{}{}{}",
        seed("SL", "2:1"),
        marks("5, 6, 8, 10, 4, 3.5"),
        seed("DL", "3:1"),
        marks("5, 5.5, 4.5, 3")
    );
    let diagram = run(ROTOR, &study);
    for name in ["SL", "DL"] {
        let own = branch(&diagram, name);
        assert!(own.ends.iter().all(|end| *end == Some(Ending::Closed)), "{name}");
        let r_max = |s: &SpecialPoint| s.point.ranges[4][1];
        let period = |s: &SpecialPoint| s.point.solution.period().unwrap_or(f64::NAN);
        let rows = REFERENCE.lines().filter(|line| line.starts_with(name));
        let mut count = 0;
        for row in rows {
            let fields: Vec<&str> = row.split(',').collect();
            let number = |k: usize| fields[k].parse::<f64>().unwrap();
            let kind = if fields[1] == "cycle" { "mark" } else { fields[1] };
            let off = |s: &SpecialPoint| {
                (s.point.parameters[0] - number(2))
                    .abs()
                    .max((period(s) - number(3)).abs())
                    .max((r_max(s) - number(4)).abs())
            };
            let nearest = own.special.iter().filter(|s| s.kind.name() == kind).min_by(|a, b| off(a).total_cmp(&off(b)));
            let nearest = nearest.unwrap_or_else(|| panic!("{row}"));
            assert!(off(nearest) < 2e-9, "{row}: {:e}", off(nearest));
            count += 1;
        }
        assert!(count >= 9, "{name}: {count} rows");
        // No others.
        let count = |kind: Kind| own.special.iter().filter(|s| s.kind == kind).count();
        let known = if name == "SL" { [2, 2, 2] } else { [4, 2, 2] };
        assert_eq!([Kind::Grazing, Kind::Fold, Kind::PeriodDoubling].map(count), known, "{name}");
    }
    // The lower fold of SL comes after its grazing: it has the second contact.
    let sl = branch(&diagram, "SL");
    let at = |kind: Kind, near: f64| {
        sl.special.iter().position(|s| s.kind == kind && (s.point.parameters[0] - near).abs() < 1e-6).unwrap()
    };
    assert_eq!(at(Kind::Grazing, 3.3544041).abs_diff(at(Kind::Fold, 3.3544041)), 1);
}

/// Liouville's formula: the multipliers of the rotor have the product exp(-4 ζ T), contacts or not.
#[test]
fn multipliers_through_contacts_have_the_product_that_damping_gives() {
    let study = "[[seed]]\nname = \"s\"\nattractor = \"2:1\"\nsamples = 48\nparameters = { Omega = 5, kappa = 1 }\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [4, 6]\n";
    let diagram = run(ROTOR, study);
    for point in &branch(&diagram, "b").points {
        let logarithms: f64 = point.spectrum.iter().map(|z| z.norm().ln()).sum();
        let known = -4.0 * 0.01 * point.solution.period().unwrap();
        assert!((logarithms - known).abs() < 1e-7, "{:?}: {logarithms} {known}", point.parameters);
    }
}

/// The synchronous response meets the ring twice: without contact r = m ε Ω² / |K|, with the complex stiffness K of the
/// free rotor, so that the speeds are roots of |K| = m ε Ω².
#[test]
fn an_equilibrium_is_followed_through_the_ring() {
    let study = "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nstate = { u = 0.05, v = 0, du = 0, dv = 0 }\n\
        parameters = { Omega = 0.5, kappa = 1 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [0.3, 12]\n\
        [[curve]]\nname = \"surface\"\nhold = \"boundary-equilibrium\"\nof = \"b\"\nnear = 0.9\nfree = \"zeta\"\nrange = [0.001, 0.2]\n";
    let diagram = run(ROTOR, study);
    let own = branch(&diagram, "b");
    let known = [
        (Kind::BoundaryEquilibrium, 0.922_939_708_471_828_7),
        (Kind::BoundaryEquilibrium, 1.361_281_599_075_294_3),
        // Fold of the synchronous rub, in closed form.
        (Kind::Fold, 3.556165897505),
    ];
    has(own, &known, 1e-11);
    let becomes: Vec<&str> = own.special.iter().map(|s| s.remark.split(" at ").next().unwrap_or_default()).collect();
    assert!(becomes.contains(&"persistence") && becomes.contains(&"non-smooth fold"), "{becomes:?}");
    for point in &branch(&diagram, "surface").points {
        let [omega, zeta] = [point.parameters[0], point.parameters[2]];
        let square = (1.0 - (1.0 - 0.143) * omega * omega).powi(2) + (2.0 * zeta * omega).powi(2);
        assert!((square.sqrt() - 0.9 * 0.353 * omega * omega).abs() < 1e-8, "{omega} {zeta}");
    }
}

/// Motion in the plane with a vertical switching line: r' = r (1 - r), θ' = 1 on the left, r' = α r (β - r), θ' = γ + β - r
/// on the right, in Cartesian coordinates. f jumps; the half turns are integrated in closed form.
#[test]
fn a_cycle_of_two_fields_has_the_period_of_its_closed_form() {
    let model = "name = \"piecewise\"\n[parameters]\nal = 1\nbe = 2\nga = 1.5\n[definitions]\nr = \"hypot(x, y)\"\n\
        grow = \"if(x < 0, 1 - r, al*(be - r))\"\nturn = \"if(x < 0, 1, ga + be - r)\"\n[states]\n\
        x = { equation = \"grow*x - turn*y\", range = [-2, 2] }\ny = { equation = \"grow*y + turn*x\", range = [-2, 2] }\n";
    let study = "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 8\n[[branch]]\nname = \"b\"\n\
        from = \"s\"\nfree = \"be\"\nrange = [1, 3]\nmark = { be = [1.5, 3, 1] }\n";
    let diagram = run(model, study);
    let own = branch(&diagram, "b");
    let known = [
        (1.0, 5.2359877559830, 0.0053215654788),
        (1.5, 4.9943371055140, 0.00345328163693),
        (3.0, 4.5416534430396, 0.00141989121684),
    ];
    for (be, period, multiplier) in known {
        let mark = own.special.iter().find(|s| s.kind == Kind::Mark && (s.point.parameters[1] - be).abs() < 1e-12);
        let point = &mark.unwrap_or_else(|| panic!("{be}")).point;
        let own = point.solution.period().unwrap();
        assert!((own - period).abs() < 1e-8, "{be}: {own}");
        let free = point.free_spectrum()[0].re;
        assert!((free - multiplier).abs() < 1e-7, "{be}: {free}");
    }
}

/// A grazing lies on a curve of period doublings in two parameters, and is named there.
#[test]
fn curves_of_bifurcations_name_the_grazings_on_them() {
    let study = "tolerance = 1e-7\n[[seed]]\nname = \"s\"\nattractor = \"2:1\"\nsamples = 48\n\
        parameters = { Omega = 5, kappa = 1 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [3, 12]\n\
        [[curve]]\nname = \"doublings\"\nhold = \"period-doubling\"\nof = \"b\"\nnear = 4.86\nfree = \"beta\"\nrange = [8, 30]\n\
        mark = { Omega = 8 }\n";
    let diagram = run(ROTOR, study);
    let curve = branch(&diagram, "doublings");
    assert_eq!(curve.special.iter().filter(|s| s.kind == Kind::Grazing).count(), 1);
    // Multiple shooting at Omega = 8.
    let mark = curve.special.iter().find(|s| s.kind == Kind::Mark).unwrap();
    assert!((mark.point.parameters[5] - 27.486939840396).abs() < 1e-6, "{:?}", mark.point.parameters);
}

/// Symmetric cycles of a preloaded spring, where f jumps, lose their symmetry.
#[test]
fn branches_that_cross_on_piecewise_cycles_are_switched_to() {
    let model = "name = \"preload\"\n[parameters]\np = 0.2\nw = 1.5\n[forcing]\nfrequency = \"w\"\n[states.x]\n\
        equation = \"v\"\nrange = [-2, 2]\n[states.v]\nequation = \"cos(w*t) - 0.1*v - x - p*sign(x)\"\nrange = [-2, 2]\n";
    let study = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nperiods = 1\nsamples = 8\n[[branch]]\nname = \"b\"\n\
        from = \"s\"\nfree = \"p\"\nrange = [-0.6, 0.5]\nswitch = { branch-point = 1 }\n";
    let diagram = run(model, study);
    // The half map has a multiplier -1. It is linear between the reversals, so that this is a single equation.
    has(branch(&diagram, "b"), &[(Kind::BranchPoint, -0.519_105_100_548_616)], 2e-7);
    assert!(branch(&diagram, "b/branch-point-1").points.len() > 5);
}

/// x' = p s - x with s = ±1 in either half of the period: the largest value p tanh(π/2) is at the switch, where x has a
/// corner.
#[test]
fn the_largest_value_at_a_corner_of_the_orbit_is_that_of_the_corner() {
    let model = "name = \"square wave\"\n[parameters]\np = 1\n[forcing]\nfrequency = 1\n[states.x]\n\
        equation = \"p*sign(sin(t)) - x\"\n";
    let study = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 8\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n\
        free = \"p\"\nrange = [0.5, 2]\n";
    let diagram = run(model, study);
    for point in &branch(&diagram, "b").points {
        let known = point.parameters[0] * std::f64::consts::FRAC_PI_2.tanh();
        let off = (point.ranges[0][1] - known).abs().max((point.ranges[0][0] + known).abs());
        assert!(off < 1e-9 && off < point.trust.discretisation, "{:?}: off {off}", point.parameters);
    }
}

/// Symmetric cycles between two stops lose their symmetry; the half map of event-located integration at 1e-12 has the
/// multiplier -1 there. Two of the multipliers have met shortly before.
#[test]
fn a_symmetry_is_lost_between_two_stops() {
    let model = "name = \"gap\"\n[parameters]\nw = 0.36\n[forcing]\nfrequency = \"w\"\n[states.x]\nequation = \"v\"\n\
        range = [-2, 2]\n[states.v]\nequation = \"0.9*cos(w*t) - 0.04*v - x - 30*(x - (abs(x + 0.5) - abs(x - 0.5))/2)\"\n\
        range = [-2, 2]\n";
    let study = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nperiods = 1\nsamples = 8\n[[branch]]\nname = \"b\"\n\
        from = \"s\"\nfree = \"w\"\nrange = [0.34, 0.5]\n";
    let diagram = run(model, study);
    let own = branch(&diagram, "b");
    let near = |s: &&SpecialPoint| {
        let off = (s.point.parameters[0] - 0.368_315_577_8).abs();
        s.kind == Kind::BranchPoint && off < s.error.min(1e-7)
    };
    assert_eq!(own.special.iter().filter(near).count(), 1);
    let stated: Vec<f64> = own.special.iter().map(|s| s.error).collect();
    assert!(stated.iter().all(|error| *error < 2e-6), "{stated:?}");
}

/// Stops up to 1e5 times as stiff as the spring bend the branch within 1e-10 of the grazing. Grazings: A² = (1 - w²)² +
/// (c w)² at half the amplitude A. Fold and doubling at k = 1000: closed form of cycles with one contact.
#[test]
fn stiff_stops_are_met_from_the_side_without_contact() {
    let model = |k: f64| {
        format!(
            "name = \"stop\"\n[parameters]\nw = 0.6\nk = {k}\n[forcing]\nfrequency = \"w\"\n[states.x]\n\
             equation = \"v\"\nrange = [-1, 1]\n[states.v]\n\
             equation = \"0.2*cos(w*t) - 0.1*v - x - if(x > 0.5, k*(x - 0.5), 0)\"\nrange = [-1, 1]\n"
        )
    };
    let study = |range: &str| {
        format!(
            "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nperiods = 1\nsamples = 8\n[[branch]]\nname = \"b\"\n\
             from = \"s\"\nfree = \"w\"\nrange = {range}\n"
        )
    };
    let grazing = (Kind::Grazing, 0.779_531_520_762_767_9);
    let doubling = (Kind::PeriodDoubling, 0.975_417_246_697);
    let fold = (Kind::Fold, 1.635_675_793_473);
    let cases = [(1e3, "[0.5, 2]", vec![grazing, doubling, fold]), (1e4, "[0.5, 0.8]", vec![grazing])];
    for (k, range, known) in cases {
        let diagram = run(&model(k), &study(range));
        let found = branch(&diagram, "b");
        for (kind, at) in known {
            let near = |s: &&SpecialPoint| s.kind == kind && (s.point.parameters[0] - at).abs() < s.error.min(1e-7);
            assert_eq!(found.special.iter().filter(near).count(), 1, "{k} {kind} {at}");
        }
        // The multiplier passes -1 once beyond the grazing.
        let beside = |s: &&SpecialPoint| s.kind == Kind::PeriodDoubling && s.point.parameters[0] < 0.79;
        assert_eq!(found.special.iter().filter(beside).count(), 1, "{k}");
    }
}

/// One contact ends and another begins at p = -0.0005 and 0.0005, in one step: the switch is a function of time with the
/// maxima p and -p, less 0.0005.
#[test]
fn two_grazings_of_one_switch_within_a_step_are_both_found() {
    let model = "name = \"two\"\n[parameters]\np = -0.5\n[forcing]\nfrequency = \"1\"\n[states.x]\n\
        equation = \"max(cos(2*t) + p*cos(t) - 1.0005, 0) - x\"\nrange = [-2, 2]\n";
    let study = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nperiods = 1\nsamples = 8\n[[branch]]\nname = \"b\"\n\
        from = \"s\"\nfree = \"p\"\nrange = [-0.5, 0.5]\n";
    let diagram = run(model, study);
    let own = branch(&diagram, "b");
    has(own, &[(Kind::Grazing, -0.0005), (Kind::Grazing, 0.0005)], 1e-8);
    let contacts: Vec<&str> = own.special.iter().filter_map(|s| s.remark.split(" at ").next()).collect();
    assert_eq!(contacts, ["contacts 1 → 0", "contacts 0 → 1"]);
}

/// At mu = 0 three surfaces meet. Beyond, 3.1875 x = 1.25 mu and y = mu/2 - 0.375 x.
#[test]
fn an_equilibrium_passes_a_corner_of_three_surfaces() {
    let model = "name = \"corner\"\n[parameters]\nmu = -1\n[states]\n\
        x = \"mu - 2*x - max(x, 0) + 0.5*max(y, 0)\"\ny = \"2*mu - 3*y - 0.5*max(x, 0) - abs(x + y)\"\n";
    let study = "[[seed]]\nname = \"s\"\nstate = { x = -0.5, y = -0.5 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n\
        free = \"mu\"\nrange = [-2, 2]\n";
    let diagram = run(model, study);
    let last = branch(&diagram, "b").points.last().unwrap();
    assert!((last.parameters[0] - 2.0).abs() < 1e-12);
    let [x, y] = [last.ranges[0][0], last.ranges[1][0]];
    assert!((x - 2.0 * 1.25 / 3.1875).abs() < 1e-6 && (y - (1.0 - 0.375 * x)).abs() < 1e-6, "{x} {y}");
}

/// Dry friction without sticking. At the first point of the branch a reversal lies on a mesh node. Multipliers from
/// event-located integration: -0.3374 ± 0.6106 i.
#[test]
fn a_jump_at_a_mesh_node_counts_for_the_multipliers() {
    let model = "name = \"friction\"\n[parameters]\nmu = 0.1\n[forcing]\nfrequency = \"0.6\"\n[states]\n\
        x = { equation = \"v\", range = [-3, 3] }\nv = { equation = \"-x - mu*sign(v) + cos(0.6*t)\", range = [-3, 3] }\n";
    let study = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 16\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n\
        free = \"mu\"\nrange = [0.1, 0.3]\n";
    let diagram = run(model, study);
    let own = branch(&diagram, "b");
    assert!(own.special.is_empty() && own.points.iter().all(|point| point.unstable == 0));
    let first = &own.points.iter().find(|point| point.position == 0).unwrap().spectrum;
    assert!(first.iter().all(|z| (z.re + 0.3374).abs() < 1e-4 && (z.im.abs() - 0.6106).abs() < 1e-4), "{first:?}");
}

/// x = mu and x = -mu meet in a corner at mu = 0, beyond which there is no equilibrium.
#[test]
fn a_branch_of_equilibria_turns_back_at_a_non_smooth_fold() {
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 1 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"mu\"\nrange = [-1, 2]\n";
    let diagram = run("name = \"corner\"\n[parameters]\nmu = 1\n[states]\nx = \"mu - abs(x)\"\n", study);
    let own = branch(&diagram, "b");
    has(own, &[(Kind::BoundaryEquilibrium, 0.0)], 1e-12);
    assert_eq!(own.special[0].remark, "non-smooth fold at x = 0");
    let mut ends = [own.points.first(), own.points.last()].map(|point| point.unwrap().ranges[0][0]);
    ends.sort_by(f64::total_cmp);
    assert!((ends[0] + 2.0).abs() < 1e-12 && (ends[1] - 2.0).abs() < 1e-12, "{ends:?}");
}

/// Two stops at one place: the orbit crosses both surfaces at the same instant. Together they are one stop of stiffness 5.
#[test]
fn surfaces_that_are_crossed_at_one_instant_act_like_one() {
    let study = "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nparameters = { w = 0.6 }\nsamples = 8\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"w\"\nrange = [0.5, 1.6]\n";
    let two = oscillator(1.0, 5.0, 0.3).replace("k*max(x - d, 0)", "(2*max(x - d, 0) + 3*max(2*x - 2*d, 0)/2)");
    let diagram = run(&two, study);
    let folds: Vec<f64> =
        branch(&diagram, "b").special.iter().filter(|s| s.kind == Kind::Fold).map(|s| s.point.parameters[0]).collect();
    let [upper, lower] = folds[..] else { panic!("{folds:?}") };
    assert!((upper - 1.335112494893).abs() < 1e-8 && (lower - 1.137578740375).abs() < 1e-8, "{folds:?}");
}
