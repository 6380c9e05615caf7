//! Cycles of maps, fixed points among them.
//!
//! **Idea.** All iterates are unknown. The equations couple neighbours only, and their matrix is as well conditioned as
//! the cycle is hyperbolic, however strongly the map expands: the composed map, whose derivative grows exponentially
//! with the period, is never formed.
//!
//! **Equations.** u = (x_0 … x_{N-1}, λ₁ … λ_k), A_k = f_x(x_k, λ), m whole turns of angles:
//!
//! ```text
//!   (1)  f(x_k, λ) - x_{k+1} = 0,            k = 0 … N-2
//!   (2)  f(x_{N-1}, λ) - x_0 - m = 0
//!   (3)  multipliers: the eigenvalues of A_{N-1} ⋯ A_0, by the periodic Schur form
//! ```
//!
//! A cycle is stored as a [`Cycle`] of degree 0 on N equal intervals, with its period N counted in iterations.
//!
//! **Source.** kuznetsov2004, §4 and §10; bojanczyk1992 (periodic Schur form).
//!
//! **Fails when** the matrix is singular, as at a branch point.

use super::Setting;
use crate::contract::{Batch, Examination, Parameters, Singular, ZeroProblem};
use crate::diagram::{Cycle, Mesh, Point, Solution, Symmetry, Trust};
use crate::linalg::cyclic::{Cyclic, Parts};
use crate::linalg::{dot, larger, max_abs, periodic_schur};
use num_complex::Complex64;

/// Distance of a modulus from 1, in units of the rounding error of a step, within which the multiplier is on the unit
/// circle: those of an area-preserving map stay there.
pub(crate) const ON_CIRCLE: f64 = 64.0;

/// f and its derivatives at all iterates of a cycle.
#[derive(Clone, Debug, Default)]
pub struct Along {
    /// `[N][n]` f.
    pub f: Vec<f64>,
    /// `[N][n × n]` A_k.
    pub blocks: Vec<f64>,
    /// `[N][n × k]` derivatives with respect to the unknowns λ.
    pub by_parameter: Vec<f64>,
}

/// Evaluates f and its derivatives at iterates `[N][n]`, for the free parameters of a setting.
pub fn along(setting: &Setting, iterates: &[f64], parameters: &[f64]) -> Along {
    let (n, k) = (setting.field.dim(), setting.freedom());
    let lanes = iterates.len() / n.max(1);
    let states = transposed(iterates, n);
    let batch = Batch { lanes, states: &states, parameters: Parameters::Shared(parameters), times: &[], signs: &[] };
    let [mut f, mut fx, mut fp] = [n, n * n, n * k].map(|size| vec![0.0; size * lanes]);
    setting.linearise(batch, &mut f, &mut fx, &mut fp);
    let rows = |values: &[f64], size: usize| -> Vec<f64> {
        (0..size * lanes).map(|c| values[(c % size) * lanes + c / size]).collect()
    };
    Along { f: rows(&f, n), blocks: rows(&fx, n * n), by_parameter: if k > 0 { rows(&fp, n * k) } else { Vec::new() } }
}

/// `[N][n]` as `[n][N]`.
pub fn transposed(rows: &[f64], n: usize) -> Vec<f64> {
    let lanes = rows.len() / n.max(1);
    (0..rows.len()).map(|c| rows[(c % lanes) * n + c / lanes]).collect()
}

/// Mesh of a cycle of N iterates.
pub fn mesh_of(count: usize) -> Mesh {
    (0..=count).map(|k| k as f64 / count as f64).collect()
}

/// Cycle through iterates `[N][n]`; `gain` as in [`Cycle::gain`].
pub fn cycle_of(iterates: &[f64], n: usize, gain: &[f64]) -> Cycle {
    let count = iterates.len() / n.max(1);
    Cycle {
        points: crate::problem::gauss::Points::Gauss,
        period: count as f64,
        forcing_periods: count as u32,
        mesh: mesh_of(count),
        degree: 0,
        profile: iterates.to_vec(),
        gain: gain.to_vec(),
    }
}

/// Cycles of a map with a given number of iterates.
pub struct MapProblem<'a> {
    setting: Setting<'a>,
    count: usize,
    gain: Vec<f64>,
    /// `[n]` size of each state along the reference cycle.
    scale: Vec<f64>,
    /// At the last linearisation.
    last: Along,
    /// The last factorisation.
    system: Cyclic,
}

