//! What can be typed.

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;

/// Numerical continuation and bifurcation analysis of ordinary differential equations.
///
/// `foldline new oscillator` writes a model and a study to begin with.
#[derive(Debug, Parser)]
#[command(name = "foldline", version, after_help = BEGIN, max_term_width = 110)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Option<Command>,
}

const BEGIN: &str =
    "To begin: `foldline new oscillator` writes a commented model and study. `foldline COMMAND --help` says more.

Exit codes: 0 done, 1 something outside failed, 2 a mistake in the input, 3 done except for what the messages name";

const EXIT_CODES: &str = "Exit codes:
  0  done
  1  something outside failed, such as a full disk
  2  a mistake in what was typed or in a file; the message says where, what and how to put it right
  3  done, but something was not reached: a branch ended short, a switch led nowhere, a change of stability is not explained, samples
     of an exploration did not settle (or the run was stopped; `--resume` goes on)";

const VERIFY_CODES: &str = "Exit codes:
  0  every number is as accurate as it says
  1  something outside failed
  2  a mistake in what was typed, or no run in the folder
  3  some number is worse than its stated error";

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Write a commented model and study to begin with
    New(New),
    /// Run a study and print its special points
    #[command(after_help = EXIT_CODES)]
    Run(Run),
    /// Find the whole diagram of a model in a box of parameters, without being told where anything is
    #[command(after_help = EXIT_CODES)]
    Explore(Explore),
    /// Integrate a model from one initial state; print the trajectory, or draw it
    #[command(after_help = EXIT_CODES)]
    Simulate(Simulate),
    /// Print what a run has found
    Table(Table),
    /// Compute the solutions of a run again in another way and compare
    #[command(after_help = VERIFY_CODES)]
    Verify(Verify),
    /// Draw the bifurcation diagram of a run
    Plot(Plot),
    /// Write a run as CSV, Parquet or NetCDF for other programs
    Export(Export),
    /// List the solutions in files of AUTO-07p, or make a study that starts from them
    ImportAuto(ImportAuto),
    /// Sample initial states of a model and list where they settle
    Attractors(Attractors),
    /// Say whether a model or study file is right, and if not where and why
    Check(Check),
    /// Compute the figures and claims of a publication again
    #[command(after_help = EXIT_CODES)]
    Reproduce(Reproduce),
}

#[derive(Debug, Args)]
pub struct Run {
    /// Study file
    #[arg(value_name = "STUDY.toml")]
    pub study: PathBuf,
    /// Folder for the run [default: runs/NAME OF THE STUDY]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// How many branches are followed at a time [default: number of processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    /// Go on with a run that was stopped or killed
    #[arg(long)]
    pub resume: bool,
    /// Stop after this time, such as 90s, 10min or 2h, and keep what was found; `--resume` goes on
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub time_limit: Option<Duration>,
    #[command(flatten)]
    pub limits: Limits,
    /// Show a parameter, state, output or `period` in another unit, or a frequency in orders of a speed, as in omega=orders:Omega; may be
    /// given several times
    #[arg(long, value_name = "NAME=UNIT")]
    pub unit: Vec<String>,
}

/// Limits on trajectories.
#[derive(Clone, Debug, Args)]
pub struct Limits {
    /// Integration steps after which a trajectory counts as unsettled; replaces `max-steps` of the study
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000_000_000))]
    pub max_steps: Option<u64>,
    /// The same as a time, in the units of the model or with a unit such as "20 ms"; replaces `max-time`
    #[arg(long, value_name = "TIME")]
    pub max_time: Option<String>,
}

#[derive(Debug, Args)]
pub struct Explore {
    /// Model file
    #[arg(value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// The parameter that varies, and its range
    #[arg(long, value_name = "NAME=LOW:HIGH", allow_hyphen_values = true)]
    pub free: String,
    /// Change another parameter
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Follow folds in a second parameter too, to branches that nothing else leads to
    #[arg(long, value_name = "NAME=LOW:HIGH", allow_hyphen_values = true)]
    pub connect: Option<String>,
    /// At how many values of the parameter attractors and equilibria are looked for
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub values: u32,
    /// How many initial states at each
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub samples: u32,
    /// Seed of the random numbers; the same seed gives the same diagram
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    pub seed: u64,
    /// No branch is begun once this many points are accepted; a time such as 60s is a time limit
    #[arg(long, value_name = "N|TIME", default_value = "100000", value_parser = budget)]
    pub budget: Budget,
    /// Stop after this time, such as 90s, 10min or 2h, and keep what was found; `--resume` goes on
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub time_limit: Option<Duration>,
    /// How many levels of period doubling are followed [default: 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=16))]
    pub doublings: Option<u8>,
    /// The one tolerance, from 1e-10 to 1e-4
    #[arg(long, value_name = "X", default_value_t = 1e-6)]
    pub tolerance: f64,
    /// Folder for the run [default: runs/explore-NAME OF THE MODEL FILE]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Threads [default: number of processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    /// Go on with an exploration that was stopped or killed
    #[arg(long)]
    pub resume: bool,
    /// Print the study that does the same, and do nothing else
    #[arg(long)]
    pub print: bool,
    #[command(flatten)]
    pub limits: Limits,
    /// Show a parameter, state, output or `period` in another unit, or a frequency in orders of a speed, as in omega=orders:Omega; may be
    /// given several times
    #[arg(long, value_name = "NAME=UNIT")]
    pub unit: Vec<String>,
}

