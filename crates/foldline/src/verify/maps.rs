//! Verification of cycles of maps.
//!
//! **Idea.** The continuation solves for all iterates together. Here the map is composed: the first iterate is the only
//! unknown, its orbit is followed in twice the working precision, and Newton's method uses the product of the
//! derivatives, whose eigenvalues are the multipliers. The two have only the map in common.
//!
//! **Equations.** With F = f^N, D = F_x and x_0 the first stored iterate:
//!
//! ```text
//!   (1)  (D - 1) Δ = -(F(x_0) - x_0)
//!   (2)  (D - 1) Δ + F_λ Δλ = -(F(x_0) - x_0),   t·(Δ, Δλ) = 0     next to a special point, t the tangent of the branch
//! ```
//!
//! **Fails when** D expands so much that its rounding errors exceed the stated errors; such points count as undecided.

use super::{Check, Quantity, Undecided, Verified};
use crate::contract::{Batch, Parameters};
use crate::diagram::{Branch, Ending, Kind, Point, Solution};
use crate::linalg::{larger, lu, max_abs, periodic_schur};
use crate::problem::Setting;
use num_complex::Complex64;

/// Largest relative entry of D, in scaled states, for which the composed map is used: eight digits are left.
const LARGEST: f64 = 1e8;
/// Relative rounding error of a comparison.
const ROUNDING: f64 = 1e-13;
/// Number of Newton steps.
const STEPS: usize = 6;
/// |1 - μ| below which the cycle is not isolated to working precision.
const SINGULAR: f64 = 1e-7;

/// Composed map at a state.
struct Composed {
    /// F(x_0) - x_0 - gain.
    miss: Vec<f64>,
    /// `[n × n]` D.
    whole: Vec<f64>,
    /// `[n × k]` F_λ.
    by_parameter: Vec<f64>,
    /// `[N][n]` the orbit.
    orbit: Vec<f64>,
}

/// Follows the orbit of `x` for `count` iterations, in twice the working precision if the field supports that.
fn composed(setting: &Setting, x: &[[f64; 2]], free: &[f64], count: usize, gain: &[f64]) -> Option<Composed> {
    let (n, k) = (x.len(), setting.freedom());
    let parameters = setting.at(free);
    let precise: Vec<[f64; 2]> = parameters.iter().map(|p| [*p, 0.0]).collect();
    let (mut state, mut orbit) = (x.to_vec(), Vec::new());
    let mut whole: Vec<f64> = (0..n * n).map(|c| f64::from(u8::from(c % (n + 1) == 0))).collect();
    let mut by_parameter = vec![0.0; n * k];
    for _ in 0..count {
        let rounded: Vec<f64> = state.iter().map(|[high, low]| high + low).collect();
        let batch =
            Batch { lanes: 1, states: &rounded, parameters: Parameters::Shared(&parameters), times: &[], signs: &[] };
        let (mut f, mut fx, mut fp) = (vec![0.0; n], vec![0.0; n * n], vec![0.0; n * k]);
        setting.linearise(batch, &mut f, &mut fx, &mut fp);
        let times = |m: &[f64], width: usize| -> Vec<f64> {
            (0..n * width).map(|c| (0..n).map(|j| fx[c / width * n + j] * m[j * width + c % width]).sum()).collect()
        };
        whole = times(&whole, n);
        if k > 0 {
            by_parameter = times(&by_parameter, k).iter().zip(&fp).map(|(a, b)| a + b).collect();
        }
        orbit.extend(rounded);
        state = match setting.field.evaluate_precisely(&state, &precise) {
            Some(next) => next,
            None => f.iter().map(|x| [*x, 0.0]).collect(),
        };
    }
    let gain = |i: usize| gain.get(i).copied().unwrap_or(0.0);
    let miss = (0..n).map(|i| (state[i][0] - x[i][0] - gain(i)) + (state[i][1] - x[i][1])).collect();
    let finite = max_abs(&whole).is_finite() && state.iter().all(|x| x[0].is_finite());
    finite.then_some(Composed { miss, whole, by_parameter, orbit })
}

/// D - 1.
fn shifted(whole: &[f64], n: usize) -> Vec<f64> {
    whole.iter().enumerate().map(|(c, d)| if c % (n + 1) == 0 { d - 1.0 } else { *d }).collect()
}

