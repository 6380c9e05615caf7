//! Writer of a run in progress.

use super::bytes::pack;
use super::meta::{description, variables};
use super::reader::{Open, Part, load_diagram, open, point_at, sound};
use super::revised::{lengthen, scales, text};
use super::rows::{OF_PARAMETER, end_row, held_values, key_of, origin_values, point_row, special_row};
use super::schema::{Columns, create, index, insertion, upgrade};
use super::{APPLICATION_ID, FORMAT_VERSION, RunFileError, path_in, responses};
use crate::study_file::{Store, Study};
use foldline::contract::{Event, Observer, Verdict};
use foldline::diagram::{Branch, Diagram, Ending, Point};
use rusqlite::types::Value;
use rusqlite::{Connection, params, params_from_iter};
use std::collections::{HashMap, VecDeque};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{self, Mutex, MutexGuard, PoisonError};

/// Observer that writes all events to the run file.
///
/// Threads rarely wait for each other. A thread that finds another one writing leaves its points to that thread and
/// continues, unless sixteen points and special points of its branch are already queued or being written. When no call
/// of [`Observer::observe`] is in progress, everything observed is in the file.
///
/// If writing fails, for example because the disk is full, every branch is asked to stop; [`Recorder::finish`] then
/// returns the reason.
pub struct Recorder {
    path: PathBuf,
    /// Lock file, held as long as the run writes.
    _lock: Option<File>,
    insert_point: String,
    insert_special: String,
    insert_response: String,
    /// Number of named columns: parameters and extremes.
    shown: usize,
    store: Store,
    /// Scales of the states with which the run began.
    scales: Option<Vec<f64>>,
    /// Number in the table `branches` of each branch that has begun.
    numbers: Mutex<HashMap<String, i64>>,
    /// True if [`State::failure`] is set. Can be read without waiting for the writing thread.
    failed: AtomicBool,
    /// Queue of points and special points for the next writer, in order; the first may be in progress. Only the holder
    /// of the lock on `state` removes entries. Lock order: after `state`, or alone.
    waiting: Mutex<VecDeque<Row>>,
    state: Mutex<State>,
}

/// Point or special point in the queue.
struct Row {
    branch: i64,
    special: bool,
    values: Vec<Value>,
}

/// Largest number of queued rows of a branch for which its thread does not wait: about as many points as are computed
/// during a checkpoint of the log, usually a few milliseconds.
const AHEAD: usize = 16;

struct State {
    connection: Connection,
    /// File at the path when the run began, and below it the number of events recorded.
    file: Option<Identity>,
    events: usize,
    failure: Option<RunFileError>,
}

/// Page size in bytes. A profile fills several pages of SQLite's default size; with larger pages, a transaction
/// rewrites more unchanged data.
const PAGE: i64 = 8192;

/// Size of the log in bytes at which it is checkpointed; it still fits into the processor's cache.
const LOG: i64 = 4 << 20;

/// Number of attempts, and the pause between them, to get hold of a file that a viewer may be reading.
const TRIES: usize = 20;
const PAUSE: std::time::Duration = std::time::Duration::from_millis(10);

/// Number of events between two checks that the file is still in place.
const LOOKS: usize = 16;

/// Key in `meta` that records the removal of profiles.
pub(super) const THINNED: &str = "profiles removed";

/// Creates and empties the table of requests that were not fulfilled. A resumed run recomputes them.
const SHORTFALLS: &str =
    "CREATE TABLE IF NOT EXISTS shortfalls (about TEXT NOT NULL, what TEXT NOT NULL, UNIQUE (about, what));
     DELETE FROM shortfalls;";

/// Device and inode number of a file.
type Identity = (u64, u64);

#[cfg(unix)]
fn identity(path: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;
    std::fs::metadata(path).ok().map(|data| (data.dev(), data.ino()))
}

#[cfg(not(unix))]
fn identity(path: &Path) -> Option<Identity> {
    path.exists().then_some((0, 0))
}

