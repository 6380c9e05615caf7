//! Debian's AUTO-07p: installation, compilation with our equations, runs.
//!
//! **Idea.** The Python interface of AUTO only prepares files for a compiled program. That program is run directly, so
//! that only its Fortran code is measured: `fort.2` contains the constants, `start.dat` or `fort.3` the start, `fort.7`
//! to `fort.9` the results.

use super::auto_files::{Row, constants, iterations, rows};
use crate::workplace::Workplace;
use crate::{Outcome, child};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Folder of the compiled parts of AUTO in Debian.
const LIBRARY: &str = "/usr/lib/auto-07p/lib";
/// Flags for compiling the equations and for linking. Debian compiled AUTO's own parts with -O2.
const FLAGS: [&str; 2] = ["-O3", "-march=native"];

/// Compiled problem and the folder in which it runs.
pub struct Auto {
    folder: PathBuf,
    program: PathBuf,
    template: String,
}

/// Result of a run.
pub struct Answer {
    /// Processor time in seconds, including start-up and output.
    pub cpu: f64,
    /// Points of all branches.
    pub rows: Vec<Row>,
    /// Number of Newton iterations, if printed with IID = 2.
    pub iterations: usize,
}

impl Auto {
    /// Installs AUTO if it is missing, and compiles the equations `name` of benches/auto.
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

    /// Returns the version of AUTO and how it was compiled.
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

    /// Returns the path of the file from which the first profile is read.
    pub fn start(&self) -> PathBuf {
        self.folder.join("start.dat")
    }

    /// Reads the solutions of the last run.
    pub fn solutions(&self) -> Outcome<String> {
        Ok(std::fs::read_to_string(self.folder.join("fort.8"))?)
    }

    /// Runs with the constants of benches/auto/c.rotor and the given changes.
    pub fn run(&self, changes: &[(&str, &str)]) -> Outcome<Answer> {
        std::fs::write(self.folder.join("fort.2"), constants(&self.template, changes)?)?;
        for old in ["fort.7", "fort.8", "fort.9"].map(|name| self.folder.join(name)).iter().filter(|f| f.exists()) {
            std::fs::remove_file(old)?;
        }
        let (usage, _) = child::run(&self.program, &[], &self.folder, &[])?;
        let read = |name: &str| std::fs::read_to_string(self.folder.join(name)).unwrap_or_default();
        Ok(Answer { cpu: usage.cpu, rows: rows(&read("fort.7")), iterations: iterations(&read("fort.9")) })
    }

    /// Runs from a labelled solution in the text of a `fort.8`.
    pub fn run_from(&self, solutions: &str, label: usize, changes: &[(&str, &str)]) -> Outcome<Answer> {
        std::fs::write(self.folder.join("fort.3"), solutions)?;
        let label = label.to_string();
        self.run(&[changes, &[("IRS", &label), ("dat", "''")]].concat())
    }
}

/// Installs what is missing, or reports how to install it.
fn install() -> Outcome<()> {
    let there = || Path::new(LIBRARY).exists() && Command::new("gfortran").arg("--version").output().is_ok();
    if there() {
        return Ok(());
    }
    eprintln!("apt-get install auto-07p gfortran");
    // Success is judged by the files that exist afterwards.
    let _ = Command::new("apt-get").args(["install", "-y", "auto-07p", "gfortran"]).output();
    if there() { Ok(()) } else { Err("AUTO-07p is missing: on Debian, `apt-get install auto-07p gfortran`".into()) }
}
