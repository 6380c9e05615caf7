//! Cycles by orthogonal collocation.
//!
//! **Idea.** In normalised time the profile is a polynomial of degree m on each mesh interval, represented by its
//! values at the left end and at the Gauss points, where it satisfies the differential equation. An integral phase
//! condition fixes the time shift.
//!
//! **Equations.** u = (profile, T, λ₁ … λ_k), N(m+1)n + 1 + k unknowns, k = 1 for a curve; A, e, b from [`Scheme`]; h_j
//! interval lengths:
//!
//! ```text
//!   (1)  X_{j,i} - x_j - h_j T Σ_k a_ik f(X_{j,k}, λ) = 0               i = 1…m, j = 0…N-1
//!   (2)  x_{j+1} - Σ_k e_k X_{j,k} = 0,   x_N = x_0 + g                 X_{j,0} = x_j
//!   (3)  Σ_j h_j Σ_i b_i ⟨X_{j,i} - X̃_{j,i}, X̃'_{j,i}⟩ = 0              phase, with reference X̃
//! ```
//!
//! with g = 0, or whole periods for those states that are angles and rotate.
//!
//! A forced field is f(X, λ, τ) with the time τ in forcing periods. A cycle lasts a prescribed number q of them, and
//! (3) is replaced by
//!
//! ```text
//!   (4)  T - q = 0,   τ_{j,i} = q t_{j,i}
//! ```
//!
//! (1) is the Runge–Kutta form of collocation: its matrix is close to the identity on short intervals.
//!
//! Inner products of states divide component c by s_c = (model scale) + max |X̃_c|.
//!
//! **Source.** ascher1995, §5; hairer1996, §IV.8; doedel1991 (integral phase condition).
//!
//! **Fails when** the cycle shrinks to an equilibrium (the phase condition loses its meaning there) or its period grows
//! without bound; the continuation recognises both.

mod assembly;
mod errors;
mod local;
mod meshes;
mod open;
mod phase;
mod residual;
mod segment;
mod shift;
mod stages;
#[cfg(test)]
mod tests_local;

use super::defect;
use super::gauss::Scheme;
use super::mesh::Passage;
use super::piecewise::{self, Obstacle, PiecewiseFlow, Switched};
use super::{Setting, averages, extremes, mesh};
use crate::contract::{Batch, Examination, Parameters, Shift, Singular, ZeroProblem};
use crate::diagram::{Cycle, Mesh, Point, Solution, Symmetry, Trust};
use crate::linalg::lane::{Eight, Lane};
use crate::linalg::system::System;
use crate::linalg::{all_finite, axpy, larger, same};
use crate::stability::floquet::{self, Course, Floquet, Frames};
pub(in crate::problem) use errors::spectrum_difference;
use errors::{Measured, Room};
use num_complex::Complex64;
pub(in crate::problem) use stages::GROWTH;
use std::cell::RefCell;
use std::sync::Arc;

/// Smallest density of the next mesh, as a share of that of the current one.
const KEPT: f64 = 0.6;

/// Ratio of the stated to the estimated error. On the reference study `foldline verify` finds true errors of up to 2.2
/// estimates.
pub(crate) const SAFE: f64 = 4.0;
/// Allowance for rounding: some 1e-11 on thousands of intervals, or where errors are strongly amplified.
const ROUNDING: f64 = 5e-11;

/// The intervals in which an orbit switches.
#[derive(Default)]
struct Switchings {
    /// The unknowns they belong to.
    at: Vec<f64>,
    intervals: Arc<Vec<Switched>>,
    /// Reason why they are not known.
    obstacle: Option<Obstacle>,
}

