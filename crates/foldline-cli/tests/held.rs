//! Branches in several parameters along which quantities keep their values.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind, Point};
use foldline::explore::{self, System};
use foldline::model::Model;
use foldline::special::quantity::Quantity;
use foldline_store::study_file::parse_study;

/// x'' + 2ζx' + x + k x³ = F cos Ωt.
const OSCILLATOR: &str = "name = \"oscillator\"\n[parameters]\nOmega = 0.5\nF = 0.3\nzeta = 0.1\nk = 0\n\
    [forcing]\nfrequency = \"Omega\"\n[states]\nx = \"v\"\nv = \"-2*zeta*v - x - k*x^3 + F*cos(Omega*t)\"\n\
    [outputs]\nsum = \"x + k*v\"\n";
const FORCED: &str = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 4\n\
    [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [0.2, 3]\n";
/// A circle of radius √growth on which the phase moves with the rate 1 + bend growth.
const CIRCLE: &str = "name = \"circle\"\n[parameters]\ngrowth = 0.5\nbend = 0.3\n[states]\n\
    x = \"x*(growth - x^2 - y^2) - y*(1 + bend*(x^2 + y^2))\"\ny = \"y*(growth - x^2 - y^2) + x*(1 + bend*(x^2 + y^2))\"\n";

fn run(model: &str, study: &str) -> (Model, Diagram) {
    let study = parse_study(&format!("model = \"m\"\n{study}"), "study", model, "model")
        .unwrap_or_else(|found| panic!("{found:?}"));
    let diagram =
        explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved);
    (study.model, diagram)
}

#[track_caller]
fn branch<'d>(diagram: &'d Diagram, name: &str) -> &'d Branch {
    let found = diagram.branch(name).unwrap_or_else(|| panic!("no branch {name}: {:?}", diagram.shortfalls));
    assert!(!found.points.is_empty(), "{name}: {:?}", found.ends);
    assert!(found.special.iter().all(|s| s.kind != Kind::Unexplained), "{name}");
    found
}

#[track_caller]
fn value(model: &Model, point: &Point, name: &str) -> f64 {
    Quantity::named(name, model).unwrap().on(point, model).unwrap()
}

fn ended(branch: &Branch) -> [&'static str; 2] {
    [0, 1].map(|side| branch.ends[side].as_ref().map_or("none", Ending::code))
}

#[test]
fn the_force_for_a_given_amplitude_of_the_linear_oscillator_is_exact() {
    let held = "[[branch]]\nname = \"h\"\nfrom = \"b\"\nfree = [\"Omega\", \"F\"]\nhold = { x_max = 0.8 }\n\
        range = { Omega = [0.3, 2], F = [0, 5] }\npeaks = [\"F\"]\n";
    let (model, diagram) = run(OSCILLATOR, &format!("{FORCED}{held}"));
    let own = branch(&diagram, "h");
    assert_eq!(ended(own), ["bound", "bound"], "{:?}", own.ends);
    assert!(own.points.len() > 5);
    for point in &own.points {
        let (omega, force) = (point.parameters[0], point.parameters[1]);
        let exact = 0.8 * (1.0 - omega * omega).hypot(0.2 * omega);
        assert!((force / exact - 1.0).abs() < 3.0 * point.trust.discretisation, "{omega}: {force} against {exact}");
        assert!((point.ranges[0][1] - 0.8).abs() < 1e-7, "{:?}", point.ranges[0]);
        assert!((value(&model, point, "x_h1") - 0.8).abs() < 1e-6);
    }
    // The least force is that of the resonance.
    let [peak] = &own.special[..] else { panic!("{:?}", own.special.len()) };
    assert!((peak.point.parameters[0] - (1.0 - 2.0 * 0.01f64).sqrt()).abs() < 1e-6 && peak.kind == Kind::Peak);
}

