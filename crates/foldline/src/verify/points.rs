//! Verification of single points.
//!
//! **Equations.** For eigenvalues λ of an equilibrium with Jacobian J, k = 1 … n, which together determine them:
//!
//!   (1)  Σ λᵏ = tr Jᵏ

use super::jumping;
use super::shooting::{Orbit, Shooting, Solved};
use super::{Check, Quantity, Undecided, Verified, accuracies, of_cycles};
use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::{Branch, Cycle, Ending, Kind, Point, Solution};
use crate::explore::System;
use crate::linalg::{axpy, dot, larger, lu, max_abs};
use crate::problem::Setting;
use crate::special::normal_form::Local;
use crate::special::sliding;
use num_complex::Complex64;

/// Relative distance beyond which a solution found counts as another one: along a branch, and along a curve in two
/// parameters, near which there is a surface of solutions.
pub(super) const ELSEWHERE: [f64; 2] = [0.1, 1e-3];
/// Relative rounding error of a comparison.
pub(super) const ROUNDING: f64 = 1e-11;
/// Number of Newton steps in twice the working precision: the matrix is that of the point, and each step gains several
/// digits.
const STEPS: usize = 4;
/// Number of points per step at which a trajectory is sampled for its extreme values.
const PLACES: usize = 4;
/// Number of points between two samples around a peak.
const FINER: usize = 20;
/// Number of peaks examined.
const PEAKS: usize = 3;
/// Distance from the unit circle within which a multiplier is the critical one of a bifurcation curve.
const HELD: f64 = 1e-6;
/// Number of cycles integrated at a time.
const BLOCK: usize = 16;

/// Verifies the points with the given indices.
pub(super) fn verify(
    system: &System,
    setting: &Setting,
    branch: &Branch,
    chosen: &[usize],
    tolerance: f64,
) -> Verified {
    let mut out = Verified::default();
    let points: Vec<&Point> = chosen.iter().map(|i| &branch.points[*i]).collect();
    let part = Part { system, setting, branch };
    if of_cycles(branch) {
        points.chunks(BLOCK).for_each(|block| part.cycles(block, accuracies(tolerance), &mut out));
    } else {
        points.iter().for_each(|point| part.equilibrium(point, &mut out));
    }
    out
}

pub(super) struct Part<'a> {
    pub(super) system: &'a System<'a>,
    pub(super) setting: &'a Setting<'a>,
    pub(super) branch: &'a Branch,
}

