//! Tori of random oscillators, compared with simulation.
//!
//! **Idea.** At a point at which a branch of tori is stable, a trajectory must show the same motion: quasi-periodic, not locked, with the same
//! rotation number. Oscillators whose parameters are drawn at random cross tongues of locking of any width.
//!
//! Each branch is examined twice: by [`foldline::verify`], whose trajectories start on the torus, and by the recognition of surveys and sweeps,
//! which starts a little off it and does not use it.

use crate::cases::study;
use crate::drawn::{Draw, Problem};
use crate::random::Random;
use crate::watch::Watch;
use crate::{LIMIT, TOLERANCE};
use foldline::attractors::{Limits, Trial, stepped_sweep};
use foldline::contract::Verdict;
use foldline::diagram::{Diagram, Ending, Family, Motion, Solution};
use foldline::explore::{self, System};
use foldline::verify::{Quantity, verify};
use foldline_store::study_file::Study;
use std::fmt;

/// Largest number of stable points of a branch that are simulated.
const SIMULATED: usize = 6;
/// Largest number of points of a branch that are verified.
const VERIFIED: usize = 6;
/// Distance of the start of a simulation from the torus, relative to the scales.
const OFF: f64 = 1e-3;

const PROBLEMS: &[Problem] = &[
    Problem {
        name: "van der Pol, forced",
        model: r#"
[parameters]
w = 1
mu = 0.5
F = 1
[forcing]
frequency = "w"
[states]
x = { equation = "v", range = [-3, 3] }
v = { equation = "F*cos(w*t) + mu*(1 - x^2)*v - x", range = [-3, 3] }
"#,
        draws: &[Draw::Logarithmic("mu", 0.05, 1.0), Draw::Uniform("F", 0.1, 0.8), Draw::Uniform("w", 1.1, 2.2)],
        start: "attractor = \"torus\"\nsamples = 8",
        branch: "free = \"w\"\nrange = [0.6, 2.6]\nmax-points = 40",
        bounded: false,
    },
    Problem {
        name: "Rayleigh–Duffing, forced",
        model: r#"
[parameters]
w = 1
mu = 0.3
beta = 0.2
F = 0.3
[forcing]
frequency = "w"
[states]
x = { equation = "v", range = [-3, 3] }
v = { equation = "F*cos(w*t) + mu*(1 - v^2)*v - x - beta*x^3", range = [-3, 3] }
"#,
        draws: &[
            Draw::Logarithmic("mu", 0.05, 0.8),
            Draw::Uniform("beta", 0.0, 0.5),
            Draw::Uniform("F", 0.05, 0.5),
            Draw::Uniform("w", 1.4, 2.4),
        ],
        start: "attractor = \"torus\"\nsamples = 8",
        branch: "free = \"F\"\nrange = [0.01, 1.0]\nmax-points = 40",
        bounded: false,
    },
    Problem {
        name: "two van der Pol oscillators",
        model: r#"
[parameters]
w = 1.3
mu = 0.3
c = 0.1
[states]
x = { equation = "u", range = [-3, 3] }
u = { equation = "mu*(1 - x^2)*u - x + c*(y - x)", range = [-3, 3] }
y = { equation = "v", range = [-3, 3] }
v = { equation = "mu*(1 - y^2)*v - w^2*y + c*(x - y)", range = [-3, 3] }
"#,
        draws: &[Draw::Logarithmic("mu", 0.05, 0.6), Draw::Uniform("c", 0.02, 0.2), Draw::Uniform("w", 1.3, 2.6)],
        start: "attractor = \"torus\"\nsamples = 8",
        branch: "free = \"w\"\nrange = [1.2, 2.8]\nmax-points = 30",
        bounded: false,
    },
    Problem {
        name: "rotor with internal damping, unbalance and weight",
        model: include_str!("../../../models/laval-rotor.toml"),
        draws: &[Draw::Uniform("eta", 1.75, 2.2)],
        start: "attractor = \"torus\"\nsamples = 8",
        branch: "free = \"eta\"\nrange = [1.6, 2.6]\nmax-points = 40",
        bounded: false,
    },
    Problem {
        name: "Langford",
        model: include_str!("../../../models/langford.toml"),
        draws: &[Draw::Uniform("rho", 0.66, 0.8)],
        start: "attractor = \"cycle\"\nsamples = 8",
        branch: "free = \"rho\"\nrange = [0.45, 0.85]\nswitch = { torus = 1 }\nmax-points = 30",
        bounded: false,
    },
];

/// Counts, and what differs from simulation.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Number of cases.
    pub cases: usize,
    /// Number of cases without a torus.
    pub without: usize,
    /// Number of points of the branches of tori.
    pub points: usize,
    /// Number of points that were verified.
    pub verified: usize,
    /// Number of points that were simulated from beside them.
    pub simulated: usize,
    /// Number of comparisons of [`foldline::verify`].
    pub checks: usize,
    /// Simulations whose motion was not decided, with the reason.
    pub undecided: Vec<String>,
    /// Rotation numbers, distances and multipliers outside their stated errors.
    pub wrong: Vec<String>,
    /// Tori at which simulation shows another motion, such as a locked cycle.
    pub other: Vec<String>,
}