#[test]
fn phase_resonance_gives_the_backbone_of_a_damped_oscillator() {
    // Linear: Ω = 1 and x = F/2ζ for every force.
    let held = "mark = { x_h1_phase = 90 }\n[[branch]]\nname = \"backbone\"\nfrom = \"b\"\nfree = [\"F\", \"Omega\"]\n\
        hold = { x_h1_phase = 90 }\nrange = [0.05, 3]\n";
    let (model, diagram) = run(OSCILLATOR, &format!("{FORCED}{held}"));
    let own = branch(&diagram, "backbone");
    assert_eq!(ended(own), ["bound", "bound"], "{:?}", own.ends);
    for point in &own.points {
        let (omega, force) = (point.parameters[0], point.parameters[1]);
        assert!((omega - 1.0).abs() < 1e-7, "{omega}");
        assert!((value(&model, point, "x_h1") / (force / 0.2) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn the_backbone_of_the_duffing_oscillator_passes_through_the_resonances_of_its_responses() {
    let stiff = FORCED.replace("samples = 4", "parameters = { k = 1, F = 0.1, Omega = 0.2 }\nsamples = 4");
    let held = "mark = { x_h1_phase = 90 }\n[[branch]]\nname = \"backbone\"\nfrom = \"b\"\nfree = [\"F\", \"Omega\"]\n\
        hold = { x_h1_phase = 90 }\nrange = [0.02, 0.6]\nmark = { F = [0.05, 0.4] }\n";
    let (model, diagram) = run(OSCILLATOR, &format!("{stiff}{held}"));
    let own = branch(&diagram, "backbone");
    assert_eq!(ended(own), ["bound", "bound"], "{:?}", own.ends);
    let marked: Vec<&Point> = own.special.iter().filter(|s| s.kind == Kind::Mark).map(|s| &s.point).collect();
    assert_eq!(marked.len(), 2);
    for point in marked {
        // The other way round: the response at this force, with its phase resonance as a mark.
        let other = stiff.replace("F = 0.1", &format!("F = {}", point.parameters[1]));
        let (_, there) = run(OSCILLATOR, &format!("{other}mark = {{ x_h1_phase = 90 }}\n"));
        let places: Vec<[f64; 2]> = branch(&there, "b")
            .special
            .iter()
            .filter(|s| s.kind == Kind::Mark)
            .map(|s| [s.point.parameters[0], value(&model, &s.point, "x_h1")])
            .collect();
        let own = [point.parameters[0], value(&model, point, "x_h1")];
        let near = |place: &[f64; 2]| (place[0] - own[0]).abs() < 1e-6 && (place[1] - own[1]).abs() < 1e-6;
        assert!(places.iter().any(near), "{own:?} {places:?}");
    }
}

#[test]
fn a_held_period_relates_amplitude_and_bend() {
    let study = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 4\n\
        [[branch]]\nname = \"p\"\nfrom = \"s\"\nfree = [\"growth\", \"bend\"]\nhold = [\"period\"]\nrange = [0.2, 2]\n\
        [[branch]]\nname = \"f\"\nfrom = \"s\"\nfree = [\"bend\", \"growth\"]\nhold = { frequency = 0.2 }\nrange = [0.1, 0.9]\n\
        [[branch]]\nname = \"r\"\nfrom = \"s\"\nfree = [\"bend\", \"growth\"]\nhold = { x_rms = 0.6 }\nrange = [-0.5, 0.9]\n";
    let (_, diagram) = run(CIRCLE, study);
    for point in &branch(&diagram, "p").points {
        let (growth, bend) = (point.parameters[0], point.parameters[1]);
        assert!((growth * bend - 0.15).abs() < 1e-6, "{growth} {bend}");
    }
    for point in &branch(&diagram, "f").points {
        let rate = 1.0 + point.parameters[0] * point.parameters[1];
        assert!((rate - 0.4 * std::f64::consts::PI).abs() < 1e-6, "{rate}");
    }
    for point in &branch(&diagram, "r").points {
        assert!((point.parameters[0] - 0.72).abs() < 1e-6);
    }
    for name in ["p", "f", "r"] {
        assert_eq!(ended(branch(&diagram, name)), ["bound", "bound"], "{name}");
    }
}

#[test]
fn folds_branch_points_and_hopf_points_lie_where_they_do_for_equilibria() {
    // x = ½ held: p = x² - q x, eigenvalue 2x - q... of x' = p - x² + q x; zero at q = 1.
    let model =
        "name = \"m\"\n[parameters]\np = 0.5\nq = 0\nr = -1\n[states]\nx = \"p - x^2 + q*x\"\ny = \"r*y - y^3\"\n";
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 0.7, y = 0 }\n\
        [[branch]]\nname = \"h\"\nfrom = \"s\"\nfree = [\"q\", \"p\"]\nhold = { x = 0.5 }\nrange = [-1, 2]\n\
        [[branch]]\nname = \"y\"\nfrom = \"s\"\nfree = [\"r\", \"p\"]\nhold = { x = 0.5 }\nrange = [-1, 1]\n";
    let (_, diagram) = run(model, study);
    let own = branch(&diagram, "h");
    for point in &own.points {
        assert!((point.parameters[0] - (0.25 - 0.5 * point.parameters[1])).abs() < 1e-9);
    }
    let found: Vec<(Kind, f64)> = own.special.iter().map(|s| (s.kind, s.point.parameters[1])).collect();
    assert!(found.len() == 1 && found[0].0 == Kind::Fold && (found[0].1 - 1.0).abs() < 1e-7, "{found:?}");
    // A pitchfork of y is a branch point.
    let found: Vec<(Kind, f64)> =
        branch(&diagram, "y").special.iter().map(|s| (s.kind, s.point.parameters[2])).collect();
    assert!(found.len() == 1 && found[0].0 == Kind::BranchPoint && found[0].1.abs() < 1e-7, "{found:?}");
    // Brusselator with y held: y = B/A; Hopf at B = 1 + A².
    let brusselator = include_str!("../../../models/brusselator.toml");
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 1, y = 1.5 }\nparameters = { A = 1, B = 1.5 }\n\
        [[branch]]\nname = \"h\"\nfrom = \"s\"\nfree = [\"A\", \"B\"]\nhold = { y = 2.5 }\nrange = [0.1, 4]\n";
    let (model, diagram) = run(brusselator, study);
    let [a, b] = ["A", "B"].map(|name| model.parameter_index(name).unwrap());
    let found: Vec<(Kind, f64, f64)> =
        branch(&diagram, "h").special.iter().map(|s| (s.kind, s.point.parameters[a], s.point.parameters[b])).collect();
    assert_eq!(found.len(), 2, "{found:?}");
    // 2.5 A = 1 + A²: A = ½ and 2.
    for (kind, at, other) in found {
        assert!(kind == Kind::Hopf && (at - 0.5).abs().min((at - 2.0).abs()) < 1e-7 && (other - 2.5 * at).abs() < 1e-7);
    }
}

#[test]
fn folds_of_cycles_are_found_where_the_amplitude_is_held() {
    // The folds of responses at fixed force, seen along the branch of amplitude 1: where a multiplier passes 1.
    let stiff = FORCED.replace("samples = 4", "parameters = { k = 1, F = 0.3, Omega = 2.8 }\nsamples = 4");
    let stiff = stiff.replace("[0.2, 3]", "[0.9, 3]");
    let held =
        "[[branch]]\nname = \"h\"\nfrom = \"b\"\nfree = [\"Omega\", \"F\"]\nhold = { x_h1 = 1 }\nrange = [1, 2]\n";
    let (model, diagram) = run(OSCILLATOR, &format!("{stiff}{held}"));
    let own = branch(&diagram, "h");
    let folds: Vec<&Point> = own.special.iter().filter(|s| s.kind == Kind::Fold).map(|s| &s.point).collect();
    let frequencies: Vec<f64> = folds.iter().map(|point| point.parameters[0]).collect();
    assert!(folds.len() == 2 && own.special.len() == 2, "{frequencies:?}");
    // One harmonic: (¾ - s)(9/4 - s) + 4ζ²(1 + s) = 0 with s = Ω² - 1.
    assert!((frequencies[0] - 1.3415).abs() < 0.02 && (frequencies[1] - 1.778).abs() < 0.02, "{frequencies:?}");
    assert!(own.points.iter().any(|point| point.unstable == 1) && own.points.iter().any(|point| point.unstable == 0));
    for point in folds {
        let other = stiff.replace("F = 0.3", &format!("F = {}", point.parameters[1]));
        let (_, there) = run(OSCILLATOR, &other);
        let places: Vec<[f64; 2]> = branch(&there, "b")
            .special
            .iter()
            .filter(|s| s.kind == Kind::Fold)
            .map(|s| [s.point.parameters[0], value(&model, &s.point, "x_h1")])
            .collect();
        assert!(
            places.iter().any(|p| (p[0] - point.parameters[0]).abs() < 1e-5 && (p[1] - 1.0).abs() < 1e-3),
            "{:?} {places:?}",
            point.parameters
        );
    }
}

#[test]
fn a_fixed_point_of_a_map_keeps_a_state() {
    // Hénon: x = 1 - a x² + b x with x = ½: a = 2 + 2 b; period doubling at b - 2 a x = 1 + … of the trace.
    let model = "name = \"henon\"\n[parameters]\na = 0.1\nb = 0.3\n[states]\nx = { range = [-1, 1] }\ny = { range = [-1, 1] }\n\
        [map]\nx = \"1 - a*x^2 + y\"\ny = \"b*x\"\n";
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 1.2, y = 0.35 }\n\
        [[branch]]\nname = \"h\"\nfrom = \"s\"\nfree = [\"b\", \"a\"]\nhold = { x_max = 0.5 }\nrange = [-0.9, 0.9]\n";
    let (_, diagram) = run(model, study);
    let own = branch(&diagram, "h");
    for point in &own.points {
        let (a, b) = (point.parameters[0], point.parameters[1]);
        assert!((a - (2.0 + 2.0 * b)).abs() < 1e-9, "{a} {b}");
    }
    // Multipliers: z² + 2 a x z - b = 0; z = -1 where 1 - 2 a x - b = 0, that is b = -1/3.
    let found: Vec<(Kind, f64)> = own.special.iter().map(|s| (s.kind, s.point.parameters[1])).collect();
    assert!(
        found.len() == 1 && found[0].0 == Kind::PeriodDoubling && (found[0].1 + 1.0 / 3.0).abs() < 1e-8,
        "{found:?}"
    );
}

#[test]
fn two_outputs_are_held_in_three_parameters() {
    // x_max and the rms of x + k v (k multiplies no force, as x³ is replaced by a linear spring here).
    let model = OSCILLATOR.replace(" - k*x^3", "").replace("k = 0\n", "k = 0.5\n");
    let held = "[[branch]]\nname = \"h\"\nfrom = \"b\"\nfree = [\"Omega\", \"F\", \"k\"]\nhold = { x_max = 0.8, sum_rms = 0.7 }\n\
        range = { Omega = [0.6, 2], k = [0, 5] }\n";
    let (_, diagram) = run(&model, &format!("{FORCED}{held}"));
    let own = branch(&diagram, "h");
    assert!(own.points.len() > 3);
    for point in &own.points {
        let (omega, force, k) = (point.parameters[0], point.parameters[1], point.parameters[3]);
        let exact = 0.8 * (1.0 - omega * omega).hypot(0.2 * omega);
        assert!((force / exact - 1.0).abs() < 1e-6);
        let rms = 0.8 * 1f64.hypot(k * omega) / 2f64.sqrt();
        assert!((rms - 0.7).abs() < 1e-6, "{rms}");
    }
}

#[test]
fn a_branch_ends_by_name_where_another_hump_becomes_higher() {
    // p cos θ + q cos 2θ has the humps q + p and q - p: y_max = 2 holds along q = 2 - p until p = 0.
    let model = "name = \"humps\"\n[parameters]\nOmega = 1\np = 1\nq = 1\n[forcing]\nfrequency = \"Omega\"\n[states]\n\
        x = \"-x + cos(Omega*t)\"\n[outputs]\ny = \"p*cos(Omega*t) + q*cos(2*Omega*t)\"\n";
    let study = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 2\n\
        [[branch]]\nname = \"h\"\nfrom = \"s\"\nfree = [\"q\", \"p\"]\nhold = { y_max = 2 }\nrange = [0.5, 3]\n";
    let (_, diagram) = run(model, study);
    let own = branch(&diagram, "h");
    assert_eq!(ended(own), ["bound", "held-corner"], "{:?}", own.ends);
    let last = own.points.last().unwrap();
    assert!((last.parameters[2] - 2.0).abs() < 1e-3 && last.parameters[1].abs() < 1e-3, "{:?}", last.parameters);
    assert!(own.points.iter().all(|p| (p.parameters[2] + p.parameters[1] - 2.0).abs() < 1e-6));
}

#[test]
fn a_conservative_family_keeps_its_amplitude_or_period() {
    // x'' + x + k x³ = 0 at amplitude 1: T = 4 K(m)/√(1 + k), m = k/(2 + 2k).
    let model =
        "name = \"duffing\"\n[parameters]\nk = 0\nzeta = 0\n[states]\nx = \"v\"\nv = \"-2*zeta*v - x - k*x^3\"\n";
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 0, v = 0 }\n\
        [[branch]]\nname = \"rest\"\nfrom = \"s\"\nfree = \"zeta\"\nrange = [-1, 1]\nswitch = { hopf = 1 }\nstop = { x_max = 1 }\n\
        [[branch]]\nname = \"h\"\nfrom = \"rest/hopf-1\"\nfree = [\"k\", \"zeta\"]\nhold = { x_max = 1 }\nrange = [-0.5, 4]\n";
    let (_, diagram) = run(model, study);
    let own = branch(&diagram, "h");
    assert_eq!(ended(own), ["bound", "bound"], "{:?}", own.ends);
    for point in &own.points {
        let k = point.parameters[0];
        let m = k / (2.0 + 2.0 * k);
        // Complete elliptic integral by the arithmetic–geometric mean.
        let (mut a, mut b) = (1.0f64, (1.0 - m).sqrt());
        for _ in 0..20 {
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
        }
        let exact = 4.0 * std::f64::consts::FRAC_PI_2 / a / (1.0 + k).sqrt();
        let period = point.solution.period().unwrap();
        assert!((period / exact - 1.0).abs() < 1e-6 && point.parameters[1].abs() < 1e-7, "{k}: {period} {exact}");
        assert_eq!(point.unstable, 0);
    }
}

