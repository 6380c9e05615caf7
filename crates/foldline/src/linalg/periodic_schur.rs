//! Eigenvalues of a product of matrices without forming the product.
//!
//! **Idea.** The complex periodic QR algorithm works on the factors: one is kept upper Hessenberg, the others upper
//! triangular, and every rotation is passed round the cycle of factors. Each eigenvalue results as a product of
//! diagonal entries, so it has a small *relative* error even if others are larger or smaller by many orders of
//! magnitude. With one factor this is the ordinary QR algorithm, which is used for the eigenvalues of equilibria.
//!
//! **Equations.**
//!
//! ```text
//!   (1)  P = F_K ⋯ F_2 F_1,          F_1 = Q_1 R_1,   F_k Q_{k-1} = Q_k R_k,   H = F_K Q_{K-1}
//!   (2)  P = H R_{K-1} ⋯ R_1,        H upper Hessenberg, R_k upper triangular after the initial reduction
//!   (3)  μ_i = H_ii ∏_k (R_k)_ii     when the subdiagonal of H has vanished
//! ```
//!
//! **Source.** bojanczyk1992 (periodic Schur form); kressner2006 (implementation and backward stability); lust2001 (why
//! Floquet multipliers need it).
//!
//! **Departures.** Complex arithmetic throughout, with single shifts: simpler than the real double-shift form, and the
//! factors are few after [`group`]. Conjugate pairs of a real product are restored at the end.

use num_complex::Complex64;

type C = Complex64;

/// An eigenvalue as logarithm of its modulus and argument, which cannot overflow or underflow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eigenvalue {
    /// log |μ|; -∞ for zero.
    pub log_modulus: f64,
    /// arg μ.
    pub argument: f64,
}

impl Eigenvalue {
    /// The eigenvalue as a complex number (infinite or zero outside the range of f64).
    pub fn value(self) -> C {
        if self.argument == 0.0 {
            C::new(self.log_modulus.exp(), 0.0)
        } else if self.argument == std::f64::consts::PI {
            C::new(-self.log_modulus.exp(), 0.0)
        } else {
            C::from_polar(self.log_modulus.exp(), self.argument)
        }
    }
}

/// Eigenvalues of F_K ⋯ F_1; `factors` holds the real p×p matrices F_1, F_2, …, row-major, one after the other.
///
/// Returns `None` if an entry is not finite or the iteration does not converge (40 sweeps per eigenvalue).
pub fn eigenvalues(factors: &[f64], p: usize) -> Option<Vec<Eigenvalue>> {
    if p == 0 {
        return Some(Vec::new());
    }
    if factors.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let mut cycle = Cycle::new(factors, p);
    cycle.reduce_to_hessenberg();
    cycle.iterate()?;
    let found = (0..p).map(|i| cycle.eigenvalue(i)).collect();
    Some(conjugate_pairs(found))
}

/// Condition up to which neighbouring factors are multiplied: it costs at most four digits of the smallest eigenvalue
/// and none of the largest.
pub(crate) const CONDITION: f64 = 1e4;

/// Multiplies neighbouring factors while their product stays well conditioned.
///
/// With |F| the root mean square of the singular values σ of a p×p matrix, and κ the ratio of the largest to the
/// smallest, the quantity bounded by [`CONDITION`] is (guggenheimer1995)
///
///   (4)  c(F) = |F|ᵖ / |det F|,   κ(F) ≤ 2 c(F),   c(F) ≤ κ(F)ᵖ⁻¹,   c(A B) ≤ κ(A)ᵖ⁻¹ c(B)
///
/// so that most products need not be examined.
pub fn group(factors: &[f64], p: usize) -> Vec<f64> {
    // Small dimensions as constants.
    match p {
        1 => grouped(factors, 1),
        2 => grouped(factors, 2),
        3 => grouped(factors, 3),
        4 => grouped(factors, 4),
        p => grouped(factors, p),
    }
}

#[inline(always)]
fn grouped(factors: &[f64], p: usize) -> Vec<f64> {
    let size = p * p;
    if factors.len() < size.max(1) {
        return Vec::new();
    }
    let mut out: Vec<f64> = Vec::new();
    let mut product = factors[..size].to_vec();
    let mut bound = spread_of(&product, p);
    let mut candidate = vec![0.0; size];
    for factor in factors.chunks_exact(size).skip(1) {
        multiply(factor, &product, p, &mut candidate);
        let own = spread_of(factor, p);
        if bound * own < CONDITION {
            bound *= own;
            std::mem::swap(&mut product, &mut candidate);
            continue;
        }
        let condition = condition(&mut candidate.clone(), p);
        if condition < CONDITION {
            bound = condition;
            std::mem::swap(&mut product, &mut candidate);
        } else {
            bound = own;
            out.extend_from_slice(&product);
            product.copy_from_slice(factor);
        }
    }
    out.append(&mut product);
    out
}

