//! Large dense matrices: what `foldline` takes of a general library.
//!
//! The library is generic in everything; used here at one type only, its kernels are compiled once and not with every change of `foldline`.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::PartialPivLu;
use faer::prelude::*;
use faer::{Accum, Par};
use num_complex::Complex64;

pub use faer::{Mat, MatMut, MatRef};

/// `to` = `a` `b`.
pub fn multiply(to: MatMut<f64>, a: MatRef<f64>, b: MatRef<f64>) {
    matmul(to, Accum::Replace, a, b, 1.0, Par::Seq);
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

    /// The solution of `aᵀ x = b`.
    pub fn solve_transpose(&self, b: &Mat<f64>) -> Mat<f64> {
        self.0.solve_transpose(b)
    }
}

/// The root of the sum of the squares of all entries.
pub fn norm(a: &Mat<f64>) -> f64 {
    a.norm_l2()
}
