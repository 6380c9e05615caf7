//! Directional derivatives of any order by arithmetic on numbers with nilpotent parts.
//!
//! **Idea.** Numbers with parts ε₁, …, ε_k, εᵢ² = 0, have one coefficient for each set of directions; evaluated at
//! x + Σ εᵢ dᵢ, the coefficient of ε₁⋯ε_k of f is Dᵏf[d₁, …, d_k] exactly.
//!
//! **Equations.** Sets are bit masks:
//!
//! 1. (a b)_S = Σ_{T ⊆ S} a_T b_{S∖T}
//! 2. φ(a) = Σⱼ φ⁽ʲ⁾(a_∅)/j! nʲ with n = a - a_∅, where nᵏ⁺¹ = 0

use std::ops::{Add, Mul, Sub};

/// A number with 2ᵏ coefficients.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Jet(Vec<f64>);

impl Jet {
    /// `value` + Σ εᵢ `slopes`ᵢ.
    pub fn new(value: f64, slopes: impl ExactSizeIterator<Item = f64>) -> Jet {
        let mut c = vec![0.0; 1 << slopes.len()];
        c[0] = value;
        slopes.enumerate().for_each(|(i, slope)| c[1 << i] = slope);
        Jet(c)
    }

    /// The part without ε.
    pub fn value(&self) -> f64 {
        self.0[0]
    }

    /// The coefficient of ε₁⋯ε_k.
    pub fn highest(&self) -> f64 {
        self.0[self.0.len() - 1]
    }

    pub fn plus(&self, number: f64) -> Jet {
        let mut sum = self.clone();
        sum.0[0] += number;
        sum
    }

    pub fn times(&self, number: f64) -> Jet {
        Jet(self.0.iter().map(|c| c * number).collect())
    }

    /// φ of this number, given φ⁽ʲ⁾/j! at its value for j = 0, …, k.
    fn compose(&self, taylor: &[f64]) -> Jet {
        let mut rest = self.clone();
        rest.0[0] = 0.0;
        let mut sum = self.times(0.0);
        for &t in taylor.iter().rev() {
            sum = (&sum * &rest).plus(t);
        }
        sum
    }

    /// k.
    fn order(&self) -> usize {
        self.0.len().trailing_zeros() as usize
    }

    pub fn reciprocal(&self) -> Jet {
        let x = self.value();
        let taylor: Vec<f64> = (0..=self.order()).map(|j| (-1.0f64).powi(j as i32) * x.powi(-1 - j as i32)).collect();
        self.compose(&taylor)
    }

    pub fn sqrt(&self) -> Jet {
        // From s² = x, order by order.
        let mut s = vec![self.value().sqrt()];
        for j in 1..=self.order() {
            let known: f64 = (1..j).map(|i| s[i] * s[j - i]).sum();
            s.push((if j == 1 { 1.0 } else { 0.0 } - known) / (2.0 * s[0]));
        }
        self.compose(&s)
    }

    pub fn tanh(&self) -> Jet {
        self.compose(&logistic_like(self.value().tanh(), self.order(), |t, j| {
            let square: f64 = (0..=j).map(|i| t[i] * t[j - i]).sum();
            if j == 0 { (1.0 - t[0]) * (1.0 + t[0]) } else { -square }
        }))
    }

    /// ln(1 + eˣ).
    pub fn softplus(&self) -> Jet {
        let x = self.value();
        let slope = logistic_like(1.0 / (1.0 + (-x).exp()), self.order(), |t, j| {
            let square: f64 = (0..=j).map(|i| t[i] * t[j - i]).sum();
            t[j] - square
        });
        let mut taylor = vec![x.max(0.0) + (-x.abs()).exp().ln_1p()];
        taylor.extend((0..self.order()).map(|j| slope[j] / (j + 1) as f64));
        self.compose(&taylor)
    }
}

/// Taylor coefficients of y with y′ = R(y), where `right(t, j)` is the coefficient of order j of R.
fn logistic_like(start: f64, order: usize, right: impl Fn(&[f64], usize) -> f64) -> Vec<f64> {
    let mut t = vec![start];
    for j in 0..order {
        t.push(right(&t, j) / (j + 1) as f64);
    }
    t
}

impl Mul for &Jet {
    type Output = Jet;

    fn mul(self, other: &Jet) -> Jet {
        let product = |s: usize| {
            // All subsets of s, from s itself down to the empty set.
            let mut sum = self.0[0] * other.0[s];
            let mut t = s;
            while t > 0 {
                sum += self.0[t] * other.0[s & !t];
                t = (t - 1) & s;
            }
            sum
        };
        Jet((0..self.0.len()).map(product).collect())
    }
}

impl Mul for Jet {
    type Output = Jet;

    fn mul(self, other: Jet) -> Jet {
        &self * &other
    }
}

impl Add for Jet {
    type Output = Jet;

    fn add(self, other: Jet) -> Jet {
        Jet(self.0.iter().zip(&other.0).map(|(a, b)| a + b).collect())
    }
}

impl Sub for Jet {
    type Output = Jet;

    fn sub(self, other: Jet) -> Jet {
        Jet(self.0.iter().zip(&other.0).map(|(a, b)| a - b).collect())
    }
}
