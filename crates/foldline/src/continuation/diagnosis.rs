//! Diagnosis of a side that ends early: what was tried, the likely cause, and what to do.
//!
//! **Idea.** For the rejected steps from a point, their number, lengths, meshes and reasons are recorded. When no
//! further step is tried, possible causes are checked in the order of their certainty: a vector field that is not
//! finite a little farther on, a period that has grown, a parameter that has not moved, a non-smooth right-hand side, a
//! mesh that did not suffice.

use super::corrector::{Failure, Station};
use super::follow::Follow;
use crate::diagram::{Ending, STANDS, Shown};

/// Consecutive rejected steps from one point.
#[derive(Debug)]
pub(super) struct Tried {
    steps: usize,
    longest: f64,
    shortest: f64,
    intervals: [usize; 2],
    /// Number of steps rejected because the point did not continue the branch; below, because Newton's method failed.
    elsewhere: usize,
    diverged: usize,
}

/// History of a side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Past {
    /// Period at the start.
    pub first_period: Option<f64>,
    /// True if the parameter has ever moved.
    pub moved: bool,
}

/// A likely cause and its remedy.
type Cause = (String, &'static str);

/// Cause and remedy if the vector field is not defined everywhere.
const EDGE: (&str, &str) = (
    "the solution reaches the boundary of the region where the vector field is defined (division by zero, log or \
     root of a negative number)",
    "if this boundary is part of the problem, the branch ends here; otherwise rewrite the equation so that it stays \
     defined, or end the range earlier",
);

/// Cause and remedy if branches cross only at one value of a second parameter.
pub(crate) const UNCROSSED: (&str, &str) = (
    "the second parameter destroys what makes the branches cross: a symmetry, or a solution that exists for all \
     parameter values",
    "choose a second parameter that preserves it; or follow the branch at another value of this parameter, where a \
     fold replaces the branch point, and continue that fold",
);

/// Growth of the period above which an orbit of infinite period is likely.
const GROWN: f64 = 2.0;

impl Tried {
    pub fn new() -> Tried {
        let (longest, shortest, intervals) = (0.0, f64::INFINITY, [usize::MAX, 0]);
        Tried { steps: 0, longest, shortest, intervals, elsewhere: 0, diverged: 0 }
    }

    /// Records a rejected step of this length on a mesh with this number of intervals.
    pub fn note(&mut self, step: f64, intervals: usize, why: &Failure) {
        self.steps += 1;
        (self.longest, self.shortest) = (self.longest.max(step), self.shortest.min(step));
        self.intervals = [self.intervals[0].min(intervals), self.intervals[1].max(intervals)];
        self.elsewhere += usize::from(matches!(
            why,
            Failure::Elsewhere { .. } | Failure::Bent { .. } | Failure::NotBack { .. } | Failure::Unexplained
        ));
        self.diverged += usize::from(matches!(why, Failure::NoConvergence(_) | Failure::Singular));
    }

    fn sentence(&self, why: &Failure, parameter: f64) -> String {
        let steps = match self.steps {
            0 | 1 => format!("one step of {:.1e} failed", self.longest),
            n => format!("{n} steps of {:.1e} down to {:.1e} failed", self.longest, self.shortest),
        };
        let meshes = match self.intervals {
            [_, 0] => String::new(),
            [few, many] if few == many => format!(" on {few} mesh intervals"),
            [few, many] => format!(" on {few} to {many} mesh intervals"),
        };
        let counts = match (self.elsewhere, self.diverged) {
            (_, 0) | (0, _) => String::new(),
            (a, b) => format!(" ({a} left the branch, Newton's method failed in {b})"),
        };
        format!("near {}, {steps}{meshes}{counts}; the last one because {why}", Shown(parameter))
    }
}

impl Follow<'_> {
    /// Ending of a side at `left`, beyond which no step succeeded.
    pub(super) fn short_end(&mut self, left: &Station, tried: &Tried, why: &Failure, past: Past) -> Ending {
        let (cause, cure) = self.cause(left, tried, why, past);
        let said = format!("{}\nlikely cause: {cause}\nwhat to do: {cure}", tried.sentence(why, self.value(left)));
        match why {
            Failure::Mesh(_) => Ending::MeshTooLarge(said),
            // This applies whatever the reason of the last rejection.
            _ if cause == EDGE.0 => Ending::NotFinite(said),
            _ => Ending::StepTooSmall(said),
        }
    }

    fn cause(&mut self, left: &Station, tried: &Tried, why: &Failure, past: Past) -> Cause {
        let period = left.point.solution.free_period();
        let grown = period.zip(past.first_period).map_or(1.0, |(now, first)| now / first);
        if let Failure::Blocked(obstacle) = why {
            return (
                obstacle.to_string(),
                "sliding, sticking and chatter are not followed: use a smooth function with a sharpness parameter, such as \
                 tanh(s*x) for sign(x), and continue the solution in s to the sharpness needed",
            );
        }
        if *why == Failure::NotFinite || self.breaks_off(left, tried.longest) {
            return (EDGE.0.into(), EDGE.1);
        }
        if *why == Failure::Departed {
            return (UNCROSSED.0.into(), UNCROSSED.1);
        }
        if grown > GROWN {
            return (
                format!(
                    "the period has grown by a factor of {grown:.1}, most of it spent near an equilibrium: the \
                     branch ends at a homoclinic or heteroclinic orbit close by"
                ),
                "take the parameter value here as that of the orbit, or end the range earlier",
            );
        }
        if !past.moved && left.slope().abs() < STANDS {
            return (
                "the parameter has not changed since the start of the branch: the solutions form a family at one \
                 parameter value, as in a conservative system"
                    .into(),
                "add a small damping and continue it to zero, or choose a parameter on which the family depends",
            );
        }
        match self.settings.kinks {
            0 => {}
            n => {
                let places = if n == 1 { "a non-smooth term".to_string() } else { format!("{n} non-smooth terms") };
                return (
                    format!(
                        "the right-hand side has {places} (abs, sign, heaviside, min, max, if, comparisons), and the \
                         solution begins or ceases to slide along a switching surface here, slides along two at once, \
                         or passes several in one instant"
                    ),
                    "try another tolerance; where a term jumps, as sign(x) does, a smooth function with a sharpness \
                     parameter, such as tanh(s*x), can be continued in s to the sharpness needed",
                );
            }
        }
        match why {
            Failure::Mesh(_) => (
                "the solution changes too fast in time for any mesh allowed: a very stiff relaxation oscillation, a \
                 canard, or a contact that is nearly a jump"
                    .into(),
                "set a larger tolerance or a higher degree; or soften the stiff term, and continue the solution back \
                 to its full value",
            ),
            Failure::Unexplained => (
                "another branch is closer than the tolerance can distinguish, or a critical multiplier is not \
                 resolved"
                    .into(),
                "set a smaller tolerance",
            ),
            Failure::Singular | Failure::Elsewhere { .. } | Failure::Bent { .. } | Failure::NotBack { .. } => (
                "the solutions do not form a smooth curve here: a cusp, an isolated point, or branches that meet in \
                 a way that one parameter and the symmetries of the model do not explain"
                    .into(),
                "change another parameter slightly, which unfolds such a point, and follow the branches on both \
                 sides of it",
            ),
            _ => (
                "the solution changes over a much shorter distance than the scales of the states and the parameter \
                 suggest"
                    .into(),
                "give each state and the parameter a `scale` in the model file",
            ),
        }
    }

    /// True if the vector field is not finite somewhere along the tangent, within the longest step tried, or slightly
    /// farther on in the parameter alone.
    fn breaks_off(&mut self, left: &Station, longest: f64) -> bool {
        self.place(left);
        let mut r = vec![0.0; left.u.len()];
        let last = left.u.len() - 1;
        let beside = 1e-6 * (1.0 + left.parameter().abs()) * left.slope().signum();
        (0..=40).any(|k| {
            let share = 0.5f64.powi(40 - k);
            let along: Vec<f64> = left.u.iter().zip(&left.tangent).map(|(u, t)| u + share * longest * t).collect();
            let mut aside = left.u.clone();
            aside[last] += share * beside;
            !self.problem.residual(&along, &mut r) || !self.problem.residual(&aside, &mut r)
        })
    }

    /// Ending of a side of equilibria on which the parameter has converged while the solution keeps changing.
    pub(super) fn at_a_stand(&mut self, right: &Station) -> Ending {
        let edge = self.breaks_off(right, self.settings.first_step);
        let said = format!("the parameter converges to {} while the solution keeps changing", Shown(self.value(right)));
        match edge {
            true => Ending::NotFinite(format!("{said}\nlikely cause: {}\nwhat to do: {}", EDGE.0, EDGE.1)),
            false => Ending::SolutionUnbounded(format!(
                "{said}\nlikely cause: the branch has an asymptote there\nwhat to do: nothing, if an asymptote is \
                 expected there"
            )),
        }
    }

    /// Ending of a side along which the solution grows while the parameter converges, as at a vertical asymptote.
    pub(super) fn unbounded(&self, left: &Station, right: &Station, past: Past) -> Option<Ending> {
        let home = self.home.map_or(&[][..], |home| &home.ranges);
        let size = |ranges: &[[f64; 2]], i: usize| ranges.get(i).map_or(0.0, |[low, high]| low.abs().max(high.abs()));
        let grown = |i: usize, ranges: &[[f64; 2]]| size(ranges, i) / (self.settings.scales[i] + size(home, i));
        let (now, before) = (&right.point.ranges, &left.point.ranges);
        let states = 0..self.settings.scales.len();
        let i = states.max_by(|a, b| grown(*a, now).total_cmp(&grown(*b, now)))?;
        if grown(i, now) < FAR || size(now, i) <= size(before, i) {
            return None;
        }
        let moved = (right.parameter() - left.parameter()).abs();
        if moved > STILL * (1.0 + right.parameter().abs()) * (size(now, i) / size(before, i)).ln() {
            return None;
        }
        let cause = match past.moved {
            true => {
                "the branch has an asymptote there: the solution grows without bound as the parameter approaches \
                     a finite value"
            }
            false => "the solutions form a family at one parameter value, as in a conservative system",
        };
        Some(Ending::SolutionUnbounded(format!(
            "a state has grown to {:.1e} while the parameter stays at {}\nlikely cause: {cause}\nwhat to do: \
             nothing, if that is expected; if such values are normal, give the state a `scale` in the model file",
            size(now, i),
            Shown(self.problem.unit() * ((1e9 * right.parameter()).round() / 1e9))
        )))
    }
}

/// Growth of a state, relative to its scale and its size at the start, above which it may be unbounded.
const FAR: f64 = 1e6;
/// Relative change of the parameter, per growth by a factor of e, below which it has converged.
const STILL: f64 = 1e-5;
