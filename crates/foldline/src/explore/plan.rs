//! What a study asks for, in terms of the model.

use crate::attractors::Limits;
use crate::diagram::{Cycle, Kind};
use crate::special::mark::Mark;

/// Which attractor a seed means, among those that count as reached until every type was found that the seeds with the same sample ask for
/// ([`crate::attractors::survey_until`]).
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AttractorKey {
    /// The equilibrium of smallest norm.
    Equilibrium,
    /// The cycle that was reached most often.
    Cycle,
    /// The cycle with this spectral ratio, such as 2:1, that was reached most often.
    Ratio(u32, u32),
    /// The cycle that lasts so many periods of the forcing and was reached most often.
    Lasting(u32),
}

/// Where a first solution comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum SeedSource {
    /// Found by sampling initial states.
    Attractor(AttractorKey),
    /// Settled (or polished) from this state `[n]`.
    State(Vec<f64>),
    /// Polished from this cycle.
    Cycle(Cycle),
}

/// A first solution.
#[derive(Clone, Debug, PartialEq)]
pub struct SeedPlan {
    /// Unique name.
    pub name: String,
    /// Where it comes from.
    pub source: SeedSource,
    /// Every parameter value `[k]` at the seed.
    pub parameters: Vec<f64>,
    /// How many initial states to sample at most.
    pub samples: usize,
    /// Seed of the random numbers.
    pub random: u64,
}

/// Where a branch starts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Start {
    /// At the seed of that index.
    Seed(usize),
    /// At the end of the branch of that index (its `until`, or its forward bound).
    EndOf(usize),
    /// At the end of the branch of that name, to which the plan switches from the branch of that index.
    EndOfSwitched(usize, String),
    /// At the end of the curve of that index.
    EndOfCurve(usize),
    /// Where the homotopy of that index arrived.
    EndOfHomotopy(usize),
}

/// At which special points to branch off, and how deep.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Switching {
    /// Depth for each kind; a kind that is not listed is not switched at. A depth of 2 at period doublings follows the
    /// period-doubled branches and the branches that double there again.
    pub depth: Vec<(Kind, usize)>,
    /// Depth at single special points, of that kind and number counted from the side of smaller positions, which goes before that
    /// of the kind; on the branch itself, not on what is switched to.
    pub only: Vec<(Kind, usize, usize)>,
}

impl Switching {
    /// The depth for a kind.
    pub fn at(&self, kind: Kind) -> usize {
        self.depth.iter().find(|(k, _)| *k == kind).map_or(0, |(_, d)| *d)
    }

    /// The depth at the special point of that kind and number, from 1.
    pub fn at_point(&self, kind: Kind, number: usize) -> usize {
        let single = self.only.iter().find(|(k, n, _)| *k == kind && *n == number);
        single.map_or_else(|| self.at(kind), |(.., depth)| *depth)
    }

    /// Whether it switches at any kind.
    pub fn anywhere(&self) -> bool {
        self.depth.iter().any(|(_, depth)| *depth > 0) || self.only.iter().any(|(.., depth)| *depth > 0)
    }

    /// What remains for a branch that was reached by switching at the point of that kind and number.
    pub fn below(&self, kind: Kind, number: usize) -> Switching {
        let left = self.at_point(kind, number).saturating_sub(1);
        let others = self.depth.iter().copied().filter(|(k, _)| *k != kind);
        Switching { depth: others.chain([(kind, left)]).collect(), only: Vec::new() }
    }
}

/// A branch to follow.
#[derive(Clone, Debug, PartialEq)]
pub struct BranchPlan {
    /// Unique name.
    pub name: String,
    /// Where it starts.
    pub start: Start,
    /// Index of the continuation parameter.
    pub free: usize,
    /// Smallest and largest value of the parameter.
    pub range: [f64; 2],
    /// Follow only towards this value and stop there (a homotopy run); it lies in `range`.
    pub until: Option<f64>,
    /// Where to branch off.
    pub switching: Switching,
    /// Values to mark, or to stop at, on it and on what is switched to from it.
    pub marks: Vec<Mark>,
    /// Limit on the number of points per side.
    pub max_points: usize,
}

