//! Agreement between simulation and continuation.
//!
//! **Idea.** Every motion found by a survey is looked up among the solutions of the branches at that parameter value,
//! and every stable solution among the motions. A stable solution that sampling missed is simulated from its own state,
//! displaced by [`ASIDE`]: if the trajectory returns, the solution attracts and only its basin was too small for the
//! sample. A motion that had not settled is integrated further.
//!
//! **Equations.** A trajectory that repeats itself with an error e, relative to the extent X_i of component i, is
//!
//!   (1)  e X_i / (1 - ρ^k) + 10⁻⁷ (s_i + |x_i|)
//!
//! away from a cycle traversed k times whose largest nontrivial multiplier has the modulus ρ; the second part, with the
//! scale s_i, is the integration error. A trajectory at rest is e (s_i + |x_i|) away from the equilibrium. The error of
//! the branch is added: its tolerance or estimated discretisation error times s_i + |x_i|. Together they never allow
//! more than 10⁻³.
//!
//! **Fails when** a motion contracts so slowly that (1) reaches that limit: it then counts as unexplained.

use crate::runs::Run;
use foldline::attractors::{Trial, stepped_sweep};
use foldline::continuation::Settings;
use foldline::contract::Verdict;
use foldline::diagram::{Branch, Motion, Point, Response, Responses, Solution};
use foldline::explore::{System, growth, known};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Displacement of a start from a solution, relative to scale and size; if it does not return, a tenth of that. To
/// count as settled, the trajectory must come a hundred times closer.
pub const ASIDE: f64 = 1e-4;
/// Maximum number of times that an unsettled motion is integrated further.
const FOLLOWED: usize = 6;
const INTEGRATION: f64 = 1e-7;
const LARGEST: f64 = 1e-3;
/// Maximum number of turns of a branch's cycle after which a trajectory may repeat itself; close to a period doubling
/// it needs two for a long time.
const TURNS: i32 = 4;
/// A motion farther than this from every solution, in units of the allowance in (1), is not described as near one.
const NEARLY: f64 = 30.0;

/// Mutual coverage of a survey and branches.
#[derive(Clone, Debug, Default)]
pub struct Agreement {
    /// Every motion found by the survey.
    pub met: Vec<Met>,
    /// Every stable solution of a branch at the values of the survey.
    pub stable: Vec<Stable>,
}

/// A motion found by the survey.
#[derive(Clone, Debug)]
pub struct Met {
    /// The motion; if it had not settled, its continuation.
    pub motion: Response,
    /// Number of times it was integrated further.
    pub followed: usize,
    /// Closest solution of the same type.
    pub nearest: Option<Place>,
}

impl Met {
    /// Solution that the motion represents.
    pub fn on(&self) -> Option<&Place> {
        self.nearest.as_ref().filter(|place| place.apart <= 1.0)
    }

    /// True if it lies on a stable part of a branch.
    pub fn is_explained(&self) -> bool {
        self.on().is_some_and(|place| place.stable)
    }
}

/// A solution on a branch.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// Name of the branch.
    pub branch: String,
    /// True if the solution is stable.
    pub stable: bool,
    /// Number of turns of the solution over which the trajectory was compared.
    pub turns: i32,
    /// Largest difference of period and ranges, as a fraction of the allowance in (1).
    pub apart: f64,
}

/// A stable solution.
#[derive(Clone, Debug)]
pub struct Stable {
    /// Name of the branch.
    pub branch: String,
    /// Value of the parameter.
    pub value: f64,
    /// The solution.
    pub point: Point,
    /// Evidence from simulation.
    pub seen: Seen,
}

/// Evidence from simulation for a stable solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// This number of starts of the survey settled there.
    Sampled(usize),
    /// No start of the survey settled there, but a trajectory started close by did.
    FromNearby,
    /// A trajectory started close by neither rests nor repeats itself; long cycles may not be recognised.
    Unsettled,
    /// None: the trajectory started close by went elsewhere.
    Never,
}

