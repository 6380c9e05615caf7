//! Verification of boundary-value problems and connecting orbits by an explicit integrator.
//!
//! **Idea.** Trajectories of short pieces must lead from one point of the stored solution to the next, and the ends must
//! satisfy the conditions. Next to an equilibrium a connecting orbit is also compared with a trajectory that begins
//! closer to it, where the tangent space deviates less from the invariant manifold.
//!
//! **Equations.** For a piece of length h with Jacobian A at its beginning, in units of the sizes of the states, and
//! stated error e:
//!
//! ```text
//!   (1)  |φ_h(x(t)) - x(t + h)| ≤ e (1 + exp(h |A|)),   h |A| ≤ 1
//! ```

use super::{Check, Quantity, Undecided, Verified};
use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::{Branch, Cycle, Point, Solution};
use crate::explore::System;
use crate::linalg::{larger, max_abs};
use crate::problem::connecting::ConnectingField;
use crate::simulation::{Integrator, Tolerance};

/// Relative rounding error of a comparison.
const ROUNDING: f64 = 1e-11;
/// Distance from the equilibrium at which a comparison trajectory begins, relative to that of the end of the orbit. The
/// deviation of the tangent space from the manifold is a hundredth there.
const CLOSER: f64 = 0.1;

/// That distance where the orbit must not drift along a direction in which the flow is slow: no deviation decays on the way, and the
/// orbit approaches fast.
const MUCH_CLOSER: f64 = 1e-4;

/// Reason why special points are not verified.
const SPECIAL: &str = "special points of boundary-value problems and connecting orbits are not located again";

/// Verifies the points with the given indices.
pub(super) fn verify(system: &System, branch: &Branch, chosen: &[usize], accuracy: f64) -> Verified {
    let mut out = Verified::default();
    for point in chosen.iter().map(|i| &branch.points[*i]) {
        let Solution::Cycle(cycle) = &point.solution else { continue };
        let found = match connecting(system, branch, point) {
            None => Recomputed { field: system.field, scales: &system.scales, point, cycle, accuracy }.compared(None),
            Some(Ok(field)) => {
                Recomputed { field: &field, scales: &system.scales, point, cycle, accuracy }.compared(Some(&field))
            }
            Some(Err(why)) => Err(why),
        };
        let check = |found: f64, stated: f64| Check {
            branch: branch.name.clone(),
            position: point.position,
            special: None,
            parameter: point.parameters.get(branch.free).copied().unwrap_or(f64::NAN),
            quantity: Quantity::Profile,
            stated: Some(stated),
            found,
        };
        match found {
            Ok(found) => {
                out.points += 1;
                out.checks.extend(found.into_iter().map(|[found, stated]| check(found, stated)));
            }
            Err(why) => out.undecided.push(Undecided {
                branch: branch.name.clone(),
                position: point.position,
                special: None,
                why,
            }),
        }
    }
    out.undecided.extend(branch.special.iter().map(|own| Undecided {
        branch: branch.name.clone(),
        position: own.point.position,
        special: Some(own.kind),
        why: SPECIAL,
    }));
    out
}

/// The field of a connecting orbit; `None` for a boundary-value problem.
fn connecting<'s>(
    system: &'s System,
    branch: &Branch,
    point: &Point,
) -> Option<Result<ConnectingField<'s>, &'static str>> {
    let kind = branch.held.map(|(kind, _)| kind).filter(|_| branch.is_connecting())?;
    let found = ConnectingField::of_stored(system.field, &system.scales, kind, &point.parameters);
    Some(found.ok_or("the equilibrium of the orbit is too close to a bifurcation"))
}

struct Recomputed<'a> {
    field: &'a dyn VectorField,
    scales: &'a [f64],
    point: &'a Point,
    cycle: &'a Cycle,
    accuracy: f64,
}

