//! Harmonics, ratios, phases and peaks against closed forms and independent results.

use foldline::contract::Unobserved;
use foldline::diagram::{Branch, Diagram, Kind, Point};
use foldline::explore::{self, System};
use foldline::model::Model;
use foldline::special::quantity::Quantity;
use foldline_store::study_file::parse_study;

/// x'' + 2ζx' + x = F cos Ωt.
const LINEAR: &str = "name = \"linear\"\n[parameters]\nOmega = 0.5\nF = 0.3\nzeta = 0.1\n[forcing]\nfrequency = \"Omega\"\n\
    [states]\nx = \"v\"\nv = \"-2*zeta*v - x + F*cos(Omega*t)\"\n[outputs]\nforce = \"F*cos(Omega*t)\"\n\
    transmitted = \"x + 2*zeta*v\"\nsquare = \"x^2\"\n";
const FORCED: &str = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 4\n\
    [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\n";

fn run(model: &str, study: &str) -> (Model, Diagram) {
    let study = parse_study(&format!("model = \"m\"\n{study}"), "study", model, "model")
        .unwrap_or_else(|found| panic!("{found:?}"));
    let diagram =
        explore::run(&System::of_plan(&study.model, &study.plan), &study.plan, 1, Diagram::default(), &Unobserved);
    (study.model, diagram)
}

fn branch<'d>(diagram: &'d Diagram, name: &str) -> &'d Branch {
    let found = diagram.branch(name).unwrap_or_else(|| panic!("no branch {name}: {:?}", diagram.shortfalls));
    assert!(!found.points.is_empty(), "{name}: {:?}", found.ends);
    found
}

/// Value of a quantity at a point.
#[track_caller]
fn value(model: &Model, point: &Point, name: &str) -> f64 {
    let quantity = Quantity::named(name, model).unwrap_or_else(|| panic!("no quantity {name}"));
    quantity.on(point, model).unwrap_or_else(|| panic!("{name} is undefined"))
}

/// Amplitude over force and phase lag in degrees of the linear oscillator.
fn response(omega: f64, zeta: f64) -> [f64; 2] {
    let (re, im) = (1.0 - omega * omega, 2.0 * zeta * omega);
    [1.0 / re.hypot(im), im.atan2(re).to_degrees()]
}

#[test]
fn amplitude_and_phase_of_the_linear_oscillator_are_exact() {
    let (model, diagram) = run(LINEAR, &format!("{FORCED}range = [0.2, 3]\n"));
    let mut worst = 0.0f64;
    for point in &branch(&diagram, "b").points {
        let omega = point.parameters[0];
        let [gain, lag] = response(omega, 0.1);
        let of = |name: &str| value(&model, point, name);
        let stated = point.trust.discretisation;
        worst = worst.max((of("x_h1") / (0.3 * gain) - 1.0).abs());
        assert!((of("x_h1") / (0.3 * gain) - 1.0).abs() < 3.0 * stated, "x_h1 at {omega}");
        assert!((of("x_h1_phase") - lag).abs() < 60.0 * 3.0 * stated, "phase at {omega}");
        // The velocity leads by a quarter of a period.
        let lead = of("x_h1_phase-v_h1_phase") - 90.0;
        assert!(lead.abs() < 60.0 * 3.0 * stated, "{lead} at {omega}");
        assert!((of("x_h1/force_h1") / gain - 1.0).abs() < 3.0 * stated);
        assert!((of("force_h1") - 0.3).abs() < 1e-9 && of("force_h1_phase").abs() < 1e-6);
        let transmitted = gain * 1f64.hypot(0.2 * omega);
        assert!((of("transmitted_h1/force_h1_dB") - 20.0 * transmitted.log10()).abs() < 10.0 * stated);
        // x² has the mean a²/2 and a second harmonic of that amplitude; x has neither a second nor a third one.
        let half = 0.5 * (0.3 * gain).powi(2);
        assert!((of("square_h2") / half - 1.0).abs() < 6.0 * stated && of("x_h2") < 1e-6 && of("x_h3") < 1e-6);
        assert_eq!(of("x_h1_2"), 0.0);
    }
    assert!(worst < 1e-9, "{worst:e}");
}

