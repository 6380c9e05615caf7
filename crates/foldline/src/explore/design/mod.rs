//! Design questions: the value of one parameter beyond which a motion is absent, unstable, or small enough at every speed.
//!
//! **Idea.** The solutions of a branch at all values of its parameter λ ("speed") and of the design parameter p form a
//! surface. The part to be avoided (all of it; its stable part; the part on which a quantity reaches a bound) ends at curves
//! of folds, of other bifurcations, or of solutions with that bound. The largest p on that part is an extremum of such a
//! curve, or lies where one leaves the range of λ.
//!
//! 1. *Lines*: from points of the branch spread over the range, solutions are followed in p at fixed λ, as far as they go.
//!    The special points on them and on the branch lie on the curves.
//! 2. *Curves*: each is followed in both parameters, once. Its turning points in p and its passages of the ends of the
//!    range are located, with errors.
//! 3. *Check*: the branch is followed at values of p just on either side of the best candidate, and lines are followed from
//!    there. What they find beyond the candidate lies on curves not known yet; step 2 is repeated with these.
//!
//! **Equations.** With F(w, λ, p) = 0 the surface and g = 0 the condition of the curve, a candidate in the range satisfies
//!
//! ```text
//!   (1)  F = 0,   g = 0,   dp/ds = 0 along the curve
//! ```
//!
//! On a curve of folds it is a singular point of the surface's levels of p: the centre of an isola if p is largest there.
//!
//! **Departures.** The claim is about the surface that is connected to the branch within the ranges, not about other
//! solutions of the same kind.
//!
//! **Fails when** the part to be avoided ends at something that is not followed in two parameters; the answer then
//! carries the reason.

mod along;
mod check;
mod curves;
mod lines;
mod search;

use super::System;
use super::plan::{DesignPlan, Plan};
use crate::contract::{Event, Observer, Verdict};
use crate::diagram::{Branch, Design, Diagram};
use search::Search;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Answers every design question of the plan; returns the branches followed for them, and the answers, both in the order of
/// the plan. Questions interrupted by the observer have no answer.
pub(super) fn answers(
    system: &System,
    plan: &Plan,
    jobs: usize,
    branches: &[Branch],
    earlier: &Diagram,
    observer: &dyn Observer,
) -> (Vec<Branch>, Vec<Design>) {
    type Found = (Vec<Branch>, Option<Design>);
    let next = AtomicUsize::new(0);
    let found: Vec<Mutex<Found>> = plan.designs.iter().map(|_| Mutex::default()).collect();
    let work = || {
        while let Some((design, slot)) = {
            let index = next.fetch_add(1, Ordering::Relaxed);
            plan.designs.get(index).zip(found.get(index))
        } {
            let own = one(system, plan, design, branches, earlier, observer);
            if let Ok(mut slot) = slot.lock() {
                *slot = own;
            }
        }
    };
    std::thread::scope(|scope| {
        (1..jobs.min(plan.designs.len())).for_each(|_| drop(scope.spawn(work)));
        work();
    });
    let (mut legs, mut designs) = (Vec::new(), Vec::new());
    for (own, design) in found.into_iter().filter_map(|slot| slot.into_inner().ok()) {
        legs.extend(own);
        designs.extend(design);
    }
    (legs, designs)
}

/// Answers one question, unless an earlier run has the answer.
fn one(
    system: &System,
    plan: &Plan,
    design: &DesignPlan,
    branches: &[Branch],
    earlier: &Diagram,
    observer: &dyn Observer,
) -> (Vec<Branch>, Option<Design>) {
    if let Some(known) = earlier.design(&design.name) {
        let own = |branch: &&Branch| branch.name.starts_with(&format!("{}/", design.name));
        return (earlier.branches.iter().filter(own).cloned().collect(), Some(known.clone()));
    }
    if observer.stopping() {
        return (Vec::new(), None);
    }
    let mut search = Search::new(system, plan, design, branches, earlier, observer);
    let answer = search.answer();
    let going = search.going && !observer.stopping();
    let answer = answer.filter(|_| going);
    let told = answer.as_ref().is_none_or(|design| observer.observe(Event::Design(design)) == Verdict::Continue);
    (search.legs, answer.filter(|_| told))
}
