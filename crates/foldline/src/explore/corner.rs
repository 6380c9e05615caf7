//! Beyond a grazing at which the field jumps, where a branch of cycles has a corner.
//!
//! **Idea.** A cycle touches a surface at which f jumps and begins, or ceases, to slide along it. The derivatives of its
//! flow jump there, so that the branch has another direction on the other side: ahead (persistence) or back (non-smooth
//! fold). The corner is extrapolated from a point close to it; the direction beyond follows from the linearised equations
//! slightly past the corner.
//!
//! **Equations.** g is the extremum of the switch next to zero, τ the tangent, u the point:
//!
//! ```text
//!   (1)  u_c = u - g/g' τ
//!   (2)  F_u(u_c + η τ) t = 0
//! ```
//!
//! **Source.** dibernardo2008, §8 (grazing-sliding).
//!
//! **Fails when** several surfaces are touched at once.

use crate::continuation::Settings;
use crate::continuation::corrector::{Plane, Station, correct, station};
use crate::contract::{Examination, VectorField, ZeroProblem};
use crate::diagram::{Cost, Ending, Kind, Mesh, Point, Solution, SpecialPoint};
use crate::special::grazing::{Extremum, extrema};
use crate::special::sliding;

/// Extremum, relative to the largest value of the switch, from which the corner is extrapolated.
const NEAR: f64 = 1e-6;
/// Extrema, relative to the largest value, at which the first point beyond the corner is sought.
const BEYOND: [f64; 4] = [1e-3, 1e-4, 1e-2, 1e-5];
/// Longest extrapolation, and a thousand times the step over which the rate is measured, in scaled unknowns.
const FAR: f64 = 0.01;

/// A surface that a cycle touches and at which f jumps.
struct Touch {
    switch: usize,
    extremum: Extremum,
    size: f64,
}

fn touched(field: &dyn VectorField, point: &Point) -> Option<Touch> {
    let Solution::Cycle(cycle) = &point.solution else { return None };
    (0..field.switch_count()).find_map(|switch| {
        let (all, size) = extrema(field, &point.parameters, cycle, switch);
        let extremum = all.into_iter().min_by(|a, b| a.value.abs().total_cmp(&b.value.abs()))?;
        let close = extremum.value != 0.0 && extremum.value.abs() < NEAR * size;
        (close && sliding::jumps_at(field, point, cycle, extremum.time, switch)).then_some(Touch {
            switch,
            extremum,
            size,
        })
    })
}

/// The end of a branch at a corner, if the cycle is so close to it.
pub(super) fn limit(field: &dyn VectorField, point: &Point, free: usize) -> Option<Ending> {
    touched(field, point).map(|_| Ending::Joined { at: Kind::Grazing, parameter: point.parameters[free] })
}

