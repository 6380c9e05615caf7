//! zeta = 1e-5: multipliers crowd the unit circle, other branches pass close by, and cycles pass equilibria closely.

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
        .map(|s| (s.kind, s.point.parameters[0], s.error * (1.0 + s.point.parameters[0])))
        .collect();
    all.sort_by(|a, b| (a.0, a.1).partial_cmp(&(b.0, b.1)).unwrap());
    all
}

#[test]
fn a_cycle_that_passes_an_equilibrium_closely_goes_on() {
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
fn a_branch_with_close_neighbours_is_the_same_wherever_it_is_begun() {
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
