//! Pictures of runs: sections and spectra against closed forms, and every content of a figure through the program.

use foldline::contract::Unobserved;
use foldline::diagram::{Diagram, Motion};
use foldline::explore::course::Way;
use foldline::explore::replay::{Plane, section, spectrum};
use foldline::explore::{self, System};
use foldline::model::Model;
use foldline::simulation::Outcome;
use foldline_store::study_file::parse_study;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

/// x'' + 2ζx' + x = cos Ωt.
const LINEAR: &str = "name = \"linear\"\n[parameters]\nOmega = 0.7\nzeta = 0.2\n[forcing]\nfrequency = \"Omega\"\n\
    [states]\nx = \"v\"\nv = \"-2*zeta*v - x + cos(Omega*t)\"\n[outputs]\ntwice = \"2*x\"\n";
const STUDY: &str = "model = \"linear.toml\"\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 4\n\
    [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [0.5, 2]\n\
    [[sweep]]\nname = \"up\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [0.5, 2]\ncount = 7\n";
/// Tolerance of the trajectories. The steady motion attracts, so that local errors do not grow.
const TOLERANCE: f64 = 1e-9;
/// Largest difference, relative to the motion: the error per period is at most some steps times the tolerance.
const CLOSE: f64 = 1e3 * TOLERANCE;

/// State at the start of a forcing period, and amplitude, of the steady motion.
fn steady(omega: f64) -> ([f64; 2], f64) {
    let zeta = 0.2;
    let (a, b) = (1.0 - omega * omega, 2.0 * zeta * omega);
    let size = a * a + b * b;
    // x = Re H exp(iΩt) with H = 1/(a + ib).
    ([a / size, omega * b / size], 1.0 / size.sqrt())
}

fn linear() -> Model {
    parse_study(STUDY, "study.toml", LINEAR, "linear.toml").expect("the study is right").model
}

fn way() -> Way<'static> {
    Way { tolerance: TOLERANCE, steps: 100_000, stop: &|| false }
}

#[test]
fn points_in_sections_of_a_steady_motion_are_those_of_the_closed_form() {
    let model = linear();
    for omega in [0.6, 1.0, 1.7] {
        let (start, amplitude) = steady(omega);
        let parameters = [omega, 0.2];
        let found = section(&model, &start, &parameters, Plane::Stroboscopic, 5, &way());
        assert_eq!((found.outcome, found.states.len()), (Outcome::Reached, 10));
        for (state, output) in found.states.chunks(2).zip(&found.outputs) {
            let error = (state[0] - start[0]).abs().max((state[1] - start[1]).abs());
            assert!(error < CLOSE * amplitude, "{omega}: {error}");
            assert_eq!(*output, 2.0 * state[0]);
        }
        // Where x rises through 0 the velocity is Ω times the amplitude, once in each period; 2x is an output.
        let period = std::f64::consts::TAU / omega;
        for plane in [Plane::Level(0, 0.0), Plane::Level(2, 0.0)] {
            let found = section(&model, &start, &parameters, plane, 4, &way());
            assert_eq!((found.outcome, found.times.len()), (Outcome::Reached, 4));
            for (state, times) in found.states.chunks(2).zip(found.times.windows(2)) {
                assert!(state[0].abs() < CLOSE && (state[1] / (omega * amplitude) - 1.0).abs() < CLOSE, "{state:?}");
                assert!((times[1] - times[0] - period).abs() < CLOSE * period);
            }
        }
    }
}

#[test]
fn a_level_that_is_never_passed_ends_after_the_steps() {
    let model = linear();
    let way = Way { steps: 500, ..way() };
    let found = section(&model, &steady(1.0).0, &[1.0, 0.2], Plane::Level(0, 100.0), 4, &way);
    assert_eq!((found.outcome, found.times.len()), (Outcome::StepLimit, 0));
}

#[test]
fn the_spectrum_of_a_steady_motion_is_its_amplitude_at_the_forcing_frequency() {
    let model = linear();
    let (start, amplitude) = steady(0.8);
    let time = 16.0 * std::f64::consts::TAU / 0.8;
    let found = spectrum(&model, &start, &[0.8, 0.2], 0, time, 512, &way()).expect("the motion goes on");
    assert_eq!(found.len(), 257);
    assert!((found[16] / amplitude - 1.0).abs() < CLOSE, "{} {amplitude}", found[16]);
    // Hann's window spreads a line over its two neighbours only.
    let rest = found.iter().enumerate().filter(|(k, _)| k.abs_diff(16) > 1).map(|(_, a)| *a).fold(0.0, f64::max);
    assert!(rest < CLOSE * amplitude, "{rest}");
}

