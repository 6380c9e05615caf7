//! Population dynamics.

use super::Draw::{Logarithmic, Uniform};
use super::Problem;

pub const PROBLEMS: &[Problem] = &[
    // Prey alone, coexistence, cycles: the paradox of enrichment. Minima decrease exponentially with the capacity.
    Problem {
        name: "Rosenzweig-MacArthur",
        model: r#"
[parameters]
K = 0.3
e = 1
d = 0.4
r = 1
[states]
x = { equation = "r*x*(1 - x/K) - x*y/(1 + x)", range = [0, 4] }
y = { equation = "y*(e*x/(1 + x) - d)", range = [0, 4] }
"#,
        draws: &[Uniform("e", 0.7, 1.2), Uniform("d", 0.2, 0.5), Uniform("r", 0.5, 2.0), Uniform("K", 0.15, 0.22)],
        start: "state = { x = {K}, y = 0 }",
        branch: "free = \"K\"\nrange = [0.1, 6]\nswitch = { branch-point = 1, hopf = 1 }",
        bounded: false,
    },
    // alpha is the saturation, delta the competition among predators.
    Problem {
        name: "Bazykin",
        model: r#"
[parameters]
alpha = 0.1
eps = 0.01
gamma = 1
delta = 0.2
[states]
x = { equation = "x - x*y/(1 + alpha*x) - eps*x^2", range = [0, 10] }
y = { equation = "-gamma*y + x*y/(1 + alpha*x) - delta*y^2", range = [0, 5] }
"#,
        draws: &[
            Logarithmic("eps", 0.005, 0.05),
            Uniform("gamma", 0.7, 1.3),
            Uniform("delta", 0.05, 0.5),
            Uniform("alpha", 0.05, 0.1),
        ],
        start: "state = { x = {gamma}, y = 1 }",
        branch: "free = \"alpha\"\nrange = [0.02, 1.2]\nswitch = { hopf = 1, branch-point = 1 }",
        bounded: false,
    },
    // Food chain with three levels, the top one much slower.
    Problem {
        name: "food chain",
        model: r#"
[parameters]
b1 = 2
a1 = 5
a2 = 0.1
b2 = 2
d1 = 0.4
d2 = 0.01
[states]
x = { equation = "x*(1 - x) - a1*x*y/(1 + b1*x)", range = [0, 1] }
y = { equation = "a1*x*y/(1 + b1*x) - a2*y*z/(1 + b2*y) - d1*y", range = [0, 0.5] }
z = { equation = "a2*y*z/(1 + b2*y) - d2*z", range = [5, 15], scale = 10 }
"#,
        draws: &[
            Uniform("a1", 4.5, 5.5),
            Uniform("b2", 1.8, 2.2),
            Uniform("d1", 0.35, 0.45),
            Uniform("d2", 0.008, 0.012),
            Uniform("b1", 1.6, 1.9),
        ],
        start: "state = { x = 0.72, y = 0.125, z = 13 }",
        branch: "free = \"b1\"\nrange = [1.2, 3]\nswitch = { hopf = 1 }\nmax-points = 1500",
        bounded: false,
    },
];
