//! Tests of the shooting itself, and of the detection of wrong diagrams.

use super::shooting::{Orbit, Shooting};
use super::{Quantity, verify};
use crate::contract::Unobserved;
use crate::diagram::{Diagram, Kind, Solution};
use crate::explore::plan::{BranchPlan, Plan, SeedPlan, SeedSource, Start, Switching};
use crate::explore::{System, run};
use crate::model::{Definition, Model, ModelSource, Parameter, State};
use crate::problem::{Axis, Setting};

/// z' = (p + i w) z - z |z|²: cycles of radius √p, period 2π / w, multipliers 1 and exp(-4 π p / w).
fn model() -> Model {
    Model::compile(ModelSource {
        name: "Stuart-Landau".into(),
        parameters: vec![Parameter::new("p", 1.0), Parameter::new("w", 2.0)],
        states: vec![State::new("x"), State::new("y")],
        equations: vec![
            Definition::new("x", "p*x - w*y - x*(x^2 + y^2)"),
            Definition::new("y", "w*x + p*y - y*(x^2 + y^2)"),
        ],
        ..ModelSource::default()
    })
    .unwrap()
}

fn computed(model: &Model) -> Diagram {
    let seed = SeedPlan {
        name: "rest".into(),
        source: SeedSource::State(vec![0.0, 0.0]),
        parameters: vec![-0.5, 2.0],
        samples: 1,
        random: 1,
    };
    let branch = BranchPlan {
        holds: Default::default(),
        name: "rest".into(),
        start: Start::Seed(0),
        free: 0,
        range: [-0.5, 0.5],
        until: None,
        marks: Vec::new(),
        max_points: 1000,
        switching: Switching { depth: vec![(Kind::Hopf, 1)], only: Vec::new() },
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
    run(&System::of(model, &[-0.5, 2.0]), &plan, 1, Diagram::default(), &Unobserved)
}

#[test]
fn shooting_gives_the_multipliers_of_the_closed_form() {
    let model = model();
    let diagram = computed(&model);
    let point = diagram.branches[1].points.last().unwrap();
    let (scales, parameters) = (vec![1.0, 1.0], point.parameters.clone());
    let setting = Setting { field: &model, scales: &scales, parameters, axes: vec![Axis::new(0, 1.0)] };
    let orbit = Orbit::of(&setting, point).unwrap();
    let solved =
        Shooting { setting: &setting, accuracy: 1e-12, ignored: None }.solve(&[orbit], &[]).pop().unwrap().unwrap();
    let p = solved.orbit.free[0];
    assert!((solved.orbit.period - std::f64::consts::PI).abs() < 1e-10, "{}", solved.orbit.period);
    let radius = solved.orbit.nodes.chunks(2).map(|z| z[0].hypot(z[1]));
    assert!(radius.into_iter().all(|r| (r - p.sqrt()).abs() < 1e-10));
    let found = solved.flow.multipliers(&solved.orbit);
    let expected = (-2.0 * std::f64::consts::PI * p).exp();
    assert!((found[0] - 1.0).norm() < 1e-10 && (found[1] - expected).norm() < 1e-10, "{found:?}");
}

#[test]
fn a_correct_diagram_passes_and_changes_in_it_are_detected() {
    let model = model();
    let right = computed(&model);
    let system = System::of(&model, &[-0.5, 2.0]);
    let verified = |diagram: &Diagram| verify(&system, diagram, 1e-6, None, &|_| true);
    let found = verified(&right);
    assert_eq!(found.wrong().count(), 0, "{:?}", found.wrong().next());
    assert!(found.undecided.is_empty() && found.special == 1, "{:?}", found.undecided);
    assert_eq!(found.points, right.branches.iter().map(|b| b.points.len()).sum::<usize>());

    // One change at a time.
    let worst = |change: &dyn Fn(&mut Diagram)| {
        let mut diagram = right.clone();
        change(&mut diagram);
        let found = verified(&diagram);
        let wrong = found.wrong().next().expect("something wrong");
        (wrong.quantity, wrong.special)
    };
    let cycle = |diagram: &mut Diagram, change: &dyn Fn(&mut crate::diagram::Cycle)| {
        if let Solution::Cycle(cycle) = &mut diagram.branches[1].points[3].solution {
            change(cycle);
        }
    };
    assert_eq!(worst(&|d| cycle(d, &|c| c.period += 1e-4)).0, Quantity::Period);
    assert_eq!(worst(&|d| cycle(d, &|c| c.profile[7] += 1e-3)).0, Quantity::Profile);
    assert_eq!(worst(&|d| d.branches[1].points[3].ranges[0][1] += 1e-3).0, Quantity::Range);
    assert_eq!(worst(&|d| d.branches[1].points[3].spectrum[1] += 1.0).0, Quantity::Stability);
    assert_eq!(worst(&|d| d.branches[0].points[3].spectrum[1] += 1e-6).0, Quantity::Spectrum);
    assert_eq!(worst(&|d| d.branches[1].points[3].unstable = 1).0, Quantity::Record);
    assert_eq!(worst(&|d| d.branches[0].special[0].point.parameters[0] += 1e-5), (Quantity::Place, Some(Kind::Hopf)));
    assert_eq!(worst(&|d| d.branches[0].special[0].kind = Kind::Fold), (Quantity::Place, Some(Kind::Fold)));
    assert_eq!(worst(&|d| d.branches[0].special.clear()).0, Quantity::Record);
}
