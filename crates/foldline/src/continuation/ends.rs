//! Where a side ends: at a bound, where it closes, where it meets simpler solutions.

use super::corrector::{Failure, Station};
use super::follow::{Follow, Step};
use super::inspect::Found;
use super::locate::{Stretch, passing};
use crate::diagram::{Cost, Ending, Point};

/// Share of the deviation from simpler solutions below which a step is not accepted: it may have landed on them, and it
/// could not be told on which side of the meeting it is.
const LITTLE: f64 = 0.25;
/// Share below which a point close to the meeting counts as beyond it.
const NOTHING: f64 = 0.05;

impl Follow<'_> {
    /// The bound of a further parameter that this step passes, and the point there.
    pub(super) fn beyond(&mut self, left: &Station, right: &Station, cost: &mut Cost) -> Option<(f64, Station)> {
        let (index, value) = self.settings.bounds.iter().find_map(|(index, [low, high])| {
            let now = *right.point.parameters.get(*index)?;
            if now < *low { Some((*index, *low)) } else { (now > *high).then_some((*index, *high)) }
        })?;
        let gap = |station: &Station| station.point.parameters[index] - value;
        if (gap(left) > 0.0) == (gap(right) > 0.0) {
            return None;
        }
        let stretch = Stretch::new(self.problem, left, right, self.direction);
        let (mut inner, mut outer) = ((0.0, gap(left)), (stretch.length, gap(right)));
        let mut found = None;
        for _ in 0..8 {
            let s = inner.0 + (outer.0 - inner.0) * inner.1 / (inner.1 - outer.1);
            let there = self.cut(left, &stretch, s, cost)?;
            let miss = gap(&there);
            if (miss > 0.0) == (outer.1 > 0.0) {
                outer = (s, miss)
            } else {
                inner = (s, miss)
            }
            found = Some(there);
            if miss.abs() < self.settings.tolerance * (1.0 + value.abs()) {
                break;
            }
        }
        found.map(|there| (value, there))
    }

    pub(super) fn at_parameter(
        &mut self,
        left: &Station,
        right: &Station,
        value: f64,
        cost: &mut Cost,
    ) -> Result<Station, Failure> {
        passing(self.problem, self.settings, [left, right], value, self.direction, cost)
    }

    /// What was found in the last step before a branch meets simpler solutions, without what cannot be told from the
    /// meeting itself: there the parameter is stationary and a multiplier is 1 anyway.
    pub(super) fn up_to(&self, meeting: f64, found: Vec<Found>, unstable: usize, right: &mut Station) -> Vec<Found> {
        let near = 20.0 * self.settings.tolerance * (1.0 + meeting.abs());
        let apart = |value: f64| (value - meeting).abs() > near;
        let mut count = unstable;
        let mut kept = Vec::new();
        for item in found {
            let (value, after) = match &item {
                Found::Special(s) => {
                    let after = if self.direction > 0.0 { s.unstable_after } else { s.unstable_before };
                    (s.point.parameters.get(self.free).copied().unwrap_or(0.0), after)
                }
                Found::Inserted(s, _) => (s.parameter(), s.point.unstable),
            };
            if !apart(value) {
                break;
            }
            count = after;
            kept.push(item);
        }
        if !apart(right.parameter()) {
            right.point.unstable = count;
        }
        kept
    }

    /// Whether the step passes the place where the branch meets simpler solutions. If so the step ends a little before it.
    /// The place itself is not solved for: it is a branch point, and the deviation from the simpler solution grows like the
    /// square root of the distance in the parameter, which gives the parameter there well enough to recognise it.
    pub(super) fn collapsed(
        &mut self,
        left: &Station,
        right: &Station,
        cost: &mut Cost,
    ) -> Result<Option<Step>, Failure> {
        for monitor in self.collapses {
            let values = [monitor.value(&left.point, &left.point), monitor.value(&left.point, &right.point)];
            // Next to nothing left of the deviation: the step has landed on the simpler solutions themselves.
            if values[1].abs() < LITTLE * values[0] {
                return Err(Failure::Singular);
            }
            if !(values[0] > 0.0 && values[1] <= 0.0) {
                continue;
            }
            let stretch = Stretch::new(self.problem, left, right, self.direction);
            let (mut low, mut high) = ((0.0, values[0]), (stretch.length, values[1]));
            let mut near = None;
            for _ in 0..12 {
                let zero = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
                let s = 0.6 * zero + 0.4 * low.0;
                let found = self.cut(left, &stretch, s, cost).ok_or(Failure::Singular)?;
                let value = monitor.value(&left.point, &found.point);
                if value < NOTHING * values[0] {
                    high = (s, value.min(-NOTHING * values[0]));
                    continue;
                }
                low = (s, value);
                near = Some(found);
                if value < 0.6 * values[0] {
                    break;
                }
            }
            let near = near.ok_or(Failure::Singular)?;
            // A deviation that has turned instead of shrunk, as that of a narrow pulse that has moved, is none that vanishes.
            if monitor.value(&near.point, &left.point) < 1.1 * values[0] {
                continue;
            }
            // A branch that only passes the simpler solutions closely is followed on, in steps that do not skip the passage.
            if !monitor.confirms(&near.point) {
                return Err(Failure::Singular);
            }
            let share = (monitor.value(&left.point, &near.point) / values[0]).powi(2);
            let parameter = (near.parameter() - share * left.parameter()) / (1.0 - share);
            return Ok(Some(Step { right: near, end: Some(Ending::Joined { at: monitor.kind(), parameter }) }));
        }
        Ok(None)
    }

    /// The start again, if this step passes it.
    pub(super) fn closes(
        &mut self,
        left: &Station,
        right: &Station,
        emitted: usize,
        cost: &mut Cost,
    ) -> Result<Option<Station>, Failure> {
        let Some(home) = self.home else { return Ok(None) };
        let value = home.parameters[self.free];
        let between = (left.parameter() - value) * (right.parameter() - value) <= 0.0;
        let same_way = home.parameter_slope() * self.direction * (right.slope() + left.slope()) > 0.0;
        if emitted < 3 || !between || !same_way {
            return Ok(None);
        }
        let near = |point: &Point, tolerance: f64| {
            self.settings.reflections.iter().any(|r| point.difference(home, &self.settings.scales, r) < tolerance)
        };
        if !near(&right.point, 0.5) {
            return Ok(None);
        }
        let back = self.at_parameter(left, right, value, cost)?;
        let near = self
            .settings
            .reflections
            .iter()
            .any(|r| back.point.difference(home, &self.settings.scales, r) < 30.0 * self.settings.tolerance);
        Ok(near.then_some(back))
    }
}
