//! Grazing: an orbit touches a switching surface of the vector field without crossing it. Boundary equilibria: an
//! equilibrium lies on one.
//!
//! **Idea.** A switch h has local extrema along a cycle. Where one of them passes zero the sequence of switchings
//! changes: a new contact begins, or the gap between two contacts closes. The number of excursions of h above zero
//! changes by one there, or by two where a symmetry repeats the event within the period; the extremum closest to zero
//! measures the distance to the event.
//!
//! Between two points of a branch the extrema are paired in the order of time, so that several events of one switch
//! within a step are separate zeros of separate functions. Pairs of a maximum and a minimum that exist at one of the
//! two points only, on one side of zero, have no partners. The derivatives of an extremum at both points show whether it
//! may pass zero and return in between.
//!
//! **Equations.** With extrema e_i of h over the period, N the number of excursions h > 0:
//!
//! ```text
//!   (1)  e_i = 0                         cycles, between two points
//!   (2)  (-1)^N min |e_i|                cycles, value at a point
//!   (3)  h(x) = 0                        equilibria
//! ```
//!
//! **Source.** dibernardo2008, §2.5 and §7.
//!
//! A cycle with events is examined flight by flight, with the values of h at both ends of a flight among its extrema.
//!
//! Where the orbit slides along the surface, h is zero; see [`super::sliding::touches`] for what takes the place of the
//! extremum.

mod pairs;

use super::sliding;
use crate::contract::{Batch, Events, Monitor, Parameters, Separate, Sight, VectorField};
use crate::diagram::{Cycle, Kind, Point, Solution};
use crate::problem::impact::stored::hard;

/// Sections of a mesh interval at whose ends a switch is compared with its neighbours; extrema are then found by
/// parabolas.
const SECTIONS: usize = 8;
/// Rounds of parabolas, each on an eighth of the section before. An extremum is known to the square of its place.
const ROUNDS: usize = 5;
/// Extrema smaller than this, relative to the largest value, are rounding. Where there are several, h is zero along a
/// part of the orbit.
const ZERO: f64 = 1e-11;

/// Index and size of the unknown λ of each free parameter.
pub type Axes = [(usize, f64)];

/// Monitor of grazings of one switch.
#[derive(Clone)]
pub struct Grazing<'a> {
    field: &'a dyn VectorField,
    switch: usize,
    cycles: bool,
    axes: Vec<(usize, f64)>,
}

/// Monitor of a single extremum, one of those at the left point.
struct Touch<'a> {
    of: Grazing<'a>,
    /// The extrema at the left and at the right point.
    ends: [Vec<Extremum>; 2],
    index: usize,
}

/// A local extremum of a switch along a cycle.
#[derive(Clone, Copy, Debug)]
pub struct Extremum {
    /// Normalised time.
    pub time: f64,
    /// Value of the switch.
    pub value: f64,
    /// True for a maximum.
    pub maximum: bool,
    /// True at the beginning or the end of a flight between events, where the switch may jump and does not graze zero.
    pub at_event: bool,
}

/// The extrema at two points, and the pairs of their indices.
type Matched = ([Vec<Extremum>; 2], Vec<[usize; 2]>);

/// Monitors of all switches of a field, for equilibria or for cycles; `axes` are the free parameters in the order of the
/// unknowns.
pub fn monitors<'a>(field: &'a dyn VectorField, cycles: bool, axes: &Axes) -> Vec<Box<dyn Monitor + 'a>> {
    // For the surfaces of events see [`super::impact`].
    let kinks = field.switch_count() - field.event_count();
    let each = (0..kinks).map(|switch| Grazing { field, switch, cycles, axes: axes.to_vec() });
    each.map(|own| Box::new(own) as Box<dyn Monitor + 'a>).collect()
}

