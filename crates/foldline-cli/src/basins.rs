//! `foldline basins`: basin fractions, and basins in a plane of the state space.

use crate::arguments::Basins as Typed;
use crate::failure::{Failure, Outcome};
use crate::plot::picture;
use crate::progress::SignOfLife;
use crate::run::processors;
use crate::table::{Cell, Column, Style, Table, write};
use crate::values::{measured, parameters, states, with_one_forcing};
use foldline::attractors::Fate;
use foldline::contract::VectorField;
use foldline::diagram::{Share, Solution};
use foldline::explore::System;
use foldline::explore::basins::{Basins, Plane, basins};
use foldline::explore::kicks::{Kicking, kicks};
use foldline::explore::section::adaptive;
use foldline::model::Model;
use foldline_plot::basins::{LOST, name, svg};
use foldline_store::finite::never_finite;
use foldline_store::model_file::read_model;
use foldline_store::nearest::suggest;
use std::fmt::Write as _;
use std::io::{Write, stderr, stdout};

const TOLERANCE: f64 = 1e-6;

/// Computes the basins; prints a table, and writes a picture and the cells.
pub fn print(typed: &Typed) -> Result<Outcome, Failure> {
    let (model, text) = read_model(&typed.model)?;
    with_one_forcing(&model)?;
    let parameters = parameters(&typed.set, &model)?;
    if let Some(found) = never_finite(&model, &parameters, &text, &typed.model.display().to_string()) {
        return Err(vec![found].into());
    }
    let mut system = System::of(&model, &parameters);
    for text in &typed.range {
        let (state, range) = ranged(text, &model)?;
        system.ranges[state] = range;
    }
    if let Some(steps) = typed.limits.max_steps {
        system.limits.steps = usize::try_from(steps).unwrap_or(usize::MAX);
    }
    if let Some(time) = &typed.limits.max_time {
        system.limits.time = measured(time, &model.time).filter(|time| *time > 0.0).ok_or_else(|| {
            Failure::typed(
                format!("--max-time {time}: not a positive time"),
                "give a number, or one with a unit such as \"20 ms\"",
            )
        })?;
    }
    if typed.output.is_some() && typed.plane.is_none() && typed.along.is_none() {
        return Err(Failure::typed("--output: there is nothing to draw", "give --plane, or --along"));
    }
    if typed.along.is_some() {
        let limits = system.limits;
        let ranges = typed.range.iter().map(|text| ranged(text, &model)).collect::<Result<Vec<_>, Failure>>()?;
        return crate::basins_along::print(typed, &model, &parameters, &|own| {
            own.limits = limits;
            ranges.iter().for_each(|(state, range)| own.ranges[*state] = *range);
        });
    }
    let plane = typed.plane.as_ref().map(|names| plane(names, typed, &model, &system.ranges)).transpose()?;
    if plane.is_none() && typed.samples == 0 {
        return Err(Failure::typed("--samples 0: nothing is left to compute", "give --plane, or a number of samples"));
    }
    let jobs = typed.jobs.map_or_else(processors, usize::from);
    let working = SignOfLife::of("following initial states");
    let drawn = (typed.samples as usize, typed.seed);
    let found = match (&plane, typed.adaptive) {
        (Some(plane), Some(size)) => adaptive(&system, &parameters, plane, drawn, (jobs, TOLERANCE), usize::from(size)),
        _ => basins(&system, &parameters, plane.as_ref(), drawn, jobs, TOLERANCE),
    };
    drop(working);

    write(&table(&found, &model, plane.is_some()), typed.format, &mut stdout().lock())?;
    notes(&found)?;
    let kicked = match typed.kicks {
        Some(count) => kicked(&found, &system, &parameters, &model, plane.as_ref(), (typed, count, jobs))?,
        None => true,
    };
    if let Some(plane) = &plane {
        if let Some(file) = &typed.output {
            picture(&svg(&found, plane, &model, model.iterated()), file)?;
        }
        if let Some(file) = &typed.data {
            std::fs::write(file, cells(&found, plane, &model))
                .map_err(|error| Failure::Outside(format!("cannot write {}: {error}", file.display())))?;
        }
    }
    let all = || found.box_fates.iter().chain(&found.plane_fates);
    let short = all().any(|fate| matches!(fate, Fate::Unsettled | Fate::Stuck | Fate::Chatter | Fate::Left));
    Ok(if short || !kicked { Outcome::Short } else { Outcome::Done })
}

