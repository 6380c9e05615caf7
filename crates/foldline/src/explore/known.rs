//! Whether a solution lies on a branch that is known already.
//!
//! **Idea.** Two solutions at the same parameter values are the same if their periods and the ranges of all states and
//! outputs agree, up to a reflection under which the model is equivariant. Known branches are asked for their solution at
//! the parameter value in question: interpolated first, and where that is close, by Newton's method.

use super::System;
use super::growth::{polished, problem_of};
use crate::continuation::Settings;
use crate::diagram::{Branch, Point};

/// The name of the branch on which `point` lies.
pub fn branch_of<'b>(
    system: &System,
    settings: &Settings,
    free: usize,
    degree: usize,
    point: &Point,
    branches: &'b [Branch],
) -> Option<&'b str> {
    let value = *point.parameters.get(free)?;
    let found = branches.iter().filter(|b| b.free == free).find(|branch| {
        branch.points.windows(2).any(|pair| {
            let (a, b) = (pair[0].parameters[free], pair[1].parameters[free]);
            if (a - value) * (b - value) > 0.0 {
                return false;
            }
            let nearest = if (a - value).abs() < (b - value).abs() { &pair[0] } else { &pair[1] };
            let apart = pair[0].difference(&pair[1], &system.scales, &[]);
            let close = |other: &Point, tolerance: f64| {
                system.reflections.iter().any(|r| point.difference(other, &system.scales, r) < tolerance)
            };
            if !close(nearest, 1e-3 + 1.5 * apart) {
                return false;
            }
            let mut problem = problem_of(system, free, degree, nearest, false);
            let mut guess = nearest.clone();
            guess.parameters[free] = value;
            polished(&mut *problem, settings, &guess).is_ok_and(|same| close(&same.point, 30.0 * settings.tolerance))
        })
    });
    found.map(|branch| branch.name.as_str())
}
