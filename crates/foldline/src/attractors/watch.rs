//! Observation of one trajectory until its limit is known.
//!
//! **Idea.** Three things are watched. The extent of the motion over a window of steps: if it shrinks, an equilibrium
//! may be near. The returns to a section: their predicted limit may lie on a cycle. The distance to every known
//! solution: if its largest value per window falls steadily, the trajectory has settled there.

use super::Candidate;
use super::candidate::Context;
use super::orbit::Orbit;
use super::returns::{PART, Prediction, Returns};
use crate::contract::Verdict;
use crate::diagram::Solution;
use crate::simulation::Step;

/// Steps per window: a few periods of a cycle, some time constants of an equilibrium.
pub(super) const WINDOW: usize = 128;
/// Steps between measurements of the distance to known solutions.
const PULSE: usize = 16;
/// Steps after which a first section without a cycle is replaced; each later one lasts twice as long.
const FIRST_SECTION: usize = 1024;

/// Decrease of the extent after which an equilibrium is tried again.
const SHRUNK: f64 = 0.7;
/// Distance, relative to the size of the solution, below which a steady approach counts …
const CLOSE: f64 = 0.05;
/// … once the distance has fallen to this fraction of what it was when the approach began.
const APPROACHED: f64 = 0.5;
/// Larger distances at which a steady approach may count in a map of basins, the largest first.
pub(super) const RADII: [f64; 3] = [0.4, 0.2, 0.1];
/// Distance within which a trajectory that stays there is on the solution: the sag of the polygon that represents it.
pub(super) const ARRIVED: f64 = 3e-3;
/// A predicted limit settles a trajectory that is at most this far from the solution …
const NEIGHBOURHOOD: f64 = 0.1;
/// … if the limit is closer to the solution than the trajectory by this factor.
const HIT: f64 = 0.1;
/// Number of returns after which a predicted limit must still hold to be followed.
const PATIENCE: usize = 8;
/// Largest distance of a polished solution from its candidate.
const FAITHFUL: f64 = 0.1;

/// Observation of one trajectory.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    /// Index of the solution on which the trajectory was observed to settle.
    pub(super) settled: Option<usize>,
    /// Number of steps during which it is only compared with known solutions.
    pub(super) patience: usize,
    /// True if it counts as settled at the distance of each solution for that.
    pub(super) early: bool,
    steps: usize,
    x: Vec<f64>,
    window: Window,
    /// `[n]` extent over the last complete window.
    extent: Option<Vec<f64>>,
    /// Largest scaled extent at which the next equilibrium is tried.
    try_equilibrium_below: f64,
    /// A plane, and a part of one once a plane has been crossed too often.
    sections: [Section; 2],
    /// Extent since the sections were last renewed.
    span: Window,
    section_ends: usize,
    section_life: usize,
    /// Half-width of the part, relative to the extent of the motion.
    part: f64,
    approach: Approach,
}

/// A section, and when its returns are evaluated next.
#[derive(Clone, Debug, Default)]
struct Section {
    returns: Returns,
    /// `[n]` extent of the motion, with which its returns are compared; empty before the section is used.
    extent: Vec<f64>,
    next_attempt: usize,
    /// A limit to be followed if it is still predicted at the next attempt.
    expected: Option<Prediction>,
}

impl Watch {
    pub(super) fn new(n: usize) -> Watch {
        Watch {
            settled: None,
            patience: 0,
            early: false,
            steps: 0,
            x: vec![0.0; n],
            window: Window::new(n),
            extent: None,
            try_equilibrium_below: f64::INFINITY,
            sections: Default::default(),
            span: Window::new(n),
            section_ends: 0,
            section_life: FIRST_SECTION,
            part: PART,
            approach: Approach::default(),
        }
    }

