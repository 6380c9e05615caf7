//! Figure 4: paths from the cubic to the contact rotor.

use super::rotor::{MAX_R, OMEGA, SPEED, max_r, parameters, speeds};
use crate::claims::{Claim, Finding, digits};
use crate::publication::{FigurePlan, Made};
use crate::runs::{Run, Runs};
use foldline::diagram::{Kind, Point};
use foldline_plot::palette::{AMBER, AZURE, BLUE, GREEN, GREY, VERMILION};
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
    let mut claims = Vec::new();
    for family in ["SL", "DL"] {
        claims.extend(["a", "b", "c"].map(|name| flow(name, flows, sampled, family)));
        claims.push(through(flows, sampled, family));
    }
    let figure = Figure::grid(
        "From cubic to contact stiffness",
        2,
        vec![
            over_kappa(flows)?,
            folds(flows, steps)?,
            reached(flows, sampled, "(c)", "SL", [3.0, 11.0, 0.8, 11.0])?,
            reached(flows, sampled, "(d)", "DL", [2.5, 6.5, 1.0, 5.0])?,
        ],
    );
    Ok(Made {
        figure,
        caption: "Flow (a) runs κ to 1 at Ω = 5; flow (b) moves to another speed half-way. Flow (c) \
                  follows the lower fold in Ω and κ. All end on the contact branches that sampling finds."
            .into(),
        claims,
    })
}

