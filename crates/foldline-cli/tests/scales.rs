//! Results do not depend on the units in which a model is written.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Kind};
use foldline::explore::{self, System};
use foldline_store::study_file::parse_study;

#[track_caller]
fn run(model: &str, study: &str) -> Diagram {
    let text = format!("model = \"m\"\n{study}");
    let study = parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let system = System::of_plan(&study.model, &study.plan);
    explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved)
}

/// Asserts that two branches have the same points and special points, where parameter p of the second is `units[p]`
/// times that of the first.
#[track_caller]
fn same(one: &Branch, other: &Branch, units: &[f64]) {
    assert_eq!(one.points.len(), other.points.len(), "{} in units of {units:?}", one.name);
    let near = |a: f64, b: f64, size: f64| (a - b).abs() <= 1e-6 * size;
    for (a, b) in one.points.iter().zip(&other.points) {
        for (k, unit) in units.iter().enumerate() {
            let (x, y) = (a.parameters[k], b.parameters[k] / unit);
            assert!(near(x, y, 1.0 + x.abs()), "{} in units of {units:?}: {x} {y}", one.name);
        }
        for (x, y) in a.ranges.iter().flatten().zip(b.ranges.iter().flatten()) {
            assert!(near(*x, *y, 1.0 + x.abs()), "{} in units of {units:?}: {x} {y}", one.name);
        }
        assert_eq!(a.unstable, b.unstable);
    }
    let kinds = |branch: &Branch| branch.special.iter().map(|s| (s.kind, s.unstable_before)).collect::<Vec<_>>();
    assert_eq!(kinds(one), kinds(other), "{} in units of {units:?}", one.name);
    for (a, b) in one.special.iter().zip(&other.special) {
        let (x, y) = (a.point.parameters[one.free], b.point.parameters[one.free] / units[one.free]);
        assert!(
            (x - y).abs() <= (a.error + b.error) * one.size(x),
            "{} {} in units of {units:?}: {x} {y}",
            one.name,
            a.kind
        );
        assert!(b.error < 3.0 * a.error + 1e-9 && a.error < 3.0 * b.error + 1e-9, "{} {}", a.error, b.error);
    }
    let codes = |branch: &Branch| branch.ends.iter().flatten().map(|end| end.code()).collect::<Vec<_>>();
    assert_eq!(codes(one), codes(other), "{} in units of {units:?}", one.name);
}

const UNITS: [f64; 5] = [1e-12, 1e-9, 1e-6, 1e6, 1e12];

fn fold(unit: f64) -> Diagram {
    let model = format!("name = \"fold\"\n[parameters]\nmu = 0.0\n[states]\nx = \"1 - mu/{unit:e} - x^2\"\n");
    let [low, high, mark] = [-3.0, 2.0, -1.0].map(|value| value * unit);
    run(
        &model,
        &format!(
            "[[seed]]\nname = \"rest\"\nstate = {{ x = 1 }}\n[[branch]]\nname = \"b\"\nfrom = \"rest\"\nfree = \"mu\"\n\
             range = [{low:e}, {high:e}]\nmark = {{ mu = {mark:e} }}\n"
        ),
    )
}

/// x' = 1 - mu/u - x² has a fold at mu = u for every u.
#[test]
fn a_fold_is_found_with_the_same_points_in_any_unit_of_the_parameter() {
    let usual = fold(1.0);
    let kinds: Vec<Kind> = usual.branches[0].special.iter().map(|s| s.kind).collect();
    assert_eq!(kinds.iter().filter(|kind| **kind == Kind::Mark).count(), 2);
    for unit in UNITS {
        let found = fold(unit);
        same(&usual.branches[0], &found.branches[0], &[unit]);
        let fold = found.branches[0].special.iter().find(|s| s.kind == Kind::Fold).unwrap();
        assert!((fold.point.parameters[0] / unit - 1.0).abs() < 1e-8, "{unit}: {:?}", fold.point.parameters);
    }
}

/// A long straight branch takes tens of points.
#[test]
fn a_straight_branch_takes_few_points_in_any_unit() {
    for (unit, value) in [(1.0, 0.0), (1.0, 1.0), (1e9, 1e9), (1e-9, 0.0)] {
        let model = format!("name = \"line\"\n[parameters]\np = {value:e}\n[states]\nx = \"p/{unit:e} - x\"\n");
        let study = format!(
            "[[seed]]\nname = \"rest\"\nstate = {{ x = 1 }}\n[[branch]]\nname = \"b\"\nfrom = \"rest\"\nfree = \"p\"\n\
             range = [0, {:e}]\n",
            5000.0 * unit
        );
        let count = run(&model, &study).branches[0].points.len();
        assert!(count < 100, "{unit} {value}: {count} points");
    }
}

