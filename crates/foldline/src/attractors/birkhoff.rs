//! Frequencies and closed curves from samples of a quasi-periodic motion.
//!
//! **Idea.** Averages along a quasi-periodic motion converge slowly with equal weights, but faster than any power of the
//! number of samples with smooth weights that vanish at both ends. They give the strongest spectral line, whose frequency
//! is the rotation number, and with it the Fourier coefficients of the closed curve on which the samples lie.
//!
//! **Equations.** For samples x_j, j = 0 … N-1, each component scaled by its extent:
//!
//! ```text
//!   (1)  w_j = c exp(-1 / (t_j (1 - t_j))),   t_j = (j + 1) / (N + 1),   Σ w_j = 1
//!   (2)  P(f) = Σ_i |Σ_j w_j x_ij exp(-2πi f j)|²,   line: P'(f) = 0 at a maximum
//!   (3)  X_k = Σ_j w_j x_j exp(-2πi k f j),   x_j ≈ Σ_k X_k exp(2πi k f j),   |k| ≤ H
//! ```
//!
//! **Source.** das2017 (weights, convergence); laskar1999 (frequencies).
//!
//! **Fails when** two lines are closer than a few 1/N.

use foldline_general::fourier;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Samples `[count][n]`, scaled.
#[derive(Clone, Copy)]
pub(super) struct Samples<'a> {
    pub(super) values: &'a [f64],
    pub(super) n: usize,
}

/// A closed curve through samples, as a trigonometric polynomial of the phase.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    /// f of (3), turns per sample.
    pub(super) turn: f64,
    /// `[H + 1][n]` X_k of (3) for k ≥ 0.
    pub(super) coefficients: Vec<Complex64>,
    /// Largest distance of a sample from the curve.
    pub(super) residual: f64,
    /// Change of f that reduces the distances most, in least squares.
    correction: f64,
}

/// The weights (1).
pub(super) fn weights(count: usize) -> Vec<f64> {
    let bump = |j: usize| {
        let t = (j + 1) as f64 / (count + 1) as f64;
        (-1.0 / (t * (1.0 - t))).exp()
    };
    let all: Vec<f64> = (0..count).map(bump).collect();
    let sum: f64 = all.iter().sum();
    all.into_iter().map(|w| w / sum).collect()
}

/// Weighted average of a sequence.
pub(crate) fn average(values: &[f64]) -> f64 {
    weights(values.len()).iter().zip(values).map(|(w, v)| w * v).sum()
}

impl<'a> Samples<'a> {
    pub(super) fn count(&self) -> usize {
        self.values.len() / self.n.max(1)
    }

    /// Both halves.
    pub(super) fn halves(&self) -> [Samples<'a>; 2] {
        let (first, second) = self.values.split_at(self.count() / 2 * self.n);
        [Samples { values: first, ..*self }, Samples { values: second, ..*self }]
    }

    /// Weighted samples without their mean, `[n][count]`.
    fn weighted(&self) -> Vec<Vec<f64>> {
        let weights = weights(self.count());
        let component = |i: usize| -> Vec<f64> {
            let own = || self.values.iter().skip(i).step_by(self.n);
            let mean: f64 = own().zip(&weights).map(|(x, w)| x * w).sum();
            own().zip(&weights).map(|(x, w)| w * (x - mean)).collect()
        };
        (0..self.n).map(component).collect()
    }

    /// Frequencies of the strongest lines between 0 and 1/2, at most `most`, the strongest first.
    pub(super) fn lines(&self, most: usize) -> Vec<f64> {
        /// Widths of the main lobe of the weights, on both sides of zero, within which a line cannot be distinguished
        /// from the mean.
        const LOBE: usize = 5;
        let (count, parts) = (self.count(), self.weighted());
        let mut power = vec![0.0; count];
        for part in &parts {
            let mut own: Vec<Complex64> = part.iter().map(|x| Complex64::new(*x, 0.0)).collect();
            fourier(&mut own);
            power.iter_mut().zip(&own).for_each(|(p, z)| *p += z.norm_sqr());
        }
        let peak = |k: &usize| power[*k] >= power[k - 1] && power[*k] > power[k + 1];
        let mut peaks: Vec<usize> = (LOBE..(count / 2).saturating_sub(1)).filter(peak).collect();
        peaks.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
        peaks.truncate(most);
        peaks.into_iter().map(|k| refined(&parts, k as f64 / count as f64)).collect()
    }