impl Part<'_> {
    pub(super) fn check(&self, point: &Point, quantity: Quantity, stated: Option<f64>, found: f64) -> Check {
        let parameter = point.parameters.get(self.branch.free).copied().unwrap_or(f64::NAN);
        let (branch, position) = (self.branch.name.clone(), point.position);
        Check { branch, position, special: None, parameter, quantity, stated, found }
    }

    /// True if the points are solutions in several free parameters.
    pub(super) fn in_several_parameters(&self) -> bool {
        self.branch.held.is_some() || !self.branch.also.is_empty()
    }

    pub(super) fn undecided(&self, point: &Point, why: &'static str) -> Undecided {
        Undecided { branch: self.branch.name.clone(), position: point.position, special: None, why }
    }

    fn cycles(&self, points: &[&Point], [accuracy, coarser]: [f64; 2], out: &mut Verified) {
        let [shooting, coarse] =
            [accuracy, coarser].map(|accuracy| Shooting { setting: self.setting, accuracy, ignored: None });
        let (mut own, mut orbits) = (Vec::new(), Vec::new());
        for point in points {
            if self.joins(point) {
                out.undecided.push(self.undecided(point, "two branches meet there, and shooting is singular"));
                continue;
            }
            if jumps(self.setting.field, point) {
                jumping::verify(self, point, [accuracy, coarser], out);
                continue;
            }
            match Orbit::of(self.setting, point) {
                Some(orbit) => {
                    own.push(*point);
                    orbits.push(orbit);
                }
                None => out.undecided.push(self.undecided(point, "its profile was not stored")),
            }
        }
        let roughly = coarse.solve(&orbits, &[]);
        let nearly: Vec<Orbit> =
            roughly.iter().zip(&orbits).map(|(r, own)| r.as_ref().map_or(own, |r| &r.orbit).clone()).collect();
        let mut solved = shooting.solve(&nearly, &[]);
        solved.iter_mut().zip(&roughly).filter(|(_, r)| r.is_none()).for_each(|(s, _)| *s = None);
        let kept: Vec<&Solved> = solved.iter().flatten().collect();
        let mut seen = Seen::new(self.setting.field.dim(), kept.len());
        let again: Vec<&Orbit> = kept.iter().map(|solved| &solved.orbit).collect();
        shooting.flows(&again, &mut |index, step| {
            // The state comes first, followed by its derivatives, which are not needed.
            let mut x = vec![0.0; seen.n];
            for k in 0..PLACES {
                let theta = k as f64 / PLACES as f64;
                step.state_into(theta, &mut x);
                seen.push(index, step.trajectory(), step.time_at(theta), &x);
            }
        });
        let mut paths = kept.iter().enumerate().map(|(index, solved)| seen.path(index, &solved.orbit));
        for (((point, orbit), solved), rough) in own.into_iter().zip(&orbits).zip(&solved).zip(&roughly) {
            let (Some(solved), Some(rough)) = (solved, rough) else {
                out.undecided.push(self.undecided(point, "shooting did not converge"));
                continue;
            };
            let (Some(path), Solution::Cycle(cycle)) = (paths.next(), &point.solution) else { continue };
            let off = shooting.between(orbit, &solved.orbit);
            if max_abs(&off) > ELSEWHERE[usize::from(self.in_several_parameters())] {
                out.undecided.push(self.undecided(point, "shooting converged to another solution"));
                continue;
            }
            out.points += 1;
            let noise = ROUNDING + max_abs(&shooting.between(&rough.orbit, &solved.orbit));
            let stated = point.trust.discretisation + point.trust.residual + noise;
            out.checks.push(self.check(point, Quantity::Profile, Some(stated), path.off(cycle, &orbit.scales)));
            out.checks.push(self.check(point, Quantity::Period, Some(stated), off[orbit.nodes.len()].abs()));
            let along = Along {
                field: self.setting.field,
                parameters: &self.setting.at(&solved.orbit.free),
                orbit: &solved.orbit,
            };
            let ranges = path.ranges(along);
            let passed_on = path.passed_on(along, stated);
            let (stated, off) = self.range_difference(point, &ranges, stated, &passed_on);
            out.checks.push(self.check(point, Quantity::Range, Some(stated), off));
            self.multipliers(point, solved, rough, out);
        }
    }

    /// Stated error and actual difference of the range, relative to its size, of the state or output for which their
    /// ratio is worst. Outputs are also allowed the effect of the error of the states.
    pub(super) fn range_difference(
        &self,
        point: &Point,
        ranges: &[[f64; 2]],
        stated: f64,
        passed_on: &[f64],
    ) -> (f64, f64) {
        let n = self.system.scales.len();
        // An angle that turns takes all values.
        let turns = |c: usize| point.solution.gain().get(c).is_some_and(|gain| *gain != 0.0);
        let pairs = point.ranges.iter().zip(ranges).enumerate().filter(|(c, _)| !turns(*c));
        let each = pairs.map(|(c, (a, b))| {
            let size = a[0].abs().max(a[1].abs()).max(f64::MIN_POSITIVE);
            let scale = self.system.scales.get(c).copied().unwrap_or(0.0) + size;
            let own = if c < n { 0.0 } else { passed_on[c - n] / scale };
            (stated + own, (a[0] - b[0]).abs().max((a[1] - b[1]).abs()) / scale)
        });
        each.max_by(|a, b| (a.1 / a.0).total_cmp(&(b.1 / b.0))).unwrap_or((stated, 0.0))
    }

    pub(super) fn multipliers(&self, point: &Point, solved: &Solved, rough: &Solved, out: &mut Verified) {
        let [found, other] = [solved, rough].map(|solved| solved.flow.free_multipliers(&solved.orbit));
        let found = &found[..];
        let noise = matched(found, &other).iter().fold(ROUNDING, |m, (a, b)| larger(m, (a - b).norm()));
        let pairs = matched(point.free_spectrum(), found);

        let apart = pairs.iter().fold(0.0, |m, (a, b)| larger(m, (a - b).norm() / a.norm().max(1.0)));
        let stated = Some(point.trust.spectrum + noise).filter(|stated| stated.is_finite());
        out.checks.push(self.check(point, Quantity::Spectrum, stated, apart));
        // The critical multiplier of a bifurcation curve is on neither side of the unit circle.
        let aside = if self.in_several_parameters() { HELD } else { 0.0 };
        let wrong =
            pairs.iter().filter(|(a, b)| (a.norm() > 1.0) != (b.norm() > 1.0) && (b.norm() - 1.0).abs() >= aside);
        let side = wrong.fold(0.0, |m, (_, b)| larger(m, (b.norm() - 1.0).abs()));
        out.checks.push(self.check(point, Quantity::Stability, Some(noise), side));
    }

    /// True if the branch ends at this point on another one: branches of doubled cycles and of tori have a point there.
    pub(super) fn joins(&self, point: &Point) -> bool {
        let ends = [self.branch.points.first(), self.branch.points.last()];
        ends.iter().zip(&self.branch.ends).any(|(end, why)| {
            end.is_some_and(|end| end.position == point.position)
                && matches!(why, Some(Ending::Joined { at: Kind::PeriodDoubling | Kind::Torus, .. }))
        })
    }

    /// Distance of the solution, by Newton's method in twice the working precision with the matrix of the stored point:
    /// `step` returns the relative changes of state and free parameters for a residual. `None` if the field cannot be
    /// evaluated in that precision.
    fn precisely(
        &self,
        point: &Point,
        x: &[f64],
        [scales, sizes]: [&[f64]; 2],
        step: &dyn Fn(Vec<f64>) -> Vec<f64>,
    ) -> Option<f64> {
        let n = x.len();
        let mut states: Vec<[f64; 2]> = x.iter().map(|x| [*x, 0.0]).collect();
        let mut parameters: Vec<[f64; 2]> = point.parameters.iter().map(|p| [*p, 0.0]).collect();
        let mut whole = vec![0.0; n + self.setting.freedom()];
        for _ in 0..STEPS {
            let f = self.setting.field.evaluate_precisely(&states, &parameters)?;
            let update = step(f.iter().map(|[high, low]| high + low).collect());
            for (i, (state, scale)) in states.iter_mut().zip(scales).enumerate() {
                state[1] -= update[i] * scale;
            }
            for ((axis, change), size) in self.setting.axes.iter().zip(&update[n..]).zip(sizes) {
                let followers = axis.ties.iter().map(|tie| (tie.index, tie.slope));
                for (index, slope) in std::iter::once((axis.index, 1.0)).chain(followers) {
                    if let Some(own) = parameters.get_mut(index) {
                        own[1] -= slope * change * axis.scale * size;
                    }
                }
            }
            whole.iter_mut().zip(&update).for_each(|(sum, change)| *sum += change);
        }
        Some(max_abs(&whole))
    }

    /// Rate of change of f with the states or, where that vanishes, of this rate over the scales along the null vector
    /// q.
    fn rate(&self, batch: Batch, fx: &[f64], q: &[f64]) -> f64 {
        let (n, scales) = (q.len(), self.setting.scales);
        let size = q.iter().zip(scales).fold(f64::MIN_POSITIVE, |most, (q, s)| most.max((q / s).abs()));
        let along: Vec<f64> = q.iter().map(|q| q / size).chain(vec![0.0; self.setting.parameters.len()]).collect();
        let freedom = self.setting.freedom();
        let by_axes = (0..freedom).map(|a| {
            let unit: Vec<f64> = (0..freedom).map(|k| f64::from(u8::from(k == a))).collect();
            [vec![0.0; n], self.setting.spread(&unit)].concat()
        });
        by_axes.chain([along.clone()]).fold(max_abs(fx), |most, change| {
            let mut out = vec![0.0; n];
            self.setting.field.directional(batch, &[&along, &change], &mut out);
            out.iter().zip(scales).fold(most, |most, (f, s)| larger(most, (f / s).abs()))
        })
    }

    fn equilibrium(&self, point: &Point, out: &mut Verified) {
        let Solution::Equilibrium(x) = &point.solution else { return };
        let (n, k) = (x.len(), self.setting.freedom());
        let (mut f, mut fx, mut fp) = (vec![0.0; n], vec![0.0; n * n], vec![0.0; n * k]);
        let batch =
            Batch { lanes: 1, states: x, parameters: Parameters::Shared(&point.parameters), times: &[], signs: &[] };
        self.setting.linearise(batch, &mut f, &mut fx, &mut fp);
        out.points += 1;
        let scales: Vec<f64> = x.iter().zip(self.setting.scales).map(|(x, s)| x.abs() + s).collect();
        // Sizes of the unknowns λ: relative to 1 + |λ|.
        let sizes: Vec<f64> = self.setting.unknowns_of(point).iter().map(|own| 1.0 + own.abs()).collect();
        let held = self.branch.held.map(|(kind, _)| kind);
        let null = match held {
            Some(Kind::Fold | Kind::BranchPoint) => {
                Local::new(self.setting.field, point).and_then(|local| local.null_vectors())
            }
            _ => None,
        };
        // With a single state the Jacobian vanishes entirely.
        let rate = null.as_ref().map_or(0.0, |[q, _]| self.rate(batch, &fx, q));
        // Along curves of branch points only the part of the residual in the range of the Jacobian can be corrected.
        let beyond = null.filter(|_| held == Some(Kind::BranchPoint));
        // Minimum-norm step to a solution in state and parameters.
        let mut line: Vec<f64> = Vec::with_capacity(n * (n + k));
        for i in 0..n {
            line.extend((0..n).map(|j| fx[i * n + j] * scales[j]));
            line.extend(fp[i * k..(i + 1) * k].iter().zip(&sizes).map(|(slope, size)| slope * size));
            line.extend(beyond.iter().map(|[_, p]| rate * p[i]));
        }
        let width = n + k + usize::from(beyond.is_some());
        let mut gram: Vec<f64> = (0..n * n)
            .map(|at| dot(&line[at / n * width..(at / n + 1) * width], &line[at % n * width..(at % n + 1) * width]))
            .collect();
        let mut pivots = vec![0; n];
        if lu::factorise(&mut gram, n, &mut pivots).is_err() {
            out.undecided.push(self.undecided(point, "the Jacobian is singular there"));
            return;
        }
        let step = |mut f: Vec<f64>| {
            lu::solve(&gram, n, &pivots, &mut f, 1);
            let mut update = vec![0.0; width];
            f.iter().enumerate().for_each(|(i, y)| axpy(*y, &line[i * width..(i + 1) * width], &mut update));
            update.truncate(n + k);
            update
        };
        // Near other branches or a crossing, rounding of f moves a solution by more than its own last digit.
        let moved = |i: usize| {
            let size: f64 = (0..n).map(|j| (fx[i * n + j] * scales[j]).abs()).sum();
            max_abs(&step((0..n).map(|other| if other == i { f64::EPSILON * size } else { 0.0 }).collect()))
        };
        // The parameter is rounded once more when its unknown is multiplied by its scale.
        let moved = (0..n).map(moved).fold(f64::EPSILON, larger) + 0.5 * f64::EPSILON;
        let (off, rounding) = match self.precisely(point, x, [&scales, &sizes], &step) {
            Some(off) => (off, moved),
            None => (max_abs(&step(f)), moved.max(ROUNDING)),
        };
        out.checks.push(self.check(point, Quantity::Profile, Some(point.trust.residual + rounding), off));
        let (mut power, mut worst) = (fx.clone(), 0.0);
        for exponent in 1..=n as i32 {
            let trace: f64 = (0..n).map(|i| power[i * n + i]).sum();
            let sum: Complex64 = point.spectrum.iter().map(|z| z.powi(exponent)).sum();
            let size: f64 = point.spectrum.iter().map(|z| z.norm().powi(exponent)).sum();
            let entries: f64 = power.iter().fold(0.0, |m, x| larger(m, x.abs()));
            worst =
                larger(worst, (sum - trace).norm() / size.max(entries).max(rate.powi(exponent)).max(f64::MIN_POSITIVE));
            let old = power.clone();
            for (at, x) in power.iter_mut().enumerate() {
                *x = (0..n).map(|j| old[at / n * n + j] * fx[j * n + at % n]).sum();
            }
        }
        out.checks.push(self.check(point, Quantity::Spectrum, Some(ROUNDING), worst));
        // (Real parts that are rounding may count or not.)
        let above = |limit: f64| point.spectrum.iter().filter(|z| z.re > limit).count();
        let largest = point.spectrum.iter().map(|z| z.norm()).fold(0.0, f64::max);
        let possible = above(ROUNDING * largest)..=above(-ROUNDING * largest);
        let least = point.spectrum.iter().map(|z| z.re.abs()).fold(f64::INFINITY, f64::min);
        let side = if possible.contains(&point.unstable) { 0.0 } else { least };
        out.checks.push(self.check(point, Quantity::Stability, Some(0.0), side));
    }
}

