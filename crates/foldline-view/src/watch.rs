//! A run that is watched through its file.
//!
//! **Idea.** The file says which positions each branch has. What is new since the last look is appended to a list of
//! stretches, and the index of a point in this list is its cursor: a client that has N points asks for those from N
//! on. If anything was removed, as when a run is resumed, the list starts again in a new *epoch*. The numbers stay in
//! the file. The file is opened for each look and closed at once (`foldline_store::run_file`).

use crate::describe::{described, state};
use crate::frame::frame;
use crate::orbit::{Place, solution};
use foldline::special::quantity::Quantity;
use foldline_store::diagnostic::Diagnostic;
use foldline_store::run_file::{Part, Reading, RunFileError, Span, is_written, path_in};
use foldline_store::study_file::{Study, parse_study_of_run};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};

/// Largest number of points in one answer.
pub(crate) const ROWS: u64 = 20_000;
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
    folder: PathBuf,
    growing: Mutex<Growing>,
    /// Exit code of the process that computes the run, if this program has started it and it has ended.
    code: Mutex<Option<i32>>,
}

struct Growing {
    study: Arc<Study>,
    quantities: Arc<[Quantity]>,
    epoch: u64,
    /// Number of changes seen.
    version: u64,
    log: Vec<Stretch>,
    /// Range of positions of each branch that is in `log`.
    reach: HashMap<i64, [i64; 2]>,
    state: Arc<str>,
    written: bool,
    code: Option<i32>,
    stamp: Option<Stamp>,
    seen: Instant,
}

/// Consecutive positions of a branch.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    /// Cursor of the first point.
    first: u64,
    branch: i64,
    reach: [i64; 2],
}

