//! Collocation at Gauss or Radau points on one interval.
//!
//! **Idea.** A polynomial of degree m on [0, 1] is represented by its values at 0 and at the m Gauss–Legendre or right
//! Radau points c₁…c_m. Its derivative at these points and its value at 1 are fixed linear combinations of those values.
//! As one-step methods the two multiply a decaying mode by R(z), z = h T λ: |R| → 1 at Gauss points and R → 0 at Radau
//! points for z → -∞, so that fast modes vanish only with the latter. The order at interval ends is 2m and 2m - 1.
//!
//! **Equations.** With nodes c₀ = 0, c₁, …, c_m and Lagrange polynomials ℓ_k:
//!
//!   (1)  p'(c_i) = Σ_k D_ik p(c_k),   D_ik = ℓ_k'(c_i),  i = 1…m, k = 0…m
//!   (2)  p(1)    = Σ_k e_k p(c_k),    e_k  = ℓ_k(1)
//!   (3)  ∫₀¹ p   ≈ Σ_i b_i p(c_i),    exact to degree 2m - 1 (Gauss), 2m - 2 (Radau)
//!   (4)  p(c_i) - p(0) = Σ_k a_ik p'(c_k),   A = (D_ik)⁻¹, i, k = 1…m
//!
//! **Source.** ascher1995, §5; hairer1996, §§IV.3, IV.5.

use std::sync::OnceLock;

/// Largest supported degree.
pub const LARGEST: usize = 12;

/// Points at which a polynomial satisfies the differential equation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Points {
    /// Gauss–Legendre points.
    #[default]
    Gauss,
    /// Right Radau points, of which the last is 1; for cycles with modes that decay within an interval.
    Radau,
}

/// Nodes and weights for one degree.
#[derive(Clone, Debug)]
pub struct Scheme {
    /// m, the degree.
    pub degree: usize,
    /// Kind of the collocation points.
    pub points: Points,
    /// `[m + 1]` nodes: 0, then the collocation points.
    pub nodes: Vec<f64>,
    /// `[m]` quadrature weights b.
    pub weights: Vec<f64>,
    /// `[m × (m + 1)]` derivative matrix D, row-major.
    pub derivative: Vec<f64>,
    /// `[m × m]` integration matrix A of (4), row-major.
    pub integration: Vec<f64>,
    /// `[m + 1]` extrapolation to 1, e.
    pub end: Vec<f64>,
    barycentric: Vec<f64>,
}

impl Scheme {
    /// Scheme of degree m at Gauss points, 1 ≤ m ≤ [`LARGEST`], from a table; other degrees become the nearest of these.
    pub fn of(degree: usize) -> &'static Scheme {
        Scheme::at(degree, Points::Gauss)
    }

    /// Scheme of degree m, from a table that is filled as needed.
    pub fn at(degree: usize, points: Points) -> &'static Scheme {
        static KNOWN: [[OnceLock<Scheme>; LARGEST]; 2] =
            [const { [const { OnceLock::new() }; LARGEST] }, const { [const { OnceLock::new() }; LARGEST] }];
        let m = degree.clamp(1, LARGEST);
        KNOWN[points as usize][m - 1].get_or_init(|| Scheme::built(m, points))
    }

    /// [`Scheme::of`] as a value.
    pub fn new(degree: usize) -> Scheme {
        Scheme::of(degree).clone()
    }

    fn built(m: usize, points: Points) -> Scheme {
        let (inner, weights) = points.with_weights(m);
        let mut nodes = vec![0.0];
        nodes.extend(inner);
        let barycentric: Vec<f64> =
            (0..=m).map(|k| 1.0 / (0..=m).filter(|&l| l != k).map(|l| nodes[k] - nodes[l]).product::<f64>()).collect();
        let mut derivative = vec![0.0; m * (m + 1)];
        for i in 1..=m {
            let row = &mut derivative[(i - 1) * (m + 1)..i * (m + 1)];
            let mut diagonal = 0.0;
            for k in (0..=m).filter(|&k| k != i) {
                row[k] = barycentric[k] / barycentric[i] / (nodes[i] - nodes[k]);
                diagonal -= row[k];
            }
            row[i] = diagonal;
        }
        let integration = integration(&nodes[1..], &weights);
        let mut scheme =
            Scheme { degree: m, points, nodes, weights, derivative, integration, end: Vec::new(), barycentric };
        scheme.end = scheme.interpolation(1.0);
        scheme
    }

    /// Weights `[m + 1]` that give p(s) from the values at the nodes.
    pub fn interpolation(&self, s: f64) -> Vec<f64> {
        let mut weights = vec![0.0; self.degree + 1];
        self.weigh(s, &mut weights);
        weights
    }

    /// p(s) `[n]` from the values at the nodes `[m + 1][n]`.
    pub fn value_into(&self, s: f64, nodes: &[f64], x: &mut [f64]) {
        let mut weights = [0.0; LARGEST + 1];
        let weights = &mut weights[..=self.degree];
        self.weigh(s, weights);
        let n = x.len();
        // Four components at a time fill one or two vector registers.
        let (fours, rest) = x.as_chunks_mut::<4>();
        for (g, four) in fours.iter_mut().enumerate() {
            *four = [0.0; 4];
            for (w, node) in weights.iter().zip(nodes.chunks_exact(n)) {
                if let Some(values) = node[4 * g..].first_chunk::<4>() {
                    (0..4).for_each(|c| four[c] += w * values[c]);
                }
            }
        }
        let first = 4 * fours.len();
        for (c, value) in rest.iter_mut().enumerate() {
            *value = weights.iter().zip(nodes.chunks_exact(n)).map(|(w, node)| w * node[first + c]).sum();
        }
    }

    /// ℓ_k(s): the product of the factors to the left and to the right of node k, exactly 1 at the node.
    pub fn weigh(&self, s: f64, weights: &mut [f64]) {
        let mut left = 1.0;
        for ((w, c), b) in weights.iter_mut().zip(&self.nodes).zip(&self.barycentric) {
            *w = b * left;
            left *= s - c;
        }
        let mut right = 1.0;
        for (w, c) in weights.iter_mut().zip(&self.nodes).rev() {
            *w = if s == *c { 1.0 } else { *w * right };
            right *= s - c;
        }
    }
}

