//! Cycles with events, at which the state jumps.
//!
//! **Idea.** The flights between the events of a cycle are the states of one boundary-value problem ([`segments`]),
//! which [`CycleProblem`] solves like any other. Their durations are unknowns, so that every event stays at the end of
//! its flight, the orbit is a smooth function of all unknowns, and a branch passes regularly through the point where
//! the velocity of an impact vanishes. Solutions beyond that point are not motions, so the branch ends there.
//!
//! **Equations.** With Φ_i the transition of flight i, ∇h, h_τ the derivatives of the switch and R_x, R_τ those of the
//! reset of the event that ends it, f⁻ and f⁺ before and after it:
//!
//! ```text
//!   (1)  S_i = R_x + (f⁺ - R_x f⁻ - R_τ) ∇h / (∇h·f⁻ + h_τ)
//!   (2)  M = S_k Φ_k ⋯ S_1 Φ_1                                        whose eigenvalues are the multipliers
//! ```
//!
//! The factors of (2) are never multiplied out.
//!
//! **Source.** leine2004, §7 (jumps of the state); thota2008 (segments).
//!
//! **Departures.** The sequence of events is that of the first orbit. Every orbit is examined for events that its
//! sequence does not contain ([`crate::special::impact`]).
//!
//! **Fails when** a flight vanishes: two events at one instant.

mod segments;
pub(crate) mod stored;

use super::cycle::CycleProblem;
use super::gauss::Scheme;
use super::{Axis, Setting, averages, extremes};
use crate::contract::{Batch, Examination, Parameters, Singular, ZeroProblem};
use crate::diagram::{Cycle, Mesh, Point, Solution, Symmetry, Trust};
use crate::linalg::dot;
use crate::stability::floquet::{self, Course, Floquet, Frames};
use num_complex::Complex64;
use segments::{Nothing, Segments};
use std::cell::{Cell, RefCell};
pub(crate) use stored::Flights;

/// Return of perturbations after a period.
pub(crate) struct Returns {
    /// `[k][n × n]`: S_i Φ_i of (2).
    pub transitions: Vec<Vec<f64>>,
    /// `[n]` f at the beginning of the first flight.
    pub rate: Vec<f64>,
}

/// Ratio of the stated to the estimated error of multipliers.
const SPECTRUM_SAFE: f64 = 4.0;

/// Cycles with a given sequence of events.
pub struct ImpactProblem<'a> {
    setting: Setting<'a>,
    segments: Segments<'a>,
    degree: usize,
    /// `[k (n + 1)]`, those of the states of all flights.
    scales: Vec<f64>,
    /// Parameters and axes with the phase of the first event, if the field is forced.
    parameters: Vec<f64>,
    axes: Vec<Axis>,
    /// `[k]`: sign of the change of the switch of each event.
    signs: Vec<f64>,
    /// `[k]` durations of the flights of the cycle like which these are.
    durations: Vec<f64>,
    /// True if events without speed are left out.
    besides_grazing: bool,
    /// Phase of the last reference.
    phase: Cell<f64>,
    parked: RefCell<Option<CycleProblem<'static>>>,
}