    /// Evaluates a step; `known` holds the solutions found so far and is extended by those found here.
    pub(super) fn observe(&mut self, step: &Step, known: &mut Vec<Orbit>, context: &Context) -> Verdict {
        if self.steps < self.patience {
            return self.compare(step, known);
        }
        let mut x = std::mem::take(&mut self.x);
        step.end_into(&mut x);
        self.steps += 1;
        self.window.add(&x, step.end_time() - step.start_time());
        if self.steps.is_multiple_of(PULSE) {
            self.settled = self.approach.measure(&x, known);
        }
        for place in 0..self.sections.len() {
            let section = &mut self.sections[place];
            if !section.extent.is_empty() && self.settled.is_none() && section.returns.follow(step, &x) {
                let mut section = std::mem::take(section);
                self.try_cycle(&mut section, known, context);
                self.sections[place] = section;
            }
        }
        if self.steps.is_multiple_of(WINDOW) && self.settled.is_none() {
            self.close_window(step, &x, known, context);
        }
        self.x = x;
        if self.settled.is_some() { Verdict::Stop } else { Verdict::Continue }
    }

    /// Solution on which the trajectory would have counted as settled at each distance of [`RADII`].
    pub(super) fn forecasts(&self) -> [Option<usize>; RADII.len()] {
        self.approach.forecasts
    }

    /// Compares with the known solutions only.
    fn compare(&mut self, step: &Step, known: &[Orbit]) -> Verdict {
        self.steps += 1;
        if self.steps.is_multiple_of(PULSE) {
            step.end_into(&mut self.x);
            self.settled = self.approach.measure(&self.x, known);
            if self.early && self.settled.is_none() {
                let mut forecasts = self.approach.forecasts.iter().enumerate();
                self.settled = forecasts.find_map(|(k, own)| own.filter(|own| known[*own].early == Some(k)));
            }
        }
        if self.settled.is_some() { Verdict::Stop } else { Verdict::Continue }
    }

    /// Evaluates a window of steps: tries an equilibrium if the motion shrinks, and renews the section.
    fn close_window(&mut self, step: &Step, x: &[f64], known: &mut Vec<Orbit>, context: &Context) {
        let scales = &context.sampling.scales;
        let window = std::mem::replace(&mut self.window, Window::new(x.len()));
        let extent = window.extent();
        let size = (0..x.len()).fold(0.0, |m: f64, i| m.max(extent[i] / scales[i]));
        // The first window is transient.
        if self.extent.is_none() {
            self.try_equilibrium_below = SHRUNK * size;
        } else if size <= self.try_equilibrium_below {
            self.try_equilibrium_below = SHRUNK * size;
            let mean: Vec<f64> = window.integral.iter().map(|s| s / window.time).collect();
            let candidate = self.closer_to_rest(mean, step, x, context);
            self.try_equilibrium(candidate, &extent, known, context);
        }
        // A component that does not move is measured against a small fraction of its scale.
        let floored =
            |extent: Vec<f64>| extent.iter().zip(scales).map(|(own, s)| own.max(1e-6 * s)).collect::<Vec<f64>>();
        let extent = floored(extent);
        self.span.include(&window);
        if self.steps >= self.section_ends {
            let span = std::mem::replace(&mut self.span, Window::new(x.len()));
            self.renew_sections(step, x, (&extent, &floored(span.extent())), context.accuracy);
        }
        self.sections[0].extent.clone_from(&extent);
        self.extent = Some(extent);
    }

    /// Starts a new section at the end of a step, across the motion there, and a part of one if the plane is crossed so
    /// often that no period shows. `extent` is that of the last window, `span` that of the life of the last section.
    fn renew_sections(&mut self, step: &Step, x: &[f64], (extent, span): (&[f64], &[f64]), accuracy: f64) {
        let velocity: Vec<f64> = (0..x.len()).map(|i| step.end_slope(i)).collect();
        let across = |extent: &[f64]| Returns::across(x.to_vec(), &velocity, extent, accuracy);
        let [whole, part] = &mut self.sections;
        if part.returns.crowded() {
            self.part *= 0.5;
        } else if whole.returns.crowded() && part.extent.is_empty() {
            part.extent = span.to_vec();
        }
        // A part that the motion has returned to is kept.
        if !part.extent.is_empty() && (part.returns.crowded() || part.returns.total() < 2) {
            let reach = span.iter().map(|own| self.part * own).collect();
            *part = Section { returns: across(span).within(reach), extent: span.to_vec(), ..Section::default() };
        }
        *whole = Section { returns: across(extent), extent: extent.to_vec(), ..Section::default() };
        self.section_ends = self.steps + self.section_life;
        self.section_life *= 2;
    }

