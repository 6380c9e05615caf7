//! Dimensional and nondimensional constants of the rotor, and the conversion between them.
//!
//! **Equations.** With I = I_d + m_d a², ω_n² = k_r b²/I, c̄ = c a/b:
//!
//! 1. Ω = ω/ω_n, J_p = I_p/I, m = m_d a²/I, ζ = c_r b²/(2 I ω_n), β = k_s/k_r, γ = k_3 c²/k_r, ε = e/c̄
//! 2. displacements over c̄, times by 1/ω_n, velocities over c̄ ω_n
//! 3. The inverse needs what the nondimensional constants leave open, the [`Scale`] a, b, c, I, ω_n:
//!    k_r = I ω_n²/b², m_d = m I/a², I_d = (1 - m) I, and the others from 1.
//!
//! **Source.** akay2024, section 2.

use crate::units::Mistake;

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

/// Scales of the nondimensional constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// a, pivot to disc, m.
    pub disc_distance: f64,
    /// b, pivot to spring, damper and ring, m.
    pub spring_distance: f64,
    /// c, radial clearance of the ring, m.
    pub clearance: f64,
    /// I = I_d + m_d a², diametral moment of inertia about the pivot, kg m².
    pub pivot_inertia: f64,
    /// ω_n, rad/s.
    pub pivot_frequency: f64,
}

impl Scale {
    /// c̄ = c a/b, m: the unit of displacement of the disc.
    pub fn length(&self) -> f64 {
        self.clearance * self.disc_distance / self.spring_distance
    }

    /// 1/ω_n, s: the unit of time.
    pub fn time(&self) -> f64 {
        1.0 / self.pivot_frequency
    }

    /// The units of a state u, v, u′, v′: m, m, m/s, m/s.
    pub fn state(&self) -> [f64; 4] {
        let velocity = self.length() * self.pivot_frequency;
        [self.length(), self.length(), velocity, velocity]
    }
}

/// Nondimensional constants.
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

    /// ω_n = sqrt(k_r b²/I), rad/s: the unit of speed; its reciprocal is the unit of time.
    pub fn pivot_frequency(&self) -> f64 {
        (self.stiffness * self.spring_distance.powi(2) / self.pivot_inertia()).sqrt()
    }

    /// c a/b, m: the clearance at the disc, the unit of length.
    pub fn disc_clearance(&self) -> f64 {
        self.clearance * self.disc_distance / self.spring_distance
    }

    /// Returns the scales that the nondimensional constants leave open.
    pub fn scale(&self) -> Scale {
        Scale {
            disc_distance: self.disc_distance,
            spring_distance: self.spring_distance,
            clearance: self.clearance,
            pivot_inertia: self.pivot_inertia(),
            pivot_frequency: self.pivot_frequency(),
        }
    }

    /// Returns the constants from values in the order of models/overhung-rotor-si.toml.
    pub fn from_parameters(p: [f64; 14]) -> Si {
        let [speed, kappa, sharpness, mass, eccentricity, disc_distance, spring_distance, ..] = p;
        let [.., clearance, diametral_inertia, polar_inertia, stiffness, damping, cubic_stiffness, ring_stiffness] = p;
        Si {
            speed,
            kappa,
            sharpness,
            mass,
            eccentricity,
            disc_distance,
            spring_distance,
            clearance,
            diametral_inertia,
            polar_inertia,
            stiffness,
            damping,
            cubic_stiffness,
            ring_stiffness,
        }
    }

    /// Returns the values in the order of models/overhung-rotor-si.toml.
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
    /// Constants of the reference study at Ω = 5, with the cubic spring.
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

    /// Returns the values in the order of models/overhung-rotor.toml.
    pub fn parameters(&self) -> [f64; 9] {
        [self.omega, self.kappa, self.zeta, self.epsilon, self.gamma, self.beta, self.sharpness, self.polar, self.mass]
    }

    /// Returns the constants from values in the order of models/overhung-rotor.toml.
    pub fn from_parameters(p: [f64; 9]) -> Nondimensional {
        let [omega, kappa, zeta, epsilon, gamma, beta, sharpness, polar, mass] = p;
        Nondimensional { omega, kappa, zeta, epsilon, gamma, beta, sharpness, polar, mass }
    }

    /// Returns the rotor in SI units that has these constants at this scale.
    ///
    /// # Errors
    /// Every mistake, if no rotor has these constants or the scale is not positive and finite.
    pub fn to_si(&self, scale: &Scale) -> Result<Si, Vec<Mistake>> {
        self.check()?;
        let Scale { disc_distance: a, spring_distance: b, clearance: c, pivot_inertia, pivot_frequency } = *scale;
        let measures = [("a", a), ("b", b), ("c", c), ("I", pivot_inertia), ("omega_n", pivot_frequency)];
        let wrong =
            measures.iter().filter(|(_, value)| !(*value > 0.0 && value.is_finite())).map(|(name, value)| Mistake {
                place: format!("{name} = {value}"),
                cause: "this value is physically impossible".into(),
                cure: format!("{name} must be greater than 0"),
            });
        let wrong: Vec<Mistake> = wrong.collect();
        if !wrong.is_empty() {
            return Err(wrong);
        }
        let stiffness = pivot_inertia * (pivot_frequency / b).powi(2);
        Ok(Si {
            speed: self.omega * pivot_frequency,
            kappa: self.kappa,
            sharpness: self.sharpness,
            mass: self.mass * pivot_inertia / (a * a),
            eccentricity: self.epsilon * scale.length(),
            disc_distance: a,
            spring_distance: b,
            clearance: c,
            diametral_inertia: (1.0 - self.mass) * pivot_inertia,
            polar_inertia: self.polar * pivot_inertia,
            stiffness,
            damping: 2.0 * self.zeta * pivot_inertia * pivot_frequency / (b * b),
            cubic_stiffness: self.gamma * stiffness / (c * c),
            ring_stiffness: self.beta * stiffness,
        })
    }
}
