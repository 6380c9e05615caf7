//! Figure 3: the smoothed contact law: its switch, and the force next to contact.

use crate::claims::{Claim, Finding};
use crate::publication::{FigurePlan, Made};
use crate::runs::Runs;
use foldline_plot::palette::{BLUE, GREEN, GREY, VERMILION};
use foldline_plot::{Axis, Figure, Layer, Panel};
use foldline_rotor::ContactLaw;

pub const PLAN: FigurePlan = FigurePlan { name: "3", title: "the smoothed contact law", runs: &[], make };

/// β and K: the reference, the softer ring as validated, and the softer ring with a switch that is too blunt.
const LAWS: [(f64, f64, &str); 3] = [(10.0, 150.0, BLUE), (6.0, 90.0, GREEN), (6.0, 30.0, VERMILION)];

fn make(_: &Runs) -> Result<Made, String> {
    let radius = |k: usize| 0.9 + 0.2 * k as f64 / 800.0;
    let along = |f: &dyn Fn(f64) -> f64, from: usize, to: usize| -> Vec<[f64; 2]> {
        (from..=to).map(|k| [radius(k), f(radius(k))]).collect()
    };
    let axis = |low: f64, high: f64| Axis::new("r").from(low, high);
    let mut switch =
        Panel::new("(a)", "switch", axis(0.94, 1.06), Axis::new("½ (tanh K(r − 1) + 1)").from(-0.05, 1.05));
    let mut force = Panel::new("(b)", "force of the ring", axis(0.94, 1.02), Axis::new("force").from(-0.032, 0.06));
    for (beta, k, colour) in LAWS {
        let name = format!("β = {beta}, K = {k}");
        let rise = |r: f64| 0.5 * ((k * (r - 1.0)).tanh() + 1.0);
        switch = switch.with(Layer::curve(&along(&rise, 0, 800), colour).named(&name));
        force = force.with(Layer::curve(&along(&|r| ContactLaw::Tanh.force(r, beta, k), 0, 800), colour).named(&name));
        let sharp = along(&|r| ContactLaw::Piecewise.force(r, beta, k), 0, 800);
        let sharp = Layer { dashed: true, ..Layer::curve(&sharp, GREY).dashed().wide(1.0) };
        force = force.with(sharp.named("piecewise-linear"));
    }
    let force = force.with(Layer::horizontal(0.0)).with(Layer::note([0.976, -0.0275], "pulls inwards"));
    let claims = LAWS.iter().map(|(beta, k, _)| pull(*beta, *k)).collect();
    Ok(Made {
        figure: Figure::grid("Smoothed contact", 2, vec![switch, force.with(Layer::vertical(1.0))]),
        caption: "The hyperbolic tangent switches the ring on over a width of about 1/K. Because it is not yet off below contact, \
                  where the spring would pull, the smoothed ring pulls inwards there; the sharper the switch, the less."
            .into(),
        claims,
    })
}

/// The largest pull, found by narrowing down.
fn pull(beta: f64, k: f64) -> Claim {
    let force = |r: f64| ContactLaw::Tanh.force(r, beta, k);
    let (mut low, mut high) = (1.0 - 2.0 / k, 1.0);
    for _ in 0..100 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if force(a) < force(b) { high = b } else { low = a }
    }
    let r = 0.5 * (low + high);
    let ours = format!("{:.6} at r = {r:.6}", force(r));
    let depends = format!("{:.6} β/K at r = 1 − {:.5}/K", force(r) * k / beta, (1.0 - r) * k);
    let finding = Finding::qualified(force(r) < 0.0, ours).within(1e-9).noting(depends);
    Claim::decided(
        "3",
        format!("With β = {beta}, K = {k} the smoothed ring pulls inwards just below contact"),
        "yes",
        Ok(finding),
    )
}
