//! Time and memory used by another program.
//!
//! **Idea.** The system reports the total time of all children of a process, and the memory of the largest. Each
//! program is therefore run by a copy of this one that has no other child.

use crate::Outcome;
use nix::sys::resource::{UsageWho, getrusage};
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;

/// Resources used by a program.
#[derive(Clone, Copy, Debug)]
pub struct Usage {
    /// Processor time in seconds, including that of the system.
    pub cpu: f64,
    /// Wall time in seconds.
    pub wall: f64,
    /// Largest resident memory in MB (10⁶ bytes).
    pub memory: f64,
}

/// Prefix of the line of numbers in the output of the program.
const MARK: &str = "foldline-bench took";

/// Runs a program in a folder and returns the resources used and its standard output. An exit code other than 0 or one
/// of `allowed` is an error.
pub fn run(program: &Path, arguments: &[&str], folder: &Path, allowed: &[i32]) -> Outcome<(Usage, String)> {
    let out = Command::new(std::env::current_exe()?)
        .arg("measure")
        .arg(program)
        .args(arguments)
        .current_dir(folder)
        .env("OMP_NUM_THREADS", "1")
        .output()?;
    let (text, complaint) = (String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
    let code = out.status.code().unwrap_or(-1);
    if code != 0 && !allowed.contains(&code) {
        return Err(format!("{} {}: exit code {code}\n{complaint}", program.display(), arguments.join(" ")).into());
    }
    let line = complaint.lines().find_map(|line| line.strip_prefix(MARK));
    let numbers: Vec<f64> = line.unwrap_or("").split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let [cpu, wall, memory] = numbers[..] else { return Err(format!("{}: no measurement", program.display()).into()) };
    Ok((Usage { cpu, wall, memory }, text.into_owned()))
}

/// Runs the command in the copy of this program and prints the resources used on standard error.
pub fn measured(command: &[String]) -> ExitCode {
    let Some((program, arguments)) = command.split_first() else { return ExitCode::FAILURE };
    let start = Instant::now();
    let status = Command::new(program).args(arguments).stdin(Stdio::null()).status();
    let wall = start.elapsed().as_secs_f64();
    let (Ok(status), Ok(usage)) = (status, getrusage(UsageWho::RUSAGE_CHILDREN)) else {
        eprintln!("{program} cannot be run");
        return ExitCode::FAILURE;
    };
    let seconds = |time: nix::sys::time::TimeVal| time.tv_sec() as f64 + 1e-6 * time.tv_usec() as f64;
    let cpu = seconds(usage.user_time()) + seconds(usage.system_time());
    eprintln!("\n{MARK} {cpu} {wall} {}", usage.max_rss() as f64 * 1024e-6);
    ExitCode::from(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1))
}
