//! Studies of a smoothed law at twice its sharpness.

use super::{Study, parse_study};
use crate::diagnostic::Diagnostic;
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// Sections whose `parameters` may state a sharpness of their own.
const SECTIONS: [&str; 5] = ["seed", "homotopy", "explore", "survey", "sweep"];

/// Why a study cannot be repeated at another sharpness.
#[derive(Debug)]
pub enum Unsharpened {
    /// The sharpness does not stand in one place as a number.
    Elsewhere(String),
    /// Mistakes in the changed texts.
    Mistakes(Vec<Diagnostic>),
}

impl Study {
    /// Returns the study with twice the sharpness of its smoothed law: the parameter that [`Study::of_exact_law`] lets grow
    /// is doubled, or halved if it goes to zero.
    ///
    /// # Errors
    /// See [`Unsharpened`].
    pub fn sharpened(&self) -> Result<Study, Unsharpened> {
        let Some((index, to_zero)) = self.model.sharpness else {
            return Err(Unsharpened::Elsewhere("the model names no parameter that smooths its law".into()));
        };
        let name = &self.model.parameters[index].name;
        let factor = if to_zero { 0.5 } else { 2.0 };
        let (root, _) = DeTable::parse_recoverable(&self.text);
        let (of_model, _) = DeTable::parse_recoverable(&self.model_text);
        let stated = |table: &DeTable| {
            table
                .get("parameters")
                .and_then(|own| own.get_ref().as_table())
                .is_some_and(|own| own.contains_key(name.as_str()))
        };
        let sections = SECTIONS.iter().filter_map(|key| root.get_ref().get(*key)?.get_ref().as_array());
        let elsewhere = sections.flat_map(|list| list.iter()).any(|own| own.get_ref().as_table().is_some_and(stated));
        let place = match stated(root.get_ref()) {
            true => number(root.get_ref(), name),
            false => number(of_model.get_ref(), name),
        };
        let Some((span, value)) = place.filter(|_| !elsewhere) else {
            let places = "in the study under `parameters`, or in the model";
            return Err(Unsharpened::Elsewhere(format!("`{name}` is not a single number {places}")));
        };
        let (mut text, mut model_text) = (self.text.clone(), self.model_text.clone());
        let to = if stated(root.get_ref()) { &mut text } else { &mut model_text };
        to.replace_range(span, &format!("{:?}", factor * value));
        parse_study(&text, &self.file, &model_text, &self.model_file).map_err(Unsharpened::Mistakes)
    }
}

/// Place and value of a parameter that is given as a number.
fn number(root: &DeTable, name: &str) -> Option<(Range<usize>, f64)> {
    let own = root.get("parameters")?.get_ref().as_table()?.get(name)?;
    let value = match own.get_ref().as_table() {
        Some(table) => table.get("value")?,
        None => own,
    };
    let text = match value.get_ref() {
        DeValue::Integer(own) => own.as_str().to_string(),
        DeValue::Float(own) => own.as_str().to_string(),
        _ => return None,
    };
    Some((value.span(), text.replace('_', "").parse().ok()?))
}
