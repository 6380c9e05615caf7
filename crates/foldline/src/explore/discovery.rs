//! Automatic exploration: a diagram without prescribed starting points.
//!
//! **Idea.** At values spread over the range of the parameter attractors are sampled, and equilibria, stable or not,
//! are found by Newton's method from the same initial states. Any solution not on a known branch starts a new one,
//! which is followed over the whole range, with all branches that bifurcate from it. If there is a second parameter,
//! folds are continued in it: where their curve returns to the initial value of that parameter there is another fold,
//! perhaps on a branch that is not reached otherwise.
//!
//! 1. the values: halves, quarters, eighths of the range and so on, so that the largest gap is explored first;
//! 2. at each value (`lookout`): equilibria by increasing size, then cycles by decreasing number of hits;
//! 3. each of these: on a known branch (`known`), or the start of a new one (`family`);
//! 4. near resonances of the linear response of a whirling or forced model (`resonances`), where isolas attract few
//!    samples: cycles from averaged equations, treated as in step 3;
//! 5. each fold of each branch, unless a curve has passed it: its curve (`curves`), and a new branch from each unknown
//!    fold met there; then the folds of these branches, until there are no more.
//!
//! The exploration ends when all of this is done, or when the budget of points is used up and no new branch may start;
//! the remaining steps are then reported. The result does not depend on the number of threads.
//!
//! **Fails when** a branch has no stable part at any of the values, no equilibria, no bifurcation that leads to it, no
//! resonance nearby and no fold connected with a known one: there is no proof that a diagram is complete.

use super::family::Work;
use super::growth::settings;
use super::lookout::{Lookout, Sight};
use super::plan::{BranchPlan, CurvePlan, ExplorePlan, Start};
use super::profile::with_degree;
use super::resonances::Resonances;
use super::{curves, known};
use crate::attractors::spectral_ratio;
use crate::contract::Event;
use crate::diagram::{Branch, Kind, Origin, Point, Shown, Solution, SpecialPoint};
use crate::special::mark::Mark;
use crate::special::normal_form::units;
use crate::special::quantity::Quantity;

/// Carries out an exploration. Returns false if the observer wants to stop.
pub(super) fn explore(work: &mut Work, plan: &ExplorePlan, jobs: usize) -> bool {
    work.budget = plan.budget;
    let lookout = Lookout::new(work.system, plan, work.plan.tolerance);
    let mut discovery = Discovery { work, plan, named: Vec::new(), unsettled: 0, singular: Vec::new() };
    // While this thread follows the solutions found at one value, others scan the next values.
    let sampled = std::thread::scope(|scope| {
        (1..jobs.min(plan.values)).for_each(|_| drop(scope.spawn(|| while lookout.look() {})));
        let going = (0..plan.values).all(|index| discovery.exhausted() || discovery.met(index, lookout.at(index)));
        lookout.close();
        going
    });
    let going = sampled
        && discovery.postponed()
        && discovery.resonant()
        && plan.connect.is_none_or(|(second, range)| discovery.connected(second, range));
    going && discovery.told()
}

struct Discovery<'d, 'w> {
    work: &'d mut Work<'w>,
    plan: &'d ExplorePlan,
    /// Type names of the roots so far, such as `cycle`, one for each root.
    named: Vec<String>,
    /// Number of values at which some samples did not settle.
    unsettled: usize,
    /// Equilibria at a bifurcation, which wait for the branches found elsewhere.
    singular: Vec<(Point, Origin)>,
}

/// Smallest eigenvalue of an equilibrium, in rates of change near it, below which it may be a multiple one: the square root
/// of the accuracy to which Newton's method finds a double solution.
const SINGULAR: f64 = 1e-4;
/// Distance from such an equilibrium, in the range of the parameter and in sizes of the states, within which a special point of
/// a branch explains it. Empirical: far above the errors of both, far below the distances of branches.
const BESIDE: f64 = 1e-2;

impl Discovery<'_, '_> {
    /// Carries out steps 2 and 3 at one of the values.
    fn met(&mut self, index: usize, sight: Sight) -> bool {
        let value = sight.value;
        if !self.work.tell(Event::Visited(&self.plan.name, value, index + 1, self.plan.values)) {
            return false;
        }
        self.unsettled += usize::from(sight.unsettled);
        let (found, said) = match sight.found {
            Ok(found) => found,
            Err(why) => return self.short(&format!("no branch can start at {}: {why}", Shown(value))),
        };
        let origin = Origin::Seed(format!("{}, at {}", self.plan.name, Shown(value)));
        self.note(&said)
            && found.into_iter().all(|point| match self.is_singular(&point) {
                true => {
                    self.singular.push((point, origin.clone()));
                    true
                }
                false => self.followed(point, origin.clone()),
            })
    }

