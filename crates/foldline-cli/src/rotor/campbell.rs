//! `foldline campbell`: natural frequencies and damping as functions of the speed.

use super::{Loaded, load, scale, uncomputed, usual_count};
use crate::arguments::{Campbell as Typed, Frame};
use crate::failure::{Failure, Outcome};
use crate::plot::picture;
use crate::table::{Cell, Column, Style, Table, write};
use crate::verbosity::report;
use foldline_plot::{Axis, Figure, Layer, LegendPlace, Panel, figure_svg, palette};
use foldline_shaft::{Mode, Modes, Whirl};
use std::io::{BufWriter, Write, stdout};

/// Modes at each speed.
type Rows = Vec<(f64, Vec<Mode>)>;

/// Prints or draws the Campbell diagram, or prints the shapes of the modes at one speed.
pub fn print(typed: &Typed) -> Result<Outcome, Failure> {
    let rotor = load(&typed.model, &typed.set)?;
    let unit = scale("frequency", &typed.frequency, "rad/s")?;
    if typed.shapes {
        return shapes(typed, &rotor, unit);
    }
    let speeds = rotor.speeds(&typed.speeds, usual_count(typed.format, typed.output.is_some()))?;
    let found = rotor.machine.campbell(&rotor.parameters, &speeds, typed.modes as usize);
    let found: Option<Vec<Modes>> = found.into_iter().collect();
    let found = found.ok_or_else(|| uncomputed("the natural frequencies"))?;
    if let Some((speed, own)) = speeds.iter().zip(&found).max_by_key(|(_, own)| own.overdamped.len()) {
        note(&own.overdamped, &rotor, *speed)?;
    }
    let rows: Rows = speeds.iter().zip(found).map(|(speed, own)| (*speed, own.modes)).collect();
    if let Some(file) = &typed.output {
        picture(&figure(typed, &rotor, &rows, unit), file)?;
        return Ok(Outcome::Done);
    }
    let mut out = BufWriter::new(stdout().lock());
    write(&table(typed, &rotor, &rows, unit), typed.format, &mut out)?;
    out.flush()?;
    Ok(Outcome::Done)
}

/// Says that overdamped motions, if there are any, are not listed.
fn note(overdamped: &[f64], rotor: &Loaded, speed: f64) -> Result<(), Failure> {
    let (Some(slowest), Some(fastest)) = (overdamped.first(), overdamped.last()) else { return Ok(()) };
    let (name, unit) = rotor.speed_label();
    let (count, at) = (overdamped.len(), rotor.shown_speed(speed));
    report(format_args!(
        "note: real eigenvalues at {name} = {at} {unit} ({count}, from {slowest:.4e} to {fastest:.4e} 1/s) belong to overdamped \
         motions, which do not oscillate; they are not among the modes"
    ))?;
    Ok(())
}

/// Damped frequency in the requested frame, in rad/s; negative for backward whirl in the rotating frame.
fn frequency(frame: Frame, mode: &Mode, speed: f64) -> f64 {
    match frame {
        Frame::Fixed => mode.value.im,
        Frame::Rotating => mode.signed() - speed,
    }
}

fn mode_columns(unit: &str) -> Vec<Column> {
    vec![
        Column::new("mode", Style::Word),
        Column::new("whirl", Style::Word),
        Column::in_unit("frequency", Style::Number, unit),
        Column::in_unit("natural", Style::Number, unit),
        Column::new("damping_ratio", Style::Number),
        Column::new("log_decrement", Style::Number),
    ]
}

fn mode_cells(frame: Frame, k: usize, mode: &Mode, speed: f64, unit: f64) -> Vec<Cell> {
    vec![
        Cell::Count(k as i64 + 1),
        Cell::Word(mode.whirl.name().into()),
        Cell::Number(unit * frequency(frame, mode, speed)),
        Cell::Number(unit * mode.natural()),
        Cell::Number(mode.ratio()),
        Cell::Number(mode.decrement()),
    ]
}

fn table(typed: &Typed, rotor: &Loaded, rows: &Rows, unit: f64) -> Table {
    let (name, speed_unit) = rotor.speed_label();
    let mut columns = vec![Column::in_unit(&name, Style::Number, &speed_unit)];
    columns.extend(mode_columns(&typed.frequency));
    let of_speed = |(speed, modes): &(f64, Vec<Mode>)| {
        let speed = *speed;
        let row = |(k, mode): (usize, &Mode)| {
            let own = mode_cells(typed.frame, k, mode, speed, unit);
            std::iter::once(Cell::Number(rotor.shown_speed(speed))).chain(own).collect::<Vec<Cell>>()
        };
        modes.iter().enumerate().map(row).collect::<Vec<_>>()
    };
    Table { columns, rows: rows.iter().flat_map(of_speed).collect() }
}

