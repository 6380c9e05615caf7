//! First solutions.
//!
//! **Idea.** Attractors are found by sampling initial states ([`crate::attractors`]) and made accurate by the same
//! collocation that follows them later. Seeds with the same parameters share one sampling of initial states, which ends
//! once it has found what they ask for.

use super::System;
use super::arcs::from_arc;
use super::bounces::{bounces, instead_of_samples};
use super::choice::{Choice, is_meant, missing, summary};
use super::diagnosis::{Seen, next_to_origin, of_laws, of_no_start, place};
use super::direct::{Direct, NEVER, direct};
use super::given::from_cycle;
use super::growth::{polished, problem_of, setting, settings};
use super::impacts;
use super::maps;
use super::minimal::reduced;
use super::plan::{AttractorKey, BranchPlan, Plan, SeedPlan, SeedSource, Start};
use super::profile::{Spread, first_profile, with_degree};
use super::tori;
use crate::attractors::{self, Attractor, Candidate, Census, Fate, Limits, Lost, Sampling, Trial};
use crate::continuation::corrector::{Plane, correct, parameter_row};
use crate::continuation::{Failure, Settings};
use crate::contract::{Event, Examination, Observer, Unobserved, Verdict};
use crate::diagram::{Cost, Cycle, Diagram, Point, Response, Shown, Solution};
use crate::linalg::max_abs;
use crate::problem::equilibrium::EquilibriumProblem;
use crate::problem::stiffness;
use crate::special::impact::inadmissible;
use std::sync::OnceLock;

/// First solutions of a plan, one per seed, or the reason why there is none. Each is computed on first request.
pub struct Seeds<'p> {
    system: &'p System<'p>,
    plan: &'p Plan,
    /// Number of threads for one sampling or one sample.
    jobs: usize,
    given: &'p [(usize, Point)],
    observer: &'p dyn Observer,
    /// `[seed]`: true if any remaining task starts there.
    needed: Vec<bool>,
    /// The samplings that are needed, each with the index of the first seed that it serves.
    censuses: Vec<(usize, OnceLock<Census>)>,
    points: Vec<OnceLock<Result<Point, String>>>,
}