/// Cycles in one free parameter (a curve) or several.
pub struct CycleProblem<'a> {
    setting: Setting<'a>,
    scheme: Scheme,
    sampling: defect::Sampling,
    mesh: Mesh,
    n: usize,
    halves: bool,
    /// Numbers of conditions on the ends and on integrals, for a boundary-value problem.
    conditions: [usize; 2],
    /// True if the stated error contains what the conditions at the ends neglect.
    truncation_stated: bool,
    /// q of (4); 0 for an autonomous field.
    forcing_periods: u32,
    /// `[n]`: x_N - x_0 where angles rotate; see [`Cycle::gain`].
    gain: Vec<f64>,
    /// `[L][m][W]`: τ_{j,i}; empty for an autonomous field.
    times: Vec<f64>,
    /// X̃' / s² at the Gauss points, `[L][m][n][W]`, normalised to unit length, and ⟨X̃, X̃'⟩ in that weight.
    phase: Vec<f64>,
    phase_offset: f64,
    /// X̃ with its scalars; empty if there is none on this mesh. Below, true if `phase` must still be computed from it.
    anchored: Vec<f64>,
    unphased: bool,
    scale: Vec<f64>,
    period_scale: f64,
    /// Sizes of the unknowns λ in the inner product: 1, or 1 + |λ| of those that conditions determine.
    axis_scales: Vec<f64>,
    system: System,
    /// The last factorisation, if local forces were made use of; below, false if they must not be.
    local: Option<local::Localised>,
    structured: bool,
    /// Number of places and lanes of the solver; see [`System`].
    length: usize,
    width: usize,
    /// `[L][W]`: h_j for interval j of the solver, zero beyond the last one.
    lengths: Vec<f64>,
    /// `[n][L][m][W]`: X_{j,i}.
    states: Vec<f64>,
    /// `[n][L][W]`: x_j.
    ends: Vec<f64>,
    f: Vec<f64>,
    fx: Vec<f64>,
    fp: Vec<f64>,
    /// `[n × n]`: true for entries of f_x that have ever been nonzero.
    coupled: Vec<bool>,
    trace: f64,
    /// The last error estimate. Mesh and errors belong together only at the point where they were computed.
    measured: RefCell<Option<Measured>>,
    room: RefCell<Room>,
    /// Those found last.
    switched: RefCell<Switchings>,
    /// Interpolations between the most recently used pairs of meshes.
    passages: RefCell<Vec<Passage>>,
}

impl<'a> CycleProblem<'a> {
    /// Cycles represented by polynomials of degree `degree` on `mesh`.
    pub fn new(setting: Setting<'a>, degree: usize, mesh: &Mesh) -> CycleProblem<'a> {
        CycleProblem::with(setting, Scheme::of(degree), mesh)
    }

    /// Cycles in a collocation scheme on `mesh`.
    pub fn with(setting: Setting<'a>, scheme: &Scheme, mesh: &Mesh) -> CycleProblem<'a> {
        let scheme = scheme.clone();
        let n = setting.field.dim();
        let conditions = setting.field.conditions();
        // Integral conditions in place of conditions on the ends need scalars that are not in use.
        let unused = if conditions == [0, 0] { 0 } else { n.saturating_sub(conditions[0]) };
        let mut problem = CycleProblem {
            system: System::new(n, &scheme.end, 1 + setting.freedom() + unused),
            conditions,
            truncation_stated: true,
            local: None,
            structured: true,
            length: 0,
            width: 1,
            lengths: Vec::new(),
            scale: setting.scales.to_vec(),
            axis_scales: vec![1.0; setting.freedom()],
            setting,
            sampling: defect::Sampling::new(&scheme),
            scheme,
            mesh: mesh.clone(),
            n,
            halves: false,
            forcing_periods: 0,
            gain: Vec::new(),
            times: Vec::new(),
            phase: Vec::new(),
            phase_offset: 0.0,
            anchored: Vec::new(),
            unphased: false,
            period_scale: 1.0,
            states: Vec::new(),
            ends: Vec::new(),
            f: Vec::new(),
            fx: Vec::new(),
            fp: Vec::new(),
            coupled: vec![false; n * n],
            trace: 0.0,
            measured: RefCell::new(None),
            room: RefCell::default(),
            switched: RefCell::default(),
            passages: RefCell::default(),
        };
        problem.arrange();
        problem
    }

    /// Cycles with the scheme, the mesh, the number of forcing periods and the rotations of `cycle`.
    pub fn like(setting: Setting<'a>, cycle: &Cycle) -> CycleProblem<'a> {
        let mut problem = CycleProblem::with(setting, cycle.scheme(), &cycle.mesh);
        problem.forcing_periods = cycle.forcing_periods;
        // The ends of a boundary-value problem are related by its conditions alone.
        problem.gain = if problem.is_open() { Vec::new() } else { cycle.gain.clone() };
        problem.arrange();
        problem
    }

    /// This problem without the error of the conditions at the ends in its stated error, for orbits that are still being
    /// lengthened.
    pub fn without_truncation(mut self) -> CycleProblem<'a> {
        self.truncation_stated = false;
        self
    }

    /// This problem with another setting of as many states, conditions and free parameters.
    pub(in crate::problem) fn rehoused<'b>(self, setting: Setting<'b>) -> CycleProblem<'b> {
        let CycleProblem {
            setting: _,
            scheme,
            sampling,
            mesh,
            n,
            halves,
            conditions,
            truncation_stated,
            forcing_periods,
            gain,
            times,
            phase,
            phase_offset,
            anchored,
            unphased,
            scale,
            period_scale,
            axis_scales,
            system,
            local,
            structured,
            length,
            width,
            lengths,
            states,
            ends,
            f,
            fx,
            fp,
            coupled,
            trace,
            measured,
            room,
            switched,
            passages,
        } = self;
        CycleProblem {
            setting,
            scheme,
            sampling,
            mesh,
            n,
            halves,
            conditions,
            truncation_stated,
            forcing_periods,
            gain,
            times,
            phase,
            phase_offset,
            anchored,
            unphased,
            scale,
            period_scale,
            axis_scales,
            system,
            local,
            structured,
            length,
            width,
            lengths,
            states,
            ends,
            f,
            fx,
            fp,
            coupled,
            trace,
            measured,
            room,
            switched,
            passages,
        }
    }