    /// Returns the mean of a window (suits a spiral) or its last state (suits a node), whichever has the smaller f.
    fn closer_to_rest(&self, mean: Vec<f64>, step: &Step, x: &[f64], context: &Context) -> Vec<f64> {
        let f = context.slope(&mean);
        let speed = |component: &dyn Fn(usize) -> f64| {
            (0..x.len()).map(|i| (component(i) / context.sampling.scales[i]).abs()).fold(0.0, f64::max)
        };
        let of_mean = speed(&|i| f[i]);
        if of_mean <= speed(&|i| step.end_slope(i)) { mean } else { x.to_vec() }
    }

    fn try_equilibrium(&mut self, x: Vec<f64>, extent: &[f64], known: &mut Vec<Orbit>, context: &Context) {
        // With steps at its stability limit, an explicit method may stand still a few step errors from the equilibrium.
        let own = context.tolerance();
        let room = |i: usize| 2.0 * extent[i] + 10.0 * (own.absolute[i] + own.relative * x[i].abs());
        let near = |rest: &[f64]| (0..x.len()).all(|i| (rest[i] - x[i]).abs() <= room(i));
        if known.iter().any(|k| matches!(&k.point.solution, Solution::Equilibrium(rest) if near(rest))) {
            return;
        }
        let candidate = Candidate::Equilibrium(x.clone());
        let Some(orbit) = context.polished(&candidate) else { return };
        if matches!(&orbit.point.solution, Solution::Equilibrium(rest) if near(rest)) {
            known.push(orbit);
        }
    }

    /// Looks for a limit of the returns: at every return at first, then less and less often while none is found.
    fn try_cycle(&mut self, section: &mut Section, known: &mut Vec<Orbit>, context: &Context) {
        let total = section.returns.total();
        if total < section.next_attempt {
            return;
        }
        let extent = section.extent.clone();
        // Far from every known solution and not nearly recurrent: nothing below can succeed.
        let near = |last: &[f64]| known.iter().any(|k| k.distance(last) <= NEIGHBOURHOOD);
        if !section.returns.comes_back(&extent) && !section.returns.last().is_some_and(|(_, last)| near(last)) {
            section.next_attempt = total + 2;
            return;
        }
        for prediction in section.returns.predictions(2, &extent) {
            self.settled = predicted(&section.returns, &prediction.state, known);
            if self.settled.is_some() {
                return;
            }
            if known.iter().any(|k| k.distance(&prediction.state) <= FAITHFUL) {
                // The limit may lie on that solution, but the trajectory is not close enough to be sure.
                section.next_attempt = total + 1;
                return;
            }
            // The fewest crossings come first: while their limit is in doubt, one over more crossings is no better.
            if !prediction.worthwhile() {
                section.next_attempt = total + 2;
                return;
            }
            if !section.lasts(&prediction) {
                return;
            }
            section.next_attempt = total + total / 2;
            let Some(candidate) = context.follow(&section.returns, &prediction, &extent) else { continue };
            if let Some(orbit) = context.polished(&candidate)
                && orbit.distance(&prediction.state) <= FAITHFUL
            {
                known.push(orbit);
                self.settled = predicted(&section.returns, &prediction.state, known);
                return;
            }
        }
    }
}