impl<'a> ImpactProblem<'a> {
    /// Cycles with the events of `cycle`; `None` if it has none.
    pub fn like(setting: Setting<'a>, cycle: &Cycle) -> Option<ImpactProblem<'a>> {
        let parameters = setting.parameters.clone();
        let flights = Flights::of(setting.field, &parameters, cycle)?;
        Some(ImpactProblem::of(setting, cycle.degree, cycle.forcing_periods, &flights))
    }

    /// Cycles with the events of `cycle` but those without speed; `None` if it has no others.
    pub fn besides_grazing(setting: Setting<'a>, cycle: &Cycle) -> Option<ImpactProblem<'a>> {
        let parameters = setting.parameters.clone();
        let flights = Flights::between(stored::hard(setting.field, &parameters, cycle), cycle)?;
        let own = ImpactProblem::of(setting, cycle.degree, cycle.forcing_periods, &flights);
        Some(ImpactProblem { besides_grazing: true, ..own })
    }

    /// Cycles with the events, and on the mesh, of those flights.
    pub(crate) fn of(
        setting: Setting<'a>,
        degree: usize,
        forcing_periods: u32,
        flights: &Flights,
    ) -> ImpactProblem<'a> {
        let field = setting.field;
        let total: f64 = flights.flights.iter().map(|(last, _)| last).sum();
        let scales = flights.events.iter().flat_map(|_| setting.scales.iter().copied().chain([total])).collect();
        let (mut parameters, mut axes) = (setting.parameters.clone(), Vec::new());
        if forcing_periods > 0 {
            parameters.push(flights.phase);
            axes.push(Axis::new(field.parameter_count(), 1.0));
        }
        axes.extend(setting.axes.iter().cloned());
        let segments = Segments::new(field, flights.events.clone(), forcing_periods);
        let signs = flights.signs(field, &setting.parameters, degree, forcing_periods);
        let phase = Cell::new(flights.phase);
        let durations = flights.flights.iter().map(|(last, _)| *last).collect();
        let problem = ImpactProblem {
            setting,
            segments,
            degree,
            scales,
            parameters,
            axes,
            signs,
            durations,
            besides_grazing: false,
            phase,
            parked: RefCell::new(None),
        };
        problem.with(|inner| inner.set_mesh(&flights.mesh));
        problem
    }

    /// Number of events.
    pub fn count(&self) -> usize {
        self.segments.events.len()
    }

    fn inner_setting(&self) -> Setting<'_> {
        Setting {
            field: &self.segments,
            scales: &self.scales,
            parameters: self.parameters.clone(),
            axes: self.axes.clone(),
        }
    }

    /// Uses the boundary-value problem, which is parked between uses without the field that belongs to this one.
    fn with<R>(&self, act: impl FnOnce(&mut CycleProblem<'_>) -> R) -> R {
        let parked = self.parked.borrow_mut().take();
        let mut inner = match parked {
            Some(parked) => parked.rehoused(self.inner_setting()),
            None => self.fresh(&super::mesh::uniform(1)),
        };
        let found = act(&mut inner);
        let nowhere = Setting { field: &Nothing, scales: &[], parameters: Vec::new(), axes: Vec::new() };
        self.parked.replace(Some(inner.rehoused(nowhere)));
        found
    }

    /// A boundary-value problem on a mesh.
    fn fresh(&self, mesh: &Mesh) -> CycleProblem<'_> {
        let cycle = Cycle {
            points: crate::problem::gauss::Points::Gauss,
            period: 1.0,
            forcing_periods: 1,
            mesh: mesh.clone(),
            degree: self.degree,
            profile: Vec::new(),
            gain: Vec::new(),
        };
        CycleProblem::like(self.inner_setting(), &cycle)
    }

    fn n(&self) -> usize {
        self.setting.field.dim()
    }

    fn is_forced(&self) -> bool {
        self.segments.forcing_periods > 0
    }

    /// Number of profile values on a mesh.
    fn size_on(&self, mesh: &Mesh) -> usize {
        (mesh.len() - 1) * (self.degree + 1) * self.scales.len()
    }

    /// The flights of `u`, with a mesh interval for each part between switchings, and a tangent on that mesh.
    pub(crate) fn flights(&self, u: &[f64], tangent: &[f64]) -> (Flights, Vec<f64>) {
        let (n, all, size) = (self.n(), self.scales.len(), self.size_on(&self.mesh()));
        let (mesh, profile, tangent) = self.with(|inner| inner.cut(u, tangent));
        let flight = |i: usize| {
            let rows = profile.chunks_exact(all).map(|row| &row[i * (n + 1)..i * (n + 1) + n]);
            (u[i * (n + 1) + n], rows.flatten().copied().collect())
        };
        let phase = if self.is_forced() { u[size + 1] } else { 0.0 };
        let flights = (0..self.count()).map(flight).collect();
        (Flights { phase, events: self.segments.events.clone(), mesh, flights }, tangent)
    }

