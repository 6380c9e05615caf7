//! `foldline-bench --device DIR`: a folder that times the emitted ensemble of the contact rotor on an NVIDIA card.
//!
//! **Idea.** Everything that the other machine needs is written: the source, a program around it, references computed
//! here, and a script. There `bash run.sh` compiles it in several ways, integrates a million trajectories over a
//! hundred time units, and prints steps per second and differences.

use crate::Outcome;
use foldline::emitted::{Emitted, Parts};
use foldline::model::Model;
use foldline::simulation::{Arrival, Ensemble, Tolerance};
use foldline_store::model_file::read_model;
use std::path::Path;

/// Trajectories with references, and their tolerance.
const KNOWN: usize = 1000;
const TOLERANCE: f64 = 1e-6;
/// Ends of the time span: of all trajectories, and of a comparison before differences have grown.
const END: f64 = 100.0;
const SHORT: f64 = 5.0;

/// Writes the folder.
pub fn write(root: &Path, folder: &Path) -> Outcome<()> {
    let (model, _) = read_model(&root.join("models/overhung-rotor.toml")).map_err(|found| found[0].to_string())?;
    let emitted = Emitted::new(&model, Parts::default()).map_err(|refused| refused.to_string())?;
    let mut parameters = model.defaults();
    let kappa = model.parameter_index("kappa").ok_or("the model has no kappa")?;
    parameters[kappa] = 1.0;
    std::fs::create_dir_all(folder.join("short"))?;
    std::fs::write(folder.join("ensemble.cu"), &emitted.source)?;
    std::fs::write(folder.join("main.cu"), include_str!("device/main.cu"))?;
    std::fs::write(folder.join("run.sh"), include_str!("device/run.sh"))?;
    std::fs::write(folder.join("run.py"), include_str!("device/run.py"))?;
    for (name, end) in [("reference.bin", END), ("short/reference.bin", SHORT)] {
        let bytes = reference(&model, &emitted, &parameters, end);
        std::fs::write(folder.join(name), bytes)?;
    }
    println!("run it on a machine with a card: bash {}/run.sh", folder.display());
    Ok(())
}

/// Number, time span and tolerance, values of parameters, ranges, starts, final states at the tolerance and at 1e-12,
/// and steps.
fn reference(model: &Model, emitted: &Emitted, parameters: &[f64], end: f64) -> Vec<u8> {
    let ranges = model.ranges();
    let starts: Vec<f64> =
        (0..KNOWN).flat_map(|c| ranges.iter().enumerate().map(move |(i, r)| place(c, i, r))).collect();
    let arrivals = |tolerance: f64| -> Vec<Arrival> {
        let tolerance = Tolerance::uniform(tolerance, ranges.len());
        Ensemble::new(model, parameters, tolerance, &starts, [0.0, end]).arrive()
    };
    let (own, exact) = (arrivals(TOLERANCE), arrivals(1e-12));
    let mut numbers = vec![KNOWN as f64, 0.0, end, TOLERANCE, 0.0, 0.0, 0.0];
    numbers.extend(emitted.scalars(parameters));
    numbers.extend(ranges.iter().flatten());
    numbers.extend((0..ranges.len()).flat_map(|i| starts.iter().skip(i).step_by(ranges.len())));
    for found in [&own, &exact] {
        numbers.extend((0..ranges.len()).flat_map(|i| found.iter().map(move |arrival| arrival.state[i])));
    }
    numbers.extend(own.iter().map(|arrival| (arrival.steps + arrival.rejected) as f64));
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// State component i of start c, spread evenly over a range.
fn place(c: usize, i: usize, [low, high]: &[f64; 2]) -> f64 {
    let place = 0.5 + (c + 1) as f64 * (i as f64 + 2.0).sqrt();
    low + (place - place.floor()) * (high - low)
}