impl Monitor for Grazing<'_> {
    fn kind(&self) -> Kind {
        if self.cycles { Kind::Grazing } else { Kind::BoundaryEquilibrium }
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        let cycle = match &at.solution {
            Solution::Equilibrium(x) => return value(self.field, &at.parameters, x, &[], self.switch)[0],
            Solution::Cycle(cycle) => cycle,
            Solution::Torus(_) => return f64::NAN,
        };
        let (extrema, size) = extrema(self.field, &at.parameters, cycle, self.switch);
        let least = extrema.iter().map(|e| e.value.abs()).fold(f64::INFINITY, f64::min);
        let zeros = extrema.iter().filter(|e| e.value.abs() < ZERO * size).count();
        if zeros > 1 || size == 0.0 {
            return f64::NAN;
        }
        if least.is_infinite() {
            return size;
        }
        if excursions(&extrema).rem_euclid(2) == 0 { least } else { -least }
    }

    fn separately<'m>(&'m self, left: &Point, right: &Point, length: f64) -> Option<Events<'m>> {
        if !self.cycles {
            return None;
        }
        let Some((ends, matched)) = self.matched(left, right) else {
            // The number of excursions alone, with a look in between.
            let values = [left, right].map(|at| self.value(left, at));
            let own = || Separate { values, monitor: Box::new(self.clone()) };
            // An extremum may leave its flight at an event, which changes their number as well.
            let changes = (values[0] > 0.0) != (values[1] > 0.0) && values.iter().all(|v| v.is_finite());
            let seen = (changes && self.field.event_count() == 0).then(own);
            return Some(Events { seen: seen.into_iter().collect(), turns: vec![0.5] });
        };
        let at_event = |pair: &[usize; 2]| ends[0][pair[0]].at_event || ends[1][pair[1]].at_event;
        // A surface that is reached at the instant of an event matters where f jumps.
        let matters = |pair: &[usize; 2]| !at_event(pair) || self.jumps(left, &ends[0][pair[0]]);
        let passes =
            |pair: &&[usize; 2]| (ends[0][pair[0]].value > 0.0) != (ends[1][pair[1]].value > 0.0) && matters(pair);
        let single = |pair: &[usize; 2]| Separate {
            values: [ends[0][pair[0]].value, ends[1][pair[1]].value],
            monitor: Box::new(Touch { of: self.clone(), ends: ends.clone(), index: pair[0] }),
        };
        let slope = |at: &Point, own: &Extremum| length * self.slope(at, own).unwrap_or(0.0);
        let between = |pair: &[usize; 2]| {
            let [a, b] = [&ends[0][pair[0]], &ends[1][pair[1]]];
            pairs::closest(a.value, b.value, || [slope(left, a), slope(right, b)])
        };
        Some(Events {
            seen: matched.iter().filter(passes).map(single).collect(),
            turns: matched.iter().filter(|pair| !at_event(pair)).filter_map(between).collect(),
        })
    }

    fn confirms(&self, _at: &Point) -> bool {
        true
    }

    fn reads(&self) -> Sight {
        Sight::Everything
    }

    fn jump(&self) -> usize {
        0
    }

    fn label(&self) -> usize {
        self.switch + 1
    }
}

impl Grazing<'_> {
    /// The extrema at two points, and the pairs of their indices; `None` if they cannot be paired.
    fn matched(&self, left: &Point, right: &Point) -> Option<Matched> {
        let of = |at: &Point| match &at.solution {
            Solution::Cycle(cycle) => Some(extrema(self.field, &at.parameters, cycle, self.switch)),
            Solution::Equilibrium(_) | Solution::Torus(_) => None,
        };
        let [(a, size), (b, other)] = [of(left)?, of(right)?];
        let flat = |all: &[Extremum], size: f64| all.iter().filter(|e| e.value.abs() < ZERO * size).count() > 2;
        if flat(&a, size) || flat(&b, other) {
            return None;
        }
        let matched = pairs::matched(&a, &b, size.max(other))?;
        Some(([a, b], matched))
    }

    /// True if f jumps at the surface, next to an extremum.
    fn jumps(&self, at: &Point, own: &Extremum) -> bool {
        match &at.solution {
            Solution::Cycle(cycle) => sliding::jumps_at(self.field, at, cycle, own.time, self.switch),
            Solution::Equilibrium(_) | Solution::Torus(_) => false,
        }
    }

    /// Change of an extremum per unit of length along the branch.
    fn slope(&self, at: &Point, own: &Extremum) -> Option<f64> {
        let Solution::Cycle(cycle) = &at.solution else { return None };
        let (size, k) = (cycle.profile.len(), self.axes.len());
        // A condition has unknowns before these.
        let extra = at.tangent.len().checked_sub(size + 1 + k)?;
        let along = Cycle { profile: at.tangent[extra..extra + size].to_vec(), gain: Vec::new(), ..cycle.clone() };
        let (x, v) = (cycle.state(own.time), along.state(own.time));
        let moves = &at.tangent[at.tangent.len() - k..];
        let forced = f64::from(cycle.forcing_periods);
        let time = (forced > 0.0).then_some(forced * own.time);
        let largest = |of: &[f64]| of.iter().fold(f64::MIN_POSITIVE, |most: f64, v| most.max(v.abs()));
        let step = 1e-6 * largest(&x).max(f64::MIN_POSITIVE) / largest(&v).max(largest(moves));
        let moved = |by: f64| {
            let y: Vec<f64> = x.iter().zip(&v).map(|(x, v)| x + by * v).collect();
            let mut parameters = at.parameters.clone();
            self.axes.iter().zip(moves).for_each(|((index, unit), t)| parameters[*index] += by * unit * t);
            value(self.field, &parameters, &y, time.as_slice(), self.switch)[0]
        };
        Some((moved(step) - moved(-step)) / (2.0 * step))
    }
}

