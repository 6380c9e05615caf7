//! Integration of many trajectories at once compared with a plain loop over them.

use crate::Outcome;
use crate::clock;
use crate::report::{Table, digits, time};
use crate::workplace::Workplace;
use std::process::Command;

/// Number of trajectories, final time, tolerance.
const CASE: [&str; 3] = ["256", "100", "1e-6"];

/// Returns wall time in seconds (the best of five runs), number of steps and median error of four programs: the
/// ensemble with the model text, the ensemble with the field in Rust, the scalar loop, and the loop over lanes that is
/// the limit.
pub fn measured(place: &Workplace, case: [&str; 3]) -> Outcome<[[f64; 3]; 4]> {
    let program = place.root.join("target/release/examples/ensemble");
    let out = Command::new(&program).args(case).current_dir(&place.root).output();
    let out = out.map_err(|_| "there is no example `ensemble` of foldline-rotor")?;
    let text = String::from_utf8_lossy(&out.stdout);
    let line = |name: &str| -> Outcome<[f64; 3]> {
        let found = text.lines().find_map(|line| line.strip_prefix(name)).ok_or_else(|| format!("no line {name}"))?;
        let numbers: Vec<f64> = found.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        numbers.try_into().map_err(|_| format!("{name}{found}").into())
    };
    Ok([line("text ")?, line("rust ")?, line("scalar ")?, line("lanes ")?])
}

/// Repeats the comparison and reports medians.
pub fn alone(place: &Workplace) -> Outcome<String> {
    // Ratios of the plain loop to text, Rust and lanes.
    let mut ratios = [const { Vec::new() }; 3];
    let mut rows = [const { Vec::new() }; 4];
    for _ in 0..place.repetitions() {
        let all = measured(place, CASE)?;
        ratios.iter_mut().zip([0, 1, 3]).for_each(|(ratios, own)| ratios.push(all[2][0] / all[own][0]));
        rows.iter_mut().zip(all).for_each(|(row, one): (&mut Vec<[f64; 3]>, _)| row.push(one));
    }
    let mut table = Table::new(&["Dormand–Prince 5(4)", "best", "median", "steps", "per step", "median error"]);
    let names = [
        "ensemble, the model's text",
        "ensemble, the field in Rust",
        "plain scalar loop",
        "eight compiled lanes, steps of one length",
    ];
    for (name, row) in names.into_iter().zip(&rows) {
        let times: Vec<f64> = row.iter().map(|one| one[0]).collect();
        let [_, steps, error] = row[0];
        table.row(&[
            name.to_string(),
            time(clock::least(&times)),
            time(clock::median(&times)),
            steps.to_string(),
            time(clock::least(&times) / steps),
            if error.is_nan() { String::new() } else { format!("{error:.1e}") },
        ]);
    }
    let [text, rust, lanes] = ratios.map(|ratios| digits(clock::median(&ratios)));
    Ok(format!(
        "{} trajectories of the contact rotor over a time of {} at tolerance {}, one thread; every time is wall time and the best of five runs in a row, of which there \
         are best and median. The plain loop is compiled as everything here, for any x86-64.\n\n{}\nWith the field in Rust, as the plain \
         loop has it, the ensemble is {rust} times as fast as that loop (median of the ratios; target 4); with the model's text, which is \
         interpreted, {text} times. The lanes are {lanes} times as fast: no step control, no ends, nobody who watches.\n",
        CASE[0],
        CASE[1],
        CASE[2],
        table.text(),
    ))
}
