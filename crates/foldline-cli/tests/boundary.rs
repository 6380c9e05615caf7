//! Boundary-value problems: against closed forms and published values.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Family, Kind, Point, SpecialPoint};
use foldline::explore::{self, System};
use foldline::model::Model;
use foldline::special::quantity::Quantity;
use foldline_store::study_file::{Study, parse_study};
use std::f64::consts::PI;
use std::path::Path;

/// Study of a model in the repository.
#[track_caller]
fn of(model: &str, study: &str) -> (Study, Diagram) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models").join(format!("{model}.toml"));
    given(&std::fs::read_to_string(path).unwrap(), study)
}

#[track_caller]
fn given(model: &str, study: &str) -> (Study, Diagram) {
    let text = format!("model = \"m\"\n{study}");
    let study = parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    drop(system);
    (study, diagram)
}

/// Every mistake in a model and a study, as message and cure.
fn mistakes(model: &str, study: &str) -> String {
    let found = parse_study(&format!("model = \"m\"\n{study}"), "study", model, "model").unwrap_err();
    found
        .iter()
        .map(|d| format!("{}:{}: {} ({})\n", d.line, d.column, d.message, d.hint.as_deref().unwrap_or("")))
        .collect()
}

fn seeded(seed: &str, free: &str, range: &str, more: &str) -> String {
    format!(
        "tolerance = 1e-9\n[[seed]]\nname = \"s\"\n{seed}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"{free}\"\n\
         range = {range}\n{more}\n"
    )
}

#[track_caller]
fn value(model: &Model, name: &str, point: &Point) -> f64 {
    Quantity::named(name, model).and_then(|quantity| quantity.of(point)).unwrap_or_else(|| panic!("{name}"))
}

#[track_caller]
fn near(value: f64, known: f64, within: f64) {
    assert!((value - known).abs() <= within * (1.0 + known.abs()), "{value} is not {known}");
}

fn of_kind(branch: &Branch, kind: Kind) -> Vec<&SpecialPoint> {
    branch.special.iter().filter(|s| s.kind == kind).collect()
}

#[track_caller]
fn complete(diagram: &Diagram) {
    for branch in &diagram.branches {
        assert!(branch.ends.iter().all(|end| end.as_ref().is_some_and(Ending::complete)), "{:?}", branch.ends);
        assert_eq!(branch.family, Family::Arc);
        assert!(branch.special.iter().all(|s| s.kind != Kind::Unexplained), "{}", branch.name);
        assert!(branch.points.iter().all(|p| p.unstable == 0), "there is no stability");
    }
}

#[test]
fn two_solutions_of_bratu_s_problem_meet_where_the_slope_at_the_wall_is_four() {
    let (study, diagram) = of("bratu", &seeded("state = \"zero\"", "p", "[0, 4]", "stop = { u_max = 8 }"));
    complete(&diagram);
    let [fold] = of_kind(diagram.branch("b").unwrap(), Kind::Fold)[..] else { panic!() };
    near(fold.point.parameters[0], 3.513830719125, 1e-10);
    assert!((fold.point.parameters[0] - 3.513830719125).abs() <= fold.error.max(1e-12));
    for (name, known) in [("u'@0", 4.0), ("u'@1", -4.0), ("u@0.5", 1.186842168634), ("u_max", 1.186842168634)] {
        near(value(&study.model, name, &fold.point), known, 1e-8);
    }
}

/// u'' = -p exp(u), u(0) = u(1), ∫u dx = 0: c and p = 2 c² exp(2 - 2 ln cosh(c/2)) in closed form.
#[test]
fn an_integral_takes_the_place_of_a_boundary_condition() {
    let model = "[interval]\nlength = 1\n[parameters]\np = 0\n[states.\"u''\"]\nequation = \"-p*exp(u)\"\n[boundary]\n\
        same = \"u@0 - u@1\"\n[integrals]\nmean = \"u\"\n";
    let (study, diagram) = given(model, &seeded("state = \"zero\"", "p", "[0, 15]", "stop = { u_max = 4 }"));
    complete(&diagram);
    let [fold] = of_kind(diagram.branch("b").unwrap(), Kind::Fold)[..] else { panic!() };
    near(fold.point.parameters[0], 11.923790200648, 1e-10);
    for (name, known) in [("u@0", -2.0), ("u@1", -2.0), ("u@0.5", 1.292714781747), ("u_mean", 0.0)] {
        near(value(&study.model, name, &fold.point), known, 1e-8);
    }
}

