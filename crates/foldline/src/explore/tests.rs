//! Points kept in memory, branch switching, and starts of branches.

use super::{
    AttractorKey, BranchPlan, Plan, SeedPlan, SeedSource, Start, Switching, System, first_solution, run, run_from,
};
use crate::contract::{Event, Observer, Unobserved, Verdict};
use crate::diagram::{Branch, Diagram, Ending, Kind, Point};
use crate::model::{Definition, Model, ModelSource, Parameter, State};
use crate::special::mark::Mark;
use crate::special::quantity::Quantity;
use std::sync::Mutex;

/// An observer that remembers the points, and claims to keep them if `keeps`.
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
        holds: Default::default(),
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
        limits: Default::default(),
        simulation: crate::attractors::Limits::patient(),
        seeds: vec![seed],
        branches: vec![branch],
        curves: Vec::new(),
        homotopies: Vec::new(),
        explorations: Vec::new(),
        surveys: Vec::new(),
        sweeps: Vec::new(),
        designs: Vec::new(),
        maps: Vec::new(),
        record: Vec::new(),
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

/// x' = p (p - 2) x - x³, with a pitchfork at 0 and one at 2.
fn pitchforks() -> Model {
    Model::compile(ModelSource {
        name: "two pitchforks".into(),
        parameters: vec![Parameter::new("p", 1.0)],
        states: vec![State::new("x")],
        equations: vec![Definition::new("x", "p*(p - 2)*x - x^3")],
        ..ModelSource::default()
    })
    .unwrap()
}

fn pitchfork_plan(switching: Switching) -> Plan {
    let source = SeedSource::State(vec![0.0]);
    let seed = SeedPlan { name: "at 1".into(), source, parameters: vec![1.0], samples: 1, random: 1 };
    let branch = BranchPlan {
        holds: Default::default(),
        name: "rest".into(),
        start: Start::Seed(0),
        free: 0,
        range: [-1.0, 3.0],
        until: None,
        switching,
        marks: Vec::new(),
        max_points: 1000,
    };
    Plan { seeds: vec![seed], branches: vec![branch], ..Plan::empty(1e-6, 4) }
}

#[test]
fn branches_are_switched_only_at_the_selected_special_point() {
    let model = pitchforks();
    let only = vec![(Kind::BranchPoint, 2, 1)];
    let plan = pitchfork_plan(Switching { depth: Vec::new(), only });
    let system = System::of_plan(&model, &plan);
    let diagram = run(&system, &plan, 1, Diagram::default(), &Unobserved);
    let names: Vec<&str> = diagram.branches.iter().map(|b| b.name.as_str()).collect();
    assert_eq!(diagram.branches[0].special.iter().map(|s| s.kind).collect::<Vec<_>>(), [Kind::BranchPoint; 2]);
    assert_eq!(names, ["rest", "rest/branch-point-2"]);
}

#[test]
fn a_given_solution_is_not_searched_for() {
    let model = pitchforks();
    let plan = pitchfork_plan(Switching::default());
    // The given solution at p = 3 is √3; the state of the plan's own seed leads to 0 at p = 1.
    let seed = SeedPlan { source: SeedSource::State(vec![1.7]), parameters: vec![3.0], ..plan.seeds[0].clone() };
    let given = first_solution(&System::of(&model, &[3.0]), &seed, 1e-6, 1).unwrap();
    let system = System::of_plan(&model, &plan);
    let diagram = run_from(&system, &plan, 1, Diagram::default(), &[(0, given)], &Unobserved);
    let start = diagram.branches[0].points.iter().find(|p| p.position == 0).unwrap();
    assert!((start.ranges[0][1] - 3.0_f64.sqrt()).abs() < 1e-8, "{:?}", start.ranges);
    assert_eq!(start.parameters, [3.0]);
}

/// The cycle of the Stuart–Landau equation, of radius √p and period 2π.
fn circles() -> Model {
    Model::compile(ModelSource {
        name: "circles".into(),
        parameters: vec![Parameter::new("p", 1.0)],
        states: vec![State::new("x"), State::new("y")],
        equations: vec![
            Definition::new("x", "p*x - y - x*(x^2 + y^2)"),
            Definition::new("y", "x + p*y - y*(x^2 + y^2)"),
        ],
        ..ModelSource::default()
    })
    .unwrap()
}

#[test]
fn the_last_step_lands_on_the_bound() {
    let model = circles();
    let source = SeedSource::Attractor(AttractorKey::Cycle);
    let seed = SeedPlan { name: "at 1".into(), source, parameters: vec![1.0], samples: 4, random: 1 };
    let branch = BranchPlan {
        holds: Default::default(),
        name: "circle".into(),
        range: [0.4, 7.3],
        ..pitchfork_plan(Switching::default()).branches[0].clone()
    };
    let plan = Plan { seeds: vec![seed], branches: vec![branch], ..Plan::empty(1e-6, 4) };
    let diagram = run(&System::of_plan(&model, &plan), &plan, 1, Diagram::default(), &Unobserved);
    let branch = &diagram.branches[0];
    assert_eq!(branch.ends, [Some(Ending::Bound(0.4)), Some(Ending::Bound(7.3))]);
    let values: Vec<f64> = branch.points.iter().map(|point| point.parameters[0]).collect();
    let count = values.len();
    assert_eq!([values[0], values[count - 1]], [0.4, 7.3], "to the last bit");
    assert!(values.is_sorted() && count > 8, "{values:?}");
    for point in [&branch.points[0], &branch.points[count - 1]] {
        assert!((point.ranges[0][1] - point.parameters[0].sqrt()).abs() < 1e-7);
        // A step that is shortened to a bound only after acceptance is solved again there: twice the work of a step, five and
        // three between its ends, since it is long.
        assert!(point.cost.newton <= 9 && point.cost.rejected == 0, "{:?}", point.cost);
    }
}