#[test]
fn peaks_of_the_linear_oscillator_are_where_its_resonances_are() {
    let line = "range = [0.2, 3]\npeaks = [\"x_max\", \"v_h1\", \"transmitted_h1/force_h1\", \"x_h1\"]\n";
    let (model, diagram) = run(LINEAR, &format!("{FORCED}{line}"));
    let found: Vec<(f64, String)> = branch(&diagram, "b")
        .special
        .iter()
        .map(|s| {
            assert_eq!(s.kind, Kind::Peak);
            (s.point.parameters[0], s.normal_form())
        })
        .collect();
    // Displacement: Ω² = 1 - 2ζ²; velocity: Ω = 1; transmitted force: Ω² = (√(1 + 8ζ²) - 1)/4ζ².
    let z = 0.1f64 * 0.1;
    let displacement = (1.0 - 2.0 * z).sqrt();
    let force = (((1.0 + 8.0 * z).sqrt() - 1.0) / (4.0 * z)).sqrt();
    for (expected, name) in
        [(displacement, "x_max"), (displacement, "x_h1"), (1.0, "v_h1"), (force, "transmitted_h1/force_h1")]
    {
        let near = |(at, text): &&(f64, String)| (at - expected).abs() < 1e-5 && text.contains(&format!(" {name} ="));
        let hit = found.iter().find(near).unwrap_or_else(|| panic!("{name} at {expected}: {found:?}"));
        assert!((hit.0 - expected).abs() < 2e-7, "{name}: {} against {expected}", hit.0);
        assert!(hit.1.starts_with("largest"), "{}", hit.1);
    }
    assert_eq!(found.len(), 4, "{found:?}");
    let top = branch(&diagram, "b").special.iter().find(|s| s.normal_form().contains(" x_max =")).unwrap();
    let exact = 0.3 / (2.0 * 0.1 * (1.0 - z).sqrt());
    assert!((value(&model, &top.point, "x_max") / exact - 1.0).abs() < 1e-7);
}

#[test]
fn peaks_are_found_only_if_asked_for_and_change_nothing_else() {
    let unmarked = |branch: &Branch| {
        let places: Vec<String> =
            branch.points.iter().map(|p| format!("{:?} {:?} {:?}", p.parameters, p.ranges, p.spectrum)).collect();
        places.join("\n")
    };
    let (_, plain) = run(LINEAR, &format!("{FORCED}range = [0.2, 3]\n"));
    let (_, asked) = run(LINEAR, &format!("{FORCED}range = [0.2, 3]\npeaks = [\"x_max\"]\n"));
    assert!(branch(&plain, "b").special.is_empty() && branch(&asked, "b").special.len() == 1);
    assert!(unmarked(branch(&plain, "b")) == unmarked(branch(&asked, "b")));
}

