//! Time per lane of the rotor as text and written by hand:
//! `cargo run --release -p foldline-rotor --example field_speed`.
//!
//! Each row is the best of many repetitions, in nanoseconds per lane.

use foldline::contract::{Batch, Parameters, VectorField};
use foldline_rotor::OverhungRotor;
use foldline_store::model_file::read_model;
use std::hint::black_box;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

/// Best time of `run` over the number of lanes, in nanoseconds.
fn nanoseconds(lanes: usize, mut run: impl FnMut()) -> f64 {
    let times = 200_000 / lanes;
    let mut best = f64::INFINITY;
    for _ in 0..20 {
        let start = Instant::now();
        (0..times).for_each(|_| run());
        best = best.min(start.elapsed().as_secs_f64() * 1e9 / (times * lanes) as f64);
    }
    best
}

/// Times of f, of f with its Jacobian in states and Ω, of outputs, and of a second derivative.
fn speeds(field: &dyn VectorField, states: &[f64], parameters: &[f64]) -> [f64; 4] {
    let lanes = states.len() / 4;
    let at = Batch { lanes, states, parameters: Parameters::Shared(parameters), times: &[], signs: &[] };
    let (mut f, mut fx, mut fp) = (vec![0.0; 4 * lanes], vec![0.0; 16 * lanes], vec![0.0; 4 * lanes]);
    let direction: Vec<f64> = (0..13 * lanes).map(|i| if i < 4 * lanes { (i as f64).cos() } else { 0.0 }).collect();
    let mut r = vec![0.0; lanes];
    [
        nanoseconds(lanes, || field.evaluate(black_box(at), &mut f)),
        nanoseconds(lanes, || field.linearise(black_box(at), &[0], &mut f, &mut fx, &mut fp)),
        nanoseconds(lanes, || field.outputs(black_box(at), &mut r)),
        nanoseconds(lanes, || field.directional(black_box(at), &[&direction, &direction], &mut f)),
    ]
}

fn main() -> ExitCode {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/overhung-rotor.toml");
    let text = match read_model(&path) {
        Ok((model, _)) => model,
        Err(found) => {
            found.iter().for_each(|mistake| eprintln!("{mistake}"));
            return ExitCode::FAILURE;
        }
    };
    println!("kappa  lanes  field         f  f and Jacobian  outputs  second derivative   (ns per lane)");
    for kappa in [0.0, 1.0] {
        let mut parameters = text.defaults();
        parameters[1] = kappa;
        for lanes in [8, 100, 400, 1600] {
            let states: Vec<f64> = (0..4 * lanes).map(|i| 1.5 * (i as f64 * 0.7).sin()).collect();
            let fields: [(&str, &dyn VectorField); 2] = [("text", &text), ("by hand", &OverhungRotor::default())];
            for (name, field) in fields {
                let [f, linear, outputs, second] = speeds(field, &states, &parameters);
                println!("{kappa:5}  {lanes:5}  {name:7}  {f:6.2}  {linear:14.2}  {outputs:7.2}  {second:17.2}");
            }
        }
    }
    ExitCode::SUCCESS
}
