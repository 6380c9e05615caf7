//! Equilibria.
//!
//! **Equations.** u = (x, λ₁ … λ_k):  f(x, λ) = 0, n equations; k = 1 for a curve. Where branches cross, u = (x, b, λ₁
//! … λ_k) and f(x, λ) + b d = 0, with d as in `unfolding`.

use super::Setting;
use super::unfolding::Unfolding;
use crate::contract::{Batch, Examination, Parameters, Singular, ZeroProblem};
use crate::diagram::{Mesh, Point, Solution, Symmetry, Trust};
use crate::linalg::{axpy, dot, larger, lu, max_abs, neutral};
use crate::problem::{averages, extremes};
use crate::stability::eigenvalues;
use num_complex::Complex64;

/// Equilibria in one free parameter (a curve) or several.
pub struct EquilibriumProblem<'a> {
    setting: Setting<'a>,
    unfolding: Option<Unfolding>,
    /// Branch of a switched field; empty for the one in force.
    signs: Vec<f64>,
    scale: Vec<f64>,
    f: Vec<f64>,
    fx: Vec<f64>,
    fp: Vec<f64>,
    matrix: Vec<f64>,
    pivots: Vec<usize>,
}

impl<'a> EquilibriumProblem<'a> {
    /// Equilibria of the given field and free parameters.
    pub fn new(setting: Setting<'a>) -> EquilibriumProblem<'a> {
        let (n, k) = (setting.field.dim(), setting.freedom());
        EquilibriumProblem {
            scale: setting.scales.to_vec(),
            f: vec![0.0; n],
            fx: vec![0.0; n * n],
            fp: vec![0.0; n * k],
            matrix: vec![0.0; (n + k) * (n + k)],
            pivots: vec![0; n + k],
            setting,
            unfolding: None,
            signs: Vec::new(),
        }
    }

    /// Unfolded problem for a crossing of branches, in which the amplitude b counts as the first free parameter.
    pub fn unfolded(setting: Setting<'a>) -> EquilibriumProblem<'a> {
        let (n, k) = (setting.field.dim(), setting.freedom() + 1);
        EquilibriumProblem {
            matrix: vec![0.0; (n + k) * (n + k)],
            pivots: vec![0; n + k],
            unfolding: Some(Unfolding::new(n)),
            ..EquilibriumProblem::new(setting)
        }
    }

    fn n(&self) -> usize {
        self.scale.len()
    }

    /// Index of the first free parameter in u.
    fn first(&self) -> usize {
        self.n() + usize::from(self.unfolding.is_some())
    }

    fn linearise(&mut self, u: &[f64]) {
        let n = self.n();
        let parameters = self.setting.at(&u[self.first()..]);
        let batch = Batch {
            lanes: 1,
            states: &u[..n],
            parameters: Parameters::Shared(&parameters),
            times: &[],
            signs: &self.signs,
        };
        self.setting.linearise(batch, &mut self.f, &mut self.fx, &mut self.fp);
    }
}

impl ZeroProblem for EquilibriumProblem<'_> {
    fn unknowns(&self) -> usize {
        self.first() + self.setting.freedom()
    }

    fn unit(&self) -> f64 {
        self.setting.unit()
    }

    fn anchor(&mut self, u: &[f64]) {
        for (scale, (own, x)) in self.scale.iter_mut().zip(self.setting.scales.iter().zip(u)) {
            *scale = own + x.abs();
        }
        if self.unfolding.is_some() {
            self.linearise(u);
            let (n, parameters) = (self.n(), self.setting.at(&u[self.first()..]));
            let unfolding = self.unfolding.iter_mut();
            unfolding.for_each(|own| own.anchor(&self.setting, &u[..n], &parameters, &self.fx));
        }
    }

    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> bool {
        let n = self.n();
        let parameters = self.setting.at(&u[self.first()..]);
        let batch = Batch {
            lanes: 1,
            states: &u[..n],
            parameters: Parameters::Shared(&parameters),
            times: &[],
            signs: &self.signs,
        };
        self.setting.field.evaluate(batch, &mut r[..n]);
        if let Some(unfolding) = &self.unfolding {
            axpy(u[n], &unfolding.column, &mut r[..n]);
        }
        max_abs(&r[..n]).is_finite()
    }

    fn factorise(&mut self, u: &[f64], rows: &[f64]) -> Result<(), Singular> {
        let (n, k) = (self.n(), self.setting.freedom());
        let (first, size) = (self.first(), self.unknowns());
        self.linearise(u);
        for i in 0..n {
            self.matrix[i * size..i * size + n].copy_from_slice(&self.fx[i * n..(i + 1) * n]);
            if let Some(unfolding) = &self.unfolding {
                self.matrix[i * size + n] = unfolding.column[i];
            }
            self.matrix[i * size + first..(i + 1) * size].copy_from_slice(&self.fp[i * k..(i + 1) * k]);
        }
        for (line, row) in self.matrix[n * size..].chunks_exact_mut(size).zip(rows.chunks_exact(size)) {
            for i in 0..n {
                line[i] = row[i] / (self.scale[i] * self.scale[i] * n as f64);
            }
            // (b and λ are relative quantities.)
            line[n..].copy_from_slice(&row[n..]);
        }
        lu::factorise(&mut self.matrix, size, &mut self.pivots)
    }

    fn solve(&mut self, rhs: &[f64], x: &mut [f64]) {
        x.copy_from_slice(rhs);
        lu::solve(&self.matrix, self.unknowns(), &self.pivots, x, 1);
    }

    fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        let n = self.n();
        let profile: f64 = (0..n).map(|i| a[i] * b[i] / (self.scale[i] * self.scale[i])).sum();
        profile / n as f64 + dot(&a[n..], &b[n..])
    }