#[test]
fn what_cannot_start_says_why() {
    let held =
        "[[branch]]\nname = \"h\"\nfrom = \"b\"\nfree = [\"Omega\", \"F\"]\nhold = { x_max = 9 }\nrange = [0.3, 2]\n";
    let (_, diagram) = run(OSCILLATOR, &format!("{FORCED}{held}"));
    let own = diagram.branch("h").unwrap();
    let Some(Ending::NoStart(why)) = &own.ends[1] else { panic!("{:?}", own.ends) };
    assert!(why.starts_with("no point of the branch b has x_max = 9 (its points have values from 0."), "{why}");
    // The phase of an autonomous cycle changes with no parameter, and rms and amplitude of a circle are one.
    let study = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 4\n\
        [[branch]]\nname = \"r\"\nfrom = \"s\"\nfree = [\"growth\", \"bend\"]\nhold = { x_rms = 0.6 }\nrange = [0.2, 2]\n";
    let (_, diagram) = run(CIRCLE, study);
    let Some(Ending::NoStart(why)) = &diagram.branch("r").unwrap().ends[1] else { panic!() };
    assert!(
        why.starts_with(
            "the held quantities could not be brought to their values; reached x_rms = 0.500000 instead of 0.6"
        ),
        "{why}"
    );
}

