//! Excitable membranes and neural populations.

use super::Draw::{Logarithmic, Uniform};
use super::Problem;

pub const PROBLEMS: &[Problem] = &[
    // Time scales separated by a factor of up to 50: canard explosions next to the Hopf points.
    Problem {
        name: "FitzHugh-Nagumo in the current",
        model: r#"
[parameters]
I = -0.3
a = 0.7
b = 0.8
eps = 0.08
[states]
v = { equation = "v - v^3/3 - w + I", range = [-2, 2] }
w = { equation = "eps*(v + a - b*w)", range = [-1, 2] }
"#,
        draws: &[
            Uniform("a", 0.6, 0.8),
            Uniform("b", 0.4, 0.9),
            Logarithmic("eps", 0.02, 0.2),
            Uniform("I", -0.4, -0.1),
        ],
        start: "state = { v = -1.2, w = -0.6 }",
        branch: "free = \"I\"\nrange = [-0.5, 2.5]\nswitch = { hopf = 1 }",
        bounded: true,
    },
    // Millivolts and microamperes. V3 and phi determine the class of excitability.
    Problem {
        name: "Morris-Lecar",
        model: r#"
[parameters]
I = 0
gCa = 4.4
V3 = 2
V4 = 30
phi = 0.04
[definitions]
m = "0.5*(1 + tanh((V + 1.2)/18))"
n = "0.5*(1 + tanh((V - V3)/V4))"
[states]
V = { equation = "(I - gCa*m*(V - 120) - 8*w*(V + 84) - 2*(V + 60))/20", range = [-80, 60], scale = 20 }
w = { equation = "phi*(n - w)*cosh((V - V3)/(2*V4))", range = [0, 1] }
"#,
        draws: &[
            Uniform("gCa", 4.0, 4.5),
            Uniform("V3", 2.0, 12.0),
            Uniform("V4", 17.4, 30.0),
            Logarithmic("phi", 0.02, 0.25),
            Uniform("I", -10.0, 20.0),
        ],
        start: "state = { V = -60, w = 0.01 }",
        branch: "free = \"I\"\nrange = [-20, 300]\nswitch = { hopf = 1 }",
        bounded: false,
    },
    // r is the ratio of the time scales.
    Problem {
        name: "Hindmarsh-Rose",
        model: r#"
[parameters]
I = 0.5
r = 0.01
s = 4
x0 = -1.6
[states]
x = { equation = "y - x^3 + 3*x^2 - z + I", range = [-2, 2] }
y = { equation = "1 - 5*x^2 - y", range = [-10, 2] }
z = { equation = "r*(s*(x - x0) - z)", range = [0, 4] }
"#,
        draws: &[
            Logarithmic("r", 0.005, 0.1),
            Uniform("s", 2.0, 5.0),
            Uniform("x0", -1.7, -1.4),
            Uniform("I", 0.0, 0.8),
        ],
        start: "state = { x = -1.4, y = -9, z = 0.5 }",
        branch: "free = \"I\"\nrange = [-1, 8]\nswitch = { hopf = 1 }\nmax-points = 1500",
        bounded: false,
    },
    // Excitatory and inhibitory populations, with unit refractory coefficients.
    Problem {
        name: "Wilson-Cowan",
        model: r#"
[parameters]
P = -1
c1 = 16
c2 = 12
c3 = 15
c4 = 3
tau = 1
[definitions]
SE = "1/(1 + exp(-1.3*(c1*E - c2*J + P - 4))) - 1/(1 + exp(5.2))"
SI = "1/(1 + exp(-2*(c3*E - c4*J - 3.7))) - 1/(1 + exp(7.4))"
[states]
E = { equation = "-E + (1 - E)*SE", range = [0, 1] }
J = { equation = "(-J + (1 - J)*SI)/tau", range = [0, 1] }
"#,
        draws: &[
            Uniform("c1", 12.0, 18.0),
            Uniform("c2", 6.0, 14.0),
            Uniform("c3", 8.0, 18.0),
            Uniform("c4", 1.0, 6.0),
            Logarithmic("tau", 0.5, 3.0),
            Uniform("P", -2.0, -1.0),
        ],
        start: "state = { E = 0, J = 0 }",
        branch: "free = \"P\"\nrange = [-2.5, 8]\nswitch = { hopf = 1 }",
        bounded: false,
    },
];
