//! Where do first solutions come from? Attractors found by sampling initial states.
//!
//! **Idea.** Initial states are drawn from a box and integrated together. Each trajectory is watched until one can say where
//! it goes; what it goes to is then computed by Newton's method instead of by waiting, and the trajectory is counted once
//! it has been seen to converge there.
//!
//! 1. draw `samples` states, stratified in every component and the same for the same seed (`sampling`);
//! 2. integrate them in blocks of fixed size, each trajectory with a step of its own (`census`, `crate::simulation`);
//! 3. watch the extent of each trajectory: where it shrinks, an equilibrium is tried (`watch`);
//! 4. watch its returns to a section: where they contract regularly, their limit is predicted and a cycle tried (`returns`, `candidate`);
//! 5. `polish` turns a candidate into a solution with its stability; only stable ones are kept (`candidate`);
//! 6. a trajectory has settled when its distance to a solution found so far falls steadily, or when the predicted limit of
//!    its returns lies on that solution (`orbit`, `watch`);
//! 7. the same solution found in several blocks is one attractor, named by its spectral ratio (`census`, `spectrum`); where
//!    only some types are wanted, no more blocks are followed than it takes to find them.
//!
//! A forced field is sampled as an autonomous one with two states more (`driven`), an angle as a point of a circle (`angles`).
//!
//! Beside this stands simulation that solves no equation for the motions it finds (`brute_force`, `settling`, `runner`, `measure`), to be
//! compared with branches.
//!
//! **Fails when** an attractor is neither an equilibrium nor a cycle (its trajectories count as unsettled), or attracts so
//! slowly that the returns do not contract measurably within the limit on the number of steps.

mod angles;
mod brute_force;
mod candidate;
mod census;
mod driven;
mod measure;
mod orbit;
mod returns;
mod runner;
mod sampling;
mod settling;
mod spectrum;
#[cfg(test)]
mod tests;
mod watch;
mod window;

use angles::Rolled;
pub(crate) use angles::gained;
pub use brute_force::{Compare, Report, stepped_sweep, survey_by_simulation};
pub use census::Lost;
use census::Pace;
use census::STEP_LIMIT;
use runner::PATIENT;
pub use sampling::Sampling;
pub use settling::Trial;
pub use spectrum::{Sense, signed_spectrum, spectral_ratio, whirl_sense};

use crate::contract::VectorField;
use crate::diagram::{Point, Share};

/// Limits beyond which a trajectory counts as unsettled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Integration steps, accepted and rejected.
    pub steps: usize,
    /// Time, in the units of the model.
    pub time: f64,
}

impl Limits {
    /// The usual limits of surveys and sweeps, which have no other way to a motion than to wait for it.
    pub fn patient() -> Limits {
        PATIENT
    }
}

impl Default for Limits {
    /// Some thousand periods; any time.
    fn default() -> Limits {
        Limits { steps: STEP_LIMIT, time: f64::INFINITY }
    }
}

/// A stable equilibrium or cycle, and how often it was reached.
#[derive(Clone, Debug)]
pub struct Attractor {
    /// The solution as polished.
    pub point: Point,
    /// Spectral ratio of a cycle such as 2:1, where a whirl plane was named; see [`spectral_ratio`].
    pub ratio: Option<(u32, u32)>,
    /// Number of trajectories that settled there; 0 if its spectrum shows that it attracts and the survey ended before any
    /// trajectory reached it. Not a basin fraction: every fourth trajectory starts nearer to the origin.
    pub hits: usize,
    /// Estimated basin fraction, from the uniformly distributed initial states; `None` if the survey ended before every
    /// trajectory had been integrated.
    pub share: Option<Share>,
    /// `[n]` initial state of the first of them, or where there is none a state of its own.
    pub example: Vec<f64>,
}