    /// True for an equilibrium with an eigenvalue that is 0 within the accuracy of a multiple solution, as where one of the
    /// values is that of a bifurcation. From there, the two sides of a branch can belong to different ones.
    fn is_singular(&self, point: &Point) -> bool {
        let Solution::Equilibrium(state) = &point.solution else { return false };
        let system = self.work.system;
        let sizes: Vec<f64> = state.iter().zip(&system.scales).map(|(x, s)| x.abs() + s).collect();
        let (_, rate) = units(system.field, state, &point.parameters, &sizes);
        point.spectrum.iter().any(|z| z.norm() < SINGULAR * rate)
    }

    /// Follows the equilibria at a bifurcation that no special point of a branch explains.
    fn postponed(&mut self) -> bool {
        let (free, width) = (self.plan.free, self.plan.range[1] - self.plan.range[0]);
        std::mem::take(&mut self.singular).into_iter().all(|(point, origin)| {
            let measure = self.work.system.measure();
            let beside = |special: &SpecialPoint| {
                (special.point.parameters[free] - point.parameters[free]).abs() <= BESIDE * width
                    && special.point.distance(&point, measure) <= BESIDE
            };
            let explained = self.work.branches.iter().any(|own| own.free == free && own.special.iter().any(&beside));
            explained || self.followed(point, origin)
        })
    }

    /// Step 3: follows a new branch from a solution, unless it lies on a known one.
    fn followed(&mut self, point: Point, origin: Origin) -> bool {
        if self.exhausted() {
            return true;
        }
        let (work, plan) = (&mut *self.work, self.plan);
        let point = with_degree(point, work.plan.degree);
        let settings = settings(work.system, work.plan.tolerance, plan.range, plan.max_points);
        let (system, degree, observer) = (work.system, work.plan.degree, work.observer);
        if known::branch_of(system, &settings, plan.free, degree, &point, &work.branches, observer).is_some() {
            return true;
        }
        let kind = match (&point.solution, system.whirl) {
            (Solution::Equilibrium(_), _) => "equilibrium".to_string(),
            (Solution::Torus(_), _) => "torus".to_string(),
            (Solution::Cycle(cycle), Some(whirl)) => {
                spectral_ratio(cycle, whirl).map_or("cycle".to_string(), |(p, q)| format!("{p}:{q}"))
            }
            (Solution::Cycle(_), None) => "cycle".to_string(),
        };
        self.named.push(kind.clone());
        let number = self.named.iter().filter(|other| **other == kind).count();
        let branch = BranchPlan {
            holds: Default::default(),
            name: format!("{}/{kind}-{number}", plan.name),
            start: Start::Seed(0),
            free: plan.free,
            range: plan.range,
            until: None,
            switching: plan.switching.clone(),
            marks: Vec::new(),
            max_points: plan.max_points,
        };
        work.grown(&branch, origin, Ok(point))
    }

    /// Carries out step 4.
    fn resonant(&mut self) -> bool {
        let (system, plan, tolerance) = (self.work.system, self.plan, self.work.plan.tolerance);
        if system.whirl.is_none() && !system.field.forced() || system.field.iterated() || self.exhausted() {
            return true;
        }
        let resonances = Resonances { system, plan, tolerance };
        let (roots, left) = resonances.roots();
        let places: Vec<String> =
            roots.iter().map(|root| format!("{} at {:.4}", root.name(), Shown(root.value))).collect();
        let (known, mut averaged, mut corrected, mut cycles) = (self.named.len(), 0, 0, 0);
        for root in &roots {
            for value in root.values(plan.range) {
                if self.exhausted() || system.field.ended() {
                    break;
                }
                let found = resonances.cycles(root, value);
                (averaged, corrected) = (averaged + found.averaged, corrected + found.corrected);
                cycles += found.cycles.len();
                let origin = Origin::Seed(format!("{}, near {} at {}", plan.name, root.name(), Shown(value)));
                if !found.cycles.into_iter().all(|point| self.followed(point, origin.clone())) {
                    return false;
                }
            }
        }
        if system.field.ended() {
            return false;
        }
        let left = if left > 0 { format!("; {left} more were not examined") } else { String::new() };
        let branches = self.named.len() - known;
        places.is_empty()
            || self.note(&format!(
                "resonances of the lightly damped linear response: {}{left}; {averaged} solutions of averaged \
                 equations gave {corrected} approximate cycles, Newton's method converged for {cycles} of them: \
                 {branches} new branches",
                places.join(", ")
            ))
    }

