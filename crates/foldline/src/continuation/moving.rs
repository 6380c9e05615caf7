//! Steps on a mesh that moves along time with the jumps of a solution.
//!
//! **Idea.** A relaxation oscillation, a canard or a burst has jumps that move along time by more than they last while
//! their shape hardly changes. An ordinary step predicts the states at fixed times, and is limited to a fraction of a
//! jump. Here the tangent is split into a shift in time and a change of shape: the mesh follows the shift, and the states
//! on it follow the change of shape. Lengths and angles are measured by the shape, so that steps are as long as it
//! permits.
//!
//! **Equations.** With the shift w and the shape ρ of the unit tangent at u on the mesh t, and ϱ = |ρ|, a step of length
//! ℓ = ϱ s leads to
//!
//! ```text
//!   (1)  t + ℓ w/ϱ + ½ ℓ²/d (w/ϱ - w₋/ϱ₋),   u + ℓ ρ/ϱ + ½ ℓ²/d (ρ/ϱ - ρ₋/ϱ₋)
//! ```
//!
//! where w₋ and ρ₋ are those at the previous point, at the distance d, if the step to it was of this kind as well.
//!
//! **Fails when** a special point, a bound or the start lies within the step, or another branch is near. An ordinary step
//! is then taken.

use super::corrector::{Care, Failure, Plane, Station, correct_within, refine};
use super::follow::Follow;
use super::judge::{CROWDED, FAR, MISS, NEARLY_OFF};
use super::step::{Between, Step, Trail};
use crate::contract::Shift;
use crate::diagram::{Cost, Mesh};

/// The shape of a step on a moving mesh, for the next one.
pub(super) struct Moving {
    /// Mesh at the end of the step.
    mesh: Mesh,
    /// Shift and shape at its beginning, per length, on that mesh.
    shift: Shift,
    /// Length of the step, measured by the shape.
    length: f64,
    /// Size of the shape of the unit tangent at its end.
    pub(super) rate: f64,
}

/// Largest change of shape along a unit tangent for a step on a moving mesh: the shift then accounts for three quarters of
/// its square.
const SHIFTED: f64 = 0.5;
/// Shift, in mesh intervals, up to which ordinary steps predict the states as well.
const SPANNED: f64 = 1.0;
/// Smallest ratio of the length of an interval on the moved mesh to its length before: halfway to its collapse.
const SQUEEZED: f64 = 0.5;
/// Smallest length of the previous step, in lengths of the present one, over which the change of the shape is divided: a
/// shorter one would magnify its errors. The value is that of ordinary steps ([`super::step`]).
const EARLIER: f64 = 0.2;

