//! Cycles with a mode that decays within a mesh interval, against closed forms.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Ending, Kind, Point, Solution};
use foldline::explore::{self, System};
use foldline::problem::gauss::Points;
use foldline_store::study_file::parse_study;
use std::f64::consts::{E, PI, TAU};

#[track_caller]
fn run(model: &str, study: &str) -> Diagram {
    let study = parse_study(&format!("model = \"m\"\n{study}"), "study", model, "model");
    let study = study.unwrap_or_else(|found| panic!("{found:?}"));
    explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved)
}

#[track_caller]
fn branch<'d>(diagram: &'d Diagram, name: &str) -> &'d Branch {
    let found = diagram.branch(name).unwrap_or_else(|| panic!("{name}"));
    assert!(found.ends.iter().all(|end| end.as_ref().is_some_and(Ending::complete)), "{name}: {:?}", found.ends);
    assert!(found.special.iter().all(|special| special.kind != Kind::Unexplained), "{name}");
    found
}

fn size(point: &Point) -> (usize, Points) {
    let Solution::Cycle(cycle) = &point.solution else { panic!("no cycle") };
    (cycle.intervals(), cycle.points)
}

/// Hopf normal form in which a third state follows the first one at the rate `rate`.
fn slaved(rate: &str) -> String {
    format!(
        "name = \"slaved\"\n[parameters]\nmu = -1\nk = 1\n[states]\nx = \"mu*x - y - z*(x^2 + y^2)\"\n\
         y = \"x + mu*y - y*(x^2 + y^2)\"\nz = \"-{rate}*(z - x)\"\n"
    )
}

/// The cycles have radius √μ, period 2π and the multiplier e^{-4 π μ} up to the reciprocal of the rate, which costs no
/// intervals.
#[test]
fn the_rate_of_a_slaved_state_costs_neither_accuracy_nor_intervals() {
    let study = "[[seed]]\nname = \"rest\"\nstate = { x = 0, y = 0, z = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"rest\"\n\
        free = \"mu\"\nrange = [-1, 1]\nswitch = { hopf = 1 }\n";
    for (exponent, rate) in [(3, "1e3"), (6, "1e6"), (9, "1e9"), (12, "1e12")] {
        let diagram = run(&slaved(rate), study);
        let own = branch(&diagram, "b/hopf-1");
        let last = own.points.last().unwrap();
        assert_eq!(last.parameters[0], 1.0);
        let off = 10.0 * 10f64.powi(-exponent);
        let period = last.solution.period().unwrap();
        assert!((period - TAU).abs() < off + last.trust.discretisation * period, "{rate}: {period}");
        assert!((last.ranges[0][1] - 1.0).abs() < off + 2.0 * last.trust.discretisation, "{rate}: {:?}", last.ranges);
        assert!(last.trust.discretisation < 1e-5 && last.trust.spectrum < 1e-5, "{rate}: {:?}", last.trust);
        let known = [1.0, (-4.0 * PI).exp(), 0.0];
        for (found, known) in last.spectrum.iter().zip(known) {
            assert!((found.re - known).abs() < off + last.trust.spectrum, "{rate}: {:?}", last.spectrum);
        }
        // 20 to 40 intervals suffice, and 11 points.
        for point in own.points.iter().skip(1) {
            assert!(size(point).0 <= 40 && size(point).1 == Points::Radau, "{rate}: {:?}", size(point));
        }
        assert!(own.points.len() < 16, "{rate}: {} points", own.points.len());
    }
}

/// Along this branch the mode is slow at first.
#[test]
fn a_mode_may_become_fast_along_a_branch() {
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 1, y = 0, z = 1 }\nparameters = { mu = 1 }\n[[branch]]\n\
        name = \"b\"\nfrom = \"s\"\nfree = \"k\"\nrange = [0.5, 9]\n";
    let diagram = run(&slaved("10^k"), study);
    let own = branch(&diagram, "b");
    let kinds: Vec<Points> = own.points.iter().map(|point| size(point).1).collect();
    assert_eq!((kinds[0], kinds[kinds.len() - 1]), (Points::Gauss, Points::Radau));
    assert!(own.points.iter().all(|point| size(point).0 < 100));
    // The two points at the change agree within their errors, and so does the branch with its limit.
    let at = kinds.iter().position(|kind| *kind == Points::Radau).unwrap();
    let [before, after] = [&own.points[at - 1], &own.points[at]];
    let errors = before.trust.discretisation + after.trust.discretisation;
    let [a, b] = [before, after].map(|point| point.solution.period().unwrap());
    assert!((a - b).abs() < errors * a, "{a} and {b}");
    let last = own.points.last().unwrap();
    assert!((last.solution.period().unwrap() - TAU).abs() < 1e-8 && last.trust.spectrum < 1e-7, "{:?}", last.trust);
}

