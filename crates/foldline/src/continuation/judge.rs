//! Step acceptance.
//!
//! **Idea.** A corrected point can lie on another branch. It does not continue this one if the tangent turns too far,
//! if the prediction was far off, if the chord deviates too much from both tangents, or, next to other branches, if the
//! reverse step does not return.

use super::corrector::{Failure, Plane, Station, correct, correct_within, parameter_row};
use super::follow::Follow;
use super::locate::Stretch;
use super::step::{Aim, Between};
use crate::diagram::Cost;

/// Distance to singularity below which a step must also lead back to its start.
pub(super) const CROWDED: f64 = 0.02;
/// Largest miss, in tolerances, of a step that leads back; a larger one indicates another branch.
const BACK: f64 = 100.0;
/// Magnitude of the cusp test function below which its sign is rounding.
const UNSIGNED: f64 = 1e-7;
/// Largest distance of the point from its prediction, as a share of the step …
pub(super) const MISS: f64 = 0.3;
/// … and largest first Newton update, which may be revised by later ones.
pub(super) const FAR: f64 = 0.6;
/// Largest distance of the curve midway from the cubic between both ends of a step, as a share of the step …
const OFF: f64 = 0.01;
/// … and the limit for an estimate of it.
pub(super) const NEARLY_OFF: f64 = 0.02;
/// Limit for the estimate next to other branches: the two sides of a loop of the branch can be that close.
const NEARLY_OFF_CROWDED: f64 = 0.003;
/// Relative Newton update that indicates a singular matrix.
const THROWN: f64 = 10.0;
/// Factor by which the angles of the chord with both tangents, added, may exceed the angle between the tangents …
const CHORD_FACTOR: f64 = 1.5;
/// … and the slack on top. On an arc the two are equal; on a jump to another branch the chord has another direction.
const CHORD_SLACK: f64 = 0.08;

