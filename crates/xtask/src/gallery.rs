//! Gallery: runs every example again and updates table, picture, run time and counts on its page.

use crate::{cargo_path, root, run};
use std::process::Command;

/// Updates the pages in docs/gallery with a release build on one thread.
pub fn renew() -> bool {
    let test = ["test", "--release", "--quiet", "--package", "foldline-cli", "--test", "all", "gallery::"];
    eprintln!("renewing {}", root().join("docs/gallery").display());
    run(Command::new(cargo_path()).args(test).env("FOLDLINE_WRITE_BOOK", "1"))
}
