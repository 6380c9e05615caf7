//! Figure 4: ways from the cubic to the contact rotor.

use super::rotor::{MAX_R, OMEGA, SPEED, max_r, parameters, speeds};
use crate::claims::{Claim, Finding};
use crate::publication::{FigurePlan, Made};
use crate::runs::{Run, Runs};
use foldline::diagram::Kind;
use foldline_plot::palette::{BLUE, GREEN, GREY, ORANGE, VERMILION};
use foldline_plot::{Axis, Figure, Layer, Marker, Panel, Quantity, branch_curve};

pub const PLAN: FigurePlan = FigurePlan {
    name: "4",
    title: "flows from cubic to contact stiffness",
    runs: &["flows", "lowest-part", "diagrams"],
    make,
};

const KAPPA: Quantity = Quantity::Parameter(1);

fn make(runs: &Runs) -> Result<Made, String> {
    let (flows, steps, sampled) = (runs.run("flows")?, runs.run("lowest-part")?, runs.run("diagrams")?);
    let figure = Figure::grid(
        "From cubic to contact stiffness",
        2,
        vec![
            over_kappa(flows)?,
            folds(steps),
            reached(flows, sampled, "(c)", "SL", [3.0, 11.0, 0.8, 11.0])?,
            reached(flows, sampled, "(d)", "DL", [2.5, 6.5, 1.0, 5.0])?,
        ],
    );
    let claims = ["SL", "DL"].map(|family| same(flows, sampled, family)).to_vec();
    Ok(Made {
        figure,
        caption: "Flow (a) runs κ to 1 at Ω = 5; flow (b) moves to another speed half-way. Both end on the contact branches that \
                  sampling finds. The fold of SL goes from that of the cubic to that of the contact rotor."
            .into(),
        claims,
    })
}

fn over_kappa(flows: &Run) -> Result<Panel, String> {
    let axes = (Axis::new("κ").from(-0.03, 1.03), Axis::new("max r"));
    let mut panel = Panel::new("(a)", "κ runs from cubic to contact", axes.0, axes.1);
    for (family, direct, aside) in [("SL", VERMILION, ORANGE), ("DL", GREEN, BLUE)] {
        let curve = |name: &str, colour| {
            Ok::<_, String>(branch_curve(flows.branch(&format!("{family} {name}"))?, KAPPA, MAX_R, colour))
        };
        panel = panel.with(curve("direct", direct)?.named(format!("{family}, flow (a)")));
        for name in ["half-way", "aside", "second half"] {
            panel = panel.with(curve(name, aside)?.wide(2.6).faint(0.6).named(format!("{family}, flow (b)")));
        }
    }
    Ok(panel)
}

/// The first fold of SL for each κ at which it was followed.
fn folds(steps: &Run) -> Panel {
    let first = |name: &str| {
        let folds = steps.special(name, Kind::Fold).ok()?;
        let first = folds.into_iter().min_by(|a, b| a.point.parameters[OMEGA].total_cmp(&b.point.parameters[OMEGA]))?;
        let [omega, kappa, ..] = parameters(&first.point);
        Some([kappa, omega])
    };
    let names = steps.study.plan.branches.iter().map(|b| b.name.clone()).filter(|name| name.starts_with("SL "));
    let places: Vec<[f64; 2]> = names.filter_map(|name| first(&name)).collect();
    let axes = (Axis::new("κ").from(-0.03, 1.03), Axis::new("Ω"));
    Panel::new("(b)", "the first fold of SL", axes.0, axes.1)
        .with(Layer::scatter(places, Marker::Circle, GREY).named("folds of runs in Ω"))
}

fn reached(flows: &Run, sampled: &Run, label: &str, family: &str, [x0, x1, y0, y1]: [f64; 4]) -> Result<Panel, String> {
    let axes = (Axis::new("Ω").from(x0, x1), Axis::new("max r").from(y0, y1));
    let mut panel = Panel::new(label, format!("contact {family}"), axes.0, axes.1);
    let colours = if family == "SL" { [VERMILION, ORANGE] } else { [GREEN, BLUE] };
    for (flow, colour, width) in [("b", colours[1], 3.4), ("a", colours[0], 1.4)] {
        let branch = flows.branch(&format!("{family} by flow {flow}"))?;
        panel = panel
            .with(branch_curve(branch, SPEED, MAX_R, colour).wide(width).named(format!("{family}, flow ({flow})")));
    }
    let points = &sampled.branch(&format!("contact {family}"))?.points;
    let places = points.iter().map(|p| [p.parameters[OMEGA], max_r(p)]).collect();
    Ok(panel.with(Layer::scatter(places, Marker::Dot, GREY).wide(2.0).named("sampled")))
}

/// Whether both flows and sampling end on one branch: it has the same special points.
fn same(flows: &Run, sampled: &Run, family: &str) -> Claim {
    let finding = || {
        let mut worst = [0.0_f64, 0.0];
        let mut count = 0;
        for flow in ["a", "b"] {
            for kind in [Kind::Fold, Kind::PeriodDoubling] {
                let ours = speeds(&flows.special(&format!("{family} by flow {flow}"), kind)?);
                let theirs = speeds(&sampled.special(&format!("contact {family}"), kind)?);
                if ours.len() != theirs.len() {
                    let ours = format!("{} and {} {kind} points", ours.len(), theirs.len());
                    return Ok(Finding::fact(false, ours));
                }
                for [at, error] in ours {
                    let apart = |other: &&[f64; 2]| (other[0] - at).abs();
                    let nearest = theirs.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
                    let Some(nearest) = nearest else { continue };
                    worst = [worst[0].max(apart(&nearest)), worst[1].max(error + nearest[1])];
                    count += 1;
                }
            }
        }
        let ours = format!("{count} special points agree within {:.0e}", worst[0]);
        Ok(Finding::fact(count > 0 && worst[0] <= worst[1], ours).within(worst[1]))
    };
    Claim::decided("4", format!("The flows reach the same contact {family}"), "yes", finding())
}
