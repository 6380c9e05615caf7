//! A long trajectory from a point of a torus.
//!
//! **Idea.** The trajectory is observed once per period and must stay on the closed curve. The weighted average of its turns from
//! observation to observation is the rotation number: the quotient of two whole numbers if the motion is locked. The growth
//! of perturbations along it gives the exponents.
//!
//! **Equations.** For observations x_j with phases φ_j:
//!
//! ```text
//!   (1)  φ_j = argmin |x_j - X(φ)|
//!   (2)  ρ = Σ_j w_j (φ_{j+1} - φ_j)
//! ```
//!
//! **Source.** das2017 (2); benettin1980 (exponents).
//!
//! **Fails when** the torus does not attract: errors grow until the trajectory leaves it.

use super::super::shooting::STEPS;
use super::super::variational::Variational;
use super::exponents::{Along, Frame, averaged};
use super::ring::{Rings, Solved};
use crate::contract::{Batch, Parameters};
use crate::diagram::Torus;
use crate::linalg::{dot, larger};
use crate::problem::Setting;
use crate::problem::torus::phases;
use crate::simulation::{Ensemble, Outcome, Tolerance};

/// Number of observations.
const PERIODS: usize = 1000;
/// Periods over which the directions settle, within them.
const SETTLING: usize = 200;

/// Rotation number, distance and exponents that a trajectory shows.
pub(super) struct Seen {
    /// ρ, and the error of the average.
    pub(super) rotation: [f64; 2],
    /// Largest distance from the stored curve, relative to the scales.
    pub(super) distance: f64,
    /// Logarithms of the moduli of the non-trivial multipliers, the largest first, and their error.
    pub(super) exponents: Vec<f64>,
    pub(super) exponent_error: f64,
}

/// Follows trajectories from the first phase of each solution; `None` where one does not arrive, or its distance from the
/// curve is so large that it has no phase.
pub(super) fn follow(rings: &Rings, all: &[(&Solved, &Torus)]) -> Vec<Option<Seen>> {
    let plain = Setting { axes: Vec::new(), ..rings.setting.clone() };
    let (field, n) = (Variational { setting: &plain }, plain.field.dim());
    let second = plain.field.second_phase().is_some();
    let tolerance = Tolerance { relative: rings.accuracy, absolute: field.absolute(rings.accuracy) };
    let mut open: Vec<Option<Run>> = all.iter().map(|(solved, _)| Some(Run::new(rings, solved, second))).collect();
    for period in 0..PERIODS {
        let (mut starts, mut parameters, mut owners) = (Vec::new(), Vec::new(), Vec::new());
        for (index, run) in open.iter().enumerate() {
            let (Some(run), (solved, _)) = (run, all[index]) else { continue };
            let scales = &solved.ring.scales;
            starts.extend_from_slice(&run.state);
            // Columns of the frame become those of the matrix, which is row-major.
            starts.extend((0..n * n).map(|at| run.frame.columns[(at % n) * n + at / n] * scales[at / n]));
            starts.extend(solved.ring.forced.then_some(period as f64 * solved.ring.period));
            parameters.extend_from_slice(&run.parameters);
            parameters.push(solved.ring.period);
            owners.push(index);
        }
        if owners.is_empty() {
            break;
        }
        let ensemble = Ensemble::with_own_parameters(&field, &parameters, tolerance.clone(), &starts, [0.0, 1.0]);
        for (arrival, owner) in ensemble.with_step_limit(STEPS).arrive().iter().zip(owners) {
            let Some(run) = open[owner].as_mut().filter(|_| arrival.outcome == Outcome::Reached) else {
                open[owner] = None;
                continue;
            };
            let scales = &all[owner].0.ring.scales;
            let (x, rest) = arrival.state.split_at(n);
            run.state = x.to_vec();
            run.seen.extend_from_slice(x);
            let columns = (0..n * n).map(|at| rest[(at % n) * n + at / n] / scales[at % n]).collect();
            run.frame.carried(columns, &[]);
        }
    }
    open.into_iter().zip(all).map(|(run, (solved, torus))| run?.summary(rings, solved, torus, second)).collect()
}

