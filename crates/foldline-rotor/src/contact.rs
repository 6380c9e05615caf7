//! Laws of contact with the ring.
//!
//! **Equations.** The ring pushes back with the force r h(r) along -U/r. With g = r - 1:
//!
//! 1. tanh: r h = ½ (tanh(K g) + 1) β g; pulls inwards just below contact, at most 0.139232 β/K at g = -0.639232/K
//! 2. softplus: r h = (β/2K) ln(1 + e^{2K g}); never negative
//! 3. piecewise: r h = β max(g, 0), the limit of both for K → ∞
//!
//! **Source.** 1: akay2024, equation of the snubber ring.

use crate::jet::Jet;

/// How the ring takes up force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ContactLaw {
    /// A spring switched on by a hyperbolic tangent.
    #[default]
    Tanh,
    /// A smooth spring that never pulls.
    Softplus,
    /// A spring that begins at contact.
    Piecewise,
}

/// h = force/r and its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stiffness {
    /// h.
    pub value: f64,
    /// ∂h/∂r.
    pub by_radius: f64,
    /// ∂h/∂β.
    pub by_beta: f64,
    /// ∂h/∂K.
    pub by_sharpness: f64,
}

impl ContactLaw {
    /// h and its derivatives at radius `r`, stiffness `beta` and sharpness `k`; all 0 at r = 0, where the switch is closed.
    pub fn stiffness(self, r: f64, beta: f64, k: f64) -> Stiffness {
        self.stiffness_touching(r, beta, k, r > 1.0)
    }

    /// The same with the contact of [`ContactLaw::Piecewise`] closed or open as `touching` says, whatever the radius.
    pub(crate) fn stiffness_touching(self, r: f64, beta: f64, k: f64, touching: bool) -> Stiffness {
        if r <= 0.0 {
            return Stiffness::default();
        }
        let gap = r - 1.0;
        // The force for β = 1, and its derivatives by r and K.
        let (force, by_radius, by_sharpness) = match self {
            ContactLaw::Tanh => {
                let s = 0.5 * ((k * gap).tanh() + 1.0);
                let steep = 0.5 / (k * gap).cosh().powi(2);
                (s * gap, s + steep * k * gap, steep * gap * gap)
            }
            ContactLaw::Softplus => {
                let x = 2.0 * k * gap;
                let log = x.max(0.0) + (-x.abs()).exp().ln_1p();
                let logistic = 1.0 / (1.0 + (-x).exp());
                (log / (2.0 * k), logistic, logistic * gap / k - log / (2.0 * k * k))
            }
            ContactLaw::Piecewise if touching => (gap, 1.0, 0.0),
            ContactLaw::Piecewise => (0.0, 0.0, 0.0),
        };
        Stiffness {
            value: beta * force / r,
            by_radius: beta * (by_radius - force / r) / r,
            by_beta: force / r,
            by_sharpness: beta * by_sharpness / r,
        }
    }

    /// The force r h(r), positive inwards.
    pub fn force(self, r: f64, beta: f64, k: f64) -> f64 {
        r * self.stiffness(r, beta, k).value
    }

    /// h for jets.
    pub(crate) fn jet(self, r: &Jet, beta: &Jet, k: &Jet) -> Jet {
        let gap = r.plus(-1.0);
        let force = match self {
            ContactLaw::Tanh => (k * &gap).tanh().plus(1.0).times(0.5) * gap,
            ContactLaw::Softplus => {
                let twice = k.times(2.0);
                (&twice * &gap).softplus() * twice.reciprocal()
            }
            ContactLaw::Piecewise if gap.value() > 0.0 => gap,
            ContactLaw::Piecewise => gap.times(0.0),
        };
        &(force * r.reciprocal()) * beta
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The minimum of ½(tanh x + 1) x, found here by a scan; the numbers are those of equation 1.
    #[test]
    fn the_tanh_law_pulls_just_below_contact() {
        let (beta, k) = (10.0, 150.0);
        let radius = |i: i32| 1.0 - 2.0 / k + f64::from(i) * 2e-5 / k;
        let lowest = (0..=100_000)
            .map(|i| (ContactLaw::Tanh.force(radius(i), beta, k), radius(i)))
            .fold((0.0, 0.0), |best: (f64, f64), next| if next.0 < best.0 { next } else { best });
        assert!((lowest.0 + 0.139232 * beta / k).abs() < 1e-6 * beta / k, "{lowest:?}");
        // The scan has a step of 2e-5/K, and near a minimum the value says little about the place.
        assert!((lowest.1 - (1.0 - 0.639232 / k)).abs() < 3e-5 / k, "{lowest:?}");
    }

    #[test]
    fn softplus_never_pulls_and_all_laws_agree_far_from_contact() {
        let (beta, k) = (10.0, 150.0);
        for i in 1..4000 {
            let r = f64::from(i) * 5e-4;
            assert!(ContactLaw::Softplus.force(r, beta, k) >= 0.0);
            if (r - 1.0).abs() > 0.15 {
                // Both smooth laws approach the piecewise one like exp(-2K|g|) = exp(-45) there.
                for law in [ContactLaw::Tanh, ContactLaw::Softplus] {
                    let difference = law.force(r, beta, k) - ContactLaw::Piecewise.force(r, beta, k);
                    assert!(difference.abs() < 1e-13, "{law:?} {r}: {difference}");
                }
            }
        }
    }
}
