//! Target: one branch at equal accuracy.
//!
//! **Idea.** Every point of either code is computed again, at the same Ω, at a tolerance of 1e-10; the differences of period
//! and largest radius are its errors. AUTO is given the mesh and the largest step with which it is fastest among those with
//! which the larger of its two errors is not larger than that of foldline at its own tolerance.

use super::auto::{Answer, Auto};
use super::auto_files::{cycles, write_start};
use crate::report::{Table, digits, time};
use crate::workplace::Workplace;
use crate::{Outcome, clock, rotor};
use foldline::diagram::{Point, Solution};
use foldline::explore::System;
use foldline::problem::extremes;
use foldline::problem::gauss::Scheme;

const INTERVALS: [&str; 9] = ["15", "20", "25", "30", "35", "40", "50", "70", "100"];
const STEPS: [&str; 5] = ["0.2", "1", "3", "10", "30"];
/// Index of the output r among states and outputs.
const RADIUS: usize = 4;

/// Largest relative error of the period and of the largest radius.
pub fn errors<'p>(system: &System, points: impl Iterator<Item = &'p Point>) -> Outcome<[f64; 2]> {
    let mut worst = [0.0f64; 2];
    for point in points {
        let exact = rotor::refined(system, point, 1e-10)?;
        let periods = [point, &exact].map(|p| p.solution.period().unwrap_or(f64::NAN));
        let radii = [point, &exact].map(|p| rotor::r_max(p, RADIUS));
        for (worst, [a, b]) in worst.iter_mut().zip([periods, radii]) {
            *worst = worst.max((a / b - 1.0).abs());
        }
    }
    Ok(worst)
}

/// A solution of AUTO as a point, as far as errors need it.
fn point(system: &System, like: &Point, omega: f64, solution: Solution) -> Point {
    let mut parameters = like.parameters.clone();
    parameters[rotor::OMEGA] = omega;
    let ranges = match &solution {
        Solution::Cycle(c) => {
            extremes::of_profile(system.field, &parameters, [&c.profile, &c.mesh], 0, &Scheme::new(c.degree))
        }
        Solution::Equilibrium(_) => Vec::new(),
    };
    Point { parameters, solution, ranges, ..like.clone() }
}

/// A way to run AUTO that is accurate enough.
struct Choice {
    intervals: &'static str,
    step: &'static str,
    cpu: f64,
    errors: [f64; 2],
    answer: Answer,
}

fn constants<'c>(intervals: &'c str, step: &'c str) -> Vec<(&'c str, &'c str)> {
    vec![("NTST", intervals), ("DSMAX", step), ("DS", "0.1"), ("UZSTOP", "{1: [4.99, 10.0]}")]
}

/// One way, with its errors; `None` where AUTO stops before the end or leaves the branch.
fn tried(
    auto: &Auto,
    system: &System,
    like: &Point,
    intervals: &'static str,
    step: &'static str,
) -> Outcome<Option<Choice>> {
    let own = constants(intervals, step);
    let answer = auto.run(&[&own[..], &[("NPR", "1"), ("IID", "2")]].concat())?;
    if answer.rows.last().is_none_or(|row| row.kind != -4 || (row.parameter - 10.0).abs() > 1e-4) {
        return Ok(None);
    }
    let found = cycles(&auto.solutions()?);
    if found.len() != answer.rows.len() {
        return Err(format!("{} of {} solutions of AUTO were read", found.len(), answer.rows.len()).into());
    }
    // The first point is the start as AUTO reads it, between whose values it draws straight lines; no Newton's method.
    let points: Vec<Point> = found.into_iter().skip(1).map(|(_, omega, s)| point(system, like, omega, s)).collect();
    let Ok(errors) = errors(system, points.iter()) else { return Ok(None) };
    let times: Vec<f64> = (0..3).map(|_| auto.run(&own).map(|a| a.cpu)).collect::<Outcome<_>>()?;
    Ok(Some(Choice { intervals, step, cpu: clock::median(&times), errors, answer }))
}

