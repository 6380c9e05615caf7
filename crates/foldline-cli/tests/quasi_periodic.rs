//! Quasi-periodic motion in simulations, tori from it, held rotation numbers, and two forcing frequencies.

use foldline::attractors::{Limits, Sampling, Trial, stepped_sweep, survey_by_simulation};
use foldline::contract::{Batch, Parameters, Unobserved, VectorField, Verdict};
use foldline::diagram::{Branch, Diagram, Family, Kind, Motion, Point, Response, Solution, Torus};
use foldline::explore::{self, System};
use foldline::model::Model;
use foldline_store::model_file::parse_model;
use foldline_store::study_file::{Study, parse_study};
use std::f64::consts::TAU;
use std::path::Path;

fn text_of(model: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models").join(format!("{model}.toml"));
    std::fs::read_to_string(path).unwrap()
}

#[track_caller]
fn of(model: &str, study: &str) -> (Study, Diagram) {
    let text = format!("model = \"m\"\n{study}");
    let study = parse_study(&text, "study", &text_of(model), "model").unwrap_or_else(|found| panic!("{found:?}"));
    let system = System::of_plan(&study.model, &study.plan);
    let diagram = explore::run(&system, &study.plan, 1, Diagram::default(), &Unobserved);
    drop(system);
    (study, diagram)
}

fn torus(point: &Point) -> &Torus {
    let Solution::Torus(torus) = &point.solution else { panic!("no torus") };
    torus
}

fn parsed(text: &str) -> Model {
    parse_model(text, "m.toml").unwrap_or_else(|found| panic!("{found:?}"))
}

/// The motion to which one trajectory leads.
fn motion(model: &Model, parameters: &[f64], start: &[f64]) -> Response {
    let system = System::of(model, parameters);
    let trial = Trial { field: model, scales: &system.scales, whirl: None, jobs: 1, limits: Limits::patient() };
    let value = parameters[0];
    stepped_sweep(&trial, parameters, 0, &[value], start, &mut |_, _| None, &|_| Verdict::Continue).pop().unwrap()
}

const VAN_DER_POL: &str = "van-der-pol-forced";

#[test]
fn a_torus_is_named_with_its_rotation_number() {
    let model = parsed(&text_of(VAN_DER_POL));
    // tori.csv: second frequencies 0.993143980118 and 1.051724203161 at W = 1.2.
    for (s, frequency) in [(0.3, 0.993143980118), (0.7, 1.051724203161)] {
        let found = motion(&model, &[s, 1.2, 0.5], &[1.0, 0.3]);
        assert_eq!(found.motion, Motion::Torus, "{found:?}");
        let [rotation, error] = found.recognition.rotation.unwrap();
        let known = 1.0 - frequency / 1.2;
        assert!((rotation - known).abs() <= 3.0 * error + 1e-10 && error < 1e-7, "{rotation} ± {error}, {known}");
        let [exponent, doubt] = found.recognition.exponent.unwrap();
        assert!(exponent.abs() <= 2.0 * doubt, "{exponent} ± {doubt}");
    }
    assert_eq!(motion(&model, &[0.9, 1.2, 0.5], &[1.0, 0.3]).motion, Motion::Cycle);
}

#[test]
fn chaos_has_a_positive_exponent() {
    // The Lorenz system: sprott2003 gives the exponent 0.9056.
    let lorenz = "[parameters]\nr = 28\n[states]\nx = { equation = \"10*(y - x)\", range = [-20, 20] }\n\
                  y = { equation = \"x*(r - z) - y\", range = [-20, 20] }\nz = { equation = \"x*y - 8/3*z\", range = [0, 40] }\n";
    let found = motion(&parsed(lorenz), &[28.0], &[1.0, 2.0, 20.0]);
    assert_eq!(found.motion, Motion::Chaos, "{found:?}");
    let [exponent, error] = found.recognition.exponent.unwrap();
    assert!((exponent - 0.9056).abs() < error && error < 0.1, "{exponent} ± {error}");
    // At r = 33 and 36, from 24 trajectories of 333 time units by the classical Runge-Kutta method, h = 0.005: ± 0.003 both.
    for (r, expected) in [(33.0, 1.013), (36.0, 1.070)] {
        let found = motion(&parsed(lorenz), &[r], &[1.0, 2.0, 20.0]);
        let [exponent, error] = found.recognition.exponent.unwrap();
        assert!((exponent - expected).abs() < error + 0.003, "{r}: {exponent} ± {error}");
    }
    // The logistic map at r = 4: ln 2.
    let logistic = "[parameters]\nr = 4\n[states]\nx = { range = [0, 1] }\n[map]\nx = \"r*x*(1 - x)\"\n";
    let found = motion(&parsed(logistic), &[3.9999], &[0.3]);
    assert_eq!(found.motion, Motion::Chaos, "{found:?}");
    let [exponent, error] = found.recognition.exponent.unwrap();
    assert!((exponent - 2f64.ln()).abs() < error + 0.02, "{exponent} ± {error}");
}

