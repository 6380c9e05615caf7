//! Figures 10 and 11: almost no damping.

use super::figure04::chosen;
use super::rotor::{FAMILIES, MAX_R, least_radius, over_speed};
use crate::claims::{Claim, Finding, digits};
use crate::publication::{FigurePlan, Made};
use crate::runs::{Run, Runs};
use foldline_plot::figure::Shape;
use foldline_plot::{Axis, Figure, Layer, Panel};

pub const CUBIC: FigurePlan =
    FigurePlan { name: "10", title: "ζ = 10⁻⁵, cubic", runs: &["light-damping-cubic"], make: cubic };
pub const CONTACT: FigurePlan = FigurePlan {
    name: "11",
    title: "ζ = 10⁻⁵, contact",
    runs: &["light-damping-contact", "flows-light-damping"],
    make: contact,
};

fn cubic(runs: &Runs) -> Result<Made, String> {
    let run = runs.run("light-damping-cubic")?;
    let parts = [("the smallest cycles", [2.0, 5.0, 0.3, 2.0])];
    let figure = diagrams(run, "cubic", "Cubic spring, ζ = 10⁻⁵", [0.5, 15.0, 0.0, 20.0], &parts);
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
    let run = runs.run("light-damping-contact")?;
    let parts =
        [("the smallest double loops", [2.1, 4.0, 0.95, 1.5]), ("the smallest single loops", [3.2, 4.2, 0.97, 1.2])];
    let figure = diagrams(run, "contact", "Contact, ζ = 10⁻⁵", [0.5, 15.0, 0.0, 20.0], &parts);
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
    let flows = runs.run("flows-light-damping")?;
    claims.extend(["SL", "DL"].map(|family| chosen("11", flows, "light", family, run)));
    Ok(Made { figure, caption: "S, SL and DL with contact, whole and where the cycles are smallest.".into(), claims })
}

/// The whole diagram of one law and parts of it; windows are `[x0, x1, y0, y1]`.
pub fn diagrams(run: &Run, law: &str, title: &str, whole: [f64; 4], parts: &[(&str, [f64; 4])]) -> Figure {
    let labels = ["(b)", "(c)", "(d)"];
    let mut first = panel(run, law, "(a)", law, whole);
    first.span = if parts.len() == 1 { 1 } else { 2 };
    let mut panels = Vec::new();
    for ((text, window), label) in parts.iter().zip(labels) {
        first = first.zooming(*window, label);
        panels.push(panel(run, law, label, text, *window));
    }
    panels.insert(0, first);
    Figure::grid(title, 2, panels)
}

fn panel(run: &Run, law: &str, label: &str, text: &str, [x0, x1, y0, y1]: [f64; 4]) -> Panel {
    let axes = (Axis::new("Ω").from(x0, x1), Axis::new("max r").from(y0, y1));
    let mut layers = Vec::new();
    for (family, name) in FAMILIES.map(|(family, _)| (family, format!("{law} {family}"))) {
        for branch in
            ["", " resonant", " lower"].into_iter().filter_map(|part| run.branch(&format!("{name}{part}")).ok())
        {
            layers.extend(over_speed(branch, family, MAX_R));
        }
    }
    layers.sort_by_key(|layer| matches!(layer.shape, Shape::Scatter { .. }));
    Panel { height: 380.0, ..Panel::new(label, text, axes.0, axes.1) }.with_all(layers).with(Layer::horizontal(1.0))
}

fn lowest(
    run: &Run,
    name: &str,
    holds: impl Fn(f64) -> bool,
    finding: fn(bool, String) -> Finding,
) -> Result<Finding, String> {
    let sheets = [name.to_string(), format!("{name} lower")].into_iter().filter(|name| run.branch(name).is_ok());
    let lowest = sheets.map(|name| least_radius(run, &name)).collect::<Result<Vec<_>, _>>()?;
    let least = lowest.into_iter().min_by(|a, b| a[0].total_cmp(&b[0]));
    let [r, omega, error] = least.ok_or_else(|| format!("there is no branch {name}"))?;
    Ok(finding(holds(r), format!("max r = {} at Ω = {omega:.5}", digits(r, error))).within(error))
}
