//! Points at which a branch meets the simpler solutions from which it bifurcates.
//!
//! **Idea.** A cycle that shrinks to an equilibrium passes through zero amplitude and returns shifted by half a period;
//! a doubled cycle does so when its two halves become equal. There, the inner product of the deviation from the simpler
//! solution with that at a reference point changes sign.

use super::hopf;
use crate::contract::{Monitor, VectorField};
use crate::diagram::{Cycle, Kind, Point, Solution, Symmetry};
use crate::problem::impact::stored::impacts;
use crate::problem::mesh;
use num_complex::Complex64;
use std::f64::consts::TAU;

const SAMPLES: usize = 128;

/// Amplitude of a cycle: vanishes where it becomes an equilibrium. With little damping a branch may also pass an
/// equilibrium closely and continue; it ends only at a Hopf point.
pub struct Shrinks<'a> {
    /// Vector field.
    pub field: &'a dyn VectorField,
    /// Index of the parameter in which the Hopf point is sought.
    pub free: usize,
    /// Scale of that parameter.
    pub unit: f64,
    /// `[n]` characteristic sizes of the states.
    pub scales: &'a [f64],
    /// Kind of the end point: a Hopf point, or a generalised Hopf point on a curve of folds.
    pub at: Kind,
}

impl Shrinks<'_> {
    /// Value of parameter `free` at which the equilibrium inside a cycle has a Hopf point.
    fn hopf_point(&self, at: &Point) -> Option<f64> {
        let Solution::Cycle(cycle) = &at.solution else { return None };
        let mean = Shrinks::mean(&cycle.level(SAMPLES), cycle.dim());
        hopf::lies_near(self.field, &at.parameters, self.free, self.unit, self.scales, &mean, TAU / cycle.period)
    }

    fn mean(x: &[f64], n: usize) -> Vec<f64> {
        let mut mean = vec![0.0; n];
        x.chunks_exact(n).for_each(|s| crate::linalg::axpy(n as f64 / x.len() as f64, s, &mut mean));
        mean
    }
}

/// Difference between the halves of a cycle: vanishes where it becomes a cycle of half the period.
pub struct Halves<'a> {
    /// Vector field.
    pub field: &'a dyn VectorField,
    /// `[n]` characteristic sizes of the states.
    pub scales: &'a [f64],
    /// True if the branch is known to have begun at a period doubling. On other branches, halves that differ much are
    /// not compared.
    pub born: bool,
}

/// Largest difference between nearly equal halves of a cycle, relative to its extent.
pub const NEARLY: f64 = 0.3;

impl Halves<'_> {
    fn comparable(&self, at: &Point) -> bool {
        let Solution::Cycle(cycle) = &at.solution else { return false };
        // Halves with different numbers of events become equal only where an event loses its speed, which ends the branch.
        if !impacts(self.field, &at.parameters, cycle).len().is_multiple_of(2) {
            return false;
        }
        if self.born {
            return true;
        }
        let n = cycle.dim();
        let [mut one, mut other] = [vec![0.0; n], vec![0.0; n]];
        let scheme = cycle.scheme();
        // Most cycles already differ at the first sample.
        at.ranges.len() >= n
            && (0..SAMPLES / 2).all(|k| {
                let t = k as f64 / SAMPLES as f64;
                cycle.state_into(scheme, t, &mut one);
                cycle.state_into(scheme, t + 0.5, &mut other);
                other.iter_mut().zip(&cycle.gain).for_each(|(x, gain)| *x -= 0.5 * gain);
                let mut pairs = one.iter().zip(&other).zip(&at.ranges);
                pairs.all(|((x, y), [low, high])| (x - y).abs() <= NEARLY * (high - low))
            })
    }
}

/// True if a cycle is one of half its period, traversed twice, within a share of its extent.
pub fn repeats(at: &Point, within: f64) -> bool {
    let Solution::Cycle(cycle) = &at.solution else { return false };
    let (x, n) = (cycle.level(SAMPLES), cycle.dim());
    let (one, other) = x.split_at(SAMPLES / 2 * n);
    let ranges = at.ranges.iter().take(n).cycle();
    one.iter().zip(other).zip(ranges).all(|((a, b), [low, high])| (a - b).abs() <= within * (high - low))
}

impl Monitor for Shrinks<'_> {
    fn kind(&self) -> Kind {
        self.at
    }

    fn value(&self, reference: &Point, at: &Point) -> f64 {
        if let (Solution::Cycle(a), Solution::Cycle(b)) = (&reference.solution, &at.solution)
            && (a.degree, a.points) == (b.degree, b.points)
            && mesh::same(&a.mesh, &b.mesh)
        {
            return on_one_mesh(a, b, &extents(reference, self.scales));
        }
        compare(reference, at, self.scales, |x, n| {
            let mean = Shrinks::mean(x, n);
            x.iter().enumerate().map(|(k, v)| v - mean[k % n]).collect()
        })
    }

    fn confirms(&self, at: &Point) -> bool {
        self.hopf_point(at).is_some()
    }

    fn meeting(&self, at: &Point) -> Option<f64> {
        // Along a curve in two parameters a generalised Hopf point differs from nearby Hopf points in one parameter.
        self.hopf_point(at).filter(|_| self.at == Kind::Hopf)
    }

    fn jump(&self) -> usize {
        0
    }
}

