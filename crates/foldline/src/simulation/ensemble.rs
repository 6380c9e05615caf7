//! Trajectories integrated together.
//!
//! **Idea.** Up to 64 trajectories are the lanes of one batch. In each sweep every lane tries one step of its own
//! length; those whose error is too large retry with a shorter one in the next sweep. A finished lane takes over the
//! next waiting trajectory. Once none is waiting it idles, and idle lanes are removed from the batch eight at a time.
//!
//! **Equations.** The pair of the tableau, with err the root mean square of errorᵢ / (absoluteᵢ + relative max(|x₀|,
//! |x₁|)ᵢ):
//!
//!   (1)  h_new = h · clamp( 0.9 err^-α err_prev^β, 1/5, 10 ),   β = 0.04, α = 1/5 - 3β/4
//!
//! where h does not grow after a rejection and never exceeds the longest step requested.
//!
//! | topic | file |
//! |---|---|
//! | all lanes at once: stages, errors, acceptance | `lanes` |
//! | length of the first and of the next step | `pace` |
//! | jumps of f or of a derivative | `switching` |
//! | stiff trajectories | `stiff` |
//!
//! **Source.** hairer1993, §II.4 (step control and first step); hairer1996, §IV.2 (the second factor of (1)).
//!
//! **Departures.** A lane is computed from its own numbers only, so its result depends neither on the other lanes nor
//! on their number, provided that the vector field also keeps its lanes independent.
//!
//! **Fails when** f or a derivative jumps where the field declares no switch: the step shrinks there and the order is
//! lost. A trajectory that slides along two surfaces at once ends there.

mod lanes;
mod pace;
mod stiff;
mod switching;

use super::kink::Kink;
use super::shortened::Shortened;
use super::{Arrival, Outcome, Step, Tolerance};
use crate::contract::{Parameters, VectorField, Verdict};
use lanes::Lanes;
pub(super) use pace::Limits;
use stiff::Evidence;
use switching::Flights;

/// Number of trajectories integrated at a time: enough to keep vector instructions busy, few enough to stay in the
/// cache.
const WIDTH: usize = 64;
/// Multiple of (largest size + |start|) that any component must exceed for a trajectory to count as unbounded.
const BOUND: f64 = crate::diagram::Response::UNBOUNDED;
/// At an equilibrium the step grows without limit; beyond this length the arithmetic would overflow.
const LONGEST: f64 = 1e100;

/// Ensemble of trajectories being integrated.
pub struct Ensemble<'a> {
    field: &'a dyn VectorField,
    parameters: &'a [f64],
    /// `[count][k]` if every trajectory has its own parameters, else empty.
    own: Vec<f64>,
    /// `[count][n]`; those before `waiting` are in progress or done.
    starts: Vec<f64>,
    waiting: usize,
    tolerance: Tolerance,
    begin: f64,
    limits: Limits,
    lanes: Lanes,
    /// Further state of each lane.
    runs: Vec<Run>,
    arrivals: Vec<Option<Arrival>>,
}

/// Trajectory in progress.
#[derive(Clone, Debug)]
struct Run {
    trajectory: usize,
    /// Successive sign changes of a switch without progress.
    stuck: usize,
    flights: Flights,
    done: Option<Outcome>,
    stiff: Evidence,
    /// True if the lane is idle.
    over: bool,
}

