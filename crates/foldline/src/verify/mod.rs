//! Verification: the numbers of a diagram compared with independent computations.
//!
//! **Idea.** A cycle computed by collocation is recomputed by multiple shooting: integration of the equations of motion
//! and of their variational equations, which shares only the vector field with collocation. The differences from the
//! nearest solution by shooting, in profile, period, extreme values and multipliers, are compared with the error that
//! the point states. Special points are located again from solutions around them. That stability changes only at
//! located points is checked without further computation.
//!
//! | topic | file |
//! |---|---|
//! | nearest solution by shooting | `shooting`, `variational` |
//! | cycles along which f or the state jumps | `located`, `jumping` |
//! | single points | `points` |
//! | cycles of maps, by the composed map | `maps` |
//! | tori, by integration over a period and by long trajectories | `tori` |
//! | positions of special points | `special`, `touching` |
//! | changes of stability | `record` |
//!
//! **Fails when** the integration itself is not accurate enough: stiff equations, or trajectories that only touch a surface.
//! Undecided cases are counted and reported as such, not as passed.

mod arcs;
mod jumping;
mod located;
mod maps;
mod points;
mod record;
mod shooting;
mod special;
#[cfg(test)]
mod tests;
mod tori;
mod touching;
mod variational;

use crate::diagram::{Branch, Diagram, Family, Kind, Solution};
use crate::explore::{System, axis_of};
use crate::problem::{Axis, Setting};

/// Quantity that is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Quantity {
    /// State along a cycle, or that of an equilibrium, relative to its scale.
    Profile,
    /// Period, relative.
    Period,
    /// Smallest and largest values of states and outputs, relative to their scale.
    Range,
    /// Multipliers, relative to the larger of 1 and their size; for an equilibrium the power sums of its eigenvalues.
    Spectrum,
    /// Distance from the stability boundary of a multiplier on the wrong side of the unit circle, or an eigenvalue on
    /// the wrong side of the imaginary axis.
    Stability,
    /// Parameter at a special point, relative to 1 + its size.
    Place,
    /// Instants of the events of a cycle, relative to the period; infinite if their number differs.
    Events,
    /// Rotation number of a torus, relative to 1 + its size.
    Rotation,
    /// Distance of a long trajectory from a torus, relative to the scales of the states.
    Distance,
    /// Discrepancy in the number of unstable multipliers from one point to the next.
    Record,
}

impl Quantity {
    /// All quantities.
    pub const ALL: [Quantity; 10] = [
        Quantity::Profile,
        Quantity::Period,
        Quantity::Range,
        Quantity::Spectrum,
        Quantity::Stability,
        Quantity::Place,
        Quantity::Events,
        Quantity::Rotation,
        Quantity::Distance,
        Quantity::Record,
    ];

    /// Name used in tables.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Profile => "profile",
            Quantity::Period => "period",
            Quantity::Range => "range",
            Quantity::Spectrum => "spectrum",
            Quantity::Stability => "stability",
            Quantity::Place => "location",
            Quantity::Events => "events",
            Quantity::Rotation => "rotation",
            Quantity::Distance => "distance",
            Quantity::Record => "consistency",
        }
    }
}

/// Comparison of a number of the diagram with its recomputed value.
#[derive(Clone, Debug)]
pub struct Check {
    /// Branch.
    pub branch: String,
    /// Position of the point; for a special point, of the point just before it.
    pub position: i64,
    /// Kind of special point, if it is one.
    pub special: Option<Kind>,
    /// Value of the continuation parameter.
    pub parameter: f64,
    /// Quantity that is compared.
    pub quantity: Quantity,
    /// Error stated by the diagram plus that of the comparison itself; `None` if the diagram states none, such as those
    /// of earlier versions for multipliers.
    pub stated: Option<f64>,
    /// Difference found.
    pub found: f64,
}

