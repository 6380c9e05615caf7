//! Order in which branches, surveys and sweeps are listed.

use foldline::diagram::{Branch, Diagram, Origin};
use foldline::explore::{Near, Plan, Start};
use std::cmp::Ordering;

/// Names of the branches, curves and homotopies of a study in the order of the file, each after the one it starts from;
/// then the names of the explorations.
pub fn names(plan: &Plan) -> Vec<String> {
    let mut names = Names { plan, found: Vec::new() };
    (0..plan.branches.len()).for_each(|index| names.add(&Start::EndOf(index)));
    (0..plan.curves.len()).for_each(|index| names.add(&Start::EndOfCurve(index)));
    (0..plan.homotopies.len()).for_each(|index| names.add(&Start::EndOfHomotopy(index)));
    names.found.extend(plan.explorations.iter().map(|exploration| exploration.name.clone()));
    names.found
}

struct Names<'p> {
    plan: &'p Plan,
    found: Vec<String>,
}

impl Names<'_> {
    /// Adds the name of a start, after the names it starts from. The recursion ends because starts refer only to
    /// earlier entries of the plan.
    fn add(&mut self, what: &Start) {
        let plan = self.plan;
        let (name, from) = match what {
            Start::Seed(_) => return,
            Start::EndOfSwitched(index, _) | Start::Near(Near { branch: index, .. }) => {
                return self.add(&Start::EndOf(*index));
            }
            Start::EndOf(index) => (&plan.branches[*index].name, Some(&plan.branches[*index].start)),
            Start::EndOfCurve(index) => (&plan.curves[*index].name, None),
            Start::EndOfHomotopy(index) => (&plan.homotopies[*index].name, Some(&plan.homotopies[*index].start)),
        };
        if !self.found.contains(name) {
            from.into_iter().for_each(|from| self.add(from));
            self.found.push(name.clone());
        }
    }
}

/// Returns the number of a run of a homotopy: 3 for `NAME/3`. `None` if the name belongs to no run of this homotopy.
pub fn leg(name: &str, homotopy: &str) -> Option<usize> {
    name.strip_prefix(homotopy)?.strip_prefix('/')?.parse().ok()
}

/// True if the name denotes a branch that an exploration started: `NAME/cycle-3` is its third cycle.
fn is_finding(name: &str, exploration: &str) -> bool {
    let rest = name.strip_prefix(exploration).and_then(|rest| rest.strip_prefix('/'));
    rest.and_then(|rest| rest.rsplit_once('-'))
        .is_some_and(|(kind, number)| !kind.contains('/') && number.parse::<usize>().is_ok())
}

/// True if the name denotes a branch that was followed for a design question: `NAME/line-3`.
pub fn is_run(name: &str, design: &str) -> bool {
    name.strip_prefix(design).is_some_and(|rest| rest.starts_with('/'))
}

/// Sorts the branches and responses of a diagram into an order that does not depend on the scheduling of the threads.
///
/// The branches of the study come in the order of its [`names`]. Each is followed by its child branches, sorted by
/// parameter, and then by the two-parameter curves that begin on it. Homotopy runs and findings of an exploration stay
/// in the order in which they were computed. Branches followed for design questions come last, question by question.
/// Surveys and then sweeps come in the order of the study.
pub fn ordered(diagram: Diagram, plan: &Plan) -> Diagram {
    let simulated = || plan.surveys.iter().map(|own| &own.name).chain(plan.sweeps.iter().map(|own| &own.name));
    let (runs, others): (Vec<Branch>, Vec<Branch>) =
        diagram.branches.into_iter().partition(|branch| plan.designs.iter().any(|own| is_run(&branch.name, &own.name)));
    let mut diagram = branches_ordered(Diagram { branches: others, ..diagram }, &names(plan));
    for design in &plan.designs {
        diagram.branches.extend(runs.iter().filter(|branch| is_run(&branch.name, &design.name)).cloned());
    }
    let place = |name: &str| plan.designs.iter().position(|own| own.name == name).unwrap_or(usize::MAX);
    diagram.designs.sort_by_key(|own| place(&own.name));
    diagram.responses.sort_by_key(|set| simulated().position(|name| *name == set.name).unwrap_or(usize::MAX));
    diagram
}

