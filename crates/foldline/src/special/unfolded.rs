//! Unfolding of a vector field by an additional amplitude, for curves of branch points of cycles and of boundary-value
//! problems.
//!
//! **Idea.** Where branches cross, the cycles of f with two free parameters do not form a smooth surface. Those of
//! f(x, λ) + b d(x) with an unfolding amplitude b do, provided that d along the cycle is not in the range of the
//! variational equation. Any d without symmetry or structure serves; where b = 0 the cycle is one of f.
//!
//! **Equations.** With sizes s of the states and fixed numbers m, φ:
//!
//!   (1)  d_i(x) = s_i Σ_j m_ij sin(x_j / s_j + φ_ij)
//!
//! b is the last parameter. In a boundary-value problem the conditions are shifted instead of f, with fixed numbers c and
//! the sizes σ of the terms of each condition:
//!
//!   (2)  B_j + b σ_j c_j = 0,   ∫ (g_k + b σ_k c_k) dt = 0
//!
//! **Source.** allgower1990, §8 (unfolding of branch points); doedel2003 (cycles).

use crate::contract::{Batch, Examination, Parameters, Singular, VectorField, ZeroProblem};
use crate::diagram::{Cycle, Mesh, Point, Solution, Symmetry};
use crate::problem::cycle::CycleProblem;
use crate::problem::{Axis, Setting};
use num_complex::Complex64;
use std::f64::consts::FRAC_PI_2;

/// Vector field f + b d, with b as an additional parameter.
#[derive(Clone)]
pub struct Unfolded<'f> {
    field: &'f dyn VectorField,
    sizes: Vec<f64>,
    /// σ c of (2), of the conditions at the ends and of those on integrals; empty unless there are conditions.
    shifts: Vec<f64>,
}

impl<'f> Unfolded<'f> {
    /// Unfolds `field`; `sizes` `[n]` are the sizes of the states along the cycles.
    pub fn new(field: &'f dyn VectorField, sizes: &[f64]) -> Unfolded<'f> {
        let [ends, integrals] = field.conditions();
        Unfolded { field, sizes: sizes.to_vec(), shifts: (0..ends + integrals).map(Unfolded::shift).collect() }
    }

    /// Unfolds `field` like [`Unfolded::new`], with conditions shifted in proportion to their terms at a solution.
    pub fn at(field: &'f dyn VectorField, sizes: &[f64], point: &Point) -> Unfolded<'f> {
        let mut own = Unfolded::new(field, sizes);
        let ([ends, integrals], n) = (field.conditions(), field.dim());
        let Solution::Cycle(arc) = &point.solution else { return own };
        if own.shifts.is_empty() {
            return own;
        }
        let (first, last) = (arc.state(0.0), arc.end());
        let [mut b, mut left, mut right] = [1, n, n].map(|size| vec![0.0; ends * size]);
        field.boundary([&first, &last], &point.parameters, &[], [&mut b, &mut left, &mut right, &mut []]);
        let (mut g, mut gx) = (vec![0.0; integrals], vec![0.0; integrals * n]);
        let parameters = Parameters::Shared(&point.parameters);
        let batch = Batch { lanes: 1, states: &first, parameters, times: &[0.0], signs: &[] };
        field.integrands(batch, &[], [&mut g, &mut gx, &mut []]);
        let size = |rows: &[&[f64]], k: usize| -> f64 {
            let terms = rows.iter().flat_map(|row| row[k * n..(k + 1) * n].iter().zip(sizes));
            let sum: f64 = terms.map(|(x, s)| (x * s).abs()).sum();
            if sum > 0.0 && sum.is_finite() { sum } else { 1.0 }
        };
        for (k, shift) in own.shifts.iter_mut().enumerate() {
            *shift *= if k < ends { size(&[&left, &right], k) } else { size(&[&gx], k - ends) };
        }
        own
    }

    /// c_k: numbers without structure.
    fn shift(k: usize) -> f64 {
        0.3 + 0.7 * ((k * k) as f64 + 0.5).sin()
    }

    /// Unfolding of another field with the same states.
    pub fn over<'g>(&self, field: &'g dyn VectorField) -> Unfolded<'g> {
        Unfolded { field, sizes: self.sizes.clone(), shifts: self.shifts.clone() }
    }

