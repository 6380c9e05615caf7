//! Special points between two accepted points.
//!
//! **Idea.** Every monitor whose sign differs at the two ends is located. The step is halved recursively while it
//! contains more than one special point, while the number of unstable multipliers changes by an amount that the special
//! point does not explain, or while a monitor is so curved that it may have touched zero and returned. A change of
//! stability that remains unexplained is recorded as such. Marks are not part of this search: they are located last, on
//! the resulting pieces ([`super::marks`]).

use super::allowance::{ALLOWANCE, work};
use super::corrector::{Failure, Station, doubted, refine};
use super::even::Degeneracy;
use super::follow::Follow;
use super::locate::{Located, Stretch, discrepancy, head_along, locate};
use super::opposite::{Around, Exchange};
use super::straddle::straddle;
use crate::contract::Sight;
use crate::diagram::{Cost, Kind, NULL_SPACE, Point, STANDS, Solution, SpecialPoint};
use num_complex::Complex64;
use std::f64::consts::PI;

/// Result of the inspection of a step, in the order of travel.
pub enum Found {
    /// A special point.
    Special(Box<SpecialPoint>),
    /// An inserted point, with the step to the next point.
    Inserted(Box<Station>, f64),
}

/// Basis on which folds and branch points between two stations are detected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FoldTest {
    /// The slope of the parameter along the branch, and the spectrum.
    Slope,
    /// The spectrum alone, because the slope is lost in rounding.
    Spectrum,
    /// None: the parameter does not change, and no multiplier passes 1.
    None,
}

/// Maximum number of halvings of one step, after which the rest is recorded as unexplained.
const DEEPEST: usize = 14;

/// Distance on one mesh below which rounding prevents telling two points of a curve apart.
const CLOSEST: f64 = 1e-11;

/// Number of halvings after which an event must show at the ends of an interval.
const CLOSE: usize = 6;

/// Distance from a codimension-two point, as a share of the step, within which a turn of the curve is attributed to it.
const TOGETHER: f64 = 1e-3;

/// Largest asymmetry of a located pitchfork: the square root of the accuracy of its location.
const SYMMETRIC: f64 = 3e-3;

/// Share of a step within which a linearly extrapolated monitor must change sign to be suspected of touching zero.
const WELL: f64 = 0.75;

/// Number of parts of a step at whose ends it is cut where a monitor may touch zero: coarse enough for the cut not to depend
/// on rounding.
const PLACES: f64 = 16.0;

/// Length of a step along a branch of cycles beyond which, and angle below which, monitors are seen between its ends too: half of
/// the longest step, and a tenth of the angle at which steps aim.
const LONG: [f64; 2] = [0.1, 0.025];

/// Values of all monitors at the point before an interval, for the test for tangency.
#[derive(Clone, Debug)]
pub struct History {
    /// Distance of that point from the left end.
    pub distance: f64,
    /// Values there, one per monitor.
    pub values: Vec<f64>,
    /// Values there, one per mark.
    pub marks: Vec<f64>,
    /// True if the solution there belongs to a family at a single parameter value (a vertical branch).
    pub stands: bool,
    /// Eigenvalues or multipliers there.
    pub spectrum: Vec<Complex64>,
}

