//! The relative exponential (eˣ - 1)/x and its derivatives.
//!
//! **Idea.** Ion-channel rates and Bose factors are quotients such as u/(1 - e⁻ᵘ), which are 0/0 at u = 0. They equal
//! 1/e₀(-u) with e₀(x) = (eˣ - 1)/x, which is smooth and positive everywhere.
//!
//! **Equations.**
//!
//! 1. eₘ(x) = dᵐe₀/dxᵐ = ∫₀¹ sᵐ eˢˣ ds
//! 2. eₘ = (eˣ - m eₘ₋₁)/x, stable for |x| > m + 2
//! 3. eₘ = Σⱼ xʲ/(j! (j + m + 1)) for 0 ≤ x ≤ m + 2
//! 4. eₘ = eˣ Σⱼ |x|ʲ m!/(m + j + 1)! for -m - 2 ≤ x < 0
//!
//! All terms of 3 and 4 are positive, so there is no cancellation.

use super::kernels::{exp, expm1};

/// Maximum number of series terms; the tenth derivative needs 60.
const MOST_TERMS: u32 = 400;

/// (eˣ - 1)/x.
#[inline(always)]
pub(super) fn exprel(x: f64) -> f64 {
    let quotient = expm1(x) / x;
    if x == 0.0 { 1.0 } else { quotient }
}

/// Derivative of [`exprel`] of the given order.
pub(super) fn derivative(order: u8, x: f64) -> f64 {
    let m = f64::from(order);
    if order == 0 || x.is_nan() {
        exprel(x)
    } else if x.abs() > m + 2.0 {
        (1..=order).fold(exprel(x), |below, k| (exp(x) - f64::from(k) * below) / x)
    } else if x >= 0.0 {
        // term = xʲ/j!
        series(|j, term| term * x / j, |j, term| term / (j + m + 1.0))
    } else {
        // term = |x|ʲ m!/(m + j)!
        exp(x) * series(|j, term| term * -x / (m + j), |j, term| term / (m + j + 1.0))
    }
}

/// Sum over j of `part(j, term)`, each term computed by `next` from its predecessor.
fn series(next: impl Fn(f64, f64) -> f64, part: impl Fn(f64, f64) -> f64) -> f64 {
    let (mut term, mut sum) = (1.0, part(0.0, 1.0));
    for j in 1..MOST_TERMS {
        term = next(f64::from(j), term);
        let more = part(f64::from(j), term);
        sum += more;
        if more < 1e-18 * sum {
            break;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫₀¹ sᵐ eˢˣ ds by 5-point Gauss–Legendre quadrature on 400 intervals, with an error below rounding.
    fn quadrature(order: u8, x: f64) -> f64 {
        let nodes = [0.0, 0.538_469_310_105_683_1, 0.906_179_845_938_664];
        let weights = [0.568_888_888_888_888_9, 0.478_628_670_499_366_47, 0.236_926_885_056_189_08];
        let value = |s: f64| s.powi(i32::from(order)) * (s * x).exp();
        let half = 0.5 / 400.0;
        let on = |k: i32| {
            let middle = f64::from(2 * k + 1) * half;
            let pairs =
                (1..3).map(|l| weights[l] * (value(middle - half * nodes[l]) + value(middle + half * nodes[l])));
            half * (weights[0] * value(middle) + pairs.sum::<f64>())
        };
        (0..400).map(on).sum()
    }

    #[test]
    fn derivatives_agree_with_their_integrals() {
        for order in 0..=8u8 {
            for k in -240..=240 {
                let x = 0.125 * f64::from(k);
                let (own, expected) = (derivative(order, x), quadrature(order, x));
                assert!((own / expected - 1.0).abs() < 2e-13, "order {order} at {x}: {own} {expected}");
            }
            assert_eq!(derivative(order, 0.0), 1.0 / (f64::from(order) + 1.0));
        }
    }

    #[test]
    fn full_accuracy_is_kept_near_zero() {
        for x in [1e-300, 1e-17, 1e-12, 1e-9, 1e-6, 1e-4] {
            for x in [x, -x] {
                assert!((exprel(x) - (1.0 + x / 2.0 + x * x / 6.0)).abs() < 4e-16 + x.abs().powi(3), "{x}");
            }
        }
        assert!(exprel(f64::NAN).is_nan() && derivative(2, f64::NAN).is_nan());
        assert_eq!((exprel(f64::NEG_INFINITY), exprel(1e3)), (0.0, f64::INFINITY));
    }
}
