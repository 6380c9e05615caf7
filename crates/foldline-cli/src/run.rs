//! `foldline run`: runs a study file and prints its table.

use crate::arguments::{Arguments, Limits, Run as Typed};
use crate::failure::{Failure, Outcome};
use crate::plot::draw;
use crate::progress::Progress;
use crate::table::{conversion, print_maps, print_special, tell_short};
use crate::verbosity::report;
use clap::CommandFactory;
use foldline::contract::{Event, Observer, Verdict};
use foldline::diagram::{Branch, Diagram, Point};
use foldline::explore;
use foldline::explore::Plan;
use foldline::explore::cells::{Asked, carry_out};
use foldline_plot::Picture;
use foldline_store::order::ordered;
use foldline_store::run_file::{Recorder, forget_stop, is_asked_to_stop, path_in};
use foldline_store::short::finished;
use foldline_store::study_file::{Study, read_study};
use std::io::{Write, stderr, stdout};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The reference study, in a clone of the repository.
const REFERENCE: &str = "studies/overhung-rotor/bouncing.toml";

/// Runs a study file.
pub fn study(typed: &Typed) -> Result<Outcome, Failure> {
    let study = limited(read_study(&typed.study)?, &typed.limits)?;
    let folder = folder_of(&typed.study, typed.out.as_deref());
    let way = Way {
        jobs: typed.jobs.map_or_else(processors, usize::from),
        resume: typed.resume,
        limit: typed.time_limit,
        units: &typed.unit,
        folder: &folder,
    };
    carried_out(&study, &way)
}

/// Folder of the run of a study: `runs/NAME` unless another one was given.
pub fn folder_of(study: &Path, given: Option<&Path>) -> PathBuf {
    given.map(Path::to_path_buf).unwrap_or_else(|| {
        let stem = study.file_stem().unwrap_or("study".as_ref());
        PathBuf::from("runs").join(stem)
    })
}

/// The study with the limits given on the command line.
pub fn limited(study: Study, limits: &Limits) -> Result<Study, Failure> {
    Ok(study.limited(limits.max_steps, limits.max_time.as_deref())?)
}

/// Options for carrying out a study.
pub struct Way<'w> {
    pub jobs: usize,
    pub resume: bool,
    pub limit: Option<Duration>,
    /// Units for display, as given on the command line.
    pub units: &'w [String],
    pub folder: &'w Path,
}

/// Runs a study in a folder, or resumes it there.
pub fn carried_out(study: &Study, way: &Way) -> Result<Outcome, Failure> {
    // Reports mistakes in the units for display before anything is computed.
    conversion(&study.model, way.units)?;
    study.model.remarks.iter().try_for_each(report)?;
    let (recorder, earlier) = match way.resume {
        true => Recorder::resume(way.folder, study)?,
        false => (Recorder::create(way.folder, study)?, Diagram::default()),
    };
    run(study, recorder, earlier, way)
}

/// In a clone of the repository, runs the reference study; elsewhere prints the help.
pub fn reference_study_or_help() -> Result<Outcome, Failure> {
    let reference = Path::new(REFERENCE);
    if reference.is_file() {
        return reference_study(reference);
    }
    writeln!(stdout(), "{}", Arguments::command().render_help())?;
    Ok(Outcome::Done)
}

/// Runs the reference study, replacing any earlier run of it, and draws it.
fn reference_study(file: &Path) -> Result<Outcome, Failure> {
    let folder = Path::new("runs").join("bouncing");
    let study = read_study(file)?;
    let way = Way { jobs: processors(), resume: false, limit: None, units: &[], folder: &folder };
    Recorder::discard(&folder)?;
    let recorder = Recorder::create(&folder, &study)?;
    let outcome = run(&study, recorder, Diagram::default(), &way)?;
    // The run may hold only part of its points in memory.
    let diagram = crate::table::read(&folder, foldline_store::run_file::Part::Everything)?.diagram;
    // At full scale the peak of contact S, r = 51.7, would squeeze everything else against the axis.
    let picture = Picture { window: Some([0.5, 12.0, 0.0, 11.0]), ..Picture::default() };
    for name in ["diagram.svg", "diagram.png"] {
        let file = folder.join(name);
        draw(&diagram, &study.model, &picture, &file)?;
        report(format_args!("picture: {}", file.display()))?;
    }
    Ok(outcome)
}

/// Number of processors: the default number of branches followed in parallel.
pub fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, |n| n.get())
}

/// Runs a study in a folder, or resumes it if its run is there already; prints what was not reached, but no table.
pub fn completed(study: &Study, folder: &Path, jobs: usize) -> Result<(Diagram, Outcome), Failure> {
    let (recorder, earlier) = match path_in(folder).exists() {
        true => Recorder::resume(folder, study)?,
        false => (Recorder::create(folder, study)?, Diagram::default()),
    };
    let way = Way { jobs, resume: true, limit: None, units: &[], folder };
    let (diagram, stopped) = carried_through(study, recorder, earlier, &way, &Clock::new(None))?;
    let whole = tell_short(&diagram, &study.plan, &study.model)?;
    report(format_args!("run: {}", folder.display()))?;
    Ok((diagram, if whole && !stopped { Outcome::Done } else { Outcome::Short }))
}

