//! Command-line arguments.

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;

/// Numerical continuation and bifurcation analysis of ordinary differential equations.
#[derive(Debug, Parser)]
#[command(name = "foldline", version, after_help = BEGIN, max_term_width = 110)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Print only tables, errors and what was not reached
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Also report special points as they are found, and why each branch ends
    #[arg(short, long, global = true)]
    pub verbose: bool,
}

const BEGIN: &str =
    "To begin: `foldline new oscillator` writes a commented model and study. `foldline COMMAND --help` describes a command.

Exit codes: 0 success, 1 failure outside foldline, 2 error in the input, 3 finished but incomplete, as the messages say";

const EXIT_CODES: &str = "Exit codes:
  0  success
  1  failure outside foldline, such as a full disk
  2  error in the command line or in a file; the message says where, what and how to fix it
  3  finished, but incomplete: a branch ended early, no branch was found at a switch, a change of stability is
     unexplained, samples of an exploration did not settle, or the run was stopped (continue it with `--resume`)";

const VERIFY_CODES: &str = "Exit codes:
  0  every number is as accurate as stated
  1  failure outside foldline
  2  error in the command line, or no run in the folder
  3  some number differs by more than its stated error";

const BASINS_CODES: &str = "Exit codes:
  0  every initial state was followed to an attractor, or to where it left the domain of the model
  1  failure outside foldline
  2  error in the command line or in a file
  3  some initial states did not settle within the limits";

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Write a commented model and study as a starting point
    New(New),
    /// Run a study and print its special points
    #[command(after_help = EXIT_CODES)]
    Run(Run),
    /// Compute the bifurcation diagram of a model over a range of a parameter, without given starting solutions
    #[command(after_help = EXIT_CODES)]
    Explore(Explore),
    /// Integrate a model from one initial state; print the trajectory, or draw it
    #[command(after_help = EXIT_CODES)]
    Simulate(Simulate),
    /// Print the results of a run
    Table(Table),
    /// Recompute the solutions of a run by an independent method and compare
    #[command(after_help = VERIFY_CODES)]
    Verify(Verify),
    /// Repeat the run of a smoothed law with the exact one, and list what the smoothing changes
    #[command(after_help = EXIT_CODES)]
    Exact(Exact),
    /// Show a run in the browser, also while it is computed
    View(View),
    /// Draw the bifurcation diagram of a run
    Plot(Box<Plot>),
    /// Export a run as CSV, Parquet or NetCDF, or as a page for a browser
    Export(Export),
    /// List the solutions in AUTO-07p files, or write a study that starts from them
    ImportAuto(ImportAuto),
    /// Sample initial states of a model and list the attractors they reach
    Attractors(Attractors),
    /// Basins of attraction: the fraction of a box of initial states that leads to each attractor, and a picture of a plane section
    #[command(after_help = BASINS_CODES)]
    Basins(Basins),
    /// Write the ensemble of a model as CUDA or C source, for use in other programs; in Python, foldline.ensemble runs it
    Emit(Emit),
    /// Check a model or study file for errors
    Check(Check),
    /// Natural frequencies and damping of a rotor as functions of its speed
    Campbell(Campbell),
    /// Critical speeds of a rotor, undamped and damped
    CriticalSpeeds(CriticalSpeeds),
    /// Unbalance response of a rotor as a function of its speed, without rings and other nonlinear forces
    UnbalanceResponse(UnbalanceResponse),
    /// Recompute the figures and claims of a publication
    #[command(after_help = EXIT_CODES)]
    Reproduce(Reproduce),
}

/// Range of the speed of a rotor.
#[derive(Clone, Debug, Args)]
pub struct Speeds {
    /// Lowest and highest speed, in the unit of the speed or with a unit, as in "0:6000 rpm" [default: from 0 to twice the
    /// speed of the model]
    #[arg(long, value_name = "LOW:HIGH", allow_hyphen_values = true)]
    pub speeds: Option<String>,
    /// Number of speeds [default: 11 in a text table, otherwise 101]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    pub count: Option<u32>,
}

