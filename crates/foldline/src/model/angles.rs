//! States declared as angles.
//!
//! **Idea.** A solution may be shifted by a whole period of an angle only if f is periodic in that angle. Periodicity
//! is tested at a few sample points: barring coincidence, an analytic function that repeats at all of them repeats
//! everywhere.

use super::error::{Field, Item, ModelError};
use super::{Batch, Model, Parameters};
use crate::contract::VectorField;

/// Number of sample points, and the relative difference attributed to rounding (a sine after several turns).
const PLACES: usize = 12;
const SAME: f64 = 1e-9;

/// Returns an error for the first declared angle in which f is not periodic. `items`: `[n]` position in the source of
/// each state.
pub(super) fn no_angle(model: &Model, items: &[usize]) -> Option<ModelError> {
    let n = model.dim();
    let f = |x: &[f64], parameters: &[f64], time: &[f64]| -> Vec<f64> {
        let mut f = vec![0.0; n];
        let times = if model.forced() { time } else { &[] };
        model.evaluate(
            Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times, signs: &[] },
            &mut f,
        );
        f
    };
    let ranges = model.ranges();
    // Multiples of the golden ratio, scaled differently for each component: quasi-random points.
    let share = |place: usize, i: usize| ((place + 1) as f64 * 0.618_033_988_749_895 * (1.0 + i as f64).sqrt()).fract();
    for (c, period) in model.periods().iter().copied().enumerate().filter(|(_, period)| period.is_finite()) {
        for place in 0..PLACES {
            let x: Vec<f64> = ranges.iter().enumerate().map(|(i, [a, b])| a + share(place, i) * (b - a)).collect();
            // A parameter equal to 0 or 1 may hide a term.
            let parameters: Vec<f64> = (model.parameters.iter().enumerate())
                .map(|(i, p)| if place % 2 == 0 { p.value } else { p.value * (0.75 + 0.5 * share(place, n + i)) })
                .collect();
            let mut moved = x.clone();
            moved[c] += period;
            let time = [share(place, 2 * n)];
            let (here, there) = (f(&x, &parameters, &time), f(&moved, &parameters, &time));
            let size = here.iter().chain(&there).fold(0.0, |m: f64, v| m.max(v.abs()));
            // The next value of an angle of a map moves with it.
            let moves = |i: usize| if model.iterated() && i == c { period } else { 0.0 };
            let other = |i: &usize| (here[*i] + moves(*i) - there[*i]).abs() > SAME * (size + period);
            if !size.is_finite() {
                continue;
            }
            if let Some(i) = (0..n).find(other) {
                let (name, of) = (&model.states[c].name, &model.states[i].name);
                if model.iterated() {
                    return Some(ModelError {
                        item: Item::State(items.get(c).copied().unwrap_or(0)),
                        field: Field::Period,
                        name: name.clone(),
                        span: None,
                        message: format!(
                            "`{name}` is declared as an angle of period {period}, but one period later in `{name}` the \
                             next `{of}` is {} instead of {}",
                            there[i],
                            here[i] + moves(i)
                        ),
                        hint: "an angle must advance by its own period, as in theta + omega + g(theta) with a periodic g; \
                               or remove `period`"
                            .into(),
                    });
                }
                return Some(ModelError {
                    item: Item::State(items.get(c).copied().unwrap_or(0)),
                    field: Field::Period,
                    name: name.clone(),
                    span: None,
                    message: format!(
                        "`{name}` is declared as an angle of period {period}, but the rate of `{of}` is {} at \
                         `{name}` = {:.6} and {} one period later",
                        here[i], x[c], there[i]
                    ),
                    hint: format!(
                        "let `{name}` enter the equations only through functions of that period, or remove `period`"
                    ),
                });
            }
        }
    }
    None
}
