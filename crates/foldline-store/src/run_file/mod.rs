//! Run file: all results of a run, in one SQLite database that survives a kill of the process.
//!
//! **Idea.** `DIR/run.sqlite` holds the study and the model verbatim, the settings, and every accepted point, special
//! point and ending, written as soon as it is accepted. Each is one statement and therefore one transaction. If the
//! process is killed at any moment, the file holds a prefix of the run, and [`Recorder::resume`] continues from it.
//! Only one thread writes at a time; the others queue their points for it (docs/decisions/0026-queued-writes.md).
//!
//! * The write-ahead log lets other programs read during the run. With `synchronous = NORMAL` nothing is lost if the
//!   process is killed; a power failure can lose the last points but cannot make the file inconsistent.
//! * Each number is stored twice: as REAL in a column that Python, R or a shell can read, and as little-endian bytes in
//!   a BLOB. Only the BLOB is exact to the bit: REAL columns lose NaN and the sign of zero.
//! * The tables are described in docs/book/run-file.md. `PRAGMA user_version` is [`FORMAT_VERSION`].

mod bytes;
mod cells;
mod designs;
mod halt;
mod meta;
mod reader;
mod responses;
mod revised;
mod rows;
mod schema;
mod stream;
mod view;
mod writer;

pub use halt::{ask_to_stop, forget_stop, is_asked_to_stop};
pub use reader::{Part, Reading, Recorded, load, load_part};
pub use revised::{could_resume, shorten};
pub(crate) use schema::{Columns, free_name};
pub use stream::Extent;
pub use view::{Span, is_written};
pub use writer::Recorder;

use std::fmt;
use std::path::{Path, PathBuf};

/// Version of the format written here. Files of a newer version are rejected. The version is raised by any change that
/// older readers would misunderstand.
pub const FORMAT_VERSION: i64 = 11;

/// Application id that marks an SQLite file as a run file ("fold" in ASCII).
pub const APPLICATION_ID: i64 = 0x666f_6c64;

/// Returns the path of the run file in a folder.
pub fn path_in(folder: &Path) -> PathBuf {
    folder.join("run.sqlite")
}