/// True if f or the state jumps along a cycle.
pub(super) fn jumps(field: &dyn VectorField, point: &Point) -> bool {
    let Solution::Cycle(cycle) = &point.solution else { return false };
    // Whether a stored cycle of a model with events has some is to be found out.
    field.event_count() > 0 || sliding::meets_jump(field, &point.parameters, cycle)
}

/// Pairs each of `a` with one of `b`, always taking the closest remaining pair, relative to its size.
fn matched(a: &[Complex64], b: &[Complex64]) -> Vec<(Complex64, Complex64)> {
    let mut rest: Vec<Complex64> = b.to_vec();
    let mut out: Vec<Option<Complex64>> = vec![None; a.len()];
    for _ in 0..a.len().min(b.len()) {
        let apart = |i: usize, j: usize| (a[i] - rest[j]).norm() / a[i].norm().max(1.0);
        let all = (0..a.len()).filter(|i| out[*i].is_none()).flat_map(|i| (0..rest.len()).map(move |j| (i, j)));
        let Some((i, j)) = all.min_by(|p, q| apart(p.0, p.1).total_cmp(&apart(q.0, q.1))) else { break };
        out[i] = Some(rest.swap_remove(j));
    }
    a.iter().zip(out).map(|(a, b)| (*a, b.unwrap_or(Complex64::new(f64::NAN, 0.0)))).collect()
}

