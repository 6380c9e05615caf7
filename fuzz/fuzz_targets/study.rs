//! Arbitrary text as a study file of a small model.
#![no_main]

const MODEL: &str = include_str!("../../models/overhung-rotor.toml");

libfuzzer_sys::fuzz_target!(|text: &str| {
    foldline_fuzz::texts::study(text, MODEL);
});