fn figure(typed: &Typed, rotor: &Loaded, rows: &Rows, unit: f64) -> String {
    let (name, speed_unit) = rotor.speed_label();
    let label = |name: &str, unit: &str| format!("{} [{unit}]", foldline_plot::quantity::with_greek(name));
    let mut layers = Vec::new();
    for (whirl, colour) in
        [(Whirl::Forward, palette::BLUE), (Whirl::Backward, palette::VERMILION), (Whirl::Mixed, palette::GREEN)]
    {
        // Modes of one direction are numbered by frequency at each speed.
        for k in 0..typed.modes as usize {
            let at = |(speed, modes): &(f64, Vec<Mode>)| {
                let own = modes.iter().filter(|mode| mode.whirl == whirl).nth(k);
                let value = own.map_or(f64::NAN, |mode| unit * frequency(typed.frame, mode, *speed));
                [rotor.shown_speed(*speed), value]
            };
            let points: Vec<[f64; 2]> = rows.iter().map(at).collect();
            let layer = Layer::curve(&points, colour);
            if !layer.is_empty() {
                layers.push(if k == 0 { layer.named(whirl.name()) } else { layer });
            }
        }
    }
    let synchronous = |speed: f64| if typed.frame == Frame::Fixed { unit * speed } else { 0.0 };
    let highest =
        rows.iter().flat_map(|(speed, modes)| modes.iter().map(|own| unit * frequency(typed.frame, own, *speed)));
    let highest = highest.fold(0.0, f64::max);
    let line: Vec<[f64; 2]> = rows.iter().map(|(speed, _)| [rotor.shown_speed(*speed), synchronous(*speed)]).collect();
    let line: Vec<[f64; 2]> = line.into_iter().filter(|at| at[1] <= 1.05 * highest || at[1] == 0.0).collect();
    layers.push(Layer::curve(&line, palette::GREY).dashed().named("synchronous"));
    let y = Axis::new(label(
        if typed.frame == Frame::Fixed { "frequency" } else { "frequency in the rotating frame" },
        &typed.frequency,
    ));
    let panel = Panel {
        legend: LegendPlace::Beside,
        height: 460.0,
        ..Panel::new("", "", Axis::new(label(&name, &speed_unit)), y).with_all(layers)
    };
    figure_svg(&Figure { panels: vec![panel], width: 820.0, ..Figure::default() })
}

/// Prints the shapes of the modes at the speed of the model: one row for each mode and station.
fn shapes(typed: &Typed, rotor: &Loaded, unit: f64) -> Result<Outcome, Failure> {
    let linear = rotor.machine.linear(&rotor.parameters);
    let found = linear.spectrum(typed.modes as usize, true).ok_or_else(|| uncomputed("the modes"))?;
    note(&found.overdamped, rotor, linear.speed)?;
    let modes = found.modes;
    let parts = &rotor.machine.assembled.rotor;
    let mut columns = mode_columns(&typed.frequency);
    columns.push(Column::new("node", Style::Word));
    columns.push(Column::in_unit("position", Style::Number, "m"));
    for name in ["x", "phase_x", "y", "phase_y"] {
        columns.push(Column::in_unit(name, Style::Number, if name.starts_with("phase") { "deg" } else { "" }));
    }
    let mut rows = Vec::new();
    for (k, mode) in modes.iter().enumerate() {
        for (s, station) in parts.stations.iter().enumerate() {
            let first = parts.first(s);
            let mut row = mode_cells(typed.frame, k, mode, linear.speed, unit);
            row.push(Cell::Word(station.name.clone()));
            row.push(station.position.map_or(Cell::Empty, Cell::Number));
            for z in &mode.shape[first..first + 2] {
                row.extend([Cell::Number(z.norm()), Cell::Number(z.arg().to_degrees())]);
            }
            rows.push(row);
        }
    }
    let mut out = BufWriter::new(stdout().lock());
    write(&Table { columns, rows }, typed.format, &mut out)?;
    out.flush()?;
    Ok(Outcome::Done)
}
