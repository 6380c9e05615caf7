//! Where a side ends: at a bound, where it closes, where it meets simpler solutions.

use super::corrector::{Failure, Station, doubted};
use super::follow::Follow;
use super::inspect::Found;
use super::locate::{Stretch, passing};
use super::step::Step;
use crate::diagram::{Cost, Ending, Kind, Mesh, Point, SpecialPoint};

/// Share of the deviation from simpler solutions below which a step is not accepted: it may have landed on them, and it
/// could not be told on which side of the meeting it is.
const LITTLE: f64 = 0.25;
/// Share below which a point close to the meeting counts as beyond it.
const NOTHING: f64 = 0.05;
/// Distance along the branch, in tolerances, up to which a point is the start again: next to a fold the parameter places it
/// less well than it is computed.
const HOME: f64 = 30.0;
/// Distance from the start, in tolerances, from which on a branch can come back to it.
const AWAY: f64 = 100.0;
/// Step down to which one that cannot be looked into is tried in halves.
const DIVISIBLE: f64 = 1e-3;

/// What a run knows of its way back to the start.
#[derive(Clone, Debug, Default)]
pub struct Homecoming {
    /// Whether it has left.
    away: bool,
    /// For every reflection how far it has been from the start as that shows it, and whether it has come nearer to that since.
    reached: Vec<(f64, bool)>,
}

/// The start in one phase and reflection.
struct Image {
    u: Vec<f64>,
    tangent: Vec<f64>,
    mesh: Mesh,
}

