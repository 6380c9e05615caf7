//! How long the overhung rotor takes per batch: `cargo run --release -p foldline --example tape_speed`.

use foldline::contract::{Batch, Parameters, VectorField};
use foldline::model::{Definition, Model, ModelError, ModelSource, Parameter, State};
use std::hint::black_box;
use std::time::Instant;

fn rotor() -> Result<Model, Vec<ModelError>> {
    let values = [
        ("Omega", 5.0),
        ("kappa", 1.0),
        ("zeta", 0.01),
        ("epsilon", 0.353),
        ("gamma", 0.25),
        ("beta", 10.0),
        ("K", 150.0),
        ("J_p", 0.143),
        ("m", 0.9),
    ];
    Model::compile(ModelSource {
        name: "overhung rotor".into(),
        parameters: values.map(|(name, value)| Parameter::new(name, value)).to_vec(),
        definitions: vec![
            Definition::new("r", "hypot(u, v)"),
            Definition::new("contact", "if(r > 0, (tanh(K*(r - 1)) + 1)/2*beta*(1 - 1/r), 0)"),
            Definition::new("stiffness", "1 - (1 - J_p)*Omega^2 + (1 - kappa)*gamma*r^2 + kappa*contact"),
        ],
        states: ["u", "v", "du", "dv"].map(State::new).to_vec(),
        equations: vec![
            Definition::new("u", "du"),
            Definition::new("v", "dv"),
            Definition::new("du", "m*epsilon*Omega^2 + (2-J_p)*Omega*dv - 2*zeta*du - stiffness*u + 2*zeta*Omega*v"),
            Definition::new("dv", "-(2-J_p)*Omega*du - 2*zeta*dv - stiffness*v - 2*zeta*Omega*u"),
        ],
        ..ModelSource::default()
    })
}

fn microseconds(mut run: impl FnMut()) -> f64 {
    run();
    let mut best = f64::INFINITY;
    for _ in 0..20 {
        let start = Instant::now();
        (0..100).for_each(|_| run());
        best = best.min(start.elapsed().as_secs_f64() * 1e4);
    }
    best
}

fn main() -> Result<(), Vec<ModelError>> {
    let model = rotor()?;
    let parameters = model.defaults();
    for lanes in [1, 8, 64, 400] {
        let states: Vec<f64> = (0..4 * lanes).map(|i| 1.5 * (i as f64 * 0.7).sin()).collect();
        let at = Batch { lanes, states: &states, parameters: Parameters::Shared(&parameters) };
        let (mut f, mut fx, mut fp) = (vec![0.0; 4 * lanes], vec![0.0; 16 * lanes], vec![0.0; 4 * lanes]);
        let evaluate = microseconds(|| model.evaluate(black_box(at), &mut f));
        let linearise = microseconds(|| model.linearise(black_box(at), &[0], &mut f, &mut fx, &mut fp));
        let directions: Vec<Vec<f64>> = (0..3)
            .map(|d| (0..13 * lanes).map(|i| if i < 4 * lanes { ((i + d) as f64).cos() } else { 0.0 }).collect())
            .collect();
        let directions: Vec<&[f64]> = directions.iter().map(|d| d.as_slice()).collect();
        let second = microseconds(|| model.directional(black_box(at), &directions[..2], &mut f));
        let third = microseconds(|| model.directional(black_box(at), &directions, &mut f));
        println!(
            "{lanes:4} lanes: f {evaluate:7.3} µs, f and Jacobian {linearise:7.3} µs, second {second:7.3} µs, third {third:7.3} µs"
        );
    }
    Ok(())
}
