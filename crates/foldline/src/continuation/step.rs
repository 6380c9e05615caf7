//! One step: prediction, correction, acceptance, and the end of the branch.
//!
//! **Idea.** The predictor is the cubic through the last two points with their tangents. A prediction that would pass a
//! bound is moved to it. The corrected point is refined on its mesh, compared with the previous one, and checked for an
//! end of the branch.

use super::corrector::{Care, Failure, RESOLVED, Station, refine};
use super::follow::Follow;
use super::inspect::History;
use super::moving::Moving;
use crate::diagram::{Cost, Ending, Mesh};

/// An accepted step, which may be the last one.
pub(super) struct Step {
    pub(super) right: Station,
    pub(super) end: Option<Ending>,
    /// Relative position of its ends, if already known.
    pub(super) between: Option<Between>,
    /// Data of a step on a moving mesh, for the next one.
    pub(super) moving: Option<Moving>,
}

/// Relative position of two neighbouring points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Between {
    /// Angle between the tangents.
    pub(super) angle: f64,
    /// Distance along the left tangent.
    pub(super) along: f64,
    /// Distance between the points.
    pub(super) chord: f64,
    /// Distance of the curve midway from the cubic between the points, as a share of the permitted distance; 0 if not
    /// computed.
    pub(super) bent: f64,
}

/// Data of the previous point: its tangent for the predictor, its monitor values for the inspection.
pub(super) struct Trail {
    u: Vec<f64>,
    tangent: Vec<f64>,
    mesh: Mesh,
    /// Arclength between the previous and the current point.
    pub(super) length: f64,
    /// Angle between their tangents per arclength.
    pub(super) curvature: f64,
    pub(super) history: History,
    /// Set if the step to the current point was one on a moving mesh; `u` and `tangent` are then of no use to the
    /// predictor.
    pub(super) moving: Option<Moving>,
}

impl Trail {
    /// This trail, after a step on a moving mesh.
    pub(super) fn moving(self, moving: Option<Moving>) -> Trail {
        Trail { moving, ..self }
    }
}

/// The target of a step.
#[derive(Clone, Copy, Debug)]
pub(super) enum Aim {
    /// The hyperplane across the tangent at this distance.
    Plane(f64),
    /// The parameter value of the prediction, about this far away.
    Value(f64),
}

impl Aim {
    /// Distance of the target.
    pub(super) fn step(self) -> f64 {
        match self {
            Aim::Plane(step) | Aim::Value(step) => step,
        }
    }
}

/// Ratio of a step to the previous one above which it is predicted from the tangents alone.
const FARTHEST: f64 = 2.5;
/// Factor by which a step may be lengthened to reach a bound, which saves a short final step.
const STRETCHED: f64 = 1.2;
/// Distance from a bound, as a share of the parameter change, within which a prediction is moved onto it.
const NEAR_BOUND: f64 = 1e-4;
/// Distance midway from the cubic through both ends, as a share of the step, beyond which the parameter there is
/// computed.
const BENT: f64 = 2e-3;