fn neuron(unit: f64, time: f64) -> Diagram {
    let model = format!(
        "name = \"FitzHugh-Nagumo\"\n[parameters]\nI = 0.0\na = {a:e}\n[states]\nv = \"v - v^3/3 - w + I/{unit:e}\"\n\
         w = \"0.08*(v + a/{time:e} - 0.8*w)\"\n",
        a = 0.7 * time
    );
    let [low, high, down, up] = [-0.5 * unit, 2.0 * unit, 0.2 * time, 0.9 * time];
    run(
        &model,
        &format!(
            "[[seed]]\nname = \"rest\"\nattractor = \"equilibrium\"\n[[branch]]\nname = \"b\"\nfrom = \"rest\"\nfree = \"I\"\n\
             range = [{low:e}, {high:e}]\nswitch = {{ hopf = 1 }}\n[[curve]]\nname = \"hopf\"\nhold = \"hopf\"\nof = \"b\"\n\
             free = \"a\"\nrange = [{down:e}, {up:e}]\n"
        ),
    )
}

/// Cycles through two canard explosions, and a curve of Hopf points in two parameters of different units.
#[test]
fn cycles_and_curves_are_the_same_in_any_unit_of_their_parameters() {
    let usual = neuron(1.0, 1.0);
    let names: Vec<&str> = usual.branches.iter().map(|branch| branch.name.as_str()).collect();
    assert_eq!(names, ["b", "b/hopf-1", "hopf"]);
    for (unit, time) in [(1e-9, 1e6), (1e12, 1e-12)] {
        let found = neuron(unit, time);
        assert_eq!(found.branches.len(), 3);
        for (one, other) in usual.branches.iter().zip(&found.branches) {
            if one.name != "b/hopf-1" {
                same(one, other, &[unit, time]);
                continue;
            }
            // In a canard explosion a rounding error decides the steps.
            let places = |branch: &Branch, unit: f64| {
                let all = branch.special.iter().map(|s| (s.kind, s.point.parameters[0] / unit));
                all.collect::<Vec<_>>()
            };
            let (one, other) = (places(one, 1.0), places(other, unit));
            assert_eq!(one.len(), other.len(), "{one:?} {other:?}");
            for (a, b) in one.iter().zip(&other) {
                assert!(a.0 == b.0 && (a.1 - b.1).abs() < 1e-6, "{one:?} {other:?}");
            }
        }
    }
}

/// A scale may be declared where the value of a parameter says little about its size.
#[test]
fn a_declared_scale_is_used_and_one_that_is_not_positive_refused() {
    let of = |scale: &str| {
        format!("name = \"line\"\n[parameters]\np = {{ value = 0.0, scale = {scale} }}\n[states]\nx = \"p - x\"\n")
    };
    let study = "[[seed]]\nname = \"rest\"\nstate = { x = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"rest\"\nfree = \"p\"\n\
                 range = [0, 10]\n";
    let (fine, coarse) = (run(&of("0.1"), study), run(&of("10.0"), study));
    assert_eq!((fine.branches[0].units[1], coarse.branches[0].units[1]), (0.1, 10.0));
    assert!(fine.branches[0].points.len() > 5 * coarse.branches[0].points.len());
    let found = parse_study(&format!("model = \"m\"\n{study}"), "study", &of("-1.0"), "model").unwrap_err();
    assert!(format!("{found:?}").contains("the scale -1 is not positive"), "{found:?}");
}

const SCALES: [f64; 8] = [0.1, 0.2, 0.3, 0.45, 0.5, 0.55, 0.9, 2.0];

