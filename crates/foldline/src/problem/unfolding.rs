//! The direction in which f is given up where branches cross.
//!
//! **Idea.** Where f_x and the derivatives of f along the free parameters have a left null vector in common, solutions form no smooth surface:
//! they do for f(x, λ) + b d = 0 with an amplitude b, wherever d is not in the range of f_x. Where b is 0, f itself vanishes.
//!
//! **Equations.** With the matrix Ã = S⁻¹ f_x S of scaled states, S their scales:
//!
//! ```text
//!   (1)  d = r S p̃,   p̃ᵀ Ã ≈ 0, |p̃| = 1
//! ```
//!
//! where r is the largest entry of Ã, or of what f_x becomes over the scales of states and parameters, so that b is a relative residual.
//!
//! **Source.** allgower1990, §8 (unfolding of branch points).

use super::Setting;
use crate::contract::{Batch, Parameters};
use crate::linalg::{dot, lu, max_abs};

/// d, and the null vectors of Ã that it comes from.
pub(super) struct Unfolding {
    /// d `[n]`.
    pub column: Vec<f64>,
    /// r.
    pub rate: f64,
    /// q̃ and p̃, approximately; nothing yet.
    vectors: Option<[Vec<f64>; 2]>,
}

impl Unfolding {
    /// For n states.
    pub fn new(n: usize) -> Unfolding {
        Unfolding { column: vec![1.0; n], rate: 0.0, vectors: None }
    }

    /// Makes d fit a place with the matrix `fx` `[n × n]`. What cannot be found stays as it was.
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
        let batch = Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times: &[] };
        let along: Vec<f64> =
            q.iter().zip(scales).map(|(q, s)| q * s).chain(vec![0.0; setting.parameters.len()]).collect();
        // How fast f_x q changes over the scales: all that there is of f_x where n is 1.
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

/// Null vectors of `a` `[n × n]`, of unit length, from approximate ones with which it is bordered.
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
