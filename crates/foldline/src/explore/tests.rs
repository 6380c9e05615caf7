//! What stays in memory.

use super::{BranchPlan, Plan, SeedPlan, SeedSource, Start, Switching, System, run};
use crate::contract::{Event, Observer, Verdict};
use crate::diagram::{Branch, Diagram, Point};
use crate::model::{Definition, Model, ModelSource, Parameter, State};
use std::sync::Mutex;

/// Remembers the points; says that it keeps them, or not.
struct Archive {
    keeps: bool,
    points: Mutex<Vec<Point>>,
}

impl Observer for Archive {
    fn observe(&self, event: Event) -> Verdict {
        if let Event::Point(_, point) = event {
            self.points.lock().unwrap().push(point.clone());
        }
        Verdict::Continue
    }

    fn stores(&self) -> bool {
        self.keeps
    }
}

/// Equilibria of x' = p - x³ - x from p = 1 to both sides.
fn followed(keeps: bool) -> (Branch, Vec<Point>) {
    let model = Model::compile(ModelSource {
        name: "spring".into(),
        parameters: vec![Parameter::new("p", 1.0)],
        states: vec![State::new("x")],
        equations: vec![Definition::new("x", "p - x^3 - x")],
        ..ModelSource::default()
    })
    .unwrap();
    let source = SeedSource::State(vec![0.68]);
    let seed = SeedPlan { name: "at 1".into(), source, parameters: vec![1.0], samples: 1, random: 1 };
    let branch = BranchPlan {
        name: "rest".into(),
        start: Start::Seed(0),
        free: 0,
        range: [-4.0, 8.0],
        until: None,
        switching: Switching::default(),
        marks: Vec::new(),
        max_points: 1000,
    };
    let plan = Plan {
        tolerance: 1e-6,
        degree: 4,
        seeds: vec![seed],
        branches: vec![branch],
        curves: Vec::new(),
        homotopies: Vec::new(),
        explorations: Vec::new(),
        surveys: Vec::new(),
        sweeps: Vec::new(),
    };
    let archive = Archive { keeps, points: Mutex::new(Vec::new()) };
    let diagram = run(&System::of(&model, &[1.0]), &plan, 1, Diagram::default(), &archive);
    (diagram.branches.into_iter().next().unwrap(), archive.points.into_inner().unwrap())
}

#[test]
fn points_kept_elsewhere_do_not_stay_in_memory() {
    let (whole, seen) = followed(false);
    let (sparse, seen_too) = followed(true);
    let places =
        |points: &[Point]| -> Vec<(i64, f64)> { points.iter().map(|p| (p.position, p.parameters[0])).collect() };
    assert!(whole.points.len() > 20 && whole.points.len() == seen.len());
    assert_eq!(places(&seen), places(&seen_too), "the same points are found");
    assert_eq!(sparse.ends, whole.ends);
    // Two at either end, and the start.
    let (all, few) = (places(&whole.points), places(&sparse.points));
    let expected: Vec<(i64, f64)> = all
        .iter()
        .enumerate()
        .filter(|(k, (position, _))| *k < 2 || *k + 2 >= all.len() || *position == 0)
        .map(|(_, place)| *place)
        .collect();
    assert_eq!(few, expected);
}
