//! Reader of run files.

use super::bytes::texts_checksum;
use super::rows::{ending_in, held_in, kind_named, origin_in, point_in};
use super::{APPLICATION_ID, FORMAT_VERSION, RunFileError, path_in};
use foldline::diagram::{Branch, Diagram, Family, Point, Shortfall, SpecialPoint};
use rusqlite::{Connection, OpenFlags, Row};
use std::path::{Path, PathBuf};

/// Contents of a run file.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// Path of the file.
    pub path: PathBuf,
    /// Name of the study file.
    pub study_file: String,
    /// Verbatim text of the study.
    pub study_text: String,
    /// Name of the model file.
    pub model_file: String,
    /// Verbatim text of the model.
    pub model_text: String,
    /// Diagram, with branches in the order in which they were begun.
    pub diagram: Diagram,
    /// Notes: name of the branch, and text.
    pub notes: Vec<(String, String)>,
}

/// Part of a run that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Everything.
    Everything,
    /// Points and special points without states, profiles, meshes and tangents, which are left empty. Enough for tables
    /// and diagrams.
    Numbers,
    /// Special points and ends of branches, without points; states, profiles, meshes and tangents are left empty.
    Special,
}

/// Light columns of every point; special points also have [`OF_SPECIAL`].
const NUMBERS: &str = "position, degree, unstable, newton, factorisations, rejected, parameter_bytes, spectrum_bytes, \
     range_bytes, scalar_bytes";
/// Light columns since format 3.
const LATER_NUMBERS: &str = ", evaluations, linearisations";
/// Light columns since format 4.
const CHECKED_NUMBERS: &str = ", numbers_checksum";
/// Light columns since format 6.
const FORCED_NUMBERS: &str = ", forcing_periods";
/// Light columns since format 9.
const SLOPES: &str = ", slope_error";
/// Light columns since format 7.
const AVERAGES: &str = ", average_bytes";
/// Light columns since format 10.
const GAINS: &str = ", gain_bytes";
const OF_SPECIAL: &str = "kind, unstable_before, unstable_after";
/// Columns of special points since format 8.
const COEFFICIENT_ERRORS: &str = ", coefficient_count, normal_form_remark";

/// Reads the run in `folder`, which may still be in progress.
pub fn load(folder: &Path) -> Result<Recorded, RunFileError> {
    load_part(folder, Part::Everything)
}

/// Reads the requested part of the run in `folder`. The database is checked only if everything is read.
pub fn load_part(folder: &Path, part: Part) -> Result<Recorded, RunFileError> {
    let reading = Reading::open(folder)?;
    if part == Part::Everything {
        sound(&reading.connection, &reading.path)?;
    }
    reading.recorded(part)
}

/// Snapshot of a run file, which may still be growing.
pub struct Reading {
    pub(super) connection: Connection,
    pub(super) path: PathBuf,
}

impl Reading {
    /// Opens the run in `folder`.
    ///
    /// # Errors
    /// If there is no run, or it cannot be read.
    pub fn open(folder: &Path) -> Result<Reading, RunFileError> {
        let path = path_in(folder);
        if !path.exists() {
            return Err(RunFileError::Missing(path));
        }
        let connection = match open(&path, false)? {
            Open::Run(connection) => connection,
            Open::Empty => return Err(RunFileError::Damaged(path, "it is empty".to_string())),
        };
        // One read transaction, so that all reads see the same state of a growing file.
        connection.execute_batch("BEGIN").map_err(|e| RunFileError::from_sqlite(&path, e))?;
        Ok(Reading { connection, path })
    }