#[test]
fn special_points_and_endings_are_kept_when_a_branch_is_resumed() {
    let ring = Model::compile(ModelSource {
        name: "ring".into(),
        parameters: vec![Parameter::new("p", 0.0)],
        states: vec![State::new("x")],
        equations: vec![Definition::new("x", "1 - p^2 - x^2")],
        ..ModelSource::default()
    })
    .unwrap();
    let plan = pitchfork_plan(Switching::default());
    let seed = SeedPlan { source: SeedSource::State(vec![1.0]), parameters: vec![0.0], ..plan.seeds[0].clone() };
    let branch = BranchPlan { range: [-2.0, 2.0], ..plan.branches[0].clone() };
    let plan = Plan { seeds: vec![seed], branches: vec![branch], ..plan };
    let system = System::of_plan(&ring, &plan);
    let whole = run(&system, &plan, 1, Diagram::default(), &Unobserved).branches.remove(0);
    assert_eq!(whole.ends, [Some(Ending::Closed), Some(Ending::Closed)]);
    let places =
        |branch: &Branch| -> Vec<(Kind, i64)> { branch.special.iter().map(|s| (s.kind, s.point.position)).collect() };
    assert_eq!(places(&whole).iter().map(|(kind, _)| *kind).collect::<Vec<_>>(), [Kind::Fold; 2]);
    // A stability change that the other side does not explain lies beyond the last point.
    let mut earlier = whole.clone();
    let mut change = whole.special[0].clone();
    change.kind = Kind::Unexplained;
    change.point.position = whole.points.last().unwrap().position;
    earlier.insert_special(change);
    let expected = places(&earlier);
    assert_eq!(expected.len(), 3);
    for backward in [Some(Ending::Closed), None] {
        earlier.ends[0] = backward;
        let known = Diagram { branches: vec![earlier.clone()], ..Diagram::default() };
        let again = run(&system, &plan, 1, known, &Unobserved).branches.remove(0);
        assert_eq!((places(&again), again.points.len()), (expected.clone(), whole.points.len()));
        assert_eq!(again.ends, whole.ends);
    }
}

#[test]
fn a_mark_at_the_start_is_there_once_wherever_the_run_was_interrupted() {
    let model = pitchforks();
    let mut plan = pitchfork_plan(Switching::default());
    plan.branches[0].marks = [1.0, 2.5].map(|value| Mark::at(Quantity::Parameter(0), value, false)).to_vec();
    let system = System::of_plan(&model, &plan);
    let marked = |earlier: Diagram| -> Vec<f64> {
        let branch = run(&system, &plan, 1, earlier, &Unobserved).branches.remove(0);
        branch.special.iter().filter(|s| s.kind == Kind::Mark).map(|s| s.point.parameters[0]).collect()
    };
    let whole = run(&system, &plan, 1, Diagram::default(), &Unobserved).branches.remove(0);
    assert_eq!(marked(Diagram::default()), [1.0, 2.5]);
    for marks in [0, 1] {
        for points in [1, 2, 3] {
            let mut earlier = whole.clone();
            earlier.ends = [None, None];
            earlier.points.retain(|p| (0..points).contains(&p.position));
            earlier.special.retain(|s| s.kind == Kind::Mark && s.point.parameters[0] == 1.0);
            earlier.special.truncate(marks);
            let known = Diagram { branches: vec![earlier], ..Diagram::default() };
            assert_eq!(marked(known), [1.0, 2.5], "{points} points and {marks} marks");
        }
    }
}

/// An observer that stops at the first point and records the seeds for which initial states were sampled.
struct Impatient(Mutex<Vec<String>>);

impl Observer for Impatient {
    fn observe(&self, event: Event) -> Verdict {
        match event {
            Event::Note(name, _) => self.0.lock().unwrap().push(name.to_string()),
            Event::Point(..) => return Verdict::Stop,
            _ => {}
        }
        Verdict::Continue
    }
}

#[test]
fn no_census_begins_once_the_observer_has_asked_to_stop() {
    let model = circles();
    let source = SeedSource::Attractor(AttractorKey::Cycle);
    let seeds = [1.0, 2.0, 3.0].map(|p| SeedPlan {
        name: format!("at {p}"),
        source: source.clone(),
        parameters: vec![p],
        samples: 4,
        random: 1,
    });
    let like = pitchfork_plan(Switching::default()).branches[0].clone();
    let branches = (0..3).map(|k| BranchPlan {
        holds: Default::default(),
        name: format!("from {k}"),
        start: Start::Seed(k),
        range: [0.4, 7.3],
        ..like.clone()
    });
    let plan = Plan { branches: branches.collect(), seeds: seeds.to_vec(), ..Plan::empty(1e-6, 4) };
    let observer = Impatient(Mutex::new(Vec::new()));
    let diagram = run(&System::of_plan(&model, &plan), &plan, 1, Diagram::default(), &observer);
    let counts: Vec<usize> = diagram.branches.iter().map(|branch| branch.points.len()).collect();
    assert_eq!((counts, observer.0.into_inner().unwrap().len()), (vec![1], 1));
}
