//! Answers to the questions that maps over parameters ask.

use super::super::System;
use super::super::basins::basins;
use super::super::plan::{Drawn, SeedPlan};
use super::super::seeds::{attractors, first_solution};
use crate::attractors::{Fate, spectral_ratio};
use crate::diagram::{CellAnswer, CellValue, CellValues, Diagram, Point, Share, Solution};
use crate::model::Model;

fn number(name: &str, value: f64) -> (String, CellValue) {
    (name.to_string(), CellValue::Number(value))
}

fn count(name: &str, value: usize) -> (String, CellValue) {
    (name.to_string(), CellValue::Count(value as i64))
}

fn text(name: &str, value: impl Into<String>) -> (String, CellValue) {
    (name.to_string(), CellValue::Text(value.into()))
}

/// Kind of a motion in words: `equilibrium`, `cycle`, `2:1 cycle`, `period-3 cycle`.
pub fn kind_of(solution: &Solution, ratio: Option<(u32, u32)>) -> String {
    let family = match solution {
        Solution::Equilibrium(_) => "equilibrium",
        Solution::Cycle(_) => "cycle",
        Solution::Torus(_) => "torus",
    };
    match (ratio, solution.forcing_periods()) {
        (Some((a, b)), _) => format!("{a}:{b} {family}"),
        (None, periods) if periods > 1 => format!("period-{periods} {family}"),
        (None, _) => family.to_string(),
    }
}

/// Number of motions or points of a kind in words: `2 equilibria`.
fn counted(number: usize, kind: &str) -> String {
    match (number, kind.strip_suffix("um"), kind.strip_suffix("us")) {
        (1, ..) => kind.to_string(),
        (_, Some(stem), _) => format!("{number} {stem}a"),
        (_, _, Some(stem)) => format!("{number} {stem}i"),
        (..) => format!("{number} {kind}s"),
    }
}

/// Sorted kinds with their numbers, in words.
fn listed(kinds: &[(String, usize)], between: &str) -> String {
    let mut kinds: Vec<&(String, usize)> = kinds.iter().collect();
    kinds.sort();
    let words: Vec<String> = kinds.into_iter().map(|(kind, number)| counted(*number, kind)).collect();
    if words.is_empty() { "none".to_string() } else { words.join(between) }
}

/// Adds one to the number of a kind.
fn add(kinds: &mut Vec<(String, usize)>, kind: &str) {
    match kinds.iter_mut().find(|(known, _)| known == kind) {
        Some((_, number)) => *number += 1,
        None => kinds.push((kind.to_string(), 1)),
    }
}

/// Largest values of the outputs, or of the states if there are no outputs.
fn maxima(point: &Point, model: &Model) -> CellValues {
    let states = model.states.iter().map(|own| &own.name);
    let outputs = model.outputs.iter().map(|own| &own.name);
    let all: Vec<&String> = states.chain(outputs).collect();
    let from = if model.outputs.is_empty() { 0 } else { model.states.len() };
    let largest = |k: usize| point.ranges.get(k).map_or(f64::NAN, |range| range[1]);
    (from..all.len()).map(|k| number(&format!("{}_max", all[k]), largest(k))).collect()
}

fn period(point: &Point) -> f64 {
    point.solution.period().unwrap_or(f64::NAN)
}

/// Attractors that sampled initial states reach, by kind.
pub fn motions(
    system: &System,
    model: &Model,
    parameters: &[f64],
    drawn: Drawn,
    tolerance: f64,
    jobs: usize,
) -> CellAnswer {
    let census = attractors(system, parameters, drawn.samples, drawn.random, jobs, tolerance);
    let mut kinds: Vec<(String, usize)> = Vec::new();
    let mut items: Vec<(String, CellValues)> = Vec::new();
    for own in &census.attractors {
        let kind = kind_of(&own.point.solution, own.ratio);
        add(&mut kinds, &kind);
        // The first attractor of a kind is the one that most initial states reached.
        if !items.iter().any(|(known, _)| *known == kind) {
            let values = [vec![number("period", period(&own.point))], maxima(&own.point, model)].concat();
            items.push((kind, values));
        }
    }
    for ((_, values), (_, total)) in items.iter_mut().zip(&kinds) {
        values.insert(0, count("number", *total));
    }
    let lost = census.unsettled + census.stuck;
    let values = vec![
        text("motions", listed(&kinds, " + ")),
        count("unsettled", lost),
        count("escaped", census.escaped + census.exits.len()),
    ];
    let remark = match lost {
        0 => String::new(),
        _ => format!("{lost} of {} initial states did not settle", drawn.samples),
    };
    CellAnswer { values, items, remark, absent: vec![count("number", 0)] }
}