    /// The unknowns of flights, with those of the given parameters, on the mesh of the flights.
    pub(crate) fn unknowns_with(&self, flights: &Flights, parameters: &[f64]) -> Vec<f64> {
        let (n, all) = (self.n(), self.scales.len());
        let mut u = vec![0.0; self.size_on(&flights.mesh)];
        for (row, to) in u.chunks_exact_mut(all).enumerate() {
            for (i, (last, profile)) in flights.flights.iter().enumerate() {
                to[i * (n + 1)..i * (n + 1) + n].copy_from_slice(&profile[row * n..(row + 1) * n]);
                to[i * (n + 1) + n] = *last;
            }
        }
        u.push(1.0);
        if self.is_forced() {
            u.push(flights.phase);
        }
        u.extend(self.setting.axes.iter().map(|axis| parameters.get(axis.index).copied().unwrap_or(0.0) / axis.scale));
        u
    }

    /// All parameters of the field at `u`.
    fn parameters_at(&self, u: &[f64]) -> Vec<f64> {
        self.setting.at(&u[u.len() - self.setting.axes.len()..])
    }

    /// f at mesh node j of flight i, from [`CycleProblem::rates_at_nodes`], whose unit of time is the flight.
    fn rate(&self, rates: &[f64], u: &[f64], j: usize, i: usize) -> Vec<f64> {
        let (n, all) = (self.n(), self.scales.len());
        let own = j * all + i * (n + 1);
        rates[own..own + n].iter().map(|f| f / u[i * (n + 1) + n]).collect()
    }

    /// S of (1) at the end of flight i, `[n × n]`, with the state and f before it and f after it.
    fn saltation(&self, parameters: &[f64], i: usize, [before, f, g]: [&[f64]; 3], times: &[f64]) -> Vec<f64> {
        let (n, field, event) = (self.n(), self.setting.field, self.segments.events[i]);
        let at = Batch { lanes: 1, states: before, parameters: Parameters::Shared(parameters), times, signs: &[] };
        let [mut r, mut rx, mut rt] = [1, n, 1].map(|size| vec![0.0; n * size]);
        field.reset(event, at, &[], [&mut r, &mut rx, &mut [], &mut rt]);
        let switches = field.switch_count();
        let [mut h, mut hx, mut ht] = [1, n, 1].map(|size| vec![0.0; switches * size]);
        field.linearise_switches(at, &[], [&mut h, &mut hx, &mut [], &mut ht]);
        let surface = switches - field.event_count() + event;
        let gradient = &hx[surface * n..(surface + 1) * n];
        // Beyond an impact grazing, where there is no motion, the multipliers come back from infinity with the same sign, so
        // that nothing seems to change there.
        let speed = self.signs[i] * (dot(gradient, f) + ht[surface]).abs();
        let entry = |a: usize, b: usize| {
            let jump = g[a] - dot(&rx[a * n..(a + 1) * n], f) - rt[a];
            rx[a * n + b] + jump * gradient[b] / speed
        };
        (0..n * n).map(|k| entry(k / n, k % n)).collect()
    }

