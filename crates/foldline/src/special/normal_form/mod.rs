//! Normal forms at equilibria: the local dynamics at a bifurcation.
//!
//! **Equations.** With A = f_x, B, C, D and E the second to fifth derivatives of f in the states, ⟨q, q⟩ = 1 and ⟨p, q⟩
//! = 1 unless said otherwise, on the critical eigenspace:
//!
//! ```text
//!   fold              (1)  A q = 0, pᵀ A = 0:            ξ' = β + a ξ²,         a = ½ ⟨p, B(q,q)⟩
//!   cusp              (2)  A h = -B(q,q), ⟨p, h⟩ = 0:    ξ' = … + c ξ³,         c = ⅙ ⟨p, C(q,q,q) + 3 B(q,h)⟩
//!   branch point      (3)  x = x(μ) + ξ q + …, x(μ) the branch, μ its parameter measured from there:
//!        ξ' = b μ ξ + a ξ² + c ξ³,   b = ⟨p, f_xμ q + B(q, x_μ)⟩,  a and c of (1) and (2)
//!   Hopf              (4)  A q = iω q, pᴴ A = iω pᴴ:     z' = iω z + … l₁ ω z |z|²
//!        l₁ = 1/(2ω) Re ⟨p, C(q,q,q̄) - 2 B(q, A⁻¹ B(q,q̄)) + B(q̄, (2iω - A)⁻¹ B(q,q))⟩
//!   generalised Hopf  (5)  z' = iω z + ic z |z|² + (l₂ ω + …) z |z|⁴,   l₂ = 1/(12ω) Re g₃₂
//!   zero-Hopf         (6)  ξ' = b ξ² + c |z|² + …,  z' = iω z + d ξ z + …,  transformed by changes of coordinates and of time to
//!        ξ' = b ξ² + c |z|²,  z' = iω z + (d + i…) ξ z + E ξ² z         up to terms of fourth order
//!        s = sign(b c),  θ = Re d / b
//!        E = ½ Re [ g₂₁₀ + g₁₁₀ (Re g₀₂₁ / c - g₃₀₀ / 2b + g₁₁₁ / c) - g₀₂₁ b / c ]
//!   Bogdanov–Takens   (7)  A q₀ = 0, A q₁ = q₀, p₁ᵀ A = 0, p₀ᵀ A = p₁ᵀ, ⟨p₀,q₀⟩ = ⟨p₁,q₁⟩ = 1, ⟨p₀,q₁⟩ = 0:
//!        ξ₁' = ξ₂,  ξ₂' = … + a ξ₁² + b ξ₁ ξ₂,   a = ½ ⟨p₁, B(q₀,q₀)⟩,  b = ⟨p₀, B(q₀,q₀)⟩ + ⟨p₁, B(q₀,q₁)⟩
//!   double Hopf       (8)  ω₁ > ω₂, r_i = |z_i|:   r₁' = r₁ (… + p₁₁ r₁² + p₁₂ r₂²),  r₂' = r₂ (… + p₂₁ r₁² + p₂₂ r₂²)
//!        θ = p₁₂ / p₂₂,  δ = p₂₁ / p₁₁
//! ```
//!
//! The g in (5) and (6) are derivatives of the motion on the centre manifold, by the powers of (z, z̄) and of (ξ, z,
//! z̄). The terms of third and higher order in (4) to (8) come from the same recursion, see `manifold`.
//!
//! All coefficients are in the units of the model. The signs of a (fold, branch point) and of a and b together
//! (Bogdanov–Takens) change with that of q. Those of b (branch point), c, l₁, l₂, E and the p do not, and s, θ and δ
//! are also independent of the length of q. A branch point is a pitchfork if a is zero within its error, usually by
//! symmetry, otherwise transcritical.
//!
//! Every coefficient has an error; see `errors`. A quotient whose divisor is zero within its error is undefined and
//! omitted.
//!
//! | what | file |
//! |---|---|
//! | derivatives of f, critical eigenvectors | `local` |
//! | motion on the centre manifold | `manifold` |
//! | homoclinic orbits next to (7) | `loops` |
//! | (1), (2), (3), (6), (7) | `zero` |
//! | (4), (5), (8) | `oscillating` |
//! | errors of all of them | `errors` |
//!
//! **Source.** kuznetsov2004, §5.4 (fold, Hopf), §8.7 (the others) and §8.5 (what θ and E decide); govaerts2000, §6
//! (branch points).
//!
//! **Departures.** l₂ has the factor 1/ω that l₁ has; MATCONT and BifurcationKit leave it out.

