//! Mistakes on the command line that the parser of arguments reports, with what to write instead.

use crate::failure::Failure;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use foldline_store::study_file::is_study;
use std::path::Path;
use std::process::ExitCode;

/// Words for a command, and what to write.
const COMMANDS: [(&[&str], &str); 8] = [
    (&["continue", "continuation", "follow", "solve", "compute", "start", "rn", "exec"], "`foldline run STUDY.toml`"),
    (&["sweep", "survey"], "a [[sweep]] or [[survey]] in a study, computed by `foldline run STUDY.toml`"),
    (&["integrate", "simulation", "sim", "trajectory", "ode"], "`foldline simulate MODEL.toml`"),
    (&["init", "create", "template", "example", "examples"], "`foldline new`, which lists the templates"),
    (&["show", "open", "serve", "gui", "browse", "explorer"], "`foldline view`"),
    (&["results", "print", "list", "ls", "points"], "`foldline table runs/NAME`"),
    (&["draw", "picture", "diagram", "figure"], "`foldline plot runs/NAME -o FILE.svg`"),
    (&["version"], "`foldline --version`"),
];

/// Reports a mistake in the arguments, or prints the help or version that was asked for.
pub fn report(mut error: clap::Error) -> ExitCode {
    if let Some(failure) = command(&error) {
        return failure.report();
    }
    // The advice to pass `-o` as a value is of no use: no command takes arbitrary values.
    if error.kind() == ErrorKind::UnknownArgument {
        error.remove(ContextKind::Suggested);
    }
    // If the output is closed, only the exit code remains.
    let _ = error.print();
    ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2))
}

/// A word in place of the command: a file, or the name that another program gives a command.
fn command(error: &clap::Error) -> Option<Failure> {
    let (ErrorKind::InvalidSubcommand, Some(ContextValue::String(word))) =
        (error.kind(), error.get(ContextKind::InvalidSubcommand))
    else {
        return None;
    };
    let file = Path::new(word);
    if file.join("run.sqlite").is_file() {
        let cure = format!("`foldline table {word}` prints its results, `foldline plot {word} -o FILE.svg` draws them");
        return Some(Failure::typed(format!("the command is missing; {word} is the folder of a run"), cure));
    }
    if let Ok(text) = std::fs::read_to_string(file) {
        let (kind, cure) = match is_study(&text) {
            true => ("study", format!("`foldline run {word}`")),
            false => ("model", format!("`foldline check {word}`, or `foldline explore {word} --free NAME=LOW:HIGH`")),
        };
        return Some(Failure::typed(
            format!("the command is missing; {word} is a {kind} file"),
            format!("write {cure}"),
        ));
    }
    let (_, instead) = COMMANDS.iter().find(|(words, _)| words.contains(&word.as_str()))?;
    Some(Failure::typed(
        format!("there is no command `{word}`"),
        format!("write {instead}; `foldline --help` lists the commands"),
    ))
}
