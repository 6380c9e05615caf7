//! A known attractor as a set of states, and the distance to it.
//!
//! **Equations.** With sᵢ = half the range of component i over a cycle, and the given scale of the state for an
//! equilibrium:
//!
//!   (1)  d(x) = min over the orbit of maxᵢ |xᵢ - pᵢ| / sᵢ
//!
//! where the orbit of a cycle is the polygon through its samples.

use super::spectral_ratio;
use crate::diagram::{Cycle, Point, Solution};

/// Number of samples of a cycle, doubled until the polygon through them misses it by SAG at most: N samples miss the
/// k-th harmonic by (πk / N)² / 2 of its amplitude.
const SAMPLES: [usize; 2] = [256, 8192];
/// Largest sag of the polygon, in the measure of (1).
const SAG: f64 = 2e-3;
/// The nearest sample is first sought among every STRIDE-th, in groups of COARSE.
const STRIDE: usize = 4;
const COARSE: usize = SAMPLES[0] / STRIDE;
/// Fraction of its scale against which a component that hardly moves on a cycle is measured.
const FLOOR: f64 = 1e-3;
/// Largest distance (1) between orbits of the same period that are the same solution.
pub(super) const ALIKE: f64 = 0.01;

/// Distance from the stability boundary beyond which a spectrum is conclusive, relative to the largest eigenvalue or,
/// for multipliers, to 1.
const EDGE: f64 = 1e-6;

/// An attractor with a distance function.
#[derive(Clone, Debug)]
pub(super) struct Orbit {
    pub(super) point: Point,
    /// Spectral ratio of a cycle.
    pub(super) ratio: Option<(u32, u32)>,
    /// `[n]` s of (1).
    scale: Vec<f64>,
    /// `[sample][n]`; one sample for an equilibrium.
    states: Vec<f64>,
    /// `[group][n][COARSE]` the coarse samples in units of the scale.
    coarse: Vec<f64>,
    /// Index of the distance of `watch::RADII` at which a steady approach counts, in a map of basins.
    pub(super) early: Option<usize>,
}

/// Returns s of (1) for the samples `[sample][n]` of a cycle.
fn half_ranges(states: &[f64], scales: &[f64]) -> Vec<f64> {
    let half = |(i, scale): (usize, &f64)| {
        let component = states.iter().skip(i).step_by(scales.len());
        let [low, high] = component.fold([f64::MAX, f64::MIN], |[low, high], x| [x.min(low), x.max(high)]);
        (0.5 * (high - low)).max(FLOOR * scale)
    };
    scales.iter().enumerate().map(half).collect()
}

/// Returns samples `[sample][n]` at equal distances along the mesh of a cycle, which has resolved its jumps: as many
/// parts per interval as the polynomials have nodes, and more if there are fewer in total than the first of [`SAMPLES`], with
/// both ends of every interval, since the state may jump between two. The last is repeated to a multiple of that number.
fn along_mesh(cycle: &Cycle) -> Vec<f64> {
    let intervals = cycle.intervals();
    let parts = cycle.degree.max(SAMPLES[0].div_ceil(intervals.max(1))).max(1);
    let share = |k: usize| (k / (parts + 1), (k % (parts + 1)) as f64 / parts as f64);
    let count = intervals * (parts + 1);
    let samples = (0..count.next_multiple_of(SAMPLES[0])).map(|k| share(k.min(count - 1)));
    samples.flat_map(|(j, s)| cycle.state_in(j, s)).collect()
}

impl Orbit {
    pub(super) fn new(point: Point, scales: &[f64], whirl: Option<[usize; 2]>) -> Orbit {
        let ratio = match &point.solution {
            Solution::Cycle(cycle) => whirl.and_then(|whirl| spectral_ratio(cycle, whirl)),
            Solution::Equilibrium(_) | Solution::Torus(_) => None,
        };
        let (states, scale) = match &point.solution {
            Solution::Equilibrium(x) => (x.clone(), scales.to_vec()),
            Solution::Torus(torus) => (torus.section(0.0), scales.to_vec()),
            Solution::Cycle(cycle) => {
                let mut states = cycle.uniform(SAMPLES[0]);
                let scale = half_ranges(&states, scales);
                for doubled in std::iter::successors(Some(2 * SAMPLES[0]), |count| Some(2 * count)) {
                    let finer = cycle.uniform(doubled);
                    if sag(&finer, &scale) <= SAG {
                        break;
                    }
                    if doubled > SAMPLES[1] {
                        // The motion jumps too fast for samples at equal times.
                        let states = along_mesh(cycle);
                        let scale = half_ranges(&states, scales);
                        return Orbit::through(point, ratio, scale, states);
                    }
                    states = finer;
                }
                (states, scale)
            }
        };
        Orbit::through(point, ratio, scale, states)
    }

    fn through(point: Point, ratio: Option<(u32, u32)>, scale: Vec<f64>, states: Vec<f64>) -> Orbit {
        let n = scale.len();
        let every: Vec<&[f64]> = states.chunks_exact(n.max(1)).step_by(STRIDE).collect();
        let group = |group: &[&[f64]]| -> Vec<f64> {
            (0..n).flat_map(|i| group.iter().map(|x| x[i] / scale[i]).collect::<Vec<f64>>()).collect()
        };
        let coarse = every.chunks(COARSE).flat_map(group).collect();
        Orbit { point, ratio, scale, states, coarse, early: None }
    }

