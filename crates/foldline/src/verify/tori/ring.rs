//! Tori by integration: Newton's method for the closed curve in the section t = 0.
//!
//! **Idea.** K trajectories start at equally spaced phases of the closed curve and are integrated over the period with the
//! variational equations. They must end on the curve, turned by ρ. This shares the trigonometric interpolation in the phase
//! with the stored torus, at other phases and in a larger number, and nothing in time.
//!
//! **Equations.** Φ the flow over T from phase φ_k = k / K, k = 0 … K-1; j free parameters λ:
//!
//! ```text
//!   (1)  Φ(X_k; T, λ) - Σ_l R_kl(ρ) X_l = 0
//!   (2)  Σ_k ⟨X̃'(φ_k), δX_k⟩ = 0              phase of an update δX, X̃ the initial curve
//!   (3)  Σ_k ⟨f(X_k), δX_k⟩ = 0               its phase in time, without forcing
//! ```
//!
//! T of a forced torus is prescribed, and with two forcings ρ is a function of λ, which replaces (2). The shortest update is
//! taken, towards the nearest solution.
//!
//! **Source.** schilder2005; jorba2001.

use super::super::shooting::{ARRIVED, ITERATIONS, STALLED, STEPS};
use super::super::variational::Variational;
use crate::contract::{Batch, Parameters, Verdict};
use crate::diagram::{Point, Solution, Torus};
use crate::linalg::{axpy, dot, larger, max_abs};
use crate::problem::Setting;
use crate::problem::torus::phases;
use crate::simulation::{Ensemble, Outcome, Step, Tolerance};
use foldline_general::{Factored, Mat};

/// Closed curve of a torus in the section t = 0, with its scalars.
#[derive(Clone, Debug)]
pub(super) struct Ring {
    /// `[K][n]`.
    pub(super) states: Vec<f64>,
    /// T, in the time of the field.
    pub(super) period: f64,
    /// ρ.
    pub(super) rotation: f64,
    pub(super) forced: bool,
    /// `[j]` unknowns of the free parameters.
    pub(super) free: Vec<f64>,
    /// `[n]` scales.
    pub(super) scales: Vec<f64>,
}

impl Ring {
    /// Closed curve of a stored torus, in half as many phases again; `None` if the point is no torus of this field.
    pub(super) fn of(setting: &Setting, point: &Point) -> Option<Ring> {
        let Solution::Torus(torus) = &point.solution else { return None };
        let n = setting.field.dim();
        if torus.dim() != n || torus.profile.is_empty() {
            return None;
        }
        let size = |c: usize| torus.profile.iter().skip(c).step_by(n).fold(0.0, |most, x| larger(most, x.abs()));
        Some(Ring {
            states: spread(&torus.section(0.0), torus.phases(), finer(torus), n),
            period: if torus.forcing_periods > 0 { f64::from(torus.forcing_periods) } else { torus.period },
            rotation: torus.rotation,
            forced: torus.forcing_periods > 0,
            free: setting.unknowns_of(point),
            scales: (0..n).map(|c| setting.scales[c] + size(c)).collect(),
        })
    }

    pub(super) fn dim(&self) -> usize {
        self.scales.len()
    }

    /// K.
    pub(super) fn phases(&self) -> usize {
        self.states.len() / self.dim()
    }

    /// ∂X/∂φ at the phases, `[K][n]`.
    pub(super) fn around(&self) -> Vec<f64> {
        let [_, rate] = phases::shift(self.phases(), 0.0);
        let mut out = vec![0.0; self.states.len()];
        phases::shifted(&rate, &self.states, self.dim(), &mut out);
        out
    }

    /// Largest of the last two harmonics, relative to the scales: the error by truncation in the phase.
    pub(super) fn tail(&self) -> f64 {
        let (n, last) = (self.dim(), self.phases() / 2);
        let own = (0..n).map(|c| {
            let all = crate::problem::torus::harmonics(self.states[c..].iter().step_by(n).copied());
            larger(all[last], all[last - 1]) / self.scales[c]
        });
        own.fold(0.0, larger)
    }

    /// Scales of the unknowns: states so that their norm is a root mean square, then T, ρ and λ.
    fn units(&self, second: bool) -> Vec<f64> {
        let share = (self.states.len() as f64).sqrt();
        let states = (0..self.states.len()).map(|at| self.scales[at % self.dim()] * share);
        let period = (!self.forced).then_some(self.period);
        let rotation = (!second).then_some(1.0);
        states.chain(period).chain(rotation).chain(vec![1.0; self.free.len()]).collect()
    }

