//! Small dense kernels, and the block solver for collocation.
//!
//! Matrices are row-major slices. The kernels serve blocks of up to about forty rows, for which calling a general
//! library costs more than the arithmetic.

pub mod apart;
pub mod block;
pub mod chain;
pub mod compound;
pub mod condensed;
pub mod cyclic;
pub mod dense;
pub mod ends;
pub mod lane;
pub mod local;
pub mod lu;
pub mod neutral;
pub mod panel;
pub mod periodic_schur;
pub mod reflect;
pub mod shape;
pub mod span;
pub mod system;
pub(crate) mod tile;

/// Larger of two numbers; NaN if either is NaN.
pub fn larger(a: f64, b: f64) -> f64 {
    // A selection also compiles to one in vector code. Loops must keep the maximum in a variable: if it stays in
    // memory, it becomes a masked store, which is very slow on some processors.
    std::hint::select_unpredictable((b > a) | b.is_nan(), b, a)
}

/// Size of the n×n matrix `a` that does not depend on the units of the components that it maps: the largest of |a_ii|
/// and √|a_ij a_ji|, or of all entries if these are zero.
pub fn size_in_any_units(a: &[f64], n: usize) -> f64 {
    let size = (0..n * n).map(|k| (a[k] * a[k % n * n + k / n]).abs().sqrt()).fold(0.0, larger);
    if size > 0.0 { size } else { max_abs(a) }
}

/// Largest absolute value; NaN if any entry is NaN.
pub fn max_abs(v: &[f64]) -> f64 {
    let (blocks, rest) = v.as_chunks::<8>();
    let mut most = [0.0; 8];
    for block in blocks {
        (0..8).for_each(|l| most[l] = larger(most[l], block[l].abs()));
    }
    most.into_iter().chain(rest.iter().map(|x| x.abs())).fold(0.0, larger)
}

/// True if all entries are finite.
pub fn all_finite(v: &[f64]) -> bool {
    // Zero times a non-finite number is not zero.
    let (blocks, rest) = v.as_chunks::<8>();
    let mut sums = [0.0; 8];
    blocks.iter().for_each(|block| (0..8).for_each(|l| sums[l] += 0.0 * block[l]));
    sums.into_iter().chain(rest.iter().map(|x| 0.0 * x)).all(|zero| zero == 0.0)
}

/// True if all entries are equal. The loop exits early only after blocks of eight, each of which is a single vector
/// comparison.
pub fn same(a: &[f64], b: &[f64]) -> bool {
    let ((a8, a), (b8, b)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let equal = |(x, y): (&[f64; 8], &[f64; 8])| (0..8).fold(true, |all, l| all & (x[l] == y[l]));
    a8.len() == b8.len() && a == b && a8.iter().zip(b8).all(equal)
}

/// a · b.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// y += s x.
pub fn axpy(s: f64, x: &[f64], y: &mut [f64]) {
    for (yi, xi) in y.iter_mut().zip(x) {
        *yi += s * xi;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_non_finite_entry_is_detected_at_any_position() {
        for length in [1, 7, 8, 9, 24] {
            let mut v: Vec<f64> = (0..length).map(|k| 1e308 * (k as f64).sin()).collect();
            assert!(all_finite(&v));
            for at in 0..length {
                for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                    let own = std::mem::replace(&mut v[at], bad);
                    assert!(!all_finite(&v), "{bad} at {at} of {length}");
                    v[at] = own;
                }
            }
        }
    }
}