impl Report {
    /// Adds another report.
    pub fn add(&mut self, mut other: Report) {
        self.cases += other.cases;
        self.without += other.without;
        self.points += other.points;
        self.verified += other.verified;
        self.simulated += other.simulated;
        self.checks += other.checks;
        self.undecided.append(&mut other.undecided);
        self.wrong.append(&mut other.wrong);
        self.other.append(&mut other.other);
    }

    /// True if no torus differs from simulation.
    pub fn good(&self) -> bool {
        self.wrong.is_empty() && self.other.is_empty()
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "{} cases, {} without a torus, {} tori", self.cases, self.without, self.points)?;
        writeln!(
            f,
            "{} verified: {} comparisons, {} outside the stated error",
            self.verified,
            self.checks,
            self.wrong.len()
        )?;
        writeln!(
            f,
            "{} simulated from beside them: {} locked or of another type, {} undecided",
            self.simulated,
            self.other.len(),
            self.undecided.len()
        )
    }
}

/// Name and study of the case with a number; consecutive numbers cycle through the problems.
pub fn case(number: usize) -> (String, Study) {
    let problem = &PROBLEMS[number % PROBLEMS.len()];
    let mut random = Random::new(770_000 + number as u64);
    let values: Vec<(&str, f64)> = problem.draws.iter().map(|draw| draw.value(&mut random)).collect();
    let parameters: Vec<String> = values.iter().map(|(name, value)| format!("{name} = {value:?}")).collect();
    let shown: Vec<String> = values.iter().map(|(name, value)| format!("{name} {value:.4}")).collect();
    let seed = format!("{}\nparameters = {{ {} }}", problem.start, parameters.join(", "));
    let name = format!("torus {number}, {} ({})", problem.name, shown.join(", "));
    (name, study(problem.model, &seed, problem.branch))
}

/// Follows the tori of a case and compares them with simulation.
pub fn examine(number: usize) -> Report {
    let (name, study) = case(number);
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Watch::start(LIMIT));
    let mut report = Report { cases: 1, ..Report::default() };
    let branches: Vec<_> = diagram.branches.iter().filter(|branch| branch.family == Family::Torus).collect();
    report.points = branches.iter().map(|branch| branch.points.len()).sum();
    if report.points == 0 {
        report.without = 1;
        return report;
    }
    let found = verify(&system, &diagram, TOLERANCE, Some(VERIFIED), &|branch| branch.family == Family::Torus);
    (report.verified, report.checks) = (found.points, found.checks.len());
    let line = |check: &foldline::verify::Check| {
        let (quantity, stated) = (check.quantity.name(), check.stated.unwrap_or(f64::NAN));
        format!("{name} at {}: {quantity} off by {:.2e}, stated {stated:.2e}", check.parameter, check.found)
    };
    report.wrong = found.wrong().filter(|check| check.quantity != Quantity::Record).map(line).collect();
    for branch in branches {
        // Where the branch joins a cycle, the torus has no extent.
        let joins = |k: usize| {
            let ends = [(0, &branch.ends[0]), (branch.points.len() - 1, &branch.ends[1])];
            ends.iter().any(|(end, why)| *end == k && matches!(why, Some(Ending::Joined { .. })))
        };
        let inside = branch.points.iter().enumerate().filter(|(k, point)| point.unstable == 0 && !joins(*k));
        let stable: Vec<_> = inside.map(|(_, point)| point).collect();
        let wanted = SIMULATED.min(stable.len());
        for point in (0..wanted).map(|i| stable[(2 * i + 1) * stable.len() / (2 * wanted)]) {
            let Solution::Torus(torus) = &point.solution else { continue };
            let start: Vec<f64> = torus.state(0.3, 0.0).iter().zip(&system.scales).map(|(x, s)| x + OFF * s).collect();
            let trial =
                Trial { field: system.field, scales: &system.scales, whirl: None, jobs: 1, limits: Limits::patient() };
            let value = point.parameters[branch.free];
            let sweep =
                stepped_sweep(&trial, &point.parameters, branch.free, &[value], &start, &mut |_, _| None, &|_| {
                    Verdict::Continue
                });
            let Some(seen) = sweep.into_iter().next() else { continue };
            report.simulated += 1;
            let place = format!("{name} at {value}, rotation number {}", torus.rotation);
            match seen.motion {
                // Without forcing the simulation counts turns per period of its strongest line, which is another choice of the
                // two frequencies; trajectories that start on the torus are compared above.
                Motion::Torus if torus.forcing_periods == 0 => {}
                Motion::Torus => {
                    let Some([own, error]) = seen.recognition.rotation else { continue };
                    let off = [1.0, -1.0]
                        .map(|sign| (sign * own - torus.rotation - (sign * own - torus.rotation).round()).abs());
                    let off = off[0].min(off[1]);
                    let stated = 3.0 * error + point.trust.discretisation * (1.0 + torus.rotation.abs());
                    if off.is_nan() || off > stated {
                        report
                            .wrong
                            .push(format!("{place}: {own} in simulation, off by {off:.1e}, stated {stated:.1e}"));
                    }
                }
                Motion::Other => report.undecided.push(format!("{place}: {}", seen.recognition.reason)),
                Motion::Cycle => {
                    let turns = seen.period.unwrap_or(f64::NAN) / torus.period;
                    report.other.push(format!("{place}: a cycle of {turns:.6} periods"));
                }
                motion => report.other.push(format!("{place}: {}", motion.name())),
            }
        }
    }
    report
}
