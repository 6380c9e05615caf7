//! A periodic orbit as piecewise polynomials.

use super::Mesh;
use crate::problem::gauss::Scheme;

/// A periodic orbit: polynomials of degree m on each of N mesh intervals, in normalised time t/T ∈ [0, 1].
///
/// On interval j the polynomial is given by its values at the left end and at the m Gauss points, so the profile is laid
/// out `[interval][node 0..=m][component]`; node 0 is the left end. The orbit closes: the right end of the last interval
/// is the left end of the first.
#[derive(Clone, Debug, PartialEq)]
pub struct Cycle {
    /// T, in the time unit of the model.
    pub period: f64,
    /// How many periods of the forcing it lasts; 0 where the model is autonomous.
    pub forcing_periods: u32,
    /// `[N + 1]` interval boundaries from 0 to 1.
    pub mesh: Mesh,
    /// m.
    pub degree: usize,
    /// `[N · (m + 1) · n]` values.
    pub profile: Vec<f64>,
}

impl Cycle {
    /// N.
    pub fn intervals(&self) -> usize {
        self.mesh.len().saturating_sub(1)
    }

    /// n.
    pub fn dim(&self) -> usize {
        self.profile.len() / (self.intervals() * (self.degree + 1)).max(1)
    }

    /// The state `[n]` at normalised time `t` (taken modulo 1).
    pub fn state(&self, t: f64) -> Vec<f64> {
        let mut x = vec![0.0; self.dim()];
        let scheme = Scheme::new(self.degree);
        self.state_into(&scheme, t, &mut x);
        x
    }

    /// `count` states at uniformly spaced times over one period, the end point excluded: `[count][n]`.
    pub fn uniform(&self, count: usize) -> Vec<f64> {
        let n = self.dim();
        let scheme = Scheme::new(self.degree);
        let mut out = vec![0.0; count * n];
        for (s, x) in out.chunks_exact_mut(n.max(1)).enumerate() {
            self.state_into(&scheme, s as f64 / count as f64, x);
        }
        out
    }

    pub(crate) fn state_into(&self, scheme: &Scheme, t: f64, x: &mut [f64]) {
        let n = x.len();
        let t = t - t.floor();
        let j = self.mesh.partition_point(|&b| b <= t).clamp(1, self.intervals()) - 1;
        let s = (t - self.mesh[j]) / (self.mesh[j + 1] - self.mesh[j]);
        let block = (self.degree + 1) * n;
        scheme.value_into(s, &self.profile[j * block..(j + 1) * block], x);
    }
}
