//! Defining systems of folds and branch points of boundary-value problems, and of folds of tori.
//!
//! **Idea.** λ is a direction in the plane of the two parameters, across the curve. At a fold the tangent of the branch
//! over λ has no component along λ. Where branches over λ cross, the equations have two tangents, and a left null vector;
//! an unfolding term, with an amplitude b as a further unknown ([`super::unfolded`]), makes them regular, and two
//! independent solutions of the linearised equations have no component along b exactly there.
//!
//! **Equations.** With F the equations of the surface, linearised along the solution, and rows C:
//!
//! ```text
//!   fold          (1)  F_u v + F_λ g = 0,                       ⟨c, (v, g)⟩ = 1
//!   branch point  (2)  F_u v_k + F_λ ℓ_k + F_b g_k = 0,         ⟨c_j, (v_k, ℓ_k, g_k)⟩ = δ_jk,   k = 1, 2
//! ```
//!
//! The unknowns u contain the parameters that the conditions determine. (1) and (2) are the matrix of the surface with
//! another row, which holds the direction along the curve.
//!
//! **Source.** govaerts2000, §3 and §4 (bordered matrices, folds), §6 (branch points).
//!
//! **Departures.** C and λ are updated at every accepted point. Derivatives of g are central differences: the second
//! derivatives of the conditions of a boundary-value problem and of the rotation of a torus are not available. They only guide Newton's method, and g itself is computed to rounding.

use crate::contract::{Condition, ZeroProblem};
use crate::diagram::{Cycle, Kind, Mesh, Point, Torus};
use crate::linalg::{axpy, max_abs};
use crate::problem::Setting;
use crate::problem::cycle::CycleProblem;
use crate::problem::torus::TorusProblem;
use num_complex::Complex64;

/// Relative size of the steps of differences: the cube root of the relative rounding error of g, up to a factor of order
/// 1, balances truncation and rounding.
const STEP: f64 = 2e-5;

/// Condition for folds or branch points of boundary-value problems, or for folds of tori.
pub struct OnTangents<'a> {
    problem: Box<dyn ZeroProblem + 'a>,
    kind: Kind,
    /// Position of b, counted from the last unknown.
    amplitude: usize,
    /// Direction of λ in the two free parameters.
    across: [f64; 2],
    /// C, `[1 or 2][unknowns]`.
    rows: Vec<f64>,
    /// v of the last evaluation, laid out like C.
    null: Vec<f64>,
    at: Vec<f64>,
}