impl Monitor for Touch<'_> {
    fn kind(&self) -> Kind {
        Kind::Grazing
    }

    fn value(&self, _reference: &Point, at: &Point) -> f64 {
        self.here(at).map_or(f64::NAN, |(all, _, own)| all[own].value)
    }

    fn confirms(&self, _at: &Point) -> bool {
        true
    }

    fn reads(&self) -> Sight {
        Sight::Everything
    }

    fn jump(&self) -> usize {
        0
    }

    fn label(&self) -> usize {
        self.of.switch + 1
    }

    fn remark(&self, at: &Point, forwards: bool) -> String {
        /// Ratio of the values of extrema that pass zero together, and what is zero, relative to the largest value.
        const TOGETHER: [f64; 2] = [10.0, 1e-8];
        let Some((all, here, own)) = self.here(at) else { return String::new() };
        let Some(across) = self.across() else { return String::new() };
        if all[own].at_event {
            let name = self.of.field.switch_name(self.of.switch);
            return format!("{name} = 0 is reached at the instant of an event");
        }
        let size = self.size();
        let zero = (TOGETHER[0] * all[own].value.abs()).max(TOGETHER[1] * size);
        let on_side = |side: usize| -> i64 {
            let mut there = all.clone();
            for [left, here] in &here {
                let Some([_, right]) = across.iter().find(|pair| pair[0] == *left) else { continue };
                let end = [&self.ends[0][*left], &self.ends[1][*right]][side];
                if there[*here].value.abs() <= zero {
                    there[*here].value = end.value;
                }
            }
            excursions(&there)
        };
        let [mut before, mut after] = [on_side(0), on_side(1)];
        if !forwards {
            std::mem::swap(&mut before, &mut after);
        }
        format!("contacts {before} → {after} at {} = 0", self.of.field.switch_name(self.of.switch))
    }
}

impl Touch<'_> {
    /// Largest value at both ends.
    fn size(&self) -> f64 {
        self.ends.iter().flatten().fold(0.0, |most: f64, e| most.max(e.value.abs()))
    }

    /// Pairs of the extrema at both ends.
    fn across(&self) -> Option<Vec<[usize; 2]>> {
        pairs::matched(&self.ends[0], &self.ends[1], self.size())
    }

    /// The extrema at a point between both ends, their pairs with those at the left, and the index of this one.
    fn here(&self, at: &Point) -> Option<(Vec<Extremum>, Vec<[usize; 2]>, usize)> {
        let Solution::Cycle(cycle) = &at.solution else { return None };
        let (all, size) = extrema(self.of.field, &at.parameters, cycle, self.of.switch);
        let here = pairs::matched(&self.ends[0], &all, size)?;
        let own = here.iter().find(|pair| pair[0] == self.index)?[1];
        Some((all, here, own))
    }
}

/// Excursions above zero during the period.
fn excursions(extrema: &[Extremum]) -> i64 {
    let count = extrema.len();
    let begins = |k: &usize| extrema[*k].value <= 0.0 && extrema[(k + 1) % count].value > 0.0;
    (0..count).filter(begins).count() as i64
}

/// One switch at states `[n × lanes]`.
fn value(field: &dyn VectorField, parameters: &[f64], states: &[f64], times: &[f64], switch: usize) -> Vec<f64> {
    let lanes = states.len() / field.dim().max(1);
    let mut values = vec![0.0; field.switch_count() * lanes];
    field.switches(Batch { lanes, states, parameters: Parameters::Shared(parameters), times, signs: &[] }, &mut values);
    values[switch * lanes..(switch + 1) * lanes].to_vec()
}