    /// Returns the requested part of the run.
    ///
    /// # Errors
    /// If the file cannot be read or is inconsistent.
    pub fn recorded(&self, part: Part) -> Result<Recorded, RunFileError> {
        let Reading { connection, path } = self;
        let failed = |e| RunFileError::from_sqlite(path, e);
        let text = |key: &str| -> Result<String, RunFileError> {
            connection.query_row("SELECT value FROM meta WHERE key = ?", [key], |row| row.get(0)).map_err(failed)
        };
        // Formats before 4 have no such entry.
        if let Ok(stated) = text("texts_checksum")
            && stated != texts_checksum(&text("study")?, &text("model")?)
        {
            let what = "study and model do not have their checksum".to_string();
            return Err(RunFileError::Damaged(path.clone(), what));
        }
        let notes = {
            let mut statement = connection.prepare("SELECT branch, note FROM notes ORDER BY rowid").map_err(failed)?;
            let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).map_err(failed)?;
            rows.collect::<Result<_, _>>().map_err(failed)?
        };
        Ok(Recorded {
            study_file: text("study_file")?,
            study_text: text("study")?,
            model_file: text("model_file")?,
            model_text: text("model")?,
            diagram: load_diagram(connection, path, part)?,
            notes,
            path: path.clone(),
        })
    }
}

/// Opened file.
pub(super) enum Open {
    /// Empty database: the run was killed before its first transaction.
    Empty,
    /// Run file.
    Run(Connection),
}

/// Opens a file and checks that it is a run file of a known version.
pub(super) fn open(path: &Path, write: bool) -> Result<Open, RunFileError> {
    let failed = |e| RunFileError::from_sqlite(path, e);
    let foreign = || RunFileError::Foreign(path.to_path_buf());
    let access = if write { OpenFlags::SQLITE_OPEN_READ_WRITE } else { OpenFlags::SQLITE_OPEN_READ_ONLY };
    let number =
        |connection: &Connection, name: &str| connection.pragma_query_value(None, name, |row| row.get::<_, i64>(0));
    let plain = Connection::open_with_flags(path, access | OpenFlags::SQLITE_OPEN_NO_MUTEX).map_err(failed)?;
    let connection = match number(&plain, "application_id") {
        Ok(_) => plain,
        Err(error) if error.sqlite_error_code() == Some(rusqlite::ErrorCode::NotADatabase) => return Err(foreign()),
        Err(error) if error.sqlite_error_code() == Some(rusqlite::ErrorCode::DatabaseCorrupt) => {
            return Err(failed(error));
        }
        // In a read-only folder the write-ahead log cannot be opened, but the file itself can.
        Err(error) if write => return Err(failed(error)),
        Err(error) => immutable(path).ok_or_else(|| failed(error))?,
    };
    let version = number(&connection, "user_version").map_err(failed)?;
    match number(&connection, "application_id").map_err(failed)? {
        APPLICATION_ID if version > FORMAT_VERSION => Err(RunFileError::Newer(path.to_path_buf(), version)),
        APPLICATION_ID => Ok(Open::Run(connection)),
        _ if is_empty(&connection).map_err(failed)? => Ok(Open::Empty),
        _ => Err(foreign()),
    }
}

/// Checks the integrity of the database: its pages, and that every row has its index entries.
pub(super) fn sound(connection: &Connection, path: &Path) -> Result<(), RunFileError> {
    let found: Result<String, _> = connection.query_row("PRAGMA integrity_check(1)", [], |row| row.get(0));
    match found.map_err(|error| RunFileError::from_sqlite(path, error))?.as_str() {
        "ok" => Ok(()),
        what => Err(RunFileError::Damaged(path.to_path_buf(), format!("SQLite finds {}", what.replace('\n', " ")))),
    }
}

fn immutable(path: &Path) -> Option<Connection> {
    let escaped = path.to_str()?.replace('%', "%25").replace('?', "%3f").replace('#', "%23");
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
    let connection = Connection::open_with_flags(format!("file:{escaped}?immutable=1"), flags).ok()?;
    connection.pragma_query_value(None, "application_id", |_| Ok(())).ok().map(|()| connection)
}

fn is_empty(connection: &Connection) -> rusqlite::Result<bool> {
    connection.query_row("SELECT count(*) = 0 FROM sqlite_master", [], |row| row.get(0))
}

