//! Simulation: integration of one or many trajectories, with their section crossings.
//!
//! **Idea.** Trajectories are integrated as a batch: in every sweep each of them advances by one step of its own
//! length, and the vector field is evaluated once per stage for all. A single trajectory is a batch of one. If the
//! field declares switches ([`crate::contract::VectorField::switches`]), every step ends at the first one that changes
//! sign. A trajectory whose steps are limited by stability continues with an implicit method.
//!
//! | topic | item |
//! |---|---|
//! | one trajectory, with its crossings | [`Integrator`] |
//! | many trajectories | [`Ensemble`] |
//! | the solution between the ends of a step | [`Step`] |
//! | sign changes of a function of the state | [`Section`] |
//! | forced fields | [`Clocked`]: the others take autonomous ones |

mod aligned;
mod clocked;
mod ensemble;
mod implicit;
mod kink;
mod radau;
mod root;
mod section;
mod shortened;
mod step;
mod tableau;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_kinks;
#[cfg(test)]
mod tests_stiff;
mod trajectory;

pub use clocked::Clocked;
pub(crate) use clocked::bordered;
pub use ensemble::Ensemble;
pub use section::{Crossing, Direction, Section};
pub use step::Step;
pub use trajectory::{Integrator, Passage};

/// Accuracy of each step: |errorᵢ| ≤ absoluteᵢ + relative |xᵢ|, in the root mean square over the components.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    /// Error relative to the component.
    pub relative: f64,
    /// `[n]` error accepted even where the component vanishes, in its unit.
    pub absolute: Vec<f64>,
}

impl Tolerance {
    /// Equal tolerances for `n` components of order one.
    pub fn uniform(tolerance: f64, n: usize) -> Tolerance {
        Tolerance { relative: tolerance, absolute: vec![tolerance; n] }
    }
}

/// Reason why a trajectory ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The end of the time span was reached.
    Reached,
    /// The observer stopped the trajectory.
    Stopped,
    /// The state grew without bound.
    Escaped,
    /// The trajectory left the region in which f is defined: f is not finite at the start, or at some stage of every
    /// step from the last state, however short.
    Undefined,
    /// The step fell below the resolution of time: f jumps where the field declares no switch, the trajectory slides
    /// along a switch, or the problem is too stiff.
    StepTooSmall,
    /// The limit on the number of steps was reached.
    StepLimit,
    /// Events follow each other ever faster and accumulate, as the impacts of a ball that comes to rest.
    Chatter,
}

impl Outcome {
    /// True if the trajectory could not be continued.
    pub fn is_lost(self) -> bool {
        matches!(self, Outcome::Escaped | Outcome::Undefined | Outcome::StepTooSmall | Outcome::Chatter)
    }
}

/// End of a trajectory, with its cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrival {
    /// Time reached.
    pub time: f64,
    /// `[n]` state there.
    pub state: Vec<f64>,
    /// Reason for ending.
    pub outcome: Outcome,
    /// Number of accepted steps.
    pub steps: usize,
    /// Number of rejected steps.
    pub rejected: usize,
}