/// The local extrema of a switch along a cycle, and its largest absolute value.
pub fn extrema(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle, switch: usize) -> (Vec<Extremum>, f64) {
    let (n, intervals, scheme) = (cycle.dim(), cycle.intervals(), cycle.scheme());
    if n == 0 || intervals == 0 {
        return (Vec::new(), 0.0);
    }
    let forced = f64::from(cycle.forcing_periods);
    let time = |t: f64| if forced > 0.0 { Some(forced * t) } else { None };
    let places: Vec<f64> = cycle
        .mesh
        .windows(2)
        .flat_map(|pair| (0..SECTIONS).map(move |k| pair[0] + (pair[1] - pair[0]) * k as f64 / SECTIONS as f64))
        .collect();
    let (lanes, block) = (places.len(), (cycle.degree + 1) * n);
    let (mut states, mut x) = (vec![0.0; n * lanes], vec![0.0; n]);
    for k in 0..lanes {
        let nodes = &cycle.profile[k / SECTIONS * block..(k / SECTIONS + 1) * block];
        scheme.value_into((k % SECTIONS) as f64 / SECTIONS as f64, nodes, &mut x);
        (0..n).for_each(|c| states[c * lanes + k] = x[c]);
    }
    let times: Vec<f64> = places.iter().filter_map(|t| time(*t)).collect();
    let values = value(field, parameters, &states, &times, switch);
    let size = values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    let flat = on_surface_throughout(&values, size, |k| {
        let x = cycle.state(places[k]);
        sliding::pushes(field, parameters, &x, time(places[k]), switch)
    });
    let at = |t: f64| value(field, parameters, &cycle.state(t), time(t).as_slice(), switch)[0];
    // Where the state jumps, neighbours on both sides are not compared.
    let after_event = after_events(field, parameters, cycle);
    let jumps = |k: usize| k.is_multiple_of(SECTIONS) && after_event[k / SECTIONS];
    let before_event = |k: usize| {
        let (j, mut x) = (k / SECTIONS, vec![0.0; n]);
        scheme.value_into(1.0, &cycle.profile[j * block..(j + 1) * block], &mut x);
        value(field, parameters, &x, time(cycle.mesh[j + 1]).as_slice(), switch)[0]
    };
    let mut found = if flat.contains(&true) { sliding::touches(field, parameters, cycle, switch) } else { Vec::new() };
    for k in 0..lanes {
        let (before, after) = ((k + lanes - 1) % lanes, (k + 1) % lanes);
        if flat[k] || flat[after] {
            continue;
        }
        let next = if jumps(after) { before_event(k) } else { values[after] };
        let ends = |time: f64, value: f64, maximum: bool| Extremum { time, value, maximum, at_event: true };
        if jumps(k) {
            found.push(ends(places[k], values[k], values[k] > next));
            continue;
        }
        if jumps(after) {
            found.push(ends(cycle.mesh[k / SECTIONS + 1], next, next > values[k]));
        }
        let (low, high) = (values[k] - values[before], next - values[k]);
        // Of equal neighbours the first counts.
        let maximum = low > 0.0 && high <= 0.0;
        let minimum = low < 0.0 && high >= 0.0;
        if !(maximum || minimum) {
            continue;
        }
        let back = if k == 0 { places[before] - 1.0 } else { places[before] };
        let on = if after == 0 { 1.0 } else { places[after] };
        let (time, value) = refined([back, places[k], on], [values[before], values[k], next], &at);
        found.push(Extremum { time, value, maximum, at_event: false });
    }
    found.sort_by(|a, b| a.time.total_cmp(&b.time));
    (pairs::alternating(found, ZERO * size), size)
}

/// Marks the intervals of a cycle that begin after an event.
pub(super) fn after_events(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle) -> Vec<bool> {
    let mut marked = vec![false; cycle.intervals()];
    hard(field, parameters, cycle).iter().for_each(|own| marked[(own.interval + 1) % cycle.intervals()] = true);
    marked
}

/// Marks the places of a slide along the surface, which has no extrema: runs of small values at which f on both sides
/// leads to the surface. `slides(k)` tells the latter.
fn on_surface_throughout(values: &[f64], size: f64, slides: impl Fn(usize) -> bool) -> Vec<bool> {
    /// Consecutive sections: the part of an orbit that slides has intervals of its own.
    const RUN: usize = SECTIONS / 2;
    /// Relative to the largest value.
    const SMALL: f64 = 1e-9;
    let small: Vec<bool> = values.iter().map(|value| value.abs() <= SMALL * size).collect();
    let mut flat = vec![false; values.len()];
    for k in 0..values.len() {
        let run = || (k..k + RUN).map(|j| j % values.len());
        if run().all(|j| small[j]) && slides((k + RUN / 2) % values.len()) {
            run().for_each(|j| flat[j] = true);
        }
    }
    flat
}

