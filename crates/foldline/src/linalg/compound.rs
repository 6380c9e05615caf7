//! Compactification: every node of a piece of a chain expressed by its first node.
//!
//! **Idea.** The links x_{j+1} = G_j x_j + g_j σ + h_j are multiplied together. That takes a quarter of the operations
//! of [`super::chain`], and the nodes of a piece are independent of each other when a system is solved. It is stable as
//! long as errors at one node do not grow on the way to another, which is measured during the multiplication.
//!
//! **Equations.** Starting from P_0 = 1, a_0 = 0 and b_0 = 0:
//!
//! ```text
//!   (1)  P_{j+1} = G_j P_j,   a_{j+1} = G_j a_j + g_j,   b_{j+1} = G_j b_j + h_j,     x_j = P_j x_0 + a_j σ + b_j
//!   (2)  C_{j+1} = G_j C_j G_jᵀ + S²,  C_0 = S²
//! ```
//!
//! (2) is the covariance at x_{j+1} of independent errors at x_0 … x_j, each as large as the scales S of the
//! components. Its diagonal bounds their growth between any two nodes, even if growth and decay follow each other so
//! that P shows neither. For many components it costs more than the products themselves: random errors e_{j+1} = G_j
//! e_j + S r, r = ±1, are propagated instead, and their mean squares estimate that diagonal.
//!
//! **Source.** Compactification, ascher1995, §7.2, which is unstable without a bound on the growth.
//!
//! **Fails when** that bound is exceeded; [`Compound::multiply`] then returns false, and the caller uses the chain.

use super::dense::{MANY, VECTORS, signs};
use super::lane::{Lane, add, dot, subtract};
use super::tile::piece;

/// Diagonal of (2), in S², up to which a piece is multiplied together: errors grow at most some 30 times, which costs
/// 1.5 of 16 digits.
const GROWTH: f64 = 1e3;

/// Pieces side by side, one in each lane.
#[derive(Clone, Debug, Default)]
pub struct Compound<T> {
    /// `[L][n × (n + q)]`: (P_j, a_j) of (1), j = 1 … L.
    products: Vec<T>,
    /// `[n × n]`: C of (2); below, workspace for the next one.
    spread: Vec<T>,
    room: Vec<T>,
}

impl<T: Lane> Compound<T> {
    /// Resizes for pieces of `length` links; the contents are then undefined.
    pub fn resize(&mut self, n: usize, q: usize, length: usize) {
        self.products.resize(length * n * (n + q), T::default());
        self.spread.resize(n * n, T::default());
        self.room.resize(n * n, T::default());
    }

    /// Computes (1) and (2) for the links `[L][n × (n + q)]`, (G_j, g_j), with the scales `[n]`; false if errors may
    /// grow too much.
    #[inline(always)]
    pub fn multiply(&mut self, links: &[T], scale: &[f64], n: usize, q: usize) -> bool {
        if T::COUNT == 1 && n >= MANY {
            return self.multiply_large(links, scale, n, q);
        }
        let Compound { products, spread, room } = self;
        let (width, size) = (n + q, n * (n + q));
        spread.fill(T::default());
        (0..n).for_each(|i| spread[i * (n + 1)] = T::splat(scale[i] * scale[i]));
        for (j, link) in links.chunks_exact(size).enumerate() {
            let (before, own) = products.split_at_mut(j * size);
            let own = &mut own[..size];
            own.copy_from_slice(link);
            if let Some(last) = before.rchunks_exact(size).next() {
                for (row, to) in link.chunks_exact(width).zip(own.chunks_exact_mut(width)) {
                    to[..n].fill(T::default());
                    add_combination(to, &row[..n], last, width);
                }
            }
            // Upper triangle of G C Gᵀ + S², mirrored to the lower one.
            for (row, to) in link.chunks_exact(width).zip(room.chunks_exact_mut(n)) {
                to.fill(T::default());
                add_combination(to, &row[..n], spread, n);
            }
            for i in 0..n {
                for k in i..n {
                    let entry = dot(&room[i * n..(i + 1) * n], &link[k * width..k * width + n]);
                    (spread[i * n + k], spread[k * n + i]) = (entry, entry);
                }
                let square = T::splat(scale[i] * scale[i]);
                spread[i * (n + 1)] = spread[i * (n + 1)] + square;
                // Rejects NaN as well.
                if !spread[i * (n + 1)].all(square, |entry, square| entry <= GROWTH * square) {
                    return false;
                }
            }
        }
        true
    }

