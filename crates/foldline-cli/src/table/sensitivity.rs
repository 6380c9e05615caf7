//! Tables of sensitivities and uncertainties, computed from the special points of a run.

use super::{Cell, Column, Run, Style, Table, asked_for, read, write};
use crate::arguments::{Table as Typed, What};
use crate::failure::{Failure, Outcome};
use crate::progress::SignOfLife;
use foldline::diagram::Branch;
use foldline::explore::System;
use foldline::model::Model;
use foldline::sensitivity::listed::{Entry, Listed, at_position, entries, sensitivities, uncertainties};
use foldline::sensitivity::{Measured, Sensitivities, Uncertainty};
use foldline_store::nearest::suggest;
use foldline_store::run_file::Part;
use std::io::{Write, stderr, stdout};

/// Returns the sensitivities of the special points of a run.
pub fn found(run: &Run, kept: &dyn Fn(&Branch) -> bool) -> Vec<Listed<Sensitivities>> {
    let working = SignOfLife::of("computing sensitivities");
    let found = sensitivities(&System::of_plan(&run.model, &run.plan), &run.diagram, &run.plan, kept);
    drop(working);
    found
}

/// Prints the table.
pub fn print(typed: &Typed) -> Result<Outcome, Failure> {
    if !typed.unit.is_empty() {
        let message = "--unit does not apply to derivatives, which are in the units of the model";
        return Err(Failure::typed(message, "leave it out"));
    }
    let run = read(&typed.folder, Part::Everything)?;
    let kept = asked_for(&run.diagram, typed.branch.as_deref())?;
    check_names(&run.model, &typed.of)?;
    let wanted = |of: Measured, name: &str| {
        (of.is_main() || typed.position.is_some()) && (typed.of.is_empty() || typed.of.iter().any(|own| own == name))
            || typed.of.iter().any(|own| own == name || own == "all")
    };
    if let Some(position) = typed.position {
        return at_one(typed, &run, position, &wanted);
    }
    let (table, failed) = if typed.what() == What::Sensitivities {
        let found = found(&run, &kept);
        (sensitivity(&entries(&found, &run.model, &wanted)), failures(&found))
    } else {
        if run.spreads.is_empty() {
            let cure = "state one in the study or the model, such as `zeta = { value = 0.01, sigma = 0.002 }` in \
                        `[parameters]`, and run the study again";
            return Err(Failure::typed("--uncertainty: no parameter of the run is uncertain", cure));
        }
        let working = SignOfLife::of("sampling");
        let system = System::of_plan(&run.model, &run.plan);
        let samples = typed.samples as usize;
        let found = uncertainties(&system, &run.diagram, &run.plan, &run.spreads, samples, &kept);
        drop(working);
        (uncertainty(&found, &run.model, &wanted), failures(&found))
    };
    let mut out = std::io::BufWriter::new(stdout().lock());
    write(&table, typed.format, &mut out)?;
    out.flush()?;
    failed.iter().try_for_each(|line| writeln!(stderr().lock(), "incomplete: {line}"))?;
    Ok(if failed.is_empty() { Outcome::Done } else { Outcome::Short })
}

/// Prints the derivatives at one solution.
fn at_one(
    typed: &Typed,
    run: &Run,
    position: i64,
    wanted: &dyn Fn(Measured, &str) -> bool,
) -> Result<Outcome, Failure> {
    let branch = run.diagram.branches.iter().find(|own| Some(&own.name) == typed.branch.as_ref());
    let Some(branch) = branch.filter(|_| typed.what() == What::Sensitivities) else {
        let cure = "write --sensitivities --branch NAME --position N";
        return Err(Failure::typed("--position: a point is given by its branch and its position", cure));
    };
    let system = System::of_plan(&run.model, &run.plan);
    let found = at_position(&system, &run.diagram, &run.plan, (branch, position), &run.model, wanted);
    let found = found.map_err(|why| {
        let cure = format!("`foldline table DIR --points --branch {}` lists the points", branch.name);
        Failure::typed(format!("--position {position}: {why}"), cure)
    })?;
    let mut out = std::io::BufWriter::new(stdout().lock());
    write(&sensitivity(&found), typed.format, &mut out)?;
    out.flush()?;
    Ok(Outcome::Done)
}

/// Checks the names given with `--of`.
fn check_names(model: &Model, names: &[String]) -> Result<(), Failure> {
    let channels = model.states.iter().map(|own| &own.name).chain(model.outputs.iter().map(|own| &own.name));
    let ends = channels.flat_map(|name| ["min", "max"].map(|end| format!("{name}_{end}")));
    let fixed = ["all", "period", "angle"].map(String::from);
    let known: Vec<String> = model.parameters.iter().map(|own| own.name.clone()).chain(fixed).chain(ends).collect();
    match names.iter().find(|name| !known.contains(name)) {
        Some(name) => {
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            Err(Failure::typed(format!("--of: there is no number \"{name}\""), suggest(name, &known)))
        }
        None => Ok(()),
    }
}

