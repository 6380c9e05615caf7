//! Multipliers of cycles with many components.
//!
//! **Idea.** The periodic QR algorithm passes every rotation through all N factors, so its cost grows as N n³ with a
//! large constant, as does that of keeping the factors separate. If neither the products of the first factors nor those
//! of the remaining ones grow, the product of all transitions may be formed: its eigenvalues of modulus near 1 lose no
//! accuracy. Random vectors, propagated through the factors from both ends, show this beforehand at the cost of a few
//! matrix-vector products.
//!
//! **Equations.** With F_j as in (1) of [`super::floquet`], P_j = F_j ⋯ F_1, S_j = F_N ⋯ F_{j+1}, |·| the root mean
//! square of the singular values, ε the unit roundoff, and a_j a bound of the norm of F_j with the moduli of its
//! entries:
//!
//! ```text
//!   (1)  δP_N ≈ Σ_j S_j δ_j,   |δ_j| ≈ ε a_j |P_{j-1}|           rounding of P_j = F_j P_{j-1}
//!   (2)  growth = √(Σ_j (|S_j| a_j |P_{j-1}|)²)                   rounding errors are independent of each other
//!   (3)  a_j = √(‖F_j‖_1 ‖F_j‖_∞)
//!   (4)  |A|² ≈ mean over random w of |A w|² / n                  Frobenius norm by random vectors
//! ```
//!
//! The error ε · growth is absolute: of a smaller multiplier it is only known that it is small. If the growth is too
//! large the factors stay separate, except for neighbours whose product is well conditioned, and the periodic QR
//! algorithm preserves the accuracy of all multipliers.
//!
//! **Source.** higham2002, §3.5 (products) and §2.8 (independent rounding errors); hutchinson1990 (4).

use super::floquet::{Course, Floquet};
use crate::linalg::dense::{VECTORS, random};
use crate::linalg::periodic_schur::{self, CONDITION};
use foldline_general::{Factored, Mat, MatRef, multiply};
use num_complex::Complex64;

/// Rounding error up to which the product is formed: a tenth of the error stated for rounding.
const ERROR: f64 = 0.1 * super::floquet::ROUNDING;

/// Multipliers of one course; `scale` `[n]` as in [`super::floquet::several`]. The logarithm of their product is NaN
/// unless `product` is set.
pub(super) fn multipliers(course: Course, scale: &[f64], product: bool) -> Floquet {
    let split = Split::new(course, scale);
    let log_product = if product { split.log + split.log_determinant() } else { f64::NAN };
    let mut multipliers = Vec::with_capacity(scale.len());
    if course.frames.is_some() {
        multipliers.push(Complex64::new(split.sign * split.log.exp(), 0.0));
    }
    let others = split.eigenvalues();
    let unstable = others.iter().flatten().filter(|z| z.norm() > 1.0).count();
    multipliers.extend(others.unwrap_or_else(|| vec![Complex64::new(f64::NAN, f64::NAN); split.p]));
    Floquet { multipliers, unstable, log_product }
}

/// Transitions with the flow direction split off.
struct Split {
    p: usize,
    /// `[N]` F_j, row-major p×p.
    factors: Vec<f64>,
    /// Trivial multiplier: its sign and the logarithm of its modulus; 1 and 0 without frames.
    sign: f64,
    log: f64,
}

impl Split {
    fn new(course: Course, scale: &[f64]) -> Split {
        let n = scale.len();
        let (square, trivial) = (n * n, usize::from(course.frames.is_some()));
        let count = course.transitions[0].len() / square;
        let p = n - trivial;
        let mut split = Split { p, factors: Vec::with_capacity(count * p * p), sign: 1.0, log: 0.0 };
        let (mut g, mut sums) = (vec![0.0; square], vec![0.0; n]);
        let units: Vec<f64> = scale.iter().flat_map(|row| scale.iter().map(move |column| column / row)).collect();
        for j in 0..count {
            let from = &course.transitions[j % 2][j * square..(j + 1) * square];
            g.iter_mut().zip(from.iter().zip(&units)).for_each(|(x, (g, unit))| *x = g * unit);
            if let Some(frames) = course.frames {
                reflect(&mut g, frames.reflection(j, n), frames.reflection((j + 1) % count, n), &mut sums);
                (split.sign, split.log) = (split.sign * g[0].signum(), split.log + g[0].abs().ln());
            }
            split.factors.extend(g.chunks_exact(n).skip(trivial).flat_map(|row| &row[trivial..]));
        }
        split
    }