    /// Transition of every flight with the saltation at its end; `None` where the matrix is singular.
    pub(crate) fn returns(&mut self, u: &[f64]) -> Option<Returns> {
        let (n, all, count, mesh) = (self.n(), self.scales.len(), self.count(), self.mesh());
        let unknowns = u.len();
        let rows: Vec<f64> = (0..self.setting.axes.len() * unknowns)
            .map(|k| 0.6 + (k as f64 * 0.0113).sin() + 0.7 * (k as f64 * 1.37).cos())
            .collect();
        let (chain, rates) = self.with(|inner| {
            inner.residual(u, &mut vec![0.0; unknowns]).then_some(())?;
            inner.factorise(u, &rows).ok()?;
            Some((inner.transitions(), inner.rates_at_nodes(u)))
        })?;
        let (parameters, block) = (self.parameters_at(u), (self.degree + 1) * all);
        let mut end = vec![0.0; all];
        let last = (mesh.len() - 2) * block;
        Scheme::of(self.degree).value_into(1.0, &u[last..last + block], &mut end);
        let times = |share: f64, flight: usize| -> Vec<f64> {
            let before: f64 = (0..flight).map(|j| u[j * (n + 1) + n]).sum();
            let phase = || u[self.size_on(&mesh) + 1];
            if self.is_forced() { vec![phase() + before + share * u[flight * (n + 1) + n]] } else { Vec::new() }
        };
        let product = |a: &[f64], b: &[f64]| -> Vec<f64> {
            (0..n * n).map(|at| (0..n).map(|j| a[at / n * n + j] * b[j * n + at % n]).sum()).collect()
        };
        let transition = |i: usize| {
            let own = i * (n + 1);
            let mut whole: Vec<f64> = (0..n * n).map(|at| f64::from(u8::from(at % (n + 1) == 0))).collect();
            for step in chain.chunks_exact(all * all) {
                let part: Vec<f64> = (0..n * n).map(|at| step[(own + at / n) * all + own + at % n]).collect();
                whole = product(&part, &whole);
            }
            let f = self.rate(&rates, u, mesh.len() - 1, i);
            let g = self.rate(&rates, u, 0, (i + 1) % count);
            product(&self.saltation(&parameters, i, [&end[own..own + n], &f, &g], &times(1.0, i)), &whole)
        };
        let transitions: Vec<Vec<f64>> = (0..count).map(transition).collect();
        Some(Returns { transitions, rate: self.rate(&rates, u, 0, 0) })
    }

    /// Flight in which a normalised time of the stored cycle lies, and its share of the duration.
    pub(crate) fn place(&self, time: f64) -> (usize, f64) {
        let whole: f64 = self.durations.iter().sum();
        let mut after = (time * whole - self.phase.get()).rem_euclid(whole);
        for (flight, last) in self.durations.iter().enumerate() {
            if after < *last {
                return (flight, after / last);
            }
            after -= last;
        }
        (0, 0.0)
    }

    /// Sign of the change of the switch of an event.
    pub(crate) fn side(&self, event: usize) -> f64 {
        self.segments.events.iter().position(|own| *own == event).map_or(1.0, |k| self.signs[k])
    }

