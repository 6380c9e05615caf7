//! Is a diagram right? Its numbers against the same numbers computed in another way.
//!
//! **Idea.** A cycle that came from collocation is computed again by multiple shooting: integration of the equations of motion and
//! of their variational equations, which has nothing in common with the polynomials but the vector field. The nearest solution
//! by shooting says how far off profile, period, extreme values and multipliers are, and that is held against the error that
//! the point states itself. Special points are located again from solutions around them. That stability changes only where
//! something is located needs no computation.
//!
//! | question | file |
//! |---|---|
//! | the nearest solution by shooting? | `shooting`, `variational` |
//! | is a point what it says? | `points` |
//! | is a special point where it says? | `special` |
//! | is every change of stability explained? | `record` |
//!
//! **Fails when** the integration is not accurate enough itself: stiff equations, or a right-hand side that jumps. What could not be
//! decided is counted and said, not passed.

mod points;
mod record;
mod shooting;
mod special;
#[cfg(test)]
mod tests;
mod variational;

use crate::diagram::{Branch, Diagram, Kind, Solution};
use crate::explore::System;
use crate::problem::{Axis, Setting, Tie};

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Quantity {
    /// The state along a cycle, or that of an equilibrium, relative to its scale.
    Profile,
    /// The period, relative.
    Period,
    /// Smallest and largest values of states and outputs, relative to their scale.
    Range,
    /// Multipliers, relative to the larger of 1 and their size; for an equilibrium the power sums of its eigenvalues.
    Spectrum,
    /// A multiplier on the wrong side of the unit circle, or an eigenvalue of the imaginary axis: its distance to it.
    Stability,
    /// The parameter at a special point, relative to 1 + its size.
    Place,
    /// The number of unstable multipliers from one point to the next: by how many it is off.
    Record,
}

impl Quantity {
    /// Every quantity.
    pub const ALL: [Quantity; 7] = [
        Quantity::Profile,
        Quantity::Period,
        Quantity::Range,
        Quantity::Spectrum,
        Quantity::Stability,
        Quantity::Place,
        Quantity::Record,
    ];

    /// The name used in tables.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Profile => "profile",
            Quantity::Period => "period",
            Quantity::Range => "range",
            Quantity::Spectrum => "spectrum",
            Quantity::Stability => "stability",
            Quantity::Place => "location",
            Quantity::Record => "consistency",
        }
    }
}

/// A number of the diagram against the same number computed in another way.
#[derive(Clone, Debug)]
pub struct Check {
    /// Which branch.
    pub branch: String,
    /// Which point; for a special point that just before it.
    pub position: i64,
    /// Which kind of special point, if it is one.
    pub special: Option<Kind>,
    /// Value of the continuation parameter.
    pub parameter: f64,
    /// What is compared.
    pub quantity: Quantity,
    /// The error that the diagram states, and what the comparison itself may be off by; `None` where it states none, as runs of
    /// earlier versions for multipliers.
    pub stated: Option<f64>,
    /// The difference that was found.
    pub found: f64,
}

impl Check {
    /// The difference over the stated error; above 1 the diagram is wrong. `None` where no error is stated.
    pub fn ratio(&self) -> Option<f64> {
        let stated = self.stated?;
        Some(if self.found == 0.0 { 0.0 } else { self.found / stated })
    }

    fn order(&self) -> f64 {
        self.ratio().unwrap_or(-1.0)
    }
}

/// What could not be decided, and why.
#[derive(Clone, Debug)]
pub struct Undecided {
    /// Which branch.
    pub branch: String,
    /// Which point.
    pub position: i64,
    /// Which kind of special point, if it is one.
    pub special: Option<Kind>,
    /// Why.
    pub why: &'static str,
}

/// The result.
#[derive(Clone, Debug, Default)]
pub struct Verified {
    /// Every comparison, the worst first.
    pub checks: Vec<Check>,
    /// What was left undecided.
    pub undecided: Vec<Undecided>,
    /// How many points were computed again.
    pub points: usize,
    /// How many special points were located again.
    pub special: usize,
    /// Number of points without a stored profile, which were not computed again.
    pub removed: usize,
}