    /// Ring moved by an update in the units of the unknowns of `origin`.
    fn moved(&self, origin: &Ring, update: &[f64], rotation: impl Fn(&Ring) -> Option<f64>) -> Ring {
        let second = rotation(self);
        let units = origin.units(second.is_some());
        let mut out = self.clone();
        let mut at = update.iter().zip(&units).map(|(d, unit)| d * unit);
        out.states.iter_mut().zip(&mut at).for_each(|(x, d)| *x += d);
        if !self.forced {
            out.period += at.next().unwrap_or(f64::NAN);
        }
        if second.is_none() {
            out.rotation += at.next().unwrap_or(f64::NAN);
        }
        out.free.iter_mut().zip(at).for_each(|(own, d)| *own += d);
        if let Some(turns) = rotation(&out) {
            out.rotation = turns;
        }
        out
    }

    /// Largest differences from another ring: of the states, relative to their scales; of the period, relative; of the rotation
    /// number and of the free parameters, relative to 1 + their size.
    pub(super) fn off(&self, other: &Ring) -> [f64; 4] {
        let n = self.dim();
        let states = self.states.iter().zip(&other.states).enumerate();
        let relative = |a: f64, b: f64| (a - b).abs() / (1.0 + a.abs());
        [
            states.map(|(at, (a, b))| (a - b).abs() / self.scales[at % n]).fold(0.0, larger),
            (self.period - other.period).abs() / self.period,
            relative(self.rotation, other.rotation),
            self.free.iter().zip(&other.free).map(|(a, b)| relative(*a, *b)).fold(0.0, larger),
        ]
    }
}

/// Number of phases with which a torus is recomputed: half as many again, so that its last harmonics are tested.
fn finer(torus: &Torus) -> usize {
    2 * (3 * (torus.phases() / 2)).div_ceil(2) + 1
}

/// Values `[from][n]` interpolated to another number of phases.
pub(super) fn spread(values: &[f64], from: usize, to: usize, n: usize) -> Vec<f64> {
    let mut out = vec![0.0; to * n];
    for (own, row) in out.chunks_exact_mut(n).zip(phases::passage(from, to).chunks_exact(from)) {
        for (x, weight) in values.chunks_exact(n).zip(row) {
            own.iter_mut().zip(x).for_each(|(to, x)| *to += weight * x);
        }
    }
    out
}

/// Result of integrating the trajectories of a ring.
#[derive(Clone, Debug, Default)]
pub(super) struct Carried {
    /// `[K][n]`.
    ends: Vec<f64>,
    /// `[K][n × n]` transition matrices, in scaled components.
    pub(super) transitions: Vec<f64>,
    /// `[K][n × j]`.
    by_free: Vec<f64>,
    /// `[K][n]` f at the starts and ends.
    pub(super) begins: Vec<f64>,
    finishes: Vec<f64>,
}

/// Solution of (1).
#[derive(Clone, Debug)]
pub(super) struct Solved {
    pub(super) ring: Ring,
    pub(super) carried: Carried,
    /// `[j][unknowns]` orthonormal directions of solutions, in the units of the unknowns; the last entries are λ.
    pub(super) kernel: Vec<Vec<f64>>,
}

/// Integration of rings in a setting.
pub(super) struct Rings<'a> {
    pub(super) setting: &'a Setting<'a>,
    /// Relative accuracy of the integration.
    pub(super) accuracy: f64,
}

