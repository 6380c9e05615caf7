//! Units of the names of a model.

use super::Units;
use super::form::{CLOCK, Form, Key};
use super::system::System;
use crate::model::error::Item;
use crate::model::source::ModelSource;
use crate::units::Unit;
use std::collections::HashMap;

/// Units of all names.
pub(super) struct Names<'a> {
    forms: HashMap<&'a str, Form>,
    time: Form,
    /// Argument and value of each table.
    pub tables: Vec<[Form; 2]>,
}

impl<'a> Names<'a> {
    pub fn new(source: &'a ModelSource, units: &Units, time: &str, system: &mut System) -> Names<'a> {
        let time = Form::of(&Unit::read(time)).plus(&Form::key(Key::Base(CLOCK.into())), 1.0);
        let mut forms: HashMap<&str, Form> = HashMap::new();
        let constants = source.constants.iter().enumerate();
        for (i, own) in constants {
            let form = match units.get(Item::Constant(i)) {
                Some(unit) => Form::of(unit),
                None => system.number(own.value, &own.name),
            };
            forms.insert(&own.name, form);
        }
        let parameters = source.parameters.iter().enumerate().map(|(i, p)| (&p.name, Item::Parameter(i)));
        let states = source.states.iter().enumerate().map(|(i, s)| (&s.name, Item::State(i)));
        let definitions = source.definitions.iter().enumerate().map(|(i, d)| (&d.name, Item::Definition(i)));
        for (name, item) in parameters.chain(states).chain(definitions) {
            let form = units.get(item).map_or_else(|| system.quantity(name), Form::of);
            forms.insert(name, form);
        }
        let mut table = |name: &String| {
            [system.quantity(&format!("the argument of {name}")), system.quantity(&format!("the value of {name}"))]
        };
        let tables = source.tables.iter().map(|own| table(&own.name)).collect();
        Names { forms, time, tables }
    }

    /// Unit of a name; dimensionless if the name is not one of the model.
    pub fn of(&self, name: &str) -> Form {
        self.forms.get(name).cloned().unwrap_or_default()
    }

    /// Unit of time.
    pub fn time(&self) -> Form {
        self.time.clone()
    }
}
