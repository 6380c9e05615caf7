//! Checksum of HDF5 metadata.
//!
//! **Source.** jenkins2006 (hash of a byte string with initial value 0); hdfgroup2024, section VIII.

/// Returns the checksum of `bytes`.
pub(super) fn lookup3(bytes: &[u8]) -> u32 {
    let start = 0xdead_beef_u32.wrapping_add(bytes.len() as u32);
    let mut state = [start; 3];
    let mut rest = bytes;
    while rest.len() > 12 {
        add(&mut state, &rest[..12]);
        mix(&mut state);
        rest = &rest[12..];
    }
    if !rest.is_empty() {
        let mut last = [0; 12];
        last[..rest.len()].copy_from_slice(rest);
        add(&mut state, &last);
        finish(&mut state);
    }
    state[2]
}

fn add(state: &mut [u32; 3], block: &[u8]) {
    for (word, bytes) in state.iter_mut().zip(block.as_chunks::<4>().0) {
        *word = word.wrapping_add(u32::from_le_bytes(*bytes));
    }
}

fn mix(state: &mut [u32; 3]) {
    for (k, turn) in [4, 6, 8, 16, 19, 4].into_iter().enumerate() {
        let [a, b, c] = [k % 3, (k + 1) % 3, (k + 2) % 3];
        state[a] = state[a].wrapping_sub(state[c]) ^ state[c].rotate_left(turn);
        state[c] = state[c].wrapping_add(state[b]);
    }
}

fn finish(state: &mut [u32; 3]) {
    for (k, turn) in [14, 11, 25, 16, 4, 14, 24].into_iter().enumerate() {
        let [c, b] = [(k + 2) % 3, (k + 1) % 3];
        state[c] = (state[c] ^ state[b]).wrapping_sub(state[b].rotate_left(turn));
    }
}

#[cfg(test)]
mod tests {
    use super::lookup3;

    /// Values published by the author of the hash.
    #[test]
    fn known_values() {
        assert_eq!(lookup3(b""), 0xdead_beef);
        assert_eq!(lookup3(b"Four score and seven years ago"), 0x1777_0551);
    }
}
