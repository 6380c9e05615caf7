//! `foldline view`: a run in the browser, while it is computed and afterwards.

use crate::arguments::View as Typed;
use crate::failure::{Failure, Outcome};
use crate::new::{examples, study_text};
use crate::run::folder_of;
use crate::verbosity::report;
use foldline::explore::Plan;
use foldline::model::Model;
use foldline_store::model_file::{parse_model, read_model};
use foldline_store::run_file::{Part, Reading, could_resume, is_written, path_in};
use foldline_store::study_file::{Store, Study, is_study, read_study};
use foldline_view::{Desk, Example, Files, Program, Server, Watch, open_browser};
use std::io::{Write, stderr, stdout};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::Duration;

/// Interval between two attempts to open a run file that is being created.
const PAUSE: Duration = Duration::from_millis(20);
/// Time that a run has to stop after Ctrl-C, which its process receives too.
const PATIENCE: Duration = Duration::from_secs(5);

/// Shows a run, or starts the run of a study and shows it.
pub fn show(typed: &Typed) -> Result<Outcome, Failure> {
    let Some(what) = &typed.what else { return gallery(typed) };
    if what.is_dir() || what.file_name().is_some_and(|name| name == "run.sqlite") {
        let folder = if what.is_dir() { what.clone() } else { folder_above(what) };
        let watch = Watch::open(&folder)?;
        let desk = desk_of_run(&watch, &folder, typed);
        return served(watch, desk, &folder, typed);
    }
    // If the file cannot be read, the study reader reports why.
    let text = std::fs::read_to_string(what).unwrap_or_default();
    if !what.exists() {
        let message = format!("there is neither a run nor a study or model {}", what.display());
        return Err(Failure::typed(
            message,
            "give the folder of a run, such as runs/study, or a study or model file; without either, examples are shown",
        ));
    }
    if !text.is_empty() && !is_study(&text) {
        return model(what, typed);
    }
    let study = read_study(what)?;
    let folder = folder_of(what, typed.out.as_deref());
    let Some(mut child) = started(what, &study, &folder, typed)? else {
        let watch = Watch::open(&folder)?;
        let desk = Desk::new(files(what, &study, &folder), program(typed), watch.clone(), None);
        return served(watch, Some(desk), &folder, typed);
    };
    let watch = opened(&folder, &mut child)?;
    let desk = Desk::new(files(what, &study, &folder), program(typed), watch.clone(), Some(child));
    served(watch, Some(desk), &folder, typed)
}

fn files(study: &Path, read: &Study, folder: &Path) -> Files {
    Files { study: study.to_path_buf(), model: PathBuf::from(&read.model_file), folder: folder.to_path_buf() }
}

/// Shows a model with a study of it, of which nothing is computed before the page asks for it.
fn model(file: &Path, typed: &Typed) -> Result<Outcome, Failure> {
    let (model, model_text) = read_model(file)?;
    let stem = file.file_stem().unwrap_or("model".as_ref()).to_string_lossy().into_owned();
    let study = file.with_file_name(format!("{stem}-study.toml"));
    if study.exists() {
        let message = format!("{} exists already", study.display());
        return Err(Failure::typed(message, format!("`foldline view {}` shows it", study.display())));
    }
    let text = study_text(&model, Path::new(file.file_name().unwrap_or_default()))?;
    let folder = folder_of(&study, typed.out.as_deref());
    drafted(&folder, study, file.to_path_buf(), text, model, model_text, Vec::new(), typed)
}

/// Shows examples to begin with.
fn gallery(typed: &Typed) -> Result<Outcome, Failure> {
    let examples = examples();
    let Some(first) = examples.first() else { return Err(Failure::Outside("there are no examples".into())) };
    let model = parse_model(&first.model, "model.toml")?;
    let folder = PathBuf::from(&first.name);
    let (study, file) = (folder.join("study.toml"), folder.join("model.toml"));
    let (text, model_text) = (first.study.clone(), first.model.clone());
    drafted(&folder.join("run"), study, file, text, model, model_text, examples, typed)
}

fn drafted(
    folder: &Path,
    study: PathBuf,
    model_file: PathBuf,
    text: String,
    model: Model,
    model_text: String,
    examples: Vec<Example>,
    typed: &Typed,
) -> Result<Outcome, Failure> {
    let draft = Study {
        file: study.display().to_string(),
        text,
        model_file: model_file.display().to_string(),
        model_text,
        parameters: model.defaults(),
        model,
        plan: Plan::empty(1e-6, 4),
        store: Store::All,
        spreads: Vec::new(),
        uncertainty: false,
        figures: Vec::new(),
    };
    let watch = Watch::draft(folder, draft);
    let files = Files { study, model: model_file, folder: folder.to_path_buf() };
    let desk = Desk::with_examples(files, program(typed), watch.clone(), None, examples);
    served(watch, Some(desk), folder, typed)
}

