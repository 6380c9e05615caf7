//! Verification of cycles along which f or the state jumps.
//!
//! **Idea.** Such a cycle is recomputed by shooting through its jumps ([`super::located`]). The numbers of events per
//! period must agree, and so must the instants at which they occur. Between two events a stored state is compared with
//! the trajectory at the same fraction of the flight, since both jump at slightly different times.

use super::located::{Leg, within};
use super::points::{Along, ELSEWHERE, Part, Path, ROUNDING};
use super::shooting::{Orbit, Shooting, Solved};
use super::{Quantity, Verified};
use crate::contract::{Batch, Parameters};
use crate::diagram::{Cycle, Point, Solution};
use crate::linalg::{larger, max_abs};
use crate::problem::impact::stored::{Impact, impacts};
use crate::special::impact::{highest, speed};

/// Number of positions in a step at which extreme values are sought, and rounds of parabolas about one.
const SAMPLES: usize = 8;
const ROUNDS: usize = 4;
/// Speed of an event, relative to that of an oscillation of the same size, and distance of a maximum from a surface,
/// relative to the largest, up to which the orbit only touches it.
const SLOW: f64 = 1e-5;
const TOUCHING: f64 = 1e-9;
/// Normalised time before a touch at which its speed is evaluated.
const BESIDE: f64 = 1e-7;
/// Normalised time within which a stored node lies at an event.
const AT: f64 = 1e-13;

/// Verifies one cycle.
pub(super) fn verify(part: &Part, point: &Point, accuracies: [f64; 2], out: &mut Verified) {
    let undecided = match checked(part, point, accuracies, out) {
        Ok(()) => return,
        Err(why) => part.undecided(point, why),
    };
    out.undecided.push(undecided);
}

fn checked(part: &Part, point: &Point, accuracies: [f64; 2], out: &mut Verified) -> Result<(), &'static str> {
    let Solution::Cycle(cycle) = &point.solution else { return Err("it is not a cycle") };
    let [shooting, coarse] = accuracies.map(|accuracy| Shooting { setting: part.setting, accuracy, ignored: None });
    if grazes(part, point, cycle) {
        return Err("an event has no speed there, and it is not certain to occur");
    }
    let orbit = Orbit::away_from_surfaces(part.setting, point)?;
    let solve = |shooting: &Shooting, orbit: &Orbit| -> Option<Solved> {
        let mut found = shooting.solve(std::slice::from_ref(orbit), &[]).pop().flatten()?;
        // The flow that Newton's method leaves is that of its last iterate but one.
        found.flow = shooting.through_jumps(&found.orbit, None)?;
        Some(found)
    };
    let rough = solve(&coarse, &orbit).ok_or("shooting did not converge")?;
    let solved = solve(&shooting, &rough.orbit).ok_or("shooting did not converge")?;
    let off = shooting.between(&orbit, &solved.orbit);
    if max_abs(&off) > ELSEWHERE[usize::from(part.in_several_parameters())] {
        return Err("shooting converged to another solution");
    }
    let flow = &solved.flow;
    out.points += 1;
    let noise = ROUNDING + max_abs(&shooting.between(&rough.orbit, &solved.orbit));
    let stated = point.trust.discretisation + point.trust.residual + noise;
    let found = Found { part, cycle, orbit: &solved.orbit, legs: &flow.legs };
    let jumps: Vec<(usize, f64)> =
        flow.jumps.iter().map(|jump| (jump.event, jump.time / solved.orbit.period)).collect();
    let events = found.events(point, &jumps);
    let apart = events.as_ref().map_or(f64::INFINITY, |[own, other]| {
        own.iter().zip(other).fold(0.0, |most, (a, b)| larger(most, (a - b).abs()))
    });
    if part.setting.field.event_count() > 0 {
        out.checks.push(part.check(point, Quantity::Events, Some(stated), apart));
    }
    if let Some(events) = events {
        out.checks.push(part.check(point, Quantity::Profile, Some(stated), found.off(&events, &orbit.scales)));
    }
    out.checks.push(part.check(point, Quantity::Period, Some(stated), off[orbit.nodes.len()].abs()));
    let parameters = part.setting.at(&solved.orbit.free);
    let along = Along { field: part.setting.field, parameters: &parameters, orbit: &solved.orbit };
    let passed_on = found.samples().passed_on(along, stated);
    let ranges = found.ranges(&parameters);
    let (own, apart) = part.range_difference(point, &ranges, stated, &passed_on);
    out.checks.push(part.check(point, Quantity::Range, Some(own), apart));
    part.multipliers(point, &solved, &rough, out);
    Ok(())
}

