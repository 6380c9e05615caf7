//! `[[branch]]`, `[[curve]]` and `[[homotopy]]`, read together in the order of the text, because each starts from
//! something defined above it.

use super::{branches, curves, homotopies, near, unique_name};
use crate::nearest::suggest;
use crate::toml_walk::Walk;
use foldline::diagram::Family;
use foldline::explore::{AttractorKey, BranchPlan, CurvePlan, HomotopyPlan, SeedPlan, SeedSource, Start};
use foldline::model::Model;
use std::ops::Range;
use toml::de::DeTable;

/// Branches, curves and homotopies of a study.
#[derive(Default)]
pub(super) struct Items {
    pub(super) branches: Vec<BranchPlan>,
    pub(super) curves: Vec<CurvePlan>,
    pub(super) homotopies: Vec<HomotopyPlan>,
}

/// Table of the text.
pub(super) struct Item<'v, 't> {
    /// "branch", "curve" or "homotopy".
    pub(super) what: &'static str,
    pub(super) span: Range<usize>,
    pub(super) table: &'v DeTable<'t>,
}

impl Item<'_, '_> {
    fn written_name(&self) -> Option<&str> {
        self.table.get("name").and_then(|name| name.get_ref().as_str())
    }
}

/// Item from which others can start, with what is known about it before anything is computed.
pub(super) struct Known {
    pub(super) name: String,
    /// Start of a plan that begins at this item.
    pub(super) start: Start,
    /// Values of all parameters at its beginning; `None` for a value that is not known beforehand.
    pub(super) beginning: Vec<Option<f64>>,
    /// Values of all parameters at its end, where a dependent item starts; `None` if its end is not unique.
    pub(super) end: Option<Vec<Option<f64>>>,
    /// Equilibria or cycles, if known.
    pub(super) family: Option<Family>,
}

/// Items read so far.
pub(super) struct Ground<'g> {
    pub(super) model: &'g Model,
    pub(super) known: Vec<Known>,
    pub(super) items: Items,
}

impl Ground<'_> {
    /// Returns the item of the given name among those read so far.
    pub(super) fn known(&self, name: &str) -> Option<&Known> {
        self.known.iter().find(|known| known.name == name)
    }
}

/// Reads every branch, curve and homotopy of the study.
pub(super) fn read<'g>(
    walk: &mut Walk,
    root: &DeTable,
    model: &'g Model,
    seeds: &[(Range<usize>, SeedPlan)],
) -> Ground<'g> {
    let mut all = Vec::new();
    for what in ["branch", "curve", "homotopy"] {
        all.extend(walk.tables(root, what).into_iter().map(|(span, table)| Item { what, span, table }));
    }
    all.sort_by_key(|item| item.span.start);
    if ["branch", "homotopy", "explore", "survey", "sweep", "map"]
        .iter()
        .all(|what| root.get(*what).is_none_or(|v| v.get_ref().as_array().is_some_and(|list| list.is_empty())))
    {
        walk.report(0..0, "the study has no branch", "add `[[branch]]` with name, from, free and range");
    }
    let known = seeds.iter().enumerate().map(|(index, (_, seed))| known_seed(index, seed)).collect();
    let mut ground = Ground { model, known, items: Items::default() };
    let mut taken: Vec<String> = seeds.iter().map(|(_, seed)| seed.name.clone()).collect();
    for item in &all {
        let names: Vec<&str> = taken.iter().map(String::as_str).collect();
        let name = unique_name(walk, item.table, &item.span, item.what, &names);
        taken.extend(name.clone());
        let known = match item.what {
            "branch" => branches::read(walk, item, name, &mut ground, &all),
            "curve" => curves::read(walk, item, name, &mut ground, &all),
            _ => homotopies::read(walk, item, name, &mut ground, &all),
        };
        ground.known.extend(known);
    }
    refuse_names_of_others(walk, &all);
    ground
}

fn known_seed(index: usize, seed: &SeedPlan) -> Known {
    let at: Vec<Option<f64>> = seed.parameters.iter().map(|v| Some(*v)).collect();
    let family = match &seed.source {
        SeedSource::Attractor(AttractorKey::Equilibrium) => Some(Family::Equilibrium),
        SeedSource::Attractor(AttractorKey::Cycle | AttractorKey::Ratio(..) | AttractorKey::Lasting(_))
        | SeedSource::Cycle(_)
        | SeedSource::Besides(..) => Some(Family::Cycle),
        SeedSource::Torus(_) | SeedSource::QuasiPeriodic => Some(Family::Torus),
        SeedSource::State(_) => None,
    };
    Known { name: seed.name.clone(), start: Start::Seed(index), beginning: at.clone(), end: Some(at), family }
}