/// Prints the smallest kicks that lead out of each basin. Returns false if there is none for some attractor.
fn kicked(
    found: &Basins,
    system: &System,
    parameters: &[f64],
    model: &Model,
    plane: Option<&Plane>,
    (typed, count, jobs): (&Typed, u32, usize),
) -> Result<bool, Failure> {
    let all: Vec<usize> = plane.map_or_else(|| (0..model.states.len()).collect(), |plane| plane.axes.to_vec());
    let states: Vec<usize> =
        all.into_iter().filter(|index| system.ranges[*index][0] < system.ranges[*index][1]).collect();
    let working = SignOfLife::of("kicking");
    let kicking = Kicking { states: &states, directions: count as usize, seed: typed.seed };
    let results = kicks(system, parameters, &found.attractors, &kicking, (jobs, TOLERANCE));
    drop(working);
    let fate_name = |fate: Fate| match fate {
        Fate::Settled(k) if k < found.attractors.len() => name(found, k, model.iterated()),
        Fate::Settled(_) => "another attractor".to_string(),
        other => LOST.iter().find(|(own, ..)| *own == other).map_or("unknown", |(_, name, _)| *name).to_string(),
    };
    let mut columns = vec![Column::new("attractor", Style::Word)];
    columns.extend([Column::new("kick", Style::Number), Column::new("error", Style::Size)]);
    let of = |before: &str, index: &usize| {
        let state = &model.states[*index];
        Column::in_unit(&format!("{before}{}", state.name), Style::Number, &state.unit)
    };
    columns.extend(states.iter().map(|index| of("", index)));
    columns.extend(states.iter().map(|index| of("change of ", index)));
    columns.push(Column::new("leads to", Style::Word));
    let mut rows = Vec::new();
    let mut whole = true;
    for (k, result) in results.iter().enumerate() {
        let mut row = vec![Cell::Word(name(found, k, model.iterated()))];
        match result {
            Ok(kick) => {
                row.extend([kick.size, kick.error].map(Cell::Number));
                row.extend(states.iter().map(|index| Cell::Number(kick.from[*index])));
                row.extend(states.iter().map(|index| Cell::Number(kick.change[*index])));
                row.push(Cell::Word(fate_name(kick.fate)));
            }
            Err(reason) => {
                row.extend((0..2 + 2 * states.len()).map(|_| Cell::Empty));
                row.push(Cell::Word(reason.clone()));
                whole = false;
            }
        }
        rows.push(row);
    }
    write(&Table { columns, rows }, typed.format, &mut stdout().lock())?;
    let names: Vec<&str> = states.iter().map(|index| model.states[*index].name.as_str()).collect();
    writeln!(
        stderr(),
        "kick: smallest found in {} directions of {}, in widths of their ranges; parts of other basins between the directions may be nearer",
        if states.len() == 1 { 2 } else { count as usize },
        names.join(", ")
    )?;
    Ok(whole)
}

/// Parses `STATE=LOW:HIGH`.
fn ranged(typed: &str, model: &Model) -> Result<(usize, [f64; 2]), Failure> {
    let said = |message: &str, cure: &str| Failure::typed(format!("--range {typed}: {message}"), cure);
    let example = format!("write --range STATE=LOW:HIGH, for example --range {}=-2:2", model.states[0].name);
    let (name, ends) = typed.split_once('=').ok_or_else(|| said("`=` is missing", &example))?;
    let (low, high) = ends.split_once(':').ok_or_else(|| said("`:` is missing between two values", &example))?;
    let index = state("--range", typed, name.trim(), model)?;
    let [low, high] = [low, high].map(|end| measured(end, &model.states[index].unit));
    match (low, high) {
        (Some(low), Some(high)) if low <= high => Ok((index, [low, high])),
        (Some(_), Some(_)) => Err(said("the first value is larger than the second", &example)),
        _ => Err(said("an end is neither a finite number nor a quantity in a unit of the state", &example)),
    }
}

/// Index of a state.
fn state(option: &str, typed: &str, name: &str, model: &Model) -> Result<usize, Failure> {
    model.state_index(name).ok_or_else(|| {
        let known: Vec<&str> = model.states.iter().map(|state| state.name.as_str()).collect();
        let message = format!("{option} {typed}: the model `{}` has no state `{name}`", model.name);
        Failure::typed(message, suggest(name, &known))
    })
}

/// Plane through the nearest point of the box to the origin, with the values given.
fn plane(names: &str, typed: &Typed, model: &Model, ranges: &[[f64; 2]]) -> Result<Plane, Failure> {
    let cure = "give two states, as in --plane x,y";
    let Some((x, y)) = names.split_once(',') else {
        return Err(Failure::typed(format!("--plane {names}: not two states"), cure));
    };
    let axes = [state("--plane", names, x.trim(), model)?, state("--plane", names, y.trim(), model)?];
    if axes[0] == axes[1] {
        return Err(Failure::typed(format!("--plane {names}: one state twice"), cure));
    }
    if let Some(axis) = axes.iter().find(|axis| ranges[**axis][0] >= ranges[**axis][1]) {
        let name = &model.states[*axis].name;
        return Err(Failure::typed(format!("--plane {names}: the range of {name} is empty"), "give a wider --range"));
    }
    let given = states(&typed.at, model)?;
    if let Some(axis) = axes.iter().find(|axis| given[**axis].is_some()) {
        let message = format!("--at: {} is an axis of the plane", model.states[*axis].name);
        return Err(Failure::typed(message, "its range is set by --range"));
    }
    let through = given.iter().zip(ranges).map(|(given, [low, high])| given.unwrap_or(0f64.clamp(*low, *high)));
    Ok(Plane { axes, ranges: axes.map(|axis| ranges[axis]), cells: typed.cells, through: through.collect() })
}