fn branches_ordered(mut diagram: Diagram, study: &[String]) -> Diagram {
    let legs =
        |branch: &Branch| study.iter().enumerate().find_map(|(place, name)| Some((place, leg(&branch.name, name)?)));
    let parent = |branch: &Branch| match &branch.origin {
        Origin::Switch { parent, .. } if legs(branch).is_none() => Some(parent.clone()),
        _ => None,
    };
    // Findings of an exploration keep the order in which they were found.
    let found = |branch: &Branch| {
        let first = !matches!(branch.origin, Origin::Switch { .. });
        study.iter().position(|name| first && is_finding(&branch.name, name)).map(|place| (place, 0))
    };
    let rank = |branch: &Branch| {
        let own = study.iter().position(|name| *name == branch.name).map(|place| (place, 0));
        let (behind, parameter) = match branch.origin {
            Origin::Switch { .. } if branch.held.is_some() && legs(branch).is_none() => (true, f64::NEG_INFINITY),
            Origin::Switch { parameter, .. } => (false, parameter),
            _ => (false, f64::NEG_INFINITY),
        };
        (behind, own.or_else(|| legs(branch)).or_else(|| found(branch)).unwrap_or((usize::MAX, 0)), parameter)
    };
    let mut waiting = std::mem::take(&mut diagram.branches);
    waiting.sort_by(|a, b| {
        let ((c, p, x), (d, q, y)) = (rank(a), rank(b));
        let by_name = || if found(a).is_some() && found(b).is_some() { Ordering::Equal } else { a.name.cmp(&b.name) };
        (c, p).cmp(&(d, q)).then(x.total_cmp(&y)).then_with(by_name)
    });
    // A branch is listed once its parent is. The remaining branches have no parent in the diagram.
    while !waiting.is_empty() {
        let (mut children, others): (Vec<Branch>, Vec<Branch>) = match diagram.branches.last() {
            Some(_) => waiting.into_iter().partition(|b| parent(b).is_some_and(|p| diagram.branch(&p).is_some())),
            None => (Vec::new(), waiting),
        };
        waiting = others;
        if children.is_empty() {
            let next = waiting.iter().position(|b| parent(b).is_none_or(|p| waiting.iter().all(|w| w.name != p)));
            diagram.branches.push(waiting.remove(next.unwrap_or(0)));
            continue;
        }
        // Siblings follow their parent in order, each before its own children.
        for child in children.drain(..).rev() {
            let at = diagram.branches.iter().position(|b| Some(&b.name) == parent(&child).as_ref());
            diagram.branches.insert(at.map_or(diagram.branches.len(), |at| at + 1), child);
        }
    }
    diagram
}

#[cfg(test)]
mod tests {
    use super::*;
    use foldline::diagram::{Family, Kind, Responses, Search};

    fn from(parent: &str, name: &str, parameter: f64) -> Branch {
        let origin = Origin::Switch { parent: parent.into(), kind: Kind::PeriodDoubling, parameter };
        Branch::new(name, Family::Cycle, 0, origin)
    }

    #[test]
    fn children_follow_their_parent_by_parameter_in_any_order_of_computation() {
        let root = |name: &str| Branch::new(name, Family::Cycle, 0, Origin::Seed(String::new()));
        let expected = ["a", "a1", "a1x", "a2", "b", "b1"];
        let branches = [
            root("a"),
            from("a", "a1", 1.0),
            from("a1", "a1x", 5.0),
            from("a", "a2", 2.0),
            root("b"),
            from("b", "b1", 0.0),
        ];
        for shift in 0..branches.len() {
            let mut shuffled = branches.to_vec();
            shuffled.rotate_left(shift);
            shuffled.swap(0, 3);
            let sorted =
                branches_ordered(Diagram { branches: shuffled, ..Diagram::default() }, &["a".into(), "b".into()]);
            assert_eq!(sorted.branches.iter().map(|b| b.name.as_str()).collect::<Vec<_>>(), expected);
        }
    }

