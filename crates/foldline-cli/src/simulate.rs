//! `foldline simulate`: one trajectory as a table or a picture.

use crate::arguments::Simulate as Typed;
use crate::failure::{Failure, Outcome};
use crate::plot::picture;
use crate::run::stop_on_interrupt;
use crate::table::{Cell, Column, Style, Table, write};
use crate::values::{measured, parameters, states, with_motions};
use crate::verbosity::report;
use foldline::contract::{Batch, Parameters, VectorField};
use foldline::explore::course::{Course, Way, course};
use foldline::model::Model;
use foldline::simulation::Outcome as Ending;
use foldline_plot::{Axis, Figure, Layer, LegendPlace, Marker, Panel, figure_svg, palette};
use foldline_store::finite::never_finite;
use foldline_store::model_file::read_model;
use foldline_store::nearest::suggest;
use std::io::{BufWriter, Write, stderr, stdout};
use std::sync::atomic::Ordering;

/// Number of rows of a table without `--every`.
const ROWS: f64 = 200.0;
/// Maximum number of rows; a request for more would be a mistake.
const MOST_ROWS: f64 = 1e7;
/// Length in periods, for a forced model without `--time`.
const PERIODS: f64 = 20.0;

/// Integrates from one initial state, and prints or draws the trajectory.
pub fn trajectory(typed: &Typed) -> Result<Outcome, Failure> {
    let (model, text) = read_model(&typed.model)?;
    with_motions(&model)?;
    let parameters = parameters(&typed.set, &model)?;
    if let Some(found) = never_finite(&model, &parameters, &text, &typed.model.display().to_string()) {
        return Err(vec![found].into());
    }
    let start = start(typed, &model)?;
    allowed(&model, &start, &parameters)?;
    let columns = columns(typed, &model)?;
    let end = end(typed, &model, &parameters)?;
    let times = times(typed, &model, &parameters, end)?;
    let stop = stop_on_interrupt();
    let way = Way {
        tolerance: typed.tolerance,
        steps: usize::try_from(typed.max_steps).unwrap_or(usize::MAX),
        stop: &|| stop.load(Ordering::Relaxed),
    };
    // A picture without `--every` shows every step.
    let wanted = if typed.output.is_some() && typed.every.is_none() { None } else { Some(&times[..]) };
    let found = course(&model, &start, [0.0, end], wanted, &parameters, &way);
    let shown = Shown { model: &model, course: &found, columns };
    match &typed.output {
        Some(file) => picture(&shown.figure(typed)?, file)?,
        None => {
            let mut out = BufWriter::new(stdout().lock());
            write(&shown.table(), typed.format, &mut out)?;
            out.flush()?;
        }
    }
    ended(&found, end, &model)
}

/// Refuses an initial state that an event does not allow.
fn allowed(model: &Model, start: &[f64], parameters: &[f64]) -> Result<(), Failure> {
    let parameters = Parameters::Shared(parameters);
    let at = Batch { lanes: 1, states: start, parameters, times: &[0.0], signs: &[] };
    let Some(name) = model.forbidden(at).and_then(|event| model.events.get(event)) else { return Ok(()) };
    let message = format!("the initial state violates what the event `{name}` allows");
    Err(Failure::typed(message, "start on the allowed side, with --start"))
}

/// Initial state. A state without a value starts at three quarters of its range, and this is reported; the midpoint is
/// often an equilibrium.
fn start(typed: &Typed, model: &Model) -> Result<Vec<f64>, Failure> {
    let given = states(&typed.start, model)?;
    let within = |i: usize| {
        let [low, high] = model.states[i].range_at(1.0);
        let value = 0.25 * low + 0.75 * high;
        // Any value there would do; a short one is easier to repeat.
        format!("{value:.2e}").parse().unwrap_or(value)
    };
    let missing = given.iter().enumerate().filter(|(_, value)| value.is_none());
    let assumed: Vec<String> = missing.map(|(i, _)| format!("{}={}", model.states[i].name, within(i))).collect();
    if !assumed.is_empty() {
        report(format_args!(
            "note: initial values chosen from the ranges of the states: --start {}",
            assumed.join(",")
        ))?;
    }
    Ok(given.into_iter().enumerate().map(|(i, value)| value.unwrap_or_else(|| within(i))).collect())
}

