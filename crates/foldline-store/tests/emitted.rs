//! The emitted source of an ensemble, compiled by the C compiler of the machine, against the ensemble itself.
//!
//! Without contraction of products and sums (`-ffp-contract=off`) the text performs the operations of the tape and of
//! the ensemble in their order: steps and states must agree to the bit, except for functions of the C library.

use foldline::contract::VectorField;
use foldline::emitted::{Emitted, Fate, HOST, Parts};
use foldline::model::Model;
use foldline::simulation::{Arrival, Clocked, Ensemble, Outcome, Tolerance};
use foldline_store::model_file::{parse_model, read_model};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn model(name: &str) -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models").join(name);
    read_model(&path).unwrap().0
}

/// The compiler, or `None` with a note where the machine has none.
fn compiler() -> Option<&'static str> {
    let found = Command::new("cc").arg("--version").stdout(Stdio::null()).status().is_ok();
    if !found {
        eprintln!("not checked: there is no C compiler `cc`");
    }
    found.then_some("cc")
}

/// A job as the program of the host reads it.
#[derive(Clone, Default)]
struct Job {
    span: [f64; 2],
    tolerance: f64,
    limit: f64,
    parameters: Vec<f64>,
    /// `[count][n]`
    starts: Vec<f64>,
    /// `[count][k]`
    own: Vec<f64>,
    plane: Vec<f64>,
    level: f64,
    strobe: f64,
    direction: i64,
    records: usize,
}

struct Results {
    states: Vec<f64>,
    times: Vec<f64>,
    fates: Vec<Fate>,
    steps: Vec<usize>,
    rejected: Vec<usize>,
    crossings: Vec<usize>,
    recorded: Vec<f64>,
    recorded_at: Vec<f64>,
}

/// `[count][m]` as `[m][count]`.
fn across(rows: &[f64], m: usize) -> Vec<f64> {
    let count = rows.len() / m.max(1);
    (0..rows.len()).map(|at| rows[at % count * m + at / count]).collect()
}

