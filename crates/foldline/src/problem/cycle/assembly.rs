//! The matrix of a cycle: equations (1) to (3) of [`super`] linearised, and its antiperiodic relative.

use super::CycleProblem;
use crate::contract::{Batch, Parameters};
use crate::linalg::max_abs;

impl CycleProblem<'_> {
    /// Profile of an antiperiodic null vector of the variational equation at `u` (it changes sign after one period), if
    /// there is one: the direction of period doubling. Layout of the profile.
    pub fn antiperiodic_direction(&mut self, u: &[f64]) -> Option<Vec<f64>> {
        let row = vec![0.0; self.setting.freedom() * u.len()];
        self.fill(u, &row);
        let q = 1 + self.setting.freedom();
        // The scalars are frozen by a unit corner, so only the profile moves.
        self.system.border.fill(0.0);
        (0..q * q).for_each(|k| self.system.corner[k] = if k % (q + 1) == 0 { 1.0 } else { 0.0 });
        self.system.condense().ok()?;
        self.system.eliminate(-1.0).ok()?;
        let size = self.profile_size();
        let mut v: Vec<f64> = (0..size + q).map(|k| ((k * k) as f64 * 0.7 + 0.3).sin()).collect();
        let mut next = v.clone();
        for _ in 0..4 {
            v[size..].fill(0.0);
            self.system.solve(&v, &mut next);
            let norm = max_abs(&next);
            if !norm.is_finite() || norm == 0.0 {
                return None;
            }
            v.iter_mut().zip(&next).for_each(|(a, b)| *a = b / norm);
        }
        v.truncate(size);
        Some(v)
    }

    /// Gathers the Gauss points, component-major.
    pub(super) fn gather(&mut self, u: &[f64]) {
        let (n, m, lanes) = (self.n, self.scheme.degree, self.intervals() * self.scheme.degree);
        for j in 0..self.intervals() {
            for k in 0..m {
                let x = &u[(j * (m + 1) + k + 1) * n..(j * (m + 1) + k + 2) * n];
                for i in 0..n {
                    self.states[i * lanes + j * m + k] = x[i];
                }
            }
        }
    }

    /// Linearises at `u` and fills the blocks; the `rows` act through [`ZeroProblem::dot`].
    pub(super) fn fill(&mut self, u: &[f64], rows: &[f64]) {
        let (n, m, count) = (self.n, self.scheme.degree, self.intervals());
        let (lanes, size, inner, block) = (count * m, self.profile_size(), m * n, (m + 1) * n);
        let (period, k_free) = (u[size], self.setting.freedom());
        self.gather(u);
        let parameters = self.setting.at(&u[size + 1..]);
        let batch = Batch { lanes, states: &self.states, parameters: Parameters::Shared(&parameters) };
        self.setting.linearise(batch, &mut self.f, &mut self.fx, &mut self.fp);
        self.trace = 0.0;
        self.system.interior.fill(0.0);
        self.system.coupling.fill(0.0);
        self.system.border.fill(0.0);
        let width = n + 1 + k_free;
        for j in 0..count {
            let h = self.mesh[j + 1] - self.mesh[j];
            let ht = h * period;
            let a = &mut self.system.interior[j * inner * inner..(j + 1) * inner * inner];
            let b = &mut self.system.coupling[j * inner * width..(j + 1) * inner * width];
            for i in 0..m {
                let lane = j * m + i;
                for c in 0..n {
                    let line = &mut a[(i * n + c) * inner..(i * n + c + 1) * inner];
                    for k in 0..m {
                        line[k * n + c] = self.scheme.derivative[i * (m + 1) + k + 1];
                    }
                    for d in 0..n {
                        line[i * n + d] -= ht * self.fx[(c * n + d) * lanes + lane];
                    }
                    self.trace += ht * self.scheme.weights[i] * self.fx[(c * n + c) * lanes + lane];
                    let right = &mut b[(i * n + c) * width..(i * n + c + 1) * width];
                    right[c] = self.scheme.derivative[i * (m + 1)];
                    right[n] = -h * self.f[c * lanes + lane];
                    for a in 0..k_free {
                        right[n + 1 + a] = -ht * self.fp[(c * k_free + a) * lanes + lane];
                    }
                }
                for c in 0..n {
                    let at = j * block + (i + 1) * n + c;
                    let weight = h * self.scheme.weights[i];
                    self.system.border[at] = weight * self.phase[(j * m + i) * n + c];
                    for (r, row) in rows.chunks_exact(u.len()).enumerate() {
                        self.system.border[(1 + r) * size + at] =
                            weight * row[at] / (self.scale[c] * self.scale[c] * n as f64);
                    }
                }
            }
        }
        let q = 1 + k_free;
        self.system.corner[..q].fill(0.0);
        for (r, row) in rows.chunks_exact(u.len()).enumerate() {
            let corner = &mut self.system.corner[(1 + r) * q..(2 + r) * q];
            corner[0] = row[size] / (self.period_scale * self.period_scale);
            for (a, axis) in self.setting.axes.iter().enumerate() {
                corner[1 + a] = row[size + 1 + a] / (axis.scale * axis.scale);
            }
        }
    }
}