#[test]
fn mistakes_have_place_cause_and_cure() {
    let found = |line: &str| -> String {
        let study = format!("model = \"m\"\n{FORCED}[[branch]]\nname = \"h\"\nfrom = \"b\"\n{line}\n");
        let found = parse_study(&study, "study", OSCILLATOR, "model").expect_err(line);
        found.iter().map(|one| format!("{one}\n")).collect()
    };
    for (line, parts) in [
        ("free = [\"Omega\", \"F\"]\nrange = [0.3, 2]", vec!["no quantity is held", "hold = { x_max = 2 }"]),
        (
            "free = \"Omega\"\nhold = { x_max = 1 }\nrange = [0.3, 2]",
            vec!["1 free parameter with 1 held quantity", "\"Omega\", \"F\""],
        ),
        (
            "free = [\"Omega\", \"F\", \"k\"]\nhold = { x_max = 1 }\nrange = [0.3, 2]",
            vec!["3 free parameters with 1 held quantity", "2 quantities in `hold`"],
        ),
        ("free = [\"Omega\", \"Omega\"]\nhold = { x_max = 1 }\nrange = [0.3, 2]", vec!["given twice"]),
        ("free = [\"Omega\", \"G\"]\nhold = { x_max = 1 }\nrange = [0.3, 2]", vec!["no parameter `G`"]),
        ("free = [\"Omega\", \"F\"]\nhold = { y_max = 1 }\nrange = [0.3, 2]", vec!["`y_max` is not a quantity"]),
        ("free = [\"Omega\", \"F\"]\nhold = { zeta = 1 }\nrange = [0.3, 2]", vec!["zeta is a parameter"]),
        ("free = [\"Omega\", \"F\"]\nhold = 3\nrange = [0.3, 2]", vec!["neither a table of values nor a list"]),
        (
            "free = [\"Omega\", \"F\"]\nhold = { x_h0 = 3 }\nrange = [0.3, 2]",
            vec!["`x_h0` is not a quantity", "followed by `_h` and an order"],
        ),
        ("free = [\"Omega\", \"F\"]\nhold = { x_max = 1 }\nrange = { F = [0, 1] }", vec!["lacks that of Omega"]),
        (
            "free = [\"Omega\", \"F\"]\nhold = { x_max = 1 }\nrange = { Omega = [0, 1], k = [0, 1] }",
            vec!["k has a range, but is not free"],
        ),
        (
            "free = [\"Omega\", \"F\"]\nhold = { x_max = 1 }\nrange = [0.3, 2]\nswitch = { period-doubling = 1 }",
            vec!["not switched"],
        ),
        ("free = \"Omega\"\nnear = 1\nrange = [0.3, 2]", vec!["`near` selects"]),
        ("free = \"Omega\"\npeaks = [\"Omega\"]\nrange = [0.3, 2]", vec!["Omega turns at folds"]),
        ("free = \"Omega\"\npeaks = [\"x_h1\", 3]\nrange = [0.3, 2]", vec!["an entry of `peaks`"]),
    ] {
        let text = found(line);
        assert!(parts.iter().all(|part| text.contains(part)), "{line}\n{text}");
    }
    let bare = found("free = [\"Omega\", \"F\"]\nhold = { x = 1 }\nrange = [0.3, 2]");
    assert!(bare.contains("x varies along a cycle") && bare.contains("`x_max`"), "{bare}");
    let study = "model = \"m\"\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 4\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"growth\"\nrange = [0, 1]\nmark = { x_h1_phase = 90 }\n";
    let text: String =
        parse_study(study, "study", CIRCLE, "model").unwrap_err().iter().map(|one| one.to_string()).collect();
    assert!(text.contains("the phase of a cycle is arbitrary") && text.contains("x_h1_phase-y_h1_phase"), "{text}");
}

