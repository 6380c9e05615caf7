//! Ends of a side: bounds, closure, and the meeting with simpler solutions.

use super::corrector::{Failure, Station, doubted, examined};
use super::follow::Follow;
use super::inspect::Found;
use super::locate::{Stretch, passing};
use super::step::Step;
use crate::contract::Monitor;
use crate::diagram::{Cost, Ending, Kind, Mesh, Point, SpecialPoint, Symmetry};

/// Fraction of the deviation from simpler solutions below which a step is rejected: it may have landed on them, or its
/// side of the meeting point is uncertain.
const LITTLE: f64 = 0.25;
/// Share of the deviation below which a point close to the meeting point counts as beyond it.
const NOTHING: f64 = 0.05;
/// Distance along the branch, in tolerances, within which a point is identified with the start. Next to a fold the
/// parameter fixes the position less accurately than the point is computed.
const HOME: f64 = 30.0;
/// Distance from the start, in tolerances, beyond which a branch can return to it.
const AWAY: f64 = 100.0;
/// Step above which a failed check for closure causes a retry with half the length.
const DIVISIBLE: f64 = 1e-3;

/// Closure detector: state of a run with respect to its start.
#[derive(Clone, Debug, Default)]
pub struct Homecoming {
    /// True once the run has left the start.
    pub(super) away: bool,
    /// Largest distance from the start so far, for every image of it under a symmetry, and whether the distance has decreased
    /// since.
    reached: Vec<(f64, bool)>,
}

/// A copy of the start, shifted in phase and reflected.
struct Image {
    u: Vec<f64>,
    tangent: Vec<f64>,
    mesh: Mesh,
}