impl Recomputed<'_> {
    /// Differences found, with the errors stated for them.
    fn compared(&self, orbit: Option<&ConnectingField>) -> Result<Vec<[f64; 2]>, &'static str> {
        let n = self.scales.len();
        let most: Vec<f64> = (0..n)
            .map(|c| self.cycle.profile.iter().skip(c).step_by(n).fold(self.scales[c], |m, x| m.max(x.abs())))
            .collect();
        let absolute = most.iter().map(|size| self.accuracy * size).collect();
        let tolerance = Tolerance { relative: self.accuracy, absolute };
        let integrator = Integrator::new(self.field, &self.point.parameters, tolerance).with_step_limit(10_000);
        let trust = &self.point.trust;
        let stated = trust.discretisation + trust.residual + ROUNDING;
        let mut worst = [0.0, stated * (1.0 + std::f64::consts::E)];
        let (mut t, mut x) = (0.0, self.cycle.state(0.0));
        let mut end = x.clone();
        while t < 1.0 {
            let rate = self.rate(&x, t);
            let next = (t + 1.0 / rate.max(1.0)).min(1.0);
            end = integrator.state_after(&x, [t, next]).ok_or("the integrator did not reach the end of a piece")?;
            x = if next < 1.0 { self.cycle.state(next) } else { self.cycle.end() };
            let off = (0..n).map(|c| (end[c] - x[c]).abs() / most[c]).fold(0.0, larger);
            worst[0] = larger(worst[0], off);
            t = next;
        }
        let mut all = vec![worst];
        // The conditions at the recomputed end.
        let first = self.cycle.state(0.0);
        let [count, _] = self.field.conditions();
        let [mut b, mut left, mut right] = [1, n, n].map(|size| vec![0.0; count * size]);
        self.field.boundary([&first, &end], &self.point.parameters, &[], [&mut b, &mut left, &mut right, &mut []]);
        for (k, value) in b.iter().enumerate() {
            let size: f64 = (0..n).map(|c| (left[k * n + c].abs() + right[k * n + c].abs()) * most[c]).sum();
            let own = if size > 0.0 { size } else { 1.0 };
            all.push([value.abs() / own, worst[1]]);
        }
        if let Some(orbit) = orbit {
            // Where the orbit is free to arrive, no manifold is approximated.
            for end in (0..2).filter(|end| orbit.is_bound(*end)) {
                all.push([self.off_manifold(orbit, &integrator, end)?, stated]);
            }
        }
        Ok(all)
    }

    /// Row sum norm of the Jacobian in units of the sizes of the states.
    fn rate(&self, x: &[f64], t: f64) -> f64 {
        let n = x.len();
        let (mut f, mut fx) = (vec![0.0; n], vec![0.0; n * n]);
        let parameters = Parameters::Shared(&self.point.parameters);
        self.field.linearise(
            Batch { lanes: 1, states: x, parameters, times: &[t], signs: &[] },
            &[],
            &mut f,
            &mut fx,
            &mut [],
        );
        let row = |i: usize| (0..n).map(|j| (fx[i * n + j] * self.scales[j] / self.scales[i]).abs()).sum::<f64>();
        (0..n).map(row).fold(0.0, larger)
    }

    /// Distance of an end of the orbit from the invariant manifold of the equilibrium, across that, from a trajectory
    /// that begins closer to it.
    fn off_manifold(&self, orbit: &ConnectingField, integrator: &Integrator, end: usize) -> Result<f64, &'static str> {
        let parameters = &self.point.parameters;
        let ends = [self.cycle.state(0.0), self.cycle.end()];
        let y = &orbit.deviations([&ends[0], &ends[1]], parameters)[end];
        let split = orbit.parts(end, parameters).ok_or("the equilibrium of the orbit is too close to a bifurcation")?;
        let side = if end == 0 { 1.0 } else { -1.0 };
        // Next to a bifurcation the linear flow leads nowhere.
        let (time, closer) = match (orbit.is_slow(end, parameters), orbit.creeps(end, parameters)) {
            (true, true) => orbit.approached(end, y, parameters, CLOSER),
            (slow, _) => {
                let share = if slow { MUCH_CLOSER } else { CLOSER };
                split.time_to(y, side, share).map(|time| (time, split.flow(y, side, -side * time)))
            }
        }
        .ok_or("the orbit does not approach the equilibrium")?;
        let start: Vec<f64> = ends[end]
            .iter()
            .zip(y.iter().zip(&closer))
            .enumerate()
            .map(|(c, (x, (far, near)))| x + orbit.scale(c) * (near - far))
            .collect();
        let span = side * time / orbit.time_unit(parameters);
        let back =
            integrator.state_after(&start, [0.0, span]).ok_or("the integrator did not reach the end of a piece")?;
        // On to the plane through the end: the time was that of the approximate flow.
        let mut back = back;
        let of = |back: &[f64]| -> Vec<f64> {
            let both = if end == 0 { [back, &ends[1]] } else { [&ends[0][..], back] };
            orbit.deviations(both, parameters)[end].clone()
        };
        for _ in 0..if orbit.is_slow(end, parameters) { 2 } else { 0 } {
            let Some(rest) = orbit.time_to_plane(end, &of(&back), &back, parameters) else { break };
            back = integrator
                .state_after(&back, [0.0, rest / orbit.time_unit(parameters)])
                .ok_or("the integrator did not reach the end of a piece")?;
        }
        let arrived = &of(&back);
        let off: Vec<f64> = arrived.iter().zip(y).map(|(a, b)| a - b).collect();
        let across = split.part(&off, -side);
        let sizes = self.cycle.profile.iter().enumerate();
        let most = sizes.fold(1.0, |m: f64, (k, x)| m.max((x / self.scales[k % self.scales.len()]).abs()));
        Ok(max_abs(&across) / most)
    }
}
