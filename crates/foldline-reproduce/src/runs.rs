//! Runs of studies: each computed once, recorded, and reused by every figure and by later calls.
//!
//! **Idea.** The run of a study is stored in `OUT/runs/NAME`, as by `foldline run`. Beside it, `finished` records which
//! program version computed it and how long that took. A finished run of the same study text, model text and version is
//! read back; an unfinished one is resumed; any other is discarded and recomputed.

mod tables;

pub use tables::{Table, in_parallel};

use crate::Request;
use crate::publication::{Publication, StudyPlan};
use foldline::contract::{Event, Observer, Verdict};
use foldline::diagram::{Branch, Diagram, Kind, Point, Responses, SpecialPoint};
use foldline::explore::{self, Plan, System, growth, known};
use foldline_store::order::ordered;
use foldline_store::run_file::{Recorded, Recorder, RunFileError, load};
use foldline_store::short;
use foldline_store::study_file::{Study, parse_study};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Version of this program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Version and fingerprint of the program file, since another build may give other numbers.
pub(crate) fn build() -> &'static str {
    static BUILD: OnceLock<String> = OnceLock::new();
    BUILD.get_or_init(|| {
        let mut hasher = DefaultHasher::new();
        let program = std::env::current_exe().and_then(std::fs::read).unwrap_or_default();
        hasher.write(&program);
        format!("{VERSION} {:016x}", hasher.finish())
    })
}

/// A completed run of a study.
pub struct Run {
    /// The study with its model and plan.
    pub study: Study,
    /// Results.
    pub diagram: Diagram,
    /// Computing time in seconds, in this call or an earlier one.
    pub seconds: f64,
    /// True if the run existed already.
    pub reused: bool,
    /// Unreached parts of the study, one line each.
    pub short: Vec<String>,
    /// Remarks: subject and text.
    pub notes: Vec<(String, String)>,
}

impl Run {
    /// Returns the branch of that name.
    ///
    /// # Errors
    /// The branch is missing or has no points; the message gives the reason.
    pub fn branch(&self, name: &str) -> Result<&Branch, String> {
        let branch =
            self.diagram.branch(name).ok_or_else(|| format!("{}: there is no branch {name}", self.study.file))?;
        if branch.points.is_empty() {
            let why = branch.ends.iter().flatten().next().map_or("no reason was recorded".into(), ToString::to_string);
            return Err(format!("{}: the branch {name} has no points: {why}", self.study.file));
        }
        Ok(branch)
    }

    /// Index of a parameter; 0 if the model has none of that name.
    pub fn parameter(&self, name: &str) -> usize {
        self.study.model.parameter_index(name).unwrap_or(0)
    }

    /// Returns every solution of a branch at a value of its parameter, corrected there, by increasing position.
    ///
    /// # Errors
    /// There is no such branch, or it has no solution there.
    pub fn at(&self, name: &str, value: f64) -> Result<Vec<Point>, String> {
        let branch = self.branch(name)?;
        let system = System::of_plan(&self.study.model, &self.study.plan);
        let everywhere = [f64::NEG_INFINITY, f64::INFINITY];
        let settings = growth::settings(&system, self.study.plan.tolerance, everywhere, 0);
        let found = known::solutions_at(&system, &settings, branch, value);
        if found.is_empty() { Err(format!("the branch {name} has no solution at {value}")) } else { Ok(found) }
    }

    /// Returns the solution of a branch that minimises a quantity, and a bound on the error of the minimum.
    ///
    /// # Errors
    /// There is no such branch.
    pub fn least(&self, name: &str, quantity: &dyn Fn(&Point) -> f64) -> Result<(Point, f64), String> {
        let branch = self.branch(name)?;
        let system = System::of_plan(&self.study.model, &self.study.plan);
        let everywhere = [f64::NEG_INFINITY, f64::INFINITY];
        let settings = growth::settings(&system, self.study.plan.tolerance, everywhere, 0);
        known::least(&system, &settings, branch, quantity).ok_or_else(|| format!("the branch {name} has no points"))
    }

    /// Returns the survey or sweep of that name.
    ///
    /// # Errors
    /// There is none.
    pub fn responses(&self, name: &str) -> Result<&Responses, String> {
        let found = self.diagram.response_set(name);
        found.ok_or_else(|| format!("{}: the simulation {name} is incomplete", self.study.file))
    }

    /// Returns the special points of that kind on a branch.
    ///
    /// # Errors
    /// There is no such branch.
    pub fn special(&self, name: &str, kind: Kind) -> Result<Vec<&SpecialPoint>, String> {
        Ok(self.branch(name)?.special.iter().filter(|s| s.kind == kind).collect())
    }

