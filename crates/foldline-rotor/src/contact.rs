//! Contact laws of the ring.
//!
//! **Equations.** The ring pushes back with the force r h(r) along -U/r. With g = r - 1:
//!
//! 1. tanh: r h = ½ (tanh(K g) + 1) β g; attracts the rotor to the ring (outwards) just below contact, at most 0.139232 β/K at g = -0.639232/K
//! 2. softplus: r h = (β/2K) ln(1 + e^{2K g}); never negative
//! 3. piecewise: r h = β max(g, 0), the limit of both for K → ∞
//!
//! **Source.** 1: akay2024, equation of the snubber ring.

use crate::jet::Jet;

/// The x > 0 at which ½ (tanh(-x) + 1) (-x) is smallest: 2x = 1 + e^{-2x}.
const DEEPEST: f64 = 0.639_232_271_380_537;

/// Law of the ring force.
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
    /// h and its derivatives at radius `r`, stiffness `beta` and sharpness `k`; all 0 at r = 0, where there is no
    /// contact.
    pub fn stiffness(self, r: f64, beta: f64, k: f64) -> Stiffness {
        self.stiffness_touching(r, beta, k, r > 1.0)
    }

    /// h and its derivatives, with the contact of [`ContactLaw::Piecewise`] closed or open as `touching` says, for any
    /// radius.
    pub(crate) fn stiffness_touching(self, r: f64, beta: f64, k: f64, touching: bool) -> Stiffness {
        if r <= 0.0 {
            return Stiffness::default();
        }
        let gap = r - 1.0;
        // Force for β = 1, and its derivatives with respect to r and K.
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

    /// Switch of the law, and its limit for K → ∞: the fraction of the ring's stiffness in force at radius `r`, that is
    /// ½ (tanh(K g) + 1) or the logistic function of 2K g (which are equal), or 0 and 1.
    pub fn switch(self, r: f64, k: f64) -> f64 {
        match self {
            ContactLaw::Tanh | ContactLaw::Softplus => 0.5 * ((k * (r - 1.0)).tanh() + 1.0),
            ContactLaw::Piecewise => f64::from(r > 1.0),
        }
    }

    /// Deepest pull of the law below contact, as radius and (negative) force; `None` for a law that never pulls.
    pub fn pull(self, beta: f64, k: f64) -> Option<[f64; 2]> {
        match self {
            ContactLaw::Tanh => Some([1.0 - DEEPEST / k, -DEEPEST * (1.0 - DEEPEST.tanh()) * 0.5 * beta / k]),
            ContactLaw::Softplus | ContactLaw::Piecewise => None,
        }
    }

    /// Switch and force against radius at `count` points from `range[0]` to `range[1]`: radius, switch, force.
    pub fn curve(self, beta: f64, k: f64, range: [f64; 2], count: usize) -> Vec<[f64; 3]> {
        let spacing = (range[1] - range[0]) / (count.max(2) - 1) as f64;
        let radius = |i: usize| range[0] + i as f64 * spacing;
        (0..count).map(radius).map(|r| [r, self.switch(r, k), self.force(r, beta, k)]).collect()
    }

    /// Name of the file in models/ with this law.
    pub fn model_file(self) -> &'static str {
        match self {
            ContactLaw::Tanh => "overhung-rotor.toml",
            ContactLaw::Softplus => "overhung-rotor-softplus.toml",
            ContactLaw::Piecewise => "overhung-rotor-piecewise.toml",
        }
    }

    /// Evaluates h for jets.
    pub(crate) fn jet(self, r: &Jet, beta: &Jet, k: &Jet, touching: bool) -> Jet {
        let gap = r.plus(-1.0);
        let force = match self {
            ContactLaw::Tanh => (k * &gap).tanh().plus(1.0).times(0.5) * gap,
            ContactLaw::Softplus => {
                let twice = k.times(2.0);
                (&twice * &gap).softplus() * twice.reciprocal()
            }
            ContactLaw::Piecewise if touching => gap,
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
        // The scan has a step of 2e-5/K, and near a minimum the value determines the position poorly.
        assert!((lowest.1 - (1.0 - 0.639232 / k)).abs() < 3e-5 / k, "{lowest:?}");
        let [r, force] = ContactLaw::Tanh.pull(beta, k).unwrap();
        assert!((r - lowest.1).abs() < 3e-5 / k && (force - lowest.0).abs() < 1e-9 * beta / k, "{r} {force}");
        // There the force r h(r) is stationary: h + r h′ = 0, up to the rounding of 1 - r magnified by K.
        let h = ContactLaw::Tanh.stiffness(r, beta, k);
        assert!((h.value + r * h.by_radius).abs() < 1e-15 * beta * k, "{h:?}");
        assert_eq!(ContactLaw::Softplus.pull(beta, k), None);
    }

    #[test]
    fn the_curve_of_a_law_lists_its_switch_and_its_force() {
        for law in [ContactLaw::Tanh, ContactLaw::Softplus, ContactLaw::Piecewise] {
            let curve = law.curve(6.0, 90.0, [0.9, 1.1], 201);
            assert_eq!((curve.len(), curve[0][0]), (201, 0.9));
            assert!((curve[200][0] - 1.1).abs() < 1e-15);
            assert!(curve[0][1] < 1e-7 && curve[200][1] > 1.0 - 1e-7, "{law:?}");
            assert!(curve.windows(2).all(|pair| pair[1][1] >= pair[0][1]));
            assert!((curve[200][2] - 0.6).abs() < 1e-7, "{law:?}: β g at g = 0.1, {:?}", curve[200]);
        }
        // Softplus is the integral of the switch: the slope of the force divided by β.
        let slope = |r: f64| {
            let h = ContactLaw::Softplus.stiffness(r, 6.0, 90.0);
            (h.value + r * h.by_radius) / 6.0
        };
        assert!([0.98, 1.0, 1.01].iter().all(|&r| (slope(r) - ContactLaw::Softplus.switch(r, 90.0)).abs() < 1e-14));
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
