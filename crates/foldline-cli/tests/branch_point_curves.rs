//! Curves of branch points of equilibria in two parameters, against closed forms.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind, SpecialPoint};
use foldline::explore::{System, run};
use foldline::verify::verify;
use foldline_store::study_file::{Study, parse_study};

fn study(model: &str, rest: &str) -> Study {
    parse_study(&format!("model = \"m\"\n{rest}"), "study", model, "model")
        .unwrap_or_else(|found| panic!("{}", found[0]))
}

fn grown(model: &str, rest: &str) -> Diagram {
    let study = study(model, rest);
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    // Verification must not call wrong, or leave undecided, what a closed form shows to be right.
    let verified = verify(&system, &diagram, study.plan.tolerance, None, &|branch| branch.held.is_some());
    assert!(verified.wrong().next().is_none(), "{:?}", verified.wrong().next());
    let points = verified.undecided.iter().filter(|undecided| undecided.special.is_none());
    assert_eq!(points.count(), 0, "{:?}", verified.undecided);
    diagram
}

/// Asserts that every point of the curve satisfies `defect` = 0, a function of the branch's parameter and the second
/// one, and that both sides end at bounds.
fn satisfies(curve: &Branch, points: usize, defect: impl Fn(f64, f64) -> f64) {
    for end in &curve.ends {
        assert!(matches!(end, Some(Ending::Bound(_))), "{end:?}");
    }
    assert!(curve.points.len() >= points, "{} points", curve.points.len());
    let (_, first) = curve.held.unwrap();
    for point in &curve.points {
        let at = (point.parameters[first], point.parameters[curve.free]);
        assert!(defect(at.0, at.1).abs() < 1e-9, "{at:?}: {:.1e}", defect(at.0, at.1));
        assert!(point.trust.residual < 1e-12, "{:.1e}", point.trust.residual);
    }
}

/// Asserts kinds and positions of the special points on the curve, by increasing second parameter.
fn lies_on(curve: &Branch, expected: &[(Kind, f64, f64)]) {
    let (_, first) = curve.held.unwrap();
    let mut found: Vec<_> = curve
        .special
        .iter()
        .map(|s| (s.kind, s.point.parameters[first], s.point.parameters[curve.free], s.error))
        .collect();
    found.sort_by(|a, b| a.2.total_cmp(&b.2));
    let agree = found.iter().zip(expected).all(|(own, known)| {
        let error = own.3.max(1e-8);
        own.0 == known.0 && (own.1 - known.1).abs() < error && (own.2 - known.2).abs() < error
    });
    assert!(agree && found.len() == expected.len(), "{found:?}");
}

const PLAN: &str = "[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"mu\"\nrange = [-3, 3]\n[[curve]]\nname = \"curve\"\nhold = \"branch-point\"\nof = \"b\"\nfree = \"q\"\n";

/// x = 0, y = q mu is always a solution. The quadratic coefficient of x is -1 + 2q, partly by way of y; where it
/// vanishes, a cubic term remains.
#[test]
fn a_curve_of_transcritical_points_passes_a_pitchfork() {
    let model =
        "[parameters]\nmu = 0.2\nq = 0.3\n[states]\nx = \"x*(mu - 1 - x + y)\"\ny = \"q*mu - y + 2*q*x - x^2\"\n";
    let seed = "[[seed]]\nname = \"s\"\nstate = { x = 0, y = 0.06 }\n";
    let diagram = grown(model, &format!("{seed}{PLAN}range = [-0.5, 1.5]\n"));
    let curve = diagram.branch("curve").unwrap();
    satisfies(curve, 8, |mu, q| mu * (1.0 + q) - 1.0);
    lies_on(curve, &[(Kind::Cusp, 2.0 / 3.0, 0.5)]);
    // (ξ = √2 x; the slaved y - q mu = x - x² leaves -x³.)
    assert!((curve.special[0].coefficients[0] + 0.5).abs() < 1e-7, "{}", curve.special[0].normal_form());
}

