//! The search for one answer.

use super::super::System;
use super::super::plan::{DesignPlan, Plan, Wanted};
use crate::contract::{Event, Observer, Verdict};
use crate::diagram::{Answer, Binds, Branch, Design, Diagram, Ending, Kind, Point, Shown, SpecialPoint};

/// Number of times that curves are sought beyond a candidate.
const ROUNDS: usize = 4;

/// Special point from which a curve of the boundary starts.
#[derive(Clone)]
pub(super) struct Seed {
    pub(super) special: SpecialPoint,
    /// Name of the branch or line on which it was found.
    pub(super) of: String,
}

/// Point of a curve at which the design parameter may be extreme.
#[derive(Clone)]
pub(super) struct Candidate {
    pub(super) point: Point,
    pub(super) kind: Kind,
    pub(super) curve: String,
    /// Bound on the error of both parameters, relative to their sizes.
    pub(super) error: f64,
    pub(super) binds: Binds,
}

/// A search, and the branches followed for it.
pub(super) struct Search<'s> {
    pub(super) system: &'s System<'s>,
    pub(super) plan: &'s Plan,
    pub(super) design: &'s DesignPlan,
    pub(super) branches: &'s [Branch],
    pub(super) earlier: &'s Diagram,
    pub(super) observer: &'s dyn Observer,
    /// Branches followed, in order.
    pub(super) legs: Vec<Branch>,
    /// Indices in `legs` of the curves, with their kinds.
    pub(super) curves: Vec<(usize, Kind)>,
    pub(super) going: bool,
    pub(super) reasons: Vec<String>,
    pub(super) checks: Vec<String>,
    /// Ends of the branch and of lines on other solutions: the kind of special point, the last point, and a sentence.
    joined: Vec<(Kind, Point, String)>,
}

