//! Reading of a run that may be growing, a few rows at a time.
//!
//! **Idea.** A viewer asks again and again for new points. It opens the file for each question and closes it at once,
//! because a reader that stays connected prevents the log of the run from being merged into the file. Positions on a
//! branch are contiguous, so that their first and last values, two look-ups in an index, determine its points.

use super::bytes::unpack_pairs;
use super::reader::{special_in, special_order};
use super::rows::point_in;
use super::schema::{Columns, quoted};
use super::writer::THINNED;
use super::{Reading, RunFileError};
use foldline::diagram::{Point, SpecialPoint};
use foldline::model::Model;
use foldline::special::quantity::Quantity;
use rusqlite::{Row, params};
use std::fs::File;
use std::path::Path;

/// Branch of a growing run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Span {
    /// Number of the branch in the file.
    pub number: i64,
    /// Name of the branch.
    pub name: String,
    /// First and last position; `None` without points.
    pub reach: Option<[i64; 2]>,
}

/// True if a run in this folder is being written.
///
/// On a file system without locks, no run counts as being written.
pub fn is_written(folder: &Path) -> bool {
    let Ok(file) = File::open(folder.join("run.lock")) else { return false };
    matches!(file.try_lock_shared(), Err(std::fs::TryLockError::WouldBlock))
}