    /// The intervals in which the orbit `u` switches.
    fn switched(&self, u: &[f64]) -> Arc<Vec<Switched>> {
        if self.setting.field.switch_count() == 0 {
            return Arc::default();
        }
        if !same(&self.switched.borrow().at, u) {
            let (found, obstacle) = match self.flow(u).intervals(&u[..self.profile_size()], &self.mesh) {
                Ok(found) => (found, None),
                Err(obstacle) => (Vec::new(), Some(obstacle)),
            };
            self.switched.replace(Switchings { at: u.to_vec(), intervals: Arc::new(found), obstacle });
        }
        self.switched.borrow().intervals.clone()
    }

    /// The piecewise flow with the scalars of `u`.
    fn flow(&self, u: &[f64]) -> PiecewiseFlow<'_> {
        PiecewiseFlow::new(&self.setting, &self.scheme, &u[self.profile_size()..], self.forcing_periods)
    }

    /// Moves the inner nodes of intervals in which the orbit switches to the values that the flow requires, because no
    /// single polynomial represents the orbit there.
    fn settle(&self, u: &mut [f64]) {
        let block = self.block();
        for found in self.switched(u).iter() {
            let own = found.interval * block + self.n..(found.interval + 1) * block;
            u[own].copy_from_slice(&found.inner(&self.scheme, self.interval(found.interval)));
        }
    }

    /// Replaces the interpolated `u` by the flow on intervals in which any of the solutions switches, each run of them
    /// from the right end of the interval before it. A switching moves with the solution, so that the values there are
    /// not smooth functions along the curve.
    fn continue_through(&self, solutions: &[&[f64]], u: &mut [f64]) {
        let (n, size, block, count) = (self.n, self.profile_size(), self.block(), self.intervals());
        let mut crossed = vec![false; count];
        for own in solutions {
            let found = self.flow(own).intervals(&own[..size], &self.mesh).unwrap_or_default();
            found.iter().for_each(|found| crossed[found.interval] = true);
        }
        // The ends of a boundary-value problem do not meet.
        let first = if self.is_open() { Some(count - 1) } else { crossed.iter().position(|own| !own) };
        let Some(first) = first else { return };
        let flow = self.flow(u);
        let mut left: Option<Vec<f64>> = None;
        for j in (first + 1..=first + count).map(|j| j % count) {
            if j == 0 && self.is_open() {
                left = Some(u[..n].to_vec());
            } else if j == 0 {
                left.iter_mut().for_each(|x| x.iter_mut().zip(&self.gain).for_each(|(x, gain)| *x -= gain));
            }
            if !crossed[j] {
                left = None;
                continue;
            }
            let before = (j + count - 1) % count;
            let x = left.take().unwrap_or_else(|| {
                let mut x = vec![0.0; n];
                self.scheme.value_into(1.0, &u[before * block..(before + 1) * block], &mut x);
                if j == 0 {
                    x.iter_mut().zip(&self.gain).for_each(|(x, gain)| *x -= gain);
                }
                x
            });
            let own = j * block..(j + 1) * block;
            let Some((inner, end)) = flow.through(j, &x, self.interval(j), &u[own.clone()], [&u[..size], &self.mesh])
            else {
                return;
            };
            u[own.start..own.start + n].copy_from_slice(&x);
            u[own.start + n..own.end].copy_from_slice(&inner);
            left = Some(end);
        }
    }

    /// Ends of interval j in normalised time.
    fn interval(&self, j: usize) -> [f64; 2] {
        [self.mesh[j], self.mesh[j + 1]]
    }

    /// The orbit with a mesh interval for each part between switchings: mesh and profile, and likewise a tangent
    /// `[unknowns]`.
    pub(in crate::problem) fn cut(&self, u: &[f64], tangent: &[f64]) -> (Mesh, Vec<f64>, Vec<f64>) {
        let size = self.profile_size();
        let switched = self.switched(u);
        if switched.is_empty() {
            return (self.mesh.clone(), u[..size].to_vec(), tangent.to_vec());
        }
        let (mesh, profile) = piecewise::cut(&u[..size], &self.mesh, &switched, self.block());
        // A condition has unknowns before these; a point by itself has no tangent.
        let Some(extra) = tangent.len().checked_sub(u.len()) else { return (mesh, profile, tangent.to_vec()) };
        let along = piecewise::cut_direction(&tangent[extra..], self.intervals(), &switched, self.block());
        (mesh, profile, [&tangent[..extra], &along].concat())
    }

    /// True if (4) replaces (3).
    fn is_forced(&self) -> bool {
        self.forcing_periods > 0
    }

    /// True if there is exactly one non-trivial multiplier.
    fn is_planar(&self) -> bool {
        self.n == if self.is_forced() { 1 } else { 2 }
    }

    /// Keeps the second half of every new mesh a copy of the first. A period-doubled cycle meets its parent at a
    /// pitchfork that is perfect only if the discretisation does not distinguish the two halves. The current mesh must
    /// already have this form.
    pub fn with_equal_halves(mut self) -> Self {
        self.halves = true;
        self
    }

    /// k, the number of free parameters that are not determined by conditions.
    fn freedom(&self) -> usize {
        self.setting.freedom() - self.surplus()
    }

    /// The collocation scheme.
    pub fn scheme(&self) -> &Scheme {
        &self.scheme
    }

    fn intervals(&self) -> usize {
        self.mesh.len() - 1
    }

    /// Number of points in a batch.
    fn lanes(&self) -> usize {
        self.length * self.width * self.scheme.degree
    }

    /// Number of values that describe the profile.
    pub fn profile_size(&self) -> usize {
        self.intervals() * (self.scheme.degree + 1) * self.n
    }

    /// τ of a point of the batch.
    fn time_of(&self, at: usize) -> f64 {
        let (m, lane) = (self.scheme.degree, at % self.width);
        let (place, i) = (at / self.width / m, at / self.width % m);
        let j = (lane * self.length + place).min(self.intervals() - 1);
        f64::from(self.forcing_periods) * (self.mesh[j] + self.h(j) * self.scheme.nodes[i + 1])
    }

    fn h(&self, j: usize) -> f64 {
        self.mesh[j + 1] - self.mesh[j]
    }

    /// Multipliers from the last factorisation, which must be one at `u`.
    fn floquet(&self, u: &[f64]) -> Floquet {
        if let Some(local) = &self.local {
            return self.local_floquet(u, local);
        }
        let (frames, transitions) = (self.frames(u), self.transitions());
        let course = Course { transitions: [&transitions; 2], frames: frames.as_ref() };
        floquet::one(course, &self.scale)
    }

    /// `[N][n × n]`: transition matrices from the left to the right end of each interval.
    pub(in crate::problem) fn transitions(&self) -> Vec<f64> {
        let mut transitions = vec![0.0; self.intervals() * self.n * self.n];
        transitions.chunks_exact_mut(self.n * self.n).enumerate().for_each(|(j, own)| self.system.transition(j, own));
        transitions
    }

    /// Frames that split off the trivial multiplier; `None` for a forced field.
    fn frames(&self, u: &[f64]) -> Option<Frames> {
        (!self.is_forced()).then(|| Frames::along(&self.flow_at_nodes(u), self.n))
    }

    /// Solves with the last factorisation of a problem without conditions on its ends.
    fn solve_closed(&self, rhs: &[f64], x: &mut [f64]) {
        match &self.local {
            Some(local) => local.system.solve(rhs, x),
            None => self.system.solve(rhs, x),
        }
    }

    fn block(&self) -> usize {
        (self.scheme.degree + 1) * self.n
    }

    /// Largest absolute value of each component over the profile; NaN if one is.
    fn sizes(&self, u: &[f64]) -> Vec<f64> {
        // All components of all nodes of an interval are treated at once, so that the loop runs over lanes.
        let mut largest = vec![0.0f64; (self.scheme.degree + 1) * self.n];
        Eight::dispatch(Largest { profile: &u[..self.profile_size()], largest: &mut largest });
        for k in self.n..largest.len() {
            largest[k % self.n] = larger(largest[k % self.n], largest[k]);
        }
        largest.truncate(self.n);
        largest
    }

    fn relative_scale(&self, u: &[f64]) -> Vec<f64> {
        let mut sizes = self.sizes(u);
        // The size of an angle does not depend on its copy.
        let angles = sizes.iter_mut().zip(self.setting.field.periods()).filter(|(_, period)| period.is_finite());
        angles.for_each(|(size, period)| *size = 0.5 * period);
        sizes.iter_mut().zip(self.setting.scales).for_each(|(size, scale)| *size += scale);
        sizes
    }
}

