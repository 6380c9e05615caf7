//! Normal form coefficients in whole runs, against published numbers and against neighbouring solutions.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Kind, SpecialPoint};
use foldline::explore::{System, run};
use foldline_store::study_file::parse_study;

fn grown(model: &str, rest: &str) -> Diagram {
    let study = parse_study(&format!("model = \"m\"\n{rest}"), "study", model, "model")
        .unwrap_or_else(|found| panic!("{}", found[0]));
    run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved)
}

fn of_kind(branch: &Branch, kind: Kind) -> Vec<&SpecialPoint> {
    branch.special.iter().filter(|special| special.kind == kind).collect()
}

fn omega(special: &SpecialPoint) -> f64 {
    special.point.spectrum[0].im.abs()
}

fn close(own: f64, known: f64, relative: f64) {
    assert!((own - known).abs() < relative * known.abs(), "{own} {known}");
}

/// Numbers from the tests of this model in BifurcationKit, to four digits: l₂ without the factor 1/ω.
#[test]
fn co_oxidation_has_the_published_coefficients() {
    let model = include_str!("../../../models/co-oxidation.toml");
    let seed = "[[seed]]\nname = \"s\"\nattractor = \"equilibrium\"\nparameters = { q2 = 0.9 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"q2\"\nrange = [0.5, 3]\n";
    let curve = |name: &str, near: f64| {
        format!(
            "[[curve]]\nname = \"{name}\"\nhold = \"{name}\"\nof = \"b\"\nnear = {near}\nfree = \"k\"\nrange = [0, 2]\n"
        )
    };
    let diagram = grown(model, &format!("{seed}{}{}", curve("fold", 1.05), curve("hopf", 1.04)));
    let (folds, hopf) = (diagram.branch("fold").unwrap(), diagram.branch("hopf").unwrap());
    let [cusp] = of_kind(folds, Kind::Cusp)[..] else { panic!("one cusp") };
    close(cusp.coefficients[0], 0.362, 1e-2);
    let takens = of_kind(folds, Kind::BogdanovTakens);
    let upper = takens.iter().max_by(|a, b| a.point.parameters[6].total_cmp(&b.point.parameters[6])).unwrap();
    close(upper.coefficients[0].abs(), 0.083784, 1e-4);
    close(upper.coefficients[1].abs(), 2.1363, 1e-4);
    let generalised = of_kind(hopf, Kind::GeneralisedHopf);
    assert_eq!(generalised.len(), 2);
    let lower = generalised.iter().min_by(|a, b| a.point.parameters[6].total_cmp(&b.point.parameters[6])).unwrap();
    close(lower.coefficients[0] * omega(lower), -9322.74711 / 12.0, 1e-4);
}

/// Lorenz's model of 1984 with an additional wave, also from BifurcationKit. No numbers are published for zero-Hopf and
/// double Hopf points; they agree on the two curves that meet there, each of which treats one eigenvalue or pair
/// exactly and computes the other.
#[test]
fn the_extended_model_of_lorenz_has_the_published_coefficients() {
    let model = "[parameters]\nF = 3\nT = 0.04\n[states]\nX = \"-Y^2 - Z^2 - 0.25*X + 0.25*F - 0.987*U^2\"\nY = \"X*Y - X*Z - Y + 0.25\"\nZ = \"X*Y + X*Z - Z\"\nU = \"-1.04*U + 0.987*U*X + T\"\n";
    let study = "[[seed]]\nname = \"s\"\nstate = { X = 2.9787, Y = -0.03868, Z = 0.05823, U = -0.02105 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"F\"\nrange = [-1.5, 3.2]\n[[curve]]\nname = \"hopf\"\nhold = \"hopf\"\nof = \"b\"\nnear = 2.46723\nfree = \"T\"\nrange = [-0.1, 0.1]\n[[curve]]\nname = \"second\"\nhold = \"hopf\"\nof = \"b\"\nnear = 2.86\nfree = \"T\"\nrange = [-0.1, 0.1]\n[[curve]]\nname = \"fold\"\nhold = \"fold\"\nof = \"b\"\nnear = 1.5466\nfree = \"T\"\nrange = [-0.1, 0.1]\n";
    let diagram = grown(model, study);
    let hopf = diagram.branch("hopf").unwrap();
    let fitting = |s: &&SpecialPoint| (omega(s) - 0.69036).abs() < 1e-3;
    let generalised = of_kind(hopf, Kind::GeneralisedHopf).into_iter().find(fitting).unwrap();
    assert!((generalised.coefficients[0] * omega(generalised) - 1.8694569 / 12.0).abs() < 1e-3);
    let folds = diagram.branch("fold").unwrap();
    let found = of_kind(folds, Kind::BogdanovTakens);
    let takens = found.iter().map(|s| (s.coefficients[0].abs(), s.coefficients[1].abs()));
    assert!(takens.into_iter().any(|(a, b)| (a - 0.21442).abs() < 1e-4 && (b - 0.60651).abs() < 1e-4));
    // The model is symmetric under sign changes of U and T, and so are its zero-Hopf points.
    let second = diagram.branch("second").unwrap();
    let zero = [of_kind(folds, Kind::ZeroHopf), of_kind(second, Kind::ZeroHopf)].concat();
    let double = [of_kind(hopf, Kind::DoubleHopf), of_kind(second, Kind::DoubleHopf)].concat();
    for (alike, count, coefficients) in [(zero, 4, 3), (double, 3, 6)] {
        assert_eq!(alike.len(), count);
        assert_eq!(alike[0].coefficients.len(), coefficients);
        for other in &alike[1..] {
            alike[0].coefficients.iter().zip(&other.coefficients).for_each(|(a, b)| close(*a, *b, 1e-5));
        }
    }
}