/// Reason why a run file could not be created, read or continued. The message includes the cure.
#[derive(Debug)]
pub enum RunFileError {
    /// No run file in this folder.
    Missing(PathBuf),
    /// The run file already exists.
    Exists(PathBuf),
    /// The folder cannot be created or written to.
    Folder(PathBuf, std::io::Error),
    /// The file is not a run file.
    Foreign(PathBuf),
    /// The file was written by a newer version.
    Newer(PathBuf, i64),
    /// A run cannot be resumed because its study or model (named here) has changed.
    Changed(PathBuf, &'static str),
    /// A run cannot be resumed because its study has other changes than additions; the text says which.
    Different(PathBuf, String),
    /// The run is complete and cannot be resumed because some of its profiles were removed.
    Thinned(PathBuf),
    /// The file is inconsistent; the text says where.
    Damaged(PathBuf, String),
    /// Another run is writing to the file.
    Busy(PathBuf),
    /// The disk is full, or a quota is used up.
    Full(PathBuf),
    /// The file was deleted, moved or replaced while the run was writing to it.
    Vanished(PathBuf),
    /// Any other error of the database.
    Database(PathBuf, rusqlite::Error),
}

impl RunFileError {
    /// Converts an SQLite error for the file at `path`.
    pub(crate) fn from_sqlite(path: &Path, error: rusqlite::Error) -> RunFileError {
        use rusqlite::Error::{
            FromSqlConversionFailure, IntegralValueOutOfRange, InvalidColumnType, QueryReturnedNoRows, Utf8Error,
        };
        use rusqlite::ErrorCode::{DatabaseBusy, DatabaseCorrupt, DatabaseLocked, DiskFull, NotADatabase};
        let path = path.to_path_buf();
        let unlike_written = matches!(
            error,
            FromSqlConversionFailure(..)
                | IntegralValueOutOfRange(..)
                | InvalidColumnType(..)
                | QueryReturnedNoRows
                | Utf8Error(..)
        );
        match error.sqlite_error_code() {
            _ if unlike_written => RunFileError::Damaged(path, format!("its contents are inconsistent ({error})")),
            Some(DatabaseCorrupt | NotADatabase) => RunFileError::Damaged(path, format!("SQLite finds {error}")),
            Some(DiskFull) => RunFileError::Full(path),
            Some(DatabaseBusy | DatabaseLocked) => RunFileError::Busy(path),
            _ => RunFileError::Database(path, error),
        }
    }
}

impl fmt::Display for RunFileError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            RunFileError::Missing(path) => {
                let folder = path.parent().unwrap_or(path);
                if folder.is_file() {
                    let stem = folder.file_stem().unwrap_or_default().to_string_lossy();
                    return write!(
                        f,
                        "{} is a file, not the folder of a run\n  help: a run of this study lies in runs/{stem}, unless `--out` \
                         named another folder; `foldline run` and `foldline explore` write such folders",
                        folder.display()
                    );
                }
                write!(
                    f,
                    "there is no run file {}\n  help: give the folder of a run, as written by `foldline run` \
                           or `foldline explore`, such as runs/study",
                    path.display()
                )
            }
            RunFileError::Exists(path) => write!(
                f,
                "{} already exists\n  help: continue this run with `--resume`, or write elsewhere with `--out DIR`",
                path.display()
            ),
            RunFileError::Folder(path, error) => write!(
                f,
                "cannot write to the folder {}: {error}\n  help: choose a writable folder with `--out DIR`",
                path.display()
            ),
            RunFileError::Foreign(path) => write!(
                f,
                "{} is not a foldline run file\n  help: move it away, or write elsewhere with `--out DIR`",
                path.display()
            ),
            RunFileError::Newer(path, version) => write!(
                f,
                "{} has format {version}, but this foldline reads formats up to {FORMAT_VERSION}\n  help: use a \
                 newer foldline",
                path.display()
            ),
            RunFileError::Thinned(path) => write!(
                f,
                "{} is complete and keeps only part of its profiles (`store` in the study), so it cannot be \
                 resumed\n  help: start a new run with `--out DIR`",
                path.display()
            ),
            RunFileError::Changed(path, what) => write!(
                f,
                "the {what} has changed since the run in {} began\n  help: start a new run with `--out DIR`, or restore the \
                 {what} (the old text is in the table `meta`)",
                path.display()
            ),
            RunFileError::Different(path, why) => write!(
                f,
                "the study has changed since the run in {} began: {why}\n  help: a run can go on with a study that has \
                 more at its end, or more in `switch`; otherwise start a new run with `--out DIR`, or restore the study \
                 (the old text is in the table `meta`)",
                path.display()
            ),
            RunFileError::Damaged(path, what) => {
                write!(
                    f,
                    "{path} is damaged: {what}\n  help: restore it from a backup, or start a new run with `--out \
                     DIR`; `sqlite3 {path} .recover` shows what can still be read",
                    path = path.display()
                )
            }
            RunFileError::Busy(path) => write!(
                f,
                "another run is writing to {}\n  help: wait until it has finished, or write elsewhere with `--out DIR`",
                path.display()
            ),
            RunFileError::Full(path) => write!(
                f,
                "no space left to write {}\n  help: all points accepted so far are stored; free some space and \
                 continue with `--resume`",
                path.display()
            ),
            RunFileError::Vanished(path) => write!(
                f,
                "{} was deleted, moved or replaced while the run was writing to it; the run has stopped\n  help: do \
                 not touch the folder during a run; if it was moved, continue there with `--resume --out DIR`",
                path.display()
            ),
            RunFileError::Database(path, error) => write!(
                f,
                "{}: {error}\n  help: check permissions, quotas and the disk; all points accepted so far are stored, \
                 and `--resume` continues the run",
                path.display()
            ),
        }
    }
}

impl std::error::Error for RunFileError {}
