//! Side of nearby special points on which a solution lies.
//!
//! **Idea.** Two meshes give the same curve up to its stated error, and special points can be closer together than
//! that. A point that is transferred to another mesh, or met again after a lap, may therefore end up on the other side
//! of one of them, which would then be passed twice or never. The order along the curve is invariant: a point lies in
//! the interval between special points in which the number of unstable multipliers and the signs of all monitors agree
//! with its own. It is moved along the curve, within its error, until they do.
//!
//! **Fails when** another mesh has the special points in another order, or an additional pair of them: then there is no
//! such position.

use super::corrector::{Failure, Plane, Station, correct, doubted, station};
use super::follow::{Follow, SHORT};
use crate::diagram::{Cost, Mesh, Point};

/// Number of unstable multipliers and signs of monitors, which identify the side of special points on which a point
/// lies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Signature {
    unstable: usize,
    positive: Vec<bool>,
}

/// Positions that are tried first, as shares of the reach.
const SHARES: [f64; 9] = [0.0, 0.001, -0.001, 0.01, -0.01, 0.1, -0.1, 1.0, -1.0];
/// Maximum number of further positions in between.
const MOST: usize = 60;
/// Distance along the curve below which rounding makes two positions indistinguishable.
const FINEST: f64 = 1e-12;

impl Follow<'_> {
    /// Signature of a point whose tangent points towards larger positions.
    pub(super) fn signature(&self, point: &Point) -> Signature {
        let telling = self.monitors.iter().filter(|m| m.jump() > 0 && m.kind() != crate::diagram::Kind::BranchPoint);
        Signature { unstable: point.unstable, positive: telling.map(|m| m.value(point, point) > 0.0).collect() }
    }

    /// True if an interval is so short that it must be examined on one mesh, because two meshes agree to the tolerance
    /// only.
    pub(super) fn is_short(&self, mesh: &Mesh, length: f64) -> bool {
        !mesh.is_empty() && length.abs() < SHORT * self.settings.tolerance
    }

    /// Station near `around`, no farther than `reach`, that has the given signature. `at` computes the station at a
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
        // Positions between two that differ, in the largest gap first.
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

    /// Station at `u`, which has been corrected on the mesh of `left`, without adapting that mesh.
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

    /// Moves a station to another mesh, on the same side of special points; `None` if there is no such position within
    /// its error.
    pub(super) fn carried(&mut self, from: &Station, mesh: &Mesh, length: f64, cost: &mut Cost) -> Option<Station> {
        let base = self.problem.carry(&from.u, &from.mesh, mesh);
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