    /// [`Compound::multiply`] for matrices that fill the vectors by themselves.
    fn multiply_large(&mut self, links: &[T], scale: &[f64], n: usize, q: usize) -> bool {
        let (width, size) = (n + q, n * (n + q));
        if random_errors_grow(links, scale, n, q) {
            return false;
        }
        for (j, link) in links.chunks_exact(size).enumerate() {
            let (before, own) = self.products.split_at_mut(j * size);
            let own = &mut own[..size];
            let Some(last) = before.rchunks_exact(size).next() else {
                own.copy_from_slice(link);
                continue;
            };
            T::multiply((own, width), (link, width), (last, width), [n, n, width]);
            for (row, to) in link.chunks_exact(width).zip(own.chunks_exact_mut(width)) {
                add(T::splat(1.0), &row[n..], &mut to[n..]);
            }
        }
        true
    }

    /// (P_L, a_L).
    #[inline(always)]
    pub fn whole(&self, n: usize, q: usize) -> &[T] {
        &self.products[self.products.len() - n * (n + q)..]
    }

    /// Expresses the rows Σ_j p_j x_j by x_0 (added to `first` `[q × n]`) and σ (added to `corner` `[q × q]`); `border`
    /// is `[L][q × n]` with j = 0 … L-1.
    #[inline(always)]
    pub fn carry_border(&self, border: &[T], first: &mut [T], corner: &mut [T], n: usize, q: usize) {
        let width = n + q;
        for (j, rows) in border.chunks_exact(q * n).enumerate() {
            if j == 0 {
                add(T::splat(1.0), rows, first);
                continue;
            }
            let product = &self.products[(j - 1) * n * width..j * n * width];
            for (c, row) in rows.chunks_exact(n).enumerate() {
                add_columns(&mut first[c * n..(c + 1) * n], row, product, width, 0);
                add_columns(&mut corner[c * q..(c + 1) * q], row, product, width, n);
            }
        }
    }

    /// Replaces right-hand sides h `[L × n]` by b_1 … b_L, and subtracts from `s` `[q]` the product of the border
    /// `[L][q × n]` with them.
    #[inline(always)]
    pub fn forward(&self, links: &[T], border: &[T], h: &mut [T], s: &mut [T], [n, q]: [usize; 2]) {
        match (n, q) {
            (4, 2) => self.forwarded(links, border, h, s, [4, 2]),
            (n, q) => self.forwarded(links, border, h, s, [n, q]),
        }
    }

    #[inline(always)]
    fn forwarded(&self, links: &[T], border: &[T], h: &mut [T], s: &mut [T], [n, q]: [usize; 2]) {
        let (width, size) = (n + q, n * (n + q));
        for (j, link) in links.chunks_exact(size).enumerate().skip(1) {
            let (before, own) = h[(j - 1) * n..(j + 1) * n].split_at_mut(n);
            for (x, row) in own.iter_mut().zip(link.chunks_exact(width)) {
                *x = *x + dot(&row[..n], before);
            }
            for (s, row) in s.iter_mut().zip(border[j * q * n..(j + 1) * q * n].chunks_exact(n)) {
                *s = *s - dot(row, before);
            }
        }
    }

    /// Computes x_1 … x_{L-1}, at 0 … L-2, from x_0 and σ, with h as left by [`Compound::forward`].
    #[inline(always)]
    pub fn backward(&self, h: &mut [T], first: &[T], sigma: &[T], [n, q]: [usize; 2]) {
        match (n, q) {
            (4, 2) => self.backwarded(h, first, sigma, [4, 2]),
            (n, q) => self.backwarded(h, first, sigma, [n, q]),
        }
    }

