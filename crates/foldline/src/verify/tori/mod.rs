//! Verification of tori.
//!
//! **Idea.** Two routes that share only the vector field with collocation. The closed curve in the section t = 0 is recomputed with
//! trajectories integrated over the period, at phases half as many again (`ring`); that works for unstable tori too. From a point of a torus
//! that attracts, a trajectory is followed for a thousand periods (`trajectory`).
//!
//! | topic | file |
//! |---|---|
//! | nearest torus by integration over a period | `ring` |
//! | exponents by carried perturbations | `exponents` |
//! | long trajectories | `trajectory` |
//!
//! **Fails when** the integration is not accurate enough, or the torus is so rough that the larger number of phases does not
//! resolve it; the difference between the numbers of phases counts as error of the comparison.

mod exponents;
mod ring;
mod trajectory;

use super::points::{ELSEWHERE, Part, ROUNDING};
use super::{Quantity, Verified, accuracies};
use crate::contract::{Batch, Parameters};
use crate::diagram::{Branch, Point, Solution, Torus};
use crate::explore::System;
use crate::linalg::{larger, max_abs};
use crate::problem::Setting;
use crate::problem::torus::{phases, summit};
use num_complex::Complex64;
use ring::{Ring, Rings, Solved};

/// Number of tori whose trajectories are followed together.
const BLOCK: usize = 16;
/// Number of instants per period at which trajectories are kept for the ranges: cubics between them are accurate to 1e-9
/// for motions with ten oscillations per period.
const INSTANTS: usize = 1024;

/// Verifies the points of a branch of tori with the given indices.
pub(super) fn verify(
    system: &System,
    setting: &Setting,
    branch: &Branch,
    chosen: &[usize],
    tolerance: f64,
) -> Verified {
    let mut out = Verified::default();
    let part = Part { system, setting, branch };
    let points: Vec<&Point> = chosen.iter().map(|i| &branch.points[*i]).collect();
    let [accuracy, coarser] = accuracies(tolerance);
    let fine = Rings { setting, accuracy };
    for block in points.chunks(BLOCK) {
        let mut attracting: Vec<(&Point, &Torus, Solved, f64)> = Vec::new();
        for point in block {
            let Solution::Torus(torus) = &point.solution else { continue };
            if part.joins(point) {
                out.undecided.push(part.undecided(point, "the torus has no extent there, or two branches meet"));
                continue;
            }
            let solved = match recomputed(&part, &fine, coarser, point, &mut out) {
                Ok((solved, noise)) => Some((solved, noise)),
                Err(why) => {
                    out.undecided.push(part.undecided(point, why));
                    None
                }
            };
            let Some((solved, noise)) = solved else { continue };
            match point.unstable {
                0 => attracting.push((point, torus, solved, noise)),
                _ => out.undecided.push(part.undecided(
                    point,
                    "trajectories leave an unstable torus: recomputed over one period, not followed by simulation",
                )),
            }
        }
        let pairs: Vec<(&Solved, &Torus)> = attracting.iter().map(|(_, torus, solved, _)| (solved, *torus)).collect();
        for ((point, torus, _, noise), seen) in attracting.iter().zip(trajectory::follow(&fine, &pairs)) {
            let Some(seen) = seen else {
                out.undecided.push(part.undecided(point, "the trajectory along the torus could not be integrated"));
                continue;
            };
            let stated = point.trust.discretisation + point.trust.residual + noise;
            out.checks.push(part.check(point, Quantity::Distance, Some(stated), seen.distance));
            let [rotation, apart] = seen.rotation;
            let off = (rotation - torus.rotation).abs() / (1.0 + torus.rotation.abs());
            out.checks.push(part.check(point, Quantity::Rotation, Some(stated + apart), off));
            part.moduli(point, &seen.exponents, noise + seen.exponent_error, &mut out);
        }
    }
    out
}

