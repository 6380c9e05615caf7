//! One trajectory on its way to a settled motion.
//!
//! **Idea.** At every return to a plane the limit of the returns is predicted. At the end of every window of steps the
//! extent of the motion is measured, and its limit is predicted if it shrinks. Each round ends in one of three ways:
//! the motion repeats itself or rests; it has been observed to contract, and continues close to the predicted limit; or
//! its steps are used up.

use super::Limits;
use super::returns::{PART, Prediction, Returns};
use super::settling::{First, INTEGRATION, Settled, Trial, lost};
use super::window::Window;
use crate::contract::{Batch, Parameters, Verdict};
use crate::diagram::Motion;
use crate::simulation::{Outcome, Step};

/// Steps per window.
const WINDOW: usize = 128;
/// Last difference of returns, relative to the extent, at which a cycle has settled.
const SETTLED: f64 = 1e-7;
/// Last difference at which a cycle counts as settled when no steps are left.
const NEARLY: f64 = 1e-4;
/// Extent of a window, relative to scale and size, at which a trajectory is at rest.
const RESTS: f64 = 1e-6;
/// Extent of a window, relative to scale and size, below which a shrinking motion is likely to come to rest.
const SMALL: f64 = 0.1;
/// Decrease of the extent over the windows of a round after which the limit is predicted.
const SHRUNK: f64 = 0.8;
/// Extent, relative to the scale, below which a motion is not a cycle.
const MOVES: f64 = 1e-4;
/// Number of windows over which the extent of a motion is measured.
const WINDOWS: usize = 4;
/// Number of steps for which the first plane is used; each later one of a round is used twice as long.
const PLANE: usize = 2048;
/// Steps after which the first round ends in any case.
const ROUGH: usize = 6144;
/// Largest number of predicted limits tried; after those the trajectory is left to itself.
pub(super) const JUMPS: usize = 8;
/// Steps of all rounds after which a motion counts as neither at rest nor periodic.
const STEPS: usize = 400_000;
/// Default limits of surveys and sweeps.
pub(super) const PATIENT: Limits = Limits { steps: STEPS, time: f64::INFINITY };
/// Number of predictions from which contraction can be detected.
const SEEN: usize = 12;
/// Contraction required over the predictions of a round: for few of them, and for many.
const CONTRACTED: [f64; 2] = [0.9, 0.97];

/// A plane and the record of its returns.
struct Plane {
    returns: Returns,
    /// Period and last difference of the prediction at every return.
    seen: Vec<(f64, f64)>,
    /// `[n]` extent with which the returns are compared, if that is not the one of the last windows.
    extent: Option<Vec<f64>>,
}

/// A trajectory and its record over several rounds.
pub(super) struct Runner {
    first: First,
    pub(super) start: Vec<f64>,
    parameters: Vec<f64>,
    pub(super) found: Option<Settled>,
    /// Largest number of steps over all rounds, and number taken.
    limit: usize,
    pub(super) steps: usize,
    pub(super) time: f64,
    pub(super) extent: Vec<f64>,
    /// True if the motion is larger than the remainder of one that comes to rest.
    moves: bool,
    /// Number of rounds that began at a predicted limit.
    jumps: usize,
    /// Steps taken in this round.
    round_steps: usize,
    /// Step of this round at which another plane is tried, and number of steps for which that one is used.
    plane_ends: usize,
    plane_life: usize,
    window: Window,
    /// Smallest and largest state in each of the last windows.
    boxes: Vec<[Vec<f64>; 2]>,
    /// A plane, and a part of one once a plane has been crossed too often.
    planes: [Option<Plane>; 2],
    /// Half-width of the part, relative to the extent of the motion.
    part: f64,
    /// Smallest and largest state since the planes were last renewed.
    span: Option<[Vec<f64>; 2]>,
    /// Extent of every window of the round, relative to scale and size.
    sizes: Vec<f64>,
    /// A cycle, to be confirmed by the current window: there must still be a motion.
    repeats: Option<Settled>,
    next: Option<Vec<f64>>,
    x: Vec<f64>,
}

