//! Sections and spectra of the motions that simulation found.
//!
//! **Idea.** A survey or sweep keeps the last state of every motion, which lies on its attractor. From there the
//! trajectory is integrated again, and recorded at the start of every forcing period (stroboscopic points), where a state
//! or output passes a level upwards (Poincaré points), or at equal times for its spectrum.
//!
//! **Equations.** With samples x_s at times sΔ, s = 0 … S - 1, and Hann's window w_s = (1 - cos(2πs/S))/2, the amplitude
//! at the frequency k/(SΔ) is
//!
//!   (1)  a_k = 2 |Σ w_s (x_s - x̄) exp(-2πi ks/S)| / Σ w_s
//!
//! which is exact for frequencies that are whole multiples of 1/(SΔ); between two of them it is at most 15 % too small.
//!
//! **Source.** harris1978, §V.C.

use super::course::{Course, Way, course, outputs};
use super::scales_from;
use crate::contract::{VectorField, Verdict};
use crate::model::Model;
use crate::simulation::{Clocked, Direction, Integrator, Outcome, Passage, Section, Tolerance};
use foldline_general::fourier;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Plane in which a motion is recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Plane {
    /// The start of a forcing period.
    Stroboscopic,
    /// A state, or with an index beyond the states an output, passes a level upwards.
    Level(usize, f64),
}

/// Returns the next `count` points of a trajectory in a plane. It ends early if the trajectory does, or after the steps
/// of `way` if it no longer passes the plane. A start on a level is not a crossing.
pub fn section(model: &Model, start: &[f64], parameters: &[f64], plane: Plane, count: usize, way: &Way) -> Course {
    let Plane::Level(channel, level) = plane else {
        let period = model.time_unit(parameters);
        let times: Vec<f64> = (1..=count).map(|k| k as f64 * period).collect();
        return course(model, start, [0.0, count as f64 * period], Some(&times), parameters, way);
    };
    let n = model.dim();
    let forced = model.forced();
    let scales = scales_from(model, start, parameters);
    let absolute = scales.iter().chain([&1.0]).map(|scale| way.tolerance * scale).collect();
    let field = Clocked(model);
    let tolerance = Tolerance { relative: way.tolerance, absolute };
    let integrator = Integrator::new(&field, parameters, tolerance).with_step_limit(way.steps);
    let value = |_: f64, x: &[f64]| match channel.checked_sub(n) {
        None => x[channel] - level,
        Some(output) => {
            let clock = if forced { &x[n..=n] } else { &[][..] };
            outputs(model, &x[..n], parameters, clock).get(output).map_or(f64::NAN, |own| own - level)
        }
    };
    let sections = [Section { value: &value, direction: Direction::Rising }];
    let (mut times, mut states) = (Vec::new(), Vec::new());
    let unit = model.time_unit(parameters);
    let from = [start, &[0.0]].concat();
    let arrival = integrator.trajectory(&from, [0.0, f64::MAX], &sections, &mut |passage| {
        if let Passage::Crossing(crossing) = passage {
            times.push(crossing.time);
            states.extend_from_slice(&crossing.state[..n]);
        }
        if times.len() >= count || (way.stop)() { Verdict::Stop } else { Verdict::Continue }
    });
    let outcome = if times.len() >= count { Outcome::Reached } else { arrival.outcome };
    let outputs = outputs(model, &states, parameters, if forced { &times } else { &[] });
    Course { times: times.iter().map(|t| t * unit).collect(), states, outputs, outcome }
}

/// Returns the amplitudes (1) of a state, or of an output with an index beyond the states, at the frequencies k/`time`
/// for k from 0 to half of `samples`; `None` if the trajectory ends early.
pub fn spectrum(
    model: &Model,
    start: &[f64],
    parameters: &[f64],
    channel: usize,
    time: f64,
    samples: usize,
    way: &Way,
) -> Option<Vec<f64>> {
    let times: Vec<f64> = (0..samples).map(|s| s as f64 / samples as f64 * time).collect();
    let found = course(model, start, [0.0, time], Some(&times), parameters, way);
    let n = model.dim();
    let values: Vec<f64> = match channel.checked_sub(n) {
        None => found.states.iter().skip(channel).step_by(n).copied().collect(),
        Some(output) => found.outputs.iter().skip(output).step_by(model.output_count()).copied().collect(),
    };
    (found.outcome == Outcome::Reached && values.len() == samples).then(|| amplitudes(&values))
}

/// Amplitudes (1) of samples.
fn amplitudes(values: &[f64]) -> Vec<f64> {
    let count = values.len() as f64;
    let window = |s: usize| 0.5 * (1.0 - (TAU * s as f64 / count).cos());
    let mean = values.iter().sum::<f64>() / count;
    let mut z: Vec<Complex64> =
        values.iter().enumerate().map(|(s, x)| Complex64::new(window(s) * (x - mean), 0.0)).collect();
    fourier(&mut z);
    let weight = 0.5 * count;
    z.iter().take(values.len() / 2 + 1).map(|z| 2.0 * z.norm() / weight).collect()
}

#[cfg(test)]
mod tests {
    use super::amplitudes;
    use std::f64::consts::TAU;

    #[test]
    fn amplitudes_are_exact_at_multiples_and_never_much_too_small() {
        let wave = |frequency: f64| -> Vec<f64> {
            (0..1024).map(|s| 7.0 + 3.0 * (TAU * frequency * f64::from(s) / 1024.0 + 0.3).cos()).collect()
        };
        let found = amplitudes(&wave(40.0));
        assert!((found[40] - 3.0).abs() < 1e-12 && found[50] < 1e-12 && found[0] < 1e-12, "{:?}", &found[38..43]);
        // Half-way between two frequencies: 1.42 dB too small (harris1978, table 1).
        let between = amplitudes(&wave(40.5));
        let loss = 20.0 * (between[40] / 3.0).log10();
        assert!((loss + 1.42).abs() < 0.01, "{loss}");
    }
}
