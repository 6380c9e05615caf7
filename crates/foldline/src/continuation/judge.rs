//! Whether a step may be accepted.
//!
//! **Idea.** A corrected point can lie on another branch. It does not continue this one if the tangents turn too far, if the
//! prediction was far off, if the chord points elsewhere than both tangents, or, where branches crowd, if the same step
//! backwards leads elsewhere.

use super::corrector::{Failure, Plane, Station, correct};
use super::follow::Follow;
use crate::diagram::Cost;

/// Margin from a singular matrix below which a step must also lead back to where it came from.
const CROWDED: f64 = 0.02;
/// How many tolerances off a step may lead back; more is another branch.
const BACK: f64 = 100.0;
/// Angles of the chord with both tangents: their sum may exceed the angle between the tangents by this factor …
const CHORD_FACTOR: f64 = 1.5;
/// … and this much. On an arc the two are equal; on a jump to another branch the chord points elsewhere.
const CHORD_SLACK: f64 = 0.08;

impl Follow<'_> {
    /// Whether `right`, predicted as `guess`, continues the branch at `left`, and neither turns too far nor lies on another
    /// one.
    pub(super) fn continues(&mut self, left: &Station, right: &Station, guess: &[f64]) -> Result<(), Failure> {
        let (angle, length) = self.angle(left, right);
        let landed = self.problem.transfer(&right.u, &right.mesh, &left.mesh);
        let tangent = self.problem.transfer(&right.tangent, &right.mesh, &left.mesh);
        let miss: Vec<f64> = landed.iter().zip(guess).map(|(a, b)| a - b).collect();
        let chord: Vec<f64> = landed.iter().zip(&left.u).map(|(a, b)| a - b).collect();
        let size = |v: &[f64]| self.problem.dot(v, v).sqrt();
        let against = |t: &[f64]| (self.problem.dot(t, &chord) / (size(t) * size(&chord))).clamp(-1.0, 1.0).acos();
        let (miss, bent) = (size(&miss), against(&left.tangent) + against(&tangent));
        if angle > self.settings.max_angle || miss > 0.3 * length || bent > CHORD_FACTOR * angle + CHORD_SLACK {
            return Err(Failure::Elsewhere { angle, miss: miss / length });
        }
        Ok(())
    }

    /// Where another branch may be close: whether the same step backwards from `right` leads to `left` again.
    pub(super) fn leads_back(&mut self, left: &Station, right: &Station, cost: &mut Cost) -> Result<(), Failure> {
        if self.problem.margin(&left.point).min(self.problem.margin(&right.point)) > CROWDED {
            return Ok(());
        }
        self.place(right);
        let home = self.problem.transfer(&left.u, &left.mesh, &right.mesh);
        let before = self.problem.transfer(&left.tangent, &left.mesh, &right.mesh);
        let gap: Vec<f64> = home.iter().zip(&right.u).map(|(a, b)| a - b).collect();
        let distance = self.problem.dot(&right.tangent, &gap);
        let mut back: Vec<f64> = (0..home.len())
            .map(|i| {
                let bend = 0.5 * distance * (before[i] - right.tangent[i]);
                right.u[i] + distance * right.tangent[i] + bend
            })
            .collect();
        let plane = Plane { row: right.tangent.clone(), base: right.u.clone(), distance };
        correct(self.problem, self.settings, &plane, &mut back, cost)?;
        let miss: Vec<f64> = back.iter().zip(&home).map(|(a, b)| a - b).collect();
        let miss = self.problem.relative_size(&miss, &home);
        if miss > BACK * self.settings.tolerance {
            return Err(Failure::Elsewhere { angle: 0.0, miss: miss / distance.abs() });
        }
        Ok(())
    }
}
