//! AUTO-07p as Debian packages it: installed, compiled with our equations, run.
//!
//! **Idea.** The Python interface of AUTO only prepares files for a compiled program. That program is run directly, so that
//! nothing but its Fortran is measured: `fort.2` has the constants, `start.dat` or `fort.3` the start, `fort.7` to `fort.9`
//! the results.

use super::auto_files::{Row, constants, iterations, rows};
use crate::workplace::Workplace;
use crate::{Outcome, child};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where Debian puts the compiled parts of AUTO.
const LIBRARY: &str = "/usr/lib/auto-07p/lib";
/// Flags of the equations and of the link; AUTO's own parts were compiled by Debian with -O2.
const FLAGS: [&str; 2] = ["-O3", "-march=native"];

/// A compiled problem and the folder in which it runs.
pub struct Auto {
    folder: PathBuf,
    program: PathBuf,
    template: String,
}

/// What a run gave.
pub struct Answer {
    /// Processor seconds, start of the process and output included.
    pub cpu: f64,
    /// Points of all branches.
    pub rows: Vec<Row>,
    /// Newton iterations, where IID = 2 asked for them.
    pub iterations: usize,
}

impl Auto {
    /// Installs AUTO where it is missing, and compiles the equations `name` of benches/auto.
    pub fn new(place: &Workplace, name: &str, folder: &str) -> Outcome<Auto> {
        install()?;
        let folder = place.scratch(folder)?;
        let program = folder.join(format!("{name}.exe"));
        let mut parts: Vec<PathBuf> = std::fs::read_dir(LIBRARY)?.flatten().map(|entry| entry.path()).collect();
        parts.retain(|part| part.extension().is_some_and(|end| end == "o"));
        parts.sort();
        let compiled = Command::new("gfortran")
            .args(FLAGS)
            .arg("-fopenmp")
            .arg(place.root.join("benches/auto").join(format!("{name}.f90")))
            .args(parts)
            .arg("-o")
            .arg(&program)
            .current_dir(&folder)
            .output()?;
        if !compiled.status.success() {
            return Err(String::from_utf8_lossy(&compiled.stderr).into_owned().into());
        }
        let template = std::fs::read_to_string(place.root.join("benches/auto/c.rotor"))?;
        Ok(Auto { folder, program, template })
    }

    /// Which AUTO it is, and how it was compiled.
    pub fn version() -> String {
        let first = |program: &str, arguments: &[&str]| {
            let out = Command::new(program).args(arguments).output();
            let text = out.map_or(String::new(), |out| String::from_utf8_lossy(&out.stdout).into_owned());
            text.lines().next().unwrap_or("unknown").trim().to_string()
        };
        format!(
            "AUTO-07p {} as Debian compiled it (-O2, for any x86-64); its equations by {} with {}, one thread.",
            first("dpkg-query", &["--showformat", "${Version}", "--show", "auto-07p"]),
            first("gfortran", &["--version"]),
            FLAGS.join(" ")
        )
    }

    /// The file from which a first profile is read.
    pub fn start(&self) -> PathBuf {
        self.folder.join("start.dat")
    }

    /// The solutions of the last run.
    pub fn solutions(&self) -> Outcome<String> {
        Ok(std::fs::read_to_string(self.folder.join("fort.8"))?)
    }

    /// Runs with constants that differ from benches/auto/c.rotor as stated.
    pub fn run(&self, changes: &[(&str, &str)]) -> Outcome<Answer> {
        std::fs::write(self.folder.join("fort.2"), constants(&self.template, changes)?)?;
        for old in ["fort.7", "fort.8", "fort.9"].map(|name| self.folder.join(name)).iter().filter(|f| f.exists()) {
            std::fs::remove_file(old)?;
        }
        let (usage, _) = child::run(&self.program, &[], &self.folder, &[])?;
        let read = |name: &str| std::fs::read_to_string(self.folder.join(name)).unwrap_or_default();
        Ok(Answer { cpu: usage.cpu, rows: rows(&read("fort.7")), iterations: iterations(&read("fort.9")) })
    }

    /// The same from the solution with a label in the text of a `fort.8`.
    pub fn run_from(&self, solutions: &str, label: usize, changes: &[(&str, &str)]) -> Outcome<Answer> {
        std::fs::write(self.folder.join("fort.3"), solutions)?;
        let label = label.to_string();
        self.run(&[changes, &[("IRS", &label), ("dat", "''")]].concat())
    }
}

/// Installs what is missing, or says how.
fn install() -> Outcome<()> {
    let there = || Path::new(LIBRARY).exists() && Command::new("gfortran").arg("--version").output().is_ok();
    if there() {
        return Ok(());
    }
    eprintln!("apt-get install auto-07p gfortran");
    // Whether it worked is seen by what is there afterwards.
    let _ = Command::new("apt-get").args(["install", "-y", "auto-07p", "gfortran"]).output();
    if there() { Ok(()) } else { Err("AUTO-07p is missing: on Debian, `apt-get install auto-07p gfortran`".into()) }
}