/// With one state the null space is the whole state space: f_x and the derivatives along both parameters vanish
/// together.
#[test]
fn branch_points_of_a_single_state_are_followed() {
    let model = "[parameters]\nmu = -1\nq = 0.4\n[states]\nx = \"1e3*((mu - q^2)*x - x^2)\"\n";
    let seed = "[[seed]]\nname = \"s\"\nstate = { x = 0 }\n";
    let diagram = grown(model, &format!("{seed}{PLAN}range = [-1, 1]\n"));
    satisfies(diagram.branch("curve").unwrap(), 5, |mu, q| mu - q * q);
    lies_on(diagram.branch("curve").unwrap(), &[]);
}

#[test]
fn convection_begins_at_the_same_rayleigh_number_for_every_fluid() {
    let model = include_str!("../../../models/lorenz.toml");
    let text = "[[seed]]\nname = \"s\"\nstate = { x = 0, y = 0, z = 0 }\nparameters = { rho = 0.5 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"rho\"\nrange = [0.5, 2]\n";
    let curve =
        "[[curve]]\nname = \"curve\"\nhold = \"branch-point\"\nof = \"b\"\nfree = \"sigma\"\nrange = [0.5, 50]\n";
    let diagram = grown(model, &format!("{text}{curve}"));
    let curve = diagram.branch("curve").unwrap();
    satisfies(curve, 5, |rho, _| rho - 1.0);
    // All of them are pitchforks: the quadratic coefficient is rounding error, and its sign changes are not cusps.
    assert!(curve.special.is_empty());
}

/// Pitchforks on the curve q = mu² - ½, which turns back in q. Besides, a real eigenvalue vanishes at mu = -0.4 and a
/// pair crosses the imaginary axis at mu = 0.3.
#[test]
fn pitchforks_turn_back_and_meet_other_bifurcations() {
    let model = "[parameters]\nmu = -1.1\nq = 0.4\n[states]\nx = \"(q - mu^2 + 0.5)*x - x^3 + 0.2*x*u\"\nw = \"(mu + 0.4)*w + x - w^3\"\nu = \"(mu - 0.3)*u - 2*v + x^2\"\nv = \"2*u + (mu - 0.3)*v - v*u^2\"\n";
    let seed = "[[seed]]\nname = \"s\"\nstate = { x = 0, w = 0, u = 0, v = 0 }\n";
    let diagram =
        grown(model, &format!("{seed}{}near = -0.94\nrange = [-2, 1.1]\n", PLAN.replace("[-3, 3]", "[-1.2, 1.2]")));
    let curve = diagram.branch("curve").unwrap();
    satisfies(curve, 8, |mu, q| mu * mu - 0.5 - q);
    lies_on(curve, &[(Kind::Fold, 0.0, -0.5), (Kind::ZeroHopf, 0.3, -0.41), (Kind::BogdanovTakens, -0.4, -0.34)]);
}

/// p₁ = 3/5 where the prey appear, and p₁ (1 - e^{-5/p₄}) = 3 (1 - 1/p₄)/p₄ where the predators appear, at u = 1/p₄.
/// The latter curve also passes the fold of the prey alone, u = 0.411161560751.
#[test]
fn prey_and_predators_appear_along_two_curves() {
    let model = include_str!("../../../models/predator-prey.toml");
    let text = "[[seed]]\nname = \"s\"\nstate = { u = 0, v = 0 }\nparameters = { p1 = 0.1 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p1\"\nrange = [0.1, 1]\nswitch = { branch-point = 1 }\n";
    let curve = |name: &str, of: &str, near: f64| {
        format!(
            "[[curve]]\nname = \"{name}\"\nhold = \"branch-point\"\nof = \"{of}\"\nnear = {near}\nfree = \"p4\"\nrange = [2, 6]\n"
        )
    };
    let diagram =
        grown(model, &format!("{text}{}{}", curve("prey", "b", 0.6), curve("predators", "b/branch-point-1", 0.82)));
    satisfies(diagram.branch("prey").unwrap(), 3, |p, _| p - 0.6);
    let predators = diagram.branch("predators").unwrap();
    satisfies(predators, 5, |p, gain| p * (1.0 - (-5.0 / gain).exp()) - 3.0 * (1.0 - 1.0 / gain) / gain);
    let double: Vec<_> = predators.special.iter().filter(|s| s.kind == Kind::BogdanovTakens).collect();
    assert_eq!(double.len(), 1, "{:?}", predators.special.iter().map(|s| s.kind).collect::<Vec<_>>());
    assert!((1.0 / double[0].point.parameters[1] - 0.411161560751).abs() < 1e-11);
}

