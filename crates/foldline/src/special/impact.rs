//! Impact grazing: the velocity of an impact vanishes, or a motion touches the surface of an event that it did not meet.
//!
//! **Idea.** A branch of cycles with events keeps its sequence of events. It ceases to be a motion where one of its
//! events loses its speed, or where the switch of an event has an extremum at zero during a flight. Both are smooth
//! functions along the branch, which passes the point regularly, so that it is located like any other; the branch ends
//! there.
//!
//! **Equations.** With h the switch of an event, σ the sign of its change, and v = σ (∇h·f + h_τ) at the event:
//!
//! ```text
//!   (1)  v = 0                            the event that ends a flight
//!   (2)  max σ h = 0                      local maxima during a flight, beside its ends
//! ```
//!
//! Near (1), |x⁺ - x| grows like v and the flight depends on the square root of the distance of the surface: a multiplier
//! grows without bound like 1/v.
//!
//! After an impact of small speed the motion may return to the surface within a time that is small in proportion to that speed.
//! Samples are therefore closer together in geometric progression towards both ends of a flight.
//!
//! **Source.** nordmark1991; dibernardo2008, §6.
//!
//! **Fails when** a flight touches the surface twice between two samples, an eighth of a mesh interval, not next to an event.

use crate::contract::{Batch, Monitor, Parameters, Sight, VectorField};
use crate::diagram::{Cycle, Ending, Kind, Point, Solution};
use crate::linalg::dot;
use crate::problem::impact::stored::{Impact, hard, impacts, surfaces, times_of};

/// Sections of a mesh interval at whose ends a switch is compared with its neighbours.
const SECTIONS: usize = 8;
/// Number of halvings of the first and the last section of a flight.
const HALVINGS: i32 = 20;
/// Depth of a minimum between an event and a maximum, relative to the largest value, that exceeds rounding.
const DEEP: f64 = 1e-13;
/// Distance of places, in intervals, up to which they are the same.
const SAME_PLACE: f64 = 1e-3;
/// Rounds of parabolas about a maximum.
const ROUNDS: usize = 6;

/// Monitor of (1), or of (2); `held` if one of the maxima (2) is zero all along a curve.
struct Grazes<'a> {
    field: &'a dyn VectorField,
    touches: bool,
    held: bool,
}

/// Monitor of equilibria on the surface of an event.
struct Rests<'a> {
    field: &'a dyn VectorField,
    event: usize,
}

/// Monitors of the events of a field, for cycles or for equilibria.
pub fn monitors<'a>(field: &'a dyn VectorField, cycles: bool) -> Vec<Box<dyn Monitor + 'a>> {
    if field.event_count() == 0 {
        return Vec::new();
    }
    match cycles {
        true => on_curves(field, false),
        false => (0..field.event_count()).map(|event| Box::new(Rests { field, event }) as Box<dyn Monitor>).collect(),
    }
}

/// Monitors for cycles along a curve in two parameters, on which one of the maxima (2) is zero if `held`.
pub fn on_curves<'a>(field: &'a dyn VectorField, held: bool) -> Vec<Box<dyn Monitor + 'a>> {
    if field.event_count() == 0 {
        return Vec::new();
    }
    [false, true].map(|touches| Box::new(Grazes { field, touches, held }) as Box<dyn Monitor>).into()
}

/// The events of a cycle.
#[derive(Clone, Debug, Default)]
pub struct Sequence {
    /// Number of events per period.
    pub count: usize,
    /// Names of the events, in order, and the share of the period at which each occurs.
    pub names: Vec<(String, f64)>,
    /// Sum over the events of the largest change of a state.
    pub change: f64,
}

impl Sequence {
    /// The events as text: the share of the period at which each occurs, and its name.
    pub fn text(&self) -> String {
        let each: Vec<String> = self.names.iter().map(|(name, time)| format!("{time:.3}: {name}")).collect();
        each.join("; ")
    }
}

/// The events of a cycle.
pub fn sequence(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle) -> Sequence {
    let all = impacts(field, parameters, cycle);
    let first = field.switch_count() - field.event_count();
    let change = |own: &Impact| own.after.iter().zip(&own.before).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    Sequence {
        count: all.len(),
        names: all.iter().map(|own| (field.switch_name(first + own.event), own.time)).collect(),
        change: all.iter().map(change).sum(),
    }
}

