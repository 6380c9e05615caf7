//! The tests of the workspace, two programs at a time: several of them end with one long test, which leaves a core idle.

use crate::{cargo, cargo_path, root};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::time::Instant;

const WORKSPACE: [&str; 3] = ["test", "--workspace", "--quiet"];

/// Packages whose longest test takes minutes on one core; they start first.
const LONGEST: [&str; 2] = ["foldline-reproduce", "foldline-campaign"];

/// A program of tests.
struct Program {
    executable: PathBuf,
    /// Folder of its package, where it runs.
    package: PathBuf,
}

impl Program {
    fn name(&self) -> String {
        let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let executable = name(&self.executable);
        let target = executable.rsplit_once('-').map_or(executable.as_str(), |(target, _)| target);
        format!("{} ({target})", name(&self.package))
    }

    /// Runs the tests, then prints their last line, or everything if one has failed.
    fn passes(&self) -> bool {
        let start = Instant::now();
        let mut command = Command::new(&self.executable);
        command.current_dir(&self.package).args(["--quiet"]).env("CARGO_MANIFEST_DIR", &self.package);
        let output = match command.output() {
            Ok(output) => output,
            Err(error) => {
                eprintln!("{}: {error}", self.executable.display());
                return false;
            }
        };
        let [said, complained] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
        let passed = output.status.success();
        if !passed {
            eprintln!("{said}\n{complained}");
        }
        let last = said.lines().rfind(|line| line.starts_with("test result")).unwrap_or("no result");
        eprintln!("{}: {last}; {:.0} s", self.name(), start.elapsed().as_secs_f64());
        passed
    }
}

/// Programs of the tests of the workspace, built.
pub struct Built(Vec<Program>);

/// Builds every test.
pub fn build() -> Option<Built> {
    let format = ["--no-run", "--message-format", "json-render-diagnostics"];
    let arguments = [&WORKSPACE[..], &format[..]].concat();
    eprintln!("cargo {}", arguments.join(" "));
    let output = Command::new(cargo_path())
        .args(arguments)
        .current_dir(root())
        .stderr(std::process::Stdio::inherit())
        .output()
        .inspect_err(|error| eprintln!("cargo: {error}"))
        .ok()?;
    let messages = String::from_utf8_lossy(&output.stdout);
    let mut programs: Vec<Program> = messages.lines().filter_map(program).collect();
    programs.sort_by_key(|program| !LONGEST.iter().any(|name| program.package.ends_with(name)));
    (output.status.success() && !programs.is_empty()).then_some(Built(programs))
}

/// Program that a message of Cargo names, if it consists of tests.
fn program(message: &str) -> Option<Program> {
    let field = |name: &str| {
        let (_, rest) = message.split_once(&format!("\"{name}\":\""))?;
        Some(PathBuf::from(rest.split_once('"')?.0.replace("\\\\", "\\")))
    };
    // The description of the target, which comes before the profile, has a field of the same name.
    let tests = message.split_once("\"profile\":").is_some_and(|(_, profile)| profile.contains("\"test\":true},"));
    let package = field("manifest_path")?.parent()?.to_path_buf();
    tests.then_some(Program { executable: field("executable")?, package })
}

/// Runs every program and the examples of the documentation; true if all tests passed.
pub fn pass(Built(programs): Built) -> bool {
    let queue = Mutex::new(VecDeque::from(programs));
    let next = || queue.lock().ok()?.pop_front();
    let work = || std::iter::from_fn(&next).map(|program| program.passes()).filter(|passed| !passed).count();
    let failed: usize = std::thread::scope(|scope| {
        let workers = [scope.spawn(work), scope.spawn(work)];
        workers.into_iter().map(|worker| worker.join().unwrap_or(1)).sum()
    });
    cargo(&[&WORKSPACE[..], &["--doc"]].concat()) && failed == 0
}
