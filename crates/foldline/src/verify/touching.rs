//! Verification of grazings: cycles that touch a surface.
//!
//! **Idea.** At a grazing two kinds of cycles meet, with a contact or an event and without. The cycles without it have
//! a smooth continuation beyond: that of an orbit which passes the surface as if it were not there. On these orbits the
//! extremum of the switch is a smooth function with a simple zero.

use super::located::{Ignored, Leg, Located, within};
use super::shooting::{Orbit, Shooting};
use crate::diagram::{Cycle, Kind, Point, Solution};
use crate::problem::Setting;
use crate::problem::impact::stored::{impacts, surfaces, times_of};
use crate::simulation::Tolerance;
use crate::special::grazing::extrema;
use crate::special::impact::{highest, speed};

/// Half of the share of the period in which the surface is not there, at most.
const WINDOW: f64 = 0.05;
/// Places of a step at which the switch is evaluated.
const SAMPLES: usize = 4;

/// Place at which a cycle touches a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    switch: usize,
    /// Normalised time, and half of the share of the period in which the surface is left out.
    time: f64,
    half: f64,
    /// 1 for a maximum of the switch, -1 for a minimum.
    sign: f64,
}

impl Touch {
    /// The touch at a special point; `None` where a surface is reached at the instant of an event.
    pub(super) fn of(setting: &Setting, kind: Kind, point: &Point) -> Option<Touch> {
        let Solution::Cycle(cycle) = &point.solution else { return None };
        match kind {
            Kind::ImpactGrazing => Touch::of_event(setting, point, cycle),
            _ => Touch::of_kink(setting, point, cycle),
        }
    }

    fn of_event(setting: &Setting, point: &Point, cycle: &Cycle) -> Option<Touch> {
        let (field, parameters) = (setting.field, &point.parameters);
        let kinks = field.switch_count() - field.event_count();
        let all = impacts(field, parameters, cycle);
        let unit = if cycle.forcing_periods > 0 { f64::from(cycle.forcing_periods) } else { cycle.period };
        let top = highest(field, parameters, cycle);
        let usual = top.size * std::f64::consts::TAU / unit;
        let speeds: Vec<f64> = all.iter().map(|own| speed(field, parameters, cycle, own).abs() / usual).collect();
        let slowest = (0..all.len()).min_by(|a, b| speeds[*a].total_cmp(&speeds[*b]));
        let weak = slowest.filter(|k| speeds[*k] < top.value.abs() / top.size);
        let (event, time) = weak.map_or((top.event, top.time), |k| (all[k].event, all[k].time));
        let others = all.iter().enumerate().filter(|(k, _)| Some(*k) != weak).map(|(_, own)| own.time);
        let sign = match field.event_direction(event) {
            0.0 => {
                let beside = time + 0.5 * WINDOW;
                -surfaces(field, parameters, &cycle.state(beside), &times_of(cycle, beside))[event].signum()
            }
            direction => direction,
        };
        Some(Touch { switch: kinks + event, time, half: half(time, others), sign })
    }

    fn of_kink(setting: &Setting, point: &Point, cycle: &Cycle) -> Option<Touch> {
        let (field, parameters) = (setting.field, &point.parameters);
        let nearest = (0..field.switch_count() - field.event_count())
            .flat_map(|switch| {
                let (all, size) = extrema(field, parameters, cycle, switch);
                all.into_iter().map(move |own| (own.value.abs() / size.max(f64::MIN_POSITIVE), switch, own))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let (_, switch, own) = nearest;
        if own.at_event {
            return None;
        }
        let (others, _) = extrema(field, parameters, cycle, switch);
        let others = others.into_iter().map(|other| other.time).filter(|time| *time != own.time);
        let sign = if own.maximum { 1.0 } else { -1.0 };
        Some(Touch { switch, time: own.time, half: half(own.time, others), sign })
    }

    /// The touch as something to be left out of an orbit.
    pub(super) fn ignored(&self, orbit: &Orbit) -> Ignored {
        let time = orbit.begin + (self.time - orbit.begin).rem_euclid(1.0);
        Ignored { switch: self.switch, times: [-self.half, self.half].map(|by| (time + by) * orbit.period) }
    }

    /// The extremum of the switch along a recomputed orbit.
    pub(super) fn extremum(&self, shooting: &Shooting, orbit: &Orbit, legs: &[Leg]) -> Option<f64> {
        let parameters = shooting.setting.at(&orbit.free);
        let located = Located {
            setting: shooting.setting,
            parameters,
            tolerance: Tolerance::uniform(shooting.accuracy, orbit.dim()),
            forced: orbit.forced,
            ignored: None,
        };
        let [first, last] = self.ignored(orbit).times;
        let inside = legs.iter().flat_map(|leg| &leg.steps).filter(|(times, _)| times[1] > first && times[0] < last);
        let mut best = f64::NEG_INFINITY;
        for (times, states) in inside {
            let at = |theta: f64| {
                let time = times[0] + theta * (times[1] - times[0]);
                self.sign * located.switches(&within(states, theta), time)[self.switch]
            };
            let place = |k: usize| k as f64 / SAMPLES as f64;
            let values: Vec<f64> = (0..=SAMPLES).map(|k| at(place(k))).collect();
            let top = (0..=SAMPLES).fold(0, |best, k| if values[k] > values[best] { k } else { best });
            let inside = top.clamp(1, SAMPLES - 1);
            let around = [place(inside - 1), place(inside), place(inside + 1)];
            best = best.max(super::jumping::refined(around, values[top], &at));
        }
        best.is_finite().then_some(self.sign * best)
    }
}

/// Half of the window about a time that contains no other one.
fn half(time: f64, others: impl Iterator<Item = f64>) -> f64 {
    let apart = |other: f64| {
        let off = (other - time).rem_euclid(1.0);
        off.min(1.0 - off)
    };
    others.fold(WINDOW, |half, other| half.min(0.5 * apart(other)))
}
