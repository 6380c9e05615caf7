//! The extremum of a curve of folds, followed in a third parameter.
//!
//! **Idea.** At an extremum of p along a curve of folds over (λ, p), the branch over λ is singular: F_w and F_λ together have
//! a deficient range there. With a third free parameter q these points form a curve: in the plane of q and p the boundary of
//! the motion, at whatever λ it lies.

use super::super::family::Work;
use super::super::plan::{BranchPlan, Holds, Start, Switching};
use super::search::{Candidate, Search};
use crate::contract::{Event, Verdict};
use crate::diagram::{Binds, Branch, Ending, Family, Kind, Origin, Shown};

impl Search<'_> {
    /// Follows the extremum that decides the answer in the third parameter, if the question names one.
    pub(super) fn follow_along(&mut self, candidate: &Candidate) {
        let Some((index, name, range)) = self.design.along.clone() else { return };
        let special = candidate.binds == Binds::Inside && candidate.kind == Kind::Fold;
        let [at, value] = self.at(&candidate.point);
        let [free, p] = self.design.names.clone();
        if !special || !self.system.field.determined().is_empty() {
            let why = match candidate.binds {
                Binds::Inside => format!("it lies on a curve of kind {}", candidate.kind),
                end => format!("it lies at the {} of {free}", end.name()),
            };
            return self.short(&format!(
                "the answer is not followed along {name}, because {why}; this is supported for extrema of curves of folds \
                 inside the range\nwhat to do: follow a `[[curve]]` of the fold at the speed in question"
            ));
        }
        let plan = BranchPlan {
            name: format!("{}/along", self.design.name),
            start: Start::Seed(0),
            free: index,
            range,
            until: None,
            switching: Switching::default(),
            marks: Vec::new(),
            max_points: self.design.max_points,
            holds: Holds {
                others: vec![(self.design.vary, Some(self.design.within)), (self.design.free, Some(self.design.range))],
                singular: true,
                ..Holds::default()
            },
        };
        let work = Work {
            system: self.system,
            plan: self.plan,
            earlier: self.earlier,
            observer: self.observer,
            branches: Vec::new(),
            budget: usize::MAX,
        };
        let origin = Origin::Switch { parent: candidate.curve.clone(), kind: Kind::Mark, parameter: value };
        let (branch, going) = work
            .held(&plan, origin.clone(), Ok(candidate.point.clone()))
            .unwrap_or_else(|| (Branch::new(&plan.name, Family::Cycle, index, origin), true));
        self.going &= going;
        let ends = [(branch.points.first(), &branch.ends[0]), (branch.points.last(), &branch.ends[1])];
        for (point, end) in ends {
            let Some(end) = end else { continue };
            let Some(point) = point else {
                self.short(&format!("the answer is not followed along {name}: {end}"));
                break;
            };
            let own = point.parameters.get(index).copied().unwrap_or(f64::NAN);
            let reached = range.iter().any(|bound| (own - bound).abs() <= 1e-9 * (range[1] - range[0]));
            let [at, value] = self.at(point);
            if !matches!(end, Ending::Stopped) && !reached {
                self.short(&format!(
                    "{} ends at {name} = {:.6}, {free} = {:.6}, {p} = {:.6}: {}",
                    branch.name,
                    Shown(own),
                    Shown(at),
                    Shown(value),
                    end.brief()
                ));
            }
        }
        let text = format!("{} follows the extremum at {free} = {:.6} along {name}", branch.name, Shown(at));
        self.legs.push(branch);
        self.check(text);
    }

    fn short(&mut self, text: &str) {
        self.going &= self.observer.observe(Event::Short(&self.design.name, text)) == Verdict::Continue;
    }
}
