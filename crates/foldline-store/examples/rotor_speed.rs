//! Times to read a rotor, to compute its Campbell diagram of 101 speeds, and to evaluate its equations and Jacobian.

use foldline::contract::{Batch, Parameters, VectorField};
use foldline_store::model_file::{parse_model, parse_rotor};
use std::time::Instant;

/// Number of repetitions, of which the fastest counts.
const TIMES: usize = 20;

fn fastest(mut run: impl FnMut()) -> f64 {
    (0..TIMES)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

fn main() {
    let text = include_str!("../../../models/overhung-shaft.toml");
    for elements in [6, 15, 30] {
        let step = elements / 3;
        let text = text
            .replace("elements = 6", &format!("elements = {elements}"))
            .replace("node = 6", &format!("node = {elements}"))
            .replace("at = \"1 m\"", &format!("node = {}", 2 * step));
        let Ok((model, Some(machine))) = parse_rotor(&text, "rotor.toml") else { return println!("no rotor") };
        let n = model.dim();
        let parameters = model.defaults();
        let speeds: Vec<f64> = (0..101).map(|k| 6.0 * k as f64).collect();
        let load = fastest(|| drop(parse_model(&text, "rotor.toml")));
        let campbell = fastest(|| drop(machine.campbell(&parameters, &speeds, 6)));
        let elliptic = {
            let bearing = "k = \"1e7 N/m\"";
            let text = text.replace(bearing, "kxx = \"1e7 N/m\"\nkyy = \"4e6 N/m\"");
            let Ok((_, Some(machine))) = parse_rotor(&text, "rotor.toml") else { return println!("no rotor") };
            fastest(|| drop(machine.campbell(&parameters, &speeds, 6)))
        };
        let lanes = 16;
        let states = vec![1e-5; n * lanes];
        let shared = Parameters::Shared(&parameters);
        let at = Batch { lanes, states: &states, parameters: shared, times: &[], signs: &[] };
        let (mut f, mut fx) = (vec![0.0; n * lanes], vec![0.0; n * n * lanes]);
        let evaluate = fastest(|| model.evaluate(at, &mut f));
        let linearise = fastest(|| model.linearise(at, &[], &mut f, &mut fx, &mut []));
        println!(
            "{n} states: read {:.1} ms, Campbell {:.1} ms (anisotropic {:.1} ms), f {:.2} us, Jacobian {:.1} us per point",
            1e3 * load,
            1e3 * campbell,
            1e3 * elliptic,
            1e6 * evaluate / lanes as f64,
            1e6 * linearise / lanes as f64
        );
    }
}
