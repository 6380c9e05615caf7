//! Speeds at which a backbone loses its forced cycles.
//!
//! **Idea.** The damping limit passes ζ/ε between two neighbouring points of a backbone. The interval is bisected in
//! the radius, and the orbit of each radius corrected, because near the root the pull of the tanh law bends the
//! backbone too sharply for interpolation.

use super::Family;
use foldline::continuation::Settings;
use foldline::continuation::corrector::{Plane, settle};
use foldline::contract::ZeroProblem;
use foldline::diagram::{Cost, Solution};
use foldline_rotor::{BackbonePoint, BackboneProblem, OverhungRotor, Spectrum};

const TOLERANCE: f64 = 1e-9;

/// Speeds at which the damping limit of the backbone of SL passes `ratio` = ζ/ε, by increasing distance from the root.
/// The error of each is half the width of its bracket plus an allowance for the tolerance of the orbits.
pub fn speeds(family: &Family, ratio: f64) -> Result<Vec<[f64; 2]>, String> {
    let above = |p: &BackbonePoint| p.damping_limit().is_some_and(|limit| limit > ratio);
    let passes = family.backbone.points.windows(2).filter(|pair| above(&pair[0]) != above(&pair[1]));
    passes.map(|pair| halved(family, pair, ratio)).collect()
}

fn halved(family: &Family, pair: &[BackbonePoint], ratio: f64) -> Result<[f64; 2], String> {
    let rotor = OverhungRotor::default();
    let mut problem = BackboneProblem::new(rotor, family.constants, family.ratio, 1e-2 * TOLERANCE);
    let settings = Settings::new(TOLERANCE, [0.1, 100.0], &[1.0; 4]);
    let [mut a, mut b] = [0, 1].map(|k: usize| problem.unknowns_of(&pair[k].point));
    let first = pair[0].damping_limit().is_some_and(|limit| limit > ratio);
    for _ in 0..40 {
        if (a[3] - b[3]).abs() < TOLERANCE && (a[0] - b[0]).abs() < TOLERANCE {
            break;
        }
        let middle: Vec<f64> = a.iter().zip(&b).map(|(x, y)| 0.5 * (x + y)).collect();
        problem.anchor(&middle);
        // Keeps the radius at the start fixed.
        let plane = Plane { row: vec![1.0, 0.0, 0.0, 0.0], base: middle.clone(), distance: 0.0 };
        let found = settle(&mut problem, &settings, plane, middle, 1.0, &mut Cost::default());
        let found = found.map_err(|why| format!("between two points of a backbone: {why}"))?;
        let Solution::Cycle(cycle) = &found.point.solution else { return Err("no cycle".into()) };
        let lines = Spectrum::of(cycle, found.u[3]);
        let (mean, swirl) = (Some(lines.amplitude(0).re), lines.swirl());
        let point = BackbonePoint { speed: found.u[3], mean, swirl, point: found.point, ..pair[0].clone() };
        let above = point.damping_limit().is_some_and(|limit| limit > ratio);
        *(if above == first { &mut a } else { &mut b }) = found.u;
    }
    Ok([0.5 * (a[3] + b[3]), 0.5 * (a[3] - b[3]).abs() + 10.0 * TOLERANCE])
}
