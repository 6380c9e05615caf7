//! General numerics: what `foldline` takes of libraries.
//!
//! **Idea.** The libraries are generic in everything. Used here at one type only, their kernels are compiled once: not with every change of
//! `foldline`, and not once more for its tests.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::PartialPivLu;
use faer::prelude::*;
use faer::{Accum, Par};
use num_complex::Complex64;
use rustfft::FftPlanner;

pub use faer::{Mat, MatMut, MatRef};

/// `to` = `a` `b`.
pub fn multiply(to: MatMut<f64>, a: MatRef<f64>, b: MatRef<f64>) {
    matmul(to, Accum::Replace, a, b, 1.0, Par::Seq);
}

/// `a` `b`.
pub fn product(a: &Mat<f64>, b: &Mat<f64>) -> Mat<f64> {
    let mut to = Mat::zeros(a.nrows(), b.ncols());
    multiply(to.as_mut(), a.as_ref(), b.as_ref());
    to
}

/// Eigenvalues of a square matrix in no order; `None` if they could not be computed.
pub fn eigenvalues(a: MatRef<f64>) -> Option<Vec<Complex64>> {
    a.eigenvalues().ok().filter(|found| found.iter().all(|z| z.is_finite()))
}

/// A factorised square matrix.
#[derive(Debug)]
pub struct Factored(PartialPivLu<f64>);

impl Factored {
    /// Factorises with row exchanges.
    pub fn new(a: MatRef<f64>) -> Factored {
        Factored(a.partial_piv_lu())
    }

    /// log |det|.
    pub fn log_determinant(&self) -> f64 {
        let u = self.0.U();
        (0..u.nrows()).map(|i| u[(i, i)].abs().ln()).sum()
    }

    /// The solution of `a x = b`.
    pub fn solve(&self, b: &Mat<f64>) -> Mat<f64> {
        self.0.solve(b)
    }

    /// The solution of `aᵀ x = b`.
    pub fn solve_transpose(&self, b: &Mat<f64>) -> Mat<f64> {
        self.0.solve_transpose(b)
    }
}

/// The root of the sum of the squares of all entries.
pub fn norm(a: &Mat<f64>) -> f64 {
    a.norm_l2()
}

/// Replaces samples by their discrete Fourier transform, X_k = Σ_j x_j exp(-2πi jk/N), without a factor.
pub fn fourier(samples: &mut [Complex64]) {
    FftPlanner::new().plan_fft_forward(samples.len()).process(samples);
}