#[derive(Debug, Args)]
pub struct Campbell {
    /// Model file with a rotor
    #[arg(value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Set a parameter; can be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    #[command(flatten)]
    pub speeds: Speeds,
    /// Number of modes
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub modes: u32,
    /// Frame in which frequencies are counted; in the rotating frame backward whirl is negative
    #[arg(long, value_enum, default_value_t = Frame::Fixed)]
    pub frame: Frame,
    /// Unit of frequencies, such as Hz, rad/s or rpm
    #[arg(long, value_name = "UNIT", default_value = "Hz")]
    pub frequency: String,
    /// Print the shapes of the modes at the speed of the model instead
    #[arg(long, conflicts_with_all = ["output", "speeds", "count"])]
    pub shapes: bool,
    /// Format of the table
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Draw a picture instead; the file extension sets the format
    #[arg(short, long = "output", value_name = "FILE.svg|png|pdf")]
    pub output: Option<PathBuf>,
}

/// Frame of frequencies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Frame {
    /// As a fixed probe measures them
    Fixed,
    /// As seen from the shaft
    Rotating,
}

#[derive(Debug, Args)]
pub struct CriticalSpeeds {
    /// Model file with a rotor
    #[arg(value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Set a parameter; can be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Number of critical speeds in each direction of whirl
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub count: u32,
    /// Also list the speeds up to the highest critical one at which the lowest whirls close after n to m turns in the
    /// rotating frame, as in 2:1; can be repeated
    #[arg(long, value_name = "N:M")]
    pub ratio: Vec<String>,
    /// Format of the table
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

#[derive(Debug, Args)]
pub struct UnbalanceResponse {
    /// Model file with a rotor
    #[arg(value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Set a parameter; can be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    #[command(flatten)]
    pub speeds: Speeds,
    /// Node, or support, at which to measure, with the direction of a probe if given, as in 6 or 6:45deg; can be repeated
    /// [default: nodes with discs]
    #[arg(long, value_name = "NODE[:ANGLE]")]
    pub probe: Vec<String>,
    /// Unit of amplitudes
    #[arg(long, value_name = "UNIT", default_value = "um")]
    pub amplitude: String,
    /// Format of the table
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Draw a picture instead; the file extension sets the format
    #[arg(short, long = "output", value_name = "FILE.svg|png|pdf")]
    pub output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct Run {
    /// Study file
    #[arg(value_name = "STUDY.toml")]
    pub study: PathBuf,
    /// Folder for the run [default: runs/NAME for NAME.toml]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Number of branches followed in parallel [default: number of processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    /// Continue a run that was stopped or killed
    #[arg(long)]
    pub resume: bool,
    /// Stop after this time, such as 90s, 10min or 2h, keeping all results; continue with `--resume`
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub time_limit: Option<Duration>,
    #[command(flatten)]
    pub limits: Limits,
    /// Show a parameter, state, output or `period` in another unit, or a frequency in orders of a speed, as in
    /// omega=orders:Omega; can be repeated
    #[arg(long, value_name = "NAME=UNIT")]
    pub unit: Vec<String>,
}

/// Limits on trajectories.
#[derive(Clone, Debug, Args)]
pub struct Limits {
    /// Number of integration steps after which a trajectory counts as not settled; overrides `max-steps` of the study
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000_000_000))]
    pub max_steps: Option<u64>,
    /// Integration time after which a trajectory counts as not settled, in the time unit of the model or with a unit such
    /// as "20 ms"; overrides `max-time` of the study
    #[arg(long, value_name = "TIME")]
    pub max_time: Option<String>,
}

#[derive(Debug, Args)]
pub struct Explore {
    /// Model file
    #[arg(value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Free parameter and its range
    #[arg(long, value_name = "NAME=LOW:HIGH", allow_hyphen_values = true)]
    pub free: String,
    /// Set another parameter; can be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Also continue folds in a second parameter, to find isolated branches
    #[arg(long, value_name = "NAME=LOW:HIGH", allow_hyphen_values = true)]
    pub connect: Option<String>,
    /// Number of parameter values at which to search for attractors and equilibria
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub values: u32,
    /// Number of initial states at each of these values
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub samples: u32,
    /// Random seed; the same seed gives the same diagram
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    pub seed: u64,
    /// Start no new branch after this many points; a time such as 60s sets a time limit instead
    #[arg(long, value_name = "N|TIME", default_value = "100000", value_parser = budget)]
    pub budget: Budget,
    /// Stop after this time, such as 90s, 10min or 2h, keeping all results; continue with `--resume`
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub time_limit: Option<Duration>,
    /// Number of successive period doublings to follow [default: 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=16))]
    pub doublings: Option<u8>,
    /// Tolerance, from 1e-10 to 1e-4
    #[arg(long, value_name = "X", default_value_t = 1e-6)]
    pub tolerance: f64,
    /// Folder for the run [default: runs/explore-NAME for NAME.toml]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Number of threads [default: number of processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    /// Continue an exploration that was stopped or killed
    #[arg(long)]
    pub resume: bool,
    /// Print the equivalent study file and exit
    #[arg(long)]
    pub print: bool,
    #[command(flatten)]
    pub limits: Limits,
    /// Show a parameter, state, output or `period` in another unit, or a frequency in orders of a speed, as in
    /// omega=orders:Omega; can be repeated
    #[arg(long, value_name = "NAME=UNIT")]
    pub unit: Vec<String>,
}

