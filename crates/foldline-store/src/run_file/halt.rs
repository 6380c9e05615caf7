//! Requests to a run in progress to stop, from another process.
//!
//! **Idea.** The request is an empty file beside the run file, so that neither signals nor the process number are
//! needed. The run removes the file when it begins and when it stops.

use std::path::{Path, PathBuf};

fn request(folder: &Path) -> PathBuf {
    folder.join("run.stop")
}

/// Asks the run in a folder to stop at its next point.
///
/// # Errors
/// If the folder cannot be written to.
pub fn ask_to_stop(folder: &Path) -> std::io::Result<()> {
    std::fs::write(request(folder), "")
}

/// True if the run in a folder is asked to stop.
pub fn is_asked_to_stop(folder: &Path) -> bool {
    request(folder).exists()
}

/// Removes a request to stop, if there is one.
pub fn forget_stop(folder: &Path) {
    let _ = std::fs::remove_file(request(folder));
}
