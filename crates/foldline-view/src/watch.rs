//! A run that is watched through its file.
//!
//! **Idea.** The file says which positions each branch has; `log` numbers them in the order in which they were first
//! seen. The numbers of the points stay in the file, which is opened for each look and closed at once (`foldline_store::run_file`).

use crate::axes::{self, Axis};
use crate::describe::{described, state};
use crate::frame::frame;
use crate::log::{Log, PROFILES, ROWS, Stretch};
use crate::orbit::{Place, solution};
use foldline::diagram::{Branch, Diagram, Kind, Point};
use foldline::explore::System;
use foldline::model::Model;
use foldline::special::quantity::Quantity;
use foldline::verify::{Verified, verify};
use foldline_store::diagnostic::Diagnostic;
use foldline_store::run_file::{Part, Reading, RunFileError, Span, is_written, path_in};
use foldline_store::study_file::{Study, parse_study_of_run};
use serde_json::{Value, json};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};

/// Time after which the file is read even if it looks unchanged: file systems record times in coarse steps.
const AT_LEAST: Duration = Duration::from_secs(1);

/// Reason why a run cannot be shown.
#[derive(Debug)]
pub enum Failure {
    /// The run file cannot be read.
    Run(RunFileError),
    /// The study or the model stored in the run is invalid.
    Study(Vec<Diagnostic>),
    /// The file to be written, and the reason why it cannot be.
    Output(PathBuf, std::io::Error),
}

impl From<RunFileError> for Failure {
    fn from(error: RunFileError) -> Failure {
        Failure::Run(error)
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Failure::Run(error) => write!(f, "{error}"),
            Failure::Study(found) => found.iter().try_for_each(|diagnostic| writeln!(f, "{diagnostic}")),
            Failure::Output(path, error) => write!(
                f,
                "{} cannot be written: {error}\n  help: free some space there, or write elsewhere with `--out PATH`",
                path.display()
            ),
        }
    }
}

impl std::error::Error for Failure {}

/// Run in a folder, complete or growing.
#[derive(Clone)]
pub struct Watch(Arc<Shared>);

struct Shared {
    growing: Mutex<Growing>,
    /// Exit code of the process that computes the run, if this program has started it and it has ended.
    code: Mutex<Option<i32>>,
    /// Reason why the page cannot go on with a longer study.
    fixed: Mutex<Option<String>>,
}

struct Growing {
    folder: PathBuf,
    study: Arc<Study>,
    /// Number of texts of the study seen.
    texts: u64,
    axes: Arc<[Axis]>,
    /// Number of changes seen.
    version: u64,
    log: Log,
    state: Arc<str>,
    written: bool,
    code: Option<i32>,
    stamp: Option<Stamp>,
    seen: Instant,
}

/// State of a run without a file.
const NOTHING: &str = "{\"branches\":[],\"special\":[],\"notes\":[],\"responses\":[],\"shortfalls\":[],\
    \"running\":false,\"code\":null,\"points\":0,\"draft\":true}";

/// Name of a branch, a point of it and, for a special point, its kind and number.
type Placed = (String, Point, Option<(Kind, usize)>);

/// Time and size of the file and of its log.
type Stamp = [Option<(SystemTime, u64)>; 2];

/// News about the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Notice {
    pub(crate) epoch: u64,
    pub(crate) version: u64,
    pub(crate) points: u64,
    pub(crate) running: bool,
}

impl Watch {
    /// Opens the run in a folder.
    ///
    /// # Errors
    /// If there is no run, or its file, study or model cannot be read.
    pub fn open(folder: &Path) -> Result<Watch, Failure> {
        Watch::opened(folder, axes::offered)
    }

    /// Opens the run in a folder with the quantities that `axes` returns.
    pub(crate) fn opened(folder: &Path, axes: impl Fn(&Model) -> Vec<Axis>) -> Result<Watch, Failure> {
        let reading = Reading::open(folder)?;
        let run = reading.recorded(Part::Special)?;
        let study = parse_study_of_run(&run.study_text, &run.study_file, &run.model_text, &run.model_file);
        let study = Arc::new(study.map_err(Failure::Study)?);
        let axes = axes(&study.model);
        let watch = Watch::of(folder, study, axes.into());
        watch.look()?;
        Ok(watch)
    }

