//! Known branches that end at a special point of another branch.
//!
//! **Idea.** A branch switched to at one special point often ends at the next special point of the same kind on its
//! parent. A branch of doubled cycles that began elsewhere ends at period doublings of a branch with which it was never
//! compared; its last step leads there. If several special points lie close together, the branch has ended at the
//! nearest.

use super::{System, known};
use crate::diagram::{Branch, Ending, Kind, Origin, Point, SpecialPoint};

/// Name of the branch that has ended at this special point of `parent`: one switched to at another special point of the
/// same kind, or one that began elsewhere.
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
            true => branch.ends.iter().flatten().skip(1).any(met) && period_fits(branch, special),
            false => ends_in_doubling(system, branch, special, &met),
        }
    };
    branches.iter().find(arrived).map(|branch| branch.name.as_str())
}

/// True if a branch that ended at the parameter value `value` met `parent` at this special point rather than at
/// another.
fn meets(tolerance: f64, parent: &Branch, special: &SpecialPoint, value: f64) -> bool {
    let off = |other: &SpecialPoint| (other.point.parameters[parent.free] - value).abs();
    let mut rivals = parent.special.iter().filter(|other| other.kind == special.kind);
    off(special) < 1e3 * tolerance * parent.size(value) && rivals.all(|other| off(special) <= off(other))
}

/// True if the period of a branch agrees with that of the solutions born at the special point.
fn period_fits(branch: &Branch, special: &SpecialPoint) -> bool {
    let period = |point: &Point| point.solution.period();
    match (branch.points.last().and_then(period), period(&special.point)) {
        (Some(long), Some(short)) => (long / short - 2.0).abs() < 0.05 || special.kind != Kind::PeriodDoubling,
        _ => true,
    }
}

/// True if a branch that began elsewhere has ended at this period doubling, that is, if its last step leads there.
fn ends_in_doubling(system: &System, branch: &Branch, special: &SpecialPoint, met: &dyn Fn(&Ending) -> bool) -> bool {
    if special.kind != Kind::PeriodDoubling || branch.held.is_some() {
        return false;
    }
    let twice = known::lasting(&special.point, 2.0);
    let points = &branch.points;
    let edges = [points.first().zip(points.get(1)), points.last().zip(points.iter().nth_back(1))];
    branch.ends.iter().zip(edges).any(|(end, edge)| {
        let (Some(end), Some((last, before))) = (end, edge) else { return false };
        let close = 1e-3 + 1.5 * last.distance(before, system.measure());
        met(end) && system.symmetries.iter().any(|r| last.difference(&twice, system.measure(), r) < close)
    })
}
