//! Named scalar quantities of the points of a branch.

use super::gradient;
use super::harmonics::{Measured, Signal, Term};
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
    /// 1/period of a cycle; undefined for equilibria.
    Frequency,
    /// Rotation number of a torus; undefined for other solutions.
    Rotation,
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
    /// Amplitude or phase of a harmonic.
    Of(Term),
    /// 20 log₁₀ of a value.
    Decibels(Term),
    /// Ratio of two values.
    Ratio(Term, Term),
    /// 20 log₁₀ of a ratio.
    RatioDecibels(Term, Term),
    /// Difference of two phases, in degrees from -180 to 180.
    Difference(Term, Term),
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

/// Decibels of a value.
pub(super) fn decibels(value: f64) -> f64 {
    20.0 * value.abs().log10()
}

impl Quantity {
    /// Value at a point, if it is defined there and follows from the numbers of the point alone. Harmonics need
    /// [`Quantity::on`].
    pub fn of(self, point: &Point) -> Option<f64> {
        let average = |k: usize, power: usize| point.averages.get(k).map(|average| average[power]);
        match self {
            Quantity::Parameter(k) => point.parameters.get(k).copied(),
            Quantity::Period => point.solution.period(),
            Quantity::Frequency => point.solution.period().map(|period| 1.0 / period),
            Quantity::Rotation => match &point.solution {
                Solution::Torus(torus) => Some(torus.rotation),
                _ => None,
            },
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
            Quantity::Of(_)
            | Quantity::Decibels(_)
            | Quantity::Ratio(..)
            | Quantity::RatioDecibels(..)
            | Quantity::Difference(..) => None,
        }
    }

    /// Value at a point with its profile, if it is defined there.
    pub fn on(self, point: &Point, field: &dyn VectorField) -> Option<f64> {
        let value = |term: Term| match term.measured {
            Measured::Largest => Quantity::Largest(term.signal.single()?).of(point),
            Measured::Smallest => Quantity::Smallest(term.signal.single()?).of(point),
            Measured::Mean => Quantity::Mean(term.signal.single()?).of(point),
            Measured::Rms => Quantity::Rms(term.signal.single()?).of(point),
            Measured::Amplitude(_) | Measured::Phase(_) => gradient::harmonic(field, point, term),
        };
        match self {
            // Without forcing the phase of a cycle is arbitrary.
            Quantity::Of(_) if self.is_phase() && point.solution.forcing_periods() == 0 => None,
            Quantity::Of(term) => value(term),
            Quantity::Decibels(term) => value(term).map(decibels),
            Quantity::Ratio(a, b) => Some(value(a)? / value(b)?),
            Quantity::RatioDecibels(a, b) => Some(decibels(value(a)? / value(b)?)),
            Quantity::Difference(a, b) => Some(wrapped(value(a)? - value(b)?)),
            other => other.of(point),
        }
    }

    /// Name of the quantity, given those of states and outputs; parameters and norms are not named.
    pub fn name(self, channels: &[String]) -> String {
        let own = |k: usize| channels.get(k).cloned().unwrap_or_else(|| format!("x{}", k + 1));
        match self {
            Quantity::Parameter(_) => "the parameter".into(),
            Quantity::Period => "period".into(),
            Quantity::Frequency => "frequency".into(),
            Quantity::Rotation => "rotation".into(),
            Quantity::Norm(_) => "norm".into(),
            Quantity::Smallest(k) => format!("{}_min", own(k)),
            Quantity::Largest(k) => format!("{}_max", own(k)),
            Quantity::Mean(k) => format!("{}_mean", own(k)),
            Quantity::Rms(k) => format!("{}_rms", own(k)),
            Quantity::Integral(k) => format!("{}_integral", own(k)),
            Quantity::Iterate(k, _) => own(k),
            Quantity::At(k, place) => format!("{}@{}", own(k), f64::from_bits(place)),
            Quantity::Of(a) => a.name(channels),
            Quantity::Decibels(a) => format!("{}_dB", a.name(channels)),
            Quantity::Ratio(a, b) => format!("{}/{}", a.name(channels), b.name(channels)),
            Quantity::RatioDecibels(a, b) => format!("{}/{}_dB", a.name(channels), b.name(channels)),
            Quantity::Difference(a, b) => format!("{}-{}", a.name(channels), b.name(channels)),
        }
    }

    /// True if the quantity is an angle in degrees, equal to its value plus 360.
    pub fn is_phase(self) -> bool {
        match self {
            Quantity::Of(term) => matches!(term.measured, Measured::Phase(_)),
            Quantity::Difference(..) => true,
            _ => false,
        }
    }

    /// True if the quantity needs the profile of a point.
    pub fn needs_profile(self) -> bool {
        self.terms().next().is_some()
    }