#[test]
fn sweeps_keep_the_state_at_the_start_of_a_forcing_period() {
    let study = parse_study(STUDY, "study.toml", LINEAR, "linear.toml").expect("the study is right");
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    let sweep = diagram.response_set("up").expect("the sweep was computed");
    assert_eq!(sweep.responses.len(), 7);
    for own in &sweep.responses {
        assert_eq!(own.motion, Motion::Cycle);
        let (start, amplitude) = steady(own.value);
        let error = (own.state[0] - start[0]).abs().max((own.state[1] - start[1]).abs());
        // The motion has settled up to its stated error, relative to its extent, 2·amplitude.
        let stated = 2.0 * amplitude * own.error.max(1e-8);
        assert!(error < 100.0 * stated, "{}: {error} beside {stated}", own.value);
    }
}

/// A run of the study, and of one of a rotor with contact.
static RUNS: LazyLock<(tempfile::TempDir, PathBuf)> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("linear.toml"), LINEAR).unwrap();
    std::fs::write(folder.path().join("study.toml"), format!("{STUDY}{FIGURES}")).unwrap();
    let run = folder.path().join("run");
    let out = foldline(folder.path(), &["run", "study.toml", "--out", "run", "-q"]);
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    (folder, run)
});

const FIGURES: &str = r#"
[[figure]]
name = "overview"
title = "Resonance"
columns = 2
theme = "print"

[[figure.panel]]
title = "everything"
span = 2

[[figure.panel]]
window = [0.9, 1.1, 1, 3]

[[figure.panel]]
show = "multipliers"
"#;

fn foldline(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foldline")).current_dir(folder).args(arguments).output().unwrap()
}

/// Draws a picture of the run; returns it, and what was said.
fn drawn(arguments: &[&str]) -> (String, String) {
    let (folder, _) = &*RUNS;
    let file = format!("picture_{}.svg", arguments.join("_").replace(['/', ',', '=', ' '], "-"));
    let out = foldline(folder.path(), &[&["plot", "run", "-o", &file], arguments].concat());
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(0), "{arguments:?}: {said}");
    (std::fs::read_to_string(folder.path().join(file)).unwrap(), said)
}

fn refused(arguments: &[&str]) -> String {
    let (folder, _) = &*RUNS;
    let out = foldline(folder.path(), &[&["plot", "run", "-o", "none.svg"], arguments].concat());
    assert_eq!(out.status.code(), Some(2), "{arguments:?}");
    assert!(!folder.path().join("none.svg").exists());
    String::from_utf8_lossy(&out.stderr).into_owned()
}

#[test]
fn every_content_has_its_axes() {
    let cases: [(&[&str], &[&str]); 8] = [
        (&["--show", "multipliers"], &["Re μ", "Im μ", "|μ|", "last point"]),
        (&["--show", "orbits", "--count", "4"], &["(a)", "(d)", ">x<", ">v<", "start of a forcing period"]),
        (&["--show", "waterfall", "--y", "x"], &["t/T", ">x<", ">Ω<"]),
        (&["--show", "harmonics", "--y", "x"], &["harmonic of 1/T", "amplitude of x"]),
        (&["--show", "spectrogram", "--y", "x"], &["frequency / forcing frequency", "−10 to 0 dB"]),
        (&["--strobe", "3", "--y", "x"], &["x at the start of a forcing period", ">up<", ">b<"]),
        (&["--section", "v=0", "--strobe", "3", "--y", "twice"], &["twice where v rises through 0", ">up<"]),
        (&["--z", "v_max", "--y", "x_max"], &["max x", "max v", ">Ω<"]),
    ];
    for (arguments, texts) in cases {
        let (svg, _) = drawn(arguments);
        for text in texts {
            assert!(svg.contains(text), "{arguments:?}: {text} is missing");
        }
    }
}

#[test]
fn stroboscopic_points_lie_on_the_branch() {
    // The dots of the sweep have the positions of the curve of the branch.
    let (svg, _) = drawn(&["--strobe", "2", "--y", "x", "--size", "800x600"]);
    let numbers = |text: &str| -> Vec<f64> {
        text.split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-')).filter_map(|n| n.parse().ok()).collect()
    };
    let curve: Vec<[f64; 2]> = svg
        .lines()
        .filter(|line| line.starts_with("<path d=\"M") && line.matches('L').count() > 50)
        .flat_map(|line| numbers(line).chunks_exact(2).map(|p| [p[0], p[1]]).collect::<Vec<_>>())
        .collect();
    let dots: Vec<[f64; 2]> = svg
        .lines()
        .filter(|line| line.contains("<circle r=\"4\" stroke=\"none\"/>"))
        .map(|line| {
            let own = numbers(line.split("translate(").nth(1).unwrap_or_default());
            [own[0], own[1]]
        })
        .collect();
    assert!(curve.len() > 50 && dots.len() >= 14, "{} {}", curve.len(), dots.len());
    for dot in dots.iter().take(14) {
        let near = curve.iter().map(|p| (p[0] - dot[0]).hypot(p[1] - dot[1])).fold(f64::INFINITY, f64::min);
        // Vertices of the curve are at most some 5 units apart; a wrong phase would be off by the amplitude, 100 units.
        assert!(near < 5.0, "{dot:?}: {near}");
    }
}