/// The fastest way with errors up to `allowed`.
fn fastest(auto: &Auto, system: &System, like: &Point, allowed: f64) -> Outcome<Choice> {
    let mut best: Option<Choice> = None;
    for intervals in INTERVALS {
        for step in STEPS {
            let Some(choice) = tried(auto, system, like, intervals, step)? else { continue };
            let accurate = choice.errors[0].max(choice.errors[1]) <= allowed;
            if accurate && best.as_ref().is_none_or(|best| choice.cpu < best.cpu) {
                best = Some(choice);
            }
        }
    }
    best.ok_or_else(|| format!("AUTO gets to Ω = 10 with errors below {allowed:.0e} in none of the ways tried").into())
}

/// What somebody would begin with who does not know how many intervals are needed.
fn usual(auto: &Auto, system: &System, like: &Point) -> Outcome<Choice> {
    tried(auto, system, like, "100", "0.2")?.ok_or("AUTO does not get to Ω = 10".into())
}

/// Both codes in turn.
pub fn compared(place: &Workplace) -> Outcome<String> {
    let study = rotor::study(place, rotor::SINGLE_LOOP)?;
    let system = System::of_plan(&study.model, &study.plan);
    let starts = rotor::beginnings(&study);
    let diagram = rotor::run(&study, &study.plan, starts.clone());
    let own = &diagram.branches[0];
    let own_errors = errors(&system, own.points.iter())?;
    let like = rotor::first(&starts.branches[0])?;
    let auto = Auto::new(place, "rotor", "auto-single-loop")?;
    let Solution::Cycle(cycle) = &like.solution else { return Err("no cycle".into()) };
    write_start(cycle, &auto.start())?;
    let choice = fastest(&auto, &system, like, own_errors[0].max(own_errors[1]))?;
    let usual = usual(&auto, &system, like)?;
    let changes = constants(choice.intervals, choice.step);
    let (mut ours, mut theirs, mut idle, mut ratios) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    // Many, since each is short beside the time for which something else slows the machine down.
    for _ in 0..12 * place.repetitions() {
        // Of AUTO's time what it takes to start is taken off below; the first run after a pause is the same here.
        rotor::run(&study, &study.plan, starts.clone());
        ours.push(clock::timed(|| rotor::run(&study, &study.plan, starts.clone())).0);
        theirs.push(auto.run(&changes)?.cpu);
        idle.push(auto.run(&[&changes[..], &[("NMX", "1")]].concat())?.cpu);
        let last = ours.len() - 1;
        ratios.push((theirs[last] - idle[last]) / ours[last]);
    }
    let mut table =
        Table::new(&["", "points", "Newton iterations", "error of T", "error of r_max", "processor time, median"]);
    let row = |name: String, points: usize, newton: usize, errors: [f64; 2], seconds: f64| {
        [
            name,
            points.to_string(),
            newton.to_string(),
            format!("{:.1e}", errors[0]),
            format!("{:.1e}", errors[1]),
            time(seconds),
        ]
    };
    let name = format!("foldline, tolerance {:.0e}", study.plan.tolerance);
    table.row(&row(name, own.points.len(), own.cost().newton, own_errors, clock::median(&ours)));
    for (choice, seconds) in [(&choice, clock::median(&theirs)), (&usual, usual.cpu)] {
        let name = format!("AUTO, NTST {}, NCOL 4, DSMAX {}", choice.intervals, choice.step);
        table.row(&row(name, choice.answer.rows.len(), choice.answer.iterations, choice.errors, seconds));
    }
    Ok(format!(
        "Errors are the largest of all points, relative. Of AUTO's time {} is for starting and a first point; without that \
         foldline is {} times as fast (median of the ratios; target 10). AUTO's settings are the fastest of {} at which its \
         larger error is not larger.\n\n{}",
        time(clock::median(&idle)),
        digits(clock::median(&ratios)),
        INTERVALS.len() * STEPS.len(),
        table.text()
    ))
}