mod errors;
mod local;
mod loops;
mod manifold;
mod oscillating;
#[cfg(test)]
mod tests;
mod units;
mod zero;

pub use local::{ALIGNED, Local, SHIFTS, overlap};
pub use loops::Loops;
pub use units::units;

use super::coefficients::Coefficients;
use crate::diagram::{Kind, Point, Solution};
use crate::problem::Setting;
use errors::{Sample, Uncertain};

/// Sum relative to its terms below which it is rounding.
const ROUNDING: f64 = 1e-12;

/// Sum of terms; exactly zero if it is at most `share` of the total of `sizes`.
pub(super) fn without_rounding(terms: &[f64], sizes: &[f64], share: f64) -> f64 {
    let (total, size) = (terms.iter().sum::<f64>(), sizes.iter().sum::<f64>());
    if total.abs() <= share * size { 0.0 } else { total }
}

/// Frequencies of the pairs of eigenvalues, those closest to the imaginary axis first.
fn frequencies(at: &Point) -> Vec<f64> {
    let mut pairs: Vec<_> = at.spectrum.iter().filter(|z| z.im > 0.0).collect();
    pairs.sort_by(|a, b| (a.re / a.im).abs().total_cmp(&(b.re / b.im).abs()));
    pairs.into_iter().map(|z| z.im).collect()
}

/// Amplitude, relative to the scales of the states, beyond which the cubic term must outweigh the quadratic one for a
/// branch point to count as a pitchfork. Empirical: ten times the default tolerance, since a smaller quadratic term
/// cannot be seen on the branches.
const PITCHFORK: f64 = 1e-5;

/// Returns the normal-form coefficients of a bifurcation point of the given kind, in the order of
/// [`Kind::coefficients`]. `error` is the bound on the error of the point. Only the field, the scales of the states and
/// the free parameters of the setting matter; the last free parameter is that of the branch. If several pairs of
/// eigenvalues are on the imaginary axis, the coefficients of a Hopf point are those of pair number `pair`.
pub fn coefficients(setting: &Setting, kind: Kind, at: &Point, error: f64, pair: usize) -> Coefficients {
    if kind.coefficients().is_empty() || !matches!(at.solution, Solution::Equilibrium(_)) {
        return Coefficients::default();
    }
    let uncertain = Uncertain::new(setting, at, error);
    if uncertain.lies_on_a_switch() {
        return Coefficients::none("the equilibrium lies on a switching point of the right-hand side");
    }
    match found(&uncertain, kind, pair) {
        Ok(found) if found.values.iter().all(|value| value.is_finite()) => found,
        Ok(_) => Coefficients::none("they are not finite"),
        Err(why) => Coefficients::none(why),
    }
}

