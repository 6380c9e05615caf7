//! Cycles with events as plain data, and back.
//!
//! **Idea.** A stored cycle is one profile over the period like any other; at an event the polynomials of neighbouring
//! intervals do not meet. Its events are therefore not stored: they are where an interval ends on the surface of one, and
//! the next begins in the state to which the reset leads. A cycle of a forced field begins at time 0, where one interval
//! is cut in two.

use crate::contract::{Batch, Parameters, VectorField};
use crate::diagram::{Cycle, Mesh};
use crate::problem::gauss::Scheme;
use crate::problem::mesh;

/// Value of the switch of an event, relative to its largest, and distance from the state after it, relative to the
/// largest states, up to which an interval ends with it.
const ON: [f64; 2] = [1e-8, 1e-6];
/// Difference of two polynomials, relative to the largest states, up to which they are two pieces of one.
const SAME: f64 = 1e-8;
/// Distance of nodes that count as one.
const NODE: f64 = 1e-9;
/// Distance of an event from the beginning of a period, relative to it, that is rounding.
const CLOSE: f64 = 1e-12;

/// An event on a cycle.
#[derive(Clone, Debug)]
pub struct Impact {
    /// The interval that it ends, and its time, normalised.
    pub interval: usize,
    pub time: f64,
    /// Its number among the events of the field.
    pub event: usize,
    /// States before and after it.
    pub before: Vec<f64>,
    pub after: Vec<f64>,
}

/// Time of a field at a normalised time of a cycle; empty if it is autonomous.
pub(crate) fn times_of(cycle: &Cycle, t: f64) -> Vec<f64> {
    if cycle.forcing_periods > 0 { vec![f64::from(cycle.forcing_periods) * t] } else { Vec::new() }
}

/// The switches of all events at one point, `[events]`.
pub(crate) fn surfaces(field: &dyn VectorField, parameters: &[f64], x: &[f64], times: &[f64]) -> Vec<f64> {
    let mut values = vec![0.0; field.switch_count()];
    let parameters = Parameters::Shared(parameters);
    field.switches(Batch { lanes: 1, states: x, parameters, times, signs: &[] }, &mut values);
    values.split_off(field.switch_count() - field.event_count())
}

/// The state after an event.
pub(crate) fn after(field: &dyn VectorField, parameters: &[f64], event: usize, x: &[f64], times: &[f64]) -> Vec<f64> {
    let n = x.len();
    let [mut r, mut rx, mut rt] = [1, n, 1].map(|size| vec![0.0; n * size]);
    let at = Batch { lanes: 1, states: x, parameters: Parameters::Shared(parameters), times, signs: &[] };
    field.reset(event, at, &[], [&mut r, &mut rx, &mut [], &mut rt]);
    r
}

/// The events of a cycle, in the order of time.
pub fn impacts(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle) -> Vec<Impact> {
    let (n, count) = (cycle.dim(), cycle.intervals());
    if field.event_count() == 0 || count == 0 || cycle.degree == 0 || cycle.profile.is_empty() {
        return Vec::new();
    }
    let (scheme, block) = (cycle.scheme(), (cycle.degree + 1) * n);
    let left = |j: usize| &cycle.profile[j % count * block..j % count * block + n];
    let mut sizes = vec![f64::MIN_POSITIVE; field.event_count()];
    for j in 0..count {
        let own = surfaces(field, parameters, left(j), &times_of(cycle, cycle.mesh[j]));
        sizes.iter_mut().zip(own).for_each(|(size, h)| *size = size.max(h.abs()));
    }
    let largest = cycle.profile.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
    let mut found = Vec::new();
    for j in 0..count {
        let mut before = vec![0.0; n];
        scheme.value_into(1.0, &cycle.profile[j * block..(j + 1) * block], &mut before);
        let times = times_of(cycle, cycle.mesh[j + 1]);
        let h = surfaces(field, parameters, &before, &times);
        let next = left(j + 1);
        let leads = |event: usize| {
            let reached = after(field, parameters, event, &before, &times);
            reached.iter().zip(next).all(|(a, b)| (a - b).abs() <= ON[1] * largest)
        };
        let own = (0..h.len()).find(|e| h[*e].abs() <= ON[0] * sizes[*e] && leads(*e));
        if let Some(event) = own {
            found.push(Impact { interval: j, time: cycle.mesh[j + 1], event, before, after: next.to_vec() });
        }
    }
    found
}

