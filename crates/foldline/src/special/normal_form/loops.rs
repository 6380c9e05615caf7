//! Homoclinic orbits next to a Bogdanov–Takens point.
//!
//! **Idea.** On the centre manifold, which depends on the parameters, the normal form has a homoclinic orbit of known shape. The
//! manifold and the parameters of the model as functions of those of the normal form follow from the condition that the
//! manifold is invariant, power by power.
//!
//! **Equations.** With the vectors of [`super`] (7), J the derivatives in the parameters, B, A₁ and J₂ the second ones in the
//! states, in both, and in the parameters, and x = H(w, β), α = K(β):
//!
//! ```text
//!   (1)  w₀' = w₁,  w₁' = β₁ + β₂ w₁ + a w₀² + b w₀ w₁ + …
//!   (2)  β₁ = -4 ε⁴ / a,   β₂ = ε² τ b / a,   τ = 10/7 + 288/2401 (ε b / a)²
//!   (3)  w₀ = (ε²/a) u,  w₁ = (ε³/a) u_ξ ω,   u = 2 - 6 sech² ξ,   ω = ξ_t / ε = 1 - 6/7 (ε b / a) tanh ξ
//!   (4)  H = w₀ q₀ + w₁ q₁ + β₁ H₁ + β₂ H₂ + ½ w₀² H₂₀ + w₀ w₁ H₁₁ + ½ w₁² H₀₂ + w₀ β₂ H' + ½ β₂² H₂₂
//!        K = β₁ K₁ + β₂ K₂ + ½ β₂² K₂₂
//!   (5)  A H₂₀ = 2 a q₁ - B(q₀,q₀),   A H₁₁ = b q₁ + H₂₀ - B(q₀,q₁),   A H₀₂ = 2 H₁₁ - B(q₁,q₁)
//!   (6)  A h + J k = r,   ⟨p₁, B(q₀,h) + A₁(q₀,k)⟩ = s,   ⟨p₁, B(q₁,h) + A₁(q₁,k)⟩ + ⟨p₀, B(q₀,h) + A₁(q₀,k)⟩ = t
//!        (h, k) = (H₂, K₂): r = 0, s = 0, t = 1;   (H₁, K₁): r = q₁, s = ⟨p₁,H₁₁⟩, t = ⟨p₀,H₁₁⟩ + ⟨p₁,H₀₂⟩
//!        (H₂₂, K₂₂): r = -(2 A₁(H₂,K₂) + B(H₂,H₂) + J₂(K₂,K₂)), s = t = 0
//!   (7)  A H' = -(B(q₀,H₂) + A₁(q₀,K₂))
//! ```
//!
//! H₂₀ contains the multiple of q₀ with which the last of (5) has a solution. (3) and τ solve (1) without its terms of higher order to the order ε² in β₂,
//! and to the order ε relative to its size in the orbit.
//!
//! **Source.** alhdaibat2016 (orbit, by a nonlinear time; homological equations); kuznetsov2004, §8.4.
//!
//! **Departures.** Terms of third order in (1), which change β₂ by a relative ε² and the orbit by a relative ε², are left to Newton's method.
//!
//! **Fails when** a or b vanishes, or the two parameters do not unfold the point.

use super::Local;
use crate::linalg::{dot, lu, max_abs};

/// Homoclinic orbits next to a Bogdanov–Takens point, by their size ε.
pub struct Loops {
    /// Equilibrium and parameters at the point.
    state: Vec<f64>,
    parameters: Vec<f64>,
    free: [usize; 2],
    scales: Vec<f64>,
    units: [f64; 2],
    a: f64,
    b: f64,
    /// q₀, q₁, H₁, H₂, ½ H₂₀, H₁₁, ½ H₀₂, H', ½ H₂₂ in units of the sizes of the states.
    terms: [Vec<f64>; 9],
    /// K₁, K₂, ½ K₂₂ in units of those of the parameters.
    shifts: [[f64; 2]; 3],
}

/// A matrix `[n × n]` with a null space of dimension one, bordered by a column and a row.
struct Bordered {
    factors: Vec<f64>,
    pivots: Vec<usize>,
    n: usize,
}

impl Bordered {
    fn new(a: &[f64], column: &[f64], row: &[f64]) -> Option<Bordered> {
        let n = column.len();
        let size = n + 1;
        let mut factors = vec![0.0; size * size];
        for i in 0..n {
            factors[i * size..i * size + n].copy_from_slice(&a[i * n..(i + 1) * n]);
            (factors[i * size + n], factors[n * size + i]) = (column[i], row[i]);
        }
        let mut pivots = vec![0; size];
        lu::factorise(&mut factors, size, &mut pivots).ok()?;
        Some(Bordered { factors, pivots, n })
    }

    /// x of A x + column g = r, ⟨row, x⟩ = last.
    fn solved(&self, r: &[f64], last: f64) -> Vec<f64> {
        let mut x = [r, &[last]].concat();
        lu::solve(&self.factors, self.n + 1, &self.pivots, &mut x, 1);
        x.truncate(self.n);
        x
    }

