//! Where things lie and how often they are measured.

use crate::Outcome;
use std::path::{Path, PathBuf};

/// A part of the report.
pub type Part = fn(&Workplace) -> Outcome<String>;

/// Folders and repetitions.
pub struct Workplace {
    /// The root of the repository.
    pub root: PathBuf,
    /// Fewer repetitions.
    pub quick: bool,
}

impl Workplace {
    /// The repository from which this program was built.
    pub fn new(quick: bool) -> Outcome<Workplace> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize()?;
        Ok(Workplace { root, quick })
    }

    /// How often something short is repeated.
    pub fn repetitions(&self) -> usize {
        if self.quick { 3 } else { 9 }
    }

    /// A folder for passing files, empty.
    pub fn scratch(&self, name: &str) -> Outcome<PathBuf> {
        let folder = self.root.join("target/bench").join(name);
        match std::fs::remove_dir_all(&folder) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error.into()),
            _ => {}
        }
        std::fs::create_dir_all(&folder)?;
        Ok(folder)
    }

    /// The command `foldline`, which `cargo xtask bench` builds first.
    pub fn foldline(&self) -> PathBuf {
        self.root.join("target/release/foldline")
    }

    /// A study of the repository.
    pub fn study(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }
}
