//! Verbosity of the reports on standard error.

use std::io::{Result, Write, stderr};
use std::sync::OnceLock;

/// Verbosity of the reports on standard error. Standard output does not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Verbosity {
    /// Errors and incomplete results.
    Quiet,
    /// Also progress, notes and files written.
    #[default]
    Normal,
    /// Also special points as they are found, and the causes and cures of early ends.
    Verbose,
}

static CHOSEN: OnceLock<Verbosity> = OnceLock::new();

/// Sets the verbosity of the process. Only the first call has an effect.
pub fn choose(quiet: bool, verbose: bool) {
    let chosen = match (quiet, verbose) {
        (true, _) => Verbosity::Quiet,
        (false, true) => Verbosity::Verbose,
        (false, false) => Verbosity::Normal,
    };
    let _ = CHOSEN.set(chosen);
}

/// The verbosity of the process.
pub fn verbosity() -> Verbosity {
    CHOSEN.get().copied().unwrap_or_default()
}

/// Writes a line to standard error unless the command is quiet.
///
/// # Errors
/// Those of standard error.
pub fn report(line: impl std::fmt::Display) -> Result<()> {
    match verbosity() {
        Verbosity::Quiet => Ok(()),
        // In one piece, so that lines of two processes, as of `foldline view` and its run, do not mix.
        Verbosity::Normal | Verbosity::Verbose => stderr().write_all(format!("{line}\n").as_bytes()),
    }
}