impl Reading {
    /// Returns the branches in the order in which they were begun, with the positions that are stored.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn spans(&self) -> Result<Vec<Span>, RunFileError> {
        let failed = |error| RunFileError::from_sqlite(&self.path, error);
        let sql = "SELECT branch, name, (SELECT min(position) FROM points WHERE points.branch = branches.branch),
             (SELECT max(position) FROM points WHERE points.branch = branches.branch) FROM branches ORDER BY branch";
        let mut statement = self.connection.prepare_cached(sql).map_err(failed)?;
        let span = |row: &Row| {
            let ends: [Option<i64>; 2] = [row.get(2)?, row.get(3)?];
            let reach = ends[0].zip(ends[1]).map(|(low, high)| [low, high]);
            Ok(Span { number: row.get(0)?, name: row.get(1)?, reach })
        };
        statement.query_map([], span).and_then(Iterator::collect).map_err(failed)
    }

    /// Passes position, number of unstable eigenvalues or multipliers, and the values of `quantities` at each point of
    /// a branch with a position in `reach`, in increasing order. Values that do not exist are NaN. SQLite reads them from
    /// the index of diagrams, which is a hundredth of the file; files of earlier versions have none.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn each_value(
        &self,
        branch: i64,
        reach: [i64; 2],
        quantities: &[Quantity],
        model: &Model,
        mut take: impl FnMut(i64, i64, &[f64]),
    ) -> Result<(), RunFileError> {
        let failed = |error| RunFileError::from_sqlite(&self.path, error);
        let columns = Columns::new(model);
        let column = |quantity: &Quantity| match *quantity {
            Quantity::Parameter(k) => columns.parameters.get(k).map(|name| quoted(name)),
            Quantity::Smallest(k) => columns.ranges.get(2 * k).map(|name| quoted(name)),
            Quantity::Largest(k) => columns.ranges.get(2 * k + 1).map(|name| quoted(name)),
            Quantity::Period => Some("period".to_string()),
            _ => None,
        };
        let version: i64 =
            self.connection.pragma_query_value(None, "user_version", |row| row.get(0)).map_err(failed)?;
        // Formats before 7 have no averages.
        let averages = version >= 7 && quantities.iter().any(|quantity| column(quantity).is_none());
        let mut names = vec!["position".to_string(), "unstable".to_string()];
        names.push(if averages { "average_bytes" } else { "NULL" }.to_string());
        names.extend(quantities.iter().map(|quantity| column(quantity).unwrap_or_else(|| "period".to_string())));
        let sql = format!(
            "SELECT {} FROM points WHERE branch = ?1 AND position BETWEEN ?2 AND ?3 ORDER BY position",
            names.join(", ")
        );
        let of_average: Vec<bool> = quantities.iter().map(|quantity| column(quantity).is_none()).collect();
        let mut statement = self.connection.prepare_cached(&sql).map_err(failed)?;
        let mut rows = statement.query(params![branch, reach[0], reach[1]]).map_err(failed)?;
        let mut values = vec![0.0; quantities.len()];
        while let Some(row) = rows.next().map_err(failed)? {
            let bytes: Option<Vec<u8>> = row.get(2).map_err(failed)?;
            let averages = bytes.as_deref().and_then(unpack_pairs).unwrap_or_default();
            for (k, value) in values.iter_mut().enumerate() {
                let stored: Option<f64> = row.get(k + 3).map_err(failed)?;
                let found = if of_average[k] { average(quantities[k], &averages, stored) } else { stored };
                *value = found.unwrap_or(f64::NAN);
            }
            take(row.get(0).map_err(failed)?, row.get(1).map_err(failed)?, &values);
        }
        Ok(())
    }

    /// Passes each complete point of a branch with a position in `reach`, in increasing order.
    ///
    /// # Errors
    /// If the file cannot be read or a point is damaged.
    pub fn each_point_in(
        &self,
        branch: i64,
        reach: [i64; 2],
        mut take: impl FnMut(&Point),
    ) -> Result<(), RunFileError> {
        let failed = |error| RunFileError::from_sqlite(&self.path, error);
        let sql = "SELECT * FROM points WHERE branch = ?1 AND position BETWEEN ?2 AND ?3 ORDER BY position";
        let mut statement = self.connection.prepare_cached(sql).map_err(failed)?;
        let mut rows = statement.query(params![branch, reach[0], reach[1]]).map_err(failed)?;
        while let Some(row) = rows.next().map_err(failed)? {
            let (point, _) = point_in(row).map_err(|what| RunFileError::Damaged(self.path.clone(), what))?;
            take(&point);
        }
        Ok(())
    }

    /// Passes each complete special point of a branch with its index, in the order in which branches list them.
    ///
    /// # Errors
    /// If the file cannot be read or a point is damaged.
    pub fn each_special_point(
        &self,
        branch: i64,
        mut take: impl FnMut(usize, &SpecialPoint),
    ) -> Result<(), RunFileError> {
        let failed = |error| RunFileError::from_sqlite(&self.path, error);
        let sql = format!("SELECT * FROM special_points WHERE branch = ?1 ORDER BY {}", special_order());
        let mut statement = self.connection.prepare_cached(&sql).map_err(failed)?;
        let mut rows = statement.query([branch]).map_err(failed)?;
        let mut index = 0;
        while let Some(row) = rows.next().map_err(failed)? {
            take(index, &special_in(row).map_err(|what| RunFileError::Damaged(self.path.clone(), what))?);
            index += 1;
        }
        Ok(())
    }

    /// Returns a complete point; `None` if there is none at this position.
    ///
    /// # Errors
    /// If the file cannot be read or the point is damaged.
    pub fn point(&self, branch: i64, position: i64) -> Result<Option<Point>, RunFileError> {
        let sql = "SELECT * FROM points WHERE branch = ?1 AND position = ?2";
        self.one(sql, [branch, position], |row| Ok(point_in(row)?.0))
    }

    /// Returns a complete special point by its index on the branch, in the order in which branches list them.
    ///
    /// # Errors
    /// If the file cannot be read or the point is damaged.
    pub fn special_point(&self, branch: i64, index: i64) -> Result<Option<SpecialPoint>, RunFileError> {
        let sql = format!(
            "SELECT * FROM special_points WHERE branch = ?1 ORDER BY {} LIMIT 1 OFFSET max(?2, 0)",
            special_order()
        );
        self.one(&sql, [branch, index], special_in)
    }

    /// True if part of the profiles was removed after the run was complete.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn is_thinned(&self) -> Result<bool, RunFileError> {
        let sql = "SELECT count(*) FROM meta WHERE key = ?";
        let count: Result<i64, _> = self.connection.query_row(sql, [THINNED], |row| row.get(0));
        count.map(|count| count > 0).map_err(|error| RunFileError::from_sqlite(&self.path, error))
    }

    fn one<T>(
        &self,
        sql: &str,
        key: [i64; 2],
        convert: impl Fn(&Row) -> Result<T, String>,
    ) -> Result<Option<T>, RunFileError> {
        let failed = |error| RunFileError::from_sqlite(&self.path, error);
        let mut statement = self.connection.prepare_cached(sql).map_err(failed)?;
        let mut rows = statement.query(key).map_err(failed)?;
        let Some(row) = rows.next().map_err(failed)? else { return Ok(None) };
        convert(row).map(Some).map_err(|what| RunFileError::Damaged(self.path.clone(), what))
    }
}

/// Value of a quantity that follows from the averages `[mean, mean square]` of states and outputs, and the period.
fn average(quantity: Quantity, averages: &[[f64; 2]], period: Option<f64>) -> Option<f64> {
    let root = |square: f64| square.max(0.0).sqrt();
    match quantity {
        Quantity::Mean(k) => averages.get(k).map(|own| own[0]),
        Quantity::Rms(k) => averages.get(k).map(|own| root(own[1])),
        Quantity::Integral(k) => averages.get(k).zip(period).map(|(own, period)| own[0] * period),
        Quantity::Frequency => period.map(|period| 1.0 / period),
        Quantity::Norm(n) => {
            averages.get(..n).filter(|own| !own.is_empty()).map(|own| root(own.iter().map(|a| a[1]).sum()))
        }
        _ => None,
    }
}
