//! Figure 7: bifurcation diagrams with the cubic spring and with contact, and closure of the branches.

use super::identities;
use super::rotor::{MAX_R, OMEGA, colour, is_closed, last, max_r, over_speed, parameters};
use crate::claims::{Claim, Finding, digits};
use crate::publication::{FigurePlan, Made};
use crate::runs::{Run, Runs};
use foldline::diagram::{Branch, Ending, Kind};
use foldline_plot::figure::Shape;
use foldline_plot::{Axis, Figure, Layer, Panel, branch_curve};

pub const PLAN: FigurePlan = FigurePlan { name: "7", title: "bifurcation diagrams", runs: &["diagrams", "far"], make };

const FIGURE: &str = "7";

fn make(runs: &Runs) -> Result<Made, String> {
    let (run, far) = (runs.run("diagrams")?, runs.run("far")?);
    let axes = || (Axis::new("Ω").from(0.5, 12.0), Axis::new("max r").from(0.0, 11.0));
    let panel = |label: &str, law: &str| {
        let (x, y) = axes();
        Panel { height: 380.0, ..Panel::new(label, law, x, y) }.with_all(layers(run, law)).with(Layer::horizontal(1.0))
    };
    let cubic = panel("(a)", "cubic");
    let contact = panel("(b)", "contact");
    let beyond = Panel::new(
        "(c)",
        "contact S to its fold",
        Axis::new("Ω").from(0.5, 12.0),
        Axis::new("max r").from(0.1, 100.0).log(),
    )
    .with_all(layers(run, "contact"));
    let wide = Panel::new("(d)", "cubic, up to Ω = 100", Axis::new("Ω").from(0.0, 100.0), Axis::new("max r"))
        .with_all(layers(far, "cubic"));
    let mut claims = vec![window(run)];
    claims.extend(doublings(run));
    claims.extend(closing(run, far));
    claims.extend(checks(run));
    Ok(Made {
        figure: Figure::grid("Largest radius over the rotor speed", 2, vec![cubic, contact, beyond, wide]),
        caption: "Synchronous response S, single loop SL and double loop DL. Period-doubled branches are thinner; figure 9 shows \
                  them closer. With contact S has its fold at a large radius and SL closes; with the cubic spring both stay open. \
                  Contact S has folds just below contact too; they belong to the smoothing of the switch (figure 14 (c))."
            .into(),
        claims,
    })
}

/// Layers of the branches of one law, with period-doubled ones thinner.
fn layers(run: &Run, law: &str) -> Vec<Layer> {
    let mut layers = Vec::new();
    for branch in run.diagram.branches.iter().filter(|b| b.name.starts_with(law)) {
        if branch.name.contains('/') {
            let curve = branch_curve(branch, super::rotor::SPEED, MAX_R, colour(&branch.name));
            layers.insert(0, curve.wide(1.0).faint(0.6).named("period-doubled"));
        } else {
            let family = branch.name.split(' ').nth(1).unwrap_or_default();
            layers.extend(over_speed(branch, family, MAX_R));
        }
    }
    // Curves first, marks on top; the thin ones come last in the legend.
    layers.sort_by_key(|layer| (matches!(layer.shape, Shape::Scatter { .. }), layer.width < 1.1));
    layers
}

/// Claim on the speeds at which SL is unstable and DL stable, against the window around 4.4 to 4.8 of the publication.
fn window(run: &Run) -> Claim {
    let finding = || {
        let edge = |name: &str| -> Result<[f64; 2], String> {
            let doublings = run.special(name, Kind::PeriodDoubling)?;
            let top = last(&doublings).ok_or(format!("{name} has no period doubling"))?;
            Ok(run.place(OMEGA, top))
        };
        let ([from, e1], [to, e2]) = (edge("contact DL")?, edge("contact SL")?);
        // Checked on the branches themselves, between the period doublings.
        let unstable = |name: &str, at: f64| Ok::<bool, String>(run.at(name, at)?.iter().all(|p| p.unstable > 0));
        let mut holds = from < 4.4 && to > 4.8;
        for at in [4.4, 4.6, 4.8] {
            holds &= unstable("contact SL", at)? && !unstable("contact DL", at)?;
        }
        let error = e1.max(e2);
        let ours = format!("from Ω = {} to {}", digits(from, error), digits(to, error));
        Ok(Finding::qualified(holds, ours).within(error).noting("from the upper period doubling of DL to that of SL"))
    };
    Claim::decided(FIGURE, "With contact there is a window where SL is unstable and DL stable", "4.4 to 4.8", finding())
}