/// Reason why a solution is not a motion of a field with events; `None` if it is one.
pub fn inadmissible(field: &dyn VectorField, at: &Point) -> Option<String> {
    if field.event_count() == 0 {
        return None;
    }
    let first = field.switch_count() - field.event_count();
    let forbidden = |states: &[f64], times: &[f64]| {
        let parameters = Parameters::Shared(&at.parameters);
        let found = field.forbidden(Batch { lanes: 1, states, parameters, times, signs: &[] })?;
        Some(format!("it violates what `{}` allows", field.switch_name(first + found)))
    };
    let cycle = match &at.solution {
        Solution::Equilibrium(x) => return forbidden(x, &[]),
        Solution::Torus(_) => return None,
        Solution::Cycle(cycle) => cycle,
    };
    let (n, scheme) = (cycle.dim(), cycle.scheme());
    for (pair, nodes) in cycle.mesh.windows(2).zip(cycle.profile.chunks_exact((cycle.degree + 1) * n)) {
        for (x, c) in nodes.chunks_exact(n).zip(&scheme.nodes).skip(1) {
            let own = forbidden(x, &times_of(cycle, pair[0] + c * (pair[1] - pair[0])));
            if own.is_some() {
                return own;
            }
        }
    }
    trespass([0.0, 1e-9], field, at)
}

/// Reason why a cycle is not one of the motion with its events, which it passes in the wrong direction, or leaves out, by more than
/// the given shares of the sizes of speeds and switches.
pub fn trespass(slack: [f64; 2], field: &dyn VectorField, at: &Point) -> Option<String> {
    let Solution::Cycle(cycle) = &at.solution else { return None };
    let highest = highest(field, &at.parameters, cycle);
    let least = -slack[0] * usual_speed(cycle, highest.size);
    if speeds(field, &at.parameters, cycle).iter().any(|v| *v < least) {
        return Some("an event is passed in the wrong direction".into());
    }
    (highest.value > slack[1] * size_of_terms(field, at, cycle, &highest))
        .then(|| "it passes the surface of an event without it".into())
}

/// Size of a switch or of its terms, to which errors of its value are relative.
fn size_of_terms(field: &dyn VectorField, at: &Point, cycle: &Cycle, highest: &Highest) -> f64 {
    let (n, switches) = (cycle.dim(), field.switch_count());
    let (x, times) = (cycle.state(highest.time), times_of(cycle, highest.time));
    let [mut h, mut hx, mut ht] = [1, n, 1].map(|size| vec![0.0; switches * size]);
    let batch =
        Batch { lanes: 1, states: &x, parameters: Parameters::Shared(&at.parameters), times: &times, signs: &[] };
    field.linearise_switches(batch, &[], [&mut h, &mut hx, &mut [], &mut ht]);
    let surface = switches - field.event_count() + highest.event;
    let terms: f64 = hx[surface * n..(surface + 1) * n].iter().zip(&x).map(|(g, x)| (g * x).abs()).sum();
    highest.size.max(terms)
}

/// Speed of an oscillation of a size with the period of a cycle, in the time of the field.
pub(crate) fn usual_speed(cycle: &Cycle, size: f64) -> f64 {
    let whole = if cycle.forcing_periods > 0 { f64::from(cycle.forcing_periods) } else { cycle.period };
    size * std::f64::consts::TAU / whole
}

/// v of (1) of all events of a cycle.
fn speeds(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle) -> Vec<f64> {
    impacts(field, parameters, cycle).iter().map(|own| speed(field, parameters, cycle, own)).collect()
}

/// v of (1) of an event.
pub(crate) fn speed(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle, own: &Impact) -> f64 {
    let (n, switches) = (own.before.len(), field.switch_count());
    let times = times_of(cycle, own.time);
    let shared = Parameters::Shared(parameters);
    let at = Batch { lanes: 1, states: &own.before, parameters: shared, times: &times, signs: &[] };
    let [mut h, mut hx, mut ht] = [1, n, 1].map(|size| vec![0.0; switches * size]);
    field.linearise_switches(at, &[], [&mut h, &mut hx, &mut [], &mut ht]);
    let mut f = vec![0.0; n];
    field.evaluate(at, &mut f);
    let surface = switches - field.event_count() + own.event;
    sign(field, parameters, cycle, own) * (dot(&hx[surface * n..(surface + 1) * n], &f) + ht[surface])
}