/// Computes the coefficients, or returns the reason why they are undefined.
fn found(uncertain: &Uncertain, kind: Kind, pair: usize) -> Result<Coefficients, String> {
    const RESONANCE: &str = "the eigenvalues are resonant or lack independent eigenvectors";
    // Pairs that are close on the axis change their order from sample to sample.
    let own = frequencies(uncertain.at).get(pair).copied();
    let first = |sample: &Sample| {
        let off = |omega: &f64| own.map_or(0.0, |own| (omega - own).abs());
        frequencies(sample.point).into_iter().min_by(|a, b| off(a).total_cmp(&off(b)))
    };
    let one = |value: Option<f64>| value.map(|value| vec![value]);
    let measured = |formula: &dyn Fn(&Sample) -> Option<Vec<f64>>| uncertain.measured(formula);
    let resonant = || RESONANCE.to_string();
    if matches!(kind, Kind::Fold | Kind::Cusp | Kind::BranchPoint | Kind::ZeroHopf) {
        let simple = measured(&|sample| one(sample.local.simplicity(&uncertain.sizes))).ok_or_else(resonant)?;
        if simple.values[0].abs() <= simple.errors[0] {
            return Err("the eigenvalue 0 is double".into());
        }
    }
    match kind {
        Kind::Fold => measured(&|sample| one(sample.local.fold())).ok_or_else(resonant),
        Kind::Cusp => measured(&|sample| one(sample.local.cusp())).ok_or_else(resonant),
        Kind::BranchPoint => crossing(uncertain),
        Kind::Hopf => measured(&|sample| one(sample.local.hopf(first(sample)?))).ok_or_else(resonant),
        Kind::GeneralisedHopf => {
            measured(&|sample| one(sample.local.generalised_hopf(first(sample)?))).ok_or_else(resonant)
        }
        Kind::BogdanovTakens => {
            let found = measured(&|sample| Some(sample.local.takens()?.to_vec()));
            let vanishes = |(value, error): (&f64, &f64)| value.abs() <= *error;
            let found = found.filter(|found| !found.values.iter().zip(&found.errors).all(vanishes));
            found.ok_or("a and b are zero within their errors, perhaps because of a symmetry".into())
        }
        Kind::ZeroHopf => {
            let all = measured(&|sample| Some(sample.local.zero_hopf(first(sample)?)?.to_vec()));
            divided(all.ok_or_else(resonant)?, 3, &["b", "c"])
        }
        Kind::DoubleHopf => {
            let all = measured(&|sample| match frequencies(sample.point)[..] {
                [a, b, ..] => Some(sample.local.double_hopf([a.max(b), a.min(b)])?.to_vec()),
                _ => None,
            });
            let mut all = all.ok_or_else(resonant)?;
            if [0, 3].iter().any(|k| all.values[*k].abs() <= all.errors[*k]) {
                all.values.truncate(4);
                all.errors.truncate(4);
            }
            Ok(all)
        }
        _ => Ok(Coefficients::default()),
    }
}

/// Returns the first `count` values, or an error if one of the divisors that follow them is zero within its error.
fn divided(mut all: Coefficients, count: usize, divisors: &[&str]) -> Result<Coefficients, String> {
    let zero = |k: &usize| all.values[*k].abs() <= all.errors[*k];
    if let Some((_, name)) = (count..).zip(divisors).find(|(k, _)| zero(k)) {
        return Err(format!("{name} of the normal form, by which they are divided, is zero within its error"));
    }
    all.values.truncate(count);
    all.errors.truncate(count);
    Ok(all)
}

