//! The vector field of the rotor with hand-written derivatives.

use crate::contact::ContactLaw;
use crate::jet::Jet;
use crate::lanes::{self, Constants};
use crate::quantities::Nondimensional;
use foldline::contract::{Batch, Parameters, VectorField};

/// Nondimensional rotor: states u, v, u′, v′; parameters Ω, κ, ζ, ε, γ, β, K, J_p, m; output r.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OverhungRotor {
    /// Law of the ring force.
    pub law: ContactLaw,
}

const STATES: usize = 4;
const PARAMETERS: usize = 9;

impl OverhungRotor {
    /// f at one point.
    pub fn field(&self, x: [f64; 4], p: &Nondimensional) -> [f64; 4] {
        self.field_touching(x, p, x[0] * x[0] + x[1] * x[1] > 1.0)
    }

    /// f with the contact of the piecewise law closed or open as `touching` says.
    fn field_touching(&self, x: [f64; 4], p: &Nondimensional, touching: bool) -> [f64; 4] {
        let [u, v, du, dv] = x;
        let stiffness = self.stiffness(u, v, p, touching);
        let gyroscopic = (2.0 - p.polar) * p.omega;
        let circulatory = 2.0 * p.zeta * p.omega;
        let forcing = p.mass * p.epsilon * p.omega * p.omega;
        [
            du,
            dv,
            forcing + gyroscopic * dv - 2.0 * p.zeta * du - stiffness * u + circulatory * v,
            -gyroscopic * du - 2.0 * p.zeta * dv - stiffness * v - circulatory * u,
        ]
    }

    /// Total restoring force over displacement, in the rotating frame.
    fn stiffness(&self, u: f64, v: f64, p: &Nondimensional, touching: bool) -> f64 {
        let square = u * u + v * v;
        let contact = self.law.stiffness_touching(square.sqrt(), p.beta, p.sharpness, touching).value;
        1.0 - (1.0 - p.polar) * p.omega * p.omega + (1.0 - p.kappa) * p.gamma * square + p.kappa * contact
    }

    /// ∂fᵢ/∂xⱼ at one point.
    pub fn state_jacobian(&self, x: [f64; 4], p: &Nondimensional) -> [[f64; 4]; 4] {
        self.jacobian_touching(x, p, x[0].hypot(x[1]) > 1.0)
    }

    fn jacobian_touching(&self, x: [f64; 4], p: &Nondimensional, touching: bool) -> [[f64; 4]; 4] {
        let [u, v, ..] = x;
        let r = u.hypot(v);
        let s = self.stiffness(u, v, p, touching);
        let contact = self.law.stiffness_touching(r, p.beta, p.sharpness, touching).by_radius;
        // (∂s/∂r)/r, so that ∂s/∂u = curl u and ∂s/∂v = curl v.
        let curl = 2.0 * (1.0 - p.kappa) * p.gamma + if r > 0.0 { p.kappa * contact / r } else { 0.0 };
        let gyroscopic = (2.0 - p.polar) * p.omega;
        let circulatory = 2.0 * p.zeta * p.omega;
        [
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [-s - curl * u * u, circulatory - curl * u * v, -2.0 * p.zeta, gyroscopic],
            [-circulatory - curl * u * v, -s - curl * v * v, -gyroscopic, -2.0 * p.zeta],
        ]
    }

    /// ∂f/∂p_k of the two accelerations at one point.
    pub fn parameter_slope(&self, x: [f64; 4], p: &Nondimensional, k: usize) -> [f64; 2] {
        self.slope_touching(x, p, k, x[0] * x[0] + x[1] * x[1] > 1.0)
    }

    fn slope_touching(&self, x: [f64; 4], p: &Nondimensional, k: usize, touching: bool) -> [f64; 2] {
        let [u, v, du, dv] = x;
        let square = u * u + v * v;
        let contact = self.law.stiffness_touching(square.sqrt(), p.beta, p.sharpness, touching);
        let along = |slope: f64| [-slope * u, -slope * v];
        match k {
            0 => {
                let spin = 2.0 * (1.0 - p.polar) * p.omega;
                let turn = 2.0 - p.polar;
                [
                    2.0 * p.mass * p.epsilon * p.omega + turn * dv + spin * u + 2.0 * p.zeta * v,
                    -turn * du + spin * v - 2.0 * p.zeta * u,
                ]
            }
            1 => along(contact.value - p.gamma * square),
            2 => [2.0 * (p.omega * v - du), -2.0 * (p.omega * u + dv)],
            3 => [p.mass * p.omega * p.omega, 0.0],
            4 => along((1.0 - p.kappa) * square),
            5 => along(p.kappa * contact.by_beta),
            6 => along(p.kappa * contact.by_sharpness),
            7 => [-p.omega * dv - p.omega * p.omega * u, p.omega * du - p.omega * p.omega * v],
            8 => [p.epsilon * p.omega * p.omega, 0.0],
            _ => [0.0, 0.0],
        }
    }