/// The multiplier of smallest modulus.
fn smallest(multipliers: &mut [Complex64]) -> Option<&mut Complex64> {
    multipliers.iter_mut().min_by(|a, b| a.norm().total_cmp(&b.norm()))
}

/// Largest absolute value of every entry of an interval.
struct Largest<'a, 'b> {
    profile: &'a [f64],
    largest: &'b mut [f64],
}

impl pulp::NullaryFnOnce for Largest<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let size = self.largest.len();
        let mut at = 0;
        while at < size {
            at += match size - at {
                8.. => largest_of::<8>(self.profile, size, at, self.largest),
                4.. => largest_of::<4>(self.profile, size, at, self.largest),
                _ => largest_of::<1>(self.profile, size, at, self.largest),
            };
        }
    }
}

/// Largest absolute values of C entries from `at` on; returns C. The comparisons stay in registers, in four independent
/// rows.
#[inline(always)]
fn largest_of<const C: usize>(profile: &[f64], size: usize, at: usize, largest: &mut [f64]) -> usize {
    let mut own = [[0.0f64; C]; 4];
    let compare = |own: &mut [f64; C], interval: &[f64]| {
        let Some(v) = interval[at..].first_chunk::<C>() else { return };
        (0..C).for_each(|l| own[l] = larger(own[l], v[l].abs()));
    };
    let mut fours = profile.chunks_exact(4 * size);
    for four in &mut fours {
        let (two, other) = four.split_at(2 * size);
        let ((a, b), (c, d)) = (two.split_at(size), other.split_at(size));
        compare(&mut own[0], a);
        compare(&mut own[1], b);
        compare(&mut own[2], c);
        compare(&mut own[3], d);
    }
    fours.remainder().chunks_exact(size).for_each(|interval| compare(&mut own[0], interval));
    for l in 0..C {
        let [a, b, c, d] = [own[0][l], own[1][l], own[2][l], own[3][l]];
        largest[at + l] = larger(larger(larger(larger(largest[at + l], a), b), c), d);
    }
    C
}

