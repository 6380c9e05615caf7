//! Derivatives of all special points of a diagram, as a list with names.

use super::uncertainty::{Uncertainty, uncertainty};
use super::{Derivative, Measured, Sensitivities, of_point, of_special, unavailable};
use crate::diagram::{Branch, Diagram, Kind, SpecialPoint};
use crate::explore::System;
use crate::explore::plan::Plan;
use crate::model::{Model, Spread};

impl Measured {
    /// Name of the number: that of the parameter `free`, `period`, `angle`, or `NAME_min` and `NAME_max` of a state or
    /// output.
    pub fn name(self, model: &Model, free: usize) -> String {
        let channel = |k: usize| match k.checked_sub(model.states.len()) {
            None => model.states[k].name.clone(),
            Some(output) => model.outputs.get(output).map_or_else(String::new, |own| own.name.clone()),
        };
        match self {
            Measured::Parameter => model.parameters.get(free).map_or_else(String::new, |own| own.name.clone()),
            Measured::Period => "period".into(),
            Measured::Angle => "angle".into(),
            Measured::Smallest(k) => format!("{}_min", channel(k)),
            Measured::Largest(k) => format!("{}_max", channel(k)),
        }
    }

    /// Unit of the number; empty if it has none.
    pub fn unit(self, model: &Model, free: usize) -> String {
        match self {
            Measured::Parameter => model.parameters.get(free).map_or_else(String::new, |own| own.unit.clone()),
            Measured::Period => model.time.clone(),
            Measured::Angle => "rad".into(),
            Measured::Smallest(k) | Measured::Largest(k) => model.channel_unit(k).into(),
        }
    }

    /// True for the numbers that describe the special point itself, not the size of the solution.
    pub fn is_main(self) -> bool {
        matches!(self, Measured::Parameter | Measured::Period | Measured::Angle)
    }
}

/// A special point with what was found about it.
#[derive(Clone, Debug)]
pub struct Listed<T> {
    /// Name of the branch.
    pub branch: String,
    /// Index of the special point on the branch.
    pub number: usize,
    /// Its kind.
    pub kind: Kind,
    /// Index of the parameter of the branch.
    pub free: usize,
    /// Value of that parameter.
    pub at: f64,
    /// Values of all parameters.
    pub parameters: Vec<f64>,
    /// The result, or the reason why there is none.
    pub found: Result<T, String>,
    /// True if points of this kind have no derivatives by their nature, which is not a failure.
    pub expected: bool,
}

/// Returns the sensitivities of all special points on the branches for which `kept` is true.
pub fn sensitivities(
    system: &System,
    diagram: &Diagram,
    plan: &Plan,
    kept: &dyn Fn(&Branch) -> bool,
) -> Vec<Listed<Sensitivities>> {
    listed(system, diagram, kept, |system, branch, special| of_special(system, branch, special, plan))
}

/// Returns the uncertainties of all special points on the branches for which `kept` is true.
pub fn uncertainties(
    system: &System,
    diagram: &Diagram,
    plan: &Plan,
    spreads: &[(usize, Spread)],
    samples: usize,
    kept: &dyn Fn(&Branch) -> bool,
) -> Vec<Listed<Uncertainty>> {
    listed(system, diagram, kept, |system, branch, special| {
        uncertainty(system, branch, special, plan, spreads, samples)
    })
}

fn listed<T>(
    system: &System,
    diagram: &Diagram,
    kept: &dyn Fn(&Branch) -> bool,
    find: impl Fn(&System, &Branch, &SpecialPoint) -> Result<T, String>,
) -> Vec<Listed<T>> {
    let system = system.clone().in_units_of(diagram);
    let mut all = Vec::new();
    for branch in diagram.branches.iter().filter(|branch| kept(branch)) {
        for (number, special) in branch.special.iter().enumerate() {
            all.push(Listed {
                branch: branch.name.clone(),
                number,
                kind: special.kind,
                free: branch.free,
                at: special.point.parameters.get(branch.free).copied().unwrap_or(f64::NAN),
                parameters: special.point.parameters.clone(),
                found: find(&system, branch, special),
                expected: unavailable(&system, branch, special).is_some(),
            });
        }
    }
    all
}

