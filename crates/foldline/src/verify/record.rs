//! Verification of changes of stability.

use super::{Check, Quantity, Verified};
use crate::diagram::{Branch, Kind, Record};

/// Checks that the number of unstable multipliers changes along the branch only at special points, by as much as their
/// kind allows.
pub(super) fn verify(branch: &Branch) -> Verified {
    let mut out = Verified::default();
    let mut check = |position: i64, special: Option<Kind>, parameter: f64, found: usize| {
        let (branch, quantity) = (branch.name.clone(), Quantity::Record);
        let (stated, found) = (Some(0.0), found as f64);
        out.checks.push(Check { branch, position, special, parameter, quantity, stated, found });
    };
    let value = |parameters: &[f64]| parameters.get(branch.free).copied().unwrap_or(f64::NAN);
    for pair in branch.points.windows(2) {
        let [before, after] = [&pair[0], &pair[1]];
        let mut record = Record::at(before, true);
        for special in branch.special.iter().filter(|special| special.point.position == before.position) {
            let (at, misfit) = (value(&special.point.parameters), record.special(special));
            check(before.position, Some(special.kind), at, misfit.on_arrival);
            if misfit.of_change > 0 {
                check(before.position, Some(special.kind), at, misfit.of_change);
            }
        }
        let change = record.point(after).map_or(0, |count| count.abs_diff(after.unstable));
        check(before.position, None, value(&after.parameters), change);
    }
    out
}
