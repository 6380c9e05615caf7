//! Surveys, sweeps and censuses of random models.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    // Bytes that end too early make no model.
    let mut seen = foldline_fuzz::simulations::Seen::default();
    let _ = foldline_fuzz::simulations::simulation(&mut arbitrary::Unstructured::new(data), &mut seen);
});
