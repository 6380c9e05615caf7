//! Runs whose study was lengthened, or shortened again.
//!
//! **Idea.** A longer study replaces the one before, which stays in `meta` under `study 1`, `study 2`, … Removing the
//! last requests of a study removes their results. Nothing else in the file changes.

use super::meta::description;
use super::reader::{Open, open};
use super::writer::{THINNED, lock};
use super::{RunFileError, path_in};
use crate::study_file::{Added, Study, added, parse_study_of_run};
use rusqlite::{Connection, Transaction, params};
use std::path::Path;

/// Text of an entry of `meta`.
pub(super) fn text(connection: &Connection, path: &Path, key: &str) -> Result<String, RunFileError> {
    let found = connection.query_row("SELECT value FROM meta WHERE key = ?", [key], |row| row.get(0));
    found.map_err(|error| RunFileError::from_sqlite(path, error))
}

/// Study with which a run was computed.
fn stored(connection: &Connection, path: &Path) -> Result<Study, RunFileError> {
    let [study, file, model, model_file] =
        ["study", "study_file", "model", "model_file"].map(|key| text(connection, path, key));
    parse_study_of_run(&study?, &file?, &model?, &model_file?)
        .map_err(|_| RunFileError::Changed(path.to_path_buf(), "study"))
}

/// Checks that a run can go on with `study`, and records it if it is longer.
pub(super) fn lengthen(connection: &mut Connection, path: &Path, study: &Study) -> Result<(), RunFileError> {
    if text(connection, path, "study")? == study.text {
        return Ok(());
    }
    let before = stored(connection, path)?;
    added(&before, study).map_err(|why| RunFileError::Different(path.to_path_buf(), why))?;
    let failed = |error| RunFileError::from_sqlite(path, error);
    let transaction = connection.transaction().map_err(failed)?;
    let earlier: i64 = transaction
        .query_row("SELECT count(*) FROM meta WHERE key GLOB 'study [0-9]*'", [], |row| row.get(0))
        .map_err(failed)?;
    transaction
        .execute("INSERT INTO meta VALUES (?, ?)", params![format!("study {}", earlier + 1), before.text])
        .map_err(failed)?;
    record(&transaction, study).map_err(failed)?;
    transaction.commit().map_err(failed)
}

/// Writes the text and the seeds of a study; the scales stay those with which the run began.
fn record(transaction: &Transaction, study: &Study) -> rusqlite::Result<()> {
    let scales: Option<serde_json::Value> = transaction
        .query_row("SELECT value FROM meta WHERE key = 'settings'", [], |row| row.get::<_, String>(0))
        .ok()
        .and_then(|text| serde_json::from_str::<serde_json::Value>(&text).ok())
        .and_then(|settings| settings.get("state_scales").cloned());
    for (key, value) in description(study) {
        let value = match key {
            "study" | "study_file" | "texts_checksum" => value,
            "settings" => match (serde_json::from_str::<serde_json::Value>(&value), &scales) {
                (Ok(mut settings), Some(scales)) => {
                    settings["state_scales"] = scales.clone();
                    settings.to_string()
                }
                _ => value,
            },
            _ => continue,
        };
        transaction.execute("INSERT OR REPLACE INTO meta VALUES (?, ?)", params![key, value])?;
    }
    Ok(())
}

/// Scales of the states with which a run began; `None` if the file has none.
pub(super) fn scales(connection: &Connection, study: &Study) -> Option<Vec<f64>> {
    let settings: String =
        connection.query_row("SELECT value FROM meta WHERE key = 'settings'", [], |row| row.get(0)).ok()?;
    let settings: serde_json::Value = serde_json::from_str(&settings).ok()?;
    let scales = settings.get("state_scales")?;
    study.model.states.iter().map(|state| scales.get(&state.name)?.as_f64()).collect()
}

/// Checks whether a run could go on with `study`, without changing the run. Returns the requests that the study adds.
///
/// # Errors
/// If the file cannot be read, or if the run could not go on with the study; the error then states the reason.
pub fn could_resume(folder: &Path, study: &Study) -> Result<Added, RunFileError> {
    let path = path_in(folder);
    let connection = run(&path, false)?;
    if text(&connection, &path, "model")? != study.model_text {
        return Err(RunFileError::Changed(path, "model"));
    }
    unthinned(&connection, &path)?;
    added(&stored(&connection, &path)?, study).map_err(|why| RunFileError::Different(path, why))
}