/// Limit on an exploration.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    pub points: u32,
    pub time: Option<Duration>,
}

/// Default budget of points. Empirical: several hundred branches of a few hundred points each.
const POINTS: u32 = 100_000;

/// Parses a number of points or a time.
fn budget(text: &str) -> Result<Budget, String> {
    match text.parse::<u32>() {
        Ok(points @ 1..=100_000_000) => Ok(Budget { points, time: None }),
        Ok(_) => Err("expected a number of points from 1 to 100000000, or a time such as 60s".into()),
        Err(_) => time(text).map(|time| Budget { points: POINTS, time: Some(time) }),
    }
}

/// Parses a time such as 90s, 10min or 2h.
fn time(text: &str) -> Result<Duration, String> {
    let said = || "expected a number with s, min or h, such as 90s, 10min or 2h".to_string();
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
    /// Template; without it, the templates are listed
    #[arg(value_name = "TEMPLATE", conflicts_with = "study")]
    pub template: Option<String>,
    /// Write a study for this model instead
    #[arg(long, value_name = "MODEL.toml")]
    pub study: Option<PathBuf>,
    /// Folder for the files [default: TEMPLATE, or that of the model]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct Simulate {
    /// Model file
    #[arg(value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Set a parameter; can be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Initial value of a state; can be repeated [default: at three quarters of its range]
    #[arg(long = "start", value_name = "NAME=VALUE,...", allow_hyphen_values = true)]
    pub start: Vec<String>,
    /// Length of the trajectory, in the time unit of the model or with a unit such as "20 ms"
    #[arg(long, value_name = "TIME", conflicts_with = "periods", allow_negative_numbers = true)]
    pub time: Option<String>,
    /// Length in forcing periods [default for a forced model: 20]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub periods: Option<u32>,
    /// Time between rows; `period` gives one row per forcing period [default: 200 rows]
    #[arg(long, value_name = "TIME", allow_negative_numbers = true)]
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
    /// Maximum number of integration steps
    #[arg(long, value_name = "N", default_value_t = 10_000_000, value_parser = clap::value_parser!(u64).range(1..))]
    pub max_steps: u64,
    /// Format of the table
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Draw a picture instead; the file extension sets the format
    #[arg(short, long = "output", value_name = "FILE.svg|png|pdf")]
    pub output: Option<PathBuf>,
}

/// Parses a tolerance of the integrator.
fn accuracy(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|x| (1e-13..=1e-2).contains(x));
    number.ok_or_else(|| "expected a number from 1e-13 to 1e-2".into())
}