    /// Splits a batch into that of f and the value of b in each lane.
    fn parts<'b>(&self, at: Batch<'b>) -> (Batch<'b>, impl Fn(usize) -> f64 + use<'b>) {
        let (k, lanes) = (self.field.parameter_count(), at.lanes);
        let parameters = match at.parameters {
            Parameters::Shared(all) => Parameters::Shared(&all[..k]),
            Parameters::PerLane(all) => Parameters::PerLane(&all[..k * lanes]),
        };
        let amplitude = move |lane: usize| match at.parameters {
            Parameters::Shared(all) => all[k],
            Parameters::PerLane(all) => all[k * lanes + lane],
        };
        (Batch { parameters, ..at }, amplitude)
    }

    /// m_ij and φ_ij: numbers without structure.
    fn coefficients(i: usize, j: usize) -> (f64, f64) {
        let number = |a: f64, b: f64| (1.0 + a * i as f64 + b * j as f64).sin();
        (0.6 + number(1.3, 1.9), 2.0 * number(2.3, 0.7))
    }

    /// Derivative of d_i in a lane along the directions (d_i itself without directions). Only the states, the first
    /// `[n × lanes]` of each direction, count.
    fn bent(&self, i: usize, lane: usize, at: &Batch, directions: &[&[f64]]) -> f64 {
        if !self.shifts.is_empty() {
            return 0.0;
        }
        let turn = FRAC_PI_2 * directions.len() as f64;
        let term = |j: usize| {
            let (m, phase) = Unfolded::coefficients(i, j);
            let along: f64 = directions.iter().map(|v| v[j * at.lanes + lane] / self.sizes[j]).product();
            m * (at.states[j * at.lanes + lane] / self.sizes[j] + phase + turn).sin() * along
        };
        self.sizes[i] * (0..self.sizes.len()).map(term).sum::<f64>()
    }

    /// Writes the derivatives by the parameters `free`, `[rows × free × lanes]`, from those by the parameters of f and
    /// those by b.
    fn columns(&self, free: &[usize], of_own: &[f64], by_amplitude: &[f64], lanes: usize, out: &mut [f64]) {
        let k = self.field.parameter_count();
        let known = free.iter().filter(|index| **index < k).count();
        for (row, shift) in by_amplitude.iter().enumerate() {
            let mut next = 0;
            for (c, index) in free.iter().enumerate() {
                let to = &mut out[(row * free.len() + c) * lanes..][..lanes];
                if *index < k {
                    to.copy_from_slice(&of_own[(row * known + next) * lanes..][..lanes]);
                    next += 1;
                } else {
                    to.fill(*shift);
                }
            }
        }
    }

    fn add(&self, at: &Batch, amplitude: impl Fn(usize) -> f64, f: &mut [f64]) {
        for i in 0..self.sizes.len() {
            for lane in 0..at.lanes {
                f[i * at.lanes + lane] += amplitude(lane) * self.bent(i, lane, at, &[]);
            }
        }
    }
}

