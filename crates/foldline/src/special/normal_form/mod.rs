//! Normal forms at equilibria: what a bifurcation does to the solutions around it.
//!
//! **Equations.** With A = f_x, B, C, D and E the second to fifth derivatives of f in the states, ⟨q, q⟩ = 1 and ⟨p, q⟩ = 1 unless said
//! otherwise, on the critical eigenspace:
//!
//! ```text
//!   fold              (1)  A q = 0, pᵀ A = 0:            ξ' = β + a ξ²,         a = ½ ⟨p, B(q,q)⟩
//!   cusp              (2)  A h = -B(q,q), ⟨p, h⟩ = 0:    ξ' = … + c ξ³,         c = ⅙ ⟨p, C(q,q,q) + 3 B(q,h)⟩
//!   branch point      (3)  x = x(μ) + ξ q + …, x(μ) the branch, μ its parameter counted from there:
//!        ξ' = b μ ξ + a ξ² + c ξ³,   b = ⟨p, f_xμ q + B(q, x_μ)⟩,  a and c of (1) and (2)
//!   Hopf              (4)  A q = iω q, pᴴ A = iω pᴴ:     z' = iω z + … l₁ ω z |z|²
//!        l₁ = 1/(2ω) Re ⟨p, C(q,q,q̄) - 2 B(q, A⁻¹ B(q,q̄)) + B(q̄, (2iω - A)⁻¹ B(q,q))⟩
//!   generalised Hopf  (5)  z' = iω z + ic z |z|² + (l₂ ω + …) z |z|⁴,   l₂ = 1/(12ω) Re g₃₂
//!   zero-Hopf         (6)  ξ' = b ξ² + c |z|² + …,  z' = iω z + d ξ z + …,  which a change of coordinates and of time bring to
//!        ξ' = b ξ² + c |z|²,  z' = iω z + (d + i…) ξ z + E ξ² z         up to terms of fourth order
//!        s = sign(b c),  θ = Re d / b
//!        E = ½ Re [ g₂₁₀ + g₁₁₀ (Re g₀₂₁ / c - g₃₀₀ / 2b + g₁₁₁ / c) - g₀₂₁ b / c ]
//!   Bogdanov–Takens   (7)  A q₀ = 0, A q₁ = q₀, p₁ᵀ A = 0, p₀ᵀ A = p₁ᵀ, ⟨p₀,q₀⟩ = ⟨p₁,q₁⟩ = 1, ⟨p₀,q₁⟩ = 0:
//!        ξ₁' = ξ₂,  ξ₂' = … + a ξ₁² + b ξ₁ ξ₂,   a = ½ ⟨p₁, B(q₀,q₀)⟩,  b = ⟨p₀, B(q₀,q₀)⟩ + ⟨p₁, B(q₀,q₁)⟩
//!   double Hopf       (8)  ω₁ > ω₂, r_i = |z_i|:   r₁' = r₁ (… + p₁₁ r₁² + p₁₂ r₂²),  r₂' = r₂ (… + p₂₁ r₁² + p₂₂ r₂²)
//!        θ = p₁₂ / p₂₂,  δ = p₂₁ / p₁₁
//! ```
//!
//! The g in (5) and (6) are derivatives of the motion on the centre manifold, by the powers of (z, z̄) and of (ξ, z, z̄); with those of third and
//! higher order in (4) to (8) they come from one recursion, see `manifold`.
//!
//! All are in the units of the model. The signs of a (fold, branch point) and of a and b together (Bogdanov–Takens) change with that of q; those
//! of b (branch point), c, l₁, l₂, E and the p do not, and s, θ and δ do not depend on the length of q either. A branch point is a pitchfork where a
//! vanishes but for rounding, by symmetry that is, and transcritical elsewhere.
//!
//! | what | file |
//! |---|---|
//! | derivatives of f, critical eigenvectors | `local` |
//! | motion on the centre manifold | `manifold` |
//! | (1), (2), (3), (6), (7) | `zero` |
//! | (4), (5), (8) | `oscillating` |
//!
//! **Source.** kuznetsov2004, §5.4 (fold, Hopf), §8.7 (the others) and §8.5 (what θ and E decide); govaerts2000, §6 (branch points).
//!
//! **Departures.** l₂ has the factor 1/ω that l₁ has; MATCONT and BifurcationKit leave it out.

