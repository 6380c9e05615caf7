//! Response to unbalance.
//!
//! **Equations.** With q = Re(a e^{iΩt}) and the unbalances mₖ e^{iφₖ} at the stations k:
//!
//! 1. (K - ΩCᵢJ - Ω²M + iΩ (C + Cᵢ + ΩG)) a = Ω² Σ mₖ e^{iφₖ} (x̂ₖ - iŷₖ)
//!
//! **Source.** friswell2010, section 6.2.

use crate::assembly::turned;
use crate::machine::{Linear, Load, Machine};
use crate::modes::folded;
use foldline_general::{Mat, complex_solution};
use num_complex::Complex64;

/// Elliptical orbit of a station.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// x = Re(x e^{iΩt}), in m.
    pub x: Complex64,
    /// y = Re(y e^{iΩt}), in m.
    pub y: Complex64,
}

impl Orbit {
    /// Largest distance from the centre of the orbit.
    pub fn major(&self) -> f64 {
        let [forward, backward] = self.circles();
        forward + backward
    }

    /// Smallest distance from the centre; negative for backward whirl.
    pub fn minor(&self) -> f64 {
        let [forward, backward] = self.circles();
        forward - backward
    }

    /// Radii of the circles in the direction of rotation and against it, whose sum is the orbit.
    fn circles(&self) -> [f64; 2] {
        let i = Complex64::I;
        [0.5 * (self.x + i * self.y).norm(), 0.5 * (self.x - i * self.y).norm()]
    }

    /// Complex amplitude of the displacement in a direction at `angle` from the x axis.
    pub fn along(&self, angle: f64) -> Complex64 {
        self.x * angle.cos() + self.y * angle.sin()
    }
}

impl Linear {
    /// Complex amplitudes of all degrees of freedom for unbalances that turn with the shaft.
    pub fn response(&self, loads: &[Load]) -> Vec<Complex64> {
        let (n, w, i) = (self.mass.nrows(), self.speed, Complex64::I);
        if self.isotropic {
            let half = n / 2;
            let [m, c, g, k, internal] =
                [&self.mass, &self.damping, &self.gyroscopic, &self.stiffness, &self.internal].map(folded);
            let a = Mat::from_fn(half, half, |r, s| {
                let at = (r, s);
                k[at] - i * w * internal[at] - w * w * m[at] + i * w * (c[at] + w * g[at])
            });
            let mut right = Mat::zeros(half, 1);
            loads.iter().for_each(|load| right[(load.first / 2, 0)] += w * w * load.amount);
            let found = complex_solution(a.as_ref(), &right);
            // z = x + iy turns forward: x = Re(a e^{iΩt}), y = Re(-i a e^{iΩt}).
            return (0..half).flat_map(|j| [found[(j, 0)], -i * found[(j, 0)]]).collect();
        }
        let circulating = turned(&self.internal);
        let a = Mat::from_fn(n, n, |r, s| {
            let at = (r, s);
            Complex64::new(
                self.stiffness[at] - w * circulating[at] - w * w * self.mass[at],
                w * (self.damping[at] + w * self.gyroscopic[at]),
            )
        });
        let mut right = Mat::zeros(n, 1);
        for load in loads {
            right[(load.first, 0)] += w * w * load.amount;
            right[(load.first + 1, 0)] -= i * w * w * load.amount;
        }
        let found = complex_solution(a.as_ref(), &right);
        (0..n).map(|j| found[(j, 0)]).collect()
    }
}

impl Machine {
    /// Orbits of `stations` at each of the speeds in rad/s, for the unbalance of the model.
    pub fn unbalance_response(&self, parameters: &[f64], speeds: &[f64], stations: &[usize]) -> Vec<Vec<Orbit>> {
        let row = |speed: &f64| {
            let own = self.at_speed(parameters, *speed);
            let found = self.linear(&own).response(&self.loads(&own));
            let orbit = |station: &usize| {
                let first = self.assembled.rotor.first(*station);
                Orbit { x: found[first], y: found[first + 1] }
            };
            stations.iter().map(orbit).collect()
        };
        speeds.iter().map(row).collect()
    }
}