impl Check {
    /// Difference divided by the stated error; above 1 the diagram is wrong. `None` if no error is stated.
    pub fn ratio(&self) -> Option<f64> {
        let stated = self.stated?;
        Some(if self.found == 0.0 { 0.0 } else { self.found / stated })
    }

    fn order(&self) -> f64 {
        self.ratio().unwrap_or(-1.0)
    }
}

/// Undecided check, with the reason.
#[derive(Clone, Debug)]
pub struct Undecided {
    /// Branch.
    pub branch: String,
    /// Position of the point.
    pub position: i64,
    /// Kind of special point, if it is one.
    pub special: Option<Kind>,
    /// Reason.
    pub why: &'static str,
}

/// Result of a verification.
#[derive(Clone, Debug, Default)]
pub struct Verified {
    /// All comparisons, worst first.
    pub checks: Vec<Check>,
    /// Undecided checks.
    pub undecided: Vec<Undecided>,
    /// Number of points recomputed.
    pub points: usize,
    /// Number of special points located again.
    pub special: usize,
    /// Number of points without a stored profile, which were not recomputed.
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

    /// Comparisons that exceed the stated error.
    pub fn wrong(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|check| check.ratio().is_some_and(|ratio| ratio.is_nan() || ratio > 1.0))
    }
}

/// Verifies the branches of a diagram computed with the given tolerance. `sample` is the maximum number of points
/// recomputed, spread evenly over the branches; special points are always verified.
pub fn verify(
    system: &System,
    diagram: &Diagram,
    tolerance: f64,
    sample: Option<usize>,
    kept: &dyn Fn(&Branch) -> bool,
) -> Verified {
    let system = &system.clone().in_units_of(diagram);
    let branches: Vec<&Branch> = diagram.branches.iter().filter(|branch| kept(branch)).collect();
    // Points without a stored profile cannot be recomputed.
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
        let connecting = branch.is_connecting();
        if system.is_open() || connecting {
            out.add(arcs::verify(system, branch, &chosen, accuracies(tolerance)[0]));
            continue;
        }
        let setting = setting(system, branch);
        out.add(match system.field.iterated() {
            true => maps::points(&setting, branch, &chosen),
            false if branch.family == Family::Torus => tori::verify(system, &setting, branch, &chosen, tolerance),
            false => points::verify(system, &setting, branch, &chosen, tolerance),
        });
        out.add(special::verify(&setting, branch, tolerance));
        // Along a curve in two parameters stability also changes at codimension-two points that are not located.
        if branch.held.is_none() {
            out.add(record::verify(branch));
        }
    }
    out.checks.sort_by(|a, b| b.order().total_cmp(&a.order()));
    out
}

/// Accuracy of the integration for a diagram of the given tolerance, and a coarser one: their difference is the error
/// of the comparison itself, which weak damping amplifies as much as all other errors.
fn accuracies(tolerance: f64) -> [f64; 2] {
    let fine = (1e-6 * tolerance).clamp(1e-13, 1e-9);
    [fine, 10.0 * fine]
}

/// Setting with the free parameters of a branch.
fn setting<'a>(system: &'a System, branch: &Branch) -> Setting<'a> {
    let parameters = branch.points.first().map(|point| point.parameters.clone()).unwrap_or_default();
    let axes = match branch.held {
        Some((_, other)) => [other, branch.free].map(|index| Axis::new(index, system.unit(index))).to_vec(),
        None if !branch.also.is_empty() => {
            let all = branch.also.iter().map(|(index, _)| *index).chain([branch.free]);
            all.map(|index| Axis::new(index, system.unit(index))).collect()
        }
        None => vec![axis_of(system, branch)],
    };
    Setting { field: system.field, scales: &system.scales, parameters, axes }
}

/// True if a branch is a curve of cycles (its points are).
fn of_cycles(branch: &Branch) -> bool {
    branch.points.iter().any(|point| matches!(point.solution, Solution::Cycle(_)))
}
