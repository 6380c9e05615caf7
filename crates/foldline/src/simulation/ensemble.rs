//! Many trajectories integrated together.
//!
//! **Idea.** All trajectories that still run are the lanes of one batch. In each sweep every lane tries one step of its own
//! length; those whose error is too large try again with a shorter one in the next sweep, and lanes that are finished are
//! taken out of the batch.
//!
//! **Equations.** The pair of the tableau, and with err the root mean square of errorᵢ / (absoluteᵢ + relative max(|x₀|, |x₁|)ᵢ):
//!
//!   (1)  h_new = h · clamp( 0.9 err^-α err_prev^β, 1/5, 10 ),   β = 0.04, α = 1/5 - 3β/4
//!
//! where after a rejection h does not grow.
//!
//! **Source.** hairer1993, §II.4 (step control and first step); hairer1996, §IV.2 (the second factor of (1)).
//!
//! **Departures.** A lane is computed from its own numbers only, so its result depends neither on the other lanes nor on
//! how many there are, provided the vector field keeps its lanes apart too.
//!
//! **Fails when** f or a derivative jumps where the field names no switch: the step shrinks there and the order is lost. A
//! trajectory that slides along a switch ends there.

mod switching;

use super::kink::PLACES;
use super::shortened::Shortened;
use super::tableau::{A, ERROR, STAGES};
use super::{Arrival, Outcome, Step, Tolerance};
use crate::contract::{Batch, Parameters, VectorField, Verdict};

const SAFETY: f64 = 0.9;
const BETA: f64 = 0.04;
const ALPHA: f64 = 0.2 - 0.75 * BETA;
/// Beyond this multiple of 1 + |start| in any component a trajectory is taken to run to infinity.
const BOUND: f64 = 1e12;

/// At rest the step grows without end; beyond this length the arithmetic would overflow.
const LONGEST: f64 = 1e100;

/// A batch of trajectories under way.
pub struct Ensemble<'a> {
    field: &'a dyn VectorField,
    parameters: &'a [f64],
    /// `[k × lanes]` where every trajectory has parameters of its own, else empty.
    own: Vec<f64>,
    tolerance: Tolerance,
    n: usize,
    /// End of the time span, and the sign of the direction in which it lies.
    end: f64,
    sign: f64,
    step_limit: usize,
    longest: f64,
    lanes: Vec<Lane>,
    /// `[n × lanes]`.
    x: Vec<f64>,
    next: Vec<f64>,
    stage: Vec<f64>,
    slopes: [Vec<f64>; STAGES],
    /// `[switches × lanes]`: the sign of each, and its value at the start of the step, 0 where it has just changed sign.
    signs: Vec<f64>,
    switches: Vec<f64>,
    /// `[switches × lanes]` values at each of [`PLACES`].
    ahead: [Vec<f64>; PLACES.len()],
    arrivals: Vec<Option<Arrival>>,
}

/// What a lane knows besides its state.
#[derive(Clone, Debug)]
struct Lane {
    trajectory: usize,
    time: f64,
    /// Signed length of the step to try.
    step: f64,
    previous_error: f64,
    just_rejected: bool,
    steps: usize,
    rejected: usize,
    bound: f64,
    /// How often in succession a switch changed sign without getting on.
    stuck: usize,
    done: Option<Outcome>,
}