impl<'p> Seeds<'p> {
    /// Selects the seeds from which a branch without points in `earlier`, or a sweep missing there, starts, except
    /// those `given` by index. Samplings share `jobs` threads.
    pub fn new(
        system: &'p System<'p>,
        plan: &'p Plan,
        jobs: usize,
        earlier: &Diagram,
        given: &'p [(usize, Point)],
        observer: &'p dyn Observer,
    ) -> Seeds<'p> {
        let needed = |seed: usize| {
            let start = Start::Seed(seed);
            let branches = plan.branches.iter().filter(|b| b.start == start).map(|b| b.name.clone());
            let first_legs = plan.homotopies.iter().filter(|h| h.start == start).map(|h| format!("{}/1", h.name));
            branches.chain(first_legs).any(|name| earlier.branch(&name).is_none_or(|known| known.points.is_empty()))
                || plan.sweeps.iter().any(|sweep| sweep.start == start && earlier.response_set(&sweep.name).is_none())
        };
        let known = |seed: usize| given.iter().any(|(index, _)| *index == seed);
        let needed: Vec<bool> = (0..plan.seeds.len()).map(|seed| needed(seed) && !known(seed)).collect();
        let censuses = sampled(system, plan, &needed);
        Seeds {
            system,
            plan,
            jobs: (jobs / censuses.len().max(1)).max(1),
            given,
            observer,
            needed,
            censuses: censuses.into_iter().map(|index| (index, OnceLock::new())).collect(),
            points: plan.seeds.iter().map(|_| OnceLock::new()).collect(),
        }
    }

    /// Number of samplings needed.
    pub fn count(&self) -> usize {
        self.censuses.len()
    }

    /// Returns the number of the sampling that provides a seed, if any.
    pub fn census_of(&self, seed: usize) -> Option<usize> {
        let own = &self.plan.seeds[seed];
        let sampled = self.needed[seed] && matches!(own.source, SeedSource::Attractor(_));
        self.censuses.iter().position(|(other, _)| sampled && share(&self.plan.seeds[*other], own))
    }

    /// Returns the attractors found by a sampling.
    pub fn census(&self, number: usize) -> &Census {
        let (index, census) = &self.censuses[number];
        census.get_or_init(|| {
            let found = census_for(self.system, self.plan, *index, self.jobs);
            self.observer.observe(Event::Note(&self.plan.seeds[*index].name, &summary(self.system, &found)));
            found
        })
    }

    /// Returns the first solution of a seed.
    ///
    /// # Errors
    /// A sentence that says why there is none.
    pub fn point(&self, seed: usize) -> Result<Point, String> {
        let Some(slot) = self.points.get(seed) else { return Err("no such seed".into()) };
        slot.get_or_init(|| self.found(seed)).clone()
    }

    /// Notes that a given cycle consists of several turns of a shorter one.
    fn tell_turns(&self, name: &str, given: &Cycle, found: &Point) {
        let Some(period) = found.solution.period() else { return };
        let turns = (given.period / period).round();
        if turns > 1.0 {
            let said = format!(
                "the given cycle of period {:.6} is {turns} turns of a cycle of period {period:.6}, which is used \
                 instead",
                given.period
            );
            self.observer.observe(Event::Note(name, &said));
        }
    }

    /// An unstable cycle of a map with the number of iterates that a seed asks for, if there is no stable one.
    fn unstable(&self, seed: &SeedPlan, key: &AttractorKey) -> Option<Point> {
        let AttractorKey::Lasting(count) = key else { return None };
        if !self.system.field.iterated() {
            return None;
        }
        let (samples, count) = ((seed.samples, seed.random), *count as usize);
        let found = maps::cycles_of(self.system, &seed.parameters, samples, self.plan.tolerance, count);
        let others = match found.len() {
            0 => return None,
            1 => String::new(),
            more => format!("; of the {more} found, it is the least unstable one with the smallest first state"),
        };
        let said = format!(
            "no stable cycle of {count} iterates was reached: starting from an unstable one that Newton's method \
             found{others}"
        );
        self.observer.observe(Event::Note(&seed.name, &said));
        found.into_iter().next()
    }

    /// A cycle with this ratio of frequencies, by the balance of harmonics.
    fn bouncing(&self, seed: &SeedPlan, ratio: (u32, u32)) -> Result<Point, String> {
        let found = bounces(self.system, &seed.parameters, ratio, self.plan.tolerance)?;
        let Some(first) = found.cycles.first() else { return Err(found.none(ratio)) };
        self.observer.observe(Event::Note(&seed.name, &found.told(ratio)));
        Ok(first.clone())
    }

    fn found(&self, index: usize) -> Result<Point, String> {
        let (system, plan, seed) = (self.system, self.plan, &self.plan.seeds[index]);
        if !self.needed[index] {
            let given = self.given.iter().find(|(other, _)| *other == index);
            return given.map(|(_, point)| with_degree(point.clone(), plan.degree)).ok_or("not needed".into());
        }
        system.repeats(&seed.parameters, &[])?;
        if system.field.second_phase().is_some() && seed.source != SeedSource::QuasiPeriodic {
            return Err("under two forcing frequencies the response is a torus; ask for `attractor = \"torus\"`".into());
        }
        let point = match &seed.source {
            SeedSource::Cycle(_) | SeedSource::Besides(..) if system.is_open() => {
                from_arc(system, plan, index, &seed.parameters)?
            }
            SeedSource::Cycle(cycle) | SeedSource::Besides(cycle, _) => {
                let point = from_cycle(system, seed, plan.tolerance, cycle)?;
                self.tell_turns(&seed.name, cycle, &point);
                point
            }
            SeedSource::State(state) => {
                let tell = |note: &str| _ = self.observer.observe(Event::Note(&seed.name, note));
                from_state(system, seed, plan, state, self.jobs, &tell)?
            }
            SeedSource::Torus(source) => return tori::lifted(system, plan, seed, source, self.jobs),
            SeedSource::QuasiPeriodic => {
                let (point, said) = tori::met(system, plan, seed)?;
                self.observer.observe(Event::Note(&seed.name, &said));
                return Ok(point);
            }
            SeedSource::Attractor(key) => {
                if let Some(why) = in_families(system, seed) {
                    return Err(format!("no equilibrium is isolated{why}"));
                }
                if let Some(ratio) = balanced(system, seed) {
                    return self.bouncing(seed, ratio).map(|point| with_degree(point, plan.degree));
                }
                let census = self.census(self.census_of(index).ok_or("no samples were taken")?);
                let choice = Choice::of(system, plan.tolerance, census, key);
                if let Some(said) = choice.told(system) {
                    self.observer.observe(Event::Note(&seed.name, &said));
                }
                let found = choice.taken().cloned().or_else(|| self.unstable(seed, key));
                match (found, key) {
                    (Some(found), _) => found,
                    (None, AttractorKey::Ratio(p, q)) => {
                        let other = self.bouncing(seed, (*p, *q));
                        other.map_err(|_| missing(system, seed, census, key))?
                    }
                    (None, _) => return Err(missing(system, seed, census, key)),
                }
            }
        };
        Ok(with_degree(point, plan.degree))
    }
}

