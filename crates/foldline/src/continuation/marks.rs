//! Marks: points at which a quantity has a requested value.
//!
//! **Idea.** A mark is a request for output and must not change what is found on the branch. Marks are therefore
//! located on the pieces into which the search for special points has cut a step, and no step is cut for them. Special
//! points divide a piece: between two of them the parameter is monotonic, and a sign change of quantity minus value is
//! a mark. The parabola through the last three points reveals a quantity that reaches its value and returns within one
//! piece.
//!
//! **Fails when** a quantity passes its value twice within one piece and neither a special point nor the parabola
//! reveals it.

use super::corrector::Station;
use super::follow::Follow;
use super::inspect::History;
use super::locate::{Located, Stretch, discrepancy, locate_within};
use crate::contract::{Events, Monitor, Sight};
use crate::diagram::{Cost, Kind, Point};

/// Maximum number of bisections of a bracket in which Newton's method fails; 12 of them shorten it by a factor of 4000.
/// Empirical: failures occur next to singular points, a small part of a step.
const HALVINGS: usize = 12;
/// Remaining value after all bisections, as a share of the larger value at the ends of the bracket, above which the
/// quantity jumps across the requested value. A continuous quantity would be left with 2⁻¹², so the threshold has a
/// safety factor of 200.
const JUMPS: f64 = 0.05;
/// Share of a piece within which two functions of one event have their zeros.
const SAME: f64 = 1e-6;

impl Follow<'_> {
    /// Quantity minus value at a station, for every mark.
    pub(super) fn marked(&self, station: &Station) -> Vec<f64> {
        self.marks.iter().map(|mark| mark.value(&station.point, &station.point)).collect()
    }

    /// All marks on an accepted piece that ends at `right`, in the order of travel. `special` holds the special points
    /// on it with their distances.
    pub(super) fn marks_on(
        &mut self,
        stretch: &Stretch,
        right: &Station,
        history: Option<&History>,
        special: &[(f64, Point)],
        cost: &mut Cost,
    ) -> Vec<(Kind, Located, String)> {
        let marks = self.marks;
        let mut found: Vec<(usize, Located, String)> = Vec::new();
        for (k, mark) in marks.iter().enumerate() {
            if let Some(all) = self.separate_marks(stretch, &**mark, right, special, cost) {
                found.extend(all.into_iter().map(|(located, remark)| (k, located, remark)));
                continue;
            }
            let value = |point: &Point| mark.value(&stretch.left.point, point);
            let (first, last) = (value(&stretch.left.point), value(&right.point));
            let within = special.iter().map(|(distance, point)| (*distance, value(point)));
            let mut known: Vec<(f64, f64)> = [(0.0, first)].into_iter().chain(within).collect();
            known.retain(|(distance, value)| value.is_finite() && (0.0..stretch.length).contains(distance));
            // A value met exactly at the end of a piece, as at a bound, counts; at the beginning it was counted before.
            if last == 0.0 && first != 0.0 && !found.iter().any(|(_, other, _)| other.distance == stretch.length) {
                let error = 10.0 * self.settings.newton_tolerance();
                found.push((k, Located { distance: stretch.length, station: right.clone(), error }, String::new()));
            } else if last.is_finite() && last != 0.0 {
                known.push((stretch.length, last));
            }
            if let Some(distance) =
                turning(history.map(|h| (h.distance, &h.marks[..])), k, [first, last], stretch.length)
                && let Ok(there) = stretch.seen_at(Sight::Everything, self.problem, self.settings, distance, cost)
            {
                known.push((distance, value(&there.point)));
            }
            known.sort_by(|a, b| a.0.total_cmp(&b.0));
            for pair in known.windows(2).filter(|pair| pair[0].1 != 0.0 && differ(pair[0].1, pair[1].1)) {
                found.extend(
                    self.mark_between(stretch, &**mark, [pair[0], pair[1]], cost)
                        .map(|found| (k, found, String::new())),
                );
            }
        }
        found.sort_by(|a, b| a.1.distance.total_cmp(&b.1.distance));
        let together = SAME * stretch.length;
        found.dedup_by(|(next, b, _), (k, a, _)| {
            let [own, other] = [&marks[*k], &marks[*next]];
            b.distance - a.distance <= together && own.label() > 0 && own.label() == other.label()
        });
        found.into_iter().map(|(k, found, remark)| (marks[k].kind(), found, remark)).collect()
    }

    /// The events of a mark of which several may occur on the piece, with remarks; `None` if it is not such a mark.
    fn separate_marks(
        &mut self,
        stretch: &Stretch,
        mark: &dyn Monitor,
        right: &Station,
        special: &[(f64, Point)],
        cost: &mut Cost,
    ) -> Option<Vec<(Located, String)>> {
        let within = special.iter().filter(|(distance, _)| *distance > 0.0 && *distance < stretch.length);
        let mut known = vec![(0.0, &stretch.left.point), (stretch.length, &right.point)];
        known.extend(within.map(|(distance, point)| (*distance, point)));
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut found = Vec::new();
        for pair in known.windows(2) {
            let length = pair[1].0 - pair[0].0;
            let events = mark.separately(pair[0].1, pair[1].1, self.direction * length)?;
            if events.turns.is_empty() {
                found.extend(self.each_of(stretch, [pair[0].0, pair[1].0], events, cost));
                continue;
            }
            let mut between = Vec::new();
            for distance in events.turns.iter().map(|share| pair[0].0 + share * length) {
                let there = stretch.seen_at(Sight::Everything, self.problem, self.settings, distance, cost);
                between.extend(there.map(|there| (distance, there.point)));
            }
            let mut known = pair.to_vec();
            known.extend(between.iter().map(|(distance, point)| (*distance, point)));
            known.sort_by(|a, b| a.0.total_cmp(&b.0));
            for pair in known.windows(2) {
                let length = pair[1].0 - pair[0].0;
                let events = mark.separately(pair[0].1, pair[1].1, self.direction * length)?;
                found.extend(self.each_of(stretch, [pair[0].0, pair[1].0], events, cost));
            }
        }
        Some(found)
    }

    /// The events that two ends show, located.
    fn each_of(
        &mut self,
        stretch: &Stretch,
        ends: [f64; 2],
        events: Events,
        cost: &mut Cost,
    ) -> Vec<(Located, String)> {
        let mut found = Vec::new();
        for one in events.seen {
            let ends = [(ends[0], one.values[0]), (ends[1], one.values[1])];
            let Some(located) = self.mark_between(stretch, &*one.monitor, ends, cost) else { continue };
            let remark = one.monitor.remark(&located.station.point, self.direction > 0.0);
            found.push((located, remark));
        }
        found
    }

    /// The mark between two distances with values of opposite sign; `None` if the quantity jumps across the requested
    /// value. The bracket is bisected while Newton's method fails.
    fn mark_between(
        &mut self,
        stretch: &Stretch,
        mark: &dyn Monitor,
        [mut low, mut high]: [(f64, f64); 2],
        cost: &mut Cost,
    ) -> Option<Located> {
        let whole = low.1.abs().max(high.1.abs());
        let mut seen: [Option<Station>; 2] = [None, None];
        for _ in 0..HALVINGS {
            let ends = [low.0, high.0];
            if let Ok(found) = locate_within(self.problem, self.settings, stretch, ends, mark, [low.1, high.1], cost) {
                return Some(found);
            }
            // Next to a singular point another division may succeed.
            let shares = [0.5, 0.43, 0.57].map(|share| low.0 + share * (high.0 - low.0));
            let (distance, there) = shares.into_iter().find_map(|s| {
                let there = stretch.at(self.problem, self.settings, s, cost).ok()?;
                Some((s, there))
            })?;
            let value = mark.value(&stretch.left.point, &there.point);
            if differ(low.1, value) {
                (high, seen[1]) = ((distance, value), Some(there));
            } else {
                (low, seen[0]) = ((distance, value), Some(there));
            }
        }
        // No closer location is possible: the nearer end, with the distance to the other as its error.
        let [below, above] = seen;
        let (below, above) = (below?, above?);
        let gap = below.parameter() - above.parameter();
        let error = discrepancy(self.settings, &below.point, &above.point, gap, above.parameter());
        let (distance, value, station) =
            if low.1.abs() < high.1.abs() { (low.0, low.1, below) } else { (high.0, high.1, above) };
        (value.abs() < JUMPS * whole).then_some(Located { distance, station, error })
    }
}

