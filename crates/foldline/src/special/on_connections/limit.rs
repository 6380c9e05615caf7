//! Ends of curves of connecting orbits at which the equilibrium stops being a saddle.
//!
//! **Idea.** As an eigenvalue λ approaches the imaginary axis, the time spent next to the equilibrium grows without bound, and the
//! curve cannot be followed to its end. The saddle, and those of its invariant manifolds that the orbit lies in, depend
//! smoothly on ρ = Re λ up to ρ = 0, and so do the parameters along the curve: their values at ρ = 0 are found by
//! extrapolation.
//!
//! **Equations.** With points i = 1 … k of the curve, and Lagrange polynomials l_i through their ρ_i:
//!
//! ```text
//!   (1)  p(0) = Σ_i l_i(0) p_i
//!   (2)  ⟨w, f_p⟩ ≠ 0,   wᵀ f_x = 0              at a saddle-node
//! ```
//!
//! The error is the change by the last point, and the errors of the p_i times |l_i(0)|. (2) excludes equilibria that do not
//! vanish, as at a transcritical bifurcation.
//!
//! **Source.** champneys1996, §2; kuznetsov2004, §7.1 (homoclinic orbits of a saddle-node).
//!
//! **Departures.** Extrapolation in place of conditions at the saddle-node.

use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::{Ending, Kind, Point, SpecialPoint};
use crate::linalg::{dot, larger, lu};

/// Largest number of points used.
const POINTS: usize = 7;
/// Largest ratio of the last ρ to the largest distance of an eigenvalue from the axis.
const NEAR: f64 = 0.1;
/// Largest relative error of the place.
const SURE: f64 = 1e-4;
/// Smallest |⟨w, f_p⟩| / (|w| |f_p|) at a saddle-node. Order of magnitude: 0 if the equilibrium persists.
const TRANSVERSAL: f64 = 1e-3;

/// Ratio of the smallest to the largest distance from the axis at which a curve is not followed any further.
const REACHED: f64 = 1e-3;

/// The end of a curve in the parameter `free` at a point whose saddle has an eigenvalue next to the axis, if it has.
pub fn reached(at: &Point, free: usize) -> Option<Ending> {
    let (rho, real) = nearest(at)?;
    let largest = at.spectrum.iter().map(|z| z.re.abs()).fold(0.0, larger);
    let kind = if real { Kind::NonCentral } else { Kind::ShilnikovHopf };
    (rho.abs() < REACHED * largest).then(|| Ending::Joined { at: kind, parameter: at.parameters[free] })
}

/// The text of an ending for which there is no [`Limit`].
pub fn told(ending: Ending) -> String {
    match ending {
        Ending::StepTooSmall(why) | Ending::GivenUp(why) | Ending::MeshTooLarge(why) => why,
        other => format!("an eigenvalue of the equilibrium comes close to the imaginary axis ({})", other.code()),
    }
}

/// End of a curve.
pub struct Limit {
    kind: Kind,
    /// All parameters there, with their relative errors.
    parameters: Vec<f64>,
    error: f64,
}

/// ρ of the eigenvalue nearest to the axis, and true if it is real.
fn nearest(point: &Point) -> Option<(f64, bool)> {
    let z = point.spectrum.iter().min_by(|a, b| a.re.abs().total_cmp(&b.re.abs()))?;
    Some((z.re, z.im == 0.0))
}

/// l_i(0) through `nodes`.
fn at_zero(nodes: &[f64]) -> Vec<f64> {
    (0..nodes.len())
        .map(|i| (0..nodes.len()).filter(|j| *j != i).map(|j| nodes[j] / (nodes[j] - nodes[i])).product())
        .collect()
}

