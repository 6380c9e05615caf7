//! Curves of the boundary, and the candidates on them.

use super::super::family::Work;
use super::super::plan::{BranchPlan, CurvePlan, Holds, Start, Switching, Wanted};
use super::super::{curves, holds};
use super::search::{Candidate, Search, Seed};
use crate::diagram::{Binds, Branch, Ending, Kind, Origin, Point, SpecialPoint};
use crate::special::mark::Mark;
use crate::special::quantity::Quantity;

/// Fraction of the range by which curves are followed beyond its ends, so that their passages of the ends are located.
const BEYOND: f64 = 0.01;
/// Difference of parameters, relative to size, within which a special point lies on a curve: far above the errors, far below
/// the distance of curves.
const ON_CURVE: f64 = 1e-4;
/// The corresponding limit for the ranges of states, which change faster next to a fold.
const ALIKE: f64 = 1e-2;

impl Search<'_> {
    /// Follows the curves through those special points that lie on no curve yet.
    pub(super) fn follow_curves(&mut self, seeds: &[Seed]) {
        for seed in seeds {
            if self.is_known(seed) {
                continue;
            }
            let curve = self.curve(seed);
            self.legs.push(curve);
            self.curves.push((self.legs.len() - 1, seed.special.kind));
            if !self.going {
                return;
            }
        }
    }

    /// True if a curve passes through the special point.
    fn is_known(&self, seed: &Seed) -> bool {
        let point = &seed.special.point;
        let [at, value] = self.at(point);
        let near = |other: &Point| {
            let [a, v] = self.at(other);
            let close = |x: f64, y: f64, index: usize| {
                (x - y).abs() <= ON_CURVE * (self.system.unit(index) + x.abs().max(y.abs()))
            };
            close(a, at, self.design.free)
                && close(v, value, self.design.vary)
                && other.distance(point, self.system.measure()) < ALIKE
        };
        self.curves.iter().filter(|(_, kind)| *kind == seed.special.kind).any(|(index, _)| {
            let curve = &self.legs[*index];
            let start = curve.points.iter().filter(|point| point.position == 0);
            let ends = [curve.points.first(), curve.points.last()].into_iter().flatten();
            curve.special.iter().map(|special| &special.point).chain(start).chain(ends).any(near)
        })
    }

    /// Range of the branch's parameter in which curves are followed: a little beyond that of the question, but not to the
    /// other side of zero.
    fn wider(&self) -> [f64; 2] {
        let [low, high] = self.design.range;
        let more = BEYOND * (high - low);
        let lower = if low > 0.0 {
            (low - more).max(0.5 * low)
        } else if low < 0.0 {
            low - more
        } else {
            low
        };
        let upper = if high < 0.0 {
            (high + more).min(0.5 * high)
        } else if high > 0.0 {
            high + more
        } else {
            high
        };
        [lower, upper]
    }

    fn curve(&mut self, seed: &Seed) -> Branch {
        let kind = seed.special.kind;
        let stem = if kind == Kind::Mark { "bound" } else { kind.name() };
        let number = 1 + self.curves.iter().filter(|(_, own)| *own == kind).count();
        let name = format!("{}/{stem}-{number}", self.design.name);
        let start = self.at(&seed.special.point)[1];
        let mut marks = self.marks();
        if seed.of == self.design.of {
            // The other special points of the branch lie at this value.
            marks.push(Mark::at(Quantity::Parameter(self.design.vary), start, false));
        }
        match &self.design.wanted {
            Wanted::Below(level) if kind == Kind::Mark => {
                let vary = Quantity::Parameter(self.design.vary);
                let holds = Holds {
                    others: vec![(self.design.vary, Some(self.design.within))],
                    levels: vec![level.clone()],
                    ..Holds::default()
                };
                marks.push(Mark::peak(vary));
                let plan = BranchPlan {
                    name,
                    start: Start::Seed(0),
                    free: self.design.free,
                    range: self.wider(),
                    until: None,
                    switching: Switching::default(),
                    marks,
                    max_points: self.design.max_points,
                    holds,
                };
                let origin = Origin::Switch {
                    parent: seed.of.clone(),
                    kind: Kind::Mark,
                    parameter: self.at(&seed.special.point)[0],
                };
                let work = Work {
                    system: self.system,
                    plan: self.plan,
                    earlier: self.earlier,
                    observer: self.observer,
                    branches: Vec::new(),
                    budget: usize::MAX,
                };
                let (branch, going) =
                    work.held(&plan, origin.clone(), Ok(seed.special.point.clone())).unwrap_or_else(|| {
                        (Branch::new(&plan.name, crate::diagram::Family::Cycle, plan.free, origin), true)
                    });
                self.going &= going;
                branch
            }
            _ => {
                let plan = CurvePlan {
                    name,
                    hold: kind,
                    of: seed.of.clone(),
                    near: None,
                    to: None,
                    further: Vec::new(),
                    free: self.design.vary,
                    ranges: [self.wider(), self.design.within],
                    until: None,
                    marks: Vec::new(),
                    max_points: self.design.max_points,
                };
                // The first parameter of the curve is that of the branch, also where a line in the other one led to it.
                let parent = Branch::new(
                    &seed.of,
                    self.system.family_of(&seed.special.point.solution),
                    self.design.free,
                    Origin::EndOf(self.design.of.clone()),
                );
                let (system, plan_of, earlier) = (self.system, self.plan, self.earlier.branch(&plan.name));
                let (branch, going) = curves::follow_from(
                    system,
                    plan_of,
                    &plan,
                    &parent,
                    Ok(&seed.special),
                    &marks,
                    earlier,
                    self.observer,
                );
                self.going &= going;
                branch
            }
        }
    }

    /// Points of the branch at which the quantity has its bound.
    pub(super) fn crossings(&mut self, branch: &Branch) -> Vec<Seed> {
        let Wanted::Below(level) = &self.design.wanted else { return Vec::new() };
        let off = |point: &Point| level.quantity.on(point, self.system.field).unwrap_or(f64::NAN) - level.value;
        let settings = self.settings([f64::NEG_INFINITY, f64::INFINITY]);
        // The branch's parameter is solved for, the design parameter fixed.
        let holds = Holds { others: vec![(self.design.free, None)], levels: vec![level.clone()], ..Holds::default() };
        let plan = BranchPlan {
            name: self.design.name.clone(),
            start: Start::Seed(0),
            free: self.design.vary,
            range: self.design.within,
            until: None,
            switching: Switching::default(),
            marks: Vec::new(),
            max_points: self.design.max_points,
            holds: holds.clone(),
        };
        let mut found = Vec::new();
        for pair in branch.points.windows(2).filter(|pair| off(&pair[0]) * off(&pair[1]) <= 0.0) {
            let nearer = if off(&pair[0]).abs() < off(&pair[1]).abs() { &pair[0] } else { &pair[1] };
            let Some(start) = self.whole(branch, nearer) else { continue };
            let Ok(station) = holds::first(self.system, &plan, &holds, self.plan.degree, &settings, &start) else {
                continue;
            };
            let mut point = station.point;
            if !self.in_range(&point) {
                continue;
            }
            // It was fixed up to rounding, by which it may lie outside of a range that begins there.
            point.parameters[self.design.vary] = self.at(&start)[1];
            let special = SpecialPoint {
                kind: Kind::Mark,
                unstable_before: point.unstable,
                unstable_after: point.unstable,
                error: settings.newton_tolerance(),
                coefficients: Vec::new(),
                coefficient_errors: Vec::new(),
                remark: String::new(),
                point,
            };
            found.push(Seed { special, of: branch.name.clone() });
        }
        found
    }

    /// All candidates, the farthest in the direction of the search first.
    pub(super) fn candidates(&self) -> Vec<Candidate> {
        let mut all: Vec<Candidate> = Vec::new();
        for (index, kind) in &self.curves {
            let curve = &self.legs[*index];
            let turns = if *kind == Kind::Mark { Kind::Peak } else { Kind::Fold };
            let [low, high] = self.design.range;
            let slack = 1e-6 * (high - low);
            let make = |point: &Point, error: f64, binds: Binds| Candidate {
                point: point.clone(),
                kind: *kind,
                curve: curve.name.clone(),
                error,
                binds,
            };
            let counts = |special: &&SpecialPoint| *kind != Kind::Fold || self.avoided_at_fold(&special.point);
            for special in curve.special.iter().filter(counts) {
                let at = self.at(&special.point)[0];
                let end = |value: f64| special.kind == Kind::Mark && (at - value).abs() <= slack;
                if end(low) {
                    all.push(make(&special.point, special.error, Binds::LowerEnd));
                } else if end(high) {
                    all.push(make(&special.point, special.error, Binds::UpperEnd));
                } else if self.in_range(&special.point) && (special.kind == turns || special.kind.has_codimension_two())
                {
                    all.push(make(&special.point, special.error, Binds::Inside));
                }
            }
            // A range that begins or ends at zero is not exceeded.
            let ends = [(curve.points.first(), &curve.ends[0]), (curve.points.last(), &curve.ends[1])];
            for (point, end) in ends {
                let (Some(point), Some(Ending::Bound(_))) = (point, end) else { continue };
                let at = self.at(point)[0];
                let error = point.trust.discretisation.max(self.plan.tolerance);
                if (at - low).abs() <= slack {
                    all.push(make(point, error, Binds::LowerEnd));
                } else if (at - high).abs() <= slack {
                    all.push(make(point, error, Binds::UpperEnd));
                }
            }
        }
        let value = |candidate: &Candidate| self.progress(self.at(&candidate.point)[1]);
        all.sort_by(|a, b| value(b).total_cmp(&value(a)));
        all
    }

    /// True for folds that bound the part to be avoided; where stability matters, the check on both sides decides.
    fn avoided_at_fold(&self, point: &Point) -> bool {
        matches!(self.design.wanted, Wanted::NoMotion | Wanted::NotStable) || self.avoided(point)
    }
}
