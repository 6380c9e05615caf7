//! Properties that must hold for any input.
//!
//! **Idea.** Each property turns bytes into a nearly valid input: a random formula, or a model, study or AUTO-07p file
//! of this repository with a few changes. It panics if a property is violated. The tests use reproducible random bytes;
//! the fuzzer in the folder `fuzz` searches for bytes that reach new code.

pub mod edits;
pub mod formula;
pub mod reference;
pub mod simulations;
pub mod tapes;
pub mod texts;

/// Returns reproducible random bytes of the given stream.
///
/// **Source.** steele2014 (splitmix).
pub fn bytes(stream: u64, length: usize) -> Vec<u8> {
    let mut state = stream.wrapping_mul(0xd134_2543_de82_ef95);
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    (0..length.div_ceil(8)).flat_map(|_| next().to_le_bytes()).take(length).collect()
}
