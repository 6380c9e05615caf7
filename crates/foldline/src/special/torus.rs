//! Torus points (Neimark–Sacker): a complex pair of multipliers crosses the unit circle.

use crate::contract::Monitor;
use crate::diagram::{Kind, Point};

/// Product of two multipliers equal to 1; real pairs (neutral saddles) are not confirmed.
pub struct Torus;

impl Monitor for Torus {
    fn kind(&self) -> Kind {
        Kind::Torus
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        let z = at.free_spectrum();
        let pairs = (0..z.len()).flat_map(|i| (i + 1..z.len()).map(move |j| (i, j)));
        pairs.map(|(i, j)| z[i] * z[j]).map(|p| (p - 1.0) / (1.0 + p.norm())).product::<num_complex::Complex64>().re
    }

    fn confirms(&self, at: &Point) -> bool {
        at.free_spectrum().iter().any(|z| z.im != 0.0 && z.norm().ln().abs() < 1e-4)
    }

    fn jump(&self) -> usize {
        2
    }
}