#[test]
fn a_slab_ignites_and_is_extinguished_at_folds() {
    for (e, known) in [(0.1, vec![3.952831214835]), (0.23, vec![4.980849511181, 4.746725632792])] {
        let seed = format!("state = \"zero\"\nparameters = {{ e = {e} }}");
        let (_, diagram) = of("thermal-explosion", &seeded(&seed, "p", "[0, 8]", ""));
        complete(&diagram);
        let folds = of_kind(diagram.branch("b").unwrap(), Kind::Fold);
        assert_eq!(folds.len(), 2);
        for (fold, known) in folds.iter().zip(known) {
            near(fold.point.parameters[0], known, 1e-10);
        }
    }
}

/// θ(0) = α where p = (2 K(sin(α/2)))², and the ends are 2 E/K - 1 apart.
#[test]
fn a_rod_buckles_at_pitchforks_into_the_shapes_of_the_elastica() {
    let more = "switch = { branch-point = 1 }\nmark = { th_max = [0.5, 2] }";
    let (study, diagram) = of("elastica", &seeded("state = \"zero\"", "p", "[5, 120]", more));
    complete(&diagram);
    let straight = of_kind(diagram.branch("b").unwrap(), Kind::BranchPoint);
    assert_eq!(straight.len(), 3);
    for (n, point) in straight.iter().enumerate() {
        near(point.point.parameters[0], ((n + 1) as f64 * PI).powi(2), 1e-10);
    }
    let buckled = diagram.branch("b/branch-point-1").unwrap();
    let marks = of_kind(buckled, Kind::Mark);
    for (mark, (p, apart)) in marks.iter().zip([(10.1850010812, 0.938308047), (17.4295934851, 0.185033604)]) {
        near(mark.point.parameters[0], p, 1e-9);
        near(value(&study.model, "along_integral", &mark.point), apart, 1e-8);
        near(value(&study.model, "th@0", &mark.point).abs(), value(&study.model, "th_max", &mark.point), 1e-9);
    }
    assert_eq!(marks.len(), 2);
    // One half of the pitchfork of an odd mode; the two halves of an even one are shifts of each other.
    assert!(diagram.branches.len() == 4, "{:?}", diagram.branches.iter().map(|b| &b.name).collect::<Vec<_>>());
}

/// The n-th mode, w = a sin(n π x), carries p = n² π² (1 + k a²/4).
#[test]
fn an_unknown_is_determined_by_a_further_condition() {
    let more = "switch = { branch-point = 1 }\nmark = { w_rms = [0.5, 1] }";
    let (study, diagram) = of("buckled-beam", &seeded("state = \"zero\"", "p", "[5, 200]", more));
    complete(&diagram);
    for n in [1.0, 2.0] {
        let branch = diagram.branch(&format!("b/branch-point-{n}")).unwrap();
        let mut seen = 0;
        for mark in of_kind(branch, Kind::Mark) {
            let square = 2.0 * value(&study.model, "w_rms", &mark.point).powi(2);
            near(mark.point.parameters[0], n * n * PI * PI * (1.0 + 0.5 * square), 1e-8);
            near(mark.point.parameters[2], 0.25 * n * n * PI * PI * square, 1e-8);
            seen += 1;
        }
        assert_eq!(seen, 2);
    }
}

