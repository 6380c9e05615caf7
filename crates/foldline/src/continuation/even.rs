//! Branch points of boundary-value problems at which the null space has an even dimension.
//!
//! **Idea.** A solution of a boundary-value problem has no spectrum, only one number d, which has the sign of the determinant
//! of F_u and vanishes with its smallest singular value ([`crate::problem::cycle`]). Where an even number of singular values
//! vanish at one point, d touches zero without a change of sign, like |s|. If d is about to vanish on a step and has not changed
//! its sign at the end, the place where it is smallest is searched for. Either it vanishes there; or it changes its sign, and two
//! branch points are close together; or it stays away from zero, and the crossing is imperfect.
//!
//! **Fails when** the step before shows no trend towards zero, or an odd number of at least three vanish: the point is then found,
//! but not all branches that leave it.

use super::follow::Follow;
use super::inspect::History;
use super::locate::{Located, Stretch};
use super::opposite::Exchange;
use crate::contract::Sight;
use crate::diagram::{Cost, Kind};

/// Share of the values at the ends that counts as zero: the accuracy of a located point, relative to a step, with a factor of
/// safety.
const NOTHING: f64 = 1e-6;
/// Factor by which the trend may fall short of zero, since d is curved.
const TREND: f64 = 1.5;
/// Place, from either end, at which it is seen whether d falls towards the other end.
const BESIDE: f64 = 0.03;
/// Largest number of halvings of the step: to rounding.
const HALVINGS: usize = 36;
/// Share of an interval over which the sense of d is seen.
const NEXT: f64 = 0.02;

impl Follow<'_> {
    /// Searches a step on which the number in place of a spectrum keeps its sign for a place where it touches zero; see the
    /// module. `values` are those of monitor `k` at both ends.
    pub(super) fn touching(
        &mut self,
        k: usize,
        values: [f64; 2],
        stretch: &Stretch,
        history: Option<&History>,
        cost: &mut Cost,
    ) -> Option<Exchange> {
        let ([a, b], length) = (values, stretch.length);
        if stretch.left.point.spectrum.len() != 1 || stretch.left.mesh.is_empty() || !(a * b > 0.0) {
            return None;
        }
        let trend = match history {
            Some(before) => (a - before.values[k]) / before.distance,
            None => (self.sized(k, stretch, BESIDE * length, cost)? - a) / (BESIDE * length.abs()),
        };
        if (a + TREND * length.abs() * trend) * a > 0.0 {
            return None;
        }
        // d still falls at the end: its zero lies beyond.
        if self.sized(k, stretch, (1.0 - BESIDE) * length, cost)?.abs() > b.abs() {
            return None;
        }
        let (mut low, mut high) = (0.0, length);
        let mut least = (a.abs().min(b.abs()), 0.0);
        for _ in 0..HALVINGS {
            // At the point itself the matrix may be singular.
            let near = [0.5, 0.47, 0.55].map(|share| low + share * (high - low));
            let found = near.into_iter().find_map(|s| {
                let next = s + NEXT * (high - low);
                Some((s, self.sized(k, stretch, s, cost)?, next, self.sized(k, stretch, next, cost)?))
            });
            let Some((middle, here, next, beside)) = found else { break };
            if here * a < 0.0 || beside * a < 0.0 {
                return Some(Exchange::Apart(if here * a < 0.0 { middle } else { next }));
            }
            if here.abs() < least.0 {
                least = (here.abs(), middle);
            }
            if here.abs() < NOTHING * a.abs().min(b.abs()) {
                break;
            }
            if beside.abs() < here.abs() { low = middle } else { high = next }
        }
        if least.0 > NOTHING * a.abs().min(b.abs()) {
            return None;
        }
        let station = stretch.at(self.problem, self.settings, least.1, cost).ok()?;
        let error = (high - low).abs() + self.settings.newton_tolerance();
        Some(Exchange::Together(Kind::BranchPoint, Box::new(Located { distance: least.1, station, error })))
    }

    /// Value of monitor `k` at distance s.
    fn sized(&mut self, k: usize, stretch: &Stretch, s: f64, cost: &mut Cost) -> Option<f64> {
        let found = stretch.seen_at(Sight::Stability, self.problem, self.settings, s, cost).ok()?;
        Some(self.monitors[k].value(&found.point, &found.point)).filter(|value| value.is_finite())
    }
}