/// Returns the word for an item from which others start.
pub(super) fn noun(start: &Start) -> &'static str {
    match start {
        Start::Seed(_) => "seed",
        Start::EndOf(_) | Start::EndOfSwitched(..) | Start::Near(_) => "branch",
        Start::EndOfCurve(_) => "curve",
        Start::EndOfHomotopy(_) => "homotopy",
    }
}

/// Reads the start of an item. Returns the start, the known parameter values there, and the family if it is known.
pub(super) fn origin(
    walk: &mut Walk,
    item: &Item,
    ground: &Ground,
    all: &[Item],
) -> Option<(Start, Vec<Option<f64>>, Option<Family>)> {
    let what = item.what;
    let Some(value) = item.table.get("from") else {
        let message = format!("this {what} has no `from`, its start");
        walk.report(item.span.clone(), message, "add `from = \"name of a seed, branch, curve or homotopy\"`");
        return None;
    };
    if value.get_ref().is_table() {
        return near::read(walk, item, value, ground, all).map(|(near, at, family)| (Start::Near(near), at, family));
    }
    let from = walk.string(value, "`from`")?;
    if let Some(known) = ground.known(&from) {
        if known.end.is_none() {
            let message = format!("the curve \"{from}\" has no `until`, so nothing can start at its end");
            walk.report(value.span(), message, "add `until` to the curve, a value of its second parameter");
        }
        return known.end.clone().map(|end| (known.start.clone(), end, known.family));
    }
    if let Some(other) = written(all, &from) {
        said_or_further_down(walk, value.span(), item, other, &from);
        return None;
    }
    // A switched branch. All parameter values at its end are known except that of its free parameter.
    let parent = from.match_indices('/').rev().find_map(|(end, _)| Some((ground.known(&from[..end])?, &from[end..])));
    if let Some((known, steps)) = parent
        && let Start::EndOf(index) = known.start
    {
        let found = curves::switched(walk, value, curves::of_branch(ground, known, index), known, steps)?;
        let mut at = found.beginning;
        at[found.plan.free] = None;
        return Some((Start::EndOfSwitched(index, from.to_string()), at, found.family));
    }
    let names: Vec<&str> = ground.known.iter().map(|known| known.name.as_str()).collect();
    let message = format!("there is no seed, branch, curve or homotopy \"{from}\"");
    walk.report(value.span(), message, suggest(&from, &names));
    None
}

/// Reports a reference to an item defined further down. An item further up is unknown only because of a mistake that
/// has been reported already.
pub(super) fn said_or_further_down(walk: &mut Walk, at: Range<usize>, item: &Item, other: &Item, name: &str) {
    if other.span.start >= item.span.start {
        let message = format!("the {} \"{name}\" is defined further down", other.what);
        let right = match item.what {
            "curve" => "move the curve below the branch on which its special point lies".to_string(),
            what => format!("start the {what} from a seed, or from something defined above it"),
        };
        walk.report(at, message, right);
    }
}

/// Returns the item of the given name, wherever it is defined.
pub(super) fn written<'a, 'v, 't>(all: &'a [Item<'v, 't>], name: &str) -> Option<&'a Item<'v, 't>> {
    all.iter().find(|other| other.written_name() == Some(name))
}

/// Rejects names reserved for the parts of another item.
fn refuse_names_of_others(walk: &mut Walk, all: &[Item]) {
    for item in all {
        let Some((name, value)) = item.written_name().zip(item.table.get("name")) else { continue };
        for other in all {
            let rest = other.written_name().and_then(|short| name.strip_prefix(short)?.strip_prefix('/'));
            let Some(rest) = rest else { continue };
            let taken = match other.what {
                "branch" => rest.split('/').all(|step| branches::switch_step(step).is_some()),
                "homotopy" => rest.parse::<usize>().is_ok(),
                _ => false,
            };
            if taken {
                let whose = &name[..name.len() - rest.len() - 1];
                let message = format!("the name \"{name}\" is reserved for a part of the {} \"{whose}\"", other.what);
                walk.report(value.span(), message, "choose another name");
            }
        }
    }
}

/// Reads the limit on the number of points.
pub(super) fn max_points(walk: &mut Walk, item: &Item) -> usize {
    const DEFAULT: usize = 10_000;
    let limit = item.table.get("max-points").and_then(|v| walk.integer(v, "`max-points`", 1..=100_000_000));
    limit.map_or(DEFAULT, |points| points as usize)
}
