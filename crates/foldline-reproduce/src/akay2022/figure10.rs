//! Figures 10 and 11: next to no damping.

use super::rotor::{FAMILIES, MAX_R, colour, max_r, over_speed, smallest};
use crate::claims::{Claim, Finding, digits};
use crate::publication::{FigurePlan, Made};
use crate::runs::{Run, Runs};
use foldline_plot::{Axis, Figure, Layer, Panel};

pub const CUBIC: FigurePlan =
    FigurePlan { name: "10", title: "ζ = 1e-5, cubic", runs: &["light-damping"], make: cubic };
pub const CONTACT: FigurePlan =
    FigurePlan { name: "11", title: "ζ = 1e-5, contact", runs: &["light-damping"], make: contact };

fn cubic(runs: &Runs) -> Result<Made, String> {
    let run = runs.run("light-damping")?;
    let zoom = [2.0, 5.0, 0.3, 2.0];
    let figure = diagrams(run, "cubic", "Cubic spring, ζ = 1e-5", [0.5, 15.0, 0.0, 20.0], zoom);
    let mut claims = Vec::new();
    for family in ["SL", "DL"] {
        let finding = lowest(run, &format!("cubic {family}"), |r| r < 1.0, Finding::fact);
        claims.push(Claim::decided("10", format!("{family} reaches down below the contact radius"), "yes", finding));
    }
    Ok(Made {
        figure,
        caption: "S, SL and DL without contact, whole and where the cycles are smallest.".into(),
        claims,
    })
}

fn contact(runs: &Runs) -> Result<Made, String> {
    let run = runs.run("light-damping")?;
    let zoom = [2.0, 4.2, 0.9, 1.5];
    let figure = diagrams(run, "contact", "Contact, ζ = 1e-5", [0.5, 15.0, 0.0, 20.0], zoom);
    let mut claims = Vec::new();
    for family in ["SL", "DL"] {
        let width = run.branch(&format!("contact {family}")).map_or(0.0, |b| 1.0 / b.points[0].parameters[6]);
        let near = move |r: f64| (r - 1.0).abs() < width;
        let finding = lowest(run, &format!("contact {family}"), near, Finding::qualified);
        let claim = Claim::decided(
            "11",
            format!("{family} reaches down to just above the contact radius"),
            "just above 1",
            finding,
        );
        claims.push(claim.noting("Where it is below 1, the smoothed law pulls there, over a width of about 1/K"));
    }
    Ok(Made { figure, caption: "S, SL and DL with contact, whole and where the cycles are smallest.".into(), claims })
}

/// The whole diagram of one law and a part of it, `[x0, x1, y0, y1]`.
pub fn diagrams(run: &Run, law: &str, title: &str, whole: [f64; 4], part: [f64; 4]) -> Figure {
    let panel = |label: &str, text: &str, [x0, x1, y0, y1]: [f64; 4]| {
        let axes = (Axis::new("Ω").from(x0, x1), Axis::new("max r").from(y0, y1));
        let mut layers = Vec::new();
        for (family, _) in FAMILIES {
            if let Ok(branch) = run.branch(&format!("{law} {family}")) {
                layers.extend(over_speed(branch, family, MAX_R));
            }
        }
        layers.sort_by_key(|layer| matches!(layer.shape, foldline_plot::figure::Shape::Scatter { .. }));
        let note = Layer::note([x1 - 0.02 * (x1 - x0), 1.0], "contact").coloured(colour("S"));
        let panel = Panel { height: 380.0, ..Panel::new(label, text, axes.0, axes.1) }
            .with_all(layers)
            .with(Layer::horizontal(1.0));
        if label == "(b)" && law == "contact" { panel.with(note) } else { panel }
    };
    let first = panel("(a)", law, whole).zooming(part, "(b)");
    Figure::grid(title, 2, vec![first, panel("(b)", "the smallest cycles", part)])
}

fn lowest(
    run: &Run,
    name: &str,
    holds: impl Fn(f64) -> bool,
    finding: fn(bool, String) -> Finding,
) -> Result<Finding, String> {
    let [r, omega] = smallest(run.branch(name)?, max_r);
    let error = 1e-5;
    Ok(finding(holds(r), format!("max r = {} at Ω = {omega:.5}", digits(r, error))).within(error))
}