/// A torus recomputed, with all comparisons over one period, and the error of the comparison.
fn recomputed(
    part: &Part,
    fine: &Rings,
    coarser: f64,
    point: &Point,
    out: &mut Verified,
) -> Result<(Solved, f64), &'static str> {
    let Solution::Torus(torus) = &point.solution else { return Err("it is not a torus") };
    let setting = fine.setting;
    let origin = Ring::of(setting, point).ok_or("its profile was not stored")?;
    let failed = "Newton's method for the closed curve did not converge";
    let rough = Rings { setting, accuracy: coarser }.solve(&origin, None).ok_or(failed)?;
    let solved = fine.solve(&rough.ring, None).ok_or(failed)?;
    let off = origin.off(&solved.ring);
    if max_abs(&off) > ELSEWHERE[usize::from(part.in_several_parameters())] {
        return Err("Newton's method converged to another torus");
    }
    out.points += 1;
    let noise = ROUNDING + max_abs(&rough.ring.off(&solved.ring)) + solved.ring.tail();
    let stated = point.trust.discretisation + point.trust.residual + noise;
    let walls = Walls::of(fine, &solved, torus).ok_or("the trajectories could not be integrated")?;
    out.checks.push(part.check(point, Quantity::Profile, Some(stated), walls.off));
    if torus.forcing_periods == 0 {
        out.checks.push(part.check(point, Quantity::Period, Some(stated), off[1]));
    }
    out.checks.push(part.check(point, Quantity::Rotation, Some(stated), off[2]));
    let passed_on = walls.passed_on(stated);
    let (limit, apart) = part.range_difference(point, &walls.ranges(), stated, &passed_on);
    out.checks.push(part.check(point, Quantity::Range, Some(limit), apart));
    let second = setting.field.second_phase().is_some();
    let all = |solved: &Solved| exponents::of_ring(&solved.ring, &solved.carried, second, torus.phases());
    let ((own, error), (other, _)) = (all(&solved), all(&rough));
    let error = own.iter().zip(&other).fold(noise + error, |most, (a, b)| larger(most, (a - b).abs()));
    part.moduli(point, &own, error, out);
    Ok((solved, noise))
}

/// The non-trivial multipliers, that of largest modulus first.
fn sorted(point: &Point) -> Vec<Complex64> {
    let mut all = point.free_spectrum().to_vec();
    all.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    all
}

/// Logarithms of moduli, averaged over the conjugate pairs among stored multipliers: a pair has one modulus, and only the growth along
/// both of its directions together settles quickly.
fn paired(stored: &[Complex64], found: &[f64]) -> Vec<f64> {
    let other = |i: usize| {
        let z = stored[i];
        stored.iter().position(|other| z.im != 0.0 && (other - z.conj()).norm() < 1e-9 * z.norm())
    };
    let own = |(i, value): (usize, &f64)| 0.5 * (value + other(i).and_then(|k| found.get(k)).unwrap_or(value));
    found.iter().enumerate().take(stored.len()).map(own).collect()
}

/// Solution next to a special point: the parameter, its component of the unit tangent, and the non-trivial multipliers, with the
/// arguments of those of the special point.
pub(super) type Beside = (f64, f64, Vec<Complex64>);

/// Solutions at the given distances along the branch from a special point; `None` if one could not be computed.
///
/// # Errors
/// A sentence that says why they cannot be computed.
pub(super) fn beside(
    setting: &Setting,
    point: &Point,
    nodes: &[f64],
    accuracy: f64,
) -> Result<Option<Vec<Beside>>, &'static str> {
    let rings = Rings { setting, accuracy };
    let base = Ring::of(setting, point).ok_or("its profile was not stored")?;
    let along = rings.tangent(&base, point).ok_or("its tangent was not stored")?;
    let Solution::Torus(torus) = &point.solution else { return Err("it is not a torus") };
    let stored = sorted(point);
    let second = setting.field.second_phase().is_some();
    let each = nodes.iter().map(|distance| {
        let moved: Vec<f64> = along.iter().map(|t| distance * t).collect();
        let solved = rings.solve(&rings.moved(&base, &moved), Some(&along))?;
        let slope = *solved.kernel.first()?.last()?;
        let (found, _) = exponents::of_ring(&solved.ring, &solved.carried, second, torus.phases());
        let spectrum =
            stored.iter().zip(paired(&stored, &found)).map(|(z, own)| Complex64::from_polar(own.exp(), z.arg()));
        Some((*solved.ring.free.last()?, slope, spectrum.collect()))
    });
    Ok(each.collect())
}