impl<'a> MapProblem<'a> {
    /// Cycles like the given solution: as many iterates, and as many turns of angles.
    pub fn like(setting: Setting<'a>, solution: &Solution) -> MapProblem<'a> {
        let (count, gain) = match solution {
            Solution::Cycle(cycle) => (cycle.forcing_periods.max(1) as usize, cycle.gain.clone()),
            Solution::Equilibrium(_) | Solution::Torus(_) => (1, Vec::new()),
        };
        let (scale, last, system) = (setting.scales.to_vec(), Along::default(), Cyclic::default());
        MapProblem { setting, count, gain, scale, last, system }
    }

    fn n(&self) -> usize {
        self.scale.len()
    }

    fn size(&self) -> usize {
        self.count * self.n()
    }

    fn evaluated(&self, u: &[f64]) -> Vec<f64> {
        let n = self.n();
        let parameters = self.setting.at(&u[self.size()..]);
        let states = transposed(&u[..self.size()], n);
        let (lanes, parameters) = (self.count, Parameters::Shared(&parameters));
        let batch = Batch { lanes, states: &states, parameters, times: &[], signs: &[] };
        let mut f = vec![0.0; n * lanes];
        self.setting.field.evaluate(batch, &mut f);
        (0..n * lanes).map(|c| f[(c % n) * lanes + c / n]).collect()
    }

    /// (1) and (2), given f.
    fn misses(&self, f: &[f64], u: &[f64], r: &mut [f64]) {
        let (n, size) = (self.n(), self.size());
        for c in 0..size {
            r[c] = f[c] - u[(c + n) % size];
        }
        self.gain.iter().enumerate().for_each(|(i, gain)| r[size - n + i] -= gain);
    }

    fn linearise(&mut self, u: &[f64]) {
        let parameters = self.setting.at(&u[self.size()..]);
        self.last = along(&self.setting, &u[..self.size()], &parameters);
    }

    /// A_k in scaled states.
    fn scaled_blocks(&self) -> Vec<f64> {
        let (n, scale) = (self.n(), &self.scale);
        let entry = |(c, a): (usize, &f64)| a * scale[c % n] / scale[c / n % n];
        self.last.blocks.iter().enumerate().map(entry).collect()
    }

    fn multipliers(&self) -> (Vec<Complex64>, usize) {
        let n = self.n();
        let circle = ON_CIRCLE * f64::EPSILON * self.count as f64;
        match periodic_schur::eigenvalues(&self.scaled_blocks(), n) {
            Some(found) => {
                let unstable = found.iter().filter(|e| e.log_modulus > circle).count();
                (found.into_iter().map(|e| e.value()).collect(), unstable)
            }
            None => (vec![Complex64::new(f64::NAN, f64::NAN); n], 0),
        }
    }

    /// States and outputs at every iterate.
    fn values(&self, u: &[f64]) -> Vec<Vec<f64>> {
        let (n, outputs) = (self.n(), self.setting.field.output_count());
        let parameters = self.setting.at(&u[self.size()..]);
        let states = transposed(&u[..self.size()], n);
        let (lanes, parameters) = (self.count, Parameters::Shared(&parameters));
        let mut out = vec![0.0; outputs * lanes];
        self.setting.field.outputs(Batch { lanes, states: &states, parameters, times: &[], signs: &[] }, &mut out);
        states.chunks_exact(lanes).chain(out.chunks_exact(lanes)).map(<[f64]>::to_vec).collect()
    }

    /// Copy of a vector that begins `shift` iterates later; `turned` if it is a solution, whose angles gain.
    fn shifted(&self, v: &[f64], shift: usize, turned: bool) -> Vec<f64> {
        let (n, size) = (self.n(), self.size());
        let mut out = v.to_vec();
        for c in 0..size {
            let from = c + shift * n;
            out[c] = v[from % size];
            if turned && from >= size {
                out[c] += self.gain.get(c % n).copied().unwrap_or(0.0);
            }
        }
        out
    }
}

impl ZeroProblem for MapProblem<'_> {
    fn unknowns(&self) -> usize {
        self.size() + self.setting.freedom()
    }

    fn unit(&self) -> f64 {
        self.setting.unit()
    }

    fn anchor(&mut self, u: &[f64]) {
        let n = self.n();
        for i in 0..n {
            let largest = u[i..self.count * n].iter().step_by(n).fold(0.0, |most: f64, x| larger(most, x.abs()));
            self.scale[i] = self.setting.scales[i] + largest;
        }
    }

    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> bool {
        let f = self.evaluated(u);
        self.misses(&f, u, r);
        max_abs(&r[..self.size()]).is_finite()
    }

    fn factorise(&mut self, u: &[f64], rows: &[f64]) -> Result<(), Singular> {
        self.linearise(u);
        let (n, k, size) = (self.n(), self.setting.freedom(), self.size());
        let (blocks, scale) = (self.scaled_blocks(), &self.scale);
        let columns: Vec<f64> = self.last.by_parameter.iter().enumerate().map(|(c, g)| g / scale[c / k % n]).collect();
        // The rows act through the inner product, which measures states in their scales.
        let weight = |c: usize| if c < size { 1.0 / (scale[c % n] * size as f64) } else { 1.0 };
        let border: Vec<f64> = rows.iter().enumerate().map(|(at, row)| row * weight(at % (size + k))).collect();
        let closure: Vec<f64> = (0..n * n).map(|c| if c % (n + 1) == 0 { 1.0 } else { 0.0 }).collect();
        let parts = Parts { shape: [n, k], blocks: &blocks, closure: &closure, columns: &columns, border: &border };
        self.system = Cyclic::new(parts)?;
        Ok(())
    }