/// A folder with a model and a study of a held branch, and the command.
struct Desk(tempfile::TempDir);

impl Desk {
    fn new() -> Desk {
        let desk = Desk(tempfile::tempdir().unwrap());
        std::fs::write(desk.0.path().join("m.toml"), OSCILLATOR).unwrap();
        let held = "peaks = [\"x_h1\"]\n[[branch]]\nname = \"h\"\nfrom = \"b\"\nfree = [\"Omega\", \"F\"]\nhold = { x_max = 0.8 }\nrange = [0.3, 2]\n";
        let record = "record = [\"x_h1\", \"x_h1_phase\", \"x_h1/v_h1_dB\", \"x+iv_h-1\"]";
        std::fs::write(desk.0.path().join("s.toml"), format!("model = \"m.toml\"\n{record}\n{FORCED}{held}")).unwrap();
        desk
    }

    /// Runs the command and returns its standard output.
    #[track_caller]
    fn run(&self, arguments: &str) -> String {
        let command = std::process::Command::new(env!("CARGO_BIN_EXE_foldline"))
            .args(arguments.split(' '))
            .current_dir(self.0.path())
            .output()
            .unwrap();
        assert!(command.status.success(), "{arguments}: {}", String::from_utf8_lossy(&command.stderr));
        String::from_utf8(command.stdout).unwrap()
    }

