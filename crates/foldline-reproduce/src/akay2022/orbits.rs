//! Orbits in the rotating frame, and their signed spectra.

use foldline::diagram::{Cycle, Point, Solution};
use foldline_plot::palette::GREY;
use foldline_plot::{Axis, Layer, Panel};
use foldline_rotor::Line;

/// The states u and v.
pub const WHIRL: [usize; 2] = [0, 1];
const SAMPLES: usize = 1024;

/// Returns the cycle of a point.
///
/// # Errors
/// The point is an equilibrium.
pub fn cycle(point: &Point) -> Result<&Cycle, String> {
    match &point.solution {
        Solution::Cycle(cycle) => Ok(cycle),
        Solution::Equilibrium(_) => Err("an equilibrium has no orbit".into()),
        Solution::Torus(_) => Err("a torus is no closed orbit".into()),
    }
}

/// Closed orbit in the (u, v) plane.
pub fn orbit(cycle: &Cycle, colour: &'static str) -> Layer {
    let n = cycle.dim();
    let states = cycle.uniform(SAMPLES);
    let mut places: Vec<[f64; 2]> = states.chunks_exact(n.max(2)).map(|x| [x[WHIRL[0]], x[WHIRL[1]]]).collect();
    places.extend(places.first().copied());
    Layer::curve(&places, colour)
}

/// The contact circle.
pub fn contact_circle() -> Layer {
    let mut circle = Layer::circle([0.0, 0.0], 1.0, GREY).named("contact circle");
    circle.dashed = true;
    circle
}

/// Returns an empty panel for orbits, with the contact circle.
pub fn orbit_panel(label: &str, title: &str, reach: f64) -> Panel {
    let axis = |name: &str| Axis::new(name).from(-reach, reach);
    let panel = Panel::new(label, title, axis("u"), axis("v")).equal();
    Panel { height: 420.0, ..panel.with(contact_circle()) }
}

/// Multiple of w in text, such as `−2w`.
pub fn multiple(k: i64) -> String {
    match k {
        0 => "0".into(),
        1 => "w".into(),
        -1 => "−w".into(),
        k if k < 0 => format!("−{}w", -k),
        k => format!("{k}w"),
    }
}

/// Spectral lines as stems over the angular frequency, the first ones labelled with their multiple.
pub fn stems(lines: &[Line], colour: &'static str, labelled: usize) -> Layer {
    let label = |(k, line): (usize, &Line)| if k < labelled { multiple(line.order) } else { String::new() };
    let labels = lines.iter().enumerate().map(label).collect();
    Layer::stems(lines.iter().map(|line| [line.frequency, line.amplitude.norm()]).collect(), labels, colour)
}
