//! Defining systems of folds and Hopf points of equilibria.
//!
//! **Idea.** At each of these points an operator L has a null space, of dimension one at a fold and two at a Hopf
//! point. There L is real and does not distinguish a pair ±iω of eigenvalues from a real pair ±λ. Bordered by
//! approximate null vectors L is regular, and the border components must vanish.
//!
//! **Equations.** With A = f_x, null vector v, borders b and c of one or two columns:
//!
//! ```text
//!   fold   (1)  L = A
//!   Hopf   (2)  L = A² + κ                                          κ = ω², the extra unknown
//!
//!   (3)  [ L   b ] [ v ]   [ 0  ]
//!        [ cᵀ  0 ] [ g ] = [ e₁ ],      dg_k = -w_kᵀ (dL) v   with   [ w_k ] the solution for e_k of the transposed
//! ```
//!
//! **Source.** govaerts2000, §3 and §4 (folds), §5.2 (Hopf points).
//!
//! **Departures.** b and c are updated from w and v at every accepted point.

use crate::contract::{Batch, Condition, Parameters};
use crate::diagram::{Kind, Mesh, Point};
use crate::linalg::{axpy, dot, lu, max_abs};
use crate::problem::Setting;
use num_complex::Complex64;

/// Condition for a fold or Hopf point of equilibria.
pub struct OnEquilibria<'a> {
    setting: Setting<'a>,
    kind: Kind,
    n: usize,
    /// Dimension of the null space, 1 or 2.
    width: usize,
    /// `[width][n]` b and c.
    left: Vec<f64>,
    right: Vec<f64>,
    /// `[width][n + width]` solutions of (3) and of its transpose for every unit vector.
    null: Vec<f64>,
    adjoint: Vec<f64>,
    state: Vec<f64>,
    parameters: Vec<f64>,
    /// `[n × n]` A.
    jacobian: Vec<f64>,
}

impl<'a> OnEquilibria<'a> {
    /// Creates the condition of the given kind; `None` for kinds that equilibria do not have.
    pub fn new(kind: Kind, setting: Setting<'a>) -> Option<OnEquilibria<'a>> {
        let width = match kind {
            Kind::Fold => 1,
            Kind::Hopf => 2,
            _ => return None,
        };
        let n = setting.field.dim();
        let (size, scales) = (n * width, setting.scales);
        Some(OnEquilibria {
            setting,
            kind,
            n,
            width,
            left: (0..size).map(|k| scales[k % n] * (0.4 + (k as f64 * 1.3).sin())).collect(),
            right: (0..size).map(|k| (0.5 + (k as f64 * 1.7).cos()) / scales[k % n]).collect(),
            null: Vec::new(),
            adjoint: Vec::new(),
            state: Vec::new(),
            parameters: Vec::new(),
            jacobian: Vec::new(),
        })
    }

    fn batch(&self) -> Batch<'_> {
        let parameters = Parameters::Shared(&self.parameters);
        Batch { lanes: 1, states: &self.state, parameters, times: &[], signs: &[] }
    }

    /// A x.
    fn times_jacobian(&self, x: &[f64]) -> Vec<f64> {
        self.jacobian.chunks_exact(self.n).map(|row| dot(row, x)).collect()
    }

    fn evaluated(&mut self, u: &[f64], extra: &[f64], g: &mut [f64]) -> Option<()> {
        let (n, width) = (self.n, self.width);
        let total = n + width;
        self.state = u[..n].to_vec();
        self.parameters = self.setting.at(&u[n..]);
        let (mut f, mut fx) = (vec![0.0; n], vec![0.0; n * n]);
        self.setting.field.linearise(self.batch(), &[], &mut f, &mut fx, &mut []);
        self.jacobian = fx;
        let mut matrix = vec![0.0; total * total];
        for i in 0..n {
            let row = &mut matrix[i * total..i * total + n];
            let own = &self.jacobian[i * n..(i + 1) * n];
            match width {
                1 => row.copy_from_slice(own),
                _ => {
                    own.iter().zip(self.jacobian.chunks_exact(n)).for_each(|(a, other)| axpy(*a, other, row));
                    row[i] += extra[0];
                }
            }
            for k in 0..width {
                matrix[i * total + n + k] = self.left[k * n + i];
                matrix[(n + k) * total + i] = self.right[k * n + i];
            }
        }
        let mut pivots = vec![0; total];
        lu::factorise(&mut matrix, total, &mut pivots).ok()?;
        let unit = |k: usize| {
            let mut one = vec![0.0; total];
            one[n + k] = 1.0;
            one
        };
        (self.null, self.adjoint) = (Vec::new(), Vec::new());
        for k in 0..width {
            let (mut v, mut w) = (unit(k), unit(k));
            lu::solve(&matrix, total, &pivots, &mut v, 1);
            lu::solve_transposed(&matrix, total, &pivots, &mut w);
            self.null.extend(v);
            self.adjoint.extend(w);
        }
        g.copy_from_slice(&self.null[n..total]);
        (max_abs(&self.null).is_finite() && max_abs(&self.adjoint).is_finite()).then_some(())
    }
}

