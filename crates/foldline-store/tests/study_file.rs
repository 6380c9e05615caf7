//! Curves and homotopies in a study: plans, and diagnostics for mistakes.

use foldline::diagram::Kind;
use foldline::explore::{CurvePlan, HomotopyPlan, Start};
use foldline_store::study_file::{Study, parse_study};

const MODEL: &str = "name = \"pendulum\"\n[parameters]\nmu = 0.5\nkappa = 1\nzeta = 0.1\n[states]\nx = \"y\"\n\
    y = \"mu*x - kappa*x^3 - zeta*y\"\n";

/// Study without mistakes.
const STUDY: &str = r#"model = "pendulum.toml"

[[seed]]
name = "rest"
state = { x = 0.7, y = 0 }

[[seed]]
name = "swing"
attractor = "cycle"

[[branch]]
name = "main"
from = "rest"
free = "mu"
range = [-1, 2]

[[branch]]
name = "cycles"
from = "swing"
free = "mu"
range = [0, 2]
switch = { period-doubling = 2 }

[[curve]]
name = "folds"
hold = "fold"
of = "main"
near = 0.25
free = "kappa"
range = [0.5, 3]
until = 2.5

[[curve]]
name = "doublings"
hold = "period-doubling"
of = "cycles/period-doubling-1"
free = "zeta"
range = [0, 0.5]
branch-range = [0.5, 1.5]
max-points = 70

[[homotopy]]
name = "way"
from = "folds"
to = { zeta = 0.01, kappa = 4 }
via = "mu"
range = [-1.5, 2.5]

[[branch]]
name = "beyond"
from = "folds"
free = "mu"
range = [-1, 1.5]

[[branch]]
name = "goal"
from = "way"
free = "zeta"
until = 0.2
"#;

fn read(text: &str) -> Study {
    parse_study(text, "study.toml", MODEL, "pendulum.toml").unwrap_or_else(|found| panic!("{}", found[0]))
}

#[test]
fn curves_and_homotopies_become_plans() {
    let plan = read(STUDY).plan;
    let folds = CurvePlan {
        name: "folds".into(),
        hold: Kind::Fold,
        of: "main".into(),
        near: Some(0.25),
        to: None,
        further: Vec::new(),
        free: 1,
        ranges: [[-1.0, 2.0], [0.5, 3.0]],
        until: Some(2.5),
        marks: Vec::new(),
        max_points: 10_000,
    };
    let doublings = CurvePlan {
        name: "doublings".into(),
        hold: Kind::PeriodDoubling,
        of: "cycles/period-doubling-1".into(),
        near: None,
        to: None,
        further: Vec::new(),
        free: 2,
        ranges: [[0.5, 1.5], [0.0, 0.5]],
        until: None,
        marks: Vec::new(),
        max_points: 70,
    };
    assert_eq!(plan.curves, [folds, doublings]);
    let way = HomotopyPlan {
        name: "way".into(),
        start: Start::EndOfCurve(0),
        targets: vec![(1, 4.0), (2, 0.01)],
        via: 0,
        range: [-1.5, 2.5],
        max_points: 10_000,
    };
    assert_eq!(plan.homotopies, [way]);
    let starts: Vec<&Start> = plan.branches.iter().map(|branch| &branch.start).collect();
    assert_eq!(starts, [&Start::Seed(0), &Start::Seed(1), &Start::EndOfCurve(0), &Start::EndOfHomotopy(0)]);
    // The end of the homotopy is known, so a target alone defines the range.
    assert_eq!((plan.branches[3].range, plan.branches[3].until), ([0.01, 0.2], Some(0.2)));
}

#[test]
fn a_homotopy_alone_is_a_study() {
    let text = "model = \"m\"\n[[seed]]\nname = \"s\"\nstate = { x = 1, y = 0 }\n[[homotopy]]\nname = \"h\"\nfrom = \"s\"\n\
                to = { kappa = 2 }\nvia = \"mu\"\nrange = [0, 1]\n";
    assert_eq!(read(text).plan.homotopies[0].start, Start::Seed(0));
}

