//! First cycles with two frequencies in a given ratio, from the balance of harmonics at the coordinates of local forces.
//!
//! **Idea.** A rotor that bounces in a ring moves in two whirls whose frequencies the contact pulls into a ratio of
//! whole numbers. The rest of the rotor, however large, is linear and enters only through its flexibility at each
//! frequency, so that the few coordinates of the contact are the only unknowns. Two lines with amplitudes and a phase
//! from a grid, and the frequency that suits them best, are corrected by Newton's method on a few harmonics, with soft
//! contact that is then stiffened, then on more harmonics. The cycle of the whole model that belongs to them is the
//! start for collocation. No transient is computed, and unstable cycles are found as well as stable ones.
//!
//! | step | file |
//! |---|---|
//! | 1. which coordinates and forces are not linear; flexibility at them | `local` |
//! | 2. starts: two lines that nearly satisfy the balance with soft contact | `lines` |
//! | 3. Newton's method on the balance, the whole force, more harmonics, the whole state | `balance` |
//! | 4. collocation on the full model, until a stable cycle is found | this one |
//!
//! **Source.** Balance of harmonics at the nonlinear coordinates alone: krack2019, §4. The starts are ours.
//!
//! **Fails when** the motion has three or more strong lines, or forces depend on many coordinates.

mod balance;
mod lines;
mod local;
#[cfg(test)]
mod tests;

use super::System;
use super::growth::{polished, setting, settings};
use super::seeds::{bare, polish};
use crate::attractors::{Candidate, spectral_ratio};
use crate::diagram::{Point, Shown, Solution};
use crate::linalg::dense::MANY;
use crate::problem::equilibrium::EquilibriumProblem;
use balance::Balance;
use local::Local;

/// Number of solutions that collocation corrects.
const CORRECTED: usize = 6;

/// Cycles found, and what was tried.
pub(super) struct Bounces {
    /// Cycles with the ratio, as corrected on the full model: stable ones first.
    pub(super) cycles: Vec<Point>,
    tally: Tally,
}

/// Counts of starts and motions.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    /// Starts that nearly satisfy the balance, and those of them that Newton's method corrected.
    starts: usize,
    solved: usize,
    /// Different motions with the ratio.
    fitting: usize,
    coordinates: usize,
}

/// True if a first cycle with a ratio of frequencies is sought here instead of by simulation, which transients of many
/// lightly damped modes make too long.
pub(super) fn instead_of_samples(system: &System, parameters: &[f64]) -> bool {
    system.field.dim() >= MANY && rest(system, parameters).is_ok_and(|x| Local::of(system, parameters, x).is_ok())
}

/// Finds cycles whose two strongest lines have the ratio `p : q`, `p > q`.
///
/// # Errors
/// A sentence that says why none can be sought.
pub(super) fn bounces(
    system: &System,
    parameters: &[f64],
    (p, q): (u32, u32),
    tolerance: f64,
) -> Result<Bounces, String> {
    let whirl = system.whirl.ok_or("the model has no whirl plane")?;
    let x0 = rest(system, parameters)?;
    let local = Local::of(system, parameters, x0)?;
    let (starts, mut tally) = (lines::starts(&local, [q as usize, p as usize]), Tally::default());
    (tally.starts, tally.coordinates) = (starts.len(), local.coordinates());
    let (mut soft, mut found): (Vec<Balance>, Vec<Balance>) = Default::default();
    for start in starts {
        if system.field.ended() {
            break;
        }
        let Some(own) = start.solved(&local) else { continue };
        tally.solved += 1;
        if own.divisor() != 1 || soft.iter().any(|other| other.same(&own)) {
            continue;
        }
        soft.push(own.clone());
        let Some(own) = own.grown(&local) else { continue };
        if own.divisor() == 1 && !found.iter().any(|other| other.same(&own)) {
            found.push(own);
        }
    }
    let refined = found.iter().map(|own| own.refined(&local));
    let motions: Vec<Candidate> =
        refined.map(|own| own.motion(&local)).filter(|own| has_ratio(own, system, whirl, (p, q))).collect();
    tally.fitting = motions.len();
    let mut cycles: Vec<Point> = Vec::new();
    for motion in motions.iter().take(CORRECTED) {
        let Some(point) = polish(system, parameters, tolerance, motion) else { continue };
        let Solution::Cycle(cycle) = &point.solution else { continue };
        let known = |other: &Point| point.distance(other, system.measure()) < 30.0 * tolerance;
        if spectral_ratio(cycle, whirl) == Some((p, q)) && !cycles.iter().any(known) {
            let stable = point.unstable == 0;
            cycles.push(point);
            if stable {
                break;
            }
        }
    }
    cycles.sort_by_key(|cycle| cycle.unstable);
    Ok(Bounces { cycles, tally })
}

