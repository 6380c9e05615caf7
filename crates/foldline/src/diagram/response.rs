//! Results of simulation: settled motions that need not lie on a branch.

use super::Share;

/// Type of motion to which a trajectory settled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Motion {
    /// State of rest.
    Equilibrium,
    /// Periodic motion.
    Cycle,
    /// Quasi-periodic motion with two frequencies: a torus or, for a map, a closed curve.
    Torus,
    /// Chaotic motion: its largest Lyapunov exponent is positive.
    Chaos,
    /// None of these by the criteria, within the limit on the number of steps; [`Recognition::reason`] says why.
    Other,
    /// The trajectory ends where its events, such as impacts, accumulate.
    Chatter,
    /// The trajectory ran to infinity or out of the region in which f is defined, or its steps became too small. In files
    /// of version 0.2 and earlier also chatter.
    Escaped,
}

impl Motion {
    /// All types of motion.
    pub const ALL: [Motion; 7] = [
        Motion::Equilibrium,
        Motion::Cycle,
        Motion::Torus,
        Motion::Chaos,
        Motion::Other,
        Motion::Chatter,
        Motion::Escaped,
    ];

    /// The name used in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Motion::Equilibrium => "equilibrium",
            Motion::Cycle => "cycle",
            Motion::Torus => "torus",
            Motion::Chaos => "chaos",
            Motion::Other => "other",
            Motion::Chatter => "chatter",
            Motion::Escaped => "escaped",
        }
    }

    /// Returns the motion of that name.
    pub fn from_name(name: &str) -> Option<Motion> {
        Motion::ALL.into_iter().find(|motion| motion.name() == name)
    }

    /// True if the trajectory could not be continued: it escaped or ended in chatter. Such a motion has no ranges.
    pub fn is_lost(self) -> bool {
        matches!(self, Motion::Escaped | Motion::Chatter)
    }
}

/// Numbers by which a motion that neither rests nor repeats itself was recognised, or the reason why it was not.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recognition {
    /// Rotation number ρ of a torus, in turns per period, with its error; up to its sign and whole numbers, and between 0
    /// and 1/2.
    pub rotation: Option<[f64; 2]>,
    /// Largest Lyapunov exponent other than the one along the motion, per unit of time of the model or per iteration,
    /// with its error.
    pub exponent: Option<[f64; 2]>,
    /// Number of periods observed.
    pub returns: usize,
    /// Reason why the type was not decided; otherwise empty.
    pub reason: String,
}

/// A settled motion at one value of a parameter. Every number comes from the trajectory itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// Value of the parameter that varies.
    pub value: f64,
    /// Value of every parameter of the model.
    pub parameters: Vec<f64>,
    /// Type of motion.
    pub motion: Motion,
    /// Period of a cycle, from the returns of the trajectory; of a torus, the forcing periods after which its section closes
    /// or, without forcing, the period of its strongest spectral line.
    pub period: Option<f64>,
    /// Spectral ratio of a cycle, such as 2:1, if the model has a whirl plane.
    pub ratio: Option<(u32, u32)>,
    /// Number of periods of its strong lines after which a cycle closes: 2 after a period doubling; 1 if unknown.
    pub multiplicity: u32,
    /// Smallest and largest value of every state, then of every output: over one period, or over the time observed.
    pub ranges: Vec<[f64; 2]>,
    /// Number of starts that settled there. Not a basin fraction: some starts are drawn towards the origin.
    pub hits: usize,
    /// In a survey, the fraction of uniformly drawn starts that settled there; `None` in a sweep.
    pub share: Option<Share>,
    /// In a sweep, true if the motion is not the continuation of the one at the previous value; `None` at the first
    /// value, if the two could not be compared, and in a survey.
    pub jumped: Option<bool>,
    /// `[n]` last state; with forcing, at the start of a forcing period. (Up to version 0.2 of the program at any time.)
    pub state: Vec<f64>,
    /// Time until the motion had settled, without the time saved by extrapolation.
    pub settled_after: f64,
    /// For a cycle, its closing error relative to its extent. For an equilibrium, the remaining motion, but at least
    /// the tolerance of the integration, relative to scale plus size. For a torus, the largest distance of a state from its
    /// section, relative to the extent of that.
    pub error: f64,
    /// For a map, iterates of the motion: those of one period, or some of a motion that is not periodic; `[count][states
    /// and outputs]`. Empty otherwise, and in files of earlier versions.
    pub iterates: Vec<f64>,
    /// Evidence for a torus, for chaos, or for a cycle recognised only by the same long observation; empty otherwise.
    pub recognition: Recognition,
}

