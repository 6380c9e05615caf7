//! Pairs of extrema of a periodic function at two points of a branch.
//!
//! **Idea.** Maxima and minima alternate around the period. Extrema that exist at one of the points only come as a
//! maximum and the next minimum on the same side of zero, and are left out so that the rest agrees best. Of the shifts
//! by whole pairs the one is taken for which times and values differ least.

use super::Extremum;

/// Extrema without those that differ from the next one by no more than `rounding`, so that maxima and minima alternate.
pub(super) fn alternating(mut all: Vec<Extremum>, rounding: f64) -> Vec<Extremum> {
    loop {
        let count = all.len();
        let next = |k: usize| (k + 1) % count;
        let same = |k: usize| all[k].maximum == all[next(k)].maximum;
        let level = |k: usize| (all[k].value - all[next(k)].value).abs() <= rounding;
        let Some(k) = (0..count).find(|k| count > 1 && (same(*k) || level(*k))) else { return all };
        let (one, other) = (k.min(next(k)), k.max(next(k)));
        if same(k) {
            let higher = all[one].value > all[other].value;
            all.remove(if higher == all[one].maximum { other } else { one });
        } else {
            all.remove(other);
            all.remove(one);
        }
    }
}

/// Index pairs of the extrema of `a` and `b`, which have values up to `size`; `None` if the extrema do not alternate or
/// no choice of pairs agrees.
pub(super) fn matched(a: &[Extremum], b: &[Extremum], size: f64) -> Option<Vec<[usize; 2]>> {
    let alternates = |all: &[Extremum]| {
        all.len().is_multiple_of(2) && (0..all.len()).all(|k| all[k].maximum != all[(k + 1) % all.len()].maximum)
    };
    if !alternates(a) || !alternates(b) || size <= 0.0 {
        return None;
    }
    if a.len() > b.len() {
        let mut swapped = matched(b, a, size)?;
        swapped.iter_mut().for_each(|pair| pair.reverse());
        return Some(swapped);
    }
    let mut kept: Vec<usize> = (0..b.len()).collect();
    while kept.len() > a.len() {
        let count = kept.len();
        let without = |k: usize| -> Option<Vec<usize>> {
            let (one, other) = (kept[k], kept[(k + 1) % count]);
            if (b[one].value > 0.0) != (b[other].value > 0.0) {
                return None;
            }
            Some(kept.iter().copied().filter(|own| *own != one && *own != other).collect())
        };
        // With several pairs to leave out, the smallest is left out first.
        let cost = |rest: &Vec<usize>, k: usize| match rest.len() == a.len() {
            true => best(a, b, rest, size).map_or(f64::INFINITY, |(cost, _)| cost),
            false => (b[kept[k]].value - b[kept[(k + 1) % count]].value).abs(),
        };
        let choices = (0..count).filter_map(|k| without(k).map(|rest| (cost(&rest, k), rest)));
        kept = choices.min_by(|x, y| x.0.total_cmp(&y.0))?.1;
    }
    if a.is_empty() {
        return Some(Vec::new());
    }
    best(a, b, &kept, size).map(|(_, shift)| (0..a.len()).map(|k| [k, kept[(k + shift) % kept.len()]]).collect())
}

/// The shift of `kept` for which it agrees best with `a`, and the sum of the squared differences.
fn best(a: &[Extremum], b: &[Extremum], kept: &[usize], size: f64) -> Option<(f64, usize)> {
    let apart = |x: &Extremum, y: &Extremum| {
        let time = y.time - x.time;
        (time - time.round()).powi(2) + ((y.value - x.value) / size).powi(2)
    };
    let cost = |shift: usize| (0..a.len()).map(|k| apart(&a[k], &b[kept[(k + shift) % kept.len()]])).sum::<f64>();
    let fits = |shift: &usize| a.first().is_none_or(|first| first.maximum == b[kept[*shift]].maximum);
    (0..kept.len()).filter(fits).map(|shift| (cost(shift), shift)).min_by(|x, y| x.0.total_cmp(&y.0))
}

