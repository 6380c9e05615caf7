//! Floquet multipliers of a cycle.
//!
//! **Idea.** The flow direction is carried round the cycle exactly, so it is split off: what remains are (n-1)×(n-1)
//! blocks whose product has the non-trivial multipliers. The product is never formed.
//!
//! **Equations.** With G_j the transition over interval j and Q_j orthogonal, its first column along x'(t_j):
//!
//! ```text
//!   (1)  Q_{j+1}ᵀ G_j Q_j = [ g_j  *  ]        ∏ g_j = 1 up to the discretisation: the trivial multiplier
//!                           [  0  S_j ]        multipliers of S_N ⋯ S_1: the others
//!   (2)  log ∏ |μ| = ∫₀ᵀ tr f_x dt             Liouville
//! ```
//!
//! **Source.** lust2001; (2) is Liouville's formula.

use crate::linalg::periodic_schur;
use num_complex::Complex64;

/// Multipliers and how far they can be trusted.
#[derive(Clone, Debug, Default)]
pub struct Floquet {
    /// The trivial multiplier first where there is one, then the others by decreasing modulus.
    pub multipliers: Vec<Complex64>,
    /// How many of the others, the free ones, lie outside the unit circle.
    pub unstable: usize,
    /// log of the product of all moduli.
    pub log_product: f64,
}

/// Multipliers of an autonomous cycle. `transitions`: `[N]` G_j row-major n×n, in the components of the flow that the frames were made
/// from.
pub fn multipliers(transitions: &[f64], frames: &Frames, n: usize) -> Floquet {
    // Small dimensions as constants.
    let (factors, Trivial { sign, log: log_trivial }) = match n {
        2 => split(transitions, frames, 2),
        3 => split(transitions, frames, 3),
        4 => split(transitions, frames, 4),
        n => split(transitions, frames, n),
    };
    let grouped = periodic_schur::group(&factors, n - 1);
    let log_others = periodic_schur::log_determinant(&grouped, n - 1);
    let others = periodic_schur::eigenvalues(&grouped, n - 1);
    let unstable = others.iter().flatten().filter(|e| e.log_modulus > 0.0).count();
    let mut multipliers = vec![Complex64::new(sign * log_trivial.exp(), 0.0)];
    match others {
        Some(found) => multipliers.extend(found.into_iter().map(|e| e.value())),
        None => multipliers.extend(vec![Complex64::new(f64::NAN, f64::NAN); n - 1]),
    }
    Floquet { multipliers, unstable, log_product: log_trivial + log_others }
}

/// ∏ g_j of (1).
struct Trivial {
    sign: f64,
    log: f64,
}

/// (1): the S_j, row-major one after the other, and the product of the g_j.
#[inline(always)]
fn split(transitions: &[f64], frames: &Frames, n: usize) -> (Vec<f64>, Trivial) {
    // Where a product is taken as its logarithm, long before it leaves the range of f64.
    const FAR: f64 = 1e100;
    let count = frames.signs.len();
    let (mut product, mut log) = (1.0, 0.0);
    let mut factors = Vec::with_capacity(count * (n - 1) * (n - 1));
    let (mut g, mut line) = (vec![0.0; n * n], vec![0.0; n]);
    for (j, own) in transitions.chunks_exact(n * n).enumerate() {
        let next = if j + 1 < count { j + 1 } else { 0 };
        g.copy_from_slice(own);
        frames.columns(j, &mut g, n);
        frames.rows(next, &mut g, n, &mut line);
        product *= g[0];
        if !(1.0 / FAR..FAR).contains(&f64::abs(product)) {
            log += product.abs().ln();
            product = product.signum();
        }
        for i in 1..n {
            factors.extend_from_slice(&g[i * n + 1..(i + 1) * n]);
        }
    }
    (factors, Trivial { sign: product.signum(), log: log + product.abs().ln() })
}

/// Multipliers of a forced cycle, none of which is trivial. `transitions`: `[N]` G_j row-major n×n.
pub fn forced(transitions: &[f64], n: usize) -> Floquet {
    let grouped = periodic_schur::group(transitions, n);
    let log_product = periodic_schur::log_determinant(&grouped, n);
    let found = periodic_schur::eigenvalues(&grouped, n);
    let unstable = found.iter().flatten().filter(|e| e.log_modulus > 0.0).count();
    let multipliers = match found {
        Some(found) => found.into_iter().map(|e| e.value()).collect(),
        None => vec![Complex64::new(f64::NAN, f64::NAN); n],
    };
    Floquet { multipliers, unstable, log_product }
}

/// The Q_j of (1): reflections 1 - v vᵀ, times a sign on their first column.
#[derive(Clone, Debug)]
pub struct Frames {
    /// `[N][n]`.
    v: Vec<f64>,
    /// `[N]`.
    signs: Vec<f64>,
}

impl Frames {
    /// Along `flow`, `[N][n]` x' at the left ends.
    pub fn along(flow: &[f64], n: usize) -> Frames {
        let mut frames = Frames { v: flow.to_vec(), signs: vec![1.0; flow.len() / n.max(1)] };
        // Small dimensions as constants.
        match n {
            2 => frames.turn(2),
            3 => frames.turn(3),
            4 => frames.turn(4),
            n => frames.turn(n),
        }
        frames
    }

    /// Replaces directions by the reflections whose first columns lie along them.
    #[inline(always)]
    fn turn(&mut self, n: usize) {
        for (v, sign) in self.v.chunks_exact_mut(n).zip(&mut self.signs) {
            let norm = product(v, v, n).sqrt();
            for i in 0..n {
                v[i] = if norm > 0.0 { v[i] / norm } else { 0.0 };
            }
            // The reflection takes e_1 to ∓ the direction; the sign that avoids cancellation, undone by `signs`.
            *sign = if v[0] > 0.0 { -1.0 } else { 1.0 };
            v[0] -= *sign;
            let size = product(v, v, n);
            let scale = if size > 0.0 { (2.0 / size).sqrt() } else { 0.0 };
            (0..n).for_each(|i| v[i] *= scale);
        }
    }

    /// g Q_j.
    #[inline(always)]
    fn columns(&self, j: usize, g: &mut [f64], n: usize) {
        let (v, g) = (&self.v[j * n..j * n + n], &mut g[..n * n]);
        for i in 0..n {
            let row = &mut g[i * n..(i + 1) * n];
            let s = product(row, v, n);
            (0..n).for_each(|k| row[k] -= s * v[k]);
            row[0] *= self.signs[j];
        }
    }

    /// Q_jᵀ g; `s` is room for a row.
    #[inline(always)]
    fn rows(&self, j: usize, g: &mut [f64], n: usize, s: &mut [f64]) {
        let (v, g, s) = (&self.v[j * n..j * n + n], &mut g[..n * n], &mut s[..n]);
        s.fill(0.0);
        for i in 0..n {
            (0..n).for_each(|k| s[k] += v[i] * g[i * n + k]);
        }
        for i in 0..n {
            (0..n).for_each(|k| g[i * n + k] -= v[i] * s[k]);
        }
        (0..n).for_each(|k| g[k] *= self.signs[j]);
    }
}

/// a · b, with the length where the compiler can see it.
#[inline(always)]
fn product(a: &[f64], b: &[f64], n: usize) -> f64 {
    let (a, b) = (&a[..n], &b[..n]);
    (0..n).map(|k| a[k] * b[k]).sum()
}
