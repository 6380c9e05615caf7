//! Columns of numbers as one binary message.
//!
//! **Idea.** Length of the header in bytes (u32), zero (u32), header (JSON, padded with spaces to a multiple of eight),
//! then one column of float64 after the other, all little-endian. A browser reads each column in place.

use serde_json::Value;

/// Returns the message. The header should state the number of rows of each column.
pub(crate) fn frame(header: &Value, columns: &[Vec<f64>]) -> Vec<u8> {
    let mut text = header.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(8), b' ');
    let mut out = Vec::with_capacity(8 + text.len() + columns.iter().map(|column| 8 * column.len()).sum::<usize>());
    out.extend((text.len() as u32).to_le_bytes());
    out.extend([0; 4]);
    out.extend(text);
    columns.iter().flatten().for_each(|value| out.extend(value.to_le_bytes()));
    out
}