fn over_kappa(flows: &Run) -> Result<Panel, String> {
    let axes = (Axis::new("κ").from(-0.03, 1.03), Axis::new("max r"));
    let mut panel = Panel::new("(a)", "κ runs from cubic to contact", axes.0, axes.1);
    for (family, direct, aside) in [("SL", VERMILION, AMBER), ("DL", GREEN, BLUE)] {
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

/// Panel of the lower folds as curves in both parameters, with the fold of SL found by runs in Ω alone.
fn folds(flows: &Run, steps: &Run) -> Result<Panel, String> {
    let names = steps.study.plan.branches.iter().map(|b| b.name.clone()).filter(|name| name.starts_with("SL "));
    let places: Vec<[f64; 2]> = names.filter_map(|name| first_fold(steps, &name)).map(|[w, k, _]| [k, w]).collect();
    let axes = (Axis::new("κ").from(-0.03, 1.03), Axis::new("Ω"));
    let mut panel = Panel::new("(b)", "the lower folds, flow (c)", axes.0, axes.1);
    for (family, colour) in [("SL", VERMILION), ("DL", GREEN)] {
        let curve = flows.branch(&format!("{family} fold"))?;
        let places: Vec<[f64; 2]> = curve.points.iter().map(|p| [p.parameters[1], p.parameters[OMEGA]]).collect();
        panel = panel.with(Layer::curve(&places, colour).smooth().named(format!("fold of {family}, flow (c)")));
    }
    Ok(panel.with(Layer::scatter(places, Marker::Circle, GREY).hollow().named("folds of runs in Ω")))
}

/// Fold at the lowest Ω: Ω, κ and the error of Ω.
fn first_fold(run: &Run, branch: &str) -> Option<[f64; 3]> {
    let folds = run.special(branch, Kind::Fold).ok()?;
    let first = folds.into_iter().min_by(|a, b| a.point.parameters[OMEGA].total_cmp(&b.point.parameters[OMEGA]))?;
    let [_, kappa, ..] = parameters(&first.point);
    let [omega, error] = run.place(OMEGA, first);
    Some([omega, kappa, error])
}

/// Claim that the fold curve ends at the fold of the contact branch.
fn through(flows: &Run, sampled: &Run, family: &str) -> Claim {
    let finding = || {
        let curve = flows.branch(&format!("{family} fold"))?;
        let at_contact = |p: &&Point| (p.parameters[1] - 1.0).abs() < 1e-9;
        let end = curve.points.iter().find(at_contact).ok_or("the fold curve does not reach κ = 1")?;
        let [omega, _, error] =
            first_fold(sampled, &format!("contact {family}")).ok_or("the contact branch has no fold")?;
        let apart = (end.parameters[OMEGA] - omega).abs();
        Ok(Finding::vanishing(apart, 1e-6 + error)
            .noting(format!("Ω = {} on the curve", digits(end.parameters[OMEGA], 1e-7))))
    };
    Claim::decided(
        "4",
        format!("The fold of cubic {family}, followed in Ω and κ, becomes that of contact {family}"),
        "0 apart",
        finding(),
    )
}

fn reached(flows: &Run, sampled: &Run, label: &str, family: &str, [x0, x1, y0, y1]: [f64; 4]) -> Result<Panel, String> {
    let axes = (Axis::new("Ω").from(x0, x1), Axis::new("max r").from(y0, y1));
    let mut panel = Panel::new(label, format!("contact {family}"), axes.0, axes.1);
    let colours = if family == "SL" { [VERMILION, AMBER] } else { [GREEN, BLUE] };
    for (flow, colour, width) in [("b", colours[1], 4.2), ("c", AZURE, 2.6), ("a", colours[0], 1.2)] {
        let branch = flows.branch(&format!("{family} by flow {flow}"))?;
        panel = panel.with(branch_curve(branch, SPEED, MAX_R, colour).wide(width).named(if flow == "c" {
            "flow (c)".to_string()
        } else {
            format!("{family}, flow ({flow})")
        }));
    }
    let points = &sampled.branch(&format!("contact {family}"))?.points;
    let places = points.iter().map(|p| [p.parameters[OMEGA], max_r(p)]).collect();
    Ok(panel.with(Layer::scatter(places, Marker::Dot, GREY).wide(2.0).named("sampled")))
}

/// Finding that a flow ends on the branch of another run: it has the same special points.
fn same(flows: &Run, flow: &str, others: &Run, branch: &str) -> Result<Finding, String> {
    for branch in [flows.branch(flow)?, others.branch(branch)?] {
        if let Some(short) = branch.ends.iter().flatten().find(|end| !end.complete()) {
            return Err(format!("{} is incomplete: {short}", branch.name));
        }
    }
    let mut worst = [0.0_f64, 0.0];
    let mut count = 0;
    for kind in [Kind::Fold, Kind::PeriodDoubling] {
        let ours = speeds(flows, &flows.special(flow, kind)?);
        let theirs = speeds(others, &others.special(branch, kind)?);
        if ours.len() != theirs.len() {
            return Ok(Finding::fact(false, format!("{} and {} {kind} points", ours.len(), theirs.len())));
        }
        for [at, error] in ours {
            let apart = |other: &&[f64; 2]| (other[0] - at).abs();
            let Some(nearest) = theirs.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))) else { continue };
            worst = [worst[0].max(apart(&nearest)), worst[1].max(error + nearest[1])];
            count += 1;
        }
    }
    let ours = format!("{count} special points agree within {:.0e}", worst[0]);
    Ok(Finding::fact(count > 0 && worst[0] <= worst[1], ours).within(worst[1]))
}

fn flow(name: &str, flows: &Run, sampled: &Run, family: &str) -> Claim {
    let finding = same(flows, &format!("{family} by flow {name}"), sampled, &format!("contact {family}"));
    Claim::decided("4", format!("Flow ({name}) reaches contact {family}"), "yes", finding)
}

/// Claim on a homotopy whose path the program chose.
pub fn chosen(figure: &'static str, flows: &Run, set: &str, family: &str, others: &Run) -> Claim {
    let homotopy = format!("{set} {family} to contact");
    let about = flows.notes.iter().filter(|(about, _)| *about == homotopy);
    let route: Vec<&str> = about.map(|(_, note)| note.as_str()).collect();
    let finding = same(flows, &format!("{set} {family}"), others, &format!("contact {family}"));
    let statement = format!("Cubic {family} is brought to contact {family}");
    Claim::decided(figure, statement, "yes", finding).noting(&route.join("; "))
}