/// c(F) of (4); overwrites the matrix.
pub(crate) fn condition(matrix: &mut [f64], p: usize) -> f64 {
    let mean = (matrix.iter().map(|x| x * x).sum::<f64>() / p as f64).sqrt();
    let mut pivots = vec![0; p];
    match super::lu::factorise_even(matrix, p, &mut pivots) {
        Ok(()) => (p as f64 * mean.ln() - super::lu::determinant(matrix, p, &pivots).1).exp(),
        Err(_) => f64::INFINITY,
    }
}

/// Bound of κᵖ⁻¹ of (4), at least 1, from `delta2`, the square of δ: if |FᵀF - 1| ≤ δ in the Frobenius norm, σ² is
/// within 1 ± δ. Infinite if that gives no bound.
#[inline(always)]
pub(crate) fn spread(delta2: f64, p: usize) -> f64 {
    let delta = delta2.sqrt();
    let square = (1.0 + delta) / (1.0 - delta);
    let power = match p {
        3 => square,
        p => square.sqrt().powi(p.max(2) as i32 - 1),
    };
    if delta2 < 1.0 { power } else { f64::INFINITY }
}

/// Bound of κᵖ⁻¹ of a factor.
#[inline(always)]
fn spread_of(factor: &[f64], p: usize) -> f64 {
    let factor = &factor[..p * p];
    let mut delta2 = 0.0;
    for i in 0..p {
        for k in 0..=i {
            let product: f64 = (0..p).map(|r| factor[r * p + i] * factor[r * p + k]).sum();
            delta2 += if i == k { (product - 1.0) * (product - 1.0) } else { 2.0 * product * product };
        }
    }
    spread(delta2, p)
}

/// log |det (F_K ⋯ F_1)| of [`group`]ed factors.
pub fn log_determinant(grouped: &[f64], p: usize) -> f64 {
    let mut pivots = vec![0; p];
    let of = |factor: &[f64]| {
        let mut lu = factor.to_vec();
        super::lu::factorise_even(&mut lu, p, &mut pivots)
            .map_or(f64::NEG_INFINITY, |()| super::lu::determinant(&lu, p, &pivots).1)
    };
    grouped.chunks_exact((p * p).max(1)).map(of).sum()
}

/// Writes the product a b to c.
#[inline(always)]
fn multiply(a: &[f64], b: &[f64], p: usize, c: &mut [f64]) {
    let (a, b, c) = (&a[..p * p], &b[..p * p], &mut c[..p * p]);
    for i in 0..p {
        for k in 0..p {
            c[i * p + k] = (0..p).map(|l| a[i * p + l] * b[l * p + k]).sum();
        }
    }
}

struct Cycle {
    p: usize,
    hessenberg: Vec<C>,
    /// R_1 … R_{K-1}.
    triangular: Vec<Vec<C>>,
}

/// A unitary rotation of two rows: (c, s; -s̄, c) with real c.
#[derive(Clone, Copy)]
struct Rotation {
    c: f64,
    s: C,
}

impl Rotation {
    /// Rotation of (x, y) to (r, 0).
    fn new(x: C, y: C) -> Rotation {
        let norm = x.norm().hypot(y.norm());
        if norm == 0.0 || y.norm() == 0.0 {
            return Rotation { c: 1.0, s: C::ZERO };
        }
        if x.norm() == 0.0 {
            return Rotation { c: 0.0, s: y.conj() / y.norm() };
        }
        let phase = x / x.norm();
        Rotation { c: x.norm() / norm, s: phase * y.conj() / norm }
    }

    fn rows(self, a: &mut [C], p: usize, i: usize, from: usize) {
        for c in from..p {
            let (x, y) = (a[i * p + c], a[(i + 1) * p + c]);
            a[i * p + c] = x * self.c + self.s * y;
            a[(i + 1) * p + c] = y * self.c - self.s.conj() * x;
        }
    }

    /// Multiplies from the right by the conjugate transpose: the inverse acting on columns i, i + 1.
    fn columns(self, a: &mut [C], p: usize, i: usize, rows: usize) {
        for r in 0..rows {
            let (x, y) = (a[r * p + i], a[r * p + i + 1]);
            a[r * p + i] = x * self.c + self.s.conj() * y;
            a[r * p + i + 1] = y * self.c - self.s * x;
        }
    }
}

