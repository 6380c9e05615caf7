//! Lines: solutions followed in one of the two parameters, the other one fixed.

use super::super::growth::{self, Beginning, Growth, Line};
use super::super::plan::Wanted;
use super::super::{family, known};
use super::search::Search;
use crate::continuation::Settings;
use crate::diagram::{Branch, Kind, Origin, Point};
use crate::special::mark::Mark;
use crate::special::quantity::Quantity;

/// Positions in the range of the branch's parameter at which lines start: a compromise between cost and the width of what
/// may lie unseen between them.
pub(super) const PLACES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// Difference, relative to size, within which the end of a line is the start of another one.
const SAME: f64 = 1e-4;

impl Search<'_> {
    /// Values of the branch's parameter at which lines are followed.
    pub(super) fn places(&self) -> Vec<f64> {
        let [low, high] = self.design.range;
        PLACES.iter().map(|share| if *share < 1.0 { low + share * (high - low) } else { high }).collect()
    }

    /// Starts of lines on the branch: its solutions to be avoided at each place.
    pub(super) fn starts(&mut self, of: &Branch) -> Vec<Point> {
        let places = self.places();
        places.into_iter().flat_map(|place| self.passes(of, place)).filter(|point| self.avoided(point)).collect()
    }

    /// Solutions of a branch at a value of its parameter.
    pub(super) fn passes(&self, of: &Branch, place: f64) -> Vec<Point> {
        let settings = self.settings([f64::NEG_INFINITY, f64::INFINITY]);
        let value = |point: &Point| point.parameters.get(of.free).copied().unwrap_or(f64::NAN);
        let slack = 1e-9 * (self.design.range[1] - self.design.range[0]);
        let mut found: Vec<Point> = Vec::new();
        for end in [of.points.first(), of.points.last()].into_iter().flatten() {
            if (value(end) - place).abs() <= slack {
                found.extend(self.whole(of, end));
            }
        }
        let special = |a: &Point, b: &Point| {
            let own =
                |s: &&crate::diagram::SpecialPoint| a.position <= s.point.position && s.point.position < b.position;
            of.special.iter().filter(own).cloned().collect::<Vec<_>>()
        };
        for pair in of.points.windows(2) {
            let [a, b] = [&pair[0], &pair[1]];
            let between = special(a, b);
            let own = [value(a), value(b)].into_iter().chain(between.iter().map(|s| value(&s.point)));
            let (low, high) = own.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
            if !(low + slack < place && place < high - slack) {
                continue;
            }
            let (Some(a), Some(b)) = (self.whole(of, a), self.whole(of, b)) else { continue };
            let mut part = Branch::new(&of.name, of.family, of.free, of.origin.clone());
            part.units = of.units;
            (part.points, part.special) = (vec![a, b], between);
            found.extend(known::solutions_at(self.system, &settings, &part, place));
        }
        let mut distinct: Vec<Point> = Vec::new();
        for point in found {
            if !distinct.iter().any(|own| own.distance(&point, self.system.measure()) < SAME) {
                distinct.push(point);
            }
        }
        distinct
    }

    pub(super) fn settings(&self, range: [f64; 2]) -> Settings {
        growth::settings(self.system, self.plan.tolerance, range, self.design.max_points)
    }

    /// Follows solutions in the design parameter from `start` to `target`, or until they come back to its value there.
    pub(super) fn line(&mut self, start: &Point, name: &str, target: f64) -> Branch {
        let value = self.at(start)[1];
        let (range, sides) = match target >= value {
            true => ([value, target], [false, true]),
            false => ([target, value], [true, false]),
        };
        let marks = self.bound();
        let origin = Origin::Switch { parent: self.design.of.clone(), kind: Kind::Mark, parameter: self.at(start)[0] };
        self.leg(name, self.design.vary, range, sides, &marks, origin, start)
    }

    /// Follows the branch of `start` in its own parameter over the range.
    pub(super) fn diagram(&mut self, start: &Point, name: &str, line: &str) -> Branch {
        let origin = Origin::EndOf(line.to_string());
        self.leg(name, self.design.free, self.design.range, [true, true], &self.bound(), origin, start)
    }

    /// Mark of the bound, if the question has one.
    fn bound(&self) -> Vec<Mark> {
        match &self.design.wanted {
            Wanted::Below(level) => vec![Mark::at(level.quantity, level.value, false)],
            Wanted::NoMotion | Wanted::NotStable => Vec::new(),
        }
    }

    /// Follows one run, or takes it from an earlier attempt.
    #[expect(clippy::too_many_arguments, reason = "what a run needs")]
    fn leg(
        &mut self,
        name: &str,
        free: usize,
        range: [f64; 2],
        sides: [bool; 2],
        marks: &[Mark],
        origin: Origin,
        start: &Point,
    ) -> Branch {
        let name = format!("{}/{name}", self.design.name);
        let settings = self.settings(range);
        let growth = Growth {
            system: self.system,
            settings: &settings,
            degree: self.plan.degree,
            ties: Vec::new(),
            sides,
            parents: &[],
            marks,
            observer: self.observer,
            whole: true,
            sparse: false,
        };
        let known = self.earlier.branch(&name).filter(|branch| !branch.points.is_empty());
        let mut branch =
            known.cloned().unwrap_or_else(|| Branch::new(&name, self.system.family_of(&start.solution), free, origin));
        let going = match known {
            Some(_) => growth.resume(&mut branch),
            None => {
                let mut problem = Line::new(free).problem(self.system, self.plan.degree, start);
                match growth::polished(&mut *problem, &settings, start) {
                    Ok(station) => growth.begin(&mut branch, Beginning::Inside(station)),
                    Err(why) => family::without_start(self.observer, &mut branch, why.to_string()),
                }
            }
        };
        self.going &= going;
        self.legs.push(branch.clone());
        branch
    }

    /// Marks of a curve: the ends of the range and the places of the lines.
    pub(super) fn marks(&self) -> Vec<Mark> {
        self.places().into_iter().map(|place| Mark::at(Quantity::Parameter(self.design.free), place, false)).collect()
    }
}
