//! On which side of the special points close by a solution lies.
//!
//! **Idea.** Two meshes give the same curve up to its stated error, and special points can lie closer together than that. So a
//! point that is carried to another mesh, or met again after a lap, may come to lie on the other side of one of them, which would
//! then be passed twice or never. What is invariant is the order: a point belongs to the stretch between two
//! special points in which number of unstable multipliers and signs of all monitors are its own. It is moved along the curve,
//! within its error, until they are.
//!
//! **Fails when** another mesh has special points in another order, or one pair of them more: then there is no such place.

use super::corrector::{Failure, Plane, Station, correct, doubted, station};
use super::follow::{Follow, SHORT};
use crate::diagram::{Cost, Mesh, Point};

/// What tells on which side of special points a point is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Signature {
    unstable: usize,
    positive: Vec<bool>,
}

/// Shares of the reach at which a place is looked for first.
const SHARES: [f64; 9] = [0.0, 0.001, -0.001, 0.01, -0.01, 0.1, -0.1, 1.0, -1.0];
/// Places that are looked at in between.
const MOST: usize = 60;
/// Distance along the curve below which two places are one, for rounding.
const FINEST: f64 = 1e-12;

impl Follow<'_> {
    /// That of a point whose tangent points towards larger positions.
    pub(super) fn signature(&self, point: &Point) -> Signature {
        let telling = self.monitors.iter().filter(|m| m.jump() > 0 && m.kind() != crate::diagram::Kind::BranchPoint);
        Signature { unstable: point.unstable, positive: telling.map(|m| m.value(point, point) > 0.0).collect() }
    }

    /// Whether what lies within so short a stretch is looked at on one mesh: two meshes agree to the tolerance only.
    pub(super) fn is_short(&self, mesh: &Mesh, length: f64) -> bool {
        !mesh.is_empty() && length.abs() < SHORT * self.settings.tolerance
    }

    /// The place nearest to `around` with that signature, no farther than `reach`, of those that `at` gives by their
    /// distance along the curve.
    pub(super) fn on_its_side(
        &mut self,
        wanted: &Signature,
        around: f64,
        reach: f64,
        at: &mut dyn FnMut(&mut Self, f64) -> Option<Station>,
    ) -> Option<Station> {
        let mut seen: Vec<(f64, Signature)> = Vec::new();
        for share in SHARES {
            let s = around + share * reach;
            let Some(found) = at(self, s) else { continue };
            let own = self.signature(&found.point);
            if own == *wanted {
                return Some(found);
            }
            seen.push((s, own));
        }
        // Whatever lies between two places that differ, the largest gap first.
        for _ in 0..MOST {
            seen.sort_by(|a, b| a.0.total_cmp(&b.0));
            let gaps = seen.windows(2).filter(|w| w[0].1 != w[1].1 && w[1].0 - w[0].0 > FINEST);
            let [from, to] = gaps.map(|w| [w[0].0, w[1].0]).max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))?;
            let s = 0.5 * (from + to);
            let found = at(self, s)?;
            let own = self.signature(&found.point);
            if own == *wanted {
                return Some(found);
            }
            seen.push((s, own));
        }
        None
    }

    /// The station at `u`, which has been corrected on the mesh of `left`, on that mesh.
    pub(super) fn unrefined(
        &mut self,
        left: &Station,
        u: Vec<f64>,
        close: f64,
        cost: &mut Cost,
    ) -> Result<Station, Failure> {
        let mut found = station(self.problem, u, &left.tangent, close, self.direction, cost)?;
        found.share = left.share;
        found.roomier = self.problem.better_mesh(&found.u, 0.5 * left.share * self.settings.tolerance);
        doubted(self.problem, &mut found);
        Ok(found)
    }

    /// A station on another mesh, on the same side of special points; `None` where there is no such place within its error.
    pub(super) fn carried(&mut self, from: &Station, mesh: &Mesh, length: f64, cost: &mut Cost) -> Option<Station> {
        let base = self.problem.transfer(&from.u, &from.mesh, mesh);
        let tangent = self.problem.transfer(&from.tangent, &from.mesh, mesh);
        let close = self.settings.closeness(mesh, length);
        let mut at = |walk: &mut Self, s: f64| {
            walk.problem.set_mesh(mesh);
            walk.problem.anchor(&base);
            let mut u: Vec<f64> = base.iter().zip(&tangent).map(|(u, t)| u + s * t).collect();
            let plane = Plane { row: tangent.clone(), base: u.clone(), distance: 0.0 };
            correct(walk.problem, walk.settings, &plane, &mut u, cost).ok()?;
            let mut found = station(walk.problem, u, &tangent, close, walk.direction, cost).ok()?;
            (found.share, found.midway) = (from.share, from.midway);
            found.point.trust.spectrum = from.point.trust.spectrum;
            Some(found)
        };
        if !self.settings.stability {
            return at(self, 0.0);
        }
        let wanted = self.signature(&from.point);
        let tolerance = self.settings.tolerance;
        let reach = (2.0 * from.point.trust.discretisation).clamp(0.1 * tolerance, 10.0 * tolerance);
        let found = self.on_its_side(&wanted, 0.0, reach, &mut at)?;
        let point = Point { position: from.point.position, step: from.point.step, ..found.point };
        Some(Station { point, ..found })
    }
}