    /// The solution with the transposed matrix, column and row exchanged.
    fn solved_transposed(&self, r: &[f64], last: f64) -> Vec<f64> {
        let mut x = [r, &[last]].concat();
        lu::solve_transposed(&self.factors, self.n + 1, &self.pivots, &mut x);
        x.truncate(self.n);
        x
    }
}

fn sum(terms: &[(f64, &[f64])]) -> Vec<f64> {
    let mut out = vec![0.0; terms[0].1.len()];
    terms.iter().for_each(|(factor, x)| out.iter_mut().zip(*x).for_each(|(o, x)| *o += factor * x));
    out
}

impl Loops {
    /// Loops in the parameters `free` next to the point of `local`; `scales` `[n]` and `units` are the sizes of the states
    /// and of these parameters.
    pub fn new(local: &Local, scales: &[f64], free: [usize; 2], units: [f64; 2]) -> Option<Loops> {
        let n = local.n;
        let a_matrix: Vec<f64> = (0..n * n).map(|k| local.jacobian[k] * scales[k % n] / scales[k / n]).collect();
        let along = |h: &[f64], k: [f64; 2]| -> Vec<f64> {
            let mut d: Vec<f64> = h.iter().zip(scales).map(|(h, s)| h * s).collect();
            d.resize(n + local.parameters.len(), 0.0);
            (0..2).for_each(|i| d[n + free[i]] += k[i] * units[i]);
            d
        };
        let derivative = |directions: &[&[f64]]| -> Vec<f64> {
            local.derivative(directions).iter().zip(scales).map(|(x, s)| x / s).collect()
        };
        let zero = vec![0.0; n];
        // Any border serves but for exceptional ones.
        let any = |shift: f64| -> Vec<f64> { (0..n).map(|k| 1.0 + 0.5 * (1.7 * k as f64 + shift).sin()).collect() };
        let first = Bordered::new(&a_matrix, &any(0.3), &any(1.1))?;
        let unit = |x: Vec<f64>| -> Vec<f64> {
            let length = dot(&x, &x).sqrt();
            x.iter().map(|x| x / length).collect()
        };
        let (q0, left) = (unit(first.solved(&zero, 1.0)), unit(first.solved_transposed(&zero, 1.0)));
        let own = Bordered::new(&a_matrix, &left, &q0)?;
        let q1 = own.solved(&q0, 0.0);
        // p₁ A = 0 and p₀ A = p₁, both normalised.
        let length = dot(&left, &q1);
        let p1: Vec<f64> = left.iter().map(|x| x / length).collect();
        let mut p0 = own.solved_transposed(&p1, 0.0);
        let rest = dot(&p0, &q1);
        p0.iter_mut().zip(&p1).for_each(|(x, p)| *x -= rest * p);
        let none = [0.0; 2];
        let both = |x: &[f64], y: &[f64]| derivative(&[&along(x, none), &along(y, none)]);
        let [b00, b01, b11] = [both(&q0, &q0), both(&q0, &q1), both(&q1, &q1)];
        let (a, b) = (0.5 * dot(&p1, &b00), dot(&p0, &b00) + dot(&p1, &b01));
        // (5)
        let mut h20 = own.solved(&sum(&[(2.0 * a, &q1), (-1.0, &b00)]), 0.0);
        let mut h11 = own.solved(&sum(&[(b, &q1), (1.0, &h20), (-1.0, &b01)]), 0.0);
        let lift = 0.5 * dot(&p1, &b11) - dot(&p1, &h11);
        h20 = sum(&[(1.0, &h20), (lift, &q0)]);
        h11 = sum(&[(1.0, &h11), (lift, &q1)]);
        let h02 = own.solved(&sum(&[(2.0, &h11), (-1.0, &b11)]), 0.0);
        // (6)
        let size = n + 2;
        let mut matrix = vec![0.0; size * size];
        for j in 0..size {
            let mut h = zero.clone();
            let mut k = none;
            match j.checked_sub(n) {
                None => h[j] = 1.0,
                Some(i) => k[i] = 1.0,
            }
            let d = along(&h, k);
            let (column, with_q0, with_q1) =
                (derivative(&[&d]), derivative(&[&along(&q0, none), &d]), derivative(&[&along(&q1, none), &d]));
            (0..n).for_each(|i| matrix[i * size + j] = column[i]);
            matrix[n * size + j] = dot(&p1, &with_q0);
            matrix[(n + 1) * size + j] = dot(&p1, &with_q1) + dot(&p0, &with_q0);
        }
        let mut pivots = vec![0; size];
        lu::factorise(&mut matrix, size, &mut pivots).ok()?;
        let unfolded = |r: &[f64], s: f64, t: f64| -> (Vec<f64>, [f64; 2]) {
            let mut x = [r, &[s, t]].concat();
            lu::solve(&matrix, size, &pivots, &mut x, 1);
            (x[..n].to_vec(), [x[n], x[n + 1]])
        };
        let (h2, k2) = unfolded(&zero, 0.0, 1.0);
        let (h1, k1) = unfolded(&q1, dot(&p1, &h11), dot(&p0, &h11) + dot(&p1, &h02));
        let second = along(&h2, k2);
        let (h22, k22) = unfolded(&sum(&[(-1.0, &derivative(&[&second, &second]))]), 0.0, 0.0);
        let mixed = own.solved(&sum(&[(-1.0, &derivative(&[&along(&q0, none), &second]))]), 0.0);
        let half = |x: &[f64]| sum(&[(0.5, x)]);
        let terms = [q0, q1, h1, h2, half(&h20), h11, half(&h02), mixed, half(&h22)];
        let sound = terms.iter().all(|x| max_abs(x).is_finite()) && a != 0.0 && b != 0.0;
        sound.then(|| Loops {
            state: local.state.to_vec(),
            parameters: local.parameters.to_vec(),
            free,
            scales: scales.to_vec(),
            units,
            a,
            b,
            terms,
            shifts: [k1, k2, [0.5 * k22[0], 0.5 * k22[1]]],
        })
    }

