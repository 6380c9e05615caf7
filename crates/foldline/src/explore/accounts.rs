//! What is said of counts of unstable eigenvalues that do not fit the record of a branch.

use super::growth::Growth;
use crate::contract::Event;
use crate::diagram::{Branch, Misfit, Point, SpecialPoint};

/// What to do where the counts of unstable eigenvalues do not fit.
const CLOSER: &str =
    "what to do: a smaller tolerance; `foldline verify` looks at the points on both sides by another route";

impl Growth<'_> {
    /// Says what does not fit at a special point.
    pub(super) fn fits(&self, branch: &Branch, special: &SpecialPoint, misfit: &Misfit) -> bool {
        let SpecialPoint { kind, unstable_before: before, unstable_after: after, .. } = special;
        let at = special.point.parameters.get(branch.free).copied().unwrap_or(f64::NAN);
        let said = match misfit {
            Misfit { on_arrival: 0, of_change: 0 } => return true,
            Misfit { on_arrival: 0, .. } => {
                format!(
                    "the count of unstable eigenvalues goes from {before} to {after} at the {kind} at {at:.9}, which its kind does not explain"
                )
            }
            _ => format!(
                "the count of unstable eigenvalues at the {kind} at {at:.9} is not that of the points beside it"
            ),
        };
        self.tell(Event::Short(&branch.name, &format!("{said}\n{CLOSER}")))
    }

    /// Says that the count of unstable eigenvalues or multipliers has changed on the way to a point, and nothing was found that does it.
    pub(super) fn unexplained(&self, branch: &Branch, before: usize, point: &Point) -> bool {
        let after = point.unstable;
        let at = point.parameters.get(branch.free).copied().unwrap_or(f64::NAN);
        let said = format!(
            "the count of unstable eigenvalues goes from {before} to {after} next to {at:.9}, and no special point was found there"
        );
        self.tell(Event::Short(&branch.name, &format!("{said}\n{CLOSER}")))
    }
}
