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

use crate::linalg::{axpy, dot, periodic_schur};
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

/// `transitions`: G_j row-major n×n one after the other, in scaled components; `flow`: `[N][n]` x' at the left ends.
pub fn multipliers(transitions: &[f64], flow: &[f64], n: usize) -> Floquet {
    let count = flow.len() / n.max(1);
    let mut log_trivial = 0.0;
    let mut sign = 1.0;
    let mut factors = Vec::with_capacity(count * (n - 1) * (n - 1));
    let (mut g, mut line) = (vec![0.0; n * n], vec![0.0; n]);
    let (mut frame, mut next) = (Frame::new(n), Frame::new(n));
    frame.turn(&flow[..n]);
    for j in 0..count {
        let at = (j + 1) % count * n;
        next.turn(&flow[at..at + n]);
        g.copy_from_slice(&transitions[j * n * n..(j + 1) * n * n]);
        frame.columns(&mut g, n);
        next.rows(&mut g, n, &mut line);
        sign *= g[0].signum();
        log_trivial += g[0].abs().ln();
        for i in 1..n {
            factors.extend_from_slice(&g[i * n + 1..(i + 1) * n]);
        }
        std::mem::swap(&mut frame, &mut next);
    }
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

/// The reflection 1 - v vᵀ, times a sign on its first column, whose first column is a given direction.
struct Frame {
    v: Vec<f64>,
    sign: f64,
}

impl Frame {
    fn new(n: usize) -> Frame {
        Frame { v: vec![0.0; n], sign: 1.0 }
    }

    /// Puts the first column along `direction`.
    fn turn(&mut self, direction: &[f64]) {
        let (v, norm) = (&mut self.v, dot(direction, direction).sqrt());
        v.iter_mut().zip(direction).for_each(|(v, x)| *v = if norm > 0.0 { x / norm } else { 0.0 });
        // The reflection takes e_1 to ∓ the direction; the sign that avoids cancellation, undone by `sign`.
        self.sign = if v[0] > 0.0 { -1.0 } else { 1.0 };
        v[0] -= self.sign;
        let size = dot(v, v);
        let scale = if size > 0.0 { (2.0 / size).sqrt() } else { 0.0 };
        v.iter_mut().for_each(|x| *x *= scale);
    }

    /// g Q.
    fn columns(&self, g: &mut [f64], n: usize) {
        for row in g.chunks_exact_mut(n) {
            let s = dot(row, &self.v);
            axpy(-s, &self.v, row);
            row[0] *= self.sign;
        }
    }

    /// Qᵀ g; `s` is room for a row.
    fn rows(&self, g: &mut [f64], n: usize, s: &mut [f64]) {
        s.fill(0.0);
        for (row, v) in g.chunks_exact(n).zip(&self.v) {
            axpy(*v, row, s);
        }
        for (row, v) in g.chunks_exact_mut(n).zip(&self.v) {
            axpy(-v, s, row);
        }
        g[..n].iter_mut().for_each(|x| *x *= self.sign);
    }
}
