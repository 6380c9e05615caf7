//! Unfolding of the crossing of two branches.
//!
//! **Idea.** Where f_x and the derivatives of f with respect to the free parameters have a common left null vector, the
//! solutions form no smooth surface. Those of f(x, λ) + b d = 0, with an amplitude b, do if d is not in the range of
//! f_x. f itself vanishes where b = 0.
//!
//! **Equations.** With the matrix Ã = S⁻¹ f_x S of scaled states, S their scales:
//!
//! ```text
//!   (1)  d = r S p̃,   p̃ᵀ Ã ≈ 0, |p̃| = 1
//! ```
//!
//! where r is the largest entry of Ã, or of the change of f_x over the scales of states and parameters, so that b is a
//! relative residual.
//!
//! **Source.** allgower1990, §8 (unfolding of branch points).

use super::Setting;
use crate::contract::{Batch, Parameters};
use crate::linalg::{dot, lu, max_abs};

/// d and the null vectors of Ã from which it is computed.
pub(super) struct Unfolding {
    /// d `[n]`.
    pub column: Vec<f64>,
    /// r.
    pub rate: f64,
    /// q̃ and p̃, approximately; `None` before the first computation.
    vectors: Option<[Vec<f64>; 2]>,
}

impl Unfolding {
    /// Unfolding for n states.
    pub fn new(n: usize) -> Unfolding {
        Unfolding { column: vec![1.0; n], rate: 0.0, vectors: None }
    }

    /// Adapts d to a point with the matrix `fx` `[n × n]`. If the null vectors cannot be computed, d does not change.
    pub fn anchor(&mut self, setting: &Setting, x: &[f64], parameters: &[f64], fx: &[f64]) {
        const ROUNDS: usize = 5;
        let n = x.len();
        let scales = setting.scales;
        let scaled: Vec<f64> = (0..n * n).map(|k| fx[k] * scales[k % n] / scales[k / n]).collect();
        let generic = |k: f64| (0..n).map(|i| 0.6 + (1.0 + k * i as f64).sin()).collect::<Vec<f64>>();
        let (rounds, begin) = match self.vectors.take() {
            Some(known) => (1, known),
            None => (ROUNDS, [generic(1.3), generic(1.9)]),
        };
        let Some([q, p]) = (0..rounds).try_fold(begin, |[q, p], _| null_vectors(&scaled, &q, &p)) else { return };
        let batch = Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times: &[], signs: &[] };
        let along: Vec<f64> =
            q.iter().zip(scales).map(|(q, s)| q * s).chain(vec![0.0; setting.parameters.len()]).collect();
        // Rate of change of f_x q over the scales. For n = 1, f_x itself vanishes and nothing else is left.
        let mut changes = vec![along.clone()];
        for a in 0..setting.freedom() {
            let unit: Vec<f64> = (0..setting.freedom()).map(|k| f64::from(u8::from(k == a))).collect();
            changes.push([vec![0.0; n], setting.spread(&unit)].concat());
        }
        let rate = changes.iter().fold(max_abs(&scaled), |most, change| {
            let mut out = vec![0.0; n];
            setting.field.directional(batch, &[&along, change], &mut out);
            out.iter().zip(scales).fold(most, |most, (f, s)| most.max((f / s).abs()))
        });
        let rate = if rate > 0.0 && rate.is_finite() { rate } else { 1.0 };
        self.column = p.iter().zip(scales).map(|(p, s)| rate * s * p).collect();
        (self.rate, self.vectors) = (rate, Some([q, p]));
    }
}

/// Unit null vectors of `a` `[n × n]`, which is bordered with approximate ones.
fn null_vectors(a: &[f64], q: &[f64], p: &[f64]) -> Option<[Vec<f64>; 2]> {
    let (n, size) = (q.len(), q.len() + 1);
    let mut matrix = vec![0.0; size * size];
    let borders = max_abs(a).max(f64::MIN_POSITIVE);
    for i in 0..n {
        matrix[i * size..i * size + n].copy_from_slice(&a[i * n..(i + 1) * n]);
        (matrix[i * size + n], matrix[n * size + i]) = (borders * p[i], borders * q[i]);
    }
    let mut pivots = vec![0; size];
    lu::factorise(&mut matrix, size, &mut pivots).ok()?;
    let (mut v, mut w) = (vec![0.0; size], vec![0.0; size]);
    (v[n], w[n]) = (1.0, 1.0);
    lu::solve(&matrix, size, &pivots, &mut v, 1);
    lu::solve_transposed(&matrix, size, &pivots, &mut w);
    let unit = |mut x: Vec<f64>| {
        x.truncate(n);
        let norm = dot(&x, &x).sqrt();
        x.iter_mut().for_each(|x| *x /= norm);
        (max_abs(&x).is_finite()).then_some(x)
    };
    Some([unit(v)?, unit(w)?])
}