impl VectorField for Unfolded<'_> {
    fn dim(&self) -> usize {
        self.field.dim()
    }

    fn parameter_count(&self) -> usize {
        self.field.parameter_count() + 1
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        let (own, amplitude) = self.parts(at);
        self.field.evaluate(own, f);
        self.add(&at, amplitude, f);
    }

    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        let (own, amplitude) = self.parts(at);
        let (n, k, lanes) = (self.dim(), self.field.parameter_count(), at.lanes);
        let known: Vec<usize> = free.iter().copied().filter(|index| *index < k).collect();
        let mut given = vec![0.0; n * known.len() * lanes];
        self.field.linearise(own, &known, f, fx, &mut given);
        self.add(&at, &amplitude, f);
        for j in 0..if self.shifts.is_empty() { n } else { 0 } {
            for (i, lane) in (0..n).flat_map(|i| (0..lanes).map(move |lane| (i, lane))) {
                let term = |j: usize| {
                    let (m, phase) = Unfolded::coefficients(i, j);
                    m * (at.states[j * lanes + lane] / self.sizes[j] + phase).cos() / self.sizes[j]
                };
                fx[(i * n + j) * lanes + lane] += amplitude(lane) * self.sizes[i] * term(j);
            }
        }
        let mut next = 0;
        for (c, index) in free.iter().enumerate() {
            let column = |i: usize| (i * free.len() + c) * lanes;
            for i in 0..n {
                for lane in 0..lanes {
                    fp[column(i) + lane] = match *index < k {
                        true => given[(i * known.len() + next) * lanes + lane],
                        false => self.bent(i, lane, &at, &[]),
                    };
                }
            }
            next += usize::from(*index < k);
        }
    }

    fn directional(&self, at: Batch, directions: &[&[f64]], out: &mut [f64]) {
        let (own, amplitude) = self.parts(at);
        let (n, k, lanes) = (self.dim(), self.field.parameter_count(), at.lanes);
        let given: Vec<&[f64]> = directions.iter().map(|v| &v[..(n + k) * lanes]).collect();
        self.field.directional(own, &given, out);
        for i in 0..n {
            for lane in 0..lanes {
                // b d is linear in b.
                let mut sum = amplitude(lane) * self.bent(i, lane, &at, directions);
                for (l, v) in directions.iter().enumerate() {
                    let others: Vec<&[f64]> =
                        directions.iter().enumerate().filter(|(other, _)| *other != l).map(|(_, v)| *v).collect();
                    sum += v[(n + k) * lanes + lane] * self.bent(i, lane, &at, &others);
                }
                out[i * lanes + lane] += sum;
            }
        }
    }

    fn ended(&self) -> bool {
        self.field.ended()
    }

    fn iterated(&self) -> bool {
        self.field.iterated()
    }

    fn forced(&self) -> bool {
        self.field.forced()
    }

    fn time_unit(&self, parameters: &[f64]) -> f64 {
        self.field.time_unit(&parameters[..self.field.parameter_count()])
    }

    fn periods(&self) -> &[f64] {
        self.field.periods()
    }

    fn conditions(&self) -> [usize; 2] {
        self.field.conditions()
    }

    fn determined(&self) -> &[usize] {
        self.field.determined()
    }

    fn boundary(&self, ends: [&[f64]; 2], parameters: &[f64], free: &[usize], [b, left, right, bp]: [&mut [f64]; 4]) {
        let (k, [count, _]) = (self.field.parameter_count(), self.field.conditions());
        let own: Vec<usize> = free.iter().copied().filter(|index| *index < k).collect();
        let mut of_own = vec![0.0; count * own.len()];
        self.field.boundary(ends, &parameters[..k], &own, [&mut *b, left, right, &mut of_own]);
        b.iter_mut().zip(&self.shifts).for_each(|(b, shift)| *b += parameters[k] * shift);
        self.columns(free, &of_own, &self.shifts[..count], 1, bp);
    }

    fn integrands(&self, at: Batch, free: &[usize], [g, gx, gp]: [&mut [f64]; 3]) {
        let (k, [ends, count]) = (self.field.parameter_count(), self.field.conditions());
        let (inner, amplitude) = self.parts(at);
        let own: Vec<usize> = free.iter().copied().filter(|index| *index < k).collect();
        let mut of_own = vec![0.0; count * own.len() * at.lanes];
        self.field.integrands(inner, &own, [&mut *g, gx, &mut of_own]);
        for (line, shift) in g.chunks_exact_mut(at.lanes).zip(&self.shifts[ends..]) {
            line.iter_mut().enumerate().for_each(|(lane, g)| *g += amplitude(lane) * shift);
        }
        self.columns(free, &of_own, &self.shifts[ends..], at.lanes, gp);
    }

    fn output_count(&self) -> usize {
        self.field.output_count()
    }

    fn outputs(&self, at: Batch, out: &mut [f64]) {
        self.field.outputs(self.parts(at).0, out);
    }

    fn outputs_along(&self, at: Batch, direction: &[f64], out: &mut [f64]) {
        // The outputs do not depend on b.
        let own = (self.dim() + self.field.parameter_count()) * at.lanes;
        self.field.outputs_along(self.parts(at).0, &direction[..own], out);
    }

    fn time_unit_along(&self, parameters: &[f64], change: &[f64]) -> f64 {
        let k = self.field.parameter_count();
        self.field.time_unit_along(&parameters[..k], &change[..k])
    }

    fn switch_count(&self) -> usize {
        self.field.switch_count()
    }

    fn switches(&self, at: Batch, out: &mut [f64]) {
        self.field.switches(self.parts(at).0, out);
    }

    fn switch_name(&self, switch: usize) -> String {
        self.field.switch_name(switch)
    }

    fn linearise_switches(&self, at: Batch, free: &[usize], [h, hx, hp, ht]: [&mut [f64]; 4]) {
        // The switching functions do not depend on b.
        let (k, lanes) = (self.field.parameter_count(), at.lanes);
        let own: Vec<usize> = free.iter().copied().filter(|index| *index < k).collect();
        let mut of_own = vec![0.0; self.switch_count() * own.len() * lanes];
        self.field.linearise_switches(self.parts(at).0, &own, [h, hx, &mut of_own, ht]);
        hp.fill(0.0);
        for s in 0..self.switch_count() {
            for (to, _) in free.iter().enumerate().filter(|(_, index)| **index < k) {
                let from = free[..to].iter().filter(|index| **index < k).count();
                let values = &of_own[(s * own.len() + from) * lanes..][..lanes];
                hp[(s * free.len() + to) * lanes..][..lanes].copy_from_slice(values);
            }
        }
    }
}

