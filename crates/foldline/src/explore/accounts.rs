//! Messages about inconsistent numbers of unstable eigenvalues or multipliers along a branch.

use super::growth::Growth;
use crate::contract::Event;
use crate::diagram::{Branch, Family, Misfit, Point, Shown, SpecialPoint};

/// Advice where a number is inconsistent.
const CLOSER: &str =
    "what to do: use a smaller tolerance; `foldline verify` checks the points on both sides by another method";

impl Growth<'_> {
    /// Reports a special point that is inconsistent with the record. Returns false if the observer wants to stop.
    pub(super) fn fits(&self, branch: &Branch, special: &SpecialPoint, misfit: &Misfit) -> bool {
        let SpecialPoint { kind, unstable_before: before, unstable_after: after, .. } = special;
        let (what, at) = (counted(branch), value(branch, &special.point));
        let said = match misfit {
            Misfit { on_arrival: 0, of_change: 0 } => return true,
            Misfit { on_arrival: 0, .. } => {
                format!(
                    "the number of unstable {what} changes from {before} to {after} at the {kind} at {at}, \
                     which a point of this kind does not explain"
                )
            }
            _ => format!(
                "the number of unstable {what} at the {kind} at {at} does not match the neighbouring \
                          points"
            ),
        };
        self.tell(Event::Short(&branch.name, &format!("{said}\n{CLOSER}")))
    }

    /// Reports a change in the number of unstable eigenvalues or multipliers that no special point explains. Returns
    /// false if the observer wants to stop.
    pub(super) fn unexplained(&self, branch: &Branch, before: usize, point: &Point) -> bool {
        let (what, at, after) = (counted(branch), value(branch, point), point.unstable);
        let said = format!(
            "the number of unstable {what} changes from {before} to {after} near {at}, but no special point was \
             found there"
        );
        self.tell(Event::Short(&branch.name, &format!("{said}\n{CLOSER}")))
    }
}

fn counted(branch: &Branch) -> &'static str {
    if branch.family == Family::Cycle { "multipliers" } else { "eigenvalues" }
}

fn value(branch: &Branch, point: &Point) -> Shown {
    Shown(branch.rounded(point.parameters.get(branch.free).copied().unwrap_or(f64::NAN)))
}