impl Part<'_> {
    /// Compares the moduli of the multipliers with logarithms found.
    fn moduli(&self, point: &Point, exponents: &[f64], noise: f64, out: &mut Verified) {
        let all = sorted(point);
        let own = if all.len() == exponents.len() { paired(&all, exponents) } else { Vec::new() };
        let pairs = || all.iter().map(|z| z.norm()).zip(own.iter().map(|e| e.exp()));
        let apart = pairs().fold(0.0, |most, (a, b)| larger(most, (a - b).abs() / a.max(1.0)));
        let apart = if all.len() == own.len() { apart } else { f64::INFINITY };
        let stated = Some(point.trust.spectrum + noise).filter(|stated| stated.is_finite());
        out.checks.push(self.check(point, Quantity::Spectrum, stated, apart));
        let wrong = pairs().filter(|(a, b)| (*a > 1.0) != (*b > 1.0));
        let side = wrong.fold(0.0, |most, (_, b)| larger(most, (b - 1.0).abs()));
        out.checks.push(self.check(point, Quantity::Stability, Some(noise), side));
    }
}

/// Trajectories of a torus over the period, at equidistant instants.
struct Walls<'a, 'b> {
    rings: &'a Rings<'b>,
    solved: &'a Solved,
    /// `[INSTANTS + 1][K][n]`.
    states: Vec<f64>,
    /// Largest distance of the stored torus, relative to the scales.
    off: f64,
}

impl<'a, 'b> Walls<'a, 'b> {
    fn of(rings: &'a Rings<'b>, solved: &'a Solved, torus: &Torus) -> Option<Walls<'a, 'b>> {
        let ring = &solved.ring;
        let (n, count) = (ring.dim(), ring.phases());
        let mut states = vec![0.0; (INSTANTS + 1) * count * n];
        states[..count * n].copy_from_slice(&ring.states);
        let mut off = 0.0;
        let mut x = vec![0.0; n];
        rings.carried(ring, &mut |k, step| {
            let [begin, end] = [step.start_time(), step.end_time()];
            step.end_into(&mut x);
            let there = torus.state(k as f64 / count as f64, end.min(1.0));
            let apart = x.iter().zip(&there).zip(&ring.scales).map(|((a, b), s)| (a - b).abs() / s);
            off = apart.fold(off, larger);
            let [first, last] = [begin, end].map(|t| (t * INSTANTS as f64 + 1e-9).floor() as usize);
            for j in first + 1..=last.min(INSTANTS) {
                step.state_into(((j as f64 / INSTANTS as f64 - begin) / (end - begin)).min(1.0), &mut x);
                states[(j * count + k) * n..(j * count + k + 1) * n].copy_from_slice(&x);
            }
        })?;
        Some(Walls { rings, solved, states, off })
    }

    /// States with the outputs behind them, `[channel × lanes]`, at normalised times; `states` is `[n × lanes]`.
    fn channels(&self, mut states: Vec<f64>, times: &[f64], turns: f64) -> Vec<f64> {
        let (field, ring) = (self.rings.setting.field, &self.solved.ring);
        let own: Vec<f64> = if ring.forced { times.iter().map(|t| t * ring.period).collect() } else { Vec::new() };
        let mut outputs = vec![0.0; field.output_count() * times.len()];
        let parameters = self.rings.parameters(ring, turns);
        let parameters = Parameters::Shared(&parameters);
        field.outputs(Batch { lanes: times.len(), states: &states, parameters, times: &own, signs: &[] }, &mut outputs);
        states.extend(outputs);
        states
    }