/// States along cycles, collected during integration.
struct Seen {
    n: usize,
    /// Samples of each cycle: segment, time within it, state.
    samples: Vec<Vec<(usize, f64, Vec<f64>)>>,
}

impl Seen {
    fn new(n: usize, count: usize) -> Seen {
        Seen { n, samples: vec![Vec::new(); count] }
    }

    fn push(&mut self, cycle: usize, segment: usize, time: f64, x: &[f64]) {
        self.samples[cycle].push((segment, time, x.to_vec()));
    }

    /// Path of a cycle over one period.
    fn path(&self, cycle: usize, orbit: &Orbit) -> Path {
        let mut samples: Vec<&(usize, f64, Vec<f64>)> = self.samples[cycle].iter().collect();
        samples.sort_by(|a, b| (a.0, a.1).partial_cmp(&(b.0, b.1)).unwrap_or(std::cmp::Ordering::Equal));
        let first = samples.first().map_or(0, |s| s.0);
        let mut begins = vec![0.0];
        orbit.shares.iter().for_each(|share| begins.push(begins[begins.len() - 1] + share));
        Path {
            times: samples.iter().map(|(s, t, _)| begins[s - first] + t * orbit.shares[s - first]).collect(),
            states: (0..self.n).flat_map(|c| samples.iter().map(move |s| s.2[c])).collect(),
        }
    }
}