impl Runner {
    pub(super) fn new(trial: &Trial, start: &[f64], first: First, limit: usize) -> Runner {
        let n = start.len();
        Runner {
            start: start.to_vec(),
            first,
            parameters: Vec::new(),
            found: None,
            limit,
            steps: 0,
            time: 0.0,
            extent: trial.scales.to_vec(),
            moves: true,
            jumps: 0,
            round_steps: 0,
            plane_ends: 0,
            plane_life: PLANE,
            window: Window::new(n),
            boxes: Vec::new(),
            planes: [None, None],
            part: PART,
            span: None,
            sizes: Vec::new(),
            repeats: None,
            next: None,
            x: vec![0.0; n],
        }
    }

    pub(super) fn begin(&mut self, parameters: Vec<f64>) {
        self.parameters = parameters;
        (self.round_steps, self.window) = (0, Window::new(self.start.len()));
        self.boxes.clear();
        self.sizes.clear();
        (self.next, self.repeats) = (None, None);
        // The planes of the previous round are shifted to the new start.
        for plane in self.planes.iter_mut().flatten() {
            *plane =
                Plane { returns: plane.returns.again_from(&self.start), seen: Vec::new(), extent: plane.extent.take() };
        }
        self.span = None;
        (self.plane_life, self.plane_ends) = (PLANE, if self.planes[0].is_some() { PLANE } else { 0 });
    }

    pub(super) fn observe(&mut self, step: &Step, trial: &Trial) -> Verdict {
        let mut x = std::mem::take(&mut self.x);
        step.end_into(&mut x);
        self.steps += 1;
        self.round_steps += 1;
        self.window.add(&x, step);
        for place in 0..self.planes.len() {
            if let Some(mut plane) = self.planes[place].take() {
                if plane.returns.follow(step, &x) {
                    self.at_return(&mut plane, step);
                }
                self.planes[place] = Some(plane);
            }
        }
        if self.round_steps.is_multiple_of(WINDOW) && self.found.is_none() && self.next.is_none() {
            self.close_window(step, &x, trial);
        }
        self.x = x;
        // At its low accuracy the first round does not resolve the contraction of small motions.
        let rough = self.is_rough() && self.steps >= ROUGH;
        let over = self.found.is_some() || self.next.is_some() || self.steps >= self.limit || rough;
        if over { Verdict::Stop } else { Verdict::Continue }
    }

    fn is_rough(&self) -> bool {
        self.first == First::Rough && self.steps == self.round_steps
    }

    /// Evaluates the returns to a plane so far.
    fn at_return(&mut self, plane: &mut Plane, step: &Step) {
        let Plane { returns, seen, extent } = plane;
        let extent = extent.as_ref().unwrap_or(&self.extent);
        // The longer a round lasts, the less a single return adds.
        if returns.total() > 200 && !returns.total().is_multiple_of(returns.total() / 100) {
            return;
        }
        let Some(prediction) = returns.closest(extent) else { return };
        let Prediction { state, period, size, doubt, .. } = prediction;
        // A different number of crossings per period starts a new record.
        if seen.last().is_some_and(|(known, _)| (period - known).abs() > 0.02 * known) {
            seen.clear();
        }
        seen.push((period, size));
        let Some((_, last)) = returns.last() else { return };
        let latest = |count: usize| seen.iter().rev().take(count).fold(0.0, |m: f64, (_, size)| m.max(*size));
        let few = seen.len() < SEEN;
        // Differences that no longer decrease, close to the accuracy of the integration, count as settled too.
        let settled = (seen.len() >= 4 && latest(4) <= SETTLED)
            || (seen.len() >= 5 * SEEN && latest(2 * SEEN) <= 20.0 * SETTLED && !contracts(seen));
        if settled && self.moves {
            self.repeats = Some(Settled {
                motion: Motion::Cycle,
                state: last.to_vec(),
                period,
                extent: extent.clone(),
                time: self.time + step.end_time(),
                error: latest(4),
                found: None,
            });
        } else if !few && self.moves && self.repeats.is_none() && self.jumps < JUMPS && contracts(seen) {
            self.jumps += 1;
            let share = (5.0 * doubt / size).clamp(1e-3, 0.1);
            self.next = Some(state.iter().zip(last).map(|(limit, y)| limit + share * (y - limit)).collect());
        }
    }

