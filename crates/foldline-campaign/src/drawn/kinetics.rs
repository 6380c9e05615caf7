//! Chemical kinetics: stirred tanks and oscillators.

use super::Draw::{Logarithmic, Uniform};
use super::Problem;

pub const PROBLEMS: &[Problem] = &[
    // Hopf point at B = 1 + A^2.
    Problem {
        name: "Brusselator",
        model: r#"
[parameters]
A = 1
B = 1
[states]
x = { equation = "A - (B + 1)*x + x^2*y", range = [0, 4] }
y = { equation = "B*x - x^2*y", range = [0, 6] }
"#,
        draws: &[Uniform("A", 0.5, 2.0), Uniform("B", 0.5, 1.1)],
        start: "state = { x = {A}, y = 1 }",
        branch: "free = \"B\"\nrange = [0.3, 8]\nswitch = { hopf = 1 }",
        bounded: true,
    },
    // Exothermic first-order reaction: heat of reaction B, cooling beta, activation energy g.
    Problem {
        name: "stirred tank",
        model: r#"
[parameters]
Da = 0.01
B = 14
beta = 2
g = 20
[definitions]
k = "Da*(1 - x)*exp(y/(1 + y/g))"
[states]
x = { equation = "-x + k", range = [0, 1] }
y = { equation = "-y + B*k - beta*y", range = [0, 12], scale = 4 }
"#,
        draws: &[
            Uniform("B", 8.0, 22.0),
            Uniform("beta", 0.5, 3.5),
            Logarithmic("g", 20.0, 1000.0),
            Uniform("Da", 0.005, 0.02),
        ],
        start: "state = { x = 0, y = 0 }",
        branch: "free = \"Da\"\nrange = [0.001, 0.6]\nswitch = { hopf = 1 }",
        bounded: false,
    },
    // Two-variable form; small q and eps make the cycles stiff.
    Problem {
        name: "Oregonator",
        model: r#"
[parameters]
f = 0.4
q = 0.002
eps = 0.05
[states]
x = { equation = "(x*(1 - x) - f*z*(x - q)/(x + q))/eps", range = [0.01, 1] }
z = { equation = "x - z", range = [0, 0.5] }
"#,
        draws: &[Logarithmic("q", 8e-4, 1e-2), Logarithmic("eps", 0.02, 0.3), Uniform("f", 0.3, 0.45)],
        start: "state = { x = 0.65, z = 0.65 }",
        branch: "free = \"f\"\nrange = [0.25, 3]\nswitch = { hopf = 1 }",
        bounded: true,
    },
    // The non-trivial equilibria form an isola in the feed rate.
    Problem {
        name: "Gray-Scott",
        model: r#"
[parameters]
F = 0.03
k = 0.05
[states]
u = { equation = "-u*v^2 + F*(1 - u)", range = [0, 1] }
v = { equation = "u*v^2 - (F + k)*v", range = [0, 0.5] }
"#,
        draws: &[Uniform("k", 0.02, 0.054), Uniform("F", 0.028, 0.033)],
        start: "state = { u = 0.3, v = 0.27 }",
        branch: "free = \"F\"\nrange = [1e-4, 0.3]\nswitch = { hopf = 1 }",
        bounded: false,
    },
    // Below ku = 1/8 one family of cycles connects two Hopf points; it is stiff for small ku.
    Problem {
        name: "autocatalator",
        model: r#"
[parameters]
mu = 0.02
ku = 0.02
[states]
a = { equation = "mu - ku*a - a*b^2", range = [0, 5] }
b = { equation = "ku*a + a*b^2 - b", range = [0, 3] }
"#,
        draws: &[Logarithmic("ku", 0.003, 0.12), Uniform("mu", 0.02, 0.06)],
        start: "state = { a = 1, b = {mu} }",
        branch: "free = \"mu\"\nrange = [0.01, 1.5]\nswitch = { hopf = 1 }",
        bounded: true,
    },
    // Glycolysis: for a < 1/8 one family of cycles connects two Hopf points.
    Problem {
        name: "Selkov",
        model: r#"
[parameters]
a = 0.08
b = 0.1
[states]
x = { equation = "-x + a*y + x^2*y", range = [0, 3] }
y = { equation = "b - a*y - x^2*y", range = [0, 5] }
"#,
        draws: &[Uniform("a", 0.02, 0.15), Uniform("b", 0.05, 0.15)],
        start: "state = { x = {b}, y = 1 }",
        branch: "free = \"b\"\nrange = [0.01, 2]\nswitch = { hopf = 1 }",
        bounded: true,
    },
];
