//! Where a branch meets the simpler solutions it comes from.
//!
//! **Idea.** A cycle that shrinks to an equilibrium passes through zero amplitude and comes back shifted by half a period;
//! a doubled cycle does the same when its two halves become equal. The deviation from the simpler solution, multiplied with
//! that at a reference point, changes sign there.

use crate::contract::Monitor;
use crate::diagram::{Cycle, Kind, Point, Solution};

const SAMPLES: usize = 128;

/// Amplitude of a cycle: vanishes where it becomes an equilibrium.
pub struct Shrinks;

/// Difference between the halves of a cycle: vanishes where it becomes a cycle of half the period.
pub struct Halves;

impl Monitor for Shrinks {
    fn kind(&self) -> Kind {
        Kind::Hopf
    }

    fn value(&self, reference: &Point, at: &Point) -> f64 {
        compare(reference, at, |x, n| {
            let mut mean = vec![0.0; n];
            x.chunks_exact(n).for_each(|s| crate::linalg::axpy(1.0 / SAMPLES as f64, s, &mut mean));
            x.iter().enumerate().map(|(k, v)| v - mean[k % n]).collect()
        })
    }

    fn confirms(&self, _at: &Point) -> bool {
        true
    }

    fn jump(&self) -> usize {
        0
    }
}

impl Monitor for Halves {
    fn kind(&self) -> Kind {
        Kind::PeriodDoubling
    }

    fn value(&self, reference: &Point, at: &Point) -> f64 {
        compare(reference, at, |x, _| {
            let half = x.len() / 2;
            (0..half).map(|k| x[k + half] - x[k]).collect()
        })
    }

    fn confirms(&self, _at: &Point) -> bool {
        true
    }

    fn jump(&self) -> usize {
        0
    }
}

/// Inner product of the deviations of both points, relative to that of the reference.
fn compare(reference: &Point, at: &Point, deviation: impl Fn(&[f64], usize) -> Vec<f64>) -> f64 {
    let (Solution::Cycle(a), Solution::Cycle(b)) = (&reference.solution, &at.solution) else { return 1.0 };
    let of = |cycle: &Cycle| deviation(&cycle.uniform(SAMPLES), cycle.dim());
    let (da, db) = (of(a), of(b));
    // Components of very different unit must not drown each other.
    let n = a.dim();
    let mut weight = vec![f64::MIN_POSITIVE; n];
    da.iter().enumerate().for_each(|(k, v)| weight[k % n] += v * v);
    let product: f64 = da.iter().zip(&db).enumerate().map(|(k, (x, y))| x * y / weight[k % n]).sum();
    product / n as f64
}