    /// F_1, F_2, …
    fn factors(&self) -> impl DoubleEndedIterator<Item = MatRef<'_, f64>> {
        self.factors.chunks_exact(self.p * self.p).map(|f| MatRef::from_row_major_slice(f, self.p, self.p))
    }

    /// log |det (F_N ⋯ F_1)|.
    fn log_determinant(&self) -> f64 {
        self.factors().map(|f| Factored::new(f).log_determinant()).sum()
    }

    /// Eigenvalues of F_N ⋯ F_1 by decreasing modulus, if they can be computed.
    fn eigenvalues(&self) -> Option<Vec<Complex64>> {
        if !crate::linalg::all_finite(&self.factors) {
            return None;
        }
        let product = (f64::EPSILON * self.growth() < ERROR).then(|| self.product());
        product.and_then(|product| eigenvalues(product.as_ref())).or_else(|| {
            let found = periodic_schur::eigenvalues(&self.grouped(), self.p)?;
            Some(found.into_iter().map(|e| e.value()).collect())
        })
    }

    /// (2), from estimates of all norms.
    fn growth(&self) -> f64 {
        let p = self.p;
        let mut after: Vec<f64> = Vec::new();
        let (mut w, mut next) = (random(p), Mat::zeros(p, VECTORS));
        for f in self.factors().rev() {
            after.push(size(&w));
            multiply(next.as_mut(), f.transpose(), w.as_ref());
            std::mem::swap(&mut w, &mut next);
        }
        w = random(p);
        let mut sum = 0.0;
        for ((f, own), after) in self.factors().zip(self.factors.chunks_exact(p * p)).zip(after.iter().rev()) {
            let lost = after * moduli(own, p) * size(&w);
            sum += lost * lost;
            multiply(next.as_mut(), f, w.as_ref());
            std::mem::swap(&mut w, &mut next);
        }
        sum.sqrt()
    }

    /// F_N ⋯ F_1.
    fn product(&self) -> Mat<f64> {
        let p = self.p;
        let (mut product, mut next) = (Mat::identity(p, p), Mat::zeros(p, p));
        for f in self.factors() {
            multiply(next.as_mut(), f, product.as_ref());
            std::mem::swap(&mut product, &mut next);
        }
        product
    }

    /// Products of neighbours, row-major, formed while |A| |A⁻¹| stays below [`CONDITION`].
    fn grouped(&self) -> Vec<f64> {
        let p = self.p;
        let (mut out, mut product, mut next) = (Vec::new(), Mat::identity(p, p), Mat::zeros(p, p));
        let start = random(p);
        let (mut image, mut inverse) = (start.clone(), start.clone());
        for (j, f) in self.factors().enumerate() {
            let lu = Factored::new(f);
            let carried = |image: &Mat<f64>, inverse: &Mat<f64>| {
                let mut to = Mat::zeros(p, VECTORS);
                multiply(to.as_mut(), f, image.as_ref());
                (to, lu.solve_transpose(inverse))
            };
            let condition = |(image, inverse): &(Mat<f64>, Mat<f64>)| size(image) * size(inverse);
            let mut own = carried(&image, &inverse);
            // NaN does not count as small.
            let small = condition(&own) < CONDITION;
            if j > 0 && !small {
                out.extend(rows(product.as_ref()));
                product = Mat::identity(p, p);
                own = carried(&start, &start);
            }
            (image, inverse) = own;
            multiply(next.as_mut(), f, product.as_ref());
            std::mem::swap(&mut product, &mut next);
        }
        out.extend(rows(product.as_ref()));
        out
    }
}

/// Row-major entries.
fn rows(a: MatRef<f64>) -> impl Iterator<Item = f64> {
    let (rows, columns) = (a.nrows(), a.ncols());
    (0..rows * columns).map(move |k| a[(k / columns, k % columns)])
}

