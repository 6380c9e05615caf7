//! Two-dimensional invariant tori by rotated segments.
//!
//! **Idea.** On a torus, motion is described by two angles. K = 2N + 1 trajectories start at equally spaced phases of the
//! closed curve in which the torus meets the section t = 0, last for a period T, and end on the same curve, turned by
//! ρ. Each is a chain of collocation on a common mesh, which may be graded in time as for a cycle; only in the phase must
//! the torus be smooth. The chains are eliminated one by one and joined by trigonometric interpolation.
//!
//! **Equations.** u = (profile, T, ρ, λ₁ … λ_k). For k = 0 … K-1, with phases φ_k = k / K in turns and t ∈ [0, 1]:
//!
//! ```text
//!   (1)  x_k' = T f(x_k, λ)                             collocation, as for cycles
//!   (2)  x_k(1) = Σ_l R_kl(ρ) x_l(0)                    the curve, turned by ρ
//!   (3)  ⟨X - X̃, ∂X̃/∂φ⟩ = 0                             phase, with reference X̃
//!   (4)  ⟨X - X̃, dX̃/dt⟩ = 0   or, forced,   T = q      phase in time, or the forcing periods
//!   (5)  ρ = ρ_0                                        if the rotation number is held
//! ```
//!
//! With a second forcing its turns per period are ρ(λ), which replaces (3), and segment k has its phase at φ_k: the phase on
//! the curve is that of the second forcing.
//!
//! Stability: with G_k the transition matrix of segment k over T, the operator L = R(-ρ) diag(G_k) acts on perturbations
//! of the closed curve. Its eigenvalues lie on n circles; see [`stability`].
//!
//! **Source.** schilder2005 (rotated segments, Fourier in the phase); jorba2001 (stability).
//!
//! **Departures.** The segments are condensed like cycles; a free rotation number is an unknown, so that a branch needs
//! one parameter only and passes over narrow locking.
//!
//! **Fails when** the torus loses smoothness in the phase, as where it locks or breaks up: then no number of phases up
//! to the limit suffices.

mod errors;
mod joint;
pub mod phases;
mod stability;
pub mod start;
pub mod summit;
mod surface;

use super::cycle::CycleProblem;
use super::gauss::Scheme;
use super::{Setting, mesh};
use crate::contract::{Examination, Singular, ZeroProblem};
use crate::diagram::{Mesh, Point, Solution, Symmetry, Torus, Trust};
use crate::linalg::{all_finite, larger, same};
pub use errors::LARGEST;
pub(crate) use errors::harmonics;
use joint::Joint;
use std::cell::RefCell;

/// Tori in one free parameter with the rotation number free, or in two with the rotation number held.
pub struct TorusProblem<'a> {
    setting: Setting<'a>,
    scheme: Scheme,
    n: usize,
    /// q of (4); 0 for an autonomous field.
    forcing_periods: u32,
    /// Parameter that is the phase of a second forcing, and ρ of that with its derivatives at the last evaluation.
    second: Option<usize>,
    /// ρ_0 of (5).
    held: Option<f64>,
    /// The mesh in time and phase, its part in time, and K.
    mesh: Mesh,
    time: Mesh,
    phases: usize,
    segments: Vec<CycleProblem<'a>>,
    /// X̃ with its scalars, and the normalised directions of (3) and (4), each in the layout of the profile.
    anchored: Vec<f64>,
    directions: Vec<Vec<f64>>,
    scale: Vec<f64>,
    period_scale: f64,
    joint: Option<Joint>,
    /// Mean over the segments of ∫ tr f_x dt, at the last factorisation.
    trace: f64,
    /// ρ at the last factorisation.
    turn: f64,
    measured: RefCell<Option<errors::Measured>>,
}