mod local;
mod manifold;
mod oscillating;
#[cfg(test)]
mod tests;
mod zero;

pub use local::Local;

use crate::diagram::{Kind, Point, Solution};
use crate::problem::Setting;

/// Relative to the terms of a coefficient, what is left of them is no more than rounding.
const ROUNDING: f64 = 1e-12;

/// The sum of some terms; exactly zero where it is less than that share of their sizes.
pub(super) fn without_rounding(terms: &[f64], sizes: &[f64], share: f64) -> f64 {
    let (total, size) = (terms.iter().sum::<f64>(), sizes.iter().sum::<f64>());
    if total.abs() <= share * size { 0.0 } else { total }
}

/// The frequencies of the pairs of eigenvalues, those closest to the imaginary axis first.
fn frequencies(at: &Point) -> Vec<f64> {
    let mut pairs: Vec<_> = at.spectrum.iter().filter(|z| z.im > 0.0).collect();
    pairs.sort_by(|a, b| (a.re / a.im).abs().total_cmp(&(b.re / b.im).abs()));
    pairs.into_iter().map(|z| z.im).collect()
}

/// The coefficients of the normal form of a special point of that kind, in the order of [`Kind::coefficients`]; none where they are not
/// known. Of the setting, the field, the scales of the states and the last of the free parameters count, which is that of the branch.
pub fn coefficients(setting: &Setting, kind: Kind, at: &Point) -> Vec<f64> {
    let Some(local) = Local::new(setting.field, at) else { return Vec::new() };
    let frequencies = frequencies(at);
    let first = frequencies.first().copied();
    let found = match kind {
        Kind::Fold => local.fold().map(|a| vec![a]),
        Kind::BranchPoint => tangent(setting, at).and_then(|along| local.crossing(&along, setting.scales)),
        Kind::Hopf => first.and_then(|omega| local.hopf(omega)).map(|l| vec![l]),
        Kind::Cusp => local.cusp().map(|c| vec![c]),
        Kind::BogdanovTakens => local.takens().map(|both| both.to_vec()),
        Kind::GeneralisedHopf => first.and_then(|omega| local.generalised_hopf(omega)).map(|l| vec![l]),
        Kind::ZeroHopf => first.and_then(|omega| local.zero_hopf(omega)).map(|all| all.to_vec()),
        Kind::DoubleHopf => match frequencies[..] {
            [a, b, ..] => local.double_hopf([a.max(b), a.min(b)]),
            _ => None,
        },
        _ => None,
    };
    found.filter(|all| all.iter().all(|c| c.is_finite())).unwrap_or_default()
}

/// The tangent of a branch in states and parameters `[n + k]` for one unit of its parameter.
fn tangent(setting: &Setting, at: &Point) -> Option<Vec<f64>> {
    let Solution::Equilibrium(x) = &at.solution else { return None };
    // A branch that itself turns there has another one as its line of reference.
    const STEEP: f64 = 1e-3;
    let (slope, states) = (at.parameter_slope(), at.tangent.get(..x.len())?);
    let scale = setting.axes.last()?.scale;
    let sideways = states.iter().zip(setting.scales).fold(0.0f64, |most, (t, s)| most.max((t / s).abs()));
    if (slope / scale).abs() < STEEP * sideways {
        return None;
    }
    let mut unit = vec![0.0; setting.freedom()];
    *unit.last_mut()? = 1.0;
    Some(states.iter().map(|t| t / slope).chain(setting.spread(&unit)).collect())
}
