//! Where a side ends: at a bound, where it closes, where it meets simpler solutions.

use super::corrector::{Failure, Station};
use super::follow::{Follow, Step};
use super::inspect::Found;
use super::locate::{Stretch, passing};
use crate::diagram::{Cost, Ending, Kind, Point};
use crate::linalg::dot;

/// Share of the deviation from simpler solutions below which a step is not accepted: it may have landed on them, and it
/// could not be told on which side of the meeting it is.
const LITTLE: f64 = 0.25;
/// Share below which a point close to the meeting counts as beyond it.
const NOTHING: f64 = 0.05;
/// Difference, in tolerances, up to which a point is the start again.
const HOME: f64 = 30.0;
/// Distances from the start, in tolerances, at which a branch that comes back is looked at for its side of a special point.
const BESIDE: [f64; 6] = [0.1, -0.1, 1.0, -1.0, 10.0, -10.0];

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

    /// What was found on a step up to an event at which the branch ends, which `right` becomes.
    pub(super) fn up_to_end(
        &self,
        end: Option<Ending>,
        mut found: Vec<Found>,
        right: &mut Station,
    ) -> (Option<Ending>, Vec<Found>) {
        let value = |point: &Point| point.parameters.get(self.free).copied().unwrap_or(f64::NAN);
        let ending = |at: &Point, kind: Kind| {
            let own = self.monitors.iter().filter(|monitor| monitor.kind() == kind);
            own.into_iter().find_map(|monitor| monitor.ending(at, value(at)))
        };
        let last = found.iter().enumerate().find_map(|(k, item)| match item {
            Found::Special(special) => Some((k, special.point.clone(), ending(&special.point, special.kind)?)),
            Found::Inserted(..) => None,
        });
        let Some((k, point, ending)) = last else { return (end, found) };
        found.truncate(k + 1);
        right.point = point;
        (Some(ending), found)
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
        if emitted < 3 {
            return Ok(None);
        }
        let value = home.parameters[self.free];
        let near = |point: &Point, tolerance: f64| {
            self.settings.reflections.iter().any(|r| point.difference(home, &self.settings.scales, r) < tolerance)
        };
        let between = (left.parameter() - value) * (right.parameter() - value) <= 0.0;
        let same_way = home.parameter_slope() * self.direction * (right.slope() + left.slope()) > 0.0;
        if between && same_way && near(&right.point, 0.5) {
            let back = self.at_parameter(left, right, value, cost)?;
            if near(&back.point, HOME * self.settings.tolerance) {
                if back.point.unstable == home.unstable {
                    return Ok(Some(back));
                }
                // The start is as near to a special point as it is accurate: it is met again on its own side of that.
                let onwards = (right.parameter() - left.parameter()).signum() * (1.0 + value.abs());
                for aside in BESIDE {
                    let there = value + aside * self.settings.tolerance * onwards;
                    let inside = (left.parameter() - there) * (right.parameter() - there) < 0.0;
                    if let Some(beside) = inside.then(|| self.at_parameter(left, right, there, cost).ok()).flatten()
                        && beside.point.unstable == home.unstable
                        && near(&beside.point, HOME * self.settings.tolerance)
                    {
                        return Ok(Some(beside));
                    }
                }
                return Ok(Some(back));
            }
        }
        Ok(self.crosses(left, right, home, cost))
    }

    /// The start again, where the parameter does not show that this step passes it: next to a fold two solutions share
    /// a value of the parameter, and a step round the fold need not pass that value at all. What distinguishes solutions without
    /// regard to their phase, parameter, period and extreme values, says on which side of the start a point is.
    fn crosses(&mut self, left: &Station, right: &Station, home: &Point, cost: &mut Cost) -> Option<Station> {
        let next = self.next_to_home.clone()?;
        for reflection in self.settings.reflections.clone() {
            let features = |point: &Point, seen: &[bool]| self.features(point, home, seen);
            let own = features(home, &[]);
            let along: Vec<f64> = features(&next, &[]).iter().zip(&own).map(|(b, a)| b - a).collect();
            let length = dot(&along, &along).sqrt();
            let side = |f: &[f64]| f.iter().zip(&own).zip(&along).map(|((f, a), d)| (f - a) * d).sum::<f64>() / length;
            let [from, to] = [left, right].map(|station| features(&station.point, &reflection));
            let (mut low, mut high) = ((0.0, side(&from)), (0.0, side(&to)));
            if !(low.1 <= 0.0 && high.1 > 0.0) {
                continue;
            }
            // Most passages are elsewhere in the plane across the start, which costs nothing to see.
            let share = low.1 / (low.1 - high.1);
            let distance = |f: &[f64], g: &[f64]| f.iter().zip(g).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
            let between: Vec<f64> = from.iter().zip(&to).map(|(a, b)| a + share * (b - a)).collect();
            if distance(&between, &own) > distance(&from, &to) {
                continue;
            }
            let stretch = Stretch::new(self.problem, left, right, self.direction);
            high.0 = stretch.length;
            // On the other side of a special point than the start, which may be as near to one as it is accurate.
            let mut aside = None;
            for count in 0..12 {
                let share = if count % 3 == 2 { 0.5 } else { (low.1 / (low.1 - high.1)).clamp(0.05, 0.95) };
                let s = low.0 + share * (high.0 - low.0);
                let found = self.cut(left, &stretch, s, cost)?;
                let f = self.features(&found.point, home, &reflection);
                let off = side(&f);
                if distance(&f, &own) < HOME * self.settings.tolerance {
                    if found.point.unstable == home.unstable {
                        return Some(found);
                    }
                    aside = Some((s, found));
                }
                if off <= 0.0 {
                    low = (s, off)
                } else {
                    high = (s, off)
                }
                if off.abs() < self.settings.tolerance * if aside.is_some() { 1e-2 } else { 1.0 } {
                    break;
                }
            }
            let Some((s, found)) = aside else { continue };
            let unit = self.settings.tolerance * (high.0 - low.0) / (high.1 - low.1);
            for aside in BESIDE {
                let there = (s + aside * unit).clamp(0.0, stretch.length);
                if let Some(beside) = self.cut(left, &stretch, there, cost)
                    && beside.point.unstable == home.unstable
                    && distance(&self.features(&beside.point, home, &reflection), &own) < HOME * self.settings.tolerance
                {
                    return Some(beside);
                }
            }
            return Some(found);
        }
        None
    }

    /// Parameter, period and extreme values of a point, each relative to its size at `home`; `seen` is the reflection in which
    /// it is looked at.
    fn features(&self, point: &Point, home: &Point, seen: &[bool]) -> Vec<f64> {
        let value = |p: &Point| p.parameters.get(self.free).copied().unwrap_or(0.0);
        let mut all = vec![value(point) / (1.0 + value(home).abs())];
        if let Some(period) = point.solution.period() {
            all.push(period.ln());
        }
        for (i, (range, at_home)) in point.ranges.iter().zip(&home.ranges).enumerate() {
            let range = if seen.get(i).copied().unwrap_or(false) { [-range[1], -range[0]] } else { *range };
            let size = at_home[0].abs().max(at_home[1].abs());
            let scale = self.settings.scales.get(i).copied().unwrap_or(f64::MIN_POSITIVE) + size;
            all.extend(range.map(|v| v / scale));
        }
        all
    }
}