/// Length of the trajectory.
fn end(typed: &Typed, model: &Model, parameters: &[f64]) -> Result<f64, Failure> {
    let period = || model.time_unit(parameters);
    match (&typed.time, typed.periods) {
        (Some(text), _) => match measured(text, &model.time).filter(|t| *t > 0.0) {
            Some(time) => Ok(time),
            None => Err(Failure::typed(
                format!("--time {text}: not a positive time"),
                "give a number in the time unit of the model, or one with a unit such as \"20 ms\"",
            )),
        },
        (None, Some(count)) if model.forced() => Ok(f64::from(count) * period()),
        (None, Some(_)) => Err(Failure::typed(
            "--periods: the model has no forcing, so no forcing periods",
            "give the time, as in --time 100",
        )),
        (None, None) if model.forced() => Ok(PERIODS * period()),
        (None, None) => Err(Failure::typed("the length of the trajectory is missing", "give it, as in --time 100")),
    }
}

/// Times at which the trajectory is printed.
fn times(typed: &Typed, model: &Model, parameters: &[f64], end: f64) -> Result<Vec<f64>, Failure> {
    let every = match typed.every.as_deref() {
        None if model.iterated() => 1.0,
        None => end / ROWS,
        Some("period") if model.forced() => model.time_unit(parameters),
        Some(text) => measured(text, &model.time).filter(|t| *t > 0.0).ok_or_else(|| {
            let cure =
                "give a positive number in the time unit of the model, or `period` for one row per forcing period";
            Failure::typed(format!("--every {text}: not a time interval"), cure)
        })?,
    };
    // Rounding must not lose the last time.
    let count = (end / every * (1.0 + 4.0 * f64::EPSILON)).floor();
    if count > MOST_ROWS {
        let message = format!("this makes {count:.0} rows; the limit is {MOST_ROWS:.0}");
        return Err(Failure::typed(message, "give a larger interval with --every, or a shorter time"));
    }
    Ok((0..=count as usize).map(|k| (k as f64 * every).min(end)).collect())
}

/// A state, or an output.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Variable {
    State(usize),
    Output(usize),
}

fn named(name: &str, option: &str, model: &Model) -> Result<Variable, Failure> {
    let state = model.states.iter().position(|s| s.name == name).map(Variable::State);
    let found = state.or_else(|| model.outputs.iter().position(|o| o.name == name).map(Variable::Output));
    found.ok_or_else(|| {
        let states = model.states.iter().map(|s| s.name.as_str());
        let names: Vec<&str> = states.chain(model.outputs.iter().map(|o| o.name.as_str())).collect();
        let message = format!("--{option}: the model `{}` has no state or output `{name}`", model.name);
        Failure::typed(message, suggest(name, &names))
    })
}

/// Variables to show: those given; by default all of them in a table, and the states in a picture.
fn columns(typed: &Typed, model: &Model) -> Result<Vec<Variable>, Failure> {
    if !typed.show.is_empty() {
        return typed.show.iter().map(|name| named(name, "show", model)).collect();
    }
    let states = (0..model.states.len()).map(Variable::State);
    let outputs = (0..model.outputs.len()).map(Variable::Output).filter(|_| typed.output.is_none());
    Ok(states.chain(outputs).collect())
}

/// A trajectory and the part of it to show.
struct Shown<'s> {
    model: &'s Model,
    course: &'s Course,
    columns: Vec<Variable>,
}