/// Largest entry of D in scaled states.
fn growth(whole: &[f64], scales: &[f64]) -> f64 {
    let n = scales.len();
    whole.iter().enumerate().fold(0.0, |most, (c, d)| larger(most, (d * scales[c % n] / scales[c / n]).abs()))
}

/// Verifies the points with the given indices.
pub(super) fn points(setting: &Setting, branch: &Branch, chosen: &[usize]) -> Verified {
    let mut out = Verified::default();
    for point in chosen.iter().map(|i| &branch.points[*i]) {
        match checked(setting, branch, point) {
            Ok(checks) => {
                out.points += 1;
                out.checks.extend(checks.into_iter().map(|(quantity, stated, found)| Check {
                    branch: branch.name.clone(),
                    position: point.position,
                    special: None,
                    parameter: point.parameters.get(branch.free).copied().unwrap_or(f64::NAN),
                    quantity,
                    stated,
                    found,
                }));
            }
            Err(why) => out.undecided.push(Undecided {
                branch: branch.name.clone(),
                position: point.position,
                special: None,
                why,
            }),
        }
    }
    out
}

type Found = (Quantity, Option<f64>, f64);

fn checked(setting: &Setting, branch: &Branch, point: &Point) -> Result<Vec<Found>, &'static str> {
    let Solution::Cycle(cycle) = &point.solution else { return Err("it is not a cycle") };
    if cycle.profile.is_empty() {
        return Err("its profile was not stored");
    }
    let ends = [branch.points.first(), branch.points.last()];
    let joins = ends.iter().zip(&branch.ends).any(|(end, why)| {
        end.is_some_and(|end| end.position == point.position) && matches!(why, Some(Ending::Joined { .. }))
    });
    if joins || point.spectrum.iter().any(|z| (z - 1.0).norm() < SINGULAR) {
        return Err("a multiplier is 1 there, and the composed map is singular");
    }
    let (n, count) = (cycle.dim(), cycle.intervals());
    let free = setting.unknowns_of(point);
    let size = |i: usize| cycle.profile.iter().skip(i).step_by(n).fold(0.0, |most: f64, x| most.max(x.abs()));
    let scales: Vec<f64> = (0..n).map(|i| setting.scales[i] + size(i)).collect();
    let mut x: Vec<[f64; 2]> = cycle.profile[..n].iter().map(|x| [*x, 0.0]).collect();
    let mut last = None;
    for _ in 0..STEPS {
        let found = composed(setting, &x, &free, count, &cycle.gain).ok_or("the orbit is not finite")?;
        if growth(&found.whole, &scales) > LARGEST {
            return Err("the composed map expands too much to be compared");
        }
        let (mut a, mut d, mut pivots) = (shifted(&found.whole, n), found.miss.clone(), vec![0; n]);
        lu::factorise(&mut a, n, &mut pivots).map_err(|_| "the composed map is singular there")?;
        lu::solve(&a, n, &pivots, &mut d, 1);
        x.iter_mut().zip(&d).for_each(|(x, d)| {
            let sum = x[1] - d;
            let high = x[0] + sum;
            *x = [high, sum - (high - x[0])];
        });
        last = Some(found);
    }
    let found = composed(setting, &x, &free, count, &cycle.gain).or(last).ok_or("the orbit is not finite")?;
    let off =
        (0..n * count).fold(0.0, |most, c| larger(most, (found.orbit[c] - cycle.profile[c]).abs() / scales[c % n]));
    // Rounding of f moves the cycle by the condition of the matrix of all iterates, of which 1 / |1 - μ| is the part that
    // may be large.
    let nearest = point.spectrum.iter().fold(1.0, |least: f64, z| least.min((z - 1.0).norm()));
    let rounding = ROUNDING + count as f64 * 8.0 * f64::EPSILON / nearest;
    let mut checks = vec![(Quantity::Profile, Some(point.trust.residual + rounding), off)];
    let unscaled: Vec<f64> = found.whole.iter().enumerate().map(|(c, d)| d * scales[c % n] / scales[c / n]).collect();
    let multipliers: Vec<Complex64> = periodic_schur::eigenvalues(&unscaled, n)
        .ok_or("the eigenvalues of the composed map were not found")?
        .iter()
        .map(|own| own.value())
        .collect();
    let noise = growth(&found.whole, &scales) * count as f64 * f64::EPSILON;
    let apart = nearest_pairs(&point.spectrum, &multipliers);
    let worst = apart.iter().fold(0.0, |most, (a, b)| larger(most, (a - b).norm() / a.norm().max(1.0)));
    checks.push((Quantity::Spectrum, Some(point.trust.spectrum + noise.sqrt()), worst));
    let side = apart.iter().filter(|(a, b)| (a.norm() > 1.0) != (b.norm() > 1.0));
    let side = side.fold(0.0, |most, (_, b)| larger(most, (b.norm() - 1.0).abs()));
    checks.push((Quantity::Stability, Some(point.trust.spectrum + noise.sqrt()), side));
    Ok(checks)
}

