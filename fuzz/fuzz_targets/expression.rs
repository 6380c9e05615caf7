//! Arbitrary text as an expression.
#![no_main]

libfuzzer_sys::fuzz_target!(|text: &str| {
    foldline_fuzz::texts::expression(text);
});
