//! Many trajectories integrated together.
//!
//! **Idea.** Some of the trajectories are the lanes of one batch. In each sweep every lane tries one step of its own length;
//! those whose error is too large try again with a shorter one in the next sweep. A lane that is finished takes over the next
//! trajectory that waits; once none waits it is taken out of the batch.
//!
//! **Equations.** The pair of the tableau, and with err the root mean square of errorᵢ / (absoluteᵢ + relative max(|x₀|, |x₁|)ᵢ):
//!
//!   (1)  h_new = h · clamp( 0.9 err^-α err_prev^β, 1/5, 10 ),   β = 0.04, α = 1/5 - 3β/4
//!
//! where after a rejection h does not grow, and the longest step that was asked for is kept.
//!
//! | question | file |
//! |---|---|
//! | what is computed for all lanes at once? | `lanes` |
//! | how long is the next step, and the first? | `pace` |
//! | what happens where f or a derivative jumps? | `switching` |
//!
//! **Source.** hairer1993, §II.4 (step control and first step); hairer1996, §IV.2 (the second factor of (1)).
//!
//! **Departures.** A lane is computed from its own numbers only, so its result depends neither on the other lanes nor on
//! how many there are, provided the vector field keeps its lanes apart too.
//!
//! **Fails when** f or a derivative jumps where the field names no switch: the step shrinks there and the order is lost. A
//! trajectory that slides along a switch ends there.

mod lanes;
mod pace;
mod switching;

use super::kink::Kink;
use super::shortened::Shortened;
use super::{Arrival, Outcome, Step, Tolerance};
use crate::contract::{Parameters, VectorField, Verdict};
use lanes::Lanes;

/// Trajectories that are integrated at a time: enough to keep vector instructions busy, few enough to stay in the cache.
const WIDTH: usize = 64;
/// Beyond this multiple of 1 + |start| in any component a trajectory is taken to run to infinity.
const BOUND: f64 = 1e12;
/// At rest the step grows without end; beyond this length the arithmetic would overflow.
const LONGEST: f64 = 1e100;

/// A batch of trajectories under way.
pub struct Ensemble<'a> {
    field: &'a dyn VectorField,
    parameters: &'a [f64],
    /// `[count][k]` where every trajectory has parameters of its own, else empty.
    own: Vec<f64>,
    /// `[count][n]`, of which those before `waiting` are under way or done.
    starts: Vec<f64>,
    waiting: usize,
    tolerance: Tolerance,
    begin: f64,
    /// End of the time span, and the sign of the direction in which it lies.
    end: f64,
    sign: f64,
    step_limit: usize,
    longest: f64,
    lanes: Lanes,
    /// What each lane knows besides.
    runs: Vec<Run>,
    arrivals: Vec<Option<Arrival>>,
}

