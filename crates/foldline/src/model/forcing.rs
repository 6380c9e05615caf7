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
                return Some([message, "give a frequency or period common to everything that depends on `t`".into()]);
            }
        }
    }
    None
}
