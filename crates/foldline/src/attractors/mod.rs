//! First solutions: attractors found by sampling initial states.
//!
//! **Idea.** Initial states are drawn from a box and integrated together. Each trajectory is watched until its limit
//! can be predicted. The limit is then computed by Newton's method instead of by waiting, and the trajectory is counted
//! once it has been observed to converge there.
//!
//! 1. draw `samples` states, stratified in every component and reproducible from the seed (`sampling`);
//! 2. integrate them in blocks of fixed size, each trajectory with its own step size (`census`, `crate::simulation`);
//! 3. watch the extent of each trajectory: if it shrinks, try an equilibrium (`watch`);
//! 4. watch its returns to a section: if they contract regularly, predict their limit and try a cycle (`returns`,
//!    `candidate`);
//! 5. turn candidates into solutions with their stability by `polish`; keep the stable ones (`candidate`);
//! 6. take a trajectory as settled when its distance to a known solution falls steadily, or when the predicted limit of
//!    its returns lies on that solution (`orbit`, `watch`);
//! 7. merge solutions found in several blocks into one attractor, named by its spectral ratio (`census`, `spectrum`);
//!    if only certain types are requested, stop once they have been found.
//!
//! Maps are iterated (`iterated`). A forced field is sampled as autonomous with two more states (`driven`), an angle as a point on a circle (`angles`).
//!
//! A second set of modules simulates without solving any equation for the motions it finds (`brute_force`, `settling`,
//! `runner`, `measure`, `same`), for comparison with branches.
//!
//! Motions that neither rest nor repeat are classified as tori, locked cycles or chaos (`recognition`); a torus so found
//! may start a branch (`wandering`).
//!
//! **Fails when** an attractor is neither an equilibrium nor a cycle (its trajectories count as unsettled), or attracts
//! so slowly that the returns do not contract measurably within the step limit.

mod angles;
mod birkhoff;
mod brute_force;
mod candidate;
mod census;
mod driven;
mod iterated;
mod measure;
mod orbit;
mod recognition;
mod returns;
mod runner;
mod same;
mod sampling;
mod settling;
mod spectrum;
#[cfg(test)]
mod tests;
mod variation;
mod wandering;
mod watch;
mod window;

use angles::Rolled;
pub(crate) use angles::gained;
pub(crate) use birkhoff::average as weighted_average;
pub use brute_force::{Compare, Report, stepped_sweep, survey_by_simulation};
pub use census::Lost;
pub(crate) use census::PERSISTENT;
use census::Pace;
use census::STEP_LIMIT;
use runner::PATIENT;
pub(crate) use sampling::SplitMix64;
pub use sampling::{Sampling, stratified};
pub use settling::Trial;
pub(crate) use spectrum::ratio_of_samples;
pub use spectrum::{Sense, signed_spectrum, spectral_ratio, whirl_sense};
pub use wandering::first_torus;

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
    /// Default limits of surveys and sweeps, which can only wait for a motion to settle.
    pub fn patient() -> Limits {
        PATIENT
    }
}

impl Default for Limits {
    /// A few thousand periods, without a limit on time.
    fn default() -> Limits {
        Limits { steps: STEP_LIMIT, time: f64::INFINITY }
    }
}

/// A stable equilibrium or cycle, with the number of trajectories that reached it.
#[derive(Clone, Debug)]
pub struct Attractor {
    /// The solution computed by Newton's method.
    pub point: Point,
    /// Spectral ratio of a cycle such as 2:1, if the model has a whirl plane; see [`spectral_ratio`].
    pub ratio: Option<(u32, u32)>,
    /// Number of trajectories that settled there; 0 if its spectrum shows that it attracts and the survey ended before
    /// any trajectory reached it. Not a basin fraction: every fourth trajectory starts nearer to the origin.
    pub hits: usize,
    /// Estimated basin fraction, from the uniformly distributed initial states; `None` if the survey ended before every
    /// trajectory had been integrated.
    pub share: Option<Share>,
    /// `[n]` initial state of the first of these trajectories or, if there are none, a state of the attractor itself.
    pub example: Vec<f64>,
}

/// Outcome of all samples.
#[derive(Clone, Debug, Default)]
pub struct Census {
    /// Equilibria, then cycles, each by decreasing number of hits; ties by increasing norm or period.
    pub attractors: Vec<Attractor>,
    /// Number of trajectories whose limit could not be determined within the step limit.
    pub unsettled: usize,
    /// Number of trajectories whose state grew without bound.
    pub escaped: usize,
    /// Exit points of the trajectories that left the region in which f is defined.
    pub exits: Vec<Exit>,
    /// Number of trajectories whose step size became too small: f jumps, or is too stiff for the method.
    pub stuck: usize,
    /// Number of trajectories whose events, such as impacts, accumulate.
    pub chattered: usize,
    /// Number of samples not integrated to the end, or not at all, because enough was known; see [`survey_until`].
    pub left: usize,
    /// `[samples]` outcome of each initial state, in their order; those not begun are missing.
    pub fates: Vec<Fate>,
    /// Early decisions, if there were any; see [`survey_map`].
    pub early: Option<Early>,
}