#[derive(Debug, Args)]
pub struct Table {
    /// Folder of the run
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Special points (default)
    #[arg(long, group = "what")]
    pub special: bool,
    /// All accepted points, with multipliers and accuracy
    #[arg(long, group = "what")]
    pub points: bool,
    /// One line per branch, including how its sides ended
    #[arg(long, group = "what")]
    pub branches: bool,
    /// Notes: what was found for each seed, the paths of the homotopies, switches that led to known branches, what was
    /// not reached
    #[arg(long, group = "what")]
    pub notes: bool,
    /// Results of surveys and sweeps
    #[arg(long, group = "what")]
    pub responses: bool,
    /// Answers to design questions
    #[arg(long, group = "what")]
    pub designs: bool,
    /// Cells of this map over parameters
    #[arg(long, group = "what", value_name = "NAME")]
    pub map: Option<String>,
    /// Derivatives of the special points with respect to every parameter
    #[arg(long, group = "what")]
    pub sensitivities: bool,
    /// Uncertainty of the special points from that of the parameters
    #[arg(long, group = "what")]
    pub uncertainty: bool,
    /// Response of every solution to a small further forcing, to first order: the largest amplitude of each state per
    /// unit of the forcing, and the distance of the frequency from the nearest exponent
    #[arg(long, group = "what")]
    pub susceptibility: bool,
    /// With --susceptibility: amplitude of the forcing in the equation of a state, a number or an expression of parameters for
    /// cos νt, with a factor i at its end for -sin νt; can be repeated
    #[arg(long, value_name = "STATE=AMPLITUDE", allow_hyphen_values = true)]
    pub force: Vec<String>,
    /// With --susceptibility: ν, an expression of parameters in radians per unit of time
    #[arg(long, value_name = "EXPRESSION", allow_hyphen_values = true)]
    pub frequency: Option<String>,
    /// With --sensitivities or --uncertainty: also this number (`period`, or a state or output followed by _min or _max), or
    /// `all`; can be repeated [default: the parameter of the branch, the period, and the angle of the multipliers]
    #[arg(long, value_name = "NAME")]
    pub of: Vec<String>,
    /// With --sensitivities and --branch: derivatives at the point with this position on the branch, special or not, all other
    /// parameters fixed
    #[arg(long, value_name = "N", allow_negative_numbers = true, requires = "branch")]
    pub position: Option<i64>,
    /// With --uncertainty: number of samples at which the special points are recomputed
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub samples: u32,
    /// Only this branch, or the legs of this homotopy
    #[arg(long, value_name = "NAME")]
    pub branch: Option<String>,
    /// Format of the table
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Show a parameter, state, output or `period` in another unit, or a frequency in orders of a speed, as in
    /// omega=orders:Omega; can be repeated
    #[arg(long, value_name = "NAME=UNIT")]
    pub unit: Vec<String>,
}

/// Table to print.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    Special,
    Points,
    Branches,
    Responses,
    Designs,
    Map,
    Notes,
    Sensitivities,
    Uncertainty,
    Susceptibility,
}