impl<'a> TorusProblem<'a> {
    /// Tori with the degree, the mesh and the number of forcing periods of `torus`; with a rotation number to hold, if
    /// any.
    pub fn like(setting: Setting<'a>, torus: &Torus, held: Option<f64>) -> TorusProblem<'a> {
        let mut problem = TorusProblem {
            scheme: Scheme::new(torus.degree),
            n: setting.field.dim(),
            forcing_periods: torus.forcing_periods,
            second: setting.field.second_phase(),
            held,
            mesh: Mesh::default(),
            time: Mesh::default(),
            phases: 0,
            segments: Vec::new(),
            anchored: Vec::new(),
            directions: Vec::new(),
            scale: setting.scales.to_vec(),
            period_scale: 1.0,
            joint: None,
            trace: 0.0,
            turn: 0.0,
            measured: RefCell::default(),
            setting,
        };
        problem.set_mesh(&torus.mesh);
        problem
    }

    /// Segment k on the current mesh.
    fn segment(&self, k: usize) -> CycleProblem<'a> {
        let mut setting = self.setting.clone();
        if let Some(phase) = self.second {
            setting.parameters[phase] += k as f64 / self.phases as f64;
        }
        let rows = self.phase_count() + self.setting.freedom().max(1);
        CycleProblem::segment(setting, self.scheme.degree, &self.time, self.forcing_periods, rows)
    }

    fn intervals(&self) -> usize {
        self.time.len() - 1
    }

    fn profile_size(&self) -> usize {
        self.intervals() * (self.scheme.degree + 1) * self.phases * self.n
    }

    /// Number of equations behind the profile: (3), (4) and, if ρ is held, (5).
    fn conditions(&self) -> usize {
        2 + usize::from(self.held.is_some())
    }

    /// The profile of segment k, `[N][m + 1][n]`.
    fn chain(&self, v: &[f64], k: usize) -> Vec<f64> {
        let (n, width, size) = (self.n, self.phases * self.n, self.profile_size());
        let mut own = Vec::with_capacity(size / self.phases + 1 + self.setting.freedom());
        v[..size].chunks_exact(width).for_each(|node| own.extend_from_slice(&node[k * n..(k + 1) * n]));
        own
    }

    /// Writes the profile of segment k to `v`.
    fn put(&self, chain: &[f64], k: usize, v: &mut [f64]) {
        let (width, size) = (self.phases * self.n, self.profile_size());
        for (node, own) in v[..size].chunks_exact_mut(width).zip(chain.chunks_exact(self.n)) {
            node[k * self.n..(k + 1) * self.n].copy_from_slice(own);
        }
    }

    /// The unknowns of segment k: its profile, T and the free parameters.
    fn of_segment(&self, u: &[f64], k: usize) -> Vec<f64> {
        let size = self.profile_size();
        let mut own = self.chain(u, k);
        own.push(u[size]);
        own.extend_from_slice(&u[size + 2..]);
        own
    }

    /// Largest modulus of every state, over the profile.
    fn sizes(&self, u: &[f64]) -> Vec<f64> {
        let mut largest = vec![0.0f64; self.n];
        for x in u[..self.profile_size()].chunks_exact(self.n) {
            largest.iter_mut().zip(x).for_each(|(most, x)| *most = larger(*most, x.abs()));
        }
        largest
    }

    fn relative_scale(&self, u: &[f64]) -> Vec<f64> {
        self.sizes(u).iter().zip(self.setting.scales).map(|(size, scale)| size + scale).collect()
    }

    /// The part of the inner product that belongs to the profile.
    fn dot_profiles(&self, a: &[f64], b: &[f64]) -> f64 {
        let (m, width) = (self.scheme.degree, self.phases * self.n);
        let weights: Vec<f64> = (0..self.n).map(|c| 1.0 / (self.scale[c] * self.scale[c])).collect();
        let mut total = 0.0;
        for (j, pair) in self.time.windows(2).enumerate() {
            for i in 1..=m {
                let at = (j * (m + 1) + i) * width;
                let (a, b) = (&a[at..at + width], &b[at..at + width]);
                let sum: f64 = a.iter().zip(b).zip(weights.iter().cycle()).map(|((a, b), w)| a * b * w).sum();
                total += (pair[1] - pair[0]) * self.scheme.weights[i - 1] * sum;
            }
        }
        total / width as f64
    }