fn share_values(share: Share, number_of: usize) -> CellValues {
    let [low, high] = share.interval();
    vec![
        number("share", share.value()),
        number("share_low", low),
        number("share_high", high),
        count("number", number_of),
    ]
}

/// Basin fractions of all attractors of a kind together.
pub fn shares(system: &System, parameters: &[f64], drawn: Drawn, tolerance: f64, jobs: usize) -> CellAnswer {
    let found = basins(system, parameters, None, (drawn.samples, drawn.random), jobs, tolerance);
    let of = found.box_fates.len();
    let reached = |k: usize| found.box_fates.iter().filter(|fate| **fate == Fate::Settled(k)).count();
    let mut all: Vec<(String, usize, usize)> = Vec::new();
    for (k, own) in found.attractors.iter().enumerate() {
        let (kind, hits) = (kind_of(&own.point.solution, own.ratio), reached(k));
        match all.iter_mut().find(|(known, ..)| *known == kind) {
            _ if hits == 0 => {}
            Some((_, sum, number)) => (*sum, *number) = (*sum + hits, *number + 1),
            None => all.push((kind, hits, 1)),
        }
    }
    all.sort();
    let lost = |fate: &&Fate| matches!(fate, Fate::Unsettled | Fate::Stuck | Fate::Chatter | Fate::Left);
    let gone = |fate: &&Fate| matches!(fate, Fate::Escaped | Fate::Undefined);
    let unsettled = Share { hits: found.box_fates.iter().filter(lost).count(), of };
    let escaped = Share { hits: found.box_fates.iter().filter(gone).count(), of };
    let kinds: Vec<(String, usize)> = all.iter().map(|(kind, _, number)| (kind.clone(), *number)).collect();
    let values = vec![
        text("motions", listed(&kinds, " + ")),
        number("unsettled", unsettled.value()),
        number("escaped", escaped.value()),
    ];
    let items = all.into_iter().map(|(kind, hits, number)| (kind, share_values(Share { hits, of }, number))).collect();
    let remark = match unsettled.hits {
        0 => String::new(),
        _ => format!("{} % of the initial states did not settle", three_digits(100.0 * unsettled.value())),
    };
    CellAnswer { values, items, remark, absent: share_values(Share { hits: 0, of }, 0) }
}

/// A number from 1e-4 to 100 with three significant digits, without zeros at its end.
fn three_digits(value: f64) -> String {
    let before = value.log10().floor().max(-4.0) as i32;
    let decimals = usize::try_from(2 - before).unwrap_or(0);
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

/// A quantity of a settled motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// Period of a cycle.
    Period,
    /// Smallest value of a state or output, by index.
    Smallest(usize),
    /// Largest value of a state or output, by index.
    Largest(usize),
}

impl Reading {
    /// All names with their quantities.
    pub fn all(model: &Model) -> Vec<(String, Reading)> {
        let states = model.states.iter().map(|own| &own.name);
        let channels = states.chain(model.outputs.iter().map(|own| &own.name)).enumerate();
        let both = |(k, name): (usize, &String)| {
            [(format!("{name}_max"), Reading::Largest(k)), (format!("{name}_min"), Reading::Smallest(k))]
        };
        channels.flat_map(both).chain([("period".to_string(), Reading::Period)]).collect()
    }
}