    /// Evaluates the last window: detects rest, and measures the extent of the motion.
    fn close_window(&mut self, step: &Step, x: &[f64], trial: &Trial) {
        let window = std::mem::replace(&mut self.window, Window::new(x.len()));
        let extent: Vec<f64> = (0..x.len()).map(|i| window.high[i] - window.low[i]).collect();
        let size = (0..x.len()).fold(0.0, |m: f64, i| m.max(extent[i] / (trial.scales[i] + x[i].abs())));
        if size <= RESTS {
            let time = self.time + step.end_time();
            let extent = trial.scales.to_vec();
            // Midpoint of the extrema of the remaining motion.
            let state = (0..x.len()).map(|i| 0.5 * (window.high[i] + window.low[i])).collect();
            // With long steps the trajectory can stand still beside the equilibrium, within the integration tolerance.
            let error = size.max(INTEGRATION[usize::from(!self.is_rough())]);
            self.found =
                Some(Settled { motion: Motion::Equilibrium, state, period: 0.0, extent, time, error, found: None });
            return;
        }
        self.sizes.push(size);
        self.try_rest(&window, x, trial);
        self.renew_extent(&window, trial);
        if let Some(repeats) = self.repeats.take().filter(|_| self.moves) {
            // The first round is not accurate enough to be the last.
            match self.is_rough() {
                true => self.next = Some(repeats.state),
                false => self.found = Some(repeats),
            }
            return;
        }
        // The first windows of the first round are transient; a plane through them may not intersect the motion.
        if self.round_steps >= self.plane_ends && self.steps >= 2 * WINDOW {
            self.renew_planes(step, x, trial);
        }
    }

    /// Starts a new plane at the end of a step, and a part of one if the plane is crossed so often that no period shows.
    fn renew_planes(&mut self, step: &Step, x: &[f64], trial: &Trial) {
        let velocity: Vec<f64> = (0..x.len()).map(|i| step.end_slope(i)).collect();
        let across = |extent: &[f64]| Returns::across(x.to_vec(), &velocity, extent, INTEGRATION[0]);
        let [whole, part] = &mut self.planes;
        let crowded = |plane: &Option<Plane>| plane.as_ref().is_some_and(|plane| plane.returns.crowded());
        if crowded(part) {
            self.part *= 0.5;
        }
        // A part that the motion has returned to is kept.
        let another = part.as_ref().is_some_and(|part| part.returns.crowded() || part.returns.total() < 2);
        if let Some([low, high]) = self.span.take()
            && (another || part.is_none() && crowded(whole))
        {
            let own = |i: usize| (high[i] - low[i]).max(1e-6 * trial.scales[i]);
            let span: Vec<f64> = (0..x.len()).map(own).collect();
            let reach = span.iter().map(|own| self.part * own).collect();
            *part = Some(Plane { returns: across(&span).within(reach), seen: Vec::new(), extent: Some(span) });
        }
        *whole = Some(Plane { returns: across(&self.extent), seen: Vec::new(), extent: None });
        self.plane_ends = self.round_steps + self.plane_life;
        self.plane_life *= 2;
    }

    /// Updates the extent over the last windows; a cycle may take longer than one.
    fn renew_extent(&mut self, window: &Window, trial: &Trial) {
        if self.boxes.len() == WINDOWS {
            self.boxes.remove(0);
        }
        self.boxes.push([window.low.clone(), window.high.clone()]);
        let span = self.span.get_or_insert_with(|| [window.low.clone(), window.high.clone()]);
        for i in 0..window.low.len() {
            (span[0][i], span[1][i]) = (span[0][i].min(window.low[i]), span[1][i].max(window.high[i]));
        }
        let span = |i: usize| {
            let low = self.boxes.iter().map(|[low, _]| low[i]).fold(f64::MAX, f64::min);
            self.boxes.iter().map(|[_, high]| high[i]).fold(f64::MIN, f64::max) - low
        };
        let extent: Vec<f64> = (0..window.low.len()).map(|i| span(i).max(1e-6 * trial.scales[i])).collect();
        // The last window alone: a motion that comes to rest quickly was large a few windows ago.
        let own = |i: usize| window.high[i] - window.low[i];
        self.moves = (0..extent.len()).any(|i| own(i) > (0.2 * extent[i]).max(MOVES * trial.scales[i]));
        self.extent = extent;
    }

