//! First cycles with events: from a trajectory over one period to its flights.
//!
//! **Idea.** A candidate for an attractor is a state and a period. Its trajectory is computed once more, from the first
//! event to the one that is closest to a period later; the flights between are a first guess for Newton's method.

use super::System;
use super::growth::{direction, setting};
use crate::attractors::Candidate;
use crate::continuation::Settings;
use crate::continuation::Station;
use crate::continuation::corrector::{Plane, correct, parameter_row, settle};
use crate::contract::{Examination, VectorField, Verdict, ZeroProblem};
use crate::diagram::{Cost, Cycle, Point, Solution};
use crate::problem::cycle::CycleProblem;
use crate::problem::gauss::Scheme;
use crate::problem::impact::stored::{Impact, after, hard, impacts, surfaces, times_of, with_node};
use crate::problem::impact::{Flights, ImpactProblem};
use crate::problem::mesh;
use crate::simulation::{Clocked, Integrator, Passage, Tolerance};
use crate::special::impact::{Highest, highest, inadmissible, speed, usual_speed};

/// Relative accuracy of the trajectory.
const INTEGRATION: f64 = 1e-9;
/// Intervals of a first mesh, and degree of its polynomials.
const INTERVALS: usize = 12;
const DEGREE: usize = 4;
/// Distance of the last event from a period after the first, relative to it.
const NEAR: f64 = 0.05;
/// Speed, relative to that of an oscillation of the same size, of an event that hardly has any.
const SLOW: f64 = 1e-4;
/// Difference of the durations of flights, relative to the period, up to which turns are equal.
const EQUAL: f64 = 1e-5;

/// A flight: its samples, with times since its start.
#[derive(Default)]
struct Samples {
    start: f64,
    times: Vec<f64>,
    states: Vec<f64>,
}

/// Outcome for a candidate.
pub(super) enum Found {
    /// Its motion has no events.
    NoEvents,
    /// It leads to no cycle.
    Nothing,
    /// The cycle.
    Cycle(Box<Point>),
}

/// The cycle with events to which a candidate leads.
pub(super) fn polished(system: &System, parameters: &[f64], settings: &Settings, candidate: &Candidate) -> Found {
    let Candidate::Cycle { period, states, .. } = candidate else { return Found::NoEvents };
    let n = system.field.dim();
    let q = if system.field.forced() { period.round() as u32 } else { 0 };
    let whole = if q > 0 { f64::from(q) } else { *period };
    let flights = match flights(system, parameters, &states[..n], whole, q) {
        Ok(Some(flights)) => flights,
        Ok(None) => return Found::NoEvents,
        Err(()) => return Found::Nothing,
    };
    let (flights, q) = one_turn(flights, q);
    let mut problem = ImpactProblem::of(setting(system, 0, parameters), DEGREE, q, &flights);
    let mut u = problem.unknowns_with(&flights, parameters);
    problem.anchor(&u);
    let plane = |u: &[f64]| Plane { row: parameter_row(u.len()), base: u.to_vec(), distance: 0.0 };
    let coarse = Settings { tolerance: 1e-2, max_newton: 8, ..settings.clone() };
    let first = plane(&u);
    if correct(&mut problem, &coarse, &first, &mut u, &mut Cost::default()).is_err() {
        return Found::Nothing;
    }
    problem.anchor(&u);
    let value = u[u.len() - 1];
    let Ok(mut found) = settle(&mut problem, settings, plane(&u), u, 1.0, &mut Cost::default()) else {
        return Found::Nothing;
    };
    let last = found.u.len() - 1;
    found.u[last] = value;
    found.point.parameters = problem.point(&found.u, &found.tangent, Examination::default()).parameters;
    Found::Cycle(Box::new(found.point))
}