/// The special points that should have a result and have none.
fn failures<T>(all: &[Listed<T>]) -> Vec<String> {
    let failed = all.iter().filter(|own| !own.expected);
    let line = |own: &Listed<T>| {
        let why = own.found.as_ref().err()?;
        Some(format!("{} of {} at {:.6}: {why}", own.kind.title(), own.branch, own.at))
    };
    failed.filter_map(line).collect()
}

fn sensitivity(entries: &[Entry]) -> Table {
    let column = Column::new;
    let columns = vec![
        column("branch", Style::Word),
        column("kind", Style::Word),
        column("at", Style::Number),
        column("quantity", Style::Word),
        column("value", Style::Exact),
        column("parameter", Style::Word),
        column("derivative", Style::Number),
        column("error", Style::Size),
        column("unit", Style::Word),
        column("elasticity", Style::Share),
        column("remark", Style::Word),
    ];
    let row = |entry: &Entry| {
        let found = entry.found.as_ref().ok();
        vec![
            Cell::Word(entry.branch.clone()),
            word(entry.kind.map_or("", |kind| kind.name())),
            Cell::Number(entry.at),
            word(&entry.quantity),
            number(Some(entry.value)),
            word(&entry.parameter),
            number(found.map(|own| own.value)),
            number(found.map(|own| own.error)),
            word(&ratio(&entry.unit, &entry.per)),
            number(entry.elasticity),
            word(entry.found.as_ref().err().map_or("", |reason| reason)),
        ]
    };
    Table { columns, rows: entries.iter().map(row).collect() }
}

fn uncertainty(all: &[Listed<Uncertainty>], model: &Model, wanted: &dyn Fn(Measured, &str) -> bool) -> Table {
    let column = Column::new;
    let columns = vec![
        column("branch", Style::Word),
        column("kind", Style::Word),
        column("at", Style::Number),
        column("quantity", Style::Word),
        column("unit", Style::Word),
        column("value", Style::Number),
        column("mean", Style::Number),
        column("sigma", Style::Number),
        column("sampled_mean", Style::Number),
        column("sampled_sigma", Style::Number),
        column("low", Style::Number),
        column("high", Style::Number),
        column("samples", Style::Number),
        column("failed", Style::Number),
        column("remark", Style::Word),
    ];
    let mut rows = Vec::new();
    for point in all {
        let place =
            || vec![Cell::Word(point.branch.clone()), Cell::Word(point.kind.name().into()), Cell::Number(point.at)];
        let found = match &point.found {
            Ok(found) => found,
            Err(reason) => {
                let mut row = place();
                row.extend((0..11).map(|_| Cell::Empty));
                row.push(word(reason));
                rows.push(row);
                continue;
            }
        };
        let failed: usize = found.failed.iter().map(|(_, count)| count).sum();
        let reasons: Vec<String> = found.failed.iter().map(|(why, count)| format!("{count}: {why}")).collect();
        for band in &found.bands {
            let name = band.of.name(model, point.free);
            if !wanted(band.of, &name) {
                continue;
            }
            let [first, sampled] = [band.first_order.as_ref().ok().copied(), band.sampled];
            let mut remarks = reasons.clone();
            remarks.extend(band.first_order.as_ref().err().cloned());
            let mut row = place();
            row.extend([Cell::Word(name), word(&band.of.unit(model, point.free)), number(Some(band.value))]);
            row.extend([first, sampled].iter().flat_map(|own| [0, 1].map(|k| number(own.map(|pair| pair[k])))));
            row.extend([0, 1].map(|k| number(band.range.map(|pair| pair[k]))));
            row.extend([found.samples, failed].map(|count| Cell::Count(count as i64)));
            row.push(word(&remarks.join("; ")));
            rows.push(row);
        }
    }
    Table { columns, rows }
}

fn word(text: &str) -> Cell {
    if text.is_empty() { Cell::Empty } else { Cell::Word(text.into()) }
}

fn number(value: Option<f64>) -> Cell {
    value.filter(|value| value.is_finite()).map_or(Cell::Empty, Cell::Number)
}

/// Unit of a derivative.
fn ratio(unit: &str, per: &str) -> String {
    let none = |unit: &str| matches!(unit, "" | "1" | "-");
    match (none(unit), none(per)) {
        (true, true) => String::new(),
        (false, true) => unit.into(),
        (true, false) => format!("1/({per})"),
        (false, false) if unit == per => String::new(),
        (false, false) => format!("({unit})/({per})"),
    }
}
