//! Distinction between a jump of a sweep and a steep response.
//!
//! **Idea.** The motion at one parameter value is solved for and continued as a branch to the next value. If the branch
//! gets there without turning back and arrives at the motion to which the trajectory settled, both motions lie on one
//! branch. If it turns back before or arrives at another motion, the sweep has jumped. Size alone does not decide: at a
//! sharp resonance, responses at neighbouring values differ greatly on one branch. A branch that turns back just beyond
//! the next value may pass it and return within one step; it is then followed again with shorter steps.
//!
//! **Fails when** one of the two motions cannot be solved for or the branch ends before the next value; the result is
//! then unknown.

use super::System;
use super::growth::{Beginning, Growth, polished, problem_of, settings};
use super::seeds::polish;
use crate::attractors::Candidate;
use crate::continuation::Settings;
use crate::contract::Unobserved;
use crate::diagram::{Branch, Ending, Kind, Origin, Point};

/// Most points of a branch between two neighbouring values. A factor of safety: a step of a sweep takes a few points.
const POINTS: usize = 300;
/// Numbers by which the longest step is divided, in the order of trial. With the last one a fold is told from the next value
/// up to a distance of about a millionth of the scale of the parameter: a step of length s along a curve of curvature 1
/// reaches s²/8 beyond its ends.
const SHORTER: [usize; 4] = [1, 4, 16, 64];

/// Outcome of following a branch to the next value.
enum Followed {
    Reached(Box<Point>),
    /// The branch turns back, or joins another one, on the way.
    Turned,
    /// The branch turns back beyond the next value, which it passed within a step.
    Passed,
    Unknown,
}

/// The motion at the last value of a sweep.
pub(super) struct Pursuit<'p> {
    system: &'p System<'p>,
    free: usize,
    tolerance: f64,
    degree: usize,
    last: Option<Point>,
}

impl<'p> Pursuit<'p> {
    pub(super) fn new(system: &'p System<'p>, free: usize, tolerance: f64, degree: usize) -> Pursuit<'p> {
        Pursuit { system, free, tolerance, degree, last: None }
    }

    /// Returns true if the motion at the next value is a different solution; `None` if that is unknown.
    pub(super) fn leaves(&mut self, parameters: &[f64], candidate: Option<&Candidate>) -> Option<bool> {
        let point = candidate.and_then(|candidate| polish(self.system, parameters, self.tolerance, candidate));
        let before = std::mem::replace(&mut self.last, point);
        let (from, to) = before.as_ref().zip(self.last.as_ref())?;
        let reached = self.followed(from, to.parameters[self.free])?;
        Some(reached.is_none_or(|reached| reached.distance(to, self.system.measure()) > 30.0 * self.tolerance))
    }

    /// The solution continued to a value of the parameter: `Some(None)` if it turns back or joins another branch on the
    /// way, `None` if it cannot be continued.
    fn followed(&self, from: &Point, value: f64) -> Option<Option<Point>> {
        let outcomes = SHORTER.iter().map(|shorter| self.in_steps(from, value, *shorter));
        match outcomes.into_iter().find(|outcome| !matches!(outcome, Followed::Passed))? {
            Followed::Reached(point) => Some(Some(*point)),
            Followed::Turned => Some(None),
            Followed::Passed | Followed::Unknown => None,
        }
    }

    fn in_steps(&self, from: &Point, value: f64, shorter: usize) -> Followed {
        let start = from.parameters[self.free];
        let (range, side) = ([start.min(value), start.max(value)], usize::from(value > start));
        if start == value {
            return Followed::Reached(Box::new(from.clone()));
        }
        let usual = settings(self.system, self.tolerance, range, shorter * POINTS);
        let longest = usual.max_step / shorter as f64;
        let settings = Settings { max_step: longest, first_step: usual.first_step.min(longest), ..usual };
        let mut problem = problem_of(self.system, self.free, self.degree, from, false);
        let Ok(station) = polished(&mut *problem, &settings, from) else { return Followed::Unknown };
        let (name, origin) = ("between two values", Origin::Seed(String::new()));
        let family = self.system.family_of(&from.solution);
        let mut branch = Branch::new(name, family, self.free, origin);
        let growth = Growth {
            system: self.system,
            settings: &settings,
            degree: self.degree,
            ties: Vec::new(),
            sides: [side == 0, side == 1],
            parents: &[],
            marks: &[],
            observer: &Unobserved,
            whole: false,
            sparse: false,
        };
        growth.begin(&mut branch, Beginning::Inside(station));
        let mut folds = branch.special.iter().filter(|special| special.kind == Kind::Fold);
        // In the order of travel.
        if let Some(fold) = if side == 1 { folds.next() } else { folds.next_back() } {
            let beyond = (fold.point.parameters[self.free] - value) * (value - start) > 0.0;
            return if beyond { Followed::Passed } else { Followed::Turned };
        }
        let end = if side == 1 { branch.points.last() } else { branch.points.first() };
        match (&branch.ends[side], end) {
            (Some(Ending::Bound(_)), Some(end)) => Followed::Reached(Box::new(end.clone())),
            (Some(Ending::Joined { .. }), _) => Followed::Turned,
            _ => Followed::Unknown,
        }
    }
}