impl Limit {
    /// The end that a curve in the parameters `free` and `first` approaches, from its points, the last one first; `None` if no
    /// eigenvalue clearly approaches the axis.
    pub fn of(points: &[&Point], free: usize, first: Option<usize>, field: &dyn VectorField) -> Option<Limit> {
        let (last, real) = nearest(points.first()?)?;
        let largest = points[0].spectrum.iter().map(|z| z.re.abs()).fold(0.0, larger);
        if last.abs() > NEAR * largest {
            return None;
        }
        // Approached steadily, by the same kind of eigenvalue.
        let (mut own, mut rho): (Vec<&Point>, Vec<f64>) = (vec![points[0]], vec![last]);
        for point in &points[1..] {
            let Some((next, also)) = nearest(point).filter(|(next, _)| next.signum() == last.signum()) else { break };
            let before = *rho.last()?;
            if also != real || next.abs() <= before.abs() || own.len() == POINTS {
                break;
            }
            // Points close together add nothing but the errors of their difference.
            if next.abs() > 1.1 * before.abs() {
                own.push(point);
                rho.push(next);
            }
        }
        if own.len() < 4 {
            return None;
        }
        let of = |count: usize| -> (Vec<f64>, f64) {
            let weights = at_zero(&rho[..count]);
            let size = own[0].parameters.len();
            let mixed = |k: usize| weights.iter().zip(&own).map(|(w, p)| w * p.parameters[k]).sum::<f64>();
            let noise = weights.iter().zip(&own).map(|(w, p)| w.abs() * p.trust.discretisation).sum();
            ((0..size).map(mixed).collect(), noise)
        };
        let chosen = [Some(free), first];
        let best = (4..=own.len())
            .map(|count| {
                let ((fewer, _), (more, noise)) = (of(count - 1), of(count));
                let off = chosen.iter().flatten().map(|k| (more[*k] - fewer[*k]).abs() / (1.0 + more[*k].abs()));
                (off.fold(0.0, larger) + noise, more)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let (error, mut parameters) = best;
        if error.is_nan() || error > SURE {
            return None;
        }
        // The rest of the parameters describes the last orbit.
        let known = chosen.iter().flatten().copied().max()?;
        let place = field.determined().iter().skip(1).copied();
        let kept: Vec<usize> = chosen.iter().flatten().copied().chain(place).collect();
        (0..parameters.len()).filter(|k| !kept.contains(k)).for_each(|k| parameters[k] = own[0].parameters[k]);
        let kind = if real { Kind::NonCentral } else { Kind::ShilnikovHopf };
        let vanishes = || transversal(field, &parameters, &[free, first.unwrap_or(known)]);
        (!real || vanishes()).then_some(Limit { kind, parameters, error })
    }

    /// The special point, with the last orbit of the curve.
    pub fn special(&self, last: &Point) -> SpecialPoint {
        SpecialPoint {
            kind: self.kind,
            unstable_before: 0,
            unstable_after: 0,
            error: self.error,
            coefficients: Vec::new(),
            coefficient_errors: Vec::new(),
            remark: "extrapolated from the last orbits of the curve".into(),
            point: Point { parameters: self.parameters.clone(), ..last.clone() },
        }
    }
}

/// (2) at the equilibrium where an orbit with these parameters begins.
fn transversal(field: &dyn VectorField, parameters: &[f64], free: &[usize]) -> bool {
    let (n, q) = (field.dim(), free.len());
    let places = field.determined();
    let Some(x) = places.get(1..1 + n).map(|own| own.iter().map(|k| parameters[*k]).collect::<Vec<f64>>()) else {
        return false;
    };
    let [mut f, mut fx, mut fp] = [1, n, q].map(|size| vec![0.0; n * size]);
    let at = Batch { lanes: 1, states: &x, parameters: Parameters::Shared(parameters), times: &[0.0], signs: &[] };
    field.linearise(at, free, &mut f, &mut fx, &mut fp);
    let mut transposed: Vec<f64> = (0..n * n).map(|k| fx[k % n * n + k / n]).collect();
    let mut pivots = vec![0; n];
    if lu::factorise(&mut transposed, n, &mut pivots).is_err() {
        return false;
    }
    let mut w: Vec<f64> = (0..n).map(|k| 1.0 + 0.3 * (1.7 * k as f64).sin()).collect();
    for _ in 0..2 {
        lu::solve(&transposed, n, &pivots, &mut w, 1);
        let length = dot(&w, &w).sqrt();
        w.iter_mut().for_each(|w| *w /= length);
    }
    (0..q).any(|c| {
        let own: Vec<f64> = (0..n).map(|i| fp[i * q + c]).collect();
        dot(&w, &own).abs() > TRANSVERSAL * dot(&own, &own).sqrt()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_extrapolated_exactly() {
        let nodes = [0.1, 0.3, 0.7, 1.1];
        let cubic = |x: f64| 2.0 - x + 3.0 * x * x - 5.0 * x * x * x;
        let value: f64 = at_zero(&nodes).iter().zip(nodes).map(|(w, x)| w * cubic(x)).sum();
        assert!((value - 2.0).abs() < 1e-13, "{value}");
    }
}
