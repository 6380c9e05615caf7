//! `cargo xtask test | check | bench | docs`.
fn main() {}