    fn solve(&mut self, rhs: &[f64], x: &mut [f64]) {
        let (n, size) = (self.n(), self.size());
        let scaled: Vec<f64> =
            rhs.iter().enumerate().map(|(c, r)| if c < size { r / self.scale[c % n] } else { *r }).collect();
        x.copy_from_slice(&self.system.solve(&scaled));
        (0..size).for_each(|c| x[c] *= self.scale[c % n]);
    }

    fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        let (n, size) = (self.n(), self.size());
        let states: f64 = (0..size).map(|c| a[c] * b[c] / (self.scale[c % n] * self.scale[c % n])).sum();
        states / size as f64 + dot(&a[size..], &b[size..])
    }

    fn relative_size(&self, du: &[f64], u: &[f64]) -> f64 {
        let (n, size) = (self.n(), self.size());
        let of = |i: usize| {
            let largest = |v: &[f64]| v[i..size].iter().step_by(n).fold(0.0, |most: f64, x| larger(most, x.abs()));
            largest(du) / (self.setting.scales[i] + largest(u))
        };
        (0..n).map(of).fold(Setting::relative_size(&du[size..], &u[size..]), larger)
    }

    fn mesh(&self) -> Mesh {
        Mesh::from([])
    }

    fn has_multipliers(&self) -> bool {
        true
    }

    fn set_mesh(&mut self, _mesh: &Mesh) {}

    fn transfer(&self, v: &[f64], _from: &Mesh, _to: &Mesh) -> Vec<f64> {
        v.to_vec()
    }

    fn better_mesh(&self, _u: &[f64], _tolerance: f64) -> Option<Mesh> {
        None
    }

    fn finer_mesh(&self) -> Option<Mesh> {
        None
    }

    fn examine(&mut self, u: &[f64]) -> Examination {
        self.linearise(u);
        let (n, size) = (self.n(), self.size());
        let (spectrum, unstable) = self.multipliers();
        let mut r = vec![0.0; size];
        self.misses(&self.last.f, u, &mut r);
        let residual = (0..size).fold(0.0, |most: f64, c| larger(most, (r[c] / self.scale[c % n]).abs()));
        let values = self.values(u);
        let range = |own: &Vec<f64>| {
            own.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [x.min(low), x.max(high)])
        };
        let mean = |own: &Vec<f64>, power: i32| own.iter().map(|x| x.powi(power)).sum::<f64>() / own.len() as f64;
        let averages = values.iter().map(|own| [mean(own, 1), mean(own, 2)]).collect();
        let ranges = values.iter().map(range).collect();
        Examination { spectrum, trivial: 0, unstable, ranges, averages, trust: Trust { residual, ..Trust::default() } }
    }

    fn spectrum_error(&mut self, _u: &[f64], _tangent: &[f64], spectrum: &[Complex64]) -> f64 {
        // Rounding of every step; it moves two coalescing multipliers by its square root.
        let size = spectrum.iter().fold(1.0f64, |most, z| most.max(z.norm()));
        4.0 * (self.count as f64 * f64::EPSILON).sqrt() * size
    }

    fn margin(&self, at: &Point) -> f64 {
        at.free_spectrum().iter().map(|z| (z - 1.0).norm()).fold(f64::INFINITY, f64::min)
    }

    fn point(&self, u: &[f64], tangent: &[f64], examination: Examination) -> Point {
        let size = self.size();
        Point {
            position: 0,
            parameters: self.setting.at(&u[size..]),
            solution: Solution::Cycle(cycle_of(&u[..size], self.n(), &self.gain)),
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
        let [mut u, mut tangent] = [self.unknowns_of(point), point.tangent.clone()];
        if [u.len(), tangent.len()] != [beside.len(); 2] {
            return Vec::new();
        }
        let (n, size) = (self.n(), self.size());
        [&mut u, &mut tangent].into_iter().for_each(|v| symmetry.apply(&mut v[..size]));
        let mut found = Vec::new();
        for shift in 0..self.count {
            let mut copy = self.shifted(&u, shift, true);
            self.setting.nearest_copy(&mut copy[..size], &beside[..n]);
            let off: Vec<f64> = copy.iter().zip(beside).map(|(a, b)| a - b).collect();
            if self.dot(&off, &off) <= within * within {
                found.push([copy, self.shifted(&tangent, shift, false)]);
            }
        }
        found
    }

    fn unknowns_of(&mut self, point: &Point) -> Vec<f64> {
        let mut u = match &point.solution {
            Solution::Cycle(cycle) => cycle.profile.clone(),
            Solution::Equilibrium(x) => x.iter().copied().cycle().take(self.size()).collect(),
            Solution::Torus(_) => vec![f64::NAN; self.size()],
        };
        u.extend(self.setting.unknowns_of(point));
        u
    }
}