    /// Value of a parameter at a special point, and its error.
    pub fn place(&self, index: usize, special: &SpecialPoint) -> [f64; 2] {
        let value = special.point.parameters[index];
        let size = self.diagram.branches.iter().find(|branch| branch.free == index).map(|branch| branch.size(value));
        [value, special.error * size.unwrap_or(1.0 + value.abs())]
    }
}

/// Runs of a publication, computed on first request.
pub struct Runs<'r> {
    publication: &'static Publication,
    folder: PathBuf,
    jobs: usize,
    tolerance: Option<f64>,
    stop: &'r AtomicBool,
    say: &'r (dyn Fn(&str) + Sync),
    /// Weights of the studies still to run.
    ahead: BTreeMap<&'static str, f64>,
    /// Nominal and measured seconds of completed runs.
    pace: [f64; 2],
    done: BTreeMap<&'static str, Result<Run, String>>,
}

impl<'r> Runs<'r> {
    /// Returns the runs for a request, with nothing computed yet.
    pub fn new(request: &Request<'r>) -> Runs<'r> {
        let publication = request.publication;
        let needed = |study: &&StudyPlan| request.figures.iter().any(|figure| figure.runs.contains(&study.name));
        let ahead = publication.studies.iter().filter(needed).map(|study| (study.name, study.weight)).collect();
        Runs {
            publication,
            folder: request.out.join("runs"),
            jobs: request.jobs,
            tolerance: request.tolerance,
            stop: request.stop,
            say: request.say,
            ahead,
            pace: [0.0; 2],
            done: BTreeMap::new(),
        }
    }

    /// Returns the run of that name.
    ///
    /// # Errors
    /// The run failed; the message gives the reason.
    pub fn run(&self, name: &str) -> Result<&Run, String> {
        match self.done.get(name) {
            Some(Ok(run)) => Ok(run),
            Some(Err(why)) => Err(format!("the run {name} failed: {why}")),
            None => Err(format!("the run {name} was not requested")),
        }
    }

    /// Number of threads to use.
    pub fn jobs(&self) -> usize {
        self.jobs
    }

    /// All runs by name; failed ones with the reason.
    pub fn all(&self) -> impl Iterator<Item = (&'static str, &Result<Run, String>)> {
        self.done.iter().map(|(name, run)| (*name, run))
    }

    /// Runs that failed or ended short, one line each.
    pub fn failures(&self) -> Vec<String> {
        let lines = |(name, run): (&str, &Result<Run, String>)| match run {
            Ok(run) => run.short.iter().map(|line| format!("run {name}: {line}")).collect(),
            Err(why) => vec![format!("run {name}: {why}")],
        };
        self.all().flat_map(lines).collect()
    }

    /// Computes a run, unless it exists or is known to have failed.
    pub fn compute(&mut self, name: &'static str) {
        if self.done.contains_key(name) || self.stop.load(Ordering::Relaxed) {
            return;
        }
        let Some(plan) = self.publication.study(name) else {
            self.done.insert(name, Err("there is no such study".into()));
            return;
        };
        (self.say)(&format!("run {name}{}", self.estimate()));
        let run = self.carried_out(plan);
        self.ahead.remove(name);
        if let Ok(run) = &run
            && !run.reused
        {
            self.pace = [self.pace[0] + plan.weight, self.pace[1] + run.seconds];
        }
        self.done.insert(name, run);
    }

    /// Estimate of the time left, at the measured speed.
    fn estimate(&self) -> String {
        let speed = if self.pace[0] > 0.0 { self.pace[1] / self.pace[0] } else { 1.0 };
        let seconds = speed * self.ahead.values().sum::<f64>();
        let time = match seconds {
            s if s < 1.5 => "a second".to_string(),
            s if s < 90.0 => format!("{s:.0} s"),
            s => format!("{:.0} min", s / 60.0),
        };
        format!(" ({} runs left, about {time})", self.ahead.len())
    }

    fn carried_out(&self, plan: &StudyPlan) -> Result<Run, String> {
        let parsed = parse_study(plan.text, plan.file, plan.model, plan.model_file);
        let mut study = parsed.map_err(|found| found.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))?;
        if let Some(tolerance) = self.tolerance {
            quick(&mut study.plan, tolerance);
        }
        let folder = self.folder.join(plan.name);
        let name = format!("{}, tolerance {:e}", build(), study.plan.tolerance);
        if let Some((recorded, seconds)) = finished(&folder, &study, &name) {
            return Ok(whole(study, recorded.diagram, recorded.notes, seconds, true));
        }
        let start = Instant::now();
        let (recorder, earlier) = opened(&folder, &study).map_err(|error| error.to_string())?;
        let watch = Watch { recorder, stop: self.stop, say: self.say, pace: Mutex::default() };
        let system = System::of_plan(&study.model, &study.plan);
        let diagram = explore::run(&system, &study.plan, self.jobs, earlier, &watch);
        watch.recorder.finish().map_err(|error| error.to_string())?;
        let seconds = start.elapsed().as_secs_f64();
        if self.stop.load(Ordering::Relaxed) {
            return Err("stopped".into());
        }
        let mark = format!("{name}\n{seconds}\n");
        std::fs::write(folder.join(FINISHED), mark).map_err(|error| format!("{}: {error}", folder.display()))?;
        let notes = load(&folder).map_err(|error| error.to_string())?.notes;
        Ok(whole(study, diagram, notes, seconds, false))
    }
}