/// Away from q = 0 the crossing opens: a branch point exists at one value of q only, and there is no curve of them.
/// Where it opens like q³, a curve begins and ends as soon as the opening is noticeable.
#[test]
fn a_curve_ends_where_branches_no_longer_cross() {
    for (opening, begins) in [("0.1*q", false), ("-0.3*q^2", true), ("0.1*q^3", true)] {
        let model = format!("[parameters]\nmu = -1\nq = 0\n[states]\nx = \"mu*x - x^2 + {opening}\"\n");
        opens(&model, begins);
    }
}

fn opens(model: &str, begins: bool) {
    let seed = "[[seed]]\nname = \"s\"\nstate = { x = 0 }\n";
    let study = study(model, &format!("{seed}{PLAN}range = [-1, 1]\n"));
    let diagram = run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved);
    let curve = diagram.branch("curve").unwrap();
    assert_eq!(!curve.points.is_empty(), begins);
    assert!(curve.points.iter().all(|point| point.parameters[1].abs() < 5e-3 && point.trust.residual < 1e-8));
    for end in &curve.ends {
        match end {
            Some(Ending::NoStart(why)) => assert!(!begins && why.contains("symmetry"), "{why}"),
            Some(Ending::StepTooSmall(why)) => assert!(begins && why.contains("symmetry"), "{why}"),
            _ => panic!("{end:?}"),
        }
    }
}

/// Cycles of radius p1 and p2 about the origin, of period 1, cross where the two are equal; demo `lcbp` of AUTO-07p.
const RINGS: &str = "name = \"rings\"\n[parameters]\np1 = 1\np2 = 2\np3 = 0\n[definitions]\nq = \"sqrt(x^2 + y^2)\"\n\
    g = \"(q - p1)*(q - p2) + p3\"\n[states]\nx = \"-x*g - 2*pi*y\"\ny = \"-y*g + 2*pi*x\"\n";

fn of_rings(curve: &str) -> Diagram {
    let study = study(
        RINGS,
        &format!(
            "[[seed]]\nname = \"s\"\nstate = {{ x = 2, y = 0 }}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p1\"\n\
             range = [0.5, 5]\n[[curve]]\nname = \"curve\"\nhold = \"branch-point\"\nof = \"b\"\n{curve}\n"
        ),
    );
    run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved)
}

#[test]
fn branch_points_of_cycles_lie_where_two_radii_agree() {
    let diagram = of_rings("free = \"p2\"\nrange = [1.2, 4]\nmark = { p2 = 3 }");
    let curve = diagram.branch("curve").unwrap();
    for end in &curve.ends {
        assert!(matches!(end, Some(Ending::Bound(_))), "{end:?}");
    }
    assert!(curve.points.len() > 5, "{}", curve.points.len());
    for point in &curve.points {
        let [p1, p2] = [0, 1].map(|k| point.parameters[k]);
        assert!(point.parameters.len() == 3 && (p1 - p2).abs() < 1e-7 * p2, "{p1} {p2}");
        assert!((point.ranges[0][1] - p2).abs() < 1e-6 && (point.solution.period().unwrap() - 1.0).abs() < 1e-7);
    }
    let marks: Vec<f64> =
        curve.special.iter().filter(|s| s.kind == Kind::Mark).map(|s| s.point.parameters[0]).collect();
    assert!(marks.len() == 1 && (marks[0] - 3.0).abs() < 1e-6, "{marks:?}");
}