    #[inline(always)]
    fn backwarded(&self, h: &mut [T], first: &[T], sigma: &[T], [n, q]: [usize; 2]) {
        let (width, size) = (n + q, n * (n + q));
        let inner = self.products.len() / size - 1;
        for (x, product) in h.chunks_exact_mut(n).zip(self.products.chunks_exact(size)).take(inner) {
            for (x, row) in x.iter_mut().zip(product.chunks_exact(width)) {
                *x = *x + dot(&row[..n], &first[..n]) + dot(&row[n..], &sigma[..q]);
            }
        }
    }

    /// Adds to `first` and `sigma` the contributions of x_1 … x_{L-1}, in `z` `[L × n]` at 1 … L-1.
    #[inline(always)]
    pub fn forward_transposed(&self, z: &[T], first: &mut [T], sigma: &mut [T], n: usize, q: usize) {
        let (width, size) = (n + q, n * (n + q));
        for (z, product) in z.chunks_exact(n).skip(1).zip(self.products.chunks_exact(size)) {
            for (z, row) in z.iter().zip(product.chunks_exact(width)) {
                add(*z, &row[..n], first);
                add(*z, &row[n..], sigma);
            }
        }
    }

    /// Computes the multipliers of the links, y_{j-1} = G_jᵀ y_j + z_j - p_jᵀ μ, which replace `z` (as given to
    /// [`Compound::forward_transposed`]), from those of the relation between the ends (`carry` `[n]`) and of the border
    /// (`mu` `[q]`).
    #[inline(always)]
    pub fn backward_transposed(&self, links: &[T], border: &[T], z: &mut [T], carry: &[T], mu: &[T]) {
        let (n, q) = (carry.len(), mu.len());
        let (width, size) = (n + q, n * (n + q));
        // z_j moves to place j - 1, that of y_{j-1}.
        z.copy_within(n.., 0);
        let last = z.len() - n;
        z[last..].copy_from_slice(carry);
        for j in (1..z.len() / n).rev() {
            let (own, next) = z[(j - 1) * n..(j + 1) * n].split_at_mut(n);
            for (y, row) in next.iter().zip(links[j * size..(j + 1) * size].chunks_exact(width)) {
                add(*y, &row[..n], own);
            }
            for (mu, row) in mu.iter().zip(border[j * q * n..(j + 1) * q * n].chunks_exact(n)) {
                subtract(*mu, row, own);
            }
        }
    }
}

/// True if the mean squares of random errors exceed [`GROWTH`] at any node.
fn random_errors_grow<T: Lane>(links: &[T], scale: &[f64], n: usize, q: usize) -> bool {
    let width = n + q;
    let mut sign = signs();
    let mut drawn = |s: &f64| T::splat(s * sign());
    let mut errors: Vec<T> = (0..n * VECTORS).map(|k| drawn(&scale[k / VECTORS])).collect();
    let mut next = errors.clone();
    links.chunks_exact(n * width).any(|link| {
        T::multiply((&mut next, VECTORS), (link, width), (&errors, VECTORS), [n, n, VECTORS]);
        std::mem::swap(&mut next, &mut errors);
        errors.chunks_exact_mut(VECTORS).zip(scale).any(|(row, s)| {
            row.iter_mut().for_each(|e| *e = *e + drawn(s));
            let limit = T::splat(GROWTH * VECTORS as f64 * s * s);
            // Rejects NaN as well.
            !dot(row, row).all(limit, |sum, limit| sum <= limit)
        })
    })
}

/// to += row · matrix, for matrices with as many columns as `to`.
#[inline(always)]
fn add_combination<T: Lane>(to: &mut [T], row: &[T], matrix: &[T], width: usize) {
    add_columns(to, row, matrix, width, 0);
}

