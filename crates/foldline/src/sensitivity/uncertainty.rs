//! Uncertainty of special points from that of the parameters.
//!
//! **Idea.** To first order, the variance of a number is the sum of the variances that the parameters contribute
//! through its derivatives. Where the dependence is not linear over the spread of the parameters, that is not enough;
//! the defining system is therefore also solved at sampled parameters, starting from the first-order prediction.
//!
//! **Equations.** Parameters independent with means m_i and standard deviations s_i, at the values p_i:
//!
//! ```text
//!   (1)  mean = q + Σ q_{p_i} (m_i - p_i),    s² = Σ (q_{p_i} s_i)²
//!   (2)  Latin hypercube: sample k of parameter i is the quantile (π_i(k) + 1/2) / N, with permutations π_i
//! ```
//!
//! **Source.** mckay1979 (Latin hypercube sampling); marsaglia2004 (normal distribution).
//!
//! **Fails when** parameters depend on each other, and where the special point vanishes within their spread: samples
//! without a solution are counted, and the others are not representative.

use super::routes::{Base, Posed, Route, sharpen};
use super::{Measured, with_base};
use crate::attractors::SplitMix64;
use crate::diagram::{Branch, Kind, SpecialPoint};
use crate::explore::System;
use crate::explore::plan::Plan;
use crate::model::Spread;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Mean and standard deviation of a parameter with the given value.
fn moments_of(spread: Spread, value: f64) -> [f64; 2] {
    match spread {
        Spread::Normal(sigma) => [value, sigma],
        Spread::Uniform([low, high]) => [0.5 * (low + high), (high - low) / 12.0f64.sqrt()],
    }
}

fn quantile_of(spread: Spread, value: f64, share: f64) -> f64 {
    match spread {
        Spread::Normal(sigma) => value + sigma * normal_quantile(share),
        Spread::Uniform([low, high]) => low + share * (high - low),
    }
}

/// Distribution of a number.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// The number.
    pub of: Measured,
    /// Its value at the values of the parameters.
    pub value: f64,
    /// Mean and standard deviation to first order (1); the reason if a derivative is missing.
    pub first_order: Result<[f64; 2], String>,
    /// Mean and standard deviation of the samples; `None` with fewer than two.
    pub sampled: Option<[f64; 2]>,
    /// Quantiles of the samples that contain 95 % of them.
    pub range: Option<[f64; 2]>,
}

/// Uncertainty of a special point.
#[derive(Clone, Debug, PartialEq)]
pub struct Uncertainty {
    /// Distribution of every number.
    pub bands: Vec<Band>,
    /// Number of samples taken.
    pub samples: usize,
    /// Reasons why samples have no solution, each with the number of such samples.
    pub failed: Vec<(String, usize)>,
}