impl Verified {
    fn add(&mut self, mut other: Verified) {
        self.checks.append(&mut other.checks);
        self.undecided.append(&mut other.undecided);
        self.points += other.points;
        self.special += other.special;
        self.removed += other.removed;
    }

    /// Comparisons that show something wrong.
    pub fn wrong(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|check| check.ratio().is_some_and(|ratio| ratio.is_nan() || ratio > 1.0))
    }
}

/// Verifies the branches of a diagram that was computed with that tolerance. `sample` is the largest number of points that are computed
/// again, spread evenly over those branches; special points always are.
pub fn verify(
    system: &System,
    diagram: &Diagram,
    tolerance: f64,
    sample: Option<usize>,
    kept: &dyn Fn(&Branch) -> bool,
) -> Verified {
    let system = &system.clone().in_units_of(diagram);
    let branches: Vec<&Branch> = diagram.branches.iter().filter(|branch| kept(branch)).collect();
    // Points whose profile has been removed cannot be computed again.
    let stored = |branch: &Branch| -> Vec<usize> {
        (0..branch.points.len()).filter(|i| branch.points[*i].solution.is_stored()).collect()
    };
    let all: usize = branches.iter().map(|branch| stored(branch).len()).sum();
    let wanted = sample.unwrap_or(all).min(all);
    let mut out = Verified::default();
    let mut seen = 0;
    for branch in branches {
        let candidates = stored(branch);
        out.removed += branch.points.len() - candidates.len();
        // Point number i of all is taken where i · wanted / all changes.
        let taken = |i: usize| ((seen + i + 1) * wanted) / all.max(1) > ((seen + i) * wanted) / all.max(1);
        let chosen: Vec<usize> = (0..candidates.len()).filter(|i| taken(*i)).map(|i| candidates[i]).collect();
        seen += candidates.len();
        let setting = setting(system, branch);
        out.add(points::verify(system, &setting, branch, &chosen, tolerance));
        out.add(special::verify(&setting, branch, tolerance));
        // Along a curve in two parameters stability changes where two conditions meet, which are not located.
        if branch.held.is_none() {
            out.add(record::verify(branch));
        }
    }
    out.checks.sort_by(|a, b| b.order().total_cmp(&a.order()));
    out
}

/// The accuracy of the integration for a diagram of that tolerance, and one that is coarser: what the two differ by is the error of
/// the comparison itself. Next to no damping it is amplified as much as all other errors.
fn accuracies(tolerance: f64) -> [f64; 2] {
    let fine = (1e-6 * tolerance).clamp(1e-13, 1e-9);
    [fine, 10.0 * fine]
}

/// What is free along a branch. The legs of a homotopy change several parameters in proportion.
fn setting<'a>(system: &'a System, branch: &Branch) -> Setting<'a> {
    let parameters = branch.points.first().map(|point| point.parameters.clone()).unwrap_or_default();
    let axis = |index: usize| Axis::new(index, system.unit(index));
    let axes = match branch.held {
        Some((_, other)) => vec![axis(other), axis(branch.free)],
        None => match branch.points.iter().map(|p| change(&parameters, &p.parameters)).max_by(larger) {
            Some(Some((main, changes))) => {
                let ties = changes.iter().filter(|(index, _)| *index != main.0).map(|(index, by)| Tie {
                    index: *index,
                    slope: by / main.1,
                    offset: parameters[*index] - by / main.1 * parameters[main.0],
                });
                vec![Axis { ties: ties.collect(), ..axis(main.0) }]
            }
            _ => vec![axis(branch.free)],
        },
    };
    Setting { field: system.field, scales: &system.scales, parameters, axes }
}

/// A parameter and by how much it changes.
type Change = (usize, f64);

/// What changes between two sets of parameters: that which changes most, and all of them.
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

/// Whether a branch is a curve of cycles (its points are).
fn of_cycles(branch: &Branch) -> bool {
    branch.points.iter().any(|point| matches!(point.solution, Solution::Cycle(_)))
}
