//! Hand-written vector fields; only f is needed.

use super::*;

/// A vector field as a function of one point.
pub struct Field {
    pub dim: usize,
    pub parameters: usize,
    pub f: fn(&[f64], &[f64], &mut [f64]),
}

impl VectorField for Field {
    fn dim(&self) -> usize {
        self.dim
    }

    fn parameter_count(&self) -> usize {
        self.parameters
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        let (mut x, mut y, mut p) = ([0.0; 4], [0.0; 4], [0.0; 4]);
        let (n, k) = (self.dim, self.parameters);
        for l in 0..at.lanes {
            (0..n).for_each(|i| x[i] = at.states[i * at.lanes + l]);
            (0..k).for_each(|i| {
                p[i] = match at.parameters {
                    Parameters::Shared(shared) => shared[i],
                    Parameters::PerLane(own) => own[i * at.lanes + l],
                }
            });
            (self.f)(&x[..n], &p[..k], &mut y[..n]);
            (0..n).for_each(|i| f[i * at.lanes + l] = y[i]);
        }
    }

    // Without derivatives the explicit pair integrates every trajectory.
    fn linearise(&self, _: Batch, _: &[usize], _: &mut [f64], fx: &mut [f64], _: &mut [f64]) {
        fx.fill(f64::NAN);
    }

    fn directional(&self, _: Batch, _: &[&[f64]], _: &mut [f64]) {
        unreachable!("sampling needs f only")
    }
}

/// x'' = μ (1 - x²) x' - x, parameter μ.
pub const VAN_DER_POL: Field = Field {
    dim: 2,
    parameters: 1,
    f: |x, p, f| {
        f[0] = x[1];
        f[1] = p[0] * (1.0 - x[0] * x[0]) * x[1] - x[0];
    },
};

/// The overhung rotor of akay, equations of motion in the rotating frame; parameters Ω and κ, the others at their
/// reference values.
pub const ROTOR: Field = Field {
    dim: 4,
    parameters: 2,
    f: |x, p, f| {
        let (zeta, jp, m, epsilon, gamma, beta, k) = (0.01, 0.143, 0.9, 0.353, 0.25, 10.0, 150.0);
        let [u, v, du, dv] = [x[0], x[1], x[2], x[3]];
        let [omega, kappa] = [p[0], p[1]];
        let r = u.hypot(v);
        let gyroscopic = -omega * (jp - 2.0);
        let contact = 0.5 * ((k * (r - 1.0)).tanh() + 1.0) * beta * (1.0 - 1.0 / r.max(1e-300));
        let stiffness = omega * omega * (jp - 1.0) + 1.0 + (1.0 - kappa) * gamma * r * r + kappa * contact;
        let circulatory = 2.0 * zeta * omega;
        f[0] = du;
        f[1] = dv;
        f[2] = gyroscopic * dv - 2.0 * zeta * du - stiffness * u + circulatory * v + m * epsilon * omega * omega;
        f[3] = -gyroscopic * du - 2.0 * zeta * dv - stiffness * v - circulatory * u;
    },
};

/// x' = x - x³.
pub const BISTABLE: Field = Field { dim: 1, parameters: 0, f: |x, _, f| f[0] = x[0] - x[0].powi(3) };

/// x'' + x'/5 + x - x³ = 0.
pub const ESCAPING: Field = Field {
    dim: 2,
    parameters: 0,
    f: |x, _, f| {
        f[0] = x[1];
        f[1] = -0.2 * x[1] - x[0] + x[0].powi(3);
    },
};

/// x'' + x = 0.
pub const CENTRE: Field = Field {
    dim: 2,
    parameters: 0,
    f: |x, _, f| {
        f[0] = x[1];
        f[1] = -x[0];
    },
};