    /// Study of which nothing has been computed yet; the run will be in a folder.
    pub fn draft(folder: &Path, study: Study) -> Watch {
        let axes = axes::offered(&study.model);
        Watch::of(folder, Arc::new(study), axes.into())
    }

    fn of(folder: &Path, study: Arc<Study>, axes: Arc<[Axis]>) -> Watch {
        let growing = Growing {
            folder: folder.to_path_buf(),
            study,
            texts: 1,
            axes,
            version: 0,
            log: Log::default(),
            state: NOTHING.into(),
            written: false,
            code: None,
            stamp: None,
            seen: Instant::now(),
        };
        let shared = Shared {
            growing: Mutex::new(growing),
            code: Mutex::new(None),
            fixed: Mutex::new(Some("the study of this run is not known here".into())),
        };
        Watch(Arc::new(shared))
    }

    /// Changes to another run, or to another study of which nothing has been computed yet.
    pub(crate) fn turn_to(&self, folder: &Path, study: Study) {
        let mut growing = self.growing();
        growing.folder = folder.to_path_buf();
        growing.axes = axes::offered(&study.model).into();
        growing.study = Arc::new(study);
        growing.texts += 1;
        growing.version += 1;
        growing.log.restart();
        growing.state = NOTHING.into();
        growing.stamp = None;
    }

    /// Folder of the run.
    pub(crate) fn folder(&self) -> PathBuf {
        self.growing().folder.clone()
    }

    /// Notes that the process that computes the run has ended.
    pub fn ended(&self, code: i32) {
        *self.0.code.lock().unwrap_or_else(PoisonError::into_inner) = Some(code);
    }