impl Follow<'_> {
    /// Corrects `guess` towards `aim`, on the mesh of `left`, and gives up as soon as the result clearly does not
    /// continue the branch. The criteria of [`Follow::continues`] are applied with a small margin, before mesh and
    /// stability are computed. Also returns the row of the hyperplane.
    pub(super) fn corrected(
        &mut self,
        left: &Station,
        guess: &[f64],
        aim: Aim,
        cost: &mut Cost,
    ) -> Result<(Vec<f64>, Vec<f64>), Failure> {
        let (step, mut u) = (aim.step(), guess.to_vec());
        let plane = match aim {
            Aim::Plane(step) => Plane { row: left.tangent.clone(), base: left.u.clone(), distance: step },
            Aim::Value(_) => Plane { row: parameter_row(u.len()), base: u.clone(), distance: 0.0 },
        };
        correct_within(self.problem, self.settings, &plane, FAR * step, &mut u, cost)?;
        let miss: Vec<f64> = u.iter().zip(guess).map(|(a, b)| a - b).collect();
        let miss = self.problem.dot(&miss, &miss).sqrt() / step;
        let (mut last, mut tangent) = (vec![0.0; u.len()], vec![0.0; u.len()]);
        last[u.len() - 1] = 1.0;
        self.problem.solve(&last, &mut tangent);
        let along = self.problem.dot(&left.tangent, &tangent).abs();
        let angle = (along / self.problem.dot(&tangent, &tangent).sqrt()).clamp(-1.0, 1.0).acos();
        if angle > 1.1 * self.settings.max_angle || miss > 1.1 * MISS {
            return Err(Failure::Elsewhere { angle, miss });
        }
        Ok((u, plane.row))
    }

    /// Checks that `right`, predicted as `guess`, continues the branch at `left`: it neither turns too far nor lies on
    /// another branch.
    pub(super) fn continues(&mut self, left: &Station, right: &Station, guess: &[f64]) -> Result<Between, Failure> {
        self.place(left);
        let landed = self.problem.carry(&right.u, &right.mesh, &left.mesh);
        let tangent = self.problem.transfer(&right.tangent, &right.mesh, &left.mesh);
        let miss: Vec<f64> = landed.iter().zip(guess).map(|(a, b)| a - b).collect();
        let chord: Vec<f64> = landed.iter().zip(&left.u).map(|(a, b)| a - b).collect();
        let between = self.lie(left, &tangent, &chord);
        let (angle, length) = (between.angle, between.along);
        let size = |v: &[f64]| self.problem.dot(v, v).sqrt();
        let against = |t: &[f64]| (self.problem.dot(t, &chord) / (size(t) * size(&chord))).clamp(-1.0, 1.0).acos();
        let (miss, bent) = (size(&miss), against(&left.tangent) + against(&tangent));
        // The shorter of the two distances counts, so that a point far away does not pass for close in proportion.
        let ahead: Vec<f64> = guess.iter().zip(&left.u).map(|(a, b)| a - b).collect();
        let step = self.problem.dot(&left.tangent, &ahead).min(length).max(f64::MIN_POSITIVE);
        if angle > self.settings.max_angle || miss > MISS * step || bent > self.chord_limit(angle) {
            return Err(Failure::Elsewhere { angle, miss: miss / step });
        }
        Ok(between)
    }

    /// Largest sum of the angles of the chord with both tangents, given the angle between these.
    pub(super) fn chord_limit(&self, angle: f64) -> f64 {
        CHORD_FACTOR * angle + CHORD_SLACK
    }

    /// Checks that the curve follows the cubic between both ends of a step. An oscillation shorter than the step is not
    /// visible at either end. The midpoint is cheap for equilibria, and needed where no previous step shows the
    /// curvature. It is stored in `right`.
    pub(super) fn is_smooth(&mut self, left: &Station, right: &mut Station, cost: &mut Cost) -> Result<(), Failure> {
        let stretch = Stretch::new(self.problem, left, right, self.direction);
        let mut looked = |share: f64| -> Result<f64, Failure> {
            let middle = share * stretch.length;
            let guess = stretch.predicted(self.problem, middle);
            let u = stretch.corrected(self.problem, self.settings, middle, cost)?;
            let miss: Vec<f64> = u.iter().zip(&guess).map(|(a, b)| a - b).collect();
            right.middle = Some((middle, u));
            Ok(self.problem.dot(&miss, &miss).sqrt() / stretch.length.abs())
        };
        // On a step that is doubled or halved a branch point may lie exactly midway, where Newton's method fails.
        let thrown = |why: &Failure| match why {
            Failure::Singular => true,
            Failure::NoConvergence(sizes) => sizes.last().is_some_and(|size| *size > THROWN),
            _ => false,
        };
        let miss = match looked(0.5) {
            Err(why) if thrown(&why) => looked(0.43)?.max(looked(0.57)?),
            other => other?,
        };
        // Two meshes agree to the tolerance only.
        let allowed = OFF + self.settings.tolerance / stretch.length.abs();
        if miss > allowed {
            return Err(Failure::Bent { miss: miss / allowed, allowed });
        }
        Ok(())
    }

    /// Checks the deviation from the cubic at a tenth of the cost of [`Follow::is_smooth`], by one Newton step midway
    /// with the matrix of `right`, where and on whose mesh the problem was factorised last. Returns the deviation as a
    /// share of the step, and its limit.
    pub(super) fn is_nearly_smooth(&mut self, left: &Station, right: &Station) -> Result<[f64; 2], Failure> {
        let u = self.problem.carry(&left.u, &left.mesh, &right.mesh);
        let tangent = self.problem.transfer(&left.tangent, &left.mesh, &right.mesh);
        let gap: Vec<f64> = right.u.iter().zip(&u).map(|(a, b)| a - b).collect();
        let (length, forward) = (self.problem.dot(&tangent, &gap), self.problem.dot(&tangent, &right.tangent));
        let (bend, forward) = (0.125 * length, forward.abs().max(0.1));
        let sides = u.iter().zip(&tangent).zip(right.u.iter().zip(&right.tangent));
        let middle: Vec<f64> = sides.map(|((u, t), (v, s))| 0.5 * (u + v) + bend * (t - s / forward)).collect();
        let (mut r, mut du) = (vec![0.0; u.len()], vec![0.0; u.len()]);
        if !self.problem.residual(&middle, &mut r) {
            return Err(Failure::NotFinite);
        }
        r[u.len() - 1] = 0.0;
        self.problem.solve(&r, &mut du);
        let miss = self.problem.dot(&du, &du).sqrt() / length.abs();
        let crowded = self.problem.margin(&left.point).min(self.problem.margin(&right.point)) < CROWDED;
        let allowed = if crowded { NEARLY_OFF_CROWDED } else { NEARLY_OFF };
        let allowed = allowed + self.settings.tolerance / length.abs();
        if miss > allowed {
            return Err(Failure::Bent { miss: miss / allowed, allowed });
        }
        Ok([miss, allowed])
    }

    /// Deviation of the parameter midway from the cubic, by Newton's method there.
    pub(super) fn midway(&mut self, left: &Station, right: &Station, cost: &mut Cost) -> Result<f64, Failure> {
        let stretch = Stretch::new(self.problem, left, right, self.direction);
        let middle = 0.5 * stretch.length;
        let guess = stretch.predicted(self.problem, middle);
        let u = stretch.corrected(self.problem, self.settings, middle, cost)?;
        Ok(u[u.len() - 1] - guess[u.len() - 1])
    }

    /// True if a step along a curve of folds stays on its side of a cusp or, if its direction in the parameter plane
    /// reverses, moves to the other side. However close the two sides are, the cusp test function has opposite signs on
    /// them. All vectors are on the mesh of `left`, which is the reference of the problem.
    fn stays_on_arm(&mut self, left: &Station, u: &[f64], tangent: &[f64]) -> bool {
        let Some(before) = self.problem.arm(&left.u) else { return true };
        let Some(after) = self.problem.arm(u) else { return true };
        let last = tangent.len().saturating_sub(2);
        let shares = left.tangent[last..].iter().zip(&tangent[last..]).map(|(a, b)| a * b / (a * a).max(b * b));
        let forth = shares.filter(|share| share.is_finite()).sum::<f64>() > 0.0;
        before.abs().min(after.abs()) < UNSIGNED || (before * after > 0.0) == forth
    }

    /// Checks that the reverse step from `right` returns to `left`. Required along bifurcation curves, where the
    /// other side of a cusp may be close, and elsewhere if another branch may be.
    pub(super) fn leads_back(&mut self, left: &Station, right: &Station, cost: &mut Cost) -> Result<(), Failure> {
        let held = !self.settings.stability;
        if !held && self.problem.margin(&left.point).min(self.problem.margin(&right.point)) > CROWDED {
            return Ok(());
        }
        // Mesh and phase are those of the left end: on the mesh of the right end it need not be a solution, and in its
        // phase it would be shifted in time.
        self.place(left);
        let from = self.problem.carry(&right.u, &right.mesh, &left.mesh);
        let tangent = self.problem.transfer(&right.tangent, &right.mesh, &left.mesh);
        let gap: Vec<f64> = left.u.iter().zip(&from).map(|(a, b)| a - b).collect();
        let distance = self.problem.dot(&tangent, &gap);
        if held && !self.stays_on_arm(left, &from, &tangent) {
            return Err(Failure::NotBack { miss: 0.0 });
        }
        let mut back: Vec<f64> =
            (0..from.len()).map(|i| from[i] + distance * (tangent[i] + 0.5 * (left.tangent[i] - tangent[i]))).collect();
        let plane = Plane { row: tangent, base: from, distance };
        correct(self.problem, self.settings, &plane, &mut back, cost)?;
        let miss: Vec<f64> = back.iter().zip(&left.u).map(|(a, b)| a - b).collect();
        let miss = self.problem.relative_size(&miss, &left.u);
        if miss > BACK * self.settings.tolerance {
            return Err(Failure::NotBack { miss: miss / distance.abs() });
        }
        Ok(())
    }
}
