//! Folders of the benchmarks and numbers of repetitions.

use crate::Outcome;
use std::path::{Path, PathBuf};

/// Part of the report.
pub type Part = fn(&Workplace) -> Outcome<String>;

/// Folders and repetitions.
pub struct Workplace {
    /// Root of the repository.
    pub root: PathBuf,
    /// True for fewer repetitions.
    pub quick: bool,
}

impl Workplace {
    /// Returns the workplace in the repository from which this program was built.
    pub fn new(quick: bool) -> Outcome<Workplace> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize()?;
        Ok(Workplace { root, quick })
    }

    /// Returns the number of repetitions of a short measurement.
    pub fn repetitions(&self) -> usize {
        if self.quick { 3 } else { 9 }
    }

    /// Creates an empty folder for temporary files.
    pub fn scratch(&self, name: &str) -> Outcome<PathBuf> {
        let folder = self.root.join("target/bench").join(name);
        match std::fs::remove_dir_all(&folder) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error.into()),
            _ => {}
        }
        std::fs::create_dir_all(&folder)?;
        Ok(folder)
    }

    /// Returns the path of the command `foldline`, which `cargo xtask bench` builds first.
    pub fn foldline(&self) -> PathBuf {
        self.root.join("target/release/foldline")
    }

    /// Returns the path of a study of the repository.
    pub fn study(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }
}