    /// Continues from the predicted limit of a window if the motion has been shrinking and f is much smaller there.
    fn try_rest(&mut self, window: &Window, x: &[f64], trial: &Trial) {
        let third = self.sizes.len() / 3;
        if third < 3 {
            return;
        }
        let largest = |part: &[f64]| part.iter().copied().fold(0.0, f64::max);
        let [a, b, c] = [&self.sizes[..third], &self.sizes[third..2 * third], &self.sizes[2 * third..]].map(largest);
        // A motion shrinks to a cycle ever more slowly, but to rest by a constant factor.
        if !(c < SMALL && c <= SHRUNK * a && c * a <= 1.05 * b * b) {
            return;
        }
        let Some(limit) = window.limit(trial.scales) else { return };
        let speed = |x: &[f64]| {
            let mut f = vec![0.0; x.len()];
            let at =
                Batch { lanes: 1, states: x, parameters: Parameters::Shared(&self.parameters), times: &[], signs: &[] };
            trial.field.evaluate(at, &mut f);
            f.iter().zip(trial.scales).fold(0.0, |m: f64, (f, s)| m.max((f / s).abs()))
        };
        let doubt = speed(&limit) / window.speed(trial.scales);
        if doubt < 0.1 && self.jumps < JUMPS {
            self.jumps += 1;
            let share = (5.0 * doubt).clamp(1e-3, 0.5);
            self.next = Some(limit.iter().zip(x).map(|(limit, x)| limit + share * (x - limit)).collect());
        }
    }

    /// Returns a cycle that repeats itself less accurately than required, for use when no steps are left.
    fn nearly(&self) -> Option<Settled> {
        let of = |plane: &Plane| {
            let (_, state) = plane.returns.last()?;
            let (period, _) = *plane.seen.last()?;
            let error = plane.seen.iter().rev().take(2 * SEEN).fold(0.0, |m: f64, (_, size)| m.max(*size));
            let repeats = self.moves && plane.seen.len() >= 2 * SEEN && error <= NEARLY;
            let (state, extent, time) = (state.to_vec(), self.extent.clone(), self.time);
            repeats.then_some(Settled { motion: Motion::Cycle, state, period, extent, time, error, found: None })
        };
        self.planes.iter().flatten().find_map(of)
    }

    /// Ends the round.
    pub(super) fn end(&mut self, time: f64, state: Vec<f64>, outcome: Outcome) {
        self.time += time;
        let extent = self.extent.clone();
        let gone = lost(outcome);
        if self.found.is_none() && gone.is_none() && self.steps >= self.limit {
            self.found = self.nearly();
        }
        if self.found.is_none() && (gone.is_some() || self.steps >= self.limit) {
            let motion = gone.unwrap_or(Motion::Other);
            self.found = Some(Settled {
                motion,
                state: state.clone(),
                period: 0.0,
                extent,
                time: self.time,
                error: f64::NAN,
                found: None,
            });
        }
        self.start = self.next.take().unwrap_or(state);
    }
}

/// True if the differences of the returns decrease: the largest of each third is smaller than that of the third before.
fn contracts(seen: &[(f64, f64)]) -> bool {
    let third = seen.len() / 3;
    let largest = |part: &[(f64, f64)]| part.iter().fold(0.0, |m: f64, (_, size)| m.max(*size));
    let [a, b, c] = [&seen[..third], &seen[third..2 * third], &seen[2 * third..]].map(largest);
    let needed = if seen.len() < 100 { CONTRACTED[0] } else { CONTRACTED[1] };
    b < a && c < b && c <= needed * a
}