/// Integrated cycle.
pub(super) struct Path {
    /// Normalised, starting at 0.
    pub(super) times: Vec<f64>,
    /// `[n × times]`.
    pub(super) states: Vec<f64>,
}

/// Flow to which a path belongs.
#[derive(Clone, Copy)]
pub(super) struct Along<'a> {
    pub(super) field: &'a dyn VectorField,
    pub(super) parameters: &'a [f64],
    pub(super) orbit: &'a Orbit,
}

impl Along<'_> {
    /// Converts normalised times to those of the field.
    fn times(&self, times: &[f64]) -> Vec<f64> {
        times.iter().take(if self.orbit.forced { usize::MAX } else { 0 }).map(|t| t * self.orbit.period).collect()
    }

    /// Outputs `[output × times]` at states `[n × times]`.
    fn outputs(&self, states: &[f64], times: &[f64]) -> Vec<f64> {
        let mut outputs = vec![0.0; self.field.output_count() * times.len()];
        let (parameters, lanes) = (Parameters::Shared(self.parameters), times.len());
        self.field.outputs(Batch { lanes, states, parameters, times: &self.times(times), signs: &[] }, &mut outputs);
        outputs
    }
}

impl Path {
    /// Largest change of each output if all states change by `error`, relative to their scales.
    pub(super) fn passed_on(&self, along: Along, error: f64) -> Vec<f64> {
        let (lanes, outputs) = (self.times.len(), along.outputs(&self.states, &self.times));
        let mut total = vec![0.0; outputs.len()];
        for (c, scale) in along.orbit.scales.iter().enumerate() {
            let mut moved = self.states.clone();
            moved[c * lanes..(c + 1) * lanes].iter_mut().for_each(|x| *x += error * scale);
            let there = along.outputs(&moved, &self.times);
            total.iter_mut().zip(there.iter().zip(&outputs)).for_each(|(sum, (a, b))| *sum += (a - b).abs());
        }
        total.chunks_exact(lanes).map(max_abs).collect()
    }