/// Loads of a deflection whose height is 1 or 2, upwards or downwards.
#[test]
fn a_beam_between_fixed_supports_carries_the_load_of_its_height() {
    let more = "switch = { branch-point = 1 }\nmark = { w_rms = [0.7071067811865476, 1.4142135623730951] }";
    let (_, diagram) = of("buckled-beam", &seeded("state = \"zero\"", "p", "[5, 35]", more));
    let marks = of_kind(diagram.branch("b/branch-point-1").unwrap(), Kind::Mark);
    assert_eq!(marks.len(), 2);
    for (mark, known) in marks.iter().zip([14.804_406_60, 29.608_813_20]) {
        near(mark.point.parameters[0], known, 1e-8);
    }
}

/// The second point of a curve must not depend on the step that led to it: beside the fold steps once shrank to 10⁻⁶.
#[test]
fn steps_past_a_fold_are_as_long_as_elsewhere() {
    let model = include_str!("../../../models/bratu.toml");
    let study = seeded("state = \"zero\"", "p", "[0, 4]", "stop = { u_max = 8 }");
    let (_, diagram) = given(model, &study);
    let own = diagram.branch("b").unwrap();
    let values: Vec<f64> = own.points.iter().map(|point| point.parameters[0]).collect();
    let short = values.windows(2).skip(8).filter(|pair| (pair[1] - pair[0]).abs() < 1e-4).count();
    assert!(short <= 1, "{values:?}");
}

/// u = x⁴ + c x on [0, L], u(L) = 1, from a first profile in terms of the independent variable.
#[test]
fn length_and_independent_variable_enter_the_equations() {
    let model = "[interval]\nlength = \"L\"\nvariable = \"x\"\n[parameters]\nL = 2\n[states.\"u''\"]\n\
        equation = \"12*x^2\"\n[boundary]\nleft = \"u@0\"\nright = \"u@1 - 1\"\n";
    let seed = "state = { u = \"x/L\", \"u'\" = \"1/L\" }";
    let (study, diagram) = given(model, &seeded(seed, "L", "[0.5, 2]", "mark = { L = [0.5, 1.5] }"));
    complete(&diagram);
    let marks = of_kind(diagram.branch("b").unwrap(), Kind::Mark);
    assert_eq!(marks.len(), 2);
    for mark in marks {
        let length = mark.point.parameters[0];
        near(value(&study.model, "u'@0", &mark.point), (1.0 - length.powi(4)) / length, 1e-10);
        near(value(&study.model, "period", &mark.point), length, 1e-14);
    }
}

/// u'' = -u, u(0) = 0, u(1)² + u(1) = λ: folds where the condition does.
#[test]
fn a_nonlinear_condition_has_exact_derivatives() {
    let model = "[interval]\nlength = 1\n[parameters]\na = 0\n[states.\"u''\"]\nequation = \"-u\"\n[boundary]\n\
        left = \"u@0\"\nright = \"u@1^2 + u@1 - a\"\n";
    let (study, diagram) = given(model, &seeded("state = \"zero\"", "a", "[-1, 2]", ""));
    complete(&diagram);
    let [fold] = of_kind(diagram.branch("b").unwrap(), Kind::Fold)[..] else { panic!() };
    near(fold.point.parameters[0], -0.25, 1e-10);
    near(value(&study.model, "u'@0", &fold.point), -0.5 / 1f64.sin(), 1e-8);
}

#[test]
fn a_branch_is_resumed_as_if_it_had_not_been_interrupted() {
    let text = |points: usize| {
        seeded("state = \"zero\"", "p", "[0, 4]", &format!("stop = {{ u_max = 8 }}\nmax-points = {points}"))
    };
    let (_, whole) = of("bratu", &text(1000));
    let (_, part) = of("bratu", &text(30));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/bratu.toml");
    let model = std::fs::read_to_string(path).unwrap();
    let study = parse_study(&format!("model = \"m\"\n{}", text(1000)), "study", &model, "model").unwrap();
    let mut earlier = part.clone();
    earlier.branches.iter_mut().for_each(|branch| branch.ends = [None, None]);
    let system = System::of_plan(&study.model, &study.plan);
    let again = explore::run(&system, &study.plan, 1, earlier, &Unobserved);
    let [one, other] = [&whole, &again].map(|diagram| of_kind(diagram.branch("b").unwrap(), Kind::Fold)[0].clone());
    near(one.point.parameters[0], other.point.parameters[0], 1e-12);
    complete(&again);
}