/// The events of a cycle that move its state: not those of an impact without speed.
pub(crate) fn hard(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle) -> Vec<Impact> {
    /// Change of the state, relative to the largest, up to which it counts as unchanged.
    const NONE: f64 = 1e-5;
    let largest = cycle.profile.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
    let change = |own: &Impact| own.after.iter().zip(&own.before).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let mut all = impacts(field, parameters, cycle);
    all.retain(|own| change(own) > NONE * largest);
    all
}

/// The cycle with a mesh node at a time, and the interval that ends there.
pub(crate) fn with_node(cycle: &Cycle, t: f64) -> (Cycle, usize) {
    let (n, scheme) = (cycle.dim(), cycle.scheme());
    let block = (cycle.degree + 1) * n;
    let next = cycle.mesh.partition_point(|node| *node <= t).clamp(1, cycle.intervals());
    let [a, b] = [cycle.mesh[next - 1], cycle.mesh[next]];
    let s = (t - a) / (b - a);
    let nodes = &cycle.profile[(next - 1) * block..next * block];
    let [left, right] = [[0.0, s], [s, 1.0]].map(|ends| part(scheme, nodes, ends, n));
    let mut mesh = cycle.mesh.to_vec();
    mesh.insert(next, t);
    let profile = [&cycle.profile[..(next - 1) * block], &left, &right, &cycle.profile[next * block..]].concat();
    (Cycle { mesh: mesh.into(), profile, ..cycle.clone() }, next - 1)
}

/// A cycle as its flights between events.
#[derive(Clone, Debug)]
pub(crate) struct Flights {
    /// Time of the first event, after which the first flight begins: in forcing periods; 0 without forcing.
    pub phase: f64,
    /// Event at the end of each flight.
    pub events: Vec<usize>,
    /// Mesh of all flights.
    pub mesh: Mesh,
    /// Duration of each flight, in forcing periods or in time, and its profile `[N · (m + 1) · n]`.
    pub flights: Vec<(f64, Vec<f64>)>,
}

/// An interval of a flight.
struct Piece {
    ends: [f64; 2],
    nodes: Vec<f64>,
}

/// Nodes of a polynomial on a part of its interval, which may extend beyond it.
fn part(scheme: &Scheme, nodes: &[f64], [from, to]: [f64; 2], n: usize) -> Vec<f64> {
    let mut out = vec![0.0; nodes.len()];
    for (x, c) in out.chunks_exact_mut(n).zip(&scheme.nodes) {
        scheme.value_into(from + c * (to - from), nodes, x);
    }
    out
}

impl Flights {
    /// The flights of a cycle; `None` if it has no events.
    pub fn of(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle) -> Option<Flights> {
        Flights::between(impacts(field, parameters, cycle), cycle)
    }

    /// The flights of a cycle between some of its events; `None` without any.
    pub fn between(mut impacts: Vec<Impact>, cycle: &Cycle) -> Option<Flights> {
        let (n, count) = (cycle.dim(), cycle.intervals());
        // The event at the end of the period is the one at its beginning.
        if impacts.last()?.interval + 1 == count {
            impacts.rotate_right(1);
        }
        let scheme = cycle.scheme();
        let forced = cycle.forcing_periods > 0;
        let unit = if forced { f64::from(cycle.forcing_periods) } else { cycle.period };
        let block = (cycle.degree + 1) * n;
        let piece = |j: usize| {
            let turns = (j / count) as f64;
            let own = j % count;
            let ends = [own, own + 1].map(|node| (cycle.mesh[node] + turns) * unit);
            Piece { ends, nodes: cycle.profile[own * block..(own + 1) * block].to_vec() }
        };
        let (mut events, mut parts) = (Vec::new(), Vec::new());
        for (i, own) in impacts.iter().enumerate() {
            let next = &impacts[(i + 1) % impacts.len()];
            let first = (own.interval + 1) % count;
            let last = if next.interval >= first { next.interval } else { next.interval + count };
            let mut pieces: Vec<Piece> = (first..=last).map(piece).collect();
            if forced && first < count && count <= last && first > 0 {
                join(&mut pieces, count - first, scheme, n);
            }
            events.push(next.event);
            parts.push(pieces);
        }
        let phase = if forced { impacts[0].time % 1.0 * unit } else { 0.0 };
        Some(Flights::assembled(phase, events, parts, scheme, n))
    }