fn differ(a: f64, b: f64) -> bool {
    (a > 0.0) != (b > 0.0)
}

/// Distance at which a value with the same sign at both ends of a piece may have the other sign: the extremum of the
/// parabola through the previous value and those at the ends, or the middle if there is no previous value. `None` if
/// the parabola stays clear of zero.
fn turning(before: Option<(f64, &[f64])>, k: usize, [first, last]: [f64; 2], length: f64) -> Option<f64> {
    /// Extremum of the parabola, as a share of the value at the beginning, below which the piece is examined. A safety
    /// factor for the error of the parabola.
    const NEAR: f64 = 0.1;
    if first * last <= 0.0 || !(first * last).is_finite() {
        return None;
    }
    let Some((distance, values)) = before else { return Some(0.5 * length) };
    let (before, after) = ((first - values.get(k)?) / distance, (last - first) / length);
    let bend = (after - before) / (distance + length);
    let slope = after - bend * length;
    let at = -slope / (2.0 * bend);
    let value = first + at * (slope + bend * at);
    (bend * first > 0.0 && at > 0.0 && at < length && value / first < NEAR).then_some(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_through_three_values_shows_where_a_quantity_turns() {
        // (s - 0.6)² - c on [0, 1], also known at -0.5.
        let seen = |c: f64| {
            let value = |s: f64| (s - 0.6f64).powi(2) - c;
            turning(Some((0.5, &[value(-0.5)])), 0, [value(0.0), value(1.0)], 1.0)
        };
        assert!((seen(0.01).unwrap() - 0.6).abs() < 1e-12, "passes zero twice");
        assert!(seen(-0.3).is_none(), "stays away from zero");
        assert_eq!(turning(None, 0, [1.0, 2.0], 0.4), Some(0.2));
        assert!(turning(None, 0, [1.0, -2.0], 0.4).is_none() && turning(None, 0, [f64::NAN, 1.0], 0.4).is_none());
    }
}