impl Response {
    /// Size of a state beyond which a trajectory counts as running to infinity. A factor of safety: bounded motions
    /// stay far below it, and exponential growth reaches it soon.
    pub(crate) const UNBOUNDED: f64 = 1e12;

    /// Outcome of a trajectory that could not be continued, in words: its events accumulate, it ran to infinity, or it
    /// could not be integrated beyond its last state.
    pub fn fate(&self) -> &'static str {
        if self.motion == Motion::Chatter {
            return "ends in chatter: its impacts follow each other ever faster and accumulate; the sustained contact that \
                    follows is not simulated";
        }
        match self.state.iter().all(|x| x.abs() < Response::UNBOUNDED) {
            true => "cannot be integrated past a state at which f jumps or is undefined",
            false => "grows without bound",
        }
    }
}

/// Type of simulation by which responses were found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Search {
    /// From many initial states at every value.
    Survey,
    /// From value to value, each from the last state of the previous one.
    Sweep,
}

impl Search {
    /// The name used in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Search::Survey => "survey",
            Search::Sweep => "sweep",
        }
    }

    /// Returns the search of that name.
    pub fn from_name(name: &str) -> Option<Search> {
        [Search::Survey, Search::Sweep].into_iter().find(|search| search.name() == name)
    }
}

/// The responses of a survey or of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Responses {
    /// Name, unique within a diagram.
    pub name: String,
    /// Type of simulation.
    pub search: Search,
    /// Index of the parameter that varies.
    pub free: usize,
    /// Responses in the order in which the values were visited; at each value the most frequent first.
    pub responses: Vec<Response>,
}

impl Responses {
    /// Change of a range, relative to the median change of the sweep, that counts as a jump in files that do not say
    /// where a sweep jumped. Order of magnitude: a smooth response changes by a few times the median.
    const STEEP: f64 = 10.0;

    /// Indices of the responses of a sweep at which it jumped to a different solution. A response that could not be
    /// compared counts if its kind of motion differs from the one before. A set without any comparison, as in an old
    /// file, falls back on [`Responses::steep`].
    pub fn jumps(&self) -> Vec<usize> {
        if self.responses.iter().all(|response| response.jumped.is_none()) {
            return self.steep(Responses::STEEP);
        }
        let pairs = self.responses.windows(2).enumerate();
        let jumped = |pair: &[Response]| pair[1].jumped.unwrap_or(pair[0].motion != pair[1].motion);
        pairs.filter(|(_, pair)| jumped(pair)).map(|(k, _)| k + 1).collect()
    }

    /// Indices of the responses of a sweep that differ strongly from the one before: a different kind of motion, ratio
    /// or multiplicity, or a change of the largest range beyond `factor` times the median. On a steep resonance curve
    /// that need not be a jump.
    pub fn steep(&self, factor: f64) -> Vec<usize> {
        // Each quantity is taken relative to its largest value in the sweep.
        let count = self.responses.iter().map(|r| r.ranges.len()).max().unwrap_or(0);
        let largest = |k: usize| {
            let ranges = self.responses.iter().filter_map(|r| r.ranges.get(k));
            ranges.fold(f64::MIN_POSITIVE, |m, [low, high]| m.max(low.abs()).max(high.abs()))
        };
        let sizes: Vec<f64> = (0..count).map(largest).collect();
        let change = |pair: &[Response]| {
            let pairs = pair[0].ranges.iter().zip(&pair[1].ranges).zip(&sizes);
            let changes = pairs.map(|((a, b), size)| (a[0] - b[0]).abs().max((a[1] - b[1]).abs()) / size);
            changes.fold(0.0, f64::max)
        };
        let changes: Vec<f64> = self.responses.windows(2).map(change).collect();
        let mut sorted = changes.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        let named = |r: &Response| (r.motion, r.ratio, r.multiplicity);
        let pairs = self.responses.windows(2).zip(changes).enumerate();
        pairs
            .filter(|(_, (pair, change))| named(&pair[0]) != named(&pair[1]) || *change > factor * median)
            .map(|(k, _)| k + 1)
            .collect()
    }
}
