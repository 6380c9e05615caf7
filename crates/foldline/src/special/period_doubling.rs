//! Period doublings: a multiplier passes -1, and a branch of cycles of twice the period begins.
//!
//! **Equations.**
//!
//!   (1)  ∏_i (μ_i + 1) = 0
//!   (2)  v(t + T) = -v(t) solves the variational equation;  doubled cycle x(t) + s v(t), period 2T, for small s

use crate::contract::Monitor;
use crate::diagram::{Cycle, Kind, Mesh, Point};

/// Multiplier -1.
pub struct PeriodDoubling;

impl Monitor for PeriodDoubling {
    fn kind(&self) -> Kind {
        Kind::PeriodDoubling
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        super::distance_product(at.free_spectrum(), -1.0)
    }

    fn confirms(&self, at: &Point) -> bool {
        // If a pair has just met at -1, the distance of each from -1 is the square root of their product.
        let mut off: Vec<f64> = at.free_spectrum().iter().map(|z| (z + 1.0).norm() / (1.0 + z.norm())).collect();
        off.sort_by(f64::total_cmp);
        off.iter().take(2).product::<f64>() < 2.5e-3 || off.first().is_some_and(|least| *least < 5e-3)
    }

    fn jump(&self) -> usize {
        1
    }

    fn passed(&self, at: &Point) -> Option<usize> {
        let circle = 1.0 + super::rounding(at);
        Some(at.free_spectrum().iter().filter(|z| z.im == 0.0 && z.re < -circle).count())
    }

    fn others_unstable(&self, at: &Point) -> Option<usize> {
        super::others_unstable(at, 1, |z| (z + 1.0).norm())
    }
}

/// The cycle traversed twice, and a perturbation on one period extended antiperiodically to two.
pub fn doubled(cycle: &Cycle, direction: &[f64]) -> (Cycle, Vec<f64>) {
    let half: Vec<f64> = cycle.mesh.iter().map(|t| 0.5 * t).collect();
    let mesh: Mesh = half.iter().copied().chain(half[1..].iter().map(|t| 0.5 + t)).collect();
    let mut profile = [&cycle.profile[..], &cycle.profile[..]].concat();
    let second = profile[cycle.profile.len()..].chunks_exact_mut(cycle.dim());
    second.for_each(|x| x.iter_mut().zip(&cycle.gain).for_each(|(x, gain)| *x += gain));
    let gain = cycle.gain.iter().map(|gain| 2.0 * gain).collect();
    let perturbation = direction.iter().copied().chain(direction.iter().map(|v| -v)).collect();
    let (period, forcing_periods) = (2.0 * cycle.period, 2 * cycle.forcing_periods);
    (Cycle { period, forcing_periods, mesh, degree: cycle.degree, points: cycle.points, profile, gain }, perturbation)
}