#[test]
fn an_antiresonance_is_a_smallest_value() {
    // Two masses; the first stands still where the second absorbs, at Ω² = k/m = 4, without damping of the absorber nearly.
    let model = "name = \"absorber\"\n[parameters]\nOmega = 0.5\n[forcing]\nfrequency = \"Omega\"\n[states]\nx = \"v\"\n\
        v = \"-x - 0.02*v - 0.4*(x - y) + cos(Omega*t)\"\ny = \"w\"\nw = \"-4*(y - x) - 0.002*(w - v)\"\n";
    let (_, diagram) = run(
        model,
        &format!("{FORCED}range = [1.5, 2.3]\n").replace("samples = 4", "parameters = { Omega = 1.5 }\nsamples = 4"),
    );
    assert!(branch(&diagram, "b").special.is_empty());
    let study = format!("{FORCED}range = [1.5, 2.3]\npeaks = \"x_h1\"\n");
    let (_, diagram) = run(model, &study.replace("samples = 4", "parameters = { Omega = 1.5 }\nsamples = 4"));
    let found: Vec<(f64, String)> =
        branch(&diagram, "b").special.iter().map(|s| (s.point.parameters[0], s.normal_form())).collect();
    let lowest = found.iter().find(|(_, text)| text.starts_with("smallest")).unwrap_or_else(|| panic!("{found:?}"));
    assert!((lowest.0 - 2.0).abs() < 1e-2, "{found:?}");
    // The same place by brute force: the harmonic solved exactly, its minimum by golden section.
    let amplitude = |w: f64| {
        use num_complex::Complex64 as C;
        let coupling = C::new(4.0, 0.002 * w);
        let lower = coupling - w * w;
        let (a, b) = (C::new(1.4 - w * w, 0.02 * w), C::new(0.4, 0.0));
        (1.0 / (a - b * coupling / lower)).norm()
    };
    let (mut low, mut high) = (1.9, 2.1);
    for _ in 0..200 {
        let (a, b) = (low + 0.382 * (high - low), low + 0.618 * (high - low));
        if amplitude(a) < amplitude(b) { high = b } else { low = a }
    }
    assert!((lowest.0 - low).abs() < 1e-6, "{} against {low}", lowest.0);
}

#[test]
fn a_whirl_has_signed_harmonics() {
    // z'' + 2ζz' + z = e^{iΩt} + ½ e^{-iΩt}: forward and backward whirl with the response of the linear oscillator.
    let model = "name = \"whirl\"\nwhirl = [\"x\", \"y\"]\n[parameters]\nOmega = 0.7\n[forcing]\nfrequency = \"Omega\"\n\
        [states]\nx = \"u\"\nu = \"-0.2*u - x + 1.5*cos(Omega*t)\"\ny = \"v\"\nv = \"-0.2*v - y + 0.5*sin(Omega*t)\"\n";
    let (model, diagram) = run(model, &format!("{FORCED}range = [0.5, 1.5]\n"));
    for point in &branch(&diagram, "b").points {
        let [gain, lag] = response(point.parameters[0], 0.1);
        let of = |name: &str| value(&model, point, name);
        assert!((of("whirl_h1") / gain - 1.0).abs() < 1e-6 && (of("whirl_h-1") / (0.5 * gain) - 1.0).abs() < 1e-6);
        assert!((of("x+iy_h1_phase") - lag).abs() < 1e-4 && (of("x+iy_h-1_phase") - lag).abs() < 1e-4);
        // Seen from the other side, forward is backward.
        assert!((of("y+ix_h-1") / gain - 1.0).abs() < 1e-6);
    }
}

/// Two masses with cubic springs; `reference/hbm.csv`, rows N2 (harmonic balance with 7 and 15 harmonics, equal to 1e-12).
#[test]
fn harmonics_of_two_masses_agree_with_harmonic_balance() {
    let model = "name = \"two\"\n[parameters]\nOmega = 0.8\n[forcing]\nfrequency = \"Omega\"\n[states]\nx = \"u\"\n\
        u = \"-x - 0.002*u - x^3 - 0.0453*(x - y) - 0.013*(u - v) - 0.0042*(x - y)^3 + 0.11*cos(Omega*t)\"\ny = \"v\"\n\
        v = \"-(0.0453*(y - x) + 0.013*(v - u) + 0.0042*(y - x)^3)/0.05\"\n";
    let study = format!("tolerance = 1e-9\ndegree = 5\n{FORCED}range = [0.8, 1.05]\nmark = {{ Omega = 1 }}\n");
    let (model, diagram) = run(model, &study);
    let mark = branch(&diagram, "b").special.iter().find(|s| s.kind == Kind::Mark).unwrap();
    let [x, y] = ["x_h1", "y_h1"].map(|name| value(&model, &mark.point, name));
    assert!((x / 0.575233549031 - 1.0).abs() < 1e-8, "{x}");
    assert!((y / 2.266928387051 - 1.0).abs() < 1e-8, "{y}");
}

