//! Commands for rotors: Campbell diagram, critical speeds, unbalance response, and what `check` says about a rotor.

pub mod campbell;
pub mod check;
pub mod critical;
pub mod unbalance;

use crate::arguments::{Format, Speeds};
use crate::failure::Failure;
use crate::values::{measured, parameters};
use crate::verbosity::report;
use foldline::model::Model;
use foldline::units::Unit;
use foldline_shaft::Machine;
use foldline_store::model_file::read_rotor;
use std::path::Path;

/// Rotor with parameter values.
pub struct Loaded {
    pub model: Model,
    pub machine: Machine,
    pub parameters: Vec<f64>,
}

/// Reads a model that describes a rotor, and says which of its forces a linear analysis leaves out.
pub fn load(file: &Path, set: &[String]) -> Result<Loaded, Failure> {
    let (model, machine) = read_rotor(file)?;
    let Some(machine) = machine else {
        return Err(Failure::typed(
            format!("{}: the model has no section [rotor]", file.display()),
            "this command is for rotors of shafts, discs and bearings; see `[rotor]` in the chapter on rotors of the book",
        ));
    };
    let parameters = parameters(set, &model)?;
    let rotor = &machine.assembled.rotor;
    let mut left: Vec<String> = rotor.contacts.iter().map(|own| format!("the ring `{}`", own.name)).collect();
    left.extend(rotor.films.iter().map(|own| format!("the film `{}`", own.name)));
    left.extend(rotor.forces.iter().map(|own| format!("the force at {}", rotor.called(own.at))));
    if !left.is_empty() {
        report(format_args!("note: linear rotor, without {}", left.join(", ")))?;
    }
    Ok(Loaded { model, machine, parameters })
}

impl Loaded {
    /// Name and unit of the speed: those of its parameter, or rad/s.
    pub fn speed_label(&self) -> (String, String) {
        match self.machine.speed_parameter() {
            Some((index, _)) => {
                let own = &self.model.parameters[index];
                let unit = if own.unit == "1" { "rad/s".to_string() } else { own.unit.clone() };
                (own.name.clone(), unit)
            }
            None => ("speed".into(), "rad/s".into()),
        }
    }

    /// A speed in rad/s in the unit of the speed.
    pub fn shown_speed(&self, speed: f64) -> f64 {
        speed / self.machine.speed_parameter().map_or(1.0, |(_, factor)| factor)
    }

    /// Speeds in rad/s.
    pub fn speeds(&self, typed: &Speeds, count: usize) -> Result<Vec<f64>, Failure> {
        let Some((index, factor)) = self.machine.speed_parameter() else {
            let cure = "write `speed = \"Omega\"` in [rotor] and give Omega under [parameters]";
            return Err(Failure::typed("the speed of the rotor is not a parameter, so it cannot vary", cure));
        };
        let [low, high] = match &typed.speeds {
            None => [0.0, 2.0 * self.parameters[index]],
            Some(text) => self.range(text)?,
        };
        let count = typed.count.map_or(count, |count| count as usize);
        let step = (high - low) / (count - 1) as f64;
        Ok((0..count).map(|k| factor * if k + 1 == count { high } else { low + step * k as f64 }).collect())
    }

    /// Parses `LOW:HIGH`, in the unit of the speed; a unit after the second number applies to both.
    fn range(&self, text: &str) -> Result<[f64; 2], Failure> {
        let (_, unit) = self.speed_label();
        let said = || {
            let cure = format!("give two speeds in {unit} or with a unit, as in --speeds \"0:6000 rpm\"");
            Failure::typed(format!("--speeds {text}: not a range of speeds"), cure)
        };
        let (low, high) = text.split_once(':').ok_or_else(said)?;
        let ending = high.trim().trim_start_matches(|c: char| c.is_ascii_digit() || "+-.eE_".contains(c)).trim();
        let both = if low.trim().parse::<f64>().is_ok() { format!("{} {ending}", low.trim()) } else { low.to_string() };
        let ends = [measured(both.trim(), &unit), measured(high, &unit)];
        match ends {
            [Some(low), Some(high)] if low < high => Ok([low, high]),
            _ => Err(said()),
        }
    }
}

/// Number of rows without `--count`.
pub fn usual_count(format: Format, drawn: bool) -> usize {
    if format == Format::Text && !drawn { 11 } else { 101 }
}

/// Factor from a SI unit to one given on the command line.
pub fn scale(option: &str, unit: &str, from: &str) -> Result<f64, Failure> {
    Unit::read(from).convert(1.0, &Unit::read(unit)).map_err(|why| {
        Failure::typed(
            format!("--{option} {unit}: {from} cannot be converted to it: {why}"),
            format!("give a unit of the same kind as {from}"),
        )
    })
}

/// Reason why a result is missing.
pub fn uncomputed(what: &str) -> Failure {
    Failure::Outside(format!(
        "{what} could not be computed: an eigenvalue problem did not converge, or a coefficient is not finite"
    ))
}
