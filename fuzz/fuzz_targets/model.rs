//! Arbitrary text as a model file.
#![no_main]

libfuzzer_sys::fuzz_target!(|text: &str| {
    foldline_fuzz::texts::model(text);
});
