//! Answers to design questions as rows.
//!
//! **Idea.** An answer is written when its question is settled. Files without the table have no answers; the table is added
//! when such a run is resumed.

use super::RunFileError;
use super::bytes::{pack, unpack};
use foldline::diagram::{Answer, Binds, Design, Kind};
use rusqlite::{Connection, Row, params};
use std::path::Path;

const TABLE: &str = "CREATE TABLE IF NOT EXISTS designs (design INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE,
    of_branch TEXT NOT NULL, free INTEGER NOT NULL, vary INTEGER NOT NULL, greatest INTEGER NOT NULL,
    wanted TEXT NOT NULL, value REAL, error REAL, at REAL, binds TEXT, kind TEXT, curve TEXT, reasons TEXT NOT NULL,
    checks TEXT NOT NULL, scalar_bytes BLOB NOT NULL);";

/// Separates sentences; it occurs in no text.
const BETWEEN: &str = "\u{1e}";

/// Creates the table if it is missing.
pub(super) fn create(connection: &Connection) -> rusqlite::Result<()> {
    connection.execute_batch(TABLE)
}

/// Writes an answer.
pub(super) fn write(connection: &Connection, design: &Design) -> rusqlite::Result<()> {
    let answer = design.answer.as_ref();
    let scalars: Vec<f64> =
        design.range.into_iter().chain(answer.into_iter().flat_map(|own| [own.value, own.error, own.at])).collect();
    let index = |index: usize| i64::try_from(index).unwrap_or(i64::MAX);
    connection
        .execute(
            "INSERT OR REPLACE INTO designs (name, of_branch, free, vary, greatest, wanted, value, error, at, binds, kind,
             curve, reasons, checks, scalar_bytes) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            params![
                design.name,
                design.of,
                index(design.free),
                index(design.vary),
                design.greatest,
                design.wanted,
                answer.map(|own| own.value),
                answer.map(|own| own.error),
                answer.map(|own| own.at),
                answer.map(|own| own.binds.name()),
                answer.map(|own| own.kind.name()),
                answer.map(|own| own.curve.clone()),
                design.reasons.join(BETWEEN),
                design.checks.join(BETWEEN),
                pack(&scalars),
            ],
        )
        .map(|_| ())
}

/// Loads all answers in the order in which they were written.
pub(super) fn load(connection: &Connection, path: &Path) -> Result<Vec<Design>, RunFileError> {
    let failed = |e| RunFileError::from_sqlite(path, e);
    let there = "SELECT count(*) > 0 FROM sqlite_master WHERE type = 'table' AND name = 'designs'";
    if !connection.query_row(there, [], |row| row.get::<_, bool>(0)).map_err(failed)? {
        return Ok(Vec::new());
    }
    let mut statement = connection.prepare("SELECT * FROM designs ORDER BY design").map_err(failed)?;
    let mut rows = statement.query([]).map_err(failed)?;
    let mut found = Vec::new();
    while let Some(row) = rows.next().map_err(failed)? {
        found.push(design_in(row).map_err(|what| RunFileError::Damaged(path.to_path_buf(), what))?);
    }
    Ok(found)
}

fn design_in(row: &Row) -> Result<Design, String> {
    let text = |name: &str| row.get::<_, String>(name).map_err(|e| e.to_string());
    let index = |name: &str| {
        let value = row.get::<_, i64>(name).map_err(|e| e.to_string())?;
        usize::try_from(value).map_err(|_| format!("{name} is not an index"))
    };
    let sentences = |name: &str| -> Result<Vec<String>, String> {
        let all = text(name)?;
        Ok(if all.is_empty() { Vec::new() } else { all.split(BETWEEN).map(str::to_string).collect() })
    };
    let bytes = row.get::<_, Vec<u8>>("scalar_bytes").map_err(|e| e.to_string())?;
    let scalars = unpack(&bytes).ok_or("scalar_bytes has a length that is not a multiple of 8")?;
    let (range, answer) = match scalars[..] {
        [low, high] => ([low, high], None),
        [low, high, value, error, at] => {
            let (binds, kind) = (text("binds")?, text("kind")?);
            let answer = Answer {
                value,
                error,
                at,
                binds: Binds::from_name(&binds).ok_or_else(|| format!("unknown position \"{binds}\""))?,
                kind: Kind::from_name(&kind).ok_or_else(|| format!("unknown kind \"{kind}\""))?,
                curve: text("curve")?,
            };
            ([low, high], Some(answer))
        }
        _ => return Err("scalar_bytes of a design question has neither two nor five numbers".into()),
    };
    Ok(Design {
        name: text("name")?,
        of: text("of_branch")?,
        free: index("free")?,
        vary: index("vary")?,
        range,
        greatest: row.get("greatest").map_err(|e| e.to_string())?,
        wanted: text("wanted")?,
        answer,
        reasons: sentences("reasons")?,
        checks: sentences("checks")?,
    })
}
