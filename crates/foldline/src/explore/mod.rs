//! From a plan to a diagram: follow → locate → switch → follow.
//!
//! **Idea.** A *family* is a branch of the plan with everything that grows from it: the branches that start at its end
//! and those switched to at its special points. Families do not depend on each other, so they are followed in parallel,
//! and the result is the same for any number of threads.
//!
//! | question | file |
//! |---|---|
//! | what is requested? | [`plan`] |
//! | which vector field, which scales, which symmetries? | [`system`] |
//! | how large are the states? | `sizes` |
//! | how often is the vector field evaluated? | `counted` |
//! | how is a run interrupted immediately? | `interrupt` |
//! | where do first solutions come from? | [`seeds`], those of maps `maps` |
//! | what is done first, by which thread? | `schedule` |
//! | where do cycles of large rotors come from? | `bounces` |
//! | how is one branch followed to both sides, or resumed? | [`growth`] |
//! | what follows from a finished branch? | [`family`] |
//! | how is a diagram found without prescribed starts? | `discovery`, `lookout`, `resonances`, `averaged` |
//! | how is the other branch found at a special point? | [`switch`] |
//! | is this branch known already? | [`known`] |
//! | how does a special point move when a second parameter changes? | [`curves`] |
//! | how is a family carried to other parameter values? | [`homotopy`] |
//! | which point of a branch has given values? | `near` |
//! | does a solution depend on a parameter that should not matter? | [`mod@persistence`] |
//! | which value of a parameter keeps a motion away? | `design` |
//! | what does simulation find? | [`responses`] |
//! | how does all this depend on other parameters? | [`cells`] |
//! | which attractor does an initial state lead to? | [`basins`], in planes [`section`], over a parameter [`along`], by `rounds` |
//! | which kick leads out of a basin? | [`kicks`] |

mod accounts;
pub mod along;
mod arcs;
mod arrival;
mod averaged;
mod axis;
pub mod basins;
mod bounces;
pub mod cells;
mod choice;
mod connections;
mod corner;
mod counted;
pub mod course;
mod crossings;
pub mod curves;
mod design;
mod diagnosis;
mod direct;
mod discovery;
mod equivariance;
pub mod family;
pub mod given;
pub mod growth;
mod holds;
pub mod homotopy;
mod impacts;
mod interrupt;
pub mod kicks;
pub mod known;
mod lookout;
mod maps;
mod minimal;
mod near;
pub mod persistence;
pub mod plan;
mod profile;
mod pursuit;
pub mod recognised;
pub mod replay;
mod repointed;
mod resonances;
mod responses;
mod rounds;
mod schedule;
pub mod section;
pub mod seeds;
mod shooting;
mod sizes;
pub mod switch;
mod symmetry;
pub mod system;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_identity;
pub mod together;
pub mod tori;
mod unforced;

pub use axis::axis_of;
pub(crate) use corner::SLIDING;
pub use given::mismatch;
pub use maps::iterates;
pub use persistence::{Persistence, persistence};
pub use plan::{
    AttractorKey, BranchPlan, CurvePlan, DesignPlan, Drawn, ExplorePlan, HomotopyPlan, MapPlan, Near, Over, Plan,
    Question, SeedPlan, SeedSource, Start, SurveyPlan, SweepPlan, Switching, Wanted,
};
pub use seeds::{attractors, first_solution, unsettled_motions};
pub use sizes::{scales_from, state_scales};
pub use system::System;

use crate::contract::Observer;
use crate::diagram::{Branch, Diagram, Point};
use interrupt::{Heeded, Interruptible};
use schedule::{Schedule, Task};
use seeds::Seeds;
use std::sync::Mutex;

/// Carries out a plan with `jobs` threads. `earlier` is the result of an interrupted run of the same plan: finished
/// sides are kept, unfinished ones are continued from their last point.
///
/// With an observer that [keeps the points](Observer::stores), branches are returned with their start, ends and special
/// points only, unless the plan switches at special points. Memory then does not grow with the number of points.
pub fn run(system: &System, plan: &Plan, jobs: usize, earlier: Diagram, observer: &dyn Observer) -> Diagram {
    run_from(system, plan, jobs, earlier, &[], observer)
}

/// Carries out a plan like [`run`], with known solutions for some of the seeds, by index; these are not searched for.
pub fn run_from(
    system: &System,
    plan: &Plan,
    jobs: usize,
    earlier: Diagram,
    given: &[(usize, Point)],
    observer: &dyn Observer,
) -> Diagram {
    let observer = &Heeded::new(observer);
    let field = Interruptible::new(system.field, observer);
    let system = &System { field: &field, ..system.clone() }.in_units_of(&earlier);
    let seeds = Seeds::new(system, plan, jobs, &earlier, given, observer);
    let families = family::roots(plan);
    let done: Vec<Mutex<Vec<Branch>>> = families.iter().map(|_| Mutex::new(Vec::new())).collect();
    let schedule = Schedule::new(plan, &families, &seeds);
    let work = || {
        while let Some(claim) = schedule.next() {
            match claim.task {
                Task::Census(number) => _ = seeds.census(number),
                Task::Family(index) => {
                    let branches = family::grow(system, plan, families[index], &seeds, jobs, &earlier, observer);
                    if observer.stopped() {
                        schedule.hurry();
                    }
                    if let Ok(mut slot) = done[index].lock() {
                        *slot = branches;
                    }
                }
            }
        }
    };
    // This thread takes part.
    std::thread::scope(|scope| {
        (1..jobs.min(families.len().max(seeds.count()))).for_each(|_| drop(scope.spawn(work)));
        work();
    });
    let mut branches: Vec<Branch> = done.into_iter().flat_map(|slot| slot.into_inner().unwrap_or_default()).collect();
    let responses = responses::simulate(system, plan, &seeds, jobs, &branches, &earlier, observer);
    let (legs, designs) = design::answers(system, plan, jobs, &branches, &earlier, observer);
    branches.extend(legs);
    Diagram { branches, responses, designs, cells: earlier.cells.clone(), shortfalls: observer.shortfalls() }
}
