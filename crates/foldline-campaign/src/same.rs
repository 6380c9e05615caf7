//! Are these the same special points?

use foldline::diagram::{Branch, SpecialPoint};

/// A special point of one list that the other lacks, or has elsewhere: a sentence each.
///
/// Two are the same if they are of one kind and differ in the parameter by no more than their stated errors together, and the
/// `slack` of the comparison, relative to 1 + |value|.
pub fn differences(base: &Branch, other: &Branch, slack: f64) -> Vec<String> {
    let free = base.free;
    let value = |special: &SpecialPoint| special.point.parameters.get(free).copied().unwrap_or(f64::NAN);
    let mut left: Vec<&SpecialPoint> = other.special.iter().collect();
    let mut lines = Vec::new();
    for special in &base.special {
        let apart = |candidate: &SpecialPoint| {
            let period = match (special.point.solution.period(), candidate.point.solution.period()) {
                (Some(a), Some(b)) => (a / b).ln().abs(),
                _ => 0.0,
            };
            (value(special) - value(candidate)).abs() / (1.0 + value(special).abs()) + period
        };
        let alike = |candidate: &&SpecialPoint| candidate.kind == special.kind;
        let nearest =
            (0..left.len()).filter(|i| alike(&left[*i])).min_by(|a, b| apart(left[*a]).total_cmp(&apart(left[*b])));
        let at = value(special);
        match nearest.map(|i| (i, left[i])) {
            None => lines.push(format!("{} {at:.9} is missing", special.kind)),
            Some((i, found)) => {
                let off = (value(found) - at).abs() / (1.0 + at.abs());
                let allowed = special.error + found.error + slack;
                if off > 1e3 * allowed {
                    lines.push(format!("{} {at:.9} is missing; the next is at {:.9}", special.kind, value(found)));
                    continue;
                }
                if off > allowed {
                    lines.push(format!(
                        "{} {at:.9} is at {:.9}: {off:.1e} off, {allowed:.1e} stated",
                        special.kind,
                        value(found)
                    ));
                }
                left.remove(i);
            }
        }
    }
    lines.extend(left.iter().map(|special| format!("{} {:.9} is new", special.kind, value(special))));
    lines
}
