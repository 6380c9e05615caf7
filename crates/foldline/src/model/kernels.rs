//! Scalar kernels of the tape, written so that loops over lanes vectorise; also for vector fields written in Rust.
//!
//! **Idea.** `exp`, `tanh`, `sech²` and `hypot` sit in the inner loop of contact laws; the standard library evaluates
//! them one lane at a time. Here they are branch-free polynomials, so the compiler turns a loop over lanes into vector
//! instructions. No fused multiply-add is used: a lane gives the same result on every machine and in every batch.
//!
//! **Equations.** With k = round(x / ln 2) and r = x - k ln 2, |r| ≤ ln 2 / 2:
//!
//! 1. exp x = 2ᵏ (1 + e(r)), e(r) = r + r²/2! + … + r¹³/13! (truncation below 2e-17 relative)
//! 2. expm1 x = 2ᵏ e(r) + (2ᵏ - 1)
//! 3. tanh x = sign(x) m / (m + 2), m = expm1(2|x|)
//! 4. sech² x = 4 s / (1 + s)², s = exp(-2|x|): keeps full relative accuracy where 1 - tanh² x cancels
//!
//! **Source.** Argument reduction with a two-part ln 2: cody1980.

use crate::linalg::lane::{Eight, Lane};
use std::ops::RangeInclusive;

/// Adding this to |x| < 2⁵¹ rounds x to an integer, which then occupies the low bits of the sum.
const ROUNDER: f64 = 6755399441055744.0; // 1.5 · 2⁵²
/// Leading part of ln 2, with trailing zeros so that k · LN2_HIGH is exact.
const LN2_HIGH: f64 = f64::from_bits(0x3fe6_2e42_fee0_0000);
/// ln 2 - LN2_HIGH.
const LN2_LOW: f64 = f64::from_bits(0x3dea_39ef_3579_3c76);

/// 2ᵏ for an integer k in [-1022, 1023].
#[inline(always)]
fn power_of_two(k: f64) -> f64 {
    f64::from_bits((k + ROUNDER).to_bits().wrapping_add(1023) << 52)
}

/// k, r and the rounding error of r, with x = k ln 2 + r.
#[inline(always)]
fn reduce(x: f64) -> (f64, f64, f64) {
    let k = (x * std::f64::consts::LOG2_E + ROUNDER) - ROUNDER;
    let high = x - k * LN2_HIGH;
    let low = k * LN2_LOW;
    let r = high - low;
    (k, r, (high - r) - low)
}

/// e(r) - r of equation 1, for |r| ≤ ln 2 / 2. The terms are paired rather than nested: in Horner's scheme each of the
/// twelve operations would wait for the previous one.
#[inline(always)]
fn series(r: f64) -> f64 {
    let r2 = r * r;
    let r4 = r2 * r2;
    let r8 = r4 * r4;
    let two = 0.5 + r * (1.0 / 6.0);
    let four = 1.0 / 24.0 + r * (1.0 / 120.0);
    let six = 1.0 / 720.0 + r * (1.0 / 5040.0);
    let eight = 1.0 / 40320.0 + r * (1.0 / 362880.0);
    let ten = 1.0 / 3628800.0 + r * (1.0 / 39916800.0);
    let twelve = 1.0 / 479001600.0 + r * (1.0 / 6227020800.0);
    r2 * (((two + r2 * four) + r4 * (six + r2 * eight)) + r8 * (ten + r2 * twelve))
}

/// `x` limited to `[low, high]`; NaN stays NaN.
#[inline(always)]
fn limit(x: f64, low: f64, high: f64) -> f64 {
    let x = if x > high { high } else { x };
    if x < low { low } else { x }
}

/// eˣ.
#[inline(always)]
pub fn exp(x: f64) -> f64 {
    let (k, r, error) = reduce(limit(x, -746.0, 710.0));
    let p = 1.0 + (r + (series(r) + error));
    // Scaled in two steps, so that subnormal results and overflow are correct.
    let half = (k * 0.5 + ROUNDER) - ROUNDER;
    p * power_of_two(half) * power_of_two(k - half)
}

/// tanh x.
#[inline(always)]
pub fn tanh(x: f64) -> f64 {
    let (k, r, error) = reduce(limit(2.0 * x.abs(), 0.0, 44.0));
    let s = power_of_two(k);
    let m = s * (r + (series(r) + error)) + (s - 1.0);
    (m / (m + 2.0)).copysign(x)
}

