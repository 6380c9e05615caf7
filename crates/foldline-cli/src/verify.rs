//! `foldline verify`: is a run right?

use crate::arguments::{Format, Verify as Typed};
use crate::failure::{Failure, Outcome};
use crate::table::{self, Cell, Column, Style, Table};
use foldline::explore::System;
use foldline::verify::{Check, Quantity, Verified, verify};
use foldline_store::run_file::Part;
use std::collections::BTreeMap;
use std::io::{Write, stdout};

/// Computes the run in a folder again and prints the worst comparisons, and a summary.
pub fn print(typed: &Typed) -> Result<Outcome, Failure> {
    let run = table::read(&typed.folder, Part::Everything)?;
    let kept = table::asked_for(&run.diagram, typed.branch.as_deref())?;
    let system = System::of_plan(&run.model, &run.plan);
    let verified = verify(&system, &run.diagram, run.plan.tolerance, typed.sample, &kept);
    let mut out = std::io::BufWriter::new(stdout().lock());
    let worst: Vec<&Check> = verified.checks.iter().filter(|check| check.found != 0.0).take(typed.worst).collect();
    if !worst.is_empty() {
        table::write(&listed(&worst), typed.format, &mut out)?;
    }
    out.flush()?;
    drop(out);
    let wrong = verified.wrong().count();
    if typed.format == Format::Text {
        summary(&verified, wrong, &mut stdout().lock())?;
    }
    Ok(if wrong > 0 { Outcome::Wrong } else { Outcome::Done })
}

fn listed(checks: &[&Check]) -> Table {
    let column = |name: &str, style| Column { name: name.to_string(), style };
    let columns = vec![
        column("branch", Style::Word),
        column("position", Style::Number),
        column("special", Style::Word),
        column("parameter", Style::Number),
        column("quantity", Style::Word),
        column("stated", Style::Size),
        column("found", Style::Size),
        column("ratio", Style::Size),
    ];
    let row = |check: &&Check| {
        vec![
            Cell::Word(check.branch.clone()),
            Cell::Count(check.position),
            check.special.map_or(Cell::Empty, |kind| Cell::Word(kind.name().to_string())),
            Cell::Number(check.parameter),
            Cell::Word(check.quantity.name().to_string()),
            Cell::Number(check.stated),
            Cell::Number(check.found),
            Cell::Number(check.ratio()),
        ]
    };
    Table { columns, rows: checks.iter().map(row).collect() }
}

fn summary(verified: &Verified, wrong: usize, out: &mut impl Write) -> std::io::Result<()> {
    writeln!(
        out,
        "{} points and {} special points computed again: {} comparisons, {wrong} worse than stated",
        verified.points,
        verified.special,
        verified.checks.len()
    )?;
    let mut each: BTreeMap<Quantity, Vec<f64>> = BTreeMap::new();
    for check in verified.checks.iter().filter(|check| check.quantity != Quantity::Record) {
        each.entry(check.quantity).or_default().push(check.ratio());
    }
    for (quantity, ratios) in each {
        let share = |holds: &dyn Fn(f64) -> bool| {
            100.0 * ratios.iter().filter(|ratio| holds(**ratio)).count() as f64 / ratios.len() as f64
        };
        writeln!(
            out,
            "{:10} {:5} comparisons: {:5.1} % within what is stated, {:5.1} % of them within a hundredth of it",
            quantity.name(),
            ratios.len(),
            share(&|ratio| ratio <= 1.0),
            share(&|ratio| ratio < 0.01),
        )?;
    }
    let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
    verified.undecided.iter().for_each(|undecided| *reasons.entry(undecided.why).or_default() += 1);
    for (why, count) in reasons {
        writeln!(out, "{count} not decided: {why}")?;
    }
    Ok(())
}
