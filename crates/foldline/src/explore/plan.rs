//! Requests of a study, in terms of the model.

use super::cells::answers::Reading;
use crate::attractors::Limits;
use crate::diagram::{Cycle, Kind};
use crate::special::mark::Mark;
use crate::special::on_levels::Level;
use crate::special::quantity::Quantity;

/// Attractor that a seed means, among those that count as reached when the search ended: once every type requested by
/// the seeds with the same sample was found ([`crate::attractors::survey_until`]).
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AttractorKey {
    /// The equilibrium of smallest norm.
    Equilibrium,
    /// The cycle that was reached most often.
    Cycle,
    /// The cycle with this spectral ratio, such as 2:1, that was reached most often.
    Ratio(u32, u32),
    /// The cycle of that many forcing periods that was reached most often.
    Lasting(u32),
}

/// Source of a first solution.
#[derive(Clone, Debug, PartialEq)]
pub enum SeedSource {
    /// Found by sampling initial states.
    Attractor(AttractorKey),
    /// Limit of the trajectory, or of Newton's method, from this state `[n]`.
    State(Vec<f64>),
    /// Limit of Newton's method from this cycle.
    Cycle(Cycle),
    /// Solution of a boundary-value problem from this profile, other than those of the earlier seeds with these indices.
    Besides(Cycle, Vec<usize>),
    /// The cycle from this source as a torus, at parameter values at which the forcing has no effect.
    Torus(Box<SeedSource>),
    /// The torus of a quasi-periodic motion that is found by simulation.
    QuasiPeriodic,
}

/// A first solution.
#[derive(Clone, Debug, PartialEq)]
pub struct SeedPlan {
    /// Unique name.
    pub name: String,
    /// Source of the solution.
    pub source: SeedSource,
    /// Every parameter value `[k]` at the seed.
    pub parameters: Vec<f64>,
    /// Largest number of initial states to sample.
    pub samples: usize,
    /// Seed of the random numbers.
    pub random: u64,
}

/// Start of a branch.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// At the seed of that index.
    Seed(usize),
    /// At the end of the branch of that index (its `until`, or its forward bound).
    EndOf(usize),
    /// At the end of the branch of that name, to which the plan switches from the branch of that index.
    EndOfSwitched(usize, String),
    /// At the end of the curve of that index.
    EndOfCurve(usize),
    /// At the goal of the homotopy of that index.
    EndOfHomotopy(usize),
    /// At a point of a branch.
    Near(Near),
}

/// Point of a branch, given by values that it has.
#[derive(Clone, Debug, PartialEq)]
pub struct Near {
    /// Index of the branch of the plan on which the point lies, or from which the plan switches to its branch.
    pub branch: usize,
    /// Name of its branch.
    pub name: String,
    /// Values of quantities, to which it is the closest point.
    pub levels: Vec<Level>,
}

/// Special points at which to switch branches, and depth.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Switching {
    /// Depth for each kind; a kind that is not listed is not switched at. A depth of 2 at period doublings follows the
    /// period-doubled branches and the branches that double there again.
    pub depth: Vec<(Kind, usize)>,
    /// Depth at single special points, by kind and number counted from the side of smaller positions. It overrides the
    /// depth of the kind, on the branch itself but not on branches switched to.
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

    /// True if branches are switched at any point.
    pub fn anywhere(&self) -> bool {
        self.depth.iter().any(|(_, depth)| *depth > 0) || self.only.iter().any(|(.., depth)| *depth > 0)
    }

    /// Returns the switching that remains for a branch reached by switching at the point of that kind and number.
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
    /// Its start.
    pub start: Start,
    /// Index of the continuation parameter.
    pub free: usize,
    /// Smallest and largest value of the parameter.
    pub range: [f64; 2],
    /// If given, the branch is followed only towards this value, which lies in `range`, and stops there.
    pub until: Option<f64>,
    /// Special points at which to switch branches.
    pub switching: Switching,
    /// Values to mark, or to stop at, and peaks, on the branch and on those switched to from it.
    pub marks: Vec<Mark>,
    /// Limit on the number of points per side.
    pub max_points: usize,
    /// Held quantities, and the further parameters that are solved for.
    pub holds: Holds,
}