impl Follow<'_> {
    /// Attempts a step of length `step` along the tangent on a moving mesh. `None` if the solution has no jumps that
    /// move.
    pub(super) fn moved(
        &mut self,
        left: &Station,
        trail: Option<&Trail>,
        step: f64,
        cost: &mut Cost,
    ) -> Option<Result<Step, Failure>> {
        if left.mesh.is_empty() || self.is_short(&left.mesh, step) || self.problem.margin(&left.point) < CROWDED {
            return None;
        }
        self.place(left);
        let (rate, shift) = self.shift_of(&left.u, &left.tangent)?;
        let length = rate * step;
        let (mut times, mut guess) = (vec![0.0; left.mesh.len()], left.u.clone());
        let mut advance = |factor: f64, shift: &Shift| {
            times.iter_mut().zip(&shift.times).for_each(|(t, w)| *t += factor * w);
            guess.iter_mut().zip(&shift.shape).for_each(|(u, d)| *u += factor * d);
        };
        advance(length, &shift);
        if let Some(before) = trail.and_then(|trail| trail.moving.as_ref()) {
            let bend = 0.5 * length * length / before.length.max(EARLIER * length);
            let then = Shift {
                times: resampled(&before.shift.times, &before.mesh, &left.mesh),
                shape: self.problem.transfer(&before.shift.shape, &before.mesh, &left.mesh),
            };
            advance(bend, &shift);
            advance(-bend, &then);
        }
        let spans = |j: usize| times[j].abs() > SPANNED * (left.mesh[j + 1] - left.mesh[j]);
        if rate > SHIFTED || !(0..left.mesh.len() - 1).any(spans) {
            return None;
        }
        Some(self.landed(left, (&shift, length), (&times, &guess), cost))
    }

    /// Size of the shape of a tangent at the solution `u` on the current mesh, and both parts of the tangent divided by
    /// it.
    fn shift_of(&self, u: &[f64], tangent: &[f64]) -> Option<(f64, Shift)> {
        let mut shift = self.problem.shift(u, tangent)?;
        let rate = self.problem.dot(&shift.shape, &shift.shape).sqrt();
        shift.times.iter_mut().chain(&mut shift.shape).for_each(|own| *own /= rate);
        (rate > 0.0 && rate.is_finite()).then_some((rate, shift))
    }

    /// Corrects a prediction on the moved mesh, and decides whether it continues the branch at `left`. The states of
    /// `left` are compared at the points to which they moved.
    fn landed(
        &mut self,
        left: &Station,
        (shift, length): (&Shift, f64),
        (times, guess): (&[f64], &[f64]),
        cost: &mut Cost,
    ) -> Result<Step, Failure> {
        let squeezed = Failure::Elsewhere { angle: 0.0, miss: 0.0 };
        let mesh = moved(&left.mesh, times, 1.0).ok_or(squeezed.clone())?;
        let half = moved(&left.mesh, times, 0.5).ok_or(squeezed)?;
        self.problem.set_mesh(&mesh);
        self.problem.anchor(guess);
        let plane = Plane { row: shift.shape.clone(), base: guess.to_vec(), distance: 0.0 };
        let mut u = guess.to_vec();
        correct_within(self.problem, self.settings, &plane, FAR * length, &mut u, cost)?;
        let close = self.settings.closeness(&mesh, length);
        let care = Care { share: left.share, close, trusted: false };
        let mut right = refine(self.problem, self.settings, care, plane.row, u, self.direction, cost)?;
        self.count(&mut right);
        self.place(&right);
        let elsewhere = |angle: f64, miss: f64| Failure::Elsewhere { angle, miss };
        let (rate, there) = self.shift_of(&right.u, &right.tangent).ok_or(elsewhere(0.0, 1.0))?;
        let here = self.problem.transfer(&shift.shape, &mesh, &right.mesh);
        let from = self.problem.transfer(&left.u, &mesh, &right.mesh);
        let wanted = self.problem.transfer(guess, &mesh, &right.mesh);
        let difference = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
        let (chord, miss) = (difference(&right.u, &from), difference(&right.u, &wanted));
        let size = |v: &[f64]| self.problem.dot(v, v).sqrt();
        let between = |a: &[f64], b: &[f64]| (self.problem.dot(a, b) / (size(a) * size(b))).clamp(-1.0, 1.0).acos();
        let (angle, off) = (between(&here, &there.shape), size(&miss) / length);
        let bent = between(&here, &chord) + between(&there.shape, &chord);
        let turned = angle > self.settings.max_angle || off > MISS || bent > self.chord_limit(angle);
        if turned || self.problem.margin(&right.point) < CROWDED {
            return Err(elsewhere(angle, off));
        }
        if self.problem.departure(&right.u) > self.settings.newton_tolerance() {
            return Err(Failure::Departed);
        }
        self.stays_inside(left, &right)?;
        let share = self.halfway(left, &half, (&right, &mesh), (shift, &there, length), cost)?;
        self.place(&right);
        let along = length / rate;
        let back = Shift { times: resampled(&shift.times, &mesh, &right.mesh), shape: here };
        let moving = Moving { mesh: right.mesh.clone(), shift: back, length, rate };
        let between = Between { angle, along, chord: along, bent: share };
        Ok(Step { right, end: None, between: Some(between), moving: Some(moving) })
    }

    /// Refuses a step that contains a bound, the start of a closed branch, or the end at simpler solutions: these are
    /// located on ordinary steps.
    fn stays_inside(&self, left: &Station, right: &Station) -> Result<(), Failure> {
        let [low, high] = self.bounds();
        let mut inside = (low..=high).contains(&right.parameter());
        for (index, [low, high]) in &self.settings.bounds {
            inside &= right.point.parameters.get(*index).is_none_or(|now| (*low..=*high).contains(now));
        }
        if let Some(home) = self.home.filter(|_| self.homecoming.away) {
            let value = home.parameters[self.free];
            inside &= (self.value(left) - value) * (self.value(right) - value) > 0.0;
        }
        for monitor in self.collapses {
            inside &= monitor.value(&left.point, &right.point) > 0.0;
        }
        if inside { Ok(()) } else { Err(Failure::Elsewhere { angle: 0.0, miss: 0.0 }) }
    }

    /// Deviation of the curve halfway from the cubic between both ends of the step, by one Newton step, as a share of
    /// what is permitted.
    fn halfway(
        &mut self,
        left: &Station,
        half: &Mesh,
        (right, mesh): (&Station, &Mesh),
        (here, there, length): (&Shift, &Shift, f64),
        cost: &mut Cost,
    ) -> Result<f64, Failure> {
        let end = self.problem.transfer(&right.u, &right.mesh, mesh);
        let slope = self.problem.transfer(&there.shape, &right.mesh, mesh);
        let sides = left.u.iter().zip(&here.shape).zip(end.iter().zip(&slope));
        let middle: Vec<f64> = sides.map(|((u, t), (v, s))| 0.5 * (u + v) + 0.125 * length * (t - s)).collect();
        self.problem.set_mesh(half);
        self.problem.anchor(&middle);
        let (mut r, mut du) = (vec![0.0; middle.len()], vec![0.0; middle.len()]);
        if !self.problem.residual(&middle, &mut r) {
            return Err(Failure::NotFinite);
        }
        r[middle.len() - 1] = 0.0;
        self.problem.factorise(&middle, &here.shape).map_err(|_| Failure::Singular)?;
        cost.factorisations += 1;
        self.problem.solve(&r, &mut du);
        let miss = self.problem.dot(&du, &du).sqrt() / length;
        let allowed = NEARLY_OFF + self.settings.tolerance / length;
        if miss > allowed { Err(Failure::Bent { miss: miss / allowed, allowed }) } else { Ok(miss / allowed) }
    }
}

/// The mesh with every boundary moved by `share` of `times`; `None` if an interval becomes too short.
fn moved(mesh: &Mesh, times: &[f64], share: f64) -> Option<Mesh> {
    let last = mesh.len() - 1;
    let place = |j: usize| if j == last { 1.0 } else { mesh[j] + share * times[j] };
    let keeps = |j: usize| place(j + 1) - place(j) >= SQUEEZED * (mesh[j + 1] - mesh[j]);
    (0..last).all(keeps).then(|| (0..=last).map(place).collect())
}

/// Values at the boundaries of one mesh, interpolated linearly at those of another.
fn resampled(values: &[f64], from: &Mesh, to: &Mesh) -> Vec<f64> {
    to.iter()
        .map(|t| {
            let j = from.partition_point(|own| own <= t).clamp(1, from.len() - 1) - 1;
            let share = (t - from[j]) / (from[j + 1] - from[j]);
            values[j] + share * (values[j + 1] - values[j])
        })
        .collect()
}
