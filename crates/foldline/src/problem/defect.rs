//! How large the error of a collocation solution is.
//!
//! **Idea.** The polynomial satisfies the differential equation at the Gauss points; how badly it does so in between is
//! measured at one more point per interval, interlaced with them. The integral of this defect within an interval is the
//! local error; its integral over whole intervals, put through the linearised equations, is what it does to the cycle as a
//! whole. Unlike estimates from high derivatives this also sees a kink or a layer that the mesh has not resolved yet.
//!
//! **Equations.** d(s) = U'(s) - h T f(U(s)) on an interval, s ∈ [0, 1]:
//!
//!   (1)  local error   max_i |∫₀^{c_i} d ds|     (c_i the Gauss points, where d vanishes and the integral is extreme)
//!   (2)  end error     ∫₀¹ d ds                  (of higher order where the solution is smooth)
//!
//! d is integrated through its values at the m + 1 Gauss points of the next degree, exactly for its leading term.
//!
//! **Source.** The role of the defect: enright2000.

use super::gauss::{Scheme, gauss_legendre};
use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::Mesh;
use crate::linalg::axpy;

/// Where the defect is sampled, and how it is integrated.
#[derive(Clone, Debug)]
pub struct Sampling {
    /// `[m + 1][m + 1]` values at the sample points from values at the nodes.
    values: Vec<Vec<f64>>,
    /// `[m + 1][m + 1]` derivatives likewise.
    slopes: Vec<Vec<f64>>,
    /// `[m][m + 1]`: integral to each Gauss point.
    integrals: Vec<Vec<f64>>,
    /// `[m + 1]`: integral to 1.
    weights: Vec<f64>,
}

impl Sampling {
    /// For a scheme.
    pub fn new(scheme: &Scheme) -> Sampling {
        let m = scheme.degree;
        let (points, weights) = gauss_legendre(m + 1);
        let values = points.iter().map(|&s| scheme.interpolation(s)).collect();
        // p' is a polynomial of degree m - 1 known at the m Gauss points.
        let through = |nodes: &[f64], k: usize, s: f64| -> f64 {
            (0..nodes.len()).filter(|&l| l != k).map(|l| (s - nodes[l]) / (nodes[k] - nodes[l])).product()
        };
        let slopes = points
            .iter()
            .map(|&s| {
                let mut line = vec![0.0; m + 1];
                for i in 0..m {
                    axpy(
                        through(&scheme.nodes[1..], i, s),
                        &scheme.derivative[i * (m + 1)..(i + 1) * (m + 1)],
                        &mut line,
                    );
                }
                line
            })
            .collect();
        let integrals = scheme.nodes[1..]
            .iter()
            .map(|&c| {
                (0..=m).map(|k| (0..=m).map(|g| c * weights[g] * through(&points, k, c * points[g])).sum()).collect()
            })
            .collect();
        Sampling { values, slopes, integrals, weights }
    }
}

/// The defect of a profile.
#[derive(Clone, Debug)]
pub struct Defect {
    /// `[N]`: (1), largest component relative to its scale.
    pub local: Vec<f64>,
    /// `[N][n]`: (2).
    pub ends: Vec<f64>,
}

/// Measures the defect of a profile `[interval][node][component]`.
pub fn measure(
    field: &dyn VectorField,
    parameters: &[f64],
    profile: &[f64],
    period: f64,
    mesh: &Mesh,
    scheme: &Scheme,
    sampling: &Sampling,
    scale: &[f64],
) -> Defect {
    let (n, m, count) = (scale.len(), scheme.degree, mesh.len() - 1);
    let lanes = count * (m + 1);
    let (mut states, mut defect) = (vec![0.0; n * lanes], vec![0.0; n * lanes]);
    for j in 0..count {
        for k in 0..=m {
            let node = &profile[(j * (m + 1) + k) * n..(j * (m + 1) + k + 1) * n];
            for g in 0..=m {
                let (value, slope) = (sampling.values[g][k], sampling.slopes[g][k]);
                for i in 0..n {
                    states[i * lanes + j * (m + 1) + g] += value * node[i];
                    defect[i * lanes + j * (m + 1) + g] += slope * node[i];
                }
            }
        }
    }
    let mut f = vec![0.0; n * lanes];
    field.evaluate(Batch { lanes, states: &states, parameters: Parameters::Shared(parameters) }, &mut f);
    let mut local = vec![0.0f64; count];
    let mut ends = vec![0.0; count * n];
    for j in 0..count {
        let ht = (mesh[j + 1] - mesh[j]) * period;
        for i in 0..n {
            let at = i * lanes + j * (m + 1);
            let d = &mut defect[at..at + m + 1];
            axpy(-ht, &f[at..at + m + 1], d);
            for line in &sampling.integrals {
                local[j] = local[j].max((crate::linalg::dot(line, d) / scale[i]).abs());
            }
            ends[j * n + i] = crate::linalg::dot(&sampling.weights, d);
        }
    }
    Defect { local, ends }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Rotation;

    impl VectorField for Rotation {
        fn dim(&self) -> usize {
            2
        }
        fn parameter_count(&self) -> usize {
            0
        }
        fn evaluate(&self, at: Batch, f: &mut [f64]) {
            for l in 0..at.lanes {
                f[l] = at.states[at.lanes + l];
                f[at.lanes + l] = -at.states[l];
            }
        }
        fn linearise(&self, _at: Batch, _free: &[usize], _f: &mut [f64], _fx: &mut [f64], _fp: &mut [f64]) {}
        fn directional(&self, _at: Batch, _directions: &[&[f64]], _out: &mut [f64]) {}
    }

    /// The collocation solution of a rotation over one interval is the diagonal Padé approximation; its error is known.
    #[test]
    fn the_local_error_has_order_m_plus_one_and_the_end_error_a_higher_one() {
        let scheme = Scheme::new(4);
        let sampling = Sampling::new(&scheme);
        let at = |count: usize| {
            let mesh = super::super::mesh::uniform(count);
            // The exact solution interpolated: its defect is that of the collocation solution to leading order.
            let profile: Vec<f64> = mesh
                .windows(2)
                .flat_map(|p| {
                    scheme.nodes.iter().map(|c| std::f64::consts::TAU * (p[0] + (p[1] - p[0]) * c)).collect::<Vec<_>>()
                })
                .flat_map(|t| [t.sin(), t.cos()])
                .collect();
            let d = measure(&Rotation, &[], &profile, std::f64::consts::TAU, &mesh, &scheme, &sampling, &[1.0, 1.0]);
            d.local.iter().fold(0.0, |m: f64, x| m.max(*x))
        };
        let order = (at(10) / at(20)).log2();
        assert!((order - 5.0).abs() < 0.2, "{order}");
    }
}
