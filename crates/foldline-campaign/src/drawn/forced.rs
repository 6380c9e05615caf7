//! Forced oscillators with one degree of freedom. zeta is the damping ratio.

use super::Draw::{Logarithmic, Uniform};
use super::Problem;

pub const PROBLEMS: &[Problem] = &[
    Problem {
        name: "Duffing, hardening",
        model: r#"
[parameters]
w = 2.8
zeta = 0.02
F = 0.2
[forcing]
frequency = "w"
[states]
x = { equation = "v", range = [-2, 2] }
v = { equation = "F*cos(w*t) - 2*zeta*v - x - x^3", range = [-2, 2] }
"#,
        draws: &[Logarithmic("zeta", 0.01, 0.1), Logarithmic("F", 0.03, 1.0), Uniform("w", 2.5, 2.9)],
        start: "state = { x = 0, v = 0 }",
        branch: "free = \"w\"\nrange = [0.3, 3]\nswitch = { branch-point = 1, period-doubling = 1 }\nmax-points = 1500",
        bounded: false,
    },
    Problem {
        name: "Duffing, softening",
        model: r#"
[parameters]
w = 1.4
zeta = 0.02
F = 0.05
[forcing]
frequency = "w"
[states]
x = { equation = "v", range = [-1, 1] }
v = { equation = "F*cos(w*t) - 2*zeta*v - x + x^3", range = [-1, 1] }
"#,
        draws: &[Logarithmic("zeta", 0.01, 0.1), Logarithmic("F", 0.01, 0.2), Uniform("w", 1.3, 1.5)],
        start: "state = { x = 0, v = 0 }",
        branch: "free = \"w\"\nrange = [0.4, 1.6]\nswitch = { branch-point = 1, period-doubling = 1 }\nmax-points = 1500",
        bounded: false,
    },
    // Double well, started in one of the wells.
    Problem {
        name: "Duffing, two wells",
        model: r#"
[parameters]
w = 2.2
zeta = 0.05
F = 0.1
[forcing]
frequency = "w"
[states]
x = { equation = "v", range = [-2, 2] }
v = { equation = "F*cos(w*t) - 2*zeta*v + x - x^3", range = [-2, 2] }
"#,
        draws: &[Logarithmic("zeta", 0.02, 0.15), Logarithmic("F", 0.03, 0.4), Uniform("w", 2.1, 2.5)],
        start: "state = { x = 1, v = 0 }",
        branch: "free = \"w\"\nrange = [0.6, 2.6]\nswitch = { period-doubling = 1 }\nmax-points = 1500",
        bounded: false,
    },
    // Potential well with escape on one side.
    Problem {
        name: "Helmholtz",
        model: r#"
[parameters]
w = 1.3
zeta = 0.05
F = 0.05
[forcing]
frequency = "w"
[states]
x = { equation = "v", range = [-0.5, 0.5] }
v = { equation = "F*cos(w*t) - 2*zeta*v - x + x^2", range = [-0.5, 0.5] }
"#,
        draws: &[Logarithmic("zeta", 0.01, 0.1), Logarithmic("F", 0.01, 0.12), Uniform("w", 1.3, 1.5)],
        start: "state = { x = 0, v = 0 }",
        branch: "free = \"w\"\nrange = [0.4, 1.6]\nswitch = { period-doubling = 1 }\nmax-points = 1500",
        bounded: false,
    },
    // The rest state is unstable between two period doublings, because p > 4 zeta in the whole range.
    Problem {
        name: "parametric excitation",
        model: r#"
[parameters]
w = 1.5
zeta = 0.02
p = 0.3
k = 0.5
[forcing]
frequency = "w"
[states]
x = { equation = "v", range = [-1, 1] }
v = { equation = "-2*zeta*v - (1 + p*cos(w*t))*x - k*x^3", range = [-1, 1] }
"#,
        draws: &[
            Logarithmic("zeta", 0.005, 0.04),
            Uniform("p", 0.2, 0.7),
            Uniform("k", 0.1, 2.0),
            Uniform("w", 1.3, 1.5),
        ],
        start: "state = { x = 0, v = 0 }",
        branch: "free = \"w\"\nrange = [1.2, 2.8]\nswitch = { period-doubling = 1 }\nmax-points = 1500",
        bounded: false,
    },
    // Entrained by the forcing at the start; entrainment is lost at torus points and folds.
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
        draws: &[Logarithmic("mu", 0.1, 3.0), Uniform("F", 0.4, 3.0), Uniform("w", 0.95, 1.0)],
        start: "attractor = \"cycle\"",
        branch: "free = \"w\"\nrange = [0.5, 1.8]\nswitch = { period-doubling = 1 }\nmax-points = 1500",
        bounded: false,
    },
    // Pendulum to third order, with a static load that breaks the symmetry and a pulsating support.
    Problem {
        name: "pendulum to third order",
        model: r#"
[parameters]
w = 1.4
zeta = 0.05
F = 0.1
G = 0.1
p = 0.1
[forcing]
frequency = "w"
[states]
x = { equation = "v", range = [-1, 1] }
v = { equation = "G + F*cos(w*t) - 2*zeta*v - (1 + p*sin(w*t))*(x - x^3/6)", range = [-1, 1] }
"#,
        draws: &[
            Logarithmic("zeta", 0.01, 0.1),
            Logarithmic("F", 0.02, 0.3),
            Uniform("G", 0.02, 0.3),
            Uniform("p", 0.0, 0.3),
            Uniform("w", 1.3, 1.5),
        ],
        start: "state = { x = {G}, v = 0 }",
        branch: "free = \"w\"\nrange = [0.4, 1.6]\nswitch = { period-doubling = 1 }\nmax-points = 1500",
        bounded: false,
    },
];
