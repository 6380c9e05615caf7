//! Points of a branch, read one after the other.
//!
//! **Idea.** A run of a hundred thousand points does not fit into memory with its profiles. [`Reading::extents`]
//! returns the number and size of the points without reading any profile; the points are then passed on one at a time.

use super::reader::{sound, special_in};
use super::rows::point_in;
use super::{Reading, RunFileError};
use foldline::diagram::{Point, SpecialPoint};
use rusqlite::Row;

/// Number and size of the points of a branch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extent {
    /// Number of points.
    pub points: u64,
    /// Largest number of states in a profile: Gauss points and left ends of all mesh intervals. 0 for equilibria.
    pub nodes: u64,
    /// Largest number of eigenvalues or multipliers.
    pub spectrum: u64,
}

impl Reading {
    /// Checks the integrity of the whole database.
    ///
    /// # Errors
    /// If it is damaged; the text says where.
    pub fn sound(&self) -> Result<(), RunFileError> {
        sound(&self.connection, &self.path)
    }

    /// Returns the number and size of the points and of the special points of a branch.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn extents(&self, branch: &str) -> Result<[Extent; 2], RunFileError> {
        let extent = |table: &str| {
            let sql = format!(
                "SELECT count(*), max((length(mesh_bytes) / 8 - 1) * (degree + 1)), max(length(spectrum_bytes) / 16)
                 FROM {table} JOIN branches USING (branch) WHERE name = ?"
            );
            let count = |row: &Row, k: usize| row.get::<_, Option<i64>>(k).map(|n| n.unwrap_or(0).max(0) as u64);
            let found = self.connection.query_row(&sql, [branch], |row| {
                Ok(Extent { points: count(row, 0)?, nodes: count(row, 1)?, spectrum: count(row, 2)? })
            });
            found.map_err(|error| RunFileError::from_sqlite(&self.path, error))
        };
        Ok([extent("points")?, extent("special_points")?])
    }

    /// Passes every complete point of a branch to `take`, by increasing position.
    ///
    /// # Errors
    /// Errors of `take`, or if the file cannot be read or is inconsistent.
    pub fn each_point<E: From<RunFileError>>(
        &self,
        branch: &str,
        mut take: impl FnMut(Point) -> Result<(), E>,
    ) -> Result<(), E> {
        let sql = "SELECT points.* FROM points JOIN branches USING (branch) WHERE name = ? ORDER BY position";
        let mut last = None;
        let take = |point: Point| {
            if last.is_some_and(|last| point.position != last + 1) {
                let what = format!("branch {branch} has no point before position {}", point.position);
                return Err(RunFileError::Damaged(self.path.clone(), what).into());
            }
            last = Some(point.position);
            take(point)
        };
        self.each(sql, branch, |row| Ok(point_in(row)?.0), take)
    }

    /// Passes every complete special point of a branch to `take`, by increasing position.
    ///
    /// # Errors
    /// Errors of `take`, or if the file cannot be read or is inconsistent.
    pub fn each_special<E: From<RunFileError>>(
        &self,
        branch: &str,
        take: impl FnMut(SpecialPoint) -> Result<(), E>,
    ) -> Result<(), E> {
        let sql = "SELECT special_points.* FROM special_points JOIN branches USING (branch) WHERE name = ?
             ORDER BY position, special_points.rowid";
        self.each(sql, branch, special_in, take)
    }

    fn each<T, E: From<RunFileError>>(
        &self,
        sql: &str,
        branch: &str,
        convert: impl Fn(&Row) -> Result<T, String>,
        mut take: impl FnMut(T) -> Result<(), E>,
    ) -> Result<(), E> {
        let failed = |error| RunFileError::from_sqlite(&self.path, error);
        let mut statement = self.connection.prepare_cached(sql).map_err(failed)?;
        let mut rows = statement.query([branch]).map_err(failed)?;
        while let Some(row) = rows.next().map_err(failed)? {
            take(convert(row).map_err(|what| RunFileError::Damaged(self.path.clone(), what))?)?;
        }
        Ok(())
    }
}