impl Cycle {
    /// Reduces the factors to H R_{K-1} ⋯ R_1 as in (1), with H full.
    fn new(factors: &[f64], p: usize) -> Cycle {
        let count = factors.len() / (p * p);
        let mut triangular = Vec::with_capacity(count.saturating_sub(1));
        let mut next: Vec<C> = factors[..p * p].iter().map(|&x| C::new(x, 0.0)).collect();
        for k in 1..count {
            let mut r = next;
            next = factors[k * p * p..(k + 1) * p * p].iter().map(|&x| C::new(x, 0.0)).collect();
            for col in 0..p {
                for i in (col..p - 1).rev() {
                    let g = Rotation::new(r[i * p + col], r[(i + 1) * p + col]);
                    g.rows(&mut r, p, i, col);
                    r[(i + 1) * p + col] = C::ZERO;
                    g.columns(&mut next, p, i, p);
                }
            }
            triangular.push(r);
        }
        Cycle { p, hessenberg: next, triangular }
    }

    /// Applies G from the left to the rows of H and passes G* round the cycle until it reaches the columns of H.
    fn rotate(&mut self, i: usize, g: Rotation, from: usize, rows_of_h: usize) {
        let p = self.p;
        g.rows(&mut self.hessenberg, p, i, from);
        let mut g = g;
        for r in &mut self.triangular {
            g.columns(r, p, i, i + 2);
            g = Rotation::new(r[i * p + i], r[(i + 1) * p + i]);
            g.rows(r, p, i, i);
            r[(i + 1) * p + i] = C::ZERO;
        }
        g.columns(&mut self.hessenberg, p, i, rows_of_h);
    }

    fn reduce_to_hessenberg(&mut self) {
        let p = self.p;
        for col in 0..p.saturating_sub(2) {
            for i in (col + 1..p - 1).rev() {
                let g = Rotation::new(self.hessenberg[i * p + col], self.hessenberg[(i + 1) * p + col]);
                self.rotate(i, g, 0, p);
                self.hessenberg[(i + 1) * p + col] = C::ZERO;
            }
        }
    }

    fn iterate(&mut self) -> Option<()> {
        let p = self.p;
        let (mut high, mut sweeps) = (p - 1, 0);
        while high > 0 {
            let mut low = high;
            while low > 0 {
                let h = &self.hessenberg;
                let size = h[low * p + low].norm() + h[(low - 1) * p + low - 1].norm();
                if h[low * p + low - 1].norm() <= f64::EPSILON * size {
                    self.hessenberg[low * p + low - 1] = C::ZERO;
                    break;
                }
                low -= 1;
            }
            if low == high {
                (high, sweeps) = (high - 1, 0);
                continue;
            }
            sweeps += 1;
            if sweeps > 40 {
                return None;
            }
            self.sweep(low, high, sweeps);
        }
        Some(())
    }

    fn sweep(&mut self, low: usize, high: usize, sweeps: usize) {
        let p = self.p;
        let h = &self.hessenberg;
        // First column of P - σ on the active block, divided by ∏ (R_k)_{low,low}.
        let mut shift = self.relative_shift(low, high);
        if sweeps % 11 == 10 {
            shift = h[low * p + low] * C::new(0.7, 0.4) + h[(low + 1) * p + low];
        }
        let mut g = Rotation::new(h[low * p + low] - shift, h[(low + 1) * p + low]);
        for i in low..high {
            if i > low {
                g = Rotation::new(self.hessenberg[i * p + i - 1], self.hessenberg[(i + 1) * p + i - 1]);
            }
            let from = i.saturating_sub(1);
            self.rotate(i, g, from, (i + 3).min(p));
            if i > low {
                self.hessenberg[(i + 1) * p + i - 1] = C::ZERO;
            }
        }
    }

