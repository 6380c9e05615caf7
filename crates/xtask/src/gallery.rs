//! The gallery: every example is run again, and its page gets the new table, picture, run time and counts.

use crate::{cargo_path, root, run};
use std::process::Command;

/// Renews the pages in docs/gallery, in a release build, on one thread.
pub fn renew() -> bool {
    let test = ["test", "--release", "--quiet", "--package", "foldline-cli", "--test", "gallery"];
    eprintln!("renewing {}", root().join("docs/gallery").display());
    run(Command::new(cargo_path()).args(test).env("FOLDLINE_WRITE_BOOK", "1"))
}
