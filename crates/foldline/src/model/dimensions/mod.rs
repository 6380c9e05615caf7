//! Check of units through the equations of a model.
//!
//! **Idea.** Every quantity has a unit: the declared one, or an unknown that the equations determine if they can. Each
//! sum, comparison and equation states that two units are equal. These are linear equations in the exponents of the
//! base units and in the logarithm of the factor, solved one after the other by elimination; one that cannot hold is an
//! error.
//!
//! **Equations.** For units of the form e^s Π bᵢ^aᵢ, with base units bᵢ and unknown units among them:
//!
//! 1. unit of u·v: sum of (s, a); of u^n: n times (s, a)
//! 2. u + v, u < v, dx/dt = f(x): unit of u - unit of v = 0, dt having the unit of time
//!
//! **Source.** kennedy1997 for the exponents.
//!
//! **Departures.** A number written in a formula is dimensionless if that makes the equations consistent. Otherwise it
//! may be a conversion factor: in `x' = 1000*v` the number implies that x is in mm and v in m/s, and in `2*pi*n/60` the
//! numbers turn rpm into rad/s. If the dimensions differ and a number of the formula could carry the difference, as 40
//! in `v + 40`, it is assumed to, and the report names it. The exponent of a power may be a parameter; its value is
//! that of the model. The unit of time is the declared unit of time that leaves the fewest errors, seconds first. A
//! contradiction is an error if it follows from declared units alone. If the unit of some quantity was inferred, it is
//! a doubt: a mass of 1 left out, as in `v' = -k*x`, is not an error in a model that states only some of its units.
//!
//! **Fails when** two wrong factors compensate, or a number happens to explain a missing factor.

mod form;
mod names;
mod system;
#[cfg(test)]
mod tests;
mod walk;

use super::callable::Callables;
use super::error::{Field, Item, ModelError};
use super::family::Layout;
use super::function::CONSTANTS;
use super::parser::Expression;
use super::scope::{Scope, Symbol, Symbols};
use super::source::{Ends, ModelSource};
use crate::units::Unit;
use form::Form;
use names::Names;
use std::cell::Cell;
use std::collections::BTreeSet;
pub use system::TAKEN_AS;
use system::{Finding, Severity, System};
use walk::Walk;

/// Units of time tried if the declared units name none.
const TIMES: [&str; 6] = ["s", "ms", "us", "min", "h", "d"];

/// Result of a check of units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnitReport {
    /// Contradictions.
    pub errors: Vec<ModelError>,
    /// Positions at which a number may or may not be the missing factor.
    pub doubts: Vec<ModelError>,
    /// Numbers in formulas that stand for quantities with a unit: the position, and in `message` the number and unit.
    pub numbers: Vec<ModelError>,
    /// Unknown unit names, each treated as a base unit.
    pub foreign: Vec<String>,
    /// Unit of time, if the equations or the model determine it.
    pub time: Option<String>,
}

/// Checks the units of a model that compiles; `declared` is true for items that state a unit.
///
/// ```
/// use foldline::model::{Definition, Item, ModelSource, State, check_units};
/// let state = |name: &str, unit: &str| State { unit: unit.into(), ..State::new(name) };
/// let source = ModelSource {
///     states: vec![state("x", "m"), state("v", "kg")],
///     equations: vec![Definition::new("x", "v"), Definition::new("v", "0")],
///     ..ModelSource::default()
/// };
/// let report = check_units(&source, &|item| matches!(item, Item::State(_)));
/// assert!(report.errors[0].message.contains("m/s") && report.errors[0].message.contains("kg"));
/// ```
pub fn check_units(source: &ModelSource, declared: &dyn Fn(Item) -> bool) -> UnitReport {
    let units = Units::of(source, declared);
    let foreign = units.foreign();
    if units.declared.is_empty() {
        let time = Some(source.time.clone()).filter(|time| !time.is_empty());
        return UnitReport { time, ..UnitReport::default() };
    }
    let mut best: Option<UnitReport> = None;
    for time in units.times(source) {
        let report = checked(source, &units, &time);
        let mistakes = |report: &UnitReport| [report.errors.len(), report.doubts.len(), report.numbers.len()];
        if best.as_ref().is_none_or(|best| mistakes(&report) < mistakes(best)) {
            best = Some(report);
        }
    }
    UnitReport { foreign, ..best.unwrap_or_default() }
}

