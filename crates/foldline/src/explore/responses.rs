//! The surveys and sweeps of a plan.
//!
//! **Idea.** A survey shares its values among the threads; sweeps, in which each value waits for the previous one, are
//! shared as a whole. Results completed by an earlier run are not computed again. Jumps of a sweep are detected by
//! solving for its motions (`pursuit`).

use super::plan::{Plan, Start, SurveyPlan, SweepPlan};
use super::pursuit::Pursuit;
use super::seeds::{Seeds, sampling};
use super::{System, near};
use crate::attractors::{Candidate, Trial, stepped_sweep, survey_by_simulation};
use crate::contract::{Event, Observer, Verdict};
use crate::diagram::{Branch, Diagram, Motion, Point, Response, Responses, Search, Solution};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Returns the responses of every completed survey and sweep of the plan, in the order of the plan. `branches` are those
/// from which sweeps may start.
pub fn simulate(
    system: &System,
    plan: &Plan,
    seeds: &Seeds<'_>,
    jobs: usize,
    branches: &[Branch],
    earlier: &Diagram,
    observer: &dyn Observer,
) -> Vec<Responses> {
    let mut found: Vec<Responses> = Vec::new();
    for survey in &plan.surveys {
        let known = earlier.response_set(&survey.name).cloned();
        let set = known.or_else(|| one_survey(system, plan, survey, jobs, observer));
        found.extend(set);
    }
    let next = AtomicUsize::new(0);
    let swept: Vec<Mutex<Option<Responses>>> = plan.sweeps.iter().map(|_| Mutex::new(None)).collect();
    std::thread::scope(|scope| {
        for _ in 0..jobs.min(plan.sweeps.len()) {
            scope.spawn(|| {
                while let Some((sweep, slot)) = {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    plan.sweeps.get(index).zip(swept.get(index))
                } {
                    let known = earlier.response_set(&sweep.name).cloned();
                    let set = known.or_else(|| one_sweep(system, plan, sweep, seeds, branches, observer));
                    if let Ok(mut slot) = slot.lock() {
                        *slot = set;
                    }
                }
            });
        }
    });
    found.extend(swept.into_iter().filter_map(|slot| slot.into_inner().ok().flatten()));
    found
}

fn trial<'a>(system: &'a System, plan: &Plan, jobs: usize) -> Trial<'a> {
    Trial { field: system.field, scales: &system.scales, whirl: system.whirl, jobs, limits: plan.simulation }
}

/// Reports values one after the other as done.
struct Count<'o> {
    name: &'o str,
    of: usize,
    done: AtomicUsize,
    observer: &'o dyn Observer,
}

impl Count<'_> {
    fn visited(&self, responses: &[Response]) -> Verdict {
        // Motions computed during an interruption are wrong.
        if self.observer.stopping() {
            return Verdict::Stop;
        }
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let value = responses.first().map_or(f64::NAN, |r| r.value);
        self.observer.observe(Event::Visited(self.name, value, done, self.of))
    }
}

fn one_survey(
    system: &System,
    plan: &Plan,
    survey: &SurveyPlan,
    jobs: usize,
    observer: &dyn Observer,
) -> Option<Responses> {
    let SurveyPlan { name, parameters, free, values, starts, random } = survey;
    let sampling = sampling(system, *starts, *random, jobs, plan.tolerance);
    let count = Count { name, of: values.len(), done: AtomicUsize::new(0), observer };
    let report = |found: &[Response]| count.visited(found);
    let responses = survey_by_simulation(&trial(system, plan, jobs), &sampling, parameters, *free, values, &report);
    let complete = count.done.load(Ordering::Relaxed) >= values.len();
    let ways = [
        (Motion::Escaped, "escaped"),
        (Motion::Chatter, "ended in chatter, where impacts accumulate and sustained contact follows"),
    ];
    for note in ways.into_iter().filter_map(|way| losses(&responses, *starts, way)).filter(|_| complete) {
        observer.observe(Event::Note(name, &note));
    }
    complete.then(|| finished(name, Search::Survey, *free, responses, observer))
}

/// Rounds a value to 12 digits, which removes the rounding errors of its computation.
fn rounded(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// Returns a note on the number of starts that were lost in one way at each value, if any were.
fn losses(responses: &[Response], starts: usize, (motion, way): (Motion, &str)) -> Option<String> {
    /// Number of values listed; more would not be read.
    const TOLD: usize = 8;
    let gone: Vec<&Response> = responses.iter().filter(|r| r.motion == motion).collect();
    let told = gone.iter().take(TOLD).map(|r| format!("{} at {}", r.hits, rounded(r.value)));
    let told: Vec<String> = told.collect();
    let more = match gone.len().saturating_sub(TOLD) {
        0 => String::new(),
        more => format!(", and some at {more} more values"),
    };
    (!gone.is_empty()).then(|| format!("starts that {way} (of {starts}): {}{more}", told.join(", ")))
}

/// Solution at which a sweep starts.
fn first(
    system: &System,
    plan: &Plan,
    start: &Start,
    seeds: &Seeds<'_>,
    branches: &[Branch],
    observer: &dyn Observer,
) -> Result<Point, String> {
    match start {
        Start::Seed(seed) => seeds.point(*seed),
        Start::Near(near) => {
            let branch = branches.iter().find(|branch| branch.name == near.name);
            let branch = branch.ok_or_else(|| format!("there is no branch {}", near.name))?;
            near::point_of(system, plan, near, branch, observer)
        }
        _ => Err("a sweep starts at a seed or at a point of a branch".to_string()),
    }
}

fn one_sweep(
    system: &System,
    plan: &Plan,
    sweep: &SweepPlan,
    seeds: &Seeds<'_>,
    branches: &[Branch],
    observer: &dyn Observer,
) -> Option<Responses> {
    let SweepPlan { name, start, free, values } = sweep;
    let point = match first(system, plan, start, seeds, branches, observer) {
        Ok(point) => point,
        Err(why) => {
            observer.observe(Event::Short(name, &format!("no starting solution: {why}")));
            return None;
        }
    };
    let state = match &point.solution {
        Solution::Equilibrium(x) => x.clone(),
        Solution::Cycle(cycle) => cycle.state(0.0),
        Solution::Torus(torus) => torus.state(0.0, 0.0),
    };
    let parameters = match start {
        Start::Seed(seed) => plan.seeds.get(*seed).map_or(&point.parameters, |seed| &seed.parameters),
        _ => &point.parameters,
    };
    let count = Count { name, of: values.len(), done: AtomicUsize::new(0), observer };
    let report = |found: &[Response]| count.visited(found);
    let mut pursuit = Pursuit::new(system, *free, plan.tolerance, plan.degree);
    let mut compare = |own: &[f64], candidate: Option<&Candidate>| pursuit.leaves(own, candidate);
    let responses = stepped_sweep(&trial(system, plan, 1), parameters, *free, values, &state, &mut compare, &report);
    if observer.stopping() {
        return None;
    }
    let lost = responses.last().filter(|last| last.motion.is_lost());
    if let Some(last) = lost {
        observer.observe(Event::Note(name, &format!("at {} the motion {}", rounded(last.value), last.fate())));
    }
    let complete = lost.is_some() || responses.len() == values.len();
    complete.then(|| finished(name, Search::Sweep, *free, responses, observer))
}

/// Reports and returns the responses of a completed survey or sweep.
fn finished(name: &str, search: Search, free: usize, responses: Vec<Response>, observer: &dyn Observer) -> Responses {
    let set = Responses { name: name.to_string(), search, free, responses };
    observer.observe(Event::Responses(&set));
    set
}