/// Σ_j h_j a_j b_j for every entry of an interval but the first few.
struct Products<'a, 'b> {
    a: &'a [f64],
    b: &'a [f64],
    mesh: &'a [f64],
    skipped: usize,
    sums: &'b mut [f64],
}

impl pulp::NullaryFnOnce for Products<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Products { a, b, mesh, skipped, sums } = self;
        let block = skipped + sums.len();
        let intervals = || a.chunks_exact(block).zip(b.chunks_exact(block)).zip(mesh.windows(2));
        let (blocks, rest) = sums.as_chunks_mut::<8>();
        // The sums stay in registers.
        for (k, sums) in blocks.iter_mut().enumerate() {
            let at = skipped + 8 * k;
            let mut sum = Eight::load(sums);
            for ((x, y), pair) in intervals() {
                sum = sum + Eight::splat(pair[1] - pair[0]) * (Eight::load(&x[at..]) * Eight::load(&y[at..]));
            }
            *sums = sum.0;
        }
        let at = block - rest.len();
        for ((x, y), pair) in intervals().take(if rest.is_empty() { 0 } else { mesh.len() }) {
            let h = pair[1] - pair[0];
            for ((sum, x), y) in rest.iter_mut().zip(&x[at..]).zip(&y[at..]) {
                *sum += h * (x * y);
            }
        }
    }
}

