//! Defining system of branch points of equilibria in two parameters.
//!
//! **Idea.** Where branches over λ cross, the matrix of f_x and f_λ has two right null vectors and a left one. Bordered
//! by approximations of these it is regular, and its border components vanish exactly at a branch point.
//!
//! **Equations.** With B = [f_x f_λ] `[n × (n + 1)]`, a column d, and two rows C:
//!
//! ```text
//!   (1)  [ wᵀ  g₁  g₂ ] [ B  d ]  =  [ 0 … 0  1 ]
//!                       [ C  0 ]
//!
//!   (2)  dg_k = -wᵀ (dB) v_k   with   [ B  d ] [ v_k ]  =  [ 0   ]
//!                                     [ C  0 ] [  ·  ]     [ e_k ]
//! ```
//!
//! λ is a direction in the plane of the two parameters: across the curve, initially that of the branch. A curve along
//! which branches cross is not generic; the model must force it by a symmetry or an invariant solution. The system is
//! therefore posed for f(x, λ) + b d, which always has such a curve, as in `equilibrium`; while the amplitude b stays 0
//! it is a curve of branch points of f, whatever the direction of λ.
//!
//! Without an unfolding, and with m directions λ among m + 2 parameters, (1) has m + 1 border rows and components:
//!
//! ```text
//!   (3)  wᵀ [ f_x  f_λ1 … f_λm ] = 0,   m + 1 scalar equations g = 0
//! ```
//!
//! Where f(x, λ, p, q) = 0 defines p as a function on its zero set for given q, these are the points at which p is stationary
//! over x and all λ: w is the multiplier of Lagrange. They form a curve over q.
//!
//! **Source.** govaerts2000, §3 (bordered matrices) and §6 (branch points); allgower1990, §8.
//!
//! **Departures.** One null vector of f_x alone with ⟨w, f_λ⟩ would suffice except at double eigenvalues 0, where a
//! curve of folds that shares the null vector begins. d, C and λ are updated at every accepted point.

use crate::contract::{Batch, Condition, Parameters};
use crate::diagram::{Kind, Mesh, Point};
use crate::linalg::{axpy, dot, lu, max_abs};
use crate::problem::Setting;
use num_complex::Complex64;

/// Branch-point condition for equilibria.
pub struct OnBranchPoints<'a> {
    setting: Setting<'a>,
    n: usize,
    /// Number of unknowns before the free parameters: the states, and the amplitude of the unfolding.
    before: usize,
    /// `[m]` directions λ in the free parameters.
    across: Vec<Vec<f64>>,
    /// d `[n]` and C `[m + 1][n + m]`.
    left: Vec<f64>,
    right: Vec<f64>,
    /// w `[n]` and the v `[m + 1][n + m]` of the last evaluation.
    adjoint: Vec<f64>,
    null: Vec<f64>,
    state: Vec<f64>,
    parameters: Vec<f64>,
}