impl Rings<'_> {
    /// ρ of a ring whose second angle is the phase of a second forcing.
    fn given(&self, ring: &Ring) -> Option<f64> {
        let field = self.setting.field;
        field.second_phase().map(|_| field.second_turns(&self.setting.at(&ring.free)).0)
    }

    /// A ring moved by an update.
    pub(super) fn moved(&self, ring: &Ring, update: &[f64]) -> Ring {
        ring.moved(ring, update, |own| self.given(own))
    }

    /// Direction of the branch, of unit length in the units of a ring, from the tangent stored with a point; `None` without
    /// one.
    pub(super) fn tangent(&self, ring: &Ring, point: &Point) -> Option<Vec<f64>> {
        let Solution::Torus(torus) = &point.solution else { return None };
        let (n, size) = (ring.dim(), torus.profile.len());
        let scalars = point.tangent.get(size..).filter(|rest| rest.len() == 2 + ring.free.len())?;
        let second = self.setting.field.second_phase().is_some();
        let first = &point.tangent[..torus.phases() * n];
        let states = spread(first, torus.phases(), ring.phases(), n);
        let period = (!ring.forced).then_some(scalars[0]);
        let rotation = (!second).then_some(scalars[1]);
        let all = states.into_iter().chain(period).chain(rotation).chain(scalars[2..].iter().copied());
        let mut along: Vec<f64> = all.zip(ring.units(second)).map(|(t, unit)| t / unit).collect();
        let norm = dot(&along, &along).sqrt();
        along.iter_mut().for_each(|t| *t /= norm);
        (norm > 0.0).then_some(along)
    }

    /// Parameters of the trajectory that starts at a phase.
    pub(super) fn parameters(&self, ring: &Ring, turns: f64) -> Vec<f64> {
        let mut values = self.setting.at(&ring.free);
        if let Some(phase) = self.setting.field.second_phase() {
            values[phase] += turns;
        }
        values
    }

    /// Integrates the trajectories over the period, or returns `None` if one does not arrive; `sample` sees every step with the index
    /// of its phase, in times from 0 to 1.
    pub(super) fn carried(&self, ring: &Ring, sample: &mut dyn FnMut(usize, &Step)) -> Option<Carried> {
        let (n, k, count) = (ring.dim(), ring.free.len(), ring.phases());
        let field = Variational { setting: self.setting };
        let (mut starts, mut parameters) = (Vec::new(), Vec::new());
        for (at, x) in ring.states.chunks_exact(n).enumerate() {
            starts.extend_from_slice(x);
            starts.extend((0..n * n).map(|at| if at % (n + 1) == 0 { 1.0 } else { 0.0 }));
            starts.extend(std::iter::repeat_n(0.0, n * k));
            starts.extend(ring.forced.then_some(0.0));
            parameters.extend(self.parameters(ring, at as f64 / count as f64));
            parameters.push(ring.period);
        }
        let tolerance = Tolerance { relative: self.accuracy, absolute: field.absolute(self.accuracy) };
        let ensemble = Ensemble::with_own_parameters(&field, &parameters, tolerance, &starts, [0.0, 1.0]);
        let arrivals = ensemble.with_step_limit(STEPS).run(&mut |step| {
            sample(step.trajectory(), step);
            Verdict::Continue
        });
        let mut out = Carried::default();
        for arrival in &arrivals {
            if arrival.outcome != Outcome::Reached {
                return None;
            }
            let (x, rest) = arrival.state.split_at(n);
            let (matrix, by_free) = rest[..n * n + n * k].split_at(n * n);
            out.ends.extend_from_slice(x);
            let scaled = matrix.iter().enumerate().map(|(at, m)| m * ring.scales[at % n] / ring.scales[at / n]);
            out.transitions.extend(scaled);
            out.by_free.extend_from_slice(by_free);
        }
        out.begins = self.slopes(ring, &ring.states, 0.0);
        out.finishes = self.slopes(ring, &out.ends, ring.period);
        Some(out)
    }

    /// f at states `[K][n]` of the trajectories at a time of the field.
    pub(super) fn slopes(&self, ring: &Ring, states: &[f64], time: f64) -> Vec<f64> {
        let (n, count) = (ring.dim(), ring.phases());
        let mut f = vec![0.0; states.len()];
        for (at, (x, f)) in states.chunks_exact(n).zip(f.chunks_exact_mut(n)).enumerate() {
            let parameters = self.parameters(ring, at as f64 / count as f64);
            let times = [time];
            let times = if ring.forced { &times[..] } else { &[] };
            let at = Batch { lanes: 1, states: x, parameters: Parameters::Shared(&parameters), times, signs: &[] };
            self.setting.field.evaluate(at, f);
        }
        f
    }

    /// The solution nearest to a ring; `None` if Newton's method does not converge. With a direction, the kernel is oriented at
    /// an acute angle to it.
    pub(super) fn solve(&self, origin: &Ring, along: Option<&[f64]>) -> Option<Solved> {
        let (mut current, mut last) = (origin.clone(), f64::INFINITY);
        for _ in 0..ITERATIONS {
            let carried = self.carried(&current, &mut |_, _| {})?;
            let (update, kernel) = self.update(origin, &current, &carried, along)?;
            // The norm is a root mean square.
            let size = dot(&update, &update).sqrt().max(max_abs(&update));
            let next = current.moved(origin, &update, |own| self.given(own));
            let stalled = size < STALLED && size > 0.3 * last;
            last = size;
            if size < ARRIVED || stalled {
                return Some(Solved { ring: next, carried, kernel });
            }
            if !(size < 1.0 && next.period > 0.0) {
                return None;
            }
            current = next;
        }
        None
    }

    /// Newton step for (1) to (3) and the kernel, in the units of `origin`.
    fn update(
        &self,
        origin: &Ring,
        ring: &Ring,
        carried: &Carried,
        along: Option<&[f64]>,
    ) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
        let (n, k, count) = (ring.dim(), ring.free.len(), ring.phases());
        let second = self.setting.field.second_phase().is_some();
        let units = origin.units(second);
        let (inner, size) = (count * n, units.len());
        let mut a: Mat<f64> = Mat::zeros(size, size);
        let mut right: Mat<f64> = Mat::zeros(size, 1 + k);
        let [table, rate] = phases::shift(count, ring.rotation);
        let (mut turned, mut by_turn) = (vec![0.0; inner], vec![0.0; inner]);
        phases::shifted(&table, &ring.states, n, &mut turned);
        phases::shifted(&rate, &ring.states, n, &mut by_turn);
        let slopes = second.then(|| {
            let (_, slopes) = self.setting.field.second_turns(&self.setting.at(&ring.free));
            let own = |c: usize| {
                let unknown: Vec<f64> = (0..k).map(|other| f64::from(u8::from(other == c))).collect();
                dot(&self.setting.spread(&unknown), &slopes)
            };
            (0..k).map(own).collect::<Vec<f64>>()
        });
        for (own, r) in (0..inner).map(|row| (row / n, row % n)) {
            let (row, scale) = (own * n + r, ring.scales[r]);
            for c in 0..n {
                // The transition matrices are scaled already.
                let entry = carried.transitions[(own * n + r) * n + c];
                a[(row, own * n + c)] += entry * units[own * n + c] / ring.scales[c];
            }
            for l in 0..count {
                a[(row, l * n + r)] -= table[(own + count - l) % count] * units[l * n + r] / scale;
            }
            let mut at = inner;
            if !ring.forced {
                a[(row, at)] = carried.finishes[row] * units[at] / scale;
                at += 1;
            }
            if !second {
                a[(row, at)] = -by_turn[row] * units[at] / scale;
                at += 1;
            }
            for c in 0..k {
                let through = slopes.as_ref().map_or(0.0, |slopes| by_turn[row] * slopes[c]);
                a[(row, at + c)] = (carried.by_free[row * k + c] - through) / scale;
            }
            right[(row, 0)] = -(carried.ends[row] - turned[row]) / scale;
        }
        let mut row = inner;
        let around = (!second).then(|| origin.around());
        let flow = (!ring.forced).then(|| carried.begins.clone());
        for direction in around.into_iter().chain(flow) {
            let entries = direction.iter().enumerate().map(|(at, d)| d * units[at] / ring.scales[at % n].powi(2));
            let entries: Vec<f64> = entries.collect();
            let norm = dot(&entries, &entries).sqrt();
            entries.iter().enumerate().for_each(|(c, e)| a[(row, c)] = e / norm);
            row += 1;
        }
        for r in 0..k {
            for c in 0..size {
                // Any row will do that is not orthogonal to the kernel.
                let any = ((c * c + 3 * c + 7 * r) as f64 * 0.37).sin();
                a[(row + r, c)] = along.filter(|_| r == 0).map_or(any, |along| along[c]);
            }
            right[(row + r, 1 + r)] = 1.0;
        }
        let found = Factored::new(a.as_ref()).solve(&right);
        let column = |c: usize| -> Vec<f64> { (0..size).map(|r| found[(r, c)]).collect() };
        let mut update = column(0);
        let mut kernel: Vec<Vec<f64>> = Vec::new();
        for r in 0..k {
            let mut own = column(1 + r);
            kernel.iter().for_each(|other| axpy(-dot(other, &own), other, &mut own));
            let norm = dot(&own, &own).sqrt();
            own.iter_mut().for_each(|x| *x /= norm);
            kernel.push(own);
        }
        for own in &kernel {
            let part = dot(own, &update);
            axpy(-part, own, &mut update);
        }
        update.iter().all(|x| x.is_finite()).then_some((update, kernel))
    }
}