/// A `stop` holds where the collocation points would change, too.
#[test]
fn a_branch_ends_at_its_stop_where_the_points_would_change() {
    let study = |more: &str| {
        format!(
            "[[seed]]\nname = \"s\"\nstate = {{ x = 1, y = 0, z = 1 }}\nparameters = {{ mu = 1 }}\n[[branch]]\n\
             name = \"b\"\nfrom = \"s\"\nfree = \"k\"\nrange = [1, 9]\n{more}"
        )
    };
    let whole = run(&slaved("10^k"), &study(""));
    let points = &branch(&whole, "b").points;
    // The change happens at the last point at Gauss points.
    let at = points.iter().rfind(|point| size(point).1 == Points::Gauss).unwrap().parameters[1];
    let stopped = run(&slaved("10^k"), &study(&format!("stop = {{ k = {at} }}\n")));
    let own = branch(&stopped, "b");
    assert!(matches!(own.ends[1], Some(Ending::Asked(_))), "{:?}", own.ends);
    let last = own.points.last().unwrap();
    assert!((last.parameters[1] - at).abs() < 1e-9 && size(last).1 == Points::Gauss, "{at}: {:?}", last.parameters);
}

/// x = e^{sin t} at every rate; the Prothero–Robinson problem. The stated error covers the true one, which it exceeds by
/// no more than a few orders of magnitude.
#[test]
fn stated_errors_hold_at_every_rate() {
    let model = "name = \"follows\"\n[parameters]\nk = 0\n[forcing]\nfrequency = \"1\"\n[states]\n\
        x = \"-10^k*(x - exp(sin(t))) + cos(t)*exp(sin(t))\"\ny = \"-y + x\"\n";
    let study = "tolerance = 1e-6\n[[seed]]\nname = \"s\"\nstate = { x = 1, y = 1 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n\
        free = \"k\"\nrange = [0, 12]\n";
    let diagram = run(model, study);
    let own = branch(&diagram, "b");
    // In the units of the error, which is relative to scale and size.
    for point in &own.points {
        let Solution::Cycle(cycle) = &point.solution else { panic!("no cycle") };
        let state = |t: f64| (cycle.state(t)[0] - (TAU * t).sin().exp()).abs() / (1.0 + E);
        let off = (0..4000).map(|s| state(f64::from(s) / 4000.0)).fold(0.0, f64::max);
        let stated = point.trust.discretisation;
        assert!(
            off <= stated && stated < 1e-5 && stated < 1e-9 + 300.0 * off,
            "{:?}: {off:e} {stated:e}",
            point.parameters
        );
        assert!(size(point).0 < 60, "{:?}: {} intervals", point.parameters, size(point).0);
        let known = (-TAU * 10f64.powf(point.parameters[0])).exp();
        let nearest = point.spectrum.iter().map(|z| (z - known).norm()).fold(f64::INFINITY, f64::min);
        assert!(nearest <= point.trust.spectrum, "{:?}: {:?} {:?}", point.parameters, point.spectrum, point.trust);
    }
}

/// Modes grow within intervals in the jumps of van der Pol's oscillator, which keeps Radau points away where the mesh is
/// coarse there. The stated error of the multipliers covers the true one everywhere; for sharp jumps it may tell nothing.
#[test]
fn relaxation_oscillations_keep_their_multipliers() {
    let model = "name = \"relaxation\"\n[parameters]\neps = 0.01\n[states]\nx = \"(y - x^3/3 + x)/eps\"\ny = \"-x\"\nz = \"x - z\"\n";
    let study = "[[seed]]\nname = \"s\"\nstate = { x = 2, y = 0, z = 0 }\n[[branch]]\nname = \"b\"\nfrom = \"s\"\n\
        free = \"eps\"\nrange = [1e-3, 1]\n";
    let diagram = run(model, study);
    let own = branch(&diagram, "b");
    for point in &own.points {
        let period = point.solution.period().unwrap();
        // The third state decays by e^{-T}; the multiplier of the oscillator is far below that.
        let nearest = point.spectrum.iter().map(|z| (z - (-period).exp()).norm()).fold(f64::INFINITY, f64::min);
        assert!(
            nearest <= point.trust.spectrum && (point.parameters[0] < 0.01 || point.trust.spectrum < 1e-2),
            "{:?} {:?}",
            point.spectrum,
            point.trust
        );
    }
    // At eps = 1 the period is that of van der Pol's equation with μ = 1.
    let last = own.points.last().unwrap();
    assert!((last.solution.period().unwrap() - 6.663_286_859_323).abs() < 1e-5);
}