/// Largest difference between two computed copies of one solution: twice their stated errors, plus the tolerance for
/// incomplete convergence on a mesh.
fn doubt(point: &Point, home: &Point, tolerance: f64) -> f64 {
    2.0 * (point.trust.discretisation + home.trust.discretisation) + tolerance
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

impl Follow<'_> {
    /// Bound of a further parameter that this step passes, with the point there.
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

    /// Special points on the last step before a branch meets simpler solutions, without those that cannot be
    /// distinguished from the meeting point, where the parameter is stationary and a multiplier is 1 in any case.
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

    /// Truncates the results of a step at an event that ends the branch; `right` becomes that event.
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

    /// Truncates the results of a step at the first switching surface that an equilibrium passes. `right` becomes the
    /// point there, on the branch beyond the surface. Also returns whether there is one.
    pub(super) fn up_to_surface(
        &mut self,
        left: &Station,
        end: Option<Ending>,
        mut found: Vec<Found>,
        right: &mut Station,
        cost: &mut Cost,
    ) -> (bool, Option<Ending>, Vec<Found>) {
        let surface =
            |item: &Found| matches!(item, Found::Special(special) if special.kind == Kind::BoundaryEquilibrium);
        // The surface from which the step leaves, seen again for rounding.
        let begins = |walk: &mut Self, item: &Found| match item {
            Found::Special(special) if surface(item) => {
                let u = walk.problem.unknowns_of(&special.point);
                let off: Vec<f64> = u.iter().zip(&left.u).map(|(a, b)| a - b).collect();
                walk.problem.relative_size(&off, &left.u) < walk.settings.newton_tolerance()
            }
            _ => false,
        };
        if self.holds {
            found.retain(|item| !begins(self, item));
        }
        let Some(at) = found.iter().position(surface).filter(|_| self.holds) else { return (false, end, found) };
        found.truncate(at + 1);
        let Some(Found::Special(special)) = found.last_mut() else { return (false, end, found) };
        let u = self.problem.unknowns_of(&special.point);
        let along: Vec<f64> = special.point.tangent.iter().map(|t| self.direction * t).collect();
        let value = |monitor: &dyn Monitor| monitor.value(&special.point, &special.point).abs();
        let surfaces = self.marks.iter().filter(|monitor| monitor.kind() == Kind::BoundaryEquilibrium);
        let nearest = surfaces.min_by(|a, b| value(&***a).total_cmp(&value(&***b)));
        let switch = nearest.map_or(0, |monitor| monitor.label().saturating_sub(1));
        self.problem.anchor(&u);
        let Some(tangent) = self.problem.cross(&u, &along, switch) else {
            (right.u, right.tangent, right.point) = (u, along, special.point.clone());
            let why = "the equilibrium reaches a switching surface at which the right-hand side jumps, or a corner of several \
                       surfaces\nlikely cause: beyond it there is no equilibrium of this kind, or more than one; where the \
                       right-hand side jumps it may stay on the surface (a sliding or sticking state)\nwhat to do: smooth \
                       the switches, such as tanh(s*x) for sign(x), and continue in s";
            return (false, Some(Ending::StepTooSmall(why.into())), found);
        };
        cost.factorisations += 1;
        let [before, after] = [&along, &tangent].map(|t| t[t.len() - 1]);
        special.remark = match before * after > 0.0 {
            true => "persistence".into(),
            false => "non-smooth fold".into(),
        };
        let mut there = examined(self.problem, u, tangent, self.direction);
        self.count(&mut there);
        let own = if self.direction > 0.0 { &mut special.unstable_after } else { &mut special.unstable_before };
        *own = there.point.unstable;
        *right = there;
        (true, None, found)
    }

    /// Ends the step shortly before the point at which the branch meets simpler solutions, if the step passes such a
    /// point. The point itself is not solved for, because it is a branch point. Its parameter value comes from the
    /// simpler solutions if they determine it; otherwise it is extrapolated from the deviation from them, which grows
    /// like the square root of the distance in the parameter. That is accurate enough to recognise the point.
    pub(super) fn collapsed(
        &mut self,
        left: &Station,
        right: &Station,
        cost: &mut Cost,
    ) -> Result<Option<Step>, Failure> {
        for monitor in self.collapses {
            let values = [monitor.value(&left.point, &left.point), monitor.value(&left.point, &right.point)];
            // Almost no deviation is left: the step has landed on the simpler solutions themselves.
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
            // A deviation that has changed direction instead of shrinking, as that of a narrow pulse that has moved,
            // does not vanish.
            if monitor.value(&near.point, &left.point) < 1.1 * values[0] {
                continue;
            }
            // A branch that only passes close to the simpler solutions is followed further, in steps that do not skip
            // the passage.
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
                moving: None,
            }));
        }
        Ok(None)
    }

    /// Meeting point with simpler solutions ahead of a step that fails. It is accepted if the simpler solutions
    /// determine its parameter value and the deviation from them shrinks like the square root of the distance to it.
    pub(super) fn collapse_ahead(&mut self, before: &Station, here: &Station) -> Option<Ending> {
        /// Largest accepted relative deviation from the square-root law. Empirical: the law holds to first order only,
        /// and two neighbouring points near the end are compared.
        const NEARLY: f64 = 0.3;
        self.collapses.iter().find_map(|monitor| {
            let parameter = monitor.meeting(&here.point)?;
            // Ratio of the deviation at the previous point to that here.
            let larger = monitor.value(&here.point, &before.point);
            let farther = (self.value(before) - parameter) / (self.value(here) - parameter);
            let fits = larger > 1.0 && (farther / (larger * larger) - 1.0).abs() < NEARLY;
            fits.then_some(Ending::Joined { at: monitor.kind(), parameter })
        })
    }

    /// Records the distance of `here` from the start, and whether it is large enough for the branch to return. To be
    /// called for every point in the order of travel.
    pub fn leaves_home(&mut self, here: &Point) {
        let Some(home) = self.home else { return };
        let own = self.features(home, home, &Symmetry::identity());
        if self.homecoming.reached.is_empty() {
            let seen = |symmetry: &Symmetry| (distance(&self.features(home, home, symmetry), &own), false);
            self.homecoming.reached = self.settings.symmetries.iter().map(seen).collect();
        }
        let mut reached = std::mem::take(&mut self.homecoming.reached);
        for ((farthest, nearer), symmetry) in reached.iter_mut().zip(&self.settings.symmetries) {
            let off = distance(&self.features(here, home, symmetry), &own);
            *nearer |= off < *farthest;
            *farthest = farthest.max(off);
        }
        self.homecoming.away |= reached.first().is_some_and(|(off, _)| *off > AWAY * self.settings.tolerance);
        self.homecoming.reached = reached;
    }

    /// Returns the start if this step passes it.
    ///
    /// The start is passed where the branch crosses the hyperplane across its tangent there, no farther from it than
    /// the stated errors of both. Special points closer to it than that decide its position ([`super::side`]).
    ///
    /// # Errors
    /// Reason for which the check failed, if a shorter step may succeed: if closure were missed, the branch would be
    /// followed again.
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

    /// Closure where the branch reaches the parameter value of the start again.
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
        let near = |r: &Symmetry| right.point.difference(home, self.settings.measure(), r) < 0.5;
        if !(between && same_way && self.settings.symmetries.iter().any(near)) {
            return Ok(None);
        }
        let back = self.at_parameter(left, right, value, cost)?;
        let far = 10.0 * HOME * self.settings.tolerance;
        for symmetry in self.settings.symmetries.clone() {
            let images = self.images_of_home(&back, home, &symmetry, far);
            if images.iter().any(|image| self.is_home(&back, home, image)) {
                return Ok(Some(back));
            }
        }
        Ok(None)
    }

    /// Closure where the branch crosses the hyperplane through the start. Next to a fold two solutions share a
    /// parameter value, and a step round the fold need not reach that value at all.
    fn crosses(&mut self, left: &Station, right: &Station, home: &Point, cost: &mut Cost) -> Option<Station> {
        let tolerance = self.settings.tolerance;
        let own = self.features(home, home, &Symmetry::identity());
        for (k, symmetry) in self.settings.symmetries.clone().into_iter().enumerate() {
            let [from, to] = [left, right].map(|station| self.features(&station.point, home, &symmetry));
            // A branch that has only moved away from this copy so far, and does so on this step, returns on a later
            // one.
            let receding =
                self.homecoming.reached.get(k).is_some_and(|(off, nearer)| !nearer && distance(&to, &own) > *off);
            if receding {
                continue;
            }
            // Most steps are elsewhere, which is cheap to detect.
            let near = 1.5 * distance(&from, &to) + HOME * tolerance;
            if distance(&from, &own).min(distance(&to, &own)) > near {
                continue;
            }
            let length = self.between(left, right).along;
            for image in self.images_of_home(right, home, &symmetry, 1.5 * length + HOME * tolerance) {
                if let Some(found) = self.crosses_at(left, right, home, &symmetry, &image, cost) {
                    return Some(found);
                }
            }
        }
        None
    }

    /// Closure for one symmetry and one copy of the start, seen from `right`.
    fn crosses_at(
        &mut self,
        left: &Station,
        right: &Station,
        home: &Point,
        symmetry: &Symmetry,
        image: &Image,
        cost: &mut Cost,
    ) -> Option<Station> {
        let tolerance = self.settings.tolerance;
        // If the step ends slightly before the hyperplane, the start may already be met.
        let error = doubt(&right.point, home, tolerance);
        let [(from, _), (to, _)] = [left, right].map(|station| self.against(station, image));
        // (A run that was stopped at the start continues from there.)
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
        // In the phase of the end of the step the copy is slightly shifted in time, by more than is permitted here.
        let images = self.images_of_home(&found, home, symmetry, 10.0 * HOME * tolerance);
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
        // If the hyperplane is still ahead, so may be the special point between here and the start (a hairpin narrower
        // than the errors).
        same.or((to > 0.0).then_some(found))
    }

    /// Copies of the start no farther than `within` from a station.
    fn images_of_home(&mut self, from: &Station, home: &Point, symmetry: &Symmetry, within: f64) -> Vec<Image> {
        self.place(from);
        let images = self.problem.images(&from.u, home, symmetry, within);
        images.into_iter().map(|[u, tangent]| Image { u, tangent, mesh: from.mesh.clone() }).collect()
    }

    /// Distance of a station ahead of a copy of the start, along the tangent there in the direction of travel, and
    /// relative distance across it.
    fn against(&mut self, found: &Station, image: &Image) -> (f64, f64) {
        self.place(found);
        let u = self.problem.carry(&image.u, &image.mesh, &found.mesh);
        let along = self.problem.transfer(&image.tangent, &image.mesh, &found.mesh);
        let size = self.direction * self.problem.dot(&along, &along).sqrt();
        let mut off: Vec<f64> = found.u.iter().zip(&u).map(|(a, b)| a - b).collect();
        let ahead = self.problem.dot(&along, &off) / size;
        off.iter_mut().zip(&along).for_each(|(off, t)| *off -= ahead / size * t);
        (ahead, self.problem.relative_size(&off, &found.u))
    }

    /// True if a station is the start within the errors of both, along and across the branch.
    fn is_home(&mut self, found: &Station, home: &Point, image: &Image) -> bool {
        let tolerance = self.settings.tolerance;
        let (ahead, across) = self.against(found, image);
        ahead.abs() < HOME * tolerance && across < doubt(&found.point, home, tolerance)
    }

    /// The change in the number of unstable multipliers between the end at `right` and the start, if a closed branch
    /// has one.
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

    /// Parameter, period and extreme values of a point, each relative to its size at `home`; `seen` is the symmetry
    /// applied to it.
    fn features(&self, point: &Point, home: &Point, seen: &Symmetry) -> Vec<f64> {
        let value = |p: &Point| p.parameters.get(self.free).copied().unwrap_or(0.0);
        let mut all = vec![value(point) / (self.problem.unit() + value(home).abs())];
        if let Some(period) = point.solution.period() {
            all.push(period.ln());
        }
        for (i, at_home) in home.ranges.iter().take(point.ranges.len()).enumerate() {
            let range = seen.range(&point.ranges, i);
            let size = at_home[0].abs().max(at_home[1].abs());
            let scale = self.settings.scales.get(i).copied().unwrap_or(f64::MIN_POSITIVE) + size;
            all.extend(range.map(|v| v / scale));
        }
        all
    }
}