/// Coefficients of a branch point.
fn crossing(uncertain: &Uncertain) -> Result<Coefficients, String> {
    const NONE: &str = "no second branch was found to cross there";
    let setting = uncertain.setting;
    let along = tangent(setting, uncertain.at).ok_or("the branch itself turns back there")?;
    let quadratic = uncertain.measured(&|sample| Some(vec![sample.local.fold()?])).ok_or(NONE)?;
    let sizes = &uncertain.sizes;
    let along: Vec<f64> = along.iter().enumerate().map(|(i, x)| x / sizes.get(i).copied().unwrap_or(1.0)).collect();
    let turning = turns_back(uncertain, &along).ok_or(NONE)?;
    // On the branch that turns back, an error ε of the parameter is an error √ε of the state, which changes a by about
    // c √ε.
    let share = if turning { PITCHFORK.max(uncertain.error.sqrt()) } else { PITCHFORK };
    let local = Local::new(setting.field, uncertain.at);
    let nearly = local.as_ref().and_then(|local| local.is_pitchfork(setting.scales, share)) == Some(true);
    let (a, error) = (quadratic.values[0], quadratic.errors[0]);
    let pitchfork = nearly || a.abs() <= error;
    let measured = |at: &Uncertain| {
        at.measured_in_sizes(&|sample| sample.local.crossing(&along, pitchfork, sizes)).ok_or(NONE.to_string())
    };
    let mut found = measured(uncertain)?;
    if pitchfork {
        let vertex = local.as_ref().filter(|_| turning).and_then(|local| moved(uncertain.at, &local.vertex()?));
        if let Some(point) = vertex {
            let beside = std::mem::replace(&mut found, measured(&Uncertain::new(setting, &point, uncertain.error))?);
            for (k, error) in found.errors.iter_mut().enumerate() {
                *error += (found.values[k] - beside.values[k]).abs();
            }
        }
        // By symmetry it is 0, or at most the observed value.
        found.errors[0] = error + a.abs();
        // An error that is not small leaves it open whether a vanishes: at the largest amplitude it is compared with the cubic
        // term, and with the linear one at one unit of the parameter.
        let reach = local.and_then(|local| local.reach(setting.scales)).ok_or(NONE)?;
        let others = (found.values[2].abs() * reach * reach).max(found.values[1].abs() * setting.unit());
        if !nearly && error * reach > share * others {
            found.values = vec![a, found.values[1]];
            found.errors = vec![error, found.errors[1]];
            found.remark = "a transcritical point or a pitchfork".into();
        }
    }
    Ok(found)
}

/// True if a branch leaves a branch point along its null vector: `along` `[n + k]` is the tangent per unit of the parameter, with
/// states in terms of their sizes.
fn turns_back(uncertain: &Uncertain, along: &[f64]) -> Option<bool> {
    /// Displacement along the null vector over one unit of the parameter, relative to the sizes of the states, that counts as none.
    const NONE: f64 = 1e-3;
    let local = Local::new(uncertain.setting.field, uncertain.at)?.in_units(&uncertain.sizes);
    let [q, _] = local.null_vectors()?;
    let states = &along[..q.len()];
    let own = states.iter().zip(&q).map(|(a, q)| a * q).sum::<f64>();
    let rest = states.iter().zip(&q).map(|(a, q)| (a - own * q).powi(2)).sum::<f64>().sqrt();
    Some(own.abs() > rest + NONE / uncertain.setting.unit())
}

/// An equilibrium displaced by `off` `[n]`.
fn moved(at: &Point, off: &[f64]) -> Option<Point> {
    let Solution::Equilibrium(x) = &at.solution else { return None };
    let solution = Solution::Equilibrium(x.iter().zip(off).map(|(x, off)| x + off).collect());
    Some(Point { solution, ..at.clone() })
}

/// Tangent of a branch in states and parameters `[n + k]` per unit of its parameter.
fn tangent(setting: &Setting, at: &Point) -> Option<Vec<f64>> {
    let Solution::Equilibrium(x) = &at.solution else { return None };
    // A branch that turns back itself cannot serve as the reference branch.
    const STEEP: f64 = 1e-3;
    let (slope, states) = (at.parameter_slope(), at.tangent.get(..x.len())?);
    let sideways = states.iter().zip(setting.scales).fold(0.0f64, |most, (t, s)| most.max((t / s).abs()));
    if slope.abs() < STEEP * sideways {
        return None;
    }
    let mut one = vec![0.0; setting.freedom()];
    *one.last_mut()? = 1.0 / setting.unit();
    Some(states.iter().map(|t| t / (slope * setting.unit())).chain(setting.spread(&one)).collect())
}