impl<'a> Ensemble<'a> {
    /// Trajectories from `starts` `[count][n]`, all over the time span `span[0]` to `span[1]` (which may lie before it).
    pub fn new(
        field: &'a dyn VectorField,
        parameters: &'a [f64],
        tolerance: Tolerance,
        starts: &[f64],
        span: [f64; 2],
    ) -> Ensemble<'a> {
        Ensemble::begun(field, parameters, Vec::new(), tolerance, starts, span)
    }

    /// The same with parameters of its own for every trajectory: `parameters` `[count][k]`.
    pub fn with_own_parameters(
        field: &'a dyn VectorField,
        parameters: &[f64],
        tolerance: Tolerance,
        starts: &[f64],
        span: [f64; 2],
    ) -> Ensemble<'a> {
        let count = starts.len().checked_div(field.dim()).unwrap_or(0);
        let k = field.parameter_count();
        let own = (0..k).flat_map(|p| (0..count).map(move |l| parameters[l * k + p])).collect();
        Ensemble::begun(field, &[], own, tolerance, starts, span)
    }

    fn begun(
        field: &'a dyn VectorField,
        parameters: &'a [f64],
        own: Vec<f64>,
        tolerance: Tolerance,
        starts: &[f64],
        span: [f64; 2],
    ) -> Ensemble<'a> {
        let n = field.dim();
        let count = starts.len().checked_div(n).unwrap_or(0);
        let mut x = vec![0.0; n * count];
        let mut lanes = Vec::with_capacity(count);
        for (l, start) in starts.chunks_exact(n.max(1)).enumerate() {
            (0..n).for_each(|i| x[i * count + l] = start[i]);
            lanes.push(Lane {
                trajectory: l,
                time: span[0],
                step: 0.0,
                previous_error: 1e-4,
                just_rejected: false,
                steps: 0,
                rejected: 0,
                bound: BOUND * (1.0 + crate::linalg::max_abs(start)),
                stuck: 0,
                done: None,
            });
        }
        let switches = vec![0.0; field.switch_count() * count];
        let mut ensemble = Ensemble {
            field,
            parameters,
            own,
            tolerance,
            n,
            end: span[1],
            sign: if span[1] < span[0] { -1.0 } else { 1.0 },
            step_limit: usize::MAX,
            longest: LONGEST,
            lanes,
            next: vec![0.0; n * count],
            stage: vec![0.0; n * count],
            slopes: std::array::from_fn(|_| vec![0.0; n * count]),
            x,
            signs: vec![1.0; switches.len()],
            ahead: std::array::from_fn(|_| switches.clone()),
            switches,
            arrivals: vec![None; count],
        };
        ensemble.begin();
        ensemble
    }

    /// Ends a trajectory after this many accepted and rejected steps.
    pub fn with_step_limit(mut self, limit: usize) -> Ensemble<'a> {
        self.step_limit = limit;
        self
    }

    /// No step is longer than this time, which is positive.
    pub fn with_longest_step(mut self, longest: f64) -> Ensemble<'a> {
        self.longest = longest.min(LONGEST);
        self.lanes.iter_mut().for_each(|lane| lane.step = lane.step.max(-self.longest).min(self.longest));
        self
    }

    /// Integrates until every trajectory has ended; `observe` sees every accepted step and may stop its trajectory there.
    /// Returns the arrivals in the order of the starts.
    pub fn run(mut self, observe: &mut dyn FnMut(&Step) -> Verdict) -> Vec<Arrival> {
        let mut again = Shortened::new(self.field);
        self.remove_finished();
        while !self.lanes.is_empty() {
            self.advance_stages();
            self.look_ahead();
            for (l, error) in self.errors().into_iter().enumerate() {
                self.judge(l, error, &mut again, observe);
            }
            self.remove_finished();
        }
        self.arrivals.into_iter().flatten().collect()
    }

    fn evaluate(&mut self, k: usize, of: Source) {
        let states = match of {
            Source::Start => &self.x,
            Source::Stage => &self.stage,
            Source::End => &self.next,
        };
        let batch = Batch { lanes: self.lanes.len(), states, parameters: shared_or_own(self.parameters, &self.own) };
        match self.signs.is_empty() {
            true => self.field.evaluate(batch, &mut self.slopes[k]),
            false => self.field.evaluate_switched(batch, &self.signs, &mut self.slopes[k]),
        }
    }

    /// The step that lane `l` tries.
    fn step_of(&self, l: usize) -> Step<'_> {
        let lane = &self.lanes[l];
        let last = (self.end - lane.time - lane.step) * self.sign <= 0.0;
        Step {
            trajectory: lane.trajectory,
            column: l,
            lanes: self.lanes.len(),
            time: lane.time,
            length: lane.step,
            end_time: if last { self.end } else { lane.time + lane.step },
            from: &self.x,
            to: &self.next,
            slopes: &self.slopes,
            parameters: shared_or_own(self.parameters, &self.own),
            signs: &self.signs,
        }
    }

    /// First slopes and first step lengths.
    fn begin(&mut self) {
        if self.lanes.is_empty() {
            return;
        }
        let (n, lanes) = (self.n, self.lanes.len());
        self.first_signs();
        self.evaluate(0, Source::Start);
        let mut size = vec![[0.0; 2]; lanes];
        for i in 0..n {
            for l in 0..lanes {
                let weight = 1.0 / (self.tolerance.absolute[i] + self.tolerance.relative * self.x[i * lanes + l].abs());
                size[l][0] += (self.x[i * lanes + l] * weight).powi(2);
                size[l][1] += (self.slopes[0][i * lanes + l] * weight).powi(2);
            }
        }
        for (lane, [x, f]) in self.lanes.iter_mut().zip(&size) {
            let span = (self.end - lane.time).abs();
            let h = if *x > 1e-10 && *f > 1e-10 { 0.01 * (x / f).sqrt() } else { 1e-6 };
            lane.step = self.sign * h.min(span);
        }
        for i in 0..n {
            for l in 0..lanes {
                self.stage[i * lanes + l] = self.x[i * lanes + l] + self.lanes[l].step * self.slopes[0][i * lanes + l];
            }
        }
        self.evaluate(1, Source::Stage);
        for l in 0..lanes {
            let curvature = (0..n).map(|i| {
                let at = i * lanes + l;
                let weight = 1.0 / (self.tolerance.absolute[i] + self.tolerance.relative * self.x[at].abs());
                ((self.slopes[1][at] - self.slopes[0][at]) * weight).powi(2)
            });
            let h = self.lanes[l].step.abs();
            let largest = (curvature.sum::<f64>().sqrt() / h.max(1e-300)).max(size[l][1].sqrt()) / (n as f64).sqrt();
            let second = if largest > 1e-15 { (0.01 / largest).powf(0.2) } else { (h * 1e-3).max(1e-6) };
            let span = (self.end - self.lanes[l].time).abs();
            let finite = (0..n).all(|i| self.x[i * lanes + l].is_finite() && self.slopes[0][i * lanes + l].is_finite());
            let lane = &mut self.lanes[l];
            // f may be undefined at the trial point although it is not at the start.
            let step = if second.is_finite() { second.min(100.0 * h).min(span) } else { (1e-3 * h).min(span) };
            lane.step = self.sign * step;
            lane.done = if !finite {
                Some(Outcome::Escaped)
            } else if span == 0.0 {
                Some(Outcome::Reached)
            } else {
                None
            };
        }
    }

    /// Stages 2 to 7 of every lane.
    fn advance_stages(&mut self) {
        let lanes = self.lanes.len();
        let h: Vec<f64> = self.lanes.iter().map(|lane| lane.step).collect();
        for (s, row) in A.iter().enumerate() {
            let target = if s + 2 == STAGES { &mut self.next } else { &mut self.stage };
            target.fill(0.0);
            for (a, k) in row.iter().zip(&self.slopes).filter(|(a, _)| **a != 0.0) {
                target.iter_mut().zip(k).for_each(|(t, k)| *t += a * k);
            }
            for (target, x) in target.chunks_exact_mut(lanes).zip(self.x.chunks_exact(lanes)) {
                for ((t, x), h) in target.iter_mut().zip(x).zip(&h) {
                    *t = x + h * *t;
                }
            }
            self.evaluate(s + 1, if s + 2 == STAGES { Source::End } else { Source::Stage });
        }
    }

    /// The error of the step that every lane tried, in units of the tolerance; NaN if anything is not finite.
    fn errors(&self) -> Vec<f64> {
        let lanes = self.lanes.len();
        let mut e = vec![0.0; self.n * lanes];
        for (weight, k) in ERROR.iter().zip(&self.slopes).filter(|(weight, _)| **weight != 0.0) {
            e.iter_mut().zip(k).for_each(|(e, k)| *e += weight * k);
        }
        let mut sum = vec![0.0; lanes];
        for (i, e) in e.chunks_exact(lanes).enumerate() {
            let (absolute, relative) = (self.tolerance.absolute[i], self.tolerance.relative);
            let span = i * lanes..(i + 1) * lanes;
            let ends = self.x[span.clone()].iter().zip(&self.next[span]);
            for ((sum, e), (x, next)) in sum.iter_mut().zip(e).zip(ends) {
                let scaled = e / (absolute + relative * x.abs().max(next.abs()));
                *sum += scaled * scaled;
            }
        }
        let mean = 1.0 / self.n as f64;
        self.lanes.iter().zip(&sum).map(|(lane, sum)| lane.step.abs() * (sum * mean).sqrt()).collect()
    }

    /// Makes the step of lane `l` shorter after an error that is too large.
    fn reject(&mut self, l: usize, error: f64) {
        let factor = if error.is_finite() { (SAFETY * error.powf(-ALPHA)).clamp(0.2, 1.0) } else { 0.2 };
        let lane = &mut self.lanes[l];
        lane.rejected += 1;
        lane.just_rejected = true;
        lane.step *= factor;
        if lane.step.abs() <= 4.0 * f64::EPSILON * lane.time.abs() || lane.step.abs() < 1e-300 {
            lane.done = Some(if error.is_finite() { Outcome::StepTooSmall } else { Outcome::Escaped });
        } else if lane.steps + lane.rejected >= self.step_limit {
            lane.done = Some(Outcome::StepLimit);
        }
    }

    /// Accepts or rejects the step of lane `l`.
    fn judge(&mut self, l: usize, error: f64, again: &mut Shortened, observe: &mut dyn FnMut(&Step) -> Verdict) {
        let (n, lanes) = (self.n, self.lanes.len());
        if !error.is_finite() || error > 1.0 {
            return self.reject(l, error);
        }
        let tried = self.lanes[l].step;
        let kink = self.shortened(l, again);
        let step = self.step_of(l);
        let (end_time, last) = (step.end_time, step.end_time == self.end);
        let nowhere = kink.as_ref().is_some_and(|kink| kink.theta == 0.0);
        let verdict = if nowhere { Verdict::Continue } else { observe(&step) };
        let mut inside = true;
        for i in 0..n {
            let at = i * lanes + l;
            inside &= self.next[at].abs() <= self.lanes[l].bound;
            self.x[at] = self.next[at];
            self.slopes[0][at] = self.slopes[STAGES - 1][at];
        }
        let end = &self.ahead[PLACES.len() - 1];
        self.switches.iter_mut().zip(end).skip(l).step_by(lanes).for_each(|(value, end)| *value = *end);
        let lane = &mut self.lanes[l];
        lane.time = end_time;
        lane.steps += 1;
        // (1)
        let growth = SAFETY * error.max(1e-10).powf(-ALPHA) * lane.previous_error.powf(BETA);
        let growth = growth.clamp(0.2, if lane.just_rejected { 1.0 } else { 10.0 });
        lane.previous_error = error.max(1e-4);
        lane.just_rejected = false;
        lane.step = (tried * growth).max(-self.longest).min(self.longest);
        let remaining = self.end - end_time;
        // A last step a little longer than planned saves a tiny one.
        if lane.step.abs() * 1.01 >= remaining.abs() {
            lane.step = remaining;
        }
        lane.done = if !inside {
            Some(Outcome::Escaped)
        } else if verdict == Verdict::Stop {
            Some(Outcome::Stopped)
        } else if last {
            Some(Outcome::Reached)
        } else if lane.steps + lane.rejected >= self.step_limit {
            Some(Outcome::StepLimit)
        } else {
            None
        };
        if let Some(kink) = kink.filter(|_| self.lanes[l].done.is_none()) {
            self.renew_switches(l, again);
            self.pass(l, &kink, again);
        }
    }

    /// Takes the lanes that are done out of the batch.
    fn remove_finished(&mut self) {
        if self.lanes.iter().all(|lane| lane.done.is_none()) {
            return;
        }
        let lanes = self.lanes.len();
        for (l, lane) in self.lanes.iter().enumerate() {
            if let Some(outcome) = lane.done {
                self.arrivals[lane.trajectory] = Some(Arrival {
                    time: lane.time,
                    state: (0..self.n).map(|i| self.x[i * lanes + l]).collect(),
                    outcome,
                    steps: lane.steps,
                    rejected: lane.rejected,
                });
            }
        }
        let kept: Vec<usize> = (0..lanes).filter(|&l| self.lanes[l].done.is_none()).collect();
        let of_lanes = [&mut self.x, &mut self.slopes[0], &mut self.own, &mut self.signs, &mut self.switches];
        for array in of_lanes {
            let mut to = 0;
            for from in (0..array.len()).step_by(lanes) {
                for &l in &kept {
                    array[to] = array[from + l];
                    to += 1;
                }
            }
            array.truncate(to);
        }
        self.ahead.iter_mut().for_each(|values| values.truncate(self.signs.len()));
        let size = self.n * kept.len();
        self.slopes.iter_mut().for_each(|k| k.truncate(size));
        [&mut self.x, &mut self.next, &mut self.stage].into_iter().for_each(|v| v.truncate(size));
        self.lanes.retain(|lane| lane.done.is_none());
    }
}

/// Which states of the batch f is evaluated at.
enum Source {
    Start,
    Stage,
    End,
}

fn shared_or_own<'p>(shared: &'p [f64], own: &'p [f64]) -> Parameters<'p> {
    if own.is_empty() { Parameters::Shared(shared) } else { Parameters::PerLane(own) }
}
