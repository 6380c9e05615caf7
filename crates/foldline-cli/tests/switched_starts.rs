//! Switching at special points: all branches that leave them, and computations that start at the ends of those.

use foldline::contract::Unobserved;
use foldline::diagram::{Diagram, Ending, Family, Kind, Origin};
use foldline::explore::{System, run};
use foldline_store::study_file::parse_study;

const MODEL: &str = include_str!("../../../models/brusselator.toml");
const STUDY: &str = "model = \"m\"\n[[seed]]\nname = \"s\"\nstate = { x = 1, y = 1 }\nparameters = { A = 1, B = 1 }\n\
    [[branch]]\nname = \"steady\"\nfrom = \"s\"\nfree = \"B\"\nrange = [0.5, 3]\nswitch = { hopf = 1 }\n";

#[test]
fn cycles_born_at_a_hopf_point_are_continued_in_another_parameter() {
    let text =
        format!("{STUDY}[[branch]]\nname = \"in A\"\nfrom = \"steady/hopf-1\"\nfree = \"A\"\nrange = [0.8, 2]\n");
    let study = parse_study(&text, "study", MODEL, "model").unwrap_or_else(|found| panic!("{}", found[0]));
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    let branch = diagram.branch("in A").unwrap();
    assert_eq!((branch.family, &branch.origin), (Family::Cycle, &Origin::EndOf("steady/hopf-1".into())));
    let start = branch.points.iter().find(|p| p.position == 0).unwrap();
    let [a, b] = ["A", "B"].map(|name| start.parameters[study.model.parameter_index(name).unwrap()]);
    assert!((a - 1.0).abs() < 1e-9 && (b - 3.0).abs() < 1e-9, "{a} {b}");
    // Closed form: the Hopf point is at B = 1 + A².
    let joined = branch.ends.iter().flatten().find_map(|end| match end {
        Ending::Joined { parameter, .. } => Some(*parameter),
        _ => None,
    });
    assert!((joined.unwrap() - 2f64.sqrt()).abs() < 1e-6, "{:?}", branch.ends);
}

#[test]
fn branches_not_switched_to_cannot_be_starts() {
    let text =
        |from: &str| format!("{STUDY}[[branch]]\nname = \"b\"\nfrom = \"{from}\"\nfree = \"A\"\nrange = [0.8, 2]\n");
    for (from, message) in [
        ("steady/period-doubling-1", "does not go that far at period-doubling points"),
        ("steady/first", "no branch that leaves"),
        ("other/hopf-1", "there is no seed, branch, curve or homotopy"),
    ] {
        let found = parse_study(&text(from), "study", MODEL, "model").unwrap_err();
        assert!(found.len() == 1 && found[0].message.contains(message), "{from}: {found:?}");
    }
}

fn followed(model: &str, states: &str, kind: &str) -> Diagram {
    let text = format!(
        "model = \"m\"\n[[seed]]\nname = \"s\"\nstate = {states}\n[[branch]]\nname = \"steady\"\nfrom = \"s\"\nfree = \"p\"\n\
         range = [-1, 2]\nswitch = {{ {kind} = 1 }}\n"
    );
    let study = parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{}", found[0]));
    run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved)
}

