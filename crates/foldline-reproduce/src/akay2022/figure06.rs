//! Figure 6: the orbits of SL and DL at Ω = 5, with the cubic spring and with contact.

use super::orbits::{cycle, orbit, orbit_panel};
use super::rotor::{max_r, min_r, stable_at};
use crate::claims::{Claim, Finding};
use crate::publication::{FigurePlan, Made};
use crate::runs::Runs;
use foldline::diagram::Cycle;
use foldline_plot::Figure;
use foldline_plot::palette::{BLUE, VERMILION};

pub const PLAN: FigurePlan =
    FigurePlan { name: "6", title: "orbits with cubic and contact stiffness", runs: &["diagrams"], make };

fn make(runs: &Runs) -> Result<Made, String> {
    let run = runs.run("diagrams")?;
    let (mut panels, mut claims) = (Vec::new(), Vec::new());
    for (family, label, title, loops) in [("SL", "(a)", "single loop", 1), ("DL", "(b)", "double loop", 2)] {
        let mut panel = orbit_panel(label, title, 5.0);
        let (mut holds, mut found) = (Vec::new(), Vec::new());
        for (law, colour) in [("cubic", BLUE), ("contact", VERMILION)] {
            let point = stable_at(run, &format!("{law} {family}"), 5.0)?;
            let cycle = cycle(&point)?;
            panel = panel.with(orbit(cycle, colour).named(law));
            let touches = entries(cycle);
            holds.push(touches == loops && min_r(&point) < 1.0 && max_r(&point) > 1.0);
            found.push(format!("{law}: {touches}, r from {:.5} to {:.5}", min_r(&point), max_r(&point)));
        }
        panels.push(panel);
        let statement = format!("How often {family} leaves the contact circle outwards in a period, cubic and contact");
        claims.push(Claim::decided("6", statement, loops.to_string(), Ok(Finding::cases(&holds, found.join("; ")))));
    }
    Ok(Made {
        figure: Figure::grid("Ω = 5, rotating frame", 2, panels),
        caption: "The cubic orbits are of the same kind as the contact orbits: one loop or two in a period, partly inside the \
                  contact circle and partly outside."
            .into(),
        claims,
    })
}

/// How often the orbit crosses r = 1 outwards.
fn entries(cycle: &Cycle) -> usize {
    let radii: Vec<f64> = cycle.uniform(2048).chunks_exact(cycle.dim().max(2)).map(|x| x[0].hypot(x[1])).collect();
    (0..radii.len()).filter(|&k| radii[k] <= 1.0 && radii[(k + 1) % radii.len()] > 1.0).count()
}
