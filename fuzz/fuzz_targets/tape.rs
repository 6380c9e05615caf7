//! Random models, compared with the reference evaluation of their formulas.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    // Too few bytes give no model.
    let _ = foldline_fuzz::tapes::tape(&mut arbitrary::Unstructured::new(data));
});