/// to += row · matrix, for as many columns of the matrix as `to` has, from `at` on.
#[inline(always)]
fn add_columns<T: Lane>(to: &mut [T], row: &[T], matrix: &[T], width: usize, at: usize) {
    let mut c = 0;
    while c < to.len() {
        c += match to.len() - c {
            4.. => columns::<T, 4>(&mut to[c..], row, matrix, width, at + c),
            2.. => columns::<T, 2>(&mut to[c..], row, matrix, width, at + c),
            _ => columns::<T, 1>(&mut to[c..], row, matrix, width, at + c),
        };
    }
}

/// [`add_columns`] for C columns, whose sums stay in registers; returns C.
#[inline(always)]
fn columns<T: Lane, const C: usize>(to: &mut [T], row: &[T], matrix: &[T], width: usize, at: usize) -> usize {
    let mut sums: [T; C] = *piece(to, 0);
    for (k, x) in row.iter().enumerate() {
        let line: &[T; C] = piece(matrix, k * width + at);
        for c in 0..C {
            sums[c] = sums[c] + *x * line[c];
        }
    }
    to[..C].copy_from_slice(&sums);
    C
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Links of dimension one, each with a factor and one scalar.
    fn links(factors: &[f64]) -> Vec<f64> {
        factors.iter().enumerate().flat_map(|(j, g)| [*g, j as f64]).collect()
    }

    fn compound(factors: &[f64]) -> (Compound<f64>, bool) {
        let mut own = Compound::default();
        own.resize(1, 1, factors.len());
        let safe = own.multiply(&links(factors), &[3.0], 1, 1);
        (own, safe)
    }

    #[test]
    fn products_and_nodes_are_those_of_the_recurrence() {
        let factors = [2.0, -0.5, 3.0, 0.25];
        let (own, safe) = compound(&factors);
        assert!(safe);
        assert_eq!(own.whole(1, 1), [2.0 * -0.5 * 3.0 * 0.25, ((1.0 * 3.0) + 2.0) * 0.25 + 3.0]);
        let (mut h, mut s) = (vec![1.0, 2.0, 3.0, 4.0], [10.0]);
        let border = [0.0, 5.0, 6.0, 7.0];
        own.forward(&links(&factors), &border, &mut h, &mut s, [1, 1]);
        assert_eq!((&h[..], s), (&[1.0, 1.5, 7.5, 5.875][..], [10.0 - 5.0 - 9.0 - 52.5]));
        own.backward(&mut h, &[2.0], &[1.0], [1, 1]);
        // x_0 = 2, σ = 1: x_1 = 2·2 + 0 + 1, x_2 = -½·5 + 1 + 2, x_3 = 3·½ + 2 + 3.
        assert_eq!(h[..3], [5.0, 0.5, 6.5]);
    }

    #[test]
    fn growth_does_not_depend_on_units() {
        // A rotation by 1 rad with the second component in thousandths, then in thousands: the same motion.
        for unit in [1e-3, 1.0, 1e3] {
            let (sin, cos) = 1f64.sin_cos();
            let link = [cos, -sin / unit, 0.0, sin * unit, cos, 0.0];
            let mut own = Compound::default();
            own.resize(2, 1, 50);
            assert!(own.multiply(&link.repeat(50), &[1.0, unit], 2, 1), "{unit}");
            assert_eq!(own.multiply(&link.repeat(50), &[1.0, 1.0], 2, 1), unit == 1.0, "{unit}, as if it were 1");
        }
    }

    #[test]
    fn growth_is_detected_anywhere_in_a_piece() {
        assert!(compound(&[0.5; 40]).1 && compound(&[1.0; 900]).1, "decay, or neither");
        assert!(!compound(&[1.8; 20]).1, "growth");
        let down_and_up: Vec<f64> = (0..40).map(|j| if j < 20 { 0.5 } else { 2.0 }).collect();
        assert!(!compound(&down_and_up).1, "the product is 1");
        let in_between: Vec<f64> = (0..60).map(|j| if j / 20 == 1 { 2.0 } else { 0.4 }).collect();
        assert!(!compound(&in_between).1, "neither from the left end nor to the right one");
        assert!(!compound(&[1.0, f64::NAN, 1.0]).1 && !compound(&[1.0, f64::INFINITY]).1);
    }
}