/// Carries a study out and records it. Returns the diagram, and true if it was stopped.
fn carried_through(
    study: &Study,
    recorder: Recorder,
    earlier: Diagram,
    way: &Way,
    clock: &Clock,
) -> Result<(Diagram, bool), Failure> {
    let Way { jobs, folder, .. } = *way;
    let watch = Watch { recorder, progress: Progress::new(&study.model), stop: stop_on_interrupt() };
    forget_stop(folder);
    let mut system = explore::System::of_plan(&study.model, &study.plan);
    if let (false, Some(scales)) = (earlier.branches.is_empty(), watch.recorder.scales()) {
        system = system.scaled(&study.model, scales);
    }
    let diagram = std::thread::scope(|scope| {
        scope.spawn(|| clock.run(&watch, folder));
        let _done = Done(clock);
        let mut diagram = explore::run(&system, &study.plan, jobs, earlier, &watch);
        let finished = |diagram: Diagram, plan: &Plan| finished(diagram, plan, &study.model);
        let asked = Asked { model: &study.model, plan: &study.plan, finished: &finished };
        if !watch.stopping() {
            diagram.cells = carry_out(&asked, jobs, &diagram.cells, &watch);
        }
        diagram
    });
    watch.progress.finish();
    forget_stop(folder);
    let stopped = watch.stop.load(Ordering::Relaxed);
    if stopped {
        watch.recorder.finish()?
    } else {
        watch.recorder.complete()?
    }

    Ok((ordered(diagram, &study.plan), stopped))
}

fn run(study: &Study, recorder: Recorder, earlier: Diagram, way: &Way) -> Result<Outcome, Failure> {
    let Way { limit, folder, .. } = *way;
    let clock = Clock::new(limit);
    let (diagram, stopped) = carried_through(study, recorder, earlier, way, &clock)?;
    match conversion(&study.model, way.units)? {
        Some(conversion) => print_special(&conversion.diagram(diagram.clone()), conversion.model())?,
        None => print_special(&diagram, &study.model)?,
    }
    print_maps(&diagram, &study.plan)?;
    let whole = tell_short(&diagram, &study.plan, &study.model)?;
    if !study.plan.homotopies.is_empty() {
        report(format_args!("paths of the homotopies: foldline table {} --notes", folder.display()))?;
    }
    let why = limit.filter(|_| clock.is_up()).map_or(String::new(), |limit| format!(" at the time limit of {limit:?}"));
    if stopped {
        writeln!(stderr(), "stopped{why}; continue with --resume --out {}", folder.display())?;
    }
    report(format_args!("run: {}", folder.display()))?;
    Ok(if whole && !stopped { Outcome::Done } else { Outcome::Short })
}

/// Records points, shows progress, and stops the run on request.
struct Watch {
    recorder: Recorder,
    progress: Progress,
    stop: Arc<AtomicBool>,
}

impl Observer for Watch {
    fn observe(&self, event: Event) -> Verdict {
        let verdict = self.recorder.observe(event);
        self.progress.show(event);
        if self.stopping() { Verdict::Stop } else { verdict }
    }

    fn stopping(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn stores(&self) -> bool {
        self.recorder.stores()
    }

    fn recall(&self, branch: &Branch, position: i64) -> Option<Point> {
        self.recorder.recall(branch, position)
    }
}

/// Stops a run at its time limit, and triggers progress reminders.
struct Clock {
    deadline: Option<Instant>,
    up: AtomicBool,
    over: Mutex<bool>,
    changed: Condvar,
}

/// Stops the clock when dropped, even if the run panics.
struct Done<'c>(&'c Clock);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        *self.0.over.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.0.changed.notify_all();
    }
}

impl Clock {
    /// Interval between checks: short enough for the time limit to seem immediate, long enough to cost nothing.
    const TICK: Duration = Duration::from_millis(200);

    fn new(limit: Option<Duration>) -> Clock {
        // A limit too large to represent is no limit.
        let deadline = limit.and_then(|limit| Instant::now().checked_add(limit));
        Clock { deadline, up: AtomicBool::new(false), over: Mutex::new(false), changed: Condvar::new() }
    }

    fn is_up(&self) -> bool {
        self.up.load(Ordering::Relaxed)
    }

    fn run(&self, watch: &Watch, folder: &Path) {
        let mut over = self.over.lock().unwrap_or_else(PoisonError::into_inner);
        while !*over {
            let now = Instant::now();
            if self.deadline.is_some_and(|deadline| now >= deadline) && !watch.stop.swap(true, Ordering::Relaxed) {
                self.up.store(true, Ordering::Relaxed);
            }
            if is_asked_to_stop(folder) {
                watch.stop.store(true, Ordering::Relaxed);
            }
            watch.progress.remind();
            let left = self.deadline.map_or(Clock::TICK, |deadline| deadline.saturating_duration_since(now));
            let pause = left.clamp(Duration::from_millis(1), Clock::TICK);
            over = self.changed.wait_timeout(over, pause).map_or_else(|e| e.into_inner().0, |(over, _)| over);
        }
    }
}

/// Flag set by the first Ctrl-C, after which the run ends at its next point. The second ends the program at once and
/// loses no accepted point.
pub fn stop_on_interrupt() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    let handler = move || {
        if asked.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        // The run stops even if this message cannot be shown.
        let _ = writeln!(stderr(), "stopping; press Ctrl-C again to quit at once");
    };
    // Without a handler Ctrl-C ends the program at once, and --resume still continues the run.
    let _ = ctrlc::set_handler(handler);
    stop
}
