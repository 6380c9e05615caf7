//! Starts without sampling: cycles near resonances of a lightly damped linear response.
//!
//! **Idea.** With light damping, samples settle too slowly to wait for, and isolas attract few of them. But families of
//! cycles have their roots where frequencies of the linear response are in a simple ratio: two of its modes in a
//! rotating frame (n:m bouncing cycles of a rotor), a mode and the forcing in a forced field. Near such a root the
//! motion is nearly linear at any amplitude until it reaches a nonlinearity, and a few averaged equations (`averaged`)
//! locate the cycles.
//!
//! 1. along the parameter: the response, which Newton's method finds from the state closest to the origin, and its
//!    lightly damped modes;
//! 2. roots: values at which two frequencies are in a ratio of whole numbers up to [`ORDER`], smallest numbers first;
//! 3. at values on both sides of each root: starts from averaged equations, made accurate by collocation.
//!
//! **Equations.** With the frequencies ω of modes, per forcing period in a forced field:
//!
//!   (1)  l ω_i - k ω_j = 0 between two modes,  l ω_i - 2π k = 0 between a mode and the forcing
//!
//! **Bounds.** [`ROOTS`] roots, [`STEPS`] values on each side of a root, and at most four cycles to be corrected at
//! each.
//!
//! **Fails when** the root of the family lies outside the range, at a ratio of larger numbers, or on no linear
//! response, for instance because the response is itself strongly nonlinear.

use super::System;
use super::averaged::{Averaged, Mode};
use super::diagnosis::next_to_origin;
use super::direct::at_rest;
use super::growth::{polished, setting, settings};
use super::plan::ExplorePlan;
use super::seeds::{bare, polish};
use crate::contract::{Batch, Parameters};
use crate::diagram::{Point, Solution};
use crate::problem::equilibrium::EquilibriumProblem;
use crate::stability::eigenvalues;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Largest whole number in a ratio.
const ORDER: u32 = 5;
/// Largest |Re μ| / |Im μ| of a lightly damped mode: at this value an oscillation decays to about half in each turn.
const LIGHT: f64 = 0.1;
/// Number of intervals of the range in which roots are sought.
const INTERVALS: usize = 64;
/// Largest number of roots examined.
const ROOTS: usize = 24;
/// Values on each side of a root: the farthest a tenth of the range away, each 1/√10 as far as the one before.
const STEPS: i32 = 5;

/// A value of the parameter at which two frequencies are in resonance.
pub(super) struct Root {
    pub(super) value: f64,
    ratio: Ratio,
}

/// k and l of (1), and the indices of the modes, by frequency; a single mode in a forced field.
#[derive(Clone, Debug, PartialEq)]
struct Ratio {
    modes: Vec<usize>,
    k: u32,
    l: u32,
}

/// Linear response at a value of the parameter.
struct Response {
    solution: Solution,
    /// Mean of f_x along the solution.
    jacobian: Vec<f64>,
    /// Eigenvalues μ of the lightly damped modes, by frequency.
    rates: Vec<Complex64>,
}

/// Cycles found near a root at one value, and the work.
#[derive(Default)]
pub(super) struct Yield {
    pub(super) cycles: Vec<Point>,
    /// Number of solutions of the averaged equations, and number of cycles corrected.
    pub(super) averaged: usize,
    pub(super) corrected: usize,
}

pub(super) struct Resonances<'r> {
    pub(super) system: &'r System<'r>,
    pub(super) plan: &'r ExplorePlan,
    pub(super) tolerance: f64,
}

impl Root {
    /// Returns n:m, with the larger first between modes, otherwise that of the mode to the forcing.
    pub(super) fn name(&self) -> String {
        let Ratio { modes, k, l } = &self.ratio;
        if modes.len() == 2 { format!("{l}:{k}") } else { format!("{k}:{l}") }
    }

    /// Returns the values on both sides of the root, inside the range, the closest first.
    pub(super) fn values(&self, [low, high]: [f64; 2]) -> Vec<f64> {
        let shares = (0..STEPS).rev().map(|step| 0.1 * 0.1f64.powf(0.5 * f64::from(step)));
        let both = shares.flat_map(|share| [1.0, -1.0].map(|sign| self.value + sign * share * (high - low)));
        both.filter(|value| (low..=high).contains(value)).collect()
    }
}