    /// Notes that a process computes the run again.
    pub(crate) fn started(&self) {
        *self.0.code.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// Notes whether the page can go on with a longer study, or why it cannot.
    pub fn editable(&self, can: Result<(), String>) {
        *self.0.fixed.lock().unwrap_or_else(PoisonError::into_inner) = can.err();
        // The state of a finished run, which was read before, says so too.
        self.growing().stamp = None;
    }

    /// Reason why the page cannot go on with a longer study, if there is one.
    pub(crate) fn why_not(&self) -> Option<String> {
        self.0.fixed.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The study as recorded in the run.
    pub fn study(&self) -> Arc<Study> {
        Arc::clone(&self.growing().study)
    }

    /// Looks for changes. Returns true if something has changed.
    ///
    /// # Errors
    /// If the file cannot be read. What was read before stays available.
    pub(crate) fn look(&self) -> Result<bool, RunFileError> {
        let folder = self.folder();
        let written = is_written(&folder);
        let code = *self.0.code.lock().unwrap_or_else(PoisonError::into_inner);
        let stamp = stamp(&folder);
        if stamp[0].is_none() {
            return Ok(self.nothing(code));
        }
        {
            let growing = self.growing();
            let same = growing.stamp == Some(stamp) && growing.written == written && growing.code == code;
            if same && (!written || growing.seen.elapsed() < AT_LEAST) {
                return Ok(false);
            }
        }
        let reading = Reading::open(&folder)?;
        let spans = reading.spans()?;
        let run = reading.recorded(Part::Special)?;
        drop(reading);
        let mut growing = self.growing();
        if growing.folder != folder {
            return Ok(false);
        }
        growing.stamp = Some(stamp);
        growing.seen = Instant::now();
        let before = growing.notice();
        growing.log.grow(&spans);
        if run.study_text != growing.study.text {
            let study = parse_study_of_run(&run.study_text, &run.study_file, &run.model_text, &run.model_file);
            // The run itself has read this text.
            if let Ok(study) = study {
                growing.study = Arc::new(study);
                growing.texts += 1;
            }
        }
        (growing.written, growing.code) = (written, code);
        let study = Arc::clone(&growing.study);
        let mut state = state(run, &spans, &study, &growing.axes);
        state["running"] = written.into();
        state["code"] = code.into();
        state["points"] = growing.log.points().into();
        Ok(self.told(&mut growing, state, before))
    }

    /// The state while there is no run file. Returns true if it has changed.
    fn nothing(&self, code: Option<i32>) -> bool {
        let mut growing = self.growing();
        let before = growing.notice();
        let mut state: Value = serde_json::from_str(NOTHING).unwrap_or_default();
        growing.code = code;
        state["code"] = code.into();
        self.told(&mut growing, state, before)
    }

    /// Completes and keeps a state. Returns true if it differs from `before`.
    fn told(&self, growing: &mut Growing, mut state: Value, before: Notice) -> bool {
        state["texts"] = growing.texts.into();
        state["fixed"] = self.why_not().into();
        let text = state.to_string();
        let changed = *text != *growing.state || before != growing.notice();
        if changed {
            growing.state = text.into();
            growing.version += 1;
        }
        changed
    }

    pub(crate) fn notice(&self) -> Notice {
        self.growing().notice()
    }

    /// Model, study and quantities, which do not change while the run grows.
    pub(crate) fn description(&self) -> Value {
        let (study, axes) = self.about();
        described(&study, &axes, &self.folder())
    }

    /// Branches, special points, ends and notes.
    pub(crate) fn state(&self) -> String {
        let growing = self.growing();
        format!("{{\"epoch\":{},\"version\":{},\"state\":{}}}", growing.log.epoch(), growing.version, growing.state)
    }

    fn about(&self) -> (Arc<Study>, Arc<[Axis]>) {
        let growing = self.growing();
        (Arc::clone(&growing.study), Arc::clone(&growing.axes))
    }

    pub(crate) fn axes(&self) -> Arc<[Axis]> {
        Arc::clone(&self.growing().axes)
    }

    /// Adds a quantity by its name, and returns its index.
    ///
    /// # Errors
    /// If there is no such quantity, or too many were added.
    pub(crate) fn add(&self, name: &str) -> Result<usize, String> {
        let mut growing = self.growing();
        let mut all = growing.axes.to_vec();
        let index = axes::add(&mut all, name, &growing.study.model)?;
        growing.axes = all.into();
        // The state, which has the values of special points, is that of the longer list.
        growing.stamp = None;
        Ok(index)
    }

    /// Returns a frame of the points from a cursor on: branch, position, number of unstable eigenvalues or multipliers,
    /// and the columns asked for. If the epoch is over, the header says so and there are no points.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn points(&self, epoch: u64, since: u64, columns: &[usize]) -> Result<Vec<u8>, RunFileError> {
        let (study, all) = self.about();
        let quantities: Vec<Quantity> = columns.iter().filter_map(|k| all.get(*k)).map(|own| own.quantity).collect();
        let profiles = quantities.iter().any(|quantity| quantity.needs_profile());
        let (wanted, now, last) = {
            let growing = self.growing();
            let most = if profiles { PROFILES } else { ROWS };
            (growing.log.since(since, most), growing.log.epoch(), growing.log.points())
        };
        if now != epoch {
            return Ok(frame(&json!({ "restart": true, "epoch": now }), &[]));
        }
        let mut found = vec![Vec::new(); 3 + quantities.len()];
        if wanted.is_empty() {
            // There may be no file yet.
            let header = json!({ "epoch": now, "columns": columns, "rows": 0, "next": since, "more": false });
            return Ok(frame(&header, &found));
        }
        let reading = Reading::open(&self.folder())?;
        for Stretch { branch, reach, .. } in &wanted {
            let before = found[0].len() as u64;
            let mut take = |position: i64, unstable: i64, values: &[f64]| {
                let first = [*branch as f64, position as f64, unstable as f64];
                found.iter_mut().zip(first.iter().chain(values)).for_each(|(column, value)| column.push(*value));
            };
            if profiles {
                reading.each_point_in(*branch, *reach, |point| {
                    take(point.position, point.unstable as i64, &values_on(point, &quantities, &study.model));
                })?;
            } else {
                reading.each_value(*branch, *reach, &quantities, &study.model, take)?;
            }
            if found[0].len() as u64 - before != (reach[1] - reach[0] + 1) as u64 {
                // Points were removed since the last look: the next one begins an epoch.
                return Ok(frame(&json!({ "restart": true, "epoch": now }), &[]));
            }
        }
        let rows = found[0].len() as u64;
        let next = since.saturating_add(rows);
        let header = json!({ "epoch": now, "columns": columns, "rows": rows, "next": next, "more": next < last });
        Ok(frame(&header, &found))
    }

    /// Returns a frame of all special points: branch, index on the branch, and the columns asked for, which may need
    /// their profiles.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn special(&self, columns: &[usize]) -> Result<Vec<u8>, RunFileError> {
        let (study, all) = self.about();
        let quantities: Vec<Quantity> = columns.iter().filter_map(|k| all.get(*k)).map(|own| own.quantity).collect();
        let mut found = vec![Vec::new(); 2 + quantities.len()];
        let reading = Reading::open(&self.folder())?;
        for Span { number, .. } in reading.spans()? {
            reading.each_special_point(number, |index, special| {
                let first = [number as f64, index as f64];
                let values = values_on(&special.point, &quantities, &study.model);
                found.iter_mut().zip(first.iter().chain(&values)).for_each(|(column, value)| column.push(*value));
            })?;
        }
        Ok(frame(&json!({ "columns": columns, "rows": found[0].len() }), &found))
    }