/// The rotation number of the phase-locked loop theta' = w + k sin(theta) sampled through a circle map with amplitude and
/// phase: locked motions of any ratio.
fn circle_map(omega: f64, k: f64) -> String {
    format!(
        "[parameters]\nomega = {omega}\nk = {k}\n[states]\nu = {{ range = [-2, 2] }}\nv = {{ range = [-2, 2] }}\n\
         [definitions]\nr = \"sqrt(u^2 + v^2)\"\nturned = \"2*pi*omega - k*v/r\"\nlonger = \"(1 + (r - 1)/2)/r\"\n\
         [map]\nu = \"longer*(u*cos(turned) - v*sin(turned))\"\nv = \"longer*(u*sin(turned) + v*cos(turned))\"\n"
    )
}

/// Rotation number of the circle map by its own iteration, and the smallest period at which it repeats, if any.
fn independent(omega: f64, k: f64) -> (f64, Option<usize>) {
    let (mut theta, transient, count) = (0.3f64, 400_000usize, 200_000usize);
    let step = |theta: f64| theta + omega - k * (TAU * theta).sin() / TAU;
    for _ in 0..transient {
        theta = step(theta.fract());
    }
    let start = theta.fract();
    let mut now = start;
    let mut period = None;
    for j in 1..=count {
        now = step(now);
        let off = (now - start).rem_euclid(1.0);
        if period.is_none() && off.min(1.0 - off) < 1e-9 && j <= 2000 {
            period = Some(j);
        }
    }
    ((now - start) / count as f64, period)
}

#[test]
fn locked_motion_is_never_called_a_torus() {
    let mut seed = 12345u64;
    let mut random = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    let (mut tori, mut cycles, mut undecided) = (0, 0, 0);
    for case in 0..24 {
        // Within tongues of ratios p/q, next to their edges, and anywhere.
        let (k, q) = (0.3 + 0.6 * random(), 1 + (random() * 12.0) as usize);
        let ratio = (random() * q as f64).round() / q as f64;
        let width = k.powi(q as i32) / TAU;
        let omega = match case % 3 {
            0 => (ratio + width * (2.0 * random() - 1.0)).clamp(0.02, 0.98),
            _ => random(),
        };
        let found = motion(&parsed(&circle_map(omega, k)), &[omega, k], &[0.6, 0.9]);
        let (rotation, period) = independent(omega, k);
        match found.motion {
            Motion::Torus => {
                tori += 1;
                assert_eq!(period, None, "locked: {omega} {k} {rotation} {found:?}");
                let [own, error] = found.recognition.rotation.unwrap();
                let off = |sign: f64| {
                    let turns = sign * own - rotation;
                    (turns - turns.round()).abs()
                };
                // The independent average has an error of one turn over its length.
                assert!(off(1.0).min(off(-1.0)) < 1e-5 + error, "{own} {rotation}");
            }
            Motion::Cycle => {
                cycles += 1;
                let own = found.period.unwrap().round() as usize;
                assert_eq!(period, Some(own), "{omega} {k} {found:?}");
            }
            Motion::Other => undecided += 1,
            other => panic!("{other:?} {omega} {k}"),
        }
    }
    assert!(tori >= 7 && cycles >= 5 && undecided <= 2, "{tori} tori, {cycles} cycles, {undecided} undecided");
}

#[test]
fn surveys_count_tori_once() {
    let model = parsed(&text_of(VAN_DER_POL));
    let system = System::of(&model, &[0.3, 1.2, 0.5]);
    let trial = Trial { field: &model, scales: &system.scales, whirl: None, jobs: 1, limits: Limits::patient() };
    let sampling = Sampling {
        ranges: vec![[-3.0, 3.0]; 2],
        scales: system.scales.clone(),
        whirl: None,
        samples: 3,
        seed: 1,
        jobs: 1,
        tolerance: 1e-6,
        limits: Limits::patient(),
        given: None,
    };
    let found = survey_by_simulation(&trial, &sampling, &[0.3, 1.2, 0.5], 0, &[0.3], &|_| Verdict::Continue);
    assert_eq!((found.len(), found[0].motion, found[0].hits), (1, Motion::Torus, 3), "{found:?}");
}