impl Follow<'_> {
    /// Values of all monitors at a station.
    pub fn monitored(&self, station: &Station) -> Vec<f64> {
        self.monitors.iter().map(|m| m.value(&station.point, &station.point)).collect()
    }

    /// Selects the test for folds and branch points between two stations.
    ///
    /// On a vertical branch (a family at a single parameter value) a second multiplier is 1 within its error, and
    /// neither its side of 1 nor the sign of the slope is significant; equilibria have an eigenvalue 0 there. Near an
    /// orbit of infinite period the matrix is as ill-conditioned as the multipliers are far apart, so rounding reaches
    /// further: a change of the parameter below the error of both points is not significant either, as long as no
    /// multiplier comes near 1. In a canard explosion the slope is lost in errors and rounding while a multiplier
    /// passes 1. That is a fold, and the spectrum alone locates it.
    ///
    /// A step that enters or leaves a vertical branch, for instance at the amplitude at which a stop is first touched,
    /// has one end in the family. `stands` is true if the preceding step lay in it.
    fn fold_test(&self, [left, right]: [&Station; 2], length: f64, stands: bool) -> FoldTest {
        let certain = left.point.unstable == right.point.unstable && is_far(&left.point) && is_far(&right.point);
        let slope = left.slope().abs().max(right.slope().abs());
        let unseen = UNSEEN * self.settings.tolerance;
        if left.mesh.is_empty() {
            return if slope < STANDS { FoldTest::None } else { FoldTest::Slope };
        }
        // An error that is not small beside the distance from 0 to 1 says nothing about a family that is only entered.
        let entered = right.point.is_one_of_family() && right.point.neutral_error() < 0.1;
        let family = stands && (left.point.is_one_of_family() || right.point.is_one_of_family()) || entered;
        if certain && slope * length.min(1.0) < unseen || family {
            return FoldTest::None;
        }
        if slope < STANDS.max(unseen) { FoldTest::Spectrum } else { FoldTest::Slope }
    }

    /// Finds all special points between two stations.
    pub fn inspect(
        &mut self,
        left: &Station,
        right: &Station,
        history: Option<&History>,
        depth: usize,
        cost: &mut Cost,
    ) -> Vec<Found> {
        // Special points closer together than the agreement of two meshes are distinguished on one of them.
        let mut stretch = Stretch::new(self.problem, left, right, self.direction);
        let short = self.is_short(&left.mesh, stretch.length);
        let carried = if short && self.settings.stability && right.mesh != left.mesh {
            self.carried(right, &left.mesh, stretch.length, cost)
        } else {
            None
        };
        if let Some(carried) = &carried {
            stretch = Stretch::new(self.problem, left, carried, self.direction);
        }
        let right = carried.as_ref().unwrap_or(right);
        let (at_left, at_right) = (self.monitored(left), self.monitored(right));
        if depth == 0 {
            self.inspected = stretch.length.abs();
        }
        let fold_test = self.fold_test([left, right], self.inspected, history.is_some_and(|before| before.stands));
        let standing = fold_test == FoldTest::None;
        let conservative = standing && [left, right].iter().all(|end| end.point.is_conservative());
        let mut located: Vec<(Kind, usize, Located)> = Vec::new();
        let mut others: Vec<Option<usize>> = Vec::new();
        let (mut lost, mut leaps) = (false, false);
        for k in 0..self.monitors.len() {
            let values = [at_left[k], at_right[k]];
            let mut kind = self.monitors[k].kind();
            let pitchfork = kind == Kind::BranchPoint
                && located.iter().any(|(kind, jump, _)| *kind == Kind::BranchPoint && *jump == 0);
            let without = match kind {
                Kind::Fold => standing,
                Kind::BranchPoint => fold_test != FoldTest::Slope && !conservative,
                // Reciprocal pairs of multipliers have product 1 everywhere.
                Kind::Torus => conservative,
                _ => false,
            };
            if pitchfork || without {
                continue;
            }
            let own = &*self.monitors[k];
            let by_spectrum = own.by_spectrum().filter(|_| fold_test == FoldTest::Spectrum || conservative);
            let monitor = by_spectrum.as_deref().unwrap_or(own);
            let values = match &by_spectrum {
                Some(other) => [left, right].map(|station| other.value(&left.point, &station.point)),
                None if own.is_oriented() => [left, right].map(|station| own.value(&left.point, &station.point)),
                None => values,
            };
            if (values[0] > 0.0) == (values[1] > 0.0) || values.iter().any(|v| v.is_nan()) {
                continue;
            }
            let mut jump = monitor.jump();
            let mut found = locate(self.problem, self.settings, &stretch, monitor, values, cost);
            let singular = matches!(kind, Kind::Fold | Kind::BranchPoint) || kind.has_codimension_two();
            if found.is_err() && singular {
                found = straddle(self.problem, self.settings, &stretch, monitor, values, cost);
                // A singular matrix at which the parameter turns and stability does not change is a pitchfork;
                // otherwise the step has cut across to another branch.
                if kind == Kind::Fold && left.point.unstable == right.point.unstable && !self.settings.is_symmetric() {
                    found = Err(Failure::Unexplained);
                }
            }
            if kind == Kind::BranchPoint
                && let Ok(found) = &mut found
            {
                head_along(self.problem, &stretch, found);
            }
            // This branch leaves another one at a pitchfork and continues as its own mirror image. (Along a curve of
            // bifurcation points a symmetric solution may simply turn.)
            if kind == Kind::Fold
                && self.settings.stability
                && left.point.unstable == right.point.unstable
                && !self.passes_critical(left, right)
                && found.as_ref().is_ok_and(|found| {
                    // In a symmetric model the symmetry decides; a fold next to a branch point looks like a vertex from afar.
                    self.is_mirrored([left, right], &found.station.point)
                        || !self.settings.is_symmetric() && self.is_vertex(&stretch, found.distance, cost)
                })
            {
                (kind, jump) = (Kind::BranchPoint, 0);
            }
            match found {
                Ok(found) if monitor.confirms_between([&left.point, &right.point], &found.station.point) => {
                    let (ends, at) = ([&left.point, &right.point], &found.station.point);
                    if passes_through(kind, &Around { ends, at, length: stretch.length, error: found.error }) {
                        kind = Kind::BranchPoint;
                    }
                    located.push((kind, jump, found));
                    others.push(monitor.others_unstable(&located[located.len() - 1].2.station.point));
                }
                Ok(_) => {}
                // At this distance an event of this kind would show at the ends. If it does not, there is none, as when
                // two real multipliers have product 1.
                Err(_) if depth >= CLOSE && jump > 0 && !self.either_confirms(k, left, right) => {
                    leaps |= kind == Kind::PeriodDoubling
                }
                Err(_) => lost = true,
            }
        }
        let mut cut_there = None;
        let quiet = located.is_empty() && !lost && left.point.unstable == right.point.unstable;
        let found: Vec<usize> = located.iter().map(|(_, jump, _)| *jump).collect();
        let fits = !lost && explains(&found, left.point.unstable as i64, right.point.unstable as i64);
        let touching = match self.settings.stability && fold_test == FoldTest::Slope {
            true => self.touching(&stretch, &right.point, history, depth, cost),
            false => None,
        };
        let touching = touching.map(|found| if quiet { found } else { Exchange::Apart(0.5 * stretch.length) });
        let even = matches!(touching, Some(Exchange::Together(..)));
        if touching.is_some() || self.settings.stability && fits && fold_test == FoldTest::Slope && depth < CLOSE {
            match touching.or_else(|| self.exchanged(&stretch, &right.point, history, cost)) {
                Some(Exchange::Apart(there)) => cut_there = Some(there),
                Some(Exchange::Together(kind, found)) if quiet => {
                    let (times, jump) = match kind {
                        Kind::PeriodDoubling => (2, 1),
                        Kind::Hopf | Kind::Torus => (2, 2),
                        _ => (1, 0),
                    };
                    for _ in 0..times {
                        located.push((kind, jump, (*found).clone()));
                        others.push(None);
                    }
                }
                Some(Exchange::Together(..)) | None => {}
            }
        }
        // If both ∏(μ + 1) and ∏(μ - 1) change sign and neither vanishes, a large multiplier has changed sign. That is
        // impossible along a branch: the step has cut across to another one with as many unstable multipliers.
        let above = |point: &Point| point.free_spectrum().iter().filter(|z| z.im == 0.0 && z.re > 1.0).count();
        let turns = located.iter().any(|(kind, ..)| matches!(kind, Kind::Fold | Kind::BranchPoint));
        lost |= leaps && !turns && above(&left.point) % 2 != above(&right.point) % 2;
        // The curve may also turn at a codimension-two point, which is not a separate event.
        let double: Vec<f64> =
            located.iter().filter(|(kind, ..)| kind.has_codimension_two()).map(|(.., found)| found.distance).collect();
        let apart = TOGETHER * stretch.length.abs();
        located.retain(|(kind, _, found)| {
            kind.has_codimension_two() || double.iter().all(|there| (found.distance - there).abs() > apart)
        });
        located.sort_by(|a, b| a.2.distance.total_cmp(&b.2.distance));
        let mut jumps: Vec<usize> = located.iter().map(|(_, jump, _)| *jump).collect();
        let change = left.point.unstable.abs_diff(right.point.unstable);
        // All eigenvalues of a null space pass at one point.
        if let ([(Kind::BranchPoint, _, found)], true) = (&located[..], self.settings.stability && change > 1) {
            let (ends, at) = ([&left.point, &right.point], &found.station.point);
            let around = Around { ends, at, length: stretch.length, error: found.error };
            let null = around.vanishing(if is_cycle(left) { 1.0 } else { 0.0 });
            if change <= null && (null - change).is_multiple_of(2) {
                jumps[0] = change;
            }
        }
        // A single located event must agree with the rest of its spectrum; otherwise there is another event on one side
        // of it.
        let counts = [left.point.unstable, right.point.unstable];
        let misfit = match (&located[..], &others[..]) {
            ([(_, jump, found)], [Some(others)]) if *jump > 0 && self.settings.stability => {
                let side = counts.iter().position(|count| *count != *others && *count != others + jump);
                side.map(|side| 0.5 * (found.distance + if side == 0 { 0.0 } else { stretch.length }))
            }
            _ => None,
        };
        let accounted = !self.settings.stability
            || explains(&jumps, left.point.unstable as i64, right.point.unstable as i64)
            || (standing && jumps.is_empty() && change == 1);
        // A sign change that could not be located is not ignored either, not even next to one that could.
        let closer = jumps.is_empty() || depth < CLOSE;
        let explained = accounted && !(lost && closer && self.settings.stability);
        // Along bifurcation curves monitors may jump as well. But if the count changes along with a monitor that could
        // not be located, the meshes of the two ends disagree about the position; closer together they agree.
        let misplaced = !self.settings.stability && lost && jumps.is_empty() && change > 0;
        let touched = history.filter(|_| depth < 3).and_then(|h| {
            let doubled =
                || (jumps.is_empty() && may_double(h, left, right, stretch.length)).then_some(0.5 * stretch.length);
            self.touched(h, &at_left, &at_right, stretch.length).or_else(doubled)
        });
        let suspicious = touched.is_some() || depth < 3 && !standing && stretch.may_turn_twice();
        // On a first step nothing is known about the rates of change of monitors; at equilibria an extra look is cheap, and
        // where a branch is straight its solutions do not tell how fast multipliers change.
        let mut seen = cut_there;
        let long = self.settings.stability
            && stretch.length.abs() > LONG[0]
            && stretch.turn < LONG[1]
            && Degeneracy::of(&left.point).is_none();
        let unknown =
            history.is_none() || left.mesh.is_empty() || may_double_unseen(left, right, stretch.length) || long;
        if depth == 0 && unknown && seen.is_none() {
            // What is located may lie between two zeros of another monitor.
            let ends = [&at_left[..], &at_right[..]];
            seen = self.seen_between(&stretch, ends, (history.is_none(), jumps.is_empty()), cost);
        }
        let suspicious = suspicious || seen.is_some();
        if depth < DEEPEST
            && work(cost.factorisations, &left.mesh) < ALLOWANCE
            && (jumps.len() > 1 || !explained || misplaced || misfit.is_some() || cut_there.is_some() || suspicious)
            && stretch.length.abs() > if short { CLOSEST } else { self.settings.min_step }
        {
            let cut = match &located[..] {
                [a, .., b] => 0.5 * (a.2.distance + b.2.distance),
                _ => misfit.or(cut_there).or(seen).or(touched).unwrap_or(0.5 * stretch.length),
            };
            // Neighbouring special points that can no longer be told apart stay together.
            let together = if short { CLOSEST } else { 1e-7 * (1.0 + stretch.length) };
            let apart = located.len() < 2 || located[located.len() - 1].2.distance - located[0].2.distance > together;
            // Newton's method may fail exactly at the cut.
            let places = [cut, 0.5 * cut, 0.5 * (cut + stretch.length)];
            let mut middle = None;
            for place in places.into_iter().filter(|_| apart) {
                let Some(found) = self.cut(left, &stretch, place, cost) else { continue };
                // At the special point itself rounding decides on which side the eigenvalues are.
                let undecided = self.is_undecided(&found) && !self.is_undecided(left) && !self.is_undecided(right);
                if middle.is_none() || !undecided {
                    middle = Some((place, found));
                }
                if !undecided {
                    break;
                }
            }
            if let Some((cut, middle)) = middle {
                let rest = stretch.length - cut;
                let before = self.inspect(left, &middle, history, depth + 1, cost);
                let spectrum = left.point.spectrum.clone();
                let (values, marks) = (at_left.clone(), self.marked(left));
                let next = History { distance: cut, values, marks, spectrum, stands: left.point.is_one_of_family() };
                let after = self.inspect(&middle, right, Some(&next), depth + 1, cost);
                let inserted = Found::Inserted(Box::new(middle), rest);
                return before.into_iter().chain([inserted]).chain(after).collect();
            }
        }
        let known: Vec<(f64, Point)> =
            located.iter().map(|(.., found)| (found.distance, found.station.point.clone())).collect();
        let mut marks = self.marks_on(&stretch, right, history, &known, cost).into_iter().peekable();
        if !explained && let Some(together) = self.simultaneous(&stretch, right, fold_test, cost) {
            let count = left.point.unstable as i64;
            let mut out: Vec<Found> = Vec::new();
            for mark in marks {
                out.push(self.marked_there(mark, count));
            }
            return out.into_iter().chain(together).collect();
        }
        let mut count = left.point.unstable as i64;
        let mut out = Vec::new();
        let total = located.len();
        let opposite = quiet && total == 2;
        for (index, (kind, _, found)) in located.into_iter().enumerate() {
            while let Some(mark) = marks.next_if(|(_, mark, _)| mark.distance < found.distance) {
                out.push(self.marked_there(mark, count));
            }
            let target = right.point.unstable as i64;
            let next = match (index + 1 == total, explained) {
                (true, true) => target,
                (_, true) => leading_to(count, target, jumps[index], &jumps[index + 1..]),
                (_, false) => step_towards(count, target, jumps[index]),
            };
            // The multipliers of a torus may need more phases than the torus does, and its meshes do not show that.
            let doubtful = self.problem.is_switched() || matches!(found.station.point.solution, Solution::Torus(_));
            let rate = if doubtful { self.rate_beside(&found.station) } else { 0.0 };
            let null = match kind {
                Kind::BranchPoint if self.settings.stability => {
                    let (ends, at) = ([&left.point, &right.point], &found.station.point);
                    let around = Around { ends, at, length: stretch.length, error: found.error };
                    if even { 2 } else { around.vanishing(if is_cycle(left) { 1.0 } else { 0.0 }) }
                }
                Kind::PeriodDoubling if opposite => 2,
                _ => 1,
            };
            let mut special = self.special(kind, found.station, count, next, found.error);
            special.remark = match kind {
                Kind::BranchPoint if null > 1 => format!("{NULL_SPACE}{null}"),
                Kind::PeriodDoubling if null > 1 => format!("the multiplier -1 has multiplicity {null}"),
                _ => special.remark,
            };
            if rate > 0.0 {
                special.error += rate * self.displacement(&stretch, right, &special);
            }
            out.push(Found::Special(special));
            count = next;
        }
        for mark in marks {
            out.push(self.marked_there(mark, count));
        }
        if !explained {
            let width = (left.parameter() - right.parameter()).abs() / (1.0 + right.parameter().abs());
            if change > 0 || total > 0 || lost {
                out.push(Found::Special(self.special(
                    Kind::Unexplained,
                    right.clone(),
                    count,
                    right.point.unstable as i64,
                    width,
                )));
            }
        }
        out
    }

    /// True if the number of unstable eigenvalues or multipliers is the same on both sides of a turning point. A branch
    /// born at a pitchfork turns there while an eigenvalue touches zero and returns, so the turning point is a branch
    /// point rather than a fold, at which the number changes.
    fn is_vertex(&mut self, stretch: &Stretch, there: f64, cost: &mut Cost) -> bool {
        /// Distance of the comparison points, as a share of the step. Empirical: far enough for the eigenvalue to
        /// exceed its error, near enough to exclude other events.
        const CLOSE_BY: f64 = 0.05;
        let room = there.abs().min((stretch.length - there).abs());
        let beside = (CLOSE_BY * stretch.length.abs()).min(0.5 * room);
        let mut count = |s: f64| Some(stretch.at(self.problem, self.settings, s, cost).ok()?.point.unstable);
        count(there - beside).is_some_and(|before| count(there + beside) == Some(before))
    }

    /// Finds simultaneous events, too close together to be separated, for instance in different parts of a symmetric or
    /// decoupled system. Between two points that coincide within their errors, the eigenvalues or multipliers of each
    /// kind that have changed stability are counted. A branch point counts once however many eigenvalues pass: their
    /// number is the dimension of the kernel.
    fn simultaneous(
        &mut self,
        stretch: &Stretch,
        right: &Station,
        fold_test: FoldTest,
        cost: &mut Cost,
    ) -> Option<Vec<Found>> {
        let (whole, ends) = (right, self.narrowed(stretch, right, cost));
        let [left, right] = [&ends[0], &ends[1]];
        let error = discrepancy(
            self.settings,
            &left.point,
            &right.point,
            left.parameter() - right.parameter(),
            right.parameter(),
        );
        if !self.settings.stability || error > self.settings.tolerance {
            return None;
        }
        let turns = fold_test == FoldTest::Spectrum || left.slope() * right.slope() < 0.0;
        let mut passed: Vec<(Kind, i64, i64)> = Vec::new();
        for monitor in self.monitors {
            let (Some(before), Some(after)) = (monitor.passed(&left.point), monitor.passed(&right.point)) else {
                continue;
            };
            let times = after as i64 - before as i64;
            let kind = if turns && times.abs() == 1 && monitor.kind() == Kind::BranchPoint {
                Kind::Fold
            } else {
                monitor.kind()
            };
            if times != 0 {
                passed.push((kind, times, monitor.jump() as i64));
            }
        }
        // Pairs that pass through 0 (1) itself belong to the null space.
        let outer = [&stretch.left.point, &whole.point];
        let around = Around { ends: outer, at: &right.point, length: stretch.length, error };
        let at_zero: i64 = match passed.iter().position(|(kind, ..)| passes_through(*kind, &around)) {
            Some(index) => {
                let (_, times, jump) = passed.swap_remove(index);
                times * jump
            }
            None => 0,
        };
        if at_zero != 0 {
            let own = passed.iter().position(|(kind, ..)| matches!(kind, Kind::BranchPoint | Kind::Fold));
            let rest = own.map_or(0, |index| passed.swap_remove(index).1);
            passed.push((Kind::BranchPoint, at_zero + rest, 1));
        }
        if passed.is_empty() && turns && self.is_symmetric(&right.point) {
            return Some(self.fold_with_pitchfork(right, error));
        }
        let change: i64 = passed.iter().map(|(_, times, jump)| times * jump).sum();
        // A pair that meets on the real axis off the unit circle is not an event.
        let met = passed
            .iter()
            .any(|(_, times, jump)| *jump == 2 && passed.iter().any(|(_, other, own)| *own == 1 && times * other < 0));
        // A multiplier far from the unit circle that is computed with another sign has not passed it.
        let flipped = matches!(&passed[..], [(_, one, 1), (_, other, 1)] if one + other == 0)
            && is_far(&left.point)
            && is_far(&right.point);
        if passed.is_empty() || met || flipped || change != right.point.unstable as i64 - left.point.unstable as i64 {
            return None;
        }
        passed.sort_by_key(|(_, times, _)| *times);
        let (mut count, mut out) = (left.point.unstable as i64, Vec::new());
        for (kind, times, jump) in passed {
            let (steps, change) =
                if jump == 1 && kind == Kind::BranchPoint { (1, times) } else { (times.abs(), times.signum() * jump) };
            for _ in 0..steps {
                let mut special = self.special(kind, right.clone(), count, count + change, error);
                let null = around.vanishing(if is_cycle(right) { 1.0 } else { 0.0 });
                special.remark = match kind {
                    Kind::PeriodDoubling if steps > 1 => format!("the multiplier -1 has multiplicity {steps}"),
                    Kind::BranchPoint if null > 1 => format!("{NULL_SPACE}{null}"),
                    _ => special.remark,
                };
                out.push(Found::Special(special));
                count += change;
            }
        }
        Some(out)
    }

    /// A fold of symmetric solutions that leaves the count unchanged, and the pitchfork beside it, too close to be
    /// separated. Next to an orbit of infinite period the multiplier m² of the whole cycle follows from the multiplier
    /// m of half of it. m passes 1 at the fold and -1 at the pitchfork, and is small in between.
    fn fold_with_pitchfork(&mut self, there: &Station, error: f64) -> Vec<Found> {
        let count = there.point.unstable as i64;
        let between = if count > 0 { count - 1 } else { 1 };
        let kinds = [(Kind::Fold, count, between), (Kind::BranchPoint, between, count)];
        kinds.map(|(kind, a, b)| Found::Special(self.special(kind, there.clone(), a, b, error))).into()
    }

    /// True if a symmetry of the model maps the solution to itself, possibly with a phase shift.
    fn is_symmetric(&self, at: &Point) -> bool {
        let mut images = self.settings.images();
        images.any(|r| at.difference(at, self.settings.measure(), r) < SYMMETRIC)
    }

    /// Brackets the changes in the number of unstable eigenvalues or multipliers on an interval by bisection, as tightly as
    /// points can be distinguished: the first one and, if it leads to another number than that at the right end, the last.
    fn narrowed(&mut self, stretch: &Stretch, right: &Station, cost: &mut Cost) -> [Station; 2] {
        let [before, after] = [stretch.left.point.unstable, right.point.unstable];
        let whole = [(stretch.left.clone(), 0.0), (right.clone(), stretch.length)];
        if before == after {
            return whole.map(|(station, _)| station);
        }
        let [last, next] = self.bisected(stretch, whole, &|count| count == before, cost);
        if next.0.point.unstable == after {
            return [last.0, next.0];
        }
        let rest = [next, (right.clone(), stretch.length)];
        let [_, settled] = self.bisected(stretch, rest, &|count| count != after, cost);
        [last.0, settled.0]
    }

    /// Narrows an interval between two positions; the number of unstable eigenvalues or multipliers equals the given
    /// one at the first and differs from it at the second.
    fn bisected(
        &mut self,
        stretch: &Stretch,
        mut ends: [(Station, f64); 2],
        first: &dyn Fn(usize) -> bool,
        cost: &mut Cost,
    ) -> [(Station, f64); 2] {
        while (ends[1].1 - ends[0].1).abs() > CLOSEST {
            let middle = 0.5 * (ends[0].1 + ends[1].1);
            let Ok(found) = stretch.at(self.problem, self.settings, middle, cost) else { break };
            let side = usize::from(!first(found.point.unstable));
            ends[side] = (found, middle);
        }
        ends
    }

    /// True if a branch of asymmetric solutions passes through a symmetric one at `at` and continues as its own mirror
    /// image: the ranges of `at` are symmetric and those of both ends are less so. Along a branch of symmetric
    /// solutions all three are symmetric.
    fn is_mirrored(&self, ends: [&Station; 2], at: &Point) -> bool {
        let (measure, tolerance) = (self.settings.measure(), self.settings.tolerance);
        self.settings.images().any(|r| {
            let here = at.difference(at, measure, r);
            let least = 2.0 * here.max(tolerance);
            here < SYMMETRIC && ends.iter().all(|end| end.point.difference(&end.point, measure, r) > least)
        })
    }

    fn either_confirms(&self, monitor: usize, left: &Station, right: &Station) -> bool {
        self.monitors[monitor].confirms(&left.point) || self.monitors[monitor].confirms(&right.point)
    }

    /// Relative change of parameter and states per unit length along the branch.
    fn rate_beside(&mut self, at: &Station) -> f64 {
        self.place(at);
        let rate = at.slope().abs() / (1.0 + at.parameter().abs());
        rate.max(self.problem.relative_size(&at.tangent, &at.u))
    }

    /// Displacement along the branch of a special point on a cycle with discontinuous f_x, or on a torus: the error of the critical
    /// multiplier over the rate at which it crosses the unit circle. On smooth fields the comparison of two meshes
    /// provides it, and folds lie where the branch turns, whatever the multipliers.
    fn displacement(&self, stretch: &Stretch, right: &Station, special: &SpecialPoint) -> f64 {
        let critical = matches!(special.kind, Kind::PeriodDoubling | Kind::Torus | Kind::BranchPoint);
        if !critical {
            return 0.0;
        }
        let growth = |z: &Complex64| z.norm().ln();
        let of = |at: &Point, target: Complex64| {
            let off = |z: &Complex64| (z - target).norm();
            at.free_spectrum().iter().copied().min_by(|a, b| off(a).total_cmp(&off(b)))
        };
        let point = &special.point;
        let own = point.free_spectrum().iter().copied().min_by(|a, b| growth(a).abs().total_cmp(&growth(b).abs()));
        let beside = own.and_then(|own| Some([of(&stretch.left.point, own)?, of(&right.point, own)?]));
        let Some([before, after]) = beside else { return 0.0 };
        let rate = (growth(&after) - growth(&before)).abs() / stretch.length.abs();
        let shift = point.trust.spectrum / rate;
        if shift.is_finite() { shift } else { 0.0 }
    }

    /// A mark, where `count` eigenvalues or multipliers are unstable.
    fn marked_there(&mut self, (kind, mark, remark): (Kind, Located, String), count: i64) -> Found {
        let special = self.special(kind, mark.station, count, count, mark.error);
        Found::Special(Box::new(SpecialPoint { remark, ..*special }))
    }

    pub(super) fn special(
        &mut self,
        kind: Kind,
        mut station: Station,
        before: i64,
        after: i64,
        error: f64,
    ) -> Box<SpecialPoint> {
        if station.point.trust.spectrum.is_nan() {
            self.place(&station);
            if self.problem.factorise(&station.u, &station.tangent).is_ok() {
                doubted(self.problem, &mut station);
            }
        }
        self.count(&mut station);
        // On non-smooth fields a parameter is no more accurate than the profile, and two meshes may agree by chance.
        let least = if self.problem.is_switched()
            && !matches!(
                kind,
                Kind::Mark | Kind::Grazing | Kind::Sliding | Kind::ImpactGrazing | Kind::BoundaryEquilibrium
            ) {
            station.point.trust.discretisation
        } else {
            0.0
        };
        let error = error.max(least);
        let (before, after) = if self.direction > 0.0 { (before, after) } else { (after, before) };
        Box::new(SpecialPoint {
            kind,
            point: station.point,
            unstable_before: before.max(0) as usize,
            unstable_after: after.max(0) as usize,
            error,
            coefficients: Vec::new(),
            coefficient_errors: Vec::new(),
            remark: String::new(),
        })
    }

    /// Distance at which some monitor has a different sign than at the left end, if one is found; unless `all`, only of
    /// monitors with the same sign at both ends. `first` is true if nothing is known of the preceding step: equilibria,
    /// which are cheap, are then sampled more densely towards both ends. For cycles the midpoint shows the rates of change
    /// of the monitors, which suffices if none may have touched zero.
    fn seen_between(
        &mut self,
        stretch: &Stretch,
        [at_left, at_right]: [&[f64]; 2],
        (first, all): (bool, bool),
        cost: &mut Cost,
    ) -> Option<f64> {
        const PLACES: [f64; 15] =
            [0.5, 0.25, 0.75, 0.125, 0.375, 0.625, 0.875, 0.0625, 0.1875, 0.03, 0.015, 0.007, 0.003, 0.001, 0.97];
        let cycles = !stretch.left.mesh.is_empty();
        let count = if first && !cycles { PLACES.len() } else { 3 };
        let differ = |a: f64, b: f64| (a > 0.0) != (b > 0.0);
        let returns: Vec<bool> = at_left.iter().zip(at_right).map(|(a, b)| all || !differ(*a, *b)).collect();
        let differs = |here: &[f64]| (0..here.len()).any(|k| returns[k] && differ(here[k], at_left[k]));
        let sight = self.monitors.iter().map(|monitor| monitor.reads()).max().unwrap_or(Sight::Tangent);
        let mut known = vec![(0.0, at_left.to_vec()), (1.0, at_right.to_vec())];
        for (k, share) in PLACES[..count].iter().enumerate() {
            let s = share * stretch.length;
            let Ok(found) = stretch.seen_at(sight, self.problem, self.settings, s, cost) else { continue };
            let here = self.monitored(&found);
            if differs(&here) {
                return Some(s);
            }
            if k == 0 && first && cycles {
                let half = s.abs();
                let from = |values: &[f64]| History {
                    distance: half,
                    values: values.to_vec(),
                    marks: Vec::new(),
                    spectrum: Vec::new(),
                    stands: false,
                };
                let beside = [(at_left, at_right), (at_right, at_left)];
                if beside.iter().all(|(before, after)| self.touched(&from(before), &here, after, half).is_none()) {
                    return None;
                }
            }
            known.push((*share, here));
        }
        if cycles {
            return None;
        }
        // Two zeros may lie between neighbouring places.
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        let suspected = |three: &[(f64, Vec<f64>)]| {
            let [a, b, c] = [&three[0], &three[1], &three[2]];
            self.dips([a, b, c]).or_else(|| self.dips([c, b, a]))
        };
        let places: Vec<f64> = known.windows(3).filter_map(suspected).collect();
        places.into_iter().map(|share| share * stretch.length).find(|s| {
            let found = stretch.seen_at(sight, self.problem, self.settings, *s, cost);
            found.is_ok_and(|found| differs(&self.monitored(&found)))
        })
    }

    /// True if a real eigenvalue passes 0, or a real multiplier 1, between two stations: their numbers beyond differ, and none
    /// is so close to it that errors decide on its side.
    fn passes_critical(&self, left: &Station, right: &Station) -> bool {
        /// Distance, relative to the largest eigenvalue or multiplier, that errors do not reach: a hundred times the default
        /// tolerance.
        const CLEAR: f64 = 1e-4;
        let centre = if is_cycle(left) { 1.0 } else { 0.0 };
        let beyond = |station: &Station| {
            let all = station.point.free_spectrum();
            let size = all.iter().map(|z| z.norm()).fold(centre, f64::max);
            let real = || all.iter().filter(|z| z.im == 0.0);
            let clear = real().all(|z| (z.re - centre).abs() > CLEAR * size);
            clear.then(|| real().filter(|z| z.re > centre).count())
        };
        beyond(left).zip(beyond(right)).is_some_and(|(left, right)| left != right)
    }

    /// True if rounding decides whether some eigenvalue or multiplier is stable. Beside a point where branches cross, rounding
    /// of f displaces an equilibrium, and thereby its eigenvalue, more than elsewhere.
    pub(super) fn is_undecided(&mut self, station: &Station) -> bool {
        /// Distance from the border, relative to the largest eigenvalue or multiplier.
        const ROUNDING: f64 = 1e-13;
        /// Distance from 0 of an eigenvalue, relative to the largest, beyond which no displacement matters: an equilibrium is
        /// displaced by at most the square root of the accuracy of a number where its matrix can still be solved with.
        const NEAR: f64 = 1e-7;
        let spectrum = station.point.free_spectrum();
        let sizes = spectrum.iter().map(|z| z.norm());
        let (least, largest) = sizes.fold((f64::INFINITY, f64::MIN_POSITIVE), |(a, b), z| (a.min(z), b.max(z)));
        let off = |z: &Complex64| if is_cycle(station) { z.norm() - 1.0 } else { z.re };
        spectrum.iter().any(|z| off(z).abs() <= ROUNDING * largest)
            || !is_cycle(station) && least < NEAR * largest && least <= self.problem.blur(&station.u, &station.tangent)
    }

    /// Computes a full station at distance s of the interval.
    pub(super) fn cut(&mut self, left: &Station, stretch: &Stretch, s: f64, cost: &mut Cost) -> Option<Station> {
        let u = stretch.corrected(self.problem, self.settings, s, cost).ok()?;
        if self.settings.stability && self.is_short(&left.mesh, stretch.length) {
            let close = self.settings.closeness(&left.mesh, stretch.length);
            let mut found = self.unrefined(left, u, close, cost).ok()?;
            self.count(&mut found);
            return Some(found);
        }
        let care = self.care(left, s);
        let row = left.tangent.clone();
        let mut found = refine(self.problem, self.settings, care, row, u, self.direction, cost).ok()?;
        self.count(&mut found);
        Some(found)
    }

    /// True if the step may have jumped to another branch at a pitchfork: an unstable multiplier approached 1 so fast
    /// that it would be well beyond it at the end of the step, yet it is no closer there. On the branch itself it
    /// touches 1 where the branch turns into its own mirror image; on the other branch it grows again.
    pub(super) fn may_jump(&self, [left, right]: [&Station; 2], history: Option<&History>, length: f64) -> bool {
        let (Some(history), true) = (history, self.settings.stability) else { return false };
        let above = |spectrum: &[Complex64]| above_critical(spectrum, is_cycle(left));
        let all = [&history.spectrum, &left.point.spectrum, &right.point.spectrum].map(|spectrum| above(spectrum));
        let [Some(before), Some(now), Some(then)] = all else { return false };
        now + WELL * length * (now - before) / history.distance < 0.0 && then > WELL * now
    }

    /// Place between the last two of three values at which some monitor may have crossed zero before it returned: where
    /// the parabola through the values is close to zero or beyond it, or the middle if the line through the first two
    /// changes sign well before the last. `None` if every monitor stays clear of zero.
    fn touched(&self, history: &History, left: &[f64], right: &[f64], length: f64) -> Option<f64> {
        (0..left.len()).find_map(|k| {
            let (a, b, c) = (history.values[k], left[k], right[k]);
            if self.monitors[k].kind() == Kind::BranchPoint || a * b <= 0.0 || b * c <= 0.0 {
                return None;
            }
            let (before, after) = ((b - a) / history.distance, (c - b) / length);
            let bend = (after - before) / (history.distance + length);
            let slope = after - bend * length;
            let at = -slope / (2.0 * bend);
            let value = b + at * (slope + bend * at);
            if bend * b > 0.0 && at > 0.0 && at < length && value / b < 0.1 {
                let place = (PLACES * at / length).round().clamp(1.0, PLACES - 1.0);
                return Some(place * length / PLACES);
            }
            ((b + WELL * length * before) * b < 0.0).then_some(0.5 * length)
        })
    }

    /// Place at which the parabola through the values of some monitor at three places `[a, b, c]` along a branch of equilibria
    /// turns beyond zero, between the last two, although the values have the same sign. `None` if there is none.
    fn dips(&self, [a, b, c]: [&(f64, Vec<f64>); 3]) -> Option<f64> {
        let keeps = |k: usize| a.1[k] * b.1[k] > 0.0 && b.1[k] * c.1[k] > 0.0;
        // Where the branch turns, the determinant changes sign with the slope, which shows it better.
        let turns = (0..b.1.len()).any(|k| self.monitors[k].kind() == Kind::Fold && !keeps(k));
        (0..b.1.len()).find_map(|k| {
            if !keeps(k) || turns && self.monitors[k].kind() == Kind::BranchPoint {
                return None;
            }
            let (before, after) = ((b.1[k] - a.1[k]) / (b.0 - a.0), (c.1[k] - b.1[k]) / (c.0 - b.0));
            let bend = (after - before) / (c.0 - a.0);
            let slope = before + bend * (b.0 - a.0);
            let at = -slope / (2.0 * bend);
            let beyond = (b.1[k] + at * (slope + bend * at)) * b.1[k] < 0.0;
            (beyond && at * (c.0 - b.0) > 0.0 && at.abs() < (c.0 - b.0).abs()).then_some(b.0 + at)
        })
    }
}

