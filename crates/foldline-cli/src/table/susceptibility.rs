//! `foldline table --susceptibility`: first-order response to a small further forcing.

use super::{Cell, Column, Run, Style, Table, asked_for, columns, read, write};
use crate::arguments::Table as Typed;
use crate::failure::{Failure, Outcome};
use foldline::diagram::Point;
use foldline::explore::System;
use foldline::model::{Constant, Model, constant_value};
use foldline::susceptibility::{Forcing, susceptibility};
use foldline_store::nearest::suggest;
use foldline_store::run_file::Part;
use num_complex::Complex64;
use std::io::{Write, stderr, stdout};

/// Amplitudes and frequency given on the command line.
struct Asked<'t> {
    /// State, expression and whether it is multiplied by i.
    forces: Vec<(usize, &'t str, bool)>,
    frequency: &'t str,
}

/// Prints the table.
pub fn print(typed: &Typed) -> Result<Outcome, Failure> {
    if !typed.unit.is_empty() {
        return Err(Failure::typed(
            "--unit does not apply to responses, which are in the units of the model",
            "leave it out",
        ));
    }
    let run = read(&typed.folder, Part::Everything)?;
    let kept = asked_for(&run.diagram, typed.branch.as_deref())?;
    let asked = asked(&typed.force, typed.frequency.as_deref(), &run.model)?;
    let system = System::of_plan(&run.model, &run.plan);
    let (mut rows, mut failed) = (Vec::new(), Failed::default());
    for branch in run.diagram.branches.iter().filter(|branch| kept(branch)) {
        for point in &branch.points {
            let forcing = asked.at(point, &run.model)?;
            let found = susceptibility(&run.model, &system.scales, point, &forcing);
            let numbers = match &found {
                Ok(found) => [&found.response[..], &[found.error, found.distance]].concat(),
                Err(why) => {
                    failed.add(&branch.name, why);
                    Vec::new()
                }
            };
            let mut row = vec![Cell::Word(branch.name.clone()), Cell::Count(point.position)];
            row.extend(columns::places(point, &run.model));
            row.push(Cell::Count(point.unstable as i64));
            let cells =
                (0..run.model.states.len() + 2).map(|k| numbers.get(k).map_or(Cell::Empty, |x| Cell::Number(*x)));
            row.extend(cells);
            rows.push(row);
        }
    }
    let mut names = vec![Column::new("branch", Style::Word), Column::new("position", Style::Number)];
    names.extend(columns::place_names(&run.diagram, &run.model, &kept));
    names.push(Column::new("unstable", Style::Number));
    names.extend(run.model.states.iter().map(|state| Column::new(&format!("{}_response", state.name), Style::Number)));
    names.push(Column::new("response_error", Style::Size));
    names.push(Column::new("distance", Style::Number));
    let mut out = std::io::BufWriter::new(stdout().lock());
    write(&Table { columns: names, rows }, typed.format, &mut out)?;
    out.flush()?;
    failed.report()
}

/// Points without a response, counted by branch and reason.
#[derive(Default)]
struct Failed(Vec<(String, String, usize)>);

impl Failed {
    fn add(&mut self, branch: &str, why: &str) {
        match self.0.iter_mut().find(|(name, own, _)| name == branch && own == why) {
            Some((.., count)) => *count += 1,
            None => self.0.push((branch.into(), why.into(), 1)),
        }
    }

    fn report(&self) -> Result<Outcome, Failure> {
        for (branch, why, count) in &self.0 {
            let points = if *count == 1 { "1 point has".to_string() } else { format!("{count} points have") };
            writeln!(stderr().lock(), "incomplete: {branch}: {points} no response: {why}")?;
        }
        Ok(if self.0.is_empty() { Outcome::Done } else { Outcome::Short })
    }
}