/// Declared units of a model.
struct Units {
    declared: Vec<(Item, String, Unit)>,
}

impl Units {
    fn of(source: &ModelSource, declared: &dyn Fn(Item) -> bool) -> Units {
        let parameters = source.parameters.iter().enumerate().map(|(i, p)| (Item::Parameter(i), &p.unit));
        let states = source.states.iter().enumerate().map(|(i, s)| (Item::State(i), &s.unit));
        let outputs = source.outputs.iter().enumerate().map(|(i, o)| (Item::Output(i), &o.unit));
        let constants = source.constants.iter().enumerate().map(|(i, c)| (Item::Constant(i), &c.unit));
        let all = parameters.chain(states).chain(outputs).chain(constants).filter(|(item, _)| declared(*item));
        Units { declared: all.map(|(item, text)| (item, text.clone(), Unit::read(text))).collect() }
    }

    fn get(&self, item: Item) -> Option<&Unit> {
        self.declared.iter().find(|(own, ..)| *own == item).map(|(.., unit)| unit)
    }

    fn foreign(&self) -> Vec<String> {
        let names: BTreeSet<String> =
            self.declared.iter().flat_map(|(.., u)| u.foreign().map(str::to_string)).collect();
        names.into_iter().collect()
    }

    /// Candidate units of time.
    fn times(&self, source: &ModelSource) -> Vec<String> {
        if !source.time.is_empty() {
            return vec![source.time.clone()];
        }
        let mut times: Vec<String> = Vec::new();
        if self.declared.iter().all(|(.., unit)| unit.is_number()) {
            // If all declared units are dimensionless, time may be dimensionless too.
            times.push("1".into());
        }
        times.push("s".into());
        let written: BTreeSet<&String> = self.declared.iter().flat_map(|(.., unit)| &unit.times).collect();
        match written.is_empty() {
            true => times.extend(TIMES.map(String::from)),
            false => times.extend(written.into_iter().cloned()),
        }
        times
    }
}

fn parse(text: &str, callables: &Callables) -> Expression {
    // The model compiles, so every expression can be parsed.
    Expression::parse(text, callables).unwrap_or_default()
}

fn checked(source: &ModelSource, units: &Units, time: &str) -> UnitReport {
    let callables = Callables::new(source);
    let functions: Vec<Option<Expression>> =
        source.functions.iter().map(|f| Some(parse(&f.expression, &callables))).collect();
    let arguments: Vec<Vec<String>> = source.functions.iter().map(|f| f.arguments.clone()).collect();
    let pure = |i: usize| units.get(Item::Constant(i)).is_none();
    let constants = source.constants.iter().enumerate();
    let mut numbers: Symbols = CONSTANTS.into_iter().map(|(name, value)| (name, Symbol::Number(value))).collect();
    numbers.extend(constants.filter(|(i, _)| pure(*i)).map(|(_, c)| (c.name.as_str(), Symbol::Number(c.value))));
    let mut defaults = numbers.clone();
    defaults.extend(source.parameters.iter().map(|p| (p.name.as_str(), Symbol::Number(p.value))));
    defaults.extend(source.constants.iter().map(|c| (c.name.as_str(), Symbol::Number(c.value))));
    let layout = Layout::default();
    let scope =
        |symbols| Scope { symbols, layout: &layout, functions: &functions, arguments: &arguments, spent: Cell::new(0) };
    let mut system = System::new(units, time);
    let names = Names::new(source, units, time, &mut system);
    let (numbers, defaults) = (scope(&numbers), scope(&defaults));
    let mut walk = Walk { source, names, system, functions: &functions, numbers, defaults, spent: 0 };
    equations(&mut walk, &callables, units);
    let Walk { system, .. } = walk;
    report(source, system, time)
}

