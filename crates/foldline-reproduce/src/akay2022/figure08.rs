//! Figure 8: the lowest part of SL on the path from cubic to contact stiffness.

use super::rotor::{MAX_R, SPEED, least_radius, parameters};
use crate::claims::{Claim, Finding, digits};
use crate::publication::{FigurePlan, Made};
use crate::runs::Runs;
use foldline_plot::palette::{GREY, nth};
use foldline_plot::{Axis, Figure, Layer, Marker, Panel, branch_curve};

pub const PLAN: FigurePlan =
    FigurePlan { name: "8", title: "the lowest part of SL during the homotopy", runs: &["lowest-part"], make };

const STEPS: [&str; 6] = ["0", "0.25", "0.5", "0.75", "0.9", "1"];

fn make(runs: &Runs) -> Result<Made, String> {
    let run = runs.run("lowest-part")?;
    let mut panel =
        Panel::new("(a)", "SL near its first fold", Axis::new("Ω").from(3.2, 5.0), Axis::new("max r").from(0.55, 1.9));
    let mut lowest = Vec::new();
    let mut missing = Vec::new();
    let mut error = 0.0_f64;
    for (k, kappa) in STEPS.iter().enumerate() {
        match run.branch(&format!("SL {kappa}")) {
            Ok(branch) => {
                panel = panel.with(branch_curve(branch, SPEED, MAX_R, nth(k)).named(format!("κ = {kappa}")));
                let [r, _, off] = least_radius(run, &branch.name)?;
                lowest.push([parameters(&branch.points[0])[1], r]);
                error = error.max(off);
            }
            Err(why) => missing.push(why),
        }
    }
    let axis = Axis::new("κ (0: cubic, 1: contact)").from(-0.05, 1.05);
    let below = Panel::new("(b)", "lowest amplitude", axis, Axis::new("smallest max r of SL").from(0.6, 1.1))
        .with(Layer::curve(&lowest, GREY).wide(1.0))
        .with(Layer::scatter(lowest.clone(), Marker::Circle, GREY))
        .with(Layer::horizontal(1.0))
        .with(Layer::note([0.15, 1.0], "contact"));
    let finding = || {
        let at = |kappa: f64| lowest.iter().find(|[k, _]| (k - kappa).abs() < 1e-9).map(|[_, r]| *r);
        let (Some(cubic), Some(contact)) = (at(0.0), at(1.0)) else { return Err(missing.join("; ")) };
        let ours = format!("{} and {}", digits(cubic, error), digits(contact, error));
        let crossing = lowest.windows(2).find(|w| (w[0][1] < 1.0) != (w[1][1] < 1.0));
        let note = crossing.map_or(String::new(), |w| format!("it passes 1 between κ = {} and {}", w[0][0], w[1][0]));
        Ok(Finding::qualified(cubic < 1.0 && contact > 1.0, ours).within(error).noting(note))
    };
    let statement = "The lowest amplitude of SL lies below contact for the cubic rotor and above it for contact";
    Ok(Made {
        figure: Figure::grid("From cubic to contact stiffness", 2, vec![panel.with(Layer::horizontal(1.0)), below]),
        caption: "SL over the rotor speed for some κ on the way; the contact radius is 1.".into(),
        claims: vec![Claim::decided("8", statement, "below, above", finding())],
    })
}