/// Limit on an exploration.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    pub points: u32,
    pub time: Option<Duration>,
}

/// Default budget of points, as of the argument. Empirical: several hundred branches of a few hundred points each.
const POINTS: u32 = 100_000;

/// Parses a number of points or a time.
fn budget(text: &str) -> Result<Budget, String> {
    match text.parse::<u32>() {
        Ok(points @ 1..=100_000_000) => Ok(Budget { points, time: None }),
        Ok(_) => Err("a number of points from 1 to 100000000, or a time such as 60s".into()),
        Err(_) => time(text).map(|time| Budget { points: POINTS, time: Some(time) }),
    }
}

/// Parses a time such as 90s, 10min or 2h.
fn time(text: &str) -> Result<Duration, String> {
    let said = || "a number with s, min or h, such as 90s, 10min or 2h".to_string();
    let split = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
    let unit = match text[split..].trim() {
        "s" => 1.0,
        "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(said()),
    };
    let seconds = text[..split].parse::<f64>().map_err(|_| said())? * unit;
    Duration::try_from_secs_f64(seconds).ok().filter(|time| !time.is_zero()).ok_or_else(said)
}

#[derive(Debug, Args)]
pub struct New {
    /// What to begin with [default: a list of what there is]
    #[arg(value_name = "TEMPLATE", conflicts_with = "study")]
    pub template: Option<String>,
    /// Write a study for this model instead
    #[arg(long, value_name = "MODEL.toml")]
    pub study: Option<PathBuf>,
    /// Folder for the files [default: TEMPLATE, or that of the model]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct Simulate {
    /// Model file
    #[arg(value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Change a parameter; may be given several times
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Initial value of a state; may be given several times [default: three quarters of its range]
    #[arg(long = "start", value_name = "NAME=VALUE,...", allow_hyphen_values = true)]
    pub start: Vec<String>,
    /// Length of the trajectory, in the units of the model or with a unit such as "20 ms"
    #[arg(long, value_name = "TIME", conflicts_with = "periods")]
    pub time: Option<String>,
    /// Length in periods of the forcing [default for a forced model: 20]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub periods: Option<u32>,
    /// Interval of time between rows; `period` samples once in each period of the forcing [default: 200 rows]
    #[arg(long, value_name = "TIME")]
    pub every: Option<String>,
    /// States and outputs to show [default: all of them; in a picture, the states]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub show: Vec<String>,
    /// Horizontal axis of a picture: a state or an output [default: the time]
    #[arg(long, value_name = "NAME", requires = "output")]
    pub x: Option<String>,
    /// Relative tolerance of the integrator
    #[arg(long, value_name = "X", default_value_t = 1e-8, value_parser = accuracy)]
    pub tolerance: f64,
    /// Integration steps after which the trajectory ends
    #[arg(long, value_name = "N", default_value_t = 10_000_000, value_parser = clap::value_parser!(u64).range(1..))]
    pub max_steps: u64,
    /// How the table is written
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Draw a picture instead; the ending says which kind
    #[arg(short, long = "output", value_name = "FILE.svg|png|pdf")]
    pub output: Option<PathBuf>,
}

/// Parses a tolerance of the integrator.
fn accuracy(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|x| (1e-13..=1e-2).contains(x));
    number.ok_or_else(|| "a number from 1e-13 to 1e-2".into())
}

#[derive(Debug, Args)]
pub struct Table {
    /// Folder of the run
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Special points (the default)
    #[arg(long, group = "what")]
    pub special: bool,
    /// Every accepted point, with multipliers and accuracy
    #[arg(long, group = "what")]
    pub points: bool,
    /// One line for each branch, with how it ended
    #[arg(long, group = "what")]
    pub branches: bool,
    /// Remarks: what was found for each seed, which routes the homotopies took, which switches led to known branches, what was not
    /// reached
    #[arg(long, group = "what")]
    pub notes: bool,
    /// What surveys and sweeps saw
    #[arg(long, group = "what")]
    pub responses: bool,
    /// Only this branch, or the legs of this homotopy
    #[arg(long, value_name = "NAME")]
    pub branch: Option<String>,
    /// How the table is written
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Show a parameter, state, output or `period` in another unit, or a frequency in orders of a speed, as in omega=orders:Omega; may be
    /// given several times
    #[arg(long, value_name = "NAME=UNIT")]
    pub unit: Vec<String>,
}

/// Which table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    Special,
    Points,
    Branches,
    Responses,
    Notes,
}