    fn relative_size(&self, du: &[f64], u: &[f64]) -> f64 {
        let (n, first) = (self.n(), self.first());
        let states = (0..n).map(|i| (du[i] / (self.setting.scales[i] + u[i].abs())).abs());
        let free = larger(Setting::relative_size(&du[first..], &u[first..]), max_abs(&du[n..first]));
        states.fold(free, larger)
    }

    fn mesh(&self) -> Mesh {
        Mesh::from([])
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
        let n = self.n();
        self.linearise(u);
        let mut spectrum = eigenvalues(&self.fx, n, self.setting.scales);
        // f still changes with the parameters if f_x nearly vanishes.
        let free = self.setting.freedom();
        let by_free =
            (0..self.n() * free).fold(0.0, |most: f64, k| most.max((self.fp[k] / self.scale[k / free]).abs()));
        let unfolded = self.unfolding.as_ref().map_or(f64::MIN_POSITIVE, |own| own.rate);
        let rate = max_abs(&self.fx).max(1e-6 * by_free).max(unfolded).max(f64::MIN_POSITIVE);
        let residual = (0..n).map(|i| (self.f[i] / (rate * self.scale[i])).abs()).fold(0.0, f64::max);
        let pairs = neutral::pairs(&spectrum, neutral::rounding(n, residual));
        if !pairs.is_empty() && self.stay_neutral(u, pairs.len()) {
            neutral::mark(&mut spectrum, &pairs);
        }
        let unstable = spectrum.iter().filter(|z| z.re > 0.0).count();
        let ranges = extremes::of_state(self.setting.field, &self.setting.at(&u[self.first()..]), &u[..n]);
        let averages = averages::of_state(self.setting.field, &self.setting.at(&u[self.first()..]), &u[..n]);
        Examination { spectrum, trivial: 0, unstable, ranges, averages, trust: Trust { residual, ..Trust::default() } }
    }

    fn spectrum_error(&mut self, _u: &[f64], _tangent: &[f64], spectrum: &[Complex64]) -> f64 {
        // Rounding moves two coalescing eigenvalues by its square root.
        let size = spectrum.iter().fold(1.0f64, |most, z| most.max(z.norm()));
        4.0 * f64::EPSILON.sqrt() * size
    }

