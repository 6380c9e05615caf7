//! Amount of reporting on standard error.

use std::io::{Result, Write, stderr};
use std::sync::OnceLock;

/// Amount of reports on standard error. Standard output does not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Verbosity {
    /// Errors and what was not reached.
    Quiet,
    /// Progress, notes and written files too.
    #[default]
    Normal,
    /// Special points as they are found, and causes and cures of early ends, too.
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
        Verbosity::Normal | Verbosity::Verbose => writeln!(stderr(), "{line}"),
    }
}
