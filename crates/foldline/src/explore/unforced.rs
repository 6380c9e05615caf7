//! A forced field as an autonomous one, at parameters at which the forcing has no effect.
//!
//! **Equations.** With f the change per forcing period T(p): g = f / T at any fixed time.
//!
//! **Fails when** f depends on time; [`acts`] tells.

use crate::contract::{Batch, Parameters, VectorField};

/// The field g.
pub(super) struct Unforced<'a>(pub(super) &'a dyn VectorField);

/// True if f depends on time at these parameters, judging by states within `ranges` `[n]`.
pub(super) fn acts(field: &dyn VectorField, parameters: &[f64], ranges: &[[f64; 2]]) -> bool {
    const PLACES: usize = 12;
    const SAME: f64 = 1e-12;
    let share = |k: usize| (0.5 + k as f64 * 0.618_033_988_7).fract();
    (0..PLACES).any(|place| {
        let states: Vec<f64> =
            ranges.iter().enumerate().map(|(i, [low, high])| low + share(i * PLACES + place) * (high - low)).collect();
        let at = |time: f64| {
            let mut f = vec![0.0; states.len()];
            let parameters = Parameters::Shared(parameters);
            field.evaluate(Batch { lanes: 1, states: &states, parameters, times: &[time], signs: &[] }, &mut f);
            f
        };
        let (one, other) = (at(0.0), at(share(place) * 0.9 + 0.05));
        let size = one.iter().fold(f64::MIN_POSITIVE, |most: f64, f| most.max(f.abs()));
        one.iter().zip(&other).any(|(a, b)| (a - b).abs() > SAME * size)
    })
}

impl Unforced<'_> {
    /// T and its change along `change`, for lane `lane`.
    fn unit(&self, parameters: Parameters, lanes: usize, lane: usize) -> (f64, Vec<f64>) {
        let own = match parameters {
            Parameters::Shared(all) => all.to_vec(),
            Parameters::PerLane(all) => all.iter().skip(lane).step_by(lanes).copied().collect(),
        };
        (self.0.time_unit(&own), own)
    }

    fn units(&self, at: Batch) -> Vec<(f64, Vec<f64>)> {
        match at.parameters {
            Parameters::Shared(_) => vec![self.unit(at.parameters, at.lanes, 0); at.lanes],
            Parameters::PerLane(_) => (0..at.lanes).map(|lane| self.unit(at.parameters, at.lanes, lane)).collect(),
        }
    }
}

fn divided(values: &mut [f64], units: &[(f64, Vec<f64>)]) {
    for line in values.chunks_exact_mut(units.len()) {
        line.iter_mut().zip(units).for_each(|(v, (unit, _))| *v /= unit);
    }
}

impl VectorField for Unforced<'_> {
    fn dim(&self) -> usize {
        self.0.dim()
    }

    fn parameter_count(&self) -> usize {
        self.0.parameter_count()
    }

    fn evaluate(&self, at: Batch, f: &mut [f64]) {
        self.0.evaluate(Batch { times: &vec![0.0; at.lanes], ..at }, f);
        divided(f, &self.units(at));
    }

    fn linearise(&self, at: Batch, free: &[usize], f: &mut [f64], fx: &mut [f64], fp: &mut [f64]) {
        self.0.linearise(Batch { times: &vec![0.0; at.lanes], ..at }, free, f, fx, fp);
        let units = self.units(at);
        [&mut *f, fx, &mut *fp].into_iter().for_each(|values| divided(values, &units));
        for (lane, (unit, own)) in units.iter().enumerate() {
            let slopes = self.0.time_unit_slopes(own);
            for i in 0..self.dim() {
                for (c, index) in free.iter().enumerate() {
                    let slope = slopes.get(*index).copied().unwrap_or(0.0) / unit;
                    fp[(i * free.len() + c) * at.lanes + lane] -= slope * f[i * at.lanes + lane];
                }
            }
        }
    }

    // For directions in the states alone.
    fn directional(&self, at: Batch, directions: &[&[f64]], out: &mut [f64]) {
        self.0.directional(Batch { times: &vec![0.0; at.lanes], ..at }, directions, out);
        divided(out, &self.units(at));
    }

    fn ended(&self) -> bool {
        self.0.ended()
    }

    fn output_count(&self) -> usize {
        self.0.output_count()
    }

    fn outputs(&self, at: Batch, out: &mut [f64]) {
        self.0.outputs(Batch { times: &vec![0.0; at.lanes], ..at }, out);
    }
}