#[test]
fn a_torus_met_by_simulation_starts_a_branch_and_its_rotation_can_be_held() {
    let (_, diagram) = of(
        VAN_DER_POL,
        "[[seed]]\nname = \"met\"\nattractor = \"torus\"\nparameters = { s = 0.3, Omega = 1.2 }\nsamples = 4\n\
         [[branch]]\nname = \"free\"\nfrom = \"met\"\nfree = \"s\"\nrange = [0.25, 0.35]\n\
         [[branch]]\nname = \"held\"\nfrom = \"met\"\nfree = [\"s\", \"Omega\"]\nhold = \"rotation\"\n\
         range = { s = [0.05, 0.7], Omega = [1, 2] }\n",
    );
    let free = diagram.branch("free").unwrap();
    let start = free.points.iter().find(|p| p.position == 0).unwrap();
    let held = diagram.branch("held").unwrap();
    assert_eq!((free.family, held.family), (Family::Torus, Family::Torus));
    // tori.csv: second frequency 0.993143980118, largest |x| 2.2208882.
    let off = torus(start).rotation - (1.0 - 0.993143980118 / 1.2);
    assert!(off.abs() < 1e-9, "{off}");
    assert!((start.ranges[0][1] - 2.2208882).abs() < 2e-6);
    assert!(held.points.len() > 5);
    // The simulated rotation number is held, which agrees with the solved one within its error.
    let value = torus(&held.points[0]).rotation;
    assert!((value - torus(start).rotation).abs() < 1e-9);
    for point in &held.points {
        assert!((torus(point).rotation - value).abs() < 1e-12, "{} {value}", torus(point).rotation);
    }
    let ends: Vec<f64> = held.points.iter().map(|p| p.parameters[0]).collect();
    let [low, high] = ends.iter().fold([f64::MAX, f64::MIN], |[a, b], s| [a.min(*s), b.max(*s)]);
    assert!((low - 0.05).abs() < 1e-9 && (high - 0.7).abs() < 1e-9, "{ends:?}");
    // Without force the second frequency is that of the oscillator itself, 0.98484 for mu = 0.5, so that Omega is known.
    let first = held.points.iter().min_by(|a, b| a.parameters[0].total_cmp(&b.parameters[0])).unwrap();
    let own = (1.0 - torus(start).rotation) * first.parameters[1];
    assert!((own - 0.98484).abs() < 2e-3, "{own}");
}

#[test]
fn the_response_of_a_linear_oscillator_to_two_tones_is_the_closed_form() {
    let (study, diagram) = of(
        "two-tones",
        "[[seed]]\nname = \"both\"\nattractor = \"torus\"\nparameters = { phase_2 = 0.2 }\n\
         [[branch]]\nname = \"tori\"\nfrom = \"both\"\nfree = \"nu\"\nrange = [0.9, 1.4]\n",
    );
    let branch: &Branch = diagram.branch("tori").unwrap();
    assert!(branch.points.len() > 5 && branch.special.is_empty());
    for point in &branch.points {
        let [d, f1, f2, w, nu] = [0, 1, 2, 3, 4].map(|k| point.parameters[k]);
        let torus = torus(point);
        assert!((torus.rotation - nu / w).abs() < 1e-12 && (torus.period - TAU / w).abs() < 1e-12);
        let response = |force: f64, w: f64| {
            let (re, im) = (1.0 - w * w, 2.0 * d * w);
            (force / re.hypot(im), im.atan2(re))
        };
        let ((a1, p1), (a2, p2)) = (response(f1, w), response(f2, nu));
        let stated = point.trust.discretisation * 3.0;
        for (turns, t) in [(0.0, 0.0), (0.3, 0.4), (0.81, 0.77)] {
            let x = torus.state(turns, t)[0];
            let time = t * torus.period;
            let known = a1 * (w * time - p1).cos() + a2 * (nu * time + TAU * (turns + 0.2) - p2).cos();
            assert!((x - known).abs() <= stated + 1e-9, "{x} {known} {stated}");
        }
        assert!((point.ranges[0][1] - a1 - a2).abs() < 1e-6, "{:?} {}", point.ranges, a1 + a2);
        // Exponents -D, twice.
        for z in point.free_spectrum() {
            assert!((z.norm().ln() / torus.period + d).abs() < 1e-6, "{z}");
        }
    }
    drop(study);
}