/// True if an event of a cycle has hardly any speed, or its surface is only just not met.
fn grazes(part: &Part, point: &Point, cycle: &Cycle) -> bool {
    let field = part.setting.field;
    if field.event_count() == 0 {
        return false;
    }
    let touch = highest(field, &point.parameters, cycle);
    let unit = if cycle.forcing_periods > 0 { f64::from(cycle.forcing_periods) } else { cycle.period };
    let usual = touch.size * std::f64::consts::TAU / unit;
    let speed = |own: &Impact| speed(field, &point.parameters, cycle, own).abs();
    // A corner at the surface is no touch but an event that is not one.
    let beside = (touch.time - BESIDE).rem_euclid(1.0);
    let interval = cycle.mesh.partition_point(|node| *node <= beside).clamp(1, cycle.intervals()) - 1;
    let state = cycle.state(beside);
    let there = Impact { interval, time: beside, event: touch.event, before: state.clone(), after: state };
    touch.value.abs() < TOUCHING * touch.size && speed(&there) < SLOW * usual
        || impacts(field, &point.parameters, cycle).iter().any(|own| speed(own) < SLOW * usual)
}

/// A recomputed cycle beside the stored one.
struct Found<'a> {
    part: &'a Part<'a>,
    cycle: &'a Cycle,
    orbit: &'a Orbit,
    legs: &'a [Leg],
}

