//! Normal forms of imaginary pairs: Hopf, generalised Hopf and double Hopf points.

use super::ROUNDING;
use super::local::Local;
use super::manifold::{Manifold, Sized};
use super::without_rounding;

fn real(g: Sized) -> f64 {
    without_rounding(&[g.value.re], &[g.size], ROUNDING)
}

impl Local<'_> {
    /// l₁ of (4) for the frequency ω.
    pub fn hopf(&self, omega: f64) -> Option<f64> {
        Some(real(Manifold::new(self, false, &[omega])?.motion(0, &[0, 0, 1])?) / (2.0 * omega))
    }

    /// l₂ of (5) for the frequency ω.
    pub fn generalised_hopf(&self, omega: f64) -> Option<f64> {
        Some(Manifold::new(self, false, &[omega])?.motion(0, &[0, 0, 0, 1, 1])?.value.re / (12.0 * omega))
    }

    /// p₁₁, p₁₂, p₂₁, p₂₂, θ and δ of (8) for the frequencies ω₁ > ω₂.
    pub fn double_hopf(&self, frequencies: [f64; 2]) -> Option<[f64; 6]> {
        let mut manifold = Manifold::new(self, false, &frequencies)?;
        let mut p = |i: usize, m: &[usize]| manifold.motion(i, m).map(real);
        let (p11, p12) = (0.5 * p(0, &[0, 0, 1])?, p(0, &[0, 2, 3])?);
        let (p21, p22) = (p(2, &[0, 1, 2])?, 0.5 * p(2, &[2, 2, 3])?);
        Some([p11, p12, p21, p22, p12 / p22, p21 / p11])
    }
}