/// One row for each attractor, then for each other fate that occurred.
fn table(found: &Basins, model: &Model, with_plane: bool) -> Table {
    let mut columns = vec![
        Column::new("attractor", Style::Word),
        Column::in_unit("period", Style::Number, &model.time),
        Column::new("samples", Style::Number),
        Column::new("fraction", Style::Number),
        Column::new("low", Style::Number),
        Column::new("high", Style::Number),
    ];
    if with_plane {
        columns.extend([Column::new("cells", Style::Number), Column::new("of plane", Style::Number)]);
    }
    let row = |label: String, period: Cell, fate: Fate| {
        let share = found.share(fate);
        let [low, high] = share.interval();
        let mut row = vec![Cell::Word(label), period, Cell::Count(share.hits as i64)];
        row.extend([share.value(), low, high].map(|value| Cell::Number(rounded(value, share))));
        if with_plane {
            let part = found.part(fate);
            row.extend([Cell::Count(part.hits as i64), Cell::Number(rounded(part.value(), part))]);
        }
        row
    };
    let attractors = found.attractors.iter().enumerate().map(|(number, attractor)| {
        let period = match &attractor.point.solution {
            Solution::Equilibrium(_) => Cell::Empty,
            Solution::Cycle(cycle) => Cell::Number(cycle.period),
            Solution::Torus(torus) => Cell::Number(torus.period),
        };
        row(name(found, number, model.iterated()), period, Fate::Settled(number))
    });
    let occurred = |fate: &Fate| found.box_fates.contains(fate) || found.plane_fates.contains(fate);
    let lost = LOST.into_iter().filter(|(fate, ..)| occurred(fate));
    let lost = lost.map(|(fate, name, _)| row(name.to_string(), Cell::Empty, fate));
    let rows = attractors.chain(lost).collect();
    Table { columns, rows }
}

/// A fraction to a tenth of the smallest step that the number of states can resolve.
fn rounded(value: f64, share: Share) -> f64 {
    let digits = 10f64.powi((share.of.max(1) as f64).log10().ceil() as i32 + 1);
    (value * digits).round() / digits
}

/// Explains the fractions, and how trajectories were decided.
fn notes(found: &Basins) -> Result<(), Failure> {
    let mut out = stderr().lock();
    if !found.box_fates.is_empty() {
        let count = found.box_fates.len();
        writeln!(
            out,
            "fraction: of {count} initial states drawn uniformly from the ranges, with its 95 % confidence interval"
        )?;
    }
    if let Some(filled) = &found.filled {
        let [_, most] = filled.error().interval();
        writeln!(
            out,
            "cells: {} of {} computed; of {} filled ones that were checked, {} were wrong: at most {:.2} % of the filled ones are (95 % \
             confidence)",
            filled.computed,
            found.plane_fates.len(),
            filled.checked,
            filled.wrong,
            100.0 * most
        )?;
    }
    if let Some(early) = found.early.as_ref().filter(|early| early.checked > 0) {
        let radii: Vec<String> =
            early.radii.iter().map(|radius| radius.map_or("·".to_string(), |radius| radius.to_string())).collect();
        writeln!(
            out,
            "early decisions: a steady approach to within {} of the sizes of the attractors; of {} followed further, {} went \
             elsewhere",
            radii.join(", "),
            early.checked,
            early.wrong
        )?;
    }
    Ok(())
}

/// The cells as comma-separated values.
fn cells(found: &Basins, plane: &Plane, model: &Model) -> String {
    let [x, y] = plane.axes.map(|axis| &model.states[axis].name);
    let mut text = format!("{x},{y},attractor\n");
    for (place, fate) in found.plane_fates.iter().enumerate() {
        let (column, row) = (place % plane.cells[0], place / plane.cells[0]);
        let label = match fate {
            Fate::Settled(number) => (number + 1).to_string(),
            other => {
                LOST.iter().find(|(fate, ..)| fate == other).map_or(String::new(), |(_, name, _)| name.to_string())
            }
        };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{:?},{:?},{label}", plane.centre(0, column), plane.centre(1, row));
    }
    text
}
