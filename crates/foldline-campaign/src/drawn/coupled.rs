//! Coupled cells, some of them identical: symmetries and symmetry breaking.

use super::Draw::{Logarithmic, Uniform};
use super::Problem;

pub const PROBLEMS: &[Problem] = &[
    // Two tanks that exchange both species: in-phase and antiphase states, and states with one cell more active.
    Problem {
        name: "two Brusselators",
        model: r#"
[parameters]
A = 2
B = 1
D = 0.1
ratio = 5
[states]
x1 = { equation = "A - (B + 1)*x1 + x1^2*y1 + D*(x2 - x1)", range = [0, 5] }
y1 = { equation = "B*x1 - x1^2*y1 + ratio*D*(y2 - y1)", range = [0, 5] }
x2 = { equation = "A - (B + 1)*x2 + x2^2*y2 + D*(x1 - x2)", range = [0, 5] }
y2 = { equation = "B*x2 - x2^2*y2 + ratio*D*(y1 - y2)", range = [0, 5] }
"#,
        draws: &[Uniform("A", 1.0, 2.5), Logarithmic("D", 0.03, 1.0), Logarithmic("ratio", 1.0, 20.0)],
        start: "state = { x1 = {A}, y1 = 0.7, x2 = {A}, y2 = 0.7 }",
        branch: "free = \"B\"\nrange = [0.5, 8]\nswitch = { hopf = 1, branch-point = 1 }\nmax-points = 1500",
        bounded: false,
    },
    // Coupled through the voltage.
    Problem {
        name: "two FitzHugh-Nagumo cells",
        model: r#"
[parameters]
I = -0.3
a = 0.7
b = 0.8
eps = 0.1
g = 0.1
[states]
v1 = { equation = "v1 - v1^3/3 - w1 + I + g*(v2 - v1)", range = [-2, 2] }
w1 = { equation = "eps*(v1 + a - b*w1)", range = [-1, 2] }
v2 = { equation = "v2 - v2^3/3 - w2 + I + g*(v1 - v2)", range = [-2, 2] }
w2 = { equation = "eps*(v2 + a - b*w2)", range = [-1, 2] }
"#,
        draws: &[Uniform("b", 0.5, 0.85), Logarithmic("eps", 0.05, 0.3), Logarithmic("g", 0.01, 0.4)],
        start: "state = { v1 = -1.1, w1 = -0.5, v2 = -1.1, w2 = -0.5 }",
        branch: "free = \"I\"\nrange = [-0.5, 1.2]\nswitch = { hopf = 1 }\nmax-points = 1500",
        bounded: false,
    },
    // Coupled by a spring k and a damper c: in-phase cycles from mu = 0, antiphase cycles from mu = 2 c.
    Problem {
        name: "two van der Pol oscillators",
        model: r#"
[parameters]
mu = -0.4
k = 0.5
c = 0.1
[states]
x = { equation = "u", range = [-2, 2] }
u = { equation = "(mu - x^2)*u - x + k*(y - x) + c*(v - u)", range = [-2, 2] }
y = { equation = "v", range = [-2, 2] }
v = { equation = "(mu - y^2)*v - y + k*(x - y) + c*(u - v)", range = [-2, 2] }
"#,
        draws: &[Uniform("k", 0.1, 2.0), Uniform("c", 0.03, 0.5), Uniform("mu", -0.45, -0.2)],
        start: "state = { x = 0, u = 0, y = 0, v = 0 }",
        branch: "free = \"mu\"\nrange = [-0.5, 2]\nswitch = { hopf = 1 }\nmax-points = 1500",
        bounded: false,
    },
    // Three genes in a ring.
    Problem {
        name: "repressilator",
        model: r#"
[parameters]
alpha = 1
n = 2
beta = 1
leak = 0.01
[states]
m1 = { equation = "-m1 + alpha/(1 + p3^n) + leak", range = [0, 5] }
m2 = { equation = "-m2 + alpha/(1 + p1^n) + leak", range = [0, 5] }
m3 = { equation = "-m3 + alpha/(1 + p2^n) + leak", range = [0, 5] }
p1 = { equation = "beta*(m1 - p1)", range = [0, 5] }
p2 = { equation = "beta*(m2 - p2)", range = [0, 5] }
p3 = { equation = "beta*(m3 - p3)", range = [0, 5] }
"#,
        draws: &[
            Uniform("n", 2.0, 4.0),
            Logarithmic("beta", 0.2, 5.0),
            Logarithmic("leak", 1e-4, 0.1),
            Uniform("alpha", 0.5, 1.0),
        ],
        start: "state = { m1 = 0.6, m2 = 0.6, m3 = 0.6, p1 = 0.6, p2 = 0.6, p3 = 0.6 }",
        branch: "free = \"alpha\"\nrange = [0.2, 100]\nswitch = { hopf = 1 }\nmax-points = 1500",
        bounded: false,
    },
];
