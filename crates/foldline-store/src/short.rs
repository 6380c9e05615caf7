//! Requests of a study that were not fulfilled.

use crate::order::{is_run, leg, ordered};
use foldline::diagram::{Branch, Diagram, Ending, Kind, Motion, Shortfall, Shown};
use foldline::explore::{DesignPlan, HomotopyPlan, Plan, SweepPlan};
use foldline::model::Model;

/// Returns one message for each request of the study that was not fulfilled. Further lines of a message state causes
/// and remedies.
///
/// A homotopy has arrived as soon as one of its runs has; runs that turned back are part of its search.
pub fn lines(diagram: &Diagram, plan: &Plan, model: &Model) -> Vec<String> {
    let mut lines = absent(diagram, plan);
    lines.extend(plan.homotopies.iter().filter_map(|homotopy| not_arrived(diagram, homotopy, model)));
    for exploration in &plan.explorations {
        let part = |branch: &Branch| branch.name.strip_prefix(&exploration.name).is_some_and(|n| n.starts_with('/'));
        if diagram.branches.iter().filter(|b| part(b)).all(|b| b.points.is_empty()) {
            lines.push(format!("{}: no branch was followed", exploration.name));
        }
    }
    lines.extend(plan.sweeps.iter().filter_map(|sweep| cut_off(diagram, sweep, model)));
    lines.extend(plan.designs.iter().filter_map(|design| unanswered(diagram, design, model)));
    lines.extend(crate::maps::short(plan, &diagram.cells));
    let targets = targets(plan);
    for branch in &diagram.branches {
        // Answers to design questions say what their runs leave open.
        let is_run = plan.designs.iter().any(|own| is_run(&branch.name, &own.name));
        let is_leg = is_run || plan.homotopies.iter().any(|homotopy| leg(&branch.name, &homotopy.name).is_some());
        if !is_leg {
            let target = targets.iter().find(|(name, _)| **name == branch.name).and_then(|(_, target)| *target);
            lines.extend(ended(branch, target, model));
        }
        lines.extend(unexplained(branch, model));
    }
    // A known reason is appended to the line that reports the missing item.
    for Shortfall { about, what } in &diagram.shortfalls {
        let own = format!("{about}: it ");
        match lines.iter_mut().find(|line| line.starts_with(&own)) {
            Some(line) => *line = format!("{line}\n{what}"),
            None => lines.push(format!("{about}: {what}")),
        }
    }
    lines
}

/// Returns a diagram in the order in which it is shown, with the messages on what was not fulfilled.
pub fn finished(diagram: Diagram, plan: &Plan, model: &Model) -> (Diagram, Vec<String>) {
    let diagram = ordered(diagram, plan);
    let lines = lines(&diagram, plan, model);
    (diagram, lines)
}

/// Names of branches and curves, with the target parameter and value of each.
fn targets(plan: &Plan) -> Vec<(&String, Option<(usize, f64)>)> {
    let curves = plan.curves.iter().map(|curve| (&curve.name, curve.until.map(|target| (curve.free, target))));
    let branches = plan.branches.iter().map(|branch| (&branch.name, branch.until.map(|target| (branch.free, target))));
    branches.chain(curves).collect()
}

/// Messages on branches, curves, surveys and sweeps that are missing altogether.
fn absent(diagram: &Diagram, plan: &Plan) -> Vec<String> {
    let targets = targets(plan);
    let never = targets.iter().filter(|(name, _)| diagram.branch(name).is_none());
    let simulated = plan.surveys.iter().map(|s| &s.name).chain(plan.sweeps.iter().map(|s| &s.name));
    let missing = simulated.filter(|name| diagram.response_set(name).is_none());
    let never = never.map(|(name, _)| format!("{name}: it was not started"));
    never.chain(missing.map(|name| format!("{name}: it is incomplete"))).collect()
}

fn not_arrived(diagram: &Diagram, homotopy: &HomotopyPlan, model: &Model) -> Option<String> {
    let legs: Vec<&Branch> = diagram.branches.iter().filter(|b| leg(&b.name, &homotopy.name).is_some()).collect();
    let HomotopyPlan { name, targets, .. } = homotopy;
    match legs.iter().any(|leg| leg.end_at(targets).is_some()) {
        _ if legs.is_empty() => Some(format!("{name}: it was not started")),
        true => None,
        false => Some(format!("{name}: it did not reach {}", place(targets, model))),
    }
}

