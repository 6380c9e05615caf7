//! Text files: reading, and what to do where a file is not one.

use crate::diagnostic::Diagnostic;
use crate::nearest::nearest;
use crate::toml_walk::diagnose;
use std::fmt;
use std::io::{Error, ErrorKind, Read};
use std::path::Path;

/// Largest file that is read, in bytes.
const LARGEST: u64 = 64 << 20;

/// Reason why the bytes of a file are not UTF-8 text.
#[derive(Debug)]
enum NotText {
    /// Beginning of every SQLite file.
    Database,
    /// It begins with a byte order mark of UTF-16.
    Utf16,
    /// Other bytes; line and column of the first.
    Other(usize, usize),
}

impl fmt::Display for NotText {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            NotText::Database => write!(f, "it is a database, such as a run file"),
            NotText::Utf16 => write!(f, "it is text in UTF-16, not UTF-8"),
            NotText::Other(..) => write!(f, "it is not UTF-8 text"),
        }
    }
}

impl std::error::Error for NotText {}

/// Reads a text file; fails if it is longer than [`LARGEST`] or not UTF-8.
pub(crate) fn read_text(path: &Path) -> std::io::Result<String> {
    let mut bytes = Vec::new();
    std::fs::File::open(path)?.take(LARGEST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST {
        return Err(Error::other(format!("it is longer than {} MiB", LARGEST >> 20)));
    }
    String::from_utf8(bytes).map_err(|error| {
        let (valid, bytes) = (error.utf8_error().valid_up_to(), error.as_bytes());
        let utf16 = bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]);
        let why = match bytes {
            _ if bytes.starts_with(b"SQLite format 3\0") => NotText::Database,
            _ if utf16 => NotText::Utf16,
            _ => {
                let before = String::from_utf8_lossy(&bytes[..valid]);
                let last = before.rsplit('\n').next().unwrap_or("");
                NotText::Other(before.matches('\n').count() + 1, last.chars().count() + 1)
            }
        };
        Error::new(ErrorKind::InvalidData, why)
    })
}

/// Returns a diagnostic for a file that could not be read.
pub(crate) fn unreadable(file: &str, what: &str, error: &Error) -> Diagnostic {
    let path = Path::new(file);
    let at = |message: String, hint: String| diagnose(file, "", 0..0, message, hint);
    if path.is_dir() {
        return match path.join("run.sqlite").is_file() {
            true => at(
                format!("this is the folder of a run, not {}", what.replacen("the ", "a ", 1)),
                format!(
                    "print its results with `foldline table {file}`; a run that was stopped is continued with `foldline run STUDY.toml --resume`"
                ),
            ),
            false => at(format!("{what} cannot be read: this is a folder"), inside(path)),
        };
    }
    let hint = match (error.kind(), error.get_ref().and_then(|own| own.downcast_ref::<NotText>())) {
        (_, Some(NotText::Database)) => {
            let folder = path.parent().filter(|own| !own.as_os_str().is_empty()).unwrap_or(Path::new("."));
            format!("the results of a run are printed by `foldline table {}`", folder.display())
        }
        (ErrorKind::InvalidData, Some(_)) => "save the file as UTF-8 text".to_string(),
        (ErrorKind::NotFound, _) => {
            format!("check the spelling of the path; relative paths start at the current folder{}", beside(path))
        }
        (ErrorKind::PermissionDenied, _) => "make the file readable, or run as a user who may read it".to_string(),
        _ => "check that the path names a readable text file".to_string(),
    };
    let mut found = at(format!("{what} cannot be read: {error}"), hint);
    if let Some(NotText::Other(line, column)) = error.get_ref().and_then(|own| own.downcast_ref::<NotText>()) {
        (found.line, found.column) = (*line, *column);
    }
    found
}

/// `; did you mean FILE?` if a file of a similar name lies in the same folder.
pub(crate) fn beside(path: &Path) -> String {
    let similar = || {
        let names = texts(path.parent()?);
        let name = nearest(path.file_name()?.to_str()?, names.iter().map(String::as_str))?;
        Some(format!("; did you mean `{}`?", path.with_file_name(name).display()))
    };
    similar().unwrap_or_default()
}

/// Hint for a folder given in place of a file.
fn inside(folder: &Path) -> String {
    match &texts(folder)[..] {
        [] => "give a file; `foldline new oscillator` writes a model and a study".to_string(),
        [first, ..] => format!("give a file in it, such as {}", folder.join(first).display()),
    }
}

/// Names of the TOML files in a folder, sorted.
fn texts(folder: &Path) -> Vec<String> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let names = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = names.filter_map(|entry| entry.file_name().into_string().ok());
    let mut names: Vec<String> = names.filter(|name| name.ends_with(".toml")).collect();
    names.sort();
    names
}