/// The cycle close to a state just after an event, stable or not: one to which Newton's method leads from the trajectory
/// up to a later event that returns close to the first.
pub(super) fn through(system: &System, parameters: &[f64], settings: &Settings, state: &[f64]) -> Option<Point> {
    /// Largest number of events of such a cycle, and distance of the return, relative to the largest states.
    const MOST: usize = 16;
    const CLOSE: f64 = 0.05;
    let (n, field) = (state.len(), Clocked(system.field));
    let absolute = system.scales.iter().chain(&[1.0]).map(|scale| INTEGRATION * scale).collect();
    let integrator = Integrator::new(&field, parameters, Tolerance { relative: INTEGRATION, absolute })
        .with_step_limit(system.limits.steps);
    let mut returns: Vec<(f64, Vec<f64>)> = Vec::new();
    let mut last: Option<Vec<f64>> = None;
    let (mut x, mut end) = (vec![0.0; n + 1], vec![0.0; n + 1]);
    let from = [state, &[0.0]].concat();
    integrator.trajectory(&from, [0.0, f64::MAX], &[], &mut |passage| {
        let Passage::Step(step) = passage else { return Verdict::Continue };
        step.start_into(&mut x);
        if last.as_ref().is_some_and(|before| before[..n] != x[..n]) {
            returns.push((step.start_time(), x[..n].to_vec()));
        }
        step.end_into(&mut end);
        last = Some(end.clone());
        if returns.len() > MOST { Verdict::Stop } else { Verdict::Continue }
    });
    let (first, start) = returns.first()?;
    let size = start.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
    let near = |x: &[f64]| x.iter().zip(start).all(|(a, b)| (a - b).abs() < CLOSE * size);
    returns[1..].iter().filter(|(_, x)| near(x)).find_map(|(time, _)| {
        let last = time - first;
        let period = if system.field.forced() { last.round() } else { last };
        if period <= 0.0 || (last - period).abs() > NEAR * period {
            return None;
        }
        let candidate = Candidate::Cycle { period, times: vec![0.0], states: state.to_vec() };
        match polished(system, parameters, settings, &candidate) {
            Found::Cycle(point) => Some(*point).filter(|found| inadmissible(system.field, found).is_none()),
            Found::NoEvents | Found::Nothing => None,
        }
    })
}

/// The flights of the trajectory from a state over about one period; `None` without events, an error without an event
/// about a period after the first.
fn flights(system: &System, parameters: &[f64], start: &[f64], whole: f64, q: u32) -> Result<Option<Flights>, ()> {
    let (n, field) = (start.len(), Clocked(system.field));
    let absolute = system.scales.iter().chain(&[1.0]).map(|scale| INTEGRATION * scale).collect();
    let tolerance = Tolerance { relative: INTEGRATION, absolute };
    let longest = whole / 16.0;
    let integrator =
        Integrator::new(&field, parameters, tolerance).with_step_limit(system.limits.steps).with_longest_step(longest);
    let from = [start, &[0.0]].concat();
    let (mut all, mut events): (Vec<Samples>, Vec<usize>) = (vec![Samples::default()], Vec::new());
    let mut last: Option<Vec<f64>> = None;
    let mut x = vec![0.0; n + 1];
    integrator.trajectory(&from, [0.0, 2.2 * whole], &[], &mut |passage| {
        let Passage::Step(step) = passage else { return Verdict::Continue };
        step.start_into(&mut x);
        if let Some(before) = last.as_ref().filter(|before| before[..n] != x[..n])
            && let Some(event) = event_between(system, parameters, &before[..n], &x[..n], step.start_time())
        {
            events.push(event);
            let first = all.get(1).map(|own: &Samples| own.start);
            all.push(Samples { start: step.start_time(), ..Samples::default() });
            if first.is_some_and(|first| step.start_time() > first + (1.0 + NEAR) * whole) {
                return Verdict::Stop;
            }
        }
        let Some(own) = all.last_mut() else { return Verdict::Stop };
        if own.times.is_empty() {
            own.times.push(0.0);
            own.states.extend_from_slice(&x[..n]);
        }
        const PARTS: usize = 4;
        for part in 1..=PARTS {
            let theta = part as f64 / PARTS as f64;
            step.state_into(theta, &mut x);
            own.times.push(step.time_at(theta) - own.start);
            own.states.extend_from_slice(&x[..n]);
        }
        last = Some(x.clone());
        Verdict::Continue
    });
    let Some(first) = all.get(1).map(|own| own.start).filter(|first| *first < (1.0 + NEAR) * whole) else {
        return Ok(None);
    };
    let off = |own: &Samples| (own.start - first - whole).abs() / whole;
    let nearest = (2..all.len()).min_by(|a, b| off(&all[*a]).total_cmp(&off(&all[*b]))).ok_or(())?;
    if off(&all[nearest]) > NEAR {
        return Err(());
    }
    let mesh = mesh::uniform(INTERVALS);
    let (scheme, own) = (Scheme::of(DEGREE), &all[1..nearest]);
    let flight = |own: &Samples| {
        let last = own.times.last().copied().unwrap_or(0.0);
        let places =
            mesh.windows(2).flat_map(|pair| scheme.nodes.iter().map(move |c| pair[0] + c * (pair[1] - pair[0])));
        let profile =
            places.flat_map(|s| (0..n).map(move |i| super::profile::sampled(&own.times, &own.states, n, i, s * last)));
        (last, profile.collect())
    };
    let phase = if q > 0 { first } else { 0.0 };
    let flights = own.iter().map(flight).collect();
    Ok(Some(Flights { phase, events: events[1..nearest].to_vec(), mesh: mesh.clone(), flights }))
}

