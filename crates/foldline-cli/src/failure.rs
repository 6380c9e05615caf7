//! Outcomes of a command.

use foldline_store::diagnostic::Diagnostic;
use foldline_store::run_file::RunFileError;
use std::fmt::Display;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;

/// Result of a command that ran to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Everything requested was done.
    Done,
    /// Some branches ended short.
    Short,
    /// A run was found to be wrong.
    Wrong,
}

/// Reason why a command failed.
#[derive(Debug)]
pub enum Failure {
    /// Mistakes in files, each with its place.
    Files(Vec<Diagnostic>),
    /// A mistake on the command line or in the state of a folder; the message includes the remedy.
    Typed(String),
    /// A failure outside the program.
    Outside(String),
    /// The program that reads the output has closed it.
    NoReader,
}

impl Failure {
    /// A mistake on the command line, and its remedy.
    pub fn typed(message: impl Display, cure: impl Display) -> Failure {
        Failure::Typed(format!("{message}\n  help: {cure}"))
    }

    /// Reports the failure on standard error.
    pub fn report(self) -> ExitCode {
        let (text, code) = match self {
            Failure::Files(found) => {
                let texts: Vec<String> = found.iter().map(|d| d.to_string().trim_end().to_string()).collect();
                (texts.join("\n\n"), 2)
            }
            Failure::Typed(message) => (format!("error: {message}"), 2),
            Failure::Outside(message) => (format!("error: {message}"), 1),
            Failure::NoReader => return ExitCode::SUCCESS,
        };
        // If standard error is closed too, only the exit code can report the failure.
        let _ = writeln!(std::io::stderr(), "{text}");
        ExitCode::from(code)
    }
}

impl From<Vec<Diagnostic>> for Failure {
    fn from(found: Vec<Diagnostic>) -> Failure {
        Failure::Files(found)
    }
}

impl From<RunFileError> for Failure {
    fn from(error: RunFileError) -> Failure {
        match error {
            RunFileError::Database(..) | RunFileError::Full(_) | RunFileError::Vanished(_) => {
                Failure::Outside(error.to_string())
            }
            _ => Failure::Typed(error.to_string()),
        }
    }
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Failure {
        match error.kind() {
            ErrorKind::BrokenPipe => Failure::NoReader,
            _ => Failure::Outside(format!("cannot write the output: {error}")),
        }
    }
}