    /// ∂X/∂φ and, without forcing, dX/dt, in the layout of the profile, of unit length.
    fn tangents(&self, u: &[f64]) -> Vec<Vec<f64>> {
        let (m, width, size) = (self.scheme.degree, self.phases * self.n, self.profile_size());
        let [_, rate] = phases::shift(self.phases, 0.0);
        let mut around = vec![0.0; size];
        for (node, own) in around.chunks_exact_mut(width).zip(u.chunks_exact(width)) {
            phases::shifted(&rate, own, self.n, node);
        }
        let mut all = vec![around];
        if self.forcing_periods == 0 {
            let mut along = vec![0.0; size];
            let blocks = along.chunks_exact_mut((m + 1) * width).zip(u.chunks_exact((m + 1) * width));
            for ((own, x), pair) in blocks.zip(self.time.windows(2)) {
                for i in 0..m {
                    for k in 0..=m {
                        let weight = self.scheme.derivative[i * (m + 1) + k] / (pair[1] - pair[0]);
                        let to = &mut own[(i + 1) * width..(i + 2) * width];
                        to.iter_mut().zip(&x[k * width..(k + 1) * width]).for_each(|(to, x)| *to += weight * x);
                    }
                }
            }
            all.push(along);
        }
        for direction in &mut all {
            let norm = self.dot_profiles(direction, direction).sqrt().max(f64::MIN_POSITIVE);
            direction.iter_mut().for_each(|d| *d /= norm);
        }
        all
    }
}