/// The event that leads from one state to the other; `None` if the state was moved onto the surface along which it slides.
fn event_between(system: &System, parameters: &[f64], before: &[f64], reached: &[f64], time: f64) -> Option<usize> {
    /// Distance from the state after an event, relative to the change: that of two dense outputs.
    const REACHED: f64 = 0.1;
    let times = if system.field.forced() { vec![time] } else { Vec::new() };
    let h = surfaces(system.field, parameters, before, &times);
    let off = |event: usize| {
        let own = after(system.field, parameters, event, before, &times);
        own.iter().zip(reached).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let moved = before.iter().zip(reached).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let kinks = system.field.switch_count() > system.field.event_count();
    (0..h.len())
        .filter(|event| !kinks || off(*event) < REACHED * moved)
        .min_by(|a, b| (off(*a), h[*a].abs()).partial_cmp(&(off(*b), h[*b].abs())).unwrap_or(std::cmp::Ordering::Equal))
}

/// One turn, if the flights are several equal ones.
fn one_turn(flights: Flights, q: u32) -> (Flights, u32) {
    let count = flights.flights.len();
    let whole: f64 = flights.flights.iter().map(|(last, _)| last).sum();
    for turns in (2..=count).rev() {
        if !count.is_multiple_of(turns) || q > 0 && !q.is_multiple_of(turns as u32) {
            continue;
        }
        let own = count / turns;
        let equal = (own..count).all(|k| {
            flights.events[k] == flights.events[k - own]
                && (flights.flights[k].0 - flights.flights[k - own].0).abs() < EQUAL * whole
        });
        if equal {
            let mut one = flights;
            one.events.truncate(own);
            one.flights.truncate(own);
            return (one, if q > 0 { q / turns as u32 } else { 0 });
        }
    }
    (flights, q)
}

/// True if an event of a cycle has hardly any speed.
pub(super) fn grazes(field: &dyn VectorField, at: &Point) -> bool {
    let Solution::Cycle(cycle) = &at.solution else { return false };
    if field.event_count() == 0 {
        return false;
    }
    let all = impacts(field, &at.parameters, cycle);
    let least = all.iter().map(|own| speed(field, &at.parameters, cycle, own).abs()).fold(f64::INFINITY, f64::min);
    least < SLOW * usual_speed(cycle, highest(field, &at.parameters, cycle).size)
}

/// The events of a cycle at an impact grazing, their speeds, and the one that loses its speed, if none is about to begin.
struct Grazed {
    all: Vec<Impact>,
    speeds: Vec<f64>,
    vanishes: Option<usize>,
    touch: Highest,
}

impl Grazed {
    fn of(field: &dyn VectorField, parameters: &[f64], cycle: &Cycle) -> Grazed {
        let touch = highest(field, parameters, cycle);
        let speeds_of =
            |all: &[Impact]| all.iter().map(|own| speed(field, parameters, cycle, own).abs()).collect::<Vec<f64>>();
        let all = impacts(field, parameters, cycle);
        let speeds = speeds_of(&all);
        let slowest = (0..all.len()).min_by(|a, b| speeds[*a].total_cmp(&speeds[*b]));
        let usual = usual_speed(cycle, touch.size);
        let vanishes = slowest.filter(|k| speeds[*k] / usual < touch.value.abs() / touch.size);
        if vanishes.is_some() {
            return Grazed { all, speeds, vanishes, touch };
        }
        // An orbit that touches the surface may have an interval that ends there, like one with an event without speed.
        let all = hard(field, parameters, cycle);
        Grazed { speeds: speeds_of(&all), all, vanishes, touch }
    }
}

/// Number of events of a cycle at an impact grazing: with the one that loses its speed, without the one that begins.
pub(super) fn count(field: &dyn VectorField, at: &Point) -> usize {
    match &at.solution {
        Solution::Cycle(cycle) => Grazed::of(field, &at.parameters, cycle).all.len(),
        Solution::Equilibrium(_) | Solution::Torus(_) => 0,
    }
}

/// Why a branch is not followed beyond an impact grazing, at which one more event begins although others hardly have any speed;
/// `None` if it is.
pub(super) fn accumulation(field: &dyn VectorField, at: &Point) -> Option<String> {
    let Solution::Cycle(cycle) = &at.solution else { return None };
    let found = Grazed::of(field, &at.parameters, cycle);
    let least = found.speeds.iter().copied().fold(f64::INFINITY, f64::min) / usual_speed(cycle, found.touch.size);
    let count = found.all.len();
    (found.vanishes.is_none() && least < SLOW).then(|| {
        format!(
            "the impacts accumulate: of {count} per period the slowest has {least:.0e} of the speed of the motion, and another one begins; \
             beyond lies chatter, an unlimited number of impacts and sustained contact after them\n\
             sustained contact is not followed\n\
             replace the rigid wall by a stiff spring with damping to follow the branch further"
        )
    })
}

/// Events, and the cycle with a mesh node at each of them.
type Sequence = (Vec<Impact>, Cycle);

/// A problem with another sequence of events, and a point of it.
pub(super) type Beyond<'a> = (Box<dyn ZeroProblem + 'a>, Station);