    /// Column of a table in comma-separated values.
    fn column(text: &str, name: &str) -> Vec<f64> {
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let head: Vec<&str> = lines.next().unwrap().split(',').map(|cell| cell.trim_matches('"')).collect();
        let at = head.iter().position(|own| *own == name).unwrap_or_else(|| panic!("no {name} in {head:?}"));
        lines.map(|line| line.split(',').nth(at).unwrap().parse().unwrap_or(f64::NAN)).collect()
    }
}

#[test]
fn recorded_quantities_are_columns_of_tables_and_exports_and_axes_of_pictures() {
    let desk = Desk::new();
    desk.run("run s.toml --out r");
    let table = desk.run("table r --points --branch b --format csv");
    desk.run("export r --format csv --out e --no-profiles");
    desk.run("export r --format netcdf --out e.nc --no-profiles");
    let exported = std::fs::read_to_string(desk.0.path().join("e/points.csv")).unwrap();
    let count = Desk::column(&table, "Omega").len();
    for (text, ratio, pair) in
        [(&table, "x_h1/v_h1_dB", "x+iv_h-1"), (&exported, "x_h1_over_v_h1_dB", "x_plus_iv_h_minus_1")]
    {
        let [omega, x, phase, decibels, backward] =
            ["Omega", "x_h1", "x_h1_phase", ratio, pair].map(|name| Desk::column(text, name));
        for k in 0..count {
            let (re, im) = (1.0 - omega[k] * omega[k], 0.2 * omega[k]);
            assert!(
                (x[k] * re.hypot(im) / 0.3 - 1.0).abs() < 1e-6 && (phase[k] - im.atan2(re).to_degrees()).abs() < 1e-4
            );
            assert!((decibels[k] + 20.0 * omega[k].log10()).abs() < 1e-5, "{}", decibels[k]);
            // x + i x' of a harmonic motion turns backwards with a (1 + Ω)/2.
            assert!((backward[k] - 0.5 * x[k] * (1.0 + omega[k])).abs() < 1e-6);
        }
    }
    let special = desk.run("table r --format csv");
    assert!(Desk::column(&special, "x_h1")[0].is_finite());
    for axes in ["--x Omega --y x_h1_phase", "--x F --y x_h1/v_h1_dB", "--y v_h1"] {
        desk.run(&format!("plot r {axes} -o p.svg"));
        let picture = std::fs::read_to_string(desk.0.path().join("p.svg")).unwrap();
        assert!(picture.contains("<path") || picture.contains("<polyline"), "{axes}");
    }
}

