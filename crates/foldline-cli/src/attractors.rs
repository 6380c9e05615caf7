//! `foldline attractors`: the attractors reached from sampled initial states.

use crate::arguments::Attractors as Typed;
use crate::failure::{Failure, Outcome};
use crate::progress::SignOfLife;
use crate::run::processors;
use crate::values::{parameters, with_one_forcing};
use foldline::attractors::{Attractor, Sampling, Sense, whirl_sense};
use foldline::contract::VectorField;
use foldline::diagram::{Response, Shown, Solution};
use foldline::explore::System;
use foldline::explore::{attractors, unsettled_motions};
use foldline::model::Model;
use foldline_store::finite::never_finite;
use foldline_store::model_file::read_model;
use std::io::{Write, stdout};

const TOLERANCE: f64 = 1e-6;

/// Prints the attractors of a model, each with its number of hits and its basin fraction.
pub fn print(typed: &Typed) -> Result<Outcome, Failure> {
    let (model, text) = read_model(&typed.model)?;
    with_one_forcing(&model)?;
    let parameters = parameters(&typed.set, &model)?;
    if let Some(found) = never_finite(&model, &parameters, &text, &typed.model.display().to_string()) {
        return Err(vec![found].into());
    }
    let working = SignOfLife::of("sampling");
    let census = attractors(
        &System::of(&model, &parameters),
        &parameters,
        typed.samples as usize,
        typed.seed,
        processors(),
        TOLERANCE,
    );
    let others = unsettled_motions(
        &System::of(&model, &parameters),
        &parameters,
        (typed.samples as usize, typed.seed),
        &census,
        TOLERANCE,
    );
    drop(working);

    let mut out = stdout().lock();
    let names = model.states.iter().map(|s| &s.name).chain(model.outputs.iter().map(|o| &o.name));
    let heads: String = names.map(|name| format!("  {:>24}", format!("{name} min … max"))).collect();
    writeln!(out, "{:<14} {:>6} {:>6} {:>20} {:>14}{heads}", "attractor", "ratio", "hits", "share", "period")?;
    for attractor in &census.attractors {
        writeln!(out, "{}", line(attractor, &model))?;
    }
    for other in &others {
        writeln!(out, "{}", line_of_unsettled(other, &model))?;
    }
    let samples = typed.samples;
    let mut stuck = if census.stuck > 0 {
        format!(", {} stopped because the step size became too small", census.stuck)
    } else {
        String::new()
    };
    if census.chattered > 0 {
        stuck += &format!(", {} ended in chatter", census.chattered);
    }
    let exits = match &census.exits[..] {
        [] => String::new(),
        exits => format!(", {} left the region where the vector field is defined", exits.len()),
    };
    writeln!(out, "{samples} samples: {} escaped{exits}{stuck}, {} not settled", census.escaped, census.unsettled)?;
    let examined: usize = others.iter().map(|other| other.hits).sum();
    if examined > 0 {
        writeln!(out, "{examined} of those not settled were followed further; the lines without a share show them")?;
    }
    for other in &others {
        told(&mut out, other)?;
    }
    let uniform = (0..samples as usize).filter(|number| Sampling::is_uniform(*number)).count();
    writeln!(
        out,
        "share: fraction of the {uniform} samples drawn uniformly from the ranges of the states, with its 95 % \
         confidence interval; the other {} samples are drawn towards the origin and count only as hits",
        samples as usize - uniform
    )?;
    Ok(Outcome::Done)
}

/// Prints the evidence for the type of a motion that did not settle.
fn told(out: &mut impl Write, other: &Response) -> std::io::Result<()> {
    let known = &other.recognition;
    let kind = other.motion.name();
    if let Some([rotation, error]) = known.rotation {
        writeln!(out, "{kind}: rotation number {rotation:.9} ± {error:.0e} per period")?;
    }
    if let Some([exponent, error]) = known.exponent {
        writeln!(out, "{kind}: largest exponent {exponent:.3e} ± {error:.0e}, over {} periods", known.returns)?;
    }
    match known.reason.is_empty() {
        true => Ok(()),
        false => writeln!(out, "{kind}: undecided, because {}", known.reason),
    }
}

fn line_of_unsettled(other: &Response, model: &Model) -> String {
    let period = other.period.map_or("·".to_string(), |period| format!("{:.9}", Shown(period)));
    let n = model.states.len() + model.outputs.len();
    let range = |r: &[f64; 2]| format!("  {:>24}", format!("{:.6} … {:.6}", Shown(r[0]), Shown(r[1])));
    let ranges: String = other.ranges.iter().take(n).map(range).collect();
    format!("{:<14} {:>6} {:>6} {:>20} {period:>14}{ranges}", other.motion.name(), "·", other.hits, "·")
}

fn line(attractor: &Attractor, model: &Model) -> String {
    let point = &attractor.point;
    let (kind, period) = match &point.solution {
        Solution::Equilibrium(_) => ("equilibrium", "·".to_string()),
        Solution::Torus(torus) => ("torus", format!("{:.9}", Shown(torus.period))),
        Solution::Cycle(cycle) => {
            // In an autonomous model the whirl plane may turn with the shaft.
            let sense = model.whirl.filter(|_| model.forced()).and_then(|whirl| whirl_sense(cycle, whirl));
            let kind = match (attractor.ratio, sense) {
                (None, Some(Sense::Forward)) => "forward whirl",
                (None, Some(Sense::Backward)) => "backward whirl",
                _ => "cycle",
            };
            (kind, format!("{:.9}", Shown(cycle.period)))
        }
    };
    let ratio = attractor.ratio.map_or("·".to_string(), |(a, b)| format!("{a}:{b}"));
    let range = |r: &[f64; 2]| match r[0] == r[1] {
        true => format!("{:.6}", Shown(r[0])),
        false => format!("{:.6} … {:.6}", Shown(r[0]), Shown(r[1])),
    };
    let ranges: String = point.ranges.iter().map(|r| format!("  {:>24}", range(r))).collect();
    let share = attractor.share.map_or("·".to_string(), |share| {
        let [low, high] = share.interval();
        format!("{:.3} [{low:.3}, {high:.3}]", share.value())
    });
    format!("{kind:<14} {ratio:>6} {:>6} {share:>20} {period:>14}{ranges}", attractor.hits)
}
