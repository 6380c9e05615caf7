//! Numbers that begin where a cache line does.
//!
//! **Idea.** A vector of eight numbers that lies in one line is read in one go, one across two lines in two. The allocator knows
//! nothing of lines, so a few numbers more than needed are asked for and those before the first line are left out.

use std::ops::{Deref, DerefMut};

/// Bytes of a cache line, and the numbers in it.
const LINE: usize = 64;
const NUMBERS: usize = LINE / size_of::<f64>();

/// An array of numbers that may become shorter. (A copy need not begin where a line does.)
#[derive(Clone, Debug, Default)]
pub(super) struct Aligned {
    numbers: Vec<f64>,
    first: usize,
    count: usize,
}

impl Aligned {
    /// So many zeros.
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
