//! What must hold for any input.
//!
//! **Idea.** Each property takes bytes and makes of them an input that is nearly right: a formula, a model file, a study
//! file or a file of AUTO-07p of this repository in which a few things were changed. It panics where something does not hold. The tests call it
//! with the same random bytes every time; the fuzzer, in the folder `fuzz`, searches for bytes that reach new code.

pub mod edits;
pub mod formula;
pub mod reference;
pub mod simulations;
pub mod tapes;
pub mod texts;

/// Bytes that are the same every time; `stream` says which.
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