    /// The line next to the frequency `f`.
    pub(super) fn line_near(&self, f: f64) -> f64 {
        refined(&self.weighted(), f)
    }

    /// The curve (3) with at most `most` harmonics of a line, fewer if the samples lie on it to `enough`.
    pub(super) fn curve(&self, turn: f64, most: usize, enough: f64) -> Curve {
        /// Sweeps over the harmonics: each removes from one what its neighbours had left in it.
        const SWEEPS: usize = 6;
        let (n, weights) = (self.n, weights(self.count()));
        let mut rest = self.values.to_vec();
        let mut coefficients: Vec<Complex64> = Vec::new();
        let (mut residual, mut count) = (f64::INFINITY, most + 1);
        for sweep in 0..SWEEPS {
            let before = residual;
            for k in 0..count {
                let waves: Vec<Complex64> =
                    (0..self.count()).map(|j| Complex64::cis(TAU * (k as f64 * turn * j as f64).fract())).collect();
                let mut own = vec![Complex64::default(); n];
                for ((x, wave), w) in rest.chunks_exact(n).zip(&waves).zip(&weights) {
                    own.iter_mut().zip(x).for_each(|(sum, x)| *sum += w * x * wave.conj());
                }
                let twice = if k == 0 { 1.0 } else { 2.0 };
                residual = 0.0;
                for (x, wave) in rest.chunks_exact_mut(n).zip(&waves) {
                    for (x, c) in x.iter_mut().zip(&own) {
                        *x -= twice * (c * wave).re;
                        residual = x.abs().max(residual);
                    }
                }
                match sweep {
                    0 => coefficients.extend(own),
                    _ => coefficients[k * n..(k + 1) * n].iter_mut().zip(own).for_each(|(sum, c)| *sum += c),
                }
                if residual <= enough {
                    break;
                }
            }
            count = coefficients.len() / n.max(1);
            if residual <= enough || residual > 0.5 * before {
                break;
            }
        }
        let correction = self.correction(&rest, &weights, turn, &coefficients);
        Curve { turn, coefficients, residual, correction }
    }

    /// Change of f that reduces the remainders most: their projection on the change of the curve with f, which grows with the
    /// distance from the middle of the record.
    fn correction(&self, rest: &[f64], weights: &[f64], turn: f64, coefficients: &[Complex64]) -> f64 {
        let (n, middle) = (self.n, (self.count() as f64 - 1.0) / 2.0);
        let mut sums = [0.0; 2];
        let curve = Curve { turn, coefficients: coefficients.to_vec(), residual: 0.0, correction: 0.0 };
        for (j, (x, w)) in rest.chunks_exact(n).zip(weights).enumerate() {
            let place = j as f64 - middle;
            let slope = curve.slope(n, (turn * j as f64).fract());
            for (x, slope) in x.iter().zip(slope) {
                sums[0] += w * place * slope * x;
                sums[1] += w * place * place * slope * slope;
            }
        }
        if sums[1] > 0.0 { sums[0] / sums[1] } else { 0.0 }
    }

    /// A curve with its frequency corrected by least squares.
    pub(super) fn sharpened(&self, curve: &Curve, enough: f64) -> Curve {
        const ROUNDS: usize = 3;
        let most = curve.coefficients.len() / self.n - 1;
        let mut best = self.curve(curve.turn, most, enough);
        for _ in 0..ROUNDS {
            let next = self.curve(best.turn + best.correction, most, enough);
            if next.residual >= best.residual {
                break;
            }
            best = next;
        }
        best
    }
}

impl Curve {
    /// Derivative `[n]` with respect to the phase in turns.
    fn slope(&self, n: usize, phase: f64) -> Vec<f64> {
        let mut x = vec![0.0; n];
        for (k, own) in self.coefficients.chunks_exact(n).enumerate().skip(1) {
            let wave = Complex64::cis(TAU * (k as f64 * phase).fract()) * Complex64::new(0.0, 2.0 * TAU * k as f64);
            x.iter_mut().zip(own).for_each(|(x, c)| *x += (c * wave).re);
        }
        x
    }

