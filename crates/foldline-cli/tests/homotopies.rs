//! Solution families carried to other parameter values: directly, along a fold curve, and not at all.

use foldline::contract::{Event, Observer, Verdict};
use foldline::diagram::{Diagram, Kind};
use foldline::explore::{HomotopyPlan, Start, System, run};
use foldline_store::study_file::parse_study;
use std::sync::Mutex;

#[derive(Default)]
struct Notes(Mutex<Vec<String>>);

impl Observer for Notes {
    fn observe(&self, event: Event) -> Verdict {
        if let Event::Note("route", text) | Event::Short("route", text) = event {
            self.0.lock().unwrap().push(text.to_string());
        }
        Verdict::Continue
    }
}

/// The runs of a homotopy from the cubic rotor at Omega = 5, and the notes about them.
fn route(attractor: &str, targets: &[(&str, f64)]) -> (Diagram, Vec<String>) {
    let model = include_str!("../../../models/overhung-rotor.toml");
    let seed = format!(
        "model = \"m\"\n[[seed]]\nname = \"s\"\nattractor = \"{attractor}\"\nparameters = {{ Omega = 5, kappa = 0 }}\n"
    );
    let branch = "[[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [4.9, 5.1]\n";
    let mut study =
        parse_study(&(seed + branch), "study", model, "model").unwrap_or_else(|found| panic!("{}", found[0]));
    study.plan.branches.clear();
    study.plan.homotopies.push(HomotopyPlan {
        name: "route".into(),
        start: Start::Seed(0),
        targets: targets.iter().map(|(name, value)| (study.model.parameter_index(name).unwrap(), *value)).collect(),
        via: 0,
        range: [0.5, 12.0],
        max_points: 500,
    });
    let notes = Notes::default();
    let diagram = run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &notes);
    (diagram, notes.0.into_inner().unwrap())
}

#[test]
fn both_cycles_reach_contact_directly() {
    for (attractor, period) in [("2:1", 1.0), ("3:1", 1.0)] {
        let (diagram, notes) = route(attractor, &[("kappa", 1.0), ("zeta", 1e-5)]);
        assert_eq!(diagram.branches.len(), 1, "{notes:?}");
        let last = diagram.branches[0].points.last().unwrap();
        assert_eq!(last.parameters[1], 1.0);
        assert!((last.parameters[2] - 1e-5).abs() < 1e-15);
        // The parameters have changed in proportion.
        for point in &diagram.branches[0].points {
            assert!((point.parameters[2] - (0.01 - 0.00999 * point.parameters[1])).abs() < 1e-12);
        }
        assert!(last.solution.period().unwrap() > period && notes.last().unwrap().contains("direct run"));
    }
}

#[test]
fn the_fold_curve_is_used_where_the_direct_run_turns_back() {
    let (diagram, notes) = route("2:1", &[("zeta", 1e-5), ("epsilon", 1.5)]);
    // At Omega = 5 the family folds short of 1.5.
    let fold = diagram.branches[0].special.iter().find(|s| s.kind == Kind::Fold).unwrap();
    assert!((fold.point.parameters[3] - 1.465).abs() < 2e-3, "{}", fold.point.parameters[3]);
    assert!(notes.last().unwrap().starts_with("reached the goal along the fold curve"), "{notes:?}");
    let (curve, end) = (&diagram.branches[1], diagram.branches[1].points.first().unwrap());
    assert_eq!(curve.held, Some((Kind::Fold, 0)));
    assert!((end.parameters[2] - 1e-5).abs() < 1e-15 && (end.parameters[3] - 1.5).abs() < 1e-12);
    assert!(end.parameters[0] > 5.0 && end.parameters[0] < 5.2);
}

#[test]
fn a_family_that_shrinks_to_a_point_on_the_way_is_reported_as_not_connected() {
    let (diagram, notes) = route("3:1", &[("zeta", 0.3)]);
    assert!(notes.last().unwrap().ends_with("it is not connected to the goal"), "{notes:?}");
    // The isola shrinks to a point at the same damping whichever fold is followed.
    let tips: Vec<f64> = diagram
        .branches
        .iter()
        .filter(|b| b.held.is_some())
        .flat_map(|b| b.special.iter().map(|s| s.point.parameters[2]))
        .collect();
    assert!(tips.len() >= 3, "{tips:?}");
    assert!(tips.iter().all(|tip| (tip - tips[0]).abs() < 1e-7), "{tips:?}");
}
