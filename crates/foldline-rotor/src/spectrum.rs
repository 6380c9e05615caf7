//! Spectral lines of a cycle in both frames, its name, and the balances of power and torque that it must satisfy.
//!
//! **Idea.** A cycle of period T in the rotating frame has lines at k w, w = 2π/T, and no others. In the inertial frame
//! each of them lies at k w + Ω, so the motion is quasi-periodic, and one that whirls backward in the rotating frame
//! may whirl forward in the inertial frame.
//!
//! **Equations.** With z = u + jv = Σ c_k e^{jkwτ}:
//!
//! 1. power (ζ > 0): Σ k w (k w + Ω) |c_k|² = 0: a damper fixed in space takes as much as it gives, since a constant
//!    force does no work along a closed path
//! 2. torque: m ε Ω² Im c₀ = -2ζ Σ (k w + Ω) |c_k|²
//! 3. Parseval: Σ |c_k|² = (1/T) ∫ |z|² dτ
//!
//! **Source.** akay2024, section 2, for the signed spectrum of a resampled cycle; 1 and 2 follow from its equation of
//! motion, multiplied by z̄′ and by z̄ and averaged over a period.
//!
//! **Fails when** the cycle is poorly resolved: a line is only as accurate as the profile it comes from.

use foldline::attractors::{signed_spectrum, spectral_ratio};
use foldline::diagram::Cycle;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Samples over one period: lines to order ±2048, far beyond those that 1000 intervals can resolve at rounding level.
const SAMPLES: usize = 4096;
/// u and v among the states of the rotor.
const WHIRL: [usize; 2] = [0, 1];
/// Frequencies below this, in units of ω_n, count as zero.
const STATIC: f64 = 1e-9;

/// Frame of reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Frame {
    /// Turns with the shaft.
    Rotating,
    /// Fixed in space.
    Inertial,
}

/// Sense of rotation of a line in its frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Whirl {
    /// With the shaft.
    Forward,
    /// Against it.
    Backward,
    /// Not at all.
    Static,
}

impl Whirl {
    /// Name for tables.
    pub fn name(self) -> &'static str {
        match self {
            Whirl::Forward => "forward",
            Whirl::Backward => "backward",
            Whirl::Static => "static",
        }
    }
}

/// A line of the spectrum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// k.
    pub order: i64,
    /// Angular frequency in the requested frame, in units of ω_n; negative against the shaft.
    pub frequency: f64,
    /// c_k, in clearances. The same in both frames.
    pub amplitude: Complex64,
    /// Sense of rotation in that frame.
    pub whirl: Whirl,
}

/// All lines of a cycle at rotor speed Ω.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum {
    /// w = 2π/T, in units of ω_n.
    pub base: f64,
    /// Ω.
    pub speed: f64,
    /// c_k for k = -N/2 … N/2 - 1.
    pub amplitudes: Vec<Complex64>,
    /// n:m as the motion is named, such as (2, 1); `None` if there is only one frequency.
    pub ratio: Option<(u32, u32)>,
}

impl Spectrum {
    /// Returns the spectrum of u + jv of a cycle whose first two states are u and v; no lines if it has fewer states.
    pub fn of(cycle: &Cycle, speed: f64) -> Spectrum {
        let lines = signed_spectrum(cycle, WHIRL, SAMPLES);
        Spectrum {
            base: TAU / cycle.period,
            speed,
            amplitudes: lines.into_iter().map(|(_, amplitude)| amplitude).collect(),
            ratio: spectral_ratio(cycle, WHIRL),
        }
    }

    /// Name such as "2:1" or "3:1"; "1:1" for a motion of one frequency.
    pub fn name(&self) -> String {
        let (n, m) = self.ratio.unwrap_or((1, 1));
        format!("{n}:{m}")
    }

    /// c_k; 0 beyond the orders that were computed.
    pub fn amplitude(&self, order: i64) -> Complex64 {
        let index = order + self.amplitudes.len() as i64 / 2;
        usize::try_from(index).ok().and_then(|k| self.amplitudes.get(k)).copied().unwrap_or_default()
    }

