//! Order of the tasks of a plan.
//!
//! **Idea.** A family can begin as soon as the sampling of initial states that provides its start is done. Of the tasks
//! that can begin, the longest goes first, so that no thread is left alone with it at the end; a sampling counts as
//! much as the longest family that waits for it. Items named later in a plan build on earlier ones and usually take
//! longer.

use super::family::{self, Root};
use super::plan::{Plan, Start};
use super::seeds::Seeds;
use std::cmp::Reverse;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// A task for one thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Task {
    /// The sampling of initial states of that number.
    Census(usize),
    /// The family of that index.
    Family(usize),
}

/// Remaining tasks, the longest first.
pub(super) struct Schedule {
    waiting: Mutex<Vec<Waiting>>,
    changed: Condvar,
}

#[derive(Clone, Copy, Debug)]
struct Waiting {
    task: Task,
    /// The sampling that must be finished before.
    after: Option<usize>,
}

impl Schedule {
    /// Creates the tasks: everything that starts at a seed, and the samplings it needs.
    pub(super) fn new(plan: &Plan, families: &[Root], seeds: &Seeds) -> Schedule {
        let start = |root: &Root| match root {
            Root::Branch(index) => Some(&plan.branches[*index].start),
            Root::Homotopy(index) => Some(&plan.homotopies[*index].start),
            Root::Exploration(_) => None,
        };
        let after = |root: &Root| match start(root) {
            Some(Start::Seed(seed)) => seeds.census_of(*seed),
            _ => None,
        };
        let tasks = families.iter().enumerate().map(|(index, root)| {
            let rank = (family::weight(plan, *root), index);
            (rank, Waiting { task: Task::Family(index), after: after(root) })
        });
        let mut ranked: Vec<((usize, usize), Waiting)> = tasks.collect();
        for number in 0..seeds.count() {
            let own = ranked.iter().filter(|(_, waiting)| waiting.after == Some(number)).map(|(rank, _)| *rank);
            let rank = own.max().unwrap_or_default();
            ranked.push((rank, Waiting { task: Task::Census(number), after: None }));
        }
        ranked.sort_by_key(|(rank, _)| Reverse(*rank));
        Schedule {
            waiting: Mutex::new(ranked.into_iter().map(|(_, waiting)| waiting).collect()),
            changed: Condvar::new(),
        }
    }

    /// Returns the next task once one can begin; `None` when none is left. Dropping it releases the tasks that wait for
    /// it.
    pub(super) fn next(&self) -> Option<Claim<'_>> {
        let mut waiting = self.lock();
        loop {
            if waiting.is_empty() {
                return None;
            }
            if let Some(at) = waiting.iter().position(|own| own.after.is_none()) {
                return Some(Claim { schedule: self, task: waiting.remove(at).task });
            }
            waiting = self.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Drops every sampling that has not begun, and what waits for one: the run is to end soon.
    pub(super) fn hurry(&self) {
        self.lock().retain(|own| own.after.is_none() && matches!(own.task, Task::Family(_)));
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Waiting>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A task in progress.
pub(super) struct Claim<'s> {
    schedule: &'s Schedule,
    pub(super) task: Task,
}

impl Drop for Claim<'_> {
    fn drop(&mut self) {
        if let Task::Census(number) = self.task {
            let mut waiting = self.schedule.lock();
            waiting.iter_mut().filter(|own| own.after == Some(number)).for_each(|own| own.after = None);
            self.schedule.changed.notify_all();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::plan::{AttractorKey, BranchPlan, SeedPlan, SeedSource, Switching};
    use super::super::system::System;
    use super::*;
    use crate::contract::Unobserved;
    use crate::diagram::{Diagram, Kind};
    use crate::model::{Definition, Model, ModelSource, Parameter, State};

    /// A branch from each of three seeds, two of which share a sampling while that of the third is needed by the
    /// longest branch; and a branch that starts from a state.
    fn plan() -> Plan {
        let sampled = SeedSource::Attractor(AttractorKey::Equilibrium);
        let sources =
            [(1.0, sampled.clone()), (2.0, sampled.clone()), (1.0, sampled), (1.0, SeedSource::State(vec![0.5]))];
        let seeds = sources.into_iter().enumerate().map(|(k, (value, source))| SeedPlan {
            name: k.to_string(),
            source,
            parameters: vec![value],
            samples: 4,
            random: 1,
        });
        let branch = |seed: usize, depth: usize| BranchPlan {
            holds: Default::default(),
            name: seed.to_string(),
            start: Start::Seed(seed),
            free: 0,
            range: [0.0, 3.0],
            until: None,
            switching: Switching { depth: vec![(Kind::BranchPoint, depth)], only: Vec::new() },
            marks: Vec::new(),
            max_points: 10,
        };
        let branches = vec![branch(0, 0), branch(1, 2), branch(2, 1), branch(3, 0)];
        Plan { seeds: seeds.collect(), branches, ..Plan::empty(1e-6, 4) }
    }

    fn decay() -> Model {
        Model::compile(ModelSource {
            name: "decay".into(),
            parameters: vec![Parameter::new("p", 1.0)],
            states: vec![State::new("x")],
            equations: vec![Definition::new("x", "p - x")],
            ..ModelSource::default()
        })
        .unwrap()
    }

    fn scheduled(work: impl FnOnce(&Schedule)) {
        let (model, plan, earlier) = (decay(), plan(), Diagram::default());
        let system = System::of_plan(&model, &plan);
        let seeds = Seeds::new(&system, &plan, 1, &earlier, &[], &Unobserved);
        assert_eq!((seeds.census_of(0), seeds.census_of(1), seeds.census_of(2)), (Some(0), Some(1), Some(0)));
        let families: Vec<Root> = (0..4).map(Root::Branch).collect();
        work(&Schedule::new(&plan, &families, &seeds));
    }

    #[test]
    fn the_census_of_the_longest_family_goes_first_and_families_wait_for_their_own_only() {
        scheduled(|schedule| {
            let long = schedule.next().unwrap();
            let short = schedule.next().unwrap();
            assert_eq!((long.task, short.task), (Task::Census(1), Task::Census(0)));
            // Nothing else can begin except what starts from a state.
            assert_eq!(schedule.next().unwrap().task, Task::Family(3));
            drop(short);
            assert_eq!(schedule.next().unwrap().task, Task::Family(2));
            drop(long);
            let rest = [schedule.next().unwrap().task, schedule.next().unwrap().task];
            assert_eq!(rest, [Task::Family(1), Task::Family(0)]);
            assert!(schedule.next().is_none());
        });
    }

    #[test]
    fn a_thread_waits_until_what_is_left_can_begin() {
        scheduled(|schedule| {
            let first = schedule.next().unwrap();
            std::thread::scope(|scope| {
                let others = scope.spawn(|| std::iter::from_fn(|| schedule.next().map(|claim| claim.task)).count());
                drop(first);
                // The rest, except for the tasks that this thread takes meanwhile.
                let own = std::iter::from_fn(|| schedule.next().map(|claim| claim.task)).count();
                assert_eq!(own + others.join().unwrap(), 5);
            });
        });
    }

    #[test]
    fn hurrying_drops_censuses_not_begun_and_the_families_that_wait_for_them() {
        scheduled(|schedule| {
            let census = schedule.next().unwrap();
            assert_eq!(census.task, Task::Census(1));
            schedule.hurry();
            drop(census);
            assert_eq!(schedule.next().unwrap().task, Task::Family(3));
            assert!(schedule.next().is_none());
        });
    }
}
