//! Conversion of numbers to and from bytes in native byte order.

use num_complex::Complex64;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// Writes numbers straight into the memory of a Python object.
pub fn numbers<'py>(py: Python<'py>, values: impl ExactSizeIterator<Item = f64>) -> PyResult<Bound<'py, PyBytes>> {
    filled(py, values.len(), values.map(f64::to_ne_bytes))
}

/// Writes `count` numbers straight into the memory of a Python object.
pub fn counted<'py>(py: Python<'py>, count: usize, values: impl Iterator<Item = f64>) -> PyResult<Bound<'py, PyBytes>> {
    filled(py, count, values.map(f64::to_ne_bytes))
}

/// Writes whole numbers.
pub fn integers<'py>(py: Python<'py>, values: impl ExactSizeIterator<Item = i64>) -> PyResult<Bound<'py, PyBytes>> {
    filled(py, values.len(), values.map(i64::to_ne_bytes))
}

fn filled(py: Python<'_>, count: usize, words: impl Iterator<Item = [u8; 8]>) -> PyResult<Bound<'_, PyBytes>> {
    PyBytes::new_with(py, 8 * count, |buffer| {
        for (slot, word) in buffer.as_chunks_mut::<8>().0.iter_mut().zip(words) {
            *slot = word;
        }
        Ok(())
    })
}

/// Real and imaginary parts, alternating.
pub fn parts(values: &[Complex64]) -> impl Iterator<Item = f64> {
    values.iter().flat_map(|z| [z.re, z.im])
}

/// Numbers in a NumPy array passed as bytes; trailing bytes that do not fill a number are ignored.
pub fn read(bytes: &[u8]) -> Vec<f64> {
    bytes.as_chunks::<8>().0.iter().map(|word| f64::from_ne_bytes(*word)).collect()
}