/// Adds every expression of the model, and the quantity it must equal.
fn equations(walk: &mut Walk, callables: &Callables, units: &Units) {
    let source = walk.source;
    for (i, own) in source.definitions.iter().enumerate() {
        let item = Item::Definition(i);
        let form = walk.form(item, Field::Expression, &own.expression, callables);
        let goal = walk.names.of(&own.name);
        if !walk.system.define(&goal, &form, &format!("from the definition of `{}`", own.name)) {
            walk.equal(item, Field::Expression, &own.expression, form, goal, &format!("`{}`", own.name));
        }
        ends(walk, item, &own.name, &own.repeat, callables);
    }
    if let Some(own) = &source.forcing {
        let form = walk.form(Item::Forcing, Field::Expression, &own.expression, callables);
        let goal = match own.is_frequency {
            true => Form::radian().plus(&walk.names.time(), -1.0),
            false => walk.names.time(),
        };
        let what = if own.is_frequency {
            "the frequency of the forcing, an angular one,"
        } else {
            "the period of the forcing"
        };
        walk.equal(Item::Forcing, Field::Expression, &own.expression, form, goal, what);
    }
    let masses: Vec<(Form, &super::source::Mass, usize)> = source
        .mass
        .iter()
        .enumerate()
        .map(|(i, own)| (walk.form(Item::Mass(i), Field::Expression, &own.expression, callables), own, i))
        .collect();
    for (i, own) in source.equations.iter().enumerate() {
        let item = Item::Equation(i);
        let form = walk.form(item, Field::Expression, &own.expression, callables);
        let time = walk.names.time();
        let per = if source.map { 0.0 } else { -1.0 };
        let rate = |walk: &Walk, name: &str| walk.names.of(name).plus(&time, per);
        let rows: Vec<_> = masses.iter().filter(|(_, mass, _)| mass.row == own.name).collect();
        for (mass, entry, k) in &rows {
            let goal = mass.plus(&rate(walk, &entry.column), 1.0);
            let what = format!("the mass times the rate of `{}`", entry.column);
            let (item, text) =
                if entry.column == entry.row { (item, &own.expression) } else { (Item::Mass(*k), &entry.expression) };
            walk.equal(item, Field::Expression, text, form.clone(), goal, &what);
        }
        if rows.is_empty() {
            let goal = rate(walk, &own.name);
            walk.equal(item, Field::Expression, &own.expression, form, goal, &format!("the rate of `{}`", own.name));
        }
    }
    for (i, own) in source.states.iter().enumerate() {
        ends(walk, Item::State(i), &own.name, &own.repeat, callables);
    }
    for (i, own) in source.parameters.iter().enumerate() {
        ends(walk, Item::Parameter(i), &own.name, &own.repeat, callables);
    }
    for (i, own) in source.outputs.iter().enumerate() {
        let item = Item::Output(i);
        let form = walk.form(item, Field::Expression, &own.expression, callables);
        if let Some(unit) = units.get(item) {
            let goal = Form::of(unit);
            walk.equal(item, Field::Expression, &own.expression, form, goal, &format!("the output `{}`", own.name));
        }
    }
}

/// Requires values beyond the ends of a repeated quantity to have its unit.
fn ends(walk: &mut Walk, item: Item, name: &str, repeat: &Option<super::source::Repeat>, callables: &Callables) {
    let Some(Ends::Given { before, after }) = repeat.as_ref().map(|repeat| &repeat.ends) else { return };
    let before = before.iter().enumerate().map(|(k, text)| (Field::Before(k), text));
    let after = after.iter().enumerate().map(|(k, text)| (Field::After(k), text));
    for (field, text) in before.chain(after) {
        let form = walk.form(item, field, text, callables);
        let goal = walk.names.of(name);
        walk.equal(item, field, text, form, goal, &format!("`{name}`"));
    }
}

fn report(source: &ModelSource, system: System, time: &str) -> UnitReport {
    let (uses_time, findings) = (system.uses_time, system.findings);
    let mut report = UnitReport::default();
    for Finding { severity, item, field, span, message, hint } in findings {
        let name = super::check::name_of(source, item).to_string();
        let error = ModelError { item, field, name, span: Some(span), message, hint };
        let list = match severity {
            Severity::Error => &mut report.errors,
            Severity::Doubt => &mut report.doubts,
            Severity::Number => &mut report.numbers,
        };
        if !list.contains(&error) {
            list.push(error);
        }
    }
    let stated = !source.time.is_empty();
    report.time = (stated || uses_time && time != "1").then(|| time.to_string());
    report
}