/// Message on a design question without an answer, or with one that is only a bound.
fn unanswered(diagram: &Diagram, design: &DesignPlan, model: &Model) -> Option<String> {
    let Some(found) = diagram.design(&design.name) else { return Some(format!("{}: it is unfinished", design.name)) };
    if found.answered() {
        return None;
    }
    let p = model.parameters.get(found.vary).map_or("?", |own| own.name.as_str());
    let what = match &found.answer {
        Some(answer) => {
            let side = if found.greatest { "most" } else { "least" };
            format!("it is not answered; the value of {p} is at {side} {:.6}", Shown(answer.value))
        }
        None => "it is not answered".into(),
    };
    Some(format!("{}: {what}\n{}", design.name, found.reasons.join("\n")))
}

/// Message on a sweep whose trajectory escaped or ended in chatter before the last value.
fn cut_off(diagram: &Diagram, sweep: &SweepPlan, model: &Model) -> Option<String> {
    let last = diagram.response_set(&sweep.name)?.responses.last()?;
    let advice = match last.motion {
        Motion::Chatter => {
            "what to do: replace the restitution by a stiffness and damping of the contact, whose motions are simulated \
             through sustained contact"
        }
        _ => {
            "likely cause: the motion loses stability, or its basin becomes narrower than a step of the sweep\nwhat to \
             do: use smaller steps there, or follow the motion as a branch, which includes unstable parts"
        }
    };
    last.motion.is_lost().then(|| {
        format!(
            "{}: at {} the motion {}; the sweep ends there, after {} of {} values\n{advice}",
            sweep.name,
            place(&[(sweep.free, last.value)], model),
            last.fate(),
            diagram.response_set(&sweep.name).map_or(0, |set| set.responses.len()),
            sweep.values.len()
        )
    })
}

/// Messages on a branch that is incomplete or did not reach its target.
fn ended(branch: &Branch, target: Option<(usize, f64)>, model: &Model) -> Vec<String> {
    let short = branch.ends.iter().flatten().filter(|end| !end.complete());
    let mut lines: Vec<String> = short.map(|end| format!("{}: {end}", branch.name)).collect();
    // Both sides of a branch that did not begin give the same line.
    lines.dedup();
    let whole = lines.is_empty();
    if branch.ends.iter().all(Option::is_none) {
        lines.push(format!("{}: it is unfinished", branch.name));
    } else if let Some(target) = target.filter(|target| whole && branch.end_at(&[*target]).is_none()) {
        let ends: Vec<String> = branch.ends.iter().flatten().map(Ending::brief).collect();
        let place = place(&[target], model);
        lines.push(format!("{}: it did not reach {place}; {}", branch.name, ends.join("; ")));
    }
    lines
}

/// Message on changes of stability that no special point explains.
fn unexplained(branch: &Branch, model: &Model) -> Option<String> {
    let own = branch.special.iter().filter(|special| special.kind == Kind::Unexplained);
    let places: Vec<f64> = own.filter_map(|special| special.point.parameters.get(branch.free).copied()).collect();
    let low = places.iter().copied().reduce(f64::min)?;
    let high = places.iter().copied().reduce(f64::max)?;
    let parameter = model.parameters.get(branch.free).map_or("?", |parameter| parameter.name.as_str());
    let changes = match places.len() {
        1 => format!("a change of stability at {parameter} = {low:.6} is not explained"),
        count if low == high => format!("{count} changes of stability at {parameter} = {low:.6} are not explained"),
        count => {
            format!("{count} changes of stability from {parameter} = {low:.6} to {high:.6} are not explained")
        }
    };
    Some(format!(
        "{}: {changes} by a special point\nwhat to do: treat the stability there as uncertain; `foldline verify` or \
         a smaller tolerance may resolve it",
        branch.name
    ))
}