/// Cycle problem of f + b d with unknowns u = (profile, T, b, λ₁ … λ_k); its points do not contain b.
pub struct UnfoldedCycles<'a> {
    cycles: CycleProblem<'a>,
    parameters: usize,
    /// Number of free parameters, b not counted.
    free: usize,
    /// T at the last reference.
    period: f64,
}

impl<'a> UnfoldedCycles<'a> {
    /// Converts a setting of f to one of f + b d, with b scaled for `cycle`.
    pub fn setting(setting: &Setting, unfolded: &'a Unfolded<'a>, scales: &'a [f64], cycle: &Cycle) -> Setting<'a> {
        // Scale of b: over a period it then changes the states by their sizes.
        let time = if cycle.forcing_periods > 0 { f64::from(cycle.forcing_periods) } else { cycle.period };
        let k = setting.parameters.len();
        Setting {
            field: unfolded,
            scales,
            parameters: [&setting.parameters[..], &[0.0]].concat(),
            axes: [Axis::new(k, 1.0 / time)].into_iter().chain(setting.axes.iter().cloned()).collect(),
        }
    }

    /// Creates the problem of f + b d from its cycle problem; `parameters` is the number of parameters of f, of
    /// which `free` are free.
    pub fn new(cycles: CycleProblem<'a>, parameters: usize, free: usize) -> UnfoldedCycles<'a> {
        UnfoldedCycles { cycles, parameters, free, period: 1.0 }
    }
}

impl ZeroProblem for UnfoldedCycles<'_> {
    fn unknowns(&self) -> usize {
        self.cycles.unknowns()
    }

    fn unit(&self) -> f64 {
        self.cycles.unit()
    }

    fn anchor(&mut self, u: &[f64]) {
        self.period = u[u.len() - self.free - 2];
        self.cycles.anchor(u);
    }

    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> bool {
        self.cycles.residual(u, r)
    }

    fn obstacle(&self, u: &[f64]) -> Option<&'static str> {
        self.cycles.obstacle(u)
    }

    fn factorise(&mut self, u: &[f64], rows: &[f64]) -> Result<(), Singular> {
        self.cycles.factorise(u, rows)
    }

    fn solve(&mut self, rhs: &[f64], x: &mut [f64]) {
        self.cycles.solve(rhs, x);
    }

    fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        self.cycles.dot(a, b)
    }

    fn relative_size(&self, du: &[f64], u: &[f64]) -> f64 {
        self.cycles.relative_size(du, u)
    }

    fn mesh(&self) -> Mesh {
        self.cycles.mesh()
    }

    fn set_mesh(&mut self, mesh: &Mesh) {
        self.cycles.set_mesh(mesh);
    }

    fn transfer(&self, v: &[f64], from: &Mesh, to: &Mesh) -> Vec<f64> {
        self.cycles.transfer(v, from, to)
    }

    fn carry(&self, u: &[f64], from: &Mesh, to: &Mesh) -> Vec<f64> {
        self.cycles.carry(u, from, to)
    }

    fn blended(&self, solutions: &[&[f64]], weights: &[f64]) -> Vec<f64> {
        self.cycles.blended(solutions, weights)
    }

    fn better_mesh(&self, u: &[f64], tolerance: f64) -> Option<Mesh> {
        self.cycles.better_mesh(u, tolerance)
    }

    fn coarser_mesh(&self, u: &[f64], tolerance: f64) -> Option<Mesh> {
        self.cycles.coarser_mesh(u, tolerance)
    }

    fn finer_mesh(&self) -> Option<Mesh> {
        self.cycles.finer_mesh()
    }

    fn denser_mesh(&self) -> Option<Mesh> {
        self.cycles.denser_mesh()
    }

    fn examine(&mut self, u: &[f64]) -> Examination {
        self.cycles.examine(u)
    }

    fn stability(&mut self, u: &[f64]) -> Examination {
        self.cycles.stability(u)
    }

    fn spectrum_error(&mut self, u: &[f64], tangent: &[f64], spectrum: &[Complex64]) -> f64 {
        self.cycles.spectrum_error(u, tangent, spectrum)
    }

    fn margin(&self, at: &Point) -> f64 {
        self.cycles.margin(at)
    }

    /// Effect of b over a period, relative to the sizes of the states. A mesh breaks symmetries, so b is known only to
    /// the discretisation error, a thousand times that of Newton's method
    /// ([`crate::continuation::Settings::newton_tolerance`]).
    fn departure(&self, u: &[f64]) -> f64 {
        1e-3 * (u[u.len() - self.free - 1] * self.period).abs()
    }

    fn point(&self, u: &[f64], tangent: &[f64], examination: Examination) -> Point {
        let mut point = self.cycles.point(u, tangent, examination);
        point.parameters.truncate(self.parameters);
        point
    }

    fn unknowns_of(&mut self, point: &Point) -> Vec<f64> {
        self.cycles.unknowns_of(point)
    }

    fn images(&mut self, beside: &[f64], point: &Point, symmetry: &Symmetry, within: f64) -> Vec<[Vec<f64>; 2]> {
        self.cycles.images(beside, point, symmetry, within)
    }
}