/// Outcome of one initial state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// Settled on the attractor of that index.
    Settled(usize),
    /// Did not settle within the limits.
    Unsettled,
    /// Grew without bound.
    Escaped,
    /// Left the region in which f is defined.
    Undefined,
    /// The step size became too small.
    Stuck,
    /// Its events, such as impacts, follow each other ever faster and accumulate.
    Chatter,
    /// Abandoned early.
    Left,
}

/// Early decisions of [`survey_map`], and how often they were wrong where the trajectory was followed further.
#[derive(Clone, Debug, PartialEq)]
pub struct Early {
    /// For each attractor the distance of a steady approach, relative to its size, from which a trajectory counts as
    /// settled; `None` where too few decisions were made or some were wrong.
    pub radii: Vec<Option<f64>>,
    /// Number of trajectories that were followed until they had settled.
    pub checked: usize,
    /// Number of those for which the early decision was wrong.
    pub wrong: usize,
}

/// Exit of a trajectory from the region in which f is defined.
#[derive(Clone, Debug, PartialEq)]
pub struct Exit {
    /// Time since the start.
    pub time: f64,
    /// `[n]` last state at which f is defined.
    pub state: Vec<f64>,
}

/// An approximate solution, as a start for Newton's method.
#[derive(Clone, Debug, PartialEq)]
pub enum Candidate {
    /// Near an equilibrium: the state `[n]`.
    Equilibrium(Vec<f64>),
    /// Near a cycle.
    Cycle {
        /// Approximate period.
        period: f64,
        /// Sample times from 0 to `period`, dense where the motion is fast.
        times: Vec<f64>,
        /// `[time][n]` states; the last nearly agrees with the first.
        states: Vec<f64>,
    },
}

/// Solves for a candidate by Newton's method, a cycle over its minimal period; `None` if that does not converge.
pub type Polish<'a> = &'a (dyn Fn(&Candidate) -> Option<Point> + Sync);

/// True if the attractors reached so far (see [`survey_until`]), with their spectral ratios, are all that is needed.
pub type Enough<'a> = &'a (dyn Fn(&[(&Point, Option<(u32, u32)>)]) -> bool + Sync);

/// Returns the attractors reached from `sampling.samples` initial states.
///
/// `polish` computes a candidate by Newton's method and is called from several threads. Periods of candidates are in
/// the time unit of the field: for a forced field in forcing periods, at the beginning of one of which the candidate
/// starts.
pub fn survey(field: &dyn VectorField, parameters: &[f64], sampling: &Sampling, polish: Polish) -> Census {
    survey_at(field, parameters, sampling, polish, (Pace::THOROUGH, &|_| false))
}

/// Samples attractors like [`survey`], but stops as soon as `enough` accepts the attractors that count as reached: in a
/// block of 16 samples once at least half of them have settled, or else at the end of the block. Those are the
/// solutions on which samples were observed to settle and, once half of the block has settled, a solution that is the
/// only known equilibrium, or the only known cycle, and clearly attracts by its spectrum. They depend on the order of
/// the samples, not on the number of threads. Trajectories are integrated to a relative accuracy of 1e-5 instead of
/// 1e-6.
pub fn survey_until(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    polish: Polish,
    enough: Enough,
) -> Census {
    survey_at(field, parameters, sampling, polish, (Pace::BRIEF, enough))
}

/// Samples attractors like [`survey`], for maps of basins: there are so many initial states that most lead to
/// attractors already found. The first few thousand are observed as in a survey; they should be spread over all. Later
/// ones are compared with the known attractors only, and observed from half of their steps on if that does not settle
/// them. They count as settled at the largest distance, for each attractor, at which no decision about the first ones
/// would have been wrong; one in 64 is followed further to check that ([`Census::early`]).
pub fn survey_map(field: &dyn VectorField, parameters: &[f64], sampling: &Sampling, polish: Polish) -> Census {
    survey_at(field, parameters, sampling, polish, (Pace::MAP, &|_| false))
}

fn survey_at(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    polish: Polish,
    until: (Pace, Enough),
) -> Census {
    if field.iterated() {
        let brief = until.0.block == Pace::BRIEF.block;
        return iterated::survey(field, parameters, sampling, polish, brief, until.1);
    }
    if let Some(rolled) = Rolled::new(field) {
        return angles::survey(&rolled, parameters, sampling, polish, until);
    }
    match field.forced() {
        true => driven::survey(field, parameters, sampling, polish, until),
        false => census::survey(field, parameters, sampling, polish, until),
    }
}

/// Returns the attractor to which the trajectory from `start` `[n]` goes; with forcing, from the beginning of a forcing
/// period. If watching finds none, as for cycles of many turns, the trajectory is followed until it repeats itself.
pub fn settle(
    field: &dyn VectorField,
    parameters: &[f64],
    sampling: &Sampling,
    start: &[f64],
    polish: Polish,
) -> Result<Point, Lost> {
    if field.iterated() {
        return iterated::settle(field, parameters, sampling, start, polish);
    }
    if let Some(rolled) = Rolled::new(field) {
        return angles::settle(&rolled, parameters, sampling, start, polish);
    }
    match field.forced() {
        true => driven::settle(field, parameters, sampling, start, polish),
        false => census::settle(field, parameters, sampling, start, polish),
    }
}
