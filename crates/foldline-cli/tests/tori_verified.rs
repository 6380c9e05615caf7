//! `verify` on tori, unmodified and with numbers changed. The expected number of errors, none, is that of a correct program; the numbers of
//! the tori themselves are compared with references in `tori`.

use crate::tori::of;
use foldline::diagram::{Diagram, Kind, Solution, Torus};
use foldline::explore::System;
use foldline::verify::{Quantity, Verified, verify};
use foldline_store::study_file::Study;

fn verified(study: &Study, diagram: &Diagram, branch: &str, sample: usize) -> Verified {
    let system = System::of_plan(&study.model, &study.plan);
    verify(&system, diagram, study.plan.tolerance, Some(sample), &|own| own.name == branch)
}

#[track_caller]
fn passes(found: &Verified) {
    for check in &found.checks {
        eprintln!(
            "{} {:?} {:?} at {}: {:e} stated {:?}",
            check.position, check.special, check.quantity, check.parameter, check.found, check.stated
        );
    }
    eprintln!("{:?}", found.undecided);
    assert_eq!(found.wrong().count(), 0, "{:?}", found.wrong().collect::<Vec<_>>());
}

const VAN_DER_POL: &str = "tolerance = 1e-6\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nparameters = { s = 1, Omega = 1.2 }\n\
     samples = 16\n[[branch]]\nname = \"c\"\nfrom = \"s\"\nfree = \"s\"\nrange = [0.25, 1.2]\nswitch = { torus = 1 }\n";

#[test]
fn tori_of_a_forced_oscillator_are_verified_and_changes_to_them_are_detected() {
    let (study, right) = of("van-der-pol-forced", VAN_DER_POL);
    let all = verified(&study, &right, "c/torus-1", 6);
    passes(&all);
    assert!(all.points >= 5, "{} {:?}", all.points, all.undecided);
    let of = |quantity: Quantity| all.checks.iter().filter(|check| check.quantity == quantity).count();
    // Over one period and by a long trajectory.
    assert_eq!(of(Quantity::Rotation), 2 * all.points);
    assert_eq!([of(Quantity::Distance), of(Quantity::Profile), of(Quantity::Range)], [all.points; 3]);

    let at = right.branches.iter().position(|branch| branch.name == "c/torus-1").unwrap();
    let middle = right.branches[at].points.len() / 2;
    let worst = |change: &dyn Fn(&mut Diagram)| {
        let mut diagram = right.clone();
        change(&mut diagram);
        // A point alone is not the end at which the branch joined another one.
        diagram.branches[at].points = vec![diagram.branches[at].points[middle].clone()];
        diagram.branches[at].ends = [None, None];
        let found = verified(&study, &diagram, "c/torus-1", 1);
        assert_eq!(found.points, 1, "{:?}", found.undecided);
        found.wrong().map(|check| check.quantity).collect::<Vec<Quantity>>()
    };
    let torus = |diagram: &mut Diagram, change: &dyn Fn(&mut Torus)| {
        if let Solution::Torus(torus) = &mut diagram.branches[at].points[middle].solution {
            change(torus);
        }
    };
    assert!(worst(&|_| ()).is_empty());
    assert!(worst(&|d| torus(d, &|t| t.rotation += 1e-4)).contains(&Quantity::Rotation));
    assert!(
        worst(&|d| torus(d, &|t| t.profile.iter_mut().skip(40).take(1).for_each(|x| *x += 1e-2)))
            .contains(&Quantity::Profile)
    );
    assert!(worst(&|d| d.branches[at].points[middle].ranges[0][1] += 1e-3).contains(&Quantity::Range));
    assert!(worst(&|d| d.branches[at].points[middle].spectrum[1] += 1e-2).contains(&Quantity::Spectrum));
}

#[test]
fn an_autonomous_torus_is_verified_with_both_of_its_frequencies() {
    let (study, diagram) = of(
        "langford",
        "tolerance = 1e-6\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nparameters = { rho = 0.7 }\nsamples = 8\n\
         [[branch]]\nname = \"c\"\nfrom = \"s\"\nfree = \"rho\"\nrange = [0.48, 0.8]\nswitch = { torus = 1 }\n",
    );
    let found = verified(&study, &diagram, "c/torus-1", 4);
    passes(&found);
    let of = |quantity: Quantity| found.checks.iter().filter(|check| check.quantity == quantity).count();
    assert!(found.points >= 3 && of(Quantity::Period) == found.points && of(Quantity::Distance) == found.points);
}

#[test]
fn a_fold_of_tori_is_located_again_and_unstable_tori_beyond_it_are_recomputed() {
    let (study, diagram) = of(
        "overhung-rotor-gravity",
        "tolerance = 1e-6\n[[seed]]\nname = \"s\"\nattractor = \"2:1\"\ntorus = true\nparameters = { Omega = 5, G = 0 }\n\
         [[branch]]\nname = \"g\"\nfrom = \"s\"\nfree = \"G\"\nuntil = 0.05\n\
         [[branch]]\nname = \"t\"\nfrom = \"g\"\nfree = \"Omega\"\nrange = [2.5, 6]\n",
    );
    let branch = diagram.branch("t").unwrap();
    eprintln!(
        "{:?} {:?}",
        branch.special.iter().map(|s| (s.kind, s.point.parameters.clone())).collect::<Vec<_>>(),
        branch.ends
    );
    let folds = branch.special.iter().filter(|special| special.kind == Kind::Fold).count();
    let found = verified(&study, &diagram, "t", 4);
    passes(&found);
    assert!(folds >= 1 && found.special >= folds, "{folds} {:?}", found.undecided);
}