/// A trajectory under way.
#[derive(Clone, Debug)]
struct Run {
    trajectory: usize,
    time: f64,
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
        Ensemble {
            field,
            parameters,
            own: Vec::new(),
            starts: starts.to_vec(),
            waiting: 0,
            tolerance,
            begin: span[0],
            end: span[1],
            sign: if span[1] < span[0] { -1.0 } else { 1.0 },
            step_limit: usize::MAX,
            longest: LONGEST,
            lanes: Lanes::default(),
            runs: Vec::new(),
            arrivals: vec![None; starts.len().checked_div(field.dim()).unwrap_or(0)],
        }
    }

    /// The same with parameters of its own for every trajectory: `parameters` `[count][k]`.
    pub fn with_own_parameters(
        field: &'a dyn VectorField,
        parameters: &[f64],
        tolerance: Tolerance,
        starts: &[f64],
        span: [f64; 2],
    ) -> Ensemble<'a> {
        Ensemble { own: parameters.to_vec(), ..Ensemble::new(field, &[], tolerance, starts, span) }
    }

    /// Ends a trajectory after this many accepted and rejected steps.
    pub fn with_step_limit(mut self, limit: usize) -> Ensemble<'a> {
        self.step_limit = limit;
        self
    }

    /// No step is longer than this time, which is positive.
    pub fn with_longest_step(mut self, longest: f64) -> Ensemble<'a> {
        self.longest = longest.min(LONGEST);
        self
    }

    /// Integrates until every trajectory has ended; `observe` sees every accepted step and may stop its trajectory there.
    /// Returns the arrivals in the order of the starts.
    pub fn run(mut self, observe: &mut dyn FnMut(&Step) -> Verdict) -> Vec<Arrival> {
        let count = self.arrivals.len().min(WIDTH);
        self.lanes = Lanes::new(self.field, count, if self.own.is_empty() { 0 } else { self.field.parameter_count() });
        let mut again = Shortened::new(self.field);
        let mut kinks: Vec<(usize, Kink)> = Vec::new();
        self.fill();
        while !self.runs.is_empty() {
            self.lanes.advance(self.field, self.parameters, &self.tolerance);
            self.look_ahead();
            for l in 0..self.runs.len() {
                self.judge(l, &mut again, &mut kinks, observe);
            }
            self.lanes.take_over(self.runs.iter().map(|run| !run.just_rejected));
            kinks.drain(..).for_each(|(l, kink)| self.pass(l, &kink, &mut again));
            self.replace_finished();
        }
        self.arrivals.into_iter().flatten().collect()
    }

    /// The step that lane `l` tries.
    fn step_of(&self, l: usize) -> Step<'_> {
        let (run, lanes) = (&self.runs[l], &self.lanes);
        let last = (self.end - run.time - lanes.h[l]) * self.sign <= 0.0;
        Step {
            trajectory: run.trajectory,
            column: l,
            lanes: lanes.count,
            time: run.time,
            length: lanes.h[l],
            end_time: if last { self.end } else { run.time + lanes.h[l] },
            from: &lanes.x,
            to: &lanes.next,
            slopes: &lanes.slopes,
            parameters: lanes.parameters(self.parameters),
            signs: &lanes.signs,
        }
    }

    /// Makes the step of lane `l` shorter after an error that is too large.
    fn reject(&mut self, l: usize) {
        let (run, lanes) = (&mut self.runs[l], &mut self.lanes);
        let finite = lanes.error[l].is_finite();
        run.rejected += 1;
        run.just_rejected = true;
        lanes.h[l] *= if finite { lanes.shrink[l].clamp(pace::LEAST, 1.0) } else { pace::LEAST };
        if lanes.h[l].abs() <= 4.0 * f64::EPSILON * run.time.abs() || lanes.h[l].abs() < 1e-300 {
            run.done = Some(if finite { Outcome::StepTooSmall } else { Outcome::Escaped });
        } else if run.steps + run.rejected >= self.step_limit {
            run.done = Some(Outcome::StepLimit);
        }
    }

    /// Accepts or rejects the step of lane `l`.
    fn judge(
        &mut self,
        l: usize,
        again: &mut Shortened,
        kinks: &mut Vec<(usize, Kink)>,
        observe: &mut dyn FnMut(&Step) -> Verdict,
    ) {
        let error = self.lanes.error[l];
        if error.is_nan() || error > 1.0 {
            return self.reject(l);
        }
        let tried = self.lanes.h[l];
        let kink = self.shortened(l, again);
        let step = self.step_of(l);
        let end_time = step.end_time();
        let nowhere = kink.as_ref().is_some_and(|kink| kink.theta == 0.0);
        let verdict = if nowhere { Verdict::Continue } else { observe(&step) };
        let (run, lanes) = (&mut self.runs[l], &mut self.lanes);
        run.time = end_time;
        run.steps += 1;
        // (1)
        let most = if run.just_rejected { 1.0 } else { pace::MOST };
        let h = (tried * lanes.growth[l].clamp(pace::LEAST, most)).max(-self.longest).min(self.longest);
        lanes.remember_error(l);
        run.just_rejected = false;
        let remaining = self.end - end_time;
        // A last step a little longer than planned saves a tiny one.
        lanes.h[l] = if h.abs() * 1.01 >= remaining.abs() { remaining } else { h };
        let largest = lanes.largest[l];
        run.done = if largest.is_nan() || largest > run.bound {
            Some(Outcome::Escaped)
        } else if verdict == Verdict::Stop {
            Some(Outcome::Stopped)
        } else if end_time == self.end {
            Some(Outcome::Reached)
        } else if run.steps + run.rejected >= self.step_limit {
            Some(Outcome::StepLimit)
        } else {
            None
        };
        kinks.extend(kink.filter(|_| run.done.is_none()).map(|kink| (l, kink)));
    }

    /// Gives the lanes that are done to trajectories that wait, and takes out of the batch those for which none waits.
    fn replace_finished(&mut self) {
        // Some end where they begin.
        while self.runs.iter().any(|run| run.done.is_some()) {
            let mut fresh = Vec::new();
            for l in 0..self.runs.len() {
                let run = &self.runs[l];
                let Some(outcome) = run.done else { continue };
                self.arrivals[run.trajectory] = Some(Arrival {
                    time: run.time,
                    state: self.lanes.state(l),
                    outcome,
                    steps: run.steps,
                    rejected: run.rejected,
                });
                if self.waiting < self.arrivals.len() {
                    self.runs[l] = self.next_run(l);
                    fresh.push(l);
                }
            }
            if fresh.is_empty() {
                let kept: Vec<usize> = (0..self.runs.len()).filter(|&l| self.runs[l].done.is_none()).collect();
                self.lanes.keep(&kept);
                self.runs.retain(|run| run.done.is_none());
            } else {
                self.begin(&fresh);
            }
        }
    }

    /// Puts the next trajectory that waits into lane `l`.
    fn next_run(&mut self, l: usize) -> Run {
        let (trajectory, n, k) = (self.waiting, self.field.dim(), self.field.parameter_count());
        self.waiting += 1;
        let start = &self.starts[trajectory * n..(trajectory + 1) * n];
        self.lanes.set(l, start, self.own.get(trajectory * k..(trajectory + 1) * k).unwrap_or(&[]));
        Run {
            trajectory,
            time: self.begin,
            just_rejected: false,
            steps: 0,
            rejected: 0,
            bound: BOUND * (1.0 + crate::linalg::max_abs(start)),
            stuck: 0,
            done: None,
        }
    }

    /// The first trajectories.
    fn fill(&mut self) {
        for l in 0..self.lanes.count {
            let run = self.next_run(l);
            self.runs.push(run);
        }
        let all: Vec<usize> = (0..self.runs.len()).collect();
        self.begin(&all);
        self.replace_finished();
    }
}

fn shared_or_own<'p>(shared: &'p [f64], own: &'p [f64]) -> Parameters<'p> {
    if own.is_empty() { Parameters::Shared(shared) } else { Parameters::PerLane(own) }
}
