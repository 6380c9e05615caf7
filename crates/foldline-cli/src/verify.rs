//! `foldline verify`: recomputes a run by an independent method.

use crate::arguments::{Format, Verify as Typed};
use crate::failure::{Failure, Outcome};
use crate::progress::SignOfLife;
use crate::table::{self, Cell, Column, Style, Table};
use foldline::explore::System;
use foldline::verify::{Check, Quantity, Verified, verify};
use foldline_store::run_file::Part;
use std::collections::BTreeMap;
use std::io::{Write, stdout};

/// Verifies the run in a folder, and prints the worst comparisons and a summary.
pub fn print(typed: &Typed) -> Result<Outcome, Failure> {
    let run = table::read(&typed.folder, Part::Everything)?;
    let kept = table::asked_for(&run.diagram, typed.branch.as_deref())?;
    let system = System::of_plan(&run.model, &run.plan);
    let working = SignOfLife::of("verifying");
    let verified = verify(&system, &run.diagram, run.plan.tolerance, typed.sample, &kept);
    drop(working);
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
    let nothing = verified.checks.is_empty() && !verified.undecided.is_empty();
    if nothing {
        let _ = writeln!(std::io::stderr(), "error: nothing could be verified: every check is undecided");
    }
    Ok(match (wrong, nothing) {
        (1.., _) => Outcome::Wrong,
        (0, true) => Outcome::Short,
        (0, false) => Outcome::Done,
    })
}

fn listed(checks: &[&Check]) -> Table {
    let column = Column::new;
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
            check.stated.map_or(Cell::Empty, Cell::Number),
            Cell::Number(check.found),
            check.ratio().map_or(Cell::Empty, Cell::Number),
        ]
    };
    Table { columns, rows: checks.iter().map(row).collect() }
}

/// A number with its noun.
fn counted(count: usize, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

fn summary(verified: &Verified, wrong: usize, out: &mut impl Write) -> std::io::Result<()> {
    writeln!(
        out,
        "{} and {} recomputed: {} comparisons, {wrong} outside the stated error",
        counted(verified.points, "point"),
        counted(verified.special, "special point"),
        verified.checks.len()
    )?;
    if verified.removed > 0 {
        writeln!(
            out,
            "{} points not recomputed: their profiles were not stored (`store` in the study)",
            verified.removed
        )?;
    }
    let of = |quantity: Quantity| verified.checks.iter().filter(move |check| check.quantity == quantity);
    for quantity in Quantity::ALL {
        let ratios: Vec<f64> = of(quantity).filter_map(Check::ratio).collect();
        if !ratios.is_empty() {
            let within = ratios.iter().filter(|ratio| **ratio <= 1.0).count();
            let share = 100.0 * within as f64 / ratios.len() as f64;
            writeln!(out, "{:11} {:6} compared, {share:5.1} % within the stated error", quantity.name(), ratios.len())?;
        }
        let mut free: Vec<f64> = of(quantity).filter(|check| check.stated.is_none()).map(|check| check.found).collect();
        free.sort_by(f64::total_cmp);
        if let (Some(half), Some(most)) = (free.get(free.len() / 2), free.last()) {
            let name = quantity.name();
            let count = free.len();
            writeln!(
                out,
                "{name:11} {count:6} compared, no stated error; median difference {half:.1e}, largest {most:.1e}"
            )?;
        }
    }
    let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
    verified.undecided.iter().for_each(|undecided| *reasons.entry(undecided.why).or_default() += 1);
    for (why, count) in reasons {
        writeln!(out, "{count} undecided: {why}")?;
    }
    Ok(())
}
