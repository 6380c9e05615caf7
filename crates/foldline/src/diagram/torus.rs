//! A torus as trajectories from equally spaced phases.

use super::Mesh;
use crate::problem::gauss::Scheme;
use crate::problem::torus::phases;

/// A two-dimensional invariant torus: K trajectories over a period T, K odd, which start at equally spaced phases of the
/// closed curve that the torus has in common with the section t = 0.
///
/// The trajectory from phase φ ends at phase φ + ρ of the same curve; phases count turns, from 0 to 1. Between the
/// trajectories the torus is a trigonometric polynomial in φ.
#[derive(Clone, Debug, PartialEq)]
pub struct Torus {
    /// T, in the time unit of the model: the forcing period, or the period of one of the two motions.
    pub period: f64,
    /// ρ, the rotation number: turns in the second angle per period.
    pub rotation: f64,
    /// Number of forcing periods in T; 0 for an autonomous model.
    pub forcing_periods: u32,
    /// `[N + 1 + K]`: boundaries of the N mesh intervals in time, from 0 to 1, then 1 + k / K for k = 1 … K.
    pub mesh: Mesh,
    /// m, the degree of the polynomials in time.
    pub degree: usize,
    /// `[N][m + 1][K][n]` values; node 0 of an interval is its left end, the others are Gauss points.
    pub profile: Vec<f64>,
}

impl Torus {
    /// K, the number of trajectories.
    pub fn phases(&self) -> usize {
        phases::count(&self.mesh)
    }

    /// N, the number of mesh intervals in time.
    pub fn intervals(&self) -> usize {
        self.mesh.len().saturating_sub(1 + self.phases())
    }

    /// n, the number of states.
    pub fn dim(&self) -> usize {
        self.profile.len() / (self.intervals() * (self.degree + 1) * self.phases()).max(1)
    }

    /// Both angular frequencies in the time unit of the model: 2π / T, and ρ times that.
    pub fn frequencies(&self) -> [f64; 2] {
        let first = std::f64::consts::TAU / self.period;
        [first, self.rotation * first]
    }

    /// States `[K][n]` of the trajectories at normalised time `t` in [0, 1].
    pub fn section(&self, t: f64) -> Vec<f64> {
        let (count, width) = (self.intervals(), self.phases() * self.dim());
        let mut x = vec![0.0; width];
        let j = self.mesh[..=count].partition_point(|b| *b <= t).clamp(1, count) - 1;
        let block = (self.degree + 1) * width;
        let s = (t - self.mesh[j]) / (self.mesh[j + 1] - self.mesh[j]);
        Scheme::of(self.degree).value_into(s, &self.profile[j * block..(j + 1) * block], &mut x);
        x
    }

    /// State `[n]` at phase `turns` and normalised time `t` of the trajectory that starts there.
    pub fn state(&self, turns: f64, t: f64) -> Vec<f64> {
        phases::between(&self.section(t), self.dim(), turns)
    }

    /// States `[phases][times][n]` of the torus as a function of two angles, each from 0 to 1 without the end: the phase
    /// on the closed curve at fixed time, and time over the period.
    pub fn grid(&self, phases: usize, times: usize) -> Vec<f64> {
        let n = self.dim();
        let mut all = vec![0.0; phases * times * n];
        for s in 0..times {
            let t = s as f64 / times as f64;
            let section = self.section(t);
            for k in 0..phases {
                // The trajectory from phase φ is at angle φ + ρ t.
                let own = phases::between(&section, n, k as f64 / phases as f64 - self.rotation * t);
                all[(k * times + s) * n..(k * times + s + 1) * n].copy_from_slice(&own);
            }
        }
        all
    }
}