    fn assembled(phase: f64, events: Vec<usize>, parts: Vec<Vec<Piece>>, scheme: &Scheme, n: usize) -> Flights {
        let course = |pieces: &Vec<Piece>| {
            let begin = pieces.first().map_or(0.0, |own| own.ends[0]);
            let last = pieces.last().map_or(1.0, |own| own.ends[1]) - begin;
            let mut mesh: Vec<f64> = pieces.iter().map(|own| (own.ends[0] - begin) / last).collect();
            mesh.push(1.0);
            let profile: Vec<f64> = pieces.iter().flat_map(|own| own.nodes.iter().copied()).collect();
            (last, Mesh::from(mesh), profile)
        };
        let all: Vec<(f64, Mesh, Vec<f64>)> = parts.iter().map(course).collect();
        let first = &all[0].1;
        let alike =
            |mesh: &Mesh| mesh.len() == first.len() && mesh.iter().zip(&first[..]).all(|(a, b)| (a - b).abs() < NODE);
        let mesh = match all.iter().all(|(_, mesh, _)| alike(mesh)) {
            true => first.clone(),
            false => mesh::uniform(all.iter().map(|(_, mesh, _)| mesh.len() - 1).max().unwrap_or(1).max(8)),
        };
        let carried = |(last, own, profile): &(f64, Mesh, Vec<f64>)| {
            let profile = match alike(own) && mesh.len() == own.len() {
                true => profile.clone(),
                false => mesh::transferred(profile, n, scheme, own, &mesh),
            };
            (*last, profile)
        };
        let flights = all.iter().map(carried).collect();
        Flights { phase, events, mesh, flights }
    }