/// Adds the responses to a run, as outputs NAME_response behind those of the model; reports the points that have none.
pub fn add_responses(run: &mut Run, force: &[String], frequency: Option<&str>) -> Result<Outcome, Failure> {
    let asked = asked(force, frequency, &run.model)?;
    let (mut failed, system) = (Failed::default(), System::of_plan(&run.model, &run.plan));
    for branch in &mut run.diagram.branches {
        let special = branch.special.iter_mut().map(|special| (&mut special.point, false));
        for (point, counts) in branch.points.iter_mut().map(|point| (point, true)).chain(special) {
            let forcing = asked.at(point, &run.model)?;
            match susceptibility(&run.model, &system.scales, point, &forcing) {
                Ok(found) => point.ranges.extend(found.response.iter().map(|response| [*response, *response])),
                Err(why) if counts => failed.add(&branch.name, &why),
                Err(_) => {}
            }
        }
    }
    drop(system);
    run.model = run.model.listing(run.model.states.iter().map(|state| format!("{}_response", state.name)));
    failed.report()
}

fn asked<'t>(force: &'t [String], frequency: Option<&'t str>, model: &Model) -> Result<Asked<'t>, Failure> {
    let states = || model.states.iter().map(|state| state.name.as_str());
    let example = states().next_back().unwrap_or("x");
    let Some(frequency) = frequency else {
        return Err(Failure::typed(
            "--susceptibility: the frequency of the forcing is missing",
            "add --frequency, an expression of parameters in radians per unit of time, such as --frequency Omega",
        ));
    };
    if force.is_empty() {
        let cure =
            format!("add --force {example}=1 for cos νt on the right-hand side of {example}, {example}=-i for sin νt");
        return Err(Failure::typed("--susceptibility: the forcing is missing", cure));
    }
    let mut forces = Vec::new();
    for text in force {
        let cure = format!("write --force STATE=AMPLITUDE, for example --force {example}=1 or --force {example}=-i");
        let Some((name, amplitude)) = text.split_once('=') else {
            return Err(Failure::typed(format!("--force {text}: `=` is missing"), cure));
        };
        let Some(state) = states().position(|own| own == name.trim()) else {
            let known = suggest(name.trim(), &states().collect::<Vec<_>>());
            return Err(Failure::typed(format!("--force {text}: the model has no state {}", name.trim()), known));
        };
        let (real, turned) = without_i(amplitude.trim());
        forces.push((state, real, turned));
    }
    Ok(Asked { forces, frequency })
}

/// An amplitude without the factor i at its end, and whether there was one.
fn without_i(amplitude: &str) -> (&str, bool) {
    let Some(rest) = amplitude.strip_suffix('i') else { return (amplitude, false) };
    match rest.trim_end().strip_suffix('*') {
        Some(factor) => (factor, true),
        None if rest.is_empty() => ("1", true),
        None if rest == "-" => ("-1", true),
        None if rest.ends_with(|c: char| c.is_ascii_digit() || c == '.' || c == ')') => (rest, true),
        // The end of a name.
        None => (amplitude, false),
    }
}

impl Asked<'_> {
    /// The forcing at the parameter values of a point.
    fn at(&self, point: &Point, model: &Model) -> Result<Forcing, Failure> {
        let constants: Vec<Constant> = model
            .parameters
            .iter()
            .zip(&point.parameters)
            .map(|(own, value)| Constant::new(&own.name, *value))
            .collect();
        let value = |option: &str, text: &str| {
            constant_value(text, &constants).map_err(|_| {
                let names: Vec<&str> = model.parameters.iter().map(|own| own.name.as_str()).collect();
                let cure = format!("write a number or an expression of the parameters: {}", names.join(", "));
                Failure::typed(format!("{option} {text}: this has no value"), cure)
            })
        };
        let mut amplitudes = vec![Complex64::new(0.0, 0.0); model.states.len()];
        for (state, text, turned) in &self.forces {
            let size = value("--force", text)?;
            amplitudes[*state] += if *turned { Complex64::new(0.0, size) } else { Complex64::new(size, 0.0) };
        }
        Ok(Forcing { amplitudes, frequency: value("--frequency", self.frequency)? })
    }
}