/// Three uncoupled pitchforks: at p = 0 a three-dimensional kernel. With rp = √p the equilibria are (±rp or 0, ±rp or
/// 0, ±rp or 0), of which seven are not images of each other.
#[test]
fn all_branches_leave_a_kernel_of_three_dimensions() {
    let model =
        "name = \"wells\"\n[parameters]\np = -1\n[states]\nx = \"p*x - x^3\"\ny = \"p*y - y^3\"\nz = \"p*z - z^3\"\n";
    let diagram = followed(model, "{ x = 0, y = 0, z = 0 }", "branch-point");
    let special = &diagram.branch("steady").unwrap().special;
    assert!(special.len() == 1 && special[0].kind == Kind::BranchPoint && special[0].kernel() == 3);
    assert!(special[0].coefficients.is_empty() && special[0].remark.contains("dimension 3"), "{}", special[0].remark);
    let mut found = std::collections::BTreeSet::new();
    for branch in diagram.branches.iter().filter(|branch| branch.name != "steady") {
        let foldline::diagram::Solution::Equilibrium(x) = &branch.points.last().unwrap().solution else { panic!() };
        let root = branch.points.last().unwrap().parameters[0].sqrt();
        assert!(x.iter().all(|x| x.abs() < 1e-8 || (x.abs() - root).abs() < 1e-8), "{x:?}");
        found.insert(x.iter().map(|x| x.abs() > 0.1).collect::<Vec<bool>>());
        assert_eq!(branch.points.last().unwrap().unstable, x.iter().filter(|x| x.abs() < 1e-8).count());
    }
    assert_eq!(found.len(), 7, "{found:?}");
}

/// The symmetry of a triangle: x' = px + 0.3 z̄² - z|z|² has three lines of equilibria with z = r e^{2πik/3},
/// p + 0.3 r - r² = 0, each with a fold at p = -0.0225.
#[test]
fn three_branches_cross_by_the_symmetry_of_a_triangle() {
    let model = "name = \"triangle\"\n[parameters]\np = -1\n[states]\nx = \"p*x - x*(x^2 + y^2) + 0.3*x^2 - 0.3*y^2\"\n\
        y = \"p*y - y*(x^2 + y^2) - 0.6*x*y\"\n";
    let diagram = followed(model, "{ x = 0, y = 0 }", "branch-point");
    let folds = diagram.branches.iter().flat_map(|branch| &branch.special).filter(|s| s.kind == Kind::Fold);
    let mut angles: Vec<f64> = folds
        .map(|fold| {
            assert!((fold.point.parameters[0] + 0.0225).abs() < 1e-8);
            let foldline::diagram::Solution::Equilibrium(x) = &fold.point.solution else { panic!() };
            x[1].atan2(x[0]).to_degrees().round().rem_euclid(360.0)
        })
        .collect();
    angles.sort_by(f64::total_cmp);
    // Two of them are mirror images, one of which may be left out as known.
    assert!(angles == [0.0, 120.0] || angles == [0.0, 240.0] || angles == [0.0, 120.0, 240.0], "{angles:?}");
}

/// Two pairs of eigenvalues cross the imaginary axis together: cycles of both frequencies are born, and their
/// coefficients are those of each oscillator by itself, -2/ω.
#[test]
fn cycles_of_both_frequencies_leave_coinciding_hopf_points() {
    let model = "name = \"pairs\"\n[parameters]\np = -1\n[states]\na = \"p*a - b - a*(a^2 + b^2) - 0.3*a*(c^2 + d^2)\"\n\
        b = \"a + p*b - b*(a^2 + b^2) - 0.3*b*(c^2 + d^2)\"\nc = \"p*c - 1.7*d - c*(c^2 + d^2) - 0.5*c*(a^2 + b^2)\"\n\
        d = \"1.7*c + p*d - d*(c^2 + d^2) - 0.5*d*(a^2 + b^2)\"\n";
    let diagram = followed(model, "{ a = 0, b = 0, c = 0, d = 0 }", "hopf");
    let steady = diagram.branch("steady").unwrap();
    for (number, special) in steady.special.iter().enumerate() {
        let branch = diagram.branch(&format!("steady/hopf-{}", number + 1)).unwrap();
        let omega = std::f64::consts::TAU / branch.points.last().unwrap().solution.period().unwrap();
        assert!((special.coefficients[0] + 2.0 / omega).abs() < 1e-9, "{omega} {:?}", special.coefficients);
        assert!([1.0, 1.7].iter().any(|own| (own - omega).abs() < 1e-8), "{omega}");
    }
    assert_eq!(steady.special.len(), 2);
    let periods: Vec<f64> = diagram.branches[1..].iter().map(|b| b.points[0].solution.period().unwrap()).collect();
    assert!((periods[0] - periods[1]).abs() > 1.0, "{periods:?}");
}
