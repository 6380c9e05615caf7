//! Global heaps, which store texts and lists of references; these have no fixed length and are referred to by pointers.
//!
//! **Source.** hdfgroup2024, section III.E (global heap).

use super::Id;

/// Largest number of objects in a heap; their indices have 16 bits.
const MOST: usize = 4096;
const LEAST_SIZE: u64 = 4096;
const HEAD: u64 = 16;

/// Object in a heap.
pub(super) enum Lying {
    Text(Vec<u8>),
    Reference(Id),
}

impl Lying {
    fn size(&self) -> usize {
        match self {
            Lying::Text(bytes) => bytes.len(),
            Lying::Reference(_) => 8,
        }
    }
}

/// Position of an object: heap, and index within the heap, from 1. `None` for an empty text.
pub(super) type Place = Option<(usize, u32)>;

#[derive(Default)]
pub(super) struct Heaps {
    heaps: Vec<Vec<Lying>>,
}

impl Heaps {
    pub(super) fn lay(&mut self, what: Lying) -> Place {
        if what.size() == 0 {
            return None;
        }
        if self.heaps.last().is_none_or(|heap| heap.len() == MOST) {
            self.heaps.push(Vec::new());
        }
        let last = self.heaps.len() - 1;
        self.heaps[last].push(what);
        Some((last, self.heaps[last].len() as u32))
    }

    pub(super) fn count(&self) -> usize {
        self.heaps.len()
    }

    /// Size of a heap in bytes.
    pub(super) fn size(&self, heap: usize) -> u64 {
        let objects: u64 = self.heaps[heap].iter().map(|what| HEAD + padded(what.size())).sum();
        // The free space at its end is an object too, with a header.
        (2 * HEAD + objects).max(LEAST_SIZE)
    }

    /// Returns the pointer to an object: its length in units of `unit` bytes, the address of its heap, and its index.
    pub(super) fn pointer(&self, place: Place, unit: usize, addresses: &[u64]) -> [u8; 16] {
        let mut out = [0; 16];
        if let Some((heap, number)) = place {
            let length = self.heaps[heap][number as usize - 1].size() / unit;
            out[..4].copy_from_slice(&(length as u32).to_le_bytes());
            out[4..12].copy_from_slice(&addresses.get(heap).copied().unwrap_or(0).to_le_bytes());
            out[12..].copy_from_slice(&number.to_le_bytes());
        }
        out
    }

    /// Returns the bytes of a heap, given the addresses of the objects of the file.
    pub(super) fn bytes(&self, heap: usize, address_of: &dyn Fn(Id) -> u64) -> Vec<u8> {
        let size = self.size(heap);
        let mut out = b"GCOL\x01\0\0\0".to_vec();
        out.extend(size.to_le_bytes());
        for (k, what) in self.heaps[heap].iter().enumerate() {
            out.extend((k as u16 + 1).to_le_bytes());
            out.extend([1, 0, 0, 0, 0, 0]);
            out.extend((what.size() as u64).to_le_bytes());
            match what {
                Lying::Text(bytes) => out.extend(bytes),
                Lying::Reference(id) => out.extend(address_of(*id).to_le_bytes()),
            }
            out.resize(out.len().next_multiple_of(8), 0);
        }
        let free = size - out.len() as u64;
        out.extend([0; 8]);
        out.extend(free.to_le_bytes());
        out.resize(size as usize, 0);
        out
    }
}

fn padded(size: usize) -> u64 {
    size.next_multiple_of(8) as u64
}
