//! Two-parameter curves: against closed forms, and through the special points of one-parameter runs.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind, Solution};
use foldline::explore::{CurvePlan, Plan, System, run};
use foldline_store::study_file::parse_study;

fn plan_of(text: &str) -> foldline_store::study_file::Study {
    let model = include_str!("../../../models/overhung-rotor.toml");
    parse_study(text, "study", model, "model").unwrap_or_else(|found| panic!("{}", found[0]))
}

fn grown(study: &foldline_store::study_file::Study, plan: &Plan) -> Diagram {
    run(&System::of_plan(&study.model, plan), plan, 2, Diagram::default(), &Unobserved)
}

fn curve(study: &foldline_store::study_file::Study, of: &str, hold: Kind, near: f64, second: &str) -> CurvePlan {
    CurvePlan {
        name: format!("{hold} of {of} near {near}"),
        hold,
        of: of.into(),
        near: Some(near),
        free: study.model.parameter_index(second).unwrap(),
        ranges: [[0.5, 12.0], [0.0, 1.0]],
        until: None,
        max_points: 400,
    }
}

#[test]
fn scratch() {
    let mut study = plan_of(
        r#"
model = "../../models/overhung-rotor.toml"
[[seed]]
name = "s"
attractor = "2:1"
parameters = { Omega = 5, kappa = 0 }
[[branch]]
name = "cubic SL"
from = "s"
free = "Omega"
range = [0.5, 12]
"#,
    );
    let c = curve(&study, "cubic SL", Kind::Fold, 3.0, "kappa");
    study.plan.curves.push(c);
    let diagram = grown(&study, &study.plan);
    for b in &diagram.branches {
        println!("{} {:?} {} points, {:?}", b.name, b.held, b.points.len(), b.ends);
        for s in &b.special {
            println!("   {} {:?} {}", s.kind, &s.point.parameters[..2], s.error);
        }
        if b.held.is_some() {
            for p in &b.points {
                println!(
                    "   {:?} {:?} T {:?} r {:?} disc {:.1e} intervals {} cost {:?}",
                    &p.parameters[..2],
                    p.spectrum.iter().map(|z| format!("{:.6}{:+.6}i", z.re, z.im)).collect::<Vec<_>>().join(" "),
                    p.solution.period(),
                    p.ranges[4][1],
                    p.trust.discretisation,
                    match &p.solution {
                        Solution::Cycle(c) => c.intervals(),
                        _ => 0,
                    },
                    p.cost
                );
            }
        }
    }
    let _: Option<(&Branch, Ending)> = None;
}