fn place(targets: &[(usize, f64)], model: &Model) -> String {
    let name = |index: usize| model.parameters.get(index).map_or("?", |parameter| parameter.name.as_str());
    targets.iter().map(|(index, goal)| format!("{} = {}", name(*index), Shown(*goal))).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study_file::{Study, parse_study};
    use foldline::diagram::Point;
    use foldline::diagram::{Cost, Family, Origin, Solution, SpecialPoint, Trust};

    const MODEL: &str = "name = \"m\"\n[parameters]\nOmega = 1\nkappa = 0\n[states]\nx = \"-x\"\n";
    const STUDY: &str = "model = \"m\"\n[[seed]]\nname = \"s\"\nstate = { x = 0 }\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [0, 4]\nuntil = 4\n\
        [[curve]]\nname = \"c\"\nhold = \"fold\"\nof = \"b\"\nfree = \"kappa\"\nuntil = 0.5\n\
        [[homotopy]]\nname = \"h\"\nfrom = \"s\"\nto = { kappa = 1 }\nvia = \"Omega\"\nrange = [0, 4]\n";

    fn study() -> Study {
        parse_study(STUDY, "study", MODEL, "model").unwrap()
    }

    /// Branch with one point, at these values of Omega and kappa, and the given ending.
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
    fn requests_that_were_fulfilled_give_no_message() {
        let found = said(vec![
            branch("b", None, Ending::Bound(4.0), [4.0 + 1e-15, 0.0]),
            branch("c", Some((Kind::Fold, 0)), Ending::Bound(0.5), [2.0, 0.5]),
            branch("h/1", None, Ending::StepTooSmall("it turned back".into()), [1.0, 0.7]),
            branch("h/2", None, Ending::Bound(1.0), [3.0, 1.0]),
        ]);
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn missing_branches_are_reported_as_not_started() {
        assert_eq!(said(Vec::new()), ["b: it was not started", "c: it was not started", "h: it was not started"]);
    }

    #[test]
    fn an_end_away_from_the_target_is_reported() {
        let found = said(vec![
            branch("b", None, Ending::Bound(0.0), [0.0, 0.0]),
            branch("c", Some((Kind::Fold, 0)), Ending::StepTooSmall("a cusp".into()), [2.0, 0.4]),
            branch("h/1", None, Ending::Bound(0.0), [1.0, 0.0]),
            branch("b/hopf-1", None, Ending::PointLimit(7), [1.0, 0.0]),
        ]);
        let expected = [
            "h: it did not reach kappa = 1",
            "b: it did not reach Omega = 4; reached 0",
            "c: step size too small: a cusp",
            "b/hopf-1: stopped at the limit of 7 points",
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn an_unexplained_change_of_stability_is_reported() {
        let mut found = branch("b", None, Ending::Bound(4.0), [4.0, 0.0]);
        let special = |kind: Kind, value: f64| SpecialPoint {
            kind,
            point: Point { parameters: vec![value, 0.0], ..found.points[0].clone() },
            unstable_before: 0,
            unstable_after: 1,
            error: 1e-8,
            coefficients: Vec::new(),
            coefficient_errors: Vec::new(),
            remark: String::new(),
        };
        let places = [special(Kind::Unexplained, 1.5), special(Kind::Fold, 2.0), special(Kind::Unexplained, 2.5)];
        found.special.extend(places);
        let lines = said(vec![found]);
        let own: Vec<&String> = lines.iter().filter(|line| line.starts_with("b: ")).collect();
        assert_eq!(own.len(), 1, "{lines:?}");
        assert!(own[0].starts_with("b: 2 changes of stability from Omega = 1.500000 to 2.500000 are not explained"));
    }

    #[test]
    fn a_known_reason_follows_the_message_on_a_missing_item() {
        let study = study();
        let short = |about: &str, what: &str| Shortfall { about: about.into(), what: what.into() };
        let branches = vec![branch("b", None, Ending::Bound(4.0), [4.0, 0.0])];
        let shortfalls = vec![short("b", "hopf 2.0 of b: no bifurcating branch found"), short("h", "there is nothing")];
        let found = lines(&Diagram { branches, shortfalls, ..Diagram::default() }, &study.plan, &study.model);
        let expected = [
            "c: it was not started",
            "h: it was not started\nthere is nothing",
            "b: hopf 2.0 of b: no bifurcating branch found",
        ];
        assert_eq!(found, expected);
    }
}
