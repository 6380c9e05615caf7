//! Problems of the campaign.

use crate::TOLERANCE;
use crate::random::Random;
use foldline::model::Model;
use foldline_store::study_file::{Study, parse_study};

/// Source of the first solutions of a case.
#[derive(Clone, Debug)]
pub enum First {
    /// All branches found by a plan with one branch, including those reached by branch switching.
    Planned,
    /// Attractors found by sampling initial conditions, then continued to another value of one parameter.
    Sampled {
        /// Values of all parameters `[k]` at which samples are taken.
        parameters: Vec<f64>,
        /// Index of the parameter that is changed afterwards, and its final value.
        to: (usize, f64),
        /// Seed of the random numbers.
        random: u64,
    },
}

/// Problem of the campaign.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name in the report.
    pub name: String,
    /// Study: model, range, branch switching.
    pub study: Study,
    /// Source of the first solutions.
    pub first: First,
    /// Relative tolerance.
    pub tolerance: f64,
    /// True if no cycle of the model can approach an equilibrium without shrinking to it. A period that seems to grow
    /// without bound is then an error: a canard explosion mistaken for a homoclinic orbit.
    pub bounded: bool,
}

impl Case {
    /// Returns the model.
    pub fn model(&self) -> &Model {
        &self.study.model
    }
}

/// Name, model text, and lines of the tables `seed` and `branch`. `{}` in the seed stands for a random value between
/// the two bounds.
struct Classical {
    name: &'static str,
    model: &'static str,
    seed: &'static str,
    between: [f64; 2],
    branch: &'static str,
}

const CLASSICAL: &[Classical] = &[
    Classical {
        name: "Lorenz equilibria",
        model: include_str!("../../../models/lorenz.toml"),
        seed: "state = { x = 0, y = 0, z = 0 }\nparameters = { rho = {} }",
        between: [0.2, 0.9],
        branch: "free = \"rho\"\nrange = [0, 40]\nswitch = { branch-point = 1, hopf = 1 }",
    },
    Classical {
        name: "Lorenz cycles",
        model: include_str!("../../../models/lorenz.toml"),
        seed: "attractor = \"cycle\"\nparameters = { rho = {} }",
        between: [235.0, 310.0],
        branch: "free = \"rho\"\nrange = [214, 320]\nswitch = { period-doubling = 2 }",
    },
    Classical {
        name: "cusp",
        model: include_str!("../../../models/cusp.toml"),
        seed: "state = { x = -1 }\nparameters = { mu = {} }",
        between: [-0.9, -0.5],
        branch: "free = \"mu\"\nrange = [-1, 1]",
    },
    Classical {
        name: "AB reaction",
        model: include_str!("../../../models/ab-reaction.toml"),
        seed: "state = { u1 = 0, u2 = 0 }\nparameters = { p1 = {} }",
        between: [0.0, 0.05],
        branch: "free = \"p1\"\nrange = [0, 0.3]\nswitch = { hopf = 1 }",
    },
    Classical {
        name: "predator and prey",
        model: include_str!("../../../models/predator-prey.toml"),
        seed: "state = { u = 1, v = 0 }\nparameters = { p1 = {} }",
        between: [0.0, 0.1],
        branch: "free = \"p1\"\nrange = [0, 1]\nswitch = { branch-point = 1, hopf = 1 }",
    },
    Classical {
        name: "FitzHugh-Nagumo",
        model: include_str!("../../../models/fitzhugh-nagumo.toml"),
        seed: "state = { x = 1, y = -0.5 }\nparameters = { a = {} }",
        between: [0.6, 1.2],
        branch: "free = \"a\"\nrange = [-1.5, 1.5]\nswitch = { hopf = 1 }",
    },
    Classical {
        name: "Lur'e",
        model: include_str!("../../../models/lure.toml"),
        seed: "state = { x = 0, y = 0, z = 0 }\nparameters = { alpha = {} }",
        between: [1.2, 1.6],
        branch: "free = \"alpha\"\nrange = [0.57, 1.7]\nswitch = { hopf = 1, period-doubling = 1 }",
    },
    Classical {
        name: "CO oxidation",
        model: include_str!("../../../models/co-oxidation.toml"),
        seed: "state = { x = 0.002, y = 0.6, s = 0.3 }\nparameters = { q2 = {} }",
        between: [1.2, 1.5],
        branch: "free = \"q2\"\nrange = [0.5, 2]\nswitch = { hopf = 1 }",
    },
    Classical {
        name: "Brusselator",
        model: include_str!("../../../models/brusselator.toml"),
        seed: "state = { x = 1, y = 1 }\nparameters = { B = {} }",
        between: [1.0, 1.8],
        branch: "free = \"B\"\nrange = [0.5, 8]\nswitch = { hopf = 1 }",
    },
    Classical {
        name: "van der Pol",
        model: include_str!("../../../models/van-der-pol.toml"),
        seed: "attractor = \"cycle\"\nparameters = { mu = {} }",
        between: [0.5, 3.0],
        branch: "free = \"mu\"\nrange = [0.1, 30]",
    },
    Classical {
        name: "Stuart-Landau",
        model: include_str!("../../../models/stuart-landau.toml"),
        seed: "state = { x = 0, y = 0 }\nparameters = { growth = {} }",
        between: [-0.9, -0.2],
        branch: "free = \"growth\"\nrange = [-1, 2]\nswitch = { hopf = 1 }",
    },
];

/// Returns the classical problems, each with `starts` different starts.
pub fn classical(starts: usize) -> Vec<Case> {
    let each = |k: usize| {
        CLASSICAL.iter().enumerate().map(move |(i, problem)| {
            let value = Random::new((1000 * i + k) as u64).uniform(problem.between[0], problem.between[1]);
            let seed = problem.seed.replace("{}", &format!("{value:?}"));
            let study = study(problem.model, &seed, problem.branch);
            Case {
                name: format!("{} from {value:.4}", problem.name),
                study,
                first: First::Planned,
                tolerance: TOLERANCE,
                bounded: false,
            }
        })
    };
    (0..starts).flat_map(each).collect()
}

/// Returns a study with one branch, "b".
///
/// # Panics
/// If the texts, which are part of this program, are not a valid study.
pub fn study(model: &str, seed: &str, branch: &str) -> Study {
    let text = format!(
        "model = \"m\"\ntolerance = {TOLERANCE}\n[[seed]]\nname = \"s\"\n{seed}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n{branch}\n"
    );
    parse_study(&text, "study", model, "model").unwrap_or_else(|found| panic!("{text}\n{found:?}"))
}
