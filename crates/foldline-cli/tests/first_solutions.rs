//! First solutions where trajectories do not lead to them: light damping, stiff modes, unstable equilibria, families.

use foldline::contract::{Event, Observer, Verdict};
use foldline::diagram::{Branch, Diagram, Kind, SpecialPoint};
use foldline::explore::{self, System};
use foldline_store::study_file::parse_study;
use std::sync::Mutex;

/// Observer that collects the notes of a run.
#[derive(Default)]
struct Notes(Mutex<Vec<String>>);

impl Observer for Notes {
    fn observe(&self, event: Event) -> Verdict {
        if let Event::Note(about, note) = event {
            self.0.lock().unwrap().push(format!("{about}: {note}"));
        }
        Verdict::Continue
    }
}

/// Runs one branch in the parameter `free`; returns the diagram and the notes.
#[track_caller]
fn run(model: &str, seed: &str, branch: &str) -> (Diagram, String) {
    let study =
        format!("model = \"m\"\n[[seed]]\nname = \"s\"\n{seed}\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n{branch}\n");
    let study = parse_study(&study, "study", model, "model").unwrap_or_else(|found| panic!("{found:?}"));
    let notes = Notes::default();
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &notes);
    (diagram, notes.0.into_inner().unwrap().join("\n"))
}

fn places(branch: &Branch, kind: Kind) -> Vec<f64> {
    let mut found: Vec<f64> =
        branch.special.iter().filter(|s| s.kind == kind).map(|s| s.point.parameters[branch.free]).collect();
    found.sort_by(f64::total_cmp);
    found
}

/// A resonator of quality factor 1e5, whose transients last 2e5 periods. The lower fold is from harmonic balance with 7
/// harmonics; the upper one lies next to the peak of the backbone, for which an expansion in the amplitude
/// gives 1.003714.
#[test]
fn a_resonator_of_high_quality_needs_no_transient() {
    let model = "[parameters]\nw = 0.99\nQ = 1e5\nF = 1e-6\n[forcing]\nfrequency = \"w\"\n[states]\n\
                 x = { equation = \"v\", range = [-0.1, 0.1], scale = 0.1 }\n\
                 v = { equation = \"-v/Q - x - x^3 + F*cos(w*t)\", range = [-0.1, 0.1], scale = 0.1 }\n";
    for (seed, told) in [
        ("attractor = \"cycle\"", "too slowly for samples"),
        ("state = { x = 0, v = 0 }", "a transient lasts about 2."),
    ] {
        let (diagram, notes) = run(model, seed, "free = \"w\"\nrange = [0.98, 1.02]");
        assert!(notes.contains(told), "{seed}: {notes}");
        let folds = places(&diagram.branches[0], Kind::Fold);
        let [lower, upper] = folds[..] else { panic!("{folds:?}") };
        assert!((lower - 1.0000856309).abs() < 1e-7 && (upper - 1.003714).abs() < 5e-6, "{folds:?}");
    }
}

/// Three uncoupled linear modes, the fastest of which oscillates 43 times per forcing period. An explicit method takes
/// its steps for that one, and its solution never repeats itself to its accuracy.
#[test]
fn stiff_modes_that_decay_do_not_hide_the_response() {
    let stiffness = [90000.0, 3240000.0, 116640000.0f64];
    let mut model = String::from("[parameters]\nom = 250\n[forcing]\nfrequency = \"om\"\n[states]\n");
    for (k, (stiff, damping)) in stiffness.iter().zip([6.0, 36.0, 216.0]).enumerate() {
        model += &format!("x{k} = \"y{k}\"\ny{k} = \"cos(om*t) - {damping:?}*y{k} - {stiff:?}*x{k}\"\n");
    }
    let seed = "state = { x0 = 0, y0 = 0, x1 = 0, y1 = 0, x2 = 0, y2 = 0 }";
    let (diagram, notes) = run(&model, seed, "free = \"om\"\nrange = [249, 251]\nmax-points = 3");
    let branch = &diagram.branches[0];
    let point = branch.points.iter().find(|p| p.position == 0).unwrap_or_else(|| panic!("{:?} {notes}", branch.ends));
    let amplitude = 1.0 / (stiffness[0] - 62500.0f64).hypot(6.0 * 250.0);
    assert!((point.ranges[0][1] / amplitude - 1.0).abs() < 1e-6, "{:?} {amplitude}", point.ranges[0]);
}

/// The unstable rest state of a parametrically excited oscillator in the middle of its first tongue, given as a start.
/// To first order in ε = 0.2 the tongue ends where (1 - w²/4)² + (0.02 w)² = (ε/2)².
#[test]
fn a_given_unstable_equilibrium_is_followed() {
    let model = "[parameters]\nw = 2.0\n[forcing]\nfrequency = \"w\"\n[states]\nx = \"v\"\nv = \"-0.04*v - (1 + 0.2*cos(w*t) + x^2)*x\"\n";
    let (diagram, notes) = run(model, "state = { x = 0, v = 0 }", "free = \"w\"\nrange = [1.7, 2.3]");
    let branch = &diagram.branches[0];
    let start = branch.points.iter().find(|p| p.position == 0).unwrap_or_else(|| panic!("{:?} {notes}", branch.ends));
    assert_eq!((start.unstable, start.ranges[0]), (1, [0.0, 0.0]));
    let tongue = places(branch, Kind::PeriodDoubling);
    let half = (0.1f64.powi(2) - 0.04f64.powi(2)).sqrt();
    let expected = [2.0 * (1.0 - half).sqrt(), 2.0 * (1.0 + half).sqrt()];
    assert!(tongue.len() == 2 && (0..2).all(|k| (tongue[k] - expected[k]).abs() < 0.01), "{tongue:?} {expected:?}");
}