/// Returns the uncertainty of a special point if parameters, given by index, have these distributions and the others
/// are exact. A distribution of the branch's own parameter has no effect, because the special point determines its
/// value.
///
/// # Errors
/// The reason why there is none.
pub fn uncertainty(
    system: &System,
    branch: &Branch,
    special: &SpecialPoint,
    plan: &Plan,
    spreads: &[(usize, Spread)],
    samples: usize,
) -> Result<Uncertainty, String> {
    with_base(system, branch, special, plan, |posed, base| {
        let spreads: Vec<(usize, Spread)> =
            spreads.iter().filter(|(index, _)| posed.parameters.contains(index)).copied().collect();
        let sensitivities = posed.sensitivities(base)?;
        let route = posed.route(base)?;
        let (mut found, mut failed): (Vec<Vec<f64>>, BTreeMap<String, usize>) = (Vec::new(), BTreeMap::new());
        for sample in hypercube(base, &spreads, samples) {
            match solved(posed, base, &route, &sample) {
                Ok(values) => found.push(values),
                Err(why) => *failed.entry(why).or_default() += 1,
            }
        }
        let bands = sensitivities.rows.iter().enumerate().map(|(r, row)| {
            let each = spreads.iter().map(|(index, spread)| {
                let [mean, sigma] = moments_of(*spread, base.parameters[*index]);
                let column = posed.parameters.iter().position(|own| own == index).unwrap_or(0);
                let slope = row.by[column].as_ref().map_err(Clone::clone)?.value;
                Ok([slope * (mean - base.parameters[*index]), slope * sigma])
            });
            let first_order = each.collect::<Result<Vec<[f64; 2]>, String>>().map(|parts| {
                let shift = parts.iter().map(|part| part[0]).sum::<f64>();
                [row.value + shift, parts.iter().map(|part| part[1] * part[1]).sum::<f64>().sqrt()]
            });
            let mut own: Vec<f64> = found.iter().filter_map(|values| values.get(r).copied()).collect();
            own.retain(|value| value.is_finite());
            own.sort_by(f64::total_cmp);
            let enough = own.len() > 1;
            Band {
                of: row.of,
                value: row.value,
                first_order,
                sampled: enough.then(|| moments(&own)),
                range: enough.then(|| [0.025, 0.975].map(|share| quantile(&own, share))),
            }
        });
        let bands = bands.collect();
        Ok(Uncertainty { bands, samples, failed: failed.into_iter().collect() })
    })
}

/// Samples (2): changes of the parameters, by index.
fn hypercube(base: &Base, spreads: &[(usize, Spread)], samples: usize) -> Vec<Vec<(usize, f64)>> {
    // The same samples in every run.
    let mut random = SplitMix64(1);
    let columns: Vec<Vec<f64>> = spreads
        .iter()
        .map(|(index, spread)| {
            let value = base.parameters[*index];
            let share = |k: usize| (k as f64 + 0.5) / samples as f64;
            let mut column: Vec<f64> = (0..samples).map(|k| quantile_of(*spread, value, share(k)) - value).collect();
            for k in (1..samples).rev() {
                column.swap(k, (random.next() % (k as u64 + 1)) as usize);
            }
            column
        })
        .collect();
    (0..samples)
        .map(|k| spreads.iter().zip(&columns).map(|((index, _), column)| (*index, column[k])).collect())
        .collect()
}

/// All numbers at the special point for changed parameters.
pub(super) fn solved(posed: &Posed, base: &Base, route: &Route, sample: &[(usize, f64)]) -> Result<Vec<f64>, String> {
    /// Steps on the way to a sample that one step does not reach as predicted.
    const STEPS: usize = 8;
    match walked(posed, base, route, sample, 1) {
        Ok(values) => Ok(values),
        Err(_) => walked(posed, base, route, sample, STEPS),
    }
}

