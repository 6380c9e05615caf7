//! Defining systems of folds, period doublings and torus points of cycles of maps.
//!
//! **Idea.** At each of these points the linearised map along the cycle has a null vector if the multiplier κ is imposed
//! (`map_operator`): κ = 1 at a fold, -1 at a period doubling and e^{iθ} at a torus point (Neimark–Sacker), with the
//! unknown angle θ. The border component g, which vanishes there, is the condition.
//!
//! **Equations.** (1) and (2) of `map_operator`, with B = f_xx and the direction (dx, dλ, dθ):
//!
//! ```text
//!   (1)  dg = -wᴴ (dL) v,   (dL v)_k = B(v_k, dx_k) + f_xλ v_k dλ - [k = N-1] dκ v_0
//! ```
//!
//! **Source.** govaerts2000, §3 and §4.

use super::map_operator::{Borders, Null, Orbit, hermitian};
use crate::contract::Condition;
use crate::diagram::{Kind, Mesh, Point, Solution};
use crate::problem::Setting;
use num_complex::Complex64;

/// Condition for a fold, period doubling or torus point of cycles of a map.
pub struct OnMaps<'a> {
    setting: Setting<'a>,
    kind: Kind,
    n: usize,
    count: usize,
    borders: Borders,
    /// At the last evaluation: iterates, parameters, θ and null vectors.
    iterates: Vec<f64>,
    parameters: Vec<f64>,
    angle: f64,
    null: Option<Null>,
}

impl<'a> OnMaps<'a> {
    /// Creates the condition of the given kind for cycles like `at`; `None` for kinds that they do not have.
    pub fn new(kind: Kind, setting: Setting<'a>, at: &Solution) -> Option<OnMaps<'a>> {
        let Solution::Cycle(cycle) = at else { return None };
        if !matches!(kind, Kind::Fold | Kind::PeriodDoubling | Kind::Torus) {
            return None;
        }
        let (n, count) = (setting.field.dim(), cycle.forcing_periods.max(1) as usize);
        let borders = Borders::generic(n * count);
        let (iterates, parameters) = (Vec::new(), Vec::new());
        Some(OnMaps { setting, kind, n, count, borders, iterates, parameters, angle: 0.0, null: None })
    }

    fn kappa(&self, extra: &[f64]) -> Complex64 {
        match self.kind {
            Kind::Fold => 1.0.into(),
            Kind::PeriodDoubling => (-1.0).into(),
            _ => Complex64::cis(extra.first().copied().unwrap_or(0.0)),
        }
    }

    fn is_complex(&self) -> bool {
        self.kind == Kind::Torus
    }
}

impl Condition for OnMaps<'_> {
    fn kind(&self) -> Kind {
        self.kind
    }

    fn extra(&self) -> usize {
        usize::from(self.is_complex())
    }

    fn guess(&self, point: &Point) -> Vec<f64> {
        let complex = point.free_spectrum().iter().filter(|z| z.im > 0.0);
        let nearest = complex.min_by(|a, b| a.norm().ln().abs().total_cmp(&b.norm().ln().abs()));
        (0..self.extra()).map(|_| nearest.map_or(1.0, |z| z.arg())).collect()
    }

    fn anchor(&mut self) {
        let mut borders = self.null.as_ref().and_then(Borders::of);
        if !self.is_complex() {
            // Real null vectors: rounding must not add an imaginary part.
            for x in borders.iter_mut().flat_map(|own| [&mut own.left, &mut own.right]) {
                x.iter_mut().for_each(|z| z.im = 0.0);
            }
        }
        self.borders = borders.unwrap_or_else(|| self.borders.clone());
    }

    fn set_mesh(&mut self, _mesh: &Mesh) {}

    fn evaluate(&mut self, u: &[f64], extra: &[f64], g: &mut [f64]) -> bool {
        let size = self.n * self.count;
        if !self.is_complex() {
            self.borders.left.iter_mut().chain(&mut self.borders.right).for_each(|z| z.im = 0.0);
        }
        self.iterates = u[..size].to_vec();
        self.parameters = self.setting.at(&u[size..]);
        self.angle = extra.first().copied().unwrap_or(0.0);
        let orbit = Orbit::new(&self.setting, &self.iterates, &self.parameters);
        self.null = orbit.null(self.kappa(extra), &self.borders);
        let Some(null) = &self.null else { return false };
        g.iter_mut().zip([null.g.re, null.g.im]).for_each(|(g, own)| *g = own);
        true
    }

    fn derivative(&mut self, du: &[f64], extra: &[f64], dg: &mut [f64]) {
        let Some(null) = &self.null else { return dg.fill(f64::NAN) };
        let (n, size) = (self.n, self.n * self.count);
        let orbit = Orbit::new(&self.setting, &self.iterates, &self.parameters);
        let dx: Vec<f64> = (0..size).map(|c| du[c] / self.setting.scales[c % n]).collect();
        let moves = self.setting.spread(&du[size..]);
        let part = |of: fn(&Complex64) -> f64| -> Vec<f64> {
            let v: Vec<f64> = null.v.iter().map(of).collect();
            if v.iter().all(|x| *x == 0.0) { v } else { orbit.derivative(&[&v, &dx], Some(&moves)) }
        };
        let (re, im) = (part(|z| z.re), part(|z| z.im));
        let mut change: Vec<Complex64> = re.into_iter().zip(im).map(|(re, im)| Complex64::new(re, im)).collect();
        if let Some(turn) = extra.first() {
            let dk = Complex64::i() * Complex64::cis(self.angle) * turn;
            (0..n).for_each(|i| change[size - n + i] -= dk * null.v[i]);
        }
        let value = -hermitian(&null.w, &change);
        dg.iter_mut().zip([value.re, value.im]).for_each(|(g, own)| *g = own);
    }

    fn null_direction(&self) -> Option<Vec<f64>> {
        let null = self.null.as_ref().filter(|_| self.kind == Kind::Fold)?;
        let scales = self.setting.scales;
        let v = null.v.iter().enumerate().map(|(c, z)| z.re * scales[c % self.n]);
        Some(v.chain([0.0; 2]).collect())
    }

    fn held(&self, extra: &[f64]) -> Vec<Complex64> {
        let z = self.kappa(extra);
        if self.is_complex() { vec![z, z.conj()] } else { vec![z] }
    }

    fn distance(&self, z: Complex64) -> f64 {
        match self.kind {
            Kind::Fold => (z - 1.0).norm(),
            Kind::PeriodDoubling => (z + 1.0).norm(),
            _ if z.im == 0.0 => f64::INFINITY,
            _ => z.norm().ln().abs(),
        }
    }
}
