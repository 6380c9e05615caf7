//! Which branch has ended at a special point of another one?
//!
//! **Idea.** A branch that is switched to at one special point often ends at the next one of the same branch and kind, and a
//! branch of doubled cycles that began elsewhere ends at the period doublings of the branch that it was never compared with.
//! Its last step leads there. Several special points may lie close to each other: the branch has ended at the nearest.

use super::{System, known};
use crate::diagram::{Branch, Ending, Kind, Origin, Point, SpecialPoint};

/// The name of the branch that has ended at this special point of `parent`, having come from another one of the same kind
/// or begun elsewhere.
pub(super) fn at<'b>(
    system: &System,
    tolerance: f64,
    branches: &'b [Branch],
    parent: &Branch,
    special: &SpecialPoint,
) -> Option<&'b str> {
    let met = |end: &Ending| match end {
        Ending::Joined { at, parameter } => *at == special.kind && meets(tolerance, parent, special, *parameter),
        _ => false,
    };
    let arrived = |branch: &&Branch| {
        let from_parent = matches!(&branch.origin, Origin::Switch { parent: own, .. } if *own == parent.name);
        match from_parent {
            true => branch.ends.iter().flatten().skip(1).any(met) && fits(branch, special),
            false => became(system, branch, special, &met),
        }
    };
    branches.iter().find(arrived).map(|branch| branch.name.as_str())
}

/// Whether what ended at that value of the parameter has met `parent` at this special point rather than at another one.
fn meets(tolerance: f64, parent: &Branch, special: &SpecialPoint, value: f64) -> bool {
    let off = |other: &SpecialPoint| (other.point.parameters[parent.free] - value).abs();
    let mut rivals = parent.special.iter().filter(|other| other.kind == special.kind);
    off(special) < 1e3 * tolerance * (1.0 + value.abs()) && rivals.all(|other| off(special) <= off(other))
}

/// Whether the period of a branch agrees with that of what is born there.
fn fits(branch: &Branch, special: &SpecialPoint) -> bool {
    let period = |point: &Point| point.solution.period();
    match (branch.points.last().and_then(period), period(&special.point)) {
        (Some(long), Some(short)) => (long / short - 2.0).abs() < 0.05 || special.kind != Kind::PeriodDoubling,
        _ => true,
    }
}

/// Whether a branch that began elsewhere has ended at this period doubling: its last step leads there.
fn became(system: &System, branch: &Branch, special: &SpecialPoint, met: &dyn Fn(&Ending) -> bool) -> bool {
    if special.kind != Kind::PeriodDoubling || branch.held.is_some() {
        return false;
    }
    let twice = known::lasting(&special.point, 2.0);
    let points = &branch.points;
    let edges = [points.first().zip(points.get(1)), points.last().zip(points.iter().nth_back(1))];
    branch.ends.iter().zip(edges).any(|(end, edge)| {
        let (Some(end), Some((last, before))) = (end, edge) else { return false };
        let close = 1e-3 + 1.5 * last.difference(before, &system.scales, &[]);
        met(end) && system.reflections.iter().any(|r| last.difference(&twice, &system.scales, r) < close)
    })
}