/// Place and value of the extremum between three places.
fn refined(mut t: [f64; 3], mut v: [f64; 3], at: &dyn Fn(f64) -> f64) -> (f64, f64) {
    let bounds = [t[0], t[2]];
    let mut found = (t[1], v[1]);
    for _ in 0..ROUNDS {
        let (a, b) = ((v[1] - v[0]) / (t[1] - t[0]), (v[2] - v[1]) / (t[2] - t[1]));
        let bend = (b - a) / (t[2] - t[0]);
        let place = 0.5 * (t[0] + t[1]) - 0.5 * a / bend;
        if !(place > bounds[0] && place < bounds[1]) {
            break;
        }
        let there = (place, at(place));
        // At a corner, where f jumps, the parabola is no guide: the extremum is the sample itself.
        if (there.1 - found.1) * bend > 0.0 && (there.1 - found.1).abs() > f64::EPSILON * found.1.abs() {
            break;
        }
        found = there;
        let step = (0.0625 * (t[2] - t[0])).min(place - bounds[0]).min(bounds[1] - place);
        if step < 1e-9 {
            break;
        }
        t = [place - step, place, place + step];
        v = [at(t[0]), found.1, at(t[2])];
    }
    found
}

/// The extremum of a switch that is no event next to zero.
pub struct Nearest {
    /// The switch.
    pub switch: usize,
    /// Its largest absolute value.
    pub size: f64,
    /// The extremum.
    pub extremum: Extremum,
}

/// The extremum next to zero of all switches that are no events along a cycle.
pub fn nearest(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle) -> Option<Nearest> {
    (0..field.switch_count() - field.event_count())
        .flat_map(|switch| {
            let (all, size) = extrema(field, parameters, cycle, switch);
            let inside = all.into_iter().filter(|own| !own.at_event);
            inside.map(move |extremum| Nearest { switch, size: size.max(f64::MIN_POSITIVE), extremum })
        })
        .min_by(|a, b| (a.extremum.value.abs() / a.size).total_cmp(&(b.extremum.value.abs() / b.size)))
}

/// Description of the change at a grazing, in the order of growing positions.
pub fn described(field: &dyn VectorField, at: &Point) -> String {
    let Solution::Cycle(cycle) = &at.solution else { return String::new() };
    let Some(Nearest { switch, extremum: own, .. }) = nearest(field, &at.parameters, cycle) else {
        return String::new();
    };
    let count = excursions(&extrema(field, &at.parameters, cycle, switch).0);
    // Excursions with the extremum below and above zero.
    let above = count + i64::from(own.value <= 0.0) * if own.maximum { 1 } else { -1 };
    let below = if own.maximum { above - 1 } else { above + 1 };
    let rises = rises(field, at, cycle, switch, own.time);
    let [before, after] = if rises { [below, above] } else { [above, below] };
    let name = field.switch_name(switch);
    format!("contacts {before} → {after} at {name} = 0")
}

/// Description of a boundary equilibrium: the surface, and the continuation of the branch there.
pub fn on_surface(field: &dyn VectorField, at: &Point, becomes: &str) -> String {
    let Solution::Equilibrium(x) = &at.solution else { return becomes.into() };
    let size = |switch: usize| value(field, &at.parameters, x, &[], switch)[0].abs();
    let nearest = (0..field.switch_count()).min_by(|a, b| size(*a).total_cmp(&size(*b)));
    let name = nearest.map_or_else(String::new, |switch| format!("{} = 0", field.switch_name(switch)));
    if becomes.is_empty() { name } else { format!("{becomes} at {name}") }
}

/// True if the switch grows along the branch, at a time of the cycle.
fn rises(field: &dyn VectorField, at: &Point, cycle: &Cycle, switch: usize, t: f64) -> bool {
    let size = cycle.profile.len();
    // A condition has unknowns before these.
    let Some(extra) = at.tangent.len().checked_sub(size + 2) else { return true };
    let along = Cycle { profile: at.tangent[extra..extra + size].to_vec(), gain: Vec::new(), ..cycle.clone() };
    let (x, v) = (cycle.state(t), along.state(t));
    let forced = f64::from(cycle.forcing_periods);
    let time = (forced > 0.0).then_some(forced * t);
    let largest = |of: &[f64]| of.iter().fold(f64::MIN_POSITIVE, |most: f64, v| most.max(v.abs()));
    let step = 1e-6 * largest(&x) / largest(&v);
    let moved = |by: f64| {
        let y: Vec<f64> = x.iter().zip(&v).map(|(x, v)| x + by * v).collect();
        value(field, &at.parameters, &y, time.as_slice(), switch)[0]
    };
    moved(step) > moved(-step)
}