impl Table {
    pub fn what(&self) -> What {
        let asked = [
            (self.points, What::Points),
            (self.branches, What::Branches),
            (self.responses, What::Responses),
            (self.notes, What::Notes),
        ];
        asked.into_iter().find(|(asked, _)| *asked).map_or(What::Special, |(_, what)| what)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Aligned columns; parameters that do not change are left out
    Text,
    /// Comma-separated, every digit
    Csv,
    /// A list of objects, every digit
    Json,
}

#[derive(Debug, Args)]
pub struct Verify {
    /// Folder of the run
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Compute at most so many points again, spread evenly; special points always are [default: all]
    #[arg(long, value_name = "N")]
    pub sample: Option<usize>,
    /// Only this branch, or the legs of this homotopy
    #[arg(long, value_name = "NAME")]
    pub branch: Option<String>,
    /// How many of the worst comparisons are listed
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub worst: usize,
    /// How the table is written
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

#[derive(Debug, Args)]
pub struct Plot {
    /// Folder of the run
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Horizontal axis: a parameter, `period`, `norm`, or a state or output with _max, _min, _mean, _rms or _integral behind its name [default: the free parameter]
    #[arg(long, value_name = "NAME")]
    pub x: Option<String>,
    /// Vertical axis [default: the largest value of the first output]
    #[arg(long, value_name = "NAME")]
    pub y: Option<String>,
    /// Draw the curves in two parameters, in their plane, instead of the branches
    #[arg(long)]
    pub curves: bool,
    /// Part of the diagram to show
    #[arg(long, value_name = "x0,x1,y0,y1", allow_hyphen_values = true)]
    pub window: Option<String>,
    /// Title above the axes
    #[arg(long, value_name = "TEXT")]
    pub title: Option<String>,
    /// Show a parameter, state, output or `period` in another unit, or a frequency in orders of a speed, as in omega=orders:Omega; may be
    /// given several times
    #[arg(long, value_name = "NAME=UNIT")]
    pub unit: Vec<String>,
    /// Picture to write; the ending says which kind
    #[arg(short, long = "output", value_name = "FILE.svg|png|pdf")]
    pub output: PathBuf,
}

#[derive(Debug, Args)]
pub struct Export {
    /// Folder of the run
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// What is written
    #[arg(long, value_enum)]
    pub format: ExportFormat,
    /// Folder for the tables, or NetCDF file [default: DIR/csv, DIR/parquet, DIR/run.nc]
    #[arg(long, value_name = "PATH")]
    pub out: Option<PathBuf>,
    /// Only this branch, or the legs of this homotopy; may be given several times [default: everything]
    #[arg(long, value_name = "NAME")]
    pub branch: Vec<String>,
    /// Leave out the profiles of cycles, which make up nearly all of a run
    #[arg(long)]
    pub no_profiles: bool,
    /// Show a parameter, state, output or `period` in another unit, or a frequency in orders of a speed, as in omega=orders:Omega; may be
    /// given several times
    #[arg(long, value_name = "NAME=UNIT")]
    pub unit: Vec<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ExportFormat {
    /// A folder of tables with comma-separated values, every digit
    Csv,
    /// The same tables as Parquet files
    Parquet,
    /// One NetCDF-4 file with a group for each branch
    Netcdf,
}

#[derive(Debug, Args)]
pub struct ImportAuto {
    /// Files s.NAME of AUTO; b.NAME and c.NAME beside or among them tell the names of states and parameters
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,
    /// Model of the same equations; without it the solutions are listed
    #[arg(long, value_name = "MODEL.toml")]
    pub model: Option<PathBuf>,
    /// Only the solution with this label; may be given several times [default: all of them]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub label: Vec<i64>,
    /// Which parameters of AUTO are which of the model's, where their names do not say it
    #[arg(long, value_name = "1=NAME,...", value_delimiter = ',')]
    pub parameters: Vec<String>,
    /// Which states of AUTO are which of the model's, where neither their names nor their order say it
    #[arg(long, value_name = "1=NAME,...", value_delimiter = ',')]
    pub states: Vec<String>,
    /// Study to write [default: NAME.toml, for the first s.NAME]
    #[arg(short, long = "output", value_name = "STUDY.toml", requires = "model")]
    pub output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct Attractors {
    /// Model file
    #[arg(value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Change a parameter
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// How many initial states
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..))]
    pub samples: u32,
    /// Seed of the random numbers; the same seed gives the same table
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}

#[derive(Debug, Args)]
pub struct Check {
    /// Model or study file
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
}

#[derive(Debug, Args)]
pub struct Reproduce {
    /// Which publication
    #[arg(value_name = "PUBLICATION")]
    pub publication: String,
    /// Only this figure; may be given several times [default: all of them]
    #[arg(long, value_name = "N")]
    pub figure: Vec<String>,
    /// Folder for the runs, the figures and the report [default: reproduced/PUBLICATION]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// How many branches are followed at a time [default: number of processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
}
