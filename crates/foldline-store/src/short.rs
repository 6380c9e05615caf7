//! What of a study was not reached.

use crate::order::leg;
use foldline::diagram::{Branch, Diagram, Ending, Motion, Point};
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
    let simulated = plan.surveys.iter().map(|s| &s.name).chain(plan.sweeps.iter().map(|s| &s.name));
    let missing = simulated.filter(|name| diagram.response_set(name).is_none());
    lines.extend(missing.map(|name| format!("{name}: it is not complete")));
    let swept = plan.sweeps.iter().filter_map(|sweep| Some((sweep, diagram.response_set(&sweep.name)?)));
    lines.extend(swept.filter_map(|(sweep, set)| {
        let last = set.responses.last().filter(|last| last.motion == Motion::Escaped)?;
        Some(format!(
            "{}: at {} the motion {}; the sweep ends there, {} of {} values visited\n\
             likely cause: what was followed ceases to attract, or its basin becomes so narrow that a step of the sweep leads out of it\n\
             what to do: take smaller steps there, or follow the motion as a branch, which passes the point where it ceases to attract",
            sweep.name,
            place(&[(sweep.free, last.value)], model),
            last.fate(),
            set.responses.len(),
            sweep.values.len()
        ))
    }));
    for homotopy in &plan.homotopies {
        let legs: Vec<&Branch> = diagram.branches.iter().filter(|b| leg(&b.name, &homotopy.name).is_some()).collect();
        if legs.is_empty() {
            lines.push(format!("{}: it never began", homotopy.name));
        } else if !legs.iter().any(|leg| arrived(leg, &homotopy.targets)) {
            lines.push(format!("{}: it did not arrive at {}", homotopy.name, place(&homotopy.targets, model)));
        }
    }
    for exploration in &plan.explorations {
        let part = |branch: &Branch| branch.name.strip_prefix(&exploration.name).is_some_and(|n| n.starts_with('/'));
        let points: usize = diagram.branches.iter().filter(|b| part(b)).map(|b| b.points.len()).sum();
        match points {
            0 => lines.push(format!("{}: no branch was followed", exploration.name)),
            _ if points >= exploration.budget => lines.push(format!(
                "{}: the budget of {} points is used up; begin again with a larger one",
                exploration.name, exploration.budget
            )),
            _ => {}
        }
    }
    for branch in &diagram.branches {
        if plan.homotopies.iter().any(|homotopy| leg(&branch.name, &homotopy.name).is_some()) {
            continue;
        }
        let before = lines.len();
        let short = branch.ends.iter().flatten().filter(|end| !end.complete());
        lines.extend(short.map(|end| format!("{}: {end}", branch.name)));
        // A branch that did not begin has not begun on either side.
        lines.dedup();
        if branch.ends.iter().all(Option::is_none) {
            lines.push(format!("{}: it is not finished", branch.name));
        }
        let target = asked.iter().find(|(name, _)| **name == branch.name).and_then(|(_, target)| *target);
        if let Some(target) = target.filter(|target| lines.len() == before && !arrived(branch, &[*target])) {
            let ends: Vec<String> = branch.ends.iter().flatten().map(Ending::brief).collect();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study_file::{Study, parse_study};
    use foldline::diagram::{Cost, Family, Kind, Origin, Solution, Trust};

    const MODEL: &str = "name = \"m\"\n[parameters]\nOmega = 1\nkappa = 0\n[states]\nx = \"-x\"\n";
    const STUDY: &str = "model = \"m\"\n[[seed]]\nname = \"s\"\nstate = { x = 0 }\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [0, 4]\nuntil = 4\n\
        [[curve]]\nname = \"c\"\nhold = \"fold\"\nof = \"b\"\nfree = \"kappa\"\nuntil = 0.5\n\
        [[homotopy]]\nname = \"h\"\nfrom = \"s\"\nto = { kappa = 1 }\nvia = \"Omega\"\nrange = [0, 4]\n";

    fn study() -> Study {
        parse_study(STUDY, "study", MODEL, "model").unwrap()
    }

    /// A branch that ended at these values of Omega and kappa.
    fn branch(name: &str, held: Option<(Kind, usize)>, ending: Ending, at: [f64; 2]) -> Branch {
        let mut branch = Branch { held, ..Branch::new(name, Family::Equilibrium, 0, Origin::Seed("s".into())) };
        branch.insert(Point {
            position: 1,
            parameters: at.to_vec(),
            solution: Solution::Equilibrium(vec![0.0]),
            tangent: Vec::new(),
            step: 0.1,
            spectrum: Vec::new(),
            unstable: 0,
            ranges: Vec::new(),
            averages: Vec::new(),
            trust: Trust::default(),
            cost: Cost::default(),
        });
        branch.ends[1] = Some(ending);
        branch
    }

    fn said(branches: Vec<Branch>) -> Vec<String> {
        let study = study();
        lines(&Diagram { branches, ..Diagram::default() }, &study.plan, &study.model)
    }

    #[test]
    fn what_arrived_is_not_complained_about_whatever_happened_on_the_way() {
        let found = said(vec![
            branch("b", None, Ending::Bound(4.0), [4.0 + 1e-15, 0.0]),
            branch("c", Some((Kind::Fold, 0)), Ending::Bound(0.5), [2.0, 0.5]),
            branch("h/1", None, Ending::StepTooSmall("it turned back".into()), [1.0, 0.7]),
            branch("h/2", None, Ending::Bound(1.0), [3.0, 1.0]),
        ]);
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn what_is_absent_never_began() {
        assert_eq!(said(Vec::new()), ["b: it never began", "c: it never began", "h: it never began"]);
    }

    #[test]
    fn an_end_elsewhere_than_at_the_target_is_short() {
        let found = said(vec![
            branch("b", None, Ending::Bound(0.0), [0.0, 0.0]),
            branch("c", Some((Kind::Fold, 0)), Ending::StepTooSmall("a cusp".into()), [2.0, 0.4]),
            branch("h/1", None, Ending::Bound(0.0), [1.0, 0.0]),
            branch("b/hopf-1", None, Ending::PointLimit(7), [1.0, 0.0]),
        ]);
        let expected = [
            "h: it did not arrive at kappa = 1",
            "b: it did not arrive at Omega = 4; reached 0",
            "c: step too small: a cusp",
            "b/hopf-1: stopped at the limit of 7 points",
        ];
        assert_eq!(found, expected);
    }
}