impl Table {
    pub fn what(&self) -> What {
        let asked = [
            (self.points, What::Points),
            (self.branches, What::Branches),
            (self.responses, What::Responses),
            (self.designs, What::Designs),
            (self.map.is_some(), What::Map),
            (self.notes, What::Notes),
            (self.sensitivities, What::Sensitivities),
            (self.uncertainty, What::Uncertainty),
            (self.susceptibility, What::Susceptibility),
        ];
        asked.into_iter().find(|(asked, _)| *asked).map_or(What::Special, |(_, what)| what)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Aligned columns, without parameters that do not change
    Text,
    /// Comma-separated values, full precision
    Csv,
    /// List of objects, full precision
    Json,
}

#[derive(Debug, Args)]
pub struct Verify {
    /// Folder of the run
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Recompute at most N points, spread evenly, and all special points [default: all points]
    #[arg(long, value_name = "N")]
    pub sample: Option<usize>,
    /// Only this branch, or the legs of this homotopy
    #[arg(long, value_name = "NAME")]
    pub branch: Option<String>,
    /// Number of worst comparisons to list
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub worst: usize,
    /// Format of the table
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

#[derive(Debug, Args)]
pub struct Exact {
    /// Folder of the run of a model with `smoothing`
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Run of the same study at another sharpness [default: one at twice the sharpness, in DIR-sharper]
    #[arg(long, value_name = "DIR")]
    pub beside: Option<PathBuf>,
    /// Folder for the run of the exact law [default: DIR-exact]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Number of branches followed in parallel [default: number of processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    /// Format of the table
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

#[derive(Debug, Args)]
pub struct View {
    /// Folder of a run; a study, whose run is started or resumed; or a model, for a first study [default: examples to begin
    /// with]
    #[arg(value_name = "DIR|STUDY.toml|MODEL.toml")]
    pub what: Option<PathBuf>,
    /// Folder for the run of a study [default: runs/NAME for NAME.toml]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Number of branches that the run of a study follows in parallel [default: number of processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    /// Print the address without opening a browser
    #[arg(long)]
    pub no_browser: bool,
}

#[derive(Debug, Args)]
pub struct Plot {
    /// Folder of the run
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Horizontal axis: a parameter, `period`, `norm`, or a state or output followed by _max, _min, _mean, _rms or _integral
    /// [default: the free parameter]
    #[arg(long, value_name = "NAME")]
    pub x: Option<String>,
    /// Vertical axis, as for --x [default: the maximum of the first output]
    #[arg(long, value_name = "NAME")]
    pub y: Option<String>,
    /// Draw only this branch, or the legs of this homotopy; can be repeated
    #[arg(long, value_name = "NAME")]
    pub branch: Vec<String>,
    /// Draw this map over one or two parameters instead
    #[arg(long, value_name = "NAME", conflicts_with_all = ["x", "y", "branch", "curves", "window", "unit", "uncertainty", "tornado", "susceptibility"])]
    pub map: Option<String>,
    /// With --map: quantity to draw [default: what is found in each cell; over one parameter, the first number]
    #[arg(long, value_name = "NAME", requires = "map")]
    pub of: Option<String>,
    /// With --map: motion or special point to draw, such as "2:1 cycle" or "response: fold 1"
    #[arg(long, value_name = "LABEL", requires = "map")]
    pub item: Option<String>,
    /// Draw the two-parameter curves in their plane instead of the branches
    #[arg(long, conflicts_with_all = ["uncertainty", "tornado"])]
    pub curves: bool,
    /// Draw the uncertainty of the special points as error bars: two standard deviations to either side, to first order. A
    /// study with `uncertainty = true` asks for it too
    #[arg(long, conflicts_with = "tornado")]
    pub uncertainty: bool,
    /// Draw instead how much each parameter changes this number at a special point: the parameter of the branch, `period`, or
    /// a state or output followed by _min or _max
    #[arg(long, value_name = "NAME", conflicts_with_all = ["x", "y", "window"])]
    pub tornado: Option<String>,
    /// With --tornado: the special point, as BRANCH:NUMBER counted from 1 or KIND, such as fold [default: the first that has
    /// sensitivities]
    #[arg(long, value_name = "POINT", requires = "tornado")]
    pub at: Option<String>,
    /// Draw the response of every solution to a small further forcing, to first order, as a quantity NAME_response of each state
    /// [default vertical axis: that of the first state]
    #[arg(long, conflicts_with_all = ["uncertainty", "tornado", "curves", "unit"])]
    pub susceptibility: bool,
    /// With --susceptibility: amplitude of the forcing, as for `foldline table`; can be repeated
    #[arg(long, value_name = "STATE=AMPLITUDE", allow_hyphen_values = true, requires = "susceptibility")]
    pub force: Vec<String>,
    /// With --susceptibility: ν, an expression of parameters in radians per unit of time
    #[arg(long, value_name = "EXPRESSION", allow_hyphen_values = true, requires = "susceptibility")]
    pub frequency: Option<String>,
    /// Content of the picture
    #[arg(long, value_name = "WHAT", value_parser = ["branches", "multipliers", "orbits", "waterfall", "harmonics", "spectrogram"], conflicts_with_all = ["map", "curves", "uncertainty", "tornado", "susceptibility"])]
    pub show: Option<String>,
    /// Third axis: draw the branches in three dimensions
    #[arg(long, value_name = "NAME", conflicts_with_all = ["map", "show", "uncertainty", "tornado", "susceptibility"])]
    pub z: Option<String>,
    /// With three axes: direction of the view in degrees, its angle about the vertical axis and its height [default: -60,25]
    #[arg(long, value_name = "AZIMUTH,ELEVATION", allow_hyphen_values = true)]
    pub view: Option<String>,
    /// Draw the state on the vertical axis at the start of this number of forcing periods: of the motions of surveys and sweeps,
    /// which are integrated again from their last states, and of the cycles on branches
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(1..=100_000), conflicts_with_all = ["map", "show", "z", "curves", "uncertainty", "tornado", "susceptibility"])]
    pub strobe: Option<u64>,
    /// Draw it where this state or output passes a level upwards instead (Poincaré section)
    #[arg(long, value_name = "NAME=LEVEL", allow_hyphen_values = true, conflicts_with_all = ["map", "show", "z", "curves", "uncertainty", "tornado", "susceptibility"])]
    pub section: Option<String>,
    /// Number of orbits (at most 24) or of profiles in a waterfall [default: 9 or 30]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=400), requires = "show")]
    pub count: Option<u64>,
    /// Limits of the axes
    #[arg(long, value_name = "x0,x1,y0,y1", allow_hyphen_values = true)]
    pub window: Option<String>,
    /// Show this part in a panel of its own, and its outline in the diagram; can be repeated
    #[arg(long, value_name = "x0,x1,y0,y1", allow_hyphen_values = true, conflicts_with_all = ["map", "show", "z", "uncertainty", "tornado", "susceptibility"])]
    pub zoom: Vec<String>,
    /// Logarithmic axes
    #[arg(long, value_name = "AXES", value_parser = ["x", "y", "xy"], conflicts_with_all = ["map", "tornado"])]
    pub log: Option<String>,
    /// Title of the picture
    #[arg(long, value_name = "TEXT")]
    pub title: Option<String>,
    /// Width and height, in units of which the text is 13 high [default: 960x600]
    #[arg(long, value_name = "WIDTHxHEIGHT", conflicts_with_all = ["map", "tornado"])]
    pub size: Option<String>,
    /// Colours: on white, on a dark ground, or black with marks that tell curves apart
    #[arg(long, value_name = "THEME", value_parser = foldline_store::study_file::THEMES, default_value = "light", conflicts_with_all = ["map", "tornado"])]
    pub theme: String,
    /// Draw this `[[figure]]` of the study
    #[arg(long, value_name = "NAME", conflicts_with_all = ["x", "y", "branch", "map", "curves", "window", "title", "log", "size", "show", "z", "strobe", "section", "zoom", "uncertainty", "tornado", "susceptibility"])]
    pub figure: Option<String>,
    /// With --figure: study file that describes it [default: the study as it was run]
    #[arg(long, value_name = "FILE", requires = "figure")]
    pub study: Option<PathBuf>,
    /// Show a parameter, state, output or `period` in another unit, or a frequency in orders of a speed, as in
    /// omega=orders:Omega; can be repeated
    #[arg(long, value_name = "NAME=UNIT")]
    pub unit: Vec<String>,
    /// Picture to write; the file extension sets the format
    #[arg(short, long = "output", value_name = "FILE.svg|png|pdf")]
    pub output: PathBuf,
}

#[derive(Debug, Args)]
pub struct Export {
    /// Folder of the run
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Format
    #[arg(long, value_enum)]
    pub format: ExportFormat,
    /// Folder for the tables, or NetCDF or HTML file [default: DIR/csv, DIR/parquet, DIR/run.nc, DIR/run.html]
    #[arg(short, long, alias = "output", value_name = "PATH")]
    pub out: Option<PathBuf>,
    /// Only this branch, or the legs of this homotopy; can be repeated [default: everything]
    #[arg(long, value_name = "NAME")]
    pub branch: Vec<String>,
    /// Leave out the profiles of cycles, which are nearly all of the data
    #[arg(long)]
    pub no_profiles: bool,
    /// Also write a table of the derivatives of the special points with respect to every parameter
    #[arg(long)]
    pub sensitivities: bool,
    /// Show a parameter, state, output or `period` in another unit, or a frequency in orders of a speed, as in
    /// omega=orders:Omega; can be repeated
    #[arg(long, value_name = "NAME=UNIT")]
    pub unit: Vec<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ExportFormat {
    /// Folder of tables with comma-separated values, full precision
    Csv,
    /// Folder of tables as Parquet files
    Parquet,
    /// One NetCDF-4 file with a group per branch
    Netcdf,
    /// One page with diagram and orbits for any browser, without a server
    Html,
}

#[derive(Debug, Args)]
pub struct ImportAuto {
    /// AUTO files s.NAME; b.NAME and c.NAME, given or in the same folder, supply the names of states and parameters. Or an equations
    /// file NAME.f90, NAME.f or NAME.c with c.NAME, given or in the same folder, which become a model and a study
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,
    /// Model with the same equations; without it, the solutions are only listed
    #[arg(long, value_name = "MODEL.toml")]
    pub model: Option<PathBuf>,
    /// Only the solution with this label; can be repeated [default: all]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub label: Vec<i64>,
    /// Names of AUTO's parameters in the model, where the files do not give them
    #[arg(long, value_name = "1=NAME,...", value_delimiter = ',')]
    pub parameters: Vec<String>,
    /// Names of AUTO's states in the model, where neither the files nor the order gives them
    #[arg(long, value_name = "1=NAME,...", value_delimiter = ',')]
    pub states: Vec<String>,
    /// Study to write [default: NAME.toml]; a model goes to NAME-model.toml beside it
    #[arg(short, long = "output", value_name = "STUDY.toml")]
    pub output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct Attractors {
    /// Model file
    #[arg(value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Set a parameter; can be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Number of initial states
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..))]
    pub samples: u32,
    /// Random seed; the same seed gives the same table
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}

