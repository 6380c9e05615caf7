//! What is done first.
//!
//! **Idea.** A family can begin as soon as the census is known from which its start is taken. Of what can begin the longest goes first,
//! so that no thread is left alone with it in the end; a census counts for the longest family that waits for it. What a plan names
//! later builds on what it names earlier and takes longer, if anything.

use super::family::{self, Root};
use super::plan::{Plan, Start};
use super::seeds::Seeds;
use std::cmp::Reverse;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Something that one thread does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Task {
    /// The census of that number.
    Census(usize),
    /// The family of that index.
    Family(usize),
}

/// What is left to do, the longest first.
pub(super) struct Schedule {
    waiting: Mutex<Vec<Waiting>>,
    changed: Condvar,
}

#[derive(Clone, Copy, Debug)]
struct Waiting {
    task: Task,
    /// The census that must be finished before.
    after: Option<usize>,
}

impl Schedule {
    /// Everything that starts at a seed, and the censuses for it.
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

    /// The next task, once there is one that can begin; `None` when none is left. What waits for it can begin once it is dropped.
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

    /// Leaves out every census that has not begun, and what waits for one: nobody wants to wait for that any more.
    pub(super) fn hurry(&self) {
        self.lock().retain(|own| own.after.is_none() && matches!(own.task, Task::Family(_)));
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Waiting>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A task that somebody is at.
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