#[test]
fn mistakes_are_answered_with_place_cause_and_cure() {
    let model = |interval: &str, boundary: &str| {
        format!(
            "[interval]\n{interval}\n[parameters]\np = 0\n[states.\"u''\"]\nequation = \"-p*exp(u)\"\n[boundary]\n{boundary}\n"
        )
    };
    let study = seeded("state = \"zero\"", "p", "[0, 4]", "");
    let cases = [
        (model("length = 1", "left = \"u@0\""), "1 boundary condition and 0 integral conditions for 2 states"),
        (model("length = 1", "a = \"u@0\"\nb = \"u@1\"\nc = \"u'@0 - 1\""), "solve = "),
        (model("length = 1", "a = \"u\"\nb = \"u@1\""), "without saying at which end"),
        (model("length = 1", "a = \"v@0\"\nb = \"u@1\""), "unknown name `v@0`"),
        (model("variable = \"x\"", "a = \"u@0\"\nb = \"u@1\""), "the interval has no length"),
        (model("length = \"u\"", "a = \"u@0\"\nb = \"u@1\""), "the length of the interval depends on `u`"),
        (model("length = 1\nsolve = [\"q\"]", "a = \"u@0\"\nb = \"u@1\"\nc = \"u'@0\""), "`q` is not a parameter"),
        (model("length = 1", "a = \"u@0\"\nb = \"u@1\"").replace("-p*exp(u)", "-p*abs(u)"), "not smooth"),
    ];
    for (model, said) in cases {
        let found = mistakes(&model, &study);
        assert!(found.contains(said), "{said}\n{found}");
    }
    let good = model("length = 1", "a = \"u@0\"\nb = \"u@1\"");
    for (study, said) in [
        (seeded("attractor = \"cycle\"", "p", "[0, 4]", ""), "a boundary-value problem has no attractor"),
        (seeded("state = { u = 0 }", "p", "[0, 4]", ""), "the profile lacks u'"),
        (seeded("state = { u = \"sin(y)\", \"u'\" = 0 }", "p", "[0, 4]", ""), "the profile of `u`: unknown name `y`"),
        (
            format!("{study}[[survey]]\nname = \"v\"\nfree = \"p\"\nat = [1]\n"),
            "no motion starts from an initial state",
        ),
        (
            format!("{study}[[curve]]\nname = \"c\"\nof = \"b\"\nhold = \"torus\"\nfree = \"p\"\nrange = [0, 1]\n"),
            "solutions of boundary-value problems have only folds and branch points",
        ),
    ] {
        let found = mistakes(&good, &study);
        assert!(found.contains(said), "{said}\n{found}");
    }
    let solved = model("length = 1\nsolve = [\"p\"]", "a = \"u@0\"\nb = \"u@1\"\nc = \"u'@0 - 1\"");
    let found = mistakes(&solved, &study);
    assert!(found.contains("`p` is determined by the conditions"), "{found}");
}

/// Curve of a kind of special point of the branch "b", with marks at values of its second parameter.
fn curve(hold: &str, free: &str, range: &str, marks: &str) -> String {
    format!(
        "[[curve]]\nname = \"c\"\nof = \"b\"\nhold = \"{hold}\"\nfree = \"{free}\"\nrange = {range}\nmark = {{ {free} = \
         {marks} }}\n"
    )
}