/// Locks a file next to the run file for as long as the run writes. The operating system releases the lock when the
/// process ends for any reason.
pub(super) fn lock(folder: &Path) -> Result<Option<File>, RunFileError> {
    let path = folder.join("run.lock");
    let open = File::options().create(true).write(true).truncate(false).open(&path);
    let file = open.map_err(|e| RunFileError::Folder(folder.to_path_buf(), e))?;
    // A viewer that asks if a run is being written holds the lock for an instant (`is_written`).
    for _ in 0..TRIES {
        match file.try_lock() {
            Ok(()) => return Ok(Some(file)),
            Err(TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
            // Some file systems do not support locks.
            Err(TryLockError::Error(_)) => return Ok(None),
        }
    }
    Err(RunFileError::Busy(path_in(folder)))
}

/// Merges the log into the file and removes it, unless another program stays connected. A viewer connects for a few
/// milliseconds at a time.
fn remove_log(connection: &Connection) {
    for _ in 0..TRIES {
        match connection.pragma_update(None, "journal_mode", "DELETE") {
            Ok(()) => return,
            Err(_) => std::thread::sleep(PAUSE),
        }
    }
}

impl Recorder {
    /// Begins a run in `folder`, which is created if necessary. An existing run file is an error.
    pub fn create(folder: &Path, study: &Study) -> Result<Recorder, RunFileError> {
        let path = path_in(folder);
        if path.exists() {
            return Err(RunFileError::Exists(path));
        }
        std::fs::create_dir_all(folder).map_err(|e| RunFileError::Folder(folder.to_path_buf(), e))?;
        let lock = lock(folder)?;
        // SQLite's message for a folder without write permission names neither the folder nor the reason.
        File::create_new(&path).map_err(|e| match e.kind() {
            std::io::ErrorKind::AlreadyExists => RunFileError::Exists(path.clone()),
            _ => RunFileError::Folder(folder.to_path_buf(), e),
        })?;
        Recorder::begin(path, lock, study)
    }

    /// Removes the run in `folder`, if any. A file of that name that is not a run file is kept and is an error.
    pub fn discard(folder: &Path) -> Result<(), RunFileError> {
        let path = path_in(folder);
        if !path.exists() {
            return Ok(());
        }
        drop(open(&path, false)?);
        drop(lock(folder)?);
        for end in ["", "-wal", "-shm"] {
            let mut file = path.clone().into_os_string();
            file.push(end);
            match std::fs::remove_file(file) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(RunFileError::Folder(folder.to_path_buf(), error));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Continues the run in `folder`, or begins one if there is none. Returns the recorder and the diagram found so
    /// far. Sides that ended only because the run was stopped are open again. The study may have further requests at
    /// its end, compared with the one with which the run began; the new study is then recorded.
    pub fn resume(folder: &Path, study: &Study) -> Result<(Recorder, Diagram), RunFileError> {
        let path = path_in(folder);
        if !path.exists() {
            return Ok((Recorder::create(folder, study)?, Diagram::default()));
        }
        // The check comes before the lock, so that no lock file is created next to a foreign file.
        let opened = open(&path, true)?;
        let lock = lock(folder)?;
        let mut connection = match opened {
            Open::Empty => return Ok((Recorder::begin(path, lock, study)?, Diagram::default())),
            Open::Run(connection) => connection,
        };
        sound(&connection, &path)?;
        if text(&connection, &path, "model")? != study.model_text {
            return Err(RunFileError::Changed(path, "model"));
        }
        let thinned = "SELECT count(*) FROM meta WHERE key = ?";
        match connection.query_row(thinned, [THINNED], |row| row.get::<_, i64>(0)) {
            Ok(0) => {}
            Ok(_) => return Err(RunFileError::Thinned(path)),
            Err(error) => return Err(RunFileError::from_sqlite(&path, error)),
        }
        connection.pragma_update(None, "journal_mode", "WAL").map_err(|e| RunFileError::from_sqlite(&path, e))?;
        modernise(&mut connection).map_err(|e| RunFileError::from_sqlite(&path, e))?;
        lengthen(&mut connection, &path, study)?;
        let mut diagram = load_diagram(&connection, &path, Part::Everything)?;
        let stopped = |end: &mut Option<Ending>| *end = end.take().filter(|ending| *ending != Ending::Stopped);
        diagram.branches.iter_mut().flat_map(|branch| &mut branch.ends).for_each(stopped);
        let recorder = Recorder::over(path, lock, connection, study)?;
        Ok((recorder, diagram))
    }

    fn begin(path: PathBuf, lock: Option<File>, study: &Study) -> Result<Recorder, RunFileError> {
        let failed = |e| RunFileError::from_sqlite(&path, e);
        let mut connection = Connection::open(&path).map_err(failed)?;
        connection.pragma_update(None, "page_size", PAGE).map_err(failed)?;
        connection.pragma_update(None, "journal_mode", "WAL").map_err(failed)?;
        let transaction = connection.transaction().map_err(failed)?;
        transaction.execute_batch(&create(&Columns::new(&study.model))).map_err(failed)?;
        for (key, value) in description(study) {
            transaction.execute("INSERT INTO meta VALUES (?, ?)", params![key, value]).map_err(failed)?;
        }
        for (class, number, name, unit, description) in variables(study) {
            transaction
                .execute(
                    "INSERT INTO variables VALUES (?, ?, ?, ?, ?)",
                    params![class, number, name, unit, description],
                )
                .map_err(failed)?;
        }
        // Written in the same transaction as the tables, so a file with a version has all of them.
        transaction.pragma_update(None, "application_id", APPLICATION_ID).map_err(failed)?;
        transaction.pragma_update(None, "user_version", FORMAT_VERSION).map_err(failed)?;
        transaction.commit().map_err(failed)?;
        Recorder::over(path, lock, connection, study)
    }

    fn over(
        path: PathBuf,
        lock: Option<File>,
        connection: Connection,
        study: &Study,
    ) -> Result<Recorder, RunFileError> {
        let failed = |e| RunFileError::from_sqlite(&path, e);
        connection.pragma_update(None, "synchronous", "NORMAL").map_err(failed)?;
        // A file of an older version keeps its page size.
        let page: i64 = connection.pragma_query_value(None, "page_size", |row| row.get(0)).map_err(failed)?;
        connection.pragma_update(None, "wal_autocheckpoint", LOG / page.max(1)).map_err(failed)?;
        connection.busy_timeout(std::time::Duration::from_secs(10)).map_err(failed)?;
        let numbers = {
            let mut statement = connection.prepare("SELECT name, branch FROM branches").map_err(failed)?;
            let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).map_err(failed)?;
            rows.collect::<Result<HashMap<String, i64>, _>>().map_err(failed)?
        };
        let columns = Columns::new(&study.model);
        connection.execute_batch(&index(&columns)).map_err(failed)?;
        responses::create(&connection, &study.model).map_err(failed)?;
        super::designs::create(&connection).map_err(failed)?;
        connection.execute_batch(SHORTFALLS).map_err(failed)?;
        let special = [
            "branch",
            "kind",
            "position",
            "key",
            "unstable_before",
            "unstable_after",
            "error",
            "normal_form",
            "coefficient_count",
            "normal_form_remark",
        ];
        Ok(Recorder {
            insert_point: insertion("points", &["branch", "position"], &columns),
            insert_special: insertion("special_points", &special, &columns),
            insert_response: responses::insert(&study.model),
            shown: columns.names().count(),
            store: study.store,
            scales: scales(&connection, study),
            numbers: Mutex::new(numbers),
            failed: AtomicBool::new(false),
            waiting: Mutex::default(),
            state: Mutex::new(State { connection, file: identity(&path), events: 0, failure: None }),
            path,
            _lock: lock,
        })
    }

    /// Scales of the states `[n]` with which the run began: those of its first study, also when that has grown.
    pub fn scales(&self) -> Option<&[f64]> {
        self.scales.as_deref()
    }

    /// Closes the file of a complete run and removes the profiles that its study does not keep.
    ///
    /// # Errors
    /// The first error met while recording, or a failure to close the file.
    pub fn complete(self) -> Result<(), RunFileError> {
        let store = self.store;
        self.closed(store)
    }

    /// Closes the file of a run that can be resumed.
    ///
    /// # Errors
    /// The first error met while recording, or a failure to close the file.
    pub fn finish(self) -> Result<(), RunFileError> {
        self.closed(Store::All)
    }

    fn closed(self, store: Store) -> Result<(), RunFileError> {
        // The queue is empty unless a thread was terminated.
        self.with_file(|_| ());
        let state = self.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        if let Some(error) = state.failure {
            return Err(error);
        }
        if identity(&self.path) != state.file {
            return Err(RunFileError::Vanished(self.path));
        }
        thin(&state.connection, store).map_err(|error| RunFileError::from_sqlite(&self.path, error))?;
        // Leaves a single file without a log, unless another program is reading it.
        remove_log(&state.connection);
        state.connection.close().map_err(|(_, error)| RunFileError::from_sqlite(&self.path, error))?;
        if let Some(folder) = self.path.parent() {
            let _ = std::fs::remove_file(folder.join("run.lock"));
        }
        Ok(())
    }

    /// Writes the queue, then calls `work` with the file locked.
    fn with_file<T>(&self, work: impl FnOnce(&mut State) -> T) -> T {
        let done = {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            self.write_waiting(&mut state);
            work(&mut state)
        };
        self.relieve();
        done
    }

    fn queue(&self) -> MutexGuard<'_, VecDeque<Row>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn write_waiting(&self, state: &mut State) {
        loop {
            let next = self.queue().front_mut().map(|row| (row.special, std::mem::take(&mut row.values)));
            let Some((special, values)) = next else { return };
            let sql = if special { &self.insert_special } else { &self.insert_point };
            self.write_to(state, |state| insert(&state.connection, sql, values));
            self.queue().pop_front();
        }
    }

    /// Writes the queue, or leaves it to the thread that holds the file. That thread calls this function after
    /// releasing the file, so a row queued in between is written too.
    fn relieve(&self) {
        while !self.queue().is_empty() {
            match self.state.try_lock() {
                Ok(mut state) => self.write_waiting(&mut state),
                Err(sync::TryLockError::Poisoned(state)) => self.write_waiting(&mut state.into_inner()),
                Err(sync::TryLockError::WouldBlock) => return,
            }
        }
    }

    /// Queues a row, and writes it here or leaves it to the writing thread.
    fn hand_in(&self, row: Row) {
        let ahead = {
            let mut queue = self.queue();
            let ahead = queue.iter().filter(|other| other.branch == row.branch).count();
            queue.push_back(row);
            ahead
        };
        if ahead < AHEAD { self.relieve() } else { self.with_file(|_| ()) }
    }

    /// Returns the number of a branch that has begun.
    fn number_of(&self, name: &str) -> Option<i64> {
        self.numbers.lock().unwrap_or_else(PoisonError::into_inner).get(name).copied()
    }

    /// Returns the number of a branch, which is begun if necessary; `None` if that fails.
    fn number(&self, branch: &Branch) -> Option<i64> {
        self.number_of(&branch.name).or_else(|| {
            self.begin_branch(branch);
            self.number_of(&branch.name)
        })
    }

    fn begin_branch(&self, branch: &Branch) {
        self.write(|state| {
            let number = state.begin_branch(branch)?;
            self.numbers.lock().unwrap_or_else(PoisonError::into_inner).insert(branch.name.clone(), number);
            Ok(())
        });
    }

    fn write(&self, work: impl FnOnce(&mut State) -> rusqlite::Result<()>) {
        self.with_file(|state| self.write_to(state, work));
    }

    /// Calls `work` unless an earlier write has failed. Every [`LOOKS`] events, checks that the file is still in place.
    fn write_to(&self, state: &mut State, work: impl FnOnce(&mut State) -> rusqlite::Result<()>) {
        if state.failure.is_some() {
            return;
        }
        let looks = state.events.is_multiple_of(LOOKS);
        state.events += 1;
        state.failure = if !looks || identity(&self.path) == state.file {
            work(state).err().map(|error| RunFileError::from_sqlite(&self.path, error))
        } else {
            Some(RunFileError::Vanished(self.path.clone()))
        };
        if state.failure.is_some() {
            self.failed.store(true, Ordering::Release);
        }
    }
}

impl Observer for Recorder {
    fn observe(&self, event: Event) -> Verdict {
        // Rows are assembled before the file is locked.
        let stored = |branch: &Branch, special: bool, values: &dyn Fn(i64) -> Vec<Value>| {
            if let Some(number) = self.number(branch) {
                self.hand_in(Row { branch: number, special, values: values(number) });
            }
        };
        match event {
            Event::Begin(branch) => self.begin_branch(branch),
            Event::Point(branch, point) => stored(branch, false, &|number| point_row(number, point, self.shown)),
            Event::Special(branch, special) => {
                stored(branch, true, &|number| special_row(number, branch, special, self.shown))
            }
            Event::SideEnded(branch, side, ending) => {
                if let Some(number) = self.number(branch) {
                    let (sql, row) =
                        ("INSERT OR REPLACE INTO ends VALUES (?, ?, ?, ?, ?, ?, ?, ?)", end_row(number, side, ending));
                    self.write(|state| insert(&state.connection, sql, row));
                }
            }
            Event::Note(branch, note) => {
                let row = [branch, note].map(|text| text.to_string().into()).to_vec();
                self.write(|state| insert(&state.connection, "INSERT OR IGNORE INTO notes VALUES (?, ?)", row));
            }
            Event::Short(about, what) => {
                let row = [about, what].map(|text| text.to_string().into()).to_vec();
                self.write(|state| insert(&state.connection, "INSERT OR IGNORE INTO shortfalls VALUES (?, ?)", row));
            }
            Event::Responses(set) => {
                self.write(|state| responses::write(&mut state.connection, &self.insert_response, set, self.shown));
            }
            Event::Design(design) => self.write(|state| super::designs::write(&state.connection, design)),
            Event::Mapped(cell, ..) => self.write(|state| super::cells::write(&state.connection, cell)),
            Event::End(_) | Event::Visited(..) => {}
        }
        if self.failed.load(Ordering::Acquire) { Verdict::Stop } else { Verdict::Continue }
    }

    fn stores(&self) -> bool {
        true
    }

    fn recall(&self, branch: &Branch, position: i64) -> Option<Point> {
        let number = self.number_of(&branch.name)?;
        self.with_file(|state| point_at(&state.connection, number, position))
    }
}

/// Removes the profiles that the study does not keep. The first and last point of a branch keep theirs.
fn thin(connection: &Connection, store: Store) -> rusqlite::Result<()> {
    let every = match store {
        Store::All | Store::Every(1) => return Ok(()),
        Store::Special => None,
        Store::Every(k) => i64::try_from(k).ok(),
    };
    connection.execute(
        "UPDATE points SET solution_bytes = x'', mesh_bytes = x'', tangent_bytes = x'', solution_checksum = NULL
         WHERE mesh_bytes IS NOT NULL AND (?1 IS NULL OR position % ?1 <> 0)
             AND position <> (SELECT min(position) FROM points AS own WHERE own.branch = points.branch)
             AND position <> (SELECT max(position) FROM points AS own WHERE own.branch = points.branch)",
        params![every],
    )?;
    connection.execute("INSERT OR REPLACE INTO meta VALUES (?, 'true')", [THINNED])?;
    connection.execute_batch("VACUUM")
}

fn insert(connection: &Connection, sql: &str, values: Vec<Value>) -> rusqlite::Result<()> {
    connection.prepare_cached(sql)?.execute(params_from_iter(values)).map(|_| ())
}

/// Held quantities of branches, with their values, and the further free parameters, with their scales.
const HELD_QUANTITIES: &str = "CREATE TABLE IF NOT EXISTS held_quantities (branch INTEGER NOT NULL REFERENCES branches,
     parameter INTEGER, name TEXT NOT NULL, value REAL, value_bytes BLOB NOT NULL);";

