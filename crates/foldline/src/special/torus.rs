//! Torus points (Neimark–Sacker): a complex pair of multipliers crosses the unit circle.

use crate::contract::Monitor;
use crate::diagram::{Kind, Point};
use crate::linalg::dense::MANY;
use num_complex::Complex64;

/// Distance of a product of two multipliers from 1 that is rounding: those of an area-preserving map have the product 1
/// all along a branch.
const ROUNDING: f64 = 1e-13;

/// (p - 1) / (1 + |p|), with one sign if p is 1 up to rounding.
fn off(p: Complex64) -> Complex64 {
    let off = (p - 1.0) / (1.0 + p.norm());
    if off.norm() < ROUNDING { ROUNDING.into() } else { off }
}

/// Product of two multipliers equal to 1; real pairs (neutral saddles) are not confirmed.
pub struct Torus;

impl Monitor for Torus {
    fn kind(&self) -> Kind {
        Kind::Torus
    }

    fn value(&self, reference: &Point, at: &Point) -> f64 {
        let z = at.free_spectrum();
        // Products that are 1 all along have arbitrary sides.
        let error = reference.neutral_error();
        let neutral = reference.reciprocal_pairs(error).and_then(|_| at.reciprocal_pairs(error)).unwrap_or_default();
        let pairs = (0..z.len()).flat_map(|i| (i + 1..z.len()).map(move |j| [i, j]));
        let counts = |[i, j]: &[usize; 2]| !neutral.contains(&[*i, *j]) && !neutral.contains(&[*j, *i]);
        let factors = pairs.filter(counts).map(|[i, j]| z[i] * z[j]).map(off);
        if z.len() < MANY {
            return factors.product::<Complex64>().re;
        }
        // Of very many factors the product varies by many orders of magnitude along a step, so that only its sign and the
        // smallest factor, which is the one that vanishes, are of use.
        let start = (Complex64::new(1.0, 0.0), f64::INFINITY);
        let (turn, smallest) = factors.fold(start, |(turn, smallest), own| {
            let size = own.norm();
            (turn * own / size, smallest.min(size))
        });
        smallest.copysign(turn.re)
    }

    fn confirms(&self, at: &Point) -> bool {
        at.free_spectrum().iter().any(|z| z.im != 0.0 && z.norm().ln().abs() < 1e-4)
    }

    fn possible(&self, at: &Point) -> bool {
        let z = at.free_spectrum();
        // A real pair that is about to meet may still become complex within the step.
        let meets = |a: usize| z[a + 1..].iter().any(|b| b.im == 0.0 && (z[a] - b).norm() < 0.05);
        (0..z.len()).any(|a| if z[a].im == 0.0 { meets(a) } else { z[a].norm().ln().abs() < 0.1 })
    }

    fn jump(&self) -> usize {
        2
    }

    fn passed(&self, at: &Point) -> Option<usize> {
        let circle = 1.0 + super::rounding(at).max(at.conservative_margin());
        Some(at.free_spectrum().iter().filter(|z| z.im > 0.0 && z.norm() > circle).count())
    }

    fn others_unstable(&self, at: &Point) -> Option<usize> {
        super::others_unstable(at, 2, |z| if z.im == 0.0 { f64::INFINITY } else { z.norm().ln().abs() })
    }
}