impl Condition for OnEquilibria<'_> {
    fn kind(&self) -> Kind {
        self.kind
    }

    fn extra(&self) -> usize {
        self.width - 1
    }

    /// Square of the largest rate of change, since κ is the product of two eigenvalues.
    fn extra_scale(&self) -> f64 {
        let (n, scales) = (self.n, self.setting.scales);
        let rates = self.jacobian.iter().enumerate().map(|(k, a)| (a * scales[k % n] / scales[k / n]).abs());
        rates.fold(0.0, f64::max).powi(2)
    }

    fn guess(&self, point: &Point) -> Vec<f64> {
        // κ is the product of the two eigenvalues whose sum is smallest relative to their size.
        let z = &point.spectrum;
        let pairs = (0..z.len()).flat_map(|j| (0..j).map(move |i| (z[i], z[j])));
        let balance = |(a, b): &(Complex64, Complex64)| (a + b).norm() / (1e-300 + a.norm() + b.norm());
        let pair = pairs.min_by(|p, q| balance(p).total_cmp(&balance(q)));
        (0..self.extra()).map(|_| pair.map_or(1.0, |(a, b)| (a * b).re)).collect()
    }

    fn anchor(&mut self) {
        if self.null.is_empty() {
            return;
        }
        let (n, total) = (self.n, self.n + self.width);
        let scale = |i: usize| self.setting.scales[i];
        // Gram–Schmidt in scaled components.
        let (mut left, mut right): (Vec<Vec<f64>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
        for (v, w) in self.null.chunks_exact(total).zip(self.adjoint.chunks_exact(total)) {
            let mut v: Vec<f64> = (0..n).map(|i| v[i] / scale(i)).collect();
            let mut w: Vec<f64> = (0..n).map(|i| w[i] * scale(i)).collect();
            for (own, others) in [(&mut v, &right), (&mut w, &left)] {
                others.iter().for_each(|other| axpy(-dot(own, other), other, own));
                let norm = dot(own, own).sqrt();
                own.iter_mut().for_each(|x| *x /= norm);
            }
            left.push(w);
            right.push(v);
        }
        let (left, right) = (left.concat(), right.concat());
        if max_abs(&left).is_finite() && max_abs(&right).is_finite() {
            self.right = right.iter().enumerate().map(|(k, x)| x / scale(k % n)).collect();
            self.left = left.iter().enumerate().map(|(k, x)| x / scale(k % n)).collect();
            // The range of L is scaled like the states.
            self.left.iter_mut().enumerate().for_each(|(k, x)| *x *= scale(k % n) * scale(k % n));
        }
    }

    fn set_mesh(&mut self, _mesh: &Mesh) {}

    fn evaluate(&mut self, u: &[f64], extra: &[f64], g: &mut [f64]) -> bool {
        if self.evaluated(u, extra, g).is_none() {
            self.null.clear();
            return false;
        }
        true
    }

    fn derivative(&mut self, du: &[f64], extra: &[f64], dg: &mut [f64]) {
        let (n, total) = (self.n, self.n + self.width);
        let direction = [&du[..n], &self.setting.spread(&du[n..])].concat();
        // dA x.
        let changed = |x: &[f64]| {
            let mut full = x.to_vec();
            full.resize(direction.len(), 0.0);
            let mut change = vec![0.0; n];
            self.setting.field.directional(self.batch(), &[&full, &direction], &mut change);
            change
        };
        let v = &self.null[..n];
        let mut change = changed(v);
        if self.width == 2 {
            // dA A v + A dA v + dκ v.
            let first = self.times_jacobian(&change);
            change = changed(&self.times_jacobian(v));
            axpy(1.0, &first, &mut change);
            axpy(extra.first().copied().unwrap_or(0.0), v, &mut change);
        }
        for (value, w) in dg.iter_mut().zip(self.adjoint.chunks_exact(total)) {
            *value = -dot(&w[..n], &change);
        }
    }

    fn null_direction(&self) -> Option<Vec<f64>> {
        let own = (self.kind == Kind::Fold).then(|| self.null.get(..self.n))??;
        Some([own, &[0.0; 2]].concat())
    }

    fn held(&self, extra: &[f64]) -> Vec<Complex64> {
        match self.kind {
            Kind::Fold => vec![Complex64::new(0.0, 0.0)],
            _ => [1.0, -1.0].map(|sign| sign * Complex64::new(-extra[0], 0.0).sqrt()).to_vec(),
        }
    }

    fn distance(&self, z: Complex64) -> f64 {
        match self.kind {
            Kind::Fold => z.norm(),
            _ if z.im == 0.0 => f64::INFINITY,
            _ => z.re.abs(),
        }
    }
}