/// Finds the first solution for a single seed.
///
/// # Errors
/// A sentence that says why there is none.
pub fn first_solution(system: &System, seed: &SeedPlan, tolerance: f64, jobs: usize) -> Result<Point, String> {
    const DEGREE: usize = 4;
    first_of(system, seed.clone(), &Plan::empty(tolerance, DEGREE), jobs)
}

/// Finds the first solution for a single seed, with the tolerance, degree and limits of a plan.
///
/// # Errors
/// A sentence that says why there is none.
pub(super) fn first_of(system: &System, seed: SeedPlan, like: &Plan, jobs: usize) -> Result<Point, String> {
    let (seeds, free, range) = (vec![seed], 0, [f64::NEG_INFINITY, f64::INFINITY]);
    let (switching, marks) = Default::default();
    let start = Start::Seed(0);
    let branch = BranchPlan {
        holds: Default::default(),
        name: String::new(),
        start,
        free,
        range,
        until: None,
        switching,
        marks,
        max_points: 0,
    };
    let plan = Plan { seeds, branches: vec![branch], limits: like.limits, ..Plan::empty(like.tolerance, like.degree) };
    Seeds::new(system, &plan, jobs, &Diagram::default(), &[], &Unobserved).point(0)
}

/// True if two seeds share a sampling.
fn share(a: &SeedPlan, b: &SeedPlan) -> bool {
    a.parameters == b.parameters && a.samples == b.samples && a.random == b.random
}

/// The ratio of a seed whose first solution is sought by the balance of harmonics instead of sampling.
fn balanced(system: &System, seed: &SeedPlan) -> Option<(u32, u32)> {
    match seed.source {
        SeedSource::Attractor(AttractorKey::Ratio(p, q)) if instead_of_samples(system, &seed.parameters) => {
            Some((p, q))
        }
        _ => None,
    }
}

/// Returns the seeds that need a sampling; of those that share one, the first.
fn sampled(system: &System, plan: &Plan, needed: &[bool]) -> Vec<usize> {
    let mut first: Vec<usize> = Vec::new();
    for (index, seed) in plan.seeds.iter().enumerate() {
        let sampled = matches!(seed.source, SeedSource::Attractor(_))
            && in_families(system, seed).is_none()
            && !(needed[index] && balanced(system, seed).is_some());
        let repeats = system.repeats(&seed.parameters, &[]).is_ok();
        if needed[index] && sampled && repeats && !first.iter().any(|other| share(&plan.seeds[*other], seed)) {
            first.push(index);
        }
    }
    first
}

/// Returns cause and cure, without sampling, if no equilibrium that a seed could mean is isolated. Cycles may be, if a
/// symmetry only moves them along themselves.
fn in_families(system: &System, seed: &SeedPlan) -> Option<String> {
    if system.field.iterated() {
        return None;
    }
    let equilibrium = seed.source == SeedSource::Attractor(AttractorKey::Equilibrium);
    if equilibrium { of_laws(system, &seed.parameters) } else { None }
}

/// Samples initial states for a seed. The sampling ends once it has found what all seeds that share it ask for, needed
/// or not, so that a seed means the same solution in a resumed run.
fn census_for(system: &System, plan: &Plan, index: usize, jobs: usize) -> Census {
    let seed = &plan.seeds[index];
    let keys = plan.seeds.iter().filter(|other| share(other, seed)).filter_map(|other| match &other.source {
        SeedSource::Attractor(key) => Some(key),
        SeedSource::Torus(_)
        | SeedSource::QuasiPeriodic
        | SeedSource::State(_)
        | SeedSource::Cycle(_)
        | SeedSource::Besides(..) => None,
    });
    let keys: Vec<&AttractorKey> = keys.collect();
    let newton = if system.field.iterated() { None } else { newton_from_rest(system, plan, seed) };
    let wanted = |found: &(Attractor, bool)| keys.iter().all(|key| is_meant(key, &found.0.point, found.0.ratio));
    let meant = newton.filter(|found| !keys.is_empty() && wanted(found));
    if let Some((attractor, true)) = meant {
        return Census { attractors: vec![attractor], left: seed.samples, ..Census::default() };
    }
    let sampling = sampling(system, seed.samples, seed.random, jobs, plan.tolerance);
    let polish = |candidate: &Candidate| polish(system, &seed.parameters, plan.tolerance, candidate);
    let mut census = attractors::survey_until(system.field, &seed.parameters, &sampling, &polish, &|reached| {
        keys.iter().all(|key| reached.iter().any(|(point, ratio)| is_meant(key, point, *ratio)))
    });
    let met = |key: &&AttractorKey| census.attractors.iter().any(|a| is_meant(key, &a.point, a.ratio));
    if let Some((attractor, _)) = meant
        && !keys.iter().all(met)
    {
        census.attractors.push(attractor);
    }
    census
}

