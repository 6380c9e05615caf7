//! Is every change of stability explained?

use super::{Check, Quantity, Verified};
use crate::diagram::{Branch, Kind};

/// Along the branch the number of unstable multipliers may change at special points only, by as much as their kind allows.
pub(super) fn verify(branch: &Branch) -> Verified {
    let mut out = Verified::default();
    let mut check = |position: i64, special: Option<Kind>, parameter: f64, found: usize, stated: f64| {
        let (branch, quantity) = (branch.name.clone(), Quantity::Record);
        out.checks.push(Check {
            branch,
            position,
            special,
            parameter,
            quantity,
            stated: Some(stated),
            found: found as f64,
        });
    };
    let value = |parameters: &[f64]| parameters.get(branch.free).copied().unwrap_or(f64::NAN);
    for pair in branch.points.windows(2) {
        let [before, after] = [&pair[0], &pair[1]];
        let mut count = before.unstable;
        for special in branch.special.iter().filter(|special| special.point.position == before.position) {
            check(
                before.position,
                Some(special.kind),
                value(&special.point.parameters),
                count.abs_diff(special.unstable_before),
                0.0,
            );
            let change = special.unstable_before.abs_diff(special.unstable_after);
            let (fits, own) = match special.kind {
                Kind::Fold | Kind::PeriodDoubling => (change == 1, 1),
                Kind::Hopf | Kind::Torus => (change == 2, 2),
                // At a pitchfork the count of the bifurcating branch does not change; at a multiple branch point it changes by up to the
                // dimension of the kernel.
                Kind::BranchPoint => (true, 0),
                _ => (true, 0),
            };
            if !fits {
                check(before.position, Some(special.kind), value(&special.point.parameters), change.abs_diff(own), 0.0);
            }
            count = special.unstable_after;
        }
        // At either end of a vertical branch a multiplier changes from 1.
        let family = before.is_one_of_family() != after.is_one_of_family();
        let allowed = if family { 1.0 } else { 0.0 };
        check(before.position, None, value(&after.parameters), count.abs_diff(after.unstable), allowed);
    }
    out
}