    /// Wilkinson shift divided by the product of the leading diagonal entries; 0 if the quotient is so large that the
    /// matrix would be lost in its rounding. In that case the large eigenvalues are at the wrong end, and an unshifted
    /// step moves them.
    fn relative_shift(&self, low: usize, high: usize) -> C {
        let p = self.p;
        // Trailing 2×2 block of the product of the triangular factors, times e^log.
        let (mut a, mut b, mut d, mut log) = (C::ONE, C::ZERO, C::ONE, 0.0);
        let mut leading = (C::ONE, 0.0);
        for r in &self.triangular {
            let (ra, rb, rd) = (r[(high - 1) * p + high - 1], r[(high - 1) * p + high], r[high * p + high]);
            (a, b, d) = (ra * a, ra * b + rb * d, rd * d);
            let size = a.norm().max(b.norm()).max(d.norm());
            if size > 0.0 {
                (a, b, d, log) = (a / size, b / size, d / size, log + size.ln());
            }
            let entry = r[low * p + low];
            if entry.norm() == 0.0 {
                return C::ZERO;
            }
            leading = (leading.0 * entry / entry.norm(), leading.1 + entry.norm().ln());
        }
        let h = &self.hessenberg;
        let (h11, h12) = (h[(high - 1) * p + high - 1], h[(high - 1) * p + high]);
        let (h21, h22) = (h[high * p + high - 1], h[high * p + high]);
        let (p11, p12, p21, p22) = (h11 * a, h11 * b + h12 * d, h21 * a, h21 * b + h22 * d);
        let half = (p11 - p22) * 0.5;
        let root = (half * half + p12 * p21).sqrt();
        let (up, down) = (half + root, half - root);
        // Of the two eigenvalues p22 + half ± root, the one closer to p22, computed without cancellation.
        let shift = if up.norm() > down.norm() {
            p22 - p12 * p21 / up
        } else if down.norm() > 0.0 {
            p22 - p12 * p21 / down
        } else {
            p22
        };
        let relative = shift / leading.0 * (log - leading.1).exp();
        let beside = h[low * p + low].norm() + h[(low + 1) * p + low].norm();
        if relative.norm() * f64::EPSILON < beside { relative } else { C::ZERO }
    }

    fn eigenvalue(&self, i: usize) -> Eigenvalue {
        let p = self.p;
        let (mut log, mut argument) = (0.0, 0.0);
        for entry in std::iter::once(&self.hessenberg).chain(&self.triangular).map(|f| f[i * p + i]) {
            log += entry.norm().ln();
            argument += entry.arg();
        }
        Eigenvalue { log_modulus: log, argument: wrap(argument) }
    }
}

/// Reduces an angle to (-π, π].
fn wrap(angle: f64) -> f64 {
    let turns = (angle / std::f64::consts::TAU).round();
    angle - turns * std::f64::consts::TAU
}