/// Pairs of the first and the second parameter at the marks of the curve, and their stated errors.
fn on_curve(study: &Study, diagram: &Diagram, names: [&str; 2]) -> Vec<[f64; 3]> {
    let marks = of_kind(diagram.branch("c").unwrap(), Kind::Mark);
    let values = |s: &SpecialPoint| names.map(|name| value(&study.model, name, &s.point));
    marks.iter().map(|s| (values(s), s.error)).map(|([a, b], error)| [a, b, error]).collect()
}

/// By scaling x, the fold of Bratu's problem on an interval of length L is at p L² = 3.513830719125, and the mean, which a
/// further condition determines, is the same for all L.
#[test]
fn a_fold_is_followed_in_the_rate_and_the_length_of_the_slab() {
    let model = "[interval]\nlength = \"L\"\nvariable = \"x\"\nsolve = [\"mean\"]\n[parameters]\np = 0\nL = 1\nmean = 0\n\
                 [states.\"u''\"]\nequation = \"-p*exp(u)\"\n[boundary]\nleft = \"u@0\"\nright = \"u@1\"\n[integrals]\n\
                 own = \"u - mean\"\n";
    let branch = seeded("state = \"zero\"", "p", "[0, 8]", "stop = { u_max = 3 }");
    let (study, diagram) = given(model, &format!("{branch}{}", curve("fold", "L", "[0.6, 1.6]", "[0.7, 1.5]")));
    complete(&diagram);
    let found = on_curve(&study, &diagram, ["p", "L"]);
    assert_eq!(found.len(), 2, "{found:?}");
    let mean = value(&study.model, "mean", &diagram.branch("c").unwrap().points[0]);
    for [p, length, error] in found {
        near(p * length * length, 3.513830719125, 1e-9);
        assert!(error < 1e-8, "{error:e}");
    }
    for point in &diagram.branch("c").unwrap().points {
        near(value(&study.model, "mean", point), mean, 1e-8);
    }
}

/// Ignition and extinction of a slab (collocation with six points, a separate program, to 1e-8), and the point at which they
/// meet, where the first and second derivatives of p by the largest temperature m vanish (a separate program, to 1e-11) in
///
///   √p = √2 ∫₀^m du / √(F(m) - F(u)),   F' = exp(u / (1 + e u))
#[test]
fn ignition_and_extinction_meet_in_a_cusp() {
    let branch = seeded("state = \"zero\"", "p", "[0, 12]", "stop = { u_max = 20 }");
    let (study, diagram) =
        of("thermal-explosion", &format!("{branch}{}", curve("fold", "e", "[0.1, 0.3]", "[0.1, 0.23]")));
    complete(&diagram);
    let [cusp] = of_kind(diagram.branch("c").unwrap(), Kind::Cusp)[..] else { panic!() };
    near(value(&study.model, "p", &cusp.point), 5.229494254693, 1e-9);
    near(value(&study.model, "e", &cusp.point), 0.245780427232, 1e-9);
    let found = on_curve(&study, &diagram, ["p", "e"]);
    for known in [3.952831214835, 4.980849511181, 4.746725632792] {
        assert!(found.iter().any(|[p, ..]| (p - known).abs() < 1e-8), "{known} is not among {found:?}");
    }
}

/// A rod on an elastic foundation buckles at p = k + π², a beam whose deflection stretches it at p = π² + f/π².
#[test]
fn buckling_loads_are_followed_in_the_stiffness_of_a_foundation() {
    let rod = "[interval]\nlength = 1\nvariable = \"s\"\n[parameters]\np = 5\nk = 0\n[states.\"th''\"]\nequation = \
               \"-p*sin(th) + k*th\"\n[boundary]\nleft = \"th'@0\"\nright = \"th'@1\"\n";
    let beam = "[interval]\nlength = 1\nsolve = [\"stretch\"]\n[parameters]\np = 5\nk = 0\nstretch = 0\n[states]\nw = \"w1\"\n\
                w1 = \"w2\"\nw2 = \"w3\"\nw3 = \"(2*stretch - p)*w2 - k*w\"\n[boundary]\na = \"w@0\"\nb = \"w@1\"\nc = \
                \"w2@0\"\nd = \"w2@1\"\n[integrals]\nm = \"w1^2/2 - stretch\"\n";
    let branch = seeded("state = \"zero\"", "p", "[5, 20]", "");
    let slopes = [1.0, 1.0 / (PI * PI)];
    for (model, slope) in [rod, beam].into_iter().zip(slopes) {
        let (study, diagram) = given(model, &format!("{branch}{}", curve("branch-point", "k", "[-2, 5]", "[-1, 4]")));
        complete(&diagram);
        let found = on_curve(&study, &diagram, ["p", "k"]);
        assert_eq!(found.len(), 2, "{found:?}");
        for [p, k, error] in found {
            near(p, PI * PI + slope * k, 1e-8);
            assert!(error < 1e-8, "{error:e}");
        }
    }
}

