//! Numbers as little-endian bytes.

use num_complex::Complex64;

pub(super) fn pack(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

pub(super) fn pack_complex(values: &[Complex64]) -> Vec<u8> {
    values.iter().flat_map(|z| [z.re, z.im]).flat_map(f64::to_le_bytes).collect()
}

pub(super) fn pack_pairs(values: &[[f64; 2]]) -> Vec<u8> {
    pack(values.as_flattened())
}

/// The numbers, or `None` if the length is no multiple of 8.
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
