//! The study of a run, and the process that computes it.
//!
//! **Idea.** The page requests nothing but a longer study, a shorter one that it had before, and stop or resume. Each is
//! checked here: the text must be a study of the same model with which the run can go on. It replaces the study file, and
//! another process of this program computes the rest. That process outlives this one.

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

/// Longest time in which a run reaches its next point and stops, on a computer with much else to do.
const STOPS: Duration = Duration::from_secs(60);
/// Pause between two looks at a run that is stopping.
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

struct Inner {
    study: PathBuf,
    folder: PathBuf,
    program: Program,
    watch: Watch,
    /// Held while a request is carried out: one at a time.
    turn: Mutex<()>,
    child: Mutex<Option<u32>>,
    over: Condvar,
}

impl Desk {
    /// Desk for the run of a study file in a folder. `child` is the process that computes it, if this one has started it.
    pub fn new(study: &Path, folder: &Path, program: Program, watch: Watch, child: Option<Child>) -> Desk {
        let inner = Inner {
            // The file itself is replaced, not a link to it.
            study: fs::canonicalize(study).unwrap_or_else(|_| study.to_path_buf()),
            folder: folder.to_path_buf(),
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
    /// The reason why the run cannot go on with it. Nothing has changed then.
    pub(crate) fn study(&self, before: &str, text: &str) -> Result<(), Refused> {
        let _turn = self.turn();
        let own = self.0.watch.study();
        if own.text != before {
            return Err("the study of the run is another one by now; look at it and try again".to_string().into());
        }
        let new = parse_study(text, &own.file, &own.model_text, &own.model_file).map_err(Refused::Mistakes)?;
        let longer = could_resume(&self.0.folder, &new);
        let shorter = foldline_store::study_file::added(&new, &own);
        if let (Err(error), Err(_)) = (&longer, &shorter) {
            return Err(error.to_string().into());
        }
        self.in_place(&own)?;
        let was_running = self.stopped()?;
        if longer.is_ok() {
            self.write(&new.text)?;
            return self.start();
        }
        shorten(&self.0.folder, &new).map_err(|error| error.to_string())?;
        self.write(&new.text)?;
        if was_running { self.start() } else { Ok(()) }
    }

    /// Asks the run to stop at its next point.
    pub(crate) fn stop(&self) -> Result<(), Refused> {
        if is_written(&self.0.folder) {
            ask_to_stop(&self.0.folder)?;
        }
        Ok(())
    }

    /// Resumes a run that is not being computed.
    pub(crate) fn resume(&self) -> Result<(), Refused> {
        let _turn = self.turn();
        if is_written(&self.0.folder) {
            return Ok(());
        }
        self.in_place(&self.0.watch.study())?;
        self.start()
    }

    /// Checks that the files on the disk are those of the run.
    fn in_place(&self, own: &Study) -> Result<(), Refused> {
        let there = read_study(&self.0.study).map_err(Refused::Mistakes)?;
        let name = self.0.study.display();
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
        let folder = &self.0.folder;
        if !is_written(folder) {
            return Ok(false);
        }
        ask_to_stop(folder)?;
        let start = Instant::now();
        while is_written(folder) {
            if start.elapsed() > STOPS {
                return Err("the run has been asked to stop but goes on; try again later".to_string().into());
            }
            std::thread::sleep(PAUSE);
        }
        self.wait(STOPS);
        Ok(true)
    }

    /// Replaces the study file. A reader sees the old text or the new one.
    fn write(&self, text: &str) -> Result<(), Refused> {
        let study = &self.0.study;
        let mut beside = study.clone().into_os_string();
        beside.push(format!(".{}.new", std::process::id()));
        let beside = PathBuf::from(beside);
        let written = (|| {
            let mut file = fs::File::create(&beside)?;
            file.write_all(text.as_bytes())?;
            file.set_permissions(fs::metadata(study)?.permissions())?;
            file.sync_all()?;
            fs::rename(&beside, study)
        })();
        written.map_err(|error: io::Error| {
            let _ = fs::remove_file(&beside);
            Refused::Because(format!("{} cannot be written: {error}", study.display()))
        })
    }

    fn start(&self) -> Result<(), Refused> {
        let exists = path_in(&self.0.folder).exists();
        let command = (self.0.program)(&self.0.study, &self.0.folder, exists);
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

    fn turn(&self) -> MutexGuard<'_, ()> {
        self.0.turn.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn child(&self) -> MutexGuard<'_, Option<u32>> {
        self.0.child.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