impl Follow<'_> {
    /// Data of `before` for the next step.
    pub(super) fn trail(&mut self, before: &Station, between: Between) -> Trail {
        let distance = between.along.abs().max(f64::MIN_POSITIVE);
        let (values, marks) = (self.monitored(before), self.marked(before));
        let (spectrum, stands) = (before.point.spectrum.clone(), before.point.is_one_of_family());
        let history = History { distance, values, marks, spectrum, stands };
        let length = between.chord.max(distance) * (1.0 + between.angle * between.angle / 24.0);
        let (u, tangent) = (before.u.clone(), before.tangent.clone());
        Trail {
            u,
            tangent,
            mesh: before.mesh.clone(),
            length,
            curvature: between.angle / length,
            history,
            moving: None,
        }
    }

    /// Relative position of two stations, on the mesh and in the metric of the left one.
    pub(super) fn between(&mut self, left: &Station, right: &Station) -> Between {
        self.place(left);
        let tangent = self.problem.transfer(&right.tangent, &right.mesh, &left.mesh);
        let mut chord = self.problem.carry(&right.u, &right.mesh, &left.mesh);
        chord.iter_mut().zip(&left.u).for_each(|(a, b)| *a -= b);
        self.lie(left, &tangent, &chord)
    }

    /// Relative position given the right tangent and the chord, both on the mesh of `left`, which is the reference of
    /// the problem.
    pub(super) fn lie(&self, left: &Station, tangent: &[f64], chord: &[f64]) -> Between {
        let dot = |a: &[f64], b: &[f64]| self.problem.dot(a, b);
        let sizes = (dot(tangent, tangent) * dot(&left.tangent, &left.tangent)).sqrt();
        let cosine = dot(&left.tangent, tangent) / sizes;
        let (along, chord) = (dot(&left.tangent, chord), dot(chord, chord).sqrt());
        Between { angle: cosine.clamp(-1.0, 1.0).acos(), along, chord, bent: 0.0 }
    }

    /// True if the mesh of `left` has served for the previous step and has room left: the stated error, several times
    /// the estimate, is below the error allowed for this mesh.
    fn trusts(&self, left: &Station, trail: Option<&Trail>) -> bool {
        let room = left.point.trust.discretisation < left.share * self.settings.tolerance;
        room && trail.is_some_and(|trail| trail.mesh == left.mesh)
    }

    /// Predicts the point at distance `step`, on the cubic through the last two points with their tangents.
    fn predicted(&mut self, left: &Station, trail: Option<&Trail>, step: f64) -> Vec<f64> {
        self.place(left);
        let mut guess: Vec<f64> = left.u.iter().zip(&left.tangent).map(|(u, t)| u + step * t).collect();
        let Some(trail) = trail else { return guess };
        let (d, x) = (trail.length, step / trail.length);
        let then = self.problem.transfer(&trail.tangent, &trail.mesh, &left.mesh);
        if x > FARTHEST {
            let bend = 0.5 * step * step / d.max(0.2 * step);
            (0..guess.len()).for_each(|i| guess[i] += bend * (left.tangent[i] - then[i]));
        } else {
            let before = self.problem.carry(&trail.u, &trail.mesh, &left.mesh);
            for i in 0..guess.len() {
                let (chord, turn) = (before[i] - left.u[i] + d * left.tangent[i], d * (then[i] - left.tangent[i]));
                guess[i] += x * x * ((3.0 * chord + turn) + x * (2.0 * chord + turn));
            }
        }
        let gap: Vec<f64> = guess.iter().zip(&left.u).map(|(a, b)| a - b).collect();
        let off = step - self.problem.dot(&left.tangent, &gap);
        guess.iter_mut().zip(&left.tangent).for_each(|(g, t)| *g += off * t);
        guess
    }

    pub(super) fn attempt(
        &mut self,
        left: &Station,
        trail: Option<&Trail>,
        step: f64,
        rigid: bool,
        cost: &mut Cost,
    ) -> Result<Step, Failure> {
        let trail = trail.filter(|trail| trail.moving.is_none());
        let guess = self.predicted(left, trail, step);
        // A step that would pass a bound is aimed at it. If that fails, the bound is located after the step.
        if let Some((nearer, landing)) = self.landing(left, trail, &guess, step)
            && !self.is_short(&left.mesh, nearer)
            && let Ok(landed) = self.tried(left, trail, &landing, Aim::Value(nearer), rigid, cost)
        {
            return Ok(landed);
        }
        self.place(left);
        self.tried(left, trail, &guess, Aim::Plane(step), rigid, cost)
    }

    /// Step at which the prediction reaches a bound, if that is within the step or slightly beyond, and the prediction
    /// there with the parameter equal to the bound.
    fn landing(&mut self, left: &Station, trail: Option<&Trail>, guess: &[f64], step: f64) -> Option<(f64, Vec<f64>)> {
        let last = guess.len() - 1;
        let (here, way) = (left.parameter(), guess[last] - left.parameter());
        let [low, high] = self.bounds();
        let there = here + STRETCHED * way;
        let bound = if there < low { low } else { (there > high).then_some(high)? };
        if left.slope() * way <= 0.0 || (here - bound) * way >= 0.0 {
            return None;
        }
        let gap = |at: &[f64]| (at[last] - bound) * way.signum();
        let farthest = STRETCHED * step;
        let (mut inner, mut outer) =
            ((0.0, -(here - bound).abs()), (farthest, gap(&self.predicted(left, trail, farthest))));
        if outer.1 < 0.0 {
            return None;
        }
        for _ in 0..20 {
            let s = inner.0 + (outer.0 - inner.0) * inner.1 / (inner.1 - outer.1);
            let mut landing = self.predicted(left, trail, s);
            let miss = gap(&landing);
            if miss > 0.0 {
                outer = (s, miss)
            } else {
                inner = (s, miss)
            }
            if miss.abs() < NEAR_BOUND * (s * left.slope()).abs() {
                landing[last] = bound;
                return Some((s, landing));
            }
        }
        None
    }

    /// Corrects a prediction, in the hyperplane or at the parameter value of `aim`, and decides whether to accept the
    /// step.
    fn tried(
        &mut self,
        left: &Station,
        trail: Option<&Trail>,
        guess: &[f64],
        aim: Aim,
        rigid: bool,
        cost: &mut Cost,
    ) -> Result<Step, Failure> {
        let step = aim.step();
        let (u, row) = self.corrected(left, guess, aim, cost)?;
        let short = self.is_short(&left.mesh, step);
        let mut on_its_mesh = None;
        if rigid && short {
            let close = self.settings.closeness(&left.mesh, step);
            let found = self.unrefined(left, u.clone(), close, cost)?;
            // A mesh that no longer resolves the profile is worse than a change of mesh.
            let coarse = found.point.trust.discretisation > RESOLVED * self.settings.tolerance;
            let coarse = coarse && !self.problem.is_switched();
            on_its_mesh = Some(found).filter(|_| !coarse);
        }
        let forced = rigid && short && on_its_mesh.is_none();
        let mut right = match on_its_mesh {
            Some(found) => found,
            None => {
                self.place(left);
                let care = Care { trusted: self.trusts(left, trail), ..self.care(left, step) };
                refine(self.problem, self.settings, care, row, u, self.direction, cost)?
            }
        };
        self.count(&mut right);
        if let Aim::Value(_) = aim {
            // For travel towards smaller values the parameter row has reversed the tangent.
            right.head(left.slope());
        }
        if right.mesh != left.mesh && short && !forced {
            return Err(Failure::Remeshed(right.mesh));
        }
        let (mut miss, mut allowed) = (0.0, f64::INFINITY);
        if !left.mesh.is_empty() {
            [miss, allowed] = self.is_nearly_smooth(left, &right)?;
        }
        let between = Between { bent: miss / allowed, ..self.continues(left, &right, guess)? };
        if self.problem.departure(&right.u) > self.settings.newton_tolerance() {
            return Err(Failure::Departed);
        }
        if trail.is_none() || left.mesh.is_empty() {
            self.is_smooth(left, &mut right, cost)?;
        }
        self.leads_back(left, &right, cost)?;
        if miss > BENT {
            right.midway = self.midway(left, &right, cost)?;
        }
        if let Some(ended) = self.collapsed(left, &right, cost)? {
            return Ok(ended);
        }
        let [low, high] = self.bounds();
        let bound = match aim {
            Aim::Value(_) => Some(usize::from(guess[guess.len() - 1] == high)),
            Aim::Plane(_) if right.parameter() < low => Some(0),
            Aim::Plane(_) => (right.parameter() > high).then_some(1),
        };
        let (mut end, mut between) = (None, Some(between));
        if let Some(side) = bound {
            let bound = self.settings.range[side];
            between = None;
            if let Aim::Plane(_) = aim {
                right = self.at_parameter(left, &right, bound, cost)?;
                self.count(&mut right);
            }
            // The bound is stored exactly, without the rounding of Newton's method.
            let last = right.u.len() - 1;
            right.u[last] = [low, high][side];
            if let Some(own) = right.point.parameters.get_mut(self.free) {
                *own = bound;
            }
            end = Some(Ending::Bound(bound));
        }
        if let Some((value, there)) = self.beyond(left, &right, cost) {
            return Ok(Step { right: there, end: Some(Ending::Bound(value)), between: None, moving: None });
        }
        if let Some(home) = self.closes(left, &right, cost)? {
            return Ok(Step { right: home, end: Some(Ending::Closed), between: None, moving: None });
        }
        Ok(Step { right, end, between, moving: None })
    }
}
