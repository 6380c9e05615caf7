//! Diagrams on both sides of a candidate.

use super::super::growth;
use super::super::plan::Wanted;
use super::search::{Candidate, Search, Seed};
use crate::diagram::{Branch, Kind, Point, Shown, SpecialPoint};

/// Distance of the diagrams from the candidate, as a fraction of its distance from the branch of the question: visible
/// in a picture, and small enough to identify the motion.
const BESIDE: f64 = 0.01;
/// Distance beyond a candidate, in errors of the candidate, from which a special point counts as farther.
const CLEARLY: f64 = 5.0;
/// Positions in the extent of the inner diagram at which lines start.
const INNER: [f64; 3] = [0.25, 0.5, 0.75];

/// Diagram on the inner side of a candidate.
enum Inner {
    /// A diagram with solutions to be avoided.
    Avoided(Box<Branch>),
    /// A diagram without them.
    Nothing,
    /// It could not be computed, for this reason.
    Unknown(String),
}

impl Search<'_> {
    /// Returns the farthest candidate that has solutions to be avoided on its inner side, and special points found beyond
    /// it. `start` is the value of the design parameter on the branch of the question.
    pub(super) fn checked(
        &mut self,
        found: Vec<Candidate>,
        start: f64,
        round: usize,
    ) -> Option<(Candidate, Vec<Seed>)> {
        for (number, candidate) in found.into_iter().enumerate() {
            if !self.going {
                return None;
            }
            let value = self.at(&candidate.point)[1];
            // Beyond the branch itself there is nothing to find.
            if self.progress(value) < self.progress(start) {
                return None;
            }
            let tail = match (round, number) {
                (0, 0) => String::new(),
                _ => format!("-{}", 1 + number + 10 * round),
            };
            let distance = BESIDE * (value - start);
            let inner = match self.inside(&candidate, value - distance, &tail) {
                Inner::Avoided(inner) => inner,
                Inner::Nothing => continue,
                Inner::Unknown(why) => {
                    let [free, p] = &self.design.names;
                    let [at, value] = self.at(&candidate.point).map(Shown);
                    self.reasons.push(format!(
                        "the inner side of {} at {free} = {at:.6}, {p} = {value:.9} could not be computed: {why}",
                        candidate.curve
                    ));
                    return Some((candidate, Vec::new()));
                }
            };
            let clear = CLEARLY * candidate.error * (self.system.unit(self.design.vary) + value.abs());
            let beyond = value + clear.copysign(distance);
            let more = self.outside(&candidate, &inner, value + distance, beyond, &tail);
            return Some((candidate, more));
        }
        None
    }

    /// The diagram on the inner side of a candidate.
    fn inside(&mut self, candidate: &Candidate, value: f64, tail: &str) -> Inner {
        let start = match self.beside(candidate) {
            Ok(start) => start,
            Err(why) => return Inner::Unknown(why),
        };
        let line = self.line(&start, &format!("inwards{tail}"), value);
        let end = line.points.iter().find(|point| self.reaches(self.at(point)[1], value)).cloned();
        let Some(end) = end.and_then(|end| self.whole(&line, &end)) else {
            let ends: Vec<String> = line.ends.iter().flatten().map(|end| end.brief()).collect();
            return Inner::Unknown(format!("{}: {}", line.name, ends.join("; ")));
        };
        let diagram = self.diagram(&end, &format!("inside{tail}"), &line.name);
        let avoided = diagram.points.iter().filter(|point| self.avoided(point));
        // A mark lies at the bound up to rounding.
        let own = |special: &&SpecialPoint| special.kind == Kind::Mark || self.avoided(&special.point);
        let ends = diagram.special.iter().filter(own).map(|special| &special.point);
        let there: Vec<f64> =
            avoided.chain(ends).filter(|point| self.in_range(point)).map(|point| self.at(point)[0]).collect();
        let (low, high) = there.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        if low > high {
            let curve = &candidate.curve;
            self.note(&format!(
                "{curve} at {:.9}: nothing to be avoided beside it",
                Shown(self.at(&candidate.point)[1])
            ));
            return Inner::Nothing;
        }
        let what = match &self.design.wanted {
            Wanted::NoMotion => "the motion exists".to_string(),
            Wanted::NotStable => "the motion is stable".into(),
            Wanted::Below(level) => format!("{} reaches {}", level.name, Shown(level.value)),
        };
        let [free, p] = self.design.names.clone();
        let names = format!("at {p} = {:.6} {what} from {free} = {:.6}", Shown(value), Shown(low));
        self.check(format!("{names} to {:.6} ({})", Shown(high), diagram.name));
        Inner::Avoided(Box::new(diagram))
    }

    /// The point of a candidate, or for folds a solution beside it at the same value of the branch's parameter.
    fn beside(&self, candidate: &Candidate) -> Result<Point, String> {
        if candidate.kind != Kind::Fold {
            return Ok(candidate.point.clone());
        }
        let settings = self.settings([f64::NEG_INFINITY, f64::INFINITY]);
        let (vary, degree) = (self.design.vary, self.plan.degree);
        let mut problem = growth::problem_of(self.system, vary, degree, &candidate.point, false);
        growth::beside(&mut *problem, &settings, &candidate.point).map_err(|why| why.to_string())
    }

    /// Follows what may lie beyond a candidate; returns the special points found farther than `beyond`.
    fn outside(&mut self, candidate: &Candidate, inner: &Branch, target: f64, beyond: f64, tail: &str) -> Vec<Seed> {
        let mut seeds = Vec::new();
        let [low, high] = self.design.within;
        let target = target.clamp(low, high);
        let mut crossed = false;
        for (number, share) in INNER.into_iter().enumerate() {
            let values = inner.points.iter().filter(|p| self.in_range(p) && self.avoided(p)).map(|p| self.at(p)[0]);
            let (a, b) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
            for (pass, point) in self.passes(inner, a + share * (b - a)).into_iter().enumerate() {
                if !self.avoided(&point) || !self.going {
                    continue;
                }
                let line = self.line(&point, &format!("outwards{tail}-{}{}", number + 1, letter(pass)), target);
                crossed |= self.reaches_beyond(&line, beyond);
                seeds.extend(self.seeds_on(&line, Some(beyond)));
            }
        }
        if candidate.kind != Kind::Fold && self.going {
            let line = self.line(&candidate.point, &format!("outwards{tail}"), target);
            let end = line.points.iter().find(|point| self.reaches(self.at(point)[1], target)).cloned();
            if let Some(end) = end.and_then(|end| self.whole(&line, &end)) {
                let diagram = self.diagram(&end, &format!("outside{tail}"), &line.name);
                let there = diagram.points.iter().any(|point| self.in_range(point) && self.avoided(point));
                crossed |= there;
                seeds.extend(self.seeds_on(&diagram, Some(beyond)));
                if !there {
                    let p = &self.design.names[1];
                    let what = match &self.design.wanted {
                        Wanted::NotStable => "not stable anywhere".to_string(),
                        Wanted::Below(level) => format!("{} stays below {}", level.name, Shown(level.value)),
                        Wanted::NoMotion => "absent".into(),
                    };
                    let text = format!("at {p} = {:.6} the motion: {what} ({})", Shown(target), diagram.name);
                    self.check(text);
                }
            }
        }
        if !crossed {
            let p = &self.design.names[1];
            let text = format!("lines in {p} from inside leave the part to be avoided before {:.6}", Shown(beyond));
            self.check(text);
        } else if seeds.is_empty() {
            self.reasons.push(format!(
                "solutions to be avoided were found beyond {} = {:.9}, but not where they end",
                self.design.names[1],
                Shown(beyond)
            ));
        }
        seeds
    }

    fn reaches_beyond(&self, line: &Branch, beyond: f64) -> bool {
        let there = |point: &Point| self.avoided(point) && self.progress(self.at(point)[1]) > self.progress(beyond);
        line.points.iter().any(there)
    }
}

/// A letter for one of several starts at the same value; nothing for the first.
fn letter(number: usize) -> String {
    if number == 0 { String::new() } else { char::from(b'a' + (number % 26) as u8).to_string() }
}