    /// All switches at shares of a flight.
    pub(crate) fn switches_on<'b>(&'b self, u: &[f64], flight: usize) -> impl Fn(f64) -> Vec<f64> + use<'a, 'b> {
        let ((flights, _), parameters) = (self.flights(u, &[]), self.parameters_at(u));
        let (n, block, degree) = (self.n(), (self.degree + 1) * self.n(), self.degree);
        let begin = flights.phase + flights.flights[..flight].iter().map(|(last, _)| last).sum::<f64>();
        let field = self.setting.field;
        let forced = self.is_forced();
        move |share| {
            let (mesh, (last, profile)) = (&flights.mesh, &flights.flights[flight]);
            let j = mesh.partition_point(|node| *node <= share).clamp(1, mesh.len() - 1) - 1;
            let mut x = vec![0.0; n];
            let s = (share - mesh[j]) / (mesh[j + 1] - mesh[j]);
            Scheme::of(degree).value_into(s, &profile[j * block..(j + 1) * block], &mut x);
            let times = if forced { vec![begin + share * last] } else { Vec::new() };
            let mut values = vec![0.0; field.switch_count()];
            let shared = Parameters::Shared(&parameters);
            field.switches(Batch { lanes: 1, states: &x, parameters: shared, times: &times, signs: &[] }, &mut values);
            values
        }
    }

    /// Multipliers from transitions `[N][all × all]` and f at the nodes of the boundary-value problem.
    fn floquet(&self, u: &[f64], mesh: &Mesh, transitions: &[f64], rates: &[f64]) -> Floquet {
        let (n, all, count) = (self.n(), self.scales.len(), self.count());
        let (scheme, block) = (Scheme::of(self.degree), (self.degree + 1) * all);
        let parameters = self.parameters_at(u);
        let intervals = mesh.len() - 1;
        let mut end = vec![0.0; all];
        scheme.value_into(1.0, &u[(intervals - 1) * block..intervals * block], &mut end);
        let (mut chain, mut flow, mut time) =
            (Vec::new(), Vec::new(), if self.is_forced() { u[self.size_on(mesh) + 1] } else { 0.0 });
        for i in 0..count {
            let own = i * (n + 1)..i * (n + 1) + n;
            time += u[own.end];
            let times = if self.is_forced() { vec![time] } else { Vec::new() };
            for (j, all_of) in transitions.chunks_exact(all * all).enumerate() {
                own.clone()
                    .for_each(|row| chain.extend_from_slice(&all_of[row * all + own.start..row * all + own.end]));
                if !self.is_forced() {
                    flow.extend(self.rate(rates, u, j, i));
                }
            }
            let f = self.rate(rates, u, intervals, i);
            let g = self.rate(rates, u, 0, (i + 1) % count);
            chain.extend(self.saltation(&parameters, i, [&end[own], &f, &g], &times));
            if !self.is_forced() {
                flow.extend(f);
            }
        }
        flow.iter_mut().enumerate().for_each(|(k, f)| *f /= self.setting.scales[k % n]);
        let frames = (!self.is_forced()).then(|| Frames::along(&flow, n));
        floquet::one(Course { transitions: [&chain; 2], frames: frames.as_ref() }, self.setting.scales)
    }

    /// The multipliers on a finer mesh, after a step of Newton's method there; `None` if that fails.
    fn finer_multipliers(&self, u: &[f64], tangent: &[f64]) -> Option<Vec<Complex64>> {
        let mesh = self.mesh();
        let fine = super::mesh::denser(&mesh);
        let mut inner = self.fresh(&fine);
        let (mut better, mut row) = self.with(|own| (own.carry(u, &mesh, &fine), own.transfer(tangent, &mesh, &fine)));
        inner.anchor(&better);
        let count = better.len();
        for round in 0..4 {
            let (mut r, mut step) = (vec![0.0; count], vec![0.0; count]);
            if round == 2 {
                // From the nearest solution to the one at the same value of the parameter.
                let mut shift = vec![0.0; count];
                shift[count - 1] = u[u.len() - 1] - better[count - 1];
                let back = super::back_along(&inner, &shift, &row);
                if back == 0.0 {
                    break;
                }
                better.iter_mut().zip(&row).for_each(|(u, t)| *u += back * t);
                row.fill(0.0);
                row[count - 1] = 1.0;
            }
            if !inner.residual(&better, &mut r) {
                return None;
            }
            r[count - 1] = 0.0;
            inner.factorise(&better, &row).ok()?;
            inner.solve(&r, &mut step);
            better.iter_mut().zip(&step).for_each(|(u, d)| *u -= d);
        }
        inner.factorise(&better, &row).ok()?;
        let (transitions, rates) = (inner.transitions(), inner.rates_at_nodes(&better));
        let mut found = self.floquet(&better, &fine, &transitions, &rates).multipliers;
        if inner.slides() {
            self.without_lost(&mut found);
        }
        Some(found)
    }

    /// Sets the multiplier of a direction that is lost along a slide to 0, which it is up to rounding.
    fn without_lost(&self, multipliers: &mut [Complex64]) {
        let trivial = usize::from(!self.is_forced());
        if let Some(least) = multipliers[trivial..].iter_mut().min_by(|a, b| a.norm().total_cmp(&b.norm())) {
            *least = Complex64::ZERO;
        }
    }

    /// Flights of a stored point, in the order of this problem, and the one of the stored order with which they begin.
    fn flights_of(&self, point: &Point) -> Option<(Flights, usize)> {
        let Solution::Cycle(cycle) = &point.solution else { return None };
        if cycle.degree != self.degree {
            return None;
        }
        let found = match self.besides_grazing {
            true => Flights::between(stored::hard(self.setting.field, &point.parameters, cycle), cycle)?,
            false => Flights::of(self.setting.field, &point.parameters, cycle)?,
        };
        let (q, phase) = (self.segments.forcing_periods, self.phase.get());
        let first = found.beginning(&self.segments.events, phase, q)?;
        Some((found.starting(first, q, phase), first))
    }

    /// A direction in which the flights begin with another one.
    fn rotated(&self, v: &[f64], first: usize) -> Vec<f64> {
        let (n, all) = (self.n(), self.scales.len());
        let scalars = 1 + self.axes.len();
        let Some(size) = v.len().checked_sub(scalars) else { return v.to_vec() };
        // A condition has unknowns before these.
        let extra = size % all;
        let (mut out, v, size) = (v.to_vec(), &v[extra..], size - extra);
        out[extra..extra + size].chunks_exact_mut(all).for_each(|row| row.rotate_left(first * (n + 1)));
        if self.is_forced() {
            out[extra + size + 1] += (0..first).map(|j| v[j * (n + 1) + n]).sum::<f64>();
        }
        out
    }
}

