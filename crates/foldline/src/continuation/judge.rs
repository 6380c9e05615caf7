//! Whether a step may be accepted.
//!
//! **Idea.** A corrected point can lie on another branch. It does not continue this one if the tangents turn too far, if the
//! prediction was far off, if the chord points elsewhere than both tangents, or, where branches crowd, if the same step
//! backwards leads elsewhere.

use super::corrector::{Failure, Plane, Station, correct, correct_within, parameter_row};
use super::follow::Follow;
use super::locate::Stretch;
use super::step::{Aim, Between};
use crate::diagram::Cost;

/// Margin from a singular matrix below which a step must also lead back to where it came from.
const CROWDED: f64 = 0.02;
/// How many tolerances off a step may lead back; more is another branch.
const BACK: f64 = 100.0;
/// Size of what tells the arms of a cusp apart below which it is rounding.
const UNSIGNED: f64 = 1e-7;
/// How far off a prediction may be, as a share of the step …
const MISS: f64 = 0.3;
/// … and by the first Newton update, which is not the last word.
const FAR: f64 = 0.6;
/// How far off the cubic between both ends of a step the curve may be midway, as a share of the step.
const OFF: f64 = 0.01;
/// … and how far by an estimate.
const NEARLY_OFF: f64 = 0.02;
/// The same where branches crowd: the arms of a loop of the branch can lie that close to each other.
const NEARLY_OFF_CROWDED: f64 = 0.003;
/// Newton update, relative, that says that a matrix is singular.
const THROWN: f64 = 10.0;
/// Angles of the chord with both tangents: their sum may exceed the angle between the tangents by this factor …
const CHORD_FACTOR: f64 = 1.5;
/// … and this much. On an arc the two are equal; on a jump to another branch the chord points elsewhere.
const CHORD_SLACK: f64 = 0.08;

impl Follow<'_> {
    /// Corrects `guess`, on the mesh of `left`, in what is aimed at, and gives up as soon as it is clear that the result does
    /// not continue the branch; what [`Follow::continues`] asks is looked at here with a little slack, before mesh and
    /// stability are seen to. Returns the row of the plane too.
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

    /// Whether `right`, predicted as `guess`, continues the branch at `left`, and neither turns too far nor lies on another
    /// one.
    pub(super) fn continues(&mut self, left: &Station, right: &Station, guess: &[f64]) -> Result<Between, Failure> {
        self.place(left);
        let landed = self.problem.transfer(&right.u, &right.mesh, &left.mesh);
        let tangent = self.problem.transfer(&right.tangent, &right.mesh, &left.mesh);
        let miss: Vec<f64> = landed.iter().zip(guess).map(|(a, b)| a - b).collect();
        let chord: Vec<f64> = landed.iter().zip(&left.u).map(|(a, b)| a - b).collect();
        let between = self.lie(left, &tangent, &chord);
        let (angle, length) = (between.angle, between.along);
        let size = |v: &[f64]| self.problem.dot(v, v).sqrt();
        let against = |t: &[f64]| (self.problem.dot(t, &chord) / (size(t) * size(&chord))).clamp(-1.0, 1.0).acos();
        let (miss, bent) = (size(&miss), against(&left.tangent) + against(&tangent));
        // A point far away need not be far off in proportion.
        let ahead: Vec<f64> = guess.iter().zip(&left.u).map(|(a, b)| a - b).collect();
        let step = self.problem.dot(&left.tangent, &ahead).min(length).max(f64::MIN_POSITIVE);
        if angle > self.settings.max_angle || miss > MISS * step || bent > CHORD_FACTOR * angle + CHORD_SLACK {
            return Err(Failure::Elsewhere { angle, miss: miss / step });
        }
        Ok(between)
    }

    /// Whether the curve keeps to the cubic between both ends of a step. A wiggle shorter than the step shows at neither end;
    /// looking midway is cheap for equilibria, and where there is no step before that says how the curve bends. `right` takes note of what
    /// is there.
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
        // A step that doubles or halves may have a branch point right in its middle, where Newton's method fails.
        let thrown = |why: &Failure| match why {
            Failure::Singular => true,
            Failure::NoConvergence(sizes) => sizes.last().is_some_and(|size| *size > THROWN),
            _ => false,
        };
        let miss = match looked(0.5) {
            Err(why) if thrown(&why) => looked(0.43)?.max(looked(0.57)?),
            other => other?,
        };
        // Meshes agree to the tolerance only.
        let allowed = OFF + self.settings.tolerance / stretch.length.abs();
        if miss > allowed {
            return Err(Failure::Bent { miss: miss / allowed, allowed });
        }
        Ok(())
    }

    /// The same for a tenth of the cost: one Newton step midway with the matrix of `right`, for which the problem was factorised last
    /// and on whose mesh it is. Returns how far off the cubic the curve is, as a share of the step, and how far it may be.
    pub(super) fn is_nearly_smooth(&mut self, left: &Station, right: &Station) -> Result<[f64; 2], Failure> {
        let u = self.problem.transfer(&left.u, &left.mesh, &right.mesh);
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

    /// How far the parameter midway is off the cubic, by Newton's method there.
    pub(super) fn midway(&mut self, left: &Station, right: &Station, cost: &mut Cost) -> Result<f64, Failure> {
        let stretch = Stretch::new(self.problem, left, right, self.direction);
        let middle = 0.5 * stretch.length;
        let guess = stretch.predicted(self.problem, middle);
        let u = stretch.corrected(self.problem, self.settings, middle, cost)?;
        Ok(u[u.len() - 1] - guess[u.len() - 1])
    }

    /// Whether a step along a curve of folds ends on the arm of a cusp on which it began or, where it turned back in the plane of the
    /// parameters, on the other. However close the arms are, on them the cycle or equilibrium turns to opposite sides. All is on the mesh
    /// of `left`, where the problem is anchored.
    fn stays_on_arm(&mut self, left: &Station, u: &[f64], tangent: &[f64]) -> bool {
        let Some(before) = self.problem.arm(&left.u) else { return true };
        let Some(after) = self.problem.arm(u) else { return true };
        let last = tangent.len().saturating_sub(2);
        let shares = left.tangent[last..].iter().zip(&tangent[last..]).map(|(a, b)| a * b / (a * a).max(b * b));
        let forth = shares.filter(|share| share.is_finite()).sum::<f64>() > 0.0;
        before.abs().min(after.abs()) < UNSIGNED || (before * after > 0.0) == forth
    }

    /// Where another branch may be close, or along a curve the other arm of a cusp: whether the same step backwards from `right` leads
    /// to `left` again.
    pub(super) fn leads_back(&mut self, left: &Station, right: &Station, cost: &mut Cost) -> Result<(), Failure> {
        let held = !self.settings.stability;
        if !held && self.problem.margin(&left.point).min(self.problem.margin(&right.point)) > CROWDED {
            return Ok(());
        }
        // Mesh and phase are those of the left end: on the mesh of the right one it need not be a solution, and in its phase
        // it would be shifted in time.
        self.place(left);
        let from = self.problem.transfer(&right.u, &right.mesh, &left.mesh);
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