/// Compares a survey or sweep of `simulated` with every branch of `followed` at the same parameters, using `jobs`
/// threads.
pub fn compare(simulated: &Run, set: &Responses, followed: &[&Run], jobs: usize) -> Agreement {
    let system = System::of_plan(&simulated.study.model, &simulated.study.plan);
    let trial = Trial {
        field: system.field,
        scales: &system.scales,
        whirl: system.whirl,
        jobs: 1,
        limits: foldline::attractors::Limits::patient(),
    };
    let context = Context { system: &system, trial, free: set.free, followed };
    let groups: Vec<&[Response]> = set.responses.chunk_by(|a, b| a.value == b.value).collect();
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        while let Some((index, group)) = {
            let index = next.fetch_add(1, Ordering::Relaxed);
            groups.get(index).map(|group| (index, *group))
        } {
            let found = context.at_value(group, set.search == foldline::diagram::Search::Survey);
            if let Ok(mut done) = done.lock() {
                done.push((index, found));
            }
        }
    };
    std::thread::scope(|scope| (0..jobs.clamp(1, groups.len().max(1))).for_each(|_| drop(scope.spawn(work))));
    let mut done = done.into_inner().unwrap_or_default();
    done.sort_by_key(|(index, _)| *index);
    let mut all = Agreement::default();
    for (_, found) in done {
        all.met.extend(found.met);
        all.stable.extend(found.stable);
    }
    all
}

struct Context<'a> {
    system: &'a System<'a>,
    trial: Trial<'a>,
    free: usize,
    followed: &'a [&'a Run],
}

/// A solution of a branch, and the tolerance of its computation.
struct Known<'a> {
    branch: &'a Branch,
    point: Point,
    tolerance: f64,
}