/// Share of the way at which a value that has one sign at both ends may have the other in between: the extremum of the
/// cubic with the given slopes. `None` if the cubic stays clear of zero.
pub(super) fn closest(from: f64, to: f64, slopes: impl FnOnce() -> [f64; 2]) -> Option<f64> {
    /// Extremum, as a share of the smaller end value, below which the cubic is no longer clear of zero.
    const NEAR: f64 = 0.2;
    if from * to <= 0.0 {
        return None;
    }
    let [first, last] = slopes();
    if !(first * from < 0.0 && last * to > 0.0) {
        return None;
    }
    const PLACES: usize = 64;
    let rise = to - from;
    let at = |x: f64| from + x * (first + x * (3.0 * rise - 2.0 * first - last + x * (first + last - 2.0 * rise)));
    let (x, least) = (1..PLACES)
        .map(|k| k as f64 / PLACES as f64)
        .map(|x| (x, at(x) * from.signum()))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    (least < NEAR * from.abs().min(to.abs())).then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn extrema(all: &[(f64, f64)]) -> Vec<Extremum> {
        let maximum = |k: usize| all[k].1 > all[(k + 1) % all.len()].1;
        all.iter()
            .enumerate()
            .map(|(k, (time, value))| Extremum { time: *time, value: *value, maximum: maximum(k), at_event: false })
            .collect()
    }

    #[test]
    fn extrema_are_paired_across_the_end_of_the_period_and_without_new_ones() {
        let a = extrema(&[(0.05, 1.0), (0.3, -1.0), (0.6, 0.02), (0.8, -0.5)]);
        // Shifted beyond the end of the period; the second maximum has sunk.
        let b = extrema(&[(0.28, -1.0), (0.58, -0.01), (0.78, -0.5), (0.99, 1.0)]);
        assert_eq!(matched(&a, &b, 1.0).unwrap(), [[0, 3], [1, 0], [2, 1], [3, 2]]);
        // A new maximum and minimum below zero.
        let c = extrema(&[(0.28, -1.0), (0.4, -0.8), (0.45, -0.85), (0.58, -0.01), (0.78, -0.5), (0.99, 1.0)]);
        assert_eq!(matched(&a, &c, 1.0).unwrap(), [[0, 5], [1, 0], [2, 3], [3, 4]]);
        assert_eq!(matched(&c, &a, 1.0).unwrap().len(), 4);
        // One contact ends while another begins.
        let d = extrema(&[(0.05, -0.02), (0.3, -1.0), (0.6, 0.02), (0.8, -0.5)]);
        let e = extrema(&[(0.05, 0.02), (0.3, -1.0), (0.6, -0.02), (0.8, -0.5)]);
        let changed = |pair: &&[usize; 2]| (d[pair[0]].value > 0.0) != (e[pair[1]].value > 0.0);
        assert_eq!(matched(&d, &e, 1.0).unwrap().iter().filter(changed).count(), 2);
        assert!(matched(&a, &extrema(&[(0.1, 1.0), (0.5, 0.5)]), 1.0).is_none(), "nothing agrees in sign");
    }

    #[test]
    fn extrema_of_rounding_are_left_out() {
        let mut all = extrema(&[(0.1, 1.0), (0.2, -1.0), (0.5, 0.0), (0.51, -1e-15), (0.52, 1e-15), (0.8, -0.5)]);
        all.insert(1, Extremum { time: 0.15, value: 0.5, maximum: true, at_event: false });
        let times: Vec<f64> = alternating(all, 1e-11).iter().map(|e| e.time).collect();
        assert_eq!(times, [0.1, 0.2, 0.52, 0.8]);
    }

    #[test]
    fn a_value_that_dips_below_zero_shows_in_its_slopes() {
        // (x - 0.4)² - c.
        let seen = |c: f64| closest(0.16 - c, 0.36 - c, || [-0.8, 1.2]);
        assert!((seen(0.01).unwrap() - 0.4).abs() < 0.02 && seen(-0.2).is_none());
    }
}