impl<'a> Ensemble<'a> {
    /// Trajectories from `starts` `[count][n]`, all over the time span from `span[0]` to `span[1]`, which may run
    /// backwards.
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
            limits: Limits {
                end: span[1],
                sign: if span[1] < span[0] { -1.0 } else { 1.0 },
                longest: LONGEST,
                steps: f64::INFINITY,
            },
            lanes: Lanes::default(),
            runs: Vec::new(),
            arrivals: vec![None; starts.len().checked_div(field.dim()).unwrap_or(0)],
        }
    }

    /// Creates an ensemble in which every trajectory has its own parameters: `parameters` `[count][k]`.
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
        self.limits.steps = limit as f64;
        self
    }

    /// Limits the length of a step to `longest`, a positive time.
    pub fn with_longest_step(mut self, longest: f64) -> Ensemble<'a> {
        self.limits.longest = longest.min(LONGEST);
        self
    }

    /// Integrates until every trajectory has ended; `observe` sees every accepted step and may stop its trajectory
    /// there. Returns the arrivals in the order of the starts.
    pub fn run(self, observe: &mut dyn FnMut(&Step) -> Verdict) -> Vec<Arrival> {
        self.integrate(Some(observe))
    }

    /// Integrates without an observer and returns the arrivals in the order of the starts.
    pub fn arrive(self) -> Vec<Arrival> {
        self.integrate(None)
    }

    fn integrate(mut self, mut observe: Option<&mut dyn FnMut(&Step) -> Verdict>) -> Vec<Arrival> {
        let count = self.arrivals.len().min(WIDTH);
        self.lanes = Lanes::new(self.field, count, if self.own.is_empty() { 0 } else { self.field.parameter_count() });
        let mut again = Shortened::new(self.field);
        let mut kinks: Vec<(usize, Kink)> = Vec::new();
        self.fill();
        while !self.runs.is_empty() {
            self.lanes.advance(self.field, self.parameters, &self.tolerance, &self.limits);
            if !self.lanes.signs.is_empty() {
                self.look_ahead();
                for l in 0..self.lanes.count {
                    if self.lanes.accepted[l] != 0.0 {
                        kinks.extend(self.shortened(l, &mut again).map(|kink| (l, kink)));
                        self.project(l, &mut again);
                    }
                }
            }
            let stopped = observe.as_mut().map_or(Vec::new(), |observe| self.show(*observe));
            let ended = self.lanes.take_over(&self.limits) || !stopped.is_empty();
            if ended {
                self.end_some(&stopped);
            }
            if ended || !kinks.is_empty() {
                for (l, kink) in kinks.drain(..) {
                    if self.runs[l].done.is_none() {
                        self.pass(l, &kink, &mut again);
                    }
                }
                // The implicit method knows no jumps of the state.
                if self.field.event_count() == 0 {
                    self.look_for_stiffness(&mut observe);
                }
                self.replace_finished();
            }
        }
        self.arrivals.into_iter().flatten().collect()
    }

    /// Step tried by lane `l`.
    fn step_of(&self, l: usize) -> Step<'_> {
        let lanes = &self.lanes;
        Step {
            trajectory: self.runs[l].trajectory,
            column: l,
            lanes: lanes.count,
            time: lanes.time[l],
            length: lanes.h[l],
            end_time: lanes.end[l],
            from: &lanes.x,
            to: &lanes.next,
            slopes: &lanes.slopes,
            courses: &[],
            parameters: lanes.parameters(self.parameters),
            signs: &lanes.signs,
        }
    }

    /// Shows the accepted steps; returns the lanes to be stopped. A kink at the very start of a step leaves nothing to
    /// show.
    fn show(&self, observe: &mut dyn FnMut(&Step) -> Verdict) -> Vec<usize> {
        let mut stopped = Vec::new();
        let mut step = self.step_of(0);
        let lanes = self.lanes.accepted.iter().zip(self.lanes.h.iter()).zip(self.lanes.time.iter());
        for (l, (((&accepted, &h), &time), (&end, run))) in lanes.zip(self.lanes.end.iter().zip(&self.runs)).enumerate()
        {
            if accepted != 0.0 && h != 0.0 {
                (step.trajectory, step.column) = (run.trajectory, l);
                (step.time, step.length, step.end_time) = (time, h, end);
                if observe(&step) == Verdict::Stop {
                    stopped.push(l);
                }
            }
        }
        stopped
    }

    /// Ends the trajectories in `stopped`, and those that have reached an end for another reason.
    fn end_some(&mut self, stopped: &[usize]) {
        let lanes = &self.lanes;
        for (l, run) in self.runs.iter_mut().enumerate().filter(|(_, run)| !run.over) {
            let too_long = (lanes.tried[l] >= self.limits.steps).then_some(Outcome::StepLimit);
            run.done = if lanes.accepted[l] == 0.0 {
                let undefined = !lanes.error[l].is_finite();
                let too_small = if undefined { Outcome::Undefined } else { Outcome::StepTooSmall };
                pace::too_small(lanes.h[l], lanes.time[l]).then_some(too_small).or(too_long)
            } else if pace::escaped(lanes.largest[l], lanes.bound[l]) {
                Some(Outcome::Escaped)
            } else if stopped.contains(&l) {
                Some(Outcome::Stopped)
            } else if lanes.time[l] == self.limits.end {
                Some(Outcome::Reached)
            } else if lanes.h[l] == 0.0 {
                // f is so large that the step has underflowed to 0 and therefore has no error.
                Some(Outcome::StepTooSmall)
            } else {
                too_long
            };
        }
    }

    /// Assigns finished lanes to waiting trajectories and removes lanes without one from the batch, eight at a time
    /// while there are more than eight, so that a whole number of vectors remains.
    fn replace_finished(&mut self) {
        // Some trajectories end at their start.
        while self.runs.iter().any(|run| run.done.is_some()) {
            let mut fresh = Vec::new();
            for l in 0..self.runs.len() {
                let run = &mut self.runs[l];
                let Some(outcome) = run.done.take() else { continue };
                self.arrivals[run.trajectory] = Some(Arrival {
                    time: self.lanes.time[l],
                    state: self.lanes.state(l),
                    outcome,
                    steps: self.lanes.steps[l] as usize,
                    rejected: (self.lanes.tried[l] - self.lanes.steps[l]) as usize,
                });
                run.over = true;
                if self.waiting < self.arrivals.len() {
                    self.runs[l] = self.next_run(l);
                    fresh.push(l);
                } else {
                    self.lanes.clear(l);
                }
            }
            self.begin(&fresh);
        }
        let live = self.runs.iter().filter(|run| !run.over).count();
        let count = if live < 8 { live } else { live.next_multiple_of(8) };
        if count < self.runs.len() {
            let mut idle = count - live;
            let mut stays = |run: &Run| {
                let fills = run.over && idle > 0;
                idle -= usize::from(fills);
                fills || !run.over
            };
            let kept: Vec<usize> = (0..self.runs.len()).filter(|&l| stays(&self.runs[l])).collect();
            self.lanes.keep(&kept);
            self.runs = kept.iter().map(|&l| self.runs[l].clone()).collect();
        }
    }

    /// Puts the next waiting trajectory into lane `l`.
    fn next_run(&mut self, l: usize) -> Run {
        let (trajectory, n, k) = (self.waiting, self.field.dim(), self.field.parameter_count());
        self.waiting += 1;
        let start = &self.starts[trajectory * n..(trajectory + 1) * n];
        let own = self.own.get(trajectory * k..(trajectory + 1) * k).unwrap_or(&[]);
        // Component size implied by the tolerance: absolute over relative.
        let size = crate::linalg::max_abs(&self.tolerance.absolute) / self.tolerance.relative;
        let bound = BOUND * (size + crate::linalg::max_abs(start));
        self.lanes.set(l, start, own, self.begin, bound);
        Run { trajectory, stuck: 0, flights: Flights::default(), done: None, stiff: Evidence::default(), over: false }
    }

    /// Starts the first trajectories.
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
