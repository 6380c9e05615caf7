//! Maps over parameters: the same question at many parameter values.
//!
//! **Idea.** A cell is a point in the space of some parameters. In each, one of four questions is asked ([`answers`]);
//! the cells are those of a grid, of a list, or of a grid that is refined where the answer changes ([`layout`]). Each cell
//! is computed on one thread, and threads take the next cell when theirs is done, so that the answers do not depend on
//! their number.
//!
//! **Departures.** The work of a cell is limited by the number of evaluations of f and its derivatives, not by time, so
//! that the same cells fail on every machine.

pub mod answers;
mod layout;

pub use layout::{LARGEST, ParameterMap, ShownCell, assembled};

use super::System;
use super::counted::Counted;
use super::interrupt::Interruptible;
use super::plan::{MapPlan, Plan, Question};
use crate::contract::{Event, Observer, Verdict};
use crate::diagram::{CellAnswer, Diagram, MapCell};
use crate::model::Model;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Default limit on the evaluations of f and its derivatives in a cell: a quarter of an hour of a processor for the
/// contact rotor, whose basin fractions take 2.2·10⁷ evaluations a second.
pub const MOST: usize = 20_000_000_000;

/// Function that returns a diagram in the order in which it is shown, and messages on shortfalls.
pub type Finished<'a> = dyn Fn(Diagram, &Plan) -> (Diagram, Vec<String>) + Sync + 'a;

/// Model, plan, and how a diagram is completed.
pub struct Asked<'a> {
    /// The model.
    pub model: &'a Model,
    /// Plan of the study, whose branches the question about special points follows.
    pub plan: &'a Plan,
    /// Returns a diagram in the order in which it is shown, and what fell short in it.
    pub finished: &'a Finished<'a>,
}

/// Computes the missing cells of all maps of a plan with `jobs` threads. Returns all cells, those in `known` first.
pub fn carry_out(asked: &Asked, jobs: usize, known: &[MapCell], observer: &dyn Observer) -> Vec<MapCell> {
    let mut all = known.to_vec();
    for map in &asked.plan.maps {
        let own: Vec<MapCell> = known.iter().filter(|cell| cell.map == map.name).cloned().collect();
        let mut done = own.len();
        layout::visit(map, &own, &mut |cells| {
            let total = done + cells.len();
            let found = several(asked, map, cells, [done, total], jobs, observer);
            done += found.len();
            all.extend(found.iter().cloned());
            found
        });
        if observer.stopping() {
            break;
        }
    }
    all
}

/// Computes cells in parallel. If the observer stops, those that were completed before are returned.
fn several(
    asked: &Asked,
    map: &MapPlan,
    cells: Vec<Vec<f64>>,
    [done, total]: [usize; 2],
    jobs: usize,
    observer: &dyn Observer,
) -> Vec<MapCell> {
    let (next, done, ended) = (AtomicUsize::new(0), AtomicUsize::new(done), AtomicUsize::new(0));
    let slots: Vec<Mutex<Option<MapCell>>> = cells.iter().map(|_| Mutex::new(None)).collect();
    let work = || {
        while ended.load(Ordering::Relaxed) == 0 {
            let k = next.fetch_add(1, Ordering::Relaxed);
            let Some((at, slot)) = cells.get(k).zip(slots.get(k)) else { return };
            let answer = answer(asked, map, at, observer);
            // Numbers computed while the run is being interrupted are wrong.
            if observer.stopping() {
                return;
            }
            let cell = MapCell { map: map.name.clone(), at: at.clone(), answer };
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            if observer.observe(Event::Mapped(&cell, count, total)) == Verdict::Stop {
                ended.store(1, Ordering::Relaxed);
            }
            *slot.lock().unwrap_or_else(PoisonError::into_inner) = Some(cell);
        }
    };
    std::thread::scope(|scope| {
        (1..jobs.min(cells.len())).for_each(|_| drop(scope.spawn(work)));
        work();
    });
    slots.into_iter().filter_map(|slot| slot.into_inner().unwrap_or_else(PoisonError::into_inner)).collect()
}

/// Answer in a cell.
fn answer(asked: &Asked, map: &MapPlan, at: &[f64], observer: &dyn Observer) -> Result<CellAnswer, String> {
    let parameters = with(map, &map.base, at);
    let counted = Counted::new(asked.model);
    let limit = Limited { observer, counted: &counted, most: map.most, notes: Mutex::default() };
    let field = Interruptible::new(&counted, &limit);
    let tolerance = asked.plan.tolerance;
    let here = || System { field: &field, limits: asked.plan.limits, ..System::of(asked.model, &parameters) };
    let found = match &map.question {
        Question::Points => {
            let plan = placed(map, asked.plan, at);
            let system = System { field: &field, ..System::of_plan(asked.model, &plan) };
            // Simulations and design questions have no special points of their own.
            let plan = Plan { surveys: Vec::new(), sweeps: Vec::new(), designs: Vec::new(), ..plan };
            let diagram = super::run(&system, &plan, 1, Diagram::default(), &limit);
            let (diagram, short) = (asked.finished)(diagram, &plan);
            let notes = limit.notes.lock().unwrap_or_else(PoisonError::into_inner).clone();
            answers::points(&diagram, asked.model, &short, &notes)
        }
        Question::Motions(drawn) => Ok(answers::motions(&here(), asked.model, &parameters, *drawn, tolerance, 1)),
        Question::Shares(drawn) => Ok(answers::shares(&here(), &parameters, *drawn, tolerance, 1)),
        Question::Settled(readings, start) => {
            let start = super::SeedPlan { parameters: parameters.clone(), ..start.clone() };
            answers::settled(&here(), readings, &start, tolerance, 1)
        }
    };
    match limit.exhausted() {
        true => Err(format!(
            "the cell did not end within {} evaluations of the equations; `max-evaluations` is the limit",
            map.most
        )),
        false => found,
    }
}

/// Parameter values with those of a cell.
fn with(map: &MapPlan, parameters: &[f64], at: &[f64]) -> Vec<f64> {
    let mut own = parameters.to_vec();
    map.indices.iter().zip(at).for_each(|(index, value)| own[*index] = *value);
    own
}

/// Plan with the parameter values of a cell, wherever it states them, and without maps.
fn placed(map: &MapPlan, plan: &Plan, at: &[f64]) -> Plan {
    let mut own = Plan { maps: Vec::new(), ..plan.clone() };
    let seeds = own.seeds.iter_mut().map(|seed| &mut seed.parameters);
    let explorations = own.explorations.iter_mut().map(|exploration| &mut exploration.parameters);
    let surveys = own.surveys.iter_mut().map(|survey| &mut survey.parameters);
    seeds.chain(explorations).chain(surveys).for_each(|parameters| *parameters = with(map, parameters, at));
    own
}

/// Observer of a cell: stops with the whole run, or once the cell has used up its evaluations.
struct Limited<'o> {
    observer: &'o dyn Observer,
    counted: &'o Counted<'o>,
    most: usize,
    notes: Mutex<Vec<String>>,
}

impl Limited<'_> {
    fn exhausted(&self) -> bool {
        self.counted.total() > self.most
    }
}

impl Observer for Limited<'_> {
    fn observe(&self, event: Event) -> Verdict {
        if let Event::Note(_, note) | Event::Short(_, note) = event {
            self.notes.lock().unwrap_or_else(PoisonError::into_inner).push(note.to_string());
        }
        if self.stopping() { Verdict::Stop } else { Verdict::Continue }
    }

    fn stopping(&self) -> bool {
        self.exhausted() || self.observer.stopping()
    }
}