/// A curve in two parameters along which a special point is held.
#[derive(Clone, Debug, PartialEq)]
pub struct CurvePlan {
    /// Unique name.
    pub name: String,
    /// Bifurcation that is continued: a fold, branch point, Hopf, period doubling or torus point.
    pub hold: Kind,
    /// Name of the branch on which the special point lies: one of the plan, or one switched to from it.
    pub of: String,
    /// The special point is the one of that kind nearest to this value of the branch's parameter; the first one if `None`.
    pub near: Option<f64>,
    /// Index of the second parameter; the first is that of the branch.
    pub free: usize,
    /// Smallest and largest value of the branch's parameter, then of the second parameter.
    pub ranges: [[f64; 2]; 2],
    /// Follow only towards this value of the second parameter and stop there; it lies in its range.
    pub until: Option<f64>,
    /// Values to mark, or to stop at.
    pub marks: Vec<Mark>,
    /// Limit on the number of points per side.
    pub max_points: usize,
}

/// A family brought from one set of parameter values to another, by whatever route gets through.
#[derive(Clone, Debug, PartialEq)]
pub struct HomotopyPlan {
    /// Unique name.
    pub name: String,
    /// Where it starts.
    pub start: Start,
    /// Parameters that change together, with their values at the goal.
    pub targets: Vec<(usize, f64)>,
    /// Index of the parameter in which the family may be moved on the way, and its range.
    pub via: usize,
    /// Smallest and largest value of that parameter.
    pub range: [f64; 2],
    /// Limit on the number of points of each run.
    pub max_points: usize,
}

/// A diagram to be found without being told where anything is.
#[derive(Clone, Debug, PartialEq)]
pub struct ExplorePlan {
    /// Unique name; what is found is named after it.
    pub name: String,
    /// Every parameter value `[k]`; that of the free parameter does not count.
    pub parameters: Vec<f64>,
    /// Index of the continuation parameter.
    pub free: usize,
    /// Smallest and largest value of the parameter.
    pub range: [f64; 2],
    /// At how many values of it attractors and equilibria are looked for.
    pub values: usize,
    /// How many initial states are sampled at each.
    pub samples: usize,
    /// Seed of the random numbers.
    pub random: u64,
    /// Where to branch off.
    pub switching: Switching,
    /// A second parameter, and its range, in which folds are followed to isolated branches.
    pub connect: Option<(usize, [f64; 2])>,
    /// No branch is begun once this many points are accepted.
    pub budget: usize,
    /// Limit on the number of points per side of a branch.
    pub max_points: usize,
}

/// Simulation from many starts at many values of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct SurveyPlan {
    /// Unique name.
    pub name: String,
    /// Every parameter value `[k]`; that of the free parameter does not count.
    pub parameters: Vec<f64>,
    /// Index of the parameter that varies.
    pub free: usize,
    /// Its values.
    pub values: Vec<f64>,
    /// How many starts at each value.
    pub starts: usize,
    /// Seed of the random numbers.
    pub random: u64,
}

/// Simulation from value to value of a parameter, each from the last state of the one before.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepPlan {
    /// Unique name.
    pub name: String,
    /// Index of the seed it starts at.
    pub seed: usize,
    /// Index of the parameter that varies.
    pub free: usize,
    /// Its values, in the order in which they are visited.
    pub values: Vec<f64>,
}

/// Everything a study asks for.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The one tolerance.
    pub tolerance: f64,
    /// Degree of the collocation polynomials.
    pub degree: usize,
    /// Limits on trajectories in the search for first solutions.
    pub limits: Limits,
    /// Limits on each trajectory of surveys and sweeps.
    pub simulation: Limits,
    /// First solutions.
    pub seeds: Vec<SeedPlan>,
    /// Branches, in the order in which they were written.
    pub branches: Vec<BranchPlan>,
    /// Curves in two parameters.
    pub curves: Vec<CurvePlan>,
    /// Homotopies.
    pub homotopies: Vec<HomotopyPlan>,
    /// Diagrams to be found.
    pub explorations: Vec<ExplorePlan>,
    /// Surveys by simulation.
    pub surveys: Vec<SurveyPlan>,
    /// Stepped sweeps by simulation.
    pub sweeps: Vec<SweepPlan>,
}

impl Plan {
    /// A plan that asks for nothing.
    pub fn empty(tolerance: f64, degree: usize) -> Plan {
        Plan {
            tolerance,
            degree,
            limits: Limits::default(),
            simulation: Limits::patient(),
            seeds: Vec::new(),
            branches: Vec::new(),
            curves: Vec::new(),
            homotopies: Vec::new(),
            explorations: Vec::new(),
            surveys: Vec::new(),
            sweeps: Vec::new(),
        }
    }
}