/// By how much two points that are one solution may differ: the errors that they state, and as much as a point may miss its mesh's
/// solution by.
fn doubt(point: &Point, home: &Point, tolerance: f64) -> f64 {
    2.0 * (point.trust.discretisation + home.trust.discretisation) + tolerance
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

impl Follow<'_> {
    /// The bound of a further parameter that this step passes, and the point there.
    pub(super) fn beyond(&mut self, left: &Station, right: &Station, cost: &mut Cost) -> Option<(f64, Station)> {
        let (index, value, width) = self.settings.bounds.iter().find_map(|(index, [low, high])| {
            let now = *right.point.parameters.get(*index)?;
            let bound = if now < *low { Some(*low) } else { (now > *high).then_some(*high) };
            bound.map(|bound| (*index, bound, if (high - low).is_finite() { high - low } else { bound.abs() }))
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
            if miss.abs() < self.settings.tolerance * width {
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
        let near = 20.0 * self.settings.tolerance * (self.problem.unit() + meeting.abs());
        let apart = |value: f64| (value - meeting).abs() > near;
        let mut count = unstable;
        let mut kept = Vec::new();
        for item in found {
            let (value, after) = match &item {
                Found::Special(s) => {
                    let after = if self.direction > 0.0 { s.unstable_after } else { s.unstable_before };
                    (s.point.parameters.get(self.free).copied().unwrap_or(0.0), after)
                }
                Found::Inserted(s, _) => (self.value(s), s.point.unstable),
            };
            if !apart(value) {
                break;
            }
            count = after;
            kept.push(item);
        }
        if !apart(self.value(right)) {
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
            let own = self.monitors.iter().chain(self.marks).filter(|monitor| monitor.kind() == kind);
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

    /// Ends the step shortly before the point at which the branch meets simpler solutions, if the step passes such a point.
    /// The point itself is not solved for, because it is a branch point. Its parameter value comes from the simpler solutions if
    /// they determine it; otherwise it is extrapolated from the deviation from them, which grows like the square root of the
    /// distance in the parameter. That is accurate enough to recognise the point.
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
            let extrapolated = (self.value(&near) - share * self.value(left)) / (1.0 - share);
            let parameter = monitor.meeting(&near.point).unwrap_or(extrapolated);
            return Ok(Some(Step {
                right: near,
                end: Some(Ending::Joined { at: monitor.kind(), parameter }),
                between: None,
            }));
        }
        Ok(None)
    }

    /// The point, ahead of a step that fails, at which the branch meets simpler solutions. It is accepted if the simpler solutions
    /// determine its parameter value and the deviation from them shrinks like the square root of the distance to it.
    pub(super) fn collapse_ahead(&mut self, before: &Station, here: &Station) -> Option<Ending> {
        /// Relative deviation from the square-root law that is accepted. Empirical: the law holds to first order only, and two
        /// neighbouring points near the end are compared.
        const NEARLY: f64 = 0.3;
        self.collapses.iter().find_map(|monitor| {
            let parameter = monitor.meeting(&here.point)?;
            // Ratio of the deviation at the point before to that here.
            let larger = monitor.value(&here.point, &before.point);
            let farther = (self.value(before) - parameter) / (self.value(here) - parameter);
            let fits = larger > 1.0 && (farther / (larger * larger) - 1.0).abs() < NEARLY;
            fits.then_some(Ending::Joined { at: monitor.kind(), parameter })
        })
    }

    /// Takes note of how far the branch has gone from its start, to `here`: whether so far that it can come back. To be told of every
    /// point in the order of travel.
    pub fn leaves_home(&mut self, here: &Point) {
        let Some(home) = self.home else { return };
        let own = self.features(home, home, &[]);
        if self.homecoming.reached.is_empty() {
            let seen = |reflection: &Vec<bool>| (distance(&self.features(home, home, reflection), &own), false);
            self.homecoming.reached = self.settings.reflections.iter().map(seen).collect();
        }
        let mut reached = std::mem::take(&mut self.homecoming.reached);
        for ((farthest, nearer), reflection) in reached.iter_mut().zip(&self.settings.reflections) {
            let off = distance(&self.features(here, home, reflection), &own);
            *nearer |= off < *farthest;
            *farthest = farthest.max(off);
        }
        self.homecoming.away |= reached.first().is_some_and(|(off, _)| *off > AWAY * self.settings.tolerance);
        self.homecoming.reached = reached;
    }

    /// The start again, if this step passes it.
    ///
    /// The start is passed where the branch goes through the plane across its tangent there, no farther from it than the errors that
    /// both state. Where special points lie closer to it than that, they decide where it is ([`super::side`]).
    ///
    /// # Errors
    /// Why the start could not be looked for, where a shorter step may find it: passed unseen, the branch would be followed again.
    pub(super) fn closes(
        &mut self,
        left: &Station,
        right: &Station,
        cost: &mut Cost,
    ) -> Result<Option<Station>, Failure> {
        let Some(home) = self.home.filter(|_| self.homecoming.away) else { return Ok(None) };
        let wanted = self.signature(home);
        let back = self.at_its_parameter(left, right, home, cost);
        if let Ok(Some(back)) = &back
            && self.signature(&back.point) == wanted
        {
            return Ok(Some(back.clone()));
        }
        match (self.crosses(left, right, home, cost), back) {
            (Some(found), _) => Ok(Some(found)),
            (None, Err(why)) if self.between(left, right).along > DIVISIBLE => Err(why),
            (None, back) => Ok(back.unwrap_or(None)),
        }
    }

    /// The start where its value of the parameter is met again.
    fn at_its_parameter(
        &mut self,
        left: &Station,
        right: &Station,
        home: &Point,
        cost: &mut Cost,
    ) -> Result<Option<Station>, Failure> {
        let value = home.parameters[self.free];
        let between = (self.value(left) - value) * (self.value(right) - value) <= 0.0;
        let same_way = home.parameter_slope() * self.direction * (right.slope() + left.slope()) > 0.0;
        let near = |r: &Vec<bool>| right.point.difference(home, self.settings.measure(), r) < 0.5;
        if !(between && same_way && self.settings.reflections.iter().any(near)) {
            return Ok(None);
        }
        let back = self.at_parameter(left, right, value, cost)?;
        let far = 10.0 * HOME * self.settings.tolerance;
        for reflection in self.settings.reflections.clone() {
            let images = self.images_of_home(&back, home, &reflection, far);
            if images.iter().any(|image| self.is_home(&back, home, image)) {
                return Ok(Some(back));
            }
        }
        Ok(None)
    }

    /// The start where the plane across it is passed: next to a fold two solutions share a value of the parameter, and a
    /// step round the fold need not pass that value at all.
    fn crosses(&mut self, left: &Station, right: &Station, home: &Point, cost: &mut Cost) -> Option<Station> {
        let tolerance = self.settings.tolerance;
        let own = self.features(home, home, &[]);
        for (k, reflection) in self.settings.reflections.clone().into_iter().enumerate() {
            let [from, to] = [left, right].map(|station| self.features(&station.point, home, &reflection));
            // A branch that has only gone away from it so far, and does so in this step, turns back in a later one.
            let receding =
                self.homecoming.reached.get(k).is_some_and(|(off, nearer)| !nearer && distance(&to, &own) > *off);
            if receding {
                continue;
            }
            // Most steps are elsewhere, which costs nothing to see.
            let near = 1.5 * distance(&from, &to) + HOME * tolerance;
            if distance(&from, &own).min(distance(&to, &own)) > near {
                continue;
            }
            let length = self.between(left, right).along;
            for image in self.images_of_home(right, home, &reflection, 1.5 * length + HOME * tolerance) {
                if let Some(found) = self.crosses_at(left, right, home, &reflection, &image, cost) {
                    return Some(found);
                }
            }
        }
        None
    }

    /// The same for one reflection and one image of the start, as it is seen from `right`.
    fn crosses_at(
        &mut self,
        left: &Station,
        right: &Station,
        home: &Point,
        reflection: &[bool],
        image: &Image,
        cost: &mut Cost,
    ) -> Option<Station> {
        let tolerance = self.settings.tolerance;
        // Where the step ends a little before the plane, the start may be met already.
        let error = doubt(&right.point, home, tolerance);
        let [(from, _), (to, _)] = [left, right].map(|station| self.against(station, image));
        // A run that was stopped there goes on from the start itself.
        if !(from <= error && to > -error) {
            return None;
        }
        let stretch = Stretch::new(self.problem, left, right, self.direction);
        let (mut low, mut high) = ((0.0, from), (stretch.length, to));
        let mut there = stretch.length;
        for count in 0..20 {
            if high.1 <= 0.0 || high.0 - low.0 < 1e-3 * error {
                there = high.0;
                break;
            }
            let share = if count % 3 == 2 { 0.5 } else { (low.1 / (low.1 - high.1)).clamp(0.05, 0.95) };
            there = low.0 + share * (high.0 - low.0);
            let found = stretch.at(self.problem, self.settings, there, cost).ok()?;
            let (off, _) = self.against(&found, image);
            if off <= 0.0 {
                low = (there, off)
            } else {
                high = (there, off)
            }
            if off.abs() < 1e-2 * tolerance {
                break;
            }
        }
        let found = self.cut(left, &stretch, there, cost)?;
        // In the phase that suits the end of the step the image is shifted in time a little, by more than is asked for here.
        let images = self.images_of_home(&found, home, reflection, 10.0 * HOME * tolerance);
        if !images.iter().any(|image| self.is_home(&found, home, image)) {
            return None;
        }
        let wanted = self.signature(home);
        if self.signature(&found.point) == wanted {
            return Some(found);
        }
        let shortest = 0.1 * there.min(stretch.length);
        let mut at = |walk: &mut Self, s: f64| {
            let mut found = stretch.at(walk.problem, walk.settings, s.max(shortest), cost).ok()?;
            doubted(walk.problem, &mut found);
            Some(found)
        };
        let same = self.on_its_side(&wanted, there, error, &mut at);
        // Where the plane is still ahead, so may be the special point between here and the start: a hairpin narrower than the errors.
        same.or((to > 0.0).then_some(found))
    }

    /// The start as it can be seen no farther than `within` from a station.
    fn images_of_home(&mut self, from: &Station, home: &Point, reflection: &[bool], within: f64) -> Vec<Image> {
        self.place(from);
        let images = self.problem.images(&from.u, home, reflection, within);
        images.into_iter().map(|[u, tangent]| Image { u, tangent, mesh: from.mesh.clone() }).collect()
    }

    /// How far ahead of an image of the start a station lies, along the tangent there in the direction of travel, and how far off across
    /// it, relative.
    fn against(&mut self, found: &Station, image: &Image) -> (f64, f64) {
        self.place(found);
        let [u, along] = [&image.u, &image.tangent].map(|v| self.problem.transfer(v, &image.mesh, &found.mesh));
        let size = self.direction * self.problem.dot(&along, &along).sqrt();
        let mut off: Vec<f64> = found.u.iter().zip(&u).map(|(a, b)| a - b).collect();
        let ahead = self.problem.dot(&along, &off) / size;
        off.iter_mut().zip(&along).for_each(|(off, t)| *off -= ahead / size * t);
        (ahead, self.problem.relative_size(&off, &found.u))
    }

    /// Whether a station is the start as far as the errors of both tell: no farther off across the branch.
    fn is_home(&mut self, found: &Station, home: &Point, image: &Image) -> bool {
        let tolerance = self.settings.tolerance;
        let (ahead, across) = self.against(found, image);
        ahead.abs() < HOME * tolerance && across < doubt(&found.point, home, tolerance)
    }

    /// What has become of the count of unstable multipliers on the way to `right`, where the branch has come back to its start.
    pub(super) fn changed_on_return(&mut self, right: &Station, position: i64) -> Option<SpecialPoint> {
        let home = self.home?;
        if !self.settings.stability || right.point.unstable == home.unstable {
            return None;
        }
        let [before, after] = [right.point.unstable, home.unstable].map(|count| count as i64);
        let error = doubt(&right.point, home, self.settings.tolerance);
        let mut special = *self.special(Kind::Unexplained, right.clone(), before, after, error);
        special.point.position = if self.direction > 0.0 { position } else { position - 1 };
        Some(special)
    }

    /// Parameter, period and extreme values of a point, each relative to its size at `home`; `seen` is the reflection in which
    /// it is looked at.
    fn features(&self, point: &Point, home: &Point, seen: &[bool]) -> Vec<f64> {
        let value = |p: &Point| p.parameters.get(self.free).copied().unwrap_or(0.0);
        let mut all = vec![value(point) / (self.problem.unit() + value(home).abs())];
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