impl<'a> OnBranchPoints<'a> {
    /// Creates the condition in a setting with two free parameters.
    pub fn new(setting: Setting<'a>) -> OnBranchPoints<'a> {
        let across = vec![unit(setting.freedom(), 0)];
        let before = setting.field.dim() + 1;
        OnBranchPoints::across(setting, before, across)
    }

    /// Creates the condition for points at which branches over all free parameters but the first and the last are singular,
    /// without an unfolding: they form a curve.
    pub fn in_further_parameters(setting: Setting<'a>) -> OnBranchPoints<'a> {
        let (before, k) = (setting.field.dim(), setting.freedom());
        OnBranchPoints::across(setting, before, (1..k - 1).map(|own| unit(k, own)).collect())
    }

    fn across(setting: Setting<'a>, before: usize, across: Vec<Vec<f64>>) -> OnBranchPoints<'a> {
        let (n, scales, m) = (setting.field.dim(), setting.scales, across.len());
        let scale = |i: usize| scales.get(i).copied().unwrap_or(1.0);
        OnBranchPoints {
            n,
            before,
            across,
            setting,
            left: (0..n).map(|k| scale(k) * (0.4 + (k as f64 * 1.3).sin())).collect(),
            right: (0..(m + 1) * (n + m)).map(|k| (0.5 + (k as f64 * 1.7).cos()) / scale(k % (n + m))).collect(),
            adjoint: Vec::new(),
            null: Vec::new(),
            state: Vec::new(),
            parameters: Vec::new(),
        }
    }

    /// Length of the vectors v.
    fn width(&self) -> usize {
        self.n + self.across.len()
    }

    fn batch(&self) -> Batch<'_> {
        Batch {
            lanes: 1,
            states: &self.state,
            parameters: Parameters::Shared(&self.parameters),
            times: &[],
            signs: &[],
        }
    }

    /// Converts a vector `[n + m]` to a direction in states and parameters.
    fn spread(&self, v: &[f64]) -> Vec<f64> {
        let mut change = vec![0.0; self.setting.freedom()];
        self.across.iter().zip(&v[self.n..]).for_each(|(own, by)| axpy(*by, own, &mut change));
        [&v[..self.n], &self.setting.spread(&change)].concat()
    }

    fn evaluated(&mut self, u: &[f64], g: &mut [f64]) -> Option<()> {
        let (n, m, width) = (self.n, self.across.len(), self.width());
        let size = width + 1;
        self.state = u[..n].to_vec();
        self.parameters = self.setting.at(&u[self.before..]);
        let k = self.setting.freedom();
        let (mut f, mut fx, mut fp) = (vec![0.0; n], vec![0.0; n * n], vec![0.0; k * n]);
        self.setting.linearise(self.batch(), &mut f, &mut fx, &mut fp);
        let mut matrix = vec![0.0; size * size];
        for i in 0..n {
            matrix[i * size..i * size + n].copy_from_slice(&fx[i * n..(i + 1) * n]);
            for (c, own) in self.across.iter().enumerate() {
                matrix[i * size + n + c] = dot(&fp[k * i..k * (i + 1)], own);
            }
            matrix[i * size + width] = self.left[i];
        }
        for (k, row) in self.right.chunks_exact(width).enumerate() {
            matrix[(n + k) * size..(n + k) * size + width].copy_from_slice(row);
        }
        let mut pivots = vec![0; size];
        lu::factorise(&mut matrix, size, &mut pivots).ok()?;
        self.adjoint = unit(size, width);
        lu::solve_transposed(&matrix, size, &pivots, &mut self.adjoint);
        g.copy_from_slice(&self.adjoint[n..]);
        self.adjoint.truncate(n);
        self.null = Vec::new();
        for k in 0..=m {
            let mut v = unit(size, n + k);
            lu::solve(&matrix, size, &pivots, &mut v, 1);
            self.null.extend(&v[..width]);
        }
        (max_abs(&self.null).is_finite() && max_abs(&self.adjoint).is_finite()).then_some(())
    }
}

/// Unit vector of that length and index.
fn unit(length: usize, index: usize) -> Vec<f64> {
    let mut one = vec![0.0; length];
    one[index] = 1.0;
    one
}

impl Condition for OnBranchPoints<'_> {
    fn kind(&self) -> Kind {
        Kind::BranchPoint
    }

    fn extra(&self) -> usize {
        0
    }

    fn equations(&self) -> usize {
        self.across.len() + 1
    }

    fn guess(&self, _point: &Point) -> Vec<f64> {
        Vec::new()
    }

    fn face(&mut self, along: &[f64]) {
        // Beyond two parameters the bifurcations are no curve, or λ is given.
        let [a, b] = match along.get(self.before..) {
            Some([a, b]) => [*a, *b],
            _ => return,
        };
        let length = a.hypot(b);
        if length > 0.0 {
            // The null vectors belong to the previous λ.
            self.across = vec![vec![-b / length, a / length]];
        }
    }

    fn anchor(&mut self) {
        if self.null.is_empty() {
            return;
        }
        // In scaled components; λ is scaled by its direction.
        let scale = |i: usize| self.setting.scales.get(i).copied().unwrap_or(1.0);
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for v in self.null.chunks_exact(self.width()) {
            let mut v: Vec<f64> = v.iter().enumerate().map(|(i, x)| x / scale(i)).collect();
            rows.iter().for_each(|other| axpy(-dot(&v, other), other, &mut v));
            let norm = dot(&v, &v).sqrt();
            v.iter_mut().for_each(|x| *x /= norm);
            rows.push(v);
        }
        let norm = self.adjoint.iter().enumerate().map(|(i, w)| (w * scale(i)).powi(2)).sum::<f64>().sqrt();
        let (rows, left) = (rows.concat(), self.adjoint.iter().map(|w| w / norm).collect::<Vec<f64>>());
        if max_abs(&rows).is_finite() && max_abs(&left).is_finite() {
            let width = self.width();
            self.right = rows.iter().enumerate().map(|(k, x)| x / scale(k % width)).collect();
            // The range of f is scaled like the states.
            self.left = left.iter().enumerate().map(|(i, w)| w * scale(i) * scale(i)).collect();
        }
    }

    fn set_mesh(&mut self, _mesh: &Mesh) {}

    fn evaluate(&mut self, u: &[f64], _extra: &[f64], g: &mut [f64]) -> bool {
        if self.evaluated(u, g).is_none() {
            self.null.clear();
            return false;
        }
        true
    }

    fn derivative(&mut self, du: &[f64], _extra: &[f64], dg: &mut [f64]) {
        let n = self.n;
        let width = self.width();
        let direction = [&du[..n], &self.setting.spread(&du[self.before..])].concat();
        for (value, v) in dg.iter_mut().zip(self.null.chunks_exact(width)) {
            let mut change = vec![0.0; n];
            self.setting.field.directional(self.batch(), &[&self.spread(v), &direction], &mut change);
            *value = -dot(&self.adjoint, &change);
        }
    }

    fn held(&self, _extra: &[f64]) -> Vec<Complex64> {
        vec![Complex64::new(0.0, 0.0)]
    }

    fn distance(&self, z: Complex64) -> f64 {
        z.norm()
    }
}