    /// Returns a frame of one solution; `None` if there is no such point.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn solution(&self, branch: i64, place: Place) -> Result<Option<Vec<u8>>, RunFileError> {
        let (study, axes) = self.about();
        let reading = Reading::open(&self.folder())?;
        let point = match place {
            Place::Position(position) => reading.point(branch, position)?,
            Place::Special(index) => reading.special_point(branch, index)?.map(|special| special.point),
        };
        Ok(point.map(|point| {
            let (header, columns) = solution(&study.model, &axes, &point);
            frame(&header, &columns)
        }))
    }

    /// Returns a point with the name of its branch, and for a special point its kind and its number among those of its
    /// kind on the branch; `None` if there is no such point.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn place(&self, branch: i64, place: Place) -> Result<Option<Placed>, RunFileError> {
        let reading = Reading::open(&self.folder())?;
        let Some(span) = reading.spans()?.into_iter().find(|span| span.number == branch) else { return Ok(None) };
        match place {
            Place::Position(position) => Ok(reading.point(branch, position)?.map(|point| (span.name, point, None))),
            Place::Special(index) => {
                let Some(own) = reading.special_point(branch, index)? else { return Ok(None) };
                let mut number = 1;
                for before in 0..index {
                    let other = reading.special_point(branch, before)?;
                    number += usize::from(other.is_some_and(|other| other.kind == own.kind));
                }
                Ok(Some((span.name, own.point, Some((own.kind, number)))))
            }
        }
    }

    /// Recomputes one point by an independent method; `None` if there is no such point.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn verified(&self, branch: i64, place: Place) -> Result<Option<Verified>, RunFileError> {
        let (study, _) = self.about();
        let reading = Reading::open(&self.folder())?;
        let Some(span) = reading.spans()?.into_iter().find(|span| span.number == branch) else { return Ok(None) };
        let recorded = reading.recorded(Part::Special)?.diagram;
        let Some(own) = recorded.branch(&span.name) else { return Ok(None) };
        let mut alone = Branch { points: Vec::new(), special: Vec::new(), ..own.clone() };
        match place {
            Place::Position(position) => match reading.point(branch, position)? {
                Some(point) => alone.insert(point),
                None => return Ok(None),
            },
            Place::Special(index) => match reading.special_point(branch, index)? {
                Some(special) => {
                    // The point before it carries the parameters that do not vary; it is not recomputed itself.
                    let Some(before) = reading.point(branch, special.point.position)? else { return Ok(None) };
                    alone.insert(before);
                    alone.insert_special(special);
                }
                None => return Ok(None),
            },
        }
        drop(reading);
        let sample = matches!(place, Place::Special(_)).then_some(0);
        let diagram = Diagram { branches: vec![alone], ..Diagram::default() };
        let system = System::of_plan(&study.model, &study.plan);
        Ok(Some(verify(&system, &diagram, study.plan.tolerance, sample, &|_| true)))
    }

    fn growing(&self) -> MutexGuard<'_, Growing> {
        self.0.growing.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Growing {
    fn notice(&self) -> Notice {
        let Growing { version, log, written, .. } = self;
        Notice { epoch: log.epoch(), version: *version, points: log.points(), running: *written }
    }
}

/// Values of quantities at a point with its profile; NaN where they are not defined.
fn values_on(point: &Point, quantities: &[Quantity], model: &Model) -> Vec<f64> {
    quantities.iter().map(|quantity| quantity.on(point, model).unwrap_or(f64::NAN)).collect()
}

fn stamp(folder: &Path) -> Stamp {
    let path = path_in(folder);
    let mut log = path.clone().into_os_string();
    log.push("-wal");
    [path, log.into()]
        .map(|path| std::fs::metadata(path).ok().and_then(|data| Some((data.modified().ok()?, data.len()))))
}