#[test]
fn zoomed_parts_are_outlined_and_figures_come_from_the_study() {
    let (svg, _) = drawn(&["--zoom", "0.9,1.1,1,3"]);
    assert_eq!(svg.matches("stroke=\"#666\"").count(), 1);
    assert!(svg.contains(">(b)</text>") && svg.contains(">(a)</tspan>"));
    let (svg, _) = drawn(&["--figure", "overview"]);
    for text in ["Resonance", "everything", "Re μ", "(d)"] {
        assert!(svg.contains(text), "{text}");
    }
    assert!(!svg.contains("#0072b2") && svg.matches("stroke=\"#666\"").count() == 1);
    assert!(refused(&["--figure", "overvew"]).contains("overview"));
}

#[test]
fn themes_sizes_and_logarithmic_axes_change_the_picture() {
    let (light, _) = drawn(&["--size", "500x400"]);
    assert!(light.contains("width=\"500\" height=\"400\""));
    let (dark, _) = drawn(&["--theme", "dark"]);
    assert!(dark.contains("fill=\"#14181d\"") && !dark.contains("#fff\""));
    let (print, _) = drawn(&["--theme", "print"]);
    assert!(!print.contains("#0072b2") && print.contains("#000000"));
    let (log, _) = drawn(&["--log", "xy"]);
    // Equally spaced numbers are equally far apart on a linear axis only.
    let uneven = |svg: &str| {
        let ticks = svg.lines().filter(|line| line.starts_with("<text x=") && line.contains("text-anchor=\"middle\">"));
        let at: Vec<f64> = ticks.filter_map(|line| line.split('"').nth(1)?.parse().ok()).collect();
        let steps: Vec<f64> = at.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(steps.len() >= 2, "{at:?}");
        steps.iter().fold(0.0f64, |most, step| most.max((step / steps[0] - 1.0).abs()))
    };
    assert!(uneven(&light) < 0.01 && uneven(&log) > 0.05, "{} {}", uneven(&light), uneven(&log));
}

#[test]
fn what_cannot_be_drawn_is_refused_with_a_reason() {
    for (arguments, reason) in [
        (&["--show", "waterfall", "--y", "Omega"][..], "a state or an output"),
        (&["--strobe", "3", "--y", "x", "--unit", "x=mm"], "no unit"),
        (&["--section", "w=0"], "w"),
        (&["--section", "x"], "--section x"),
        (&["--view", "1,2,3", "--z", "v_max"], "--view"),
        (&["--size", "10x10"], "--size"),
        (&["--figure", "none", "--study", "linear.toml"], "linear.toml"),
        (&["--zoom", "2,1,0,1"], "--zoom"),
    ] {
        let said = refused(arguments);
        assert!(said.contains(reason), "{arguments:?}: {said}");
    }
}

#[test]
fn mistakes_in_figures_have_line_column_and_cure() {
    let wrong = format!(
        "{STUDY}[[figure]]\nname = \"f\"\nsize = [1, 2]\n[[figure.panel]]\nx = \"Omgea\"\nshow = \"orbit\"\nwindow = [1, 0, 0, 1]\n"
    );
    let found = parse_study(&wrong, "study.toml", LINEAR, "linear.toml").expect_err("there are mistakes");
    let lines: Vec<(usize, &str)> = found.iter().map(|own| (own.line, own.message.as_str())).collect();
    let first = STUDY.lines().count();
    let expected = [(first + 3, "`size`"), (first + 5, "Omgea"), (first + 6, "orbit"), (first + 7, "`window`")];
    for (line, part) in expected {
        assert!(lines.iter().any(|(own, message)| *own == line && message.contains(part)), "{line} {part}: {lines:?}");
    }
    assert_eq!(lines.len(), expected.len(), "{lines:?}");
}

/// x = 0 of x' = a x - x⁵ has a pitchfork at a = 0 without a cubic term.
#[test]
fn special_points_whose_coefficients_vanish_are_drawn() {
    let model = "[parameters]\na = -0.5\n[states]\nx = { equation = \"a*x - x^5\", range = [-2, 2] }\n";
    let study = "model = \"m.toml\"\n[[seed]]\nname = \"s\"\nstate = { x = 0 }\n\
                 [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"a\"\nrange = [-0.5, 1]\n";
    let own = parse_study(study, "study.toml", model, "m.toml").expect("the study is right");
    let system = System::of_plan(&own.model, &own.plan);
    let diagram = explore::run(&system, &own.plan, 1, Diagram::default(), &Unobserved);
    let layers = foldline_plot::branches::special_layers(
        &diagram.branches[0],
        foldline_plot::Quantity::Parameter(0),
        foldline_plot::quantity::default_y(&own.model),
        "#000000",
    );
    let names: Vec<_> = layers.iter().filter_map(|layer| layer.name.as_deref()).collect();
    assert_eq!(names, ["branch point, degenerate"]);
}