impl Shown<'_> {
    fn value(&self, variable: Variable, k: usize) -> f64 {
        match variable {
            Variable::State(i) => self.course.states[k * self.model.states.len() + i],
            Variable::Output(i) => self.course.outputs[k * self.model.outputs.len() + i],
        }
    }

    /// Name and unit.
    fn head(&self, variable: Variable) -> [&str; 2] {
        match variable {
            Variable::State(i) => [&self.model.states[i].name, &self.model.states[i].unit],
            Variable::Output(i) => [&self.model.outputs[i].name, &self.model.outputs[i].unit],
        }
    }

    fn table(&self) -> Table {
        let time = if self.model.iterated() { "k" } else { "t" };
        let mut columns = vec![Column::in_unit(time, Style::Number, &self.model.time)];
        columns.extend(self.columns.iter().map(|own| {
            let [name, unit] = self.head(*own);
            Column::in_unit(name, Style::Number, unit)
        }));
        let cell = |value: f64| Cell::Number(value);
        let row = |(k, t): (usize, &f64)| {
            let values = self.columns.iter().map(|own| cell(self.value(*own, k)));
            std::iter::once(cell(*t)).chain(values).collect()
        };
        Table { columns, rows: self.course.times.iter().enumerate().map(row).collect() }
    }

    /// Figure of the variables against time, or against another variable.
    fn figure(&self, typed: &Typed) -> Result<String, Failure> {
        let across = typed.x.as_ref().map(|name| named(name, "x", self.model)).transpose()?;
        let label = |[name, unit]: [&str; 2]| match unit {
            "" | "1" | "-" => foldline_plot::quantity::with_greek(name),
            _ => format!("{} [{unit}]", foldline_plot::quantity::with_greek(name)),
        };
        let time = if self.model.iterated() { "k" } else { "t" };
        let x = across.map_or(label([time, &self.model.time]), |own| label(self.head(own)));
        let shown: Vec<Variable> = self.columns.iter().copied().filter(|own| Some(*own) != across).collect();
        let y = match shown[..] {
            [one] => label(self.head(one)),
            _ => String::new(),
        };
        let at = |k: usize| across.map_or(self.course.times[k], |own| self.value(own, k));
        let layer = |(i, own): (usize, &Variable)| {
            let points: Vec<[f64; 2]> = (0..self.course.times.len()).map(|k| [at(k), self.value(*own, k)]).collect();
            // Samples taken once per period do not lie on a curve.
            let layer = match typed.every.as_deref() {
                _ if self.model.iterated() => Layer::scatter(points, Marker::Dot, palette::nth(i)).wide(1.6),
                Some("period") => Layer::scatter(points, Marker::Dot, palette::nth(i)).wide(1.6),
                _ => Layer::curve(&points, palette::nth(i)).smooth(),
            };
            if shown.len() > 1 { layer.named(label(self.head(*own))) } else { layer }
        };
        let panel = Panel {
            legend: if shown.len() > 1 { LegendPlace::Beside } else { LegendPlace::None },
            height: 420.0,
            ..Panel::new("", "", Axis::new(x), Axis::new(y)).with_all(shown.iter().enumerate().map(layer))
        };
        Ok(figure_svg(&Figure { panels: vec![panel], width: 760.0, ..Figure::default() }))
    }
}

/// Reports why a trajectory ended early.
fn ended(course: &Course, end: f64, model: &Model) -> Result<Outcome, Failure> {
    let last = course.times.last().copied().unwrap_or(0.0);
    let why = match course.outcome {
        Ending::Reached => return Ok(Outcome::Done),
        Ending::Stopped => "it was stopped",
        Ending::Escaped => "a state grew without bound",
        Ending::Undefined => {
            "f is not finite beyond this state: the trajectory leaves the region where the equations are defined"
        }
        Ending::StepTooSmall => {
            "the step size became too small: the equations are discontinuous without a switching point, or too stiff \
             here"
        }
        Ending::Chatter => {
            "chatter: its impacts follow each other ever faster and accumulate; the sustained contact that follows is not \
             computed"
        }
        Ending::StepLimit => "the limit on the number of steps was reached (--max-steps)",
    };
    let n = model.states.len();
    let from = course.states.len().saturating_sub(n);
    let state: Vec<String> =
        model.states.iter().zip(&course.states[from..]).map(|(s, v)| format!("{} = {v:.6}", s.name)).collect();
    writeln!(stderr(), "incomplete: {why}; last point t = {last:.6} of {end:.6}, {}", state.join(", "))?;
    Ok(Outcome::Short)
}