    #[test]
    fn curves_and_homotopy_runs_follow_the_branch_they_start_from() {
        let curve = |parent: &str, name: &str| Branch { held: Some((Kind::Fold, 1)), ..from(parent, name, 3.0) };
        let end_of = |parent: &str, name: &str| Branch::new(name, Family::Cycle, 0, Origin::EndOf(parent.into()));
        let root = |name: &str| Branch::new(name, Family::Cycle, 0, Origin::Seed(String::new()));
        let branches = [
            root("a"),
            from("a", "a/period-doubling-1", 2.0),
            curve("a", "folds"),
            root("way/1"),
            end_of("way/1", "way/2"),
            end_of("way/2", "way/3"),
            curve("way/1", "way/4"),
            end_of("way/9", "way/10"),
            end_of("way", "b"),
        ];
        let study = ["a", "way", "b", "folds"].map(String::from);
        for shift in 0..branches.len() {
            let mut shuffled = branches.to_vec();
            shuffled.rotate_left(shift);
            shuffled.swap(1, 4);
            let sorted = branches_ordered(Diagram { branches: shuffled, ..Diagram::default() }, &study);
            let names: Vec<&str> = sorted.branches.iter().map(|b| b.name.as_str()).collect();
            assert_eq!(names, branches.each_ref().map(|b| b.name.as_str()));
        }
    }

    #[test]
    fn findings_of_an_exploration_keep_their_order() {
        let root = |name: &str| Branch::new(name, Family::Cycle, 0, Origin::Seed(String::new()));
        let names = ["all/equilibrium-1", "all/equilibrium-1/hopf-1", "all/cycle-2", "all/3:1-1", "all/2:1-1"];
        let mut branches: Vec<Branch> = names.map(root).to_vec();
        branches[1] = from("all/equilibrium-1", "all/equilibrium-1/hopf-1", 1.0);
        let last = branches.remove(1);
        branches.push(last);
        let sorted = branches_ordered(Diagram { branches, ..Diagram::default() }, &["all".into()]);
        assert_eq!(sorted.branches.iter().map(|b| b.name.as_str()).collect::<Vec<_>>(), names);
    }

    #[test]
    fn surveys_and_sweeps_come_in_the_order_of_the_study() {
        let model = "[parameters]\np = 1\n[states]\nx = \"p - x\"\n";
        let search = |kind: &str, name: &str| format!("[[{kind}]]\nname = \"{name}\"\nfree = \"p\"\nvalues = [1, 2]\n");
        let from = "from = \"rest\"\n";
        let text = [
            "model = \"m.toml\"\n[[seed]]\nname = \"rest\"\nattractor = \"equilibrium\"\n".to_string(),
            search("survey", "wide") + "starts = 1\n",
            search("sweep", "up") + from,
            search("sweep", "down") + from,
        ];
        let plan = crate::study_file::parse_study(&text.concat(), "s.toml", model, "m.toml").unwrap().plan;
        let set = |name: &str| Responses { name: name.into(), search: Search::Sweep, free: 0, responses: Vec::new() };
        for names in [["up", "wide", "down"], ["down", "up", "wide"]] {
            let diagram = Diagram { responses: names.map(set).to_vec(), ..Diagram::default() };
            let sorted = ordered(diagram, &plan);
            assert_eq!(
                sorted.responses.iter().map(|set| set.name.as_str()).collect::<Vec<_>>(),
                ["wide", "up", "down"]
            );
        }
    }

    #[test]
    fn branches_that_are_parents_of_each_other_are_listed() {
        let diagram = Diagram { branches: vec![from("b", "a", 0.0), from("a", "b", 0.0)], ..Diagram::default() };
        assert_eq!(branches_ordered(diagram, &[]).branches.len(), 2);
    }
}