/// z² = mu (1 - mu) beside a rotating wave x + i y = exp(i t): pitchforks at 0 and 1. (The rotation that leaves the
/// equations invariant acts along the wave, so it makes no multiplier 1.)
#[test]
fn pitchforks_beside_a_rotating_wave_are_located_exactly() {
    for scale in SCALES {
        let model = format!(
            "name = \"arc\"\n[parameters]\nmu = {{ value = -0.5, scale = {scale} }}\n[states]\nz = \"mu*(1 - mu)*z - z^3\"\n\
             x = \"x - y - x*(x^2 + y^2)\"\ny = \"x + y - y*(x^2 + y^2)\"\n"
        );
        let found = run(
            &model,
            "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"mu\"\nrange = [-0.5, 1.5]\n",
        );
        let branch = &found.branches[0];
        let places: Vec<(Kind, f64, f64)> =
            branch.special.iter().map(|s| (s.kind, s.point.parameters[0], s.error * branch.size(1.0))).collect();
        let [(Kind::BranchPoint, zero, first), (Kind::BranchPoint, one, second)] = places[..] else {
            panic!("{scale}: {places:?}")
        };
        assert!(zero.abs() <= first && (one - 1.0).abs() <= second && first.max(second) < 1e-6, "{scale}: {places:?}");
    }
}

/// AUTO's demo tfc: the third state vanishes along the cycles, which grow from the Hopf point down to the bound.
#[test]
fn cycles_on_an_invariant_plane_do_not_end_where_they_are_born() {
    for scale in SCALES {
        let model = format!(
            "name = \"tfc\"\n[parameters]\na1 = 5.0\nb1 = 3.0\nd1 = {{ value = 1.1083, scale = {scale} }}\na2 = 0.1\nb2 = 2.0\nd2 = 0.01\n\
             [states]\nx = \"1 - exp(x) - a1*exp(y)/(1 + b1*exp(x))\"\n\
             y = \"a1*exp(x)/(1 + b1*exp(x)) - d1 - a2*z/(1 + b2*exp(y))\"\nz = \"z*(a2*exp(y)/(1 + b2*exp(y)) - d2)\"\n"
        );
        let found = run(
            &model,
            "[[seed]]\nname = \"s\"\nstate = { x = -0.413049, y = -1.59954, z = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n\
             free = \"d1\"\nrange = [0.3, 1.2]\nswitch = { hopf = 1 }\n",
        );
        let cycles = found.branch("b/hopf-1").unwrap();
        let codes: Vec<&str> = cycles.ends.iter().flatten().map(|end| end.code()).collect();
        assert_eq!(codes, ["joined", "bound"], "{scale}: {:?}", cycles.ends);
    }
}

/// The branch that crosses at 0.8219, and its cycles from 0.671594 on, are kept apart from the branch that they leave.
#[test]
fn a_crossing_branch_is_not_mistaken_for_the_one_it_leaves() {
    for scale in SCALES {
        let model = format!(
            "name = \"prey\"\n[parameters]\np = {{ value = 0.1, scale = {scale} }}\n[states]\n\
             u = \"3*u*(1 - u) - u*v - p*(1 - exp(-5*u))\"\nv = \"-v + 3*u*v\"\n"
        );
        let found = run(
            &model,
            "[[seed]]\nname = \"s\"\nstate = { u = 0, v = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [0.1, 1]\n\
             switch = { branch-point = 2, hopf = 1 }\n",
        );
        let hopf = found.branches.iter().flat_map(|branch| &branch.special).find(|s| s.kind == Kind::Hopf);
        let place = hopf.map(|hopf| hopf.point.parameters[0]);
        assert!(place.is_some_and(|place| (place - 0.671593847479).abs() < 1e-8), "{scale}: {place:?}");
    }
}

/// A plate attracted by a voltage across a gap (Kolchuzhin, LMGT MEMS component library, set 1), with `{x}` and `{v}`
/// the statements of the model about the sizes of its states. Pull-in at V = √(8 k h³ / (27 ε₀ A)), x = h/3.
fn plate(x: &str, v: &str) -> Diagram {
    let model = format!(
        "name = \"plate\"\n[parameters]\nm = 4.658e-7\nd = 2.245e-3\nk = 270.4\narea = 1e-6\ngap = 10e-6\neps0 = 8.8541878128e-12\nV = 0\n\
         [states]\nx = {{ equation = \"v\"{x} }}\nv = {{ equation = \"(eps0*area*V^2/(2*(gap - x)^2) - k*x - d*v)/m\"{v} }}\n"
    );
    run(
        &model,
        "[[seed]]\nname = \"rest\"\nstate = { x = 0, v = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"rest\"\nfree = \"V\"\nrange = [0, 150]\n",
    )
}

