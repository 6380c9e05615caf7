//! The run file: everything a run has found, in one SQLite database that survives being killed.
//!
//! **Idea.** `DIR/run.sqlite` holds the study and the model verbatim, the settings, and every accepted point, special point
//! and ending at the moment it is accepted. Each is one statement, hence one transaction: after a kill at any instant the
//! file holds a prefix of the run, and [`Recorder::resume`] goes on from it. Of several threads one writes at a time, and the
//! others leave it their points (docs/decisions/0026-queued-writes.md).
//!
//! * Write-ahead log, so that others can read while the run goes on; `synchronous = NORMAL`, which loses nothing when the
//!   process is killed and at most the last points, never the consistency, when the power fails.
//! * Each number stands there twice: as REAL in a column that Python, R or a shell can read, and as little-endian bytes in a
//!   BLOB, from which the round trip is exact to the bit (REAL columns lose NaN and the sign of zero).
//! * The tables are described in docs/book/run-file.md. `PRAGMA user_version` is [`FORMAT_VERSION`].

mod bytes;
mod meta;
mod reader;
mod responses;
mod rows;
mod schema;
mod stream;
mod writer;

pub use reader::{Part, Reading, Recorded, load, load_part};
pub(crate) use schema::{Columns, free_name};
pub use stream::Extent;
pub use writer::Recorder;

use std::fmt;
use std::path::{Path, PathBuf};

/// The version of the format written here. A file of a newer version is refused; a change that older readers would
/// misunderstand raises it.
pub const FORMAT_VERSION: i64 = 10;

/// Marks an SQLite file as a run file ("fold" in ASCII).
pub const APPLICATION_ID: i64 = 0x666f_6c64;

/// The path of the run file in a folder.
pub fn path_in(folder: &Path) -> PathBuf {
    folder.join("run.sqlite")
}

/// Why a run file could not be made, read or continued. The message says what to do about it.
#[derive(Debug)]
pub enum RunFileError {
    /// There is no run file in this folder.
    Missing(PathBuf),
    /// There is one already.
    Exists(PathBuf),
    /// The folder cannot be made or written to.
    Folder(PathBuf, std::io::Error),
    /// The file is something else.
    Foreign(PathBuf),
    /// The file was written by a newer version.
    Newer(PathBuf, i64),
    /// A run cannot be resumed because its study or model (named here) has changed.
    Changed(PathBuf, &'static str),
    /// The run is complete and its profiles have been removed, from which it would go on.
    Thinned(PathBuf),
    /// The file contradicts itself; the sentence says where.
    Damaged(PathBuf, String),
    /// Another run is writing there.
    Busy(PathBuf),
    /// There is no space left, or a quota is used up.
    Full(PathBuf),
    /// The file was deleted, moved or replaced while the run was writing to it.
    Vanished(PathBuf),
    /// The database refused.
    Database(PathBuf, rusqlite::Error),
}

impl RunFileError {
    /// What SQLite answered about the file at `path`, in terms of what happened to it.
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
                write!(
                    f,
                    "there is no run file {}\n  help: give the folder of a run, as written by `foldline run` \
                           or `foldline explore`",
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
