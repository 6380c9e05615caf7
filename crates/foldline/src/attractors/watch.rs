//! Watching one trajectory until one can say where it goes.
//!
//! **Idea.** Three things are watched. The extent of the motion over a window of steps: where it shrinks, an equilibrium may be
//! near. The returns to a section: their predicted limit may lie on a cycle. The distance to every solution found so far: where
//! its largest value per window falls steadily, the trajectory has settled there.

use super::Candidate;
use super::candidate::Context;
use super::orbit::Orbit;
use super::returns::{Prediction, Returns};
use crate::contract::Verdict;
use crate::diagram::Solution;
use crate::simulation::Step;

/// Steps per window: a few periods of a cycle, some time constants of an equilibrium.
const WINDOW: usize = 128;
/// Steps between measurements of the distance to known solutions.
const PULSE: usize = 16;
/// Steps after which a first section that saw no cycle is replaced; each later one lives twice as long.
const FIRST_SECTION: usize = 1024;

/// Shrinking of the extent after which an equilibrium is tried again.
const SHRUNK: f64 = 0.7;
/// Distance, relative to the size of the solution, below which a steady approach counts …
const CLOSE: f64 = 0.05;
/// … once the distance has fallen to this fraction of what it was when the approach began.
const APPROACHED: f64 = 0.5;
/// Distance at which a trajectory that stays that close is on the solution: the sag of the polygon that stands for it.
pub(super) const ARRIVED: f64 = 3e-3;
/// A predicted limit settles a trajectory no farther away than this …
const NEIGHBOURHOOD: f64 = 0.1;
/// … if it is this much closer to the solution than the trajectory is.
const HIT: f64 = 0.1;
/// Returns after which a predicted limit must still be the same to be followed.
const PATIENCE: usize = 8;
/// How far from the candidate a polished solution may lie.
const FAITHFUL: f64 = 0.1;

/// The watch over one trajectory.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    /// Index of the solution to which the trajectory was seen to go.
    pub(super) settled: Option<usize>,
    steps: usize,
    x: Vec<f64>,
    window: Window,
    /// `[n]` extent over the last complete window.
    extent: Option<Vec<f64>>,
    /// Largest scaled extent at which the next equilibrium is tried.
    try_equilibrium_below: f64,
    returns: Returns,
    section_ends: usize,
    section_life: usize,
    next_attempt: usize,
    /// A limit that is followed if it is still predicted at the next attempt.
    expected: Option<Prediction>,
    approach: Approach,
}

impl Watch {
    pub(super) fn new(n: usize) -> Watch {
        Watch {
            settled: None,
            steps: 0,
            x: vec![0.0; n],
            window: Window::new(n),
            extent: None,
            try_equilibrium_below: f64::INFINITY,
            returns: Returns::default(),
            section_ends: 0,
            section_life: FIRST_SECTION,
            next_attempt: 0,
            expected: None,
            approach: Approach::default(),
        }
    }

    /// Takes note of a step; `known` holds the solutions found so far and grows by those found here.
    pub(super) fn observe(&mut self, step: &Step, known: &mut Vec<Orbit>, context: &Context) -> Verdict {
        let mut x = std::mem::take(&mut self.x);
        step.end_into(&mut x);
        self.steps += 1;
        self.window.add(&x, step.end_time() - step.start_time());
        if self.steps.is_multiple_of(PULSE) {
            self.settled = self.approach.measure(&x, known);
        }
        if self.extent.is_some() && self.settled.is_none() && self.returns.follow(step, &x) {
            self.try_cycle(known, context);
        }
        if self.steps.is_multiple_of(WINDOW) && self.settled.is_none() {
            self.close_window(step, &x, known, context);
        }
        self.x = x;
        if self.settled.is_some() { Verdict::Stop } else { Verdict::Continue }
    }

    /// Evaluates a window of steps: tries an equilibrium where the motion shrinks, and renews the section.
    fn close_window(&mut self, step: &Step, x: &[f64], known: &mut Vec<Orbit>, context: &Context) {
        let scales = &context.sampling.scales;
        let window = std::mem::replace(&mut self.window, Window::new(x.len()));
        let extent: Vec<f64> = (0..x.len()).map(|i| window.high[i] - window.low[i]).collect();
        let size = (0..x.len()).fold(0.0, |m: f64, i| m.max(extent[i] / scales[i]));
        // The first window is the transient.
        if self.extent.is_none() {
            self.try_equilibrium_below = SHRUNK * size;
        } else if size <= self.try_equilibrium_below {
            self.try_equilibrium_below = SHRUNK * size;
            let mean: Vec<f64> = window.integral.iter().map(|s| s / window.time).collect();
            let candidate = self.closer_to_rest(mean, step, x, context);
            self.try_equilibrium(candidate, &extent, known, context);
        }
        // A component that does not move is measured against a small part of its scale.
        self.extent = Some((0..x.len()).map(|i| extent[i].max(1e-6 * scales[i])).collect());
        if self.steps >= self.section_ends
            && let Some(extent) = &self.extent
        {
            let velocity: Vec<f64> = (0..x.len()).map(|i| step.end_slope(i)).collect();
            self.returns = Returns::across(x.to_vec(), &velocity, extent, context.accuracy);
            self.section_ends = self.steps + self.section_life;
            self.section_life *= 2;
            (self.next_attempt, self.expected) = (0, None);
        }
    }