impl Ratio {
    /// Returns all ratios between `count` modes.
    fn all(count: usize, forced: bool) -> Vec<Ratio> {
        let pairs = (1..=ORDER).flat_map(|k| (1..=ORDER).map(move |l| (k, l))).filter(|(k, l)| coprime(*k, *l));
        let mut all: Vec<Ratio> = match forced {
            true => pairs.flat_map(|(k, l)| (0..count).map(move |i| Ratio { modes: vec![i], k, l })).collect(),
            false => {
                let couples = (0..count).flat_map(|i| (i + 1..count).map(move |j| vec![i, j]));
                let pairs: Vec<(u32, u32)> = pairs.filter(|(k, l)| k < l).collect();
                couples
                    .flat_map(|modes| pairs.iter().map(move |&(k, l)| Ratio { modes: modes.clone(), k, l }))
                    .collect()
            }
        };
        all.sort_by_key(|ratio| ratio.k + ratio.l);
        all
    }

    /// Evaluates (1), relative.
    fn mismatch(&self, response: &Response) -> Option<f64> {
        let frequency = |index: usize| response.rates.get(index).map(|rate| rate.im);
        let first = f64::from(self.l) * frequency(self.modes[0])?;
        let second = f64::from(self.k) * self.modes.get(1).map_or(Some(TAU), |index| frequency(*index))?;
        Some((first - second) / (first + second))
    }
}

fn coprime(a: u32, b: u32) -> bool {
    if b == 0 { a == 1 } else { coprime(b, a % b) }
}

impl Resonances<'_> {
    /// Carries out step 2. Returns the roots, and the number of those beyond the limit.
    pub(super) fn roots(&self) -> (Vec<Root>, usize) {
        let [low, high] = self.plan.range;
        let value = |k: usize| low + (high - low) * k as f64 / INTERVALS as f64;
        let responses: Vec<Option<Response>> = (0..=INTERVALS).map(|k| self.response(value(k))).collect();
        let count = responses.iter().flatten().map(|response| response.rates.len()).max().unwrap_or(0);
        let (mut roots, mut left): (Vec<Root>, usize) = (Vec::new(), 0);
        for ratio in Ratio::all(count, self.system.field.forced()) {
            let mismatch = |k: usize| ratio.mismatch(responses[k].as_ref()?);
            for k in 1..=INTERVALS {
                let Some(pair) = mismatch(k - 1).zip(mismatch(k)) else { continue };
                if (pair.0 < 0.0) == (pair.1 < 0.0) {
                    continue;
                }
                if roots.len() == ROOTS {
                    left += 1;
                } else if let Some(value) = self.root(&ratio, [(value(k - 1), pair.0), (value(k), pair.1)]) {
                    roots.push(Root { value, ratio: ratio.clone() });
                }
            }
        }
        (roots, left)
    }

    /// Finds the root between two values with mismatches of opposite sign by false position (Illinois method). `None`
    /// if the mismatch jumps, as where the response does.
    fn root(&self, ratio: &Ratio, [mut a, mut b]: [(f64, f64); 2]) -> Option<f64> {
        const ROUNDS: usize = 20;
        const ZERO: f64 = 1e-6;
        for _ in 0..ROUNDS {
            let value = a.0 - a.1 * (b.0 - a.0) / (b.1 - a.1);
            let next = (value, ratio.mismatch(&self.response(value)?)?);
            if next.1.abs() < ZERO {
                return Some(value);
            }
            // The latest value is b.
            if (next.1 < 0.0) == (b.1 < 0.0) {
                a.1 *= 0.5
            } else {
                a = b
            }
            b = next;
        }
        None
    }

    fn parameters(&self, value: f64) -> Vec<f64> {
        let mut parameters = self.plan.parameters.clone();
        parameters[self.plan.free] = value;
        parameters
    }

    /// Carries out step 1.
    fn response(&self, value: f64) -> Option<Response> {
        const PLACES: usize = 32;
        let (system, parameters) = (self.system, self.parameters(value));
        let n = system.field.dim();
        let origin = next_to_origin(system);
        let point = if system.field.forced() {
            polish(system, &parameters, self.tolerance, &at_rest(&origin))?
        } else {
            let settings = settings(system, self.tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
            let mut problem = EquilibriumProblem::new(setting(system, self.plan.free, &parameters));
            polished(&mut problem, &settings, &bare(&parameters, Solution::Equilibrium(origin))).ok()?.point
        };
        let places = if system.field.forced() { PLACES } else { 1 };
        let mut jacobian = vec![0.0; n * n];
        for place in 0..places {
            let time = place as f64 / places as f64;
            let (state, times) =
                (state(&point.solution, time), if system.field.forced() { vec![time] } else { vec![] });
            let (mut f, mut fx) = (vec![0.0; n], vec![0.0; n * n]);
            let at = Batch {
                lanes: 1,
                states: &state,
                parameters: Parameters::Shared(&parameters),
                times: &times,
                signs: &[],
            };
            system.field.linearise(at, &[], &mut f, &mut fx, &mut []);
            jacobian.iter_mut().zip(&fx).for_each(|(mean, own)| *mean += own / places as f64);
        }
        let mut rates = eigenvalues(&jacobian, n, &system.scales);
        rates.retain(|rate| rate.im > 0.0 && rate.re.abs() <= LIGHT * rate.im);
        rates.sort_by(|a, b| a.im.total_cmp(&b.im));
        Some(Response { solution: point.solution, jacobian, rates })
    }

    /// Carries out step 3 at one value.
    pub(super) fn cycles(&self, root: &Root, value: f64) -> Yield {
        let (ratio, parameters) = (&root.ratio, self.parameters(value));
        let Some(response) = self.response(value) else { return Yield::default() };
        let forced = self.system.field.forced();
        let orders = if forced { vec![ratio.k] } else { vec![ratio.k, ratio.l] };
        let halves: Vec<f64> = self.system.ranges.iter().map(|[low, high]| 0.5 * (high - low)).collect();
        let mode = |index: &usize| Mode::of(&response.jacobian, *response.rates.get(*index)?, &halves);
        let Some(modes) = ratio.modes.iter().map(mode).collect::<Option<Vec<Mode>>>() else { return Yield::default() };
        let turns = forced.then_some(ratio.l);
        let at = |time: f64| state(&response.solution, time);
        let averaged = Averaged::new(self.system.field, &parameters, modes.iter().zip(orders).collect(), turns, &at);
        let (motions, solved) = averaged.motions();
        let cycles = motions.iter().filter_map(|motion| polish(self.system, &parameters, self.tolerance, motion));
        let moving = cycles.filter(|cycle| self.moves(cycle)).collect();
        Yield { cycles: moving, averaged: solved, corrected: motions.len() }
    }

    /// True unless Newton's method has found an equilibrium instead of a cycle.
    fn moves(&self, cycle: &Point) -> bool {
        const LEAST: f64 = 1e-3;
        let spans = cycle.ranges.iter().zip(&self.system.scales).map(|([low, high], scale)| (high - low) / scale);
        spans.fold(0.0, f64::max) > LEAST
    }
}