/// Replaces a piece of the study and returns its only mistake: the marked text, the message, the hint.
#[track_caller]
fn mistake(piece: &str, by: &str) -> [String; 3] {
    assert_eq!(STUDY.matches(piece).count(), 1, "{piece:?} must stand once in the study");
    let text = STUDY.replace(piece, by);
    let Err(found) = parse_study(&text, "study.toml", MODEL, "pendulum.toml") else { panic!("{by:?} is accepted") };
    assert_eq!(found.len(), 1, "{by:?}: {found:?}");
    let found = &found[0];
    let line = text.lines().nth(found.line - 1).unwrap();
    assert_eq!(found.snippet, line.trim_end());
    let place: String = line.chars().skip(found.column - 1).take(found.length).collect();
    [place, found.message.clone(), found.hint.clone().unwrap_or_default()]
}

/// Piece, replacement, marked text, part of the message, part of the hint.
type Case = (&'static str, &'static str, &'static str, &'static str, &'static str);

#[track_caller]
fn all_are_said(cases: &[Case]) {
    for (piece, by, place, message, hint) in cases {
        let found = mistake(piece, by);
        assert_eq!(found[0], *place, "{by:?}: {found:?}");
        assert!(found[1].contains(message) && found[2].contains(hint), "{by:?}: {found:?}");
    }
}

#[test]
fn mistakes_about_the_kind_of_special_point_of_a_curve() {
    all_are_said(&[
        (
            "hold = \"fold\"",
            "hold = \"fald\"",
            "\"fald\"",
            "is not a kind of special point that can be continued",
            "`fold`",
        ),
        ("hold = \"fold\"", "hold = \"cusp\"", "\"cusp\"", "cusp cannot be continued", "torus"),
        ("hold = \"fold\"", "", "[[curve]]", "has no `hold`", "\"hopf\""),
        ("hold = \"fold\"", "hold = 1", "1", "not text", "text"),
        ("hold = \"period-doubling\"", "hold = \"hopf\"", "\"hopf\"", "cycles have no Hopf points", "torus"),
        ("near = 0.25", "near = 7", "7", "`near` is mu = 7, but the curve stays between", "branch-range"),
        ("near = 0.25", "neer = 0.25", "neer", "unknown key `neer` in a curve", "did you mean `near`"),
    ]);
    let text = STUDY.replace("state = { x = 0.7, y = 0 }", "attractor = \"equilibrium\"");
    let text = text.replace("hold = \"fold\"", "hold = \"torus\"");
    let found = parse_study(&text, "study.toml", MODEL, "pendulum.toml").unwrap_err();
    assert!(found.len() == 1 && found[0].message.contains("equilibria have only folds"), "{found:?}");
}

#[test]
fn mistakes_about_the_branch_of_a_curve() {
    all_are_said(&[
        ("of = \"main\"", "of = \"mian\"", "\"mian\"", "no branch \"mian\"", "did you mean `main`"),
        ("of = \"main\"", "of = \"rest\"", "\"rest\"", "\"rest\" is a seed", "from = \"rest\""),
        ("of = \"main\"", "", "[[curve]]", "has no `of`, the branch on which its special point lies", "of = "),
        ("of = \"main\"", "of = \"goal\"", "\"goal\"", "\"goal\" is defined further down", "below the branch"),
        (
            "of = \"main\"",
            "of = \"goal/hopf-1\"",
            "\"goal/hopf-1\"",
            "\"goal\" is defined further down",
            "below the branch",
        ),
        ("of = \"main\"", "of = \"main/hopf-1\"", "\"main/hopf-1\"", "will not be followed", "switch = { hopf = 1 }"),
        (
            "cycles/period-doubling-1",
            "cycles/period-doubling-1/period-doubling-2/period-doubling-1",
            "\"cycles/period-doubling-1/period-doubling-2/period-doubling-1\"",
            "will not be followed",
            "{ period-doubling = 3 }",
        ),
        ("cycles/period-doubling-1", "cycles/first", "\"cycles/first\"", "no branch that leaves", "period-doubling-1"),
        ("cycles/period-doubling-1", "folds/fold-1", "\"folds/fold-1\"", "\"folds\" is a curve", "from = \"folds\""),
    ]);
}

#[test]
fn mistakes_about_the_parameters_of_a_curve() {
    all_are_said(&[
        (
            "free = \"kappa\"",
            "free = \"mu\"",
            "\"mu\"",
            "mu is already the free parameter of the branch",
            "such as `kappa`",
        ),
        ("free = \"kappa\"", "free = \"kapa\"", "\"kapa\"", "no parameter `kapa`", "did you mean `kappa`"),
        ("free = \"kappa\"", "", "[[curve]]", "this curve has no free parameter", "free = "),
        ("[0.5, 3]", "[3, 0.5]", "[3, 0.5]", "wrong way round", "[0.5, 3]"),
        ("[0.5, 3]", "[2, 3]", "[2, 3]", "the curve starts at kappa = 1, outside", "contains 1"),
        ("range = [0, 0.5]", "", "[[curve]]", "neither `range` nor `until`", "range"),
        ("until = 2.5", "until = 3.5", "3.5", "target 3.5 is outside", "within"),
        ("until = 2.5", "until = 1", "1", "the curve already starts at kappa = 1", "other than"),
        ("[0.5, 1.5]", "[3, 4]", "[3, 4]", "followed in mu from 0 to 2 only", "overlaps [0, 2]"),
        ("[0.5, 1.5]", "[1.5, 0.5]", "[1.5, 0.5]", "wrong way round", "[0.5, 1.5]"),
        ("max-points = 70", "max-points = 0", "0", "`max-points` is 0", "from 1"),
    ]);
}

#[test]
fn mistakes_about_homotopies() {
    all_are_said(&[
        (
            "from = \"folds\"\nto",
            "from = \"fold\"\nto",
            "\"fold\"",
            "no seed, branch, curve or homotopy \"fold\"",
            "folds",
        ),
        (
            "from = \"folds\"\nto",
            "from = \"goal\"\nto",
            "\"goal\"",
            "\"goal\" is defined further down",
            "defined above it",
        ),
        ("from = \"folds\"\nto", "to", "[[homotopy]]", "has no `from`, its start", "from = "),
        ("from = \"folds\"\nto", "from = \"doublings\"\nto", "\"doublings\"", "\"doublings\" has no `until`", "until"),
        ("to = { zeta = 0.01, kappa = 4 }", "", "[[homotopy]]", "has no `to`, the goal", "to = { mu = 1.0 }"),
        ("{ zeta = 0.01, kappa = 4 }", "{}", "{}", "is empty", "at least one"),
        ("{ zeta = 0.01, kappa = 4 }", "4", "4", "not a table", "table"),
        ("kappa = 4 }", "kapa = 4 }", "kapa", "no parameter `kapa`", "kappa"),
        ("kappa = 4 }", "kappa = inf }", "inf", "not a finite number", "number"),
        (
            "{ zeta = 0.01, kappa = 4 }",
            "{ kappa = 2.5 }",
            "{ kappa = 2.5 }",
            "already starts at its goal",
            "other than",
        ),
        ("via = \"mu\"", "via = \"zeta\"", "\"zeta\"", "zeta is part of the goal", "remove zeta from"),
        ("via = \"mu\"", "via = \"my\"", "\"my\"", "no parameter `my`", "mu"),
        ("via = \"mu\"", "", "[[homotopy]]", "has no `via`, the parameter that it may vary", "via = \"mu\""),
        ("range = [-1.5, 2.5]", "", "[[homotopy]]", "has no `range` for mu", "range = "),
        ("[-1.5, 2.5]", "[1, 1]", "[1, 1]", "the range is empty", "different"),
    ]);
    let found = mistake(
        "from = \"folds\"\nto = { zeta = 0.01, kappa = 4 }\nvia = \"mu\"\nrange = [-1.5, 2.5]",
        "from = \"rest\"\nto = { kappa = 4 }\nvia = \"mu\"\nrange = [1, 2]",
    );
    assert!(found[1].contains("the homotopy starts at mu = 0.5, outside its range"), "{found:?}");
}

#[test]
fn mistakes_about_names_and_starts_of_branches() {
    all_are_said(&[
        (
            "name = \"goal\"",
            "name = \"folds\"",
            "\"folds\"",
            "\"folds\" is used twice",
            "curve, homotopy, exploration, survey, sweep, design question and map",
        ),
        (
            "name = \"doublings\"",
            "name = \"cycles/period-doubling-3\"",
            "\"cycles/period-doubling-3\"",
            "part of the branch \"cycles\"",
            "another name",
        ),
        ("name = \"beyond\"", "name = \"way/2\"", "\"way/2\"", "part of the homotopy \"way\"", "another name"),
        ("name = \"doublings\"", "", "[[curve]]", "this curve has no name", "name = "),
        ("[[curve]]\nname = \"doublings\"", "[[curv]]\nname = \"doublings\"", "curv", "unknown key `curv`", "curve"),
    ]);
}

#[test]
fn all_mistakes_are_reported_at_once_in_the_order_of_the_text() {
    let text =
        STUDY.replace("near = 0.25", "near = 7").replace("kappa = 4", "kapa = 4").replace("[-1, 1.5]", "[1.5, -1]");
    let found = parse_study(&text, "study.toml", MODEL, "pendulum.toml").unwrap_err();
    assert_eq!(found.iter().map(|d| d.line).collect::<Vec<_>>(), [28, 45, 53], "{found:?}");
}

#[test]
fn nothing_starts_at_the_end_of_a_curve_without_a_target() {
    let found = parse_study(&STUDY.replace("until = 2.5\n", ""), "study.toml", MODEL, "pendulum.toml").unwrap_err();
    assert_eq!(found.iter().map(|d| d.line).collect::<Vec<_>>(), [43, 50], "{found:?}");
    for mistake in found {
        assert!(mistake.message.contains("\"folds\" has no `until`"), "{mistake}");
    }
}

#[test]
fn switching_at_one_special_point_gives_a_branch_with_curves() {
    let text = STUDY.replace("{ period-doubling = 2 }", "{ period-doubling-1 = 1, hopf = 1 }");
    let cycles = read(&text).plan.branches[1].clone();
    assert_eq!(cycles.switching.only, [(Kind::PeriodDoubling, 1, 1)]);
    let depths = [1, 2].map(|number| cycles.switching.at_point(Kind::PeriodDoubling, number));
    assert_eq!(depths, [1, 0]);
    let below = cycles.switching.below(Kind::PeriodDoubling, 1);
    assert_eq!((below.at_point(Kind::PeriodDoubling, 1), below.at_point(Kind::Hopf, 3)), (0, 1));
    let other = text.replace("period-doubling-1 = 1", "period-doubling-2 = 1");
    let found = parse_study(&other, "study.toml", MODEL, "pendulum.toml").unwrap_err();
    assert!(found[0].message.contains("\"cycles/period-doubling-1\" will not be followed"), "{}", found[0]);
    for wrong in ["period-doubling-0 = 1", "fold-1 = 1", "period-doubling-1 = 17"] {
        let text = STUDY.replace("period-doubling = 2", wrong);
        assert!(parse_study(&text, "study.toml", MODEL, "pendulum.toml").is_err(), "{wrong}");
    }
}
