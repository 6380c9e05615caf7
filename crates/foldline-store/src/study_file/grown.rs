//! Comparison of a study with an earlier version of it.
//!
//! **Idea.** A run may go on with a longer study if every result computed so far would stay the same: the requests of
//! the earlier study come first and are unchanged, except that branches may be switched at further special points.

use super::Study;
use foldline::diagram::Kind;
use foldline::explore::{BranchPlan, Plan, Question, Switching};

/// Requests that a study has beyond those of an earlier one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Added {
    /// Names of branches, curves, homotopies, explorations, surveys, sweeps, design questions and maps.
    pub items: Vec<String>,
    /// Further switching: the name of the parent branch, the kind of the special points, and the number of one of them
    /// if not all are meant.
    pub switched: Vec<(String, Kind, Option<usize>)>,
}

/// Returns what `new` requests beyond `old`.
///
/// # Errors
/// A sentence that names a request of `old` that is missing or different.
pub fn added(old: &Study, new: &Study) -> Result<Added, String> {
    let (a, b) = (&old.plan, &new.plan);
    if a.tolerance != b.tolerance || a.degree != b.degree {
        return Err("its tolerance or degree is different".into());
    }
    if a.limits != b.limits || a.simulation != b.simulation {
        return Err("its limits on trajectories are different".into());
    }
    if old.store != new.store {
        return Err("`store` is different".into());
    }
    let mut found = Added::default();
    first("seed", &a.seeds, &b.seeds, |own| &own.name, |x, y| x == y)?;
    let branch = |x: &BranchPlan, y: &BranchPlan| {
        *x == BranchPlan { switching: x.switching.clone(), ..y.clone() } && reaches(&x.switching, &y.switching)
    };
    let more = [
        first("branch", &a.branches, &b.branches, |own| &own.name, branch)?,
        first("curve", &a.curves, &b.curves, |own| &own.name, |x, y| x == y)?,
        first("homotopy", &a.homotopies, &b.homotopies, |own| &own.name, |x, y| x == y)?,
        first("exploration", &a.explorations, &b.explorations, |own| &own.name, |x, y| x == y)?,
        first("survey", &a.surveys, &b.surveys, |own| &own.name, |x, y| x == y)?,
        first("sweep", &a.sweeps, &b.sweeps, |own| &own.name, |x, y| x == y)?,
        first("design question", &a.designs, &b.designs, |own| &own.name, |x, y| x == y)?,
    ];
    let maps = first("map", &a.maps, &b.maps, |own| &own.name, |x, y| x == y)?;
    found.items = [more.concat(), maps.clone()].concat();
    for (x, y) in a.branches.iter().zip(&b.branches) {
        found.switched.extend(further(&x.switching, &y.switching).map(|(kind, n)| (x.name.clone(), kind, n)));
    }
    // The answers in the cells of such a map are about all branches.
    let of_branches = a.maps.iter().find(|own| own.question == Question::Points);
    if let Some(map) = of_branches.filter(|_| found.items.len() > maps.len() || !found.switched.is_empty()) {
        return Err(format!(
            "the map \"{}\" shows the special points of all branches, of which there are more",
            map.name
        ));
    }
    Ok(found)
}

/// Names of the items that `new` has after those of `old`, which must come first.
fn first<T>(
    what: &str,
    old: &[T],
    new: &[T],
    name: impl Fn(&T) -> &String,
    same: impl Fn(&T, &T) -> bool,
) -> Result<Vec<String>, String> {
    for (k, own) in old.iter().enumerate() {
        let here = new.get(k).filter(|other| name(other) == name(own));
        match here {
            Some(other) if same(own, other) => {}
            Some(_) => return Err(format!("the {what} \"{}\" is different", name(own))),
            None if new.iter().any(|other| name(other) == name(own)) => {
                return Err(format!("the {what} \"{}\" is in another place; new ones come last", name(own)));
            }
            None => return Err(format!("the {what} \"{}\" is missing", name(own))),
        }
    }
    Ok(new[old.len()..].iter().map(|own| name(own).clone()).collect())
}

/// Kinds and single points that at least one of the two names.
fn named(a: &Switching, b: &Switching) -> Vec<(Kind, Option<usize>)> {
    let kinds = a.depth.iter().chain(&b.depth).map(|(kind, _)| (*kind, None));
    let points = a.only.iter().chain(&b.only).map(|(kind, number, _)| (*kind, Some(*number)));
    let mut all: Vec<_> = kinds.chain(points).collect();
    all.sort_by_key(|(kind, number)| (kind.name(), *number));
    all.dedup();
    all
}

fn depth(switching: &Switching, (kind, number): (Kind, Option<usize>)) -> usize {
    number.map_or_else(|| switching.at(kind), |number| switching.at_point(kind, number))
}

fn reaches(old: &Switching, new: &Switching) -> bool {
    named(old, new).into_iter().all(|at| depth(new, at) >= depth(old, at))
}

fn further(old: &Switching, new: &Switching) -> impl Iterator<Item = (Kind, Option<usize>)> {
    let (old, new) = (old.clone(), new.clone());
    named(&old, &new).into_iter().filter(move |at| depth(&new, *at) > depth(&old, *at))
}

impl Added {
    /// True if a branch, survey or sweep of that name in a run belongs to these requests.
    pub fn has(&self, name: &str, plan: &Plan) -> bool {
        let below = |whole: &str| name == whole || name.strip_prefix(whole).is_some_and(|rest| rest.starts_with('/'));
        if self.items.iter().any(|item| below(item)) {
            return true;
        }
        self.switched.iter().any(|(parent, kind, number)| {
            let Some(rest) = name.strip_prefix(parent.as_str()).and_then(|rest| rest.strip_prefix('/')) else {
                return false;
            };
            let before = plan.branches.iter().find(|own| own.name == *parent).map(|own| &own.switching);
            let steps: Vec<&str> = rest.split('/').collect();
            !before.is_some_and(|before| leads(before, &steps)) && is_step(steps[0], *kind, *number)
        })
    }
}

/// True if a step such as `period-doubling-2`, or `branch-point-1-3` for the third of several branches, is one at points
/// of that kind and number.
fn is_step(step: &str, kind: Kind, number: Option<usize>) -> bool {
    let rest = step.strip_prefix(kind.name()).and_then(|rest| rest.strip_prefix('-'));
    let first = rest.and_then(|rest| rest.split('-').next()).and_then(|first| first.parse::<usize>().ok());
    first.is_some_and(|first| number.is_none_or(|number| number == first))
}

/// True if branch switching leads from step to step.
fn leads(switching: &Switching, steps: &[&str]) -> bool {
    let mut now = switching.clone();
    steps.iter().all(|step| {
        let at = Kind::ALL.into_iter().find_map(|kind| {
            let rest = step.strip_prefix(kind.name())?.strip_prefix('-')?;
            Some((kind, rest.split('-').next()?.parse::<usize>().ok()?))
        });
        let Some((kind, number)) = at else { return false };
        let goes = now.at_point(kind, number) > 0;
        now = now.below(kind, number);
        goes
    })
}