/// One derivative with all names.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Name of the branch.
    pub branch: String,
    /// Index of the special point on the branch.
    pub number: usize,
    /// Kind of the special point; `None` for another solution.
    pub kind: Option<Kind>,
    /// Name of the parameter of the branch.
    pub free: String,
    /// Value of that parameter.
    pub at: f64,
    /// Name of the number; empty if the point has no derivatives.
    pub quantity: String,
    /// Unit of the number.
    pub unit: String,
    /// Value of the number.
    pub value: f64,
    /// Name of the parameter that changes.
    pub parameter: String,
    /// Unit of that parameter.
    pub per: String,
    /// The derivative, or the reason why there is none.
    pub found: Result<Derivative, String>,
    /// (p/q) dq/dp: percentage by which the number changes if the parameter changes by one per cent; `None` if one of them
    /// is 0, or the error exceeds 0.1 %.
    pub elasticity: Option<f64>,
}

impl Entry {
    /// An entry of a solution without names of a number and a parameter.
    fn at(branch: &str, number: usize, kind: Option<Kind>, model: &Model, free: usize, at: f64) -> Entry {
        Entry {
            branch: branch.into(),
            number,
            kind,
            free: model.parameters.get(free).map_or_else(String::new, |own| own.name.clone()),
            at,
            quantity: String::new(),
            unit: String::new(),
            value: f64::NAN,
            parameter: String::new(),
            per: String::new(),
            found: Err(String::new()),
            elasticity: None,
        }
    }

    /// The derivatives of a solution one by one, with the branch of this entry.
    fn each(
        &self,
        found: &Sensitivities,
        model: &Model,
        (free, parameters): (usize, &[f64]),
        wanted: &dyn Fn(Measured, &str) -> bool,
    ) -> Vec<Entry> {
        let mut entries = Vec::new();
        for row in &found.rows {
            let quantity = row.of.name(model, free);
            if !wanted(row.of, &quantity) {
                continue;
            }
            for (index, derivative) in found.parameters.iter().zip(&row.by) {
                let p = parameters.get(*index).copied().unwrap_or(0.0);
                // A number that is zero within rounding has none.
                let known = derivative.as_ref().ok().filter(|own| {
                    (own.error * p / row.value).abs() <= 1e-3 * (own.value * p / row.value).abs().max(1.0)
                });
                let elasticity = known.map(|own| own.value * p / row.value);
                entries.push(Entry {
                    quantity: quantity.clone(),
                    unit: row.of.unit(model, free),
                    value: row.value,
                    parameter: model.parameters[*index].name.clone(),
                    per: model.parameters[*index].unit.clone(),
                    found: derivative.clone(),
                    elasticity: elasticity.filter(|share| share.is_finite() && p != 0.0),
                    ..self.clone()
                });
            }
        }
        entries
    }
}

/// Returns the derivatives at special points one by one, of the numbers whose names are requested; an entry without names where
/// a special point has none.
pub fn entries(all: &[Listed<Sensitivities>], model: &Model, wanted: &dyn Fn(Measured, &str) -> bool) -> Vec<Entry> {
    let of = |point: &Listed<Sensitivities>| {
        let empty = Entry::at(&point.branch, point.number, Some(point.kind), model, point.free, point.at);
        match &point.found {
            Ok(found) => empty.each(found, model, (point.free, &point.parameters), wanted),
            Err(reason) => vec![Entry { found: Err(reason.clone()), ..empty }],
        }
    };
    all.iter().flat_map(of).collect()
}

/// Returns the derivatives at the solution with that position on a branch one by one, of the numbers whose names are requested.
///
/// # Errors
/// The reason why there are none.
pub fn at_position(
    system: &System,
    diagram: &Diagram,
    plan: &Plan,
    (branch, position): (&Branch, i64),
    model: &Model,
    wanted: &dyn Fn(Measured, &str) -> bool,
) -> Result<Vec<Entry>, String> {
    let system = system.clone().in_units_of(diagram);
    let point = branch.points.iter().find(|point| point.position == position);
    let point = point.ok_or_else(|| format!("the branch {} has no point {position}", branch.name))?;
    let found = of_point(&system, branch, point, plan)?;
    let at = point.parameters.get(branch.free).copied().unwrap_or(f64::NAN);
    let empty = Entry::at(&branch.name, 0, None, model, branch.free, at);
    Ok(empty.each(&found, model, (branch.free, &point.parameters), wanted))
}
