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
    for (family, label, title, loops, reach) in
        [("SL", "(a)", "single loop", 1, 2.8), ("DL", "(b)", "double loop", 2, 5.3)]
    {
        let mut panel = orbit_panel(label, title, reach);
        let (mut holds, mut found) = (Vec::new(), Vec::new());
        for (law, colour) in [("cubic", BLUE), ("contact", VERMILION)] {
            let point = stable_at(run, &format!("{law} {family}"), 5.0)?;
            let cycle = cycle(&point)?;
            panel = panel.with(orbit(cycle, colour).named(law));
            let found_loops = crossings(cycle);
            holds.push(found_loops == loops && min_r(&point) < 1.0 && max_r(&point) > 1.0);
            found.push(format!("{law}: {found_loops}, r from {:.5} to {:.5}", min_r(&point), max_r(&point)));
        }
        panels.push(panel);
        let statement =
            format!("How many loops {family} makes in a period, partly inside the contact circle and partly outside");
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

/// Number of self-intersections of the orbit in a period: non-adjacent sides of a polygon are compared in pairs.
fn crossings(cycle: &Cycle) -> usize {
    const SIDES: usize = 600;
    let n = cycle.dim().max(2);
    let corners: Vec<[f64; 2]> = cycle.uniform(SIDES).chunks_exact(n).map(|x| [x[0], x[1]]).collect();
    let side = |k: usize| (corners[k % SIDES], corners[(k + 1) % SIDES]);
    let turn =
        |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0;
    let crossed = |i: usize, j: usize| {
        let ((a, b), (c, d)) = (side(i), side(j));
        turn(a, b, c) != turn(a, b, d) && turn(c, d, a) != turn(c, d, b)
    };
    let pairs = (0..SIDES).flat_map(|i| (i + 2..SIDES).map(move |j| (i, j)));
    pairs.filter(|(i, j)| !(*i == 0 && *j == SIDES - 1) && crossed(*i, *j)).count()
}