/// Returns the state at a time in forcing periods.
fn state(solution: &Solution, time: f64) -> Vec<f64> {
    match solution {
        Solution::Equilibrium(x) => x.clone(),
        Solution::Cycle(cycle) => cycle.state(time.rem_euclid(1.0)),
        Solution::Torus(torus) => torus.state(0.0, time.rem_euclid(1.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::{Ratio, Root};

    #[test]
    fn ratios_of_small_numbers_come_first_and_each_once() {
        let pairs = |forced| Ratio::all(2, forced).iter().map(|r| (r.k, r.l)).collect::<Vec<_>>();
        assert_eq!(pairs(false), [(1, 2), (1, 3), (1, 4), (2, 3), (1, 5), (2, 5), (3, 4), (3, 5), (4, 5)]);
        let forced = Ratio::all(1, true);
        assert_eq!(forced.len(), 19);
        assert!(forced.iter().all(|r| r.modes == [0]) && (forced[0].k, forced[0].l) == (1, 1));
    }

    #[test]
    fn values_lie_on_both_sides_of_a_root_inside_the_range() {
        let ratio = Ratio { modes: vec![0, 1], k: 1, l: 3 };
        let root = Root { value: 2.0, ratio };
        let values = root.values([1.95, 11.95]);
        let offsets: Vec<f64> = values.iter().map(|value| ((value - 2.0) * 1e4).round()).collect();
        assert_eq!(offsets, [100.0, -100.0, 316.0, -316.0, 1000.0, 3162.0, 10000.0]);
        assert_eq!(root.name(), "3:1");
    }
}
