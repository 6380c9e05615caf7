//! Equations between units, solved one after the other.

use super::Units;
use super::form::{Form, Key, short};
use crate::model::error::{Field, Item};
use crate::units::Unit;
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// Factors whose logarithms are closer than this are equal: they are products of decimals and π.
const SAME_FACTOR: f64 = 1e-9;
/// Maximum number of numbers in one equation searched for conversion factors: all subsets are tried.
const MOST_NUMBERS: usize = 12;
/// Units used to report contradictions if no declared one fits.
const TOLD: [&str; 26] = [
    "m", "kg", "s", "m/s", "m/s^2", "N", "N m", "N/m", "N s/m", "kg m^2", "J", "W", "Pa", "V", "A", "C", "F", "Ohm",
    "S", "H", "1/s", "rad/s", "mol/l", "ms", "mV", "1/ms",
];

/// Text between a number and the quantity it is taken for.
pub const TAKEN_AS: &str = " is taken as ";

/// Severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Severity {
    Error,
    Doubt,
    Number,
}

#[derive(Clone, Debug)]
pub(super) struct Finding {
    pub severity: Severity,
    pub item: Item,
    pub field: Field,
    pub span: Range<usize>,
    pub message: String,
    pub hint: String,
}

/// Position in the model.
#[derive(Clone, Debug)]
pub(super) struct Place {
    pub item: Item,
    pub field: Field,
    pub span: Range<usize>,
}

/// Quantity that declares no unit.
struct Quantity {
    name: String,
    /// True for a definition made of declared units only.
    firm: bool,
    /// Origin of its inferred unit.
    from: String,
}

/// Number written in a formula.
struct Number {
    value: f64,
    text: String,
    place: Option<Place>,
}

/// Outcome of an equation between units.
pub(super) enum Outcome {
    Holds,
    /// The dimensions differ.
    Dimension,
    /// The factors differ; true if a number of the formula may be involved.
    Factor(bool),
}

pub(super) struct System {
    solved: HashMap<Key, Form>,
    quantities: Vec<Quantity>,
    numbers: Vec<Number>,
    known: Vec<(String, Form)>,
    pub findings: Vec<Finding>,
    /// True if some equation between known units involves time.
    pub uses_time: bool,
}

impl System {
    pub fn new(units: &Units, time: &str) -> System {
        let mut known: Vec<(String, Form)> =
            units.declared.iter().map(|(_, text, unit)| (text.clone(), Form::of(unit))).collect();
        known.retain(|(text, _)| !matches!(text.as_str(), "1" | "-" | ""));
        // Prefer mV/ms to its value in base units, and m/s^2 to m/s/s.
        let rates = known.iter().map(|(text, _)| format!("{text}/{time}"));
        let (long, rates): (Vec<String>, Vec<String>) = rates.partition(|text| text.matches('/').count() > 1);
        known.extend(rates.into_iter().chain(TOLD.map(String::from)).chain(long).map(|text| {
            let form = Form::of(&Unit::read(&text));
            (text, form)
        }));
        let (solved, quantities, numbers, findings) = Default::default();
        System { solved, quantities, numbers, known, findings, uses_time: false }
    }

    /// Adds a quantity without a unit.
    pub fn quantity(&mut self, name: &str) -> Form {
        self.quantities.push(Quantity { name: name.into(), firm: false, from: String::new() });
        Form::key(Key::Quantity(self.quantities.len() - 1))
    }

    /// Adds a named number.
    pub fn number(&mut self, value: f64, text: &str) -> Form {
        self.written(value, text, None)
    }

    /// Adds a number written in a formula.
    pub fn written(&mut self, value: f64, text: &str, place: Option<Place>) -> Form {
        if value == 0.0 || !value.is_finite() {
            return Form::any();
        }
        self.numbers.push(Number { value, text: text.into(), place });
        Form::key(Key::Number(self.numbers.len() - 1))
    }

