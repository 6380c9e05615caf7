//! Campbell diagram: natural frequencies of the linear rotor against speed, and the speeds at which two of them are in
//! a whole ratio.
//!
//! **Idea.** Below contact, or with the ring always touched, the rotor is linear and has two whirling modes. In the
//! rotating frame a cycle can emerge from them where their frequencies are in the ratio n:m; in the inertial frame
//! nothing distinguishes that speed.
//!
//! **Equations.** With z = u + jv in the rotating frame, stiffness s (1 without the ring, 1 + β with it), z = e^{μτ}:
//!
//! 1. μ² + (2ζ + j(2 - J_p)Ω) μ + s - (1 - J_p)Ω² + 2jζΩ = 0
//! 2. ζ = 0: μ = jλ, λ± = -g ± sqrt(s + J_p²Ω²/4), g = (1 - J_p/2)Ω
//! 3. inertial frame: λ + Ω; forward whirl (+) and backward whirl (-)
//! 4. λ₋ : λ₊ = n : m, both backward in the rotating frame for m > 0, at
//!    Ω_{n:m} = q sqrt(s)/sqrt((1 - J_p/2)² - q²J_p²/4), q = (n + m)/(n - m); it exists for (1 + q) J_p < 2, that is J_p < (n - m)/n.
//!
//! For m = 0 equation 4 gives the critical speed, λ₊ = 0; for m < 0 the modes whirl in opposite directions.
//!
//! **Source.** akay2024, section 2 (equation 1 without its nonlinear terms); 4 is derived here from 2.
//!
//! **Fails when** J_p > 0 is so large that the ratio in 4 occurs at no speed; the result is then `None`.

use crate::quantities::Nondimensional;

/// Both modes at one speed. Frequencies are in units of ω_n and signed: positive is forward in the frame of reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Modes {
    /// Ω.
    pub speed: f64,
    /// Frequencies in the rotating frame, the mode that whirls forward in the inertial frame first.
    pub rotating: [f64; 2],
    /// Frequencies in the inertial frame, in the same order.
    pub inertial: [f64; 2],
    /// Growth rates Re μ, the same in both frames; 0 without damping.
    pub growth: [f64; 2],
}

/// Returns both modes at the speed of `constants` with stiffness s = `stiffness` and with damping, from equation 1.
pub fn modes(constants: &Nondimensional, stiffness: f64) -> Modes {
    let (speed, polar, zeta) = (constants.omega, constants.polar, constants.zeta);
    // Half of the middle coefficient is ζ + jg; the discriminant over 4 is (ζ + jg)² - s + (1 - J_p)Ω² - 2jζΩ.
    let half = (1.0 - 0.5 * polar) * speed;
    let real = zeta * zeta - stiffness - (0.5 * polar * speed).powi(2);
    let imaginary = -polar * zeta * speed;
    let [x, y] = root(real, imaginary);
    let rotating = [y - half, -y - half];
    Modes { speed, rotating, inertial: rotating.map(|f| f + speed), growth: [x - zeta, -x - zeta] }
}

/// The square root of real + j imaginary in the upper half plane.
fn root(real: f64, imaginary: f64) -> [f64; 2] {
    let size = real.hypot(imaginary);
    if real <= 0.0 {
        let y = (0.5 * (size - real)).sqrt();
        [if y > 0.0 { 0.5 * imaginary / y } else { 0.0 }, y]
    } else {
        let x = (0.5 * (size + real)).sqrt();
        let y = 0.5 * imaginary / x;
        if y < 0.0 { [-x, -y] } else { [x, y] }
    }
}

/// Returns both modes without damping, from equation 2.
pub fn undamped_modes(speed: f64, polar: f64, stiffness: f64) -> Modes {
    let half = (1.0 - 0.5 * polar) * speed;
    let own = (stiffness + (0.5 * polar * speed).powi(2)).sqrt();
    let rotating = [own - half, -own - half];
    let inertial = [0.5 * polar * speed + own, 0.5 * polar * speed - own];
    Modes { speed, rotating, inertial, growth: [0.0; 2] }
}

/// Returns the modes at each of `speeds`, with the other constants from `constants`.
pub fn campbell(constants: &Nondimensional, stiffness: f64, speeds: &[f64]) -> Vec<Modes> {
    speeds.iter().map(|&omega| modes(&Nondimensional { omega, ..*constants }, stiffness)).collect()
}

/// A ratio n:m of the frequencies of the backward and the forward mode in the rotating frame, n > |m|; SL is 2:1, DL
/// 3:1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Ratio {
    /// n.
    pub backward: u32,
    /// m; negative where the two modes whirl in opposite directions in the rotating frame.
    pub forward: i32,
}

impl Ratio {
    /// Single loop SL, 2:1.
    pub const SINGLE_LOOP: Ratio = Ratio { backward: 2, forward: 1 };
    /// Double loop DL, 3:1.
    pub const DOUBLE_LOOP: Ratio = Ratio { backward: 3, forward: 1 };

    /// q = (n + m)/(n - m); infinite for n = m, and NaN for n < |m|.
    fn q(self) -> f64 {
        let (n, m) = (f64::from(self.backward), f64::from(self.forward));
        if n < m.abs() { f64::NAN } else { (n + m) / (n - m) }
    }

    /// J_p from which on the ratio occurs at no speed, (n - m)/n.
    pub fn polar_limit(self) -> f64 {
        (f64::from(self.backward) - f64::from(self.forward)) / f64::from(self.backward)
    }

    /// Speed at which the frequencies are in this ratio, from equation 4; `None` if there is no such speed.
    pub fn speed(self, polar: f64, stiffness: f64) -> Option<f64> {
        let q = self.q();
        let below = (1.0 - 0.5 * polar).powi(2) - (0.5 * q * polar).powi(2);
        // The second condition is lost in squaring equation 2.
        let exists = below > 0.0 && polar < 2.0 && stiffness >= 0.0;
        exists.then(|| q * (stiffness / below).sqrt()).filter(|speed| speed.is_finite())
    }

    /// Speeds between which cycles of this ratio exist that touch the ring part of the time: (Ω_{n:m}, sqrt(1 + β)
    /// Ω_{n:m}).
    pub fn contact_interval(self, polar: f64, beta: f64) -> Option<[f64; 2]> {
        Some([self.speed(polar, 1.0)?, self.speed(polar, 1.0 + beta)?])
    }
}

/// Resonance speeds of all ratios n:m in lowest terms with n ≤ `largest` and m ≥ 1, by increasing n, then m; ratios
/// without a resonance speed are left out.
pub fn resonances(polar: f64, stiffness: f64, largest: u32) -> Vec<(Ratio, f64)> {
    let ratios = (2..=largest).flat_map(|n| (1..n).map(move |m| (n, m)));
    let lowest = ratios.filter(|&(n, m)| (2..=m).all(|d| n % d != 0 || m % d != 0));
    let found = lowest.filter_map(|(backward, m)| {
        let ratio = Ratio { backward, forward: m as i32 };
        ratio.speed(polar, stiffness).map(|speed| (ratio, speed))
    });
    found.collect()
}
