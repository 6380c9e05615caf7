//! `foldline basins --along`: basin fractions over a parameter.

use crate::arguments::Basins as Typed;
use crate::failure::{Failure, Outcome};
use crate::plot::picture;
use crate::progress::SignOfLife;
use crate::run::processors;
use crate::table::{Cell, Column, Style, Table, read, write};
use crate::values::{measured, parameter};
use foldline::attractors::Fate;
use foldline::explore::System;
use foldline::explore::along::{AtValue, branch_of, shares_along};
use foldline::explore::cells::answers::kind_of;
use foldline::model::Model;
use foldline_plot::map::{Along, line_svg};
use foldline_store::run_file::Part;
use std::io::{Write, stderr, stdout};

const TOLERANCE: f64 = 1e-6;

/// Computes the fractions; prints a table and writes a picture.
pub fn print(
    typed: &Typed,
    model: &Model,
    parameters: &[f64],
    limited: &dyn Fn(&mut System),
) -> Result<Outcome, Failure> {
    let (free, values) = values(typed, model)?;
    if typed.samples == 0 {
        return Err(Failure::typed("--samples 0: nothing is left to compute", "give a number of samples"));
    }
    let run = typed.branches.as_ref().map(|folder| read(folder, Part::Numbers)).transpose()?;
    let jobs = typed.jobs.map_or_else(processors, usize::from);
    let working = SignOfLife::of("following initial states");
    let drawn = (typed.samples as usize, typed.seed);
    let found = shares_along(model, parameters, (free, &values), drawn, (jobs, TOLERANCE), limited);
    drop(working);
    let system = System::of(model, parameters);
    let names: Vec<Vec<String>> = found
        .iter()
        .map(|own| {
            let attractors = own.found.attractors.iter().zip(&own.numbers);
            attractors
                .map(|(attractor, number)| {
                    let diagram = run.as_ref().map(|run| &run.diagram);
                    let branch = diagram.and_then(|own| branch_of(own, free, &attractor.point, &system.scales));
                    branch.map_or_else(|| format!("attractor {}", number + 1), str::to_string)
                })
                .collect()
        })
        .collect();
    let own = &model.parameters[free];
    write(&table(&found, &names, &own.name, &own.unit), typed.format, &mut stdout().lock())?;
    writeln!(
        stderr(),
        "fraction: of {} initial states drawn uniformly from the ranges, with its 95 % confidence interval",
        typed.samples
    )?;
    if let Some(file) = &typed.output {
        let mut all: Vec<String> = Vec::new();
        names.iter().flatten().for_each(|name| all.extend((!all.contains(name)).then(|| name.clone())));
        let fraction = |name: &String| {
            let at = |(own, names): (&AtValue, &Vec<String>)| {
                let places = names.iter().enumerate().filter(|(_, other)| *other == name);
                let sum: f64 = places.map(|(k, _)| own.found.share(Fate::Settled(k)).value()).sum();
                if names.contains(name) { sum } else { f64::NAN }
            };
            (name.clone(), found.iter().zip(&names).map(at).collect())
        };
        let curves: Vec<(String, Vec<f64>)> = all.iter().map(fraction).collect();
        let reached: Vec<f64> = found.iter().map(|own| own.value).collect();
        let along = Along { name: &own.name, unit: &own.unit, values: &reached };
        picture(&line_svg(&along, "basin fraction", &curves, ""), file)?;
    }
    let unsettled = |fate: &Fate| matches!(fate, Fate::Unsettled | Fate::Stuck | Fate::Chatter | Fate::Left);
    let short = found.len() < values.len() || found.iter().any(|own| own.found.box_fates.iter().any(unsettled));
    Ok(if short { Outcome::Short } else { Outcome::Done })
}

/// Index of the parameter and its values.
fn values(typed: &Typed, model: &Model) -> Result<(usize, Vec<f64>), Failure> {
    let text = typed.along.as_deref().unwrap_or_default();
    let said = |message: &str| {
        Failure::typed(
            format!("--along {text}: {message}"),
            "write --along NAME=FIRST:LAST, for example --along Omega=1:5",
        )
    };
    let (name, ends) = text.split_once('=').ok_or_else(|| said("`=` is missing"))?;
    let (first, last) = ends.split_once(':').ok_or_else(|| said("`:` is missing between two values"))?;
    let index = parameter(name.trim(), model)
        .map_err(|(message, cure)| Failure::typed(format!("--along {text}: {message}"), cure))?;
    let ends = [first, last].map(|end| measured(end, &model.parameters[index].unit));
    let [Some(first), Some(last)] = ends else {
        return Err(said("an end is neither a finite number nor a quantity in a unit of the parameter"));
    };
    let steps = f64::from(typed.values - 1);
    let value = |k: u32| (first * (steps - f64::from(k)) + last * f64::from(k)) / steps;
    Ok((index, (0..typed.values).map(value).collect()))
}

fn table(found: &[AtValue], names: &[Vec<String>], free: &str, unit: &str) -> Table {
    let mut columns = vec![Column::in_unit(free, Style::Number, unit)];
    columns.extend([("attractor", Style::Word), ("kind", Style::Word)].map(|(name, style)| Column::new(name, style)));
    columns.extend(["period", "samples"].map(|name| Column::new(name, Style::Number)));
    columns.extend(["fraction", "low", "high"].map(|name| Column::new(name, Style::Share)));
    let mut rows = Vec::new();
    for (own, names) in found.iter().zip(names) {
        for (k, (attractor, name)) in own.found.attractors.iter().zip(names).enumerate() {
            let share = own.found.share(Fate::Settled(k));
            let [low, high] = share.interval();
            let period = attractor.point.solution.period().map_or(Cell::Empty, Cell::Number);
            let kind = kind_of(&attractor.point.solution, attractor.ratio);
            let mut row = vec![Cell::Number(own.value), Cell::Word(name.clone()), Cell::Word(kind), period];
            row.push(Cell::Count(share.hits as i64));
            row.extend([share.value(), low, high].map(Cell::Number));
            rows.push(row);
        }
        let lost = foldline_plot::basins::LOST.into_iter().filter(|(fate, ..)| own.found.box_fates.contains(fate));
        for (fate, name, _) in lost {
            let share = own.found.share(fate);
            let [low, high] = share.interval();
            let mut row = vec![Cell::Number(own.value), Cell::Word(name.into()), Cell::Empty, Cell::Empty];
            row.push(Cell::Count(share.hits as i64));
            row.extend([share.value(), low, high].map(Cell::Number));
            rows.push(row);
        }
    }
    Table { columns, rows }
}