/// Returns the stable cycle of one forcing period that Newton's method finds from the state nearest to the origin, and
/// true if it attracts, but too slowly for any sample to settle on it within the step limit.
fn newton_from_rest(system: &System, plan: &Plan, seed: &SeedPlan) -> Option<(Attractor, bool)> {
    let Direct { point, periods, slow, .. } =
        direct(system, &seed.parameters, plan.tolerance, &next_to_origin(system))?;
    let Solution::Cycle(cycle) = &point.solution else { return None };
    if point.unstable > 0 {
        return None;
    }
    let ratio = system.whirl.and_then(|whirl| attractors::spectral_ratio(cycle, whirl));
    let attractor = Attractor { ratio, hits: 0, share: None, example: cycle.state(0.0), point };
    Some((attractor, slow && periods <= NEVER))
}

/// Samples initial states, follows each to its attractor, and computes the attractors accurately.
///
/// `parameters` `[k]`; `samples` initial states from the ranges of the system; `seed` makes the sample reproducible.
pub fn attractors(
    system: &System,
    parameters: &[f64],
    samples: usize,
    seed: u64,
    jobs: usize,
    tolerance: f64,
) -> Census {
    let sampling = sampling(system, samples, seed, jobs, tolerance);
    attractors::survey(system.field, parameters, &sampling, &|candidate| {
        polish(system, parameters, tolerance, candidate)
    })
}

/// Types of the motions to which the first unsettled samples of a survey lead by simulation, at most eight; `samples` and
/// `seed` are those of [`attractors`].
pub fn unsettled_motions(
    system: &System,
    parameters: &[f64],
    (samples, seed): (usize, u64),
    census: &Census,
    tolerance: f64,
) -> Vec<Response> {
    const EXAMINED: usize = 8;
    let sampling = sampling(system, samples, seed, 1, tolerance);
    let (starts, n) = (sampling.starts(), system.field.dim());
    let open = census.fates.iter().enumerate().filter(|(_, fate)| **fate == Fate::Unsettled).take(EXAMINED);
    let given: Vec<f64> = open.flat_map(|(k, _)| starts[k * n..(k + 1) * n].to_vec()).collect();
    if given.is_empty() {
        return Vec::new();
    }
    let limits = if system.limits == Limits::default() { Limits::patient() } else { system.limits };
    let sampling = Sampling { samples: given.len() / n, given: Some(given), ..sampling };
    let trial = Trial { field: system.field, scales: &system.scales, whirl: system.whirl, jobs: 1, limits };
    let value = parameters.first().copied().unwrap_or(0.0);
    attractors::survey_by_simulation(&trial, &sampling, parameters, 0, &[value], &|_| Verdict::Continue)
}

/// Attractors reached from given initial states `[count][n]`, with the fate of each; see [`crate::attractors::survey_map`].
pub(super) fn map(system: &System, parameters: &[f64], starts: Vec<f64>, jobs: usize, tolerance: f64) -> Census {
    let samples = starts.len() / system.field.dim().max(1);
    let sampling = Sampling { given: Some(starts), ..sampling(system, samples, 0, jobs, tolerance) };
    attractors::survey_map(system.field, parameters, &sampling, &|candidate| {
        polish(system, parameters, tolerance, candidate)
    })
}

pub(super) fn sampling(system: &System, samples: usize, seed: u64, jobs: usize, tolerance: f64) -> Sampling {
    Sampling {
        ranges: system.ranges.clone(),
        scales: system.scales.clone(),
        whirl: system.whirl,
        samples,
        seed,
        jobs,
        tolerance,
        limits: system.limits,
        given: None,
    }
}