/// σ of an event on a cycle.
fn sign(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle, own: &Impact) -> f64 {
    let direction = field.event_direction(own.event);
    if direction != 0.0 {
        return direction;
    }
    let (n, block) = (cycle.dim(), (cycle.degree + 1) * cycle.dim());
    let inside = own.interval * block + n..own.interval * block + 2 * n;
    let time = 0.5 * (cycle.mesh[own.interval] + cycle.mesh[own.interval + 1]);
    -surfaces(field, parameters, &cycle.profile[inside], &times_of(cycle, time))[own.event].signum()
}

/// The largest of the maxima (2) of all events.
pub(crate) struct Highest {
    /// Its value; minus the size if there is no maximum.
    pub value: f64,
    /// Largest value of a switch.
    pub size: f64,
    /// Normalised time, and the event.
    pub time: f64,
    pub event: usize,
}

/// The largest of the maxima (2).
pub(crate) fn highest(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle) -> Highest {
    highest_but(field, parameters, cycle, false)
}

/// The largest of the maxima (2) or, if `held`, of all but the one closest to zero.
fn highest_but(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle, held: bool) -> Highest {
    let all = if held { hard(field, parameters, cycle) } else { impacts(field, parameters, cycle) };
    let (n, count, scheme) = (cycle.dim(), cycle.intervals(), cycle.scheme());
    let block = (cycle.degree + 1) * n;
    let at = |place: f64| -> Vec<f64> {
        // Intervals are counted on beyond the end of the period.
        let j = (place.floor() as usize) % count;
        let s = place - place.floor();
        let mut x = vec![0.0; n];
        scheme.value_into(s, &cycle.profile[j * block..(j + 1) * block], &mut x);
        let time = cycle.mesh[j] + s * (cycle.mesh[j + 1] - cycle.mesh[j]);
        surfaces(field, parameters, &x, &times_of(cycle, time))
    };
    // Flights, as ranges of intervals, and the events at their ends; without events the period and a little more, so that no
    // maximum is at an end.
    let flights: Vec<([usize; 2], [Option<usize>; 2])> = match all.len() {
        0 => vec![([0, count + 1], [None; 2])],
        _ => {
            let end = |k: usize| all[k % all.len()].interval + 1 + if k >= all.len() { count } else { 0 };
            let event = |k: usize| Some(all[k % all.len()].event);
            (0..all.len()).map(|k| ([end(k), end(k + 1)], [event(k), event(k + 1)])).collect()
        }
    };
    let (mut found, mut size): (Vec<(f64, f64, usize)>, f64) = (Vec::new(), 0.0);
    for ([first, last], ends) in flights {
        let closer = |k: i32| 0.5f64.powi(k) / SECTIONS as f64;
        let places: Vec<f64> = std::iter::once(first as f64)
            .chain((1..=HALVINGS).rev().map(|k| first as f64 + closer(k)))
            .chain((first * SECTIONS + 1..last * SECTIONS).map(|k| k as f64 / SECTIONS as f64))
            .chain((1..=HALVINGS).map(|k| last as f64 - closer(k)))
            .chain([last as f64 - 1e-12])
            .collect();
        let values: Vec<Vec<f64>> = places.iter().map(|place| at(*place)).collect();
        for event in 0..field.event_count() {
            let own: Vec<f64> = values.iter().map(|all| all[event]).collect();
            size = own.iter().fold(size, |most, h| most.max(h.abs()));
            let signs = match field.event_direction(event) {
                0.0 => vec![-own[own.len() / 2].signum()],
                direction => vec![direction],
            };
            for sign in signs {
                let own: Vec<f64> = own.iter().map(|h| sign * h).collect();
                for k in maxima(&own, ends.map(|end| end == Some(event))) {
                    let course = |place: f64| sign * at(place)[event];
                    let around = [places[k - 1], places[k], places[k + 1]];
                    let (place, value) = refined(around, own[k], &course);
                    found.push((value, place, event));
                }
            }
        }
    }
    let closest = found.iter().copied().min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
    if let Some((_, own, event)) = closest.filter(|_| held) {
        // Without events the period is searched a little beyond its end.
        let apart = |place: f64| {
            let off = (place - own).rem_euclid(count as f64);
            off.min(count as f64 - off)
        };
        found.retain(|other| other.2 != event || apart(other.1) > SAME_PLACE);
    }
    // Of equal ones the first counts.
    let higher = |a: (f64, f64, usize), b: (f64, f64, usize)| if b.0 > a.0 { b } else { a };
    let (most, place, event) = found.into_iter().fold((f64::NEG_INFINITY, 0.0, 0), higher);
    let j = (place.floor() as usize) % count;
    let time = cycle.mesh[j] + (place - place.floor()) * (cycle.mesh[j + 1] - cycle.mesh[j]);
    Highest { value: if most.is_finite() { most } else { -size }, size, time, event }
}