/// Quantities held along a branch, and as many further free parameters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Holds {
    /// The parameters, by index, and the range of each.
    pub others: Vec<(usize, Option<[f64; 2]>)>,
    /// The quantities. A value that is NaN stands for that of the start.
    pub levels: Vec<Level>,
    /// True if, in place of quantities, the singular points of branches over all further parameters but the first are
    /// followed, such as the centres of isolas.
    pub singular: bool,
    /// Value of the parent's parameter next to which the start is sought, where several points of the parent have the
    /// values of the quantities.
    pub near: Option<f64>,
}

/// A bifurcation curve in two parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct CurvePlan {
    /// Unique name.
    pub name: String,
    /// Bifurcation or connecting orbit that is continued, such as a fold, a Hopf point or a homoclinic orbit.
    pub hold: Kind,
    /// Name of the branch on which the special point lies: one of the plan, or one switched to from it.
    pub of: String,
    /// Value of the branch's parameter that selects the nearest special point of that kind; `None` selects the first.
    pub near: Option<f64>,
    /// A state near the second equilibrium of a connecting orbit that starts from a branch of equilibria.
    pub to: Option<Vec<f64>>,
    /// Further parameters and their ranges, for branch points that exist for isolated values of the second one: first the
    /// one that is solved for, then those over which, like that of the branch, branches are singular.
    pub further: Vec<(usize, [f64; 2])>,
    /// Index of the second parameter; the first is that of the branch.
    pub free: usize,
    /// Smallest and largest value of the branch's parameter, then of the second parameter.
    pub ranges: [[f64; 2]; 2],
    /// If given, the curve is followed only towards this value of the second parameter, which lies in its range, and
    /// stops there.
    pub until: Option<f64>,
    /// Values to mark, or to stop at.
    pub marks: Vec<Mark>,
    /// Limit on the number of points per side.
    pub max_points: usize,
}

/// A solution family to be carried to other parameter values, by any path that succeeds.
#[derive(Clone, Debug, PartialEq)]
pub struct HomotopyPlan {
    /// Unique name.
    pub name: String,
    /// Its start.
    pub start: Start,
    /// Parameters that change together, with their values at the goal.
    pub targets: Vec<(usize, f64)>,
    /// Index of the parameter in which the family may be followed between runs towards the goal.
    pub via: usize,
    /// Smallest and largest value of that parameter.
    pub range: [f64; 2],
    /// Limit on the number of points of each run.
    pub max_points: usize,
}

/// A diagram to be found without prescribed starts.
#[derive(Clone, Debug, PartialEq)]
pub struct ExplorePlan {
    /// Unique name, after which the branches found are named.
    pub name: String,
    /// Every parameter value `[k]`; that of the free parameter is ignored.
    pub parameters: Vec<f64>,
    /// Index of the continuation parameter.
    pub free: usize,
    /// Smallest and largest value of the parameter.
    pub range: [f64; 2],
    /// Number of parameter values at which attractors and equilibria are sought.
    pub values: usize,
    /// Number of initial states sampled at each.
    pub samples: usize,
    /// Seed of the random numbers.
    pub random: u64,
    /// Special points at which to switch branches.
    pub switching: Switching,
    /// A second parameter, and its range, in which folds are continued to find isolated branches.
    pub connect: Option<(usize, [f64; 2])>,
    /// Number of accepted points beyond which no branch is started.
    pub budget: usize,
    /// Limit on the number of points per side of a branch.
    pub max_points: usize,
}

/// Simulation from many initial states at many values of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct SurveyPlan {
    /// Unique name.
    pub name: String,
    /// Every parameter value `[k]`; that of the free parameter is ignored.
    pub parameters: Vec<f64>,
    /// Index of the parameter that varies.
    pub free: usize,
    /// Its values.
    pub values: Vec<f64>,
    /// Number of initial states at each value.
    pub starts: usize,
    /// Seed of the random numbers.
    pub random: u64,
}