/// A spherical oscillator swings in any plane. Off the axes its cycle belongs to a circle of cycles.
#[test]
fn a_cycle_that_can_be_rotated_is_reported_as_one_of_a_family() {
    let axis = |own: &str| format!("-0.04*v{own} - (1 + 0.2*cos(w*t) + x^2 + y^2)*{own}");
    let model = format!(
        "[parameters]\nw = 2.0\n[forcing]\nfrequency = \"w\"\n[states]\nx = \"vx\"\ny = \"vy\"\nvx = \"{}\"\nvy = \"{}\"\n",
        axis("x"),
        axis("y")
    );
    let branch = "free = \"w\"\nrange = [1.95, 2.05]\nmax-points = 5";
    let (off, _) = run(&model, "state = { x = 0.3, y = 0.1, vx = 0, vy = 0 }", branch);
    let end = off.branches[0].ends[1].as_ref().unwrap().to_string();
    assert!(
        end.contains("a common rotation of (x, y) and (vx, vy)") && end.contains("start with y = 0, vy = 0"),
        "{end}"
    );
    let (on, _) = run(&model, "state = { x = 0.3, y = 0, vx = 0, vy = 0 }", branch);
    assert!(on.branches[0].points.len() > 2, "{:?}", on.branches[0].ends);
}

/// The first nonlinear normal mode of two masses, one with a cubic spring. Half-period shooting gives the frequency
/// 1.2185534 at the energy 12.1318908. The branch starts from a cosine of the linear mode, which is off by a few
/// thousandths.
#[test]
fn a_family_of_cycles_parametrised_by_energy_starts_from_a_given_cycle() {
    let model = "[parameters]\ndelta = 0.0\n[states]\nx1 = \"v1\"\nx2 = \"v2\"\nv1 = \"-2*x1 + x2 - 0.5*x1^3 + delta*v1\"\n\
                 v2 = \"-2*x2 + x1 + delta*v2\"\n[outputs]\nenergy = \"v1^2/2 + v2^2/2 + x1^2 + x2^2 - x1*x2 + x1^4/8\"\n";
    let times: Vec<f64> = (0..=40).map(|k| f64::from(k) / 40.0).collect();
    let of = |f: fn(f64) -> f64| times.iter().map(|t| 0.1 * f(std::f64::consts::TAU * t)).collect::<Vec<f64>>();
    let (x, v) = (of(f64::cos), of(|t| -t.sin()));
    let seed = format!(
        "[seed.cycle]\nperiod = 6.283185307\ntimes = {times:?}\n[seed.cycle.states]\nx1 = {x:?}\nx2 = {x:?}\nv1 = {v:?}\nv2 = {v:?}"
    );
    let period = std::f64::consts::TAU / 1.2185534;
    let branch = format!(
        "free = \"delta\"\nrange = [-0.01, 0.01]\nmark = {{ period = {period:?} }}\nstop = {{ period = 5.1 }}\nmax-points = 200"
    );
    let (diagram, _) = run(model, &seed, &branch);
    let branch = &diagram.branches[0];
    // (The position of the stop is a mark as well.)
    let meant = |s: &&SpecialPoint| s.kind == Kind::Mark && (s.point.solution.period().unwrap() - period).abs() < 1e-6;
    let marks: Vec<_> = branch.special.iter().filter(meant).collect();
    let [mark] = &marks[..] else { panic!("{} marks; {:?}", marks.len(), branch.ends) };
    let [low, high] = mark.point.ranges[4];
    assert!((low - 12.1318908).abs() < 1e-5 && (high - 12.1318908).abs() < 1e-5, "{low} {high}");
    assert!(branch.points.iter().all(|point| point.parameters[0].abs() < 1e-9));
}

/// A Hindmarsh-Rose neuron with bursts of 39 spikes, each of which crosses any section of the fast motion. The period is that between bursts in an
/// integration by LSODA at a relative tolerance of 1e-10.
#[test]
fn a_burst_of_many_spikes_is_found_by_sampling() {
    let model = "[parameters]\nI = 2\nr = 2e-4\n[states]\nx = { equation = \"y - x^3 + 3*x^2 - z + I\", range = [-2, 2] }\n\
                 y = { equation = \"1 - 5*x^2 - y\", range = [-10, 1] }\n\
                 z = { equation = \"r*(4*(x + 1.6) - z)\", range = [1.5, 2.5] }\n";
    let seed = "attractor = \"cycle\"\nsamples = 4";
    let (diagram, notes) = run(model, seed, "free = \"I\"\nrange = [1.999, 2.001]\nmax-points = 1");
    let start = diagram.branches[0].points.iter().find(|point| point.position == 0);
    let period = start.and_then(|point| point.solution.period());
    assert!(period.is_some_and(|period| (period - 1679.14941).abs() < 1e-4), "{period:?}: {notes}");
}
