//! The command `foldline`.
fn main() {}
