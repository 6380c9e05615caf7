//! Figure 5: the orbits of SL and DL at Ω = 5 with contact, in the rotating frame, and their signed spectra.

use super::orbits::{Line, cycle, lines, multiple, orbit, orbit_panel, spectrum};
use super::rotor::{colour, stable_at};
use crate::claims::{Claim, Finding};
use crate::publication::{FigurePlan, Made};
use crate::runs::Runs;
use foldline_plot::{Axis, Figure, Panel};

pub const PLAN: FigurePlan = FigurePlan { name: "5", title: "orbits and spectra at Ω = 5", runs: &["diagrams"], make };

fn make(runs: &Runs) -> Result<Made, String> {
    let run = runs.run("diagrams")?;
    let (mut orbits, mut spectra, mut claims) = (Vec::new(), Vec::new(), Vec::new());
    for (family, label, title, wanted) in
        [("SL", ["(a)", "(c)"], "single loop, 2:1", [-1, -2]), ("DL", ["(b)", "(d)"], "double loop, 3:1", [-1, -3])]
    {
        let name = format!("contact {family}");
        let point = stable_at(run, &name, 5.0)?;
        let cycle = cycle(&point)?;
        let colour = colour(&name);
        orbits.push(orbit_panel(label[0], title, 2.4).with(orbit(cycle, colour).named(family)));
        let axis = Axis::new("angular frequency (negative: backward whirl)").from(-13.5, 8.0);
        let panel =
            Panel::new(label[1], format!("spectrum of {family}"), axis, Axis::new("amplitude").from(1e-4, 4.0).log());
        spectra.push(panel.with(spectrum(cycle, colour, 1e-4, 6)));
        claims.push(strongest(family, &lines(cycle), wanted, point.trust.discretisation));
    }
    Ok(Made {
        figure: Figure::grid(
            "Contact, Ω = 5, rotating frame",
            2,
            orbits.into_iter().chain(spectra).collect(),
        ),
        caption: "w is the angular frequency of the cycle. In the rotating frame the bouncing motions are periodic; whirl is \
                  mainly backward, at −w and −2w (single loop) or −w and −3w (double loop), about a constant offset."
            .into(),
        claims,
    })
}

fn strongest(family: &str, lines: &[Line], wanted: [i64; 2], error: f64) -> Claim {
    let whirling: Vec<&Line> = lines.iter().filter(|line| line.multiple != 0).take(2).collect();
    let mut found: Vec<i64> = whirling.iter().map(|line| line.multiple).collect();
    found.sort_by(|a, b| b.cmp(a));
    let constant = lines.iter().position(|line| line.multiple == 0).is_some_and(|rank| rank < 3);
    let list: Vec<String> = lines
        .iter()
        .take(4)
        .map(|l| format!("{:.5} at {} = {:.5}", l.amplitude, multiple(l.multiple), l.frequency))
        .collect();
    let finding = Finding::fact(found == wanted && constant, list.join(", ")).within(error);
    let study = format!("{}, {} and a constant", multiple(wanted[0]), multiple(wanted[1]));
    Claim::decided("5", format!("The strongest lines of {family}"), study, Ok(finding))
}