/// Quantities of the motion that settles from a start.
///
/// # Errors
/// The reason why there is none.
pub fn settled(
    system: &System,
    readings: &[(String, Reading)],
    start: &SeedPlan,
    tolerance: f64,
    jobs: usize,
) -> Result<CellAnswer, String> {
    let point = first_solution(system, start, tolerance, jobs)?;
    Ok(settled_at(system, readings, &point))
}

/// Quantities of a settled motion.
pub fn settled_at(system: &System, readings: &[(String, Reading)], point: &Point) -> CellAnswer {
    let range = |k: usize, side: usize| point.ranges.get(k).map_or(f64::NAN, |range| range[side]);
    let read = |reading: &Reading| match reading {
        Reading::Period => period(point),
        Reading::Smallest(k) => range(*k, 0),
        Reading::Largest(k) => range(*k, 1),
    };
    let mut values: CellValues = readings.iter().map(|(name, reading)| number(name, read(reading))).collect();
    let ratio = match &point.solution {
        Solution::Cycle(cycle) => system.whirl.and_then(|whirl| spectral_ratio(cycle, whirl)),
        Solution::Equilibrium(_) | Solution::Torus(_) => None,
    };
    values.push(text("settled_motion", kind_of(&point.solution, ratio)));
    CellAnswer { values, ..CellAnswer::default() }
}

/// Special points of a diagram whose branches are in the order in which they are shown. `short` says what fell short,
/// `notes` what was remarked.
///
/// # Errors
/// Reason why there are no branches.
pub fn points(diagram: &Diagram, model: &Model, short: &[String], notes: &[String]) -> Result<CellAnswer, String> {
    let joined = |all: &mut dyn Iterator<Item = &String>| {
        let mut told: Vec<&str> = Vec::new();
        all.for_each(|line| told.extend((!told.contains(&line.as_str())).then_some(line.as_str())));
        told.join("; ")
    };
    if diagram.branches.iter().all(|branch| branch.points.is_empty()) {
        let told = joined(&mut short.iter().chain(notes));
        return Err(if told.is_empty() { "the study has no branches".to_string() } else { told });
    }
    let mut kinds: Vec<(String, usize)> = Vec::new();
    let mut items: Vec<(String, CellValues)> = Vec::new();
    for branch in &diagram.branches {
        let free = model.parameters.get(branch.free).map_or("", |own| own.name.as_str());
        let mut numbers: Vec<(String, usize)> = Vec::new();
        for special in &branch.special {
            let kind = special.kind.name();
            add(&mut kinds, kind);
            add(&mut numbers, kind);
            let own = numbers.iter().find(|(known, _)| known == kind).map_or(0, |(_, number)| *number);
            let value = special.point.parameters.get(branch.free).copied().unwrap_or(f64::NAN);
            // The error of a special point is relative to the scale of the parameter.
            let error = special.error * (branch.units[1] + value.abs());
            let mut values = vec![
                number("value", value),
                number("error", error),
                number("period", period(&special.point)),
                count("unstable_before", special.unstable_before),
                count("unstable_after", special.unstable_after),
            ];
            values.extend(maxima(&special.point, model));
            values.extend([text("branch", branch.name.clone()), text("kind", kind), text("free", free)]);
            items.push((format!("{}: {kind} {own}", branch.name), values));
        }
    }
    let values = vec![text("points", listed(&kinds, ", "))];
    Ok(CellAnswer { values, items, remark: joined(&mut short.iter()), absent: Vec::new() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_kinds_are_words() {
        let kinds = [("torus".to_string(), 2), ("equilibrium".to_string(), 2), ("2:1 cycle".to_string(), 1)];
        assert_eq!(listed(&kinds, " + "), "2:1 cycle + 2 equilibria + 2 tori");
        assert_eq!(listed(&[], ", "), "none");
    }

    #[test]
    fn three_digits_are_enough() {
        for (value, expected) in [(100.0, "100"), (12.5, "12.5"), (1.5625, "1.56"), (0.01, "0.01"), (3.0, "3")] {
            assert_eq!(three_digits(value), expected);
        }
    }
}