    /// All kept states, `[n × lanes]`, and their times; lanes by instant, then by phase.
    fn lanes(&self) -> (Vec<f64>, Vec<f64>) {
        let (n, count) = (self.solved.ring.dim(), self.solved.ring.phases());
        let states = (0..n).flat_map(|c| self.states.iter().skip(c).step_by(n).copied()).collect();
        let times = (0..=INSTANTS).flat_map(|j| std::iter::repeat_n(j as f64 / INSTANTS as f64, count)).collect();
        (states, times)
    }

    /// Largest change of each output if all states change by `error`, relative to their scales.
    fn passed_on(&self, error: f64) -> Vec<f64> {
        let (states, times) = self.lanes();
        let (n, lanes) = (self.solved.ring.dim(), times.len());
        let outputs = |states: Vec<f64>| self.channels(states, &times, 0.0).split_off(n * lanes);
        let plain = outputs(states.clone());
        let mut total = vec![0.0; plain.len()];
        for (c, scale) in self.solved.ring.scales.iter().enumerate() {
            let mut moved = states.clone();
            moved[c * lanes..(c + 1) * lanes].iter_mut().for_each(|x| *x += error * scale);
            let there = outputs(moved);
            total.iter_mut().zip(there.iter().zip(&plain)).for_each(|(sum, (a, b))| *sum += (a - b).abs());
        }
        total.chunks_exact(lanes).map(max_abs).collect()
    }

    /// State at a phase and a time, which may lie outside [0, 1], on cubics between the instants.
    fn state(&self, [turns, t]: [f64; 2]) -> Vec<f64> {
        let ring = &self.solved.ring;
        let (n, width, whole) = (ring.dim(), ring.states.len(), t.floor());
        let (turns, at) = (turns + whole * ring.rotation, (t - whole) * INSTANTS as f64);
        let j = (at.floor() as usize).min(INSTANTS - 1);
        let s = at - j as f64;
        let parameters = self.rings.parameters(ring, turns);
        let end = |j: usize| -> [Vec<f64>; 2] {
            let x = phases::between(&self.states[j * width..(j + 1) * width], n, turns);
            let times = [j as f64 / INSTANTS as f64 * ring.period];
            let times = if ring.forced { &times[..] } else { &[] };
            let mut f = vec![0.0; n];
            let at = Batch { lanes: 1, states: &x, parameters: Parameters::Shared(&parameters), times, signs: &[] };
            self.rings.setting.field.evaluate(at, &mut f);
            f.iter_mut().for_each(|f| *f *= ring.period / INSTANTS as f64);
            [x, f]
        };
        let ([x, p], [y, q]) = (end(j), end(j + 1));
        (0..n)
            .map(|c| {
                let d = y[c] - x[c];
                x[c] + s * (p[c] + s * ((3.0 * d - 2.0 * p[c] - q[c]) + s * (p[c] + q[c] - 2.0 * d)))
            })
            .collect()
    }

    /// Smallest and largest value of every state and output.
    fn ranges(&self) -> Vec<[f64; 2]> {
        let count = self.solved.ring.phases();
        let (states, times) = self.lanes();
        let lanes = times.len();
        let all = self.channels(states, &times, 0.0);
        let grid = [count as f64, 1.0 / INSTANTS as f64];
        let each = all.chunks_exact(lanes).enumerate().map(|(channel, line)| {
            [-1.0, 1.0].map(|sign| {
                let value =
                    |at: [f64; 2]| sign * self.channels(self.state(at), &[at[1] - at[1].floor()], at[0])[channel];
                sign * summit::largest(line, &times, sign, grid, &value)
            })
        });
        each.collect()
    }
}