/// Integrals of the Lagrange polynomials on the collocation points from 0 to each of these points, by quadrature.
fn integration(inner: &[f64], weights: &[f64]) -> Vec<f64> {
    let m = inner.len();
    let through = |k: usize, s: f64| -> f64 {
        (0..m).filter(|&l| l != k).map(|l| (s - inner[l]) / (inner[k] - inner[l])).product()
    };
    (0..m * m)
        .map(|at| {
            let (c, k) = (inner[at / m], at % m);
            (0..m).map(|g| c * weights[g] * through(k, c * inner[g])).sum()
        })
        .collect()
}

impl Points {
    /// m collocation points and quadrature weights on [0, 1].
    pub(super) fn with_weights(self, m: usize) -> (Vec<f64>, Vec<f64>) {
        match self {
            Points::Gauss => gauss_legendre(m),
            Points::Radau => radau(m),
        }
    }
}

/// Right Radau points and weights on [0, 1]: c = (1 - x) / 2 with the roots x of P_{m-1} + P_m, among them -1, by
/// Newton's method from Chebyshev–Radau points.
fn radau(m: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut points, mut weights) = (vec![1.0; m], vec![1.0 / (m * m) as f64; m]);
    for i in 1..m {
        let mut x = -(std::f64::consts::TAU * i as f64 / (2 * m - 1) as f64).cos();
        let mut before = 1.0;
        for _ in 0..100 {
            // P_m and P_{m-1}; (P_{m-1} + P_m)' = m (P_{m-1} - P_m) / (1 - x).
            let (mut p, mut q) = (1.0, 0.0);
            for k in 0..m {
                (p, q) = (((2 * k + 1) as f64 * x * p - k as f64 * q) / (k + 1) as f64, p);
            }
            before = q;
            let slope = m as f64 * (q - p) / (1.0 - x);
            let step = (p + q) / slope;
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        points[m - 1 - i] = 0.5 * (1.0 - x);
        weights[m - 1 - i] = 0.5 * (1.0 - x) / (m as f64 * before).powi(2);
    }
    (points, weights)
}

/// Gauss–Legendre points and weights on [0, 1], by Newton's method on the Legendre recurrence.
pub(super) fn gauss_legendre(m: usize) -> (Vec<f64>, Vec<f64>) {
    let mut points = vec![0.0; m];
    let mut weights = vec![0.0; m];
    for i in 0..m {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (m as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (mut p, mut q) = (1.0, 0.0);
            for k in 0..m {
                (p, q) = (((2 * k + 1) as f64 * x * p - k as f64 * q) / (k + 1) as f64, p);
            }
            slope = m as f64 * (x * p - q) / (x * x - 1.0);
            let step = p / slope;
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        points[m - 1 - i] = 0.5 * (1.0 + x);
        weights[m - 1 - i] = 1.0 / ((1.0 - x * x) * slope * slope);
    }
    (points, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_derivative_matrix_and_the_extrapolation_are_exact_for_degree_m() {
        for (m, points) in (1..=7).flat_map(|m| [(m, Points::Gauss), (m, Points::Radau)]) {
            let scheme = Scheme::at(m, points);
            for power in 0..=m as i32 {
                let values: Vec<f64> = scheme.nodes.iter().map(|c| c.powi(power)).collect();
                for i in 0..m {
                    let d: f64 = (0..=m).map(|k| scheme.derivative[i * (m + 1) + k] * values[k]).sum();
                    let exact = if power == 0 { 0.0 } else { power as f64 * scheme.nodes[i + 1].powi(power - 1) };
                    assert!((d - exact).abs() < 1e-11, "degree {m}, power {power}: {d} against {exact}");
                }
                for i in 0..m {
                    let slope = |k: usize| power as f64 * scheme.nodes[k + 1].powi((power - 1).max(0));
                    let rise: f64 = (0..m).map(|k| scheme.integration[i * m + k] * slope(k)).sum();
                    assert!((rise - (values[i + 1] - values[0])).abs() < 1e-13, "degree {m}, power {power}");
                }
                let end: f64 = scheme.end.iter().zip(&values).map(|(e, v)| e * v).sum();
                assert!((end - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn the_quadrature_is_exact_to_the_degree_of_the_points() {
        for (m, points) in (1..=7).flat_map(|m| [(m, Points::Gauss), (m, Points::Radau)]) {
            let scheme = Scheme::at(m, points);
            for power in 0..2 * m as i32 - i32::from(points == Points::Radau) {
                let sum: f64 = (0..m).map(|i| scheme.weights[i] * scheme.nodes[i + 1].powi(power)).sum();
                assert!((sum - 1.0 / (power + 1) as f64).abs() < 1e-14);
            }
        }
    }
}