#[test]
fn branch_points_of_cycles_that_a_second_parameter_unfolds_are_not_followed() {
    // For p3 ≠ 0 the branches of the two radii no longer cross: they meet in folds or not at all.
    let diagram = of_rings("free = \"p3\"\nrange = [-0.2, 0.2]");
    let curve = diagram.branch("curve").unwrap();
    let said = curve.ends.iter().flatten().map(|end| end.to_string()).collect::<Vec<_>>();
    assert!(
        curve.points.is_empty() && said.iter().all(|end| end.contains("only for this value of the second parameter")),
        "{said:?}"
    );
}

#[test]
fn a_curve_of_symmetry_breaking_of_lorenz_cycles_passes_the_branch_points_of_branches() {
    let lorenz = include_str!("../../../models/lorenz.toml");
    let cycles = |sigma: f64, rest: &str| {
        let study = study(
            lorenz,
            &format!(
                "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nparameters = {{ rho = 350, sigma = {sigma} }}\n\
                 [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"rho\"\nrange = [305, 360]\n{rest}"
            ),
        );
        run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved)
    };
    let rho = |branch: &Branch| {
        branch.special.iter().find(|s| s.kind == Kind::BranchPoint).unwrap().point.parameters[branch.free]
    };
    let curve = "[[curve]]\nname = \"curve\"\nhold = \"branch-point\"\nof = \"b\"\nfree = \"sigma\"\nuntil = 10.2\n\
        branch-range = [280, 360]\n";
    let both = cycles(10.0, curve);
    // Sparrow 1982: the symmetric cycle loses its symmetry at rho = 312.97.
    assert!((rho(both.branch("b").unwrap()) - 312.97).abs() < 0.01, "{}", rho(both.branch("b").unwrap()));
    let curve = both.branch("curve").unwrap();
    let end = curve.points.last().unwrap();
    let (_, first) = curve.held.unwrap();
    assert!((end.parameters[curve.free] - 10.2).abs() < 1e-9, "{:?}", curve.ends);
    let there = rho(cycles(10.2, "").branch("b").unwrap());
    assert!((end.parameters[first] - there).abs() < 1e-6 * there, "{} {there}", end.parameters[first]);
}

/// (x - mu)(x - q²) + c - q/10: branches over mu cross where x = mu = q² and c = q/10, for isolated values of q if c is given.
#[test]
fn a_crossing_for_an_isolated_value_is_followed_in_three_parameters() {
    let model = "[parameters]\nmu = 0.5\nq = 1\nc = 0.1\n[equations]\nx = \"(x - mu)*(x - q^2) + c - q/10\"\n[states]\nx = {}\n";
    let seed = "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nstate = { x = 0.5 }\n";
    let third = "range = [0.5, 1.5]\nalso = { c = [-1, 1] }\nmark = { q = 1.25 }\n";
    let diagram = grown(model, &format!("{seed}{PLAN}{third}"));
    let curve = diagram.branch("curve").unwrap();
    assert!(curve.ends.iter().all(|end| matches!(end, Some(Ending::Bound(_)))), "{:?}", curve.ends);
    assert!(curve.points.len() > 5);
    for point in &curve.points {
        let [mu, q, c] = point.parameters[..] else { panic!() };
        assert!((mu - q * q).abs() < 1e-9 && (c - q / 10.0).abs() < 1e-9, "{mu} {q} {c}");
    }
    let [mark] = &curve.special[..] else {
        panic!("{:?}", curve.special.iter().map(|s| s.kind).collect::<Vec<Kind>>())
    };
    assert!((mark.point.parameters[0] - 1.5625).abs() < mark.error.max(1e-9));
    // In two parameters there is no curve, and the message says so.
    let two = grown(model, &format!("{seed}{PLAN}range = [0.5, 1.5]\n"));
    let end = two.branch("curve").unwrap().ends[0].clone();
    assert!(matches!(&end, Some(Ending::NoStart(why)) if why.contains("only for this value")), "{end:?}");
}

