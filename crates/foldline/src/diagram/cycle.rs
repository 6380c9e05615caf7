//! A periodic orbit as piecewise polynomials.

use super::Mesh;
use crate::problem::gauss::{Points, Scheme};

/// A periodic orbit: polynomials of degree m on each of N mesh intervals, in normalised time t/T ∈ [0, 1].
///
/// On interval j the polynomial is given by its values at the left end and at the m collocation points, so the profile is
/// laid out `[interval][node 0..=m][component]`; node 0 is the left end. The orbit closes: the right end of the last
/// interval is the left end of the first, plus `gain` if angles turn.
///
/// A cycle of a map has degree 0: N equal intervals, on each of which the state is that of one iterate.
#[derive(Clone, Debug, PartialEq)]
pub struct Cycle {
    /// T, in the time unit of the model.
    pub period: f64,
    /// Number of forcing periods in one period of the cycle; 0 for an autonomous model.
    pub forcing_periods: u32,
    /// `[N + 1]` interval boundaries from 0 to 1.
    pub mesh: Mesh,
    /// m.
    pub degree: usize,
    /// Kind of the collocation points.
    pub points: Points,
    /// `[N · (m + 1) · n]` values.
    pub profile: Vec<f64>,
    /// `[n]` x(T) - x(0): a whole number of turns for each angle, 0 for other states; empty if no angle turns.
    pub gain: Vec<f64>,
}

impl Cycle {
    /// Returns the cycle through given states: `times` `[K]` in normalised time from 0 to 1, `states` `[K][n]`. Every
    /// `through` time steps make a mesh interval, which carries the polynomial through its `through + 1` states; the
    /// state at time 1 enters through the last polynomial only. The result has polynomials of degree `degree`.
    ///
    /// `None` unless the times increase from 0 to 1, K - 1 is a multiple of `through`, and there is a state for each
    /// time.
    pub fn given(period: f64, times: &[f64], states: &[f64], through: usize, degree: usize) -> Option<Cycle> {
        let (&first, &last) = times.first().zip(times.last())?;
        let increase = times.windows(2).all(|pair| pair[0] < pair[1]);
        let n = states.len() / times.len();
        let whole = through > 0 && times.len() > through && (times.len() - 1).is_multiple_of(through);
        if !increase || first != 0.0 || last != 1.0 || n == 0 || states.len() != n * times.len() || !whole {
            return None;
        }
        let scheme = Scheme::new(degree);
        let mut profile = Vec::with_capacity(times.len().div_ceil(through) * (degree + 1) * n);
        for (interval, nodes) in times[..times.len() - 1].chunks_exact(through).enumerate() {
            let start = interval * through;
            let ends = [nodes[0], times[start + through]];
            for c in &scheme.nodes {
                let weights = lagrange(&times[start..=start + through], ends[0] + c * (ends[1] - ends[0]));
                let value = |i: usize| (0..=through).map(|k| weights[k] * states[(start + k) * n + i]).sum::<f64>();
                profile.extend((0..n).map(value));
            }
        }
        let mesh: Vec<f64> = times.iter().copied().step_by(through).collect();
        Some(Cycle {
            points: crate::problem::gauss::Points::Gauss,
            period,
            forcing_periods: 0,
            mesh: mesh.into(),
            degree: scheme.degree,
            profile,
            gain: Vec::new(),
        })
    }

    /// An equilibrium as a cycle of period `period`.
    pub(crate) fn at_rest(state: &[f64], period: f64, degree: usize, mesh: &Mesh) -> Cycle {
        let nodes = mesh.len().saturating_sub(1) * (degree + 1);
        let (mesh, profile) = (mesh.clone(), state.repeat(nodes));
        Cycle { period, forcing_periods: 0, mesh, degree, points: Points::Gauss, profile, gain: Vec::new() }
    }