    /// Form with all solved unknowns substituted.
    pub fn resolved(&self, form: &Form) -> Form {
        let mut form = form.clone();
        while let Some((key, power)) =
            form.powers.iter().find(|(key, _)| self.solved.contains_key(key)).map(|(k, p)| (k.clone(), *p))
        {
            form.powers.remove(&key);
            form = form.plus(&self.solved[&key], power);
        }
        form
    }

    /// Requires `residual` to be dimensionless. `strict`: a turn counts as 2π, not as 1.
    pub fn settle(&mut self, residual: &Form, strict: bool, place: &Place, from: &str) -> Outcome {
        if residual.any {
            return Outcome::Holds;
        }
        let residual = self.resolved(residual);
        if let Some((key, power)) = residual.unknown() {
            self.solve(key, power, residual, from);
            return Outcome::Holds;
        }
        self.uses_time |= residual.clock() != 0.0;
        if residual.dimension().next().is_some() {
            return self.carried(residual, place);
        }
        let traded = (residual.turns() + residual.radians()).abs() < SAME_FACTOR;
        let turned = residual.scale + residual.turns() * TAU.ln();
        let mut factors = vec![turned];
        if residual.turns() != 0.0 && !strict && !traded {
            factors.push(residual.scale);
        }
        let numbers: Vec<(usize, f64)> = residual.numbers().collect();
        for factor in factors {
            if factor.abs() < SAME_FACTOR {
                self.tie(&numbers);
                return Outcome::Holds;
            }
            if let Some(conversions) = self.conversions(factor, &numbers) {
                for (k, _) in &numbers {
                    let scale = if conversions.contains(k) { -self.numbers[*k].value.abs().ln() } else { 0.0 };
                    self.solved.insert(Key::Number(*k), Form { scale, ..Form::default() });
                }
                return Outcome::Holds;
            }
        }
        Outcome::Factor(numbers.iter().any(|(k, _)| !self.is_plain(*k)))
    }

    /// Solves for the unit of a definition, unless it follows from something else already.
    pub fn define(&mut self, goal: &Form, form: &Form, from: &str) -> bool {
        let Some((key @ Key::Quantity(k), _)) = goal.unknown() else { return false };
        if self.solved.contains_key(&key) || form.any || self.resolved(form).powers.contains_key(&key) {
            return false;
        }
        self.quantities[k].firm = self.is_firm(form);
        self.solve(key, 1.0, goal.plus(&self.resolved(form), -1.0), from);
        true
    }

    /// True if a unit follows from declared ones alone: a contradiction with it is an error regardless of the rest of
    /// the model.
    pub fn is_firm(&self, form: &Form) -> bool {
        form.powers.keys().all(|key| match key {
            Key::Quantity(k) => self.quantities[*k].firm,
            // A number taken for a quantity may have been meant otherwise.
            Key::Number(_) => self.solved.get(key).is_none_or(|own| own.dimension().next().is_none()),
            Key::Base(_) => true,
        })
    }

    /// Handles numbers whose units must cancel: one alone is dimensionless. The last of several follows from the
    /// others, which may still turn out to carry a unit.
    fn tie(&mut self, numbers: &[(usize, f64)]) {
        let (plain, mut others): (Vec<_>, Vec<_>) = numbers.iter().partition(|(k, _)| self.is_mathematical(*k));
        for (k, _) in plain {
            self.solved.insert(Key::Number(k), Form::default());
        }
        let Some((last, power)) = others.pop() else { return };
        let rest = Form { powers: others.into_iter().map(|(k, p)| (Key::Number(k), p)).collect(), ..Form::default() };
        self.solved.insert(Key::Number(last), rest.raised(-1.0 / power));
    }

    fn solve(&mut self, key: Key, power: f64, residual: Form, from: &str) {
        let mut rest = residual;
        rest.powers.remove(&key);
        if let Key::Quantity(k) = &key {
            self.quantities[*k].from = from.to_string();
        }
        self.solved.insert(key, rest.raised(-1.0 / power));
    }

