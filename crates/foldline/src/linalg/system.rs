//! The block system with the number of lanes that suits its size.

use super::apart::Remainder;
use super::condensed::Condensed;
use super::ends::Ends;
use super::lane::Eight;
use crate::contract::Singular;

/// Interior unknowns per interval up to which intervals share a vector. Larger blocks fill vectors by themselves, and
/// eight of them would not fit into the cache.
const SMALL: usize = 64;

/// A condensed system in eight lanes or one.
#[derive(Clone, Debug)]
pub enum System {
    /// Eight intervals at a time.
    Eight(Condensed<Eight>),
    /// One interval at a time.
    One(Condensed<f64>),
}

/// Evaluates an expression for either variant.
macro_rules! either {
    ($system:expr, $inner:ident => $body:expr) => {
        match $system {
            System::Eight($inner) => $body,
            System::One($inner) => $body,
        }
    };
}
pub(crate) use either;

impl System {
    /// See [`Condensed::new`].
    pub fn new(n: usize, end: &[f64], q: usize) -> System {
        if n * (end.len() - 1) <= SMALL {
            System::Eight(Condensed::new(n, end, q))
        } else {
            System::One(Condensed::new(n, end, q))
        }
    }

    /// n and q.
    pub fn shape(&self) -> (usize, usize) {
        either!(self, s => s.shape())
    }

    /// W, the number of lanes.
    pub fn lanes(&self) -> usize {
        match self {
            System::Eight(_) => 8,
            System::One(_) => 1,
        }
    }

    /// L, the number of places per lane: interval j is in lane ⌊j / L⌋ at place j mod L.
    pub fn length(&self) -> usize {
        either!(self, s => s.length())
    }

    /// See [`Condensed::resize`].
    pub fn resize(&mut self, intervals: usize) {
        either!(self, s => s.resize(intervals));
    }

    /// See [`Condensed::inner`].
    pub fn inner(&self, piece: std::ops::Range<usize>, stride: usize, to: &mut [f64]) {
        either!(self, s => s.inner(piece, stride, to));
    }

    /// See [`Condensed::transition`].
    pub fn transition(&self, j: usize, to: &mut [f64]) {
        either!(self, s => s.transition(j, to));
    }

    /// Condenses and eliminates; `closure` is κ.
    ///
    /// # Errors
    /// [`Singular`] if an interior block or the remaining matrix is.
    pub fn factorise(&mut self, closure: f64) -> Result<(), Singular> {
        either!(self, s => {
            s.condense()?;
            s.eliminate(closure)
        })
    }

    /// See [`Condensed::eliminate`].
    ///
    /// # Errors
    /// [`Singular`] if the remaining matrix is.
    pub fn eliminate(&mut self, closure: f64) -> Result<(), Singular> {
        either!(self, s => s.eliminate(closure))
    }

    /// See [`Condensed::open`].
    pub fn open(&mut self, ends: Option<Ends>) {
        either!(self, s => s.open(ends));
    }

    /// See [`Condensed::leave_apart`].
    pub fn leave_apart(&mut self) {
        either!(self, s => s.leave_apart());
    }

    /// See [`Condensed::remainder`].
    pub fn remainder(&self) -> Option<&Remainder> {
        either!(self, s => s.remainder())
    }

    /// See [`Condensed::forward`].
    pub fn forward(&self, rhs: &[f64], to: &mut [f64]) {
        either!(self, s => s.forward(rhs, to));
    }

    /// See [`Condensed::backward`].
    pub fn backward(&self, rhs: &[f64], known: &[f64], x: &mut [f64]) {
        either!(self, s => s.backward(rhs, known, x));
    }

    /// See [`Condensed::ends`].
    pub fn ends(&self) -> Option<&Ends> {
        either!(self, s => s.ends())
    }

    /// See [`Condensed::solve`].
    pub fn solve(&self, rhs: &[f64], x: &mut [f64]) {
        either!(self, s => s.solve(rhs, x));
    }

    /// See [`Condensed::solve_transposed`].
    pub fn solve_transposed(&self, z: &[f64], y: &mut [f64]) {
        either!(self, s => s.solve_transposed(z, y));
    }

    /// See [`Condensed::isolate`].
    pub fn isolate(&mut self, j: usize, scalars: usize) {
        either!(self, s => s.isolate(j, scalars));
    }

    /// See [`Condensed::replace`].
    pub fn replace(&mut self, j: usize, by: &[f64]) {
        either!(self, s => s.replace(j, by));
    }

    /// See [`Condensed::condense`].
    ///
    /// # Errors
    /// [`Singular`] if an interior block is.
    pub fn condense(&mut self) -> Result<(), Singular> {
        either!(self, s => s.condense())
    }
}
