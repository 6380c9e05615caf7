//! The constants of the rotor, with dimensions and without.

/// Constants in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Si {
    /// ω, shaft speed, rad/s.
    pub speed: f64,
    /// κ, 0 for the cubic spring, 1 for contact.
    pub kappa: f64,
    /// K, sharpness of the contact switch.
    pub sharpness: f64,
    /// m_d, mass of the disc, kg.
    pub mass: f64,
    /// e, eccentricity of the disc, m.
    pub eccentricity: f64,
    /// a, pivot to disc, m.
    pub disc_distance: f64,
    /// b, pivot to spring, damper and ring, m.
    pub spring_distance: f64,
    /// c, radial clearance of the ring, m.
    pub clearance: f64,
    /// I_d, diametral moment of inertia of the disc about its centre, kg m².
    pub diametral_inertia: f64,
    /// I_p, polar moment of inertia of the disc, kg m².
    pub polar_inertia: f64,
    /// k_r, stiffness of the spring, N/m.
    pub stiffness: f64,
    /// c_r, damping, N s/m.
    pub damping: f64,
    /// k_3, cubic stiffness, N/m³.
    pub cubic_stiffness: f64,
    /// k_s, stiffness of the ring, N/m.
    pub ring_stiffness: f64,
}

/// Constants without dimensions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nondimensional {
    /// Ω = ω/ω_n.
    pub omega: f64,
    /// κ, 0 for the cubic spring, 1 for contact.
    pub kappa: f64,
    /// ζ = c_r b²/(2 I ω_n).
    pub zeta: f64,
    /// ε = e b/(c a).
    pub epsilon: f64,
    /// γ = k₃ c²/k_r.
    pub gamma: f64,
    /// β = k_s/k_r.
    pub beta: f64,
    /// K, sharpness of the contact switch.
    pub sharpness: f64,
    /// J_p = I_p/I.
    pub polar: f64,
    /// m = m_d a²/I.
    pub mass: f64,
}

impl Si {
    /// I = I_d + m_d a², diametral moment of inertia about the pivot, kg m².
    pub fn pivot_inertia(&self) -> f64 {
        self.diametral_inertia + self.mass * self.disc_distance.powi(2)
    }

    /// ω_n = sqrt(k_r b²/I), rad/s: the unit of speed, and of time its reciprocal.
    pub fn pivot_frequency(&self) -> f64 {
        (self.stiffness * self.spring_distance.powi(2) / self.pivot_inertia()).sqrt()
    }

    /// c a/b, m: the clearance at the disc, the unit of length.
    pub fn disc_clearance(&self) -> f64 {
        self.clearance * self.disc_distance / self.spring_distance
    }

    /// The values in the order of models/overhung-rotor-si.toml.
    pub fn parameters(&self) -> [f64; 14] {
        [
            self.speed,
            self.kappa,
            self.sharpness,
            self.mass,
            self.eccentricity,
            self.disc_distance,
            self.spring_distance,
            self.clearance,
            self.diametral_inertia,
            self.polar_inertia,
            self.stiffness,
            self.damping,
            self.cubic_stiffness,
            self.ring_stiffness,
        ]
    }
}

impl From<&Si> for Nondimensional {
    fn from(si: &Si) -> Nondimensional {
        let (inertia, frequency) = (si.pivot_inertia(), si.pivot_frequency());
        Nondimensional {
            omega: si.speed / frequency,
            kappa: si.kappa,
            zeta: si.damping * si.spring_distance.powi(2) / (2.0 * inertia * frequency),
            epsilon: si.eccentricity / si.disc_clearance(),
            gamma: si.cubic_stiffness * si.clearance.powi(2) / si.stiffness,
            beta: si.ring_stiffness / si.stiffness,
            sharpness: si.sharpness,
            polar: si.polar_inertia / inertia,
            mass: si.mass * si.disc_distance.powi(2) / inertia,
        }
    }
}

impl Nondimensional {
    /// The constants of the reference study at Ω = 5, with the cubic spring.
    pub const REFERENCE: Nondimensional = Nondimensional {
        omega: 5.0,
        kappa: 0.0,
        zeta: 0.01,
        epsilon: 0.353,
        gamma: 0.25,
        beta: 10.0,
        sharpness: 150.0,
        polar: 0.143,
        mass: 0.9,
    };

    /// The values in the order of models/overhung-rotor.toml.
    pub fn parameters(&self) -> [f64; 9] {
        [self.omega, self.kappa, self.zeta, self.epsilon, self.gamma, self.beta, self.sharpness, self.polar, self.mass]
    }

    /// The constants from values in the order of models/overhung-rotor.toml.
    pub fn from_parameters(p: [f64; 9]) -> Nondimensional {
        let [omega, kappa, zeta, epsilon, gamma, beta, sharpness, polar, mass] = p;
        Nondimensional { omega, kappa, zeta, epsilon, gamma, beta, sharpness, polar, mass }
    }
}