fn doublings(run: &Run) -> Vec<Claim> {
    let count = |name: &str, kind: Kind| Ok::<usize, String>(run.special(name, kind)?.len());
    let finding = || {
        let mut holds = Vec::new();
        let mut found = Vec::new();
        for (name, doubles) in [("cubic SL", false), ("cubic DL", false), ("contact SL", true), ("contact DL", true)] {
            let number = count(name, Kind::PeriodDoubling)?;
            holds.push((number > 0) == doubles);
            found.push(format!("{name}: {number}"));
        }
        Ok(Finding::cases(&holds, found.join(", ")))
    };
    let folds = || {
        let mut holds = Vec::new();
        let mut found = Vec::new();
        for name in ["cubic SL", "cubic DL", "contact SL", "contact DL"] {
            let folds = run.special(name, Kind::Fold)?;
            let first = folds.iter().min_by(|a, b| a.point.parameters[OMEGA].total_cmp(&b.point.parameters[OMEGA]));
            let Some(first) = first else { return Err(format!("{name} has no fold")) };
            holds.push(first.unstable_before.abs_diff(first.unstable_after) == 1);
            let [omega, error] = run.place(OMEGA, first);
            found.push(format!("{name}: {}", digits(omega, error)));
        }
        Ok(Finding::cases(&holds, found.join(", ")))
    };
    vec![
        Claim::decided(FIGURE, "SL and DL begin at folds, where a stable and an unstable cycle meet", "yes", folds()),
        Claim::decided(FIGURE, "Period doublings occur with contact and not with the cubic spring", "yes", finding()),
    ]
}

/// Claims that S and SL stay open.
fn closing(run: &Run, far: &Run) -> Vec<Claim> {
    let reached = |branch: &Branch, bound: f64| branch.ends.iter().flatten().any(|e| *e == Ending::Bound(bound));
    let cubic = |name: &str| {
        let branch = far.branch(name)?;
        let holds = reached(branch, 100.0) && !is_closed(branch);
        let ours = if holds { "open to Ω = 100".to_string() } else { format!("{:?}", branch.ends) };
        Ok(Finding::fact(holds, ours))
    };
    let turned = |name: &str, closed: bool| {
        let branch = run.branch(name)?;
        let folds = run.special(name, Kind::Fold)?;
        let top = last(&folds).ok_or(format!("{name} has no fold"))?;
        let [omega, error] = run.place(OMEGA, top);
        let open = if closed { !is_closed(branch) } else { top.unstable_before == top.unstable_after };
        let ours = format!(
            "{} at Ω = {}, max r = {:.5}",
            if closed { "closes" } else { "folds" },
            digits(omega, error),
            max_r(&top.point)
        );
        Ok(Finding::fact(open, ours).within(error))
    };
    let resonant = || {
        let upper = far.branch("cubic S")?;
        let both = upper.ends.iter().flatten().chain(far.branch("cubic S resonant")?.ends.iter().flatten());
        let at_100 = both.filter(|e| **e == Ending::Bound(100.0)).count();
        let ours = format!("{at_100} of 3 arms of S reach Ω = 100");
        // S has three radii at every speed beyond its fold as long as ζ < (mε/2) sqrt(γ/(1-J_p)).
        let [_, _, _, epsilon, gamma, _, _, j_p, m] = parameters(&upper.points[0]);
        let limit = 0.5 * m * epsilon * (gamma / (1.0 - j_p)).sqrt();
        Ok(Finding::fact(at_100 == 3, ours).noting(format!("in closed form: open for ζ < {limit:.6}")))
    };
    vec![
        Claim::decided(FIGURE, "With the cubic spring S stays open", "open", resonant()),
        Claim::decided(FIGURE, "With the cubic spring SL stays open", "open", cubic("cubic SL")),
        Claim::decided(FIGURE, "With contact S stays open", "open", turned("contact S", false))
            .noting("The fold lies far above the window of the study"),
        Claim::decided(FIGURE, "With contact SL stays open", "open", turned("contact SL", true))
            .noting("SL is an isola; its other end lies above the window of the study"),
    ]
}

/// Identities that do not depend on the method by which the cycles were computed.
fn checks(run: &Run) -> Vec<Claim> {
    let tolerance = run.study.plan.tolerance;
    let (defects, cycles) = identities::of_cycles(run.diagram.branches.iter());
    let names = ["power (I1)", "torque (I2)", "product of the multipliers (I3)", "multiplier 1 (I4)"];
    let mut claims: Vec<Claim> = names
        .iter()
        .zip(defects)
        .map(|(name, defect)| {
            let finding =
                if cycles > 0 { Ok(Finding::vanishing(defect, 10.0 * tolerance)) } else { Err("no cycles".into()) };
            Claim::check(FIGURE, name.to_string(), "0", finding).noting(&format!("on {cycles} cycles"))
        })
        .collect();
    for name in ["cubic S", "contact S"] {
        let finding = run.branch(name).map(|b| Finding::vanishing(identities::of_synchronous(b), 1e-8));
        claims.push(Claim::check(FIGURE, format!("{name} against its closed form"), "0", finding));
    }
    claims
}