fn walked(
    posed: &Posed,
    base: &Base,
    route: &Route,
    sample: &[(usize, f64)],
    steps: usize,
) -> Result<Vec<f64>, String> {
    /// Deviation from the prediction, relative to the predicted change: a step that misses by more may have ended at
    /// another point.
    const MISSED: f64 = 0.5;
    let (last, count) = (base.u.len() - 1, posed.parameters.len());
    let mut predicted = vec![0.0; base.u.len()];
    for (index, change) in sample {
        let column = posed.parameters.iter().position(|own| own == index).unwrap_or(0);
        let direction = &route.directions[column];
        let share = change / posed.system.unit(*index);
        predicted[..last].iter_mut().zip(&direction[..direction.len() - count]).for_each(|(x, d)| *x += share * d);
    }
    let mut u = base.u.clone();
    let mut values = Vec::new();
    for step in 1..=steps {
        let mut parameters = base.parameters.clone();
        sample.iter().for_each(|(index, change)| parameters[*index] += change * step as f64 / steps as f64);
        let mut problem = posed.isolated(&parameters)?;
        let extras = problem.extras();
        let zero = problem.zero();
        zero.set_mesh(&base.mesh);
        zero.anchor(&u);
        let part: Vec<f64> = predicted.iter().map(|d| d / steps as f64).collect();
        let before = u.clone();
        u.iter_mut().zip(&part).for_each(|(u, d)| *u += d);
        zero.anchor(&u);
        sharpen(zero, &mut u).map_err(|why| format!("no such point was found ({why})"))?;
        let off: Vec<f64> = u.iter().zip(&before).zip(&part).map(|((u, b), d)| u - b - d).collect();
        let (off, expected) = (zero.relative_size(&off, &u), zero.relative_size(&part, &u));
        // Far from the base the prediction of a later step is its own.
        if off > MISSED * expected + 0.1 * posed.settings.tolerance && (steps == 1 || off > 4.0 * expected) {
            return Err("the special point does not continue to this sample".into());
        }
        if posed.kind == Some(Kind::BranchPoint) && zero.departure(&u) > posed.settings.newton_tolerance() {
            return Err("the branches do not cross at this sample".into());
        }
        if step == steps {
            values = posed.values(zero, &u, extras);
            if posed.kind == Some(Kind::Hopf) && !values.iter().all(|(of, v)| *of != Measured::Period || v.is_finite())
            {
                return Err("the eigenvalues are real at this sample: a neutral saddle".into());
            }
        }
    }
    Ok(values.into_iter().map(|(_, value)| value).collect())
}

fn moments(sorted: &[f64]) -> [f64; 2] {
    let count = sorted.len() as f64;
    let mean = sorted.iter().sum::<f64>() / count;
    let square = sorted.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0);
    [mean, square.sqrt()]
}

/// Quantile of sorted values, linear between them.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = (share * sorted.len() as f64 - 0.5).clamp(0.0, sorted.len() as f64 - 1.0);
    let (low, part) = (place.floor() as usize, place.fract());
    let high = (low + 1).min(sorted.len() - 1);
    sorted[low] + part * (sorted[high] - sorted[low])
}

/// Quantile of the standard normal distribution, by Newton's method from 0, which converges monotonically.
fn normal_quantile(share: f64) -> f64 {
    if share < 0.5 {
        return -normal_quantile(1.0 - share);
    }
    let density = |z: f64| (-0.5 * z * z).exp() / TAU.sqrt();
    let distribution = |z: f64| {
        let (mut term, mut sum, mut k) = (z, z, 1.0);
        while term.abs() > f64::EPSILON * sum.abs() {
            k += 2.0;
            term *= z * z / k;
            sum += term;
        }
        0.5 + density(z) * sum
    };
    let mut z = 0.0;
    for _ in 0..100 {
        let step = (share - distribution(z)) / density(z);
        z += step;
        if step.abs() < 1e-14 {
            break;
        }
    }
    z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_the_normal_distribution_are_the_tabulated_ones() {
        for (share, z) in
            [(0.5, 0.0), (0.975, 1.959963984540054), (0.99, 2.3263478740408408), (0.0005, -3.290526731491895)]
        {
            assert!((normal_quantile(share) - z).abs() < 1e-12, "{share}: {}", normal_quantile(share));
        }
    }

    #[test]
    fn every_parameter_of_a_hypercube_takes_every_quantile_once() {
        let base = Base { u: Vec::new(), mesh: Vec::new().into(), parameters: vec![1.0, 2.0] };
        let samples = hypercube(&base, &[(0, Spread::Uniform([0.0, 8.0])), (1, Spread::Normal(1.0))], 8);
        let mut first: Vec<f64> = samples.iter().map(|s| s[0].1).collect();
        first.sort_by(f64::total_cmp);
        (0..8).for_each(|k| assert!((first[k] - (k as f64 - 0.5)).abs() < 1e-12));
        assert!(samples.iter().map(|s| s[1].1).sum::<f64>().abs() < 1e-12);
    }
}