/// Loads the diagram: branches with the requested part of their points, responses, and shortfalls.
pub(super) fn load_diagram(connection: &Connection, path: &Path, part: Part) -> Result<Diagram, RunFileError> {
    let (of_points, of_special) = match part {
        Part::Everything => ("*".to_string(), "*".to_string()),
        Part::Numbers | Part::Special => {
            let version: i64 = connection
                .pragma_query_value(None, "user_version", |row| row.get(0))
                .map_err(|error| RunFileError::from_sqlite(path, error))?;
            let since = |format: i64, own: &'static str| if version < format { "" } else { own };
            let later = [
                since(3, LATER_NUMBERS),
                since(4, CHECKED_NUMBERS),
                since(6, FORCED_NUMBERS),
                since(7, AVERAGES),
                since(9, SLOPES),
                since(10, GAINS),
            ]
            .concat();
            let numbers = format!("{NUMBERS}{later}");
            (numbers.clone(), format!("{numbers}, {OF_SPECIAL}{}", since(8, COEFFICIENT_ERRORS)))
        }
    };
    let mut diagram = Diagram::default();
    let branches = read(connection, path, "SELECT * FROM branches ORDER BY branch", &[], |row| {
        let number: i64 = row.get("branch").map_err(|e| e.to_string())?;
        Ok((number, branch_in(row)?))
    })?;
    let held =
        read(connection, path, "SELECT name FROM sqlite_master WHERE name = 'held_quantities'", &[], |_| Ok(()))?;
    for (number, mut branch) in branches {
        if !held.is_empty() {
            let sql = "SELECT parameter, name, value_bytes FROM held_quantities WHERE branch = ?1 ORDER BY rowid";
            let rows = read(connection, path, sql, &[number], |row| {
                let parameter: Option<i64> = row.get("parameter").map_err(|e| e.to_string())?;
                let name: String = row.get("name").map_err(|e| e.to_string())?;
                Ok((parameter, name, super::rows::single(row, "value_bytes")?))
            })?;
            for (parameter, name, value) in rows {
                match parameter.map(usize::try_from) {
                    Some(Ok(index)) => branch.also.push((index, value)),
                    _ => branch.levels.push((name, value)),
                }
            }
        }
        let of_branch = |columns: &str, table: &str, order: &str| {
            format!("SELECT {columns} FROM {table} WHERE branch = ?1 ORDER BY {order}")
        };
        if part != Part::Special {
            let sql = of_branch(&of_points, "points", "position");
            branch.points = read(connection, path, &sql, &[number], |row| Ok(point_in(row)?.0))?;
            if let Some(pair) = branch.points.windows(2).find(|pair| pair[1].position != pair[0].position + 1) {
                let what = format!("branch {} has no point at position {}", branch.name, pair[0].position + 1);
                return Err(RunFileError::Damaged(path.to_path_buf(), what));
            }
        }
        // In the order of a branch: on the backward side, the special point found first comes last.
        let sql = of_branch(&of_special, "special_points", special_order());
        branch.special = read(connection, path, &sql, &[number], special_in)?;
        let ends = read(connection, path, &of_branch("*", "ends", "side"), &[number], |row| {
            let side: i64 = row.get("side").map_err(|e| e.to_string())?;
            Ok((side, ending_in(row)?))
        })?;
        for (side, ending) in ends {
            let slot = usize::try_from(side).ok().and_then(|s| branch.ends.get_mut(s));
            let damaged = || RunFileError::Damaged(path.to_path_buf(), format!("ends: there is no side {side}"));
            *slot.ok_or_else(damaged)? = Some(ending);
        }
        diagram.branches.push(branch);
    }
    diagram.responses = super::responses::load(connection, path)?;
    diagram.designs = super::designs::load(connection, path)?;
    diagram.cells = super::cells::load(connection, path)?;
    diagram.shortfalls = shortfalls(connection, path)?;
    Ok(diagram)
}

/// Order of the special points of a branch.
pub(super) fn special_order() -> &'static str {
    "position, CASE WHEN position < 0 THEN -rowid ELSE rowid END"
}

