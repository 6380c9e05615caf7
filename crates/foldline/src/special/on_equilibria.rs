//! Conditions on equilibria: a fold or a Hopf point is held.
//!
//! **Equations.** With v the null vector, borders b and c:
//!
//! ```text
//!   fold   (1)  f_x v = 0
//!   Hopf   (2)  (f_x - iω) v = 0                                    v complex
//!
//!   (3)  [ L   b ] [ v ]   [ 0 ]
//!        [ c*  0 ] [ g ] = [ 1 ],      dg = -w* (dL) v   with   L* w + c g* = 0,  b* w = 1
//! ```
//!
//! **Source.** govaerts2000, §3 and §4.
//!
//! **Departures.** b and c are taken anew from w and v at every accepted point.

use crate::contract::{Batch, Condition, Parameters};
use crate::diagram::{Kind, Mesh, Point};
use crate::linalg::{dot, lu, max_abs};
use crate::problem::Setting;
use num_complex::Complex64;

/// A fold or Hopf point held on equilibria.
pub struct OnEquilibria<'a> {
    setting: Setting<'a>,
    kind: Kind,
    n: usize,
    /// 1, or 2 where v is complex (real parts, then imaginary ones).
    width: usize,
    left: Vec<f64>,
    right: Vec<f64>,
    null: Vec<f64>,
    adjoint: Vec<Vec<f64>>,
    state: Vec<f64>,
    parameters: Vec<f64>,
}

impl<'a> OnEquilibria<'a> {
    /// The condition of that kind; `None` for a kind that equilibria do not have.
    pub fn new(kind: Kind, setting: Setting<'a>) -> Option<OnEquilibria<'a>> {
        let width = match kind {
            Kind::Fold => 1,
            Kind::Hopf => 2,
            _ => return None,
        };
        let n = setting.field.dim();
        let size = n * width;
        Some(OnEquilibria {
            setting,
            kind,
            n,
            width,
            left: (0..size).map(|k| 0.4 + (k as f64 * 1.3).sin()).collect(),
            right: (0..size).map(|k| 0.5 + (k as f64 * 1.7).cos()).collect(),
            null: Vec::new(),
            adjoint: Vec::new(),
            state: Vec::new(),
            parameters: Vec::new(),
        })
    }

    fn evaluated(&mut self, u: &[f64], extra: &[f64], g: &mut [f64]) -> Option<()> {
        let (n, size) = (self.n, self.n * self.width);
        let total = size + self.width;
        self.state = u[..n].to_vec();
        self.parameters = self.setting.at(&u[n..]);
        let batch =
            Batch { lanes: 1, states: &self.state, parameters: Parameters::Shared(&self.parameters), times: &[] };
        let (mut f, mut fx) = (vec![0.0; n], vec![0.0; n * n]);
        self.setting.field.linearise(batch, &[], &mut f, &mut fx, &mut []);
        let frequency = extra.first().copied().unwrap_or(0.0);
        let mut matrix = vec![0.0; total * total];
        for c in 0..size {
            let block = c / n * n;
            for d in 0..n {
                matrix[c * total + block + d] = fx[c % n * n + d];
            }
            let rotated = rotated(c, n);
            if self.width == 2 {
                // - iω v: the real part gains ω times the imaginary one.
                matrix[c * total + rotated.0] -= rotated.1 * frequency;
                matrix[c * total + size + 1] = rotated.1 * self.left[rotated.0];
                matrix[(size + 1) * total + c] = rotated.1 * self.right[rotated.0];
            }
            matrix[c * total + size] = self.left[c];
            matrix[size * total + c] = self.right[c];
        }
        let mut pivots = vec![0; total];
        lu::factorise(&mut matrix, total, &mut pivots).ok()?;
        self.null = vec![0.0; total];
        self.null[size] = 1.0;
        lu::solve(&matrix, total, &pivots, &mut self.null, 1);
        self.adjoint = (0..self.width)
            .map(|part| {
                let mut w = vec![0.0; total];
                w[size + part] = 1.0;
                lu::solve_transposed(&matrix, total, &pivots, &mut w);
                w
            })
            .collect();
        g.copy_from_slice(&self.null[size..]);
        (max_abs(&self.null).is_finite() && self.adjoint.iter().all(|w| max_abs(w).is_finite())).then_some(())
    }
}

/// Component and sign that i times a vector has at component c.
fn rotated(c: usize, n: usize) -> (usize, f64) {
    if c < n { (c + n, -1.0) } else { (c - n, 1.0) }
}

impl Condition for OnEquilibria<'_> {
    fn kind(&self) -> Kind {
        self.kind
    }

    fn extra(&self) -> usize {
        self.width - 1
    }

    fn guess(&self, point: &Point) -> Vec<f64> {
        let complex = point.spectrum.iter().filter(|z| z.im > 0.0);
        let nearest = complex.min_by(|a, b| (a.re / a.im).abs().total_cmp(&(b.re / b.im).abs()));
        (0..self.extra()).map(|_| nearest.map_or(1.0, |z| z.im)).collect()
    }

    fn anchor(&mut self) {
        if self.null.is_empty() {
            return;
        }
        let size = self.n * self.width;
        let scale = |k: usize| self.setting.scales[k % self.n];
        let v: f64 = (0..size).map(|k| (self.null[k] / scale(k)).powi(2)).sum();
        let w = (0..size).map(|k| (self.adjoint[0][k] * scale(k)).powi(2)).sum::<f64>().sqrt();
        if v.is_finite() && v > 0.0 && w.is_finite() && w > 0.0 {
            self.right = (0..size).map(|k| self.null[k] / (scale(k).powi(2) * v)).collect();
            self.left = self.adjoint[0][..size].iter().map(|x| x / w).collect();
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
        let (n, size) = (self.n, self.n * self.width);
        let batch =
            Batch { lanes: 1, states: &self.state, parameters: Parameters::Shared(&self.parameters), times: &[] };
        let direction = [&du[..n], &self.setting.spread(&du[n..])].concat();
        let turn = extra.first().copied().unwrap_or(0.0);
        let mut change = vec![0.0; size];
        for part in 0..self.width {
            let mut v = self.null[part * n..(part + 1) * n].to_vec();
            v.resize(direction.len(), 0.0);
            self.setting.field.directional(batch, &[&v, &direction], &mut change[part * n..(part + 1) * n]);
        }
        if self.width == 2 {
            for (c, value) in change.iter_mut().enumerate() {
                let (other, sign) = rotated(c, n);
                *value -= sign * turn * self.null[other];
            }
        }
        for (value, w) in dg.iter_mut().zip(&self.adjoint) {
            *value = -dot(&w[..size], &change);
        }
    }

    fn held(&self) -> usize {
        self.width
    }

    fn distance(&self, z: Complex64) -> f64 {
        match self.kind {
            Kind::Fold => z.norm(),
            _ if z.im == 0.0 => f64::INFINITY,
            _ => z.re.abs(),
        }
    }
}