impl ZeroProblem for CycleProblem<'_> {
    fn unknowns(&self) -> usize {
        self.profile_size() + 1 + self.setting.freedom()
    }

    fn unit(&self) -> f64 {
        self.setting.unit()
    }

    fn anchor(&mut self, u: &[f64]) {
        if same(&self.anchored, u) {
            return;
        }
        self.scale = self.relative_scale(u);
        self.period_scale = u[self.profile_size()].abs().max(f64::MIN_POSITIVE);
        let (surplus, values) = (self.surplus(), &u[self.profile_size() + 1..]);
        let determined = self.axis_scales[..surplus].iter_mut().zip(values);
        determined.for_each(|(scale, value)| *scale = 1.0 + value.abs());
        self.anchored.clear();
        self.anchored.extend_from_slice(u);
        self.unphased = true;
        if self.is_open() {
            self.refer(u);
        }
    }

    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> bool {
        let size = self.profile_size();
        self.lay_phase();
        self.gather(u);
        let parameters = self.setting.at(&u[size + 1..]);
        let all = parameters;
        let (lanes, parameters) = (self.lanes(), Parameters::Shared(&all));
        let batch = Batch { lanes, states: &self.states, parameters, times: &self.times, signs: &[] };
        self.setting.field.evaluate(batch, &mut self.f);
        let phase = match self.width {
            1 => self.defects::<f64>(u, r),
            _ => self.defects::<Eight>(u, r),
        };
        let block = self.block();
        for found in self.switched(u).iter() {
            let own = found.interval * block + self.n..(found.interval + 1) * block;
            let required = found.inner(&self.scheme, self.interval(found.interval));
            r[own.clone()].iter_mut().zip(&u[own]).zip(&required).for_each(|((r, x), flow)| *r = x - flow);
        }
        if self.is_open() {
            self.close(u, &all, r);
        }
        r[size] = match self.is_forced() {
            true => u[size] - f64::from(self.forcing_periods),
            false => phase - self.phase_offset,
        };
        let unit = if self.is_forced() { self.setting.field.time_unit(&all) } else { 1.0 };
        self.obstacle(u).is_none() && all_finite(&r[..=size]) && u[size] > 0.0 && unit > 0.0 && unit.is_finite()
    }

    fn obstacle(&self, u: &[f64]) -> Option<&'static str> {
        self.switched(u);
        self.switched.borrow().obstacle.map(Obstacle::name)
    }

    fn factorise(&mut self, u: &[f64], rows: &[f64]) -> Result<(), Singular> {
        self.linearise(u);
        self.lay_phase();
        self.local = self.localised(u, rows);
        if self.local.is_some() {
            return Ok(());
        }
        self.assemble(u, rows)?;
        self.system.eliminate(1.0)
    }

    fn solve(&mut self, rhs: &[f64], x: &mut [f64]) {
        match self.is_open() {
            true => self.solve_open(rhs, x),
            false => self.solve_closed(rhs, x),
        }
    }

    fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        let (n, block, size) = (self.n, (self.scheme.degree + 1) * self.n, self.profile_size());
        // The sum over the intervals first, for every Gauss point and component.
        let mut sums = vec![0.0; block - n];
        Eight::dispatch(Products { a: &a[..size], b: &b[..size], mesh: &self.mesh, skipped: n, sums: &mut sums });
        let mut total = 0.0;
        for (weight, sums) in self.scheme.weights.iter().zip(sums.chunks_exact(n)) {
            total += weight * sums.iter().zip(&self.scale).map(|(sum, scale)| sum / (scale * scale)).sum::<f64>();
        }
        total / n as f64
            + a[size] * b[size] / (self.period_scale * self.period_scale)
            + a[size + 1..]
                .iter()
                .zip(&b[size + 1..])
                .zip(&self.axis_scales)
                .map(|((a, b), s)| a * b / (s * s))
                .sum::<f64>()
    }

    fn relative_size(&self, du: &[f64], u: &[f64]) -> f64 {
        let size = self.profile_size();
        let scale = self.relative_scale(u);
        let scalars = (du[size] / u[size]).abs().max(Setting::relative_size(&du[size + 1..], &u[size + 1..]));
        self.sizes(du).iter().zip(&scale).map(|(d, s)| d / s).fold(scalars, larger)
    }

    fn mesh(&self) -> Mesh {
        self.mesh.clone()
    }

    fn set_mesh(&mut self, mesh: &Mesh) {
        if !mesh::same(&self.mesh, mesh) {
            self.mesh = mesh.clone();
            self.arrange();
        }
    }

    fn transfer(&self, v: &[f64], from: &Mesh, to: &Mesh) -> Vec<f64> {
        if mesh::same(from, to) {
            return v.to_vec();
        }
        let size = v.len() - 1 - self.setting.freedom();
        let mut out = self.passed(&v[..size], from, to);
        out.extend_from_slice(&v[size..]);
        out
    }

    fn carry(&self, u: &[f64], from: &Mesh, to: &Mesh) -> Vec<f64> {
        if self.setting.field.switch_count() == 0 || mesh::same(from, to) {
            return self.transfer(u, from, to);
        }
        let (size, block) = (u.len() - 1 - self.setting.freedom(), self.block());
        let flow = PiecewiseFlow::new(&self.setting, &self.scheme, &u[size..], self.forcing_periods);
        let (mesh, profile) =
            piecewise::cut(&u[..size], from, &flow.intervals(&u[..size], from).unwrap_or_default(), block);
        let mut out = mesh::transferred(&profile, self.n, &self.scheme, &mesh, to);
        for found in flow.intervals(&out, to).unwrap_or_default() {
            let j = found.interval;
            let inner = found.inner(&self.scheme, [to[j], to[j + 1]]);
            out[j * block + self.n..(j + 1) * block].copy_from_slice(&inner);
        }
        out.extend_from_slice(&u[size..]);
        out
    }

    fn blended(&self, solutions: &[&[f64]], weights: &[f64]) -> Vec<f64> {
        let mut u = vec![0.0; self.unknowns()];
        weights.iter().zip(solutions).for_each(|(weight, own)| axpy(*weight, own, &mut u));
        self.continue_through(solutions, &mut u);
        u
    }

    fn shift(&self, u: &[f64], change: &[f64]) -> Option<Shift> {
        self.split(u, change)
    }

    fn better_mesh(&self, u: &[f64], tolerance: f64) -> Option<Mesh> {
        let errors = self.errors(u);
        let tolerance = tolerance.max(self.rounding(u));
        let worst = errors.iter().fold(0.0, |m: f64, e| m.max(*e));
        let lopsided = || !self.is_open() && !self.halves && self.nearly_doubled(u) && !mesh::in_halves(&self.mesh);
        (worst > tolerance || lopsided()).then(|| self.equidistributed(u, &errors, tolerance, KEPT)).flatten()
    }

    fn coarser_mesh(&self, u: &[f64], tolerance: f64) -> Option<Mesh> {
        let errors = self.errors(u);
        let enough = self.equidistributed(u, &errors, tolerance, 0.0)?;
        // Coarsened gradually: if the errors at interval ends dominate, they grow with a higher power than assumed.
        (2 * enough.len() < self.mesh.len()).then(|| self.equidistributed(u, &errors, tolerance, KEPT)).flatten()
    }

    fn finer_mesh(&self) -> Option<Mesh> {
        Some(mesh::divided(&self.mesh, 2))
    }

    fn denser_mesh(&self) -> Option<Mesh> {
        Some(mesh::denser(&self.mesh))
    }

    // A single non-trivial multiplier is exp(∫ tr f_x), by Liouville's formula. The integral is as accurate as the
    // profile; transition matrices of intervals are not. A canard is smooth along a repelling slow manifold, so its
    // intervals there are long, however fast neighbouring solutions depart.
    fn stability(&mut self, u: &[f64]) -> Examination {
        if self.is_open() {
            return self.degeneracy(u);
        }
        let mut found = self.floquet(u);
        let trivial = usize::from(!self.is_forced());
        // A cycle that slides along a surface has lost a direction.
        let slides = self.trace == f64::NEG_INFINITY;
        if slides && let Some(least) = smallest(&mut found.multipliers[trivial..]) {
            *least = Complex64::ZERO;
        }
        if self.is_planar() && (self.trace.is_finite() || slides) {
            found.multipliers[trivial] = Complex64::new(self.trace.exp(), 0.0);
            found.unstable = usize::from(self.trace > 0.0);
            found.log_product = self.trace + found.multipliers[..trivial].iter().map(|z| z.norm().ln()).sum::<f64>();
        }
        let trust = Trust {
            trivial_defect: if self.is_forced() { 0.0 } else { (found.multipliers[0].re - 1.0).abs() },
            liouville_defect: if slides { 0.0 } else { (found.log_product - self.trace).abs() },
            spectrum: f64::NAN,
            ..Trust::default()
        };
        let (spectrum, unstable) = (found.multipliers, found.unstable);
        Examination { spectrum, trivial, unstable, trust, ..Examination::default() }
    }

    fn examine(&mut self, u: &[f64]) -> Examination {
        let size = self.profile_size();
        let mut found = self.stability(u);
        let scale = self.relative_scale(u);
        let errors = self.errors(u);
        let mut r = vec![0.0; u.len()];
        self.residual(u, &mut r);
        let residual = self.sizes(&r).iter().zip(&scale).map(|(v, s)| v / s).fold(r[size].abs(), f64::max);
        let parameters = self.setting.at(&u[size + 1..]);
        let (mesh, profile, _) = self.cut(u, u);
        let cycle = [&profile[..], &mesh[..]];
        found.ranges = extremes::of_profile(self.setting.field, &parameters, cycle, self.forcing_periods, &self.scheme);
        found.averages =
            averages::of_profile(self.setting.field, &parameters, cycle, self.forcing_periods, &self.scheme);
        // A rotating angle takes all values and has no mean.
        for (c, gain) in self.gain.iter().enumerate().filter(|(_, gain)| **gain != 0.0) {
            let half = 0.5 * self.setting.field.periods().get(c).copied().unwrap_or(*gain).abs();
            (found.ranges[c], found.averages[c]) = ([-half, half], [f64::NAN; 2]);
        }
        let truncated = if self.truncation_stated { self.truncation(u) } else { 0.0 };
        found.trust.discretisation = truncated + SAFE * errors.iter().fold(0.0, |m: f64, e| m.max(*e)) + ROUNDING;
        found.trust.residual = residual;
        found.trust.slope = self.slope_error();
        found
    }

    fn spectrum_error(&mut self, u: &[f64], tangent: &[f64], spectrum: &[Complex64]) -> f64 {
        match self.is_open() {
            true => self.degeneracy_error(u, spectrum),
            false => self.multiplier_error(u, tangent, spectrum),
        }
    }

    fn is_switched(&self) -> bool {
        self.setting.field.switch_count() > 0
    }

    fn margin(&self, at: &Point) -> f64 {
        if self.setting.field.saddles(&at.parameters).is_some() {
            return f64::INFINITY;
        }
        at.free_spectrum().iter().map(|z| (z - 1.0).norm()).fold(f64::INFINITY, f64::min)
    }

    fn point(&self, u: &[f64], tangent: &[f64], examination: Examination) -> Point {
        let size = self.profile_size();
        let parameters = self.setting.at(&u[size + 1..]);
        let (mesh, profile, tangent) = self.cut(u, tangent);
        let gain = match self.is_open() {
            true => {
                let [left, right] = self.both_ends(u);
                right.iter().zip(&left).map(|(b, a)| b - a).collect()
            }
            false => self.gain.clone(),
        };
        Point {
            position: 0,
            solution: Solution::Cycle(Cycle {
                points: self.scheme.points,
                period: u[size] * self.setting.field.time_unit(&parameters),
                forcing_periods: self.forcing_periods,
                mesh,
                degree: self.scheme.degree,
                profile,
                gain,
            }),
            parameters,
            tangent,
            step: 0.0,
            spectrum: examination.spectrum,
            unstable: examination.unstable,
            ranges: examination.ranges,
            averages: examination.averages,
            trust: examination.trust,
            cost: Default::default(),
        }
    }

    fn images(&mut self, beside: &[f64], point: &Point, symmetry: &Symmetry, within: f64) -> Vec<[Vec<f64>; 2]> {
        match self.is_open() {
            true => self.mirrored(beside, point, symmetry, within),
            false => self.in_phase(beside, point, symmetry, within),
        }
    }

    fn unknowns_of(&mut self, point: &Point) -> Vec<f64> {
        let (mut u, period) = match &point.solution {
            Solution::Cycle(cycle) => (cycle.clone().with_points(self.scheme.points).profile, cycle.period),
            Solution::Equilibrium(x) => (x.iter().copied().cycle().take(self.profile_size()).collect(), 1.0),
            Solution::Torus(torus) => (vec![f64::NAN; self.profile_size()], torus.period),
        };
        u.push(if self.is_forced() { f64::from(self.forcing_periods) } else { period });
        u.extend(self.setting.unknowns_of(point));
        u
    }
}