impl ZeroProblem for TorusProblem<'_> {
    fn unknowns(&self) -> usize {
        self.profile_size() + 2 + self.setting.freedom()
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
        self.anchored = u.to_vec();
        self.directions = self.tangents(u);
    }

    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> bool {
        if self.directions.is_empty() {
            self.anchor(u);
        }
        let (n, size) = (self.n, self.profile_size());
        let block = (self.scheme.degree + 1) * n;
        let [table, _] = phases::shift(self.phases, u[size + 1]);
        let mut turned = vec![0.0; self.phases * n];
        phases::shifted(&table, &u[..self.phases * n], n, &mut turned);
        for k in 0..self.phases {
            let own = self.of_segment(u, k);
            let mut defects = vec![0.0; own.len()];
            self.segments[k].segment_residual(&own, &mut defects);
            let last = (self.intervals() - 1) * block;
            defects[last..last + n].iter_mut().zip(&turned[k * n..(k + 1) * n]).for_each(|(r, x)| *r += x);
            self.put(&defects, k, r);
        }
        let off: Vec<f64> = u[..size].iter().zip(&self.anchored).map(|(a, b)| a - b).collect();
        r[size + 1] = match self.second {
            None => self.dot_profiles(&off, &self.directions[0]),
            Some(_) => u[size + 1] - self.setting.field.second_turns(&self.setting.at(&u[size + 2..])).0,
        };
        r[size] = match self.forcing_periods {
            0 => self.dot_profiles(&off, &self.directions[1]),
            q => u[size] - f64::from(q),
        };
        if let Some(rotation) = self.held {
            r[size + 2] = u[size + 1] - rotation;
        }
        let unit = self.setting.field.time_unit(&self.setting.at(&u[size + 2..]));
        all_finite(&r[..size + self.conditions()]) && u[size] > 0.0 && unit > 0.0 && unit.is_finite()
    }

    fn factorise(&mut self, u: &[f64], rows: &[f64]) -> Result<(), Singular> {
        if self.directions.is_empty() {
            self.anchor(u);
        }
        let (count, size) = (self.phases, self.profile_size());
        let profiles: Vec<&[f64]> = self
            .directions
            .iter()
            .filter(|_| self.second.is_none())
            .map(Vec::as_slice)
            .chain(rows.chunks_exact(u.len()).map(|row| &row[..size]))
            .collect();
        let scale = self.scale.clone();
        let mut trace = 0.0;
        for k in 0..count {
            let own = self.of_segment(u, k);
            let borders: Vec<Vec<f64>> = profiles.iter().map(|row| self.chain(row, k)).collect();
            trace += self.segments[k].segment_factorise(&own, &borders, &scale)?;
        }
        (self.trace, self.turn) = (trace / count as f64, u[size + 1]);
        self.join(u, rows)
    }

    fn solve(&mut self, rhs: &[f64], x: &mut [f64]) {
        self.solve_joined(rhs, x);
    }

    fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        let size = self.profile_size();
        self.dot_profiles(a, b)
            + a[size] * b[size] / (self.period_scale * self.period_scale)
            + a[size + 1..].iter().zip(&b[size + 1..]).map(|(a, b)| a * b).sum::<f64>()
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
        if mesh::same(&self.mesh, mesh) {
            return;
        }
        let (time, count) = (phases::in_time(mesh), phases::count(mesh));
        if self.second.is_some() && count != self.phases {
            self.segments.clear();
        }
        (self.mesh, self.time, self.phases) = (mesh.clone(), time.clone(), count);
        self.segments.truncate(count);
        self.segments.iter_mut().for_each(|own| own.move_to(&time));
        while self.segments.len() < count {
            let own = self.segment(self.segments.len());
            self.segments.push(own);
        }
        (self.joint, self.anchored, self.directions) = (None, Vec::new(), Vec::new());
        self.measured.replace(None);
    }

    fn transfer(&self, v: &[f64], from: &Mesh, to: &Mesh) -> Vec<f64> {
        if mesh::same(from, to) {
            return v.to_vec();
        }
        let size = v.len() - 2 - self.setting.freedom();
        let mut out = start::transferred(&v[..size], self.n, &self.scheme, from, to);
        out.extend_from_slice(&v[size..]);
        out
    }

    fn better_mesh(&self, u: &[f64], tolerance: f64) -> Option<Mesh> {
        self.finer_for(u, tolerance)
    }

    fn coarser_mesh(&self, u: &[f64], tolerance: f64) -> Option<Mesh> {
        self.coarser_for(u, tolerance)
    }

    fn finer_mesh(&self) -> Option<Mesh> {
        Some(phases::joined(&mesh::divided(&self.time, 2), errors::more_phases(self.phases)))
    }

    fn denser_mesh(&self) -> Option<Mesh> {
        Some(phases::joined(&mesh::denser(&self.time), errors::more_phases(self.phases)))
    }

    fn stability(&mut self, _u: &[f64]) -> Examination {
        self.spectrum()
    }

    fn examine(&mut self, u: &[f64]) -> Examination {
        let mut found = self.spectrum();
        let mut r = vec![0.0; u.len()];
        self.residual(u, &mut r);
        let scale = self.relative_scale(u);
        let residual = self.sizes(&r).iter().zip(&scale).map(|(v, s)| v / s).fold(0.0, f64::max);
        (found.ranges, found.averages) = self.extent(u);
        let stated = self.stated_error(u);
        found.trust = Trust { discretisation: stated, residual, ..found.trust };
        found
    }

    fn spectrum_error(&mut self, u: &[f64], _tangent: &[f64], _spectrum: &[num_complex::Complex64]) -> f64 {
        self.spectrum_doubt(u)
    }

    fn margin(&self, at: &Point) -> f64 {
        at.free_spectrum().iter().map(|z| (z - 1.0).norm()).fold(f64::INFINITY, f64::min)
    }

    fn point(&self, u: &[f64], tangent: &[f64], examination: Examination) -> Point {
        let size = self.profile_size();
        let parameters = self.setting.at(&u[size + 2..]);
        Point {
            position: 0,
            solution: Solution::Torus(Torus {
                period: u[size] * self.setting.field.time_unit(&parameters),
                rotation: u[size + 1],
                forcing_periods: self.forcing_periods,
                mesh: self.mesh.clone(),
                degree: self.scheme.degree,
                profile: u[..size].to_vec(),
            }),
            parameters,
            tangent: tangent.to_vec(),
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
        self.in_phase(beside, point, symmetry, within)
    }

    fn unknowns_of(&mut self, point: &Point) -> Vec<f64> {
        let Solution::Torus(torus) = &point.solution else { return vec![f64::NAN; self.unknowns()] };
        let mut u = torus.profile.clone();
        u.push(if self.forcing_periods > 0 { f64::from(self.forcing_periods) } else { torus.period });
        u.push(torus.rotation);
        u.extend(self.setting.unknowns_of(point));
        u
    }
}