/// (3) of row-major p×p.
fn moduli(f: &[f64], p: usize) -> f64 {
    let (mut columns, mut row_sum) = (vec![0.0; p], 0.0f64);
    for row in f.chunks_exact(p) {
        columns.iter_mut().zip(row).for_each(|(sum, x)| *sum += x.abs());
        row_sum = row_sum.max(row.iter().map(|x| x.abs()).sum());
    }
    (row_sum * columns.iter().fold(0.0, |most: f64, sum| most.max(*sum))).sqrt()
}

/// (4): root mean square of the entries of A w, for w of [`random`] vectors.
fn size(image: &Mat<f64>) -> f64 {
    foldline_general::norm(image) / ((image.nrows() * image.ncols()) as f64).sqrt()
}

/// Eigenvalues of one matrix by decreasing modulus, conjugate pairs together.
fn eigenvalues(a: MatRef<f64>) -> Option<Vec<Complex64>> {
    let mut found = foldline_general::eigenvalues(a)?;
    found.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    Some(found)
}

/// Q_{j+1}ᵀ g Q_j with reflections 1 - v vᵀ; `sums` is workspace for n numbers.
fn reflect(g: &mut [f64], left: &[f64], right: &[f64], sums: &mut [f64]) {
    let n = left.len();
    sums.fill(0.0);
    for (row, v) in g.chunks_exact_mut(n).zip(right) {
        let along = crate::linalg::dot(row, left);
        crate::linalg::axpy(-along, left, row);
        crate::linalg::axpy(*v, row, sums);
    }
    for (row, v) in g.chunks_exact_mut(n).zip(right) {
        crate::linalg::axpy(-v, sums, row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudo-random numbers between -1 and 1.
    fn numbers(count: usize, seed: f64) -> Vec<f64> {
        (0..count)
            .map(|k| 2.0 * ((k * k) as f64 * 0.618 + seed * (1.0 + 0.37 * k as f64)).sin().abs().fract() - 1.0)
            .collect()
    }

    /// Orthogonal p×p matrix.
    fn orthogonal(p: usize, seed: f64) -> Mat<f64> {
        let entries = numbers(p * p, seed);
        Mat::from_fn(p, p, |i, k| entries[i * p + k]).qr().compute_Q()
    }

    /// V_{j+1} B_j V_j⁻¹ with orthogonal V_{j+N} = V_j: the multipliers are those of B_N ⋯ B_1, which consists of
    /// blocks with a rate and an angle each, e^(r ± i φ) over the whole course.
    fn course(p: usize, count: usize, logs: &[(f64, f64)]) -> Vec<f64> {
        let frames: Vec<Mat<f64>> = (0..count).map(|j| orthogonal(p, 0.3 + j as f64)).collect();
        let mut own = Mat::zeros(p, p);
        for (k, (rate, angle)) in logs.iter().enumerate() {
            let (size, (sin, cos)) = ((rate / count as f64).exp(), (angle / count as f64).sin_cos());
            let at = 2 * k;
            (own[(at, at)], own[(at, at + 1)]) = (size * cos, -size * sin);
            (own[(at + 1, at)], own[(at + 1, at + 1)]) = (size * sin, size * cos);
        }
        (0..count)
            .flat_map(|j| {
                let f = &frames[(j + 1) % count] * &own * frames[j].transpose();
                rows(f.as_ref()).collect::<Vec<_>>()
            })
            .collect()
    }

    /// Largest distance of an expected multiplier from the nearest computed one, relative to the larger of 1 and its
    /// modulus.
    fn farthest(found: &[Complex64], logs: &[(f64, f64)]) -> f64 {
        let expected = logs.iter().flat_map(|(r, a)| [*a, -a].map(|a| Complex64::from_polar(r.exp(), a)));
        let distance =
            |z: Complex64| found.iter().map(|w| (w - z).norm()).fold(f64::INFINITY, f64::min) / z.norm().max(1.0);
        expected.map(distance).fold(0.0, f64::max)
    }

    fn split(factors: Vec<f64>, p: usize) -> Split {
        Split { p, factors, sign: 1.0, log: 0.0 }
    }

    #[test]
    fn known_multipliers_are_found_beside_much_larger_or_smaller_ones() {
        let (p, count) = (24, 60);
        // Lightly damped; strongly damped, by hundreds of orders of magnitude; with one pair that grows by ten orders, and
        // by sixty.
        let light: Vec<_> = (0..12).map(|k| (-0.05 - 0.01 * k as f64, 0.2 + 0.23 * k as f64)).collect();
        let strong: Vec<_> = (0..12).map(|k| (-(k as f64).powi(3), 0.2 + 0.23 * k as f64)).collect();
        let with = |first: f64, rest: &[(f64, f64)]| [&[(first, 0.7)], &rest[..11]].concat();
        for (logs, explicit) in [
            (light.clone(), true),
            (strong.clone(), true),
            (with(23.0, &light), false),
            (with(138.0, &light), false),
            (with(23.0, &strong), false),
        ] {
            let split = split(course(p, count, &logs), p);
            let growth = split.growth();
            assert_eq!(f64::EPSILON * growth < ERROR, explicit, "{growth:e}");
            let found = split.eigenvalues().unwrap();
            assert_eq!(found.len(), p);
            assert!(found.windows(2).all(|pair| pair[0].norm() >= pair[1].norm() * (1.0 - 1e-12)));
            // Normal in rotating frames: rounding of the factors affects each multiplier only once.
            let tolerance = if explicit { 10.0 * f64::EPSILON * growth } else { 1e-11 };
            let error = farthest(&found, &logs);
            assert!(error < tolerance, "{error:e} with growth {growth:e}, {logs:?}");
            let exact: f64 = logs.iter().map(|(r, _)| 2.0 * r).sum();
            // Each factor is rounded to the digits of its largest entries.
            let rates = || logs.iter().map(|(r, _)| r / count as f64);
            let condition = (rates().fold(f64::MIN, f64::max) - rates().fold(f64::MAX, f64::min)).exp();
            let rounding = (p * count) as f64 * f64::EPSILON * (condition + exact.abs());
            assert!((split.log_determinant() - exact).abs() < rounding);
        }
    }

    #[test]
    fn explicit_products_and_periodic_qr_give_the_same_multipliers() {
        for (p, count, size) in [(16, 9, 0.1), (23, 30, 0.05), (40, 12, 0.08)] {
            let off = numbers(p * p * count, 0.45);
            let factors: Vec<f64> =
                (0..p * p * count).map(|k| size * off[k] + f64::from(k % (p * p) % (p + 1) == 0) * 0.97).collect();
            let split = split(factors.clone(), p);
            let growth = split.growth();
            let own = split.eigenvalues().unwrap();
            let other = periodic_schur::eigenvalues(&factors, p).unwrap();
            for z in other.iter().map(|e| e.value()) {
                let apart = own.iter().map(|w| (w - z).norm()).fold(f64::INFINITY, f64::min);
                // Eigenvalues of a random matrix are about p times as sensitive as those of a normal one.
                assert!(apart < p as f64 * f64::EPSILON * growth, "{p}: {z} is {apart:e} away, growth {growth:e}");
            }
            // If the product must not be formed, only neighbours are multiplied.
            let grouped = split.grouped();
            assert!(grouped.len() < factors.len() && grouped.len().is_multiple_of(p * p));
        }
    }

    #[test]
    fn growth_is_detected_wherever_it_occurs() {
        let (p, count) = (18, 40);
        let scaled = |factor: &dyn Fn(usize) -> f64| -> Vec<f64> {
            let identity = course(p, count, &[(0.0, 0.3); 9]);
            identity.chunks_exact(p * p).enumerate().flat_map(|(j, f)| f.iter().map(move |x| x * factor(j))).collect()
        };
        let growth = |factor: &dyn Fn(usize) -> f64| split(scaled(factor), p).growth();
        // √N times the moduli of an orthogonal matrix, which are at most √p times its norm.
        let still = growth(&|_| 1.0);
        assert!(still < (count as f64 * p as f64).sqrt(), "{still}");
        assert!(growth(&|_| 0.5) < 1e-6 * still, "decay");
        // Down and up again: small products lose digits only relative to a larger one.
        assert!(growth(&|j| if j < 20 { 2.0 } else { 0.5 }) < 2.0 * still, "up and down");
        assert!(growth(&|_| 2.0) > 1e11, "growth");
        let allowed = f64::EPSILON * growth(&|j| if j == 7 { f64::NAN } else { 1.0 }) < ERROR;
        assert!(!allowed);
    }
}