/// The continuation of a branch beyond an impact grazing: the problem of the new sequence of events, and a point of it.
pub(super) fn beyond<'a>(
    system: &'a System,
    settings: &Settings,
    free: usize,
    at: &Point,
    side: f64,
) -> Option<Beyond<'a>> {
    let Solution::Cycle(cycle) = &at.solution else { return None };
    let (field, parameters) = (system.field, &at.parameters);
    let Grazed { mut all, speeds, vanishes, touch } = Grazed::of(field, parameters, cycle);
    let usual = usual_speed(cycle, touch.size);
    let own = setting(system, free, parameters);
    let sequences: Vec<Sequence> = match vanishes {
        Some(slowest) => {
            // A symmetry lets several events lose their speed at once.
            let together: Vec<usize> = (0..all.len()).filter(|k| speeds[*k] < SLOW * usual).collect();
            let without = |gone: &[usize]| {
                let rest = all.iter().enumerate().filter(|(k, _)| !gone.contains(k)).map(|(_, own)| own.clone());
                (rest.collect::<Vec<Impact>>(), cycle.clone())
            };
            let several = (together.len() > 1).then(|| without(&together));
            several.into_iter().chain([without(&[slowest])]).collect()
        }
        None => {
            let (cut, interval) = with_node(cycle, touch.time);
            let before = cut.state(touch.time);
            let after = after(field, parameters, touch.event, &before, &times_of(&cut, touch.time));
            all.iter_mut().filter(|own| own.interval >= interval).for_each(|own| own.interval += 1);
            all.push(Impact { interval, time: touch.time, event: touch.event, before, after });
            all.sort_by_key(|own| own.interval);
            vec![(all, cut)]
        }
    };
    sequences.into_iter().find_map(|(all, cycle)| {
        let (mut problem, u): (Box<dyn ZeroProblem + 'a>, Vec<f64>) = match Flights::between(all, &cycle) {
            Some(flights) => of_flights(own.clone(), cycle.degree, cycle.forcing_periods, &flights, parameters),
            None => {
                let mut problem = CycleProblem::like(own.clone(), &cycle);
                let u = problem.unknowns_of(at);
                (Box::new(problem), u)
            }
        };
        let found = beside(&mut *problem, settings, field, &u, side, vanishes.is_none())?;
        Some((problem, found))
    })
}

