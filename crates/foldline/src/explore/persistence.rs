//! Persistence of a solution when a parameter is carried to another value.
//!
//! **Idea.** A parameter that stands for an idealisation, such as the sharpness of a smoothed contact, should not
//! decide which solutions exist. The solution is followed in that parameter alone, all others fixed. Either it reaches
//! the value, or the curve turns back before; then the solution exists only because of the value of the parameter. The
//! curve may turn once more and reach the value as another solution, but that changes nothing.
//!
//! **Source.** akay2024, where branches that owe their existence to a small sharpness are shown, and avoided by a
//! larger one.
//!
//! **Fails when** the curve ends otherwise than at a fold, such as at a cycle that shrinks to an equilibrium; the
//! result is then how it ended.

use super::System;
use super::growth::{Beginning, Growth, polished, problem_of, settings};
use crate::contract::{Event, Observer, Verdict};
use crate::diagram::{Branch, Ending, Kind, Origin, Point};

/// Fate of a solution.
#[derive(Clone, Debug)]
pub enum Persistence {
    /// It reaches the value with as many unstable eigenvalues or multipliers as before.
    Survives(Box<Point>),
    /// It reaches the value with another number of them.
    Changes(Box<Point>),
    /// The curve turns back at this value of the parameter, up to which the solution exists.
    Vanishes {
        /// Parameter value at which it turns back.
        fold: f64,
    },
    /// The curve ended otherwise before the question was decided.
    Undecided(Ending),
}

impl Persistence {
    /// True if the solution, with its stability, owes its existence to the parameter.
    pub fn is_artefact(&self) -> bool {
        matches!(self, Persistence::Vanishes { .. } | Persistence::Changes(_))
    }
}

/// Follows the solution at `point` while the parameter of index `free` goes to `value`, all others fixed.
///
/// `tolerance` and `degree` are as in a plan; `max_points` limits the points of the curve.
pub fn persistence(
    system: &System,
    tolerance: f64,
    degree: usize,
    point: &Point,
    free: usize,
    value: f64,
    max_points: usize,
) -> Persistence {
    let own = point.parameters.get(free).copied().unwrap_or(value);
    if own == value {
        return Persistence::Survives(Box::new(point.clone()));
    }
    let forward = value > own;
    let range = [own.min(value), own.max(value)];
    let settings = settings(system, tolerance, range, max_points);
    let family = system.family_of(&point.solution);
    let mut problem = problem_of(system, free, degree, point, false);
    let start = match polished(&mut *problem, &settings, point) {
        Ok(start) => start,
        Err(why) => return Persistence::Undecided(Ending::NoStart(why.to_string())),
    };
    let unstable = start.point.unstable;
    let mut branch = Branch::new("persistence", family, free, Origin::Seed(String::new()));
    let sides = [!forward, forward];
    let growth = Growth {
        system,
        settings: &settings,
        degree,
        ties: Vec::new(),
        sides,
        parents: &[],
        marks: &[],
        observer: &UntilFold,
        whole: true,
        sparse: false,
    };
    growth.begin(&mut branch, Beginning::Inside(start));
    decided(&branch, value, forward, unstable)
}

fn decided(branch: &Branch, value: f64, forward: bool, unstable: usize) -> Persistence {
    let end = if forward { branch.points.last() } else { branch.points.first() };
    let ending = branch.ends[usize::from(forward)].clone().unwrap_or(Ending::Stopped);
    // Beyond the first fold there is another solution, whatever value that reaches.
    let mut folds = branch.special.iter().filter(|s| s.kind == Kind::Fold);
    if let Some(fold) = if forward { folds.next() } else { folds.next_back() } {
        return Persistence::Vanishes { fold: fold.point.parameters[branch.free] };
    }
    let arrived = |bound: f64| (bound - value).abs() <= 1e-9 * branch.size(value);
    match (&ending, end) {
        (Ending::Bound(bound), Some(end)) if arrived(*bound) => {
            let at = Box::new(end.clone());
            if at.unstable == unstable { Persistence::Survives(at) } else { Persistence::Changes(at) }
        }
        _ => Persistence::Undecided(ending),
    }
}

/// An observer that ends a curve where it turns back.
struct UntilFold;

impl Observer for UntilFold {
    fn observe(&self, event: Event) -> Verdict {
        match event {
            Event::Special(_, special) if special.kind == Kind::Fold => Verdict::Stop,
            _ => Verdict::Continue,
        }
    }
}
