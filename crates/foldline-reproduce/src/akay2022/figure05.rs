//! Figure 5: the orbits of SL and DL at Ω = 5 with contact, in the rotating frame, and their signed spectra in both
//! frames.

use super::orbits::{cycle, multiple, orbit, orbit_panel, stems};
use super::rotor::{colour, stable_at};
use crate::claims::{Claim, Finding};
use crate::publication::{FigurePlan, Made};
use crate::runs::Runs;
use foldline_plot::{Axis, Figure, Layer, Panel};
use foldline_rotor::{Frame, Line, Spectrum, Whirl};
use std::fmt::Write;

pub const PLAN: FigurePlan = FigurePlan { name: "5", title: "orbits and spectra at Ω = 5", runs: &["diagrams"], make };

const OMEGA: f64 = 5.0;
/// Lines weaker than this share of the strongest are neither drawn nor listed.
const SHARE: f64 = 1e-3;
const FRAMES: [(Frame, &str); 2] = [(Frame::Rotating, "rotating"), (Frame::Inertial, "inertial")];

fn make(runs: &Runs) -> Result<Made, String> {
    let run = runs.run("diagrams")?;
    let (mut orbits, mut spectra, mut claims) = (Vec::new(), [Vec::new(), Vec::new()], Vec::new());
    let mut caption = String::from(
        "w is the angular frequency of the cycle. In the rotating frame the bouncing motions are periodic; whirl is mainly \
         backward, at −w and −2w (single loop) or −w and −3w (double loop), about a constant offset. For a standing observer every \
         line lies higher by Ω: the offset turns with the shaft, and the line at −w whirls forward.",
    );
    for (family, labels, title, wanted) in [
        ("SL", ["(a)", "(c)", "(e)"], "single loop, 2:1", [-1, -2]),
        ("DL", ["(b)", "(d)", "(f)"], "double loop, 3:1", [-1, -3]),
    ] {
        let name = format!("contact {family}");
        let point = stable_at(run, &name, OMEGA)?;
        let cycle = cycle(&point)?;
        let colour = colour(&name);
        orbits.push(orbit_panel(labels[0], title, 2.4).with(orbit(cycle, colour).named(family)));
        let spectrum = Spectrum::of(cycle, OMEGA);
        let _ = write!(caption, "\n\n{family} (w = {:.6})\tamplitude", spectrum.base);
        for (_, frame) in FRAMES {
            let _ = write!(caption, "\tfrequency, {frame} frame\twhirl");
        }
        table(&mut caption, &spectrum);
        for (k, (frame, text)) in FRAMES.into_iter().enumerate() {
            spectra[k].push(panel(
                labels[k + 1],
                &format!("{family}, {text} frame"),
                &spectrum.peaks(frame, SHARE),
                colour,
            ));
        }
        let error = point.trust.discretisation;
        claims.push(strongest(family, &spectrum, wanted, error));
        claims.push(standing(family, &spectrum, error));
    }
    let [rotating, inertial] = spectra;
    let panels = orbits.into_iter().chain(rotating).chain(inertial).collect();
    Ok(Made { figure: Figure::grid("Contact, Ω = 5", 2, panels), caption, claims })
}

fn panel(label: &str, title: &str, peaks: &[Line], colour: &'static str) -> Panel {
    let frequencies = peaks.iter().map(|line| line.frequency);
    let [low, high] = frequencies.fold([0.0_f64; 2], |[low, high], f| [low.min(f), high.max(f)]);
    let axis = Axis::new("angular frequency (negative: backward whirl)").from(low - 1.5, high + 2.0);
    let panel = Panel::new(label, format!("spectrum of {title}"), axis, Axis::new("amplitude").from(5e-4, 4.0).log());
    Panel { height: 300.0, ..panel.with(Layer::vertical(0.0)).with(stems(peaks, colour, peaks.len())) }
}

/// Writes one row per line: order, amplitude, and frequency and whirl in both frames.
fn table(out: &mut String, spectrum: &Spectrum) {
    let inertial = spectrum.peaks(Frame::Inertial, SHARE);
    for (line, standing) in spectrum.peaks(Frame::Rotating, SHARE).iter().zip(inertial) {
        let _ = write!(
            out,
            "\n{}\t{:.6}\t{:.5}\t{}\t{:.5}\t{}",
            multiple(line.order),
            line.amplitude.norm(),
            line.frequency,
            line.whirl.name(),
            standing.frequency,
            standing.whirl.name()
        );
    }
}

fn strongest(family: &str, spectrum: &Spectrum, wanted: [i64; 2], error: f64) -> Claim {
    let lines = spectrum.peaks(Frame::Rotating, SHARE);
    let mut found: Vec<i64> = lines.iter().filter(|line| line.order != 0).take(2).map(|line| line.order).collect();
    found.sort_by(|a, b| b.cmp(a));
    let constant = lines.iter().position(|line| line.order == 0).is_some_and(|rank| rank < 3);
    let list: Vec<String> = lines
        .iter()
        .take(4)
        .map(|l| format!("{:.5} at {} = {:.5}", l.amplitude.norm(), multiple(l.order), l.frequency))
        .collect();
    let finding = Finding::fact(found == wanted && constant, list.join(", ")).within(error);
    let study = format!("{}, {} and a constant", multiple(wanted[0]), multiple(wanted[1]));
    Claim::decided("5", format!("The strongest lines of {family}"), study, Ok(finding))
}

/// Claim on the senses of rotation of the two strongest whirling lines in the inertial frame.
fn standing(family: &str, spectrum: &Spectrum, error: f64) -> Claim {
    let lines: Vec<Line> =
        spectrum.peaks(Frame::Inertial, SHARE).into_iter().filter(|l| l.order != 0).take(2).collect();
    let word = |l: &Line| format!("{} + Ω = {:.5}, {}", multiple(l.order), l.frequency, l.whirl.name());
    let list: Vec<String> = lines.iter().map(word).collect();
    let both = [Whirl::Forward, Whirl::Backward].iter().all(|w| lines.iter().any(|l| l.whirl == *w));
    let statement = format!("In the inertial frame {family} whirls forward at one of them and backward at the other");
    Claim::decided(
        "5",
        statement,
        "inertial = rotating + Ω",
        Ok(Finding::qualified(both, list.join("; ")).within(error)),
    )
}
