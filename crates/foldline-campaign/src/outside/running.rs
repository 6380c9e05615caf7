//! Results of a run, and runs within this process; see [`super::command`] for runs of the command.

use super::command::Command;
use super::expectations::{Problem, Run};
use foldline::contract::{Event, Observer, Verdict};
use foldline::diagram::Diagram;
use foldline::explore::{self, System};
use foldline::model::Model;
use foldline_store::short;
use foldline_store::study_file::{Study, read_study};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, PoisonError};

/// Program that runs a study.
#[derive(Clone, Debug)]
pub enum Program {
    /// The command, in a process of its own.
    Command(Command),
    /// The library, in this process and without a limit on its time.
    Library,
}

/// End of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Exited with this code.
    Code(i32),
    /// Killed at the time limit.
    OutOfTime,
    /// Panic, signal or failure to start.
    Crashed,
}

/// Outcome of a run.
#[derive(Debug)]
pub struct Outcome {
    /// End of the run.
    pub end: End,
    /// Standard output and standard error.
    pub said: String,
    /// Results stored by then, however the run ended.
    pub stored: Option<Stored>,
}

/// Results of a run.
#[derive(Debug)]
pub struct Stored {
    /// Branches and responses.
    pub diagram: Diagram,
    /// Notes, each with its subject.
    pub notes: Vec<(String, String)>,
    /// The model.
    pub model: Model,
    /// Names of the branches and curves that the study requests.
    pub asked: Vec<String>,
    /// Names of its homotopies, whose runs may turn back.
    pub homotopies: Vec<String>,
}

impl Stored {
    /// Collects the results of a run of `study`.
    pub fn new(study: Study, diagram: Diagram, notes: Vec<(String, String)>) -> Stored {
        let (branches, curves) = (study.plan.branches.iter(), study.plan.curves.iter());
        let asked = branches.map(|b| b.name.clone()).chain(curves.map(|c| c.name.clone())).collect();
        let homotopies = study.plan.homotopies.iter().map(|h| h.name.clone()).collect();
        Stored { diagram, notes, model: study.model, asked, homotopies }
    }
}

impl Program {
    /// Runs a study.
    pub fn run(&self, problem: &Problem, run: &Run) -> Outcome {
        match self {
            Program::Command(command) => command.run(problem, run),
            Program::Library => in_process(problem, run),
        }
    }
}

/// Observer that collects notes.
#[derive(Default)]
struct Notes(Mutex<Vec<(String, String)>>);

impl Observer for Notes {
    fn observe(&self, event: Event) -> Verdict {
        if let Event::Note(about, note) = event {
            self.0.lock().unwrap_or_else(PoisonError::into_inner).push((about.to_string(), note.to_string()));
        }
        Verdict::Continue
    }
}

/// Runs a study like `foldline run`, with the same exit codes.
fn in_process(problem: &Problem, run: &Run) -> Outcome {
    let study = match read_study(&problem.folder.join(&run.file)) {
        Ok(study) => study,
        Err(found) => {
            let said = found.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n");
            return Outcome { end: End::Code(2), said, stored: None };
        }
    };
    let notes = Notes::default();
    let system = System::of_plan(&study.model, &study.plan);
    let whole = || explore::run(&system, &study.plan, 1, Diagram::default(), &notes);
    let Ok(diagram) = catch_unwind(AssertUnwindSafe(whole)) else {
        return Outcome { end: End::Crashed, said: String::new(), stored: None };
    };
    let short = short::lines(&diagram, &study.plan, &study.model);
    let end = End::Code(if short.is_empty() { 0 } else { 3 });
    let notes = notes.0.into_inner().unwrap_or_else(PoisonError::into_inner);
    Outcome {
        end,
        said: short.iter().map(|line| line.replace('\n', " ")).collect::<Vec<_>>().join("\n"),
        stored: Some(Stored::new(study, diagram, notes)),
    }
}
