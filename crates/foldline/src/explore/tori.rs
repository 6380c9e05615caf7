//! First tori: those born at a torus point, and cycles at parameter values at which the forcing has no effect.
//!
//! **Idea.** Near a torus point the torus is the cycle with a small rotating perturbation. A first one is found by Newton's
//! method at a prescribed amplitude, as for other branches; the parameter follows, on whichever side the torus lies.

use super::System;
use super::growth::{Beginning, setting};
use super::plan::{Plan, SeedPlan, SeedSource};
use super::seeds::{bare, first_of, sampling};
use super::switch::{DISTANCES, joined, step_off};
use super::unforced::{Unforced, acts};
use crate::attractors::first_torus;
use crate::continuation::{Settings, Station};
use crate::contract::{Examination, ZeroProblem};
use crate::diagram::{Cycle, Point, Solution, SpecialPoint};
use crate::problem::torus::{LARGEST, TorusProblem, start};
use num_complex::Complex64;

/// Reason why the tori of a model cannot be computed; `None` if they can.
pub fn unsupported(system: &System) -> Option<&'static str> {
    let angles = system.field.periods().iter().any(|period| period.is_finite());
    match system.field {
        field if field.iterated() => Some("tori of maps, which are closed curves, are not supported"),
        field if field.conditions() != [0, 0] => Some("a boundary-value problem has no tori"),
        field if field.switch_count() > 0 => {
            Some("tori of models whose right-hand side switches are not supported; smooth the switch")
        }
        _ if angles => Some("tori of models with angles are not supported"),
        _ => None,
    }
}

/// The start of the branch of tori that bifurcates from a cycle at a torus point.
///
/// # Errors
/// A sentence that says why no torus was found.
pub(super) fn born(
    system: &System,
    settings: &Settings,
    free: usize,
    at: &SpecialPoint,
    cycle: &Cycle,
) -> Result<Beginning, String> {
    if let Some(why) = unsupported(system) {
        return Err(why.into());
    }
    let own = setting(system, free, &at.point.parameters);
    let neutral = |z: &&Complex64| z.im > 0.0;
    let off = |z: &Complex64| z.norm().ln().abs();
    let critical = at.point.free_spectrum().iter().filter(neutral).min_by(|a, b| off(a).total_cmp(&off(b)));
    let critical = *critical.ok_or("no complex pair of multipliers was found")?;
    if let Some(order) = strong_resonance(critical) {
        return Err(format!(
            "the multipliers are close to a root of 1 of order {order} (strong resonance), where the motion is not a torus"
        ));
    }
    let (torus, around) =
        start::at_torus_point(own.clone(), cycle, critical).ok_or("the direction of the multiplier was not found")?;
    let mut problem = TorusProblem::like(own, &torus, None);
    let there = Point { solution: Solution::Torus(torus.clone()), ..at.point.clone() };
    let base = problem.unknowns_of(&there);
    let mut direction = around;
    direction.resize(base.len(), 0.0);
    let expected = |_: &dyn ZeroProblem, _: &Station| true;
    let first = step_off(&mut problem, settings, &base, &direction, 1.0, &DISTANCES[..4], &expected)
        .map_err(|why| why.to_string())?;
    // The special point as a torus of amplitude zero.
    problem.set_mesh(&torus.mesh);
    problem.anchor(&base.iter().zip(&direction).map(|(u, d)| u + d).collect::<Vec<_>>());
    let norm = problem.dot(&direction, &direction).sqrt();
    let tangent: Vec<f64> = direction.iter().map(|d| d / norm).collect();
    let mut edge = problem.point(&base, &tangent, Examination::default());
    edge.parameters.clone_from(&at.point.parameters);
    (edge.ranges, edge.averages) = (at.point.ranges.clone(), at.point.averages.clone());
    edge.trust = at.point.trust;
    let forced = cycle.forcing_periods > 0;
    edge.spectrum = vec![Complex64::new(1.0, 0.0); if forced { 1 } else { 2 }];
    let others = at.point.free_spectrum().iter().filter(|z| (**z - critical).norm() > 1e-12);
    let others = others.filter(|z| (**z - critical.conj()).norm() > 1e-12).copied();
    edge.spectrum.extend(std::iter::once(Complex64::new(1.0, 0.0)).chain(others));
    Ok(Beginning::Edge { before: vec![edge], first, joined: joined(at, free) })
}

/// Order, up to 4, of the root of 1 to which a multiplier on the unit circle is close.
fn strong_resonance(z: Complex64) -> Option<u32> {
    const CLOSE: f64 = 2e-3;
    (1..=4).find(|order| (z.powu(*order) - 1.0).norm() < CLOSE * f64::from(*order))
}

