//! Meshes of a cycle: workspace, transfer of profiles, and adaptation to a tolerance.

use super::CycleProblem;
use crate::diagram::Mesh;
use crate::problem::mesh::{self, Passage};
use crate::special::collapse;

/// Error of each interval of a new mesh, in tolerances: so small that the mesh serves for the next points too.
const TARGET: f64 = 0.1;

/// Number of mesh pairs that are remembered: one step transfers back and forth between those of its ends and of the
/// previous point.
const PASSAGES: usize = 4;

impl CycleProblem<'_> {
    /// Resizes the workspace for the current mesh.
    pub(super) fn arrange(&mut self) {
        self.measured.replace(None);
        self.local = None;
        self.anchored.clear();
        self.unphased = false;
        let (n, count, mesh) = (self.n, self.intervals(), &self.mesh);
        self.system.resize(count);
        (self.length, self.width) = (self.system.length(), self.system.lanes());
        self.lengths = (0..self.system.places())
            .map(|k| k / self.width + k % self.width * self.length)
            .map(|j| if j < count { mesh[j + 1] - mesh[j] } else { 0.0 })
            .collect();
        let lanes = self.lanes();
        self.times = match self.is_forced() {
            true => (0..lanes).map(|at| self.time_of(at)).collect(),
            false => Vec::new(),
        };
        self.phase.resize(lanes * n, 0.0);
        self.states.resize(lanes * n, 0.0);
        self.ends.resize(self.length * self.width * n, 0.0);
        self.f.resize(lanes * n, 0.0);
        self.fx.resize(lanes * n * n, 0.0);
        self.fp.resize(lanes * n * self.setting.freedom(), 0.0);
    }

    /// Transfers a profile to another mesh.
    pub(super) fn passed(&self, profile: &[f64], from: &Mesh, to: &Mesh) -> Vec<f64> {
        let mut known = self.passages.borrow_mut();
        let at = known.iter().position(|passage| passage.is_between(from, to));
        let at = at.unwrap_or_else(|| {
            if known.len() == PASSAGES {
                known.remove(0);
            }
            known.push(Passage::new(&self.scheme, from, to));
            known.len() - 1
        });
        known[at].carried(profile, self.n)
    }

    /// Mesh for a tolerance at `u`, from the errors on the current one.
    pub(super) fn equidistributed(&self, u: &[f64], errors: &[f64], tolerance: f64, kept: f64) -> Option<Mesh> {
        let (degree, target) = (self.scheme.degree, TARGET * tolerance);
        // Orbits of boundary-value problems that need more have sharp layers, in which rounding limits the error.
        let most = if self.is_open() { mesh::LARGEST } else { mesh::largest(self.n, degree) };
        let limits = (degree, most);
        if self.halves {
            mesh::equidistributed_in_halves(errors, &self.mesh, limits, target, kept)
        } else if !self.is_open() && self.nearly_doubled(u) {
            let (errors, halved) = mesh::halved(errors, &self.mesh, degree);
            mesh::equidistributed_in_halves(&errors, &halved, limits, target, kept)
        } else {
            mesh::equidistributed(errors, &self.mesh, limits, target, kept)
        }
    }

    /// True if the halves of the cycle differ little, so that it may be about to become a cycle of half the period.
    pub(super) fn nearly_doubled(&self, u: &[f64]) -> bool {
        const PLACES: usize = 16;
        let state = |t: f64, x: &mut [f64]| {
            let (j, block) = (self.mesh.partition_point(|b| *b <= t).clamp(1, self.intervals()) - 1, self.block());
            self.scheme.value_into((t - self.mesh[j]) / self.h(j), &u[j * block..(j + 1) * block], x);
        };
        let mut room = vec![0.0f64; 5 * self.n];
        let (x, rest) = room.split_at_mut(self.n);
        let (y, rest) = rest.split_at_mut(self.n);
        let (apart, rest) = rest.split_at_mut(self.n);
        let (lowest, highest) = rest.split_at_mut(self.n);
        lowest.fill(f64::INFINITY);
        highest.fill(f64::NEG_INFINITY);
        for k in 0..PLACES {
            let t = 0.5 * (k as f64 + 0.3) / PLACES as f64;
            state(t, x);
            state(t + 0.5, y);
            y.iter_mut().zip(&self.gain).for_each(|(y, gain)| *y -= 0.5 * gain);
            for c in 0..self.n {
                apart[c] = apart[c].max((x[c] - y[c]).abs());
                lowest[c] = lowest[c].min(x[c].min(y[c]));
                highest[c] = highest[c].max(x[c].max(y[c]));
            }
        }
        (0..self.n).all(|c| apart[c] <= collapse::NEARLY * (highest[c] - lowest[c]))
    }
}