    /// Evaluates f for jets.
    fn jets(&self, x: [Jet; 4], p: [Jet; 9], touching: bool) -> [Jet; 4] {
        let [u, v, du, dv] = x;
        let [omega, kappa, zeta, epsilon, gamma, beta, sharpness, polar, mass] = p;
        let square = &u * &u + &v * &v;
        let contact = match square.value() > 0.0 {
            true => self.law.jet(&square.sqrt(), &beta, &sharpness, touching),
            false => square.times(0.0),
        };
        let speed = &omega * &omega;
        let spring = kappa.times(-1.0).plus(1.0) * gamma * square + kappa * contact;
        let stiffness = polar.plus(-1.0) * speed.clone() + spring.plus(1.0);
        let gyroscopic = polar.times(-1.0).plus(2.0) * omega.clone();
        let damping = zeta.times(2.0);
        let circulatory = &damping * &omega;
        let across = &gyroscopic * &dv - &damping * &du - &stiffness * &u + &circulatory * &v;
        let along = &gyroscopic * &du + &damping * &dv + &stiffness * &v + &circulatory * &u;
        [du, dv, mass * epsilon * speed + across, along.times(-1.0)]
    }
}

/// State and constants of one lane.
fn lane(at: &Batch, l: usize) -> ([f64; 4], [f64; 9]) {
    let x = std::array::from_fn(|i| at.states[i * at.lanes + l]);
    let p = match at.parameters {
        Parameters::Shared(values) => std::array::from_fn(|k| values[k]),
        Parameters::PerLane(values) => std::array::from_fn(|k| values[k * at.lanes + l]),
    };
    (x, p)
}

/// True if the ring is touched at one lane: as the batch says, or as the state is.
fn touching(at: &Batch, l: usize) -> bool {
    match at.signs.get(l) {
        Some(sign) => *sign > 0.0,
        None => at.states[l] * at.states[l] + at.states[at.lanes + l] * at.states[at.lanes + l] > 1.0,
    }
}

impl VectorField for OverhungRotor {
    fn dim(&self) -> usize {
        STATES
    }

    fn parameter_count(&self) -> usize {
        PARAMETERS
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        if let (ContactLaw::Tanh, Parameters::Shared(&[a, b, c, d, e, g, h, i, j])) = (self.law, at.parameters) {
            let p = Nondimensional::from_parameters([a, b, c, d, e, g, h, i, j]);
            return lanes::evaluate(&Constants::of(&p), at, f);
        }
        for l in 0..at.lanes {
            let (x, p) = lane(&at, l);
            let value = self.field_touching(x, &Nondimensional::from_parameters(p), touching(&at, l));
            (0..STATES).for_each(|i| f[i * at.lanes + l] = value[i]);
        }
    }

    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        self.evaluate(at, f);
        fp.fill(0.0);
        for l in 0..at.lanes {
            let (x, p) = lane(&at, l);
            let p = Nondimensional::from_parameters(p);
            let jacobian = self.jacobian_touching(x, &p, touching(&at, l));
            for i in 0..STATES {
                (0..STATES).for_each(|j| fx[(i * STATES + j) * at.lanes + l] = jacobian[i][j]);
            }
            for (c, &k) in free.iter().enumerate() {
                let slope = self.slope_touching(x, &p, k, touching(&at, l));
                fp[(2 * free.len() + c) * at.lanes + l] = slope[0];
                fp[(3 * free.len() + c) * at.lanes + l] = slope[1];
            }
        }
    }

    fn directional(&self, at: Batch, directions: &[&[f64]], out: &mut [f64]) {
        for l in 0..at.lanes {
            let (x, p) = lane(&at, l);
            let slopes = |component: usize| directions.iter().map(move |d| d[component * at.lanes + l]);
            let x = std::array::from_fn(|i| Jet::new(x[i], slopes(i)));
            let p = std::array::from_fn(|k| Jet::new(p[k], slopes(STATES + k)));
            for (i, jet) in self.jets(x, p, touching(&at, l)).iter().enumerate() {
                out[i * at.lanes + l] = jet.highest();
            }
        }
    }

    fn output_count(&self) -> usize {
        1
    }

    fn outputs(&self, at: Batch, out: &mut [f64]) {
        for l in 0..at.lanes {
            let (x, _) = lane(&at, l);
            out[l] = x[0].hypot(x[1]);
        }
    }

    fn switch_count(&self) -> usize {
        usize::from(self.law == ContactLaw::Piecewise)
    }

    fn switches(&self, at: Batch, out: &mut [f64]) {
        for l in 0..at.lanes * self.switch_count() {
            let ([u, v, ..], _) = lane(&at, l);
            out[l] = (u * u + v * v).sqrt() - 1.0;
        }
    }

    fn linearise_switches(&self, at: Batch, _free: &[usize], [h, hx, hp, ht]: [&mut [f64]; 4]) {
        self.switches(at, h);
        hx.fill(0.0);
        hp.fill(0.0);
        ht.fill(0.0);
        for l in 0..at.lanes * self.switch_count() {
            let ([u, v, ..], _) = lane(&at, l);
            let r = (u * u + v * v).sqrt();
            (hx[l], hx[at.lanes + l]) = (u / r, v / r);
        }
    }

    fn switch_name(&self, _switch: usize) -> String {
        "r - 1".into()
    }
}