impl Section {
    /// True if the limit is the one predicted some returns ago. As a motion of several frequencies decays, the limit of
    /// each few returns is steady and yet drifts, which this check detects without integrating from the limit.
    fn lasts(&mut self, prediction: &Prediction) -> bool {
        let lasts = self.expected.take().is_some_and(|expected| expected.agrees(prediction, &self.extent));
        if !lasts {
            self.next_attempt = self.returns.total() + PATIENCE.max(2 * prediction.crossings);
            self.expected = Some(prediction.clone());
        }
        lasts
    }
}

/// Returns the known solution on which a predicted limit lies and which the trajectory has been approaching. (The limit
/// alone does not suffice: the mean over several turns that never become equal is also a steady limit.)
fn predicted(returns: &Returns, limit: &[f64], known: &[Orbit]) -> Option<usize> {
    let (_, last) = returns.last()?;
    known.iter().position(|orbit| {
        let here = orbit.distance(last);
        here <= NEIGHBOURHOOD
            && orbit.distance(limit) <= HIT * here + ARRIVED
            && returns.approach(|state| orbit.distance(state))
    })
}

/// Extent and time integral of the state over some steps.
#[derive(Clone, Debug)]
struct Window {
    low: Vec<f64>,
    high: Vec<f64>,
    integral: Vec<f64>,
    time: f64,
}

impl Window {
    fn new(n: usize) -> Window {
        Window { low: vec![f64::MAX; n], high: vec![f64::MIN; n], integral: vec![0.0; n], time: 0.0 }
    }

    /// Returns the extent `[n]`.
    fn extent(&self) -> Vec<f64> {
        self.low.iter().zip(&self.high).map(|(low, high)| high - low).collect()
    }

    /// Extends it by another window; the integral is left alone.
    fn include(&mut self, other: &Window) {
        for i in 0..self.low.len() {
            self.low[i] = self.low[i].min(other.low[i]);
            self.high[i] = self.high[i].max(other.high[i]);
        }
    }

    fn add(&mut self, x: &[f64], duration: f64) {
        self.time += duration;
        for i in 0..x.len() {
            self.low[i] = self.low[i].min(x[i]);
            self.high[i] = self.high[i].max(x[i]);
            self.integral[i] += duration * x[i];
        }
    }
}

/// Distance to the nearest known solution, as its largest value over windows of measurements.
#[derive(Clone, Debug, Default)]
struct Approach {
    nearest: usize,
    measurements: usize,
    largest: f64,
    /// Largest value in the first and in the last window of a steady approach, and number of windows.
    first: f64,
    last: f64,
    windows: usize,
    /// First solution approached to within each distance of [`RADII`].
    forecasts: [Option<usize>; RADII.len()],
}

impl Approach {
    /// Adds a measurement. Returns the index of the solution once the trajectory has settled there.
    fn measure(&mut self, x: &[f64], known: &[Orbit]) -> Option<usize> {
        const MEASUREMENTS: usize = 8;
        const WINDOWS: usize = 3;
        let distances = known.iter().map(|orbit| orbit.distance(x)).enumerate();
        let (nearest, distance) = distances.min_by(|a, b| a.1.total_cmp(&b.1))?;
        if nearest != self.nearest || self.measurements == 0 {
            *self = Approach { nearest, forecasts: self.forecasts, ..Approach::default() };
        }
        self.measurements += 1;
        self.largest = self.largest.max(distance);
        if !self.measurements.is_multiple_of(MEASUREMENTS) {
            return None;
        }
        let largest = std::mem::take(&mut self.largest);
        if self.windows > 0 && (largest < self.last || largest <= ARRIVED) {
            self.windows += 1;
        } else {
            (self.first, self.windows) = (largest, 1);
        }
        self.last = largest;
        let steady = self.windows >= WINDOWS;
        for (forecast, radius) in self.forecasts.iter_mut().zip(RADII) {
            if forecast.is_none() && steady && largest <= radius && largest <= APPROACHED * self.first {
                *forecast = Some(nearest);
            }
        }
        let close = largest <= ARRIVED || (largest <= CLOSE && largest <= APPROACHED * self.first);
        (steady && close).then_some(nearest)
    }
}
