//! Quantities that can be axes of the diagram.
//!
//! **Idea.** First those that follow from the stored numbers of points, then amplitude, level and phase of the first
//! harmonics of each state and output, which are computed from the profiles when they are asked for. Any other quantity
//! that `foldline plot` draws, such as a ratio of amplitudes, can be added by its name.

use foldline::contract::VectorField;
use foldline::model::Model;
use foldline::special::quantity::Quantity;

/// Highest order of the harmonics that are offered.
const ORDERS: usize = 3;
/// Largest number of quantities that can be added by name.
const ADDED: usize = 100;

/// A quantity with its name.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    pub(crate) name: String,
    pub(crate) quantity: Quantity,
}

impl Axis {
    pub(crate) fn named(name: &str, model: &Model) -> Option<Axis> {
        Some(Axis { name: name.to_string(), quantity: Quantity::named(name, model)? })
    }
}

/// Quantities that follow from the stored numbers of points.
pub(crate) fn stored(model: &Model) -> Vec<Axis> {
    Quantity::names(model).iter().filter_map(|name| Axis::named(name, model)).collect()
}

/// All quantities that are offered.
pub(crate) fn offered(model: &Model) -> Vec<Axis> {
    let mut all = stored(model);
    // The solution of a boundary-value problem is not periodic.
    if model.conditions() == [0, 0] {
        all.extend(harmonics(model).iter().filter_map(|name| Axis::named(name, model)));
    }
    all
}

/// Names of harmonics. Those of maps, which have none, are no names of quantities.
fn harmonics(model: &Model) -> Vec<String> {
    let channels = model.states.iter().map(|s| &s.name).chain(model.outputs.iter().map(|o| &o.name));
    let signs: &[&str] = &["", "-"];
    let single = channels.map(|name| (name.as_str(), &signs[..1]));
    // A signal u + iv has backward harmonics too.
    let pair = model.whirl.iter().map(|_| ("whirl", signs));
    // Without forcing the phase of a cycle is arbitrary.
    let endings: &[&str] = if model.forced() { &["", "_dB", "_phase"] } else { &["", "_dB"] };
    let of = |(name, signs): (&str, &[&str])| {
        let orders = (1..=ORDERS).flat_map(|k| signs.iter().map(move |sign| format!("{sign}{k}")));
        orders
            .flat_map(|order| endings.iter().map(move |ending| format!("_h{order}{ending}")))
            .map(|end| format!("{name}{end}"))
            .collect()
    };
    single.chain(pair).flat_map(|signal| -> Vec<String> { of(signal) }).collect()
}

/// Adds a quantity by its name unless it is there. Returns its index.
///
/// # Errors
/// If there is no such quantity, or too many were added.
pub(crate) fn add(all: &mut Vec<Axis>, name: &str, model: &Model) -> Result<usize, String> {
    if let Some(index) = all.iter().position(|own| own.name == name) {
        return Ok(index);
    }
    let found = Axis::named(name, model).ok_or_else(|| {
        format!(
            "there is no quantity {name}; write a parameter, `period`, or a state or output with an ending, such as x_max, \
             x_rms, x_h1, x_h1_dB or x_h1_phase, or a ratio such as x_h1/y_h1_dB"
        )
    })?;
    if all.len() >= offered(model).len() + ADDED {
        return Err("too many quantities were added; start `foldline view` again".into());
    }
    all.push(found);
    Ok(all.len() - 1)
}
