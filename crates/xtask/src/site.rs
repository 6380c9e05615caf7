//! `cargo xtask site`: the documentation site, in an environment of its own under target. Nothing has to be compiled for it.

use crate::{root, run};
use std::process::Command;

const REQUIREMENTS: &str = "docs/site/requirements.txt";

/// Builds the site into target/site/html; a warning is a failure. The documentation of the Rust crates is copied there if it has been built.
pub fn build() -> bool {
    let root = root();
    let home = root.join("target/site");
    let programs = home.join(if cfg!(windows) { "environment/Scripts" } else { "environment/bin" });
    let wanted = std::fs::read_to_string(root.join(REQUIREMENTS)).unwrap_or_default();
    let stamp = home.join("environment/made-for");
    if std::fs::read_to_string(&stamp).is_ok_and(|made| made == wanted) {
        eprintln!("using {}", programs.display());
    } else {
        let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".to_string());
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r", REQUIREMENTS];
        // An environment made for other requirements.
        let _ = std::fs::remove_dir_all(home.join("environment"));
        let made = run(Command::new(python).args(["-m", "venv"]).arg(home.join("environment")))
            && run(Command::new(programs.join("python")).args(install))
            && std::fs::write(&stamp, wanted).is_ok();
        if !made {
            eprintln!("the site needs Python 3.11 or later with pip");
            return false;
        }
    }
    let html = home.join("html");
    // Pages that no longer exist.
    let _ = std::fs::remove_dir_all(&html);
    let sphinx = ["-m", "sphinx", "--builder", "html", "--fail-on-warning", "--keep-going", "--quiet", "--conf-dir", "docs", "."];
    let built = run(Command::new(programs.join("python")).args(sphinx).arg(&html));
    let rust = root.join("target/doc");
    if built && rust.join("foldline/index.html").exists() {
        if let Err(error) = copy(&rust, &html.join("rust")) {
            eprintln!("{}: {error}", rust.display());
            return false;
        }
    }
    if built {
        println!("{}", html.join("index.html").display());
    }
    built
}

/// Copies a folder with everything in it.
fn copy(from: &std::path::Path, to: &std::path::Path) -> std::io::Result<()> {
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