/// True if the pair located as a Hopf or torus point passes through 0 (multipliers: through 1) itself, so that the point
/// is one with a null space of two dimensions.
fn passes_through(kind: Kind, around: &Around) -> bool {
    match kind {
        Kind::Hopf => around.vanishing(0.0) > 1,
        Kind::Torus => around.vanishing(1.0) > 1,
        _ => false,
    }
}

/// True if the spectrum consists of multipliers.
fn is_cycle(station: &Station) -> bool {
    station.point.solution.period().is_some()
}

/// Logarithm of the smallest real multiplier above 1 (the smallest real eigenvalue above 0).
fn above_critical(spectrum: &[Complex64], cycle: bool) -> Option<f64> {
    /// Excludes the trivial multiplier, which is closer to 1.
    const LEAST: f64 = 1e-4;
    let real = spectrum.iter().filter(|z| z.im == 0.0).map(|z| z.re);
    let distances = real.filter(|x| *x > 0.0).map(|x| if cycle { x.ln() } else { x });
    distances.filter(|d| *d > if cycle { LEAST } else { 0.0 }).min_by(f64::total_cmp)
}

/// True if a pair of multipliers may have met on the negative real axis, passed -1 and returned: it is about as far
/// from the axis after the step as before it, and has moved fast enough to have been there.
fn may_double(history: &History, left: &Station, right: &Station, length: f64) -> bool {
    const FAST: f64 = 1.5;
    const RING: f64 = 1.0;
    if !is_cycle(left) {
        return false;
    }
    let spectra = [&history.spectrum, &left.point.spectrum, &right.point.spectrum];
    match spectra.map(|spectrum| from_negative_axis(spectrum, RING)) {
        [Some(before), Some(now), Some(then)] => now + then < FAST * (now - before).abs() / history.distance * length,
        _ => false,
    }
}

