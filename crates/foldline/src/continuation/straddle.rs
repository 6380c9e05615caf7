//! Points with a singular Newton matrix, interpolated from both sides.
//!
//! **Idea.** Where two branches cross, Newton's method loses more digits the closer it comes to the crossing. On a fine
//! mesh no digits are left before the bracket is narrow enough. But the branch passes smoothly through the point, so
//! monitor and unknowns can be interpolated from solutions at four distances around it, none of them close.
//!
//! If f switches, distances along the curve are not smooth: they change where a switching passes a node of the mesh, and
//! with them the tangent. The parameter and the multipliers of the cycle do not depend on the mesh. Branch points of such
//! cycles, at which the parameter changes along the branch, are therefore interpolated over the parameter, and the
//! monitor without the slope that it contains.
//!
//! **Equations.** With nodes s₁…s₄ (distances, or parameters) and Lagrange polynomials ℓ_i:
//!
//!   (1)  Σ_i ℓ_i(s) g(s_i) = 0,   then u = Σ_i ℓ_i(s) u(s_i)

use super::corrector::{Plane, Station, correct, doubted, station};
use super::locate::{Located, Stretch, discrepancy};
use super::{Failure, Settings};
use crate::contract::{Monitor, ZeroProblem};
use crate::diagram::{Cost, Kind};
use crate::linalg::larger;

/// Distances between nodes, as shares of the interval, in the order of trial; the last two are used only while Newton's
/// method still converges to the branch.
const SPACINGS: [f64; 5] = [0.25, 0.1, 0.04, 4e-3, 4e-4];
/// Number of spacings that suffice on a mesh; at closer ones rounding dominates.
const ON_A_MESH: usize = 3;
/// Error of an interpolated zero as a share of its last change: the error of a cubic shrinks with the fourth power of
/// the spacing, here by (0.04 / 0.1)⁴.
const REST: f64 = 0.0256;

/// Largest share of the values next to the zero that the cubic may add to the parabola; with more the branch does not
/// pass smoothly through the point.
const SMOOTH: f64 = 0.05;

/// Interpolates the zero of `monitor` in `stretch`, at whose ends its values have opposite signs.
///
/// # Errors
/// See [`Failure`].
pub fn straddle(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    stretch: &Stretch,
    monitor: &dyn Monitor,
    values: [f64; 2],
    cost: &mut Cost,
) -> Result<Located, Failure> {
    let reference = &stretch.left.point;
    let over_parameter = problem.is_switched() && !stretch.left.mesh.is_empty() && monitor.kind() == Kind::BranchPoint;
    let value = |found: &Station| {
        let slope = if over_parameter { found.point.parameter_slope() } else { 1.0 };
        slope * monitor.smooth(&found.point).unwrap_or_else(|| monitor.value(reference, &found.point))
    };
    let ordered = |nodes: &[f64; 4]| nodes.windows(2).all(|pair| (pair[1] > pair[0]) == (nodes[1] > nodes[0]));
    // Nodes for the interpolation.
    let over = |stations: &[Station], distances: [f64; 4]| -> [f64; 4] {
        let parameters = std::array::from_fn(|k| stations[k].parameter());
        if over_parameter && ordered(&parameters) { parameters } else { distances }
    };
    let mut distance = stretch.length * values[0] / (values[0] - values[1]);
    let (mut nodes, mut stations) = ([0.0; 4], Vec::new());
    let (mut root, mut moved) = (f64::NAN, f64::NAN);
    for (k, spacing) in SPACINGS.iter().enumerate() {
        // On a mesh, rounding dominates at closer nodes, which are used only if the interpolation is not yet accurate
        // enough.
        if k == ON_A_MESH
            && !stretch.left.mesh.is_empty()
            && REST * moved * rate(settings, &nodes, &stations) < settings.tolerance
        {
            break;
        }
        let there = [-1.5, -0.5, 0.5, 1.5].map(|k| distance + k * spacing * stretch.length);
        let found: Result<Vec<Station>, Failure> =
            there.iter().map(|s| stretch.at(problem, settings, *s, cost)).collect();
        let found = found.and_then(|found| {
            let own = over(&found, there);
            let next = zero(&own, &found.iter().map(value).collect::<Vec<_>>())?;
            Ok((found, own, next))
        });
        match found {
            Ok((found, own, next)) => {
                // A change of coordinate restarts the comparison.
                moved = (next - root).abs();
                if !moved.is_finite() {
                    moved = (own[3] - own[0]).abs();
                }
                distance = crate::linalg::dot(&weights(&own, next), &there);
                (nodes, stations, root) = (own, found, next);
            }
            Err(_) if k >= ON_A_MESH => break,
            Err(why) => return Err(why),
        };
    }
    let values: Vec<f64> = stations.iter().map(value).collect();
    if bend(&nodes, &values, root) > SMOOTH * values[1].abs().max(values[2].abs()) {
        return Err(Failure::Unexplained);
    }
    let mut coarse = blend(problem, &nodes, &stations, root, stretch.left, stretch.direction);
    let floor = 10.0 * settings.newton_tolerance() + REST * moved * rate(settings, &nodes, &stations);
    let mut error = floor;
    for _ in 0..3 {
        problem.set_mesh(&coarse.mesh);
        let Some(finer) = problem.finer_mesh() else { break };
        let mut refined = Vec::with_capacity(stations.len());
        for from in &stations {
            problem.set_mesh(&finer);
            let mut u = problem.carry(&from.u, &from.mesh, &finer);
            let row = problem.transfer(&stretch.left.tangent, &stretch.left.mesh, &finer);
            problem.anchor(&u);
            let plane = Plane { row: row.clone(), base: u.clone(), distance: 0.0 };
            correct(problem, settings, &plane, &mut u, cost)?;
            let mut found = station(problem, u, &row, settings.newton_tolerance(), stretch.direction, cost)?;
            if over_parameter {
                doubted(problem, &mut found);
            }
            refined.push(found);
        }
        nodes = over(&refined, nodes);
        root = zero(&nodes, &refined.iter().map(value).collect::<Vec<_>>())?;
        stations = refined;
        let fine = blend(problem, &nodes, &stations, root, stretch.left, stretch.direction);
        let gap = coarse.parameter() - fine.parameter();
        error = floor + discrepancy(settings, &coarse.point, &fine.point, gap, fine.parameter());
        coarse = fine;
        if error <= settings.tolerance {
            break;
        }
    }
    Ok(Located { distance, station: coarse, error })
}

