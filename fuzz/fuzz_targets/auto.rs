//! Arbitrary text as a solution file of AUTO-07p.
#![no_main]

use foldline_fuzz::texts::{AUTO_MODEL, solution_file};

libfuzzer_sys::fuzz_target!(|text: &str| {
    let model = foldline_store::model_file::parse_model(AUTO_MODEL, "m.toml").expect("the model is right");
    solution_file(text, &model);
});