    /// Largest distance of a profile from the path, relative to `scales`.
    fn off(&self, cycle: &Cycle, scales: &[f64]) -> f64 {
        let (scheme, count) = (cycle.scheme(), self.times.len());
        let mut x = vec![0.0; scales.len()];
        let mut most = 0.0;
        for (k, t) in self.times.iter().enumerate() {
            cycle.state_into(scheme, *t, &mut x);
            let apart = |c: usize| (x[c] - self.states[c * count + k]).abs() / scales[c];
            most = (0..x.len()).fold(most, |m, c| larger(m, apart(c)));
        }
        most
    }

    /// Smallest and largest values of states and outputs over the cycle.
    fn ranges(&self, along: Along) -> Vec<[f64; 2]> {
        let (n, lanes, parameters) = (along.field.dim(), self.times.len(), Parameters::Shared(along.parameters));
        let at = |states: &[f64], times: &[f64]| [states.to_vec(), along.outputs(states, times)].concat();
        let (mut slopes, times) = (vec![0.0; n * lanes], along.times(&self.times));
        along.field.evaluate(Batch { lanes, states: &self.states, parameters, times: &times, signs: &[] }, &mut slopes);
        slopes.iter_mut().for_each(|f| *f *= along.orbit.period);
        let largest = |c: usize, line: &[f64], sign: f64| {
            let tops = peaks(line, sign).into_iter().map(|place| {
                let (times, fine) = self.between(&slopes, place);
                let count = times.len();
                top(&at(&fine, &times)[c * count..(c + 1) * count], sign)
            });
            tops.fold(f64::NEG_INFINITY, f64::max)
        };
        let values = at(&self.states, &self.times);
        values
            .chunks_exact(lanes)
            .enumerate()
            .map(|(c, line)| [-largest(c, line, -1.0), largest(c, line, 1.0)])
            .collect()
    }

    /// Times and states `[n × times]` at equidistant points between the neighbours of a sample, on the cubics with the
    /// given slopes.
    fn between(&self, slopes: &[f64], place: usize) -> (Vec<f64>, Vec<f64>) {
        let lanes = self.times.len();
        let intervals = [(place + lanes - 1) % lanes, place];
        let hermite = |c: usize, from: usize, s: f64| {
            let to = (from + 1) % lanes;
            let h = (self.times[to] - self.times[from]).rem_euclid(1.0);
            let [x, y] = [from, to].map(|k| self.states[c * lanes + k]);
            let [p, q] = [from, to].map(|k| h * slopes[c * lanes + k]);
            let d = y - x;
            x + s * (p + s * ((3.0 * d - 2.0 * p - q) + s * (p + q - 2.0 * d)))
        };
        let places = || intervals.iter().flat_map(|from| (0..FINER).map(move |k| (*from, k as f64 / FINER as f64)));
        let time = |(from, s): (usize, f64)| {
            self.times[from] + s * (self.times[(from + 1) % lanes] - self.times[from]).rem_euclid(1.0)
        };
        let states = (0..self.states.len() / lanes)
            .flat_map(|c| places().map(move |(from, s)| (c, from, s)))
            .map(|(c, from, s)| hermite(c, from, s));
        (places().map(time).collect(), states.collect())
    }
}

/// The few highest samples at which `sign` times a periodic function has a peak.
fn peaks(values: &[f64], sign: f64) -> Vec<usize> {
    let count = values.len();
    let value = |k: usize| sign * values[k % count];
    let mut places: Vec<usize> =
        (0..count).filter(|&k| value(k) >= value(k + count - 1) && value(k) >= value(k + 1)).collect();
    places.sort_by(|a, b| value(*b).total_cmp(&value(*a)));
    places.truncate(PEAKS);
    places
}

/// Largest value of `sign` times an equidistantly sampled function: at the top of the parabola through three samples.
fn top(values: &[f64], sign: f64) -> f64 {
    let largest = values.iter().fold(f64::NEG_INFINITY, |m, v| m.max(sign * v));
    let tops = values.windows(3).map(|three| {
        let [a, b, c] = [sign * three[0], sign * three[1], sign * three[2]];
        let bend = a - 2.0 * b + c;
        if b >= a && b >= c && bend < 0.0 { b - 0.125 * (c - a) * (c - a) / bend } else { f64::NEG_INFINITY }
    });
    tops.fold(largest, f64::max)
}