/// What became of all samples.
#[derive(Clone, Debug, Default)]
pub struct Census {
    /// Equilibria, then cycles, each by falling number of hits; ties by growing norm or period.
    pub attractors: Vec<Attractor>,
    /// Trajectories about which nothing could be said within the limit on the number of steps.
    pub unsettled: usize,
    /// Number of trajectories whose state grew without bound.
    pub escaped: usize,
    /// Exit points of the trajectories that left the region in which f is defined.
    pub exits: Vec<Exit>,
    /// Trajectories whose steps became too small: f jumps, or is too stiff for the method.
    pub stuck: usize,
    /// Samples that were not followed to their end, or not at all, since enough was known; see [`survey_until`].
    pub left: usize,
}

/// Exit of a trajectory from the region in which f is defined.
#[derive(Clone, Debug, PartialEq)]
pub struct Exit {
    /// Time since the start.
    pub time: f64,
    /// `[n]` last state at which f is defined.
    pub state: Vec<f64>,
}

/// An approximate solution, to be computed exactly.
#[derive(Clone, Debug, PartialEq)]
pub enum Candidate {
    /// Near an equilibrium: the state `[n]`.
    Equilibrium(Vec<f64>),
    /// Near a cycle.
    Cycle {
        /// Its period, approximately.
        period: f64,
        /// From 0 to `period`, dense where the motion is fast.
        times: Vec<f64>,
        /// `[time][n]`: the first is the start, the last the end, which nearly agrees with it.
        states: Vec<f64>,
    },
}

/// Solves for a candidate by Newton's method, a cycle over its minimal period; `None` if that does not converge.
pub type Polish<'a> = &'a (dyn Fn(&Candidate) -> Option<Point> + Sync);

/// Says whether the attractors that count as reached so far (see [`survey_until`]), each with its spectral ratio, are all that is wanted.
pub type Enough<'a> = &'a (dyn Fn(&[(&Point, Option<(u32, u32)>)]) -> bool + Sync);

/// The attractors reached from `sampling.samples` initial states.
///
/// `polish` computes a candidate by Newton's method; it is called from several threads. Periods of candidates are in the time of the
/// field: for a forced one in periods of the forcing, with which they begin.
pub fn survey(field: &dyn VectorField, parameters: &[f64], sampling: &Sampling, polish: Polish) -> Census {
    survey_at(field, parameters, sampling, polish, (Pace::THOROUGH, &|_| false))
}

/// The same, but no further than needed: it ends with the first block of 16 samples in which half of them or more have settled
/// and `enough` says so of the attractors that count as reached until then, each with its spectral ratio. What counts is what samples were
/// seen to go to; and what Newton's method has found on the way, if it is the only equilibrium, or the only cycle, that is known and its
/// spectrum leaves no doubt that it attracts. Which these are depends on the order of the samples, not on the number of threads. Trajectories
/// are integrated to 1e-5, relative, instead of 1e-6.
pub fn survey_until(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    polish: Polish,
    enough: Enough,
) -> Census {
    survey_at(field, parameters, sampling, polish, (Pace::BRIEF, enough))
}

fn survey_at(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    polish: Polish,
    until: (Pace, Enough),
) -> Census {
    if let Some(rolled) = Rolled::new(field) {
        return angles::survey(&rolled, parameters, sampling, polish, until);
    }
    match field.forced() {
        true => driven::survey(field, parameters, sampling, polish, until),
        false => census::survey(field, parameters, sampling, polish, until),
    }
}

/// The attractor to which the trajectory from `start` `[n]` goes, with a forced field from the beginning of a period on. Where the
/// watch sees none, as with cycles of many turns, the trajectory is followed until it repeats itself.
pub fn settle(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    start: &[f64],
    polish: Polish,
) -> Result<Point, Lost> {
    if let Some(rolled) = Rolled::new(field) {
        return angles::settle(&rolled, parameters, sampling, start, polish);
    }
    match field.forced() {
        true => driven::settle(field, parameters, sampling, start, polish),
        false => census::settle(field, parameters, sampling, start, polish),
    }
}