/// First harmonic in the phase of a torus: vanishes where the torus becomes a cycle.
pub struct Narrows<'a> {
    /// `[n]` characteristic sizes of the states.
    pub scales: &'a [f64],
}

impl Narrows<'_> {
    /// The first harmonic of every state at t = 0.
    fn harmonic(point: &Point) -> Option<Vec<Complex64>> {
        let Solution::Torus(torus) = &point.solution else { return None };
        let (n, count) = (torus.dim(), torus.phases());
        let first = torus.profile.get(..count * n)?;
        let turn = |k: usize| Complex64::cis(-TAU * k as f64 / count as f64) * (2.0 / count as f64);
        let of = |c: usize| first[c..].iter().step_by(n).enumerate().map(|(k, x)| turn(k) * x).sum();
        Some((0..n).map(of).collect())
    }
}

impl Monitor for Narrows<'_> {
    fn kind(&self) -> Kind {
        Kind::Torus
    }

    fn value(&self, reference: &Point, at: &Point) -> f64 {
        let (Some(a), Some(b)) = (Narrows::harmonic(reference), Narrows::harmonic(at)) else { return f64::NAN };
        let product = |b: &[Complex64]| -> f64 {
            a.iter().zip(b).zip(self.scales).map(|((a, b), s)| (a.conj() * b).re / (s * s)).sum()
        };
        let size = product(&a);
        // At a torus point itself, where the branch may begin, only rounding is left.
        if size < LEFT * LEFT { 1.0 } else { product(&b) / size }
    }

    fn confirms(&self, at: &Point) -> bool {
        /// First harmonic, relative to the scales, below which the torus is a cycle: a zero is located far more closely.
        const NOTHING: f64 = 1e-2;
        let Some(own) = Narrows::harmonic(at) else { return false };
        own.iter().zip(self.scales).all(|(z, s)| z.norm() < NOTHING * s)
    }

    fn jump(&self) -> usize {
        0
    }
}

/// Difference between a solution and its mirror image, for a cycle shifted by half a period if `half` is set: vanishes
/// where the solution becomes symmetric.
pub struct Mirrors {
    /// Symmetry that maps the solution to its mirror image.
    pub symmetry: Symmetry,
    /// `[n]` characteristic sizes of the states.
    pub scales: Vec<f64>,
    /// `[n]` periods of the states that are angles; see [`crate::contract::VectorField::periods`].
    pub periods: Vec<f64>,
    /// True if half a period maps the symmetric cycle to its mirror image.
    pub half: bool,
}

/// Asymmetry, relative to the size of the solution, below which it counts as symmetric.
const SYMMETRIC: f64 = 1e-5;

impl Mirrors {
    /// Samples of a solution, and its difference from its mirror image.
    fn parts(&self, point: &Point) -> (Vec<f64>, Vec<f64>) {
        let (x, n) = match &point.solution {
            Solution::Equilibrium(x) => (x.clone(), x.len()),
            Solution::Cycle(cycle) => (cycle.level(SAMPLES), cycle.dim()),
            Solution::Torus(torus) => (torus.section(0.0), torus.dim()),
        };
        let shift = if self.half && x.len() > n { x.len() / 2 } else { 0 };
        let mean = |c: usize| x.iter().skip(c).step_by(n).sum::<f64>() * n as f64 / x.len() as f64;
        let mut twice: Vec<f64> = vec![0.0; n];
        for (c, period) in self.periods.iter().enumerate().filter(|(_, period)| period.is_finite()) {
            // An angle and its mirror image lie symmetrically about a multiple of half a turn.
            twice[c] = period * (2.0 * mean(c) / period).round();
        }
        let image = |k: usize| {
            let (from, negated) = self.symmetry.image(k % n);
            let value = x[k - k % n + from];
            if negated { twice[k % n] - value } else { value }
        };
        let left = (0..x.len()).map(|k| x[(k + shift) % x.len()] - image(k)).collect();
        (x, left)
    }
}

impl Monitor for Mirrors {
    fn kind(&self) -> Kind {
        Kind::BranchPoint
    }