/// A cycle as a torus, at parameters at which the forcing has no effect: the cycle is found without forcing, from the
/// source of the seed.
///
/// # Errors
/// A sentence that says why there is none.
pub(super) fn lifted(
    system: &System,
    plan: &Plan,
    seed: &SeedPlan,
    source: &SeedSource,
    jobs: usize,
) -> Result<Point, String> {
    if let Some(why) = unsupported(system) {
        return Err(why.into());
    }
    if !system.field.forced() {
        return Err(
            "a seed with `torus = true` is a cycle on which a forcing begins to act; this model has none".into()
        );
    }
    if acts(system.field, &seed.parameters, &system.ranges) {
        return Err(
            "the forcing acts at the parameters of this seed; with `torus = true` it begins where the forcing does \
                    not act, so set its amplitude to zero there"
                .into(),
        );
    }
    let field = Unforced(system.field);
    let alone = System { field: &field, ..system.clone() };
    let own = SeedPlan { source: source.clone(), ..seed.clone() };
    let point = first_of(&alone, own, plan, jobs)?;
    let Solution::Cycle(cycle) = &point.solution else {
        return Err("without the forcing the seed leads to an equilibrium, on which the forcing causes a cycle".into());
    };
    let torus = start::lifted(cycle, system.field.time_unit(&seed.parameters));
    Ok(Point { solution: Solution::Torus(torus), tangent: Vec::new(), ..point })
}

/// The torus of a quasi-periodic motion reached by the samples of a seed, and what is known of it.
///
/// # Errors
/// A sentence that says why there is none.
pub(super) fn met(system: &System, plan: &Plan, seed: &SeedPlan) -> Result<(Point, String), String> {
    if let Some(why) = unsupported(system) {
        return Err(why.into());
    }
    let sampling = sampling(system, seed.samples, seed.random, 1, plan.tolerance);
    let (torus, known) = first_torus(system.field, &seed.parameters, &sampling, plan.degree)?;
    if system.field.second_phase().is_some() {
        let said = format!(
            "response to both forcings: {:.9} turns of the second per period of the first; torus of {} trajectories",
            torus.rotation,
            torus.phases()
        );
        return Ok((bare(&seed.parameters, Solution::Torus(torus)), said));
    }
    let [rotation, error] = known.rotation.unwrap_or([f64::NAN; 2]);
    let said = format!(
        "quasi-periodic motion: rotation number {rotation:.9} ± {error:.0e} over {} periods; torus of {} trajectories",
        known.returns,
        torus.phases()
    );
    Ok((bare(&seed.parameters, Solution::Torus(torus)), said))
}

/// The text of an ending at a torus: what was tried, from the text of the continuation, then a likely cause and what can
/// be done.
pub(super) fn likely_cause(last: &Point, why: &str) -> String {
    /// Distance of the rotation number from a ratio below which the motion is suspected to lock.
    const CLOSE: f64 = 3e-3;
    const HIGHEST: u32 = 8;
    let Solution::Torus(torus) = &last.solution else { return why.into() };
    let tried = why.lines().next().unwrap_or_default();
    let off = |q: u32| {
        let turns = torus.rotation * f64::from(q);
        (turns - turns.round()).abs() / f64::from(q)
    };
    let ratio = (1..=HIGHEST).find(|q| off(*q) < CLOSE);
    let many = torus.phases() >= 2 * LARGEST - 1;
    let cause = match (ratio, many) {
        (Some(q), _) => format!(
            "the rotation number {:.6} is close to {}/{q}: the torus probably locks to a cycle of {q} periods",
            torus.rotation,
            (torus.rotation * f64::from(q)).round()
        ),
        (None, true) => format!(
            "the torus is no longer smooth: its harmonics decay too slowly for {} trajectories, as before a break-up, at \
             locking, or with a stiff contact (rotation number {:.6})",
            torus.phases(),
            torus.rotation
        ),
        (None, false) => format!(
            "none is known; the torus has {} trajectories and the rotation number {:.6}",
            torus.phases(),
            torus.rotation
        ),
    };
    let cure = match ratio {
        Some(_) => "a `[[seed]]` with `attractor = \"cycle\"` beyond this value finds the locked cycle",
        None => "a `[[sweep]]` over this value shows what the motion becomes; or a larger `tolerance`",
    };
    format!("{tried}\nlikely cause: {cause}\nwhat to do: {cure}")
}
