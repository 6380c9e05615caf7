//! Comparison with AUTO-07p of one Newton iteration on the same mesh.
//!
//! **Idea.** Both codes use the same discretisation, so on equal meshes they are equally accurate and differ only in
//! time. AUTO computes the same points (100 or fewer) with a loose and with a tight convergence criterion. The
//! additional time divided by the number of additional iterations is the cost of an iteration, without any other work
//! of AUTO.

use super::auto::Auto;
use super::auto_files::write_start;
use crate::own::{chain, cost};
use crate::report::{Table, digits, time};
use crate::workplace::Workplace;
use crate::{Outcome, clock, rotor as rotors};
use foldline::diagram::{Point, Solution};
use foldline::explore::System;

/// Constants of both runs: no detection of special points, no mesh or step adaptation, a new Jacobian in every
/// iteration.
const PLAIN: [(&str, &str); 6] =
    [("ILP", "0"), ("ISP", "0"), ("IAD", "0"), ("IADS", "0"), ("NWTN", "20"), ("ITNW", "20")];

/// Returns AUTO's time in seconds for one iteration, measured over `points` points.
fn of_auto(auto: &Auto, changes: &[(&str, &str)], points: usize) -> Outcome<f64> {
    let points = points.to_string();
    let run = |accuracy: &str, diagnostics: &str| {
        let own = [("EPSL", accuracy), ("EPSU", accuracy), ("IID", diagnostics), ("NMX", &points)];
        auto.run(&[&PLAIN[..], changes, &own[..]].concat())
    };
    let counts = [run("1e-3", "2")?.iterations, run("1e-11", "2")?.iterations];
    if counts[1] < counts[0] + counts[0] / 4 {
        return Err(format!("AUTO takes {} and {} iterations: no difference to measure", counts[0], counts[1]).into());
    }
    let times = [run("1e-3", "0")?.cpu, run("1e-11", "0")?.cpu];
    Ok((times[1] - times[0]) / (counts[1] - counts[0]) as f64)
}

fn write(auto: &Auto, point: &Point) -> Outcome<()> {
    match &point.solution {
        Solution::Cycle(cycle) => write_start(cycle, &auto.start()),
        Solution::Equilibrium(_) | Solution::Torus(_) => Err("the start is no cycle".into()),
    }
}

/// Runs the two codes alternately. Returns the median time in seconds of each, and the median of the ratios.
fn in_turn(
    repetitions: usize,
    mut ours: impl FnMut() -> Outcome<f64>,
    mut theirs: impl FnMut() -> Outcome<f64>,
) -> Outcome<[f64; 3]> {
    let (mut own, mut other, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..repetitions {
        let (a, b) = (ours()?, theirs()?);
        own.push(a);
        other.push(b);
        ratios.push(b / a);
    }
    Ok([clock::median(&own), clock::median(&other), clock::median(&ratios)])
}

/// Compares both codes on the cubic rotor: 4 states, 100 intervals, degree 4.
pub fn rotor(place: &Workplace) -> Outcome<String> {
    let study = rotors::study(place, rotors::SINGLE_LOOP)?;
    let system = System::of_plan(&study.model, &study.plan);
    let starts = rotors::beginnings(&study);
    let point = rotors::first(&starts.branches[0])?;
    let auto = Auto::new(place, "rotor", "auto-iteration")?;
    write(&auto, point)?;
    let [own, other, ratio] = in_turn(
        place.repetitions(),
        || Ok(cost::measured(&system, point, rotors::OMEGA, 100)?.0),
        || of_auto(&auto, &[("DS", "0.05")], 200),
    )?;
    Ok(format!(
        "{}\n\nCubic rotor at Ω = 5, 4 states, 100 intervals, degree 4: foldline {} (the best of five rounds in a row), AUTO {}. foldline \
         is {} times as fast (median of the ratios; target 5).\n",
        Auto::version(),
        time(own),
        time(other),
        digits(ratio)
    ))
}

/// Compares both codes on chains with 4 to 64 states: 100 intervals, degree 4.
pub fn chains(place: &Workplace) -> Outcome<String> {
    let auto = Auto::new(place, "chain", "auto-chain")?;
    let mut table = Table::new(&["states n", "foldline", "AUTO", "times as fast"]);
    for n in cost::STATES {
        let model = chain::model(n)?;
        let system = System::of(&model, &model.defaults());
        let point = chain::cycle(&model, &system)?;
        write(&auto, &point)?;
        let values: Vec<String> =
            chain::PARAMETERS.iter().enumerate().map(|(k, (_, value))| format!("{}: {value:?}", k + 1)).collect();
        let (states, values) = (n.to_string(), format!("{{{}}}", values.join(", ")));
        let changes = [("NDIM", &*states), ("PAR", &values), ("DS", "0.2"), ("DSMAX", "0.5")];
        // AUTO's cost grows as n³ too, so longer chains get fewer points.
        let points = (800 / n).clamp(8, 100);
        let [own, other, ratio] = in_turn(
            if n > 16 { 3 } else { place.repetitions() },
            || Ok(cost::measured(&system, &point, 0, 100)?.0),
            || of_auto(&auto, &changes, points),
        )?;
        table.row(&[states, time(own), time(other), digits(ratio)]);
    }
    Ok(format!("One Newton iteration on 100 intervals, degree 4, medians.\n\n{}", table.text()))
}