impl ZeroProblem for ImpactProblem<'_> {
    fn unknowns(&self) -> usize {
        self.with(|inner| inner.unknowns())
    }

    fn unit(&self) -> f64 {
        self.setting.unit()
    }

    fn anchor(&mut self, u: &[f64]) {
        if self.is_forced() {
            self.phase.set(u[u.len() - 1 - self.setting.axes.len()]);
        }
        self.with(|inner| inner.anchor(u));
    }

    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> bool {
        let unit = if self.is_forced() { self.setting.field.time_unit(&self.parameters_at(u)) } else { 1.0 };
        self.with(|inner| inner.residual(u, r)) && unit > 0.0 && unit.is_finite()
    }

    fn obstacle(&self, u: &[f64]) -> Option<&'static str> {
        self.with(|inner| inner.obstacle(u))
    }

    fn factorise(&mut self, u: &[f64], rows: &[f64]) -> Result<(), Singular> {
        self.with(|inner| inner.factorise(u, rows))
    }

    fn solve(&mut self, rhs: &[f64], x: &mut [f64]) {
        self.with(|inner| inner.solve(rhs, x));
    }

    fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        self.with(|inner| inner.dot(a, b))
    }

    fn relative_size(&self, du: &[f64], u: &[f64]) -> f64 {
        self.with(|inner| inner.relative_size(du, u))
    }

    fn mesh(&self) -> Mesh {
        self.with(|inner| inner.mesh())
    }

    fn has_multipliers(&self) -> bool {
        true
    }

    fn set_mesh(&mut self, mesh: &Mesh) {
        self.with(|inner| inner.set_mesh(mesh));
    }

    fn transfer(&self, v: &[f64], from: &Mesh, to: &Mesh) -> Vec<f64> {
        self.with(|inner| inner.transfer(v, from, to))
    }

    fn carry(&self, u: &[f64], from: &Mesh, to: &Mesh) -> Vec<f64> {
        self.with(|inner| inner.carry(u, from, to))
    }

    fn blended(&self, solutions: &[&[f64]], weights: &[f64]) -> Vec<f64> {
        self.with(|inner| inner.blended(solutions, weights))
    }

    fn is_switched(&self) -> bool {
        self.with(|inner| inner.is_switched())
    }

    fn better_mesh(&self, u: &[f64], tolerance: f64) -> Option<Mesh> {
        self.with(|inner| inner.better_mesh(u, tolerance))
    }

    fn coarser_mesh(&self, u: &[f64], tolerance: f64) -> Option<Mesh> {
        self.with(|inner| inner.coarser_mesh(u, tolerance))
    }

    fn finer_mesh(&self) -> Option<Mesh> {
        self.with(|inner| inner.finer_mesh())
    }

    fn denser_mesh(&self) -> Option<Mesh> {
        self.with(|inner| inner.denser_mesh())
    }

    fn stability(&mut self, u: &[f64]) -> Examination {
        let mesh = self.mesh();
        let (transitions, rates, slides) =
            self.with(|inner| (inner.transitions(), inner.rates_at_nodes(u), inner.slides()));
        let mut found = self.floquet(u, &mesh, &transitions, &rates);
        if slides {
            self.without_lost(&mut found.multipliers);
        }
        let trivial = usize::from(!self.is_forced());
        let trivial_defect = if trivial > 0 { (found.multipliers[0].re - 1.0).abs() } else { 0.0 };
        let trust = Trust { trivial_defect, spectrum: f64::NAN, ..Trust::default() };
        Examination { spectrum: found.multipliers, trivial, unstable: found.unstable, trust, ..Examination::default() }
    }

    fn examine(&mut self, u: &[f64]) -> Examination {
        let mut found = self.stability(u);
        let inner = self.with(|inner| inner.examine(u)).trust;
        found.trust.discretisation = inner.discretisation;
        found.trust.residual = inner.residual;
        found.trust.slope = inner.slope;
        let (field, parameters) = (self.setting.field, self.parameters_at(u));
        let cycle = self.flights(u, &[]).0.cycle(self.degree, self.segments.forcing_periods, 1.0);
        let (scheme, data) = (Scheme::of(self.degree), [&cycle.profile[..], &cycle.mesh[..]]);
        found.ranges = extremes::of_profile(field, &parameters, data, cycle.forcing_periods, scheme);
        found.averages = averages::of_profile(field, &parameters, data, cycle.forcing_periods, scheme);
        // Extremes may lie on either side of an event.
        for impact in stored::impacts(field, &parameters, &cycle) {
            let times = stored::times_of(&cycle, impact.time);
            for x in [&impact.before, &impact.after] {
                let mut outputs = vec![0.0; field.output_count()];
                let at = Batch {
                    lanes: 1,
                    states: x,
                    parameters: Parameters::Shared(&parameters),
                    times: &times,
                    signs: &[],
                };
                field.outputs(at, &mut outputs);
                for (range, value) in found.ranges.iter_mut().zip(x.iter().chain(&outputs)) {
                    *range = [range[0].min(*value), range[1].max(*value)];
                }
            }
        }
        found
    }

    fn spectrum_error(&mut self, u: &[f64], tangent: &[f64], spectrum: &[Complex64]) -> f64 {
        let Some(finer) = self.finer_multipliers(u, tangent) else { return f64::NAN };
        SPECTRUM_SAFE * super::cycle::spectrum_difference(spectrum, &finer) + floquet::ROUNDING
    }

    fn margin(&self, at: &Point) -> f64 {
        at.free_spectrum().iter().map(|z| (z - 1.0).norm()).fold(f64::INFINITY, f64::min)
    }

    fn point(&self, u: &[f64], tangent: &[f64], examination: Examination) -> Point {
        let parameters = self.parameters_at(u);
        let q = self.segments.forcing_periods;
        let unit = if q > 0 { self.setting.field.time_unit(&parameters) } else { 1.0 };
        let (flights, tangent) = self.flights(u, tangent);
        // Stored flights begin with the first one of the period.
        let first = if q > 0 { flights.first(q) } else { 0 };
        Point {
            position: 0,
            solution: Solution::Cycle(flights.cycle(self.degree, q, unit)),
            parameters,
            tangent: self.rotated(&tangent, first),
            step: 0.0,
            spectrum: examination.spectrum,
            unstable: examination.unstable,
            ranges: examination.ranges,
            averages: examination.averages,
            trust: examination.trust,
            cost: Default::default(),
        }
    }

    /// The mesh becomes that of the point.
    fn unknowns_of(&mut self, point: &Point) -> Vec<f64> {
        match self.flights_of(point) {
            Some((flights, _)) => {
                self.set_mesh(&flights.mesh);
                self.unknowns_with(&flights, &point.parameters)
            }
            None => vec![f64::NAN; self.unknowns()],
        }
    }

    fn images(&mut self, beside: &[f64], point: &Point, symmetry: &Symmetry, within: f64) -> Vec<[Vec<f64>; 2]> {
        if !symmetry.is_identity() {
            return Vec::new();
        }
        let Some((flights, first)) = self.flights_of(point) else { return Vec::new() };
        let mesh = self.mesh();
        let own = self.unknowns_with(&flights, &point.parameters);
        if point.tangent.len() != own.len() {
            return Vec::new();
        }
        let u = self.carry(&own, &flights.mesh, &mesh);
        let tangent = self.transfer(&self.rotated(&point.tangent, first), &flights.mesh, &mesh);
        let off: Vec<f64> = u.iter().zip(beside).map(|(a, b)| a - b).collect();
        if self.dot(&off, &off) <= within * within { vec![[u, tangent]] } else { Vec::new() }
    }
}
