//! The study of a run, and the process that computes it.
//!
//! **Idea.** The page can request only a longer study, an earlier shorter one, and to stop or resume. Each request is
//! checked here: the text must be a study of the same model with which the run can go on. It then replaces the study
//! file, and another process of this program, which outlives this one, computes the rest.

use crate::watch::Watch;
use foldline_store::diagnostic::Diagnostic;
use foldline_store::run_file::{ask_to_stop, could_resume, is_written, path_in, shorten};
use foldline_store::study_file::{Study, parse_study, read_study};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Longest time in which a run reaches its next point and stops, on a busy computer.
const STOPS: Duration = Duration::from_secs(60);
/// Interval between two checks of a run that is stopping.
const PAUSE: Duration = Duration::from_millis(20);

/// Returns the command that computes the run of a study in a folder; `true` resumes it.
pub type Program = Box<dyn Fn(&Path, &Path, bool) -> io::Result<Command> + Send + Sync>;

/// Reason why a request is refused.
#[derive(Debug)]
pub(crate) enum Refused {
    /// A sentence for the user.
    Because(String),
    /// Mistakes in the text.
    Mistakes(Vec<Diagnostic>),
}

impl From<String> for Refused {
    fn from(why: String) -> Refused {
        Refused::Because(why)
    }
}

impl From<io::Error> for Refused {
    fn from(error: io::Error) -> Refused {
        Refused::Because(error.to_string())
    }
}

/// Study and process of one run.
#[derive(Clone)]
pub struct Desk(Arc<Inner>);

/// Files of a run.
#[derive(Clone, Debug)]
pub struct Files {
    /// The study file.
    pub study: PathBuf,
    /// The model file.
    pub model: PathBuf,
    /// Folder of the run.
    pub folder: PathBuf,
}

/// Example: a model and a study.
#[derive(Clone, Debug)]
pub struct Example {
    /// Its name, also that of its folder.
    pub name: String,
    /// Its subject, in a sentence.
    pub about: String,
    /// Text of the model.
    pub model: String,
    /// Text of the study.
    pub study: String,
}

struct Inner {
    files: Mutex<Files>,
    /// Examples, offered while nothing has been computed.
    examples: Vec<Example>,
    program: Program,
    watch: Watch,
    /// Held while a request is carried out: one at a time.
    turn: Mutex<()>,
    child: Mutex<Option<u32>>,
    over: Condvar,
}

impl Desk {
    /// Desk for a run. `child` is the process that computes it, if this one has started it.
    pub fn new(files: Files, program: Program, watch: Watch, child: Option<Child>) -> Desk {
        Desk::with_examples(files, program, watch, child, Vec::new())
    }

    /// Desk with examples, without a run.
    pub fn with_examples(
        mut files: Files,
        program: Program,
        watch: Watch,
        child: Option<Child>,
        examples: Vec<Example>,
    ) -> Desk {
        // The files themselves are replaced, not links to them.
        for file in [&mut files.study, &mut files.model] {
            *file = fs::canonicalize(&*file).unwrap_or_else(|_| file.clone());
        }
        let inner = Inner {
            files: Mutex::new(files),
            examples,
            program,
            watch,
            turn: Mutex::new(()),
            child: Mutex::new(None),
            over: Condvar::new(),
        };
        let desk = Desk(Arc::new(inner));
        desk.0.watch.editable(Ok(()));
        if let Some(child) = child {
            desk.attend(child);
        }
        desk
    }

    /// Models to begin with.
    pub(crate) fn examples(&self) -> &[Example] {
        &self.0.examples
    }