    /// Numbers of flights with which the same flights may begin so that the events are those given; the one whose phase
    /// is closest to the one given.
    pub fn beginning(&self, events: &[usize], phase: f64, forcing_periods: u32) -> Option<usize> {
        let off = |first: usize| {
            let own = self.starting(first, forcing_periods, phase);
            (own.events == events).then_some((first, (own.phase - phase).abs()))
        };
        (0..self.events.len()).filter_map(off).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(first, _)| first)
    }

    /// These flights, beginning with another one, at the phase that is closest to the one given.
    pub fn starting(&self, first: usize, forcing_periods: u32, phase: f64) -> Flights {
        let (mut own, q) = (self.clone(), f64::from(forcing_periods));
        own.events.rotate_left(first);
        own.flights.rotate_left(first);
        if q > 0.0 {
            own.phase += self.flights[..first].iter().map(|(last, _)| last).sum::<f64>();
            own.phase += q * ((phase - own.phase) / q).round();
        }
        own
    }

    /// Number of the flight that begins first within a period of a forced field.
    pub fn first(&self, forcing_periods: u32) -> usize {
        let (q, mut time) = (f64::from(forcing_periods), self.phase);
        let mut starts = Vec::with_capacity(self.flights.len());
        for (last, _) in &self.flights {
            starts.push((time + CLOSE * q).rem_euclid(q));
            time += last;
        }
        (0..starts.len()).min_by(|a, b| starts[*a].total_cmp(&starts[*b])).unwrap_or(0)
    }

    /// Sign of the change of its switch at the end of each flight: that of the event or, if that is both, the opposite of
    /// the switch during the flight.
    pub fn signs(&self, field: &dyn VectorField, parameters: &[f64], degree: usize, forcing_periods: u32) -> Vec<f64> {
        let (n, intervals) = (field.dim(), self.mesh.len() - 1);
        let (mut begin, mut signs) = (self.phase, Vec::with_capacity(self.events.len()));
        for ((last, profile), event) in self.flights.iter().zip(&self.events) {
            let direction = field.event_direction(*event);
            let j = intervals / 2;
            let x = &profile[j * (degree + 1) * n..j * (degree + 1) * n + n];
            let time = if forcing_periods > 0 { vec![begin + self.mesh[j] * last] } else { Vec::new() };
            let inside = || -surfaces(field, parameters, x, &time)[*event].signum();
            signs.push(if direction != 0.0 { direction } else { inside() });
            begin += last;
        }
        signs
    }

    /// The flights of several turns.
    pub fn turns(&self, count: usize) -> Flights {
        let flights = (0..count).flat_map(|_| self.flights.iter().cloned()).collect();
        Flights { events: self.events.repeat(count), flights, ..self.clone() }
    }

    /// The cycle; `unit` is the length of a forcing period, or 1.
    pub fn cycle(&self, degree: usize, forcing_periods: u32, unit: f64) -> Cycle {
        let scheme = Scheme::of(degree);
        let n = self.flights.first().map_or(1, |(_, own)| own.len() / ((self.mesh.len() - 1) * (degree + 1)));
        let total: f64 = self.flights.iter().map(|(last, _)| last).sum();
        let whole = if forcing_periods > 0 { f64::from(forcing_periods) } else { total };
        let (mut pieces, mut begin) = (Vec::new(), self.phase);
        for (last, profile) in &self.flights {
            for (pair, nodes) in self.mesh.windows(2).zip(profile.chunks_exact((degree + 1) * n)) {
                let ends = [begin + pair[0] * last, begin + pair[1] * last];
                pieces.push(Piece { ends, nodes: nodes.to_vec() });
            }
            begin += last;
        }
        // The first multiple of the period from the phase on. An event may lie there, up to rounding.
        let close = CLOSE * whole;
        let base = whole * ((self.phase - close) / whole).ceil();
        let at = pieces.iter().position(|own| own.ends[0] + close < base && base + close < own.ends[1]);
        if let Some(j) = at {
            let [a, b] = pieces[j].ends;
            let s = (base - a) / (b - a);
            let nodes = std::mem::take(&mut pieces[j].nodes);
            let [left, right] = [[0.0, s], [s, 1.0]].map(|ends| part(scheme, &nodes, ends, n));
            pieces[j] = Piece { ends: [a, base], nodes: left };
            pieces.insert(j + 1, Piece { ends: [base, b], nodes: right });
        }
        let first = pieces.iter().position(|own| own.ends[0] + close >= base).unwrap_or(0);
        let before = |own: &Piece| (own.ends[0] + close < base, own.ends[0]);
        pieces.rotate_left(first);
        let mut mesh: Vec<f64> = pieces
            .iter()
            .map(|own| {
                let (early, time) = before(own);
                (time - base) / whole + if early { 1.0 } else { 0.0 }
            })
            .collect();
        mesh[0] = 0.0;
        mesh.push(1.0);
        let profile = pieces.into_iter().flat_map(|own| own.nodes).collect();
        Cycle {
            points: crate::problem::gauss::Points::Gauss,
            period: whole * unit,
            forcing_periods,
            mesh: mesh.into(),
            degree,
            profile,
            gain: Vec::new(),
        }
    }
}

/// Joins two pieces of one interval, of which the second has number `seam`, unless they are two intervals.
fn join(pieces: &mut Vec<Piece>, seam: usize, scheme: &Scheme, n: usize) {
    let [one, other] = [&pieces[seam - 1], &pieces[seam]];
    let lengths = [one, other].map(|own| own.ends[1] - own.ends[0]);
    // The longer one is continued over both.
    let nodes = match lengths[0] > lengths[1] {
        true => part(scheme, &one.nodes, [0.0, 1.0 + lengths[1] / lengths[0]], n),
        false => part(scheme, &other.nodes, [-lengths[0] / lengths[1], 1.0], n),
    };
    let share = lengths[0] / (lengths[0] + lengths[1]);
    let parts = [part(scheme, &nodes, [0.0, share], n), part(scheme, &nodes, [share, 1.0], n)];
    let largest = nodes.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
    let agree = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME * largest);
    if agree(&parts[0], &one.nodes) && agree(&parts[1], &other.nodes) {
        let ends = [one.ends[0], other.ends[1]];
        pieces[seam - 1] = Piece { ends, nodes };
        pieces.remove(seam);
    }
}