/// Desk for a run whose study file is where it was, and as it was; otherwise the page says why the study is fixed.
fn desk_of_run(watch: &Watch, folder: &Path, typed: &Typed) -> Option<Desk> {
    let own = watch.study();
    let there = read_study(Path::new(&own.file)).ok();
    if there.is_some_and(|there| there.text == own.text && there.model_text == own.model_text) {
        return Some(Desk::new(files(Path::new(&own.file), &own, folder), program(typed), watch.clone(), None));
    }
    watch.editable(Err(format!(
        "{} is missing, or it or its model has changed since the run began; `foldline view STUDY.toml --out DIR` names it",
        own.file
    )));
    None
}

/// Command that computes the run of a study.
fn program(typed: &Typed) -> Program {
    let jobs = typed.jobs;
    Box::new(move |study, folder, resume| {
        let mut command = Command::new(std::env::current_exe()?);
        command.arg("run").arg(study).arg("--out").arg(folder);
        command.args(resume.then_some("--resume"));
        command.args(jobs.map(|jobs| format!("--jobs={jobs}")));
        Ok(command)
    })
}

fn folder_above(file: &Path) -> PathBuf {
    file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_path_buf()
}

/// Starts or resumes the run of a study in a process of its own, which outlives this one if necessary. `None` if another
/// process is computing it, or it is complete and cannot be resumed.
fn started(what: &Path, study: &Study, folder: &Path, typed: &Typed) -> Result<Option<Child>, Failure> {
    let exists = path_in(folder).exists();
    if exists {
        if is_written(folder) {
            report(format_args!("another process is computing this run"))?;
            return Ok(None);
        }
        let reading = Reading::open(folder)?;
        let stored = reading.recorded(Part::Special)?;
        let same = stored.study_text == study.text && stored.model_text == study.model_text;
        if !same && could_resume(folder, study).is_err() {
            let message = format!("the study or its model has changed since the run in {} began", folder.display());
            let cure = format!(
                "start a new run with --out DIR, or show the old one with `foldline view {}`",
                folder.display()
            );
            return Err(Failure::typed(message, cure));
        }
        if reading.is_thinned()? {
            return Ok(None);
        }
    }
    let mut command = program(typed)(what, folder, exists)?;
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).spawn();
    child.map(Some).map_err(|error| Failure::Outside(format!("the run cannot be started: {error}")))
}

/// Opens the file of a run that is starting.
fn opened(folder: &Path, child: &mut Child) -> Result<Watch, Failure> {
    loop {
        let over = child.try_wait()?;
        match Watch::open(folder) {
            Ok(watch) => return Ok(watch),
            // The process has said why.
            Err(_) if over.is_some_and(|status| status.code() == Some(2)) => {
                return Err(Failure::Typed("the run did not start".into()));
            }
            Err(error) if over.is_some() => return Err(error.into()),
            Err(_) => sleep(PAUSE),
        }
    }
}

/// Serves until Ctrl-C.
fn served(watch: Watch, desk: Option<Desk>, folder: &Path, typed: &Typed) -> Result<Outcome, Failure> {
    let server = Server::new(watch, desk.clone())
        .map_err(|error| Failure::Outside(format!("no server can be started: {error}")))?;
    let address = server.address();
    writeln!(stdout(), "{address}")?;
    stdout().flush()?;
    report(format_args!("showing {}; the address works once; Ctrl-C ends the server", folder.display()))?;
    if !typed.no_browser && !open_browser(&address) {
        report(format_args!("no browser can be opened here; open the address in one on this computer"))?;
    }
    let (stop, again) = (server.stopper(), AtomicBool::new(false));
    let handler = move || {
        if again.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        stop.stop();
    };
    // Without a handler Ctrl-C ends the program at once, which harms nothing.
    let _ = ctrlc::set_handler(handler);
    server.run().map_err(|error| Failure::Outside(format!("the server has failed: {error}")))?;
    if let Some(desk) = desk
        && !desk.wait(PATIENCE)
        && let Some(process) = desk.process()
    {
        let folder = folder.display();
        writeln!(stderr(), "the run continues in process {process}; `foldline view {folder}` shows it again")?;
    }
    Ok(Outcome::Done)
}

impl From<foldline_view::Failure> for Failure {
    fn from(error: foldline_view::Failure) -> Failure {
        match error {
            foldline_view::Failure::Run(error) => error.into(),
            foldline_view::Failure::Study(found) => found.into(),
            foldline_view::Failure::Output(..) => Failure::Outside(error.to_string()),
        }
    }
}