#[test]
fn tori_of_a_duffing_oscillator_under_two_tones_agree_with_independent_ones() {
    let (_, diagram) = of(
        "duffing-two-tones",
        "[[seed]]\nname = \"both\"\nattractor = \"torus\"\n\
         [[branch]]\nname = \"tori\"\nfrom = \"both\"\nfree = \"eta\"\nrange = [1.3, 2.1]\nmark = { eta = 1.4 }\n\
         max-points = 20\n",
    );
    let branch = diagram.branch("tori").unwrap();
    // Root mean square by a weighted average of a trajectory of 4000 time units, DOP853 at 1e-10.
    let start = branch.points.iter().find(|p| p.position == 0).unwrap();
    assert!((start.averages[0][1].sqrt() - 0.0642016581307).abs() < 1e-8, "{:?}", start.averages);
    // tori.csv, A6-1.4 and A6-fold1.
    let marks: Vec<&Point> = branch.special.iter().filter(|s| s.kind == Kind::Mark).map(|s| &s.point).collect();
    let low = marks.iter().min_by(|a, b| a.ranges[0][1].total_cmp(&b.ranges[0][1])).unwrap();
    assert!((low.ranges[0][1] - 0.367845).abs() < 1e-4, "{:?}", low.ranges);
    let folds = branch.special.iter().filter(|s| s.kind == Kind::Fold);
    let off = folds.map(|s| (s.point.parameters[4] - 1.33761762053).abs()).fold(f64::INFINITY, f64::min);
    assert!(off < 1e-8, "{off}");
}

#[test]
fn two_tones_are_simulated_with_both_phases() {
    let model = parsed(&text_of("two-tones"));
    let phase = model.second_phase().unwrap();
    let mut parameters = model.defaults();
    let at = |parameters: &[f64], time: f64| {
        let mut f = [0.0; 2];
        let batch = Batch {
            lanes: 1,
            states: &[0.0, 0.0],
            parameters: Parameters::Shared(parameters),
            times: &[time],
            signs: &[],
        };
        model.evaluate(batch, &mut f);
        f[1] / model.time_unit(parameters)
    };
    parameters[phase] = 0.25;
    let t = 7.3 * model.time_unit(&parameters);
    let known = (0.7 * t).cos() + 0.5 * (1.3 * t + 0.25 * TAU).cos();
    assert!((at(&parameters, 7.3) - known).abs() < 1e-12);
    let (turns, slopes) = model.second_turns(&parameters);
    assert!((turns - 1.3 / 0.7).abs() < 1e-14);
    assert!((slopes[4] - 1.0 / 0.7).abs() < 1e-12 && (slopes[3] + 1.3 / 0.49).abs() < 1e-12, "{slopes:?}");
}

#[test]
fn mistakes_with_two_frequencies_and_tori_have_cause_and_cure() {
    let told = |text: &str| -> String {
        let found = parse_model(text, "m.toml").err().unwrap_or_default();
        found.iter().map(|own| format!("{} / {}\n", own.message, own.hint.as_deref().unwrap_or_default())).collect()
    };
    let body = |equation: &str| {
        format!(
            "[parameters]\nw = 1\n[forcing]\nfrequencies = [\"w\", \"sqrt(2)*w\"]\n[states]\nx = {{ equation = \"{equation}\", range = \
             [-1, 1] }}\n"
        )
    };
    let said = told(&body("-x + cos(w*t)*cos(2*w*t2)"));
    assert!(said.contains("does not repeat when `t2` grows"), "{said}");
    let said = told(&body("-x + cos(w*t2)"));
    assert!(said.contains("second forcing"), "{said}");
    let said = told("[parameters]\nw = 1\n[forcing]\nfrequencies = [\"w\"]\n[states]\nx = \"-x\"\n");
    assert!(said.contains("give two"), "{said}");
    let study = |model: &str, text: &str| -> String {
        let text = format!("model = \"m\"\n{text}");
        let found = parse_study(&text, "study", &text_of(model), "model").err().unwrap_or_default();
        found.iter().map(|own| format!("{} / {}\n", own.message, own.hint.as_deref().unwrap_or_default())).collect()
    };
    let branch = "[[branch]]\nname = \"b\"\nfrom = \"a\"\nfree = \"nu\"\nrange = [1, 2]\n";
    let said = study("two-tones", &format!("[[seed]]\nname = \"a\"\nattractor = \"cycle\"\n{branch}"));
    assert!(said.contains("the response is a torus") && said.contains("attractor = \"torus\""), "{said}");
    let seed = "[[seed]]\nname = \"a\"\nattractor = \"torus\"\n";
    let said = study("two-tones", &format!("{seed}{branch}[[survey]]\nname = \"s\"\nfree = \"nu\"\nrange = [1, 2]\n"));
    assert!(said.contains("`survey` is not supported"), "{said}");
    let held = "[[branch]]\nname = \"b\"\nfrom = \"a\"\nfree = [\"s\", \"Omega\"]\nrange = [0, 1]\n";
    let said = study(VAN_DER_POL, &format!("{seed}{held}hold = \"x_max\"\n"));
    assert!(said.contains("cannot be held along tori"), "{said}");
    let cycle = "[[seed]]\nname = \"a\"\nattractor = \"cycle\"\n";
    let said = study(VAN_DER_POL, &format!("{cycle}{held}hold = \"rotation\"\n"));
    assert!(said.contains("only tori have a rotation number"), "{said}");
}