/// Rate of change of the point along the curve between the inner nodes, in the measure of [`discrepancy`].
fn rate(settings: &Settings, nodes: &[f64; 4], stations: &[Station]) -> f64 {
    let [_, a, b, _] = stations else { return 0.0 };
    discrepancy(settings, &a.point, &b.point, a.parameter() - b.parameter(), b.parameter())
        / (nodes[2] - nodes[1]).abs()
}

/// Lagrange polynomials of the nodes, evaluated at `s`.
fn weights(nodes: &[f64; 4], s: f64) -> [f64; 4] {
    std::array::from_fn(|i| (0..4).filter(|&k| k != i).map(|k| (s - nodes[k]) / (nodes[i] - nodes[k])).product())
}

/// Change of the interpolated value at `s` if the node farthest from it is omitted.
fn bend(nodes: &[f64; 4], values: &[f64], s: f64) -> f64 {
    // The third divided difference; the cubic adds it times the product of the distances.
    let part = |i: usize| (0..4).filter(|&k| k != i).map(|k| nodes[i] - nodes[k]).product::<f64>();
    let third: f64 = (0..4).map(|i| values[i] / part(i)).sum();
    let distances = nodes.map(|node| (s - node).abs());
    let farthest = distances.iter().fold(0.0, |m: f64, d| m.max(*d));
    (third * distances.iter().filter(|d| **d < farthest).product::<f64>()).abs()
}

/// The zero (1) between the outer nodes, by bisection.
fn zero(nodes: &[f64; 4], values: &[f64]) -> Result<f64, Failure> {
    let at = |s: f64| crate::linalg::dot(&weights(nodes, s), values);
    let (mut low, mut high) = (nodes[0], nodes[3]);
    let product = values[0] * values[3];
    if product.is_nan() || product >= 0.0 {
        return Err(Failure::Singular);
    }
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if (at(middle) > 0.0) == (values[0] > 0.0) { low = middle } else { high = middle }
    }
    Ok(0.5 * (low + high))
}

/// Interpolates the station at `s` from stations that share a mesh.
fn blend(
    problem: &mut dyn ZeroProblem,
    nodes: &[f64; 4],
    stations: &[Station],
    s: f64,
    left: &Station,
    direction: f64,
) -> Station {
    let mesh = stations.first().map_or_else(|| left.mesh.clone(), |own| own.mesh.clone());
    let mix = |part: &dyn Fn(&Station) -> &[f64]| -> Vec<f64> {
        let mut sum = vec![0.0; part(&stations[0]).len()];
        weights(nodes, s).iter().zip(stations).for_each(|(w, own)| crate::linalg::axpy(*w, part(own), &mut sum));
        sum
    };
    let mut tangent = mix(&|own| &own.tangent);
    problem.set_mesh(&mesh);
    let solutions: Vec<&[f64]> = stations.iter().map(|own| &own.u[..]).collect();
    let u = problem.blended(&solutions, &weights(nodes, s));
    problem.anchor(&u);
    let norm = problem.dot(&tangent, &tangent).sqrt();
    tangent.iter_mut().for_each(|t| *t /= norm);
    // The matrix may be singular here. The multipliers do not depend on that, but the error estimate does.
    let _ = problem.factorise(&u, &tangent);
    let mut examination = problem.examine(&u);
    examination.trust.discretisation = stations.iter().map(|own| own.point.trust.discretisation).fold(0.0, larger);
    // Next to the singular matrix the estimate grows without a reason in the spectrum.
    examination.trust.spectrum = stations.iter().map(|own| own.point.trust.spectrum).fold(f64::NAN, f64::min);
    let stored: Vec<f64> = tangent.iter().map(|t| direction * t).collect();
    let point = problem.point(&u, &stored, examination);
    Station::new(point, u, tangent, mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bend_is_the_difference_between_cubic_and_parabola() {
        let nodes = [-1.5, -0.5, 0.5, 1.5];
        let line = nodes.map(|s| 2.0 * s - 1.0 + s * s);
        assert!(bend(&nodes, &line, 0.2) < 1e-14, "nothing for a parabola");
        // x³ minus its parabola through the three nodes nearest to 0.2, which omits -1.5.
        let cubic = nodes.map(|s: f64| s.powi(3));
        assert!((bend(&nodes, &cubic, 0.2) - 0.7 * 0.3 * 1.3).abs() < 1e-14);
        assert!((zero(&nodes, &nodes.map(|s: f64| s.powi(3) - 0.001)).unwrap() - 0.1).abs() < 1e-12);
    }
}