    /// Carries out step 5.
    fn connected(&mut self, second: usize, range: [f64; 2]) -> bool {
        let home = self.plan.parameters[second];
        // Folds that a curve has passed.
        let mut passed: Vec<Point> = Vec::new();
        let mut branch = 0;
        while branch < self.work.branches.len() {
            let parent = self.work.branches[branch].clone();
            let folds = parent.special.iter().filter(|s| s.kind == Kind::Fold && parent.held.is_none());
            for (number, fold) in folds.enumerate() {
                if passed.iter().any(|other| self.same_fold(other, &fold.point)) || self.exhausted() {
                    continue;
                }
                let (curve, going) = self.fold_curve(&parent, (number + 1, fold), second, range);
                let met: Vec<Point> = (curve.special.iter())
                    .filter(|s| s.kind == Kind::Mark && s.point.position != 0)
                    .filter(|s| {
                        (s.point.parameters[second] - home).abs() <= 1e-6 * (self.work.system.unit(second) + home.abs())
                    })
                    .map(|s| s.point.clone())
                    .collect();
                let name = curve.name.clone();
                self.work.branches.push(curve);
                if !going {
                    return false;
                }
                passed.extend(met.iter().cloned());
                for other in &met {
                    if !self.known_fold(other) && !self.left_from(other, home, second, &name) {
                        return false;
                    }
                }
            }
            branch += 1;
        }
        true
    }

    /// Follows the curve of a fold in both parameters, with a mark at the value that the second has along the branches.
    fn fold_curve(
        &self,
        parent: &Branch,
        (number, fold): (usize, &SpecialPoint),
        second: usize,
        range: [f64; 2],
    ) -> (Branch, bool) {
        let (work, plan) = (&*self.work, self.plan);
        let curve = CurvePlan {
            name: format!("{}/fold-{number}", parent.name),
            hold: Kind::Fold,
            of: parent.name.clone(),
            near: None,
            to: None,
            further: Vec::new(),
            free: second,
            ranges: [plan.range, range],
            until: None,
            marks: Vec::new(),
            max_points: plan.max_points,
        };
        let home = Mark::at(Quantity::Parameter(second), plan.parameters[second], false);
        let earlier = work.earlier.branch(&curve.name);
        curves::follow_from(work.system, work.plan, &curve, parent, Ok(fold), &[home], earlier, work.observer)
    }

    /// True if a point is a fold of a known branch.
    fn known_fold(&self, at: &Point) -> bool {
        let branches = self.work.branches.iter().filter(|branch| branch.held.is_none());
        let mut folds = branches.flat_map(|branch| branch.special.iter().filter(|s| s.kind == Kind::Fold));
        folds.any(|fold| self.same_fold(&fold.point, at))
    }

    /// True if two folds at the same value of the second parameter are the same, or images of each other.
    fn same_fold(&self, a: &Point, b: &Point) -> bool {
        // An error ε of the fold value moves the solution along the branch by √ε. If one fold is taken for two, the
        // second only leads to a known branch.
        const NEAR: f64 = 1e-4;
        let (system, free, [low, high]) = (self.work.system, self.plan.free, self.plan.range);
        let [p, q] = [a, b].map(|point| point.parameters[free]);
        (p - q).abs() <= NEAR * (high - low)
            && system.symmetries.iter().any(|r| a.difference(b, system.measure(), r) < NEAR.sqrt())
    }

    /// Follows a new branch from a fold that a curve has met.
    fn left_from(&mut self, fold: &Point, home: f64, second: usize, curve: &str) -> bool {
        let mut fold = fold.clone();
        fold.parameters[second] = home;
        match curves::leaving(self.work.system, self.work.plan, self.plan.free, &fold) {
            Ok(point) => self.followed(point, Origin::EndOf(curve.to_string())),
            Err(why) => {
                let value = fold.parameters[self.plan.free];
                self.short(&format!(
                    "no solution was found beside the fold at {value:.6}, to which {curve} leads: {why}"
                ))
            }
        }
    }

    fn exhausted(&self) -> bool {
        self.work.points() >= self.plan.budget
    }

    fn note(&self, text: &str) -> bool {
        self.work.tell(Event::Note(&self.plan.name, text))
    }

    fn short(&self, text: &str) -> bool {
        self.work.tell(Event::Short(&self.plan.name, text))
    }

    /// Reports the result of the exploration.
    fn told(&self) -> bool {
        let count = |held: bool| self.work.branches.iter().filter(|b| b.held.is_some() == held).count();
        let (branches, curves, points) = (count(false), count(true), self.work.points());
        let mut going = self.note(&format!("{branches} branches and {curves} curves with {points} points"));
        if self.exhausted() {
            let budget = self.plan.budget;
            going &= self.short(&format!(
                "the budget of {budget} points is used up, so the diagram may lack branches\nwhat to do: increase \
                 the budget"
            ));
        }
        let (values, samples) = (self.plan.values, self.plan.samples);
        if self.unsettled > 0 {
            going &= self.short(&format!(
                "at {} of {values} parameter values, some of the {samples} samples did not settle: tori, chaotic \
                 attractors and slowly attracting solutions are not followed\nwhat to do: examine such a value with \
                 `foldline attractors`; to reach a slowly attracting cycle, follow a branch from larger damping or \
                 start from a given state",
                self.unsettled
            ));
        }
        going
    }
}
