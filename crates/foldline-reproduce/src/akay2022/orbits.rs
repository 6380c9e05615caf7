//! Orbits in the rotating frame, and their signed spectra.

use foldline::attractors::signed_spectrum;
use foldline::diagram::{Cycle, Point, Solution};
use foldline_plot::palette::GREY;
use foldline_plot::{Axis, Layer, Panel};

/// The states u and v.
pub const WHIRL: [usize; 2] = [0, 1];
const SAMPLES: usize = 1024;

/// The cycle of a point.
///
/// # Errors
/// It is an equilibrium.
pub fn cycle(point: &Point) -> Result<&Cycle, String> {
    match &point.solution {
        Solution::Cycle(cycle) => Ok(cycle),
        Solution::Equilibrium(_) => Err("an equilibrium has no orbit".into()),
    }
}

/// The orbit in the plane of u and v, closed.
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

/// An empty panel for orbits with the contact circle in it.
pub fn orbit_panel(label: &str, title: &str, reach: f64) -> Panel {
    let axis = |name: &str| Axis::new(name).from(-reach, reach);
    let panel = Panel::new(label, title, axis("u"), axis("v")).equal();
    Panel { height: 420.0, ..panel.with(contact_circle()) }
}

/// A line of a spectrum: its multiple of the base frequency 2π/T, angular frequency and amplitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// k.
    pub multiple: i64,
    /// 2πk/T.
    pub frequency: f64,
    /// |c_k|.
    pub amplitude: f64,
}

/// The lines of u + jv, strongest first.
pub fn lines(cycle: &Cycle) -> Vec<Line> {
    let spectrum = signed_spectrum(cycle, WHIRL, SAMPLES);
    let half = SAMPLES as i64 / 2;
    let line = |(k, (f, c)): (usize, &(f64, num_complex::Complex64))| Line {
        multiple: k as i64 - half,
        frequency: std::f64::consts::TAU * f,
        amplitude: c.norm(),
    };
    let mut lines: Vec<Line> = spectrum.iter().enumerate().map(line).collect();
    lines.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
    lines
}

/// `−2w`.
pub fn multiple(k: i64) -> String {
    match k {
        0 => "0".into(),
        1 => "w".into(),
        -1 => "−w".into(),
        k if k < 0 => format!("−{}w", -k),
        k => format!("{k}w"),
    }
}

/// The signed spectrum as stems over the angular frequency, the strongest lines labelled with their multiple.
pub fn spectrum(cycle: &Cycle, colour: &'static str, weakest: f64, labelled: usize) -> Layer {
    let shown: Vec<Line> = lines(cycle).into_iter().filter(|line| line.amplitude >= weakest).collect();
    let label = |(k, line): (usize, &Line)| if k < labelled { multiple(line.multiple) } else { String::new() };
    let labels = shown.iter().enumerate().map(label).collect();
    Layer::stems(shown.iter().map(|line| [line.frequency, line.amplitude]).collect(), labels, colour)
}