    /// Handles different dimensions: a number of the formula may carry the difference.
    fn carried(&mut self, residual: Form, place: &Place) -> Outcome {
        let carrier = residual.numbers().filter(|(k, _)| !self.is_mathematical(*k)).last();
        let Some((k, power)) = carrier else { return Outcome::Dimension };
        self.solve(Key::Number(k), power, residual, "");
        let unit = self.shown(&Form::key(Key::Number(k)));
        let Number { text, place: own, .. } = &self.numbers[k];
        let Place { item, field, span } = own.clone().unwrap_or_else(|| place.clone());
        let message = format!("{text}{TAKEN_AS}{text} {unit}");
        let hint = format!("write it as a constant or parameter with its unit, as in `c = \"{text} {unit}\"`");
        self.findings.push(Finding { severity: Severity::Number, item, field, span, message, hint });
        Outcome::Holds
    }

    /// True for numbers that are part of formulas, as in mv²/2 and 2πf, and never carry a unit.
    fn is_mathematical(&self, k: usize) -> bool {
        matches!(self.numbers[k].value.abs(), 2.0 | 0.5 | PI)
    }

    /// True for numbers that are not conversion factors: the mathematical ones and 1.
    fn is_plain(&self, k: usize) -> bool {
        self.numbers[k].value.abs() == 1.0 || self.is_mathematical(k)
    }

    /// Smallest set of numbers that, as conversion factors, explain a factor e^scale; `None` if there is none.
    fn conversions(&self, scale: f64, numbers: &[(usize, f64)]) -> Option<Vec<usize>> {
        let able: Vec<(usize, f64)> = numbers
            .iter()
            .map(|(k, power)| (*k, power * self.numbers[*k].value.abs().ln()))
            .filter(|(_, log)| *log != 0.0)
            .collect();
        if able.len() > MOST_NUMBERS {
            return None;
        }
        let sum =
            |set: u32| able.iter().enumerate().filter(|(b, _)| set >> b & 1 == 1).map(|(_, (_, log))| log).sum::<f64>();
        let fits = |set: &u32| (scale - sum(*set)).abs() < SAME_FACTOR;
        let best = (1..1_u32 << able.len()).filter(fits).min_by_key(|set| set.count_ones())?;
        Some(able.iter().enumerate().filter(|(b, _)| best >> b & 1 == 1).map(|(_, (k, _))| *k).collect())
    }

    /// Unit as text.
    pub fn shown(&self, form: &Form) -> String {
        let mut form = self.resolved(form);
        // The unknown unit of x is written [x].
        let unknown: Vec<(Key, f64)> = form
            .powers
            .iter()
            .filter(|(key, _)| matches!(key, Key::Quantity(_)))
            .map(|(k, p)| (k.clone(), *p))
            .collect();
        for (key, power) in &unknown {
            form.powers.remove(key);
            if let Key::Quantity(k) = key {
                form.powers.insert(Key::Base(format!("[{}]", self.quantities[*k].name)), *power);
            }
        }
        form.shown(self.known.iter().map(|(text, form)| (text.as_str(), form.clone())))
    }

    /// Sentence on the inferred units of the quantities of a form.
    pub fn inferred(&self, names: &[(&str, Form)]) -> String {
        let mut told: Vec<String> = Vec::new();
        for (name, form) in names {
            let Some((Key::Quantity(k), _)) = form.unknown() else { continue };
            let Quantity { name: own, from, .. } = &self.quantities[k];
            if from.is_empty() || own != name {
                continue;
            }
            let text = format!("`{name}` in {} ({from})", self.shown(form));
            if !told.contains(&text) {
                told.push(text);
            }
        }
        told.truncate(3);
        if told.is_empty() { String::new() } else { format!("; with {}", told.join(", ")) }
    }

    /// True if two units differ at most in the unit of time.
    pub fn differs_in_time(&self, residual: &Form) -> bool {
        self.resolved(residual).dimension().all(|(name, _)| name == "s")
    }

    /// Ratio of two units of equal dimension, as text.
    pub fn apart(&self, residual: &Form) -> String {
        let residual = self.resolved(residual);
        let turned = residual.scale + residual.turns() * TAU.ln();
        short(turned.exp())
    }
}
