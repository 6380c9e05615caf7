//! Numbers and lanes of numbers under one name, so that one kernel serves both.
//!
//! **Idea.** Many small systems of one shape are solved together, one in each lane: every operation of the algorithm becomes
//! a vector instruction, however small the systems are. Systems that are large enough by themselves run one at a time
//! through the same code. No fused multiply-add is used: a lane gives the same result on every machine.

use std::ops::{Add, Mul, Sub};

/// One number, or eight of them side by side.
pub trait Lane: Copy + Default + Send + Sync + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// How many numbers.
    const COUNT: usize;

    /// The same number in every lane.
    fn splat(x: f64) -> Self;

    /// The first `COUNT` numbers of a slice.
    fn load(from: &[f64]) -> Self;

    /// The lanes as a slice.
    fn lanes(&self) -> &[f64];

    /// The lanes as a slice.
    fn lanes_mut(&mut self) -> &mut [f64];

    /// A function applied lane by lane.
    fn map(self, f: impl Fn(f64) -> f64) -> Self;

    /// A function of two numbers applied lane by lane.
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self;

    /// Runs work compiled for the widest instruction set of the machine.
    fn dispatch<R>(work: impl pulp::NullaryFnOnce<Output = R>) -> R {
        pulp::Arch::new().dispatch(work)
    }
}

impl Lane for f64 {
    const COUNT: usize = 1;

    #[inline(always)]
    fn splat(x: f64) -> f64 {
        x
    }

    #[inline(always)]
    fn load(from: &[f64]) -> f64 {
        from[0]
    }

    #[inline(always)]
    fn lanes(&self) -> &[f64] {
        std::slice::from_ref(self)
    }

    #[inline(always)]
    fn lanes_mut(&mut self) -> &mut [f64] {
        std::slice::from_mut(self)
    }

    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> f64 {
        f(self)
    }

    #[inline(always)]
    fn zip(self, other: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
        f(self, other)
    }
}

/// Eight numbers in one cache line.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub struct Eight(pub [f64; 8]);

impl Lane for Eight {
    const COUNT: usize = 8;

    #[inline(always)]
    fn splat(x: f64) -> Eight {
        Eight([x; 8])
    }

    #[inline(always)]
    fn load(from: &[f64]) -> Eight {
        let mut out = Eight::default();
        out.0.copy_from_slice(&from[..8]);
        out
    }

    #[inline(always)]
    fn lanes(&self) -> &[f64] {
        &self.0
    }

    #[inline(always)]
    fn lanes_mut(&mut self) -> &mut [f64] {
        &mut self.0
    }

    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> Eight {
        let mut out = Eight::default();
        for l in 0..8 {
            out.0[l] = f(self.0[l]);
        }
        out
    }

    #[inline(always)]
    fn zip(self, other: Eight, f: impl Fn(f64, f64) -> f64) -> Eight {
        let mut out = Eight::default();
        for l in 0..8 {
            out.0[l] = f(self.0[l], other.0[l]);
        }
        out
    }
}

impl Add for Eight {
    type Output = Eight;

    #[inline(always)]
    fn add(self, other: Eight) -> Eight {
        self.zip(other, |a, b| a + b)
    }
}

impl Sub for Eight {
    type Output = Eight;

    #[inline(always)]
    fn sub(self, other: Eight) -> Eight {
        self.zip(other, |a, b| a - b)
    }
}

impl Mul for Eight {
    type Output = Eight;

    #[inline(always)]
    fn mul(self, other: Eight) -> Eight {
        self.zip(other, |a, b| a * b)
    }
}

/// y -= s x.
#[inline(always)]
pub fn subtract<T: Lane>(s: T, x: &[T], y: &mut [T]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y = *y - s * *x;
    }
}

/// y += s x.
#[inline(always)]
pub fn add<T: Lane>(s: T, x: &[T], y: &mut [T]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y = *y + s * *x;
    }
}

/// a · b in every lane.
#[inline(always)]
pub fn dot<T: Lane>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).fold(T::default(), |sum, (a, b)| sum + *a * *b)
}