impl Found<'_> {
    /// Normalised times of the first node, of all events and of the end of the period, stored and found; `None` if the
    /// events differ.
    fn events(&self, point: &Point, found: &[(usize, f64)]) -> Option<[Vec<f64>; 2]> {
        let begin = self.orbit.begin;
        let mut stored: Vec<(usize, f64)> = impacts(self.part.setting.field, &point.parameters, self.cycle)
            .iter()
            .map(|own| (own.event, begin + (own.time - begin).rem_euclid(1.0)))
            .collect();
        stored.sort_by(|a, b| a.1.total_cmp(&b.1));
        let same = stored.len() == found.len() && stored.iter().zip(found).all(|(a, b)| a.0 == b.0);
        let with_ends = |all: &[(usize, f64)]| {
            std::iter::once(begin).chain(all.iter().map(|own| own.1)).chain([begin + 1.0]).collect::<Vec<f64>>()
        };
        same.then(|| [with_ends(&stored), with_ends(found)])
    }

    /// Largest distance of a stored state from the trajectory, relative to `scales`.
    fn off(&self, [stored, found]: &[Vec<f64>; 2], scales: &[f64]) -> f64 {
        let (n, nodes) = (scales.len(), &self.cycle.scheme().nodes);
        let block = (self.cycle.degree + 1) * n;
        let mut most = 0.0;
        for (pair, states) in self.cycle.mesh.windows(2).zip(self.cycle.profile.chunks_exact(block)) {
            for (c, x) in nodes.iter().zip(states.chunks_exact(n)) {
                let time = pair[0] + c * (pair[1] - pair[0]);
                let turns = (self.orbit.begin - time).max(0.0).ceil();
                let time = time + turns;
                let flight = stored[1..stored.len() - 1].iter().filter(|event| **event <= time + AT).count();
                let share = (time - stored[flight]) / (stored[flight + 1] - stored[flight]);
                let there = found[flight] + share * (found[flight + 1] - found[flight]);
                let Some(y) = self.state(flight, there * self.orbit.period) else { return f64::INFINITY };
                // An angle has turned once more.
                let gain = |i: usize| turns * self.orbit.gain.get(i).copied().unwrap_or(0.0);
                let apart = |i: usize| (x[i] + gain(i) - y[i]).abs() / scales[i];
                most = (0..n).fold(most, |most, i| larger(most, apart(i)));
            }
        }
        most
    }

    /// State during a flight.
    fn state(&self, flight: usize, time: f64) -> Option<Vec<f64>> {
        let mut own = self.legs.iter().filter(|leg| leg.flight == flight).peekable();
        while let Some(leg) = own.next() {
            if time <= leg.ends()[1] || own.peek().is_none() {
                return leg.state(time);
            }
        }
        None
    }

    /// All kept states.
    fn samples(&self) -> Path {
        let n = self.orbit.dim();
        let states: Vec<(f64, &[f64])> = self
            .legs
            .iter()
            .flat_map(|leg| &leg.steps)
            .flat_map(|(times, states)| states.chunks_exact(n).map(|x| (times[0] / self.orbit.period, x)))
            .collect();
        let of = |c: usize| states.iter().map(move |(_, x)| x[c]);
        Path { times: states.iter().map(|(time, _)| *time).collect(), states: (0..n).flat_map(of).collect() }
    }

    /// Smallest and largest values of states and outputs.
    fn ranges(&self, parameters: &[f64]) -> Vec<[f64; 2]> {
        let field = self.part.setting.field;
        let at = |times: &[f64; 2], states: &[f64], theta: f64| -> Vec<f64> {
            let mut x = within(states, theta);
            let time = [times[0] + theta * (times[1] - times[0])];
            let times = if self.orbit.forced { &time[..] } else { &[] };
            let mut outputs = vec![0.0; field.output_count()];
            let batch = Batch { lanes: 1, states: &x, parameters: Parameters::Shared(parameters), times, signs: &[] };
            field.outputs(batch, &mut outputs);
            x.extend(outputs);
            x
        };
        let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; field.dim() + field.output_count()];
        for (times, states) in self.legs.iter().flat_map(|leg| &leg.steps) {
            let place = |k: usize| k as f64 / SAMPLES as f64;
            let values: Vec<Vec<f64>> = (0..=SAMPLES).map(|k| at(times, states, place(k))).collect();
            for (c, range) in ranges.iter_mut().enumerate() {
                for (end, sign) in [(0, -1.0), (1, 1.0)] {
                    let value = |k: usize| sign * values[k][c];
                    let top = (0..=SAMPLES).fold(0, |best, k| if value(k) > value(best) { k } else { best });
                    let inside = top.clamp(1, SAMPLES - 1);
                    let around = [place(inside - 1), place(inside), place(inside + 1)];
                    let best = sign * range[end];
                    // Only the neighbourhood of the highest values is worth a closer look.
                    let spread =
                        (value(inside - 1) - value(inside)).abs().max((value(inside + 1) - value(inside)).abs());
                    let height = match value(top) + spread > best {
                        true => refined(around, value(top), &|theta| sign * at(times, states, theta)[c]),
                        false => value(top),
                    };
                    if height > best {
                        range[end] = sign * height;
                    }
                }
            }
        }
        ranges
    }
}

/// Height of a maximum near three places within a step, at least `value`.
pub(super) fn refined(mut t: [f64; 3], value: f64, at: &dyn Fn(f64) -> f64) -> f64 {
    let mut best = value;
    for _ in 0..ROUNDS {
        let v = t.map(at);
        let (a, b) = ((v[1] - v[0]) / (t[1] - t[0]), (v[2] - v[1]) / (t[2] - t[1]));
        let bend = (b - a) / (t[2] - t[0]);
        let place = 0.5 * (t[0] + t[1]) - 0.5 * a / bend;
        if !(bend < 0.0 && place > 0.0 && place < 1.0) {
            return best;
        }
        best = best.max(at(place));
        let step = (0.125 * (t[2] - t[0])).min(place).min(1.0 - place);
        if step < 1e-6 {
            return best;
        }
        t = [place - step, place, place + step];
    }
    best
}