impl<'s> Search<'s> {
    pub(super) fn new(
        system: &'s System<'s>,
        plan: &'s Plan,
        design: &'s DesignPlan,
        branches: &'s [Branch],
        earlier: &'s Diagram,
        observer: &'s dyn Observer,
    ) -> Search<'s> {
        Search {
            system,
            plan,
            design,
            branches,
            earlier,
            observer,
            legs: Vec::new(),
            curves: Vec::new(),
            going: true,
            reasons: Vec::new(),
            checks: Vec::new(),
            joined: Vec::new(),
        }
    }

    /// Searches for the answer; `None` if the observer wants to stop.
    pub(super) fn answer(&mut self) -> Option<Design> {
        let answer = match self.branches.iter().find(|branch| branch.name == self.design.of) {
            Some(of) => self.from(of),
            None => {
                self.reasons.push(format!("there is no branch {}", self.design.of));
                None
            }
        };
        let DesignPlan { name, of, free, vary, range, greatest, .. } = self.design.clone();
        let (reasons, checks) = (std::mem::take(&mut self.reasons), std::mem::take(&mut self.checks));
        let wanted = wanted(&self.design.wanted);
        self.going.then_some(Design { name, of, free, vary, range, greatest, wanted, answer, reasons, checks })
    }

    fn from(&mut self, of: &Branch) -> Option<Answer> {
        let start = of.points.first().map(|point| self.at(point)[1]);
        let Some(start) = start else {
            self.reasons.push(format!("the branch {} has no points", of.name));
            return None;
        };
        let starts = self.starts(of);
        if starts.is_empty() && !self.avoided_somewhere(of) {
            return None;
        }
        let mut seeds = self.seeds_on(of, None);
        seeds.extend(self.ends_of(of));
        let mut back: Vec<Point> = Vec::new();
        for point in starts {
            // A line that turned may have come back at this solution.
            if back.iter().any(|end| self.same(end, &point)) {
                continue;
            }
            let line = self.line(&point, &format!("line-{}", back.len() + 1), self.limit());
            seeds.extend(self.seeds_on(&line, None));
            self.judge_line(&line);
            if !self.going {
                return None;
            }
            let end = if self.design.greatest { line.points.first() } else { line.points.last() };
            back.push(end.cloned().unwrap_or(point));
        }
        let mut best: Option<Candidate> = None;
        for round in 0..ROUNDS {
            self.follow_curves(&seeds);
            if !self.going {
                return None;
            }
            let found = self.candidates();
            let Some((candidate, more)) = self.checked(found, start, round) else { break };
            best = Some(candidate);
            if more.is_empty() || !self.going {
                break;
            }
            if round + 1 == ROUNDS {
                self.reasons.push(format!("solutions were found beyond the answer in each of {ROUNDS} rounds"));
            }
            seeds = more;
        }
        self.judge_curves();
        if best.is_none() && self.reasons.is_empty() {
            self.reasons.push(self.nothing());
        }
        let best = best?;
        self.follow_along(&best);
        Some(self.stated(&best))
    }

    /// Sentence for a search that met no boundary.
    fn nothing(&self) -> String {
        let p = self.name(self.design.vary);
        format!("no boundary of the part to be avoided was found between {p} = {} and {}", self.low(), self.high())
    }

    fn low(&self) -> Shown {
        Shown(self.design.within[0])
    }

    fn high(&self) -> Shown {
        Shown(self.design.within[1])
    }

    /// The answer that a candidate gives.
    fn stated(&self, candidate: &Candidate) -> Answer {
        let [at, value] = self.at(&candidate.point);
        let size = self.system.unit(self.design.vary) + value.abs();
        Answer {
            value,
            // Newton's method stops at its own tolerance, however small the located error is.
            error: candidate.error.max(self.settings([value, value]).newton_tolerance()) * size,
            at,
            binds: candidate.binds,
            kind: candidate.kind,
            curve: candidate.curve.clone(),
        }
    }

    /// True if the branch itself has solutions to be avoided in the range; otherwise says that it has none.
    fn avoided_somewhere(&mut self, of: &Branch) -> bool {
        let there = of.points.iter().chain(of.special.iter().map(|special| &special.point));
        let there = there.filter(|point| self.in_range(point)).filter(|point| self.avoided(point)).count() > 0;
        if !there {
            let [low, high] = self.design.range.map(Shown);
            let why = match &self.design.wanted {
                Wanted::NoMotion => "has no solution".to_string(),
                Wanted::NotStable => "has no stable solution".into(),
                Wanted::Below(level) => format!("has {} below {} everywhere", level.name, Shown(level.value)),
            };
            let free = self.name(self.design.free);
            self.reasons.push(format!(
                "the branch {} {why} between {free} = {low} and {high}\nwhat to do: start from a value of {} at which the \
                 condition is not met yet",
                of.name,
                self.name(self.design.vary)
            ));
        }
        there
    }

    /// Values of the branch's parameter and of the design parameter.
    pub(super) fn at(&self, point: &Point) -> [f64; 2] {
        [self.design.free, self.design.vary].map(|k| point.parameters.get(k).copied().unwrap_or(f64::NAN))
    }

    /// Progress of a value of the design parameter in the direction of the search.
    pub(super) fn progress(&self, value: f64) -> f64 {
        if self.design.greatest { -value } else { value }
    }

    /// End of the range of the design parameter towards which the search goes.
    pub(super) fn limit(&self) -> f64 {
        self.design.within[usize::from(!self.design.greatest)]
    }

    /// True if the branch's parameter is in its range, up to rounding.
    pub(super) fn in_range(&self, point: &Point) -> bool {
        let ([low, high], [at, _]) = (self.design.range, self.at(point));
        let slack = 1e-9 * (high - low);
        (low - slack..=high + slack).contains(&at)
    }

    /// True if a solution is one to be avoided.
    pub(super) fn avoided(&self, point: &Point) -> bool {
        match &self.design.wanted {
            Wanted::NoMotion => true,
            Wanted::NotStable => point.unstable == 0,
            Wanted::Below(level) => {
                level.quantity.on(point, self.system.field).is_some_and(|value| value >= level.value)
            }
        }
    }

    /// Name of a parameter.
    pub(super) fn name(&self, index: usize) -> String {
        self.design.names[usize::from(index == self.design.vary)].clone()
    }

    /// Special points of a branch in the range from which curves of the boundary start; with `beyond`, those farther in the
    /// direction of the search than this value.
    pub(super) fn seeds_on(&mut self, branch: &Branch, beyond: Option<f64>) -> Vec<Seed> {
        let farther =
            |point: &Point| beyond.is_none_or(|value| self.progress(self.at(point)[1]) > self.progress(value));
        let boundary = |special: &SpecialPoint| match &self.design.wanted {
            Wanted::NoMotion => special.kind == Kind::Fold,
            Wanted::NotStable => {
                let stable = special.unstable_before.min(special.unstable_after) == 0;
                stable && special.unstable_before != special.unstable_after && FOLLOWED.contains(&special.kind)
            }
            Wanted::Below(_) => {
                special.kind == Kind::Mark || special.kind == Kind::Fold && self.avoided(&special.point)
            }
        };
        let own = branch.special.iter().filter(|s| self.in_range(&s.point) && farther(&s.point) && boundary(s));
        let mut seeds: Vec<Seed> =
            own.map(|special| Seed { special: special.clone(), of: branch.name.clone() }).collect();
        if let Wanted::NotStable = self.design.wanted {
            let lost = |s: &&SpecialPoint| {
                s.unstable_before.min(s.unstable_after) == 0 && s.unstable_before != s.unstable_after
            };
            let own = branch.special.iter().filter(|s| self.in_range(&s.point) && farther(&s.point)).filter(lost);
            let [free, p] = &self.design.names;
            let said = own.filter(|special| !FOLLOWED.contains(&special.kind)).map(|special| {
                let [at, value] = self.at(&special.point).map(Shown);
                format!(
                    "stability changes at a point of kind {} at {free} = {at:.6}, {p} = {value:.6}, which is not followed \
                     in two parameters",
                    special.kind
                )
            });
            let said: Vec<String> = said.collect();
            self.reasons.extend(said);
        }
        // A branch of the study has no marks of the bound.
        if let Wanted::Below(_) = self.design.wanted
            && branch.name == self.design.of
        {
            seeds.extend(self.crossings(branch));
        }
        seeds
    }

    /// Special points at which the branch ends on other solutions inside the range, where these are followed too.
    fn ends_of(&mut self, of: &Branch) -> Vec<Seed> {
        let mut seeds = Vec::new();
        for (point, end) in [(of.points.first(), &of.ends[0]), (of.points.last(), &of.ends[1])] {
            let (Some(point), Some(end)) = (point, end) else { continue };
            if !self.in_range(point) || matches!(end, Ending::Bound(_) | Ending::Closed | Ending::Stopped) {
                continue;
            }
            let [at, _] = self.at(point);
            let text =
                format!("the branch {} ends at {} = {:.6}: {}", of.name, self.design.names[0], Shown(at), end.brief());
            let Ending::Joined { at: kind, parameter } = end else {
                self.reasons.push(text);
                continue;
            };
            let near = |special: &&SpecialPoint| {
                let value = special.point.parameters.get(of.free).copied().unwrap_or(f64::NAN);
                special.kind == *kind && (value - parameter).abs() < MEETING * of.size(*parameter)
            };
            let others = self.branches.iter().filter(|own| own.name != of.name && own.free == of.free);
            let found =
                others.filter(|own| own.held.is_none()).find_map(|own| Some((own, own.special.iter().find(near)?)));
            seeds.extend(found.map(|(own, special)| Seed { special: special.clone(), of: own.name.clone() }));
            self.joined.push((*kind, point.clone(), text));
        }
        seeds
    }

    /// True if two solutions at one value of the branch's parameter are the same.
    fn same(&self, a: &Point, b: &Point) -> bool {
        const SAME: f64 = 1e-4;
        self.at(a) == self.at(b) && a.distance(b, self.system.measure()) < SAME
    }

    /// A point with its profile.
    pub(super) fn whole(&self, branch: &Branch, point: &Point) -> Option<Point> {
        match point.is_light() {
            true => self.observer.recall(branch, point.position).filter(|found| !found.is_light()),
            false => Some(point.clone()),
        }
    }

    /// Says what a line leaves open: the motion is still there at its end, or the line ended before.
    fn judge_line(&mut self, line: &Branch) {
        let Some(start) = line.points.iter().find(|point| point.position == 0).map(|point| self.at(point)) else {
            let why: Vec<String> = line.ends.iter().flatten().map(Ending::brief).collect();
            self.note(&format!("{} did not start: {}", line.name, why.join("; ")));
            return;
        };
        let last = if self.design.greatest { line.points.first() } else { line.points.last() };
        let end = &line.ends[usize::from(!self.design.greatest)];
        let (Some(last), Some(end)) = (last, end) else { return };
        let ([at, _], [_, value]) = (start, self.at(last));
        let (free, p) = (self.name(self.design.free), self.name(self.design.vary));
        if !self.avoided(last) {
            return;
        }
        match end {
            Ending::Bound(_) if self.reaches(value, self.limit()) => self.reasons.push(format!(
                "at {free} = {:.6} the solutions to be avoided go on to {p} = {}, the end of its range\nwhat to do: give a \
                 wider range",
                Shown(at),
                Shown(value)
            )),
            Ending::Bound(_) | Ending::Closed | Ending::Stopped => {}
            Ending::Joined { at: kind, .. } => {
                let text = format!(
                    "at {free} = {:.6} the solutions in {p} end at {:.6}: {}",
                    Shown(at),
                    Shown(value),
                    end.brief()
                );
                self.joined.push((*kind, last.clone(), text));
            }
            other => self.reasons.push(format!(
                "at {free} = {:.6} the solutions in {p} end at {:.6}: {}",
                Shown(at),
                Shown(value),
                other.brief()
            )),
        }
    }

    /// Adds the reasons why the curves leave the answer open.
    fn judge_curves(&mut self) {
        let p = self.name(self.design.vary);
        for (index, _) in self.curves.clone() {
            let curve = self.legs[index].clone();
            let ends = [(curve.points.first(), &curve.ends[0]), (curve.points.last(), &curve.ends[1])];
            for (point, end) in ends {
                let Some(end) = end else { continue };
                let Some(point) = point else {
                    self.reasons.push(format!("{} did not start: {end}", curve.name));
                    break;
                };
                let [at, value] = self.at(point);
                let free = self.name(self.design.free);
                match end {
                    Ending::Bound(_) if self.in_range(point) && self.reaches(value, self.limit()) => {
                        self.reasons.push(format!(
                            "{} reaches {p} = {}, the end of its range, at {free} = {:.6}\nwhat to do: give a wider range",
                            curve.name,
                            Shown(value),
                            Shown(at)
                        ));
                    }
                    Ending::Bound(_) | Ending::Closed | Ending::Stopped => {}
                    other => self.reasons.push(format!(
                        "{} was not followed beyond {free} = {:.6}, {p} = {:.6}: {}",
                        curve.name,
                        Shown(at),
                        Shown(value),
                        other.brief()
                    )),
                }
            }
        }
        for (kind, point, text) in std::mem::take(&mut self.joined) {
            let [at, value] = self.at(&point);
            let near = |other: &Point| {
                let [a, v] = self.at(other);
                let close = |x: f64, y: f64, index: usize| {
                    (x - y).abs() <= MEETING * (self.system.unit(index) + x.abs().max(y.abs()))
                };
                close(a, at, self.design.free) && close(v, value, self.design.vary)
            };
            let own = self.curves.iter().filter(|(_, own)| *own == kind).map(|(index, _)| &self.legs[*index]);
            let passes = own.flat_map(|curve| {
                curve
                    .special
                    .iter()
                    .map(|special| &special.point)
                    .chain(curve.points.iter().filter(|p| p.position == 0))
            });
            if !passes.into_iter().any(near) {
                self.reasons.push(text);
            }
        }
        let mut seen = Vec::new();
        self.reasons.retain(|reason| {
            !seen.contains(reason) && {
                seen.push(reason.clone());
                true
            }
        });
    }

    /// True if two values of the design parameter agree up to rounding.
    pub(super) fn reaches(&self, value: f64, target: f64) -> bool {
        let [low, high] = self.design.within;
        (value - target).abs() <= 1e-9 * (high - low)
    }

    /// Records a check.
    pub(super) fn check(&mut self, text: String) {
        self.note(&text);
        self.checks.push(text);
    }

    pub(super) fn note(&mut self, text: &str) {
        self.going &= self.observer.observe(Event::Note(&self.design.name, text)) == Verdict::Continue;
    }
}

/// Distance, relative to size, between the last point of a branch and the special point of another one at which it ends:
/// branches end before they meet the other one.
const MEETING: f64 = 1e-3;

/// Bifurcations at which stability ends and that are followed in two parameters.
const FOLLOWED: [Kind; 5] = [Kind::Fold, Kind::PeriodDoubling, Kind::Torus, Kind::Hopf, Kind::BranchPoint];

/// The condition in words.
fn wanted(wanted: &Wanted) -> String {
    match wanted {
        Wanted::NoMotion => "no motion".into(),
        Wanted::NotStable => "no stable motion".into(),
        Wanted::Below(level) => format!("{} < {}", level.name, Shown(level.value)),
    }
}
