//! Small dense kernels, and the block solver of collocation.
//!
//! Matrices are row-major slices. The kernels serve blocks of up to about forty rows, where calling a general library
//! costs more than the arithmetic.

pub mod block;
pub mod chain;
pub mod condensed;
pub mod lane;
pub mod lu;
pub mod periodic_schur;
pub mod reflect;
pub mod system;
mod tile;

/// Largest absolute value; NaN if any entry is NaN.
pub fn max_abs(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |m: f64, x| if x.is_nan() || m.is_nan() { f64::NAN } else { m.max(x.abs()) })
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