/// Simulation at successive values of a parameter, each started from the last state at the value before.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepPlan {
    /// Unique name.
    pub name: String,
    /// Its start: a seed, or a point of a branch.
    pub start: Start,
    /// Index of the parameter that varies.
    pub free: usize,
    /// Its values, in the order in which they are visited.
    pub values: Vec<f64>,
}

/// Condition that a design is to meet.
#[derive(Clone, Debug, PartialEq)]
pub enum Wanted {
    /// The branch has no solution.
    NoMotion,
    /// The branch has no stable solution.
    NotStable,
    /// A quantity stays below this level wherever the branch has a solution.
    Below(Level),
}

/// A design question: the value of one parameter beyond which a condition is met throughout a range of another.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignPlan {
    /// Unique name.
    pub name: String,
    /// Name of the branch: one of the plan, one switched to from it, or one found by an exploration.
    pub of: String,
    /// Names of the branch's parameter and of the design parameter, for messages.
    pub names: [String; 2],
    /// Index of the branch's parameter.
    pub free: usize,
    /// Its range.
    pub range: [f64; 2],
    /// Index of the design parameter.
    pub vary: usize,
    /// Range in which its value is sought.
    pub within: [f64; 2],
    /// True if the condition is met below the value, and its greatest value is sought.
    pub greatest: bool,
    /// The condition.
    pub wanted: Wanted,
    /// A third parameter along which an extremum inside the range is followed: its index, its name and its range.
    pub along: Option<(usize, String, [f64; 2])>,
    /// Limit on the number of points of each run.
    pub max_points: usize,
}

/// Initial states to sample in a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drawn {
    /// Their number.
    pub samples: usize,
    /// Seed of the random numbers.
    pub random: u64,
}

/// Question that a map asks in each cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Question {
    /// The special points of the study's branches.
    Points,
    /// The attractors.
    Motions(Drawn),
    /// The fractions of their basins.
    Shares(Drawn),
    /// These quantities of the motion that settles from this start.
    Settled(Vec<(String, Reading)>, SeedPlan),
}

/// Cells of a map.
#[derive(Clone, Debug, PartialEq)]
pub enum Over {
    /// All combinations of values of each parameter.
    Grid(Vec<Vec<f64>>),
    /// `[case][q]` values of the parameters.
    Cases(Vec<Vec<f64>>),
}

/// A map over parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct MapPlan {
    /// Unique name.
    pub name: String,
    /// `[q]` names of its parameters.
    pub names: Vec<String>,
    /// `[q]` their indices.
    pub indices: Vec<usize>,
    /// Every parameter value `[k]`, those of the map ignored.
    pub base: Vec<f64>,
    /// The cells.
    pub over: Over,
    /// Number of times that the steps of a grid are halved where the answer changes.
    pub refine: usize,
    /// The question.
    pub question: Question,
    /// Limit on the evaluations of f and its derivatives in a cell.
    pub most: usize,
}

/// All requests of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The tolerance.
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
    /// Design questions.
    pub designs: Vec<DesignPlan>,
    /// Maps over parameters.
    pub maps: Vec<MapPlan>,
    /// Further columns of tables and exports: names and quantities.
    pub record: Vec<(String, Quantity)>,
}

impl Plan {
    /// True if any request starts at an inner point of a branch.
    pub fn starts_inside(&self) -> bool {
        let branches = self.branches.iter().map(|branch| &branch.start);
        let homotopies = self.homotopies.iter().map(|homotopy| &homotopy.start);
        let all = branches.chain(homotopies).chain(self.sweeps.iter().map(|sweep| &sweep.start));
        all.into_iter().any(|start| matches!(start, Start::Near(_)))
    }

    /// Returns a plan without requests.
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
            designs: Vec::new(),
            maps: Vec::new(),
            record: Vec::new(),
        }
    }
}
