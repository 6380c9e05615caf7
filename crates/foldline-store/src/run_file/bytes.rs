//! Numbers as little-endian bytes.

use num_complex::Complex64;

pub(super) fn pack(values: &[f64]) -> Vec<u8> {
    // Arrays of eight bytes are flattened in one copy, which is faster than appending single bytes.
    values.iter().map(|v| v.to_le_bytes()).collect::<Vec<[u8; 8]>>().into_flattened()
}

pub(super) fn pack_complex(values: &[Complex64]) -> Vec<u8> {
    pack(&values.iter().flat_map(|z| [z.re, z.im]).collect::<Vec<f64>>())
}

pub(super) fn pack_pairs(values: &[[f64; 2]]) -> Vec<u8> {
    pack(values.as_flattened())
}

/// Returns the numbers, or `None` if the length is not a multiple of 8.
pub(super) fn unpack(bytes: &[u8]) -> Option<Vec<f64>> {
    let (numbers, rest) = bytes.as_chunks::<8>();
    rest.is_empty().then(|| numbers.iter().map(|b| f64::from_le_bytes(*b)).collect())
}

pub(super) fn unpack_pairs(bytes: &[u8]) -> Option<Vec<[f64; 2]>> {
    let numbers = unpack(bytes)?;
    let (pairs, rest) = numbers.as_chunks::<2>();
    rest.is_empty().then(|| pairs.to_vec())
}

pub(super) fn unpack_complex(bytes: &[u8]) -> Option<Vec<Complex64>> {
    Some(unpack_pairs(bytes)?.into_iter().map(|[re, im]| Complex64::new(re, im)).collect())
}

/// Checksum of numbers and bytes. For each word, h ← (h xor word) · 0x100000001b3, then h ← h xor (h >> 32), starting
/// from h = 0xcbf29ce484222325. Bytes are grouped into little-endian 8-byte words, the last one padded with zeros.
#[derive(Clone, Copy)]
pub(super) struct Checksum(u64);

impl Checksum {
    pub(super) fn new() -> Checksum {
        Checksum(0xcbf2_9ce4_8422_2325)
    }

    pub(super) fn word(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x0100_0000_01b3);
        self.0 ^= self.0 >> 32;
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        let (words, rest) = bytes.as_chunks::<8>();
        words.iter().for_each(|word| self.word(u64::from_le_bytes(*word)));
        if !rest.is_empty() {
            let mut last = [0; 8];
            last[..rest.len()].copy_from_slice(rest);
            self.word(u64::from_le_bytes(last));
        }
    }

    /// Value as stored by SQLite, a signed integer.
    pub(super) fn value(self) -> i64 {
        self.0 as i64
    }
}

/// Checksum of study and model, in hexadecimal digits.
pub(super) fn texts_checksum(study: &str, model: &str) -> String {
    let mut sum = Checksum::new();
    sum.bytes(study.as_bytes());
    sum.bytes(model.as_bytes());
    format!("{:016x}", sum.0)
}