const FINISHED: &str = "finished";

fn whole(study: Study, diagram: Diagram, notes: Vec<(String, String)>, seconds: f64, reused: bool) -> Run {
    let short = short::lines(&diagram, &study.plan, &study.model);
    let diagram = ordered(diagram, &study.plan);
    Run { study, diagram, seconds, reused, short, notes }
}

/// Returns a finished run of the same texts under that name, which includes version and tolerance, and its computing
/// time.
fn finished(folder: &Path, study: &Study, name: &str) -> Option<(Recorded, f64)> {
    let mark = std::fs::read_to_string(folder.join(FINISHED)).ok()?;
    let (of, seconds) = mark.split_once('\n')?;
    let recorded = load(folder).ok()?;
    let same = of == name && recorded.study_text == study.text && recorded.model_text == study.model_text;
    same.then_some((recorded, seconds.trim().parse().ok()?))
}

/// Returns a recorder for an unfinished run of the same texts, or for a new one.
fn opened(folder: &Path, study: &Study) -> Result<(Recorder, Diagram), RunFileError> {
    let marked = folder.join(FINISHED);
    if !marked.exists() {
        match Recorder::resume(folder, study) {
            Ok(opened) => return Ok(opened),
            // Another study, another model, or no usable run: start a new one.
            Err(RunFileError::Missing(_) | RunFileError::Changed(..) | RunFileError::Damaged(..)) => {}
            Err(error) => return Err(error),
        }
    }
    Recorder::discard(folder)?;
    match std::fs::remove_file(&marked) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(RunFileError::Folder(marked, error)),
        _ => Ok((Recorder::create(folder, study)?, Diagram::default())),
    }
}

/// Sets another tolerance. A coarser one means a quick look, for which surveys visit every twelfth value with fewer
/// starts.
fn quick(plan: &mut Plan, tolerance: f64) {
    if tolerance > plan.tolerance {
        for survey in &mut plan.surveys {
            survey.values = survey.values.iter().copied().step_by(12).collect();
            survey.starts = survey.starts.div_ceil(4);
        }
    }
    plan.tolerance = tolerance;
}

/// Records points, reports the progress of simulations, and stops on request.
struct Watch<'w> {
    recorder: Recorder,
    stop: &'w AtomicBool,
    say: &'w (dyn Fn(&str) + Sync),
    /// Start and last report of every survey and sweep.
    pace: Mutex<BTreeMap<String, [Instant; 2]>>,
}

impl Watch<'_> {
    /// Reports progress every few seconds.
    fn visited(&self, name: &str, done: usize, of: usize) {
        const BETWEEN: Duration = Duration::from_secs(3);
        let mut pace = self.pace.lock().unwrap_or_else(PoisonError::into_inner);
        let now = Instant::now();
        let [begun, told] = pace.entry(name.to_string()).or_insert([now; 2]);
        if now.duration_since(*told) < BETWEEN || done >= of {
            return;
        }
        *told = now;
        // The clock started with the first value.
        let left = now.duration_since(*begun).as_secs_f64() * (of - done) as f64 / done.max(2).saturating_sub(1) as f64;
        (self.say)(&format!("  {name}: {done} of {of} values, about {left:.0} s left"));
    }
}

impl Observer for Watch<'_> {
    fn observe(&self, event: Event) -> Verdict {
        if let Event::Visited(name, _, done, of) = event {
            self.visited(name, done, of);
        }
        let verdict = self.recorder.observe(event);
        if self.stop.load(Ordering::Relaxed) { Verdict::Stop } else { verdict }
    }

    fn stopping(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
