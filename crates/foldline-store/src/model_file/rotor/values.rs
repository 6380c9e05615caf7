//! Numbers and coefficients of a rotor.

use super::{Draft, Expression};
use crate::model_file::{Reader, inside};
use crate::toml_walk::Value;
use foldline::model::{Definition, Field, Item, ModelSource, Output, Parameter, constant_value};
use foldline::units::{Unit, quantity};
use foldline_shaft::{Coefficient, Rotor};
use std::ops::Range;
use toml::de::{DeTable, DeValue};

impl Reader<'_> {
    /// Reads a coefficient: a number, a number with a unit, the name of a constant or parameter, or an expression in
    /// SI units. The result is in `unit`, a coherent SI unit.
    pub(super) fn coefficient(
        &mut self,
        value: &Value,
        what: &str,
        unit: &str,
        source: &mut ModelSource,
        draft: &mut Draft,
    ) -> Option<Coefficient> {
        let Some(text) = value.get_ref().as_str() else {
            return self.walk.number(value, what).map(Coefficient::number);
        };
        if quantity(text).is_some() {
            return self.walk.quantity(value, what, unit).map(Coefficient::number);
        }
        let name = text.trim();
        if let Ok(number) = name.parse::<f64>() {
            return Some(Coefficient::number(number));
        }
        if let Some(i) = source.constants.iter().position(|own| own.name == name) {
            let (own, number) = (source.constants[i].unit.clone(), source.constants[i].value);
            let factor = self.factor(value, what, name, Item::Constant(i), &own, unit)?;
            return Some(Coefficient::number(factor * number));
        }
        if let Some(i) = source.parameters.iter().position(|own| own.name == name && own.repeat.is_none()) {
            let own = source.parameters[i].unit.clone();
            let factor = self.factor(value, what, name, Item::Parameter(i), &own, unit)?;
            return Some(Coefficient { factor, text: Some(name.to_string()) });
        }
        let text = self.walk.string(value, what)?;
        // Equal expressions are one definition, so that kxx and kyy may be compared.
        let known = draft.expressions.iter().find(|own| own.text == text && own.unit == unit);
        let name = known.map(|own| own.name.clone()).unwrap_or_else(|| {
            let name = format!("rotor_c_{}", draft.expressions.len());
            let item = Item::Definition(source.definitions.len());
            self.places.insert((item, Field::Name), value.span());
            self.places.insert((item, Field::Expression), value.span());
            source.definitions.push(Definition::new(&name, &text));
            let (unit, what) = (unit.to_string(), what.to_string());
            draft.expressions.push(Expression { name: name.clone(), text, unit, what, span: value.span() });
            name
        });
        Some(Coefficient { factor: 1.0, text: Some(name) })
    }

    /// Number of `unit`s in one unit of a constant or parameter; a quantity without a unit is in `unit`.
    fn factor(&mut self, value: &Value, what: &str, name: &str, item: Item, own: &str, unit: &str) -> Option<f64> {
        if !self.measured.contains(&item) {
            return Some(1.0);
        }
        match Unit::read(own).convert(1.0, &Unit::read(unit)) {
            Ok(factor) => Some(factor),
            Err(why) => {
                let message =
                    format!("{what} is `{name}`, which is in {own}; that cannot be converted to {unit}: {why}");
                self.walk.report(
                    value.span(),
                    message,
                    format!("give `{name}` in {unit} or in a unit of the same dimension"),
                );
                None
            }
        }
    }

    /// Reads a number that no parameter changes, in `unit`: masses and dimensions, from which the mass matrix is
    /// computed once.
    pub(super) fn fixed(&mut self, value: &Value, what: &str, unit: &str, source: &ModelSource) -> Option<f64> {
        let Some(text) = value.get_ref().as_str() else { return self.walk.number(value, what) };
        if quantity(text).is_some() {
            return self.walk.quantity(value, what, unit);
        }
        let name = text.trim();
        if let Some(i) = source.constants.iter().position(|own| own.name == name) {
            let (own, number) = (source.constants[i].unit.clone(), source.constants[i].value);
            return self.factor(value, what, name, Item::Constant(i), &own, unit).map(|factor| factor * number);
        }
        let words = || text.split(|c: char| !(c.is_alphanumeric() || c == '_'));
        if let Some(own) = source.parameters.iter().find(|own| words().any(|word| word == own.name)) {
            let message = format!("{what} depends on the parameter `{}`", own.name);
            let hint = format!(
                "move `{}` to [constants]: the mass and stiffness matrices of the shaft are computed when the model is read",
                own.name
            );
            self.walk.report(value.span(), message, hint);
            return None;
        }
        let scaled = source.constants.iter().enumerate().find(|(i, own)| {
            let coherent = || Unit::read(&own.unit).fraction_to(&Unit::read(unit)) == Ok([1.0, 1.0]);
            words().any(|word| word == own.name) && self.measured.contains(&Item::Constant(*i)) && !coherent()
        });
        if let Some((_, own)) = scaled {
            let message = format!("{what} is computed from `{}`, which is in {}", own.name, own.unit);
            let hint = format!(
                "use constants without a unit, or in {unit}, in such an expression; its value is taken in {unit}"
            );
            self.walk.report(value.span(), message, hint);
            return None;
        }
        match constant_value(text, &source.constants) {
            Ok(number) => Some(number),
            Err(error) => {
                let span = error.span.clone().and_then(|span| inside(self.text, &value.span(), &span));
                self.walk.report(span.unwrap_or(value.span()), format!("{what}: {}", error.message), error.hint);
                None
            }
        }
    }

    /// Reads a required number of a table, positive if `positive`, otherwise not negative.
    pub(super) fn needed(
        &mut self,
        (span, table): (&Range<usize>, &DeTable),
        key: &str,
        [whose, unit, example]: [&str; 3],
        source: &ModelSource,
    ) -> Option<f64> {
        let Some(value) = table.get(key) else {
            self.walk.report(span.clone(), format!("{whose} has no `{key}`"), format!("write `{key} = {example}`"));
            return None;
        };
        self.positive(value, &format!("`{key}` of {whose}"), unit, source)
    }

    /// Reads a positive number.
    pub(super) fn positive(&mut self, value: &Value, what: &str, unit: &str, source: &ModelSource) -> Option<f64> {
        let number = self.fixed(value, what, unit, source)?;
        if number <= 0.0 {
            self.walk.report(value.span(), format!("{what} is {number} {unit}"), "give a positive number");
            return None;
        }
        Some(number)
    }

    /// Reads true or false.
    pub(super) fn truth(&mut self, table: &DeTable, key: &str, otherwise: bool) -> bool {
        let Some(value) = table.get(key) else { return otherwise };
        value.get_ref().as_bool().unwrap_or_else(|| {
            self.walk.report(
                value.span(),
                format!("`{key}` is neither true nor false"),
                format!("write `{key} = false`"),
            );
            otherwise
        })
    }

    /// Reads the station of a part: `node`, or `at` with a position along the shaft.
    pub(super) fn station(
        &mut self,
        span: &Range<usize>,
        table: &DeTable,
        whose: &str,
        rotor: &Rotor,
        source: &ModelSource,
    ) -> Option<usize> {
        match (table.get("node"), table.get("at")) {
            (Some(value), None) => self.station_of(value, whose, rotor),
            (None, Some(value)) => {
                let position = self.fixed(value, &format!("the position of {whose}"), "m", source)?;
                let near = rotor
                    .stations
                    .iter()
                    .enumerate()
                    .filter_map(|(k, own)| Some((k, (own.position? - position).abs())));
                let nearest = near.min_by(|a, b| a.1.total_cmp(&b.1));
                match nearest {
                    Some((k, distance)) if distance <= 1e-6 * rotor.length() => Some(k),
                    _ => {
                        let places: Vec<String> =
                            rotor.stations.iter().filter_map(|own| Some(format!("{}", own.position?))).collect();
                        let message = format!("{whose} is at {position} m, where the shaft has no node");
                        let hint = format!(
                            "the nodes are at {} m; give `positions` to the shaft to add one",
                            places.join(", ")
                        );
                        self.walk.report(value.span(), message, hint);
                        None
                    }
                }
            }
            (Some(_), Some(value)) => {
                self.walk.report(value.span(), format!("{whose} has both `node` and `at`"), "keep one of them");
                None
            }
            (None, None) => {
                let hint = "write `node = 0`, or `at = \"0.5 m\"` for a position along the shaft";
                self.walk.report(span.clone(), format!("{whose} has no node"), hint);
                None
            }
        }
    }

    /// Reads the number of a node, or the name of a support.
    pub(super) fn station_of(&mut self, value: &Value, whose: &str, rotor: &Rotor) -> Option<usize> {
        let name = match value.get_ref() {
            DeValue::String(text) => text.to_string(),
            DeValue::Integer(integer) => integer.as_str().to_string(),
            _ => {
                self.walk.report(value.span(), format!("the node of {whose} is not a number"), "write `node = 0`");
                return None;
            }
        };
        let found = rotor.stations.iter().position(|own| own.name == name);
        if found.is_none() {
            let supports: Vec<&str> = rotor.stations[rotor.nodes..].iter().map(|own| own.name.as_str()).collect();
            let others =
                if supports.is_empty() { String::new() } else { format!("; the supports are {}", supports.join(", ")) };
            let message = format!("{whose}: there is no node {name}");
            self.walk.report(value.span(), message, format!("the nodes are 0 to {}{others}", rotor.nodes - 1));
        }
        found
    }

    /// Adds the coefficients of a rotor, and its forces, to a model whose units are checked: as outputs that must have
    /// their unit.
    pub(super) fn check_expressions(&mut self, checked: &mut ModelSource, draft: &Draft) {
        let mut add = |reader: &mut Self, name: &str, expression: &str, unit: &str, span: &Range<usize>| {
            let item = Item::Output(checked.outputs.len());
            reader.places.insert((item, Field::Name), span.clone());
            reader.places.insert((item, Field::Expression), span.clone());
            reader.measured.insert(item);
            checked.outputs.push(Output { unit: unit.into(), ..Output::new(name, expression) });
        };
        for own in &draft.expressions {
            add(self, &own.what, &own.text, &own.unit, &own.span);
        }
        for (function, _, span) in &draft.forces {
            let call = format!("{function}(rotor_place, rotor_place, rotor_rate, rotor_rate)");
            add(self, "the force", &call, "N", span);
        }
        // The coefficients are checked as outputs, not as definitions of unknown unit.
        for (name, unit) in [("rotor_place", "m"), ("rotor_rate", "m/s")] {
            self.measured.insert(Item::Parameter(checked.parameters.len()));
            checked.parameters.push(Parameter { unit: unit.into(), ..Parameter::new(name, 1.0) });
        }
    }
}
