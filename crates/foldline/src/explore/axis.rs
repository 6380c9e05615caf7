//! The free parameter of a stored branch, with those that change with it.

use super::System;
use crate::diagram::Branch;
use crate::problem::{Axis, Tie};

/// Parameter and its change.
type Change = (usize, f64);

/// Returns the free parameter of a branch in one parameter. Homotopy runs change several parameters in proportion; they
/// are tied to the one that changes most.
pub fn axis_of(system: &System, branch: &Branch) -> Axis {
    let axis = |index: usize| Axis::new(index, system.unit(index));
    let parameters = branch.points.first().map(|point| point.parameters.clone()).unwrap_or_default();
    match branch.points.iter().map(|p| change(&parameters, &p.parameters)).max_by(larger) {
        Some(Some((main, changes))) => {
            let ties = changes.iter().filter(|(index, _)| *index != main.0).map(|(index, by)| Tie {
                index: *index,
                slope: by / main.1,
                offset: parameters[*index] - by / main.1 * parameters[main.0],
            });
            Axis { ties: ties.collect(), ..axis(main.0) }
        }
        _ => axis(branch.free),
    }
}

/// Largest change between two sets of parameters, and all changes.
fn change(from: &[f64], to: &[f64]) -> Option<(Change, Vec<Change>)> {
    let all: Vec<Change> =
        from.iter().zip(to).map(|(a, b)| b - a).enumerate().filter(|(_, by)| by.abs() > 1e-13).collect();
    let main = all.iter().copied().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    Some((main, all))
}

fn larger(a: &Option<(Change, Vec<Change>)>, b: &Option<(Change, Vec<Change>)>) -> std::cmp::Ordering {
    let size = |change: &Option<(Change, Vec<Change>)>| change.as_ref().map_or(0.0, |(main, _)| main.1.abs());
    size(a).total_cmp(&size(b))
}