impl State {
    /// Stores a new or resumed branch and returns its number.
    fn begin_branch(&mut self, branch: &Branch) -> rusqlite::Result<i64> {
        let first = [
            Value::Text(branch.name.clone()),
            Value::Text(branch.family.name().to_string()),
            Value::Integer(branch.free as i64),
        ];
        let transaction = self.connection.transaction()?;
        // A branch from an earlier part of the run keeps its number.
        transaction.execute(
            "INSERT INTO branches (name, family, free, origin, origin_name, origin_kind, origin_parameter, origin_bytes,
                 held, follows, held_unit, unit)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12)
             ON CONFLICT (name) DO UPDATE SET family = ?2, free = ?3, origin = ?4, origin_name = ?5, origin_kind = ?6,
                 origin_parameter = ?7, origin_bytes = ?8, held = ?9, follows = ?10, held_unit = ?11, unit = ?12",
            params_from_iter(first.into_iter().chain(origin_values(&branch.origin)).chain(held_values(branch.held)).chain(branch.units.map(Value::Real))),
        )?;
        let number: i64 =
            transaction.query_row("SELECT branch FROM branches WHERE name = ?", [&branch.name], |row| row.get(0))?;
        // Files of runs without held quantities stay as earlier versions write them.
        if !branch.also.is_empty() {
            transaction.execute_batch(HELD_QUANTITIES)?;
            transaction.execute("DELETE FROM held_quantities WHERE branch = ?", [number])?;
            let parameters = branch.also.iter().map(|(index, unit)| (Some(*index as i64), String::new(), *unit));
            let levels = branch.levels.iter().map(|(name, value)| (None, name.clone(), *value));
            for (index, name, value) in parameters.chain(levels) {
                let bytes = pack(&[value]);
                transaction.execute(
                    "INSERT INTO held_quantities VALUES (?, ?, ?, ?, ?)",
                    params![number, index, name, value, bytes],
                )?;
            }
        }
        for (side, _) in branch.ends.iter().enumerate().filter(|(_, end)| end.is_none()) {
            transaction.execute("DELETE FROM ends WHERE branch = ? AND side = ?", params![number, side as i64])?;
        }
        // Points stored earlier from which this run does not continue are removed; they will be computed again.
        let reach = branch.points.first().zip(branch.points.last()).map_or((0, -1), |(a, b)| (a.position, b.position));
        transaction.execute(
            "DELETE FROM points WHERE branch = ? AND NOT position BETWEEN ? AND ?",
            params![number, reach.0, reach.1],
        )?;
        let kept: Vec<(&str, i64, Vec<u8>)> = branch.special.iter().map(|special| key_of(branch, special)).collect();
        let stored = {
            let mut statement =
                transaction.prepare("SELECT kind, position, key FROM special_points WHERE branch = ?")?;
            let rows = statement.query_map([number], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
            rows.collect::<rusqlite::Result<Vec<(String, i64, Vec<u8>)>>>()?
        };
        for (kind, position, key) in stored {
            let same = |bytes: &[u8]| bytes == key || (key.len() == OF_PARAMETER && bytes.starts_with(&key));
            if !kept.iter().any(|(k, p, bytes)| *k == kind && *p == position && same(bytes)) {
                transaction.execute(
                    "DELETE FROM special_points WHERE branch = ? AND kind = ? AND position = ? AND key = ?",
                    params![number, kind, position, key],
                )?;
            }
        }
        transaction.commit()?;
        Ok(number)
    }
}

/// Upgrades a file of an older version in one transaction.
fn modernise(connection: &mut Connection) -> rusqlite::Result<()> {
    let version: i64 = connection.pragma_query_value(None, "user_version", |row| row.get(0))?;
    let transaction = connection.transaction()?;
    for older in version..FORMAT_VERSION {
        transaction.execute_batch(upgrade(older))?;
    }
    transaction.pragma_update(None, "user_version", FORMAT_VERSION)?;
    transaction.commit()
}