/// Two masses, one with a stop; `reference/hbm.csv`, rows N3 (exact, by two matrix exponentials).
#[test]
fn harmonics_in_contact_agree_with_the_exact_solution() {
    let model = "name = \"stop\"\n[parameters]\nOmega = 0.62\n[forcing]\nfrequency = \"Omega\"\n[states]\nx = \"u\"\n\
        u = \"-(x - y) - 0.03*(u - v) - 100*max(x - 1, 0)\"\ny = \"v\"\n\
        v = \"-(y - x) - 0.03*(v - u) - y - 0.03*v + 0.1*cos(Omega*t)\"\n";
    let study = format!("tolerance = 1e-8\n{FORCED}range = [0.45, 0.63]\nmark = {{ Omega = 0.62 }}\n");
    let study = study.replace("samples = 4", "parameters = { Omega = 0.45 }\nsamples = 4");
    let (model, diagram) = run(model, &study);
    let all: Vec<[f64; 3]> = branch(&diagram, "b")
        .special
        .iter()
        .filter(|s| s.kind == Kind::Mark)
        .map(|s| ["x_h1", "y_h1", "x_max"].map(|name| value(&model, &s.point, name)))
        .collect();
    let exact = [0.9793439711, 0.667277973, 1.0180331548];
    let near = |found: &&[f64; 3]| (0..3).all(|k| (found[k] / exact[k] - 1.0).abs() < 1e-6);
    assert!(all.iter().find(near).is_some(), "{all:?}");
}

#[test]
fn a_doubled_cycle_has_a_harmonic_of_order_one_half() {
    // A pendulum whose pivot shakes at twice its frequency: the doubled cycle moves at half the forcing frequency.
    let model = "name = \"parametric\"\n[parameters]\nOmega = 2\ne = 0.3\n[forcing]\nfrequency = \"Omega\"\n[states]\n\
        x = \"v\"\nv = \"-0.1*v - (1 + e*cos(Omega*t))*x - x^3\"\n";
    let study = "[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nperiods = 2\nsamples = 8\n\
        [[branch]]\nname = \"b\"\nfrom = \"s\"\nfree = \"Omega\"\nrange = [1.9, 2.3]\n";
    let (model, diagram) = run(model, study);
    for point in &branch(&diagram, "b").points {
        let of = |name: &str| value(&model, point, name);
        assert_eq!(point.solution.forcing_periods(), 2);
        let x = point.ranges[0][1];
        assert!(of("x_h1") < 1e-5 && (of("x_h1_2") / x - 1.0).abs() < 0.1, "{} {x}", of("x_h1_2"));
        // Parseval: the harmonics of orders 1/2 and 3/2 make up the mean square, up to a small fifth.
        let square = 0.5 * (of("x_h1_2").powi(2) + of("x_h3_2").powi(2) + of("x_h5_2").powi(2));
        assert!((of("x_rms").powi(2) / square - 1.0).abs() < 1e-5);
    }
}

#[test]
fn phases_are_marked_and_end_branches() {
    let lines = "range = [0.2, 3]\nmark = { x_h1_phase = [45, 135] }\nstop = { v_h1_phase = 45 }\n";
    let (_, diagram) = run(LINEAR, &format!("{FORCED}{lines}"));
    let own = branch(&diagram, "b");
    let places: Vec<f64> = own.special.iter().map(|s| s.point.parameters[0]).collect();
    // tan φ = 2ζΩ/(1 - Ω²) = ±1; the velocity lags by 45° where the displacement lags by 135°.
    let [first, last] = [-0.1, 0.1].map(|z: f64| z + (1.0 + z * z).sqrt());
    assert!((places[0] - first).abs() < 1e-8, "{places:?} {first}");
    assert!(places[1..].iter().all(|at| (at - last).abs() < 1e-8) && places.len() >= 2, "{places:?} {last}");
    assert!(own.ends.iter().flatten().any(|end| end.code() == "asked"), "{:?}", own.ends);
}
