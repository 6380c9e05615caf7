//! `foldline critical-speeds`: undamped and damped critical speeds, and resonances in the rotating frame.

use super::{load, uncomputed};
use crate::arguments::CriticalSpeeds as Typed;
use crate::failure::{Failure, Outcome};
use crate::table::{Cell, Column, Style, Table, write};
use crate::verbosity::report;
use std::f64::consts::TAU;
use std::io::{BufWriter, Write, stdout};

/// Prints the critical speeds.
pub fn print(typed: &Typed) -> Result<Outcome, Failure> {
    let rotor = load(&typed.model, &typed.set)?;
    let ratios = typed.ratio.iter().map(|text| ratio(text)).collect::<Result<Vec<_>, _>>()?;
    if rotor.machine.speed_parameter().is_none() {
        report(format_args!("note: the speed is not a parameter; coefficients are those at the speed of the model"))?;
    }
    let found = rotor.machine.critical_speeds(&rotor.parameters, typed.count as usize);
    let found = found.ok_or_else(|| uncomputed("the critical speeds"))?;
    let unit = rotor.speed_label().1;
    let columns = vec![
        Column::new("kind", Style::Word),
        Column::new("whirl", Style::Word),
        Column::in_unit("undamped", Style::Number, &unit),
        Column::in_unit("damped", Style::Number, &unit),
        Column::new("log_decrement", Style::Number),
    ];
    let mut rows: Vec<Vec<Cell>> = Vec::new();
    for own in &found {
        let (damped, decrement) = match own.damped {
            Some((speed, value)) => (Cell::Number(rotor.shown_speed(speed)), Cell::Number(-TAU * value.re / value.im)),
            None => (Cell::Empty, Cell::Empty),
        };
        let undamped = Cell::Number(rotor.shown_speed(own.undamped));
        rows.push(vec![
            Cell::Word("critical".into()),
            Cell::Word(own.whirl.name().into()),
            undamped,
            damped,
            decrement,
        ]);
    }
    let highest = found.iter().map(|own| own.undamped).fold(0.0, f64::max);
    let mut short = Vec::new();
    for (text, ratio) in typed.ratio.iter().zip(ratios) {
        let speeds = rotor.machine.resonances(&rotor.parameters, ratio, [1e-6 * highest, highest]);
        if speeds.is_empty() {
            short.push(format!("no speed up to the highest critical one has the ratio {text}"));
        }
        rows.extend(speeds.into_iter().map(|speed| {
            let undamped = Cell::Number(rotor.shown_speed(speed));
            vec![Cell::Word(text.clone()), Cell::Empty, undamped, Cell::Empty, Cell::Empty]
        }));
    }
    let mut out = BufWriter::new(stdout().lock());
    write(&Table { columns, rows }, typed.format, &mut out)?;
    out.flush()?;
    for own in found.iter().filter(|own| !own.settled) {
        let speed = rotor.shown_speed(own.undamped);
        short.push(format!(
            "the critical speed near {speed} {unit} did not settle: coefficients change too much with the speed"
        ));
    }
    short.iter().try_for_each(|line| writeln!(std::io::stderr(), "incomplete: {line}"))?;
    Ok(if short.is_empty() { Outcome::Done } else { Outcome::Short })
}

/// Parses `N:M`.
fn ratio(text: &str) -> Result<[f64; 2], Failure> {
    let parts: Vec<Option<u32>> = text.split(':').map(|part| part.trim().parse().ok()).collect();
    match parts[..] {
        [Some(n @ 1..), Some(m @ 1..)] if n != m => Ok([f64::from(n), f64::from(m)]),
        _ => Err(Failure::typed(format!("--ratio {text}: not two different positive integers"), "write --ratio 2:1")),
    }
}