/// Loads the requests that were not fulfilled; files of earlier versions have none.
fn shortfalls(connection: &Connection, path: &Path) -> Result<Vec<Shortfall>, RunFileError> {
    let sql = "SELECT name FROM sqlite_master WHERE type = 'table' AND name = 'shortfalls'";
    if read(connection, path, sql, &[], |_| Ok(()))?.is_empty() {
        return Ok(Vec::new());
    }
    let text = |row: &Row, name: &str| row.get::<_, String>(name).map_err(|e| e.to_string());
    read(connection, path, "SELECT about, what FROM shortfalls ORDER BY about, what", &[], |row| {
        Ok(Shortfall { about: text(row, "about")?, what: text(row, "what")? })
    })
}

/// Loads one complete point.
pub(super) fn point_at(connection: &Connection, branch: i64, position: i64) -> Option<Point> {
    let mut statement = connection.prepare_cached("SELECT * FROM points WHERE branch = ?1 AND position = ?2").ok()?;
    statement.query_row([branch, position], |row| Ok(point_in(row).ok())).ok()?.map(|found| found.0)
}

fn branch_in(row: &Row) -> Result<Branch, String> {
    let family = match row.get::<_, String>("family").map_err(|e| e.to_string())?.as_str() {
        "equilibrium" => Family::Equilibrium,
        "cycle" => Family::Cycle,
        "arc" => Family::Arc,
        "torus" => Family::Torus,
        other => return Err(format!("unknown family \"{other}\"")),
    };
    let name: String = row.get("name").map_err(|e| e.to_string())?;
    let free: i64 = row.get("free").map_err(|e| e.to_string())?;
    let free = usize::try_from(free).map_err(|e| e.to_string())?;
    // Formats before 9 have no units.
    let units = ["held_unit", "unit"].map(|name| row.get(name).unwrap_or(1.0));
    Ok(Branch { held: held_in(row)?, units, ..Branch::new(name, family, free, origin_in(row)?) })
}

pub(super) fn special_in(row: &Row) -> Result<SpecialPoint, String> {
    let (point, extra) = point_in(row)?;
    let count = |name: &str| {
        row.get::<_, i64>(name)
            .ok()
            .and_then(|n| usize::try_from(n).ok())
            .ok_or_else(|| format!("{name} is not a count"))
    };
    // Formats before 8 have coefficients without errors.
    let later = |name: &str| match row.get::<_, Option<i64>>(name) {
        Err(rusqlite::Error::InvalidColumnName(_)) => Ok(None),
        other => other.map_err(|e| e.to_string()),
    };
    let (error, numbers) = extra.split_first().ok_or("scalar_bytes lacks the error")?;
    let stated = later("coefficient_count")?.map_or(Ok(numbers.len()), usize::try_from).map_err(|e| e.to_string())?;
    let (coefficients, errors) =
        numbers.split_at_checked(stated).ok_or("scalar_bytes has fewer coefficients than coefficient_count says")?;
    let remark = match row.get::<_, Option<String>>("normal_form_remark") {
        Err(rusqlite::Error::InvalidColumnName(_)) => None,
        other => other.map_err(|e| e.to_string())?,
    };
    Ok(SpecialPoint {
        kind: kind_named(&row.get::<_, String>("kind").map_err(|e| e.to_string())?)?,
        point,
        unstable_before: count("unstable_before")?,
        unstable_after: count("unstable_after")?,
        error: *error,
        coefficients: coefficients.to_vec(),
        coefficient_errors: errors.to_vec(),
        remark: remark.unwrap_or_default(),
    })
}

fn read<T>(
    connection: &Connection,
    path: &Path,
    sql: &str,
    parameters: &[i64],
    mut convert: impl FnMut(&Row) -> Result<T, String>,
) -> Result<Vec<T>, RunFileError> {
    let failed = |e| RunFileError::from_sqlite(path, e);
    let mut statement = connection.prepare_cached(sql).map_err(failed)?;
    let mut rows = statement.query(rusqlite::params_from_iter(parameters)).map_err(failed)?;
    let mut found = Vec::new();
    while let Some(row) = rows.next().map_err(failed)? {
        found.push(convert(row).map_err(|what| RunFileError::Damaged(path.to_path_buf(), what))?);
    }
    Ok(found)
}