/// eˣ - 1, to full relative accuracy near 0.
#[inline(always)]
pub fn expm1(x: f64) -> f64 {
    // Beyond this the 1 is lost in rounding, and 2ᵏ may overflow.
    const LARGE: f64 = 40.0;
    let (k, r, error) = reduce(limit(x, -44.0, LARGE));
    let s = power_of_two(k);
    let m = s * (r + (series(r) + error)) + (s - 1.0);
    if x > LARGE { exp(x) } else { m }
}

/// Beyond this m > 2⁵⁵, so m + 2 of equation 3 rounds to m and tanh is ±1.
const SATURATED: f64 = 19.5;

/// [`tanh`] of eight numbers; skips the computation if all of them are saturated, as in a contact law away from the
/// contact edge.
#[inline(always)]
pub fn tanhs(x: Eight) -> Eight {
    match x.all(x, |x, _| x.abs() >= SATURATED) {
        true => x.map(|x| f64::copysign(1.0, x)),
        false => x.map(tanh),
    }
}

/// 1 / cosh² x.
#[inline(always)]
pub fn sech_squared(x: f64) -> f64 {
    let s = exp(-2.0 * x.abs());
    let d = 1.0 + s;
    4.0 * s / (d * d)
}

/// sqrt(a² + b²) without intermediate overflow or underflow.
#[inline(always)]
pub fn hypot(a: f64, b: f64) -> f64 {
    const BIG: f64 = f64::from_bits((1023 + 600) << 52); // 2⁶⁰⁰
    const SMALL: f64 = f64::from_bits((1023 - 600) << 52); // 2⁻⁶⁰⁰
    let (p, q) = (a.abs(), b.abs());
    let m = if p > q { p } else { q };
    let scale = if m > 1e150 { SMALL } else { 1.0 };
    let scale = if m < 1e-140 { BIG } else { scale };
    let back = if m > 1e150 { BIG } else { 1.0 };
    let back = if m < 1e-140 { SMALL } else { back };
    let (p, q) = (p * scale, q * scale);
    (p * p + q * q).sqrt() * back
}

/// Range of a² + b² in which [`hypot`] is a plain square root.
const PLAIN: RangeInclusive<f64> = 1e-279..=1e299;

/// [`hypot`] of eight pairs, without scaling if none of them needs it.
#[inline(always)]
pub fn hypots(a: Eight, b: Eight) -> Eight {
    let squares = a * a + b * b;
    match squares.all(squares, |square, _| (square >= *PLAIN.start()) & (square <= *PLAIN.end())) {
        true => squares.map(f64::sqrt),
        false => a.zip(b, hypot),
    }
}

/// -1, 0 or 1; NaN for NaN.
#[inline(always)]
pub(super) fn sign(x: f64) -> f64 {
    let s = if x > 0.0 { 1.0 } else { x };
    if x < 0.0 { -1.0 } else { s }
}

/// 0, ½ or 1; NaN for NaN.
#[inline(always)]
pub(super) fn heaviside(x: f64) -> f64 {
    0.5 * (sign(x) + 1.0)
}

/// Minimum; NaN if either operand is NaN.
#[inline(always)]
pub(super) fn min(a: f64, b: f64) -> f64 {
    if a < b || a.is_nan() { a } else { b }
}

/// Maximum; NaN if either operand is NaN.
#[inline(always)]
pub(super) fn max(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}

