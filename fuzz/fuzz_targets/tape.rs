//! Random models against a plain evaluation of their formulas.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    // Bytes that end too early make no model.
    let _ = foldline_fuzz::tapes::tape(&mut arbitrary::Unstructured::new(data));
});
