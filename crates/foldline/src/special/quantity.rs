//! Named scalar quantities of the points of a branch.

use crate::contract::VectorField;
use crate::diagram::{Point, Solution};
use crate::model::Model;

/// Quantity of a point. States and outputs are numbered together, outputs after the states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Parameter with the given index.
    Parameter(usize),
    /// Period of a cycle; undefined for equilibria.
    Period,
    /// Smallest value of a state or output over the solution.
    Smallest(usize),
    /// Largest value of a state or output over the solution.
    Largest(usize),
    /// Mean over the solution, (1/T) ∫ g dt.
    Mean(usize),
    /// Root mean square, ((1/T) ∫ g² dt)^½.
    Rms(usize),
    /// Integral over one period, ∫ g dt; undefined for equilibria.
    Integral(usize),
    /// A state at one iterate of a cycle of a map: the state, and the number of the iterate from 0; for pictures.
    Iterate(usize, usize),
    /// A state at one place of the solution of a boundary-value problem: the state, and the place in [0, 1] as the bits
    /// of a number.
    At(usize, u64),
    /// Root mean square of the state vector, ((1/T) ∫ Σ x_i² dt)^½, for the given number of states.
    Norm(usize),
}

/// State at an iterate of a cycle of a map.
fn iterate(point: &Point, state: usize, number: usize) -> Option<f64> {
    let Solution::Cycle(cycle) = &point.solution else { return None };
    match cycle.degree {
        0 if cycle.profile.is_empty() && cycle.forcing_periods == 1 => point.ranges.get(state).map(|range| range[0]),
        0 => cycle.profile.get(number * cycle.dim() + state).copied(),
        _ => None,
    }
}

type Made = fn(usize) -> Quantity;
const ENDINGS: [(&str, Made); 5] = [
    ("_max", Quantity::Largest),
    ("_min", Quantity::Smallest),
    ("_mean", Quantity::Mean),
    ("_rms", Quantity::Rms),
    ("_integral", Quantity::Integral),
];

impl Quantity {
    /// Value at a point, if it is defined there.
    pub fn of(self, point: &Point) -> Option<f64> {
        let average = |k: usize, power: usize| point.averages.get(k).map(|average| average[power]);
        match self {
            Quantity::Parameter(k) => point.parameters.get(k).copied(),
            Quantity::Period => point.solution.period(),
            Quantity::Smallest(k) => point.ranges.get(k).map(|range| range[0]),
            Quantity::Largest(k) => point.ranges.get(k).map(|range| range[1]),
            Quantity::Iterate(k, number) => iterate(point, k, number),
            Quantity::At(k, place) => match &point.solution {
                Solution::Cycle(cycle) if !cycle.profile.is_empty() => {
                    // A value that a condition makes zero has the rounding of the others.
                    let size = point.ranges.get(k).map_or(0.0, |[low, high]| low.abs().max(high.abs()));
                    let value = cycle.state(f64::from_bits(place)).get(k).copied();
                    value.map(|value| if value.abs() < 4.0 * f64::EPSILON * size { 0.0 } else { value })
                }
                _ => None,
            },
            Quantity::Mean(k) => average(k, 0),
            Quantity::Rms(k) => average(k, 1).map(|square| square.max(0.0).sqrt()),
            Quantity::Integral(k) => average(k, 0).zip(point.solution.period()).map(|(mean, period)| mean * period),
            Quantity::Norm(n) => {
                let squares = point.averages.get(..n).filter(|own| !own.is_empty())?;
                Some(squares.iter().map(|own| own[1]).sum::<f64>().max(0.0).sqrt())
            }
        }
    }

    /// Returns the quantity with the given name: a parameter, `period`, `norm`, or NAME_max, NAME_min, NAME_mean,
    /// NAME_rms or NAME_integral of a state or output. For a boundary-value problem also NAME@0, NAME@1 or NAME@0.5, the
    /// value of a state at a place relative to the length of the interval.
    pub fn named(name: &str, model: &Model) -> Option<Quantity> {
        if let Some(index) = model.parameter_index(name) {
            return Some(Quantity::Parameter(index));
        }
        let channel = |name: &str| {
            model.state_index(name).or_else(|| model.output_index(name).map(|index| model.states.len() + index))
        };
        if let (Some((state, place)), true) = (name.split_once('@'), model.conditions() != [0, 0]) {
            let place: f64 = place.parse().ok().filter(|place| (0.0..=1.0).contains(place))?;
            return Some(Quantity::At(model.state_index(state)?, place.to_bits()));
        }
        let ended = || ENDINGS.iter().find_map(|(ending, made)| Some(made(channel(name.strip_suffix(ending)?)?)));
        match name {
            "period" => Some(Quantity::Period),
            "norm" => Some(Quantity::Norm(model.states.len())),
            _ => ended(),
        }
    }

    /// All names that [`Quantity::named`] accepts.
    pub fn names(model: &Model) -> Vec<String> {
        let channels = model.states.iter().map(|s| &s.name).chain(model.outputs.iter().map(|o| &o.name));
        let places: &[&str] = if model.conditions() == [0, 0] { &[] } else { &["@0", "@1"] };
        let ends = model.states.iter().flat_map(|s| places.iter().map(move |place| format!("{}{place}", s.name)));
        let ends: Vec<String> = ends.collect();
        let ended = channels.flat_map(|name| ENDINGS.map(|(ending, _)| format!("{name}{ending}")));
        let parameters = model.parameters.iter().map(|p| p.name.clone());
        parameters.chain(["period".into(), "norm".into()]).chain(ended).chain(ends).collect()
    }
}