impl Bounces {
    /// Note on what was found.
    pub(super) fn told(&self, (p, q): (u32, u32)) -> String {
        let [first, others @ ..] = &self.cycles[..] else { return self.none((p, q)) };
        let described = |point: &Point| {
            let period = Shown(point.solution.period().unwrap_or(f64::NAN));
            let how = if point.unstable == 0 { "stable" } else { "unstable" };
            format!("{how}, of period {period}")
        };
        let more: Vec<String> = others.iter().map(described).collect();
        let also = if more.is_empty() { String::new() } else { format!("; also found: {}", more.join("; ")) };
        format!(
            "starting from a {p}:{q} cycle that is {}, found by the balance of harmonics at {} coordinates and \
             corrected on the full model{also}",
            described(first),
            self.tally.coordinates
        )
    }

    /// Reason why no cycle was found.
    pub(super) fn none(&self, (p, q): (u32, u32)) -> String {
        let Tally { starts, solved, fitting, coordinates } = self.tally;
        let what = match (starts, solved, fitting) {
            (0, ..) => "no two lines nearly satisfy it".to_string(),
            (_, 0, _) => format!("none of {starts} starts led to a motion"),
            (_, _, 0) => format!("none of the motions reached from {solved} of {starts} starts has this ratio"),
            _ => format!("none of {fitting} approximate motions could be corrected on the full model"),
        };
        format!(
            "no {p}:{q} cycle was found by the balance of harmonics at {coordinates} coordinates: {what}\nwhat to do: \
             `foldline critical-speeds --ratio {p}:{q}` gives the speed at which the linear whirls have this ratio. Bouncing begins \
             beyond it where contact stiffens: choose a speed further from it, or follow a branch from there in another \
             parameter"
        )
    }
}

fn has_ratio(motion: &Candidate, system: &System, whirl: [usize; 2], ratio: (u32, u32)) -> bool {
    let Candidate::Cycle { times, states, .. } = motion else { return false };
    let n = system.field.dim();
    let z = states.chunks_exact(n).take(times.len() - 1).map(|x| num_complex::Complex64::new(x[whirl[0]], x[whirl[1]]));
    crate::attractors::ratio_of_samples(z.collect()) == Some(ratio)
}

/// The equilibrium that Newton's method finds from the state nearest to the origin.
fn rest(system: &System, parameters: &[f64]) -> Result<Vec<f64>, String> {
    if system.field.forced() || system.field.event_count() > 0 || system.is_open() {
        return Err(
            "cycles of a ratio are sought by balance of harmonics in autonomous models without events only".into()
        );
    }
    let settings = settings(system, 1e-9, [f64::NEG_INFINITY, f64::INFINITY], 0);
    let origin = super::diagnosis::next_to_origin(system);
    let mut problem = EquilibriumProblem::new(setting(system, 0, parameters));
    let found = polished(&mut problem, &settings, &bare(parameters, Solution::Equilibrium(origin)));
    match found.map(|found| found.point.solution) {
        Ok(Solution::Equilibrium(x)) => Ok(x),
        _ => Err("Newton's method finds no equilibrium near the origin about which a motion could bounce".into()),
    }
}