impl<'a> OnTangents<'a> {
    /// Creates the condition on the mesh of `arc`; `None` for kinds that boundary-value problems do not have. For branch
    /// points the first free parameter of the setting is the amplitude of the unfolding.
    pub fn new(kind: Kind, setting: Setting<'a>, arc: &Cycle) -> Option<OnTangents<'a>> {
        if !matches!(kind, Kind::Fold | Kind::BranchPoint) {
            return None;
        }
        let problem = CycleProblem::like(setting, arc);
        let amplitude = problem.unknowns() - problem.profile_size() - 1;
        Some(OnTangents::on(Box::new(problem), kind, amplitude))
    }

    /// Creates the condition for folds of tori, in the phases and on the mesh of `torus`.
    pub fn of_tori(setting: Setting<'a>, torus: &Torus) -> OnTangents<'a> {
        OnTangents::on(Box::new(TorusProblem::like(setting, torus, None)), Kind::Fold, 0)
    }

    fn on(problem: Box<dyn ZeroProblem + 'a>, kind: Kind, amplitude: usize) -> OnTangents<'a> {
        let (across, rows, null, at) = ([1.0, 0.0], Vec::new(), Vec::new(), Vec::new());
        OnTangents { problem, kind, amplitude, across, rows, null, at }
    }

    /// Number of tangents.
    fn count(&self) -> usize {
        if self.kind == Kind::Fold { 1 } else { 2 }
    }

    /// Tangents (1) or (2), and the components g.
    fn tangents(&mut self, u: &[f64], g: &mut [f64]) -> Option<Vec<f64>> {
        let (size, count) = (self.problem.unknowns(), self.count());
        if self.rows.len() != count * size {
            // Any rows serve at first unless they are orthogonal to the tangents.
            let wave = |k: usize| 0.6 + (k as f64 * 0.0113).sin() + 0.7 * (k as f64 * 1.37).cos();
            self.rows = (0..count * size).map(wave).collect();
        }
        let mut along = vec![0.0; size];
        (along[size - 2], along[size - 1]) = (-self.across[1], self.across[0]);
        self.problem.factorise(u, &[&self.rows[..], &along].concat()).ok()?;
        let first = size - count - 1;
        let mut all = vec![0.0; count * size];
        for (k, v) in all.chunks_exact_mut(size).enumerate() {
            let mut one = vec![0.0; size];
            one[first + k] = 1.0;
            self.problem.solve(&one, v);
            g[k] = match self.kind {
                Kind::Fold => self.across[0] * v[size - 2] + self.across[1] * v[size - 1],
                _ => v[size - self.amplitude],
            };
        }
        (max_abs(&all).is_finite() && g.iter().all(|g| g.is_finite())).then_some(all)
    }
}

impl Condition for OnTangents<'_> {
    fn kind(&self) -> Kind {
        self.kind
    }

    fn extra(&self) -> usize {
        0
    }

    fn equations(&self) -> usize {
        self.count()
    }

    fn guess(&self, _point: &Point) -> Vec<f64> {
        Vec::new()
    }

    fn face(&mut self, along: &[f64]) {
        let [.., a, b] = along else { return };
        let length = a.hypot(*b);
        if length > 0.0 {
            self.across = [-b / length, a / length];
        }
    }

    fn anchor(&mut self) {
        if self.null.is_empty() {
            return;
        }
        self.problem.anchor(&self.at);
        let size = self.problem.unknowns();
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for v in self.null.chunks_exact(size) {
            let mut v = v.to_vec();
            for other in &rows {
                axpy(-self.problem.dot(other, &v), other, &mut v);
            }
            let norm = self.problem.dot(&v, &v).sqrt();
            v.iter_mut().for_each(|x| *x /= norm);
            rows.push(v);
        }
        let rows = rows.concat();
        if max_abs(&rows).is_finite() {
            self.rows = rows;
        }
    }

    fn set_mesh(&mut self, mesh: &Mesh) {
        let from = self.problem.mesh();
        if *mesh == from {
            return;
        }
        let size = self.problem.unknowns();
        self.rows = self.rows.chunks_exact(size).flat_map(|row| self.problem.transfer(row, &from, mesh)).collect();
        self.problem.set_mesh(mesh);
        // These tangents belong to another mesh.
        self.null.clear();
    }

    fn evaluate(&mut self, u: &[f64], _extra: &[f64], g: &mut [f64]) -> bool {
        self.at = u.to_vec();
        self.null = self.tangents(u, g).unwrap_or_default();
        !self.null.is_empty()
    }

    fn derivative(&mut self, du: &[f64], _extra: &[f64], dg: &mut [f64]) {
        let u = self.at.clone();
        let along = self.problem.relative_size(du, &u);
        if along == 0.0 {
            return dg.fill(0.0);
        }
        let step = STEP / along;
        let mut ends = [vec![0.0; dg.len()], vec![0.0; dg.len()]];
        for (end, sign) in ends.iter_mut().zip([-1.0, 1.0]) {
            let moved: Vec<f64> = u.iter().zip(du).map(|(x, d)| x + sign * step * d).collect();
            if self.tangents(&moved, end).is_none() {
                return dg.fill(f64::NAN);
            }
        }
        dg.iter_mut().enumerate().for_each(|(i, d)| *d = (ends[1][i] - ends[0][i]) / (2.0 * step));
    }

    fn null_direction(&self) -> Option<Vec<f64>> {
        (self.kind == Kind::Fold && !self.null.is_empty()).then(|| self.null.clone())
    }

    fn held(&self, _extra: &[f64]) -> Vec<Complex64> {
        vec![Complex64::new(1.0, 0.0)]
    }

    fn distance(&self, z: Complex64) -> f64 {
        (z - 1.0).norm()
    }
}
