//! What is right about a problem: `expected.toml` beside its model and its studies.

use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

/// Seconds of processor time that a run may take unless it says otherwise.
const SECONDS: u64 = 60;

/// A problem.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Problem {
    /// Name of its folder.
    #[serde(skip)]
    pub name: String,
    /// The folder.
    #[serde(skip)]
    pub folder: PathBuf,
    /// What was asked.
    pub question: String,
    /// Who asked, or posed it.
    pub source: String,
    /// Studies to run.
    #[serde(rename = "run")]
    pub runs: Vec<Run>,
}

/// A study, and what is right about it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Run {
    /// The study file; or that of a model, for a command that takes one.
    pub file: String,
    /// Arguments of the command after the file, and before it the command if that is not `run`.
    #[serde(default = "run_itself")]
    pub command: Vec<String>,
    /// Seconds of processor time within which it ends.
    #[serde(default = "seconds")]
    pub seconds: u64,
    /// Exit codes that are right: done, or done with something short that is told.
    #[serde(default = "done_or_short")]
    pub exit: Vec<i32>,
    /// True if it is right today and takes about a second.
    #[serde(default)]
    pub quick: bool,
    /// Single right values.
    #[serde(default)]
    pub right: Vec<Right>,
}

fn seconds() -> u64 {
    SECONDS
}

fn run_itself() -> Vec<String> {
    vec!["run".to_string()]
}

fn done_or_short() -> Vec<i32> {
    vec![0, 3]
}

/// A right value and how it is known.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Right {
    /// What must hold.
    pub check: Check,
    /// How it is known.
    pub source: String,
}

/// Quantities, each with its value and the distance from it that is allowed.
pub type At = BTreeMap<String, [f64; 2]>;

/// What must hold. `branch` limits it to one branch and what was switched to from there by the name's beginning.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[allow(missing_docs)] // the fields are what the sentence of the variant says
pub enum Check {
    /// A special point of that kind has these values, and the unstable count has these two values on its sides.
    Special {
        kind: String,
        branch: Option<String>,
        #[serde(default)]
        at: At,
        changes: Option<[usize; 2]>,
    },
    /// No special point of that kind has these values.
    Absent {
        kind: String,
        branch: Option<String>,
        #[serde(default)]
        at: At,
    },
    /// So many special points of that kind, the bounds included.
    Count { kind: String, branch: Option<String>, between: [usize; 2] },
    /// Some point, special or not, has these values.
    Point { branch: Option<String>, at: At },
    /// A side of the branch ended with that code, and its last point (or, where it joined, the parameter) has these values.
    Ends {
        branch: Option<String>,
        code: String,
        #[serde(default)]
        at: At,
    },
    /// Both sides of one branch joined, at these values of its parameter.
    Joins { kind: String, between: [f64; 2], within: f64 },
    /// Points with the quantity in the range exist, and have that many unstable eigenvalues or multipliers.
    Unstable { branch: Option<String>, of: String, range: [f64; 2], is: usize },
    /// So many solutions where the parameter has that value, those that differ by signs of states counted once.
    Solutions { parameter: String, value: f64, is: usize },
    /// So many branches have a point with these values.
    Branches { at: At, is: usize },
    /// No branch has more points.
    Points { branch: Option<String>, most: usize },
    /// The responses of surveys and sweeps are of these motions only, in at least that share of all starts.
    Settles { set: Option<String>, motions: Vec<String>, share: f64 },
    /// A response of a survey or sweep has these values.
    Response { at: At, motion: String },
    /// A line of output or notes has all these words.
    Says { words: Vec<String> },
}

impl Problem {
    /// Reads the problem in that folder.
    pub fn read(folder: &Path) -> Result<Problem, String> {
        let file = folder.join("expected.toml");
        let text = std::fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
        let mut problem: Problem = toml::from_str(&text).map_err(|error| format!("{}: {error}", file.display()))?;
        problem.name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        problem.folder = folder.to_path_buf();
        Ok(problem)
    }

    /// Reads every problem in a folder, by name.
    pub fn all(folder: &Path) -> Result<Vec<Problem>, String> {
        let entries = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        let mut folders: Vec<PathBuf> =
            entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
        folders.sort();
        folders.iter().map(|folder| Problem::read(folder)).collect()
    }
}

impl Run {
    /// Name in the report: the file without its ending, and the command where it is another one.
    pub fn name(&self) -> String {
        let stem = self.file.trim_end_matches(".toml").to_string();
        if self.is_a_study() { stem } else { format!("{stem} ({})", self.command.join(" ")) }
    }

    /// True if the file is a study that `foldline run` runs.
    pub fn is_a_study(&self) -> bool {
        self.command == ["run"]
    }
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let on = |branch: &Option<String>| branch.as_ref().map_or(String::new(), |name| format!(" on {name}"));
        match self {
            Check::Special { kind, branch, at, changes } => {
                let sides = changes.map_or(String::new(), |[a, b]| format!(", {a} to {b} unstable"));
                write!(f, "{kind}{}{}{sides}", on(branch), told(at))
            }
            Check::Absent { kind, branch, at } => write!(f, "no {kind}{}{}", on(branch), told(at)),
            Check::Count { kind, branch, between: [a, b] } => write!(f, "{kind}{}: {a} to {b} of them", on(branch)),
            Check::Point { branch, at } => write!(f, "point{}{}", on(branch), told(at)),
            Check::Ends { branch, code, at } => write!(f, "a side{} ends: {code}{}", on(branch), told(at)),
            Check::Joins { kind, between: [a, b], .. } => write!(f, "one branch joins {kind} at {a} to {b}"),
            Check::Unstable { branch, of, range: [a, b], is } => {
                write!(f, "{is} unstable{} for {of} {a} to {b}", on(branch))
            }
            Check::Solutions { parameter, value, is } => write!(f, "{is} solutions at {parameter} {value}"),
            Check::Branches { at, is } => write!(f, "{is} branches{}", told(at)),
            Check::Points { branch, most } => write!(f, "at most {most} points{}", on(branch)),
            Check::Settles { set, motions, share } => {
                write!(f, "{}% settle to {}{}", 100.0 * share, motions.join(" or "), on(set))
            }
            Check::Response { at, motion } => write!(f, "{motion}{} in simulation", told(at)),
            Check::Says { words } => write!(f, "says {}", words.join(" ")),
        }
    }
}

fn told(at: &At) -> String {
    let parts: Vec<String> = at.iter().map(|(name, [value, _])| format!("{name} {value}")).collect();
    if parts.is_empty() { String::new() } else { format!(" at {}", parts.join(", ")) }
}