    /// Returns the distance (1), searching only between the samples around the nearest coarse sample.
    pub(super) fn distance(&self, x: &[f64]) -> f64 {
        let n = self.scale.len();
        let count = self.states.len() / n.max(1);
        if count < 2 {
            return self.between(x, 0, 0, 0.0);
        }
        let square =
            |k: usize| -> f64 { (0..n).map(|i| ((x[i] - self.states[k * n + i]) / self.scale[i]).powi(2)).sum() };
        let (mut coarse, mut nearest) = (0, f64::INFINITY);
        for (number, group) in self.coarse.chunks_exact(n * COARSE).enumerate() {
            let mut squares = [0.0; COARSE];
            for (i, samples) in group.chunks_exact(COARSE).enumerate() {
                let place = x[i] / self.scale[i];
                squares
                    .iter_mut()
                    .zip(samples)
                    .for_each(|(square, sample)| *square += (place - sample) * (place - sample));
            }
            let least = squares.iter().fold(f64::INFINITY, |m: f64, square| if *square < m { *square } else { m });
            if least < nearest {
                let place = squares.iter().position(|square| *square == least).unwrap_or(0);
                (coarse, nearest) = (STRIDE * (number * COARSE + place), least);
            }
        }
        let around = (0..2 * STRIDE - 1).map(|k| (coarse + count + k + 1 - STRIDE) % count);
        let fine = around.map(|k| (k, square(k))).min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(k, _)| k);
        let neighbours = [(fine + count - 1) % count, (fine + 1) % count];
        let onto = |other: usize| {
            let (mut along, mut length) = (0.0, 0.0);
            for i in 0..n {
                let chord = (self.states[other * n + i] - self.states[fine * n + i]) / self.scale[i];
                along += chord * (x[i] - self.states[fine * n + i]) / self.scale[i];
                length += chord * chord;
            }
            self.between(x, fine, other, if length > 0.0 { (along / length).clamp(0.0, 1.0) } else { 0.0 })
        };
        onto(neighbours[0]).min(onto(neighbours[1]))
    }

    /// Returns the distance from `x` to the point a fraction `s` of the way from one sample to another.
    fn between(&self, x: &[f64], from: usize, to: usize, s: f64) -> f64 {
        let n = self.scale.len();
        (0..n).fold(0.0, |m: f64, i| {
            let p = (1.0 - s) * self.states[from * n + i] + s * self.states[to * n + i];
            m.max((x[i] - p).abs() / self.scale[i])
        })
    }

    /// True if the spectrum clearly shows that the solution attracts. On the stability boundary, as without damping, or
    /// if the spectrum could not be computed, only trajectories can tell.
    pub(super) fn attracts(&self) -> bool {
        let spectrum = self.point.free_spectrum();
        let largest = spectrum.iter().fold(f64::MIN_POSITIVE, |m: f64, z| m.max(z.norm()));
        spectrum.iter().all(|z| match self.is_cycle() {
            true => z.norm() <= 1.0 - EDGE,
            false => z.re <= -EDGE * largest,
        })
    }

    /// True for the orbit of a cycle.
    pub(super) fn is_cycle(&self) -> bool {
        self.point.solution.period().is_some()
    }

    /// True if two orbits are the same solution, each computed to the relative accuracy `tolerance`.
    pub(super) fn same(&self, other: &Orbit, tolerance: f64) -> bool {
        let n = self.scale.len();
        match (self.point.solution.period(), other.point.solution.period()) {
            (None, None) => self.distance(&other.states) <= 100.0 * tolerance,
            (Some(a), Some(b)) => {
                // The period is accurate to the tolerance, the distance only to the sag of the polygon.
                (a - b).abs() <= 100.0 * tolerance * a
                    && other.states.chunks_exact(n).step_by(STRIDE).all(|x| self.distance(x) < ALIKE)
                    && self.states.chunks_exact(n).step_by(STRIDE).all(|x| other.distance(x) < ALIKE)
            }
            _ => false,
        }
    }

    /// Returns the first sample `[n]`.
    pub(super) fn start(&self) -> &[f64] {
        &self.states[..self.scale.len()]
    }

    /// Returns the norm of the first sample, by which equilibria are ordered.
    pub(super) fn norm(&self) -> f64 {
        self.start().iter().map(|x| x * x).sum::<f64>().sqrt()
    }
}

/// Largest distance of every second sample `[sample][n]` from the midpoint of its neighbours, in units of `scale`.
fn sag(samples: &[f64], scale: &[f64]) -> f64 {
    let n = scale.len();
    let count = samples.len() / n;
    let of = |k: usize, i: usize| samples[k % count * n + i];
    let middle = |k: usize, i: usize| (of(k, i) - 0.5 * (of(k - 1, i) + of(k + 1, i))).abs() / scale[i];
    (1..count).step_by(2).flat_map(|k| (0..n).map(move |i| (k, i))).fold(0.0, |m, (k, i)| m.max(middle(k, i)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sag_of_a_polygon_is_that_of_its_arcs() {
        for count in [16, 64] {
            let step = std::f64::consts::TAU / count as f64;
            let samples: Vec<f64> =
                (0..count).flat_map(|k| [3.0 * (k as f64 * step).cos(), (k as f64 * step).sin()]).collect();
            // The larger of the two scaled components: radius times 1 - cos of half the angle subtended by two sides.
            let expected = 1.0 - step.cos();
            let found = sag(&samples, &[3.0, 1.0]);
            assert!(found <= expected * (1.0 + 1e-12) && found > 0.9 * expected, "{found} {expected}");
        }
        assert_eq!(sag(&[0.0, 0.0, 1.0, 2.0, 2.0, 4.0, 1.0, 2.0], &[1.0, 1.0]), 0.0);
    }
}