/// A trajectory in progress.
struct Run {
    state: Vec<f64>,
    parameters: Vec<f64>,
    frame: Frame,
    trivial: usize,
    /// `[periods + 1][n]`.
    seen: Vec<f64>,
}

impl Run {
    fn new(rings: &Rings, solved: &Solved, second: bool) -> Run {
        let (ring, n) = (&solved.ring, solved.ring.dim());
        let along = Along::of(ring, &solved.carried, second);
        let state = ring.states[..n].to_vec();
        Run {
            frame: Frame::new(&along.at(0.0), n),
            trivial: along.count(),
            parameters: rings.parameters(ring, 0.0),
            seen: state.clone(),
            state,
        }
    }

    fn summary(&self, rings: &Rings, solved: &Solved, torus: &Torus, second: bool) -> Option<Seen> {
        let ring = &solved.ring;
        let n = ring.dim();
        let section = torus.section(0.0);
        let [_, rate] = phases::shift(torus.phases(), 0.0);
        let mut slope = vec![0.0; section.len()];
        phases::shifted(&rate, &section, n, &mut slope);
        let scaled = |v: Vec<f64>| -> Vec<f64> { v.iter().zip(&ring.scales).map(|(x, s)| x / s).collect() };
        let (mut turns, mut before, mut distance) = (Vec::new(), 0.0, 0.0);
        for (j, x) in self.seen.chunks_exact(n).enumerate() {
            let mut phase = if j == 0 { 0.0 } else { before + torus.rotation };
            let mut off = vec![0.0; n];
            // Gauss–Newton; without forcing also along the flow, whose phase drifts.
            let mut late = 0.0;
            for _ in 0..ITERATIONS {
                let there = phases::between(&section, n, phase);
                off = scaled(x.iter().zip(&there).map(|(a, b)| a - b).collect());
                let around = scaled(phases::between(&slope, n, phase));
                if ring.forced {
                    // The phase of a second forcing is known.
                    if second {
                        break;
                    }
                    let change = dot(&off, &around) / dot(&around, &around);
                    phase += change;
                    if change.abs() < SMALL {
                        break;
                    }
                    continue;
                }
                let flow = scaled(flow(rings, solved, &there));
                off.iter_mut().zip(&flow).for_each(|(d, f)| *d -= late * f);
                let [aa, ab, bb] = [dot(&around, &around), dot(&around, &flow), dot(&flow, &flow)];
                let [a, b] = [dot(&off, &around), dot(&off, &flow)];
                let det = aa * bb - ab * ab;
                let change = [(a * bb - b * ab) / det, (b * aa - a * ab) / det];
                phase += change[0];
                late += change[1];
                if change[0].abs() < SMALL && change[1].abs() < SMALL * ring.period {
                    break;
                }
            }
            let own = off.iter().fold(0.0, |most: f64, d| larger(most, d.abs()));
            distance = larger(distance, own);
            if j > 0 {
                turns.push(phase - before);
            }
            before = phase;
        }
        if !distance.is_finite() {
            return None;
        }
        let (exponents, exponent_error) = self.frame.exponents(self.trivial, SETTLING);
        Some(Seen { rotation: averaged(&turns), distance, exponents, exponent_error })
    }
}

/// Steps of Gauss–Newton at most, and the change of the phase at which it ends.
const ITERATIONS: usize = 20;
const SMALL: f64 = 1e-13;

/// f of an autonomous field at a state.
fn flow(rings: &Rings, solved: &Solved, x: &[f64]) -> Vec<f64> {
    let mut f = vec![0.0; x.len()];
    let parameters = rings.parameters(&solved.ring, 0.0);
    let at = Batch { lanes: 1, states: x, parameters: Parameters::Shared(&parameters), times: &[], signs: &[] };
    rings.setting.field.evaluate(at, &mut f);
    f
}