impl Context<'_> {
    /// Compares the motions at one value, and if `both` also the stable solutions.
    fn at_value(&self, group: &[Response], both: bool) -> Agreement {
        let Some(first) = group.first() else { return Agreement::default() };
        let known = self.solutions(first, false);
        let mut met: Vec<Met> = group.iter().map(|response| self.explained(response, &known)).collect();
        if met.iter().any(|m| !m.is_explained()) {
            // If not on a stable part, perhaps on an unstable one.
            let all = self.solutions(first, true);
            for m in met.iter_mut().filter(|m| !m.is_explained()) {
                m.nearest = self.nearest(&m.motion, &all);
            }
        }
        let stable = known.iter().filter(|k| both && k.point.unstable == 0);
        let stable = stable.map(|k| Stable {
            branch: k.branch.name.clone(),
            value: first.value,
            point: k.point.clone(),
            seen: self.seen(k, first, &met),
        });
        Agreement { stable: stable.collect(), met }
    }

    /// Solutions of every branch at the parameters of a response; parts that are certainly unstable are included only
    /// if `unstable`.
    fn solutions(&self, response: &Response, unstable: bool) -> Vec<Known<'_>> {
        let same = |point: &Point| {
            let pairs = point.parameters.iter().zip(&response.parameters).enumerate();
            pairs.filter(|(k, _)| *k != self.free).all(|(_, (a, b))| a == b)
        };
        let mut found = Vec::new();
        for run in self.followed {
            let tolerance = run.study.plan.tolerance;
            let settings: Settings = growth::settings(self.system, tolerance, [f64::NEG_INFINITY, f64::INFINITY], 0);
            for branch in run.diagram.branches.iter().filter(|b| b.held.is_none() && b.free == self.free) {
                if !branch.points.first().is_some_and(same) {
                    continue;
                }
                for part in passing(branch, response.value, unstable) {
                    let points = known::solutions_at(self.system, &settings, &part, response.value);
                    found.extend(points.into_iter().map(|point| Known { branch, point, tolerance }));
                }
            }
        }
        found
    }

    /// Pairs a motion with its closest solution.
    fn explained(&self, response: &Response, known: &[Known]) -> Met {
        let (motion, followed) = self.followed_on(response.clone());
        let nearest = self.nearest(&motion, known);
        Met { motion, followed, nearest }
    }

    /// Integrates an unsettled motion further; returns the motion and the number of integrations.
    fn followed_on(&self, mut motion: Response) -> (Response, usize) {
        let mut followed = 0;
        while motion.motion == Motion::Other && followed < FOLLOWED {
            followed += 1;
            let Some(next) = self.settled(&motion.parameters, motion.value, &motion.state) else { break };
            motion = Response { hits: motion.hits, ..next };
        }
        (motion, followed)
    }

    /// Response to which a trajectory settles.
    fn settled(&self, parameters: &[f64], value: f64, start: &[f64]) -> Option<Response> {
        stepped_sweep(&self.trial, parameters, self.free, &[value], start, &mut |_, _| None, &|_| Verdict::Continue)
            .pop()
    }

    fn seen(&self, known: &Known, at: &Response, met: &[Met]) -> Seen {
        let here = |motion: &Response| self.apart(motion, known).is_some_and(|(_, apart)| apart <= 1.0);
        let hits: usize = met.iter().filter(|m| here(&m.motion)).map(|m| m.motion.hits).sum();
        if hits > 0 {
            return Seen::Sampled(hits);
        }
        let solution = match &known.point.solution {
            Solution::Equilibrium(x) => x.clone(),
            Solution::Cycle(cycle) => cycle.state(0.0),
            Solution::Torus(torus) => torus.state(0.0, 0.0),
        };
        let mut seen = Seen::Never;
        // Near its birth or a period doubling, a cycle has a very narrow basin.
        for aside in [ASIDE, 0.1 * ASIDE] {
            let start = solution.iter().zip(&self.system.scales).map(|(x, scale)| x + aside * (scale + x.abs()));
            let start: Vec<f64> = start.collect();
            let Some(motion) = self.settled(&at.parameters, at.value, &start) else { continue };
            let (motion, _) = self.followed_on(motion);
            if here(&motion) {
                return Seen::FromNearby;
            }
            if motion.motion == Motion::Other {
                seen = Seen::Unsettled;
            }
        }
        seen
    }

    /// Closest solution to a motion.
    fn nearest(&self, motion: &Response, known: &[Known]) -> Option<Place> {
        let near = known.iter().filter_map(|k| self.apart(motion, k).map(|(turns, apart)| (k, turns, apart)));
        let (k, turns, apart) = near.min_by(|a, b| a.2.total_cmp(&b.2))?;
        Some(Place { branch: k.branch.name.clone(), stable: k.point.unstable == 0, turns, apart })
    }

    /// Number of turns, and the difference as a fraction of the allowance in (1); `None` for motions of different
    /// types.
    fn apart(&self, motion: &Response, known: &Known) -> Option<(i32, f64)> {
        let accuracy = known.tolerance.max(known.point.trust.discretisation) + INTEGRATION;
        let (turns, doubt, mut apart) = match (motion.period, known.point.solution.period()) {
            (Some(a), Some(b)) => {
                let turns = (a / b).round() as i32;
                let slowest = known.point.free_spectrum().iter().map(|m| m.norm()).fold(0.0, f64::max);
                let doubt = motion.error / (1.0 - slowest.min(1.0).powi(turns));
                let allowed = (accuracy + doubt).min(LARGEST) * a;
                ((1..=TURNS).contains(&turns)).then_some((turns, doubt, (a - turns as f64 * b).abs() / allowed))?
            }
            (None, None) if motion.motion == Motion::Equilibrium => (1, motion.error, 0.0),
            _ => return None,
        };
        for (i, (a, b)) in motion.ranges.iter().zip(&known.point.ranges).enumerate() {
            let size = self.system.scales.get(i).copied().unwrap_or(0.0) + b[0].abs().max(b[1].abs());
            let doubt = if motion.period.is_some() { doubt * (b[1] - b[0]) } else { doubt * size };
            let allowed = (accuracy * size + doubt).min(LARGEST * size);
            apart = apart.max((a[0] - b[0]).abs() / allowed).max((a[1] - b[1]).abs() / allowed);
        }
        Some((turns, apart))
    }
}

