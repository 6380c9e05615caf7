//! A common interface to numbers and vectors of eight numbers, so that one kernel serves both.
//!
//! **Idea.** Many small systems of one shape are solved together, one in each lane: every operation of the algorithm
//! becomes a vector instruction, however small the systems are. Systems that are large enough run one at a time through
//! the same code. No fused multiply-add is used, so that a lane gives the same result on every machine.

use std::ops::{Add, Mul, Sub};

/// One number, or eight of them side by side.
pub trait Lane: Copy + Default + Send + Sync + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Number of lanes.
    const COUNT: usize;

    /// One number in all lanes.
    fn splat(x: f64) -> Self;

    /// The first `COUNT` numbers of a slice.
    fn load(from: &[f64]) -> Self;

    /// A number for every lane, from a function of the lane.
    fn each(f: impl FnMut(usize) -> f64) -> Self;

    /// The lanes as a slice.
    fn lanes(&self) -> &[f64];

    /// The lanes as a mutable slice.
    fn lanes_mut(&mut self) -> &mut [f64];

    /// Applies a function lane by lane.
    fn map(self, f: impl Fn(f64) -> f64) -> Self;

    /// Applies a function of two numbers lane by lane.
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self;

    /// True if a condition holds in every lane.
    fn all(self, other: Self, holds: impl Fn(f64, f64) -> bool) -> bool;

    /// C = A B for large matrices; arguments as for [`super::dense::multiply`].
    fn multiply(c: (&mut [Self], usize), a: (&[Self], usize), b: (&[Self], usize), [rows, depth, columns]: [usize; 3]) {
        for i in 0..rows {
            let row = &mut c.0[i * c.1..][..columns];
            row.fill(Self::default());
            (0..depth).for_each(|k| add(a.0[i * a.1 + k], &b.0[k * b.1..][..columns], row));
        }
    }

    /// Runs work compiled for the widest instruction set of the machine.
    fn dispatch<R>(work: impl pulp::NullaryFnOnce<Output = R>) -> R {
        pulp::Arch::new().dispatch(work)
    }
}

impl Lane for f64 {
    const COUNT: usize = 1;

    /// Compiled for vectors of four numbers at most: here those of eight save less than a twentieth of the time of a run,
    /// and their copies of the kernels take a twentieth of the compilation of this crate.
    fn dispatch<R>(work: impl pulp::NullaryFnOnce<Output = R>) -> R {
        #[cfg(target_arch = "x86_64")]
        if let Some(simd) = pulp::x86::V3::try_new() {
            return simd.vectorize(work);
        }
        work.call()
    }

    fn multiply(c: (&mut [f64], usize), a: (&[f64], usize), b: (&[f64], usize), sizes: [usize; 3]) {
        super::dense::multiply(c, a, b, sizes);
    }

    #[inline(always)]
    fn splat(x: f64) -> f64 {
        x
    }

    #[inline(always)]
    fn load(from: &[f64]) -> f64 {
        from[0]
    }

    #[inline(always)]
    fn each(mut f: impl FnMut(usize) -> f64) -> f64 {
        f(0)
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

    #[inline(always)]
    fn all(self, other: f64, holds: impl Fn(f64, f64) -> bool) -> bool {
        holds(self, other)
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
        let eight: &[f64; 8] = from.first_chunk().unwrap_or(&[0.0; 8]);
        Eight(*eight)
    }

    #[inline(always)]
    fn each(mut f: impl FnMut(usize) -> f64) -> Eight {
        // Written out, because `from_fn` can become a separate function, compiled without the vector instructions.
        Eight([f(0), f(1), f(2), f(3), f(4), f(5), f(6), f(7)])
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
        let [a, b, c, d, e, g, h, i] = self.0;
        Eight([f(a), f(b), f(c), f(d), f(e), f(g), f(h), f(i)])
    }

    #[inline(always)]
    fn zip(self, other: Eight, f: impl Fn(f64, f64) -> f64) -> Eight {
        let (x, y) = (self.0, other.0);
        // Written out, because a loop would be unrolled again at every use, which multiplies the compile time.
        Eight([
            f(x[0], y[0]),
            f(x[1], y[1]),
            f(x[2], y[2]),
            f(x[3], y[3]),
            f(x[4], y[4]),
            f(x[5], y[5]),
            f(x[6], y[6]),
            f(x[7], y[7]),
        ])
    }

    #[inline(always)]
    fn all(self, other: Eight, holds: impl Fn(f64, f64) -> bool) -> bool {
        let (x, y) = (self.0, other.0);
        // Written out, without `&&`: one vector comparison and one test of the resulting mask.
        holds(x[0], y[0])
            & holds(x[1], y[1])
            & holds(x[2], y[2])
            & holds(x[3], y[3])
            & holds(x[4], y[4])
            & holds(x[5], y[5])
            & holds(x[6], y[6])
            & holds(x[7], y[7])
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

/// Keeps the compiler from mixing lanes; to be called within loops over [`Eight`]. Otherwise it would form vectors
/// across several of them, with gathers and scatters, which takes several times as long. Generates no instruction
/// itself.
#[inline(always)]
pub fn intact<T: Lane>() {
    if T::COUNT > 1 {
        std::sync::atomic::compiler_fence(std::sync::atomic::Ordering::Release);
    }
}

/// y -= s x.
#[inline(always)]
pub fn subtract<T: Lane>(s: T, x: &[T], y: &mut [T]) {
    for (y, x) in y.iter_mut().zip(x) {
        intact::<T>();
        *y = *y - s * *x;
    }
}

/// y += s x.
#[inline(always)]
pub fn add<T: Lane>(s: T, x: &[T], y: &mut [T]) {
    for (y, x) in y.iter_mut().zip(x) {
        intact::<T>();
        *y = *y + s * *x;
    }
}

/// a · b in every lane: four partial sums, added at the end, which shortens the chain of dependent additions.
#[inline(always)]
pub fn dot<T: Lane>(a: &[T], b: &[T]) -> T {
    let ((a4, a), (b4, b)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sums = [T::default(); 4];
    for (a, b) in a4.iter().zip(b4) {
        for k in 0..4 {
            sums[k] = sums[k] + a[k] * b[k];
        }
    }
    // Without a loop, which would become a masked one for single numbers.
    if let ([a0, ..], [b0, ..]) = (a, b) {
        sums[0] = sums[0] + *a0 * *b0;
    }
    if let ([_, a1, ..], [_, b1, ..]) = (a, b) {
        sums[1] = sums[1] + *a1 * *b1;
    }
    if let ([_, _, a2], [_, _, b2]) = (a, b) {
        sums[2] = sums[2] + *a2 * *b2;
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}
