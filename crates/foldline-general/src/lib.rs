//! Dense matrices and Fourier transforms that `foldline` takes from libraries.
//!
//! **Idea.** These libraries are generic. This crate instantiates them for the one type used, so that their kernels are
//! compiled once, and not again with every change of `foldline` or for its tests.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::PartialPivLu;
use faer::prelude::*;
use faer::{Accum, Par};
use num_complex::Complex64;
use rustfft::FftPlanner;

pub use faer::{Mat, MatMut, MatRef};

/// Writes the product `a b` to `to`.
pub fn multiply(to: MatMut<f64>, a: MatRef<f64>, b: MatRef<f64>) {
    matmul(to, Accum::Replace, a, b, 1.0, Par::Seq);
}

/// The product `a b`.
pub fn product(a: &Mat<f64>, b: &Mat<f64>) -> Mat<f64> {
    let mut to = Mat::zeros(a.nrows(), b.ncols());
    multiply(to.as_mut(), a.as_ref(), b.as_ref());
    to
}

/// Eigenvalues of a square matrix, unordered; `None` if they could not be computed.
pub fn eigenvalues(a: MatRef<f64>) -> Option<Vec<Complex64>> {
    a.eigenvalues().ok().filter(|found| found.iter().all(|z| z.is_finite()))
}

/// LU factors of a square matrix.
#[derive(Debug)]
pub struct Factored(PartialPivLu<f64>);

impl Factored {
    /// Factorises with partial pivoting.
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

/// Frobenius norm.
pub fn norm(a: &Mat<f64>) -> f64 {
    a.norm_l2()
}

/// Replaces samples by their unnormalised discrete Fourier transform, X_k = Σ_j x_j exp(-2πi jk/N).
pub fn fourier(samples: &mut [Complex64]) {
    FftPlanner::new().plan_fft_forward(samples.len()).process(samples);
}

/// Eigenvalues and eigenvectors (columns) of a real square matrix, unordered; `None` if they could not be computed.
pub fn eigenvectors(a: MatRef<f64>) -> Option<(Vec<Complex64>, Mat<Complex64>)> {
    let found = a.eigen().ok()?;
    pairs(found.S().column_vector().iter().copied().collect(), found.U())
}

/// Eigenvalues of a complex square matrix, unordered; `None` if they could not be computed.
pub fn complex_eigenvalues(a: MatRef<Complex64>) -> Option<Vec<Complex64>> {
    a.eigenvalues().ok().filter(|found| found.iter().all(|z| z.is_finite()))
}

/// Eigenvalues and eigenvectors of a complex square matrix, as [`eigenvectors`].
pub fn complex_eigenvectors(a: MatRef<Complex64>) -> Option<(Vec<Complex64>, Mat<Complex64>)> {
    let found = a.eigen().ok()?;
    pairs(found.S().column_vector().iter().copied().collect(), found.U())
}

/// Eigenvalues, increasing, and orthonormal eigenvectors of a symmetric matrix; `None` if they could not be computed.
pub fn symmetric_eigenvectors(a: MatRef<f64>) -> Option<(Vec<f64>, Mat<f64>)> {
    let found = a.self_adjoint_eigen(faer::Side::Lower).ok()?;
    let values: Vec<f64> = found.S().column_vector().iter().copied().collect();
    values.iter().all(|v| v.is_finite()).then(|| (values, found.U().to_owned()))
}

fn pairs(values: Vec<Complex64>, vectors: MatRef<Complex64>) -> Option<(Vec<Complex64>, Mat<Complex64>)> {
    values.iter().all(|z| z.is_finite()).then(|| (values, vectors.to_owned()))
}

/// The solution of `a x = b` with complex numbers, by elimination with partial pivoting.
pub fn complex_solution(a: MatRef<Complex64>, b: &Mat<Complex64>) -> Mat<Complex64> {
    a.partial_piv_lu().solve(b)
}
