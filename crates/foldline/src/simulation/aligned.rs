//! Arrays aligned to cache lines.
//!
//! **Idea.** A vector of eight numbers within one cache line takes one load, across two lines two. The allocator does
//! not align to cache lines, so a few extra numbers are allocated and those before the first line boundary are skipped.

use std::ops::{Deref, DerefMut};

/// Bytes and numbers in a cache line.
const LINE: usize = 64;
const NUMBERS: usize = LINE / size_of::<f64>();

/// Array of numbers that can be shortened. (A clone is not necessarily aligned.)
#[derive(Clone, Debug, Default)]
pub(super) struct Aligned {
    numbers: Vec<f64>,
    first: usize,
    count: usize,
}

impl Aligned {
    /// Array of `count` zeros.
    pub(super) fn zeros(count: usize) -> Aligned {
        let numbers = vec![0.0; count + NUMBERS];
        let first = numbers.as_ptr().align_offset(LINE).min(NUMBERS);
        Aligned { numbers, first, count }
    }

    /// Keeps the first `count`.
    pub(super) fn truncate(&mut self, count: usize) {
        self.count = self.count.min(count);
    }
}

impl Deref for Aligned {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.numbers[self.first..][..self.count]
    }
}

impl DerefMut for Aligned {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.numbers[self.first..][..self.count]
    }
}