impl Stretch {
    fn points(&self) -> u64 {
        (self.reach[1] - self.reach[0] + 1).max(0) as u64
    }
}

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
        let reading = Reading::open(folder)?;
        let run = reading.recorded(Part::Special)?;
        let study = parse_study_of_run(&run.study_text, &run.study_file, &run.model_text, &run.model_file);
        let study = Arc::new(study.map_err(Failure::Study)?);
        let names = Quantity::names(&study.model);
        let quantities = names.iter().filter_map(|name| Quantity::named(name, &study.model)).collect();
        let growing = Growing {
            study,
            quantities,
            epoch: 1,
            version: 0,
            log: Vec::new(),
            reach: HashMap::new(),
            state: "{}".into(),
            written: false,
            code: None,
            stamp: None,
            seen: Instant::now(),
        };
        let shared = Shared { folder: folder.to_path_buf(), growing: Mutex::new(growing), code: Mutex::new(None) };
        let watch = Watch(Arc::new(shared));
        watch.look()?;
        Ok(watch)
    }

    /// Notes that the process that computes the run has ended.
    pub fn ended(&self, code: i32) {
        *self.0.code.lock().unwrap_or_else(PoisonError::into_inner) = Some(code);
    }

    /// Looks for changes. Returns true if something has changed.
    ///
    /// # Errors
    /// If the file cannot be read. What was read before stays available.
    pub(crate) fn look(&self) -> Result<bool, RunFileError> {
        let written = is_written(&self.0.folder);
        let code = *self.0.code.lock().unwrap_or_else(PoisonError::into_inner);
        let stamp = stamp(&self.0.folder);
        {
            let growing = self.growing();
            let same = growing.stamp == Some(stamp) && growing.written == written && growing.code == code;
            if same && (!written || growing.seen.elapsed() < AT_LEAST) {
                return Ok(false);
            }
        }
        let reading = Reading::open(&self.0.folder)?;
        let spans = reading.spans()?;
        let run = reading.recorded(Part::Special)?;
        drop(reading);
        let mut growing = self.growing();
        growing.stamp = Some(stamp);
        growing.seen = Instant::now();
        let before = growing.notice();
        growing.grow(&spans);
        (growing.written, growing.code) = (written, code);
        let study = Arc::clone(&growing.study);
        let mut state = state(run, &spans, &study, &growing.quantities);
        state["running"] = written.into();
        state["code"] = code.into();
        state["points"] = growing.points().into();
        let text = state.to_string();
        let changed = *text != *growing.state || before != growing.notice();
        if changed {
            growing.state = text.into();
            growing.version += 1;
        }
        Ok(changed)
    }

    pub(crate) fn notice(&self) -> Notice {
        self.growing().notice()
    }

    /// What does not change while the run grows: model, study, quantities.
    pub(crate) fn description(&self) -> Value {
        let (study, quantities) = self.about();
        described(&study, &quantities, &self.0.folder)
    }

    /// Branches, special points, ends and notes.
    pub(crate) fn state(&self) -> String {
        let growing = self.growing();
        format!("{{\"epoch\":{},\"version\":{},\"state\":{}}}", growing.epoch, growing.version, growing.state)
    }

    fn about(&self) -> (Arc<Study>, Arc<[Quantity]>) {
        let growing = self.growing();
        (Arc::clone(&growing.study), Arc::clone(&growing.quantities))
    }

    pub(crate) fn quantities(&self) -> usize {
        self.growing().quantities.len()
    }

    /// Returns a frame of the points from a cursor on: branch, position, number of unstable eigenvalues or multipliers,
    /// and the columns asked for. If the epoch is over, the header says so and there are no points.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn points(&self, epoch: u64, since: u64, columns: &[usize]) -> Result<Vec<u8>, RunFileError> {
        let (study, all) = self.about();
        let (wanted, now, last) = {
            let growing = self.growing();
            (growing.since(since), growing.epoch, growing.points())
        };
        if now != epoch {
            return Ok(frame(&json!({ "restart": true, "epoch": now }), &[]));
        }
        let quantities: Vec<Quantity> = columns.iter().filter_map(|k| all.get(*k).copied()).collect();
        let mut found = vec![Vec::new(); 3 + quantities.len()];
        let reading = Reading::open(&self.0.folder)?;
        for Stretch { branch, reach, .. } in &wanted {
            let before = found[0].len() as u64;
            reading.each_value(*branch, *reach, &quantities, &study.model, |position, unstable, values| {
                let first = [*branch as f64, position as f64, unstable as f64];
                found.iter_mut().zip(first.iter().chain(values)).for_each(|(column, value)| column.push(*value));
            })?;
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

    /// Returns a frame of one solution; `None` if there is no such point.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn solution(&self, branch: i64, place: Place) -> Result<Option<Vec<u8>>, RunFileError> {
        let (study, quantities) = self.about();
        let reading = Reading::open(&self.0.folder)?;
        let point = match place {
            Place::Position(position) => reading.point(branch, position)?,
            Place::Special(index) => reading.special_point(branch, index)?.map(|special| special.point),
        };
        Ok(point.map(|point| {
            let (header, columns) = solution(&study.model, &quantities, &point);
            frame(&header, &columns)
        }))
    }

    fn growing(&self) -> MutexGuard<'_, Growing> {
        self.0.growing.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Growing {
    fn points(&self) -> u64 {
        self.log.last().map_or(0, |stretch| stretch.first + stretch.points())
    }

    fn notice(&self) -> Notice {
        Notice { epoch: self.epoch, version: self.version, points: self.points(), running: self.written }
    }

    /// Appends what is new. If points have disappeared, begins a new epoch.
    fn grow(&mut self, spans: &[Span]) {
        let kept = |(branch, [low, high]): (&i64, &[i64; 2])| {
            let reach = spans.iter().find(|span| span.number == *branch).and_then(|span| span.reach);
            reach.is_some_and(|[first, last]| first <= *low && last >= *high)
        };
        if !self.reach.iter().all(kept) {
            self.epoch += 1;
            self.log.clear();
            self.reach.clear();
        }
        for (branch, [first, last]) in spans.iter().filter_map(|span| Some((span.number, span.reach?))) {
            let parts = match self.reach.insert(branch, [first, last]) {
                None => vec![[first, last]],
                Some([low, high]) => vec![[first, low - 1], [high + 1, last]],
            };
            for reach in parts.into_iter().filter(|[from, to]| from <= to) {
                self.log.push(Stretch { first: self.points(), branch, reach });
            }
        }
    }

    /// Stretches from a cursor on, at most [`ROWS`] points in all.
    fn since(&self, cursor: u64) -> Vec<Stretch> {
        let (mut found, mut left) = (Vec::new(), ROWS);
        let from = self.log.partition_point(|stretch| stretch.first + stretch.points() <= cursor);
        for stretch in &self.log[from..] {
            let skipped = cursor.saturating_sub(stretch.first) as i64;
            let low = stretch.reach[0] + skipped;
            let high = stretch.reach[1].min(low + left as i64 - 1);
            if left == 0 {
                break;
            }
            left -= (high - low + 1) as u64;
            found.push(Stretch { reach: [low, high], ..*stretch });
        }
        found
    }
}

