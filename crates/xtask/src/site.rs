//! Documentation site, built by Sphinx from the pages of the repository. Nothing is compiled for it.

use crate::{environment, root, run};
use std::path::Path;
use std::process::Command;

/// Newest versions that were tested.
const PACKAGES: [&str; 5] =
    ["furo==2025.12.19", "myst-nb==1.4.0", "myst-parser==5.2.0", "numpy>=1.24", "sphinx==9.0.4"];

/// Builds the site in `target/site`; warnings are failures. The documentation of the crates is copied there if it has
/// been built.
pub fn build() -> bool {
    let Some(programs) = environment::ready("site", &PACKAGES) else {
        eprintln!("the site needs Python 3.11 or later and a package index");
        return false;
    };
    let html = root().join("target/site");
    // Removes pages that no longer exist.
    let _ = std::fs::remove_dir_all(&html);
    let sphinx = ["-m", "sphinx", "--fail-on-warning", "--keep-going", "--quiet", "--conf-dir", "docs", "."];
    if !run(Command::new(programs.join("python")).args(sphinx).arg(&html)) {
        return false;
    }
    let rust = root().join("target/doc");
    let copied = !rust.join("foldline/index.html").exists() || copy(&rust, &html.join("rust")).is_ok();
    if copied {
        println!("{}", html.join("index.html").display());
    } else {
        eprintln!("{}: cannot be copied", rust.display());
    }
    copied
}

/// Copies a folder with its contents.
fn copy(from: &Path, to: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            copy(&entry.path(), &target)?;
        } else {
            std::fs::copy(entry.path(), target)?;
        }
    }
    Ok(())
}
