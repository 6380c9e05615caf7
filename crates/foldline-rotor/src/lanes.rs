//! The vector field for eight trajectories at a time, with the contact law of the study.
//!
//! **Idea.** Terms that depend on parameters alone are computed once; the rest runs in whole vectors, compiled for the
//! widest instruction set of the machine. An ensemble of a field written in Rust then runs as fast as the machine
//! allows.

use crate::quantities::Nondimensional;
use foldline::contract::Batch;
use foldline::linalg::lane::{Eight, Lane};
use foldline::model::kernels;

/// Combinations of the parameters that f needs.
#[derive(Clone, Copy, Debug)]
pub struct Constants {
    /// m ε Ω².
    pub forcing: f64,
    /// (2 - J_p) Ω.
    pub gyroscopic: f64,
    /// 2 ζ.
    pub damping: f64,
    /// 2 ζ Ω.
    pub circulatory: f64,
    /// 1 - (1 - J_p) Ω².
    pub linear: f64,
    /// (1 - κ) γ.
    pub cubic: f64,
    /// κ β / 2.
    pub ring: f64,
    /// K.
    pub sharpness: f64,
}

impl Constants {
    /// Returns the constants for these parameters.
    pub fn of(p: &Nondimensional) -> Constants {
        Constants {
            forcing: p.mass * p.epsilon * p.omega * p.omega,
            gyroscopic: (2.0 - p.polar) * p.omega,
            damping: 2.0 * p.zeta,
            circulatory: 2.0 * p.zeta * p.omega,
            linear: 1.0 - (1.0 - p.polar) * p.omega * p.omega,
            cubic: (1.0 - p.kappa) * p.gamma,
            ring: 0.5 * p.kappa * p.beta,
            sharpness: p.sharpness,
        }
    }

    /// Evaluates f at eight states. For use within [`Lane::dispatch`].
    #[inline(always)]
    pub fn slopes(&self, [u, v, du, dv]: [Eight; 4]) -> [Eight; 4] {
        let (gyroscopic, damping) = (Eight::splat(self.gyroscopic), Eight::splat(self.damping));
        let (circulatory, one) = (Eight::splat(self.circulatory), Eight::splat(1.0));
        let square = u * u + v * v;
        let r = square.map(f64::sqrt);
        let switch = kernels::tanhs(Eight::splat(self.sharpness) * (r - one)) + one;
        // Far below contact the switch is zero, so the value at r = 0 does not matter.
        let share = r.map(|r| if r > 0.0 { 1.0 - 1.0 / r } else { 0.0 });
        let contact = Eight::splat(self.ring) * switch * share;
        let stiffness = Eight::splat(self.linear) + Eight::splat(self.cubic) * square + contact;
        let across = Eight::splat(self.forcing) + gyroscopic * dv - damping * du - stiffness * u + circulatory * v;
        let along = Eight::default() - gyroscopic * du - damping * dv - stiffness * v - circulatory * u;
        [du, dv, across, along]
    }
}

/// Evaluates f in all lanes of a batch with these constants.
pub(crate) fn evaluate(constants: &Constants, at: Batch, f: &mut [f64]) {
    Eight::dispatch(Evaluate { constants, at, f });
}

struct Evaluate<'a, 'b> {
    constants: &'a Constants,
    at: Batch<'a>,
    f: &'b mut [f64],
}

impl pulp::NullaryFnOnce for Evaluate<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Evaluate { constants, at: Batch { lanes, states, .. }, f } = self;
        let whole = lanes - lanes % Eight::COUNT;
        for first in (0..whole).step_by(Eight::COUNT) {
            let of = |i: usize| Eight::load(&states[i * lanes + first..]);
            let slopes = constants.slopes([of(0), of(1), of(2), of(3)]);
            for i in 0..4 {
                f[i * lanes + first..][..Eight::COUNT].copy_from_slice(&slopes[i].0);
            }
        }
        if whole < lanes {
            // Missing lanes repeat the last one.
            let of = |i: usize| Eight::each(|k| states[i * lanes + (whole + k).min(lanes - 1)]);
            let slopes = constants.slopes([of(0), of(1), of(2), of(3)]);
            for i in 0..4 {
                f[i * lanes + whole..(i + 1) * lanes].copy_from_slice(&slopes[i].0[..lanes - whole]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::contact::ContactLaw;
    use crate::field::OverhungRotor;
    use crate::quantities::Nondimensional;
    use foldline::contract::{Batch, Parameters, VectorField};

    /// Lanes agree with single evaluations to rounding; a lane does not depend on the number of lanes.
    #[test]
    fn lanes_agree_with_single_evaluations() {
        let rotor = OverhungRotor { law: ContactLaw::Tanh };
        for kappa in [0.0, 0.3, 1.0] {
            let p = Nondimensional { omega: 4.3, kappa, ..Nondimensional::REFERENCE };
            let parameters = p.parameters();
            let state = |l: usize| -> [f64; 4] {
                match l {
                    0 => [0.0; 4],
                    _ => std::array::from_fn(|i| (1.3 * l as f64 + i as f64).sin() * (1.0 + 1e-3 * l as f64)),
                }
            };
            let of = |lanes: usize| {
                let mut states = vec![0.0; 4 * lanes];
                (0..4 * lanes).for_each(|k| states[k] = state(k % lanes)[k / lanes]);
                let mut f = vec![0.0; 4 * lanes];
                let at = Batch {
                    lanes,
                    states: &states,
                    parameters: Parameters::Shared(&parameters),
                    times: &[],
                    signs: &[],
                };
                rotor.evaluate(at, &mut f);
                f
            };
            let many = of(27);
            for l in 0..27 {
                let alone = rotor.field(state(l), &p);
                for i in 0..4 {
                    let scale = 1.0 + alone.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                    assert!((many[i * 27 + l] - alone[i]).abs() < 1e-14 * scale, "{kappa} {l} {i}");
                }
            }
            for lanes in [1, 5, 8, 13] {
                let few = of(lanes);
                (0..4 * lanes).for_each(|k| {
                    assert_eq!(few[k].to_bits(), many[k / lanes * 27 + k % lanes].to_bits(), "{kappa} {lanes} {k}");
                });
            }
        }
    }
}
