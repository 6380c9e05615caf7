//! Order in which the points of a growing run were first seen.
//!
//! **Idea.** The file says which positions each branch has. Positions that are new since the last check are appended to
//! a list of stretches, and the index of a point in this list is its cursor: a client that has N points asks for those
//! from N on. If anything was removed, as when a run is resumed, the list starts again in a new *epoch*.

use foldline_store::run_file::Span;
use std::collections::HashMap;

/// Largest number of points in one answer.
pub(crate) const ROWS: u64 = 20_000;
/// Largest number of points in one answer that needs their profiles, usually a hundred times as many bytes.
pub(crate) const PROFILES: u64 = 500;

/// Stretches of points in the order in which they were seen.
#[derive(Debug, Default)]
pub(crate) struct Log {
    restarts: u64,
    stretches: Vec<Stretch>,
    /// Range of positions of each branch that is in the list.
    reach: HashMap<i64, [i64; 2]>,
}

/// Consecutive positions of a branch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch {
    /// Cursor of the first point.
    first: u64,
    /// Number of the branch.
    pub(crate) branch: i64,
    /// First and last position.
    pub(crate) reach: [i64; 2],
}

impl Stretch {
    pub(crate) fn points(&self) -> u64 {
        (self.reach[1] - self.reach[0] + 1).max(0) as u64
    }
}

impl Log {
    /// Begins a new epoch without points.
    pub(crate) fn restart(&mut self) {
        self.restarts += 1;
        self.stretches.clear();
        self.reach.clear();
    }

    /// Number of times that the log has begun.
    pub(crate) fn epoch(&self) -> u64 {
        self.restarts + 1
    }

    /// Number of points, the cursor after the last.
    pub(crate) fn points(&self) -> u64 {
        self.stretches.last().map_or(0, |stretch| stretch.first + stretch.points())
    }

    /// Appends new points. If points have disappeared, begins a new epoch.
    pub(crate) fn grow(&mut self, spans: &[Span]) {
        let kept = |(branch, [low, high]): (&i64, &[i64; 2])| {
            let reach = spans.iter().find(|span| span.number == *branch).and_then(|span| span.reach);
            reach.is_some_and(|[first, last]| first <= *low && last >= *high)
        };
        if !self.reach.iter().all(kept) {
            self.restart();
        }
        for (branch, [first, last]) in spans.iter().filter_map(|span| Some((span.number, span.reach?))) {
            let parts = match self.reach.insert(branch, [first, last]) {
                None => vec![[first, last]],
                Some([low, high]) => vec![[first, low - 1], [high + 1, last]],
            };
            for reach in parts.into_iter().filter(|[from, to]| from <= to) {
                self.stretches.push(Stretch { first: self.points(), branch, reach });
            }
        }
    }

    /// Stretches from a cursor on, at most `most` points in all.
    pub(crate) fn since(&self, cursor: u64, most: u64) -> Vec<Stretch> {
        let (mut found, mut left) = (Vec::new(), most);
        let from = self.stretches.partition_point(|stretch| stretch.first + stretch.points() <= cursor);
        for stretch in &self.stretches[from..] {
            let skipped = cursor.saturating_sub(stretch.first) as i64;
            let low = stretch.reach[0] + skipped;
            let high = stretch.reach[1].min(low + left as i64 - 1);
            if left == 0 {
                break;
            }
            left -= (high - low + 1) as u64;
            found.push(Stretch { reach: [low, high], ..*stretch });
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(number: i64, reach: [i64; 2]) -> Span {
        Span { number, name: number.to_string(), reach: Some(reach) }
    }

    fn positions(stretches: &[Stretch]) -> Vec<(i64, i64)> {
        stretches.iter().flat_map(|own| (own.reach[0]..=own.reach[1]).map(|position| (own.branch, position))).collect()
    }

    #[test]
    fn branches_that_grow_at_both_ends_are_passed_on_once() {
        let mut log = Log::default();
        log.grow(&[span(1, [0, 2])]);
        assert_eq!(positions(&log.since(0, ROWS)), [(1, 0), (1, 1), (1, 2)]);
        log.grow(&[span(1, [-1, 3]), span(2, [0, 0])]);
        assert_eq!(positions(&log.since(3, ROWS)), [(1, -1), (1, 3), (2, 0)]);
        assert_eq!(positions(&log.since(4, ROWS)), [(1, 3), (2, 0)]);
        assert_eq!(log.since(6, ROWS).len(), 0);
        assert_eq!((log.epoch(), log.points()), (1, 6));
        log.grow(&[span(1, [-1, 3]), span(2, [0, 0])]);
        assert_eq!((log.epoch(), log.points()), (1, 6));
    }

    #[test]
    fn removed_points_begin_an_epoch() {
        let mut log = Log::default();
        log.grow(&[span(1, [0, 9]), span(2, [0, 4])]);
        log.grow(&[span(1, [0, 9]), span(2, [0, 3])]);
        assert_eq!((log.epoch(), log.points()), (2, 14));
        log.grow(&[span(1, [0, 9])]);
        assert_eq!((log.epoch(), log.points()), (3, 10));
    }

    #[test]
    fn an_answer_has_a_bounded_number_of_points() {
        let mut log = Log::default();
        let long = ROWS as i64 + 10;
        log.grow(&[span(1, [0, 5]), span(2, [0, long])]);
        let first = positions(&log.since(0, ROWS));
        assert_eq!(first.len() as u64, ROWS);
        let rest = positions(&log.since(ROWS, ROWS));
        assert_eq!(first.len() as u64 + rest.len() as u64, log.points());
        assert_eq!(rest[0], (2, ROWS as i64 - 6));
    }
}