/// Size of every state along a solution: its largest absolute value, or its scale if that is larger.
pub fn sizes(point: &Point, scales: &[f64]) -> Vec<f64> {
    let mut sizes = scales.to_vec();
    if let Solution::Cycle(cycle) = &point.solution {
        let n = sizes.len();
        cycle.profile.iter().enumerate().for_each(|(k, x)| sizes[k % n] = sizes[k % n].max(x.abs()));
    }
    sizes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Definition, Model, ModelSource, Parameter, State};

    fn model() -> Model {
        Model::compile(ModelSource {
            name: "two".into(),
            parameters: vec![Parameter::new("p", 0.4), Parameter::new("q", 0.7)],
            states: vec![State::new("x"), State::new("y")],
            equations: vec![Definition::new("x", "p*x - y*q + x*y"), Definition::new("y", "x + sin(p*y)")],
            ..ModelSource::default()
        })
        .unwrap()
    }

    /// f + b d at one state.
    fn value(field: &Unfolded, x: [f64; 2], p: [f64; 3]) -> [f64; 2] {
        let mut f = [0.0; 2];
        field.evaluate(
            Batch { lanes: 1, states: &x, parameters: Parameters::Shared(&p), times: &[], signs: &[] },
            &mut f,
        );
        f
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        const STEP: f64 = 1e-5;
        let model = model();
        let field = Unfolded::new(&model, &[0.8, 2.0]);
        let (x, p) = ([0.3, -0.6], [0.4, 0.7, 0.25]);
        let at = Batch { lanes: 1, states: &x, parameters: Parameters::Shared(&p), times: &[], signs: &[] };
        let (mut f, mut fx, mut fp) = ([0.0; 2], [0.0; 4], [0.0; 4]);
        // b first, then q: the columns come in the order requested.
        field.linearise(at, &[2, 1], &mut f, &mut fx, &mut fp);
        f.iter().zip(value(&field, x, p)).for_each(|(a, b)| assert!((a - b).abs() < 1e-15, "{a} {b}"));
        let directions = [
            [1.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 0.0, 1.0, 0.0],
        ];
        for (d, direction) in directions.iter().enumerate() {
            let moved = |s: f64| {
                let x = [x[0] + s * direction[0], x[1] + s * direction[1]];
                value(&field, x, [p[0] + s * direction[2], p[1] + s * direction[3], p[2] + s * direction[4]])
            };
            let (up, down) = (moved(STEP), moved(-STEP));
            let mut along = [0.0; 2];
            field.directional(at, &[&direction[..]], &mut along);
            for i in 0..2 {
                let slope = (up[i] - down[i]) / (2.0 * STEP);
                let own = if d < 2 { fx[i * 2 + d] } else { fp[i * 2 + d - 2] };
                assert!((slope - along[i]).abs() < 1e-8 && (slope - own).abs() < 1e-8, "{d} {i}: {slope} {own}");
            }
        }
        let (v, w) = ([0.3, -0.2, 0.5, 0.1, 0.7], [-0.4, 0.9, 0.2, -0.3, 0.6]);
        let (mut twice, mut up, mut down) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        field.directional(at, &[&v[..], &w[..]], &mut twice);
        for (sign, out) in [(1.0, &mut up), (-1.0, &mut down)] {
            let s = sign * STEP;
            let (x, p) = ([x[0] + s * w[0], x[1] + s * w[1]], [p[0] + s * w[2], p[1] + s * w[3], p[2] + s * w[4]]);
            let at = Batch { lanes: 1, states: &x, parameters: Parameters::Shared(&p), times: &[], signs: &[] };
            field.directional(at, &[&v[..]], out);
        }
        (0..2).for_each(|i| assert!(((up[i] - down[i]) / (2.0 * STEP) - twice[i]).abs() < 1e-8));
    }
}