    /// Each equation is uncertain by the rounding of its terms, about |f_x| |x| + |f_λ| |λ| times the relative accuracy of a
    /// number. The error moves the solution, farther the closer the matrix is to a singular one, and with it the eigenvalue.
    fn blur(&mut self, u: &[f64], tangent: &[f64]) -> f64 {
        let (n, k, first) = (self.n(), self.setting.freedom(), self.first());
        if self.factorise(u, tangent).is_err() {
            return f64::INFINITY;
        }
        let terms = |row: &[f64], x: &[f64]| row.iter().zip(x).map(|(a, b)| (a * b).abs()).sum::<f64>();
        let rounded = (0..n).map(|i| terms(&self.fx[i * n..][..n], u) + terms(&self.fp[i * k..][..k], &u[first..]));
        let rounded: Vec<f64> = rounded.map(|size| f64::EPSILON * size).collect();
        let scales = self.setting.scales;
        let nearest = |fx: &[f64]| {
            eigenvalues(fx, n, scales).into_iter().min_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_default()
        };
        let here = nearest(&self.fx);
        let (mut change, mut worst) = (vec![0.0; u.len()], 0.0f64);
        // The errors are arbitrary; these have no symmetry to which a left null vector could be orthogonal.
        for phase in [1.0, 2.5] {
            let error = |i: usize| rounded.get(i).map_or(0.0, |size| size * (2.4 * i as f64 + phase).cos());
            let mut rhs: Vec<f64> = (0..u.len()).map(error).collect();
            self.solve(&rhs, &mut change);
            axpy(1.0, u, &mut change);
            std::mem::swap(&mut rhs, &mut change);
            self.linearise(&rhs);
            worst = worst.max((nearest(&self.fx) - here).norm());
        }
        worst
    }

    fn margin(&self, at: &Point) -> f64 {
        let sizes = at.spectrum.iter().map(|z| z.norm());
        sizes.clone().fold(f64::INFINITY, f64::min) / sizes.fold(f64::MIN_POSITIVE, f64::max)
    }

    fn point(&self, u: &[f64], tangent: &[f64], examination: Examination) -> Point {
        let n = self.n();
        Point {
            position: 0,
            parameters: self.setting.at(&u[self.first()..]),
            solution: Solution::Equilibrium(u[..n].to_vec()),
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
        let n = self.n();
        [&mut u, &mut tangent].into_iter().for_each(|v| symmetry.apply(&mut v[..n]));
        self.setting.nearest_copy(&mut u[..n], &beside[..n]);
        let off: Vec<f64> = u.iter().zip(beside).map(|(a, b)| a - b).collect();
        if self.dot(&off, &off) <= within * within { vec![[u, tangent]] } else { Vec::new() }
    }

    fn unknowns_of(&mut self, point: &Point) -> Vec<f64> {
        let mut u = match &point.solution {
            Solution::Equilibrium(x) => x.clone(),
            Solution::Cycle(cycle) => cycle.state(0.0),
            Solution::Torus(torus) => torus.state(0.0, 0.0),
        };
        u.resize(self.first(), 0.0);
        u.extend(self.setting.unknowns_of(point));
        u
    }

    fn departure(&self, u: &[f64]) -> f64 {
        max_abs(&u[self.n()..self.first()])
    }

    fn hold_branch(&mut self, u: &[f64], along: &[f64]) -> bool {
        if self.setting.field.switch_count() == 0 || self.unfolding.is_some() {
            return false;
        }
        let [h, rates] = self.switches(u, along);
        let side = |k: usize| if h[k].abs() > ON_SURFACE { h[k] } else { rates[k] };
        // An equilibrium that stays on a surface is on neither side of it.
        if (0..h.len()).any(|k| side(k).abs() <= ON_SURFACE) {
            return false;
        }
        self.signs = (0..h.len()).map(|k| side(k).signum()).collect();
        true
    }

    fn cross(&mut self, u: &[f64], along: &[f64], switch: usize) -> Option<Vec<f64>> {
        /// Surfaces that may meet at one point.
        const MOST: usize = 6;
        let own = self.signs.clone();
        let [h, _] = self.switches(u, along);
        let on = |k: usize| k == switch || h[k].abs() <= ON_SURFACE;
        let surfaces: Vec<usize> = (0..own.len()).filter(|k| on(*k)).collect();
        if own.is_empty() || surfaces.len() > MOST {
            return None;
        }
        // Each branch of f that an equilibrium leads into; where several surfaces meet, that need not be one.
        let mut found: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
        for chosen in 1..1usize << surfaces.len() {
            let flipped = surfaces.iter().enumerate().filter(|(bit, _)| chosen >> bit & 1 == 1);
            self.signs.clone_from(&own);
            flipped.for_each(|(_, k)| self.signs[*k] = -own[*k]);
            let signs = self.signs.clone();
            found.extend(self.tangent_into(u, along, &surfaces).map(|tangent| (signs, tangent)));
        }
        self.signs = own;
        let (signs, tangent) = found.pop().filter(|_| found.is_empty())?;
        self.signs = signs;
        Some(tangent)
    }
}

/// Value of a switch, relative to its size, below which an equilibrium lies on the surface.
const ON_SURFACE: f64 = 1e-9;
/// Residual on the other side of a surface, relative, from which on f jumps there.
const JUMP: f64 = 1e-6;

impl EquilibriumProblem<'_> {
    /// True if at another value of the continuation parameter as many pairs of eigenvalues are neutral.
    fn stay_neutral(&mut self, u: &[f64], count: usize) -> bool {
        /// Change of the parameter: far above rounding, and small enough for Newton's method.
        const BESIDE: f64 = 1e-3;
        /// Newton iterations: the start is off by the square of the change or, without a slope, by the change.
        const ROUNDS: usize = 8;
        let (n, last) = (self.n(), u.len() - 1);
        let found = [BESIDE, -BESIDE].into_iter().any(|change| {
            let mut there = u.to_vec();
            there[last] += change * (1.0 + u[last].abs());
            let mut residual = f64::INFINITY;
            for _ in 0..ROUNDS {
                self.linearise(&there);
                let (mut matrix, mut step, mut pivots) = (self.fx.clone(), self.f.clone(), vec![0; n]);
                if lu::factorise(&mut matrix, n, &mut pivots).is_err() {
                    return false;
                }
                lu::solve(&matrix, n, &pivots, &mut step, 1);
                there.iter_mut().zip(&step).for_each(|(x, dx)| *x -= dx);
                residual = (0..n).map(|i| (step[i] / (self.scale[i] + there[i].abs())).abs()).fold(0.0, f64::max);
                if residual < f64::EPSILON {
                    break;
                }
            }
            self.linearise(&there);
            let spectrum = eigenvalues(&self.fx, n, self.setting.scales);
            neutral::pairs(&spectrum, neutral::rounding(n, residual)).len() >= count
        });
        self.linearise(u);
        found
    }