    /// Unit of the quantity; empty if it has none of its own.
    pub fn unit(self, model: &Model) -> &str {
        let of = |term: Term| match (term.measured, term.signal) {
            (Measured::Phase(_), _) => "deg",
            (_, Signal::Channel(k) | Signal::Pair(k, _)) => model.channel_unit(k),
        };
        match self {
            Quantity::Parameter(k) => model.parameters.get(k).map_or("", |own| &own.unit),
            Quantity::Period => &model.time,
            Quantity::Smallest(k) | Quantity::Largest(k) | Quantity::Mean(k) | Quantity::Rms(k) => {
                model.channel_unit(k)
            }
            Quantity::Iterate(k, _) | Quantity::At(k, _) => model.channel_unit(k),
            Quantity::Of(term) => of(term),
            Quantity::Difference(..) => "deg",
            Quantity::Decibels(_) | Quantity::RatioDecibels(..) => "dB",
            Quantity::Frequency
            | Quantity::Rotation
            | Quantity::Integral(_)
            | Quantity::Norm(_)
            | Quantity::Ratio(..) => "",
        }
    }

    /// The terms of which the quantity is made.
    pub fn terms(self) -> impl Iterator<Item = Term> {
        let (a, b) = match self {
            Quantity::Of(a) | Quantity::Decibels(a) => (Some(a), None),
            Quantity::Ratio(a, b) | Quantity::RatioDecibels(a, b) | Quantity::Difference(a, b) => (Some(a), Some(b)),
            _ => (None, None),
        };
        a.into_iter().chain(b)
    }

    /// Returns the quantity with the given name: a parameter, `period`, `frequency`, `rotation` of a torus, `norm`; NAME_max, NAME_min,
    /// NAME_mean, NAME_rms or NAME_integral of a state or output; NAME_h1 or NAME_h1_phase of a harmonic, a ratio A/B,
    /// a difference of phases A - B, or one of these followed by `_dB`. For a boundary-value problem also NAME@0, NAME@1 or
    /// NAME@0.5, the value of a state at a place relative to the length of the interval.
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
            "frequency" => Some(Quantity::Frequency),
            "rotation" => Some(Quantity::Rotation),
            "norm" => Some(Quantity::Norm(model.states.len())),
            _ => ended().or_else(|| made_of_terms(name, model)),
        }
    }

    /// All names that [`Quantity::named`] accepts, except harmonics and combinations of two quantities.
    pub fn names(model: &Model) -> Vec<String> {
        let channels = model.states.iter().map(|s| &s.name).chain(model.outputs.iter().map(|o| &o.name));
        let places: &[&str] = if model.conditions() == [0, 0] { &[] } else { &["@0", "@1"] };
        let ends = model.states.iter().flat_map(|s| places.iter().map(move |place| format!("{}{place}", s.name)));
        let ends: Vec<String> = ends.collect();
        let ended = channels.flat_map(|name| ENDINGS.map(|(ending, _)| format!("{name}{ending}")));
        let parameters = model.parameters.iter().map(|p| p.name.clone());
        parameters
            .chain(["period".into(), "frequency".into(), "rotation".into(), "norm".into()])
            .chain(ended)
            .chain(ends)
            .collect()
    }
}

/// Appends quantities to the averages of a point, after those of its states and outputs, so that code that reads only
/// the numbers of points shows them. Returns them as quantities of the extended point.
pub fn append(point: &mut Point, quantities: &[Quantity], model: &Model) {
    let channels = model.states.len() + model.outputs.len();
    let values: Vec<f64> = quantities.iter().map(|own| own.on(point, model).unwrap_or(f64::NAN)).collect();
    point.averages.resize(channels, [f64::NAN; 2]);
    point.averages.extend(values.into_iter().map(|value| [value, value * value]));
}

/// Quantity `index` of those appended by [`append`].
pub fn appended(index: usize, model: &Model) -> Quantity {
    Quantity::Mean(model.states.len() + model.outputs.len() + index)
}

/// An angle in degrees from -180 (excluded) to 180.
pub fn wrapped(degrees: f64) -> f64 {
    let rest = degrees.rem_euclid(360.0);
    if rest > 180.0 { rest - 360.0 } else { rest }
}

fn made_of_terms(name: &str, model: &Model) -> Option<Quantity> {
    let term = |text: &str| Term::named(text.trim(), model);
    if let Some(own) = term(name) {
        return Some(Quantity::Of(own));
    }
    let (bare, decibels) = name.strip_suffix("_dB").map_or((name, false), |bare| (bare, true));
    let level = |own: &Term| !matches!(own.measured, Measured::Phase(_));
    if decibels && let Some(own) = term(bare).filter(level) {
        return Some(Quantity::Decibels(own));
    }
    if let Some((a, b)) = bare.split_once('/').and_then(|(a, b)| Some((term(a)?, term(b)?))) {
        let fits = level(&a) && level(&b);
        return fits.then_some(if decibels { Quantity::RatioDecibels(a, b) } else { Quantity::Ratio(a, b) });
    }
    // The order of a harmonic may be negative.
    let split = |(at, _): (usize, &str)| Some((term(&name[..at])?, term(&name[at + 1..])?));
    let (a, b) = name.match_indices('-').find_map(split)?;
    (!level(&a) && !level(&b) && a.order() == b.order()).then_some(Quantity::Difference(a, b))
}
