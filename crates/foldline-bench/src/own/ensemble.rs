//! Many trajectories at once against a plain loop over them.

use crate::Outcome;
use crate::clock;
use crate::report::{Table, digits, time};
use crate::workplace::Workplace;
use std::process::Command;

/// How many trajectories, for how long, at which tolerance.
const CASE: [&str; 3] = ["256", "100", "1e-6"];

/// Seconds and steps of the ensemble, then of the scalar loop.
pub fn measured(place: &Workplace, case: [&str; 3]) -> Outcome<[(f64, f64); 2]> {
    let program = place.root.join("target/release/examples/ensemble");
    let out = Command::new(&program).args(case).current_dir(&place.root).output();
    let out = out.map_err(|_| "there is no example `ensemble` of foldline-rotor")?;
    let text = String::from_utf8_lossy(&out.stdout);
    let line = |name: &str| -> Outcome<(f64, f64)> {
        let found = text.lines().find_map(|line| line.strip_prefix(name)).ok_or_else(|| format!("no line {name}"))?;
        let numbers: Vec<f64> = found.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let [seconds, steps, ..] = numbers[..] else { return Err(format!("{name}{found}").into()) };
        Ok((seconds, steps))
    };
    Ok([line("ensemble ")?, line("scalar ")?])
}

/// Repeats the comparison.
pub fn alone(place: &Workplace) -> Outcome<String> {
    let mut ratios = Vec::new();
    let mut rows: [Vec<(f64, f64)>; 2] = [Vec::new(), Vec::new()];
    for _ in 0..place.repetitions() {
        let both = measured(place, CASE)?;
        ratios.push(both[1].0 / both[0].0);
        rows.iter_mut().zip(both).for_each(|(row, one)| row.push(one));
    }
    let mut table = Table::new(&["Dormand–Prince 5(4)", "best", "median", "steps", "per step"]);
    for (name, row) in ["ensemble", "plain scalar loop"].into_iter().zip(&rows) {
        let times: Vec<f64> = row.iter().map(|one| one.0).collect();
        let steps = row[0].1;
        table.row(&[
            name.to_string(),
            time(clock::least(&times)),
            time(clock::median(&times)),
            steps.to_string(),
            time(clock::least(&times) / steps),
        ]);
    }
    Ok(format!(
        "{} trajectories of the contact rotor over a time of {} at tolerance {}, one thread.\n\n{}\nThe ensemble is {} times \
         as fast (median of the ratios).\n",
        CASE[0],
        CASE[1],
        CASE[2],
        table.text(),
        digits(clock::median(&ratios))
    ))
}
