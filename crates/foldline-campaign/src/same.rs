//! Are these the same special points?

use foldline::diagram::{Branch, SpecialPoint};

/// A special point of one list that the other lacks, or has elsewhere: a sentence each.
///
/// Two are the same if they are of one kind and differ in the parameter by no more than their stated errors together, and the
/// `slack` of the comparison, relative to the scale of the parameter + |value|. Special points that lie closer together than their errors cannot be told
/// apart, nor their order: of those, what is compared is where they are and what they do to stability together.
pub fn differences(base: &Branch, other: &Branch, slack: f64) -> Vec<String> {
    let free = base.free;
    let value = |special: &SpecialPoint| special.point.parameters.get(free).copied().unwrap_or(f64::NAN);
    let mut left: Vec<&SpecialPoint> = other.special.iter().collect();
    let together = |special: &SpecialPoint, list: &[SpecialPoint]| {
        let (own, others) = (net(base, special, &base.special), net(base, special, list));
        own.is_some() && own == others
    };
    let mut lines = Vec::new();
    for special in &base.special {
        let apart = |candidate: &SpecialPoint| {
            let period = match (special.point.solution.period(), candidate.point.solution.period()) {
                (Some(a), Some(b)) => (a / b).ln().abs(),
                _ => 0.0,
            };
            (value(special) - value(candidate)).abs() / base.size(value(special)) + period
        };
        let alike = |candidate: &&SpecialPoint| candidate.kind == special.kind;
        let nearest =
            (0..left.len()).filter(|i| alike(&left[*i])).min_by(|a, b| apart(left[*a]).total_cmp(&apart(left[*b])));
        let at = value(special);
        match nearest.map(|i| (i, left[i])) {
            None if together(special, &other.special) => {}
            None => lines.push(format!("{} {at:.9} is missing", special.kind)),
            Some((i, found)) => {
                let off = (value(found) - at).abs() / base.size(at);
                let allowed = special.error + found.error + slack;
                if off > 1e3 * allowed {
                    if together(special, &other.special) {
                        continue;
                    }
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
    left.retain(|special| !together(special, &other.special));
    lines.extend(left.iter().map(|special| format!("{} {:.9} is new", special.kind, value(special))));
    lines
}

/// What the special points of a list that cannot be told apart from `special` do together: the counts of unstable multipliers
/// on both sides, the smaller first; `None` where there is nothing.
fn net(base: &Branch, special: &SpecialPoint, list: &[SpecialPoint]) -> Option<[usize; 2]> {
    let value = |s: &SpecialPoint| s.point.parameters.get(base.free).copied().unwrap_or(f64::NAN);
    let period = |s: &SpecialPoint| s.point.solution.period().unwrap_or(1.0);
    let close = |other: &&SpecialPoint| {
        let error = special.error + other.error;
        let off = (value(special) - value(other)).abs() / base.size(value(special));
        off <= error && (period(special) / period(other)).ln().abs() <= 10.0 * error
    };
    let near: Vec<&SpecialPoint> = list.iter().filter(close).collect();
    let (first, last) = (near.first()?, near.last()?);
    let mut counts = [first.unstable_before, last.unstable_after];
    counts.sort_unstable();
    Some(counts)
}