/// A solution beside the point `u` of a grazing that is a motion, with its tangent away from it.
fn beside(
    problem: &mut dyn ZeroProblem,
    settings: &Settings,
    field: &dyn VectorField,
    u: &[f64],
    side: f64,
    gained: bool,
) -> Option<Station> {
    /// Distances from the grazing, in scaled variables.
    const DISTANCES: [f64; 4] = [2e-3, 2e-4, 2e-5, 1e-2];
    problem.anchor(u);
    let mesh = problem.mesh();
    let along = direction(problem, u).ok()?;
    for distance in DISTANCES {
        for sign in [1.0, -1.0] {
            problem.set_mesh(&mesh);
            problem.anchor(u);
            let row: Vec<f64> = along.iter().map(|t| sign * t).collect();
            let guess = u.iter().zip(&row).map(|(u, t)| u + distance * t).collect();
            let plane = Plane { row, base: u.to_vec(), distance };
            let found = settle(problem, settings, plane, guess, side, &mut Cost::default());
            if let Ok(mut found) = found
                && inadmissible(field, &found.point).is_none()
            {
                if approaches(problem, field, &found, gained) {
                    found.tangent.iter_mut().for_each(|t| *t = -*t);
                    found.point.tangent.iter_mut().for_each(|t| *t = -*t);
                }
                return Some(found);
            }
        }
    }
    None
}

/// True if the tangent at a point beside a grazing leads to it: with a new event, to where that loses its speed, else
/// to where the surface is touched.
fn approaches(problem: &dyn ZeroProblem, field: &dyn VectorField, found: &Station, gained: bool) -> bool {
    /// Length of the step that decides, in scaled variables.
    const STEP: f64 = 1e-5;
    let value = |by: f64| {
        let u: Vec<f64> = found.u.iter().zip(&found.tangent).map(|(u, t)| u + by * t).collect();
        let at = problem.point(&u, &found.tangent, Examination::default());
        let Solution::Cycle(cycle) = &at.solution else { return f64::NAN };
        match gained {
            false => -highest(field, &at.parameters, cycle).value,
            true => {
                let all = impacts(field, &at.parameters, cycle);
                all.iter().map(|own| speed(field, &at.parameters, cycle, own)).fold(f64::INFINITY, f64::min)
            }
        }
    };
    value(STEP) < value(-STEP)
}

fn of_flights<'a>(
    setting: crate::problem::Setting<'a>,
    degree: usize,
    forcing_periods: u32,
    flights: &Flights,
    parameters: &[f64],
) -> (Box<dyn ZeroProblem + 'a>, Vec<f64>) {
    let problem = ImpactProblem::of(setting, degree, forcing_periods, flights);
    let u = problem.unknowns_with(flights, parameters);
    (Box::new(problem), u)
}
