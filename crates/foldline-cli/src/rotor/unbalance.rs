//! `foldline unbalance-response`: amplitudes as functions of the speed.

use super::{Loaded, load, scale, usual_count};
use crate::arguments::UnbalanceResponse as Typed;
use crate::failure::{Failure, Outcome};
use crate::plot::picture;
use crate::table::{Cell, Column, Style, Table, write};
use crate::values::measured;
use foldline_plot::{Axis, Figure, Layer, LegendPlace, Panel, figure_svg, palette};
use foldline_shaft::Orbit;
use std::io::{BufWriter, Write, stdout};

/// Station, and direction of the probe if it has one.
struct Probe {
    station: usize,
    angle: Option<f64>,
    name: String,
}

/// Prints or draws the response to unbalance.
pub fn print(typed: &Typed) -> Result<Outcome, Failure> {
    let rotor = load(&typed.model, &typed.set)?;
    if rotor.machine.assembled.rotor.unbalances.is_empty() {
        let cure = "add `[[unbalance]]` with `node` and `amount`";
        return Err(Failure::typed("the rotor has no unbalance", cure));
    }
    let unit = scale("amplitude", &typed.amplitude, "m")?;
    let probes = probes(typed, &rotor)?;
    let stations: Vec<usize> = probes.iter().map(|own| own.station).collect();
    let speeds = rotor.speeds(&typed.speeds, usual_count(typed.format, typed.output.is_some()))?;
    let found = rotor.machine.unbalance_response(&rotor.parameters, &speeds, &stations);
    if let Some(file) = &typed.output {
        picture(&figure(typed, &rotor, &probes, &speeds, &found, unit), file)?;
        return Ok(Outcome::Done);
    }
    let mut out = BufWriter::new(stdout().lock());
    write(&table(typed, &rotor, &probes, &speeds, &found, unit), typed.format, &mut out)?;
    out.flush()?;
    Ok(Outcome::Done)
}

/// Probes asked for; by default the nodes with discs, else the last node.
fn probes(typed: &Typed, rotor: &Loaded) -> Result<Vec<Probe>, Failure> {
    let parts = &rotor.machine.assembled.rotor;
    if typed.probe.is_empty() {
        let mut stations: Vec<usize> = parts.discs.iter().map(|own| own.at).collect();
        if stations.is_empty() {
            stations.push(parts.nodes - 1);
        }
        stations.dedup();
        let probe = |station: usize| Probe { station, angle: None, name: parts.stations[station].name.clone() };
        return Ok(stations.into_iter().map(probe).collect());
    }
    let one = |text: &String| {
        let (name, angle) = text.split_once(':').map_or((text.as_str(), None), |(name, angle)| (name, Some(angle)));
        let station = parts.stations.iter().position(|own| own.name == name.trim());
        let station = station.ok_or_else(|| {
            let names: Vec<&str> = parts.stations.iter().map(|own| own.name.as_str()).collect();
            Failure::typed(
                format!("--probe {text}: there is no node {name}"),
                format!("the nodes are {}", names.join(", ")),
            )
        })?;
        let angle = match angle {
            None => None,
            Some(angle) => Some(measured(angle, "rad").ok_or_else(|| {
                Failure::typed(format!("--probe {text}: {angle} is not an angle"), "write --probe 6:45deg")
            })?),
        };
        Ok(Probe { station, angle, name: text.clone() })
    };
    typed.probe.iter().map(one).collect()
}

fn table(typed: &Typed, rotor: &Loaded, probes: &[Probe], speeds: &[f64], found: &[Vec<Orbit>], unit: f64) -> Table {
    let (name, speed_unit) = rotor.speed_label();
    let mut columns = vec![Column::in_unit(&name, Style::Number, &speed_unit), Column::new("node", Style::Word)];
    let directed = probes.iter().any(|own| own.angle.is_some());
    let size = |name: &str| Column::in_unit(name, Style::Number, &typed.amplitude);
    let phase = |name: &str| Column::in_unit(name, Style::Number, "deg");
    if directed {
        columns.extend([size("probe"), phase("phase")]);
    }
    columns.extend([size("x"), phase("phase_x"), size("y"), phase("phase_y"), size("major"), size("minor")]);
    let mut rows = Vec::new();
    for (speed, orbits) in speeds.iter().zip(found) {
        for (probe, orbit) in probes.iter().zip(orbits) {
            let mut row = vec![Cell::Number(rotor.shown_speed(*speed)), Cell::Word(probe.name.clone())];
            let polar = |z: num_complex::Complex64| [Cell::Number(unit * z.norm()), Cell::Number(z.arg().to_degrees())];
            if directed {
                row.extend(probe.angle.map_or([Cell::Empty, Cell::Empty], |angle| polar(orbit.along(angle))));
            }
            row.extend(polar(orbit.x));
            row.extend(polar(orbit.y));
            row.extend([Cell::Number(unit * orbit.major()), Cell::Number(unit * orbit.minor())]);
            rows.push(row);
        }
    }
    Table { columns, rows }
}

fn figure(typed: &Typed, rotor: &Loaded, probes: &[Probe], speeds: &[f64], found: &[Vec<Orbit>], unit: f64) -> String {
    let (name, speed_unit) = rotor.speed_label();
    let size =
        |k: usize, orbit: &Orbit| unit * probes[k].angle.map_or(orbit.major(), |angle| orbit.along(angle).norm());
    let layer = |k: usize| {
        let at = |(speed, orbits): (&f64, &Vec<Orbit>)| [rotor.shown_speed(*speed), size(k, &orbits[k])];
        let points: Vec<[f64; 2]> = speeds.iter().zip(found).map(at).collect();
        Layer::curve(&points, palette::nth(k)).named(format!("node {}", probes[k].name))
    };
    let rings = rotor.machine.rings(&rotor.parameters);
    let clearances = rings.iter().filter(|ring| probes.iter().any(|own| own.station == ring.1));
    let lines = clearances.map(|ring| Layer::horizontal(unit * ring.2).named(format!("clearance of {}", ring.0)));
    let x = Axis::new(format!("{} [{speed_unit}]", foldline_plot::quantity::with_greek(&name)));
    let y = Axis::new(format!("largest amplitude [{}]", typed.amplitude)).log();
    let panel = Panel {
        legend: LegendPlace::Beside,
        height: 420.0,
        ..Panel::new("", "", x, y).with_all((0..probes.len()).map(layer)).with_all(lines)
    };
    figure_svg(&Figure { panels: vec![panel], width: 820.0, ..Figure::default() })
}
