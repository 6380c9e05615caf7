//! What of a study was not reached.

use crate::order::leg;
use foldline::diagram::{Branch, Diagram, Point};
use foldline::explore::Plan;
use foldline::model::Model;

/// What of the study was not reached, a line each.
///
/// A homotopy is there as soon as one of its legs is; that others of them turned back is how it found its way.
pub fn lines(diagram: &Diagram, plan: &Plan, model: &Model) -> Vec<String> {
    let mut lines = Vec::new();
    let curves = plan.curves.iter().map(|curve| (&curve.name, curve.until.map(|target| (curve.free, target))));
    let branches = plan.branches.iter().map(|branch| (&branch.name, branch.until.map(|target| (branch.free, target))));
    let asked: Vec<(&String, Option<(usize, f64)>)> = branches.chain(curves).collect();
    let never = asked.iter().filter(|(name, _)| diagram.branch(name).is_none());
    lines.extend(never.map(|(name, _)| format!("{name}: it never began")));
    for homotopy in &plan.homotopies {
        let legs: Vec<&Branch> = diagram.branches.iter().filter(|b| leg(&b.name, &homotopy.name).is_some()).collect();
        if legs.is_empty() {
            lines.push(format!("{}: it never began", homotopy.name));
        } else if !legs.iter().any(|leg| arrived(leg, &homotopy.targets)) {
            lines.push(format!("{}: it did not arrive at {}", homotopy.name, place(&homotopy.targets, model)));
        }
    }
    for branch in &diagram.branches {
        if plan.homotopies.iter().any(|homotopy| leg(&branch.name, &homotopy.name).is_some()) {
            continue;
        }
        let before = lines.len();
        let short = branch.ends.iter().flatten().filter(|end| !end.complete());
        lines.extend(short.map(|end| format!("{}: {end}", branch.name)));
        if branch.ends.iter().all(Option::is_none) {
            lines.push(format!("{}: it is not finished", branch.name));
        }
        let target = asked.iter().find(|(name, _)| **name == branch.name).and_then(|(_, target)| *target);
        if let Some(target) = target.filter(|target| lines.len() == before && !arrived(branch, &[*target])) {
            let ends: Vec<String> = branch.ends.iter().flatten().map(|end| end.to_string()).collect();
            let place = place(&[target], model);
            lines.push(format!("{}: it did not arrive at {place}; {}", branch.name, ends.join("; ")));
        }
    }
    lines
}

/// Whether one end of a branch has these values of these parameters. A point at a bound has its value but for rounding.
fn arrived(branch: &Branch, targets: &[(usize, f64)]) -> bool {
    const ROUNDING: f64 = 1e-9;
    let there = |point: &Point| {
        let near = |(index, goal): &(usize, f64)| {
            point.parameters.get(*index).is_some_and(|value| (value - goal).abs() <= ROUNDING * (1.0 + goal.abs()))
        };
        targets.iter().all(near)
    };
    [branch.points.first(), branch.points.last()].into_iter().flatten().any(there)
}

fn place(targets: &[(usize, f64)], model: &Model) -> String {
    let name = |index: usize| model.parameters.get(index).map_or("?", |parameter| parameter.name.as_str());
    targets.iter().map(|(index, goal)| format!("{} = {goal}", name(*index))).collect::<Vec<_>>().join(", ")
}