/// The corner next to `last` and the first point beyond it; `None` if they are not found.
pub(super) fn beyond(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    field: &dyn VectorField,
    last: &Station,
    direction: f64,
) -> Option<(SpecialPoint, Station)> {
    let touch = touched(field, &last.point)?;
    let (cost, close) = (&mut Cost::default(), settings.closeness(&last.mesh, f64::INFINITY));
    let moved = |from: &[f64], along: &[f64], by: f64| -> Vec<f64> {
        from.iter().zip(along).map(|(u, t)| u + by * t).collect()
    };
    let value = |problem: &dyn ZeroProblem, u: &[f64]| -> Option<f64> {
        let point = problem.point(u, &[], Examination::default());
        let Solution::Cycle(cycle) = &point.solution else { return None };
        let (all, _) = extrema(field, &point.parameters, cycle, touch.switch);
        let apart = |e: &Extremum| (e.time - touch.extremum.time - (e.time - touch.extremum.time).round()).abs();
        all.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))).map(|e| e.value)
    };
    // One interval for the whole contact: nodes within it hold the orbit to the surface.
    let mesh = without_nodes_near(&last.mesh, &touch);
    problem.set_mesh(&last.mesh);
    let (start, along) =
        (problem.carry(&last.u, &last.mesh, &mesh), problem.transfer(&last.tangent, &last.mesh, &mesh));
    problem.set_mesh(&mesh);
    problem.anchor(&start);
    let mut on_branch = |problem: &mut dyn ZeroProblem, base: &[f64], row: &[f64], distance: f64| {
        let mut u = moved(base, row, distance);
        let plane = Plane { row: row.to_vec(), base: base.to_vec(), distance };
        correct(problem, settings, &plane, &mut u, cost).ok().map(|()| u)
    };
    let own = on_branch(problem, &start, &along, 0.0)?;
    let back = FAR * 1e-3;
    let before = on_branch(problem, &own, &along, -back)?;
    let (there, rate) = (value(problem, &own)?, (value(problem, &own)? - value(problem, &before)?) / back);
    let rest = -there / rate;
    if !(rest > 0.0 && rest < FAR) {
        return None;
    }
    let arriving: Vec<f64> = own.iter().zip(&before).map(|(a, b)| (a - b) / back).collect();
    let corner = moved(&own, &arriving, rest);
    let past = NEAR * touch.size / rate.abs();
    problem.factorise(&moved(&corner, &arriving, past), &arriving).ok()?;
    let size = problem.unknowns();
    let (mut rhs, mut along) = (vec![0.0; size], vec![0.0; size]);
    rhs[size - 1] = 1.0;
    problem.solve(&rhs, &mut along);
    let norm = problem.dot(&along, &along).sqrt();
    if !(norm.is_finite() && norm > 0.0) {
        return None;
    }
    // The orbit is on the other side of the surface in one of the two directions.
    let tries = BEYOND.iter().flat_map(|share| [1.0, -1.0].map(|sign| (share, sign)));
    let found = tries.into_iter().find_map(|(share, sign)| {
        let (row, distance): (Vec<f64>, f64) =
            (along.iter().map(|t| sign * t / norm).collect(), share * touch.size / rate.abs());
        let u = on_branch(problem, &corner, &row, distance)?;
        let found = value(problem, &u)?;
        (found * there < 0.0 && found.abs() < 10.0 * share * touch.size).then_some((u, row, distance))
    });
    let (u, along, distance) = found?;
    let mut first = station(problem, u, &along, close, direction, &mut Cost::default()).ok()?;
    first.point.step = distance;
    let turns = along[size - 1] * arriving[size - 1] < 0.0;
    let name = field.switch_name(touch.switch);
    let stored: Vec<f64> = arriving.iter().map(|t| direction * t).collect();
    let at_corner = problem.point(&corner, &stored, Examination::default());
    let point = Point { solution: at_corner.solution, parameters: at_corner.parameters, ..last.point.clone() };
    let mut unstable = [last.point.unstable, first.point.unstable];
    if direction < 0.0 {
        unstable.reverse();
    }
    // The curvature of the branch over the extrapolation; the extremum of an orbit that slides is known to the cube of
    // the speed at which it arrives, that is to √g relative to g.
    let doubt = rest + (there.abs() / touch.size).sqrt();
    let error = last.point.trust.discretisation.max(settings.tolerance) + 10.0 * rest * doubt;
    let special = SpecialPoint {
        kind: Kind::Grazing,
        point,
        unstable_before: unstable[0],
        unstable_after: unstable[1],
        error,
        coefficients: Vec::new(),
        coefficient_errors: Vec::new(),
        remark: format!("{SLIDING}: {} at {name} = 0", if turns { "non-smooth fold" } else { "persistence" }),
    };
    Some((special, first))
}

/// A mesh with a single interval around a touch, at least as long as the contact.
fn without_nodes_near(mesh: &Mesh, touch: &Touch) -> Mesh {
    // A contact of depth δ lasts of the order of the square root of δ.
    let width = (touch.extremum.value.abs() / touch.size).sqrt();
    let last = mesh.len() - 1;
    let apart = |t: f64| (t - touch.extremum.time - (t - touch.extremum.time).round()).abs();
    let stays = |k: usize| k == 0 || k == last || apart(mesh[k]) > width;
    (0..=last).filter(|k| stays(*k)).map(|k| mesh[k]).collect::<Vec<f64>>().into()
}

/// First word of the remark of a corner.
pub(crate) const SLIDING: &str = "grazing-sliding";
