//! States and outputs along stored profiles.

use foldline::contract::VectorField;
use foldline::diagram::{Cycle, Point, Solution};
use foldline::explore::course::outputs;
use foldline::model::Model;

/// Positions per mesh interval: enough for a smooth curve.
const PER_INTERVAL: usize = 8;

/// Normalised times and values `[channel][time]` of every state, then of every output, over one period. `None` if the
/// point is no cycle or its profile was not stored.
pub fn along(model: &Model, point: &Point) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
    let cycle = cycle_of(point)?;
    let inner = cycle.mesh.windows(2).flat_map(|ends| {
        let [from, to] = [ends[0], ends[1]];
        (0..PER_INTERVAL).map(move |k| from + (to - from) * k as f64 / PER_INTERVAL as f64)
    });
    let times: Vec<f64> = inner.chain([1.0]).collect();
    let values = at(model, point, cycle, &times);
    Some((times, values))
}

/// Values `[channel][k]` at the start of each of the forcing periods that the cycle takes; of an equilibrium one.
pub fn stroboscopic(model: &Model, point: &Point) -> Option<Vec<Vec<f64>>> {
    match &point.solution {
        Solution::Equilibrium(state) => {
            let own = outputs(model, state, &point.parameters, if model.forced() { &[0.0] } else { &[] });
            Some(state.iter().chain(&own).map(|value| vec![*value]).collect())
        }
        _ => {
            let cycle = cycle_of(point).filter(|cycle| cycle.forcing_periods > 0)?;
            let count = cycle.forcing_periods;
            let times: Vec<f64> = (0..count).map(|k| f64::from(k) / f64::from(count)).collect();
            Some(at(model, point, cycle, &times))
        }
    }
}

/// Values `[channel][k]` where a channel passes `level` upwards. The crossings are located on the collocation polynomials;
/// for an output the state is refined in the same way.
pub fn crossings(model: &Model, point: &Point, channel: usize, level: f64) -> Option<Vec<Vec<f64>>> {
    let cycle = cycle_of(point)?;
    let (times, values) = along(model, point)?;
    let own = values.get(channel)?;
    let value = |time: f64| at(model, point, cycle, &[time])[channel][0] - level;
    let mut found = Vec::new();
    for k in 1..times.len() {
        if own[k - 1] < level && own[k] >= level {
            let [mut low, mut high] = [times[k - 1], times[k]];
            // Each halving gains one bit; the interval is shorter than 1.
            for _ in 0..52 {
                let middle = 0.5 * (low + high);
                *(if value(middle) < 0.0 { &mut low } else { &mut high }) = middle;
            }
            found.push(high);
        }
    }
    Some(at(model, point, cycle, &found))
}

/// The cycle of a point, if its profile was stored.
pub fn cycle_of(point: &Point) -> Option<&Cycle> {
    match &point.solution {
        Solution::Cycle(cycle) if point.solution.is_stored() && cycle.intervals() > 0 && cycle.degree > 0 => {
            Some(cycle)
        }
        _ => None,
    }
}

/// Values `[channel][time]` at normalised times.
pub fn at(model: &Model, point: &Point, cycle: &Cycle, times: &[f64]) -> Vec<Vec<f64>> {
    let n = cycle.dim();
    let mut states: Vec<f64> = times.iter().flat_map(|time| cycle.state(*time)).collect();
    // The state at time 1 is that of the next period.
    if times.last() == Some(&1.0) && states.len() >= 2 * n && !cycle.turns() {
        let first = states[..n].to_vec();
        let last = states.len() - n;
        states[last..].copy_from_slice(&first);
    }
    let clock: Vec<f64> = times.iter().map(|time| time * f64::from(cycle.forcing_periods)).collect();
    let own = outputs(model, &states, &point.parameters, if model.forced() { &clock } else { &[] });
    let m = model.outputs.len();
    let state = (0..n).map(|k| states.iter().skip(k).step_by(n.max(1)).copied().collect());
    let output = (0..m).map(|k| own.iter().skip(k).step_by(m.max(1)).copied().collect());
    state.chain(output).collect()
}

/// Name of a channel with its unit.
pub fn channel_label(model: &Model, channel: usize) -> String {
    let (name, unit) = match channel.checked_sub(model.states.len()) {
        None => model.states.get(channel).map(|own| (&own.name, &own.unit)),
        Some(k) => model.outputs.get(k).map(|own| (&own.name, &own.unit)),
    }
    .map_or(("", ""), |(name, unit)| (name.as_str(), unit.as_str()));
    let name = crate::quantity::with_greek(name);
    if matches!(unit, "" | "1" | "-") { name } else { format!("{name} [{unit}]") }
}

/// Index of the state or output of that name, outputs after states.
pub fn channel(model: &Model, name: &str) -> Option<usize> {
    model.state_index(name).or_else(|| model.output_index(name).map(|k| model.states.len() + k))
}