/// Angle from the negative real axis of the nearest pair of multipliers whose modulus has a logarithm within `ring`,
/// and which could therefore pass -1 once they are real.
fn from_negative_axis(spectrum: &[Complex64], ring: f64) -> Option<f64> {
    let pairs = spectrum.iter().filter(|z| z.im > 0.0 && z.norm().ln().abs() < ring);
    pairs.map(|z| PI - z.arg()).min_by(f64::total_cmp)
}

/// True if a pair of multipliers stays so close to the negative real axis over a long step that it may have met there,
/// passed -1 and returned. Its angle is the square root of a smooth function, so that the ends say little about the
/// middle.
fn may_double_unseen(left: &Station, right: &Station, length: f64) -> bool {
    is_cycle(left) && stays_near(&left.point.spectrum, &right.point.spectrum, length)
}

fn stays_near(now: &[Complex64], then: &[Complex64], length: f64) -> bool {
    const LONG: f64 = 0.05;
    const NEAR: f64 = 0.8;
    const RING: f64 = 0.2;
    let angles = from_negative_axis(now, RING).zip(from_negative_axis(then, RING));
    length.abs() > LONG && angles.is_some_and(|(now, then)| now + then < NEAR)
}

/// Change of the parameter, in tolerances, along a step of length at most 1 that the errors of both ends can produce.
/// Empirical: a share of the tolerance, which bounds the error of a point.
const UNSEEN: f64 = 0.2;
/// True if no multiplier is close to the unit circle.
fn is_far(point: &Point) -> bool {
    point.free_spectrum().iter().all(|z| z.norm().ln().abs() > CRITICAL)
}