/// On the unit sphere in five dimensions the largest sum of k coordinates is √k, where they are equal.
#[test]
fn the_largest_sum_of_coordinates_is_followed_from_two_of_them_to_five() {
    let model = "[parameters]\ns = 1\nx3 = 0\nx4 = 0\nx5 = 0\n[definitions]\nx1 = \"s - x2 - x3 - x4 - x5\"\n[states]\n\
        x2 = \"x1^2 + x2^2 + x3^2 + x4^2 + x5^2 - 1\"\n";
    let curve = |name: &str, of: &str, free: &str| {
        format!(
            "[[curve]]\nname = \"{name}\"\nhold = \"branch-point\"\nof = \"{of}\"\nfree = \"{free}\"\nrange = [-2, 2]\n"
        )
    };
    let start = "tolerance = 1e-8\n[[seed]]\nname = \"s\"\nstate = { x2 = 0 }\n[[branch]]\nname = \"two\"\nfrom = \"s\"\nfree = \"s\"\n\
        until = 1.3\n[[branch]]\nname = \"circle\"\nfrom = \"two\"\nfree = \"x3\"\nrange = [-2, 2]\n[[curve]]\nname = \"three\"\n\
        hold = \"fold\"\nof = \"circle\"\nfree = \"s\"\nrange = [0.5, 3]\n";
    let all = format!("{start}{}{}", curve("four", "three", "x4"), curve("five", "four", "x5"));
    let diagram = grown(model, &all);
    for (name, kind, k) in [("three", Kind::Fold, 3.0f64), ("four", Kind::Peak, 4.0), ("five", Kind::Peak, 5.0)] {
        let branch = diagram.branch(name).unwrap();
        let found: Vec<&SpecialPoint> = branch.special.iter().filter(|special| special.kind == kind).collect();
        assert_eq!(found.len(), 1, "{name}");
        let [s, rest @ ..] = &found[0].point.parameters[..] else { panic!() };
        let error = found[0].error.max(1e-9) * (1.0 + s.abs());
        assert!((s - k.sqrt()).abs() <= error, "{name}: {s} ± {error:e}");
        // Coordinates beyond the k-th are fixed at 0.
        for (i, x) in rest.iter().enumerate() {
            let known = if i + 3 <= k as usize { 1.0 / k.sqrt() } else { 0.0 };
            assert!((x - known).abs() < 1e-7, "{name}: x{} = {x}", i + 3);
        }
    }
    // Along the curves the coordinates that are solved for are equal: s is extremal over them.
    for point in &diagram.branch("five").unwrap().points {
        let [s, x3, x4, x5] = point.parameters[..] else { panic!() };
        let on_sphere = 4.0 * x3 * x3 + x5 * x5 - 1.0;
        let equal = (x3 - x4).abs().max((s - 4.0 * x3 - x5).abs());
        assert!(equal < 1e-7 && on_sphere.abs() < 1e-7, "{s} {x3} {x4} {x5}");
    }
    // A curve without an extremum starts no other one, and says so.
    let none = start.replace("range = [0.5, 3]", "range = [0.5, 1.5]") + &curve("four", "three", "x4");
    let end = grown(model, &none).branch("four").unwrap().ends[0].clone();
    assert!(matches!(&end, Some(Ending::NoStart(why)) if why.contains("the branch three has no extremum")), "{end:?}");
}