/// u'' = c u' grows like e^{200} over the interval, far beyond what its map from one end to the other has digits for. The
/// only solution has no special point, and its sign must not flip.
#[test]
fn strong_growth_along_the_interval_is_no_special_point() {
    let model = "[interval]\nlength = 1\n[parameters]\nc = 1\n[states]\nu = \"v\"\nv = \"c*v - 0.1*sin(u)\"\n[boundary]\n\
                 left = \"u@0 - 1\"\nright = \"u@1 - 2\"\n";
    let (_, diagram) = given(model, &seeded("state = { u = \"1 + t\", v = 1 }", "c", "[1, 200]", ""));
    complete(&diagram);
    let branch = diagram.branch("b").unwrap();
    assert!(branch.special.is_empty(), "{:?}", branch.special.iter().map(|s| s.kind).collect::<Vec<Kind>>());
}

/// Trajectories from one end of the interval say nothing about sizes: here they reach 1e77, and with such scales any profile
/// would pass for a solution.
#[test]
fn scales_are_those_of_the_profiles() {
    let model = "[interval]\nlength = 1\n[parameters]\np = 1\n[states]\nu = \"v\"\nv = \"100*u + p\"\n[boundary]\n\
                 left = \"u@0\"\nright = \"u@1\"\n";
    let (study, diagram) = given(model, &seeded("state = \"zero\"", "p", "[0.5, 1]", ""));
    assert_eq!(System::of_plan(&study.model, &study.plan).scales, [1.0, 1.0]);
    let point = diagram.branch("b").unwrap().points.iter().find(|point| point.parameters[0] == 1.0).unwrap();
    // u = (cosh(10 (t - 1/2)) / cosh 5 - 1) / 100.
    near(value(&study.model, "u@0.5", point), (1.0 / 5.0f64.cosh() - 1.0) / 100.0, 1e-9);
}

/// A rod that is equally stiff in two planes, with restoring forces that tell directions apart: at p = (kπ)² a null space of two
/// dimensions, at which the branches along u, along v and along both diagonals leave. The amplitude of sin kπs on each follows
/// from the reduced equation at small amplitude.
const SQUARE: &str = "[interval]\nlength = 1\nvariable = \"s\"\n[parameters]\np = 5\n[states]\n\
    \"u''\" = \"-p*(u - u^3 - c*u*v^2)\"\n\"v''\" = \"-p*(v*stiff - v^3 - c*v*u^2)\"\n\
    [boundary]\na = \"u@0\"\nb = \"u@1\"\nc = \"v@0\"\nd = \"v@1\"\n";