/// Removes the results of everything that the study of a run requests beyond `study`, and records `study` as its own.
/// Returns the number of branches, surveys and sweeps removed.
///
/// # Errors
/// If the run is being written or the file cannot be changed, or `study` is not the beginning of the study of the run.
pub fn shorten(folder: &Path, study: &Study) -> Result<usize, RunFileError> {
    let path = path_in(folder);
    let failed = |error| RunFileError::from_sqlite(&path, error);
    let mut connection = run(&path, true)?;
    let _lock = lock(folder)?;
    if text(&connection, &path, "model")? != study.model_text {
        return Err(RunFileError::Changed(path, "model"));
    }
    unthinned(&connection, &path)?;
    let before = stored(&connection, &path)?;
    let gone = added(study, &before).map_err(|why| RunFileError::Different(path.clone(), why))?;
    let transaction = connection.transaction().map_err(failed)?;
    let count = remove(&transaction, &gone, study).map_err(failed)?;
    let latest = "DELETE FROM meta WHERE key GLOB 'study [0-9]*' AND value = ?";
    transaction.execute(latest, [&study.text]).map_err(failed)?;
    record(&transaction, study).map_err(failed)?;
    transaction.commit().map_err(failed)?;
    Ok(count)
}

fn remove(transaction: &Transaction, gone: &Added, study: &Study) -> rusqlite::Result<usize> {
    let named = |table: &str, number: &str| {
        let mut statement = transaction.prepare(&format!("SELECT {number}, name FROM {table}"))?;
        let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?;
        let all = rows.collect::<rusqlite::Result<Vec<(i64, String)>>>()?;
        Ok::<_, rusqlite::Error>(all.into_iter().filter(|(_, name)| gone.has(name, &study.plan)).collect::<Vec<_>>())
    };
    let exists = |table: &str| {
        let sql = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = ?";
        transaction.query_row(sql, [table], |row| row.get::<_, i64>(0)).map(|count| count > 0)
    };
    let branches = named("branches", "branch")?;
    let mut tables = vec!["points", "special_points", "ends"];
    if exists("held_quantities")? {
        tables.push("held_quantities");
    }
    for (number, name) in &branches {
        for table in tables.iter().chain(&["branches"]) {
            transaction.execute(&format!("DELETE FROM {table} WHERE branch = ?"), [number])?;
        }
        transaction.execute("DELETE FROM notes WHERE branch = ?", [name])?;
    }
    let sets = if exists("response_sets")? { named("response_sets", "response_set")? } else { Vec::new() };
    for (number, name) in &sets {
        for table in ["responses", "response_sets"] {
            transaction.execute(&format!("DELETE FROM {table} WHERE response_set = ?"), [number])?;
        }
        transaction.execute("DELETE FROM notes WHERE branch = ?", [name])?;
    }
    let designs = if exists("designs")? { named("designs", "design")? } else { Vec::new() };
    for (number, name) in &designs {
        transaction.execute("DELETE FROM designs WHERE design = ?", [number])?;
        transaction.execute("DELETE FROM notes WHERE branch = ?", [name])?;
    }
    if exists("shortfalls")? {
        for (_, name) in branches.iter().chain(&sets).chain(&designs) {
            transaction.execute("DELETE FROM shortfalls WHERE about = ?", [name])?;
        }
    }
    Ok(branches.len() + sets.len())
}

fn run(path: &Path, write: bool) -> Result<Connection, RunFileError> {
    if !path.exists() {
        return Err(RunFileError::Missing(path.to_path_buf()));
    }
    match open(path, write)? {
        Open::Run(connection) => Ok(connection),
        Open::Empty => Err(RunFileError::Missing(path.to_path_buf())),
    }
}

fn unthinned(connection: &Connection, path: &Path) -> Result<(), RunFileError> {
    let count = connection.query_row("SELECT count(*) FROM meta WHERE key = ?", [THINNED], |row| row.get::<_, i64>(0));
    match count {
        Ok(0) => Ok(()),
        Ok(_) => Err(RunFileError::Thinned(path.to_path_buf())),
        Err(error) => Err(RunFileError::from_sqlite(path, error)),
    }
}