    /// Orders with their amplitudes.
    fn orders(&self) -> impl Iterator<Item = (i64, Complex64)> + '_ {
        let half = self.amplitudes.len() as i64 / 2;
        self.amplitudes.iter().enumerate().map(move |(k, c)| (k as i64 - half, *c))
    }

    /// Lines in `frame`, by increasing frequency.
    pub fn lines(&self, frame: Frame) -> Vec<Line> {
        let shift = if frame == Frame::Inertial { self.speed } else { 0.0 };
        let line = |(order, amplitude): (i64, Complex64)| {
            let frequency = order as f64 * self.base + shift;
            let whirl = match frequency {
                f if f.abs() < STATIC => Whirl::Static,
                f if f > 0.0 => Whirl::Forward,
                _ => Whirl::Backward,
            };
            Line { order, frequency, amplitude, whirl }
        };
        self.orders().map(line).collect()
    }

    /// Lines in `frame` of at least `share` of the largest amplitude, strongest first.
    pub fn peaks(&self, frame: Frame, share: f64) -> Vec<Line> {
        let largest = self.amplitudes.iter().fold(0.0, |m: f64, c| m.max(c.norm()));
        let mut peaks = self.lines(frame);
        peaks.retain(|line| largest > 0.0 && line.amplitude.norm() >= share * largest);
        peaks.sort_by(|a, b| b.amplitude.norm().total_cmp(&a.amplitude.norm()));
        peaks
    }

    /// Defect of equation 1: the sum over the sum of its absolute values, in [-1, 1]; 0 for an exact cycle with ζ > 0.
    pub fn power_defect(&self) -> f64 {
        let terms = self.orders().map(|(k, c)| {
            let frequency = k as f64 * self.base;
            frequency * (frequency + self.speed) * c.norm_sqr()
        });
        relative(terms.fold([0.0, 0.0], |[sum, size], term| [sum + term, size + term.abs()]))
    }

    /// Σ (k w + Ω) |c_k|²: mean angular momentum in the inertial frame, per unit mass.
    pub fn swirl(&self) -> f64 {
        self.orders().map(|(k, c)| (k as f64 * self.base + self.speed) * c.norm_sqr()).sum()
    }

    /// Defect of equation 2: the difference of its sides over the sum of the absolute values of its terms; 0 for an
    /// exact cycle. `zeta` is ζ and `unbalance` is m ε.
    pub fn torque_defect(&self, zeta: f64, unbalance: f64) -> f64 {
        let driving = unbalance * self.speed * self.speed * self.amplitude(0).im;
        let terms = self.orders().map(|(k, c)| 2.0 * zeta * (k as f64 * self.base + self.speed) * c.norm_sqr());
        relative(terms.fold([driving, driving.abs()], |[sum, size], term| [sum + term, size + term.abs()]))
    }

    /// Defect of equation 3: relative difference between the lines and the mean of |z|²; `mean_square` is that mean,
    /// computed otherwise.
    pub fn parseval_defect(&self, mean_square: f64) -> f64 {
        let carried: f64 = self.amplitudes.iter().map(|c| c.norm_sqr()).sum();
        relative([carried - mean_square, carried.abs().max(mean_square.abs())])
    }
}

fn relative([sum, size]: [f64; 2]) -> f64 {
    if size > 0.0 { sum / size } else { 0.0 }
}

/// (1/T) ∫ |z|² dτ of a cycle, by Gauss quadrature on each interval of its mesh: exact for its polynomials.
pub fn mean_square(cycle: &Cycle) -> f64 {
    let n = cycle.dim();
    if n < 2 {
        return 0.0;
    }
    let scheme = cycle.scheme();
    // m Gauss points are exact up to degree 2m - 1, one short of the degree 2m of |z|²; one more point is exact.
    let finer = foldline::problem::gauss::Scheme::new(cycle.degree + 1);
    let weights: Vec<Vec<f64>> = finer.nodes[1..].iter().map(|&s| scheme.interpolation(s)).collect();
    let mut sum = 0.0;
    for (j, interval) in cycle.profile.chunks_exact((cycle.degree + 1) * n).enumerate() {
        let width = cycle.mesh[j + 1] - cycle.mesh[j];
        for (weights, share) in weights.iter().zip(&finer.weights) {
            let at = |i: usize| weights.iter().enumerate().map(|(k, w)| w * interval[k * n + i]).sum::<f64>();
            sum += width * share * (at(WHIRL[0]).powi(2) + at(WHIRL[1]).powi(2));
        }
    }
    sum
}