    /// Switches at `u`: values and rates along a direction, both relative to the change of the switch over the sizes of
    /// the states.
    fn switches(&self, u: &[f64], along: &[f64]) -> [Vec<f64>; 2] {
        let (n, k) = (self.n(), self.setting.freedom());
        let parameters = self.setting.at(&u[n..]);
        let parameters = Parameters::Shared(&parameters);
        let batch = Batch { lanes: 1, states: &u[..n], parameters, times: &[], signs: &[] };
        let [h, hx, hp, _] = self.setting.linearise_switches(batch);
        let (mut values, mut rates) = (Vec::new(), Vec::new());
        for (s, h) in h.iter().enumerate() {
            let (by_state, by_parameter) = (&hx[s * n..(s + 1) * n], &hp[s * k..(s + 1) * k]);
            let changes = by_state.iter().zip(&self.scale).map(|(h, scale)| (h * scale).abs());
            let size = changes.fold(f64::MIN_POSITIVE, f64::max);
            values.push(h / size);
            rates.push((dot(by_state, &along[..n]) + dot(by_parameter, &along[n..])) / size);
        }
        [values, rates]
    }

    /// Unit tangent of the branch for the signs that are set, at a point on some surfaces, if it leads to the sides of
    /// all of them that these signs mean.
    fn tangent_into(&mut self, u: &[f64], along: &[f64], surfaces: &[usize]) -> Option<Vec<f64>> {
        let size = self.unknowns();
        let mut r = vec![0.0; size];
        if !self.residual(u, &mut r) {
            return None;
        }
        let mut by_parameter = vec![0.0; size];
        by_parameter[size - 1] = 1.0;
        for row in [along, &by_parameter] {
            if self.factorise(u, row).is_err() {
                continue;
            }
            let mut last = vec![0.0; size];
            let mut change = r.clone();
            change[size - 1] = 0.0;
            last[size - 1] = 1.0;
            let (mut off, mut tangent) = (vec![0.0; size], vec![0.0; size]);
            self.solve(&change, &mut off);
            let off = self.relative_size(&off, u);
            if off.is_nan() || off >= JUMP {
                return None;
            }
            self.solve(&last, &mut tangent);
            let length = self.dot(&tangent, &tangent).sqrt();
            let [_, rates] = self.switches(u, &tangent);
            let side = |k: &usize| rates[*k] * self.signs[*k];
            let sign = surfaces.first().map_or(1.0, |k| side(k).signum());
            if surfaces.iter().any(|k| side(k) * sign <= 0.0) {
                return None;
            }
            tangent.iter_mut().for_each(|t| *t *= sign / length);
            if tangent.iter().all(|t| t.is_finite()) {
                return Some(tangent);
            }
        }
        None
    }
}