/// Local maxima of samples that are not at an end. At an end that is `on` the surface, a minimum lies between it and the
/// maximum, and a stretch at the beginning that is positive does not count.
fn maxima(values: &[f64], on: [bool; 2]) -> Vec<usize> {
    let last = values.len() - 1;
    let deep = -DEEP * values.iter().fold(0.0f64, |most, h| most.max(h.abs()));
    let below = if on[0] && values[1] > -deep { values.iter().position(|h| *h < 0.0).unwrap_or(last) } else { 0 };
    let inner = |k: usize| values[k] > values[k - 1] && values[k] >= values[k + 1];
    let dips = |k: usize| values[k] < deep && values[k] <= values[k - 1] && values[k] < values[k + 1];
    let falls: Vec<usize> = (1..last).filter(|k| dips(*k)).collect();
    let between =
        |k: usize| (!on[0] || falls.iter().any(|dip| *dip < k)) && (!on[1] || falls.iter().any(|dip| *dip > k));
    (1..last).filter(|k| *k >= below && inner(*k) && between(*k)).collect()
}

/// Place and value of the maximum between three places.
fn refined(mut t: [f64; 3], value: f64, at: &dyn Fn(f64) -> f64) -> (f64, f64) {
    let mut best = (t[1], value);
    for _ in 0..ROUNDS {
        let v = t.map(at);
        let (a, b) = ((v[1] - v[0]) / (t[1] - t[0]), (v[2] - v[1]) / (t[2] - t[1]));
        let bend = (b - a) / (t[2] - t[0]);
        let place = 0.5 * (t[0] + t[1]) - 0.5 * a / bend;
        if !(place > t[0] && place < t[2]) {
            return best;
        }
        let there = (place, at(place));
        if there.1 >= best.1 {
            best = there;
        }
        let step = (0.125 * (t[2] - t[0])).min(place - t[0]).min(t[2] - place);
        if step < 1e-9 {
            return best;
        }
        t = [place - step, place, place + step];
    }
    best
}

impl Monitor for Grazes<'_> {
    fn kind(&self) -> Kind {
        Kind::ImpactGrazing
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        let Solution::Cycle(cycle) = &at.solution else { return f64::NAN };
        if self.touches {
            return -highest_but(self.field, &at.parameters, cycle, self.held).value;
        }
        let all = match self.held {
            true => hard(self.field, &at.parameters, cycle),
            false => impacts(self.field, &at.parameters, cycle),
        };
        let speed = |own: &Impact| speed(self.field, &at.parameters, cycle, own);
        let least = all.iter().map(speed).fold(f64::INFINITY, f64::min);
        if least.is_finite() { least } else { 1.0 }
    }

    fn confirms(&self, _at: &Point) -> bool {
        true
    }

    fn reads(&self) -> Sight {
        Sight::Tangent
    }

    fn jump(&self) -> usize {
        0
    }

    fn label(&self) -> usize {
        1 + usize::from(self.touches)
    }

    fn remark(&self, at: &Point, _forwards: bool) -> String {
        let Solution::Cycle(cycle) = &at.solution else { return String::new() };
        let found = sequence(self.field, &at.parameters, cycle);
        let count = found.count;
        match self.touches {
            true => format!("a touch without speed begins: events {count} → {}", count + 1),
            false => format!("an event loses its speed: events {count} → {}", count.saturating_sub(1)),
        }
    }

    fn ending(&self, _at: &Point, parameter: f64) -> Option<Ending> {
        Some(Ending::Joined { at: Kind::ImpactGrazing, parameter })
    }
}

impl Monitor for Rests<'_> {
    fn kind(&self) -> Kind {
        Kind::BoundaryEquilibrium
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        let Solution::Equilibrium(x) = &at.solution else { return f64::NAN };
        surfaces(self.field, &at.parameters, x, &[])[self.event]
    }

    fn confirms(&self, _at: &Point) -> bool {
        true
    }

    fn reads(&self) -> Sight {
        Sight::Tangent
    }

    fn jump(&self) -> usize {
        0
    }

    fn label(&self) -> usize {
        self.field.switch_count() - self.field.event_count() + self.event + 1
    }

    fn ending(&self, _at: &Point, parameter: f64) -> Option<Ending> {
        Some(Ending::Joined { at: Kind::BoundaryEquilibrium, parameter })
    }
}