#[test]
fn a_stored_branch_knows_what_it_holds_and_is_verified() {
    let desk = Desk::new();
    desk.run("run s.toml --out r");
    let branches = desk.run("table r --branches");
    assert!(branches.contains("x_max = 0.8"), "{branches}");
    let run = foldline_store::run_file::load(&desk.0.path().join("r")).unwrap();
    let own = run.diagram.branch("h").unwrap();
    assert_eq!((own.also.len(), own.also[0].0, &own.levels[..]), (1, 1, &[("x_max".to_string(), 0.8)][..]));
    let plain = run.diagram.branch("b").unwrap();
    assert!(plain.also.is_empty() && plain.levels.is_empty());
    let checked = desk.run("verify r");
    assert!(!checked.contains("did not converge") && !checked.contains("another solution"), "{checked}");
    assert!(checked.lines().any(|line| line.starts_with("profile") && line.contains("100.0 %")), "{checked}");
}

#[test]
fn an_interrupted_branch_with_held_quantities_is_resumed() {
    struct Enough(std::sync::atomic::AtomicUsize);
    impl foldline::contract::Observer for Enough {
        fn observe(&self, event: foldline::contract::Event) -> foldline::contract::Verdict {
            let own = matches!(event, foldline::contract::Event::Point(branch, _) if branch.name == "h");
            let count = self.0.fetch_add(usize::from(own), std::sync::atomic::Ordering::SeqCst);
            if own && count >= 4 { foldline::contract::Verdict::Stop } else { foldline::contract::Verdict::Continue }
        }
    }
    let held =
        "[[branch]]\nname = \"h\"\nfrom = \"b\"\nfree = [\"Omega\", \"F\"]\nhold = { x_max = 0.8 }\nrange = [0.3, 2]\n";
    let study = parse_study(&format!("model = \"m\"\n{FORCED}{held}"), "study", OSCILLATOR, "model").unwrap();
    let system = System::of_plan(&study.model, &study.plan);
    let whole = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    let part = explore::run(&system, &study.plan, 1, Diagram::default(), &Enough(Default::default()));
    assert!(part.branch("h").unwrap().points.len() < whole.branch("h").unwrap().points.len());
    let rest = explore::run(&system, &study.plan, 1, part, &Unobserved);
    let [a, b] = [&whole, &rest].map(|diagram| branch(diagram, "h"));
    assert_eq!((a.points.len(), ended(b)), (b.points.len(), ["bound", "bound"]));
    for (a, b) in a.points.iter().zip(&b.points) {
        assert!((a.parameters[1] - b.parameters[1]).abs() < 1e-7);
    }
}