fn program(emitted: &Emitted, compiler: &str, name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("foldline-emitted-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let (source, program) = (folder.join("ensemble.c"), folder.join("ensemble"));
    std::fs::write(&source, format!("{}{HOST}", emitted.source)).unwrap();
    let out = Command::new(compiler)
        .args(["-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-o"])
        .args([&program, &source])
        .arg("-lm")
        .output()
        .unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    program
}

fn run(model: &Model, parts: Parts, job: &Job, name: &str) -> Option<Results> {
    let emitted = Emitted::new(model, parts).unwrap();
    let n = emitted.states;
    let program = program(&emitted, compiler()?, name);
    let count = job.starts.len() / n;
    let mut bytes: Vec<u8> = Vec::new();
    let sizes = [count as i64, 0, 0, job.records as i64, job.direction, 0];
    sizes.iter().for_each(|size| bytes.extend(size.to_ne_bytes()));
    let head = [job.span[0], job.span[1], 1e100, job.limit, job.tolerance, job.level, job.strobe];
    let mut plane = job.plane.clone();
    plane.resize(n, 0.0);
    let mut numbers = [&head[..], &vec![job.tolerance; n], &plane, &job.parameters].concat();
    numbers.extend(across(&job.starts, n));
    if parts.own_parameters {
        numbers.extend(across(&job.own, job.parameters.len()));
    }
    numbers.iter().for_each(|x| bytes.extend(x.to_ne_bytes()));
    let mut child = Command::new(&program).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    let writer = std::thread::spawn(move || input.write_all(&bytes));
    let out = child.wait_with_output().unwrap();
    writer.join().unwrap().unwrap();
    assert!(out.status.success());
    let found: Vec<f64> = out.stdout.chunks_exact(8).map(|b| f64::from_ne_bytes(b.try_into().unwrap())).collect();
    let (states, rest) = found.split_at(n * count);
    let mut parts = rest.chunks(count);
    let mut next = || parts.next().unwrap_or(&[]).to_vec();
    let whole = |values: Vec<f64>| -> Vec<usize> { values.iter().map(|x| *x as usize).collect() };
    let times = next();
    let fates = next().iter().map(|x| Fate::of(*x as i32).unwrap()).collect();
    let (steps, rejected) = (whole(next()), whole(next()));
    next();
    let crossings = whole(next());
    let rest: Vec<f64> = std::iter::from_fn(|| parts.next()).flatten().copied().collect();
    let (recorded, recorded_at) = rest.split_at(rest.len() / (n + 1) * n);
    let _ = std::fs::remove_dir_all(program.parent().unwrap());
    let (recorded, recorded_at) = (recorded.to_vec(), recorded_at.to_vec());
    Some(Results { states: states.to_vec(), times, fates, steps, rejected, crossings, recorded, recorded_at })
}

/// Starts spread over a box, without repetition.
fn spread(count: usize, ranges: &[[f64; 2]]) -> Vec<f64> {
    let golden = |k: usize, i: usize| (0.5 + (k + 1) as f64 * (i as f64 + 2.0).sqrt()).fract();
    (0..count).flat_map(|k| ranges.iter().enumerate().map(move |(i, [a, b])| a + golden(k, i) * (b - a))).collect()
}

fn fate(arrival: &Arrival) -> Fate {
    match arrival.outcome {
        Outcome::Reached => Fate::Reached,
        Outcome::Stopped => Fate::Stopped,
        Outcome::Escaped => Fate::Escaped,
        Outcome::Undefined => Fate::Undefined,
        Outcome::StepTooSmall => Fate::StepTooSmall,
        Outcome::StepLimit => Fate::StepLimit,
        Outcome::Chatter => panic!("models with events are not emitted"),
    }
}

/// Asserts that all trajectories take the same steps to the same states, to `room` relative to 1 + |x|; 0 for the bit.
fn agree(found: &Results, arrivals: &[Arrival], room: f64) {
    let count = arrivals.len();
    for (c, arrival) in arrivals.iter().enumerate() {
        assert_eq!(found.fates[c], fate(arrival), "trajectory {c}");
        assert_eq!((found.steps[c], found.rejected[c]), (arrival.steps, arrival.rejected), "trajectory {c}");
        assert!((found.times[c] - arrival.time).abs() <= room * arrival.time.abs(), "trajectory {c}");
        for (i, x) in arrival.state.iter().enumerate() {
            let own = found.states[i * count + c];
            assert!((own - x).abs() <= room * (1.0 + x.abs()), "trajectory {c}, state {i}: {own} against {x}");
        }
    }
}

fn compared(model: &Model, job: &Job, parts: Parts, room: f64, name: &str) {
    let Some(found) = run(model, parts, job, name) else { return };
    let clocked = Clocked(model);
    let field: &dyn VectorField = if model.forced() { &clocked } else { model };
    let tolerance = Tolerance::uniform(job.tolerance, field.dim());
    let ensemble = match parts.own_parameters {
        true => Ensemble::with_own_parameters(field, &job.own, tolerance, &job.starts, job.span),
        false => Ensemble::new(field, &job.parameters, tolerance, &job.starts, job.span),
    };
    agree(&found, &ensemble.with_step_limit(job.limit as usize).arrive(), room);
}

const ROTOR: [[f64; 2]; 4] = [[-5.0, 5.0], [-5.0, 5.0], [-15.0, 15.0], [-15.0, 15.0]];

fn rotor(model: &Model) -> Job {
    let mut parameters = model.defaults();
    parameters[1] = 1.0;
    Job { span: [0.0, 20.0], tolerance: 1e-6, limit: 1e9, parameters, starts: spread(200, &ROTOR), ..Job::default() }
}

#[test]
fn the_contact_rotor_takes_the_steps_of_the_ensemble_to_the_bit() {
    let model = model("overhung-rotor.toml");
    let job = rotor(&model);
    compared(&model, &job, Parts::default(), 0.0, "rotor");
    let backwards = Job { span: [0.0, -0.5], limit: 50.0, ..job.clone() };
    compared(&model, &backwards, Parts::default(), 0.0, "rotor-backwards");
    let own = (0..200).flat_map(|c| {
        let mut own = job.parameters.clone();
        own[0] = 2.0 + 0.02 * f64::from(c);
        own
    });
    let job = Job { own: own.collect(), ..job };
    compared(&model, &job, Parts { own_parameters: true, ..Parts::default() }, 0.0, "rotor-own");
}

#[test]
fn switching_surfaces_are_located_at_the_same_instants() {
    let model = model("overhung-rotor-piecewise.toml");
    assert!(model.switch_count() > 0);
    compared(&model, &rotor(&model), Parts::default(), 0.0, "piecewise");
}

/// The sine is that of the C library in both; where two versions of it differ in the last bit, trajectories of a forced
/// pendulum separate by rounding times the growth of differences.
#[test]
fn a_forced_model_has_its_time_as_a_state() {
    let model = model("duffing-forced.toml");
    assert!(model.forced());
    let starts = spread(100, &[[-2.0, 2.0], [-2.0, 2.0]]);
    let starts = starts.chunks(2).flat_map(|x| [x[0], x[1], 0.0]).collect();
    let parameters = model.defaults();
    let job = Job { span: [0.0, 5.0], tolerance: 1e-6, limit: 1e9, parameters, starts, ..Job::default() };
    compared(&model, &job, Parts::default(), 1e-12, "forced");
}

#[test]
fn every_function_of_the_language_is_emitted() {
    let text = r#"
        name = "all */ functions"
        [parameters]
        p = { value = 0.4 }
        n = { value = 3.0 }
        [states.x]
        equation = "-x + 0.1*(sin(y) + cos(p*x) + tan(0.3*x) + exp(-y^2) + log(2 + x^2) + sqrt(1 + x^2) + tanh(x*y) + atan(x) + atan2(y, 2 + x^2))"
        [states.y]
        equation = "-y + 0.1*(asin(0.1*x/(1 + x^2)) + acos(0.1*y/(1 + y^2)) + sinh(0.1*x) + cosh(0.1*y) + hypot(x, y) + (1 + x^2)^p + x^5 + 1/(1 + y^2)^3 + expm1(-x^2) + log1p(x^2) + log10(2 + x^2) + log2(2 + y^2))"
        [states.z]
        equation = "-z + abs(x) + max(x, p*y) + min(y, 0.2) + sign(y - 0.1) + heaviside(x - 0.3) + if(x < y, x, y) + 0.1*floor(2*x + 0.2) + cbrt(2 + x) + asinh(y) + acosh(2 + x^2) + atanh(0.1*tanh(y))"
    "#;
    let model = parse_model(text, "all.toml").unwrap();
    let parameters = model.defaults();
    let starts = spread(60, &[[-2.0, 2.0], [-2.0, 2.0], [-1.0, 1.0]]);
    let job = Job { span: [0.0, 3.0], tolerance: 1e-6, limit: 1e6, parameters, starts, ..Job::default() };
    compared(&model, &job, Parts::default(), 1e-11, "all");
}

/// A harmonic oscillator crosses y = 0 upwards at the times 2πk after its start at y < 0 of phase φ; recorded states
/// are located to the accuracy of the integration.
#[test]
fn crossings_are_recorded_at_their_instants() {
    let text = "name = \"circle\"\n[states.x]\nequation = \"-y\"\n[states.y]\nequation = \"x\"\n";
    let model = parse_model(text, "circle.toml").unwrap();
    let phases: Vec<f64> = (0..20).map(|c| -2.8 + 0.13 * f64::from(c)).collect();
    let starts = phases.iter().flat_map(|phase| [phase.cos(), phase.sin()]).collect();
    let job = Job {
        span: [0.0, 100.0],
        tolerance: 1e-10,
        limit: 1e9,
        starts,
        plane: vec![0.0, 1.0],
        direction: 1,
        records: 3,
        ..Job::default()
    };
    let parts = Parts { section: true, ..Parts::default() };
    let Some(found) = run(&model, parts, &job, "section") else { return };
    let strobe = Job { strobe: 0.7, records: 5, ..job };
    let Some(at_times) = run(&model, parts, &strobe, "strobe") else { return };
    for (c, phase) in phases.iter().enumerate() {
        assert_eq!((found.fates[c], found.crossings[c]), (Fate::Stopped, 3));
        for k in 0..3 {
            let (x, y) = (found.recorded[2 * k * 20 + c], found.recorded[(2 * k + 1) * 20 + c]);
            // The error grows by a few tolerances per revolution.
            assert!((x - 1.0).abs() < 1e-7 && y.abs() < 1e-13, "{x} {y}");
            let time = -phase + std::f64::consts::TAU * k as f64;
            assert!((found.recorded_at[k * 20 + c] - time).abs() < 1e-7);
        }
        for k in 0..5 {
            let angle = phase + 0.7 * (k + 1) as f64;
            let (x, y) = (at_times.recorded[2 * k * 20 + c], at_times.recorded[(2 * k + 1) * 20 + c]);
            assert!((x - angle.cos()).abs() < 1e-8 && (y - angle.sin()).abs() < 1e-8);
        }
    }
}

/// A mass on a belt slides; the source does not follow it but says so, at the state where it begins.
#[test]
fn a_trajectory_that_begins_to_slide_ends_there() {
    let text = "name = \"friction\"\n[states.x]\nequation = \"v\"\n[states.v]\nequation = \"-x - 2*sign(v)\"\n";
    let model = parse_model(text, "friction.toml").unwrap();
    let job = Job { span: [0.0, 50.0], tolerance: 1e-8, limit: 1e6, starts: vec![5.0, 0.5], ..Job::default() };
    let Some(found) = run(&model, Parts::default(), &job, "slides") else { return };
    assert_eq!(found.fates, [Fate::Slides]);
    // At rest within the reach of dry friction.
    assert!(found.states[0].abs() <= 2.0 && found.states[1].abs() < 1e-12, "{:?}", found.states);
}

#[test]
fn a_map_is_refused() {
    let refused = Emitted::new(&model("henon.toml"), Parts::default()).unwrap_err();
    assert!(refused.to_string().contains("map"));
}
