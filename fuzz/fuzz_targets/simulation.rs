//! Simulations of random models.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    // Too few bytes give no model.
    let mut seen = foldline_fuzz::simulations::Seen::default();
    let _ = foldline_fuzz::simulations::simulation(&mut arbitrary::Unstructured::new(data), &mut seen);
});