    /// Selects an example, of which nothing is computed or written yet.
    pub(crate) fn example(&self, index: usize) -> Result<(), Refused> {
        let _turn = self.turn();
        let own = self.0.examples.get(index).ok_or_else(|| "there is no such example".to_string())?;
        let folder = PathBuf::from(&own.name);
        let files =
            Files { study: folder.join("study.toml"), model: folder.join("model.toml"), folder: folder.join("run") };
        let (study, model) = (files.study.display().to_string(), files.model.display().to_string());
        let study = parse_study(&own.study, &study, &own.model, &model).map_err(Refused::Mistakes)?;
        if let Some(there) = [&files.study, &files.model, &files.folder].into_iter().find(|file| file.exists()) {
            return Err(format!("{} exists already; open it with `foldline view`", there.display()).into());
        }
        self.0.watch.turn_to(&files.folder, study);
        *self.files_lock() = files;
        Ok(())
    }

    /// Computes a study of a model from the beginning, in a new folder. Both files are written.
    ///
    /// # Errors
    /// The reason why the files cannot be written or the run cannot be started.
    pub(crate) fn anew(&self, model: &str, text: &str) -> Result<(), Refused> {
        let _turn = self.turn();
        let (own, mut files) = (self.0.watch.study(), self.files());
        let new = parse_study(text, &own.file, model, &own.model_file).map_err(Refused::Mistakes)?;
        let fresh = !files.study.exists();
        if fresh {
            let there = fs::read_to_string(&files.model).ok();
            if there.is_some_and(|there| there != own.model_text) {
                return Err(format!("{} was changed elsewhere", files.model.display()).into());
            }
        } else {
            self.in_place(&own)?;
        }
        self.stopped()?;
        if let Some(folder) = files.study.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            fs::create_dir_all(folder)?;
        }
        if fs::read_to_string(&files.model).ok().as_deref() != Some(model) {
            written(&files.model, model)?;
        }
        written(&files.study, text)?;
        let there = read_study(&files.study).map_err(Refused::Mistakes)?;
        if there.model_text != model {
            return Err(format!("`model` of the study names another file than {}", files.model.display()).into());
        }
        if path_in(&files.folder).exists() {
            files.folder = unused(&files.folder);
        }
        self.0.watch.turn_to(&files.folder, new);
        *self.files_lock() = files;
        self.start()
    }

    /// Number of the process that computes the run, if this one has started it and it has not ended.
    pub fn process(&self) -> Option<u32> {
        *self.child()
    }

    /// Waits until the process has ended. Returns false if it has not at the end of the time.
    pub fn wait(&self, time: Duration) -> bool {
        let child = self.child();
        let waited = self.0.over.wait_timeout_while(child, time, |child| child.is_some());
        waited.map_or_else(|error| error.into_inner().0.is_none(), |(child, _)| child.is_none())
    }

    /// Goes on with a study, longer or shorter than the one so far, `before`.
    ///
    /// # Errors
    /// The reason why the run cannot go on with it; nothing is changed in that case.
    pub(crate) fn study(&self, before: &str, text: &str) -> Result<(), Refused> {
        let _turn = self.turn();
        let own = self.0.watch.study();
        if own.text != before {
            return Err("the study of the run is another one by now; look at it and try again".to_string().into());
        }
        let new = parse_study(text, &own.file, &own.model_text, &own.model_file).map_err(Refused::Mistakes)?;
        let files = self.files();
        let longer = could_resume(&files.folder, &new);
        let shorter = foldline_store::study_file::added(&new, &own);
        if let (Err(error), Err(_)) = (&longer, &shorter) {
            return Err(error.to_string().into());
        }
        self.in_place(&own)?;
        let was_running = self.stopped()?;
        if longer.is_ok() {
            written(&files.study, &new.text)?;
            return self.start();
        }
        shorten(&files.folder, &new).map_err(|error| error.to_string())?;
        // Numbers of branches may be used again.
        self.0.watch.look().map_err(|error| error.to_string())?;
        written(&files.study, &new.text)?;
        if was_running { self.start() } else { Ok(()) }
    }

    /// Asks the run to stop at its next point.
    pub(crate) fn stop(&self) -> Result<(), Refused> {
        let Files { folder, .. } = self.files();
        if is_written(&folder) {
            ask_to_stop(&folder)?;
        }
        Ok(())
    }

    /// Resumes a run that is not being computed.
    pub(crate) fn resume(&self) -> Result<(), Refused> {
        let _turn = self.turn();
        if is_written(&self.files().folder) {
            return Ok(());
        }
        self.in_place(&self.0.watch.study())?;
        self.start()
    }

    /// Checks that the files on the disk are those of the run.
    fn in_place(&self, own: &Study) -> Result<(), Refused> {
        let files = self.files();
        let there = read_study(&files.study).map_err(Refused::Mistakes)?;
        let name = files.study.display();
        if there.text != own.text {
            return Err(format!("{name} is not the study of this run any more; it was changed elsewhere").into());
        }
        if there.model_text != own.model_text {
            return Err(format!("the model of {name} has changed since the run began").into());
        }
        Ok(())
    }

    /// Stops the run if it is being computed. Returns true if it was.
    fn stopped(&self) -> Result<bool, Refused> {
        let Files { folder, .. } = &self.files();
        if !is_written(folder) {
            return Ok(false);
        }
        ask_to_stop(folder)?;
        let start = Instant::now();
        while is_written(folder) {
            if start.elapsed() > STOPS {
                return Err("the run was asked to stop but has not stopped yet; try again later".to_string().into());
            }
            std::thread::sleep(PAUSE);
        }
        self.wait(STOPS);
        Ok(true)
    }

    fn start(&self) -> Result<(), Refused> {
        let files = self.files();
        let exists = path_in(&files.folder).exists();
        let command = (self.0.program)(&files.study, &files.folder, exists);
        let child = command.and_then(|mut command| command.stdin(Stdio::null()).stdout(Stdio::null()).spawn());
        self.attend(child.map_err(|error| format!("the run cannot be started: {error}"))?);
        Ok(())
    }

    /// Waits for the end of a process in a thread of its own.
    fn attend(&self, mut child: Child) {
        self.0.watch.started();
        *self.child() = Some(child.id());
        let desk = self.clone();
        std::thread::spawn(move || {
            let code = child.wait().ok().and_then(|status| status.code()).unwrap_or(1);
            desk.0.watch.ended(code);
            *desk.child() = None;
            desk.0.over.notify_all();
        });
    }

    fn files(&self) -> Files {
        self.files_lock().clone()
    }

    fn files_lock(&self) -> MutexGuard<'_, Files> {
        self.0.files.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn turn(&self) -> MutexGuard<'_, ()> {
        self.0.turn.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn child(&self) -> MutexGuard<'_, Option<u32>> {
        self.0.child.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Replaces a file, or creates it. A reader sees the old text or the new one.
fn written(file: &Path, text: &str) -> Result<(), Refused> {
    let mut beside = file.to_path_buf().into_os_string();
    beside.push(format!(".{}.new", std::process::id()));
    let beside = PathBuf::from(beside);
    let done = (|| {
        let mut new = fs::File::create(&beside)?;
        new.write_all(text.as_bytes())?;
        if let Ok(old) = fs::metadata(file) {
            new.set_permissions(old.permissions())?;
        }
        new.sync_all()?;
        fs::rename(&beside, file)
    })();
    done.map_err(|error: io::Error| {
        let _ = fs::remove_file(&beside);
        Refused::Because(format!("{} cannot be written: {error}", file.display()))
    })
}

/// The first of `FOLDER-2`, `FOLDER-3`, … that does not exist.
fn unused(folder: &Path) -> PathBuf {
    let numbered = |k: usize| {
        let mut name = folder.to_path_buf().into_os_string();
        name.push(format!("-{k}"));
        PathBuf::from(name)
    };
    (2..).map(numbered).find(|folder| !folder.exists()).unwrap_or_else(|| folder.to_path_buf())
}