    /// The mean of a window or its last state, whichever has the smaller f: a mean suits a spiral, the last state a node.
    fn closer_to_rest(&self, mean: Vec<f64>, step: &Step, x: &[f64], context: &Context) -> Vec<f64> {
        let f = context.slope(&mean);
        let speed = |component: &dyn Fn(usize) -> f64| {
            (0..x.len()).map(|i| (component(i) / context.sampling.scales[i]).abs()).fold(0.0, f64::max)
        };
        let of_mean = speed(&|i| f[i]);
        if of_mean <= speed(&|i| step.end_slope(i)) { mean } else { x.to_vec() }
    }

    fn try_equilibrium(&mut self, x: Vec<f64>, extent: &[f64], known: &mut Vec<Orbit>, context: &Context) {
        // An explicit method with steps as long as they can be may stand still at some errors of a step from the equilibrium.
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

    /// Looks for a limit of the returns, at every return at first and more and more rarely while none is found.
    fn try_cycle(&mut self, known: &mut Vec<Orbit>, context: &Context) {
        if self.returns.total() < self.next_attempt {
            return;
        }
        let Some(extent) = self.extent.clone() else { return };
        // Far from everything known, and not nearly back anywhere: nothing below could come of it.
        let near = |last: &[f64]| known.iter().any(|k| k.distance(last) <= NEIGHBOURHOOD);
        if !self.returns.comes_back(&extent) && !self.returns.last().is_some_and(|(_, last)| near(last)) {
            self.next_attempt = self.returns.total() + 2;
            return;
        }
        for prediction in self.returns.predictions(2, &extent) {
            self.settled = self.predicted(&prediction.state, known);
            if self.settled.is_some() {
                return;
            }
            if known.iter().any(|k| k.distance(&prediction.state) <= FAITHFUL) {
                // The limit may lie on that solution, but the trajectory is not close enough to be sure.
                self.next_attempt = self.returns.total() + 1;
                return;
            }
            // The fewest crossings per period come first: while their limit is in doubt, one over more of them is no better.
            if !prediction.worthwhile() {
                self.next_attempt = self.returns.total() + 2;
                return;
            }
            if !self.lasts(&prediction, &extent) {
                return;
            }
            self.next_attempt = self.returns.total() + self.returns.total() / 2;
            let Some(candidate) = context.follow(&self.returns, &prediction, &extent) else { continue };
            if let Some(orbit) = context.polished(&candidate)
                && orbit.distance(&prediction.state) <= FAITHFUL
            {
                known.push(orbit);
                self.settled = self.predicted(&prediction.state, known);
                return;
            }
        }
    }

    /// Whether the limit is the one that was predicted some returns ago. Where a motion of several frequencies fades, the
    /// limit of each few returns is steady and yet moves on; that is seen at no cost, unlike by following it.
    fn lasts(&mut self, prediction: &Prediction, extent: &[f64]) -> bool {
        let lasts = self.expected.take().is_some_and(|expected| expected.agrees(prediction, extent));
        if !lasts {
            self.next_attempt = self.returns.total() + PATIENCE.max(2 * prediction.crossings);
            self.expected = Some(prediction.clone());
        }
        lasts
    }

    /// The solution on which a predicted limit lies, and to which the trajectory has been coming closer. (The limit alone
    /// does not tell: the mean over several turns that never become the same is a steady limit too.)
    fn predicted(&self, limit: &[f64], known: &[Orbit]) -> Option<usize> {
        let (_, last) = self.returns.last()?;
        known.iter().position(|orbit| {
            let here = orbit.distance(last);
            here <= NEIGHBOURHOOD
                && orbit.distance(limit) <= HIT * here + ARRIVED
                && self.returns.approach(|state| orbit.distance(state))
        })
    }
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

    fn add(&mut self, x: &[f64], duration: f64) {
        self.time += duration;
        for i in 0..x.len() {
            self.low[i] = self.low[i].min(x[i]);
            self.high[i] = self.high[i].max(x[i]);
            self.integral[i] += duration * x[i];
        }
    }
}

/// The distance to the nearest known solution, as its largest value over windows of measurements.
#[derive(Clone, Debug, Default)]
struct Approach {
    nearest: usize,
    measurements: usize,
    largest: f64,
    /// Largest value of the first and of the last window of a steady approach, and how many windows it lasted.
    first: f64,
    last: f64,
    windows: usize,
}

impl Approach {
    /// Adds a measurement; the index of the solution once the trajectory has settled there.
    fn measure(&mut self, x: &[f64], known: &[Orbit]) -> Option<usize> {
        const MEASUREMENTS: usize = 8;
        const WINDOWS: usize = 3;
        let distances = known.iter().map(|orbit| orbit.distance(x)).enumerate();
        let (nearest, distance) = distances.min_by(|a, b| a.1.total_cmp(&b.1))?;
        if nearest != self.nearest || self.measurements == 0 {
            *self = Approach { nearest, ..Approach::default() };
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
        let close = largest <= ARRIVED || (largest <= CLOSE && largest <= APPROACHED * self.first);
        (steady && close).then_some(nearest)
    }
}
