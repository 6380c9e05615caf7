//! Comparison of the special points of two runs.

use foldline::diagram::{Branch, SpecialPoint};

/// Returns one line per special point that one branch lacks or has at another parameter.
///
/// Two special points match if they are of one kind and their parameters differ by at most the sum of their stated
/// errors and `slack`, relative to the scale of the parameter + |value|. Special points closer together than their
/// errors cannot be distinguished, nor can their order. Of such a cluster, position and joint effect on stability are
/// compared.
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

/// Joint effect on stability of the special points in a list that cannot be distinguished from `special`: the numbers
/// of unstable eigenvalues or multipliers on both sides, the smaller first; `None` if there is no such point.
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
