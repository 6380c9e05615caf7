//! zeta = 1e-5: multipliers crowd near the unit circle, other branches pass close by, and cycles pass equilibria
//! closely.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind};
use foldline::explore::{System, run};
use foldline_store::study_file::parse_study;

fn explored(rest: &str) -> Diagram {
    let model = include_str!("../../../models/overhung-rotor.toml");
    let seed = "model = \"m\"\n[[seed]]\nname = \"SL\"\nattractor = \"2:1\"\nparameters = { Omega = 5, kappa = 0 }\n\
                [[seed]]\nname = \"DL\"\nattractor = \"3:1\"\nparameters = { Omega = 5, kappa = 0 }\n";
    let study = parse_study(&format!("{seed}{rest}"), "study", model, "model").unwrap_or_else(|f| panic!("{}", f[0]));
    run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved)
}

fn special(branch: &Branch) -> Vec<(Kind, f64, f64)> {
    let mut all: Vec<(Kind, f64, f64)> = branch
        .special
        .iter()
        .map(|s| (s.kind, s.point.parameters[0], s.error * branch.size(s.point.parameters[0])))
        .collect();
    all.sort_by(|a, b| (a.0, a.1).partial_cmp(&(b.0, b.1)).unwrap());
    all
}

#[test]
fn a_branch_of_cycles_continues_past_a_near_equilibrium() {
    let diagram = explored(
        "[[branch]]\nname = \"z\"\nfrom = \"SL\"\nfree = \"zeta\"\nuntil = 1e-5\n\
         [[branch]]\nname = \"b\"\nfrom = \"z\"\nfree = \"Omega\"\nrange = [0.5, 12]\n",
    );
    let branch = diagram.branch("b").unwrap();
    // S keeps its stability there, so there is no Hopf point to end at.
    assert_eq!(branch.ends, [Some(Ending::Bound(12.0)), Some(Ending::Bound(12.0))]);
    assert_eq!(branch.special.iter().map(|s| s.kind).collect::<Vec<_>>(), [Kind::Fold]);
    let smallest = branch.points.iter().map(|p| p.ranges[4][1] - p.ranges[4][0]).fold(f64::INFINITY, f64::min);
    assert!(smallest < 0.05, "{smallest}");
}

#[test]
fn a_branch_with_close_neighbours_is_the_same_from_any_start() {
    let diagram = explored(
        "[[homotopy]]\nname = \"h\"\nfrom = \"DL\"\nto = { kappa = 1, zeta = 1e-5 }\nvia = \"Omega\"\nrange = [0.5, 12]\n\
         [[branch]]\nname = \"b\"\nfrom = \"h\"\nfree = \"Omega\"\nrange = [0.5, 12]\n\
         [[branch]]\nname = \"aside\"\nfrom = \"h\"\nfree = \"Omega\"\nrange = [3, 5]\nuntil = 3.3\n\
         [[branch]]\nname = \"c\"\nfrom = \"aside\"\nfree = \"Omega\"\nrange = [0.5, 12]\n",
    );
    let [b, c] = ["b", "c"].map(|name| diagram.branch(name).unwrap());
    for branch in [b, c] {
        assert!(branch.ends.iter().all(|end| *end == Some(Ending::Closed)), "{:?}", branch.ends);
    }
    let (one, other) = (special(b), special(c));
    assert_eq!(one.len(), 4, "{one:?}");
    assert_eq!(other.len(), 4, "{other:?}");
    for (p, q) in one.iter().zip(&other) {
        assert!(p.0 == q.0 && (p.1 - q.1).abs() < p.2 + q.2, "{p:?} {q:?}");
    }
}

/// Values from another route (through the folds in epsilon and zeta at lower speeds) and at other tolerances, to the
/// digits given.
#[test]
fn a_large_unbalance_leaves_two_folds_on_one_step_and_torus_points_next_to_folds() {
    let model = include_str!("../../../models/overhung-rotor.toml");
    let text = include_str!("../../foldline-reproduce/studies/akay2022/light-damping-large-unbalance-contact.toml");
    let study = parse_study(text, "study", model, "model").unwrap_or_else(|f| panic!("{}", f[0]));
    let diagram = run(&System::of_plan(&study.model, &study.plan), &study.plan, 2, Diagram::default(), &Unobserved);
    let is = |name: &str, expected: &[(Kind, f64)]| {
        let branch = diagram.branch(name).unwrap();
        assert!(branch.ends.iter().all(|end| *end == Some(Ending::Closed)), "{:?}", branch.ends);
        let found = special(branch);
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for (found, expected) in found.iter().zip(expected) {
            assert!(found.0 == expected.0 && (found.1 - expected.1).abs() < 1e-7 + found.2, "{found:?} {expected:?}");
        }
    };
    // Another branch passes so close at 9.4354 that rounding of 1e-15 is magnified by 1e7, which finer meshes cannot
    // improve.
    let beside =
        diagram.branch("contact SL").unwrap().points.iter().filter(|p| (p.parameters[0] - 9.4354).abs() < 1e-4);
    let meshes: Vec<usize> = beside.map(|point| point.solution.mesh().len()).collect();
    assert!(meshes.len() > 10 && meshes.iter().all(|count| *count < 400), "{meshes:?}");
    // On the way there, a third multiplier is 1 at these values; near them, errors of 5e-9 split a double multiplier by
    // 1e-4.
    let meetings = diagram.branch("contact DL to 1.5/2").unwrap().special.iter();
    let mut meetings: Vec<f64> =
        meetings.filter(|s| s.kind == Kind::Resonance11).map(|s| s.point.parameters[0]).collect();
    meetings.sort_by(f64::total_cmp);
    let expected = [4.7839763, 5.0908154, 5.5123790, 5.7533501, 5.7806451, 6.0080574];
    assert!(
        meetings.len() == expected.len() && meetings.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6),
        "{meetings:?}"
    );
    let [fold, torus] = [Kind::Fold, Kind::Torus];
    is("contact SL", &[(fold, 8.5904468), (fold, 9.6380474), (fold, 9.6448438), (fold, 11.0037953)]);
    is(
        "contact DL",
        &[
            (fold, 5.9987289),
            (fold, 6.2787697),
            (fold, 6.3352986),
            (fold, 7.1908811),
            (torus, 5.9987551),
            (torus, 6.2790433),
            (torus, 6.3352956),
        ],
    );
}