#[derive(Debug, Args)]
pub struct Basins {
    /// Model file
    #[arg(value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Set a parameter; can be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Range of a state for the initial states; can be repeated [default: the ranges of the model]
    #[arg(long = "range", value_name = "STATE=LOW:HIGH", allow_hyphen_values = true)]
    pub range: Vec<String>,
    /// Number of initial states drawn uniformly from the ranges, for the fractions
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(0..=100_000_000))]
    pub samples: u32,
    /// Random seed; the same seed gives the same fractions
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Two states that span the plane of the picture, horizontal axis first
    #[arg(long, value_name = "STATE,STATE")]
    pub plane: Option<String>,
    /// Values of the other states in the plane; can be repeated [default: 0, or the nearest value of the range]
    #[arg(long = "at", value_name = "STATE=VALUE,...", allow_hyphen_values = true, requires = "plane")]
    pub at: Vec<String>,
    /// Number of cells along the horizontal axis of the plane, or along both axes as in 512x256
    #[arg(long, value_name = "N", default_value = "256", value_parser = cells, requires = "plane")]
    pub cells: [usize; 2],
    /// Compute the cells of the plane only where the fate changes, beginning with blocks of N cells; others are filled, and some
    /// of them checked [default without N: 8]
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, default_missing_value = "8", requires = "plane",
          value_parser = clap::value_parser!(u16).range(2..=1024))]
    pub adaptive: Option<u16>,
    /// Also find the smallest kick that leads out of each basin: in the plane, or in all states, within their ranges; N directions
    /// [default without N: 64]
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, default_missing_value = "64",
          value_parser = clap::value_parser!(u32).range(2..=100_000))]
    pub kicks: Option<u32>,
    /// Fractions over this parameter instead, with the attractors followed from value to value
    #[arg(long, value_name = "NAME=FIRST:LAST", allow_hyphen_values = true, conflicts_with_all = ["plane", "kicks"])]
    pub along: Option<String>,
    /// With --along: number of values
    #[arg(long, value_name = "N", default_value_t = 11, requires = "along", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    pub values: u32,
    /// With --along: run whose branches give the attractors their names
    #[arg(long, value_name = "DIR", requires = "along")]
    pub branches: Option<PathBuf>,
    /// Number of threads [default: number of processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    #[command(flatten)]
    pub limits: Limits,
    /// Format of the table
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Picture of the plane, or of the fractions over a parameter; the file extension sets the format
    #[arg(short, long = "output", value_name = "FILE.svg|png|pdf")]
    pub output: Option<PathBuf>,
    /// File for the cells of the plane, one per line: both states, and the number of the attractor or the reason why there
    /// is none
    #[arg(long, value_name = "FILE.csv", requires = "plane")]
    pub data: Option<PathBuf>,
}

