//! Many trajectories of a model, for output: final states, on several threads.
//!
//! **Idea.** Starts are taken in groups by several threads, each an [`Ensemble`]. A trajectory depends neither on the
//! others nor on the number of threads.

use super::course::Way;
use crate::contract::{VectorField, Verdict};
use crate::model::Model;
use crate::simulation::{Arrival, Clocked, Ensemble, Tolerance};
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Number of trajectories that a thread takes at a time.
const GROUP: usize = 256;

/// Parameters and starts of the trajectories.
#[derive(Clone, Copy, Debug)]
pub struct Starts<'a> {
    /// `[count][n]` initial states.
    pub states: &'a [f64],
    /// `[k]` parameters of all, or `[count][k]`.
    pub parameters: &'a [f64],
    /// True if every trajectory has parameters of its own.
    pub own: bool,
}

/// Integrates every trajectory over the time span, in the time of the model. Returns the arrivals in the order of the
/// starts, with times in the unit of the model; those that were not integrated when `way.stop` ended the work are
/// missing at the end. `scales` `[n]` are the sizes of the states, relative to which the tolerance applies.
///
/// The model must not be a map.
pub fn together(model: &Model, starts: Starts, span: [f64; 2], scales: &[f64], way: &Way, jobs: usize) -> Vec<Arrival> {
    let (n, k) = (model.dim(), model.parameter_count());
    let count = starts.states.len() / n.max(1);
    let done: Mutex<Vec<(usize, Vec<Arrival>)>> = Mutex::new(Vec::new());
    let next = AtomicUsize::new(0);
    // The caller's function may not be called from several threads; that of the first thread asks for all.
    let stopped = std::sync::atomic::AtomicBool::new(false);
    let accuracy = Accuracy { tolerance: way.tolerance, steps: way.steps };
    let work = |ask: Option<&dyn Fn() -> bool>| loop {
        let first = next.fetch_add(GROUP, Ordering::Relaxed);
        if first >= count || stopped.load(Ordering::Relaxed) {
            return;
        }
        let last = (first + GROUP).min(count);
        let own = match starts.own {
            true => &starts.parameters[first * k..last * k],
            false => starts.parameters,
        };
        let group = Starts { states: &starts.states[first * n..last * n], parameters: own, own: starts.own };
        let arrivals = group_of(model, group, span, scales, accuracy, &mut || {
            if ask.is_some_and(|ask| ask()) {
                stopped.store(true, Ordering::Relaxed);
            }
            if stopped.load(Ordering::Relaxed) { Verdict::Stop } else { Verdict::Continue }
        });
        if !stopped.load(Ordering::Relaxed) {
            done.lock().unwrap_or_else(PoisonError::into_inner).push((first, arrivals));
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..jobs.min(count.div_ceil(GROUP)) {
            scope.spawn(|| work(None));
        }
        work(Some(way.stop));
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(first, _)| *first);
    // Up to the first group that is missing.
    let whole = done.iter().enumerate().take_while(|(group, (first, _))| group * GROUP == *first).count();
    done.truncate(whole);
    done.into_iter().flat_map(|(_, arrivals)| arrivals).collect()
}

/// Relative tolerance, and largest number of steps.
#[derive(Clone, Copy)]
struct Accuracy {
    tolerance: f64,
    steps: usize,
}

fn group_of(
    model: &Model,
    group: Starts,
    span: [f64; 2],
    scales: &[f64],
    way: Accuracy,
    stop: &mut dyn FnMut() -> Verdict,
) -> Vec<Arrival> {
    let (n, k) = (model.dim(), model.parameter_count());
    let clocked = Clocked(model);
    let forced = model.forced();
    let absolute = |scale: &f64| way.tolerance * scale;
    let absolute = scales.iter().chain(forced.then_some(&1.0)).map(absolute).collect();
    let tolerance = Tolerance { relative: way.tolerance, absolute };
    let field: &dyn VectorField = if forced { &clocked } else { model };
    // Time is counted in forcing periods, which may depend on parameters.
    let units: Vec<f64> = match group.own {
        true => (0..group.states.len() / n).map(|c| model.time_unit(&group.parameters[c * k..(c + 1) * k])).collect(),
        false => vec![model.time_unit(group.parameters)],
    };
    let same = units.iter().all(|unit| *unit == units[0]);
    let run = |states: &[f64], parameters: &[f64], own: bool, unit: f64, stop: &mut dyn FnMut() -> Verdict| {
        let span = span.map(|t| t / unit);
        let clock: &[f64] = if forced { &span[..1] } else { &[] };
        let starts: Vec<f64> = states.chunks_exact(n).flat_map(|x| [x, clock].concat()).collect();
        let ensemble = match own {
            true => Ensemble::with_own_parameters(field, parameters, tolerance.clone(), &starts, span),
            false => Ensemble::new(field, parameters, tolerance.clone(), &starts, span),
        };
        let mut arrivals = ensemble.with_step_limit(way.steps).run(&mut |_| stop());
        for arrival in &mut arrivals {
            arrival.time *= unit;
            arrival.state.truncate(n);
        }
        arrivals
    };
    match same {
        true => run(group.states, group.parameters, group.own, units[0], stop),
        false => {
            let each = group.states.chunks_exact(n).zip(group.parameters.chunks_exact(k)).zip(&units);
            each.flat_map(|((state, own), unit)| run(state, own, false, *unit, stop)).collect()
        }
    }
}