    /// a and b of the normal form, in units of the sizes of the states.
    pub fn coefficients(&self) -> [f64; 2] {
        [self.a, self.b]
    }

    /// Largest ε at which the nonlinear time of (3) is clearly monotonic.
    pub fn largest(&self) -> f64 {
        const CLEAR: f64 = 0.5;
        CLEAR * 7.0 / 6.0 * (self.a / self.b).abs()
    }

    /// ε of the orbit whose largest component along q₀ is `size` sizes of the states.
    pub fn of_size(&self, size: f64) -> f64 {
        (size * self.a.abs() / (6.0 * max_abs(&self.terms[0]))).sqrt()
    }

    fn unfolding(&self, eps: f64) -> [f64; 2] {
        let ratio = self.b / self.a;
        let tau = 10.0 / 7.0 + 288.0 / 2401.0 * (eps * ratio).powi(2);
        [-4.0 * eps.powi(4) / self.a, eps * eps * tau * ratio]
    }

    /// All parameters of the model.
    pub fn parameters(&self, eps: f64) -> Vec<f64> {
        let [b1, b2] = self.unfolding(eps);
        let mut all = self.parameters.clone();
        for i in 0..2 {
            let moved = b1 * self.shifts[0][i] + b2 * self.shifts[1][i] + b2 * b2 * self.shifts[2][i];
            all[self.free[i]] += self.units[i] * moved;
        }
        all
    }

    fn mapped(&self, eps: f64, w0: f64, w1: f64) -> Vec<f64> {
        let [b1, b2] = self.unfolding(eps);
        let factors = [w0, w1, b1, b2, w0 * w0, w0 * w1, w1 * w1, w0 * b2, b2 * b2];
        let terms: Vec<(f64, &[f64])> = factors.into_iter().zip(self.terms.iter().map(Vec::as_slice)).collect();
        let moved = sum(&terms);
        self.state.iter().zip(&self.scales).zip(&moved).map(|((x, s), d)| x + s * d).collect()
    }

    /// The saddle.
    pub fn saddle(&self, eps: f64) -> Vec<f64> {
        self.mapped(eps, 2.0 * eps * eps / self.a, 0.0)
    }

    /// State at ξ.
    pub fn state(&self, eps: f64, xi: f64) -> Vec<f64> {
        let sech = 1.0 / xi.cosh();
        let speed = 1.0 + self.skew(eps) * xi.tanh();
        let (u, v) = (2.0 - 6.0 * sech * sech, 12.0 * sech * sech * xi.tanh() * speed);
        self.mapped(eps, eps * eps / self.a * u, eps.powi(3) / self.a * v)
    }

    fn skew(&self, eps: f64) -> f64 {
        -6.0 / 7.0 * eps * self.b / self.a
    }

    /// Time at ξ, from that of ξ = 0.
    pub fn time(&self, eps: f64, xi: f64) -> f64 {
        let k = self.skew(eps);
        // ln(cosh ξ + k sinh ξ), without overflow.
        let grown = xi.abs() + (0.5 * (1.0 + k * xi.signum() + (1.0 - k * xi.signum()) * (-2.0 * xi.abs()).exp())).ln();
        (xi - k * grown) / ((1.0 - k * k) * eps)
    }

    /// ξ at a time.
    pub fn phase(&self, eps: f64, time: f64) -> f64 {
        const HALVINGS: usize = 60;
        let reach = 2.0 * eps * time.abs() + 1.0;
        let (mut low, mut high) = (-reach, reach);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            *(if self.time(eps, middle) < time { &mut low } else { &mut high }) = middle;
        }
        0.5 * (low + high)
    }
}