/// Parses numbers of cells.
fn cells(text: &str) -> Result<[usize; 2], String> {
    let number = |text: &str| text.trim().parse().ok().filter(|count| (1..=16384).contains(count));
    let found = match text.split_once('x') {
        Some((x, y)) => number(x).zip(number(y)).map(|(x, y)| [x, y]),
        None => number(text).map(|count| [count, count]),
    };
    found.ok_or_else(|| "expected a number from 1 to 16384, or two as in 512x256".into())
}

#[derive(Debug, Args)]
pub struct Emit {
    /// Model file
    #[arg(value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// CUDA source, for nvcc or CuPy (default)
    #[arg(long, conflicts_with = "c")]
    pub cuda: bool,
    /// C source with a main program, instead of CUDA
    #[arg(long)]
    pub c: bool,
    /// Separate parameters for every trajectory
    #[arg(long)]
    pub own_parameters: bool,
    /// End trajectories where they settle on known solutions
    #[arg(long)]
    pub settle: bool,
    /// Record crossings of a plane, or states at multiples of a time
    #[arg(long)]
    pub section: bool,
    /// File to write [default: the standard output]
    #[arg(short, long = "output", value_name = "FILE.cu|c")]
    pub output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct Check {
    /// Model or study file
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
}

#[derive(Debug, Args)]
pub struct Reproduce {
    /// Name of the publication
    #[arg(value_name = "PUBLICATION")]
    pub publication: String,
    /// Only this figure; can be repeated [default: all]
    #[arg(long, value_name = "N")]
    pub figure: Vec<String>,
    /// Folder for runs, figures and report [default: reproduced/PUBLICATION]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Number of branches followed in parallel [default: number of processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
}