/// Swings of a pendulum of given period T = 4 K(sin²(a/2)): the closed form.
#[test]
fn a_pendulum_of_given_period() {
    let model =
        "name = \"pendulum\"\n[parameters]\ng = 1\nzeta = 0\n[states]\nth = \"v\"\nv = \"-2*zeta*v - g*sin(th)\"\n";
    let study = "tolerance = 1e-9\n[[seed]]\nname = \"s\"\nstate = { th = 0, v = 0 }\n\
        [[branch]]\nname = \"rest\"\nfrom = \"s\"\nfree = \"zeta\"\nrange = [-1, 1]\nswitch = { hopf = 1 }\nstop = { th_max = 1.2 }\n\
        [[branch]]\nname = \"swings\"\nfrom = \"rest/hopf-1\"\nfree = \"zeta\"\nrange = [-1, 1]\nmark = { period = [7, 8, 10] }\n\
        stop = { th_max = 2.6 }\n";
    let (model, diagram) = run(model, study);
    let own = branch(&diagram, "swings");
    let marks: Vec<f64> =
        own.special.iter().filter(|s| s.kind == Kind::Mark).map(|s| value(&model, &s.point, "th_max")).collect();
    // The last one is the stop.
    assert_eq!(marks.len(), 4, "{marks:?} {:?}", own.ends);
    for (found, known) in marks.iter().zip([1.284_567_283_964, 1.862_633_747_236, 2.439_906_971_216]) {
        assert!((found / known - 1.0).abs() < 1e-8, "{found} {known}");
    }
}