fn stamp(folder: &Path) -> Stamp {
    let path = path_in(folder);
    let mut log = path.clone().into_os_string();
    log.push("-wal");
    [path, log.into()]
        .map(|path| std::fs::metadata(path).ok().and_then(|data| Some((data.modified().ok()?, data.len()))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn growing() -> Growing {
        let text = "model = \"m.toml\"\n";
        let model = "name = \"m\"\n[states.x]\nequation = \"-x\"\n";
        let study = parse_study_of_run(text, "s.toml", model, "m.toml").expect("the study is right");
        Growing {
            study: Arc::new(study),
            quantities: Vec::new().into(),
            epoch: 1,
            version: 0,
            log: Vec::new(),
            reach: HashMap::new(),
            state: "".into(),
            written: true,
            code: None,
            stamp: None,
            seen: Instant::now(),
        }
    }

    fn span(number: i64, reach: [i64; 2]) -> Span {
        Span { number, name: number.to_string(), reach: Some(reach) }
    }

    fn positions(stretches: &[Stretch]) -> Vec<(i64, i64)> {
        stretches.iter().flat_map(|own| (own.reach[0]..=own.reach[1]).map(|position| (own.branch, position))).collect()
    }

    #[test]
    fn branches_that_grow_at_both_ends_are_passed_on_once() {
        let mut growing = growing();
        growing.grow(&[span(1, [0, 2])]);
        assert_eq!(positions(&growing.since(0)), [(1, 0), (1, 1), (1, 2)]);
        growing.grow(&[span(1, [-1, 3]), span(2, [0, 0])]);
        assert_eq!(positions(&growing.since(3)), [(1, -1), (1, 3), (2, 0)]);
        assert_eq!(positions(&growing.since(4)), [(1, 3), (2, 0)]);
        assert_eq!(growing.since(6).len(), 0);
        assert_eq!((growing.epoch, growing.points()), (1, 6));
        growing.grow(&[span(1, [-1, 3]), span(2, [0, 0])]);
        assert_eq!((growing.epoch, growing.points()), (1, 6));
    }

    #[test]
    fn removed_points_begin_an_epoch() {
        let mut growing = growing();
        growing.grow(&[span(1, [0, 9]), span(2, [0, 4])]);
        growing.grow(&[span(1, [0, 9]), span(2, [0, 3])]);
        assert_eq!((growing.epoch, growing.points()), (2, 14));
        growing.grow(&[span(1, [0, 9])]);
        assert_eq!((growing.epoch, growing.points()), (3, 10));
    }

    #[test]
    fn an_answer_has_a_bounded_number_of_points() {
        let mut growing = growing();
        let long = ROWS as i64 + 10;
        growing.grow(&[span(1, [0, 5]), span(2, [0, long])]);
        let first = positions(&growing.since(0));
        assert_eq!(first.len() as u64, ROWS);
        let rest = positions(&growing.since(ROWS));
        assert_eq!(first.len() as u64 + rest.len() as u64, growing.points());
        assert_eq!(rest[0], (2, ROWS as i64 - 6));
    }
}
