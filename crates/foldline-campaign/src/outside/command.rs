//! Runs of the command in a separate process with limited processor time.

use super::expectations::{Problem, Run};
use super::running::{End, Outcome, Stored};
use foldline_store::run_file;
use foldline_store::study_file::parse_study;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{self, Child, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Ratio of the wall-clock limit to the processor-time limit: a safety factor for a machine under load.
const WALL: u32 = 10;

/// Command, and the folder for its runs.
#[derive(Clone, Debug)]
pub struct Command {
    /// Path of the binary.
    pub binary: PathBuf,
    /// Folder for runs.
    pub out: PathBuf,
}

impl Command {
    /// Runs a study in a new folder and reads back the stored results, however the run ended.
    pub fn run(&self, problem: &Problem, run: &Run) -> Outcome {
        let folder = self.out.join(&problem.name).join(run.name().replace([' ', '(', ')'], "_"));
        let _ = std::fs::remove_dir_all(&folder);
        let _ = std::fs::create_dir_all(&folder);
        let stored = folder.join("run");
        let texts = ["out.txt", "err.txt"].map(|name| folder.join(name));
        let end = self
            .started(problem, run, &stored, &texts)
            .map_or(End::Crashed, |child| ended(child, Duration::from_secs(run.seconds) * WALL));
        let said =
            texts.iter().map(|text| std::fs::read_to_string(text).unwrap_or_default()).collect::<Vec<_>>().join("\n");
        Outcome { end, said, stored: read(&stored) }
    }

    fn started(&self, problem: &Problem, run: &Run, stored: &Path, texts: &[PathBuf; 2]) -> std::io::Result<Child> {
        let mut words: Vec<String> = vec![self.binary.to_string_lossy().into_owned()];
        let (name, rest) = run.command.split_first().map_or(("run", &[][..]), |(name, rest)| (name.as_str(), rest));
        words.push(name.to_string());
        words.push(problem.folder.join(&run.file).to_string_lossy().into_owned());
        words.extend(rest.iter().cloned());
        if ["run", "explore"].contains(&name) {
            words.extend(["--out".to_string(), stored.to_string_lossy().into_owned(), "--jobs".into(), "1".into()]);
        }
        let [out, err] = [File::create(&texts[0])?, File::create(&texts[1])?];
        limited(&words, run.seconds).stdin(Stdio::null()).stdout(out).stderr(err).spawn()
    }
}

/// Returns the command with a limit on its processor time, if the system supports one.
#[cfg(unix)]
fn limited(words: &[String], seconds: u64) -> process::Command {
    let mut command = process::Command::new("sh");
    command.args(["-c", "ulimit -t \"$0\"; exec \"$@\"", &seconds.to_string()]).args(words);
    command
}

#[cfg(not(unix))]
fn limited(words: &[String], _seconds: u64) -> process::Command {
    let mut command = process::Command::new(&words[0]);
    command.args(&words[1..]);
    command
}

fn ended(mut child: Child, limit: Duration) -> End {
    let start = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return status.code().map_or_else(|| signalled(status), End::Code),
            Ok(None) if start.elapsed() > limit => {
                let _ = child.kill();
                let _ = child.wait();
                return End::OutOfTime;
            }
            Ok(None) => std::thread::sleep(Duration::from_millis(5)),
            Err(_) => return End::Crashed,
        }
    }
}

#[cfg(unix)]
fn signalled(status: ExitStatus) -> End {
    use std::os::unix::process::ExitStatusExt;
    // SIGXCPU, or SIGKILL if the hard limit is reached first.
    if matches!(status.signal(), Some(9 | 24)) { End::OutOfTime } else { End::Crashed }
}

#[cfg(not(unix))]
fn signalled(_status: ExitStatus) -> End {
    End::Crashed
}

fn read(folder: &Path) -> Option<Stored> {
    let run = run_file::load_part(folder, run_file::Part::Numbers).ok()?;
    let study = parse_study(&run.study_text, &run.study_file, &run.model_text, &run.model_file).ok()?;
    Some(Stored::new(study, run.diagram, run.notes))
}
