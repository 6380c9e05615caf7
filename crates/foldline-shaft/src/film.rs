//! Squeeze-film dampers: the force of a short bearing without rotation.
//!
//! **Idea.** In a short bearing the pressure at an angle follows from the speed at which the gap closes there. A
//! journal with velocity v and eccentricity ε (relative to the clearance) closes the gap on the half circle around the
//! direction of v; on the other half the film cavitates. The force is therefore an integral over that half circle,
//! which has a closed form in the components of ε along and across v.
//!
//! **Equations.** With a = ε·v/|v|, b across, D = 1 - a² - b², A = µ R L³/c³,
//!
//! ```text
//!   (1)  F = -A ∫ (v·n) n / (1 - ε·n)³ dβ   over v·n > 0, or over the whole circle
//!   (2)  F = -A (I₁ v + I₂ v⊥),   S = π/2 + atan(a/√D), or π
//!   (3)  I₁ = S (1 + 2a² - b²) / D^{5/2} + 3a/D²
//!   (4)  I₂ = 3 a b S / D^{5/2} + b (2 - 2b² + a²) / ((1 - b²) D²)
//! ```
//!
//! Over the whole circle the second terms of (3) and (4) are absent. On a circle of radius ε c around the centre the
//! components are the well-known 2ε²/(1-ε²)² and πε/2(1-ε²)^{3/2}.
//!
//! **Source.** Reynolds' equation for short bearings, hamrock2004; the half circle around v is where the pressure is positive.
//!
//! **Fails when** the journal touches, ε ≥ 1: the force is then not defined. At rest, v/|v| is regularised at a
//! velocity of 1e-6 clearances per second.

use crate::parts::Film;

/// Definitions of the force for displacements and inertial velocities along two axes: eccentricity and both components.
pub(crate) fn definitions(
    own: &Film,
    [x, y]: [&str; 2],
    [vx, vy]: [&str; 2],
    axes: [&str; 2],
) -> Vec<(String, String)> {
    let name = |what: &str| format!("rotor_{}_{what}", own.name);
    let c = own.clearance.shown();
    let (e, s, a, b, d) = (name("eps"), name("s"), name("a"), name("b"), name("D"));
    let (angle, first, second) = (name("S"), name("along"), name("across"));
    let amount = format!("{}*{}*{}^3/{c}^3", own.viscosity.shown(), own.radius.shown(), own.length.shown());
    let half = own.half;
    let with = |text: String| if half { text } else { String::new() };
    vec![
        (s.clone(), format!("sqrt({vx}^2 + {vy}^2 + (1e-6*{c})^2)")),
        (e, format!("hypot({x}, {y})/{c}")),
        (a.clone(), format!("({x}*{vx} + {y}*{vy})/({s}*{c})")),
        (b.clone(), format!("({y}*{vx} - {x}*{vy})/({s}*{c})")),
        (d.clone(), format!("1 - ({x}^2 + {y}^2)/{c}^2")),
        (angle.clone(), if half { format!("pi/2 + atan({a}/sqrt({d}))") } else { "pi".into() }),
        (first.clone(), format!("{amount}*({angle}*(1 + 2*{a}^2 - {b}^2)/{d}^2.5{})", with(format!(" + 3*{a}/{d}^2")))),
        (
            second.clone(),
            format!(
                "{amount}*(3*{a}*{b}*{angle}/{d}^2.5{})",
                with(format!(" + {b}*(2 - 2*{b}^2 + {a}^2)/((1 - {b}^2)*{d}^2)"))
            ),
        ),
        (name(axes[0]), format!("-({first}*{vx} - {second}*{vy})")),
        (name(axes[1]), format!("-({first}*{vy} + {second}*{vx})")),
    ]
}