/// Modulus of the logarithm of a multiplier beyond which one step does not bring it to 1: a safety factor of e³ = 20.
const CRITICAL: f64 = 3.0;

/// True if jumps of these sizes, each with either sign, lead from one count to the other.
fn explains(jumps: &[usize], from: i64, to: i64) -> bool {
    let mut reachable = vec![from];
    for &jump in jumps {
        reachable = reachable.iter().flat_map(|r| [r - jump as i64, r + jump as i64]).filter(|r| *r >= 0).collect();
        reachable.sort_unstable();
        reachable.dedup();
    }
    reachable.contains(&to)
}

/// Count after a jump from which the other jumps lead to the target.
fn leading_to(count: i64, target: i64, jump: usize, others: &[usize]) -> i64 {
    let first = step_towards(count, target, jump);
    let second = 2 * count - first;
    if second >= 0 && !explains(others, first, target) && explains(others, second, target) { second } else { first }
}

fn step_towards(count: i64, target: i64, jump: usize) -> i64 {
    if target > count || count < jump as i64 { count + jump as i64 } else { count - jump as i64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_explained_by_sums_of_jumps_only() {
        assert!(explains(&[], 2, 2));
        assert!(!explains(&[], 1, 2));
        assert!(explains(&[1], 1, 2) && explains(&[1], 1, 0) && !explains(&[1], 1, 1));
        assert!(explains(&[2], 0, 2) && !explains(&[2], 1, 2) && !explains(&[2], 1, 0));
        assert_eq!((leading_to(2, 1, 1, &[2]), leading_to(1, 1, 1, &[1]), leading_to(0, 3, 1, &[2])), (3, 0, 1));
        assert!(explains(&[1, 2], 0, 3) && !explains(&[1, 2], 0, 1) && explains(&[1, 1], 1, 1));
    }
    #[test]
    fn a_pair_close_to_minus_one_over_a_long_step_is_examined() {
        let pair = |modulus: f64, angle: f64| {
            let one = Complex64::from_polar(modulus, PI - angle);
            vec![Complex64::new(1.0, 0.0), one, one.conj(), Complex64::new(0.3, 0.0)]
        };
        assert!(
            stays_near(&pair(0.95, 0.3), &pair(0.97, 0.4), 0.1) && stays_near(&pair(0.95, 0.3), &pair(0.97, 0.4), -0.1)
        );
        assert!(!stays_near(&pair(0.95, 0.3), &pair(0.97, 0.4), 0.04), "a short step");
        assert!(!stays_near(&pair(0.95, 0.3), &pair(0.97, 0.6), 0.1), "far from the axis");
        assert!(!stays_near(&pair(0.7, 0.3), &pair(0.7, 0.3), 0.1), "far inside the circle");
        let real = [1.0, -0.9, -0.95, 0.3].map(|x| Complex64::new(x, 0.0));
        assert!(!stays_near(&pair(0.95, 0.3), &real, 0.1), "met already: the multipliers themselves show what they do");
    }
}