    /// Point `[n]` at a phase in turns.
    pub(super) fn point(&self, n: usize, phase: f64) -> Vec<f64> {
        let mut x = vec![0.0; n];
        for (k, own) in self.coefficients.chunks_exact(n).enumerate() {
            let wave = Complex64::cis(TAU * (k as f64 * phase).fract()) * if k == 0 { 1.0 } else { 2.0 };
            x.iter_mut().zip(own).for_each(|(x, c)| *x += (c * wave).re);
        }
        x
    }

    /// Amplitude of the first harmonic.
    pub(super) fn amplitude(&self, n: usize) -> f64 {
        self.coefficients.iter().skip(n).take(n).map(|c| c.norm_sqr()).sum::<f64>().sqrt()
    }
}

/// The zero of P' next to `f`, found between the neighbouring multiples of 1/N.
fn refined(parts: &[Vec<f64>], f: f64) -> f64 {
    let count = parts.first().map_or(1, Vec::len);
    let middle = count as f64 / 2.0;
    let slope = |f: f64| -> f64 {
        let (mut sums, mut rates) = (vec![Complex64::default(); parts.len()], vec![Complex64::default(); parts.len()]);
        for j in 0..count {
            let place = j as f64 - middle;
            let wave = Complex64::cis(-TAU * (f * place).fract());
            for ((part, sum), rate) in parts.iter().zip(&mut sums).zip(&mut rates) {
                let own = part[j] * wave;
                *sum += own;
                *rate += own * place;
            }
        }
        // P' up to a factor: d/df of exp(-2πi f j) is -2πi j times it.
        sums.iter().zip(&rates).map(|(s, r)| (s.conj() * r * Complex64::new(0.0, -1.0)).re).sum()
    };
    let width = 1.0 / count as f64;
    let (mut a, mut b) = (f - width, f + width);
    let (mut at_a, mut at_b) = (slope(a), slope(b));
    if at_a <= 0.0 || at_b >= 0.0 {
        return f;
    }
    // Regula falsi with the Illinois modification.
    let mut side = 0;
    for _ in 0..60 {
        let c = (a * at_b - b * at_a) / (at_b - at_a);
        let at_c = slope(c);
        if at_c == 0.0 || (b - a) < 1e-15 {
            return c;
        }
        if at_c > 0.0 {
            (a, at_a) = (c, at_c);
            at_b *= if side == 1 { 0.5 } else { 1.0 };
            side = 1;
        } else {
            (b, at_b) = (c, at_c);
            at_a *= if side == -1 { 0.5 } else { 1.0 };
            side = -1;
        }
        if (at_c / (at_b - at_a)).abs() * (b - a) < 1e-16 {
            return c;
        }
    }
    0.5 * (a + b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_and_its_curve_are_found_to_rounding() {
        let turn = (5f64.sqrt() - 1.0) / 2.0 - 0.3;
        let at = |phase: f64| {
            let a = TAU * phase;
            [0.7 + a.cos() + 0.2 * (3.0 * a).sin(), 0.5 * (a.sin() + 0.1 * (2.0 * a).cos())]
        };
        let values: Vec<f64> = (0..1000).flat_map(|j| at(0.13 + turn * f64::from(j))).collect();
        let samples = Samples { values: &values, n: 2 };
        let found = samples.lines(1)[0];
        assert!((found - turn).abs() < 1e-12, "{found} {turn}");
        let curve = samples.curve(found, 10, 0.0);
        assert!(curve.residual < 1e-9, "{}", curve.residual);
        let (x, exact) = (curve.point(2, 0.4), at(0.53));
        assert!((x[0] - exact[0]).abs() < 1e-9 && (x[1] - exact[1]).abs() < 1e-9);
        let halves = samples.halves().map(|half| half.line_near(found));
        assert!((halves[0] - halves[1]).abs() < 1e-10);
    }
}
