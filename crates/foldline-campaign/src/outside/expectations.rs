//! Expected results of a problem: `expected.toml`, next to its model and its studies.

use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

/// Default limit on the processor time of a run, in seconds, well above the usual time.
const SECONDS: u64 = 60;

/// External problem.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Problem {
    /// Name of its folder.
    #[serde(skip)]
    pub name: String,
    /// Path of its folder.
    #[serde(skip)]
    pub folder: PathBuf,
    /// Question that the problem answers.
    pub question: String,
    /// Source of the problem.
    pub source: String,
    /// Studies to run.
    #[serde(rename = "run")]
    pub runs: Vec<Run>,
}

/// Study with its expected results.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Run {
    /// Study file, or model file for a command that takes one.
    pub file: String,
    /// Subcommand, `run` by default, followed by the arguments that come after the file.
    #[serde(default = "run_itself")]
    pub command: Vec<String>,
    /// Limit on the processor time, in seconds.
    #[serde(default = "seconds")]
    pub seconds: u64,
    /// Permitted exit codes; by default done (0) or ended short (3).
    #[serde(default = "done_or_short")]
    pub exit: Vec<i32>,
    /// True if every check passes and the run takes about a second.
    #[serde(default)]
    pub quick: bool,
    /// Expected values.
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

/// Expected value and its source.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Right {
    /// Check to evaluate.
    pub check: Check,
    /// Source of the value.
    pub source: String,
}

/// Quantities, each with its value and the permitted deviation.
pub type At = BTreeMap<String, [f64; 2]>;

/// Check. `branch` restricts it to one branch and those reached from it by branch switching, whose names begin with its
/// own.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[allow(missing_docs)] // the fields are explained by the sentence of the variant
pub enum Check {
    /// A special point of this kind has these values, and the given numbers of unstable eigenvalues or multipliers on
    /// its sides.
    Special {
        kind: String,
        branch: Option<String>,
        #[serde(default)]
        at: At,
        changes: Option<[usize; 2]>,
    },
    /// No special point of this kind has these values.
    Absent {
        kind: String,
        branch: Option<String>,
        #[serde(default)]
        at: At,
    },
    /// The number of special points of this kind lies between the bounds, inclusive.
    Count { kind: String, branch: Option<String>, between: [usize; 2] },
    /// Some point, special or not, has these values.
    Point { branch: Option<String>, at: At },
    /// A side of the branch ended with this code, and its last point (if it joined another branch, the parameter there)
    /// has these values.
    Ends {
        branch: Option<String>,
        code: String,
        #[serde(default)]
        at: At,
    },
    /// Both sides of one branch join others at special points of this kind, at these parameter values.
    Joins { kind: String, between: [f64; 2], within: f64 },
    /// Points with the quantity in the range exist, and all have the given number of unstable eigenvalues or
    /// multipliers.
    Unstable { branch: Option<String>, of: String, range: [f64; 2], is: usize },
    /// Number of equilibria at this parameter value; those that differ only in the signs of states count once.
    Solutions { parameter: String, value: f64, is: usize },
    /// Number of branches that have a point with these values.
    Branches { at: At, is: usize },
    /// Largest number of points of any branch.
    Points { branch: Option<String>, most: usize },
    /// At least this fraction of all starts of surveys and sweeps settle to one of these motions.
    Settles { set: Option<String>, motions: Vec<String>, share: f64 },
    /// A response of a survey or sweep has these values.
    Response { at: At, motion: String },
    /// One line of the output or notes contains all these words.
    Says { words: Vec<String> },
}

impl Problem {
    /// Reads the problem in a folder.
    pub fn read(folder: &Path) -> Result<Problem, String> {
        let file = folder.join("expected.toml");
        let text = std::fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
        let mut problem: Problem = toml::from_str(&text).map_err(|error| format!("{}: {error}", file.display()))?;
        problem.name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        problem.folder = folder.to_path_buf();
        Ok(problem)
    }

    /// Reads every problem in a folder, sorted by name.
    pub fn all(folder: &Path) -> Result<Vec<Problem>, String> {
        let entries = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        let mut folders: Vec<PathBuf> =
            entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
        folders.sort();
        folders.iter().map(|folder| Problem::read(folder)).collect()
    }
}

impl Run {
    /// Name in the report: the file without extension, followed by the command unless that is `run`.
    pub fn name(&self) -> String {
        let stem = self.file.trim_end_matches(".toml").to_string();
        if self.is_a_study() { stem } else { format!("{stem} ({})", self.command.join(" ")) }
    }

    /// True if the run is that of a study by `foldline run`.
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
