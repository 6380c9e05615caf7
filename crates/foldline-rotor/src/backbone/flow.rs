//! The rotor without damping and unbalance, with the work that damping would dissipate and derivatives with respect to
//! the start.
//!
//! **Equations.** States x = (u, v, u′, v′) and P, each with columns ∂/∂s for s = r₀, v₀, Ω, where the start is
//! x = (r₀, 0, 0, v₀), P = 0:
//!
//! 1. x′ = f(x, Ω) of [`OverhungRotor`] at ζ = ε = 0, (∂x/∂s)′ = f_x ∂x/∂s + f_s
//! 2. P′ = |U′|² + Ω (u v′ - v u′)
//!
//! Layout `[column][5]`, the orbit itself first.

use crate::field::OverhungRotor;
use crate::quantities::Nondimensional;
use foldline::contract::{Batch, Parameters, VectorField};

/// Length of x and P.
pub const ORBIT: usize = 5;
/// Number of columns: ∂/∂r₀, ∂/∂v₀, ∂/∂Ω.
const COLUMNS: usize = 3;

/// Equations 1 and 2 as a vector field; its only parameter is Ω.
pub struct Flow {
    rotor: OverhungRotor,
    constants: Nondimensional,
    columns: usize,
}

impl Flow {
    /// Returns the flow with or without derivatives.
    pub fn new(rotor: OverhungRotor, constants: Nondimensional, derivatives: bool) -> Flow {
        let constants = Nondimensional { zeta: 0.0, epsilon: 0.0, ..constants };
        Flow { rotor, constants, columns: if derivatives { COLUMNS } else { 0 } }
    }

    /// Initial values `[5 (1 + columns)]` for the turning point r₀ with transverse speed v₀.
    pub fn start(&self, r0: f64, v0: f64) -> Vec<f64> {
        let mut x = vec![0.0; self.dim()];
        (x[0], x[3]) = (r0, v0);
        if self.columns > 0 {
            x[ORBIT] = 1.0;
            x[2 * ORBIT + 3] = 1.0;
        }
        x
    }

    /// Absolute tolerances for an orbit of size r₀.
    pub fn absolute(&self, tolerance: f64, r0: f64) -> Vec<f64> {
        // Divisors of the columns: r₀ and v₀ are of size r₀, and Ω of size 1.
        let by = [1.0, r0, r0, 1.0];
        let size = |i: usize| if i % ORBIT == ORBIT - 1 { r0 * r0 } else { r0 };
        (0..self.dim()).map(|i| tolerance * size(i) / by[i / ORBIT]).collect()
    }

    /// Evaluates x′ and P′ of one orbit, with its columns.
    pub fn slope(&self, x: &[f64], omega: f64, slope: &mut [f64]) {
        let constants = Nondimensional { omega, ..self.constants };
        let state = [x[0], x[1], x[2], x[3]];
        let [u, v, du, dv] = state;
        slope[..4].copy_from_slice(&self.rotor.field(state, &constants));
        slope[4] = du * du + dv * dv + omega * (u * dv - v * du);
        if self.columns == 0 {
            return;
        }
        let jacobian = self.rotor.state_jacobian(state, &constants);
        let direct = self.rotor.parameter_slope(state, &constants, 0);
        for c in 1..=COLUMNS {
            let d = &x[c * ORBIT..c * ORBIT + 4];
            let to = &mut slope[c * ORBIT..(c + 1) * ORBIT];
            for i in 0..4 {
                to[i] = (0..4).map(|j| jacobian[i][j] * d[j]).sum();
            }
            to[4] = 2.0 * (du * d[2] + dv * d[3]) + omega * (d[0] * dv + u * d[3] - d[1] * du - v * d[2]);
            if c == COLUMNS {
                to[2] += direct[0];
                to[3] += direct[1];
                to[4] += u * dv - v * du;
            }
        }
    }
}

impl VectorField for Flow {
    fn dim(&self) -> usize {
        ORBIT * (1 + self.columns)
    }

    fn parameter_count(&self) -> usize {
        1
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        let (mut x, mut slope) = ([0.0; ORBIT * (1 + COLUMNS)], [0.0; ORBIT * (1 + COLUMNS)]);
        let n = self.dim();
        for l in 0..at.lanes {
            (0..n).for_each(|i| x[i] = at.states[i * at.lanes + l]);
            let omega = match at.parameters {
                Parameters::Shared(p) => p[0],
                Parameters::PerLane(p) => p[l],
            };
            self.slope(&x[..n], omega, &mut slope[..n]);
            (0..n).for_each(|i| f[i * at.lanes + l] = slope[i]);
        }
    }

    /// Never needed, because the derivatives are among the states. Returns NaN so that any use would be noticed.
    fn linearise(&self, at: Batch, _free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        self.evaluate(at, f);
        fx.fill(f64::NAN);
        fp.fill(f64::NAN);
    }

    fn directional(&self, _at: Batch, _directions: &[&[f64]], out: &mut [f64]) {
        out.fill(f64::NAN);
    }
}