/// Solves for a candidate by Newton's method at fixed parameters; a cycle is reduced to its minimal period.
pub(super) fn polish(system: &System, parameters: &[f64], tolerance: f64, candidate: &Candidate) -> Option<Point> {
    if system.field.iterated() {
        return maps::polish(system, parameters, tolerance, candidate);
    }
    let settings = settings(system, tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
    let free = 0;
    if system.field.event_count() > 0 {
        match impacts::polished(system, parameters, &settings, candidate) {
            impacts::Found::Cycle(point) => {
                return Some(*point).filter(|found| inadmissible(system.field, found).is_none());
            }
            impacts::Found::Nothing => return None,
            impacts::Found::NoEvents => {}
        }
    }
    let solved = |spread: Spread| {
        let solution = match candidate {
            Candidate::Equilibrium(x) => Solution::Equilibrium(x.clone()),
            Candidate::Cycle { period, times, states } => {
                let n = system.field.dim();
                let last = states.rchunks_exact(n).next().unwrap_or(&states[..n]);
                let gain = attractors::gained(system.field.periods(), &states[..n], last);
                let mut cycle = first_profile(&system.scales, gain, *period, times, states, spread);
                if system.field.forced() {
                    cycle.forcing_periods = period.round() as u32;
                }
                Solution::Cycle(cycle)
            }
        };
        let guess = near(system, 4, &settings, bare(parameters, solution)).ok()?;
        let mut problem = problem_of(system, free, 4, &guess, false);
        Some(polished(&mut *problem, &settings, &guess).ok()?.point)
    };
    let cycle = matches!(candidate, Candidate::Cycle { .. });
    let found = solved(Spread::Arclength).or_else(|| if cycle { solved(Spread::Steps) } else { None })?;
    let found = reduced(system, &settings, &found).unwrap_or(found);
    // A solution that ignores an event is no motion.
    Some(found).filter(|found| inadmissible(system.field, found).is_none())
}

/// Solves near a candidate, coarsely and on its own mesh: a candidate far from a solution is not worth a finer mesh.
pub(super) fn near(system: &System, degree: usize, settings: &Settings, guess: Point) -> Result<Point, Failure> {
    let mut guess = suited(system, guess);
    let mut problem = problem_of(system, 0, degree, &guess, false);
    let coarse = Settings { tolerance: 1e-2, max_newton: 6, ..settings.clone() };
    let mut u = problem.unknowns_of(&guess);
    problem.anchor(&u);
    let plane = Plane { row: parameter_row(u.len()), base: u.clone(), distance: 0.0 };
    correct(&mut *problem, &coarse, &plane, &mut u, &mut Cost::default())?;
    guess.solution = problem.point(&u, &[], Examination::default()).solution;
    Ok(guess)
}

/// Returns a start of a branch with the collocation points that suit it.
pub(super) fn suited(system: &System, point: Point) -> Point {
    let Solution::Cycle(cycle) = point.solution else { return point };
    let points = stiffness::suited(system.field, &system.scales, &point.parameters, &cycle);
    Point { solution: Solution::Cycle(cycle.with_points(points)), ..point }
}

/// Returns a point with only the parameters and the solution.
pub(super) fn bare(parameters: &[f64], solution: Solution) -> Point {
    Point {
        position: 0,
        parameters: parameters.to_vec(),
        solution,
        tangent: Vec::new(),
        step: 0.0,
        spectrum: Vec::new(),
        unstable: 0,
        ranges: Vec::new(),
        averages: Vec::new(),
        trust: Default::default(),
        cost: Default::default(),
    }
}

/// Returns the solution for a given state: an equilibrium if Newton's method finds one close by; otherwise a cycle
/// through the state, or one that attracts too slowly for simulation ([`direct`]); otherwise the limit of the
/// trajectory from the state.
fn from_state(
    system: &System,
    seed: &SeedPlan,
    plan: &Plan,
    state: &[f64],
    jobs: usize,
    tell: &dyn Fn(&str),
) -> Result<Point, String> {
    const NEXT: f64 = 1e-2;
    const NEAR: f64 = 0.3;
    if system.field.iterated() {
        let found = maps::from_state(system, seed, plan.tolerance, state);
        return found.map_err(|lost| no_start(system, seed, state, &lost));
    }
    let settings = settings(system, plan.tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
    let mut problem = EquilibriumProblem::new(setting(system, 0, &seed.parameters));
    let given = bare(&seed.parameters, Solution::Equilibrium(state.to_vec()));
    let at_rest = (!system.field.forced()).then(|| polished(&mut problem, &settings, &given).ok()).flatten();
    let found = at_rest.map(|found| {
        let moved: Vec<f64> =
            found.u.iter().zip(state).zip(&system.scales).map(|((a, b), s)| (a - b) / (s + b.abs())).collect();
        (max_abs(&moved), found.point)
    });
    if let Some((moved, point)) = &found
        && *moved < NEXT
    {
        return Ok(point.clone());
    }
    if system.field.event_count() > 0
        && let Some(point) = impacts::through(system, &seed.parameters, &settings, state)
    {
        return Ok(point);
    }
    let next = direct(system, &seed.parameters, plan.tolerance, state);
    if let Some(Direct { point, periods, through, .. }) = next.as_ref().filter(|next| next.through || next.slow) {
        let slowly = match *periods > NEVER {
            true => "transients near it do not decay".to_string(),
            false => format!("a transient lasts about {periods:.1e} forcing periods"),
        };
        if !through {
            tell(&format!(
                "starting from the cycle that Newton's method finds near the given state, without simulation: \
                 {slowly}"
            ));
        }
        return Ok(point.clone());
    }
    let sampling = sampling(system, 1, seed.random, jobs, plan.tolerance);
    let polish = |candidate: &Candidate| polish(system, &seed.parameters, plan.tolerance, candidate);
    let settled = attractors::settle(system.field, &seed.parameters, &sampling, state, &polish);
    settled.or_else(|lost| match (found, next) {
        // A saddle that the trajectory approaches and leaves again, if the state lies close to it.
        (Some((moved, point)), _) if moved < NEAR => Ok(point),
        (_, Some(next)) if has_arrived(system, seed, &next, &lost) => Ok(next.point),
        _ => Err(no_start(system, seed, state, &lost)),
    })
}

/// True if a trajectory has reached the cycle although it does not repeat itself to the required accuracy, as in a
/// stiff model whose steps are limited by stability.
fn has_arrived(system: &System, seed: &SeedPlan, next: &Direct, lost: &Lost) -> bool {
    let unit = system.field.time_unit(&seed.parameters);
    matches!(lost, Lost::Unsettled { time, state, .. } if next.ends(*time, state, unit))
}

/// Message about a trajectory from a given state that led to no solution: its outcome, the cause and a cure.
fn no_start(system: &System, seed: &SeedPlan, state: &[f64], lost: &Lost) -> String {
    /// States whose motion is listed; they fit on one line.
    const TOLD: usize = 4;
    let what = match lost {
        Lost::Unsettled { time, extent, .. } => {
            let names = system.state_names.iter().zip(extent).take(TOLD);
            let spans: Vec<String> = names.map(|(name, span)| format!("{name} by {span:.1e}")).collect();
            let more = if extent.len() > TOLD { ", …" } else { "" };
            format!(
                "settles neither to an equilibrium nor to a cycle: after time {time:.1e} it still varies in {}{more}",
                spans.join(", ")
            )
        }
        Lost::Unconfirmed { period, state } if *period > 0.0 => format!(
            "settles to a cycle of period {:.6} through {}, which Newton's method does not confirm as isolated \
             and stable",
            Shown(*period),
            place(system, state)
        ),
        Lost::Unconfirmed { state, .. } => format!(
            "comes to rest at {}, where Newton's method finds no isolated, stable solution",
            place(system, state)
        ),
        Lost::Escaped => "grows without bound".to_string(),
        Lost::Undefined(_) => "leaves the region where the vector field is defined".to_string(),
        Lost::Stuck => "cannot be integrated: the step size becomes too small".to_string(),
        Lost::Chatter => "ends in chatter: its impacts follow each other ever faster and accumulate; the sustained \
                          contact that follows is not computed"
            .to_string(),
    };
    let exit = match lost {
        Lost::Undefined(exit) => Some(exit),
        _ => None,
    };
    let unsettled = matches!(lost, Lost::Unsettled { .. } | Lost::Unconfirmed { .. });
    let repeats = matches!(lost, Lost::Unconfirmed { period, .. } if *period > 0.0);
    let (stuck, all_escaped) = (*lost == Lost::Stuck, *lost == Lost::Escaped);
    let why = of_no_start(
        system,
        &seed.parameters,
        Seen { state: Some(state), stuck, all_escaped, exit, unsettled, repeats, instead: None },
    );
    format!("the trajectory from the given state {what}{why}")
}