#[test]
fn branch_points_with_a_null_space_of_two_dimensions_are_found_from_any_start() {
    let model = SQUARE.replace("p = 5", "p = 5\nc = 3\nstiff = 1");
    for (low, high, switch) in
        [(5.0, 100.0, true), (5.0, 60.0, false), (2.0, 100.0, false), (4.3, 200.0, false), (1.0, 2000.0, false)]
    {
        let mut study = format!(
            "[[seed]]\nname = \"z\"\nstate = \"zero\"\n[[branch]]\nname = \"b\"\nfrom = \"z\"\nfree = \"p\"\nrange = [{low}, {high}]\n"
        );
        if switch {
            study += "switch = { branch-point = 1 }\n";
        }
        let (_, diagram) = given(&model, &study);
        let branch = diagram.branch("b").unwrap();
        let points = &branch.special;
        let expected: Vec<f64> =
            (1..30).map(|k| (f64::from(k) * PI).powi(2)).filter(|p| (low..high).contains(p)).collect();
        assert_eq!(points.len(), expected.len(), "{low} {high}");
        for (point, p) in points.iter().zip(&expected) {
            assert_eq!((point.kind, point.kernel()), (Kind::BranchPoint, 2));
            assert!(
                (point.point.parameters[0] - p).abs() <= point.error * branch.size(*p),
                "{:?} {p}",
                point.point.parameters[0]
            );
        }
        if switch {
            assert_eq!(diagram.branches.len(), 1 + 4 * expected.len());
        }
    }
}

#[test]
fn two_branch_points_that_nearly_coincide_are_told_apart() {
    for gap in [1e-2, 1e-4, 1e-6] {
        let model = SQUARE.replace("p = 5", &format!("p = 5\nc = 3\nstiff = {}", 1.0 + gap));
        let study = "[[seed]]\nname = \"z\"\nstate = \"zero\"\n[[branch]]\nname = \"b\"\nfrom = \"z\"\nfree = \"p\"\nrange = [5, 30]\n";
        let (_, diagram) = given(&model, study);
        let found: Vec<f64> = diagram.branch("b").unwrap().special.iter().map(|s| s.point.parameters[0]).collect();

        let [first, second] = [PI * PI / (1.0 + gap), PI * PI];
        assert_eq!(found.len(), 2, "{gap:e}: {found:?}");
        assert!((found[0] - first).abs() < 1e-6 && (found[1] - second).abs() < 1e-6, "{gap:e}: {found:?}");
    }
}

/// Bratu's problem at p = 1: u = 2 ln(cosh c/cosh(c (1 - 2t))) with cosh c = c √(8/p), which has two roots.
#[test]
fn another_solution_is_found_from_the_same_profile() {
    let model = "[interval]\nlength = 1\n[parameters]\np = 1\n[states]\n\"u''\" = \"-p*exp(u)\"\n[boundary]\na = \"u@0\"\nb = \"u@1\"\n";
    let rest = "free = \"p\"\nrange = [0.5, 2]\nuntil = 1.5\n";
    let study = format!(
        "[[seed]]\nname = \"cold\"\nstate = \"zero\"\n\
         [[seed]]\nname = \"hot\"\nstate = \"zero\"\nbesides = [\"cold\"]\n\
         [[seed]]\nname = \"third\"\nstate = \"zero\"\nbesides = [\"cold\", \"hot\"]\n\
         [[branch]]\nname = \"c\"\nfrom = \"cold\"\n{rest}[[branch]]\nname = \"h\"\nfrom = \"hot\"\n{rest}[[branch]]\nname = \"t\"\nfrom = \"third\"\n{rest}"
    );
    let (study, diagram) = given(model, &study);
    let middle = |name: &str| {
        let branch = diagram.branch(name).unwrap();
        let start = branch.points.iter().min_by_key(|point| point.position.abs()).unwrap();
        Quantity::named("u@0.5", &study.model).unwrap().on(start, &study.model).unwrap()
    };
    for (name, mut c) in [("c", 0.4), ("h", 3.0)] {
        for _ in 0..50 {
            let (f, slope) = (f64::cosh(c) - c * 8f64.sqrt(), f64::sinh(c) - 8f64.sqrt());
            c -= f / slope;
        }
        let known = 2.0 * c.cosh().ln();
        assert!((middle(name) - known).abs() < 1e-5, "{name}: {} {known}", middle(name));
    }
    let third = diagram.branch("t").unwrap();
    let Some(Ending::NoStart(why)) = &third.ends[0] else { panic!("{:?}", third.ends) };
    assert!(why.starts_with("no solution besides cold, hot was found"), "{why}");
}