#[test]
fn a_displacement_in_metres_needs_no_scale() {
    let voltage = (8.0 * 270.4 * 1e-15 / (27.0 * 8.854_187_812_8e-18f64)).sqrt();
    let stated = plate(", scale = 1e-6", ", scale = 1e-2");
    let ranges = plate(", range = [-1e-6, 8e-6]", ", range = [-1e-3, 1e-3]");
    let met = plate("", "");
    for diagram in [&stated, &ranges, &met] {
        let branch = diagram.branch("b").unwrap();
        let [fold] = &branch.special[..] else {
            panic!("{:?}", branch.special.iter().map(|s| s.kind).collect::<Vec<_>>())
        };
        let value = fold.point.parameters[branch.free];
        assert!(fold.kind == Kind::Fold && (value - voltage).abs() < 1e-8 * voltage, "{value} {voltage}");
        assert!((fold.point.ranges[0][0] - 1e-5 / 3.0).abs() < 1e-12);
        // The numbers of points agree within a quarter, so no variant costs more.
        let counts = [branch.points.len(), stated.branch("b").unwrap().points.len()];
        assert!(4 * counts[0] < 5 * counts[1] && 4 * counts[1] < 5 * counts[0], "{counts:?}");
    }
}

/// Photons in a laser, n' = (g N - k) n, N' = p - N - 2 g N n, in given units of the numbers; threshold at p = k/g.
#[test]
fn a_laser_is_the_same_in_any_unit_of_the_photon_number() {
    let laser = |photons: f64, atoms: f64| {
        let model = format!(
            "name = \"laser\"\n[parameters]\np = {{ value = 0.0 }}\n[definitions]\nm = \"n/{photons:e}\"\nM = \"N/{atoms:e}\"\nq = \"p/{atoms:e}\"\n[states]\n\
             n = \"{photons:e}*(M - 1)*m\"\nN = \"{atoms:e}*(q - M - 2*M*m)\"\n"
        );
        let high = 3.0 * atoms;
        let study = format!(
            "[[seed]]\nname = \"dark\"\nstate = {{ n = 0, N = 0 }}\n[[branch]]\nname = \"b\"\nfrom = \"dark\"\nfree = \"p\"\n\
             range = [0, {high:e}]\nswitch = {{ branch-point = 1 }}\n"
        );
        run(&model, &study)
    };
    let one = laser(1.0, 1.0);
    assert_eq!(one.branches.len(), 2);
    for [photons, atoms] in [[1e18, 1e18], [1e18, 1e-6], [1e-9, 1e12]] {
        let other = laser(photons, atoms);
        assert_eq!(other.branches.len(), 2);
        for branch in &one.branches {
            let there = other.branch(&branch.name).unwrap();
            assert_eq!(there.points.len(), branch.points.len(), "{} {photons} {atoms}", branch.name);
            for (a, b) in branch.special.iter().zip(&there.special) {
                let (x, y) = (a.point.parameters[0], b.point.parameters[0] / atoms);
                assert!(a.kind == b.kind && (x - y).abs() < 2e-8 * (1.0 + x), "{x} {y}");
            }
        }
    }
}

/// Branches from a three-dimensional kernel do not depend on the sizes of the states.
#[test]
fn branches_from_one_point_are_distinguished_at_any_scale() {
    for scales in [[1.0, 1.0, 1.0], [3.0, 3.0, 3.0], [0.7, 1.0, 1.5]] {
        let equation =
            |name: &str, scale: f64| format!("{name} = {{ equation = \"p*{name} - {name}^3\", scale = {scale} }}\n");
        let states: String = ["x", "y", "z"].iter().zip(scales).map(|(name, scale)| equation(name, scale)).collect();
        let diagram = run(
            &format!("name = \"wells\"\n[parameters]\np = -1\n[states]\n{states}"),
            "[[seed]]\nname = \"s\"\nstate = { x = 0, y = 0, z = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [-1, 2]\n\
             switch = { branch-point = 1 }\n",
        );
        let moved = |branch: &Branch| {
            branch.points.last().unwrap().ranges.iter().map(|r| r[0].abs() > 0.1).collect::<Vec<bool>>()
        };
        let found: std::collections::BTreeSet<Vec<bool>> =
            diagram.branches.iter().filter(|branch| branch.name != "b").map(moved).collect();
        assert_eq!(found.len(), 7, "{scales:?}: {found:?}");
    }
}