    /// The collocation scheme.
    pub fn scheme(&self) -> &'static Scheme {
        Scheme::at(self.degree, self.points)
    }

    /// These polynomials by their values at collocation points of another kind.
    pub fn with_points(mut self, points: Points) -> Cycle {
        if self.points != points && self.degree > 0 {
            let (old, new, n) = (self.scheme(), Scheme::at(self.degree, points), self.dim());
            for interval in self.profile.chunks_exact_mut((self.degree + 1) * n.max(1)) {
                let before = interval.to_vec();
                let nodes = interval.chunks_exact_mut(n.max(1)).zip(&new.nodes);
                nodes.skip(1).for_each(|(x, c)| old.value_into(*c, &before, x));
            }
            self.points = points;
        }
        self
    }

    /// Number of mesh intervals N.
    pub fn intervals(&self) -> usize {
        self.mesh.len().saturating_sub(1)
    }

    /// Number of states n.
    pub fn dim(&self) -> usize {
        self.profile.len() / (self.intervals() * (self.degree + 1)).max(1)
    }

    /// True if an angle turns over a period.
    pub fn turns(&self) -> bool {
        !self.gain.is_empty()
    }

    /// Returns the state `[n]` at normalised time `t`, which may lie outside [0, 1].
    pub fn state(&self, t: f64) -> Vec<f64> {
        let mut x = vec![0.0; self.dim()];
        self.state_into(self.scheme(), t, &mut x);
        x
    }

    /// Returns `count` states `[count][n]` at uniformly spaced times over one period, the end point excluded.
    pub fn uniform(&self, count: usize) -> Vec<f64> {
        let (n, scheme) = (self.dim(), self.scheme());
        let mut out = vec![0.0; count * n];
        let mut j = 1;
        for (s, x) in out.chunks_exact_mut(n.max(1)).enumerate() {
            let t = s as f64 / count as f64;
            while j < self.intervals() && self.mesh[j] <= t {
                j += 1;
            }
            self.state_within(scheme, j - 1, t, x);
        }
        out
    }

    /// Returns the state `[n]` at the end of the period, from the last polynomial.
    pub(crate) fn end(&self) -> Vec<f64> {
        let mut x = vec![0.0; self.dim()];
        if self.degree == 0 {
            self.state_into(self.scheme(), 1.0, &mut x);
            return x;
        }
        self.state_within(self.scheme(), self.intervals() - 1, 1.0, &mut x);
        x
    }

    /// Returns the states of [`Cycle::uniform`] with the gain of angles removed in proportion to time.
    pub(crate) fn level(&self, count: usize) -> Vec<f64> {
        let mut out = self.uniform(count);
        if self.turns() {
            for (s, x) in out.chunks_exact_mut(self.dim()).enumerate() {
                let t = s as f64 / count as f64;
                x.iter_mut().zip(&self.gain).for_each(|(x, gain)| *x -= t * gain);
            }
        }
        out
    }

    /// Returns the state `[n]` at a fraction `s` of interval j, by its own polynomial also at its end.
    pub(crate) fn state_in(&self, j: usize, s: f64) -> Vec<f64> {
        let mut x = vec![0.0; self.dim()];
        let t = self.mesh[j] + s * (self.mesh[j + 1] - self.mesh[j]);
        self.state_within(self.scheme(), j, t, &mut x);
        x
    }

    /// Evaluates the state at time `t` in interval j.
    fn state_within(&self, scheme: &Scheme, j: usize, t: f64, x: &mut [f64]) {
        if self.degree == 0 {
            let n = x.len();
            return x.copy_from_slice(&self.profile[j * n..(j + 1) * n]);
        }
        let s = (t - self.mesh[j]) / (self.mesh[j + 1] - self.mesh[j]);
        let block = (self.degree + 1) * x.len();
        scheme.value_into(s, &self.profile[j * block..(j + 1) * block], x);
    }

    pub(crate) fn state_into(&self, scheme: &Scheme, t: f64, x: &mut [f64]) {
        let periods = t.floor();
        let t = t - periods;
        let j = self.mesh.partition_point(|&b| b <= t).clamp(1, self.intervals()) - 1;
        self.state_within(scheme, j, t, x);
        x.iter_mut().zip(&self.gain).for_each(|(x, gain)| *x += periods * gain);
    }
}

/// Evaluates the Lagrange basis polynomials of the nodes at `t`.
fn lagrange(nodes: &[f64], t: f64) -> Vec<f64> {
    let others = |k: usize| nodes.iter().enumerate().filter(move |(l, _)| *l != k);
    (0..nodes.len()).map(|k| others(k).map(|(_, other)| (t - other) / (nodes[k] - other)).product()).collect()
}
