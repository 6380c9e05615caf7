//! Unexplained changes of stability along a branch.

use foldline::diagram::{Branch, Ending, Kind};

/// Returns the changes of the number of unstable eigenvalues or multipliers that no special point explains, one line
/// each: points of kind `unexplained`, numbers that differ from one point to the next, and a closed branch whose first
/// and last number differ.
pub fn unexplained(branch: &Branch) -> Vec<String> {
    let value = |point: &foldline::diagram::Point| point.parameters.get(branch.free).copied().unwrap_or(f64::NAN);
    let stated = branch.special.iter().filter(|s| s.kind == Kind::Unexplained);
    let mut lines: Vec<String> = stated.map(|special| format!("{:.9}", value(&special.point))).collect();
    for pair in branch.points.windows(2) {
        let between = branch.special.iter().filter(|s| s.point.position == pair[0].position);
        let mut now = pair[0].unstable;
        for special in between {
            if special.unstable_before != now {
                lines.push(format!("before {}", value(&special.point)));
            }
            now = special.unstable_after;
        }
        if now != pair[1].unstable {
            lines.push(format!("silently at {}", value(&pair[1])));
        }
    }
    if let [first, .., last] = &branch.points[..]
        && branch.ends.iter().all(|end| *end == Some(Ending::Closed))
        && first.unstable != last.unstable
    {
        lines.push(format!("on closing at {}", value(last)));
    }
    lines
}

/// Returns the special points at which the number of unstable eigenvalues or multipliers changes in a way that does not
/// fit their kind, one line each. Folds and period doublings change it by one, Hopf and torus points by pairs, marks
/// not at all. At the grazing of an impact multipliers jump.
pub fn misfits(branch: &Branch) -> Vec<String> {
    let fits = |kind: Kind, change: usize| match kind {
        Kind::Fold | Kind::PeriodDoubling => change == 1,
        Kind::Hopf | Kind::Torus => change >= 2 && change.is_multiple_of(2),
        // In contact, a multiplier that was 1 along a vertical branch is on one side.
        Kind::Grazing => change <= 1,
        Kind::Mark | Kind::Peak | Kind::Sliding => change == 0,
        _ => true,
    };
    let wrong = branch.special.iter().filter(|s| !fits(s.kind, s.unstable_before.abs_diff(s.unstable_after)));
    wrong
        .map(|s| {
            let value = s.point.parameters.get(branch.free).copied().unwrap_or(f64::NAN);
            format!("{} {}→{} at {value}", s.kind, s.unstable_before, s.unstable_after)
        })
        .collect()
}