/// Pairs of neighbouring points of a branch that enclose a value. Pairs that are unstable at both ends are included
/// only if `unstable`, or if a special point lies between them.
fn passing(branch: &Branch, value: f64, unstable: bool) -> Vec<Branch> {
    let pairs = branch.points.windows(2).map(|pair| {
        let between =
            branch.special.iter().filter(|s| (pair[0].position..pair[1].position).contains(&s.point.position));
        let mut part = Branch::new(branch.name.clone(), branch.family, branch.free, branch.origin.clone());
        part.points = pair.to_vec();
        part.special = between.cloned().collect();
        part
    });
    let wanted = |part: &Branch| {
        let all = || part.points.iter().chain(part.special.iter().map(|s| &s.point));
        let side = |p: &Point| p.parameters[branch.free] - value;
        let (low, high) = (all().map(side).fold(f64::MAX, f64::min), all().map(side).fold(f64::MIN, f64::max));
        low <= 0.0
            && high >= 0.0
            && (unstable || !part.special.is_empty() || part.points.iter().any(|p| p.unstable == 0))
    };
    pairs.filter(wanted).collect()
}

impl Agreement {
    /// Motions on no branch, or on an unstable part of one, grouped by likeness: description, number and range of
    /// values, number of starts.
    pub fn unexplained(&self) -> Vec<String> {
        let mut groups: Vec<(String, Vec<&Response>)> = Vec::new();
        for met in self.met.iter().filter(|m| !m.is_explained()) {
            let near = met.nearest.as_ref().filter(|place| place.apart < NEARLY);
            let aside = near.map(|place| match place.apart <= 1.0 {
                true => format!(" (unstable on {})", place.branch),
                false => format!(" ({:.1} times the errors from {})", place.apart, place.branch),
            });
            let name = format!("{}{}", described(&met.motion), aside.unwrap_or_default());
            match groups.iter_mut().find(|(known, _)| *known == name) {
                Some((_, all)) => all.push(&met.motion),
                None => groups.push((name, vec![&met.motion])),
            }
        }
        let line = |(name, all): (String, Vec<&Response>)| {
            let hits: usize = all.iter().map(|r| r.hits).sum();
            let values = all.iter().map(|r| r.value);
            let [low, high] = values.fold([f64::MAX, f64::MIN], |[low, high], v| [low.min(v), high.max(v)]);
            let starts = if hits == 1 { "1 start".to_string() } else { format!("{hits} starts") };
            match all.as_slice() {
                [one] => format!("{name} at {:.2}, {starts}", one.value),
                _ => format!("{name} at {} values from {low:.2} to {high:.2}, {starts}", all.len()),
            }
        };
        groups.into_iter().map(line).collect()
    }
}

/// Describes a motion: `4:1`, `4:1 closing after 3 turns`, `not settled`.
pub fn described(motion: &Response) -> String {
    match (motion.motion, motion.ratio, motion.multiplicity) {
        (Motion::Cycle, Some((p, q)), 1) => format!("{p}:{q}"),
        (Motion::Cycle, Some((p, q)), turns) => format!("{p}:{q} closing after {turns} turns"),
        (Motion::Cycle, None, _) => "a cycle".into(),
        (Motion::Torus, ..) => "quasi-periodic motion".into(),
        (Motion::Chaos, ..) => "chaos".into(),
        (Motion::Other, ..) => "neither at rest nor periodic".into(),
        (other, ..) => other.name().into(),
    }
}
