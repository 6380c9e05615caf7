//! Python environments under `target/tools`, with packages of fixed versions.

use crate::{root, run};
use std::path::PathBuf;
use std::process::Command;

/// Creates the environment `name` unless it has exactly these packages, and returns the folder of its programs. `None`
/// if Python or the packages are not available.
pub fn ready(name: &str, packages: &[&str]) -> Option<PathBuf> {
    let folder = root().join("target/tools").join(name);
    let programs = folder.join(if cfg!(windows) { "Scripts" } else { "bin" });
    let complete = folder.join("complete");
    let wanted = packages.join("\n");
    if std::fs::read_to_string(&complete).is_ok_and(|there| there == wanted) {
        return Some(programs);
    }
    // Removes an environment with other packages.
    let _ = std::fs::remove_dir_all(&folder);
    let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    let made = run(Command::new("python3").args(["-m", "venv"]).arg(&folder))
        && run(Command::new(programs.join("python")).args(install).args(packages));
    if !made {
        return None;
    }
    let noted = std::fs::write(&complete, wanted).inspect_err(|error| eprintln!("{}: {error}", complete.display()));
    noted.is_ok().then_some(programs)
}