/// Each of `a` with the nearest of `b` that is left.
fn nearest_pairs(a: &[Complex64], b: &[Complex64]) -> Vec<(Complex64, Complex64)> {
    let mut rest = b.to_vec();
    let pair = |z: &Complex64| {
        let at = (0..rest.len()).min_by(|p, q| (rest[*p] - z).norm().total_cmp(&(rest[*q] - z).norm()));
        (*z, at.map_or(Complex64::new(f64::NAN, 0.0), |at| rest.swap_remove(at)))
    };
    a.iter().map(pair).collect()
}

/// Solution at a distance along the tangent of a special point: unknown λ, its slope, and the multipliers.
pub(super) fn beside(setting: &Setting, at: &Point, distance: f64) -> Option<(f64, f64, Vec<Complex64>)> {
    let Solution::Cycle(cycle) = &at.solution else { return None };
    let (n, count) = (cycle.dim(), cycle.intervals());
    let states = n * count;
    if at.tangent.len() != states + 1 {
        return None;
    }
    let scales: Vec<f64> = (0..n).map(|i| setting.scales[i] + cycle.profile[i].abs()).collect();
    let mut along: Vec<f64> = (0..n).map(|i| at.tangent[i] / scales[i]).chain([at.tangent[states]]).collect();
    let length = along.iter().map(|t| t * t).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
    along.iter_mut().for_each(|t| *t /= length);
    let mut x: Vec<f64> = (0..n).map(|i| cycle.profile[i] + distance * along[i] * scales[i]).collect();
    let mut value = setting.unknowns_of(at)[0] + distance * along[n];
    let (size, mut last) = (n + 1, f64::INFINITY);
    for _ in 0..20 {
        let state: Vec<[f64; 2]> = x.iter().map(|x| [*x, 0.0]).collect();
        let found = composed(setting, &state, &[value], count, &cycle.gain)?;
        if growth(&found.whole, &scales) > LARGEST {
            return None;
        }
        let d = shifted(&found.whole, n);
        let mut matrix = Vec::with_capacity(size * size);
        for i in 0..n {
            matrix.extend((0..n).map(|j| d[i * n + j] * scales[j] / scales[i]));
            matrix.push(found.by_parameter[i] / scales[i]);
        }
        matrix.extend_from_slice(&along);
        let mut right: Vec<f64> = (0..n).flat_map(|i| [-found.miss[i] / scales[i], 0.0]).chain([0.0, 1.0]).collect();
        let mut pivots = vec![0; size];
        lu::factorise(&mut matrix, size, &mut pivots).ok()?;
        lu::solve(&matrix, size, &pivots, &mut right, 2);
        let update: Vec<f64> = right.iter().step_by(2).copied().collect();
        let length = max_abs(&update);
        if length.is_nan() {
            return None;
        }
        if length < 1e-14 || (length < 1e-9 && length > 0.5 * last) {
            let kernel: Vec<f64> = right.iter().skip(1).step_by(2).copied().collect();
            let norm = kernel.iter().map(|t| t * t).sum::<f64>().sqrt();
            let scaled: Vec<f64> =
                found.whole.iter().enumerate().map(|(c, d)| d * scales[c % n] / scales[c / n]).collect();
            let spectrum = periodic_schur::eigenvalues(&scaled, n)?.iter().map(|own| own.value()).collect();
            return Some((value, kernel[n] / norm, spectrum));
        }
        last = length;
        x.iter_mut().zip(&scales).zip(&update).for_each(|((x, s), d)| *x += s * d);
        value += update[n];
    }
    None
}

/// True for kinds of special points of maps whose position is recomputed.
pub(super) fn recomputes(kind: Kind) -> bool {
    matches!(kind, Kind::Fold | Kind::BranchPoint | Kind::PeriodDoubling | Kind::Torus)
}
