//! Check that a forced field is periodic with its stated period.

use crate::contract::{Batch, Parameters, VectorField};

/// Returns a message and a hint if the field is not periodic: if the period is not a positive number at these
/// parameters `[k]`, or an equation or output differs one period later. States are sampled from `ranges` `[n]`; `names`
/// lists state names, then output names, as far as known. `None` for an autonomous field.
pub fn unrepeated(
    field: &dyn VectorField,
    names: &[String],
    ranges: &[[f64; 2]],
    parameters: &[f64],
) -> Option<[String; 2]> {
    const PLACES: usize = 16;
    const SAME: f64 = 1e-8;
    if !field.forced() || field.iterated() {
        return None;
    }
    let (n, outputs) = (field.dim(), field.output_count());
    let unit = field.time_unit(parameters);
    if !(unit > 0.0 && unit.is_finite()) {
        let [what, cure] = match field.conditions() {
            [0, 0] => ["the period of the forcing", "the period or frequency must be positive"],
            _ => ["the length of the interval", "the length must be positive"],
        };
        return Some([format!("{what} is {unit}"), cure.into()]);
    }
    let at = |time: f64, states: &[f64]| {
        let (mut f, mut g) = (vec![0.0; n], vec![0.0; outputs]);
        let batch = Batch { lanes: 1, states, parameters: Parameters::Shared(parameters), times: &[time], signs: &[] };
        field.evaluate(batch, &mut f);
        field.outputs(batch, &mut g);
        // Convert to rates per unit of time.
        f.iter_mut().for_each(|f| *f /= unit);
        [f, g].concat()
    };
    if field.conditions() != [0, 0] {
        return None;
    }
    if let Some(phase) = field.second_phase() {
        return unrepeated_twice(field, names, ranges, parameters, phase);
    }
    for place in 0..PLACES {
        let share = |k: usize| (0.5 + (k * PLACES + place) as f64 * 0.618_033_988_7).fract();
        let states: Vec<f64> =
            ranges.iter().enumerate().map(|(i, [low, high])| low + share(i) * (high - low)).collect();
        let time = share(n);
        let (now, later) = (at(time, &states), at(time + 1.0, &states));
        let size = now.iter().chain(&later).filter(|x| x.is_finite()).fold(0.0f64, |m, x| m.max(x.abs()));
        for (i, (a, b)) in now.iter().zip(&later).enumerate() {
            if (a - b).abs() > SAME * (a.abs() + b.abs() + size) {
                let own = match names.get(i) {
                    Some(name) if i < n => format!("the equation of `{name}`"),
                    Some(name) => format!("the output `{name}`"),
                    None => "an output".into(),
                };
                let time = time * unit;
                let message = format!(
                    "{own} does not have the forcing period {unit}: it is {a:.6} at t = {time:.6} and {b:.6} one \
                     period later, in the same state"
                );
                let hint = "give a frequency or period common to everything that depends on `t`; if two frequencies have \
                            none, the response is quasi-periodic: write `frequencies = [\"Omega\", \"nu\"]` under \
                            [forcing], and `t1` and `t2` for the time in the terms of each";
                return Some([message, hint.into()]);
            }
        }
    }
    None
}

/// [`unrepeated`] for a field with a second forcing.
fn unrepeated_twice(
    field: &dyn VectorField,
    names: &[String],
    ranges: &[[f64; 2]],
    parameters: &[f64],
    phase: usize,
) -> Option<[String; 2]> {
    const PLACES: usize = 16;
    const SAME: f64 = 1e-8;
    let (n, unit) = (field.dim(), field.time_unit(parameters));
    let (turns, _) = field.second_turns(parameters);
    if !(turns > 0.0 && turns.is_finite()) {
        return Some(["the second frequency of the forcing is not positive".into(), "both must be positive".into()]);
    }
    let at = |time: f64, turned: f64, states: &[f64]| {
        let (mut f, mut g) = (vec![0.0; n], vec![0.0; field.output_count()]);
        let mut own = parameters.to_vec();
        own[phase] += turned;
        let batch = Batch { lanes: 1, states, parameters: Parameters::Shared(&own), times: &[time], signs: &[] };
        field.evaluate(batch, &mut f);
        field.outputs(batch, &mut g);
        f.iter_mut().for_each(|f| *f /= unit);
        [f, g]
    };
    let differs = |a: &[f64], b: &[f64]| {
        let size = a.iter().chain(b).filter(|x| x.is_finite()).fold(0.0f64, |m, x| m.max(x.abs()));
        a.iter().zip(b).position(|(a, b)| (a - b).abs() > SAME * (a.abs() + b.abs() + size))
    };
    for place in 0..PLACES {
        let share = |k: usize| (0.5 + (k * PLACES + place) as f64 * 0.618_033_988_7).fract();
        let states: Vec<f64> =
            ranges.iter().enumerate().map(|(i, [low, high])| low + share(i) * (high - low)).collect();
        let time = share(n);
        let [now, outputs] = at(time, 0.0, &states);
        for (name, [later, _]) in [("t1", at(time + 1.0, -turns, &states)), ("t2", at(time, 1.0, &states))] {
            if let Some(i) = differs(&now, &later) {
                let own = names.get(i).map_or("an equation".into(), |name| format!("the equation of `{name}`"));
                let which = if name == "t1" { "first" } else { "second" };
                let message = format!("{own} does not repeat when `{name}` grows by the period of the {which} forcing");
                let hint = "write the terms of the first frequency with `t1` and those of the second with `t2`, as in \
                            `cos(Omega*t1) + cos(nu*t2)`";
                return Some([message, hint.into()]);
            }
        }
        let [_, other] = at(time, 0.37, &states);
        if differs(&outputs, &other).is_some() {
            let message = "an output depends on `t2`; with two forcing frequencies this is not supported";
            return Some([message.into(), "outputs of states, parameters and `t1`".into()]);
        }
    }
    None
}
