//! Execution of studies.

use crate::diagram::Diagram;
use crate::failure;
use crate::patience::patiently;
use crate::saving::save;
use crate::solution::Solution;
use crate::study::Study;
use foldline::contract::{Event, Observer, Verdict};
use foldline::diagram::{self, Branch, Point, Shown};
use foldline::explore::cells::{Asked, carry_out};
use foldline::explore::{self, Plan};
use foldline_store::run_file::{Recorder, RunFileError, path_in};
use foldline_store::{short, study_file};
use pyo3::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Runs a study; returns the diagram, the unreached parts of the study, and the exception of the Ctrl-C that ended it
/// early, if one did.
///
/// `given` holds solutions for seeds by name, `earlier` known results. With a `folder` every point is written there as
/// it is accepted, and the diagram is not returned but can be loaded. `progress` is called with the numbers of points
/// and special points and the place of the last point, a few times a second.
#[pyfunction]
#[pyo3(signature = (study, given, earlier, folder, jobs, resume, progress))]
pub fn run(
    py: Python,
    study: &Study,
    given: HashMap<String, Py<Solution>>,
    earlier: Option<&Diagram>,
    folder: Option<PathBuf>,
    jobs: Option<usize>,
    resume: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Option<Diagram>, Vec<String>, Option<PyErr>)> {
    let study = Arc::clone(&study.study);
    let seeds = study.plan.seeds.iter().enumerate();
    let given: Vec<(usize, Point)> =
        seeds.filter_map(|(k, seed)| Some((k, (*given.get(&seed.name)?.get().point).clone()))).collect();
    let known = earlier.map(|earlier| Arc::clone(&earlier.diagram));
    let opened = |folder: &PathBuf| recorded(folder, &study, known.as_deref(), resume);
    let opened = py.detach(|| folder.as_ref().map(opened).transpose()).map_err(|e| failure::of_run_file(py, &e))?;
    let (recorder, earlier) = match opened {
        Some((recorder, earlier)) => (Some(recorder), earlier),
        None => (None, known.map_or_else(diagram::Diagram::default, |known| (*known).clone())),
    };
    let jobs = jobs.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, |n| n.get()));

    let stop = Arc::new(AtomicBool::new(false));
    let seen = Arc::new(Mutex::new(Seen::default()));
    let names = study.model.parameters.iter().map(|p| p.name.clone()).collect();
    let watch = Watch { recorder, stop: Arc::clone(&stop), seen: Arc::clone(&seen), names, notes: Mutex::default() };
    let own = Arc::clone(&study);
    let work = move || {
        let system = explore::System::of_plan(&own.model, &own.plan);
        let mut diagram = explore::run_from(&system, &own.plan, jobs, earlier, &given, &watch);
        let finished = |diagram: diagram::Diagram, plan: &Plan| short::finished(diagram, plan, &own.model);
        let asked = Asked { model: &own.model, plan: &own.plan, finished: &finished };
        if !watch.stopping() {
            diagram.cells = carry_out(&asked, jobs, &diagram.cells, &watch);
        }
        drop(system);
        let close = if watch.stop.load(Ordering::Relaxed) { Recorder::finish } else { Recorder::complete };
        let stored = watch.recorder.map(close);
        (diagram, watch.notes.into_inner().unwrap_or_else(PoisonError::into_inner), stored)
    };
    let mut show = |py: Python| match &progress {
        Some(progress) => {
            let seen = seen.lock().unwrap_or_else(PoisonError::into_inner).clone();
            progress.call1(py, (seen.points, seen.special, seen.place)).map(|_| ())
        }
        None => Ok(()),
    };
    let ((diagram, notes, stored), interrupt) = patiently(py, Some(&stop), &mut show, work)?;
    let short = short::lines(&diagram, &study.plan, &study.model);
    match stored {
        Some(Ok(())) => Ok((None, short, interrupt)),
        Some(Err(error)) => Err(failure::of_run_file(py, &error)),
        None => Ok((Some(Diagram::new(diagram, study, notes)), short, interrupt)),
    }
}

/// Returns the recorder of a folder, and the results stored there.
fn recorded(
    folder: &Path,
    study: &study_file::Study,
    known: Option<&diagram::Diagram>,
    resume: bool,
) -> Result<(Recorder, diagram::Diagram), RunFileError> {
    // Resuming a run that had not begun starts one with the known results.
    if resume && (known.is_none() || path_in(folder).exists()) {
        return Recorder::resume(folder, study);
    }
    match known {
        Some(known) => save(folder, study, known, &[]).and_then(|()| Recorder::resume(folder, study)),
        None => Ok((Recorder::create(folder, study)?, diagram::Diagram::default())),
    }
}

/// Progress.
#[derive(Clone, Default)]
struct Seen {
    points: usize,
    special: usize,
    place: String,
}

/// Records points, keeps the progress to show, and stops on request.
struct Watch {
    recorder: Option<Recorder>,
    stop: Arc<AtomicBool>,
    seen: Arc<Mutex<Seen>>,
    names: Vec<String>,
    notes: Mutex<Vec<(String, String)>>,
}

impl Watch {
    fn place(&self, branch: &Branch, point: &Point) -> String {
        let (name, value) = (self.names.get(branch.free), point.parameters.get(branch.free));
        format!(
            "{} at {} = {:.6}",
            branch.name,
            name.map_or("", String::as_str),
            Shown(value.copied().unwrap_or(f64::NAN))
        )
    }
}

impl Observer for Watch {
    fn observe(&self, event: Event) -> Verdict {
        let verdict = self.recorder.as_ref().map_or(Verdict::Continue, |recorder| recorder.observe(event));
        let seen = || self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        match event {
            Event::Point(branch, point) => {
                let place = self.place(branch, point);
                let mut seen = seen();
                seen.points += 1;
                seen.place = place;
            }
            Event::Special(..) => seen().special += 1,
            Event::Visited(name, value, done, of) => {
                seen().place = format!("{name}: {done} of {of} values, at {:.6}", Shown(value))
            }
            Event::Mapped(cell, done, of) => seen().place = format!("{}: {done} of {of} cells", cell.map),
            Event::Note(about, note) | Event::Short(about, note) => {
                let mut notes = self.notes.lock().unwrap_or_else(PoisonError::into_inner);
                notes.push((about.to_string(), note.to_string()));
            }
            _ => {}
        }
        if self.stopping() { Verdict::Stop } else { verdict }
    }

    fn stopping(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn stores(&self) -> bool {
        self.recorder.is_some()
    }

    fn recall(&self, branch: &Branch, position: i64) -> Option<Point> {
        self.recorder.as_ref()?.recall(branch, position)
    }
}
