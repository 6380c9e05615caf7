//! Figure 9: period-doubled branches of the contact rotor.

use super::rotor::{MAX_R, SPEED, colour, over_speed, speeds};
use crate::claims::{Claim, Finding, digits};
use crate::publication::{FigurePlan, Made};
use crate::runs::{Run, Runs};
use foldline::diagram::{Ending, Kind};
use foldline_plot::figure::Shape;
use foldline_plot::palette::{BLACK, PURPLE};
use foldline_plot::{Axis, Figure, Layer, Panel, branch_layers};

pub const PLAN: FigurePlan =
    FigurePlan { name: "9", title: "period-doubled branches with contact", runs: &["diagrams"], make };

fn make(runs: &Runs) -> Result<Made, String> {
    let run = runs.run("diagrams")?;
    let panels =
        vec![panel(run, "(a)", "SL", [3.2, 5.2], [0.97, 1.5])?, panel(run, "(b)", "DL", [2.55, 4.6], [1.2, 2.2])?];
    let mut claims = Vec::new();
    for family in ["SL", "DL"] {
        claims.extend(cascade(run, family));
    }
    Ok(Made {
        figure: Figure::grid("Contact: period doubling", 2, panels),
        caption: "The branches of twice and four times the period join the single ones at both ends; each loses its stability \
                  in a further period doubling."
            .into(),
        claims,
    })
}

fn panel(run: &Run, label: &str, family: &str, x: [f64; 2], y: [f64; 2]) -> Result<Panel, String> {
    let root = run.branch(&format!("contact {family}"))?;
    let axes = (Axis::new("Ω").from(x[0], x[1]), Axis::new("max r").from(y[0], y[1]));
    let mut layers = over_speed(root, family, MAX_R);
    for branch in run.diagram.branches.iter().filter(|b| b.name.starts_with(&format!("{}/", root.name))) {
        let depth = branch.name.matches('/').count();
        let (shade, name) = if depth == 1 { (PURPLE, "period 2") } else { (BLACK, "period 4") };
        let mut next = branch_layers(branch, SPEED, MAX_R, shade);
        if let Some(curve) = next.first_mut() {
            curve.name = Some(name.into());
            curve.width = 1.3;
        }
        layers.extend(next);
    }
    layers.sort_by_key(|layer| matches!(layer.shape, Shape::Scatter { .. }));
    debug_assert_eq!(colour(&root.name), layers[0].colour);
    Ok(Panel { height: 400.0, ..Panel::new(label, family, axes.0, axes.1) }
        .with_all(layers)
        .with(Layer::horizontal(1.0)))
}

fn cascade(run: &Run, family: &str) -> Vec<Claim> {
    let first = format!("contact {family}/period-doubling-1");
    let listed = |name: &str| {
        let found = speeds(&run.special(name, Kind::PeriodDoubling)?);
        let worst = found.iter().map(|s| s[1]).fold(0.0, f64::max);
        let list: Vec<String> = found.iter().map(|[at, error]| digits(*at, *error)).collect();
        Ok::<_, String>((found.len(), list.join(", "), worst))
    };
    let secondary = || {
        let (count, list, error) = listed(&first)?;
        Ok(Finding::qualified(count > 0, format!("Ω = {list}")).within(error))
    };
    let joined = || {
        let branch = run.branch(&first)?;
        let ends: Vec<f64> = branch
            .ends
            .iter()
            .flatten()
            .filter_map(|end| match end {
                Ending::Joined { at: Kind::PeriodDoubling, parameter } => Some(*parameter),
                _ => None,
            })
            .collect();
        let list: Vec<String> = ends.iter().map(|at| format!("{at:.6}")).collect();
        // The farther of the ends from the period doubling that it should be.
        let doublings = speeds(&run.special(&format!("contact {family}"), Kind::PeriodDoubling)?);
        let apart =
            |end: &f64| doublings.iter().map(|[at, error]| (at - end).abs() + error).fold(f64::INFINITY, f64::min);
        let error = ends.iter().map(apart).fold(0.0, f64::max);
        Ok(Finding::fact(ends.len() == 2, list.join(", ")).within(error))
    };
    vec![
        Claim::decided(
            "9",
            format!("The period-doubled branch of {family} leads from one period doubling to the other"),
            "yes",
            joined(),
        ),
        Claim::decided("9", format!("The period-doubled branch of {family} doubles again"), "yes", secondary()),
    ]
}