/// xⁿ by repeated squaring, from the lowest bit of n upwards.
#[inline(always)]
pub(super) fn power(x: f64, n: i32) -> f64 {
    let mut bits = n.unsigned_abs();
    let mut result = 1.0;
    let mut square = x;
    while bits > 0 {
        if bits & 1 == 1 {
            result *= square;
        }
        bits >>= 1;
        if bits > 0 {
            square *= square;
        }
    }
    if n < 0 { 1.0 / result } else { result }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Error in units in the last place of `reference`.
    fn ulps(value: f64, reference: f64) -> f64 {
        let next = f64::from_bits(reference.abs().to_bits() + 1);
        (value - reference).abs() / (next - reference.abs())
    }

    /// Points that cover [-bound, bound], densely near zero.
    fn sample(bound: f64) -> impl Iterator<Item = f64> {
        (-200_000..=200_000).map(move |i| {
            let s = f64::from(i) / 200_000.0;
            bound * s * s * s
        })
    }

    /// The standard library is within one unit in the last place; ours may add one and a half.
    #[test]
    fn elementary_functions_agree_with_the_standard_library() {
        for x in sample(700.0) {
            assert!(ulps(exp(x), x.exp()) <= 2.0, "exp {x}: {} {}", exp(x), x.exp());
        }
        for x in sample(30.0) {
            assert!(ulps(tanh(x), x.tanh()) <= 3.0, "tanh {x}: {} {}", tanh(x), x.tanh());
            assert!(ulps(expm1(x), x.exp_m1()) <= 3.0, "expm1 {x}: {} {}", expm1(x), x.exp_m1());
            let reference = x.cosh().powi(-2);
            // cosh⁻² by the standard library itself carries three roundings.
            assert!(ulps(sech_squared(x), reference) <= 6.0, "sech² {x}: {} {reference}", sech_squared(x));
        }
        for x in sample(1e3) {
            for y in [0.0, 1e-3, 1.0, -7.5] {
                assert!(ulps(hypot(x, y), x.hypot(y)) <= 1.0, "hypot {x} {y}");
            }
        }
    }

    #[test]
    fn limits_and_exceptional_values() {
        assert_eq!(exp(0.0), 1.0);
        assert_eq!(exp(f64::INFINITY), f64::INFINITY);
        assert_eq!(exp(f64::NEG_INFINITY), 0.0);
        assert_eq!(exp(709.8), f64::INFINITY);
        assert!(exp(709.78).is_finite() && exp(-745.0) > 0.0 && exp(-746.0) == 0.0);
        assert_eq!(ulps(exp(-740.0), (-740.0f64).exp()), 0.0);
        assert_eq!((tanh(1e300), tanh(-1e300)), (1.0, -1.0));
        assert_eq!(tanh(-0.0).to_bits(), (-0.0f64).to_bits());
        assert_eq!(tanh(1e-320), 1e-320);
        assert_eq!((expm1(1e-320), expm1(-1e3), expm1(1e3)), (1e-320, -1.0, f64::INFINITY));
        assert_eq!(hypot(0.0, 0.0), 0.0);
        assert!((hypot(3e200, 4e200) / 5e200 - 1.0).abs() < 1e-15);
        assert!((hypot(3e-200, 4e-200) / 5e-200 - 1.0).abs() < 1e-15);
        for f in [exp, expm1, tanh, sech_squared, sign, heaviside] {
            assert!(f(f64::NAN).is_nan());
        }
        for f in [hypot, min, max] {
            assert!(f(f64::NAN, 1.0).is_nan() && f(1.0, f64::NAN).is_nan());
        }
    }

    #[test]
    fn tanh_of_eight_numbers_equals_the_scalar_results_bitwise() {
        for base in [0.0, 1.0, 19.0, 19.4, 19.5, 19.6, 22.0, 300.0, f64::INFINITY] {
            let x: [f64; 8] = std::array::from_fn(|l| (base + 0.01 * l as f64) * if l % 3 == 0 { -1.0 } else { 1.0 });
            assert_eq!(tanhs(Eight(x)).0.map(f64::to_bits), x.map(|x| tanh(x).to_bits()), "{base}");
        }
        let mut x = [30.0; 8];
        x[5] = f64::NAN;
        assert!(tanhs(Eight(x)).0[5].is_nan() && tanhs(Eight(x)).0[4] == 1.0);
    }

    #[test]
    fn hypot_of_eight_pairs_equals_the_scalar_results() {
        for scale in [1e-300, 2e-140, 1e-139, 1.0, 1e149, 1e200] {
            let (a, b) = ([0.3, -1.0, 0.0, 2.0, 1.0, 1e-9, 3.0, 5.5].map(|a| a * scale), [0.7; 8].map(|b| b * scale));
            assert_eq!(hypots(Eight(a), Eight(b)).0, std::array::from_fn(|l| hypot(a[l], b[l])), "{scale}");
        }
        let odd = [0.0, f64::INFINITY, 1.0, f64::NAN, 1e-200, 1e200, -0.0, 1.0];
        let lengths = hypots(Eight(odd), Eight([0.0; 8])).0;
        assert!((0..8).all(|l| lengths[l].to_bits() == hypot(odd[l], 0.0).to_bits() || lengths[l].is_nan() && odd[l].is_nan()));
    }

    #[test]
    fn integer_powers_are_products() {
        let x = 1.1;
        assert_eq!(power(x, 2), x * x);
        assert_eq!(power(x, 3), x * (x * x));
        assert_eq!(power(x, -2), 1.0 / (x * x));
        assert_eq!(power(3.0, 20), 3486784401.0);
        assert_eq!(power(0.0, i32::MIN), f64::INFINITY);
    }
}