/// Enforces the conjugate symmetry of the spectrum of a real product: each eigenvalue is averaged with the conjugate of
/// its partner, or made real if it is its own partner. Sorts by decreasing modulus.
fn conjugate_pairs(mut found: Vec<Eigenvalue>) -> Vec<Eigenvalue> {
    let distance =
        |a: Eigenvalue, b: Eigenvalue| (a.log_modulus - b.log_modulus).abs() + wrap(a.argument + b.argument).abs();
    let mut out = Vec::with_capacity(found.len());
    found.sort_by(|a, b| b.log_modulus.total_cmp(&a.log_modulus));
    while !found.is_empty() {
        let first = found.remove(0);
        let own = 2.0 * first.argument.abs().min(std::f64::consts::PI - first.argument.abs());
        let partner = (0..found.len()).min_by(|&i, &j| distance(first, found[i]).total_cmp(&distance(first, found[j])));
        match partner.filter(|&i| distance(first, found[i]) < own) {
            Some(i) if first.log_modulus.is_finite() => {
                let other = found.remove(i);
                let log_modulus = 0.5 * (first.log_modulus + other.log_modulus);
                let argument = 0.5 * (first.argument.abs() + other.argument.abs());
                out.push(Eigenvalue { log_modulus, argument });
                out.push(Eigenvalue { log_modulus, argument: -argument });
            }
            _ => {
                let argument =
                    if first.argument.abs() > std::f64::consts::FRAC_PI_2 { std::f64::consts::PI } else { 0.0 };
                out.push(Eigenvalue { argument, ..first });
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_hundreds_of_orders_of_magnitude_apart_are_found_in_any_order() {
        // F = Q diag(a, b) Qᵀ with the same Q in all factors: eigenvalues a^N and b^N, with the large one at either
        // end.
        for (a, b) in [(1e-5, 0.9), (0.9, 1e-5), (1e-5, 1e-4), (2.0, 1e-9)] {
            let (c, s) = (0.6f64, 0.8f64);
            let factor = [c * c * a + s * s * b, c * s * (a - b), c * s * (a - b), s * s * a + c * c * b];
            let count = 80;
            let found = eigenvalues(&factor.repeat(count), 2).expect("converges");
            let logs = [a.max(b).ln(), a.min(b).ln()].map(|log: f64| count as f64 * log);
            for (one, expected) in found.iter().zip(logs) {
                // The smaller eigenvalue of each factor has the rounding of the larger one, and the logarithm its own.
                let factors = 4.0 * count as f64 * f64::EPSILON * (a.max(b) / a.min(b));
                let error = factors + 4.0 * f64::EPSILON * expected.abs();
                assert!((one.log_modulus - expected).abs() < error, "{a} {b}: {one:?} {expected}");
            }
        }
    }

    #[test]
    fn a_product_with_the_small_eigenvalue_first_converges() {
        // Upper triangular factors with the small entry first, and a last one that mixes the components.
        let mut factors = [1e-5, 0.3, 0.0, 0.7].repeat(61);
        factors.extend([0.09828358, 0.05788514, -1.11157923, -0.53535464]);
        let found = eigenvalues(&factors, 2).expect("converges");
        let determinant = log_determinant(&factors, 2);
        let sum: f64 = found.iter().map(|one| one.log_modulus).sum();
        assert!((sum - determinant).abs() < 1e-10 * determinant.abs(), "{found:?} {determinant}");
    }

    fn pseudo_random(count: usize, seed: f64) -> Vec<f64> {
        let mut s = seed;
        (0..count)
            .map(|_| {
                s = (s * 131.7 + 0.317).fract();
                2.0 * s - 1.0
            })
            .collect()
    }

    /// Eigenvalues of a matrix `[p × p]` from a library that shares nothing with this module.
    fn independent(a: &[f64], p: usize) -> Vec<C> {
        foldline_general::eigenvalues(foldline_general::Mat::from_fn(p, p, |i, j| a[i * p + j]).as_ref()).unwrap()
    }

    #[test]
    fn one_factor_agrees_with_an_independent_library() {
        for p in 1..=9 {
            let a = pseudo_random(p * p, 0.1 + 0.07 * p as f64);
            let reference = independent(&a, p);
            let ours: Vec<C> = eigenvalues(&a, p).unwrap().iter().map(|e| e.value()).collect();
            for r in reference {
                let best = ours.iter().map(|o| (o - r).norm()).fold(f64::INFINITY, f64::min);
                assert!(best < 1e-12, "p = {p}: {r} is {best} from {ours:?}");
            }
        }
    }

    #[test]
    fn a_product_agrees_with_the_multiplied_matrix() {
        let (p, count) = (4, 6);
        let f = pseudo_random(p * p * count, 0.37);
        let mut product = f[..p * p].to_vec();
        for k in 1..count {
            let before = product.clone();
            multiply(&f[k * p * p..(k + 1) * p * p], &before, p, &mut product);
        }
        let reference = independent(&product, p);
        for factors in [f.clone(), group(&f, p)] {
            let ours: Vec<C> = eigenvalues(&factors, p).unwrap().iter().map(|e| e.value()).collect();
            for r in &reference {
                let best = ours.iter().map(|o| (o - r).norm()).fold(f64::INFINITY, f64::min);
                assert!(best < 1e-12 * (1.0 + r.norm()), "{r} is {best} from {ours:?}");
            }
        }
    }

    /// Factors V_{k+1} diag(d) V_k⁻¹ with periodic V: the product has exactly the eigenvalues dᴷ, over hundreds of
    /// orders of magnitude.
    #[test]
    fn eigenvalues_of_very_different_size_keep_their_digits() {
        let (p, count) = (3usize, 60usize);
        let d = [30.0f64, 0.9, 1e-4];
        let rotation = |k: usize| {
            let (a, b) = ((k % count) as f64 * 0.7, (k % count) as f64 * 0.3);
            let (sa, ca, sb, cb) = (a.sin(), a.cos(), b.sin(), b.cos());
            [ca, -sa * cb, sa * sb, sa, ca * cb, -ca * sb, 0.0, sb, cb]
        };
        let mut factors = Vec::new();
        for k in 0..count {
            let (v, w) = (rotation(k), rotation(k + 1));
            for i in 0..p {
                for j in 0..p {
                    factors.push((0..p).map(|l| w[i * p + l] * d[l] * v[j * p + l]).sum::<f64>());
                }
            }
        }
        for factors in [factors.clone(), group(&factors, p)] {
            for (e, d) in eigenvalues(&factors, p).unwrap().iter().zip(d) {
                let exact = count as f64 * d.ln();
                assert!((e.log_modulus - exact).abs() < 1e-9, "{} against {exact}", e.log_modulus);
                assert_eq!(e.argument, 0.0);
            }
        }
    }
}