    fn value(&self, reference: &Point, at: &Point) -> f64 {
        let n = self.scales.len();
        let (x, own) = self.parts(reference);
        let other = if std::ptr::eq(reference, at) { own.clone() } else { self.parts(at).1 };
        if own.len() != other.len() {
            return 1.0;
        }
        let square = |v: &[f64], c: usize| v.iter().skip(c).step_by(n).map(|a| a * a).sum::<f64>();
        let (mut total, mut size) = (0.0, 0.0);
        for c in 0..n {
            let weight = square(&x, c) + (x.len() / n) as f64 * self.scales[c] * self.scales[c];
            size += square(&own, c) / weight;
            total += (c..own.len()).step_by(n).map(|k| own[k] * other[k]).sum::<f64>() / weight;
        }
        if size < SYMMETRIC * SYMMETRIC { 1.0 } else { total / size }
    }

    fn confirms(&self, _at: &Point) -> bool {
        true
    }

    fn jump(&self) -> usize {
        0
    }
}

impl Monitor for Halves<'_> {
    fn kind(&self) -> Kind {
        Kind::PeriodDoubling
    }

    fn value(&self, reference: &Point, at: &Point) -> f64 {
        if !self.comparable(reference) {
            return 1.0;
        }
        compare(reference, at, self.scales, |x, _| {
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

/// Result of [`compare`] for deviations from the means, by Gauss quadrature.
fn on_one_mesh(a: &Cycle, b: &Cycle, extents: &[f64]) -> f64 {
    let (scheme, n) = (a.scheme(), a.dim());
    let block = (a.degree + 1) * n;
    // Means of a, b, a² and a b.
    let mut sums = vec![[0.0; 4]; n];
    let intervals = a.profile.chunks_exact(block).zip(b.profile.chunks_exact(block));
    for ((x, y), ends) in intervals.zip(a.mesh.windows(2)) {
        let nodes = x[n..].chunks_exact(n).zip(y[n..].chunks_exact(n));
        for ((x, y), share) in nodes.zip(&scheme.weights) {
            let weight = (ends[1] - ends[0]) * share;
            for (sum, (x, y)) in sums.iter_mut().zip(x.iter().zip(y)) {
                let (x, y, weighted) = (*x, *y, weight * x);
                *sum = [sum[0] + weighted, sum[1] + weight * y, sum[2] + weighted * x, sum[3] + weighted * y];
            }
        }
    }
    let own: Vec<[f64; 2]> = sums.iter().map(|[x, y, square, product]| [square - x * x, product - x * y]).collect();
    mean_share(&own, extents)
}

/// Relative deviation of a component, compared with the largest one, below which it is noise. Empirical: near the
/// simpler solution, deviations of symmetric components are errors of the solution, and those that break the symmetry
/// are much larger.
const NOISE: f64 = 1e-3;

/// Mean over the components of the inner product of two deviations, relative to the square of the first; `own` holds
/// square and product for each component. Components that hardly deviate are omitted, since their quotients would be
/// rounding errors.
fn mean_share(own: &[[f64; 2]], extents: &[f64]) -> f64 {
    let size = |c: usize| own[c][0] / extents[c].powi(2);
    let largest = (0..own.len()).map(size).fold(f64::MIN_POSITIVE, f64::max);
    let (mut total, mut count) = (0.0, 0);
    for c in (0..own.len()).filter(|c| size(*c) > NOISE * NOISE * largest) {
        total += own[c][1] / own[c][0];
        count += 1;
    }
    total / f64::from(count.max(1))
}

/// Residual that Newton's method may leave in a zero state, relative to its scale: ten times its tolerance, which is
/// 1e-3 of the requested error (1e-6 by default).
const LEFT: f64 = 1e-8;

/// Extents of the states of a cycle, the units of their deviations. A state that is identically zero, as on an
/// invariant plane, has the extent of its errors.
fn extents(at: &Point, scales: &[f64]) -> Vec<f64> {
    let of = |c: usize| at.ranges.get(c).map_or(1.0, |[low, high]| (high - low).max(low.abs()).max(high.abs()));
    scales.iter().enumerate().map(|(c, scale)| of(c).max(LEFT * scale)).collect()
}

/// Inner product of the deviations of both points, relative to that of the reference.
fn compare(reference: &Point, at: &Point, scales: &[f64], deviation: impl Fn(&[f64], usize) -> Vec<f64>) -> f64 {
    let (Solution::Cycle(a), Solution::Cycle(b)) = (&reference.solution, &at.solution) else { return 1.0 };
    let n = a.dim();
    let da = deviation(&a.level(SAMPLES), n);
    let other = if std::ptr::eq(a, b) { None } else { Some(deviation(&b.level(SAMPLES), n)) };
    let db = other.as_ref().unwrap_or(&da);
    // Normalise each component, so that units do not matter.
    let mut sums = vec![[0.0; 2]; n];
    for (k, (x, y)) in da.iter().zip(db).enumerate() {
        let sum = &mut sums[k % n];
        *sum = [sum[0] + x * x, sum[1] + x * y];
    }
    mean_share(&sums, &extents(reference, scales))
}