/// θ'' + p sin θ = 0 with θ' = 0 at both ends: the trivial branch has branch points at (kπ)², wherever the range begins or ends and
/// however long the steps are that it suggests; of two rods that differ by a factor, at both sequences.
#[test]
fn every_buckling_load_is_found_in_any_range() {
    let one = "[interval]\nlength = 1\n[parameters]\np = 5\n[states]\n\"u''\" = \"-p*sin(u)\"\n[boundary]\na = \"u'@0\"\nb = \"u'@1\"\n";
    let two = |factor: f64| {
        format!(
            "[interval]\nlength = 1\n[parameters]\np = 5\n[states]\n\"u''\" = \"-p*sin(u)\"\n\"v''\" = \"-{factor}*p*sin(v)\"\n\
             [boundary]\na = \"u'@0\"\nb = \"u'@1\"\nc = \"v'@0\"\nd = \"v'@1\"\n"
        )
    };
    for (model, factor, high) in [
        (one.to_string(), None, 1000.0),
        (one.to_string(), None, 4000.0),
        (one.to_string(), None, 20000.0),
        (two(1.03), Some(1.03), 400.0),
        (two(1.0003), Some(1.0003), 400.0),
        (two(2.0), Some(2.0), 1000.0),
        (two(1.2), Some(1.2), 1000.0),
    ] {
        let study = format!(
            "[[seed]]\nname = \"z\"\nstate = \"zero\"\n[[branch]]\nname = \"b\"\nfrom = \"z\"\nfree = \"p\"\nrange = [5, {high}]\n"
        );
        let (_, diagram) = given(&model, &study);
        let loads = (1..100).map(|k| (f64::from(k) * PI).powi(2));
        let mut expected: Vec<f64> = loads
            .flat_map(|p| std::iter::once(p).chain(factor.map(|factor| p / factor)))
            .filter(|p| (5.0..high).contains(p))
            .collect();
        expected.sort_by(f64::total_cmp);
        let branch = diagram.branch("b").unwrap();
        let found: Vec<f64> = branch.special.iter().map(|s| s.point.parameters[0]).collect();
        assert_eq!(found.len(), expected.len(), "{factor:?} {high}: {found:?} {expected:?}");
        for (special, p) in branch.special.iter().zip(&expected) {
            let found = special.point.parameters[0];
            assert!((found - p).abs() <= special.error * branch.size(*p), "{factor:?} {high}: {found} {p}");
        }
    }
}

/// A rod beside Bratu's problem, with a buckling load 10⁻⁶ below the fold: passed once before the fold and once after it.
#[test]
fn two_branch_points_on_both_sides_of_a_fold_are_found() {
    for gap in [1e-4, 1e-6] {
        let factor = PI * PI / (3.513830719125 - gap);
        let model = format!(
            "[interval]\nlength = 1\n[parameters]\np = 0.1\n[states]\n\"u''\" = \"-p*exp(u)\"\n\"a''\" = \"-p*{factor:?}*sin(a)\"\n\
             [boundary]\na1 = \"u@0\"\na2 = \"u@1\"\nl = \"a'@0\"\nr = \"a'@1\"\n"
        );
        let study = "tolerance = 1e-8\n[[seed]]\nname = \"z\"\nstate = \"zero\"\n\
            [[branch]]\nname = \"b\"\nfrom = \"z\"\nfree = \"p\"\nrange = [0.1, 5]\nstop = { u_max = 8 }\n";
        let (_, diagram) = given(&model, study);
        let special = &diagram.branch("b").unwrap().special;
        let kinds: Vec<Kind> = special.iter().map(|s| s.kind).filter(|kind| *kind != Kind::Mark).collect();
        assert_eq!(kinds, [Kind::BranchPoint, Kind::Fold, Kind::BranchPoint], "{gap:e}");
    }
}