/// Cycles near a generalised Hopf point turn back where l₁² = 4 l₂ growth / ω, to leading order: the coefficient of the
/// fold against that of the equilibrium, for a system whose l₂ comes from quadratic and cubic terms alone.
#[test]
fn cycles_turn_back_as_the_second_lyapunov_coefficient_predicts() {
    let model = |q: f64| {
        format!(
            "[parameters]\np = -0.1\nq = {q:?}\n[states]\nu = \"p*u - v + 0.7*u*v + 0.4*u^2 + q*u*(u^2 + v^2)\"\nv = \"u + p*v - 0.5*u^2 + 0.3*v^2\"\n"
        )
    };
    let branch = "[[seed]]\nname = \"s\"\nstate = { u = 0, v = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p\"\nrange = [-0.2, 0.2]\n";
    let curve = "[[curve]]\nname = \"c\"\nhold = \"hopf\"\nof = \"b\"\nfree = \"q\"\nrange = [-1, 1]\n";
    let points = grown(&model(0.0), &format!("{branch}{curve}"));
    let [generalised] = of_kind(points.branch("c").unwrap(), Kind::GeneralisedHopf)[..] else { panic!("one point") };
    let (at, second) = (generalised.point.parameters[1], generalised.coefficients[0]);
    // Cycles turn back only if l₁ and l₂ have opposite signs.
    let ratio = |distance: f64| {
        let diagram = grown(&model(at - second.signum() * distance), &format!("{branch}switch = {{ hopf = 1 }}\n"));
        let [hopf] = of_kind(diagram.branch("b").unwrap(), Kind::Hopf)[..] else { panic!("one Hopf point") };
        let fold = of_kind(diagram.branch("b/hopf-1").unwrap(), Kind::Fold)[0];
        let first = hopf.coefficients[0];
        assert!(first * second < 0.0 && omega(hopf) - 1.0 < 1e-9);
        // The growth rate is p.
        fold.point.parameters[0] / (first * first / (4.0 * second))
    };
    // Terms of higher order contribute in proportion to the distance.
    let (far, near) = (ratio(0.02), ratio(0.01));
    assert!((near - 1.0).abs() < 0.6 * (far - 1.0).abs() && (near - 1.0).abs() < 0.1, "{far} {near}");
    assert!((2.0 * near - far - 1.0).abs() < 0.05 * (near - 1.0).abs() + 1e-3, "{far} {near}");
}

/// On the centre manifold of the rest state, z = xy/b to leading order: b = σ/(1 + σ), c = -σ/(2 b (1 + σ)).
#[test]
fn convection_begins_at_a_supercritical_pitchfork() {
    let model = include_str!("../../../models/lorenz.toml");
    let branch = "[[seed]]\nname = \"s\"\nstate = { x = 0, y = 0, z = 0 }\nparameters = { rho = 0.5 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"rho\"\nrange = [0.5, 2]\n";
    let diagram = grown(model, branch);
    let [point] = of_kind(diagram.branch("b").unwrap(), Kind::BranchPoint)[..] else { panic!("one branch point") };
    let [a, b, c] = point.coefficients[..] else { panic!("a pitchfork: {}", point.normal_form()) };
    assert!(a == 0.0 && (b - 10.0 / 11.0).abs() < 1e-8 && (c + 10.0 / (2.0 * 8.0 / 3.0 * 11.0)).abs() < 1e-8);
    assert!(point.normal_form().ends_with("pitchfork, supercritical"), "{}", point.normal_form());
}

/// u' = u (3 (1 - u) - v) - p (1 - e^{-5u}) at u = v = 0: the eigenvalue is 3 - 5 p, and the quadratic coefficient ½
/// (25 p - 6).
#[test]
fn prey_appear_at_a_transcritical_point() {
    let model = include_str!("../../../models/predator-prey.toml");
    let branch = "[[seed]]\nname = \"s\"\nstate = { u = 0, v = 0 }\nparameters = { p1 = 0.1 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"p1\"\nrange = [0.1, 0.7]\nswitch = { branch-point = 1 }\n";
    let diagram = grown(model, branch);
    let [point] = of_kind(diagram.branch("b").unwrap(), Kind::BranchPoint)[..] else { panic!("one branch point") };
    let [a, b] = point.coefficients[..] else { panic!("transcritical: {}", point.normal_form()) };
    assert!((a.abs() - 4.5).abs() < 1e-7 && (b + 5.0).abs() < 1e-7, "{}", point.normal_form());
    assert!(point.normal_form().ends_with("transcritical") && point.criticality().is_none());
    // Along the other branch the eigenvalue passes 0 in the opposite direction.
    let [same] = of_kind(diagram.branch("b/branch-point-1").unwrap(), Kind::BranchPoint)[..] else {
        panic!("the same")
    };
    assert!((same.coefficients[1] - 5.0).abs() < 1e-6, "{}", same.normal_form());
}
