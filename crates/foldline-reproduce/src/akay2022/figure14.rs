//! Figure 14: what a contact law that is too smooth invents.

use super::rotor::{MAX_R, SPEED, max_r, smallest};
use crate::claims::{Claim, Finding, digits};
use crate::publication::{FigurePlan, Made};
use crate::runs::{Run, Runs};
use foldline::diagram::{Kind, SpecialPoint};
use foldline_plot::palette::{BLUE, VERMILION};
use foldline_plot::{Axis, Figure, Layer, Panel, branch_curve, special_layers};

pub const PLAN: FigurePlan = FigurePlan { name: "14", title: "artefacts of a small K", runs: &["blunt-contact"], make };

const SHARPNESS: [(u32, &str); 2] = [(90, BLUE), (30, VERMILION)];

fn make(runs: &Runs) -> Result<Made, String> {
    let run = runs.run("blunt-contact")?;
    let mut s = Panel::new("(a)", "S, β = 6", Axis::new("Ω").from(0.88, 0.94), Axis::new("max r").from(0.86, 1.06));
    let mut light = Panel::new(
        "(b)",
        "SL, β = 6, ζ = 10⁻⁵, ε = 0.8",
        Axis::new("Ω").from(2.7, 3.7),
        Axis::new("max r").from(0.9, 1.12),
    );
    for (k, colour) in SHARPNESS {
        let named = |name: &str| run.branch(&format!("{name} {k}"));
        let branch = named("S")?;
        s = s.with(branch_curve(branch, SPEED, MAX_R, colour).named(format!("K = {k}")));
        s = s.with_all(special_layers(branch, SPEED, MAX_R, colour));
        if let Ok(branch) = named("light SL") {
            light = light.with(branch_curve(branch, SPEED, MAX_R, colour).named(format!("SL, K = {k}")));
        }
        if let Ok(branch) = named("light S") {
            light = light.with(branch_curve(branch, SPEED, MAX_R, colour).wide(0.9).named(format!("S, K = {k}")));
        }
    }
    let contact = |panel: Panel, x: f64| panel.with(Layer::horizontal(1.0)).with(Layer::note([x, 1.0], "contact"));
    Ok(Made {
        figure: Figure::grid("A switch that is too blunt", 2, vec![contact(s, 0.935), contact(light, 3.62)]),
        caption: "With K = 30 S bends back below contact and is unstable there, and SL goes on far below contact where no ring is \
                  felt; both shrink as K grows, so they belong to the smoothing."
            .into(),
        claims: vec![false_piece(run), false_family(run)],
    })
}

/// The unstable piece of S below contact, whose width is that of the smoothing.
fn false_piece(run: &Run) -> Claim {
    let width = |k: u32| {
        let folds = run.special(&format!("S {k}"), Kind::Fold)?;
        let below: Vec<&&SpecialPoint> = folds.iter().filter(|f| f.point.parameters[0] < 1.1).collect();
        let [a, b] = below[..] else { return Err(format!("S {k} has {} folds below contact", below.len())) };
        let error = (a.error + b.error) * (1.0 + a.point.parameters[0]);
        Ok(((a.point.parameters[0] - b.point.parameters[0]).abs(), max_r(&a.point).max(max_r(&b.point)), error))
    };
    let finding = || {
        let ((blunt, r, error), (sharp, _, _)) = (width(30)?, width(90)?);
        let ours = format!("{} wide in Ω at r < {r:.4}; {} for K = 90", digits(blunt, error), digits(sharp, error));
        let note = format!("the widths are as 1 : {:.2}, the widths 1/K of the switch as 1 : 0.33", sharp / blunt);
        Ok(Finding::qualified(blunt > 2.0 * sharp && r < 1.0, ours).within(error).noting(note))
    };
    Claim::decided("14", "With β = 6, K = 30 S has a kink and a false unstable piece below contact", "yes", finding())
}

/// How far SL reaches below contact, where the ring is not there; with the sharp switch it is followed down to Ω = 3.33 only.
fn false_family(run: &Run) -> Claim {
    let lowest = |k: u32| Ok::<_, String>(smallest(run.branch(&format!("light SL {k}"))?, max_r));
    let finding = || {
        let ([blunt, at], [sharp, there]) = (lowest(30)?, lowest(90)?);
        let ours = format!("down to max r = {blunt:.4} at Ω = {at:.4}");
        let note = format!("with K = 90 the cycles at Ω = {there:.2} still touch the ring: max r = {sharp:.4}");
        Ok(Finding::qualified(blunt < 1.0 && at < there && sharp > 1.0, ours).within(1e-4).noting(note))
    };
    Claim::decided("14", "With K = 30 there is a fictitious family around and below contact", "yes", finding())
}
